// SPDX-License-Identifier: Apache-2.0
#include "simulate/mesh/relaxation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kBoundsEvery = 100;    // steps between two sets of fictitious masses
constexpr int kReportEvery = 100;    // steps between two looks at the residual
constexpr double kFirstWave = 2e-4;  // m
constexpr int kWaves = 16;
constexpr double kFinerAtTheClamp = 3;     // times than the mesh's spacing
constexpr double kWidening = 1.1;          // of one ring's spacing to the next
constexpr double kPassingResidual = 1e-2;  // mean weights of a point; where loads turn

double height_energy(const MeshCloth& cloth, const MeshCloth::State& state, const Vector3d& g) {
  double sum = 0;
  for (int i = 0; i < cloth.points(); ++i) sum -= cloth.mass_kg()[i] * g.dot(state[i]);
  return sum;
}

/// Number in 0 .. 1 of a fixed sequence.
double lot(unsigned seed, int k) {
  const double x = std::sin(12.9898 * k + 78.233 * seed) * 43758.5453;
  return x - std::floor(x);
}

/// Circles of points from a clamp outwards: cloth that leaves it along a curve must shear within a
/// few millimetres, (B r^2 / G)^(1/4), so the mesh begins fine there and widens. A rim three times
/// finer again still raises the drape coefficient by 2 points.
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

}  // namespace

RelaxationReport relax(MeshCloth& cloth, MeshCloth::State& state, const std::vector<bool>& held,
                       const Contact& contact, const RelaxationOptions& options) {
  const auto n = static_cast<std::size_t>(cloth.unknowns());
  const int points = cloth.points();
  MeshCloth::State force(n), velocity(n, Vector3d::Zero()), normal(n, Vector3d::Zero());
  std::vector<double> mass;
  const double weight = options.gravity_m_per_s2.norm() *
                        std::accumulate(cloth.mass_kg().begin(), cloth.mass_kg().end(), 0.0) /
                        points;
  RelaxationReport report;
  double before = 0;
  for (int step = 0; step < options.most_steps; ++step) {
    if (step % kBoundsEvery == 0) {
      mass = cloth.stiffness_bounds(state);
      for (double& m : mass) m *= options.masses;
    }
    std::fill(force.begin(), force.end(), Vector3d::Zero());
    cloth.add_forces(state, force);
    for (int i = 0; i < points; ++i) force[i] += cloth.mass_kg()[i] * options.gravity_m_per_s2;
    double kinetic = 0, largest = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (held[i]) continue;
      Vector3d f = force[i];
      const double push = -f.dot(normal[i]);
      if (push > 0) f -= f.dot(normal[i]) * normal[i];
      // From the velocity and not by stopping points, which would end all motion with each stop.
      if (contact.friction > 0 && push > 0) {
        const double bears = contact.friction * push, along = f.norm();
        velocity[i] += f / mass[i];
        const double speed = velocity[i].norm(), stopped = bears / mass[i];
        velocity[i] *= speed > stopped ? 1 - stopped / speed : 0;
        force[i] = speed > stopped ? (-push * normal[i]).eval() : Vector3d::Zero().eval();
        f *= along > bears ? 1 - bears / along : 0;
      }
      if (i < static_cast<std::size_t>(points)) largest = std::max(largest, f.norm());
      velocity[i] += force[i] / mass[i];
      kinetic += mass[i] * velocity[i].squaredNorm();
    }
    report.steps = step + 1;
    report.residual = largest / weight;
    if (!std::isfinite(kinetic)) return report;
    if (step % kReportEvery == 0 && report.residual <= options.residual) {
      report.at_rest = true;
      break;
    }
    if (kinetic < before) {
      std::fill(velocity.begin(), velocity.end(), Vector3d::Zero());
      kinetic = 0;
    }
    before = kinetic;
    for (std::size_t i = 0; i < n; ++i) {
      if (held[i]) continue;
      state[i] += velocity[i];
      if (!contact.project || i >= static_cast<std::size_t>(points)) continue;
      // Rounding must not lift a point that friction stops, or it would creep.
      if (contact.friction > 0 && velocity[i].isZero(0)) continue;
      Vector3d outward = Vector3d::Zero();
      if (contact.project(state[i], outward)) {
        velocity[i] -= std::min(0.0, velocity[i].dot(outward)) * outward;
        normal[i] = outward;
      } else {
        normal[i].setZero();
      }
    }
    cloth.settle(state);
  }
  report.dissipated_j = cloth.dissipated_j();
  report.energy_j =
      cloth.energies(state).sum_j() + height_energy(cloth, state, options.gravity_m_per_s2);
  return report;
}

std::vector<int> border_of(const MaterialMesh& mesh) {
  std::map<int, int> next;
  for (const MaterialMesh::Edge& edge : mesh.edges) {
    if (edge.left >= 0 && edge.right < 0) next[edge.from] = edge.to;
    if (edge.right >= 0 && edge.left < 0) next[edge.to] = edge.from;
  }
  std::vector<int> longest;
  while (!next.empty()) {
    std::vector<int> loop;
    for (int at = next.begin()->first; next.contains(at);) {
      loop.push_back(at);
      const int to = next.at(at);
      next.erase(at);
      at = to;
    }
    if (loop.size() > longest.size()) longest = loop;
  }
  return longest;
}

