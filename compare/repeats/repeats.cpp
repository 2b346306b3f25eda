// SPDX-License-Identifier: Apache-2.0
#include "compare/repeats/repeats.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>

#include "compare/metrics/metrics.hpp"
#include "compare/records/provenance.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

constexpr double kPower = 0.9;
constexpr std::size_t kLeastForModes = 6;  // number of repeats
// Largest p in a combination, so that a good fit by one test does not hide a bad one by another.
constexpr double kMostP = 0.99;
constexpr double kMostModes = 100;  // above this, F hardly depends on their number

/// t of `value` relative to `repeats`, which have `dof` degrees of freedom of their own.
Judgement standardised(const std::vector<double>& repeats, double value, double dof,
                       const VariancePrior& prior) {
  Judgement result;
  result.mean = mean_of(repeats);
  result.dof = prior.dof + dof;
  if (result.dof <= 0) return result;
  const double own = dof > 0 ? squares_about_mean(repeats) : 0;
  result.sd = std::sqrt((prior.dof * prior.variance + own) / result.dof);
  const double spread = result.sd * std::sqrt(1 + 1 / static_cast<double>(repeats.size()));
  if (!(spread > 0)) return result;
  result.t = (value - result.mean) / spread;
  result.p = 1;  // the caller evaluates one side
  return result;
}

/// Sets the difference detected with kPower by a test at the quantile `level` of t.
void set_detectable(double level, std::size_t repeats, Judgement& result) {
  result.detectable = (student_quantile(level, result.dof) + student_quantile(kPower, result.dof)) *
                      result.sd * std::sqrt(1 + 1 / static_cast<double>(repeats));
}

using units::mm;

constexpr double kLeastBorder =
    0.75;  // fraction of the outermost marks; with fewer the polygon cuts off folds

using Points = Eigen::Matrix3Xd;

/// Marks that all repeats have, with a place on the virtual sheet if there is one.
std::vector<const SheetMark*> common_marks(const std::vector<SheetFile>& repeats,
                                           const Surface* surface = nullptr) {
  std::vector<const SheetMark*> common;
  for (const SheetMark& mark : repeats.front().sheet.marks)
    if ((surface == nullptr || surface->at(mark.material_m)) &&
        std::ranges::all_of(repeats, [&](const SheetFile& other) {
          return other.sheet.find(mark.mark) != nullptr;
        }))
      common.push_back(&mark);
  return common;
}

double rms_m(const Points& a, const Points& b) {
  return std::sqrt((a - b).colwise().squaredNorm().mean());
}

/// Compares shapes by one distance: the repeats with each other, and the virtual one with them.
template <class Shape, class Apart>
RepeatBasis basis_of(const char* what, const std::vector<Shape>& repeats, const Shape& own,
                     const Apart& apart, const VariancePrior& prior = {}) {
  RepeatBasis basis{what, {}, {}, {}, {}, prior};
  for (const Shape& a : repeats) {
    basis.real_to_real_m.emplace_back();
    for (const Shape& b : repeats)
      basis.real_to_real_m.back().push_back(&a == &b ? 0 : apart(a, b));
    basis.virtual_to_real_m.push_back(apart(a, own));
  }
  return basis;
}

/// Places of marks, one a column.
template <class PlaceOf>
Points places_of(const std::vector<const SheetMark*>& marks, const PlaceOf& place_of) {
  Points points(3, marks.size());
  for (std::size_t i = 0; i < marks.size(); ++i)
    points.col(static_cast<Eigen::Index>(i)) = place_of(*marks[i]);
  return points;
}

std::vector<Points> places_on(const std::vector<SheetFile>& sheets,
                              const std::vector<const SheetMark*>& marks) {
  std::vector<Points> points;
  for (const SheetFile& file : sheets)
    points.push_back(places_of(
        marks, [&](const SheetMark& mark) { return file.sheet.find(mark.mark)->point_in_world; }));
  return points;
}

Points places_on(const Surface& surface, const std::vector<const SheetMark*>& marks) {
  return places_of(
      marks, [&](const SheetMark& mark) { return surface.at(mark.material_m)->point_in_world; });
}

