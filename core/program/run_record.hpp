// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace drape {

/// A file and its content at the time of the run.
struct FileHash {
  std::string path;  ///< relative to the folder of the run record
  std::string sha256;
};

/// Provenance of one program run (run.json): program, version, arguments, inputs and outputs with
/// SHA-256, times, exit code. The only file with clock times in it.
class RunRecord {
 public:
  /// `arguments` as given on the command line, without the program's name.
  RunRecord(std::string program, std::vector<std::string> arguments);

  void input(const std::filesystem::path& file);
  void input(const std::filesystem::path& file, std::string sha256);  ///< hash already known
  void output(const std::filesystem::path& file);
  void option(const std::string& name, const std::string& value);  ///< resolved value

  /// Hashes the outputs and writes the record durably; call last.
  void write(const std::filesystem::path& file, int exit_code) const;

 private:
  std::string program_;
  std::vector<std::string> arguments_;
  std::chrono::system_clock::time_point started_;
  std::vector<std::pair<std::filesystem::path, std::string>> inputs_;
  std::vector<std::filesystem::path> outputs_;
  std::vector<std::pair<std::string, std::string>> options_;
};

/// Where the record of an output lies: `<stem>.run.json` beside it.
[[nodiscard]] std::filesystem::path run_record_path(const std::filesystem::path& output);

/// True when the record exists, was written by the same program file with the same arguments,
/// ended with exit code 0 or 1, and all its inputs and outputs still have the recorded content.
[[nodiscard]] bool is_up_to_date(const std::filesystem::path& record,
                                 const std::filesystem::path& program,
                                 const std::vector<std::string>& arguments);

/// The exit code kept in a record that is_up_to_date().
[[nodiscard]] int recorded_exit_code(const std::filesystem::path& record);

/// "0.1.0"
[[nodiscard]] std::string version();

}  // namespace drape
