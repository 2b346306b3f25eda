// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <time.h>

#include <cstdlib>
#include <numeric>
#include <set>

#include "simulate/study/study.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class Plan : public ::testing::Test {
 protected:
  StudyPlan plan(const fs::path& out, const std::string& more = "") {
    const std::string rig = (test::source_root() / "rigs/paper").string();
    std::vector<std::string> scenes;
    for (const char scene : scenes_)
      scenes.push_back(fmt::format("\"{}/scenes/{}.toml\"", rig, scene));
    write_durable(file_, fmt::format("schema = \"drapebench/plan/1\"\n"
                                     "scenes = [{3}]\n"
                                     "fabrics = [\"{0}/fabrics/A.toml\", \"{0}/fabrics/B.toml\"]\n"
                                     "spacings_mm = [25]\nsegments = [{4}]\nseeds = [{1}]\n{2}",
                                     rig, seeds_, more, fmt::join(scenes, ", "), segments_));
    return read_plan(file_, {}, out, program_);
  }
  std::string csv(const fs::path& out) { return study_csv(plan_status(plan(out))); }
  /// The message if a plan is refused, otherwise the number of its cases.
  std::string refusal(const std::string& more = "") {
    try {
      return fmt::format("{} cases", plan("out", more).cases.size());
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      return error.what();
    }
  }

  std::string seeds_ = "0, 1";
  std::string scenes_ = "A", segments_ = "1";
  test::TemporaryFolder folder_;
  fs::path file_ = folder_.path() / "plan.toml";
  fs::path program_ = fs::read_symlink("/proc/self/exe");
};

TEST_F(Plan, NamesEveryCaseByWhatItDependsOn) {
  const StudyPlan two = plan("out");
  ASSERT_EQ(two.cases.size(), 4U);
  std::set<std::string> keys;
  for (const StudyCase& one : two.cases) {
    keys.insert(one.key);
    EXPECT_EQ(one.folder, fs::path("out") / one.key.substr(0, 2) / one.key);
  }
  EXPECT_EQ(keys.size(), 4U);
  const StudyPlan paper = plan("out", "model = \"paper\"\ngrids = [5]\n");
  for (const StudyCase& one : paper.cases) keys.insert(one.key);
  for (const std::string more : {"", "model = \"paper\"\ngrids = [5]\n"})
    for (const StudyCase& one : plan("out", "thickness_mm = 0.25\n" + more).cases)
      EXPECT_FALSE(keys.contains(one.key));
}

TEST_F(Plan, MultipliesGridsOfThePapersModelBesideTheCloth) {
  const StudyPlan both = plan("out", "model = \"paper\"\ngrids = [5, 7]\n");
  std::vector<std::string> names;
  for (const StudyCase& one : both.cases) names.push_back(one.discretisation());
  EXPECT_THAT(names, testing::ElementsAre("5x5", "5x5", "7x7", "7x7", "25 mm", "25 mm", "5x5",
                                          "5x5", "7x7", "7x7", "25 mm", "25 mm"));
}

TEST_F(Plan, RefusesKeysOfOlderPlansAndNamesWhatReplacesThem) {
  EXPECT_THAT(refusal("models = [\"consistent\"]\n"),
              AllOf(HasSubstr("plan.toml"), HasSubstr("`models`"), HasSubstr("model = \"paper\"")));
  EXPECT_THAT(refusal("solvers = [\"static\"]\n"), HasSubstr("`solvers`"));
  EXPECT_THAT(refusal("grids = [5]\n"), AllOf(HasSubstr("grids"), HasSubstr("spacings_mm")));
  EXPECT_THAT(refusal("sedes = [3]\n"), HasSubstr("seeds"));
  EXPECT_THAT(refusal("thickness_mm = -1\n"), HasSubstr("thickness_mm"));
}

TEST_F(Plan, RefusesWhatIsListedTwice) {
  EXPECT_EQ(refusal(), "4 cases");
  scenes_ = "AA";
  EXPECT_THAT(refusal(), AllOf(HasSubstr("`scenes`"), HasSubstr("twice")));
  scenes_ = "A";
  seeds_ = "1, 0, 1";
  EXPECT_THAT(refusal(), AllOf(HasSubstr("seeds"), HasSubstr("listed twice")));
  seeds_ = "0";
  segments_ = "1, 5, 1";
  EXPECT_THAT(refusal(), AllOf(HasSubstr("segments"), HasSubstr("listed twice")));
  segments_ = "1";
  EXPECT_THAT(refusal("model = \"paper\"\ngrids = [5, 7, 5]\n"), HasSubstr("listed twice"));
  EXPECT_EQ(refusal(), "2 cases");
  std::string text = read_text(file_);
  write_durable(file_, text.replace(text.find("B.toml"), 6, "A.toml"));
  EXPECT_THROW((void)read_plan(file_, {}, "out", program_), Error) << "one fabric twice";
}

