// SPDX-License-Identifier: Apache-2.0
// What is taken with live cameras is whole, and what becomes of them is said.
#include <sched.h>

#include "console/live_console.hpp"
#include "core/recording.hpp"
#include "tests/support/bench1_truth.hpp"

namespace drape::test {
namespace {

using testing::HasSubstr;

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
    // Marks of the pictures are those of the frames, but for what a third of the pixels costs.
    Json seen;
    for (int k = 0; k < 600 && (!seen.is_object() || seen["cameras"].empty()); ++k) {
      seen = server.get("api/live-marks?surface=target");
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    for (int c = 0; c < kCameras; ++c) {
      const Json& one = seen["cameras"][fmt::format("cam{}", c)];
      ASSERT_EQ(one["marks"].size(), 108U) << seen.dump();
      const auto& truth = bench1_truth().poses.front().centroid_px.at(static_cast<std::size_t>(c));
      for (std::size_t k = 0; k < 108; ++k) {
        EXPECT_NEAR(one["marks"][k][0].get<double>(), truth[k].x(), 0.5);
        EXPECT_NEAR(one["marks"][k][1].get<double>(), truth[k].y(), 0.5);
      }
    }
    take(server, "stage_z000");
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

TEST_F(LiveConsole, TakesABoardThatIsHeldStillAndCalibrates) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
  begin("software_trigger", 5, 2000);
  const RunningBench server(bench.rig(), out(), 0, false);
  const auto show = [this](const std::string& set) {
    for (int c = 0; c < kCameras; ++c) {
      const cv::Mat image = frame_of_bench1(c, set);
      devices[static_cast<std::size_t>(c)]->show({image.data, image.data + image.total()});
    }
  };
  const auto taken = [](const Json& state) {
    return std::count_if(state["sets"].begin(), state["sets"].end(), [](const Json& one) {
      return one["taken"] == true && one["name"].get<std::string>().starts_with("pose_");
    });
  };
  const auto is_left_out = [](const Json& state) {
    return state["log"].dump().find("fewer than two cameras see the target") != std::string::npos;
  };
  await(server, is_ready);
  take(server, "stage_z000");
  ASSERT_EQ(server.act({{"do", "automatic"}, {"on", true}}), 200);
  for (const char* set : {"pose_00", "pose_01"}) {
    const auto before = taken(server.get("api/state"));
    show(set);
    await(server, [&](const Json& state) { return taken(state) > before; });
  }
  const Json state = await(server, [](const Json& now) { return now["calibration"].is_object(); });
  EXPECT_GE(state["calibration"]["sets"].size(), 3U);
  EXPECT_FALSE(is_left_out(state));
  show("empty");
  await(server, is_left_out);
  // A pose that counts takes the name of the one that was left out.
  show("pose_02");
  await(server, [&](const Json& now) {
    return now["calibration"].is_object() &&
           now["calibration"]["sets"].size() > state["calibration"]["sets"].size();
  });
  EXPECT_EQ(server.act({{"do", "automatic"}, {"on", false}}), 200);
  EXPECT_EQ(server.idle_state()["capture"]["automatic"], false);
}

TEST_F(LiveConsole, AFullDiskIsSaidAndWhatWasStoredStays) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
  begin("software_trigger");
  adopt_descendants();
  std::filesystem::create_directories(out());
  const std::string disk = out().string();
  if (::unshare(CLONE_NEWNS) != 0 ||
      run_line("mount -t tmpfs -o size=32M tmpfs " + disk).exit_code != 0)
    GTEST_SKIP() << "missing: the right to mount a file system of its own";
  {
    const RunningBench server(bench.rig(), out(), 0, false);
    await(server, is_ready);
    take(server, "stage_z000");
    EXPECT_NE(run_line("head -c 64M /dev/zero > " + disk + "/other").exit_code, 0) << "it is full";
    ASSERT_EQ(server.act({{"do", "take"}, {"set", "stage_z030"}}), 200);
    const Json state = await(server, [](const Json& s) {
      return s.dump().find("No space left on device") != std::string::npos;
    });
    EXPECT_FALSE(is_recorded(state, "stage_z030"));
    EXPECT_TRUE(is_recorded(state, "stage_z000"));
    EXPECT_EQ(run_line("rm " + disk + "/other").exit_code, 0);
  }
  {
    const RunningBench server(bench.rig(), out(), 0, false);
    EXPECT_TRUE(is_recorded(await(server, is_ready), "stage_z000"));
    take(server, "stage_z030");
  }
  await_descendants();  // what the server had begun still writes
  EXPECT_EQ(run_line("umount " + disk).exit_code, 0);
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
  take(server, "stage_z000");
}

}  // namespace
}  // namespace drape::test
