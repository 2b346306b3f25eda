// SPDX-License-Identifier: Apache-2.0
#include "compare/store/outcome.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "compare/tables/match.hpp"

namespace drape::compare {

namespace fs = std::filesystem;
using units::mm;

namespace {

constexpr double kManyGaps = 0.05;  // fraction of the print's marks

/// The mean covers only measured marks, and U does not include the others. The warning states how
/// far the choice of marks can change the mean, if many are missing or this exceeds U.
std::optional<std::string> warning_of_gaps(const DrapeFiles& drape, const Report& report) {
  if (!report.headline || report.measurement.gaps == 0) return std::nullopt;
  const auto& interval = report.real_virtual[*report.headline].statistics.mean.bootstrap;
  const double expanded_m = report.budget ? report.budget->expanded_m : 0;
  const int marks = report.measurement.marks, gaps = report.measurement.gaps;
  if (!interval) return std::nullopt;
  if (gaps < kManyGaps * (marks + gaps) && interval->high - interval->low <= 2 * expanded_m)
    return std::nullopt;
  std::string views;
  if (drape.detections)
    for (const FrameDetections& frame : drape.detections->frames)
      if (frame.set == drape.input.measured.measured().set)
        views += fmt::format("{}{} {}", views.empty() ? " (with a label: " : ", ", frame.camera,
                             frame.detections.size());
  return fmt::format(
      "{} of {} marks of the print are not measured{}: the mean is that of the other {}, U = "
      "{:.3f} "
      "mm holds for these alone; as many marks drawn again from them give {:.2f} to {:.2f} mm "
      "(95 %), a region that is missing may move it further",
      report.measurement.gaps, marks + report.measurement.gaps, views.empty() ? "" : views + ")",
      marks, expanded_m / mm, interval->low / mm, interval->high / mm);
}

/// Names of the drapes; those of one scene are followed by repeat, set or file.
std::vector<std::string> labels_of(const std::vector<DrapeFiles>& drapes) {
  std::vector<std::string> labels;
  labels.reserve(drapes.size());
  for (const DrapeFiles& drape : drapes) labels.push_back(drape.input.name());
  for (std::size_t word = 0; word < 3; ++word) {
    const std::vector<std::string> before = labels;
    for (std::size_t i = 0; i < drapes.size(); ++i) {
      const SheetFile& sheet = drapes[i].input.measured;
      const std::string words[] = {sheet.repeat ? "repeat " + sheet.repeat->name : "",
                                   sheet.measured().set, sheet.file.string()};
      const std::string& more = words[word];
      if (!more.empty() && std::count(before.begin(), before.end(), before[i]) > 1)
        labels[i] += " (" + more + ")";
    }
  }
  return labels;
}

}  // namespace

bool Outcome::go() const {
  return reasons().empty();
}

std::vector<std::string> Outcome::reasons() const {
  std::vector<std::string> list;
  for (const Report& drape : reports)
    for (const std::string& reason : drape.no_go) list.push_back(drape.called() + ": " + reason);
  for (const VirtualGroup& group : groups)
    for (const std::string& reason : group.no_go) list.push_back(group.name + ": " + reason);
  list.insert(list.end(), not_compared.begin(), not_compared.end());
  return list;
}

std::string Outcome::sentence() const {
  const std::vector<std::string> list = reasons();
  if (!list.empty()) {
    return list.front() + (list.size() > 2 ? fmt::format(" (and {} more reasons)", list.size() - 1)
                           : list.size() == 2 ? " (and one more reason)"
                                              : "");
  }
  std::string text;
  for (const VirtualGroup& group : groups)
    text +=
        fmt::format("{}{} pairs of {}", text.empty() ? "" : ", ", group.pairs.size(), group.name);
  return "simulations compared with each other: " + text;
}

void compare_session(const Session& session, const Options& options, Outcome& outcome) {
  if (!outcome.store.empty() &&
      fs::weakly_canonical(outcome.store) == fs::weakly_canonical(outcome.report))
    throw usage_error("the report would replace the results store", "give another --report");
  for (const auto& [file, sha256] : session.read) {
    std::error_code absent;
    if (fs::equivalent(file, outcome.report, absent))
      throw usage_error(
          fmt::format("the report would replace {}, which it is made of", file.string()),
          "give another --report");
  }
  const bool bad_calibration = session.calibration && session.calibration->no_go;
  const std::vector<std::string> labels = labels_of(session.drapes);
  std::vector<const SheetFile*> layings;
  for (const DrapeFiles& drape : session.drapes) {
    layings.push_back(&drape.input.measured);
    for (const SheetFile& repeat : drape.input.repeats) layings.push_back(&repeat);
  }
  const std::vector<SameLaying> twice = layings_twice(layings);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const DrapeFiles& drape = session.drapes[i];
    outcome.reports.push_back(compare_drape(drape.input, options));
    Report& report = outcome.reports.back();
    report.label = labels[i];
    if (bad_calibration && !drape.input.measured.sheet.no_go)
      report.no_go.insert(report.no_go.begin(),
                          "the calibration is NO-GO: " + *session.calibration->no_go);
    const auto& source = drape.input.measured.measured();
    if (const auto why = outcome.not_accepted.find(source.calibration_sha256);
        why != outcome.not_accepted.end())
      report.no_go.insert(report.no_go.begin() + (bad_calibration ? 1 : 0), why->second);
    std::set<std::string> own = {drape.input.measured.sha256};
    for (const SheetFile& repeat : drape.input.repeats) own.insert(repeat.sha256);
    for (const SameLaying& one : twice)
      if (own.contains(one.first) || own.contains(one.second))
        (one.one_drape ? report.warnings : report.no_go).push_back(one.reason);
    if (report.headline)
      report.budget = budget_of(budget_inputs_of(drape.input, report, drape.error_split));
    judge_repeats(drape.input, options, report);
    judge_resolution(options, report);
    report.match = match_of(drape.input, options, report);
    if (auto warning = warning_of_gaps(drape, report))
      report.warnings.push_back(std::move(*warning));
    for (const std::string& warning : report.warnings)
      outcome.warnings.push_back(report.label + ": " + warning);
  }
  for (const auto& simulations : session.virtual_only) {
    outcome.groups.push_back(compare_virtual_group(simulations));
    judge_group(options, outcome.groups.back(), outcome.warnings);
    if (outcome.groups.back().pairs.empty()) {
      outcome.warnings.push_back(outcome.groups.back().name +
                                 ": no two simulations make a pair of the paper's tables");
    }
  }
}

