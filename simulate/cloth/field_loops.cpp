// SPDX-License-Identifier: Apache-2.0
#include "simulate/cloth/field_loops.hpp"

#include <algorithm>
#include <cmath>

#include "simulate/fabric/wide.hpp"

namespace drape::simulate {

DRAPE_WIDE void axpy(const Field& x, double step, const Field& direction, Field& result) {
  const double* __restrict from = x.data();
  const double* __restrict along = direction.data();
  double* __restrict to = result.data();
  const std::size_t size = x.size();
  for (std::size_t i = 0; i < size; ++i) to[i] = from[i] + step * along[i];
}

DRAPE_WIDE void runge_kutta_stage(const RungeKuttaFields& fields, double reach) {
  const double* __restrict x = fields.start_x.data();
  const double* __restrict v = fields.start_v.data();
  const double* __restrict a = fields.stage_a.data();
  double* __restrict next_x = fields.stage_x.data();
  double* __restrict next_v = fields.stage_v.data();
  const std::size_t size = fields.start_x.size();
  DRAPE_INDEPENDENT
  for (std::size_t i = 0; i < size; ++i) {
    next_x[i] = x[i] + reach * next_v[i];
    next_v[i] = v[i] + reach * a[i];
  }
}

DRAPE_WIDE void runge_kutta_end(const Field& start_x, const Field& start_v,
                                const std::array<Field, 4>& a, double step, Field& x, Field& v) {
  const double* __restrict x0 = start_x.data();
  const double* __restrict v0 = start_v.data();
  const double* __restrict a1 = a[0].data();
  const double* __restrict a2 = a[1].data();
  const double* __restrict a3 = a[2].data();
  const double* __restrict a4 = a[3].data();
  double* __restrict to_x = x.data();
  double* __restrict to_v = v.data();
  const double sixth = step / 6;
  const std::size_t size = start_x.size();
  DRAPE_INDEPENDENT
  for (std::size_t i = 0; i < size; ++i) {
    const double inner = a2[i] + a3[i];
    to_x[i] = x0[i] + step * (v0[i] + sixth * (a1[i] + inner));
    to_v[i] = v0[i] + sixth * (a1[i] + 2 * inner + a4[i]);
  }
}

DRAPE_WIDE void forces_to_accelerations(const OuterForces& outer,
                                        const std::vector<double>& area_m2,
                                        const std::vector<double>& inverse_mass, const Field& v,
                                        Field& a) {
  const std::size_t n = inverse_mass.size();
  const double* __restrict u0 = v.data();
  const double* __restrict u1 = v.data() + n;
  const double* __restrict u2 = v.data() + 2 * n;
  const double* __restrict area = area_m2.data();
  const double* __restrict inverse = inverse_mass.data();
  double* __restrict a0 = a.data();
  double* __restrict a1 = a.data() + n;
  double* __restrict a2 = a.data() + 2 * n;
  const double g0 = outer.gravity_m_per_s2.x(), g1 = outer.gravity_m_per_s2.y(),
               g2 = outer.gravity_m_per_s2.z();
  const double beta = outer.damping_per_s;
  const double air = outer.air_drag_kg_per_m3;
  DRAPE_INDEPENDENT
  for (std::size_t i = 0; i < n; ++i) {
    const double speed = std::sqrt(u0[i] * u0[i] + u1[i] * u1[i] + u2[i] * u2[i]);
    const double drag = beta + air * area[i] * inverse[i] * speed;
    a0[i] = a0[i] * inverse[i] + g0 - drag * u0[i];
    a1[i] = a1[i] * inverse[i] + g1 - drag * u1[i];
    a2[i] = a2[i] * inverse[i] + g2 - drag * u2[i];
  }
}

DRAPE_WIDE Speeds sum_speeds(const OuterForces& outer, const std::vector<double>& area_m2,
                             const std::vector<double>& mass_kg, const Field& v, double step,
                             std::vector<double>& paths_m) {
  constexpr std::size_t kLanes = 4;  // sums of their own, so that their order is no chain
  const std::size_t n = mass_kg.size();
  const double* __restrict u0 = v.data();
  const double* __restrict u1 = v.data() + n;
  const double* __restrict u2 = v.data() + 2 * n;
  const double* __restrict mass = mass_kg.data();
  const double* __restrict area = area_m2.data();
  double* __restrict path = paths_m.data();
  const double beta = outer.damping_per_s;
  const double air = outer.air_drag_kg_per_m3;
  double twice_kinetic[kLanes] = {}, power[kLanes] = {}, fastest2[kLanes] = {};
  const auto add = [&](std::size_t i, std::size_t lane) {
    const double v2 = u0[i] * u0[i] + u1[i] * u1[i] + u2[i] * u2[i];
    const double speed = std::sqrt(v2);
    path[i] += speed * step;
    twice_kinetic[lane] += mass[i] * v2;
    power[lane] += (beta * mass[i] + air * area[i] * speed) * v2;
    fastest2[lane] = std::max(fastest2[lane], v2);
  };
  const std::size_t whole = n / kLanes * kLanes;
  for (std::size_t i = 0; i < whole; i += kLanes) {
    DRAPE_INDEPENDENT
    for (std::size_t lane = 0; lane < kLanes; ++lane) add(i + lane, lane);
  }
  for (std::size_t i = whole; i < n; ++i) add(i, i - whole);
  return {0.5 * ((twice_kinetic[0] + twice_kinetic[1]) + (twice_kinetic[2] + twice_kinetic[3])),
          (power[0] + power[1]) + (power[2] + power[3]),
          std::max(std::max(fastest2[0], fastest2[1]), std::max(fastest2[2], fastest2[3]))};
}

}  // namespace drape::simulate
