// SPDX-License-Identifier: Apache-2.0
// The page with live cameras in real browsers, by keyboard alone.
#include <algorithm>
#include <cstdio>

#include "tests/support/browser.hpp"
#include "tests/support/live_console.hpp"
#include "tests/support/trials.hpp"

namespace drape::test {
namespace {

using testing::Each;
using testing::HasSubstr;

class LivePage : public LiveConsole, public testing::WithParamInterface<std::string> {
 protected:
  /// Pictures of this camera that were on the screen.
  static std::string pictures_of(int camera) {
    return fmt::format("Number(document.getElementById('live-cam{}')?.dataset.count ?? 0)", camera);
  }
};

INSTANTIATE_TEST_SUITE_P(Browsers, LivePage, testing::Values("Chromium", "Firefox"),
                         [](const auto& p) { return p.param; });

TEST_P(LivePage, ShowsTheCamerasAndTakesByOneKey) {
  if (GetParam() == "Firefox" && trial_count(0, 1) == 0)
    GTEST_SKIP() << "the second browser needs DRAPE_LONG_TESTS=1";
  begin("software_trigger");
  const RunningBench server(bench.rig(), out(), 0, false);
  const std::unique_ptr<Browser> opened = open_browser(GetParam());
  if (!opened) GTEST_SKIP() << "missing: the browser (chromium or firefox)";
  Browser& browser = *opened;
  browser.open(server.address() + "#cameras");
  for (int c = 0; c < kCameras; ++c) browser.wait_for(pictures_of(c) + " >= 3");
  browser.wait_for("document.getElementById('take') && !document.getElementById('take').disabled");
  std::vector<double> delays_ms;
  for (int c = 0; c < kCameras; ++c)
    delays_ms.push_back(
        browser
            .value_of(fmt::format("Number(document.getElementById('live-cam{}').dataset.delay)", c))
            .get<double>());
  std::printf("from the frame in the capture to the screen: %.0f, %.0f, %.0f ms\n", delays_ms[0],
              delays_ms[1], delays_ms[2]);

  for (int c = 0; c < kCameras; ++c)
    browser.wait_for(fmt::format(
        "document.getElementById('seen-cam{}').textContent.includes('108 of 108 marks, 6 tags')",
        c));
  browser.press("t");
  std::size_t refused = 0;  // on a starved machine; a browser notes each as an error
  await(server, [&](const Json& state) {
    const bool recorded = is_recorded(state, "stage_z000");
    if (!recorded && is_ready(state)) {
      browser.press("t");
      ++refused;
    }
    return recorded;
  });
  browser.wait_for("document.getElementById('banner').textContent === 'stage_z000 is taken'");
  browser.wait_for("document.getElementById('take').textContent.includes('stage_z030')");
  EXPECT_EQ(serious_findings(browser), Json::array());
  browser.wait_for("!document.querySelector('img.late')");
  if (GetParam() == "Chromium") shoot(browser, "cameras.png");

  devices[1]->unplug();
  browser.wait_for("document.getElementById('banner').textContent === 'cam1 is lost'");
  browser.wait_for(
      "document.getElementById('trouble').textContent.includes('check cable and power')");
  browser.press("t");
  browser.wait_for("document.getElementById('banner').textContent === 'stage_z030 is not taken'");
  browser.wait_for("document.getElementById('trouble').textContent.includes('no whole set came')");
  EXPECT_EQ(browser.value_of("document.getElementById('banner').className"), "bad");
  devices[1]->plug_in();
  browser.wait_for("document.body.innerText.includes('it sends frames again')");
  browser.wait_for("document.getElementById('banner').textContent === 'cam1 is back'");
  const auto errors = browser.errors();
  EXPECT_THAT(errors, Each(HasSubstr("/api/do")));
  EXPECT_LE(errors.size(), refused);
}

}  // namespace
}  // namespace drape::test
