// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/fields.hpp"
#include "core/files/files.hpp"
#include "core/parallel.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/program/words.hpp"
#include "core/simulation_files.hpp"
#include "core/units.hpp"
#include "simulate/checker/certify.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/fabric/import.hpp"
#include "simulate/mesh/cusick.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// Formats of a test report.
enum class SheetFormat { kes, fast, u3m };

}  // namespace drape::simulate

template <>
inline constexpr std::string_view drape::names_of<drape::simulate::SheetFormat>[] = {"kes", "fast",
                                                                                     "u3m"};

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;
using units::mm;

constexpr int kMostStarts = 99;  // file names have two digits

struct CusickArguments : CusickOptions {
  fs::path fabric, out;
  int starts = 1;
  bool internal_friction = false;
};

void fields(Fields& f, CusickArguments& a) {
  f(drape::Field{"fabric", "fabric.toml"}.called("FABRIC"), a.fabric);
  f({"out", "folder for start-NN.ply and cusick.json"}, a.out);
  f.otherwise({"starts", "random starts", 1, 1, kMostStarts}, a.starts);
  f.otherwise({"disc_mm", "diameter of the discs", mm, above_zero}, a.disc_m);
  f.otherwise({"specimen_mm", "diameter of the specimen", mm, above_zero}, a.specimen_m);
  f.otherwise(
      {"spacing_mm", "spacing of the mesh; a third of it at the discs' rim", mm, above_zero},
      a.spacing_m);
  f.otherwise({"warp_deg", "rotation of the mesh relative to the warp", units::deg}, a.warp_rad);
  f.otherwise({"lowering_steps",
               "steps in which the table under the specimen is lowered; 1: released at once; "
               "without --internal-friction",
               1, 1, 1000},
              a.lowering_steps);
  f.otherwise({"lowering_s",
               "time in which the table is lowered, with the cloth in motion; 0: released at once; "
               "with --internal-friction",
               1, 0, 10},
              a.lowering_s);
  f.otherwise(
      {"step_ms", "time step of that motion; internal friction is updated at each", 1e-3, 0.1, 20},
      a.motion.step_s);
  f.otherwise({"laid_coarser",
               "mesh on which the specimen is laid: its spacing in units of --spacing-mm; 1: the "
               "mesh itself, also used if the ring would have fewer than six",
               1, above_zero},
              a.laid_coarser);
  f.otherwise({"internal_friction", "use both branches of the bending and shear loops"},
              a.internal_friction);
  f.otherwise({"shakes", "number of times that gravity is varied up and down before the last rest",
               1, 0, 20},
              a.shakes);
  f.otherwise({"shake_percent", "amplitude of that variation, in percent of gravity",
               units::percent, 0, 100},
              a.shake);
  f.otherwise({"max_steps", "largest number of descent steps at each load", 1, 1},
              a.descent.most_steps);
}

/// A drape with the checker's verdict; without one if it is not at rest.
struct JudgedDrape {
  CusickDrape drape;
  std::optional<MeshJudgement> judgement;

  [[nodiscard]] bool go() const { return judgement && judgement->accepted(); }
};

std::string file_of_start(std::size_t start) {
  return fmt::format("start-{:02d}.ply", start);
}

/// Throws Error(usage) if an option has no effect, or a file of the fabric would be
/// overwritten.
void check(const CusickArguments& arguments) {
  const CusickArguments usual;
  const bool stepwise = arguments.lowering_steps != usual.lowering_steps;
  const bool in_time =
      arguments.lowering_s != usual.lowering_s || arguments.motion.step_s != usual.motion.step_s;
  if (arguments.internal_friction ? stepwise : in_time)
    throw usage_error(
        "--lowering-steps is for cloth without internal friction, --lowering-s and --step-ms are "
        "for cloth with it",
        "leave out what does not fit, or --internal-friction");
  StepFiles replaced{{arguments.out / "cusick.json"}, read_fabric(arguments.fabric).files()};
  for (std::size_t i = 0; i < kMostStarts; ++i)
    replaced.outputs.push_back(arguments.out / file_of_start(i));
  const RunRecord kept_nowhere("drape-simulate", {}, {}, replaced);
}

/// Drapes a specimen and has the checker judge it if it is at rest.
JudgedDrape judged_drape(const ClothLaws& laws, const CusickOptions& options) {
  JudgedDrape judged{cusick_drape(laws, options), std::nullopt};
  const CusickDrape& drape = judged.drape;
  if (!drape.report.at_rest) return judged;
  MeshRest rest;
  rest.shape = shape_of(drape.mesh, drape.state);
  rest.laws = laws;
  rest.memory = drape.memory;
  rest.disc_radius_m = options.disc_m / 2;
  rest.gravity_m_per_s2 = options.descent.gravity_m_per_s2;
  rest.residual_tolerance = options.descent.residual;
  judged.judgement = judge_mesh(rest);
  return judged;
}

/// Removes drapes of an earlier run, which would otherwise seem to belong to the new list.
void remove_drapes(const fs::path& folder) {
  for (std::size_t i = 0; i < kMostStarts; ++i) {
    const auto file = folder / file_of_start(i);
    if (fs::is_regular_file(fs::symlink_status(file))) fs::remove(file);
  }
}

