// SPDX-License-Identifier: Apache-2.0
#include "compare/programs/results_commands.hpp"

int main(int argc, char** argv) {
  CLI::App app("Answers questions about the results store, imports into it and verifies it.",
               "drape-results");
  drape::CommonOptions common;
  drape::compare::ResultsArguments arguments;
  drape::add_common_options(app, common);
  drape::compare::add_commands(app, arguments);
  return drape::run_program(app, argc, argv, common,
                            [&] { return drape::compare::answer(app, arguments, common); });
}
