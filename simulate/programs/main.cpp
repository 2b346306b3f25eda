// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/fields/fields.hpp"
#include "core/files/files.hpp"
#include "core/matching.hpp"
#include "core/program/program.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"
#include "core/program/words.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "core/simulation_files.hpp"
#include "core/units.hpp"
#include "simulate/checker/certify.hpp"
#include "simulate/drape/outline.hpp"
#include "simulate/ensemble/bands.hpp"
#include "simulate/ensemble/branches.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/objects/cloth_files.hpp"
#include "simulate/objects/surroundings.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/simulate.hpp"
#include "simulate/start/start.hpp"
#include "simulate/start/start_file.hpp"
#include "simulate/study/sensitivity.hpp"
#include "simulate/study/study.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;
using units::mm;

struct StatusArguments {
  fs::path plan, out;
};

void fields(Fields& f, StatusArguments& args) {
  f(Field{"plan", "plan.toml, or folder of a rig"}.called("PLAN"), args.plan);
  f({"out", "output folder given to the parts"}, args.out);
}

struct StudyArguments {
  fs::path rig, out;
  std::string part = "1/1";
  PlanChoice choice;
};

void fields(Fields& f, StudyArguments& args) {
  f.otherwise(
      Field{"rig", "folder with plan.toml or scenes/, e.g. rigs/paper, or a plan.toml"}.called(
          "RIG"),
      args.rig);
  f.otherwise({"out", "folder for the drapes and the tables; of a plan: for all its parts"},
              args.out);
  f.otherwise({"part", "I/N: every N-th case, starting with the I-th"}, args.part);
  fields(f, args.choice);
}

constexpr std::size_t kMostNamed = 20;  ///< cases named in the ending; study.csv has all

Ending ending_of(const std::vector<StudyOutcome>& outcomes) {
  std::array<int, std::size(names_of<CaseState>)> counts{};
  int resting = 0;
  Ending ending;
  for (const StudyOutcome& one : outcomes) {
    ++counts[static_cast<std::size_t>(one.state)];
    resting += one.at_rest ? 1 : 0;
    const bool named = one.state == CaseState::failed || one.state == CaseState::impossible ||
                       (one.state == CaseState::done && !one.at_rest);
    if (named && ending.rejected.size() < kMostNamed)
      ending.rejected.push_back(
          fmt::format("{}: {}{}", one.the_case.name(),
                      one.state == CaseState::impossible ? "cannot run: " : "", one.status));
  }
  const auto count = [&](CaseState state) { return counts[static_cast<std::size_t>(state)]; };
  ending.go = resting == static_cast<int>(outcomes.size());
  ending.verdict = fmt::format("{} of {} drapes at rest", resting, outcomes.size());
  ending.numbers = {{"done, not at rest", std::to_string(count(CaseState::done) - resting)},
                    {"failed", std::to_string(count(CaseState::failed))},
                    {"being computed", std::to_string(count(CaseState::computing))},
                    {"missing", std::to_string(count(CaseState::missing))}};
  if (count(CaseState::impossible) > 0)
    ending.numbers.emplace_back("cannot run", std::to_string(count(CaseState::impossible)));
  return ending;
}

/// Warnings about the fabrics of a study, without repetition; each case's certificate has its own.
std::vector<std::string> fabric_warnings(const StudyPlan& plan) {
  std::set<fs::path> fabrics;
  for (const StudyCase& one : plan.cases) fabrics.insert(one.fabric_file);
  std::vector<std::string> warnings;
  for (const fs::path& fabric : fabrics)
    for (const std::string& warning : read_fabric(fabric).warnings) warnings.push_back(warning);
  if (warnings.size() > kMostNamed) {
    const std::size_t more = warnings.size() - kMostNamed;
    warnings.resize(kMostNamed);
    warnings.push_back(fmt::format("{} more of such, in the certificates", more));
  }
  return warnings;
}

std::string study_words(const fs::path& plan, const fs::path& out) {
  return fmt::format("{} --out {}", shell_word(plan.string()), shell_word(out.string()));
}

