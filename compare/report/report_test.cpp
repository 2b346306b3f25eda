// SPDX-License-Identifier: Apache-2.0
#include "compare/report/report.hpp"

#include <gmock/gmock.h>

#include "compare/report/error_scale.hpp"
#include "compare/report/html.hpp"
#include "compare/tables/tables.hpp"
#include "compare/test_sheets.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/support/paths.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

/// The first position where the text is not well-formed XML, or empty. Knows what the report uses:
/// elements, attributes in double quotes, the five entities and a doctype.
std::string xml_fault(const std::string& text) {
  std::vector<std::string> open;
  for (std::size_t i = 0; i < text.size();) {
    const auto here = [&] { return " at: " + text.substr(i, 60); };
    if (text[i] == '&') {
      const std::string entity = text.substr(i, text.find(';', i) - i + 1);
      if (entity != "&amp;" && entity != "&lt;" && entity != "&gt;" && entity != "&quot;")
        return "bare ampersand" + here();
    }
    if (text[i] == '>') return "bare >" + here();
    if (text[i] != '<') {
      ++i;
      continue;
    }
    std::size_t end = i + 1;
    for (bool quoted = false; end < text.size() && (quoted || text[end] != '>'); ++end) {
      if (text[end] == '"') quoted = !quoted;
      if (text[end] == '<') return "< inside a tag" + here();
    }
    const std::string tag = text.substr(i + 1, end - i - 1);
    std::string name = tag.substr(tag[0] == '/' ? 1 : 0);
    name = name.substr(0, name.find_first_of(" /\n"));
    if (tag[0] == '/') {
      if (open.empty() || open.back() != name) return "unexpected end tag" + here();
      open.pop_back();
    } else if (tag[0] != '!' && tag.back() != '/') {
      open.push_back(name);
    }
    i = end + 1;
  }
  return open.empty() ? "" : "never closed: " + open.back();
}

struct Made {
  std::vector<fs::path> files;
  std::string html;
  Outcome outcome;
};

Made make_report(const fs::path& folder) {
  const Session session = read_session(test::write_example(folder / "A"), {});
  Made made;
  made.outcome.warnings = session.warnings;
  made.outcome.reports.push_back(compare_drape(session.drapes[0].input, {}));
  made.outcome.arguments = {(folder / "A" / "sheet.ply").string(),
                            "--report",
                            (folder / "report.html").string(),
                            "--threads",
                            "2",
                            "--quiet"};
  made.files = write_report(folder / "report.html", session, made.outcome);
  made.html = read_text(folder / "report.html");
  return made;
}

/// Removes the text between these tags, which can contain < and > and is not markup.
std::string without_style(std::string html) {
  for (const std::string name : {"style", "script"}) {
    std::size_t at = 0;
    while ((at = html.find("<" + name, at)) != std::string::npos) {
      at = html.find('>', at) + 1;
      html.erase(at, html.find("</" + name + ">", at) - at);
    }
  }
  return html;
}

/// The page without three.js, which can load models but is never asked to; the browser's test
/// checks that nothing is loaded.
std::string without_library(std::string html) {
  const std::size_t begin = html.rfind("<script>", html.find("three.js, copyright"));
  EXPECT_NE(begin, std::string::npos);
  return html.erase(begin, html.find("</script>", begin) - begin);
}

TEST(Report, IsWellFormedAndSelfContained) {
  const drape::test::TemporaryFolder folder;
  Made made = make_report(folder.path());
  EXPECT_EQ(xml_fault(without_style(made.html)), "");
  EXPECT_THAT(made.html, HasSubstr("three.js, copyright"));
  made.html = without_library(made.html);
  for (const char* load : {"<script src", "<link", "@import", "import(", "fetch(", "XMLHttp",
                           "url(", "src=", "href=\"h", "<iframe"})
    EXPECT_THAT(made.html, Not(HasSubstr(load)));
  std::size_t outside = 0;
  for (std::size_t at = made.html.find("http"); at != std::string::npos;
       at = made.html.find("http", at + 1))
    outside += made.html.compare(at, 26, "http://www.w3.org/2000/svg") != 0 &&
               made.html.compare(at, 10, "http-equiv") != 0;
  EXPECT_EQ(outside, 0U) << "only the name space of SVG may look like an address";
}

