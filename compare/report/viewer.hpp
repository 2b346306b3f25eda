// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "compare/compare.hpp"

namespace drape::compare {

/// A figure that shows object, virtual sheet and real marks turning under mouse, finger or keys. It
/// is hidden until viewer_scripts() run, so a page with scripts off keeps the still pictures.
[[nodiscard]] std::string viewer_figure(const std::string& drape, const DrapeInput& input,
                                        const RealVirtual& comparison);

/// The scripts that bring all such figures of a page to life: three.js and the viewer's own.
[[nodiscard]] std::vector<std::string> viewer_scripts();

/// Name of a script in a Content-Security-Policy.
[[nodiscard]] std::string script_hash(const std::string& script);

}  // namespace drape::compare