int count(const StatusArguments& args, const CommonOptions& common) {
  const StudyPlan plan = read_plan(args.plan, {}, args.out, fs::read_symlink("/proc/self/exe"));
  const std::vector<StudyOutcome> outcomes = plan_status(plan);
  write_durable(args.out / "study.csv", study_csv(outcomes));
  Ending ending = ending_of(outcomes);
  ending.warnings = fabric_warnings(plan);
  ending.numbers.emplace_back("table", (args.out / "study.csv").string());
  if (!ending.go) ending.next_command = "drape study " + study_words(args.plan, args.out);
  return finish(ending, common);
}

/// Writes the tables of all cases of a rig, with a record of their own.
int finish_rig(const StudyArguments& args, const StudyPlan& plan,
               const std::vector<StudyOutcome>& outcomes, Ending ending,
               std::vector<std::string> words, const CommonOptions& common) {
  RunRecord record("drape-simulate", std::move(words), args.out / "study.run.json");
  const fs::path printed = plan.folder / "published.csv";
  const std::string tables =
      study_tables(outcomes, fs::exists(printed) ? std::optional(printed) : std::nullopt);
  write_durable(args.out / "study.csv", study_csv(outcomes));
  write_durable(args.out / "study.md", tables);
  for (const char* name : {"study.csv", "study.md"}) record.output(args.out / name);
  for (const StudyOutcome& one : outcomes)
    if (one.state == CaseState::done) record.input(one.the_case.folder / "sheet.json");
  ending.next_command = fmt::format("more {}", shell_word((args.out / "study.md").string()));
  if (!common.json && !common.quiet) print_text(printable(tables) + "\n");
  return finish(ending, common, record);
}

int compute(const Command& app, const StudyArguments& args, std::vector<std::string> words,
            const CommonOptions& common) {
  if (args.rig.empty() || args.out.empty())
    throw usage_error("RIG or --out is missing", "give both, e.g. rigs/paper --out study");
  if (!fs::is_directory(args.rig))
    for (const char* option : {"--scenes", "--grids", "--spacings-mm", "--segments"})
      if (app.count(option) > 0)
        throw usage_error(fmt::format("{} cannot change a plan", option),
                          "write it into the plan file");
  const Part part = part_of(args.part);
  const StudyPlan plan =
      read_plan(args.rig, args.choice, args.out, fs::read_symlink("/proc/self/exe"));
  Progress progress("study", common.quiet);
  const std::vector<StudyOutcome> outcomes =
      run_part(plan, part, args.out, thread_count(common),
               [&](double fraction, const std::string& what) { progress.update(fraction, what); });
  Ending ending = ending_of(outcomes);
  ending.warnings = fabric_warnings(plan);
  if (plan.by_name && part.count == 1)
    return finish_rig(args, plan, outcomes, std::move(ending), std::move(words), common);
  ending.next_command = "drape study status " + study_words(args.rig, args.out);
  return finish(ending, common);
}

int study_command(int argc, char** argv) {
  Command app(
      "Drapes every scene of a rig or plan, on several meshes or, by the paper's model, "
      "grids.",
      "drape-simulate study");
  CommonOptions common;
  add_common_options(app, common);
  app.fallthrough();
  StudyArguments args;
  app.add_record(args);
  Command* status = app.add_subcommand(
      "status", "counts what of a plan is done, failed, missing or cannot run; writes study.csv");
  StatusArguments counted;
  status->add_record(counted);
  app.moved("--models", "a plan with model = \"paper\" asks for the paper's grids");
  app.moved("--solvers", "there is one way to rest");
  return run_program(app, argc, argv, common, [&] {
    if (app.chosen() != nullptr) return count(counted, common);
    return compute(app, args, arguments_of(argc, argv), common);
  });
}

/// Options common to programs that simulate one scene.
struct RunArguments {
  fs::path scene, out;
  std::optional<fs::path> fabric, start;
  CurveFit fit = CurveFit::drape;
  SimulateOptions options;
};

/// Contents of the input files.
struct RunInputs {
  Scene scene;
  Fabric fabric;
  Print print;
  std::optional<Sheet> measured;

  /// Every input file except the start: scene, print, fabric with its curves, meshes.
  [[nodiscard]] std::vector<fs::path> files() const { return files_of(scene, fabric); }
};

std::optional<std::string> no_go_of(const std::optional<Sheet>& measured) {
  return measured ? measured->no_go : std::nullopt;
}

