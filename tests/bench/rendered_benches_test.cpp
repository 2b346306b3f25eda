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
#include "core/rig.hpp"
#include "core/run_report.hpp"
#include "core/sheet.hpp"
#include "core/simulation_files.hpp"
#include "core/units.hpp"
#include "tests/bench/drawn_bench.hpp"
#include "tests/support/coverage.hpp"
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

Json run_rig(const fs::path& folder, const std::string& more = "--single") {
  const Outcome outcome =
      run_drape(fmt::format("run {} {} --out {} --threads 2 --json", (folder / "rig").string(),
                            more, (folder / "out").string()));
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
    if (stage == "simulate" || stage == "branches" || stage == "compare" ||
        step.at("exit_code") == 0)
      continue;
    alarms += fmt::format("{}, {}: {}\n", stage, step.at("what").get<std::string>(),
                          step.at("sentence").get<std::string>());
  }
  return alarms;
}

TEST(RenderedBenches, GiveNoAlarm) {
  const int count = trial_count(1, 20);
  int alarms = 0;
  for (int seed = first_trial(); seed < first_trial() + count; ++seed) {
    const DrawnBench bench(static_cast<std::uint64_t>(seed), BenchKind::ruler);
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

/// Place of a point of a simulated sheet, one of whose nodes it is.
Eigen::Vector3d place_of(const Sheet& sheet, const Eigen::Vector2d& material_m) {
  for (const SheetMark& node : sheet.marks)
    if ((node.material_m - material_m).norm() < 1e-3 * units::mm) return node.point_in_world;
  throw std::runtime_error("a simulated sheet lacks a node at a mark");
}

enum class Marks { compared, all };

/// Mean distance of the marks of two simulated sheets, over those that the run compares or all.
double mean_apart_m(const ReportedDrape& found, const auto& first, const auto& second,
                    Marks marks = Marks::compared) {
  double sum_m = 0;
  int count = 0;
  for (const ReportedMark& mark : found.marks) {
    if (!mark.distance_m && marks == Marks::compared) continue;
    sum_m += (first(mark) - second(mark)).norm();
    ++count;
  }
  return sum_m / count;
}

/// U of a whole run against the mean distance that the model has with the true values. Every value
/// that the budget lists is stated with an error; the true one has a finer mesh and more segments.
/// U holds for the branch compared: a run whose cloth rests on another branch than the model with
/// the true values is counted apart. Limits: false alarms none; where d > 2 U the binomial 95 %
/// interval of the share inside holds 95 %, elsewhere it reaches 93 %.
TEST(RenderedBenches, HaveTheirTrueMeanWithinU) {
  constexpr double kSameBranch_m = 5 * units::mm;
  const int count = trial_count(1, 30);
  Coverage far, near, inputs, of_print, elsewhere;
  int alarms = 0, incomplete = 0;
  for (int seed = first_trial(); seed < first_trial() + count; ++seed) {
    const DrawnBench bench(static_cast<std::uint64_t>(seed), BenchKind::all_values);
    const TemporaryFolder folder;
    bench.make(folder.path());
    const std::string alarm = alarms_in(run_rig(folder.path(), ""));
    EXPECT_EQ(alarm, "") << bench.describe();
    alarms += !alarm.empty();
    const auto report = read_record<RunReport>(folder.path() / "out/report.json");
    const ReportedDrape& found = report.drapes.at(0);
    fmt::print("bench {}: {}\n", seed, bench.describe());
    if (!found.budget || !found.distance) {
      ++incomplete;
      fmt::print("  nothing compared: {}\n", found.why);
      continue;
    }
    const Sheet model = read_sheet(folder.path() / "true/model/sheet.ply");
    const fs::path cloth = folder.path() / "true/out/D0/sheet.ply";
    const Sheet real = fs::exists(cloth) ? read_sheet(cloth) : model;
    const Print print = read_print(folder.path() / "true/print.toml");
    const auto in = [&print](const Sheet& sheet) {
      return [&](const ReportedMark& mark) {
        return place_of(sheet, print.material_m({mark.row, mark.col}));
      };
    };
    const double d_m = found.distance->mean_m, u_m = found.budget->expanded_m,
                 true_m = mean_apart_m(found, in(real), in(model)),
                 of_print_m = mean_apart_m(found, in(real), in(model), Marks::all),
                 moved_m = mean_apart_m(
                     found, [](const ReportedMark&mark) { return *mark.virtual_in_world; },
                     in(model)),
                 linked_m = read_record<BranchList>(folder.path() / "out/D0/ensemble/branches.json")
                                .linked_m;
    const bool same = moved_m <= std::max(kSameBranch_m, linked_m),
               held = std::abs(d_m - true_m) <= u_m;
    incomplete += !found.budget->missing.empty();
    fmt::print("  {} marks: d {:.3f} mm, true {:.3f} ({:.3f} of all marks), U {:.3f}: {}\n",
               found.distance->marks, d_m / units::mm, true_m / units::mm, of_print_m / units::mm,
               u_m / units::mm, held ? "inside" : "OUTSIDE");
    fmt::print("  inputs {:.3f} mm, own error {:.3f}; the model's marks moved by {:.3f} mm{};{}\n",
               found.budget->inputs_m / units::mm, found.budget->own_m / units::mm,
               moved_m / units::mm, same ? "" : ", another branch",
               found.budget->missing.empty() ? "" : " lacks " + found.budget->missing.front());
    for (const BudgetLine& line : found.budget->lines)
      if (line.u_m > 0.3 * found.budget->lines.front().u_m)
        fmt::print("    {}: {:.3f} mm\n", line.what, line.u_m / units::mm);
    std::fflush(stdout);
    if (!same) {
      elsewhere.add(held);
      continue;
    }
    (d_m > 2 * u_m ? far : near).add(held);
    inputs.add(std::abs(d_m - true_m) <= found.budget->inputs_m);
    of_print.add(std::abs(d_m - of_print_m) <= u_m);
  }
  fmt::print("{} of {} benches with an alarm, {} without a whole budget\n", alarms, count,
             incomplete);
  far.print("U holds the true mean, d > 2 U");
  near.print("U holds the true mean, else");
  inputs.print("the inputs' part alone");
  of_print.print("U holds the true mean of all marks");
  elsewhere.print("on another branch, not counted");
  EXPECT_TRUE(far.holds_95()) << far.part();
  EXPECT_GE(near.most(), 0.93) << near.part();
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
  const DrawnBench bench(2, BenchKind::plates);
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