namespace {

constexpr double kMicrojoule = 1e-6;

Cell in_percent(const std::optional<double>& ratio) {
  return ratio ? Cell(*ratio / units::percent) : Cell();
}
Cell low_mm(const Trust& trust) {
  return trust.bootstrap ? Cell(trust.bootstrap->low / mm) : Cell();
}
Cell high_mm(const Trust& trust) {
  return trust.bootstrap ? Cell(trust.bootstrap->high / mm) : Cell();
}

std::optional<std::string> certificate_json(const Simulation& simulation) {
  if (!simulation.certificate) return std::nullopt;
  Json json = Json::object();
  for (const auto& [name, value] : simulation.certificate->entries) json[name] = value;
  return json.dump();
}

/// Hash of a text that is followed by lines.
std::string hash_with(std::string text, const auto& lines) {
  for (const std::string& line : lines) text += line + "\n";
  return sha256_of(std::string_view(text));
}

/// Key of a comparison: hash of the sheets' hashes and the version of the metrics.
std::string comparison_key(const std::vector<std::string>& sheet_hashes) {
  return hash_with(fmt::format("drapebench/comparison/{}\n", metrics_version()), sheet_hashes);
}

std::string key_of(const DrapeInput& input, const RealVirtual& row) {
  return comparison_key({input.measured.sha256, input.simulations[row.simulation].sheet.sha256});
}

void insert_mark(Writer& writer, const std::string& comparison, const MarkError& mark) {
  const Eigen::Vector3d real = mark.real_in_world / mm, simulated = mark.virtual_in_world / mm;
  const Eigen::Vector3d parts = mark.warp_weft_normal_m / mm;
  writer.insert("mark_error", comparison, mark.mark.row, mark.mark.col, mark.material_m.x() / mm,
                mark.material_m.y() / mm, real.x(), real.y(), real.z(), simulated.x(),
                simulated.y(), simulated.z(), mark.distance_m / mm, parts.x(), parts.y(), parts.z(),
                in_mm(mark.sigma_mark_m), in_mm(mark.sigma_distance_m), mark.views);
}

void insert_comparison(Writer& writer, const std::string& key, const DrapeInput& input,
                       const RealVirtual& row) {
  const DistanceStatistics& s = row.statistics;
  const NormalStatistics& n = row.normal;
  const Eigen::Vector2d percent = percent_of_patch(s.mean_m, input.measured.sheet.patch_m);
  Cells cells;
  const auto add = [&](const auto&... values) { (cells.emplace_back(values), ...); };
  add(key, input.measured.sha256, input.simulations[row.simulation].sheet.sha256);
  add(metrics_version(), s.marks, row.marks.excluded.size());
  add(s.mean_m / mm, in_mm(s.sigma_mean_m), s.median_m / mm, s.rms_m / mm, s.p95_m / mm);
  add(s.max_m / mm, s.worst_mark.row, s.worst_mark.col, percent.x(), percent.y());
  add(low_mm(s.mean), high_mm(s.mean));
  for (const Trust* trust : {&s.median, &s.rms, &s.p95, &s.max})
    add(in_mm(trust->sigma_m), low_mm(*trust), high_mm(*trust));
  add(n.mean_m / mm, in_mm(n.mean.sigma_m), low_mm(n.mean), high_mm(n.mean), n.rms_m / mm);
  add(row.to_surface.mean_m / mm, row.to_surface.max_m / mm);
  const RigidAlignment move = row.aligned.value_or(RigidAlignment());
  for (const double value : {move.after.mean_m / mm, move.after.rms_m / mm, move.after.max_m / mm,
                             move.centroid_shift_m / mm, move.turn_rad / units::deg})
    add(row.aligned ? Cell(value) : Cell());
  for (const auto& ratio :
       {row.strain.difference.warp, row.strain.difference.weft, row.strain.difference.area})
    add(in_percent(ratio));
  writer.insert_row(listed_table("comparison"), cells);
  for (const MarkError& mark : row.marks.marks) insert_mark(writer, key, mark);
}

void insert_calibration(Writer& writer, const std::string& sha256, const std::string& rig) {
  writer.insert("rig", rig);
  writer.insert("calibration", sha256, rig);
}

void insert_drapemeter(Writer& writer, const std::string& sheet, const DrapemeterResult& result) {
  if (!result.value) return;
  constexpr double mm2 = mm * mm;
  const Drapemeter& d = *result.value;
  if (!writer.insert("drapemeter", sheet, d.centre_in_world.x() / mm, d.centre_in_world.y() / mm,
                     d.covered_area_m2 / mm2, d.flat_area_m2 / mm2, in_percent(d.drape_coefficient),
                     d.mean_radius_m / mm, d.folds, d.fold_depth_m / mm))
    return;
  for (const Harmonic& harmonic : d.spectrum)
    writer.insert("hem_harmonic", sheet, harmonic.order, harmonic.amplitude_m / mm,
                  harmonic.phase_rad / units::deg);
}

void insert_measured(Writer& writer, const SheetFile& file, const Measurement& measurement,
                     const std::optional<RecordingId>& recording) {
  const Sheet& sheet = file.sheet;
  const MeasuredSource& source = file.measured();
  insert_calibration(writer, source.calibration_sha256, source.rig);
  if (recording) writer.insert("recording", recording->sha256, recording->recorded_on);
  if (!writer.insert("sheet", file.sha256, "measured", sheet.rows, sheet.cols,
                     sheet.patch_m.x() / mm, sheet.patch_m.y() / mm, measurement.marks,
                     measurement.gaps, source.rig, source.set, source.calibration_sha256,
                     source.detections_sha256, recording ? Cell(recording->sha256) : Cell(),
                     in_mm(measurement.sigma_median_m), in_mm(measurement.sigma_max_m)))
    return;
  for (const Gap& gap : sheet.gaps)
    writer.insert("gap", file.sha256, gap.mark.row, gap.mark.col, gap.reason);
}

bool insert_simulated(Writer& writer, const Simulation& simulation) {
  const Sheet& sheet = simulation.sheet.sheet;
  const SimulatedSource& source = simulation.source();
  const bool own = !simulation.other_simulator;
  const auto if_own = [&](Cell value) { return own ? std::move(value) : Cell(); };
  const auto if_grid = [&](int size) { return simulation.is_grid() ? Cell(size) : Cell(); };
  if (own) writer.insert("fabric", source.fabric_sha256, source.fabric);
  const std::string& key = simulation.sheet.sha256;
  const bool fresh =
      writer.insert("sheet", key, "simulated", sheet.rows, sheet.cols, sheet.patch_m.x() / mm,
                    sheet.patch_m.y() / mm, sheet.marks.size(), sheet.gaps.size());
  writer.insert("simulation", key, simulation.other_simulator.value_or("drapebench"), source.scene,
                if_own(source.scene_sha256), if_own(source.fabric_sha256),
                own ? Cell() : Cell(source.fabric), source.start_sha256, if_grid(sheet.rows),
                if_grid(sheet.cols), simulation.segments(), source.model,
                source.solver.empty() ? Cell() : Cell(source.solver), source.status,
                if_own(source.status == "at rest"),
                simulation.certificate ? Cell(simulation.certificate->sha256) : Cell(),
                certificate_json(simulation), in_mm(source.spacing_m),
                source.from_measured ? Cell(1) : Cell());
  if (const auto& b = simulation.branch)
    writer.insert("branch", key, b->set_sha256, b->number, b->of, b->energy_j / kMicrojoule,
                  b->residual, b->stable, b->starts.size(), b->hem_nodes, b->round);
  return fresh;
}

bool add_comparison(Writer& writer, const DrapeInput& input, const RealVirtual& row,
                    const std::optional<TurnedDistance>& turned = {}) {
  const std::string key = key_of(input, row);
  const bool fresh = !writer.has("comparison", key);
  if (fresh) insert_comparison(writer, key, input, row);
  if (turned)
    writer.insert("branch_turn", key, turned->axis_in_world.x() / mm,
                  turned->axis_in_world.y() / mm, turned->mean_m / mm,
                  turned->turn_rad / units::deg, turned->half_turn);
  return fresh;
}

bool insert_surface(Writer& writer, const DrapeInput& input, const RealSurface& row) {
  const OtherSurface& surface = input.surfaces[row.surface];
  const DistanceStatistics& s = row.to_surface;
  const auto& both = row.both_directions;
  const OneDirection there = both ? both->first_to_second : OneDirection(),
                     back = both ? both->second_to_first : OneDirection();
  const auto known = [&](double length_m) { return both ? Cell(length_m / mm) : Cell(); };
  return writer.insert(
      "surface_comparison",
      comparison_key({input.measured.sha256, "surface without marks", surface.sha256}),
      input.measured.sha256, surface.sha256, surface.simulator, surface.scene, surface.fabric,
      metrics_version(), surface.mesh.points.size(), surface.mesh.triangles.size(), s.marks,
      s.mean_m / mm, in_mm(s.mean.sigma_m), low_mm(s.mean), high_mm(s.mean), s.rms_m / mm,
      s.p95_m / mm, s.max_m / mm, known(there.mean_m), known(there.hausdorff_m), known(back.mean_m),
      known(back.hausdorff_m));
}

bool insert_pair(Writer& writer, const std::optional<std::string>& measured,
                 const std::vector<Simulation>& simulations, bool gaps_filled,
                 const VirtualVirtual& row) {
  const std::string &first = simulations[row.first].sheet.sha256,
                    &second = simulations[row.second].sheet.sha256;
  const DistanceStatistics& s = row.statistics;
  return writer.insert(
      "simulation_pair", comparison_key({measured.value_or("no real cloth"), first, second}),
      measured, first, second, row.label, row.paper_order, metrics_version(), s.marks, gaps_filled,
      s.mean_m / mm, s.median_m / mm, s.rms_m / mm, s.p95_m / mm, s.max_m / mm, low_mm(s.mean),
      high_mm(s.mean), row.surface.mean_m() / mm, row.surface.hausdorff_m() / mm);
}

/// Adds the values of a TOML file; `stand_ins` marks the keys listed as stand-ins.
void add_file(const std::string& owner, const fs::path& file, std::vector<RunValue>& values) {
  if (!fs::is_regular_file(file)) return;
  const Document document = Document::read(file);
  std::vector<std::string> stand_ins;
  if (const Value* list = document.root().find("stand_ins"))
    for (const Value& what :
         list->get_if<Value::List>() ? *list->get_if<Value::List>() : Value::List{})
      if (const auto* text = what.get_if<std::string>()) stand_ins.push_back(*text);
  for (const auto& [key, value] : flat(document.root())) {
    if (key == "schema") continue;
    const bool stand_in = std::any_of(
        stand_ins.begin(), stand_ins.end(),
        [&, &name = key](const std::string& what) { return stands_in_for(what, name); });
    std::string text = value;
    // The name of a curve does not change with its points, so its hash is shown.
    if (const fs::path curve = document.beside(value);
        value.ends_with(".csv") && fs::is_regular_file(curve))
      text += " " + sha256_of_file(curve).substr(0, 12);
    values.push_back({owner, key, text, stand_in});
  }
  // A list can name one thing twice; a run has one row of each.
  for (const std::string& what : std::set<std::string>(stand_ins.begin(), stand_ins.end()))
    if (what.find("hysteresis") != std::string::npos)
      values.push_back({owner, "stand_ins: " + what, "as in the curves", true});
}

}  // namespace

