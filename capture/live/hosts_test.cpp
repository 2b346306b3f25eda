// SPDX-License-Identifier: Apache-2.0
// Camera hosts that are killed, hang or use too much memory, and cameras that are unplugged.
#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <utility>

#include "capture/live/test_live_bench.hpp"
#include "core/error.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/gige_camera/private_network.hpp"
#include "tests/support/trials.hpp"

namespace drape::capture {
namespace {

using test::all_faults;
using test::expect_right_sets;
using test::LiveCapture;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
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
                         [](const auto& p) { return to_string(p.param); });

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

}  // namespace
}  // namespace drape::capture
