// SPDX-License-Identifier: Apache-2.0
// Inputs that the run records of the programs name: a changed file makes the next run a new one.
// The mesh stands beside the cloth, so that the drapes take no time.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <utility>

#include "core/files/files.hpp"
#include "core/program/run_record.hpp"
#include "core/sheet.hpp"
#include "simulate/objects/scene_files.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;

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

  [[nodiscard]] fs::path scene() const { return folder_.path() / "tent.toml"; }
  [[nodiscard]] fs::path out(const std::string& name) const { return folder_.path() / name; }

  /// Runs drape-simulate; its record must become old with every file of the scene.
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
  const std::string line = test::program("drape-simulate").string() + " " + scene().string() +
                           " --grid 6 --solver static --out " + out("drape").string();
  ASSERT_EQ(WEXITSTATUS(std::system((line + " > /dev/null 2>&1").c_str())) & ~1, 0);
  const std::string sheet = read_text(out("drape/sheet.ply")),
                    record = read_text(out("drape/sheet.run.json"));
  const int ended = std::system(
      (line + " --start-from " + out("drape/sheet.ply").string() + " > /dev/null 2>&1").c_str());
  EXPECT_EQ(WEXITSTATUS(ended), 2);
  EXPECT_EQ(read_text(out("drape/sheet.ply")), sheet);
  EXPECT_EQ(read_text(out("drape/sheet.run.json")), record);
}

TEST_F(Records, BranchesAndFinerGridsNeverReplaceTheSheetThatTheyStartFrom) {
  const auto run = [&](const std::string& name, const std::string& arguments) {
    return WEXITSTATUS(std::system(
        (test::program(name).string() + " " + arguments + " > /dev/null 2>&1").c_str()));
  };
  const std::string starts = scene().string() +
                             " --grid 6 --starts 1 --kicks 0 --fit whole --out " +
                             out("starts").string() + " --start-from ";
  const fs::path own = out("starts/branch-01/sheet.ply"), first = out("drape/sheet.ply");
  ASSERT_EQ(run("drape-simulate",
                scene().string() + " --grid 6 --solver static --out " + out("drape").string()),
            0);
  ASSERT_EQ(run("drape-simulate branches", starts + first.string()), 0);
  const std::string sheet = read_text(own), record = read_text(out("starts/branches.run.json"));
  fs::create_directory_symlink(out("starts"), out("link"));
  for (const fs::path& start : {own, out("link/branch-01/sheet.ply")}) {
    EXPECT_EQ(run("drape-simulate branches", starts + start.string()), 2);
    EXPECT_EQ(read_text(own), sheet);
    EXPECT_EQ(read_text(out("starts/branches.run.json")), record);
  }
  EXPECT_EQ(run("drape-simulate branches", starts + first.string()), 0);

  fs::rename(out("drape"), out("8x8"));  // the grid after 6x6, of which 8x8/ now holds a sheet
  const std::string coarse = read_text(out("8x8/sheet.ply"));
  EXPECT_EQ(run("drape-simulate refine", out("8x8").string() + " --scene " + scene().string() +
                                             " --finest 8 --out " + out(".").string()),
            2);
  EXPECT_EQ(read_text(out("8x8/sheet.ply")), coarse);
}

