// SPDX-License-Identifier: Apache-2.0
#include "core/files/json_file.hpp"

#include <fmt/format.h>

#include <set>

#include "core/files/files.hpp"

namespace drape {
namespace {

/// Limit on nesting, so that recursive walks through a file do not overflow the stack.
constexpr int kDeepest = 100;
constexpr std::size_t kMostEvents = 16'000'000;  ///< limit on keys, values, begins and ends

bool is_plain_array(const Json& json) {
  if (!json.is_array()) return false;
  for (const Json& item : json) {
    if (item.is_structured() && !is_plain_array(item)) return false;
    if (item.is_string() && item.get_ref<const std::string&>().size() > 24) return false;
  }
  return true;
}

/// JSON on one line. File names may not be UTF-8, but JSON must be.
std::string one_line(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

void print(const Json& json, int indent, std::string& out) {
  const std::string pad(static_cast<std::size_t>(indent) + 1, ' ');
  if (json.is_object() && !json.empty()) {
    out += "{";
    bool first = true;
    for (const auto& [key, value] : json.items()) {
      out += first ? "\n" : ",\n";
      out += pad + one_line(key) + ": ";
      print(value, indent + 1, out);
      first = false;
    }
    out += "\n" + std::string(static_cast<std::size_t>(indent), ' ') + "}";
  } else if (json.is_array() && !json.empty() && !is_plain_array(json)) {
    out += "[";
    bool first = true;
    for (const Json& value : json) {
      out += first ? "\n" : ",\n";
      out += pad;
      print(value, indent + 1, out);
      first = false;
    }
    out += "\n" + std::string(static_cast<std::size_t>(indent), ' ') + "]";
  } else {
    out += one_line(json);
  }
}

}  // namespace

Json parse_json(std::string_view text, const std::string& file) {
  std::vector<std::set<std::string>> keys(kDeepest + 2);  // keys of the open objects by depth
  std::size_t events = 0;
  return Json::parse(text, [&](int depth, Json::parse_event_t event, const Json& value) {
    if (++events > kMostEvents || depth > kDeepest)
      throw bad_input(fmt::format("nested deeper than {} levels or too long", kDeepest),
                      {.file = file}, "give the right file");
    if (event == Json::parse_event_t::object_start) keys[depth + 1].clear();
    if (event == Json::parse_event_t::key && !keys[depth].insert(value).second)
      throw bad_input(fmt::format("the key `{}` stands twice in one object", value), {.file = file},
                      "keep the right one");
    return true;
  });
}

Json try_json(std::string_view text) {
  return Json::parse(text, nullptr, false);
}

std::string pretty(const Json& json) {
  std::string text;
  print(json, 0, text);
  return text + "\n";
}

void write_json(const std::filesystem::path& file, const Json& json) {
  write_durable(file, pretty(json));
}

}  // namespace drape
