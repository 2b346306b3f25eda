// SPDX-License-Identifier: Apache-2.0
// The inner loops. They run over all particles without branches: springs, triples and cells that
// do not exist have width 0 or no cell. A band of particles after the other goes through all
// passes, so that what one pass hands to the next stays in the processor's first cache:
// - per element one number: a spring's tension over its length, a triple's secant stiffness, a
//   cell's stiffnesses between its mid-lines;
// - per axis: what the energy's gradient is along each edge of the grid (spring, shear and twist
//   all depend on the edges alone), and its difference at each particle.
// The bands' length is a multiple of the vector's, and what lies beyond the sheet is 0, so no loop
// has a rest or a border. Every sum has a fixed order.
#include <utility>

#include "simulate/cloth/kernels.hpp"

namespace drape::simulate {
namespace {

using kernels::kHingesAtOnce;
using kernels::kNoArea2;
using kernels::kNoLength2;
using kernels::kVector;
using kernels::rounded_up;

constexpr std::ptrdiff_t kBand = 240;  // particles that go through all passes at once

/// Blocks of a multiple of the first cache's 4 KiB would all compete for the same places in it.
std::ptrdiff_t block_size(std::ptrdiff_t values) {
  constexpr std::ptrdiff_t lines_per_set = 64, offset = 17;
  std::ptrdiff_t lines = (values + kVector - 1) / kVector;
  lines += (offset - lines % lines_per_set + lines_per_set) % lines_per_set;
  return lines * kVector;
}

}  // namespace

void Cloth::prepare_work() {
  const std::ptrdiff_t n = count();
  work_.pad = rounded_up(2 * grid_.cols + 2);
  work_.size = block_size(rounded_up(n) + 2 * work_.pad + kVector);
  work_.band = kBand;
  const int blocks = laws_.friction ? Work::blocks : Work::blocks_without_friction;
  work_.lines.assign(static_cast<std::size_t>(blocks * work_.size / kVector), {});
  work_.band_lines.assign(static_cast<std::size_t>(Work::band_blocks * Work::band_size / kVector),
                          {});
  for (int d = 0; d < 2; ++d) {
    std::copy_n(lines_[d].width.data(), n, work_.of(Work::width + d));
    std::copy_n(lines_[d].triple_width.data(), n, work_.of(Work::triple_width + d));
    std::copy_n(lines_[d].k_diag_part.data(), n, work_.of(Work::part + d));
    // Stiffness of a straight law; others change with the curvature.
    const double scale = laws_.bending[d].slope / std::pow(lines_[d].spacing, 3);
    for (int i = 0; i < n; ++i) work_.of(Work::secant + d)[i] = scale * lines_[d].triple_width[i];
  }
  const double twist = laws_.twist_n_m / (lines_[0].spacing * lines_[1].spacing);
  for (int i = 0; i < n; ++i) {
    work_.of(Work::cell)[i] = cell_[i];
    work_.of(Work::twist)[i] = twist * cell_[i];
  }
}

void Cloth::take_positions(const Field& position) {
  const std::ptrdiff_t n = count();
  for (int axis = 0; axis < 3; ++axis)
    std::copy_n(position.data() + axis * n, n, work_.of(Work::x + axis));
}

void Cloth::add_forces(const Field& position, const Field* velocity, Field& force) {
  const std::ptrdiff_t n = count();
  const bool damped = velocity != nullptr && laws_.stretch_damping_s > 0;
  take_positions(position);
  for (int axis = 0; axis < 3; ++axis) {
    if (damped) std::copy_n(velocity->data() + axis * n, n, work_.of(Work::v + axis));
  }
  for (int d = 0; d < 2; ++d) find_secants(d);
  for (const int block : Work::of_row_before)
    std::fill_n(work_.in_band(block) - grid_.cols, grid_.cols, 0.0);
  for (Band band{0, std::min(work_.band, n)}; band.begin < n;
       band = {band.end, std::min(band.end + work_.band, n)}) {
    find_lengths(band, damped);
    for (int d = 0; d < 2; ++d) find_tensions(d, band);
    if (model_ == ClothModel::paper) {
      find_diagonals(band);
      for (int d = 0; d < 2; ++d) take_off_lines(d, band);
    } else {
      find_shear(band);
    }
    for (int axis = 0; axis < 3; ++axis) {
      pull_cells(axis, band);
      pull_edges(axis, band);
      sum_at_particles(axis, band, force.data() + axis * n);
    }
    keep_last_row(band);
  }
  if (!clamped_.empty()) add_clamp_forces(position, force);
  if (laws_.friction) add_bending_friction(force);
}

/// Values of the row before it that the next band needs.
void Cloth::keep_last_row(Band band) {
  const std::ptrdiff_t s = grid_.cols;
  const std::ptrdiff_t length = band.end - band.begin;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int block : {Work::after, Work::weft_edge}) {
      double* values = work_.in_band(block + axis);
      values[-1] = values[length - 1];
    }
    for (const int block : {Work::cross, Work::warp_edge}) {
      double* values = work_.in_band(block + axis);
      std::copy(values + length - s, values + length, values - s);
    }
  }
  if (model_ != ClothModel::paper) return;
  double* values = work_.in_band(Work::k_diag);
  std::copy(values + length - s, values + length, values - s);
}

