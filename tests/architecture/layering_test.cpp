// SPDX-License-Identifier: Apache-2.0
// Allowed dependencies: stages depend on core and third parties, core on no device, image or
// database library, and public headers use Eigen and core.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "tests/architecture/source_files.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

using testing::IsEmpty;

std::vector<std::string> other_stages(const std::string& stage) {
  std::vector<std::string> others(stages.begin(), stages.end());
  std::erase(others, stage);
  return others;
}

TEST(Layering, AStageNeverIncludesAnotherStage) {
  std::vector<std::string> findings;
  for (const SourceFile& file : cpp_files()) {
    if (file.folder() == "tests") continue;  // tests may depend on everything
    for (const Line& line : file.lines) {
      for (const std::string& other : other_stages(file.folder())) {
        if (included(line.text).starts_with(other + "/")) findings.push_back(finding(file, line));
      }
    }
  }
  EXPECT_THAT(findings, IsEmpty());
}

TEST(Layering, AStageNeverLinksAnotherStage) {
  std::vector<std::string> findings;
  for (const char* stage : stages) {
    for (const SourceFile& file : source_files(stage, {"CMakeLists.txt"})) {
      for (const Line& line : file.lines) {
        for (const std::string& other : other_stages(stage)) {
          if (line.text.find("drapebench::" + other) != std::string::npos ||
              line.text.find("drape_" + other) != std::string::npos) {
            findings.push_back(finding(file, line));
          }
        }
      }
    }
  }
  EXPECT_THAT(findings, IsEmpty());
}

// The checker shares with the solvers only the readers of scene and fabric, the curves, and the
// shape and contact forces to be judged.
TEST(Layering, TheCheckerLinksNoSolver) {
  const SourceFile lists = read_source("simulate/checker/CMakeLists.txt");
  std::vector<std::string> linked;
  for (const Line& line : lists.lines) {
    std::istringstream words(line.text);
    for (std::string word; words >> word;) {
      if (word.starts_with("drapebench::")) linked.push_back(word);
    }
  }
  EXPECT_THAT(linked,
              testing::ElementsAre("drapebench::simulate_fabric", "drapebench::simulate_objects"));
  const std::set<std::string> allowed = {"simulate/objects/cloth_files.hpp",
                                         "simulate/objects/surroundings.hpp"};
  std::vector<std::string> findings;
  for (const SourceFile& file : cpp_files()) {
    if (!file.path.starts_with("simulate/checker/") || file.is_test()) continue;
    for (const Line& line : file.lines) {
      const std::string name = included(line.text);
      if (name.starts_with("simulate/") && !name.starts_with("simulate/checker/") &&
          !name.starts_with("simulate/fabric/") && !allowed.contains(name)) {
        findings.push_back(finding(file, line));
      }
    }
  }
  EXPECT_THAT(findings, IsEmpty());
}

TEST(Layering, CoreKnowsNoCameraImageOrDatabaseLibrary) {
  const std::vector<std::string> foreign = {"opencv",  "arv",        "linux/videodev2", "libv4l",
                                            "sqlite3", "SQLiteCpp/", "apriltag",        "ceres/"};
  std::vector<std::string> findings;
  for (const SourceFile& file : cpp_files()) {
    // core/prints and core/pictures are libraries of their own, linked only where tags are printed
    // or read, and pictures decoded.
    if (file.folder() != "core" || file.path.starts_with("core/prints/") ||
        file.path.starts_with("core/pictures/"))
      continue;
    for (const Line& line : file.lines) {
      const std::string name = included(line.text);
      if (std::any_of(foreign.begin(), foreign.end(),
                      [&](const std::string& prefix) { return name.starts_with(prefix); })) {
        findings.push_back(finding(file, line));
      }
    }
  }
  EXPECT_THAT(findings, IsEmpty());
}

bool is_standard(const std::string& name) {
  return name.find('/') == std::string::npos && name.find('.') == std::string::npos;
}

/// Follows a public header into the headers of its own stage, which are then public too.
void follow(const std::string& stage, const std::string& path, std::set<std::string>& seen,
            std::vector<std::string>& findings) {
  if (!seen.insert(path).second) return;
  const SourceFile file = read_source(path);
  for (const Line& line : file.lines) {
    const std::string name = included(line.text);
    if (name.empty() || is_standard(name) || name.starts_with("Eigen/") ||
        name.starts_with("core/")) {
      continue;
    }
    if (name.starts_with(stage + "/")) {
      follow(stage, name, seen, findings);
    } else {
      findings.push_back(finding(file, line));
    }
  }
}

TEST(Layering, PublicHeadersSpeakEigenAndCore) {
  std::vector<std::string> findings;
  for (const std::string stage : stages) {
    std::set<std::string> seen;
    follow(stage, fmt::format("{0}/{0}.hpp", stage), seen, findings);
  }
  EXPECT_THAT(findings, IsEmpty());
}

TEST(Layering, CMakeRefusesCyclesAndVerifiesHeaders) {
  EXPECT_STREQ(DRAPE_NO_CYCLES, "ON");
  EXPECT_STREQ(DRAPE_VERIFY_HEADER_SETS, "ON");
}

TEST(Layering, EveryStageHasTheSameRooms) {
  std::vector<std::string> missing;
  for (const std::string stage : stages) {
    const std::vector<std::string> rooms = {"README.md", "CMakeLists.txt", stage + ".hpp"};
    for (const std::string& room : rooms) {
      if (!std::filesystem::exists(source_root() / stage / room)) {
        missing.push_back(fmt::format("{}/{}", stage, room));
      }
    }
    if (source_files(stage, {"/main.cpp"}).empty()) missing.push_back(stage + "/**/main.cpp");
    if (source_files(stage, {"_test.cpp"}).empty()) missing.push_back(stage + "/*_test.cpp");
  }
  EXPECT_THAT(missing, IsEmpty());
}

}  // namespace
}  // namespace drape::test
