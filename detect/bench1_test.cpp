// SPDX-License-Identifier: Apache-2.0
// Compares the whole stage with the renderer's truth.
#include <gmock/gmock.h>

#include <Eigen/LU>
#include <cmath>
#include <iostream>

#include "core/files/files.hpp"
#include "detect/detect.hpp"
#include "tests/support/bench1_truth.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {

using namespace detect;

namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

fs::path rig_folder() {
  return source_root() / "rigs/bench1";
}

Recording recording() {
  return read_recording(rig_folder() / "recording");
}

Rig rig() {
  return read_rig(rig_folder() / "rig.toml");
}

DetectOptions asked(Surface surface, const std::vector<std::string>& sets, int threads = 2) {
  DetectOptions options;
  options.surface = surface;
  options.sets = sets;
  options.threads = threads;
  return options;
}

DetectResult run(Surface surface, const std::vector<std::string>& sets,
                 const Recording& source = recording(), const Rig& bench = rig()) {
  return detect::detect(source, bench, asked(surface, sets));
}

std::size_t camera_index(const std::string& name) {
  return name.back() - '0';
}

TEST(TagsOfAPrint, AreThoseOfTheirFamily) {
  const TemporaryFolder folder;
  Rig changed = rig();
  const auto refusal = [&](fs::path& used, const std::string& from, const std::string& to) {
    std::string text = read_text(used);
    const fs::path original = std::exchange(used, folder.path() / "changed.toml");
    write_durable(used, text.replace(text.find(from), from.size(), to));
    const Surface surface = from.starts_with("first_id") ? Surface::cloth : Surface::target;
    const Error error = error_of([&] { (void)run(surface, {"drape_A"}, recording(), changed); });
    EXPECT_EQ(error.where().file, used.string());
    used = original;
    return error.what_failed();
  };
  EXPECT_EQ(refusal(changed.print_file, "first_id = 0", "first_id = 560"),
            "the family tag36h11 has no tag 587");
  EXPECT_EQ(refusal(changed.target_file, "id = 403", "id = -3"),
            "the family tag36h11 has no tag -3");
}

const DetectResult& drapes() {
  static const DetectResult result = run(Surface::cloth, {"drape_A", "drape_C", "drape_E"});
  return result;
}

const DetectResult& targets() {
  static const DetectResult result = run(Surface::target, default_sets(rig(), Surface::target));
  return result;
}

const TrueView& true_view(const FrameDetections& frame, MarkId mark) {
  const std::string drape = frame.set.substr(frame.set.size() - 1);
  return bench1_truth().drapes.at(drape)[mark.row * 11 + mark.col].views[camera_index(
      frame.camera)];
}

bool whole_within(const TrueView& view, double degrees) {
  return view.visible && view.visible_fraction > 0.99 &&
         view.cos_view >= std::cos(degrees * std::acos(-1.0) / 180);
}

/// Sums over marks of squared errors per axis, and of normalised squared errors per axis.
struct Errors {
  int count = 0;
  double square = 0, nees = 0, largest = 0;

  void add(const Detection& dot, const Eigen::Vector2d& truth) {
    const Eigen::Vector2d error = dot.centre_px - truth;
    ++count;
    square += error.squaredNorm();
    nees += error.dot(dot.covariance_px2.inverse() * error) / 2;
    largest = std::max(largest, error.norm());
  }
  [[nodiscard]] double rms_px() const { return std::sqrt(square / std::max(1, count)); }
  [[nodiscard]] double mean_nees() const { return nees / std::max(1, count); }
};

TEST(Bench1Cloth, EveryLabelIsRight) {
  int marks = 0;
  for (const FrameDetections& frame : drapes().detections.frames) {
    for (const Detection& dot : frame.detections) {
      ++marks;
      EXPECT_LT((dot.centre_px - true_view(frame, dot.mark).px).norm(), 2.0)
          << frame.set << " " << frame.camera << " mark " << dot.mark.row << "," << dot.mark.col;
    }
  }
  EXPECT_GT(marks, 650);
}

