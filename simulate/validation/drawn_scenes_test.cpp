// SPDX-License-Identifier: Apache-2.0
// Random scenes, and the checker's verdict on their rests.
#include <gtest/gtest.h>

#include <cstdio>

#include "simulate/simulate.hpp"
#include "simulate/validation/test_drawn_scenes.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"

namespace drape::simulate {
namespace {

/// At least 98 in 100 are at rest and accepted; none that the checker refuses is called at rest.
TEST(DrawnScenes, AreCertified) {
  const int first = test::first_trial(), end = test::trial_count(7, 300), count = end - first;
  ASSERT_GT(count, 0);
  const test::TemporaryFolder folder;
  int certified = 0;
  for (int index = first; index < end; ++index) {
    const DrawnScene drawn = drawn_scene(index, folder.path());
    const DrapeCase drape = drape_case(drawn.scene, drawn.print, std::nullopt, drawn.laws);
    DrapeOptions options;
    options.spacing_m = 5 * units::mm;
    const Drape found = drape_cloth(drape, options);
    const MeshJudgement judged =
        judge_drape(*found.level, found.rest, drawn.scene, options.descent.residual);
    const bool good = found.at_rest() && judged.accepted();
    certified += good ? 1 : 0;
    std::printf("%s: %s; %d of %d certified\n", drawn.scene.name.c_str(),
                good              ? "at rest"
                : found.at_rest() ? judged.refusals.front().c_str()
                                  : found.levels.back().rest.why.c_str(),
                certified, index + 1 - first);
    std::fflush(stdout);
    for (const std::string& refusal : judged.refusals) {
      const bool through = refusal.find("through") != std::string::npos;
      EXPECT_FALSE(found.at_rest() && through) << index << ": " << refusal;
    }
  }
  EXPECT_GE(certified, 0.98 * count);
}

}  // namespace
}  // namespace drape::simulate
