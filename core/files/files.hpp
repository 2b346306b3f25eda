// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
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

/// Owns a file descriptor; -1 when closed.
class Descriptor {
 public:
  explicit Descriptor(int descriptor = -1) : descriptor_(descriptor) {}
  ~Descriptor() { reset(); }
  Descriptor(Descriptor&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);  // `other` closes what was open here
    return *this;
  }
  void reset();
  [[nodiscard]] int get() const { return descriptor_; }

 private:
  int descriptor_;
};

/// Lock held while a program writes an output. The system releases it when the process dies.
class WriterLock {
 public:
  /// Creates the lock file and its folder. Throws Error(bad_input) with the message `held` if
  /// another program holds the lock.
  WriterLock(const std::filesystem::path& file, const std::string& held);
  ~WriterLock();

 private:
  std::filesystem::path file_;
  Descriptor held_;
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

/// Like write_durable, for a name found in a file; refuses the names that read_inside refuses.
void write_inside(const std::filesystem::path& folder, const std::string& name,
                  std::string_view content, const Where& where);

/// Throws Error(bad_input) for a link to a file that does not exist.
void require_target(const std::filesystem::path& file);

/// The same bytes as text.
[[nodiscard]] std::string_view as_text(std::span<const unsigned char> bytes);

/// Unsigned integer of `width` bytes, at most 8; nullopt if they extend beyond the end.
[[nodiscard]] std::optional<std::uint64_t> unsigned_at(std::string_view bytes, std::size_t offset,
                                                       std::size_t width,
                                                       bool little_endian = false);

/// True if a file begins like a PNG, JPEG, TIFF, BMP, PGM or PPM, and is not a DICOM file
/// with such a beginning. Call this before decoding: OpenCV's DICOM reader aborts on some
/// inputs.
[[nodiscard]] bool begins_as_picture(std::span<const unsigned char> bytes);

/// Columns of finite numbers, e.g. one Kawabata curve. `#` starts a comment line.
struct Csv {
  std::filesystem::path file;
  std::vector<std::string> names;            ///< column headers with units
  std::vector<std::vector<double>> columns;  ///< columns[k][row]
  std::vector<int> lines;                    ///< 1-based line of each row
};

/// Reads a CSV; its header must equal `names` if these are given. Throws Error naming file, line
/// and column for a wrong header, a missing or surplus cell, and a value that is not a finite
/// number.
[[nodiscard]] Csv read_csv(const std::filesystem::path& file,
                           const std::vector<std::string>& names = {});

/// CSV of arbitrary text; a cell in double quotes may contain commas and doubled quotes.
struct CsvText {
  std::filesystem::path file;
  int head_line = 0;  ///< 1-based line of the header
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> rows;  ///< each as long as `names`
  std::vector<int> lines;                      ///< 1-based line of each row

  /// Index of a column; throws Error naming the file and the available columns.
  [[nodiscard]] std::size_t column(const std::string& name) const;
  [[nodiscard]] bool has(const std::string& name) const;
  /// Finite number in a cell, nullopt if it is empty; throws Error naming line and column.
  [[nodiscard]] std::optional<double> number(std::size_t row, const std::string& name) const;
};

/// Reads any CSV with a header. Throws Error for rows of different length and an unclosed quote.
[[nodiscard]] CsvText read_csv_text(const std::filesystem::path& file);

/// Formats one cell, quoted if necessary. Text that a spreadsheet would run as a formula (starts
/// with = + - @ and is not a number) gets an apostrophe in front.
[[nodiscard]] std::string csv_cell(const std::string& text);

/// Text of a CSV file; numbers in their shortest exact form.
[[nodiscard]] std::string csv_text(const std::vector<std::string>& names,
                                   const std::vector<std::vector<double>>& columns);

}  // namespace drape
