// SPDX-License-Identifier: Apache-2.0
// Second derivatives of the internal friction: consistent tangents of its return mapping.
#include <algorithm>
#include <cmath>

#include "simulate/cloth/normal_curvature.hpp"
#include "simulate/equilibrium/hessian.hpp"

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Second derivatives of a scalar of up to three vectors; [u][v] by vector u and vector v.
using Blocks = std::array<std::array<Matrix3d, 3>, 3>;

/// Of value force(x) with x = c . n: tangent * gradient gradient^T + force * its own second
/// derivatives, vectors in the order c, a, b.
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

/// Of value force(x) with x the shear angle of a and b.
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
