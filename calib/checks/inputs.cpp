// SPDX-License-Identifier: Apache-2.0
#include "calib/checks/inputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "core/camera_model.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::calib {

using Eigen::Index, Eigen::MatrixXd, Eigen::Vector3d;
using units::deg;
using units::mm;

namespace {

double nominal_m(const Target& target, const KnownLength& known) {
  return (target.point_in_target(known.to) - target.point_in_target(known.from)).norm();
}

/// Pictures seen so far. Equal mark positions to the last digit mean the same picture in any copy
/// or encoding; identical files mean the same picture in any detection.
class Pictures {
 public:
  void add(const PictureSource& source, const std::string& what_to_do) {
    for (const FrameDetections& frame : source.detections.frames) {
      const bool counts = source.sets.empty() || std::find(source.sets.begin(), source.sets.end(),
                                                           frame.set) != source.sets.end();
      const bool finite = std::all_of(frame.detections.begin(), frame.detections.end(),
                                      [](const Detection& d) { return d.centre_px.allFinite(); });
      if (!counts || frame.detections.empty() || !finite) continue;
      std::vector<double> places;
      for (const Detection& d : frame.detections)
        places.insert(places.end(), {d.centre_px.x(), d.centre_px.y()});
      const Owner owner{&frame, source.file};
      refuse(owner, by_places_.emplace(std::move(places), owner), what_to_do);
      if (!frame.image_sha256.empty())
        refuse(owner, by_file_.emplace(frame.image_sha256, owner), what_to_do);
    }
  }

 private:
  struct Owner {
    const FrameDetections* frame = nullptr;
    std::string file;
  };

  template <typename Placed>
  static void refuse(const Owner& owner, const Placed& placed, const std::string& what_to_do) {
    const auto& [at, fresh] = placed;
    const Owner& first = at->second;
    if (fresh || first.frame == owner.frame) return;
    throw bad_input(fmt::format("this picture is also the one of set {}, {}{}", first.frame->set,
                                first.frame->camera, first.file.empty() ? "" : " in " + first.file),
                    {.file = owner.file, .camera = owner.frame->camera, .set = owner.frame->set},
                    what_to_do);
  }

