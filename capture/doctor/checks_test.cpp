// SPDX-License-Identifier: Apache-2.0
// The doctor's checks without a camera, and refusals of cameras.toml.
#include "capture/doctor/checks.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/run_record.hpp"
#include "tests/support/bench1_calibration.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/paths.hpp"

namespace drape::capture {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

TEST(CamerasFile, RefusesTheSameDeviceTwiceAndAMissingCamera) {
  test::TemporaryFolder folder;
  write_durable(folder.path() / "rig.toml",
                read_text(test::source_root() / "rigs/bench1/rig.toml"));
  const auto expect_refused = [&](const std::string& cameras, const std::string& why) {
    write_durable(folder.path() / "cameras.toml",
                  "schema = \"drapebench/cameras/1\"\n[sync]\nmethod = \"free_run\"\n"
                  "frame_rate_hz = 5.0\n" +
                      cameras);
    const Error error = test::error_of([&] { return read_cameras_file(folder.path()); });
    EXPECT_THAT(error.what(), HasSubstr(why));
  };
  const auto camera = [](const std::string& name, const std::string& device) {
    return fmt::format("[[camera]]\nname = \"{}\"\nbackend = \"aravis\"\ndevice = \"{}\"\n", name,
                       device);
  };
  expect_refused(camera("cam0", "S1") + camera("cam1", "S1"), "are the same device");
  expect_refused(camera("cam0", "S1") + camera("cam1", "S2"), "has no device");
  expect_refused(camera("cam9", "S1"), "no such camera");
  expect_refused(camera("cam0", "S1") + "pixel_format = \"Mono99\"\n", "cannot be recorded");
  expect_refused(camera("cam0", "S1") + "exposure_ms = 3.0\n", "exposure_ms");
}

Check calibration_check(const Evidence& evidence) {
  return check_calibration(evidence).at(0);
}

TEST(DoctorChecks, TheLinkBudgetGivesLoadAndPacketDelay) {
  // 1.31 MB frames in packets of 1500 bytes: 896 + 2 packets of 1538 bytes on the wire.
  const LinkNeeds needs = link_needs(1280 * 1024, 10, 1500, 4, 1e9);
  EXPECT_NEAR(needs.bytes_per_s, 898 * 1538 * 10, 1538 * 10);
  EXPECT_EQ(needs.packet_delay_ns, 3 * 1538 * 8);
  Evidence evidence;
  LiveCameraReport& camera = evidence.live.report.cameras.emplace_back();
  camera.name = "cam0";
  camera.settings = {{"receive_buffer_bytes", "425984"},
                     {"receive_buffer_of_a_frame_bytes", "2200000"},
                     {"stream_socket", "udp"}};
  EXPECT_THAT(check_receive_buffers(evidence).at(0).found,
              HasSubstr("sysctl -w net.core.rmem_max=4400000"));
  EXPECT_TRUE(calibration_check({}).go);
  EXPECT_FALSE(calibration_check({.calibration = "nowhere.json"}).go);
  const test::TemporaryFolder folder;
  evidence.out = folder.path();
  LiveCamera& large = evidence.cameras.cameras.emplace_back();
  large.settings.width_px = large.settings.height_px = 1 << 30;
  EXPECT_FALSE(check_disk(evidence).at(0).go) << "an exabyte";
  large.settings.width_px = large.settings.height_px = 1;
  EXPECT_TRUE(check_disk(evidence).at(0).go && check_disk(evidence).at(1).go);
}

/// Applies however recent the calibration is.
TEST(DoctorChecks, ACalibrationThatIsNoGoIsNotFitToMeasureWith) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "calibration.json";
  Calibration calibration = test::bench1_true_calibration();
  write_calibration(file, calibration);
  EXPECT_TRUE(calibration_check({.calibration = file}).go);
  calibration.no_go = "cam1 misses by 3 px";
  write_calibration(file, calibration);
  const Check check = calibration_check({.calibration = file});
  EXPECT_FALSE(check.go);
  EXPECT_THAT(check.found, HasSubstr("NO-GO: cam1 misses by 3 px"));
  EXPECT_THAT(check.to_type, HasSubstr("drape calib"));
}

