// SPDX-License-Identifier: Apache-2.0
// One truth: after each action the page, the report and the history say the same of a run.
#include <gmock/gmock.h>

#include <algorithm>

#include "core/files/files.hpp"
#include "core/recording.hpp"
#include "tests/support/running_bench.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

class OneTruth : public testing::Test {
 protected:
  void SetUp() override {
    const Outcome run = bench_.run("out");
    ASSERT_LE(run.exit_code, 1) << run.text;
    server_ = std::make_unique<RunningBench>(bench_.rig(), out());
  }
  [[nodiscard]] fs::path out() const { return bench_.folder() / "out"; }

  /// The state once nothing runs, after its parts were found to agree with each other and with the
  /// history.
  Json agreed(const std::string& after) const {
    const Json state = server_->idle_state(), history = server_->get("api/history");
    const bool calibrated = state["calibration"].is_object();
    EXPECT_EQ(state["next"].is_null(), calibrated) << after;
    EXPECT_FALSE(calibrated && !state["calibration_superseded"].is_null()) << after;
    bool all = true;
    for (const Json& drape : state["drapes"]) {
      const std::string name = drape["name"], where = after + ", drape " + name;
      const bool measured = drape["sheet"].is_object(), compared = drape["result"].is_object();
      all = all && compared;
      EXPECT_FALSE(measured && !drape["sheet_superseded"].is_null()) << where;
      EXPECT_FALSE(compared && !drape["result_superseded"].is_null()) << where;
      EXPECT_EQ(measured, !server_->get("api/sheet?drape=" + name)["marks"].empty()) << where;
      EXPECT_TRUE(measured || !compared) << where;
      EXPECT_TRUE(calibrated || !measured) << where;
      for (const Json& one : drape["simulations"])
        EXPECT_TRUE(measured || !one["there"].get<bool>()) << where;
      const std::string next = drape["next"].is_null() ? "" : drape["next"]["words"];
      const char* wanted = !drape["taken"].get<bool>() ? "Take "
                           : !calibrated               ? "Calibrate first."
                           : !measured                 ? "Measure"
                           : !compared                 ? "Simulate and compare"
                                                       : "";
      EXPECT_THAT(next, *wanted == '\0' ? testing::Matcher<std::string>("") : StartsWith(wanted))
          << where;
      const Json last = last_in(history, name);
      EXPECT_TRUE(!compared || last == drape["result"]["mean_dist_mm"]) << where;
      EXPECT_TRUE(compared || last.is_null() || !drape["result_superseded"].is_null()) << where;
    }
    EXPECT_EQ(state["report_superseded"], !all) << after;
    return state;
  }
  static Json last_in(const Json& history, const std::string& drape) {
    for (const Json& line : history["charts"][0]["lines"])
      if (line["label"].get<std::string>().starts_with(drape))
        return line["points"].back()["value"];
    return {};
  }
  static const Json& of(const Json& state, const std::string& drape) {
    return *std::find_if(state["drapes"].begin(), state["drapes"].end(),
                         [&](const Json& one) { return one["name"] == drape; });
  }
  Json done(const Json& action) const {
    EXPECT_EQ(server_->act(action), 200) << action.dump();
    return agreed(action.dump());
  }

  SmallBench bench_{{"C", "E"}, measured};
  std::unique_ptr<RunningBench> server_;
};

TEST_F(OneTruth, PageReportAndHistoryAgreeAfterEachAction) {
  const Json first = agreed("opened on a finished run");
  for (const char* drape : {"C", "E"})
    ASSERT_TRUE(of(first, drape)["result"].is_object()) << "nothing is pressed again";

  EXPECT_TRUE(done({{"do", "drop"}, {"set", "pose_05"}})["calibration"].is_null());
  EXPECT_EQ(done({{"do", "take"}, {"set", "pose_05"}})["drapes"], first["drapes"]);

  const fs::path file = bench_.rig() / "recording/recording.json";
  const std::string recorded = read_text(file);
  Recording recording = read_recording(file.parent_path());
  for (FrameSet& one : recording.sets)
    if (one.name == "drape_C")
      one.frames = read_recording(file.parent_path()).set("drape_A").frames;
  write_recording(recording);
  const Json retaken = agreed("C is retaken");
  EXPECT_THAT(of(retaken, "C")["sheet_superseded"].dump(), HasSubstr("other pictures"));
  EXPECT_EQ(of(retaken, "E"), of(first, "E")) << "an action on one drape leaves the others";
  write_durable(file, recorded);
  EXPECT_EQ(agreed("the retake is undone")["drapes"], first["drapes"]);

  bench_.replace("scenes/E.toml", "friction = 0.4", "friction = 0.5");
  const Json edited = agreed("a scene is edited");
  EXPECT_THAT(of(edited, "E")["sheet_superseded"].dump(), HasSubstr("scenes/E.toml"));
  EXPECT_EQ(of(edited, "C"), of(first, "C"));
  bench_.replace("scenes/E.toml", "friction = 0.5", "friction = 0.4");
  EXPECT_EQ(agreed("the edit is undone")["drapes"], first["drapes"]);

  EXPECT_EQ(done({{"do", "calibrate"}})["drapes"], first["drapes"]) << "nothing has changed";
  EXPECT_EQ(done({{"do", "measure"}, {"drape", "C"}})["drapes"], first["drapes"]);

  bench_.replace("fabrics/B.toml", "areal_density_g_per_m2 = 291", "areal_density_g_per_m2 = 300");
  const Json heavier = agreed("a fabric is edited");
  EXPECT_THAT(of(heavier, "E")["result_superseded"].dump(), HasSubstr("fabrics/B.toml"));
  EXPECT_TRUE(of(heavier, "E")["sheet"].is_object());
  const Json simulated = done({{"do", "run"}, {"drape", "E"}});
  EXPECT_TRUE(of(simulated, "E")["result"].is_object()) << simulated["jobs"].back().dump(1);
  EXPECT_NE(of(simulated, "E")["result"]["mean_dist_mm"], of(first, "E")["result"]["mean_dist_mm"]);
  EXPECT_EQ(of(simulated, "C")["result"]["mean_dist_mm"], of(first, "C")["result"]["mean_dist_mm"])
      << "C stays in the report";

  ASSERT_EQ(server_->act({{"do", "run"}, {"drape", "C"}}), 200);
  server_->hold_job();
  const Json jobs = server_->get("api/state")["jobs"];
  EXPECT_EQ(server_->act({{"do", "cancel"}, {"job", jobs.back()["id"]}}), 200);
  server_->let_job_go();
  static_cast<void>(agreed("a run is cancelled"));

  ASSERT_EQ(server_->act({{"do", "drop"}, {"set", "pose_05"}}), 200);
  const Json recalibrated = done({{"do", "calibrate"}});
  EXPECT_TRUE(recalibrated["calibration"].is_object());
  for (const char* drape : {"C", "E"})
    EXPECT_FALSE(of(recalibrated, drape)["sheet_superseded"].is_null());
  const Json measured_again = done({{"do", "measure"}, {"drape", "C"}});
  EXPECT_TRUE(of(measured_again, "C")["sheet"].is_object());
  EXPECT_FALSE(of(measured_again, "E")["sheet_superseded"].is_null());

  server_->kill();
  server_ = std::make_unique<RunningBench>(bench_.rig(), out());
  EXPECT_EQ(agreed("killed and started again")["drapes"], measured_again["drapes"]);
}

}  // namespace
}  // namespace drape::test
