// SPDX-License-Identifier: Apache-2.0
// Whole captures against emulated cameras: real packets, real camera host processes.
#include "capture/live/live_capture.hpp"

#include <arpa/inet.h>
#include <dirent.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <thread>

#include "capture/live/record.hpp"
#include "core/error.hpp"
#include "core/files.hpp"
#include "tests/support/gige_camera/gige_camera.hpp"
#include "tests/support/gige_camera/private_network.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"

namespace drape {
namespace {

using test::GigeCamera;
using test::GigeCameraOptions;
using testing::AllOf;
using testing::HasSubstr;

/// A picture with edges, darks and brights, different for every seed.
std::vector<std::uint8_t> picture(int width_px, int height_px, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < height_px; ++y)
    for (int x = 0; x < width_px; ++x)
      pixels.push_back(
          static_cast<std::uint8_t>(((x / 16 + y / 16) % 2 != 0 ? 200 : 20) + random() % 8));
  return pixels;
}

/// `count` cameras with clocks that have nothing in common.
struct Bench {
  explicit Bench(std::size_t count, SyncMethod method, int width_px = 320, int height_px = 240,
                 double rate_hz = 20) {
    file.method = method;
    file.frame_rate_hz = rate_hz;
    file.largest_spread_s = 0.4 / rate_hz;
    for (std::size_t i = 0; i < count; ++i) {
      const auto n = static_cast<unsigned>(i);
      GigeCameraOptions options;
      options.address = fmt::format("127.0.0.{}", 2 + i);
      options.serial = fmt::format("DB{:04}", i);
      options.width_px = width_px;
      options.height_px = height_px;
      options.clock_offset_s = 3.3 * static_cast<double>(i) - 5;
      options.clock_drift_ppm = 60 * static_cast<double>(i) - 60;
      options.first_frame_id = static_cast<std::uint16_t>(65530 + i);
      options.seed = n + 1;
      devices.push_back(std::make_unique<GigeCamera>(options));
      pictures.push_back(picture(width_px, height_px, n));
      devices.back()->show(pictures.back());
      LiveCamera camera{
          fmt::format("cam{}", i), {Backend::aravis, options.address, "127.0.0.1", ""}, {}};
      camera.settings.width_px = width_px;
      camera.settings.height_px = height_px;
      camera.settings.frame_rate_hz = rate_hz;
      camera.settings.exposure_us = 1000;
      camera.settings.packet_size_bytes = 8192;
      file.cameras.push_back(camera);
    }
  }

  [[nodiscard]] LiveResult capture(int frames, double patience_s = 5, bool keep = true,
                                   const std::function<void(int)>& at_set = {}) const {
    LiveOptions options;
    if (at_set)
      options.progress = [&](double share, const std::string&) {
        at_set(static_cast<int>(share * frames));
      };
    options.frames = frames;
    options.patience_s = patience_s;
    options.keep_pixels = keep;
    options.host_program = test::program("drape-camera-host");
    return capture_live(file, options);
  }

  CamerasFile file;
  std::vector<std::unique_ptr<GigeCamera>> devices;
  std::vector<std::vector<std::uint8_t>> pictures;
};

/// Every frame of every set is the camera's picture, and its exposures were one instant.
void expect_right_sets(const Bench& bench, const LiveResult& live) {
  for (const PairedFrames& set : live.pairing.sets) {
    ASSERT_EQ(set.frames.size(), bench.devices.size());
    for (std::size_t c = 0; c < set.frames.size(); ++c)
      EXPECT_EQ(live.frames[set.frames[c]].pixels, bench.pictures[c]);
  }
  for (const CameraLedger& ledger : live.pairing.cameras) EXPECT_TRUE(ledger.closes());
}

std::string all_faults(const LiveResult& live) {
  std::string text;
  for (const LiveFault& f : live.report.faults)
    text += fmt::format("{}: {} [{}]\n", f.camera, f.what, f.what_to_do);
  return text;
}

/// Processes that run a camera host and are children of this one.
std::vector<pid_t> camera_hosts() {
  std::vector<pid_t> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (!std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isdigit(c); }))
      continue;
    std::ifstream stat(entry.path() / "stat");
    std::string text;
    std::getline(stat, text);
    const std::size_t end = text.rfind(')');
    if (end == std::string::npos || text.find("(drape-camera-ho)") == std::string::npos) continue;
    char state = 0;
    int parent = 0;
    if (std::sscanf(text.c_str() + end + 1, " %c %d", &state, &parent) == 2 && parent == ::getpid())
      found.push_back(std::stoi(name));
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// Random datagrams from an address that is no camera's.
void send_junk(std::uint16_t port, int count, const std::string& from, const std::string& to,
               unsigned seed) {
  const int s = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in source{}, target{};
  source.sin_family = target.sin_family = AF_INET;
  ::inet_pton(AF_INET, from.c_str(), &source.sin_addr);
  ::inet_pton(AF_INET, to.c_str(), &target.sin_addr);
  target.sin_port = htons(port);
  ::bind(s, reinterpret_cast<const sockaddr*>(&source), sizeof source);
  std::mt19937 random(seed);
  for (int i = 0; i < count; ++i) {
    std::uint8_t datagram[64];
    for (std::uint8_t& byte : datagram) byte = static_cast<std::uint8_t>(random());
    ::sendto(s, datagram, 8 + random() % 56, 0, reinterpret_cast<const sockaddr*>(&target),
             sizeof target);
  }
  ::close(s);
}

