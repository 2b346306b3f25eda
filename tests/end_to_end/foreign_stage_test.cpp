// SPDX-License-Identifier: Apache-2.0
// A stage can be replaced by a program of another lab that uses only the documentation.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/sheet.hpp"
#include "core/units.hpp"
#include "tests/support/bench1_truth.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A folder of all programs in which a script `text` replaces one of them.
class Programs {
 public:
  Programs(const std::string& replaced, const std::string& text) {
    for (const fs::directory_entry& entry :
         fs::directory_iterator(program("drape").parent_path())) {
      const std::string name = entry.path().filename().string();
      if (!name.starts_with("drape") || name == replaced) continue;
      // `drape` looks for the stages beside its own file, so it is copied, not linked.
      name == "drape" ? fs::copy(entry.path(), folder_.path() / name)
                      : fs::create_symlink(entry.path(), folder_.path() / name);
    }
    write_durable(folder_.path() / replaced, text);
    ::chmod((folder_.path() / replaced).c_str(), 0755);
  }
  [[nodiscard]] Outcome run(const SmallBench& bench, const std::string& more = " --single") const {
    return run_line("cd " + bench.folder().string() + " && exec " +
                    (folder_.path() / "drape").string() + " run rig --out out" + more);
  }

 private:
  TemporaryFolder folder_;
};

TEST(ForeignStage, APythonTriangulationRunsTheBenchToItsEnd) {
  const SmallBench bench({"C"}, measured);
  const Programs programs("drape-triangulate",
                          read_text(source_root() / "tests/end_to_end/foreign_triangulate.py"));
  const Outcome outcome = programs.run(bench);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
  const Sheet sheet = read_sheet(bench.folder() / "out/C/sheet.ply");
  ASSERT_GE(sheet.marks.size(), 80U);
  // A quarter of the pitch: only its own true mark is that close.
  for (const TrueDot& dot : bench1_truth().drapes.at("C")) {
    if (const SheetMark* mark = sheet.find(dot.mark)) {
      EXPECT_LT((mark->point_in_world - dot.point_in_world).norm(), 5 * units::mm);
    }
  }
  EXPECT_TRUE(fs::exists(bench.folder() / "out/report.html"));
}

TEST(ForeignStage, AProgramThatCrashesIsNoVerdictAndLosesNoOther) {
  const SmallBench bench({"C"}, measured);
  const std::string crashes = "#!/bin/sh\necho 'Traceback: oops' >&2\nexit 1\n";
  const Outcome unmeasured = Programs("drape-triangulate", crashes).run(bench);
  EXPECT_GT(unmeasured.exit_code, 1) << unmeasured.text;
  EXPECT_THAT(
      unmeasured.text,
      HasSubstr("triangulate (drape C) ended with exit code 1 but did not write out/C/sheet"));
  EXPECT_THAT(unmeasured.text, Not(HasSubstr("GO: ")));
  // An optional step that fails for every drape: there are results without it.
  const std::string only_branches = "#!/bin/sh\n[ \"$1\" = branches ] || exec '" +
                                    program("drape-simulate").string() + "' \"$@\"\n" +
                                    crashes.substr(crashes.find('\n') + 1);
  const Outcome extra = Programs("drape-simulate", only_branches).run(bench, "");
  EXPECT_EQ(extra.exit_code, 0) << extra.text;
  const std::string said = "branches (C, ensemble): failed, so nothing of it is in the result";
  EXPECT_THAT(extra.text, HasSubstr("\nGO: bench1, run "));
  EXPECT_THAT(extra.text, HasSubstr("warning: " + said));
  EXPECT_THAT(read_text(bench.folder() / "out/report.html"), HasSubstr(said));
  // A box in which no simulation can start: only the measured sheet is passed to compare.
  bench.replace("scenes/C.toml", "[128.0, 128.0, 128.0]", "[128.0, 128.0, 178.0]");
  const Programs comparing("drape-compare", crashes);
  const Outcome uncompared = comparing.run(bench);
  EXPECT_EQ(uncompared.exit_code, 1) << uncompared.text;
  EXPECT_THAT(uncompared.text, HasSubstr("\nNO-GO: triangulate (drape C): "));
  EXPECT_THAT(uncompared.text, HasSubstr("nothing was compared, stored or reported: compare "));
  // For scripts it has the keys of any run, but no report.
  const Outcome read = comparing.run(bench, " --single --json 2>/dev/null");
  EXPECT_EQ(read.exit_code, 1) << read.text;
  const Json json = Json::parse(read.text);
  EXPECT_EQ(json.at("verdict"), "NO-GO");
  EXPECT_THAT(json.at("cause").get<std::string>(), HasSubstr("triangulate (drape C): "));
  EXPECT_FALSE(json.at("steps").empty());
  EXPECT_FALSE(json.at("rejected").empty());
  EXPECT_TRUE(json.at("report").is_null());
}

}  // namespace
}  // namespace drape::test
