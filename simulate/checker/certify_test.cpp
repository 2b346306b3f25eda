// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <ostream>
#include <random>

#include "simulate/checker/surface.hpp"
#include "simulate/mesh/cusick.hpp"
#include "simulate/simulate.hpp"
#include "tests/support/judged_drape.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using testing::HasSubstr;
using units::mm;

/// Cloth that hangs from a clamped hem and from a clamp inside, which it leaves upwards.
void clamp(Case& drape) {
  const double side = drape.print.patch_m.y(), inside = drape.print.patch_m.x() / 4;
  drape.scene.pins.clear();
  drape.scene.clamps = {{{0, 0}, {0, side}, {0, 0, 0.2}, {side, 0, 0.2}, {0, -1, 0}},
                        {{inside, 0},
                         {inside, side},
                         {0, -0.95 * inside, 0.2},
                         {side, -0.95 * inside, 0.2},
                         Eigen::Vector3d(0, -1, 0.2).normalized()}};
  drape.scene.start.centre_in_world = Eigen::Vector3d(side / 2, -side / 2, 0.2);
}

/// One drape of each kind: on a sphere, on a cube's edges, by pins, by clamps, with memory.
const Case& case_of(const std::string& name) {
  static std::map<std::string, Case> cases;
  const auto known = cases.find(name);
  if (known != cases.end()) return known->second;
  Case drape(name == "sphere" || name == "memory" ? "A" : name == "cube" ? "B" : "D");
  drape.options.internal_friction = name == "memory";
  if (name == "memory") drape.options.segments = 5;
  if (name == "clamps") clamp(drape);
  drape.drape();
  return cases.emplace(name, std::move(drape)).first->second;
}

class Rests : public testing::TestWithParam<std::string> {};

TEST_P(Rests, StoredRestsAreAccepted) {
  const Case& drape = case_of(GetParam());
  ASSERT_TRUE(drape.result.at_rest()) << drape.result.certificate.status;
  const CertifyReport report = drape.judge();
  EXPECT_TRUE(report.accepted()) << listed(report);
  EXPECT_TRUE(report.warnings.empty());
  const bool lies = GetParam() != "pins" && GetParam() != "clamps";
  EXPECT_EQ(!drape.files.contact_forces.empty(), lies);
  EXPECT_EQ(drape.files.memory.shear.empty(), GetParam() != "memory");
  ASSERT_TRUE(drape.files.certificate.check);
  EXPECT_TRUE(drape.files.certificate.check->accepted);
}

INSTANTIATE_TEST_SUITE_P(Kinds, Rests,
                         testing::Values("sphere", "cube", "pins", "clamps", "memory"));

/// A falsified drape, and a word expected in the refusal or in the number that does not hold.
struct Forgery {
  const char* name;
  const char* of;
  std::function<void(Case&)> forge;
  const char* refusal;
};
void PrintTo(const Forgery& forgery, std::ostream* out) {
  *out << forgery.name;
}

/// A point far from everything that holds or touches the cloth.
std::size_t lowest(const Case& drape) {
  const auto& points = drape.files.shape.points_m;
  return static_cast<std::size_t>(
      std::min_element(points.begin(), points.end(),
                       [](const auto& a, const auto& b) { return a.z() < b.z(); }) -
      points.begin());
}

std::size_t largest_force(const Case& drape) {
  const auto& forces = drape.files.contact_forces;
  return static_cast<std::size_t>(
      std::max_element(forces.begin(), forces.end(),
                       [](const ContactForce& a, const ContactForce& b) {
                         return a.force_in_world.norm() < b.force_in_world.norm();
                       }) -
      forces.begin());
}