class EverySync : public testing::TestWithParam<SyncMethod> {};

TEST_P(EverySync, GivesWholeSetsOfOneInstant) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
  const Bench bench(3, GetParam());
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
                                         SyncMethod::action, SyncMethod::scheduled_action),
                         [](const auto& method) { return to_string(method.param); });

TEST(LiveCapture, LedgerCountsWhatTheCamerasNeverSent) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
  const Bench bench(2, SyncMethod::software_trigger);
  for (const auto& device : bench.devices) device->set_faults({.lose = 0.02, .skip_frame = 0.2});
  const LiveResult live = bench.capture(20);
  expect_right_sets(bench, live);
  for (std::size_t c = 0; c < 2; ++c) {
    const auto counts = bench.devices[c]->counts();
    const CameraLedger& ledger = live.pairing.cameras[c];
    EXPECT_EQ(ledger.expected, 20);
    EXPECT_EQ(static_cast<std::uint64_t>(ledger.never_arrived), counts.frames_skipped);
    EXPECT_EQ(counts.triggers, 20U);
    // A packet that is merely late on a busy machine is asked for, too; a lost one always.
    EXPECT_GE(static_cast<std::uint64_t>(live.report.cameras[c].counters.packets_resent),
              counts.packets_lost);
  }
}

TEST(LiveCapture, FourCamerasAtTenFramesASecondCompleteEverySet) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
  const Bench bench(4, SyncMethod::free_run, 1280, 1024, 10);
  const int frames = test::trial_count(20, 600);
  const LiveResult live = bench.capture(frames, 5, false);
  EXPECT_EQ(live.pairing.sets.size(), static_cast<std::size_t>(frames)) << all_faults(live);
  std::int64_t lost = 0;
  for (const CameraLedger& ledger : live.pairing.cameras) {
    EXPECT_TRUE(ledger.closes());
    lost += ledger.never_arrived + ledger.incomplete;
  }
  std::printf("%zu sets of 4 whole, %ld frames lost\n", live.pairing.sets.size(), lost);
}

TEST(LiveCapture, AKilledCameraHostIsBackAndTheOthersLoseNothing) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
  const Bench bench(3, SyncMethod::free_run);
  std::thread killer([] {
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    const auto hosts = camera_hosts();
    if (!hosts.empty()) ::kill(hosts[0], SIGKILL);
  });
  const LiveResult live = bench.capture(60);
  killer.join();
  expect_right_sets(bench, live);
  ASSERT_EQ(live.pairing.sets.size(), 60U);
  EXPECT_THAT(all_faults(live), AllOf(HasSubstr("ended by signal 9"), HasSubstr("opened again")));
  int restarted = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const LiveCameraReport& camera = live.report.cameras[c];
    if (camera.host_launches > 1) {
      ++restarted;
      EXPECT_GT(camera.ledger.never_arrived, 0);
      EXPECT_FALSE(camera.settings.empty());  // read back again
      std::printf("killed host: frames again after %.2f s, %d launches\n", camera.longest_gap_s,
                  camera.host_launches);
    } else {
      EXPECT_EQ(camera.ledger.never_arrived + camera.ledger.incomplete, 0);
    }
  }
  EXPECT_EQ(restarted, 1);
}

