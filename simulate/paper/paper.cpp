// SPDX-License-Identifier: Apache-2.0
#include "simulate/paper/paper.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/contact/layer_pair.hpp"
#include "simulate/paper/paper_motion.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr double kPinTravel_s = 0.3;   // time in which pins move from the start to their targets
constexpr double kPinPlaced_m = 1e-9;  // a pin closer than this has reached its target
constexpr double kTimeResolution_s = 1e-12;
constexpr double kQuietHeight_m = 10e-6;  // kinetic energy over weight below which rest is tested
constexpr double kSmoothing_s = 4e-3;  // smoothing of kinetic energy, so that folding makes peaks
constexpr int kRestCheck = 64;         // steps between two tests of the residual
constexpr int kProgressSteps = 512;
constexpr double kSunk_m = 0.1e-3;  // largest depth of a particle in an object at rest
constexpr int kSamples = 8;         // samples between particles, per edge of a cell
constexpr double kMicro = 1e-6;

/// Deterministic waves without a square's symmetries, so that a symmetric start selects a fold.
double imperfection(int row, int col) {
  return std::sin(1.3 * row + 0.7 * col + 0.4) + 0.5 * std::sin(0.9 * col - 2.1 * row + 1.1);
}

/// Weights of the particles at a material point: bilinear within its cell.
Eigen::RowVectorXd weights_at(const ParticleGrid& grid, const Vector2d& material_m) {
  const Vector2d steps = material_m.cwiseQuotient(grid.spacing_m());
  const int row = std::clamp(static_cast<int>(std::floor(steps.x())), 0, grid.rows - 2);
  const int col = std::clamp(static_cast<int>(std::floor(steps.y())), 0, grid.cols - 2);
  const double a = steps.x() - row, b = steps.y() - col;
  Eigen::RowVectorXd weights = Eigen::RowVectorXd::Zero(grid.count());
  const int i = row * grid.cols + col;
  weights[i] = (1 - a) * (1 - b);
  weights[i + 1] = (1 - a) * b;
  weights[i + grid.cols] = a * (1 - b);
  weights[i + grid.cols + 1] = a * b;
  return weights;
}

/// Damping time of the springs for a ratio at the highest stretch frequency w: a force of time *
/// stiffness * rate has the damping ratio time w / 2.
double spring_damping_s(const ClothLaws& laws, const ParticleGrid& grid, double ratio) {
  const Vector2d h = grid.spacing_m();
  const double omega =
      2 *
      std::max(std::sqrt(laws.tensile[0].slope) / h.x(), std::sqrt(laws.tensile[1].slope) / h.y()) /
      std::sqrt(laws.density_kg_per_m2);
  return 2 * ratio / omega;
}

void require_simulable(const Scene& scene, const Print& print) {
  const auto require = [&](bool good, const char* what, const char* field, const char* to_do) {
    if (!good) throw bad_input(what, {.file = scene.file.string(), .field = field}, to_do);
  };
  require(scene.clamps.empty(), "the paper's model has no clamps", "clamp",
          "hold the cloth with [[pin]], or leave out --paper");
  require(scene.start.mode != StartMode::measured,
          "the paper's model does not start from the measured shape", "start.mode",
          "start flat, or leave out --paper");
  require_sized(print, scene);
}

/// One simulation run: the motion and its progress.
class PaperRun {
 public:
  PaperRun(const LocalScene& local, const PaperCloth& cloth, const Surroundings& around,
           const PaperOptions& options, Certificate& certificate)
      : local_(local),
        cloth_(cloth),
        around_(around),
        options_(options),
        certificate_(certificate),
        motion_(cloth, around,
                {local.scene.gravity_m_per_s2, options.damping_per_s, options.air_drag_kg_per_m3,
                 local.scene.friction, options.thickness_m}),
        steps_(std::get<CertificateGrid>(certificate.cloth)) {}