std::vector<Forgery> forgeries() {
  const char* const left = "is left on a point";
  return {
      {"APointBy2Um", "sphere",
       [](Case& c) { c.files.shape.points_m[lowest(c)].z() += 0.002 * mm; }, left},
      {"APointAcrossBy2Um", "pins",
       [](Case& c) { c.files.shape.points_m[lowest(c)].x() += 0.002 * mm; }, left},
      {"ASlope", "sphere", [](Case& c) { c.files.shape.of_sides.back() *= 1.001; }, "is left"},
      {"AHeldPoint", "pins",
       [](Case& c) {
         for (Eigen::Vector3d& p : c.files.shape.points_m)
           if ((p - *c.scene.pins[0].point_in_world).norm() < 1e-9) p.x() += 1e-8;
       },
       "held point"},
      {"ThePlaceOfAPin", "pins", [](Case& c) { c.scene.pins[0].point_in_world->x() += 0.01 * mm; },
       "held point"},
      {"APinBesideTheMesh", "pins",
       [](Case& c) { c.scene.pins[0].at_material_m = Eigen::Vector2d(1 * mm, 1 * mm); },
       "where a pin holds"},
      {"ThePlaceOfAClamp", "clamps",
       [](Case& c) { c.scene.clamps[0].from_in_world.z() += 0.01 * mm; }, "held point"},
      {"TheSlopeOfAClamp", "clamps",
       [](Case& c) {
         c.scene.clamps[1].direction_in_world = Eigen::Vector3d(0, -1, 0.21).normalized();
       },
       "held cloth is bent"},
      {"AClampBesideTheMesh", "clamps",
       [](Case& c) {
         for (Eigen::Vector2d* at :
              {&c.scene.clamps[1].from_material_m, &c.scene.clamps[1].to_material_m})
           at->x() += 0.1 * mm;
       },
       "clamp holds no points"},
      {"AForceLess", "sphere",
       [](Case& c) {
         c.files.contact_forces.erase(c.files.contact_forces.begin() + largest_force(c));
       },
       left},
      {"AForceThatPulls", "sphere",
       [](Case& c) { c.files.contact_forces[largest_force(c)].force_in_world *= -1; }, left},
      {"AForceBesideItsCone", "cube",
       [](Case& c) {
         for (ContactForce& force : c.files.contact_forces)
           force.force_in_world.x() += 2 * force.force_in_world.norm();
       },
       left},
      {"AForceElsewhere", "sphere",
       [](Case& c) {
         c.files.contact_forces[0].particle.fill(static_cast<int>(lowest(c)));
         c.files.contact_forces[0].weight = {1, 0, 0, 0};
       },
       "press on nothing"},
      {"AForceOfNoPlace", "sphere", [](Case& c) { c.files.contact_forces[0].weight[0] += 0.1; },
       "press on nothing"},
      {"AForceOfNoObject", "sphere", [](Case& c) { c.files.contact_forces[0].shape = 7; },
       "press on nothing"},
      {"LessFriction", "sphere", [](Case& c) { c.files.certificate.friction = 0.01; }, left},
      {"AHeavierCloth", "sphere", [](Case& c) { c.fabric.areal_density_kg_per_m2 *= 1.01; }, left},
      {"AnotherObject", "sphere",
       [](Case& c) { std::get<Sphere>(c.scene.obstacles[0]).radius_m += 1 * mm; },
       "deep in an object"},
      {"NoMemory", "memory",
       [](Case& c) {
         ClothMemory& memory = c.files.memory;
         for (auto* slips : {&memory.bending[0], &memory.bending[1], &memory.shear})
           std::fill(slips->begin(), slips->end(), 0.0);
       },
       ""},
      {"AShorterMemory", "memory", [](Case& c) { c.files.memory.shear.pop_back(); }, "do not fit"},
      {"AWideTolerance", "sphere", [](Case& c) { c.files.certificate.residual_tolerance = 2e-3; },
       "may be left"},
      {"ThickLayers", "sphere",
       [](Case& c) { c.files.certificate.distances->layers_apart_m = 0.02; },
       "apart are no contact"},
      {"AStrain", "sphere", [](Case& c) { c.files.certificate.strains->warp.y() += 1e-6; },
       "largest warp strain"},
      {"AShear", "sphere", [](Case& c) { c.files.certificate.strains->shear_most_rad *= 1.001; },
       "largest shear"},
      {"ACurvature", "sphere",
       [](Case& c) { c.files.certificate.strains->curvature_most_per_m *= 1.001; },
       "largest curvature"},
      {"AnEnergy", "sphere", [](Case& c) { *c.files.certificate.energies->internal_j *= 1.001; },
       "internal energy"},
      {"ATwistStiffness", "sphere", [](Case& c) { c.files.certificate.twist_n_m *= 1.0001; },
       "twist stiffness"},
      {"ADepth", "cube", [](Case& c) { c.files.certificate.distances->deepest_m += 0.01 * mm; },
       "deepest in an object"},
      {"AMarkOfTheSheet", "sphere",
       [](Case& c) { c.files.sheet.marks[37].point_in_world.z() += 0.002 * mm; },
       "distance of the sheet"},
      {"AMarkBesideTheCloth", "sphere",
       [](Case& c) { c.files.sheet.marks[0].material_m.x() = -1 * mm; }, "beside the cloth"},
      {"APatchOfAnotherSize", "sphere", [](Case& c) { c.print.patch_m *= 1.001; }, "patch"},
      {"AnotherVerdict", "sphere", [](Case& c) { c.files.certificate.at_rest = false; },
       "the sheet says"},
      {"StrainsBeyondAllMeasured", "pins",
       [](Case& c) {
         for (Eigen::Vector3d& p : c.files.shape.points_m)
           p *= 1.1 + 2 * c.fabric.tensile[0].x.back();
       },
       "warp is strained"}};
}

