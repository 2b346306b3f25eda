// SPDX-License-Identifier: Apache-2.0
#include "simulate/simulate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/cloth/drape_coefficient.hpp"
#include "simulate/contact/piercing.hpp"
#include "simulate/contact/self_distance.hpp"
#include "simulate/dynamics/motion.hpp"
#include "simulate/equilibrium/run.hpp"
#include "simulate/start/start.hpp"
#include "simulate/start/start_check.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using units::mm;

constexpr int kStepUpdate = 32;             // steps between two looks at the stability limit
constexpr int kDampMoreSteps = 60000;       // steps after which a still sheet trembles
constexpr double kStillDamping = 500;       // beta / m from then on, 1/s
constexpr int kRestCheck = 64;              // steps between two looks at the residual
constexpr double kQuietHeight = 10e-6;      // m; rest is judged below weight * this kinetic energy
constexpr double kKineticSmoothing = 4e-3;  // s; peaks of the folding count, not those of rattling
constexpr double kPinTravelTime = 0.3;      // s; pins move from the start to their places
constexpr double kTimeResolution = 1e-12;   // s
constexpr double kPinPlaced = 1e-9;         // m
constexpr int kProgressSteps = 512;
constexpr double kCuts = 0.1e-3;         // m; deeper between particles, a warning says so
constexpr double kThicknessShare = 0.5;  // of the spacing: thicker layers would meet themselves
constexpr double kSunk = 0.1e-3;         // m; a particle deeper than this in an object is no result

Vector3d at(const Field& x, int i) {
  const std::size_t n = x.size() / 3;
  return {x[i], x[n + i], x[2 * n + i]};
}

void measure_gaps(const GridSpec& grid, const Surroundings& surroundings, const Field& position,
                  SimulateReport& report);

/// One run: the motion and what is known about it so far.
class Run {
 public:
  Run(Cloth& cloth, const Surroundings& surroundings, const Scene& scene,
      const SimulateOptions& options)
      : cloth_(cloth),
        surroundings_(surroundings),
        options_(options),
        motion_(cloth, surroundings,
                {scene.gravity_m_per_s2, options.damping_per_s, options.air_drag_kg_per_m3,
                 scene.friction, options.contact_between_particles, options.cloth_thickness_m}),
        weight_n_(cloth.total_mass_kg() * scene.gravity_m_per_s2.norm()) {}

  void start(const StartState& state, bool relaxed, SimulateReport& report);
  void go(SimulateResult& result);

  [[nodiscard]] const Field& position() const { return motion_.position; }

 private:
  [[nodiscard]] bool quiet() const {
    return motion_.kinetic_energy_j() < weight_n_ * kQuietHeight && time_s_ >= pins_placed_s_;
  }
  [[nodiscard]] bool rests();
  void damp_kinetically(double step_s, SimulateReport& report);
  void damp_more(SimulateReport& report);
  void place_pins();
  void note(SimulateResult& result);
  void certify(SimulateReport& report);
  [[nodiscard]] double total_energy_j() const;

  Cloth& cloth_;
  const Surroundings& surroundings_;
  const SimulateOptions& options_;
  Motion motion_;
  std::vector<Hold> holds_;
  std::vector<Vector3d> hold_in_world_;
  double weight_n_;
  double time_s_ = 0, pins_placed_s_ = 0, damped_from_s_ = 0, smooth_kinetic_j_ = 0;
  double next_note_s_ = 0;
  bool rising_ = false;
  bool damped_more_ = false;
};

void Run::start(const StartState& state, bool relaxed, SimulateReport& report) {
  motion_.position = state.position;
  holds_ = state.holds;
  hold_in_world_ = state.hold_in_world;
  motion_.hold(holds_);
  Eigen::Matrix3Xd rate(3, static_cast<Eigen::Index>(holds_.size()));
  double farthest = 0;
  for (std::size_t h = 0; h < holds_.size(); ++h) {
    const Vector3d way = hold_in_world_[h] - motion_.held_point(h);
    rate.col(static_cast<Eigen::Index>(h)) = way / kPinTravelTime;
    farthest = std::max(farthest, way.norm());
  }
  if (farthest > kPinPlaced) {
    motion_.move_holds(rate);
    pins_placed_s_ = kPinTravelTime;
  }
  if (farthest > 1 * mm) {
    report.warnings.push_back(fmt::format(
        "a pin starts {:.1f} mm from its place and is moved there in the first {:.1f} s",
        farthest / mm, kPinTravelTime));
  }
  for (const std::string& fault : faults_of_start(cloth_.grid(), motion_.position, surroundings_)) {
    report.warnings.push_back(fault);
  }
  const int moved = motion_.push_out();
  if (moved > 0) report.warnings.push_back(told_of_lifted(moved));
  damped_from_s_ = std::max(pins_placed_s_, relaxed ? 0.0 : options_.natural_time_s);
  report.energy_start_j = total_energy_j();
}

