// SPDX-License-Identifier: Apache-2.0
#include "capture/device/camera.hpp"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/files/files.hpp"

namespace drape::capture {
namespace {

constexpr std::uint32_t fourcc(const char (&text)[5]) {
  std::uint32_t code = 0;
  for (int i = 3; i >= 0; --i) code = code << 8 | static_cast<unsigned char>(text[i]);
  return code;
}

using enum Packing;
using enum Mosaic;

// From PFNC 2.4 (EMVA) and the kernel's videodev2.h. Mono8 first: it needs the least bandwidth.
constexpr PixelFormat kFormats[] = {
    {"Mono8", 0x01080001, 8, bytes, none},
    {"GREY", fourcc("GREY"), 8, bytes, none},
    {"Mono12", 0x01100005, 12, words, none},
    {"Mono12p", 0x010C0047, 12, lsb, none},
    {"Mono12Packed", 0x010C0006, 12, gige_packed, none},
    {"Mono10", 0x01100003, 10, words, none},
    {"Mono10p", 0x010A0046, 10, lsb, none},
    {"Mono10Packed", 0x010C0004, 10, gige_packed, none},
    {"Mono14", 0x01100025, 14, words, none},
    {"Mono14p", 0x010E0104, 14, lsb, none},
    {"Mono16", 0x01100007, 16, words, none},
    {"Y16", fourcc("Y16 "), 16, words, none},
    {"Y12", fourcc("Y12 "), 12, words, none},
    {"Y10", fourcc("Y10 "), 10, words, none},
    {"BayerGR8", 0x01080008, 8, bytes, gr},
    {"BayerRG8", 0x01080009, 8, bytes, rg},
    {"BayerGB8", 0x0108000A, 8, bytes, gb},
    {"BayerBG8", 0x0108000B, 8, bytes, bg},
    {"GRBG", fourcc("GRBG"), 8, bytes, gr},
    {"RGGB", fourcc("RGGB"), 8, bytes, rg},
    {"GBRG", fourcc("GBRG"), 8, bytes, gb},
    {"BA81", fourcc("BA81"), 8, bytes, bg},
    {"BayerGR12", 0x01100010, 12, words, gr},
    {"BayerRG12", 0x01100011, 12, words, rg},
    {"BayerGB12", 0x01100012, 12, words, gb},
    {"BayerBG12", 0x01100013, 12, words, bg},
    {"BayerGR12p", 0x010C0057, 12, lsb, gr},
    {"BayerRG12p", 0x010C0059, 12, lsb, rg},
    {"BayerGB12p", 0x010C0055, 12, lsb, gb},
    {"BayerBG12p", 0x010C0053, 12, lsb, bg},
    {"BayerGR12Packed", 0x010C002A, 12, gige_packed, gr},
    {"BayerRG12Packed", 0x010C002B, 12, gige_packed, rg},
    {"BayerGB12Packed", 0x010C002C, 12, gige_packed, gb},
    {"BayerBG12Packed", 0x010C002D, 12, gige_packed, bg},
    {"BayerGR10", 0x0110000C, 10, words, gr},
    {"BayerRG10", 0x0110000D, 10, words, rg},
    {"BayerGB10", 0x0110000E, 10, words, gb},
    {"BayerBG10", 0x0110000F, 10, words, bg},
    {"BayerGR10p", 0x010A0056, 10, lsb, gr},
    {"BayerRG10p", 0x010A0058, 10, lsb, rg},
    {"BayerGB10p", 0x010A0054, 10, lsb, gb},
    {"BayerBG10p", 0x010A0052, 10, lsb, bg},
    {"BayerGR10Packed", 0x010C0026, 10, gige_packed, gr},
    {"BayerRG10Packed", 0x010C0027, 10, gige_packed, rg},
    {"BayerGB10Packed", 0x010C0028, 10, gige_packed, gb},
    {"BayerBG10Packed", 0x010C0029, 10, gige_packed, bg},
    {"YUV422_8_UYVY", 0x0210001F, 8, uyvy, none},
    {"YUV422_8", 0x02100032, 8, yuyv, none},
    {"YCbCr422_8", 0x0210003B, 8, yuyv, none},
    {"UYVY", fourcc("UYVY"), 8, uyvy, none},
    {"YUYV", fourcc("YUYV"), 8, yuyv, none},
    {"NV12", fourcc("NV12"), 8, nv12, none},
    {"NM12", fourcc("NM12"), 8, nv12, none},
    {"RGB8", 0x02180014, 8, rgb, none},
    {"BGR8", 0x02180015, 8, rgb, none},
    {"RGB3", fourcc("RGB3"), 8, rgb, none},
    {"BGR3", fourcc("BGR3"), 8, rgb, none},
    {"MJPG", fourcc("MJPG"), 8, jpeg, none},
};

/// Names of the same format in older cameras.
constexpr std::pair<std::string_view, std::string_view> kOtherNames[] = {
    {"RGB8Packed", "RGB8"},
    {"BGR8Packed", "BGR8"},
    {"YUV422Packed", "YUV422_8_UYVY"},
    {"YUV422_YUYV_Packed", "YUV422_8"},
};

Error bad_frame(const std::string& what) {
  return {ErrorKind::device, what, {}, "choose another pixel_format, or another camera"};
}

std::uint16_t sample(Packing packing, int bits, const std::uint8_t* row, std::size_t x) {
  switch (packing) {
    case bytes:
    case nv12:
      return row[x];
    case words:
      return static_cast<std::uint16_t>((row[2 * x] | row[2 * x + 1] << 8) & ((1 << bits) - 1));
    case lsb: {
      const std::size_t at = x * static_cast<std::size_t>(bits), first = at / 8;
      const std::size_t last = (at + static_cast<std::size_t>(bits) - 1) / 8;
      std::uint32_t value = 0;
      for (std::size_t i = last + 1; i-- > first;) value = value << 8 | row[i];
      return static_cast<std::uint16_t>(value >> (at % 8) & ((1U << bits) - 1));
    }
    case gige_packed: {
      // Bytes 0 and 2 are the high bits; byte 1 the low bits, the first sample's in its low half.
      const std::uint8_t* three = row + x / 2 * 3;
      const int low = bits - 8;
      const int high = x % 2 == 0 ? three[0] : three[2];
      const int rest = x % 2 == 0 ? three[1] : three[1] >> 4;
      return static_cast<std::uint16_t>(high << low | (rest & ((1 << low) - 1)));
    }
    case yuyv:
      return row[2 * x];
    case uyvy:
      return row[2 * x + 1];
    case rgb:
      return row[3 * x + 1];
    case jpeg:
      break;
  }
  return 0;
}

Samples decode_jpeg(std::span<const std::uint8_t> data, int width_px, int height_px) {
  const cv::Mat file(1, static_cast<int>(data.size()), CV_8U,
                     const_cast<std::uint8_t*>(data.data()));  // imdecode does not write
  cv::Mat grey;
  try {
    if (begins_as_picture(data))
      grey = cv::imdecode(file, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {  // reported below
  }
  if (grey.cols != width_px || grey.rows != height_px)
    throw bad_frame("a frame is no JPEG picture of the size that was set");
  return {width_px, height_px, 8, {grey.begin<std::uint8_t>(), grey.end<std::uint8_t>()}};
}

/// True if the pixel is green.
bool is_green(Mosaic mosaic, int x, int y) {
  const bool first = mosaic == gr || mosaic == gb;
  return ((x + y) % 2 == 0) == first;
}

}  // namespace

bool PixelFormat::is_grey() const {
  return mosaic == none &&
         (packing == bytes || packing == words || packing == lsb || packing == gige_packed);
}

std::size_t PixelFormat::row_bytes(int width_px) const {
  constexpr int kPixelBits[] = {8, 16, 0, 12, 16, 16, 8, 24, 0};  // by packing
  const int pixel_bits = packing == lsb ? bits : kPixelBits[static_cast<std::size_t>(packing)];
  return (static_cast<std::size_t>(width_px) * static_cast<std::size_t>(pixel_bits) + 7) / 8;
}

std::size_t PixelFormat::frame_bytes(std::size_t stride_bytes, int height_px) const {
  const std::size_t rows = stride_bytes * static_cast<std::size_t>(height_px);
  return packing == nv12 ? rows + rows / 2 : rows;
}

std::span<const PixelFormat> pixel_formats() {
  return kFormats;
}

const PixelFormat* find_pixel_format(std::string_view name) {
  for (const auto& [other, usual] : kOtherNames)
    if (name == other) name = usual;
  const auto* found = std::ranges::find(kFormats, name, &PixelFormat::name);
  return found == std::end(kFormats) ? nullptr : found;
}

const PixelFormat* find_pixel_format(std::uint32_t code) {
  const auto* found = std::ranges::find(kFormats, code, &PixelFormat::code);
  return found == std::end(kFormats) ? nullptr : found;
}

Samples unpack(const PixelFormat& format, std::span<const std::uint8_t> data, int width_px,
               int height_px, std::size_t stride_bytes) {
  if (width_px <= 0 || height_px <= 0) throw bad_frame("a frame without pixels");
  if (format.packing == jpeg) return decode_jpeg(data, width_px, height_px);
  const std::size_t row_bytes = format.row_bytes(width_px);
  const bool odd = (format.packing == lsb || format.packing == gige_packed) && stride_bytes == 0;
  // Packed formats without padding continue from row to row.
  const auto width = static_cast<std::size_t>(width_px);
  const auto height = static_cast<std::size_t>(height_px);
  const std::size_t run = odd ? width * height : width;
  const std::size_t stride = odd ? 0 : std::max(stride_bytes, row_bytes);
  const std::size_t needed =
      odd ? format.row_bytes(static_cast<int>(run)) : stride * (height - 1) + row_bytes;
  if (data.size() < needed) throw bad_frame("a frame is shorter than its pixel format says");
  Samples samples{width_px, height_px, format.bits, std::vector<std::uint16_t>(width * height)};
  for (std::size_t y = 0; y < (odd ? 1 : height); ++y)
    for (std::size_t x = 0; x < run; ++x)
      samples.values[y * width + x] =
          sample(format.packing, format.bits, data.data() + y * stride, x);
  return samples;
}

Samples grey_of(Samples samples, Mosaic mosaic) {
  if (mosaic == none) return samples;
  const int width = samples.width_px, height = samples.height_px;
  const auto at = [&](int x, int y) -> std::uint16_t& {
    return samples.values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                          static_cast<std::size_t>(x)];
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (is_green(mosaic, x, y)) continue;
      // All neighbours of a non-green pixel are green, and green pixels are not modified.
      std::uint32_t sum = 0, count = 0;
      for (const auto& [nx, ny] : {std::pair{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}}) {
        if (nx < 0 || ny < 0 || nx >= width || ny >= height) continue;
        sum += at(nx, ny);
        ++count;
      }
      if (count > 0) at(x, y) = static_cast<std::uint16_t>((sum + count / 2) / count);
    }
  return samples;
}

}  // namespace drape::capture