class Forged : public testing::TestWithParam<Forgery> {};

TEST_P(Forged, IsRefused) {
  Case drape = case_of(GetParam().of);
  ASSERT_TRUE(drape.result.at_rest()) << drape.result.certificate.status;
  GetParam().forge(drape);
  const CertifyReport report = drape.judge();
  EXPECT_FALSE(report.accepted());
  EXPECT_THAT(listed(report), HasSubstr(GetParam().refusal));
}

INSTANTIATE_TEST_SUITE_P(OfEachKind, Forged, testing::ValuesIn(forgeries()),
                         [](const auto& of) { return std::string(of.param.name); });

TEST(Certify, AMovingClothHoldsItsNumbersAndIsNoRest) {
  Case early("D");
  early.options.drape.descent.most_steps = 20;
  early.options.drape.motion.longest_s = 0.1;
  early.drape();
  ASSERT_FALSE(early.result.at_rest());
  EXPECT_TRUE(early.judge().accepted()) << listed(early.judge());
  early.files.certificate.at_rest = true;
  std::get<SimulatedSource>(early.files.sheet.source).status = "at rest";
  EXPECT_THAT(listed(early.judge()), HasSubstr("is left on a point"));
}

TEST(Certify, FilesThatDoNotFitAreRefused) {
  const Case& drape = case_of("sphere");
  const test::TemporaryFolder folder;
  RunRecord record("test", {}, folder.path() / "run.json");
  write_outputs(folder.path(), drape.result, record);
  write_durable(folder.path() / "contact_forces.csv", contact_forces_csv({}));
  EXPECT_THROW((void)read_rest_files(folder.path()), Error) << "the certificate states some";
  write_durable(folder.path() / "cloth.ply",
                "ply\nformat ascii 1.0\nelement vertex 1\n"
                "property float x\nproperty float y\nproperty float "
                "z\nend_header\n0 0 0\n");
  EXPECT_THROW((void)read_cloth_shape(folder.path() / "cloth.ply"), Error);
  Certificate paper = drape.result.certificate;
  paper.cloth = CertificateGrid{.rows = 11, .cols = 11};
  write_record(folder.path() / "certificate.json", paper);
  EXPECT_THROW((void)read_rest_files(folder.path()), Error) << "the paper's model";
}

TEST(Certify, FilesHoldWhatWasJudged) {
  const Case& drape = case_of("memory");
  const Certificate &read = drape.files.certificate, &written = drape.result.certificate;
  EXPECT_EQ(text_of(read), text_of(written));
  EXPECT_NEAR(read.check->residual, written.check->residual, 1e-9);
  EXPECT_EQ(drape.files.memory.bending[0], drape.result.drape->rest.memory.bending[0]);
  EXPECT_EQ(drape.files.memory.shear, drape.result.drape->rest.memory.shear);
  const auto& points = drape.files.shape.points_m;
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_LT(
        (points[i] - drape.result.drape_case->local.to_world(drape.result.drape->rest.state[i]))
            .norm(),
        1e-15);
}