/// A copy is as old as its original.
TEST(DoctorChecks, TheAgeOfACalibrationIsThatOfItsRecord) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "calibration.json";
  write_calibration(file, test::bench1_true_calibration());
  const Check unknown = calibration_check({.calibration = file});
  EXPECT_TRUE(unknown.go);
  EXPECT_THAT(unknown.found, HasSubstr("warning, its age is unknown"));
  const auto record = [&](const std::string& ended, const std::string& sha256) {
    RunFile run;
    run.outputs = {{"calibration.json", sha256}};
    run.ended_utc = ended;
    write_record(folder.path() / "calibration.run.json", run);
  };
  record("2020-01-31T12:00:00Z", sha256_of_file(file));
  EXPECT_FALSE(calibration_check({.calibration = file}).go);
  EXPECT_THAT(calibration_check({.calibration = file}).found, HasSubstr("days old, at most 30"));
  EXPECT_TRUE(calibration_check({.calibration = file, .largest_days = 1e6}).go);
  record("2020-01-31T12:00:00Z", std::string(64, '0'));
  EXPECT_THAT(calibration_check({.calibration = file}).found, HasSubstr("of another file"));
}

TEST(DoctorChecks, ACalibrationOfOtherCamerasIsNotFitToMeasureWith) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "calibration.json";
  write_calibration(file, test::bench1_true_calibration());
  CamerasFile rig;
  LiveCamera& camera = rig.cameras.emplace_back();
  camera.name = "cam0";
  camera.settings.width_px = 1600;
  camera.settings.height_px = 1200;
  EXPECT_TRUE(calibration_check({.cameras = rig, .calibration = file}).go);
  camera.settings.width_px = 1200;
  EXPECT_FALSE(calibration_check({.cameras = rig, .calibration = file}).go);
  camera.settings.width_px = 1600;
  camera.name = "camX";
  EXPECT_FALSE(calibration_check({.cameras = rig, .calibration = file}).go);
  EXPECT_THAT(calibration_check({.cameras = rig, .calibration = file}).found, HasSubstr("camX"));
}

TEST(DoctorChecks, AClockIsKnownNoBetterThanItsDriftLets) {
  Evidence evidence;
  evidence.cameras.cameras.emplace_back().name = "cam0";
  evidence.cameras.largest_spread_s = 3e-4;
  LiveCameraReport& camera = evidence.live.report.cameras.emplace_back();
  camera.name = "cam0";
  camera.clock = ClockFit{.bound_s = 1e-4, .drift_bound_s = 0, .drift_estimated = true};
  const auto look = [&] { return check_capture(evidence).at(1); };
  EXPECT_EQ(look().name, "clock of cam0");
  EXPECT_TRUE(look().go);
  camera.clock = ClockFit{.bound_s = 1e-4, .drift_bound_s = 5e-4};
  EXPECT_FALSE(look().go);
  EXPECT_THAT(look().found, HasSubstr("0.600 ms"));
  EXPECT_THAT(look().to_type, HasSubstr("the drift of a clock"));
}

