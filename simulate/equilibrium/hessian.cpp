// SPDX-License-Identifier: Apache-2.0
#include "simulate/equilibrium/hessian.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"
#include "simulate/cloth/clamp.hpp"
#include "simulate/cloth/normal_curvature.hpp"
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

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Second derivatives of a scalar of up to three vectors; [u][v] by vector u and vector v.
using Blocks = std::array<std::array<Matrix3d, 3>, 3>;

/// Second derivative of a potential with force(x), x = c . n: tangent * gradient gradient^T + force
/// * its own second derivatives, vectors in the order c, a, b.
Blocks curvature_blocks(const Vector3d& c, const Vector3d& a, const Vector3d& b, double force,
                        double tangent, bool convex) {
  const NormalCurvature k = normal_curvature(c, a, b);
  const std::array<Vector3d, 3> gradient = {k.of_c, k.of_a, k.of_b};
  Blocks blocks;
  for (int u = 0; u < 3; ++u)
    for (int v = 0; v < 3; ++v)
      blocks[u][v] =
          (convex ? std::max(0.0, tangent) : tangent) * gradient[u] * gradient[v].transpose();
  if (convex) return blocks;
  const double size = a.cross(b).norm();
  const Vector3d n = k.of_c, along = c - k.value * n;
  const Matrix3d flat = Matrix3d::Identity() - n * n.transpose();
  // By the product a x b, which the derivatives of a and b reach through.
  const Matrix3d mixed = flat / size;
  const Matrix3d twice =
      -(along * n.transpose() + n * along.transpose() + k.value * flat) / (size * size);
  const Matrix3d by[2] = {-cross_matrix(b), cross_matrix(a)};
  for (int u = 0; u < 2; ++u) {
    const Matrix3d by_c = force * mixed * by[u];
    blocks[0][u + 1] += by_c;
    blocks[u + 1][0] += by_c.transpose();
    for (int v = 0; v < 2; ++v) blocks[u + 1][v + 1] += force * by[u].transpose() * twice * by[v];
  }
  const Matrix3d product = force * cross_matrix(along / size);
  blocks[1][2] -= product;
  blocks[2][1] += product;  // the transpose: a cross matrix is skew
  return blocks;
}

/// Second derivative of a potential with force(x), x the shear angle of a and b.
Blocks shear_friction_blocks(const Vector3d& a, const Vector3d& b, double force, double tangent,
                             bool convex) {
  const ShearAngle x = shear_angle(a, b);
  Blocks blocks;
  const double stiffness = convex ? std::max(0.0, tangent) : tangent;
  blocks[0][0] = stiffness * x.of_a * x.of_a.transpose();
  blocks[0][1] = stiffness * x.of_a * x.of_b.transpose();
  blocks[1][1] = stiffness * x.of_b * x.of_b.transpose();
  if (!convex) {
    const double la = a.norm(), lb = b.norm();
    const Vector3d ua = a / la, ub = b / lb;
    const double bent = force * x.sine / x.cosine, per = force / x.cosine;
    const Matrix3d one = Matrix3d::Identity(), cross = ua * ub.transpose();
    const Matrix3d both = cross + cross.transpose();
    blocks[0][0] += bent * x.of_a * x.of_a.transpose() +
                    per / (la * la) * (3 * x.sine * ua * ua.transpose() - both - x.sine * one);
    blocks[1][1] += bent * x.of_b * x.of_b.transpose() +
                    per / (lb * lb) * (3 * x.sine * ub * ub.transpose() - both - x.sine * one);
    blocks[0][1] += bent * x.of_a * x.of_b.transpose() +
                    per / (la * lb) * (one - ua * ua.transpose()) * (one - ub * ub.transpose());
  }
  blocks[1][0] = blocks[0][1].transpose();
  return blocks;
}

/// Adds blocks of vectors that are weighted sums of particles; a particle may stand twice.
template <std::size_t Particles, std::size_t Vectors>
void add_blocks(const std::array<int, Particles>& particle,
                const std::array<std::array<double, Particles>, Vectors>& weight,
                const Blocks& blocks, double scale, GridMatrix& sum) {
  for (std::size_t p = 0; p < Particles; ++p) {
    for (std::size_t q = 0; q < Particles; ++q) {
      if (particle[q] > particle[p]) continue;  // the other half
      if (particle[q] == particle[p] && q > p) continue;
      Matrix3d block = Matrix3d::Zero();
      for (std::size_t u = 0; u < Vectors; ++u)
        for (std::size_t v = 0; v < Vectors; ++v)
          if (weight[u][p] != 0 && weight[v][q] != 0)
            block += weight[u][p] * weight[v][q] * blocks[u][v];
      if (block.isZero(0)) continue;
      sum.add(particle[p], particle[q], scale * block);
      if (particle[q] == particle[p] && q != p)
        sum.add(particle[p], particle[q], Matrix3d(scale * block.transpose()));
    }
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

void add_friction_hessian(const Cloth& cloth, const Field& x, bool convex, GridMatrix& hessian) {
  const ClothFriction& friction = *cloth.laws().friction;
  const ClothMemory& memory = cloth.memory();
  for (int d = 0; d < 2; ++d) {
    const Cloth::Line& line = cloth.line(d);
    const FrictionStack& stack = friction.bending[d];
    const std::size_t m = stack.elements.size();
    for (int i = line.stride; m > 0 && i + line.stride < cloth.count(); ++i) {
      if (line.triple_width[i] == 0) continue;
      const CurvatureStencil s = curvature_stencil(cloth, d, i);
      const Vector3d c = weigh(s, s.c, x), a = weigh(s, s.a, x), b = weigh(s, s.b, x);
      const double value = normal_curvature(c, a, b).value;
      const double* slip = memory.bending[d].data() + m * i;
      const Blocks blocks =
          curvature_blocks(c, a, b, stack.force(value, slip), stack.tangent(value, slip), convex);
      add_blocks<5, 3>(s.particle, {s.c, s.a, s.b}, blocks, line.triple_width[i] * line.spacing,
                       hessian);
    }
  }
  const int cols = cloth.grid().cols;
  const double area = cloth.line(0).spacing * cloth.line(1).spacing;
  const std::size_t m = friction.shear.elements.size();
  const std::array<std::array<double, 4>, 2> signs = {{{-1, -1, 1, 1}, {-1, 1, -1, 1}}};
  for (int i = 0; m > 0 && i + cols + 1 < cloth.count(); ++i) {
    if (!cloth.has_cell(i)) continue;
    const std::array<int, 4> corner = {i, i + 1, i + cols, i + cols + 1};
    Vector3d a = Vector3d::Zero(), b = Vector3d::Zero();
    for (int k = 0; k < 4; ++k) {
      a += signs[0][k] * at(x, corner[k]);
      b += signs[1][k] * at(x, corner[k]);
    }
    const double value = shear_angle(a, b).value;
    const double* slip = memory.shear.data() + m * i;
    add_blocks<4, 2>(corner, signs,
                     shear_friction_blocks(a, b, friction.shear.force(value, slip),
                                           friction.shear.tangent(value, slip), convex),
                     area, hessian);
  }
}

}  // namespace drape::simulate
