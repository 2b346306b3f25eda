// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/metrics.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "compare/metrics/bootstrap.hpp"
#include "core/error.hpp"
#include "core/statistics/sample.hpp"

namespace drape::compare {

double worst_sigma_m(const Eigen::Matrix3d& covariance_m2) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance_m2,
                                                              Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()(2)));
}

double distance_sigma_m(const Eigen::Vector3d& difference_m, const Eigen::Matrix3d& covariance_m2) {
  const double distance = difference_m.norm();
  if (!(distance > 0)) return worst_sigma_m(covariance_m2);
  const Eigen::Vector3d u = difference_m / distance;
  return std::sqrt(std::max(0.0, u.dot(covariance_m2 * u)));
}

MarkComparison compare_marks(const Sheet& measured, const Surface& virtual_sheet) {
  MarkComparison result;
  for (const SheetMark& mark : measured.marks) {
    const auto place = virtual_sheet.at(mark.material_m);
    if (!place) {
      result.excluded.push_back({mark.mark, "the virtual sheet has no surface there"});
      continue;
    }
    const Eigen::Vector3d difference = mark.point_in_world - place->point_in_world;
    MarkError error;
    error.mark = mark.mark;
    error.material_m = mark.material_m;
    error.real_in_world = mark.point_in_world;
    error.virtual_in_world = place->point_in_world;
    error.distance_m = difference.norm();
    error.warp_weft_normal_m = {difference.dot(place->along_warp),
                                difference.dot(place->along_weft), difference.dot(place->normal)};
    error.views = mark.views;
    if (mark.covariance_m2) {
      error.sigma_mark_m = worst_sigma_m(*mark.covariance_m2);
      error.sigma_distance_m = distance_sigma_m(difference, *mark.covariance_m2);
      error.sigma_normal_m =
          std::sqrt(std::max(0.0, place->normal.dot(*mark.covariance_m2 * place->normal)));
    }
    result.marks.push_back(error);
  }
  return result;
}

std::vector<double> distances_between(const Surface& first, const Surface& second,
                                      const std::vector<Eigen::Vector2d>& material_m) {
  std::vector<double> distances;
  for (const Eigen::Vector2d& place : material_m) {
    const auto a = first.at(place), b = second.at(place);
    if (a && b) distances.push_back((a->point_in_world - b->point_in_world).norm());
  }
  return distances;
}

DistanceStatistics statistics_of(const std::vector<double>& distances_m) {
  if (distances_m.empty()) throw internal_error("statistics of no distance were asked for");
  DistanceStatistics statistics;
  statistics.marks = static_cast<int>(distances_m.size());
  double sum = 0, squares = 0;
  for (const double distance : distances_m) {
    sum += distance;
    squares += distance * distance;
  }
  const auto n = static_cast<double>(distances_m.size());
  statistics.mean_m = sum / n;
  statistics.rms_m = std::sqrt(squares / n);
  statistics.median_m = quantile(distances_m, 0.5);
  statistics.p95_m = quantile(distances_m, 0.95);
  statistics.max_m = *std::max_element(distances_m.begin(), distances_m.end());
  return statistics;
}

DistanceStatistics statistics_of(const std::vector<MarkError>& marks) {
  std::vector<double> distances, sigmas;
  for (const MarkError& mark : marks) {
    distances.push_back(mark.distance_m);
    if (mark.sigma_distance_m) sigmas.push_back(*mark.sigma_distance_m);
  }
  DistanceStatistics statistics = statistics_of(distances);
  const auto worst = std::max_element(distances.begin(), distances.end()) - distances.begin();
  statistics.worst_mark = marks[static_cast<std::size_t>(worst)].mark;
  add_bootstrap(distances, statistics);
  if (sigmas.size() == marks.size()) add_sigmas(distances, sigmas, statistics);
  statistics.sigma_mean_m = statistics.mean.sigma_m;
  return statistics;
}

NormalStatistics normal_statistics_of(const std::vector<MarkError>& marks) {
  if (marks.empty()) throw internal_error("statistics of no distance were asked for");
  NormalStatistics result;
  std::vector<double> values;
  double squares = 0, variance_sum_m2 = 0;
  bool all_known = true;
  for (const MarkError& mark : marks) {
    values.push_back(mark.warp_weft_normal_m.z());
    result.mean_m += values.back();
    squares += values.back() * values.back();
    all_known = all_known && mark.sigma_normal_m.has_value();
    variance_sum_m2 += mark.sigma_normal_m.value_or(0) * mark.sigma_normal_m.value_or(0);
  }
  const auto n = static_cast<double>(marks.size());
  result.mean_m /= n;
  result.rms_m = std::sqrt(squares / n);
  if (all_known) result.mean.sigma_m = std::sqrt(variance_sum_m2) / n;
  result.mean.bootstrap = bootstrap_of_mean(values);
  return result;
}

}  // namespace drape::compare
