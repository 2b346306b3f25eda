// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "core/fields/value.hpp"

namespace drape::compare {

/// A page as one file: core/page bundled, `data` under the id `kind` ("report", "history"), and
/// pictures by the name that the data give them. Nothing is fetched, and no other script runs.
[[nodiscard]] std::string page_of(const std::string& title, const std::string& kind,
                                  const Value& data,
                                  const std::map<std::string, std::string>& jpegs = {});

/// Name of a script in a Content-Security-Policy.
[[nodiscard]] std::string script_hash(const std::string& script);

/// The bundle and the style of core/page, as the build made them.
[[nodiscard]] const char* page_script();
[[nodiscard]] const char* page_style();

}  // namespace drape::compare
