// SPDX-License-Identifier: Apache-2.0
// The whole path in a real browser, by keyboard alone, with the real programs on recorded sets.
// With DRAPE_SCREENSHOTS=<folder> the pictures of the README are made there.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <thread>

#include "core/files/files.hpp"
#include "tests/support/browser.hpp"
#include "tests/support/running_bench.hpp"
#include "tests/support/small_bench.hpp"
#include "tests/support/trials.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kIdle = "document.getElementById('status').dataset.idle === 'true'";
constexpr const char* kScript = "<img src=x onerror=\"document.title='owned'\"><script>1</script>";

class Page : public testing::TestWithParam<std::string> {
 protected:
  Page() : bench_({"C"}) {
    // Two stages and five poses calibrate well enough, and fast.
    bench_.replace("rig.toml",
                   "  \"pose_05\",  \"pose_06\",  \"pose_07\",  \"pose_08\",  \"pose_09\",\n"
                   "  \"pose_10\",  \"pose_11\",  \"pose_12\",  \"pose_13\",  \"pose_14\",\n",
                   "");
    bench_.replace("rig.toml", "[[calibration.stage]]\nset = \"stage_z030\"\nz_mm = 30.0\n\n", "");
    bench_.replace("rig.toml", "[[calibration.stage]]\nset = \"stage_z060\"\nz_mm = 60.0\n\n", "");
  }
  void SetUp() override {
    if (GetParam() == "Firefox" && trial_count(0, 1) == 0)
      GTEST_SKIP() << "the second browser needs DRAPE_LONG_TESTS=1";
    browser_ = open_browser(GetParam());
    if (!browser_) GTEST_SKIP() << "missing: the browser (chromium or firefox)";
  }

  static void page(Browser& browser, const std::string& key, const std::string& name) {
    browser.press(key);
    browser.wait_for("document.getElementById('main').dataset.page === '" + name + "'");
  }

  static void look_closely(Browser& browser, const std::string& name) {
    EXPECT_EQ(serious_findings(browser), Json::array()) << name;
  }

  SmallBench bench_;
  std::unique_ptr<Browser> browser_;
};

INSTANTIATE_TEST_SUITE_P(Browsers, Page, testing::Values("Chromium", "Firefox"),
                         [](const auto& p) { return p.param; });

