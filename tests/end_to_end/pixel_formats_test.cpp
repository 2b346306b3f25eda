// SPDX-License-Identifier: Apache-2.0
// One drape in every pixel format: the measurements agree within their stated
// noise.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "capture/device/camera.hpp"
#include "capture/live/live_capture.hpp"
#include "capture/recording/test_record.hpp"
#include "core/detections.hpp"
#include "core/files/files.hpp"
#include "core/sheet.hpp"
#include "tests/support/bench1_calibration.hpp"
#include "tests/support/bench1_truth.hpp"
#include "tests/support/small_bench.hpp"
#include "tests/support/trials.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;
using capture::Mosaic;
using capture::Packing;
using capture::PixelFormat;

constexpr int kViews = 3, kDepth = 16;

/// bench1's drape_A as seen by a 16-bit sensor: its grey levels, with the steps between them that
/// such a sensor resolves.
cv::Mat light_of_bench1(int camera) {
  const cv::Mat grey = cv::imread(
      (test::source_root() / fmt::format("rigs/bench1/recording/drape_A/cam{}.png", camera))
          .string(),
      cv::IMREAD_GRAYSCALE);
  cv::Mat fine(grey.size(), CV_16UC1);
  cv::RNG random(static_cast<std::uint64_t>(camera) + 1);
  random.fill(fine, cv::RNG::UNIFORM, 0, 256);
  cv::Mat light;
  grey.convertTo(light, CV_16UC1, 256);
  return light + fine;
}

/// True if the pixel is green. The name states the first two pixels of the first row.
bool is_green(Mosaic mosaic, int x, int y) {
  const bool first = mosaic == Mosaic::gr || mosaic == Mosaic::gb;
  return ((x + y) % 2 == 0) == first;
}

/// A frame as sent by the camera; red and blue get less light than green.
std::vector<std::uint8_t> sent_by(const PixelFormat& format, const cv::Mat& light) {
  std::vector<std::uint8_t> bytes;
  if (format.packing == Packing::jpeg) {
    cv::Mat grey;
    light.convertTo(grey, CV_8UC1, 1.0 / 256, -0.5);
    cv::imencode(".jpg", grey, bytes, {cv::IMWRITE_JPEG_QUALITY, 95});
    return bytes;
  }
  for (int y = 0; y < light.rows; ++y)
    for (int x = 0; x < light.cols; ++x) {
      unsigned value = light.at<std::uint16_t>(y, x);
      if (format.mosaic != Mosaic::none && !is_green(format.mosaic, x, y)) value /= 2;
      value >>= kDepth - format.bits;
      const auto low = static_cast<std::uint8_t>(value);
      switch (format.packing) {
        case Packing::words:
          bytes.insert(bytes.end(), {low, static_cast<std::uint8_t>(value >> 8)});
          break;
        case Packing::yuyv:
          bytes.insert(bytes.end(), {low, 128});
          break;
        case Packing::uyvy:
          bytes.insert(bytes.end(), {128, low});
          break;
        case Packing::rgb:
          bytes.insert(bytes.end(), {static_cast<std::uint8_t>(low / 2), low, 0});
          break;
        default:
          bytes.push_back(low);
      }
    }
  if (format.packing == Packing::nv12) bytes.resize(bytes.size() * 3 / 2, 128);
  return bytes;
}

class PixelFormats : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"drape-detect", "drape-triangulate"})
      if (!fs::exists(test::program(name)))
        GTEST_SKIP() << name << " is missing: build with stages detect and triangulate too";
    for (int c = 0; c < kViews; ++c) light_.push_back(light_of_bench1(c));
    write_calibration(folder() / "calibration.json", test::bench1_true_calibration());
  }

  struct Measured {
    Detections detections;
    Sheet sheet;
  };

  /// Developed and stored by the capture, then detected and triangulated. Formats with equal grey
  /// values are measured once.
  const Measured& measured_through(const PixelFormat& format) {
    capture::CamerasFile cameras;
    capture::LiveResult live;
    std::string grey;
    capture::PairedFrames set;
    for (int c = 0; c < kViews; ++c) {
      const cv::Mat& light = light_[static_cast<std::size_t>(c)];
      capture::HostFrame frame;
      frame.complete = true;
      frame.width_px = light.cols;
      frame.height_px = light.rows;
      frame.pixels = sent_by(format, light);
      live.frames.push_back(capture::develop(std::move(frame), std::string(format.name)));
      const capture::LiveFrame& developed = live.frames.back();
      EXPECT_EQ(developed.fault, "") << format.name;
      const auto* deep = reinterpret_cast<const unsigned char*>(developed.deep.data());
      grey += sha256_of(developed.pixels) + sha256_of(std::span(deep, 2 * developed.deep.size()));
      capture::LiveCamera& camera = cameras.cameras.emplace_back();
      camera.name = fmt::format("cam{}", c);
      camera.settings.width_px = light.cols;
      camera.settings.height_px = light.rows;
      live.report.cameras.push_back({});
      live.report.cameras.back().name = camera.name;
      set.frames.push_back(static_cast<std::size_t>(c));
    }
    const auto [place, is_new] = measured_.try_emplace(grey);
    if (!is_new) return place->second;
    live.pairing.sets.push_back(set);
    const fs::path out = folder() / std::string(format.name);
    capture::RecordOptions storing;
    storing.folder = out;
    storing.set = "drape_A";
    storing.recorded_on = "2026-01-31";
    EXPECT_EQ(record_live(live, cameras, storing).sets.size(), 1U) << format.name;
    const fs::path marks = folder() / (std::string(format.name) + "-d.json");
    const test::Outcome outcome = test::run_line(fmt::format(
        "'{0}' '{1}' --rig '{2}' --surface cloth --sets drape_A --out '{5}' && "
        "'{3}' '{5}' --calibration '{4}/calibration.json' --set drape_A --out '{1}/s.ply'",
        test::program("drape-detect").string(), out.string(),
        (test::source_root() / "rigs/bench1").string(), test::program("drape-triangulate").string(),
        folder().string(), marks.string()));
    EXPECT_EQ(outcome.exit_code, 0) << format.name << ": " << outcome.text;
    place->second = {read_detections(marks), read_sheet(out / "s.ply")};
    fs::remove_all(out);
    return place->second;
  }

  [[nodiscard]] const fs::path& folder() const { return temporary_.path(); }

  std::vector<cv::Mat> light_;
  std::map<std::string, Measured> measured_;
  test::TemporaryFolder temporary_;
};

