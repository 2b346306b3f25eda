// SPDX-License-Identifier: Apache-2.0
#include "simulate/study/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

#include "core/error.hpp"
#include "core/files/csv.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"
#include "simulate/ensemble/band.hpp"
#include "simulate/ensemble/checked.hpp"
#include "simulate/equilibrium/mixture.hpp"
#include "simulate/objects/scene_files.hpp"
#include "simulate/start/clamps.hpp"
#include "simulate/start/local_frame.hpp"
#include "simulate/start/start_check.hpp"

namespace drape::simulate {

namespace {

namespace fs = std::filesystem;

/// Words that make a run a different one, for the record.
std::vector<std::string> words_of(const StudyCase& the_case, const StudyOptions& options) {
  if (!the_case.key.empty()) return {"study", "--key", the_case.key};
  std::vector<std::string> words = {
      "study",          the_case.scene_file.string(),
      "--model",        std::string(drape::name_of(the_case.model)),
      "--grid",         std::to_string(the_case.grid),
      "--segments",     std::to_string(the_case.segments),
      "--max-steps",    std::to_string(options.simulate.max_steps),
      "--thickness-mm", fmt::format("{}", options.simulate.cloth_thickness_m / units::mm),
      "--solvers"};
  for (const Solver solver : options.solvers) words.emplace_back(drape::name_of(solver));
  return words;
}

/// Outcome as outcome_from() reads it in the certificate that write_outputs() leaves.
StudyOutcome outcome_of(const StudyCase& the_case, const SimulateReport& report, Solver solver) {
  const auto or_none = [](double value) { return std::isfinite(value) ? value : 0; };
  StudyOutcome outcome;
  outcome.the_case = the_case;
  outcome.at_rest = report.status == RestStatus::at_rest;
  outcome.sentence = report.sentence;
  outcome.solver = drape::name_of(solver);
  outcome.residual = or_none(report.residual);
  outcome.energy_j = 1e-6 * or_none(report.energy_end_j / 1e-6);
  return outcome;
}

/// The static solver is left out for the model `paper` where there is another.
std::vector<Solver> solvers_of(const StudyCase& the_case, const StudyOptions& options) {
  std::vector<Solver> solvers = options.solvers;
  if (the_case.model == ClothModel::paper && solvers.size() > 1)
    std::erase(solvers, Solver::newton);
  return solvers;
}

StudyOutcome simulate_case(const StudyCase& the_case, const StudyOptions& options) {
  RunRecord record("drape-simulate", words_of(the_case, options),
                   run_record_path(the_case.folder / "sheet.ply"));
  CaseInputs inputs = read_inputs(the_case);
  SimulateOptions how = prepare_case(the_case, options, inputs);
  const auto& [scene, fabric, print] = inputs;
  for (const fs::path& file : files_of(scene, fabric)) record.input(file);
  SimulateResult best;
  SimulateOptions used = how;
  bool first = true;
  for (const Solver solver : solvers_of(the_case, options)) {
    how.solver = solver;
    SimulateResult result = simulate_checked(scene, fabric, print, std::nullopt, how);
    const bool rests = result.report.status == RestStatus::at_rest;
    if (first || rests) {
      best = std::move(result);
      used = how;
    }
    first = false;
    if (rests) break;
  }
  write_outputs(the_case.folder, best, used, record);
  const bool rests = best.report.status == RestStatus::at_rest;
  record.write(rests ? 0 : 1, {.go = rests, .verdict = best.report.sentence});
  return outcome_of(the_case, best.report, used.solver);
}

/// A case that is listed twice would be counted twice.
template <typename T>
void require_once(const char* what, std::vector<T> values) {
  std::sort(values.begin(), values.end());
  const auto twice = std::adjacent_find(values.begin(), values.end());
  if (twice != values.end())
    throw usage_error(fmt::format("{} {} is listed twice", what, *twice), "list it once");
}

struct Side {
  int grid, segments;
};

/// The pairs of the paper's even tables, in their order.
constexpr std::array<std::pair<Side, Side>, 6> kPairs = {{{{11, 5}, {11, 1}},
                                                          {{21, 5}, {21, 1}},
                                                          {{11, 1}, {21, 1}},
                                                          {{11, 5}, {21, 5}},
                                                          {{11, 5}, {31, 5}},
                                                          {{21, 5}, {31, 5}}}};

/// Printed mean distances in mm by experiment, grid, segments, other grid, other segments.
using Printed = std::map<std::tuple<std::string, int, int, int, int>, double>;

Printed read_printed(const std::filesystem::path& file) {
  Printed printed;
  const CsvText csv = read_csv_text(file);
  for (std::size_t row = 0; row < csv.rows.size(); ++row) {
    const auto mean_mm = csv.number(row, "mean_distance_mm");
    if (!mean_mm || csv.rows[row][csv.column("kind")] != "virtual-virtual") continue;
    const auto whole = [&](const char* name) {
      return static_cast<int>(csv.number(row, name).value_or(0));
    };
    printed[{csv.rows[row][csv.column("experiment")], whole("grid"), whole("segments"),
             whole("against_grid"), whole("against_segments")}] = *mean_mm;
  }
  return printed;
}

class Tables {
 public:
  Tables(const std::vector<StudyOutcome>& outcomes, Printed printed)
      : printed_(std::move(printed)) {
    for (const StudyOutcome& o : outcomes) {
      found_[{o.the_case.scene, o.the_case.model, o.the_case.grid, o.the_case.segments}] = &o;
      const StudyCase*& coarsest = coarsest_[o.the_case.scene];
      if (coarsest == nullptr || o.the_case.grid < coarsest->grid) coarsest = &o.the_case;
    }
  }