DRAPE_WIDE void Cloth::find_secants(int direction) {
  const ForceCurve& curve = laws_.bending[direction];
  if (curve.hinges.empty()) return;  // prepare_work() has set them
  const kernels::Law law(curve);
  const Line& line = lines_[direction];
  const std::ptrdiff_t s = line.stride;
  const std::ptrdiff_t m = rounded_up(count());
  const double per_area = 1 / (line.spacing * line.spacing);
  const double scale = per_area / line.spacing;
  const double* __restrict width = work_.of(Work::triple_width + direction);
  const double* __restrict x = work_.of(Work::x);
  const double* __restrict y = work_.of(Work::x + 1);
  const double* __restrict z = work_.of(Work::x + 2);
  double* __restrict secant = work_.of(Work::secant + direction);
  const auto curvature_at = [&](std::ptrdiff_t i) {
    const double dx = (x[i + s] - x[i]) - (x[i] - x[i - s]);
    const double dy = (y[i + s] - y[i]) - (y[i] - y[i - s]);
    const double dz = (z[i + s] - z[i]) - (z[i] - z[i - s]);
    return std::sqrt(kNoLength2 + (dx * dx + dy * dy + dz * dz)) * per_area;
  };
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < m; ++i) {
    const double curvature = curvature_at(i);
    secant[i] = scale * width[i] * (law.value(curvature) / curvature);
  }
  for (std::size_t h = kHingesAtOnce; h < curve.hinges.size(); ++h) {
    const ForceCurve::Hinge hinge = curve.hinges[h];
    DRAPE_INDEPENDENT
    for (std::ptrdiff_t i = 0; i < m; ++i) {
      const double curvature = curvature_at(i);
      const double over = std::max(0.0, curvature - hinge.at);
      secant[i] += scale * width[i] * (hinge.change * over / curvature);
    }
  }
}

