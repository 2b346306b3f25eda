// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "compare/metrics/surface.hpp"
#include "core/sheet.hpp"
#include "core/statistics/sample.hpp"

namespace drape::compare {

/// Distance of one measured mark from its position on a virtual sheet.
struct MarkError {
  MarkId mark;
  Eigen::Vector2d material_m;        ///< (warp, weft)
  Eigen::Vector3d real_in_world;     ///< metres
  Eigen::Vector3d virtual_in_world;  ///< metres
  double distance_m = 0;
  /// real - virtual along the virtual sheet's warp tangent, weft tangent and normal. The tangents
  /// are not orthogonal in sheared cloth, so the squares do not add up.
  Eigen::Vector3d warp_weft_normal_m;
  std::optional<double> sigma_mark_m;  ///< standard deviation of the mark in its worst direction
  std::optional<double> sigma_distance_m;  ///< standard deviation of distance; distance_sigma_m()
  std::optional<double> sigma_normal_m;    ///< standard deviation of the component along the normal
  std::optional<int> views;
};

/// Uncertainty of a statistic. Its two parts have different meanings and are not combined:
/// `sigma_m` is due to the measurement of the marks, `bootstrap` to the choice of marks on the
/// cloth.
struct Trust {
  /// Standard deviation due to the marks' covariances, first order, independent marks. Absent if a
  /// mark has no covariance.
  std::optional<double> sigma_m;
  /// 95 % percentile interval over resampled marks (Efron 1979), m. Absent for fewer than 2 marks.
  std::optional<Interval> bootstrap;
};

/// Statistics of distances, in metres.
struct DistanceStatistics {
  int marks = 0;
  double mean_m = 0;  ///< the paper's measure (section 5)
  double median_m = 0;
  double rms_m = 0;
  double p95_m = 0;  ///< 95th percentile, interpolated between order statistics
  double max_m = 0;
  MarkId worst_mark;  ///< mark of the maximum (the first one)
  /// Standard deviation of the mean: sqrt(sum sigma_i^2) / n for independent marks. Absent if a
  /// mark has no covariance.
  std::optional<double> sigma_mean_m;
  Trust mean, median, rms, p95, max;  ///< mean.sigma_m equals sigma_mean_m
};

/// Mean of the signed distances along the virtual sheet's normal; positive if the real cloth is on
/// the printed side of the virtual one.
struct NormalStatistics {
  double mean_m = 0;
  double rms_m = 0;
  Trust mean;
};

/// A mark that could not be compared, with the reason.
using Excluded = Gap;

struct MarkComparison {
  std::vector<MarkError> marks;    ///< ordered by mark
  std::vector<Excluded> excluded;  ///< measured, but without a position on the virtual sheet
};

/// Standard deviation of |virtual - real| from the covariance C of the real mark: sqrt(u' C u),
/// with u the unit vector between both (first order). If they coincide u is undefined and the worst
/// direction is used.
[[nodiscard]] double distance_sigma_m(const Eigen::Vector3d& difference_m,
                                      const Eigen::Matrix3d& covariance_m2);

/// Standard deviation in the worst direction: root of the largest eigenvalue.
[[nodiscard]] double worst_sigma_m(const Eigen::Matrix3d& covariance_m2);

/// Distances between the measured marks and the virtual sheet at the marks' material coordinates.
[[nodiscard]] MarkComparison compare_marks(const Sheet& measured, const Surface& virtual_sheet);

/// Distances between two virtual sheets at material coordinates; points missing from one of them
/// are left out, as the size of the result shows.
[[nodiscard]] std::vector<double> distances_between(const Surface& first, const Surface& second,
                                                    const std::vector<Eigen::Vector2d>& material_m);

/// Throws Error(internal) if there are no distances.
[[nodiscard]] DistanceStatistics statistics_of(const std::vector<MarkError>& marks);
[[nodiscard]] NormalStatistics normal_statistics_of(const std::vector<MarkError>& marks);
[[nodiscard]] DistanceStatistics statistics_of(const std::vector<double>& distances_m);
/// The same with bootstrap intervals and, if there is a sigma for each distance, their uncertainty.
[[nodiscard]] DistanceStatistics statistics_of(const std::vector<double>& distances_m,
                                               const std::vector<double>& sigmas_m);

/// Number of resamples per interval, so that its ends are the 50th value from below and above.
inline constexpr int kResamples = 2000;

/// Sets the bootstrap intervals of mean, median, RMS, 95th percentile and maximum. The seed is
/// fixed, so equal distances give equal intervals. Marks are drawn as if independent; those of a
/// cloth are correlated, so the true interval is somewhat wider.
void add_bootstrap(const std::vector<double>& distances_m, DistanceStatistics& statistics);

/// Sets the standard deviation of each statistic to first order, from independent sigmas in the
/// order of the distances; the gradient of an order statistic is the weight of each sorted value.
void add_sigmas(const std::vector<double>& distances_m, const std::vector<double>& sigmas_m,
                DistanceStatistics& statistics);

/// Remaining distances after moving the real marks onto the virtual ones as a rigid body. Reported
/// in addition to the distances, never instead: the position of the cloth is part of the
/// comparison.
struct RigidAlignment {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< virtual_from_real, about the origin
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();  ///< in world; p_virtual = rotation p + shift
  double turn_rad = 0;                                ///< angle of the rotation
  double centroid_shift_m = 0;                        ///< displacement of the real centroid
  DistanceStatistics after;
};

/// Least-squares alignment without scale (Kabsch 1976; Umeyama 1991). nullopt for fewer than three
/// marks or collinear ones, which leave the rotation undetermined.
[[nodiscard]] std::optional<RigidAlignment> align(const std::vector<MarkError>& marks);

/// Elongation of the straight line between two adjacent marks relative to the flat print. A fold in
/// between shortens it without any strain of the threads.
struct EdgeStrain {
  MarkId from, to;
  bool along_warp = false;
  double real = 0, simulated = 0;  ///< ratios: 0.01 means one per cent longer
};

/// Relative change of the area of the quadrilateral whose corner of lowest row and column is
/// `corner`, as two triangles.
struct AreaStrain {
  MarkId corner;
  double real = 0, simulated = 0;  ///< ratios
};

/// Root mean square of real minus simulated strain.
struct StrainSummary {
  std::optional<double> warp, weft, area;  ///< ratios; absent if there is no such edge or cell
};

struct StrainMaps {
  std::vector<EdgeStrain> edges;
  std::vector<AreaStrain> cells;
  StrainSummary difference;
};

/// Strains of the measured marks' lattice, and of the virtual sheet at the same material points.
/// Covers edges and cells whose marks all exist on both.
[[nodiscard]] StrainMaps strain_maps(const Sheet& measured, const Surface& virtual_sheet);

}  // namespace drape::compare
