// SPDX-License-Identifier: Apache-2.0
#include "tests/faults/crash_stage.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <stdexcept>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

/// Shell line of the front door under test, with a fixed date of the run, which the store holds.
std::string drape_line(const std::string& arguments) {
  const fs::path here = program("drape").parent_path();
  const fs::path programs = environment("DRAPE_CRASH_PROGRAMS", here.string());
  return (programs / "drape").string() + " " + arguments;
}

Outcome run_in(const fs::path& folder, const std::string& line) {
  return run_line("cd " + folder.string() + " && export SOURCE_DATE_EPOCH=0 && " + line);
}

void must_end_with(int code, const Outcome& outcome) {
  if (outcome.exit_code != code) throw std::runtime_error(outcome.text);
}

void replace_in(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = read_text(file);
  const auto at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error(file.string() + " lacks " + from);
  write_durable(file, text.replace(at, from.size(), to));
}

void add_folder_of(const SmallBench& bench, const std::string& name, const fs::path& folder) {
  fs::copy(bench.folder() / name, folder / name,
           fs::copy_options::recursive | fs::copy_options::copy_symlinks);
}

/// Adds rig/ of a small bench with one drape and few poses of the target, images linked.
void add_rig(const fs::path& folder) {
  add_folder_of(SmallBench({"C"}), "rig", folder);
  for (const char* poses :
       {"  \"pose_05\",  \"pose_06\",  \"pose_07\",  \"pose_08\",  \"pose_09\",\n",
        "  \"pose_10\",  \"pose_11\",  \"pose_12\",  \"pose_13\",  \"pose_14\",\n"})
    replace_in(folder / "rig/rig.toml", poses, "");
}

constexpr const char* kRun = "run rig --single --out out --threads 1";
constexpr const char* kDensity = "areal_density_g_per_m2 = 138";
constexpr const char* kOtherDensity = "areal_density_g_per_m2 = 150";
constexpr const char* kCoarse = "--spacing-mm 20 --coarsest-mm 20 --segments 1";
constexpr const char* kVerifyRun = "results verify --store out/results.sqlite";

/// Adds a finished run without its last step.
void add_run_before_comparison(const fs::path& folder) {
  const SmallBench bench({"C"}, measured);
  for (const char* name : {"rig", "out"}) add_folder_of(bench, name, folder);
}

void add_finished_run(const fs::path& folder) {
  add_run_before_comparison(folder);
  must_end_with(0, run_in(folder, drape_line(kRun)));
}

void add_run_with_other_fabric(const fs::path& folder) {
  add_finished_run(folder);
  replace_in(folder / "rig/fabrics/A.toml", kDensity, kOtherDensity);
}

void add_failed_run(const fs::path& folder) {
  add_finished_run(folder);
  // Only the simulation fails, so that the front door has removed its output.
  const fs::path fabric = folder / "rig/fabrics/A.toml";
  replace_in(fabric, kDensity, kOtherDensity);
  const fs::path simulation = folder / "out/C/simulations/10mm-1";
  fs::remove_all(simulation);
  write_durable(simulation, "a file where a folder is needed");
  must_end_with(3, run_in(folder, drape_line(kRun)));
  fs::remove(simulation);
}

void add_images(const fs::path& folder) {
  const fs::path recording = source_root() / "rigs/bench1/recording";
  fs::create_directory(folder / "images");
  for (const char* set : {"stage_z000", "drape_C"})
    fs::copy(recording / set, folder / "images" / set, fs::copy_options::recursive);
}

/// Adds a rig whose cameras show the recorded drape.
void add_replayed_cameras(const fs::path& folder) {
  fs::create_directories(folder / "rig");
  add_images(folder);
  fs::remove_all(folder / "images/stage_z000");
  must_end_with(0, run_in(folder, drape_line("import images --out rig/one")));
  fs::remove_all(folder / "images");
  fs::copy(source_root() / "rigs/bench1/rig.toml", folder / "rig");
  std::string text =
      "schema = \"drapebench/cameras/1\"\n[sync]\nmethod = \"free_run\"\nframe_rate_hz = 1.0\n"
      "largest_spread_ms = 70.0\n";
  for (int c = 0; c < 3; ++c)
    text += fmt::format(
        "[[camera]]\nname = \"cam{0}\"\nbackend = \"replay\"\ndevice = \"cam{0}\"\n"
        "recording = \"one\"\n",
        c);
  write_durable(folder / "rig/cameras.toml", text);
}

