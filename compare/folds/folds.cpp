// SPDX-License-Identifier: Apache-2.0
#include "compare/folds/folds.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/units.hpp"

namespace drape::compare {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kEven = 1e-6;  // tolerance of the grid's steps, relative to the patch
constexpr double kLeastCurvature_per_m = 10;
constexpr double kLeastLength_m = 0.03;

/// Rows and columns of a complete sheet; is_even() tells whether its material steps are equal.
struct Grid {
  const std::vector<SheetMark>& marks;  ///< sorted
  int rows = 0, cols = 0;
  Vector2d step;

  explicit Grid(const Sheet& sheet) : marks(sheet.marks), rows(sheet.rows), cols(sheet.cols) {
    step = (marks.back().material_m - marks.front().material_m)
               .cwiseQuotient(Vector2d(rows - 1, cols - 1));
  }
  [[nodiscard]] bool is_even() const {
    const Vector2d &first = marks.front().material_m, span = marks.back().material_m - first;
    return step.minCoeff() > 0 && std::ranges::all_of(marks, [&](const auto& mark) {
             const Vector2d at = step.cwiseProduct(Vector2d(mark.mark.row, mark.mark.col));
             return (mark.material_m - first - at).norm() <= kEven * span.norm();
           });
  }
  [[nodiscard]] bool is_rim(int r, int c) const {
    return r == 0 || c == 0 || r + 1 == rows || c + 1 == cols;
  }
  [[nodiscard]] std::size_t index(int r, int c) const {
    return static_cast<std::size_t>(r) * cols + c;
  }
  [[nodiscard]] const Vector2d& material(int r, int c) const {
    return marks[index(r, c)].material_m;
  }
  [[nodiscard]] const Vector3d& point(int r, int c) const {
    return marks[index(r, c)].point_in_world;
  }
};

/// Curvatures at inner points by central differences. The metric of the stretched cloth is taken
/// from edge lengths, since a chord over a sharp fold has none.
Eigen::Matrix2d curvature_of(const Grid& grid, int r, int c) {
  const Vector2d& h = grid.step;
  const Vector3d u = (grid.point(r + 1, c) - grid.point(r - 1, c)) / (2 * h.x());
  const Vector3d v = (grid.point(r, c + 1) - grid.point(r, c - 1)) / (2 * h.y());
  const Vector3d n = u.cross(v).normalized();
  const Vector3d uu =
      (grid.point(r + 1, c) - 2 * grid.point(r, c) + grid.point(r - 1, c)) / (h.x() * h.x());
  const Vector3d vv =
      (grid.point(r, c + 1) - 2 * grid.point(r, c) + grid.point(r, c - 1)) / (h.y() * h.y());
  const Vector3d uv = (grid.point(r + 1, c + 1) - grid.point(r + 1, c - 1) -
                       grid.point(r - 1, c + 1) + grid.point(r - 1, c - 1)) /
                      (4 * h.x() * h.y());
  Eigen::Matrix2d second;
  // Positive where the cloth bends away from its normal: a ridge.
  second << -uu.dot(n), -uv.dot(n), -uv.dot(n), -vv.dot(n);
  const auto length = [](const Vector3d& a, const Vector3d& b) { return (a - b).norm(); };
  const Vector3d& here = grid.point(r, c);
  const Vector2d scale(
      2 * h.x() / (length(grid.point(r + 1, c), here) + length(here, grid.point(r - 1, c))),
      2 * h.y() / (length(grid.point(r, c + 1), here) + length(here, grid.point(r, c - 1))));
  return scale.asDiagonal() * second * scale.asDiagonal();
}

/// Orthonormal DCT-II matrix.
MatrixXd cosines(Eigen::Index count) {
  const auto n = static_cast<double>(count);
  return MatrixXd::NullaryExpr(count, count, [n](Eigen::Index k, Eigen::Index i) {
    return std::sqrt((k == 0 ? 1 : 2) / n) *
           std::cos(std::numbers::pi * static_cast<double>(k) * (static_cast<double>(i) + 0.5) / n);
  });
}

/// Adds each mode's share of the variance to the band of its wavelength.
template <class Member>
void add_power(const MatrixXd& values, const Vector2d& step, std::vector<WaveBand>& bands,
               Member member) {
  const MatrixXd modes = cosines(values.rows()) * values * cosines(values.cols()).transpose();
  const auto count = static_cast<double>(values.size());
  for (Eigen::Index p = 0; p < modes.rows(); ++p) {
    for (Eigen::Index q = 0; q < modes.cols(); ++q) {
      if (p == 0 && q == 0) continue;
      const double across =
          std::hypot(static_cast<double>(p) / (2 * step.x() * static_cast<double>(values.rows())),
                     static_cast<double>(q) / (2 * step.y() * static_cast<double>(values.cols())));
      auto band = bands.begin();
      while (band + 1 != bands.end() && 1 / across < band->from_m) ++band;
      (*band).*member += modes(p, q) * modes(p, q) / count;
    }
  }
}

std::vector<WaveBand> empty_bands(const Grid& grid) {
  const double longest = 2 * std::max(grid.step.x() * grid.rows, grid.step.y() * grid.cols);
  std::vector<WaveBand> bands;
  double to = longest;
  while (to > grid.step.minCoeff()) {
    bands.push_back({to / std::sqrt(2.0), to, 0, 0});
    to /= std::sqrt(2.0);
  }
  bands.front().to_m *= 1 + 1e-9;  // includes the longest wave
  return bands;
}

/// Larger principal curvature, with the direction across the fold (warp, weft).
struct Principal {
  double size = 0;
  Vector2d across = Vector2d::Zero();
};

Principal principal_of(const Eigen::Matrix2d& curvature) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solved(curvature);
  const int k = std::abs(solved.eigenvalues()[0]) > std::abs(solved.eigenvalues()[1]) ? 0 : 1;
  return {solved.eigenvalues()[k], solved.eigenvectors().col(k)};
}

