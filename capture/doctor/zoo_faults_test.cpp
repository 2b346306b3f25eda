// SPDX-License-Identifier: Apache-2.0
// Tests whether the doctor predicts a capture: runs both programs as a person does, for each
// personality of the emulated camera with each fault of a bench.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <functional>

#include "capture/live/test_live_bench.hpp"
#include "core/files/files.hpp"
#include "core/recording.hpp"
#include "tests/support/gige_camera/private_network.hpp"
#include "tests/support/small_bench.hpp"
#include "tests/support/trials.hpp"

namespace drape::capture {
namespace {

using test::Personality;

constexpr int kSpoiltCameras = 2;

/// A bench: the content of its cameras.toml and the fault of its second camera.
struct SpoiltBench {
  Personality personality;
  std::string method = "software_trigger", of_second;  ///< further keys of the second camera
  double exposure_us = 2000;
  int width_px = 160, height_px = 120;
  std::string device = "127.0.0.3";
  test::GigeCameraOptions second = {};
  test::GigeFaults transit = {};
  bool plugged = true, small_buffers = false;
};

struct BenchFault {
  std::string name;
  std::function<void(SpoiltBench&)> cause;
  /// Words that both programs must print, alternatives separated by `|`; empty if both must say GO.
  std::function<std::string(const SpoiltBench&)> said;
};

void PrintTo(const BenchFault& fault, std::ostream* out) {
  *out << fault.name;
}

std::function<std::string(const SpoiltBench&)> always(const std::string& said) {
  return [said](const SpoiltBench&) { return said; };
}

const std::vector<BenchFault>& bench_faults() {
  static const std::vector<BenchFault> all = {
      {"none", [](SpoiltBench&) {}, always("")},
      {"packets_larger_than_the_path",
       [](SpoiltBench& b) {
         b.of_second = "packet_size_bytes = 8192\n";
         b.second.path_bytes = 1500;
       },
       always("a frame is incomplete")},
      {"receive_buffer_too_small",
       [](SpoiltBench& b) {
         b.width_px = 1280;
         b.height_px = 1024;
         b.of_second = "packet_size_bytes = 1400\n";
         b.second.resend = false;
         b.small_buffers = true;
       },
       always("sudo sysctl -w net.core.rmem_max=")},
      {"held_by_another_program", [](SpoiltBench& b) { b.second.held = true; },
       always("another program controls the camera")},
      {"pixel_format_locked",
       [](SpoiltBench& b) {
         const auto& offered = b.personality.pixel_formats;
         b.second.stuck = {test::reg::pixel_format};
         b.of_second = fmt::format("pixel_format = \"{}\"\n",
                                   offered.size() > 1 ? offered[1].first : "Mono10p");
       },
       [](const SpoiltBench& b) -> std::string {
         const auto& offered = b.personality.pixel_formats;
         if (offered.size() > 1) return "setting PixelFormat to " + offered[1].first;
         return offered[0].first == "Mono10p" ? "" : "the camera has no pixel format Mono10p";
       }},
      {"exposure_longer_than_the_period",
       [](SpoiltBench& b) {
         b.method = "free_run";
         b.exposure_us = 300'000;
       },
       always("it is longer than the period")},
      {"no_pulse_on_the_line", [](SpoiltBench& b) { b.method = "line_trigger"; },
       [](const SpoiltBench& b) -> std::string {
         if (!b.personality.has_trigger("Line1")) return "has no trigger source Line1";
         if (b.personality.latch == test::Latch::none) return "its clock cannot be read";
         return "no pulse came by the line";
       }},
      {"lost_packets",
       [](SpoiltBench& b) {
         b.width_px = 640;
         b.height_px = 480;
         b.transit = {.lose = 0.5, .lose_resent = 1};
       },
       always("a frame is incomplete|answers no software_trigger")},
      {"firewall", [](SpoiltBench& b) { b.transit = {.lose = 1, .lose_resent = 1}; },
       always("let the firewall pass UDP from 127.0.0.3")},
      {"silent", [](SpoiltBench& b) { b.plugged = false; }, always("cam1")},
      {"automatic_that_cannot_be_switched_off",
       [](SpoiltBench& b) { b.second.stuck = {test::reg::exposure_auto}; },
       always("setting ExposureAuto to Off")},
      {"unknown_device", [](SpoiltBench& b) { b.device = "127.0.0.77"; }, always("cam1")}};
  return all;
}

class Benches : public test::CameraTest, public testing::WithParamInterface<BenchFault> {
 protected:
  static inline int benches = 0, agreements = 0;  ///< over all faults tried by this process

  static void TearDownTestSuite() {
    std::printf("the doctor agrees in %d of %d benches\n", agreements, benches);
    EXPECT_GE(100 * agreements, 95 * benches);
  }