TEST(Certify, RestsAfterAHistoryAreAcceptedAndDifferByIt) {
  const Case& fresh = case_of("memory");
  Case worn("A", fresh.options);
  worn.scene.start.history = {"bent 1 per cm along warp", "draped 1 times",
                              "shaken 1 times by 30 %"};
  worn.drape();
  ASSERT_TRUE(worn.result.at_rest()) << worn.result.certificate.status;
  EXPECT_TRUE(worn.judge().accepted()) << listed(worn.judge());
  double farthest_m = 0;
  for (std::size_t i = 0; i < worn.files.sheet.marks.size(); ++i)
    farthest_m = std::max(farthest_m, (worn.files.sheet.marks[i].point_in_world -
                                       fresh.files.sheet.marks[i].point_in_world)
                                          .norm());
  EXPECT_GT(farthest_m, 0.05 * mm);
}

// A vertical rod through the centre of cloth that lies flat on the table.
TEST(Certify, ARodThroughTheClothIsNoRest) {
  Case drape("D");
  drape.scene.pins.clear();
  drape.scene.table_z_m = 0;
  drape.scene.start.centre_in_world = Eigen::Vector3d(0, 0, 1 * mm);
  drape.drape();
  ASSERT_TRUE(drape.result.at_rest()) << drape.result.certificate.status;
  ASSERT_TRUE(drape.judge().accepted()) << listed(drape.judge());
  for (ContactForce& force : drape.files.contact_forces) ++force.shape;  // the table is listed last
  for (const double radius_m : {0.2 * mm, 1 * mm, 10 * mm}) {
    drape.scene.obstacles = {Cylinder{{}, radius_m, 100 * mm, 0}};
    const auto refusals = drape.judge().refusals;
    ASSERT_FALSE(refusals.empty()) << radius_m;
    EXPECT_THAT(refusals.back(),
                HasSubstr(radius_m < 5 * mm ? "passes through an object" : "deep in an object"));
  }
}

using testing::Contains;
using testing::IsEmpty;
using testing::Not;

ClothLaws laws_of(bool friction) {
  ClothLaws laws;
  laws.density_kg_per_m2 = 0.15;
  laws.tensile[0] = {800, {{0.01, 400}}};
  laws.tensile[1] = {600, {}};
  laws.shear = {30, {{0.05, 10}}};
  laws.bending[0] = {12e-6, {{30, -3e-6}}};
  laws.bending[1] = {8e-6, {}};
  laws.twist_n_m = 10e-6;
  if (!friction) return laws;
  const FrictionStack bending{{{12e-6, 6e-5, 0}, {4e-6, 4e-5, 0}}};
  laws.friction = ClothFriction{{bending, bending}, {{{60, 0.3, 0.5}}}};
  return laws;
}

CusickOptions options_of() {
  CusickOptions options;
  options.disc_m = 0.127;
  options.specimen_m = 0.254;
  options.spacing_m = 0.020;
  options.lowering_steps = 1;
  options.lowering_s = 0;
  options.motion.step_s = 8e-3;
  // the last descent removes the rest of its motion
  options.motion.longest_s = 0.2;
  return options;
}

MeshRest rest_of(const CusickDrape& drape, const ClothLaws& laws) {
  MeshRest rest;
  rest.shape = shape_of(drape.mesh, drape.state);
  rest.laws = laws;
  rest.memory = drape.memory;
  rest.disc_radius_m = options_of().disc_m / 2;
  rest.residual_tolerance = DescentOptions{}.residual;
  return rest;
}

class MeshRests : public testing::TestWithParam<bool> {
 protected:
  MeshRests() : laws_(laws_of(GetParam())), drape_(cusick_drape(laws_, options_of())) {}

  [[nodiscard]] MeshRest rest() const { return rest_of(drape_, laws_); }
  /// The lowest point of the hem.
  [[nodiscard]] std::size_t lowest() const {
    std::size_t at = 0;
    for (std::size_t i = 0; i < drape_.mesh.points_m.size(); ++i)
      if (drape_.state[i].z() < drape_.state[at].z()) at = i;
    return at;
  }

  ClothLaws laws_;
  CusickDrape drape_;
};

