// SPDX-License-Identifier: Apache-2.0
#include <sys/stat.h>

#include <fmt/ranges.h>
#include <gmock/gmock.h>

#include "core/drape_mesh.hpp"
#include "core/files/files.hpp"
#include "core/files/picture_layout.hpp"
#include "core/sheet.hpp"
#include "tests/support/paths.hpp"

namespace drape {
namespace {

using testing::ElementsAre;

const std::vector<std::string> kHeaders = {"strain", "force_gf_per_cm"};

class CsvFile : public testing::Test {
 protected:
  [[nodiscard]] Csv read(const std::string& text) const {
    write_durable(file(), text);
    return read_csv(file(), kHeaders);
  }
  /// Location given in the refusal of this text.
  [[nodiscard]] Where refusal(const std::string& text) const {
    try {
      static_cast<void>(read(text));
    } catch (const Error& error) {
      return error.where();
    }
    ADD_FAILURE() << "accepted: " << text;
    return {};
  }
  [[nodiscard]] std::filesystem::path file() const { return folder_.path() / "curve.csv"; }

  test::TemporaryFolder folder_;
};

TEST_F(CsvFile, ReadsColumnsAndRemembersLines) {
  const Csv csv = read("# loading\nstrain,force_gf_per_cm\n0, 0\n\n0.5,1e-3\r\n");
  EXPECT_THAT(csv.columns.at(0), ElementsAre(0.0, 0.5));
  EXPECT_THAT(csv.columns.at(1), ElementsAre(0.0, 1e-3));
  EXPECT_THAT(csv.lines, ElementsAre(3, 5));
}

TEST_F(CsvFile, RefusesAnotherUnitInTheHead) {
  EXPECT_EQ(refusal("strain,force_n_per_m\n0,0\n").line, 1);
}

TEST_F(CsvFile, NamesLineAndColumnOfACellThatIsNoNumber) {
  for (const char* cell : {"nan", "inf", "1,5", "", "2 mm", "0x10"}) {
    const Where where = refusal(std::string("strain,force_gf_per_cm\n0,0\n1,") + cell + "\n");
    EXPECT_EQ(where.line, 3) << cell;
  }
  EXPECT_EQ(refusal("strain,force_gf_per_cm\n0,nan\n").field, "force_gf_per_cm");
}

/// A spreadsheet's "CSV UTF-8" starts with a byte order mark, which is not part of the text.
TEST_F(CsvFile, ReadsWhatASpreadsheetWritesAndNamesWhatIsNoCsv) {
  const std::string table = "strain,force_gf_per_cm\n0,0\n1,2\n", mark = "\xef\xbb\xbf";
  EXPECT_THAT(read(mark + table).columns.at(1), ElementsAre(0.0, 2.0));
  EXPECT_THAT(read(mark + "# loading\n" + table).lines, ElementsAre(3, 4));
  const auto said_of = [&](const std::string& text) -> std::string {
    try {
      static_cast<void>(read(text));
    } catch (const Error& error) {
      return error.what();
    }
    return "accepted";
  };
  using testing::HasSubstr;
  EXPECT_THAT(said_of("strain;force_gf_per_cm\n0;0\n"), HasSubstr("semicolons"));
  EXPECT_THAT(said_of("strain\tforce_gf_per_cm\n0\t0\n"), HasSubstr("tabs"));
  std::string wide = "\xff\xfe";
  for (const char letter : table) wide += {letter, '\0'};
  EXPECT_THAT(said_of(wide), HasSubstr("UTF-16"));
}

TEST_F(CsvFile, RefusesAFileWithoutHead) {
  EXPECT_EQ(refusal("# nothing here\n").file, file().string());
}

TEST_F(CsvFile, WrittenNumbersComeBackExactly) {
  const std::vector<double> values = {0.1, -1.0 / 3.0, 6.02214076e19, 5e-324};
  std::string text = fmt::format("{}\n", fmt::join(kHeaders, ","));
  for (const double value : values) text += fmt::format("{},{}\n", value, value);
  const Csv csv = read(text);
  EXPECT_EQ(csv.columns.at(0), values);
  EXPECT_EQ(csv.columns.at(1), values);
}

namespace fs = std::filesystem;

TEST(Files, HashesAreTheStandards) {
  // FIPS 180-2, appendix B.1, and the hash of an empty text.
  EXPECT_EQ(sha256_of(std::string_view("abc")),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_of(std::string_view("")),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST(Files, AFileIsHashedThoughItIsTooLargeToBeRead) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "results.sqlite";
  write_durable(file, "");
  std::filesystem::resize_file(file, (std::uintmax_t{769} << 20) + 5);
  EXPECT_EQ(sha256_of_file(file),  // sha256sum of as many zeros
            "f532811cecc849fa704a332f0ebde87597938c10cd2ba81c16c87a90fd2a9347");
  EXPECT_THROW(static_cast<void>(read_bytes(file)), Error);
}

TEST(Files, ADurableWriteReplacesTheWholeFileAndLeavesNothingElse) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "deep" / "file.txt";
  write_durable(file, "a long first content");
  write_durable(file, "short");
  EXPECT_EQ(read_text(file), "short");
  EXPECT_EQ(sha256_of_file(file), sha256_of(std::string_view("short")));
  EXPECT_EQ(std::distance(fs::directory_iterator(file.parent_path()), {}), 1);
}

TEST(Files, AFailedWriteNamesTheFileAndKeepsWhatWasThere) {
  const test::TemporaryFolder folder;
  const fs::path blocked = folder.path() / "file.txt" / "below";
  write_durable(folder.path() / "file.txt", "kept");
  try {
    write_durable(blocked, "x");
    FAIL() << "a file cannot be a folder";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_THAT(error.what(), testing::HasSubstr("file.txt"));
  }
  EXPECT_EQ(read_text(folder.path() / "file.txt"), "kept");
}

TEST(Files, OnlyAFileIsReadAndReplaced) {
  const test::TemporaryFolder folder;
  const fs::path pipe = folder.path() / "pipe", link = folder.path() / "link";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  write_durable(folder.path() / "kept.txt", "kept");
  fs::create_symlink(folder.path() / "kept.txt", link);
  EXPECT_THROW(static_cast<void>(read_text(pipe)), Error);  // without waiting
  EXPECT_THROW(static_cast<void>(read_text(folder.path())), Error);
  for (const fs::path& place : {pipe, link, folder.path(), fs::path("/dev/null")})
    EXPECT_THROW(write_durable(place, "x"), Error) << place;
  EXPECT_EQ(read_text(link), "kept");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST(Files, NamesFromFilesStayInTheirFolder) {
  const test::TemporaryFolder folder;
  const fs::path inside = folder.path() / "recording";
  write_durable(inside / "set" / "cam.png", "image");
  write_durable(folder.path() / "secret", "secret");
  fs::create_symlink(folder.path() / "secret", inside / "out.png");
  const std::vector<unsigned char> image = read_inside(inside, "set/cam.png", {});
  EXPECT_EQ(std::string(image.begin(), image.end()), "image");
  for (const std::string name :
       {"", "/etc/passwd", "../secret", "set/../../secret", "set//cam.png", "./set/cam.png", "a,b",
        "a\nb", "a\\b", "-rf", "out.png", "set/"}) {
    EXPECT_THROW(static_cast<void>(read_inside(inside, name, {})), Error) << name;
    EXPECT_THROW(write_inside(inside, name, "x", {}), Error) << name;
  }
  fs::create_directory_symlink(folder.path(), inside / "up");
  EXPECT_THROW(write_inside(inside, "up/secret", "x", {}), Error);
  EXPECT_THROW(write_inside(inside, "up/new/file", "x", {}), Error);
  write_inside(inside, "new/set/cam.png", "y", {});
  EXPECT_EQ(read_text(inside / "new/set/cam.png"), "y");
  EXPECT_EQ(read_text(folder.path() / "secret"), "secret");
  EXPECT_FALSE(fs::exists(folder.path() / "new"));
  EXPECT_NO_THROW(require_plain_name(std::string(200, 'x'), {}));
  EXPECT_THROW(require_plain_name(std::string(201, 'x'), {}), Error);
}

TEST(Files, OneWriterAtATime) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "deep" / ".lock";
  {
    const WriterLock first(file, "somebody writes");
    EXPECT_THROW(WriterLock(file, "somebody writes"), Error);
  }
  EXPECT_NO_THROW(WriterLock(file, "somebody writes"));
  EXPECT_TRUE(fs::is_empty(file.parent_path()));
}

TEST(Files, ATerminalGetsNoControlCharacters) {
  EXPECT_EQ(printable("a\x1b[31mb\r\x07\tc\n\x7f"), "a?[31mb??\tc\n?");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m\xc3\xbc"),
            "?31m\xc3\xbc");
  EXPECT_EQ(printable("a\u202eb\u2066c\u200fd\u061ce\u2014"), "a?b?c?d?e\u2014") << "reordering";
}

TEST(Files, AMessageQuotesAtMost80BytesAndKeepsFileLineAndRemedy) {
  const std::string remedy = "run `" + std::string(200, 'r') + "`";
  const Error error = bad_input(
      "the word `" + std::string(79, 'x') + "\u00fc" + std::string(1 << 20, 'y') +
          "` is not `known`",
      {.file = std::string(100, 'f'), .line = 7, .field = std::string(1 << 20, 'k')}, remedy);
  EXPECT_EQ(error.what_failed(), "the word `" + std::string(77, 'x') + "...` is not `known`");
  EXPECT_EQ(error.what(), error.what_failed() + "\n  where: " + std::string(100, 'f') +
                              ":7, field `" + std::string(77, 'k') + "...`\n  to do: " + remedy);
}

TEST(Files, AKeyThatStandsTwiceInAnObjectOfJsonIsNamedWithItsFile) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "thing.json";
  const auto read = [&](const std::string& members) {
    write_durable(file, R"({"schema":"drapebench/thing/1",)" + members + "}");
    static_cast<void>(Document::read(file));
  };
  EXPECT_NO_THROW(read(R"("a":{"x":1,"y":2},"b":[{"x":1},{"x":2}],"x":3)"));
  for (const char* twice : {R"("x":1,"a":{"x":1},"x":2)", R"("a":[{"y":1},{"x":1,"x":1}])",
                            R"("a":{"y":{},"x":{"y":1},"x":2})"}) {
    try {
      read(twice);
      ADD_FAILURE() << "taken: " << twice;
    } catch (const Error& error) {
      EXPECT_THAT(error.what_failed(), testing::HasSubstr("the key `x` stands twice")) << twice;
      EXPECT_EQ(error.where().file, file.string());
    }
  }
}

