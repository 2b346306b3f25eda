// SPDX-License-Identifier: Apache-2.0
// Files that drape fabric writes beside an imported fabric, and words that it refuses.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <cstdlib>

#include "core/program/run_record.hpp"
#include "core/sheet.hpp"
#include "simulate/objects/cloth_files.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;

int run(const std::vector<std::string>& words) {
  std::string line = test::program("drape-simulate").string();
  for (const std::string& word : words) line += " " + word;
  return WEXITSTATUS(std::system((line + " > /dev/null 2>&1").c_str()));
}

TEST(ImportRecord, AnImportedFabricHasARecordThatNamesItsSheetAndFiles) {
  const test::TemporaryFolder folder;
  const fs::path sheet = folder.path() / "sheet.csv", out = folder.path() / "wool";
  write_durable(sheet,
                "property,unit,warp,weft\nW,g/m2,200,\nC,mm,17,16\nE5,%,0.4,0.6\nE20,%,1.1,1.7\n");
  const std::vector<std::string> words = {"fabric", "import", sheet.string(), "--format",
                                          "fast",   "--out",  out.string()};
  ASSERT_EQ(run(words), 0);
  const fs::path record = out / "fabric.run.json";
  EXPECT_TRUE(is_up_to_date(record, test::program("drape-simulate"), words));
  for (const fs::path& file : {sheet, out / "fabric.toml", out / "tensile_warp.csv"}) {
    const std::string text = read_text(file);
    write_durable(file, text + "\n");
    EXPECT_FALSE(is_up_to_date(record, test::program("drape-simulate"), words)) << file;
    write_durable(file, text);
  }
  EXPECT_EQ(run({"fabric", "show", "matsudaira-B", "--out", (folder.path() / "shown").string()}),
            0);
  EXPECT_TRUE(fs::exists(folder.path() / "shown/fabric.run.json"));

  // A name without a folder, which exists only after the run.
  const fs::path here = fs::current_path();
  fs::current_path(folder.path());
  const std::vector<std::string> named = {"fabric", "show", "matsudaira-B", "--out", "named"};
  EXPECT_EQ(run(named), 0);
  EXPECT_TRUE(is_up_to_date("named/fabric.run.json", test::program("drape-simulate"), named));
  fs::current_path(here);
}

TEST(ImportRecord, AUnitThatNothingReadsIsRefused) {
  const test::TemporaryFolder folder;
  const fs::path sheet = folder.path() / "sheet.csv", out = folder.path() / "wool";
  write_durable(sheet, "property,unit,warp,weft\nW,g/m2,200,\nC,mm,17,16\n");
  EXPECT_EQ(run({"fabric", "import", sheet.string(), "--format", "fast", "--bend-unit", "dyn.cm",
                 "--out", out.string()}),
            2);
  EXPECT_FALSE(fs::exists(out));
}

// ----
// Inputs listed in the run records of the programs: a changed file requires a new run. The object
// is next to the cloth, so that the drapes take no time.

constexpr const char* kCheap = " --spacing-mm 40 --coarsest-mm 40 --fit whole --segments 1";

