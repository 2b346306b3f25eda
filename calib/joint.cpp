// SPDX-License-Identifier: Apache-2.0
#include "calib/joint.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "calib/checks/causes.hpp"
#include "calib/checks/exchanged_views.hpp"
#include "calib/checks/inputs.hpp"
#include "calib/checks/joint_checks.hpp"
#include "calib/joint/covariance.hpp"
#include "calib/joint/fit.hpp"
#include "calib/joint/start.hpp"
#include "calib/joint/view_scatter.hpp"
#include "calib/tsai/residuals.hpp"
#include "core/error.hpp"
#include "core/fields/records.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::MatrixXd;

std::size_t count_points(const JointModel& model) {
  std::size_t points = 0;
  for (const JointFrame& frame : model.frames) points += frame.points.size();
  return points;
}

/// Points of a camera with their world positions, for the measures shared with Tsai's method.
std::vector<Correspondence> correspondences(const JointModel& model, std::size_t camera) {
  std::vector<Correspondence> points;
  for (const JointFrame& frame : model.frames) {
    if (frame.camera != camera) continue;
    const Placement& placement = model.placements[frame.placement];
    for (const TargetPoint& p : frame.points) {
      points.push_back({placement.world_from_target * model.board.bent(p.point_in_target, p.place),
                        p.px(), p.covariance_px2, placement.set, p.dot});
    }
  }
  return points;
}

CalibratedCamera calibrated_camera(const JointModel& model, std::size_t index,
                                   const MatrixXd& joint_covariance) {
  CalibratedCamera calibrated;
  calibrated.camera = model.cameras[index].camera;
  const std::vector<Correspondence> points = correspondences(model, index);
  calibrated.residuals = residuals_of(calibrated.camera, points);
  calibrated.valid_region_px = covered_region_px(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d& place = points[(points.size() / 2 + i) % points.size()].point_in_world;
    const auto image = project(calibrated.camera.model, calibrated.camera.cam_from_world * place);
    if (!image) continue;
    calibrated.worked_point = {place, image->px};
    break;
  }
  if (joint_covariance.size() > 0) {
    calibrated.covariance_parameters = parameter_names(calibrated.camera.model);
    const auto size = static_cast<Eigen::Index>(calibrated.covariance_parameters.size());
    const auto at = static_cast<Eigen::Index>(index) * size;
    calibrated.covariance = joint_covariance.block(at, at, size, size);
  }
  return calibrated;
}

JointCameraReport camera_report(const JointModel& model, std::size_t index,
                                const CalibratedCamera& calibrated) {
  JointCameraReport report;
  const auto& lens = std::get<BrownLens>(calibrated.camera.model.lens);
  report.camera = calibrated.camera.name;
  report.points = calibrated.residuals.points;
  report.rms_px = calibrated.residuals.rms_px;
  report.object_rms_mm = calibrated.residuals.object_rms_mm;
  report.focal_px = lens.fx_px;
  report.skew_px = model.cameras[index].skew_px;
  report.covered_percent = covered_percent(model, index);
  report.largest_tilt_deg = largest_tilt_deg(model, index);
  for (const JointFrame& frame : model.frames)
    report.views += frame.camera == index && !frame.points.empty() ? 1 : 0;
  const MatrixXd& covariance = calibrated.covariance;
  if (covariance.size() == 0) return report;
  report.focal_sd_px = std::sqrt(std::max(covariance(0, 0), covariance(1, 1)));
  report.centre_sd_px = std::sqrt(std::max(covariance(2, 2), covariance(3, 3)));
  report.position_sd_mm = std::sqrt(centre_covariance_mm2(calibrated).trace());
  const WorldBox box = drape_volume(model);
  report.image_sd_px = projected_sd_px(calibrated, 0.5 * (box.low + box.high)).value_or(0);
  for (const Eigen::Vector3d& corner : grid_of(box, 2)) {
    report.image_sd_worst_px =
        std::max(report.image_sd_worst_px, projected_sd_px(calibrated, corner).value_or(0));
  }
  return report;
}

double largest_eccentricity(const JointModel& model) {
  double largest = 0;
  for (const JointFrame& frame : model.frames) {
    for (const TargetPoint& p : frame.points) largest = std::max(largest, p.eccentricity_px.norm());
  }
  return largest;
}

