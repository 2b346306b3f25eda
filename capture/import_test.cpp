// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "capture/capture.hpp"
#include "capture/test_images.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::capture {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

class Import : public testing::Test {
 protected:
  void SetUp() override { test::write_sets(in(), {"set2", "set10"}, {"cam0", "cam1"}); }

  [[nodiscard]] fs::path in() const { return temporary_.path() / "in"; }
  [[nodiscard]] fs::path out() const { return temporary_.path() / "out"; }

  std::string refusal(const fs::path& from, const fs::path& to) {
    return test::error_of([&] { return import_folder(from, to, {}); }).what();
  }

  void truncate(const fs::path& file) { fs::resize_file(file, fs::file_size(file) / 2); }

 private:
  test::TemporaryFolder temporary_;
};

TEST_F(Import, CopiesByteForByteAndListsEveryImage) {
  const ImportResult result = import_folder(in(), out(), {});
  EXPECT_FALSE(result.report.in_place);
  EXPECT_EQ(result.report.images, 4U);
  EXPECT_THAT(result.report.cameras, ElementsAre("cam0", "cam1"));

  const Recording recording = read_recording(out());
  EXPECT_EQ(recording.source, "import");
  EXPECT_EQ(recording.recorded_on, std::nullopt);
  static_cast<void>(import_folder(in(), out(), {.recorded_on = "2026-01-31"}));
  EXPECT_EQ(read_recording(out()).recorded_on, "2026-01-31");
  static_cast<void>(import_folder(in(), out(), {}));
  EXPECT_EQ(read_recording(out()).recorded_on, "2026-01-31") << "a stated day is kept";
  for (const std::string wrong : {"31.01.2026", "2026-02-30", "2026-1-31", "2026-01-31x", ""})
    EXPECT_THROW(static_cast<void>(import_folder(in(), out(), {.recorded_on = wrong})), Error);
  ASSERT_EQ(recording.sets.size(), 2U);
  EXPECT_EQ(recording.sets[0].name, "set2");
  for (const FrameSet& set : recording.sets) {
    for (const RecordedFrame& frame : set.frames) {
      EXPECT_EQ(frame.width_px, 64);
      EXPECT_EQ(frame.height_px, 48);
      EXPECT_EQ(frame.device_time_s, std::nullopt);
      EXPECT_EQ(read_bytes(out() / frame.file), read_bytes(in() / frame.file));
      EXPECT_EQ(read_frame(recording, set, frame), read_bytes(in() / frame.file));
    }
  }
}

TEST_F(Import, InPlaceWritesOnlyTheManifest) {
  const auto before = read_bytes(in() / "set2/cam0.png");
  const auto time = fs::last_write_time(in() / "set2/cam0.png");
  EXPECT_TRUE(import_folder(in(), in() / ".", {}).report.in_place);
  EXPECT_EQ(read_bytes(in() / "set2/cam0.png"), before);
  EXPECT_EQ(fs::last_write_time(in() / "set2/cam0.png"), time);
  EXPECT_TRUE(fs::exists(in() / "recording.json"));
}

TEST_F(Import, KeepsWhatWasNotedOfTheSamePictures) {
  Recording taken = import_folder(in(), in(), {}).recording;
  taken.source = "aravis";
  taken.sets[0].no_go = "the cloth moved by 0.30 px";
  taken.sets[0].motion_px = 0.3;
  taken.sets[0].frames[1].device_time_s = 12.5;
  write_recording(taken);
  test::write_bytes(in() / "set11/cam0.png", test::image_bytes(".png", 50));
  test::write_bytes(in() / "set11/cam1.png", test::image_bytes(".png", 51));
  for (const fs::path& to : {in(), out(), out()}) {
    const ImportResult result = import_folder(in(), to, {});
    const Recording found = read_recording(to);
    ASSERT_EQ(found.sets.size(), 3U);
    EXPECT_EQ(found.source, to == in() ? "aravis" : "import");
    EXPECT_EQ(found.sets[0].no_go, "the cloth moved by 0.30 px");
    EXPECT_EQ(found.sets[0].motion_px, 0.3);
    EXPECT_EQ(found.sets[0].frames[1].device_time_s, 12.5);
    EXPECT_EQ(found.sets[1].no_go, std::nullopt);
    EXPECT_THAT(result.report.warnings, testing::Contains(HasSubstr("NO-GO as when it was taken")));
  }
  EXPECT_THAT(verify_recording(out(), {}).no_go, ElementsAre("set2: the cloth moved by 0.30 px"));
}

