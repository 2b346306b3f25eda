// SPDX-License-Identifier: Apache-2.0
// Complete benches of random geometry, rendered and run as by an operator: if all statements hold
// within their uncertainties nothing is reported; if an object was moved, it is.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/sheet.hpp"
#include "tests/bench/drawn_bench.hpp"
#include "tests/support/small_bench.hpp"
#include "tests/support/trials.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

Outcome run_drape(const std::string& words) {
  return run_line(program("drape").string() + " " + words);
}

Json run_rig(const fs::path& folder) {
  const Outcome outcome =
      run_drape(fmt::format("run {} --single --out {} --threads 2 --json",
                            (folder / "rig").string(), (folder / "out").string()));
  const std::size_t begin = outcome.text.find("{\n");
  if (outcome.exit_code > 1 || begin == std::string::npos) throw std::runtime_error(outcome.text);
  return parse_json(outcome.text.substr(begin));
}

/// Verdicts other than GO, and warnings, of the steps that measure; simulations on a coarse grid
/// are excluded.
std::string alarms_in(const Json& run) {
  std::string alarms;
  for (const Json& step : run.at("steps")) {
    const std::string stage = step.at("stage");
    if (stage == "simulate" || stage == "compare" || step.at("exit_code") == 0) continue;
    alarms += fmt::format("{}, {}: {}\n", stage, step.at("what").get<std::string>(),
                          step.at("sentence").get<std::string>());
  }
  return alarms;
}

TEST(RenderedBenches, GiveNoAlarm) {
  const int count = trial_count(1, 20);
  int alarms = 0;
  for (int seed = first_trial(); seed < first_trial() + count; ++seed) {
    const DrawnBench bench(static_cast<std::uint64_t>(seed), false);
    const TemporaryFolder folder;
    bench.make(folder.path());
    const Outcome check = run_drape("check " + (folder.path() / "rig").string());
    EXPECT_EQ(check.exit_code, 0) << check.text;
    EXPECT_THAT(check.text, Not(HasSubstr("warning"))) << bench.describe();
    const Json run = run_rig(folder.path());
    const std::string found = alarms_in(run);
    EXPECT_EQ(found, "") << bench.describe();
    const Sheet sheet = read_sheet(folder.path() / "out/D0/sheet.ply");
    EXPECT_FALSE(sheet.no_go) << bench.describe() << "\n" << *sheet.no_go;
    EXPECT_GE(sheet.marks.size(), 10U) << bench.describe();
    alarms += !found.empty() || check.exit_code != 0 || sheet.no_go;
    fmt::print("bench {}: {}: {} marks, {}\n", seed, bench.describe(), sheet.marks.size(),
               run.at("verdict").get<std::string>());
  }
  fmt::print("{} of {} benches with an alarm\n", alarms, count);
}

double value_of(const fs::path& object_json, const std::string& key, const char* what) {
  const Json object = parse_json(read_text(object_json));
  for (const Json& value : object.at("values"))
    if (value.at("key") == key) return value.at(what);
  throw std::runtime_error(object_json.string() + " has no " + key);
}

void replace_in(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = read_text(file);
  const auto at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error(file.string() + " lacks " + from);
  write_durable(file, text.replace(at, from.size(), to));
}

TEST(RenderedBenches, PlatesShowWhereObjectsStandAndThatOneWasMoved) {
  const DrawnBench bench(2, true);
  const TemporaryFolder folder;
  bench.make(folder.path());
  EXPECT_EQ(alarms_in(run_rig(folder.path())), "") << bench.describe();
  for (std::size_t drape = 0; drape < bench.truth().objects.size(); ++drape) {
    const DrawnObject& object = bench.truth().objects[drape];
    const fs::path out = folder.path() / fmt::format("out/D{}", drape);
    const fs::path found = out / "object_1.json";
    EXPECT_NEAR(value_of(found, "x_mm", "measured"), object.x_mm, 0.1);
    EXPECT_NEAR(value_of(found, "y_mm", "measured"), object.y_mm, 0.1);
    EXPECT_NEAR(value_of(found, "z_bottom_mm", "measured"), object.z_bottom_mm, 0.1);
    if (object.is_box) {
      EXPECT_NEAR(value_of(found, "yaw_deg", "measured"), object.yaw_deg, 0.1);
    }
    EXPECT_FALSE(read_sheet(out / "sheet.ply").no_go);
  }
  // Moved by 6 mm after the operator measured it.
  for (std::size_t drape = 0; drape < bench.stated().objects.size(); ++drape) {
    const double x_mm = bench.stated().objects[drape].x_mm;
    replace_in(folder.path() / fmt::format("rig/scenes/D{}.toml", drape),
               fmt::format("x_mm = {:.6f}", x_mm), fmt::format("x_mm = {:.6f}", x_mm + 6));
  }
  const Json moved = run_rig(folder.path());
  EXPECT_EQ(moved.at("verdict"), "NO-GO");
  for (std::size_t drape = 0; drape < bench.truth().objects.size(); ++drape) {
    EXPECT_THAT(alarms_in(moved),
                HasSubstr(fmt::format("rig/scenes/D{}.toml, object 1: x_mm = ", drape)));
    EXPECT_THAT(alarms_in(moved),
                HasSubstr(fmt::format("write x_mm = {:.1f}", bench.truth().objects[drape].x_mm)));
    EXPECT_TRUE(read_sheet(folder.path() / fmt::format("out/D{}/sheet.ply", drape)).no_go);
  }
}

}  // namespace
}  // namespace drape::test
