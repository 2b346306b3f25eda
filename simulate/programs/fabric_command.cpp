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

/// Formats of a test report.
enum class SheetFormat { kes, fast, u3m };

}  // namespace
}  // namespace drape::simulate

template <>
inline constexpr std::string_view drape::names_of<drape::simulate::SheetFormat>[] = {"kes", "fast",
                                                                                     "u3m"};

namespace drape::simulate {
namespace {

/// Options of `drape fabric` itself.
struct FabricArguments {
  fs::path file;
  std::optional<fs::path> plot;
  int segments = 5;
};
void fields(Fields& f, FabricArguments& a) {
  f.otherwise(Field{"fabric", "fabric.toml"}.called("FABRIC"), a.file);
  f({"plot", "SVG of every curve with its approximations"}, a.plot);
  f.otherwise({"segments", "line segments per curve", 1, 1, 20}, a.segments);
}

/// Options of `drape fabric list`, `show` and `import`.
struct LibraryArguments {
  std::string_view word = {};
  fs::path library = {}, file = {};  ///< empty `library` means the installed one
  std::optional<fs::path> out = {};
  std::string id = {}, name = {}, bend_unit = {};
  SheetFormat format = SheetFormat::kes;
};
void fields(Fields& f, LibraryArguments& a) {
  if (a.word == "import") {
    f(Field{"file", "the sheet: property,unit,warp,weft; or physics JSON"}.called("FILE"), a.file);
    f.otherwise({"format", "format of the sheet"}, a.format);
    f.otherwise({"name", "name of the fabric (default: the file's)"}, a.name);
    f.otherwise({"bend_unit", "unit of the bend in a U3M file, which states none"}, a.bend_unit);
  } else {
    f.otherwise({"library", "CSV of published fabrics (default: the installed one)"}, a.library);
  }
  if (a.word == "show") f(Field{"id", "id shown by `drape fabric list`"}.called("ID"), a.id);
  if (a.word != "list") f({"out", "new folder for fabric.toml and its curves"}, a.out);
}

/// The given CSV, or else the one beside the program, in an installation or build tree.
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

/// Writes the fabric and then the record, whose folder does not exist before.
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
  const bool u3m = arguments.format == SheetFormat::u3m;
  if (u3m && arguments.bend_unit.empty())
    throw usage_error("U3M names no unit for bend", "give --bend-unit, such as dyn.cm");
  if (!u3m && !arguments.bend_unit.empty())
    throw usage_error("--bend-unit is for U3M: a sheet of KES or FAST names the unit of each row",
                      "leave it out, or give --format u3m");
  record.input(arguments.file);
  const ImportedFabric fabric = u3m ? import_u3m(arguments.file, name, arguments.bend_unit)
                                : arguments.format == SheetFormat::kes
                                    ? import_kes(arguments.file, name)
                                    : import_fast(arguments.file, name);
  Ending ending;
  ending.verdict = fmt::format("{}: its numbers are those of a textile", name);
  if (!fabric.unused.empty()) ending.numbers.emplace_back("read, not used", fabric.unused);
  write(fabric, arguments, record, ending);
  return ending;
}

/// Ending of a command on the library. Writes to `--out` if given, with a record of `words`.
Ending answer(const LibraryArguments& arguments, std::vector<std::string> words) {
  if (arguments.word == "list") return listed(arguments);
  RunRecord record("drape-simulate", std::move(words));
  if (arguments.word == "show") return shown(arguments, record);
  if (!arguments.out) throw usage_error("--out is missing", "name a new folder");
  return imported(arguments, record);
}

int run_fabric(const FabricArguments& arguments, std::vector<std::string> words,
               const CommonOptions& common) {
  const auto& [file, plot, segments] = arguments;
  if (file.empty()) throw usage_error("FABRIC is missing", "give a fabric.toml");
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
  FabricArguments fabric;
  app.add_record(fabric);
  app.require_subcommand(0, 1);
  LibraryArguments list{.word = "list"}, show{.word = "show"}, import{.word = "import"};
  app.add_subcommand("list", "the published fabrics of the library")->add_record(list);
  app.add_subcommand("show", "one of them with its source; --out writes its files")
      ->add_record(show);
  app.add_subcommand("import", "a fabric from a result sheet of KES or FAST, or from U3M")
      ->add_record(import);
  return run_program(app, argc, argv, common, [&] {
    for (const LibraryArguments* one : {&list, &show, &import})
      if (app.chosen() != nullptr && app.chosen()->name() == one->word)
        return finish(answer(*one, arguments_of(argc, argv)), common);
    return run_fabric(fabric, arguments_of(argc, argv), common);
  });
}

}  // namespace drape::simulate
