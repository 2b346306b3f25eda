// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "compare/store/outcome.hpp"
#include "core/fields/fields.hpp"

namespace drape::compare {

/// Arguments of `drape compare`.
struct CompareArguments {
  std::vector<std::filesystem::path> sheets;
  std::filesystem::path calibration, store, report, acceptance;
  std::vector<std::filesystem::path> sensitivities, repeats;
  std::vector<std::string> warnings, not_compared;
  RunLabel label;
  Options options;
};

void fields(Fields& f, CompareArguments& arguments);

}  // namespace drape::compare
