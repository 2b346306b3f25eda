// SPDX-License-Identifier: Apache-2.0
// Emulated cameras whose clocks jump, drift, or are synchronised by PTP; and identical cameras.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "capture/doctor/checks.hpp"
#include "capture/live/test_live_bench.hpp"
#include "core/error.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/gige_camera/gige_camera.hpp"
#include "tests/support/gige_camera/private_network.hpp"
#include "tests/support/paths.hpp"

namespace drape::capture {
namespace {

using test::all_faults;
using test::GigeCamera;
using test::GigeCameraOptions;
using testing::HasSubstr;

class Clocks : public test::CameraTest {
 protected:
  /// A camera of 64 x 48 px that shows a ramp.
  GigeCamera& add(GigeCameraOptions options) {
    const std::size_t n = devices_.size();
    options.address = fmt::format("127.0.0.{}", 2 + n);
    options.width_px = 64;
    options.height_px = 48;
    devices_.push_back(std::make_unique<GigeCamera>(options));
    file_.frame_rate_hz = 20;
    file_.largest_spread_s = 0.02;
    file_.cameras.push_back(
        test::camera_at(fmt::format("cam{}", n), options.address, 64, 48, file_.frame_rate_hz));
    return *devices_.back();
  }

  [[nodiscard]] LiveResult capture(int frames, const std::function<void(int)>& at_set = {}) const {
    return test::capture_with(file_, frames, at_set);
  }

  void ask_for_ptp() {
    for (LiveCamera& camera : file_.cameras) camera.settings.ptp = true;
  }

  CamerasFile file_;
  std::vector<std::unique_ptr<GigeCamera>> devices_;
};

/// Checks that frames of one set were exposed together, by the emulators' own logs, which use the
/// host's clock.
void expect_together(const LiveResult& live) {
  for (const PairedFrames& set : live.pairing.sets) EXPECT_LE(set.spread_s.value(), 0.02);
  for (const CameraLedger& ledger : live.pairing.cameras) EXPECT_TRUE(ledger.closes());
}

TEST_F(Clocks, AJumpIsNamedAndNoFrameGetsATimeOfTheWrongClock) {
  add({.clock_offset_s = 2});
  add({.clock_offset_s = -3});
  bool jumped = false;
  const LiveResult live = capture(50, [&](int sets) {
    if (sets >= 20 && !std::exchange(jumped, true)) devices_[1]->jump_clock(0.25);
  });
  // 0.25 s, as accurately as readings on a busy machine allow.
  EXPECT_THAT(all_faults(live), HasSubstr("cam1: its clock jumped by 0."));
  EXPECT_GE(live.pairing.sets.size(), 20U);
  expect_together(live);
  // By the emulators' own logs: ids start at 1 and are consecutive, unless a host was restarted.
  for (const LiveCameraReport& camera : live.report.cameras)
    if (camera.host_launches > 1) return;
  int wrong = 0;
  for (const PairedFrames& set : live.pairing.sets) {
    std::vector<std::int64_t> exposed_ns;
    for (std::size_t c = 0; c < 2; ++c) {
      const auto index = static_cast<std::size_t>(live.frames[set.frames[c]].mark.index);
      exposed_ns.push_back(devices_[c]->exposures().at(index).host_ns);
    }
    if (std::abs(exposed_ns[0] - exposed_ns[1]) > 30'000'000) ++wrong;
  }
  EXPECT_EQ(wrong, 0);
}

/// After a jump by one period each frame looks like its neighbour until the clock is read again; no
/// set from that time may be handed over.
TEST_F(Clocks, NoSetIsHandedOverBeforeAJumpIsSeen) {
  add({.clock_offset_s = 2});
  add({.clock_offset_s = -3});
  LiveOptions options;
  options.frames = 30;
  options.patience_s = options.opening_s = 300;
  options.host_program = test::program("drape-camera-host");
  int sets = 0, wrong = 0, launches = 0;
  options.on_set = [&](const LiveSet& set, const LiveReport& report) {
    for (const LiveCameraReport& camera : report.cameras)
      launches = std::max(launches, camera.host_launches);
    std::vector<std::int64_t> exposed_ns;
    for (std::size_t c = 0; c < 2; ++c)
      exposed_ns.push_back(
          devices_[c]->exposures().at(static_cast<std::size_t>(set.frames[c].mark.index)).host_ns);
    wrong += std::abs(exposed_ns[0] - exposed_ns[1]) > 25'000'000 ? 1 : 0;
    if (++sets % 10 == 0) devices_[1]->jump_clock(0.05);
  };
  const LiveResult live = capture_live(file_, options);
  EXPECT_EQ(sets, 30) << all_faults(live);
  EXPECT_THAT(all_faults(live), HasSubstr("cam1: its clock jumped by 0.0"));
  // Ids that restart say nothing about the time of exposure.
  if (launches == 1) {
    EXPECT_EQ(wrong, 0);
  }
}

TEST_F(Clocks, PtpHoldsThemWhereTheCameraHasIt) {
  add({.clock_offset_s = 7, .clock_drift_ppm = 90, .ptp = true});
  add({.clock_offset_s = -7, .clock_drift_ppm = -90, .ptp = true, .ieee1588_names = true});
  ask_for_ptp();
  const LiveResult live = capture(5);
  EXPECT_EQ(live.pairing.sets.size(), 5U) << all_faults(live);
  EXPECT_THAT(all_faults(live), testing::Not(HasSubstr("PTP")));
  for (const LiveCameraReport& camera : live.report.cameras) {
    EXPECT_EQ(setting_in(camera.settings, "ptp_status"), "Slave");
    EXPECT_EQ(setting_in(camera.settings, "ptp_offset_ns"), "300");
    ASSERT_TRUE(camera.clock);
    // The readings bound the offset, which is 0 for a clock synchronised by PTP.
    const auto offset_ns =
        static_cast<double>(camera.clock->reference_device_ns - camera.clock->reference_host_ns);
    EXPECT_LE(std::abs(1e-9 * offset_ns), 5e-3 + camera.clock->bound_s);
  }
}

TEST_F(Clocks, PtpThatIsNotThereOrLiesIsNamed) {
  add({.ptp = true});
  add({.ptp = true, .ptp_error_s = 37});  // one in UTC, one in TAI
  ask_for_ptp();
  const LiveResult lies = capture(3);
  EXPECT_THAT(all_faults(lies), HasSubstr("cam1: it says that PTP holds its clock, which is 37.0"));
  EXPECT_EQ(lies.pairing.sets.size(), 3U) << "the offset is estimated all the same";
  expect_together(lies);
  file_.cameras.clear();
  devices_.clear();
  add({.ptp = false});  // never finds a PTP master
  ask_for_ptp();
  EXPECT_THAT(all_faults(capture(2)), HasSubstr("cam0: PTP does not hold its clock (Listening)"));
}

TEST_F(Clocks, TwoCamerasOfOneSerialNumberAreRefused) {
  add({.serial = "TWIN"});
  add({.serial = "TWIN"});
  add({.serial = "OTHER"});
  file_.cameras[0].address = {Backend::aravis, "TWIN", "", ""};
  const Error error = test::error_of([&] { return capture(1); });
  EXPECT_THAT(error.what(), HasSubstr("2 cameras have this serial number: 127.0.0.2, 127.0.0.3"));
  const auto found = list_devices(test::program("drape-camera-host"));
  EXPECT_EQ(found.size(), 3U);
  const auto checks = check_devices({.cameras = file_, .found = found});
  EXPECT_FALSE(checks[0].go);
  EXPECT_TRUE(checks[2].go);
}

}  // namespace
}  // namespace drape::capture
