// SPDX-License-Identifier: Apache-2.0
// Acceptance of simulated instruments: the stated uncertainty of every figure holds, and faults are
// identified.
#include "calib/acceptance/acceptance.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <random>

#include "calib/acceptance/test_instruments.hpp"
#include "calib/test_rigs.hpp"
#include "core/error.hpp"
#include "core/units.hpp"
#include "tests/support/trials.hpp"

namespace drape {
namespace {

using namespace calib;
using test::SyntheticBench;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using units::mm;

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
  // three standard deviations of a count below 95 %
  EXPECT_GE(inside, 0.95 * all - 3 * std::sqrt(0.95 * 0.05 * all));
  // at most 1 %; none in the short run
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

/// Per fault: how often it was identified, and how often the instrument was accepted.
struct Injected {
  std::map<std::string, int> named, go;
};

/// Injects every fault into one instrument and counts the results.
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
  judge(
      "bow of 0.1 mm",
      recorded(made,
               [&](JointModel& model) { model.board.edge_rise_mm[along_x ? 0 : 1] = sign * 0.1; }),
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
  // 95 % is required, less three standard deviations of a count.
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
    model.board.edge_rise_mm = {0.1, -0.05};
  });
  EXPECT_THAT(accepted(made, input).cause, HasSubstr("the plate is bowed"));
  AcceptanceOptions options;
  options.bow_sd_mm = {0.1, 0.1};
  const Acceptance permitted = accepted(made, input, options);
  EXPECT_TRUE(permitted.good()) << permitted.cause;
  // An error of twenty standard deviations is no longer uncertainty.
  const AcceptanceInput far = recorded(made, [](JointModel& model) {
    model.board.edge_rise_mm = {2, 0};
  });
  EXPECT_THAT(accepted(made, far, options).cause, HasSubstr("the plate is bowed"));
}

/// Nine positions side by side, 84 x 30 mm, with the plate never tilted.
void lay_parallel(JointModel& model) {
  for (std::size_t i = 0; i < model.placements.size(); ++i) {
    WorldFromTarget& pose = model.placements[i].world_from_target;
    pose.rotation = Eigen::Matrix3d::Identity();
    pose.translation_m = Eigen::Vector3d(42.0 * static_cast<double>(i % 3) - 42,
                                         15.0 * static_cast<double>(i / 3 % 3) - 15, 0) *
                         mm;
  }
}

TEST(Acceptance, RefusesParallelPositionsWithWhatIsMissing) {
  const Instrument made = instrument(7);
  AcceptanceOptions options;
  options.max_length_error_mm = 1;
  const Acceptance result = accepted(made, recorded(made, lay_parallel), options);
  EXPECT_FALSE(result.good());
  EXPECT_THAT(result.cause, AllOf(HasSubstr("test no volume"), HasSubstr("tilted by 20 degrees"),
                                  HasSubstr("another plate"), HasSubstr("along z")));
}

