// SPDX-License-Identifier: Apache-2.0
#include "detect/image/image.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/files/picture_head.hpp"

namespace drape::detect {
namespace {

constexpr const char* record_again =
    "record or import this set again with images of the camera's full size, 8 or 16 bit";

/// A PNG states its size in the first bytes: a wrong size is refused before any memory is
/// allocated.
void check_png_size(std::span<const unsigned char> bytes, int width_px, int height_px,
                    const Where& where) {
  constexpr std::array<unsigned char, 8> signature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  if (bytes.size() < 24 || !std::equal(signature.begin(), signature.end(), bytes.begin())) return;
  const auto big_endian = [&](std::size_t at) {
    return (static_cast<std::uint32_t>(bytes[at]) << 24) | (bytes[at + 1] << 16) |
           (bytes[at + 2] << 8) | bytes[at + 3];
  };
  const std::uint32_t width = big_endian(16);
  const std::uint32_t height = big_endian(20);
  if (width == static_cast<std::uint32_t>(width_px) &&
      height == static_cast<std::uint32_t>(height_px)) {
    return;
  }
  throw bad_input(fmt::format("the image is {}x{} px, the rig's camera has {}x{} px", width, height,
                              width_px, height_px),
                  where, record_again);
}

cv::Mat decode(std::span<const unsigned char> bytes, const Where& where) {
  if (has_more_pages(bytes))
    throw bad_input("the TIFF has several pages", where,
                    "save the one that is meant as a PNG, and record or import this set again");
  cv::Mat picture;
  try {
    if (begins_as_picture(bytes)) {
      const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8U,
                           const_cast<unsigned char*>(bytes.data()));
      picture = cv::imdecode(buffer, cv::IMREAD_UNCHANGED);
    }
  } catch (const cv::Exception& problem) {
    throw bad_input(fmt::format("the image cannot be decoded: {}", problem.err), where,
                    record_again);
  }
  if (picture.empty()) throw bad_input("the file is not a readable image", where, record_again);
  return picture;
}

cv::Mat to_grey(const cv::Mat& picture, const Where& where) {
  if (picture.depth() != CV_8U && picture.depth() != CV_16U) {
    throw bad_input("the image has neither 8 nor 16 bit per pixel", where, record_again);
  }
  if (picture.channels() == 1) return picture;
  cv::Mat grey;
  if (picture.channels() == 3) {
    cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  } else if (picture.channels() == 4) {
    cv::cvtColor(picture, grey, cv::COLOR_BGRA2GRAY);
  } else {
    throw bad_input(fmt::format("the image has {} channels", picture.channels()), where,
                    record_again);
  }
  return grey;
}

}  // namespace

GreyImage decode_image(std::span<const unsigned char> bytes, int width_px, int height_px,
                       const Where& where) {
  check_png_size(bytes, width_px, height_px, where);
  const cv::Mat grey = to_grey(decode(bytes, where), where);
  if (grey.cols != width_px || grey.rows != height_px) {
    throw bad_input(fmt::format("the image is {}x{} px, the rig's camera has {}x{} px", grey.cols,
                                grey.rows, width_px, height_px),
                    where, record_again);
  }
  GreyImage image{width_px, height_px, {}, {}};
  image.bytes.resize(static_cast<std::size_t>(width_px) * height_px);
  cv::Mat narrow(height_px, width_px, CV_8U, image.bytes.data());
  if (grey.depth() == CV_8U) {
    grey.copyTo(narrow);
    return image;
  }
  constexpr double to_8_bit = 255.0 / 65535.0;
  grey.convertTo(narrow, CV_8U, to_8_bit);
  image.levels.resize(image.bytes.size());
  cv::Mat deep(height_px, width_px, CV_32F, image.levels.data());
  grey.convertTo(deep, CV_32F, to_8_bit);
  return image;
}

std::vector<unsigned char> half_scale_jpeg(const GreyImage& image) {
  const cv::Mat full(image.height_px, image.width_px, CV_8U,
                     const_cast<std::uint8_t*>(image.bytes.data()));
  cv::Mat half;
  cv::resize(full, half, {}, 0.5, 0.5, cv::INTER_AREA);
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", half, bytes, {cv::IMWRITE_JPEG_QUALITY, 85});
  return bytes;
}

}  // namespace drape::detect
