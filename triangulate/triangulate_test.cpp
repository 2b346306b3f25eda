// SPDX-License-Identifier: Apache-2.0
#include "triangulate/triangulate.hpp"

#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cstdio>
#include <random>

#include "core/error.hpp"
#include "core/fields/records.hpp"
#include "core/units.hpp"
#include "tests/support/bench1_truth.hpp"

namespace drape::triangulate {
namespace {

using test::bench1_truth;
using testing::AllOf;
using testing::HasSubstr;
using units::mm;

Calibration true_calibration() {
  Calibration calibration;
  calibration.method = "tsai";
  calibration.rig = "bench1";
  for (const Camera& camera : bench1_truth().cameras) {
    CalibratedCamera calibrated;
    calibrated.camera = camera;
    calibration.cameras.push_back(calibrated);
  }
  return calibration;
}

enum class Seen { centre, centroid };

/// Sets the ellipse of a 4 mm dot with the true normal in a camera.
void add_ellipse(Detection& d, const test::TrueDot& dot, const Camera& camera) {
  const Eigen::Matrix<double, 2, 3> map =
      project(camera.model, camera.cam_from_world * dot.point_in_world)->d_px_d_point *
      camera.cam_from_world.rotation * 2 * mm;
  const Eigen::Vector2d shortened = map * dot.normal_in_world;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(map * map.transpose() -
                                                            shortened * shortened.transpose());
  d.semi_axes_px = axes.eigenvalues().reverse().cwiseMax(0.01).cwiseSqrt();
  const Eigen::Vector2d major = axes.eigenvectors().col(1);
  d.axis_angle_rad = std::atan2(major.y(), major.x());
}

/// Detections of a drape of bench1 from the renderer's truth, with noise.
Detections true_detections(const std::string& drape, Seen seen, double noise_px) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 1);
  Detections detections;
  detections.rig = "bench1";
  detections.lattice = {Surface::cloth,     11, 11, 20 * mm, 4 * mm, {220 * mm, 220 * mm},
                        {10 * mm, 10 * mm}, {}};
  for (int camera = 0; camera < 3; ++camera) {
    FrameDetections frame;
    frame.set = "drape_" + drape;
    frame.camera = "cam" + std::to_string(camera);
    frame.width_px = 1600;
    frame.height_px = 1200;
    for (const test::TrueDot& dot : bench1_truth().drapes.at(drape)) {
      const test::TrueView& view = dot.views[camera];
      if (!view.visible || view.visible_fraction < 0.99) continue;
      Detection d;
      d.semi_axes_px.setZero();
      d.mark = dot.mark;
      d.centre_px = seen == Seen::centre ? view.px : view.centroid_px;
      d.centre_px += noise_px * Eigen::Vector2d(noise(random), noise(random));
      d.covariance_px2 = std::max(1e-6, noise_px * noise_px) * Eigen::Matrix2d::Identity();
      if (seen == Seen::centroid) add_ellipse(d, dot, bench1_truth().cameras[camera]);
      frame.detections.push_back(d);
    }
    detections.frames.push_back(frame);
  }
  return detections;
}

TriangulateOptions plain() {
  TriangulateOptions options;
  options.correct_dot_shape = false;
  options.floor_px = 0;
  return options;
}

Eigen::Vector3d truth_of(const std::string& drape, MarkId mark) {
  return bench1_truth().drapes.at(drape)[mark.row * 11 + mark.col].point_in_world;
}

TEST(Triangulate, FindsBench1sDotsFromTheirTrueImages) {
  for (const std::string drape : {"A", "C", "E"}) {
    const TriangulateResult result = triangulate(true_detections(drape, Seen::centre, 0),
                                                 true_calibration(), "drape_" + drape, plain());
    // The truth is printed with 1e-4 px and 1e-4 mm: 0.0005 mm covers both at 4 px per mm.
    for (const SheetMark& mark : result.sheet.marks)
      EXPECT_LT((mark.point_in_world - truth_of(drape, mark.mark)).norm() / mm, 0.002);
    EXPECT_EQ(result.report.measured + result.report.gaps, 121);
    for (const test::TrueDot& dot : bench1_truth().drapes.at(drape)) {
      if (dot.facing_views(60) >= 2) {
        EXPECT_NE(result.sheet.find(dot.mark), nullptr);
      }
    }
  }
}

