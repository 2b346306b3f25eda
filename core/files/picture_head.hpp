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

}  // namespace drape
