// SPDX-License-Identifier: Apache-2.0
#include "compare/report/account.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <regex>
#include <set>

#include "compare/store/outcome.hpp"
#include "compare/tables/budget.hpp"
#include "compare/tables/match.hpp"
#include "compare/tables/tables.hpp"
#include "core/files/files.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using units::mm;
using units::percent;

ReportedDistance distance_of(const RealVirtual& row) {
  const DistanceStatistics& s = row.statistics;
  ReportedDistance d{s.marks,        s.mean_m, s.median_m, s.rms_m, s.p95_m, s.max_m,
                     s.sigma_mean_m, {},       {},         {},      {},      {}};
  if (s.mean.bootstrap) {
    d.low_m = s.mean.bootstrap->low;
    d.high_m = s.mean.bootstrap->high;
  }
  if (row.aligned) {
    d.shape_m = row.aligned->after.mean_m;
    d.place_m = row.aligned->centroid_shift_m;
    d.turn_rad = row.aligned->turn_rad;
  }
  return d;
}

ReportedSimulation simulation_of(const Simulation& one, const RealVirtual& row) {
  const SimulatedSource& source = one.source();
  ReportedSimulation made{one.label(),
                          source.model,
                          source.fabric,
                          one.other_simulator ? "not stated" : source.status,
                          one.other_simulator.value_or(""),
                          one.segments(),
                          {},
                          source.spacing_m,
                          {},
                          source.from_measured,
                          distance_of(row)};
  if (one.branch) made.branch = one.branch->number;
  if (one.levels) made.mesh_error_m = one.levels->left_m;
  return made;
}

ReportedBranches branches_of(const DrapeInput& input, const BranchSet& set) {
  ReportedBranches made{set.label, set.sha256, branch_sentence(input, set), {}};
  for (const BranchComparison& one : set.branches) {
    const Branch& branch = *input.simulations[one.as_placed.simulation].branch;
    std::optional<double> shape_m;
    if (one.as_placed.aligned) shape_m = one.as_placed.aligned->after.mean_m;
    made.branches.push_back({branch.number, branch.share, &one == &set.branches[set.nearest],
                             branch.stable, one.match_m(), shape_m});
  }
  return made;
}

std::vector<ReportedMark> marks_of(const DrapeInput& input, const Report& report) {
  std::map<MarkId, ReportedMark> marks;
  const auto at = [&](MarkId id) -> ReportedMark& {
    ReportedMark& mark = marks[id];
    mark.row = id.row;
    mark.col = id.col;
    return mark;
  };
  for (const SheetMark& measured : input.measured.sheet.marks) {
    ReportedMark& mark = at(measured.mark);
    mark.real_in_world = measured.point_in_world;
    mark.views = measured.views;
    if (measured.covariance_m2) mark.sigma_m = worst_sigma_m(*measured.covariance_m2);
  }
  for (const Gap& gap : input.measured.sheet.gaps) at(gap.mark).gap = gap.reason;
  if (const auto list = speaking_list(input)) {
    for (const BandMark& band : list->band) {
      ReportedMark& mark = at(band.mark);
      mark.band_in_world = band.mean_in_world;
      mark.band_radius_m = band.radius95_m;
    }
  }
  std::vector<ReportedMark> list;
  if (report.headline) {
    const MarkComparison& compared = report.real_virtual[*report.headline].marks;
    for (const Excluded& gap : compared.excluded) at(gap.mark).gap = gap.reason;
    for (const MarkError& error : compared.marks) {
      ReportedMark& mark = at(error.mark);
      mark.virtual_in_world = error.virtual_in_world;
      mark.distance_m = error.distance_m;
      mark.sigma_distance_m = error.sigma_distance_m;
    }
  }
  for (auto& [id, mark] : marks) list.push_back(std::move(mark));
  return list;
}

/// Text such as "box 128 x 128 x 40 mm, table", without planes that are level below everything.
std::string objects_of(const Scene& scene) {
  std::vector<std::string> words;
  const auto add = [&](const Obstacle& obstacle) {
    if (const auto* sphere = std::get_if<Sphere>(&obstacle)) {
      words.push_back(fmt::format("sphere {:g} mm", 2 * sphere->radius_m / mm));
    } else if (const auto* box = std::get_if<Box>(&obstacle)) {
      const Eigen::Vector3d size = box->size_m / mm;
      words.push_back(fmt::format("box {:g} x {:g} x {:g} mm", size.x(), size.y(), size.z()));
    } else if (const auto* cylinder = std::get_if<Cylinder>(&obstacle)) {
      words.push_back(fmt::format("cylinder {:g} mm, {:g} mm high", 2 * cylinder->radius_m / mm,
                                  cylinder->height_m / mm));
    } else if (const auto* mesh = std::get_if<MeshObject>(&obstacle)) {
      words.push_back("mesh " + mesh->file.stem().string());
    }
  };
  std::for_each(scene.obstacles.begin(), scene.obstacles.end(), add);
  if (!scene.pins.empty()) words.push_back(fmt::format("{} pins", scene.pins.size()));
  if (!scene.clamps.empty()) words.push_back(fmt::format("{} clamps", scene.clamps.size()));
  return fmt::format("{}", fmt::join(words, ", "));
}