/// Makes the ending NO-GO if the measured sheet that placed the drape is; quotes its first cause.
Ending resting_on(const std::optional<std::string>& no_go, Ending ending) {
  if (!no_go) return ending;
  if (!ending.go) ending.rejected.push_back(ending.verdict);
  ending.go = false;
  ending.verdict = "placed by a measured sheet that is NO-GO: " + *no_go;
  return ending;
}

/// Folders `branch-NN` named in the branches.json of an earlier run in `out`. The list is written
/// before the sheets, so it includes those of an interrupted run.
std::vector<fs::path> earlier_branches(const fs::path& out) {
  static const std::regex of_a_branch("branch-[0-9]+/sheet\\.ply");
  std::vector<fs::path> folders;
  if (!fs::exists(out / "branches.json")) return folders;
  for (const ListedBranch& branch : read_record<BranchList>(out / "branches.json").branches)
    if (has_form(branch.sheet, of_a_branch)) folders.push_back((out / branch.sheet).parent_path());
  return folders;
}

std::vector<fs::path> start_inputs(const RunArguments& args) {
  return args.start ? start_files(*args.start) : std::vector<fs::path>{};
}

/// SCENE, --fabric, --segments, --fit, --start-from, --internal-friction, --out.
void fields(Fields& f, RunArguments& args) {
  f(Field{"scene", "scene.toml: objects, table, pins, start"}.called("SCENE"), args.scene);
  f({"fabric", "fabric.toml; default: the scene's"}, args.fabric);
  f.otherwise({"segments", "line segments per Kawabata curve", 1, 1, 20}, args.options.segments);
  f.otherwise({"fit",
               "drape: fit the curves up to the strains of a first run; whole: fit the measured "
               "range, as the paper"},
              args.fit);
  f({"start_from", "measured sheet.ply, or mesh.toml of another simulator, for start and pins"},
    args.start);
  f.otherwise({"internal_friction",
               "use both branches of the bending and shear loops, which depend on the loading "
               "history, including the scene's start.history"},
              args.options.internal_friction);
  f.otherwise({"out", "folder for the results"}, args.out);
}

/// Describes --coarsest-mm, --seed, --thickness-mm and, with `finest`, --spacing-mm.
void mesh_fields(Fields& f, DrapeOptions& options, bool finest) {
  if (finest)
    f.otherwise({"spacing_mm", "spacing of the finest mesh", mm, 0.5, 50}, options.spacing_m);
  f.otherwise({"coarsest_mm", "spacing of the mesh on which the cloth falls", mm, 0.5, 50},
              options.coarsest_m);
  f.otherwise({"seed", "seed of the meshes' jitter: each gives another mesh", 1, 0, 1000000},
              options.seed);
  f.otherwise({"thickness_mm", "distance below which layers press on each other; 0: they do not",
               mm, 0, 10},
              options.thickness_m);
}

/// Reads the scene, its own or another fabric, and the print. Throws Error(usage) if SCENE is
/// missing; Error(bad_input) for an impossible friction or gravity, or pins farther apart than the
/// fabric was stretched in its tests.
RunInputs read_checked(const fs::path& scene_file, const std::optional<fs::path>& fabric_file) {
  if (scene_file.empty()) throw usage_error("SCENE is missing", "give a scene.toml");
  const Scene scene = read_scene(scene_file);
  RunInputs inputs{scene, read_fabric(fabric_file.value_or(scene.fabric_file)), print_of(scene),
                   std::nullopt};
  check_pins(inputs.scene, inputs.print, inputs.fabric);
  return inputs;
}

/// Reads the measured sheet, or another simulator's mesh, that positions a drape of the scene.
/// Throws Error(bad_input) for a gravity other than Earth's, and for a sheet with another print.
Sheet read_start_of(const fs::path& file, const Scene& scene, const Print& print) {
  require_gravity_of_earth(scene);
  return read_start(file, print);
}

/// Throws Error(bad_input) if the sheet states that it was measured with another scene.
void require_same_drape(const Sheet& reference, const Scene& scene) {
  const auto* source = std::get_if<MeasuredSource>(&reference.source);
  if (source == nullptr || !source->asked_scene || source->asked_scene->name == scene.name) return;
  throw bad_input(fmt::format("the reference is a drape of scene `{}`, not of `{}`",
                              source->asked_scene->name, scene.name),
                  reference.document.where("source.asked_scene"),
                  "give the sheet that was measured of this scene");
}

