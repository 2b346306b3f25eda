// SPDX-License-Identifier: Apache-2.0
// Mistakes of an operator, one at a time on bench1: each is reported with its file, its key and, if
// the data show it, the value, and none exits with 0. Mistakes in numbers that only the pictures
// contradict end in NO-GO (1), all others before any work (3).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/ranges.h>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/prints/face.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "tests/faults/operator_mistakes.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {

void PrintTo(const Mistake& mistake, std::ostream* out) {
  *out << mistake.name;
}

}  // namespace drape::test

namespace {

namespace fs = std::filesystem;
using drape::test::Mistake;
using drape::test::Outcome;
using drape::test::SmallBench;
using testing::HasSubstr;

class OperatorMistake : public testing::TestWithParam<Mistake> {};

TEST_P(OperatorMistake, IsNamedBeforeItCostsADay) {
  const SmallBench bench({GetParam().scene});
  if (GetParam().exit_code == 1)
    // Detections and calibration of the unchanged bench remain valid in a copy.
    drape::test::copy_finished_bench(bench.folder() / "out");
  GetParam().make(bench);
  const Outcome outcome = bench.run("out");
  EXPECT_EQ(outcome.exit_code, GetParam().exit_code) << outcome.text;
  for (const std::string& part : GetParam().named) EXPECT_THAT(outcome.text, HasSubstr(part));
  if (GetParam().exit_code != 1) return;
  // Results based on a NO-GO are NO-GO: title and verdict of the report, and the store's lists.
  if (!fs::exists(bench.folder() / "out/report.html")) return;  // nothing could be compared
  const std::string report = drape::read_text(bench.folder() / "out/report.html");
  EXPECT_THAT(report, HasSubstr("<title>Real and virtual drapes: measurement NO-GO"));
  EXPECT_THAT(report, HasSubstr("\"go\":false"));
  const std::string results = "cd " + bench.folder().string() + " && " +
                              drape::test::program("drape-results").string() +
                              " --store out/results.sqlite ";
  EXPECT_THAT(drape::test::run_line(results + "runs").text, HasSubstr("NO-GO"));
  const std::string compared =
      "--quiet --csv sql 'SELECT count(*) FROM run_comparison WHERE run = (SELECT max(number) FROM "
      "run)'";
  if (drape::test::run_line(results + compared).text.ends_with("\n0\n")) return;
  EXPECT_THAT(drape::test::run_line(results + "tables").text, HasSubstr("measurement NO-GO"));
  EXPECT_THAT(drape::test::run_line(results + "list").text, HasSubstr("NO-GO"));
}

INSTANTIATE_TEST_SUITE_P(Bench1, OperatorMistake,
                         testing::ValuesIn(drape::test::operator_mistakes()),
                         [](const auto& mistake) { return mistake.param.name; });

/// Few fabrics weigh 800 g/m2, but some do: a warning, not a refusal.
TEST(RareFabric, IsCheckedWithAWarning) {
  const drape::test::TemporaryFolder folder;
  const fs::path rig = folder.path() / "paper", fabric = rig / "fabrics/A.toml";
  fs::copy(drape::test::source_root() / "rigs/paper", rig, fs::copy_options::recursive);
  std::string text = drape::read_text(fabric);
  const std::string weight = "areal_density_g_per_m2 = 138";
  text.replace(text.find(weight), weight.size(), "areal_density_g_per_m2 = 800");
  drape::write_durable(fabric, text);
  const Outcome outcome =
      drape::test::run_line(drape::test::program("drape").string() + " check " + rig.string());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
  EXPECT_THAT(outcome.text, HasSubstr("areal density of 800 g/m2"));
  EXPECT_THAT(outcome.text, HasSubstr("bending.weft: bending stiffness 0.059"));
}

TEST(KnownTagFamilies, AreThoseOfDetect) {
  std::vector<std::string> known;
  for (const auto& [family, count] : drape::known_tag_families()) {
    known.push_back(family);
    EXPECT_EQ(drape::TagFamily(family).count(), count) << family;
  }
  try {
    const drape::TagFamily family("none");
    FAIL();
  } catch (const drape::Error& error) {
    EXPECT_THAT(error.what_to_do(),
                testing::StartsWith(fmt::format("use one of {};", fmt::join(known, ", "))));
  }
}

TEST(NoMistake, GivesNoAlarm) {
  const fs::path bench = drape::test::finished_bench().folder;
  const Outcome check = drape::test::run_line(drape::test::program("drape").string() + " check " +
                                              (bench / "rig").string());
  EXPECT_EQ(check.exit_code, 0) << check.text;
  for (const char* drape : {"A", "C", "E"}) {
    const auto sheet = drape::read_sheet(bench / "out" / drape / "sheet.ply");
    EXPECT_FALSE(sheet.no_go) << drape << ": " << sheet.no_go.value_or("");
  }
}

TEST(NoMistake, GivesNoAlarmOnABenchWithoutCameras) {
  const Outcome check = drape::test::run_line(drape::test::program("drape").string() + " check " +
                                              (drape::test::source_root() / "rigs/paper").string());
  EXPECT_EQ(check.exit_code, 0) << check.text;
  EXPECT_THAT(check.text, Not(HasSubstr("warning")));
}

}  // namespace