/// Errors in mm, and squared Mahalanobis distances, of all measured marks of the drapes.
struct Errors {
  std::vector<double> distance_mm, mahalanobis2;
  double squared_mm2 = 0, predicted_mm2 = 0;  ///< sums of the squared distances

  [[nodiscard]] double rms_mm() const {
    return std::sqrt(squared_mm2 / static_cast<double>(distance_mm.size()));
  }
};

Errors errors_of(const TriangulateOptions& options) {
  Errors errors;
  for (const std::string drape : {"A", "C", "E"}) {
    const TriangulateResult result = triangulate(true_detections(drape, Seen::centroid, 0.02),
                                                 true_calibration(), "drape_" + drape, options);
    for (const SheetMark& mark : result.sheet.marks) {
      const Eigen::Vector3d error = mark.point_in_world - truth_of(drape, mark.mark);
      errors.distance_mm.push_back(error.norm() / mm);
      errors.mahalanobis2.push_back(error.dot(mark.covariance_m2->llt().solve(error)));
      errors.squared_mm2 += error.squaredNorm() / (mm * mm);
      errors.predicted_mm2 += mark.covariance_m2->trace() / (mm * mm);
    }
  }
  std::sort(errors.distance_mm.begin(), errors.distance_mm.end());
  std::sort(errors.mahalanobis2.begin(), errors.mahalanobis2.end());
  return errors;
}

double quantile(const std::vector<double>& sorted, double fraction) {
  return sorted[static_cast<std::size_t>(fraction * static_cast<double>(sorted.size() - 1))];
}

TEST(Triangulate, ReachesBench1sAccuracyFromTheCentroidsOfBentDots) {
  TriangulateOptions uncorrected;
  uncorrected.correct_dot_shape = false;
  const Errors with = errors_of({}), without = errors_of(uncorrected);
  std::printf(
      "median %.4f mm (%.4f mm without the dots' shape), 95 %% below %.4f (%.4f) mm, "
      "median of Mahalanobis' square %.2f (ideal 2.37; %.2f)\n",
      quantile(with.distance_mm, 0.5), quantile(without.distance_mm, 0.5),
      quantile(with.distance_mm, 0.95), quantile(without.distance_mm, 0.95),
      quantile(with.mahalanobis2, 0.5), quantile(without.mahalanobis2, 0.5));
  const double ratio = std::sqrt(with.squared_mm2 / with.predicted_mm2);
  std::printf("RMS %.4f mm, %.3f of what the covariance predicts\n", with.rms_mm(), ratio);
  EXPECT_LE(with.rms_mm(), 0.05);
  EXPECT_LE(ratio, 1.15);
  EXPECT_GT(with.distance_mm.size(), 250u);
  EXPECT_LE(quantile(with.distance_mm, 0.5), 0.04);
  EXPECT_LE(quantile(with.distance_mm, 0.95), 0.15);
  EXPECT_LT(quantile(with.distance_mm, 0.5), quantile(without.distance_mm, 0.5));
  EXPECT_LT(quantile(with.distance_mm, 0.95), quantile(without.distance_mm, 0.95));
}

