// SPDX-License-Identifier: Apache-2.0
#include "core/program/run_record.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <algorithm>
#include <cstdio>
#include <ctime>

namespace drape {

using namespace std::chrono;

std::string utc_text(system_clock::time_point time) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(system_clock::to_time_t(time)));
}

std::string date_text(sys_days day) {
  return utc_text(day).substr(0, 10);
}

std::string today() {
  return utc_text().substr(0, 10);
}

std::optional<sys_days> date_in(const std::string& text) {
  int year_number = 0, end = 0;
  unsigned month_number = 0, day_number = 0;
  const int read =
      std::sscanf(text.c_str(), "%4d-%2u-%2u%n", &year_number, &month_number, &day_number, &end);
  const year_month_day date{year(year_number), month(month_number), day(day_number)};
  if (read != 3 || text.size() != 10 || end != 10 || !date.ok()) return std::nullopt;
  return sys_days(date);
}

std::optional<sys_seconds> utc_time_in(const std::string& text) {
  std::tm utc{};
  const char* end = ::strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &utc);
  if (end == nullptr || *end != 0) return std::nullopt;
  return sys_seconds(seconds(::timegm(&utc)));
}

namespace {

enum class Verdict { go, no_go };

}  // namespace

template <>
inline constexpr std::string_view names_of<Verdict>[] = {"GO", "NO-GO"};

void fields(Fields& f, Ending& ending) {
  auto verdict = ending.go ? Verdict::go : Verdict::no_go;
  f({"verdict", "verdict on the measurement"}, verdict);
  ending.go = verdict == Verdict::go;
  f({"sentence", "reason for the verdict in one sentence"}, ending.verdict);
  // Each key may occur once per object.
  std::map<std::string, int> times;
  for (auto& [name, value] : ending.numbers)
    if (const int before = times[name]++; before > 0) name += fmt::format(" ({})", before + 1);
  f.otherwise({"numbers", "values with units, by name"}, ending.numbers);
  f.otherwise({"rejected", "data that were not used, with the reason"}, ending.rejected);
  f.otherwise({"warnings", "data that were used despite an anomaly"}, ending.warnings);
  f.otherwise({"advice", "steps that would improve the next result"}, ending.advice);
  f.otherwise({"next_command", "command to run next"}, ending.next_command);
  f.if_any({"tables", "text printed before the verdict"}, ending.tables);
}

std::string printed(const Ending& ending) {
  std::string text =
      fmt::format("{}{}: {}\n", ending.tables, ending.go ? "GO" : "NO-GO", ending.verdict);
  std::size_t width = 0;
  for (const auto& number : ending.numbers) width = std::max(width, number.first.size());
  for (const auto& [name, value] : ending.numbers)
    text += fmt::format("  {:<{}}  {}\n", name, width, value);
  for (const std::string& line : ending.rejected) text += fmt::format("  rejected: {}\n", line);
  for (const std::string& line : ending.warnings) text += fmt::format("  warning: {}\n", line);
  for (const std::string& line : ending.advice) text += fmt::format("  advice: {}\n", line);
  if (!ending.next_command.empty()) text += fmt::format("  next: {}\n", ending.next_command);
  return text;
}

