// SPDX-License-Identifier: Apache-2.0
#include "simulate/study/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <tuple>

#include "core/files/files.hpp"
#include "core/matching.hpp"
#include "core/scene.hpp"
#include "core/units.hpp"
#include "simulate/objects/cloth_files.hpp"
#include "simulate/start/start.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr double kMostCases = 1e6;  ///< largest number of cases, since all are held in memory

/// SHA-256 of files, each read only once.
class Hashes {
 public:
  const std::string& of(const fs::path& file) {
    std::string& hash = known_[file.string()];
    if (hash.empty()) hash = sha256_of_file(file);
    return hash;
  }

 private:
  std::map<std::string, std::string> known_;
};

std::string key_of(const StudyCase& one, const std::vector<fs::path>& files,
                   const fs::path& program, Hashes& hashes) {
  const SimulateOptions& how = one.options;
  std::string text = fmt::format(
      "drapebench/study-key/2\nprogram {}\nmodel {}\ncloth {}\nsegments {}\nseed {}\n"
      "thickness_mm {}\n",
      hashes.of(program), drape::name_of(how.model), one.discretisation(), how.segments, one.seed,
      how.drape.thickness_m / mm);
  if (how.model == ClothModel::paper) text += fmt::format("steps {}\n", how.paper.max_steps);
  for (const fs::path& file : files) text += "file " + hashes.of(file) + "\n";
  return sha256_of(std::string_view(text));
}

template <class List>
void require_each_once(Fields& f, const char* name, List sorted) {
  std::sort(sorted.begin(), sorted.end());
  f.limit(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end(), name,
          "a value is listed twice", "list it once");
}

/// The lists that both a plan and the command line have.
template <class Lists>
void list_fields(Fields& f, Lists& lists) {
  f.otherwise({"grids", "particles per side of the paper's model", 1, 3, 401}, lists.grids);
  f.otherwise({"spacings_mm", "spacings of the finest meshes", mm, 0.5, 50}, lists.spacings_m);
  f.otherwise({"segments", "line segments per Kawabata curve", 1, 1, 20}, lists.segments);
  require_each_once(f, "grids", lists.grids);
  require_each_once(f, "spacings_mm", lists.spacings_m);
  require_each_once(f, "segments", lists.segments);
}

/// Default plan of a rig without plan.toml.
PlanFile plan_of_scenes(const fs::path& rig) {
  PlanFile plan;
  if (!fs::is_directory(rig / "scenes"))
    throw bad_input("the rig has no plan.toml and no folder `scenes`", {.file = rig.string()},
                    "give a plan.toml or a rig folder, e.g. rigs/paper");
  for (const auto& entry : fs::directory_iterator(rig / "scenes"))
    if (entry.path().extension() == ".toml") plan.scenes.push_back(entry.path());
  std::sort(plan.scenes.begin(), plan.scenes.end());
  return plan;
}

PlanFile read_plan_file(const fs::path& file) {
  const Document document = Document::read(file);
  for (const auto& [gone, remedy] :
       {std::pair("models", "write model = \"paper\" for the paper's grids, nothing for the cloth"),
        std::pair("solvers", "leave it out: there is one way to rest")})
    if (document.root().find(gone) != nullptr)
      throw bad_input(fmt::format("a plan has no `{}` any more", gone), document.where(gone),
                      remedy);
  return read_record<PlanFile>(document);
}

/// Applies the lists given on the command line.
void choose(const PlanChoice& choice, const fs::path& rig, PlanFile& plan) {
  for (const std::string& name : choice.scenes)
    if (std::none_of(plan.scenes.begin(), plan.scenes.end(),
                     [&](const fs::path& file) { return file.stem() == name; }))
      throw usage_error(fmt::format("the rig has no scene `{}`", name),
                        fmt::format("see {}", (rig / "scenes").string()));
  if (!choice.scenes.empty())
    std::erase_if(plan.scenes, [&](const fs::path& file) {
      return std::find(choice.scenes.begin(), choice.scenes.end(), file.stem()) ==
             choice.scenes.end();
    });
  if (!choice.grids.empty() && plan.model != ClothModel::paper)
    throw usage_error("--grids belongs to the paper's model, which this rig's plan does not name",
                      "give --spacings-mm");
  if (!choice.grids.empty()) plan.grids = choice.grids;
  if (!choice.segments.empty()) plan.segments = choice.segments;
  if (!choice.spacings_m.empty()) plan.spacings_m = choice.spacings_m;
}