TEST(Triangulate, ACameraThatMovedSinceItsCalibrationMissesTheOthers) {
  Calibration calibration = true_calibration();
  for (CalibratedCamera& camera : calibration.cameras) {
    camera.covariance_parameters = parameter_names(camera.camera.model);
    const auto size = static_cast<Eigen::Index>(camera.covariance_parameters.size());
    camera.covariance = Eigen::MatrixXd::Zero(size, size);
    camera.covariance(2, 2) = camera.covariance(3, 3) = 0.03 * 0.03;  // px^2, the image centre
  }
  const Detections detections = true_detections("A", Seen::centroid, 0.02);
  const TriangulateResult good = triangulate(detections, calibration, "drape_A", {});
  ASSERT_EQ(good.report.pairs.size(), 3u);
  for (const PairAgreement& pair : good.report.pairs) {
    EXPECT_TRUE(pair.good()) << pair.first << " " << pair.second << " " << pair.median_sigmas;
    EXPECT_LT(pair.median_sigmas, 1.5) << pair.first << " " << pair.second;
  }
  // a tenth of a degree, about five pixels
  Camera& moved = calibration.cameras[1].camera;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.00175, Eigen::Vector3d(0.6, 0.8, 0)).toRotationMatrix();
  moved.cam_from_world = {turn * moved.cam_from_world.rotation,
                          turn * moved.cam_from_world.translation_m};
  for (const PairAgreement& pair :
       triangulate(detections, calibration, "drape_A", {}).report.pairs) {
    EXPECT_EQ(pair.good(), pair.first == "cam0" && pair.second == "cam2")
        << pair.first << " " << pair.second << " " << pair.median_sigmas;
  }
}

TEST(Triangulate, AGapNamesTheCamerasThatLookAtItAndTheirAngles) {
  Detections detections = true_detections("A", Seen::centre, 0.02);
  const MarkId gone{5, 5};
  std::vector<std::string> saw;
  for (FrameDetections& frame : detections.frames)
    if (std::erase_if(frame.detections, [&](const Detection& d) { return d.mark == gone; }) > 0)
      saw.push_back(frame.camera);
  ASSERT_FALSE(saw.empty());
  const TriangulateResult result = triangulate(detections, true_calibration(), "drape_A", plain());
  const auto gap = std::find_if(result.sheet.gaps.begin(), result.sheet.gaps.end(),
                                [&](const Gap& g) { return g.mark == gone; });
  ASSERT_NE(gap, result.sheet.gaps.end());
  EXPECT_THAT(gap->reason, AllOf(HasSubstr("measured by none: "), HasSubstr(" degrees")));
  for (const std::string& camera : saw)
    EXPECT_THAT(gap->reason, HasSubstr(camera + " at ")) << gap->reason;
}

/// Angle in degrees between a dot's printed side and the direction to a camera.
double true_angle_deg(const std::string& drape, MarkId mark, int camera) {
  return std::acos(
             bench1_truth().drapes.at(drape)[mark.row * 11 + mark.col].views[camera].cos_view) /
         units::deg;
}

// A dot seen by one camera tells its normal by its ellipse, up to a mirrored one; the marks near it
// tell which. Angles are said to a degree; noise of the ellipse and the bend of the cloth allow 10.
TEST(Triangulate, AGapSaysTrulyWhichCamerasFaceIt) {
  int right = 0, wrong = 0;
  for (const std::string drape : {"A", "C", "E"}) {
    const TriangulateResult result = triangulate(true_detections(drape, Seen::centroid, 0.02),
                                                 true_calibration(), "drape_" + drape, {});
    for (const Gap& gap : result.sheet.gaps) {
      const auto turned = gap.reason.find("turned away from");
      const std::string away =
          turned == std::string::npos
              ? ""
              : gap.reason.substr(turned, gap.reason.find(';', turned) - turned);
      for (int camera = 0; camera < 3; ++camera) {
        const std::string name = "cam" + std::to_string(camera), at = name + " at ";
        const double truth = true_angle_deg(drape, gap.mark, camera);
        const auto said = gap.reason.find(at);
        if (said != std::string::npos)
          ++(std::abs(std::stod(gap.reason.substr(said + at.size())) - truth) < 10 ? right : wrong);
        if (away.find(name) != std::string::npos) ++(truth > 80 ? right : wrong);
      }
    }
  }
  std::printf("cameras said to face a gap or not: %d right, %d wrong\n", right, wrong);
  EXPECT_GT(right, 60);
  EXPECT_LE(20 * wrong, right);
}

