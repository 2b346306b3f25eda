// SPDX-License-Identifier: Apache-2.0
#include "console/pictures.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "core/files/files.hpp"
#include "core/statistics/sample.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;

// ---- folder in memory --------------------------------------------------------------------------

constexpr std::string_view kName = "drape-bench-";
constexpr int kAttempts = 10;

/// Opens and locks the folder; negative if another program holds it, or if it is not a folder.
int locked(const fs::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (fd >= 0 && ::flock(fd, LOCK_EX | LOCK_NB) == 0) return fd;
  if (fd >= 0) ::close(fd);
  return -1;
}

bool is_ours(int folder) {
  struct stat seen {};
  return ::fstat(folder, &seen) == 0 && seen.st_uid == ::geteuid();
}

/// Removes folders that nobody holds, because their programs were killed.
void remove_left_behind(const fs::path& place) {
  std::error_code ignored;
  std::vector<fs::path> found;
  for (fs::directory_iterator at(place, ignored), end; at != end; at.increment(ignored))
    if (at->path().filename().string().starts_with(kName)) found.push_back(at->path());
  for (const fs::path& folder : found) {
    const int fd = locked(folder);
    if (fd < 0) continue;
    if (is_ours(fd)) fs::remove_all(folder, ignored);
    ::close(fd);
  }
}

}  // namespace

MemoryFolder::MemoryFolder(const fs::path& place) {
  remove_left_behind(place);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    std::string name = (place / fmt::format("{}XXXXXX", kName)).string();
    if (::mkdtemp(name.data()) == nullptr)
      throw bad_input(fmt::format("cannot be made: {}", std::strerror(errno)), {.file = name},
                      "free memory, or the disk");
    path_ = name;
    lock_ = locked(path_);
    if (lock_ >= 0 && fs::exists(path_)) return;
    if (lock_ >= 0) ::close(lock_);  // another program removed it before it was locked
  }
  throw internal_error(fmt::format("{} cannot be locked", path_.string()));
}

MemoryFolder::~MemoryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  ::close(lock_);
}

fs::path MemoryFolder::in_memory() {
  return fs::is_directory("/dev/shm") ? "/dev/shm" : "/tmp";
}

namespace {

// ---- pictures for the screen -------------------------------------------------------------------

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
  if (bytes_ + made.jpeg.size() > kMostBytes) {
    pictures_.clear();
    bytes_ = 0;
  }
  if (pictures_.emplace(key, made).second) bytes_ += made.jpeg.size();
  return made;
}

namespace {

// ---- stillness ---------------------------------------------------------------------------------

constexpr int kLevels = 256;
constexpr double kLost_s = 2;  ///< time without a picture
constexpr double kMedianToSigma = 1.4826;
using Counts = std::array<std::int64_t, kLevels>;

double grey_contrast(const Grey& image) {
  Counts counts{};
  for (const unsigned char level : image.reshaped()) ++counts[level];
  return counted_quantile(counts, 0.95) - counted_quantile(counts, 0.05);
}

bool is_same_size(const Grey& a, const Grey& b) {
  return a.rows() == b.rows() && a.cols() == b.cols();
}

}  // namespace

StillWatch::StillWatch(std::vector<std::string> cameras, StillOptions options)
    : cameras_(std::move(cameras)), options_(options) {
  for (const std::string& camera : cameras_) views_[camera] = {};
}

bool StillWatch::moved(const Grey& before, const Grey& now) const {
  if (!is_same_size(before, now)) return true;
  Counts counts{};
  const Eigen::MatrixXi change = (now.cast<int>() - before.cast<int>()).cwiseAbs();
  for (const int levels : change.reshaped()) ++counts[static_cast<std::size_t>(levels)];
  // Edges are few, so the median is noise; rounding to whole levels has 1/sqrt(12) of a level.
  const double sigma =
      std::max(kMedianToSigma * counted_quantile(counts, 0.5), std::sqrt(2.0 / 12.0));
  const double limit =
      std::max(options_.changed_contrast * grey_contrast(now), options_.changed_sigmas * sigma);
  std::int64_t changed = 0;
  for (int level = 0; level < kLevels; ++level)
    if (level > limit) changed += counts[static_cast<std::size_t>(level)];
  return static_cast<double>(changed) > options_.moving_fraction * static_cast<double>(now.size());
}

bool StillWatch::is_new(const Grey& before, const Grey& now) const {
  if (!is_same_size(before, now)) return true;
  const int size = options_.block_px;
  const double limit = options_.changed_contrast * grey_contrast(now) * size * size;
  const Eigen::MatrixXi difference = now.cast<int>() - before.cast<int>();
  int blocks = 0, changed = 0;
  for (int top = 0; top + size <= difference.rows(); top += size)
    for (int left = 0; left + size <= difference.cols(); left += size, ++blocks)
      if (std::abs(difference.block(top, left, size, size).sum()) > limit) ++changed;
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
  Grey now = Eigen::Map<const Grey>(image.data, image.rows, image.cols);
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
    if (at_s - view.seen_s < kLost_s && view.last.size() > 0)
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
