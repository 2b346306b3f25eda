// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "core/files.hpp"
#include "core/units.hpp"
#include "simulate/simulate.hpp"
#include "tests/support/paths.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

/// A copy of bench1's fabric A that a test may spoil.
class SpoiledFabric : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::copy(test::source_root() / "rigs/bench1/fabrics", folder_.path(),
             fs::copy_options::recursive);
  }
  void replace(const std::string& file, const std::string& old, const std::string& now) {
    std::string text = read_text(folder_.path() / file);
    const auto place = text.find(old);
    ASSERT_NE(place, std::string::npos) << old;
    text.replace(place, old.size(), now);
    write_durable(folder_.path() / file, text);
  }
  Error error_of() {
    try {
      (void)read_fabric(folder_.path() / "A.toml");
    } catch (const Error& error) {
      return error;
    }
    ADD_FAILURE() << "the fabric was accepted";
    return internal_error("none");
  }
  test::TemporaryFolder folder_;
};

TEST(Fabric, Bench1HasItsMeasuredBendingStiffnessAndDensity) {
  const double stiffness[2] = {7.7e-6, 20.4e-6};
  const double density[2] = {0.138, 0.291};
  for (int k = 0; k < 2; ++k) {
    const Fabric fabric =
        read_fabric(test::source_root() / "rigs/bench1/fabrics" / (k == 0 ? "A.toml" : "B.toml"));
    EXPECT_DOUBLE_EQ(fabric.areal_density_kg_per_m2, density[k]);
    for (const int segments : {1, 5}) {
      SimulateReport report;
      const sim::ClothLaws laws = make_laws(fabric, segments, report);
      for (const auto& bending : laws.bending) {
        EXPECT_NEAR(bending.slope, stiffness[k], 1e-3 * stiffness[k]);
        EXPECT_TRUE(bending.hinges.empty());
      }
      // The same stiffness at 45 degrees: J = 2 B.
      EXPECT_NEAR(laws.twist_n_m, 2 * stiffness[k], 4e-3 * stiffness[k]);
      EXPECT_NEAR(laws.shear.slope, 0.6 * units::gf_per_cm_deg, 1e-3 * 33.7);
      EXPECT_EQ(report.curves.size(), 5u);
    }
    EXPECT_THAT(fabric.stand_ins, ::testing::Contains("tensile curves"));
  }
}

TEST(Fabric, UnitConversionsAgreeWithTheReferenceTable) {
  DRAPE_REQUIRE_REFERENCE(folder, "fabrics");
  const std::string table = read_text(folder / "unit_conversions.csv");
  const auto factor = [&table](const std::string& row) {
    const auto line = table.substr(table.find(row + ","));
    const auto end = line.find('\n');
    return std::stod(line.substr(line.rfind(',', end) + 1, end));
  };
  EXPECT_NEAR(units::gf_per_cm, factor("tension"), 1e-9);
  EXPECT_NEAR(units::gf_per_cm_deg, factor("G"), 1e-7);
  EXPECT_NEAR(units::gf_cm2_per_cm, factor("B"), 1e-12);
  EXPECT_NEAR(units::gf_cm_per_cm, factor("2HB"), 1e-9);
}

TEST_F(SpoiledFabric, NotANumberNamesFileLineAndColumn) {
  replace("A/bending_warp.csv", "-2.4,-0.180944", "-2.4,nan");
  const Error error = error_of();
  EXPECT_EQ(error.kind(), ErrorKind::bad_input);
  EXPECT_THAT(error.where().file, ::testing::HasSubstr("bending_warp.csv"));
  EXPECT_EQ(error.where().line, 5);
  EXPECT_EQ(error.where().field, "loading_moment_gf_cm_per_cm");
}

TEST_F(SpoiledFabric, NegativeDensityNamesTheKey) {
  replace("A.toml", "areal_density_g_per_m2 = 138", "areal_density_g_per_m2 = -138");
  const Error error = error_of();
  EXPECT_EQ(error.where().field, "areal_density_g_per_m2");
  EXPECT_EQ(error.where().line, 5);
}

TEST_F(SpoiledFabric, DensityInKilogramsIsGuessed) {
  replace("A.toml", "areal_density_g_per_m2 = 138", "areal_density_g_per_m2 = 0.138");
  EXPECT_THAT(error_of().what_to_do(), ::testing::HasSubstr("kg/m2"));
}

TEST_F(SpoiledFabric, WrongUnitSuffixInTheTomlIsNamed) {
  replace("A.toml", "areal_density_g_per_m2", "areal_density_kg_per_m2");
  EXPECT_THAT(error_of().what(), ::testing::HasSubstr("areal_density"));
}

TEST_F(SpoiledFabric, WrongUnitInAColumnHeadIsNamed) {
  replace("A/shear_weft.csv", "shear_angle_deg", "shear_angle_rad");
  const Error error = error_of();
  EXPECT_THAT(error.where().file, ::testing::HasSubstr("shear_weft.csv"));
  EXPECT_EQ(error.where().line, 2);
  EXPECT_THAT(error.what_to_do(), ::testing::HasSubstr("shear_angle_deg"));
}

TEST_F(SpoiledFabric, AbscissaThatDoesNotIncreaseNamesTheLine) {
  replace("A/shear_warp.csv", "\n-7.5,", "\n-8.5,");
  const Error error = error_of();
  EXPECT_EQ(error.where().line, 4);
  EXPECT_EQ(error.where().field, "shear_angle_deg");
}

TEST_F(SpoiledFabric, AnglesInRadiansAreGuessed) {
  std::string text = "shear_angle_deg,loading_force_gf_per_cm,unloading_force_gf_per_cm\n";
  for (const char* row : {"-0.14,-4.8,-4.8\n", "0,0.5,-0.5\n", "0.14,4.8,4.8\n"}) text += row;
  write_durable(folder_.path() / "A/shear_warp.csv", text);
  EXPECT_THAT(error_of().what_to_do(), ::testing::HasSubstr("rad"));
}

TEST_F(SpoiledFabric, UnknownKeyIsRefused) {
  replace("A.toml", "[tensile]", "[tensile]\nbias = \"x.csv\"");
  EXPECT_THAT(error_of().what(), ::testing::HasSubstr("bias"));
}

TEST_F(SpoiledFabric, HashCoversTheCurves) {
  const std::string before = fabric_sha256(read_fabric(folder_.path() / "A.toml"));
  replace("A/tensile_weft.csv", "STAND-IN", "stand-in");
  EXPECT_NE(fabric_sha256(read_fabric(folder_.path() / "A.toml")), before);
}

TEST(Merging, LoopsBecomeTheMeanOfTheirBranches) {
  KawabataCurve loop{"", {-2, -1, 0, 1, 2}, {-2, -0.8, 0.2, 1.2, 2}, {-2, -1.2, -0.2, 0.8, 2}};
  const sim::SampledCurve merged = sim::merged_loop(loop);
  for (const double x : {0.0, 0.5, 1.0, 2.0}) EXPECT_NEAR(merged.at(x), x, 1e-12);
  EXPECT_NEAR(sim::half_hysteresis(loop), 0.2, 1e-12);
}

}  // namespace
}  // namespace drape