  void start(const Print& print) {
    const ParticleGrid& grid = cloth_.grid();
    const FlatPose flat{local_.scene.start.centre_in_world.value_or(Vector3d::Zero()),
                        local_.scene.start.yaw_rad};
    for (int i = 0; i < grid.count(); ++i) {
      motion_.position.col(i) = flat.point_in_world(grid.material_m(i), grid.patch_m);
      motion_.position(2, i) +=
          options_.imperfection_m * imperfection(i / grid.cols, i % grid.cols);
    }
    const std::vector<Vector3d> places = pin_places(local_.scene, print, local_.measured);
    const auto count = static_cast<Eigen::Index>(places.size());
    Eigen::MatrixXd weights(count, grid.count());
    held_at_.resize(3, count);
    for (Eigen::Index h = 0; h < count; ++h) {
      weights.row(h) = weights_at(grid, local_.scene.pins[h].material_m(print));
      held_at_.col(h) = places[h];
    }
    motion_.hold(weights);
    if (count > 0) {
      const Eigen::Matrix3Xd away = held_at_ - motion_.held_points();
      const double farthest_m = away.colwise().norm().maxCoeff();
      if (farthest_m > kPinPlaced_m) {
        motion_.move_holds(away / kPinTravel_s);
        pins_placed_s_ = kPinTravel_s;
      }
      if (farthest_m > 1 * mm)
        certificate_.warnings.push_back(fmt::format(
            "a pin starts {:.1f} mm from its place and is moved there in the first {:.1f} s",
            farthest_m / mm, kPinTravel_s));
    }
    if (const int moved = motion_.push_out(); moved > 0)
      certificate_.warnings.push_back(
          fmt::format("{} particles started inside an object and were set on its surface", moved));
    damped_from_s_ = std::max(pins_placed_s_, options_.natural_time_s);
  }
  void go(const std::function<void(double)>& progress) {
    double next_row_s = 0;
    while (steps_.steps < options_.max_steps) {
      if (time_s_ >= next_row_s) {
        history_.push_back(moment());
        next_row_s += options_.history_interval_s;
      }
      if (steps_.steps % kRestCheck == 0 && steps_.steps > 0) {
        if (!std::isfinite(motion_.kinetic_j())) break;
        certificate_.at_rest = rests();
        if (certificate_.at_rest) break;
      }
      if (progress && steps_.steps % kProgressSteps == 0)
        progress(static_cast<double>(steps_.steps) / static_cast<double>(options_.max_steps));
      const double until_placed_s = pins_placed_s_ - time_s_;
      const double step_s = motion_.step(options_.step_fraction,
                                         until_placed_s > kTimeResolution_s ? until_placed_s : 1.0);
      time_s_ += step_s;
      ++steps_.steps;
      if (pins_placed_s_ > 0 && until_placed_s > kTimeResolution_s &&
          time_s_ >= pins_placed_s_ - kTimeResolution_s)
        motion_.move_holds(Eigen::Matrix3Xd::Zero(3, held_at_.cols()));
      damp_kinetically(step_s);
    }
    history_.push_back(moment());
  }
  void certify() {
    Certificate& c = certificate_;
    const HistoryRow &first = history_.front(), &last = history_.back();
    const auto energy_j = [](const HistoryRow& row) {
      return row.kinetic_j + row.gravity_j + row.stretch_j + row.shear_j + row.bending_j +
             row.layers_j;
    };
    c.time_s = time_s_;
    c.residual_tolerance = options_.residual_tolerance;
    steps_.backtracked_steps = motion_.backtracked_steps();
    if (!std::isfinite(last.residual + last.kinetic_j)) {
      c.at_rest = false;
      c.status = fmt::format("diverged after {} steps", steps_.steps);
      return;
    }
    c.residual = last.residual;
    c.strains = cloth_.strains(motion_.position);
    c.distances = distances();
    c.energies = {energy_j(first), energy_j(last),
                  last.kinetic_j,  last.stretch_j + last.shear_j + last.bending_j,
                  std::nullopt,    motion_.viscous_j()};
    steps_.clamped_springs = cloth_.clamped_springs(motion_.position);
    if (steps_.clamped_springs > 0)
      c.warnings.push_back(fmt::format(
          "K_st is below K_diag in {} grid line springs: K'_st is held at 0 there and the cloth is "
          "stiffer than its tensile curve",
          steps_.clamped_springs));
    const double depth_m =
        -std::min(c.distances->to_table_m, c.distances->to_object_m.value_or(0.0));
    if (c.distances->deepest_m > kSunk_m)
      c.warnings.push_back(
          fmt::format("between its particles the sheet reaches {:.2f} mm into an "
                      "object: only particles collide with objects",
                      c.distances->deepest_m / mm));
    std::string fault;
    if (depth_m > kSunk_m)
      fault = fmt::format("{:.2g} mm inside an object or the table", depth_m / mm);
    if (c.distances->crossings > 0)
      fault =
          fmt::format("passing through itself in {} pairs of triangles", c.distances->crossings);
    c.status = c.at_rest ? "at rest"
                         : fmt::format(
                               "not at rest after {} steps: residual {:.2g} of a "
                               "particle's weight",
                               steps_.steps, last.residual);
    if (fault.empty()) return;
    if (c.at_rest) {
      c.status = fmt::format("still, but {}, after {} steps", fault, steps_.steps);
      c.at_rest = false;
    } else {
      c.warnings.push_back("the sheet is " + fault);
    }
  }
  [[nodiscard]] Sheet sheet() const {
    const ParticleGrid& grid = cloth_.grid();
    Sheet sheet;
    sheet.rows = grid.rows;
    sheet.cols = grid.cols;
    sheet.patch_m = grid.patch_m;
    for (int i = 0; i < grid.count(); ++i) {
      SheetMark mark;
      mark.mark = {i / grid.cols, i % grid.cols};
      mark.material_m = grid.material_m(i);
      mark.point_in_world = motion_.position.col(i);
      if (mark.point_in_world.allFinite()) {
        sheet.marks.push_back(mark);
      } else {
        sheet.gaps.push_back({mark.mark, "the simulation diverged"});
      }
    }
    return sheet;
  }
  [[nodiscard]] std::vector<HistoryRow>& history() { return history_; }

