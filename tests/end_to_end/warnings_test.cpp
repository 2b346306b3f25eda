// SPDX-License-Identifier: Apache-2.0
// Warnings and NO-GO of a run, in its ending, report and store.
#include <gmock/gmock.h>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// The folder of a set, as a copy that can be changed.
fs::path own(const SmallBench& bench, const std::string& set) {
  fs::path folder = bench.rig() / "recording" / set;
  const fs::path linked = fs::read_symlink(folder);
  fs::remove(folder);
  fs::copy(linked, folder);
  return folder;
}

TEST(EndToEnd, WarningsAndNoGosReachRunReportAndStore) {
  const SmallBench bench({"C"}, measured);
  const fs::path out = bench.folder() / "out", acceptance = bench.rig() / "acceptance.json";
  const auto answer = [&](const std::string& sql) {
    return run_line(program("drape-results").string() + " --quiet --csv sql \"" + sql +
                    "\" --store " + (out / "results.sqlite").string())
        .text;
  };
  const Outcome first = bench.run("out");
  ASSERT_EQ(first.exit_code, 0) << first.text;
  const std::string warnings = answer("SELECT value FROM run_value WHERE key = 'warning'");
  const std::string report = read_text(out / "report.html");
  for (const std::string warning : {"triangulate (drape C): doubtful, but measured: 15 marks",
                                    "20 of 121 marks of the print"}) {
    EXPECT_THAT(first.text, HasSubstr(warning));
    EXPECT_THAT(report, HasSubstr(warning));
    EXPECT_THAT(warnings, HasSubstr(warning));
  }
  // A warning does not create another run of the same sheets.
  const std::string store = (out / "results.sqlite").string();
  EXPECT_EQ(
      run_line(program("drape-results").string() + " import " + out.string() + " --store " + store)
          .exit_code,
      0);
  EXPECT_EQ(answer("SELECT count(*) FROM run"), "count(*)\n1\n");
  // An acceptance with NO-GO for this calibration.
  Json refused = {{"schema", "drapebench/acceptance/1"},
                  {"rig", "bench1"},
                  {"positions", 9},
                  {"go", false},
                  {"cause", "cam1 moved"},
                  {"figures", Json::array()}};
  refused["calibration_sha256"] = sha256_of_file(out / "calibration.json");
  write_json(acceptance, refused);
  const Outcome second = bench.run("out");
  EXPECT_EQ(second.exit_code, 1) << second.text;
  EXPECT_THAT(second.text, HasSubstr("C: the acceptance of this calibration is NO-GO: cam1 moved"));
  const std::string verdicts = "SELECT measurement, cause FROM run ORDER BY number DESC LIMIT 1";
  EXPECT_THAT(answer(verdicts), HasSubstr("NO-GO,C: the acceptance of this calibration"));
  const std::string import = "SOURCE_DATE_EPOCH=0 " + program("drape-results").string() +
                             " import " + out.string() + " --store " + store;
  const Outcome imported = run_line(import);
  EXPECT_EQ(imported.exit_code, 1);
  EXPECT_THAT(imported.text, HasSubstr("NO-GO: C: the acceptance of this calibration"));
  EXPECT_THAT(answer(verdicts), HasSubstr("NO-GO,C: the acceptance of this calibration"));
  // The store keeps the refusal until the calibration is accepted.
  refused["go"] = true;
  refused.erase("cause");
  write_json(acceptance, refused);
  // A box in which no simulation can start: nothing is compared, and the earlier GO is withdrawn.
  bench.replace("scenes/C.toml", "[128.0, 128.0, 128.0]", "[128.0, 128.0, 178.0]");
  const Outcome third = bench.run("out");
  EXPECT_EQ(third.exit_code, 1) << third.text;
  EXPECT_THAT(third.text, HasSubstr("\nNO-GO: triangulate (drape C): "));
  EXPECT_THAT(answer(verdicts), HasSubstr("marks lie inside it"));
  EXPECT_EQ(answer("SELECT DISTINCT state FROM v_state"), "state\nsuperseded\n");
  EXPECT_THAT(read_text(out / "report.html"), HasSubstr("measurement NO-GO"));
}

TEST(EndToEnd, ADrapeThatCameToNoSheetIsInTheVerdictOfStoreAndReport) {
  const SmallBench bench({"C", "E"}, measured);
  const fs::path picture = own(bench, "drape_C") / "cam1.png";
  const std::string whole = read_text(picture);
  write_durable(picture, whole + "x");
  const Outcome run = bench.run("out");
  EXPECT_EQ(run.exit_code, 1) << run.text;
  const fs::path out = bench.folder() / "out";
  const auto verdict = [&] {
    return run_line(program("drape-results").string() +
                    " --csv sql 'SELECT measurement, cause FROM run ORDER BY number DESC LIMIT 1'" +
                    " --store " + (out / "results.sqlite").string())
        .text;
  };
  EXPECT_THAT(verdict(), HasSubstr("NO-GO,drape C: the image is not the one that was recorded"));
  EXPECT_THAT(read_text(out / "report.html"),
              HasSubstr("<title>Real and virtual drapes: measurement NO-GO"));
  EXPECT_THAT(run.text, testing::ContainsRegex("\n  E  .* mm apart, U "));
  write_durable(picture, whole);
  EXPECT_EQ(bench.run("out").exit_code, 0);
  EXPECT_THAT(verdict(), HasSubstr("\nGO,"));
  // Without any label the other drape is still compared.
  bench.replace("scenes/C.toml", "set = \"drape_C\"", "set = \"empty\"");
  const Outcome empty = bench.run("out");
  EXPECT_EQ(empty.exit_code, 1) << empty.text;
  EXPECT_THAT(empty.text, testing::ContainsRegex("\n  E  .* mm apart, U "));
  EXPECT_THAT(verdict(), HasSubstr("NO-GO,"));
  // A run without its target has no result, and an older report would be misleading.
  const fs::path target = own(bench, "stage_z000") / "cam1.png";
  write_durable(target, read_text(target) + "x");
  EXPECT_EQ(bench.run("out").exit_code, 3);
  EXPECT_FALSE(fs::exists(out / "report.html"));
}

}  // namespace
}  // namespace drape::test
