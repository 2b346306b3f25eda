// SPDX-License-Identifier: Apache-2.0
#include "front/keys.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "core/error.hpp"
#include "core/program/program.hpp"
#include "core/program/similar.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"

namespace drape {
namespace {

/// One location of a key: "scene.toml", "pin.at_material_mm", its meaning and range.
struct KeyPlace {
  std::string file, path, meaning;
};

template <class T>
std::string text_of(const Value& schema, std::string_view member) {
  const Value* found = schema.find(member);
  const T* value = found == nullptr ? nullptr : found->get_if<T>();
  return value == nullptr ? std::string() : fmt::format("{}", *value);
}

/// The meaning, and the values that are allowed.
std::string meaning_of(const Value& schema) {
  std::string text = text_of<std::string>(schema, "description");
  const std::string least = text_of<double>(schema, "minimum");
  const std::string most = text_of<double>(schema, "maximum");
  if (!least.empty() && !most.empty())
    text += fmt::format("; {} to {}", least, most);
  else if (!least.empty())
    text += fmt::format("; at least {}", least);
  else if (!most.empty())
    text += fmt::format("; at most {}", most);
  if (const Value* words = schema.find("enum"))
    if (const auto* list = words->get_if<Value::List>()) {
      std::vector<std::string> all;
      for (const Value& word : *list)
        if (const auto* one = word.get_if<std::string>()) all.push_back("\"" + *one + "\"");
      text += fmt::format("; {}", fmt::join(all, ", "));
    }
  return text;
}

/// Collects the keys under a part of a schema, in lists and alternatives too.
void collect(const Value& schema, const std::string& file, const std::string& path,
             std::vector<KeyPlace>& places) {
  if (const Value* properties = schema.find("properties"))
    if (const auto* table = properties->get_if<Value::Table>())
      for (const auto& [key, value] : *table) {
        const std::string below = path.empty() ? key : path + "." + key;
        std::string meaning = meaning_of(value);
        if (const Value* any = value.find("anyOf"); any != nullptr && meaning.empty())
          if (const auto* list = any->get_if<Value::List>(); list != nullptr && !list->empty())
            meaning = meaning_of(list->front());
        const KeyPlace place{file, below, meaning};
        const auto is_same = [&](const KeyPlace& one) {
          return one.file == file && one.path == below && one.meaning == meaning;
        };
        if (std::none_of(places.begin(), places.end(), is_same)) places.push_back(place);
        collect(value, file, below, places);
      }
  if (const Value* items = schema.find("items")) collect(*items, file, path, places);
  for (const char* several : {"anyOf", "oneOf", "allOf"})
    if (const Value* all = schema.find(several))
      if (const auto* list = all->get_if<Value::List>())
        for (const Value& one : *list) collect(one, file, path, places);
}

template <class Record>
void collect_format(std::vector<KeyPlace>& places) {
  Record record{};
  const Value schema = schema_of(format_of<Record>, walk_through(record));
  collect(schema, std::string(format_of<Record>.name) + ".toml", "", places);
}

}  // namespace

int help_key(const std::string& name) {
  std::vector<KeyPlace> places;
  collect_format<Rig>(places);
  collect_format<Target>(places);
  collect_format<Print>(places);
  collect_format<Scene>(places);
  std::vector<std::string> names;
  bool found = false;
  for (const KeyPlace& place : places) {
    const std::string key = place.path.substr(place.path.rfind('.') + 1);
    names.push_back(key);
    if (key != name && place.path != name) continue;
    print_text(fmt::format("{}  {}: {}\n", place.file, place.path, place.meaning));
    found = true;
  }
  if (!found)
    throw usage_error(
        fmt::format("`{}` is no key of rig.toml, target.toml, print.toml or a scene{}", name,
                    did_you_mean(name, names)),
        "keys of cameras.toml stand in capture/README.md, of a fabric in "
        "simulate/fabric/README.md");
  return 0;
}

}  // namespace drape
