// SPDX-License-Identifier: Apache-2.0
// The whole path in a real browser, by keyboard alone, with the real programs on recorded sets.
// With DRAPE_SCREENSHOTS=<folder> the pictures of the README are made there.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cstdlib>

#include "console/browser.hpp"
#include "console/running_bench.hpp"
#include "core/files/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kIdle = "document.getElementById('status').dataset.idle === 'true'";
constexpr const char* kScript = "<img src=x onerror=\"document.title='owned'\"><script>1</script>";

class Page : public testing::Test {
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
    if (!Browser::installed()) GTEST_SKIP() << "chromium is absent, so the page is not looked at";
  }

  static void page(Browser& browser, const std::string& key, const std::string& name) {
    browser.press(key);
    browser.wait_for("document.getElementById('main').dataset.page === '" + name + "'");
  }

  static void press(Browser& browser, const std::string& id) {
    browser.wait_for("document.getElementById('" + id + "') && !document.getElementById('" + id +
                     "').disabled");
    browser.tab_to(id);
    browser.press("Enter");
  }

  /// Nothing of the page is wider than a phone, and axe finds nothing serious, where axe is.
  static void look_closely(Browser& browser, const std::string& name) {
    browser.size(390, 800);
    EXPECT_EQ(browser.value_of("document.scrollingElement.scrollWidth <= window.innerWidth"), true)
        << name << " at phone width";
    browser.size(1280, 1000);
    const fs::path axe = fs::path(program("drape")).parent_path().parent_path() /
                         "npm/node_modules/axe-core/axe.min.js";
    if (!fs::is_regular_file(axe)) {
      std::printf("axe-core is absent: npm install --prefix BUILD/npm axe-core\n");
      return;
    }
    static_cast<void>(browser.value_of(read_text(axe) + "; 0"));
    const Json found = browser.value_of(
        "axe.run(document, {rules: {}}).then(r => r.violations.filter(v => ['serious', "
        "'critical'].includes(v.impact)).map(v => v.id + ': ' + v.nodes.map(n => "
        "n.html).join(' ')))");
    EXPECT_EQ(found, Json::array()) << name;
  }

  static void shoot(Browser& browser, const std::string& name) {
    const char* shots = std::getenv("DRAPE_SCREENSHOTS");
    if (shots != nullptr) browser.screenshot(fs::path(shots) / name);
  }

  SmallBench bench_;
};

TEST_F(Page, TheWholePathByKeyboardFromStartToReport) {
  const RunningBench server(bench_.rig(), bench_.folder() / "out");
  Browser browser;
  browser.open(server.address());
  browser.wait_for("document.getElementById('main').dataset.ready === 'true'");

  browser.wait_for(
      "[...document.images].length === 3 && [...document.images].every(i => i.naturalWidth > 300)");
  press(browser, "take");
  browser.wait_for(std::string(kIdle) + " && document.querySelectorAll('ellipse').length > 200");
  EXPECT_EQ(browser.value_of("document.activeElement.id"), "take") << "the keyboard stays there";
  EXPECT_THAT(browser.value_of("document.body.innerText").get<std::string>(),
              HasSubstr("% saturated"));
  shoot(browser, "cameras.png");
  look_closely(browser, "cameras");

  page(browser, "2", "calibration");
  press(browser, "take-all");
  browser.wait_for("document.getElementById('calibrate').textContent === 'Calibrate with 7 sets'");
  browser.wait_for(kIdle);
  press(browser, "calibrate");
  browser.wait_for("document.getElementById('calibration')");
  browser.wait_for("document.getElementById('coach').textContent.includes('Predicted error')");
  EXPECT_THAT(
      browser.value_of("document.getElementById('calibration').innerText").get<std::string>(),
      HasSubstr("GO: 3 cameras calibrated together from 7 sets"));
  EXPECT_GT(browser.value_of("document.querySelectorAll('svg polygon').length"), 1) << "next pose";
  shoot(browser, "calibration.png");
  look_closely(browser, "calibration");

  page(browser, "3", "drape");
  press(browser, "take-drape");
  browser.wait_for(std::string(kIdle) + " && document.querySelectorAll('ellipse').length > 200");
  press(browser, "measure");
  browser.wait_for("document.getElementById('sheet')");
  EXPECT_THAT(browser.value_of("document.getElementById('sheet').innerText").get<std::string>(),
              HasSubstr("marks measured"));
  browser.wait_for("document.getElementById('sheet-view').dataset.drawn > 200");
  press(browser, "run");
  browser.wait_for("document.getElementById('result')");
  browser.wait_for(kIdle);
  EXPECT_THAT(browser.value_of("document.getElementById('result').innerText").get<std::string>(),
              testing::ContainsRegex("Mean distance real to virtual [0-9.]+ mm, U .* mm, 11x11"));
  browser.tab_to("sheet-view");
  const Json still = browser.value_of("document.getElementById('sheet-view').toDataURL()");
  browser.press("ArrowLeft");
  EXPECT_NE(browser.value_of("document.getElementById('sheet-view').toDataURL()"), still);
  shoot(browser, "drape.png");
  look_closely(browser, "drape");
  browser.tab_to("report");
  const std::string report = browser.value_of("document.activeElement.href").get<std::string>();
  const CurlAnswer answer = curl("'" + report + "'");
  EXPECT_EQ(answer.status, 200);
  EXPECT_THAT(answer.body, HasSubstr("</html>"));

  page(browser, "4", "history");
  browser.wait_for("document.querySelectorAll('table tbody tr').length > 0");
  press(browser, "diff");
  browser.wait_for("document.body.innerText.includes('Their drapes')");
  look_closely(browser, "history");

  page(browser, "5", "log");
  browser.tab_to("note");
  browser.type(kScript);
  press(browser, "save-note");
  browser.wait_for("document.getElementById('log').innerText.includes('onerror')");
  EXPECT_EQ(browser.value_of("document.title"), "drapebench") << "names and notes are text";
  EXPECT_EQ(browser.value_of("document.querySelectorAll('#log img, #log script').length"), 0);
  EXPECT_THAT(browser.value_of("document.getElementById('log').innerText").get<std::string>(),
              HasSubstr("drape run"));
  look_closely(browser, "log");
  EXPECT_THAT(browser.errors(), IsEmpty());

  browser.open(report);
  browser.wait_for("document.querySelector('figure.turn:not([hidden]) canvas')");
  EXPECT_THAT(browser.errors(), IsEmpty()) << "the report under its policy";
}

TEST_F(Page, ARunIsCancelledByKeyboard) {
  const RunningBench server(bench_.rig(), bench_.folder() / "out");
  Browser browser;
  browser.open(server.address() + "#calibration");
  browser.wait_for("document.getElementById('take-all')");
  press(browser, "take-all");
  press(browser, "cancel");
  browser.wait_for(kIdle);
  const Json state = server.idle_state();
  int cancelled = 0;
  for (const Json& job : state["jobs"]) cancelled += job["state"] == "cancelled";
  EXPECT_GT(cancelled, 0);
  EXPECT_THAT(state["log"].dump(), HasSubstr("pressed cancel"));
}

TEST_F(Page, SaysThatTheServerIsGoneAndGoesOnWithTheNext) {
  const fs::path out = bench_.folder() / "out";
  auto server = std::make_unique<RunningBench>(bench_.rig(), out);
  Browser browser;
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
