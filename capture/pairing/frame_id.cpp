// SPDX-License-Identifier: Apache-2.0
#include "capture/pairing/frame_id.hpp"

#include "core/error.hpp"

namespace drape::capture {

void FrameIdRange::check() const {
  if (last <= first)
    throw usage_error("the range of frame ids is empty", "give first and last, first below last");
}

FrameIdUnwrapper::FrameIdUnwrapper(FrameIdRange range) : range_(range) {
  range_.check();
}

std::optional<std::int64_t> FrameIdUnwrapper::unwrap(std::uint64_t id) {
  if (id < range_.first || id > range_.last) return std::nullopt;
  if (!newest_id_) {
    newest_id_ = id;
    return 0;
  }
  const auto period = static_cast<std::int64_t>(range_.last - range_.first + 1);
  std::int64_t step = static_cast<std::int64_t>(id) - static_cast<std::int64_t>(*newest_id_);
  if (step > period / 2) step -= period;
  if (step < -(period / 2)) step += period;
  const std::int64_t unwrapped = newest_ + step;
  if (step > 0) {
    newest_ = unwrapped;
    newest_id_ = id;
  }
  return unwrapped;
}

}  // namespace drape::capture
