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

}  // namespace drape::compare
