// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.hpp"

namespace drape {

/// Reads a whole file as text. Throws Error(bad_input) naming the file if it cannot be read, is not
/// a regular file (folder, device, pipe) or is larger than 2 GiB.
[[nodiscard]] std::string read_text(const std::filesystem::path& file);

/// Reads a whole file as bytes. Throws like read_text.
[[nodiscard]] std::vector<unsigned char> read_bytes(const std::filesystem::path& file);

/// Writes all or nothing, durably: temporary name, fsync, rename, fsync of the folder. Creates
/// missing folders; replaces a regular file only. Throws Error(bad_input) naming the file and the
/// system's reason.
void write_durable(const std::filesystem::path& file, std::string_view content);

/// Throws if the path holds anything but a regular file: a device, link or folder.
void require_replaceable(const std::filesystem::path& file);

/// Removes a file durably; does nothing if it does not exist.
void remove_durable(const std::filesystem::path& file);

/// Throws if a name (of a camera, set, drape) cannot be one component of a path: 1 to 200 bytes, no
/// `/`, `\`, comma or control character, not starting with `.` or `-`.
void require_plain_name(const std::string& name, const Where& where);

/// `folder / name` for a name found in a file: a relative path of plain components.
[[nodiscard]] std::filesystem::path name_inside(const std::filesystem::path& folder,
                                                const std::string& name, const Where& where);

/// Reads a file that another file of `folder` names; refuses a link that leads out of the folder.
[[nodiscard]] std::vector<unsigned char> read_inside(const std::filesystem::path& folder,
                                                     const std::string& name, const Where& where);

/// Lock held while a program writes an output. The system releases it when the process dies.
class WriterLock {
 public:
  /// Creates the lock file and its folder. Throws Error(bad_input) with the message `held` if
  /// another program holds the lock.
  WriterLock(const std::filesystem::path& file, const std::string& held);
  ~WriterLock();
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;

 private:
  std::filesystem::path file_;
  int fd_ = -1;
};

/// A new folder below TMPDIR, removed on destruction. Throws Error(bad_input) with the message
/// `purpose` if it cannot be created.
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

/// Makes text safe for a terminal: control characters, which could move the cursor or change
/// colours, become `?`; tabs and newlines stay.
[[nodiscard]] std::string printable(std::string text);

}  // namespace drape