void add(Writer& writer, const Calibration& calibration, const std::string& sha256) {
  insert_calibration(writer, sha256, calibration.rig);
  if (!writer.insert("calibration_file", sha256, calibration.method)) return;
  for (const CalibratedCamera& camera : calibration.cameras) {
    const CalibrationResiduals& residuals = camera.residuals;
    writer.insert("calibration_camera", sha256, camera.camera.name, residuals.points,
                  residuals.rms_px, residuals.max_px, residuals.object_rms_mm);
  }
}

ImportCounts add(Writer& writer, const DrapeInput& input, const Report& report,
                 const std::optional<RecordingId>& recording) {
  ImportCounts counts;
  insert_measured(writer, input.measured, report.measurement, recording);
  insert_drapemeter(writer, input.measured.sha256, report.measured_drapemeter);
  for (const SheetFile& repeat : input.repeats)
    insert_measured(writer, repeat, measurement_of(repeat.sheet), recording);
  for (std::size_t i = 0; i < input.simulations.size(); ++i) {
    insert_simulated(writer, input.simulations[i]);
    insert_drapemeter(writer, input.simulations[i].sheet.sha256, report.drapemeters[i]);
  }
  for (const RealVirtual& row : report.real_virtual)
    if (!input.simulations[row.simulation].branch) counts.count(add_comparison(writer, input, row));
  for (const BranchSet& set : report.branch_sets)
    for (const BranchComparison& one : set.branches)
      counts.count(add_comparison(writer, input, one.as_placed, one.turned));
  for (const RealSurface& row : report.real_surface)
    counts.count(insert_surface(writer, input, row));
  for (const VirtualVirtual& row : report.virtual_virtual)
    counts.count(insert_pair(writer, input.measured.sha256, input.simulations,
                             report.lattice_has_gaps_filled, row));
  return counts;
}

