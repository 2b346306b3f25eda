// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/metrics.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <numeric>

#include "core/geometry/rigid_motion.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

constexpr double kEdgeTolerance_m = 1e-9;
constexpr double kLatticeTolerance_m = 1e-6;

/// Index of the cell that contains `x`, and the position within it, 0..1.
std::optional<std::pair<std::size_t, double>> cell_of(const std::vector<double>& lines, double x) {
  if (x < lines.front() - kEdgeTolerance_m || x > lines.back() + kEdgeTolerance_m)
    return std::nullopt;
  const auto after = std::upper_bound(lines.begin() + 1, lines.end() - 1, x);
  const auto cell = static_cast<std::size_t>(after - lines.begin()) - 1;
  const double t = (x - lines[cell]) / (lines[cell + 1] - lines[cell]);
  return std::pair{cell, std::clamp(t, 0.0, 1.0)};
}

/// Centroids of the n^2 equal parts of a triangle.
template <class Visit>
void visit_pieces(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                  int n, const Visit& visit) {
  const auto at = [&](double u, double v) -> Eigen::Vector3d {
    return a + u / n * (b - a) + v / n * (c - a);
  };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; i + j < n; ++j) {
      visit(at(i + 1.0 / 3, j + 1.0 / 3));
      if (i + j + 1 < n) visit(at(i + 2.0 / 3, j + 2.0 / 3));
    }
  }
}

OneDirection one_direction(const TriangleMesh& from, const NearestSurface& to, double spacing_m) {
  double area = 0, sum = 0, squares = 0, largest = 0;
  const auto add = [&](double weight, const Eigen::Vector3d& point) {
    const double distance = to.distance_m(point);
    area += weight;
    sum += weight * distance;
    squares += weight * distance * distance;
    largest = std::max(largest, distance);
  };
  for (const auto& [i, j, k] : from.triangles) {
    const Eigen::Vector3d &a = from.points[i], &b = from.points[j], &c = from.points[k];
    const double whole = 0.5 * (b - a).cross(c - a).norm();
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const int n = std::max(1, static_cast<int>(std::ceil(longest / spacing_m * (1 - 1e-9))));
    visit_pieces(a, b, c, n, [&](const Eigen::Vector3d& p) { add(whole / (n * n), p); });
    for (const auto* corner : {&a, &b, &c}) add(0, *corner);
  }
  return {sum / area, std::sqrt(squares / area), largest};
}

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

Strain line_of(const char* kind, const Place& a, const Place& b) {
  const double rest = (b.material_m - a.material_m).norm();
  return {kind, a.mark, b.mark, (b.real - a.real).norm() / rest - 1,
          (b.simulated - a.simulated).norm() / rest - 1};
}

