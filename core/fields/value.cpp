// SPDX-License-Identifier: Apache-2.0
#include "core/fields/value.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace drape {
namespace {

constexpr std::size_t kLongestInline = 24;  ///< bytes of the longest text in a one-line list

/// True for a list that is printed on one line.
bool is_plain(const Value& value) {
  const auto* list = value.get_if<Value::List>();
  return list != nullptr && std::all_of(list->begin(), list->end(), [](const Value& item) {
           if (item.get_if<Value::Table>() != nullptr) return false;
           if (item.get_if<Value::List>() != nullptr) return is_plain(item);
           const auto* text = item.get_if<std::string>();
           return text == nullptr || text->size() <= kLongestInline;
         });
}

/// Quotes text as JSON. File names may not be UTF-8, but JSON must be.
std::string quoted(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string scalar(const Value& value) {
  if (const auto* truth = value.get_if<bool>()) return *truth ? "true" : "false";
  if (const auto* whole = value.get_if<std::int64_t>()) return fmt::format_int(*whole).str();
  if (const auto* number = value.get_if<double>()) return nlohmann::json(*number).dump();
  if (const auto* text = value.get_if<std::string>()) return quoted(*text);
  return "null";
}

/// `indent` is that of the current line; negative prints everything on one line.
void print(const Value& value, int indent, std::string& out) {
  const auto* table = value.get_if<Value::Table>();
  const auto* list = value.get_if<Value::List>();
  if (table == nullptr && list == nullptr) {
    out += scalar(value);
    return;
  }
  const bool inside = indent < 0 || (list != nullptr && is_plain(value));
  const int deeper = inside ? -1 : indent + 1;
  const std::string separator =
      inside ? "," : ",\n" + std::string(static_cast<std::size_t>(deeper), ' ');
  const std::string first = separator.substr(1);
  const std::string last = inside ? "" : "\n" + std::string(static_cast<std::size_t>(indent), ' ');
  const std::size_t size = table != nullptr ? table->size() : list->size();
  out += table != nullptr ? '{' : '[';
  for (std::size_t i = 0; i < size; ++i) {
    out += i == 0 ? first : separator;
    if (table != nullptr) out += quoted((*table)[i].first) + (indent < 0 ? ":" : ": ");
    print(table != nullptr ? (*table)[i].second : (*list)[i], deeper, out);
  }
  if (size > 0) out += last;
  out += table != nullptr ? '}' : ']';
}

bool is_list_of_tables(const Value& value) {
  const auto* list = value.get_if<Value::List>();
  return list != nullptr && !list->empty() && list->front().get_if<Value::Table>() != nullptr;
}

void print_toml(const Value& value, const std::string& path, std::string& out) {
  const auto& table = *value.get_if<Value::Table>();
  for (const auto& [key, member] : table)
    if (!member.is_null() && member.get_if<Value::Table>() == nullptr && !is_list_of_tables(member))
      out += fmt::format("{} = {}\n", key, one_line(member));
  for (const auto& [key, member] : table) {
    const std::string name = path.empty() ? key : path + "." + key;
    if (member.get_if<Value::Table>() != nullptr) {
      out += fmt::format("\n[{}]\n", name);
      print_toml(member, name, out);
    } else if (is_list_of_tables(member)) {
      for (const Value& item : *member.get_if<Value::List>()) {
        out += fmt::format("\n[[{}]]\n", name);
        print_toml(item, name, out);
      }
    }
  }
}

std::string flat_text(const Value& value) {
  if (value.is_number()) return fmt::format("{}", value.number());
  if (const auto* text = value.get_if<std::string>()) return *text;
  if (const auto* truth = value.get_if<bool>()) return *truth ? "true" : "false";
  std::string joined;
  if (const auto* list = value.get_if<Value::List>())
    for (const Value& item : *list) joined += (joined.empty() ? "" : ", ") + flat_text(item);
  return joined;
}

void add_flat(const Value& value, const std::string& path,
              std::vector<std::pair<std::string, std::string>>& found) {
  if (const auto* table = value.get_if<Value::Table>()) {
    std::vector<const std::pair<std::string, Value>*> sorted;
    for (const auto& member : *table) sorted.push_back(&member);
    std::sort(sorted.begin(), sorted.end(),
              [](const auto* a, const auto* b) { return a->first < b->first; });
    for (const auto* member : sorted)
      add_flat(member->second, path.empty() ? member->first : path + "." + member->first, found);
  } else if (is_list_of_tables(value)) {
    std::size_t number = 0;
    for (const Value& item : *value.get_if<Value::List>())
      add_flat(item, fmt::format("{}.{}", path, ++number), found);
  } else {
    found.emplace_back(path, flat_text(value));
  }
}

}  // namespace

double Value::number() const {
  const auto* whole = get_if<std::int64_t>();
  return whole != nullptr ? static_cast<double>(*whole) : std::get<double>(content_);
}

const Value* Value::find(std::string_view key) const {
  if (const auto* table = get_if<Table>())
    for (const auto& [name, value] : *table)
      if (name == key) return &value;
  return nullptr;
}

Value& Value::operator[](std::string_view key) {
  if (is_null()) content_ = Table{};
  auto& table = std::get<Table>(content_);
  for (auto& [name, value] : table)
    if (name == key) return value;
  return table.emplace_back(key, Value()).second;
}

Value& Value::append(Value item) {
  if (is_null()) content_ = List{};
  return std::get<List>(content_).emplace_back(std::move(item));
}

std::string pretty(const Value& value) {
  std::string text;
  print(value, 0, text);
  return text + "\n";
}

std::string one_line(const Value& value) {
  std::string text;
  print(value, -1, text);
  return text;
}

std::string toml_text(const Value& table) {
  std::string text;
  print_toml(table, "", text);
  return text;
}

std::vector<std::pair<std::string, std::string>> flat(const Value& table) {
  std::vector<std::pair<std::string, std::string>> found;
  add_flat(table, "", found);
  return found;
}

}  // namespace drape