double Run::total_energy_j() const {
  return motion_.kinetic_energy_j() + motion_.gravity_energy_j() +
         cloth_.energies(motion_.position).sum_j() +
         motion_.line_contacts().energy_j(motion_.position) +
         motion_.pair_contacts().energy_j(motion_.position);
}

void Run::place_pins() {
  if (pins_placed_s_ == 0 || time_s_ < pins_placed_s_ - kTimeResolution || !motion_.holds_move())
    return;
  motion_.move_holds(Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(holds_.size())));
}

/// Also when every place of contact is sought anew.
bool Run::rests() {
  if (!quiet() || !(motion_.residual() < options_.residual_tolerance)) return false;
  motion_.seek_contacts();
  return motion_.residual() < options_.residual_tolerance;
}

/// Barnes 1999: at a peak of (smoothed) kinetic energy the cloth passes near an equilibrium;
/// starting anew from there leaves the equilibria unchanged and gets there sooner.
void Run::damp_kinetically(double step_s, SimulateReport& report) {
  const double share = std::min(1.0, step_s / kKineticSmoothing);
  const double smooth = smooth_kinetic_j_ + share * (motion_.step_kinetic_j() - smooth_kinetic_j_);
  const bool falling = smooth < smooth_kinetic_j_;
  if (options_.kinetic_damping && time_s_ > damped_from_s_ && falling && rising_) {
    motion_.stop();
    ++report.kinetic_stops;
    smooth_kinetic_j_ = 0;
    rising_ = false;
    return;
  }
  rising_ = !falling;
  smooth_kinetic_j_ = smooth;
}

/// A sheet that is nearly still may tremble for ever where contacts between particles come and go;
/// damping changes no equilibrium, so such a run gets enough of it to still them.
void Run::damp_more(SimulateReport& report) {
  if (!quiet() || damped_more_ || options_.damping_per_s >= kStillDamping) return;
  damped_more_ = true;
  motion_.set_damping_per_s(kStillDamping);
  report.warnings.push_back(
      fmt::format("still but trembling after {} steps: damping raised to {:g} per s", report.steps,
                  kStillDamping));
}

void Run::note(SimulateResult& result) {
  const InternalEnergies inner = cloth_.energies(motion_.position);
  result.history.push_back({time_s_, motion_.kinetic_energy_j(), motion_.gravity_energy_j(),
                            inner.stretch_j, inner.shear_j, inner.bending_j, inner.twist_j,
                            motion_.line_contacts().energy_j(motion_.position) +
                                motion_.pair_contacts().energy_j(motion_.position),
                            motion_.residual(), motion_.contacts()});
}

void Run::go(SimulateResult& result) {
  SimulateReport& report = result.report;
  double step_s = motion_.stable_step_s(options_.step_share);
  report.step_least_s = report.step_most_s = step_s;
  report.sentence.clear();
  while (report.steps < options_.max_steps) {
    if (report.steps % kStepUpdate == 0) {
      step_s = motion_.stable_step_s(options_.step_share);
      if (!std::isfinite(step_s + motion_.kinetic_energy_j())) break;
      report.step_least_s = std::min(report.step_least_s, step_s);
      report.step_most_s = std::max(report.step_most_s, step_s);
    }
    if (time_s_ >= next_note_s_) {
      note(result);
      next_note_s_ += options_.history_interval_s;
    }
    if (report.steps % kRestCheck == 0 && report.steps > 0 && rests()) {
      report.status = RestStatus::at_rest;
      break;
    }
    if (options_.progress && report.steps % kProgressSteps == 0) {
      options_.progress(static_cast<double>(report.steps) / static_cast<double>(options_.max_steps),
                        motion_.residual());
    }
    const double until_placed_s = pins_placed_s_ - time_s_;
    time_s_ +=
        motion_.step(until_placed_s > kTimeResolution ? std::min(step_s, until_placed_s) : step_s);
    ++report.steps;
    place_pins();
    if (report.steps % kDampMoreSteps == 0) damp_more(report);
    damp_kinetically(step_s, report);
  }
  note(result);
  certify(report);
}

