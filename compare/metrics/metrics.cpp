// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/metrics.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>

#include "core/error.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/geometry/vectors.hpp"

namespace drape::compare {
namespace {

/// Standard deviation of the quantile q of sorted values, by its weights on them.
double quantile_sigma(const std::vector<double>& sorted_sigmas, double q) {
  const QuantilePlace place = quantile_place(sorted_sigmas.size(), q);
  return std::hypot((1 - place.part) * sorted_sigmas[place.below],
                    place.part * sorted_sigmas[place.above]);
}

/// One mark of the lattice on the print, on the real and on the virtual sheet.
struct Place {
  MarkId mark;
  Eigen::Vector2d material_m;
  Eigen::Vector3d real, simulated;
};

std::optional<Place> place_of(const Sheet& measured, const Surface& surface, MarkId mark) {
  const SheetMark* found = measured.find(mark);
  if (found == nullptr) return std::nullopt;
  const auto point = surface.at(found->material_m);
  if (!point) return std::nullopt;
  return Place{mark, found->material_m, found->point_in_world, point->point_in_world};
}

double area_of(const std::array<Eigen::Vector3d, 4>& p) {
  return 0.5 * ((p[1] - p[0]).cross(p[2] - p[0]).norm() + (p[2] - p[0]).cross(p[3] - p[0]).norm());
}

EdgeStrain edge_of(const Place& a, const Place& b, bool along_warp) {
  const double rest = (b.material_m - a.material_m).norm();
  return {a.mark, b.mark, along_warp, (b.real - a.real).norm() / rest - 1,
          (b.simulated - a.simulated).norm() / rest - 1};
}

AreaStrain cell_of(const Place& a, const Place& b, const Place& c, const Place& d) {
  const double rest = std::abs((c.material_m - a.material_m).prod());
  return {a.mark, area_of({a.real, b.real, c.real, d.real}) / rest - 1,
          area_of({a.simulated, b.simulated, c.simulated, d.simulated}) / rest - 1};
}

double sum_of_squares(const std::vector<double>& values) {
  return std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
}

/// nullopt for no values.
std::optional<double> root_mean_square(const std::vector<double>& values) {
  if (values.empty()) return std::nullopt;
  return std::sqrt(sum_of_squares(values) / static_cast<double>(values.size()));
}

/// Bootstrap interval of the mean of signed values. nullopt for fewer than two values.
std::optional<Interval> bootstrap_of_mean(const std::vector<double>& values_m) {
  if (values_m.size() < 2) return std::nullopt;
  std::vector<double> means;
  bootstrap(values_m.size(), kResamples, [&](std::span<const std::int64_t> counts) {
    means.push_back(std::inner_product(counts.begin(), counts.end(), values_m.begin(), 0.0) /
                    static_cast<double>(values_m.size()));
  });
  return percentile_interval(means);
}

}  // namespace

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
  statistics.mean_m = mean_of(distances_m);
  statistics.rms_m = *root_mean_square(distances_m);
  statistics.median_m = quantile(distances_m, 0.5);
  statistics.p95_m = quantile(distances_m, 0.95);
  statistics.max_m = *std::max_element(distances_m.begin(), distances_m.end());
  return statistics;
}

DistanceStatistics statistics_of(const std::vector<double>& distances_m,
                                 const std::vector<double>& sigmas_m) {
  DistanceStatistics statistics = statistics_of(distances_m);
  add_bootstrap(distances_m, statistics);
  if (sigmas_m.size() == distances_m.size()) add_sigmas(distances_m, sigmas_m, statistics);
  statistics.sigma_mean_m = statistics.mean.sigma_m;
  return statistics;
}

DistanceStatistics statistics_of(const std::vector<MarkError>& marks) {
  std::vector<double> distances, sigmas;
  for (const MarkError& mark : marks) {
    distances.push_back(mark.distance_m);
    if (mark.sigma_distance_m) sigmas.push_back(*mark.sigma_distance_m);
  }
  DistanceStatistics statistics = statistics_of(distances, sigmas);
  const auto worst = std::max_element(distances.begin(), distances.end()) - distances.begin();
  statistics.worst_mark = marks[static_cast<std::size_t>(worst)].mark;
  return statistics;
}

NormalStatistics normal_statistics_of(const std::vector<MarkError>& marks) {
  if (marks.empty()) throw internal_error("statistics of no distance were asked for");
  std::vector<double> values, sigmas;
  for (const MarkError& mark : marks) {
    values.push_back(mark.warp_weft_normal_m.z());
    if (mark.sigma_normal_m) sigmas.push_back(*mark.sigma_normal_m);
  }
  NormalStatistics result{
      mean_of(values), *root_mean_square(values), {{}, bootstrap_of_mean(values)}};
  if (sigmas.size() == values.size())
    result.mean.sigma_m = std::sqrt(sum_of_squares(sigmas)) / static_cast<double>(values.size());
  return result;
}