 private:
  [[nodiscard]] double mass_kg() const { return cloth_.particle_kg() * cloth_.grid().count(); }
  [[nodiscard]] bool rests() const {
    const double weight_n = mass_kg() * local_.scene.gravity_m_per_s2.norm();
    return time_s_ >= pins_placed_s_ && motion_.kinetic_j() < weight_n * kQuietHeight_m &&
           motion_.residual() < options_.residual_tolerance;
  }
  [[nodiscard]] HistoryRow moment() const {
    const InternalEnergies inner = cloth_.energies(motion_.position);
    return {time_s_,
            motion_.kinetic_j(),
            motion_.gravity_j() + local_.gravity_offset_j(mass_kg()),
            inner.stretch_j,
            inner.shear_j,
            inner.bending_j,
            motion_.layers_j(),
            motion_.residual(),
            motion_.contacts()};
  }
  /// Kinetic damping (Barnes 1999): at a peak of (smoothed) kinetic energy the cloth is near an
  /// equilibrium; restarting there at zero velocity keeps the equilibria and converges faster.
  void damp_kinetically(double step_s) {
    const double smooth = smooth_kinetic_j_ + std::min(1.0, step_s / kSmoothing_s) *
                                                  (motion_.kinetic_j() - smooth_kinetic_j_);
    const bool falling = smooth < smooth_kinetic_j_;
    if (options_.kinetic_damping && time_s_ > damped_from_s_ && falling && rising_) {
      motion_.stop();
      ++steps_.kinetic_stops;
      smooth_kinetic_j_ = 0;
      rising_ = false;
      return;
    }
    rising_ = !falling;
    smooth_kinetic_j_ = smooth;
  }
  [[nodiscard]] CertificateDistances distances() const {
    const ParticleGrid& grid = cloth_.grid();
    const Particles& x = motion_.position;
    CertificateDistances found;
    found.to_table_m = 1e9;
    std::vector<Vector3d> places;
    std::vector<Vector2d> material_m;
    std::vector<std::array<int, 3>> facets;
    for (int i = 0; i < grid.count(); ++i) {
      places.push_back(x.col(i));
      material_m.push_back(grid.material_m(i));
      for (int shape = 0; shape < around_.count(); ++shape) {
        const double gap = around_.gap_m(shape, places.back());
        if (around_.is_table(shape)) {
          found.to_table_m = std::min(found.to_table_m, gap);
        } else {
          found.to_object_m = std::min(found.to_object_m.value_or(1e9), gap);
        }
      }
      if (i % grid.cols + 1 == grid.cols || i + grid.cols >= grid.count()) continue;
      const int right = i + 1, down = i + grid.cols, across = down + 1;
      facets.push_back({i, right, down});
      facets.push_back({right, across, down});
      for (int k = 0; k < (kSamples + 1) * (kSamples + 1); ++k) {
        const double u = k / (kSamples + 1) / static_cast<double>(kSamples);
        const double v = k % (kSamples + 1) / static_cast<double>(kSamples);
        const Vector3d p = (1 - u) * ((1 - v) * x.col(i) + v * x.col(right)) +
                           u * ((1 - v) * x.col(down) + v * x.col(across));
        for (int shape = 0; shape < around_.count(); ++shape)
          found.deepest_m = std::max(found.deepest_m, -around_.gap_m(shape, p));
      }
    }
    const SelfDistance self =
        self_distance(facets, material_m, grid.spacing_m().maxCoeff(), places);
    found.to_itself_m = self.least_m;
    found.crossings = self.crossings;
    if (held_at_.cols() > 0)
      found.hold_error_m = (motion_.held_points() - held_at_).colwise().norm().maxCoeff();
    return found;
  }