/// Reads the inputs of `args`. Throws Error(usage), before any change, if --out is missing or an
/// output is one of the inputs.
RunInputs read_run_inputs(const RunArguments& args, const std::vector<fs::path>& outputs) {
  if (args.out.empty()) throw usage_error("--out is missing", "give a folder");
  RunInputs inputs = read_checked(args.scene, args.fabric);
  StepFiles files{outputs, inputs.files()};
  for (const fs::path& file : start_inputs(args)) files.inputs.push_back(file);
  const RunRecord kept_nowhere("drape-simulate", {}, {}, files);
  if (args.start) inputs.measured = read_start_of(*args.start, inputs.scene, inputs.print);
  return inputs;
}

/// Makes the record of a run, including its inputs.
RunRecord record_of(const RunArguments& args, const RunInputs& inputs,
                    std::vector<std::string> words, const fs::path& file) {
  RunRecord record("drape-simulate", std::move(words), file, {{}, start_inputs(args)});
  for (const fs::path& read : inputs.files()) record.input(read);
  return record;
}

/// Sets the range of the curve fits by a first run, if `--fit` asks for it.
void set_reach(RunArguments& args, const RunInputs& inputs) {
  // The paper's model always uses the paper's fit.
  if (args.fit == CurveFit::drape && args.options.model == ClothModel::triangles)
    args.options.reach = find_reach(inputs.scene, inputs.fabric, inputs.print, inputs.measured);
}

/// Files in folders `branch-*` of `out` that a new branch would replace. Throws Error(bad_input) if
/// the list there cannot be read.
std::vector<fs::path> earlier_branch_files(const fs::path& out) {
  (void)earlier_branches(out);  // reports an unreadable list before hours of work
  std::vector<fs::path> files;
  std::error_code absent;
  for (const auto& entry : fs::directory_iterator(out, absent))
    if (entry.path().filename().string().starts_with("branch-"))
      for (const fs::path& file : output_files(entry.path())) files.push_back(file);
  return files;
}

/// Removes the sheets named in an earlier branches.json, then writes the new list before any new
/// sheet: even an interrupted run leaves no unlisted sheet.
void write_branch_list(const fs::path& out, const BranchList& list, RunRecord& record) {
  for (const fs::path& folder : earlier_branches(out)) {
    if (!fs::is_directory(fs::symlink_status(folder))) continue;
    for (const fs::path& file : output_files(folder))
      if (fs::is_regular_file(fs::symlink_status(file))) remove_durable(file);
    std::error_code not_empty;
    fs::remove(folder, not_empty);
  }
  write_record(out / "branches.json", list);
  record.output(out / "branches.json");
}

struct BranchesArguments : RunArguments {
  EnsembleOptions ensemble;
};

void fields(Fields& f, BranchesArguments& args) {
  fields(f, static_cast<RunArguments&>(args));
  mesh_fields(f, args.options.drape, true);
  fields(f, args.ensemble);
}

Ending ending_of(const BranchList& list) {
  Ending ending;
  for (const ListedBranch& branch : list.branches)
    ending.numbers.emplace_back(
        fmt::format("branch {}", branch.number),
        fmt::format("{:.2f} uJ, {} folds, {} of the starts{}{}", branch.energy_j / 1e-6,
                    branch.hem_nodes, branch.starts.size(), branch.sought ? ", sought" : "",
                    branch.stable ? "" : ", a saddle"));
  if (list.unseen)
    ending.numbers.emplace_back(
        "unseen", fmt::format("{:.0f} % of starts may end on other branches, at most {:.0f} % (95 "
                              "%)",
                              100 * list.unseen->fraction, 100 * list.unseen->upper95));
  for (const int start : list.not_at_rest)
    ending.rejected.push_back(fmt::format("start {} did not come to rest", start));
  for (const RefusedStarts& one : list.refused)
    ending.rejected.push_back(
        one.starts.empty() ? "a folded start: " + one.why
                           : fmt::format("start {}: {}", fmt::join(one.starts, ", "), one.why));
  for (const ListedBranch& branch : list.branches)
    if (!branch.not_polished.empty())
      ending.warnings.push_back(fmt::format("branch {} stays on the coarsest mesh: {}",
                                            branch.number, branch.not_polished));
  ending.go = !list.branches.empty();
  ending.verdict = fmt::format("{} equilibri{} from {} starts", list.branches.size(),
                               list.branches.size() == 1 ? "um" : "a", list.starts.value_or(0));
  return ending;
}