/// Options for each combination of model, grid or spacing, and number of segments.
std::vector<SimulateOptions> options_of(const PlanFile& plan) {
  std::vector<SimulateOptions> all;
  SimulateOptions how = plan.simulate;
  const auto add = [&] {
    for (const int segments : plan.segments) {
      how.segments = segments;
      all.push_back(how);
    }
  };
  how.model = ClothModel::paper;
  if (plan.model == ClothModel::paper)
    for (const int grid : plan.grids) {
      how.paper.rows = how.paper.cols = grid;
      add();
    }
  how.model = ClothModel::triangles;
  for (const double spacing_m : plan.spacings_m) {
    how.drape.spacing_m = spacing_m;
    add();
  }
  return all;
}

fs::path record_of(const StudyCase& one) {
  return run_record_path(one.folder / "sheet.ply");
}

std::vector<std::string> words_of(const StudyCase& one) {
  return {"study", "--key", one.key};
}

/// Input files of a case; the scene includes the start given by the seed.
struct CaseInputs {
  Scene scene;
  Fabric fabric;
  Print print;
};

CaseInputs read_inputs(const StudyCase& one) {
  Scene scene = read_scene(one.scene_file);
  scene.fabric_file = one.fabric_file;
  return {scene, read_fabric(one.fabric_file), print_of(scene)};
}

/// Sets the start of the seed. Throws Error for a case that is impossible before it is
/// draped.
CaseInputs prepared(CaseInputs inputs, const StudyCase& one) {
  inputs.scene = seeded(std::move(inputs.scene), one.seed);
  one.options.check();
  if (inputs.scene.start.mode != StartMode::flat) (void)need_measured(std::nullopt, inputs.scene);
  check_pins(inputs.scene, inputs.print, inputs.fabric);
  return inputs;
}

void simulate_case(const StudyCase& one) {
  RunRecord record("drape-simulate", words_of(one), record_of(one));
  const CaseInputs inputs = prepared(read_inputs(one), one);
  for (const fs::path& file : files_of(inputs.scene, inputs.fabric)) record.input(file);
  const SimulateResult result =
      simulate(inputs.scene, inputs.fabric, inputs.print, std::nullopt, one.options);
  write_outputs(one.folder, result, record);
  const bool rests = result.at_rest();
  record.write(rests ? 0 : 1, {.go = rests, .verdict = result.certificate.status});
}

void read_certificate_of(const StudyCase& one, StudyOutcome& outcome) {
  const Certificate certificate = read_certificate(one.folder / "certificate.json");
  outcome.state = CaseState::done;
  outcome.at_rest = certificate.at_rest;
  outcome.status = certificate.status;
  outcome.residual = certificate.residual;
  if (certificate.energies) outcome.energy_j = certificate.energies->end_j;
}

fs::path failure_of(const StudyCase& one) {
  return one.folder / "failed.txt";
}

/// Locks a case; null if another run is computing it.
std::unique_ptr<WriterLock> lock_of(const StudyCase& one) {
  const std::string held = "this case is being computed";
  try {
    return std::make_unique<WriterLock>(one.folder / "lock", held);
  } catch (const Error& error) {
    if (error.what_failed() != held) throw;  // the lock cannot be written
    return nullptr;
  }
}

/// True if the record belongs to this case and ending and outputs match it. Program and inputs are
/// part of the case's key.
bool is_whole(const StudyCase& one) {
  const fs::path record = record_of(one);
  try {
    const RunFile run = read_run_file(record);
    return run.arguments == words_of(one) &&
           run.ending_sha256 == sha256_of_file(ending_path(record)) &&
           std::all_of(run.outputs.begin(), run.outputs.end(),
                       [&](const RecordedFile& output) { return is_as_recorded(record, output); });
  } catch (const Error&) {
    return false;
  }
}

