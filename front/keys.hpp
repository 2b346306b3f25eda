// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace drape {

/// `drape help key NAME`: prints what a key of the files that people edit means, from the
/// descriptions by which those files are read. Returns the exit code.
[[nodiscard]] int help_key(const std::string& name);

}  // namespace drape