void Run::certify(SimulateReport& report) {
  report.time_s = time_s_;
  report.backtracked_steps = motion_.backtracked_steps();
  report.residual = motion_.residual();
  report.residual_rms = motion_.residual_rms();
  report.residual_tolerance = options_.residual_tolerance;
  report.kinetic_j = motion_.kinetic_energy_j();
  report.strains = cloth_.strains(motion_.position);
  report.contacts = motion_.contacts();
  report.contacts_between = motion_.line_contacts().count();
  report.contacts_pairs = motion_.pair_contacts().pressing(motion_.position);
  report.deepest_edge_m = motion_.pair_contacts().deepest_solid_m(motion_.position);
  report.energy_end_j = total_energy_j();
  report.lost_viscous_j = motion_.viscous_loss_j();
  report.found_contacts_j = motion_.found_contacts_j();
  report.lost_kinetic_stops_j = motion_.stopped_j();
  for (std::size_t h = 0; h < holds_.size(); ++h) {
    report.hold_error_m =
        std::max(report.hold_error_m, (motion_.held_point(h) - hold_in_world_[h]).norm());
  }
  if (!std::isfinite(report.residual + report.kinetic_j)) {
    report.status = RestStatus::diverged;
    report.sentence = fmt::format("diverged after {} steps", report.steps);
    return;
  }
  measure_gaps(cloth_.grid(), surroundings_, motion_.position, report);
  report.sentence =
      report.status == RestStatus::at_rest
          ? "at rest"
          : fmt::format("not at rest after {} steps: residual {:.2g} of a particle's weight",
                        report.steps, report.residual);
}

void measure_gaps(const GridSpec& grid, const Surroundings& surroundings, const Field& position,
                  SimulateReport& report) {
  constexpr int kSamples = 8;  // per cell side
  report.least_gap_table_m = 1e9;
  for (int shape = 0; shape < surroundings.count(); ++shape) {
    double least = 1e9;
    for (int i = 0; i < grid.count(); ++i) {
      if (grid.cells_at(i / grid.cols, i % grid.cols) == 0) continue;
      least = std::min(least, surroundings.gap_m(shape, at(position, i)));
    }
    if (surroundings.is_table(shape)) {
      report.least_gap_table_m = std::min(report.least_gap_table_m, least);
    } else {
      report.least_gap_object_m = std::min(report.least_gap_object_m.value_or(1e9), least);
    }
    for (int cell = 0; cell < grid.count(); ++cell) {
      if (!grid.has_cell(cell / grid.cols, cell % grid.cols)) continue;
      const Vector3d a = at(position, cell), b = at(position, cell + 1);
      const Vector3d c = at(position, cell + grid.cols);
      const Vector3d d = at(position, cell + grid.cols + 1);
      for (int k = 0; k <= kSamples * (kSamples + 2); ++k) {
        const int across = k / (kSamples + 1);
        const int along = k % (kSamples + 1);
        const double u = across / static_cast<double>(kSamples);
        const double v = along / static_cast<double>(kSamples);
        const Vector3d p = (1 - u) * ((1 - v) * a + v * b) + u * ((1 - v) * c + v * d);
        report.deepest_between_m =
            std::max(report.deepest_between_m, -surroundings.gap_m(shape, p));
      }
    }
  }
}

