// SPDX-License-Identifier: Apache-2.0
// Cost of the forces and of a step of the motion; the counter per_particle_and_force is what
// the README states. Baseline: the same sums written as the formulae of Cloth stand, one element
// after the other.
#include <benchmark/benchmark.h>

#include <cmath>

#include "core/units.hpp"
#include "simulate/dynamics/motion.hpp"

namespace {

using drape::simulate::Cloth;
using drape::simulate::ClothModel;
using drape::simulate::Field;
using Eigen::Vector3d;

drape::simulate::ClothLaws laws() {
  drape::simulate::ClothLaws laws;
  laws.density_kg_per_m2 = 0.138;
  for (int d = 0; d < 2; ++d) {
    laws.tensile[d] = {1500, {{0.01, 800}, {0.02, 1200}, {0.03, 1500}, {0.04, 2000}}};
    laws.bending[d] = {9e-6, {}};
  }
  laws.shear = {45, {{0.05, -8}, {0.1, 4}, {0.15, 6}, {0.2, 10}}};
  laws.twist_n_m = 1.2e-5;
  laws.stretch_damping_s = 1e-5;
  return laws;
}

Cloth cloth(int side, ClothModel model) {
  return {{side, side, {0.2, 0.2}}, laws(), drape::simulate::MassRule::area, model};
}

/// A sheet with waves, so that every element bends, stretches and shears.
Field waves(const Cloth& cloth) {
  Field x(3 * static_cast<std::size_t>(cloth.count()));
  for (int i = 0; i < cloth.count(); ++i) {
    const int row = i / cloth.grid().cols, col = i % cloth.grid().cols;
    const double u = cloth.grid().warp_spacing_m() * row;
    const double v = cloth.grid().weft_spacing_m() * col;
    x[i] = v + 0.002 * std::sin(40 * u);
    x[cloth.count() + i] = u + 0.001 * std::cos(30 * v);
    x[2 * cloth.count() + i] = 0.01 * std::sin(35 * u + 20 * v);
  }
  return x;
}

void count_forces(benchmark::State& state, int particles, int forces) {
  state.counters["per_particle_and_force"] =
      benchmark::Counter(1.0 * particles * forces, benchmark::Counter::kIsIterationInvariantRate |
                                                       benchmark::Counter::kInvert);
}

void forces(benchmark::State& state, ClothModel model) {
  Cloth sheet = cloth(static_cast<int>(state.range(0)), model);
  const Field x = waves(sheet);
  const Field v(x.size(), 0.01);
  Field f(x.size(), 0.0);
  for (auto _ : state) {
    sheet.add_forces(x, &v, f);
    benchmark::DoNotOptimize(f.data());
  }
  count_forces(state, sheet.count(), 1);
}

void scalar_line(const Cloth& sheet, int d, const Field& x, const Field& v, Field& f) {
  const Cloth::Line& line = sheet.line(d);
  for (int i = 0; i + line.stride < sheet.count(); ++i) {
    if (line.width[i] == 0) continue;
    const Vector3d displacement = at(x, i + line.stride) - at(x, i);
    const double length = displacement.norm();
    const double rate = displacement.dot(at(v, i + line.stride) - at(v, i)) / length / line.spacing;
    const double tension = sheet.laws().tensile[d].value(length / line.spacing - 1) +
                           sheet.laws().stretch_damping_s * sheet.laws().tensile[d].slope * rate;
    const Vector3d pull = line.width[i] * tension / length * displacement;
    add_at(f, i, pull);
    add_at(f, i + line.stride, -pull);
  }
  for (int i = line.stride; i + line.stride < sheet.count(); ++i) {
    if (line.triple_width[i] == 0) continue;
    const Vector3d bend = at(x, i - line.stride) - 2 * at(x, i) + at(x, i + line.stride);
    const double curvature = bend.norm() / (line.spacing * line.spacing);
    if (curvature == 0) continue;
    const Vector3d pull = line.triple_width[i] * sheet.laws().bending[d].value(curvature) /
                          curvature / std::pow(line.spacing, 3) * bend;
    add_at(f, i, 2 * pull);
    add_at(f, i - line.stride, -pull);
    add_at(f, i + line.stride, -pull);
  }
}

void scalar_cell(const Cloth& sheet, int i, const Field& x, Field& f) {
  const int cols = sheet.grid().cols;
  const double area = sheet.line(0).spacing * sheet.line(1).spacing;
  const Vector3d x00 = at(x, i), x01 = at(x, i + 1), x10 = at(x, i + cols),
                 x11 = at(x, i + cols + 1);
  const Vector3d a = x10 - x00 + x11 - x01, b = x01 - x00 + x11 - x10;
  const double sine = a.dot(b) / (a.norm() * b.norm());
  const double gain = area * sheet.laws().shear.odd_value(std::asin(sine)) /
                      std::sqrt(1 - sine * sine) / (a.norm() * b.norm());
  const Vector3d da = gain * (b - a.dot(b) / a.squaredNorm() * a);
  const Vector3d db = gain * (a - a.dot(b) / b.squaredNorm() * b);
  const Vector3d twist = sheet.laws().twist_n_m / area * (x00 - x01 - x10 + x11);
  add_at(f, i, da + db - twist);
  add_at(f, i + cols + 1, -da - db - twist);
  add_at(f, i + cols, db - da + twist);
  add_at(f, i + 1, da - db + twist);
}

void scalar_forces(benchmark::State& state) {
  const Cloth sheet = cloth(static_cast<int>(state.range(0)), ClothModel::consistent);
  const Field x = waves(sheet);
  const Field v(x.size(), 0.01);
  Field f(x.size(), 0.0);
  for (auto _ : state) {
    for (int d = 0; d < 2; ++d) scalar_line(sheet, d, x, v, f);
    for (int i = 0; i < sheet.count(); ++i) {
      if (sheet.has_cell(i)) scalar_cell(sheet, i, x, f);
    }
    benchmark::DoNotOptimize(f.data());
  }
  count_forces(state, sheet.count(), 1);
}

void steps(benchmark::State& state, ClothModel model) {
  Cloth sheet = cloth(static_cast<int>(state.range(0)), model);
  drape::simulate::Surroundings objects;
  drape::simulate::MotionOptions options;
  options.damping_per_s = 4;
  options.air_drag_kg_per_m3 = 0.6;
  drape::simulate::Motion motion(sheet, objects, options);
  motion.position = waves(sheet);
  const double step_s = motion.stable_step_s(0.5);
  for (auto _ : state) motion.step(step_s);
  count_forces(state, sheet.count(), 4);
}

BENCHMARK(scalar_forces)->Name("forces/scalar_baseline")->Arg(31);
BENCHMARK_CAPTURE(forces, consistent, ClothModel::consistent)->Arg(21)->Arg(31)->Arg(101);
BENCHMARK_CAPTURE(forces, paper, ClothModel::paper)->Arg(31);
BENCHMARK_CAPTURE(steps, consistent, ClothModel::consistent)->Arg(31);
BENCHMARK_CAPTURE(steps, paper, ClothModel::paper)->Arg(31);

}  // namespace
