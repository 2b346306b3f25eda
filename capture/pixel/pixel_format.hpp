// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace drape::capture {

/// Packing of pixels into bytes.
enum class Packing {
  bytes,        ///< one byte a sample
  words,        ///< two bytes a sample, low byte first, value in the low bits
  lsb,          ///< samples one after another without gaps, lowest bit first (PFNC "p")
  gige_packed,  ///< GigE Vision "Packed": two samples in three bytes, low bits in the middle one
  yuyv,         ///< Y0 U Y1 V; Y is taken
  uyvy,         ///< U Y0 V Y1
  nv12,         ///< plane of Y, then one of U and V at half the size
  rgb,          ///< three bytes a pixel; the middle one, green, is taken
  jpeg          ///< one JPEG picture a frame: lossy
};

/// Colour filter of the first two pixels of the first row.
enum class Mosaic { none, gr, rg, gb, bg };

/// A pixel format by its name in cameras.toml: that of PFNC (GenICam) or of V4L2.
struct PixelFormat {
  std::string_view name;
  std::uint32_t code = 0;  ///< PFNC's, or V4L2's four characters
  int bits = 8;            ///< in a sample
  Packing packing = Packing::bytes;
  Mosaic mosaic = Mosaic::none;

  [[nodiscard]] bool lossy() const { return packing == Packing::jpeg; }
  /// The grey picture holds all that was sent; otherwise the raw bytes are worth keeping.
  [[nodiscard]] bool is_grey() const;
  /// Bytes of a row without padding; of the Y plane for nv12, 0 for jpeg.
  [[nodiscard]] std::size_t row_bytes(int width_px) const;
  /// Bytes of a frame whose rows take `stride_bytes`; 0 for jpeg, which varies.
  [[nodiscard]] std::size_t frame_bytes(std::size_t stride_bytes, int height_px) const;
};

/// Every format that is understood, best for measuring first.
[[nodiscard]] std::span<const PixelFormat> pixel_formats();
/// Null when the name or code is none of them. A name may be PFNC's or V4L2's.
[[nodiscard]] const PixelFormat* find_pixel_format(std::string_view name);
[[nodiscard]] const PixelFormat* find_pixel_format(std::uint32_t code);

/// Samples of one frame, row by row, on the sensor's own scale 0 .. 2^bits - 1.
struct Samples {
  int width_px = 0, height_px = 0, bits = 8;
  std::vector<std::uint16_t> values;
};

/// The sensor's samples as sent: the mosaic of a colour sensor, Y of YUV, green of RGB. Throws
/// Error(device) when `bytes` do not hold the frame. `stride_bytes` 0 means rows without padding.
[[nodiscard]] Samples unpack(const PixelFormat& format, std::span<const std::uint8_t> bytes,
                             int width_px, int height_px, std::size_t stride_bytes = 0);

/// Grey for measuring. Of a mosaic that is green: green pixels as they are, the others the mean of
/// their green neighbours (two to four), rounded half up. One colour alone, because a lens focuses
/// and displaces red and blue differently, and neighbours all around, because a one-sided
/// interpolation would move an edge. Nothing is sharpened, so noise only falls.
[[nodiscard]] Samples grey_of(Samples samples, Mosaic mosaic);

}  // namespace drape::capture
