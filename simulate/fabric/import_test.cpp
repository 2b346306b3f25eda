// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/import.hpp"

#include <gmock/gmock.h>

#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/fabric/fabric.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

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
  template <class Call>
  void expect_refused(const Call& call, int line, const std::string& property) const {
    try {
      call();
      ADD_FAILURE() << "taken: line " << line << ", " << property;
    } catch (const Error& error) {
      EXPECT_EQ(error.where().file, (folder_.path() / "sheet.csv").string()) << error.what();
      EXPECT_EQ(error.where().line, line) << error.what();
      EXPECT_EQ(error.where().field, property) << error.what();
    }
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
  refused(kKes, "B,gf.cm2/cm,0.088", "B,gf.cm2/cm,86.3");          // in dyn cm2/cm
  refused(kKes, "B,gf.cm2/cm,0.088,0.059", "B,gf.cm2/cm,0.088,");  // no weft
  refused(kKes, "2HB,", "HB2,");
  refused(kKes, "W,mg/cm2", "B,gf.cm2/cm");  // twice
}

TEST_F(Import, AFastSheetFollowsItsFormulas) {
  const Fabric fabric = written(import_fast(
      file("property,unit,warp,weft\nW,g/m2,200,\nC,mm,17,16\nE5,%,0.4,0.6\nE20,%,1.1,1.7\n"
           "E100,%,2.9,4.4\nEB5,%,3.1,\n"),
      "wool"));
  // B = 9.81e-6 W C^3 uN m and G = 123 / EB5 N/m, with the rounding of the instruments' charts.
  EXPECT_NEAR(slope(fabric.bending[0]), 9.81e-6 * 200 * 17 * 17 * 17 * 1e-6, 1e-3 * 9.6e-6);
  EXPECT_NEAR(slope(fabric.shear[0]), 123 / 3.1, 0.005 * 40);
  EXPECT_NEAR(fabric.tensile[0].loading.back(), 98.0665, 1e-9);
  EXPECT_NEAR(fabric.tensile[1].x[2], 0.017, 1e-12);
}

const std::string kHead = "property,unit,warp,weft\nW,g/m2,200,\n";
const std::string kBend = "B,gf.cm2/cm,0.088,0.059\n", kLengths = "C,mm,17,16\n";

/// Values of the whole cloth can be in either column, or equal in both.
TEST_F(Import, ValuesOfTheWholeClothAreTakenFromEitherColumnAndNeverChosen) {
  const auto b45 = [&](const std::string& values) {
    return import_kes(file(kHead + kBend + "B45,gf.cm2/cm," + values + "\n"), "x");
  };
  for (const char* values : {"0.05,", ",0.05", "0.05,0.05"}) {
    EXPECT_THAT(b45(values).toml, HasSubstr("bias_stiffness_gf_cm2_per_cm = 0.05\n")) << values;
    EXPECT_THAT(b45(values).stand_ins, Not(Contains(HasSubstr("45")))) << values;
  }
  const ImportedFabric fast = import_fast(file(kHead + kLengths + "C45,mm,,19\n"), "x");
  EXPECT_THAT(fast.toml, HasSubstr("bias_stiffness"));
  expect_refused([&] { (void)b45("0.05,0.09"); }, 4, "B45");
  const std::string two = "property,unit,warp,weft\nW,g/m2,150,300\n";
  expect_refused([&] { (void)import_fast(file(two + kLengths), "x"); }, 2, "W");
  expect_refused([&] { (void)import_kes(file(two + kBend), "x"); }, 2, "W");
  expect_refused([&] { (void)import_kes(file(kHead + kBend + "T,mm,0.5,0.6\n"), "x"); }, 4, "T");
  expect_refused([&] { (void)import_fast(file(kHead + kLengths + "EB5,%,3,6\n"), "x"); }, 4, "EB5");
}

