// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/match.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "compare/tables/budget.hpp"
#include "core/error.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

constexpr double kBand = 0.95;  // least fraction of marks within their 95 % bands of a drape

RepeatId id_of(const SheetFile& file) {
  return file.repeat.value_or(RepeatId{"", file.measured().set, ""});
}

std::string face_text(const std::string& face) {
  return face.empty() ? "not stated" : "`" + face + "`";
}

/// RMS distance of the common marks.
std::optional<double> apart_m(const Sheet& a, const Sheet& b) {
  double squares = 0;
  int count = 0;
  for (const SheetMark& mark : a.marks) {
    const SheetMark* other = b.find(mark.mark);
    if (other == nullptr) continue;
    squares += (mark.point_in_world - other->point_in_world).squaredNorm();
    ++count;
  }
  return count > 0 ? std::optional(std::sqrt(squares / count)) : std::nullopt;
}

/// Reason why a laying is not a repeat of the drape's own; empty if it is.
std::string left_out(const SheetFile& own_file, const SheetFile& other_file) {
  const Sheet &own = own_file.sheet, &other = other_file.sheet;
  const std::string face = id_of(own_file).face, its_face = id_of(other_file).face;
  if (other.no_go) return "its measurement is NO-GO: " + *other.no_go;
  if (face != its_face)
    return fmt::format("its upper face is {}, the drape's is {}", face_text(its_face),
                       face_text(face));
  if (own_file.measured().calibration_sha256 != other_file.measured().calibration_sha256)
    return "it was measured with another calibration";
  if (own.rows != other.rows || own.cols != other.cols ||
      (own.patch_m - other.patch_m).norm() > 0.01 * mm)
    return "it is another patch or print";
  if (own_file.asked && other_file.asked)
    if (const auto why = difference_of(own_file.asked->surroundings, other_file.asked->surroundings,
                                       "in its scene"))
      return "its object is not where the drape's own was: " + *why;
  return apart_m(own, other) ? "" : "it has no mark in common with the drape's own";
}

/// Mean distance between different repeats.
double mean_apart_m(const RepeatBasis& basis) {
  std::vector<double> values;
  for (std::size_t i = 0; i < basis.real_to_real_m.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) values.push_back(basis.real_to_real_m[i][j]);
  return values.empty() ? 0 : mean_of(values);
}

const MarkRepeats::SheetMatch* among(const Report& report) {
  return report.among_repeats ? &report.among_repeats->matches.front() : nullptr;
}

int repeats_of(const Report& report) {
  return static_cast<int>(
      std::count_if(report.repeats.begin(), report.repeats.end(),
                    [](const RepeatLine& line) { return line.left_out.empty(); }));
}

void add_repeats(const Report& report, std::vector<MatchBasis>& bases) {
  const MarkRepeats::SheetMatch* match = among(report);
  if (match == nullptr) return;
  for (const RepeatBasis& one : match->bases) {
    MatchBasis basis{"repeats: " + one.what, Match::undecided, {}, {}, "mm", one.judgement.p, {}};
    if (one.virtual_to_real_m.empty()) {
      basis.reason = one.reason;
    } else {
      basis.value = mean_of(one.virtual_to_real_m) / mm;
      basis.reason = fmt::format("{:.3f} mm from the repeats, which lie {:.3f} mm apart",
                                 *basis.value, mean_apart_m(one) / mm);
      if (!one.reason.empty()) basis.reason += "; " + one.reason;
    }
    if (basis.p) basis.verdict = *basis.p < report.significance ? Match::outside : Match::inside;
    bases.push_back(std::move(basis));
  }
}

void add_ensemble(const std::optional<PlacedDrape>& ensemble, std::vector<MatchBasis>& bases) {
  if (!ensemble || !ensemble->nearest || !ensemble->distance_m || !ensemble->reach_m) return;
  MatchBasis branch{"branch", ensemble->branch ? Match::inside : Match::outside, {}, {}, "mm", {},
                    {}};
  branch.value = *ensemble->distance_m / mm;
  branch.limit = *ensemble->reach_m / mm;
  branch.reason =
      ensemble->branch
          ? fmt::format("the real drape is on branch {} of the ensemble", *ensemble->branch)
          : fmt::format("the real drape is on no branch of the ensemble, {} is nearest",
                        *ensemble->nearest);
  bases.push_back(std::move(branch));
  if (!ensemble->inside_fraction) return;
  const bool in = *ensemble->inside_fraction >= kBand;
  MatchBasis band{"band", in ? Match::inside : Match::outside, {}, {}, "%", {}, {}};
  band.value = 100 * (1 - *ensemble->inside_fraction);
  band.limit = 100 * (1 - kBand);
  band.reason = fmt::format("{:.0f} % of its marks are in their 95 % bands",
                            100 * *ensemble->inside_fraction);
  bases.push_back(std::move(band));
}

