// SPDX-License-Identifier: Apache-2.0
// Captures with Debian's own GigE Vision camera.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>

#include "capture/live/test_live_bench.hpp"
#include "capture/recording/record.hpp"
#include "core/error.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/gige_camera/debian_camera.hpp"
#include "tests/support/gige_camera/private_network.hpp"
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
    SCOPED_TRACE(to_string(method));
    devices_.clear();
    file_ = {};
    set_up(1, method);
    const Error error = test::error_of([&] { return capture(1); });
    EXPECT_THAT(error.what(), HasSubstr("has no trigger source"));
  }
}

}  // namespace
}  // namespace drape::capture
