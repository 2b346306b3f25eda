// SPDX-License-Identifier: Apache-2.0
// Captures with Debian's own GigE Vision camera.
#include <fmt/format.h>

#include "capture/live/test_live_bench.hpp"
#include "capture/recording/record.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/gige_camera/debian_camera.hpp"
#include "tests/support/trials.hpp"

namespace drape::capture {
namespace {

using test::DebianCamera;
using testing::HasSubstr;

class Debian : public test::CameraTest {
 protected:
  void SetUp() override {
    DRAPE_REQUIRE_DEBIAN_CAMERA();  // may have to be downloaded first
    CameraTest::SetUp();
  }

  void set_up(std::size_t count, SyncMethod method) {
    file_.method = method;
    file_.frame_rate_hz = 10;
    file_.largest_spread_s = 0.04;
    for (std::size_t i = 0; i < count; ++i) {
      const std::string address = "127.0.0." + std::to_string(20 + i);
      devices_.push_back(std::make_unique<DebianCamera>(address, "GV" + std::to_string(i)));
      LiveCamera camera =
          test::camera_at("cam" + std::to_string(i), address, 512, 400, file_.frame_rate_hz);
      camera.settings.exposure_us = 10'000;
      file_.cameras.push_back(camera);
    }
  }

  [[nodiscard]] LiveResult capture(int frames, const std::function<void(int)>& at_set = {}) const {
    return test::capture_with(file_, frames, at_set);
  }

  void expect_pictures(const LiveResult& live, int sets) const {
    EXPECT_EQ(live.pairing.sets.size(), static_cast<std::size_t>(sets)) << test::all_faults(live);
    for (const PairedFrames& set : live.pairing.sets)
      for (const std::size_t i : set.frames)
        EXPECT_TRUE(DebianCamera::drew(live.frames[i].pixels, 512));
    for (const LiveCameraReport& camera : live.report.cameras) {
      EXPECT_EQ(camera.host_launches, 1);
      EXPECT_TRUE(camera.ledger.closes());
    }
  }

