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

/// A value of a TOML or JSON file, with everything nested in it. Keys keep their order.
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
  /// True for an integer or a floating-point number.
  [[nodiscard]] bool is_number() const { return get_if<double>() || get_if<std::int64_t>(); }
  [[nodiscard]] double number() const;

  /// Member of a table; null if there is none or the value is not a table.
  [[nodiscard]] const Value* find(std::string_view key) const;
  /// Member of a table, appended if missing; a null value becomes a table.
  Value& operator[](std::string_view key);
  /// Appends an item to a list; a null value becomes a list.
  Value& append(Value item);

  int line = 0;  ///< 1-based line in its file; 0 if it comes from no file

 private:
  std::variant<std::nullptr_t, bool, std::int64_t, double, std::string, List, Table> content_;
};

/// JSON in the layout of drapebench: one key per line, arrays of plain numbers on one line.
[[nodiscard]] std::string pretty(const Value& value);

/// JSON on one line.
[[nodiscard]] std::string one_line(const Value& value);

/// TOML text; tables follow the plain values, as the format requires.
[[nodiscard]] std::string toml_text(const Value& table);

/// Every plain value as text, with its path ("object.1.x_mm"; tables in a list count from 1). A
/// list of plain values is one entry. Paths are in alphabetical order.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> flat(const Value& table);

}  // namespace drape
