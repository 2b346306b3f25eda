// SPDX-License-Identifier: Apache-2.0
#include "triangulate/plate/measured_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "core/error.hpp"
#include "core/fields/value.hpp"
#include "core/files/files.hpp"

namespace drape::triangulate {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMadeBy = "# Made by `drape object` from ";

/// Key of a line: "x_mm" of "x_mm = -3.0  # centre"; empty if there is none.
std::string key_of(const std::string& line) {
  const std::size_t equals = line.find('=');
  const std::size_t begin = line.find_first_not_of(" \t");
  if (equals == std::string::npos || begin == equals || line[begin] == '#') return {};
  const std::size_t end = line.find_last_not_of(" \t", equals - 1);
  return line.substr(begin, end + 1 - begin);
}

std::string table_of(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(" \t");
  return begin != std::string::npos && line[begin] == '[' ? line.substr(begin) : std::string();
}

/// Rewrites `key = "text"`, a file relative to `scene`, as relative to `folder`.
std::string file_line(const std::string& key, const std::string& line, const fs::path& scene,
                      const fs::path& folder) {
  const std::size_t begin = line.find_first_of("\"'"), end = line.find_last_of("\"'");
  if (begin == std::string::npos || end <= begin + 1)
    throw bad_input("the name of a file is not in quotes on one line",
                    {.file = scene.string(), .field = key}, "write it on a line of its own");
  const fs::path file =
      (scene.parent_path() / line.substr(begin + 1, end - begin - 1)).lexically_normal();
  return fmt::format("{} = {}", key, one_line(Value(fs::proximate(file, folder).generic_string())));
}

}  // namespace

std::string measured_scene(const fs::path& scene, std::size_t object,
                           const std::vector<ObjectValue>& values, const fs::path& folder) {
  std::map<std::string, std::string> wanted;
  for (const ObjectValue& value : values) wanted[value.key] = fmt::format("{:.6f}", value.measured);
  wanted["place_uncertainty_mm"] = fmt::format("{:.6f}", place_uncertainty_mm(values));
  std::string text = fmt::format("{}{}: object {} stands where its plate of tags shows it.\n",
                                 kMadeBy, scene.filename().string(), object);
  std::size_t number = 0;
  bool here = false;
  std::istringstream lines(read_text(scene));
  for (std::string line; std::getline(lines, line);) {
    if (const std::string table = table_of(line); !table.empty()) {
      const bool starts = table.starts_with("[[object]]");
      number += starts;
      here = starts && number == object;
      text += line + "\n";
      if (here)
        for (const auto& [key, value] : wanted) text += fmt::format("{} = {}\n", key, value);
      continue;
    }
    const std::string key = key_of(line);
    if (here && (key.starts_with("tags_") || wanted.count(key) != 0)) continue;
    if (key == "fabric" || key == "print" || key == "file" || key == "tags_target") {
      text += file_line(key, line, scene, folder) + "\n";
      continue;
    }
    text += line + "\n";
  }
  return text;
}

void require_own_scene(const fs::path& file) {
  if (!fs::exists(file) || read_text(file).starts_with(kMadeBy)) return;
  throw usage_error(file.string() + " is there and was not made by drape object",
                    "give --scene-out another name");
}

}  // namespace drape::triangulate
