// SPDX-License-Identifier: Apache-2.0
// Friction elements of the grid's triples and cells.
#include "simulate/cloth/kernels.hpp"
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

struct Three {
  double x, y, z;
};
DRAPE_INLINE double dot(const Three& a, const Three& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
DRAPE_INLINE Three cross(const Three& a, const Three& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
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

/// Weights of curvature_stencil() at the triple in the middle of which particle i is, for loops
/// without branches; `of` are the positions per axis, with zeros beyond the sheet.
struct Cloth::Places {
  const double* of[3];
  const double* beside;  ///< width of the springs across the triples
  std::ptrdiff_t along, across;
  double per_area;

  [[nodiscard]] DRAPE_INLINE Three a(std::ptrdiff_t i) const {
    return {of[0][i + along] - of[0][i - along], of[1][i + along] - of[1][i - along],
            of[2][i + along] - of[2][i - along]};
  }
  [[nodiscard]] DRAPE_INLINE double b(const double* p, std::ptrdiff_t i) const {
    return (beside[i] > 0 ? p[i + across] : p[i]) - (beside[i - across] > 0 ? p[i - across] : p[i]);
  }
  [[nodiscard]] DRAPE_INLINE Three b(std::ptrdiff_t i) const {
    return {b(of[0], i), b(of[1], i), b(of[2], i)};
  }
  [[nodiscard]] DRAPE_INLINE double c(const double* p, std::ptrdiff_t i) const {
    return ((p[i + along] - p[i]) - (p[i] - p[i - along])) * per_area;
  }
  [[nodiscard]] DRAPE_INLINE Three c(std::ptrdiff_t i) const {
    return {c(of[0], i), c(of[1], i), c(of[2], i)};
  }
};

Cloth::Places Cloth::places_of(int direction) {
  const Line& line = lines_[direction];
  return {{work_.of(Work::x), work_.of(Work::x + 1), work_.of(Work::x + 2)},
          work_.of(Work::width + 1 - direction),
          line.stride,
          lines_[1 - direction].stride,
          1 / (line.spacing * line.spacing)};
}

/// normal_curvature() of all triples at the positions in `work_`: the unit normal, the inverse of
/// |a x b|, and the value.
DRAPE_WIDE void Cloth::find_normal_curvatures(int direction) {
  const Places places = places_of(direction);
  const std::ptrdiff_t m = kernels::rounded_up(count());
  double* __restrict nx = work_.of(Work::normal);
  double* __restrict ny = work_.of(Work::normal + 1);
  double* __restrict nz = work_.of(Work::normal + 2);
  double* __restrict per_size = work_.of(Work::per_size);
  double* __restrict curvature = work_.of(Work::normal_curvature);
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < m; ++i) {
    const Three a = places.a(i), b = places.b(i), c = places.c(i), n = cross(a, b);
    const double least = 1e-12 * std::sqrt(dot(a, a) * dot(b, b)) + 1e-300;
    const double inverse = 1 / std::max(std::sqrt(dot(n, n)), least);
    nx[i] = n.x * inverse;
    ny[i] = n.y * inverse;
    nz[i] = n.z * inverse;
    per_size[i] = inverse;
    curvature[i] = dot(c, n) * inverse;
  }
}

/// From the moments (in the place of the curvatures) to the energy's gradient with respect to c, a
/// and b; that to c takes the place of the normal.
DRAPE_WIDE void Cloth::find_friction_gradients(int direction) {
  const Places places = places_of(direction);
  const std::ptrdiff_t m = kernels::rounded_up(count());
  double* __restrict of_c[3];
  double* __restrict of_a[3];
  double* __restrict of_b[3];
  for (int axis = 0; axis < 3; ++axis) {
    of_c[axis] = work_.of(Work::normal + axis);
    of_a[axis] = work_.of(Work::of_a + axis);
    of_b[axis] = work_.of(Work::of_b + axis);
  }
  const double* __restrict per_size = work_.of(Work::per_size);
  const double* __restrict moment = work_.of(Work::normal_curvature);
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < m; ++i) {
    const Three a = places.a(i), b = places.b(i), c = places.c(i);
    const Three n = {of_c[0][i], of_c[1][i], of_c[2][i]};
    const double along_n = dot(c, n), scale = moment[i] * per_size[i];
    const Three g = {scale * (c.x - along_n * n.x), scale * (c.y - along_n * n.y),
                     scale * (c.z - along_n * n.z)};
    const Three by_a = cross(b, g), by_b = cross(g, a);
    of_c[0][i] = moment[i] * n.x;
    of_c[1][i] = moment[i] * n.y;
    of_c[2][i] = moment[i] * n.z;
    of_a[0][i] = by_a.x;
    of_a[1][i] = by_a.y;
    of_a[2][i] = by_a.z;
    of_b[0][i] = by_b.x;
    of_b[1][i] = by_b.y;
    of_b[2][i] = by_b.z;
  }
}