/// Holds whatever is done to the folder between the two imports.
TEST_F(Import, ANoGoSetStaysNoGoUnderAnotherNameAndWithOnePictureMore) {
  Recording taken = import_folder(in(), in(), {}).recording;
  taken.sets[0].no_go = "the cloth moved by 0.30 px";
  taken.sets[0].frames[1].device_time_s = 12.5;
  write_recording(taken);
  const auto imported = [&](const fs::path& to) {
    return import_folder(in(), to, {.allow_missing = true}).recording;
  };
  test::write_bytes(in() / "set2/cam2.png", test::image_bytes(".png", 90));
  for (const fs::path& to : {in(), out()}) {
    const Recording more = imported(to);
    EXPECT_EQ(more.sets[0].no_go, "the cloth moved by 0.30 px");
    EXPECT_EQ(more.sets[0].frames[1].device_time_s, 12.5);
    EXPECT_EQ(more.sets[1].no_go, std::nullopt);
  }
  fs::rename(in() / "set2", in() / "set11");
  const Recording renamed = imported(out() / "renamed");
  EXPECT_EQ(renamed.sets[0].no_go, std::nullopt);
  ASSERT_EQ(renamed.sets[1].name, "set11");
  EXPECT_EQ(renamed.sets[1].no_go, "the cloth moved by 0.30 px");
}

/// capture.json is in the set's folder even where recording.json was abandoned.
TEST_F(Import, TheNotesOfACaptureKeepANoGo) {
  const auto notes = [](const std::string& set, const char* cloth, const char* more) {
    return fmt::format(
        R"({{"schema": "drapebench/capture/1", "set": "{}", {} "stillness": {{"cloth": {}, )"
        R"("motion_px": 0.993, "background_shift_px": null}}}})",
        set, more, cloth);
  };
  write_durable(in() / "set2/capture.json", notes("drape_A_001", "\"moved\"", ""));
  write_durable(in() / "set10/capture.json", notes("pose_01", "\"still\"", ""));
  // From here on each folder has only the notes.
  for (const auto& [from, to] : {std::pair{in(), out()}, std::pair{in(), in()},
                                 std::pair{out(), out()}, std::pair{out(), out() / "../next"}}) {
    fs::remove(from / "recording.json");
    const ImportResult result = import_folder(from, to, {});
    const Recording found = read_recording(to);
    EXPECT_EQ(found.sets[0].no_go, "the cloth moved by 0.99 px or more during the burst") << to;
    EXPECT_EQ(found.sets[0].motion_px, 0.993);
    EXPECT_EQ(found.sets[1].no_go, std::nullopt);
    EXPECT_TRUE(result.report.ignored.empty());
    EXPECT_THAT(result.report.warnings, testing::Contains(HasSubstr("NO-GO as when")));
    EXPECT_TRUE(verify_recording(to, {}).good());
  }
  // The sets before the one that moved belong to the same burst.
  write_durable(in() / "set10/capture.json", notes("drape_A_000", "null", ""));
  EXPECT_TRUE(import_folder(in(), out() / "burst", {}).recording.sets[1].no_go.has_value());
  write_durable(in() / "set2/capture.json",
                notes("drape_B", "null", "\"no_go\": \"the average is of 2 of 3 frames\","));
  const Recording average = import_folder(in(), out() / "average", {}).recording;
  EXPECT_EQ(average.sets[0].no_go, "the average is of 2 of 3 frames");
  EXPECT_EQ(average.sets[1].no_go, std::nullopt);
  write_durable(in() / "set10/capture.json", "{\"of\": \"another program\"}");
  EXPECT_EQ(import_folder(in(), out() / "foreign", {}).report.ignored.at(0).file,
            "set10/capture.json");
  write_durable(in() / "set10/capture.json", "{\"schema\": \"drapeb");
  EXPECT_THAT(refusal(in(), out() / "damaged"), HasSubstr("set10/capture.json"));
  EXPECT_FALSE(fs::exists(out() / "damaged"));
}