  std::string row(const std::string& scene, ClothModel model) const {
    std::string text = fmt::format("| {} | {} |", scene, drape::name_of(model));
    for (const auto& [a, b] : kPairs) {
      const std::string cell = this->cell(scene, model, a, b);
      const auto print = printed_.find({scene, a.grid, a.segments, b.grid, b.segments});
      text += " " + cell + (print == printed_.end() ? "" : fmt::format(" ({:g})", print->second)) +
              " |";
    }
    return text + "\n";
  }

 private:
  /// The mean distance in mm; "*" marks a sheet that is not at rest, "-" a run that is missing.
  std::string cell(const std::string& scene, ClothModel model, Side a, Side b) const {
    const auto first = found_.find({scene, model, a.grid, a.segments});
    const auto second = found_.find({scene, model, b.grid, b.segments});
    if (first == found_.end() || second == found_.end()) return "-";
    const std::optional<double> distance =
        mean_distance_m(read_sheet(first->second->the_case.folder / "sheet.ply"),
                        read_sheet(second->second->the_case.folder / "sheet.ply"),
                        read_sheet(coarsest_.at(scene)->folder / "sheet.ply"));
    if (!distance) return "-";
    return fmt::format("{:.2f}{}", *distance / units::mm,
                       first->second->at_rest && second->second->at_rest ? "" : "*");
  }

