// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "core/files/toml_file.hpp"
#include "core/program/similar.hpp"
#include "front/check/check.hpp"

namespace drape {
namespace {

/// The last part of a key: "x_mm" of "object.1.x_mm".
std::string last_of(const std::string& key) {
  return key.substr(key.rfind('.') + 1);
}

/// What a list of stand-ins of this file may speak of: its keys and tables.
std::vector<std::string> values_of(const TomlTable& root) {
  std::vector<std::string> values;
  for (const auto& [key, value] : root.values()) {
    values.push_back(key.substr(0, key.find('.')));
    values.push_back(last_of(key));
  }
  return values;
}

}  // namespace

void check_stand_ins(const std::filesystem::path& file, const std::string& schema,
                     BenchCheck& check) {
  const TomlTable root = TomlTable::open(file, schema);
  if (!root.has("stand_ins")) return;
  std::vector<std::string> known = values_of(root);
  if (schema == "fabric")
    known.insert(known.end(), {"all", "areal density", "tensile curves", "tensile", "shear curves",
                               "shear", "bending curves", "bending", "twist", "bias"});
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  for (const std::string& text : root.texts("stand_ins")) {
    const bool speaks = std::any_of(known.begin(), known.end(), [&](const std::string& value) {
      return value == "all" ? text == value : text.find(value) != std::string::npos;
    });
    if (speaks) continue;
    add(check, file, "stand_ins",
        fmt::format("no value of this file is called as the stand-in `{}`, so nothing counts as "
                    "not measured{}",
                    text, did_you_mean(text, known)),
        schema == "fabric" ? "write e.g. \"shear curves\", \"bending curves\", \"areal density\""
                           : "write the key of the value, e.g. \"friction\"");
  }
}

}  // namespace drape
