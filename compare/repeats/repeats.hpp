// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/metrics/drapemeter.hpp"

#include "core/run_report.hpp"

namespace drape::compare {

// "Inside the repeats": a virtual drape matches if it could be one more repeat of the real one
// (Kenkare 2008: there is no single drape to aim at). Its value is compared with the mean of the
// repeats, t = (v - mean) / (s sqrt(1 + 1/n)). With few repeats s is uncertain, so it is shrunk
// towards that of repeats of other fabrics (empirical Bayes, Smyth 2004): s^2 = (d0 s0^2 + (n - 1)
// s_n^2) / (d0 + n - 1), and t has d0 + n - 1 degrees of freedom. If each of the repeats is left
// out in turn, the mean of (x_i - mean of the others)^2 equals the mean of s^2 (1 + 1/(n - 1))
// identically, so the scale of t is right even if repeats of one sample are correlated.

/// Describes a text that is null if empty.
void text_or_null(Fields& f, const Field& field, const std::string& text);

/// Distribution of the variances of many groups: scaled inverse chi-square with `dof` and
/// `variance`; dof 0 if unknown.
struct VariancePrior {
  double dof = 0, variance = 0;
};

struct Judgement {
  std::optional<double>
      p;  ///< probability that one more repeat deviates as far; absent if it cannot be judged
  double t = 0, dof = 0;
  double mean = 0, sd = 0;           ///< mean of the repeats; their sd combined with the prior
  std::optional<double> detectable;  ///< difference detected in 90 of 100 cases
};

/// Tests a number of a virtual drape, two-sided; `significance` (0.05) affects only `detectable`.
[[nodiscard]] Judgement judge_value(const std::vector<double>& repeats, double value,
                                    const VariancePrior& prior, double significance);

/// Tests by pairwise distances: a drape's score is its mean log distance from the repeats (except
/// itself), one-sided, as only a large distance is outside. Requires three repeats, or two and a
/// prior. Distances of exactly 0 are replaced by `least`. Mean and sd are those of the scores.
struct Distances {
  std::vector<std::vector<double>> real_to_real;  ///< symmetric
  std::vector<double> virtual_to_real;
};
[[nodiscard]] Judgement judge_distance(const Distances& distances, const VariancePrior& prior,
                                       double least, double significance);

/// Tests by root mean square distances of corresponding points, which are Euclidean distances in a
/// space of many dimensions: F = |v - mean|^2 / (1 + 1/n) over the variance of the repeats, with nu
/// and nu (n - 1) degrees of freedom; nu = (sum of eigenvalues)^2 / sum of their squares
/// (Satterthwaite 1946), from unbiased estimates of both sums. Below six repeats nu cannot be
/// estimated and is 1, which gives fewer alarms than the significance. Requires three repeats. `t`
/// is the root of F, `dof` is nu, the mean is 0, sd the root mean square distance of the repeats
/// from their mean. With a prior they are treated as values on a line: nu is 1, and their variance
/// is shrunk towards the prior's.
[[nodiscard]] Judgement judge_points(const Distances& distances, const VariancePrior& prior = {});

/// Bonferroni correction of several p: the smallest times their number, at most 1.
[[nodiscard]] std::optional<double> joint_p(const std::vector<Judgement>& judgements);
/// Combines dependent tests, such as marks, hem and spectrum of the same sheets: sum of their
/// Cauchy quantiles, exact for independent and for equal tests and approximate between (Liu and Xie
/// 2020). Bonferroni would be too strict.
[[nodiscard]] std::optional<double> combined_p(const std::vector<Judgement>& judgements);

/// Variances of scores and values over many published real drapes; source in the README.
struct RepeatPriors {
  VariancePrior drape_coefficient;  ///< percent points squared
  VariancePrior hem_score;          ///< variance of log distance
  VariancePrior covered_radius;     ///< radius for the covered area, relative to the flat one's
};
[[nodiscard]] const RepeatPriors& published_priors();

/// Sample and face of a measured drape among its repeats.
struct RepeatKey {
  std::string sample, face;
};
/// Variance components from sums of squares between and within, samples nested in faces.
struct VarianceComponents {
  int drapes = 0, samples = 0, faces = 0;
  std::optional<double> repeat_sd;  ///< repeats with the same sample and face; absent without
  std::optional<double> sample_sd;  ///< samples of a face; 0 if below what repeats explain
  std::vector<std::pair<std::string, double>> face_means;
};
[[nodiscard]] VarianceComponents variance_components(const std::vector<RepeatKey>& keys,
                                                     const std::vector<double>& values);

}  // namespace drape::compare
