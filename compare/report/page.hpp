// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "core/fields/value.hpp"

namespace drape::compare {

/// A page as one file: bundled core/page, `data` under the id `kind` ("report", "history"), and
/// pictures by the names used in the data. It fetches nothing and runs no other script.
[[nodiscard]] std::string page_of(const std::string& title, const std::string& kind,
                                  const Value& data,
                                  const std::map<std::string, std::string>& jpegs = {});

/// Hash of a script for a Content-Security-Policy.
[[nodiscard]] std::string script_hash(const std::string& script);

/// Bundle and style of core/page, as built.
[[nodiscard]] const char* page_script();
[[nodiscard]] const char* page_style();

}  // namespace drape::compare
