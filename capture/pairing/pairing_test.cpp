// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "capture/pairing/pairing.hpp"
#include "core/error.hpp"
#include "tests/support/trials.hpp"

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

FrameMark at(std::size_t camera, std::int64_t index, double time_s) {
  return {camera, index, time_s, std::nullopt, true};
}

void expect_closed(const PairingResult& result) {
  for (const CameraLedger& ledger : result.cameras) EXPECT_TRUE(ledger.closes());
}

TEST(PairByTime, AnOrphanTakesNoPartnerAway) {
  // Camera 1 lost its frame of the first instant; the window is just below half a period of 0.2 s.
  const auto result = pair_frames({at(0, 0, 0.0), at(0, 1, 0.2), at(1, 0, 0.105)},
                                  {.cameras = 2, .window_s = 0.11});
  ASSERT_EQ(result.sets.size(), 1U);
  EXPECT_THAT(result.sets[0].frames, ElementsAre(1, 2));  // 0.095 s apart, not 0.105 s
  EXPECT_NEAR(*result.sets[0].spread_s, 0.095, 1e-12);
  EXPECT_EQ(result.places[0].why_unpaired, Unpaired::partner_missing);
  expect_closed(result);
}

TEST(PairByTime, EveryFrameIsInOneBin) {
  std::vector<FrameMark> frames = {at(0, 0, 0),   at(1, 0, 0.001), at(0, 1, 0.1),  at(1, 1, 0.101),
                                   at(0, 3, 0.3), at(1, 3, 0.301), at(1, 3, 0.301)};
  frames[3].complete = false;
  frames.push_back({0, 4, std::nullopt, std::nullopt, true});
  const auto result = pair_frames(frames, {.cameras = 2, .window_s = 0.05});
  EXPECT_EQ(result.sets.size(), 2U);
  EXPECT_EQ(result.places[2].why_unpaired, Unpaired::partner_missing);
  EXPECT_EQ(result.places[3].bin, FrameBin::incomplete);
  EXPECT_EQ(result.places[6].why_unpaired, Unpaired::repeated_id);
  EXPECT_EQ(result.places[7].why_unpaired, Unpaired::no_time);
  EXPECT_EQ(result.cameras[0].expected, 5);
  EXPECT_EQ(result.cameras[0].never_arrived, 1);
  EXPECT_EQ(result.cameras[0].unpaired, 2);
  EXPECT_EQ(result.cameras[1].expected, 4);
  EXPECT_EQ(result.cameras[1].never_arrived, 1);
  EXPECT_EQ(result.cameras[1].repeated, 1);
  expect_closed(result);
}

TEST(PairByTime, ACameraThatSentNothingIsCountedByWhatWasAsked) {
  const auto result = pair_frames({at(0, 0, 0), at(0, 1, 0.1)},
                                  {.cameras = 2, .window_s = 0.05, .expected_frames = 3});
  EXPECT_TRUE(result.sets.empty());
  EXPECT_EQ(result.cameras[0].never_arrived, 1);
  EXPECT_EQ(result.cameras[1].never_arrived, 3);
  expect_closed(result);
}

TEST(PairByTrigger, GoesByTheTriggerAndNotByTime) {
  std::vector<FrameMark> frames = {at(0, 0, 0.0), at(1, 0, 5.0), at(0, 1, 1.0), at(1, 1, 1.0)};
  frames[0].trigger = 0;
  frames[1].trigger = 0;
  frames[2].trigger = 1;  // camera 1's second frame has no trigger
  const auto result = pair_frames(frames, {.cameras = 2, .triggers = 3});
  ASSERT_EQ(result.sets.size(), 1U);
  EXPECT_EQ(result.sets[0].trigger, 0);
  EXPECT_NEAR(*result.sets[0].spread_s, 5.0, 1e-12);
  EXPECT_EQ(result.places[2].why_unpaired, Unpaired::partner_missing);
  EXPECT_EQ(result.places[3].why_unpaired, Unpaired::no_trigger);
  EXPECT_EQ(result.cameras[0].never_arrived, 1);
  expect_closed(result);
}

TEST(PairByTrigger, FindsTheTriggerOfATime) {
  const std::vector<double> triggers = {1, 2, 3};
  EXPECT_EQ(trigger_of(2.01, triggers, 0.001, 0.1), 1);
  EXPECT_EQ(trigger_of(1.9995, triggers, 0.001, 0.1), 1);
  EXPECT_EQ(trigger_of(2.5, triggers, 0.001, 0.1), std::nullopt);
  EXPECT_EQ(trigger_of(0.5, triggers, 0.001, 0.1), std::nullopt);
}

TEST(Pairing, RefusesWhatMakesNoSense) {
  EXPECT_THROW(static_cast<void>(pair_frames({}, {.cameras = 0, .window_s = 1})), Error);
  EXPECT_THROW(static_cast<void>(pair_frames({}, {.cameras = 2})), Error);
  EXPECT_THROW(static_cast<void>(pair_frames({at(2, 0, 0)}, {.cameras = 2, .window_s = 1})), Error);
}

// ---- random benches: device clocks, losses and wraps as in real cameras --------------------

struct Bench {
  std::vector<FrameMark> frames;
  std::vector<std::int64_t> instant;  ///< the truth, one per frame
  std::set<std::int64_t> whole;  ///< instants at which a complete frame of every camera arrived
  std::size_t cameras = 0;
  double period_s = 0;
};