Hem hem_of(const Points& border) {
  std::vector<Eigen::Vector2d> outline;
  for (const auto& point : border.colwise()) outline.emplace_back(point.head<2>());
  return hem_of_outline(outline);
}

/// Judgement where the virtual sheet lies `times` as far from every repeat.
Judgement judged(const RepeatBasis& basis, double times, double significance) {
  Distances distances{basis.real_to_real_m, basis.virtual_to_real_m};
  for (double& d : distances.virtual_to_real) d *= times;
  return basis.what == "hem" ? judge_distance(distances, basis.prior, kCopies_m, significance)
                             : judge_points(distances, basis.prior);
}

/// Radius of the circle with the same area.
double radius_of(const Hem& hem) {
  return std::sqrt(hem.area_m2 / std::numbers::pi);
}

/// Adds hem, spectrum and area, or the reason why there are none.
void add_hems(const std::vector<SheetFile>& repeats, const Surface& surface,
              const std::vector<const SheetMark*>& marks, std::vector<RepeatBasis>& bases) {
  const Sheet& first = repeats.front().sheet;
  const std::vector<MarkId> border = border_of(first.rows, first.cols);
  std::vector<const SheetMark*> outermost;  // in cyclic order
  for (const MarkId& id : border)
    for (const SheetMark* mark : marks)
      if (mark->mark == id) outermost.push_back(mark);
  std::string reason;
  std::vector<Hem> hems;
  std::optional<Hem> own;
  if (static_cast<double>(outermost.size()) < kLeastBorder * static_cast<double>(border.size())) {
    reason =
        fmt::format("{} of {} outermost marks are on every sheet", outermost.size(), border.size());
  } else {
    try {
      for (const Points& points : places_on(repeats, outermost)) hems.push_back(hem_of(points));
      own = hem_of(places_on(surface, outermost));
    } catch (const Error& error) {
      reason = error.what_failed();
    }
  }
  if (!own) {
    for (const char* what : {"hem", "spectrum", "area"})
      bases.push_back({what, {}, {}, {}, reason});
    return;
  }
  const Points flat = places_of(outermost, [](const SheetMark& mark) {
    return Eigen::Vector3d(mark.material_m.x(), mark.material_m.y(), 0);
  });
  VariancePrior of_radius = published_priors().covered_radius;
  of_radius.variance *= std::pow(radius_of(hem_of(flat)), 2);
  std::vector<Eigen::VectorXd> orders;
  for (const Hem& one : hems) orders.push_back(order_amplitudes_m(one));
  const auto orders_apart_m = [](const auto& a, const auto& b) { return (a - b).norm(); };
  bases.push_back(basis_of("hem", hems, *own, hem_distance_m, published_priors().hem_score));
  bases.push_back(basis_of("spectrum", orders, order_amplitudes_m(*own), orders_apart_m));
  const auto radii_apart_m = [](const Hem& a, const Hem& b) {
    return std::abs(radius_of(a) - radius_of(b));
  };
  bases.push_back(basis_of("area", hems, *own, radii_apart_m, of_radius));
}

MarkRepeats::SheetMatch match_of(const std::vector<SheetFile>& repeats, const SheetFile& candidate,
                                 double significance) {
  const Surface surface(candidate.sheet, candidate.file.string());
  const auto marks = common_marks(repeats, &surface);
  if (marks.empty())
    throw bad_input("the virtual sheet has none of the repeats' marks",
                    {.file = candidate.file.string()}, "give a sheet of the same patch");
  MarkRepeats::SheetMatch match{
      candidate.file.string(), static_cast<int>(marks.size()), {}, {}, Match::undecided, {}};
  match.bases.push_back(
      basis_of("marks", places_on(repeats, marks), places_on(surface, marks), rms_m));
  if (static_cast<int>(repeats.size()) < kLeastRepeats) {
    match.reason = fmt::format("{} real drape{}: nothing says how far repeats lie apart",
                               repeats.size(), repeats.size() == 1 ? "" : "s");
    return match;
  }
  add_hems(repeats, surface, marks, match.bases);
  std::vector<Judgement> judgements;
  for (RepeatBasis& one : match.bases) {
    one.judgement = judged(one, 1, significance);
    judgements.push_back(one.judgement);
    if (!one.judgement.p && one.reason.empty()) one.reason = "the repeats are copies of each other";
  }
  // The marks of copies have no scatter; judging them would judge rounding.
  if (judgements.front().p) match.p = combined_p(judgements);
  if (match.p)
    match.verdict = *match.p < significance ? Match::outside : Match::inside;
  else
    match.reason = match.bases.front().reason;
  return match;
}

