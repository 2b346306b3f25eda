// SPDX-License-Identifier: Apache-2.0
#include "compare/repeats/repeats.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/error.hpp"
#include "core/statistics/distributions.hpp"
#include "core/statistics/sample.hpp"

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
  double least = 1;
  int count = 0;
  for (const Judgement& judgement : judgements) {
    if (!judgement.p) continue;
    least = std::min(least, *judgement.p);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return std::min(1.0, count * least);
}

std::optional<double> combined_p(const std::vector<Judgement>& judgements) {
  double sum = 0;
  int count = 0;
  for (const Judgement& judgement : judgements) {
    if (!judgement.p) continue;
    sum += std::tan((0.5 - std::min(*judgement.p, kMostP)) * std::numbers::pi);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return 0.5 - std::atan(sum / count) / std::numbers::pi;
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
    result.face_means.emplace_back(face, mean_of(all));
  }
  if (within_dof > 0) result.repeat_sd = std::sqrt(within / within_dof);
  if (within_dof > 0 && between_dof > 0) {
    const double excess = between / between_dof - within / within_dof;
    result.sample_sd = std::sqrt(std::max(0.0, excess * between_dof / effective));
  }
  return result;
}

}  // namespace drape::compare