  std::map<std::vector<double>, Owner> by_places_;
  std::map<std::string, Owner> by_file_;
};

constexpr Index kModes = 6;
using ModeVector = Eigen::Matrix<double, kModes, 1>;
using ModeMatrix = Eigen::Matrix<double, kModes, kModes>;

constexpr double kSigmas = 4;
constexpr double kLeastCondition = 1e-10;  // least reciprocal condition of the modes' information

void add_findings(StageCheck& check, double half_m) {
  const double stroke_m = check.stroke_mm * mm;
  const auto large = [&](double value, double sd, double effect_m) {
    return std::abs(value) > kSigmas * sd && std::abs(effect_m) > harmless_m;
  };
  const char* remedy =
      "square or measure the stage, or calibrate with --method joint --free-stages, which takes "
      "every stage but the first as a free pose";
  for (int i = 0; i < 2; ++i) {
    if (large(check.tilt_deg[i], check.tilt_sd_deg[i], check.tilt_deg[i] * deg * stroke_m)) {
      check.findings.push_back(fmt::format(
          "z stage: its axis tilts by {:+.3f} +- {:.3f} deg off the target's normal towards {}; {}",
          check.tilt_deg[i], check.tilt_sd_deg[i], "xy"[i], remedy));
    }
  }
  if (large(check.stroke_percent, check.stroke_sd_percent, check.stroke_percent / 100 * stroke_m)) {
    const double factor = 1 + check.stroke_percent / 100;
    if (factor < 0) {
      check.contradiction = fmt::format(
          "the target moves against z_mm in rig.toml ({:+.3f} +- {:.3f} % of the "
          "stroke): is the sign of every z_mm wrong, or the order of the stages reversed?",
          100 * factor, check.stroke_sd_percent);
      check.findings.push_back("z stage: " + check.contradiction);
      return;
    }
    check.contradiction = fmt::format(
        "the target's pitch and the z stage's strokes contradict each other by {:+.3f} +- {:.3f} "
        "%, so no length is known: pitch_mm in target.toml divided by {:.4f}, or every z_mm in "
        "rig.toml times it, would agree; measure both",
        check.stroke_percent, check.stroke_sd_percent, factor);
    check.findings.push_back(
        fmt::format("z stage: its stroke differs by {:+.3f} +- {:.3f} % from z_mm in rig.toml; {}",
                    check.stroke_percent, check.stroke_sd_percent, remedy));
  }
  for (int i = 0; i < 3; ++i) {
    if (large(check.turn_deg[i], check.turn_sd_deg[i], check.turn_deg[i] * deg * half_m)) {
      check.findings.push_back(
          fmt::format("z stage: the target turns by {:+.3f} +- {:.3f} deg about {} over {:.0f} mm "
                      "of height; {}",
                      check.turn_deg[i], check.turn_sd_deg[i], "xyz"[i], check.stroke_mm, remedy));
    }
  }
}

/// Converts the six modes and their covariance, in rad per m of height, 1, and rad per m.
StageCheck check_of(const ModeVector& found, const ModeMatrix& covariance, double stroke_m,
                    double half_m, double heights_times = 1) {
  const ModeVector sd = covariance.diagonal().cwiseSqrt();
  StageCheck check;
  check.stroke_mm = stroke_m / mm / heights_times;
  check.tilt_deg = found.head<2>() / deg;
  check.tilt_sd_deg = sd.head<2>() / deg;
  check.stroke_percent = 100 * (heights_times * (1 + found[2]) - 1);
  check.stroke_sd_percent = 100 * heights_times * sd[2];
  check.turn_deg = found.tail<3>() * stroke_m / deg;
  check.turn_sd_deg = sd.tail<3>() * stroke_m / deg;
  add_findings(check, half_m);
  return check;
}

/// A stage that was fitted as a free pose.
struct FreedStage {
  std::size_t placement = 0;
  Index at = 0;  ///< index of its parameters in information_of()
  Vector3d said_m;
};

/// Frees all known placements except the first, which defines the world.
std::vector<FreedStage> free_stages(JointModel& model, const JointFit& fit) {
  std::vector<FreedStage> freed;
  bool world_kept = false;
  for (std::size_t p = 0; p < model.placements.size(); ++p) {
    Placement& placement = model.placements[p];
    if (placement.known && world_kept)
      freed.push_back({p, 0, placement.world_from_target.translation_m});
    world_kept = world_kept || placement.known;
  }
  for (const FreedStage& stage : freed) model.placements[stage.placement].known = false;
  const JointLayout layout(model, fit);
  for (FreedStage& stage : freed) stage.at = layout.placements[stage.placement];
  return freed;
}

/// Deviation of a stage from its stated position: rotation (rad) and shift (mm).
ModeVector deviation_of(const Placement& placement, const Vector3d& said_m) {
  ModeVector deviation;
  deviation << rotation_vector(placement.world_from_target.rotation),
      (placement.world_from_target.translation_m - said_m) / mm;
  return deviation;
}

/// Deviation (rad, mm) of a stage `rise_m` above the first for unit modes.
ModeMatrix modes_of(double rise_m) {
  ModeMatrix modes = ModeMatrix::Zero();
  modes.topRightCorner<3, 3>().diagonal().setConstant(rise_m);
  modes.bottomLeftCorner<3, 3>().diagonal().setConstant(rise_m / mm);
  return modes;
}

/// Finds a stage that deviates from the common motion of the others.
void add_strays(StageCheck& check, const JointModel& model, const std::vector<FreedStage>& freed,
                const Eigen::VectorXd& left, const MatrixXd& covariance) {
  // A single wrong stage explains more than wrong travel of all, unless heights use another unit.
  double farthest = 0;  // mm
  for (std::size_t i = 0; i < freed.size(); ++i) {
    const Vector3d shift = left.segment<3>(static_cast<Index>(kModes * i) + 3);
    const Vector3d sd =
        covariance.diagonal().segment<3>(static_cast<Index>(kModes * i) + 3).cwiseSqrt();
    if (shift.norm() < harmless_m / mm || shift.cwiseQuotient(sd).norm() < kSigmas) continue;
    check.findings.push_back(fmt::format(
        "z stage: set {} lies ({:+.3f}, {:+.3f}, {:+.3f}) mm off the line of the others; correct "
        "its z_mm in rig.toml or calibrate with --free-stages",
        model.placements[freed[i].placement].set, shift.x(), shift.y(), shift.z()));
    if (shift.norm() > farthest && !check.other_unit()) check.contradiction = check.findings.back();
    farthest = std::max(farthest, shift.norm());
  }
}

/// Finds two stages with exchanged heights; this takes precedence over other faults.
void name_exchanged(StageCheck& check, const JointModel& model,
                    const std::vector<FreedStage>& freed) {
  for (const FreedStage& one : freed) {
    for (const FreedStage& other : freed) {
      const Placement &first = model.placements[one.placement],
                      &second = model.placements[other.placement];
      const double one_m = one.said_m.z(), other_m = other.said_m.z();
      const double off_m = std::hypot(first.world_from_target.translation_m.z() - other_m,
                                      second.world_from_target.translation_m.z() - one_m);
      if (!(one_m < other_m) || off_m > 0.1 * (other_m - one_m)) continue;
      check.contradiction = fmt::format(
          "z stage: sets {} and {} lie at each other's heights; exchange their z_mm in rig.toml",
          first.set, second.set);
      check.findings.push_back(check.contradiction);
      return;
    }
  }
}

}  // namespace

