// SPDX-License-Identifier: Apache-2.0
// Visits the points where a program may die, a disk may fail or the power may go: each call that
// changes a file is numbered, the run is ended (or the call fails) at one of them, and then run
// again. What that second run leaves must be what an undisturbed run leaves: files, tables, and
// `verify` good; a step that was called finished is not made again.
//
//   DRAPE_CRASH_POINTS    points per situation and fault, spread evenly (default 1: the last);
//   `all`
//                         visits every one
//   DRAPE_CRASH_WITH      which faults (default: kill eio enospc time)
//   DRAPE_CRASH_PART      I/N: only every N-th of these points, from the I-th
//   DRAPE_CRASH_PROGRAMS  folder of the programs under test (default: those of this build)
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>

#include "tests/faults/crash_stage.hpp"

namespace drape::test {

void PrintTo(const Situation& situation, std::ostream* out) {
  *out << situation.name;
}

namespace {

namespace fs = std::filesystem;

/// Numbers from 1 to `calls`, always with the last, after which everything is complete.
std::vector<long> points(long calls) {
  const std::string asked = environment("DRAPE_CRASH_POINTS", "1");
  const long count = asked == "all" ? calls : std::min(calls, std::atol(asked.c_str()));
  long part = 1, parts = 1;
  std::sscanf(environment("DRAPE_CRASH_PART", "1/1").c_str(), "%ld/%ld", &part, &parts);
  std::vector<long> chosen;
  for (long i = part; i <= count; i += parts) chosen.push_back(calls * i / count);
  return chosen;
}

/// Counts and prints the points visited and the faults found.
class Visits {
 public:
  explicit Visits(std::string what) : what_(std::move(what)) {}
  ~Visits() { fmt::print("{}: {} visited, {} wrong\n", what_, visited_, wrong_); }
  Visits(const Visits&) = delete;
  Visits& operator=(const Visits&) = delete;
  void add(const std::string& wrong, const std::string& where) {
    ++visited_;
    wrong_ += !wrong.empty();
    EXPECT_EQ(wrong, "") << where;
  }

 private:
  std::string what_;
  int visited_ = 0, wrong_ = 0;
};

class Crash : public testing::TestWithParam<Situation> {};

TEST_P(Crash, LeavesWhatAnUndisturbedRunLeaves) {
  const CrashStage stage(GetParam());
  ASSERT_GT(stage.calls(), 5);
  const std::string asked = environment("DRAPE_CRASH_WITH", "kill eio enospc time");
  for (const std::string with : {"kill", "eio", "enospc"}) {
    if (asked.find(with) == std::string::npos) continue;
    Visits visits(fmt::format("{}, {}, {} calls", GetParam().name, with, stage.calls()));
    std::vector<long> chosen = points(stage.calls());
    // Early enough that steps run in parallel and a full disk stops them together.
    if (chosen.size() == 1 && with == "enospc") chosen.push_back(10);
    for (const long at : chosen)
      visits.add(stage.after_fault(at, with), fmt::format("{} at call {}", with, at));
  }
  if (asked.find("time") == std::string::npos) return;
  Visits visits(fmt::format("{}, kill at any time", GetParam().name));
  const auto count = static_cast<long>(points(1000).size());
  for (long i = 0; i < count; ++i) {
    // Multiples of the golden ratio are evenly spread for any number of them.
    const double time_s = stage.duration_s() * std::fmod(static_cast<double>(i + 1) * 0.618034, 1);
    visits.add(stage.after_kill_at(time_s), fmt::format("{:.3f} s", time_s));
  }
}

/// A separate ext4 file system that loses power.
class PowerCut : public testing::TestWithParam<Situation> {
 protected:
  void SetUp() override {
    const fs::path image = folder_.path() / "image";
    made_ = ::geteuid() == 0 &&
            run_line(fmt::format("truncate -s 64M {0} && mkfs.ext4 -q {0}", image.string()))
                    .exit_code == 0;
    if (!made_) GTEST_SKIP() << "only root with mkfs.ext4 can cut the power of a file system";
  }
  void TearDown() override {
    if (!mounted_) return;
    EXPECT_EQ(run_line("umount " + disk_).exit_code, 0);
  }

  /// Mounts it on the disk of the stage; the kernel does not write back for an hour.
  void mount(const CrashStage& stage) {
    disk_ = stage.disk().string();
    mount_ =
        fmt::format("mount -o loop,commit=3600 {} {}", (folder_.path() / "image").string(), disk_);
    mounted_ = run_line(mount_).exit_code == 0;
    if (!mounted_) GTEST_SKIP() << "this host mounts no file system image";
  }
  [[nodiscard]] std::string remount() const { return "umount " + disk_ + " && " + mount_; }

  TemporaryFolder folder_;
  std::string disk_, mount_;
  bool made_ = false, mounted_ = false;
};

TEST_P(PowerCut, LosesNothingThatWasAcknowledged) {
  const CrashStage stage(GetParam());
  mount(stage);
  if (!mounted_) return;
  Visits visits(fmt::format("{}, power cut, {} calls", GetParam().name, stage.calls()));
  visits.add(stage.after_power_cut(stage.calls() + 1, true, remount()), "after the end");
  for (const long at : points(stage.calls()))
    visits.add(stage.after_power_cut(at, true, remount()), fmt::format("call {}", at));
  EXPECT_NE(stage.after_power_cut(stage.calls() + 1, false, remount()), "")
      << "where nothing is written through, much is lost";
}

constexpr auto name_of = [](const auto& tested) { return tested.param.name; };
INSTANTIATE_TEST_SUITE_P(Every, Crash, testing::ValuesIn(situations()), name_of);
INSTANTIATE_TEST_SUITE_P(Command, Crash, testing::ValuesIn(single_commands()), name_of);
INSTANTIATE_TEST_SUITE_P(Every, PowerCut, testing::ValuesIn(situations()), name_of);

}  // namespace
}  // namespace drape::test