/// Smallest number of placements that can locate each point of a board, and the number from which
/// the intervals of free points are wide enough. In between, free points are chosen only if they
/// halve the held-out error.
constexpr std::size_t kViewsOfABoard = 6, kViewsOfASureBoard = 8;

/// Chooses board and lens by held-out error, without the views and points that are outliers of the
/// richest fit, and puts the tables into the report. Returns the start of the fit.
JointModel chosen(const JointModel& first, JointFit& fit, const JointCleaning& cleaning,
                  const JointOptions& options, JointReport& report) {
  const bool any_lens = !options.lens && !options.known_lenses;
  const bool any_board = !options.board && !first.board.measured &&
                         !first.board.point_sd_mm.empty() &&
                         first.placements.size() >= kViewsOfABoard;
  if (!any_lens && !any_board) return first;
  JointFit rich = fit;
  if (any_lens) rich.lens = LensTerms::k1_k2_p1_p2_k3;
  if (any_board) rich.board = BoardKind::free;
  // Heights of stages are checked later; here only the first stage is fixed.
  JointModel loose = first;
  bool world_kept = false;
  for (Placement& placement : loose.placements)
    placement.known = placement.known && !std::exchange(world_kept, world_kept || placement.known);
  const JointSolution richest = fit_joint(loose, rich, cleaning);
  JointModel clean = richest.converged ? richest.model : loose;
  std::vector<std::size_t> off = frames_off(clean, cleaning);
  for (; !off.empty() && 3 * off.size() <= clean.frames.size(); off.pop_back())
    clean.frames.erase(clean.frames.begin() + static_cast<std::ptrdiff_t>(off.back()));
  static_cast<void>(reject_outliers(clean, cleaning));
  std::vector<HeldOut> best;  // best lens for each board
  std::vector<std::vector<HeldOut>> tables;
  for (const BoardKind board : {any_board ? BoardKind::bow : fit.board, BoardKind::free}) {
    JointFit candidate = rich;
    candidate.board = board;
    std::vector<HeldOut> table;
    for (const LensTerms lens : all_lens_terms) {
      candidate.lens = any_lens ? lens : fit.lens;
      table.push_back(held_out_error(clean, candidate, options.held_out_groups));
      if (!any_lens) break;
    }
    best.push_back(table[choose(table)]);
    tables.push_back(std::move(table));
    if (!any_board) break;
  }
  if (best.front().points == 0) {
    report.warnings.emplace_back(
        "one placement of the target only: the lens could not be chosen by held-out error");
    return first;
  }
  std::size_t taken = choose(best);
  if (first.placements.size() < kViewsOfASureBoard && taken > 0 &&
      best[taken].rms_px > best.front().rms_px / 2)
    taken = 0;
  fit.board = best[taken].board;
  fit.lens = best[taken].lens;
  if (any_board) report.boards = best;
  if (any_lens) report.held_out = tables[taken];
  JointModel start = first;
  if (fit.board == BoardKind::free && richest.converged) {
    start = richest.model;
    start.placements = first.placements;
  }
  clear_unused(start, fit);
  return start;
}

/// Describes the target pose that would most reduce the calibration's share in a point's error.
std::string next_view(const Calibration& calibration, const JointModel& model,
                      const JointReport& report) {
  constexpr int kPlacesPerSide = 2;
  if (!report.volume_sd_mm) return {};
  std::map<MarkId, Eigen::Vector3d> points;
  std::vector<double> variances(model.cameras.size(), 0), counts = variances;
  for (const JointFrame& frame : model.frames)
    for (const TargetPoint& point : frame.points) {
      points.emplace(point.dot, point.point_in_target);
      variances[frame.camera] += point.covariance_px2.trace() / 2;
      ++counts[frame.camera];
    }
  std::vector<Eigen::Vector3d> in_target;
  for (const auto& [dot, point] : points) in_target.push_back(point);
  std::vector<double> sigma_px;
  for (std::size_t c = 0; c < variances.size(); ++c)
    sigma_px.push_back(std::sqrt(variances[c] / std::max(counts[c], 1.0)));
  const PosePlanner planner(calibration, in_target, drape_volume(model), sigma_px);
  const auto next = planner.next(kPlacesPerSide);
  if (!next) return "no further pose of the target would help within the cameras' view";
  return fmt::format(
      "target {} (seen whole by {} of {} cameras): calibration's part of a measured point {:.4f} "
      "-> {:.4f} mm",
      next->words, next->cameras.size(), model.cameras.size(), *report.volume_sd_mm,
      *report.volume_sd_mm * next->calibration_m / planner.now().calibration_m);
}

