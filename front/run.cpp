// SPDX-License-Identifier: Apache-2.0
#include "front/run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <set>
#include <sstream>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "front/check/check.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

const std::string kWarning = "  warning: ";  // as every program's ending begins such a line

/// The end of one step, as people see it and kept for --json.
struct StepEnding {
  Step step;
  int exit_code = 0;
  bool made = false;          ///< false: was up to date
  std::string text = {};      ///< what the program printed for people
  std::string sentence = {};  ///< its verdict, or why it failed
};

/// Draws one line for all running steps of a stage.
class StageProgress {
 public:
  StageProgress(const Group& group, bool quiet) : group_(&group), progress_(group.stage, quiet) {
    for (const Step& step : group.steps) total_ += step.weight;
  }

  /// `ended`: the step is over; it says so itself too, maybe more than once.
  void update(const Step& step, double fraction, const std::string& what, bool ended) {
    fractions_[step.what] = std::min(fraction, 1.0) * step.weight;
    if (ended) ended_.insert(step.what);
    double sum = 0;
    for (const auto& [name, part] : fractions_) sum += part;
    const std::string detail = ended ? step.what : step.what + ", " + what;
    progress_.update(sum / total_, fmt::format("{} ({} of {} done)", detail, ended_.size(),
                                               group_->steps.size()));
  }

 private:
  const Group* group_;
  Progress progress_;
  double total_ = 0;
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
  const Json json = try_json(output);
  if (!json.is_object() || !json.contains("sentence") || !json["sentence"].is_string())
    return output;
  std::string text =
      fmt::format("{}: {}\n", json.value("verdict", "GO"), json["sentence"].get<std::string>());
  if (const auto list = json.find("warnings"); list != json.end() && list->is_array())
    for (const Json& warning : *list)
      if (warning.is_string()) text += kWarning + warning.get<std::string>() + "\n";
  return text;
}

/// The warnings in what a program printed for people.
std::vector<std::string> warnings_of(const std::string& text) {
  std::vector<std::string> warnings;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with(kWarning)) warnings.push_back(line.substr(kWarning.size()));
  return warnings;
}

void print_ending(const StepEnding& ending, const CommonOptions& common) {
  if (common.quiet || common.json) return;
  const std::string state = ending.exit_code > 1   ? coloured("FAILED", "1;31", stdout)
                            : ending.exit_code > 0 ? coloured("NO-GO", "1;31", stdout)
                            : ending.made          ? "done"
                                                   : "up to date";
  const std::size_t pad =
      ending.exit_code > 0 ? 10 + state.size() - (ending.exit_code > 1 ? 6 : 5) : 10;
  print_text(
      fmt::format("{} {:<{}}  {}\n",
                  printable(fmt::format("{:<12} {:<24}", ending.step.stage, ending.step.what)),
                  state, pad, printable(ending.sentence)));
}

/// Drapes that came to no end, with why, in the order of their failure.
using Failed = std::vector<std::pair<std::string, std::string>>;

bool is_out(const Failed& failed, const std::string& drape) {
  return std::any_of(failed.begin(), failed.end(),
                     [&](const auto& one) { return one.first == drape; });
}

bool all_are_out(const Plan& plan, const Failed& failed) {
  for (const Group& group : plan.groups)
    for (const Step& step : group.steps)
      if (!step.drape.empty() && !is_out(failed, step.drape)) return false;
  return true;
}

