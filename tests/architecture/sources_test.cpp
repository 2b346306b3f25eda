// SPDX-License-Identifier: Apache-2.0
// Rules for every source file: licence line, guards, no leftovers, no exit or print in libraries.
#include <gmock/gmock.h>

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>

#include "tests/architecture/source_files.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

using testing::IsEmpty;

TEST(Sources, EveryFileStartsWithItsLicence) {
  std::vector<std::string> findings;
  for (const SourceFile& file : cpp_files()) {
    if (file.lines.empty() || file.lines[0].text != "// SPDX-License-Identifier: Apache-2.0") {
      findings.push_back(file.path);
    }
  }
  EXPECT_THAT(findings, IsEmpty());
}

TEST(Sources, EveryHeaderHasAGuard) {
  std::vector<std::string> findings;
  for (const SourceFile& file : cpp_files()) {
    if (file.is_header() && (file.lines.size() < 2 || file.lines[1].text != "#pragma once")) {
      findings.push_back(file.path);
    }
  }
  EXPECT_THAT(findings, IsEmpty());
}

// This shows that the header compiles on its own, without a target for it.
TEST(Sources, ASourceIncludesItsOwnHeaderFirst) {
  std::vector<std::string> findings;
  int pairs = 0;
  for (const SourceFile& file : cpp_files()) {
    if (file.is_header()) continue;
    const std::string header = file.path.substr(0, file.path.rfind('.')) + ".hpp";
    if (!std::filesystem::exists(source_root() / header)) continue;
    ++pairs;
    const auto first = std::find_if(file.lines.begin(), file.lines.end(),
                                    [](const Line& line) { return !included(line.text).empty(); });
    if (first == file.lines.end() || included(first->text) != header) findings.push_back(file.path);
  }
  EXPECT_GT(pairs, 100);
  EXPECT_THAT(findings, IsEmpty());
}

// The next command is copied into a shell.
TEST(Sources, PathsInANextCommandAreWordsOfAShell) {
  std::vector<std::string> findings;
  int commands = 0;
  for (const SourceFile& file : cpp_files()) {
    std::string code;
    for (const Line& line : file.lines) code += line.text + '\n';
    static const std::regex path(R"(\.string\(\)|arguments\.(store|file)\b|(outcome|all)\.store)");
    static const std::regex word(R"(shell_word\()");
    const auto count = [](const std::string& text, const std::regex& what) {
      return std::distance(std::sregex_iterator(text.begin(), text.end(), what), {});
    };
    for (std::size_t at = 0; (at = code.find("next_command =", at)) != std::string::npos; ++at) {
      const std::string statement = code.substr(at, code.find(";\n", at) - at);
      commands += count(statement, path) > 0 ? 1 : 0;
      if (count(statement, path) > count(statement, word))
        findings.push_back(file.path + ": " + statement);
    }
  }
  EXPECT_GT(commands, 15);
  EXPECT_THAT(findings, IsEmpty());
}

/// Matches of group 1 in the code of a file, without comments.
std::set<std::string> names_in(const SourceFile& file, const std::regex& pattern) {
  std::set<std::string> names;
  for (const Line& line : file.lines) {
    const std::string code = line.text.substr(0, line.text.find("//"));
    for (std::sregex_iterator m(code.begin(), code.end(), pattern), end; m != end; ++m)
      names.insert((*m)[1]);
  }
  return names;
}

// Sources are joined before compilation, so a constant of another file, perhaps in other units,
// would be used without an error.
TEST(Sources, AConstantIsOfTheFileThatUsesIt) {
  const std::regex declared(R"(\b(k[A-Z]\w*)\s*(?:=[^=]|=$|\[|\{))");
  const std::regex made(R"([\w>]\s+(k[A-Z]\w*)\()");
  const std::regex enumerated(R"(\benum\b[^{]*\{[^}]*?\b(k[A-Z]\w*))");
  const std::regex used(R"((?:^|[^\w:])(k[A-Z]\w*)\b)");
  const auto own_of = [&](const SourceFile& file) {
    std::set<std::string> own = names_in(file, declared);
    own.merge(names_in(file, made));
    own.merge(names_in(file, enumerated));
    return own;
  };
  std::set<std::string> in_headers, in_sources;
  for (const SourceFile& file : cpp_files()) {
    // Headers also contain enumerators and the like, so every name in one counts.
    if (file.is_header()) in_headers.merge(names_in(file, used));
    if (!file.is_header()) in_sources.merge(own_of(file));
  }
  EXPECT_GT(in_sources.size(), 300U);
  std::vector<std::string> findings;
  for (const SourceFile& file : cpp_files()) {
    const std::set<std::string> own = own_of(file);
    for (const std::string& name : names_in(file, used)) {
      if (in_sources.contains(name) && !own.contains(name) && !in_headers.contains(name))
        findings.push_back(file.path + ": " + name);
    }
  }
  EXPECT_THAT(findings, IsEmpty());
}

