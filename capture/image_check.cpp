// SPDX-License-Identifier: Apache-2.0
#include "capture/image_check.hpp"

#include <fmt/format.h>

#include <opencv2/core.hpp>

#include "capture/image_structure.hpp"
#include "core/pictures/picture.hpp"

namespace drape::capture {
namespace {

constexpr const char* copy_again = "copy the image again from its source, or leave this set out";

}  // namespace

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
