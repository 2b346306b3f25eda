// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

namespace drape::capture {

/// Cycle of a device's frame ids: first, first + 1, ..., last, first, ... GigE Vision counts
/// 1..65535 and skips 0 (GigE Vision 2.0, block_id); V4L2 counts 32 bits.
struct FrameIdRange {
  std::uint64_t first = 1;
  std::uint64_t last = 65535;

  void check() const;  ///< throws Error(usage) for fewer than two ids
};

/// Converts wrapping frame ids to a count that never wraps: 0 for the first frame seen,
/// negative for earlier frames that arrive late. A camera that counts beyond the range has
/// 64-bit ids (GigE Vision 2.0, extended ids), which do not wrap. An id is assigned to the
/// count nearest to the newest frame, so gaps and delays of up to half the range are
/// distinguished from a wrap.
class FrameIdUnwrapper {
 public:
  explicit FrameIdUnwrapper(FrameIdRange range);

  /// nullopt if `id` is below the range.
  [[nodiscard]] std::optional<std::int64_t> unwrap(std::uint64_t id);

 private:
  FrameIdRange range_;
  std::int64_t newest_ = 0;
  std::optional<std::uint64_t> newest_id_;
};

}  // namespace drape::capture
