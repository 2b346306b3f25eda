// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "core/files/json_file.hpp"
#include "core/program/dates.hpp"

namespace drape::console {

/// Log of who did what when and with what result: a file of JSON lines that only grows. Each
/// line is on the disk before add() returns. A line torn by a crash is kept but skipped.
/// Thread-safe.
class SessionLog {
 public:
  /// Reads the file if it exists. `clock` returns the UTC time as text.
  explicit SessionLog(
      std::filesystem::path file, std::function<std::string()> clock = [] { return utc_text(); });
  ~SessionLog();
  SessionLog(const SessionLog&) = delete;
  SessionLog& operator=(const SessionLog&) = delete;

  /// Adds "at", "who" and "what" to the fields of `more` and appends the line. Throws
  /// Error(bad_input) with the system's reason if it cannot be written (disk full).
  void add(const std::string& who, const std::string& what, Json more = Json::object());

  [[nodiscard]] std::vector<Json> entries() const;
  [[nodiscard]] std::vector<Json> last(std::size_t most) const;  ///< oldest first
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] int torn() const { return torn_; }  ///< number of incomplete lines

 private:
  std::filesystem::path file_;
  std::function<std::string()> clock_;
  mutable std::mutex mutex_;
  std::vector<Json> entries_;
  int torn_ = 0;
  int descriptor_ = -1;
  bool line_open_ = false;  ///< true if the file ends within a line
};

}  // namespace drape::console