TEST_F(Records, BranchesAndFinerGridsOfAnEarlierRunDoNotStayBesideTheNewList) {
  const auto run = [&](const std::string& name, const std::string& arguments) {
    return WEXITSTATUS(std::system(
        (test::program(name).string() + " " + arguments + " > /dev/null 2>&1").c_str()));
  };
  const std::string starts =
      scene().string() + " --grid 6 --starts 1 --kicks 0 --fit whole --out " + out("m").string();
  ASSERT_EQ(run("drape-simulate branches", starts), 0);
  // As a run that found two left them, and what other people put there.
  std::string list = read_text(out("m/branches.json"));
  const std::size_t first = list.find("\"branches\": [") + 13, end = list.find("\"members_at_rest");
  std::string one = list.substr(first, list.rfind(']', end) - first);
  one.replace(one.find("branch-01"), 9, "branch-02");
  list.insert(first, one + ",");
  write_durable(out("m/branches.json"), list);
  for (const char* folder : {"m/branch-02", "m/branch-03", "m/branch-two"})
    fs::copy(out("m/branch-01"), out(folder));
  write_durable(out("m/branch-02/note.txt"), "of a person");
  ASSERT_EQ(run("drape-simulate branches", starts), 0);
  EXPECT_TRUE(fs::exists(out("m/branch-01/sheet.ply")));
  for (const char* name : {"sheet.ply", "sheet.json"})
    EXPECT_FALSE(fs::exists(out("m/branch-02") / name)) << name;
  for (const char* file : {"branch-02/note.txt", "branch-03/sheet.ply", "branch-two/sheet.ply"})
    EXPECT_TRUE(fs::exists(out("m") / file)) << file;

  const std::string drape = out("drape").string();
  ASSERT_EQ(run("drape-simulate", scene().string() + " --grid 6 --solver static --out " + drape),
            0);
  const std::string refine = drape + " --scene " + scene().string() + " --goal-mm 1e-9 --out " +
                             out("f").string() + " --finest ";
  ASSERT_EQ(run("drape-simulate refine", refine + "11"), 0);
  ASSERT_TRUE(fs::exists(out("f/11x11/sheet.ply")));
  fs::copy(drape, out("f/6x6"));
  EXPECT_EQ(run("drape-simulate refine", out("f/11x11").string() + " --scene " + scene().string() +
                                             " --finest 16 --out " + out("f").string()),
            2);
  ASSERT_EQ(run("drape-simulate refine", refine + "9"), 0);
  EXPECT_TRUE(fs::exists(out("f/8x8/sheet.ply")));
  EXPECT_FALSE(fs::exists(out("f/11x11")));
  EXPECT_TRUE(fs::exists(out("f/6x6/sheet.ply")));
}

TEST_F(Records, ARestOfAnotherPrintOrStartIsNotRefined) {
  const auto run = [&](const std::string& name, const std::string& arguments) {
    const int ended = std::system(
        (test::program(name).string() + " " + arguments + " > " + out("said").string() + " 2>&1")
            .c_str());
    return std::pair(WEXITSTATUS(ended), read_text(out("said")));
  };
  const std::string drape = out("drape").string(), flat = out("flat").string(),
                    simulate = scene().string() + " --solver static --out ",
                    refine = drape + " --scene " + scene().string() + " --finest 9 --out " +
                             out("fine").string();
  ASSERT_EQ(run("drape-simulate", simulate + flat + " --grid 11").first, 0);
  std::string held = read_text(scene());
  for (const char* pin : {"col = 1\nat_mm = [-80.0, 100.0, 0.0]", "col = 9"})
    held += fmt::format("[[pin]]\nrow = 0\n{}\n", pin);
  write_durable(scene(), held);
  const std::string start = " --start-from " + flat + "/sheet.ply", coarse = " --grid 6";
  ASSERT_EQ(run("drape-simulate", simulate + drape + start + coarse).first, 0)
      << read_text(out("said"));
  ASSERT_EQ(run("drape-simulate refine", refine + start).first, 0) << read_text(out("said"));

  const std::string sheet = read_text(flat + "/sheet.json");
  Sheet moved = read_sheet(flat + "/sheet.ply");
  for (SheetMark& mark : moved.marks) mark.point_in_world.x() += 6e-3;
  write_sheet(flat + "/sheet.ply", moved);
  const auto other_start = run("drape-simulate refine", refine + start);
  EXPECT_EQ(other_start.first, 3) << other_start.second;
  EXPECT_NE(other_start.second.find("placed by another start"), std::string::npos)
      << other_start.second;

  // The start as it was, and marks 2 mm nearer to each other: the pins hold other points.
  for (SheetMark& mark : moved.marks) mark.point_in_world.x() -= 6e-3;
  write_sheet(flat + "/sheet.ply", moved);
  ASSERT_EQ(run("drape-simulate", simulate + drape + start + coarse).first, 0)
      << read_text(out("said"));
  std::string print = read_text(out("print.toml"));
  print.replace(print.find("pitch_mm = 20.0"), 15, "pitch_mm = 18.0");
  write_durable(out("print.toml"), print);
  const auto other_print = run("drape-simulate refine", refine + start);
  EXPECT_EQ(other_print.first, 3) << other_print.second;
  EXPECT_NE(other_print.second.find("mm from its place"), std::string::npos) << other_print.second;
}