TEST(Sources, NothingUnfinishedIsLeftInThem) {
  // Split, so that this file does not find itself.
  const std::regex leftovers(
      "\\b(TO"
      "DO|FIX"
      "ME|XX"
      "X|HA"
      "CK|not imple"
      "mented|place"
      "holder)\\b");
  std::vector<std::string> findings;
  for (const SourceFile& file : cpp_files()) {
    for (const Line& line : file.lines) {
      if (std::regex_search(line.text, leftovers)) findings.push_back(finding(file, line));
    }
  }
  EXPECT_THAT(findings, IsEmpty());
}

/// A temporary returned by a call ends before a range-for over its member begins (until C++23).
TEST(Sources, NoLoopRunsOverWhatACallsPointerHolds) {
  const std::regex loop(R"(\bfor \(.*[^:]:[^:].*\(\)->)");
  ASSERT_TRUE(std::regex_search("for (const Set& one : recording()->sets)", loop));
  std::vector<std::string> findings;
  for (const SourceFile& file : cpp_files()) {
    for (const Line& line : file.lines)
      if (line.text.find("regex_search") == std::string::npos && std::regex_search(line.text, loop))
        findings.push_back(finding(file, line));
  }
  EXPECT_THAT(findings, IsEmpty());
}

/// Sources of the stage libraries and of core, as CMake lists them.
std::vector<std::string> library_sources() {
  std::istringstream names(DRAPE_LIBRARY_SOURCES);
  std::vector<std::string> result;
  for (std::string name; names >> name;) result.push_back(name);
  return result;
}

TEST(Sources, LibrariesNeitherExitNorPrint) {
  const std::regex forbidden(
      R"((\bexit\(|\babort\(|\bterminate\(|std::cout|std::cerr|std::clog|\bprintf\(|\bputs\(|fmt::print\())");
  const std::vector<std::string> sources = library_sources();
  ASSERT_FALSE(sources.empty());
  std::vector<std::string> findings;
  for (const SourceFile& file : cpp_files()) {
    const bool in_library =
        file.is_header() || std::find(sources.begin(), sources.end(), file.path) != sources.end();
    if (file.is_test() || !in_library) continue;
    for (const Line& line : file.lines) {
      const std::string code = line.text.substr(0, line.text.find("//"));
      if (std::regex_search(code, forbidden)) findings.push_back(finding(file, line));
    }
  }
  EXPECT_THAT(findings, IsEmpty());
}

/// fmt::print and streams neither replace control characters nor survive a full standard error;
/// print_text(), print_message() and print_error() do.
TEST(Sources, ProgramsPrintThroughTheFunctionsOfCore) {
  const std::regex forbidden(R"(fmt::print\(|std::(cout|cerr|clog)\b)");
  std::vector<std::string> findings;
  for (const SourceFile& file : cpp_files()) {
    if (file.is_test() || file.path.find("validation/") != std::string::npos) continue;
    for (const Line& line : file.lines)
      if (std::regex_search(line.text.substr(0, line.text.find("//")), forbidden))
        findings.push_back(finding(file, line));
  }
  EXPECT_THAT(findings, IsEmpty());
}

/// std::regex_match() overflows the stack at long texts; has_form() refuses them.
TEST(Sources, OnlyTextsOfBoundedLengthAreMatched) {
  std::vector<std::string> findings;
  for (const SourceFile& file : cpp_files()) {
    if (file.is_test() || file.path == "core/matching.hpp") continue;
    for (const Line& line : file.lines)
      if (line.text.find("std::regex_match(") != std::string::npos)
        findings.push_back(finding(file, line));
  }
  EXPECT_THAT(findings, IsEmpty());
}

TEST(Sources, AreFormatted) {
  ASSERT_EQ(std::system("command -v clang-format >/dev/null"), 0) << "install clang-format";
  const auto formatted = [](const std::string& files) {
    return std::system(("clang-format --dry-run -Werror" + files + " 2>/dev/null").c_str()) == 0;
  };
  // Starting the program takes longer than reading a file: files are checked singly on failure.
  constexpr std::size_t kAtOnce = 200;
  std::vector<std::string> files, findings;
  for (const SourceFile& file : cpp_files())
    files.push_back(fmt::format(" '{}'", (source_root() / file.path).string()));
  for (std::size_t i = 0; i < files.size(); i += kAtOnce) {
    const auto begin = files.begin() + static_cast<std::ptrdiff_t>(i),
               end =
                   files.begin() + static_cast<std::ptrdiff_t>(std::min(i + kAtOnce, files.size()));
    if (formatted(fmt::format("{}", fmt::join(begin, end, "")))) continue;
    std::copy_if(begin, end, std::back_inserter(findings),
                 [&](const std::string& file) { return !formatted(file); });
  }
  EXPECT_THAT(findings, IsEmpty()) << "run clang-format -i on these";
}

}  // namespace
}  // namespace drape::test
