// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "compare/store/outcome.hpp"

namespace drape {
class Command;
}

namespace drape::compare {

/// What `drape-compare` is called with.
struct CompareArguments {
  std::vector<std::filesystem::path> sheets;
  std::filesystem::path calibration, store, report, acceptance;
  std::vector<std::filesystem::path> sensitivities, repeats;
  std::vector<std::string> warnings, not_compared;
  RunLabel label;
  double max_sigma_percent = 10;
  Options options;
};

void add_compare_options(Command& app, CompareArguments& arguments);

}  // namespace drape::compare
