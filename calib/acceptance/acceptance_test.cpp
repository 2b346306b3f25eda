// SPDX-License-Identifier: Apache-2.0
// Acceptance of drawn instruments: the stated uncertainty of every figure holds, and faults are
// named. The calibration is joint's own; the acceptance sets are others. Where OpenCV's calib3d is
// installed, it makes all images.
#include "calib/acceptance/acceptance.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <random>

#include "calib/acceptance/protocol.hpp"
#include "calib/joint.hpp"
#include "calib/joint/start.hpp"
#include "calib/test_rigs.hpp"
#include "core/error.hpp"
#include "core/units.hpp"
#include "tests/support/trials.hpp"

#ifdef DRAPE_HAS_OPENCV_CALIB3D
#include <opencv2/calib3d.hpp>
#endif

namespace drape {
namespace {

using namespace calib;
using test::SyntheticBench;
using testing::HasSubstr;
using units::mm;

Target target_of_tests() {
  Target target;
  target.kind = TargetKind::chessboard;
  target.rows = 9;
  target.cols = 12;
  target.pitch_m = 20 * mm;
  return target;
}

std::optional<Eigen::Vector2d> image_by_another(const JointCamera& seen_by,
                                                const Eigen::Vector3d& in_camera) {
#ifdef DRAPE_HAS_OPENCV_CALIB3D
  const auto& lens = std::get<BrownLens>(seen_by.camera.model.lens);
  const cv::Matx33d k(lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0, 1);
  const cv::Vec<double, 5> distortion(lens.k1, lens.k2, lens.p1, lens.p2, lens.k3);
  std::vector<cv::Point2d> px;
  cv::projectPoints(std::vector<cv::Point3d>{{in_camera.x(), in_camera.y(), in_camera.z()}},
                    cv::Vec3d(), cv::Vec3d(), k, distortion, px);
  return Eigen::Vector2d(px[0].x, px[0].y);
#else
  const auto image = project(seen_by.camera.model, in_camera);
  if (!image) return std::nullopt;
  return image->px;
#endif
}

/// Frames of all placements, by a projection that is not ours; errors of a view's points are partly
/// common.
void see_by_another(JointModel& model, double noise_px, double common_share, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_px);
  model.frames.clear();
  for (std::size_t p = 0; p < model.placements.size(); ++p) {
    for (std::size_t c = 0; c < model.cameras.size(); ++c) {
      JointFrame frame{c, p, {}};
      for (int dot = 0; dot < 108; ++dot) {
        const int row = dot / 12, col = dot % 12;
        const Eigen::Vector3d flat((col - 5.5) * 0.02, (row - 4) * 0.02, 0);
        const auto px = image_by_another(
            model.cameras[c], model.cameras[c].camera.cam_from_world *
                                  (model.placements[p].world_from_target * model.bow.bent(flat)));
        if (!px) continue;
        frame.points.push_back({{row, col},
                                flat,
                                *px + Eigen::Vector2d(noise(random), noise(random)),
                                noise_px * noise_px * Eigen::Matrix2d::Identity()});
      }
      if (common_share > 0) test::disturb(frame, common_share * noise_px, random);
      model.frames.push_back(frame);
    }
  }
}

Detections detections_of(const JointModel& model) {
  Detections detections;
  const Target target = target_of_tests();
  detections.lattice.surface = Surface::target;
  detections.lattice.rows = target.rows;
  detections.lattice.cols = target.cols;
  detections.lattice.pitch_m = target.pitch_m;
  for (const JointFrame& frame : model.frames) {
    FrameDetections one;
    one.set = model.placements[frame.placement].set;
    one.camera = model.cameras[frame.camera].camera.name;
    one.width_px = model.cameras[frame.camera].camera.model.width_px;
    one.height_px = model.cameras[frame.camera].camera.model.height_px;
    for (const TargetPoint& point : frame.points) {
      Detection d;
      d.mark = point.dot;
      d.centre_px = point.measured_px;
      d.covariance_px2 = point.covariance_px2;
      d.semi_axes_px.setConstant(5);
      one.detections.push_back(d);
    }
    detections.frames.push_back(one);
  }
  return detections;
}

/// Marks on a ball of 80 mm, those that at least a camera sees at less than 60 degrees.
SphereInput ball_of(const std::vector<JointCamera>& cameras, double noise_px, unsigned seed) {
  SphereInput sphere;
  sphere.diameter_mm = 80;
  sphere.standard_uncertainty_mm = 0.002;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_px);
  const double radius = 40 * mm * (1 + 0.002 / 80 * std::normal_distribution<double>()(random));
  const Eigen::Vector3d middle(0.004, -0.006, 0.02);
  for (const JointCamera& camera : cameras) {
    FrameDetections frame;
    frame.set = "ball";
    frame.camera = camera.camera.name;
    for (int row = 0; row < 13; ++row) {
      for (int col = 0; col < 13; ++col) {
        const Eigen::Vector2d angle = Eigen::Vector2d(row - 6, col - 6) * 0.16;
        const Eigen::Vector3d up =
            Eigen::Vector3d(std::sin(angle.x()), std::cos(angle.x()) * std::sin(angle.y()),
                            std::cos(angle.x()) * std::cos(angle.y()));
        const Eigen::Vector3d at = middle + radius * up;
        if ((centre_in_world(camera.camera) - at).normalized().dot(up) < 0.5) continue;
        const auto px = image_by_another(camera, camera.camera.cam_from_world * at);
        if (!px) continue;
        Detection d;
        d.mark = {row, col};
        d.centre_px = *px + Eigen::Vector2d(noise(random), noise(random));
        d.covariance_px2 = noise_px * noise_px * Eigen::Matrix2d::Identity();
        d.semi_axes_px.setConstant(5);
        frame.detections.push_back(d);
      }
    }
    sphere.marks.frames.push_back(frame);
  }
  return sphere;
}

