// SPDX-License-Identifier: Apache-2.0
#include "front/run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

/// The end of one step, as it is told to people and kept for --json.
struct StepEnding {
  Step step;
  int exit_code = 0;
  bool made = false;  ///< false: was up to date
  std::string text;   ///< what the program printed for people
};

/// Draws one line for all running steps of a stage.
class StageProgress {
 public:
  StageProgress(const Group& group, bool quiet) : group_(&group), progress_(group.stage, quiet) {
    for (const Step& step : group.steps) total_ += step.weight;
  }

  void already_done(const Step& step) {
    done_ += step.weight;
    ended_.insert(step.what);
  }

  void update(const Step& step, double fraction, const std::string& what) {
    fractions_[step.what] = fraction * step.weight;
    if (fraction >= 1) ended_.insert(step.what);
    double sum = done_;
    for (const auto& [name, share] : fractions_) sum += share;
    const std::string detail =
        fraction >= 1 || what == step.what ? step.what : step.what + ", " + what;
    progress_.update(sum / total_, fmt::format("{} ({} of {} done)", detail, ended_.size(),
                                               group_->steps.size()));
  }

 private:
  const Group* group_;
  Progress progress_;
  double total_ = 0;
  double done_ = 0;
  std::set<std::string> ended_;
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

/// The stage's own ending, or, of a stage of another lab that keeps none, what it printed.
std::string ending_of(const Step& step, const std::string& output) {
  const fs::path kept = ending_path(step.record);
  if (fs::is_regular_file(kept)) return read_text(kept);
  const Json json = Json::parse(output, nullptr, false);
  if (!json.is_object() || !json.contains("sentence") || !json["sentence"].is_string())
    return output;
  return fmt::format("{}: {}\n", json.value("verdict", "GO"), json["sentence"].get<std::string>());
}

void print_ending(const StepEnding& ending, const CommonOptions& common) {
  if (common.quiet || common.json) return;
  const char* state = !ending.made ? "up to date" : ending.exit_code == 0 ? "done" : "NO-GO";
  print_text(printable(fmt::format("{:<12} {:<24} {:<10}  {}\n", ending.step.stage,
                                   ending.step.what, state, sentence_of_text(ending.text))));
}

/// The endings of all steps that came to a verdict, and why it stopped where one did not.
struct GroupResult {
  std::vector<StepEnding> endings;
  int exit_code = 0;  ///< above 1: of the first step that failed
  std::string fault;
};

GroupResult run_group(const Group& group, const CommonOptions& common) {
  std::vector<std::optional<StepEnding>> endings(group.steps.size());
  std::vector<Step> to_do;
  std::vector<std::size_t> index;
  StageProgress progress(group, common.quiet || common.json);
  for (std::size_t i = 0; i < group.steps.size(); ++i) {
    const Step& step = group.steps[i];
    if (!is_up_to_date(step.record, step.program, step.arguments)) {
      // As the stage itself does; one of another lab may not.
      remove_durable(step.record);
      remove_durable(ending_path(step.record));
      to_do.push_back(step);
      index.push_back(i);
      continue;
    }
    endings[i] = {step, recorded_exit_code(step.record), false, ending_of(step, {})};
    progress.already_done(step);
  }
  const std::vector<StepResult> results = run_steps(
      to_do, group.at_once, [&](std::size_t step, double fraction, const std::string& what) {
        progress.update(to_do[step], fraction, what);
      });
  GroupResult result;
  for (std::size_t k = 0; k < results.size(); ++k) {
    const bool verdict = results[k].exit_code <= 1 && results[k].fault.empty();
    if (verdict) {
      endings[index[k]] = {to_do[k], results[k].exit_code, true,
                           ending_of(to_do[k], results[k].output)};
    } else if (result.exit_code <= 1) {
      result.exit_code = std::max(results[k].exit_code, 2);
      result.fault = results[k].fault;
    }
  }
  for (const auto& ending : endings)
    if (ending) result.endings.push_back(*ending);
  return result;
}

Json json_of(const StepEnding& ending) {
  Json json;
  json["stage"] = ending.step.stage;
  json["what"] = ending.step.what;
  json["made"] = ending.made;
  json["exit_code"] = ending.exit_code;
  json["sentence"] = sentence_of_text(ending.text);
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
  if (common.json) {
    Json json;
    json["verdict"] = go ? "GO" : "NO-GO";
    json["steps"] = Json::array();
    for (const StepEnding& ending : endings) json["steps"].push_back(json_of(ending));
    json["report"] = plan.report.string();
    json["store"] = plan.store.string();
    print_text(pretty(json));
    return go ? 0 : 1;
  }
  if (!common.quiet) print_text(printable("\n" + endings.back().text + "\n"));
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
  const WriterLock lock(plan.out / ".lock", "another `drape run` works on this folder");
  const Interrupts interrupts;
  std::vector<StepEnding> endings;
  for (const Group& group : plan.groups) {
    const GroupResult result = run_group(group, common);
    for (const StepEnding& ending : result.endings) print_ending(ending, common);
    if (const int signal = Interrupts::signal(); signal != 0) {
      fmt::print(stderr, "drape: interrupted: what was finished is kept, run again to go on\n");
      return 128 + signal;
    }
    if (!result.fault.empty())
      throw Error(ErrorKind::internal, result.fault, {},
                  "see what it printed above; run again, steps that were finished are kept");
    if (result.exit_code > 1) return result.exit_code;
    endings.insert(endings.end(), result.endings.begin(), result.endings.end());
  }
  return conclude(plan, endings, common);
}

}  // namespace drape
