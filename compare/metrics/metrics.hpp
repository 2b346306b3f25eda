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

/// Distance of one measured mark from its place on a virtual sheet.
struct MarkError {
  MarkId mark;
  Eigen::Vector2d material_m;        ///< (warp, weft)
  Eigen::Vector3d real_in_world;     ///< metres
  Eigen::Vector3d virtual_in_world;  ///< metres
  double distance_m = 0;
  /// real - virtual along the virtual sheet's warp tangent, weft tangent and normal. The two
  /// tangents are not orthogonal where the cloth shears, so squares of these do not add up.
  Eigen::Vector3d warp_weft_normal_m;
  std::optional<double> sigma_mark_m;      ///< 1 sigma of the mark along its worst direction
  std::optional<double> sigma_distance_m;  ///< 1 sigma of the distance, see distance_sigma_m()
  std::optional<double> sigma_normal_m;    ///< 1 sigma of the part along the normal
  std::optional<int> views;
};

/// Trust in a statistic. The two answer different questions and are not added:
/// `sigma_m` is what the measurement of the marks leaves open, `bootstrap` what other marks on the
/// same cloth might have given.
struct Trust {
  /// One standard deviation from the marks' covariances, first order, marks independent. Absent
  /// when any mark has no covariance.
  std::optional<double> sigma_m;
  /// 95 % percentile interval over resampled marks (Efron 1979), m. Absent below 2 marks.
  std::optional<Interval> bootstrap;
};

/// Statistics of distances in metres.
struct DistanceStatistics {
  int marks = 0;
  double mean_m = 0;  ///< the paper's measure (section 5)
  double median_m = 0;
  double rms_m = 0;
  double p95_m = 0;  ///< 95th percentile, linear between order statistics
  double max_m = 0;
  MarkId worst_mark;  ///< mark of the maximum (the first one)
  /// 1 sigma of the mean: sqrt(sum sigma_i^2) / n for independent marks. Absent when any mark
  /// has no covariance.
  std::optional<double> sigma_mean_m;
  Trust mean, median, rms, p95, max;  ///< mean.sigma_m equals sigma_mean_m
};

/// Mean of the signed distances along the virtual sheet's normal; positive: the real cloth lies on
/// the printed side of the virtual one.
struct NormalStatistics {
  double mean_m = 0;
  double rms_m = 0;
  Trust mean;
};

/// A mark that could not be compared, and why.
using Excluded = Gap;

struct MarkComparison {
  std::vector<MarkError> marks;    ///< ordered by mark
  std::vector<Excluded> excluded;  ///< measured, but without a place on the virtual sheet
};

/// Standard deviation of |virtual - real| from the covariance C of the real mark: sqrt(u' C u), u
/// the unit vector between the two (first order). Where they coincide u is unknown and the worst
/// direction is taken.
[[nodiscard]] double distance_sigma_m(const Eigen::Vector3d& difference_m,
                                      const Eigen::Matrix3d& covariance_m2);

/// Standard deviation along the worst direction: root of the largest eigenvalue.
[[nodiscard]] double worst_sigma_m(const Eigen::Matrix3d& covariance_m2);

/// Distances between the measured marks and the virtual sheet at the marks' material coordinates.
[[nodiscard]] MarkComparison compare_marks(const Sheet& measured, const Surface& virtual_sheet);

/// Distances between two virtual sheets at material coordinates; points that one of them does not
/// have are left out and counted by the difference in size.
[[nodiscard]] std::vector<double> distances_between(const Surface& first, const Surface& second,
                                                    const std::vector<Eigen::Vector2d>& material_m);

/// Throws Error(internal) when there is no distance.
[[nodiscard]] DistanceStatistics statistics_of(const std::vector<MarkError>& marks);
[[nodiscard]] NormalStatistics normal_statistics_of(const std::vector<MarkError>& marks);
[[nodiscard]] DistanceStatistics statistics_of(const std::vector<double>& distances_m);

}  // namespace drape::compare
