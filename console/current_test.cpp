// SPDX-License-Identifier: Apache-2.0
// The page shows what belongs to the pictures that recording.json lists now.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>

#include "core/files/files.hpp"
#include "core/recording.hpp"
#include "tests/support/browser.hpp"
#include "tests/support/running_bench.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

/// Poses that a calibration does well without.
constexpr const char* kLaterPoses =
    "  \"pose_05\",  \"pose_06\",  \"pose_07\",  \"pose_08\",  \"pose_09\",\n"
    "  \"pose_10\",  \"pose_11\",  \"pose_12\",  \"pose_13\",  \"pose_14\",\n";

const Json& set_of(const Json& state, const std::string& name) {
  return *std::find_if(state["sets"].begin(), state["sets"].end(),
                       [&](const Json& one) { return one["name"] == name; });
}

class Current : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path out() const { return bench_.folder() / "out"; }

  static void take(const RunningBench& server, const std::vector<std::string>& sets) {
    for (const std::string& set : sets)
      ASSERT_EQ(server.act({{"do", "take"}, {"set", set}}), 200) << set;
  }
  static Json done(const RunningBench& server, const Json& act) {
    EXPECT_EQ(server.act(act), 200) << act.dump();
    return server.idle_state();
  }

  /// The recording lists the pictures of another set under this name, as after a retake.
  void retake(const std::string& set, const std::string& with) const {
    Recording recording = read_recording(bench_.rig() / "recording");
    const auto frames = recording.set(with).frames;
    for (FrameSet& one : recording.sets)
      if (one.name == set) one.frames = frames;
    write_recording(recording);
  }

  /// A file of the output folder as a full disk or a torn copy leaves it.
  void damage(const std::string& file) const {
    const std::string text = read_text(out() / file);
    write_durable(out() / file, text.substr(0, text.size() / 2));
  }

  SmallBench bench_{{"C"}};
};

TEST_F(Current, WhatWasMeasuredInOtherPicturesIsSuperseded) {
  const RunningBench server(bench_.rig(), out());
  take(server, {"stage_z000", "pose_00", "pose_01", "drape_C"});
  static_cast<void>(done(server, {{"do", "calibrate"}}));
  const Json before = done(server, {{"do", "measure"}, {"drape", "C"}});
  ASSERT_TRUE(before["drapes"][0]["sheet"].is_object()) << before["jobs"].dump(1);
  ASSERT_FALSE(server.get("api/sheet?drape=C")["marks"].empty());

  retake("drape_C", "drape_A");
  const Json after = server.get("api/state");
  EXPECT_TRUE(set_of(after, "drape_C")["detected"].is_null());
  EXPECT_EQ(set_of(after, "drape_C")["verdict"], "");
  EXPECT_NE(set_of(after, "drape_C")["pictures"], set_of(before, "drape_C")["pictures"]);
  EXPECT_TRUE(after["drapes"][0]["sheet"].is_null());
  EXPECT_THAT(after["drapes"][0]["sheet_superseded"].dump(), HasSubstr("`drape_C` has other"));
  EXPECT_TRUE(server.get("api/sheet?drape=C")["marks"].empty());
  EXPECT_TRUE(server.get("api/marks?set=drape_C")["cameras"].empty());
  EXPECT_TRUE(after["calibration"].is_object()) << "it has no part in it";

  const Json again = done(server, {{"do", "measure"}, {"drape", "C"}});
  ASSERT_TRUE(again["drapes"][0]["sheet"].is_object());
  EXPECT_NE(again["drapes"][0]["sheet"]["marks"], before["drapes"][0]["sheet"]["marks"]);
  EXPECT_TRUE(again["drapes"][0]["sheet_superseded"].is_null());

  ASSERT_EQ(server.act({{"do", "drop"}, {"set", "pose_01"}}), 200);
  const Json without = server.get("api/state");
  EXPECT_TRUE(without["calibration"].is_null());
  EXPECT_THAT(without["calibration_superseded"].dump(), HasSubstr("`pose_01` is left out"));
  EXPECT_TRUE(without["drapes"][0]["sheet"].is_null());
  EXPECT_THAT(without["drapes"][0]["sheet_superseded"].dump(), HasSubstr("its calibration"));
  EXPECT_EQ(server.act({{"do", "measure"}, {"drape", "C"}}), 400);
  const Json with = done(server, {{"do", "take"}, {"set", "pose_01"}});
  EXPECT_EQ(with["calibration"], again["calibration"]);
  EXPECT_EQ(with["drapes"][0]["sheet"], again["drapes"][0]["sheet"]);
  damage("C/sheet.json");
  EXPECT_THAT(server.get("api/state")["drapes"][0]["sheet_superseded"].dump(),
              HasSubstr("sheet.json"));
  retake("pose_01", "pose_02");
  EXPECT_THAT(server.get("api/state")["calibration_superseded"].dump(),
              HasSubstr("`pose_01` has other pictures now"));
}