/// Two webcams of 1280 x 720 px on one bus of 480 Mbit/s, as the kernel lists them.
TEST(DoctorChecks, CamerasOfOneUsbBusMustFitIt) {
  const test::TemporaryFolder sys;
  Evidence evidence{.sys = sys.path()};
  CamerasFile& cameras = evidence.cameras;
  LiveReport& report = evidence.live.report;
  cameras.frame_rate_hz = 10;
  for (int k = 0; k < 2; ++k) {
    const fs::path usb = sys.path() / fmt::format("devices/pci/usb1/1-{}", k + 1);
    const fs::path video = sys.path() / fmt::format("class/video4linux/video{}", k);
    fs::create_directories(usb / "interface");
    fs::create_directories(video);
    write_durable(usb / "busnum", "1\n");
    write_durable(usb / "speed", "480\n");
    fs::create_directory_symlink(usb / "interface", video / "device");
    LiveCamera& camera = cameras.cameras.emplace_back();
    camera.name = fmt::format("cam{}", k);
    camera.address.backend = Backend::v4l2;
    camera.address.device = fmt::format("usb-{}", k);
    camera.settings.width_px = 1280;
    camera.settings.height_px = 720;
    report.cameras.emplace_back().settings = {{"pixel_format", "YUYV"}};
    FoundDevice& device = evidence.found.emplace_back();
    device.backend = Backend::v4l2;
    device.name = camera.address.device;
    device.identity.address = fmt::format("/dev/video{}", k);
  }
  // Two of 1280 x 720 x 2 bytes, 10 times a second: 295 Mbit/s of the 384 available for pictures.
  std::vector<Check> checks = check_usb(evidence);
  ASSERT_EQ(checks.size(), 1U);
  EXPECT_EQ(checks[0].name, "USB bus 1");
  EXPECT_TRUE(checks[0].go) << checks[0].found;
  EXPECT_THAT(checks[0].found, HasSubstr("295 Mbit/s for cam0, cam1; 384 of its 480 Mbit/s"));
  cameras.frame_rate_hz = 15;
  checks = check_usb(evidence);
  EXPECT_FALSE(checks.at(0).go);
  EXPECT_THAT(checks.at(0).to_type, HasSubstr("frame_rate_hz = 13.0 or less"));
  report.cameras[1].settings = {{"pixel_format", "MJPG"}};
  EXPECT_TRUE(check_usb(evidence).at(0).go);
  for (const int k : {0, 1})
    write_durable(sys.path() / fmt::format("devices/pci/usb1/1-{}/speed", k + 1), "5000\n");
  report.cameras[1].settings = {{"pixel_format", "YUYV"}};
  EXPECT_TRUE(check_usb(evidence).at(0).go);
  evidence.found.clear();
  EXPECT_TRUE(check_usb(evidence).empty()) << "no device, nothing to say";
}

TEST(DoctorChecks, AnAcceptanceThatIsOutOfDateIsWarnedOf) {
  const test::TemporaryFolder folder;
  const fs::path calibration = folder.path() / "calibration.json";
  write_durable(calibration, "{}");
  Evidence evidence{.calibration = calibration};
  evidence.cameras.rig_file = folder.path() / "lab.toml";
  const auto look = [&](const char* today) {
    evidence.today = today;
    return check_acceptance(evidence).at(0);
  };
  EXPECT_TRUE(look("2026-03-01").go) << "none is no fault";
  const auto write = [&](bool go, const std::string& sha256) {
    Json json;
    json = {{"schema", "drapebench/acceptance/1"}, {"rig", "lab"}, {"positions", 9}};
    json["figures"] = Json::array();
    json["calibration_sha256"] = sha256;
    json["date"] = "2026-01-31";
    json["valid_until"] = "2027-01-31";
    json["go"] = go;
    json["cause"] = go ? Json() : Json("cam1 moved since the calibration");
    write_json(folder.path() / "acceptance.json", json);
  };
  const std::string own = sha256_of_file(calibration), another(64, '0');
  write(true, own);
  EXPECT_THAT(look("2027-01-31").found, testing::Not(HasSubstr("warning")));
  EXPECT_THAT(look("2027-02-01").found, HasSubstr("warning, expired"));
  write(true, another);
  EXPECT_THAT(look("2026-03-01").found, HasSubstr("warning, of another calibration"));
  write(false, own);
  EXPECT_FALSE(look("2026-03-01").go);
  EXPECT_THAT(look("2026-03-01").found, HasSubstr("NO-GO, cam1 moved"));
}

}  // namespace
}  // namespace drape::capture
