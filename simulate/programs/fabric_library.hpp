// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/program/command.hpp"
#include "core/program/program.hpp"

namespace drape::simulate {

/// The words of `drape fabric list`, `show` and `import`.
struct LibraryArguments {
  std::filesystem::path library, file;  ///< no library: that of the installation
  std::optional<std::filesystem::path> out;
  std::string id, name, format = "kes", bend_unit;
};

void add_library_commands(Command& app, LibraryArguments& arguments);

/// The ending of the subcommand that was given; nothing without one. Writes where `--out` says,
/// with a record of `words`.
[[nodiscard]] std::optional<Ending> run_library_command(const Command& app,
                                                        const LibraryArguments& arguments,
                                                        std::vector<std::string> words);

}  // namespace drape::simulate