/// For example that of a piece instead of a sheet: its own program would write the same again.
TEST(Files, JsonOfAnotherKindIsNotToBeMadeAgain) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "thing.json";
  write_durable(file, R"({"schema":"drapebench/piece/1"})");
  try {
    static_cast<void>(read_record<Sheet>(file));
    ADD_FAILURE() << "taken";
  } catch (const Error& error) {
    EXPECT_THAT(error.what_failed(), testing::HasSubstr("`drapebench/piece/1` is not"));
    EXPECT_EQ(error.what_to_do(), "give a file of that kind");
  }
}

TEST(Files, AMissingFileIsNamed) {
  try {
    static_cast<void>(read_text("no/such/file.toml"));
    FAIL() << "read a file that is not there";
  } catch (const Error& error) {
    EXPECT_EQ(error.where().file, "no/such/file.toml");
  }
}

MeshFile read_as(const std::string& name, const std::string& text) {
  const test::TemporaryFolder folder;
  write_durable(folder.path() / name, text);
  return read_mesh_file(folder.path() / name);
}

const std::string kHead =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
const std::string kCorners = "0 0 0\n+1 0 0\n0 1e0 0\n";

TEST(MeshFiles, AreReadByMeaning) {
  const MeshFile ply = read_as("a.ply", kHead + kCorners + "3 0 1 2\n");
  const MeshFile obj = read_as("a.OBJ", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 3\n");
  for (const MeshFile& mesh : {ply, obj}) {
    ASSERT_EQ(mesh.points.size(), 3U);
    EXPECT_EQ(mesh.points[1], Eigen::Vector3d(1, 0, 0));
    ASSERT_EQ(mesh.triangles.size(), 1U);
    EXPECT_EQ(mesh.triangles[0][2].point, 2U);
  }
}

TEST(MeshFiles, PromiseNoMoreThanTheirBytesHold) {
  const auto with = [](std::string head, const std::string& from, const std::string& to) {
    return head.replace(head.find(from), from.size(), to) + kCorners;
  };
  for (const std::string& text :
       {with(kHead, "vertex 3", "vertex 4000000000"),
        with(kHead, "vertex 3", "vertex 18446744073709551615"),
        with(kHead, "vertex 3", "vertex -1"), with(kHead, "face 1", "face 999999999"),
        with(kHead, "property float z\n", ""), with(kHead, "ascii 1.0", "ascii 2.0"),
        kHead + "0 0\n1 0 0\n0 1 0\n3 0 1 2\n", kHead + kCorners + "0 1 2\n",
        std::string("ply\nformat ascii 1.0\nelement vertex 4000000000\nend_header\n"),
        kHead + kCorners + "1e300 0 1 2\n", kHead + kCorners + "-1 0 1 2\n",
        kHead + kCorners + "2.5 0 1 2\n", kHead + kCorners + "3 0 1 1e300\n",
        kHead + kCorners + "3 0 1 0.5\n", kHead + kCorners + "3 0 1 -1\n",
        kHead + kCorners + "3 0 1 3\n", kHead + kCorners + "3 0 1 nan\n"}) {
    try {
      static_cast<void>(read_as("bomb.ply", text));
      FAIL() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input) << text;
    }
  }
}

