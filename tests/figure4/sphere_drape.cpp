// SPDX-License-Identifier: Apache-2.0
#include "tests/figure4/sphere_drape.hpp"

#include <Eigen/LU>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include "core/error.hpp"
#include "core/units.hpp"
#include "simulate/drape/drape.hpp"
#include "simulate/drape/pushes.hpp"
#include "simulate/mesh/descent.hpp"
#include "simulate/simulate.hpp"
#include "simulate/start/start.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kMostRounds = 300;  // descents, each followed by an update of friction

/// Positions of a lattice of material points on a draped mesh, linear in each triangle.
std::vector<Vector3d> marks_of(const simulate::MaterialMesh& mesh,
                               const std::vector<Vector3d>& points, const Vector2d& patch,
                               int side) {
  constexpr double kRounding = 1e-9;  // tolerance relative to a triangle
  std::vector<Vector3d> marks;
  for (int row = 0; row < side; ++row) {
    for (int col = 0; col < side; ++col) {
      const Vector2d at(patch.x() * row / (side - 1), patch.y() * col / (side - 1));
      std::optional<Vector3d> found;
      for (std::size_t t = 0; t < mesh.triangles.size() && !found; ++t) {
        const auto& corner = mesh.triangles[t];
        const Vector2d& a = mesh.points_m[corner[0]];
        Eigen::Matrix2d sides;
        sides << mesh.points_m[corner[1]] - a, mesh.points_m[corner[2]] - a;
        const Vector2d w = sides.inverse() * (at - a);
        if (w.minCoeff() < -kRounding || w.sum() > 1 + kRounding) continue;
        found = (1 - w.sum()) * points[corner[0]] + w.x() * points[corner[1]] +
                w.y() * points[corner[2]];
      }
      marks.push_back(found.value());
    }
  }
  return marks;
}

}  // namespace

SphereScene read_sphere_scene() {
  SphereScene sphere;
  sphere.scene = read_scene(source_root() / "rigs/paper/scenes/A.toml");
  sphere.print = read_print(sphere.scene.print_file);
  sphere.fabric = simulate::read_fabric(sphere.scene.fabric_file);
  for (simulate::KawabataCurve* curves :
       {sphere.fabric.tensile, sphere.fabric.shear, sphere.fabric.bending})
    curves[1] = curves[0];
  return sphere;
}

const Sphere& sphere_of(const SphereScene& scene) {
  return std::get<Sphere>(scene.scene.obstacles.at(0));
}

SphereDrape drape_grid(const SphereScene& scene, int side) {
  simulate::SimulateOptions options;
  options.model = simulate::ClothModel::paper;
  options.paper.rows = options.paper.cols = side;
  options.paper.imperfection_m = 0;
  options.reach = simulate::find_reach(scene.scene, scene.fabric, scene.print, std::nullopt);
  const simulate::SimulateResult result =
      simulate::simulate(scene.scene, scene.fabric, scene.print, std::nullopt, options);
  // A sheet that diverged has no marks.
  if (std::ssize(result.sheet.marks) != side * side)
    throw bad_input("the particle grid: " + result.certificate.status, {},
                    "choose another spacing");
  SphereDrape drape;
  drape.at_rest = result.at_rest();
  drape.side = side;
  for (const SheetMark& mark : result.sheet.marks) drape.points_m.push_back(mark.point_in_world);
  drape.marks_m = drape.points_m;
  const int last = side - 1;
  for (int r = 0; r < last; ++r)
    for (int c = 0; c < last; ++c)
      drape.faces.push_back(
          {r * side + c, (r + 1) * side + c, (r + 1) * side + c + 1, r * side + c + 1});
  for (int k = 0; k < last; ++k) drape.hem.push_back(k * side);
  for (int k = 0; k < last; ++k) drape.hem.push_back(last * side + k);
  for (int k = last; k > 0; --k) drape.hem.push_back(k * side + last);
  for (int k = last; k > 0; --k) drape.hem.push_back(k);
  return drape;
}