/// Noise lengthens every distance, by at most sigma^2 / d each to second order.
std::optional<double> noise_excess_m(const RealVirtual& row) {
  double sum = 0;
  for (const MarkError& mark : row.marks.marks) {
    if (!mark.sigma_mark_m || !(mark.distance_m > 0)) return std::nullopt;
    sum += std::min(*mark.sigma_mark_m * *mark.sigma_mark_m / mark.distance_m, *mark.sigma_mark_m);
  }
  return sum / static_cast<double>(row.marks.marks.size());
}

/// Sentences on the background of the headline's number.
std::vector<std::string> facts_of(const DrapeFiles& drape, const Report& report) {
  std::vector<std::string> facts;
  const auto add = [&](const std::string& what, const std::string& sentence) {
    if (!sentence.empty()) facts.push_back(what + sentence);
  };
  const RealVirtual& headline = report.real_virtual[*report.headline];
  if (report.budget) add("", budget_sentence(*report.budget));
  add("mesh: ", mesh_sentence(drape.input, report));
  for (const BranchSet& set : report.branch_sets) {
    add(fmt::format("branches of {}: ", set.label), branch_sentence(drape.input, set));
    const Simulation& first = drape.input.simulations[set.branches.front().as_placed.simulation];
    if (!first.is_of_cloth_of(*drape.input.speaker())) continue;
    const auto list = list_above(first.sheet.file, set.sha256);
    if (list && list->members_at_rest) add("ensemble: ", ensemble_sentence(*list));
    if (!list || drape.input.speaking_branch()->branch->set_sha256 != set.sha256) continue;
    if (list->friction_band) add("friction: ", friction_sentence(*list->friction_band));
    if (list->memory_band) add("internal friction: ", memory_sentence(*list->memory_band));
  }
  if (drape.error_split)
    if (const std::string sentence = error_split_sentence(*drape.error_split); !sentence.empty())
      add(fmt::format("over {} marks, ", drape.error_split->marks), sentence);
  if (const auto& budget = drape.input.measured.sheet.error_budget)
    add("of a mark, RMS over the sheet: ",
        fmt::format("noise of the dots' centres {:.4f} mm, bent and slanted dots {:.4f} mm{}",
                    budget->detection_m / mm, budget->dot_shape_m / mm,
                    budget->calibration_m
                        ? fmt::format(", cameras {:.4f} mm", *budget->calibration_m / mm)
                        : std::string()));
  if (const auto excess = noise_excess_m(headline))
    add("noise only lengthens a distance: ",
        fmt::format("the mean is at most {:.4f} mm too long, which is not subtracted",
                    *excess / mm));
  const StrainSummary& s = headline.strain.difference;
  if (s.warp && s.weft && s.area)
    add("real minus virtual strain between marks, RMS: ",
        fmt::format("{:.2f} % along the warp, {:.2f} % along the weft, {:.2f} % of area",
                    *s.warp / percent, *s.weft / percent, *s.area / percent));
  return facts;
}