Strain area_of(const Place& a, const Place& b, const Place& c, const Place& d) {
  const double rest = std::abs((c.material_m - a.material_m).prod());
  return {"area", a.mark, c.mark, area_of({a.real, b.real, c.real, d.real}) / rest - 1,
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

}  // namespace

Surface::Surface(const Sheet& sheet, const std::string& file) {
  if (sheet.rows < 2 || sheet.cols < 2) {
    throw bad_input(fmt::format("a sheet of {}x{} points has no surface", sheet.rows, sheet.cols),
                    {.file = file}, "simulate with at least 2 particles per side");
  }
  const Where where{.file = file, .field = "material_mm"};
  for (const int axis : {0, 1}) {
    const char* name = axis == 0 ? "warp" : "weft";
    std::vector<std::optional<double>> lines(axis == 0 ? sheet.rows : sheet.cols);
    for (const SheetMark& mark : sheet.marks) {
      auto& line = lines[axis == 0 ? mark.mark.row : mark.mark.col];
      const double own = mark.material_m[axis];
      if (!line) line = own;
      if (std::abs(*line - own) > kLatticeTolerance_m)
        throw bad_input(
            fmt::format("the {} coordinate of mark ({}, {}) is {} mm, of its neighbours {} mm",
                        name, mark.mark.row, mark.mark.col, own / units::mm, *line / units::mm),
            where, "give a sheet whose points form a rectangular grid in material coordinates");
    }
    for (const auto& line : lines) {
      std::vector<double>& known = lines_m_[axis];
      if (!line || (!known.empty() && *line <= known.back()))
        throw bad_input(fmt::format("line {} along the {} has no point, or its material coordinate "
                                    "does not grow",
                                    known.size(), name),
                        where, "give a simulated sheet without empty rows or columns");
      known.push_back(*line);
    }
  }
  points_.resize(lines_m_[0].size() * lines_m_[1].size());
  for (const SheetMark& mark : sheet.marks)
    points_[mark.mark.row * lines_m_[1].size() + mark.mark.col] = mark.point_in_world;
}

const std::optional<Eigen::Vector3d>& Surface::point(std::size_t row, std::size_t col) const {
  return points_[row * lines_m_[1].size() + col];
}

std::optional<SurfacePoint> Surface::at(const Eigen::Vector2d& material_m) const {
  const auto warp = cell_of(lines_m_[0], material_m.x());
  const auto weft = cell_of(lines_m_[1], material_m.y());
  if (!warp || !weft) return std::nullopt;
  const auto [row, s] = *warp;
  const auto [col, t] = *weft;
  const auto &p00 = point(row, col), &p01 = point(row, col + 1);
  const auto &p10 = point(row + 1, col), &p11 = point(row + 1, col + 1);
  if (!p00 || !p01 || !p10 || !p11) return std::nullopt;
  const Eigen::Vector3d warp_tangent = (1 - t) * (*p10 - *p00) + t * (*p11 - *p01);
  const Eigen::Vector3d weft_tangent = (1 - s) * (*p01 - *p00) + s * (*p11 - *p10);
  const Eigen::Vector3d normal = warp_tangent.cross(weft_tangent);
  if (!(normal.norm() > 0)) return std::nullopt;
  const Eigen::Vector3d point_in_world = (1 - s) * ((1 - t) * *p00 + t * *p01) +  //
                                         s * ((1 - t) * *p10 + t * *p11);
  return SurfacePoint{point_in_world, warp_tangent.normalized(), weft_tangent.normalized(),
                      normal.normalized()};
}

std::optional<LatticeCoordinates> LatticeCoordinates::of(const Sheet& sheet,
                                                         const std::string& file) {
  if (sheet.marks.empty()) return std::nullopt;
  const SheetMark& first = sheet.marks.front();
  const SheetMark *other_row = nullptr, *other_col = nullptr;
  for (const SheetMark& mark : sheet.marks) {
    if (mark.mark.row != first.mark.row) other_row = &mark;
    if (mark.mark.col != first.mark.col) other_col = &mark;
  }
  if (other_row == nullptr || other_col == nullptr) return std::nullopt;
  LatticeCoordinates lattice;
  lattice.pitch_m = {
      (other_row->material_m.x() - first.material_m.x()) / (other_row->mark.row - first.mark.row),
      (other_col->material_m.y() - first.material_m.y()) / (other_col->mark.col - first.mark.col)};
  lattice.origin_m = first.material_m - lattice.at(first.mark);
  for (const SheetMark& mark : sheet.marks) {
    if ((lattice.at(mark.mark) - mark.material_m).norm() > kLatticeTolerance_m) {
      throw bad_input(fmt::format("mark ({}, {}) is not on the regular lattice of the others",
                                  mark.mark.row, mark.mark.col),
                      {.file = file, .field = "material_mm"},
                      "check pitch and margin in the print file and triangulate again");
    }
  }
  return lattice;
}

std::vector<Eigen::Vector2d> places_of(const Sheet& sheet) {
  std::vector<Eigen::Vector2d> places;
  for (const SheetMark& mark : sheet.marks) places.push_back(mark.material_m);
  return places;
}

std::vector<Eigen::Vector2d> lattice_places_of(const Sheet& sheet, const std::string& file) {
  const auto lattice = LatticeCoordinates::of(sheet, file);
  if (!lattice) return places_of(sheet);
  std::vector<Eigen::Vector2d> places;
  for (int row = 0; row < sheet.rows; ++row)
    for (int col = 0; col < sheet.cols; ++col) places.push_back(lattice->at({row, col}));
  return places;
}

double area_m2(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d& p = mesh.points[a];
    area += 0.5 * (mesh.points[b] - p).cross(mesh.points[c] - p).norm();
  }
  return area;
}

NearestSurface::NearestSurface(const TriangleMesh& mesh) {
  if (mesh.triangles.empty())
    throw bad_input("a surface without a triangle has no distance", {},
                    "give a sheet with at least one complete cell");
  std::vector<TriangleTree::Corners> triangles;
  for (const auto& [a, b, c] : mesh.triangles)
    triangles.push_back({mesh.points[a], mesh.points[b], mesh.points[c]});
  static_cast<TriangleTree&>(*this) = TriangleTree(triangles);
}

TriangleMesh mesh_of(const Sheet& sheet) {
  TriangleMesh mesh;
  for (const SheetMark& mark : sheet.marks) {
    mesh.points.push_back(mark.point_in_world);
    std::vector<std::size_t> corners;
    for (const MarkId step : {MarkId{0, 0}, {1, 0}, {1, 1}, {0, 1}})
      if (const SheetMark* corner = sheet.find(mark.mark + step))
        corners.push_back(static_cast<std::size_t>(corner - sheet.marks.data()));
    if (corners.size() < 4) continue;
    mesh.triangles.push_back({corners[0], corners[1], corners[2]});
    mesh.triangles.push_back({corners[0], corners[2], corners[3]});
  }
  return mesh;
}