/// What the sheet does that cloth cannot: it is said, and such a sheet is not called at rest.
void judge_overlaps(const GridSpec& grid, const Surroundings& surroundings, const Field& position,
                    const SimulateOptions& options, SimulateReport& report) {
  // A cell of straight lines lies inside a round body by its width squared over four radii, so what
  // a coarse grid cannot follow is measured by the grid.
  const double spacing_m = std::max(grid.warp_spacing_m(), grid.weft_spacing_m());
  report.penetration_tolerance_m =
      std::max(options.penetration_tolerance_m, options.penetration_share * spacing_m);
  if (report.status == RestStatus::diverged) return;
  const SelfDistance self = self_distance(grid, position);
  report.least_self_distance_m = self.least_m;
  report.self_crossings = self.crossings;
  std::string fault;
  const double depth_m =
      -std::min(report.least_gap_table_m, report.least_gap_object_m.value_or(0.0));
  if (depth_m > kSunk) fault = fmt::format("{:.2g} mm inside an object or the table", depth_m / mm);
  if (report.deepest_between_m > report.penetration_tolerance_m) {
    fault = fmt::format("between its particles {:.2g} mm inside an object",
                        report.deepest_between_m / mm);
  } else if (report.deepest_between_m > kCuts) {
    report.warnings.push_back(
        fmt::format("between its particles the sheet reaches {:.2f} mm into an object",
                    report.deepest_between_m / mm));
  }
  // Such a contact sinks in by 2 um per particle's weight: one that is jammed so deep is no rest.
  if (report.deepest_edge_m > kSunk)
    fault = fmt::format("with an edge or corner of an object {:.2g} mm deep in it",
                        report.deepest_edge_m / mm);
  report.pierced_m = std::max(pierced_m(grid, position, surroundings),
                              rim_through_m(grid, position, surroundings));
  if (report.pierced_m > report.penetration_tolerance_m)
    fault = fmt::format("pierced: an edge of an object stands {:.2g} mm through it",
                        report.pierced_m / mm);
  if (self.crossings > 0)
    fault = fmt::format("passing through itself in {} pairs of triangles", self.crossings);
  if (fault.empty()) return;
  if (report.status == RestStatus::at_rest) {
    report.status = RestStatus::penetrates;
    report.sentence = fmt::format("still, but {}, after {} steps", fault, report.steps);
  } else {
    report.warnings.push_back("the sheet is " + fault);
  }
}

/// Damping time of the springs for a ratio at the highest stretch frequency omega:
/// force = tau * stiffness * rate damps it by tau omega / 2.
double spring_damping_s(const ClothLaws& laws, const GridSpec& grid, double ratio) {
  const double warp = std::sqrt(laws.tensile[0].slope) / grid.warp_spacing_m();
  const double weft = std::sqrt(laws.tensile[1].slope) / grid.weft_spacing_m();
  const double omega = 2 * std::max(warp, weft) / std::sqrt(laws.density_kg_per_m2);
  return 2 * ratio / omega;
}

Sheet sheet_of(const GridSpec& grid, const Field& position) {
  Sheet sheet;
  sheet.rows = grid.rows;
  sheet.cols = grid.cols;
  sheet.patch_m = grid.patch_m;
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) {
      SheetMark mark;
      mark.mark = {r, c};
      mark.material_m = material_of(grid, r, c);
      mark.point_in_world = at(position, grid.index(r, c));
      if (grid.cells_at(r, c) == 0) {
        sheet.gaps.push_back({mark.mark, "outside the round specimen"});
      } else if (mark.point_in_world.allFinite()) {
        sheet.marks.push_back(mark);
      } else {
        sheet.gaps.push_back({mark.mark, "the simulation diverged"});
      }
    }
  }
  return sheet;
}

SimulatedSource source_of(const Scene& scene, const Fabric& fabric, const SimulateOptions& options,
                          const SimulateReport& report) {
  return {.scene = scene.name,
          .fabric = fabric.name,
          .scene_sha256 = sha256_of_file(scene.file),
          .fabric_sha256 = fabric_sha256(fabric),
          .start_sha256 = std::nullopt,
          .segments = options.segments,
          .model = options.model,
          .solver = options.solver,
          .status = report.sentence};
}

}  // namespace

void SimulateOptions::check() const {
  const auto require = [](bool good, const char* what, const char* to_do) {
    if (!good) throw usage_error(what, to_do);
  };
  if (model != "consistent" && model != "paper") {
    throw usage_error(fmt::format("there is no model `{}`", model),
                      "use --model consistent or --model paper");
  }
  if (solver != "rk4" && solver != "static") {
    throw usage_error(fmt::format("there is no solver `{}`", solver),
                      "use --solver rk4 or --solver static");
  }
  if (model == "paper" && solver == "static") {
    throw usage_error("the model `paper` has no energy for the static solver to minimise",
                      "use --solver rk4, or --model consistent");
  }
  require(!round || (model == "consistent" && solver == "rk4"),
          "a round specimen is draped by the model `consistent` and the solver `rk4` only",
          "leave out --round, --model and --solver");
  require(rows >= 3 && cols >= 3 && rows <= 401 && cols <= 401,
          "the grid is smaller than 3 or larger than 401 particles per side", "give --grid 21");
  require(segments >= 1 && segments <= 20, "a curve has 1 to 20 segments", "give --segments 5");
  require(damping_per_s >= 0 && air_drag_kg_per_m3 >= 0 && spring_damping_ratio >= 0,
          "a damping is negative", "give 0 or more");
  require(spring_damping_ratio <= 0.5, "the spring damping ratio is above 0.5",
          "larger ratios need shorter steps; give at most 0.5");
  require(residual_tolerance > 0 && static_tolerance > 0, "the residual tolerance is not positive",
          "give e.g. 0.001");
  require(cloth_thickness_m >= 0 && cloth_thickness_m <= 0.01,
          "the cloth's thickness is not in 0 .. 10 mm", "give 0.5, or 0 to let it pass itself");
  require(penetration_tolerance_m > 0, "the penetration tolerance is not positive",
          "give e.g. 0.5");
  require(max_steps > 0, "the step limit is not positive", "give e.g. 400000");
  require(step_share > 0 && step_share <= 0.95, "the step share is not in 0 .. 0.95",
          "0.9 leaves a margin to the stability limit");
  require(natural_time_s >= 0 && imperfection_m >= 0 && history_interval_s > 0,
          "a time or the imperfection is negative", "give 0 or more");
}