/// A fit with the covariance that may be stated for it, in file units.
struct StatedFit {
  JointSolution solution;
  JointCovariance covariance;
  ViewScatter scatter;
};

/// Weighted sum of squares per degree of freedom.
double chi2_per_dof(const JointSolution& solution, const JointFit& fit) {
  std::size_t points = 0;
  for (const JointFrame& frame : solution.model.frames) points += frame.points.size();
  return solution.chi2 / (2.0 * static_cast<double>(points) - free_parameters(solution.model, fit));
}

StatedFit with_uncertainty(JointSolution solution, const JointFit& fit) {
  StatedFit out;
  // With enough views for free points, residuals show the points' noise better than a statement.
  const double noise = chi2_per_dof(solution, fit);
  out.scatter = scatter_of_views(solution.model, fit,
                                 fit.board == BoardKind::free ? noise : std::max(1.0, noise));
  out.covariance = joint_covariance(solution.model, fit, out.scatter.covariance);
  out.solution = std::move(solution);
  return out;
}

/// Covariance from the scatter of the views and the uncertain choice of lens and board: averages
/// the covariances and differences of the other fits, weighted by the probability that other views
/// would select them (Buckland, Burnham and Augustin 1997).
StatedFit with_choices(const JointSolution& solution, const JointFit& fit,
                       const JointCleaning& cleaning, const JointReport& report) {
  constexpr double kRare = 0.005;
  StatedFit chosen = with_uncertainty(solution, fit);
  if (chosen.covariance.cameras.size() == 0) return chosen;
  const MatrixXd own = chosen.covariance.cameras, own_target = chosen.covariance.target;
  const Eigen::VectorXd own_board = chosen.covariance.board_sd.cwiseAbs2();
  Eigen::VectorXd board = own_board;
  MatrixXd of_others = MatrixXd::Zero(own.rows(), own.cols());  // the target's part
  double own_share = 1;
  for (const std::vector<HeldOut>* table : {&report.held_out, &report.boards}) {
    if (table->empty()) continue;
    const std::vector<double> shares = probabilities(*table);
    for (std::size_t i = 0; i < table->size(); ++i) {
      JointFit other_fit = fit;
      other_fit.lens = (*table)[i].lens;
      other_fit.board = (*table)[i].board;
      if (shares[i] < kRare || (other_fit.lens == fit.lens && other_fit.board == fit.board))
        continue;
      JointModel start = solution.model;
      clear_unused(start, other_fit);
      const StatedFit other = with_uncertainty(fit_joint(start, other_fit, cleaning), other_fit);
      if (other.covariance.cameras.size() == 0) continue;
      const Eigen::VectorXd apart = file_difference(other.solution.model, solution.model);
      chosen.covariance.cameras +=
          shares[i] * (other.covariance.cameras - own + apart * apart.transpose());
      own_share -= shares[i];
      of_others += shares[i] * other.covariance.target;
      if (other_fit.board != fit.board) of_others += shares[i] * apart * apart.transpose();
      const Eigen::VectorXd board_apart =
          other.solution.model.board.parameters() - solution.model.board.parameters();
      board +=
          shares[i] * (other.covariance.board_sd.cwiseAbs2() - own_board + board_apart.cwiseAbs2());
    }
  }
  // The probabilities of two tables may exceed 1 together: no part is taken away.
  chosen.covariance.target = std::max(0.0, own_share) * own_target + of_others;
  chosen.covariance.board_sd = board.cwiseMax(0).cwiseSqrt();
  return chosen;
}

