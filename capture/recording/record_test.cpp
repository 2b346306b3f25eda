// SPDX-License-Identifier: Apache-2.0
// Storing the sets of a capture, from frames that need no camera.
#include "capture/recording/record.hpp"

#include <gmock/gmock.h>

#include <random>

#include "capture/capture.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/paths.hpp"

namespace drape::capture {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
namespace fs = std::filesystem;

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
