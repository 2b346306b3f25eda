// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <chrono>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "core/error.hpp"

namespace drape::compare {

/// Cell of a row: NULL, INTEGER, REAL or TEXT.
struct Cell : std::variant<std::monostate, std::int64_t, double, std::string> {
  Cell() = default;
  Cell(std::nullopt_t /*null*/) {}
  Cell(std::integral auto number) : variant(static_cast<std::int64_t>(number)) {}
  Cell(double number) : variant(number) {}
  Cell(std::string text) : variant(std::move(text)) {}
  Cell(const char* text) : variant(std::string(text)) {}
  template <class T>
  Cell(const std::optional<T>& value) {
    if (value) *this = Cell(*value);
  }

  [[nodiscard]] bool is_null() const { return index() == 0; }
  /// A number is converted if requested as another kind of number, and NULL if requested as text.
  void to(std::string& text) const;
  template <class T>
  requires std::is_arithmetic_v<T>
  void to(T& number) const {
    const auto* real = std::get_if<double>(this);
    const auto* whole = std::get_if<std::int64_t>(this);
    number =
        real != nullptr ? static_cast<T>(*real) : static_cast<T>(whole != nullptr ? *whole : 0);
  }
  template <class T>
  void to(std::optional<T>& value) const {
    if (!is_null()) to(value.emplace());
  }
};
using Cells = std::vector<Cell>;

/// A length in millimetres, NULL if absent.
[[nodiscard]] Cell in_mm(const std::optional<double>& length_m);

template <class... Types>
std::vector<std::tuple<Types...>> typed(const std::vector<Cells>& rows) {
  std::vector<std::tuple<Types...>> all(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    std::apply([&, at = rows[i].begin()](auto&... cell) mutable { ((at++)->to(cell), ...); },
               all[i]);
  return all;
}

[[nodiscard]] Cell cell_of(const SQLite::Column& value);
void bind_all(SQLite::Statement& statement, const Cells& parameters);
/// The remaining rows of a statement.
[[nodiscard]] std::vector<Cells> rest_of(SQLite::Statement& statement);
[[nodiscard]] std::vector<Cells> cells_of(SQLite::Database& database, const std::string& sql,
                                          const Cells& parameters = {});
/// Rows of a query as tuples, e.g. rows_of<std::string, double>(...).
template <class... Types>
std::vector<std::tuple<Types...>> rows_of(SQLite::Database& database, const std::string& sql,
                                          const Cells& parameters = {}) {
  return typed<Types...>(cells_of(database, sql, parameters));
}
/// The first cell of the first row, if there is one.
template <class T>
std::optional<T> first_of(SQLite::Database& database, const std::string& sql,
                          const Cells& parameters = {}) {
  std::optional<T> first;
  if (const auto rows = cells_of(database, sql, parameters); !rows.empty()) rows[0][0].to(first);
  return first;
}
/// Runs a statement without result rows; returns the number of rows changed.
int execute(SQLite::Database& database, const std::string& sql, const Cells& parameters = {});

/// Longest time for which this process waits for other programs at a store, from its first wait
/// until it succeeds.
inline std::chrono::milliseconds store_patience{60000};
/// Makes this connection wait as above.
void wait_for_others(SQLite::Database& database);
/// Ends a wait.
void stop_waiting();
/// Tests whether another program holds what was requested, and waits briefly if patience is left;
/// false if it is not, or for another error.
bool wait_after(const SQLite::Exception& exception);

/// Error with one clear sentence for what SQLite reported about the store.
[[nodiscard]] Error store_error(const std::filesystem::path& file,
                                const SQLite::Exception& exception);

/// Error for rows that differ from their manifest; `altered` names one.
[[nodiscard]] Error not_as_written(const std::filesystem::path& file, const std::string& altered);

}  // namespace drape::compare
