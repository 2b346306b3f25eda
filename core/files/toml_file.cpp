// SPDX-License-Identifier: Apache-2.0
#include "core/files/toml_file.hpp"

#define TOML_EXCEPTIONS 1
#define TOML_ASSERT(condition) static_cast<void>(0)  // A file must not end a debug build.
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
      const bool uncertainty = name.find("uncertainty") != std::string::npos;
      if (read.count(name) == 0 && name != key && stem(name) == stem(key) && !uncertainty) {
        read.insert(name);  // named here, and not once more as an unknown key
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
  constexpr std::int64_t most = std::numeric_limits<int>::max();
  if (!value || *value > most || *value < -most) return std::nullopt;
  return static_cast<int>(*value);
}

thread_local ProblemCollector* collector = nullptr;

/// `read()`, or `otherwise` after noting why not while problems are collected.
template <class Value, class Read>
Value read_or(Value otherwise, bool guessed, const Read& read) {
  if (collector == nullptr) return read();
  try {
    return read();
  } catch (const Error& problem) {
    collector->note(problem, guessed);
    return otherwise;
  }
}

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

}  // namespace

ProblemCollector::ProblemCollector(std::vector<Error>& problems)
    : problems_(&problems), outer_(collector) {
  collector = this;
}

ProblemCollector::~ProblemCollector() {
  collector = outer_;
}

void ProblemCollector::note(const Error& problem, bool guessed) {
  problems_->push_back(problem);
  guessed_ = guessed_ || guessed;
}

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
  return read_or<double>(kUnknown, false, [&]() -> double {
    const std::optional<double> value = finite(state_->need(key));
    if (!value) wrong(*this, key, "a finite number");
    return *value;
  });
}

double TomlTable::number_or(const std::string& key, double otherwise) const {
  return has(key) ? number(key) : otherwise;
}

double TomlTable::positive(const std::string& key) const {
  return read_or<double>(kUnknown, false, [&]() -> double {
    const double value = number(key);
    if (value <= 0) reject(key, fmt::format("`{}` is {}", key, value), "give a number above 0");
    return value;
  });
}

double TomlTable::not_negative(const std::string& key) const {
  return read_or<double>(kUnknown, false, [&]() -> double {
    const double value = number(key);
    if (value < 0)
      reject(key, fmt::format("`{}` is {}", key, value), "give 0 or a number above it");
    return value;
  });
}

int TomlTable::integer(const std::string& key) const {
  return read_or<int>(1, true, [&]() -> int {
    const std::optional<int> value = whole(state_->need(key));
    if (!value) wrong(*this, key, "a whole number");
    return *value;
  });
}

int TomlTable::positive_integer(const std::string& key) const {
  return read_or<int>(1, true, [&]() -> int {
    const int value = integer(key);
    if (value <= 0)
      reject(key, fmt::format("`{}` is {}", key, value), "give a whole number above 0");
    return value;
  });
}

bool TomlTable::boolean_or(const std::string& key, bool otherwise) const {
  return read_or<bool>(otherwise, true, [&]() -> bool {
    if (!has(key)) return otherwise;
    const std::optional<bool> value = state_->need(key).value_exact<bool>();
    if (!value) wrong(*this, key, "true or false");
    return *value;
  });
}

std::string TomlTable::text(const std::string& key) const {
  return read_or<std::string>({}, true, [&]() -> std::string {
    const std::optional<std::string> value = state_->need(key).value_exact<std::string>();
    if (!value) wrong(*this, key, "a text in quotes");
    return *value;
  });
}

std::string TomlTable::name(const std::string& key) const {
  const std::string found = text(key);
  require_plain_name(found, state_->where(key));
  return found;
}

std::vector<std::string> TomlTable::names(const std::string& key) const {
  const std::vector<std::string> found = texts(key);
  for (const std::string& one : found) require_plain_name(one, state_->where(key));
  return found;
}

std::string TomlTable::text_or(const std::string& key, const std::string& otherwise) const {
  return has(key) ? text(key) : otherwise;
}