SphereDrape drape_mesh(const SphereScene& scene, simulate::MaterialMesh mesh, double in_triangles,
                       int side) {
  const simulate::ClothLaws laws =
      simulate::fit_laws(scene.fabric, simulate::SimulateOptions{}.segments,
                         simulate::find_reach(scene.scene, scene.fabric, scene.print, std::nullopt))
          .laws;
  simulate::MeshCloth cloth(std::move(mesh), laws, in_triangles);
  const simulate::FlatPose flat{scene.scene.start.centre_in_world.value(), 0};
  simulate::MeshCloth::State state = cloth.state_of([&](const Vector2d& p) {
    return simulate::MeshCloth::Jet{
        flat.point_in_world(p, scene.print.patch_m), {0, -1, 0}, {1, 0, 0}};
  });
  const std::vector<bool> held(static_cast<std::size_t>(cloth.unknowns()), false);
  simulate::MeshStiffness stiffness(cloth, held);
  simulate::DescentOptions descent;
  descent.gravity_m_per_s2 = scene.scene.gravity_m_per_s2;
  const simulate::Surroundings around(scene.scene);
  simulate::ObjectPushes pushes(cloth, held, around, scene.scene.friction,
                                descent.gravity_m_per_s2.norm());
  simulate::TimeStepsOptions motion = simulate::DrapeOptions{}.motion;
  // Steps that are short relative to the growth of folds keep a symmetry.
  motion.longest_step_s = motion.step_s;
  const auto move = [&] {
    (void)simulate::move_in_time(
        cloth, state, held, stiffness, {},
        [](double) { return -std::numeric_limits<double>::infinity(); }, 0, descent, motion,
        &pushes);
  };
  move();
  motion.longest_s = motion.step_s;  // one step for each stage
  while (!pushes.is_firm()) {
    pushes.make_firmer(state);
    move();
  }
  SphereDrape drape;
  for (int round = 0; round < kMostRounds && !drape.at_rest; ++round) {
    const simulate::DescentReport found =
        simulate::descend(cloth, state, held, stiffness, {}, descent, &pushes);
    if (!found.at_rest) break;
    drape.at_rest = found.steps == 0;
  }
  drape.side = side;
  drape.points_m.assign(state.begin(), state.begin() + cloth.points());
  for (const auto& t : cloth.mesh().triangles) drape.faces.push_back({t[0], t[1], t[2]});
  drape.hem = border_of(cloth.mesh());
  drape.marks_m = marks_of(cloth.mesh(), drape.points_m, scene.print.patch_m, side);
  return drape;
}

simulate::MaterialMesh one_diagonal_mesh(const Print& print, int side) {
  std::vector<Vector2d> points;
  std::vector<std::array<int, 3>> triangles;
  const int last = side - 1;
  for (int r = 0; r < side; ++r)
    for (int c = 0; c < side; ++c)
      points.emplace_back(print.patch_m.x() * r / last, print.patch_m.y() * c / last);
  for (int r = 0; r < last; ++r) {
    for (int c = 0; c < last; ++c) {
      const int here = r * side + c, opposite = here + side + 1;
      triangles.push_back({here, here + side, opposite});
      triangles.push_back({here, opposite, here + 1});
    }
  }
  return simulate::mesh_of(std::move(points), std::move(triangles));
}

simulate::MaterialMesh irregular_mesh(const Print& print, int side, unsigned seed) {
  simulate::MeshOptions options;
  options.seed = seed;
  options.spacing_m = print.patch_m.x() / (side - 1);
  const Vector2d& p = print.patch_m;
  return simulate::triangulated({{{0, 0}, {p.x(), 0}, p, {0, p.y()}}, {}, {}}, options);
}

Asymmetry asymmetry(const SphereDrape& drape) {
  double middle = 0, diagonal = 0;
  const int last = drape.side - 1;
  for (int r = 0; r <= last; ++r) {
    for (int c = 0; c <= last; ++c) {
      const Vector3d& p = drape.mark(r, c);
      const Vector3d &across = drape.mark(last - r, c), &exchanged = drape.mark(c, r);
      middle += (p - Vector3d(across.x(), -across.y(), across.z())).squaredNorm();
      diagonal += (p - Vector3d(-exchanged.y(), -exchanged.x(), exchanged.z())).squaredNorm();
    }
  }
  const double count = drape.side * drape.side;
  return {std::sqrt(middle / count) / units::mm, std::sqrt(diagonal / count) / units::mm};
}

double mean_height_mm(const SphereScene& scene, const SphereDrape& drape) {
  double sum = 0;
  for (const Vector3d& p : drape.marks_m) sum += p.z() - sphere_of(scene).centre_in_world.z();
  return sum / static_cast<double>(drape.marks_m.size()) / units::mm;
}

double plan_area(const SphereScene& scene, const SphereDrape& drape) {
  double area = 0;
  for (std::size_t i = 0; i < drape.hem.size(); ++i) {
    const Vector3d &a = drape.points_m[drape.hem[i]],
                   &b = drape.points_m[drape.hem[(i + 1) % drape.hem.size()]];
    area += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  return std::abs(area) / (scene.print.patch_m.x() * scene.print.patch_m.y());
}

}  // namespace drape::test
