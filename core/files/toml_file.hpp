// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace drape {

class Error;

/// While it lives, getters of this thread's tables note what is missing or wrong and go on with a
/// value that no comparison objects to (NaN, 1, an empty text), so that one reading finds all.
/// What a reader then throws because of such a value is no finding of its own: see `guessed`.
class ProblemCollector {
 public:
  explicit ProblemCollector(std::vector<Error>& problems);
  ~ProblemCollector();
  ProblemCollector(const ProblemCollector&) = delete;
  ProblemCollector& operator=(const ProblemCollector&) = delete;

  void note(const Error& problem, bool guessed);
  /// A whole number or a text was made up, which later checks may trip over.
  [[nodiscard]] bool guessed() const { return guessed_; }

 private:
  std::vector<Error>* problems_;
  ProblemCollector* outer_;
  bool guessed_ = false;
};

/// One table of a TOML file that people edit. Every getter names file, line and field in its
/// error; `finish()` refuses keys that nobody asked for, so a misspelt key or a wrong unit
/// suffix is never ignored.
class TomlTable {
 public:
  /// Parses the file and checks `schema = "drapebench/<schema>/1"`.
  static TomlTable open(const std::filesystem::path& file, const std::string& schema);

  [[nodiscard]] bool has(const std::string& key) const;
  [[nodiscard]] double number(const std::string& key) const;  ///< finite
  [[nodiscard]] double number_or(const std::string& key, double otherwise) const;
  [[nodiscard]] double positive(const std::string& key) const;  ///< finite and > 0
  [[nodiscard]] double not_negative(const std::string& key) const;
  [[nodiscard]] int integer(const std::string& key) const;
  [[nodiscard]] int positive_integer(const std::string& key) const;
  [[nodiscard]] bool boolean_or(const std::string& key, bool otherwise) const;
  [[nodiscard]] std::string text(const std::string& key) const;
  /// A text that can be one component of a path (require_plain_name).
  [[nodiscard]] std::string name(const std::string& key) const;
  [[nodiscard]] std::string text_or(const std::string& key, const std::string& otherwise) const;
  /// Array of exactly `count` finite numbers; any length when count is 0.
  [[nodiscard]] std::vector<double> numbers(const std::string& key, std::size_t count = 0) const;
  [[nodiscard]] std::vector<int> integers(const std::string& key) const;
  /// Array of arrays of `width` integers.
  [[nodiscard]] std::vector<std::vector<int>> integer_rows(const std::string& key,
                                                           std::size_t width) const;
  [[nodiscard]] std::vector<std::string> texts(const std::string& key) const;
  [[nodiscard]] std::vector<std::string> names(const std::string& key) const;
  /// A file named in this file, relative to it.
  [[nodiscard]] std::filesystem::path file_path(const std::string& key) const;
  [[nodiscard]] std::filesystem::path beside(const std::string& relative) const;
  [[nodiscard]] TomlTable table(const std::string& key) const;
  [[nodiscard]] std::optional<TomlTable> optional_table(const std::string& key) const;
  /// `[[key]]` tables in file order; empty when absent.
  [[nodiscard]] std::vector<TomlTable> tables(const std::string& key) const;

  /// Throws at a value that is present but wrong, with the line of `key`.
  [[noreturn]] void reject(const std::string& key, const std::string& what,
                           const std::string& what_to_do) const;

  /// Refuses unread keys of this table and of those taken from it.
  void finish() const;

  /// Every value of this table and those in it, under its path ("object.1.x_mm"; tables of a list
  /// count from 1) as text; an array of values in one line.
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> values() const;

  [[nodiscard]] const std::filesystem::path& file() const;

 private:
  struct State;
  explicit TomlTable(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

}  // namespace drape
