// SPDX-License-Identifier: Apache-2.0
#include "simulate/field_loops.hpp"

#include <cmath>

#include "simulate/wide.hpp"

namespace drape::sim {

DRAPE_WIDE void axpy(const Field& x, double step, const Field& direction, Field& result) {
  const double* __restrict from = x.data();
  const double* __restrict along = direction.data();
  double* __restrict to = result.data();
  const std::size_t size = x.size();
  for (std::size_t i = 0; i < size; ++i) to[i] = from[i] + step * along[i];
}

DRAPE_WIDE void runge_kutta_stage(const RungeKuttaFields& fields, double weight, double reach) {
  const double* __restrict x = fields.start_x.data();
  const double* __restrict v = fields.start_v.data();
  const double* __restrict a = fields.stage_a.data();
  double* __restrict next_x = fields.stage_x.data();
  double* __restrict next_v = fields.stage_v.data();
  double* __restrict sum_x = fields.sum_x.data();
  double* __restrict sum_v = fields.sum_v.data();
  const std::size_t size = fields.start_x.size();
  DRAPE_INDEPENDENT
  for (std::size_t i = 0; i < size; ++i) {
    sum_x[i] += weight * next_v[i];
    sum_v[i] += weight * a[i];
    next_x[i] = x[i] + reach * next_v[i];
    next_v[i] = v[i] + reach * a[i];
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

DRAPE_WIDE void squared_speeds(const Field& v, std::vector<double>& result) {
  const std::size_t n = result.size();
  const double* __restrict u0 = v.data();
  const double* __restrict u1 = v.data() + n;
  const double* __restrict u2 = v.data() + 2 * n;
  double* __restrict to = result.data();
  for (std::size_t i = 0; i < n; ++i) to[i] = u0[i] * u0[i] + u1[i] * u1[i] + u2[i] * u2[i];
}

}  // namespace drape::sim