void add_old_store(const fs::path& folder) {
  add_finished_run(folder);
  fs::create_directory(folder / "old");
  fs::copy_file(source_root() / "compare/test_data/store_v3.sqlite", folder / "old/results.sqlite");
}

std::string points_line(int laying) {
  return fmt::format(
      "import --points {0}.csv --scene rig/scenes/C.toml --fit points.toml --repeat {0} --face "
      "face "
      "--out layings/{0}/sheet.ply",
      laying);
}

/// Adds a study's plan of one scene on a coarse mesh.
void add_plan(const fs::path& folder) {
  const fs::path paper = source_root() / "rigs/paper", plan = folder / "plan";
  fs::create_directories(plan / "scenes");
  fs::copy(paper / "fabrics", plan / "fabrics", fs::copy_options::recursive);
  fs::copy(paper / "print.toml", plan);
  fs::copy(paper / "scenes/A.toml", plan / "scenes");
  write_durable(plan / "plan.toml",
                "schema = \"drapebench/plan/1\"\nscenes = [\"scenes/A.toml\"]\n"
                "spacings_mm = [20]\nsegments = [1]\n");
}

void add_simulation(const fs::path& folder) {
  add_plan(folder);
  must_end_with(0, run_in(folder, drape_line("simulate plan/scenes/A.toml --out out " +
                                             std::string(kCoarse))));
}

/// Adds three layings of a drape as points of another instrument, and the first two as sheets.
void add_points(const fs::path& folder) {
  add_run_before_comparison(folder);
  write_durable(folder / "points.toml",
                "schema = \"drapebench/points/1\"\nsigma_mm = 0.02\n[columns]\nx = \"x_mm\"\n"
                "y = \"y_mm\"\nz = \"z_mm\"\nwarp = \"warp_mm\"\nweft = \"weft_mm\"\n");
  const Json sheet = parse_json(read_text(folder / "out/C/simulations/10mm-1/sheet.json"));
  for (int laying = 1; laying <= 3; ++laying) {
    std::string text = "x_mm,y_mm,z_mm,warp_mm,weft_mm\n";
    for (const Json& mark : sheet.at("marks")) {
      const Json &at = mark.at("xyz_mm"), &on = mark.at("material_mm");
      text += fmt::format("{},{},{},{},{}\n", at[0].get<double>(), at[1].get<double>(),
                          at[2].get<double>() + 0.01 * laying * std::sin(at[0].get<double>()),
                          on[0].get<double>(), on[1].get<double>());
    }
    write_durable(folder / fmt::format("{}.csv", laying), text);
    if (laying < 3) must_end_with(0, run_in(folder, drape_line(points_line(laying))));
  }
}

/// Adds a calibration and detections of other pictures of its target.
void add_test_of_calibration(const fs::path& folder) {
  add_rig(folder);
  for (const char* line :
       {"detect rig/recording --rig rig --surface target --sets "
        "stage_z000,stage_z030,stage_z060,stage_z090 --out stages/detections.json",
        "calib stages/detections.json --rig rig --out out/calibration.json",
        "detect rig/recording --rig rig --surface target --sets "
        "pose_00,pose_01,pose_02,pose_03,pose_04,pose_05,pose_06 --out poses/detections.json"})
    must_end_with(0, run_in(folder, drape_line(line)));
}

void add_store_of_a_simulation(const fs::path& folder) {
  add_run_before_comparison(folder);
  must_end_with(0, run_in(folder, drape_line("results import --apart out/C/simulations --store "
                                             "apart.sqlite")));
  write_durable(folder / "lab.toml",
                "schema = \"drapebench/lab/1\"\ntitle = \"t\"\ndescription = \"d\"\n"
                "license = \"https://creativecommons.org/licenses/by/4.0/\"\n"
                "license_name = \"CC BY 4.0\"\n[[author]]\nname = \"N\"\n");
}

void add_run_and_key(const fs::path& folder) {
  add_finished_run(folder);
  must_end_with(0, run_in(folder, "openssl genpkey -algorithm ed25519 -out key.pem"));
}

void add_poses(const fs::path& folder) {
  fs::create_directory(folder / "images");
  for (int pose = 0; pose < 6; ++pose) {
    const std::string name = fmt::format("pose_{:02}", pose);
    fs::copy(source_root() / "rigs/bench1/recording" / name, folder / "images" / name,
             fs::copy_options::recursive);
  }
  fs::copy(source_root() / "rigs/bench1/target.toml", folder);
}