class FoldFinder {
 public:
  FoldFinder(const Grid& grid, std::vector<Principal> principal)
      : grid_(grid), principal_(std::move(principal)), on_line_(principal_.size()) {
    for (int r = 1; r + 1 < grid.rows; ++r)
      for (int c = 1; c + 1 < grid.cols; ++c) on_line_[index(r, c)] = is_crest(r, c);
  }

  [[nodiscard]] std::vector<Fold> folds() {
    std::vector<Fold> found;
    for (int r = 1; r + 1 < grid_.rows; ++r) {
      for (int c = 1; c + 1 < grid_.cols; ++c) {
        if (!on_line_[index(r, c)]) continue;
        const Fold fold = fold_of(connected(r, c));
        if (fold.length_m >= kLeastLength_m) found.push_back(fold);
      }
    }
    std::ranges::stable_sort(found, std::greater(), &Fold::length_m);
    return found;
  }

 private:
  [[nodiscard]] std::size_t index(int r, int c) const { return grid_.index(r, c); }

  /// True if bent enough, and at least as much as on both sides across the fold; false next to the
  /// border, which has no curvature of its own.
  [[nodiscard]] bool is_crest(int r, int c) const {
    const Principal& here = principal_[index(r, c)];
    if (std::abs(here.size) < kLeastCurvature_per_m) return false;
    const int dr = static_cast<int>(std::lround(here.across.x()));
    const int dc = static_cast<int>(std::lround(here.across.y()));
    for (const int side : {-1, 1}) {
      const int row = r + side * dr, col = c + side * dc;
      if (grid_.is_rim(row, col)) return false;
      const double beside = principal_[index(row, col)].size;
      const bool higher = side < 0 ? std::abs(beside) >= std::abs(here.size)
                                   : std::abs(beside) > std::abs(here.size);
      if (beside * here.size > 0 && higher) return false;
    }
    return true;
  }
  /// Extracts a line of one sign, connected along sides and corners.
  std::vector<std::pair<int, int>> connected(int row, int col) {
    std::vector<std::pair<int, int>> line = {{row, col}};
    const bool ridge = principal_[index(row, col)].size > 0;
    on_line_[index(row, col)] = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
      for (int dr = -1; dr <= 1; ++dr) {
        for (int dc = -1; dc <= 1; ++dc) {
          const int r = line[i].first + dr, c = line[i].second + dc;
          if (!on_line_[index(r, c)] || (principal_[index(r, c)].size > 0) != ridge) continue;
          on_line_[index(r, c)] = false;
          line.emplace_back(r, c);
        }
      }
    }
    return line;
  }
  [[nodiscard]] Fold fold_of(const std::vector<std::pair<int, int>>& line) const {
    Eigen::Matrix2Xd places(2, line.size());
    Fold fold{Vector2d::Zero()};
    for (std::size_t i = 0; i < line.size(); ++i) {
      const auto [r, c] = line[i];
      places.col(static_cast<Eigen::Index>(i)) = grid_.material(r, c);
      fold.curvature_per_m += principal_[index(r, c)].size / static_cast<double>(line.size());
    }
    fold.middle_material_m = places.rowwise().mean();
    places.colwise() -= fold.middle_material_m;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solved(places * places.transpose());
    const Vector2d along = solved.eigenvectors().col(1);
    const Eigen::RowVectorXd at = along.transpose() * places;
    fold.length_m = at.maxCoeff() - at.minCoeff();
    fold.direction_rad = std::atan2(along.y(), along.x());
    if (fold.direction_rad < 0) fold.direction_rad += std::numbers::pi;
    return fold;
  }

  const Grid& grid_;
  std::vector<Principal> principal_;
  std::vector<bool> on_line_;
};

}  // namespace

