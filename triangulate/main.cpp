// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "core/files/files.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/program/words.hpp"
#include "core/scene.hpp"
#include "core/units.hpp"
#include "triangulate/guards/guards.hpp"
#include "triangulate/plate/plate.hpp"
#include "triangulate/points.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {

namespace fs = std::filesystem;
using units::mm;

namespace {

/// Makes the ending NO-GO for the first of these causes, if there are any.
void refuse(Ending& ending, const std::vector<std::string>& causes) {
  for (const std::string& cause : causes) {
    if (ending.go)
      ending.verdict = cause;
    else
      ending.warnings.push_back("NO-GO also because " + cause);
    ending.go = false;
  }
}

/// One sentence for each value that contradicts the scene; `name` is the object's.
std::vector<std::string> contradictions_of(const std::vector<ObjectValue>& values,
                                           const std::string& name) {
  std::vector<std::string> found;
  for (const ObjectValue& value : values)
    if (value.contradicts())
      found.push_back(fmt::format("{}: {} = {:g} is not where the plate lies; write {} = {:.2f}",
                                  name, value.key, value.stated, value.key, value.measured));
  return found;
}

/// Ending of the measurement, NO-GO if something contradicts it; `name` is the object's.
Ending ending_of(const std::vector<ObjectValue>& values, const PlatePose& plate,
                 const std::string& name, const std::vector<std::string>& against) {
  Ending ending;
  ending.verdict = name + ": its stated place is the one measured";
  for (const ObjectValue& value : values)
    ending.numbers.emplace_back(
        value.key,
        fmt::format("{:.3f} +- {:.3f}, stated {:g} +- {:.3g} (one standard uncertainty)",
                    value.measured, value.uncertainty, value.stated, value.stated_uncertainty));
  refuse(ending, against);
  ending.numbers.emplace_back(
      "plate", fmt::format("{} dots, {} views, {:.4f} px RMS, {:.2f} of what their noise predicts",
                           plate.dots, plate.views, plate.rms_px, std::sqrt(plate.chi2_per_dof)));
  const Tilt tilt = tilt_of(plate);
  if (tilt.rad > 3 * tilt.uncertainty_rad)
    ending.warnings.push_back(fmt::format("the plate is tilted by {:.2f} +- {:.2f} degrees",
                                          tilt.rad / units::deg,
                                          tilt.uncertainty_rad / units::deg));
  ending.advice = {
      fmt::format("in the scene: place_uncertainty_mm = {:.2f}", place_uncertainty_mm(values))};
  return ending;
}

struct ObjectArguments {
  fs::path detections, calibration, scene, out;
  std::optional<fs::path> scene_out;
  std::string set;
  int object = 1;
  double floor_px = 0;
  PlateOnObject lies;
};

void fields(Fields& f, ObjectArguments& a) {
  f(Field{"detections", "detections.json of the plate"}.called("DETECTIONS"), a.detections);
  f({"calibration", "calibration.json of the rig"}, a.calibration);
  f({"set", "frame set that shows the plate"}, a.set);
  f({"scene", "scene.toml that states the object"}, a.scene);
  f.otherwise({"object", "number of the object in the scene, from 1", 1, 1}, a.object);
  fields(f, a.lies);
  f.otherwise({"floor_px", "error of a dot's centre beyond its detection's own, px", 1, 0},
              a.floor_px);
  f.if_any({"scene_out", "scene.toml to write: the scene with the object at its measured position"},
           a.scene_out);
  f({"out", "object.json to write"}, a.out);
}

/// Number of gaps by kind of reason, without figures and details, which are in the file.
std::map<std::string, int> gaps_by_kind(const Sheet& sheet) {
  std::map<std::string, int> kinds;
  for (const Gap& gap : sheet.gaps) {
    const std::size_t end = std::min(gap.reason.find(';'), gap.reason.find(':'));
    ++kinds[gap.reason.substr(0, end)];
  }
  return kinds;
}

std::string views_text(const std::vector<int>& marks_by_views) {
  std::string text;
  for (std::size_t views = 0; views < marks_by_views.size(); ++views) {
    if (marks_by_views[views] == 0) continue;
    text +=
        fmt::format("{}{} mark{} from {} view{}", text.empty() ? "" : ", ", marks_by_views[views],
                    marks_by_views[views] == 1 ? "" : "s", views, views == 1 ? "" : "s");
  }
  return text.empty() ? "none" : text;
}

std::string pairs_text(const TriangulateReport& report) {
  std::string text = "miss each other by";
  for (const PairAgreement& pair : report.pairs) {
    text += fmt::format("{} {:.2f} sigma ({}, {})", &pair == &report.pairs.front() ? "" : ",",
                        pair.median_sigmas, pair.first, pair.second);
  }
  return text + fmt::format(", limit {:g}", PairAgreement::max_sigmas);
}

std::string budget_text(const ErrorBudget& budget) {
  return fmt::format(
      "{:.4f} mm RMS in space: detection {:.4f}, calibration {}{}, dot shape {:.4f} mm",
      budget.total_m / mm, budget.detection_m / mm,
      budget.calibration_m ? fmt::format("{:.4f}", *budget.calibration_m / mm) : "unknown",
      budget.target_m ? fmt::format(" (target {:.4f})", *budget.target_m / mm) : "",
      budget.dot_shape_m / mm);
}

/// Names the worst marks, worst first, and counts the rest.
std::string worst_of(std::vector<std::pair<double, MarkId>> marks, const std::string& unit) {
  constexpr std::size_t kNamed = 5;
  std::stable_sort(marks.begin(), marks.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string text;
  for (std::size_t i = 0; i < std::min(kNamed, marks.size()); ++i)
    text += fmt::format("{} {} at ({}, {})", i == 0 ? "" : ",",
                        fmt::format(fmt::runtime(unit), marks[i].first), marks[i].second.row,
                        marks[i].second.col);
  if (marks.size() > kNamed) text += fmt::format(" and {} more", marks.size() - kNamed);
  return text;
}

/// Adds one line for each reason.
void add_doubts(Ending& ending, const std::vector<Doubt>& doubts,
                const TriangulateOptions& options) {
  std::vector<std::pair<double, MarkId>> uncertain, apart;
  for (const Doubt& doubt : doubts) {
    if (doubt.sigma_mm) uncertain.emplace_back(*doubt.sigma_mm, doubt.mark);
    if (doubt.sigmas) apart.emplace_back(*doubt.sigmas, doubt.mark);
  }
  if (!uncertain.empty()) {
    ending.warnings.push_back(fmt::format(
        "doubtful, but measured: {} mark{} less certain than {:g} mm in space:{}", uncertain.size(),
        uncertain.size() == 1 ? "" : "s", options.doubt_mm, worst_of(uncertain, "{:.3f} mm")));
  }
  if (!apart.empty()) {
    ending.warnings.push_back(fmt::format(
        "doubtful, but measured: {} mark{} whose views miss each other by more than {:g} sigma:{}",
        apart.size(), apart.size() == 1 ? "" : "s", options.doubt_sigmas,
        worst_of(apart, "{:.1f} sigma")));
  }
}

/// Ending of the measurement, NO-GO if something contradicts it; `name` is the object's.
Ending ending_of(const TriangulateResult& result, const TriangulateOptions& options,
                 const std::filesystem::path& out) {
  const TriangulateReport& report = result.report;
  Ending ending;
  ending.verdict = fmt::format("{} marks measured, {} gap{}", report.measured, report.gaps,
                               report.gaps == 1 ? "" : "s");
  refuse(ending, report.no_go);
  ending.numbers = {
      {"views", views_text(report.marks_by_views)},
      {"median reprojection", fmt::format("{:.4f} px RMS", report.median_reprojection_px)},
      {"median uncertainty",
       fmt::format("{:.4f} mm per axis, of which calibration {}", report.median_sigma_mm,
                   report.has_calibration_covariance
                       ? fmt::format("{:.4f} mm", report.median_calibration_sigma_mm)
                       : "unknown (no covariance in the file)")},
      {"agreement of the views",
       fmt::format("{:.2f} of what the uncertainty predicts (median)", report.median_chi_per_dof)},
      {"correction of dot shape",
       fmt::format("median {:.4f} mm, largest {:.4f} mm", report.median_shape_shift_mm,
                   report.largest_shape_shift_mm)}};
  if (result.sheet.error_budget)
    ending.numbers.emplace_back("error budget", budget_text(*result.sheet.error_budget));
  if (!report.pairs.empty()) ending.numbers.emplace_back("pairs of cameras", pairs_text(report));
  for (const Unseen& unseen : report.unseen)
    ending.numbers.emplace_back("unseen errors, " + unseen.of, unseen.limits);
  if (report.islands > 0) {
    ending.numbers.emplace_back(
        "islands", fmt::format("{} of {} pieces without labels merged, {} dots",
                               report.merged_islands, report.islands, report.merged_dots));
  }
  for (const auto& [kind, count] : gaps_by_kind(result.sheet))
    ending.rejected.push_back(fmt::format("{} mark{}: {}", count, count == 1 ? "" : "s", kind));
  add_doubts(ending, report.doubts, options);
  for (const std::string& view : report.dropped_views) ending.rejected.push_back(view);
  for (const std::string& fate : report.island_fates) ending.rejected.push_back(fate);
  ending.warnings.insert(ending.warnings.end(), report.warnings.begin(), report.warnings.end());
  if (ending.go) {
    ending.next_command =
        fmt::format("drape simulate SCENE.toml --segments 5 --start-from {} --out DIR",
                    shell_word(out.string()));
  }
  return ending;
}

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
  ending.verdict = fmt::format("{} of {} marks from {} points of {}", sheet.marks.size(),
                               sheet.rows * sheet.cols, cloud.points.size(), cloud.instrument);
  refuse(ending, no_go);
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

struct TriangulateArguments {
  fs::path detections, calibration, out;
  std::optional<fs::path> scene;
  std::vector<fs::path> objects, others;
  std::string set;
  std::optional<std::string> repeat, face;
  TriangulateOptions options;
};

void fields(Fields& f, TriangulateArguments& a) {
  f(Field{"detections", "detections.json of the cloth"}.called("DETECTIONS"), a.detections);
  f({"calibration", "calibration.json of the rig"}, a.calibration);
  f({"set", "frame set to measure"}, a.set);
  f.if_any({"scene", "scene.toml: NO-GO if the marks contradict its objects, table or fabric"},
           a.scene);
  f.if_any(Field{"object",
                 "object.json of a tag plate (drape object): NO-GO if it contradicts the scene"}
               .per_flag(),
           a.objects);
  f.if_any(Field{"repeat", "name of this laying of the drape, kept in the sheet; needs --scene"}
               .plain_name(),
           a.repeat);
  f.if_any(Field{"other_scene", "another scene of the rig: named if the marks agree only with it"}
               .per_flag(),
           a.others);
  f.if_any({"face", "side of the cloth that faces up; with --repeat"}, a.face);
  f({"out", "sheet.ply to write, with sheet.json beside it"}, a.out);
  fields(f, a.options);
}

/// True if the marks of the set do not contradict another scene with the same print.
bool agrees_with_other(const Detections& detections, const Calibration& calibration,
                       const std::string& set, const TriangulateOptions& other) {
  try {
    require_detected_print(detections.lattice, *other.scene);
  } catch (const Error&) {
    return false;
  }
  return drape::triangulate::triangulate(detections, calibration, set, other).report.no_go.empty();
}

}  // namespace

int object_command(int argc, char** argv) {
  const auto run = [](const ObjectArguments& given, const std::vector<std::string>& words,
                      const CommonOptions& common) {
    StepFiles files{{given.out}, {given.detections, given.calibration, given.scene}};
    if (given.scene_out) {
      require_own_scene(*given.scene_out);
      files.outputs.push_back(*given.scene_out);
    }
    RunRecord record("drape-triangulate", words, run_record_path(given.out), files);
    const Scene scene = read_scene(given.scene);
    const auto index = static_cast<std::size_t>(given.object) - 1;
    if (index >= scene.obstacles.size())
      throw usage_error(fmt::format("the scene has {} objects", scene.obstacles.size()),
                        "give --object from 1 on");
    const Detections detections = read_detections(given.detections);
    const Calibration calibration = read_calibration(given.calibration);
    const PlatePose plate = plate_pose(detections, calibration, given.set, given.floor_px);
    const auto values =
        object_values(plate, given.lies, scene.obstacles[index], scene.uncertainty_of(index));
    const std::string name = fmt::format("{}, object {}", given.scene.string(), given.object);
    std::vector<std::string> against;
    if (calibration.no_go) against.push_back("the calibration is NO-GO: " + *calibration.no_go);
    if (const auto reason = detections.reason_against({given.set})) against.push_back(*reason);
    // A scene file cannot state that a position comes from a NO-GO measurement.
    if (given.scene_out && !against.empty())
      throw bad_input("no scene is written from a place that is not measured: " + against.front(),
                      {.file = given.detections.string(), .set = given.set},
                      "mend that first, or leave --scene-out out to see the place");
    for (const std::string& text : contradictions_of(values, name)) against.push_back(text);
    if (const auto why = why_not_edge_on_edge(detections.lattice, given.lies,
                                              scene.obstacles[index], scene.uncertainty_of(index)))
      against.push_back(name + ": " + *why);
    write_record(given.out,
                 MeasuredObject{values, against, plate.dots, plate.rms_px, plate.chi2_per_dof});
    if (given.scene_out) {
      write_durable(*given.scene_out, measured_scene(given.scene, index + 1, values,
                                                     fs::absolute(*given.scene_out).parent_path()));
      // Reads the new scene, edited line by line, to detect an unexpected layout.
      static_cast<void>(read_scene(*given.scene_out));
    }
    record.option("set", given.set);
    return finish(ending_of(values, plate, name, against), common, record);
  };
  return run_command<ObjectArguments>(
      argc, argv, "drape-triangulate object",
      "Measures the position of an object from a set that shows it with its plate of tags and "
      "without cloth "
      "(`drape print object-tags`).\nNO-GO where the scene states another place.\n\n"
      "  drape object C/plate.json --calibration calibration.json --set object_C --scene C.toml",
      run);
}

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

int triangulate_command(int argc, char** argv) {
  const auto run = [](TriangulateArguments& given, const std::vector<std::string>& words,
                      const CommonOptions& common) {
    TriangulateOptions& options = given.options;
    options.threads = thread_count(common);
    StepFiles files{{fs::path(given.out).replace_extension(".ply"),
                     fs::path(given.out).replace_extension(".json")},
                    {given.detections, given.calibration}};
    if (given.scene) files.inputs.push_back(*given.scene);
    files.inputs.insert(files.inputs.end(), given.objects.begin(), given.objects.end());
    RunRecord record("drape-triangulate", words, run_record_path(given.out), files);
    if (given.scene) options.scene = read_scene(*given.scene);
    for (const Obstacle& object :
         options.scene ? options.scene->obstacles : std::vector<Obstacle>{})
      if (const auto* mesh = std::get_if<MeshObject>(&object)) record.input(mesh->file);
    if (given.repeat ? !given.scene : given.face.has_value())
      throw usage_error("a repeat is named without its drape", "give --repeat, --scene and --face");
    for (const fs::path& file : given.objects)
      for (const std::string& text : read_record<MeasuredObject>(file).contradictions)
        options.contradictions.push_back(text);
    const Detections detections = read_detections(given.detections);
    if (options.scene) require_detected_print(detections.lattice, *options.scene);
    const Calibration calibration = read_calibration(given.calibration);
    TriangulateResult result =
        drape::triangulate::triangulate(detections, calibration, given.set, options);
    // Other scenes are inputs only if the set's own scene is contradicted.
    if (options.scene && !result.report.no_go.empty()) {
      for (const fs::path& file : given.others) {
        TriangulateOptions other = options;
        other.scene = read_scene(file);
        record.input(file, other.scene->document.sha256());
        if (!agrees_with_other(detections, calibration, given.set, other)) continue;
        result.report.no_go.front() +=
            fmt::format("; the marks agree with {} (drape {}): which drape does set {} show?",
                        file.string(), other.scene->name, given.set);
        result.sheet.no_go = result.report.no_go.front();
      }
    }
    auto& source = std::get<MeasuredSource>(result.sheet.source);
    source.detections_sha256 = detections.document.sha256();
    source.calibration_sha256 = calibration.document.sha256();
    for (const Document* read : {&detections.document, &calibration.document})
      record.input(read->file(), read->sha256());
    if (options.scene) {
      record.input(*given.scene, options.scene->document.sha256());
      note_scene(source, *options.scene,
                 {options.scene->name, given.repeat.value_or(""), given.face.value_or("")});
    }
    write_sheet(given.out, result.sheet);
    record.option("set", given.set);
    for (const auto& [name, value] : flat(value_of(options))) record.option(name, value);
    return finish(ending_of(result, options, given.out), common, record);
  };
  return run_command<TriangulateArguments>(
      argc, argv, "drape-triangulate",
      "Triangulates the marks of a cloth from two or more calibrated views", run);
}

}  // namespace drape::triangulate

int main(int argc, char** argv) {
  using namespace drape::triangulate;
  return drape::run_stage(
      argc, argv, triangulate_command,
      {{"object", object_command, "measures the position of an object by its plate of tags"},
       {"points", points_command, "makes a sheet of points that another instrument measured"}});
}
