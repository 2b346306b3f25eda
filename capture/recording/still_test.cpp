// SPDX-License-Identifier: Apache-2.0
// Tests whether cloth and cameras are still, with bench1 as frames of emulated cameras.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/capture.hpp"
#include "capture/doctor/checks.hpp"
#include "capture/recording/test_record.hpp"
#include "core/files/json_file.hpp"
#include "tests/support/bench1_calibration.hpp"
#include "tests/support/paths.hpp"

namespace drape::capture {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

constexpr int kCameras = 3;

/// A burst of two sets of bench1's drape_A, 0.1 s apart, spread 2 ms, the second one shifted.
class Still : public testing::Test {
 protected:
  Still() {
    for (int c = 0; c < kCameras; ++c) {
      LiveCamera camera{fmt::format("cam{}", c), {}, {}};
      camera.settings.width_px = 1600;
      camera.settings.height_px = 1200;
      cameras_.cameras.push_back(camera);
      live_.report.cameras.push_back({});
      live_.report.cameras.back().name = camera.name;
    }
    cameras_.largest_spread_s = 0.01;
    cameras_.reference = ReferenceSet{test::source_root() / "rigs/bench1/recording", "empty"};
    options_.folder = temporary_.path() / "recording";
    options_.set = "drape";
    options_.largest_spread_s = cameras_.largest_spread_s;
    options_.recorded_on = "2026-01-31";
  }

  void add_set(double shift_px, double time_s) {
    add_set(std::array{shift_px, shift_px, shift_px}, time_s);
  }

