// SPDX-License-Identifier: Apache-2.0
#include "simulate/drape/smooth_surface.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace drape::simulate {
namespace {

using Eigen::Array2i;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kNearest = 24;          // points per polynomial
constexpr double kInCell = 6;         // mean number of points per cell
constexpr double kFalling = 2.5;      // factor in the exponent of the weights
constexpr double kSupport = 1.05;     // reach relative to the farthest of these points
constexpr double kDetermined = 1e-4;  // least pivot relative to the largest
constexpr int kTerms[] = {3, 6, 10};  // terms of a polynomial of degree 1, 2, 3

Eigen::Matrix<double, 1, 10> monomials(const Vector2d& p) {
  const double a = p.x(), b = p.y();
  Eigen::Matrix<double, 1, 10> row;
  row << 1, a, b, a * a, a * b, b * b, a * a * a, a * a * b, a * b * b, b * b * b;
  return row;
}

}  // namespace

SmoothSurface::SmoothSurface(std::vector<Vector2d> material_m, std::vector<Vector3d> places)
    : material_(std::move(material_m)), places_(std::move(places)) {
  if (material_.size() < 3 || material_.size() != places_.size())
    throw bad_input("fewer than three points of a shape have a place", {},
                    "give at least three points off one line");
  const Eigen::AlignedBox2d box = box_of(material_);
  const Vector2d size = box.sizes().cwiseMax(1e-3 * box.sizes().maxCoeff() + 1e-9);
  cells_ = Cells(box.min(), size,
                 std::sqrt(size.prod() * kInCell / static_cast<double>(material_.size())));
  points_of_.resize(static_cast<std::size_t>(cells_.count.prod()));
  for (std::size_t i = 0; i < material_.size(); ++i) {
    const Array2i cell = cells_.of(material_[i]);
    points_of_[cells_.index(cell.x(), cell.y())].push_back(static_cast<int>(i));
  }
}

/// The nearest points by distance; grows a square of cells until no other cell can hold one.
std::vector<SmoothSurface::Near> SmoothSurface::nearest(const Vector2d& p) const {
  const std::size_t wanted = std::min<std::size_t>(kNearest, material_.size());
  const Array2i centre = cells_.of(p), count = cells_.count;
  const Vector2d inside =
      p.cwiseMax(cells_.low).cwiseMin(cells_.low + cells_.size_m * count.cast<double>().matrix());
  const double outside = (p - inside).norm();
  std::vector<Near> found;
  for (int ring = 0;; ++ring) {
    for (int i = std::max(0, centre.x() - ring); i <= std::min(count.x() - 1, centre.x() + ring);
         ++i)
      for (int j = std::max(0, centre.y() - ring); j <= std::min(count.y() - 1, centre.y() + ring);
           ++j) {
        if (std::max(std::abs(i - centre.x()), std::abs(j - centre.y())) != ring) continue;
        for (const int k : points_of_[cells_.index(i, j)])
          found.push_back({(material_[k] - p).squaredNorm(), k});
      }
    const bool all = ring >= count.maxCoeff();
    if (found.size() < wanted && !all) continue;
    std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(wanted),
                      found.end());
    const double seen = std::max(0.0, ring * cells_.size_m - outside);
    if (all || found[wanted - 1].distance2 <= seen * seen) break;
  }
  found.resize(wanted);
  return found;
}

MeshCloth::Jet SmoothSurface::at(const Vector2d& p) const {
  const std::vector<Near> near = nearest(p);
  const auto count = static_cast<Eigen::Index>(near.size());
  const double reach = kSupport * std::sqrt(near.back().distance2);
  Eigen::Matrix<double, Eigen::Dynamic, 10, 0, kNearest, 10> rows(count, 10);
  Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kNearest, 3> values(count, 3);
  for (Eigen::Index k = 0; k < count; ++k) {
    const double weight = std::exp(-kFalling * near[k].distance2 / (reach * reach));
    rows.row(k) = weight * monomials((material_[near[k].point] - p) / reach);
    values.row(k) = weight * places_[near[k].point].transpose();
  }
  for (int degree = 3; degree >= 1; --degree) {
    const int terms = kTerms[degree - 1];
    if (count < terms) continue;
    Eigen::ColPivHouseholderQR<
        Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kNearest, 10>>
        solver(rows.leftCols(terms));
    solver.setThreshold(kDetermined);
    if (solver.rank() < terms) continue;
    const Eigen::Matrix<double, Eigen::Dynamic, 3> found = solver.solve(values);
    return {found.row(0), found.row(1) / reach, found.row(2) / reach};
  }
  throw bad_input("the points of a shape that have a place lie on a line", {},
                  "give at least three points off one line");
}

}  // namespace drape::simulate