/// Limit of the match, with the value compared to it.
struct Limit {
  double value_m = 0, limit_m = 0;
  std::string what, rests_on;
  std::optional<double> p;
};

std::optional<Limit> limit_of(const Options& options, const Report& report) {
  if (const MarkRepeats::SheetMatch* match = among(report))
    if (const auto limit = limit_m(*match, report.significance))
      return Limit{mean_of(match->bases.front().virtual_to_real_m), *limit, "repeats",
                   fmt::format("{} repeats", repeats_of(report)), match->p};
  if (!options.tolerance_m) return std::nullopt;
  return Limit{report.real_virtual[*report.headline].statistics.mean_m,
               *options.tolerance_m,
               "tolerance",
               "tolerance",
               {}};
}

/// Remedies that together could reduce the open contributions below `room_m`, largest first; empty
/// if even all of them cannot. Halving a mesh spacing halves its contribution, every other remedy
/// removes one.
std::vector<std::string> remedies_of(const Budget& budget, double room_m) {
  std::vector<BudgetLine> lines = budget.lines;
  const auto open_m = [&] {
    double own_m = 0;
    std::vector<BudgetLine> of_inputs;
    for (const BudgetLine& line : lines)
      if (line.own_m)
        own_m += *line.own_m;
      else
        of_inputs.push_back(line);
    return half_width_m(of_inputs) + own_m;
  };
  std::vector<BudgetLine*> open;
  for (BudgetLine& line : lines)
    if (!line.remedy.empty()) open.push_back(&line);
  const auto size_m = [](const BudgetLine* line) { return line->own_m.value_or(2 * line->u_m); };
  std::stable_sort(open.begin(), open.end(),
                   [&](const BudgetLine* a, const BudgetLine* b) { return size_m(a) > size_m(b); });
  std::vector<std::string> remedies;
  for (BudgetLine* line : open) {
    if (open_m() < room_m) break;
    if (size_m(line) > 0 &&
        std::find(remedies.begin(), remedies.end(), line->remedy) == remedies.end())
      remedies.push_back(line->remedy);
    if (line->own_m) line->own_m = 0.5 * *line->own_m;
    line->u_m = 0;
  }
  return open_m() < room_m ? remedies : std::vector<std::string>();
}

/// A branch from another start that is within the limit while the headline is not; null if branches
/// cannot be distinguished at the headline's distance.
const BranchComparison* branch_within(const DrapeInput& input, const Report& report,
                                      const Limit& limit) {
  const auto list = speaking_list(input);
  if (!list || !(list->linked_m < limit.value_m)) return nullptr;
  for (const BranchSet& set : report.branch_sets) {
    if (set.sha256 != list->document.sha256()) continue;
    for (const BranchComparison& one : set.branches)
      if (one.as_placed.statistics.mean_m <= limit.limit_m &&
          input.simulations[one.as_placed.simulation].branch->starts > 0)
        return &one;
  }
  return nullptr;
}

/// Mean distance of the marks of two simulations, on a round object after the best rotation.
std::optional<double> apart_m(const DrapeInput& input, const RealVirtual& one,
                              const RealVirtual& other, bool round) {
  Sheet places = input.measured.sheet;
  places.marks.clear();
  for (const MarkError& mark : one.marks.marks) {
    SheetMark moved = *input.measured.sheet.find(mark.mark);
    moved.point_in_world = mark.virtual_in_world;
    places.marks.push_back(moved);
  }
  const SheetFile& sheet = input.simulations[other.simulation].sheet;
  const Surface surface(sheet.sheet, sheet.file.string());
  const auto axis = round && input.scene ? axis_of(*input.scene) : std::nullopt;
  if (axis)
    if (const auto turned = best_turn(places, surface, *axis)) return turned->mean_m;
  const MarkComparison compared = compare_marks(places, surface);
  return compared.marks.empty() ? std::nullopt
                                : std::optional(statistics_of(compared.marks).mean_m);
}

