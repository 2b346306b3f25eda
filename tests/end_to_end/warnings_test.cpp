// SPDX-License-Identifier: Apache-2.0
// What a run warns of and what is NO-GO, in its ending, report and store.
#include <gmock/gmock.h>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST(EndToEnd, WarningsAndNoGosReachRunReportAndStore) {
  const SmallBench bench({"C"});
  const fs::path out = bench.folder() / "out", acceptance = bench.rig() / "acceptance.json";
  const auto answer = [&](const std::string& sql) {
    return run_line(program("drape-results").string() + " --csv sql \"" + sql + "\" --store " +
                    (out / "results.sqlite").string())
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
  // What is warned of makes no other run of the same sheets.
  const std::string store = (out / "results.sqlite").string();
  EXPECT_EQ(
      run_line(program("drape-results").string() + " import " + out.string() + " --store " + store)
          .exit_code,
      0);
  EXPECT_EQ(answer("SELECT count(*) FROM run"), "count(*)\n1\n");
  // An acceptance that says NO-GO of this very calibration.
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
  // The store keeps what was refused until the calibration is accepted.
  refused["go"] = true;
  refused.erase("cause");
  write_json(acceptance, refused);
  // A box in which no simulation can start: nothing is compared, and what was GO is so no more.
  bench.replace("scenes/C.toml", "[128.0, 128.0, 128.0]", "[128.0, 128.0, 178.0]");
  const Outcome third = bench.run("out");
  EXPECT_EQ(third.exit_code, 1) << third.text;
  EXPECT_THAT(third.text, HasSubstr("\nNO-GO: triangulate (drape C): "));
  EXPECT_THAT(answer(verdicts), HasSubstr("marks lie inside it"));
  EXPECT_EQ(answer("SELECT DISTINCT state FROM v_state"), "state\nsuperseded\n");
  EXPECT_THAT(read_text(out / "report.html"), HasSubstr("Measurement NO-GO"));
}

}  // namespace
}  // namespace drape::test
