// SPDX-License-Identifier: Apache-2.0
#include "simulate/mesh/cusick.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>

#include "simulate/mesh/mesh_cloth.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFirstWave = 2e-4;  // m
constexpr int kWaves = 16;
constexpr double kFinerAtTheClamp = 3;  // factor on the density of the mesh
constexpr double kWidening = 1.1;       // growth of spacing from ring to ring
constexpr double kPassingResidual = 1;  // in mean weights of a point, at the end of each load
constexpr double kOnDisc = 1e-6;        // relative to the disc's radius
constexpr double kLaidPieces = 6;  // least number of spacings across the free ring to resolve folds
constexpr int kAround = 16;        // points used to transfer a shape

/// Element of a fixed pseudo-random sequence in 0 .. 1.
double lot(unsigned seed, int k) {
  const double x = std::sin(12.9898 * k + 78.233 * seed) * 43758.5453;
  return x - std::floor(x);
}

/// Concentric rings of points from the clamp outwards. Cloth that leaves the clamp along a curve
/// must shear within a few millimetres, (B r^2 / G)^(1/4), so the mesh is fine at the clamp and
/// coarsens outwards. A rim three times finer still raises the drape coefficient by 2 points.
std::vector<Polygon> rings(double clamp, double hem, double spacing, double turn) {
  std::vector<Polygon> found;
  const auto pieces = [](double radius, double side) {
    return static_cast<int>(std::lround(2 * std::numbers::pi * radius / side));
  };
  double radius = clamp, side = spacing / kFinerAtTheClamp;
  while (side < spacing && radius <= hem - spacing) {
    found.push_back(circle({0, 0}, radius, pieces(radius, side), turn + radius / side));
    radius += side * std::sqrt(3.0) / 2;
    side *= kWidening;
  }
  return found;
}

/// A specimen on one mesh, with the unknowns that the discs hold.
class Specimen {
 public:
  Specimen(const ClothLaws& laws, const CusickOptions& options, double spacing)
      : disc_(options.disc_m / 2),
        hem_(options.specimen_m / 2),
        spacing_m_(spacing),
        options_(options),
        cloth(mesh_of_specimen(spacing), laws),
        held(held_unknowns()),
        state(cloth.state_of(lies)),
        stiffness_(cloth, held) {}

  /// Adds random waves, largest at the hem.
  void wave() {
    for (int i = 0; i < cloth.points(); ++i) {
      const Vector2d p = cloth.mesh().points_m[i];
      if (held[i]) continue;
      const double out = (p.norm() - disc_) / (hem_ - disc_), angle = std::atan2(p.y(), p.x());
      double height = 0;
      for (int k = 2; k <= kWaves; ++k)
        height += std::cos(k * angle - 2 * std::numbers::pi * lot(options_.start, k));
      state[i].z() += kFirstWave * out * out * height / std::sqrt(kWaves - 1.0);
    }
  }
  /// Lowers the table from the height of the discs until it no longer touches the cloth.
  void lower() {
    if (cloth.laws().friction) return move();
    for (int k = 1; k < options_.lowering_steps; ++k)
      pass(1, -(hem_ - disc_) * k / options_.lowering_steps);
  }
  /// Brings the cloth near rest under a fraction of gravity.
  void pass(double gravity, double table_z_m = -std::numeric_limits<double>::infinity()) {
    DescentOptions passing = options_.descent;
    passing.gravity_m_per_s2 *= gravity;
    passing.residual = std::max(passing.residual, kPassingResidual);
    hurried_loads += go_down(passing, table_z_m).at_rest ? 0 : 1;
  }
  DescentReport rest() {
    DescentReport report = go_down(options_.descent, -std::numeric_limits<double>::infinity());
    report.steps = steps;
    return report;
  }
  /// Transfers shape and friction forces from another mesh of the same specimen.
  void take_over(const Specimen& other) {
    const State flat_state = state;
    state = cloth.state_of([&](const Vector2d& p) { return other.shape_at(p); });
    for (std::size_t i = 0; i < state.size(); ++i)
      if (held[i]) state[i] = flat_state[i];
    cloth.take_over(other.cloth, other.state, state);
    steps = other.steps;
    hurried_loads = other.hurried_loads;
    moved_s = other.moved_s;
  }

 private:
  using State = MeshCloth::State;
  double disc_, hem_, spacing_m_;
  const CusickOptions& options_;

 public:
  MeshCloth cloth;
  std::vector<bool> held;
  State state;
  int steps = 0, hurried_loads = 0;
  double moved_s = 0;

 private:
  MeshStiffness stiffness_;