/// The probabilities of the tests that could be made.
std::vector<double> known_p(const std::vector<Judgement>& judgements) {
  std::vector<double> known;
  for (const Judgement& judgement : judgements)
    if (judgement.p) known.push_back(*judgement.p);
  return known;
}

struct RepeatRow {
  std::string sheet;
  std::vector<double> rms_m;
};
void fields(Fields& f, RepeatRow& row) {
  f({"sheet", "file"}, row.sheet);
  f({"rms_mm", "RMS distance of the marks from each repeat", mm}, row.rms_m);
}

[[noreturn]] void refuse(const SheetFile& sheet, const std::string& what, const std::string& field,
                         const std::string& remedy = "give layings and simulations of one drape") {
  throw bad_input(what, {.file = sheet.file.string(), .field = field}, remedy);
}

/// Throws for a simulation among the layings, which would change the range of real drapes.
void require_kinds(const std::vector<SheetFile>& repeats,
                   const std::vector<SheetFile>& virtual_sheets) {
  for (const SheetFile& sheet : repeats)
    if (!sheet.sheet.is_measured())
      refuse(sheet, "a simulation is no laying of the real cloth", "source",
             "give measured sheets, and each simulation after a --compare of its own");
  for (const SheetFile& sheet : virtual_sheets)
    if (sheet.sheet.is_measured())
      refuse(sheet, "a measured sheet is no simulation to be judged", "source",
             "give it among the layings, without --compare");
}

void require_same_bench(const SheetFile& sheet, const SheetFile& first) {
  const std::string other = first.file.string();
  if ((sheet.sheet.patch_m - first.sheet.patch_m).norm() > 0.01 * mm)
    refuse(sheet, "it is another patch than " + other, "patch_mm");
  if (!sheet.sheet.is_measured()) return;
  if (sheet.measured().calibration_sha256 != first.measured().calibration_sha256)
    refuse(sheet, "it was measured with another calibration than " + other,
           "source.calibration_sha256");
  if (sheet.face() != first.face())
    refuse(sheet, "another face of the cloth lies up than in " + other, "source.repeat.face");
}

/// Median of chi square over the common marks; nullopt if fewer than ten have
/// covariances.
std::optional<double> median_chi2(const Sheet& first, const Sheet& second) {
  constexpr std::size_t kLeastMarks = 10;
  std::vector<double> chi2;
  for (const SheetMark& mark : first.marks) {
    const SheetMark* other = second.find(mark.mark);
    if (other == nullptr || !mark.covariance_m2 || !other->covariance_m2) continue;
    const Eigen::Vector3d apart_m = other->point_in_world - mark.point_in_world;
    chi2.push_back(
        apart_m.dot((*mark.covariance_m2 + *other->covariance_m2).ldlt().solve(apart_m)));
  }
  return chi2.size() < kLeastMarks ? std::nullopt : std::optional(median(std::move(chi2)));
}

}  // namespace

void text_or_null(Fields& f, const Field& field, const std::string& text) {
  std::optional<std::string> written;
  if (!text.empty()) written = text;
  f(field, written);
}

Judgement judge_value(const std::vector<double>& repeats, double value, const VariancePrior& prior,
                      double significance) {
  if (repeats.empty()) return {};
  Judgement result = standardised(repeats, value, static_cast<double>(repeats.size()) - 1, prior);
  if (!result.p) return result;
  result.p = 2 * student_cdf(-std::abs(result.t), result.dof);
  set_detectable(1 - significance / 2, repeats.size(), result);
  return result;
}

