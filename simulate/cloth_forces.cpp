// SPDX-License-Identifier: Apache-2.0
// The inner loops. They run over all particles without branches: springs, triples and cells that
// do not exist have width 0. First passes: one number per element (a spring's tension over its
// length, a triple's secant stiffness, a cell's shear); last pass, per axis: the sum at each
// particle. The element arrays have zeros before and after them, so that the sum needs no
// borders. All passes vectorise, and every sum has a fixed order. The passes run over a band of
// particles after the other.
#include "simulate/cloth_kernels.hpp"

namespace drape::sim {
namespace {

using kernels::kHingesAtOnce;

// Particles that go through all passes at once, so that what the passes hand on stays in the
// processor's first cache.
constexpr std::ptrdiff_t kBand = 128;

}  // namespace

void Cloth::add_forces(const Field& position, const Field* velocity, Field& force) {
  load_positions(position);
  const std::ptrdiff_t n = count();
  const auto find_lines = [&](Band band) {
    for (int d = 0; d < 2; ++d) {
      find_tensions(d, velocity, band);
      find_secants(d, band);
    }
  };
  if (model_ == ClothModel::paper) {
    find_lines({0, n});
    find_paper_springs();
    for (int axis = 0; axis < 3; ++axis) {
      pull_diagonals(axis);
      pull_triples(axis, {0, n});
      sum_at_particles(axis, {0, n}, force.data() + axis * n);
    }
    return;
  }
  // A particle's sum needs the triples one row further on.
  const auto summed_up_to = [&](std::ptrdiff_t found) {
    return found == n ? n : std::max<std::ptrdiff_t>(0, found - grid_.cols);
  };
  for (Band band{0, std::min(kBand, n)}; band.begin < n;
       band = {band.end, std::min(band.end + kBand, n)}) {
    find_lines(band);
    find_shear(band);
    for (int axis = 0; axis < 3; ++axis) {
      pull_cells(axis, band);
      pull_triples(axis, band);
      sum_at_particles(axis, {summed_up_to(band.begin), summed_up_to(band.end)},
                       force.data() + axis * n);
    }
  }
}

void Cloth::load_positions(const Field& position) {
  const std::ptrdiff_t n = count();
  for (int axis = 0; axis < 3; ++axis) {
    std::copy_n(position.data() + axis * n, n, work_.of(Work::x + axis));
  }
}

DRAPE_WIDE void Cloth::find_tensions(int direction, const Field* velocity, Band band) {
  const Line& line = lines_[direction];
  const kernels::Law law(laws_.tensile[direction]);
  const double* __restrict x = work_.of(Work::x);
  const double* __restrict y = work_.of(Work::y);
  const double* __restrict z = work_.of(Work::z);
  const std::ptrdiff_t s = line.stride;
  const std::ptrdiff_t first = band.begin;
  const std::ptrdiff_t m = std::min<std::ptrdiff_t>(band.end, count() - s);
  const double per_rest = 1 / line.spacing;
  const double* __restrict width = line.width.data();
  double* __restrict tension = work_.of(Work::tension + direction);
  double* __restrict strain = work_.of(Work::strain + direction);
  double* __restrict inverse = work_.of(Work::inverse + direction);
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = first; i < m; ++i) {
    const double dx = x[i + s] - x[i], dy = y[i + s] - y[i], dz = z[i + s] - z[i];
    const double length = std::sqrt(dx * dx + dy * dy + dz * dz);
    inverse[i] = 1 / length;
    strain[i] = length * per_rest - 1;
  }
  if (laws_.tensile[direction].hinges.empty()) {
    for (std::ptrdiff_t i = first; i < m; ++i) tension[i] = law.slope * strain[i];
  } else {
    for (std::ptrdiff_t i = first; i < m; ++i) tension[i] = law.value(strain[i]);
    for (std::size_t h = kHingesAtOnce; h < laws_.tensile[direction].hinges.size(); ++h) {
      const ForceCurve::Hinge hinge = laws_.tensile[direction].hinges[h];
      for (std::ptrdiff_t i = first; i < m; ++i)
        tension[i] += hinge.change * std::max(0.0, strain[i] - hinge.at);
    }
  }
  if (velocity == nullptr || laws_.stretch_damping_s <= 0) {
    for (std::ptrdiff_t i = first; i < m; ++i) tension[i] *= width[i] * inverse[i];
    return;
  }
  const double* __restrict u = velocity->data();
  const double* __restrict v = velocity->data() + count();
  const double* __restrict w = velocity->data() + 2 * static_cast<std::ptrdiff_t>(count());
  const double damping = laws_.stretch_damping_s * law.slope * per_rest;
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = first; i < m; ++i) {
    const double rate = (u[i + s] - u[i]) * (x[i + s] - x[i]) +
                        (v[i + s] - v[i]) * (y[i + s] - y[i]) +
                        (w[i + s] - w[i]) * (z[i + s] - z[i]);
    tension[i] = (tension[i] + damping * rate * inverse[i]) * width[i] * inverse[i];
  }
}

