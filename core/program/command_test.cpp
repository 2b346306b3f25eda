// SPDX-License-Identifier: Apache-2.0
#include "core/program/program.hpp"

#include <gmock/gmock.h>

#include "core/program/words.hpp"
#include "tests/support/paths.hpp"

namespace drape {
namespace {

struct Given {
  double part = 0;
  int starts = 1;
};
void fields(Fields& f, Given& given) {
  f.otherwise({"part_percent", "part of gravity", 1, 0, 100}, given.part);
  f.otherwise({"starts", "random starts", 1, 1, 99}, given.starts);
}

/// Exit code of the command line; -1 if it continues.
int parse(Command& app, std::vector<std::string> words) {
  words.insert(words.begin(), "program");
  std::vector<char*> arguments;
  arguments.reserve(words.size());
  for (std::string& word : words) arguments.push_back(word.data());
  return app.parse(static_cast<int>(arguments.size()), arguments.data());
}

/// The same for a program with one option that takes fractions and one that does not.
int parse(const std::vector<std::string>& words, Given& given) {
  Command app("A program.", "program");
  app.add_record(given);
  return parse(app, words);
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
                                             {"--starts", "011"},  // octal or decimal?
                                             {"--starts", "0x11"},
                                             {"--starts", "0"}})
    EXPECT_THAT([&] { static_cast<void>(parse(wrong, given)); },
                testing::ThrowsMessage<Error>(testing::HasSubstr(wrong[0])))
        << wrong[1];
}

struct OwnWords {
  std::string rig, set;
};
void fields(Fields& f, OwnWords& own) {
  f.otherwise(Field{"rig", "argument of the program alone"}.called("RIG"), own.rig);
  f.otherwise({"set", "option of the program alone"}, own.set);
}
struct ImportWords {
  std::string folder;
};
void fields(Fields& f, ImportWords& words) {
  f.otherwise(Field{"folder", "folder to read"}.called("FOLDER"), words.folder);
}

/// Exit code of a program with its own option and argument, and a subcommand; -1 if it continues.
int parse_with_subcommand(const std::vector<std::string>& words) {
  Command app("A program.", "program");
  CommonOptions common;
  OwnWords own;
  ImportWords import;
  add_common_options(app, common);
  app.fallthrough();
  app.add_record(own);
  app.add_subcommand("import", "a subcommand")->add_record(import);
  return parse(app, words);
}

TEST(Command, WhatASubcommandDoesNotTakeIsRefused) {
  EXPECT_EQ(parse_with_subcommand({"--set", "a", "rig"}), -1) << "an option before the argument";
  EXPECT_EQ(parse_with_subcommand({"--threads", "1", "import", "a"}), -1);
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

struct Files {
  std::vector<std::filesystem::path> inputs;
  std::filesystem::path out;
};
void fields(Fields& f, Files& files) {
  f(Field{"input", "files to read"}.called("INPUT"), files.inputs);
  f(Field{"out", "file to write"}.called("-o"), files.out);
}

TEST(Command, NeverWritesOverAFileThatItReads) {
  const test::TemporaryFolder folder;
  const std::string file = folder.path() / "a.json", other = folder.path() / "b.json";
  write_durable(file, "{}");
  const auto call = [](const std::string& input, const std::string& out) {
    Command app("A program.", "program");
    Files files;
    app.add_record(files);
    return parse(app, {input, "--out", out});
  };
  EXPECT_EQ(call(file, other), -1);
  EXPECT_THROW(static_cast<void>(call(file, file)), Error);
  EXPECT_THROW(static_cast<void>(call(file, folder.path() / "." / "a.json")), Error);
  EXPECT_EQ(call(other, other), -1) << "there is nothing to lose";
}

TEST(Command, RefusesAnEmptyWord) {
  for (const auto& [input, out, named] :
       {std::tuple{"", "b.json", "INPUT is empty"}, std::tuple{"a.json", "", "--out is empty"}}) {
    Command app("A program.", "program");
    Files files;
    app.add_record(files);
    const std::vector<std::string> words = {input, "--out", out};
    EXPECT_THAT([&] { static_cast<void>(parse(app, words)); },
                testing::ThrowsMessage<Error>(testing::HasSubstr(named)));
  }
}

}  // namespace
}  // namespace drape
