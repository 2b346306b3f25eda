// SPDX-License-Identifier: Apache-2.0
// The inner loops. They run over all particles without branches: springs, triples and cells that
// do not exist have width 0. First pass: one vector per element; second pass: sum at the
// particles. Both vectorise, and every sum has a fixed order.
#include "simulate/cloth.hpp"

// No two arrays of these loops overlap, and the compiler cannot prove it.
#if defined(__GNUC__) && !defined(__clang__)
#define DRAPE_INDEPENDENT _Pragma("GCC ivdep")
#else
#define DRAPE_INDEPENDENT
#endif

// The loops are built twice and the processor chooses. The wider form computes each element with
// the same operations (AVX2 has no fused multiply-add of its own), so the bytes do not change.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define DRAPE_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define DRAPE_WIDE
#endif

namespace drape::sim {
namespace {

/// asin(s) = 2 asin(s / sqrt(2 (1 + cos))); the Taylor series of the half angle is exact to
/// 1e-11 up to 60 degrees and, unlike std::asin, vectorises.
inline double fast_asin(double sine, double cosine) {
  const double h = sine / std::sqrt(2 * (1 + cosine));
  const double q = h * h;
  double sum = 0;
  sum = (sum + 1.0) * q * (29.0 * 29.0 / (30.0 * 31.0));
  sum = (sum + 1.0) * q * (27.0 * 27.0 / (28.0 * 29.0));
  sum = (sum + 1.0) * q * (25.0 * 25.0 / (26.0 * 27.0));
  sum = (sum + 1.0) * q * (23.0 * 23.0 / (24.0 * 25.0));
  sum = (sum + 1.0) * q * (21.0 * 21.0 / (22.0 * 23.0));
  sum = (sum + 1.0) * q * (19.0 * 19.0 / (20.0 * 21.0));
  sum = (sum + 1.0) * q * (17.0 * 17.0 / (18.0 * 19.0));
  sum = (sum + 1.0) * q * (15.0 * 15.0 / (16.0 * 17.0));
  sum = (sum + 1.0) * q * (13.0 * 13.0 / (14.0 * 15.0));
  sum = (sum + 1.0) * q * (11.0 * 11.0 / (12.0 * 13.0));
  sum = (sum + 1.0) * q * (9.0 * 9.0 / (10.0 * 11.0));
  sum = (sum + 1.0) * q * (7.0 * 7.0 / (8.0 * 9.0));
  sum = (sum + 1.0) * q * (5.0 * 5.0 / (6.0 * 7.0));
  sum = (sum + 1.0) * q * (3.0 * 3.0 / (4.0 * 5.0));
  sum = (sum + 1.0) * q * (1.0 / (2.0 * 3.0));
  return 2 * h * (1 + sum);
}

}  // namespace

void Cloth::add_forces(const Field& position, const Field* velocity, Field& force) {
  for (int d = 0; d < 2; ++d) {
    add_stretch(lines_[d], laws_.tensile[d], position, velocity, force);
    add_bending(lines_[d], laws_.bending[d], position, force);
  }
  if (model_ == ClothModel::paper) {
    add_paper_springs(position, force);
    return;
  }
  add_shear(position, force);
  add_twist(position, force);
}

DRAPE_WIDE void Cloth::add_stretch(const Line& line, const ForceCurve& law, const Field& position,
                                   const Field* velocity, Field& force) {
  const double* __restrict x = position.data();
  const double* __restrict y = position.data() + count();
  const double* __restrict z = position.data() + 2 * static_cast<std::ptrdiff_t>(count());
  const int m = count() - line.stride;
  const int s = line.stride;
  const double per_rest = 1 / line.spacing;
  const double* __restrict width = line.width.data();
  double* __restrict tension = scratch_b_.data();
  double* __restrict strain = scratch_b_.data() + count();
  double* __restrict inverse = scratch_b_.data() + 2 * count();
  DRAPE_INDEPENDENT
  for (int i = 0; i < m; ++i) {
    const double dx = x[i + s] - x[i], dy = y[i + s] - y[i], dz = z[i + s] - z[i];
    const double length = std::sqrt(dx * dx + dy * dy + dz * dz);
    inverse[i] = 1 / length;
    strain[i] = length * per_rest - 1;
    tension[i] = law.slope * strain[i];
  }
  for (const ForceCurve::Hinge hinge : law.hinges) {
    for (int i = 0; i < m; ++i) tension[i] += hinge.change * std::max(0.0, strain[i] - hinge.at);
  }
  if (velocity != nullptr && laws_.stretch_damping_s > 0) {
    const double* __restrict u = velocity->data();
    const double* __restrict v = velocity->data() + count();
    const double* __restrict w = velocity->data() + 2 * static_cast<std::ptrdiff_t>(count());
    const double damping = laws_.stretch_damping_s * law.slope * per_rest;
    DRAPE_INDEPENDENT
    for (int i = 0; i < m; ++i) {
      const double rate = (u[i + s] - u[i]) * (x[i + s] - x[i]) +
                          (v[i + s] - v[i]) * (y[i + s] - y[i]) +
                          (w[i + s] - w[i]) * (z[i + s] - z[i]);
      tension[i] += damping * rate * inverse[i];
    }
  }
  for (int i = 0; i < m; ++i) tension[i] *= width[i] * inverse[i];
  for (int axis = 0; axis < 3; ++axis) {
    const double* __restrict p = position.data() + static_cast<std::ptrdiff_t>(axis) * count();
    double* __restrict f = force.data() + static_cast<std::ptrdiff_t>(axis) * count();
    double* __restrict pull = scratch_a_.data();
    for (int i = 0; i < m; ++i) pull[i] = tension[i] * (p[i + s] - p[i]);
    for (int i = 0; i < m; ++i) f[i] += pull[i];
    for (int i = 0; i < m; ++i) f[i + s] -= pull[i];
  }
}

DRAPE_WIDE void Cloth::add_bending(const Line& line, const ForceCurve& law, const Field& position,
                                   Field& force) {
  const int s = line.stride;
  const int n = count();
  const double per_area = 1 / (line.spacing * line.spacing);
  const double scale = per_area / line.spacing;
  const double* __restrict width = line.triple_width.data();
  double* __restrict secant = scratch_b_.data();
  for (int i = s; i < n - s; ++i) secant[i] = law.slope * scale * width[i];
  if (!law.hinges.empty()) {
    const double* __restrict x = position.data();
    const double* __restrict y = position.data() + count();
    const double* __restrict z = position.data() + 2 * static_cast<std::ptrdiff_t>(count());
    double* __restrict curvature = scratch_b_.data() + n;
    for (int i = s; i < n - s; ++i) {
      const double dx = x[i - s] - 2 * x[i] + x[i + s];
      const double dy = y[i - s] - 2 * y[i] + y[i + s];
      const double dz = z[i - s] - 2 * z[i] + z[i + s];
      curvature[i] = std::sqrt(dx * dx + dy * dy + dz * dz) * per_area;
    }
    for (const ForceCurve::Hinge hinge : law.hinges) {
      for (int i = s; i < n - s; ++i) {
        // Beyond the knot the secant changes by change * (1 - at / curvature).
        const double over = std::max(0.0, curvature[i] - hinge.at);
        secant[i] += scale * width[i] * hinge.change * over / std::max(curvature[i], hinge.at);
      }
    }
  }
  double* __restrict pull = scratch_a_.data();
  for (int axis = 0; axis < 3; ++axis) {
    const double* __restrict p = position.data() + static_cast<std::ptrdiff_t>(axis) * n;
    double* __restrict f = force.data() + static_cast<std::ptrdiff_t>(axis) * n;
    for (int i = s; i < n - s; ++i) pull[i] = secant[i] * (p[i - s] - 2 * p[i] + p[i + s]);
    for (int i = s; i < n - s; ++i) f[i] += 2 * pull[i];
    for (int i = s; i < n - s; ++i) f[i - s] -= pull[i];
    for (int i = s; i < n - s; ++i) f[i + s] -= pull[i];
  }
}

DRAPE_WIDE void Cloth::add_shear(const Field& position, Field& force) {
  const double* __restrict x = position.data();
  const double* __restrict y = position.data() + count();
  const double* __restrict z = position.data() + 2 * static_cast<std::ptrdiff_t>(count());
  const int n = count();
  const int s = grid_.cols;
  const int m = n - s - 1;
  const double area = lines_[0].spacing * lines_[1].spacing;
  const double* __restrict cell = cell_.data();
  double* __restrict sine = scratch_a_.data();
  double* __restrict angle = scratch_a_.data() + n;
  double* __restrict gain = scratch_a_.data() + 2 * n;
  double* __restrict per_warp = scratch_b_.data();
  double* __restrict per_weft = scratch_b_.data() + n;
  DRAPE_INDEPENDENT
  for (int i = 0; i < m; ++i) {
    const double ax = x[i + s] - x[i] + x[i + s + 1] - x[i + 1];
    const double ay = y[i + s] - y[i] + y[i + s + 1] - y[i + 1];
    const double az = z[i + s] - z[i] + z[i + s + 1] - z[i + 1];
    const double bx = x[i + 1] - x[i] + x[i + s + 1] - x[i + s];
    const double by = y[i + 1] - y[i] + y[i + s + 1] - y[i + s];
    const double bz = z[i + 1] - z[i] + z[i + s + 1] - z[i + s];
    const double aa = ax * ax + ay * ay + az * az;
    const double bb = bx * bx + by * by + bz * bz;
    const double inverse = 1 / std::sqrt(aa * bb);
    const double sin_phi = (ax * bx + ay * by + az * bz) * inverse;
    // A cell folded flat upon itself has no shear angle; the floor keeps its force finite.
    const double cos_phi = std::sqrt(std::max(1e-6, 1 - sin_phi * sin_phi));
    sine[i] = sin_phi;
    angle[i] = fast_asin(sin_phi, cos_phi);
    gain[i] = cell[i] * area * inverse / cos_phi;
    per_warp[i] = sin_phi * std::sqrt(bb / aa);
    per_weft[i] = sin_phi * std::sqrt(aa / bb);
  }
  double* __restrict f_sh = scratch_b_.data() + 2 * n;
  for (int i = 0; i < m; ++i) f_sh[i] = laws_.shear.slope * angle[i];
  for (const ForceCurve::Hinge hinge : laws_.shear.hinges) {
    DRAPE_INDEPENDENT
    for (int i = 0; i < m; ++i) {
      f_sh[i] +=
          hinge.change * (std::max(0.0, angle[i] - hinge.at) - std::max(0.0, -angle[i] - hinge.at));
    }
  }
  for (int i = 0; i < m; ++i) gain[i] *= f_sh[i];
  // dE/da = gain (b - sin sqrt(bb/aa) a), dE/db = gain (a - sin sqrt(aa/bb) b).
  double* __restrict sum = sine;          // at corners 11 and, negative, 00
  double* __restrict difference = angle;  // at corners 10 and, negative, 01
  for (int axis = 0; axis < 3; ++axis) {
    const double* __restrict p = position.data() + static_cast<std::ptrdiff_t>(axis) * n;
    double* __restrict f = force.data() + static_cast<std::ptrdiff_t>(axis) * n;
    DRAPE_INDEPENDENT
    for (int i = 0; i < m; ++i) {
      const double a = p[i + s] - p[i] + p[i + s + 1] - p[i + 1];
      const double b = p[i + 1] - p[i] + p[i + s + 1] - p[i + s];
      const double da = gain[i] * (b - per_warp[i] * a);
      const double db = gain[i] * (a - per_weft[i] * b);
      sum[i] = da + db;
      difference[i] = da - db;
    }
    for (int i = 0; i < m; ++i) f[i] += sum[i];
    for (int i = 0; i < m; ++i) f[i + s + 1] -= sum[i];
    for (int i = 0; i < m; ++i) f[i + s] -= difference[i];
    for (int i = 0; i < m; ++i) f[i + 1] += difference[i];
  }
}

DRAPE_WIDE void Cloth::add_twist(const Field& position, Field& force) {
  const int n = count();
  const int s = grid_.cols;
  const int m = n - s - 1;
  const double gain = laws_.twist_n_m / (lines_[0].spacing * lines_[1].spacing);
  const double* __restrict cell = cell_.data();
  double* __restrict pull = scratch_a_.data();
  for (int axis = 0; axis < 3; ++axis) {
    const double* __restrict p = position.data() + static_cast<std::ptrdiff_t>(axis) * n;
    double* __restrict f = force.data() + static_cast<std::ptrdiff_t>(axis) * n;
    DRAPE_INDEPENDENT
    for (int i = 0; i < m; ++i) {
      pull[i] = cell[i] * gain * (p[i] - p[i + 1] - p[i + s] + p[i + s + 1]);
    }
    for (int i = 0; i < m; ++i) f[i] -= pull[i];
    for (int i = 0; i < m; ++i) f[i + 1] += pull[i];
    for (int i = 0; i < m; ++i) f[i + s] += pull[i];
    for (int i = 0; i < m; ++i) f[i + s + 1] -= pull[i];
  }
}

}  // namespace drape::sim