DRAPE_WIDE void Cloth::find_secants(int direction, Band band) {
  const ForceCurve& law = laws_.bending[direction];
  if (law.hinges.empty()) return;  // the constructor has set them
  const Line& line = lines_[direction];
  const std::ptrdiff_t s = line.stride;
  const std::ptrdiff_t first = std::max(band.begin, s);
  const std::ptrdiff_t m = std::min(band.end, count() - s);
  const double per_area = 1 / (line.spacing * line.spacing);
  const double scale = per_area / line.spacing;
  const double* __restrict width = line.triple_width.data();
  const double* __restrict x = work_.of(Work::x);
  const double* __restrict y = work_.of(Work::y);
  const double* __restrict z = work_.of(Work::z);
  double* __restrict secant = work_.of(Work::secant + direction);
  double* __restrict curvature = work_.of(Work::bend);
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = first; i < m; ++i) {
    const double dx = x[i - s] - 2 * x[i] + x[i + s];
    const double dy = y[i - s] - 2 * y[i] + y[i + s];
    const double dz = z[i - s] - 2 * z[i] + z[i + s];
    curvature[i] = std::sqrt(dx * dx + dy * dy + dz * dz) * per_area;
    secant[i] = law.slope;
  }
  for (const ForceCurve::Hinge hinge : law.hinges) {
    DRAPE_INDEPENDENT
    for (std::ptrdiff_t i = first; i < m; ++i) {
      // Beyond the knot the secant changes by change * (1 - at / curvature).
      const double over = std::max(0.0, curvature[i] - hinge.at);
      secant[i] += hinge.change * over / std::max(curvature[i], hinge.at);
    }
  }
  for (std::ptrdiff_t i = first; i < m; ++i) secant[i] *= scale * width[i];
}

/// Finds per cell, with a and b twice its mid-lines along warp and weft, the gain g and the ratios
/// of the energy's gradient: dE/da = g (b - ratio_a a), dE/db = g (a - ratio_b b).
DRAPE_WIDE void Cloth::find_shear(Band band) {
  const double* __restrict x = work_.of(Work::x);
  const double* __restrict y = work_.of(Work::y);
  const double* __restrict z = work_.of(Work::z);
  const std::ptrdiff_t s = grid_.cols;
  const std::ptrdiff_t first = band.begin;
  const std::ptrdiff_t m = std::min(band.end, count() - s - 1);
  const double area = lines_[0].spacing * lines_[1].spacing;
  const double* __restrict cell = cell_.data();
  double* __restrict sine = work_.of(Work::strain);
  double* __restrict gain = work_.of(Work::gain);
  double* __restrict ratio_a = work_.of(Work::ratio);
  double* __restrict ratio_b = work_.of(Work::ratio + 1);
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = first; i < m; ++i) {
    const double ax = x[i + s] - x[i] + x[i + s + 1] - x[i + 1];
    const double ay = y[i + s] - y[i] + y[i + s + 1] - y[i + 1];
    const double az = z[i + s] - z[i] + z[i + s + 1] - z[i + 1];
    const double bx = x[i + 1] - x[i] + x[i + s + 1] - x[i + s];
    const double by = y[i + 1] - y[i] + y[i + s + 1] - y[i + s];
    const double bz = z[i + 1] - z[i] + z[i + s + 1] - z[i + s];
    const double aa = ax * ax + ay * ay + az * az;
    const double bb = bx * bx + by * by + bz * bz;
    const double ab = ax * bx + ay * by + az * bz;
    const double both = aa * bb;
    // A cell folded flat upon itself has no shear angle; the floor keeps its force finite.
    const double across = std::sqrt(std::max(1e-6 * both, both - ab * ab));
    const double inverse = 1 / (both * across);  // one division for two reciprocals
    const double square = inverse * across;
    sine[i] = ab * std::sqrt(square);
    gain[i] = cell[i] * area * (inverse * both);
    ratio_a[i] = ab * bb * square;
    ratio_b[i] = ab * aa * square;
  }
  std::int64_t wide_angles = 0;
  for (std::ptrdiff_t i = first; i < m; ++i) wide_angles += kernels::is_wide(sine[i]) ? 1 : 0;
  double* __restrict angle = work_.of(Work::strain + 1);
  if (wide_angles == 0) {
    for (std::ptrdiff_t i = first; i < m; ++i) angle[i] = kernels::narrow_asin(sine[i]);
  } else {
    DRAPE_INDEPENDENT
    for (std::ptrdiff_t i = first; i < m; ++i) angle[i] = kernels::wide_asin(sine[i]);
  }
  if (laws_.shear.hinges.empty()) {
    for (std::ptrdiff_t i = first; i < m; ++i) gain[i] *= laws_.shear.slope * angle[i];
    return;
  }
  const kernels::Law law(laws_.shear);
  double* __restrict f_sh = work_.of(Work::inverse);
  for (std::ptrdiff_t i = first; i < m; ++i) f_sh[i] = law.odd_value(angle[i]);
  for (std::size_t h = kHingesAtOnce; h < laws_.shear.hinges.size(); ++h) {
    const ForceCurve::Hinge hinge = laws_.shear.hinges[h];
    for (std::ptrdiff_t i = first; i < m; ++i) f_sh[i] += kernels::odd_hinge(hinge, angle[i]);
  }
  for (std::ptrdiff_t i = first; i < m; ++i) gain[i] *= f_sh[i];
}

