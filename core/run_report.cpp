// SPDX-License-Identifier: Apache-2.0
#include "core/run_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.hpp"

namespace drape {

using units::deg;
using units::mm;

Table::Table(std::vector<std::string> columns, const std::vector<std::size_t>& numbers)
    : names(std::move(columns)), numeric(names.size(), false) {
  for (const std::size_t at : numbers) numeric[at] = true;
}

std::optional<std::size_t> Table::column(const std::string& name) const {
  const auto at = std::find(names.begin(), names.end(), name);
  return at == names.end() ? std::nullopt : std::optional<std::size_t>(at - names.begin());
}

static void fields(Fields& f, MatchBasis& basis) {
  f({"what", "thing that the match is judged against"}, basis.what);
  f({"verdict", "inside, outside, undecided or none"}, basis.verdict);
  f({"value", "value in `unit`"}, basis.value);
  f({"limit", "limit in `unit`"}, basis.limit);
  f({"unit", "mm or %"}, basis.unit);
  f({"p", "probability that one more repeat lies as far out"}, basis.p);
  f({"reason", "phrase for people"}, basis.reason);
}

static void fields(Fields& f, ModelRest& model) {
  f({"mean_mm", "mean distance of the rest reached from the measured shape", mm}, model.distance_m);
  f({"least_mm", "smallest over the range of friction", mm}, model.least_m);
  f({"largest_mm", "largest over the range of friction", mm}, model.largest_m);
  f({"range", "range of a friction that nobody measured; empty: it was measured"}, model.range);
  f({"ends_without_rest", "ends of the range without a rest, and why"}, model.lost);
  f({"from_own_start_mm", "mean distance from the rest of the scene's own start", mm},
    model.apart_m);
  f({"other_branch", "whether that is another branch; null: not known"}, model.other_branch);
}

static void fields(Fields& f, MatchVerdict& match) {
  f({"verdict", "inside, outside, undecided or none"}, match.match);
  f({"reason", "why it is so"}, match.reason);
  f({"rests_on", "`8 repeats`, `tolerance`; empty: nothing"}, match.rests_on);
  f({"value_mm", "distance that is compared with the limit", mm}, match.value_m);
  f({"limit_mm", "limit T", mm}, match.limit_m);
  f({"error_number", "E_n = d / U"}, match.error_number);
  f({"remedies", "actions that could change the answer"}, match.remedies);
  f({"bases", "each thing that it is judged against"}, match.bases);
  f({"model", "rest reached from the measured shape; null: not simulated"}, match.model);
}

static void fields(Fields& f, RepeatLine& line) {
  f({"repeat", "name of the laying"}, line.repeat);
  f({"set", "frame set"}, line.set);
  f({"face", "side of the cloth that lies up; empty: not stated"}, line.face);
  f({"from_own_mm", "root mean square distance of the marks; null: its own", mm}, line.from_own_m);
  f({"left_out", "why it is no repeat; empty: it is one"}, line.left_out);
}

static void fields(Fields& f, BudgetLine& line) {
  f({"what", "contribution"}, line.what);
  f({"u_mm", "standard uncertainty of the mean distance, alone", mm, 0}, line.u_m);
  f({"rectangular", "between two ends instead of normal"}, line.rectangular);
  f({"origin", "source of the value"}, line.origin);
  f({"remedy", "action that lowers it; empty: none"}, line.remedy);
  f({"own_mm", "bound of its effect where it adds as a whole", mm}, line.own_m);
}

static void fields(Fields& f, Budget& budget) {
  f({"expanded_mm", "expanded uncertainty U (95 %)", mm, 0}, budget.expanded_m);
  f({"inputs_mm", "half width of the contributions without a bound (95 %)", mm, 0},
    budget.inputs_m);
  f({"own_mm", "sum of the bounds: mesh, segments, marks without a distance", mm, 0}, budget.own_m);
  f({"lines", "contributions, the largest first"}, budget.lines);
  f({"missing", "contributions that are not known; none: U is complete"}, budget.missing);
}

void fields(Fields& f, ReportedTable& reported) {
  Table& table = reported.table;
  f(Field{"name", "name of its file"}.plain_name(), reported.name);
  f({"title", "title"}, table.title);
  f({"note", "meaning of its columns"}, reported.note);
  f({"columns", "names of the columns with their units"}, table.names);
  f({"headings", "the same for people; empty: as the names"}, table.headings);
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < table.numeric.size(); ++i)
    if (table.numeric[i]) numbers.push_back(i);
  f({"numbers", "columns of numbers, from 0", 1, 0}, numbers);
  table.numeric.assign(table.names.size(), false);
  for (const std::size_t at : numbers)
    if (at < table.numeric.size()) table.numeric[at] = true;
  f({"rows", "cells"}, table.rows);
  f({"marked_row", "row that speaks for the drape, from 0"}, table.marked_row);
}

