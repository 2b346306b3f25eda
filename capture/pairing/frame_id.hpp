// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

namespace drape::capture {

/// The values a device gives its frame ids: first, first + 1, ..., last, first, ...
/// GigE Vision counts 1..65535 and skips 0 (GigE Vision 2.0, block_id); V4L2 counts 32 bits.
struct FrameIdRange {
  std::uint64_t first = 1;
  std::uint64_t last = 65535;

  void check() const;  ///< throws Error(usage) when the range holds fewer than two ids
};

/// Turns wrapped frame ids into a count that never wraps: 0 for the first frame seen, negative for
/// frames that were sent before it and arrive late. A camera that counts beyond the range has ids
/// of 64 bit (GigE Vision 2.0, extended ids), which do not wrap. A frame is taken to be the one
/// nearest to the newest frame seen, so gaps and delays up to half the range are distinguished from
/// a wrap.
class FrameIdUnwrapper {
 public:
  explicit FrameIdUnwrapper(FrameIdRange range);

  /// Nothing when `id` is below the range.
  [[nodiscard]] std::optional<std::int64_t> unwrap(std::uint64_t id);

 private:
  FrameIdRange range_;
  std::int64_t newest_ = 0;
  std::optional<std::uint64_t> newest_id_;
};

}  // namespace drape::capture
