// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/certify.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <ostream>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/support/judged_drape.hpp"

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

}  // namespace
}  // namespace drape::simulate
