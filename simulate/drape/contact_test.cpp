// SPDX-License-Identifier: Apache-2.0
// Forces of objects on a piece between its points.
#include <gmock/gmock.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/files/csv.hpp"
#include "core/units.hpp"
#include "simulate/drape/object_pushes.hpp"
#include "simulate/drape/test_piece.hpp"
#include "simulate/programs/piece_files.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using units::mm;

/// A box of 50 mm with rounded edges; the cloth lies on its top.
Scene block(double friction) {
  Scene scene;
  scene.file = "scene.toml";
  scene.name = "block";
  scene.table_z_m = -0.2;
  scene.friction = friction;
  Box box;
  box.size_m = {50 * mm, 50 * mm, 50 * mm};
  box.edge_radius_m = 1 * mm;
  box.world_from_box.translation_m = {0, 0, -25 * mm};
  scene.obstacles = {box};
  scene.start.mode = StartMode::flat;
  scene.start.centre_in_world = Vector3d(0, 0, 1 * mm);
  return scene;
}

MeshCloth small_cloth() {
  MeshOptions options;
  options.spacing_m = 10 * mm;
  return {triangulated(outline_of(square_patch(60 * mm)), options), cotton()};
}

TEST(ClothSurface, IsExactForQuadraticsAndKeepsForces) {
  const MeshCloth cloth = small_cloth();
  const auto map = [](const Vector2d& p) {
    const double u = p.x(), v = p.y();
    return MeshCloth::Jet{
        {u, v, 9 * u * u - 5 * u * v + 4 * v * v}, {1, 0, 18 * u - 5 * v}, {0, 1, -5 * u + 8 * v}};
  };
  const ClothSurface surface(cloth);
  const MeshCloth::State nodes = surface.nodes(cloth.state_of(map));
  const MaterialMesh& mesh = cloth.mesh();
  for (std::size_t e = 0; e < mesh.edges.size(); ++e) {
    const Vector2d middle =
        (mesh.points_m[mesh.edges[e].from] + mesh.points_m[mesh.edges[e].to]) / 2;
    EXPECT_LT((nodes[mesh.points_m.size() + e] - map(middle).x).norm(), 1e-12);
  }
  // A force on a side's middle comes to the points as one of the same size; the sides get moments.
  MeshCloth::State on_nodes(nodes.size(), Vector3d::Zero()), force(nodes.size(), Vector3d::Zero());
  on_nodes[nodes.size() - 3] = {0.1, -0.2, 0.3};
  surface.add_forces(on_nodes, force);
  Vector3d sum = Vector3d::Zero();
  for (int i = 0; i < cloth.points(); ++i) sum += force[i];
  EXPECT_LT((sum - Vector3d(0.1, -0.2, 0.3)).norm(), 1e-12);
}

/// Forces are the energy's gradient, with friction between two settlings too.
TEST(ObjectPushes, ForcesAreTheGradientOfTheirEnergy) {
  const MeshCloth cloth = small_cloth();
  const std::vector<bool> held(static_cast<std::size_t>(cloth.unknowns()), false);
  const Surroundings around(block(0.3));
  ObjectPushes pushes(cloth, held, around, 0.3, 9.81);
  // Bent over an edge of the box, about a tenth of a millimetre deep.
  const auto bent = [](double sunk) {
    return [sunk](const Vector2d& p) {
      const double out = p.x(), turn = 12 * out;
      return MeshCloth::Jet{
          {22 * mm + std::sin(turn) / 12, p.y() - 30 * mm, -sunk - (1 - std::cos(turn)) / 12},
          {std::cos(turn), 0, -std::sin(turn)},
          {0, 1, 0}};
    };
  };
  pushes.settle(cloth.state_of(bent(0.1 * mm)));
  MeshCloth::State state = cloth.state_of(bent(0.12 * mm));
  for (int i = 0; i < cloth.points(); ++i) state[i] += 1e-5 * Vector3d(std::sin(i), std::cos(i), 0);
  MeshCloth::State force(state.size(), Vector3d::Zero());
  pushes.add_forces(state, force);
  double largest = 0;
  for (const Vector3d& f : force) largest = std::max(largest, f.norm());
  ASSERT_GT(largest, 0);
  int between = 0;
  for (const ContactForce& stated : pushes.stated(state)) between += stated.weight[0] < 1 ? 1 : 0;
  EXPECT_GT(between, 0);
  constexpr double kStep = 1e-9;
  for (std::size_t i = 0; i < state.size(); i += 3)
    for (int axis = 0; axis < 3; ++axis) {
      MeshCloth::State to = state;
      to[i][axis] += kStep;
      const double after = pushes.energy_j(to);
      to[i][axis] -= 2 * kStep;
      const double before = pushes.energy_j(to);
      // Rounding of energies of a microjoule over the step, and what a step bends the law by.
      ASSERT_NEAR((before - after) / (2 * kStep), force[i][axis], 1e-3 * largest) << i;
    }
}

