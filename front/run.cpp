// SPDX-License-Identifier: Apache-2.0
#include "front/run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <set>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "core/run_report.hpp"
#include "front/check/check.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

struct StepEnding {
  Step step;
  int exit_code = 0;
  bool made = false;   ///< false if it was up to date
  Ending ending = {};  ///< for a failed step only the reason

  [[nodiscard]] std::string name() const { return fmt::format("{} ({})", step.stage, step.what); }
};

/// Returns true if the outputs of a step belong to its inputs, whatever its arguments were.
bool is_as_made(const Step& step) {
  if (!fs::is_regular_file(step.record)) return false;
  try {
    const RunFile run = read_run_file(step.record);
    const auto holds = [&](const RecordedFile& file) { return is_as_recorded(step.record, file); };
    return (run.exit_code == 0 || run.exit_code == 1) &&
           run.program_sha256 == sha256_of_file(step.program) &&
           std::all_of(run.inputs.begin(), run.inputs.end(), holds) &&
           std::all_of(run.outputs.begin(), run.outputs.end(), holds);
  } catch (const Error&) {
    return false;
  }
}

/// Draws one progress line for all running steps of a stage.
class StageProgress {
 public:
  StageProgress(const Group& group, bool quiet)
      : steps_(group.steps.size()), progress_(group.stage, quiet) {
    for (const Step& step : group.steps) total_ += step.weight;
  }

  /// `ended`: the step is over. The step itself may report this too, more than once.
  void update(const Step& step, double fraction, const std::string& what, bool ended) {
    fractions_[step.what] = std::min(fraction, 1.0) * step.weight;
    if (ended) ended_.insert(step.what);
    double sum = 0;
    for (const auto& [name, part] : fractions_) sum += part;
    const std::string detail = ended ? step.what : step.what + ", " + what;
    progress_.update(sum / total_,
                     fmt::format("{} ({} of {} done)", detail, ended_.size(), steps_));
  }

 private:
  std::size_t steps_;
  Progress progress_;
  double total_ = 0;
  std::set<std::string> ended_;
  std::map<std::string, double> fractions_;
};

/// One run of a bench: its steps in order, with their results.
class BenchRun {
 public:
  BenchRun(const Plan& plan, const CommonOptions& common) : plan_(plan), common_(common) {}

  /// Runs all steps and returns the exit code.
  int run() {
    bool stopped = false;
    for (const Group& group : plan_.groups) {
      const std::vector<StepEnding> endings = run_group(group);
      if (Interrupts::signal() != 0) return interrupted();
      if (const int code = sort_out(endings)) return given_up(code);
      const auto first = std::find_if(endings.begin(), endings.end(),
                                      [](const StepEnding& one) { return one.exit_code > 1; });
      const bool any = std::any_of(endings.begin(), endings.end(), [](const StepEnding& one) {
        return one.exit_code <= 1 && !one.step.drape.empty();
      });
      // If every drape failed there is nothing to compare; its error is the run's.
      if (any || first == endings.end() || first->step.is_extra) continue;
      if (group.is_for_some && !all_are_out()) continue;
      if (no_go_of({}).empty()) return given_up(first->exit_code);
      stopped = true;
      break;
    }
    if (!plan_.compare) return end_as_asked();
    // A drape that was NO-GO before the comparison is NO-GO in the store and its lists too.
    const bool measured = std::any_of(
        kept_.begin(), kept_.end(), [](const StepEnding& one) { return one.step.is_measurement; });
    if (stopped && !measured) return end_early("there is no measured sheet");
    leave_out_old_drapes();
    const StepEnding compared = run_group(compare_group()).front();
    if (Interrupts::signal() != 0) return interrupted();
    if (compared.exit_code > 1)
      return stopped ? end_early(compared.ending.verdict) : given_up(compared.exit_code);
    print(compared);
    return conclude(compared);
  }

 private:
  [[nodiscard]] bool is_out(const std::string& drape) const {
    return std::any_of(failed_.begin(), failed_.end(),
                       [&](const auto& one) { return one.first == drape; });
  }

  /// True for a drape that was not requested and whose measurement is not up to date.
  [[nodiscard]] bool lacks(const std::string& scene) const {
    return not_up_to_date_.count(scene) != 0;
  }

  [[nodiscard]] bool all_are_out() const {
    for (const Group& group : plan_.groups)
      for (const Step& step : group.steps)
        if (!step.drape.empty() && !is_out(step.drape)) return false;
    return true;
  }