TEST(Triangulate, EveryMarkIsMeasuredOnceOrAGapWithAReason) {
  Detections detections = true_detections("A", Seen::centre, 0.02);
  detections.frames[1].rejections.push_back({MarkId{10, 10}, std::nullopt, "bad fit"});
  std::erase_if(detections.frames[0].detections,
                [](const Detection& d) { return d.mark.row == 10; });
  std::erase_if(detections.frames[1].detections, [](const Detection& d) {
    return d.mark == MarkId{10, 10};
  });
  const TriangulateResult result = triangulate(detections, true_calibration(), "drape_A", plain());
  std::map<MarkId, int> count;
  for (const SheetMark& mark : result.sheet.marks) ++count[mark.mark];
  for (const Gap& gap : result.sheet.gaps) {
    ++count[gap.mark];
    EXPECT_FALSE(gap.reason.empty());
    if (gap.mark == MarkId{10, 10}) {
      EXPECT_EQ(gap.reason, "measured by no camera; cam1 rejected it: bad fit");
    }
  }
  EXPECT_EQ(count.size(), 121u);
  for (const auto& [mark, times] : count) EXPECT_EQ(times, 1);
  EXPECT_EQ(result.sheet.marks[0].material_m,
            Eigen::Vector2d(10 * mm + 20 * mm * result.sheet.marks[0].mark.row,
                            10 * mm + 20 * mm * result.sheet.marks[0].mark.col));
}

/// A print stated with one row or column more than the cloth has: all marks are found where they
/// are, and nothing but the empty edge, where cameras look, speaks of it. A hem of which one dot is
/// seen is none; one beyond the pictures may be there.
TEST(Triangulate, RefusesAnEdgeOfThePrintThatLiesInThePicturesButNoneShows) {
  Detections detections = true_detections("C", Seen::centre, 0.02);
  Calibration calibration = true_calibration();
  const auto report = [&] {
    return triangulate(detections, calibration, "drape_C", plain()).report;
  };
  EXPECT_THAT(report().warnings, Not(Contains(HasSubstr("no camera shows"))));
  EXPECT_THAT(report().no_go, testing::IsEmpty());
  detections.lattice.rows = 12;
  detections.lattice.patch_m.x() += 20 * mm;
  EXPECT_THAT(report().no_go, ElementsAre(AllOf(HasSubstr("no camera shows a mark of row 11"),
                                                HasSubstr("correct `rows` of its print"))));
  detections.lattice.cols = 12;
  detections.lattice.patch_m.y() += 20 * mm;
  EXPECT_THAT(report().no_go, Contains(HasSubstr("correct `cols` of its print")));
  detections.frames[0].rejections.push_back({MarkId{11, 5}, std::nullopt, "bad fit"});
  EXPECT_THAT(report().no_go, Not(Contains(HasSubstr("a mark of row 11"))));
  for (CalibratedCamera& one : calibration.cameras)
    std::visit([](auto& lens) { lens.cx_px -= 5000; }, one.camera.model.lens);
  for (FrameDetections& frame : detections.frames)
    for (Detection& one : frame.detections) one.centre_px.x() -= 5000;
  EXPECT_THAT(report().no_go, testing::IsEmpty());
  EXPECT_THAT(report().warnings,
              Contains(HasSubstr("a mark of col 11, 0 of which would lie within the pictures")));
}

TEST(Triangulate, LeavesOutOneWrongViewOfThree) {
  Detections detections = true_detections("C", Seen::centre, 0.02);
  const auto seen_by_all = [&](MarkId mark) {
    return std::all_of(detections.frames.begin(), detections.frames.end(), [&](const auto& frame) {
      return std::any_of(frame.detections.begin(), frame.detections.end(),
                         [&](const Detection& d) { return d.mark == mark; });
    });
  };
  MarkId victim{5, 5};
  ASSERT_TRUE(seen_by_all(victim));
  for (Detection& d : detections.frames[1].detections) {
    if (d.mark == victim) d.centre_px += Eigen::Vector2d(40, 55);  // near a neighbour's position
  }
  const TriangulateResult result = triangulate(detections, true_calibration(), "drape_C", plain());
  const SheetMark* mark = result.sheet.find(victim);
  ASSERT_NE(mark, nullptr);
  EXPECT_EQ(mark->views, 2);
  EXPECT_LT((mark->point_in_world - truth_of("C", victim)).norm() / mm, 0.1);
  ASSERT_EQ(result.report.dropped_views.size(), 1u);
  EXPECT_THAT(result.report.dropped_views[0], AllOf(HasSubstr("(5, 5)"), HasSubstr("cam1")));
}

