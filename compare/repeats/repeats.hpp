// SPDX-License-Identifier: Apache-2.0
#pragma once

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
  struct FaceMean {
    std::string face;
    double mean = 0;
  };
  std::vector<FaceMean> face_means;
};
[[nodiscard]] VarianceComponents variance_components(const std::vector<RepeatKey>& keys,
                                                     const std::vector<double>& values);

/// Table and objects of a scene: each value of its file by path ("object.1.x_mm"); a mesh by the
/// SHA-256 of its content.
using Surroundings = std::map<std::string, std::string>;

/// A sheet as read, with the SHA-256 of its .json (which contains everything).
struct SheetFile {
  std::filesystem::path file;
  std::string sha256;      ///< hash of <stem>.json, which identifies the sheet in the store
  std::string ply_sha256;  ///< hash of <stem>.ply
  Sheet sheet;
  std::optional<RepeatId> repeat = {};   ///< absent if it names no laying
  std::optional<AskedScene> asked = {};  ///< absent if its marks were measured without a scene

  /// The scene named in the file; a measured sheet may name none.
  [[nodiscard]] std::string scene() const;
  [[nodiscard]] std::string face() const { return repeat ? repeat->face : std::string(); }
  [[nodiscard]] const MeasuredSource& measured() const {  ///< source; must be a measured sheet
    return std::get<MeasuredSource>(sheet.source);
  }
  [[nodiscard]] bool has_content(const std::string& hash) const {  ///< if either has this hash
    return hash == sha256 || hash == ply_sha256;
  }
};

/// Reads both files of a sheet, given either. Throws Error(bad_input) also if they differ from
/// their run record.
[[nodiscard]] SheetFile read_sheet_file(const std::filesystem::path& file);

/// One kind of distance between drapes, with the verdict of the repeats on a virtual sheet by it.
struct RepeatBasis {
  std::string what;  ///< "marks", "hem", "spectrum" or "area"
  std::vector<std::vector<double>> real_to_real_m;
  std::vector<double> virtual_to_real_m;
  Judgement judgement;
  std::string reason;        ///< why it cannot be judged, or empty
  VariancePrior prior = {};  ///< from published repeats; none for marks and spectrum
};

struct MarkRepeats {
  int marks = 0;  ///< marks present in every repeat
  /// RMS distance of the marks of two repeats in the world of the bench, without any
  /// alignment.
  std::vector<std::vector<double>> real_to_real_m;
  struct SheetMatch {
    std::string name;
    int marks = 0;                   ///< marks that the virtual sheet has or can interpolate
    std::vector<RepeatBasis> bases;  ///< marks, hem, spectrum and area
    std::optional<double> p;         ///< combined over all that can be judged, see combined_p()
    Match verdict = Match::undecided;
    std::string reason;  ///< why it is undecided, or empty
  };
  std::vector<SheetMatch> matches;
};

/// Number of repeats needed to estimate their scatter.
inline constexpr int kLeastRepeats = 3;

/// Tests whether each virtual sheet could be a repeat of the real drape, by four distances: RMS of
/// the marks, with each virtual mark interpolated at the material point; of the hems (the polygon
/// of the outermost marks, seen from above) after the best rotation; of their Fourier orders 0 to
/// 16, which do not depend on the positions of folds; and of the radii of circles with the hems'
/// areas. Repeats with too few common outermost marks, or whose hem does not surround its centre,
/// are judged by their marks only. With fewer than kLeastRepeats the verdict is undecided. Throws
/// Error(bad_input) if the repeats have no common mark.
[[nodiscard]] MarkRepeats mark_repeats(const std::vector<SheetFile>& repeats,
                                       const std::vector<SheetFile>& virtual_sheets,
                                       double significance);

/// Mean distance of a virtual sheet's marks from the repeats, with all its distances
/// scaled in proportion, up to which it could be one more repeat; nullopt if it cannot be
/// judged.
[[nodiscard]] std::optional<double> limit_m(const MarkRepeats::SheetMatch& match,
                                            double significance);

/// Content of repeats.json.
struct RepeatsFile {
  double significance = 0.05;
  std::vector<SheetFile> repeats;
  MarkRepeats found;
};
void fields(Fields& f, RepeatsFile& file);

/// Throws Error(bad_input) naming a file that is not a laying or simulation of the others' drape: a
/// simulation among the repeats, a measured sheet among the virtual ones, another scene, print,
/// calibration or upper face, or a copy of another file. A laying that does not state its drape
/// must be the one that positioned a simulation.
void require_one_drape(const std::vector<SheetFile>& repeats,
                       const std::vector<SheetFile>& virtual_sheets);

/// Reasons, one per sheet, why results based on them are NO-GO: a NO-GO measurement, or a
/// simulation that is not at rest.
[[nodiscard]] std::vector<std::string> no_go_of(const std::vector<SheetFile>& sheets);

/// Two measured sheets that show the same laying in different frame sets.
struct SameLaying {
  std::string first, second;  ///< SHA-256 of the sheets
  bool one_drape = false;     ///< true if both are of one scene
  std::string reason;
};

/// Finds them: half of at least ten common marks agree within the 99.5 % quantile of chi square
/// (three degrees of freedom, both covariances). A new laying would differ by millimetres.
[[nodiscard]] std::vector<SameLaying> layings_twice(const std::vector<const SheetFile*>& sheets);

}  // namespace drape::compare

template <>
inline constexpr drape::Format drape::format_of<drape::compare::RepeatsFile>{
    "repeats", drape::Syntax::json, 1,
    "repeats.json: distances of repeated drapes, and which virtual sheets lie inside them."};
