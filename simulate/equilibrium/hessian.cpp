// SPDX-License-Identifier: Apache-2.0
#include "simulate/equilibrium/hessian.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"
#include "simulate/cloth/clamp.hpp"
#include "simulate/equilibrium/mixture.hpp"

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kBand = 24;        // rows of a grid that one task adds
constexpr int kWorthBands = 61;  // rows of a grid from which it is worth tasks

/// First particles of the elements to add.
struct Range {
  int begin = 0, end = 0;
};

void add_springs(const Cloth& cloth, int direction, const Field& x, bool convex,
                 const SpringStrains* strains, Range range, GridMatrix& sum) {
  const Cloth::Line& line = cloth.line(direction);
  const ForceCurve& law = cloth.laws().tensile[direction];
  for (int i = range.begin; i < range.end && i + line.stride < cloth.count(); ++i) {
    if (line.width[i] == 0) continue;
    const int j = i + line.stride;
    const Vector3d along = at(x, j) - at(x, i);
    const double length = along.norm();
    const Vector3d unit = along / length;
    const double strain = strains != nullptr ? (*strains)[direction][i] : length / line.spacing - 1;
    const double axial = line.width[i] * law.tangent(strain) / line.spacing;
    double across = line.width[i] * law.value(strain) / length;
    if (convex) across = std::max(0.0, across);
    const Matrix3d block =
        across * Matrix3d::Identity() + (axial - across) * unit * unit.transpose();
    sum.add(i, i, block);
    sum.add(j, j, block);
    sum.add(j, i, -block);
  }
}

void add_triples(const Cloth& cloth, int direction, const Field& x, Range range, GridMatrix& sum) {
  const Cloth::Line& line = cloth.line(direction);
  const ForceCurve& law = cloth.laws().bending[direction];
  const double per_area = 1 / (line.spacing * line.spacing);
  for (int before = range.begin; before < range.end; ++before) {
    const int i = before + line.stride;
    if (i + line.stride >= cloth.count()) break;
    if (line.triple_width[i] == 0) continue;
    const int after = i + line.stride;
    const Vector3d bend = at(x, before) - 2 * at(x, i) + at(x, after);
    const double curvature = bend.norm() * per_area;
    const double scale = line.triple_width[i] * line.spacing * per_area * per_area;
    const double secant = curvature > 0 ? law.value(curvature) / curvature : law.slope;
    Matrix3d block = scale * secant * Matrix3d::Identity();
    if (curvature > 0) {
      const Vector3d unit = bend.normalized();
      block += scale * (law.tangent(curvature) - secant) * unit * unit.transpose();
    }
    sum.add(before, before, block);
    sum.add(after, after, block);
    sum.add(i, i, 4 * block);
    sum.add(after, before, block);
    sum.add(i, before, -2 * block);
    sum.add(after, i, -2 * block);
  }
}

/// Second derivatives of area * F(angle) with respect to the two mid-lines a (warp), b (weft).
struct ShearBlocks {
  Matrix3d aa, ab, bb;
};

ShearBlocks shear_blocks(const Vector3d& a, const Vector3d& b, double area, const ForceCurve& law,
                         bool convex) {
  const double la = a.norm();
  const double lb = b.norm();
  const Vector3d ua = a / la;
  const Vector3d ub = b / lb;
  const double sine = std::clamp(ua.dot(ub), -1.0, 1.0);
  // The same floor as the forces have.
  const double cosine = std::sqrt(std::max(1e-6, 1 - sine * sine));
  const double angle = std::asin(sine);
  const Vector3d ga = (ub - sine * ua) / (la * cosine);
  const Vector3d gb = (ua - sine * ub) / (lb * cosine);
  const double stiffness = area * law.tangent(std::abs(angle));
  ShearBlocks out{stiffness * ga * ga.transpose(), stiffness * ga * gb.transpose(),
                  stiffness * gb * gb.transpose()};
  if (convex) return out;
  const double moment = area * law.odd_value(angle);
  const double bent = moment * sine / cosine;
  const Matrix3d one = Matrix3d::Identity();
  const Matrix3d cross = ua * ub.transpose();
  const Matrix3d both = cross + cross.transpose();
  const double per = moment / cosine;
  out.aa += bent * ga * ga.transpose() +
            per / (la * la) * (3 * sine * ua * ua.transpose() - both - sine * one);
  out.bb += bent * gb * gb.transpose() +
            per / (lb * lb) * (3 * sine * ub * ub.transpose() - both - sine * one);
  out.ab += bent * ga * gb.transpose() +
            per / (la * lb) * (one - ua * ua.transpose()) * (one - ub * ub.transpose());
  return out;
}

