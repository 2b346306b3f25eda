// SPDX-License-Identifier: Apache-2.0
// Emulated cameras whose clocks jump, drift, or are synchronised by PTP; and identical cameras.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fmt/format.h>
#include <csignal>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "capture/doctor/checks.hpp"
#include "capture/live/test_live_bench.hpp"
#include "capture/recording/test_record.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/trials.hpp"

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

// ----
// Camera hosts that are killed, hang or use too much memory, and cameras that are unplugged.

using test::expect_right_sets;
using test::LiveCapture;
using testing::AllOf;
using testing::AnyOf;
using HostsBench = test::LiveBench;

/// Child processes of this one that run a camera host.
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

std::string status_of(pid_t process, const std::string& name) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(name + ":")) return line.substr(name.size() + 2);
  return "absent";
}

TEST_F(LiveCapture, ACameraHostIsConfined) {
  const HostsBench bench(2, SyncMethod::free_run);
  int looked_at = 0;
  const LiveResult live = bench.capture(5, 20, true, [&](int sets) {
    if (sets < 1 || looked_at > 0) return;
    for (const pid_t host : camera_hosts()) {
      ++looked_at;
      EXPECT_EQ(status_of(host, "NoNewPrivs"), "1");
      EXPECT_EQ(status_of(host, "Seccomp"), "2");
      constexpr unsigned long long network = 0x3000;  // CAP_NET_ADMIN and CAP_NET_RAW
      EXPECT_EQ(std::stoull(status_of(host, "CapEff"), nullptr, 16) & ~network, 0U);
      EXPECT_EQ(std::stoull(status_of(host, "CapPrm"), nullptr, 16) & ~network, 0U);
    }
  });
  EXPECT_EQ(looked_at, 2);
  EXPECT_EQ(live.pairing.sets.size(), 5U) << all_faults(live);
}

TEST_F(LiveCapture, AKilledCameraHostIsBackAndTheOthersLoseNothing) {
  const HostsBench bench(3, SyncMethod::free_run);
  bool killed = false;
  const LiveResult live = bench.capture(25, 20, true, [&](int sets) {
    if (sets >= 10 && !std::exchange(killed, true)) ::kill(camera_hosts().at(0), SIGKILL);
  });
  expect_right_sets(bench, live);
  ASSERT_EQ(live.pairing.sets.size(), 25U);
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

TEST_F(LiveCapture, AHostThatHangsIsEndedAndItsCameraIsBack) {
  const HostsBench bench(2, SyncMethod::free_run);
  bool stopped = false;
  const LiveResult live = bench.capture(25, 20, true, [&](int sets) {
    if (sets < 10 || std::exchange(stopped, true)) return;
    ::kill(camera_hosts().at(0), SIGSTOP);
  });
  expect_right_sets(bench, live);
  EXPECT_EQ(live.pairing.sets.size(), 25U) << all_faults(live);
  // Whichever is detected first: no frames for 2 periods + 0.5 s, or no sign of life for 1 s.
  EXPECT_THAT(all_faults(live),
              AnyOf(HasSubstr("it stopped sending frames"), HasSubstr("gives no sign of life")));
  const int launches[] = {live.report.cameras[0].host_launches,
                          live.report.cameras[1].host_launches};
  EXPECT_EQ(std::min(launches[0], launches[1]), 1);
  EXPECT_GT(std::max(launches[0], launches[1]), 1);  // until the camera releases the lost host
}

TEST_F(LiveCapture, AHostThatIsSilentBetweenTriggersIsEndedToo) {
  const HostsBench bench(2, SyncMethod::software_trigger, 320, 240, 0.5);
  bool stopped = false;
  const LiveResult live = bench.capture(4, 20, true, [&](int sets) {
    if (sets < 1 || std::exchange(stopped, true)) return;
    ::kill(camera_hosts().at(0), SIGSTOP);
  });
  expect_right_sets(bench, live);
  EXPECT_THAT(all_faults(live), HasSubstr("its camera host gives no sign of life"));
  EXPECT_THAT(all_faults(live), HasSubstr("check cable and power"));
}

TEST_F(LiveCapture, AHostThatWantsTooMuchMemoryIsEndedAndNamed) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "missing: a limit of addresses, which a sanitizer does not bear";
#endif
  HostsBench bench(2, SyncMethod::free_run);
  LiveOptions options;
  options.host_program = test::program("drape-camera-host");
  options.memory_limit_mb = 16;  // its libraries alone need more
  const Error error = test::error_of([&] { return capture_live(bench.file, options); });
  EXPECT_EQ(error.kind(), ErrorKind::device);
  EXPECT_EQ(error.where().camera.substr(0, 3), "cam");
  EXPECT_THAT(error.what(), HasSubstr("camera host"));
}