TEST_P(MeshRests, ARestIsAcceptedWithTheSolversNumbers) {
  ASSERT_TRUE(drape_.report.at_rest);
  const MeshJudgement found = judge_mesh(rest());
  EXPECT_THAT(found.refusals, IsEmpty());
  EXPECT_NEAR(found.residual, drape_.report.residual, 1e-6);
  double height_j = 0;
  MeshCloth cloth(drape_.mesh, laws_);
  for (int i = 0; i < cloth.points(); ++i)
    height_j += cloth.mass_kg()[i] * 9.80665 * drape_.state[i].z();
  EXPECT_NEAR((found.energy_j + height_j) / drape_.report.energy_j, 1, 1e-9);
  EXPECT_EQ(drape_.report.dissipated_j > 0, GetParam()) << "friction alone takes something";
}

TEST_P(MeshRests, WhatIsNoRestIsRefused) {
  MeshRest moved = rest();
  moved.shape.points_m[lowest()].z() += 2e-4;
  EXPECT_THAT(judge_mesh(moved).refusals, Contains(HasSubstr("is left on a point")));
  MeshRest turned = rest();
  turned.shape.of_sides.back() *= 1.05;
  EXPECT_THAT(judge_mesh(turned).refusals, Not(IsEmpty()));
  MeshRest stiffer = rest();
  stiffer.laws.bending[0].slope *= 1.05;
  EXPECT_THAT(judge_mesh(stiffer).refusals, Contains(HasSubstr("is left on a point")));
  MeshRest heavier = rest();
  heavier.laws.density_kg_per_m2 *= 1.01;
  EXPECT_THAT(judge_mesh(heavier).refusals, Contains(HasSubstr("is left on a point")));
}

TEST_P(MeshRests, HeldClothAndTheCylinderAreJudged) {
  std::size_t held = 0;
  while (drape_.mesh.points_m[held].norm() > 0.05) ++held;
  MeshRest lifted = rest();
  lifted.shape.points_m[held].z() += 1e-6;
  EXPECT_THAT(judge_mesh(lifted).refusals, Contains(HasSubstr("held point")));
  MeshRest inside = rest();
  inside.shape.points_m[lowest()].head<2>() *= 0.3;
  EXPECT_THAT(judge_mesh(inside).refusals, Contains(HasSubstr("cylinder")));
}

TEST_P(MeshRests, ListsThatDoNotFitAreRefused) {
  MeshRest short_of_one = rest();
  short_of_one.shape.of_sides.pop_back();
  EXPECT_THAT(judge_mesh(short_of_one).refusals, Contains(HasSubstr("do not fit")));
  MeshRest no_number = rest();
  no_number.shape.points_m[lowest()].x() = std::nan("");
  EXPECT_THAT(judge_mesh(no_number).refusals, Contains(HasSubstr("do not fit")));
  MeshRest beyond = rest();
  beyond.shape.triangles.front()[1] = 1 << 30;
  EXPECT_THAT(judge_mesh(beyond).refusals, Contains(HasSubstr("do not fit")));
  MeshRest backwards = rest();
  std::swap(backwards.shape.triangles.front()[0], backwards.shape.triangles.front()[1]);
  EXPECT_THAT(judge_mesh(backwards).refusals, Contains(HasSubstr("turned over")));
}

INSTANTIATE_TEST_SUITE_P(Friction, MeshRests, testing::Bool());

/// Tilted gravity presses one side of the cloth onto the cylinder.
TEST_P(MeshRests, ClothThatPressesOnTheCylinderRests) {
  CusickOptions options = options_of();
  options.descent.gravity_m_per_s2 = {10, 0, -9};
  const CusickDrape drape = cusick_drape(laws_, options);
  ASSERT_TRUE(drape.report.at_rest);
  MeshRest rest = rest_of(drape, laws_);
  rest.gravity_m_per_s2 = options.descent.gravity_m_per_s2;
  const MeshJudgement found = judge_mesh(rest);
  EXPECT_THAT(found.refusals, IsEmpty());
  EXPECT_NEAR(found.residual, drape.report.residual, 1e-6);
  const double radius = options.disc_m / 2;
  double least = 2;
  for (const Eigen::Vector3d& p : rest.shape.points_m)
    if (p.z() < 0) least = std::min(least, p.head<2>().norm() / radius);
  EXPECT_LE(least, 1 - 1e-6) << "nothing presses";
  EXPECT_GE(least, 1 - 1e-5);
}

