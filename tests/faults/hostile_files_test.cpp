// SPDX-License-Identifier: Apache-2.0
// Hostile files from elsewhere: whatever they contain, a program ends within 10 s of processor time
// and 1 GB with a verdict or one sentence, nothing outside is changed or revealed, and no page runs
// their scripts.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "core/files/files.hpp"
#include "tests/faults/hostile_bench.hpp"

namespace drape::test {

void PrintTo(const HostileFile& file, std::ostream* out) {
  *out << file.name;
}

namespace {

namespace fs = std::filesystem;

constexpr long kMost_kB = 1'000'000;

std::vector<HostileFile> all_files() {
  std::vector<HostileFile> files;
  for (const auto& some :
       {hostile_names(), hostile_images(), hostile_numbers(), hostile_sizes(), hostile_stores()})
    files.insert(files.end(), some.begin(), some.end());
  return files;
}

class Hostile : public testing::TestWithParam<HostileFile> {};

TEST_P(Hostile, DoesNoHarm) {
  const HostileBench bench;
  GetParam().make(bench);
  bench.forge_records();
  const HostileBench::Met outcome = bench.run(GetParam().line);
  EXPECT_TRUE(outcome.exit_code >= 0 && outcome.exit_code <= 3)
      << "exit " << outcome.exit_code << ": " << outcome.text;
  EXPECT_EQ(bench.harm(outcome), "") << outcome.text;
  EXPECT_LT(outcome.memory_kB, kMost_kB) << outcome.text;
  const bool said = outcome.exit_code < 2 || outcome.text.find("error: ") != std::string::npos;
  EXPECT_TRUE(said) << outcome.text;
}

/// Pages that Chromium opens; each must exist, so that the test cannot pass without one.
struct Page {
  std::string of;    ///< name of the hostile file
  std::string file;  ///< in the lab
};

class HostilePage : public testing::TestWithParam<Page> {};

void PrintTo(const Page& page, std::ostream* out) {
  *out << page.of;
}

std::string dom_of(const fs::path& page, const fs::path& profile) {
  return run_line(fmt::format("timeout 1000 chromium --headless --no-sandbox --disable-gpu "
                              "--no-first-run --user-data-dir='{}' --dump-dom 'file://{}'",
                              profile.string(), page.string()))
      .text;
}

TEST_P(HostilePage, RunsNoScriptInABrowser) {
  if (std::system("command -v chromium > /dev/null 2>&1") != 0)
    GTEST_SKIP() << "chromium is absent, so the pages are not opened";
  const std::vector<HostileFile> files = all_files();
  const auto file = std::find_if(files.begin(), files.end(),
                                 [](const HostileFile& f) { return f.name == GetParam().of; });
  ASSERT_NE(file, files.end());
  const HostileBench bench;
  file->make(bench);
  bench.forge_records();
  const Outcome outcome = bench.run(file->line);
  const fs::path page = bench.lab() / GetParam().file;
  ASSERT_TRUE(fs::is_regular_file(page)) << outcome.text;
  ASSERT_NE(read_text(page).find("onerror"), std::string::npos) << "the name is not on the page";
  const TemporaryFolder profile;
  const std::string dom = dom_of(page, profile.path());
  EXPECT_NE(dom.find("<html"), std::string::npos) << dom;
  EXPECT_EQ(dom.find("data-ran"), std::string::npos);
  // The control: the same name runs if it is not escaped.
  write_durable(bench.lab() / "control.html", "<p title=\"" + kScriptName + "</p>");
  EXPECT_NE(dom_of(bench.lab() / "control.html", profile.path()).find("data-ran"),
            std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Files, Hostile, testing::ValuesIn(all_files()), [](const auto& tested) {
  std::string name = tested.param.name;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});
INSTANTIATE_TEST_SUITE_P(Pages, HostilePage,
                         testing::Values(Page{"script_in_simulated_sheet", "out/r/report.html"},
                                         Page{"script_as_simulator", "out/r/report.html"},
                                         Page{"script_as_label", "out/report.html"},
                                         Page{"script_in_store_history", "out/history.html"}),
                         [](const auto& tested) { return tested.param.of; });

}  // namespace
}  // namespace drape::test