void finish_static(const StaticCase& the_case, const Fabric& fabric, const GridSpec& grid,
                   const SimulateOptions& options, const StaticDrape& drape,
                   SimulateResult& result) {
  const StaticOptions how = static_options(the_case.scene, options);
  book_static(the_case, grid, how, drape, result);
  measure_gaps(grid, the_case.surroundings, drape.position, result.report);
  judge_overlaps(grid, the_case.surroundings, drape.position, options, result.report);
  result.sheet = sheet_of(grid, drape.position);
  result.sheet.source = source_of(the_case.scene, fabric, options, result.report);
}

SimulateResult simulate(const Scene& scene, const Fabric& fabric, const Print& print,
                        const std::optional<Sheet>& measured, const SimulateOptions& options) {
  options.check();
  SimulateResult result;
  SimulateReport& report = result.report;
  const GridSpec grid{options.rows, options.cols, print.patch_m, options.round};
  ClothLaws laws = make_laws(fabric, options.segments, report);
  const bool paper = options.model == "paper";
  if (paper) {
    laws.twist_n_m = report.twist_n_m = 0;
    report.warnings.clear();  // they are about the twist stiffness, which this model has not
  }
  laws.stretch_damping_s = spring_damping_s(laws, grid, options.spring_damping_ratio);
  const Surroundings surroundings(scene);
  if (options.solver == "static") {
    const StaticCase the_case{scene, print, measured, surroundings, laws, options.mass};
    const StaticOptions how = static_options(scene, options);
    finish_static(the_case, fabric, grid, options, drape_statically(the_case, grid, how), result);
    return result;
  }
  Cloth cloth(grid, laws, options.mass, paper ? ClothModel::paper : ClothModel::consistent);
  const StartState start =
      make_start(scene, print, grid, measured, surroundings.top_z_m(), options.imperfection_m);
  report.placed_yaw_rad = start.report.flat.yaw_rad;
  report.placed_centre_in_world = start.report.flat.centre_in_world;
  report.placed_by_marks = start.report.marks_used;
  report.placement_rms_mm = start.report.placement_rms_mm;
  SimulateOptions how = options;
  const double most = kThicknessShare * std::min(grid.warp_spacing_m(), grid.weft_spacing_m());
  if (how.cloth_thickness_m > most) {
    how.cloth_thickness_m = most;
    report.warnings.push_back(
        fmt::format("the particles are too near each other for the cloth's thickness: layers keep "
                    "{:.3g} mm apart",
                    most / mm));
  }
  report.cloth_thickness_m = how.cloth_thickness_m;
  Run run(cloth, surroundings, scene, how);
  run.start(start, scene.start.mode == StartMode::measured, report);
  run.go(result);
  report.clamped_springs = cloth.clamped_springs(run.position());
  if (report.clamped_springs > 0) {
    report.warnings.push_back(fmt::format(
        "K_st is below K_diag in {} grid line springs: K'_st is held at 0 there and the cloth is "
        "stiffer than its tensile curve",
        report.clamped_springs));
  }
  judge_overlaps(grid, surroundings, run.position(), options, report);
  report.drape_coefficient = drape_coefficient(grid, run.position(), scene);
  result.sheet = sheet_of(grid, run.position());
  result.sheet.source = source_of(scene, fabric, options, report);
  return result;
}

}  // namespace drape::simulate