/// Runs what is not up to date; the ending of each is kept at once, so that a killed group goes on
/// where it was.
std::vector<StepEnding> run_group(const Group& group, const Failed& failed,
                                  const CommonOptions& common) {
  std::vector<StepEnding> endings;
  std::vector<Step> to_do;
  std::vector<std::size_t> index;
  StageProgress progress(group, common.quiet || common.json);
  for (const Step& step : group.steps) {
    if (!step.drape.empty() && is_out(failed, step.drape)) continue;
    StepEnding& ending = endings.emplace_back();
    ending.step = step;
    if (!is_up_to_date(step.record, step.program, step.arguments)) {
      // As the stage itself does; one of another lab may not.
      remove_durable(step.record);
      remove_durable(ending_path(step.record));
      index.push_back(endings.size() - 1);
      to_do.push_back(step);
      continue;
    }
    ending.exit_code = recorded_exit_code(step.record);
    ending.text = ending_of(step, {});
    ending.sentence = sentence_of_text(ending.text);
    progress.update(step, 1, step.what, true);
  }
  bool disk_is_full = false;
  const auto ended = [&](std::size_t k, const StepResult& result) {
    StepEnding& ending = endings[index[k]];
    ending.made = true;
    ending.exit_code = result.exit_code;
    const auto error = error_in(result);
    // A full disk stops every step that runs beside another: it is said once.
    const bool full = error && error->what_failed().ends_with(std::strerror(ENOSPC));
    if (!full || !disk_is_full) std::fputs(result.errors.c_str(), stderr);
    disk_is_full = disk_is_full || full;
    if (!error) {
      ending.text = ending_of(ending.step, result.output);
      ending.sentence = sentence_of_text(ending.text);
    } else {
      ending.exit_code = std::max(ending.exit_code, 2);
      ending.sentence = error->what_failed();
      if (!result.fault.empty() && Interrupts::signal() == 0) {
        ending.exit_code = static_cast<int>(ErrorKind::internal);
        fmt::print(stderr, "drape: {}: {}\n", coloured("error", "31", stderr),
                   printable(error->what()));
      }
    }
    progress.update(ending.step, 1, ending.step.what, true);
  };
  run_steps(
      to_do, group.at_once,
      [&](std::size_t step, double fraction, const std::string& what) {
        progress.update(to_do[step], fraction, what, false);
      },
      ended);
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

/// Steps beside the drapes themselves: without them less is said of a result, not something wrong.
bool is_extra(const Step& step) {
  return step.stage == "sensitivity" || step.stage == "branches" || step.stage == "refine";
}

/// The first stage that is NO-GO, in its own words; of one drape where `drape` names it.
std::string no_go_of(const std::vector<StepEnding>& endings, const std::string& drape = {}) {
  for (const StepEnding& ending : endings) {
    const bool speaks = drape.empty() || ending.step.drape.empty() || ending.step.drape == drape;
    if (ending.exit_code != 0 && speaks && !is_extra(ending.step))
      return fmt::format("{} ({}): {}", ending.step.stage, ending.step.what, ending.sentence);
  }
  return {};
}

/// The first cause: what failed, or was NO-GO before it failed, else the first stage that is NO-GO.
std::string cause_of(const std::vector<StepEnding>& endings, const Failed& failed) {
  if (!failed.empty()) {
    const auto& [drape, why] = failed.front();
    const std::string before = no_go_of(endings, drape);
    if (!before.empty() && before.rfind("compare", 0) != 0) return before;
    const std::string more =
        failed.size() > 1 ? fmt::format(" (and {} more)", failed.size() - 1) : std::string();
    return fmt::format("drape {} could not be measured or simulated: {}{}", drape, why, more);
  }
  return no_go_of(endings);
}

/// What the stages before the simulations warn of, each with its step. What simulations warn of is
/// in their certificates, which report and store have.
std::vector<std::string> stage_warnings(const std::vector<StepEnding>& endings) {
  static const std::set<std::string> kMeasuring = {"detect", "calib", "object", "triangulate"};
  std::vector<std::string> warnings;
  for (const StepEnding& ending : endings)
    if (kMeasuring.count(ending.step.stage) != 0)
      for (const std::string& warning : warnings_of(ending.text))
        warnings.push_back(
            fmt::format("{} ({}): {}", ending.step.stage, ending.step.what, warning));
  return warnings;
}

/// The end of a run for --json; without a report where nothing was compared.
int print_json(const Plan& plan, const std::vector<StepEnding>& endings, const Failed& failed,
               const std::string& cause, std::vector<std::string> warnings) {
  Json json;
  json["verdict"] = cause.empty() ? "GO" : "NO-GO";
  json["cause"] = cause.empty() ? Json() : Json(cause);
  json["warnings"] = std::move(warnings);
  json["rejected"] = Json::array();
  for (const auto& [drape, why] : failed)
    json["rejected"].push_back(fmt::format("drape {}: {}", drape, why));
  json["steps"] = Json::array();
  for (const StepEnding& ending : endings) json["steps"].push_back(json_of(ending));
  json["report"] = fs::is_regular_file(plan.report) ? Json(plan.report.string()) : Json();
  json["store"] = plan.store.string();
  print_text(pretty(json));
  return cause.empty() ? 0 : 1;
}

int conclude(const Plan& plan, const std::vector<StepEnding>& endings, const Failed& failed,
             const CommonOptions& common) {
  const std::string cause = cause_of(endings, failed);
  if (common.json)
    return print_json(plan, endings, failed, cause, warnings_of(endings.back().text));
  std::size_t made = 0;
  for (const StepEnding& ending : endings) made += ending.made;
  if (!common.quiet) print_text(printable("\n" + endings.back().text + "\n"));
  Ending ending;
  ending.go = cause.empty();
  ending.verdict = ending.go ? "the bench ran from images to stored millimetres" : cause;
  ending.numbers = {{"steps", fmt::format("{} made, {} up to date", made, endings.size() - made)},
                    {"results", plan.store.string()},
                    {"report", plan.report.string()}};
  for (const auto& [drape, why] : failed)
    ending.rejected.push_back(fmt::format("drape {}: {}", drape, why));
  ending.next_command =
      fmt::format("drape results list --store {}", shell_word(plan.store.string()));
  return finish(ending, common);
}

/// Nothing could be stored, for the reason `why`, of what is NO-GO; an older report would say
/// otherwise.
int end_early(const Plan& plan, const std::vector<StepEnding>& kept, const Failed& failed,
              const std::string& why, const CommonOptions& common) {
  std::error_code absent;
  fs::remove(plan.report, absent);
  Ending ending;
  ending.go = false;
  ending.verdict = no_go_of(kept);
  ending.warnings = {"nothing was compared, stored or reported: " + why};
  if (fs::is_regular_file(plan.store))
    ending.warnings.push_back(fmt::format("what {} holds of these photographs is of an earlier run",
                                          plan.store.string()));
  for (std::string& warning : stage_warnings(kept)) ending.warnings.push_back(std::move(warning));
  if (common.json) return print_json(plan, kept, failed, ending.verdict, ending.warnings);
  return finish(ending, common);
}

/// Records of the steps without a verdict in this run: those that an earlier run left are of other
/// inputs.
std::set<fs::path> records_not_made(const Plan& plan, const std::vector<StepEnding>& kept) {
  std::set<fs::path> records;
  for (const Group& group : plan.groups)
    for (const Step& step : group.steps) records.insert(step.record);
  for (const StepEnding& ending : kept) records.erase(ending.step.record);
  return records;
}

/// Takes the steps that failed out of what follows; the exit code of one that all need, or 0.
/// `lacking`: what is not said of a result, because an extra failed.
int sort_out(const std::vector<StepEnding>& endings, const CommonOptions& common, Failed& failed,
             std::vector<StepEnding>& kept, std::vector<std::string>& lacking) {
  for (const StepEnding& ending : endings) {
    if (ending.exit_code > 1 && ending.step.drape.empty()) return ending.exit_code;
    print_ending(ending, common);
    if (ending.exit_code <= 1) {
      kept.push_back(ending);
      if (ending.exit_code == 1 && is_extra(ending.step))
        lacking.push_back(fmt::format("{} ({}): NO-GO: {}", ending.step.stage, ending.step.what,
                                      ending.sentence));
      continue;
    }
    if (is_extra(ending.step)) {
      lacking.push_back(fmt::format("{} ({}): failed, so nothing of it is in the result: {}",
                                    ending.step.stage, ending.step.what, ending.sentence));
      continue;
    }
    if (!is_out(failed, ending.step.drape) || ending.step.stage == "simulate")
      failed.emplace_back(ending.step.drape, ending.step.what == "drape " + ending.step.drape
                                                 ? ending.sentence
                                                 : ending.step.what + ": " + ending.sentence);
  }
  return 0;
}

/// Nothing comes of this run, and the report of an earlier one would say otherwise.
int given_up(const Plan& plan, int exit_code) {
  std::error_code absent;
  fs::remove(plan.report, absent);
  return exit_code;
}

int interrupted(int signal) {
  fmt::print(stderr, "drape: interrupted: what was finished is kept, run again to go on\n");
  return 128 + signal;
}

}  // namespace

