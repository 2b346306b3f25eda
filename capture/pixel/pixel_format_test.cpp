// SPDX-License-Identifier: Apache-2.0
#include "capture/device/camera.hpp"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>

namespace drape::capture {
namespace {

constexpr int kWidth_px = 26, kHeight_px = 11;

std::vector<std::uint16_t> samples_of(int bits, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint16_t> values;
  values.reserve(kWidth_px * kHeight_px);
  for (int i = 0; i < kWidth_px * kHeight_px; ++i)
    values.push_back(static_cast<std::uint16_t>(random() & ((1U << bits) - 1)));
  return values;
}

/// Packs samples as a string of bits, as the PFNC standard draws the "p" formats: sample after
/// sample, lowest bit first, cut into bytes whose lowest bit comes first.
std::vector<std::uint8_t> bit_string(const std::vector<std::uint16_t>& values, int bits) {
  std::string text;
  for (const std::uint16_t v : values)
    for (int b = 0; b < bits; ++b) text += (v >> b & 1) != 0 ? '1' : '0';
  while (text.size() % 8 != 0) text += '0';
  std::vector<std::uint8_t> bytes(text.size() / 8, 0);
  for (std::size_t i = 0; i < text.size(); ++i)
    if (text[i] == '1') bytes[i / 8] |= static_cast<std::uint8_t>(1U << i % 8);
  return bytes;
}

/// Packs by GigE Vision 1.2 (Mono10Packed, Mono12Packed): byte 0 has the first sample's high 8
/// bits, byte 2 the second's; byte 1 the low bits, first sample from bit 0, second from bit 4.
std::vector<std::uint8_t> three_bytes(const std::vector<std::uint16_t>& values, int bits) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < values.size(); i += 2) {
    const unsigned low = (1U << (bits - 8)) - 1;
    bytes.push_back(static_cast<std::uint8_t>(values[i] / (low + 1)));
    bytes.push_back(static_cast<std::uint8_t>((values[i] & low) + 16 * (values[i + 1] & low)));
    bytes.push_back(static_cast<std::uint8_t>(values[i + 1] / (low + 1)));
  }
  return bytes;
}

/// Packs as each standard defines, independently of the product's code.
std::vector<std::uint8_t> packed(const PixelFormat& format,
                                 const std::vector<std::uint16_t>& values) {
  std::vector<std::uint8_t> bytes;
  switch (format.packing) {
    case Packing::lsb:
      return bit_string(values, format.bits);
    case Packing::gige_packed:
      return three_bytes(values, format.bits);
    case Packing::words:
      for (const std::uint16_t v : values) {
        bytes.push_back(static_cast<std::uint8_t>(v % 256));
        bytes.push_back(static_cast<std::uint8_t>(v / 256));
      }
      return bytes;
    case Packing::yuyv:
    case Packing::uyvy:
      for (const std::uint16_t v : values) {
        const auto y = static_cast<std::uint8_t>(v);
        const std::uint8_t colour = 77;
        bytes.push_back(format.packing == Packing::yuyv ? y : colour);
        bytes.push_back(format.packing == Packing::yuyv ? colour : y);
      }
      return bytes;
    case Packing::rgb:
      for (const std::uint16_t v : values)
        for (const int part : {3, static_cast<int>(v), 5})
          bytes.push_back(static_cast<std::uint8_t>(part));
      return bytes;
    case Packing::nv12:
    case Packing::bytes:
      bytes.assign(values.begin(), values.end());
      if (format.packing == Packing::nv12) bytes.resize(bytes.size() + bytes.size() / 2, 128);
      return bytes;
    case Packing::jpeg:
      break;
  }
  return bytes;
}

TEST(PixelFormat, EveryPackingIsUnpackedBitForBit) {
  int formats = 0;
  for (const PixelFormat& format : pixel_formats()) {
    if (format.lossy()) continue;
    const auto values = samples_of(format.bits, 7 + static_cast<unsigned>(formats));
    const Samples samples = unpack(format, packed(format, values), kWidth_px, kHeight_px);
    EXPECT_EQ(samples.values, values) << format.name;
    EXPECT_EQ(samples.bits, format.bits) << format.name;
    EXPECT_EQ(find_pixel_format(format.name), &format);
    EXPECT_EQ(find_pixel_format(format.code), &format);
    ++formats;
  }
  EXPECT_EQ(formats, static_cast<int>(pixel_formats().size()) - 1);
}

TEST(PixelFormat, RowsWithPaddingAreUnpackedAndShortFramesRefused) {
  for (const char* name : {"Mono8", "Mono12", "YUYV", "RGB8"}) {
    const PixelFormat& format = *find_pixel_format(name);
    const auto values = samples_of(format.bits, 3);
    const auto tight = packed(format, values);
    const std::size_t row = format.row_bytes(kWidth_px), stride = row + 6;
    std::vector<std::uint8_t> padded(stride * kHeight_px, 0xEE);
    for (std::size_t y = 0; y < kHeight_px; ++y)
      std::copy_n(tight.begin() + static_cast<std::ptrdiff_t>(y * row), row,
                  padded.begin() + static_cast<std::ptrdiff_t>(y * stride));
    EXPECT_EQ(unpack(format, padded, kWidth_px, kHeight_px, stride).values, values) << name;
    padded.resize(stride * (kHeight_px - 1) + row - 1);
    EXPECT_THROW(static_cast<void>(unpack(format, padded, kWidth_px, kHeight_px, stride)), Error);
  }
}

TEST(PixelFormat, JpegIsDecodedAndMarkedLossy) {
  const PixelFormat& format = *find_pixel_format("MJPG");
  EXPECT_TRUE(format.lossy());
  cv::Mat picture(48, 64, CV_8UC1);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) picture.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(3 * x);
  std::vector<std::uint8_t> file;
  cv::imencode(".jpg", picture, file, {cv::IMWRITE_JPEG_QUALITY, 95});
  const Samples samples = unpack(format, file, 64, 48);
  for (std::size_t i = 0; i < samples.values.size(); ++i)
    EXPECT_NEAR(samples.values[i], 3 * static_cast<double>(i % 64), 4) << i;
  EXPECT_THROW(static_cast<void>(unpack(format, file, 32, 48)), Error) << "another size";
  EXPECT_THROW(
      static_cast<void>(unpack(
          format, samples_of(8, 1).empty() ? file : std::vector<std::uint8_t>(100, 7), 64, 48)),
      Error);
}

/// Green pixels keep their value, and a ramp of green extends over the others without a shift.
TEST(PixelFormat, GreyOfAMosaicIsGreen) {
  for (const Mosaic mosaic : {Mosaic::gr, Mosaic::rg, Mosaic::gb, Mosaic::bg}) {
    Samples samples{20, 14, 12, std::vector<std::uint16_t>(20 * 14)};
    const int green_at = mosaic == Mosaic::gr || mosaic == Mosaic::gb ? 0 : 1;
    for (int y = 0; y < 14; ++y)
      for (int x = 0; x < 20; ++x)
        samples.values[static_cast<std::size_t>(y) * 20 + x] =
            static_cast<std::uint16_t>((x + y) % 2 == green_at ? 100 + 10 * x + 6 * y : 4000);
    const Samples grey = grey_of(samples, mosaic);
    for (int y = 1; y < 13; ++y)
      for (int x = 1; x < 19; ++x)
        EXPECT_EQ(grey.values[static_cast<std::size_t>(y) * 20 + x], 100 + 10 * x + 6 * y);
  }
}

}  // namespace
}  // namespace drape::capture
