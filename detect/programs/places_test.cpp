// SPDX-License-Identifier: Apache-2.0
// drape-detect refuses unwritable output before reading a frame.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <filesystem>

#include "core/files/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST(Places, AreRefusedBeforeAFrameIsLookedAt) {
  const TemporaryFolder folder;
  const fs::path rig = source_root() / "rigs/bench1", recording = folder.path() / "recording";
  const fs::path file = folder.path() / "a.txt", good = folder.path() / "out.json";
  fs::create_directories(folder.path() / "folder.json");
  fs::create_directories(recording / "drape_A");
  write_durable(file, "a file");
  write_durable(recording / "recording.json", read_text(rig / "recording/recording.json"));
  const auto run = [&](const fs::path& out, const fs::path& overlay) {
    return run_line(fmt::format("{} {} --rig {} --surface cloth --sets drape_A --quiet --out {}{}",
                                program("drape-detect").string(), recording.string(), rig.string(),
                                out.string(),
                                overlay.empty() ? "" : " --overlay " + overlay.string()));
  };
  // The pictures do not exist, so the message that names one shows that it was read first.
  EXPECT_THAT(run(good, {}).text, HasSubstr("drape_A/cam0.png"));
  EXPECT_THAT(run(folder.path() / "folder.json", {}).text, HasSubstr("a folder, link or device"));
  EXPECT_THAT(run(file / "out.json", {}).text, HasSubstr("a.txt"));
  EXPECT_THAT(run(good, file).text, HasSubstr("a file stands where a folder"));
  for (const char* name : {"out.json", "drape_A/cam1.png", "new/out.json", "../recording/out.json"})
    EXPECT_THAT(run(recording / name, {}).text, HasSubstr("lies inside the recording")) << name;
  EXPECT_THAT(run(good, recording).text, HasSubstr("--overlay"));
  fs::create_directory_symlink(recording, folder.path() / "link");
  EXPECT_THAT(run(folder.path() / "link/out.json", {}).text, HasSubstr("inside the recording"));
  EXPECT_EQ(std::distance(fs::directory_iterator(recording), {}), 2) << "the set and its list";
  EXPECT_THAT(run(folder.path() / "recording-2.json", {}).text, HasSubstr("drape_A/cam0.png"));
}

}  // namespace
}  // namespace drape::test