TEST(Bench1Cloth, FindsAtLeast97PercentOfWholeDotsFacingWithin60Degrees) {
  int expected = 0, found = 0, grazing = 0, found_grazing = 0;
  for (const FrameDetections& frame : drapes().detections.frames) {
    for (int k = 0; k < 121; ++k) {
      const MarkId mark{k / 11, k % 11};
      const TrueView& view = true_view(frame, mark);
      const bool seen = std::any_of(frame.detections.begin(), frame.detections.end(),
                                    [&](const Detection& d) { return d.mark == mark; });
      if (whole_within(view, 60)) {
        ++expected;
        found += seen;
      } else if (whole_within(view, 80)) {
        ++grazing;
        found_grazing += seen;
      }
    }
  }
  std::cout << "found " << found << " of " << expected << " within 60 deg, " << found_grazing
            << " of " << grazing << " from 60 to 80 deg\n";
  EXPECT_GE(found, std::ceil(0.97 * expected));
  EXPECT_GE(found_grazing, 0.5 * grazing);
}

TEST(Bench1Cloth, CentresAreWithinAFewHundredthsOfAPixelAndCovariancesHonest) {
  Errors facing, grazing;
  for (const FrameDetections& frame : drapes().detections.frames) {
    for (const Detection& dot : frame.detections) {
      const TrueView& view = true_view(frame, dot.mark);
      if (whole_within(view, 60)) {
        facing.add(dot, view.centroid_px);
      } else if (whole_within(view, 80)) {
        grazing.add(dot, view.centroid_px);
      }
    }
  }
  std::cout << "rms " << facing.rms_px() << " px within 60 deg (largest " << facing.largest
            << " px, NEES " << facing.mean_nees() << "), " << grazing.rms_px()
            << " px from 60 to 80 deg (largest " << grazing.largest << " px, NEES "
            << grazing.mean_nees() << ")\n";
  EXPECT_LE(facing.rms_px(), 0.05);
  EXPECT_GT(facing.mean_nees(), 0.7);
  EXPECT_LT(facing.mean_nees(), 1.5);
  EXPECT_LT(grazing.rms_px(), 0.15);
}

TEST(Bench1Cloth, EveryRejectionHasAReasonAndEveryFrameAPreview) {
  ASSERT_EQ(drapes().detections.frames.size(), 9U);
  ASSERT_EQ(drapes().previews.size(), 9U);
  for (std::size_t k = 0; k < 9; ++k) {
    const FrameDetections& frame = drapes().detections.frames[k];
    EXPECT_EQ(frame.camera, "cam" + std::to_string(k % 3));
    EXPECT_EQ(frame.preview_file, "preview_" + frame.set + "_" + frame.camera + ".jpg");
    EXPECT_EQ(drapes().previews[k].file_name, *frame.preview_file);
    EXPECT_EQ(frame.preview_scale, 0.5);
    // The renderer's noise is 1.6 grey levels at level 128; cloth texture adds to it.
    EXPECT_GT(*frame.noise_sigma, 1.4);
    EXPECT_LT(*frame.noise_sigma, 2.2);
    for (const Rejection& rejection : frame.rejections) {
      EXPECT_FALSE(rejection.reason.empty());
      EXPECT_TRUE(rejection.centre_px.has_value());
    }
  }
}

TEST(Bench1Target, AllDotsOfAllViewsTo12ThousandthsPxRmsAnd60AtMost) {
  Errors errors;
  ASSERT_EQ(targets().detections.frames.size(), 57U);
  for (const FrameDetections& frame : targets().detections.frames) {
    EXPECT_EQ(frame.detections.size(), 108U) << frame.set << " " << frame.camera;
    EXPECT_FALSE(frame.preview_file.has_value());
    const auto pose = std::find_if(bench1_truth().poses.begin(), bench1_truth().poses.end(),
                                   [&](const TruePose& p) { return p.set == frame.set; });
    ASSERT_NE(pose, bench1_truth().poses.end());
    for (const Detection& dot : frame.detections) {
      const auto& truth = pose->centroid_px[camera_index(frame.camera)];
      errors.add(dot, truth[dot.mark.row * 12 + dot.mark.col]);
    }
  }
  std::cout << "target rms " << errors.rms_px() << " px, largest " << errors.largest << " px, NEES "
            << errors.mean_nees() << "\n";
  EXPECT_LT(errors.rms_px(), 0.012);
  EXPECT_LT(errors.largest, 0.06);
  EXPECT_GT(errors.mean_nees(), 0.7);
  EXPECT_LT(errors.mean_nees(), 1.6);
}