StudyOutcome run_case(const StudyCase& one) {
  StudyOutcome outcome{one};
  const std::unique_ptr<WriterLock> lock = lock_of(one);
  if (!lock) {
    outcome.state = CaseState::computing;
    return outcome;
  }
  try {
    outcome.kept = is_whole(one);
    if (!outcome.kept) simulate_case(one);
    read_certificate_of(one, outcome);
    fs::remove(failure_of(one));
  } catch (const Error& error) {
    // An output that cannot be written ends the study; it says nothing about the case.
    if (error.where().file.starts_with(one.folder.string())) throw;
    outcome.status = error.what();
    outcome.state = CaseState::failed;
    write_durable(failure_of(one), outcome.status + "\n");
  }
  return outcome;
}

StudyOutcome look_at(const StudyCase& one) {
  StudyOutcome outcome{one};
  const bool has_record = fs::is_regular_file(record_of(one));
  if (has_record && is_whole(one)) {
    read_certificate_of(one, outcome);
  } else if (fs::exists(one.folder / "lock") && !lock_of(one)) {
    outcome.state = CaseState::computing;
  } else if (has_record) {
    outcome.state = CaseState::failed;
    outcome.status = "its files are not those of its record; run the study again";
  } else if (fs::exists(failure_of(one))) {
    outcome.state = CaseState::failed;
    outcome.status = read_text(failure_of(one));
  }
  return outcome;
}

bool is_whole(const Sheet& sheet) {
  return sheet.rows > 1 && sheet.cols > 1 &&
         sheet.marks.size() == static_cast<std::size_t>(sheet.rows) * sheet.cols;
}

/// Bilinear interpolation on a complete sheet with equally spaced points from hem to hem.
Vector3d point_on(const Sheet& sheet, const Vector2d& material_m) {
  const Vector2d at = material_m.cwiseQuotient(sheet.patch_m)
                          .cwiseProduct(Vector2d(sheet.rows - 1, sheet.cols - 1));
  const int r = std::clamp(static_cast<int>(at.x()), 0, sheet.rows - 2);
  const int c = std::clamp(static_cast<int>(at.y()), 0, sheet.cols - 2);
  const double down = at.x() - r, across = at.y() - c;
  const auto corner = [&](int row, int col) {
    return sheet.marks[static_cast<std::size_t>(row) * sheet.cols + col].point_in_world;
  };
  return (1 - down) * ((1 - across) * corner(r, c) + across * corner(r, c + 1)) +
         down * ((1 - across) * corner(r + 1, c) + across * corner(r + 1, c + 1));
}

struct Side {
  int grid, segments;
};

/// The pairs of the paper's even-numbered tables, in order.
constexpr std::array<std::pair<Side, Side>, 6> kPairs = {{{{11, 5}, {11, 1}},
                                                          {{21, 5}, {21, 1}},
                                                          {{11, 1}, {21, 1}},
                                                          {{11, 5}, {21, 5}},
                                                          {{11, 5}, {31, 5}},
                                                          {{21, 5}, {31, 5}}}};

/// Published mean distances in mm by experiment, grid, segments, other grid, other segments.
using Printed = std::map<std::tuple<std::string, int, int, int, int>, double>;