TEST_P(Page, TheWholePathByKeyboardFromStartToReport) {
  const RunningBench server(bench_.rig(), bench_.folder() / "out");
  Browser& browser = *browser_;
  browser.open(server.address());
  browser.wait_for("document.getElementById('main').dataset.page === 'bench'");
  EXPECT_THAT(browser.value_of("document.getElementById('card-C').innerText").get<std::string>(),
              HasSubstr("Not taken"));
  look_closely(browser, "bench");
  page(browser, "2", "cameras");
  browser.wait_for(
      "[...document.images].length === 3 && [...document.images].every(i => i.naturalWidth > 300)");
  browser.press_button("take");
  browser.wait_for(std::string(kIdle) + " && document.querySelectorAll('ellipse').length > 200");
  EXPECT_EQ(browser.value_of("document.activeElement.id"), "take") << "the keyboard stays there";
  EXPECT_THAT(browser.value_of("document.body.innerText").get<std::string>(),
              HasSubstr("% saturated"));
  look_closely(browser, "cameras");

  page(browser, "3", "calibration");
  browser.press_button("take-all");
  browser.wait_for("document.getElementById('calibrate').textContent === 'Calibrate with 7 sets'");
  browser.wait_for(kIdle);
  browser.press_button("calibrate");
  browser.wait_for("document.getElementById('calibration')");
  browser.wait_for("document.getElementById('coach').textContent.includes('Predicted error')");
  EXPECT_THAT(
      browser.value_of("document.getElementById('calibration').innerText").get<std::string>(),
      HasSubstr("GO: 3 cameras calibrated together from 7 sets"));
  EXPECT_GT(browser.value_of("document.querySelectorAll('svg polygon').length"), 1) << "next pose";
  if (GetParam() == "Chromium") shoot(browser, "calibration.png");
  look_closely(browser, "calibration");

  page(browser, "4", "drape");
  browser.tab_to("face");
  browser.type("printed");
  browser.press_button("take-drape");
  browser.wait_for(std::string(kIdle) + " && document.querySelectorAll('ellipse').length > 200");
  browser.press_button("measure");
  browser.wait_for("document.getElementById('sheet')");
  EXPECT_THAT(browser.value_of("document.getElementById('sheet').innerText").get<std::string>(),
              HasSubstr("marks measured"));
  browser.wait_for("document.getElementById('sheet-view').dataset.drawn > 101");  // marks and faces
  EXPECT_THAT(browser.value_of("document.body.innerText").get<std::string>(),
              HasSubstr("1 of at least 3 layings"));
  EXPECT_GT(browser.value_of("document.querySelectorAll('svg polyline').length"), 11)
      << "edges of the box over the pictures";
  browser.press_button("run");
  browser.wait_for("document.getElementById('result')");
  browser.wait_for(kIdle);
  EXPECT_THAT(browser.value_of("document.getElementById('result').innerText").get<std::string>(),
              testing::ContainsRegex("[0-9.]+ mm[ \n]*from the cloth"));
  browser.tab_to("sheet-view");
  const Json still = browser.value_of("document.getElementById('sheet-view').toDataURL()");
  browser.press("ArrowLeft");
  EXPECT_NE(browser.value_of("document.getElementById('sheet-view').toDataURL()"), still);
  browser.run("document.querySelector('.views').scrollIntoView()");
  if (GetParam() == "Chromium") shoot(browser, "drape.png");
  look_closely(browser, "drape");
  browser.tab_to("report");
  const std::string report = browser.value_of("document.activeElement.href").get<std::string>();
  const CurlAnswer answer = curl("'" + report + "'");
  EXPECT_EQ(answer.status, 200);
  EXPECT_THAT(answer.body, HasSubstr("</html>"));

  page(browser, "5", "history");
  browser.wait_for("document.querySelectorAll('table tbody tr').length > 0");
  browser.press_button("diff");
  browser.wait_for("document.body.innerText.includes('Their drapes')");
  EXPECT_THAT(browser.value_of("document.body.innerText").get<std::string>(),
              HasSubstr("The rig was never accepted"));
  look_closely(browser, "history");

  page(browser, "6", "log");
  browser.tab_to("note");
  browser.type(kScript);
  browser.press_button("save-note");
  browser.wait_for("document.getElementById('log').innerText.includes('onerror')");
  EXPECT_EQ(browser.value_of("document.title"), "drapebench") << "names and notes are text";
  EXPECT_EQ(browser.value_of("document.querySelectorAll('#log img, #log script').length"), 0);
  EXPECT_THAT(browser.value_of("document.getElementById('log').innerText").get<std::string>(),
              HasSubstr("drape run"));
  look_closely(browser, "log");
  EXPECT_THAT(browser.errors(), IsEmpty());

  browser.open(report);
  browser.wait_for("document.querySelector('figure.turn canvas')");
  EXPECT_THAT(browser.errors(), IsEmpty()) << "the report under its policy";
}

TEST_P(Page, ARunIsCancelledByKeyboard) {
  RunningBench server(bench_.rig(), bench_.folder() / "out");
  Browser& browser = *browser_;
  browser.open(server.address() + "#calibration");
  browser.wait_for("document.getElementById('take-all')");
  browser.press_button("take-all");
  server.hold_job();  // a browser may be slower from Tab to Tab than all jobs
  browser.press_button("cancel");
  const auto is_heard = [&] {
    return server.get("api/state")["log"].dump().find("pressed cancel") != std::string::npos;
  };
  for (int look = 0; look < 100 && !is_heard(); ++look)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  server.let_job_go();
  browser.wait_for(kIdle);
  const Json state = server.idle_state();
  int cancelled = 0;
  for (const Json& job : state["jobs"]) cancelled += job["state"] == "cancelled";
  EXPECT_GT(cancelled, 0);
  EXPECT_THAT(state["log"].dump(), HasSubstr("pressed cancel"));
}

TEST_P(Page, SaysThatTheServerIsGoneAndGoesOnWithTheNext) {
  const fs::path out = bench_.folder() / "out";
  auto server = std::make_unique<RunningBench>(bench_.rig(), out);
  Browser& browser = *browser_;
  browser.open(server->address() + "#log");
  browser.wait_for("document.getElementById('log')");
  server->kill();
  browser.wait_for(
      "document.getElementById('trouble').textContent.includes('What was stored is whole')");
  const RunningBench again(bench_.rig(), out);
  browser.open(again.address() + "#log");
  browser.wait_for(
      "document.getElementById('log')?.innerText.split('the console starts').length === 3");
}

}  // namespace
}  // namespace drape::test
