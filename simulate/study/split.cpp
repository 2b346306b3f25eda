// SPDX-License-Identifier: Apache-2.0
#include "simulate/study/split.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/units.hpp"
#include "simulate/checker/certify.hpp"
#include "simulate/ensemble/branches.hpp"
#include "simulate/ensemble/checked.hpp"
#include "simulate/equilibrium/prolong.hpp"
#include "simulate/start/clamps.hpp"

namespace drape::simulate {
namespace {

using units::mm;

constexpr double kReach = 2e-7;         // m; particles this near to a surface press at once
constexpr double kContinueStep_s = 10;  // first pseudo-time step from an equilibrium

/// Changes by one variant.
struct Variant {
  std::string what;
  SimulateOptions options;
  bool twist = true;
  double friction = 0;
  std::optional<std::pair<FabricValue, double>> scale = std::nullopt;  ///< times this factor
};

Variant with_loops(Variant base) {
  base.what = "with internal friction";
  base.options.internal_friction = true;
  return base;
}

bool has_loops(const Fabric& fabric) {
  SimulateReport ignored;
  ClothLaws laws = make_laws(fabric, 1, ignored);
  add_internal_friction(fabric, 1, laws, ignored);
  return !laws.friction->shear.empty() || !laws.friction->bending[0].empty() ||
         !laws.friction->bending[1].empty();
}

/// Runs variants of one scene.
class Bench {
 public:
  Bench(const Scene& scene, const Fabric& fabric, const Print& print,
        const std::optional<Sheet>& measured, const Sheet& reference,
        const SimulateOptions& options)
      : scene_(scene),
        fabric_(fabric),
        print_(print),
        measured_(measured),
        sheet_(reference),
        options_(options),
        surroundings_(scene) {}

  [[nodiscard]] Variant base() const { return {"base", options_, true, scene_.friction}; }

  /// The base from the start, kept with its contacts for what follows.
  void settle_base(ErrorSplit& split) {
    base_grid_ = grid_of(options_);
    reference_ = reference_on(base_grid_, sheet_);
    split.marks = reference_.marks;
    split.friction = scene_.friction;
    split.rows.push_back(run(base(), false));
    base_ = last_;
    split.base = report_;
    layers_m_ = report_.cloth_thickness_m;
    judge_base(split);
    if (!split.rows.front().at_rest) return;
    find_sensitivities(split);
  }

  [[nodiscard]] SplitRow run(const Variant& variant, bool continued) {
    const GridSpec grid = grid_of(variant.options);
    const ClothLaws laws = laws_of(variant);
    Scene scene = scene_;
    scene.friction = variant.friction;
    const StaticCase the_case{scene, print_, measured_, surroundings_, laws, variant.options.mass};
    const StaticOptions how = static_options(scene, variant.options);
    Field position;
    if (continued) {
      position = carry_on(the_case, grid, how);
    } else {
      StaticDrape drape = drape_statically(the_case, grid, how);
      position = std::move(drape.position);
      report_ = std::move(drape.report);
    }
    return row_of(variant.what, continued, grid, std::move(position));
  }

  /// Where the marks go when a value errs, on the base's branch: scene values, and fabric values
  /// that nobody measured at the ends of their range, which is too wide for a slope. All are
  /// measured from the base carried on as it is, so that only the value differs.
  void drape_errors(ErrorSplit& split) {
    if (!split.sensitivities) return;
    for (Sensitivity& one : *split.sensitivities)
      if (is_stand_in(fabric_, one.value)) one.moves.reset();
    if (!run(base(), true).at_rest) return;
    const Field from_start = std::exchange(base_, last_);
    const Eigen::MatrixX3d base_m = marks_on(reference_, base_);
    for (Sensitivity& one : *split.sensitivities)
      if (is_stand_in(fabric_, one.value)) one.moves = ends_of(one.value, base_m);
    split.scene = scene_effects(
        scene_, [&](const Scene& changed) { return carried_on_to(changed); }, base_m);
    add_loops(base_m, split);
    base_ = from_start;
  }

