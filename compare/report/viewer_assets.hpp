// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace drape::compare {

/// three.js as the build found it, and viewer.js beside this file: the build writes their text into
/// the program (CMakeLists.txt).
[[nodiscard]] const char* three_js();
[[nodiscard]] const char* three_licence();  ///< its notice, asked for beside every copy
[[nodiscard]] const char* viewer_js();

}  // namespace drape::compare