int run_branches(BranchesArguments args, std::vector<std::string> words,
                 const CommonOptions& common) {
  const std::vector<fs::path> earlier =
      args.out.empty() ? std::vector<fs::path>{} : earlier_branch_files(args.out);
  const RunInputs inputs = read_run_inputs(args, earlier);
  RunRecord record = record_of(args, inputs, std::move(words), args.out / "branches.run.json");
  set_reach(args, inputs);
  args.ensemble.threads = thread_count(common);
  const SimulateOptions& options = args.options;
  const EnsembleCase own =
      ensemble_case(inputs.scene, inputs.fabric, inputs.print, inputs.measured, options);
  const Ensemble ensemble = find_branches(own, args.ensemble);
  BranchList list = list_of(ensemble, own);
  write_branch_list(args.out, list, record);
  OwnBands bands = bands_of_own(
      ensemble, own, fit_laws(inputs.fabric, options.segments, options.reach), args.ensemble);
  list.friction_band = std::move(bands.friction);
  list.memory_band = std::move(bands.memory);
  list.beyond_first_order = beyond_first_order(ensemble, own, inputs.measured, args.ensemble);
  const std::vector<std::size_t> likely = could_be_real(ensemble);
  std::vector<FinishedBranch> finished;
  for (std::size_t k = 0; k < ensemble.branches.size(); ++k) {
    const bool polish = std::find(likely.begin(), likely.end(), k) != likely.end();
    FinishedBranch& one =
        finished.emplace_back(finish_branch(ensemble, k, own, polish, list.branches[k]));
    one.result.sheet.no_go = no_go_of(inputs.measured);
    write_outputs((args.out / list.branches[k].sheet).parent_path(), one.result, record);
    one.result.drape.reset();  // meshes and factors of many branches need much memory
  }
  if (inputs.measured) {
    list.measured = place_measured(ensemble, own, finished, list.band);
    start_from_measured(own, *list.measured);
  }
  write_record(args.out / "branches.json", list);
  Ending ending = ending_of(list);
  ending.warnings.insert(ending.warnings.begin(), own.fitted.warnings.begin(),
                         own.fitted.warnings.end());
  ending.next_command = fmt::format(
      "drape compare MEASURED.ply {}/branch-*/sheet.ply --store results.sqlite --report "
      "report.html",
      shell_word(args.out.string()));
  return finish(resting_on(no_go_of(inputs.measured), std::move(ending)), common, record);
}

int branches_command(int argc, char** argv) {
  return run_command<BranchesArguments>(
      argc, argv, "drape-simulate branches", "Finds the equilibria of a drape from many starts.",
      run_branches,
      {{"--grid", "--coarsest-mm is the mesh of the starts, --spacing-mm the finest"},
       {"--kicks", "a cloth on two pins falls folded as well, and no other rests are sought"}});
}

struct CertifyArguments {
  fs::path folder, scene;
  std::optional<fs::path> fabric, start;
};

void fields(Fields& f, CertifyArguments& a) {
  f(drape::Field{"folder", "folder of a simulation: sheet.ply, cloth.ply, certificate.json"}.called(
        "FOLDER"),
    a.folder);
  f({"scene", "scene.toml that was simulated"}, a.scene);
  f({"fabric", "fabric.toml; default: the scene's"}, a.fabric);
  f({"start_from", "measured sheet.ply that gives the positions of pins that state none"}, a.start);
}

void require_same_files(CertifyReport& report, const Sheet& sheet, const Scene& scene,
                        const Fabric& fabric) {
  const auto* source = std::get_if<SimulatedSource>(&sheet.source);
  if (source == nullptr) return;
  if (source->scene_sha256 != scene.document.sha256())
    report.refusals.emplace_back("the sheet was simulated from another content of the scene file");
  if (source->fabric_sha256 != fabric_sha256(fabric))
    report.refusals.emplace_back("the sheet was simulated from another content of the fabric");
}