std::string ply_text(const CusickDrape& drape) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\ncomment millimetres, z up, warp along x\nelement vertex {}\n"
      "property double x\nproperty double y\nproperty double z\nelement face {}\n"
      "property list uchar int vertex_indices\nend_header\n",
      drape.mesh.points_m.size(), drape.mesh.triangles.size());
  for (std::size_t i = 0; i < drape.mesh.points_m.size(); ++i) {
    const Eigen::Vector3d p = drape.state[i] / units::mm;
    text += fmt::format("{:.6f} {:.6f} {:.6f}\n", p.x(), p.y(), p.z());
  }
  for (const auto& t : drape.mesh.triangles) text += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
  return text;
}

CusickDrape cusick_drape(const ClothLaws& laws, const CusickOptions& options) {
  const double disc = options.disc_m / 2, hem = options.specimen_m / 2;
  if (!(disc > options.spacing_m && hem > disc + options.spacing_m))
    throw usage_error("the disc, the ring of cloth or the mesh's spacing do not fit",
                      "give a disc smaller than the specimen and a finer mesh");
  const auto count = [&](double radius) {
    return static_cast<int>(std::lround(2 * std::numbers::pi * radius / options.spacing_m));
  };
  // The lattice of the mesh is turned against the warp; lots turn the two circles.
  const double turn = 2 * std::numbers::pi * lot(options.start, 0);
  const ClothOutline outline{
      circle({0, 0}, hem, count(hem), turn), {}, rings(disc, hem, options.spacing_m, 2 * turn)};
  MeshOptions mesh_options;
  mesh_options.spacing_m = options.spacing_m;
  mesh_options.lattice_turn_rad = -options.warp_rad;
  mesh_options.seed = options.start;
  MeshCloth cloth(triangulated(outline, mesh_options), laws);
  const double slack = 1e-6 * disc;
  const auto clamped = [&](int point) {
    return cloth.mesh().points_m[point].norm() <= disc + slack;
  };
  std::vector<bool> held;
  held.reserve(static_cast<std::size_t>(cloth.unknowns()));
  for (int i = 0; i < cloth.points(); ++i) held.push_back(clamped(i));
  for (const auto& edge : cloth.mesh().edges)
    held.push_back(clamped(edge.from) && clamped(edge.to));
  // Warp along x, weft along y, seen from above with z up.
  MeshCloth::State state = cloth.state_of([](const Vector2d& p) {
    return MeshCloth::Jet{{p.x(), p.y(), 0}, {1, 0, 0}, {0, 1, 0}};
  });
  for (int i = 0; i < cloth.points(); ++i) {
    const Vector2d p = cloth.mesh().points_m[i];
    if (held[i]) continue;
    const double out = (p.norm() - disc) / (hem - disc), angle = std::atan2(p.y(), p.x());
    double wave = 0;
    for (int k = 2; k <= kWaves; ++k)
      wave += std::cos(k * angle - 2 * std::numbers::pi * lot(options.start, k));
    state[i].z() += kFirstWave * out * out * wave / std::sqrt(kWaves - 1.0);
  }
  const double wall = disc - slack;
  double table_z = -std::numeric_limits<double>::infinity();
  const Contact contact{[wall, &table_z](Vector3d& p, Vector3d& normal) {
    if (p.z() < table_z) {
      p.z() = table_z;
      normal = Vector3d::UnitZ();
      return true;
    }
    const double r = p.head<2>().norm();
    if (p.z() >= 0 || r >= wall || r == 0) return false;
    normal = {p.x() / r, p.y() / r, 0};
    p.head<2>() *= wall / r;
    return true;
  }};
  CusickDrape drape;
  int steps = 0;
  const auto pass = [&](double gravity) {
    RelaxationOptions passing = options.relaxation;
    passing.gravity_m_per_s2 *= gravity;
    passing.residual = std::max(passing.residual, kPassingResidual);
    const RelaxationReport passed = relax(cloth, state, held, contact, passing);
    steps += passed.steps;
    drape.hurried_loads += passed.at_rest ? 0 : 1;
  };
  for (int k = 1; k < options.lowering_steps; ++k) {
    table_z = -(hem - disc) * k / options.lowering_steps;
    pass(1);
  }
  table_z = -std::numeric_limits<double>::infinity();
  for (int k = 0; k < 2 * options.shakes; ++k)
    pass(k % 2 == 0 ? 1 + options.shake : 1 - options.shake);
  drape.report = relax(cloth, state, held, contact, options.relaxation);
  drape.report.steps += steps;
  drape.mesh = cloth.mesh();
  drape.state = std::move(state);
  drape.memory = cloth.memory();
  return drape;
}

}  // namespace drape::simulate
