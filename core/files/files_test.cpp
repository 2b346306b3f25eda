// SPDX-License-Identifier: Apache-2.0
#include "core/files/files.hpp"

#include <gmock/gmock.h>

#include "core/error.hpp"
#include "tests/support/paths.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

TEST(Files, HashesAreTheStandards) {
  // FIPS 180-2, appendix B.1, and the hash of nothing.
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