TEST_F(Records, NoProgramWritesOverAFileThatItReads) {
  const fs::path curve = out("fabrics/A/bending_warp.csv"), fabric = out("fabrics/A.toml");
  ASSERT_TRUE(fs::exists(curve));
  fs::rename(scene(), out("piece.toml"));
  fs::copy(out("piece.toml"), scene());
  fs::copy(out("fabrics"), out("curves"), fs::copy_options::recursive);
  std::string text = read_text(out("curves/A.toml"));
  const std::string named = "A/bending_warp.csv";
  ASSERT_NE(text.find(named), std::string::npos);
  const auto with_curve = [&](const std::string& name) {
    fs::copy(curve, out("curves/") / name, fs::copy_options::overwrite_existing);
    write_durable(out("curves/A.toml"), std::string(text).replace(text.find(named), 18, name));
  };
  const auto expect_kept = [&](const std::string& name, const std::string& words,
                               const fs::path& read) {
    const std::string before = read_text(read);
    const int ended = std::system(
        (test::program(name).string() + " " + words + " > " + out("said").string() + " 2>&1")
            .c_str());
    EXPECT_EQ(WEXITSTATUS(ended), 2) << name << " " << words << read_text(out("said"));
    EXPECT_EQ(read_text(read), before) << name;
  };
  for (const fs::path& read : {fabric, curve})
    expect_kept("drape-simulate fabric", fabric.string() + " --plot " + read.string(), read);
  expect_kept("drape-simulate piece",
              out("piece.toml").string() + " --spacing-mm 50 --out " + out("").string(),
              out("piece.toml"));
  const std::string with = scene().string() + " --fabric " + out("curves/A.toml").string() +
                           " --out " + out("curves").string();
  for (const char* name : {"sheet.json", "history.csv", "contact_forces.csv"}) {
    with_curve(name);
    expect_kept("drape-simulate", with + " --grid 6 --solver static", out("curves") / name);
  }
  with_curve("error_split.csv");
  write_durable(out("curves/sensitivity.json"), "{}");
  for (const std::string& other : {out("x.ply").string(), out("curves/sensitivity.ply").string()})
    expect_kept("drape-simulate sensitivity", with + " --grid 6 --reference " + other,
                out("curves/error_split.csv"));
  with_curve("start-07.ply");
  expect_kept("drape-simulate cusick",
              out("curves/A.toml").string() + " --spacing-mm 30 --max-steps 1 --out " +
                  out("curves").string(),
              out("curves/start-07.ply"));
}