  void add_set(const std::array<double, kCameras>& shifts_px, double time_s) {
    PairedFrames set;
    for (int c = 0; c < kCameras; ++c) {
      const double shift_px = shifts_px[static_cast<std::size_t>(c)];
      const auto file =
          test::source_root() / fmt::format("rigs/bench1/recording/drape_A/cam{}.png", c);
      cv::Mat image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
      if (shift_px != 0) {
        const cv::Mat map = (cv::Mat_<double>(2, 3) << 1, 0, shift_px, 0, 1, 0);
        cv::warpAffine(image, image, map, image.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
      }
      set.frames.push_back(live_.frames.size());
      FrameMark mark;
      mark.camera = static_cast<std::size_t>(c);
      mark.time_s = time_s;
      live_.frames.push_back(
          {mark, image.cols, image.rows, "", {image.data, image.data + image.total()}});
    }
    set.spread_s = 2e-3;
    live_.pairing.sets.push_back(set);
  }

  fs::path write_calibration_file() {
    write_calibration(temporary_.path() / "calibration.json", test::bench1_true_calibration());
    return temporary_.path() / "calibration.json";
  }

  test::TemporaryFolder temporary_;
  LiveResult live_;
  CamerasFile cameras_;
  RecordOptions options_;
};

TEST_F(Still, ASetSaysThatTheClothWasStillAndTheCamerasInPlace) {
  add_set(0, 0);
  add_set(0, 0.1);
  options_.format = FrameFormat::pgm;
  options_.still.calibration = write_calibration_file();
  const RecordResult stored = record_live(live_, cameras_, options_);
  EXPECT_THAT(stored.sets, testing::ElementsAre("drape_000", "drape_001"));
  EXPECT_FALSE(stored.still.cloth_moved);
  EXPECT_EQ(stored.still.motion_px.value(), 0);
  EXPECT_LT(stored.still.background_shift_px.value(), options_.still.largest_shift_px);
  const Recording recording = read_recording(options_.folder);
  EXPECT_EQ(recording.recorded_on, "2026-01-31");
  EXPECT_EQ(recording.sets[0].motion_px.value(), 0);
  EXPECT_EQ(recording.sets[0].camera_shift_px, stored.still.background_shift_px);
  EXPECT_EQ(recording.sets[0].details_sha256.value(),
            sha256_of_file(options_.folder / "drape_000/capture.json"));
  EXPECT_TRUE(verify_recording(options_.folder, {}).good());
  write_durable(options_.folder / "drape_001/capture.json", "{}");
  EXPECT_EQ(verify_recording(options_.folder, {}).faults.at(0).file, "drape_001/capture.json");
  EXPECT_EQ(recording.sets[0].frames[0].file, "drape_000/cam0.pgm");
  const std::vector<unsigned char> pgm =
      read_frame(recording, recording.sets[0], recording.sets[0].frames[0]);
  const cv::Mat image = cv::imdecode(pgm, cv::IMREAD_UNCHANGED);
  EXPECT_EQ(std::vector<std::uint8_t>(image.data, image.data + image.total()),
            live_.frames[0].pixels);
  for (const Check& check : check_still({.still = stored.still}))
    EXPECT_TRUE(check.go) << check.name;
}

TEST_F(Still, AMovingClothIsNamedWithItsSpeedAndNeverAveraged) {
  add_set(0, 0);
  add_set(0.5, 0.1);
  cameras_.reference.reset();
  options_.still.calibration = write_calibration_file();
  const StillReport still = look_still(live_, cameras_, options_.still);
  EXPECT_TRUE(still.cloth_moved);
  EXPECT_NEAR(still.motion_px.value(), 0.5, 0.05);
  // true pixels per metre at the world's origin
  double largest_mm_per_px = 0;
  for (const Camera& camera : test::bench1_truth().cameras) {
    const auto p = project(camera.model, camera.cam_from_world * Eigen::Vector3d::Zero());
    const Eigen::Matrix2d squares = p->d_px_d_point * p->d_px_d_point.transpose();
    const double least =
        0.5 * (squares.trace() - std::hypot(squares(0, 0) - squares(1, 1), 2 * squares(0, 1)));
    largest_mm_per_px = std::max(largest_mm_per_px, 1e3 / std::sqrt(least));
  }
  EXPECT_NEAR(still.speed_mm_per_s.value(), 5 * largest_mm_per_px, 0.1 * 5 * largest_mm_per_px);
  EXPECT_NEAR(still.sync_error_mm.value(), 2e-3 * still.speed_mm_per_s.value(), 1e-12);
  std::printf("cloth moves %.3f px in 0.1 s: %.3f mm/s, %.5f mm in a spread of 2 ms\n",
              *still.motion_px, *still.speed_mm_per_s, *still.sync_error_mm);
  options_.average = true;
  const RecordResult stored = record_live(live_, cameras_, options_);
  ASSERT_EQ(stored.refused.size(), 1U);
  EXPECT_THAT(stored.refused[0].what, HasSubstr("the cloth moved by 0."));
  EXPECT_TRUE(stored.sets.empty());
  EXPECT_FALSE(fs::exists(options_.folder));
  EXPECT_FALSE(check_still({.still = stored.still})[0].go);
}

TEST_F(Still, ACalibrationThatIsNoGoGivesNoSpeed) {
  add_set(0, 0);
  add_set(0, 0.1);
  Calibration calibration = test::bench1_true_calibration();
  calibration.no_go = "cam1 misses by 3 px";
  options_.still.calibration = temporary_.path() / "calibration.json";
  write_calibration(*options_.still.calibration, calibration);
  const StillReport still = look_still(live_, cameras_, options_.still);
  EXPECT_TRUE(still.motion_px && !still.speed_mm_per_s);
  EXPECT_EQ(still.calibration_no_go, "cam1 misses by 3 px");
}

/// Motion beyond the search range of full-size blocks is either correct to a tenth or absent.
TEST_F(Still, AClothThatMovedFarIsNeverCalledStill) {
  for (const double shift_px : {6.0, 25.0, 40.0, 90.0}) {
    live_ = {};
    add_set(0, 0);
    add_set(shift_px, 0.1);
    cameras_.reference.reset();
    const StillReport still = look_still(live_, cameras_, options_.still);
    EXPECT_TRUE(still.cloth_moved) << shift_px;
    EXPECT_TRUE(still.cloth_fault()) << shift_px;
    const auto checks = check_still({.still = still});
    ASSERT_EQ(checks.size(), 1U) << shift_px;
    EXPECT_FALSE(checks[0].go) << shift_px;
    EXPECT_EQ(checks[0].found, still.cloth_fault()->what);
    if (still.motion_px) {
      EXPECT_NEAR(*still.motion_px, shift_px, 0.1 * shift_px);
    }
    std::printf("cloth moved by %.0f px: motion_px %s\n", shift_px,
                still.motion_px ? fmt::format("{:.2f}", *still.motion_px).c_str() : "absent");
  }
}

TEST_F(Still, ABurstOfAMovingClothIsStoredAsNoGo) {
  add_set(0, 0);
  add_set(1.5, 0.1);
  cameras_.reference.reset();
  static_cast<void>(record_live(live_, cameras_, options_));
  const Recording recording = read_recording(options_.folder);
  ASSERT_EQ(recording.sets.size(), 2U);
  for (const FrameSet& set : recording.sets)
    EXPECT_THAT(set.no_go.value_or(""), HasSubstr("the cloth moved by 1.")) << set.name;
}

TEST_F(Still, AMovedCameraIsNamedAndItsSetNotStored) {
  add_set(1.5, 0);
  const RecordResult stored = record_live(live_, cameras_, options_);
  ASSERT_EQ(stored.refused.size(), 3U);
  EXPECT_EQ(stored.refused[0].camera, "cam0");
  EXPECT_THAT(stored.refused[0].what, HasSubstr("it moved since the reference set"));
  EXPECT_THAT(stored.refused[0].what_to_do, HasSubstr("calibrate again"));
  EXPECT_FALSE(fs::exists(options_.folder));
  EXPECT_FALSE(stored.still.motion_px) << "one set tells nothing of the cloth";
}

/// If one camera is knocked too far for its background to be found, the figures of the others must
/// not be blamed for it.
TEST_F(Still, ACameraThatIsNotFoundAgainIsRefusedAlone) {
  for (const double shift_px : {16.0, 100.0, -400.0}) {
    live_.frames.clear();
    live_.pairing.sets.clear();
    add_set({shift_px, 0, 0}, 0);
    const RecordResult stored = record_live(live_, cameras_, options_);
    ASSERT_EQ(stored.refused.size(), 1U) << shift_px;
    EXPECT_EQ(stored.refused[0].camera, "cam0");
    EXPECT_THAT(stored.refused[0].what, HasSubstr("not found again in the reference set"));
    EXPECT_TRUE(stored.sets.empty());
    EXPECT_FALSE(fs::exists(options_.folder));
    EXPECT_FALSE(stored.still.background_shift_px) << "of three cameras one is not known";
    EXPECT_TRUE(stored.still.cameras[1].background_shift_px);
    const auto checks = check_still({.still = stored.still});
    ASSERT_EQ(checks.size(), 3U);
    EXPECT_FALSE(checks[0].go);
    EXPECT_EQ(checks[0].name, "place of cam0");
    EXPECT_THAT(checks[0].to_type, HasSubstr("calibrate again"));
    EXPECT_TRUE(checks[1].go && checks[2].go);
  }
}

TEST_F(Still, ExchangedCamerasAreRefused) {
  add_set(0, 0);
  std::swap(live_.frames[0].pixels, live_.frames[1].pixels);
  const RecordResult stored = record_live(live_, cameras_, options_);
  ASSERT_EQ(stored.refused.size(), 2U);
  EXPECT_EQ(stored.refused[0].camera, "cam0");
  EXPECT_EQ(stored.refused[1].camera, "cam1");
}

/// A reference that cannot show whether a camera moved is not usable.
TEST_F(Still, AReferenceOfAnotherRigIsBadInput) {
  const auto why = [&] {
    try {
      static_cast<void>(StillWatch(cameras_, {}));
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      return std::string(error.what());
    }
    return std::string();
  };
  cameras_.file = "rigs/lab/cameras.toml";
  EXPECT_EQ(why(), "");
  cameras_.cameras[1].settings.width_px = 512;
  EXPECT_THAT(why(), testing::AllOf(HasSubstr("cameras.toml"), HasSubstr("reference.set"),
                                    HasSubstr("cam1"), HasSubstr("1600 x 1200 px"),
                                    HasSubstr("512 x 1200 px")));
  cameras_.cameras[1].settings.width_px = 1600;
  cameras_.cameras[2].name = "cam7";
  EXPECT_THAT(why(), testing::AllOf(HasSubstr("cam7"), HasSubstr("has no picture")));
  cameras_.cameras[2].name = "cam2";
  cameras_.reference.reset();
  add_set(0, 0);
  for (LiveFrame& frame : live_.frames)
    for (std::size_t i = 0; i < frame.pixels.size(); ++i)
      frame.pixels[i] = static_cast<std::uint8_t>(i % 1600 < 800 ? 60 : 200);
  options_.limits.least_sharpness = 0;
  ASSERT_EQ(record_live(live_, cameras_, options_).sets.size(), 1U);
  cameras_.reference = ReferenceSet{options_.folder, "drape"};
  EXPECT_THAT(why(), HasSubstr("no texture"));
}

/// Every frame is compared, so it does not matter in which one the cloth moved.
TEST_F(Still, AClothThatMovesLateOrForOneFrameOnlyHasMoved) {
  cameras_.reference.reset();
  constexpr int kFrames = 12;
  for (const int moved : {10, kFrames - 1}) {
    live_ = {};
    for (int k = 0; k < kFrames; ++k) {
      if (k == 0 || k == moved) {
        add_set(k == 0 ? 0 : 0.4, 0.1 * k);
      } else {
        live_.pairing.sets.push_back(live_.pairing.sets[0]);
      }
    }
    const StillReport still = look_still(live_, cameras_, options_.still);
    EXPECT_TRUE(still.cloth_moved) << "in frame " << moved;
    EXPECT_NEAR(still.motion_px.value(), 0.4, 0.1);
  }
}

TEST_F(Still, ABurstIsAveraged) {
  add_set(0, 0);
  add_set(0, 0.1);
  for (std::size_t i = 0; i < kCameras; ++i)
    for (std::uint8_t& p : live_.frames[kCameras + i].pixels)
      p = static_cast<std::uint8_t>(std::min(255, p + 2));
  options_.average = true;
  const RecordResult stored = record_live(live_, cameras_, options_);
  ASSERT_THAT(stored.sets, testing::ElementsAre("drape")) << stored.refused.size();
  const cv::Mat mean =
      cv::imread((options_.folder / "drape/cam1.png").string(), cv::IMREAD_UNCHANGED);
  for (std::size_t i = 0; i < mean.total(); i += 997) {
    const int first = live_.frames[1].pixels[i], second = live_.frames[kCameras + 1].pixels[i];
    EXPECT_EQ(mean.data[i], (first + second + 1) / 2);
  }
}

}  // namespace
}  // namespace drape::capture
