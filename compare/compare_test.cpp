// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>

#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

using test::drape_of;
using test::measured_sheet;
using test::simulated_sheet;
using testing::ElementsAre;
using testing::HasSubstr;
using units::mm;

test::Shape raised_by(double height_m) {
  return [height_m](const Eigen::Vector2d& m) -> Eigen::Vector3d {
    return test::flat(m) + Eigen::Vector3d(0, 0, height_m);
  };
}

std::vector<std::string> labels(const Report& report) {
  std::vector<std::string> list;
  for (const VirtualVirtual& row : report.virtual_virtual) list.push_back(row.label);
  return list;
}

DrapeInput full_input() {
  std::vector<Sheet> simulated;
  for (const int grid : {11, 21, 31})
    for (const int segments : {1, 5})
      simulated.push_back(simulated_sheet(grid, segments, raised_by((grid + segments) * mm)));
  return drape_of(measured_sheet(), simulated);
}

std::string refusal_of(const DrapeInput& input) {
  try {
    (void)compare_drape(input, {});
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }
  return "nothing was refused";
}

TEST(CompareDrape, RealRowsStandInTheOrderOfThePaper) {
  const DrapeInput input = full_input();
  const Report report = compare_drape(input, {});
  std::vector<std::string> rows;
  for (const RealVirtual& row : report.real_virtual)
    rows.push_back(input.simulations[row.simulation].label());
  EXPECT_THAT(rows, ElementsAre("31x31, 5 segments", "21x21, 5 segments", "11x11, 5 segments",
                                "31x31, 1 segment", "21x21, 1 segment", "11x11, 1 segment"));
  ASSERT_TRUE(report.headline);
  EXPECT_EQ(*report.headline, 0U) << "the finest grid with five segments, not the smallest mean";
  EXPECT_NEAR(report.real_virtual[5].statistics.mean_m, 12 * mm, 1e-12);
  EXPECT_TRUE(report.go());
}

TEST(CompareDrape, VirtualPairsAreThoseOfThePaperAndNoOthers) {
  const Report report = compare_drape(full_input(), {});
  EXPECT_THAT(labels(report),
              ElementsAre("11x11: 5 seg vs 1 seg", "21x21: 5 seg vs 1 seg", "31x31: 5 seg vs 1 seg",
                          "1 seg: 11x11 vs 21x21", "5 seg: 11x11 vs 21x21", "5 seg: 11x11 vs 31x31",
                          "5 seg: 21x21 vs 31x31"));
  const std::vector<double> expected_mm = {4, 4, 4, 10, 10, 20, 10};
  for (std::size_t i = 0; i < expected_mm.size(); ++i) {
    EXPECT_NEAR(report.virtual_virtual[i].statistics.mean_m, expected_mm[i] * mm, 1e-12);
    EXPECT_EQ(report.virtual_virtual[i].statistics.marks, 121);
  }
}

TEST(CompareDrape, VirtualPairsUseTheGapsOfTheLatticeToo) {
  DrapeInput input = full_input();
  auto& marks = input.measured.sheet.marks;
  for (int i = 0; i < 40; ++i) {
    input.measured.sheet.gaps.push_back({marks.front().mark, "hidden"});
    marks.erase(marks.begin());
  }
  const Report report = compare_drape(input, {});
  EXPECT_TRUE(report.lattice_has_gaps_filled);
  EXPECT_EQ(report.virtual_virtual.front().statistics.marks, 121);
  EXPECT_EQ(report.real_virtual.front().statistics.marks, 81);
  EXPECT_EQ(report.measurement.gaps, 40);
}

TEST(CompareDrape, OtherGridsHaveNoPairs) {
  const Report report = compare_drape(
      drape_of(measured_sheet(), {simulated_sheet(15, 1), simulated_sheet(15, 5)}), {});
  EXPECT_TRUE(report.virtual_virtual.empty());
  EXPECT_EQ(report.real_virtual.size(), 2U);
}

TEST(CompareDrape, PairsDoNotMixModels) {
  Sheet paper = simulated_sheet(11, 1);
  std::get<SimulatedSource>(paper.source).model = "paper";
  const Report report =
      compare_drape(drape_of(measured_sheet(), {simulated_sheet(11, 5), paper}), {});
  EXPECT_TRUE(report.virtual_virtual.empty());
}

