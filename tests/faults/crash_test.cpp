// SPDX-License-Identifier: Apache-2.0
// Visits the points where a program may die or a disk may fail: each call that changes a file is
// numbered, the run is ended (or the call fails) at one of them, and then run again. What that
// second run leaves must be what an undisturbed run leaves: files, tables, and `verify` good.
//
//   DRAPE_CRASH_POINTS    points per situation, spread evenly (default 2); `all` visits every one
//   DRAPE_CRASH_PROGRAMS  folder of the programs under test (default: those of this build)
#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <regex>

#include "core/files/files.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

std::string environment(const char* name, const std::string& otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : text;
}

std::string drape_line(const std::string& arguments) {
  const fs::path here = program("drape").parent_path();
  const fs::path programs = environment("DRAPE_CRASH_PROGRAMS", here.string());
  return (programs / "drape").string() + " " + arguments;
}

/// One thing that people do, from a folder prepared for it.
struct Situation {
  std::string name;
  std::function<void(const fs::path& folder)> prepare;
  std::string line;   ///< arguments of `drape`, run in that folder
  std::string store;  ///< that the line writes, or empty
};

void PrintTo(const Situation& situation, std::ostream* out) {
  *out << situation.name;
}

Outcome run_in(const fs::path& folder, const std::string& line) {
  return run_line("cd " + folder.string() + " && " + line);
}

void replace_in(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = read_text(file);
  const auto at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error(file.string() + " lacks " + from);
  write_durable(file, text.replace(at, from.size(), to));
}

/// rig/ of a small bench with one drape, its images linked.
void add_rig(const fs::path& folder) {
  const SmallBench bench({"C"});
  fs::copy(bench.rig(), folder / "rig",
           fs::copy_options::recursive | fs::copy_options::copy_symlinks);
}

constexpr const char* kRun = "run rig --out out --threads 1";

void add_finished_run(const fs::path& folder) {
  add_rig(folder);
  const Outcome outcome = run_in(folder, drape_line(kRun));
  if (outcome.exit_code != 0) throw std::runtime_error(outcome.text);
}

constexpr const char* kDensity = "areal_density_g_per_m2 = 138";

std::vector<Situation> situations() {
  return {
      {"first_run", add_rig, kRun, "out/results.sqlite"},
      {"changed_fabric",
       [](const fs::path& folder) {
         add_finished_run(folder);
         replace_in(folder / "rig/fabrics/A.toml", kDensity, "areal_density_g_per_m2 = 150");
       },
       kRun, "out/results.sqlite"},
      {"after_a_failed_run",
       [](const fs::path& folder) {
         add_finished_run(folder);
         const fs::path fabric = folder / "rig/fabrics/A.toml";
         replace_in(fabric, kDensity, "areal_density_g_per_m2 = -1");
         if (run_in(folder, drape_line(kRun)).exit_code != 3)
           throw std::runtime_error("a negative density is bad input");
         replace_in(fabric, "areal_density_g_per_m2 = -1", "areal_density_g_per_m2 = 150");
       },
       kRun, "out/results.sqlite"},
      {"import_of_sheets", add_finished_run, "results import out --store other/results.sqlite",
       "other/results.sqlite"},
      {"import_of_images",
       [](const fs::path& folder) {
         add_rig(folder);
         fs::create_directory(folder / "images");
         for (const char* set : {"stage_z000", "drape_C"})
           fs::copy(fs::canonical(folder / "rig/recording" / set), folder / "images" / set,
                    fs::copy_options::recursive);
       },
       "import images --out recording", ""},
      {"migration",
       [](const fs::path& folder) {
         add_finished_run(folder);
         fs::create_directory(folder / "old");
         SQLite::Database old((folder / "old/results.sqlite").string(),
                              SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
         old.exec(read_text(source_root() / "compare/test_data/store_v3.sql"));
       },
       "results import out --store old/results.sqlite", "old/results.sqlite"},
  };
}

/// Everything a run left that must not depend on its interruptions, by name. Clock times are left
/// out; the bytes of a store depend on its transactions, so its rows stand for it.
std::map<std::string, std::string> traces_of(const fs::path& folder, const Situation& situation) {
  static const std::regex times("\"(started|ended)_utc\": \"[^\"]*\"");
  static const std::regex hashes("sha256\": \"[0-9a-f]*\"");
  static const std::regex counts("[0-9]+ comparisons added, [0-9]+ were there already");
  std::map<std::string, std::string> traces;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().lexically_relative(folder).string();
    const std::string file = entry.path().filename().string();
    if (!entry.is_regular_file() || file.front() == '.' || name.starts_with("rig/")) continue;
    if (file.find(".sqlite") != std::string::npos) continue;
    std::string text = read_text(entry.path());
    if (file.ends_with(".run.json")) text = std::regex_replace(text, times, "");
    if (file.ends_with(".ending.txt")) text = std::regex_replace(text, counts, "");
    // Of the run that made the report: the store among its outputs, the counts in its ending.
    if (file == "report.run.json") text = std::regex_replace(text, hashes, "");
    traces[name] = text;
  }
  if (situation.store.empty()) return traces;
  for (const std::string what : {"export sql", "list", "tables"})
    traces["results " + what] =
        run_in(folder, drape_line("results " + what + " --store " + situation.store)).text;
  return traces;
}