TEST(LiveCapture, AnUnpluggedCameraIsNoticedAndBack) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
  const Bench bench(2, SyncMethod::free_run);
  const auto now_ns = [] {
    return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  };
  std::int64_t unplugged_ns = 0, back_ns = 0;
  const LiveResult live = bench.capture(60, 20, true, [&](int sets) {
    if (sets >= 20 && unplugged_ns == 0) {
      bench.devices[1]->unplug();
      unplugged_ns = now_ns();
    } else if (unplugged_ns != 0 && back_ns == 0 && now_ns() - unplugged_ns > 2'000'000'000) {
      bench.devices[1]->plug_in();
      back_ns = now_ns();
    }
  });
  expect_right_sets(bench, live);
  EXPECT_EQ(live.pairing.sets.size(), 60U);
  EXPECT_THAT(all_faults(live), HasSubstr("cam1: "));
  EXPECT_EQ(live.pairing.cameras[0].never_arrived, 0);
  EXPECT_GT(live.pairing.cameras[1].never_arrived, 0);
  EXPECT_GT(live.report.cameras[1].host_launches, 1);
  EXPECT_EQ(bench.devices[1]->register_real(test::reg::exposure_us), 1000);
  EXPECT_FALSE(live.report.cameras[1].settings.empty());
  const auto exposures = bench.devices[1]->exposures();
  const auto first = std::find_if(exposures.begin(), exposures.end(),
                                  [&](const auto& e) { return e.host_ns > back_ns; });
  ASSERT_TRUE(first != exposures.end());
  std::printf(
      "unplugged 2 s: noticed %.2f s after the last frame, captured again %.2f s after it "
      "was back\n",
      live.report.cameras[1].longest_unnoticed_s,
      1e-9 * static_cast<double>(first->host_ns - back_ns));
}

TEST(LiveCapture, JunkToTheStreamAndControlPortsTouchesNoCamera) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
  const Bench bench(2, SyncMethod::free_run);
  const int datagrams = test::trial_count(30'000, 1'000'000);
  std::thread junk([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(1000));
    for (int round = 0; round < 10; ++round) {
      const auto seed = static_cast<unsigned>(round);
      // To the grabber's stream and control ports, and to the camera's own control port.
      send_junk(bench.devices[0]->stream_port(), datagrams / 20, "127.0.0.99", "127.0.0.1", seed);
      send_junk(bench.devices[0]->controller_port(), datagrams / 20, "127.0.0.99", "127.0.0.1",
                seed);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  const LiveResult live = bench.capture(test::trial_count(60, 600));
  junk.join();
  expect_right_sets(bench, live);
  EXPECT_TRUE(live.report.faults.empty()) << all_faults(live);
  for (const LiveCameraReport& camera : live.report.cameras) {
    EXPECT_EQ(camera.host_launches, 1);
    EXPECT_EQ(camera.ledger.never_arrived + camera.ledger.incomplete, 0);
  }
}

TEST(LiveCapture, JunkFromTheCamerasAddressLeavesTheOthersAlone) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
  // The camera's own address, but another port than its stream's.
  const Bench bench(2, SyncMethod::free_run);
  std::thread junk([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(1000));
    send_junk(bench.devices[0]->stream_port(), 5000, "127.0.0.2", "127.0.0.1", 1);
  });
  const LiveResult live = bench.capture(40);
  junk.join();
  expect_right_sets(bench, live);
  EXPECT_EQ(live.pairing.sets.size(), 40U);
  EXPECT_EQ(live.report.cameras[1].host_launches, 1);
  EXPECT_EQ(live.pairing.cameras[1].never_arrived, 0);
}

TEST(LiveCapture, AFallBackIsNamed) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
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

TEST(LiveCapture, ACameraThatIsNotThereIsNamed) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
  Bench bench(2, SyncMethod::free_run);
  bench.file.cameras[1].address = {Backend::aravis, "NOBODY", "", ""};
  try {
    static_cast<void>(bench.capture(1));
    FAIL() << "captured with a camera that is not there";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::device);
    EXPECT_EQ(error.where().camera, "cam1");
    EXPECT_THAT(error.what(), HasSubstr("DB0000"));
  }
}

class RefusedFrames : public testing::Test {
 protected:
  /// Captures one set with camera 1 showing `pixels`, and stores it.
  RecordResult record(const std::vector<std::uint8_t>& pixels) {
    Bench bench(2, SyncMethod::software_trigger);
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
  DRAPE_REQUIRE_PRIVATE_NETWORK();
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
}  // namespace drape
