// SPDX-License-Identifier: Apache-2.0
// Tests the pages in a real browser, headless Chromium; skipped without one. With
// DRAPE_SCREENSHOTS=<folder> it makes the pictures of the stage's README, those of the report from
// the output folder of `drape run` in DRAPE_SCREENSHOT_RUN.
#include <fmt/format.h>

#include <gmock/gmock.h>
#include <sys/wait.h>

#include <cstdlib>
#include <iterator>
#include <regex>
#include <sstream>

#include "compare/report/account.hpp"
#include "compare/report/report.hpp"
#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class Browser : public testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v chromium > /dev/null 2>&1") != 0)
      GTEST_SKIP() << "chromium is absent, so the pages are not looked at";
  }

  /// Output of Chromium on both streams when it opens the page with these options.
  std::string open(const fs::path& page, const std::string& options) {
    const fs::path said = folder_.path() / "said.txt";
    const std::string command = fmt::format(
        "timeout 1000 chromium --headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
        "--disable-background-networking --disable-component-update --disable-sync "
        "--use-angle=swiftshader --enable-unsafe-swiftshader --user-data-dir='{}' "
        "--enable-logging=stderr {} 'file://{}' > '{}' 2>&1",
        (folder_.path() / "profile").string(), options, page.string(), said.string());
    EXPECT_EQ(std::system(command.c_str()), 0);
    // The software renderer remarks on its own speed, and the browser's own pages on that of the
    // machine; neither is an error of the page.
    std::string heard;
    std::istringstream lines(read_text(said));
    for (std::string line; std::getline(lines, line);)
      if (line.find("GL Driver Message (OpenGL, Performance") == std::string::npos &&
          line.find("source: chrome://") == std::string::npos)
        heard += line + '\n';
    return heard;
  }

  fs::path report() {
    const Session session = read_session(test::write_recorded_example(folder_.path()), {});
    Outcome outcome;
    compare_session(session, {}, outcome);
    fs::path page = folder_.path() / "report.html";
    write_report(page, account_of(session, outcome, folder_.path()));
    return page;
  }

  /// A copy of the page with a script of the test at its end, which its policy is changed to allow.
  fs::path with_script(const fs::path& page, const std::string& script) {
    std::string text = read_text(page);
    text.insert(text.find("</body>"), "<script>" + script + "</script>");
    const std::string allowed = "; script-src";
    const std::size_t policy = text.find(allowed);
    if (policy != std::string::npos)
      text.insert(policy + allowed.size(), " '" + script_hash(script) + "'");
    fs::path changed = folder_.path() / "changed.html";
    write_durable(changed, text);
    return changed;
  }

  drape::test::TemporaryFolder folder_;
};

TEST_F(Browser, DrawsTheTurningViewWithoutErrorsAndObeysTheKeys) {
  const fs::path page = report();
  const std::string script =
      "const c=document.querySelector('.turn canvas');const p=()=>c.toDataURL();const a=p();"
      "const k=n=>c.dispatchEvent(new KeyboardEvent('keydown',{key:n}));"
      "k('ArrowLeft');const b=p();k('0');const d=p();k('+');const e=p();k('0');"
      "document.querySelector('[data-key=cloth]').click();const f=p();"
      "document.querySelector('[data-key=real]').click();const g=p();"
      "document.title='turned '+(a!==b)+', reset '+(a===d)+', nearer '+(a!==e)+', without cloth '"
      "+(a!==f)+', without real '+(f!==g)+', loaded '"
      "+performance.getEntriesByType('resource').length;";
  const std::string said = open(with_script(page, script), "--dump-dom");
  EXPECT_THAT(
      said,
      HasSubstr("turned true, reset true, nearer true, without cloth true, without real true, "
                "loaded 0"));
  EXPECT_THAT(said, testing::ContainsRegex("data-drawn=\"[1-9][0-9][0-9]"));
  EXPECT_THAT(said, Not(HasSubstr("CONSOLE")));
}

TEST_F(Browser, ThisTestSeesScriptErrors) {
  const std::string said = open(with_script(report(), "nothing.is.here();"), "--dump-dom");
  EXPECT_THAT(said, HasSubstr("CONSOLE"));
}

