// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/fields/records.hpp"
#include "core/files/files.hpp"

namespace drape {

/// Formats a time as "2026-01-31T12:00:00Z".
[[nodiscard]] std::string utc_text(
    std::chrono::system_clock::time_point time = std::chrono::system_clock::now());

/// Formats a day as "2026-01-31".
[[nodiscard]] std::string date_text(std::chrono::sys_days day);
[[nodiscard]] std::string today();  ///< current day, UTC

/// The day written as "2026-01-31"; nullopt for any other text.
[[nodiscard]] std::optional<std::chrono::sys_days> date_in(const std::string& text);

/// The time written by utc_text(); nullopt for any other text.
[[nodiscard]] std::optional<std::chrono::sys_seconds> utc_time_in(const std::string& text);

/// Result of a step: verdict on the measurement, key numbers, rejected data with reasons, warnings,
/// advice and the next command. Kept as `<stem>.ending.json` beside the run record and printed by
/// --json.
struct Ending {
  bool go = true;
  std::string verdict = {};                                       ///< one sentence
  std::vector<std::pair<std::string, std::string>> numbers = {};  ///< name, and value with unit
  std::vector<std::string> rejected = {};  ///< data that were not used, with reasons and counts
  std::vector<std::string> warnings = {};  ///< unusual conditions of data that were used
  std::vector<std::string> advice = {};    ///< actions that would improve the next result
  std::string next_command = {};
  std::string tables = {};  ///< text printed before the verdict
};
void fields(Fields& f, Ending& ending);
template <>
inline constexpr Format format_of<Ending>{"ending", Syntax::json, 1, "verdict of a step"};

/// Formats the ending for the terminal.
[[nodiscard]] std::string printed(const Ending& ending);

/// Finds the ending in the --json output of a program. Ignores unknown keys, since the program may
/// be another lab's. nullopt if there is none.
[[nodiscard]] std::optional<Ending> ending_in(std::string_view output);

/// Path of the ending beside a record: `<stem>.ending.json`.
[[nodiscard]] std::filesystem::path ending_path(const std::filesystem::path& record);

/// Reads the ending that was stored with a record; nullopt if there is none or it is
/// invalid.
[[nodiscard]] std::optional<Ending> kept_ending(const std::filesystem::path& record);

/// Files that a step declares before it starts.
struct StepFiles {
  std::vector<std::filesystem::path> outputs, inputs;
};

/// A file that a step read or wrote.
struct RecordedFile {
  std::string file;    ///< path relative to the folder of the record
  std::string sha256;  ///< SHA-256 of the bytes, which proves the content
  /// SHA-256 of the values that were read; decides whether a result is up to date. Comments,
  /// spelling and the order of keys do not matter. Absent if the values are the bytes.
  std::optional<std::string> values_sha256 = {};
  std::vector<std::string> sets = {};  ///< sets of a recording that were read; empty for all
};
void fields(Fields& f, RecordedFile& file);

/// Content of a run record.
struct RunFile {
  std::string program, version, program_sha256;
  std::vector<std::string> arguments, decisive_arguments;
  std::vector<std::pair<std::string, std::string>> options;
  std::vector<RecordedFile> inputs, outputs;
  std::string ending_sha256, started_utc, ended_utc;
  int exit_code = 0;

  [[nodiscard]] bool wrote(const std::string& sha256) const;  ///< true if an output has this hash
};
void fields(Fields& f, RunFile& run);
template <>
inline constexpr Format format_of<RunFile>{"run", Syntax::json, 2, "what one program did"};

/// Reads a record. Version 1 lacks hashes of values: it never proves a step up to date.
[[nodiscard]] RunFile read_run_file(const std::filesystem::path& record);

/// Current path of a file named in a record.
[[nodiscard]] std::filesystem::path place_of(const std::filesystem::path& record,
                                             const RecordedFile& file);

/// True if the file exists with the recorded bytes or, for an input, with the recorded
/// values.
[[nodiscard]] bool is_as_recorded(const std::filesystem::path& record, const RecordedFile& file);

/// Provenance of one program run (run.json): program, version, arguments, inputs and outputs with
/// their hashes, times, exit code, hash of the ending. No other file contains clock times.
///
/// An interruption at any point leaves no record of incomplete outputs, by the order of a step: the
/// constructor removes record and ending; the step writes its outputs; write() writes the ending
/// and, last, the record.
class RunRecord {
 public:
  /// `arguments` as given on the command line, without the program's name. `file` is the path of
  /// the record, or empty for a run that keeps none. Locks the record: throws Error(bad_input) if
  /// another program is writing the same output, and Error(usage), before any change, if one of the
  /// outputs of `files` is one of its inputs.
  RunRecord(std::string program, std::vector<std::string> arguments,
            std::filesystem::path file = {}, const StepFiles& files = {});

  /// Adds an input and hashes it now, before it is read: a change in between then counts as a
  /// change. Throws Error(usage) if it is one of the outputs named so far.
  void input(const std::filesystem::path& file);
  /// Adds an input with the hash of the bytes that were read (Document::sha256()); replaces an
  /// earlier entry.
  void input(const std::filesystem::path& file, const std::string& sha256);
  /// Adds a recording.json of which the step reads only these sets.
  void input_sets(const std::filesystem::path& file, const std::vector<std::string>& sets);
  void output(const std::filesystem::path& file);
  void option(const std::string& name, const std::string& value);  ///< adds a resolved option

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] const std::vector<std::filesystem::path>& outputs() const { return outputs_; }

  /// Writes the ending, hashes the outputs, and writes the record last.
  void write(int exit_code, const Ending& ending = {}) const;
  /// For a program that knows only at its end whether and where to keep a record. `folder`: the one
  /// that will hold it, if it is written under a temporary name.
  void write(const std::filesystem::path& file, int exit_code, const Ending& ending = {},
             const std::filesystem::path& folder = {});

 private:
  void begin();
  void refuse_output(const std::filesystem::path& input) const;

  RunFile run_;  ///< inputs are named as they were given
  std::filesystem::path file_, folder_;
  std::unique_ptr<WriterLock> lock_;
  std::chrono::system_clock::time_point started_;
  std::vector<std::filesystem::path> outputs_;
};

/// Path of an output's record: `<stem>.run.json` beside it.
[[nodiscard]] std::filesystem::path run_record_path(const std::filesystem::path& output);

/// True if the record exists, was written by the same program binary with the same arguments
/// (paths may be spelled differently) and ended with exit code 0 or 1. Its ending and outputs
/// must have the recorded bytes, and its inputs, looked up under the names given, the recorded
/// values.
[[nodiscard]] bool is_up_to_date(const std::filesystem::path& record,
                                 const std::filesystem::path& program,
                                 const std::vector<std::string>& arguments);

/// Version of drapebench, for example "0.1.0".
[[nodiscard]] std::string version();

}  // namespace drape