TEST_F(LiveCapture, AnUnpluggedCameraIsNoticedAndBack) {
  const HostsBench bench(2, SyncMethod::free_run);
  const auto now_ns = [] {
    return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  };
  std::int64_t unplugged_ns = 0, back_ns = 0;
  const LiveResult live = bench.capture(25, 20, true, [&](int sets) {
    if (sets >= 10 && unplugged_ns == 0) {
      bench.devices[1]->unplug();
      unplugged_ns = now_ns();
    } else if (unplugged_ns != 0 && back_ns == 0 && now_ns() - unplugged_ns > 2'000'000'000) {
      bench.devices[1]->plug_in();
      back_ns = now_ns();
    }
  });
  expect_right_sets(bench, live);
  EXPECT_EQ(live.pairing.sets.size(), 25U);
  EXPECT_THAT(all_faults(live), HasSubstr("cam1: "));
  EXPECT_EQ(live.pairing.cameras[0].never_arrived, 0) << all_faults(live);
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

/// A triggered capture in which camera 1 fails after three sets and recovers after the trigger that
/// it missed.
LiveResult troubled(const HostsBench& bench, const std::function<void()>& trouble,
                    const std::function<void()>& mend) {
  bool troubled = false, mended = false;
  return bench.capture(12, 60, true, [&](int triggers) {
    if (triggers >= 6 && !std::exchange(mended, true)) mend();
    if (triggers >= 3 && !std::exchange(troubled, true)) trouble();
  });
}

void expect_back(const LiveResult& live) {
  EXPECT_GT(live.report.cameras[1].host_launches, 1);
  EXPECT_EQ(live.report.cameras[0].host_launches, 1);
  EXPECT_THAT(all_faults(live), AllOf(HasSubstr("cam1: "), HasSubstr("it is opened again")));
  EXPECT_EQ(live.pairing.sets.back().trigger, 11) << all_faults(live);
}

class Triggered : public test::CameraTest, public testing::WithParamInterface<SyncMethod> {
 protected:
  void SetUp() override {
    CameraTest::SetUp();
    if (GetParam() != SyncMethod::software_trigger && test::trial_count(0, 1) == 0)
      GTEST_SKIP() << "missing: DRAPE_LONG_TESTS=1, for both methods by action commands";
  }
};

INSTANTIATE_TEST_SUITE_P(Methods, Triggered,
                         testing::Values(SyncMethod::software_trigger, SyncMethod::action,
                                         SyncMethod::scheduled_action),
                         [](const auto& p) { return std::string(name_of(p.param)); });

/// The outage is too short for a heartbeat to be missed.
TEST_P(Triggered, ACameraWithoutPowerForAMomentIsNoticedAndBack) {
  const HostsBench bench(2, GetParam(), 320, 240, 4);
  bench.devices[1]->obey_controller_alone();
  const auto off_and_on = [&] {
    bench.devices[1]->unplug();
    bench.devices[1]->plug_in();
  };
  const LiveResult live = troubled(bench, off_and_on, [] {});
  expect_right_sets(bench, live);
  expect_back(live);
}

TEST_P(Triggered, ACameraThatObeysAndSendsNothingIsOpenedAgain) {
  const HostsBench bench(2, GetParam(), 320, 240, 4);
  const auto send = [&](double nothing) {
    return [&bench, nothing] { bench.devices[1]->set_faults({.skip_frame = nothing}); };
  };
  const LiveResult live = troubled(bench, send(1), send(0));
  expect_right_sets(bench, live);
  expect_back(live);
  EXPECT_THAT(all_faults(live), HasSubstr("it stopped sending frames"));
}

// ----
// Captures with emulated cameras: real packets, real camera host processes.

using test::picture;
using Bench = test::LiveBench;

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
  std::printf("%s: spread p50 %.3f ms, max %.3f ms\n", std::string(name_of(GetParam())).c_str(),
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
                         [](const auto& method) { return std::string(name_of(method.param)); });

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
