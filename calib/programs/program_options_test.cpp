// SPDX-License-Identifier: Apache-2.0
// An option that would do nothing is a wrong call.
#include "calib/programs/program_options.hpp"

#include <gmock/gmock.h>

#include "calib/acceptance/program_options.hpp"
#include "core/error.hpp"

namespace drape::calib {
namespace {

using testing::HasSubstr;

/// What a call is refused for; "" when it is not.
template <typename Refuse>
std::string refused(Command& app, std::vector<std::string> words, const Refuse& refuse) {
  std::vector<char*> arguments = {const_cast<char*>("program")};
  for (std::string& word : words) arguments.push_back(word.data());
  EXPECT_EQ(app.parse(static_cast<int>(arguments.size()), arguments.data()), -1);
  try {
    refuse();
    return "";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    return error.what();
  }
}

std::string calib_refused(const std::string& method, const std::vector<std::string>& words) {
  Command app("", "drape-calib");
  JointOptions options;
  std::string lens, lens_from;
  add_joint_options(app, options);
  app.add_option("--lens", lens, "");
  app.add_option("--lens-from", lens_from, "");
  return refused(app, words, [&] { refuse_joint_options(app, method); });
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
}

std::string accept_refused(std::vector<std::string> words) {
  Command app("", "drape-calib accept");
  AcceptanceArguments arguments;
  add_acceptance_options(app, arguments);
  words.insert(words.begin(),
               {"d.json", "--calibration", "c.json", "--rig", "rig", "--out", "a.json"});
  return refused(app, words, [&] { refuse_idle_options(app); });
}

TEST(IdleOptions, OfABallOrADateAreRefusedWithoutIt) {
  EXPECT_EQ(accept_refused({}), "");
  EXPECT_THAT(accept_refused({"--sphere-diameter-mm", "80"}), HasSubstr("without --sphere"));
  EXPECT_THAT(accept_refused({"--max-sphere-form-mm", "1"}), HasSubstr("without --sphere"));
  EXPECT_THAT(accept_refused({"--sphere", "s.json"}), HasSubstr("without --sphere-diameter-mm"));
  EXPECT_EQ(accept_refused({"--sphere", "s.json", "--sphere-diameter-mm", "80"}), "");
  EXPECT_THAT(accept_refused({"--valid-days", "30"}), HasSubstr("without --date"));
  EXPECT_EQ(accept_refused({"--valid-days", "30", "--date", "2026-01-31"}), "");
}

}  // namespace
}  // namespace drape::calib
