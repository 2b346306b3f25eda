// SPDX-License-Identifier: Apache-2.0
// The documents are correct: commands exist, links are valid, every file format is
// listed.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <regex>
#include <set>

#include "core/files/files.hpp"
#include "tests/architecture/source_files.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::IsEmpty;

std::string text_of(const std::string& path) {
  return read_text(source_root() / path);
}

/// Not a matcher on the whole text, so that a failure prints one line.
bool says(const std::string& document, const std::string& what) {
  return text_of(document).find(what) != std::string::npos;
}

bool is_executable(const std::string& path) {
  return (fs::status(source_root() / path).permissions() & fs::perms::owner_exec) !=
         fs::perms::none;
}

TEST(Documents, ReadmeNamesTheTwoCommands) {
  for (const std::string command : {"demo", "check"}) {
    EXPECT_TRUE(says("README.md", "./" + command)) << command;
    EXPECT_TRUE(is_executable(command)) << command;
  }
  EXPECT_TRUE(says(".ci/run", "./check"));
}

TEST(Documents, ReadmeListsEveryFolder) {
  for (const std::string stage : stages) {
    EXPECT_TRUE(says("README.md", "(" + stage + "/README.md)")) << stage;
    const std::string program = stage == "console" ? "bench" : stage;
    EXPECT_TRUE(says("README.md", "`drape-" + program + "`")) << stage;
  }
}

/// Names of file formats in one line: `schema = "drapebench/<name>/<n>"`, written or checked.
void add_schemas(const std::string& line, std::set<std::string>& found) {
  static const std::regex written(R"re(schema\b.*drapebench/([a-z][a-z-]*)/(?:[0-9]|\{))re");
  static const std::regex read(R"re(Format format_of<[^"]*"([a-z][a-z-]*)")re");
  static const std::regex described(R"re("([a-z][a-z-]*)", Syntax::(?:json|toml))re");
  std::smatch match;
  for (const std::regex* pattern : {&written, &read, &described}) {
    if (std::regex_search(line, match, *pattern)) found.insert(match[1]);
  }
}

TEST(Documents, EverySchemaIsDocumented) {
  std::vector<SourceFile> files = source_files("rigs", {".toml", ".json"});
  for (const SourceFile& file : cpp_files()) {
    if (!file.is_test()) files.push_back(file);
  }
  std::set<std::string> found;
  for (const SourceFile& file : files) {
    for (const Line& line : file.lines) add_schemas(line.text, found);
  }
  EXPECT_THAT(found, testing::IsSupersetOf({"rig", "target", "print", "scene", "recording",
                                            "detections", "calibration", "sheet", "run"}));
  const std::string conventions = text_of("CONVENTIONS.md");
  std::erase_if(found, [&](const std::string& name) {
    return conventions.find("`drapebench/" + name + "/") != std::string::npos;
  });
  EXPECT_THAT(found, IsEmpty()) << "schemas that the table of CONVENTIONS.md lacks";
}

/// Relative targets of the links and pictures of a Markdown text.
std::vector<std::string> link_targets(const std::string& text) {
  const std::regex link(R"(\]\(([^)#\s]+)[^)]*\))");
  std::vector<std::string> targets;
  for (std::sregex_iterator it(text.begin(), text.end(), link), end; it != end; ++it) {
    const std::string target = (*it)[1];
    if (target.find("://") == std::string::npos) targets.push_back(target);
  }
  return targets;
}

TEST(Documents, EveryLinkLeadsSomewhere) {
  std::vector<std::string> dead;
  for (const SourceFile& document : markdown_files()) {
    for (const std::string& target : link_targets(text_of(document.path))) {
      const fs::path to = source_root() / fs::path(document.path).parent_path() / target;
      if (!fs::exists(to)) dead.push_back(fmt::format("{}: {}", document.path, target));
    }
  }
  EXPECT_THAT(dead, IsEmpty());
}

TEST(Documents, TheVersionIsTheSameEverywhere) {
  const std::string cmake = text_of("CMakeLists.txt");
  std::smatch match;
  ASSERT_TRUE(std::regex_search(cmake, match, std::regex(R"(VERSION ([0-9]+\.[0-9]+\.[0-9]+))")));
  // The first VERSION followed by three numbers is the project's; cmake_minimum_required has two.
  const std::string version = match[1];
  EXPECT_TRUE(says("CHANGELOG.md", "## " + version)) << version;
  EXPECT_TRUE(says("CITATION.cff", "version: " + version)) << version;
}

}  // namespace
}  // namespace drape::test