void check_known_lengths(const Target& target, double tolerance) {
  for (const KnownLength& known : target.known_lengths) {
    const double nominal = nominal_m(target, known);
    const double sd_m = std::hypot(known.standard_uncertainty_m, tolerance * nominal);
    const double sigmas = std::abs(known.length_m - nominal) / sd_m;
    if (sigmas <= 3) continue;
    throw bad_input(
        fmt::format("wrong target size: from point ({}, {}) to ({}, {}) the pitch of {:g} mm gives "
                    "{:.3f} mm, the operator measured {:.3f} +- {:.3f} mm, {:.1f} standard "
                    "uncertainties apart; all measured lengths would be wrong by {:+.3f} %",
                    known.from.row, known.from.col, known.to.row, known.to.col, target.pitch_m / mm,
                    nominal / mm, known.length_m / mm, known.standard_uncertainty_m / mm, sigmas,
                    100 * (nominal / known.length_m - 1)),
        {.field = "known_length"},
        fmt::format("set pitch_mm = {:.4f} in the target file, or measure again",
                    target.pitch_m * known.length_m / nominal / mm));
  }
}

double scale_uncertainty(const Target& target) {
  double least = 0;
  for (const KnownLength& known : target.known_lengths) {
    const double own = known.standard_uncertainty_m / known.length_m;
    least = least > 0 ? std::min(least, own) : own;
  }
  return least;
}

std::string print_scale_line(const Target& target) {
  if (target.known_lengths.empty())
    return "not checked: measure two far points of the target and add [known_length] to its file";
  std::string lengths;
  for (const KnownLength& known : target.known_lengths)
    lengths += fmt::format("{}{:.3f} +- {:.3f} mm ({:.3f} as drawn)", lengths.empty() ? "" : ", ",
                           known.length_m / mm, known.standard_uncertainty_m / mm,
                           nominal_m(target, known) / mm);
  return fmt::format("by {}, known to {:.4f} %", lengths, 100 * scale_uncertainty(target));
}

void refuse_pictures_twice(const PictureSource& source) {
  Pictures().add(source, "record each set by itself, or take one of the two out of the rig file");
}

void refuse_pictures_of(const PictureSource& calibrated, const PictureSource& tested) {
  Pictures pictures;
  pictures.add(calibrated, "calibrate again, from sets that were each recorded by themselves");
  pictures.add(tested, "record each set by itself, and other sets than those that calibrated");
}

void refuse_sets_twice(const Rig& rig) {
  std::set<std::string> names;
  const auto add = [&](const std::string& set, const char* field) {
    if (names.insert(set).second) return;
    throw bad_input("a set of the target is named twice, so its views would count twice",
                    {.field = field, .set = set}, "name each set once in rig.toml");
  };
  for (const TargetStage& stage : rig.stages) add(stage.set, "calibration.stage");
  for (const std::string& set : rig.free_poses) add(set, "calibration.free_poses");
}