/// Started on a coarser mesh, it still ends at rest by its own criteria.
TEST_P(MeshRests, AShapeThatWasCarriedOverRests) {
  CusickOptions options = options_of();
  options.spacing_m = options.disc_m / 16;
  options.laid_coarser = 1.25;
  const CusickDrape carried = cusick_drape(laws_, options);
  EXPECT_GT(carried.mesh.points_m.size(), 2 * drape_.mesh.points_m.size());
  ASSERT_TRUE(carried.report.at_rest);
  EXPECT_THAT(judge_mesh(rest_of(carried, laws_)).refusals, IsEmpty());
}

TEST(MeshRest, ForgottenSlipsAreRefused) {
  const ClothLaws laws = laws_of(true);
  MeshRest rest = rest_of(cusick_drape(laws, options_of()), laws);
  EXPECT_THAT(judge_mesh(rest).refusals, IsEmpty());
  for (double& slip : rest.memory.bending[0]) slip = 0;
  EXPECT_THAT(judge_mesh(rest).refusals, Contains(HasSubstr("friction element")));
}

/// Flat, disconnected triangles in space.
struct Pieces {
  MeshRest rest;

  Pieces() {
    rest.laws = laws_of(false);
    rest.disc_radius_m = 1e-6;
  }
  /// Adds a triangle of 0.1 m along warp and weft, given its corner and edges in space.
  void add(const Eigen::Vector3d& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    ClothShape& shape = rest.shape;
    const auto first = static_cast<int>(shape.points_m.size());
    for (const Eigen::Vector2d& at : {Eigen::Vector2d(0, 0), {1, 0}, {0, 1}}) {
      shape.material_m.emplace_back(0.1 * at + Eigen::Vector2d::Constant(first + 1));
      shape.points_m.emplace_back(corner + at.x() * u + at.y() * v);
    }
    shape.triangles.push_back({first, first + 1, first + 2});
    for (const auto& [from, to] : {std::pair{0, 1}, {0, 2}, {1, 2}}) {
      shape.sides.push_back({first + from, first + to});
      const Eigen::Vector2d along = shape.material_m[first + to] - shape.material_m[first + from];
      shape.of_sides.emplace_back((-along.y() * u + along.x() * v) / (0.1 * along.norm()));
    }
  }
  /// The surface with the midpoints of the edges halfway between the corners.
  [[nodiscard]] checker::MeshSurface surface() const {
    std::vector<checker::Quadratic> flat;
    for (int t = 0; t < static_cast<int>(rest.shape.triangles.size()); ++t)
      flat.push_back({0.005L,
                      {3 * t, 3 * t + 1, 3 * t + 2, 3 * t + 2, 3 * t + 1, 3 * t},
                      std::vector<checker::Real>(6),
                      std::vector<checker::Real>(6),
                      std::vector<checker::Real>(6)});
    return {rest, flat};
  }
};

TEST(MeshRest, ClothThroughClothIsFound) {
  Pieces pieces;
  pieces.add({0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0});
  pieces.add({0.02, 0.02, -0.03}, {0, 0, 0.1}, {0.02, 0.02, 0});
  EXPECT_GT(judge_mesh(pieces.rest).crossings, 0);
  for (int i = 3; i < 6; ++i) pieces.rest.shape.points_m[i].x() += 1;
  EXPECT_EQ(judge_mesh(pieces.rest).crossings, 0);
}

TEST(MeshRest, CrossingsDoNotDependOnThePlace) {
  std::mt19937 engine(1);
  const auto random = [&] {
    const auto one = [&] { return 0.1 * (static_cast<double>(engine()) / 4294967295 - 0.5); };
    const double x = one(), y = one(), z = one();
    return Eigen::Vector3d(x, y, z);
  };
  Pieces pieces;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d corner = random(), u = random(), v = random();
    pieces.add(corner, u, v);
  }
  const int crossings = pieces.surface().crossings();
  EXPECT_GT(crossings, 100);
  for (Eigen::Vector3d& p : pieces.rest.shape.points_m) p += Eigen::Vector3d(0.37, -0.11, 0.05);
  EXPECT_EQ(pieces.surface().crossings(), crossings);
  pieces.add({9, 9, 9}, {1, 0, 0}, {0, 1, 0});
  EXPECT_EQ(pieces.surface().crossings(), crossings) << "with a lattice ten times as wide";
}