/// Content of a file that must not depend on interruptions: without clock times and, for the run
/// that made the report, without the store among its outputs and the counts in its ending.
std::string lasting(const std::string& file, std::string text) {
  static const std::regex times(
      "\"(started|ended)_utc\": \"[^\"]*\"|\"device_time_s\": [^\n]*"
      "|\"details_sha256\": [^\n]*|\"recorded_on\": [^\n]*");
  static const std::regex hashes("sha256\": \"[0-9a-f]*\"");
  static const std::regex counts("[0-9]+ comparisons added, [0-9]+ were there already");
  if (file.ends_with(".json")) text = std::regex_replace(text, times, "");
  if (file.ends_with(".ending.json")) text = std::regex_replace(text, counts, "");
  if (file == "report.run.json" || file == "recording.run.json")
    text = std::regex_replace(text, hashes, "");
  return text;
}

/// Number of steps that the front door reported as finished.
long finished_steps(const std::string& text) {
  static const std::regex finished("(^|\n)[a-z]+ +[^\n]* (done|up to date) [^\n]*");
  return std::distance(std::sregex_iterator(text.begin(), text.end(), finished), {});
}

long up_to_date_steps(const std::string& text) {
  static const std::regex count("steps:? +[0-9]+ made, ([0-9]+) up to date");
  std::smatch found;
  return std::regex_search(text, found, count) ? std::stol(found[1]) : 0;
}

/// A failed call must be reported in one sentence with exit 3, or must have changed nothing.
std::string wrong_answer(const Outcome& outcome, int good) {
  std::size_t sentences = 0;
  for (auto at = outcome.text.find("error: "); at != std::string::npos;
       at = outcome.text.find("error: ", at + 1))
    ++sentences;
  if ((outcome.exit_code == 3 && sentences == 1) || (outcome.exit_code == good && sentences == 0))
    return {};
  return fmt::format("exit {} with {} sentences: {}", outcome.exit_code, sentences, outcome.text);
}

}  // namespace

std::vector<Situation> situations() {
  const std::string store = "out/results.sqlite";
  return {
      {"first_run", add_rig, kRun, kVerifyRun, store},
      {"first_comparison", add_run_before_comparison, kRun, kVerifyRun, store},
      {"changed_fabric", add_run_with_other_fabric, kRun, kVerifyRun, store},
      {"after_a_failed_run", add_failed_run, kRun, kVerifyRun, store},
      {"import_of_sheets", add_finished_run, "results import out --store other/results.sqlite",
       "results verify --store other/results.sqlite", "other/results.sqlite"},
      {"import_of_images", add_images, "import images --out recording", "capture verify recording"},
      {"capture", add_replayed_cameras,
       "capture rig --set drape_C --out recording --patience-s 300", "capture verify recording", "",
       "the recording already holds this set"},
      {"merge", add_finished_run, "results merge out/results.sqlite --store other/results.sqlite",
       "results verify --store other/results.sqlite", "other/results.sqlite"},
      {"rescue", add_finished_run, "results rescue out/results.sqlite --store other/results.sqlite",
       "results verify --store other/results.sqlite", "other/results.sqlite",
       "there is a file already"},
      // The sheets of that store's comparisons no longer exist.
      {"migration", add_old_store, "results import out --store old/results.sqlite",
       "results verify --no-recompute --store old/results.sqlite", "old/results.sqlite"},
  };
}