TEST(Triangulate, NamesTheMarksThatAreNotSureOfTheirPlace) {
  const TriangulateOptions options;
  const TriangulateResult result = triangulate(true_detections("A", Seen::centroid, 0.02),
                                               true_calibration(), "drape_A", options);
  const auto named = [&](MarkId mark) {
    return std::find_if(result.report.doubts.begin(), result.report.doubts.end(),
                        [&](const Doubt& doubt) { return doubt.mark == mark && doubt.sigma_mm; });
  };
  int uncertain = 0;
  for (const SheetMark& mark : result.sheet.marks) {
    const double sigma_mm = std::sqrt(mark.covariance_m2->trace()) / mm;
    const auto doubt = named(mark.mark);
    EXPECT_EQ(doubt != result.report.doubts.end(), sigma_mm > options.doubt_mm);
    uncertain += sigma_mm > options.doubt_mm ? 1 : 0;
  }
  EXPECT_GT(uncertain, 0);
  EXPECT_LT(uncertain, 0.5 * static_cast<double>(result.sheet.marks.size()));
}

TEST(Triangulate, NamesAMarkWhoseViewsHardlyMeet) {
  Detections detections = true_detections("C", Seen::centre, 0.02);
  for (Detection& d : detections.frames[1].detections) {
    if (d.mark == MarkId{5, 5}) d.centre_px += Eigen::Vector2d(0.1, 0.1);  // five sigma
  }
  const TriangulateResult result = triangulate(detections, true_calibration(), "drape_C", plain());
  const auto& doubts = result.report.doubts;
  const auto doubt = std::find_if(doubts.begin(), doubts.end(), [](const Doubt& d) {
    return d.mark == MarkId{5, 5};
  });
  ASSERT_NE(doubt, doubts.end());
  ASSERT_TRUE(doubt->sigmas);
  EXPECT_GT(*doubt->sigmas, 3);
  // Without an error one mark in 740 is reported by chance.
  EXPECT_LE(doubts.size(), 3U);
}

TEST(Triangulate, SaysOnceThatTheCalibrationHasWarnings) {
  Calibration calibration = true_calibration();
  calibration.warnings = {"first", "second", "third"};
  const TriangulateResult result =
      triangulate(true_detections("C", Seen::centre, 0.02), calibration, "drape_C", plain());
  EXPECT_THAT(
      result.report.warnings,
      testing::Contains("calibration: first (the first of 3 warnings in its file)").Times(1));
  EXPECT_THAT(result.report.warnings, testing::Not(testing::Contains(HasSubstr("second"))));
}

TEST(Triangulate, WhatRestsOnADetectionThatIsNoGoIsNoGo) {
  Detections detections = true_detections("A", Seen::centre, 0.02);
  detections.no_go = {{"drape_A", "no mark in the picture of cam1"}, {"drape_C", "other"}};
  const TriangulateResult result = triangulate(detections, true_calibration(), "drape_A", {});
  EXPECT_EQ(result.sheet.no_go,
            "the detection of set drape_A is NO-GO: no mark in the picture of cam1");
  detections.no_go.erase("drape_A");
  EXPECT_EQ(triangulate(detections, true_calibration(), "drape_A", {}).sheet.no_go, std::nullopt);
}

