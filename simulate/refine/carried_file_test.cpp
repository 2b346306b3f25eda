// SPDX-License-Identifier: Apache-2.0
// A rest that is carried over by the programs. Whether a sheet stalls hangs on its last digits, so
// this one goes through its files.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "simulate/equilibrium/solver.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;

int run(const std::string& name, const std::string& words) {
  return std::system(
      fmt::format("{} {} --quiet > /dev/null 2>&1", test::program(name).string(), words).c_str());
}

// Particles entered the cube by turns, less deep than a step looked at, until the solver lost its
// patience and let the sheet fall on.
TEST(RefineFiles, ParticlesThatEnterByTurnsComeToRest) {
  const test::TemporaryFolder folder;
  const fs::path scene = test::source_root() / "rigs/paper/scenes/C.toml";
  const fs::path coarse = folder.path() / "coarse", fine = folder.path() / "fine";
  ASSERT_EQ(run("drape-simulate",
                fmt::format("{} --grid 22 --threads 1 --out {}", scene.string(), coarse.string())),
            0);
  ASSERT_EQ(run("drape-simulate refine",
                fmt::format("{} --scene {} --finest 31 --goal-mm 0.001 --threads 1 --out {}",
                            coarse.string(), scene.string(), fine.string())),
            0);
  const auto grid = parse_json(read_text(fine / "refinement.json"))["grids"][0];
  EXPECT_TRUE(grid["at_rest"]);
  EXPECT_LT(grid["steps"], StaticOptions{}.patience);
}

}  // namespace
}  // namespace drape::simulate