int run_certify(const CertifyArguments& arguments, std::vector<std::string> words,
                const CommonOptions& common) {
  RunRecord record("drape-simulate", std::move(words), arguments.folder / "certify.run.json");
  const RestFiles files = read_rest_files(arguments.folder);
  RunInputs inputs = read_checked(arguments.scene, arguments.fabric);
  if (arguments.start) {
    inputs.measured = read_start_of(*arguments.start, inputs.scene, inputs.print);
    for (const fs::path& file : start_files(*arguments.start)) record.input(file);
  }
  CertifyReport report = certify(files, inputs.scene, inputs.fabric, inputs.print, inputs.measured);
  require_same_files(report, files.sheet, inputs.scene, inputs.fabric);
  for (const fs::path& file : inputs.files()) record.input(file);
  for (const fs::path& file : files.files) record.input(file);
  Ending ending;
  ending.go = report.accepted();
  ending.verdict = !ending.go ? "the certificate is refused"
                   : files.certificate.at_rest
                       ? "the certificate holds: the cloth can rest as it is"
                       : "the numbers hold; no rest is claimed";
  for (const CertifyLine& line : report.lines) {
    const std::string text = line.is_limit
                                 ? fmt::format("{:.6g}, at most {:.6g}", line.found, line.allowed)
                                 : fmt::format("{:.9g}, claimed {:.9g}", line.found, line.claimed);
    ending.numbers.emplace_back(line.what, text);
    if (!line.passes()) ending.rejected.push_back(line.what + ": " + text);
  }
  ending.rejected.insert(ending.rejected.end(), report.refusals.begin(), report.refusals.end());
  ending.warnings = report.warnings;
  ending.next_command =
      fmt::format("more {}", shell_word((arguments.folder / "certificate.json").string()));
  return finish(resting_on(files.sheet.no_go, std::move(ending)), common, record);
}

int certify_command(int argc, char** argv) {
  return run_command<CertifyArguments>(
      argc, argv, "drape-simulate certify",
      "Checks the stored cloth of a simulation with independent code.", run_certify);
}

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

int sensitivity_command(int argc, char** argv) {
  return run_command<SensitivityArguments>(
      argc, argv, "drape-simulate sensitivity",
      "Computes the effects of fabric and scene values, and of parts of the model, on a drape.",
      run_sensitivity,
      {{"--grid", "--spacing-mm says the finest mesh"},
       {"--starts", "drape simulate branches finds the branches"},
       {"--only-first-order", "it is the default; --variants adds the changed models"}});
}

struct SimulateArguments : RunArguments {
  bool paper = false, check_objects = false, sensitivity = false;
  std::optional<int> grid;
  std::optional<fs::path> outline;
};

void fields(Fields& f, SimulateArguments& args) {
  fields(f, static_cast<RunArguments&>(args));
  mesh_fields(f, args.options.drape, true);
  f.otherwise({"from_measured", "start from the measured shape instead of the scene's start"},
              args.options.from_measured);
  f({"outline",
     "outline of the cloth: SVG (x along the weft, y along the warp, size in mm) or CSV "
     "(ring,warp_mm,weft_mm) in the frame of the print's patch; default: the whole patch"},
    args.outline);
  f.otherwise({"paper", "use the particle grid of the paper instead of the mesh"}, args.paper);
  f({"grid", "particles per side, with --paper (default: 21)", 1, 3, 401}, args.grid);
  fields(f, args.options.paper);
  f.otherwise({"sensitivity",
               "also write sensitivity.json: first-order displacement of each mark of --start-from "
               "with each value of fabric and scene at this rest"},
              args.sensitivity);
  f.otherwise({"check_objects", "only read and check the scene's objects"}, args.check_objects);
  f.rule(args.paper || !args.grid, "grid", "--grid belongs to --paper",
         "--spacing-mm says the finest mesh of the cloth");
  f.rule(!args.paper || (!args.outline && !args.options.from_measured), "paper",
         "--paper drapes the whole patch from the scene's start",
         "leave out --outline and --from-measured");
  f.rule(!args.sensitivity || (args.start && !args.paper && !args.options.internal_friction),
         "sensitivity", "--sensitivity measures a cloth without memory from a measured sheet",
         "give --start-from SHEET, and neither --paper nor --internal-friction");
  args.options.model = args.paper ? ClothModel::paper : ClothModel::triangles;
  if (args.grid) args.options.paper.rows = args.options.paper.cols = *args.grid;
}

