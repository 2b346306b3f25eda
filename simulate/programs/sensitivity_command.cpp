// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <span>

#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/run_inputs.hpp"
#include "simulate/start/start_file.hpp"
#include "simulate/study/split.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;
using units::mm;

namespace {
struct SensitivityArguments {
  fs::path scene, out, reference;
  std::optional<fs::path> fabric, start;
  int grid = 21;
  CurveFit fit = CurveFit::drape;
  SimulateOptions options;
  SplitOptions split{.scene_values = true};
};

Ending ending_of(const ErrorSplit& split, const fs::path& out) {
  Ending ending;
  const SplitRow& base = split.rows.front();
  ending.go = base.at_rest && split.sensitivities.has_value();
  ending.verdict = !base.at_rest ? "the base: " + split.base_sentence
                   : ending.go   ? fmt::format("mean distance {:.3f} mm over {} marks",
                                               base.distance_m / mm, split.marks.size())
                                 : "the base is a saddle: it has no first-order answer";
  if (split.sensitivities)
    for (const Sensitivity& one : *split.sensitivities)
      ending.numbers.push_back(
          {name_of(one.value) + " +1 %",
           fmt::format("{:+.4f} mm, marks move by {:.4f} mm", 0.01 * one.distance_m / mm,
                       0.01 * one.mean_moved_m / mm)});
  for (const SplitRow& row : std::span(split.rows).subspan(1))
    ending.numbers.push_back(
        {row.what + (row.continued ? ", from the base" : ""),
         fmt::format("{:+.3f} mm, marks move by {:.3f} mm, {} folds{}", row.change_m / mm,
                     row.moved_m / mm, row.folds, row.at_rest ? "" : ", not at rest")});
  const char* table = split.rows.size() > 1 ? "error_split.csv" : "sensitivity.json";
  ending.next_command = fmt::format("more {}", shell_word((out / table).string()));
  return ending;
}

int run_sensitivity(SensitivityArguments& args, std::vector<std::string> words,
                    const CommonOptions& common) {
  StepFiles files{{args.out / "sensitivity.json", args.out / "error_split.csv"},
                  {fs::path(args.reference).replace_extension(".json")}};
  if (args.start) files.inputs.push_back(fs::path(*args.start).replace_extension(".json"));
  files = refuse_to_replace(args.scene, args.fabric, files);
  RunRecord record("drape-simulate", std::move(words), args.out / "sensitivity.run.json", files);
  auto [scene, fabric, print, start] = read_checked(args.scene, args.fabric);
  require_same_drape(args.reference, scene);
  start = read_start_of(args.start.value_or(args.reference), scene, print);
  args.options.solver = Solver::fall;
  args.options.rows = args.options.cols = args.grid;
  args.options.threads = thread_count(common);
  if (args.fit == CurveFit::drape) args.options.reach = find_reach(scene, fabric, print, start);
  const auto split = split_error(scene, fabric, print, start, read_start(args.reference, print),
                                 args.options, args.split);
  write_json(files.outputs[0], sensitivity_json(split));
  write_durable(files.outputs[1], split_csv(split));
  Ending ending = ending_of(split, args.out);
  ending.warnings = fabric.warnings;
  return finish(resting_on(split.no_go, std::move(ending)), common, record);
}

}  // namespace

int sensitivity_command(int argc, char** argv) {
  Command app("Says which fabric value and which part of the model the distance comes from.",
              "drape-simulate sensitivity");
  CommonOptions common;
  add_common_options(app, common);
  SensitivityArguments args;
  app.add_option("SCENE", args.scene, "scene.toml")->required();
  app.add_option("--reference", args.reference, "sheet.ply to measure from")->required();
  app.add_option("--start-from", args.start, "sheet.ply that places start and pins; default: it");
  app.add_option("--fabric", args.fabric, "fabric.toml; default: the scene's");
  app.add_option("--grid", args.grid, "particles per side")->capture_default_str();
  app.add_option("--segments", args.options.segments, "segments per curve")->capture_default_str();
  add_fit_option(app, args.fit);
  app.add_option("--starts", args.split.starts, "seeded starts for the rows about the branch")
      ->range(1, 10000)
      ->capture_default_str();
  app.add_flag("--only-first-order", args.split.only_first_order, "the base only, no variants");
  app.add_option("--out", args.out, "folder for the two tables")->required();
  return run_program(app, argc, argv, common,
                     [&] { return run_sensitivity(args, arguments_of(argc, argv), common); });
}

}  // namespace drape::simulate
