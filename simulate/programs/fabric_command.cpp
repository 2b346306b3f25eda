// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"
#include "simulate/fabric/plausible.hpp"
#include "simulate/fabric/plot.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/fabric_library.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;

namespace {

int run_fabric(const fs::path& file, const std::optional<fs::path>& plot, int segments,
               std::vector<std::string> words, const CommonOptions& common) {
  if (file.empty()) throw usage_error("FABRIC is missing", "give a fabric.toml");
  if (segments < 1 || segments > 20)
    throw usage_error("a curve has 1 to 20 segments", "give --segments 5");
  StepFiles files{{}, read_fabric(file).files()};
  if (plot) files.outputs.push_back(*plot);
  RunRecord record("drape-simulate", std::move(words), plot ? run_record_path(*plot) : fs::path(),
                   files);
  const Fabric fabric = read_fabric(file);
  require_textile(fabric);
  SimulateReport report;
  const ClothLaws laws = make_laws(fabric, segments, report);
  Ending ending;
  ending.verdict = fmt::format("{}: its curves are those of a textile", fabric.name);
  for (const CurveReport& curve : report.curves) {
    const double unit = curve.unit == "gf/cm" ? units::gf_per_cm : units::gf_cm_per_cm;
    ending.numbers.emplace_back(
        curve.name,
        fmt::format("{} segments, error rms {:.3g}, largest {:.3g} {}; half loop {:.3g}",
                    curve.segments, curve.rms_error / unit, curve.largest_error / unit, curve.unit,
                    curve.half_hysteresis / unit));
  }
  ending.numbers.emplace_back("twist stiffness", fmt::format("{:.3g} uN m", laws.twist_n_m * 1e6));
  ending.warnings = report.warnings;
  for (const std::string& what : fabric.stand_ins)
    ending.warnings.push_back("not measured: " + what);
  ending.next_command =
      fmt::format("drape-simulate SCENE --fabric {} --out DIR", shell_word(file.string()));
  if (plot) write_durable(*plot, curves_svg(fabric, segments));
  return finish(ending, common, record);
}

}  // namespace

int fabric_command(int argc, char** argv) {
  Command app(
      "Checks a fabric and shows how its Kawabata curves are approximated; lists published fabrics "
      "and imports result sheets.",
      "drape-simulate fabric");
  CommonOptions common;
  add_common_options(app, common);
  app.fallthrough();
  fs::path file;
  std::optional<fs::path> plot;
  int segments = 5;
  app.add_option("FABRIC", file, "fabric.toml");
  app.add_option("--plot", plot, "SVG of every curve with its approximations");
  app.add_option("--segments", segments, "line segments per curve")->capture_default_str();
  LibraryArguments library;
  add_library_commands(app, library);
  return run_program(app, argc, argv, common, [&] {
    if (const auto ending = run_library_command(app, library, arguments_of(argc, argv)))
      return finish(*ending, common);
    return run_fabric(file, plot, segments, arguments_of(argc, argv), common);
  });
}

}  // namespace drape::simulate
