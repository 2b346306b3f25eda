// SPDX-License-Identifier: Apache-2.0
// Identifiers and prose use the terms of the field and plain English.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <regex>

#include "tests/architecture/source_files.hpp"

namespace drape::test {
namespace {

using testing::IsEmpty;

/// Words to avoid; "to and fro" is searched for as a phrase.
constexpr std::array odd_words = {"lean", "leans", "heads", "anew"};

bool is_odd(std::string word) {
  std::transform(word.begin(), word.end(), word.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(odd_words.begin(), odd_words.end(), word) != odd_words.end();
}

/// The first odd word of a text: in prose and in parts of snake_case and CamelCase alike.
std::string odd_word(const std::string& text) {
  static const std::regex part("[A-Z]?[a-z]+|[A-Z]+");
  for (std::sregex_iterator it(text.begin(), text.end(), part), end; it != end; ++it) {
    if (is_odd(it->str())) return it->str();
  }
  static const std::regex phrase(R"(\bto and fro\b)");
  return std::regex_search(text, phrase) ? "to and fro" : "";
}

/// Removes names: quoted code of Markdown, strings of C++ that are not sentences (keys, options).
std::string prose_of(const std::string& line, const std::regex& names) {
  return std::regex_replace(line, names, " ");
}

/// Lines of a Markdown text outside its fenced blocks, which quote programs.
std::vector<Line> outside_fences(const SourceFile& file) {
  std::vector<Line> lines;
  bool inside = false;
  for (const Line& line : file.lines) {
    const std::size_t start = line.text.find_first_not_of(' ');
    const bool fence = start != std::string::npos && line.text.compare(start, 3, "```") == 0;
    if (!inside && !fence) lines.push_back(line);
    if (fence) inside = !inside;
  }
  return lines;
}

TEST(Words, FindsOddWordsInProseAndIdentifiers) {
  EXPECT_EQ(odd_word("it is read anew"), "anew");
  EXPECT_EQ(odd_word("double step_heads = 1;"), "heads");
  EXPECT_EQ(odd_word("kLeastLean"), "Lean");
  EXPECT_EQ(odd_word("it goes to and fro"), "to and fro");
  EXPECT_EQ(odd_word("always cleaned boolean headers, to and from"), "");
}

TEST(Words, MarkdownHasNone) {
  static const std::regex code("`[^`]*`");
  std::vector<std::string> findings;
  const std::vector<SourceFile> files = markdown_files();
  EXPECT_GT(files.size(), 15U);
  for (const SourceFile& file : files) {
    for (const Line& line : outside_fences(file)) {
      const std::string word = odd_word(prose_of(line.text, code));
      if (!word.empty()) findings.push_back(fmt::format("{} ({})", finding(file, line), word));
    }
  }
  EXPECT_THAT(findings, IsEmpty());
}

TEST(Words, CodeAndCommentsHaveNone) {
  static const std::regex key(R"re("[^" ]*")re");
  std::vector<std::string> findings;
  for (const SourceFile& file : cpp_files()) {
    if (file.path == "tests/architecture/words_test.cpp") continue;  // this file lists them
    for (const Line& line : file.lines) {
      const std::string word = odd_word(prose_of(line.text, key));
      if (!word.empty()) findings.push_back(fmt::format("{} ({})", finding(file, line), word));
    }
  }
  EXPECT_THAT(findings, IsEmpty());
}

/// A comment begins with a verb (functions) or a named noun (types, fields, constants).
TEST(Words, CommentsBeginWithAVerbOrANamedNoun) {
  static const std::regex comment(R"(^\s*///?<?\s+(.*))");
  static const std::regex trailing(R"([;,{)]\s*///?<?\s+(.*))");
  static const std::regex headless(R"(^(of |what |so (many|much|far)\b|whether |how |as long as ))",
                                   std::regex::icase);
  std::vector<std::string> findings;
  std::size_t blocks = 0;
  for (const SourceFile& file : cpp_files()) {
    bool inside = false;
    for (const Line& line : file.lines) {
      std::smatch found;
      const bool whole = std::regex_search(line.text, found, comment);
      const bool begins = whole ? !inside : std::regex_search(line.text, found, trailing);
      inside = whole;
      if (!begins) continue;
      ++blocks;
      if (std::regex_search(found[1].first, found[1].second, headless))
        findings.push_back(finding(file, line));
    }
  }
  EXPECT_GT(blocks, 5000U);
  EXPECT_LT(100 * findings.size(), blocks) << fmt::format("{}", fmt::join(findings, "\n"));
}

}  // namespace
}  // namespace drape::test