/// Empty when both are the same, else the first difference.
std::string difference(const std::map<std::string, std::string>& found,
                       const std::map<std::string, std::string>& expected) {
  for (const auto& [name, text] : expected) {
    const auto same = found.find(name);
    if (same == found.end()) return name + " is missing";
    if (same->second != text) return name + " differs";
  }
  for (const auto& [name, text] : found)
    if (expected.count(name) == 0) return name + " is too many";
  return {};
}

/// The line of the situation with the fault injected at call `at`; 0 only counts.
std::string faulty(const Situation& situation, const fs::path& counter, long at,
                   const std::string& with) {
  return fmt::format(
      "DRAPE_FAIL_COUNTER={} DRAPE_FAIL_AT={} DRAPE_FAIL_WITH={} LD_PRELOAD={} setsid --wait {}",
      counter.string(), at, with, DRAPE_FAIL_AT_LIBRARY, drape_line(situation.line));
}

long counted(const fs::path& counter) {
  long count = 0;
  std::ifstream(counter, std::ios::binary).read(reinterpret_cast<char*>(&count), sizeof count);
  return count;
}

/// Folders of one situation: as it begins, and as an undisturbed run leaves it.
class Stage {
 public:
  explicit Stage(Situation situation) : situation_(std::move(situation)) {
    fs::create_directory(begin());
    situation_.prepare(begin());
    const fs::path work = fresh();
    write_durable(counter(), std::string(sizeof(long), '\0'));
    const Outcome outcome = run_in(work, faulty(situation_, counter(), 0, "kill"));
    if (outcome.exit_code != 0) throw std::runtime_error(outcome.text);
    calls_ = counted(counter());
    expected_ = traces_of(work, situation_);
  }

  [[nodiscard]] long calls() const { return calls_; }

  /// What is wrong after the call failed or the run died there and was begun again; empty: nothing.
  [[nodiscard]] std::string after_fault(long at, const std::string& with) const {
    const fs::path work = fresh();
    write_durable(counter(), std::string(sizeof(long), '\0'));
    const Outcome faulted = run_in(work, faulty(situation_, counter(), at, with));
    if (with != "kill") {
      if (const std::string wrong = wrong_answer(faulted); !wrong.empty()) return wrong;
    }
    const Outcome again = run_in(work, drape_line(situation_.line));
    if (again.exit_code != 0)
      return fmt::format("second run: exit {}: {}", again.exit_code, again.text);
    const std::string different = difference(traces_of(work, situation_), expected_);
    if (!different.empty()) return different;
    if (situation_.store.empty()) return {};
    const Outcome verified = run_in(work, drape_line("results verify --store " + situation_.store));
    return verified.exit_code == 0 ? "" : "verify: " + verified.text;
  }

 private:
  /// A call that failed is reported in one sentence with exit 3 or 5, or changed nothing.
  [[nodiscard]] static std::string wrong_answer(const Outcome& outcome) {
    const bool known = outcome.exit_code == 0 || outcome.exit_code == 3 || outcome.exit_code == 5;
    if (!known) return fmt::format("exit {}: {}", outcome.exit_code, outcome.text);
    if (outcome.exit_code != 0 && outcome.text.find("error: ") == std::string::npos)
      return fmt::format("exit {} without a sentence: {}", outcome.exit_code, outcome.text);
    return {};
  }

  [[nodiscard]] fs::path begin() const { return folder_.path() / "begin"; }
  [[nodiscard]] fs::path counter() const { return folder_.path() / "counter"; }
  [[nodiscard]] fs::path fresh() const {
    // Of the same depth as begin(), so that relative names in records are the same.
    const fs::path work = folder_.path() / "worka";
    fs::remove_all(work);
    fs::copy(begin(), work, fs::copy_options::recursive | fs::copy_options::copy_symlinks);
    return work;
  }

  Situation situation_;
  TemporaryFolder folder_;
  long calls_ = 0;
  std::map<std::string, std::string> expected_;
};

std::vector<long> points(long calls) {
  const std::string asked = environment("DRAPE_CRASH_POINTS", "2");
  const long count = asked == "all" ? calls : std::min(calls, std::atol(asked.c_str()));
  std::vector<long> chosen;
  // The last call always: between it and the end nothing may be missing.
  for (long i = 1; i <= count; ++i) chosen.push_back(calls * i / count);
  return chosen;
}

class Crash : public testing::TestWithParam<Situation> {
 protected:
  void visit(const std::string& with) {
    const Stage stage(GetParam());
    ASSERT_GT(stage.calls(), 5);
    int bad = 0;
    const std::vector<long> chosen = points(stage.calls());
    for (const long at : chosen) {
      const std::string wrong = stage.after_fault(at, with);
      bad += !wrong.empty();
      EXPECT_EQ(wrong, "") << "at call " << at << " of " << stage.calls();
    }
    fmt::print("{}, {}: {} of {} calls visited, {} wrong\n", GetParam().name, with, chosen.size(),
               stage.calls(), bad);
  }
};

TEST_P(Crash, ARunAfterAKillLeavesWhatAnUndisturbedRunLeaves) {
  visit("kill");
}

TEST_P(Crash, AFailedCallIsSaidAndARunAfterItIsWhole) {
  visit("eio");
}

TEST_P(Crash, AFullDiskIsSaidAndARunWithSpaceIsWhole) {
  visit("enospc");
}

INSTANTIATE_TEST_SUITE_P(Every, Crash, testing::ValuesIn(situations()),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace drape::test
