// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace drape::console {

/// A folder of its own for what need not last, in memory where there is such a place. Only its
/// owner may look into it. It goes with this object; one whose program was killed goes when the
/// same user makes the next.
class MemoryFolder {
 public:
  /// Throws Error(bad_input) when `place` cannot be written to.
  explicit MemoryFolder(const std::filesystem::path& place = in_memory());
  ~MemoryFolder();
  MemoryFolder(const MemoryFolder&) = delete;
  MemoryFolder& operator=(const MemoryFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  [[nodiscard]] static std::filesystem::path in_memory();

  std::filesystem::path path_;
  int lock_ = -1;  ///< held as long as the program lives
};

}  // namespace drape::console