std::optional<StageCheck> check_stages(JointModel model, const JointFit& fit,
                                       const JointCleaning& cleaning) {
  const std::vector<FreedStage> freed = free_stages(model, fit);
  if (freed.empty()) return std::nullopt;
  const JointSolution solution = fit_joint(model, fit, cleaning);
  const MatrixXd inverse = inverse_of_information(information_of(solution.model, fit));
  if (!solution.converged || inverse.size() == 0) return std::nullopt;
  const auto points = static_cast<double>(count_points(solution.model));
  const double factor =
      std::max(1.0, solution.chi2 / (2 * points - free_parameters(solution.model, fit)));
  const auto size = kModes * static_cast<Index>(freed.size());
  MatrixXd covariance(size, size), modes(size, kModes);
  Eigen::VectorXd deviation(size);
  double low_m = 0, high_m = 0, first_m = 0;
  for (const Placement& placement : solution.model.placements) {
    if (placement.known) first_m = placement.world_from_target.translation_m.z();
  }
  for (std::size_t i = 0; i < freed.size(); ++i) {
    const auto at = kModes * static_cast<Index>(i);
    const double rise_m = freed[i].said_m.z() - first_m;
    low_m = std::min(low_m, rise_m);
    high_m = std::max(high_m, rise_m);
    modes.middleRows<kModes>(at) = modes_of(rise_m);
    deviation.segment<kModes>(at) =
        deviation_of(solution.model.placements[freed[i].placement], freed[i].said_m);
    for (std::size_t j = 0; j < freed.size(); ++j) {
      covariance.block<kModes, kModes>(at, kModes * static_cast<Index>(j)) =
          factor * inverse.block<kModes, kModes>(freed[i].at, freed[j].at);
    }
  }
  const MatrixXd weighted = solve_positive(covariance, modes);
  const MatrixXd spread = inverse_of_information(modes.transpose() * weighted, kLeastCondition);
  if (spread.size() == 0) return std::nullopt;
  const ModeVector found = spread * weighted.transpose() * deviation;
  StageCheck check =
      check_of(found, spread, high_m - low_m, solution.model.board.half_m.maxCoeff());
  add_strays(check, solution.model, freed, deviation - modes * found, covariance);
  if (!check.contradiction.empty()) name_exchanged(check, solution.model, freed);
  return check;
}

std::optional<StageCheck> check_stages(const Camera& camera,
                                       const std::vector<Correspondence>& points, TsaiFree free,
                                       double chi2, double heights_times) {
  // Non-square pixels shift two plates relative to each other much like wrong travel.
  if (free == TsaiFree::all_but_scale_x) free = TsaiFree::all;
  const MatrixXd inverse = tsai_covariance(camera, points, free);
  if (inverse.size() == 0) return std::nullopt;
  MatrixXd pull = MatrixXd::Zero(inverse.rows(), kModes);
  Eigen::VectorXd camera_score = Eigen::VectorXd::Zero(inverse.rows());
  ModeMatrix own = ModeMatrix::Zero();
  ModeVector score = ModeVector::Zero();
  double low_m = points.front().point_in_world.z(), high_m = low_m, half_m = 0;
  for (const Correspondence& point : points) {
    const Vector3d& at = point.point_in_world;
    const auto d = d_px_d_parameters(camera, at);
    const auto image = project(camera.model, camera.cam_from_world * at);
    if (!d || !image) return std::nullopt;
    low_m = std::min(low_m, at.z());
    high_m = std::max(high_m, at.z());
    half_m = std::max(half_m, at.head<2>().cwiseAbs().maxCoeff());
    Eigen::Matrix<double, 3, kModes> motion;
    motion << at.z(), 0, 0, 0, 0, -at.y() * at.z(),  //
        0, at.z(), 0, 0, 0, at.x() * at.z(),         //
        0, 0, at.z(), at.y() * at.z(), -at.x() * at.z(), 0;
    const Eigen::Matrix2d w = whitener(point.covariance_px2);
    const Eigen::Matrix<double, 2, kModes> modes =
        w * image->d_px_d_point * camera.cam_from_world.rotation * motion;
    pull += (w * *d).transpose() * modes;
    own += modes.transpose() * modes;
    score += modes.transpose() * (w * (point.px - image->px));
    camera_score += (w * *d).transpose() * (w * (point.px - image->px));
  }
  const ModeMatrix information = own - pull.transpose() * inverse * pull;
  const MatrixXd spread = inverse_of_information(information, kLeastCondition);
  if (!(high_m > low_m) || spread.size() == 0) return std::nullopt;
  const Eigen::VectorXd camera_step = inverse * camera_score;
  const ModeVector found = spread * (score - pull.transpose() * camera_step);
  const double dof = 2.0 * static_cast<double>(points.size()) - free_parameters(free) - kModes;
  const double explained = camera_score.dot(camera_step) + found.dot(information * found);
  const double factor = std::max(1.0, (chi2 - explained) / dof);
  return check_of(found, factor * spread, high_m - low_m, half_m, heights_times);
}

