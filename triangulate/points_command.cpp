// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "core/rules.hpp"
#include "core/units.hpp"
#include "triangulate/ending.hpp"
#include "triangulate/guards/guards.hpp"
#include "triangulate/points.hpp"

namespace drape::triangulate {

namespace fs = std::filesystem;
using units::mm;

namespace {

struct PointsArguments {
  fs::path points, scene, out;
  std::optional<fs::path> fit;
  std::optional<double> sigma_m, correlation_m, unit_m;
  std::optional<std::string> repeat, face;
};

void fields(Fields& f, PointsArguments& a) {
  f(Field{"points", "points of another instrument: CSV (DICe's, pyALDIC-3D's), or VTU"}.called(
        "POINTS"),
    a.points);
  f({"scene", "scene.toml: NO-GO where the points contradict its objects, table or fabric"},
    a.scene);
  f.if_any({"fit", "points.toml: columns, deviation, and named points of world and cloth"}, a.fit);
  f.if_any({"sigma_mm", "standard deviation of a point along each axis", mm, above_zero},
           a.sigma_m);
  f.if_any({"correlation_mm", "length over which the errors of two points fall to 1/e", mm, 0},
           a.correlation_m);
  f.if_any({"unit_mm", "length of one unit of the file", mm, above_zero}, a.unit_m);
  f.if_any(Field{"repeat", "name of this laying of the drape"}.plain_name(), a.repeat);
  f.if_any({"face", "side of the cloth that lies up; with --repeat"}, a.face);
  f({"out", "sheet.ply to write, with sheet.json beside it"}, a.out);
}

Ending ending_of(const Sheet& sheet, const Cloud& cloud, const PointsReport& report,
                 const std::vector<std::string>& no_go, const fs::path& out) {
  Ending ending;
  ending.go = no_go.empty();
  ending.verdict = no_go.empty()
                       ? fmt::format("{} of {} marks from {} points of {}", sheet.marks.size(),
                                     sheet.rows * sheet.cols, cloud.points.size(), cloud.instrument)
                       : no_go.front();
  for (std::size_t i = 1; i < no_go.size(); ++i)
    ending.warnings.push_back("NO-GO also because " + no_go[i]);
  ending.numbers = {
      {"marks", fmt::format("{} are points of the file, {} lie between them, {} gaps",
                            report.direct, report.fitted, sheet.gaps.size())},
      {"spacing of the points", fmt::format("{:.3g} mm on the cloth", report.spacing_m / mm)},
      {"uncertainty of a mark",
       fmt::format("{:.4f} mm in space (RMS), {:.4f} mm of it common to all marks",
                   sheet.error_budget->total_m / mm, *sheet.error_budget->calibration_m / mm)}};
  for (const auto& [what, rms_m] :
       {std::pair{"world", report.world_rms_m}, std::pair{"cloth", report.cloth_rms_m}})
    if (rms_m)
      ending.numbers.emplace_back(fmt::format("fit to the {}", what),
                                  fmt::format("RMS {:.4f} mm", *rms_m / mm));
  if (!report.world_rms_m)
    ending.warnings.emplace_back(
        "no point is named in the world: the file's frame is taken for it");
  if (cloud.left_out > 0)
    ending.rejected.push_back(
        fmt::format("{} points that the instrument calls failed", cloud.left_out));
  if (!sheet.gaps.empty())
    ending.rejected.push_back(
        fmt::format("{} marks: {}", sheet.gaps.size(), sheet.gaps.front().reason));
  if (ending.go)
    ending.next_command = fmt::format("drape compare {} SIMULATED/sheet.ply --store STORE.sqlite",
                                      shell_word(out.string()));
  return ending;
}

}  // namespace

int points_command(int argc, char** argv) {
  const auto run = [](PointsArguments& given, const std::vector<std::string>& words,
                      const CommonOptions& common) {
    StepFiles files{{fs::path(given.out).replace_extension(".ply"),
                     fs::path(given.out).replace_extension(".json")},
                    {given.points, given.scene}};
    if (given.fit) files.inputs.push_back(*given.fit);
    RunRecord record("drape-triangulate", words, run_record_path(given.out), files);
    if (given.face.has_value() != given.repeat.has_value())
      throw usage_error("a repeat is named without its face", "give --repeat and --face");
    PointsDescription description;
    if (given.fit) description = read_record<PointsDescription>(*given.fit);
    if (given.sigma_m) description.sigma_m = given.sigma_m;
    if (given.correlation_m) description.correlation_m = *given.correlation_m;
    if (given.unit_m) description.unit_m = *given.unit_m;
    const Scene scene = read_scene(given.scene);
    const Cloud cloud = read_cloud(given.points, description);
    PointsReport report;
    Sheet sheet = sheet_of_points(cloud, description, scene, report);
    auto& source = std::get<MeasuredSource>(sheet.source);
    source.detections_sha256 = sha256_of_file(given.points);
    note_scene(source, scene, {scene.name, given.repeat.value_or(""), given.face.value_or("")});
    std::vector<std::string> no_go;
    if (sheet.marks.size() < 9)
      no_go.push_back(fmt::format("only {} marks have points around them", sheet.marks.size()));
    TriangulateOptions options;
    options.threads = thread_count(common);
    options.scene = scene;
    const Print print = print_of(scene);
    const MarkLattice lattice{Surface::cloth,       print.rows,    print.cols,     print.pitch_m,
                              print.dot_diameter_m, print.patch_m, print.margin_m, ""};
    if (no_go.empty()) no_go = contradictions_of_sheet(lattice, options, sheet.marks, sheet);
    if (!no_go.empty()) sheet.no_go = no_go.front();
    record.input(given.points, source.detections_sha256);
    record.input(given.scene, scene.document.sha256());
    if (given.fit) record.input(*given.fit, description.document.sha256());
    write_sheet(given.out, sheet);
    return finish(ending_of(sheet, cloud, report, no_go, given.out), common, record);
  };
  return run_command<PointsArguments>(
      argc, argv, "drape-triangulate points",
      "Makes a measured sheet of points that another instrument measured", run);
}

}  // namespace drape::triangulate
