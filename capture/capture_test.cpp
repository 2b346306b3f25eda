// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <algorithm>
#include <random>

#include "capture/capture.hpp"
#include "capture/test_images.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::capture {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Layout : public testing::Test {
 protected:
  void add(const std::string& file) { write_durable(folder() / file, "x"); }
  [[nodiscard]] std::filesystem::path folder() const { return temporary_.path(); }

  std::string refusal() {
    const Error error =
        test::error_of([&] { return require_same_cameras(folder(), read_layout(folder())); });
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }

 private:
  test::TemporaryFolder temporary_;
};

TEST_F(Layout, ListsSetsAndCamerasInNaturalOrder) {
  for (const char* file : {"s10/cam2.PNG", "s10/cam10.jpeg", "s2/cam10.tif", "s2/cam2.tiff"})
    add(file);
  const FolderLayout layout = read_layout(folder());
  ASSERT_EQ(layout.sets.size(), 2U);
  EXPECT_EQ(layout.sets[0].name, "s2");
  EXPECT_EQ(layout.sets[1].frames[0].file, "s10/cam2.PNG");
  EXPECT_THAT(require_same_cameras(folder(), layout), ElementsAre("cam2", "cam10"));
  EXPECT_THAT(image_files_below(folder()),
              ElementsAre("s2/cam2.tiff", "s2/cam10.tif", "s10/cam2.PNG", "s10/cam10.jpeg"));
}

/// A recording that contained one of these names could not be read.
TEST_F(Layout, RefusesNamesThatNoReaderTakes) {
  for (const std::string& file :
       {std::string("-5/cam0.png"), std::string("s1/-a.png"),
        "s1/" + std::string(198, 'c') + ".png", std::string(201, 's') + "/cam0.png"}) {
    add(file);
    EXPECT_THROW(static_cast<void>(read_layout(folder())), Error) << file;
    std::filesystem::remove_all(folder() / file.substr(0, file.find('/')));
  }
}

TEST_F(Layout, ListsWhatItIgnoresWithAReason) {
  for (const char* file : {"s1/cam0.png", "s1/notes.txt", "readme.md", "s1/.hidden.png",
                           "recording.json", "recording.run.json"}) {
    add(file);
  }
  const FolderLayout layout = read_layout(folder());
  ASSERT_EQ(layout.ignored.size(), 2U);
  EXPECT_EQ(layout.ignored[0].file, "readme.md");
  EXPECT_EQ(layout.ignored[1].file, "s1/notes.txt");
  EXPECT_EQ(layout.sets[0].frames.size(), 1U);
}

TEST_F(Layout, NamesTheMissingCamera) {
  for (const char* file : {"s1/cam0.png", "s1/cam1.png", "s2/cam0.png"}) add(file);
  EXPECT_THAT(refusal(), HasSubstr("set `s2` has no image of camera `cam1`"));
}

TEST_F(Layout, NamesTwoImagesOfOneCamera) {
  for (const char* file : {"s1/cam0.jpg", "s1/cam0.l.png", "s1/cam0.png"}) add(file);
  EXPECT_THAT(refusal(), HasSubstr("s1/cam0.jpg and s1/cam0.png"));
}

TEST_F(Layout, RefusesAFolderWithoutSets) {
  EXPECT_THAT(refusal(), HasSubstr("holds no set of images"));
  add("cam0.png");
  EXPECT_THAT(refusal(), HasSubstr("holds no set of images"));
}

TEST_F(Layout, RefusesASetWithoutImages) {
  add("s1/cam0.png");
  add("s2/cam0.bmp");
  EXPECT_THAT(refusal(), HasSubstr("the set holds no image"));
}

TEST_F(Layout, RefusesNamesThatBreakLists) {
  add("a,b/cam0.png");
  EXPECT_THAT(refusal(), HasSubstr("`a,b` cannot be a name"));
}

TEST_F(Layout, TakesEveryNameThatAFileCanHold) {
  for (const char* file : {"Stoff 1 wei\u00df/Kamera \u00e4.png", "(2) #1/Kamera \u00e4.png"})
    add(file);
  EXPECT_THAT(require_same_cameras(folder(), read_layout(folder())), ElementsAre("Kamera \u00e4"));
  add("wei\xdf/cam.png");
  EXPECT_THAT(refusal(), HasSubstr("is not UTF-8"));
}

TEST_F(Layout, RefusesAnAbsentFolder) {
  EXPECT_THROW(static_cast<void>(read_layout(folder() / "nothing")), Error);
}

using test::image_bytes;

struct Kind {
  std::string ending;
  ImageFormat format;
};

void PrintTo(const Kind& kind, std::ostream* out) {
  *out << kind.ending;
}

class ImageStructure : public testing::TestWithParam<Kind> {};

