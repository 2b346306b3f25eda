// SPDX-License-Identifier: Apache-2.0
// Captures with emulated cameras: real packets, real camera host processes.
#include "capture/live/live_capture.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <thread>
#include <utility>

#include "capture/live/test_live_bench.hpp"
#include "capture/recording/test_record.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/gige_camera/private_network.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"

namespace drape::capture {
namespace {

using test::all_faults;
using test::expect_right_sets;
using test::LiveCapture;
using test::picture;
using Bench = test::LiveBench;
using testing::AllOf;
using testing::HasSubstr;

/// Sends random datagrams from an address that belongs to no camera.
void send_junk(std::uint16_t port, int count, const std::string& from, const std::string& to,
               unsigned seed) {
  const int s = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in source{}, target{};
  source.sin_family = target.sin_family = AF_INET;
  ::inet_pton(AF_INET, from.c_str(), &source.sin_addr);
  ::inet_pton(AF_INET, to.c_str(), &target.sin_addr);
  target.sin_port = htons(port);
  ASSERT_EQ(::bind(s, reinterpret_cast<const sockaddr*>(&source), sizeof source), 0);
  std::mt19937 random(seed);
  for (int i = 0; i < count; ++i) {
    std::uint8_t datagram[64];
    for (std::uint8_t& byte : datagram) byte = static_cast<std::uint8_t>(random());
    ::sendto(s, datagram, 8 + random() % 56, 0, reinterpret_cast<const sockaddr*>(&target),
             sizeof target);
  }
  ::close(s);
}

class EverySync : public test::CameraTest, public testing::WithParamInterface<SyncMethod> {};

/// Pulses the trigger lines of all cameras simultaneously, 20 times a second.
class LinePulses {
 public:
  explicit LinePulses(const Bench& bench)
      : thread_([this, &bench] {
          while (!ended_) {
            for (const auto& device : bench.devices) device->pulse_line();
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
          }
        }) {}
  ~LinePulses() {
    ended_ = true;
    thread_.join();
  }
  LinePulses(const LinePulses&) = delete;
  LinePulses& operator=(const LinePulses&) = delete;

