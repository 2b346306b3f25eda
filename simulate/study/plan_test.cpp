// SPDX-License-Identifier: Apache-2.0
#include "simulate/study/plan.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <time.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <set>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "simulate/ensemble/checked.hpp"
#include "simulate/objects/scene_files.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;

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
                                     "grids = [5]\nsegments = [{4}]\nmodels = [\"consistent\"]\n"
                                     "solvers = [\"static\"]\nseeds = [{1}]\n{2}",
                                     rig, seeds_, more, fmt::join(scenes, ", "), segments_));
    return read_plan(file_, out, program_);
  }
  std::string csv(const fs::path& out) { return plan_csv(plan_status(plan(out))); }

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
  for (const StudyCase& one : two.cases) keys.insert(one.key);
  EXPECT_EQ(keys.size(), 4U);
  const StudyPlan other = plan("out", "max_steps = 7\n");
  for (const StudyCase& one : other.cases) EXPECT_FALSE(keys.contains(one.key));
  EXPECT_THROW((void)plan("out", "sedes = [3]\n"), Error);
  EXPECT_THROW((void)plan("out", "thickness_mm = -1\n"), Error);
}

TEST_F(Plan, WhatIsListedTwiceIsRefusedByItsList) {
  const auto refusal = [&] {
    try {
      return fmt::format("{} cases", plan("out").cases.size());
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      return std::string(error.what());
    }
  };
  const auto both = [](const std::string& a, const std::string& b) {
    return testing::AllOf(testing::HasSubstr(a), testing::HasSubstr(b));
  };
  EXPECT_EQ(refusal(), "4 cases");
  scenes_ = "AA";
  EXPECT_THAT(refusal(), both("`scenes`", "twice"));
  scenes_ = "A";
  seeds_ = "1, 0, 1";
  EXPECT_THAT(refusal(), both("`seeds`", "seed 1 is listed twice"));
  seeds_ = "0";
  segments_ = "1, 5, 1";
  EXPECT_THAT(refusal(), both("plan.toml", "number of segments 1 is listed twice"));
  segments_ = "1";
  EXPECT_EQ(refusal(), "2 cases");
  const std::string text = read_text(file_);
  const auto with = [&](const std::string& from, const std::string& to) {
    write_durable(file_, std::string(text).replace(text.find(from), from.size(), to));
    EXPECT_THROW((void)read_plan(file_, "out", program_), Error) << to;
  };
  with("grids = [5]", "grids = [5, 7, 5]");
  with("models = [\"consistent\"]", "models = [\"consistent\", \"consistent\"]");
  with("B.toml", "A.toml");
}

TEST_F(Plan, PartsTogetherAreTheWholeByteForByte) {
  const fs::path whole = folder_.path() / "whole", parts = folder_.path() / "parts";
  const auto computed = run_part(plan(whole), {}, whole, program_, {});
  EXPECT_EQ(plan_csv(computed), csv(whole));
  const auto second = run_part(plan(parts), {2, 3}, parts, program_, {});
  EXPECT_EQ(second.size(), 1U);
  EXPECT_THAT(csv(parts), testing::HasSubstr(",missing,"));
  (void)run_part(plan(parts), {3, 3}, parts, program_, {});
  (void)run_part(plan(parts), {1, 3}, parts, program_, {});
  EXPECT_EQ(csv(parts), csv(whole));
  EXPECT_THAT(csv(whole), testing::Not(testing::HasSubstr("missing")));
  for (const PlannedOutcome& again : run_part(plan(parts), {}, parts, program_, {}))
    EXPECT_TRUE(again.outcome.kept);
  // A case that was cut off has no record, so it is computed again with the same bytes.
  const fs::path cut = plan(parts).cases[0].folder;
  const std::string sheet = read_text(cut / "sheet.json");
  fs::remove(cut / "sheet.run.json");
  write_durable(cut / "sheet.json", sheet.substr(0, 100));
  EXPECT_FALSE(run_part(plan(parts), {}, parts, program_, {})[0].outcome.kept);
  EXPECT_EQ(read_text(cut / "sheet.json"), sheet);
}