ImportCounts add(Writer& writer, const VirtualGroup& group) {
  for (const Simulation& simulation : group.simulations) insert_simulated(writer, simulation);
  ImportCounts counts;
  for (const VirtualVirtual& row : group.pairs)
    counts.count(insert_pair(writer, std::nullopt, group.simulations, true, row));
  return counts;
}

std::string repetition_key(const std::string& run_sha256, const std::string& date, int before) {
  return sha256_of(std::string_view(
      fmt::format("drapebench/run-repetition/1\n{}\n{}\n{}\n", run_sha256, date, before)));
}

bool stands_in_for(const std::string& what, const std::string& key) {
  const auto says = [&](const char* word) { return what.find(word) != std::string::npos; };
  if (what == "all") return key != "name";
  if (says("hysteresis")) return false;
  const bool bias = says("bias") || says("at 45") || says("twist");
  if (key.find(".bias") != std::string::npos) return bias;
  if (key.starts_with("areal_density")) return says("areal density") || says("areal_density");
  return !bias && what.starts_with(key.substr(0, key.find('.')));
}

std::vector<RunValue> values_of(const Session& session, const Outcome& outcome) {
  std::vector<RunValue> values;
  std::set<fs::path> fabrics;
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    const DrapeFiles& drape = session.drapes[i];
    std::set<std::string> runs;
    for (const Simulation& simulation : drape.input.simulations)
      if (!simulation.branch) runs.insert(simulation.run_label());
    values.push_back(
        {"simulations", outcome.reports[i].name, fmt::format("{}", fmt::join(runs, "; "))});
    if (const auto& headline = outcome.reports[i].headline) {
      const RealVirtual& row = outcome.reports[i].real_virtual[*headline];
      const auto& levels = drape.input.simulations[row.simulation].levels;
      if (levels && levels->left_m)
        values.push_back({"mesh_error_mm", outcome.reports[i].name,
                          fmt::format("{:.4f}", *levels->left_m / mm)});
    }
    if (!drape.input.scene) continue;
    add_file("scene " + outcome.reports[i].name, drape.input.scene->file, values);
    const fs::path& fabric = drape.input.scene->fabric_file;
    if (fabrics.insert(fabric).second) add_file("fabric " + fabric.stem().string(), fabric, values);
  }
  for (std::size_t i = 0; i < outcome.warnings.size(); ++i)
    values.push_back({fmt::format("warning {:02}", i + 1), "warning", outcome.warnings[i]});
  if (session.calibration) {
    values.push_back({"calibration", "method", session.calibration->method});
    values.push_back({"calibration", "sets", std::to_string(session.calibration->sets.size())});
    values.push_back(
        {"calibration", "cameras", std::to_string(session.calibration->cameras.size())});
  }
  std::sort(values.begin(), values.end(), [](const RunValue& a, const RunValue& b) {
    return std::tie(a.owner, a.key) < std::tie(b.owner, b.key);
  });
  return values;
}