TEST_F(Current, ALayingThatWasTakenAgainOrLeftOutSupersedesTheMatch) {
  bench_.replace("rig.toml", kLaterPoses, "");
  const fs::path rig = bench_.rig() / "rig.toml";
  write_durable(rig, read_text(rig) + "\n[[repeat]]\nscene = \"C\"\nset = \"drape_A\"\n");
  // Behind a link, as on a disk for data.
  fs::create_directory(bench_.folder() / "disk");
  fs::create_directory_symlink("disk", bench_.folder() / "link");
  const Outcome run = bench_.run("link/out");
  ASSERT_LE(run.exit_code, 1) << run.text;
  const RunningBench server(bench_.rig(), bench_.folder() / "link/out");
  const Json before = server.get("api/state");
  ASSERT_TRUE(before["drapes"][0]["result"].is_object()) << before["drapes"][0].dump(1);
  EXPECT_EQ(before["report_superseded"], false);

  const fs::path recorded = bench_.rig() / "recording/recording.json";
  const std::string sets = read_text(recorded);
  retake("drape_A", "drape_E");
  const Json after = server.get("api/state");
  EXPECT_TRUE(after["drapes"][0]["result"].is_null());
  EXPECT_THAT(after["drapes"][0]["result_superseded"].dump(),
              HasSubstr("laying `drape_A`: `drape_A` has other pictures now"));
  EXPECT_EQ(after["report_superseded"], true);

  write_durable(recorded, sets);
  EXPECT_EQ(server.get("api/state")["drapes"][0], before["drapes"][0]);
  take(server, {"drape_A"});
  const Json taken = server.idle_state();
  EXPECT_EQ(taken["drapes"][0]["result"], before["drapes"][0]["result"]);
  ASSERT_EQ(server.act({{"do", "drop"}, {"set", "drape_A"}}), 200);
  const Json without = server.get("api/state");
  EXPECT_THAT(without["drapes"][0]["result_superseded"].dump(), HasSubstr("`drape_A` is left out"));
  EXPECT_EQ(without["report_superseded"], true);
}

TEST_F(Current, ASheetIsMeasuredWithThePlateThatItsSceneNames) {
  // The target at 90 mm stands for a plate.
  bench_.replace("rig.toml", "[[calibration.stage]]\nset = \"stage_z090\"\nz_mm = 90.0\n", "");
  bench_.replace("scenes/C.toml", "yaw_deg = 14.0",
                 "yaw_deg = 14.0\ntags_set = \"stage_z090\"\ntags_target = \"../target.toml\"");
  const RunningBench server(bench_.rig(), out());
  take(server, {"stage_z000", "pose_00", "pose_01", "stage_z090", "drape_C"});
  static_cast<void>(done(server, {{"do", "calibrate"}}));
  const Json with = done(server, {{"do", "measure"}, {"drape", "C"}})["drapes"][0];
  ASSERT_TRUE(with["sheet"].is_object()) << with.dump(1);
  ASSERT_EQ(server.act({{"do", "drop"}, {"set", "stage_z090"}}), 200);
  EXPECT_THAT(server.get("api/state")["drapes"][0]["sheet_superseded"].dump(),
              HasSubstr("`stage_z090` is left out"));
  EXPECT_EQ(server.act({{"do", "measure"}, {"drape", "C"}}), 400) << "the scene asks for the plate";
  EXPECT_EQ(server.act({{"do", "run"}}), 400);
  EXPECT_TRUE(server.get("api/sheet?drape=C")["marks"].empty());
  take(server, {"stage_z090"});
  EXPECT_EQ(server.idle_state()["drapes"][0]["sheet"], with["sheet"]);
}