TEST(Report, SaysVerdictFirstAndHasTheNumbers) {
  const drape::test::TemporaryFolder folder;
  const Made made = make_report(folder.path());
  const std::string body = made.html.substr(made.html.find("<body>"));
  EXPECT_LT(body.find("<strong>Measurement GO</strong>"), body.find("<table"));
  for (const auto& row : virtual_virtual_table(made.outcome.reports[0]).rows)
    for (const std::string& cell : row) EXPECT_THAT(body, HasSubstr(">" + cell + "</td>"));
  for (const RealVirtual& row : made.outcome.reports[0].real_virtual)
    EXPECT_THAT(body, HasSubstr(">" + mm_text(row.statistics.mean_m) + "</td>"));
  EXPECT_THAT(body, HasSubstr("seen by one camera only &lt;2&gt;"));
  EXPECT_THAT(body, HasSubstr("residual_force_mN"));
}

TEST(Report, NamesEveryStepBackToThePictures) {
  const drape::test::TemporaryFolder folder;
  const fs::path target = folder.path() / "target-detections.json";
  write_durable(target, "{}");
  write_durable(folder.path() / "target-detections.run.json",
                R"({"schema": "drapebench/run/1", "program": "drape-detect", "version": "0.2.0",
                    "program_sha256": "0", "arguments": ["recording", "--surface", "target"],
                    "options": {}, "inputs": [], "outputs": [], "started_utc": "", "ended_utc": "",
                    "exit_code": 0})");
  Session session = read_session(test::write_example(folder.path() / "A"), {});
  Outcome outcome;
  outcome.reports.push_back(compare_drape(session.drapes[0].input, {}));
  session.calibrated_by = StepRecord{
      "drape-calib", "0.2.0", {"target-detections.json"}, {{target, sha256_of_file(target)}}};
  const std::string page = html_provenance(session, outcome, folder.path());
  EXPECT_THAT(page, HasSubstr("drape-detect recording --surface target\ndrape-calib "));
  // Another file under that name is not the source of the calibration.
  write_durable(target, "{ }");
  EXPECT_THAT(html_provenance(session, outcome, folder.path()), Not(HasSubstr("--surface target")));
}

TEST(Report, ListsFilesInOneOrderHoweverTheirPathsWereGiven) {
  const drape::test::TemporaryFolder folder;
  Session session = read_session(test::write_example(folder.path() / "A"), {});
  Outcome outcome;
  outcome.reports.push_back(compare_drape(session.drapes[0].input, {}));
  ASSERT_GT(session.read.size(), 2U);
  const std::string page = html_provenance(session, outcome, folder.path());
  for (auto& [file, sha256] : session.read)
    if (file.extension() == ".ply") file = fs::proximate(file);
  EXPECT_EQ(html_provenance(session, outcome, folder.path()), page);
}

TEST(Report, NoGoStandsFirstWithItsReasons) {
  const drape::test::TemporaryFolder folder;
  const Session session = read_session(test::write_example(folder.path() / "A"), {});
  Outcome outcome;
  outcome.reports.push_back(compare_drape(session.drapes[0].input, {.min_marks = 200}));
  write_report(folder.path() / "report.html", session, outcome);
  const std::string html = read_text(folder.path() / "report.html");
  EXPECT_LT(html.find("<strong>Measurement NO-GO</strong>"), html.find("<table"));
  EXPECT_THAT(html, HasSubstr("<li>A: only 119 marks could be compared, 200 are asked for</li>"));
}

