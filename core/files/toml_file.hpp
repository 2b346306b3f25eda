// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace drape {

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
  [[nodiscard]] std::vector<std::string> texts(const std::string& key) const;
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
