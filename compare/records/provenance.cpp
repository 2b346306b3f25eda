// SPDX-License-Identifier: Apache-2.0
#include "compare/records/provenance.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "core/program/run_record.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepestChain = 1000;  ///< steps from a result back to its photographs

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

StepRecord read_step(const fs::path& file) {
  const RunFile run = read_run_file(file);
  StepRecord step{run.program, run.version, run.arguments, {}, {}, file, {}};
  for (const RecordedFile& input : run.inputs) {
    step.inputs.emplace_back(place_of(file, input).lexically_normal(), input.sha256);
    if (step.inputs.back().first.extension() == ".toml" && is_as_recorded(file, input))
      step.as_read.insert(step.inputs.back().first);
  }
  for (const RecordedFile& output : run.outputs)
    step.outputs.emplace_back(place_of(file, output).lexically_normal(), output.sha256);
  return step;
}

std::vector<StepRecord> read_folder(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code unreadable;
  for (const auto& entry : fs::directory_iterator(folder, unreadable))
    if (entry.path().string().ends_with(".run.json")) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<StepRecord> records;
  for (const fs::path& file : files) {
    try {
      records.push_back(read_step(file));
    } catch (const std::exception&) {
      // A record that cannot be read proves nothing about any file; verify checks its bytes.
    }
  }
  return records;
}

/// True for a file that only our programs write. A recording counts as written by cameras.
bool is_written_by_programs(const fs::path& file) {
  if (file.extension() != ".json" || file.filename() == "recording.json") return false;
  try {
    const Value json = json_value(read_text(file));
    const auto* name = json.find_as<std::string>("schema");
    return name != nullptr && name->starts_with("drapebench/");
  } catch (const std::exception&) {
    return false;  // its bytes are judged by their hash
  }
}

/// Kind of a file that none of our programs made, with the number of points of a curve.
std::string original(const fs::path& file) {
  const std::string end = file.extension().string();
  if (end == ".png") return "photograph";
  if (file.filename() == "recording.json") return "list of the photographs";
  if (end == ".csv") {
    try {
      const std::string text = read_text(file);
      const auto lines = std::count(text.begin(), text.end(), '\n');
      const auto notes = std::count(text.begin(), text.end(), '#');
      return fmt::format("curve, {} points", std::max<std::ptrdiff_t>(0, lines - 1 - notes));
    } catch (const Error&) {
      return "curve";
    }
  }
  if (end == ".toml") return "written by people";
  return is_written_by_programs(file) ? "no record of how it was made" : "from elsewhere";
}

void follow(RecordBook& book, const fs::path& file, const std::string& sha256, int depth,
            std::set<fs::path>& seen, std::vector<ChainLink>& chain) {  // NOLINT(misc-no-recursion)
  const auto now = book.sha256(file);
  ChainLink link{depth,
                 file,
                 sha256,
                 !now             ? "not there"
                 : *now == sha256 ? "unchanged"
                                  : "altered",
                 {}};
  const StepRecord* record = book.maker_of(file);
  link.made_by = record == nullptr
                     ? original(file)
                     : fmt::format("{} {}", record->program, fmt::join(record->arguments, " "));
  if (link.state == "unchanged" && !book.is_traced(file)) link.state = "not traced";
  chain.push_back(link);
  if (!seen.insert(file).second) {
    if (record != nullptr) chain.back().made_by = "see above";
    return;
  }
  if (record == nullptr) return;
  if (depth == kDeepestChain) {
    chain.back().made_by = "more steps than drapebench has";
    return;
  }
  for (const auto& [input, hash] : record->inputs)
    follow(book, input, hash, depth + 1, seen, chain);
}

}  // namespace

bool RecordBook::is_traced(const fs::path& file) {
  if (file.string().ends_with(".run.json")) return true;
  const StepRecord* record = maker_of(file);
  if (record == nullptr) return !is_written_by_programs(file);
  const auto now = sha256(file);
  return !now || std::ranges::none_of(record->outputs, [&](const auto& output) {
    return output.first == file.lexically_normal() && output.second != *now;
  });
}

const StepRecord* RecordBook::maker_of(const fs::path& file) {
  const fs::path beside = folder_of(file), wanted = file.lexically_normal();
  // A sheet has two files, and some records name only its .ply.
  fs::path twin = wanted;
  if (wanted.filename() == "sheet.json") twin.replace_extension(".ply");
  for (const fs::path& folder : {beside, (beside / "..").lexically_normal()}) {
    const auto [found, absent] = folders_.try_emplace(folder);
    auto& [records, makers] = found->second;
    if (absent) records = read_folder(folder);
    for (std::size_t i = 0; absent && i < records.size(); ++i)
      for (const auto& [output, sha256] : records[i].outputs) makers.emplace(output, i);
    std::size_t maker = records.size();
    for (const fs::path& name : {wanted, twin})
      if (const auto made = makers.find(name); made != makers.end())
        maker = std::min(maker, made->second);
    if (maker < records.size()) return &records[maker];
  }
  return nullptr;
}

std::optional<std::string> RecordBook::sha256(const fs::path& file) {
  const auto found = hashes_.find(file);
  if (found != hashes_.end()) return found->second;
  std::error_code unreadable;
  std::optional<std::string> hash;
  if (fs::is_regular_file(file, unreadable)) hash = sha256_of_file(file);
  return hashes_.emplace(file, hash).first->second;
}

std::optional<StepRecord> read_made_by(const fs::path& output) {
  if (const fs::path beside = run_record_path(output); fs::is_regular_file(beside))
    return read_step(beside);
  RecordBook book;
  const StepRecord* maker = book.maker_of(output);
  return maker == nullptr ? std::nullopt : std::optional(*maker);
}

void require_as_recorded(const fs::path& output) {
  const std::optional<StepRecord> record = read_made_by(output);
  if (!record) return;
  const fs::path folder = folder_of(output).lexically_normal();
  for (const auto& [file, sha256] : record->outputs) {
    // A run with many sheets lists them all; the others are checked when they are read.
    const fs::path place = folder_of(file);
    if (place != folder && place != folder_of(record->file).lexically_normal()) continue;
    if (fs::is_regular_file(file) && sha256_of_file(file) != sha256)
      throw bad_input("this file is not the one that its run wrote", {.file = file.string()},
                      "run the step again, or restore what " + record->file.string() + " lists");
  }
}

std::vector<ChainLink> chain_of(RecordBook& book, const fs::path& file, const std::string& sha256,
                                std::set<fs::path>& followed) {
  std::vector<ChainLink> chain;
  follow(book, file.lexically_normal(), sha256, 0, followed, chain);
  return chain;
}

std::map<fs::path, std::set<std::string>> files_behind(RecordBook& book,
                                                       const std::vector<fs::path>& files) {
  std::map<fs::path, std::set<std::string>> behind;
  std::set<fs::path> known;
  std::vector<fs::path> open;
  open.reserve(files.size());
  for (const fs::path& file : files) open.push_back(file.lexically_normal());
  while (!open.empty()) {
    const fs::path file = open.back();
    open.pop_back();
    if (!known.insert(file).second) continue;
    behind[file];
    const StepRecord* record = book.maker_of(file);
    if (record == nullptr) continue;
    known.insert(record->file.lexically_normal());
    behind[record->file.lexically_normal()];
    for (const auto* list : {&record->inputs, &record->outputs})
      for (const auto& [other, sha256] : *list) {
        behind[other].insert(sha256);
        if (book.sha256(other) == sha256) open.push_back(other);
      }
  }
  return behind;
}

}  // namespace drape::compare