TEST_F(Plan, PartsTogetherAreTheWholeByteForByte) {
  const fs::path whole = folder_.path() / "whole", parts = folder_.path() / "parts";
  const auto computed = run_part(plan(whole), {}, whole);
  EXPECT_EQ(study_csv(computed), csv(whole));
  EXPECT_EQ(run_part(plan(parts), {2, 3}, parts).size(), 1U);
  EXPECT_THAT(csv(parts), HasSubstr(",missing,"));
  (void)run_part(plan(parts), {3, 3}, parts);
  (void)run_part(plan(parts), {1, 3}, parts);
  EXPECT_EQ(csv(parts), csv(whole));
  EXPECT_THAT(csv(whole), testing::Not(HasSubstr("missing")));
  for (const StudyOutcome& again : run_part(plan(parts), {}, parts)) EXPECT_TRUE(again.kept);
  // An interrupted case has no record, so it is computed again, with the same bytes.
  const fs::path cut = plan(parts).cases[0].folder;
  const std::string sheet = read_text(cut / "sheet.json");
  fs::remove(cut / "sheet.run.json");
  write_durable(cut / "sheet.json", sheet.substr(0, 100));
  EXPECT_FALSE(run_part(plan(parts), {}, parts)[0].kept);
  EXPECT_EQ(read_text(cut / "sheet.json"), sheet);
}

TEST_F(Plan, ACaseWhoseFilesAreNotThoseOfItsRecordIsNotDone) {
  const fs::path out = folder_.path() / "out";
  const StudyPlan two = plan(out);
  (void)run_part(two, {}, out);
  const std::string whole = csv(out);
  const fs::path first = two.cases[0].folder, second = two.cases[1].folder;
  const auto is_noticed = [&] {
    const StudyOutcome outcome = plan_status(two)[0];
    return outcome.state == CaseState::failed &&
           outcome.status.find("not those of its record") != std::string::npos;
  };
  ASSERT_NE(read_text(first / "certificate.json"), read_text(second / "certificate.json"));
  fs::copy(second / "certificate.json", first, fs::copy_options::overwrite_existing);
  EXPECT_TRUE(is_noticed()) << "the certificate of another drape";
  (void)run_part(two, {}, out);
  EXPECT_EQ(csv(out), whole);
  for (const char* name : {"sheet.ply", "sheet.json", "levels.json", "sheet.ending.json"}) {
    const std::string bytes = read_text(first / name);
    fs::remove(first / name);
    EXPECT_TRUE(is_noticed()) << name;
    write_durable(first / name, bytes);
  }
  EXPECT_EQ(csv(out), whole);
  fs::copy(second, first, fs::copy_options::overwrite_existing | fs::copy_options::recursive);
  EXPECT_TRUE(is_noticed()) << "another drape, whole";
}

TEST_F(Plan, TheSamePartTwiceAtOnceIsRefused) {
  const fs::path out = folder_.path() / "out";
  const StudyPlan once = plan(out);
  bool refused = false;
  (void)run_part(once, {1, 4}, out, 1, [&](double, const std::string&) {
    try {
      (void)run_part(once, {1, 4}, out);
    } catch (const Error& error) {
      refused = error.kind() == ErrorKind::bad_input;
    }
  });
  EXPECT_TRUE(refused);
  EXPECT_EQ(run_part(once, {1, 4}, out).size(), 1U) << "free again";
}

TEST_F(Plan, AFailedCaseIsNamedAndDoesNotStopTheOthers) {
  const fs::path out = folder_.path() / "out";
  StudyPlan faulty = plan(out);
  faulty.cases[1].fabric_file = "absent.toml";
  const auto outcomes = run_part(faulty, {}, out);
  EXPECT_EQ(outcomes[1].state, CaseState::failed);
  EXPECT_EQ(outcomes[3].state, CaseState::done);
  EXPECT_EQ(plan_status(faulty)[1].state, CaseState::failed);
  EXPECT_THAT(plan_status(faulty)[1].status, HasSubstr("absent.toml"));
}