TEST(Piece, EdgesPressBetweenItsPoints) {
  const Scene scene = block(0.3);
  const ClothLaws laws = cotton();
  PieceOptions options;
  options.spacing_m = 10 * mm;
  const Print print = square_patch(100 * mm);
  const PieceDrape piece =
      drape_piece(scene, print, std::nullopt, laws, outline_of(print), options);
  ASSERT_TRUE(piece.report.at_rest);
  const double tolerance = DescentOptions{}.residual;
  const MeshJudgement judged = judge_piece(piece, scene, laws, tolerance);
  EXPECT_THAT(judged.refusals, IsEmpty());
  // The whole piece on one place would sink in by so much.
  EXPECT_LT(judged.deepest_m, 0.25 * mm);
  PieceDrape other = piece;
  other.contact_forces.clear();
  EXPECT_THAT(judge_piece(other, scene, laws, tolerance).refusals,
              Contains(HasSubstr("is left on a point")));
  // A pull is no push, friction has its limit, and a place off the box presses on nothing.
  const auto between = static_cast<std::size_t>(
      std::find_if(piece.contact_forces.begin(), piece.contact_forces.end(),
                   [](const ContactForce& f) { return f.weight[0] < 1; }) -
      piece.contact_forces.begin());
  ASSERT_LT(between, piece.contact_forces.size());
  const Vector3d force = piece.contact_forces[between].force_in_world;
  for (const Vector3d& wrong : {Vector3d(-force), Vector3d(2 * force)}) {
    other = piece;
    other.contact_forces[between].force_in_world = wrong;
    EXPECT_THAT(judge_piece(other, scene, laws, tolerance).refusals,
                Contains(HasSubstr("is left on a point")));
  }
  other = piece;
  other.contact_forces[between].shape = 1;
  EXPECT_THAT(judge_piece(other, scene, laws, tolerance).refusals,
              Contains(HasSubstr("press on nothing")));
  other = piece;
  other.contact_forces[between].weight[0] += 0.5;
  EXPECT_THAT(judge_piece(other, scene, laws, tolerance).refusals,
              Contains(HasSubstr("press on nothing")));
}

struct Found {
  MeshJudgement judgement;
  double distance_m = 0;  ///< mean over the marks
};

/// A slippery drape of known parameters that another solver found (tests/data/independent-drapes),
/// from its flat start.
Found found_of(const std::string& name, double spacing_m) {
  const std::filesystem::path folder = drape::test::test_data("independent-drapes");
  const Scene scene = read_scene(folder / (name + ".toml"));
  const Print print = read_print(scene.print_file);
  ClothLaws laws;
  laws.density_kg_per_m2 = 0.15;
  laws.tensile[0] = laws.tensile[1] = {1500, {}};
  laws.shear = {40, {}};
  laws.bending[0] = {1.0e-5, {}};
  laws.bending[1] = {0.7e-5, {}};
  laws.twist_n_m = 1.316667e-5;
  PieceOptions options;
  options.spacing_m = spacing_m;
  const PieceDrape piece =
      drape_piece(scene, print, std::nullopt, laws, outline_of(print), options);
  Found found;
  EXPECT_TRUE(piece.report.at_rest) << name;
  found.judgement = judge_piece(piece, scene, laws, options.descent.residual);
  const Csv other =
      read_csv(folder / (name + ".csv"), {"warp_mm", "weft_mm", "x_mm", "y_mm", "z_mm"});
  const auto facets = facets_of(piece.mesh);
  std::vector<Vector2d> material = piece.mesh.points_m;
  for (const MaterialMesh::Edge& edge : piece.mesh.edges)
    material.push_back((piece.mesh.points_m[edge.from] + piece.mesh.points_m[edge.to]) / 2);
  const std::size_t marks = other.lines.size();
  for (std::size_t k = 0; k < marks; ++k) {
    const Vector2d at = mm * Vector2d(other.columns[0][k], other.columns[1][k]);
    double best = -1e9;
    Vector3d place = Vector3d::Zero();
    for (const auto& f : facets) {
      Eigen::Matrix2d sides;
      sides << material[f[1]] - material[f[0]], material[f[2]] - material[f[0]];
      const Vector2d w = sides.inverse() * (at - material[f[0]]);
      const double least = std::min({w[0], w[1], 1 - w[0] - w[1]});
      if (least <= best) continue;
      best = least;
      place = (1 - w[0] - w[1]) * piece.surface[f[0]] + w[0] * piece.surface[f[1]] +
              w[1] * piece.surface[f[2]];
    }
    const Vector3d there(other.columns[2][k], other.columns[3][k], other.columns[4][k]);
    found.distance_m += (place - mm * there).norm() / static_cast<double>(marks);
  }
  return found;
}

// The limit is the issue's, for as many points across as 41 particles.
TEST(IndependentPiece, SphereAt5mm) {
  const Found found = found_of("sphere", 5 * mm);
  EXPECT_THAT(found.judgement.refusals, IsEmpty());
  EXPECT_LE(found.distance_m / mm, 0.5);
  std::printf("sphere, 5 mm: %.3f mm from the independent drape\n", found.distance_m / mm);
}

TEST(IndependentPiece, CubeIsAcceptedAndNearerOnAFinerMesh) {
  const Found coarse = found_of("cube", 10 * mm), fine = found_of("cube", 5 * mm);
  for (const Found& found : {coarse, fine}) {
    EXPECT_THAT(found.judgement.refusals, IsEmpty());
    EXPECT_LT(found.judgement.deepest_m, 0.25 * mm);
  }
  EXPECT_LT(fine.distance_m, coarse.distance_m);
  constexpr double kAim_mm = 0.5;  // the issue's, at 2.5 mm
  std::printf("cube, 10 and 5 mm: %.3f and %.3f mm from the independent drape (aim %.1f%s)\n",
              coarse.distance_m / mm, fine.distance_m / mm, kAim_mm,
              fine.distance_m > kAim_mm * mm ? ", MISSED" : "");
}

}  // namespace
}  // namespace drape::simulate