namespace {

/// Records that the run is current for its photographs again, after another that was stored since.
void repeat_run(Writer& writer, int run, const std::string& content, const std::string& date) {
  const auto last =
      first_of<int>(writer.database(), "SELECT last_run FROM v_run_last WHERE run = ?", {run});
  if (!last || *last == run) return;
  const auto before = first_of<int>(
      writer.database(), "SELECT count(*) FROM run_repetition WHERE run_sha256 = ?", {content});
  writer.insert("run_repetition", repetition_key(content, date, *before), content, date);
}

/// Hash of the photographs of one set, equal if the same pictures were measured.
std::optional<std::string> pictures_of(const DrapeFiles& drape) {
  if (!drape.detections) return std::nullopt;
  const std::string& set = drape.input.measured.measured().set;
  std::set<std::string> hashes;
  for (const FrameDetections& frame : drape.detections->frames)
    if (frame.set == set) hashes.insert(frame.camera + " " + frame.image_sha256);
  return hash_with("", hashes);
}

std::optional<std::string> given(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional(text);
}

/// Identifies the calibration independently of its path, since paths differ between machines.
std::optional<std::string> calibration_name(const Session& session) {
  if (!session.calibration) return std::nullopt;
  return fmt::format("{}, {}, {} sets", session.calibration->rig, session.calibration->method,
                     session.calibration->sets.size());
}

/// Content hash of a run: all but number, date and warnings. Warnings are left out, since an import
/// of the same sheets produces fewer.
std::string content_of(const Session& session, const Outcome& outcome, const RunLabel& label,
                       const std::vector<RunValue>& values) {
  std::string text = fmt::format("drapebench/run-content/1\n{}\n{}\n{}\n{}\n", label.label,
                                 label.operator_name, version(), session.calibration_sha256);
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    const Report& report = outcome.reports[i];
    const DrapeInput& input = session.drapes[i].input;
    text += fmt::format("{}\n{}\n{}\n{}\n", report.name, input.measured.sha256,
                        report.go() ? "GO" : report.no_go.front(), report.match.reason);
    for (const RealVirtual& row : report.real_virtual) text += key_of(input, row) + "\n";
    for (const SheetFile& repeat : input.repeats) text += "repeat " + repeat.sha256 + "\n";
  }
  for (const RunValue& value : values)
    if (value.key != "warning")
      text += fmt::format("{}\t{}\t{}\t{}\n", value.owner, value.key, value.value, value.stand_in);
  return sha256_of(std::string_view(text));
}

using Warnings = std::set<std::string>;