int run_bench(const RunOptions& options, const CommonOptions& common) {
  const BenchCheck check = check_bench(options.rig, options.recording);
  if (!check.problems.empty()) return report_check(check, "drape run", common);
  if (!common.quiet && !common.json)
    for (const std::string& warning : check.warnings) fmt::print("warning: {}\n", warning);
  const Plan plan = make_plan(options);
  const WriterLock lock(plan.out / ".lock", "another `drape run` works on this folder");
  const Interrupts interrupts;
  plan.write_reduced_rig();
  std::vector<StepEnding> kept;
  Failed failed;
  std::vector<std::string> lacking;
  bool stopped = false;
  for (const Group& group : plan.groups) {
    const std::vector<StepEnding> endings = run_group(group, failed, common);
    if (const int signal = Interrupts::signal(); signal != 0) return interrupted(signal);
    if (const int code = sort_out(endings, common, failed, kept, lacking))
      return given_up(plan, code);
    // Where every drape failed there is nothing to compare; its own error is the run's.
    const bool any = std::any_of(endings.begin(), endings.end(), [](const StepEnding& one) {
      return one.exit_code <= 1 && !one.step.drape.empty();
    });
    const auto first = std::find_if(endings.begin(), endings.end(),
                                    [](const StepEnding& one) { return one.exit_code > 1; });
    // Not every drape has a plate of tags: the others go on.
    if (group.stage == "object" && !all_are_out(plan, failed)) continue;
    if (any || first == endings.end() || is_extra(first->step)) continue;
    if (no_go_of(kept).empty()) return given_up(plan, first->exit_code);
    stopped = true;
    break;
  }
  // A drape that is NO-GO before it could be compared is so in the store and its lists too.
  const bool measured = std::any_of(kept.begin(), kept.end(), [](const StepEnding& one) {
    return one.step.stage == "triangulate";
  });
  if (stopped && !measured)
    return end_early(plan, kept, failed, "there is no measured sheet", common);
  Group compare{"compare", {plan.compare(records_not_made(plan, kept))}, 1};
  for (const auto& warnings : {stage_warnings(kept), lacking})
    for (const std::string& warning : warnings)
      compare.steps.front().arguments.push_back("--warning=" + warning);
  for (const auto& [drape, why] : failed)
    compare.steps.front().arguments.push_back(fmt::format("--no-go=drape {}: {}", drape, why));
  // A step made again has another record, which the store's seal has to hold.
  if (std::any_of(kept.begin(), kept.end(), [](const StepEnding& one) { return one.made; }))
    remove_durable(compare.steps.front().record);
  const std::vector<StepEnding> endings = run_group(compare, {}, common);
  if (const int signal = Interrupts::signal(); signal != 0) return interrupted(signal);
  if (endings.front().exit_code > 1)
    return stopped ? end_early(plan, kept, failed, endings.front().sentence, common)
                   : given_up(plan, endings.front().exit_code);
  print_ending(endings.front(), common);
  kept.push_back(endings.front());
  return conclude(plan, kept, failed, common);
}

}  // namespace drape