TEST_P(ImageStructure, AcceptsAWholeImageAndLearnsItsSize) {
  const auto bytes = image_bytes(GetParam().ending, 3, 321, 123);
  EXPECT_EQ(image_format(bytes), GetParam().format);
  EXPECT_EQ(structure_fault(GetParam().format, bytes), std::nullopt);
  EXPECT_EQ(check_image(bytes, {}), (ImageSize{321, 123}));
}

TEST(ImageCheck, RefusesNumbersThatDetectionDoesNotRead) {
  std::vector<unsigned char> bytes;
  ASSERT_TRUE(cv::imencode(".tiff", cv::Mat(20, 30, CV_32F, cv::Scalar(0.5)), bytes));
  EXPECT_THROW(static_cast<void>(check_image(bytes, {})), Error);
}

/// The decoder would return the first page without an error.
TEST(ImageCheck, RefusesATiffOfSeveralPages) {
  std::vector<unsigned char> bytes;
  const cv::Mat page(20, 30, CV_8U, cv::Scalar(90));
  ASSERT_TRUE(cv::imencode(".tiff", page, bytes));
  EXPECT_EQ(check_image(bytes, {}), (ImageSize{30, 20}));
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "two.tiff";
  ASSERT_TRUE(cv::imwritemulti(file.string(), std::vector<cv::Mat>{page, page}));
  const Error error =
      test::error_of([&] { return check_image(read_bytes(file), {.file = file.string()}); });
  EXPECT_EQ(error.what_failed(), "the TIFF has several pages");
  EXPECT_EQ(error.where().file, file.string());
}

TEST_P(ImageStructure, RefusesEveryTruncation) {
  const auto whole = image_bytes(GetParam().ending, 5);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const std::vector<unsigned char> cut(whole.begin(), whole.begin() + static_cast<long>(length));
    EXPECT_THROW(static_cast<void>(check_image(cut, {})), Error)
        << length << " of " << whole.size();
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, ImageStructure,
                         testing::Values(Kind{".png", ImageFormat::png},
                                         Kind{".jpg", ImageFormat::jpeg},
                                         Kind{".tif", ImageFormat::tiff}),
                         [](const auto& kind) { return kind.param.ending.substr(1); });

TEST(ImageStructureOfPng, RefusesEverySingleBitFlip) {
  const auto whole = image_bytes(".png", 7, 16, 12);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    auto flipped = whole;
    flipped[i] ^= static_cast<unsigned char>(1U << (i % 8));
    EXPECT_THROW(static_cast<void>(check_image(flipped, {})), Error) << "byte " << i;
  }
}

TEST(ImageStructureOfPng, SaysWhereItEnds) {
  auto bytes = image_bytes(".png", 1, 200, 200);
  bytes.resize(bytes.size() / 2);
  EXPECT_EQ(structure_fault(ImageFormat::png, bytes), "ends inside chunk IDAT");
}

TEST(ImageStructureOfJpeg, FindsTheCutThatTheDecoderHides) {
  auto bytes = image_bytes(".jpg", 1, 320, 240);
  bytes.resize(bytes.size() / 2);
  ASSERT_FALSE(cv::imdecode(bytes, cv::IMREAD_UNCHANGED).empty())
      << "the decoder reports truncation itself now";
  EXPECT_EQ(structure_fault(ImageFormat::jpeg, bytes), "ends before its end marker (EOI)");
}

TEST(ImageStructureOfJpeg, IsNotFooledByAnEndMarkerInAThumbnail) {
  // An application segment (a thumbnail) that contains FF D9, in a file cut off before its own end.
  auto bytes = image_bytes(".jpg", 1);
  const std::vector<unsigned char> thumbnail = {0xff, 0xe1, 0x00, 0x06, 0xff, 0xd8, 0xff, 0xd9};
  bytes.insert(bytes.begin() + 2, thumbnail.begin(), thumbnail.end());
  EXPECT_EQ(structure_fault(ImageFormat::jpeg, bytes), std::nullopt);
  bytes.resize(bytes.size() - 2);
  EXPECT_EQ(structure_fault(ImageFormat::jpeg, bytes), "ends before its end marker (EOI)");
}

TEST(ImageStructureOfTiff, SurvivesEverySingleByteChange) {
  // A damaged offset or count must be refused or lead to a decodable file, never to a crash.
  const auto whole = image_bytes(".tif", 2, 16, 12);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    auto changed = whole;
    changed[i] = 0xff;
    static_cast<void>(image_format(changed));
    static_cast<void>(structure_fault(ImageFormat::tiff, changed));
  }
}

TEST(ImageFormatByContent, KnowsNothingElse) {
  const std::vector<unsigned char> text = {'h', 'e', 'l', 'l', 'o'};
  EXPECT_EQ(image_format(text), std::nullopt);
  EXPECT_EQ(image_format({}), std::nullopt);
  const std::vector<unsigned char> bigtiff = {'I', 'I', 43, 0, 8, 0, 0, 0};
  EXPECT_EQ(structure_fault(ImageFormat::tiff, bigtiff),
            "is a BigTIFF; save it as plain TIFF or PNG");
}