TEST_F(Browser, SaysWhereTheNumbersAreWithScriptsOff) {
  // The page's own policy forbids every script, as a browser with scripts off does.
  std::string text = read_text(report());
  text.insert(text.find("<head>") + 6,
              "<meta http-equiv=\"Content-Security-Policy\" content=\"script-src 'none'\"/>");
  const fs::path page = folder_.path() / "still.html";
  write_durable(page, text);
  const std::string said = open(page, "--dump-dom");
  EXPECT_THAT(said, HasSubstr("The same numbers are in report.json"));
}

TEST_F(Browser, RoundsAsTheProgramDoes) {
  std::string cases, rule = read_text(drape::test::source_root() / "core/page/figure.js");
  for (const double value :
       {0.0, 0.004, 0.05, 0.5, 1.005, 1.2237, 2.5, 9.995, 20.586, 123.456, 1e5})
    for (const double sign : {1.0, -1.0})
      for (const double u : {0.0, 1e-5, 0.0985, 0.0996, 0.5, 0.995, 2.151, 25.0, 250.0})
        cases += fmt::format("[{},{},'{}'],", sign * value, u,
                             figure(sign * value, u > 0 ? std::optional(u) : std::nullopt));
  rule = std::regex_replace(rule, std::regex("export "), "");
  const fs::path page = folder_.path() / "figures.html";
  write_durable(page, "<!DOCTYPE html><title>none</title><body><script>" + rule + "const bad=[" +
                          cases +
                          "].filter(([v,u,text])=>figure(v,u||null)!==text);"
                          "document.title='differ: '+JSON.stringify(bad);</script></body>");
  EXPECT_THAT(open(page, "--dump-dom"), HasSubstr("<title>differ: []</title>"));
}

TEST_F(Browser, ShowsEachVerdictAndNumberOnAPhoneWithoutScrolling) {
  const Session session = read_session(test::write_recorded_example(folder_.path()), {});
  Outcome outcome;
  compare_session(session, {}, outcome);
  RunReport report = account_of(session, outcome, folder_.path());
  for (const char* name : {"B", "C", "D"}) {
    report.drapes.push_back(report.drapes.front());
    report.drapes.back().name = report.drapes.back().label = name;
  }
  const fs::path page = folder_.path() / "report.html";
  write_report(page, report);
  const std::string script =
      "const low=q=>Math.max(...[...document.querySelectorAll(q)].map(e=>e.getBoundingClientRect()"
      ".bottom));const n=q=>document.querySelectorAll(q).length;"
      "document.title='cards '+n('.card .match')+' '+n('.card .number')+', in view '"
      "+(low('.card .match')<844&&low('.card .number')<844)+', wide '"
      "+(document.documentElement.scrollWidth<=innerWidth)+', '+new "
      "Set([...document.querySelectorAll('[id]')].map(e=>e.id))"
      ".size+' = '+n('[id]');";
  // Headless Chromium has no window below 500 px: a frame of a phone's size holds the page.
  const fs::path inner = with_script(page, script + "parent.postMessage(document.title,'*');");
  const fs::path phone = folder_.path() / "phone.html";
  write_durable(phone,
                "<!DOCTYPE html><title>none</title><body><iframe width=390 height=844 src='" +
                    inner.filename().string() +
                    "'></iframe><script>addEventListener('message',e=>{document.title=e.data;});"
                    "</script></body>");
  const std::string said =
      open(phone, "--window-size=800,1000 --virtual-time-budget=5000 --dump-dom");
  EXPECT_THAT(said, testing::ContainsRegex("cards 4 4, in view true, wide true, ([0-9]+) = "));
  std::smatch ids;
  ASSERT_TRUE(std::regex_search(said, ids, std::regex(", ([0-9]+) = ([0-9]+)<")));
  EXPECT_EQ(ids[1], ids[2]) << "each link leads to one place";
}

/// Adds a reference drape over several years whose last value deviates.
void fill_history(const fs::path& file) {
  Store store(file);
  int i = 0;
  for (const double height : {5.02, 5.11, 4.93, 5.06, 4.98, 5.04, 5.09, 4.91, 5.03, 5.46}) {
    for (const int segments : {5, 1}) {
      const double raised_m = (height + (segments == 1 ? 1.3 + 0.01 * (i % 3) : 0)) * units::mm;
      const test::Shape shape = [raised_m](const Eigen::Vector2d& m) -> Eigen::Vector3d {
        return test::flat(m) + Eigen::Vector3d(0, 0, raised_m);
      };
      const DrapeInput input =
          test::drape_of(test::measured_sheet(shape), {test::simulated_sheet(21, segments)});
      test::add(store, input, compare_drape(input, {}));
    }
    ++i;
  }
  store.close();
}