  CamerasFile file_;
  std::vector<std::unique_ptr<DebianCamera>> devices_;
};

TEST_F(Debian, SoftwareTriggerPairsWithoutAnyClock) {
  set_up(2, SyncMethod::software_trigger);
  const int sets = test::trial_count(20, 1000);
  const LiveResult live = capture(sets);
  expect_pictures(live, sets);
  EXPECT_EQ(live.report.paired_by, PairedBy::trigger);
  EXPECT_FALSE(live.pairing.sets.at(0).spread_s);
  std::printf("software trigger without a clock: %zu of %d paired\n", live.pairing.sets.size(),
              sets);
}

/// If it is too slow to see two triggers, it treats them as one.
TEST_F(Debian, ACameraWithoutTimeAnswersLate) {
  set_up(2, SyncMethod::software_trigger);
  const int sets = 6;
  expect_pictures(capture(sets,
                          [&](int done) {
                            if (done % 2 == 1 && done < sets) devices_[1]->starve(0.8);
                          }),
                  sets);
}

TEST_F(Debian, ACameraWithoutPowerForAMomentIsBack) {
  set_up(2, SyncMethod::software_trigger);
  const int triggers = 12;
  const LiveResult live = capture(triggers, [&](int done) {
    if (done == 3) devices_[1]->switch_off_and_on();
  });
  EXPECT_GT(live.report.cameras[1].host_launches, 1) << test::all_faults(live);
  EXPECT_EQ(live.pairing.sets.back().trigger, triggers - 1) << test::all_faults(live);
}

TEST_F(Debian, FreeRunPairsByArrivalOnlyWhenAskedTo) {
  set_up(2, SyncMethod::free_run);
  const Error error = test::error_of([&] { return capture(3); });
  EXPECT_THAT(error.what(), HasSubstr("its clock cannot be read"));
  EXPECT_THAT(error.what_to_do(), HasSubstr("pair_by_arrival = true"));
  file_.pair_by_arrival = true;
  const LiveResult live = capture(5);
  expect_pictures(live, 5);
  EXPECT_EQ(live.report.paired_by, PairedBy::arrival);
  for (const PairedFrames& set : live.pairing.sets) EXPECT_FALSE(set.spread_s);
}

TEST_F(Debian, OneCameraNeedsNoPartner) {
  set_up(1, SyncMethod::free_run);
  expect_pictures(capture(3), 3);
}

TEST_F(Debian, WhatItCannotDoIsNamed) {
  for (const SyncMethod method :
       {SyncMethod::line_trigger, SyncMethod::action, SyncMethod::scheduled_action}) {
    SCOPED_TRACE(name_of(method));
    devices_.clear();
    file_ = {};
    set_up(1, method);
    const Error error = test::error_of([&] { return capture(1); });
    EXPECT_THAT(error.what(), HasSubstr("has no trigger source"));
  }
}

// ----
// For every personality of the emulated camera and every sync method: whole sets, bit for bit as
// sent, or a refusal with its reason.

using test::Personality;

constexpr int kZooWidth_px = 160, kZooHeight_px = 120, kSets = 2;

constexpr SyncMethod kMethods[] = {SyncMethod::software_trigger, SyncMethod::free_run,
                                   SyncMethod::line_trigger, SyncMethod::action,
                                   SyncMethod::scheduled_action};

/// Refusal of this method for such a camera, as shown to the operator; empty if it is supported.
std::string expected_refusal(const Personality& p, SyncMethod method) {
  const bool clock = p.latch != test::Latch::none;
  const bool line = method == SyncMethod::line_trigger;
  const bool action = method == SyncMethod::action || method == SyncMethod::scheduled_action;
  if (line && !p.has_trigger("Line1")) return "has no trigger source Line1";
  if (action && !p.has_trigger("Action1")) return "has no trigger source Action1";
  if (!clock && (line || method == SyncMethod::free_run)) return "its clock cannot be read";
  if (!clock && method == SyncMethod::scheduled_action) return "its clock cannot be read";
  return {};
}

struct ZooOutcome {
  int sets = 0, wrong = 0, launches = 0;
  std::string said;
};

ZooOutcome run(const Personality& personality, SyncMethod method) {
  CamerasFile file;
  file.method = method;
  file.frame_rate_hz = 10;
  file.largest_spread_s = 0.04;
  std::vector<std::unique_ptr<test::GigeCamera>> devices;
  std::vector<test::Sent> sent;
  for (unsigned c = 0; c < 2; ++c) {
    test::GigeCameraOptions options;
    options.address = fmt::format("127.0.0.{}", 2 + c);
    options.serial = fmt::format("ZOO{}", c);
    options.width_px = kZooWidth_px;
    options.height_px = kZooHeight_px;
    options.clock_offset_s = 5.0 * c + 3;
    options.clock_drift_ppm = 40.0 * c;
    options.personality = personality;
    devices.push_back(std::make_unique<test::GigeCamera>(options));
    sent.push_back(test::picture_for(personality, kZooWidth_px, kZooHeight_px, c + 1));
    // With gamma on, the emulator changes the grey levels of what it shows.
    personality.gamma_on ? devices.back()->show(sent.back().bytes)
                         : devices.back()->show_bytes(sent.back().bytes);
    LiveCamera camera = test::camera_at(fmt::format("cam{}", c), options.address, kZooWidth_px,
                                        kZooHeight_px, file.frame_rate_hz);
    camera.settings.exposure_us = 2000;
    if (personality.tick_hz > 0) camera.settings.packet_delay_ns = 1000;
    file.cameras.push_back(camera);
  }
  std::atomic<bool> ended{false};
  std::thread pulses([&] {
    while (!ended) {
      for (const auto& device : devices) device->pulse_line();
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  });
  ZooOutcome outcome;
  try {
    const LiveResult live = test::capture_with(file, kSets);
    outcome.sets = static_cast<int>(live.pairing.sets.size());
    for (const PairedFrames& set : live.pairing.sets)
      for (std::size_t c = 0; c < set.frames.size(); ++c)
        outcome.wrong += live.frames[set.frames[c]].pixels != sent[c].grey;
    for (const LiveCameraReport& camera : live.report.cameras)
      outcome.launches = std::max(outcome.launches, camera.host_launches);
    outcome.said = test::all_faults(live);
  } catch (const Error& error) {
    outcome.said = error.what();
  }
  ended = true;
  pulses.join();
  return outcome;
}

class Zoo : public test::CameraTest, public testing::WithParamInterface<Personality> {};

TEST_P(Zoo, GivesWhatWasSentOrSaysWhyNot) {
  const Personality& personality = GetParam();
  const int methods = test::trial_count(1, 5);
  for (int m = 0; m < methods; ++m) {
    const SyncMethod method = kMethods[m];
    const std::string refusal = expected_refusal(personality, method);
    const ZooOutcome outcome = run(personality, method);
    SCOPED_TRACE(fmt::format("{} by {}: {}", personality.name, name_of(method), outcome.said));
    if (refusal.empty()) {
      EXPECT_EQ(outcome.sets, kSets);
      EXPECT_EQ(outcome.wrong, 0);
      EXPECT_EQ(outcome.launches, 1);
    } else {
      EXPECT_EQ(outcome.sets, 0);
      EXPECT_THAT(outcome.said, testing::HasSubstr(refusal));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Cameras, Zoo, testing::ValuesIn(test::personalities()),
                         [](const auto& p) { return p.param.name; });

}  // namespace
}  // namespace drape::capture
