// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>

#include "front/check.hpp"
#include "front/run.hpp"
#include "tests/support/small_bench.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

/// A copy of rigs/bench1 without its pictures, with `tables` in its rig.toml.
fs::path bench_with(const fs::path& folder, const std::string& tables) {
  const fs::path from = test::source_root() / "rigs/bench1", rig = folder / "rig";
  fs::create_directory(rig);
  for (const char* name : {"target.toml", "print.toml"}) fs::copy(from / name, rig);
  for (const char* name : {"scenes", "fabrics"})
    fs::copy(from / name, rig / name, fs::copy_options::recursive);
  fs::create_directory(rig / "recording");
  fs::copy(from / "recording/recording.json", rig / "recording");
  write_durable(rig / "rig.toml", read_text(from / "rig.toml") + "\n" + tables);
  return rig;
}

/// Problems that `drape check` reports for it.
std::string problems_of(const std::string& tables) {
  const test::TemporaryFolder folder;
  return test::run_line(test::program("drape").string() + " check " +
                        bench_with(folder.path(), tables).string())
      .text;
}

TEST(Repeats, AreReadWithTheirSetsNameWhereNoneIsGiven) {
  const test::TemporaryFolder folder;
  const fs::path rig = bench_with(folder.path(),
                                  "[[repeat]]\nscene = \"C\"\nset = \"C_2\"\nface = "
                                  "\"printed\"\n[[repeat]]\nscene = \"C\"\nset "
                                  "= \"C_3\"\nrepeat = \"third\"\n");
  const std::vector<DrapeRepeat> found = read_rig(rig).repeats;
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].repeat + found[0].face, "C_2printed");
  EXPECT_EQ(found[1].repeat + found[1].face, "third");
}

TEST(Repeats, ThatCannotBeAreNamed) {
  // The recording has the sets of the drapes; two of them are used as repeats of a third.
  EXPECT_THAT(problems_of("[[repeat]]\nscene = \"C\"\nset = \"empty\"\n"),
              Not(HasSubstr("repeat")));
  EXPECT_THAT(problems_of("[[repeat]]\nscene = \"C\"\nset = \"drape_C\"\nface = \"back\"\n"),
              Not(HasSubstr("repeat")))
      << "its own laying may be named";
  EXPECT_THAT(problems_of("[[repeat]]\nscene = \"D\"\nset = \"empty\"\n"),
              HasSubstr("scene `D`, which the rig does not name"));
  EXPECT_THAT(problems_of("[[repeat]]\nscene = \"C\"\nset = \"drape_A\"\n"),
              HasSubstr("set `drape_A` shows drape A ("));
  EXPECT_THAT(problems_of("[[repeat]]\nscene = \"C\"\nset = \"stage_z000\"\n"),
              HasSubstr("set `stage_z000` shows the target (stage) ("));
  EXPECT_THAT(problems_of("[[repeat]]\nscene = \"C\"\nset = \"drape_X\"\n"),
              HasSubstr("the recording has no set `drape_X`"));
  EXPECT_THAT(problems_of("[[repeat]]\nscene = \"C\"\nset = \"empty\"\nrepeat = \"a\"\n[[repeat]]\n"
                          "scene = \"C\"\nset = \"pose_00\"\nrepeat = \"a\"\n"),
              HasSubstr("both repeat `a` of scene C"));
  EXPECT_THAT(problems_of("[[repeat]]\nscene = \"C\"\nset = \"empty\"\nrepeat = \"../x\"\n"),
              HasSubstr("cannot be a name"));
  EXPECT_THAT(problems_of("[[repeat]]\nscene = \"C\"\nset = \"empty\"\nfaces = \"x\"\n"),
              HasSubstr("faces"));
}

/// The line of `text` in the rig file of bench_with(tables), as quoted by messages.
std::string line_of(const std::string& tables, const std::string& text) {
  const std::string rig = read_text(test::source_root() / "rigs/bench1/rig.toml") + "\n" + tables;
  const auto end = rig.begin() + static_cast<std::ptrdiff_t>(rig.rfind(text));
  return "rig.toml:" + std::to_string(1 + std::count(rig.begin(), end, '\n')) + ",";
}

TEST(Repeats, ThatCannotBeAreNamedWithTheirOwnLine) {
  const std::string first = "[[repeat]]\nscene = \"C\"\nset = \"empty\"\n";
  for (const std::string wrong : {"[[repeat]]\nscene = \"D\"\nset = \"pose_00\"\n",
                                  "[[repeat]]\nset = \"drape_X\"\nscene = \"C\"\n",
                                  "[[repeat]]\nset = \"drape_A\"\nscene = \"C\"\n"}) {
    const std::string key = wrong.substr(wrong.find('\n') + 1, wrong.find('=') - 10);
    EXPECT_THAT(problems_of(first + wrong), HasSubstr(line_of(first + wrong, key))) << wrong;
  }
}

TEST(Repeats, AreMeasuredButTheDrapeIsSimulatedOnce) {
  const test::TemporaryFolder folder;
  RunOptions options;
  options.rig = bench_with(
      folder.path(), "[[repeat]]\nscene = \"C\"\nset = \"empty\"\nrepeat = \"2\"\nface = \"x\"\n");
  options.out = folder.path() / "out";
  const Plan plan = make_plan(options);
  int measured = 0, simulated = 0;
  for (const Group& group : plan.groups)
    for (const RunStep& step : group.steps) {
      measured += step.stage == "triangulate";
      simulated += step.stage == "simulate" && step.drape == "C";
      if (step.drape != "C, repeat 2" || step.stage != "triangulate") continue;
      EXPECT_THAT(step.arguments, Contains("--repeat=2"));
      EXPECT_THAT(step.arguments, Contains("--face=x"));
    }
  EXPECT_EQ(measured, 4);
  EXPECT_EQ(simulated, 3) << "two numbers of segments, and the measured shape";
  EXPECT_THAT(plan.compare({}).arguments, Contains(HasSubstr("C/repeats/2/sheet.ply")));
}

}  // namespace
}  // namespace drape
