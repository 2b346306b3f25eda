// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "compare/history/results.hpp"
#include "compare/store/runs.hpp"
#include "core/fields/fields.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"

namespace drape::compare {

enum class ExportFormat { csv, json, sql, ro_crate };

/// Arguments of all drape-results commands.
struct ResultsArguments {
  std::string store = "results.sqlite", key, second_key, metric, sql, file;
  std::optional<ExportFormat> format;
  std::filesystem::path calibration = {}, signing_key = {}, damaged = {}, lab = {};
  std::string table = "v_real_vs_virtual";
  std::string by;      ///< key of a trend
  bool paper = false;  ///< selects the paper's tables with its own numbers
  std::string published = "rigs/paper/published.csv";  ///< file of those numbers
  std::optional<std::array<int, 2>> mark;              ///< row and column
  std::array<int, 2> runs = {};
  WhyOptions why;
  bool csv = false;
  bool apart = false;  ///< imports without comparing
  bool no_recompute = false;
  std::optional<double> tolerance_m;  ///< for an import; default: of the last run of these drapes
  ResultFilter filter;
  TrendOptions trend;
  std::vector<std::filesystem::path> sheets;
  RunLabel label;
};

/// Arguments common to all commands.
struct StoreWords {
  std::string store = "results.sqlite";
  bool csv = false;
};
void fields(Fields& f, StoreWords& words);

/// Arguments of one command.
struct CommandWords {
  ResultsArguments arguments;
  std::string command;
};
void fields(Fields& f, CommandWords& words);

/// Arguments of all commands, filled while the command line is parsed.
struct ResultsWords {
  /// Adds the commands and their options.
  explicit ResultsWords(Command& app);
  ResultsWords(const ResultsWords&) = delete;
  ResultsWords& operator=(const ResultsWords&) = delete;
  [[nodiscard]] ResultsArguments of(const std::string& command) const;

  StoreWords all;
  std::deque<CommandWords> commands;
};

/// Executes the given command; returns the exit code.
int answer(const Command& app, const ResultsWords& words, const CommonOptions& common);

}  // namespace drape::compare

template <>
inline constexpr std::string_view drape::names_of<drape::compare::ExportFormat>[] = {
    "csv", "json", "sql", "ro-crate"};
