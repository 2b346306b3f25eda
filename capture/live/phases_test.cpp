// SPDX-License-Identifier: Apache-2.0
#include "capture/pairing/pairing.hpp"

#include <gmock/gmock.h>

namespace drape::capture {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;

TEST(Phases, AreTakenWithinOnePeriodWhateverTheFrame) {
  EXPECT_THAT(phases_s({10.0, 10.01, 12.49, 9.96}, 0.1),
              ElementsAre(DoubleNear(0, 1e-12), DoubleNear(0.01, 1e-12), DoubleNear(-0.01, 1e-12),
                          DoubleNear(-0.04, 1e-12)));
}

TEST(Phases, TheLeastSpreadIsTheCircleWithoutItsLargestGap) {
  EXPECT_NEAR(least_spread_s({0, 0.01, -0.02}, 0.1), 0.03, 1e-12);
  EXPECT_NEAR(least_spread_s({0, 0.049, -0.049}, 0.1), 0.051, 1e-12);  // 49, 51 and 100 ms
  EXPECT_NEAR(least_spread_s({0, 0.033, -0.034}, 0.1), 0.066, 1e-12);
  EXPECT_EQ(least_spread_s({0}, 0.1), 0);
}

TEST(Phases, ACameraThatBeginsAtTheTimeGivenExposesWithTheFirst) {
  constexpr double period_s = 0.1;
  constexpr std::int64_t began_ns = 7'000'000'000, delay_ns = 33'000'000;
  for (const double phase_s : {-0.04, -0.001, 0.0, 0.02, 0.05}) {
    for (const std::int64_t now_ns : {began_ns, began_ns + 12'345'678, began_ns + 987'654'321}) {
      const std::int64_t again_ns = begin_again_ns(began_ns, phase_s, period_s, now_ns);
      EXPECT_GE(again_ns, now_ns);
      EXPECT_LT(again_ns, now_ns + 200'000'000);
      // Exposed at start + delay, which was phase_s after camera 0.
      const auto exposed_s = 1e-9 * static_cast<double>(again_ns + delay_ns);
      const double reference_s = 1e-9 * static_cast<double>(began_ns + delay_ns) - phase_s;
      EXPECT_NEAR(phases_s({reference_s, exposed_s}, period_s)[1], 0, 1e-8);
    }
  }
}

}  // namespace
}  // namespace drape::capture
