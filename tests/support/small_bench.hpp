// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/paths.hpp"

namespace drape::test {

/// Output (both streams) and exit code of a program.
struct Outcome {
  int exit_code = 0;
  std::string text;
};

/// Runs a shell line; the exit code is -1 if a signal ended it.
[[nodiscard]] Outcome run_line(const std::string& line);

/// From now on, processes that a killed program leaves behind become children of this one.
void adopt_descendants();

/// Waits until all children have ended, so that none writes or holds a lock afterwards.
void await_descendants();

struct Measured {};
inline constexpr Measured measured;

/// A copy of rigs/bench1 that a test can change: text files copied, images linked, only 11x11
/// particles and one segment, and the given scenes.
class SmallBench {
 public:
  explicit SmallBench(const std::vector<std::string>& scenes);
  /// The same with `out` already measured and simulated: copies of the steps of finished_bench()
  /// without store and report, so that the next run("out") only makes the comparison.
  SmallBench(const std::vector<std::string>& scenes, Measured);

  [[nodiscard]] const std::filesystem::path& folder() const { return temporary_.path(); }
  [[nodiscard]] std::filesystem::path rig() const { return folder() / "rig"; }
  /// Runs `drape run --single` with the output folder `out` in folder().
  [[nodiscard]] Outcome run(const std::string& out, const std::string& more = "") const;
  /// The shell line of run().
  [[nodiscard]] std::string line(const std::string& out, const std::string& more = "") const;
  /// Replaces text in a file of rig(); throws if the text is not found.
  void replace(const std::string& file, const std::string& from, const std::string& to) const;

 private:
  TemporaryFolder temporary_;
};

/// A SmallBench with all three scenes, completely run, read-only: `rig` and `out` in
/// `folder`.
struct FinishedBench {
  std::filesystem::path folder;
  Outcome outcome;  ///< outcome of the run that made it, or of a later one that found it valid
};

/// Made once for all test programs of a build and kept beside them. Throws if the run fails.
[[nodiscard]] const FinishedBench& finished_bench();
/// Copies its `out` while no other test program looks whether it is valid, which opens its store.
void copy_finished_bench(const std::filesystem::path& to);

}  // namespace drape::test
