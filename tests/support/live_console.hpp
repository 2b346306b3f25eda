// SPDX-License-Identifier: Apache-2.0
#pragma once

// `drape bench RIG` with emulated cameras: real packets, real camera hosts, the real server.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <thread>
#include <vector>

#include "core/files/files.hpp"
#include "tests/support/gige_camera/gige_camera.hpp"
#include "tests/support/gige_camera/private_network.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/running_bench.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {

inline constexpr int kCameras = 3;

inline cv::Mat frame_of_bench1(int camera, const std::string& set = "stage_z000") {
  return cv::imread(
      (source_root() / fmt::format("rigs/bench1/recording/{}/cam{}.png", set, camera)).string(),
      cv::IMREAD_GRAYSCALE);
}

/// bench1 with emulated cameras that see the target where it is the world.
class LiveConsole : public CameraTest {
 protected:
  void begin(const std::string& method, double rate_hz = 4, double spread_ms = 100,
             cv::Size size = {1600, 1200}, int cameras = kCameras) {
    std::string text = fmt::format(
        "schema = \"drapebench/cameras/1\"\n[sync]\nmethod = \"{}\"\nframe_rate_hz = {:.1f}\n"
        "largest_spread_ms = {:.1f}\n",
        method, rate_hz, spread_ms);
    for (int c = 0; c < cameras; ++c) {
      GigeCameraOptions options;
      options.address = fmt::format("127.0.0.{}", 2 + c);
      options.serial = fmt::format("LB{:02}", c);
      options.width_px = size.width;
      options.height_px = size.height;
      options.clock_offset_s = c - 1;
      options.exposure_step_us = exposure_step_us;
      devices.push_back(std::make_unique<GigeCamera>(options));
      const cv::Mat image = frame_of_bench1(c % kCameras)({{}, size}).clone();
      devices.back()->show({image.data, image.data + image.total()});
      text += fmt::format(
          "[[camera]]\nname = \"cam{}\"\nbackend = \"aravis\"\ndevice = \"{}\"\n"
          "host_address = \"127.0.0.1\"\npacket_size_bytes = 8192\nexposure_us = 2000.0\n",
          c, options.address);
    }
    write_durable(bench.rig() / "cameras.toml", text);
  }

  /// Four cameras of 1280 x 1024 px at 10 Hz, and as many free poses as sets are wanted.
  void begin_four(int sets) {
    std::string poses = "free_poses = [";
    for (int k = 0; k < sets; ++k) poses += fmt::format("\"watched_{:03}\", ", k);
    bench.replace("rig.toml", "free_poses = [", poses);
    const std::filesystem::path file = bench.rig() / "rig.toml";
    std::string text = read_text(file) +
                       "\n[[camera]]\nname = \"cam3\"\nwidth_px = 1600\nheight_px = 1200\n"
                       "pixel_pitch_um = [3.45, 3.45]\n";
    for (const auto& [from, to] : {std::pair("width_px = 1600", "width_px = 1280"),
                                   {"height_px = 1200", "height_px = 1024"}})
      for (auto at = text.find(from); at != std::string::npos; at = text.find(from))
        text.replace(at, std::string(from).size(), to);
    write_durable(file, text);
    begin("software_trigger", 10, 2000, {1280, 1024}, 4);
  }

  [[nodiscard]] std::filesystem::path out() const { return bench.folder() / "out"; }

  /// Until it is true of the state; the state then. A limit only so that a failure ends.
  static Json await(const RunningBench& server, const std::function<bool(const Json&)>& is_so) {
    Json state;
    for (int k = 0; k < 600; ++k) {
      state = server.get("api/state");
      if (state.is_object() && is_so(state)) return state;
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
    ADD_FAILURE() << "it does not come: " << state.value("capture", Json()).dump(1);
    return state;
  }
  static bool is_ready(const Json& state) {
    return state["capture"]["ready"] == true && state["capture"]["taking"] == "";
  }
  static std::string words(const Json& state) { return state["capture"]["words"].dump(); }
  static bool is_recorded(const Json& state, const std::string& set) {
    for (const Json& one : state["sets"])
      if (one["name"] == set) return one["taken"] == true && one["recorded"] == true;
    return false;
  }

  /// Presses until it is stored: on a starved machine a set may be refused for its spread.
  static void take(const RunningBench& server, const std::string& set) {
    ASSERT_EQ(server.act({{"do", "take"}, {"set", set}}), 200);
    await(server, [&](const Json& state) {
      const bool recorded = is_recorded(state, set);
      if (!recorded && is_ready(state))
        static_cast<void>(server.act({{"do", "take"}, {"set", set}}));
      return recorded;
    });
  }

  double exposure_step_us = 0;  ///< step of the cameras that begin() makes; 0: any
  SmallBench bench{{"C"}};
  std::vector<std::unique_ptr<GigeCamera>> devices;
};

}  // namespace drape::test
