// SPDX-License-Identifier: Apache-2.0
#include "capture/capture.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "core/files/files.hpp"
#include "core/pictures/picture.hpp"

namespace drape::capture {
namespace {

using Bytes = std::span<const unsigned char>;
using Fault = std::optional<std::string>;

constexpr std::string_view png_signature = "\x89PNG\r\n\x1a\n";

// ---- PNG (ISO/IEC 15948, section 5) -------------------------------------------------------

std::string chunk_name(Bytes type) {
  std::string name;
  for (const unsigned char c : type) name += std::isalpha(c) != 0 ? static_cast<char>(c) : '?';
  return name;
}

Fault png_fault(Bytes bytes) {
  std::size_t offset = png_signature.size();
  bool has_pixels = false;
  while (true) {
    const auto length = unsigned_at(as_text(bytes), offset, 4);
    if (!length || bytes.size() - offset < 12) return "ends before its last chunk (IEND)";
    const Bytes type = bytes.subspan(offset + 4, 4);
    const std::string name = chunk_name(type);
    if (*length > bytes.size() - offset - 12) return fmt::format("ends inside chunk {}", name);
    const uLong crc = ::crc32_z(::crc32_z(0, nullptr, 0), type.data(), std::size_t{*length} + 4);
    if (crc != unsigned_at(as_text(bytes), offset + 8 + *length, 4)) {
      return fmt::format("is damaged in chunk {} (checksum differs)", name);
    }
    if (name == "acTL") return "is an animation of several pictures";
    has_pixels = has_pixels || name == "IDAT";
    if (name == "IEND") return has_pixels ? Fault() : "holds no pixels";
    offset += std::size_t{*length} + 12;
  }
}

// ---- JPEG (ITU-T T.81, annex B) -----------------------------------------------------------

constexpr unsigned char marker_start_of_scan = 0xda;
constexpr unsigned char marker_end_of_image = 0xd9;

bool is_parameterless(unsigned marker) {
  return marker == 0x01 || (marker >= 0xd0 && marker <= 0xd8);
}

/// Offset of the next marker after entropy-coded data; skips restarts and stuffed bytes.
std::size_t skip_scan(Bytes bytes, std::size_t offset) {
  for (; offset + 1 < bytes.size(); ++offset) {
    if (bytes[offset] != 0xff) continue;
    const unsigned next = bytes[offset + 1];
    if (next != 0 && next != 0xff && !(next >= 0xd0 && next <= 0xd7)) return offset;
  }
  return bytes.size();
}

Fault jpeg_fault(Bytes bytes) {
  std::size_t offset = 2;
  bool has_pixels = false;
  while (true) {
    while (offset < bytes.size() && bytes[offset] == 0xff)
      ++offset;  // marker prefix and fill bytes
    if (offset >= bytes.size()) return "ends before its end marker (EOI)";
    if (bytes[offset - 1] != 0xff) return fmt::format("is damaged at byte {} (no marker)", offset);
    const unsigned marker = bytes[offset++];
    if (marker == marker_end_of_image) return has_pixels ? Fault() : "holds no pixels";
    if (is_parameterless(marker)) continue;
    const auto length = unsigned_at(as_text(bytes), offset, 2);
    if (!length || *length > bytes.size() - offset) {
      return fmt::format("ends inside segment 0x{:02x}", marker);
    }
    if (*length < 2) return fmt::format("is damaged at byte {} (segment length)", offset);
    offset += *length;
    if (marker == marker_start_of_scan) {
      has_pixels = true;
      offset = skip_scan(bytes, offset);
    }
  }
}

// ---- TIFF 6.0 (section 2) -----------------------------------------------------------------

constexpr std::uint64_t strip_offsets = 273;
constexpr std::uint64_t strip_byte_counts = 279;
constexpr std::uint64_t tile_offsets = 324;
constexpr std::uint64_t tile_byte_counts = 325;

struct TiffFile {
  Bytes bytes;
  bool little_endian = true;

  [[nodiscard]] std::optional<std::uint64_t> at(std::size_t offset, std::size_t width) const {
    return unsigned_at(as_text(bytes), offset, width, little_endian);
  }