  /// Flat position: warp along x, weft along y, seen from above with z up.
  static MeshCloth::Jet lies(const Vector2d& p) {
    return {{p.x(), p.y(), 0}, {1, 0, 0}, {0, 1, 0}};
  }
  [[nodiscard]] MaterialMesh mesh_of_specimen(double spacing) const {
    // The mesh lattice is rotated against the warp, and both circles by a random angle.
    const double turn = 2 * std::numbers::pi * lot(options_.start, 0);
    const auto count = static_cast<int>(std::lround(2 * std::numbers::pi * hem_ / spacing));
    const ClothOutline outline{
        circle({0, 0}, hem_, count, turn), {}, rings(disc_, hem_, spacing, 2 * turn)};
    MeshOptions mesh_options;
    mesh_options.spacing_m = spacing;
    mesh_options.lattice_turn_rad = -options_.warp_rad;
    mesh_options.seed = options_.start;
    return triangulated(outline, mesh_options);
  }
  [[nodiscard]] std::vector<bool> held_unknowns() const {
    const auto clamped = [&](int point) {
      return cloth.mesh().points_m[point].norm() <= disc_ * (1 + kOnDisc);
    };
    std::vector<bool> all;
    all.reserve(static_cast<std::size_t>(cloth.unknowns()));
    for (int i = 0; i < cloth.points(); ++i) all.push_back(clamped(i));
    for (const auto& edge : cloth.mesh().edges)
      all.push_back(clamped(edge.from) && clamped(edge.to));
    return all;
  }
  /// Lowers the table in time until the cloth is quiet. On an elastic table a bent sheet has waves
  /// of length 2 pi (B / k)^(1/4), and friction would preserve them. The table is therefore stiff
  /// enough to limit them to two spacings, the shortest waves of the mesh.
  void move() {
    double bending = 0;
    for (int d = 0; d < 2; ++d)
      bending = std::max(
          bending, cloth.laws().bending[d].slope + cloth.laws().friction->bending[d].stiffness());
    const Drapemeter bodies{.wall_radius_m = disc_ * (1 - kOnDisc),
                            .table_n_per_m3 = bending * std::pow(std::numbers::pi / spacing_m_, 4)};
    const auto table_z_m = [&](double time_s) {
      return time_s < options_.lowering_s ? -(hem_ - disc_) * time_s / options_.lowering_s
                                          : -std::numeric_limits<double>::infinity();
    };
    const TimeStepsReport report =
        move_in_time(cloth, state, held, stiffness_, bodies, table_z_m, options_.lowering_s,
                     options_.descent, options_.motion);
    steps += report.steps;
    moved_s = report.time_s;
    hurried_loads += report.hurried + (report.quiet ? 0 : 1);
  }
  DescentReport go_down(const DescentOptions& options, double table_z_m) {
    const Drapemeter bodies{disc_ * (1 - kOnDisc), table_z_m};
    const DescentReport report = descend(cloth, state, held, stiffness_, bodies, options);
    steps += report.steps;
    return report;
  }
  /// Fits a quadratic to nearby points by least squares, with weights that vanish at the farthest.
  [[nodiscard]] MeshCloth::Jet shape_at(const Vector2d& p) const {
    const auto& points = cloth.mesh().points_m;
    std::vector<std::pair<double, int>> near;
    near.reserve(points.size());
    for (int i = 0; i < cloth.points(); ++i) near.emplace_back((points[i] - p).squaredNorm(), i);
    std::partial_sort(near.begin(), near.begin() + kAround, near.end());
    const double reach2 = near[kAround - 1].first, reach = std::sqrt(reach2);
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 3> right = Eigen::Matrix<double, 6, 3>::Zero();
    for (int k = 0; k + 1 < kAround; ++k) {
      const auto [away2, i] = near[k];
      const Vector2d d = (points[i] - p) / reach;
      const double weight = std::pow(1 - away2 / reach2, 2);
      Eigen::Matrix<double, 6, 1> terms;
      terms << 1, d.x(), d.y(), d.x() * d.x(), d.x() * d.y(), d.y() * d.y();
      normal += weight * terms * terms.transpose();
      right += weight * terms * state[i].transpose();
    }
    const Eigen::Matrix<double, 6, 3> fit = normal.ldlt().solve(right);
    return {fit.row(0).transpose(), fit.row(1).transpose() / reach, fit.row(2).transpose() / reach};
  }
};

}  // namespace

CusickDrape cusick_drape(const ClothLaws& laws, const CusickOptions& options) {
  if (!(options.laid_coarser >= 1))
    throw usage_error("a specimen is laid on a mesh that is no finer than its own",
                      "give 1 or more");
  const double disc = options.disc_m / 2, ring = options.specimen_m / 2 - disc;
  if (!(disc > options.spacing_m && ring > options.spacing_m))
    throw usage_error("the disc, the ring of cloth or the mesh's spacing do not fit",
                      "give a disc smaller than the specimen and a finer mesh");
  const double laid = options.spacing_m * options.laid_coarser;
  std::optional<Specimen> coarse;
  Specimen specimen(laws, options, options.spacing_m);
  if (options.laid_coarser > 1 && ring >= kLaidPieces * laid * (1 - kOnDisc)) {
    coarse.emplace(laws, options, laid);
    coarse->wave();
    coarse->lower();
    coarse->pass(1);
    specimen.take_over(*coarse);
  } else {
    specimen.wave();
    specimen.lower();
  }
  for (int k = 0; k < 2 * options.shakes; ++k)
    specimen.pass(k % 2 == 0 ? 1 + options.shake : 1 - options.shake);
  CusickDrape drape;
  drape.report = specimen.rest();
  drape.mesh = specimen.cloth.mesh();
  drape.state = std::move(specimen.state);
  drape.memory = specimen.cloth.memory();
  drape.hurried_loads = specimen.hurried_loads;
  drape.moved_s = specimen.moved_s;
  return drape;
}

std::string ply_text(const CusickDrape& drape) {
  const MeshCloth::State points(drape.state.begin(),
                                drape.state.begin() + std::ssize(drape.mesh.points_m));
  return ply_text("millimetres, z up, warp along x", points, {}, drape.mesh.triangles);
}

}  // namespace drape::simulate
