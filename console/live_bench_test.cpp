// SPDX-License-Identifier: Apache-2.0
// Sets taken with live cameras are whole, and the cameras' state is said.
#include <sched.h>
#include <signal.h>

#include "core/recording.hpp"
#include "tests/support/bench1_truth.hpp"
#include "tests/support/live_console.hpp"

namespace drape::test {
namespace {

using testing::HasSubstr;

/// Asks until the answer holds it; the last answer. A limit only so that a failure ends.
template <class Ask, class Is>
auto ask_until(Ask ask, Is is) {
  auto answer = ask();
  for (int k = 0; k < 600 && !is(answer); ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    answer = ask();
  }
  return answer;
}

/// Facts that come with a live picture.
Json facts_in(const CurlAnswer& picture) {
  const std::size_t at = picture.body.find("X-Facts: ");
  if (at == std::string::npos) return {};
  return parse_json(picture.body.substr(at + 9, picture.body.find('\r', at) - at - 9));
}

TEST_F(LiveConsole, ShowsWhatTheCamerasSeeAndStoresWhatIsTaken) {
  begin("software_trigger");
  {
    RunningBench server(bench.rig(), out(), 0, false);
    await(server, is_ready);
    for (int c = 0; c < kCameras; ++c) {
      const std::string file = (bench.folder() / "picture.jpg").string();
      const CurlAnswer picture = ask_until(
          [&] {
            return curl(fmt::format("-D - -o '{}' '{}api/live?camera=cam{}&width=640&red=1'", file,
                                    server.address(), c));
          },
          [](const CurlAnswer& answer) { return answer.status == 200; });
      ASSERT_EQ(picture.status, 200) << picture.body;
      const Json facts = facts_in(picture);
      ASSERT_TRUE(facts.is_object()) << picture.body;
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
    const Json seen =
        ask_until([&] { return server.get("api/live-marks?surface=target"); },
                  [](const Json& marks) { return marks.is_object() && !marks["cameras"].empty(); });
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

Json facts_of(const RunningBench& server, int camera) {
  return facts_in(curl(fmt::format("-o /dev/null -D - '{}api/live?camera=cam{}&width=80'",
                                   server.address(), camera)));
}

TEST_F(LiveConsole, ExposureAndGainAreSetAndReadBackFromTheCamera) {
  exposure_step_us = 1000;
  begin("software_trigger");
  const RunningBench server(bench.rig(), out(), 0, false);
  await(server, is_ready);
  const auto light = [&](const char* name, double value) {
    return server.act({{"do", "light"}, {"camera", "cam1"}, {name, value}});
  };
  const auto await_setting = [&](const char* name, const std::string& value) {
    Json facts = ask_until([&] { return facts_of(server, 1); },
                           [&](const Json& now) {
                             return now.is_object() && now["settings"].value(name, "") == value;
                           });
    EXPECT_EQ(facts["settings"][name], value) << facts.dump();
    return facts;
  };
  ASSERT_EQ(light("exposure_us", 3000), 200);
  EXPECT_EQ(await_setting("exposure_us", "3000")["asked"]["exposure_us"], 3000.0);
  ASSERT_EQ(light("gain_db", 6), 200);
  await_setting("gain_db", "6");
  EXPECT_EQ(facts_of(server, 0)["settings"]["exposure_us"], "2000") << "of this camera alone";
  // The camera takes whole milliseconds, and says nothing.
  ASSERT_EQ(light("exposure_us", 1500), 200);
  await(server,
        [](const Json& state) { return words(state).find("NO-GO: ") != std::string::npos; });
  await_setting("exposure_us", "3000");
  take(server, "stage_z000");
  const Json stored = parse_json(read_text(out() / "recording" / "stage_z000" / "capture.json"));
  EXPECT_THAT(stored.dump(), HasSubstr("\"exposure_us\":\"3000\"")) << stored.dump(1);
  EXPECT_EQ(light("exposure_us", -1), 400);
  EXPECT_EQ(server.act({{"do", "light"}, {"camera", "../cam1"}, {"gain_db", 1}}), 400);
  EXPECT_EQ(server.act({{"do", "light"}, {"camera", "cam1"}}), 400);
}

TEST_F(LiveConsole, AnySetIsTakenAgainAndNothingThatWasStoredIsLost) {
  begin("software_trigger");
  const auto hash_of = [this](const std::string& set) {
    return read_recording(out() / "recording").set(set).frames.front().sha256;
  };
  std::string first;
  {
    RunningBench server(bench.rig(), out(), 0, false);
    await(server, is_ready);
    take(server, "stage_z000");
    take(server, "stage_z030");
    first = hash_of("stage_z000");
    const cv::Mat other = frame_of_bench1(0, "stage_z060");
    devices[0]->show({other.data, other.data + other.total()});
    await(server, is_ready);
    ASSERT_EQ(server.act({{"do", "take"}, {"set", "stage_z000"}}), 200);
    const auto is_superseded = [](const Json& state) {
      return state["sets"][0]["earlier"] == Json::array({"stage_z000.take1"});
    };
    await(server, [&](const Json& state) {
      if (!is_superseded(state) && is_ready(state))
        static_cast<void>(server.act({{"do", "take"}, {"set", "stage_z000"}}));
      return is_superseded(state);
    });
    await(server, is_ready);
    EXPECT_EQ(hash_of("stage_z000.take1"), first);
    ASSERT_EQ(server.act({{"do", "undo"}, {"set", "stage_z000"}}), 200);
    await(server, [](const Json& state) {
      return state["sets"][0]["earlier"] == Json::array({"stage_z000.take2"});
    });
    EXPECT_EQ(hash_of("stage_z000"), first) << "the retake is undone";
    await(server, is_ready);
    take(server, "pose_00");
    // No set comes, so it is being taken for some seconds.
    devices[1]->unplug();
    await(server, is_ready);
    ASSERT_EQ(server.act({{"do", "take"}, {"set", "stage_z000"}}), 200);
    EXPECT_EQ(server.act({{"do", "calibrate"}}), 400) << "with pictures that are being replaced";
    devices[1]->plug_in();
    EXPECT_EQ(server.end(SIGINT), 130);
  }
  EXPECT_TRUE(std::filesystem::exists(out() / "recording" / "recording.run.json"));
  EXPECT_FALSE(std::filesystem::exists(out() / "recording" / "recording.journal"));
  EXPECT_NE(hash_of("stage_z000.take2"), first);
  EXPECT_GE(read_recording(out() / "recording").sets.size(), 4U);
}

TEST_F(LiveConsole, FurtherLayingsAndTheirFacesAreAskedForAndKept) {
  begin("software_trigger");
  const auto faces = [](const Json& state) {
    std::string text;
    for (const Json& one : state["drapes"][0]["layings"])
      text += one["set"].get<std::string>() + " " + one["face"].get<std::string>() + "; ";
    return text;
  };
  {
    RunningBench server(bench.rig(), out(), 0, false);
    await(server, is_ready);
    EXPECT_EQ(server.act({{"do", "lay"}, {"drape", "C"}}), 400) << "the first one is not there";
    ASSERT_EQ(server.act({{"do", "take"}, {"set", "drape_C"}, {"face", "printed"}}), 200);
    await(server, [&](const Json& state) {
      const bool there = is_recorded(state, "drape_C");
      if (!there && is_ready(state))
        static_cast<void>(server.act({{"do", "take"}, {"set", "drape_C"}}));
      return there;
    });
    ASSERT_EQ(server.act({{"do", "lay"}, {"drape", "C"}}), 200);
    await(server, is_ready);
    take(server, "drape_C_2");
    server.kill();
  }
  const RunningBench again(bench.rig(), out(), 0, false);
  const Json state = await(again, is_ready);
  EXPECT_EQ(faces(state), "drape_C printed; drape_C_2 printed; ");
  EXPECT_TRUE(is_recorded(state, "drape_C_2"));
  // Stillness lies in the same answer as the live marks.
  const Json seen =
      ask_until([&] { return again.get("api/live-marks?surface=cloth"); },
                [](const Json& marks) {
                  return marks.is_object() && marks.value("still_s", Json::object()).size() >= 3;
                });
  for (int c = 0; c < kCameras; ++c)
    EXPECT_GE(seen["still_s"][fmt::format("cam{}", c)].get<double>(), 0) << seen.dump();
}

TEST_F(LiveConsole, AFullDiskIsSaidAndWhatWasStoredStays) {
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
  await_descendants();  // programs that the server had begun still write
  EXPECT_EQ(run_line("umount " + disk).exit_code, 0);
}

class LostCamera : public LiveConsole, public testing::WithParamInterface<std::string> {};

INSTANTIATE_TEST_SUITE_P(Methods, LostCamera, testing::Values("free_run", "software_trigger"),
                         [](const auto& p) { return p.param; });

TEST_P(LostCamera, IsSaidAndItsReturnToo) {
  begin(GetParam());
  const RunningBench server(bench.rig(), out(), 0, false);
  await(server, is_ready);
  const auto await_words = [&](const std::string& what) {
    return words(await(server, [&](const Json& state) {
      return words(state).find("cam1`: " + what) != std::string::npos;
    }));
  };
  devices[1]->unplug();
  EXPECT_THAT(await_words(""), HasSubstr("check cable and power"));
  devices[1]->plug_in();
  await_words("it sends frames again");
  take(server, "stage_z000");
}

/// Its power is off for so short that no heartbeat is missed: it answers, and belongs to nobody.
TEST_P(LostCamera, OfAMomentIsSaidAndItsReturnToo) {
  begin(GetParam());
  const RunningBench server(bench.rig(), out(), 0, false);
  await(server, is_ready);
  ASSERT_EQ(server.act({{"do", "light"}, {"camera", "cam1"}, {"gain_db", 6}}), 200);
  await(server,
        [](const Json& state) { return words(state).find("GO: cam1") != std::string::npos; });
  devices[1]->unplug();
  devices[1]->plug_in();
  await(server, [](const Json& state) {
    return words(state).find("cam1`: it sends frames again") != std::string::npos;
  });
  EXPECT_THAT(words(server.get("api/state")), HasSubstr("check cable and power"));
  EXPECT_EQ(devices[1]->register_real(reg::gain_db), 6) << "as it was set before";
  take(server, "stage_z000");
}

}  // namespace
}  // namespace drape::test
