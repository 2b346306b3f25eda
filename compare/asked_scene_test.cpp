// SPDX-License-Identifier: Apache-2.0
// A simulation is compared with the drape that it simulates, among the objects stated when its
// marks were measured; sheets based on a NO-GO are NO-GO in all programs that read them.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <cstdlib>

#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using test::measured_sheet;
using test::simulated_sheet;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

DrapeInput drape(const std::string& scene = "A") {
  Sheet simulated = simulated_sheet(11, 5, [](const Eigen::Vector2d& material_m) {
    return Eigen::Vector3d(test::flat(material_m) + Eigen::Vector3d(0, 0, 5e-3));
  });
  std::get<SimulatedSource>(simulated.source).scene = scene;
  return test::drape_of(measured_sheet(), {simulated});
}

std::string refusal_of(const DrapeInput& input) {
  try {
    static_cast<void>(compare_drape(input, {}));
  } catch (const Error& error) {
    return error.kind() == ErrorKind::bad_input ? error.what() : "of another kind";
  }
  return "none";
}

TEST(OneDrape, ASimulationOfAnotherSceneAndSetIsRefused) {
  EXPECT_EQ(refusal_of(drape()), "none");
  DrapeInput found = drape("C");
  found.simulations[0].scene = SimulatedScene{"drape_C", {}};
  EXPECT_THAT(refusal_of(found), HasSubstr("frame set `drape_A`"));
  found.measured.asked.reset();
  EXPECT_THAT(refusal_of(found), HasSubstr("frame set `drape_C`"));
}

TEST(OneDrape, ARenamedSceneOrAnotherLayingOfItIsNone) {
  DrapeInput renamed = drape("A_slippery");
  renamed.simulations[0].scene = SimulatedScene{"drape_A", {}};
  EXPECT_EQ(refusal_of(renamed), "none");
  DrapeInput laying = drape();
  std::get<MeasuredSource>(laying.measured.sheet.source).set = "drape_A_2";
  laying.simulations[0].scene = SimulatedScene{"drape_A", {}};
  EXPECT_EQ(refusal_of(laying), "none");
  laying.measured.asked.reset();
  laying.measured.repeat = RepeatId{"A", "2", ""};
  EXPECT_EQ(refusal_of(laying), "none");
}

TEST(OneDrape, AnotherSceneWhoseSetIsNotKnownIsNoGoAndNotRefused) {
  const DrapeInput gone = drape("A_slippery");
  ASSERT_EQ(refusal_of(gone), "none");
  EXPECT_THAT(compare_drape(gone, {}).no_go,
              ElementsAre(HasSubstr("nothing says that scene `A_slippery`")));
  DrapeInput beside = drape("A_slippery");
  beside.simulations[0].scene = SimulatedScene{"drape_A", {}};
  Simulation mesh = drape("A_slippery").simulations[0];
  mesh.other_simulator = "another";
  mesh.sheet.sha256 = std::string(64, 'f');
  std::get<SimulatedSource>(mesh.sheet.sheet.source).model = "another";
  beside.simulations.push_back(mesh);
  ASSERT_EQ(refusal_of(beside), "none");
  EXPECT_THAT(compare_drape(beside, {}).no_go, IsEmpty()) << "a mesh of a scene that is known";
  beside.simulations[0].scene->set = "drape_C";
  EXPECT_THAT(refusal_of(beside), HasSubstr("is another drape"));
}

TEST(OneDrape, WhatAFileDoesNotSayIsNoContradiction) {
  DrapeInput old = drape("C");
  old.measured.asked.reset();
  EXPECT_EQ(refusal_of(old), "none");
  EXPECT_THAT(compare_drape(old, {}).no_go, IsEmpty());
}

TEST(OneDrape, WithoutSimulationsHasTheNameOfTheSceneThatItsMarksWereAskedAbout) {
  DrapeInput alone = test::drape_of(measured_sheet(), {});
  EXPECT_EQ(alone.name(), "A");
  alone.measured.asked.reset();
  EXPECT_EQ(alone.name(), "drape_A");
}

