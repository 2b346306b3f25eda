// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "simulate/study/study.hpp"

namespace drape::simulate {

struct PlanArguments {
  std::string part = "1/1";
};

/// What is odd about the fabrics of a study, each once.
[[nodiscard]] std::vector<std::string> fabric_warnings(const std::vector<StudyCase>& cases);

/// RIG or PLAN, --out, --part, and the subcommand `status`.
void add_plan_options(Command& app, std::filesystem::path& rig, std::filesystem::path& out,
                      PlanArguments& arguments);

/// Throws Error(usage) when --part is given, for the reason `why` it would do nothing.
void require_no_part(const Command& app, const std::string& why);

/// Whether a plan was given and not a rig.
[[nodiscard]] bool is_plan(const Command& app, const std::filesystem::path& rig);

/// `drape study PLAN --part I/N --out DIR` computes one part; `drape study status PLAN --out DIR`
/// counts what is done and writes DIR/study.csv. Exit code.
[[nodiscard]] int run_plan(const Command& app, const std::filesystem::path& plan,
                           const std::filesystem::path& out, const PlanArguments& arguments,
                           const CommonOptions& common);

}  // namespace drape::simulate
