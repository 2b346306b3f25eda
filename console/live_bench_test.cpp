// SPDX-License-Identifier: Apache-2.0
// `drape bench RIG` with cameras that stay open: real packets, real camera hosts, the real server.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <thread>
#include <vector>

#include "console/running_bench.hpp"
#include "core/files/files.hpp"
#include "core/recording.hpp"
#include "tests/support/gige_camera/gige_camera.hpp"
#include "tests/support/gige_camera/private_network.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"
#include "tests/support/trials.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int kCameras = 3;

cv::Mat frame_of_bench1(int camera) {
  return cv::imread(
      (source_root() / fmt::format("rigs/bench1/recording/stage_z000/cam{}.png", camera)).string(),
      cv::IMREAD_GRAYSCALE);
}

/// bench1 with emulated cameras that see the target where it is the world.
class LiveConsole : public testing::Test {
 protected:
  void SetUp() override {
    // One of five runs on a loaded machine waited longer than 70 s for the cameras; not explained.
    if (trial_count(0, 1) == 0) GTEST_SKIP() << "DRAPE_LONG_TESTS=1 is missing";
  }
  void begin(const std::string& method) {
    std::string text = fmt::format(
        "schema = \"drapebench/cameras/1\"\n[sync]\nmethod = \"{}\"\nframe_rate_hz = 4.0\n"
        "largest_spread_ms = 100.0\n",
        method);
    for (int c = 0; c < kCameras; ++c) {
      GigeCameraOptions options;
      options.address = fmt::format("127.0.0.{}", 2 + c);
      options.serial = fmt::format("LB{:02}", c);
      options.width_px = 1600;
      options.height_px = 1200;
      options.clock_offset_s = c - 1;
      devices.push_back(std::make_unique<GigeCamera>(options));
      const cv::Mat image = frame_of_bench1(c);
      devices.back()->show({image.data, image.data + image.total()});
      text += fmt::format(
          "[[camera]]\nname = \"cam{}\"\nbackend = \"aravis\"\ndevice = \"{}\"\n"
          "host_address = \"127.0.0.1\"\npacket_size_bytes = 8192\nexposure_us = 2000.0\n",
          c, options.address);
    }
    write_durable(bench.rig() / "cameras.toml", text);
  }

  [[nodiscard]] fs::path out() const { return bench.folder() / "out"; }

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

  SmallBench bench{{"C"}};
  std::vector<std::unique_ptr<GigeCamera>> devices;
};

TEST_F(LiveConsole, ShowsWhatTheCamerasSeeAndStoresWhatIsTaken) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
  begin("software_trigger");
  {
    RunningBench server(bench.rig(), out(), 0, false);
    await(server, is_ready);
    for (int c = 0; c < kCameras; ++c) {
      const std::string file = (bench.folder() / "picture.jpg").string();
      CurlAnswer picture;
      for (int k = 0; k < 100 && picture.status != 200; ++k) {
        picture = curl(fmt::format("-D - -o '{}' '{}api/live?camera=cam{}&width=640&red=1'", file,
                                   server.address(), c));
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
      }
      ASSERT_EQ(picture.status, 200) << picture.body;
      const std::size_t at = picture.body.find("X-Facts: ");
      ASSERT_NE(at, std::string::npos) << picture.body;
      const Json facts =
          Json::parse(picture.body.substr(at + 9, picture.body.find('\r', at) - at - 9));
      EXPECT_EQ(facts["settings"]["exposure_us"], "2000") << facts.dump();
      EXPECT_EQ(facts["asked"]["exposure_us"], 2000.0);
      const cv::Mat seen = frame_of_bench1(c);
      EXPECT_NEAR(facts["saturated_percent"].get<double>(),
                  100.0 * cv::countNonZero(seen == 255) / static_cast<double>(seen.total()), 0.02);
      EXPECT_GT(facts["dot_sigma_px"].get<double>(), 0.001);
      EXPECT_LT(facts["dot_sigma_px"].get<double>(), 0.1);
      EXPECT_EQ(cv::imread(file, cv::IMREAD_GRAYSCALE).cols, 533) << "scaled by a whole number";
    }
    ASSERT_EQ(server.act({{"do", "take"}, {"set", "stage_z000"}}), 200);
    await(server, [](const Json& state) { return is_recorded(state, "stage_z000"); });
    server.kill();
  }
  const Recording recording = read_recording(out() / "recording");
  for (int c = 0; c < kCameras; ++c) {
    const cv::Mat stored =
        cv::imread((out() / "recording" / recording.set("stage_z000").frames.at(c).file).string(),
                   cv::IMREAD_UNCHANGED);
    EXPECT_EQ(cv::norm(stored, frame_of_bench1(c), cv::NORM_INF), 0) << "cam" << c;
  }
  const RunningBench again(bench.rig(), out(), 0, false);
  const Json state = await(again, is_ready);
  EXPECT_TRUE(is_recorded(state, "stage_z000")) << "a server that was killed lost a set";
  ASSERT_EQ(again.act({{"do", "close"}}), 200);
  ASSERT_EQ(again.act({{"do", "take"}, {"set", "stage_z030"}}), 400);
}

TEST_F(LiveConsole, ALostCameraIsSaidAndItsReturnToo) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
  begin("free_run");
  const RunningBench server(bench.rig(), out(), 0, false);
  await(server, is_ready);
  devices[1]->unplug();
  const Json lost = await(
      server, [](const Json& state) { return words(state).find("cam1`: ") != std::string::npos; });
  EXPECT_THAT(words(lost), HasSubstr("check cable and power"));
  devices[1]->plug_in();
  await(server, [](const Json& state) {
    return words(state).find("cam1`: it sends frames again") != std::string::npos;
  });
  ASSERT_EQ(server.act({{"do", "take"}, {"set", "stage_z000"}}), 200);
  await(server, [](const Json& state) { return is_recorded(state, "stage_z000"); });
}

}  // namespace
}  // namespace drape::test
