// SPDX-License-Identifier: Apache-2.0
#include "capture/live/live_capture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>

#include "capture/device/camera.hpp"
#include "core/files/json_file.hpp"
#include "core/statistics/sample.hpp"

namespace drape::capture {

LiveFrame develop(HostFrame frame, const std::string& name) {
  LiveFrame developed{{}, frame.width_px, frame.height_px, frame.fault, {}};
  developed.pixel_format = name;
  const PixelFormat* format = find_pixel_format(name);
  if (frame.pixels.empty() || format == nullptr) return developed;
  const auto count =
      static_cast<std::size_t>(frame.width_px) * static_cast<std::size_t>(frame.height_px);
  const bool plain = format->packing == Packing::bytes && format->mosaic == Mosaic::none;
  if (plain && frame.pixels.size() == count &&
      (frame.stride_bytes == 0 || frame.stride_bytes == format->row_bytes(frame.width_px))) {
    developed.pixels = std::move(frame.pixels);
    return developed;
  }
  try {
    const Samples grey =
        grey_of(unpack(*format, frame.pixels, frame.width_px, frame.height_px, frame.stride_bytes),
                format->mosaic);
    developed.bits = grey.bits;
    developed.pixels.resize(count);
    const int shift = grey.bits - 8;
    std::ranges::transform(grey.values, developed.pixels.begin(),
                           [&](std::uint16_t v) { return static_cast<std::uint8_t>(v >> shift); });
    if (shift > 0) {
      developed.deep.resize(count);
      std::ranges::transform(grey.values, developed.deep.begin(), [&](std::uint16_t v) {
        return static_cast<std::uint16_t>(v << (8 - shift));
      });
    }
    if (!format->is_grey()) developed.raw = std::move(frame.pixels);
  } catch (const Error& error) {
    developed.fault = error.what_failed();
    developed.pixels.clear();
  }
  return developed;
}

namespace {

using Histogram = std::array<std::int64_t, 256>;

namespace fs = std::filesystem;
constexpr int kPictureWidth_px = 640;  ///< upper limit
constexpr double kDotRadius_px = 10;
constexpr std::size_t kNoiseRows = 7;  ///< interval of the rows that are sampled
constexpr std::int64_t kFocusEvery_ns = 1'000'000'000;

struct Scaled {
  int width_px = 0, height_px = 0;
  std::string pixels;
  double saturated_percent = 0;
};

Scaled scaled(const LiveFrame& frame) {
  const int step = (frame.width_px + kPictureWidth_px - 1) / kPictureWidth_px;
  const bool deep = !frame.deep.empty();
  const int largest = deep ? ((1 << frame.bits) - 1) << (16 - frame.bits) : 255;
  Scaled to{frame.width_px / step, frame.height_px / step, {}, 0};
  const auto width = static_cast<std::size_t>(to.width_px);
  std::int64_t saturated = 0;
  std::vector<int> sums(width), full(width);
  for (int y = 0; y < to.height_px; ++y) {
    std::ranges::fill(sums, 0);
    std::ranges::fill(full, 0);
    for (int row = y * step; row < (y + 1) * step; ++row) {
      auto from = static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.width_px);
      for (std::size_t x = 0; x < width; ++x)
        for (int k = 0; k < step; ++k, ++from) {
          sums[x] += frame.pixels[from];
          full[x] += (deep ? frame.deep[from] : frame.pixels[from]) >= largest ? 1 : 0;
        }
    }
    for (std::size_t x = 0; x < width; ++x) {
      saturated += full[x];
      to.pixels += static_cast<char>(full[x] > 0 ? 255 : std::min(254, sums[x] / (step * step)));
    }
  }
  to.saturated_percent =
      100 * static_cast<double>(saturated) / (static_cast<double>(to.pixels.size()) * step * step);
  return to;
}

/// Noise in grey levels, at least that of rounding to integers.
double noise_of(const LiveFrame& frame) {
  std::array<std::int64_t, 4 * 255 + 1> counts{};
  std::int64_t all = 0;
  const auto width = static_cast<std::size_t>(frame.width_px);
  for (std::size_t row = 0; row + width <= frame.pixels.size(); row += kNoiseRows * width)
    for (std::size_t i = row + 1; i + 1 < row + width; ++i, ++all)
      ++counts[static_cast<std::size_t>(
          std::abs(frame.pixels[i - 1] - 2 * frame.pixels[i] + frame.pixels[i + 1]))];
  // Median, robust against edges, interpolated between integer levels.
  double below = 0, median = 0;
  for (std::size_t level = 0; level < counts.size(); ++level) {
    const auto here = static_cast<double>(counts[level]);
    if (below + here >= 0.5 * static_cast<double>(all) && here > 0) {
      const double part = (0.5 * static_cast<double>(all) - below) / here;
      median = level == 0 ? 0.5 * part : static_cast<double>(level) - 0.5 + part;
      break;
    }
    below += here;
  }
  return std::max(median / (0.6745 * std::sqrt(6.0)), 1 / std::sqrt(12.0));
}

std::int64_t utc_ns() {
  return std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

Json json_or_null(const std::optional<double>& value) {
  return value ? Json(*value) : Json();
}

}  // namespace

FrameQuality quality_of(std::span<const std::uint8_t> pixels, int width_px) {
  FrameQuality quality;
  if (pixels.empty() || width_px < 2) return quality;
  Histogram levels{}, steps{};
  double sum = 0;
  const auto width = static_cast<std::size_t>(width_px);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    ++levels[pixels[i]];
    sum += pixels[i];
    if ((i + 1) % width != 0 && i + 1 < pixels.size())
      ++steps[static_cast<std::size_t>(std::abs(pixels[i + 1] - pixels[i]))];
  }
  const auto count = static_cast<double>(pixels.size());
  quality.mean = sum / count;
  quality.dark_fraction =
      static_cast<double>(levels[0] + levels[1] + levels[2] + levels[3]) / count;
  quality.saturated_fraction = static_cast<double>(levels[254] + levels[255]) / count;
  quality.contrast = counted_quantile(levels, 0.99) - counted_quantile(levels, 0.01);
  if (quality.contrast > 0) quality.sharpness = counted_quantile(steps, 0.999) / quality.contrast;
  return quality;
}