std::optional<Ending> ending_in(std::string_view output) {
  const std::size_t line = output.starts_with('{') ? 0 : output.find("\n{") + 1;
  if (line == 0 && !output.starts_with('{')) return std::nullopt;
  try {
    const Value printed = json_value(output.substr(line));
    Value known = Value::Table{};
    const Value all = value_of(Ending{.tables = " "});
    for (const auto& [key, unused] : *all.get_if<Value::Table>())
      if (const Value* value = printed.find(key)) known[key] = *value;
    Ending ending;
    if (!faults_of_reading(Document(Syntax::json, known), walk_through(ending)).empty())
      return std::nullopt;
    return ending;
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::filesystem::path ending_path(const std::filesystem::path& record) {
  std::filesystem::path file = record;
  return file.replace_extension().replace_extension(".ending.json");
}

std::optional<Ending> kept_ending(const std::filesystem::path& record) {
  try {
    const std::filesystem::path file = ending_path(record);
    if (!std::filesystem::is_regular_file(file)) return std::nullopt;
    return read_record<Ending>(file);
  } catch (const Error&) {
    return std::nullopt;
  }
}

namespace {

namespace fs = std::filesystem;

/// Hash of the running executable, so that a rebuilt program counts as a different one.
const std::string& program_sha256() {
  static const std::string sha256 = sha256_of_file("/proc/self/exe");
  return sha256;
}

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

/// Relative path that keeps the names of links, so that a redirected link is noticed. Links in the
/// folder itself are followed, since `..` in the result resolves through them.
std::string relative_to(const fs::path& folder, const fs::path& file) {
  return fs::absolute(file)
      .lexically_normal()
      .lexically_relative(fs::weakly_canonical(fs::absolute(folder)))
      .generic_string();
}

/// Hash of the values that were read. Absent if the values are the bytes or the file cannot be
/// parsed; its reader reports why.
std::optional<std::string> hash_of_values(const fs::path& file, const std::string& bytes,
                                          const std::vector<std::string>& sets) {
  const bool is_toml = file.extension() == ".toml";
  if (!is_toml && sets.empty()) return std::nullopt;
  try {
    const Document document(file, is_toml ? Syntax::toml : Syntax::json, bytes);
    if (sets.empty()) return document.values_sha256();
    Value root = document.root();
    if (auto* list = root["sets"].get_if<Value::List>())
      std::erase_if(*list, [&](const Value& set) {
        const auto* text = set.find_as<std::string>("name");
        return text != nullptr && std::find(sets.begin(), sets.end(), *text) == sets.end();
      });
    return Document(Syntax::json, std::move(root)).values_sha256();
  } catch (const Error&) {
    return std::nullopt;
  }
}

/// Both hashes of the file's current content.
RecordedFile recorded(const fs::path& file, std::vector<std::string> sets) {
  if (file.extension() != ".toml" && sets.empty()) return {file.string(), sha256_of_file(file)};
  const std::string bytes = read_text(file);
  RecordedFile result{file.string(), sha256_of(bytes), hash_of_values(file, bytes, sets), {}};
  result.sets = std::move(sets);
  return result;
}

/// Arguments that can change the result. Drops others (another scene of the rig only appears in
/// the message of a NO-GO) and normalises file arguments, so that the current folder does not
/// matter.
std::vector<std::string> decisive(const std::vector<std::string>& arguments,
                                  const fs::path& folder) {
  std::vector<std::string> result;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    const bool is_pair = argument == "--threads" || argument == "--other-scene";
    if (is_pair) ++i;
    if (is_pair || argument == "--json" || argument == "--quiet") continue;
    std::error_code unreachable;
    const bool is_path =
        !argument.empty() && argument.front() != '-' &&
        (argument.find('/') != std::string::npos || fs::exists(argument, unreachable) ||
         fs::absolute(argument).lexically_normal() == fs::absolute(folder).lexically_normal());
    result.push_back(is_path ? relative_to(folder, fs::weakly_canonical(fs::absolute(argument)))
                             : argument);
  }
  return result;
}

}  // namespace

void fields(Fields& f, RecordedFile& file) {
  f({"file", "path from the folder of this record"}, file.file);
  f({"sha256", "SHA-256 of the bytes"}, file.sha256);
  f.if_any({"values_sha256", "SHA-256 of the values read, if it differs"}, file.values_sha256);
  f.if_any({"sets", "sets of a recording that were read; absent if all"}, file.sets);
}

void fields(Fields& f, RunFile& run) {
  f({"program", "e.g. drape-simulate"}, run.program);
  f({"version", "version of drapebench"}, run.version);
  f({"program_sha256", "SHA-256 of the program"}, run.program_sha256);
  f({"arguments", "as given, without the program"}, run.arguments);
  f.otherwise({"decisive_arguments", "arguments that can change the result, with normalised paths"},
              run.decisive_arguments);
  f({"options", "resolved values of the options, by name"}, run.options);
  f({"inputs", "files read"}, run.inputs);
  f({"outputs", "files written"}, run.outputs);
  f.otherwise({"ending_sha256", "SHA-256 of <stem>.ending.json"}, run.ending_sha256);
  f({"started_utc", "start of the run"}, run.started_utc);
  f({"ended_utc", "end of the run"}, run.ended_utc);
  f({"exit_code", "0 GO, 1 NO-GO, 130 interrupted", 1, 0, 255}, run.exit_code);
}

bool RunFile::wrote(const std::string& sha256) const {
  return std::any_of(outputs.begin(), outputs.end(),
                     [&](const RecordedFile& output) { return output.sha256 == sha256; });
}

RunFile read_run_file(const fs::path& record) {
  return read_record<RunFile>(record);
}

fs::path place_of(const fs::path& record, const RecordedFile& file) {
  return folder_of(record) / file.file;
}

bool is_as_recorded(const fs::path& record, const RecordedFile& file) {
  const fs::path place = place_of(record, file);
  if (!fs::is_regular_file(place)) return false;
  return sha256_of_file(place) == file.sha256 ||
         (file.values_sha256 &&
          hash_of_values(place, read_text(place), file.sets) == file.values_sha256);
}

RunRecord::RunRecord(std::string program, std::vector<std::string> arguments, fs::path file,
                     const StepFiles& files)
    : file_(std::move(file)), started_(std::chrono::system_clock::now()), outputs_(files.outputs) {
  run_.program = std::move(program);
  run_.arguments = std::move(arguments);
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
  input_sets(file, {});
}

void RunRecord::input(const fs::path& file, const std::string& sha256) {
  refuse_output(file);
  RecordedFile now = file.extension() == ".toml" && fs::is_regular_file(file)
                         ? recorded(file, {})
                         : RecordedFile{file.string(), sha256};
  if (now.sha256 != sha256) now = {file.string(), sha256};
  for (RecordedFile& known : run_.inputs)
    if (known.file == now.file) return void(known = std::move(now));
  run_.inputs.push_back(std::move(now));
}

void RunRecord::input_sets(const fs::path& file, const std::vector<std::string>& sets) {
  refuse_output(file);
  run_.inputs.push_back(recorded(file, sets));
}

void RunRecord::output(const fs::path& file) {
  outputs_.push_back(file);
}

void RunRecord::option(const std::string& name, const std::string& value) {
  std::erase_if(run_.options, [&](const auto& one) { return one.first == name; });
  run_.options.emplace_back(name, value);
}

void RunRecord::write(int exit_code, const Ending& ending) const {
  if (file_.empty()) return;
  const fs::path folder = folder_of(file_);
  RunFile run = run_;
  for (RecordedFile& input : run.inputs) input.file = relative_to(folder, input.file);
  for (const fs::path& output : outputs_)
    run.outputs.push_back({relative_to(folder, output), sha256_of_file(output)});
  const std::string text = pretty(value_of(ending));
  write_durable(ending_path(file_), text);
  run.version = version();
  run.program_sha256 = program_sha256();
  run.decisive_arguments = decisive(run.arguments, folder_.empty() ? folder : folder_);
  run.ending_sha256 = sha256_of(text);
  run.started_utc = utc_text(started_);
  run.ended_utc = utc_text(std::chrono::system_clock::now());
  run.exit_code = exit_code;
  write_record(file_, run);
}

void RunRecord::write(const fs::path& file, int exit_code, const Ending& ending,
                      const fs::path& folder) {
  file_ = file;
  folder_ = folder;
  begin();
  write(exit_code, ending);
  lock_.reset();  // removes its file before a new folder that holds it is renamed
}

fs::path run_record_path(const fs::path& output) {
  fs::path record = output;
  return record.replace_extension(".run.json");
}

bool is_up_to_date(const fs::path& record, const fs::path& program,
                   const std::vector<std::string>& arguments) {
  if (!fs::is_regular_file(record) || !fs::is_regular_file(program)) return false;
  try {
    const Document document = Document::read(record);
    const auto* kept = document.root().find_as<std::string>("schema");
    if (kept == nullptr || *kept != format_of<RunFile>.schema()) return false;
    const auto run = read_record<RunFile>(document);
    const auto holds = [&](const RecordedFile& file) { return is_as_recorded(record, file); };
    return (run.exit_code == 0 || run.exit_code == 1) &&
           run.decisive_arguments == decisive(arguments, folder_of(record)) &&
           run.program_sha256 == sha256_of_file(program) &&
           run.ending_sha256 == sha256_of_file(ending_path(record)) &&
           std::all_of(run.inputs.begin(), run.inputs.end(), holds) &&
           std::all_of(run.outputs.begin(), run.outputs.end(), holds);
  } catch (const Error&) {
    return false;  // A damaged or older record proves nothing.
  }
}

std::string version() {
  return DRAPE_VERSION;
}

}  // namespace drape