class Records : public testing::Test {
 protected:
  Records() {
    const fs::path rig = test::source_root() / "rigs/paper";
    fs::copy(rig / "fabrics", folder_.path() / "fabrics", fs::copy_options::recursive);
    fs::copy(rig / "print.toml", folder_.path() / "print.toml");
    write_durable(folder_.path() / "tent.obj",
                  "v -60 -60 0\nv 60 -60 0\nv 0 80 0\nv 0 0 90\n"
                  "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
    write_durable(scene(), R"(schema = "drapebench/scene/1"
name = "tent"
fabric = "fabrics/A.toml"
print = "print.toml"
table_z_mm = 0.0
friction = 0.4
[start]
mode = "flat"
centre_mm = [0.0, 0.0, 2.0]
[[object]]
kind = "mesh"
file = "tent.obj"
origin_mm = [900.0, 0.0, 0.0]
)");
  }

  /// Runs "drape-simulate branches ..."; returns exit code and output.
  [[nodiscard]] std::pair<int, std::string> run(const std::string& line) const {
    const fs::path said = out("said");
    const std::size_t name = line.find(' ');
    const int ended = std::system((test::program(line.substr(0, name)).string() +
                                   line.substr(name) + " > " + said.string() + " 2>&1")
                                      .c_str());
    return {WIFEXITED(ended) ? WEXITSTATUS(ended) : -1, read_text(said)};
  }
  /// Drapes the scene into a folder and expects exit code 0.
  void drape(const std::string& folder, const std::string& more = {}) const {
    const auto [code, said] = run(fmt::format("drape-simulate {}{}{} --out {}", scene().string(),
                                              kCheap, more, out(folder).string()));
    ASSERT_EQ(code, 0) << said;
  }

  [[nodiscard]] fs::path scene() const { return folder_.path() / "tent.toml"; }
  [[nodiscard]] fs::path out(const std::string& name) const { return folder_.path() / name; }

  /// Runs drape-simulate; its record must become outdated if any file of the scene changes.
  void expect_all_named(const std::vector<std::string>& arguments, const fs::path& record) {
    const fs::path program = test::program("drape-simulate");
    std::string line = program.string();
    for (const std::string& word : arguments) line += " " + word;
    const int ended = std::system((line + " > /dev/null 2>&1").c_str());
    ASSERT_TRUE(WIFEXITED(ended) && WEXITSTATUS(ended) <= 1) << line;
    ASSERT_TRUE(is_up_to_date(record, program, arguments)) << line;
    const Scene read = read_scene(scene());
    for (const fs::path& file : files_of(read, read_fabric(read.fabric_file))) {
      const std::string text = read_text(file);
      write_durable(file, text + "\nchanged = 1\n");
      EXPECT_FALSE(is_up_to_date(record, program, arguments)) << line << " misses " << file;
      write_durable(file, text);
    }
  }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(Records, ASimulationOverItsOwnStartIsRefusedAndNothingIsLost) {
  drape("drape");
  const std::string sheet = read_text(out("drape/sheet.ply")),
                    record = read_text(out("drape/sheet.run.json"));
  EXPECT_EQ(run(fmt::format("drape-simulate {0}{1} --out {2} --start-from {2}/sheet.ply",
                            scene().string(), kCheap, out("drape").string()))
                .first,
            2);
  EXPECT_EQ(read_text(out("drape/sheet.ply")), sheet);
  EXPECT_EQ(read_text(out("drape/sheet.run.json")), record);
}

TEST_F(Records, BranchesNeverReplaceTheSheetThatTheyStartFrom) {
  const std::string starts = fmt::format("drape-simulate branches {}{} --starts 1 --out {} ",
                                         scene().string(), kCheap, out("starts").string());
  const auto from = [&](const fs::path& sheet) {
    return run(starts + "--start-from " + sheet.string()).first;
  };
  const fs::path own = out("starts/branch-01/sheet.ply"), first = out("drape/sheet.ply");
  drape("drape");
  ASSERT_EQ(from(first), 0);
  const std::string sheet = read_text(own), record = read_text(out("starts/branches.run.json"));
  fs::create_directory_symlink(out("starts"), out("link"));
  for (const fs::path& start : {own, out("link/branch-01/sheet.ply")}) {
    EXPECT_EQ(from(start), 2);
    EXPECT_EQ(read_text(own), sheet);
    EXPECT_EQ(read_text(out("starts/branches.run.json")), record);
  }
  EXPECT_EQ(from(first), 0);
}

TEST_F(Records, BranchesOfAnEarlierRunDoNotStayBesideTheNewList) {
  const std::string starts = fmt::format("drape-simulate branches {}{} --starts 1 --out {}",
                                         scene().string(), kCheap, out("m").string());
  ASSERT_EQ(run(starts).first, 0);
  // As left by a run that found two branches, and by other people.
  auto list = read_record<BranchList>(out("m/branches.json"));
  list.branches.push_back(list.branches.front());
  list.branches.back().number = 2;
  list.branches.back().sheet = "branch-02/sheet.ply";
  write_record(out("m/branches.json"), list);
  for (const char* folder : {"m/branch-02", "m/branch-03", "m/branch-two"})
    fs::copy(out("m/branch-01"), out(folder));
  write_durable(out("m/branch-02/note.txt"), "of a person");
  const auto [code, said] = run(starts);
  ASSERT_EQ(code, 0) << said;
  EXPECT_TRUE(fs::exists(out("m/branch-01/sheet.ply")));
  for (const char* name : {"sheet.ply", "sheet.json"})
    EXPECT_FALSE(fs::exists(out("m/branch-02") / name)) << name;
  for (const char* file : {"branch-02/note.txt", "branch-03/sheet.ply", "branch-two/sheet.ply"})
    EXPECT_TRUE(fs::exists(out("m") / file)) << file;
}

TEST_F(Records, NoProgramWritesOverAFileThatItReads) {
  const fs::path curve = out("fabrics/A/bending_warp.csv"), fabric = out("fabrics/A.toml");
  fs::copy(out("fabrics"), out("curves"), fs::copy_options::recursive);
  const std::string text = read_text(out("curves/A.toml")), named = "A/bending_warp.csv";
  ASSERT_NE(text.find(named), std::string::npos);
  const auto with_curve = [&](const std::string& name) {
    fs::copy(curve, out("curves/") / name, fs::copy_options::overwrite_existing);
    write_durable(out("curves/A.toml"), std::string(text).replace(text.find(named), 18, name));
  };
  const auto expect_kept = [&](const std::string& line, const fs::path& read) {
    const std::string before = read_text(read);
    const auto [code, said] = run(line);
    EXPECT_EQ(code, 2) << line << said;
    EXPECT_EQ(read_text(read), before) << line;
  };
  for (const fs::path& read : {fabric, curve})
    expect_kept("drape-simulate fabric " + fabric.string() + " --plot " + read.string(), read);
  const std::string with =
      fmt::format(" {} --fabric {}{} --out {}", scene().string(), out("curves/A.toml").string(),
                  kCheap, out("curves").string());
  for (const char* name : {"sheet.json", "levels.json", "contact_forces.csv"}) {
    with_curve(name);
    expect_kept("drape-simulate" + with, out("curves") / name);
  }
  drape("drape");
  with_curve("sensitivity.json");
  expect_kept(
      "drape-simulate sensitivity" + with + " --reference " + out("drape/sheet.ply").string(),
      out("curves/sensitivity.json"));
  with_curve("start-07.ply");
  expect_kept(fmt::format("drape-simulate cusick {} --spacing-mm 30 --max-steps 1 --out {}",
                          out("curves/A.toml").string(), out("curves").string()),
              out("curves/start-07.ply"));
}

TEST_F(Records, WhatIsPlacedByASheetThatIsNoGoIsNoGo) {
  drape("drape");
  const std::string scene_file = scene().string(), sheet_file = out("drape/sheet.ply").string();
  Sheet sheet = read_sheet(sheet_file);
  sheet.no_go = "cam1 moved";
  write_sheet(sheet_file, sheet);
  for (const std::string& line :
       {fmt::format("drape-simulate {}{} --start-from {} --out {}", scene_file, kCheap, sheet_file,
                    out("again").string()),
        fmt::format("drape-simulate branches {}{} --starts 1 --start-from {} --out {}", scene_file,
                    kCheap, sheet_file, out("starts").string()),
        fmt::format("drape-simulate sensitivity {}{} --reference {} --out {}", scene_file, kCheap,
                    sheet_file, out("split").string()),
        fmt::format("drape-simulate certify {} --scene {}", out("drape").string(), scene_file)}) {
    const auto [code, said] = run(line);
    EXPECT_EQ(code, 1) << line << said;
    EXPECT_NE(said.find("NO-GO: placed by a measured sheet that is NO-GO: cam1 moved"),
              std::string::npos)
        << line << said;
  }
  EXPECT_EQ(read_sheet(out("starts/branch-01/sheet.ply")).no_go, "cam1 moved");
  EXPECT_NE(read_text(out("split/sensitivity.json")).find("\"no_go\": \"cam1 moved\""),
            std::string::npos);
}

TEST_F(Records, EveryProgramWarnsOfARareFabricAndRefusesFrictionThatNoClothHas) {
  const fs::path fabric = out("fabrics/A.toml");
  const std::string text = read_text(fabric), density = "areal_density_g_per_m2 = ";
  const std::size_t at = text.find(density) + density.size();
  write_durable(fabric, text.substr(0, at) + "1380.0" + text.substr(text.find('\n', at)));
  fs::create_directories(out("rig/scenes"));
  std::string placed = read_text(scene());
  for (const char* name : {"fabrics/A.toml", "print.toml", "tent.obj"})
    placed.insert(placed.find(name), "../../");
  write_durable(out("rig/scenes/tent.toml"), placed);
  write_durable(out("plan.toml"),
                "schema = \"drapebench/plan/1\"\nscenes = "
                "[\"tent.toml\"]\nspacings_mm = [40]\nsegments = [1]\n");
  drape("drape");
  const std::string scene_file = scene().string();
  const std::string sensitivity =
      fmt::format("drape-simulate sensitivity {}{} --reference {}/sheet.ply --out {}", scene_file,
                  kCheap, out("drape").string(), out("split").string());
  for (const std::string& line :
       {fmt::format("drape-simulate branches {}{} --starts 1 --out {}", scene_file, kCheap,
                    out("starts").string()),
        sensitivity,
        fmt::format("drape-simulate cusick {} --spacing-mm 30 --max-steps 1 --starts 1 --out {}",
                    fabric.string(), out("cusick").string()),
        fmt::format("drape-simulate study {} --spacings-mm 40 --segments 1 --out {}",
                    out("rig").string(), out("study").string()),
        fmt::format("drape-simulate study {} --out {}", out("plan.toml").string(),
                    out("parts").string())}) {
    const auto [code, said] = run(line);
    EXPECT_LE(code, 1) << line << said;
    EXPECT_NE(said.find("an areal density of 1380 g/m2"), std::string::npos) << line << said;
  }
  std::string steep = read_text(scene());
  steep.replace(steep.find("friction = 0.4"), 14, "friction = 22.0");
  write_durable(scene(), steep);
  const auto [code, said] = run(sensitivity);
  EXPECT_EQ(code, 3) << said;
  EXPECT_NE(said.find("a friction coefficient of 22"), std::string::npos) << said;
}

TEST_F(Records, AStudyRefusesWordsThatItDoesNotUse) {
  write_durable(out("plan.toml"),
                "schema = \"drapebench/plan/1\"\nscenes = "
                "[\"tent.toml\"]\nspacings_mm = [40]\nsegments = [1]\n");
  const std::string plan = out("plan.toml").string(), to = " --out " + out("study").string();
  for (const auto& [words, named] :
       {std::pair<std::string, const char*>("status " + plan + " --part 1/2" + to, "--part"),
        std::pair<std::string, const char*>(plan + " --segments 5" + to,
                                            "--segments cannot change a plan"),
        std::pair<std::string, const char*>(plan + " --models paper" + to, "model = \"paper\""),
        std::pair<std::string, const char*>("status a.toml b.toml --out c",
                                            "`status` takes no RIG (b.toml)"),
        std::pair<std::string, const char*>("--grids 6 status a.toml --out c", "--grids")}) {
    const auto [code, said] = run("drape-simulate study " + words);
    EXPECT_EQ(code, 2) << words << said;
    EXPECT_NE(said.find(named), std::string::npos) << words << said;
  }
}

TEST_F(Records, NameEveryFileThatADrapeIsMadeOf) {
  const auto words = [&](std::vector<std::string> begin, const char* folder) {
    for (const char* word :
         {"--spacing-mm", "40", "--coarsest-mm", "40", "--fit", "whole", "--segments", "1"})
      begin.emplace_back(word);
    begin.emplace_back("--out");
    begin.push_back(out(folder).string());
    return begin;
  };
  const std::string scene_file = scene().string(), drape = out("drape").string();
  expect_all_named(words({scene_file}, "drape"), out("drape/sheet.run.json"));
  expect_all_named({"certify", drape, "--scene", scene_file}, out("drape/certify.run.json"));
  expect_all_named(words({"branches", scene_file, "--starts", "1"}, "starts"),
                   out("starts/branches.run.json"));
  expect_all_named(words({"sensitivity", scene_file, "--reference", drape + "/sheet.ply"}, "split"),
                   out("split/sensitivity.run.json"));
}

TEST_F(Records, ACusickFolderHoldsTheDrapesOfItsListAlone) {
  const auto drape = [&](const std::string& starts) {
    const auto [code, said] =
        run("drape-simulate cusick " + out("fabrics/A.toml").string() +
            " --spacing-mm 30 --max-steps 1 --starts " + starts + " --out " + out("m").string());
    EXPECT_EQ(code, 1) << said;
  };
  drape("3");
  EXPECT_TRUE(fs::exists(out("m/start-02.ply")));
  write_durable(out("m/start-note.ply"), "of a person");
  drape("1");
  EXPECT_TRUE(fs::exists(out("m/start-00.ply")));
  EXPECT_FALSE(fs::exists(out("m/start-01.ply")));
  EXPECT_FALSE(fs::exists(out("m/start-02.ply")));
  EXPECT_TRUE(fs::exists(out("m/start-note.ply")));
}

}  // namespace
}  // namespace drape::simulate
