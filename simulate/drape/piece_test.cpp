// SPDX-License-Identifier: Apache-2.0
#include "simulate/drape/piece.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "core/units.hpp"
#include "simulate/drape/test_piece.hpp"
#include "simulate/programs/piece_files.hpp"

namespace drape::simulate {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using units::mm;

Print patch() {
  return square_patch(120 * mm);
}

/// A sphere of 60 mm that stands on the table, the cloth's middle 1 mm above it.
Scene ball(double friction) {
  Scene scene;
  scene.file = "scene.toml";
  scene.name = "ball";
  scene.table_z_m = -60 * mm;
  scene.friction = friction;
  scene.obstacles = {Sphere{{0, 0, -30 * mm}, 30 * mm}};
  scene.start.mode = StartMode::flat;
  scene.start.centre_in_world = Eigen::Vector3d(0, 0, 1 * mm);
  return scene;
}

PieceOptions coarse() {
  PieceOptions options;
  options.spacing_m = 10 * mm;
  return options;
}

/// An irregular piece with a corner cut off and a hole beside its middle.
ClothOutline odd_piece() {
  return {{{0, 0}, {0.12, 0}, {0.12, 0.08}, {0.08, 0.12}, {0, 0.12}},
          {circle({0.035, 0.035}, 0.012, 8)},
          {},
          {}};
}

TEST(Piece, RestsOnABallAndIsAcceptedWithItsFriction) {
  const Scene scene = ball(0.3);
  const ClothLaws laws = cotton();
  const PieceDrape piece = drape_piece(scene, patch(), std::nullopt, laws, odd_piece(), coarse());
  ASSERT_TRUE(piece.report.at_rest);
  EXPECT_THAT(judge_piece(piece, scene, laws, DescentOptions{}.residual).refusals, IsEmpty());
  // A piece held by friction does not rest without it, and a lifted point is not carried.
  const Scene slippery = ball(0);
  EXPECT_THAT(judge_piece(piece, slippery, laws, DescentOptions{}.residual).refusals,
              Contains(HasSubstr("is left on a point")));
  // The point that lies nearest to the ball's surface, lifted off it and pressed into it.
  std::size_t lies = 0;
  const auto gap = [&](std::size_t k) {
    return std::abs((piece.state[k] - Eigen::Vector3d(0, 0, -30 * mm)).norm() - 30 * mm);
  };
  for (std::size_t k = 1; k < piece.mesh.points_m.size(); ++k)
    if (gap(k) < gap(lies)) lies = k;
  const Eigen::Vector3d out = (piece.state[lies] - Eigen::Vector3d(0, 0, -30 * mm)).normalized();
  PieceDrape lifted = piece, sunk = piece;
  lifted.state[lies] += 5e-6 * out;
  EXPECT_THAT(judge_piece(lifted, scene, laws, DescentOptions{}.residual).refusals,
              Contains(HasSubstr("is left on a point")));
  sunk.state[lies] = Eigen::Vector3d(0, 0, -30 * mm) + (30 * mm - 1e-6) * out;
  EXPECT_THAT(judge_piece(sunk, scene, laws, DescentOptions{}.residual).refusals,
              Contains(HasSubstr("deep in an object")));
}

TEST(Piece, HangsFromItsPins) {
  Scene scene = ball(0);
  scene.obstacles.clear();
  scene.table_z_m = -1;
  for (const double weft : {0.02, 0.1}) {
    Pin pin;
    pin.at_material_m = {0, weft};
    pin.point_in_world = Eigen::Vector3d(weft - 0.06, 0.06, 0);
    scene.pins.push_back(pin);
  }
  const ClothLaws laws = cotton();
  const PieceDrape piece =
      drape_piece(scene, patch(), std::nullopt, laws, outline_of(patch()), coarse());
  ASSERT_TRUE(piece.report.at_rest);
  ASSERT_EQ(piece.pinned.size(), 2U);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(piece.mesh.points_m[piece.pinned[k]], *scene.pins[k].at_material_m);
    EXPECT_EQ(piece.state[piece.pinned[k]], *scene.pins[k].point_in_world);
  }
  double lowest = 0;
  for (std::size_t i = 0; i < piece.mesh.points_m.size(); ++i)
    lowest = std::min(lowest, piece.state[i].z());
  // Its side is 120 mm; gravity stretches it by less than rho g L / K = 0.4 %, folds shorten it.
  EXPECT_LT(lowest, -0.1);
  EXPECT_GT(lowest, -0.1205);
  EXPECT_THAT(judge_piece(piece, scene, laws, DescentOptions{}.residual).refusals, IsEmpty());
  PieceDrape loose = piece;
  loose.state[piece.pinned[0]].x() += 1e-6;
  EXPECT_THAT(judge_piece(loose, scene, laws, DescentOptions{}.residual).refusals,
              Contains(HasSubstr("held point")));
}

TEST(Piece, AnOutlineInCentimetresIsRefused) {
  ClothOutline outline = odd_piece();
  outline.holes.clear();
  for (Eigen::Vector2d& corner : outline.outer) corner /= 10;
  try {
    (void)drape_piece(ball(0), patch(), std::nullopt, cotton(), outline, coarse());
    FAIL() << "a piece of a few spacings was draped";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("not cm"), std::string::npos) << error.what();
  }
}

TEST(Piece, APinBesideItAndAMeasuredStartAreRefused) {
  Scene scene = ball(0);
  Pin pin;
  pin.at_material_m = {0.035, 0.035};  // in the hole
  pin.point_in_world = Eigen::Vector3d(0, 0, 0);
  scene.pins = {pin};
  EXPECT_THROW((void)drape_piece(scene, patch(), std::nullopt, cotton(), odd_piece(), coarse()),
               Error);
  // Two that the mesh would make one.
  pin.at_material_m = {0.0, 0.03};
  scene.pins = {pin, pin};
  scene.pins[0].at_material_m = {0.0, 0.031};
  EXPECT_THROW((void)drape_piece(scene, patch(), std::nullopt, cotton(), odd_piece(), coarse()),
               Error);
  scene.pins.clear();
  scene.start.mode = StartMode::measured;
  EXPECT_THROW((void)drape_piece(scene, patch(), std::nullopt, cotton(), odd_piece(), coarse()),
               Error);
}

}  // namespace
}  // namespace drape::simulate
