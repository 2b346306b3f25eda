// SPDX-License-Identifier: Apache-2.0
#include "capture/pairing/frame_id.hpp"

#include "core/error.hpp"

namespace drape::capture {

namespace {

constexpr std::uint64_t kLast64 = 0x7FFFFFFFFFFFFFFF;
constexpr std::uint64_t kFarthest = 1000;  ///< largest plausible gap, in frames

}  // namespace

void FrameIdRange::check() const {
  if (last <= first)
    throw usage_error("the range of frame ids is empty", "give first and last, first below last");
}

FrameIdUnwrapper::FrameIdUnwrapper(FrameIdRange range) : range_(range) {
  range_.check();
}

std::optional<std::int64_t> FrameIdUnwrapper::unwrap(std::uint64_t id) {
  if (id < range_.first) return std::nullopt;
  const bool beyond = id > range_.last;  // extended ids continue where 16 bits would wrap
  const bool wraps = !beyond && range_.last < kLast64;
  if (!wraps && newest_id_ && id > *newest_id_ && id - *newest_id_ > kFarthest) return std::nullopt;
  if (beyond) range_.last = kLast64;
  if (!newest_id_) {
    newest_id_ = id;
    return 0;
  }
  std::int64_t step = static_cast<std::int64_t>(id) - static_cast<std::int64_t>(*newest_id_);
  if (wraps) {
    const auto period = static_cast<std::int64_t>(range_.last - range_.first + 1);
    if (step > period / 2) step -= period;
    if (step < -(period / 2)) step += period;
  }
  const std::int64_t unwrapped = newest_ + step;
  if (step > 0) {
    newest_ = unwrapped;
    newest_id_ = id;
  }
  return unwrapped;
}

}  // namespace drape::capture