Printed read_printed(const fs::path& file) {
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

/// Drapes of one scene, with the sheet at whose points they are compared.
class SceneDrapes {
 public:
  void add(const StudyOutcome& outcome) {
    if (outcome.state != CaseState::done) return;
    const StudyCase& one = outcome.the_case;
    drapes_.emplace_back(&outcome, read_sheet(one.folder / "sheet.ply"));
  }
  /// Mean distance in mm; "*" marks a sheet that is not at rest, "-" a missing drape.
  [[nodiscard]] std::string cell(const std::string& a, int segments_a, const std::string& b,
                                 int segments_b) const {
    const auto *first = find(a, segments_a), *second = find(b, segments_b);
    if (first == nullptr || second == nullptr) return "-";
    const auto coarsest =
        std::min_element(drapes_.begin(), drapes_.end(), [](const auto& one, const auto& other) {
          return one.second.marks.size() < other.second.marks.size();
        });
    const auto distance = mean_distance_m(first->second, second->second, coarsest->second);
    if (!distance) return "-";
    return fmt::format("{:.2f}{}", *distance / units::mm,
                       first->first->at_rest && second->first->at_rest ? "" : "*");
  }

 private:
  using One = std::pair<const StudyOutcome*, Sheet>;
  [[nodiscard]] const One* find(const std::string& cloth, int segments) const {
    for (const One& one : drapes_)
      if (one.first->the_case.discretisation() == cloth &&
          one.first->the_case.options.segments == segments)
        return &one;
    return nullptr;
  }
  std::vector<One> drapes_;
};

std::string paper_table(const std::vector<std::string>& scenes,
                        const std::map<std::string, SceneDrapes>& drapes, const Printed& printed) {
  std::string text =
      "Mean distance in mm by the paper's model at the points of the scene's coarsest sheet (in "
      "brackets: as the paper prints it; *: not at rest)\n\n| scene |";
  for (const auto& [a, b] : kPairs)
    text += a.grid == b.grid ? fmt::format(" {}: {} vs {} seg |", a.grid, a.segments, b.segments)
                             : fmt::format(" {} seg: {} vs {} |", a.segments, a.grid, b.grid);
  text += "\n|---|---|---|---|---|---|---|\n";
  for (const std::string& scene : scenes) {
    text += fmt::format("| {} |", scene);
    for (const auto& [a, b] : kPairs) {
      const auto print = printed.find({scene, a.grid, a.segments, b.grid, b.segments});
      text += fmt::format(" {}{} |",
                          drapes.at(scene).cell(fmt::format("{0}x{0}", a.grid), a.segments,
                                                fmt::format("{0}x{0}", b.grid), b.segments),
                          print == printed.end() ? "" : fmt::format(" ({:g})", print->second));
    }
    text += "\n";
  }
  return text + "\n";
}

/// Distinct values in order of first occurrence.
template <class T>
void add_new(std::vector<T>& list, const T& value) {
  if (std::find(list.begin(), list.end(), value) == list.end()) list.push_back(value);
}

}  // namespace

void fields(Fields& f, PlanFile& plan) {
  f({"scenes", "scene files"}, plan.scenes);
  f.if_any({"fabrics", "fabric files; absent for the scene's own"}, plan.fabrics);
  f.otherwise({"model", "triangles: the cloth; paper: the paper's grid in addition to the cloth"},
              plan.model);
  const bool paper = plan.model == ClothModel::paper;
  if (f.reads() && plan.document.root().find("grids") != nullptr)
    f.limit(paper, "grids", "belongs to model = \"paper\"",
            "write spacings_mm, the finest meshes of the cloth");
  list_fields(f, plan);
  f.otherwise({"seeds", "starts: 0 is the scene's, others are random", 1, 0}, plan.seeds);
  f.otherwise({"max_steps", "largest number of steps of the paper's model", 1, 1},
              plan.simulate.paper.max_steps);
  f.otherwise({"thickness_mm", "distance below which layers press on each other; 0: they do not",
               mm, 0, 10},
              plan.simulate.drape.thickness_m);
  const bool has_fabrics = f.reads() && plan.document.root().find("fabrics") != nullptr;
  for (const auto& [name, empty] :
       {std::pair("scenes", plan.scenes.empty()),
        std::pair("fabrics", has_fabrics && plan.fabrics.empty()),
        std::pair("grids", plan.grids.empty()), std::pair("spacings_mm", plan.spacings_m.empty()),
        std::pair("segments", plan.segments.empty()), std::pair("seeds", plan.seeds.empty())})
    f.limit(!empty, name, "the list is empty", "write one value or more");
  require_each_once(f, "seeds", plan.seeds);
}

void fields(Fields& f, PlanChoice& choice) {
  f.otherwise(Field{"scenes", "scenes of a rig, comma-separated names; default: all"}.plain_name(),
              choice.scenes);
  list_fields(f, choice);
}

std::string StudyCase::discretisation() const {
  return options.model == ClothModel::paper
             ? fmt::format("{}x{}", options.paper.rows, options.paper.cols)
             : fmt::format("{:g} mm", options.drape.spacing_m / mm);
}

std::string StudyCase::name() const {
  return fmt::format("{} {}: {}, {}, {} segment{}{}", scene, fabric_file.stem().string(),
                     drape::name_of(options.model), discretisation(), options.segments,
                     options.segments == 1 ? "" : "s",
                     seed == 0 ? "" : fmt::format(", seed {}", seed));
}