Judgement judge_distance(const Distances& distances, const VariancePrior& prior, double least,
                         double significance) {
  const std::size_t n = distances.real_to_real.size();
  if (n < 2) return {};
  const auto log_of = [&](double d) { return std::log(std::max(d, least)); };
  std::vector<double> scores;
  for (std::size_t i = 0; i < n; ++i) {
    double sum = 0;
    for (std::size_t j = 0; j < n; ++j)
      if (j != i) sum += log_of(distances.real_to_real[i][j]);
    scores.push_back(sum / static_cast<double>(n - 1));
  }
  double score = 0;
  for (const double d : distances.virtual_to_real) score += log_of(d) / static_cast<double>(n);
  // Two repeats have a single distance and equal scores, which do not determine their spread.
  Judgement result = standardised(scores, score, n == 2 ? 0 : static_cast<double>(n) - 1, prior);
  if (!result.p) return result;
  result.p = student_cdf(-result.t, result.dof);
  set_detectable(1 - significance, n, result);
  return result;
}

Judgement judge_points(const Distances& distances, const VariancePrior& prior) {
  const std::size_t n = distances.real_to_real.size();
  Judgement result;
  if (n < 3) return result;
  const auto count = static_cast<double>(n), freedom = count - 1;
  Eigen::MatrixXd squares(n, n);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) squares(i, j) = std::pow(distances.real_to_real[i][j], 2);
  // Scalar products of the points about their mean (Torgerson 1952).
  const Eigen::MatrixXd centre =
      Eigen::MatrixXd::Identity(n, n) - Eigen::MatrixXd::Constant(n, n, 1 / count);
  const Eigen::MatrixXd products = -0.5 * centre * squares * centre;
  const double own_variance = products.trace() / freedom;
  if (!(own_variance > 0)) return result;
  const double variance =
      (prior.dof * prior.variance + freedom * own_variance) / (prior.dof + freedom);
  double from_mean = -squares.sum() / (2 * count * count);
  for (const double d : distances.virtual_to_real) from_mean += d * d / count;
  result.dof = 1;
  if (n >= kLeastForModes && prior.dof == 0) {
    const double all = variance * variance, own = products.squaredNorm() / (freedom * freedom);
    const double modes = (own - all / freedom) / (1 + 1 / freedom - 2 / (freedom * freedom));
    const double sum = all - 2 * modes / freedom;
    result.dof = modes * kMostModes > sum ? std::max(1.0, sum / modes) : kMostModes;
  }
  const double f = from_mean / (1 + 1 / count) / variance;
  result.sd = std::sqrt(variance);
  result.t = std::sqrt(std::max(0.0, f));
  result.p = f_tail(f, result.dof, prior.dof + result.dof * freedom);
  return result;
}

std::optional<double> joint_p(const std::vector<Judgement>& judgements) {
  const std::vector<double> known = known_p(judgements);
  if (known.empty()) return std::nullopt;
  return std::min(1.0, static_cast<double>(known.size()) * std::ranges::min(known));
}

std::optional<double> combined_p(const std::vector<Judgement>& judgements) {
  std::vector<double> quantiles;
  for (const double p : known_p(judgements))
    quantiles.push_back(std::tan((0.5 - std::min(p, kMostP)) * std::numbers::pi));
  if (quantiles.empty()) return std::nullopt;
  return 0.5 - std::atan(mean_of(quantiles)) / std::numbers::pi;
}

const RepeatPriors& published_priors() {
  // From 304 repeats in 26 groups (13 fabrics, two faces), silhouettes.csv of Gong, Mao and Wang
  // 2024; reproduced by the test Repeats.ThePublishedPriorsAreThoseOfTheData.
  static const RepeatPriors priors = {{10.89, 4.058}, {2.30, 0.003125}, {15.6, 5.65e-5}};
  return priors;
}