TEST_F(Import, StandInsAreWhatTheSheetDoesNotState) {
  const auto stand_ins = [&](const std::string& rows) {
    return import_kes(file(kHead + kBend + rows), "x").stand_ins;
  };
  const std::string width = "2HG,gf/cm,0.5,0.5\n";
  EXPECT_THAT(stand_ins(width), Not(Contains(HasSubstr("shear hysteresis"))));
  EXPECT_THAT(stand_ins(width), Contains(HasSubstr("shear: G")));
  EXPECT_THAT(stand_ins("2HG5,gf/cm,0.5,0.5\n"), Contains("shear hysteresis: 2HG 0 gf/cm"));
  EXPECT_THAT(stand_ins(""), Contains("shear hysteresis: none"));
  EXPECT_THAT(stand_ins("EMT,%,4,8\nLT,,0.7,0.7\n"), Contains("tensile hysteresis: RT 60 %"));
  EXPECT_THAT(stand_ins("EMT,%,4,8\nLT,,0.7,0.7\nRT,%,55,55\n"),
              Not(Contains(HasSubstr("tensile"))));
  // A curve up to 20 gf/cm counts.
  const ImportedFabric fast =
      import_fast(file(kHead + kLengths + "E5,%,0.4,0.6\nE20,%,1.1,1.7\n"), "x");
  EXPECT_THAT(fast.stand_ins, Not(Contains("tensile curves")));
  EXPECT_THAT(fast.stand_ins, Contains("tensile hysteresis: unloading as loading, nothing above 20 "
                                       "gf/cm"));
  EXPECT_NEAR(written(fast).tensile[1].x.back(), 0.017, 1e-12);
}

/// The files made for it no longer exist, so the line of the sheet is named.
TEST_F(Import, WhatNoTextileHasIsNamedByTheLineOfTheSheet) {
  const auto refused = [&](const ImportedFabric& fabric, int line, const std::string& property) {
    expect_refused([&] { write_imported(folder_.path() / "out", fabric); }, line, property);
    EXPECT_FALSE(std::filesystem::exists(folder_.path() / "out")) << property;
  };
  const auto kes = [&](const std::string& rows) { return import_kes(file(kHead + rows), "x"); };
  const auto fast = [&](const std::string& rows) { return import_fast(file(kHead + rows), "x"); };
  refused(kes(kBend + "LT,,0.7,0.7\n"), 4, "LT");
  refused(kes(kBend + "RT,%,70,70\n"), 4, "RT");
  refused(kes(kBend + "EMT,%,0.04,4\nLT,,0.7,0.7\n"), 4, "EMT");
  refused(kes("# a note\nB,gf.cm2/cm,0.088,86\n"), 4, "B");
  refused(kes(kBend + "B45,gf.cm2/cm,-1,\n"), 4, "B45");
  refused(fast(kLengths + "E5,%,0.4,0.6\nE20,%,1.1,0.3\nE100,%,2.9,4.4\n"), 5, "E20");
  for (const std::string property : {"E5", "E100"})
    expect_refused([&] { (void)fast(kLengths + property + ",%,2.9,4.4\n"); }, 4, property);
  for (const std::string thickness : {"T2,mm,-0.5,", "T100,mm,0,", "T2,mm,0.3,\nT100,mm,0.5,"}) {
    const int line = thickness.starts_with("T2,mm,0.3") ? 5 : 4;
    expect_refused([&] { (void)fast(kLengths + thickness + "\n"); }, line,
                   line == 5 ? "T100" : thickness.substr(0, thickness.find(',')));
  }
  expect_refused([&] { (void)kes(kBend + "T,mm,-0.5,\n"); }, 4, "T");
  expect_refused([&] { (void)fast("C,mm,170,16\n"); }, 3, "C");
  expect_refused([&] { (void)kes("B,gf.cm2/cm,0.088,\n"); }, 3, "B");
}

/// It determines G, in whose units the error would be hard to recognise.
TEST_F(Import, AnExtensionAt45DegreesGivenAsAFractionIsNamedAsOne) {
  const auto refusal = [&](const std::string& eb5) {
    try {
      (void)written(import_fast(file(kHead + kLengths + "EB5,%," + eb5 + ",\n"), "x"));
      ADD_FAILURE() << "taken: " << eb5;
    } catch (const Error& error) {
      EXPECT_EQ(error.where().line, 4) << error.what();
      EXPECT_THAT(error.what_failed(), HasSubstr("EB5 of " + eb5 + " %"));
      return error.what_to_do();
    }
    return std::string();
  };
  EXPECT_EQ(refusal("0.031"), "is it a fraction instead of percent? Then give 3.1");
  EXPECT_THAT(refusal("310"), testing::EndsWith("in percent"));
}