StudyPlan read_plan(const fs::path& rig_or_plan, const PlanChoice& choice, const fs::path& out,
                    const fs::path& program) {
  const bool is_rig = fs::is_directory(rig_or_plan);
  const fs::path file = is_rig ? rig_or_plan / "plan.toml" : rig_or_plan;
  PlanFile plan = is_rig && !fs::exists(file) ? plan_of_scenes(rig_or_plan) : read_plan_file(file);
  choose(choice, rig_or_plan, plan);
  const bool by_name = is_rig && plan.fabrics.empty() && plan.seeds == std::vector<int>{0};
  if (plan.fabrics.empty()) plan.fabrics.emplace_back();  // the scene's own fabric
  const std::vector<SimulateOptions> options = options_of(plan);
  const double count = static_cast<double>(plan.scenes.size() * plan.fabrics.size()) *
                       static_cast<double>(plan.seeds.size() * options.size());
  const auto refuse = [&](const char* key, const std::string& what, const std::string& remedy) {
    throw bad_input(what, {.file = file.string(), .field = key}, remedy);
  };
  if (count > kMostCases)
    refuse("scenes", fmt::format("the plan has {:g} cases", count),
           fmt::format("make plans of at most {:g}", kMostCases));
  StudyPlan study{{}, is_rig ? rig_or_plan : rig_or_plan.parent_path(), by_name};
  Hashes hashes;
  std::map<std::string, std::size_t> scene_of_key;
  for (std::size_t k = 0; k < plan.scenes.size(); ++k) {
    const fs::path& scene_file = plan.scenes[k];
    const Scene scene = read_scene(scene_file);
    for (const fs::path& fabric : plan.fabrics) {
      const fs::path fabric_file = fabric.empty() ? scene.fabric_file : fabric;
      const std::vector<fs::path> files = files_of(scene, read_fabric(fabric_file));
      for (const SimulateOptions& how : options) {
        for (const int seed : plan.seeds) {
          StudyCase one{scene_file, fabric_file, scene_file.stem().string(), how, seed, {}, {}};
          if (seed != 0) one.options.paper.imperfection_m = variation_of(seed).noise_m;
          one.key = key_of(one, files, program, hashes);
          // also catches identical files with different names
          if (const auto [first, is_new] = scene_of_key.emplace(one.key, k); !is_new)
            refuse(first->second == k ? "fabrics" : "scenes",
                   fmt::format("scene {} with fabric {} is listed twice", scene_file.string(),
                               fabric_file.string()),
                   "list each scene and fabric once");
          std::string words = fmt::format("{}-{}", one.discretisation(), how.segments);
          std::erase(words, ' ');
          one.folder = by_name ? out / one.scene / drape::name_of(how.model) / words
                               : out / one.key.substr(0, 2) / one.key;
          study.cases.push_back(std::move(one));
        }
      }
    }
  }
  return study;
}

Part part_of(const std::string& text) {
  static const std::regex form("([0-9]{1,9})/([0-9]{1,9})");
  std::smatch found;
  if (has_form(text, found, form)) {
    const Part part{std::stoi(found[1]), std::stoi(found[2])};
    if (part.index >= 1 && part.index <= part.count) return part;
  }
  throw usage_error(fmt::format("`{}` is not a part", text), "write e.g. --part 3/8");
}

std::vector<StudyOutcome> run_part(const StudyPlan& plan, const Part& part, const fs::path& out,
                                   int threads, const PartDone& done) {
  const WriterLock lock(out / "parts" / fmt::format("{}-of-{}.lock", part.index, part.count),
                        "this part of the study is being run already");
  std::vector<const StudyCase*> cases;
  for (std::size_t i = static_cast<std::size_t>(part.index) - 1; i < plan.cases.size();
       i += static_cast<std::size_t>(part.count))
    cases.push_back(&plan.cases[i]);
  std::vector<StudyOutcome> outcomes(cases.size());
  parallel_for(
      cases.size(), threads,
      [&](std::size_t i) {
        outcomes[i] = run_case(*cases[i]);
        return cases[i]->name();
      },
      done);
  return outcomes;
}