/// A bench of two or three cameras that is calibrated once. Everything follows from the seed.
struct Instrument {
  unsigned seed = 0;
  double noise_px = 0, common_share = 0;
  /// Of the drawn errors over the stated ones: disturb() adds six shapes, each with a mean square
  /// of 1, that the points' covariances do not state.
  [[nodiscard]] double noise_ratio() const {
    return std::sqrt(1 + 6 * common_share * common_share);
  }
  JointModel truth;  ///< cameras as they are
  Calibration calibration;
  Rig rig;
};

Instrument instrument(unsigned seed) {
  Instrument made;
  made.seed = seed;
  std::mt19937 random(seed + 77);
  made.noise_px = std::uniform_real_distribution<double>(0.02, 0.06)(random);
  made.common_share = seed % 3 == 0 ? 0 : 0.1;
  made.truth = SyntheticBench(seed, 10 + static_cast<int>(seed % 7)).true_model();
  if (seed % 4 == 1) made.truth.cameras.pop_back();
  made.truth.bow.edge_rise_mm.setZero();
  see_by_another(made.truth, made.noise_px, made.common_share, seed + 1);
  JointModel model = test::forgotten(made.truth);
  start_joint(model);
  JointOptions options;
  options.lens = LensTerms::k1_k2;
  made.calibration = calibrate_joint(model, 0, options).calibration;
  made.rig.name = "drawn";
  made.rig.stages = {{"stage0", 0}, {"stage1", 0.06}};
  return made;
}

/// What the instrument sees of two stages, eight positions, five repeats and a ball. `fault` may
/// change what is true since the calibration.
template <typename Fault>
AcceptanceInput recorded(const Instrument& of, Fault fault) {
  JointModel later = SyntheticBench(of.seed + 5000, 8).true_model();
  later.cameras = of.truth.cameras;
  later.bow.edge_rise_mm.setZero();
  Placement rest = later.placements[3];
  for (int i = 0; i < 5; ++i) {
    rest.set = "rest_" + std::to_string(i);
    later.placements.push_back(rest);
  }
  fault(later);
  see_by_another(later, of.noise_px, of.common_share, of.seed + 2);
  AcceptanceInput input;
  input.target = detections_of(later);
  input.repeats = {"rest_0", "rest_1", "rest_2", "rest_3", "rest_4"};
  input.sphere = ball_of(later.cameras, of.noise_px, of.seed + 3);
  return input;
}