/// The drape of the headline's cloth from the measured shape, on the same mesh.
const RealVirtual* from_measured(const DrapeInput& input, const Report& report) {
  const Simulation& own = input.simulations[report.real_virtual[*report.headline].simulation];
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& one = input.simulations[row.simulation];
    if (!one.other_simulator && !one.branch && one.source().from_measured &&
        one.source().status == "at rest" && one.is_of_cloth_of(own) &&
        one.discretisation() == own.discretisation() && one.segments() == own.segments())
      return &row;
  }
  return nullptr;
}

std::optional<ModelRest> model_of(const DrapeInput& input, const Report& report) {
  const RealVirtual* row = from_measured(input, report);
  const auto& placed = input.placed;
  if (row == nullptr && !(placed && placed->started_there_m)) return std::nullopt;
  ModelRest model;
  model.distance_m = row != nullptr ? row->statistics.mean_m : *placed->started_there_m;
  model.least_m = model.largest_m = model.distance_m;
  const auto range = input.scene ? input.scene->friction_range() : std::nullopt;
  if (range && placed) {
    const auto widen = [&](double at_m) {
      model.least_m = std::min(model.least_m, at_m);
      model.largest_m = std::max(model.largest_m, at_m);
    };
    model.range = fmt::format("friction {:g} to {:g}", range->front(), range->back());
    if (placed->started_there_m) widen(*placed->started_there_m);
    for (const OtherFriction& other : placed->other_frictions)
      if (other.distance_m)
        widen(*other.distance_m);
      else
        model.lost.push_back(fmt::format("friction {:g}: {}", other.friction, other.ending));
  }
  if (const auto list = speaking_list(input); list && row != nullptr) {
    model.apart_m = apart_m(input, report.real_virtual[*report.headline], *row, list->round);
    if (model.apart_m) model.other_branch = *model.apart_m > list->linked_m;
  }
  return model;
}

/// Phrase such as "; from the measured shape it rests at 13.2 mm (8.4 to 13.2 mm for friction 0.2
/// to 0.8, which nobody measured), on another branch".
std::string model_phrase(const ModelRest& model) {
  std::string text =
      fmt::format("; from the measured shape it rests at {:.3f} mm", model.distance_m / mm);
  if (!model.range.empty())
    text += fmt::format(" ({:.3f} to {:.3f} mm for {}, which nobody measured{})",
                        model.least_m / mm, model.largest_m / mm, model.range,
                        model.lost.empty() ? "" : fmt::format("; {}", fmt::join(model.lost, "; ")));
  if (model.other_branch) text += *model.other_branch ? ", on another branch" : ", on this branch";
  return text;
}

/// Text such as "3.887 mm beside T = 3.500 mm (tolerance): undecided, for 0.2 mm by inputs and 0.5
/// mm by the mesh are open".
std::string decision_text(const Limit& limit, const Budget& budget) {
  return fmt::format(
      "{:.3f} mm beside a limit of {:.3f} mm ({}), with {:.3f} mm open by the inputs (95 %) and "
      "{:.3f} mm by the simulation's own error",
      limit.value_m / mm, limit.limit_m / mm, limit.rests_on, budget.inputs_m / mm,
      budget.own_m / mm);
}

/// Decides by the limit; if undecided, states the cause and what could lead to a decision.
void judge_by(const Limit& limit, const DrapeInput& input, const Report& report,
              MatchVerdict& verdict) {
  const Budget& budget = *report.budget;
  verdict.value_m = limit.value_m;
  verdict.limit_m = limit.limit_m;
  verdict.rests_on = limit.rests_on;
  verdict.match = decide(limit.value_m, budget.inputs_m + budget.own_m, limit.limit_m);
  verdict.reason = decision_text(limit, budget);
  if (!budget.missing.empty()) {
    verdict.match = Match::undecided;
    verdict.reason += fmt::format("; the budget lacks {}", fmt::join(budget.missing, "; "));
  } else if (verdict.match == Match::undecided) {
    verdict.remedies = remedies_of(budget, std::abs(limit.value_m - limit.limit_m));
    if (verdict.remedies.empty() && limit.what == "tolerance")
      verdict.remedies.push_back("lay the cloth three times: their scatter is then the limit");
  } else if (verdict.match == Match::outside) {
    if (const BranchComparison* other = branch_within(input, report, limit)) {
      verdict.match = Match::undecided;
      const RealVirtual& there = other->as_placed;
      verdict.reason += fmt::format("; another start gives branch {}, {:.3f} mm away",
                                    input.simulations[there.simulation].branch->number,
                                    there.statistics.mean_m / mm);
    }
  }
  if (!verdict.remedies.empty())
    verdict.reason += fmt::format("; to decide: {}", fmt::join(verdict.remedies, ", "));
  MatchBasis basis{limit.what, verdict.match, limit.value_m / mm,          limit.limit_m / mm,
                   "mm",       limit.p,       decision_text(limit, budget)};
  verdict.bases.insert(verdict.bases.begin(), std::move(basis));
}