static void fields(Fields& f, ReportedDistance& distance) {
  f({"marks", "marks that were compared", 1, 0}, distance.marks);
  f({"mean_mm", "mean distance real to virtual", mm, 0}, distance.mean_m);
  f({"median_mm", "median", mm, 0}, distance.median_m);
  f({"rms_mm", "root mean square", mm, 0}, distance.rms_m);
  f({"p95_mm", "95th percentile", mm, 0}, distance.p95_m);
  f({"max_mm", "largest", mm, 0}, distance.max_m);
  f({"sigma_mean_mm", "standard deviation of the mean by the marks", mm}, distance.sigma_mean_m);
  f({"low_mm", "2.5 % of means over marks drawn again", mm}, distance.low_m);
  f({"high_mm", "97.5 % of them", mm}, distance.high_m);
  f({"shape_mm", "mean that one rigid move of the cloth leaves", mm}, distance.shape_m);
  f({"place_mm", "shift of that move", mm}, distance.place_m);
  f({"place_deg", "turn of that move", deg}, distance.turn_rad);
}

static void fields(Fields& f, ReportedSimulation& one) {
  f({"label", "mesh and segments"}, one.label);
  f({"model", "cloth model"}, one.model);
  f({"fabric", "fabric"}, one.fabric);
  f({"simulator", "program of another make; empty: drapebench"}, one.simulator);
  f({"status", "`at rest`, or why not"}, one.status);
  f({"segments", "segments per curve"}, one.segments);
  f({"branch", "number of the branch"}, one.branch);
  f({"spacing_mm", "spacing of the finest mesh", mm}, one.spacing_m);
  f({"mesh_error_mm", "bound of what this mesh leaves", mm}, one.mesh_error_m);
  f({"from_measured", "whether it began in the measured shape"}, one.from_measured);
  f({"distance", "distance of the real marks"}, one.distance);
}

static void fields(Fields& f, ReportedBranch& branch) {
  f({"number", "1 has the least energy", 1, 1}, branch.number);
  f({"share", "part of the seeded starts"}, branch.share);
  f({"nearest", "whether it is nearest to the real cloth"}, branch.nearest);
  f({"stable", "false: a saddle"}, branch.stable);
  f({"mean_mm", "mean distance, on a round object after the best turn", mm}, branch.mean_m);
  f({"shape_mm", "mean that one rigid move leaves", mm}, branch.shape_m);
}

static void fields(Fields& f, ReportedBranches& set) {
  f({"label", "mesh and segments"}, set.label);
  f({"sha256", "hash of branches.json"}, set.sha256);
  f({"sentence", "nearest branch, for people"}, set.sentence);
  f({"branches", "equilibria by energy"}, set.branches);
}

static void fields(Fields& f, ReportedMark& mark) {
  f({"row", "row, along the warp", 1, 0}, mark.row);
  f({"col", "column, along the weft", 1, 0}, mark.col);
  f({"real_mm", "measured place in the world", mm}, mark.real_in_world);
  f({"virtual_mm", "place on the simulation that speaks", mm}, mark.virtual_in_world);
  f({"distance_mm", "distance of the two", mm}, mark.distance_m);
  f({"sigma_distance_mm", "its standard deviation by the mark", mm}, mark.sigma_distance_m);
  f({"sigma_mm", "standard deviation of the mark along its worst direction", mm}, mark.sigma_m);
  f({"views", "cameras that saw it"}, mark.views);
  f({"band_mm", "middle of its 95 % band in the ensemble", mm}, mark.band_in_world);
  f({"band_radius_mm", "radius of that band", mm}, mark.band_radius_m);
  f({"gap", "why it has no distance; empty: it has"}, mark.gap);
}