void add_bootstrap(const std::vector<double>& distances_m, DistanceStatistics& statistics) {
  if (distances_m.size() < 2) return;
  std::vector<double> ascending = distances_m;
  std::sort(ascending.begin(), ascending.end());
  const auto n = static_cast<double>(ascending.size());
  std::vector<double> means, medians, roots, p95s, maxima;
  bootstrap(ascending.size(), kResamples, [&](std::span<const std::int64_t> counts) {
    double sum = 0, squares = 0, largest = 0;
    for (std::size_t i = 0; i < ascending.size(); ++i) {
      const auto count = static_cast<double>(counts[i]);
      sum += count * ascending[i];
      squares += count * ascending[i] * ascending[i];
      if (counts[i] > 0) largest = ascending[i];
    }
    means.push_back(sum / n);
    roots.push_back(std::sqrt(squares / n));
    medians.push_back(counted_quantile(counts, 0.5, ascending));
    p95s.push_back(counted_quantile(counts, 0.95, ascending));
    maxima.push_back(largest);
  });
  statistics.mean.bootstrap = percentile_interval(means);
  statistics.median.bootstrap = percentile_interval(medians);
  statistics.rms.bootstrap = percentile_interval(roots);
  statistics.p95.bootstrap = percentile_interval(p95s);
  statistics.max.bootstrap = percentile_interval(maxima);
}

void add_sigmas(const std::vector<double>& distances_m, const std::vector<double>& sigmas_m,
                DistanceStatistics& statistics) {
  std::vector<std::size_t> order(distances_m.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return distances_m[a] < distances_m[b]; });
  std::vector<double> sorted_sigmas;
  sorted_sigmas.reserve(order.size());
  for (const std::size_t i : order) sorted_sigmas.push_back(sigmas_m[i]);
  const double variances = sum_of_squares(sigmas_m);
  double weighted = 0;
  for (std::size_t i = 0; i < distances_m.size(); ++i)
    weighted += std::pow(distances_m[i] * sigmas_m[i], 2);
  const auto n = static_cast<double>(distances_m.size());
  statistics.mean.sigma_m = std::sqrt(variances) / n;
  // If all distances are zero the RMS has no gradient; its standard deviation is the RMS sigma.
  statistics.rms.sigma_m = statistics.rms_m > 0 ? std::sqrt(weighted) / (n * statistics.rms_m)
                                                : std::sqrt(variances / n);
  statistics.median.sigma_m = quantile_sigma(sorted_sigmas, 0.5);
  statistics.p95.sigma_m = quantile_sigma(sorted_sigmas, 0.95);
  statistics.max.sigma_m = sorted_sigmas.back();
}

std::optional<RigidAlignment> align(const std::vector<MarkError>& marks) {
  const auto n = static_cast<Eigen::Index>(marks.size());
  Eigen::Matrix3Xd real(3, n), simulated(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    real.col(i) = marks[static_cast<std::size_t>(i)].real_in_world;
    simulated.col(i) = marks[static_cast<std::size_t>(i)].virtual_in_world;
  }
  const auto motion = rigid_motion(real, simulated);
  if (!motion) return std::nullopt;
  RigidAlignment result;
  result.rotation = motion->rotation;
  result.shift_m = motion->translation_m;
  result.turn_rad = rotation_vector(motion->rotation).norm();
  result.centroid_shift_m = (simulated.rowwise().mean() - real.rowwise().mean()).norm();
  std::vector<MarkError> moved = marks;
  for (MarkError& mark : moved) {
    mark.real_in_world = result.rotation * mark.real_in_world + result.shift_m;
    mark.distance_m = (mark.real_in_world - mark.virtual_in_world).norm();
    mark.sigma_distance_m.reset();  // the covariances would need to be rotated and reduced too
  }
  result.after = statistics_of(moved);
  return result;
}

StrainMaps strain_maps(const Sheet& measured, const Surface& virtual_sheet) {
  StrainMaps maps;
  for (const SheetMark& mark : measured.marks) {
    const auto [row, col] = mark.mark;
    const auto a = place_of(measured, virtual_sheet, {row, col});
    if (!a) continue;
    const auto b = place_of(measured, virtual_sheet, {row + 1, col});
    const auto c = place_of(measured, virtual_sheet, {row + 1, col + 1});
    const auto d = place_of(measured, virtual_sheet, {row, col + 1});
    if (b) maps.edges.push_back(edge_of(*a, *b, true));
    if (d) maps.edges.push_back(edge_of(*a, *d, false));
    if (b && c && d) maps.cells.push_back(cell_of(*a, *b, *c, *d));
  }
  std::vector<double> warp, weft, area;
  for (const EdgeStrain& edge : maps.edges)
    (edge.along_warp ? warp : weft).push_back(edge.real - edge.simulated);
  for (const AreaStrain& cell : maps.cells) area.push_back(cell.real - cell.simulated);
  maps.difference = {root_mean_square(warp), root_mean_square(weft), root_mean_square(area)};
  return maps;
}

}  // namespace drape::compare