/// Number of cameras by which the mark was measured.
std::ptrdiff_t views_of(const MarkId& mark, const Detections& detections) {
  return std::ranges::count_if(detections.frames, [&](const FrameDetections& frame) {
    return std::ranges::any_of(frame.detections,
                               [&](const Detection& one) { return one.mark == mark; });
  });
}

/// Root mean square error of a centre along one axis relative to the renderer's truth, over the
/// dots that both formats measured.
double centre_error_px(const Detections& detections, const Detections& also) {
  double squares = 0;
  int axes = 0;
  for (std::size_t c = 0; c < detections.frames.size(); ++c)
    for (const Detection& one : detections.frames[c].detections) {
      const auto& others = also.frames[c].detections;
      if (std::ranges::none_of(others, [&](const Detection& o) { return o.mark == one.mark; }))
        continue;
      const auto index = static_cast<std::size_t>(one.mark.row) * 11 + one.mark.col;
      const auto& truth = test::bench1_truth().drapes.at("A").at(index).views.at(c);
      squares += (one.centre_px - truth.centroid_px).squaredNorm();
      axes += 2;
    }
  return std::sqrt(squares / axes);
}

TEST_F(PixelFormats, GiveTheSameSheetWithinTheStatedNoise) {
  const Measured& mono8 = measured_through(*capture::find_pixel_format("Mono8"));
  const Sheet& reference = mono8.sheet;
  ASSERT_GT(reference.marks.size(), 100U);
  const std::vector<std::string> slice = {"Mono12", "BayerRG8", "MJPG"};
  const bool whole = test::trial_count(0, 1) == 1;
  int formats = 0;
  for (const PixelFormat& format : capture::pixel_formats()) {
    // Packed formats contain the same samples as those in words: pixel_format_test.cpp.
    if (format.packing == Packing::lsb || format.packing == Packing::gige_packed) continue;
    if (!whole && std::find(slice.begin(), slice.end(), format.name) == slice.end()) continue;
    ++formats;
    const Measured& measured = measured_through(format);
    double squares = 0, largest = 0, sum_mm2 = 0;
    std::size_t marks = 0;
    for (const SheetMark& mark : reference.marks) {
      const SheetMark* other = measured.sheet.find(mark.mark);
      if (other == nullptr) {
        // With other noise or half of the samples, a view at a detection limit can be lost; of
        // three cameras two are left.
        EXPECT_EQ(views_of(mark.mark, mono8.detections), 2) << format.name;
        const bool is_named = std::ranges::any_of(
            measured.sheet.gaps, [&](const Gap& gap) { return gap.mark == mark.mark; });
        EXPECT_TRUE(is_named) << format.name << ": a mark is gone without a word";
        continue;
      }
      const Eigen::Vector3d apart = mark.point_in_world - other->point_in_world;
      // The same light and the same noise: they differ by less than two measurements would.
      const double z2 = apart.dot(other->covariance_m2->ldlt().solve(apart)) / 3;
      squares += z2;
      largest = std::max(largest, std::sqrt(z2));
      sum_mm2 += 1e6 * apart.squaredNorm();
      ++marks;
    }
    const double rms = std::sqrt(squares / static_cast<double>(marks));
    std::printf(
        "%s: %zu of %zu marks, apart by %.4f mm (rms), %.2f of the stated deviation, %.2f "
        "at most; a dot's centre errs by %.4f px, in Mono8 by %.4f px\n",
        std::string(format.name).c_str(), marks, reference.marks.size(),
        std::sqrt(sum_mm2 / static_cast<double>(marks)), rms, largest,
        centre_error_px(measured.detections, mono8.detections),
        centre_error_px(mono8.detections, measured.detections));
    EXPECT_LE(rms, 1) << format.name;
  }
  EXPECT_GE(formats, 3);
}

}  // namespace
}  // namespace drape
