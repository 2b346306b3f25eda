// SPDX-License-Identifier: Apache-2.0
// Mean and band of the drapes of an ensemble, or of several samples.
#include <gtest/gtest.h>

#include <random>

#include "compare/hems/hem_files.hpp"

namespace drape::compare {
namespace {

HemRecord hem_of_percent(const std::string& sample, double percent) {
  HemRecord record;
  record.sample = sample;
  record.numbers = {{"drape_coefficient_percent", percent, {}}};
  return record;
}

std::optional<EnsembleBand> band_of_all(const std::vector<HemRecord>& records) {
  std::vector<const HemRecord*> hems;
  hems.reserve(records.size());
  for (const HemRecord& record : records) hems.push_back(&record);
  return band_of(hems);
}

TEST(Band, UOfTheMeanHoldsTheTruthAlsoWhereSamplesDiffer) {
  // The standard deviations of samples and of repeats of the published drapes.
  constexpr int kDraws = 1000;
  std::mt19937 random(7);
  std::normal_distribution<double> of_sample(0, 1.36), of_repeat(0, 2.1);
  int held = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<HemRecord> hems;
    for (const char* sample : {"1", "2", "3"}) {
      const double mean = 50 + of_sample(random);
      for (int repeat = 0; repeat < 6; ++repeat)
        hems.push_back(hem_of_percent(sample, mean + of_repeat(random)));
    }
    const auto band = band_of_all(hems);
    ASSERT_TRUE(band);
    EXPECT_FALSE(band->next);
    held += std::abs(band->mean - 50) <= band->mean_u;
  }
  EXPECT_NEAR(held, 0.95 * kDraws, 3 * std::sqrt(kDraws * 0.95 * 0.05));
}

TEST(Band, OfOneSampleOrOneDrapePerSampleDrapesAreIndependent) {
  const double t = 4.302652729911275;  // 97.5 %, two degrees of freedom
  for (const bool one : {true, false}) {
    std::vector<HemRecord> hems;
    for (const double percent : {48, 50, 52})
      hems.push_back(hem_of_percent(one ? "" : std::to_string(percent), percent));
    hems.push_back(hem_of_percent("", 90));
    hems.back().go = false;
    const auto band = band_of_all(hems);
    ASSERT_TRUE(band && band->next);
    EXPECT_EQ(band->drapes, 3);
    EXPECT_NEAR(band->mean_u, t * 2 / std::sqrt(3.0), 1e-9);
    EXPECT_NEAR(band->next->second, 50 + t * 2 * std::sqrt(4.0 / 3), 1e-9);
  }
  EXPECT_FALSE(band_of_all({hem_of_percent("", 50)}));
  // With ten drapes of each of two samples, their difference has a single degree of freedom.
  std::vector<HemRecord> two;
  for (int i = 0; i < 10; ++i)
    for (const double percent : {48, 52})
      two.push_back(hem_of_percent(std::to_string(percent), percent));
  EXPECT_NEAR(band_of_all(two)->mean_u, 12.706204736 * 2, 1e-6);
}

TEST(Band, ASampleWithTwoFacesIsOne) {
  EXPECT_EQ(
      variance_components({{"1", "a"}, {"2", "a"}, {"1", "b"}, {"2", "b"}}, {1, 2, 3, 4}).samples,
      2);
}

}  // namespace
}  // namespace drape::compare
