// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/fields/value.hpp"

namespace drape {

/// Quotes text for TOML, whose basic strings use the escapes of JSON.
inline std::string toml_quoted(const std::string& text) {
  return one_line(Value(text));
}

}  // namespace drape
