// SPDX-License-Identifier: Apache-2.0
// A complete bench as run by an operator, compared with the truth that only tests read.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <thread>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/sheet.hpp"
#include "core/simulation_files.hpp"
#include "core/units.hpp"
#include "tests/support/bench1_truth.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"

namespace {

namespace fs = std::filesystem;
using drape::test::Outcome;
using drape::test::SmallBench;
using testing::ContainsRegex;
using testing::HasSubstr;

/// Ending of a step, without the line that counts what its run added to the store: an earlier run
/// may have been killed after it had stored everything.
std::string said(const fs::path& ending) {
  std::istringstream lines(drape::read_text(ending));
  std::string text;
  for (std::string line; std::getline(lines, line);) {
    if (line.find(" comparisons added, ") == std::string::npos) text += line + '\n';
  }
  return text;
}

/// SHA-256 of every output except the locks, which a kill leaves behind empty, and the run records,
/// which contain clock times; for endings the text itself.
std::map<std::string, std::string> contents(const fs::path& out) {
  std::map<std::string, std::string> result;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(out)) {
    const std::string name = fs::relative(entry.path(), out).string();
    if (!entry.is_regular_file() || name.ends_with(".lock") || name.ends_with(".run.json"))
      continue;
    result[name] =
        name.ends_with(".ending.json") ? said(entry.path()) : drape::sha256_of_file(entry.path());
  }
  return result;
}

double percentile(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  return values.at(static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1)));
}

/// Compares Blender's own meshes, as those of another simulator, with the measured sheet of a
/// drape: the stored distance of each mark is its distance from the truth. Returns e' C^-1 e of
/// every compared mark, with its error e and the stated covariance C.
std::vector<double> compare_with_blender(const SmallBench& bench, const std::string& drape,
                                         const fs::path& mesh) {
  const fs::path out = bench.folder() / "out", toml = out / (drape + "-blender.toml");
  drape::write_durable(
      toml, "schema = \"drapebench/mesh/1\"\nname = \"Blender 3.4\"\nmesh = \"" + mesh.string() +
                "\"\nunit_mm = 1.0\nscene = \"" + drape +
                "\"\n[grid]\ninner = \"weft\"\ninner_count = 111\nwarp_from_mm = "
                "220.0\nwarp_to_mm = 0.0\nweft_from_mm = 0.0\nweft_to_mm = 220.0\n");
  const std::string results = drape::test::program("drape-results").string();
  const std::string store = " --store " + (out / (drape + "-blender.sqlite")).string();
  const Outcome import = drape::test::run_line(
      results + " import " + (out / drape / "sheet.ply").string() + " " + toml.string() + store);
  // A distance as small as the marks' own error is measured like any other.
  EXPECT_EQ(import.exit_code, 0) << import.text;
  const Outcome rows = drape::test::run_line(
      results + " --csv sql 'SELECT \"row\", \"col\", distance_mm FROM mark_error' --quiet" +
      store);
  std::istringstream lines(rows.text);
  std::string line;
  std::getline(lines, line);
  const drape::Sheet sheet = drape::read_sheet(out / drape / "sheet.ply");
  const auto& dots = drape::test::bench1_truth().drapes.at(drape);
  std::vector<double> squares;
  for (int row = 0, col = 0; std::getline(lines, line);) {
    double distance_mm = 0;
    EXPECT_EQ(std::sscanf(line.c_str(), "%d,%d,%lf", &row, &col, &distance_mm), 3) << line;
    const auto& dot = dots.at(11 * static_cast<std::size_t>(row) + static_cast<std::size_t>(col));
    const drape::SheetMark* mark = sheet.find({row, col});
    if (mark == nullptr) continue;
    const Eigen::Vector3d error = mark->point_in_world - dot.point_in_world;
    EXPECT_NEAR(distance_mm, error.norm() / drape::units::mm, 0.001) << drape << " " << line;
    EXPECT_TRUE(mark->covariance_m2) << drape << " " << line;
    if (mark->covariance_m2) squares.push_back(error.dot(mark->covariance_m2->inverse() * error));
  }
  return squares;
}