/// Per spring its strain, the inverse of its length, and what damps it.
template <bool damped>
DRAPE_INLINE void Cloth::find_lengths_as(Band band) {
  const std::ptrdiff_t s = grid_.cols;
  const std::ptrdiff_t m = rounded_up(band.end - band.begin);
  const double* __restrict x = work_.of(Work::x) + band.begin;
  const double* __restrict y = work_.of(Work::x + 1) + band.begin;
  const double* __restrict z = work_.of(Work::x + 2) + band.begin;
  const double* __restrict u = work_.of(Work::v) + band.begin;
  const double* __restrict v = work_.of(Work::v + 1) + band.begin;
  const double* __restrict w = work_.of(Work::v + 2) + band.begin;
  const double per_rest0 = 1 / lines_[0].spacing, per_rest1 = 1 / lines_[1].spacing;
  const double damping0 = laws_.stretch_damping_s * laws_.tensile[0].slope * per_rest0;
  const double damping1 = laws_.stretch_damping_s * laws_.tensile[1].slope * per_rest1;
  double* __restrict band0 = work_.in_band(0);
  constexpr std::ptrdiff_t size = Work::band_size;
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < m; ++i) {
    const double dx = x[i + s] - x[i], dy = y[i + s] - y[i], dz = z[i + s] - z[i];
    const double ex = x[i + 1] - x[i], ey = y[i + 1] - y[i], ez = z[i + 1] - z[i];
    const double dd = dx * dx + dy * dy + dz * dz;
    const double ee = ex * ex + ey * ey + ez * ez;
    const double length0 = std::sqrt(kNoLength2 + dd);
    const double length1 = std::sqrt(kNoLength2 + ee);
    const double inverse = 1 / (length0 * length1);  // one division for two reciprocals
    const double inverse0 = inverse * length1, inverse1 = inverse * length0;
    band0[Work::strain * size + i] = length0 * per_rest0 - 1;
    band0[(Work::strain + 1) * size + i] = length1 * per_rest1 - 1;
    band0[Work::inverse * size + i] = inverse0;
    band0[(Work::inverse + 1) * size + i] = inverse1;
    if constexpr (damped) {
      const double rate0 = (u[i + s] - u[i]) * dx + (v[i + s] - v[i]) * dy + (w[i + s] - w[i]) * dz;
      const double rate1 = (u[i + 1] - u[i]) * ex + (v[i + 1] - v[i]) * ey + (w[i + 1] - w[i]) * ez;
      band0[Work::damping * size + i] = damping0 * rate0 * inverse0;
      band0[(Work::damping + 1) * size + i] = damping1 * rate1 * inverse1;
    } else {
      band0[Work::damping * size + i] = 0;
      band0[(Work::damping + 1) * size + i] = 0;
    }
  }
}

DRAPE_WIDE void Cloth::find_lengths(Band band, bool damped) {
  if (damped) {
    find_lengths_as<true>(band);
  } else {
    find_lengths_as<false>(band);
  }
}

/// Force of each spring over its length.
DRAPE_WIDE void Cloth::find_tensions(int direction, Band band) {
  const std::ptrdiff_t m = rounded_up(band.end - band.begin);
  const kernels::Law law(laws_.tensile[direction]);
  const double* __restrict strain = work_.in_band(Work::strain + direction);
  const double* __restrict width = work_.of(Work::width + direction) + band.begin;
  const double* __restrict inverse = work_.in_band(Work::inverse + direction);
  const double* __restrict damping = work_.in_band(Work::damping + direction);
  double* __restrict tension = work_.in_band(Work::tension + direction);
  if (laws_.tensile[direction].hinges.empty()) {
    for (std::ptrdiff_t i = 0; i < m; ++i)
      tension[i] = (law.slope * strain[i] + damping[i]) * (width[i] * inverse[i]);
    return;
  }
  for (std::ptrdiff_t i = 0; i < m; ++i)
    tension[i] = (law.value(strain[i]) + damping[i]) * (width[i] * inverse[i]);
  for (std::size_t h = kHingesAtOnce; h < laws_.tensile[direction].hinges.size(); ++h) {
    const ForceCurve::Hinge hinge = laws_.tensile[direction].hinges[h];
    for (std::ptrdiff_t i = 0; i < m; ++i)
      tension[i] += hinge.change * std::max(0.0, strain[i] - hinge.at) * (width[i] * inverse[i]);
  }
}