VarianceComponents variance_components(const std::vector<RepeatKey>& keys,
                                       const std::vector<double>& values) {
  if (keys.size() != values.size() || keys.empty())
    throw internal_error("variance components need one key per value");
  std::map<std::string, std::map<std::string, std::vector<double>>> faces;
  for (std::size_t i = 0; i < keys.size(); ++i)
    faces[keys[i].face][keys[i].sample].push_back(values[i]);
  VarianceComponents result;
  result.drapes = static_cast<int>(values.size());
  result.faces = static_cast<int>(faces.size());
  std::set<std::string> names;  // a sample has two faces
  for (const RepeatKey& key : keys) names.insert(key.sample);
  result.samples = static_cast<int>(names.size());
  double within = 0, between = 0, effective = 0;
  int within_dof = 0, between_dof = 0;
  for (const auto& [face, samples] : faces) {
    std::vector<double> all;
    double squared_counts = 0;
    for (const auto& [sample, repeats] : samples) {
      within += squares_about_mean(repeats);
      within_dof += static_cast<int>(repeats.size()) - 1;
      squared_counts += static_cast<double>(repeats.size() * repeats.size());
      all.insert(all.end(), repeats.begin(), repeats.end());
    }
    const auto n = static_cast<double>(all.size());
    for (const auto& [sample, repeats] : samples)
      between += static_cast<double>(repeats.size()) * std::pow(mean_of(repeats) - mean_of(all), 2);
    between_dof += static_cast<int>(samples.size()) - 1;
    effective += n - squared_counts / n;
    result.face_means.push_back({face, mean_of(all)});
  }
  if (within_dof > 0) result.repeat_sd = std::sqrt(within / within_dof);
  if (within_dof > 0 && between_dof > 0) {
    const double excess = between / between_dof - within / within_dof;
    result.sample_sd = std::sqrt(std::max(0.0, excess * between_dof / effective));
  }
  return result;
}

namespace fs = std::filesystem;

std::string SheetFile::scene() const {
  if (const auto* simulated = std::get_if<SimulatedSource>(&sheet.source)) return simulated->scene;
  return repeat ? repeat->scene : asked ? asked->name : std::string();
}

SheetFile read_sheet_file(const fs::path& file) {
  require_as_recorded(file);
  const fs::path json = fs::path(file).replace_extension(".json");
  SheetFile read{file, {}, {}, read_sheet(file)};
  read.sha256 = sha256_of_file(json);
  read.ply_sha256 = sha256_of_file(fs::path(file).replace_extension(".ply"));
  if (read.sheet.is_measured()) {
    read.repeat = read.measured().repeat;
    read.asked = read.measured().asked_scene;
  }
  return read;
}

MarkRepeats mark_repeats(const std::vector<SheetFile>& repeats,
                         const std::vector<SheetFile>& virtual_sheets, double significance) {
  if (repeats.empty()) throw usage_error("no repeat is named", "give measured sheets");
  const auto marks = common_marks(repeats);
  if (marks.empty())
    throw bad_input("the repeats have no mark in common", {.file = repeats.front().file.string()},
                    "give sheets of one print");
  MarkRepeats result;
  result.marks = static_cast<int>(marks.size());
  const std::vector<Points> points = places_on(repeats, marks);
  result.real_to_real_m = basis_of("marks", points, points.front(), rms_m).real_to_real_m;
  for (const SheetFile& candidate : virtual_sheets)
    result.matches.push_back(match_of(repeats, candidate, significance));
  return result;
}

std::optional<double> limit_m(const MarkRepeats::SheetMatch& match, double significance) {
  if (!match.p) return std::nullopt;
  const auto p_at = [&](double times) {
    std::vector<Judgement> judgements;
    for (const RepeatBasis& basis : match.bases)
      if (basis.judgement.p) judgements.push_back(judged(basis, times, significance));
    return combined_p(judgements).value_or(1);
  };
  double low = 0, high = 1;
  while (p_at(high) >= significance && high < 1e9) high *= 2;
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    (p_at(middle) >= significance ? low : high) = middle;
  }
  return low * mean_of(match.bases.front().virtual_to_real_m);
}

void fields(Fields& f, RepeatBasis& basis) {
  f({"what", "marks, hem, spectrum or area"}, basis.what);
  f({"real_to_real_mm", "distances between repeats", mm}, basis.real_to_real_m);
  f({"virtual_to_real_mm", "distances of the virtual sheet from the repeats", mm},
    basis.virtual_to_real_m);
  f({"p", "probability that a repeat deviates as far; null if not judged"}, basis.judgement.p);
  text_or_null(f, {"reason", "reason if it cannot be judged"}, basis.reason);
}