namespace fs = std::filesystem;

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

TEST(NaturalOrder, CountsDigitRunsAsNumbers) {
  std::vector<std::string> names = {"set10", "set2", "cam", "set1b", "set1", "9", "10", "set2a1"};
  std::sort(names.begin(), names.end(), natural_less);
  EXPECT_THAT(names,
              testing::ElementsAre("9", "10", "cam", "set1", "set1b", "set2", "set2a1", "set10"));
}

TEST(NaturalOrder, IsTotalAlsoForLeadingZeros) {
  EXPECT_TRUE(natural_less("pose_007", "pose_08"));
  EXPECT_NE(natural_less("a1", "a01"), natural_less("a01", "a1"));
  EXPECT_FALSE(natural_less("a1", "a1"));
  EXPECT_TRUE(natural_less("", "0"));
}

TEST(NaturalOrder, HandlesNumbersLongerThanAnyInteger) {
  EXPECT_TRUE(natural_less("99999999999999999999998", "99999999999999999999999"));
  EXPECT_TRUE(natural_less("99999999999999999999999", "100000000000000000000000"));
}

class Verify : public testing::Test {
 protected:
  void SetUp() override {
    test::write_sets(folder(), {"a", "b"}, {"cam0", "cam1"});
    static_cast<void>(import_folder(folder(), folder(), {}));
  }
  [[nodiscard]] fs::path folder() const { return temporary_.path(); }

 private:
  test::TemporaryFolder temporary_;
};

TEST_F(Verify, FindsNothingInAnIntactRecording) {
  const VerifyReport report = verify_recording(folder(), {.threads = 2});
  EXPECT_TRUE(report.good());
  EXPECT_EQ(report.sets, 2U);
  EXPECT_EQ(report.images, 4U);
}

TEST_F(Verify, ListsAllFaultsInOrder) {
  fs::remove(folder() / "a/cam1.png");
  fs::resize_file(folder() / "b/cam0.png", 100);
  const VerifyReport report = verify_recording(folder(), {.threads = 2});
  ASSERT_EQ(report.faults.size(), 2U);
  EXPECT_EQ(report.faults[0].file, "a/cam1.png");
  EXPECT_EQ(report.faults[0].set, "a");
  EXPECT_EQ(report.faults[0].camera, "cam1");
  EXPECT_EQ(report.faults[1].file, "b/cam0.png");
  EXPECT_FALSE(report.faults[1].what.empty());
}

TEST_F(Verify, ListsImagesThatTheManifestLacks) {
  test::write_bytes(folder() / "c/cam0.png", test::image_bytes(".png"));
  const VerifyReport report = verify_recording(folder(), {});
  EXPECT_TRUE(report.good());
  EXPECT_THAT(report.not_listed, ElementsAre("c/cam0.png"));
}

TEST_F(Verify, FindsEveryTruncationAndBitFlip) {
  std::mt19937 random(2026);
  const fs::path file = folder() / "b/cam1.png";
  const auto whole = read_bytes(file);
  std::uniform_int_distribution<std::size_t> place(0, whole.size() - 1);
  for (int trial = 0; trial < 100; ++trial) {
    auto spoiled = whole;
    const std::size_t at = place(random);
    if (trial % 2 == 0) {
      spoiled.resize(at);
    } else {
      spoiled[at] ^= static_cast<unsigned char>(1U << (trial % 8));
    }
    test::write_bytes(file, spoiled);
    EXPECT_EQ(verify_recording(folder(), {}).faults.size(), 1U) << "byte " << at;
  }
}

TEST_F(Verify, NeedsAManifest) {
  fs::remove(folder() / "recording.json");
  EXPECT_THROW(static_cast<void>(verify_recording(folder(), {})), Error);
}

TEST(CaptureProgram, AFolderTooManyIsRefusedAndNotLeftOut) {
  const fs::path program = test::program("drape-capture");
  if (!fs::exists(program)) GTEST_SKIP() << "missing: the program drape-capture";
  for (const char* words : {"verify a b", "import a b --out c", "import a --out c --set drape_A",
                            "--average verify a"}) {
    const int ended = std::system((program.string() + " " + words + " 2> /dev/null").c_str());
    EXPECT_EQ(WEXITSTATUS(ended), 2) << words;
  }
}

TEST(Bench1Recording, IsAsRecorded) {
  const VerifyReport report =
      verify_recording(test::source_root() / "rigs/bench1/recording", {.threads = 2});
  EXPECT_TRUE(report.good());
  EXPECT_EQ(report.sets, 23U);
  EXPECT_EQ(report.images, 69U);
  EXPECT_TRUE(report.not_listed.empty());
}

}  // namespace
}  // namespace drape::capture