TEST(Bench1Tags, CornersFollowTheReadingOrderWithoutTheHalfPixel) {
  const Target target = read_target(rig().target_file);
  const FrameDetections& frame = targets().detections.frames.front();
  ASSERT_EQ(frame.tags.size(), 6U);
  const Camera& camera = bench1_truth().cameras[0];
  const TruePose& pose = bench1_truth().poses.front();
  ASSERT_EQ(pose.set, frame.set);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const TagDetection& tag : frame.tags) {
    const auto printed = std::find_if(target.tags.begin(), target.tags.end(),
                                      [&](const PrintedTag& t) { return t.id == tag.id; });
    const double h = target.tag_edge_m / 2;
    const std::array<Eigen::Vector2d, 4> away = {{{-h, h}, {h, h}, {h, -h}, {-h, -h}}};
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector2d at = printed->centre_m + away[k];
      const Eigen::Vector3d world = pose.world_from_target * Eigen::Vector3d(at.x(), at.y(), 0);
      const auto truth = project(camera.model, camera.cam_from_world * world);
      EXPECT_LT((tag.corners_px.col(k) - truth->px).norm(), 1.0);
      sum += tag.corners_px.col(k) - truth->px;
    }
  }
  EXPECT_LT((sum / 24).norm(), 0.15);
}

TEST(Detect, SameBytesAtAnyThreadCount) {
  const auto with_threads = [](int threads) {
    return detect::detect(recording(), rig(), asked(Surface::cloth, {"drape_A"}, threads));
  };
  const DetectResult one = with_threads(1), two = with_threads(3);
  const TemporaryFolder folder;
  write_detections(folder.path() / "one.json", one.detections);
  write_detections(folder.path() / "two.json", two.detections);
  EXPECT_EQ(read_text(folder.path() / "one.json"), read_text(folder.path() / "two.json"));
  ASSERT_EQ(one.previews.size(), two.previews.size());
  for (std::size_t k = 0; k < one.previews.size(); ++k) {
    EXPECT_EQ(one.previews[k].bytes, two.previews[k].bytes);
  }
}

TEST(Detect, AnEmptyBenchHasNoMarksAndSaysSo) {
  const DetectResult result = run(Surface::cloth, {"empty"});
  EXPECT_EQ(result.report.marks, 0);
  EXPECT_EQ(result.report.frames_without_marks.size(), 3U);
  EXPECT_THAT(result.report.warnings.front(), HasSubstr("no tag of the print was recognised"));
}

/// A recording in which one picture of the set shows the empty bench.
Recording with_empty_picture(const std::string& set_name) {
  Recording source = recording();
  const RecordedFrame empty = source.set("empty").frames[1];
  for (FrameSet& set : source.sets)
    if (set.name == set_name) set.frames[1] = empty;
  return source;
}

TEST(Detect, ANoGoStandsInTheFileWithItsSet) {
  Detections of_empty =
      run(Surface::cloth, {"drape_A", "drape_C"}, with_empty_picture("drape_C")).detections;
  const TemporaryFolder folder;
  write_detections(folder.path() / "d.json", of_empty);
  of_empty = read_detections(folder.path() / "d.json");
  EXPECT_EQ(of_empty.reason_against({"drape_A"}), std::nullopt);
  EXPECT_THAT(of_empty.reason_against({"drape_A", "drape_C"}).value_or(""),
              HasSubstr("set drape_C is NO-GO: no mark in the picture of cam1"));
  of_empty.no_go = {{"drape_E", "no such set"}};
  write_detections(folder.path() / "d.json", of_empty);
  EXPECT_THROW(static_cast<void>(read_detections(folder.path() / "d.json")), Error);
}

TEST(Detect, ACameraMayNotSeeAFreePoseButMustSeeAStage) {
  const DetectResult pose =
      run(Surface::target, {"stage_z000", "pose_00"}, with_empty_picture("pose_00"));
  EXPECT_TRUE(pose.report.good());
  EXPECT_TRUE(pose.detections.no_go.empty());
  EXPECT_THAT(pose.report.warnings, testing::Contains(HasSubstr("set pose_00, camera cam1")));
  const DetectResult stage =
      run(Surface::target, {"stage_z000", "pose_00"}, with_empty_picture("stage_z000"));
  EXPECT_FALSE(stage.report.good());
  EXPECT_TRUE(stage.detections.no_go.contains("stage_z000"));
}