std::optional<std::string> quality_fault(const FrameQuality& q, const QualityLimits& limits) {
  if (q.saturated_fraction > limits.largest_saturated_fraction)
    return fmt::format("{:.0f} % of its pixels are saturated", 100 * q.saturated_fraction);
  if (q.contrast < limits.least_contrast)
    return fmt::format("{} (mean level {:.0f}, contrast {:.0f} of 255)",
                       q.dark_fraction > 0.9 ? "it is black" : "it has no contrast", q.mean,
                       q.contrast);
  if (q.sharpness < limits.least_sharpness)
    return fmt::format("it is blurred (steepest edges {:.0f} % of the contrast per px)",
                       100 * q.sharpness);
  return std::nullopt;
}

std::string quality_remedy(const FrameQuality& q, const QualityLimits& limits) {
  if (q.saturated_fraction > limits.largest_saturated_fraction)
    return "lower exposure_us or the light";
  if (q.contrast < limits.least_contrast)
    return "take the lens cap off, raise exposure_us or the light";
  return "focus the lens and lock it, then calibrate again";
}

std::optional<double> dot_sigma_px(const LiveFrame& frame) {
  const FrameQuality quality = quality_of(frame.pixels, frame.width_px);
  if (quality.contrast < QualityLimits{}.least_contrast || quality.sharpness <= 0)
    return std::nullopt;
  using std::numbers::pi;
  const double blur_px = 1 / (std::sqrt(2 * pi) * quality.sharpness);
  return noise_of(frame) / quality.contrast *
         std::sqrt(2 * blur_px / (std::sqrt(pi) * kDotRadius_px));
}

PreviewWriter::PreviewWriter(const CamerasFile& cameras, fs::path folder)
    : cameras_(cameras), folder_(std::move(folder)), focus_(cameras.cameras.size()) {}

void PreviewWriter::show(std::size_t c, const LiveFrame& frame,
                         const std::vector<SettingReadBack>& settings,
                         const CameraSettings& asked) {
  if (frame.pixels.empty()) return;
  const LiveCamera& camera = cameras_.cameras[c];
  const std::int64_t now = utc_ns();
  Focus& focus = focus_[c];
  if (now - focus.looked_ns >= kFocusEvery_ns) focus = {now, dot_sigma_px(frame)};
  const Scaled picture = scaled(frame);
  Json facts = {{"arrived_ns", now},
                {"saturated_percent", picture.saturated_percent},
                {"dot_sigma_px", json_or_null(focus.dot_sigma_px)},
                {"settings", Json::object()},
                {"asked",
                 {{"exposure_us", json_or_null(asked.exposure_us)},
                  {"gain_db", json_or_null(asked.gain_db)}}}};
  for (const SettingReadBack& one : settings) facts["settings"][one.name] = one.value;
  const fs::path file = folder_ / (camera.name + ".pgm"), whole = folder_ / ("." + camera.name);
  std::ofstream out(whole, std::ios::binary);
  // The JSON is on one line and escaped to ASCII.
  out << "P5\n# " << facts.dump(-1, ' ', true, Json::error_handler_t::replace) << '\n'
      << picture.width_px << ' ' << picture.height_px << "\n255\n"
      << picture.pixels;
  out.close();
  std::error_code why;
  if (out) fs::rename(whole, file, why);
  if (!out || why)
    throw bad_input("the picture for the screen cannot be written", {.file = file.string()},
                    "free memory, or the disk");
}

}  // namespace drape::capture