/// A flat triangle 1 um above the table, and another 0.4 mm above it, with stated forces on them.
/// Nodes 6, 7, 8 and 9, 10, 11 are the midpoints of their edges (0, 1), (0, 2), (1, 2).
class StatedForces : public testing::Test {
 protected:
  StatedForces() {
    scene_.table_z_m = 0;
    pieces_.rest.layers_apart_m = 0.5e-3;
    for (const double z_m : {1e-6, 0.401e-3}) pieces_.add({0, 0, z_m}, {0.1, 0, 0}, {0, 0.1, 0});
  }
  /// Force on a point; nullopt if the stated one is refused.
  [[nodiscard]] std::optional<Eigen::Vector3d> on(int point, const ContactForce& stated,
                                                  double friction = 0) {
    scene_.friction = friction;
    std::vector<checker::Point> points(6), sides(6);
    if (!pieces_.surface().add(checker::Objects(scene_), stated, points, sides))
      return std::nullopt;
    const checker::Point& f = points[point];
    return Eigen::Vector3d(double(f[0]), double(f[1]), double(f[2]));
  }

  Scene scene_;
  Pieces pieces_;
};

TEST_F(StatedForces, OfObjectsAreCutToWhatContactCanDo) {
  ContactForce push{0, {0, 0, 0, 0}, {1, 0, 0, 0}, {0, 0, 2}};
  EXPECT_EQ(on(0, push)->z(), 2);
  push.force_in_world = {1, 0, 2};
  EXPECT_LT(on(0, push)->x(), 1e-6) << "slippery";
  EXPECT_NEAR(on(0, push, 0.25)->x(), 0.5, 1e-6) << "in the cone";
  push.force_in_world = {0, 0, -2};
  EXPECT_EQ(on(0, push, 0.25)->z(), 0) << "objects do not pull";
}

TEST_F(StatedForces, OfObjectsActOnPlacesThatTouch) {
  // Corner 1 and the midpoints of its edges form a facet.
  const ContactForce in_facet{0, {1, 6, 8, 1}, {0.5, 0.25, 0.25, 0}, {0, 0, 4}};
  EXPECT_NEAR(on(1, in_facet)->z(), 3, 1e-12);
  EXPECT_NEAR(on(2, in_facet)->z(), 0.5, 1e-12);
  EXPECT_NEAR(on(0, in_facet)->z(), 0.5, 1e-12);
  const ContactForce refused[] = {
      {0, {0, 1, 1, 1}, {0.5, 0.5, 0, 0}, {0, 0, 4}},   // two corners; their midpoint lies between
      {0, {0, 3, 3, 3}, {0.5, 0.5, 0, 0}, {0, 0, 4}},   // of two pieces
      {0, {1, 6, 6, 6}, {1.5, -0.5, 0, 0}, {0, 0, 4}},  // outside its nodes
      {0, {1, 6, 6, 6}, {0.5, 0.4, 0, 0}, {0, 0, 4}},   // weights that do not sum to 1
      {0, {12, 12, 12, 12}, {1, 0, 0, 0}, {0, 0, 4}},   // a node that does not exist
      {2, {0, 0, 0, 0}, {1, 0, 0, 0}, {0, 0, 4}},       // an object that does not exist
      {0, {3, 3, 3, 3}, {1, 0, 0, 0}, {0, 0, 4}}};      // too far to touch
  for (const ContactForce& stated : refused) EXPECT_FALSE(on(0, stated));
}

