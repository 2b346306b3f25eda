// SPDX-License-Identifier: Apache-2.0
#include "capture/pairing/pairing.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "core/error.hpp"

namespace drape::capture {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

/// Readings of a device clock `offset_ns` behind the host's at host time 0 and slower by
/// `drift_ppm`, every `every_s`, with round trips up to 1 ms split at random.
std::vector<ClockSample> samples_of(std::int64_t offset_ns, double drift_ppm, int count,
                                    double every_s, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> round_trip(2e-5, 1e-3);
  std::uniform_real_distribution<double> split(0, 1);
  std::vector<ClockSample> samples;
  for (int i = 0; i < count; ++i) {
    const double before = i * every_s;
    const double trip = round_trip(random);
    const double at = before + split(random) * trip;
    ClockSample s;
    s.host_before_ns = std::llround(before * 1e9);
    s.host_after_ns = std::llround((before + trip) * 1e9);
    s.device_ns = std::llround(at * 1e9 * (1 - drift_ppm * 1e-6)) - offset_ns;
    samples.push_back(s);
  }
  return samples;
}

TEST(ClockFit, FindsOffsetAndDriftToHalfAMillisecond) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    const std::int64_t offset = (static_cast<std::int64_t>(seed) - 100) * kSecond / 10;
    const double drift = static_cast<double>(seed) - 100;
    const auto fit = fit_clock(samples_of(offset, drift, 30, 2.0, seed));
    ASSERT_TRUE(fit);
    EXPECT_TRUE(fit->drift_estimated);
    for (const double t : {0.0, 30.0, 60.0}) {
      const std::int64_t device = std::llround(t * 1e9 * (1 - drift * 1e-6)) - offset;
      EXPECT_NEAR(fit->host_time_s(device, 0), t, 5e-4) << "offset " << offset << ", " << drift;
    }
  }
}

TEST(ClockFit, KeepsNanosecondsOfClocksThatCountFromFarAway) {
  ClockSample far{1'700'000'000 * kSecond, 5, 1'700'000'000 * kSecond + 200};
  const auto fit = fit_clock({far});
  ASSERT_TRUE(fit);
  EXPECT_FALSE(fit->drift_estimated);
  EXPECT_NEAR(fit->host_time_s(5 + 1000, 1'700'000'000 * kSecond), 1.1e-6, 2e-9);
  EXPECT_NEAR(fit->bound_s, 1e-7, 1e-9);
}

TEST(ClockFit, AShortSpanGivesNoDrift) {
  const auto fit = fit_clock(samples_of(kSecond, 80, 5, 0.1, 1));
  ASSERT_TRUE(fit);
  EXPECT_FALSE(fit->drift_estimated);
  EXPECT_EQ(fit->drift_ppm, 0);
}

/// Two free-running cameras: the stated bound must contain a drift that is not yet estimated.
TEST(ClockFit, TheBoundHoldsBeforeTheDriftIsKnown) {
  for (const double drift : {-300.0, -100.0, 100.0, 300.0})
    for (const int count : {1, 3, 9}) {
      const auto fit = fit_clock(samples_of(0, drift, count, 0.1, 3));
      ASSERT_TRUE(fit);
      EXPECT_FALSE(fit->drift_estimated);
      const double at_s = 0.1 * count;
      const double error_s =
          fit->host_time_s(std::llround(at_s * 1e9 * (1 - drift * 1e-6)), 0) - at_s;
      EXPECT_LT(std::abs(error_s), fit->bound_s + fit->drift_bound_s) << drift << " " << count;
    }
  EXPECT_EQ(fit_clock(samples_of(0, 100, 30, 0.1, 3))->drift_bound_s, 0);
}

TEST(ClockFit, RefusesAJumpANegativeRoundTripAndNothing) {
  auto jumped = samples_of(0, 0, 10, 1.0, 1);
  for (std::size_t i = 5; i < 10; ++i) jumped[i].device_ns += kSecond;
  EXPECT_FALSE(fit_clock(jumped));
  EXPECT_FALSE(fit_clock({}));
  EXPECT_FALSE(fit_clock({{10, 0, 5}}));
}

TEST(FrameId, CountsOnOverTheWrapAndSkipsZero) {
  FrameIdUnwrapper ids({1, 65535});
  EXPECT_EQ(ids.unwrap(65534), 0);
  EXPECT_EQ(ids.unwrap(65535), 1);
  EXPECT_EQ(ids.unwrap(1), 2);
  EXPECT_EQ(ids.unwrap(65533), -1);  // late, sent before the first one received
  EXPECT_EQ(ids.unwrap(4), 5);       // two lost
  EXPECT_EQ(ids.unwrap(3), 4);       // reordered
  EXPECT_EQ(ids.unwrap(0), std::nullopt);
  EXPECT_EQ(ids.unwrap(65536), std::nullopt);
  EXPECT_THROW(FrameIdUnwrapper({3, 3}), Error);
}

TEST(FrameId, CountsOnWhereIdsHave64Bits) {
  FrameIdUnwrapper ids({1, 65535});
  EXPECT_EQ(ids.unwrap(65534), 0);
  EXPECT_EQ(ids.unwrap(65536), 2);  // one lost
  EXPECT_EQ(ids.unwrap(65535), 1);  // late
  EXPECT_EQ(ids.unwrap(65540), 6);
  EXPECT_EQ(ids.unwrap(0xFFFFFFFFFFFF), std::nullopt);
}

TEST(FrameId, CountsManyWraps) {
  FrameIdUnwrapper ids({1, 65535});
  for (std::int64_t i = 0; i < 300'000; i += 7) {
    EXPECT_EQ(ids.unwrap(static_cast<std::uint64_t>(i % 65535) + 1), i);
  }
}

}  // namespace
}  // namespace drape::capture