TEST_F(Current, ASetThatIsNoMeasurementIsRefusedUntilItIsLeftOut) {
  Recording recording = read_recording(bench_.rig() / "recording");
  for (FrameSet& one : recording.sets)
    if (one.name == "pose_01") one.no_go = "the cloth moved by 3.1 px";
  write_recording(recording);
  const RunningBench server(bench_.rig(), out());
  take(server, {"stage_z000", "pose_00", "pose_01", "pose_02"});
  EXPECT_EQ(set_of(server.idle_state(), "pose_01")["verdict"], "NO-GO");
  const Json refused = done(server, {{"do", "calibrate"}});
  EXPECT_TRUE(refused["calibration"].is_null());
  EXPECT_THAT(refused["jobs"].back()["sentence"].get<std::string>(),
              AllOf(HasSubstr("moved by 3.1 px"), HasSubstr("pose_01")));
  ASSERT_EQ(server.act({{"do", "drop"}, {"set", "pose_01"}}), 200);
  EXPECT_EQ(done(server, {{"do", "calibrate"}})["calibration"]["verdict"], "GO");
}

/// The inputs are those that the record of a step lists.
TEST_F(Current, AnEditedInputSupersedesWhatWasMadeOfItAndIsNamed) {
  bench_.replace("rig.toml", kLaterPoses, "");
  const auto server = std::make_unique<RunningBench>(bench_.rig(), out());
  take(*server, {"stage_z000", "stage_z030", "pose_00", "pose_01", "drape_C"});
  static_cast<void>(done(*server, {{"do", "calibrate"}}));
  static_cast<void>(done(*server, {{"do", "measure"}, {"drape", "C"}}));
  const Json before = done(*server, {{"do", "run"}})["drapes"][0];
  ASSERT_TRUE(before["sheet"].is_object() && before["result"].is_object()) << before.dump(1);
  struct Edit {
    const char *file, *from, *to, *calibration, *sheet,
        *result;  ///< words that name each, if it is
  };
  for (const Edit& edit :
       {Edit{"rig.toml", "z_mm = 30.0", "z_mm = 28.0", "rig.toml", "rig.toml", "z_mm of `stage_z0"},
        Edit{"target.toml", "dot_diameter_mm = 8", "dot_diameter_mm = 7", "target.toml",
             "target.toml", "target.toml"},
        Edit{"print.toml", "margin_mm = [10.0", "margin_mm = [11.0", "", "print.toml",
             "print.toml"},
        Edit{"scenes/C.toml", "friction = 0.4", "friction = 0.5", "", "scenes/C.toml",
             "scenes/C.toml"},
        Edit{"fabrics/A.toml", "areal_density_g_per_m2 = 138", "areal_density_g_per_m2 = 139", "",
             "", "fabrics/A.toml"}}) {
    const std::string text = read_text(bench_.rig() / edit.file);
    bench_.replace(edit.file, edit.from, edit.to);
    const Json state = server->get("api/state"), drape = state["drapes"][0];
    for (const auto& [why, named] : {std::pair{state["calibration_superseded"], edit.calibration},
                                     std::pair{drape["sheet_superseded"], edit.sheet},
                                     std::pair{drape["result_superseded"], edit.result}}) {
      EXPECT_EQ(why.is_null(), std::string(named).empty()) << edit.file << why.dump();
      EXPECT_THAT(why.dump(), HasSubstr(named)) << edit.file;
    }
    EXPECT_EQ(state["report_superseded"], true) << edit.file;
    EXPECT_EQ(state["trouble"], "") << "the edit is read";
    write_durable(bench_.rig() / edit.file, "no = TOML = file");
    const bool read = std::string(edit.file) != "fabrics/A.toml";
    EXPECT_EQ(server->get("api/state")["trouble"] == "", !read) << edit.file;
    write_durable(bench_.rig() / edit.file, text);
    const Json after = server->idle_state();
    EXPECT_EQ(after["drapes"][0], before) << edit.file;
    EXPECT_EQ(after["trouble"], "");
  }
  // A picture under the running server.
  const fs::path folder = bench_.rig() / "recording/drape_C";
  const fs::path own = fs::canonical(folder);
  const std::string bytes = read_text(own / "cam0.png");
  fs::remove(folder);  // a link to the project's
  fs::copy(own, folder);
  write_durable(folder / "cam0.png", bytes + " ");
  EXPECT_THAT(server->get("api/state")["drapes"][0]["sheet_superseded"].dump(),
              HasSubstr("drape_C/cam0.png` is not as recorded"));
}