DRAPE_WIDE void Cloth::sum_friction(int direction, int axis, double* result) {
  const Places places = places_of(direction);
  const std::ptrdiff_t s = places.along, t = places.across, n = count();
  const double* __restrict beside = places.beside;
  const double* __restrict of_c = work_.of(Work::normal + axis);
  const double* __restrict of_a = work_.of(Work::of_a + axis);
  const double* __restrict of_b = work_.of(Work::of_b + axis);
  double* __restrict force = result;
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const double bent = places.per_area * ((of_c[i - s] - of_c[i]) + (of_c[i + s] - of_c[i]));
    // One-sided differences begin or end at the particle itself.
    const double ends = beside[i - t] > 0 ? of_b[i - t] : -of_b[i];
    const double begins = beside[i] > 0 ? of_b[i + t] : -of_b[i];
    force[i] -= bent + (of_a[i - s] - of_a[i + s]) + (ends - begins);
  }
}

void Cloth::add_bending_friction(Field& force) {
  const std::ptrdiff_t n = count();
  for (int d = 0; d < 2; ++d) {
    find_normal_curvatures(d);
    const FrictionStack& stack = laws_.friction->bending[d];
    const double* slip = memory_.bending[d].data();
    double* value = work_.of(Work::normal_curvature);
    for (std::ptrdiff_t i = 0; i < n; ++i, slip += stack.elements.size()) {
      const double area = lines_[d].triple_width[i] * lines_[d].spacing;
      value[i] = area == 0 ? 0 : area * stack.force(value[i], slip);
    }
    std::fill_n(value + n, kernels::rounded_up(n) - n, 0.0);
    find_friction_gradients(d);
    for (int axis = 0; axis < 3; ++axis) sum_friction(d, axis, force.data() + axis * n);
  }
}

/// Per cell, to the force of the elastic curve.
void Cloth::add_shear_friction(Band band, const double* angle, double* f_sh) const {
  const FrictionStack& stack = laws_.friction->shear;
  const double* slip = memory_.shear.data() + stack.elements.size() * band.begin;
  for (std::ptrdiff_t i = 0; i < band.end - band.begin; ++i, slip += stack.elements.size())
    if (cell_[band.begin + i] != 0) f_sh[i] += stack.force(angle[i], slip);
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
  take_positions(x);
  double taken = 0;
  for (int d = 0; d < 2; ++d) {
    find_normal_curvatures(d);
    const FrictionStack& stack = friction.bending[d];
    double* slip = memory_.bending[d].data();
    const double* curvature = work_.of(Work::normal_curvature);
    for (int i = 0; i < count(); ++i, slip += stack.elements.size()) {
      const double area = lines_[d].triple_width[i] * lines_[d].spacing;
      if (area > 0) taken += area * stack.settle(curvature[i], slip);
    }
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