TEST_F(Records, WhatIsPlacedByASheetThatIsNoGoIsNoGo) {
  const auto run = [&](const std::string& name, const std::string& arguments) {
    const fs::path text = out("text");
    const int ended = std::system(
        (test::program(name).string() + " " + arguments + " > " + text.string() + " 2>&1").c_str());
    return std::pair(WEXITSTATUS(ended), read_text(text));
  };
  const std::string scene_file = scene().string(), sheet_file = out("drape/sheet.ply").string();
  ASSERT_EQ(
      run("drape-simulate", scene_file + " --grid 6 --solver static --out " + out("drape").string())
              .first &
          ~1,
      0);
  Sheet sheet = read_sheet(sheet_file);
  sheet.no_go = "cam1 moved";
  write_sheet(sheet_file, sheet);
  const std::string start = " --start-from " + sheet_file + " --out ";
  for (const auto& [code, text] :
       {run("drape-simulate branches",
            fmt::format("{} --grid 6 --starts 1 --kicks 0 --fit whole{}{}", scene_file, start,
                        out("starts").string())),
        run("drape-simulate sensitivity",
            fmt::format("{} --grid 6 --only-first-order --reference {} --out {}", scene_file,
                        sheet_file, out("split").string())),
        run("drape-simulate refine", out("drape").string() + " --scene " + scene_file +
                                         " --finest 11 --out " + out("fine").string()),
        run("drape-simulate piece",
            fmt::format("{} --spacing-mm 50{}{}", scene_file, start, out("piece").string())),
        run("drape-simulate certify", out("drape").string() + " --scene " + scene_file)}) {
    EXPECT_EQ(code, 1) << text;
    EXPECT_NE(text.find("NO-GO: placed by a measured sheet that is NO-GO: cam1 moved"),
              std::string::npos)
        << text;
  }
  EXPECT_EQ(read_sheet(out("starts/branch-01/sheet.ply")).no_go, "cam1 moved");
  for (const char* file : {"split/sensitivity.json", "piece/piece.json"})
    EXPECT_NE(read_text(out(file)).find("\"no_go\": \"cam1 moved\""), std::string::npos) << file;
}

TEST_F(Records, EveryProgramWarnsOfARareFabricAndRefusesFrictionThatNoClothHas) {
  const auto run = [&](const std::string& line) {
    const fs::path text = out("text");
    const std::size_t name = line.find(' ');
    const int ended = std::system((test::program(line.substr(0, name)).string() +
                                   line.substr(name) + " > " + text.string() + " 2>&1")
                                      .c_str());
    return std::pair(WEXITSTATUS(ended), read_text(text));
  };
  const fs::path fabric = out("fabrics/A.toml");
  const std::string text = read_text(fabric), density = "areal_density_g_per_m2 = ";
  const std::size_t at = text.find(density) + density.size();
  write_durable(fabric, text.substr(0, at) + "1380.0" + text.substr(text.find('\n', at)));
  fs::create_directory(out("scenes"));
  std::string placed = read_text(scene());
  for (const char* name : {"fabrics/A.toml", "print.toml", "tent.obj"})
    placed.insert(placed.find(name), "../");
  write_durable(out("scenes/tent.toml"), placed);
  write_durable(out("plan.toml"),
                "schema = \"drapebench/plan/1\"\nscenes = "
                "[\"tent.toml\"]\ngrids = [6]\nsegments = [1]\n");
  const std::string scene_file = scene().string(), drape = out("drape").string();
  ASSERT_EQ(run("drape-simulate " + scene_file + " --grid 6 --solver static --out " + drape).first,
            0);
  const std::string sensitivity = fmt::format(
      "drape-simulate sensitivity {} --grid 6 --only-first-order --reference {}/sheet.ply --out {}",
      scene_file, drape, out("split").string());
  for (const std::string& line :
       {fmt::format("drape-simulate branches {} --grid 6 --starts 1 --kicks 0 --fit whole --out {}",
                    scene_file, out("starts").string()),
        sensitivity,
        fmt::format("drape-simulate refine {} --scene {} --finest 9 --out {}", drape, scene_file,
                    out("fine").string()),
        fmt::format("drape-simulate piece {} --spacing-mm 50 --out {}", scene_file,
                    out("piece").string()),
        fmt::format("drape-simulate cusick {} --spacing-mm 30 --max-steps 1 --starts 1 --out {}",
                    fabric.string(), out("cusick").string()),
        fmt::format("drape-simulate study {} --grids 6 --segments 1 --models consistent --out {}",
                    out("").string(), out("study").string()),
        fmt::format("drape-simulate study {} --out {}", out("plan.toml").string(),
                    out("parts").string())}) {
    const auto [code, said] = run(line);
    EXPECT_LE(code, 1) << line << said;
    EXPECT_NE(said.find("warning: " + fabric.string()), std::string::npos) << line << said;
    EXPECT_NE(said.find("an areal density of 1380 g/m2"), std::string::npos) << line << said;
  }
  std::string steep = read_text(scene());
  steep.replace(steep.find("friction = 0.4"), 14, "friction = 22.0");
  write_durable(scene(), steep);
  const auto [code, said] = run(sensitivity);
  EXPECT_EQ(code, 3) << said;
  EXPECT_NE(said.find("a friction coefficient of 22"), std::string::npos) << said;
}