std::vector<std::pair<std::string, std::string>> numbers_of(const Certificate& certificate) {
  std::vector<std::pair<std::string, std::string>> numbers;
  if (certificate.residual)
    numbers.emplace_back("largest residual force",
                         fmt::format("{:.2g} of a point's weight", *certificate.residual));
  if (const auto& strains = certificate.strains)
    numbers.emplace_back(
        "strain warp, weft",
        fmt::format("{:.2f} to {:.2f} %, {:.2f} to {:.2f} %", 1e2 * strains->warp.x(),
                    1e2 * strains->warp.y(), 1e2 * strains->weft.x(), 1e2 * strains->weft.y()));
  if (const auto& distances = certificate.distances)
    numbers.emplace_back("deepest in an object",
                         fmt::format("{:.3f} mm", distances->deepest_m / units::mm));
  if (const auto& check = certificate.check)
    numbers.emplace_back(
        "independent check",
        check->accepted ? fmt::format("accepted, {:.2g} of a point's weight left", check->residual)
                        : "refused");
  return numbers;
}

/// Ending of drape-simulate: NO-GO if the cloth did not come to rest.
Ending ending_of(const SimulateResult& result, const fs::path& out) {
  const Certificate& certificate = result.certificate;
  Ending ending;
  ending.go = certificate.at_rest;
  ending.verdict = certificate.status;
  ending = resting_on(result.sheet.no_go, std::move(ending));
  ending.numbers = numbers_of(certificate);
  if (result.levels) ending.numbers.emplace_back("mesh", mesh_error_sentence(*result.levels));
  ending.warnings = certificate.warnings;
  if (certificate.check) ending.rejected = certificate.check->refused;
  ending.next_command = fmt::format(
      "drape compare MEASURED.ply {} --calibration FILE --store results.sqlite --report "
      "report.html",
      shell_word((out / "sheet.ply").string()));
  return ending;
}

/// Reads a scene's objects; throws Error for an impossible one, such as a mesh in another unit.
Ending objects_read(const fs::path& scene) {
  if (scene.empty()) throw usage_error("SCENE is missing", "give a scene.toml");
  const Surroundings around(read_scene(scene));
  Ending ending;
  ending.verdict = fmt::format("table and objects are read, {} together", around.count());
  return ending;
}

int run_simulate(SimulateArguments args, std::vector<std::string> words,
                 const CommonOptions& common) {
  if (args.check_objects) return finish(objects_read(args.scene), common);
  RunInputs inputs = read_run_inputs(args, output_files(args.out));
  RunRecord record =
      record_of(args, inputs, std::move(words), run_record_path(args.out / "sheet.ply"));
  if (args.outline) {
    record.input(*args.outline);
    args.options.outline = read_outline(*args.outline, args.options.drape.spacing_m);
  }
  set_reach(args, inputs);
  Progress progress("simulate", common.quiet);
  args.options.progress = [&](double fraction) { progress.update(fraction, ""); };
  SimulateResult result =
      simulate(inputs.scene, inputs.fabric, inputs.print, inputs.measured, args.options);
  result.sheet.no_go = no_go_of(inputs.measured);
  write_outputs(args.out, result, record);
  if (args.sensitivity) {
    const fs::path written = args.out / kSensitivityName;
    write_record(written,
                 sensitivities_of(result, inputs.fabric, *inputs.measured, {args.options}));
    record.output(written);
  }
  return finish(ending_of(result, args.out), common, record);
}

int simulate_command(int argc, char** argv) {
  return run_command<SimulateArguments>(
      argc, argv, "drape-simulate", "Drapes a fabric over the objects of a scene until it rests.",
      run_simulate,
      {{"--model", "--paper drapes the particle grid of the paper"},
       {"--solver", "there is one way to rest"},
       {"--round", "--outline cuts the cloth; drape simulate cusick is the drapemeter"}});
}

}  // namespace
}  // namespace drape::simulate

int main(int argc, char** argv) {
  using namespace drape::simulate;
  return drape::run_stage(
      argc, argv, simulate_command,
      {{"study", study_command, "drapes every scene of a rig on several meshes or grids"},
       {"branches", branches_command, "finds the equilibria of a drape from many starts"},
       {"sensitivity", sensitivity_command,
        "computes the effects of fabric and scene values on a drape"},
       {"certify", certify_command, "checks a simulation with independent code"},
       {"fabric", fabric_command, "checks, shows, lists and imports fabrics"},
       {"cusick", cusick_command, "drapes a round specimen between two discs"}});
}
