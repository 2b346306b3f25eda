// SPDX-License-Identifier: Apache-2.0
// What a person can rely on with every program: help, version, and exit code 2 for a wrong call.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <cstdio>
#include <sstream>

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
    // The front door itself only lists commands; what they take is told by each of them.
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
    const Outcome version = run(name, "--version");
    EXPECT_EQ(version.exit_code, 0) << name << " --version: " << version.output;
    EXPECT_THAT(version.output, HasSubstr("0.1.0")) << name;
  }
}

TEST(Programs, AWrongOptionIsAUsageError) {
  for (const std::string& name : programs()) {
    const Outcome wrong = run(name, "--no-such-option");
    EXPECT_EQ(wrong.exit_code, 2) << name << " --no-such-option: " << wrong.output;
    EXPECT_FALSE(wrong.output.empty()) << name << " says nothing";
  }
}

}  // namespace
}  // namespace drape::test
