// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace drape::capture {

/// Storage of pixels in bytes.
enum class Packing {
  bytes,        ///< one byte per sample
  words,        ///< two bytes per sample, low byte first, value in the low bits
  lsb,          ///< samples without gaps, lowest bit first (PFNC "p")
  gige_packed,  ///< GigE Vision "Packed": two samples in three bytes, low bits in the middle byte
  yuyv,         ///< Y0 U Y1 V; only Y is used
  uyvy,         ///< U Y0 V Y1
  nv12,         ///< plane of Y, then one of U and V at half size
  rgb,          ///< three bytes per pixel; the middle one, green, is used
  jpeg          ///< one lossy JPEG picture per frame
};

/// Colour filter pattern: first two pixels of the first row.
enum class Mosaic { none, gr, rg, gb, bg };

/// A pixel format with its name in cameras.toml, from PFNC (GenICam) or V4L2.
struct PixelFormat {
  std::string_view name;
  std::uint32_t code = 0;  ///< code of PFNC, or four characters of V4L2
  int bits = 8;            ///< bits per sample
  Packing packing = Packing::bytes;
  Mosaic mosaic = Mosaic::none;

  [[nodiscard]] bool lossy() const { return packing == Packing::jpeg; }
  /// True if the grey picture holds all the data sent; otherwise the raw bytes are worth keeping.
  [[nodiscard]] bool is_grey() const;
  /// Bytes per row without padding; of the Y plane for nv12; 0 for jpeg.
  [[nodiscard]] std::size_t row_bytes(int width_px) const;
  /// Bytes of a frame with rows of `stride_bytes`; 0 for jpeg, whose size varies.
  [[nodiscard]] std::size_t frame_bytes(std::size_t stride_bytes, int height_px) const;
};

/// Every supported format, best for measuring first.
[[nodiscard]] std::span<const PixelFormat> pixel_formats();
/// Finds a format by PFNC's or V4L2's name, or by code. Null if unknown.
[[nodiscard]] const PixelFormat* find_pixel_format(std::string_view name);
[[nodiscard]] const PixelFormat* find_pixel_format(std::uint32_t code);

/// Samples of one frame, row by row, on the sensor's own scale 0 .. 2^bits - 1.
struct Samples {
  int width_px = 0, height_px = 0, bits = 8;
  std::vector<std::uint16_t> values;
};

/// Extracts the sensor's samples: the mosaic of a colour sensor, Y of YUV, green of RGB. Throws
/// Error(device) if `bytes` lacks part of the frame. `stride_bytes` 0: rows without padding.
[[nodiscard]] Samples unpack(const PixelFormat& format, std::span<const std::uint8_t> bytes,
                             int width_px, int height_px, std::size_t stride_bytes = 0);

/// Grey values for measuring. For a mosaic, green: green pixels unchanged, others the mean of their
/// two to four green neighbours, rounded half up. A lens focuses and displaces red and blue
/// differently, so one colour is used; one-sided interpolation would shift edges, so neighbours are
/// symmetric. Averaging without sharpening can only reduce noise.
[[nodiscard]] Samples grey_of(Samples samples, Mosaic mosaic);

}  // namespace drape::capture