static void fields(Fields& f, ReportedView& view) {
  f({"camera", "camera"}, view.camera);
  f({"picture", "photograph, from the report's folder; empty: none"}, view.picture);
  f({"width_px", "width of the picture's frame", 1, 0}, view.width_px);
  f({"height_px", "height", 1, 0}, view.height_px);
  f({"crop_px", "part that is shown: u, v, u, v"}, view.crop_px);
  f({"marks", "row, col, u, v and, where it has one, u, v of its virtual place"}, view.marks);
  f({"front", "lines of the virtual cloth that face the camera: u, v, u, v ..."}, view.front);
  f({"back", "lines of its back"}, view.back);
}

static void fields(Fields& f, ReportedShape& shape) {
  f({"rows", "rows of points of the virtual cloth", 1, 0}, shape.rows);
  f({"cols", "columns", 1, 0}, shape.cols);
  f({"cloth_mm", "x, y, z of each point, row by row"}, shape.cloth_mm);
  f({"object_mm", "x, y, z of the four corners of each face of the objects"}, shape.object_mm);
}

static void fields(Fields& f, ReportedDrape& drape) {
  f(Field{"name", "name in files"}.plain_name(), drape.name);
  f({"label", "name for people"}, drape.label);
  f({"set", "frame set"}, drape.set);
  f({"rig", "rig"}, drape.rig);
  f({"fabric", "fabric of the simulation that speaks"}, drape.fabric);
  f({"object", "objects under the cloth"}, drape.object);
  f({"no_go", "why its measurement is NO-GO; none: GO"}, drape.no_go);
  f({"measured_marks", "marks with a place in space", 1, 0}, drape.measurement.marks);
  f({"gaps", "marks without", 1, 0}, drape.measurement.gaps);
  f({"sigma_median_mm", "median standard deviation of a mark", mm},
    drape.measurement.sigma_median_m);
  f({"sigma_max_mm", "largest", mm}, drape.measurement.sigma_max_m);
  f({"simulation", "simulation that speaks for the drape; empty: none"}, drape.simulation);
  f({"distance", "its distance; null: nothing was compared"}, drape.distance);
  f({"match", "match"}, drape.match);
  f({"budget", "uncertainty of the mean distance"}, drape.budget);
  f({"why", "sentence: why the match is so"}, drape.why);
  f({"next", "sentence: what to do; empty: nothing"}, drape.next);
  f({"facts", "sentences on mesh, branches, ensemble and friction"}, drape.facts);
  f({"repeats", "layings; none: laid once"}, drape.repeats);
  f({"simulations", "simulations, the finest first"}, drape.simulations);
  f({"branch_sets", "equilibria"}, drape.branch_sets);
  f({"marks", "marks of the print"}, drape.marks);
  f({"views", "photographs with what is drawn over them"}, drape.views);
  f({"shape", "shapes to draw in space"}, drape.shape);
  f({"tables", "tables; each is a .csv beside the report too"}, drape.tables);
}

static void fields(Fields& f, ReportedNote& note) {
  f({"severity", "stops: NO-GO; asks: names something to do; informs"}, note.severity);
  f({"kind", "the same for notes that differ in drape and numbers alone"}, note.kind);
  f({"drape", "label of the drape; empty: the run"}, note.drape);
  f({"text", "sentence"}, note.text);
}