TEST_F(Plan, ACaseThatCanNeverRunIsNamedBeforeAnyPart) {
  scenes_ = "C";
  const fs::path out = folder_.path() / "out";
  StudyPlan two = plan(out);
  for (const StudyOutcome& one : plan_status(two)) EXPECT_EQ(one.state, CaseState::missing);
  two.cases[0].options.segments = 0;
  const fs::path measured = folder_.path() / "measured.toml";
  std::string scene = read_text(two.cases[2].scene_file);
  const std::string rig = (test::source_root() / "rigs/paper").string();
  const std::size_t start = scene.find("[start]"), object = scene.find("[[object]]");
  scene.replace(start, object - start, "[start]\nmode = \"measured\"\n\n");
  while (scene.find("\"../") != std::string::npos) scene.replace(scene.find("\"../") + 1, 2, rig);
  write_durable(measured, scene);
  two.cases[2].scene_file = measured;
  const auto found = plan_status(two);
  EXPECT_EQ(found[0].state, CaseState::impossible);
  EXPECT_EQ(found[1].state, CaseState::missing);
  EXPECT_EQ(found[2].state, CaseState::impossible);
  EXPECT_THAT(found[2].status, HasSubstr("the measured sheet"));
  EXPECT_EQ(found[3].state, CaseState::missing);
  EXPECT_THAT(study_csv(found), HasSubstr(",impossible,"));
  EXPECT_EQ(run_part(two, {1, 4}, out)[0].state, CaseState::failed);
  EXPECT_EQ(plan_status(two)[0].state, CaseState::failed) << "it was tried";
}

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Makes one drape outside a study, with the files and the record that drape-simulate writes.
void drape_alone(const StudyCase& one, const fs::path& folder) {
  RunRecord record("drape-simulate", {}, run_record_path(folder / "sheet.ply"));
  Scene scene = seeded(read_scene(one.scene_file), one.seed);
  scene.fabric_file = one.fabric_file;
  const Fabric fabric = read_fabric(scene.fabric_file);
  for (const fs::path& file : files_of(scene, fabric)) record.input(file);
  write_outputs(folder,
                simulate(scene, fabric, read_print(scene.print_file), std::nullopt, one.options),
                record);
  record.write(0);
}

TEST_F(Plan, TakesAtMostFivePercentOfTheCpuForItself) {
  if (std::getenv("DRAPE_LONG_TESTS") == nullptr) GTEST_SKIP() << "DRAPE_LONG_TESTS is not set";
  // Runs parts of 240 drapes of the study in docs/studies.md in turn with the same drapes alone.
  scenes_ = "ABCDE";
  segments_ = "1, 5";
  std::vector<double> ratios;
  const auto timed = [&](const std::function<void()>& work) {
    const double start_s = cpu_s();
    work();
    return cpu_s() - start_s;
  };
  for (int round = 0; round < 9; ++round) {
    const fs::path alone = folder_.path() / fmt::format("alone-{}", round),
                   study = folder_.path() / fmt::format("study-{}", round);
    std::vector<int> seeds(12);
    std::iota(seeds.begin(), seeds.end(), 12 * round);
    seeds_ = fmt::format("{}", fmt::join(seeds, ", "));
    const StudyPlan cases = plan(alone);
    const double alone_s = timed([&] {
      for (std::size_t i = 0; i < cases.cases.size(); ++i)
        drape_alone(cases.cases[i], alone / std::to_string(i));
    });
    ratios.push_back(timed([&] {
                       (void)run_part(plan(study), {}, study);
                       (void)study_csv(plan_status(plan(study)));
                     }) /
                     alone_s);
  }
  std::sort(ratios.begin(), ratios.end());
  fmt::print("study / drapes alone: median {:.3f} of the CPU time\n", ratios[4]);
  EXPECT_LE(ratios[4], 1.05);
}

TEST(Part, IsReadStrictly) {
  EXPECT_EQ(part_of("3/8").index, 3);
  EXPECT_EQ(part_of("3/8").count, 8);
  for (const char* wrong : {"", "3", "0/8", "9/8", "3/8x", "x/8", "3/", "-1/2"})
    EXPECT_THROW((void)part_of(wrong), Error) << wrong;
}

}  // namespace
}  // namespace drape::simulate