/// "camera|view" of each name.
std::vector<std::string> read(const std::vector<std::string>& names) {
  std::vector<std::string> texts;
  for (const PictureName& name : read_picture_names(names))
    texts.push_back(name.camera + "|" + name.view);
  return texts;
}

TEST(PictureNames, TheViewIsTheNumberThatChangesMost) {
  EXPECT_THAT(read({"left01", "right01", "left02"}), ElementsAre("left|01", "right|01", "left|02"));
  EXPECT_THAT(read({"cam1_01_int", "cam1_02_int", "cam2_03_int"}),
              ElementsAre("cam1_int|01", "cam1_int|02", "cam2_int|03"));
  EXPECT_THAT(read({"007-left", "008-left"}), ElementsAre("left|007", "left|008"));
  EXPECT_THAT(read({"IMG_20240501_101", "IMG_20240501_102"}),
              ElementsAre("IMG_20240501|101", "IMG_20240501|102"));
  EXPECT_THAT(read({"1", "2"}), ElementsAre("|1", "|2"));
}

TEST(PictureNames, NumbersAreComparedAsNumbers) {
  EXPECT_THAT(read({"left1", "left2", "right01", "right02"}),
              ElementsAre("left|1", "left|2", "right|1", "right|2"));
  EXPECT_THAT(read({"img2", "img10"}), ElementsAre("img|02", "img|10"));
  EXPECT_THAT(read({"img002", "img010"}), ElementsAre("img|002", "img|010"));
  EXPECT_THAT(read({"0", "000"}), ElementsAre("|0", "|0"));
}

