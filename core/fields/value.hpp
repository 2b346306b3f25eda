// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace drape {

/// A value of a TOML or JSON file with those in it. Keys keep their order.
class Value {
 public:
  using List = std::vector<Value>;
  using Table = std::vector<std::pair<std::string, Value>>;

  Value() = default;
  Value(bool value) : content_(value) {}
  template <std::integral T>
  Value(T value) : content_(static_cast<std::int64_t>(value)) {}
  Value(double value) : content_(value) {}
  Value(std::string value) : content_(std::move(value)) {}
  Value(std::string_view value) : content_(std::string(value)) {}
  Value(const char* value) : content_(std::string(value)) {}
  Value(List value) : content_(std::move(value)) {}
  Value(Table value) : content_(std::move(value)) {}

  [[nodiscard]] bool is_null() const { return std::holds_alternative<std::nullptr_t>(content_); }
  template <class T>
  [[nodiscard]] const T* get_if() const {
    return std::get_if<T>(&content_);
  }
  template <class T>
  [[nodiscard]] T* get_if() {
    return std::get_if<T>(&content_);
  }
  /// A whole number or one with a fraction; a null pointer for anything else.
  [[nodiscard]] bool is_number() const { return get_if<double>() || get_if<std::int64_t>(); }
  [[nodiscard]] double number() const;

  /// The member of a table; a null pointer where there is none, or no table.
  [[nodiscard]] const Value* find(std::string_view key) const;
  /// The member of a table, added at its end where it is missing; null becomes a table.
  Value& operator[](std::string_view key);
  /// Adds an item to a list; null becomes a list.
  Value& append(Value item);

  int line = 0;  ///< 1-based line of its file; 0: in no file

 private:
  std::variant<std::nullptr_t, bool, std::int64_t, double, std::string, List, Table> content_;
};

/// JSON as drapebench writes it: one key a line, arrays of plain numbers on one line.
[[nodiscard]] std::string pretty(const Value& value);

/// JSON on one line.
[[nodiscard]] std::string one_line(const Value& value);

/// TOML; tables stand behind the plain values, as the format asks.
[[nodiscard]] std::string toml_text(const Value& table);

/// Every plain value under its path ("object.1.x_mm"; tables of a list count from 1) as text; a
/// list of plain values in one line. Keys in alphabetical order.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> flat(const Value& table);

}  // namespace drape
