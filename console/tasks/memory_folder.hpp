// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace drape::console {

/// A private folder for temporary files, in memory if possible. Only its owner can access it. It is
/// removed with this object; one whose program was killed is removed when the same user makes the
/// next.
class MemoryFolder {
 public:
  /// Throws Error(bad_input) if `place` is not writable.
  explicit MemoryFolder(const std::filesystem::path& place = in_memory());
  ~MemoryFolder();
  MemoryFolder(const MemoryFolder&) = delete;
  MemoryFolder& operator=(const MemoryFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  [[nodiscard]] static std::filesystem::path in_memory();

  std::filesystem::path path_;
  int lock_ = -1;  ///< held during the life of the program
};

}  // namespace drape::console
