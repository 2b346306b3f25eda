// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/files/files.hpp"
#include "core/program/ending.hpp"

namespace drape {

/// Files that a step names before it starts.
struct StepFiles {
  std::vector<std::filesystem::path> outputs, inputs;
};

/// A file as a step read or wrote it.
struct RecordedFile {
  std::string file;    ///< from the folder of the record
  std::string sha256;  ///< SHA-256 of its bytes: proof
  /// SHA-256 of the values that were read: freshness. Comments, spelling and the order of keys
  /// change nothing. Absent where the bytes are the values.
  std::optional<std::string> values_sha256 = {};
  std::vector<std::string> sets = {};  ///< sets of a recording that were read; empty: all
};
void fields(Fields& f, RecordedFile& file);

/// A run record as it is kept.
struct RunFile {
  std::string program, version, program_sha256;
  std::vector<std::string> arguments, decisive_arguments;
  std::vector<std::pair<std::string, std::string>> options;
  std::vector<RecordedFile> inputs, outputs;
  std::string ending_sha256, started_utc, ended_utc;
  int exit_code = 0;

  [[nodiscard]] bool wrote(const std::string& sha256) const;  ///< a file of such bytes
};
void fields(Fields& f, RunFile& run);
template <>
inline constexpr Format format_of<RunFile>{"run", Syntax::json, 2, "what one program did"};

/// Records of version 1 have no hashes of values; they are read, and prove no step up to date.
[[nodiscard]] RunFile read_run_file(const std::filesystem::path& record);

/// The file that a record names, where it is now.
[[nodiscard]] std::filesystem::path place_of(const std::filesystem::path& record,
                                             const RecordedFile& file);

/// Tells whether the file is there with the recorded bytes, or, as an input, with the values that
/// were read.
[[nodiscard]] bool is_as_recorded(const std::filesystem::path& record, const RecordedFile& file);

/// The hash that freshness asks of a file that is read whole: of its values where people write it,
/// else of its bytes.
[[nodiscard]] std::string sha256_as_read(const std::filesystem::path& file);

/// Provenance of one program run (run.json): program, version, arguments, inputs and outputs with
/// their hashes, times, exit code, hash of the ending. The only file with clock times in it.
///
/// A step goes in this order, so that whatever ends it leaves no record of what is not whole: the
/// constructor removes record and ending; outputs are written; write() adds the ending and, last,
/// the record.
class RunRecord {
 public:
  /// `arguments` as given on the command line, without the program's name; `file` is the record, or
  /// empty for a run that keeps none. Holds a lock beside the record: throws Error(bad_input) when
  /// another program writes the same output.
  RunRecord(std::string program, std::vector<std::string> arguments,
            std::filesystem::path file = {});
  /// Throws Error(usage), before anything is touched, where an output is one of the inputs.
  RunRecord(std::string program, std::vector<std::string> arguments, std::filesystem::path file,
            const StepFiles& files);

  /// Hashed now, so before it is read: a file changed in between then counts as changed. Throws
  /// Error(usage) where it is one of the outputs named so far.
  void input(const std::filesystem::path& file);
  /// With the hash of the bytes that were read (Document::sha256()); it takes the place of an
  /// earlier one.
  void input(const std::filesystem::path& file, const std::string& sha256);
  /// A recording.json of which the step reads these sets alone.
  void input_sets(const std::filesystem::path& file, const std::vector<std::string>& sets);
  void output(const std::filesystem::path& file);
  void option(const std::string& name, const std::string& value);  ///< resolved value

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] const std::vector<std::filesystem::path>& outputs() const { return outputs_; }

  /// Writes the ending, hashes the outputs and writes the record; call last.
  void write(int exit_code, const Ending& ending = {}) const;
  /// For a program that learns only at its end whether and where it keeps a record.
  void write(const std::filesystem::path& file, int exit_code, const Ending& ending = {});

 private:
  void begin();
  void refuse_output(const std::filesystem::path& input) const;

  RunFile run_;  ///< with the names of inputs as they were given
  std::filesystem::path file_;
  std::unique_ptr<WriterLock> lock_;
  std::chrono::system_clock::time_point started_;
  std::vector<std::filesystem::path> outputs_;
};

/// Record of an output: `<stem>.run.json` beside it.
[[nodiscard]] std::filesystem::path run_record_path(const std::filesystem::path& output);

/// True when the record exists, was written by the same program file with the same arguments (paths
/// may be spelled differently), ended with exit code 0 or 1, its ending and outputs have the
/// recorded bytes, and its inputs, each found under the name that was given, the values that were
/// read.
[[nodiscard]] bool is_up_to_date(const std::filesystem::path& record,
                                 const std::filesystem::path& program,
                                 const std::vector<std::string>& arguments);

/// "0.1.0"
[[nodiscard]] std::string version();

}  // namespace drape