/// With a and b twice a cell's mid-lines along warp and weft, the gradient of its shear energy is
/// g (b - ratio_a a) by a and g (a - ratio_b b) by b; finds the stiffnesses -g ratio_a, g and
/// -g ratio_b.
DRAPE_WIDE void Cloth::find_shear(Band band) {
  const std::ptrdiff_t s = grid_.cols;
  const std::ptrdiff_t m = rounded_up(band.end - band.begin);
  const double* __restrict x = work_.of(Work::x) + band.begin;
  const double* __restrict y = work_.of(Work::x + 1) + band.begin;
  const double* __restrict z = work_.of(Work::x + 2) + band.begin;
  const double* __restrict cell = work_.of(Work::cell) + band.begin;
  const double area = lines_[0].spacing * lines_[1].spacing;
  double* __restrict tangent = work_.in_band(Work::angle);
  double* __restrict gain = work_.in_band(Work::stiff_ab);
  double* __restrict ratio_a = work_.in_band(Work::stiff_a);
  double* __restrict ratio_b = work_.in_band(Work::stiff_b);
  std::int64_t wide = 0;
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < m; ++i) {
    const double dx = x[i + s + 1] - x[i], ex = x[i + 1] - x[i + s];
    const double dy = y[i + s + 1] - y[i], ey = y[i + 1] - y[i + s];
    const double dz = z[i + s + 1] - z[i], ez = z[i + 1] - z[i + s];
    const double ax = dx - ex, ay = dy - ey, az = dz - ez;
    const double bx = dx + ex, by = dy + ey, bz = dz + ez;
    const double aa = ax * ax + ay * ay + az * az;
    const double bb = bx * bx + by * by + bz * bz;
    const double ab = ax * bx + ay * by + az * bz;
    const double both = kNoArea2 + aa * bb;
    // A cell folded flat upon itself has no shear angle; the floor keeps its force finite.
    const double across = std::sqrt(std::max(1e-6 * both, both - ab * ab));
    const double inverse = 1 / (both * across);  // one division for two reciprocals
    const double per_across = inverse * both;
    const double ratio = ab * (inverse * across);
    const double t = cell[i] * (ab * per_across);
    wide += kernels::is_wide(t) ? 1 : 0;
    tangent[i] = t;
    gain[i] = area * per_across;
    ratio_a[i] = ratio * bb;
    ratio_b[i] = ratio * aa;
  }
  const ForceCurve& curve = laws_.shear;
  const kernels::Law law(curve);
  const auto pull = [&](std::ptrdiff_t i, double f_sh) {
    const double g = gain[i] * f_sh;
    gain[i] = g;
    ratio_a[i] *= -g;
    ratio_b[i] *= -g;
  };
  if (wide == 0 && curve.hinges.size() <= kHingesAtOnce && !laws_.friction) {
    DRAPE_INDEPENDENT
    for (std::ptrdiff_t i = 0; i < m; ++i) pull(i, law.odd_value(kernels::narrow_atan(tangent[i])));
    return;
  }
  double* __restrict angle = tangent;
  double* __restrict f_sh = work_.in_band(Work::before);
  if (wide == 0) {
    for (std::ptrdiff_t i = 0; i < m; ++i) angle[i] = kernels::narrow_atan(angle[i]);
  } else {
    for (std::ptrdiff_t i = 0; i < m; ++i) angle[i] = kernels::wide_atan(angle[i]);
  }
  for (std::ptrdiff_t i = 0; i < m; ++i) f_sh[i] = law.odd_value(angle[i]);
  for (std::size_t h = kHingesAtOnce; h < curve.hinges.size(); ++h) {
    const ForceCurve::Hinge hinge = curve.hinges[h];
    for (std::ptrdiff_t i = 0; i < m; ++i) f_sh[i] += kernels::odd_hinge(hinge, angle[i]);
  }
  if (laws_.friction) add_shear_friction(band, angle, f_sh);
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < m; ++i) pull(i, f_sh[i]);
}