TEST_F(Records, APartIsOfAPlanThatIsComputed) {
  write_durable(out("plan.toml"),
                "schema = \"drapebench/plan/1\"\nscenes = "
                "[\"tent.toml\"]\ngrids = [6]\nsegments = [1]\n");
  for (const std::string& words : {out("").string(), "status " + out("plan.toml").string()}) {
    const int ended = std::system(fmt::format("{} {} --part 1/2 --out {} > {} 2>&1",
                                              test::program("drape-simulate study").string(), words,
                                              out("study").string(), out("said").string())
                                      .c_str());
    const std::string said = read_text(out("said"));
    EXPECT_EQ(WEXITSTATUS(ended), 2) << said;
    EXPECT_NE(said.find("--part"), std::string::npos) << said;
  }
}

TEST_F(Records, AStudyRefusesWordsThatItDoesNotUse) {
  for (const std::string words :
       {"status a.toml b.toml --out c", "--grids 6 status a.toml --out c"}) {
    const int ended = std::system(
        (test::program("drape-simulate study").string() + " " + words + " 2> /dev/null").c_str());
    EXPECT_EQ(WEXITSTATUS(ended), 2) << words;
  }
}

TEST_F(Records, NameEveryFileThatADrapeIsMadeOf) {
  const std::string scene_file = scene().string();
  const std::string drape = out("drape").string(), fine = out("fine").string(),
                    starts = out("starts").string(), piece = out("piece").string(),
                    split = out("split").string();
  expect_all_named({scene_file, "--grid", "6", "--solver", "static", "--out", drape},
                   out("drape/sheet.run.json"));
  expect_all_named({"certify", drape, "--scene", scene_file}, out("drape/certify.run.json"));
  expect_all_named({"refine", drape, "--scene", scene_file, "--finest", "11", "--out", fine},
                   out("fine/refinement.run.json"));
  expect_all_named({"branches", scene_file, "--grid", "6", "--starts", "1", "--kicks", "0", "--fit",
                    "whole", "--out", starts},
                   out("starts/branches.run.json"));
  expect_all_named({"piece", scene_file, "--spacing-mm", "50", "--out", piece},
                   out("piece/piece.run.json"));
  expect_all_named({"sensitivity", scene_file, "--grid", "6", "--reference", drape + "/sheet.ply",
                    "--only-first-order", "--out", split},
                   out("split/sensitivity.run.json"));
}

TEST_F(Records, ACusickFolderHoldsTheDrapesOfItsListAlone) {
  const auto drape = [&](const std::string& starts) {
    const std::string line = test::program("drape-simulate cusick").string() + " " +
                             out("fabrics/A.toml").string() + " --spacing-mm 30 --max-steps 1" +
                             " --starts " + starts + " --out " + out("m").string();
    const int ended = std::system((line + " > /dev/null 2>&1").c_str());
    EXPECT_TRUE(WIFEXITED(ended) && WEXITSTATUS(ended) == 1) << line;
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