std::string capital(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

/// Text: "from the measured shape it rests 13.2 mm away (8 to 13 mm by friction 0.2 to 0.8)".
std::string model_words(const ModelRest& model, const std::optional<double>& u_mm) {
  std::string text = fmt::format("Started from the measured shape it rests {} mm away",
                                 figure(model.distance_m / mm, u_mm));
  if (!model.range.empty())
    text += fmt::format(" ({} to {} mm by {}, not measured)", figure(model.least_m / mm, u_mm),
                        figure(model.largest_m / mm, u_mm), model.range);
  if (model.other_branch)
    text += *model.other_branch ? ", on another branch" : ", on the same branch";
  return text + ".";
}

/// Explains the match in one or two sentences.
std::string why_of(const Report& report) {
  if (!report.go()) return capital(report.no_go.front()) + ".";
  if (!report.headline || !report.budget) return capital(report.match.reason) + ".";
  const MatchVerdict& match = report.match;
  const Budget& budget = *report.budget;
  std::optional<double> u;  // a lower bound of U rounds nothing
  if (budget.missing.empty()) u = budget.expanded_m / mm;
  const std::string open = figure((budget.inputs_m + budget.own_m) / mm, u);
  std::string why;
  if (match.match == Match::none) {
    why = "No limit is stated, and fewer than three layings show how far real drapes differ.";
  } else {
    const std::string limit =
        fmt::format("{} mm ({})", figure(*match.limit_m / mm, u), match.rests_on);
    if (match.match == Match::inside)
      why = fmt::format("Within the limit of {} even with all that is open ({} mm).", limit, open);
    else if (match.match == Match::outside)
      why =
          fmt::format("Beyond the limit of {} even without all that is open ({} mm).", limit, open);
    else if (!budget.missing.empty())
      why = fmt::format(
          "Beside the limit of {} nothing is decided: U lacks {}{}.", limit, budget.missing.front(),
          budget.missing.size() > 1 ? fmt::format(" and {} more", budget.missing.size() - 1)
                                    : std::string());
    else if (decide(*match.value_m, budget.inputs_m + budget.own_m, *match.limit_m) ==
             Match::outside)
      why = fmt::format("Beyond the limit of {}, but another start's branch is within it.", limit);
    else
      why = fmt::format("The limit of {} lies within what is open ({} mm).", limit, open);
  }
  if (match.model && match.match != Match::inside) why += " " + model_words(*match.model, u);
  return why;
}

/// Names the next action; empty if none is needed.
std::string next_of(const Report& report) {
  if (!report.go()) return "mend the cause and run again.";
  const auto sentence = [](const std::string& text) { return text.empty() ? text : text + "."; };
  if (!report.headline) return "simulate the drape.";
  if (!report.match.remedies.empty()) return sentence(report.match.remedies.front());
  if (report.match.match == Match::inside || !report.budget) return {};
  for (const std::string& missing : report.budget->missing)
    if (missing.find('`') != std::string::npos) return "complete U: " + missing + ".";
  // Takes the remedy of the largest contribution that can be reduced.
  for (const BudgetLine& line : report.budget->lines)
    if (!line.remedy.empty() && !line.own_m && line.rectangular)
      return fmt::format("{} ({}).", line.remedy, line.origin);
  if (report.repeats.size() < 3) return "lay it twice more, to see how far real drapes differ.";
  return {};
}

ReportedDrape drape_of(const DrapeFiles& files, const Report& report, const Session& session,
                       const fs::path& folder) {
  const DrapeInput& input = files.input;
  ReportedDrape drape;
  drape.name = report.name;
  drape.label = report.called();
  drape.set = input.measured.measured().set;
  drape.rig = input.measured.measured().rig;
  if (input.scene) drape.object = objects_of(*input.scene);
  drape.no_go = report.no_go;
  drape.measured_marks = report.measurement.marks;
  drape.gaps = report.measurement.gaps;
  drape.sigma_median_m = report.measurement.sigma_median_m;
  drape.sigma_max_m = report.measurement.sigma_max_m;
  drape.match = report.match;
  drape.budget = report.budget;
  drape.why = why_of(report);
  drape.next = next_of(report);
  drape.repeats = report.repeats;
  for (const RealVirtual& row : report.real_virtual)
    drape.simulations.push_back(simulation_of(input.simulations[row.simulation], row));
  for (const BranchSet& set : report.branch_sets)
    drape.branch_sets.push_back(branches_of(input, set));
  drape.marks = marks_of(input, report);
  drape.tables = tables_of(files, report);
  if (!report.headline) return drape;
  const ReportedSimulation& speaks = drape.simulations[*report.headline];
  drape.simulation = speaks.label;
  drape.fabric = speaks.fabric;
  drape.distance = speaks.distance;
  drape.facts = facts_of(files, report);
  drape.views = views_of(files, report, session, folder);
  drape.shape = shape_of(input, report);
  return drape;
}

ReportedCalibration calibration_of(const Session& session) {
  const Calibration& own = *session.calibration;
  ReportedCalibration made{own.method,
                           session.calibration_sha256,
                           own.no_go.value_or(""),
                           static_cast<int>(own.sets.size()),
                           {},
                           {},
                           own.warnings};
  for (const CalibratedCamera& one : own.cameras)
    made.cameras.push_back({one.camera.name, one.residuals.points, one.residuals.rms_px,
                            one.residuals.max_px, one.residuals.object_rms_mm * mm,
                            one.valid_region_px, one.camera.model.width_px,
                            one.camera.model.height_px});
  // Findings that are not in the file: error on views not used by the fit, and the stages.
  if (const auto ending = kept_ending(run_record_path(session.calibration_file)))
    made.findings = ending->numbers;
  return made;
}

/// True for a command in backticks or a sentence that asks for an action.
bool asks(const std::string& text) {
  static const std::regex action(
      "`drape|(: |; )(measure|state|lay|simulate|correct|check|give|keep|import|level|write) ");
  return std::regex_search(text, action);
}

std::vector<ReportedNote> notes_of(const Outcome& outcome) {
  std::vector<ReportedNote> notes;
  const auto add = [&](const std::string& text, bool stops) {
    ReportedNote note{stops        ? Severity::stops
                      : asks(text) ? Severity::asks
                                   : Severity::informs,
                      kind_of_note(text), "", text};
    for (const Report& report : outcome.reports)
      if (text.starts_with(report.called() + ": ") ||
          text.find("(drape " + report.name + ")") != std::string::npos)
        note.drape = report.called();
    notes.push_back(std::move(note));
  };
  for (const std::string& reason : outcome.reasons()) add(reason, true);
  for (const std::string& warning : outcome.warnings) add(warning, false);
  std::stable_sort(notes.begin(), notes.end(), [](const ReportedNote& a, const ReportedNote& b) {
    return a.severity < b.severity;
  });
  return notes;
}

/// All values of a drape's scene and fabric files, with stand-ins marked.
Table values_table(const std::vector<RunValue>& values, const Report& report,
                   const std::optional<Scene>& scene) {
  Table table({"file", "value", "is", "measured"});
  table.title = "Scene and fabric";
  const std::string fabric = scene ? "fabric " + scene->fabric_file.stem().string() : "";
  for (const RunValue& value : values)
    if ((value.owner == "scene " + report.name || value.owner == fabric) &&
        value.key != "stand_ins")
      table.add({value.owner, value.key, value.value, value.stand_in ? "no: stand-in" : ""});
  return table;
}

/// Makes names of drapes usable for files and anchors of the page: anything except letters, digits,
/// `-` and `_` is replaced, and duplicates get a number. Headings keep the original name.
std::vector<std::string> safe_names(const std::vector<Report>& reports) {
  std::set<std::string> taken;
  std::vector<std::string> names;
  for (const Report& report : reports) {
    std::string name = report.name;
    for (char& c : name)
      if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_') c = '_';
    const std::string base = name;
    for (int n = 2; !taken.insert(name).second; ++n) name = fmt::format("{}_{}", base, n);
    names.push_back(name);
  }
  return names;
}

}  // namespace