/// Adds covariances that include the choice of lens and board.
void add_uncertainty(const JointSolution& solution, const JointFit& fit,
                     const JointCleaning& cleaning, const JointOptions& options,
                     JointResult& result) {
  const JointModel& model = solution.model;
  JointReport& report = result.report;
  Calibration& calibration = result.calibration;
  report.chi2_per_dof = chi2_per_dof(solution, fit);
  const StatedFit own = with_choices(solution, fit, cleaning, report);
  report.view_inflation = own.scatter.inflation;
  report.print = model.board.parameters();
  report.print_sd = own.covariance.board_sd;
  for (const Eigen::Vector3d& shift : model.board.shift_mm)
    report.print_rms_mm += shift.squaredNorm() / static_cast<double>(model.board.shift_mm.size());
  report.print_rms_mm = std::sqrt(report.print_rms_mm);
  calibration.joint_covariance_parameters = own.covariance.names;
  calibration.joint_covariance = own.covariance.cameras;
  if (options.known_lenses)
    add_known_lenses(calibration.joint_covariance, model, fit, *options.known_lenses);
  calibration.target_covariance = own.covariance.target;
  for (MatrixXd* covariance : {&calibration.joint_covariance, &calibration.target_covariance})
    add_scale_uncertainty(*covariance, model, options.scale_uncertainty);
}

/// Sets used for calibration.
std::vector<std::string> sets_of(const Rig& rig) {
  std::vector<std::string> sets = rig.free_poses;
  for (const TargetStage& stage : rig.stages) sets.push_back(stage.set);
  return sets;
}

/// Keeps the first stage as the world and makes the other stages free.
Rig with_free_stages(Rig rig) {
  if (rig.stages.size() < 2) return rig;
  std::vector<std::string> free;
  for (auto stage = rig.stages.begin() + 1; stage != rig.stages.end(); ++stage)
    free.push_back(stage->set);
  rig.free_poses.insert(rig.free_poses.begin(), free.begin(), free.end());
  rig.stages.resize(1);
  return rig;
}

/// Determines the scale of the print from the measured lengths.
void take_lengths(JointModel& model, const Target& target) {
  if (!(model.board.information(4, 4) > 0))
    model.board.information(4, 4) = 1 / (print_sd * print_sd);
  for (const KnownLength& known : target.known_lengths)
    model.lengths.push_back({place_of(target, known.from), place_of(target, known.to),
                             target.point_in_target(known.from), target.point_in_target(known.to),
                             known.length_m / units::mm, known.standard_uncertainty_m / units::mm});
}

/// Removes views that are outliers as a whole, and fits again. Does nothing if they are no
/// minority: a camera or stage that moved must be named by the verdict instead.
void drop_views(JointSolution& solution, const JointFit& fit, const JointCleaning& cleaning,
                std::vector<std::string>& rejected) {
  JointModel& model = solution.model;
  std::vector<std::size_t> off = frames_off(model, cleaning);
  // A wrong stage is reported by the check of the stages.
  const auto known = std::count_if(model.placements.begin(), model.placements.end(),
                                   [](const Placement& placement) { return placement.known; });
  std::erase_if(off, [&](std::size_t f) {
    return known > 1 && model.placements[model.frames[f].placement].known;
  });
  std::vector<int> views(model.cameras.size(), 0), gone(model.cameras.size(), 0);
  for (const JointFrame& frame : model.frames) ++views[frame.camera];
  for (const std::size_t f : off) ++gone[model.frames[f].camera];
  for (std::size_t c = 0; c < views.size(); ++c)
    if (3 * gone[c] > views[c]) return;
  std::vector<JointFrame> kept;
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    const JointFrame& frame = model.frames[f];
    const Placement& placement = model.placements[frame.placement];
    if (std::find(off.begin(), off.end(), f) == off.end()) {
      kept.push_back(frame);
      continue;
    }
    rejected.push_back(fmt::format(
        "set {}, {}: the whole view, most of its points lie off the other views' result "
        "(a target or camera that moved, a turned corner order, blur)",
        placement.set, model.cameras[frame.camera].camera.name));
  }
  if (off.empty()) return;
  model.frames = std::move(kept);
  drop_unseen_placements(model);
  solution = fit_joint(model, fit, cleaning);
}

/// Throws if a camera's points all lie off their predicted positions: it is not calibrated, even if
/// the others agree.
void require_points(const JointModel& model, const JointModel& all_points, const JointFit& fit,
                    const JointCleaning& cleaning) {
  std::vector<std::size_t> points(model.cameras.size(), 0);
  for (const JointFrame& frame : model.frames)
    for (const TargetPoint& point : frame.points)
      points[frame.camera] += pixel_of(model, frame, point).has_value();
  const auto none = std::find(points.begin(), points.end(), 0U);
  if (none == points.end()) return;
  const auto stages = check_stages(all_points, fit, cleaning);
  throw bad_input(
      "no point that it sees agrees with the other views" +
          (stages && !stages->contradiction.empty() ? ": " + stages->contradiction : ""),
      {.camera = model.cameras[static_cast<std::size_t>(none - points.begin())].camera.name},
      "correct z_mm or pitch_mm, or record the target again without a move");
}