std::vector<Situation> single_commands() {
  const fs::path plan = source_root() / "rigs/plans/three-cameras.toml";
  std::vector<Situation> all = {
      {"new_bench", [](const fs::path&) {}, "new bench --cameras a,b --drape A=sphere:90", "", "",
       "the folder exists"},
      {"print", add_rig, "print cloth rig/print.toml --out cloth.pdf", "check rig"},
      {"object_tags", [](const fs::path&) {}, "print object-tags --out plate.pdf"},
      {"published_fabric", [](const fs::path&) {}, "fabric show matsudaira-A --out fabric",
       "fabric fabric/fabric.toml", "", "the folder exists"},
      {"plot_of_a_fabric", add_plan, "fabric plan/fabrics/A.toml --plot curves.svg"},
      {"detect_with_overlay", add_rig,
       "detect rig/recording --rig rig --surface cloth --sets drape_C --out out/detections.json "
       "--overlay out/overlay"},
      {"acceptance", add_test_of_calibration,
       "calib accept poses/detections.json --calibration out/calibration.json --rig rig --date "
       "2026-01-31 --out out/acceptance.json",
       "", "", "", 1},
      {"conversion", add_test_of_calibration,
       "calib convert out/calibration.json --to opencv "
       "--out converted"},
      {"points", add_points, points_line(3)},
      {"repeats", add_points,
       "compare repeats layings/1/sheet.ply layings/2/sheet.ply --out out/repeats.json"},
      {"drapemeter", add_simulation, "drapemeter out/sheet.ply --disc-mm 60 --out hems"},
      {"certify", add_simulation, "simulate certify out --scene plan/scenes/A.toml"},
      {"study", add_plan, "study plan --out out", "study status plan --out out"},
      {"export", add_finished_run, "results export csv --store out/results.sqlite --out out/t.csv",
       kVerifyRun},
      {"history", add_finished_run, "results history --store out/results.sqlite --out out/h.html",
       kVerifyRun},
      {"signature", add_run_and_key, "results sign --store out/results.sqlite --key key.pem",
       kVerifyRun},
      {"crate", add_store_of_a_simulation,
       "results export ro-crate --store apart.sqlite --about lab.toml --out crate",
       "results verify --store apart.sqlite", "", "the folder exists"},
  };
  if (std::getenv("DRAPE_CRASH_POINTS") == nullptr) return all;
  // These take seconds each time.
  all.push_back({"simulation", add_plan,
                 "simulate plan/scenes/A.toml --out out " + std::string(kCoarse),
                 "simulate certify out --scene plan/scenes/A.toml"});
  all.push_back(
      {"folder_of_pictures", add_poses, "calib images images --target target.toml --out out"});
  all.push_back(
      {"branches", add_plan,
       "simulate branches plan/scenes/A.toml --starts 2 --out out " + std::string(kCoarse)});
  all.push_back({"sensitivity", add_run_before_comparison,
                 "simulate sensitivity rig/scenes/C.toml --reference out/C/sheet.ply --out sens " +
                     std::string(kCoarse)});
  all.push_back({"synthetic_pictures", add_rig,
                 "synth rig --cameras " + plan.string() + " --sets stage_z000 --out pictures",
                 "capture verify pictures"});
  return all;
}

std::string environment(const char* name, const std::string& otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : text;
}

std::string difference(const Traces& found, const Traces& expected) {
  for (const auto& [name, text] : expected) {
    const auto same = found.find(name);
    if (same == found.end()) return name + " is missing";
    if (same->second != text) return name + " differs:\n" + same->second.substr(0, 2000);
  }
  for (const auto& [name, text] : found)
    if (expected.count(name) == 0) return name + " is too many";
  return {};
}

CrashStage::CrashStage(Situation situation) : situation_(std::move(situation)) {
  adopt_descendants();
  fs::create_directory(begin());
  fs::create_directory(disk());
  situation_.prepare(begin());
  fresh();
  const auto started = std::chrono::steady_clock::now();
  const Outcome outcome = run(faulty(0, "kill"));
  const std::chrono::duration<double> lasted = std::chrono::steady_clock::now() - started;
  must_end_with(situation_.exit_code, outcome);
  duration_s_ = lasted.count();
  std::ifstream(counter(), std::ios::binary).read(reinterpret_cast<char*>(&calls_), sizeof calls_);
  expected_ = traces();
  expected_runs_ = runs();
}

std::string CrashStage::after_fault(long at, const std::string& with) const {
  fresh();
  const Outcome faulted = run(faulty(at, with));
  if (with == "kill") return after_second_run(faulted);
  if (std::string wrong = wrong_answer(faulted, situation_.exit_code); !wrong.empty()) return wrong;
  if (faulted.exit_code == situation_.exit_code) {
    const std::string different = difference(traces(), expected_);
    if (!different.empty()) return "ended well, but " + different;
  }
  return after_second_run(faulted);
}

std::string CrashStage::after_kill_at(double time_s) const {
  fresh();
  return after_second_run(
      run(fmt::format("timeout -s KILL {:.3f} {}", time_s, drape_line(situation_.line))));
}