TEST(EndToEnd, MeasuresTheTrueMarksOfAllDrapes) {
  const fs::path out = drape::test::finished_bench().folder / "out";
  int wanted = 0, measured = 0, wrong = 0;
  std::vector<double> errors_mm;
  for (const auto& [name, dots] : drape::test::bench1_truth().drapes) {
    const drape::Sheet sheet = drape::read_sheet(out / name / "sheet.ply");
    EXPECT_EQ(sheet.marks.size() + sheet.gaps.size(), 121U) << "each mark is measured or a gap";
    for (const drape::Gap& gap : sheet.gaps) EXPECT_FALSE(gap.reason.empty());
    for (const drape::test::TrueDot& dot : dots) {
      const drape::SheetMark* mark = sheet.find(dot.mark);
      if (mark != nullptr) {
        const double error_mm =
            (mark->point_in_world - dot.point_in_world).norm() / drape::units::mm;
        wrong += error_mm > 5;  // A quarter of the pitch: only its own true mark is that close.
        if (dot.facing_views(60) >= 2) errors_mm.push_back(error_mm);
      }
      wanted += dot.facing_views(60) >= 2;
      measured += dot.facing_views(60) >= 2 && mark != nullptr;
    }
  }
  EXPECT_GE(measured, 0.95 * wanted);
  EXPECT_EQ(wrong, 0);
  EXPECT_LE(percentile(errors_mm, 0.5), 0.04);
  EXPECT_LE(percentile(errors_mm, 0.95), 0.15);
  std::printf("measured %d of %d, 3D error median %.4f mm, p95 %.4f mm\n", measured, wanted,
              percentile(errors_mm, 0.5), percentile(errors_mm, 0.95));
}

TEST(EndToEnd, DistancesFromBlendersOwnMeshesAreTheErrorsOfTheMarks) {
  const std::filesystem::path data = drape::test::test_data("bench1");
  const SmallBench bench({"A", "C", "E"}, drape::test::measured);
  // Chi-square with three degrees of freedom: 99.7 % below 14.16 if every covariance is right. Dots
  // on the sharpest folds are bent more than their correction models, so some are outside.
  int inside = 0, all = 0;
  for (const std::string drape : {"A", "C", "E"}) {
    const auto squares = compare_with_blender(bench, drape, data / ("mesh_" + drape + ".ply"));
    EXPECT_GE(squares.size(), 70U);
    const auto within =
        std::count_if(squares.begin(), squares.end(), [](double square) { return square < 14.16; });
    std::printf("%s against Blender: %ld of %zu marks within 3 sigma of the truth\n", drape.c_str(),
                static_cast<long>(within), squares.size());
    inside += static_cast<int>(within);
    all += static_cast<int>(squares.size());
  }
  EXPECT_GE(inside, 0.92 * all) << "distances agree with the truth within what the sheets state";
}

/// Adds the set of drape C as another one, with new noise in the pictures.
void photograph_again(const SmallBench& bench, const std::string& set, int seed) {
  const fs::path recording = bench.rig() / "recording";
  drape::Json list = drape::parse_json(drape::read_text(recording / "recording.json"));
  drape::Json copy;
  for (const drape::Json& one : list["sets"])
    if (one["name"] == "drape_C") copy = one;
  copy["name"] = set;
  fs::create_directory(recording / set);
  for (drape::Json& frame : copy["frames"]) {
    cv::Mat image =
        cv::imread((recording / frame["file"].get<std::string>()).string(), cv::IMREAD_UNCHANGED);
    cv::Mat noise(image.size(), CV_16SC(image.channels()));
    cv::RNG(static_cast<std::uint64_t>(seed)).fill(noise, cv::RNG::NORMAL, 0, 2);
    cv::add(image, noise, image, cv::noArray(), image.type());
    frame["file"] = set + "/" + frame["camera"].get<std::string>() + ".png";
    const fs::path file = recording / frame["file"].get<std::string>();
    cv::imwrite(file.string(), image);
    frame["sha256"] = drape::sha256_of_file(file);
  }
  list["sets"].push_back(copy);
  drape::write_durable(recording / "recording.json", list.dump());
}