  void write_rig(const SpoiltBench& bench) const {
    std::string rig = read_text(test::source_root() / "rigs/bench1/rig.toml");
    rig.resize(rig.rfind("[[camera]]"));
    for (const auto& [from, to] :
         {std::pair<std::string, std::string>{"= 1600", fmt::format("= {}", bench.width_px)},
          {"= 1200", fmt::format("= {}", bench.height_px)}})
      for (auto at = rig.find(from); at != std::string::npos; at = rig.find(from))
        rig.replace(at, from.size(), to);
    write_durable(folder() / "rig/rig.toml", rig);
    std::string text = fmt::format(
        "schema = \"drapebench/cameras/1\"\n[sync]\nmethod = \"{}\"\nframe_rate_hz = 10.0\n"
        "largest_spread_ms = 500.0\n",  // a busy machine triggers cameras one long after the other
        bench.method);
    for (int c = 0; c < kSpoiltCameras; ++c)
      text += fmt::format(
          "[[camera]]\nname = \"cam{}\"\nbackend = \"aravis\"\ndevice = \"{}\"\n"
          "host_address = \"127.0.0.1\"\nexposure_us = {:.1f}\n{}",
          c, c == 0 ? "127.0.0.2" : bench.device, bench.exposure_us, c == 0 ? "" : bench.of_second);
    write_durable(folder() / "rig/cameras.toml", text);
  }

  static std::vector<std::unique_ptr<test::GigeCamera>> cameras_of(const SpoiltBench& bench) {
    std::vector<std::unique_ptr<test::GigeCamera>> devices;
    for (unsigned c = 0; c < kSpoiltCameras; ++c) {
      test::GigeCameraOptions options = c == 0 ? test::GigeCameraOptions{} : bench.second;
      options.address = fmt::format("127.0.0.{}", 2 + c);
      options.serial = fmt::format("ZOO{}", c);
      options.width_px = bench.width_px;
      options.height_px = bench.height_px;
      options.clock_offset_s = 5.0 * c + 3;
      options.personality = bench.personality;
      devices.push_back(std::make_unique<test::GigeCamera>(options));
      const auto sent =
          test::picture_for(bench.personality, bench.width_px, bench.height_px, c + 1);
      bench.personality.gamma_on ? devices.back()->show(sent.bytes)
                                 : devices.back()->show_bytes(sent.bytes);
    }
    devices.back()->set_faults(bench.transit);
    if (!bench.plugged) devices.back()->unplug();
    return devices;
  }

  /// Describes a disagreement of the two programs; empty if they agree.
  [[nodiscard]] std::string disagreement(const SpoiltBench& bench, const std::string& said) const {
    std::filesystem::remove_all(folder() / "recording");
    write_rig(bench);
    const auto devices = cameras_of(bench);
    const auto run = [&](const std::string& name, const std::string& more) {
      const std::string confined = fmt::format(
          "LD_PRELOAD='{}' setpriv --bounding-set=-net_admin,-net_raw", DRAPE_SMALL_BUFFERS);
      return test::run_line(
          fmt::format("{} {} '{}' {} </dev/null", bench.small_buffers ? confined : "",
                      test::program(name).string(), (folder() / "rig").string(), more));
    };
    const test::Outcome doctor =
        run("drape-capture doctor", fmt::format("--out '{}'", folder().string()));
    const std::string recording = (folder() / "recording").string();
    const test::Outcome capture =
        run("drape-capture", fmt::format("--set one --out '{}' --patience-s 5", recording));
    const bool stored = std::filesystem::exists(folder() / "recording/one");
    const bool go = doctor.exit_code == 0, good = capture.exit_code == 0 && stored;
    const auto names = [&](const test::Outcome& outcome) {
      for (std::size_t at = 0; at <= said.size();) {
        const std::size_t end = std::min(said.find('|', at), said.size());
        if (outcome.text.find(said.substr(at, end - at)) != std::string::npos) return true;
        at = end + 1;
      }
      return false;
    };
    const bool agree =
        said.empty() ? go && good : !go && !good && !stored && names(doctor) && names(capture);
    if (agree) return {};
    return fmt::format("{}: the doctor ended with {}, the capture with {}\n{}\n{}\n",
                       bench.personality.name, doctor.exit_code, capture.exit_code, doctor.text,
                       capture.text);
  }

  [[nodiscard]] const std::filesystem::path& folder() const { return temporary_.path(); }
  test::TemporaryFolder temporary_;
};

TEST_P(Benches, TheDoctorSaysWhatACaptureThenDoes) {
  const BenchFault& fault = GetParam();
  const auto& zoo = test::personalities();
  const int count = test::trial_count(1, static_cast<int>(zoo.size()));
  int agreed = 0;
  std::string others;
  for (int k = 0; k < count; ++k) {
    SpoiltBench bench;
    bench.personality = zoo[static_cast<std::size_t>(k)];
    fault.cause(bench);
    const std::string apart = disagreement(bench, fault.said(bench));
    agreed += apart.empty() ? 1 : 0;
    others += apart;
  }
  std::printf("%s: the doctor agrees in %d of %d\n%s", fault.name.c_str(), agreed, count,
              others.c_str());
  benches += count;
  agreements += agreed;
  EXPECT_GT(2 * agreed, count) << others;
}

INSTANTIATE_TEST_SUITE_P(Faults, Benches, testing::ValuesIn(bench_faults()),
                         [](const auto& p) { return p.param.name; });

}  // namespace
}  // namespace drape::capture
