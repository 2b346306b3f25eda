// SPDX-License-Identifier: Apache-2.0
#include "tests/formats/formats.hpp"

#include "core/files/files.hpp"
#include "core/recording.hpp"
#include "core/run_report.hpp"
#include "core/scene.hpp"
#include "core/simulation_files.hpp"
#include "synth/synth.hpp"
#include "tests/fuzz/kinds.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

BranchList small_branches() {
  BranchList list;
  list.branches.emplace_back();
  ListedBranch& branch = list.branches.back();
  branch.number = 1;
  branch.sheet = "branch-01/sheet.ply";
  branch.starts = {0, 1};
  branch.spacing_m = 5e-3;
  branch.polish_m = 1e-4;
  list.starts = 8;
  list.unseen = UnseenBranches{.rests = 8, .seen_once = 0, .fraction = 0, .upper95 = 0.31};
  list.members_at_rest = 8;
  list.beyond_first_order =
      BeyondFirstOrder{{{0, 1}}, {{"at rest", {{{1e-4, 0, -2e-4}}}, {{{1e-4, 0, 0}}}}}};
  return list;
}

/// A report with one of everything.
RunReport small_report() {
  RunReport report;
  report.program = "drapebench 0.2.1";
  report.rig = "bench";
  report.run = 1;
  report.sentence = "measured";
  ReportedDrape drape;
  drape.name = drape.label = "A";
  drape.measurement.sigma_median_m = drape.measurement.sigma_max_m = 3e-5;
  const ReportedDistance distance{1,    2e-3, 2e-3, 2e-3, 2e-3, 2e-3,
                                  1e-5, 1e-3, 3e-3, 1e-3, 1e-3, 0.1};
  drape.distance = distance;
  drape.match.bases = {{"tolerance", Match::inside, 2, 3, "mm", 0.5, "near"}};
  drape.match.value_m = 2e-3;
  drape.match.limit_m = 3e-3;
  drape.match.error_number = 2;
  drape.match.model = ModelRest{2e-3, 1e-3, 3e-3, "friction 0.2 to 0.8", {}, 1e-3, true};
  drape.budget = Budget{{{"mesh", 1e-4, "levels.json", true, "finer", 1e-4}}, {}, 2e-4, 1e-4, 1e-4};
  drape.repeats = {{{}, "drape_A", "1", "", "", 1e-4}};
  drape.simulations = {
      {"2.5 mm", "triangles", "A", "at rest", "", 5, 1, 2.5e-3, 1e-4, false, distance}};
  drape.branch_sets = {{"5 mm", "0", "nearest is 1", {{1, 0.5, true, true, 2e-3, 1e-3}}}};
  drape.marks = {{0, 0, Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0, 0, 2e-3), 2e-3, 1e-5, 1e-5, 3,
                  Eigen::Vector3d(0, 0, 0), 1e-3, ""}};
  drape.views = {
      {"cam0", "A/cam0.jpg", 1600, 1200, {0, 0, 1600, 1200}, {{0, 0, 1, 2}}, {{1, 2}}, {{1, 2}}}};
  drape.shape = ReportedShape{1, 1, {0, 0, 0}, {0, 0, 0}};
  Table table({"a", "b_mm"}, {1});
  table.add({"one", "2"});
  table.marked_row = 0;
  drape.tables = {{"trust", "note", table}};
  report.drapes = {drape};
  report.virtual_groups = drape.tables;
  report.calibration = ReportedCalibration{
      "joint", "0", "", 7, {{"cam0", 10, 0.1, 0.2, 1e-5, {0, 0, 9, 9}, 10, 10}}, {}, {}};
  report.notes = {{Severity::asks, "kind", "A", "measure it"}};
  report.provenance.inputs = {{"A/sheet.json", "0"}};
  return report;
}

/// Files that people edit and the recording's list from rigs/bench1, the others from small records.
std::vector<DescribedFormat> core_formats() {
  const auto bench = [](const char* name) {
    return read_text(source_root() / "rigs/bench1" / name);
  };
  return {described<Rig>(bench("rig.toml")),
          described<Target>(bench("target.toml")),
          described<Print>(bench("print.toml")),
          described<Scene>(bench("scenes/C.toml")),
          described<Recording>(bench("recording/recording.json")),
          described(small_branches()),
          described(small_sheet()),
          described(small_certificate()),
          described(small_levels()),
          described(small_report()),
          described(small_sensitivity()),
          described(small_cusick()),
          described(small_detections()),
          described(small_calibration())};
}

}  // namespace

std::vector<DescribedFormat> all_formats() {
  std::vector<DescribedFormat> all;
  for (const auto& room : {core_formats(), stage_formats(), synth::synth_formats()})
    all.insert(all.end(), room.begin(), room.end());
  return all;
}

}  // namespace drape::test