TEST(EndToEnd, AMatchRestsOnTheRepeatsThatTheRigNames) {
  const SmallBench bench({"C", "E"});
  std::string tables;
  for (int i = 2; i <= 4; ++i) {
    const std::string set = "drape_C_" + std::to_string(i);
    photograph_again(bench, set, i);
    tables += "[[repeat]]\nscene = \"C\"\nset = \"" + set + "\"\nrepeat = \"" + std::to_string(i) +
              "\"\n" + (i == 4 ? "face = \"back\"\n" : "") + "\n";
  }
  bench.replace("rig.toml", "[calibration]", tables + "[calibration]");
  const Outcome first = bench.run("out");
  ASSERT_LE(first.exit_code, 1) << first.text;
  EXPECT_THAT(first.text, HasSubstr("15 made, 0 up to date"));
  EXPECT_THAT(first.text, HasSubstr("(3 repeats)"));
  EXPECT_THAT(first.text, ContainsRegex("\n  E  .* mm apart, U "));
  const fs::path out = bench.folder() / "out";
  EXPECT_THAT(drape::read_text(out / "report.json"), HasSubstr("its upper face is `back`"));
  const auto sheet = drape::parse_json(drape::read_text(out / "C/repeats/4/sheet.json"));
  EXPECT_EQ(sheet["source"]["repeat"],
            (drape::Json{{"scene", "C"}, {"repeat", "4"}, {"face", "back"}}));
  EXPECT_EQ(sheet["source"]["asked_scene"]["name"], "C");
  EXPECT_EQ(sheet["source"]["asked_scene"]["surroundings"]["object.1.yaw_deg"], "14");
  EXPECT_THAT(drape::read_text(out / "report.html"), HasSubstr("repeats: spectrum"));
  const std::string results = drape::test::program("drape-results").string();
  const std::string store = " --store " + (out / "results.sqlite").string();
  EXPECT_THAT(drape::test::run_line(results + " runs" + store).text, HasSubstr("by 3 repeats"));
  EXPECT_EQ(drape::test::run_line(results + " verify" + store).exit_code, 0);
  EXPECT_THAT(bench.run("out").text, HasSubstr("0 made, 15 up to date"));
  // One laying fewer: only the comparison is made again.
  bench.replace("rig.toml",
                "[[repeat]]\nscene = \"C\"\nset = \"drape_C_4\"\nrepeat = "
                "\"4\"\nface = \"back\"\n",
                "");
  EXPECT_THAT(bench.run("out").text, HasSubstr("1 made, 12 up to date"));
}

TEST(EndToEnd, RepeatsOnlyStepsThatReadWhatChanged) {
  const SmallBench bench({"C"}, drape::test::measured);
  ASSERT_LE(bench.run("out").exit_code, 1);
  const fs::path scene = bench.rig() / "scenes/C.toml";
  drape::write_durable(scene, "# laid by hand\n" + drape::read_text(scene));
  EXPECT_THAT(bench.run("out").text, HasSubstr("0 made, 6 up to date"));
  // The same picture encoded in other bytes.
  const fs::path folder = bench.rig() / "recording/drape_C", picture = folder / "cam0.png";
  const fs::path original = fs::canonical(folder);
  const std::string before = drape::sha256_of_file(picture);
  if (fs::is_symlink(folder)) {
    fs::remove(folder);
    fs::copy(original, folder);
  }
  const cv::Mat image = cv::imread(picture.string(), cv::IMREAD_UNCHANGED);
  fs::remove(picture);
  ASSERT_TRUE(cv::imwrite(picture.string(), image, {cv::IMWRITE_PNG_COMPRESSION, 1}));
  bench.replace("recording/recording.json", before, drape::sha256_of_file(picture));
  const Outcome again = bench.run("out");
  EXPECT_THAT(again.text, ContainsRegex("detect +target +up to date"));
  EXPECT_THAT(again.text, ContainsRegex("calib +3 cameras +up to date"));
  EXPECT_THAT(again.text, ContainsRegex("detect +drape C +done"));
  EXPECT_THAT(again.text, testing::Not(HasSubstr("FAILED")));
}