void add_cells(const Cloth& cloth, const Field& x, bool convex, Range range, GridMatrix& sum) {
  static constexpr double kWarp[4] = {-1, -1, 1, 1};
  static constexpr double kWeft[4] = {-1, 1, -1, 1};
  static constexpr double kTwist[4] = {1, -1, -1, 1};
  const int cols = cloth.grid().cols;
  const double area = cloth.line(0).spacing * cloth.line(1).spacing;
  const double twist = cloth.laws().twist_n_m / area;
  for (int i = range.begin; i < range.end && i + cols + 1 < cloth.count(); ++i) {
    if (!cloth.has_cell(i)) continue;
    const int corner[4] = {i, i + 1, i + cols, i + cols + 1};
    Vector3d a = Vector3d::Zero();
    Vector3d b = Vector3d::Zero();
    for (int k = 0; k < 4; ++k) {
      a += kWarp[k] * at(x, corner[k]);
      b += kWeft[k] * at(x, corner[k]);
    }
    const ShearBlocks s = shear_blocks(a, b, area, cloth.laws().shear, convex);
    // All that the signs of two corners can make of the blocks.
    const Matrix3d cross = s.ab.transpose();
    const Matrix3d along[2] = {s.aa - s.bb, s.aa + s.bb};
    const Matrix3d skew[2] = {s.ab - cross, s.ab + cross};
    for (int k = 0; k < 4; ++k) {
      for (int l = 0; l <= k; ++l) {
        const double warps = kWarp[k] * kWarp[l];
        const bool alike = warps == kWeft[k] * kWeft[l];
        Matrix3d block = warps * along[alike] + kWarp[k] * kWeft[l] * skew[alike];
        block.diagonal().array() += twist * kTwist[k] * kTwist[l];
        sum.add(corner[k], corner[l], block);
      }
    }
  }
}

void add_clamps(const Cloth& cloth, const Field& x, GridMatrix& sum) {
  for (const ClampedPlace& place : cloth.clamped_places()) {
    const Matrix3d block = clamped_hessian(cloth, place, x);
    sum.add(place.held, place.held, block);
    sum.add(place.next, place.next, block);
    sum.add(place.next, place.held, -block);
  }
}

}  // namespace

SpringStrains linear_strains(const Cloth& cloth, const Field& from,
                             const Eigen::VectorXd& displacement) {
  SpringStrains strains;
  for (int d = 0; d < 2; ++d) {
    const Cloth::Line& line = cloth.line(d);
    strains[d].assign(cloth.count(), 0.0);
    for (int i = 0; i + line.stride < cloth.count(); ++i) {
      if (line.width[i] == 0) continue;
      const int j = i + line.stride;
      const Vector3d along = at(from, j) - at(from, i);
      const double length = along.norm();
      const double growth =
          along.dot(displacement.segment<3>(3 * j) - displacement.segment<3>(3 * i)) / length;
      strains[d][i] = (length + growth) / line.spacing - 1;
    }
  }
  return strains;
}

void add_hessian(const Cloth& cloth, const Field& position, bool convex, GridMatrix& hessian,
                 const SpringStrains* strains, int threads) {
  if (cloth.laws().friction) add_friction_hessian(cloth, position, convex, hessian);
  const auto add = [&](Range range) {
    for (int d = 0; d < 2; ++d) {
      add_springs(cloth, d, position, convex, strains, range, hessian);
      add_triples(cloth, d, position, range, hessian);
    }
    add_cells(cloth, position, convex, range, hessian);
  };
  const int rows = cloth.grid().rows;
  const int cols = cloth.grid().cols;
  if (rows < kWorthBands) {
    add({0, cloth.count()});
    add_clamps(cloth, position, hessian);
    return;
  }
  // Bands have no particle in common: an element reaches over two more rows at most, so those that
  // begin in the last two rows of a band come afterwards. The bands are those of the grid, not the
  // threads'.
  const int bands = (rows + kBand - 1) / kBand;
  parallel_for(bands, threads, [&](std::size_t k) {
    const int first = static_cast<int>(k) * kBand;
    const bool last = static_cast<int>(k) + 1 == bands;
    add({first * cols, (last ? rows : first + kBand - 2) * cols});
  });
  for (int k = 1; k < bands; ++k) add({(k * kBand - 2) * cols, k * kBand * cols});
  add_clamps(cloth, position, hessian);
}

}  // namespace drape::simulate