/// Entry of a drape in the list.
CusickStart entry_of(const JudgedDrape& judged, const std::string& name) {
  const DescentReport& found = judged.drape.report;
  CusickStart start{.file = name,
                    .points = static_cast<int>(judged.drape.mesh.points_m.size()),
                    .specimen_area_m2 = judged.drape.mesh.area_m2(),
                    .at_rest = judged.go(),
                    .steps = found.steps,
                    .hurried_loads = judged.drape.hurried_loads};
  if (std::isfinite(found.residual)) start.residual = found.residual;
  if (std::isfinite(found.energy_j)) start.energy_j = found.energy_j;
  if (found.dissipated_j > 0) start.dissipated_j = found.dissipated_j;
  if (!judged.judgement) return start;
  start.refusals = judged.judgement->refusals;
  start.checked_residual = judged.judgement->residual;
  start.deepest_m = judged.judgement->deepest_m;
  return start;
}

/// Writes start-NN.ply and cusick.json to `out` after removing drapes of an earlier run, adds them
/// to the record, and reports how many drapes the checker accepts.
Ending write_cusick(const CusickArguments& arguments, const std::string& fabric,
                    const std::vector<JudgedDrape>& drapes, RunRecord& record) {
  const fs::path out = arguments.out;
  remove_drapes(out);
  Ending ending;
  CusickFile list{fabric, arguments.disc_m, arguments.specimen_m, {}};
  std::size_t resting = 0;
  for (std::size_t i = 0; i < drapes.size(); ++i) {
    const CusickStart start = entry_of(drapes[i], file_of_start(i));
    const DescentReport& found = drapes[i].drape.report;
    list.starts.push_back(start);
    resting += start.at_rest ? 1 : 0;
    for (const std::string& refusal : start.refusals)
      ending.rejected.push_back(
          fmt::format("{} is refused by the checker: {}", start.file, refusal));
    ending.numbers.emplace_back(
        start.file,
        fmt::format("{} points, {} steps, residual {:.2g} of a point's weight, {:.1f} uJ",
                    start.points, start.steps, found.residual, found.energy_j * 1e6));
    if (!found.at_rest) ending.rejected.push_back(start.file + " is not at rest");
    if (start.hurried_loads > 0)
      ending.warnings.push_back(fmt::format(
          "{} went on from {} loads before it was near rest, so its folds may be others; raise "
          "--max-steps",
          start.file, start.hurried_loads));
  }
  // Writes the list first, so that an interrupted run leaves no drapes beside another run's list.
  write_record(out / "cusick.json", list);
  for (std::size_t i = 0; i < drapes.size(); ++i) {
    write_durable(out / file_of_start(i), ply_text(drapes[i].drape));
    record.output(out / file_of_start(i));
  }
  record.output(out / "cusick.json");
  ending.go = resting == drapes.size();
  ending.verdict = fmt::format("{} of {} drapes of {} at rest and accepted by the checker", resting,
                               drapes.size(), fabric);
  ending.next_command =
      fmt::format("drape drapemeter {} --disc-mm {:g} --specimen-mm {:g}", shell_word(out.string()),
                  arguments.disc_m / mm, arguments.specimen_m / mm);
  return ending;
}

int run_cusick(const CusickArguments& arguments, std::vector<std::string> words,
               const CommonOptions& common) {
  check(arguments);
  const auto list = arguments.out / "cusick.json";
  RunRecord record("drape-simulate", std::move(words), run_record_path(list));
  const Fabric fabric = read_fabric(arguments.fabric);
  for (const auto& file : fabric.files()) record.input(file);
  const FittedLaws fitted = fit_laws(fabric, 5, {}, arguments.internal_friction);
  std::vector<JudgedDrape> drapes(static_cast<std::size_t>(arguments.starts));
  parallel_for(drapes.size(), thread_count(common), [&](std::size_t i) {
    CusickOptions options = arguments;
    options.start = static_cast<unsigned>(i + 1);
    drapes[i] = judged_drape(fitted.laws, options);
  });
  Ending ending = write_cusick(arguments, fabric.name, drapes, record);
  ending.warnings.insert(ending.warnings.begin(), fitted.warnings.begin(), fitted.warnings.end());
  return finish(ending, common, record);
}

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

/// Writes the fabric with its record into a new folder.
void write(const ImportedFabric& fabric, const LibraryArguments& arguments, RunRecord& record,
           Ending& ending) {
  for (const std::string& what : fabric.stand_ins) ending.rejected.push_back("stand-in: " + what);
  if (!arguments.out) return;
  ending.next_command =
      fmt::format("drape fabric {}", shell_word((*arguments.out / "fabric.toml").string()));
  write_imported(*arguments.out, fabric, [&](const fs::path& folder, const auto& warnings) {
    ending.warnings = warnings;
    for (const auto& [name, text] : fabric.curves) record.output(folder / name);
    record.output(folder / "fabric.toml");
    record.write(run_record_path(folder / "fabric.toml"), 0, ending, *arguments.out);
  });
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

int cusick_command(int argc, char** argv) {
  return run_command<CusickArguments>(
      argc, argv, "drape-simulate cusick",
      "Drapes a round specimen of a fabric, held between two discs, from many starts.", run_cusick);
}

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