/// The last run with this content that has all of these warnings, so that no warning is lost;
/// otherwise the key of a new one.
std::string key_of_run(Writer& writer, const std::string& content, const Session& session,
                       const Outcome& outcome) {
  if (!writer.has("run", content)) return content;
  const Warnings own(outcome.warnings.begin(), outcome.warnings.end());
  // Hashed with its warnings: a run with the same content as an earlier one, but more warnings.
  for (const auto& [run] : rows_of<std::string>(
           writer.database(),
           "SELECT r.sha256 FROM run AS r JOIN run_drape AS d ON d.run = r.number WHERE "
           "d.measured_sha256 = ? ORDER BY r.number DESC",
           {session.drapes.front().input.measured.sha256})) {
    Warnings all;
    for (const auto& [warning] : rows_of<std::string>(
             writer.database(),
             "SELECT value FROM run_value WHERE run = (SELECT number FROM run WHERE sha256 = ?) "
             "AND key = 'warning'",
             {run}))
      all.insert(warning);
    const bool same = run == content || run == hash_with(content + "\n", all);
    if (same && std::includes(all.begin(), all.end(), own.begin(), own.end())) return run;
  }
  return hash_with(content + "\n", own);
}

void insert_drape(Writer& writer, const std::string& run, const DrapeFiles& drape,
                  const Report& report) {
  const DrapeInput& input = drape.input;
  const auto& source = input.measured.measured();
  Cell headline, expanded_mm, complete;
  if (report.headline) headline = key_of(input, report.real_virtual[*report.headline]);
  if (report.budget) {
    expanded_mm = report.budget->expanded_m / mm;
    complete = report.budget->missing.empty();
  }
  const bool is_new = writer.insert("run_drape", run, input.measured.sha256, report.name,
                                    source.set, pictures_of(drape), report.go() ? "GO" : "NO-GO",
                                    report.go() ? Cell() : Cell(report.no_go.front()),
                                    std::string(name_of(report.match.match)), report.match.reason,
                                    headline, expanded_mm, complete, in_mm(report.match.limit_m));
  if (!is_new) throw internal_error("a run has the drape " + report.name + " twice");
  const auto add = [&](const RealVirtual& row) {
    writer.insert("run_comparison", key_of(input, row), run);
  };
  for (const RealVirtual& row : report.real_virtual) add(row);
  for (const BranchSet& set : report.branch_sets)
    for (const BranchComparison& one : set.branches) add(one.as_placed);
}

void insert_match(Writer& writer, const std::string& run, const DrapeInput& input,
                  const Report& report) {
  const std::string key = sha256_of(std::string_view(
      fmt::format("drapebench/run-match/1\n{}\n{}\n", run, input.measured.sha256)));
  int repeats = 1;
  for (const RepeatLine& line : report.repeats) repeats += line.input && line.left_out.empty();
  std::optional<double> p;
  if (report.among_repeats) p = report.among_repeats->matches.front().p;
  writer.insert("run_match", key, run, input.measured.sha256, report.match.rests_on,
                report.significance, repeats, p);
  for (const MatchBasis& basis : report.match.bases)
    writer.insert("match_basis", key, basis.what, std::string(name_of(basis.verdict)), basis.value,
                  basis.limit, basis.unit, basis.p, basis.reason);
  for (const RepeatLine& line : report.repeats) {
    const SheetFile& sheet = line.input ? input.repeats[*line.input] : input.measured;
    writer.insert("real_repeat", key, sheet.sha256, line.set, line.repeat, given(line.face),
                  given(line.left_out), in_mm(line.from_own_m));
  }
}

/// The only clock time in the store: now, or SOURCE_DATE_EPOCH if set in the environment. Throws
/// Error(usage) if that is not a valid time.
std::string date_of_run() {
  constexpr std::int64_t kEndOf9999 = 253402300799;  // dates are compared as texts of equal length
  std::int64_t time = std::time(nullptr);
  if (const char* fixed = std::getenv("SOURCE_DATE_EPOCH")) {
    const char* end = fixed + std::strlen(fixed);
    const auto [last, error] = std::from_chars(fixed, end, time);
    if (error != std::errc() || last != end || time < 0 || time > kEndOf9999)
      throw usage_error(fmt::format("SOURCE_DATE_EPOCH is `{}` in the environment", fixed),
                        "give seconds since 1970 up to the year 9999, or unset it");
  }
  return utc_text(std::chrono::system_clock::from_time_t(static_cast<std::time_t>(time)));
}

/// Adds the run as one row with its drapes, comparisons and values; the outcome gets its number and
/// date. A run with the same content (except the date) and no further warning is the same run; it
/// only adds the date at which it became current for its photographs again, if another run was
/// stored in between.
void add_run(Writer& writer, const Session& session, const RunLabel& label, const std::string& date,
             Outcome& outcome) {
  const std::vector<RunValue> values = values_of(session, outcome);
  const std::string content =
      key_of_run(writer, content_of(session, outcome, label, values), session, outcome);
  for (const auto& [number, first_date] : rows_of<int, std::string>(
           writer.database(), "SELECT number, date FROM run WHERE sha256 = ?", {content})) {
    outcome.run = number;
    outcome.date = first_date;
    return repeat_run(writer, number, content, date);
  }
  Cell rig, recording, recording_name;
  for (const DrapeFiles& drape : session.drapes) {
    rig = drape.input.measured.measured().rig;
    if (!drape.recording) continue;
    recording = drape.recording->sha256;
    recording_name = drape.recording->name;
  }
  const std::vector<std::string> reasons = outcome.reasons();
  writer.insert("run", content, date, given(label.label), given(label.operator_name), version(),
                rig, recording, recording_name, given(session.calibration_sha256),
                calibration_name(session), outcome.go() ? "GO" : "NO-GO",
                reasons.empty() ? Cell() : Cell(reasons.front()));
  outcome.run = writer.last_id();
  outcome.date = date;
  for (std::size_t i = 0; i < outcome.reports.size(); ++i)
    insert_drape(writer, content, session.drapes[i], outcome.reports[i]);
  for (const RunValue& value : values)
    writer.insert("run_value", content, value.owner, value.key, value.value, value.stand_in);
  for (std::size_t i = 0; i < outcome.reports.size(); ++i)
    insert_match(writer, content, session.drapes[i].input, outcome.reports[i]);
}

