// SPDX-License-Identifier: Apache-2.0
#include "core/program/command.hpp"

#include <gtest/gtest.h>

#include <cstdio>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/shell_word.hpp"
#include "tests/support/paths.hpp"

namespace drape {
namespace {

struct Given {
  double part = 0;
  int starts = 0;
};

/// Exit code of a program with an option that takes fractions and one that does not; -1: it goes
/// on.
int parse(std::vector<std::string> words, Given& given) {
  Command app("A program.", "program");
  app.add_option("--part-percent", given.part, "of gravity")->range(0, 100);
  app.add_option("--starts", given.starts, "random starts")->range(1, 99);
  words.insert(words.begin(), "program");
  std::vector<char*> arguments;
  arguments.reserve(words.size());
  for (std::string& word : words) arguments.push_back(word.data());
  return app.parse(static_cast<int>(arguments.size()), arguments.data());
}

TEST(Command, ARangeWithWholeLimitsTakesFractionsOfWhatIsNotCounted) {
  Given given;
  EXPECT_EQ(parse({"--part-percent", "12.5"}, given), -1);
  EXPECT_EQ(given.part, 12.5);
  EXPECT_EQ(parse({"--starts", "99"}, given), -1);
  EXPECT_EQ(given.starts, 99);
  for (const std::vector<std::string>& wrong :
       std::vector<std::vector<std::string>>{{"--part-percent", "100.5"},
                                             {"--part-percent", "-0.5"},
                                             {"--starts", "2.5"},
                                             {"--starts", "100"},
                                             {"--part-percent", "nan"},
                                             {"--part-percent", "inf"},
                                             {"--starts", "011"},  // eights, or eleven?
                                             {"--starts", "0x11"},
                                             {"--starts", "0"}})
    EXPECT_EQ(parse(wrong, given), 2) << wrong[0] << ' ' << wrong[1];
}

/// Exit code of a program with an own option and argument, and a subcommand; -1: it goes on.
int parse_with_subcommand(std::vector<std::string> words) {
  Command app("A program.", "program");
  bool json = false;
  std::string rig, set, folder;
  app.add_flag("--json", json, "shared");
  app.fallthrough();
  app.add_option("RIG", rig, "of the program alone");
  app.add_option("--set", set, "of the program alone");
  app.add_subcommand("import", "a subcommand")->add_option("FOLDER", folder, "to read");
  words.insert(words.begin(), "program");
  std::vector<char*> arguments;
  arguments.reserve(words.size());
  for (std::string& word : words) arguments.push_back(word.data());
  return app.parse(static_cast<int>(arguments.size()), arguments.data());
}

TEST(Command, WhatASubcommandDoesNotTakeIsRefused) {
  EXPECT_EQ(parse_with_subcommand({"rig", "--set", "a"}), -1);
  EXPECT_EQ(parse_with_subcommand({"import", "a", "--json"}), -1);
  EXPECT_EQ(parse_with_subcommand({"--json", "import", "a"}), -1);
  for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
           {"import", "a", "b"}, {"import", "a", "--set", "b"}, {"--set", "b", "import", "a"}}) {
    try {
      EXPECT_EQ(parse_with_subcommand(words), 2) << words[2];
      ADD_FAILURE() << words[2] << " is taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
      EXPECT_EQ(error.what_failed().rfind("`import` takes no ", 0), 0U) << error.what_failed();
    }
  }
}

TEST(ShellWord, GoesThroughAShellWhole) {
  EXPECT_EQ(shell_word("out/C-1/sheet.ply"), "out/C-1/sheet.ply");
  for (const std::string word :
       {"o p/r's.sqlite", "$HOME `id` \"x\" \\", "a;b&c|d>e(f)*?[g]#h~!", ""}) {
    const std::string command = "printf %s " + shell_word(word);
    FILE* shell = popen(command.c_str(), "r");
    ASSERT_NE(shell, nullptr);
    std::string output(100, '\0');
    output.resize(std::fread(output.data(), 1, output.size(), shell));
    EXPECT_EQ(pclose(shell), 0) << command;
    EXPECT_EQ(output, word) << command;
  }
}

TEST(Command, NeverWritesOverAFileThatItReads) {
  const test::TemporaryFolder folder;
  const std::string file = folder.path() / "a.json", other = folder.path() / "b.json";
  write_durable(file, "{}");
  const auto call = [](std::string input, std::string out) {
    Command app("A program.", "program");
    std::vector<std::filesystem::path> inputs;
    std::filesystem::path output;
    app.add_option("INPUT", inputs, "files to read");
    app.add_option("--out,-o", output, "file to write");
    std::string program = "program", option = "--out";
    char* words[] = {program.data(), input.data(), option.data(), out.data()};
    return app.parse(4, words);
  };
  EXPECT_EQ(call(file, other), -1);
  EXPECT_THROW(static_cast<void>(call(file, file)), Error);
  EXPECT_THROW(static_cast<void>(call(file, folder.path() / "." / "a.json")), Error);
  EXPECT_EQ(call(other, other), -1) << "there is nothing to lose";
}

}  // namespace
}  // namespace drape