std::optional<StageCheck> check_stages_far_off(const Camera& camera,
                                               const std::vector<Correspondence>& points,
                                               TsaiFree free, double chi2, int max_iterations) {
  constexpr int kRounds = 20;
  // Descending heights are refused as mirrored points, so a step in that direction is
  // wrong.
  const auto step_of = [](const StageCheck& found, double times) {
    return std::log(std::clamp((1 + found.stroke_percent / 100) / times, 0.5, 2.0));
  };
  std::optional<StageCheck> check = check_stages(camera, points, free, chi2);
  if (!check || check->contradiction.empty()) return check;
  // Secant method on the logarithm of the height factor; the remaining deviation is the first step.
  double before = 0, left_before = step_of(*check, 1), now = left_before;
  Refinement fit{camera, true, 0, chi2};
  std::vector<Correspondence> raised = points;
  for (int round = 0; round < kRounds && std::abs(now) < 1; ++round) {
    const double times = std::exp(now);
    for (std::size_t i = 0; i < points.size(); ++i)
      raised[i].point_in_world.z() = times * points[i].point_in_world.z();
    fit = refine_tsai(fit.camera, raised, free, max_iterations);
    if (!fit.converged) break;
    auto next = check_stages(fit.camera, raised, free, fit.chi2, times);
    if (!next) break;
    const double left = step_of(*next, times);
    // A tenth of the stated uncertainty does not change any printed digit.
    if (std::abs(left) < 0.1 * next->stroke_sd_percent / 100 / times) return next;
    const double slope = (left - left_before) / (now - before);
    before = now;
    left_before = left;
    now += std::isfinite(slope) && slope < 0 ? -left / slope : left;
  }
  check->contradiction =
      "the target's pitch and the z stage's strokes contradict each other by more than the stages "
      "alone can measure, so no length is known: measure both, or record free poses and calibrate "
      "with --method joint";
  check->findings = {"z stage: " + check->contradiction};
  check->stroke_percent = check->stroke_sd_percent = std::numeric_limits<double>::quiet_NaN();
  return check;
}

std::string text_of(const StageCheck& check) {
  if (!std::isfinite(check.stroke_percent)) return "too far from z_mm in rig.toml to be measured";
  return fmt::format(
      "axis tilts by ({:+.4f}, {:+.4f}) +- ({:.4f}, {:.4f}) deg towards x and y, stroke off by "
      "{:+.4f} +- {:.4f} %, target turns by ({:+.4f}, {:+.4f}, {:+.4f}) +- ({:.4f}, {:.4f}, "
      "{:.4f}) deg over {:.0f} mm",
      check.tilt_deg.x(), check.tilt_deg.y(), check.tilt_sd_deg.x(), check.tilt_sd_deg.y(),
      check.stroke_percent, check.stroke_sd_percent, check.turn_deg.x(), check.turn_deg.y(),
      check.turn_deg.z(), check.turn_sd_deg.x(), check.turn_sd_deg.y(), check.turn_sd_deg.z(),
      check.stroke_mm);
}

}  // namespace drape::calib
