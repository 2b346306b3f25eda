// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "compare/records/provenance.hpp"
#include "compare/report/account.hpp"
#include "compare/store/outcome.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

std::string from_folder(const fs::path& file, const fs::path& folder) {
  return fs::proximate(file, folder).generic_string();
}

/// Rewrites a path of the command line relative to the report's folder; other words are unchanged.
std::string argument_text(const std::string& argument, const fs::path& folder) {
  std::error_code ignored;
  // A word such as "drape_A" remains a name even if a folder has that name.
  const bool path = argument.find('/') != std::string::npos ||
                    (fs::path(argument).has_extension() && fs::exists(argument, ignored));
  return shell_word(path && !argument.empty() && argument.front() != '-'
                        ? from_folder(argument, folder)
                        : argument);
}

std::string command(const StepRecord& made_by, const fs::path& folder) {
  std::string text = made_by.program;
  for (std::size_t i = 0; i < made_by.arguments.size(); ++i) {
    const std::string& argument = made_by.arguments[i];
    if (argument == "--threads")
      ++i;  // with its number
    else if (argument != "--json" && argument != "--quiet")
      text += " " + argument_text(argument, folder);
  }
  return text;
}

/// All steps in the order in which they run.
std::vector<StepRecord> steps_of(const Session& session, const Outcome& outcome) {
  std::vector<std::optional<StepRecord>> steps;
  if (session.calibrated_by)
    for (const auto& [file, sha256] : session.calibrated_by->inputs)  // marks of the target
      if (fs::is_regular_file(file) && sha256_of_file(file) == sha256)
        steps.push_back(read_made_by(file));
  steps.push_back(session.calibrated_by);
  for (const DrapeFiles& drape : session.drapes) {
    steps.insert(steps.end(), {drape.detected_by, drape.measured_by});
    steps.insert(steps.end(), drape.simulated_by.begin(), drape.simulated_by.end());
    steps.push_back(drape.split_by);
  }
  steps.push_back(StepRecord{"drape-compare", version(), outcome.arguments});
  std::vector<StepRecord> known;
  for (const auto& step : steps)
    if (step) known.push_back(*step);
  return known;
}

std::string tree_of(RecordBook& book, std::set<fs::path>& followed, const SheetFile& sheet,
                    const fs::path& folder) {
  fs::path json = sheet.file;
  json.replace_extension(".json");
  std::string text;
  for (const ChainLink& link : chain_of(book, json, sheet.sha256, followed)) {
    const std::string made = link.made_by.starts_with("drape-")
                                 ? link.made_by.substr(0, link.made_by.find(' '))
                                 : link.made_by;
    text +=
        fmt::format("{}{}  {}{}  {}\n", std::string(2 * static_cast<std::size_t>(link.depth), ' '),
                    from_folder(link.file, folder), link.sha256.substr(0, 12),
                    link.state == "unchanged" ? "" : " (" + link.state + ")", made);
  }
  return text;
}

/// The measured sheet and the headline simulation of each drape, traced to photographs and curves.
std::vector<std::pair<std::string, std::string>> trees(const Session& session,
                                                       const Outcome& outcome,
                                                       const fs::path& folder) {
  RecordBook book;
  std::vector<std::pair<std::string, std::string>> all;
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    const Report& report = outcome.reports[i];
    if (!report.headline) continue;
    const DrapeInput& input = session.drapes[i].input;
    std::set<fs::path> followed;
    const Simulation& headline =
        input.simulations[report.real_virtual[*report.headline].simulation];
    std::string text = tree_of(book, followed, input.measured, folder);
    if (!headline.other_simulator) text += tree_of(book, followed, headline.sheet, folder);
    all.emplace_back(report.called(), text);
  }
  return all;
}

}  // namespace

ReportedProvenance provenance_of(const Session& session, const Outcome& outcome,
                                 const fs::path& folder) {
  ReportedProvenance made;
  std::set<std::pair<std::string, std::string>> read;  // sorted, whatever the form of each path
  for (const auto& [file, sha256] : session.read) read.emplace(from_folder(file, folder), sha256);
  for (const auto& [file, sha256] : read) made.inputs.push_back({file, sha256});
  std::set<std::string> programs, recordings, stand_ins, seen;
  for (const StepRecord& step : steps_of(session, outcome)) {
    programs.insert(step.program + " " + step.version);
    const std::string line = command(step, folder);
    if (seen.insert(line).second) made.commands.push_back(line);  // one run can make several sheets
  }
  for (const DrapeFiles& drape : session.drapes)
    if (const auto& one = drape.recording)
      recordings.insert(fmt::format("{}{}, SHA-256 {}", one->name,
                                    one->recorded_on ? " of " + *one->recorded_on : std::string(),
                                    one->sha256.substr(0, 12)));
  for (const RunValue& value : values_of(session, outcome))
    if (value.key == "stand_ins" && !value.value.empty())
      stand_ins.insert(value.owner + ": " + value.value);
  made.programs.assign(programs.begin(), programs.end());
  made.recordings.assign(recordings.begin(), recordings.end());
  made.stand_ins.assign(stand_ins.begin(), stand_ins.end());
  made.trees = trees(session, outcome, folder);
  return made;
}

}  // namespace drape::compare
