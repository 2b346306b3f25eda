// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <cmath>
#include <csignal>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "capture/capture.hpp"
#include "capture/recording/record.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"

namespace drape::capture {
namespace {

namespace fs = std::filesystem;

/// Stores sets endlessly and writes a byte to `acknowledged` after each.
[[noreturn]] void store_for_ever(const fs::path& folder, int acknowledged) {
  Journal journal(folder, "2026-01-31");
  for (std::size_t k = journal.recording().sets.size();; ++k) {
    const std::string name = "set_" + std::to_string(k), content(20'000 + 7 * k, 'x');
    Journal::write(journal.begin(name) / "cam0.png", content);
    FrameSet set{name, {}};
    set.frames.push_back({"cam0", name + "/cam0.png", sha256_of(content), 4, 3, std::nullopt});
    journal.add(std::move(set));
    if (::write(acknowledged, "s", 1) != 1) ::_exit(1);
  }
}

std::size_t bytes_in(int descriptor) {
  char buffer[256];
  std::size_t sum = 0;
  for (ssize_t got = 1; got > 0; sum += static_cast<std::size_t>(std::max<ssize_t>(got, 0)))
    got = ::read(descriptor, buffer, sizeof buffer);
  return sum;
}

TEST(Journal, AKilledCaptureLosesTheSetInHandAtMost) {
  test::TemporaryFolder temporary;
  const fs::path folder = temporary.path() / "recording";
  std::mt19937 random(1);
  std::size_t acknowledged = 0, kept = 0;
  const int kills = test::trial_count(30, 200);
  for (int k = 0; k < kills; ++k) {
    int pipe[2];
    ASSERT_EQ(::pipe2(pipe, O_CLOEXEC), 0);
    const pid_t child = ::fork();
    if (child == 0) store_for_ever(folder, pipe[1]);
    ::close(pipe[1]);
    // Two times in three after a set or two, whatever they take; else perhaps before the first.
    for (auto sets = random() % 3; sets > 0; --sets) {
      char byte = 0;
      ASSERT_EQ(::read(pipe[0], &byte, 1), 1);
      ++acknowledged;
    }
    ::usleep(static_cast<unsigned>(random() % 20'000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    acknowledged += bytes_in(pipe[0]);
    ::close(pipe[0]);
    Journal journal(folder, "2026-01-31");
    const std::size_t now = journal.recording().sets.size();
    ASSERT_GE(now, acknowledged);
    ASSERT_LE(now, kept + journal.adopted());
    for (std::size_t s = kept; s < now; ++s) {
      const FrameSet& set = journal.recording().sets[s];
      EXPECT_NO_THROW(static_cast<void>(read_frame(journal.recording(), set, set.frames[0])));
    }
    // Sets written completely but not acknowledged count from now on.
    kept = acknowledged = now;
  }
  EXPECT_GT(kept, 0U);
  std::printf("%d kills: %zu sets, none that was acknowledged lost\n", kills, kept);
  for (const auto& entry : fs::directory_iterator(folder))
    EXPECT_FALSE(entry.path().filename().string().starts_with(".")) << entry.path();
}

TEST(Journal, ASecondWriterIsRefusedInOneSentence) {
  test::TemporaryFolder temporary;
  const fs::path folder = temporary.path() / "recording";
  Journal first(folder, "2026-01-31");
  const Error error = test::error_of([&] { return Journal(folder, "2026-01-31"); });
  EXPECT_EQ(error.kind(), ErrorKind::bad_input);
  EXPECT_THAT(error.what(), testing::HasSubstr("another capture records into this folder"));
}

TEST(Journal, ACaptureThatStoredNothingLeavesNoFolder) {
  test::TemporaryFolder temporary;
  const fs::path folder = temporary.path() / "recording";
  { const Journal journal(folder, "2026-01-31"); }
  EXPECT_FALSE(fs::exists(folder));
}

TEST(Journal, ADamagedJournalIsNamed) {
  test::TemporaryFolder temporary;
  const fs::path folder = temporary.path() / "recording";
  write_durable(folder / "recording.journal",
                "{\"set\": {\"name\": \"../../etc\", \"frames\": []}}\n");
  EXPECT_THROW(Journal(folder, "2026-01-31"), Error);
  write_durable(folder / "recording.journal",
                "{\"set\": {\"name\": \"a\", \"frames\": [[1, 2]]}}\n");
  EXPECT_THROW(Journal(folder, "2026-01-31"), Error);
  for (const char* width : {"4294967300", "-1", "4.5"}) {
    write_durable(folder / "recording.journal",
                  std::string(R"({"set": {"name": "a", "frames": [{"camera": "cam0", )"
                              R"("file": "a/cam0.png", "sha256": "aa", "height_px": 3, )"
                              R"("width_px": )") +
                      width + "}]}}\n");
    EXPECT_THROW(Journal(folder, "2026-01-31"), Error) << width;
  }
  write_durable(folder / "recording.journal", "{\"set\": {\"name\": \"a\", \"fra");
  EXPECT_EQ(Journal(folder, "2026-01-31").adopted(), 0U);
}

GreyView view(const cv::Mat& image) {
  return {{image.data, image.total()}, image.cols, image.rows};
}

cv::Mat frame(const std::string& set, int camera) {
  return cv::imread(
      (test::source_root() / fmt::format("rigs/bench1/recording/{}/cam{}.png", set, camera))
          .string(),
      cv::IMREAD_UNCHANGED);
}

/// The picture with added Gaussian noise.
cv::Mat noisy(const cv::Mat& image, int seed, double noise_grey) {
  cv::Mat result, noise(image.size(), CV_16S);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(noise, cv::RNG::NORMAL, 0, noise_grey);
  image.convertTo(result, CV_16S);
  result += noise;
  result.convertTo(result, CV_8U);
  return result;
}

/// The picture rotated and shifted, with its own noise.
cv::Mat moved(const cv::Mat& image, double dx, double dy, double turn_rad = 0, int seed = 1,
              double noise_grey = 2) {
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  const double mid_x = 0.5 * image.cols, mid_y = 0.5 * image.rows;
  const cv::Mat map = (cv::Mat_<double>(2, 3) << c, -s, mid_x - c * mid_x + s * mid_y + dx, s, c,
                       mid_y - s * mid_x - c * mid_y + dy);
  cv::Mat result;
  cv::warpAffine(image, result, map, image.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  return noisy(result, seed, noise_grey);
}

MotionResult motion_between(const cv::Mat& first, const cv::Mat& second) {
  return BlockFollower(view(first), {}).motion_to(view(second));
}

/// The pattern of Aravis's fake camera: a ramp along the diagonal, from white back to black.
cv::Mat ramp(int at, double noise_grey, int seed) {
  cv::Mat image(512, 512, CV_8U);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(20 + (x + y + at) % 200);
  return noisy(image, seed, noise_grey);
}

StillReport look_at(const std::vector<cv::Mat>& images) {
  CamerasFile cameras;
  cameras.cameras.emplace_back().name = "cam0";
  LiveResult live;
  for (const cv::Mat& image : images) {
    PairedFrames& set = live.pairing.sets.emplace_back();
    set.frames = {live.frames.size()};
    live.frames.push_back(
        {{}, image.cols, image.rows, "", {image.data, image.data + image.total()}});
  }
  return look_still(live, cameras, {});
}

TEST(Motion, WhatMovesAcrossTheOnlyEdgesIsMovedAndWhatCannotBeJudgedIsNamed) {
  for (const double noise : {0.0, 1.0, 4.0}) {
    for (const int at : {1, 2, 3, 5, 40}) {
      const StillReport moving = look_at({ramp(0, noise, 1), ramp(at, noise, 2)});
      EXPECT_TRUE(moving.cloth_moved) << at << " of noise " << noise;
      EXPECT_LT(moving.motion_px.value_or(0), at / std::sqrt(2.0) + 0.1) << "the least it moved";
      EXPECT_TRUE(moving.not_judged().empty());
    }
    for (int seed = 2; seed < 12; ++seed) {
      const StillReport still = look_at({ramp(0, noise, 1), ramp(0, noise, seed)});
      EXPECT_FALSE(still.cloth_moved) << "noise " << noise;
      EXPECT_EQ(still.not_judged(), std::vector<std::string>{"cam0"}) << "it may move along them";
    }
  }
  const cv::Mat grey(512, 512, CV_8U, cv::Scalar(90));
  EXPECT_EQ(look_at({grey, grey}).not_judged(), std::vector<std::string>{"cam0"});
  EXPECT_TRUE(look_at({grey}).not_judged().empty()) << "one frame is no burst";
  const cv::Mat cloth = frame("drape_A", 0);
  EXPECT_TRUE(look_at({cloth, moved(cloth, 0, 0)}).not_judged().empty());
}

TEST(Motion, ABurstOfAStillClothIsStillAndOneThatMovesIsNot) {
  const cv::Mat first = frame("drape_A", 0);
  for (const double shift : {0.0, 0.1, 0.5, 1.5}) {
    const MotionResult motion = motion_between(first, moved(first, shift, 0));
    EXPECT_GT(motion.blocks.size(), 60U) << shift;
    EXPECT_LT(motion.lost, motion.textured / 10) << shift;
    EXPECT_NEAR(motion.largest_px(), shift, 0.03 + 0.03 * shift);
  }
}

TEST(Motion, ACornerOfTheClothThatMovesAloneIsSeen) {
  const cv::Mat first = frame("drape_A", 0);
  cv::Mat second = moved(first, 0, 0);
  const cv::Rect corner(640, 800, 200, 200);
  moved(first, 0.4, 0.3)(corner).copyTo(second(corner));
  EXPECT_NEAR(motion_between(first, second).largest_px(), 0.5, 0.06);
}

/// A corner that swings out of range covers less than a tenth of the blocks; noise is not motion.
TEST(Motion, ACornerThatSwingsFarIsSeenAndNoiseIsNot) {
  for (const char* set : {"drape_A", "drape_C"}) {
    for (const double noise : {0.0, 2.0, 4.0, 7.0}) {
      const cv::Mat first = moved(frame(set, 0), 0, 0, 0, 1, noise);
      const MotionResult still = motion_between(first, moved(frame(set, 0), 0, 0, 0, 2, noise));
      EXPECT_FALSE(still.is_lost()) << set << " " << noise << ": " << still.gone;
      EXPECT_LT(still.largest_px(), StillOptions{}.largest_motion_px) << set << " " << noise;
    }
  }
  const cv::Mat drape = frame("drape_A", 0);
  for (const double noise : {0.0, 2.0, 4.0})
    for (const double swing : {4.0, 30.0}) {
      cv::Mat second = drape.clone();
      const cv::Rect corner(640, 800, 100, 100);
      moved(drape, swing, 0.5 * swing, 0, 2, 0)(corner).copyTo(second(corner));
      const MotionResult motion =
          motion_between(moved(drape, 0, 0, 0, 1, noise), moved(second, 0, 0, 0, 2, noise));
      EXPECT_TRUE(motion.is_lost()) << swing << " " << noise;
    }
}

/// A picture of a scene with read-out noise and photon noise, whose variance is proportional to the
/// grey level.
cv::Mat taken(const cv::Mat& scene, int seed, double read_grey, double variance_per_grey) {
  cv::Mat grey, sd, noise(scene.size(), CV_32F), result;
  scene.convertTo(grey, CV_32F);
  cv::sqrt(grey * variance_per_grey + read_grey * read_grey, sd);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(noise, cv::RNG::NORMAL, 0, 1);
  cv::Mat(grey + noise.mul(sd)).convertTo(result, CV_8U);
  return result;
}

/// Waves of `period_px` along both axes.
cv::Mat waves(cv::Size size, double mean_grey, double amplitude_grey, double period_px) {
  cv::Mat scene(size, CV_32F);
  const double turn = 2 * CV_PI / period_px;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      scene.at<float>(y, x) = static_cast<float>(
          mean_grey + amplitude_grey * (std::sin(turn * x) + std::sin(turn * y)));
  return scene;
}

/// A few bright blocks of faint weave on a dark bench: their noise differs from that of the others.
TEST(Motion, NoiseThatGrowsWithTheLightIsNoMotion) {
  cv::Mat scene(480, 640, CV_32F), cells(80, 107, CV_8U);
  cv::RNG random(5);
  random.fill(cells, cv::RNG::UNIFORM, 0, 2);
  for (int y = 0; y < scene.rows; ++y)
    for (int x = 0; x < scene.cols; ++x)
      scene.at<float>(y, x) = cells.at<std::uint8_t>(y / 6, x / 6) != 0 ? 35.0F : 15.0F;
  waves({98, 98}, 200, 4.5, 8).copyTo(scene(cv::Rect(144, 144, 98, 98)));
  const cv::Mat first = taken(scene, 1, 0.7, 0.05);
  int lost = 0;
  for (int seed = 2; seed < 10; ++seed) {
    const MotionResult motion = motion_between(first, taken(scene, seed, 0.7, 0.05));
    EXPECT_FALSE(motion.is_lost()) << motion.gone;
    lost += motion.lost;
  }
  EXPECT_GT(lost, 0) << "or the weave is not faint";
  const cv::Mat drape = frame("drape_A", 0), still = taken(drape, 1, 0.7, 0.05);
  EXPECT_FALSE(motion_between(still, taken(drape, 2, 0.7, 0.05)).is_lost());
  cv::Mat swung = drape.clone();
  const cv::Rect corner(640, 800, 100, 100);
  moved(drape, 30, 15, 0, 2, 0)(corner).copyTo(swung(corner));
  EXPECT_TRUE(motion_between(still, taken(swung, 2, 0.7, 0.05)).is_lost());
}

/// A reference hidden by noise is refused itself, instead of every set compared with it.
TEST(Motion, AReferenceIsAcceptedOnlyWhereItIsFoundAgain) {
  int accepted = 0;
  for (const double amplitude_grey : {0.1, 0.5, 0.7, 0.8, 0.9, 1.0, 1.5, 3.0}) {
    const cv::Mat scene = waves({640, 480}, 120, amplitude_grey, 32);
    const cv::Mat empty = taken(scene, 1, 2, 0);
    const Background background(view(empty));
    if (!background.is_textured()) continue;
    ++accepted;
    for (int seed = 2; seed < 6; ++seed) {
      const cv::Mat now = taken(scene, seed, 2, 0);
      EXPECT_TRUE(background.shift_px(view(now))) << amplitude_grey;
    }
  }
  EXPECT_EQ(accepted, 2) << "amplitudes of 1.5 and 3";
}

TEST(Motion, ACameraThatMovedIsSeenByTheTableBehindTheCloth) {
  for (int camera = 0; camera < 3; ++camera) {
    const Background empty(view(frame("empty", camera)));
    const cv::Mat drape = frame("drape_A", camera);
    const auto still = empty.shift_px(view(drape));
    ASSERT_TRUE(still);
    EXPECT_LT(*still, StillOptions{}.largest_shift_px) << camera;
    const auto shifted = empty.shift_px(view(moved(drape, 0.9, -1.2)));
    ASSERT_TRUE(shifted);
    EXPECT_NEAR(*shifted, 1.5, 0.25) << camera;
    // A rotation by 2 mrad about the axis: 1 px at half the distance to the corners.
    const auto turned = empty.shift_px(view(moved(drape, 0, 0, 2e-3)));
    ASSERT_TRUE(turned);
    EXPECT_GT(*turned, StillOptions{}.largest_shift_px) << camera;
    std::printf("cam%d: background shift %.3f px; shifted by 1.5 px: %.3f; turned: %.3f\n", camera,
                *still, *shifted, *turned);
  }
}

/// A camera knocked by any distance must not pass: it is found near the truth or not at all.
TEST(Motion, ACameraKnockedByAnyDistanceIsNeverInItsPlace) {
  const Background empty(view(frame("empty", 0)));
  const cv::Mat drape = frame("drape_A", 0);
  for (const double shift : {1.0, 3.0, 10.0, 13.0, 16.0, 24.0, 40.0, 100.0, 400.0}) {
    for (const auto& [dx, dy] : {std::pair{shift, 0.0}, {0.0, -shift}}) {
      const auto found = empty.shift_px(view(moved(drape, dx, dy)));
      if (found) {
        EXPECT_NEAR(*found, shift, StillOptions{}.largest_shift_px);
      }
      EXPECT_EQ(found.has_value(), shift < empty.reach_px()) << shift;
    }
  }
  EXPECT_FALSE(empty.shift_px(view(frame("drape_A", 1)))) << "another camera's picture";
}

/// Cloths and targets cover up to three quarters of bench1's pictures; here up to nine tenths.
TEST(Motion, WhatIsLeftOfTheTableTellsThatTheCameraIsInPlace) {
  for (int camera = 0; camera < 3; ++camera) {
    const Background empty(view(frame("empty", camera)));
    const double limit_px = StillOptions{}.largest_shift_px;
    for (const char* set : {"empty", "drape_C", "drape_E", "pose_00", "pose_05", "stage_z090"})
      EXPECT_LT(empty.shift_px(view(frame(set, camera))).value_or(99), limit_px)
          << set << " " << camera;
    cv::Mat covered = frame("empty", camera).clone();
    cv::RNG random(7);
    cv::Mat cloth = covered(cv::Rect(160, 0, covered.cols - 160, covered.rows));
    random.fill(cloth, cv::RNG::UNIFORM, 60, 200);
    EXPECT_LT(empty.shift_px(view(covered)).value_or(99), limit_px) << camera;
    EXPECT_GT(empty.shift_px(view(moved(covered, 2, 0))).value_or(99), limit_px) << camera;
  }
}

TEST(Motion, ASmallPictureIsFollowedInSmallerBlocks) {
  for (const int width : {800, 640, 320}) {
    cv::Mat empty;
    cv::resize(frame("empty", 1), empty, {width, width * 3 / 4}, 0, 0, cv::INTER_AREA);
    const Background background(view(empty));
    ASSERT_TRUE(background.is_textured());
    const double limit_px = StillOptions{}.largest_shift_px;
    EXPECT_LT(background.shift_px(view(moved(empty, 0, 0))).value(), limit_px);
    EXPECT_NEAR(background.shift_px(view(moved(empty, 1.5, 0))).value(), 1.5, limit_px);
    for (const int far : {16, 24, 40, 100})
      EXPECT_FALSE(background.shift_px(view(moved(empty, far, 0)))) << far;
  }
}

TEST(Motion, ABackgroundWithoutTextureTellsNothing) {
  const cv::Mat flat(480, 640, CV_8U, cv::Scalar(90));
  EXPECT_FALSE(Background(view(flat)).is_textured());
  EXPECT_FALSE(Background(view(flat)).shift_px(view(flat)));
  const cv::Mat other(240, 320, CV_8U, cv::Scalar(90));
  EXPECT_THROW(static_cast<void>(motion_between(flat, other)), Error);
  EXPECT_FALSE(Background(view(frame("empty", 0))).shift_px(view(flat))) << "of another size";
}

// ----
// Storing the sets of a capture, from frames that need no camera.

using testing::ElementsAre;
using testing::HasSubstr;

constexpr int kBoardWidth_px = 320, kBoardHeight_px = 240;

/// Two cameras whose frames show a board of bright and dark fields.
class Record : public testing::Test {
 protected:
  Record() {
    for (const char* name : {"cam0", "cam1"}) {
      LiveCamera camera{name, {}, {}};
      camera.settings.width_px = kBoardWidth_px;
      camera.settings.height_px = kBoardHeight_px;
      cameras_.cameras.push_back(camera);
      report_.cameras.push_back({});
      report_.cameras.back().name = name;
    }
    options_.folder = temporary_.path() / "recording";
    options_.largest_spread_s = 0.01;
    options_.recorded_on = "2026-01-31";
    options_.format = FrameFormat::pgm;
  }

  /// A set with the cloth shifted by `shift_px` to the right.
  [[nodiscard]] static LiveSet set_of(int shift_px = 0) {
    LiveSet set{1e-3, {}, {}, {}};
    for (std::size_t c = 0; c < 2; ++c) {
      std::mt19937 random(static_cast<unsigned>(c));
      LiveFrame frame{{}, kBoardWidth_px, kBoardHeight_px, "", {}};
      for (int y = 0; y < kBoardHeight_px; ++y)
        for (int x = 0; x < kBoardWidth_px; ++x)
          frame.pixels.push_back(static_cast<std::uint8_t>(
              (((x + kBoardWidth_px - shift_px) / 16 + y / 16) % 2 != 0 ? 200 : 20) +
              random() % 8));
      set.frames.push_back(std::move(frame));
    }
    return set;
  }

  [[nodiscard]] Journal open() const { return Journal(options_.folder, options_.recorded_on); }

  /// Adds sets with shifted cloth, without publishing them.
  RecordResult add(Journal& journal, const std::vector<int>& shifts_px, bool finishes = true) {
    Recorder recorder(cameras_, options_, journal);
    for (const int shift_px : shifts_px) recorder.add(set_of(shift_px), report_);
    return finishes ? recorder.finish() : RecordResult{};
  }

  void store(const std::string& set) {
    options_.set = set;
    options_.frames = 1;
    Journal journal = open();
    ASSERT_EQ(add(journal, {0}).sets.size(), 1U);
    journal.publish();
  }

  [[nodiscard]] std::vector<std::string> stored() const {
    std::vector<std::string> names;
    for (const FrameSet& set : read_recording(options_.folder).sets) names.push_back(set.name);
    return names;
  }

  test::TemporaryFolder temporary_;
  CamerasFile cameras_;
  LiveReport report_;
  RecordOptions options_;
};

TEST_F(Record, NoNameOfASetMakesTheRecordingUnreadable) {
  store("good");
  for (const std::string& name :
       {std::string("-5"), std::string("-a"), std::string(".a"), std::string(), std::string("a/b"),
        std::string("a,b"), std::string("recording.json"), std::string("recording.journal"),
        std::string("recording.run.json"), std::string("good.new"), std::string(186, 'x')}) {
    options_.set = name;
    Journal journal = open();
    const Error error = test::error_of([&] { return Recorder(cameras_, options_, journal); });
    EXPECT_EQ(error.kind(), ErrorKind::usage) << name;
  }
  store("recording");
  store("a.b-c d");
  store(std::string(185, 'x'));
  EXPECT_EQ(read_recording(options_.folder).sets.size(), 4U);
  EXPECT_TRUE(verify_recording(options_.folder, {}).good());
}

/// The longest name is followed by the number of a frame or of a take.
TEST_F(Record, TheLongestNameHasRoomForABurstAndARetake) {
  const std::string longest(185, 'x');
  options_.frames = 1000;
  options_.set = longest;
  {
    Journal journal = open();
    static_cast<void>(add(journal, {0}));
    journal.publish();
  }
  options_.frames = 1;
  store(longest);
  options_.retake = true;
  {
    Journal journal = open();
    EXPECT_THAT(add(journal, {0}).sets, ElementsAre(longest + ".new"));
    journal.replace(longest);
    journal.publish();
  }
  EXPECT_THAT(stored(), ElementsAre(longest + "_000", longest + ".take1", longest));
  EXPECT_TRUE(verify_recording(options_.folder, {}).good());
}

TEST_F(Record, AKilledBurstOfMovingClothIsNoGoFromItsFirstSet) {
  options_.set = "k";
  options_.frames = 30;
  {
    Journal journal = open();
    add(journal, {0, 0, 0, 2}, false);
  }  // without finish() and publish(), as after SIGKILL
  store("z");
  const Recording recording = read_recording(options_.folder);
  ASSERT_EQ(recording.sets.size(), 5U);
  for (std::size_t s = 0; s < 4; ++s) {
    EXPECT_THAT(recording.sets[s].no_go.value_or(""), HasSubstr("the cloth moved"));
    EXPECT_GT(recording.sets[s].motion_px.value_or(0), 1);
  }
  EXPECT_FALSE(recording.set("z").no_go);
}

/// To make room, someone removed a set that no manifest listed yet.
TEST_F(Record, SetsOfAKilledCaptureWhoseImagesAreGoneAreLeftOutAndNamed) {
  options_.set = "q";
  options_.frames = 4;
  {
    Journal journal = open();
    add(journal, {0, 0, 0, 0}, false);
  }  // as after SIGKILL
  const Error error = test::error_of([&] { return verify_recording(options_.folder, {}); });
  EXPECT_THAT(error.what(), HasSubstr("4 sets of a capture that goes on, or was ended"));
  fs::remove_all(options_.folder / "q_000");
  fs::remove(options_.folder / "q_002/cam1.pgm");
  {
    Journal journal = open();
    EXPECT_EQ(journal.adopted(), 3U);
    EXPECT_THAT(journal.gone(), ElementsAre("q_000"));
  }
  const VerifyReport report = verify_recording(options_.folder, {});
  EXPECT_EQ(report.sets, 3U);
  EXPECT_TRUE(report.in_journal.empty());
  ASSERT_EQ(report.faults.size(), 1U) << "one image of three sets is missing";
  EXPECT_EQ(report.faults[0].file, "q_002/cam1.pgm");
}

/// Killed after both folders are renamed, before the manifest is written.
TEST_F(Record, ARetakeThatWasNotPublishedIsAdoptedUnderItsName) {
  store("a");
  for (const bool replaced : {true, false}) {
    options_.retake = true;
    {
      Journal journal = open();
      static_cast<void>(add(journal, {replaced ? 1 : 2}));
      if (replaced) journal.replace("a");
      EXPECT_THAT(verify_recording(options_.folder, {}).in_journal, ElementsAre("a.new"));
    }
    const Journal journal = open();
    EXPECT_TRUE(journal.gone().empty());
    EXPECT_EQ(journal.adopted(), 1U);
    EXPECT_EQ(stored(), replaced ? (std::vector<std::string>{"a.take1", "a"})
                                 : (std::vector<std::string>{"a.take1", "a.take2", "a"}));
    EXPECT_TRUE(verify_recording(options_.folder, {}).good());
  }
}

/// The journal of a complete retake, cut off at any point, before or after a folder is renamed.
TEST_F(Record, ARetakeThatIsKilledAnywhereEndsUnderItsName) {
  store("a");
  options_.retake = true;
  const fs::path folder = options_.folder, journal_file = folder / "recording.journal";
  const fs::path before = temporary_.path() / "before", after = temporary_.path() / "after";
  const auto copy = [](const fs::path& from, const fs::path& to) {
    fs::remove_all(to);
    fs::copy(from, to, fs::copy_options::recursive);
  };
  std::size_t begin = 0;
  {
    Journal journal = open();
    static_cast<void>(add(journal, {0}));
    begin = read_text(journal_file).size();
    copy(folder, before);
    journal.replace("a");
    copy(folder, after);
  }
  const std::string lines = read_text(journal_file);
  for (std::size_t end = begin; end <= lines.size(); end += 4) {
    copy(before, folder);
    write_durable(journal_file, lines.substr(0, end));
    EXPECT_TRUE(open().gone().empty()) << end;
    EXPECT_THAT(stored(), ElementsAre("a.take1", "a")) << lines.substr(0, end);
    const VerifyReport report = verify_recording(folder, {});
    EXPECT_TRUE(report.good() && report.not_listed.empty()) << end;
  }
  // recording.json is written and the journal still exists.
  copy(after, folder);
  { const Journal journal = open(); }
  write_durable(journal_file, lines);
  EXPECT_THAT(verify_recording(folder, {}).in_journal, testing::IsEmpty());
  const Journal journal = open();
  EXPECT_THAT(journal.gone(), testing::IsEmpty());
  EXPECT_EQ(journal.adopted(), 0U);
  EXPECT_EQ(journal.recording().sets.size(), 2U);
  EXPECT_TRUE(verify_recording(folder, {}).good());
}

TEST_F(Record, AnUndoneRetakeGivesTheTakeBeforeItsNameAndKeepsTheRetake) {
  store("a");
  const std::string first = read_recording(options_.folder).set("a").frames.front().sha256;
  options_.retake = true;
  Journal journal = open();
  EXPECT_THROW(journal.restore("a"), Error) << "it was taken once only";
  static_cast<void>(add(journal, {7}));
  journal.replace("a");
  journal.publish();
  EXPECT_NE(read_recording(options_.folder).set("a").frames.front().sha256, first);
  journal.restore("a");
  journal.publish();
  EXPECT_THAT(stored(), testing::UnorderedElementsAre("a", "a.take2"));
  EXPECT_EQ(read_recording(options_.folder).set("a").frames.front().sha256, first);
  EXPECT_TRUE(verify_recording(options_.folder, {}).good());
  journal.restore("a");
  journal.publish();
  EXPECT_NE(read_recording(options_.folder).set("a").frames.front().sha256, first)
      << "undone twice";
}

/// Holds however a session ends afterwards.
TEST_F(Record, ASetThatIsPublishedLeavesNeitherAJournalNorTheRecordBefore) {
  store("a");
  const fs::path record = options_.folder / "recording.run.json";
  const fs::path ending = options_.folder / "recording.ending.json";
  write_durable(record, "{}");
  write_durable(ending, "GO\n");
  Journal journal = open();
  options_.set = "b";
  Recorder recorder(cameras_, options_, journal);
  journal.publish();
  EXPECT_TRUE(fs::exists(record) && fs::exists(ending)) << "the recording is as it was";
  EXPECT_FALSE(journal.changed());
  recorder.add(set_of(), report_);
  EXPECT_TRUE(fs::exists(options_.folder / "recording.journal"));
  journal.publish();
  EXPECT_TRUE(journal.changed());
  EXPECT_FALSE(fs::exists(record) || fs::exists(ending));
  EXPECT_FALSE(fs::exists(options_.folder / "recording.journal"));
  EXPECT_EQ(read_recording(options_.folder).sets.size(), 2U);
}

TEST_F(Record, AnAverageOfFewerFramesThanAskedIsNoGo) {
  options_.average = true;
  options_.frames = 5;
  for (const int came : {5, 4, 1}) {
    options_.set = "drape_" + std::to_string(came);
    Journal journal = open();
    const RecordResult result = add(journal, std::vector<int>(static_cast<std::size_t>(came)));
    journal.publish();
    EXPECT_EQ(result.averaged, static_cast<std::size_t>(came));
    EXPECT_EQ(result.short_average.has_value(), came < 5);
    const Recording recording = read_recording(options_.folder);
    EXPECT_EQ(recording.set(options_.set).no_go.value_or(""),
              came < 5 ? "the average is of " + std::to_string(came) + " of 5 frames" : "");
  }
}

TEST_F(Record, ARecordingOfOtherCamerasIsRefused) {
  store("a");
  const Recording recording = read_recording(options_.folder);
  const auto refusal = [](const Recording& of, const CamerasFile& rig) {
    try {
      require_cameras_of_rig(of, rig);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      EXPECT_EQ(error.where().camera, "cam1");
      return error.what_failed();
    }
    return std::string();
  };
  EXPECT_EQ(refusal(recording, cameras_), "");
  EXPECT_EQ(refusal({}, cameras_), "") << "nothing is recorded yet";
  CamerasFile other = cameras_;
  other.cameras.pop_back();
  EXPECT_THAT(refusal(recording, other), HasSubstr("a camera that the rig does not have"));
  Recording of_one = recording;
  of_one.sets[0].frames.pop_back();
  EXPECT_THAT(refusal(of_one, cameras_), HasSubstr("a camera that the recording does not have"));
  cameras_.cameras[1].settings.width_px = 640;
  EXPECT_THAT(refusal(recording, cameras_), HasSubstr("of 320 x 240 px, the rig says 640 x 240"));
  options_.set = "b";
  Journal journal = open();
  EXPECT_THROW(Recorder(cameras_, options_, journal), Error);
}

/// Its image would have a name of 204 bytes.
TEST_F(Record, ACameraOfTooLongANameStoresNothingThatNobodyCanRead) {
  cameras_.cameras[1].name = std::string(200, 'c');
  options_.set = "a";
  Journal journal = open();
  Recorder recorder(cameras_, options_, journal);
  EXPECT_THROW(recorder.add(set_of(), report_), Error);
  EXPECT_TRUE(journal.recording().sets.empty());
  EXPECT_FALSE(fs::exists(options_.folder / "recording.journal"));
}

}  // namespace
}  // namespace drape::capture
