// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "compare/repeats/hem.hpp"

#include "core/run_report.hpp"

namespace drape::compare {

// "Inside the repeats": a virtual drape matches when it could be one more repeat of the real one
// (Kenkare 2008: there is no single drape to aim at). Its value is compared with the repeats' mean,
// t = (v - mean) / (s sqrt(1 + 1/n)). With few repeats s is poor, so it is drawn towards what
// other fabrics' repeats have (empirical Bayes, Smyth 2004): s^2 = (d0 s0^2 + (n - 1) s_n^2) /
// (d0 + n - 1), and t has d0 + n - 1 degrees of freedom. Leaving out each of the repeats in turn,
// the mean of (x_i - mean of the others)^2 equals the mean of s^2 (1 + 1/(n - 1)) identically, so
// that the scale of t is right also where repeats of one sample resemble each other.

/// Writes a text that is null where there is none.
void text_or_null(Fields& f, const Field& field, const std::string& text);

/// Common distribution of the variances of many groups: scaled inverse chi-square with `dof` and
/// `variance`; dof 0: nothing is known.
struct VariancePrior {
  double dof = 0, variance = 0;
};

struct Judgement {
  std::optional<double>
      p;  ///< probability that a further repeat lies as far out; absent: cannot be judged
  double t = 0, dof = 0;
  double mean = 0, sd = 0;           ///< the repeats' own; sd after the prior
  std::optional<double> detectable;  ///< difference that is found in 90 of 100 cases
};

/// A number of a virtual drape, two-sided; `significance` (0.05) is only for `detectable`.
[[nodiscard]] Judgement judge_value(const std::vector<double>& repeats, double value,
                                    const VariancePrior& prior, double significance);

/// Anything that has a distance: a drape's score is its mean log distance to the repeats (without
/// itself); one-sided, far is outside. Needs three repeats, or two and a prior. Distances of
/// exactly 0 count as `least`. Mean and sd are of the scores.
struct Distances {
  std::vector<std::vector<double>> real_to_real;  ///< symmetric
  std::vector<double> virtual_to_real;
};
[[nodiscard]] Judgement judge_distance(const Distances& distances, const VariancePrior& prior,
                                       double least, double significance);

/// Root mean square distances of points that belong to each other, which are those of points in one
/// space of many dimensions: F = |v - mean|^2 / (1 + 1/n) over the repeats' variance, with nu and
/// nu (n - 1) degrees of freedom; nu = (sum of eigenvalues)^2 / sum of their squares (Satterthwaite
/// 1946), from unbiased estimates of both sums. Below six repeats nu cannot be estimated and is 1,
/// which makes the test stricter on alarms than the significance says. Needs three repeats. `t` is
/// the root of F, `dof` is nu, mean is absent (0), sd the repeats' root mean square distance from
/// their mean. With a prior they are values on a line: nu is 1, and their variance is drawn towards
/// the prior's.
[[nodiscard]] Judgement judge_points(const Distances& distances, const VariancePrior& prior = {});

/// Bonferroni over several p: the smallest times their number, at most 1.
[[nodiscard]] std::optional<double> joint_p(const std::vector<Judgement>& judgements);
/// Combines tests which go together, such as marks, hem and spectrum of the same sheets: the sum of
/// their Cauchy quantiles, exact for independent and for equal tests and near it between (Liu and
/// Xie 2020). Three times the least would be too strict there.
[[nodiscard]] std::optional<double> combined_p(const std::vector<Judgement>& judgements);

/// Variances of the scores and values of many published real drapes; see the README for the source.
struct RepeatPriors {
  VariancePrior drape_coefficient;  ///< percent points squared
  VariancePrior hem_score;          ///< variance of log distance
  VariancePrior covered_radius;     ///< of the covered area's circle, in parts of the flat one's
};
[[nodiscard]] const RepeatPriors& published_priors();

/// A measured drape among its repeats.
struct RepeatKey {
  std::string sample, face;
};
/// Sum of squares between and within, samples nested in faces.
struct VarianceComponents {
  int drapes = 0, samples = 0, faces = 0;
  std::optional<double> repeat_sd;  ///< same sample and face; absent without repeats
  std::optional<double> sample_sd;  ///< samples of a face; 0 when below what repeats explain
  std::vector<std::pair<std::string, double>> face_means;
};
[[nodiscard]] VarianceComponents variance_components(const std::vector<RepeatKey>& keys,
                                                     const std::vector<double>& values);

}  // namespace drape::compare