static void fields(Fields& f, ReportedCamera& camera) {
  f({"name", "camera"}, camera.name);
  f({"points", "points of the target", 1, 0}, camera.points);
  f({"rms_px", "root mean square residual"}, camera.rms_px);
  f({"max_px", "largest residual"}, camera.max_px);
  f({"rms_mm", "distance of the target's points from their rays", mm}, camera.rms_m);
  f({"covered_px", "rectangle that the points covered: u, v, u, v"}, camera.covered_px);
  f({"width_px", "width of the image", 1, 0}, camera.width_px);
  f({"height_px", "height", 1, 0}, camera.height_px);
}

static void fields(Fields& f, ReportedCalibration& calibration) {
  f({"method", "method"}, calibration.method);
  f({"sha256", "hash of calibration.json"}, calibration.sha256);
  f({"no_go", "why it is NO-GO; empty: GO"}, calibration.no_go);
  f({"sets", "frame sets used", 1, 0}, calibration.sets);
  f({"cameras", "cameras"}, calibration.cameras);
  f({"findings", "numbers of its program's ending"}, calibration.findings);
  f({"warnings", "warnings"}, calibration.warnings);
}

static void fields(Fields& f, ReportedInput& input) {
  f({"file", "path from the report's folder"}, input.file);
  f({"sha256", "hash of its bytes as they were read"}, input.sha256);
}

static void fields(Fields& f, ReportedProvenance& provenance) {
  f({"inputs", "files that were read"}, provenance.inputs);
  f({"programs", "programs with their versions"}, provenance.programs);
  f({"commands", "commands that make everything again, in the report's folder"},
    provenance.commands);
  f({"trees", "by drape: from the sheets back to photographs and curves"}, provenance.trees);
  f({"recordings", "recordings"}, provenance.recordings);
  f({"stand_ins", "values that nobody measured"}, provenance.stand_ins);
}

void fields(Fields& f, RunReport& report) {
  f({"program", "program and version"}, report.program);
  f({"rig", "rig"}, report.rig);
  f({"run", "number in the store; null: not stored"}, report.run);
  f({"store", "file name of the store; empty: not stored"}, report.store);
  f({"date", "date of the run as stored; empty: not stored"}, report.date);
  f({"label", "label of the run"}, report.label);
  f({"operator", "operator"}, report.operator_name);
  f({"go", "whether the measurement is GO"}, report.go);
  f({"sentence", "verdict in one sentence"}, report.sentence);
  f({"reasons", "why it is NO-GO, the first cause first"}, report.reasons);
  f({"drapes", "drapes"}, report.drapes);
  f({"virtual_groups", "pairs of simulations without a real cloth"}, report.virtual_groups);
  f({"calibration", "health of the calibration; null: not given"}, report.calibration);
  f({"notes", "reasons and warnings, those that stop first"}, report.notes);
  f({"provenance", "what the numbers were made from"}, report.provenance);
}

std::string figure(double value, std::optional<double> uncertainty) {
  if (!std::isfinite(value)) return "not known";
  const bool known = uncertainty && *uncertainty > 0;
  const double scale = known ? *uncertainty : std::abs(value);
  const double least = known ? 9.95 : 99.5;
  const auto times = [](double x, int places) {
    return places < 0 ? x / std::pow(10.0, -places) : x * std::pow(10.0, places);
  };
  int places = known ? -9 : 0;
  while (places < 9 && times(scale, places) < least) ++places;
  if (!(scale > 0)) places = 0;
  const auto whole = static_cast<long long>(std::floor(times(std::abs(value), places) + 0.5));
  std::string digits = std::to_string(whole);
  const std::string sign = value < 0 && whole > 0 ? "-" : "";
  if (places <= 0) return sign + (whole == 0 ? "0" : digits + std::string(-places, '0'));
  if (digits.size() <= static_cast<std::size_t>(places))
    digits.insert(0, static_cast<std::size_t>(places) + 1 - digits.size(), '0');
  return sign + digits.insert(digits.size() - static_cast<std::size_t>(places), ".");
}

