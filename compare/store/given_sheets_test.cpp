// SPDX-License-Identifier: Apache-2.0
// Assignment of the sheets of one call to drapes, ensembles and repeats.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using units::mm;

class GivenSheets : public testing::Test {
 protected:
  GivenSheets() : first_(test::write_example(folder_.path() / "A")) {}

  [[nodiscard]] fs::path part_of(const fs::path& name) const {
    return first_[0].parent_path() / name.filename();
  }
  /// The first drape's sheet as another laying, with raised marks; a copy if not raised.
  [[nodiscard]] fs::path laying(const std::string& repeat, double raised_m) const {
    Sheet sheet = read_sheet(first_[0]);
    for (SheetMark& mark : sheet.marks) mark.point_in_world.z() += raised_m;
    fs::path file = folder_.path() / ("laying_" + repeat) / "sheet.ply";
    const fs::path json = fs::path(file).replace_extension(".json");
    if (raised_m == 0) {
      fs::create_directories(file.parent_path());
      for (const fs::path& part : {file, json}) fs::copy_file(part_of(part), part);
    } else {
      write_sheet(file, sheet);
    }
    Json root = parse_json(read_text(json));
    root["source"]["repeat"] = {{"scene", "A"}, {"repeat", repeat}, {"face", ""}};
    write_json(json, root);
    return file;
  }
  /// A list of one branch that was positioned with the first drape's sheet.
  [[nodiscard]] fs::path ensemble(const std::string& name, const std::string& fabric_sha256) const {
    const fs::path list = folder_.path() / name / "branches.json";
    Sheet sheet = test::simulated_sheet(15, 5);
    auto& source = std::get<SimulatedSource>(sheet.source);
    if (!fabric_sha256.empty()) source.fabric_sha256 = fabric_sha256;
    source.start_sha256 = sha256_of_file(fs::path(first_[0]).replace_extension(".json"));
    write_sheet(list.parent_path() / "branch-01" / "sheet.ply", sheet);
    write_json(list, {{"schema", "drapebench/branches/1"},
                      {"scene_round_about_the_vertical", false},
                      {"members_at_rest", 24},
                      {"band", Json::array()},
                      {"measured",
                       {{"nearest_branch", 1},
                        {"branch", 1},
                        {"distance_mm", 1},
                        {"reach_mm", 2},
                        {"started_there", "at rest"}}},
                      {"branches",
                       {{{"branch", 1},
                         {"sheet", "branch-01/sheet.ply"},
                         {"energy_uJ", name.size()},
                         {"largest_residual_per_particle_weight", 1e-9},
                         {"stable", true},
                         {"starts", {0}},
                         {"hem_nodes", 4}}}}});
    return list.parent_path() / "branch-01" / "sheet.ply";
  }
  static std::string refusal_of(const std::vector<fs::path>& sheets,
                                const std::vector<fs::path>& repeats) {
    try {
      static_cast<void>(read_session(sheets, {}, repeats));
    } catch (const Error& error) {
      return error.what();
    }
    return "none";
  }

  drape::test::TemporaryFolder folder_;
  std::vector<fs::path> first_;
};

TEST_F(GivenSheets, AnEnsembleOfAnotherFabricDoesNotSpeak) {
  const fs::path own = ensemble("own", ""), other = ensemble("other", std::string(64, 'f'));
  const auto judged = [&](const std::vector<fs::path>& branches) {
    std::vector<fs::path> sheets = first_;
    sheets.insert(sheets.end(), branches.begin(), branches.end());
    const Session session = read_session(sheets, {});
    Outcome outcome;
    compare_session(session, {}, outcome);
    const bool placed = session.drapes[0].input.placed.has_value();
    EXPECT_EQ(outcome.reports[0].match.match, Match::none) << "no tolerance";
    return std::pair(placed, outcome.warnings);
  };
  const auto another = Contains(HasSubstr("of another model, fabric or scene"));
  EXPECT_TRUE(judged({own}).first);
  EXPECT_THAT(judged({own}).second, Not(another));
  EXPECT_FALSE(judged({other}).first);
  EXPECT_THAT(judged({other}).second, another);
  EXPECT_TRUE(judged({other, own}).first) << "whichever was given first";
  EXPECT_THAT(judged({other, own}).second, another);
}

TEST_F(GivenSheets, ABranchOfAnEarlierRunIsNoSimulation) {
  const fs::path branch = ensemble("own", ""),
                 stale = branch.parent_path() / "../branch-02/sheet.ply";
  write_sheet(stale, read_sheet(first_[1]));
  EXPECT_EQ(refusal_of({first_[0], branch}, {}), "none");
  EXPECT_THAT(refusal_of({first_[0], branch, stale}, {}), HasSubstr("does not name it"));
  RunRecord record("drape-simulate", {}, run_record_path(stale));
  record.output(stale);
  record.write(0);
  EXPECT_EQ(refusal_of({first_[0], branch, stale}, {}), "none") << "another program's own";
}