/// Warns of drapes of the recording that its last run compared and this one omits.
void warn_of_removed(Writer& writer, const Session& session, Outcome& outcome) {
  const auto known = std::find_if(session.drapes.begin(), session.drapes.end(),
                                  [](const DrapeFiles& drape) { return drape.recording; });
  if (known == session.drapes.end()) return;
  for (const auto& [scene] : rows_of<std::string>(
           writer.database(),
           "SELECT DISTINCT scene FROM run_drape WHERE run = (SELECT r.number FROM run AS r JOIN "
           "v_run_moment AS m ON m.run = r.number WHERE r.recording_sha256 = ? ORDER BY m.moment "
           "DESC LIMIT 1) ORDER BY scene",
           {known->recording->sha256}))
    if (std::none_of(outcome.reports.begin(), outcome.reports.end(),
                     [&name = scene](const Report& report) { return report.name == name; }))
      outcome.warnings.push_back(fmt::format(
          "{}: the last run of this recording compared it and this one does not, so its results "
          "count as removed (drape results list --all shows them)",
          scene));
}

/// Warns without storing it, since it is not part of the run's content.
void warn_of_clock(Writer& writer, const std::string& date, Outcome& outcome) {
  const auto last = first_of<std::string>(writer.database(), "SELECT max(date) FROM v_run_moment");
  if (last && date < *last)
    outcome.warnings.push_back(
        fmt::format("the clock says {}, before the last run in the store ({}), so that one counts "
                    "as the later: "
                    "set the clock and run again",
                    date, *last));
}

/// The bytes that were read; throws if the file has changed since.
std::string bytes_read(const fs::path& file, const std::string& sha256) {
  std::string content = read_text(file);
  if (sha256_of(std::string_view(content)) == sha256) return content;
  throw bad_input("the file was changed while its numbers were computed", {.file = file.string()},
                  "run again");
}

/// Adds the content from which the numbers of the session are computed, under its hashes. Left out
/// are photographs, and run records, whose clock times would make the same input give different
/// stores.
void add_content(Writer& writer, const Session& session, const fs::path& store) {
  const fs::path folder = folder_of(store);
  const auto add = [&](const fs::path& file, const std::string& sha256) {
    if (!writer.has("blob", sha256)) writer.insert_blob(sha256, bytes_read(file, sha256));
  };
  for (const auto& [sha256, content] : session.mesh_contents) writer.insert_blob(sha256, content);
  for (const auto& [sha256, file] : session.meshes) add(file, sha256);
  for (const auto& [file, sha256] : session.read) {
    writer.insert_file(sha256, fs::proximate(file, folder).generic_string());
    if (!session.outside.contains(file)) add(file, sha256);
  }
}

/// The calibrations on which the session is based.
std::set<std::string> calibrations_of(const Session& session) {
  std::set<std::string> calibrations;
  if (!session.calibration_sha256.empty()) calibrations.insert(session.calibration_sha256);
  for (const DrapeFiles& drape : session.drapes)
    calibrations.insert(drape.input.measured.measured().calibration_sha256);
  return calibrations;
}

std::string reason_of(const std::string& cause) {
  return "the acceptance of this calibration is NO-GO: " +
         (cause.empty() ? "a figure is beyond its limit or was not measured" : cause);
}

}  // namespace

ImportCounts import_session(const fs::path& file, const Session& session, Outcome& outcome,
                            const RunLabel& label) {
  const std::string date = date_of_run();
  Store results(file);
  ImportCounts sum;
  outcome.label = label.label;
  outcome.operator_name = label.operator_name;
  // Comparisons without their run would have no verdict.
  results.write([&](Writer& writer) {
    add_content(writer, session, file);
    if (session.calibration) add(writer, *session.calibration, session.calibration_sha256);
    for (std::size_t i = 0; i < outcome.reports.size(); ++i)
      sum += add(writer, session.drapes[i].input, outcome.reports[i], session.drapes[i].recording);
    for (const VirtualGroup& group : outcome.groups) {
      // A pair without a real cloth has no run, so no row would record that it is NO-GO.
      if (group.no_go.empty())
        sum += add(writer, group);
      else
        outcome.warnings.push_back(group.name +
                                   ": pairs of simulations that are NO-GO are not stored");
    }
    if (outcome.reports.empty()) return;
    warn_of_removed(writer, session, outcome);
    warn_of_clock(writer, date, outcome);
    add_run(writer, session, label, date, outcome);
  });
  results.close();
  return sum;
}

