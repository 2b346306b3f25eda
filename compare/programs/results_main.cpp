// SPDX-License-Identifier: Apache-2.0
#include "compare/programs/results_commands.hpp"
#include "core/program/command.hpp"

using namespace drape;
using namespace drape::compare;

int main(int argc, char** argv) {
  Command app("Answers questions about the results store, imports into it and verifies it.",
              "drape-results");
  CommonOptions common;
  add_common_options(app, common);
  const ResultsWords words(app);
  return run_program(app, argc, argv, common, [&] { return answer(app, words, common); });
}
