// SPDX-License-Identifier: Apache-2.0
// An option that would have no effect is a usage error.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::calib {
namespace {

using testing::HasSubstr;

/// Text of a usage error; "" for a call that ends only because its files do not exist.
std::string refused(const std::string& words, const std::vector<std::string>& more) {
  const test::TemporaryFolder folder;
  const test::Outcome outcome = test::run_line(
      fmt::format("'{}' {} --rig no-rig --out '{}' {}", test::program("drape-calib").string(),
                  words, (folder.path() / "out.json").string(), fmt::join(more, " ")));
  if (outcome.exit_code == 2) return outcome.text;
  EXPECT_EQ(outcome.exit_code, 3) << outcome.text;
  return "";
}

std::string calib_refused(const std::string& method, const std::vector<std::string>& words) {
  return refused("d.json --method " + method, words);
}

TEST(IdleOptions, OfTheJointMethodAreRefusedBesideTsai) {
  const std::vector<std::vector<std::string>> calls = {
      {"--lens", "k1"},      {"--lens-from", "c.json"}, {"--board", "bow"},
      {"--plate", "t.toml"}, {"--free-stages"},         {"--thickness-mm", "5"}};
  for (const std::vector<std::string>& words : calls) {
    EXPECT_THAT(calib_refused("tsai", words), HasSubstr(words[0] + " does nothing"));
    EXPECT_EQ(calib_refused("joint", words), "") << words[0];
  }
  EXPECT_EQ(calib_refused("tsai", {}), "");
  EXPECT_THAT(calib_refused("tsai", {"--max-rms-mm", "0"}), HasSubstr("--max-rms-mm"));
  EXPECT_THAT(calib_refused("joint", {"--lens", "k4"}), HasSubstr("k4"));
}

std::string accept_refused(const std::vector<std::string>& words) {
  return refused("accept d.json --calibration c.json", words);
}

TEST(IdleOptions, OfABallOrADateAreRefusedWithoutIt) {
  EXPECT_EQ(accept_refused({}), "");
  EXPECT_THAT(accept_refused({"--sphere-diameter-mm", "80"}), HasSubstr("without --sphere"));
  EXPECT_THAT(accept_refused({"--max-sphere-form-mm", "1"}), HasSubstr("without --sphere"));
  EXPECT_THAT(accept_refused({"--sphere", "s.json"}), HasSubstr("without --sphere-diameter-mm"));
  EXPECT_EQ(accept_refused({"--sphere", "s.json", "--sphere-diameter-mm", "80"}), "");
  EXPECT_THAT(accept_refused({"--valid-days", "30"}), HasSubstr("without --date"));
  EXPECT_EQ(accept_refused({"--valid-days", "30", "--date", "2026-01-31"}), "");
  EXPECT_THAT(accept_refused({"--bow-sd-mm", "-1", "0"}), HasSubstr("--bow-sd-mm"));
}

}  // namespace
}  // namespace drape::calib
