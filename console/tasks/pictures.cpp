// SPDX-License-Identifier: Apache-2.0
#include "console/tasks/pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.hpp"
#include "core/files/picture_head.hpp"

namespace drape::console {
namespace {

constexpr int kLeastWidth = 80, kMostWidth = 1600;
constexpr int kJpegQuality = 80;
constexpr std::size_t kMostPixels = std::size_t{1} << 26;  // largest picture of a recording
constexpr int kLongestSide = 32767;                        // px; a JPEG has room for 65500

cv::Mat decoded(std::span<const unsigned char> bytes) {
  const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1,
                    const_cast<unsigned char*>(bytes.data()));
  cv::Mat image;
  try {
    if (begins_as_picture(bytes))
      image = cv::imdecode(
          raw, cv::IMREAD_ANYDEPTH | cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty() || (image.depth() != CV_8U && image.depth() != CV_16U) ||
      image.total() > kMostPixels || std::max(image.rows, image.cols) > kLongestSide)
    throw bad_input("the image cannot be read", {}, "take the set again");
  return image;
}

}  // namespace

Picture make_picture(std::span<const unsigned char> bytes, int width_px, bool mark_saturation) {
  const cv::Mat image = decoded(bytes);
  const double full = image.depth() == CV_16U ? 65535 : 255;
  // Sensors with 10 or 12 bits use the high bits of 16.
  const cv::Mat bright = image >= (image.depth() == CV_16U ? full - 63 : full);
  const int width = std::min(std::clamp(width_px, kLeastWidth, kMostWidth), image.cols);
  const cv::Size size(
      width, std::max(1, static_cast<int>(
                             std::lround(static_cast<double>(image.rows) * width / image.cols))));
  cv::Mat small, mask, shown;
  cv::resize(image, small, size, 0, 0, cv::INTER_AREA);
  if (small.depth() == CV_16U) small.convertTo(small, CV_8U, 1.0 / 257);
  shown = small;
  Picture picture;
  picture.saturated_fraction =
      static_cast<double>(cv::countNonZero(bright)) / static_cast<double>(image.total());
  if (mark_saturation) {
    cv::cvtColor(small, shown, cv::COLOR_GRAY2BGR);
    cv::Mat spread;
    bright.convertTo(spread, CV_32F);
    cv::resize(spread, spread, size, 0, 0, cv::INTER_AREA);
    shown.setTo(cv::Scalar(40, 40, 230), spread > 0);
  }
  std::vector<unsigned char> jpeg;
  cv::imencode(".jpg", shown, jpeg, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  picture.jpeg.assign(jpeg.begin(), jpeg.end());
  return picture;
}

Picture PictureShelf::picture(const Recording& recording, const FrameSet& set,
                              const RecordedFrame& frame, int width_px, bool mark_saturation) {
  const std::string key = fmt::format("{} {} {}", frame.sha256, width_px, mark_saturation);
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = pictures_.find(key); found != pictures_.end()) return found->second;
  }
  Picture made = make_picture(read_frame(recording, set, frame), width_px, mark_saturation);
  const std::lock_guard lock(mutex_);
  if (pictures_.emplace(key, made).second) {
    order_.push_back(key);
    bytes_ += made.jpeg.size();
  }
  while (bytes_ > kMostBytes && order_.size() > 1) {
    bytes_ -= pictures_.at(order_.front()).jpeg.size();
    pictures_.erase(order_.front());
    order_.pop_front();
  }
  return made;
}

}  // namespace drape::console
