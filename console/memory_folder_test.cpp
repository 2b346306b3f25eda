// SPDX-License-Identifier: Apache-2.0
#include "console/cameras.hpp"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "tests/support/error_of.hpp"
#include "tests/support/paths.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;

TEST(MemoryFolder, OfAKilledProgramIsRemovedByTheNextAndThatOfALivingOneStays) {
  const test::TemporaryFolder place;
  const MemoryFolder living(place.path());
  std::ofstream(living.path() / "kept.pgm") << "P5";
  const pid_t program = ::fork();
  if (program == 0) {
    const MemoryFolder killed(place.path());
    std::ofstream(killed.path() / "left.pgm") << "P5" << std::flush;
    ::kill(::getpid(), SIGKILL);
  }
  ASSERT_GT(program, 0);
  int status = 0;
  ASSERT_EQ(::waitpid(program, &status, 0), program);
  ASSERT_TRUE(WIFSIGNALED(status));
  const auto folders = [&] {
    return std::distance(fs::directory_iterator(place.path()), fs::directory_iterator());
  };
  EXPECT_EQ(folders(), 2);  // that of the killed program is still there
  {
    const MemoryFolder next(place.path());
    EXPECT_EQ(folders(), 2);
    EXPECT_TRUE(fs::is_empty(next.path()));
    EXPECT_TRUE(fs::exists(living.path() / "kept.pgm"));
  }
  EXPECT_EQ(folders(), 1);  // a folder goes with its owner
}

TEST(MemoryFolder, LeavesLinksAndOtherNamesAlone) {
  const test::TemporaryFolder place;
  fs::create_directory(place.path() / "other");
  std::ofstream(place.path() / "other" / "kept") << "x";
  fs::create_directory_symlink(place.path() / "other", place.path() / "drape-bench-linked");
  const MemoryFolder next(place.path());
  EXPECT_TRUE(fs::exists(place.path() / "other" / "kept"));
}

TEST(MemoryFolder, WithoutAPlaceSaysSo) {
  const test::TemporaryFolder place;
  const Error error = test::error_of([&] { const MemoryFolder none(place.path() / "absent"); });
  EXPECT_EQ(error.kind(), ErrorKind::bad_input);
  EXPECT_NE(std::string(error.what()).find("No such file"), std::string::npos) << error.what();
}

}  // namespace
}  // namespace drape::console