/// Shear and twist of the cells: what they pull along the edges of the grid. A cell's two edges
/// along the warp get `before` and `after`, both along the weft `cross`.
DRAPE_WIDE void Cloth::pull_cells(int axis, Band band) {
  const std::ptrdiff_t s = grid_.cols;
  const std::ptrdiff_t m = rounded_up(band.end - band.begin);
  const double* __restrict p = work_.of(Work::x + axis) + band.begin;
  const double* __restrict twist_stiffness = work_.of(Work::twist) + band.begin;
  const double* __restrict stiff_a = work_.in_band(Work::stiff_a);
  const double* __restrict stiff_ab = work_.in_band(Work::stiff_ab);
  const double* __restrict stiff_b = work_.in_band(Work::stiff_b);
  double* __restrict before = work_.in_band(Work::before);
  double* __restrict after = work_.in_band(Work::after + axis);
  double* __restrict cross = work_.in_band(Work::cross + axis);
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < m; ++i) {
    const double down = p[i + s] - p[i], next_down = p[i + s + 1] - p[i + 1];
    const double a = down + next_down;
    const double b = (p[i + 1] - p[i]) + (p[i + s + 1] - p[i + s]);
    const double along = stiff_a[i] * a + stiff_ab[i] * b;
    const double twist = twist_stiffness[i] * (next_down - down);
    before[i] = along - twist;
    after[i] = along + twist;
    cross[i] = stiff_ab[i] * a + stiff_b[i] * b;
  }
}

/// Adds springs and triples: per edge the energy's gradient with respect to the edge vector. An
/// edge is the second of one triple and the first of the next.
DRAPE_WIDE void Cloth::pull_edges(int axis, Band band) {
  const std::ptrdiff_t s = grid_.cols;
  const std::ptrdiff_t m = rounded_up(band.end - band.begin);
  const double* __restrict p = work_.of(Work::x + axis) + band.begin;
  const double* __restrict secant0 = work_.of(Work::secant) + band.begin;
  const double* __restrict secant1 = work_.of(Work::secant + 1) + band.begin;
  const double* __restrict tension0 = work_.in_band(Work::tension);
  const double* __restrict tension1 = work_.in_band(Work::tension + 1);
  const double* __restrict before = work_.in_band(Work::before);
  const double* __restrict after = work_.in_band(Work::after + axis);
  const double* __restrict cross = work_.in_band(Work::cross + axis);
  double* __restrict warp_edge = work_.in_band(Work::warp_edge + axis);
  double* __restrict weft_edge = work_.in_band(Work::weft_edge + axis);
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < m; ++i) {
    const double last = p[i] - p[i - s], here = p[i + s] - p[i], next = p[i + 2 * s] - p[i + s];
    warp_edge[i] = tension0[i] * here + (before[i] + after[i - 1]) +
                   (secant0[i] * (here - last) - secant0[i + s] * (next - here));
  }
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < m; ++i) {
    const double last = p[i] - p[i - 1], here = p[i + 1] - p[i], next = p[i + 2] - p[i + 1];
    weft_edge[i] = tension1[i] * here + (cross[i] + cross[i - s]) +
                   (secant1[i] * (here - last) - secant1[i + 1] * (next - here));
  }
}

/// Adds the forces of the edges; `result` is one axis.
DRAPE_WIDE void Cloth::sum_at_particles(int axis, Band band, double* result) {
  const std::ptrdiff_t s = grid_.cols;
  const std::ptrdiff_t m = band.end - band.begin;
  const double* __restrict warp_edge = work_.in_band(Work::warp_edge + axis);
  const double* __restrict weft_edge = work_.in_band(Work::weft_edge + axis);
  double* __restrict force = result + band.begin;
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < m; ++i)
    force[i] += (warp_edge[i] - warp_edge[i - s]) + (weft_edge[i] - weft_edge[i - 1]);
}

}  // namespace drape::simulate