TEST(Triangulate, TwoViewsThatMissEachOtherAreAGap) {
  Detections detections = true_detections("C", Seen::centre, 0.02);
  detections.frames.pop_back();
  for (Detection& d : detections.frames[0].detections) {
    if (d.mark == MarkId{5, 5}) d.centre_px.y() += 30;
  }
  const TriangulateResult result = triangulate(detections, true_calibration(), "drape_C", plain());
  EXPECT_EQ(result.sheet.find({5, 5}), nullptr);
  const auto gap =
      std::find_if(result.sheet.gaps.begin(), result.sheet.gaps.end(), [](const Gap& g) {
        return g.mark == MarkId{5, 5};
      });
  ASSERT_NE(gap, result.sheet.gaps.end());
  EXPECT_THAT(gap->reason, AllOf(HasSubstr("views disagree: cam0, cam1"), HasSubstr("sigma")));
}

TEST(Triangulate, AMarkTooFarFromItsNeighboursIsAGap) {
  // Both views see the label 35 mm away: they agree with each other, but not with the cloth.
  Detections detections = true_detections("C", Seen::centre, 0);
  const Eigen::Vector3d wrong = truth_of("C", {5, 5}) + Eigen::Vector3d(0, 0, 35 * mm);
  for (int camera = 0; camera < 3; ++camera) {
    const Camera& model = bench1_truth().cameras[camera];
    for (Detection& d : detections.frames[camera].detections) {
      if (d.mark == MarkId{5, 5})
        d.centre_px = project(model.model, model.cam_from_world * wrong)->px;
    }
  }
  const TriangulateResult result = triangulate(detections, true_calibration(), "drape_C", plain());
  const auto gap =
      std::find_if(result.sheet.gaps.begin(), result.sheet.gaps.end(), [](const Gap& g) {
        return g.mark == MarkId{5, 5};
      });
  ASSERT_NE(gap, result.sheet.gaps.end());
  EXPECT_THAT(gap->reason, HasSubstr("neighbours"));
  EXPECT_NE(result.sheet.find({5, 4}), nullptr);
  EXPECT_NE(result.sheet.find({4, 5}), nullptr);
}

TEST(Triangulate, DoesNotDependOnTheThreadCount) {
  const Detections detections = true_detections("E", Seen::centroid, 0.02);
  TriangulateOptions one, two;
  two.threads = 2;
  const Sheet a = triangulate(detections, true_calibration(), "drape_E", one).sheet;
  const Sheet b = triangulate(detections, true_calibration(), "drape_E", two).sheet;
  ASSERT_EQ(a.marks.size(), b.marks.size());
  for (std::size_t i = 0; i < a.marks.size(); ++i) {
    EXPECT_EQ(a.marks[i].point_in_world, b.marks[i].point_in_world);
    EXPECT_EQ(*a.marks[i].covariance_m2, *b.marks[i].covariance_m2);
  }
}

template <class F>
std::string refusal(F&& call) {
  try {
    static_cast<void>(call());
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Triangulate, RefusesByName) {
  const Detections good = true_detections("A", Seen::centre, 0);
  const Calibration calibration = true_calibration();
  EXPECT_THAT(refusal([&] { return triangulate(good, calibration, "drape_X", plain()); }),
              AllOf(HasSubstr("drape_X"), HasSubstr("`drape_A`")));
  Calibration two = calibration;
  two.cameras.pop_back();
  EXPECT_THAT(refusal([&] { return triangulate(good, two, "drape_A", plain()); }),
              HasSubstr("cam2"));
  Detections small = good;
  small.frames[1].height_px = 960;
  EXPECT_THAT(refusal([&] { return triangulate(small, calibration, "drape_A", plain()); }),
              AllOf(HasSubstr("1600 x 960"), HasSubstr("cam1")));
  Detections nan = good;
  nan.frames[0].detections[7].covariance_px2(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal([&] { return triangulate(nan, calibration, "drape_A", plain()); }),
              AllOf(HasSubstr("cam0"), HasSubstr("finite")));
  Detections target = good;
  target.lattice.surface = Surface::target;
  EXPECT_THAT(refusal([&] { return triangulate(target, calibration, "drape_A", plain()); }),
              HasSubstr("not of a cloth"));
  TriangulateOptions options;
  options.max_stretch = 0.5;
  EXPECT_THROW(check_record(options), Error);
}

}  // namespace
}  // namespace drape::triangulate