TEST(CompareDrape, RefusesWhatDoesNotBelongTogether) {
  Sheet other_scene = simulated_sheet(21, 5), other_patch = simulated_sheet(21, 5);
  std::get<SimulatedSource>(other_scene.source).scene = "C";
  other_patch.patch_m.x() = 200 * mm;
  EXPECT_THAT(refusal_of(drape_of(measured_sheet(), {simulated_sheet(11, 5), other_scene})),
              HasSubstr("scene `C`"));
  EXPECT_THAT(refusal_of(drape_of(measured_sheet(), {other_patch})), HasSubstr("patch"));
  EXPECT_THAT(
      refusal_of(drape_of(measured_sheet(), {simulated_sheet(11, 5), simulated_sheet(11, 5)})),
      HasSubstr("given twice"));
  Sheet empty = measured_sheet();
  empty.marks.clear();
  EXPECT_THAT(compare_drape(drape_of(empty, {simulated_sheet(11, 5)}), {}).no_go,
              testing::ElementsAre("the measured sheet has no mark"))
      << "a drape that is NO-GO keeps no other from being compared";
}

SimulatedSource& source_of(Simulation& simulation) {
  return std::get<SimulatedSource>(simulation.sheet.sheet.source);
}

/// One grid with two fabrics, and a finer one with the second.
DrapeInput of_two_fabrics() {
  DrapeInput input = drape_of(measured_sheet(), {simulated_sheet(21, 5, raised_by(5 * mm)),
                                                 simulated_sheet(21, 5, raised_by(7 * mm)),
                                                 simulated_sheet(31, 5, raised_by(6 * mm))});
  for (const std::size_t i : {1U, 2U}) {
    source_of(input.simulations[i]).fabric = "another";
    source_of(input.simulations[i]).fabric_sha256 = std::string(64, 'f');
  }
  return input;
}

std::string headline_label(const DrapeInput& input) {
  const Report report = compare_drape(input, {});
  return input.simulations[report.real_virtual[*report.headline].simulation].label();
}

TEST(Speaker, DoesNotHangOnTheOrderOfTheArguments) {
  const auto in_both_orders = [](DrapeInput input) {
    tell_apart(input.simulations);
    const std::string label = headline_label(input);
    std::reverse(input.simulations.begin(), input.simulations.end());
    EXPECT_EQ(headline_label(input), label);
    return label;
  };
  DrapeInput input = of_two_fabrics();
  EXPECT_EQ(in_both_orders(input), "31x31, 5 segments, fabric another") << "the finest";
  input.simulations[0].scene = SimulatedScene{"drape_A", {}, 0.4, true};
  EXPECT_EQ(in_both_orders(input), "21x21, 5 segments, fabric cotton-like")
      << "the fabric that the scene names";
  input.simulations[0].scene.reset();
  input.simulations.pop_back();
  EXPECT_EQ(in_both_orders(input), "21x21, 5 segments, fabric another") << "by name";
  source_of(input.simulations[1]).fabric = "cotton-like";
  EXPECT_EQ(in_both_orders(input), in_both_orders(input)) << "by hash";
  source_of(input.simulations[1]) = source_of(input.simulations[0]);
  source_of(input.simulations[1]).scene_sha256 = std::string(64, '0');
  EXPECT_THAT(in_both_orders(input), testing::StartsWith("21x21, 5 segments, scene "));
  EXPECT_THAT(in_both_orders(input), testing::Not(HasSubstr("00000000")))
      << "the scene that the marks were asked about";
}