void add_warnings(JointReport& report) {
  for (const ViewReport& view : report.views) {
    if (!view.suspicious) continue;
    report.warnings.push_back(
        fmt::format("set {}, {}: RMS {:.3f} px, above twice the median of all views; look at its "
                    "image (blur, glare, a moved target) or take the set out",
                    view.set, view.camera, view.rms_px));
  }
}

}  // namespace

void fields(Fields& f, JointOptions& o) {
  f.otherwise({"free_stages", "joint: treat all stages except the first as free poses"},
              o.free_stages);
  f.otherwise(
      {"thickness_mm", "joint: distance between the front and the back of a two-sided target", 1, 0,
       999, "give the thickness of the board in mm"},
      o.thickness_mm);
}

JointResult calibrate_joint(const JointModel& model, double dot_diameter_m,
                            const JointOptions& options) {
  JointResult result;
  JointReport& report = result.report;
  check_views(model, options.known_lenses.has_value(), report.warnings);
  JointFit fit;
  fit.lens = options.lens.value_or(LensTerms::k1_k2);
  fit.lens_known = options.known_lenses.has_value();
  if (fit.lens_known) fit.lens = LensTerms::k1_k2_p1_p2_k3;
  fit.skew = options.estimate_skew;
  fit.board = options.board.value_or(model.board.measured ? BoardKind::free : BoardKind::bow);
  fit.max_iterations = options.common.max_iterations;
  JointCleaning cleaning;
  cleaning.dot_diameter_m = options.common.correct_eccentricity ? dot_diameter_m : 0;
  cleaning.outlier_sigmas = options.common.outlier_sigmas;
  JointSolution solution = fit_joint(model, fit, cleaning);
  solution = fit_joint(chosen(solution.model, fit, cleaning, options, report), fit, cleaning);
  report.lens = fit.lens;
  report.board = fit.board;
  const Causes causes = causes_of(solution.model, fit);
  report.alone_px = causes.alone_px;
  report.warnings.insert(report.warnings.end(), causes.warnings.begin(), causes.warnings.end());
  drop_views(solution, fit, cleaning, report.rejected);
  const std::size_t measured = count_points(solution.model);
  const JointModel all_points = solution.model;
  const double gross_m = options.common.max_rms_mm * units::mm;
  const std::size_t far = points_farther(solution.model, gross_m);
  const std::vector<std::string> outliers = reject_outliers(solution.model, cleaning);
  const std::size_t gross = far - points_farther(solution.model, gross_m);
  report.rejected.insert(report.rejected.end(), outliers.begin(), outliers.end());
  if (!outliers.empty()) solution = fit_joint(solution.model, fit, cleaning);
  require_points(solution.model, all_points, fit, cleaning);
  report.stages = check_stages(all_points, fit, cleaning);
  if (report.stages) {
    report.warnings.insert(report.warnings.end(), report.stages->findings.begin(),
                           report.stages->findings.end());
  }
  report.iterations = solution.iterations;
  report.points = static_cast<int>(count_points(solution.model));
  report.max_eccentricity_px = largest_eccentricity(solution.model);
  report.views = view_reports(solution.model);
  add_uncertainty(solution, fit, cleaning, options, result);
  Calibration& calibration = result.calibration;
  calibration.method = "joint";
  for (const Placement& placement : solution.model.placements)
    calibration.sets.push_back(placement.set);
  double sum = 0;
  for (std::size_t c = 0; c < solution.model.cameras.size(); ++c) {
    calibration.cameras.push_back(
        calibrated_camera(solution.model, c, calibration.joint_covariance));
    report.cameras.push_back(camera_report(solution.model, c, calibration.cameras.back()));
    sum += std::pow(report.cameras.back().rms_px, 2) * report.cameras.back().points;
  }
  report.rms_px = std::sqrt(sum / report.points);
  const bool has_covariance = calibration.joint_covariance.size() > 0;
  if (has_covariance) {
    report.volume_sd_mm = volume_sd_mm(calibration, grid_of(drape_volume(solution.model), 3));
    report.next_view = next_view(calibration, solution.model, report);
  }
  if (fit.board == BoardKind::free && has_covariance)
    report.plate = measured_plate(solution.model, fit, report.view_inflation, report.print);
  if (report.plate) report.print_sd = report.plate->common_covariance.diagonal().cwiseSqrt();
  const std::string not_square = judge_squares(solution.model, calibration, report);
  report.status =
      joint_status(report, solution.converged, has_covariance, gross, measured, options.common);
  const bool contradicted = report.stages && !report.stages->contradiction.empty();
  if (!causes.fatal.empty() && !(contradicted && report.stages->other_unit())) {
    report.status = causes.fatal;
  } else if (contradicted) {
    report.status = report.good() ? report.stages->contradiction
                                  : report.stages->contradiction + "; " + report.status;
  } else if (!not_square.empty()) {
    report.status = report.good() ? not_square : not_square + "; " + report.status;
  } else if (!report.good() && !causes.warnings.empty()) {
    report.status += "; a likely cause: " + causes.warnings.front();
  }
  add_warnings(report);
  if (!report.good()) calibration.warnings.push_back(report.status);
  calibration.warnings.insert(calibration.warnings.end(), report.warnings.begin(),
                              report.warnings.end());
  for (const std::string& rejected : report.rejected)
    calibration.warnings.push_back("rejected " + rejected);
  return result;
}