TEST(PictureNames, ATimeIsOneNumberAndAViewWhereNothingElseIs) {
  EXPECT_THAT(read({"Image__2018-09-17__16-38-56", "Image__2018-09-17__16-38-57",
                    "Image__2018-09-17__16-39-00"}),
              ElementsAre("Image|20180917163856", "Image|20180917163857", "Image|20180917163900"));
  EXPECT_THAT(read({"IMG_20181231_235959", "IMG_20190101_000001"}),
              ElementsAre("IMG|20181231235959", "IMG|20190101000001"));
  EXPECT_THAT(read({"cam0_20180917_163856123_0001", "cam1_20180917_163856130_0001",
                    "cam0_20180917_163901123_0002", "cam1_20180917_163901129_0002"}),
              ElementsAre("cam0|0001", "cam1|0001", "cam0|0002", "cam1|0002"));
}

TEST(PictureNames, NamesOfSeveralFormsEndWithTheirView) {
  EXPECT_THAT(read({"cam1-3", "side-4"}), ElementsAre("cam1|3", "side|4"));
  EXPECT_THAT(read({"first", "side-4"}), ElementsAre("|first", "side|4"));
}

TEST(PictureLayout, FoldersOfCamerasMayCountWithOtherWidths) {
  const test::TemporaryFolder folder;
  for (const char* file :
       {"cam0/frame1.png", "cam0/frame2.png", "cam1/frame00001.png", "cam1/frame00002.png"}) {
    std::filesystem::create_directories((folder.path() / file).parent_path());
    write_durable(folder.path() / file, "");
  }
  std::vector<std::string> sets;
  for (const PlacedPicture& one : placed_pictures(folder.path(), PictureLayout::cameras))
    sets.push_back(one.camera + "|" + one.set);
  EXPECT_THAT(sets, ElementsAre("cam0|view_1", "cam0|view_2", "cam1|view_1", "cam1|view_2"));
}

}  // namespace
}  // namespace drape