/// Forces of shear and twist on the four corners of each cell.
DRAPE_WIDE void Cloth::pull_cells(int axis, Band band) {
  const std::ptrdiff_t s = grid_.cols;
  const std::ptrdiff_t m = std::min(band.end, count() - s - 1);
  const double stiffness = laws_.twist_n_m / (lines_[0].spacing * lines_[1].spacing);
  const double* __restrict p = work_.of(Work::x + axis);
  const double* __restrict cell = cell_.data();
  const double* __restrict gain = work_.of(Work::gain);
  const double* __restrict ratio_a = work_.of(Work::ratio);
  const double* __restrict ratio_b = work_.of(Work::ratio + 1);
  double* __restrict at00 = work_.of(Work::corner + 4 * axis);
  double* __restrict at01 = work_.of(Work::corner + 4 * axis + 1);
  double* __restrict at10 = work_.of(Work::corner + 4 * axis + 2);
  double* __restrict at11 = work_.of(Work::corner + 4 * axis + 3);
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = band.begin; i < m; ++i) {
    const double diagonal = p[i + s + 1] - p[i];
    const double across = p[i + 1] - p[i + s];
    const double a = diagonal - across;
    const double b = diagonal + across;
    const double da = gain[i] * (b - ratio_a[i] * a);
    const double db = gain[i] * (a - ratio_b[i] * b);
    const double twist = cell[i] * stiffness * (p[i] - p[i + 1] - p[i + s] + p[i + s + 1]);
    at00[i] = da + db - twist;
    at11[i] = da + db + twist;
    at10[i] = da - db - twist;
    at01[i] = da - db + twist;
  }
}

/// Forces of the bending triples on their middle particles.
DRAPE_WIDE void Cloth::pull_triples(int axis, Band band) {
  const std::ptrdiff_t s = grid_.cols;
  const double* __restrict p = work_.of(Work::x + axis);
  const double* __restrict secant0 = work_.of(Work::secant);
  const double* __restrict secant1 = work_.of(Work::secant + 1);
  double* __restrict bend0 = work_.of(Work::bend + 2 * axis);
  double* __restrict bend1 = work_.of(Work::bend + 2 * axis + 1);
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = band.begin; i < band.end; ++i) {
    bend0[i] = secant0[i] * (p[i - s] - 2 * p[i] + p[i + s]);
    bend1[i] = secant1[i] * (p[i - 1] - 2 * p[i] + p[i + 1]);
  }
}

/// Adds the forces of springs, triples and cells; `result` is one axis.
DRAPE_WIDE void Cloth::sum_at_particles(int axis, Band band, double* result) {
  const std::ptrdiff_t s = grid_.cols;
  const double* __restrict p = work_.of(Work::x + axis);
  const double* __restrict t0 = work_.of(Work::tension);
  const double* __restrict t1 = work_.of(Work::tension + 1);
  const double* __restrict bend0 = work_.of(Work::bend + 2 * axis);
  const double* __restrict bend1 = work_.of(Work::bend + 2 * axis + 1);
  const double* __restrict at00 = work_.of(Work::corner + 4 * axis);
  const double* __restrict at01 = work_.of(Work::corner + 4 * axis + 1);
  const double* __restrict at10 = work_.of(Work::corner + 4 * axis + 2);
  const double* __restrict at11 = work_.of(Work::corner + 4 * axis + 3);
  double* __restrict force = result;
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = band.begin; i < band.end; ++i) {
    const double stretch = t0[i] * (p[i + s] - p[i]) - t0[i - s] * (p[i] - p[i - s]) +
                           t1[i] * (p[i + 1] - p[i]) - t1[i - 1] * (p[i] - p[i - 1]);
    const double bend =
        2 * (bend0[i] + bend1[i]) - bend0[i - s] - bend0[i + s] - bend1[i - 1] - bend1[i + 1];
    const double cells = at00[i] - at11[i - s - 1] + at01[i - 1] - at10[i - s];
    force[i] += stretch + bend + cells;
  }
}

}  // namespace drape::sim