std::string number_text(const std::optional<double>& value, const std::string& unit) {
  return value ? fmt::format("{:.3f} {}", *value, unit) : std::string();
}

}  // namespace

void judge_repeats(const DrapeInput& input, const Options& options, Report& report) {
  report.significance = options.significance;
  if (input.repeats.empty()) return;
  const SheetFile& own = input.measured;
  const auto line_of = [](const SheetFile& file) {
    const RepeatId id = id_of(file);
    return RepeatLine{{}, file.measured().set, id.name, id.face, {}, {}};
  };
  report.repeats.push_back(line_of(own));
  std::vector<SheetFile> repeats = {own};
  for (std::size_t i = 0; i < input.repeats.size(); ++i) {
    const SheetFile& other = input.repeats[i];
    RepeatLine line = line_of(other);
    line.input = i;
    line.left_out = left_out(own, other);
    line.from_own_m = apart_m(own.sheet, other.sheet);
    if (line.left_out.empty()) repeats.push_back(other);
    report.repeats.push_back(std::move(line));
  }
  if (!report.headline || repeats.size() < 2) return;
  const SheetFile& chosen =
      input.simulations[report.real_virtual[*report.headline].simulation].sheet;
  try {
    report.among_repeats = mark_repeats(repeats, {chosen}, options.significance);
  } catch (const Error& error) {
    report.warnings.push_back("the repeats cannot be judged: " + error.what_failed());
  }
}

Match decide(double value_m, double open_m, double limit_m) {
  return value_m + open_m <= limit_m  ? Match::inside
         : value_m - open_m > limit_m ? Match::outside
                                      : Match::undecided;
}

MatchVerdict match_of(const DrapeInput& input, const Options& options, const Report& report) {
  MatchVerdict verdict;
  if (!report.headline || !report.budget) {
    verdict.reason = "nothing was compared mark by mark";
    return verdict;
  }
  if (report.budget->expanded_m > 0)
    verdict.error_number =
        report.real_virtual[*report.headline].statistics.mean_m / report.budget->expanded_m;
  add_repeats(report, verdict.bases);
  add_ensemble(input.placed, verdict.bases);
  verdict.model = model_of(input, report);
  if (!report.go()) {
    verdict.match = Match::undecided;
    verdict.reason = "the measurement is NO-GO: " + report.no_go.front();
    return verdict;
  }
  if (const auto limit = limit_of(options, report)) {
    judge_by(*limit, input, report, verdict);
  } else {
    verdict.remedies = {"lay the cloth three times", "state tolerance_mm in the rig"};
    verdict.reason = "nothing says how far a match may lie: " + verdict.remedies.front() + ", or " +
                     verdict.remedies.back();
  }
  if (verdict.model) verdict.reason += model_phrase(*verdict.model);
  return verdict;
}

std::string name_of(Match match) {
  return std::string(drape::name_of(match));
}

Table basis_table(const Report& report) {
  Table table({"judged by", "verdict", "value", "limit", "p", "why"}, {2, 3, 4});
  for (const MatchBasis& basis : report.match.bases)
    table.add({basis.what, name_of(basis.verdict), number_text(basis.value, basis.unit),
               number_text(basis.limit, basis.unit),
               basis.p ? fmt::format("{:.3f}", *basis.p) : std::string(), basis.reason});
  return table;
}

Table repeats_table(const Report& report) {
  Table table({"repeat", "set", "face", "RMS from the drape's own (mm)", "left out because"}, {3});
  for (const RepeatLine& line : report.repeats)
    table.add({line.repeat, line.set, line.face,
               line.from_own_m ? fmt::format("{:.3f}", *line.from_own_m / mm) : std::string(),
               line.left_out});
  return table;
}

}  // namespace drape::compare