  void add_branches(int starts, ErrorSplit& split) {
    if (starts < 2) return;
    BranchOptions how;
    how.starts = starts;
    const BranchResult result =
        simulate_branches(scene_, fabric_, print_, measured_, options_, how);
    const auto distance = [&](const Branch& branch) {
      return mean_distance_m(reference_, branch.position);
    };
    const std::vector<Branch>& found = result.branches.found;
    if (found.empty()) return;
    const auto nearest =
        std::min_element(found.begin(), found.end(),
                         [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
    const auto add = [&](const std::string& what, const Branch& branch) {
      report_ = branch.report;
      split.rows.push_back(row_of(what, false, base_grid_, branch.position));
    };
    add(fmt::format("branch of least energy of {} from {} starts", found.size(), starts),
        found.front());
    add(fmt::format("branch nearest to the reference, number {} by energy",
                    nearest - found.begin() + 1),
        *nearest);
  }

 private:
  /// Effect that averaging the loops leaves out: a cloth with both branches that came here without
  /// a turn lies at one end of the interval that history leaves, and this drape about its middle.
  void add_loops(const Eigen::MatrixX3d& base_m, ErrorSplit& split) {
    if (!has_loops(fabric_)) return;
    const SplitRow row = run(with_loops(base()), true);
    SceneEffect effect{"internal_friction", std::nullopt, {}};
    if (row.at_rest) {
      const Eigen::MatrixX3d up_m = marks_on(reference_, last_) - base_m;
      effect.change_per_unit = row.change_m;
      effect.moves = {1, 1.0, -up_m, up_m};
    }
    split.scene.push_back(std::move(effect));
  }

  [[nodiscard]] std::optional<MarkMoves> ends_of(FabricValue value,
                                                 const Eigen::MatrixX3d& base_m) {
    MarkMoves moves{100 * kStandInPart, 100 * kStandInPart, {}, {}};
    for (const bool up : {false, true}) {
      Variant end = base();
      end.scale = {value, up ? 1 + kStandInPart : 1 - kStandInPart};
      if (!run(end, true).at_rest) return std::nullopt;
      (up ? moves.up_m : moves.down_m) = marks_on(reference_, last_) - base_m;
    }
    return moves;
  }

  [[nodiscard]] std::optional<RestedMarks> carried_on_to(const Scene& changed) const {
    Bench other(changed, fabric_, print_, measured_, sheet_, options_);
    other.base_grid_ = base_grid_;
    other.reference_ = reference_;
    other.base_ = base_;
    const SplitRow row = other.run(other.base(), true);
    if (!row.at_rest) return std::nullopt;
    return RestedMarks{marks_on(reference_, other.last_), row.distance_m};
  }

  [[nodiscard]] GridSpec grid_of(const SimulateOptions& options) const {
    return {options.rows, options.cols, print_.patch_m};
  }

  [[nodiscard]] ClothLaws laws_of(const Variant& variant) const {
    SimulateReport ignored;
    ClothLaws laws = make_laws(fabric_, variant.options.segments, ignored, variant.options.reach);
    if (variant.options.internal_friction)
      add_internal_friction(fabric_, variant.options.segments, laws, ignored,
                            variant.options.reach);
    if (!variant.twist) laws.twist_n_m = 0;
    return variant.scale ? scaled(laws, variant.scale->first, variant.scale->second) : laws;
  }

  /// Asks of the base what simulate_checked() asks of any drape.
  void judge_base(ErrorSplit& split) const {
    SimulateResult judged;
    const ClothLaws laws = make_laws(fabric_, options_.segments, judged.report, options_.reach);
    const StaticCase the_case{scene_, print_, measured_, surroundings_, laws, options_.mass};
    SimulateOptions by_static = options_;
    by_static.solver = Solver::newton;
    finish_static(the_case, fabric_, base_grid_, by_static,
                  {{}, base_, split.base, split.base.iterations}, judged);
    judge_rest(judged, scene_, fabric_, print_, by_static);
    split.rows.front().at_rest = judged.report.status == RestStatus::at_rest;
    split.base_sentence = judged.report.sentence;
  }

  /// From the base's equilibrium on, with its contacts closed.
  [[nodiscard]] Field carry_on(const StaticCase& the_case, const GridSpec& grid,
                               StaticOptions how) {
    keep_layers(how);
    Cloth cloth(grid, the_case.laws, the_case.mass);
    cloth.clamp(clamps_on(scene_, grid).places);
    how.first_step_s = kContinueStep_s;
    how.paced = false;
    StaticSolver solver(cloth, surroundings_, how);
    set_on_base(the_case, grid, solver);
    report_ = solver.solve();
    return solver.position;
  }

  /// A variant that continues the base meets itself where the base did.
  void keep_layers(StaticOptions& how) const {
    if (layers_m_ > 0) how.cloth_thickness_m = layers_m_;
    how.meets_itself = layers_m_ > 0;
  }

  void set_on_base(const StaticCase& the_case, const GridSpec& grid, StaticSolver& solver) const {
    const StartState start =
        make_start(the_case.scene, print_, grid, measured_, surroundings_.top_z_m(), 0);
    solver.contacts().hold(start.holds, start.hold_in_world);
    const bool same = grid.rows == base_grid_.rows && grid.cols == base_grid_.cols;
    solver.position = same ? base_ : prolong(base_, base_grid_, grid);
    lift_out(surroundings_, solver.position);
    solver.rest_on_contacts(kReach);
  }

  void find_sensitivities(ErrorSplit& split) {
    const ClothLaws laws = laws_of(base());
    const StaticCase the_case{scene_, print_, measured_, surroundings_, laws, options_.mass};
    Cloth cloth(base_grid_, laws, options_.mass);
    cloth.clamp(clamps_on(scene_, base_grid_).places);
    StaticOptions how = static_options(scene_, options_);
    keep_layers(how);
    how.first_step_s = kContinueStep_s;
    how.paced = false;
    StaticSolver solver(cloth, surroundings_, how);
    set_on_base(the_case, base_grid_, solver);
    if (solver.solve().status != StaticStatus::at_rest) return;
    split.sensitivities =
        simulate::find_sensitivities(cloth, solver, scene_.gravity_m_per_s2, reference_);
  }

  [[nodiscard]] SplitRow row_of(const std::string& what, bool continued, const GridSpec& grid,
                                Field position) {
    SplitRow row;
    row.what = what;
    row.continued = continued;
    row.at_rest = report_.status == StaticStatus::at_rest;
    const Reference here = reference_on(grid, sheet_);
    row.distance_m = mean_distance_m(here, position);
    if (!base_.empty()) {
      row.change_m = row.distance_m - mean_distance_m(reference_, base_);
      row.moved_m = mean_moved_m(reference_, base_, here, position);
    }
    if (!report_.history.empty()) row.energy_j = report_.history.back().sum_j();
    row.folds = label_hem(grid, position).nodes;
    last_ = std::move(position);
    return row;
  }

  const Scene& scene_;
  const Fabric& fabric_;
  const Print& print_;
  const std::optional<Sheet>& measured_;
  const Sheet& sheet_;
  SimulateOptions options_;
  Surroundings surroundings_;
  GridSpec base_grid_;
  Reference reference_;
  Field base_, last_;
  StaticReport report_;
  double layers_m_ = 0;  ///< thickness that the base's layers keep apart; 0: it did not meet itself
};

std::vector<Variant> variants_of(const Variant& base) {
  std::vector<Variant> list;
  const auto add = [&](std::string what) -> Variant& {
    list.push_back(base);
    list.back().what = std::move(what);
    return list.back();
  };
  const bool area = base.options.mass == MassRule::area;
  add(area ? "mass rule paper" : "mass rule area").options.mass =
      area ? MassRule::paper : MassRule::area;
  add("no twist stiffness").twist = false;
  add("friction halved").friction *= 0.5;
  add("friction doubled").friction *= 2;
  const int segments = base.options.segments == 1 ? 5 : 1;
  add(fmt::format("{} segments per curve", segments)).options.segments = segments;
  add("no contact between particles").options.contact_between_particles = false;
  const auto grid = [&](int rows, int cols) {
    Variant& variant = add(fmt::format("grid {}x{}", rows, cols));
    variant.options.rows = rows;
    variant.options.cols = cols;
  };
  const SimulateOptions& at = base.options;
  grid(std::max(3, (at.rows + 1) / 2), std::max(3, (at.cols + 1) / 2));
  grid((3 * at.rows - 1) / 2, (3 * at.cols - 1) / 2);
  return list;
}

}  // namespace

ErrorSplit split_error(const Scene& scene, const Fabric& fabric, const Print& print,
                       const std::optional<Sheet>& measured, const Sheet& reference,
                       const SimulateOptions& options, const SplitOptions& how) {
  options.check();
  ErrorSplit split;
  split.options = options;
  split.no_go = reference.no_go || !measured ? reference.no_go : measured->no_go;
  Bench bench(scene, fabric, print, measured, reference, options);
  bench.settle_base(split);
  if (how.scene_values && split.rows.front().at_rest) bench.drape_errors(split);
  if (how.only_first_order || !split.rows.front().at_rest) return split;
  std::vector<Variant> variants = variants_of(bench.base());
  if (has_loops(fabric)) variants.push_back(with_loops(bench.base()));
  for (const Variant& variant : variants) {
    split.rows.push_back(bench.run(variant, true));
    split.rows.push_back(bench.run(variant, false));
  }
  bench.add_branches(how.starts, split);
  return split;
}

Json sensitivity_json(const ErrorSplit& split) {
  Json json;
  json["schema"] = "drapebench/sensitivity/1";
  json["rows"] = split.options.rows;
  json["cols"] = split.options.cols;
  json["segments"] = split.options.segments;
  json["model"] = model_text(split.options);
  json["marks"] = split.marks.size();
  json["marks_at"] = Json::array();
  for (const MarkId& mark : split.marks) json["marks_at"].push_back({mark.row, mark.col});
  if (split.no_go) json["no_go"] = *split.no_go;
  json["friction"] = split.friction;
  json["at_rest"] = split.rows.front().at_rest;
  json["largest_residual_per_particle_weight"] = split.base.residual;
  json["mean_distance_mm"] = split.rows.front().distance_m / mm;
  json["sensitivities"] = nullptr;
  if (split.sensitivities) {
    Json list = Json::array();
    for (const Sensitivity& one : *split.sensitivities) {
      Json entry;
      entry["value"] = name_of(one.value);
      entry["mean_distance_mm_per_percent"] = 0.01 * one.distance_m / mm;
      entry["mean_way_of_marks_mm_per_percent"] = 0.01 * one.mean_moved_m / mm;
      entry["largest_way_of_a_mark_mm_per_percent"] = 0.01 * one.largest_moved_m / mm;
      if (one.moves) add_moves(*one.moves, entry);
      list.push_back(entry);
    }
    json["sensitivities"] = list;
  }
  json["scene_sensitivities"] = scene_effects_json(split.scene);
  json["variants"] = Json::array();
  for (std::size_t k = 1; k < split.rows.size(); ++k) {
    const SplitRow& row = split.rows[k];
    json["variants"].push_back({{"what", row.what},
                                {"from", row.continued ? "base" : "start"},
                                {"at_rest", row.at_rest},
                                {"mean_distance_mm", row.distance_m / mm},
                                {"change_mm", row.change_m / mm},
                                {"mean_way_of_marks_mm", row.moved_m / mm},
                                {"hem_folds", row.folds}});
  }
  return json;
}

std::string split_csv(const ErrorSplit& split) {
  std::string text =
      "variant,from,at_rest,mean_distance_mm,change_mm,mean_way_from_base_mm,energy_uJ,hem_folds\n";
  for (const SplitRow& row : split.rows) {
    text += fmt::format("\"{}\",{},{},{:.4f},{:.4f},{:.4f},{:.3f},{}\n", row.what,
                        row.continued ? "base" : "start", row.at_rest ? 1 : 0, row.distance_m / mm,
                        row.change_m / mm, row.moved_m / mm, row.energy_j / 1e-6, row.folds);
  }
  return text;
}

}  // namespace drape::simulate
