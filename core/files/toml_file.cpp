// SPDX-License-Identifier: Apache-2.0
#include "core/files/toml_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "core/error.hpp"
#include "core/fields/records.hpp"
#include "core/files/files.hpp"

namespace drape {

struct TomlTable::State {
  Document document;
  const Value* table = nullptr;
  std::string prefix = {};  ///< "camera." of a nested table
  std::set<std::string> read = {};
  std::vector<std::shared_ptr<State>> children = {};

  [[nodiscard]] Where where(const std::string& key) const {
    const Value* found = table->find(key);
    const int line = found != nullptr ? found->line : table->line;
    return {.file = document.file().string(), .line = line, .field = prefix + key};
  }

  /// "diameter" of "diameter_mm": what stays when the unit is wrong.
  [[nodiscard]] static std::string stem(const std::string& key) {
    return key.substr(0, key.find('_'));
  }

  [[nodiscard]] std::shared_ptr<State> child(const std::string& key, const Value* found) {
    children.push_back(std::make_shared<State>(State{document, found, prefix + key + "."}));
    return children.back();
  }

  [[nodiscard]] const Value& need(const std::string& key) {
    read.insert(key);
    if (const Value* found = table->find(key)) return *found;
    for (const auto& [name, value] : *table->get_if<Value::Table>()) {
      const bool uncertainty = name.find("uncertainty") != std::string::npos;
      if (read.count(name) == 0 && name != key && stem(name) == stem(key) && !uncertainty) {
        throw bad_input(
            fmt::format("`{}{}` is missing, `{}{}` is not a key here", prefix, key, prefix, name),
            where(name),
            fmt::format("units are part of the names: write `{}` and convert the value", key));
      }
    }
    throw bad_input(fmt::format("`{}{}` is missing", prefix, key), where(key),
                    fmt::format("add `{} = ...`", key));
  }
};

namespace {

[[noreturn]] void wrong(const TomlTable& table, const std::string& key,
                        const std::string& expected) {
  table.reject(key, fmt::format("`{}` is not {}", key, expected), fmt::format("give {}", expected));
}

std::optional<double> finite(const Value& value) {
  if (!value.is_number() || !std::isfinite(value.number())) return std::nullopt;
  return value.number();
}

std::optional<int> whole(const Value& value) {
  const auto* found = value.get_if<std::int64_t>();
  constexpr std::int64_t most = 1 << 30;  // tags and marks are counted on from it
  if (found == nullptr || *found > most || *found < -most) return std::nullopt;
  return static_cast<int>(*found);
}

/// The items of an array; throws where it is none, or one item is not `expected`.
template <class Result, class Convert>
std::vector<Result> list_of(const TomlTable& table, const std::string& key, const Value& value,
                            const std::string& expected, const Convert& convert) {
  const auto* items = value.get_if<Value::List>();
  if (items == nullptr) wrong(table, key, expected);
  std::vector<Result> results;
  for (const Value& item : *items) {
    std::optional<Result> result = convert(item);
    if (!result) wrong(table, key, expected);
    results.push_back(std::move(*result));
  }
  return results;
}

std::optional<std::string> text_of_value(const Value& value) {
  const auto* text = value.get_if<std::string>();
  return text == nullptr ? std::nullopt : std::optional(*text);
}

}  // namespace

TomlTable::TomlTable(std::shared_ptr<State> state) : state_(std::move(state)) {}

TomlTable TomlTable::open(const std::filesystem::path& file, const std::string& schema) {
  auto state = std::make_shared<State>(State{Document(file, Syntax::toml, read_text(file))});
  require_format(state->document, {schema, Syntax::toml});
  state->table = &state->document.root();
  state->read.insert("schema");
  return TomlTable(state);
}

bool TomlTable::has(const std::string& key) const {
  return state_->table->find(key) != nullptr;
}

double TomlTable::number(const std::string& key) const {
  const std::optional<double> value = finite(state_->need(key));
  if (!value) wrong(*this, key, "a finite number");
  return *value;
}

double TomlTable::number_or(const std::string& key, double otherwise) const {
  return has(key) ? number(key) : otherwise;
}

double TomlTable::positive(const std::string& key) const {
  const double value = number(key);
  if (value <= 0) reject(key, fmt::format("`{}` is {}", key, value), "give a number above 0");
  return value;
}

double TomlTable::not_negative(const std::string& key) const {
  const double value = number(key);
  if (value < 0) reject(key, fmt::format("`{}` is {}", key, value), "give 0 or a number above it");
  return value;
}

int TomlTable::integer(const std::string& key) const {
  const std::optional<int> value = whole(state_->need(key));
  if (!value) wrong(*this, key, "a whole number up to 2^30");
  return *value;
}

int TomlTable::positive_integer(const std::string& key) const {
  const int value = integer(key);
  if (value <= 0) reject(key, fmt::format("`{}` is {}", key, value), "give a whole number above 0");
  return value;
}

bool TomlTable::boolean_or(const std::string& key, bool otherwise) const {
  if (!has(key)) return otherwise;
  const auto* value = state_->need(key).get_if<bool>();
  if (value == nullptr) wrong(*this, key, "true or false");
  return *value;
}

std::string TomlTable::text(const std::string& key) const {
  const auto* value = state_->need(key).get_if<std::string>();
  if (value == nullptr) wrong(*this, key, "a text");
  return *value;
}

std::string TomlTable::name(const std::string& key) const {
  std::string found = text(key);
  require_plain_name(found, state_->where(key));
  return found;
}

std::string TomlTable::text_or(const std::string& key, const std::string& otherwise) const {
  return has(key) ? text(key) : otherwise;
}

std::vector<double> TomlTable::numbers(const std::string& key, std::size_t count) const {
  const std::string expected =
      fmt::format("an array of {}finite numbers", count ? fmt::format("{} ", count) : "");
  std::vector<double> values = list_of<double>(*this, key, state_->need(key), expected, finite);
  if (count != 0 && values.size() != count) wrong(*this, key, expected);
  return values;
}

std::vector<int> TomlTable::integers(const std::string& key) const {
  return list_of<int>(*this, key, state_->need(key), "an array of whole numbers", whole);
}

std::vector<std::string> TomlTable::texts(const std::string& key) const {
  return list_of<std::string>(*this, key, state_->need(key), "an array of texts", text_of_value);
}

std::filesystem::path TomlTable::file_path(const std::string& key) const {
  return beside(text(key));
}

std::filesystem::path TomlTable::beside(const std::string& relative) const {
  return state_->document.beside(relative);
}

TomlTable TomlTable::table(const std::string& key) const {
  const Value& found = state_->need(key);
  if (found.get_if<Value::Table>() == nullptr) wrong(*this, key, "a table");
  return TomlTable(state_->child(key, &found));
}

std::optional<TomlTable> TomlTable::optional_table(const std::string& key) const {
  return has(key) ? std::optional(table(key)) : std::nullopt;
}

std::vector<TomlTable> TomlTable::tables(const std::string& key) const {
  std::vector<TomlTable> result;
  if (!has(key)) return result;
  for (const Value* one : list_of<const Value*>(
           *this, key, state_->need(key), fmt::format("a list of [[{}]] tables", key),
           [](const Value& item) {
             return item.get_if<Value::Table>() == nullptr ? std::nullopt : std::optional(&item);
           }))
    result.push_back(TomlTable(state_->child(key, one)));
  return result;
}

void TomlTable::reject(const std::string& key, const std::string& what,
                       const std::string& what_to_do) const {
  throw bad_input(what, state_->where(key), what_to_do);
}

void TomlTable::finish() const {
  for (const auto& [name, value] : *state_->table->get_if<Value::Table>()) {
    if (state_->read.count(name) != 0) continue;
    std::string known;
    for (const std::string& other : state_->read)
      if (State::stem(other) == State::stem(name)) known = other;
    throw bad_input(fmt::format("unknown key `{}{}`", state_->prefix, name), state_->where(name),
                    known.empty()
                        ? "remove it or correct its name"
                        : fmt::format("did you mean `{}`? Units are part of the names", known));
  }
  for (const auto& child : state_->children) TomlTable(child).finish();
}

std::vector<std::pair<std::string, std::string>> TomlTable::values() const {
  return flat(*state_->table);
}

const std::filesystem::path& TomlTable::file() const {
  return state_->document.file();
}

}  // namespace drape