DistanceFigures figures_of(const ReportedDrape& drape) {
  DistanceFigures shown;
  if (!drape.distance) return shown;
  const ReportedDistance& d = *drape.distance;
  std::optional<double> u;
  if (drape.budget && drape.budget->missing.empty()) u = drape.budget->expanded_m / mm;
  const auto length = [&](const std::optional<double>& value_m) {
    return value_m ? figure(*value_m / mm, u) : std::string();
  };
  shown.mean = length(d.mean_m);
  if (drape.budget) {
    const double expanded_mm = drape.budget->expanded_m / mm;
    shown.expanded = (u ? "" : "at least ") + figure(expanded_mm, expanded_mm);
  }
  shown.shape = length(d.shape_m);
  shown.place = length(d.place_m);
  // Resolution of a rotation: U at the edge of a patch corresponds to a tenth of a degree or more.
  if (d.turn_rad) shown.turn = figure(*d.turn_rad / deg, 1.0);
  shown.limit = length(drape.match.limit_m);
  return shown;
}

namespace {

/// Display width: number of bytes that start a UTF-8 character.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

void add_line(const std::vector<std::string>& cells, const std::vector<std::size_t>& widths,
              const std::vector<bool>& numeric, std::string& text) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::size_t space = widths[i] - std::min(widths[i], width_of(cells[i]));
    text += i == 0 ? "  " : "   ";
    if (numeric[i]) text.append(space, ' ');
    text += cells[i];
    if (!numeric[i]) text.append(space, ' ');
  }
  text.erase(text.find_last_not_of(' ') + 1);
  text += '\n';
}

/// Splits the text at a space so that the first part has at most `width` columns.
std::pair<std::string, std::string> cut(const std::string& text, std::size_t width) {
  if (text.size() <= width) return {text, ""};
  const std::size_t space = text.rfind(' ', width);
  const std::size_t end = space == std::string::npos || space == 0 ? width : space;
  return {text.substr(0, end), text.substr(std::min(text.size(), end + 1))};
}

}  // namespace

std::string text_of(const Table& table) {
  const std::vector<std::string>& headings = table.headings.empty() ? table.names : table.headings;
  std::vector<std::size_t> widths;
  widths.reserve(headings.size());
  for (const std::string& name : headings) widths.push_back(width_of(name));
  for (const auto& row : table.rows)
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width_of(row[i]));
  std::string text = table.title.empty() ? "" : table.title + '\n';
  add_line(headings, widths, table.numeric, text);
  std::vector<std::string> rule;
  rule.reserve(widths.size());
  for (const std::size_t width : widths) rule.emplace_back(width, '-');
  add_line(rule, widths, table.numeric, text);
  for (const auto& row : table.rows) add_line(row, widths, table.numeric, text);
  return text;
}

std::string ending_lines(const ReportedDrape& drape, std::size_t name_width) {
  constexpr std::size_t kWidth = 100;
  const std::string indent(name_width + 4, ' ');
  const DistanceFigures shown = figures_of(drape);
  const std::string word =
      drape.no_go.empty() ? std::string(name_of(drape.match.match)) : std::string("NO-GO");
  std::string first = fmt::format("  {:<{}}  {:<9}", drape.label, name_width, word);
  if (!shown.mean.empty())
    first += fmt::format("  {} mm apart{}", shown.mean,
                         shown.expanded.empty() ? "" : ", U " + shown.expanded + " mm");
  if (!shown.shape.empty())
    first +=
        fmt::format(": shape {} mm, place {} mm and {} deg", shown.shape, shown.place, shown.turn);
  const auto [head, tail] = cut(first, kWidth);
  std::string text = head + "\n";
  for (std::string rest : {tail, drape.why, drape.next.empty() ? "" : "Next: " + drape.next})
    while (!rest.empty()) {
      auto [now, later] = cut(rest, kWidth - indent.size());
      text += indent + now + "\n";
      rest = std::move(later);
    }
  return text;
}

bool is_all_good(const RunReport& report) {
  return report.go && std::all_of(report.drapes.begin(), report.drapes.end(), [](const auto& one) {
           return one.match.match == Match::inside || one.match.match == Match::none;
         });
}