  /// Runs the steps that are not up to date. Stores each ending immediately, so that an interrupted
  /// group resumes where it stopped.
  std::vector<StepEnding> run_group(const Group& group) {
    std::vector<StepEnding> endings;
    std::vector<Step> to_do;
    std::vector<std::size_t> index;
    StageProgress progress(group, common_.quiet || common_.json);
    for (const Step& step : group.steps) {
      if (!step.drape.empty() && is_out(step.drape)) continue;
      if (!step.is_asked && (lacks(step.scene) || !is_as_made(step))) {
        // Without one of its simulations the drape would have others.
        if (group.stage != "simulate" && !step.is_extra) not_up_to_date_.insert(step.scene);
        continue;
      }
      StepEnding& ending = endings.emplace_back();
      ending.step = step;
      if (step.is_asked && !is_up_to_date(step.record, step.program, step.arguments)) {
        // Stages remove their record themselves, but another lab's may not.
        remove_durable(step.record);
        remove_durable(ending_path(step.record));
        index.push_back(endings.size() - 1);
        to_do.push_back(step);
        continue;
      }
      ending.exit_code = read_run_file(step.record).exit_code;
      ending.ending = kept_ending(step.record).value_or(Ending{});
      progress.update(step, 1, step.what, true);
    }
    bool disk_is_full = false;
    run_steps(
        to_do, group.at_once,
        [&](std::size_t step, double fraction, const std::string& what) {
          progress.update(to_do[step], fraction, what, false);
        },
        [&](std::size_t step, const StepResult& result) {
          StepEnding& ending = endings[index[step]];
          take(result, ending, disk_is_full);
          progress.update(ending.step, 1, ending.step.what, true);
        });
    return endings;
  }

  static void take(const StepResult& result, StepEnding& ending, bool& disk_is_full) {
    ending.made = true;
    ending.exit_code = result.exit_code;
    const auto error = error_in(result);
    // A full disk stops all parallel steps; it is reported once.
    const bool full = error && error->what_failed().ends_with(std::strerror(ENOSPC));
    if (!full || !disk_is_full) std::fputs(result.errors.c_str(), stderr);
    disk_is_full = disk_is_full || full;
    if (!error) {
      // Another lab's stage may store no ending; its output is used then.
      ending.ending =
          kept_ending(ending.step.record).value_or(ending_in(result.output).value_or(Ending{}));
      return;
    }
    ending.exit_code = std::max(ending.exit_code, 2);
    ending.ending.verdict = error->what_failed();
    if (result.fault.empty() || Interrupts::signal() != 0) return;
    ending.exit_code = static_cast<int>(ErrorKind::internal);
    fmt::print(stderr, "drape: {}: {}\n", coloured("error", "31", stderr),
               printable(error->what()));
  }

  /// Sorts steps by outcome; returns the exit code of a failed one that all drapes need, or 0.
  int sort_out(const std::vector<StepEnding>& endings) {
    for (const StepEnding& ending : endings) {
      const std::string& why = ending.ending.verdict;
      if (ending.exit_code > 1 && ending.step.drape.empty()) return ending.exit_code;
      print(ending);
      if (ending.exit_code <= 1) kept_.push_back(ending);
      if (ending.step.is_extra && ending.exit_code > 0)
        lacking_.push_back(ending.name() +
                           (ending.exit_code == 1
                                ? ": NO-GO: "
                                : ": failed, so nothing of it is in the result: ") +
                           why);
      else if (ending.exit_code > 1)
        failed_.emplace_back(ending.step.drape, ending.step.what == "drape " + ending.step.drape
                                                    ? why
                                                    : ending.step.what + ": " + why);
    }
    return 0;
  }

  void print(const StepEnding& ending) const {
    if (common_.quiet || common_.json) return;
    const char* state = ending.exit_code > 1   ? "FAILED"
                        : ending.exit_code > 0 ? "NO-GO"
                        : ending.made          ? "done"
                                               : "up to date";
    const std::string shown =
        ending.exit_code > 0 ? coloured(state, "1;31", stdout) : std::string(state);
    print_text(fmt::format(
        "{} {}{}  {}\n",
        printable(fmt::format("{:<12} {:<24}", ending.step.stage, ending.step.what)), shown,
        std::string(10 - std::strlen(state), ' '), printable(ending.ending.verdict)));
  }