std::optional<SheetShape> shape_of(const Sheet& sheet) {
  if (sheet.rows < 5 || sheet.cols < 5 ||
      static_cast<int>(sheet.marks.size()) != sheet.rows * sheet.cols)
    return std::nullopt;
  const Grid grid(sheet);
  if (!grid.is_even()) return std::nullopt;
  MatrixXd height(grid.rows, grid.cols), mean(grid.rows - 2, grid.cols - 2);
  std::vector<Principal> principal(sheet.marks.size());
  SheetShape shape;
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) {
      height(r, c) = grid.point(r, c).z();
      if (grid.is_rim(r, c)) continue;
      const Eigen::Matrix2d curvature = curvature_of(grid, r, c);
      principal[grid.index(r, c)] = principal_of(curvature);
      mean(r - 1, c - 1) = curvature.trace() / 2;
      shape.mean_bending_per_m2 += curvature.squaredNorm() / static_cast<double>(mean.size());
    }
  }
  shape.bands = empty_bands(grid);
  add_power(height, grid.step, shape.bands, &WaveBand::height_m2);
  add_power(mean, grid.step, shape.bands, &WaveBand::curvature_per_m2);
  shape.folds = FoldFinder(grid, std::move(principal)).folds();
  return shape;
}

std::vector<Descriptor> descriptors_of(const SheetShape& shape) {
  double height_m2 = 0, power = 0, log_length = 0, length_m = 0;
  for (const WaveBand& band : shape.bands) {
    height_m2 += band.height_m2;
    power += band.curvature_per_m2;
    log_length += band.curvature_per_m2 * std::log(std::sqrt(band.from_m * band.to_m));
  }
  for (const Fold& fold : shape.folds) length_m += fold.length_m;
  return {{"rms_curvature_per_m", std::sqrt(shape.mean_bending_per_m2)},
          {"height_sd_mm", std::sqrt(height_m2) / units::mm},
          {"curvature_wavelength_mm", power > 0 ? std::exp(log_length / power) / units::mm : 0},
          {"folds", static_cast<double>(shape.folds.size())},
          {"fold_length_mm", length_m / units::mm}};
}

}  // namespace drape::compare
