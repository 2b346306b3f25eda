// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/fields/value.hpp"

namespace drape {

/// The text as TOML writes it, with its quotes; basic strings have JSON's escapes.
inline std::string toml_quoted(const std::string& text) {
  return one_line(Value(text));
}

}  // namespace drape