  /// Quotes the first stage that is NO-GO; for one drape if `drape` is given.
  [[nodiscard]] std::string no_go_of(const std::string& drape) const {
    for (const StepEnding& ending : kept_) {
      const bool speaks = drape.empty() || ending.step.drape.empty() || ending.step.drape == drape;
      if (ending.exit_code != 0 && speaks && !ending.step.is_extra)
        return ending.name() + ": " + ending.ending.verdict;
    }
    return {};
  }

  /// First cause: what failed, or was NO-GO before it failed, else the first stage that is
  /// NO-GO.
  [[nodiscard]] std::string cause_of(const StepEnding& compared) const {
    std::string cause = no_go_of(failed_.empty() ? "" : failed_.front().first);
    if (cause.empty() && !failed_.empty())
      cause = fmt::format(
          "drape {} could not be measured or simulated: {}{}", failed_.front().first,
          failed_.front().second,
          failed_.size() > 1 ? fmt::format(" (and {} more)", failed_.size() - 1) : std::string());
    if (cause.empty() && compared.exit_code != 0)
      cause = compared.name() + ": " + compared.ending.verdict;
    return cause;
  }

  /// Warnings of the steps that belong to the result, each with its step.
  [[nodiscard]] std::vector<std::string> stage_warnings() const {
    std::vector<std::string> warnings;
    for (const StepEnding& ending : kept_)
      if (ending.step.warns)
        for (const std::string& warning : ending.ending.warnings)
          warnings.push_back(ending.name() + ": " + warning);
    return warnings;
  }

  [[nodiscard]] std::vector<std::string> rejected() const {
    std::vector<std::string> lines;
    for (const auto& [drape, why] : failed_)
      lines.push_back(fmt::format("drape {}: {}", drape, why));
    return lines;
  }

  /// Removes drapes that were not requested and have no up-to-date simulation from the
  /// comparison.
  void leave_out_old_drapes() {
    std::set<std::string> simulated;
    for (const StepEnding& ending : kept_)
      if (ending.step.stage == "simulate") simulated.insert(ending.step.scene);
    for (const Group& group : plan_.groups)
      for (const Step& step : group.steps)
        if (!step.is_asked && simulated.count(step.scene) == 0) not_up_to_date_.insert(step.scene);
    std::erase_if(kept_, [&](const StepEnding& one) { return lacks(one.step.scene); });
    for (const std::string& drape : not_up_to_date_)
      lacking_.push_back(fmt::format(
          "drape {} is not up to date and was not asked for, so nothing of it is in the result",
          drape));
  }

  /// Compares all sheets made in this run; those of earlier runs have other inputs.
  [[nodiscard]] Group compare_group() const {
    std::set<fs::path> not_made;
    for (const Group& group : plan_.groups)
      for (const Step& step : group.steps) not_made.insert(step.record);
    for (const StepEnding& ending : kept_) not_made.erase(ending.step.record);
    Step step = plan_.compare(not_made);
    for (const auto& warnings : {stage_warnings(), lacking_})
      for (const std::string& warning : warnings) step.arguments.push_back("--warning=" + warning);
    for (const std::string& line : rejected()) step.arguments.push_back("--no-go=" + line);
    // A repeated step has a new record, which the report shows.
    if (std::any_of(kept_.begin(), kept_.end(), [](const StepEnding& one) { return one.made; }))
      remove_durable(step.record);
    return {step.stage, {step}, 1};
  }

  /// Ends a run at the stage given by --until.
  [[nodiscard]] int end_as_asked() const {
    Ending ending;
    ending.verdict = no_go_of({});
    if (ending.verdict.empty() && !failed_.empty())
      ending.verdict = fmt::format("drape {}: {}", failed_.front().first, failed_.front().second);
    ending.go = ending.verdict.empty();
    if (ending.go && !kept_.empty()) ending.verdict = kept_.back().ending.verdict;
    ending.warnings = stage_warnings();
    ending.rejected = rejected();
    if (common_.json)
      return print_json(kept_, ending.go ? "" : ending.verdict, ending.warnings, ending.verdict);
    return finish(ending, common_);
  }

