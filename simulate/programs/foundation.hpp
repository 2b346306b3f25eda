// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "core/program/program.hpp"
#include "core/sheet.hpp"

namespace drape::simulate {

[[nodiscard]] inline std::optional<std::string> no_go_of(const std::optional<Sheet>& measured) {
  return measured ? measured->no_go : std::nullopt;
}

/// What rests on a measured sheet that is NO-GO is NO-GO, in the words of the first cause.
[[nodiscard]] inline Ending resting_on(const std::optional<std::string>& no_go, Ending ending) {
  if (!no_go) return ending;
  if (!ending.go) ending.rejected.push_back(ending.verdict);
  ending.go = false;
  ending.verdict = "placed by a measured sheet that is NO-GO: " + *no_go;
  return ending;
}

}  // namespace drape::simulate