void fields(Fields& f, MarkRepeats::SheetMatch& match) {
  f({"sheet", "virtual sheet"}, match.name);
  f({"marks", "number of marks compared"}, match.marks);
  std::vector<double> rms_m;
  if (!match.bases.empty()) rms_m = match.bases.front().virtual_to_real_m;
  f({"rms_mm", "RMS distance of the marks from each repeat", mm}, rms_m);
  f({"bases", "kinds of distance"}, match.bases);
  f({"verdict", "verdict of the comparison with the repeats"}, match.verdict);
  text_or_null(f, {"reason", "reason if undecided"}, match.reason);
  f({"p", "probability combined from all tests that could be made"}, match.p);
}

void fields(Fields& f, RepeatsFile& file) {
  f({"significance", "probability that a real repeat counts as outside"}, file.significance);
  f({"marks", "number of marks present in every repeat"}, file.found.marks);
  std::vector<RepeatRow> rows;
  for (std::size_t i = 0; i < file.repeats.size(); ++i)
    rows.push_back({file.repeats[i].file.string(), file.found.real_to_real_m[i]});
  f({"repeats", "measured sheets"}, rows);
  f({"matches", "virtual sheets"}, file.found.matches);
}

void require_one_drape(const std::vector<SheetFile>& repeats,
                       const std::vector<SheetFile>& virtual_sheets) {
  require_kinds(repeats, virtual_sheets);
  std::map<std::string, std::string> seen;
  for (const SheetFile& sheet : repeats)
    if (const auto [other, is_new] = seen.emplace(sheet.ply_sha256, sheet.file.string()); !is_new)
      refuse(sheet, "it is a copy of " + other->second + ", which is no repeat", "marks");
  const SheetFile* first = nullptr;
  for (const auto* sheets : {&repeats, &virtual_sheets}) {
    for (const SheetFile& sheet : *sheets) {
      const std::string scene = sheet.scene();
      if (first == nullptr && !scene.empty()) first = &sheet;
      if (!scene.empty() && scene != first->scene())
        refuse(sheet,
               fmt::format("it is of scene `{}`, {} is of scene `{}`", scene, first->file.string(),
                           first->scene()),
               "source");
      require_same_bench(sheet, repeats.front());
    }
  }
  for (const SheetFile& sheet : repeats) {
    const bool placed = std::ranges::any_of(virtual_sheets, [&](const SheetFile& simulation) {
      const auto& start = std::get<SimulatedSource>(simulation.sheet.source).start_sha256;
      return start && sheet.has_content(*start);
    });
    if (sheet.scene().empty() && !placed)
      refuse(sheet, "the sheet does not say which drape it is a laying of", "source.repeat",
             "name it by a [[repeat]] of the rig, or measure it with drape triangulate --repeat "
             "NAME --scene FILE");
  }
}

std::vector<std::string> no_go_of(const std::vector<SheetFile>& sheets) {
  std::vector<std::string> reasons;
  for (const SheetFile& sheet : sheets) {
    const auto* source = std::get_if<SimulatedSource>(&sheet.sheet.source);
    if (sheet.sheet.no_go)
      reasons.push_back(fmt::format("{}: {}", sheet.file.string(), *sheet.sheet.no_go));
    else if (source != nullptr && source->status != "at rest")
      reasons.push_back(fmt::format("{}: the simulation is not at rest: {}", sheet.file.string(),
                                    source->status));
  }
  return reasons;
}

std::vector<SameLaying> layings_twice(const std::vector<const SheetFile*>& sheets) {
  constexpr double kRisk = 0.005;
  std::vector<SameLaying> found;
  for (auto own = sheets.begin(); own != sheets.end(); ++own)
    for (auto other = sheets.begin(); other != own; ++other) {
      const std::string &set = (*own)->measured().set, &earlier = (*other)->measured().set;
      const auto chi2 = set == earlier ? std::nullopt : median_chi2((*own)->sheet, (*other)->sheet);
      if (!chi2 || *chi2 > chi_square_beyond(kRisk, 3)) continue;
      const bool one_drape = !(*own)->scene().empty() && (*own)->scene() == (*other)->scene();
      found.push_back(
          {(*other)->sha256, (*own)->sha256, one_drape,
           fmt::format("sets {} and {} show one laying: half of their marks lie at the same places "
                       "within chi square {:.1f}; look which drape the pictures of each set show, "
                       "and record the other again",
                       earlier, set, *chi2)});
    }
  return found;
}

}  // namespace drape::compare
