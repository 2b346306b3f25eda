// SPDX-License-Identifier: Apache-2.0
// Compares with published tables of Fisher's F and Student's t.
#include "calib/joint/statistics.hpp"

#include <gtest/gtest.h>

#include <utility>

namespace drape {
namespace {

using namespace calib;

TEST(Statistics, TailsOfFAreThoseOfTheTables) {
  EXPECT_NEAR(f_tail(4.9646, 1, 10), 0.05, 1e-5);
  EXPECT_NEAR(f_tail(3.3258, 5, 10), 0.05, 1e-5);
  EXPECT_NEAR(f_tail(6.6349, 1, 1e7), 0.01, 1e-5);  // chi-square with one degree
  EXPECT_NEAR(f_tail(1, 7, 7), 0.5, 1e-12);
  EXPECT_EQ(f_tail(0, 3, 4), 1);
  EXPECT_LT(f_tail(1e6, 6, 60), 1e-100);
}

TEST(Statistics, StudentsTIsThatOfTheTables) {
  for (const auto& [freedom, t] : {std::pair(3.0, 3.1824), {10.0, 2.2281}, {30.0, 2.0423}})
    EXPECT_NEAR(widening_by_student(freedom) * 1.959964, t, 0.01 * t) << freedom;
}

}  // namespace
}  // namespace drape
