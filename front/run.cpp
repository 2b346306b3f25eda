// SPDX-License-Identifier: Apache-2.0
#include "front/run.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <map>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

/// Held while a run works on its output folder; the system frees it when the process dies.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& folder) {
    std::error_code failed;
    fs::create_directories(folder, failed);
    const fs::path file = folder / ".lock";
    fd_ = failed ? -1 : ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (fd_ < 0) {
      throw bad_input("cannot write into the output folder", {.file = folder.string()},
                      "check the path and its permissions, or give another with --out");
    }
    if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
      throw bad_input("another `drape run` works on this folder", {.file = folder.string()},
                      "wait for it to end, or give another folder with --out");
    }
  }
  ~FolderLock() {
    if (fd_ >= 0) ::close(fd_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_ = -1;
};

/// The end of one step, as it is told to people and kept for --json.
struct StepEnding {
  Step step;
  int exit_code = 0;
  bool made = false;  ///< false: was up to date
  std::string sentence;
};

/// Draws one line for all running steps of a stage.
class StageProgress {
 public:
  StageProgress(const Group& group, bool quiet) : group_(&group), progress_(group.stage, quiet) {
    for (const Step& step : group.steps) total_ += step.weight;
  }

  void already_done(const Step& step) {
    done_ += step.weight;
    ++ended_;
  }

  void update(const Step& step, double fraction, const std::string& what) {
    fractions_[step.what] = fraction * step.weight;
    if (fraction >= 1) ++ended_;
    double sum = done_;
    for (const auto& [name, share] : fractions_) sum += share;
    const std::string detail =
        fraction >= 1 || what == step.what ? step.what : step.what + ", " + what;
    progress_.update(sum / total_,
                     fmt::format("{} ({} of {} done)", detail, ended_, group_->steps.size()));
  }

 private:
  const Group* group_;
  Progress progress_;
  double total_ = 0;
  double done_ = 0;
  std::size_t ended_ = 0;
  std::map<std::string, double> fractions_;
};

/// The sentence of the verdict line in what a program printed for people.
std::string sentence_of_text(const std::string& output) {
  for (const std::string verdict : {"\nGO: ", "\nNO-GO: "}) {
    const std::size_t at = ("\n" + output).rfind(verdict);
    if (at == std::string::npos) continue;
    const std::size_t begin = at + verdict.size() - 1;
    return output.substr(begin, output.find('\n', begin) - begin);
  }
  return {};
}

std::string sentence_of(const std::string& output) {
  const Json json = Json::parse(output, nullptr, false);
  if (json.is_discarded()) return sentence_of_text(output);
  if (!json.contains("sentence") || !json["sentence"].is_string()) return {};
  return json["sentence"].get<std::string>();
}

/// Where a step's standard output is kept, so that a run without work can show it again.
fs::path ending_file(const Step& step) {
  fs::path file = step.record;
  return file.replace_extension().replace_extension(".ending.txt");
}

bool can_skip(const Step& step) {
  return fs::is_regular_file(ending_file(step)) &&
         is_up_to_date(step.record, step.program, step.arguments);
}

void print_ending(const StepEnding& ending, const CommonOptions& common) {
  if (common.quiet || common.json) return;
  const char* state = !ending.made ? "up to date" : ending.exit_code == 0 ? "done" : "NO-GO";
  fmt::print("{:<12} {:<24} {:<10}  {}\n", ending.step.stage, ending.step.what, state,
             ending.sentence);
  std::fflush(stdout);
}

std::vector<StepEnding> run_group(const Group& group, const CommonOptions& common) {
  std::vector<StepEnding> endings(group.steps.size());
  std::vector<Step> to_do;
  std::vector<std::size_t> index;
  StageProgress progress(group, common.quiet || common.json);
  for (std::size_t i = 0; i < group.steps.size(); ++i) {
    const Step& step = group.steps[i];
    endings[i].step = step;
    if (!can_skip(step)) {
      to_do.push_back(step);
      index.push_back(i);
      continue;
    }
    endings[i].exit_code = recorded_exit_code(step.record);
    endings[i].sentence = sentence_of(read_text(ending_file(step)));
    progress.already_done(step);
  }
  const std::vector<StepResult> results = run_steps(
      to_do, group.at_once, [&](std::size_t step, double fraction, const std::string& what) {
        progress.update(to_do[step], fraction, what);
      });
  for (std::size_t k = 0; k < results.size(); ++k) {
    StepEnding& ending = endings[index[k]];
    ending.made = true;
    ending.exit_code = results[k].exit_code;
    ending.sentence = sentence_of(results[k].output);
    if (ending.exit_code <= 1) write_durable(ending_file(ending.step), results[k].output);
  }
  return endings;
}

Json json_of(const StepEnding& ending) {
  Json json;
  json["stage"] = ending.step.stage;
  json["what"] = ending.step.what;
  json["made"] = ending.made;
  json["exit_code"] = ending.exit_code;
  json["sentence"] = ending.sentence;
  return json;
}

int conclude(const Plan& plan, const std::vector<StepEnding>& endings,
             const CommonOptions& common) {
  std::size_t made = 0;
  bool go = true;
  for (const StepEnding& ending : endings) {
    made += ending.made;
    go = go && ending.exit_code == 0;
  }
  const std::string tables = read_text(ending_file(endings.back().step));
  if (common.json) {
    Json json;
    json["verdict"] = go ? "GO" : "NO-GO";
    json["steps"] = Json::array();
    for (const StepEnding& ending : endings) json["steps"].push_back(json_of(ending));
    json["report"] = plan.report.string();
    json["store"] = plan.store.string();
    fmt::print("{}", pretty(json));
    return go ? 0 : 1;
  }
  if (!common.quiet) fmt::print("\n{}\n", tables);
  Ending ending;
  ending.go = go;
  ending.verdict =
      go ? "the bench ran from images to stored millimetres" : "see the steps marked NO-GO above";
  ending.numbers = {{"steps", fmt::format("{} made, {} up to date", made, endings.size() - made)},
                    {"results", plan.store.string()},
                    {"report", plan.report.string()}};
  ending.next_command = fmt::format("drape results list --store {}", plan.store.string());
  return finish(ending, common);
}

}  // namespace

int run_bench(const RunOptions& options, const CommonOptions& common) {
  const Plan plan = make_plan(options);
  const FolderLock lock(plan.out);
  std::vector<StepEnding> endings;
  for (const Group& group : plan.groups) {
    for (const StepEnding& ending : run_group(group, common)) {
      if (ending.exit_code > 1) return ending.exit_code;
      print_ending(ending, common);
      endings.push_back(ending);
    }
  }
  return conclude(plan, endings, common);
}

}  // namespace drape