  Printed printed_;
  std::map<std::tuple<std::string, ClothModel, int, int>, const StudyOutcome*> found_;
  std::map<std::string, const StudyCase*> coarsest_;
};

}  // namespace

StudyOutcome outcome_from(const StudyCase& the_case) {
  const JsonNode certificate =
      JsonNode::open(the_case.folder / "certificate.json", "certificate", 1);
  StudyOutcome outcome;
  outcome.the_case = the_case;
  outcome.at_rest = certificate.boolean("at_rest");
  outcome.sentence = certificate.text("status");
  outcome.solver = certificate.at("options").text("solver");
  // A diverged run has no finite residual, and its file says null.
  outcome.residual =
      certificate.optional_number("largest_residual_per_particle_weight").value_or(0);
  outcome.energy_j = 1e-6 * certificate.at("energy").optional_number("end_uJ").value_or(0);
  return outcome;
}

Scene seeded(Scene scene, int seed, double& imperfection_m) {
  if (seed == 0) return scene;
  if (scene.start.mode != StartMode::flat || !scene.start.centre_in_world)
    throw bad_input("a seed needs a scene that starts flat at a given centre",
                    {.file = scene.file.string(), .field = "start.mode"}, "leave out the seeds");
  const StartVariation variation = variation_of(seed);
  scene.start.yaw_rad += variation.yaw_rad;
  *scene.start.centre_in_world +=
      Eigen::Vector3d(variation.place_m.x(), variation.place_m.y(), variation.lift_m);
  imperfection_m = variation.noise_m;
  return scene;
}

CaseInputs read_inputs(const StudyCase& the_case) {
  CaseInputs inputs;
  inputs.scene = read_scene(the_case.scene_file);
  if (!the_case.fabric_file.empty()) inputs.scene.fabric_file = the_case.fabric_file;
  inputs.fabric = read_fabric(inputs.scene.fabric_file);
  inputs.print = read_print(inputs.scene.print_file);
  return inputs;
}

SimulateOptions prepare_case(const StudyCase& the_case, const StudyOptions& options,
                             CaseInputs& inputs) {
  Scene& scene = inputs.scene;
  SimulateOptions how = options.simulate;
  how.rows = how.cols = the_case.grid;
  how.segments = the_case.segments;
  how.model = the_case.model;
  how.solver = solvers_of(the_case, options).front();
  how.check();
  scene = seeded(std::move(scene), the_case.seed, how.imperfection_m);
  if (scene.start.mode != StartMode::flat) (void)need_measured(std::nullopt, scene);
  check_pins(scene, inputs.print, inputs.fabric);
  (void)check_clamps(scene, {how.rows, how.cols, inputs.print.patch_m, how.round});
  return how;
}

StudyOutcome run_case(const StudyCase& the_case, const StudyOptions& options,
                      const fs::path& program) {
  const fs::path record = run_record_path(the_case.folder / "sheet.ply");
  const bool kept = is_up_to_date(record, program, words_of(the_case, options));
  StudyOutcome outcome = kept ? outcome_from(the_case) : simulate_case(the_case, options);
  outcome.kept = kept;
  return outcome;
}

void fields(Fields& f, StudyOptions& options) {
  f.otherwise({"grids", "particles per side"}, options.grids);
  f.otherwise({"segments", "line segments per Kawabata curve"}, options.segments);
  f.otherwise({"models", "models of the cloth"}, options.models);
  f.otherwise({"solvers", "tried in this order until one comes to rest"}, options.solvers);
  f.otherwise({"max_steps", "step limit of a run", 1, 1}, options.simulate.max_steps);
  f.otherwise(
      {"thickness_mm", "layers of cloth keep this apart; 0: the sheet passes through itself (rk4)",
       units::mm, 0},
      options.simulate.cloth_thickness_m);
}

void StudyOptions::check() const {
  if (grids.empty() || segments.empty() || models.empty() || solvers.empty())
    throw usage_error("a list of the study is empty", "give e.g. --grids 11,21 --segments 1,5");
  if (std::find(solvers.begin(), solvers.end(), Solver::fall) != solvers.end())
    throw usage_error("a study has no solver `fall`", "use --solvers rk4,static");
  std::vector<std::string_view> names;
  for (const ClothModel model : models) names.push_back(drape::name_of(model));
  require_once("grid", grids);
  require_once("number of segments", segments);
  require_once("model", names);
}

std::vector<StudyCase> study_cases(const fs::path& rig, const fs::path& out,
                                   const StudyOptions& options) {
  options.check();
  std::vector<fs::path> files;
  const fs::path folder = rig / "scenes";
  if (!fs::is_directory(folder))
    throw bad_input("the rig has no folder `scenes`", {.file = rig.string()},
                    "give a rig folder, e.g. rigs/paper");
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (const std::string& name : options.scenes) {
    if (std::none_of(files.begin(), files.end(),
                     [&](const fs::path& f) { return f.stem() == name; }))
      throw usage_error(fmt::format("the rig has no scene `{}`", name),
                        fmt::format("see {}", folder.string()));
  }
  std::vector<StudyCase> cases;
  for (const fs::path& file : files) {
    const std::string name = file.stem().string();
    if (!options.scenes.empty() &&
        std::find(options.scenes.begin(), options.scenes.end(), name) == options.scenes.end())
      continue;
    for (const ClothModel model : options.models) {
      for (const int grid : options.grids) {
        for (const int segments : options.segments) {
          cases.push_back(
              {file, name, model, grid, segments,
               out / name / drape::name_of(model) / fmt::format("{}-{}", grid, segments)});
        }
      }
    }
  }
  return cases;
}

std::vector<StudyOutcome> run_study(const std::vector<StudyCase>& cases,
                                    const StudyOptions& options, const fs::path& program,
                                    const std::function<void(const StudyOutcome&)>& done) {
  return run_cases(
      cases, options.threads, [&](const StudyCase& one) { return run_case(one, options, program); },
      done);
}

std::optional<double> mean_distance_m(const Sheet& a, const Sheet& b, const Sheet& coarsest) {
  const GridSpec grid_a = grid_of(a), grid_b = grid_of(b);
  const Field field_a = field_of(a), field_b = field_of(b);
  double sum = 0;
  for (const SheetMark& particle : coarsest.marks)
    sum += (mix(field_a, hold_at(grid_a, particle.material_m)) -
            mix(field_b, hold_at(grid_b, particle.material_m)))
               .norm();
  sum /= static_cast<double>(coarsest.marks.size());
  return std::isfinite(sum) ? std::optional(sum) : std::nullopt;
}

std::string study_csv(const std::vector<StudyOutcome>& outcomes) {
  std::string text =
      "scene,model,grid,segments,solver,at_rest,largest_residual_per_particle_weight,energy_uJ,"
      "status\n";
  for (const StudyOutcome& o : outcomes) {
    text += fmt::format("{},{},{},{},{},{},{},{},\"{}\"\n", csv_cell(o.the_case.scene),
                        drape::name_of(o.the_case.model), o.the_case.grid, o.the_case.segments,
                        o.solver, o.at_rest ? 1 : 0, o.residual, o.energy_j * 1e6, o.sentence);
  }
  return text;
}

void write_outputs(const fs::path& out, const SimulateResult& result,
                   const SimulateOptions& options, RunRecord& record) {
  write_sheet(out / "sheet.ply", result.sheet);
  write_durable(out / "history.csv", history_csv(result.history));
  write_certificate(out / "certificate.json", result, options);
  for (const char* name : {"sheet.ply", "sheet.json", "history.csv", "certificate.json"}) {
    record.output(out / name);
  }
  // Files that an earlier run left there are no part of this drape.
  const auto write_or_remove = [&](const char* name, const std::string& text) {
    if (text.empty()) return remove_durable(out / name);
    write_durable(out / name, text);
    record.output(out / name);
  };
  write_or_remove("memory.csv", result.memory ? memory_csv(*result.memory) : "");
  write_or_remove("contact_forces.csv",
                  result.contact_forces.empty() ? "" : contact_forces_csv(result.contact_forces));
}

std::string study_tables(const std::vector<StudyOutcome>& outcomes,
                         const std::optional<std::filesystem::path>& published) {
  std::string text =
      "Mean distance in mm at the particles of the scene's coarsest grid (in brackets: as the "
      "paper "
      "prints it; *: not at rest)\n\n| scene | model |";
  for (const auto& [a, b] : kPairs) {
    text += a.grid == b.grid ? fmt::format(" {}: {} vs {} seg |", a.grid, a.segments, b.segments)
                             : fmt::format(" {} seg: {} vs {} |", a.segments, a.grid, b.grid);
  }
  text += "\n|---|---|---|---|---|---|---|---|\n";
  const Tables tables(outcomes, published ? read_printed(*published) : Printed{});
  std::pair<std::string, ClothModel> last;
  for (const StudyOutcome& o : outcomes) {
    const std::pair<std::string, ClothModel> now{o.the_case.scene, o.the_case.model};
    if (now != last) text += tables.row(now.first, now.second);
    last = now;
  }
  return text;
}

}  // namespace drape::simulate
