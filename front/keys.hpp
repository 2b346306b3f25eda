// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace drape {

/// `drape help key NAME`: prints the meaning of a key in files that people edit, from the
/// descriptions used for reading them. Returns the exit code.
[[nodiscard]] int help_key(const std::string& name);

}  // namespace drape
