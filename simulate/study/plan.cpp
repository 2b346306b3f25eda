// SPDX-License-Identifier: Apache-2.0
#include "simulate/study/plan.hpp"

#include <fmt/format.h>

#include <charconv>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "core/error.hpp"
#include "core/fields/records.hpp"
#include "core/files/csv.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"
#include "simulate/objects/scene_files.hpp"

namespace drape {
namespace simulate {

namespace fs = std::filesystem;

/// A study's plan (plan.toml): each list multiplies the cases.
struct PlanFile {
  Document document;
  std::vector<fs::path> scenes, fabrics;
  std::vector<int> seeds = {0};
  StudyOptions options;
};

void fields(Fields& f, PlanFile& plan) {
  f({"scenes", "scene files"}, plan.scenes);
  f.otherwise({"fabrics", "fabric files; absent: the scene's own"}, plan.fabrics);
  fields(f, plan.options);
  f.otherwise({"seeds", "starts: 0 is the scene's, others are random", 1, 0}, plan.seeds);
  f.limit(!plan.scenes.empty(), "scenes", "the list is empty", "name one or more files");
  f.limit(!f.reads() || plan.document.root().find("fabrics") == nullptr || !plan.fabrics.empty(),
          "fabrics", "the list is empty", "name one or more files");
  f.limit(!plan.seeds.empty(), "seeds", "the list is empty", "write e.g. seeds = [0]");
  std::set<int> different;
  for (const int seed : plan.seeds)
    f.limit(different.insert(seed).second, "seeds", fmt::format("seed {} is listed twice", seed),
            "list it once");
}

}  // namespace simulate

template <>
inline constexpr Format format_of<simulate::PlanFile>{"plan", Syntax::toml, 1,
                                                      "plan.toml: cases of a study"};
}  // namespace drape

namespace drape::simulate {
namespace {

constexpr double kMostCases = 1e6;  ///< most cases of a plan: all of them are held in memory

/// SHA-256 of files, each read once.
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

std::string key_of(const StudyCase& the_case, const StudyOptions& options,
                   const std::vector<fs::path>& files, const fs::path& program, Hashes& hashes) {
  std::string text = fmt::format(
      "drapebench/study-key/1\nprogram {}\nmodel {}\ngrid {}\nsegments {}\nseed {}\nsteps {}\n"
      "thickness_mm {}\n",
      hashes.of(program), drape::name_of(the_case.model), the_case.grid, the_case.segments,
      the_case.seed, options.simulate.max_steps, options.simulate.cloth_thickness_m / units::mm);
  for (const Solver solver : options.solvers)
    text += fmt::format("solver {}\n", drape::name_of(solver));
  for (const fs::path& file : files) text += "file " + hashes.of(file) + "\n";
  return sha256_of(std::string_view(text));
}

/// The files of the last case that was asked for: cases of one scene and fabric follow each other.
class LastInputs {
 public:
  const CaseInputs& of(const StudyCase& one) {
    if (!inputs_ || scene_ != one.scene_file || fabric_ != one.fabric_file) {
      inputs_ = read_inputs(one);
      scene_ = one.scene_file;
      fabric_ = one.fabric_file;
    }
    return *inputs_;
  }