  const LocalScene& local_;
  const PaperCloth& cloth_;
  const Surroundings& around_;
  const PaperOptions& options_;
  Certificate& certificate_;
  PaperMotion motion_;
  CertificateGrid& steps_;
  Eigen::Matrix3Xd held_at_;
  std::vector<HistoryRow> history_;
  double time_s_ = 0, pins_placed_s_ = 0, damped_from_s_ = 0, smooth_kinetic_j_ = 0;
  bool rising_ = false;
};

}  // namespace

void fields(Fields& f, PaperOptions& options) {
  f.otherwise({"damping_per_s", "damping rate beta / m of F = -beta v", 1, 0},
              options.damping_per_s);
  f.otherwise({"air_drag_kg_per_m3", "c of F = -c area |v| v", 1, 0}, options.air_drag_kg_per_m3);
  f.otherwise({"spring_damping_ratio", "damping ratio of the fastest stretch vibration", 1, 0, 0.5,
               "larger ratios need shorter steps; give at most 0.5"},
              options.spring_damping_ratio);
  f.otherwise({"natural_time_s", "duration of free motion before kinetic damping sets in", 1, 0},
              options.natural_time_s);
  f.otherwise({"kinetic_damping", "set all velocities to zero at each peak of kinetic energy"},
              options.kinetic_damping);
  f.otherwise({"tolerance",
               "largest static force on a particle that counts as rest, in weights of a particle",
               1, above_zero, 1e-3, "give 0.001 or less: a sheet above it does not rest"},
              options.residual_tolerance);
  f.otherwise({"imperfection_mm", "amplitude of the waves on the flat start", mm, 0},
              options.imperfection_m);
  f.otherwise({"step_share", "time step relative to its stability limit", 1, above_zero, 0.95,
               "0.9 leaves a margin to the stability limit"},
              options.step_fraction);
  f.otherwise({"max_steps", "largest number of steps", 1, 1}, options.max_steps);
  f.otherwise({"history_interval_s", "time between rows of history.csv", 1, above_zero},
              options.history_interval_s);
}

std::string history_csv(const std::vector<HistoryRow>& history) {
  const std::vector<std::string> names{"time_s",
                                       "kinetic_energy_uJ",
                                       "gravity_energy_uJ",
                                       "stretch_energy_uJ",
                                       "shear_energy_uJ",
                                       "bending_energy_uJ",
                                       "layers_energy_uJ",
                                       "largest_residual_per_particle_weight",
                                       "particles_touching"};
  std::vector<std::vector<double>> columns(names.size());
  for (const HistoryRow& row : history) {
    const double values[] = {row.time_s,
                             row.kinetic_j / kMicro,
                             row.gravity_j / kMicro,
                             row.stretch_j / kMicro,
                             row.shear_j / kMicro,
                             row.bending_j / kMicro,
                             row.layers_j / kMicro,
                             row.residual,
                             static_cast<double>(row.contacts)};
    for (std::size_t i = 0; i < names.size(); ++i) columns[i].push_back(values[i]);
  }
  return csv_text(names, columns);
}

PaperDrape run_paper_model(const LocalScene& local, const Print& print, const ClothLaws& laws,
                           const PaperOptions& options, Certificate& certificate,
                           const std::function<void(double)>& progress) {
  require_simulable(local.scene, print);
  const ParticleGrid grid{options.rows, options.cols, print.patch_m};
  const Surroundings around(local.scene);
  ClothOutline whole;
  whole.outer = {{0, 0}, {print.patch_m.x(), 0}, print.patch_m, {0, print.patch_m.y()}};
  refuse_pins_beside(local.scene, print, whole);
  refuse_flat_start_inside(local.scene, print, whole, around);
  const PaperCloth cloth(grid, laws, spring_damping_s(laws, grid, options.spring_damping_ratio));
  CertificateGrid of_grid;
  of_grid.rows = options.rows;
  of_grid.cols = options.cols;
  of_grid.damping_per_s = options.damping_per_s;
  of_grid.air_drag_kg_per_m3 = options.air_drag_kg_per_m3;
  of_grid.kinetic_damping = options.kinetic_damping;
  of_grid.step_fraction = options.step_fraction;
  of_grid.most_steps = options.max_steps;
  certificate.cloth = of_grid;
  PaperRun run(local, cloth, around, options, certificate);
  run.start(print);
  run.go(progress);
  run.certify();
  return {run.sheet(), std::move(run.history())};
}

}  // namespace drape::simulate
