// SPDX-License-Identifier: Apache-2.0
#include "core/files/files.hpp"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "core/error.hpp"
#include "core/sheet.hpp"
#include "tests/support/paths.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

TEST(Files, HashesAreTheStandards) {
  // FIPS 180-2, appendix B.1, and the hash of an empty text.
  EXPECT_EQ(sha256_of(std::string_view("abc")),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_of(std::string_view("")),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
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

}  // namespace
}  // namespace drape