 private:
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

TEST_P(EverySync, GivesWholeSetsOfOneInstant) {
  const Bench bench(3, GetParam());
  const LinePulses pulses(bench);
  const LiveResult live = bench.capture(10);
  ASSERT_EQ(live.pairing.sets.size(), 10U) << all_faults(live);
  expect_right_sets(bench, live);
  EXPECT_EQ(live.report.method, GetParam());
  EXPECT_TRUE(live.report.why_fallen_back.empty());
  std::vector<double> spreads_s;
  for (const PairedFrames& set : live.pairing.sets) spreads_s.push_back(set.spread_s.value());
  std::sort(spreads_s.begin(), spreads_s.end());
  std::printf("%s: spread p50 %.3f ms, max %.3f ms\n", to_string(GetParam()).c_str(),
              1e3 * spreads_s[5], 1e3 * spreads_s.back());
  for (const CameraLedger& ledger : live.pairing.cameras) {
    EXPECT_EQ(ledger.expected, 10);
    EXPECT_EQ(ledger.in_set, 10);
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, EverySync,
                         testing::Values(SyncMethod::free_run, SyncMethod::software_trigger,
                                         SyncMethod::line_trigger, SyncMethod::action,
                                         SyncMethod::scheduled_action),
                         [](const auto& method) { return to_string(method.param); });

/// The ledger equals the emulators' logs: with 0 to 5 % of packets lost and frames never sent.
TEST_F(LiveCapture, TheLedgerIsThatOfTheCameras) {
  const int triggers = test::trial_count(8, 1300);
  for (const double loss : {0.0, 0.001, 0.01, 0.05}) {
    const Bench bench(2, SyncMethod::software_trigger, 320, 240, 100);
    for (const auto& device : bench.devices) device->set_faults({.lose = loss, .skip_frame = 0.02});
    const LiveResult live = bench.capture(triggers);
    expect_right_sets(bench, live);
    for (std::size_t c = 0; c < 2; ++c) {
      const auto sent = bench.devices[c]->counts();
      const CameraLedger& ledger = live.pairing.cameras[c];
      const auto frames = [](std::int64_t n) { return static_cast<std::uint64_t>(n); };
      // Triggers sent before the capture show that the cameras respond.
      const auto before = frames(live.report.triggers_before);
      EXPECT_EQ(frames(ledger.expected) + before, sent.triggers);
      EXPECT_LE(frames(ledger.never_arrived), sent.frames_skipped);
      EXPECT_GE(frames(ledger.never_arrived) + before, sent.frames_skipped);
      const auto arrived = frames(ledger.in_set + ledger.unpaired + ledger.incomplete);
      EXPECT_LE(arrived, sent.frames_sent);
      EXPECT_GE(arrived + before, sent.frames_sent);
      EXPECT_EQ(ledger.incomplete, 0) << all_faults(live);
      // On a busy machine packets that are merely late are requested again too; lost ones always.
      const auto resent = frames(live.report.cameras[c].counters.packets_resent);
      EXPECT_GE(resent, sent.packets_lost);
      EXPECT_LE(resent, sent.packets_resent);
      std::printf(
          "loss %.1f %%, cam%zu: %lu triggers, %lu frames sent, %lu never; ledger %ld expected, "
          "%ld in sets, %ld unpaired, %ld incomplete, %ld never arrived; packets lost %lu, resent "
          "%lu, counted %lu\n",
          100 * loss, c, sent.triggers, sent.frames_sent, sent.frames_skipped, ledger.expected,
          ledger.in_set, ledger.unpaired, ledger.incomplete, ledger.never_arrived,
          sent.packets_lost, sent.packets_resent, resent);
    }
  }
}

TEST_F(LiveCapture, FreeRunningCamerasThatExposeApartAreBroughtIntoStep) {
  bool apart = false;
  // On a busy machine cameras started by one command can be in step by chance.
  for (int attempt = 0; attempt < 5 && !apart; ++attempt) {
    // Periods of 100 ms; each camera exposes with its own delay after its start.
    const Bench bench(3, SyncMethod::free_run, 320, 240, 10, {0.0, 0.033, 0.067});
    const LiveResult live = bench.capture(5);
    ASSERT_EQ(live.pairing.sets.size(), 5U) << all_faults(live);
    expect_right_sets(bench, live);
    for (const PairedFrames& set : live.pairing.sets) EXPECT_LE(set.spread_s.value(), 0.04);
    apart = all_faults(live).find("its stream begins again in step") != std::string::npos;
    std::printf("in step: spread %.1f ms; %s", 1e3 * live.pairing.sets[0].spread_s.value(),
                all_faults(live).c_str());
  }
  EXPECT_TRUE(apart);
}

TEST_F(LiveCapture, FourCamerasAtTenFramesASecondCompleteEverySet) {
  const Bench bench(4, SyncMethod::free_run, 1280, 1024, 10);
  const int frames = test::trial_count(10, 600);
  const LiveResult live = bench.capture(frames, 5, false);
  EXPECT_EQ(live.pairing.sets.size(), static_cast<std::size_t>(frames)) << all_faults(live);
  std::int64_t lost = 0;
  for (const CameraLedger& ledger : live.pairing.cameras) {
    EXPECT_TRUE(ledger.closes());
    lost += ledger.never_arrived + ledger.incomplete;
  }
  std::printf("%zu sets of 4 whole, %ld frames lost\n", live.pairing.sets.size(), lost);
}

TEST_F(LiveCapture, JunkToTheStreamAndControlPortsTouchesNoCamera) {
  const Bench bench(2, SyncMethod::free_run);
  const int datagrams = test::trial_count(30'000, 1'000'000);
  std::thread junk;
  // Sent to the grabber's stream and control ports during the capture.
  const LiveResult live = bench.capture(test::trial_count(30, 600), 20, true, [&](int sets) {
    if (sets < 5 || junk.joinable()) return;
    const std::uint16_t ports[] = {bench.devices[0]->stream_port(),
                                   bench.devices[0]->controller_port()};
    junk = std::thread([datagrams, ports] {
      for (unsigned round = 0; round < 100; ++round) {
        for (const std::uint16_t port : ports)
          send_junk(port, datagrams / 200, "127.0.0.99", "127.0.0.1", round);
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
  });
  ASSERT_TRUE(junk.joinable());
  junk.join();
  expect_right_sets(bench, live);
  // On a busy machine each emulated camera skips exposures independently.
  for (const LiveFault& fault : live.report.faults)
    EXPECT_THAT(fault.what, HasSubstr("no frame of every other camera")) << all_faults(live);
  for (const LiveCameraReport& camera : live.report.cameras) {
    EXPECT_EQ(camera.host_launches, 1);
    EXPECT_EQ(camera.ledger.never_arrived + camera.ledger.incomplete, 0);
  }
}

/// From the camera's own address, but a port other than that of its stream.
TEST_F(LiveCapture, JunkFromTheCamerasAddressLeavesTheOthersAlone) {
  const Bench bench(2, SyncMethod::free_run);
  bool sent = false;
  const LiveResult live = bench.capture(20, 20, true, [&](int sets) {
    if (sets >= 5 && !std::exchange(sent, true))
      send_junk(bench.devices[0]->stream_port(), 5000, "127.0.0.2", "127.0.0.1", 1);
  });
  expect_right_sets(bench, live);
  EXPECT_EQ(live.pairing.sets.size(), 20U);
  EXPECT_EQ(live.report.cameras[1].host_launches, 1);
  EXPECT_EQ(live.pairing.cameras[1].never_arrived, 0);
}

TEST_F(LiveCapture, AFallBackIsNamed) {
  const auto recording = test::source_root() / "rigs/bench1/recording";
  CamerasFile file;
  file.method = SyncMethod::scheduled_action;
  file.fall_backs = {SyncMethod::software_trigger, SyncMethod::free_run};
  file.largest_spread_s = 0.01;
  for (const std::string name : {"cam0", "cam1"}) {
    LiveCamera camera{name, {Backend::replay, name, "", recording.string()}, {}};
    camera.settings.width_px = 1600;
    camera.settings.height_px = 1200;
    file.cameras.push_back(camera);
  }
  LiveOptions options;
  options.frames = 2;
  options.host_program = test::program("drape-camera-host");
  const LiveResult live = capture_live(file, options);
  EXPECT_EQ(live.report.method, SyncMethod::free_run);
  EXPECT_THAT(live.report.why_fallen_back,
              AllOf(HasSubstr("scheduled_action: camera `cam"), HasSubstr("software_trigger"),
                    HasSubstr("a recording cannot be triggered")));
  EXPECT_EQ(live.pairing.sets.size(), 2U);
}

TEST_F(LiveCapture, ACameraThatIsNotThereIsNamed) {
  Bench bench(2, SyncMethod::free_run);
  bench.file.cameras[1].address = {Backend::aravis, "NOBODY", "", ""};
  const Error error = test::error_of([&] { return bench.capture(1); });
  EXPECT_EQ(error.kind(), ErrorKind::device);
  EXPECT_EQ(error.where().camera, "cam1");
  EXPECT_THAT(error.what(), HasSubstr("DB0000"));
}

TEST_F(LiveCapture, OneCameraNamedBySerialNumberAndByAddressIsNamedTwice) {
  for (const int by_serial : {0, 1}) {
    Bench bench(2, SyncMethod::free_run);
    bench.file.file = "cameras.toml";
    bench.file.cameras[1].address = bench.file.cameras[0].address;
    bench.file.cameras[static_cast<std::size_t>(by_serial)].address = {Backend::aravis, "DB0000",
                                                                       "", ""};
    const Error error = test::error_of([&] { return bench.capture(1); });
    EXPECT_EQ(error.kind(), ErrorKind::device);
    EXPECT_THAT(error.what(), AllOf(HasSubstr("cameras `cam0` and `cam1` of cameras.toml are the "
                                              "same device: serial number DB0000"),
                                    HasSubstr("give each [[camera]] a device of its own")));
  }
}

class RefusedFrames : public test::CameraTest {
 protected:
  /// Captures one set with camera 1 showing `pixels`, and stores it.
  RecordResult record(const std::vector<std::uint8_t>& pixels) {
    Bench bench(2, SyncMethod::software_trigger, 320, 240, 2);  // spread up to 0.2 s
    bench.devices[1]->show(pixels);
    const LiveResult live = bench.capture(1);
    RecordOptions options;
    options.folder = temporary_.path() / "recording";
    options.set = "drape";
    options.largest_spread_s = bench.file.largest_spread_s;
    options.recorded_on = "2026-01-01";
    return record_live(live, bench.file, options);
  }
  [[nodiscard]] bool nothing_stored() const {
    return !std::filesystem::exists(temporary_.path() / "recording");
  }
  test::TemporaryFolder temporary_;
};

TEST_F(RefusedFrames, BlackSaturatedAndBlurredOnesAreNamedAndNotStored) {
  std::vector<std::uint8_t> black(320 * 240, 2), white(320 * 240, 255), blurred;
  for (int i = 0; i < 320 * 240; ++i)
    blurred.push_back(static_cast<std::uint8_t>(20 + i % 320 / 2));
  for (const auto& [pixels, why] :
       {std::pair{black, "black"}, {white, "saturated"}, {blurred, "blurred"}}) {
    const RecordResult result = record(pixels);
    ASSERT_EQ(result.refused.size(), 1U) << why;
    EXPECT_EQ(result.refused[0].camera, "cam1");
    EXPECT_THAT(result.refused[0].what, HasSubstr(why));
    EXPECT_FALSE(result.refused[0].what_to_do.empty());
    EXPECT_TRUE(nothing_stored()) << why;
  }
  const RecordResult good = record(picture(320, 240, 5));
  EXPECT_THAT(good.sets, testing::ElementsAre("drape"));
  EXPECT_THROW(static_cast<void>(record(picture(320, 240, 5))), Error) << "the set exists";
}

}  // namespace
}  // namespace drape::capture