  /// Prints the end of a run for --json; there is no report if nothing was compared.
  int print_json(const std::vector<StepEnding>& endings, const std::string& cause,
                 const std::vector<std::string>& warnings,
                 const std::string& sentence = "the bench ran to stored millimetres") const {
    Json json;
    json["verdict"] = cause.empty() ? "GO" : "NO-GO";
    json["sentence"] = cause.empty() ? sentence : cause;
    json["cause"] = cause.empty() ? Json() : Json(cause);
    json["warnings"] = warnings;
    json["rejected"] = rejected();
    json["steps"] = Json::array();
    for (const StepEnding& ending : endings)
      json["steps"].push_back({{"stage", ending.step.stage},
                               {"what", ending.step.what},
                               {"made", ending.made},
                               {"exit_code", ending.exit_code},
                               {"sentence", ending.ending.verdict}});
    json["report"] = fs::is_regular_file(plan_.report) ? Json(plan_.report.string()) : Json();
    json["store"] = plan_.store.string();
    print_text(pretty(json));
    return cause.empty() ? 0 : 1;
  }

  int conclude(const StepEnding& compared) {
    const std::string cause = cause_of(compared);
    kept_.push_back(compared);
    if (common_.json) return print_json(kept_, cause, compared.ending.warnings);
    const auto made =
        std::count_if(kept_.begin(), kept_.end(), [](const StepEnding& one) { return one.made; });
    if (common_.quiet) return cause.empty() ? 0 : 1;
    print_text(printable(fmt::format("\nsteps: {} made, {} up to date\n", made,
                                     static_cast<std::ptrdiff_t>(kept_.size()) - made)));
    const fs::path found = fs::path(plan_.report).replace_extension(".json");
    if (!fs::is_regular_file(found)) {  // comparison made by another lab
      print_text(printable(printed(compared.ending)));
      return cause.empty() ? 0 : 1;
    }
    const auto report = read_record<RunReport>(found);
    const std::string first = cause.empty() ? first_line(report) : "NO-GO: " + cause;
    const std::string text = printable(ending_text(report, first, plan_.report.string()));
    const std::size_t end = text.find(':');
    const char* colour = !cause.empty() ? "1;31" : is_all_good(report) ? "32" : "1";
    print_text(coloured(text.substr(0, end), colour, stdout) + text.substr(end) +
               printable(fmt::format("next    drape results show {} --store {}\n",
                                     report.run.value_or(1), shell_word(plan_.store.string()))));
    return cause.empty() ? 0 : 1;
  }

  /// Ends a run that could not store any result, for the reason `why`.
  int end_early(const std::string& why) const {
    remove_report();
    Ending ending;
    ending.go = false;
    ending.verdict = no_go_of({});
    ending.warnings = {"nothing was compared, stored or reported: " + why};
    if (fs::is_regular_file(plan_.store))
      ending.warnings.push_back(fmt::format(
          "what {} holds of these photographs is of an earlier run", plan_.store.string()));
    for (std::string& warning : stage_warnings()) ending.warnings.push_back(std::move(warning));
    if (common_.json) return print_json(kept_, ending.verdict, ending.warnings);
    return finish(ending, common_);
  }

  /// Removes the report of an earlier run, which would contradict this one.
  void remove_report() const {
    std::error_code absent;
    fs::remove(plan_.report, absent);
  }

  [[nodiscard]] int given_up(int exit_code) const {
    remove_report();
    return exit_code;
  }

  [[nodiscard]] static int interrupted() {
    fmt::print(stderr, "drape: interrupted: what was finished is kept, run again to go on\n");
    return 128 + Interrupts::signal();
  }

  const Plan& plan_;
  const CommonOptions& common_;
  std::vector<StepEnding> kept_;                             ///< steps with a verdict
  std::vector<std::pair<std::string, std::string>> failed_;  ///< failed drapes, with reasons
  std::set<std::string> not_up_to_date_;                     ///< drapes that were not requested
  std::vector<std::string>
      lacking_;  ///< optional steps that failed, so that the result lacks what they find
};

}  // namespace

int run_bench(const RunOptions& options, const CommonOptions& common) {
  const BenchCheck check =
      check_bench(options.rig, options.recording, options.until == LastStage::calib);
  if (!check.problems.empty()) return report_check(check, "drape run", common);
  if (!common.quiet && !common.json)
    for (const std::string& warning : check.warnings) fmt::print("warning: {}\n", warning);
  RunOptions all = options;
  all.threads = thread_count(common);
  const Plan plan = make_plan(all);
  const WriterLock lock(plan.out / ".lock", "another `drape run` works on this folder");
  const Interrupts interrupts;
  plan.write_reduced_rig();
  return BenchRun(plan, common).run();
}

}  // namespace drape
