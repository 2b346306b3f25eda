// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/fields/records.hpp"

namespace drape {

/// Result of a step: verdict on the measurement, key numbers, rejected data with reasons, warnings,
/// advice and the next command. Kept as `<stem>.ending.json` beside the run record and printed by
/// --json.
struct Ending {
  bool go = true;
  std::string verdict = {};                                       ///< one sentence
  std::vector<std::pair<std::string, std::string>> numbers = {};  ///< name, and value with unit
  std::vector<std::string> rejected = {};  ///< data that were not used, with reasons and counts
  std::vector<std::string> warnings = {};  ///< unusual conditions of data that were used
  std::vector<std::string> advice = {};    ///< actions that would improve the next result
  std::string next_command = {};
  std::string tables = {};  ///< text printed before the verdict
};
void fields(Fields& f, Ending& ending);
template <>
inline constexpr Format format_of<Ending>{"ending", Syntax::json, 1, "verdict of a step"};

/// Formats the ending for the terminal.
[[nodiscard]] std::string printed(const Ending& ending);

/// Finds the ending in the --json output of a program. Ignores unknown keys, since the program may
/// be another lab's. nullopt if there is none.
[[nodiscard]] std::optional<Ending> ending_in(std::string_view output);

/// Path of the ending beside a record: `<stem>.ending.json`.
[[nodiscard]] std::filesystem::path ending_path(const std::filesystem::path& record);

/// Reads the ending that was stored with a record; nullopt if there is none or it is
/// invalid.
[[nodiscard]] std::optional<Ending> kept_ending(const std::filesystem::path& record);

}  // namespace drape
