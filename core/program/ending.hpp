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

/// The end of a step: the verdict on the measurement, the few numbers that matter, what was
/// rejected and why, what to be careful about, what would help, the next command.
/// `<stem>.ending.json` beside the run record, and what --json prints.
struct Ending {
  bool go = true;
  std::string verdict = {};                                       ///< one sentence
  std::vector<std::pair<std::string, std::string>> numbers = {};  ///< name, value with unit
  std::vector<std::string> rejected = {};  ///< data that were not used, and why, with counts
  std::vector<std::string> warnings = {};  ///< data that were used though something is odd
  std::vector<std::string> advice = {};    ///< steps that would make the next result better
  std::string next_command = {};
  std::string tables = {};  ///< text that people read in front of the verdict
};
void fields(Fields& f, Ending& ending);
template <>
inline constexpr Format format_of<Ending>{"ending", Syntax::json, 1, "verdict of a step"};

/// The ending as people read it.
[[nodiscard]] std::string printed(const Ending& ending);

/// The ending in what a program printed with --json, of another lab's program too: keys that an
/// ending has not are passed over. Nothing where there is none.
[[nodiscard]] std::optional<Ending> ending_in(std::string_view output);

/// `<stem>.ending.json` beside the record.
[[nodiscard]] std::filesystem::path ending_path(const std::filesystem::path& record);

/// The ending that the program of the record kept; nothing where it keeps none, or its file is no
/// ending.
[[nodiscard]] std::optional<Ending> kept_ending(const std::filesystem::path& record);

}  // namespace drape
