// SPDX-License-Identifier: Apache-2.0
#include "simulate/certify.hpp"

#include <gtest/gtest.h>

#include "core/units.hpp"
#include "simulate/certify_sheet.hpp"
#include "tests/support/paths.hpp"

namespace drape {
namespace {

using units::mm;

/// A drape of rigs/paper at rest and all that is needed to judge it.
struct Case {
  explicit Case(const std::string& name, const std::string& model)
      : scene(read_scene(test::source_root() / "rigs/paper/scenes" / (name + ".toml"))),
        fabric(read_fabric(scene.fabric_file)),
        print(read_print(scene.print_file)) {
    options.rows = options.cols = 11;
    options.model = model;
    result = simulate(scene, fabric, print, std::nullopt, options);
    claim = claim_of(result, options);
  }
  [[nodiscard]] CertifyReport judge() const {
    return certify(result.sheet, scene, fabric, print, claim);
  }

  Scene scene;
  Fabric fabric;
  Print print;
  SimulateOptions options;
  SimulateResult result;
  CertificateClaim claim;
};

std::string told(const CertifyReport& report) {
  std::string text;
  for (const CertifyLine& line : report.lines) {
    if (!line.passes())
      text += line.what + ": found " + std::to_string(line.found) + " claimed " +
              std::to_string(line.claimed) + " allowed " + std::to_string(line.allowed) + "\n";
  }
  for (const std::string& refusal : report.refusals) text += refusal + "\n";
  return text;
}

TEST(Certify, TrueCertificatesOfTheSphereAndThePinsHold) {
  for (const char* model : {"consistent", "paper"}) {
    for (const char* name : {"A", "D"}) {
      const Case drape(name, model);
      ASSERT_TRUE(drape.claim.at_rest) << name << " " << model;
      const CertifyReport report = drape.judge();
      EXPECT_TRUE(report.accepted()) << name << " " << model << "\n" << told(report);
      EXPECT_GT(report.contacts, 0);
    }
  }
}

TEST(Certify, WrongOnesAreRefused) {
  const Case good("A", "consistent");
  ASSERT_TRUE(good.judge().accepted());
  Case moved = good;
  moved.result.sheet.marks[37].point_in_world.z() += 0.02 * mm;
  EXPECT_FALSE(moved.judge().accepted());
  Case energy = good;
  *energy.claim.bending_j *= 1.001;
  EXPECT_FALSE(energy.judge().accepted());
  Case strain = good;
  strain.claim.warp_most += 1e-6;
  EXPECT_FALSE(strain.judge().accepted());
  Case gap = good;
  gap.claim.deepest_between_m = 0;
  EXPECT_FALSE(gap.judge().accepted());
  Case law = good;
  law.fabric.areal_density_kg_per_m2 *= 1.01;  // heavier than the forces bear
  EXPECT_FALSE(law.judge().accepted());
  Case slippery = good;
  slippery.scene.friction = 0.01;
  EXPECT_FALSE(slippery.judge().accepted());
  Case lost = good;
  lost.result.sheet.marks.pop_back();
  EXPECT_FALSE(lost.judge().accepted());
}

TEST(Certify, AMovingSheetThatClaimsRestIsRefused) {
  Case early("D", "consistent");
  early.options.max_steps = 3000;
  early.result = simulate(early.scene, early.fabric, early.print, std::nullopt, early.options);
  early.claim = claim_of(early.result, early.options);
  ASSERT_FALSE(early.claim.at_rest);
  EXPECT_TRUE(early.judge().accepted()) << told(early.judge());  // its numbers are true
  early.claim.at_rest = true;
  early.claim.residual = 1e-4;
  EXPECT_FALSE(early.judge().accepted());
}

}  // namespace
}  // namespace drape
