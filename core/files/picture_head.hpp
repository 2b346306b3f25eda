// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

namespace drape {

/// True if a file begins like a PNG, JPEG, TIFF, BMP, PGM or PPM, and is not a DICOM file
/// with such a beginning. Call this before decoding: OpenCV's DICOM reader aborts on some
/// inputs.
[[nodiscard]] inline bool begins_as_picture(std::span<const unsigned char> bytes) {
  using namespace std::string_view_literals;
  constexpr std::array signatures = {"\x89PNG\r\n\x1a\n"sv,
                                     "\xff\xd8\xff"sv,
                                     "II*\0"sv,
                                     "MM\0*"sv,
                                     "II+\0"sv,
                                     "MM\0+"sv,
                                     "BM"sv,
                                     "P2"sv,
                                     "P3"sv,
                                     "P5"sv,
                                     "P6"sv};
  const std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return all.substr(0, 132).find("DICM", 128) == all.npos &&
         std::any_of(signatures.begin(), signatures.end(),
                     [&](auto signature) { return all.starts_with(signature); });
}

/// True if a TIFF or BigTIFF has a second page; decoders silently read the first one only.
[[nodiscard]] inline bool has_more_pages(std::span<const unsigned char> bytes) {
  if (!begins_as_picture(bytes) || bytes[0] != bytes[1]) return false;  // "II" or "MM"
  const auto at = [&](std::size_t offset, std::size_t width) {  // 0 beyond the end of the file
    std::size_t value = 0;
    if (offset > bytes.size() || bytes.size() - offset < width) return value;
    for (std::size_t i = 0; i < width; ++i)
      value = value << 8 | bytes[offset + (bytes[0] == 'I' ? width - 1 - i : i)];
    return value;
  };
  const bool big = at(2, 2) == 43;
  const std::size_t address = big ? 8 : 4, count = big ? 8 : 2, entry = big ? 20 : 12;
  const std::size_t page = at(address, address);
  return at(page + count + entry * at(page, count), address) != 0;
}

}  // namespace drape