std::string first_line(const RunReport& report) {
  if (!report.go) return "NO-GO: " + report.reasons.front();
  std::string text = "GO: " + (report.rig.empty() ? "simulations alone" : report.rig);
  if (report.run) text += fmt::format(", run {}", *report.run);
  double sigma_mm = 0;
  for (const ReportedDrape& drape : report.drapes)
    sigma_mm = std::max(sigma_mm, drape.measurement.sigma_median_m.value_or(0) / mm);
  if (report.calibration) text += fmt::format("; {} cameras", report.calibration->cameras.size());
  if (sigma_mm > 0) text += fmt::format("; marks to {} mm", figure(sigma_mm, sigma_mm));
  return text;
}

std::string ending_text(const RunReport& report, const std::string& first,
                        const std::string& page) {
  constexpr std::size_t kWidth = 100;
  std::string text = first + "\n";
  const auto line = [&](const std::string& said) {
    const auto [now, later] = cut(said, kWidth);
    text += (later.empty() ? now : cut(said, kWidth - 4).first + " ...") + "\n";
  };
  std::vector<std::pair<const ReportedNote*, int>> kinds;
  for (const ReportedNote& note : report.notes) {
    if (first.ends_with(note.text)) continue;
    const auto same = std::find_if(kinds.begin(), kinds.end(), [&](const auto& one) {
      return one.first->kind == note.kind && one.first->severity == note.severity;
    });
    same == kinds.end() ? void(kinds.emplace_back(&note, 1)) : void(++same->second);
  }
  for (const auto& [note, times] : kinds) {
    const std::string said =
        fmt::format("  {}: {}", note->severity == Severity::stops ? "also" : "warning",
                    times == 1 ? note->text : fmt::format("{} ({} like this)", note->text, times));
    // A remedy is printed completely; an informative note may be shortened.
    note->severity == Severity::informs ? line(said) : void(text += said + "\n");
  }
  for (const ReportedTable& group : report.virtual_groups) text += "\n" + text_of(group.table);
  std::size_t width = 0;
  for (const ReportedDrape& drape : report.drapes) width = std::max(width, drape.label.size());
  for (const ReportedDrape& drape : report.drapes) text += ending_lines(drape, width);
  if (!page.empty()) text += "report  " + page + "\n";
  return text;
}

std::string detail_text(const ReportedDrape& drape) {
  std::string text = ending_lines(drape, drape.label.size());
  const auto add = [&](const std::string& what, const std::string& said) {
    if (!said.empty()) text += fmt::format("  {:<12} {}\n", what, said);
  };
  if (drape.match.error_number) add("E_n", figure(*drape.match.error_number));
  add("simulation", drape.simulation);
  add("measurement", drape.no_go.empty() ? "GO" : "NO-GO");
  for (const std::string& reason : drape.no_go) add("", reason);
  const Measurement& measured = drape.measurement;
  add("marks", fmt::format("{} measured, {} gaps", measured.marks, measured.gaps));
  if (measured.sigma_median_m)
    add("", fmt::format("one mark to {} mm (median), {} mm (largest), 1 sigma",
                        figure(*measured.sigma_median_m / mm, *measured.sigma_median_m / mm),
                        figure(*measured.sigma_max_m / mm, *measured.sigma_max_m / mm)));
  std::map<std::string, int> gaps;
  for (const ReportedMark& mark : drape.marks)
    if (!mark.gap.empty()) ++gaps[kind_of_gap(mark.gap)];
  for (const auto& [kind, count] : gaps)
    add("", fmt::format("{} mark{} not measured: {}", count, count == 1 ? "" : "s", kind));
  for (const std::string& fact : drape.facts) text += "  " + fact + "\n";
  for (const ReportedTable& one : drape.tables)
    if (one.name != "marks" && one.name != "gaps" && one.name != "strain" && one.name != "waves" &&
        one.name != "values" && one.name != "certificates" && one.name != "hem")
      text += "\n" + text_of(one.table);
  return text;
}

std::string kind_of_gap(const std::string& reason) {
  return reason.substr(0, std::min({reason.find(" ("), reason.find(':'), reason.find(';')}));
}

}  // namespace drape