Acceptance accepted(const Instrument& made, const AcceptanceInput& input,
                    const AcceptanceOptions& options = {}) {
  return accept(input, made.calibration, made.rig, target_of_tests(), options);
}

void no_fault(JointModel&) {}

TEST(Acceptance, FiguresOfGoodInstrumentsAreInsideTheirUncertainty) {
  const int instruments = test::trial_count(4, 200);
  int refused = 0, all = 0, inside = 0;
  std::map<std::string, std::pair<int, int>> by_name;
  for (int seed = test::first_trial(); seed < test::first_trial() + instruments; ++seed) {
    const Instrument made = instrument(static_cast<unsigned>(seed));
    const Acceptance result = accepted(made, recorded(made, no_fault));
    refused += !result.good();
    if (!result.good()) std::printf("seed %d: %s\n", seed, result.cause.c_str());
    for (const AcceptanceFigure& figure : result.figures) {
      EXPECT_EQ(figure.not_measured, "") << figure.name;
      EXPECT_GT(figure.expanded, 0) << figure.name;
      const double expected = figure.name == "noise of repeats" ? made.noise_ratio() : 0;
      const bool held = std::abs(figure.value - expected) <= figure.expanded;
      inside += held;
      ++all;
      auto& [own_inside, own_all] =
          by_name[figure.name.starts_with("place") ? "place" : figure.name];
      own_inside += held;
      ++own_all;
    }
  }
  for (const auto& [name, counts] : by_name)
    std::printf("%s inside U: %d of %d\n", name.c_str(), counts.first, counts.second);
  std::printf("inside U: %d of %d, refused %d of %d\n", inside, all, refused, instruments);
  // Three standard deviations of a count below 95 %.
  EXPECT_GE(inside, 0.95 * all - 3 * std::sqrt(0.95 * 0.05 * all));
  // The 1 %; in the short slice none.
  EXPECT_LE(refused, instruments / 100);
}

Eigen::Vector3d direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
}

void exchange(Detections& detections, const std::string& a, const std::string& b) {
  for (FrameDetections& frame : detections.frames) {
    if (frame.camera == a) {
      frame.camera = b;
    } else if (frame.camera == b) {
      frame.camera = a;
    }
  }
}

/// By fault: how often it was named as it is, and how often the instrument passed as good.
struct Injected {
  std::map<std::string, int> named, go;
};

/// Injects every fault into one instrument.
void inject(int seed, Injected& counts) {
  const Instrument made = instrument(static_cast<unsigned>(seed) + 20000);
  std::mt19937 random(static_cast<unsigned>(seed));
  const std::size_t cameras = made.truth.cameras.size();
  const std::size_t one = random() % cameras,
                    other = (one + 1 + random() % (cameras - 1)) % cameras;
  const std::string first = made.truth.cameras[one].camera.name,
                    second = made.truth.cameras[other].camera.name;
  const double sign = random() % 2 == 0 ? 1 : -1;
  const auto judge = [&](const std::string& fault, const AcceptanceInput& input,
                         const std::vector<std::string>& words) {
    const Acceptance result = accepted(made, input);
    const bool found = std::all_of(words.begin(), words.end(), [&](const std::string& word) {
      return result.cause.find(word) != std::string::npos;
    });
    counts.named[fault] += found && !result.good();
    counts.go[fault] += result.good();
    if (!found || result.good())
      std::printf("seed %d, %s: %s\n", seed, fault.c_str(), result.cause.c_str());
  };
  judge("scale of 0.02 %",
        recorded(made,
                 [&](JointModel& model) {
                   for (Placement& placement : model.placements)
                     placement.world_from_target.rotation *= 1 + sign * 0.0002;
                 }),
        {"all lengths"});
  const Eigen::Vector3d shift = 0.05 * mm * direction(random);
  judge("camera moved by 0.05 mm",
        recorded(made,
                 [&](JointModel& model) {
                   CamFromWorld& pose = model.cameras[one].camera.cam_from_world;
                   pose.translation_m += pose.rotation * shift;
                 }),
        {first, "moved since"});
  const bool along_x = random() % 2 == 0;
  judge("bow of 0.1 mm",
        recorded(made,
                 [&](JointModel& model) { model.bow.edge_rise_mm[along_x ? 0 : 1] = sign * 0.1; }),
        {"the plate is bowed"});
  AcceptanceInput swapped = recorded(made, no_fault);
  exchange(swapped.target, first, second);
  judge("cameras exchanged", swapped, {first, second, "exchanged"});
  AcceptanceInput mirrored = recorded(made, no_fault);
  const int kind = seed % 4;
  for (FrameDetections& frame : mirrored.target.frames) {
    if (kind < 2 && frame.camera != first) continue;
    for (Detection& d : frame.detections) {
      if (kind == 0 || kind == 2) d.centre_px.x() = frame.width_px - 1 - d.centre_px.x();
      if (kind == 1) d.centre_px.y() = frame.height_px - 1 - d.centre_px.y();
      if (kind == 3) d.mark.col = 11 - d.mark.col;
    }
  }
  judge("mirrored", mirrored, {"mirrored"});
}