TEST(Report, EachLinkLeadsToOnePlaceOfItsOwn) {
  const drape::test::TemporaryFolder folder;
  Session session = read_session(test::write_example(folder.path() / "A"), {});
  session.drapes.push_back(session.drapes[0]);
  Outcome outcome;
  for (const char* set : {"first laying", "second laying"}) {
    outcome.reports.push_back(compare_drape(session.drapes[0].input, {}));
    outcome.reports.back().label = outcome.reports.back().name + ", " + set;
  }
  write_report(folder.path() / "report.html", session, outcome);
  const std::string html = without_library(read_text(folder.path() / "report.html"));
  EXPECT_THAT(html, HasSubstr("<h2>Drape A, second laying</h2>"));
  int links = 0;
  const std::string link = "href=\"#";
  for (std::size_t at = html.find(link); at != std::string::npos; at = html.find(link, at + 1)) {
    const std::size_t begin = at + link.size();
    const std::string place = " id=\"" + html.substr(begin, html.find('"', begin) - begin) + "\"";
    EXPECT_NE(html.find(place), std::string::npos) << place;
    EXPECT_EQ(html.find(place), html.rfind(place)) << place;
    ++links;
  }
  EXPECT_EQ(links, 3);  // both drapes and the provenance
}

TEST(Report, LeavesNoPictureOfAnEarlierOneAndEveryOtherFile) {
  const drape::test::TemporaryFolder folder;
  const fs::path beside = folder.path() / "report";
  make_report(folder.path());
  std::vector<fs::path> written, earlier = {beside / "A-branches-2.csv", beside / "A-band.svg"};
  for (const auto& entry : fs::directory_iterator(beside)) written.push_back(entry.path());
  for (const fs::path& file : written)
    earlier.push_back(beside / ("B" + file.filename().string().substr(1)));
  const std::vector<fs::path> others = {beside / "notes.txt", beside / "loads.csv",
                                        beside / "A-loads.csv"};
  for (const auto& files : {earlier, others})
    for (const fs::path& file : files) write_durable(file, "before");
  make_report(folder.path());
  for (const fs::path& file : earlier) EXPECT_FALSE(fs::exists(file)) << file;
  for (const auto& files : {written, others})
    for (const fs::path& file : files) EXPECT_TRUE(fs::exists(file)) << file;
}

TEST(Report, SameInputGivesTheSameBytesInAnotherFolder) {
  const drape::test::TemporaryFolder one, two;
  const Made first = make_report(one.path()), second = make_report(two.path());
  EXPECT_EQ(first.html, second.html);
  ASSERT_EQ(first.files.size(), second.files.size());
  for (std::size_t i = 0; i < first.files.size(); ++i)
    EXPECT_EQ(read_text(first.files[i]), read_text(second.files[i])) << first.files[i];
}

TEST(Report, PathsAreRelativeAndSettingsWithoutEffectAreLeftOut) {
  const drape::test::TemporaryFolder folder;
  const Made made = make_report(folder.path());
  EXPECT_THAT(made.html, Not(HasSubstr(folder.path().string())));
  EXPECT_THAT(made.html, HasSubstr("drape-compare A/sheet.ply --report report.html\n"));
}

TEST(Report, EveryPictureStandsAlone) {
  const drape::test::TemporaryFolder folder;
  std::size_t pictures = 0;
  for (const fs::path& file : make_report(folder.path()).files) {
    if (file.extension() != ".svg") continue;
    ++pictures;
    EXPECT_EQ(xml_fault(read_text(file)), "") << file;
    EXPECT_THAT(read_text(file), HasSubstr("xmlns=\"http://www.w3.org/2000/svg\""));
  }
  EXPECT_EQ(pictures, 4U) << "sheet, map, histogram, strain";
}

TEST(ErrorScale, EndsAtARoundNumberAboveTheLargest) {
  EXPECT_DOUBLE_EQ(ErrorScale(7.3).top_mm(), 8);
  EXPECT_DOUBLE_EQ(ErrorScale(0.21).top_mm(), 0.25);
  EXPECT_GE(ErrorScale(2.0).top_mm(), 2.0);
  EXPECT_GT(ErrorScale(0).top_mm(), 0) << "no error at all still has a scale";
  EXPECT_EQ(ErrorScale(5).colour(0), "#440154");
  EXPECT_EQ(ErrorScale(5).colour(5), "#fde725");
}

}  // namespace
}  // namespace drape::compare