SurfaceDistance surface_distance(const TriangleMesh& first, const TriangleMesh& second,
                                 double spacing_m) {
  if (!(spacing_m > 0)) throw usage_error("the spacing of samples must be above 0 mm", "");
  const NearestSurface to_first(first), to_second(second);
  return {one_direction(first, to_second, spacing_m), one_direction(second, to_first, spacing_m)};
}

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
    MarkError error{mark.mark,
                    mark.material_m,
                    mark.point_in_world,
                    place->point_in_world,
                    difference.norm(),
                    {difference.dot(place->along_warp), difference.dot(place->along_weft),
                     difference.dot(place->normal)},
                    worst_sigma_m(mark),
                    {},
                    {},
                    mark.views};
    if (mark.covariance_m2) {
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
  statistics.max_m = *std::ranges::max_element(distances_m);
  return statistics;
}

DistanceStatistics statistics_of(const std::vector<double>& distances_m,
                                 const std::vector<double>& sigmas_m) {
  DistanceStatistics statistics = statistics_of(distances_m);
  add_bootstrap(distances_m, statistics);
  if (sigmas_m.size() == distances_m.size()) add_sigmas(distances_m, sigmas_m, statistics);
  statistics.sigma_mean_m = statistics.mean.sigma_m;
  if (const auto& range = statistics.mean.bootstrap) {
    statistics.low_m = range->low;
    statistics.high_m = range->high;
  }
  return statistics;
}

DistanceStatistics statistics_of(const std::vector<MarkError>& marks) {
  std::vector<double> distances, sigmas;
  for (const MarkError& mark : marks) {
    distances.push_back(mark.distance_m);
    if (mark.sigma_distance_m) sigmas.push_back(*mark.sigma_distance_m);
  }
  DistanceStatistics statistics = statistics_of(distances, sigmas);
  const auto worst = std::ranges::max_element(distances) - distances.begin();
  statistics.worst_mark = marks[static_cast<std::size_t>(worst)].mark;
  return statistics;
}

NormalStatistics normal_statistics_of(const std::vector<MarkError>& marks) {
  std::vector<double> values, sigmas;
  for (const MarkError& mark : marks) {
    values.push_back(mark.warp_weft_normal_m.z());
    if (mark.sigma_normal_m) sigmas.push_back(*mark.sigma_normal_m);
  }
  DistanceStatistics all = statistics_of(values);
  if (sigmas.size() == values.size()) add_sigmas(values, sigmas, all);
  if (values.size() < 2) return {all.mean_m, all.rms_m, all.mean};
  std::vector<double> means;
  bootstrap(values.size(), kResamples, [&](std::span<const std::int64_t> counts) {
    means.push_back(std::inner_product(counts.begin(), counts.end(), values.begin(), 0.0) /
                    static_cast<double>(values.size()));
  });
  all.mean.bootstrap = percentile_interval(means);
  return {all.mean_m, all.rms_m, all.mean};
}

void add_bootstrap(const std::vector<double>& distances_m, DistanceStatistics& statistics) {
  if (distances_m.size() < 2) return;
  std::vector<double> ascending = distances_m;
  std::ranges::sort(ascending);
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
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return distances_m[i]; });
  std::vector<double> sorted_sigmas;
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
  std::vector<double> distances;
  for (const MarkError& mark : marks)
    distances.push_back(
        (result.rotation * mark.real_in_world + result.shift_m - mark.virtual_in_world).norm());
  // Without sigmas: the covariances would need to be rotated and reduced too.
  result.after = statistics_of(distances, {});
  return result;
}

StrainMaps strain_maps(const Sheet& measured, const Surface& virtual_sheet) {
  StrainMaps maps;
  std::vector<Strain> cells;
  for (const SheetMark& mark : measured.marks) {
    const auto [row, col] = mark.mark;
    const auto a = place_of(measured, virtual_sheet, {row, col});
    if (!a) continue;
    const auto b = place_of(measured, virtual_sheet, {row + 1, col});
    const auto c = place_of(measured, virtual_sheet, {row + 1, col + 1});
    const auto d = place_of(measured, virtual_sheet, {row, col + 1});
    if (b) maps.strains.push_back(line_of("warp", *a, *b));
    if (d) maps.strains.push_back(line_of("weft", *a, *d));
    if (b && c && d) cells.push_back(area_of(*a, *b, *c, *d));
  }
  maps.strains.insert(maps.strains.end(), cells.begin(), cells.end());
  std::map<std::string, std::vector<double>> apart;
  for (const Strain& one : maps.strains) apart[one.kind].push_back(one.real - one.simulated);
  maps.difference = {root_mean_square(apart["warp"]), root_mean_square(apart["weft"]),
                     root_mean_square(apart["area"])};
  return maps;
}

}  // namespace drape::compare
