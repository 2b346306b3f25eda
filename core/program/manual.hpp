// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace drape {

class Command;

/// The manual page of a program (section 1, macros of man(7)), from the declarations that --help
/// prints. The first sentence of the description becomes the line under NAME; lines that begin with
/// two spaces are printed as they are.
[[nodiscard]] std::string manual_page(const Command& app);

/// For completion, one line per list of words, `<where>\t<word> <word> ...`: the options and
/// subcommands of the program (`<where>` is `.`), the options of each subcommand, and the values
/// of each option that takes one of a list.
[[nodiscard]] std::string completion_words(const Command& app);

}  // namespace drape
