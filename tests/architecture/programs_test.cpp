// SPDX-License-Identifier: Apache-2.0
// Properties of every program: help, version, and exit code 2 for a usage error.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <cstdio>
#include <cstdlib>
#include <regex>
#include <sstream>

#include "core/files/files.hpp"
#include "core/program/run_record.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

using testing::HasSubstr;

struct Outcome {
  int exit_code = -1;
  std::string output;  ///< both streams
};

Outcome run(const std::string& name, const std::string& arguments) {
  const std::string command =
      fmt::format("'{}' {} 2>&1 </dev/null", program(name).string(), arguments);
  Outcome result;
  FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return result;
  char buffer[4096];
  while (const std::size_t got = std::fread(buffer, 1, sizeof buffer, pipe)) {
    result.output.append(buffer, got);
  }
  const int status = ::pclose(pipe);
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  return result;
}

std::vector<std::string> programs() {
  std::istringstream names(DRAPE_PROGRAMS);
  std::vector<std::string> result;
  for (std::string name; names >> name;) result.push_back(name);
  return result;
}

TEST(Programs, HelpIsAnAnswer) {
  ASSERT_FALSE(programs().empty());
  for (const std::string& name : programs()) {
    // The front door itself only lists commands; each command lists its own options.
    const std::string arguments = name == "drape" ? "run --help" : "--help";
    EXPECT_EQ(run(name, "--help").exit_code, 0) << name;
    const Outcome help = run(name, arguments);
    EXPECT_EQ(help.exit_code, 0) << name << " " << arguments << ": " << help.output;
    EXPECT_THAT(help.output, HasSubstr("Usage")) << name;
    EXPECT_THAT(help.output, HasSubstr("--json")) << name;
    EXPECT_THAT(help.output, HasSubstr("--quiet")) << name;
  }
}

TEST(Programs, VersionIsAnAnswer) {
  for (const std::string& name : programs()) {
    const Outcome answer = run(name, "--version");
    EXPECT_EQ(answer.exit_code, 0) << name << " --version: " << answer.output;
    EXPECT_THAT(answer.output, HasSubstr(version())) << name;
  }
}

TEST(Programs, AWrongOptionIsAUsageError) {
  for (const std::string& name : programs()) {
    const Outcome wrong = run(name, "--no-such-option");
    EXPECT_EQ(wrong.exit_code, 2) << name << " --no-such-option: " << wrong.output;
    EXPECT_FALSE(wrong.output.empty()) << name << " says nothing";
  }
}

TEST(Programs, AnAnswerThatCannotBePrintedIsAnError) {
  const std::string fabric =
      fmt::format("fabric '{}'", (source_root() / "rigs/paper/fabrics/A.toml").string());
  std::vector<std::pair<std::string, std::string>> answers = {{"drape", fabric},
                                                              {"drape-simulate", fabric}};
  for (const std::string& name : programs())
    for (const char* option : {"--help", "--version"}) answers.emplace_back(name, option);
  for (const auto& [name, arguments] : answers) {
    const int status = std::system(
        fmt::format("'{}' {} >&- 2>/dev/null", program(name).string(), arguments).c_str());
    EXPECT_EQ(WEXITSTATUS(status), 5) << name << " " << arguments;
  }
}

/// Manual pages and shell completion of all programs, in a separate folder.
class Manuals : public testing::Test {
 protected:
  void SetUp() override {
    const std::string make = fmt::format(
        "'{}' '{}' '{}' {}", (source_root() / "cmake/manuals.sh").string(), folder_.path().string(),
        program("drape").parent_path().string(), DRAPE_PROGRAMS);
    ASSERT_EQ(std::system(make.c_str()), 0);
  }
  [[nodiscard]] std::string page(const std::string& name) const {
    const auto file = folder_.path() / name;
    const std::string unpack = fmt::format("gzip -dc '{}/man1/{}.1.gz' >'{}'",
                                           folder_.path().string(), name, file.string());
    EXPECT_EQ(std::system(unpack.c_str()), 0) << name;
    return read_text(file);
  }

  TemporaryFolder folder_;
};

TEST_F(Manuals, NameEveryOption) {
  const std::regex option("--[a-z][a-z-]+"), dash("-");
  for (const std::string& name : programs()) {
    const std::string text = page(name), help = run(name, "--help").output;
    EXPECT_THAT(text, HasSubstr(".SH EXIT STATUS")) << name;
    if (name == "drape") continue;
    for (std::sregex_iterator it(help.begin(), help.end(), option), end; it != end; ++it)
      EXPECT_THAT(text, HasSubstr(std::regex_replace(it->str(), dash, "\\-"))) << name;
  }
}

TEST_F(Manuals, AreCleanForMandoc) {
  if (std::system("command -v mandoc >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "mandoc (Debian package mandoc) is not installed";
  std::vector<std::string> names = programs();
  names.insert(names.end(), {"drape-run", "drape-check", "drape-new", "drape-calib-images"});
  for (const std::string& name : names) {
    (void)page(name);
    // Status 0 means not even a warning.
    const std::string lint =
        fmt::format("mandoc -Tlint -Wwarning '{}' >&2", (folder_.path() / name).string());
    EXPECT_EQ(std::system(lint.c_str()), 0) << name;
  }
}

TEST_F(Manuals, BashCompletesCommandsOptionsAndValues) {
  const auto completed = [&](const std::string& words, int at) {
    const std::string script = fmt::format(
        "cd '{0}' && . completions/drape && COMP_WORDS=({1}) COMP_CWORD={2} && _drape drape && "
        "echo \" ${{COMPREPLY[*]}} \"",
        folder_.path().string(), words, at);
    write_durable(folder_.path() / "script", script);
    FILE* pipe =
        ::popen(fmt::format("bash '{}'", (folder_.path() / "script").string()).c_str(), "r");
    char buffer[8192] = {};
    const std::size_t got = std::fread(buffer, 1, sizeof buffer - 1, pipe);
    ::pclose(pipe);
    return std::string(buffer, got);
  };
  EXPECT_THAT(completed("drape si", 1), HasSubstr(" simulate "));
  EXPECT_THAT(completed("drape ne", 1), HasSubstr(" new "));
  EXPECT_THAT(completed("drape simulate --fi", 2), HasSubstr(" --fit "));
  EXPECT_EQ(completed("drape simulate --fit wh", 3), " whole \n");
  EXPECT_THAT(completed("drape results li", 2), HasSubstr(" list "));
  EXPECT_THAT(completed("drape results list --sc", 3), HasSubstr(" --scene "));
  EXPECT_THAT(completed("drape run comp", 2), HasSubstr(" completions "));
  EXPECT_EQ(completed("drape simulate --no-such", 2), "  \n");
}

}  // namespace
}  // namespace drape::test