TEST(EndToEnd, AnEnsembleSaysWhereTheRealDrapeIsAmongIts) {
  const SmallBench bench({"C"}, drape::test::measured);
  const std::string drape = drape::test::program("drape").string();
  const std::string line =
      "cd " + bench.folder().string() + " && exec " + drape + " run rig --out out";
  const Outcome first = drape::test::run_line(line);
  ASSERT_LE(first.exit_code, 1) << first.text;
  EXPECT_THAT(first.text, HasSubstr("4 made, 4 up to date"));
  EXPECT_THAT(first.text, testing::Not(HasSubstr("drape run --uncertainty")));
  const fs::path out = bench.folder() / "out";
  // U refers to the drape that is compared.
  const auto split =
      drape::parse_json(drape::read_text(out / "C/simulations/10mm-1" / drape::kSensitivityName));
  EXPECT_THAT(drape::read_text(out / "report/C-real-vs-virtual.csv"),
              HasSubstr(fmt::format("\n10 mm,1,{:.3f},", split["mean_distance_mm"].get<double>())));
  const drape::Json list = drape::parse_json(drape::read_text(out / "C/ensemble/branches.json"));
  ASSERT_GE(list["members_at_rest"].get<int>(), 8);
  ASSERT_FALSE(list["branches"].empty());
  EXPECT_GT(list["measured"]["started_there_distance_mm"].get<double>(), 0);
  const std::string report = drape::read_text(out / "report.html");
  EXPECT_THAT(report, HasSubstr("started from the real shape"));
  const drape::Json marks =
      drape::parse_json(drape::read_text(out / "report.json"))["drapes"][0]["marks"];
  EXPECT_EQ(marks[0]["band_radius_mm"].is_number(), !list["band"].empty());
  if (list["measured"].contains("reach_mm")) {
    const auto branch = list["measured"]["branch"];
    EXPECT_THAT(report, HasSubstr(branch.is_null() ? "on no branch of the ensemble"
                                                   : "the real drape is on branch"));
  }
  const Outcome stored = drape::test::run_line(
      drape::test::program("drape-results").string() +
      " --csv sql 'SELECT count(*) FROM v_branches' --store " + (out / "results.sqlite").string());
  EXPECT_THAT(stored.text, HasSubstr(std::to_string(list["branches"].size())));
  const Outcome verified =
      drape::test::run_line(drape::test::program("drape-results").string() + " verify --store " +
                            (out / "results.sqlite").string());
  EXPECT_EQ(verified.exit_code, 0) << verified.text;
  EXPECT_THAT(drape::test::run_line(line).text, HasSubstr("0 made, 8 up to date"));
  const Outcome single = bench.run("out");
  EXPECT_THAT(single.text, HasSubstr("2 made, 4 up to date"));
  EXPECT_THAT(drape::read_text(out / "report.html"), Not(HasSubstr("\"ensemble: ")));
}

TEST(EndToEnd, AFinerMeshLowersTheErrorThatTheReportStates) {
  const SmallBench bench({"C"}, drape::test::measured);
  const fs::path out = bench.folder() / "out";
  const Outcome first = bench.run("out", "--spacing-mm 5");
  ASSERT_LE(first.exit_code, 1) << first.text;
  const fs::path folder = out / "C/simulations/5mm-1";
  const auto levels = drape::read_record<drape::LevelsFile>(folder / "levels.json");
  ASSERT_EQ(levels.levels.size(), 2U);
  EXPECT_TRUE(levels.levels.back().at_rest);
  EXPECT_EQ(levels.sheet_sha256, drape::sha256_of_file(folder / "sheet.json"));
  EXPECT_EQ(levels.marks.size(), 121U);
  ASSERT_TRUE(levels.left_m);
  EXPECT_GT(*levels.left_m, 0);
  const std::string sentence = drape::mesh_error_sentence(levels);
  EXPECT_THAT(sentence, HasSubstr("--spacing-mm 2.5"));
  EXPECT_THAT(drape::read_text(out / "report.html"), HasSubstr(sentence));
  EXPECT_THAT(drape::test::run_line(drape::test::program("drape-results").string() +
                                    " show 1 C --store " + (out / "results.sqlite").string())
                  .text,
              HasSubstr(sentence));
  EXPECT_EQ(drape::test::run_line(drape::test::program("drape-results").string() +
                                  " verify --store " + (out / "results.sqlite").string())
                .exit_code,
            0);
  EXPECT_THAT(bench.run("out", "--spacing-mm 5").text, HasSubstr("0 made"));
  const Outcome finer = bench.run("out", "--spacing-mm 2.5");
  ASSERT_LE(finer.exit_code, 1) << finer.text;
  const auto fine =
      drape::read_record<drape::LevelsFile>(out / "C/simulations/2.5mm-1/levels.json");
  ASSERT_TRUE(fine.left_m);
  EXPECT_LT(*fine.left_m, *levels.left_m);
}

