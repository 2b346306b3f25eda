// SPDX-License-Identifier: Apache-2.0
#include "capture/capture.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <vector>

namespace drape::capture {
namespace {

TEST(NaturalOrder, CountsDigitRunsAsNumbers) {
  std::vector<std::string> names = {"set10", "set2", "cam", "set1b", "set1", "9", "10", "set2a1"};
  std::sort(names.begin(), names.end(), natural_less);
  EXPECT_THAT(names,
              testing::ElementsAre("9", "10", "cam", "set1", "set1b", "set2", "set2a1", "set10"));
}

TEST(NaturalOrder, IsTotalAlsoForLeadingZeros) {
  EXPECT_TRUE(natural_less("pose_007", "pose_08"));
  EXPECT_NE(natural_less("a1", "a01"), natural_less("a01", "a1"));
  EXPECT_FALSE(natural_less("a1", "a1"));
  EXPECT_TRUE(natural_less("", "0"));
}

TEST(NaturalOrder, HandlesNumbersLongerThanAnyInteger) {
  EXPECT_TRUE(natural_less("99999999999999999999998", "99999999999999999999999"));
  EXPECT_TRUE(natural_less("99999999999999999999999", "100000000000000000000000"));
}

}  // namespace
}  // namespace drape::capture