TEST_F(Import, LoopsThatDoNotGoWithTheirSlopesAreWarnedOf) {
  const auto warnings = [&](const std::string& rows) {
    std::filesystem::remove_all(folder_.path() / "out");
    return write_imported(folder_.path() / "out", import_kes(file(kHead + kBend + rows), "x"));
  };
  EXPECT_THAT(warnings("2HB,gf.cm/cm,0.43,0.29\n"), IsEmpty());
  // Half of a loop of 0.45 exceeds 0.088 gf cm2/cm times 2.5 per cm.
  EXPECT_THAT(warnings("2HB,gf.cm/cm,0.45,0.29\n"),
              testing::ElementsAre(HasSubstr("bending.warp_kes: let go at the largest strain")));
  const std::string slope = "G,gf/cm.deg,0.6,0.7\n";
  EXPECT_THAT(warnings(slope + "2HG,gf/cm,0.5,0.5\n2HG5,gf/cm,1.4,0.4\n"),
              testing::ElementsAre(HasSubstr("shear.weft_kes: 2HG 0.5 gf/cm is above 2HG5 0.4")));
  EXPECT_THAT(warnings(slope + "2HG5,gf/cm,5,12\n"),
              testing::ElementsAre(HasSubstr("shear.weft_kes: let go at the largest strain")));
}

TEST_F(Import, ANameIsWrittenAsItIs) {
  const std::string name = "\"A\" \\ b # ' = [x]";
  EXPECT_EQ(written(import_kes(file(kKes), name)).name, name);
  std::filesystem::remove_all(folder_.path() / "out");
  EXPECT_EQ(written(import_kes(file(kKes), "a\x7f\nb")).name, "a  b");
}

/// Numbers that occur for some fabric, but not for one of this density.
TEST_F(Import, NumbersThatDoNotGoWithTheDensityAreRefusedByTheLineOfTheSheet) {
  const auto sheet = [&](const std::string& rows) {
    return file("property,unit,warp,weft\nW,g/m2,138,\n" + rows);
  };
  const auto out = folder_.path() / "out";
  const auto kes = [&](const std::string& rows) {
    return write_imported(out, import_kes(sheet(rows), "x"));
  };
  expect_refused([&] { (void)kes("B,gf.cm2/cm,8.6,5.8\n"); }, 3, "B");  // uN m
  expect_refused([&] { (void)kes(kBend + "B45,gf.cm2/cm,7.2,\n"); }, 4, "B45");
  expect_refused([&] { (void)import_fast(sheet("C,mm,1.7,1.6\n"), "x"); }, 3, "C");  // cm
  expect_refused(
      [&] {
        (void)write_imported(
            out, import_kes(file("property,unit,warp,weft\nW,mg/cm2,138,\n" + kBend), "x"));
      },
      2, "W");
  EXPECT_FALSE(std::filesystem::exists(out));
  // Stiffer than 95 % of fabrics of its weight, and still a fabric.
  EXPECT_THAT(kes("B,gf.cm2/cm,0.9,0.08\n"),
              testing::ElementsAre(HasSubstr("bending.warp: bending stiffness 0.9 gf cm2/cm")));
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
  std::string twice = text;
  twice.insert(twice.find("\"bend\""), R"("mass":"300",)");
  try {
    (void)import_u3m(file(twice), "cupro", "dyn.cm");
    ADD_FAILURE() << "taken: two masses";
  } catch (const Error& error) {
    EXPECT_EQ(error.where().file, (folder_.path() / "sheet.csv").string());
    EXPECT_THAT(error.what(), HasSubstr("`mass` stands twice"));
  }
}

/// A strip of 8 cm by 4 cm: two cycles, the second to 10 % and 400 g, relaxing at half the force.
TEST_F(Import, TheRawStretchOfAFabBecomesTensileCurves) {
  const std::string strip =
      R"({"S2":{"length":8,"width":"4","samplesTree":[[8,2,8.2,52],[8.2,52,8,2],)"
      R"([8,2,8.2,102,8.4,202,8.6,302,8.8,402],[8.8,402,8.4,102,8,2]]}})";
  const std::string text = R"({"schema":"1.1","custom":{"browzwear":{"mass":105.6,)"
                           R"("bend":{"length":43.41,"width":52.85}}},"raw_data":{"L":)" +
                           strip + R"(,"W":)" + strip + "}}";
  const Fabric fabric = written(import_u3m(file(text), "cupro", "dyn.cm"));
  EXPECT_EQ(fabric.tensile[0].x.size(), 25U);
  EXPECT_NEAR(fabric.tensile[0].x.back(), 0.1, 1e-9);
  EXPECT_NEAR(fabric.tensile[1].loading[12] / units::gf_per_cm, 50, 1e-6);
  EXPECT_NEAR(fabric.tensile[1].unloading[12] / units::gf_per_cm, 25, 1e-6);
  EXPECT_THAT(fabric.stand_ins, Not(Contains(HasSubstr("tensile"))));
  for (const auto& [from, to] : {std::pair{"\"width\":\"4\"", "\"width\":0"},
                                 {"[8.2,52,8,2],", ""},
                                 {"8.8,402],", "8.8],"},
                                 {"\"W\":", "\"X\":"}}) {
    std::string wrong = text;
    wrong.replace(wrong.find(from), std::string(from).size(), to);
    EXPECT_THROW((void)import_u3m(file(wrong), "cupro", "dyn.cm"), Error) << to;
  }
}