TEST_F(Browser, ShowsTheHistory) {
  const fs::path store = folder_.path() / "results.sqlite", page = folder_.path() / "history.html";
  fill_history(store);
  write_durable(page, history_page(StoreReader(store), {}).html);
  const char* shots = std::getenv("DRAPE_SCREENSHOTS");
  const fs::path picture =
      (shots != nullptr ? fs::path(shots) : folder_.path()) / "history-page.png";
  const std::string said = open(
      page,
      fmt::format("--hide-scrollbars --screenshot='{}' --window-size=1200,1000", picture.string()));
  EXPECT_THAT(said, Not(HasSubstr("CONSOLE")));
  EXPECT_GT(fs::file_size(picture), 10000U);
}

long count_of(const std::string& text, const std::string& pattern) {
  const std::regex wanted(pattern);
  return std::distance(std::sregex_iterator(text.begin(), text.end(), wanted), {});
}

TEST_F(Browser, PrintsTheCertificateOnOnePage) {
  const fs::path page = report(), paper = folder_.path() / "report.pdf";
  for (const std::string size : {"A4", "letter"}) {
    const fs::path sized = with_script(
        page,
        "document.head.insertAdjacentHTML('beforeend','<style>@page{size:" + size + "}</style>');");
    open(sized, fmt::format("--print-to-pdf='{}'", paper.string()));
    ASSERT_TRUE(fs::is_regular_file(paper));
    const std::string pdf = read_text(paper);
    EXPECT_THAT(pdf, testing::StartsWith("%PDF"));
    EXPECT_GT(pdf.size(), 10000U);
    EXPECT_EQ(count_of(pdf, "/Type */Page[^s]"), 1) << size;
  }
}

TEST_F(Browser, MakesTheReadmesPictures) {
  const char *shots = std::getenv("DRAPE_SCREENSHOTS"), *run = std::getenv("DRAPE_SCREENSHOT_RUN");
  if (shots == nullptr || run == nullptr)
    GTEST_SKIP() << "set DRAPE_SCREENSHOTS and DRAPE_SCREENSHOT_RUN to make them";
  const Session session = read_session(files_in({run}).sheets, files_in({run}).calibration);
  Outcome outcome;
  compare_session(session, {}, outcome);
  const fs::path page = folder_.path() / "report.html";
  write_report(page, account_of(session, outcome, folder_.path()));
  for (const auto& [name, size] :
       {std::pair{"report-page.png", "1280,900"}, {"report-phone.png", "500,1000"}}) {
    const fs::path picture = fs::path(shots) / name;
    const std::string said = open(page, fmt::format("--hide-scrollbars --screenshot='{}' "
                                                    "--window-size={}",
                                                    picture.string(), size));
    EXPECT_THAT(said, Not(HasSubstr("CONSOLE")));
    EXPECT_GT(fs::file_size(picture), 50000U);
  }
}

TEST_F(Browser, ColoursGrowInLightnessSoThatTheyNeedNoHue) {
  std::string rule = read_text(drape::test::source_root() / "core/page/colour.js");
  rule = std::regex_replace(rule, std::regex("export "), "");
  const fs::path page = folder_.path() / "colours.html";
  // Relative luminance (WCAG 2.1).
  write_durable(page, "<!DOCTYPE html><title>none</title><body><script>" + rule +
                          "const s=colourScale(7.3),l=v=>s.rgb(v).map(c=>c/255).map(c=>c<=0.04045?"
                          "c/12.92:((c+0.055)/1.055)**2.4).reduce((a,c,k)=>a+c*[0.2126,0.7152,"
                          "0.0722][k],0);let up=true;for(let v=0.25;v<=8;v+=0.25)up=up&&l(v)>l(v-"
                          "0.25);document.title=[up,s.top,colourScale(0.21).top,colourScale(0).top>"
                          "0,s.rgb(0),s.rgb(8)].join(' ');</script></body>");
  EXPECT_THAT(open(page, "--dump-dom"),
              HasSubstr("<title>true 8 0.25 true 68,1,84 253,231,37</title>"));
}

}  // namespace
}  // namespace drape::compare