std::string CrashStage::after_power_cut(long at, bool synced, const std::string& remount) const {
  fresh();
  must_end_with(0, run_line("sync -f " + disk().string()));
  const Outcome cut = run(faulty(at, "cut",
                                 fmt::format("DRAPE_FAIL_MOUNT={}{} ", disk().string(),
                                             synced ? "" : " DRAPE_FAIL_UNSYNCED=1")));
  if (at > calls_) {
    must_end_with(0, cut);
    const int fd = ::open(disk().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    unsigned int without_log = 2;
    if (::ioctl(fd, _IOR('X', 125, unsigned int), &without_log) != 0)
      throw std::runtime_error("the file system cannot be shut down");
    ::close(fd);
  }
  must_end_with(0, run_line(remount));
  if (at > calls_) {
    const std::string different = difference(traces(), expected_);
    return different.empty() ? verified() : different;
  }
  return after_second_run(cut);
}

Traces CrashStage::runs() const {
  const fs::path store = work() / situation_.store;
  if (situation_.store.empty() || !fs::is_regular_file(store)) return {};
  // A copy, so that the next run finds the store as the kill left it.
  const TemporaryFolder copy;
  for (const char* end : {"", "-wal", "-journal"})
    if (fs::exists(store.string() + end))
      fs::copy(store.string() + end, copy.path() / ("store" + std::string(end)));
  SQLite::Database database((copy.path() / "store").string(), SQLite::OPEN_READWRITE);
  if (!database.tableExists("run")) return {};
  Traces runs;
  const auto add = [&](const std::string& table, const std::string& key) {
    SQLite::Statement rows(
        database, fmt::format("SELECT coalesce(r.sha256, 'no run'), t.* FROM {} t LEFT JOIN run r "
                              "ON t.{} = r.number ORDER BY 1, 2, 3",
                              table, key));
    while (rows.executeStep()) {
      std::string& text = runs[rows.getColumn(0).getString()] += table;
      for (int i = 1; i < rows.getColumnCount(); ++i) text += "|" + rows.getColumn(i).getString();
      text += "\n";
    }
  };
  add("run", "number");
  for (const char* table : {"run_drape", "run_comparison", "run_value"}) add(table, "run");
  return runs;
}

/// A run after the first one, complete or not, must give the result of an undisturbed one.
std::string CrashStage::after_second_run(const Outcome& first) const {
  for (const auto& [key, text] : runs()) {
    const auto whole = expected_runs_.find(key);
    if (whole == expected_runs_.end() || whole->second != text)
      return "half a run is in the store:\n" + text;
  }
  const Outcome again = run(drape_line(situation_.line));
  const bool refused =
      !situation_.refused.empty() && again.text.find(situation_.refused) != std::string::npos;
  if (again.exit_code != situation_.exit_code && !refused)
    return fmt::format("second run: exit {}: {}", again.exit_code, again.text);
  if (finished_steps(first.text) > up_to_date_steps(again.text))
    return fmt::format("{} steps were finished, then {}", finished_steps(first.text), again.text);
  const std::string different = difference(traces(), expected_);
  return different.empty() ? verified() : different;
}

std::string CrashStage::verified() const {
  if (situation_.verify.empty()) return {};
  const Outcome outcome = run(drape_line(situation_.verify));
  return outcome.exit_code == 0 ? "" : "verify: " + outcome.text;
}

Outcome CrashStage::run(const std::string& words) const {
  Outcome outcome = run_in(work(), words);
  await_descendants();
  return outcome;
}

/// The line of the situation with the fault injected at call `at`; 0 only counts calls.
std::string CrashStage::faulty(long at, const std::string& with, const std::string& more) const {
  write_durable(counter(), std::string(sizeof(long), '\0'));
  return fmt::format(
      "DRAPE_FAIL_COUNTER={} DRAPE_FAIL_AT={} DRAPE_FAIL_WITH={} {}LD_PRELOAD={} setsid --wait {}",
      counter().string(), at, with, more, DRAPE_FAIL_AT_LIBRARY, drape_line(situation_.line));
}

/// Everything left by a run, by name; a store is compared by rows, since its bytes depend on its
/// transactions.
Traces CrashStage::traces() const {
  Traces traces;
  for (const auto& entry : fs::recursive_directory_iterator(work())) {
    const std::string name = entry.path().lexically_relative(work()).string();
    const std::string file = entry.path().filename().string();
    if (!entry.is_regular_file() || file.front() == '.' || name.starts_with("rig/")) continue;
    const bool store = file.find(".sqlite") != std::string::npos && !file.ends_with(".sig");
    if (store || file == "capture.json") continue;
    // Remains of a capture that ended after its last acknowledgement, which nothing reads.
    if (situation_.name == "capture" && file.starts_with("recording.") && file != "recording.json")
      continue;
    traces[name] = lasting(file, read_text(entry.path()));
  }
  if (situation_.store.empty()) return traces;
  for (const std::string what : {"export sql", "list", "tables"})
    traces["results " + what] =
        run(drape_line("results " + what + " --store " + situation_.store)).text;
  return traces;
}

void CrashStage::fresh() const {
  fs::remove_all(work());
  fs::copy(begin(), work(), fs::copy_options::recursive | fs::copy_options::copy_symlinks);
}

}  // namespace drape::test