TEST_F(Import, ADamagedManifestIsRefusedBeforeAnythingIsWritten) {
  write_durable(in() / "recording.json", "{\"schema\": ");
  EXPECT_THAT(refusal(in(), out()), HasSubstr("recording.json"));
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(Import, GivesTheSameBytesAtAnyThreadCountAndAgain) {
  static_cast<void>(import_folder(in(), out(), {.threads = 1}));
  const std::string manifest = read_text(out() / "recording.json");
  static_cast<void>(import_folder(in(), out(), {.threads = 4}));
  EXPECT_EQ(read_text(out() / "recording.json"), manifest);
}

TEST_F(Import, RefusesATruncatedImageByNameAndWritesNothing) {
  truncate(in() / "set10/cam1.png");
  const std::string said = refusal(in(), out());
  EXPECT_THAT(said, HasSubstr("ends inside chunk"));
  EXPECT_THAT(said, HasSubstr("set10"));
  EXPECT_THAT(said, HasSubstr("cam1"));
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(Import, RefusesWhatIsNoSetOfImagesOfOneSize) {
  const auto refuses = [&](const std::string& file, const std::vector<unsigned char>& bytes,
                           const std::string& why) {
    const std::vector<unsigned char> before = read_bytes(in() / file);
    bytes.empty() ? fs::resize_file(in() / file, 0) : test::write_bytes(in() / file, bytes);
    EXPECT_THAT(refusal(in(), out()), HasSubstr(why));
    test::write_bytes(in() / file, before);
  };
  refuses("set2/cam0.png", {'n', 'o', 'n', 'e'}, "not a PNG, JPEG or TIFF image");
  refuses("set2/cam0.png", {}, "empty");
  refuses("set10/cam0.png", test::image_bytes(".png", 9, 65, 48), "65 x 48 px");
  fs::remove(in() / "set10/cam1.png");
  EXPECT_THAT(refusal(in(), out()), HasSubstr("set `set10` has no image of camera `cam1`"));
}

TEST_F(Import, RefusesToReplaceARecordedImage) {
  static_cast<void>(import_folder(in(), in(), {}));
  test::write_bytes(in() / "set2/cam1.png", test::image_bytes(".png", 77));
  EXPECT_THAT(refusal(in(), in()), HasSubstr("differs from the one in the existing recording"));
  fs::remove_all(in() / "set2");
  EXPECT_THAT(refusal(in(), in()), HasSubstr("not in the imported folder"));
}

TEST_F(Import, AddsSetsToARecording) {
  static_cast<void>(import_folder(in(), out(), {}));
  test::write_bytes(in() / "set11/cam0.png", test::image_bytes(".png", 50));
  test::write_bytes(in() / "set11/cam1.png", test::image_bytes(".png", 51));
  static_cast<void>(import_folder(in(), out(), {}));
  EXPECT_EQ(read_recording(out()).sets.size(), 3U);
}

TEST_F(Import, NeverOverwritesAForeignFile) {
  write_durable(out() / "set10/cam1.png", "somebody's file");
  EXPECT_THAT(refusal(in(), out()), HasSubstr("another file of this name"));
  EXPECT_EQ(read_text(out() / "set10/cam1.png"), "somebody's file");
  EXPECT_FALSE(fs::exists(out() / "set2"));
  EXPECT_FALSE(fs::exists(out() / "recording.json"));
}

TEST_F(Import, CompletesAnInterruptedImport) {
  // A killed import leaves some images, at most one partial file, and no manifest.
  fs::create_directories(out() / "set2");
  fs::copy_file(in() / "set2/cam0.png", out() / "set2/cam0.png");
  write_durable(out() / "set2/.cam1.png.partial", "half");
  static_cast<void>(import_folder(in(), out(), {}));
  EXPECT_TRUE(verify_recording(out(), {}).good());
}

TEST_F(Import, RefusesARecordingInsideTheImportedFolder) {
  EXPECT_THAT(refusal(in(), in() / "recording"), HasSubstr("inside the imported folder"));
}

TEST_F(Import, WritesNothingWhereItRefuses) {
  const auto exit_code = [&](const fs::path& folder) {
    return test::run_line(fmt::format("'{}' import '{}' --out '{}'",
                                      test::program("drape-capture").string(), folder.string(),
                                      out().string()))
        .exit_code;
  };
  EXPECT_EQ(exit_code(in() / "set2"), 3) << "a folder without sets";
  EXPECT_FALSE(fs::exists(out()));
  fs::create_directories(in() / "empty");
  EXPECT_EQ(exit_code(in()), 3);
  EXPECT_FALSE(fs::exists(out()));
}

/// `drape calib images` passes on the photographs of a folder this way.
TEST_F(Import, OfLinksNamesThePicturesThatTheyLeadTo) {
  const fs::path staged = in().parent_path() / "staged";
  for (const char* set : {"view_1", "view_2"}) {
    fs::create_directories(staged / set);
    const std::string from = set == std::string("view_1") ? "set2/cam0.png" : "set10/cam0.png";
    fs::create_symlink(fs::canonical(in() / from), staged / set / "left.png");
  }
  const std::string first = fs::canonical(in() / "set2/cam0.png").string();
  const std::string second = fs::canonical(in() / "set10/cam0.png").string();
  fs::copy_file(first, second, fs::copy_options::overwrite_existing);
  EXPECT_THAT(import_folder(staged, out(), {}).report.warnings,
              ElementsAre(HasSubstr(first + " and " + second + " are the same image")));
  truncate(second);
  EXPECT_THAT(refusal(staged, out()), HasSubstr("where: " + second + ", camera `left`"));
}

TEST_F(Import, RefusesALinkToNoFile) {
  fs::remove(in() / "set2/cam1.png");
  fs::create_symlink("elsewhere.png", in() / "set2/cam1.png");
  fs::remove(in() / "set10/cam1.png");
  EXPECT_THAT(refusal(in(), out()), HasSubstr("leads to elsewhere.png, which is not there"));
}

TEST_F(Import, WarnsOfTheSameImageTwice) {
  fs::copy_file(in() / "set2/cam0.png", in() / "set10/cam0.png",
                fs::copy_options::overwrite_existing);
  EXPECT_THAT(import_folder(in(), out(), {}).report.warnings,
              ElementsAre(HasSubstr("set2/cam0.png and set10/cam0.png are the same image")));
}

TEST_F(Import, TellsItsProgressUpToTheEnd) {
  std::vector<double> fractions;
  static_cast<void>(import_folder(
      in(), out(), {.threads = 2, .progress = [&](double fraction, const std::string&) {
                      fractions.push_back(fraction);
                    }}));
  EXPECT_THAT(fractions, ElementsAre(0.25, 0.5, 0.75, 1.0));
}

TEST_F(Import, RefusesNoThreads) {
  EXPECT_THROW(static_cast<void>(import_folder(in(), out(), {.threads = 0})), Error);
}

/// "set: camera camera" of each set of a recording.
std::vector<std::string> sets_of(const Recording& recording) {
  std::vector<std::string> all;
  for (const FrameSet& set : recording.sets) {
    all.push_back(set.name + ":");
    for (const RecordedFrame& frame : set.frames) all.back() += " " + frame.camera;
  }
  return all;
}

TEST_F(Import, ProposesTheLayoutThatItFoundAndTakesIt) {
  const std::vector<std::string> sets = {"drape_A", "pose_00", "pose_01", "pose_02", "stage_000"};
  const fs::path bench = in().parent_path() / "bench", cameras = in().parent_path() / "cameras",
                 flat = in().parent_path() / "flat";
  test::write_sets(bench, sets, {"cam0", "cam1"});
  for (const std::string& set : sets)
    for (const std::string camera : {"cam0", "cam1"}) {
      fs::create_directories(cameras / camera);
      fs::create_directories(flat);
      fs::copy(bench / set / (camera + ".png"), cameras / camera / (set + ".png"));
      fs::copy(bench / set / (camera + ".png"), flat / (set + "_" + camera + ".png"));
    }
  const ImportResult as_sets = import_folder(cameras, out() / "sets", {});
  EXPECT_THAT(sets_of(as_sets.recording),
              ElementsAre("cam0: drape_A pose_00 pose_01 pose_02 stage_000",
                          "cam1: drape_A pose_00 pose_01 pose_02 stage_000"));
  EXPECT_THAT(as_sets.report.advice, ElementsAre(HasSubstr("--layout cameras")));
  EXPECT_THAT(import_folder(bench, out() / "bench", {}).report.advice, testing::IsEmpty());
  EXPECT_THAT(refusal(flat, out() / "x"),
              HasSubstr("5 sets (drape_A to stage_000) of the cameras cam0, cam1: add `--layout "
                        "names`"));
  EXPECT_FALSE(fs::exists(out() / "x"));
  for (const auto& [from, layout] :
       {std::pair(cameras, PictureLayout::cameras), std::pair(flat, PictureLayout::names)}) {
    const fs::path to = out() / name_of(layout);
    const ImportResult result = import_folder(from, to, {.layout = layout});
    EXPECT_THAT(sets_of(result.recording),
                ElementsAre("drape_A: cam0 cam1", "pose_00: cam0 cam1", "pose_01: cam0 cam1",
                            "pose_02: cam0 cam1", "stage_000: cam0 cam1"));
    EXPECT_THAT(result.report.advice, testing::IsEmpty());
    EXPECT_EQ(read_bytes(to / "drape_A/cam1.png"), read_bytes(bench / "drape_A/cam1.png"));
    EXPECT_THROW(static_cast<void>(import_folder(from, from, {.layout = layout})), Error);
  }
  fs::rename(flat / "pose_01_cam1.png", flat / "pose_x1_cam7.png");
  EXPECT_THAT(refusal(flat, out() / "x"), testing::Not(HasSubstr("--layout")));
}

TEST_F(Import, NumbersTheViewsOfASeries) {
  const fs::path flat = in().parent_path() / "flat";
  fs::create_directories(flat);
  for (const std::string name : {"left01", "right01", "left02", "right02", "left10", "right10"})
    fs::copy(in() / "set2/cam0.png", flat / (name + ".png"));
  const auto views =
      ElementsAre("view_01: left right", "view_02: left right", "view_10: left right");
  EXPECT_THAT(refusal(flat, out()),
              HasSubstr("3 sets (view_01 to view_10) of the cameras left, right"));
  EXPECT_THAT(
      sets_of(import_folder(flat, out() / "flat", {.layout = PictureLayout::names}).recording),
      views);
  const fs::path folders = in().parent_path() / "folders";
  for (const std::string camera : {"left", "right"}) {
    fs::create_directories(folders / camera);
    for (const std::string number : {"01", "02", "10"})
      fs::copy(flat / (camera + number + ".png"), folders / camera / (camera + number + ".png"));
  }
  EXPECT_THAT(refusal(folders, out()), HasSubstr("add `--layout cameras`"));
  EXPECT_THAT(
      sets_of(
          import_folder(folders, out() / "folders", {.layout = PictureLayout::cameras}).recording),
      views);
}

}  // namespace
}  // namespace drape::capture