TEST_F(StatedForces, OfLayersAreCutToWhatContactCanDo) {
  // Node 3 is above node 0, a corner of the facet with 6 and 7.
  ContactForce push{1, {3, 0, 6, 7}, {1, -1, 0, 0}, {0, 0, 2}};
  ASSERT_TRUE(on(3, push));
  EXPECT_NEAR(on(3, push)->z(), 2, 1e-12);
  EXPECT_NEAR(on(0, push)->z(), -2, 1e-12);
  push.force_in_world = {1, 0, 2};
  EXPECT_LT(on(3, push)->x(), 1e-9) << "slippery";
  EXPECT_NEAR(on(3, push, 0.25)->x(), 0.5, 1e-9) << "in the cone";
  EXPECT_NEAR(on(0, push, 0.25)->x(), -0.5, 1e-9) << "its opposite";
  push.force_in_world = {0, 0, -2};
  EXPECT_EQ(on(3, push, 0.25)->z(), 0) << "layers do not pull";
}

TEST_F(StatedForces, OfLayersActOnNearestPlacesOfTwo) {
  // The edges 3, 9 and 0, 6 are one above the other.
  EXPECT_TRUE(on(0, {1, {3, 9, 0, 6}, {0.5, 0.5, -0.5, -0.5}, {0, 0, 4}}));
  const ContactForce refused[] = {
      {1, {3, 0, 6, 7}, {1, -0.9, -0.1, 0}, {0, 0, 4}},  // not the nearest point
      {1, {3, 9, 0, 6}, {0.5, 0.5, -0.6, -0.4}, {0, 0, 4}},
      {1, {3, 0, 6, 7}, {1, -0.7, -0.2, 0}, {0, 0, 4}},  // weights that do not sum to 0
      {1, {3, 0, 1, 2}, {1, -1, 0, 0}, {0, 0, 4}},       // corners that do not form a facet
      {1, {0, 0, 6, 7}, {1, -1, 0, 0}, {0, 0, 4}}};      // a node on itself
  for (const ContactForce& stated : refused) EXPECT_FALSE(on(0, stated));
  pieces_.rest.layers_apart_m = 0.3e-3;
  EXPECT_FALSE(on(0, {1, {3, 0, 6, 7}, {1, -1, 0, 0}, {0, 0, 4}})) << "too far to press";
}

/// A long roof whose ridge is along x at z = 0; mm.
constexpr const char* kRoof =
    "v -50 0 0\nv 50 0 0\nv 50 50 -1.5\nv -50 50 -1.5\nv 50 -50 -1.5\nv -50 -50 -1.5\n"
    "v 50 50 -40\nv -50 50 -40\nv 50 -50 -40\nv -50 -50 -40\n"
    "f 1 2 3 4\nf 2 1 6 5\nf 4 3 7 8\nf 5 6 10 9\nf 8 7 9 10\nf 2 5 9 7 3\nf 1 4 8 10 6\n";

// Below a ridge the nearest face, and so the normal, depends on the last bits of the position.
TEST(PushedBy, AtARidgeIsWithinTheConeOfEitherFace) {
  constexpr double kFriction = 0.25, kLength_m = 1e-9;
  const test::TemporaryFolder folder;
  write_durable(folder.path() / "roof.obj", kRoof);
  Scene scene;
  scene.obstacles = {MeshObject{folder.path() / "roof.obj", {}}};
  const checker::Objects objects(scene);
  const double slope = std::atan2(1.5, 50);
  const Eigen::Vector3d normal(0, std::sin(slope), std::cos(slope));
  const Eigen::Vector3d down(0, std::cos(slope), -std::sin(slope));
  const auto kept = [&](double y_m, const Eigen::Vector3d& force_n) {
    const auto found = checker::pushed_by(objects, 0, {0, y_m, -40e-6L}, kFriction, force_n);
    return Eigen::Vector3d(double((*found)[0]), double((*found)[1]), double((*found)[2]));
  };
  const Eigen::Vector3d most = normal + kFriction * down;
  for (const double y_m : {-1e-8, 0.0, 1e-8}) {
    EXPECT_LT((kept(y_m, most) - most).norm(), kLength_m) << y_m;
    // Farther down no face can carry it: the component within the nearest cone remains.
    EXPECT_LT((kept(y_m, normal + 2 * kFriction * down) - most).norm(), kLength_m) << y_m;
  }
  EXPECT_GT((kept(-1e-3, most) - most).norm(), 0.01) << "the other face";
}

}  // namespace
}  // namespace drape::simulate