TEST(Speaker, SimulationsOfOneGridHaveNamesOfTheirOwn) {
  DrapeInput input = of_two_fabrics();
  Simulation slippery = input.simulations[0], remembers = input.simulations[0];
  source_of(slippery).scene_sha256 = std::string(64, '0');
  slippery.scene = SimulatedScene{"drape_A", {}, 0.9, true};
  remembers.certificate = Certificate{"c", {{"options.internal_friction", "yes"}}};
  input.simulations.push_back(slippery);
  input.simulations.push_back(remembers);
  tell_apart(input.simulations);
  const Report report = compare_drape(input, {});
  EXPECT_EQ(report.real_virtual.size(), 5U) << "none of them is given twice";
  const Table marks = mark_table(input, report), rows = real_virtual_table(input, report);
  EXPECT_EQ(std::set(marks.names.begin(), marks.names.end()).size(), marks.names.size());
  EXPECT_THAT(rows.names, testing::IsSupersetOf({"fabric", "scene", "internal_friction"}));
  EXPECT_THAT(csv_of(rows), HasSubstr("00000000_friction_0.9"));
  DrapeInput alike = full_input();
  tell_apart(alike.simulations);
  for (const Simulation& one : alike.simulations) EXPECT_EQ(one.apart_text(), "");
}

TEST(Verdict, SimulationNotAtRestIsNoGo) {
  Sheet moving = simulated_sheet(11, 5, raised_by(5 * mm));
  std::get<SimulatedSource>(moving.source).status = "not at rest: 3 mN left";
  const DrapeInput input = drape_of(measured_sheet(), {moving});
  const Report report = compare_drape(input, {});
  ASSERT_EQ(report.no_go.size(), 1U);
  EXPECT_THAT(report.no_go.front(), HasSubstr("3 mN left"));
  const Report accepted = compare_drape(input, {.accept_unsettled = true});
  EXPECT_TRUE(accepted.go());
  EXPECT_THAT(accepted.warnings, ElementsAre(HasSubstr("3 mN left")));
}

TEST(Verdict, FewMarksAreNoGo) {
  DrapeInput input = drape_of(measured_sheet(), {simulated_sheet(11, 5, raised_by(5 * mm))});
  input.measured.sheet.marks.resize(9);
  EXPECT_THAT(compare_drape(input, {}).no_go, ElementsAre(HasSubstr("only 9 marks")));
  EXPECT_TRUE(compare_drape(input, {.min_marks = 9}).go());
}

TEST(Verdict, UnknownUncertaintyIsNoGo) {
  DrapeInput input = drape_of(measured_sheet(), {simulated_sheet(11, 5, raised_by(5 * mm))});
  input.measured.sheet.marks[3].covariance_m2.reset();
  EXPECT_THAT(compare_drape(input, {}).no_go, ElementsAre(HasSubstr("no covariance")));
}

TEST(CompareDrape, AnotherSimulatorStandsBesideAndIsNotTheBest) {
  Sheet other = simulated_sheet(23, 5);  // exactly the real cloth
  std::get<SimulatedSource>(other.source).status = "as exported";
  DrapeInput input = drape_of(measured_sheet(), {simulated_sheet(11, 5, raised_by(5 * mm)), other});
  input.simulations[1].other_simulator = "Other 1.0";
  const Report report = compare_drape(input, {});
  ASSERT_EQ(report.real_virtual.size(), 2U);
  ASSERT_TRUE(report.headline);
  EXPECT_EQ(input.simulations[report.real_virtual[*report.headline].simulation].label(),
            "11x11, 5 segments");
  EXPECT_TRUE(report.go()) << "another program need not state that it is at rest";
  EXPECT_TRUE(report.virtual_virtual.empty());
}

TEST(CompareDrape, AlignmentIsReportedBesideAndNeverApplied) {
  const Report report =
      compare_drape(drape_of(measured_sheet(), {simulated_sheet(11, 5, raised_by(5 * mm))}), {});
  const RealVirtual& row = report.real_virtual.front();
  EXPECT_NEAR(row.statistics.mean_m, 5 * mm, 1e-12);
  ASSERT_TRUE(row.aligned);
  EXPECT_NEAR(row.aligned->centroid_shift_m, 5 * mm, 1e-12);
  EXPECT_NEAR(row.aligned->after.mean_m, 0, 1e-12);
  EXPECT_NEAR(row.normal.mean_m, -5 * mm, 1e-12) << "the real cloth lies below the printed side";
  EXPECT_NEAR(row.to_surface.mean_m, 5 * mm, 1e-12);
}