ApartCounts import_simulations(const fs::path& store, std::vector<fs::path> sheets) {
  constexpr std::ptrdiff_t kAtATime = 500;  // limits the memory
  ApartCounts sum;
  sum.unfinished = std::erase_if(
      sheets, [](const fs::path& sheet) { return !fs::is_regular_file(run_record_path(sheet)); });
  Store results(store);
  for (auto first = sheets.begin(); first != sheets.end();) {
    const auto last = first + std::min(kAtATime, sheets.end() - first);
    const Session session = read_session({first, last}, {});
    if (!session.drapes.empty())
      throw usage_error("a measured sheet cannot be imported apart",
                        "leave out --apart to compare it with its simulations");
    results.write([&](Writer& writer) {
      add_content(writer, session, store);
      for (const auto& simulations : session.virtual_only)
        for (const Simulation& one : simulations) {
          if (one.sheet.sheet.no_go)
            throw bad_input("it was placed by a sheet that is NO-GO: " + *one.sheet.sheet.no_go,
                            {.file = one.sheet.file.string()},
                            "simulate it again from a sheet that is GO, or leave it out: a "
                            "simulation that is stored apart has no verdict");
          sum.count(insert_simulated(writer, one));
        }
    });
    first = last;
  }
  results.close();
  return sum;
}

std::map<std::string, std::string> reason_in_store(const fs::path& store, const Session& session,
                                                   const std::optional<AcceptanceFile>& given) {
  std::map<std::string, std::string> reasons;
  std::optional<StoreReader> reader;
  if (fs::is_regular_file(store)) reader.emplace(store);
  for (const std::string& calibration : calibrations_of(session)) {
    const bool of_given = given && given->calibration_sha256 == calibration;
    if (of_given && !given->go) reasons[calibration] = reason_of(given->cause.value_or(""));
    if (!reader) continue;
    const auto last = reader->rows<std::string, std::string, std::string>(
        "SELECT a.verdict, a.cause, a.date FROM acceptance AS a JOIN listed AS l ON l.kind = "
        "'acceptance' AND l.key = a.sha256 WHERE a.calibration_sha256 = ? ORDER BY a.date DESC, "
        "l.sequence DESC LIMIT 1",
        {calibration});
    if (last.empty()) continue;
    const auto& [verdict, cause, date] = last.front();
    if (of_given && date <= given->date.value_or("")) continue;
    reasons.erase(calibration);
    if (verdict != "GO") reasons[calibration] = reason_of(cause);
  }
  return reasons;
}

std::vector<std::string> doubts_of(const AcceptanceFile& acceptance, const Session& session) {
  std::vector<std::string> doubts;
  const std::string again = ": record the target again and run drape calib accept";
  std::optional<std::string> day;
  for (const DrapeFiles& drape : session.drapes) {
    if (drape.recording && drape.recording->recorded_on)
      day = std::max(day.value_or(""), *drape.recording->recorded_on);
  }
  if (std::ranges::any_of(calibrations_of(session), [&](const std::string& calibration) {
        return calibration != acceptance.calibration_sha256;
      }))
    doubts.push_back("the last acceptance is of another calibration, older than this one" + again);
  if (day && acceptance.valid_until && *day > *acceptance.valid_until)
    doubts.push_back(
        fmt::format("the last acceptance expired on {}, the drapes were recorded on {}{}",
                    *acceptance.valid_until, *day, again));
  return doubts;
}

std::optional<AcceptanceFile> look_at_acceptance(const fs::path& file, const Session& session,
                                                 Outcome& outcome, RunRecord& record) {
  std::optional<AcceptanceFile> acceptance;
  if (!file.empty()) {
    acceptance = read_record<AcceptanceFile>(file);
    record.input(file, acceptance->document.sha256());
    for (const std::string& warning : acceptance->warnings)
      outcome.warnings.push_back("the acceptance: " + warning);
    for (std::string& doubt : doubts_of(*acceptance, session))
      outcome.warnings.push_back(std::move(doubt));
  }
  outcome.not_accepted = reason_in_store(outcome.store, session, acceptance);
  return acceptance;
}

void store_acceptance(const fs::path& store, const AcceptanceFile& acceptance) {
  Store results(store);
  const std::string& key = acceptance.document.sha256();
  results.write([&](Writer& writer) {
    writer.insert("rig", acceptance.rig);
    if (!writer.insert("acceptance", key, acceptance.rig, acceptance.calibration_sha256,
                       acceptance.date, acceptance.valid_until, acceptance.positions,
                       acceptance.go ? "GO" : "NO-GO", acceptance.cause))
      return;
    for (const AcceptanceRow& figure : acceptance.figures)
      writer.insert("acceptance_figure", key, figure.name, figure.unit, figure.value,
                    figure.expanded, figure.limit, figure.where, figure.go ? "GO" : "NO-GO");
  });
  results.close();
}

}  // namespace drape::compare
