// SPDX-License-Identifier: Apache-2.0
#include "console/tasks/still_watch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include "core/statistics/sample.hpp"

namespace drape::console {
namespace {

constexpr int kLevels = 256;
constexpr double kLost_s = 2;  ///< time without a picture
constexpr double kMedianToSigma = 1.4826;
using Counts = std::array<std::int64_t, kLevels>;

double grey_contrast(const std::vector<unsigned char>& pixels) {
  Counts counts{};
  for (const unsigned char level : pixels) ++counts[level];
  return counted_quantile(counts, 0.95) - counted_quantile(counts, 0.05);
}

}  // namespace

StillWatch::StillWatch(std::vector<std::string> cameras, StillOptions options)
    : cameras_(std::move(cameras)), options_(options) {
  for (const std::string& camera : cameras_) views_[camera] = {};
}

bool StillWatch::moved(const Grey& before, const Grey& now) const {
  if (before.pixels.size() != now.pixels.size()) return true;
  Counts counts{};
  for (std::size_t i = 0; i < now.pixels.size(); ++i)
    ++counts[static_cast<std::size_t>(std::abs(int{now.pixels[i]} - int{before.pixels[i]}))];
  // Edges are few, so the median is noise; rounding to whole levels has 1/sqrt(12) of a level.
  const double sigma =
      std::max(kMedianToSigma * counted_quantile(counts, 0.5), std::sqrt(2.0 / 12.0));
  const double limit = std::max(options_.changed_contrast * grey_contrast(now.pixels),
                                options_.changed_sigmas * sigma);
  std::int64_t changed = 0;
  for (int level = 0; level < kLevels; ++level)
    if (level > limit) changed += counts[static_cast<std::size_t>(level)];
  return static_cast<double>(changed) >
         options_.moving_fraction * static_cast<double>(now.pixels.size());
}

bool StillWatch::is_new(const Grey& before, const Grey& now) const {
  if (before.pixels.size() != now.pixels.size()) return true;
  const int size = options_.block_px;
  const double limit = options_.changed_contrast * grey_contrast(now.pixels) * size * size;
  int blocks = 0, changed = 0;
  for (int top = 0; top + size <= now.height_px; top += size)
    for (int left = 0; left + size <= now.width_px; left += size, ++blocks) {
      int difference = 0;
      for (int y = top; y < top + size; ++y)
        for (int x = left; x < left + size; ++x) {
          const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(now.width_px) +
                         static_cast<std::size_t>(x);
          difference += int{now.pixels[i]} - int{before.pixels[i]};
        }
      if (std::abs(difference) > limit) ++changed;
    }
  return changed > options_.new_fraction * blocks;
}

void StillWatch::see(const std::string& camera, std::span<const unsigned char> bytes, double at_s) {
  const auto found = views_.find(camera);
  if (found == views_.end()) return;
  const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1,
                    const_cast<unsigned char*>(bytes.data()));
  cv::Mat image;
  try {
    image = cv::imdecode(raw, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    return;
  }
  if (image.empty()) return;
  View& view = found->second;
  Grey now{image.cols, image.rows, {image.begin<unsigned char>(), image.end<unsigned char>()}};
  if (moved(view.last, now)) {
    view.still_since_s = at_s;
    view.still_pictures = 0;
  }
  ++view.still_pictures;
  view.last = std::move(now);
  view.seen_s = at_s;
}

std::map<std::string, double> StillWatch::still_s(double at_s) const {
  std::map<std::string, double> all;
  for (const auto& [name, view] : views_)
    if (at_s - view.seen_s < kLost_s && !view.last.pixels.empty())
      all[name] = view.seen_s - view.still_since_s;
  return all;
}

bool StillWatch::is_due(double at_s) {
  int new_views = 0;
  for (const std::string& name : cameras_) {
    const View& one = views_[name];
    if (one.still_pictures < options_.pictures || at_s - one.still_since_s < options_.still_s)
      return false;
    if (is_new(one.of_set, one.last)) ++new_views;
  }
  const int wanted = std::min(options_.new_views, static_cast<int>(cameras_.size()));
  const bool ready = new_views >= wanted;
  if (ready) {
    for (auto& [name, one] : views_) one.of_set = one.last;
  }
  return ready;
}

void StillWatch::forget_last_set() {
  for (auto& [name, view] : views_) {
    view.of_set = {};
    view.still_pictures = 0;
  }
}

}  // namespace drape::console
