// SPDX-License-Identifier: Apache-2.0
#include "core/program/run_record.hpp"

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/files/json_file.hpp"
#include "core/program/dates.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

constexpr int kRunVersion = 1;

/// Of the running executable itself, so that a rebuilt program counts as another one.
const std::string& program_sha256() {
  static const std::string sha256 = sha256_of_file("/proc/self/exe");
  return sha256;
}

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

/// Names of links stay as they are, so that a link that was pointed elsewhere is noticed. The
/// folder's own links are followed, because `..` in the name will be.
std::string relative_to(const fs::path& folder, const fs::path& file) {
  return fs::absolute(file)
      .lexically_normal()
      .lexically_relative(fs::weakly_canonical(folder))
      .generic_string();
}

Json hashes(const fs::path& folder, const std::vector<std::pair<fs::path, std::string>>& files) {
  Json list = Json::array();
  for (const auto& [file, sha256] : files)
    list.push_back({{"file", relative_to(folder, file)}, {"sha256", sha256}});
  return list;
}

/// Arguments without those that never change a result; those that name files in one spelling,
/// whatever folder the program was called from.
std::vector<std::string> decisive(const std::vector<std::string>& arguments,
                                  const fs::path& folder) {
  std::vector<std::string> result;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    if (argument == "--threads") ++i;
    if (argument == "--threads" || argument == "--json" || argument == "--quiet") continue;
    std::error_code unreachable;
    const bool is_path =
        !argument.empty() && argument.front() != '-' &&
        (argument.find('/') != std::string::npos || fs::exists(argument, unreachable));
    result.push_back(is_path ? relative_to(folder, fs::weakly_canonical(argument)) : argument);
  }
  return result;
}

bool unchanged(const fs::path& folder, const JsonNode& root, const std::string& key) {
  for (const JsonNode& item : root.items(key)) {
    const fs::path file = folder / item.text("file");
    if (!fs::is_regular_file(file) || sha256_of_file(file) != item.text("sha256")) return false;
  }
  return true;
}

}  // namespace

RunRecord::RunRecord(std::string program, std::vector<std::string> arguments, fs::path file)
    : RunRecord(std::move(program), std::move(arguments), std::move(file), StepFiles{}) {}

RunRecord::RunRecord(std::string program, std::vector<std::string> arguments, fs::path file,
                     const StepFiles& files)
    : program_(std::move(program)),
      arguments_(std::move(arguments)),
      file_(std::move(file)),
      started_(std::chrono::system_clock::now()),
      outputs_(files.outputs) {
  for (const fs::path& output : files.outputs) require_replaceable(output);
  for (const fs::path& input : files.inputs) refuse_output(input);
  for (const fs::path& input : files.inputs) this->input(input);
  begin();
}

void RunRecord::refuse_output(const fs::path& input) const {
  for (const fs::path& output : outputs_) {
    if (fs::weakly_canonical(output) != fs::weakly_canonical(input)) continue;
    throw usage_error(
        fmt::format("{} would be written over {}, which is read", output.string(), input.string()),
        "give another place for what is written");
  }
}

void RunRecord::begin() {
  if (file_.empty()) return;
  lock_ =
      std::make_unique<WriterLock>(folder_of(file_) / ("." + file_.filename().string() + ".lock"),
                                   fmt::format("another program is writing {}", file_.string()));
  remove_durable(file_);
  remove_durable(ending_path(file_));
}

void RunRecord::input(const fs::path& file) {
  input(file, sha256_of_file(file));
}

void RunRecord::input(const fs::path& file, std::string sha256) {
  refuse_output(file);
  for (auto& [known, hash] : inputs_)
    if (known == file) return void(hash = std::move(sha256));
  inputs_.emplace_back(file, std::move(sha256));
}

void RunRecord::output(const fs::path& file) {
  outputs_.push_back(file);
}

void RunRecord::option(const std::string& name, const std::string& value) {
  options_.emplace_back(name, value);
}

void RunRecord::write(int exit_code, std::string_view ending) const {
  if (file_.empty()) return;
  const fs::path folder = folder_of(file_);
  std::vector<std::pair<fs::path, std::string>> outputs;
  for (const fs::path& output : outputs_) outputs.emplace_back(output, sha256_of_file(output));
  write_durable(ending_path(file_), ending);
  Json json;
  json["schema"] = fmt::format("drapebench/run/{}", kRunVersion);
  json["program"] = program_;
  json["version"] = version();
  json["program_sha256"] = program_sha256();
  json["arguments"] = arguments_;
  json["decisive_arguments"] = decisive(arguments_, folder);
  json["options"] = Json::object();
  for (const auto& [name, value] : options_) json["options"][name] = value;
  json["inputs"] = hashes(folder, inputs_);
  json["outputs"] = hashes(folder, outputs);
  json["ending_sha256"] = sha256_of(ending);
  json["started_utc"] = utc_text(started_);
  json["ended_utc"] = utc_text(std::chrono::system_clock::now());
  json["exit_code"] = exit_code;
  write_json(file_, json);
}

void RunRecord::write(const fs::path& file, int exit_code, std::string_view ending) {
  file_ = file;
  begin();
  write(exit_code, ending);
}

fs::path run_record_path(const fs::path& output) {
  fs::path record = output;
  return record.replace_extension(".run.json");
}

fs::path ending_path(const fs::path& record) {
  fs::path file = record;
  return file.replace_extension().replace_extension(".ending.txt");
}

bool is_up_to_date(const fs::path& record, const fs::path& program,
                   const std::vector<std::string>& arguments) {
  if (!fs::is_regular_file(record) || !fs::is_regular_file(program)) return false;
  try {
    const JsonNode root = JsonNode::open(record, "run", kRunVersion);
    const fs::path folder = folder_of(record);
    const int code = root.integer("exit_code");
    return (code == 0 || code == 1) &&
           root.texts("decisive_arguments") == decisive(arguments, folder) &&
           root.text("program_sha256") == sha256_of_file(program) &&
           root.text("ending_sha256") == sha256_of_file(ending_path(record)) &&
           unchanged(folder, root, "inputs") && unchanged(folder, root, "outputs");
  } catch (const Error&) {
    return false;  // A damaged record, or one of an older version, proves nothing.
  }
}

int recorded_exit_code(const fs::path& record) {
  return JsonNode::open(record, "run", kRunVersion).integer("exit_code");
}

std::string version() {
  return DRAPE_VERSION;
}

}  // namespace drape