TEST_F(Current, AfterAnEditOfTheTargetCalibrateDetectsAgain) {
  const RunningBench server(bench_.rig(), out());
  take(server, {"stage_z000", "pose_00", "pose_01"});
  static_cast<void>(done(server, {{"do", "calibrate"}}));
  bench_.replace("target.toml", "pitch_mm = 20.0", "pitch_mm = 20.0001");
  EXPECT_THAT(server.get("api/state")["calibration_superseded"].dump(), HasSubstr("target.toml"));
  const Json state = done(server, {{"do", "calibrate"}});
  EXPECT_EQ(state["calibration"]["verdict"], "GO") << state["jobs"].dump(1);
  EXPECT_TRUE(state["calibration_superseded"].is_null());
}

TEST_F(Current, ThePageShowsThePicturesOfARetake) {
  const auto browser = open_browser("Chromium");
  if (!browser) GTEST_SKIP() << "missing: the browser (chromium)";
  const RunningBench server(bench_.rig(), out());
  browser->open(server.address() + "#cameras");
  browser->wait_for("[...document.images].length === 3 && document.images[0].naturalWidth > 300");
  browser->run(
      "window.seen = () => { const canvas = document.createElement('canvas'); const image = "
      "document.images[0]; canvas.width = image.naturalWidth; canvas.height = image.naturalHeight; "
      "canvas.getContext('2d').drawImage(image, 0, 0); return canvas.toDataURL(); }; "
      "window.before = window.seen();");
  retake("stage_z000", "stage_z090");
  ASSERT_EQ(server.act({{"do", "note"}, {"text", "again"}}), 200);
  browser->wait_for("document.images[0]?.naturalWidth > 300 && window.seen() !== window.before");
}

TEST_F(Current, ADamagedFileIsNamedAndMadeAgain) {
  auto server = std::make_unique<RunningBench>(bench_.rig(), out());
  take(*server, {"stage_z000", "pose_00", "pose_01"});
  const Json before = set_of(server->idle_state(), "pose_01");
  damage("console/detections/pose_01.json");
  EXPECT_TRUE(set_of(server->get("api/state"), "pose_01")["detected"].is_null());
  const Json after = done(*server, {{"do", "calibrate"}});
  ASSERT_TRUE(server->runs());
  EXPECT_TRUE(after["calibration"].is_object()) << after["jobs"].dump(1);
  EXPECT_EQ(set_of(after, "pose_01"), before);
  damage("calibration.json");
  EXPECT_THAT(server->get("api/state")["calibration_superseded"].dump(),
              HasSubstr("calibration.json"));
  server.reset();
  damage("console/detections/pose_01.json");
  const RunningBench next(bench_.rig(), out());
  // The marks that the calibration was made from hold it too.
  EXPECT_EQ(set_of(next.idle_state(), "pose_01")["detected"], before["detected"]);
}

TEST_F(Current, WhatWaitedWhenTheServerEndedIsSaidAndMeasured) {
  {
    RunningBench server(bench_.rig(), out());
    take(server, {"stage_z000", "pose_00", "drape_C"});
    static_cast<void>(server.idle_state());
    take(server, {"stage_z000"});
    server.hold_job();
    retake("drape_C", "drape_A");
    take(server, {"pose_01", "drape_C"});
    ASSERT_EQ(server.act({{"do", "calibrate"}}), 200);
    server.kill();
  }
  const RunningBench server(bench_.rig(), out());
  const Json state = server.idle_state();
  EXPECT_TRUE(set_of(state, "pose_01")["detected"].is_object());
  EXPECT_TRUE(set_of(state, "drape_C")["detected"].is_object());
  EXPECT_THAT(state["log"].dump(), HasSubstr("calibrate with 3 sets"));
  EXPECT_THAT(state["log"].dump(), HasSubstr("measures the marks of"));
}

}  // namespace
}  // namespace drape::test
