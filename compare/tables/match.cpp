// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/match.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

constexpr double kBand = 0.95;  // share of marks in their 95 % bands: the drape is in the band

RepeatId id_of(const SheetFile& file) {
  return file.repeat.value_or(RepeatId{"", file.measured().set, ""});
}

std::string face_text(const std::string& face) {
  return face.empty() ? "not stated" : "`" + face + "`";
}

/// Root mean square distance of the marks that both have.
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

/// Why a laying is no repeat of the drape's own; empty: it is one.
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

double mean_of_distances(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

/// Mean distance of two different repeats.
double mean_apart_m(const RepeatBasis& basis) {
  std::vector<double> values;
  for (std::size_t i = 0; i < basis.real_to_real_m.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) values.push_back(basis.real_to_real_m[i][j]);
  return mean_of_distances(values);
}

const MarkRepeats::SheetMatch* among(const Report& report) {
  return report.among_repeats ? &report.among_repeats->matches.front() : nullptr;
}

int repeats_of(const Report& report) {
  return static_cast<int>(
      std::count_if(report.repeats.begin(), report.repeats.end(),
                    [](const RepeatLine& line) { return line.left_out.empty(); }));
}

MatchBasis by_uncertainty(const Report& report) {
  MatchBasis basis{"total uncertainty", Match::undecided, {}, {}, "mm", {}, {}};
  const double distance = report.real_virtual[*report.headline].statistics.mean_m / mm;
  const double limit = report.budget->expanded_m / mm;
  basis.value = distance;
  basis.limit = limit;
  if (distance <= limit) {
    basis.verdict = Match::inside;
    basis.reason = fmt::format("{:.3f} mm is within the total uncertainty U = {:.3f} mm (95 %)",
                               distance, limit);
  } else if (!report.budget->missing.empty()) {
    basis.reason = fmt::format("{:.3f} mm is above U = {:.3f} mm, but the budget lacks {}",
                               distance, limit, fmt::join(report.budget->missing, "; "));
  } else {
    basis.verdict = Match::outside;
    basis.reason = fmt::format("{:.3f} mm is above the total uncertainty U = {:.3f} mm (95 %)",
                               distance, limit);
  }
  return basis;
}

void add_repeats(const Report& report, std::vector<MatchBasis>& bases) {
  const MarkRepeats::SheetMatch* match = among(report);
  if (match == nullptr) return;
  for (const RepeatBasis& one : match->bases) {
    MatchBasis basis{"repeats: " + one.what, Match::undecided, {}, {}, "mm", one.judgement.p, {}};
    if (one.virtual_to_real_m.empty()) {
      basis.reason = one.reason;
    } else {
      basis.value = mean_of_distances(one.virtual_to_real_m) / mm;
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

/// The real drape is one that another start gives.
bool is_on_branch(const std::vector<MatchBasis>& bases) {
  int inside = 0;
  for (const MatchBasis& basis : bases)
    inside += (basis.what == "branch" || basis.what == "band") && basis.verdict == Match::inside;
  return inside == 2;
}

bool has_ensemble(const std::vector<MatchBasis>& bases) {
  return std::any_of(bases.begin(), bases.end(),
                     [](const MatchBasis& basis) { return basis.what == "branch"; });
}

/// Phrase about the real drape in the ensemble.
std::string ensemble_phrase(const std::vector<MatchBasis>& bases) {
  std::string text;
  for (const MatchBasis& basis : bases)
    if (basis.what == "branch" || basis.what == "band")
      text += (text.empty() ? "; " : ", ") + basis.reason;
  return text;
}

/// By the repeats, which have a p.
void rest_on_repeats(const Report& report, MatchVerdict& verdict) {
  const MarkRepeats::SheetMatch& match = *among(report);
  const MatchBasis& uncertainty = verdict.bases.front();
  const int count = repeats_of(report);
  const std::string figures = fmt::format("(p {:.3f} at a significance of {:g}; marks {})",
                                          *match.p, report.significance, verdict.bases[1].reason);
  verdict.rests_on = fmt::format("{} repeats", count);
  if (match.verdict == Match::inside) {
    verdict.match = Match::inside;
    verdict.reason = fmt::format("it could be one more of the {} real drapes {}", count, figures);
  } else if (uncertainty.verdict == Match::inside) {
    verdict.reason = fmt::format(
        "it lies outside of the {} real drapes {}, but within the total uncertainty U: fabric or "
        "scene values may be why",
        count, figures);
  } else {
    verdict.match = Match::outside;
    verdict.reason = fmt::format("it lies outside of the {} real drapes {}", count, figures);
  }
}

/// By the total uncertainty and the ensemble: what there is of one drape.
void rest_on_uncertainty(const Report& report, MatchVerdict& verdict) {
  const MatchBasis& uncertainty = verdict.bases.front();
  const bool ensemble = has_ensemble(verdict.bases);
  verdict.match = uncertainty.verdict;
  verdict.reason = uncertainty.reason;
  if (uncertainty.verdict == Match::outside && is_on_branch(verdict.bases)) {
    verdict.match = Match::undecided;
    verdict.reason += ", but another start may give the real drape";
  }
  verdict.rests_on = ensemble ? "total uncertainty, ensemble" : "total uncertainty";
  const int count = std::max(1, repeats_of(report));
  verdict.reason += fmt::format(
      "; it rests on {} alone: {}", ensemble ? "U and the ensemble" : "U",
      count == 1 ? std::string("of one real drape nothing says how far repeats lie apart")
      : count < kLeastRepeats
          ? fmt::format("{} real drapes do not say how far repeats lie apart", count)
          : "the real drapes are copies of each other");
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

MatchVerdict match_of(const DrapeInput& input, const Report& report) {
  MatchVerdict verdict;
  if (!report.headline || !report.budget) {
    verdict.reason = "nothing was compared mark by mark";
    return verdict;
  }
  verdict.bases.push_back(by_uncertainty(report));
  add_repeats(report, verdict.bases);
  add_ensemble(input.placed, verdict.bases);
  if (!report.go()) {
    verdict.reason = "the measurement is NO-GO: " + report.no_go.front();
    return verdict;
  }
  if (const MarkRepeats::SheetMatch* match = among(report); match != nullptr && match->p)
    rest_on_repeats(report, verdict);
  else
    rest_on_uncertainty(report, verdict);
  verdict.reason += ensemble_phrase(verdict.bases);
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