  /// Offset of an entry's values, which lie in the entry itself if they fit into four bytes.
  /// nullopt if they extend beyond the end of the file or their type is unknown.
  [[nodiscard]] std::optional<std::size_t> values_offset(std::size_t entry) const {
    constexpr std::array<std::size_t, 13> type_sizes = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8};
    const auto type = at(entry + 2, 2);
    const auto count = at(entry + 4, 4);
    if (!type || !count || *type == 0 || *type >= type_sizes.size()) return std::nullopt;
    const std::size_t length = std::size_t{*count} * type_sizes[*type];
    if (length <= 4) return entry + 8;
    const auto offset = at(entry + 8, 4);
    if (!offset || *offset + length > bytes.size()) return std::nullopt;
    return *offset;
  }

  /// Values of an entry of SHORT or LONG integers; nullopt for other types.
  [[nodiscard]] std::optional<std::vector<std::uint64_t>> values(std::size_t entry) const {
    const auto offset = values_offset(entry);
    const std::uint64_t type = at(entry + 2, 2).value_or(0);
    const std::size_t width = type == 3 ? 2 : 4;
    if (!offset || type < 3 || type > 4) return std::nullopt;
    std::vector<std::uint64_t> result(*at(entry + 4, 4));
    for (std::size_t i = 0; i < result.size(); ++i) result[i] = *at(*offset + i * width, width);
    return result;
  }
};

Fault tiff_fault(Bytes bytes) {
  const TiffFile file{bytes, bytes[0] == 'I'};
  if (file.at(2, 2) != 42U) return "is a BigTIFF; save it as plain TIFF or PNG";
  const auto directory = file.at(4, 4);
  const auto entries = directory ? file.at(*directory, 2) : std::nullopt;
  // A directory ends with the offset of the next one, which must be present even if it is zero.
  if (!entries || !file.at(*directory + 2 + std::size_t{*entries} * 12, 4)) {
    return "ends inside its image directory";
  }
  std::optional<std::vector<std::uint64_t>> offsets;
  std::optional<std::vector<std::uint64_t>> counts;
  for (std::size_t i = 0; i < *entries; ++i) {
    const std::size_t entry = *directory + 2 + i * 12;
    const std::uint64_t tag = file.at(entry, 2).value_or(0);
    if (!file.values_offset(entry)) {
      return fmt::format("ends before the values of its directory entry {}", tag);
    }
    if (tag == strip_offsets || tag == tile_offsets) offsets = file.values(entry);
    if (tag == strip_byte_counts || tag == tile_byte_counts) counts = file.values(entry);
  }
  if (!offsets || !counts || offsets->empty() || offsets->size() != counts->size()) {
    return "has no usable table of its pixel strips";
  }
  for (std::size_t i = 0; i < offsets->size(); ++i) {
    if (std::size_t{(*offsets)[i]} + (*counts)[i] > bytes.size()) {
      return fmt::format("ends inside pixel strip {} of {}", i + 1, offsets->size());
    }
  }
  return std::nullopt;
}

constexpr const char* copy_again = "copy the image again from its source, or leave this set out";

}  // namespace

std::optional<ImageFormat> image_format(Bytes bytes) {
  using namespace std::string_view_literals;
  const std::string_view text = as_text(bytes);
  if (text.starts_with(png_signature)) return ImageFormat::png;
  if (text.starts_with("\xff\xd8\xff")) return ImageFormat::jpeg;
  for (const auto tiff : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv})
    if (text.starts_with(tiff)) return ImageFormat::tiff;
  return std::nullopt;
}

std::optional<std::string> structure_fault(ImageFormat format, Bytes bytes) {
  constexpr Fault (*kFaults[])(Bytes) = {png_fault, jpeg_fault, tiff_fault};  // by format
  return kFaults[static_cast<std::size_t>(format)](bytes);
}

ImageSize check_image(std::span<const unsigned char> bytes, const Where& where) {
  if (bytes.empty()) throw bad_input("the image file is empty", where, copy_again);
  const auto format = image_format(bytes);
  if (!format) {
    throw bad_input("the file is not a PNG, JPEG or TIFF image", where,
                    "save the image as PNG; other formats cannot be imported");
  }
  if (const auto fault = structure_fault(*format, bytes)) {
    throw bad_input(fmt::format("the image file {}", *fault), where, copy_again);
  }
  const cv::Mat image = decode_picture(bytes, where, copy_again);
  return {image.cols, image.rows};
}

}  // namespace drape::capture