TEST_F(Plan, ACaseWhoseFilesAreNotThoseOfItsRecordIsNotDone) {
  const fs::path out = folder_.path() / "out";
  const StudyPlan two = plan(out);
  (void)run_part(two, {}, out, program_, {});
  const std::string whole = csv(out);
  const fs::path first = two.cases[0].folder, second = two.cases[1].folder;
  const auto is_noticed = [&] {
    const PlannedOutcome planned = plan_status(two)[0];
    return planned.state == CaseState::failed &&
           planned.outcome.sentence.find("not those of its record") != std::string::npos;
  };
  ASSERT_NE(read_text(first / "certificate.json"), read_text(second / "certificate.json"));
  fs::copy(second / "certificate.json", first, fs::copy_options::overwrite_existing);
  EXPECT_TRUE(is_noticed()) << "the certificate of another drape";
  (void)run_part(two, {}, out, program_, {});
  EXPECT_EQ(csv(out), whole);
  for (const char* name : {"sheet.ply", "sheet.json", "history.csv", "sheet.ending.json"}) {
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
  (void)run_part(once, {1, 4}, out, program_, [&](const PlannedOutcome&) {
    try {
      (void)run_part(once, {1, 4}, out, program_, {});
    } catch (const Error& error) {
      refused = error.kind() == ErrorKind::bad_input;
    }
  });
  EXPECT_TRUE(refused);
  EXPECT_EQ(run_part(once, {1, 4}, out, program_, {}).size(), 1U) << "free again";
}

TEST_F(Plan, AFailedCaseIsNamedAndDoesNotStopTheOthers) {
  const fs::path out = folder_.path() / "out";
  StudyPlan faulty = plan(out);
  faulty.cases[1].fabric_file = "absent.toml";
  const auto outcomes = run_part(faulty, {}, out, program_, {});
  EXPECT_EQ(outcomes[1].state, CaseState::failed);
  EXPECT_EQ(outcomes[3].state, CaseState::done);
  EXPECT_EQ(plan_status(faulty)[1].state, CaseState::failed);
  EXPECT_THAT(plan_status(faulty)[1].outcome.sentence, testing::HasSubstr("absent.toml"));
}

/// Before any part of it ran.
TEST_F(Plan, ACaseThatCanNeverRunIsNamedAndNotMissing) {
  scenes_ = "C";
  const fs::path out = folder_.path() / "out";
  const auto stands = [&](const StudyPlan& two) {
    std::vector<std::pair<CaseState, std::string>> found;
    for (const PlannedOutcome& one : plan_status(two))
      found.emplace_back(one.state, one.outcome.sentence);
    return found;
  };
  StudyPlan two = plan(out);
  for (const auto& [state, sentence] : stands(two)) EXPECT_EQ(state, CaseState::missing);
  two.cases[0].model = ClothModel::paper;  // solvers: static alone
  two.cases[1].grid = 2;
  const fs::path measured = folder_.path() / "measured.toml";
  std::string scene = read_text(two.cases[2].scene_file);
  const std::string rig = (test::source_root() / "rigs/paper").string();
  const std::size_t start = scene.find("[start]"), object = scene.find("[[object]]");
  scene.replace(start, object - start, "[start]\nmode = \"measured\"\n\n");
  while (scene.find("\"../") != std::string::npos) scene.replace(scene.find("\"../") + 1, 2, rig);
  write_durable(measured, scene);
  two.cases[2].scene_file = measured;
  const auto found = stands(two);
  for (const int i : {0, 1, 2}) EXPECT_EQ(found[i].first, CaseState::impossible) << i;
  EXPECT_THAT(found[0].second, testing::HasSubstr("static solver"));
  EXPECT_THAT(found[1].second, testing::HasSubstr("the grid is smaller than 3"));
  EXPECT_THAT(found[2].second, testing::HasSubstr("the measured sheet"));
  EXPECT_EQ(found[3].first, CaseState::missing);
  EXPECT_THAT(plan_csv(plan_status(two)), testing::HasSubstr(",impossible,"));
  EXPECT_EQ(run_part(two, {}, out, program_, {})[0].state, CaseState::failed);
  EXPECT_EQ(stands(two)[0].first, CaseState::failed) << "it was tried";
}

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// One drape with the files and the record that drape-simulate leaves, by no part of a study.
void drape_alone(const StudyCase& one, const StudyOptions& study, const fs::path& folder) {
  RunRecord record("drape-simulate", {}, run_record_path(folder / "sheet.ply"));
  SimulateOptions options = study.simulate;
  Scene scene = seeded(read_scene(one.scene_file), one.seed, options.imperfection_m);
  scene.fabric_file = one.fabric_file;
  const Fabric fabric = read_fabric(scene.fabric_file);
  for (const fs::path& file : files_of(scene, fabric)) record.input(file);
  options.rows = options.cols = one.grid;
  options.segments = one.segments;
  options.model = one.model;
  options.solver = study.solvers[0];
  write_outputs(
      folder, simulate_checked(scene, fabric, read_print(scene.print_file), std::nullopt, options),
      options, record);
  record.write(0);
}

TEST_F(Plan, TakesAtMostFivePercentOfTheCpuForItself) {
  if (std::getenv("DRAPE_LONG_TESTS") == nullptr) GTEST_SKIP() << "DRAPE_LONG_TESTS is not set";
  // Parts of 240 drapes of the study in docs/studies.md, seconds each, in turn with the same drapes
  // without the study.
  scenes_ = "ABCDE";
  segments_ = "1, 5";
  constexpr int kRounds = 9;
  std::vector<double> ratios;
  double sums_s[2] = {0, 0};
  const auto timed = [&](double& sum_s, const std::function<void()>& work) {
    const double start_s = cpu_s();
    work();
    const double took_s = cpu_s() - start_s;
    sum_s += took_s;
    return took_s;
  };
  for (int round = 0; round < kRounds; ++round) {
    const fs::path alone = folder_.path() / fmt::format("alone-{}", round),
                   study = folder_.path() / fmt::format("study-{}", round);
    std::vector<int> seeds(12);
    std::iota(seeds.begin(), seeds.end(), 12 * round);
    seeds_ = fmt::format("{}", fmt::join(seeds, ", "));
    const StudyPlan cases = plan(alone);
    const double alone_s = timed(sums_s[0], [&] {
      for (std::size_t i = 0; i < cases.cases.size(); ++i)
        drape_alone(cases.cases[i], cases.options, alone / std::to_string(i));
    });
    const double study_s = timed(sums_s[1], [&] {
      (void)run_part(plan(study), {}, study, program_, {});
      (void)plan_csv(plan_status(plan(study)));
    });
    ratios.push_back(study_s / alone_s);
  }
  std::sort(ratios.begin(), ratios.end());
  const double median = ratios[ratios.size() / 2], whole = sums_s[1] / sums_s[0];
  fmt::print("study / drapes alone: {:.3f} of all CPU time ({:.2f} / {:.2f} s), median {:.3f}\n",
             whole, sums_s[1], sums_s[0], median);
  EXPECT_LE(median, 1.05);
}

TEST(Part, IsReadStrictly) {
  EXPECT_EQ(part_of("3/8").index, 3);
  EXPECT_EQ(part_of("3/8").count, 8);
  for (const char* wrong : {"", "3", "0/8", "9/8", "3/8x", "x/8", "3/", "-1/2"})
    EXPECT_THROW((void)part_of(wrong), Error) << wrong;
}

}  // namespace
}  // namespace drape::simulate