TEST(Acceptance, EveryInjectedFaultIsNamed) {
  const int instruments = test::trial_count(3, 200);
  Injected counts;
  for (int i = 0; i < instruments; ++i) inject(test::first_trial() + i, counts);
  for (const auto& [fault, count] : counts.named) {
    std::printf("%s: named %d of %d, passed as good %d\n", fault.c_str(), count, instruments,
                counts.go[fault]);
    EXPECT_EQ(count, instruments) << fault;
    EXPECT_EQ(counts.go[fault], 0) << fault;
  }
}

TEST(Acceptance, TheSmallestFaultThatItStatesIsNamedMostly) {
  const int instruments = test::trial_count(4, 100);
  int named = 0;
  for (int seed = 0; seed < instruments; ++seed) {
    const Instrument made = instrument(static_cast<unsigned>(seed) + 40000);
    double smallest = 0;
    for (const AcceptanceFigure& figure : accepted(made, recorded(made, no_fault)).figures)
      if (figure.name == "growth of the plate") smallest = figure.smallest / 100;
    ASSERT_GT(smallest, 0);
    const Acceptance result = accepted(made, recorded(made, [&](JointModel& model) {
                                         for (Placement& placement : model.placements)
                                           placement.world_from_target.rotation *= 1 + smallest;
                                       }));
    named += !result.good();
  }
  std::printf("faults of the smallest stated size: NO-GO in %d of %d\n", named, instruments);
  // 95 % are stated; three standard deviations of a count below it.
  EXPECT_GE(named, 0.95 * instruments - 3 * std::sqrt(0.95 * 0.05 * instruments));
}

TEST(Acceptance, LimitsOfTheOperatorPermitASmallChangeAndSayIt) {
  const Instrument made = instrument(7);
  const AcceptanceInput input = recorded(made, [](JointModel& model) {
    for (Placement& placement : model.placements) placement.world_from_target.rotation *= 1.0002;
  });
  AcceptanceOptions options;
  options.max_length_error_mm = 0.2;
  options.max_flatness_mm = 0.2;
  const Acceptance permitted = accepted(made, input, options);
  EXPECT_TRUE(permitted.good()) << permitted.cause;
  ASSERT_FALSE(permitted.warnings.empty());
  EXPECT_THAT(permitted.warnings.front(), HasSubstr("all lengths on the plate"));
  options.max_length_error_mm = 0.02;
  EXPECT_FALSE(accepted(made, input, options).good());
}