/// Scenes over a mesh, with other values of some keys.
class Scenes : public testing::Test {
 protected:
  Scenes() { write_durable(tent(), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"); }

  [[nodiscard]] fs::path tent() const { return folder_.path() / "tent.obj"; }
  [[nodiscard]] fs::path scene(const std::string& name, const std::string& more = {},
                               const std::string& size = "[128.0, 128.0, 128.0]",
                               const std::string& friction = "0.4") const {
    fs::path file = folder_.path() / (name + ".toml");
    const bool turned = more.find("yaw_deg") != std::string::npos;
    write_durable(file,
                  fmt::format("schema = \"drapebench/scene/1\"\nname = \"A\"\nset = \"drape_A\"\n"
                              "fabric = \"a.toml\"\nprint = \"p.toml\"\ntable_z_mm = -6.0\n"
                              "friction = {}\n[start]\nmode = \"measured\"\n"
                              "[[object]]\nkind = \"box\"\nsize_mm = {}\nx_mm = -3.0\ny_mm = 5.0\n"
                              "z_bottom_mm = -6.0\n{}\n[[object]]\nkind = \"mesh\"\n"
                              "file = \"tent.obj\"\norigin_mm = [0.0, 0.0, 0.0]\n",
                              friction, size, (turned ? "" : "yaw_deg = 0.0\n") + more));
    return file;
  }
  [[nodiscard]] SimulatedScene read(const fs::path& file) const {
    const auto found = read_simulated_scene(file, {{tent(), sha256_of_file(tent())}});
    EXPECT_TRUE(found);
    return found.value_or(SimulatedScene{});
  }
  /// Compares marks measured with the scene `asked` with a simulation of `simulated`.
  [[nodiscard]] Report report_of(const fs::path& asked, const fs::path& simulated) const {
    DrapeInput input = drape();
    input.measured.asked = AskedScene{"A", sha256_of_file(asked), read(asked).surroundings};
    input.simulations[0].scene = read(simulated);
    return compare_drape(input, {});
  }

  drape::test::TemporaryFolder folder_;
};

TEST_F(Scenes, OtherObjectsThanTheMarksWereAskedAboutAreNoGo) {
  const fs::path asked = scene("asked");
  EXPECT_THAT(report_of(asked, scene("wide", "", "[138.0, 128.0, 138.0]")).no_go,
              ElementsAre(HasSubstr("object.1.size_mm is 138, 128, 138 in the simulation, 128, "
                                    "128, 128 for the marks")));
  EXPECT_THAT(report_of(asked, scene("turned", "yaw_deg = 14.0")).no_go,
              ElementsAre(HasSubstr("object.1.yaw_deg is 14 in the simulation, 0")));
  const Report same = report_of(asked, asked);
  EXPECT_THAT(same.no_go, IsEmpty());
  EXPECT_THAT(same.warnings, IsEmpty());
}

TEST_F(Scenes, AStudyOfWhatNoMarkCanTouchRaisesNoAlarm) {
  const fs::path asked = scene("asked");
  for (const Report& report :
       {report_of(asked, scene("slippery", "", "[128.0, 128.0, 128.0]", "0.1")),
        report_of(asked, scene("whole", "", "[128, 128, 128]")),
        report_of(asked, scene("said", "yaw_deg = 0\nedge_radius_mm = 0.0")),
        report_of(asked, scene("unsure", "place_uncertainty_mm = 2.0\non_stand = true"))}) {
    EXPECT_THAT(report.no_go, IsEmpty());
    EXPECT_THAT(report.warnings, IsEmpty());
  }
}

TEST_F(Scenes, AMeshIsComparedByItsContent) {
  const fs::path asked = scene("asked");
  DrapeInput input = drape();
  input.measured.asked = AskedScene{"A", sha256_of_file(asked), read(asked).surroundings};
  const std::string before = sha256_of_file(tent());
  write_durable(tent(), "v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n");
  input.simulations[0].scene = read(asked);
  EXPECT_THAT(compare_drape(input, {}).no_go, ElementsAre(HasSubstr("object.2.file")));
  input.simulations[0].scene = read_simulated_scene(asked, {{tent(), before}});
  EXPECT_THAT(compare_drape(input, {}).no_go, IsEmpty()) << "the mesh that its run read";
  input.simulations[0].scene = read_simulated_scene(asked, {});
  input.measured.asked->sha256 = input.simulations[0].source().scene_sha256;
  const Report unsaid = compare_drape(input, {});
  EXPECT_THAT(unsaid.no_go, IsEmpty());
  EXPECT_THAT(unsaid.warnings, ElementsAre(HasSubstr("no run record names the mesh")));
}

TEST_F(Scenes, AnotherContentThatIsGoneIsNoGo) {
  DrapeInput input = drape();
  EXPECT_THAT(compare_drape(input, {}).no_go, IsEmpty()) << "the very file that was asked about";
  input.measured.asked->sha256 = std::string(64, '0');
  EXPECT_THAT(compare_drape(input, {}).no_go,
              ElementsAre(AllOf(HasSubstr("is not there any more"), HasSubstr("simulate again"))));
  input.measured.asked.reset();
  const Report report = compare_drape(input, {});
  EXPECT_THAT(report.no_go, IsEmpty());
  EXPECT_THAT(report.warnings, ElementsAre(HasSubstr("asked about no scene")));
}

TEST_F(Scenes, AreReadFromTheFilesThatProgramsWrite) {
  const auto files = test::write_example(folder_.path() / "A");
  const fs::path file = scene("asked");
  Sheet simulated = read_sheet(files[1]);
  auto& source = std::get<SimulatedSource>(simulated.source);
  source.scene_sha256 = sha256_of_file(file);
  write_sheet(files[1], simulated);
  RunRecord record("drape-simulate", {}, run_record_path(files[1]));
  record.input(file);
  record.input(tent());
  record.output(files[1]);
  record.write(0);
  const Session session = read_session({files[0], files[1]}, {});
  const DrapeInput& input = session.drapes.at(0).input;
  ASSERT_TRUE(input.measured.asked);
  EXPECT_EQ(input.measured.asked->name, "A");
  ASSERT_TRUE(input.simulations[0].scene);
  EXPECT_EQ(input.simulations[0].scene->set, "drape_A");
  EXPECT_EQ(input.simulations[0].scene->surroundings.at("object.1.x_mm"), "-3");
  // A file of an older version does not name a scene.
  Sheet measured = read_sheet(files[0]);
  std::get<MeasuredSource>(measured.source).asked_scene.reset();
  write_sheet(files[0], measured);
  EXPECT_FALSE(read_sheet_file(files[0]).asked);
}

TEST_F(Scenes, ASheetThatIsNoGoMakesHemsNoGo) {
  const auto files = test::write_example(folder_.path() / "A");
  const fs::path out = folder_.path() / "out";
  const auto run = [&] {
    const int status = std::system(fmt::format("{} drapemeter {} --disc-mm 90 > {} 2>&1",
                                               drape::test::program("drape-compare").string(),
                                               files[1].string(), out.string())
                                       .c_str());
    return std::pair(WEXITSTATUS(status), read_text(out));
  };
  EXPECT_EQ(run().first, 0);
  const auto expect_no_go = [&](const Sheet& sheet, const std::string& why) {
    write_sheet(files[1], sheet);
    const auto [code, text] = run();
    EXPECT_EQ(code, 1) << text;
    EXPECT_THAT(text, HasSubstr("NO-GO: " + files[1].string() + ": " + why)) << "the verdict";
  };
  const Sheet sheet = read_sheet(files[1]);
  Sheet moved = sheet, moving = sheet;
  moved.no_go = "cam1 moved";
  expect_no_go(moved, "what made or placed it is NO-GO: cam1 moved");
  std::get<SimulatedSource>(moving.source).status = "the step limit is reached";
  expect_no_go(moving, "the simulation is not at rest: the step limit is reached");
}

}  // namespace
}  // namespace drape::compare
