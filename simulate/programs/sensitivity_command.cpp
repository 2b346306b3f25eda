// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/run_inputs.hpp"
#include "simulate/start/start_file.hpp"
#include "simulate/study/sensitivity.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;
using units::mm;

namespace {

struct SensitivityArguments : RunArguments {
  fs::path reference;
  bool variants = false;
};

void fields(Fields& f, SensitivityArguments& args) {
  fields(f, static_cast<RunArguments&>(args));
  mesh_fields(f, args.options.drape, true);
  f({"reference",
     "sheet.ply from which distances are measured; it also positions start and pins without "
     "--start-from"},
    args.reference);
  f.otherwise({"variants",
               "also drape with one part of the model changed, from the rest and from the start"},
              args.variants);
}

Ending ending_of(const SensitivityFile& file, const fs::path& written) {
  Ending ending;
  const bool at_rest = file.status == "at rest";
  ending.go = at_rest && !file.values.empty();
  ending.verdict = !at_rest    ? "the base: " + file.status
                   : ending.go ? fmt::format("mean distance {:.3f} mm over {} marks",
                                             file.distance_m / mm, file.marks)
                               : "the base is a saddle: it has no first-order answer";
  for (const ValueEffect& one : file.values)
    ending.numbers.emplace_back(
        one.value + " +1 %",
        fmt::format("{:+.4f} mm, marks move by {:.4f} mm", one.change_m / mm, one.moved_m / mm));
  for (const SceneEffect& one : file.scene) {
    if (!one.moves)
      ending.warnings.push_back(fmt::format("{} has no answer: {}", one.value, one.absent));
    else
      ending.numbers.emplace_back(
          fmt::format("{} +{:g}", one.value, one.moves->step),
          fmt::format("{:+.4f} mm, marks move by {:.4f} mm",
                      one.change_m_per_unit.value_or(0) * one.moves->step / mm,
                      one.moves->up_m.rowwise().norm().mean() / mm));
  }
  for (const VariantEffect& one : file.variants)
    ending.numbers.emplace_back(one.what + (one.continued ? ", from the base" : ""),
                                one.at_rest ? fmt::format("{:+.3f} mm, marks move by {:.3f} mm",
                                                          one.change_m / mm, one.moved_m / mm)
                                            : "not at rest");
  ending.next_command = fmt::format("more {}", shell_word(written.string()));
  return ending;
}

int run_sensitivity(SensitivityArguments args, std::vector<std::string> words,
                    const CommonOptions& common) {
  if (!args.start) args.start = args.reference;
  const fs::path written = args.out / "sensitivity.json";
  const RunInputs inputs = read_run_inputs(args, {written});
  const Sheet reference = read_start(args.reference, inputs.print);
  require_same_drape(reference, inputs.scene);
  RunRecord record = record_of(args, inputs, std::move(words), args.out / "sensitivity.run.json");
  if (*args.start != args.reference)
    for (const fs::path& file : start_files(args.reference)) record.input(file);
  set_reach(args, inputs);
  SensitivityFile file = sensitivities_of(
      simulate(inputs.scene, inputs.fabric, inputs.print, inputs.measured, args.options),
      inputs.fabric, reference, {args.options, args.variants});
  if (!file.no_go) file.no_go = no_go_of(inputs.measured);
  write_record(written, file);
  record.output(written);
  Ending ending = ending_of(file, written);
  ending.warnings.insert(ending.warnings.begin(), inputs.fabric.warnings.begin(),
                         inputs.fabric.warnings.end());
  return finish(resting_on(file.no_go, std::move(ending)), common, record);
}

}  // namespace

int sensitivity_command(int argc, char** argv) {
  return run_command<SensitivityArguments>(
      argc, argv, "drape-simulate sensitivity",
      "Computes the effects of fabric and scene values, and of parts of the model, on a drape.",
      run_sensitivity,
      {{"--grid", "--spacing-mm says the finest mesh"},
       {"--starts", "drape simulate branches finds the branches"},
       {"--only-first-order", "it is the default; --variants adds the changed models"}});
}

}  // namespace drape::simulate
