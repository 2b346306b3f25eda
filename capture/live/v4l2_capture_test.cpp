// SPDX-License-Identifier: Apache-2.0
// Captures with the kernel's own V4L2 test driver. Runs only inside the QEMU guest, started by
// tests/end_to_end/live_replay_test.cpp.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cstdlib>

#include "capture/live/live_capture.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/v4l2_guest/v4l2_guest.hpp"
#include "tests/support/v4l2_guest/vivid.hpp"

namespace drape::capture {
namespace {

using test::VividNode;
using testing::HasSubstr;

constexpr const char* kCaptureNode = "/dev/video6";
constexpr double kPatience_s = 300;  // an emulated machine on a busy host is slow

CamerasFile one_webcam() {
  CamerasFile file;
  file.frame_rate_hz = 25;
  file.largest_spread_s = 0.4 / file.frame_rate_hz;
  LiveCamera camera{"cam0", {Backend::v4l2, test::guest_camera(3), "", ""}, {}};
  camera.settings.width_px = 640;
  camera.settings.height_px = 360;
  camera.settings.frame_rate_hz = file.frame_rate_hz;
  file.cameras.push_back(camera);
  return file;
}

/// Captures `frames` sets; calls `after_five` once, when five are captured.
LiveResult capture(int frames, const std::function<void()>& after_five = {},
                   double patience_s = kPatience_s) {
  LiveOptions options;
  options.frames = frames;
  options.patience_s = patience_s;
  options.opening_s = kPatience_s;
  options.host_program = test::program("drape-camera-host");
  bool done = false;
  options.progress = [&](double fraction, const std::string&) {
    if (done || !after_five || fraction * frames < 5) return;
    done = true;
    after_five();
  };
  return capture_live(one_webcam(), options);
}

std::string all_faults(const LiveResult& live) {
  std::string text;
  for (const LiveFault& f : live.report.faults) text += f.camera + ": " + f.what + "\n";
  return text;
}

TEST(V4l2Capture, ADisconnectedCameraIsBackWithItsSettings) {
  const LiveResult live = capture(15, [] { VividNode(kCaptureNode).set("Disconnect"); });
  const LiveCameraReport& camera = live.report.cameras[0];
  EXPECT_EQ(live.pairing.sets.size(), 15U) << all_faults(live);
  EXPECT_TRUE(camera.ledger.closes());
  EXPECT_GE(camera.host_launches, 2);
  EXPECT_FALSE(camera.settings.empty());
  EXPECT_FALSE(live.report.faults.empty());
  std::printf("disconnected: frames again after %.2f s; %s", camera.longest_gap_s,
              all_faults(live).c_str());
}

/// No gain in cameras.toml. A refusal keeps the old value; a returning camera gets it again.
TEST(V4l2Capture, GainIsAskedForReadBackAndKept) {
  LiveOptions options;
  options.opening_s = kPatience_s;
  options.host_program = test::program("drape-camera-host");
  std::vector<std::string> refused, gains;
  bool back = false;
  std::size_t asked = 0;
  options.light = [&]() -> std::optional<LiveOptions::Light> {
    constexpr double values[] = {40, 300};
    if (asked == std::size(values) || asked > gains.size()) return std::nullopt;
    LiveOptions::Light light;
    light.wanted.gain_db = values[asked++];
    return light;
  };
  options.on_light = [&](std::size_t, const CameraHost& host,
                         const CameraHost::LightAnswer& answer) {
    if (answer.refused == "the camera is lost") {  // briefly, on an overloaded machine
      --asked;
      return;
    }
    refused.push_back(answer.refused);
    for (const SettingReadBack& one : host.settings())
      if (one.name == "gain_camera_units") gains.push_back(one.value);
    if (gains.size() < 2) return;
    VividNode(kCaptureNode).set("Gain", 7);  // as after a power cycle
    VividNode(kCaptureNode).set("Disconnect");
  };
  options.on_camera = [&](const LiveFault& what) {
    back = back || what.what.find("it sends frames again") != std::string::npos;
  };
  options.demand = [&] { return back ? LiveOptions::Demand::end : LiveOptions::Demand::wait; };
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(300);
  options.ended = [&] { return std::chrono::steady_clock::now() > until; };
  const CamerasFile file = one_webcam();
  static_cast<void>(capture_live(file, options));
  EXPECT_THAT(gains, testing::ElementsAre("40", "40"));
  EXPECT_THAT(refused, testing::ElementsAre("", HasSubstr("gain_camera_units")));
  EXPECT_TRUE(back);
  EXPECT_EQ(VividNode(kCaptureNode).get("Gain"), 40);
}

TEST(V4l2Capture, TheLedgerCountsFaultyAndMissingFrames) {
  VividNode(kCaptureNode).set("Percentage of Dropped Buffers", 60);
  const LiveResult live =
      capture(20, [] { VividNode(kCaptureNode).set("Inject V4L2_BUF_FLAG_ERROR"); });
  VividNode(kCaptureNode).set("Percentage of Dropped Buffers", 0);
  const CameraLedger& ledger = live.report.cameras[0].ledger;
  EXPECT_EQ(ledger.in_set, 20) << all_faults(live);
  EXPECT_GT(ledger.never_arrived, 0);
  EXPECT_GE(ledger.incomplete, 1);
  EXPECT_TRUE(ledger.closes());
  EXPECT_THAT(all_faults(live), HasSubstr("incomplete: the driver marked it as faulty"));
}

TEST(V4l2Capture, TimeStampsThatAreNotTheHostsAreNamedAndPairNothing) {
  VividNode(kCaptureNode).set("Wrap Timestamp", 2);  // about 68 years ahead
  const LiveResult live = capture(1, {}, 1);
  VividNode(kCaptureNode).set("Wrap Timestamp", 0);
  EXPECT_TRUE(live.pairing.sets.empty());
  EXPECT_TRUE(live.report.cameras[0].ledger.closes());
  EXPECT_THAT(all_faults(live), HasSubstr("s off the host's clock"));
}

/// Sends bench1's drape_A through the driver: each frame is written to an output, and the program
/// captures the three cameras that show them together. The recording remains in $DRAPE_GUEST_FOLDER
/// for the host to examine.
TEST(V4l2Capture, Bench1ThroughThreeCamerasTogether) {
  const char* folder = std::getenv("DRAPE_GUEST_FOLDER");
  if (folder == nullptr)
    GTEST_SKIP()
        << "DRAPE_GUEST_FOLDER is missing: LiveIsReplay.ThroughTheKernelsV4l2Driver sets it and "
           "runs this in its guest";
  constexpr std::uint32_t width_px = 1600, height_px = 1200, pixel_clock_hz = 20'000'000;
  std::vector<std::unique_ptr<VividNode>> outputs;  // shown while they are open
  for (int c = 0; c < 3; ++c) {
    const auto pixels = read_bytes(std::filesystem::path(folder) / fmt::format("cam{}.raw", c));
    VividNode capture(fmt::format("/dev/video{}", 2 * c));
    VividNode& output =
        *outputs.emplace_back(std::make_unique<VividNode>(fmt::format("/dev/video{}", 2 * c + 1)));
    capture.set("Loop Video");
    capture.set("OSD Text Mode", 2);
    output.set_signal(width_px, height_px, pixel_clock_hz);
    output.set_output_format(width_px, height_px);
    capture.set_signal(width_px, height_px, pixel_clock_hz);
    output.show(pixels);
  }
  const std::string line = fmt::format(
      "'{0}' '{1}/rig' --set drape_A --patience-s {2} --out '{1}/recording' "
      ">'{1}/capture.txt' 2>&1",
      test::program("drape-capture").string(), folder, kPatience_s);
  const int status = std::system(line.c_str());
  EXPECT_EQ(status, 0) << read_text(std::filesystem::path(folder) / "capture.txt");
}

}  // namespace
}  // namespace drape::capture
