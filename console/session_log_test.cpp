// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>

#include "console/console.hpp"
#include "tests/support/paths.hpp"

namespace drape::console {
namespace {

std::string noon() {
  return "2026-01-31T12:00:00Z";
}

TEST(SessionLog, KeepsWhatWasWrittenAndSkipsATornLine) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "session.jsonl";
  {
    SessionLog log(file, noon);
    log.add("Ada", "took pose_00", {{"taken", "pose_00"}});
    log.add("Ada", "note", {{"note", "line 1\nline 2 \xff <b>"}});
  }
  const std::string whole = read_text(file);
  for (std::size_t cut = 1; cut < 60; ++cut) {
    write_durable(file, whole.substr(0, whole.size() - cut));
    SessionLog log(file, noon);
    // A line without its end is still one when all of its text is there.
    EXPECT_EQ(log.entries().size(), cut == 1 ? 2U : 1U) << cut;
    EXPECT_EQ(log.torn(), cut == 1 ? 0 : 1) << cut;
    log.add("Ada", "took pose_01", {{"taken", "pose_01"}});
    const SessionLog again(file, noon);
    ASSERT_EQ(again.entries().size(), cut == 1 ? 3U : 2U) << cut;
    EXPECT_EQ(again.entries().back()["taken"], "pose_01");
  }
}

TEST(Call, IsShownAsAShellTakesIt) {
  const Call call{{"run", "my rig", "--operator=O'Neil", "--out", "out/bench1"}};
  EXPECT_EQ(call.shown(), "drape run 'my rig' '--operator=O'\\''Neil' --out out/bench1");
}

}  // namespace
}  // namespace drape::console
