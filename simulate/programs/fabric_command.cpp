// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"
#include "simulate/fabric/fitted_laws.hpp"
#include "simulate/fabric/import.hpp"
#include "simulate/fabric/plausible.hpp"
#include "simulate/fabric/plot.hpp"
#include "simulate/programs/commands.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;

namespace {

/// The words of `drape fabric list`, `show` and `import`.
struct LibraryArguments {
  std::filesystem::path library, file;  ///< no library: that of the installation
  std::optional<std::filesystem::path> out;
  std::string id, name, format = "kes", bend_unit;
};

/// The CSV that was named, else that beside the program: installed, or in the tree it was built in.
fs::path library_of(const LibraryArguments& arguments) {
  if (!arguments.library.empty()) return arguments.library;
  const fs::path programs = fs::read_symlink("/proc/self/exe").parent_path();
  for (const char* root : {"../share/drapebench", "../../.."}) {
    fs::path file = (programs / root / "rigs/fabrics/published.csv").lexically_normal();
    if (fs::exists(file)) return file;
  }
  throw bad_input("there is no library of published fabrics beside the program",
                  {.file = programs.string()}, "name its CSV with --library");
}

std::string text_of(const std::optional<double>& value, const char* unit) {
  return value ? fmt::format("{:g} {}", *value, unit) : "not published";
}

Ending listed(const LibraryArguments& arguments) {
  const auto library = read_published(library_of(arguments));
  Ending ending;
  ending.verdict = fmt::format("{} published fabrics", library.size());
  for (const PublishedFabric& fabric : library) {
    const bool usable = fabric.areal_density_g_per_m2 && fabric.b_warp_gf_cm2_per_cm;
    ending.numbers.emplace_back(fabric.id,
                                fmt::format("{}; {}; B {}; drape coefficient {}{}", fabric.name,
                                            text_of(fabric.areal_density_g_per_m2, "g/m2"),
                                            text_of(fabric.b_warp_gf_cm2_per_cm, "gf cm2/cm"),
                                            text_of(fabric.drape_coefficient_percent, "%"),
                                            usable ? "" : "; cannot be simulated"));
  }
  ending.next_command = "drape fabric show ID --out DIR";
  return ending;
}

/// Writes the fabric and, last, the record: only then is there a folder for it.
void write(const ImportedFabric& fabric, const LibraryArguments& arguments, RunRecord& record,
           Ending& ending) {
  for (const std::string& what : fabric.stand_ins) ending.rejected.push_back("stand-in: " + what);
  if (!arguments.out) return;
  ending.warnings = write_imported(*arguments.out, fabric);
  const fs::path file = *arguments.out / "fabric.toml";
  ending.next_command = fmt::format("drape fabric {}", shell_word(file.string()));
  for (const auto& [name, text] : fabric.curves) record.output(*arguments.out / name);
  record.output(file);
  record.write(run_record_path(file), 0, ending);
}

Ending shown(const LibraryArguments& arguments, RunRecord& record) {
  const fs::path file = library_of(arguments);
  record.input(file);
  const auto library = read_published(file);
  const PublishedFabric& fabric = published_fabric(library, arguments.id);
  Ending ending;
  ending.verdict = fmt::format("{}: {}", fabric.id, fabric.name);
  ending.numbers = {{"weave", fabric.weave.empty() ? "not published" : fabric.weave},
                    {"areal density", text_of(fabric.areal_density_g_per_m2, "g/m2")},
                    {"thickness", text_of(fabric.thickness_mm, "mm")},
                    {"B warp", text_of(fabric.b_warp_gf_cm2_per_cm, "gf cm2/cm")},
                    {"B weft", text_of(fabric.b_weft_gf_cm2_per_cm, "gf cm2/cm")},
                    {"B bias", text_of(fabric.b_bias_gf_cm2_per_cm, "gf cm2/cm")},
                    {"2HB", text_of(fabric.hb2_gf_cm_per_cm, "gf cm/cm")},
                    {"drape coefficient", text_of(fabric.drape_coefficient_percent, "%")},
                    {"nodes", text_of(fabric.nodes, "")},
                    {"disc", text_of(fabric.disc_mm, "mm")},
                    {"specimen", text_of(fabric.specimen_mm, "mm")},
                    {"source", fabric.source},
                    {"note", fabric.note}};
  if (arguments.out || (fabric.areal_density_g_per_m2 && fabric.b_warp_gf_cm2_per_cm))
    write(import_published(fabric), arguments, record, ending);
  return ending;
}

Ending imported(const LibraryArguments& arguments, RunRecord& record) {
  const std::string name = arguments.name.empty() ? arguments.file.stem().string() : arguments.name;
  if (arguments.format == "u3m" && arguments.bend_unit.empty())
    throw usage_error("U3M names no unit for bend", "give --bend-unit, such as dyn.cm");
  if (arguments.format != "u3m" && !arguments.bend_unit.empty())
    throw usage_error("--bend-unit is for U3M: a sheet of KES or FAST names the unit of each row",
                      "leave it out, or give --format u3m");
  record.input(arguments.file);
  const ImportedFabric fabric = arguments.format == "kes" ? import_kes(arguments.file, name)
                                : arguments.format == "fast"
                                    ? import_fast(arguments.file, name)
                                    : import_u3m(arguments.file, name, arguments.bend_unit);
  Ending ending;
  ending.verdict = fmt::format("{}: its numbers are those of a textile", name);
  write(fabric, arguments, record, ending);
  return ending;
}

void add_library_commands(Command& app, LibraryArguments& arguments) {
  app.require_subcommand(0, 1);
  Command* list = app.add_subcommand("list", "the published fabrics of the library");
  Command* show = app.add_subcommand("show", "one of them with its source; --out writes its files");
  Command* import =
      app.add_subcommand("import", "a fabric from a result sheet of KES or FAST, or from U3M");
  for (Command* command : {list, show})
    command->add_option("--library", arguments.library,
                        "CSV of published fabrics (default: the installed one)");
  show->add_option("ID", arguments.id, "as `drape fabric list` shows it")->required();
  import->add_option("FILE", arguments.file, "the sheet: property,unit,warp,weft; or physics JSON")
      ->required();
  import->add_option("--format", arguments.format, "what it is")
      ->one_of({"kes", "fast", "u3m"})
      ->capture_default_str();
  import->add_option("--name", arguments.name, "of the fabric (default: the file's)");
  import->add_option("--bend-unit", arguments.bend_unit, "of a U3M's bend, which names none");
  for (Command* command : {show, import})
    command->add_option("--out", arguments.out, "new folder for fabric.toml and its curves");
}

/// The ending of the subcommand that was given; nothing without one. Writes where `--out` says,
/// with a record of `words`.
std::optional<Ending> run_library_command(const Command& app, const LibraryArguments& arguments,
                                          std::vector<std::string> words) {
  const Command* chosen = app.chosen();
  if (chosen == nullptr) return std::nullopt;
  if (chosen->name() == "list") return listed(arguments);
  RunRecord record("drape-simulate", std::move(words));
  if (chosen->name() == "show") return shown(arguments, record);
  if (!arguments.out) throw usage_error("--out is missing", "name a new folder");
  return imported(arguments, record);
}

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
  const FittedLaws fitted = fit_laws(fabric, segments);
  Ending ending;
  ending.verdict = fmt::format("{}: its curves are those of a textile", fabric.name);
  for (const CurveReport& curve : fitted.curves) {
    const bool bends = curve.name.starts_with("bending");
    const double unit = bends ? units::gf_cm_per_cm : units::gf_per_cm;
    ending.numbers.emplace_back(
        curve.name,
        fmt::format("{} segments, error rms {:.3g}, largest {:.3g} {}; half loop {:.3g}",
                    curve.segments, curve.rms_error / unit, curve.largest_error / unit,
                    bends ? "gf cm/cm" : "gf/cm", curve.half_hysteresis / unit));
  }
  ending.numbers.emplace_back("twist stiffness",
                              fmt::format("{:.3g} uN m", fitted.laws.twist_n_m * 1e6));
  ending.warnings = fitted.warnings;
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