std::vector<double> TomlTable::numbers(const std::string& key, std::size_t count) const {
  return read_or<std::vector<double>>(
      std::vector<double>(count, kUnknown), false, [&]() -> std::vector<double> {
        const toml::array* array = state_->need(key).as_array();
        const std::string expected = count == 0
                                         ? "an array of finite numbers"
                                         : fmt::format("an array of {} finite numbers", count);
        if (array == nullptr || (count != 0 && array->size() != count)) wrong(*this, key, expected);
        std::vector<double> values;
        for (const toml::node& node : *array) {
          const std::optional<double> value = finite(node);
          if (!value) wrong(*this, key, expected);
          values.push_back(*value);
        }
        return values;
      });
}

std::vector<int> TomlTable::integers(const std::string& key) const {
  return read_or<std::vector<int>>({}, true, [&]() -> std::vector<int> {
    const toml::array* array = state_->need(key).as_array();
    if (array == nullptr) wrong(*this, key, "an array of whole numbers");
    std::vector<int> values;
    for (const toml::node& node : *array) {
      const std::optional<int> value = whole(node);
      if (!value) wrong(*this, key, "an array of whole numbers");
      values.push_back(*value);
    }
    return values;
  });
}

std::vector<std::vector<int>> TomlTable::integer_rows(const std::string& key,
                                                      std::size_t width) const {
  return read_or<std::vector<std::vector<int>>>({}, true, [&]() -> std::vector<std::vector<int>> {
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
  });
}

std::vector<std::string> TomlTable::texts(const std::string& key) const {
  return read_or<std::vector<std::string>>({}, true, [&]() -> std::vector<std::string> {
    const toml::array* array = state_->need(key).as_array();
    if (array == nullptr) wrong(*this, key, "an array of texts");
    std::vector<std::string> values;
    for (const toml::node& node : *array) {
      const std::optional<std::string> value = node.value_exact<std::string>();
      if (!value) wrong(*this, key, "an array of texts");
      values.push_back(*value);
    }
    return values;
  });
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
    const Error problem = bad_input(
        fmt::format("unknown key `{}{}`", state_->prefix, name),
        {.file = state_->file.string(),
         .line = state_->line_of(&node),
         .field = state_->prefix + name},
        known.empty() ? "remove it or correct its name"
                      : fmt::format("did you mean `{}`? Units are part of the names", known));
    if (collector == nullptr) throw problem;
    collector->note(problem, false);
  }
  for (const auto& child : state_->children) TomlTable(child).finish();
}

namespace {

using Values = std::vector<std::pair<std::string, std::string>>;

void add_values(const toml::node& node, const std::string& path, Values& values) {
  if (const toml::table* table = node.as_table()) {
    for (const auto& [key, member] : *table)
      add_values(member,
                 path.empty() ? std::string(key.str()) : fmt::format("{}.{}", path, key.str()),
                 values);
    return;
  }
  const toml::array* array = node.as_array();
  if (array != nullptr && !array->empty() && array->front().is_table()) {
    for (std::size_t i = 0; i < array->size(); ++i)
      add_values(*array->get(i), fmt::format("{}.{}", path, i + 1), values);
    return;
  }
  if (const auto number = finite(node)) {
    values.emplace_back(path, fmt::format("{}", *number));
    return;
  }
  if (const auto text = node.value_exact<std::string>()) {
    values.emplace_back(path, *text);
    return;
  }
  std::string text;
  if (array != nullptr) {
    for (const toml::node& item : *array) {
      Values one;
      add_values(item, {}, one);
      for (const auto& [name, value] : one) text += (text.empty() ? "" : ", ") + value;
    }
  } else if (const auto boolean = node.value_exact<bool>()) {
    text = *boolean ? "true" : "false";
  }
  values.emplace_back(path, text);
}

}  // namespace

std::vector<std::pair<std::string, std::string>> TomlTable::values() const {
  Values values;
  add_values(*state_->table, {}, values);
  return values;
}

const std::filesystem::path& TomlTable::file() const {
  return state_->file;
}

}  // namespace drape
