// SPDX-License-Identifier: Apache-2.0
#include "core/files/toml_file.hpp"

#define TOML_EXCEPTIONS 1
#include <fmt/format.h>
#include <toml++/toml.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape {

struct TomlTable::State {
  std::shared_ptr<const toml::table> root;
  const toml::table* table = nullptr;
  std::filesystem::path file;
  std::string prefix;  ///< "camera." of a nested table
  std::set<std::string> read;
  std::vector<std::shared_ptr<State>> children;

  [[nodiscard]] std::optional<int> line_of(const toml::node* node) const {
    const auto line =
        (node != nullptr ? *node : static_cast<const toml::node&>(*table)).source().begin.line;
    return line == 0 ? std::nullopt : std::optional<int>(static_cast<int>(line));
  }

  [[nodiscard]] Where where(const std::string& key) const {
    return {.file = file.string(), .line = line_of(table->get(key)), .field = prefix + key};
  }

  /// "diameter" of "diameter_mm": what stays when the unit is wrong.
  [[nodiscard]] static std::string stem(const std::string& key) {
    return key.substr(0, key.find('_'));
  }

  [[nodiscard]] const toml::node& need(const std::string& key) {
    read.insert(key);
    if (const toml::node* node = table->get(key)) return *node;
    for (const auto& [other, node] : *table) {
      const std::string name(other.str());
      if (read.count(name) == 0 && name != key && stem(name) == stem(key)) {
        throw bad_input(
            fmt::format("`{}{}` is missing, `{}{}` is not a key here", prefix, key, prefix, name),
            {.file = file.string(), .line = line_of(&node), .field = prefix + name},
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

std::optional<double> finite(const toml::node& node) {
  const std::optional<double> value = node.value<double>();
  if (!node.is_number() || !value || !std::isfinite(*value)) return std::nullopt;
  return value;
}

std::optional<int> whole(const toml::node& node) {
  const std::optional<std::int64_t> value = node.value_exact<std::int64_t>();
  if (!value || std::abs(*value) > std::numeric_limits<int>::max()) return std::nullopt;
  return static_cast<int>(*value);
}

}  // namespace

TomlTable::TomlTable(std::shared_ptr<State> state) : state_(std::move(state)) {}

TomlTable TomlTable::open(const std::filesystem::path& file, const std::string& schema) {
  auto state = std::make_shared<State>();
  state->file = file;
  try {
    state->root = std::make_shared<const toml::table>(toml::parse(read_text(file), file.string()));
  } catch (const toml::parse_error& error) {
    throw bad_input(fmt::format("not a TOML file: {}", error.description()),
                    {.file = file.string(), .line = static_cast<int>(error.source().begin.line)},
                    "correct the line");
  }
  state->table = state->root.get();
  TomlTable table(state);
  const std::string expected = fmt::format("drapebench/{}/1", schema);
  const std::string found = table.text("schema");
  if (found != expected) {
    table.reject("schema",
                 fmt::format("the schema is `{}`, this version reads `{}`", found, expected),
                 "use a newer drapebench, or the right file");
  }
  return table;
}

bool TomlTable::has(const std::string& key) const {
  return state_->table->contains(key);
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
  if (!value) wrong(*this, key, "a whole number");
  return *value;
}

int TomlTable::positive_integer(const std::string& key) const {
  const int value = integer(key);
  if (value <= 0) reject(key, fmt::format("`{}` is {}", key, value), "give a whole number above 0");
  return value;
}

bool TomlTable::boolean_or(const std::string& key, bool otherwise) const {
  if (!has(key)) return otherwise;
  const std::optional<bool> value = state_->need(key).value_exact<bool>();
  if (!value) wrong(*this, key, "true or false");
  return *value;
}

std::string TomlTable::text(const std::string& key) const {
  const std::optional<std::string> value = state_->need(key).value_exact<std::string>();
  if (!value) wrong(*this, key, "a text in quotes");
  return *value;
}

std::string TomlTable::text_or(const std::string& key, const std::string& otherwise) const {
  return has(key) ? text(key) : otherwise;
}

std::vector<double> TomlTable::numbers(const std::string& key, std::size_t count) const {
  const toml::array* array = state_->need(key).as_array();
  const std::string expected = count == 0 ? "an array of finite numbers"
                                          : fmt::format("an array of {} finite numbers", count);
  if (array == nullptr || (count != 0 && array->size() != count)) wrong(*this, key, expected);
  std::vector<double> values;
  for (const toml::node& node : *array) {
    const std::optional<double> value = finite(node);
    if (!value) wrong(*this, key, expected);
    values.push_back(*value);
  }
  return values;
}

std::vector<int> TomlTable::integers(const std::string& key) const {
  const toml::array* array = state_->need(key).as_array();
  if (array == nullptr) wrong(*this, key, "an array of whole numbers");
  std::vector<int> values;
  for (const toml::node& node : *array) {
    const std::optional<int> value = whole(node);
    if (!value) wrong(*this, key, "an array of whole numbers");
    values.push_back(*value);
  }
  return values;
}

std::vector<std::vector<int>> TomlTable::integer_rows(const std::string& key,
                                                      std::size_t width) const {
  const toml::array* array = state_->need(key).as_array();
  const std::string expected = fmt::format("an array of arrays of {} whole numbers", width);
  if (array == nullptr) wrong(*this, key, expected);
  std::vector<std::vector<int>> rows;
  for (const toml::node& row : *array) {
    const toml::array* cells = row.as_array();
    if (cells == nullptr || cells->size() != width) wrong(*this, key, expected);
    rows.emplace_back();
    for (const toml::node& cell : *cells) {
      const std::optional<int> value = whole(cell);
      if (!value) wrong(*this, key, expected);
      rows.back().push_back(*value);
    }
  }
  return rows;
}

std::vector<std::string> TomlTable::texts(const std::string& key) const {
  const toml::array* array = state_->need(key).as_array();
  if (array == nullptr) wrong(*this, key, "an array of texts");
  std::vector<std::string> values;
  for (const toml::node& node : *array) {
    const std::optional<std::string> value = node.value_exact<std::string>();
    if (!value) wrong(*this, key, "an array of texts");
    values.push_back(*value);
  }
  return values;
}

std::filesystem::path TomlTable::file_path(const std::string& key) const {
  return beside(text(key));
}

std::filesystem::path TomlTable::beside(const std::string& relative) const {
  return (state_->file.parent_path() / relative).lexically_normal();
}

TomlTable TomlTable::table(const std::string& key) const {
  const toml::table* found = state_->need(key).as_table();
  if (found == nullptr) wrong(*this, key, "a table");
  auto child = std::make_shared<State>();
  child->root = state_->root;
  child->table = found;
  child->file = state_->file;
  child->prefix = state_->prefix + key + ".";
  state_->children.push_back(child);
  return TomlTable(child);
}

std::optional<TomlTable> TomlTable::optional_table(const std::string& key) const {
  if (!has(key)) return std::nullopt;
  return table(key);
}

std::vector<TomlTable> TomlTable::tables(const std::string& key) const {
  std::vector<TomlTable> result;
  if (!has(key)) return result;
  const toml::array* array = state_->need(key).as_array();
  if (array == nullptr) wrong(*this, key, fmt::format("a list of [[{}]] tables", key));
  for (const toml::node& node : *array) {
    const toml::table* found = node.as_table();
    if (found == nullptr) wrong(*this, key, fmt::format("a list of [[{}]] tables", key));
    auto child = std::make_shared<State>();
    child->root = state_->root;
    child->table = found;
    child->file = state_->file;
    child->prefix = state_->prefix + key + ".";
    state_->children.push_back(child);
    result.push_back(TomlTable(child));
  }
  return result;
}

void TomlTable::reject(const std::string& key, const std::string& what,
                       const std::string& what_to_do) const {
  throw bad_input(what, state_->where(key), what_to_do);
}

void TomlTable::finish() const {
  for (const auto& [key, node] : *state_->table) {
    const std::string name(key.str());
    if (state_->read.count(name) != 0) continue;
    std::string known;
    for (const std::string& other : state_->read) {
      if (State::stem(other) == State::stem(name)) known = other;
    }
    throw bad_input(fmt::format("unknown key `{}{}`", state_->prefix, name),
                    {.file = state_->file.string(),
                     .line = state_->line_of(&node),
                     .field = state_->prefix + name},
                    known.empty()
                        ? "remove it or correct its name"
                        : fmt::format("did you mean `{}`? Units are part of the names", known));
  }
  for (const auto& child : state_->children) TomlTable(child).finish();
}

const std::filesystem::path& TomlTable::file() const {
  return state_->file;
}

}  // namespace drape