TEST(EndToEnd, ThePapersModelStandsBesideTheCloth) {
  const SmallBench bench({"C"}, drape::test::measured);
  bench.replace("rig.toml", "grids = [11, 21, 31]", "grids = [11]");
  const Outcome run = bench.run("out", "--paper");
  ASSERT_LE(run.exit_code, 1) << run.text;
  EXPECT_THAT(run.text, AllOf(HasSubstr("10 mm"), HasSubstr("11x11")));
  EXPECT_EQ(drape::read_sheet(bench.folder() / "out/C/simulations/paper-11-1/sheet.ply").rows, 11);
}

TEST(EndToEnd, InternalFrictionMakesTheDrapesAgainAndMeasuresNothingAgain) {
  const SmallBench bench({"C"}, drape::test::measured);
  ASSERT_LE(bench.run("out").exit_code, 1);
  const fs::path folder = bench.folder() / "out/C/simulations/10mm-1";
  const std::string without = drape::read_text(folder / "sheet.json");
  EXPECT_FALSE(fs::exists(folder / "memory.csv"));
  const Outcome with = bench.run("out", "--internal-friction");
  ASSERT_LE(with.exit_code, 1) << with.text;
  EXPECT_THAT(with.text, HasSubstr("2 made, 4 up to date"));  // the drape and its comparison
  EXPECT_TRUE(fs::exists(folder / "memory.csv"));
  EXPECT_NE(drape::read_text(folder / "sheet.json"), without);
  EXPECT_THAT(bench.run("out", "--internal-friction").text, HasSubstr("0 made, 6 up to date"));
  ASSERT_LE(bench.run("out").exit_code, 1);
  EXPECT_EQ(drape::read_text(folder / "sheet.json"), without);
  EXPECT_FALSE(fs::exists(folder / "memory.csv"));
}

/// Starts the run and kills it with all its children as soon as `file` exists.
void kill_when(const SmallBench& bench, const fs::path& file) {
  drape::test::adopt_descendants();
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::execl("/bin/sh", "sh", "-c", (bench.line("out") + " > run.log 2>&1").c_str(), nullptr);
    ::_exit(127);
  }
  bool ended = false;
  while (!ended && !fs::exists(file)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ended = ::waitpid(pid, nullptr, WNOHANG) == pid;
  }
  if (!ended) ::kill(pid, SIGKILL);
  drape::test::await_descendants();
}

TEST(EndToEnd, SameContentAtOneAndTwoThreadsTwiceAndKilled) {
  const SmallBench undisturbed({"C"});
  const Outcome first = undisturbed.run("out", "--threads 1");
  ASSERT_LE(first.exit_code, 1) << first.text;
  EXPECT_THAT(first.text, HasSubstr("6 made, 0 up to date"));
  auto before = contents(undisturbed.folder() / "out");
  EXPECT_EQ(before.count("results.sqlite"), 1U);
  // A second run makes nothing and ends as the first.
  const Outcome second = undisturbed.run("out", "--threads 1");
  EXPECT_EQ(second.exit_code, first.exit_code);
  EXPECT_THAT(second.text, HasSubstr("0 made, 6 up to date"));
  EXPECT_EQ(second.text.substr(second.text.find("\nsteps")).substr(40),
            first.text.substr(first.text.find("\nsteps")).substr(40));
  EXPECT_EQ(contents(undisturbed.folder() / "out"), before);
  {
    const SmallBench two({"C"});
    ASSERT_LE(two.run("out", "--threads 2").exit_code, 1);
    EXPECT_EQ(contents(two.folder() / "out"), before);
  }
  const SmallBench killed({"C"});
  const fs::path out = killed.folder() / "out";
  for (const char* file :
       {"target-detections.json", "calibration.json", "C/sheet.json", "results.sqlite",
        "report.html"}) {  // Before the last file, everything is in the store.
    kill_when(killed, out / file);
  }
  const Outcome last = killed.run("out");
  ASSERT_LE(last.exit_code, 1) << last.text;
  const std::string dump = " && " + drape::test::program("drape-results").string() +
                           " export json --store out/results.sqlite";
  const Outcome whole = drape::test::run_line("cd " + undisturbed.folder().string() + dump);
  const Outcome mended = drape::test::run_line("cd " + killed.folder().string() + dump);
  EXPECT_EQ(whole.exit_code, 0) << whole.text;
  EXPECT_EQ(whole.text, mended.text);
  auto after = contents(out);
  before.erase("results.sqlite");
  after.erase(
      "results.sqlite");  // Compared by content above, since a killed writer can leave free pages.
  EXPECT_EQ(before, after);
}

}  // namespace
