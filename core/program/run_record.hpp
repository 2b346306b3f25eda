// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/files/files.hpp"

namespace drape {

/// Files that a step names before it starts.
struct StepFiles {
  std::vector<std::filesystem::path> outputs, inputs;
};

/// Provenance of one program run (run.json): program, version, arguments, inputs and outputs with
/// SHA-256, times, exit code, hash of the ending. The only file with clock times in it.
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
  void input(const std::filesystem::path& file, std::string sha256);
  void output(const std::filesystem::path& file);
  void option(const std::string& name, const std::string& value);  ///< resolved value

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] const std::vector<std::filesystem::path>& outputs() const { return outputs_; }

  /// Writes the ending, hashes the outputs and writes the record; call last.
  void write(int exit_code, std::string_view ending) const;
  /// For a program that learns only at its end whether and where it keeps a record.
  void write(const std::filesystem::path& file, int exit_code, std::string_view ending = {});

 private:
  void begin();
  void refuse_output(const std::filesystem::path& input) const;

  std::string program_;
  std::vector<std::string> arguments_;
  std::filesystem::path file_;
  std::unique_ptr<WriterLock> lock_;
  std::chrono::system_clock::time_point started_;
  std::vector<std::pair<std::filesystem::path, std::string>> inputs_;
  std::vector<std::filesystem::path> outputs_;
  std::vector<std::pair<std::string, std::string>> options_;
};

/// Where the record of an output lies: `<stem>.run.json` beside it.
[[nodiscard]] std::filesystem::path run_record_path(const std::filesystem::path& output);

/// `<stem>.ending.txt` beside the record: what the program printed for people.
[[nodiscard]] std::filesystem::path ending_path(const std::filesystem::path& record);

/// True when the record exists, was written by the same program file with the same arguments (paths
/// may be spelled differently), ended with exit code 0 or 1, and its ending and all its inputs and
/// outputs, each found under the name that was given, still have the recorded content.
[[nodiscard]] bool is_up_to_date(const std::filesystem::path& record,
                                 const std::filesystem::path& program,
                                 const std::vector<std::string>& arguments);

/// The exit code kept in a record that is_up_to_date().
[[nodiscard]] int recorded_exit_code(const std::filesystem::path& record);

/// "0.1.0"
[[nodiscard]] std::string version();

}  // namespace drape