JointResult calibrate_joint(const Detections& detections, const Rig& rig, const Target& target,
                            const JointOptions& options) {
  check_record(options.common);
  check_record(options);
  // Without stages the print's scale comes from the lengths, else from the heights.
  const bool scaled = options.board.value_or(BoardKind::free) == BoardKind::free &&
                      rig.stages.empty() && !target.known_lengths.empty();
  check_known_lengths(target, scaled ? print_sd : 0);
  refuse_sets_twice(rig);
  refuse_pictures_twice({detections, "", sets_of(rig)});
  std::vector<std::string> notes;
  JointModel model =
      joint_frames(detections, options.free_stages ? with_free_stages(rig) : rig, target, notes);
  if (options.known_lenses) {
    use_lenses(model, *options.known_lenses);
  } else {
    check_places(model);
  }
  const JointModel all = model;
  const std::vector<std::string> dropped =
      start_joint(model, {options.known_lenses.has_value(), options.thickness_mm * units::mm});
  const std::string unconfirmed = unconfirmed_labels(target, all, model);
  notes.insert(notes.end(), dropped.begin(), dropped.end());
  JointOptions with_scale = options;
  if (scaled)
    take_lengths(model, target);
  else
    with_scale.scale_uncertainty = scale_uncertainty(target);
  JointResult result = calibrate_joint(model, target.dot_diameter_m, with_scale);
  if (target.known_lengths.empty() && !result.report.stages) {
    const std::string unchecked =
        "nothing checks the scale: two heights of a z stage, or [known_length] in the target's "
        "file, would show a wrong pitch_mm";
    result.report.warnings.push_back(unchecked);
    result.calibration.warnings.push_back(unchecked);
  }
  std::string exchanged = exchanged_views(all, model);
  // Exchanged cameras on opposite sides look as one whose labels are turned does.
  if (!exchanged.empty() && !unconfirmed.empty()) exchanged += "; or " + unconfirmed;
  if (!exchanged.empty()) {
    result.report.status =
        result.report.good() ? exchanged : exchanged + "; " + result.report.status;
    result.calibration.warnings.insert(result.calibration.warnings.begin(), exchanged);
  } else if (!unconfirmed.empty()) {
    result.report.status = unconfirmed;
    result.calibration.warnings.insert(result.calibration.warnings.begin(), unconfirmed);
  } else if (const std::string lost = lost_stages(all, model); !lost.empty()) {
    result.report.status = result.report.good() ? lost : result.report.status + "; " + lost;
    result.calibration.warnings.insert(result.calibration.warnings.begin(), lost);
  }
  result.report.print_scale = print_scale_line(target);
  result.calibration.rig = rig.name;
  result.report.rejected.insert(result.report.rejected.end(), notes.begin(), notes.end());
  for (const std::string& note : notes) result.calibration.warnings.push_back(note);
  return result;
}

}  // namespace drape::calib