struct SimulatedCamera {
  double offset_s = 0, drift_ppm = 0;
  std::uint64_t first_id = 1;

  /// Reading of the device's clock at host time `t_s`.
  [[nodiscard]] std::int64_t device_ns(double t_s) const {
    return std::llround(1e9 * (t_s * (1 - 1e-6 * drift_ppm) + offset_s));
  }
};

ClockFit read_clock(const SimulatedCamera& camera, double from_s, double to_s,
                    std::mt19937& random) {
  std::uniform_real_distribution<double> trip(5e-5, 2e-3), split(0, 1);
  std::vector<ClockSample> samples;
  for (int i = 0; i < 20; ++i) {
    const double before = from_s + (to_s - from_s) * i / 19;
    const double round_trip = trip(random);
    samples.push_back({std::llround(1e9 * before),
                       camera.device_ns(before + split(random) * round_trip),
                       std::llround(1e9 * (before + round_trip))});
  }
  return fit_clock(samples).value();
}

Bench random_bench(unsigned seed, std::int64_t instants) {
  std::mt19937 random(seed);
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  Bench bench;
  bench.cameras = 2 + seed % 3;
  bench.period_s = uniform(0.02, 0.2);
  std::vector<std::size_t> received(static_cast<std::size_t>(instants), 0);
  const double end_s = bench.period_s * static_cast<double>(instants);
  for (std::size_t c = 0; c < bench.cameras; ++c) {
    SimulatedCamera camera{uniform(-10, 10), uniform(-100, 100), 65535 - seed % 50};
    const ClockFit clock = read_clock(camera, -0.5, end_s + 0.5, random);
    FrameIdUnwrapper ids({1, 65535});
    std::optional<std::int64_t> zero;  // frame index of the first instant, trigger 0 would give it
    for (std::int64_t k = 0; k < instants; ++k) {
      const auto id = (camera.first_id - 1 + static_cast<std::uint64_t>(k)) % 65535 + 1;
      const bool missing = uniform(0, 1) < 0.05;
      if (missing) continue;
      const auto index = ids.unwrap(id);
      if (!zero) zero = k;
      const double exposed =
          bench.period_s * static_cast<double>(k) + uniform(-1, 1) * 0.1 * bench.period_s;
      const bool complete = uniform(0, 1) > 0.01;
      bench.frames.push_back(
          {c, *index, clock.host_time_s(camera.device_ns(exposed), 0), std::nullopt, complete});
      EXPECT_EQ(*index + *zero, k);  // unwrapped ids are the true count
      bench.instant.push_back(k);
      if (complete) ++received[static_cast<std::size_t>(k)];
    }
  }
  for (std::int64_t k = 0; k < instants; ++k) {
    if (received[static_cast<std::size_t>(k)] == bench.cameras) bench.whole.insert(k);
  }
  return bench;
}

/// Shuffles the arrivals, since arrival order must not matter.
void shuffle(Bench& bench, unsigned seed) {
  std::vector<std::size_t> order(bench.frames.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), std::mt19937(seed));
  const Bench before = bench;
  for (std::size_t i = 0; i < order.size(); ++i) {
    bench.frames[i] = before.frames[order[i]];
    bench.instant[i] = before.instant[order[i]];
  }
}

/// Offsets up to 10 s, drift up to 100 ppm, 5 % missing, 1 % incomplete, id wrap, jitter of a tenth
/// of the period: no wrong set, and no complete instant left out.
TEST(Pairing, NoWrongSetInTenThousand) {
  const unsigned benches = static_cast<unsigned>(test::trial_count(100, 1000));
  std::size_t sets = 0, wrong = 0, left_out = 0;
  for (unsigned seed = 0; seed < benches; ++seed) {
    Bench bench = random_bench(seed, 120);
    shuffle(bench, seed);
    const auto result =
        pair_frames(bench.frames, {.cameras = bench.cameras, .window_s = 0.4 * bench.period_s});
    expect_closed(result);
    std::set<std::int64_t> found;
    for (const PairedFrames& set : result.sets) {
      std::set<std::int64_t> instants;
      for (const std::size_t i : set.frames) instants.insert(bench.instant[i]);
      if (instants.size() != 1) ++wrong;
      found.insert(instants.begin(), instants.end());
    }
    sets += result.sets.size();
    for (const std::int64_t k : bench.whole) left_out += found.count(k) == 0 ? 1 : 0;
  }
  RecordProperty("sets", std::to_string(sets));
  EXPECT_GE(sets, test::trial_count(100, 1000) * 90U);
  EXPECT_EQ(wrong, 0U) << "of " << sets;
  EXPECT_EQ(left_out, 0U);
}

TEST(Pairing, TheOrderOfArrivalNeverMatters) {
  Bench bench = random_bench(7, 60);
  const PairingOptions options{.cameras = bench.cameras, .window_s = 0.4 * bench.period_s};
  const auto times = [&](const PairingResult& result) {
    std::vector<double> all;
    for (const PairedFrames& set : result.sets)
      for (const std::size_t i : set.frames) all.push_back(*bench.frames[i].time_s);
    return all;
  };
  const auto in_order = times(pair_frames(bench.frames, options));
  shuffle(bench, 3);
  EXPECT_EQ(times(pair_frames(bench.frames, options)), in_order);
}

}  // namespace
}  // namespace drape::capture