TEST(Verdict, AnotherStartSheetIsAWarning) {
  Sheet simulated = simulated_sheet(11, 5, raised_by(5 * mm));
  std::get<SimulatedSource>(simulated.source).start_sha256 = std::string(64, 'a');
  DrapeInput input = drape_of(measured_sheet(), {simulated});
  EXPECT_THAT(compare_drape(input, {}).warnings, ElementsAre(HasSubstr("another measured sheet")));
  auto& source = std::get<SimulatedSource>(input.simulations[0].sheet.sheet.source);
  source.start_sha256 = input.measured.sha256;
  EXPECT_TRUE(compare_drape(input, {}).warnings.empty());
}

TEST(Inputs, MeasuredSheetsOpenGroups) {
  const drape::test::TemporaryFolder folder;
  auto files = test::write_example(folder.path() / "A");
  const auto more = test::write_example(folder.path() / "C");
  Sheet other = read_sheet(more[0]);
  std::get<MeasuredSource>(other.source).set = "drape_C";
  write_sheet(more[0], other);
  files.insert(files.end(), more.begin(), more.end());
  const Session session = read_session(files, {});
  ASSERT_EQ(session.drapes.size(), 2U);
  for (const DrapeFiles& drape : session.drapes) {
    EXPECT_EQ(drape.input.simulations.size(), 4U);
    ASSERT_TRUE(drape.input.simulations[0].certificate);
    EXPECT_EQ(drape.input.measured.sha256,
              sha256_of_file(drape.input.measured.file.parent_path() / "sheet.json"));
  }
}

TEST(Inputs, SimulationsWithoutARealClothAreComparedWithEachOtherOnly) {
  const drape::test::TemporaryFolder folder;
  auto files = test::write_example(folder.path());
  files.erase(files.begin());
  const Session session = read_session(files, {});
  EXPECT_TRUE(session.drapes.empty());
  ASSERT_EQ(session.virtual_only.size(), 1U);
  const VirtualGroup group = compare_virtual_group(session.virtual_only.front());
  EXPECT_EQ(group.name, "A");
  ASSERT_EQ(group.pairs.size(), 4U);
  EXPECT_EQ(group.pairs.front().statistics.marks, 121) << "the particles of the coarsest grid";
}

TEST(Inputs, ASheetThatARecordAboveItListsIsWhatItsRunWrote) {
  const drape::test::TemporaryFolder folder;
  const auto files = test::write_example(folder.path());
  const std::filesystem::path place = files[1].parent_path();
  RunRecord record("drape-simulate", {}, run_record_path(place.parent_path() / "branches.json"));
  for (const char* name : {"sheet.ply", "sheet.json", "certificate.json"})
    record.output(place / name);
  record.write(0);
  EXPECT_NO_THROW((void)read_session({files[0], files[1]}, {}));
  write_durable(place / "certificate.json",
                "{\"schema\": \"drapebench/certificate/1\", \"status\": \"another\"}\n");
  try {
    (void)read_session({files[0], files[1]}, {});
    FAIL() << "a certificate of another sheet was read";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("certificate.json"));
  }
}

TEST(Inputs, ACertificateOfAnotherGridIsRefused) {
  const drape::test::TemporaryFolder folder;
  const auto files = test::write_example(folder.path());
  const std::filesystem::path certificate = files[1].parent_path() / "certificate.json";
  for (const char* entry : {"\"options\": {\"rows\": 31}", "\"options\": {\"segments\": 9}",
                            "\"options\": {\"spacing_mm\": 2.5}", "\"at_rest\": false"}) {
    write_durable(certificate,
                  std::string("{\"schema\": \"drapebench/certificate/1\", ") + entry + "}\n");
    try {
      (void)read_session({files[0], files[1]}, {});
      FAIL() << entry;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("one of them is of another run")) << entry;
    }
  }
}

TEST(Inputs, DetectionsOfAnotherSheetAreLeftOut) {
  const drape::test::TemporaryFolder folder;
  const auto files = test::write_example(folder.path());
  write_durable(folder.path() / "detections.json", "{}");
  const Session session = read_session(files, {});
  EXPECT_FALSE(session.drapes.front().detections);
  EXPECT_THAT(session.warnings,
              ElementsAre(HasSubstr("is not the file"), HasSubstr("what made the measured sheet"),
                          HasSubstr("what made 4 of the simulated sheets")));
}

}  // namespace
}  // namespace drape::compare