TEST(Detect, WhatCaptureRefusedStaysRefused) {
  Recording source = recording();
  for (FrameSet& set : source.sets)
    if (set.name == "drape_A") set.no_go = "the cloth moved by 3.1 px";
  const DetectResult result = run(Surface::cloth, {"drape_A"}, source);
  EXPECT_FALSE(result.report.good());
  EXPECT_GT(result.report.marks, 0);
  EXPECT_THAT(result.detections.no_go.at("drape_A"), HasSubstr("the cloth moved by 3.1 px"));
}

TEST(Detect, ADiameterThatTooFewDotsShowIsNotConfirmed) {
  DetectOptions options = asked(Surface::cloth, {"drape_C"});
  options.limits.least_semi_axis_px = 8.6;  // leaves few marks
  const DetectResult few = detect::detect(recording(), rig(), options);
  EXPECT_GT(few.report.marks, 0);
  EXPECT_FALSE(few.report.dot_size_ratio);
  const auto said = testing::Contains(HasSubstr("the diameter of the dots is not measured"));
  EXPECT_THAT(few.report.warnings, said);
  EXPECT_TRUE(drapes().report.dot_size_ratio);
  EXPECT_THAT(drapes().report.warnings, testing::Not(said));
}

TEST(Detect, TheWrongPrintLabelsNothing) {
  // Views of the target searched for the cloth's print, whose tags they do not show.
  const DetectResult result = run(Surface::cloth, {"stage_z000"});
  EXPECT_EQ(result.report.marks, 0);
}

Error failure(const Recording& source, const Rig& bench = rig()) {
  return error_of([&] { (void)run(Surface::cloth, {"drape_A"}, source, bench); });
}

TEST(Detect, NamesAMissingCamera) {
  Recording source = recording();
  for (FrameSet& set : source.sets) {
    std::erase_if(set.frames, [](const RecordedFrame& f) { return f.camera == "cam1"; });
  }
  const Error error = failure(source);
  EXPECT_EQ(error.kind(), ErrorKind::bad_input);
  EXPECT_EQ(error.where().camera, "cam1");
  EXPECT_EQ(error.where().set, "drape_A");
}

TEST(Detect, PicturesOfACameraThatTheRigLacksAreCountedAndNotUsed) {
  Rig bench = rig();
  bench.cameras.pop_back();
  const DetectResult result = run(Surface::cloth, {"drape_C"}, recording(), bench);
  EXPECT_EQ(result.detections.frames.size(), 2U);
  EXPECT_EQ(result.report.not_in_rig, (std::map<std::string, int>{{"cam2", 1}}));
  EXPECT_TRUE(drapes().report.not_in_rig.empty());
}

TEST(Detect, NamesAnAlteredImage) {
  Recording source = recording();
  for (FrameSet& set : source.sets) {
    for (RecordedFrame& frame : set.frames) {
      if (set.name == "drape_A" && frame.camera == "cam2") frame.sha256.front() ^= 1;
    }
  }
  const Error error = failure(source);
  EXPECT_EQ(error.kind(), ErrorKind::bad_input);
  EXPECT_THAT(error.what(), HasSubstr("cam2"));
  EXPECT_THAT(error.what(), HasSubstr("drape_A"));
}

TEST(Detect, NamesACameraOfAnotherSize) {
  Rig bench = rig();
  bench.cameras[0].width_px = 1280;
  const Error error = failure(recording(), bench);
  EXPECT_THAT(error.what_failed(), HasSubstr("1600x1200"));
  EXPECT_THAT(error.what_failed(), HasSubstr("1280x1200"));
  EXPECT_EQ(error.where().camera, "cam0");
}

TEST(Detect, RefusesOptionsThatMakeNoSense) {
  DetectOptions options;
  EXPECT_THROW(options.check(), Error);  // no set
  options.sets = {"a", "a"};
  EXPECT_THROW(options.check(), Error);
  options.sets = {"a"};
  EXPECT_NO_THROW(options.check());
  options.limits.most_sigma_radii = 0;
  EXPECT_THROW(options.check(), Error);
}

}  // namespace
}  // namespace drape::test