TEST(Acceptance, IsAnInterimCheckWithoutArtefactLimitAndVolume) {
  const Instrument made = instrument(7);
  const AcceptanceInput input = recorded(made, no_fault);
  const Acceptance interim = accepted(made, input);
  EXPECT_TRUE(interim.good()) << interim.cause;
  EXPECT_THAT(interim.lacks,
              testing::IsSupersetOf({HasSubstr("--target"), HasSubstr("[known_length]"),
                                     HasSubstr("--max-length-error-mm")}));
  AcceptanceOptions options;
  options.own_target = false;
  options.max_length_error_mm = 1;
  Target certified = target_of_tests();
  certified.known_lengths = {{{0, 0}, {8, 11}, 0.1 * std::hypot(2.2, 1.6), 2e-6}};
  const Acceptance whole = accept(input, made.calibration, made.rig, certified, options);
  EXPECT_TRUE(whole.good()) << whole.cause;
  EXPECT_THAT(whole.lacks, testing::IsEmpty());
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

TEST(Acceptance, OnePictureIsNeitherTwoSetsNorATestOfWhatItCalibrated) {
  const Instrument made = instrument(9);
  const AcceptanceInput input = recorded(made, no_fault);
  const auto refusal = [&](const AcceptanceInput& given) -> std::string {
    try {
      static_cast<void>(accepted(made, given));
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(input), "");
  AcceptanceInput twice = input;
  const FrameDetections copied =
      *std::find_if(input.target.frames.begin(), input.target.frames.end(),
                    [](const FrameDetections& frame) { return frame.set == "rest_0"; });
  for (FrameDetections& frame : twice.target.frames)
    if (frame.set == "rest_1" && frame.camera == copied.camera)
      frame.detections = copied.detections;
  EXPECT_THAT(refusal(twice), HasSubstr("also the one of set rest_0"));
  AcceptanceInput own = input;
  own.calibrated = {input.target, "old.json", ""};
  own.file = "new.json";
  for (FrameDetections& frame : own.calibrated.detections->frames) frame.set = "pose_of_old";
  // A set not used by the calibration.
  EXPECT_EQ(refusal(own), "");
  own.calibrated.detections->frames.front().set = made.calibration.sets.front();
  EXPECT_THAT(refusal(own),
              AllOf(HasSubstr("set " + made.calibration.sets.front() + ", "),
                    HasSubstr("in old.json"), HasSubstr("new.json"), HasSubstr("camera `cam0`")));
  // The same file, detected with other options.
  for (FrameDetections& frame : own.calibrated.detections->frames)
    for (Detection& d : frame.detections) d.centre_px.x() += 1e-6;
  EXPECT_EQ(refusal(own), "");
  own.calibrated.detections->frames.front().image_sha256 = own.target.frames.back().image_sha256 =
      "the same picture";
  EXPECT_THAT(refusal(own), HasSubstr("in old.json"));
}

TEST(Acceptance, RepeatsThatAreNotThereAreAWrongCall) {
  const Instrument made = instrument(9);
  AcceptanceInput input = recorded(made, no_fault);
  for (const auto& [named, said] : {std::pair("rst_3", "names rst_3, which is not among"),
                                    std::pair("rest_1", "names rest_1 twice")}) {
    input.repeats = {"rest_0", "rest_1", named};
    try {
      static_cast<void>(accepted(made, input));
      ADD_FAILURE() << named << " was taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
      EXPECT_THAT(error.what(), HasSubstr(said));
    }
  }
}

TEST(Acceptance, SetsThatMayHaveCalibratedAreNoTest) {
  const Instrument made = instrument(9);
  AcceptanceInput input = recorded(made, no_fault);
  input.calibrated = {{}, "", "td.json is not there"};
  const Acceptance result = accepted(made, input);
  EXPECT_FALSE(result.good());
  EXPECT_THAT(result.cause,
              AllOf(HasSubstr(made.calibration.sets.front()), HasSubstr("td.json is not there")));
  for (FrameDetections& frame : input.target.frames) frame.set += "_later";
  for (std::string& set : input.repeats) set += "_later";
  const Acceptance others = accepted(made, input);
  EXPECT_TRUE(others.good()) << others.cause;
  EXPECT_THAT(others.warnings, ElementsAre(HasSubstr("td.json is not there")));
}

TEST(Acceptance, WhatRestsOnANoGoIsNoGo) {
  Instrument made = instrument(9);
  AcceptanceInput input = recorded(made, no_fault);
  input.target.no_go = {{"rest_1", "no mark in the picture of cam1"}};
  EXPECT_THAT(accepted(made, input).cause, HasSubstr("detection of set rest_1 is NO-GO"));
  input.target.no_go.clear();
  made.calibration.no_go = "stage z030";
  EXPECT_THAT(accepted(made, input).cause, HasSubstr("the calibration is NO-GO: stage z030"));
}

TEST(Acceptance, AnotherPlateBringsItsOwnScale) {
  const Instrument made = instrument(10);
  const AcceptanceInput input = recorded(made, [](JointModel& model) {
    for (Placement& placement : model.placements) placement.world_from_target.rotation *= 1.0002;
  });
  Target other = target_of_tests();
  other.known_lengths = {{{0, 0}, {8, 11}, 0.272, 0.272 * 0.0002}};
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
  input.repeats.clear();
  const Acceptance result = accepted(made, input);
  EXPECT_FALSE(result.good());
  EXPECT_THAT(result.figures[0].not_measured, HasSubstr("2 positions"));
}

TEST(Acceptance, SetsOfOnePlaceAreOnePosition) {
  const Instrument made = instrument(3);
  // The simulated bench has two stages, eight poses and five exposures of one of them.
  const Acceptance whole = accepted(made, recorded(made, no_fault));
  EXPECT_TRUE(whole.good()) << whole.cause;
  const auto places = static_cast<int>(made.rig.stages.size()) + 8;
  EXPECT_EQ(whole.positions, places);
  // Moved by a millimetre each, as for a plate that was lifted and put back.
  for (const double moved_mm : {0.0, 1.0}) {
    AcceptanceInput resting = recorded(made, [&](JointModel& model) {
      Placement at = model.placements[3];
      model.placements.clear();
      for (int i = 0; i < 8; ++i, at.world_from_target.translation_m.x() += moved_mm * mm) {
        at.set = "rest_" + std::to_string(i);
        model.placements.push_back(at);
      }
    });
    const Acceptance result = accepted(made, resting);
    EXPECT_FALSE(result.good());
    EXPECT_EQ(result.positions, 1);
    EXPECT_THAT(result.figures[0].not_measured, HasSubstr("8 sets, but those of one place"));
  }
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