TEST(Acceptance, ABowThatIsKnownToATenthPermitsATenth) {
  const Instrument made = instrument(6);
  const AcceptanceInput input = recorded(made, [](JointModel& model) {
    model.bow.edge_rise_mm = {0.1, -0.05};
  });
  EXPECT_THAT(accepted(made, input).cause, HasSubstr("the plate is bowed"));
  AcceptanceOptions options;
  options.bow_sd_mm = {0.1, 0.1};
  const Acceptance permitted = accepted(made, input, options);
  EXPECT_TRUE(permitted.good()) << permitted.cause;
  // Twenty standard deviations are no uncertainty.
  const AcceptanceInput far = recorded(made, [](JointModel& model) {
    model.bow.edge_rise_mm = {2, 0};
  });
  EXPECT_THAT(accepted(made, far, options).cause, HasSubstr("the plate is bowed"));
}

TEST(Acceptance, ABallOfAnotherSizeIsNoGo) {
  const Instrument made = instrument(8);
  AcceptanceInput input = recorded(made, no_fault);
  input.sphere->diameter_mm += 0.1;
  const Acceptance result = accepted(made, input);
  EXPECT_FALSE(result.good());
  for (const AcceptanceFigure& figure : result.figures) {
    EXPECT_EQ(figure.good(), figure.name != "diameter of the sphere") << figure.name;
  }
}

TEST(Acceptance, ANoisierCameraIsNoGo) {
  const Instrument made = instrument(9);
  AcceptanceInput input = recorded(made, no_fault);
  for (FrameDetections& frame : input.target.frames)
    for (Detection& d : frame.detections) d.covariance_px2 /= 4;
  const Acceptance result = accepted(made, input);
  EXPECT_FALSE(result.good());
  for (const AcceptanceFigure& figure : result.figures) {
    if (figure.name == "noise of repeats") {
      EXPECT_NEAR(figure.value, 2, 0.1);
    }
  }
}

TEST(Acceptance, AnotherPlateBringsItsOwnScale) {
  const Instrument made = instrument(10);
  const AcceptanceInput input = recorded(made, [](JointModel& model) {
    for (Placement& placement : model.placements) placement.world_from_target.rotation *= 1.0002;
  });
  Target other = target_of_tests();
  other.known_length = KnownLength{{0, 0}, {8, 11}, 0.272, 0.272 * 0.0002};
  AcceptanceOptions options;
  options.own_target = false;
  const Acceptance result = accept(input, made.calibration, made.rig, other, options);
  EXPECT_TRUE(result.good()) << result.cause;
}

TEST(Acceptance, TooFewPositionsAreNoAcceptance) {
  const Instrument made = instrument(3);
  AcceptanceInput input = recorded(made, no_fault);
  std::erase_if(input.target.frames, [](const FrameDetections& frame) {
    return frame.set.starts_with("pose") || frame.set.starts_with("rest");
  });
  const Acceptance result = accepted(made, input);
  EXPECT_FALSE(result.good());
  EXPECT_THAT(result.figures[0].not_measured, HasSubstr("2 positions"));
}

TEST(Acceptance, TheProtocolSaysEveryFigureAndEscapesNames) {
  Acceptance acceptance;
  acceptance.rig = "<b>";
  AcceptanceFigure length, shift;
  length.name = "length error";
  length.unit = "mm";
  length.value = 0.02;
  length.expanded = 0.01;
  length.limit = 0.1;
  shift.name = "known shift";
  shift.not_measured = "no stage";
  shift.may_lack = true;
  acceptance.figures = {length, shift};
  EXPECT_TRUE(acceptance.good());
  const std::string page = protocol_page(acceptance, dates_of("2026-01-31", 365));
  EXPECT_THAT(page, HasSubstr("&lt;b&gt;"));
  EXPECT_THAT(page, HasSubstr("0.0200 mm"));
  EXPECT_THAT(page, HasSubstr("no stage"));
  EXPECT_THAT(page, HasSubstr("2026-01-31, valid until 2027-01-31"));
  for (const char* wrong : {"2026-02-30", "31.1.2026", "2026-01-31x", "no date"})
    EXPECT_THROW((void)dates_of(wrong, 365), Error) << wrong;
  EXPECT_EQ(dates_of("", 365).valid_until, "");
}

}  // namespace
}  // namespace drape