TEST_F(Import, WholeChartsAreReadAndWhatIsNotUsedIsNamed) {
  const ImportedFabric kes =
      import_kes(file("property,unit,warp,weft\rLT,-,0.62,0.58\rWT,gf\u22c5cm/cm\u00b2,7.1,9.4\r"
                      "RT,%,61,57\rEMT,%,4.58,6.48\rB,gf\u22c5cm\u00b2/cm,0.094,0.071\r"
                      "2HB,gf\u22c5cm/cm,0.041,0.033\rG,gf/cm\u22c5\u00ba,0.62,0.60\r"
                      "2HG,gf/cm,0.9,0.85\r2HG5,gf/cm,1.9,1.8\rLC,-,0.31,0.31\r"
                      "WC,gf\u2219cm/cm\u00b2,0.14,0.14\rRC,%,52,52\rMIU,-,0.162,0.171\r"
                      "MMD,-,0.013,0.016\rSMD,\u00b5m,4.1,5.3\rT,mm,0.48,0.48\r"
                      "W,mg/cm\u00b2,17.2,17.2\r"),
                 "x");
  EXPECT_EQ(kes.unused, "T, LC, WC, RC, MIU, MMD, SMD");
  EXPECT_NEAR(written(kes).areal_density_kg_per_m2, 0.172, 1e-12);
  const ImportedFabric fast = import_fast(
      file("property,unit,warp,weft\nW,g/m\u00b2,172,172\nT2,mm,0.62,0.62\nT100,mm,0.48,0.48\n"
           "C,mm,19.5,17.2\nE5,%,0.6,0.8\nE20,%,1.5,2.0\nE100,%,3.2,4.4\nEB5,%,5.6,5.6\n"
           "ST,mm,0.14,0.14\nB,\u00b5N\u00b7m,12.5,8.6\nG,N/m,22.0,22.0\nF,mm\u00b2,0.38,0.35\n"
           "RS,%,1.2,0.8\nHE,%,4.0,3.6\n"),
      "x");
  EXPECT_EQ(fast.unused, "T2, T100, ST, F, RS, HE, B, G");
}

TEST_F(Import, ThePublishedFabricsAreReadAndThoseWithBendingCanBeSimulated) {
  const auto library = read_published(test::source_root() / "rigs/fabrics/published.csv");
  ASSERT_GE(library.size(), 25U);
  int usable = 0;
  for (const PublishedFabric& fabric : library) {
    EXPECT_FALSE(fabric.source.empty()) << fabric.id;
    const std::filesystem::path folder = folder_.path() / fabric.id;
    if (fabric.areal_density_g_per_m2 && fabric.b_warp_gf_cm2_per_cm) {
      EXPECT_THAT(write_imported(folder, import_published(fabric)), IsEmpty()) << fabric.id;
      ++usable;
      EXPECT_NEAR(slope(read_fabric(folder / "fabric.toml").bending[0]),
                  *fabric.b_warp_gf_cm2_per_cm * units::gf_cm2_per_cm, 1e-12)
          << fabric.id;
    } else {
      EXPECT_THROW((void)import_published(fabric), Error) << fabric.id;
    }
  }
  EXPECT_EQ(usable, 11);
  const PublishedFabric& one_value = published_fabric(library, "matsudaira-A");
  EXPECT_EQ(one_value.drape_coefficient_percent, 82.9);
  EXPECT_THAT(import_published(one_value).stand_ins, Contains("bending: one B for warp and weft"));
  EXPECT_THAT(import_published(published_fabric(library, "feng-0-60")).stand_ins,
              Not(Contains(HasSubstr("one B"))));
}

}  // namespace
}  // namespace drape::simulate
