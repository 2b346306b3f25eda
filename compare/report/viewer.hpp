// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "compare/compare.hpp"

namespace drape::compare {

/// A figure that shows object, virtual sheet and real marks turning under mouse, finger or keys. It
/// is hidden until viewer_script() runs, so a page with scripts off keeps the still pictures.
[[nodiscard]] std::string viewer_figure(const std::string& drape, const DrapeInput& input,
                                        const RealVirtual& comparison);

/// The script that brings all such figures of a page to life; no library, no loads.
[[nodiscard]] std::string viewer_script();

}  // namespace drape::compare
