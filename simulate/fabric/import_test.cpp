// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/import.hpp"

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/fabric/fabric.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

class Import : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path file(const std::string& text) const {
    write_durable(folder_.path() / "sheet.csv", text);
    return folder_.path() / "sheet.csv";
  }
  [[nodiscard]] Fabric written(const ImportedFabric& fabric) const {
    write_imported(folder_.path() / "out", fabric);
    return read_fabric(folder_.path() / "out/fabric.toml");
  }
  [[nodiscard]] static double slope(const KawabataCurve& curve) {
    return fit_line(merged_loop(curve), merged_loop(curve).x.back()).curve.slope;
  }
  test::TemporaryFolder folder_;
};

const std::string kKes =
    "property,unit,warp,weft\nW,mg/cm2,13.8,\nEMT,%,4,8\nLT,-,0.7,0.7\nRT,%,55,55\n"
    "G,gf/cm.deg,0.6,0.7\n2HG,gf/cm,0.5,0.5\n2HG5,gf/cm,1.4,1.4\nB,gf.cm2/cm,0.088,0.059\n"
    "2HB,gf.cm/cm,0.04,0.03\n";

TEST_F(Import, AKesSheetBecomesAFabric) {
  const Fabric fabric = written(import_kes(file(kKes), "cotton"));
  EXPECT_EQ(fabric.name, "cotton");
  EXPECT_NEAR(fabric.areal_density_kg_per_m2, 0.138, 1e-12);
  EXPECT_NEAR(slope(fabric.bending[0]), 0.088 * units::gf_cm2_per_cm, 1e-12);
  EXPECT_NEAR(slope(fabric.bending[1]), 0.059 * units::gf_cm2_per_cm, 1e-12);
  EXPECT_NEAR(slope(fabric.shear[1]), 0.7 * units::gf_per_cm_deg, 1e-9);
  EXPECT_NEAR(fabric.tensile[1].x.back(), 0.08, 1e-12);
  ASSERT_EQ(fabric.stand_ins.size(), 1U);
  EXPECT_EQ(fabric.stand_ins[0], "bending at 45 degrees");
}

TEST_F(Import, OtherUnitsGiveTheSameFabric) {
  const Fabric fabric = written(import_kes(
      file("property,unit,warp,weft\nW,g/m\u00b2,138,\nG,N/(m\u00b7rad),33.71278,39.33158\n"
           "B,\u00b5N\u00b7m,8.629852,5.785924\n2HB,mN,0.392266,0.2941995\n"),
      "cotton"));
  EXPECT_NEAR(fabric.areal_density_kg_per_m2, 0.138, 1e-12);
  EXPECT_NEAR(slope(fabric.bending[0]), 0.088 * units::gf_cm2_per_cm, 1e-12);
  EXPECT_NEAR(slope(fabric.shear[0]), 0.6 * units::gf_per_cm_deg, 1e-5);
}

TEST_F(Import, WrongUnitsAndValuesAreRefusedAndLeaveNothing) {
  const auto refused = [&](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    std::filesystem::remove_all(folder_.path() / "out");
    EXPECT_THROW(write_imported(folder_.path() / "out", import_kes(file(text), "x")), Error) << to;
    EXPECT_FALSE(std::filesystem::exists(folder_.path() / "out")) << to;
  };
  refused(kKes, "W,mg/cm2", "W,oz/yd2");
  refused(kKes, "B,gf.cm2/cm,0.088", "B,gf.cm2/cm,86.3");          // it was dyn cm2/cm
  refused(kKes, "B,gf.cm2/cm,0.088,0.059", "B,gf.cm2/cm,0.088,");  // no weft
  refused(kKes, "2HB,", "HB2,");
  refused(kKes, "W,mg/cm2", "B,gf.cm2/cm");  // twice
}

TEST_F(Import, AFastSheetFollowsItsFormulas) {
  const Fabric fabric = written(import_fast(
      file("property,unit,warp,weft\nW,g/m2,200,\nC,mm,17,16\nE5,%,0.4,0.6\nE20,%,1.1,1.7\n"
           "E100,%,2.9,4.4\nEB5,%,3.1,\n"),
      "wool"));
  // B = 9.81e-6 W C^3 uN m and G = 123 / EB5 N/m, as the instruments' charts round them.
  EXPECT_NEAR(slope(fabric.bending[0]), 9.81e-6 * 200 * 17 * 17 * 17 * 1e-6, 1e-3 * 9.6e-6);
  EXPECT_NEAR(slope(fabric.shear[0]), 123 / 3.1, 0.005 * 40);
  EXPECT_NEAR(fabric.tensile[0].loading.back(), 98.0665, 1e-9);
  EXPECT_NEAR(fabric.tensile[1].x[2], 0.017, 1e-12);
}

TEST_F(Import, U3mPhysicsNeedAUnit) {
  const std::string text =
      R"({"schema":"1.1","raw_data":null,"custom":{"browzwear":{"mass":"105.6",)"
      R"("bend":{"length":"43.41","width":52.85}}}})";
  const Fabric fabric = written(import_u3m(file(text), "cupro", "dyn.cm"));
  EXPECT_NEAR(slope(fabric.bending[0]), 43.41e-7, 1e-12);
  EXPECT_NEAR(slope(fabric.bending[1]), 52.85e-7, 1e-12);
  EXPECT_GE(fabric.stand_ins.size(), 4U);
  EXPECT_THROW((void)import_u3m(file(text), "cupro", "stone"), Error);
  EXPECT_THROW((void)import_u3m(file("{}"), "cupro", "dyn.cm"), Error);
}

TEST_F(Import, ThePublishedFabricsAreReadAndThoseWithBendingCanBeSimulated) {
  const auto library = read_published(test::source_root() / "rigs/fabrics/published.csv");
  ASSERT_GE(library.size(), 25U);
  int usable = 0;
  for (const PublishedFabric& fabric : library) {
    EXPECT_FALSE(fabric.source.empty()) << fabric.id;
    const std::filesystem::path folder = folder_.path() / fabric.id;
    if (fabric.areal_density_g_per_m2 && fabric.b_warp_gf_cm2_per_cm) {
      write_imported(folder, import_published(fabric));
      ++usable;
      EXPECT_NEAR(slope(read_fabric(folder / "fabric.toml").bending[0]),
                  *fabric.b_warp_gf_cm2_per_cm * units::gf_cm2_per_cm, 1e-12)
          << fabric.id;
    } else {
      EXPECT_THROW((void)import_published(fabric), Error) << fabric.id;
    }
  }
  EXPECT_EQ(usable, 11);
  EXPECT_EQ(published_fabric(library, "matsudaira-A").drape_coefficient_percent, 82.9);
}

}  // namespace
}  // namespace drape::simulate