 private:
  fs::path scene_, fabric_;
  std::optional<CaseInputs> inputs_;
};

fs::path failure_of(const StudyCase& the_case) {
  return the_case.folder / "failed.txt";
}

/// Nothing when another run computes the case.
std::unique_ptr<WriterLock> lock_of(const StudyCase& the_case) {
  fs::create_directories(the_case.folder);
  try {
    return std::make_unique<WriterLock>(the_case.folder / "lock", "this case is being computed");
  } catch (const Error&) {
    return nullptr;
  }
}

PlannedOutcome run_locked(const StudyCase& the_case, const StudyOptions& options,
                          const fs::path& program) {
  PlannedOutcome planned;
  planned.outcome.the_case = the_case;
  const std::unique_ptr<WriterLock> lock = lock_of(the_case);
  if (!lock) {
    planned.state = CaseState::computing;
    return planned;
  }
  try {
    planned.outcome = run_case(the_case, options, program);
    planned.state = CaseState::done;
    fs::remove(failure_of(the_case));
  } catch (const Error& error) {
    planned.outcome.sentence = error.what();
    planned.state = CaseState::failed;
    write_durable(failure_of(the_case), planned.outcome.sentence + "\n");
  }
  return planned;
}

/// True if the record is of this case and its ending and outputs are those that it states. Program
/// and inputs are in the case's key.
bool is_whole(const StudyCase& the_case) {
  const fs::path record = run_record_path(the_case.folder / "sheet.ply");
  try {
    const RunFile run = read_run_file(record);
    for (const RecordedFile& output : run.outputs)
      if (!is_as_recorded(record, output)) return false;
    return run.arguments == std::vector<std::string>{"study", "--key", the_case.key} &&
           run.ending_sha256 == sha256_of_file(ending_path(record));
  } catch (const Error&) {
    return false;
  }
}

PlannedOutcome look_at(const StudyCase& the_case) {
  PlannedOutcome planned;
  planned.outcome.the_case = the_case;
  const bool has_record = fs::is_regular_file(run_record_path(the_case.folder / "sheet.ply"));
  if (has_record && is_whole(the_case)) {
    planned.outcome = outcome_from(the_case);
    planned.state = CaseState::done;
  } else if (fs::exists(the_case.folder / "lock") && !lock_of(the_case)) {
    planned.state = CaseState::computing;
  } else if (has_record) {
    planned.state = CaseState::failed;
    planned.outcome.sentence = "its files are not those of its record; run the study again";
  } else if (fs::exists(failure_of(the_case))) {
    planned.state = CaseState::failed;
    planned.outcome.sentence = read_text(failure_of(the_case));
  }
  return planned;
}

}  // namespace

StudyPlan read_plan(const fs::path& file, const fs::path& out, const fs::path& program) {
  const auto read = read_record<PlanFile>(file);
  StudyPlan plan;
  plan.options = read.options;
  const StudyOptions& options = plan.options;
  const std::vector<fs::path>& scenes = read.scenes;
  std::vector<fs::path> fabrics = read.fabrics;
  if (fabrics.empty()) fabrics.emplace_back();  // the scene's own
  const std::vector<int>& seeds = read.seeds;
  const auto refuse = [&](const char* key, const std::string& what, const std::string& remedy) {
    throw bad_input(what, read.document.where(key), remedy);
  };
  try {
    options.check();
  } catch (const Error& wrong) {
    throw bad_input(wrong.what_failed(), {.file = file.string()}, wrong.what_to_do());
  }
  const double count = static_cast<double>(scenes.size() * fabrics.size() * seeds.size()) *
                       static_cast<double>(options.models.size() * options.grids.size()) *
                       static_cast<double>(options.segments.size());
  if (count > kMostCases)
    refuse("scenes", fmt::format("the plan has {:g} cases", count),
           fmt::format("make plans of at most {:g}", kMostCases));
  Hashes hashes;
  std::map<std::string, const fs::path*> scene_of_key;
  for (const fs::path& scene_file : scenes) {
    const Scene scene = read_scene(scene_file);
    for (const fs::path& fabric_file : fabrics) {
      const Fabric fabric = read_fabric(fabric_file.empty() ? scene.fabric_file : fabric_file);
      const std::vector<fs::path> files = files_of(scene, fabric);
      for (const ClothModel model : options.models) {
        for (const int grid : options.grids) {
          for (const int segments : options.segments) {
            for (const int seed : seeds) {
              StudyCase one{scene_file, scene_file.stem().string(), model, grid, segments};
              one.fabric_file = fabric_file.empty() ? scene.fabric_file : fabric_file;
              one.seed = seed;
              one.key = key_of(one, options, files, program, hashes);
              // Also the same bytes under another name.
              if (const auto [first, is_new] = scene_of_key.emplace(one.key, &scene_file); !is_new)
                refuse(first->second == &scene_file ? "fabrics" : "scenes",
                       fmt::format("scene {} with fabric {} is listed twice", scene_file.string(),
                                   one.fabric_file.string()),
                       "list each scene and fabric once");
              one.folder = out / one.key.substr(0, 2) / one.key;
              plan.cases.push_back(std::move(one));
            }
          }
        }
      }
    }
  }
  return plan;
}

Part part_of(const std::string& text) {
  Part part;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, part.index);
  const bool slash = first.ec == std::errc() && first.ptr != end && *first.ptr == '/';
  const auto second = std::from_chars(slash ? first.ptr + 1 : end, end, part.count);
  if (!slash || second.ec != std::errc() || second.ptr != end || part.index < 1 ||
      part.index > part.count)
    throw usage_error(fmt::format("`{}` is not a part", text), "write e.g. --part 3/8");
  return part;
}

std::vector<PlannedOutcome> run_part(const StudyPlan& plan, const Part& part, const fs::path& out,
                                     const fs::path& program,
                                     const std::function<void(const PlannedOutcome&)>& done) {
  const WriterLock lock(out / "parts" / fmt::format("{}-of-{}.lock", part.index, part.count),
                        "this part of the study is being run already");
  std::vector<StudyCase> cases;
  for (std::size_t i = static_cast<std::size_t>(part.index) - 1; i < plan.cases.size();
       i += static_cast<std::size_t>(part.count))
    cases.push_back(plan.cases[i]);
  return run_cases(
      cases, plan.options.threads,
      [&](const StudyCase& one) { return run_locked(one, plan.options, program); }, done);
}

std::vector<PlannedOutcome> plan_status(const StudyPlan& plan) {
  std::vector<PlannedOutcome> outcomes;
  LastInputs inputs;
  for (const StudyCase& the_case : plan.cases) {
    outcomes.push_back(look_at(the_case));
    if (outcomes.back().state != CaseState::missing) continue;
    try {
      CaseInputs copy = inputs.of(the_case);
      (void)prepare_case(the_case, plan.options, copy);
    } catch (const Error& error) {
      outcomes.back().state = CaseState::impossible;
      outcomes.back().outcome.sentence = error.what();
    }
  }
  return outcomes;
}

std::string plan_csv(const std::vector<PlannedOutcome>& outcomes) {
  constexpr const char* kStates[] = {"done", "failed", "computing", "missing", "impossible"};
  std::string text =
      "key,scene,fabric,model,grid,segments,seed,state,solver,at_rest,"
      "largest_residual_per_particle_weight,energy_uJ,status\n";
  for (const PlannedOutcome& planned : outcomes) {
    const StudyOutcome& o = planned.outcome;
    const StudyCase& c = o.the_case;
    const bool done = planned.state == CaseState::done;
    text += fmt::format("{},{},{},{},{},{},{},{},{},", c.key, csv_cell(c.scene),
                        csv_cell(c.fabric_file.stem().string()), drape::name_of(c.model), c.grid,
                        c.segments, c.seed, kStates[static_cast<int>(planned.state)], o.solver);
    text += done ? fmt::format("{},{},{},\"{}\"\n", o.at_rest ? 1 : 0, o.residual,
                               o.energy_j / 1e-6, o.sentence)
                 : ",,,\n";
  }
  return text;
}

}  // namespace drape::simulate
