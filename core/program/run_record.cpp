// SPDX-License-Identifier: Apache-2.0
#include "core/program/run_record.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

constexpr int kVersion = 1;

std::string utc(std::chrono::system_clock::time_point time) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}",
                     fmt::gmtime(std::chrono::system_clock::to_time_t(time)));
}

/// The running executable itself, so that a rebuilt program counts as another one.
fs::path this_program() {
  return fs::read_symlink("/proc/self/exe");
}

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

std::string relative_to(const fs::path& folder, const fs::path& file) {
  return fs::proximate(file, folder).generic_string();
}

Json hashes(const fs::path& folder, const std::vector<std::pair<fs::path, std::string>>& files) {
  Json list = Json::array();
  for (const auto& [file, sha256] : files) {
    list.push_back({{"file", relative_to(folder, file)}, {"sha256", sha256}});
  }
  return list;
}

/// Arguments without those that never change a result.
std::vector<std::string> decisive(const std::vector<std::string>& arguments) {
  std::vector<std::string> result;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    if (argument == "--threads") ++i;
    if (argument != "--threads" && argument != "--json" && argument != "--quiet")
      result.push_back(argument);
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

RunRecord::RunRecord(std::string program, std::vector<std::string> arguments)
    : program_(std::move(program)),
      arguments_(std::move(arguments)),
      started_(std::chrono::system_clock::now()) {}

void RunRecord::input(const fs::path& file) {
  inputs_.emplace_back(file, sha256_of_file(file));
}

void RunRecord::input(const fs::path& file, std::string sha256) {
  inputs_.emplace_back(file, std::move(sha256));
}

void RunRecord::output(const fs::path& file) {
  outputs_.push_back(file);
}

void RunRecord::option(const std::string& name, const std::string& value) {
  options_.emplace_back(name, value);
}

void RunRecord::write(const fs::path& file, int exit_code) const {
  const fs::path folder = folder_of(file);
  std::vector<std::pair<fs::path, std::string>> outputs;
  for (const fs::path& output : outputs_) outputs.emplace_back(output, sha256_of_file(output));
  Json json;
  json["schema"] = fmt::format("drapebench/run/{}", kVersion);
  json["program"] = program_;
  json["version"] = version();
  json["program_sha256"] = sha256_of_file(this_program());
  json["arguments"] = arguments_;
  json["options"] = Json::object();
  for (const auto& [name, value] : options_) json["options"][name] = value;
  json["inputs"] = hashes(folder, inputs_);
  json["outputs"] = hashes(folder, outputs);
  json["started_utc"] = utc(started_);
  json["ended_utc"] = utc(std::chrono::system_clock::now());
  json["exit_code"] = exit_code;
  write_json(file, json);
}

fs::path run_record_path(const fs::path& output) {
  fs::path record = output;
  return record.replace_extension(".run.json");
}

bool is_up_to_date(const fs::path& record, const fs::path& program,
                   const std::vector<std::string>& arguments) {
  if (!fs::is_regular_file(record) || !fs::is_regular_file(program)) return false;
  try {
    const JsonNode root = JsonNode::open(record, "run", kVersion);
    const int code = root.integer("exit_code");
    return (code == 0 || code == 1) &&
           decisive(root.at("arguments").raw().get<std::vector<std::string>>()) ==
               decisive(arguments) &&
           root.text("program_sha256") == sha256_of_file(program) &&
           unchanged(folder_of(record), root, "inputs") &&
           unchanged(folder_of(record), root, "outputs");
  } catch (const Error&) {
    return false;  // A damaged record proves nothing, so the step is made anew.
  }
}

int recorded_exit_code(const fs::path& record) {
  return JsonNode::open(record, "run", kVersion).integer("exit_code");
}

std::string version() {
  return DRAPE_VERSION;
}

}  // namespace drape
