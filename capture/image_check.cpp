// SPDX-License-Identifier: Apache-2.0
#include "capture/image_check.hpp"

#include <fmt/format.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "capture/image_structure.hpp"
#include "core/files/picture_head.hpp"

namespace drape::capture {
namespace {

constexpr const char* copy_again = "copy the image again from its source, or leave this set out";

cv::Mat decode(std::span<const unsigned char> bytes) {
  const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8UC1,
                        const_cast<unsigned char*>(bytes.data()));  // imdecode does not write
  try {
    return cv::imdecode(encoded, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    return {};  // an exception from the decoder means the same as an empty result
  }
}

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
  if (has_more_pages(bytes))
    throw bad_input("the TIFF has several pages", where, "save the one that is meant as a PNG");
  const cv::Mat image = decode(bytes);
  if (image.empty()) throw bad_input("the image cannot be decoded", where, copy_again);
  if (image.depth() != CV_8U && image.depth() != CV_16U)
    throw bad_input("the image has neither 8 nor 16 bit per channel", where,
                    "save it as an 8 or 16 bit grey PNG; floats and 32 bit numbers are not read");
  return {image.cols, image.rows};
}

}  // namespace drape::capture