std::string kind_of_note(const std::string& text) {
  static const std::regex step("^[a-z]+ \\([^)]*\\): "), drape("^[^:]{1,40}: "),
      number("[-+]?[0-9]+(\\.[0-9]+)?");
  std::string kind = std::regex_replace(text, step, "");
  if (kind == text) kind = std::regex_replace(kind, drape, "");
  kind = std::regex_replace(kind, number, "N");
  std::size_t end = kind.find_first_of(";(");
  if (const std::size_t colon = kind.rfind(':', end); colon != std::string::npos && colon > 30)
    end = colon;
  kind = kind.substr(0, end);
  return kind.substr(0, kind.find_last_not_of(' ') + 1);
}

RunReport account_of(const Session& session, const Outcome& outcome, const fs::path& folder) {
  RunReport report;
  report.program = "drapebench " + version();
  report.label = outcome.label;
  report.operator_name = outcome.operator_name;
  report.date = outcome.date;
  report.store = fs::path(outcome.store).filename().string();
  if (outcome.run != 0) report.run = outcome.run;
  report.go = outcome.go();
  report.sentence = outcome.sentence();
  report.reasons = outcome.reasons();
  const std::vector<std::string> names = safe_names(outcome.reports);
  const std::vector<RunValue> values = values_of(session, outcome);
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    report.drapes.push_back(drape_of(session.drapes[i], outcome.reports[i], session, folder));
    report.drapes.back().name = names[i];
    Table used = values_table(values, outcome.reports[i], session.drapes[i].input.scene);
    if (!used.rows.empty()) report.drapes.back().tables.push_back({"values", "", std::move(used)});
  }
  for (const VirtualGroup& group : outcome.groups)
    report.virtual_groups.push_back({"virtual-" + std::to_string(report.virtual_groups.size() + 1),
                                     "", virtual_group_table(group)});
  if (!report.drapes.empty()) report.rig = report.drapes.front().rig;
  if (session.calibration) report.calibration = calibration_of(session);
  report.notes = notes_of(outcome);
  report.provenance = provenance_of(session, outcome, folder);
  return report;
}

}  // namespace drape::compare
