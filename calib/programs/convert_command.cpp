// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "calib/exchange/exchange.hpp"
#include "calib/programs/commands.hpp"
#include "calib/programs/ending.hpp"
#include "core/error.hpp"
#include "core/fields/fields.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"

namespace drape::calib {

namespace fs = std::filesystem;

namespace {

struct ConvertArguments {
  std::vector<fs::path> inputs;
  std::optional<ExchangeFormat> to, from;
  std::string rig = "imported";
  fs::path out;
  ExportOptions options;
  ImportOptions import;
};

void fields(Fields& f, ConvertArguments& a) {
  f(Field{"input",
          "calibration.json, or files of the other tool (COLMAP: cameras.txt, images.txt beside "
          "it)"}
        .called("INPUT"),
    a.inputs);
  f.if_any(Field{"to", "tool whose format to write"}.without("from"), a.to);
  f.if_any({"from", "tool whose format to read"}, a.from);
  f({"out", "folder (--to) or calibration.json (--from) to write"}, a.out);
  f.otherwise(
      {"max_refit_px",
       "refuse if the conversion would change a lens by more than this anywhere in its image, px",
       1, 0},
      a.options.max_refit_px);
  f.if_any(Field{"unit_mm", "length of one unit of the file, mm (default: what the tool states)",
                 units::mm, above_zero}
               .without("to"),
           a.import.unit_m);
  f.otherwise({"rig", "name of the rig for an imported calibration"}, a.rig);
}

Ending export_to(const ConvertArguments& given, RunRecord& record) {
  if (given.inputs.size() != 1)
    throw usage_error("--to takes one calibration.json", "give one file");
  const ExportResult result =
      export_calibration(read_calibration(given.inputs[0]), *given.to, given.options);
  Ending ending;
  for (const ExportedFile& file : result.files) {
    write_durable(given.out / file.name, file.text);
    record.output(given.out / file.name);
  }
  for (std::size_t i = 0; i < result.cameras.size(); ++i) {
    const BrownRefit& refit = result.refits[i];
    ending.numbers.emplace_back(result.cameras[i],
                                refit.points == 0
                                    ? "the same lens"
                                    : fmt::format("lens refitted: RMS {:.6f} px, at most {:.6f} px",
                                                  refit.rms_px, refit.max_px));
  }
  ending.verdict = fmt::format("{} cameras written for {} in {}", result.cameras.size(),
                               name_of(*given.to), given.out.string());
  return ending;
}

Ending import_from(const ConvertArguments& given) {
  const Calibration calibration =
      import_calibration(given.inputs, *given.from, given.rig, given.import);
  write_calibration(given.out, calibration);
  Ending ending;
  ending.verdict =
      fmt::format("{} cameras read from {}", calibration.cameras.size(), name_of(*given.from));
  ending.warnings = calibration.warnings;
  ending.next_command = next_command(given.out);
  return ending;
}

}  // namespace

int convert_command(int argc, char** argv) {
  Command app("Writes a calibration for other tools, or reads theirs", "drape-calib convert");
  CommonOptions common;
  ConvertArguments given;
  add_common_options(app, common);
  app.add_record(given);
  return run_program(app, argc, argv, common, [&] {
    if (!given.to == !given.from)
      throw usage_error("neither --to nor --from is given", "give one of them");
    if (!given.to ? app.count("--max-refit-px") > 0 : app.count("--rig") > 0)
      throw usage_error("--max-refit-px is of --to, --rig of --from", "leave the other one out");
    StepFiles files{{}, given.inputs};
    if (!given.to) files.outputs.push_back(given.out);
    RunRecord record("drape-calib", arguments_of(argc, argv),
                     !given.to ? run_record_path(given.out) : given.out / "convert.run.json",
                     files);
    record.option("max_refit_px", fmt::format("{}", given.options.max_refit_px));
    return finish(!given.to ? import_from(given) : export_to(given, record), common, record);
  });
}

}  // namespace drape::calib