std::vector<StudyOutcome> plan_status(const StudyPlan& plan) {
  std::vector<StudyOutcome> outcomes;
  std::optional<CaseInputs> inputs;  // last case; cases of one scene and fabric follow it
  const StudyCase* last = nullptr;
  for (const StudyCase& one : plan.cases) {
    outcomes.push_back(look_at(one));
    if (outcomes.back().state != CaseState::missing) continue;
    try {
      if (last == nullptr || last->scene_file != one.scene_file ||
          last->fabric_file != one.fabric_file)
        inputs = read_inputs(one);
      last = &one;
      (void)prepared(*inputs, one);
    } catch (const Error& error) {
      outcomes.back().state = CaseState::impossible;
      outcomes.back().status = error.what();
    }
  }
  return outcomes;
}

std::string study_csv(const std::vector<StudyOutcome>& outcomes) {
  std::string text =
      "key,scene,fabric,model,discretisation,segments,seed,state,at_rest,"
      "largest_residual_per_point_weight,energy_uJ,status\n";
  for (const StudyOutcome& o : outcomes) {
    const StudyCase& c = o.the_case;
    text += fmt::format("{},{},{},{},{},{},{},{},", c.key, csv_cell(c.scene),
                        csv_cell(c.fabric_file.stem().string()), drape::name_of(c.options.model),
                        c.discretisation(), c.options.segments, c.seed, drape::name_of(o.state));
    const auto number = [](const std::optional<double>& value, double unit) {
      return value ? fmt::format("{}", *value / unit) : "";
    };
    text += o.state == CaseState::done
                ? fmt::format("{},{},{},{}\n", o.at_rest ? 1 : 0, number(o.residual, 1),
                              number(o.energy_j, 1e-6), csv_cell(o.status))
                : ",,,\n";
  }
  return text;
}

Scene seeded(Scene scene, int seed) {
  if (seed == 0) return scene;
  if (scene.start.mode != StartMode::flat || !scene.start.centre_in_world)
    throw bad_input("a seed needs a scene that starts flat at a given centre",
                    {.file = scene.file.string(), .field = "start.mode"}, "leave out the seeds");
  const StartVariation variation = variation_of(seed);
  scene.start.yaw_rad += variation.yaw_rad;
  *scene.start.centre_in_world +=
      Vector3d(variation.place_m.x(), variation.place_m.y(), variation.lift_m);
  return scene;
}

std::optional<double> mean_distance_m(const Sheet& a, const Sheet& b, const Sheet& points) {
  if (!is_whole(a) || !is_whole(b)) return std::nullopt;
  double sum = 0;
  for (const SheetMark& mark : points.marks)
    sum += (point_on(a, mark.material_m) - point_on(b, mark.material_m)).norm();
  sum /= static_cast<double>(points.marks.size());
  return std::isfinite(sum) ? std::optional(sum) : std::nullopt;
}

std::string study_tables(const std::vector<StudyOutcome>& outcomes,
                         const std::optional<fs::path>& published) {
  std::vector<std::string> scenes, cloths;
  std::vector<int> segments;
  std::map<std::string, SceneDrapes> drapes;
  std::optional<StudyCase> finest;
  bool paper = false;
  for (const StudyOutcome& o : outcomes) {
    const StudyCase& one = o.the_case;
    add_new(scenes, one.scene);
    add_new(cloths, one.discretisation());
    add_new(segments, one.options.segments);
    drapes[one.scene].add(o);
    if (one.options.model == ClothModel::paper)
      paper = true;
    else if (!finest || one.options.drape.spacing_m < finest->options.drape.spacing_m)
      finest = one;
  }
  std::string text;
  if (paper) text = paper_table(scenes, drapes, published ? read_printed(*published) : Printed{});
  if (!finest || cloths.size() < 2) return text;
  const std::string last = finest->discretisation();
  std::erase(cloths, last);
  text += fmt::format(
      "Mean distance in mm from the cloth on its mesh of {} (*: not at rest)\n\n"
      "| scene | segments |",
      last);
  std::string line = "|---|---|";
  for (const std::string& cloth : cloths) {
    text += fmt::format(" {} |", cloth);
    line += "---|";
  }
  text += "\n" + line + "\n";
  for (const std::string& scene : scenes)
    for (const int count : segments) {
      text += fmt::format("| {} | {} |", scene, count);
      for (const std::string& cloth : cloths)
        text += fmt::format(" {} |", drapes.at(scene).cell(cloth, count, last, count));
      text += "\n";
    }
  return text;
}

}  // namespace drape::simulate