TEST_F(GivenSheets, ALayingOverAnObjectThatMovedIsLeftOut) {
  const auto asked_at = [&](const fs::path& sheet, const std::string& x_mm) {
    const fs::path json = fs::path(sheet).replace_extension(".json");
    Json root = parse_json(read_text(json));
    root["source"]["asked_scene"] = {{"name", "A"},
                                     {"sha256", std::string(64, 'a')},
                                     {"surroundings", {{"object.1.x_mm", x_mm}}}};
    write_json(json, root);
    return sheet;
  };
  asked_at(first_[0], "4");
  const fs::path second = asked_at(laying("2", 1 * mm), "4"),
                 moved = asked_at(laying("3", 2 * mm), "20");
  Outcome outcome;
  compare_session(read_session(first_, {}, {second, moved}), {}, outcome);
  const std::vector<RepeatLine>& lines = outcome.reports[0].repeats;
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[1].left_out, "");
  EXPECT_THAT(lines[2].left_out, HasSubstr("object.1.x_mm is 20 in its scene, 4 for the marks"));
  const SheetFile own = read_sheet_file(first_[0]);
  EXPECT_THAT(moved_objects({own, read_sheet_file(second)}, {}), testing::IsEmpty());
  EXPECT_THAT(moved_objects({own, read_sheet_file(moved)}, {read_sheet_file(first_[1])}),
              ElementsAre(HasSubstr("object.1.x_mm"), HasSubstr("is not there as simulated")));
}

TEST_F(GivenSheets, ARepeatIsOneOfEveryDrapeOfItsScene) {
  const fs::path second = laying("2", 1 * mm), third = laying("3", 2 * mm);
  const std::vector<fs::path> sheets = {first_[0], first_[1], second, first_[2]};
  const auto counts = [&](const std::vector<fs::path>& repeats) {
    const Session session = read_session(sheets, {}, repeats);
    return std::pair(session.drapes[0].input.repeats.size(),
                     session.drapes[1].input.repeats.size());
  };
  EXPECT_EQ(counts({third}), std::pair(std::size_t{1}, std::size_t{1}));
  EXPECT_EQ(counts({third, second}), std::pair(std::size_t{2}, std::size_t{1}))
      << "its own sheet is no other laying of it";
  EXPECT_THAT(refusal_of({second, first_[2]}, {second}), HasSubstr("given twice"));
}

TEST_F(GivenSheets, ACopyUnderAnotherNameIsNoRepeat) {
  const fs::path second = laying("2", 1 * mm), copy = laying("copy", 1 * mm);
  EXPECT_EQ(refusal_of(first_, {second}), "none");
  EXPECT_THAT(refusal_of(first_, {second, copy}), HasSubstr("it is a copy of"));
  EXPECT_THAT(refusal_of(first_, {laying("own", 0)}), HasSubstr("it is a copy of"));
}

TEST_F(GivenSheets, DrapesOfOneSceneHaveNamesOfTheirOwn) {
  const std::vector<fs::path> sheets = {first_[0], first_[1],           laying("2", 1 * mm),
                                        first_[2], laying("3", 2 * mm), first_[3]};
  const auto labels = [](const std::vector<fs::path>& files) {
    Outcome outcome;
    compare_session(read_session(files, {}), {}, outcome);
    std::vector<std::string> list;
    for (const Report& report : outcome.reports) list.push_back(report.called());
    return list;
  };
  EXPECT_THAT(labels(sheets), ElementsAre("A", "A (repeat 2)", "A (repeat 3)"));
  EXPECT_THAT(labels(first_), ElementsAre("A"));
  Sheet again = read_sheet(first_[0]);
  again.marks[0].point_in_world.z() += 1 * mm;
  const fs::path file = folder_.path() / "again" / "sheet.ply";
  write_sheet(file, again);
  EXPECT_THAT(labels({first_[0], first_[1], file, first_[2]}),
              ElementsAre(HasSubstr("A (drape_A) (" + first_[0].string()),
                          HasSubstr("A (drape_A) (" + file.string())));
}

/// The record of a simulation leads to its scene, and tells whether it uses the fabric that the
/// scene names.
TEST_F(GivenSheets, TheFabricThatTheSceneNamesIsKnown) {
  const fs::path scene = folder_.path() / "scene.toml", fabric = folder_.path() / "a.toml",
                 other = folder_.path() / "b.toml";
  write_durable(scene,
                "schema = \"drapebench/scene/1\"\nname = \"A\"\nset = \"drape_A\"\n"
                "fabric = \"a.toml\"\nprint = \"p.toml\"\ntable_z_mm = -6.0\n"
                "friction = 0.4\n[start]\nmode = \"measured\"\n[[object]]\nkind = \"sphere\"\n"
                "diameter_mm = 90.0\nx_mm = 0.0\ny_mm = 0.0\nz_bottom_mm = -6.0\n");
  write_durable(fabric, "# a\n");
  write_durable(other, "# b\n");
  for (const std::size_t i : {1U, 2U}) {
    Sheet sheet = read_sheet(first_[i]);
    std::get<SimulatedSource>(sheet.source).scene_sha256 = sha256_of_file(scene);
    write_sheet(first_[i], sheet);
    RunRecord record("drape-simulate", {}, run_record_path(first_[i]));
    for (const fs::path& file : {scene, i == 1 ? fabric : other}) record.input(file);
    record.output(first_[i]);
    record.write(0);
  }
  const DrapeInput input = read_session(first_, {}).drapes[0].input;
  EXPECT_TRUE(input.simulations[0].scene->own_fabric);
  EXPECT_FALSE(input.simulations[1].scene->own_fabric);
  EXPECT_FALSE(input.scene) << "what speaks is of another scene";
  EXPECT_TRUE(read_session({first_[0], first_[2]}, {}).drapes[0].input.scene);
}

}  // namespace
}  // namespace drape::compare
