// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compare/history/results.hpp"
#include "compare/store/runs.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"

namespace drape::compare {

/// Everything that drape-results can be asked.
struct ResultsArguments {
  std::string store = "results.sqlite", key, second_key, metric, format, sql, file;
  std::filesystem::path calibration = {}, signing_key = {}, damaged = {}, lab = {};
  std::string table = "v_real_vs_virtual";
  std::string by;         ///< key of a trend
  std::string published;  ///< published.csv; empty: the store's own tables
  std::vector<int> mark;  ///< row and column, or empty
  WhyOptions why;
  bool csv = false;
  bool apart = false;  ///< import without comparing
  bool no_recompute = false;
  ResultFilter filter;
  TrendOptions trend;
  std::vector<std::filesystem::path> sheets;
  RunLabel label;
};

/// Adds the commands and their options.
void add_commands(Command& app, ResultsArguments& arguments);

/// Answers the command that was given; returns the exit code.
int answer(const Command& app, const ResultsArguments& arguments, const CommonOptions& common);

}  // namespace drape::compare
