// SPDX-License-Identifier: Apache-2.0
// Friction elements of the grid's triples and cells.
#include "simulate/cloth/normal_curvature.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kWarpSigns[4] = {-1, -1, 1, 1};
constexpr double kWeftSigns[4] = {-1, 1, -1, 1};

/// Calls visit(stencil, curvature, particle) for every triple.
template <class Visit>
void visit_triples(const Cloth& cloth, int direction, const Field& x, Visit visit) {
  const Cloth::Line& line = cloth.line(direction);
  for (int i = line.stride; i + line.stride < cloth.count(); ++i) {
    if (line.triple_width[i] == 0) continue;
    const CurvatureStencil stencil = curvature_stencil(cloth, direction, i);
    visit(stencil,
          normal_curvature(weigh(stencil, stencil.c, x), weigh(stencil, stencil.a, x),
                           weigh(stencil, stencil.b, x)),
          i);
  }
}

/// Calls visit(corners, angle, particle) for every cell; the angle's gradient is by both mid-lines.
template <class Visit>
void visit_cells(const Cloth& cloth, const Field& x, Visit visit) {
  const int cols = cloth.grid().cols;
  for (int i = 0; i + cols + 1 < cloth.count(); ++i) {
    if (!cloth.has_cell(i)) continue;
    const std::array<int, 4> corner = {i, i + 1, i + cols, i + cols + 1};
    Vector3d a = Vector3d::Zero(), b = Vector3d::Zero();
    for (int k = 0; k < 4; ++k) {
      a += kWarpSigns[k] * at(x, corner[k]);
      b += kWeftSigns[k] * at(x, corner[k]);
    }
    visit(corner, shear_angle(a, b), i);
  }
}

}  // namespace

CurvatureStencil curvature_stencil(const Cloth& cloth, int direction, int i) {
  const Cloth::Line& line = cloth.line(direction);
  const Cloth::Line& beside = cloth.line(1 - direction);
  const double per_area = 1 / (line.spacing * line.spacing);
  const bool after = beside.width[i] > 0;
  const bool before = i >= beside.stride && beside.width[i - beside.stride] > 0;
  CurvatureStencil s;
  s.particle = {i, i - line.stride, i + line.stride, before ? i - beside.stride : i,
                after ? i + beside.stride : i};
  s.c = {-2 * per_area, per_area, per_area, 0, 0};
  s.a = {0, -1, 1, 0, 0};
  s.b = {0, 0, 0, -1, 1};
  return s;
}

void Cloth::add_friction(const Field& x, Field& force) const {
  const ClothFriction& friction = *laws_.friction;
  for (int d = 0; d < 2; ++d) {
    const FrictionStack& stack = friction.bending[d];
    const std::size_t m = stack.elements.size();
    visit_triples(*this, d, x, [&](const CurvatureStencil& s, const NormalCurvature& k, int i) {
      const double pull = lines_[d].triple_width[i] * lines_[d].spacing *
                          stack.force(k.value, memory_.bending[d].data() + m * i);
      for (int p = 0; p < 5; ++p)
        add_at(force, s.particle[p], -pull * (s.c[p] * k.of_c + s.a[p] * k.of_a + s.b[p] * k.of_b));
    });
  }
  const double area = lines_[0].spacing * lines_[1].spacing;
  const std::size_t m = friction.shear.elements.size();
  visit_cells(*this, x, [&](const std::array<int, 4>& corner, const ShearAngle& angle, int i) {
    const double pull = area * friction.shear.force(angle.value, memory_.shear.data() + m * i);
    for (int k = 0; k < 4; ++k)
      add_at(force, corner[k], -pull * (kWarpSigns[k] * angle.of_a + kWeftSigns[k] * angle.of_b));
  });
}

void Cloth::add_friction_energies(const Field& x, InternalEnergies& sum) const {
  const ClothFriction& friction = *laws_.friction;
  for (int d = 0; d < 2; ++d) {
    const FrictionStack& stack = friction.bending[d];
    const std::size_t m = stack.elements.size();
    visit_triples(*this, d, x, [&](const CurvatureStencil&, const NormalCurvature& k, int i) {
      sum.bending_j += lines_[d].triple_width[i] * lines_[d].spacing *
                       stack.potential(k.value, memory_.bending[d].data() + m * i);
    });
  }
  const double area = lines_[0].spacing * lines_[1].spacing;
  const std::size_t m = friction.shear.elements.size();
  visit_cells(*this, x, [&](const std::array<int, 4>&, const ShearAngle& angle, int i) {
    sum.shear_j += area * friction.shear.potential(angle.value, memory_.shear.data() + m * i);
  });
}

double Cloth::settle(const Field& x) {
  if (!laws_.friction) return 0;
  const ClothFriction& friction = *laws_.friction;
  double taken = 0;
  for (int d = 0; d < 2; ++d) {
    const FrictionStack& stack = friction.bending[d];
    const std::size_t m = stack.elements.size();
    visit_triples(*this, d, x, [&](const CurvatureStencil&, const NormalCurvature& k, int i) {
      taken += lines_[d].triple_width[i] * lines_[d].spacing *
               stack.settle(k.value, memory_.bending[d].data() + m * i);
    });
  }
  const double area = lines_[0].spacing * lines_[1].spacing;
  const std::size_t m = friction.shear.elements.size();
  visit_cells(*this, x, [&](const std::array<int, 4>&, const ShearAngle& angle, int i) {
    taken += area * friction.shear.settle(angle.value, memory_.shear.data() + m * i);
  });
  dissipated_j_ += taken;
  return taken;
}

}  // namespace drape::simulate
