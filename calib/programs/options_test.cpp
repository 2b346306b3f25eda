// SPDX-License-Identifier: Apache-2.0
// An option that would do nothing is a wrong call.
#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "calib/programs/commands.hpp"
#include "tests/support/paths.hpp"

namespace drape::calib {
namespace {

using testing::HasSubstr;

/// Text for a wrong call; "" for a call that ends by the files that are not there.
std::string refused(int (*command)(int, char**), std::vector<std::string> words,
                    const std::vector<std::string>& more) {
  const test::TemporaryFolder folder;
  words.insert(words.end(), {"--rig", "no-rig", "--out", (folder.path() / "out.json").string()});
  words.insert(words.end(), more.begin(), more.end());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  testing::internal::CaptureStderr();
  const int code = command(static_cast<int>(arguments.size()), arguments.data());
  const std::string text = testing::internal::GetCapturedStderr();
  if (code == 2) return text;
  EXPECT_EQ(code, 3) << text;
  return "";
}

std::string calib_refused(const std::string& method, const std::vector<std::string>& words) {
  return refused(calib_command, {"drape-calib", "d.json", "--method", method}, words);
}

TEST(IdleOptions, OfTheJointMethodAreRefusedBesideTsai) {
  const std::vector<std::vector<std::string>> calls = {{"--lens", "k1"},
                                                       {"--lens-from", "c.json"},
                                                       {"--no-bow"},
                                                       {"--free-stages"},
                                                       {"--thickness-mm", "5"}};
  for (const std::vector<std::string>& words : calls) {
    EXPECT_THAT(calib_refused("tsai", words), HasSubstr(words[0] + " does nothing"));
    EXPECT_EQ(calib_refused("joint", words), "") << words[0];
  }
  EXPECT_EQ(calib_refused("tsai", {}), "");
  EXPECT_THAT(calib_refused("tsai", {"--max-rms-px", "0"}), HasSubstr("--max-rms-px"));
  EXPECT_THAT(calib_refused("joint", {"--lens", "k4"}), HasSubstr("k4"));
}

std::string accept_refused(const std::vector<std::string>& words) {
  return refused(accept_command, {"drape-calib", "accept", "d.json", "--calibration", "c.json"},
                 words);
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
