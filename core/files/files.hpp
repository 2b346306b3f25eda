// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.hpp"

namespace drape {

/// Whole file as text. Throws Error(bad_input) naming the file when it cannot be read, is no
/// regular file (folder, device, pipe) or is larger than 2 GiB.
[[nodiscard]] std::string read_text(const std::filesystem::path& file);

/// Whole file as bytes. Throws like read_text.
[[nodiscard]] std::vector<unsigned char> read_bytes(const std::filesystem::path& file);

/// Writes all or nothing, durably: temporary name, fsync, rename, fsync of the folder. Creates
/// missing folders; replaces a regular file only. Throws Error(bad_input) naming the file and the
/// system's reason.
void write_durable(const std::filesystem::path& file, std::string_view content);

/// Refuses a place that holds something else than a regular file: device, link, folder.
void require_replaceable(const std::filesystem::path& file);

/// Removes the file, durably; nothing when it is not there.
void remove_durable(const std::filesystem::path& file);

/// Refuses a name of something (camera, set, drape) that could not be one component of a path: 1 to
/// 200 bytes, no `/`, `\`, comma or control character, no `.` or `-` in front.
void require_plain_name(const std::string& name, const Where& where);

/// `folder / name` for a name that stands in a file: a relative path of plain components.
[[nodiscard]] std::filesystem::path name_inside(const std::filesystem::path& folder,
                                                const std::string& name, const Where& where);

/// Bytes of a file named in another file of `folder`; a link that leads out of it is refused.
[[nodiscard]] std::vector<unsigned char> read_inside(const std::filesystem::path& folder,
                                                     const std::string& name, const Where& where);

/// Held while a program writes at one place. The system frees it when the process dies.
class WriterLock {
 public:
  /// Makes the lock file, with its folder. Throws Error(bad_input) with `held` as its sentence when
  /// another program holds it.
  WriterLock(const std::filesystem::path& file, const std::string& held);
  ~WriterLock();
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;

 private:
  std::filesystem::path file_;
  int fd_ = -1;
};

/// A new folder below TMPDIR, removed in the end. Throws Error(bad_input) with `purpose` as its
/// sentence when it cannot be made.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(const std::string& purpose);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Lower-case hexadecimal SHA-256.
[[nodiscard]] std::string sha256_of(std::span<const unsigned char> bytes);
[[nodiscard]] std::string sha256_of(std::string_view text);
[[nodiscard]] std::string sha256_of_file(const std::filesystem::path& file);

/// Text for a terminal: control characters, which could move the cursor or recolour, become `?`;
/// tabs and line ends stay.
[[nodiscard]] std::string printable(std::string text);

}  // namespace drape
