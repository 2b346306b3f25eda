// SPDX-License-Identifier: Apache-2.0
#include "calib/programs/ending.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/program/words.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

std::string verdict_of(const CalibReport& report) {
  double worst_px = 0;
  for (const CameraReport& camera : report.cameras) {
    if (!camera.good()) return fmt::format("{}: {}", camera.camera, camera.status);
    worst_px = std::max(worst_px, camera.full.rms_px);
  }
  return fmt::format("{} cameras calibrated, RMS {:.4f} px at most", report.cameras.size(),
                     worst_px);
}

std::string figures_of(const CameraReport& camera) {
  return fmt::format(
      "RMS {:.4f} px of {} dots at {} heights (before the full optimisation {:.3f} px), "
      "f {:.4f} +- {:.4f} mm, image centre +- {:.2f} px, s_x {:.6f} in stage 1, "
      "dot eccentricity up to {:.3f} px, chi2/dof {:.2f}",
      camera.full.rms_px, camera.points, camera.planes, camera.basic.rms_px, camera.full.focal_mm,
      camera.focal_sd_mm, camera.centre_sd_px, camera.stage1_scale_x, camera.max_eccentricity_px,
      camera.chi2_per_dof);
}

/// Formats the four classical measures on one line.
std::string errors_of(const ClassicalErrors& errors) {
  return fmt::format(
      "mean (largest) error {:.4f} ({:.4f}) px distorted, {:.4f} ({:.4f}) px undistorted, {:.4f} "
      "({:.4f}) mm on the target, {:.4f} of a pixel's rounding (Weng)",
      errors.distorted_px.mean, errors.distorted_px.max, errors.undistorted_px.mean,
      errors.undistorted_px.max, errors.object_mm.mean, errors.object_mm.max, errors.normalised);
}

/// Adds a camera's warnings except its status, which is the verdict.
void add_reasons(Ending& ending, const CameraReport& camera) {
  const auto add = [&](const std::vector<std::string>& reasons, std::vector<std::string>& lines) {
    for (const std::string& reason : reasons)
      lines.push_back(fmt::format("{}: {}", camera.camera, reason));
  };
  add(camera.notes, ending.warnings);
  if (camera.stages) add(camera.stages->findings, ending.warnings);
  add(camera.rejected, ending.rejected);
}

std::string camera_figures(const JointCameraReport& camera) {
  return fmt::format(
      "RMS {:.4f} px of {} points in {} views, f {:.2f} +- {:.2f} px, image centre +- {:.2f} px, "
      "camera centre +- {:.4f} mm, projection +- {:.4f} px in the middle of the drape volume and "
      "{:.4f} px at its worst corner, views cover {:.0f} % of the image, tilt up to {:.0f} deg",
      camera.rms_px, camera.points, camera.views, camera.focal_px, camera.focal_sd_px,
      camera.centre_sd_px, camera.position_sd_mm, camera.image_sd_px, camera.image_sd_worst_px,
      camera.covered_percent, camera.largest_tilt_deg);
}

/// Errors on held-out views by lens or by board, with the one that the fit used.
template <class Kind>
std::string held_out_figures(const std::vector<HeldOut>& rows, Kind HeldOut::*kind, Kind used) {
  std::string text;
  for (const HeldOut& row : rows) {
    text += (text.empty() ? "" : ", ") + std::string(name_of(row.*kind));
    text += std::isfinite(row.rms_px)
                ? fmt::format(" {:.5f} px ({:.5f} mm){}", row.rms_px, row.object_mm,
                              row.*kind == used ? " <- used" : "")
                : " does not reach all their points";
  }
  return text;
}

void add_centres(Ending& ending, const Calibration& calibration) {
  for (const CalibratedCamera& camera : calibration.cameras) {
    const Eigen::Vector3d centre = centre_in_world(camera.camera) / units::mm;
    ending.numbers.emplace_back(
        camera.camera.name + " centre in world",
        fmt::format("({:.3f}, {:.3f}, {:.3f}) mm, target points miss their rays by {:.4f} mm RMS",
                    centre.x(), centre.y(), centre.z(), camera.residuals.object_rms_mm));
  }
}

}  // namespace

std::string next_command(const std::filesystem::path& calibration) {
  return fmt::format(
      "drape triangulate DETECTIONS --calibration {} --set NAME --scene SCENE.toml --out sheet.ply",
      shell_word(calibration.string()));
}

Ending ending_of(const CalibResult& result, const std::filesystem::path& out) {
  Ending ending;
  ending.go = result.report.good();
  ending.verdict = verdict_of(result.report);
  for (const CameraReport& camera : result.report.cameras) {
    ending.numbers.emplace_back(camera.camera, figures_of(camera));
    ending.numbers.emplace_back(camera.camera + " errors", errors_of(camera.errors));
    if (camera.stages)
      ending.numbers.emplace_back(camera.camera + " z stage", text_of(*camera.stages));
    add_reasons(ending, camera);
    if (camera.origin_shifted) {
      ending.warnings.push_back(
          fmt::format("{}: the world origin lies on the image's x axis (Ty {:.3f} mm), stage 1 "
                      "was solved about another origin",
                      camera.camera, camera.stage1_ty_mm));
    }
  }
  add_centres(ending, result.calibration);
  if (ending.go) ending.next_command = next_command(out);
  return ending;
}

Ending ending_of(const JointResult& result, const std::filesystem::path& out) {
  const JointReport& report = result.report;
  Ending ending;
  ending.go = report.good();
  ending.verdict =
      report.good()
          ? fmt::format("{} cameras calibrated together from {} sets, RMS {:.4f} px",
                        report.cameras.size(), result.calibration.sets.size(), report.rms_px)
          : report.status;
  if (!report.held_out.empty())
    ending.numbers.emplace_back("error on views not used, by lens",
                                held_out_figures(report.held_out, &HeldOut::lens, report.lens));
  if (!report.boards.empty())
    ending.numbers.emplace_back("the same, by board",
                                held_out_figures(report.boards, &HeldOut::board, report.board));
  for (const JointCameraReport& camera : report.cameras)
    ending.numbers.emplace_back(camera.camera, camera_figures(camera));
  add_centres(ending, result.calibration);
  ending.numbers.emplace_back(
      "target's bow",
      fmt::format("edges ({:+.4f}, {:+.4f}) +- ({:.4f}, {:.4f}) mm above the "
                  "middle along x and y",
                  report.print[0], report.print[1], report.print_sd[0], report.print_sd[1]));
  if (report.board == BoardKind::free) {
    ending.numbers.emplace_back(
        "target's print",
        fmt::format("stretch {:+.3f} +- {:.3f} %, shear {:+.3f} +- {:.3f} %, points off the "
                    "drawing by {:.4f} mm RMS beyond that",
                    100 * report.print[2], 100 * report.print_sd[2], 100 * report.print[3],
                    100 * report.print_sd[3], report.print_rms_mm));
  }
  if (report.stages) ending.numbers.emplace_back("z stage", text_of(*report.stages));
  ending.numbers.emplace_back(
      "fit", fmt::format("chi2/dof {:.2f}, views scatter {:.2f} times as wide as their points' "
                         "noise, dot eccentricity up to {:.3f} px",
                         report.chi2_per_dof, std::sqrt(report.view_inflation),
                         report.max_eccentricity_px));
  if (report.volume_sd_mm) {
    ending.numbers.emplace_back(
        "calibration's part",
        fmt::format("{:.4f} mm RMS of a measured point in the drape volume", *report.volume_sd_mm));
  }
  ending.numbers.emplace_back("print scale", report.print_scale);
  if (!report.next_view.empty()) ending.advice.push_back("next view to add: " + report.next_view);
  ending.rejected = report.rejected;
  ending.warnings = report.warnings;
  if (ending.go) ending.next_command = next_command(out);
  return ending;
}

void add_drift(Ending& ending, const Calibration& old, const Calibration& now, const Rig& rig,
               const Target& target) {
  if (old.no_go)
    ending.warnings.push_back("the old calibration is NO-GO, so the drift since it is uncertain: " +
                              *old.no_go);
  const Eigen::Vector3d corner =
      target.point_in_target({target.rows - 1, target.cols - 1}).cwiseAbs();
  double top_m = 0;
  for (const TargetStage& stage : rig.stages) top_m = std::max(top_m, stage.z_m);
  const Drift drift = drift_between(
      old, now, grid_of({{-corner.x(), -corner.y(), 0}, {corner.x(), corner.y(), top_m}}, 3));
  for (const CameraDrift& camera : drift.cameras) {
    ending.numbers.emplace_back(
        camera.camera + " since the old calibration",
        fmt::format("its images moved by {:.3f} px RMS, {:.3f} px expected by the uncertainties",
                    camera.moved_px, camera.expected_px));
    if (!camera.drifted()) continue;
    ending.rejected.push_back(fmt::format(
        "{} drifted since the old calibration: {:.3f} px RMS where {:.3f} px are expected; what "
        "was "
        "measured between the two is less certain than stated, clamp the camera and its lens",
        camera.camera, camera.moved_px, camera.expected_px));
  }
  if (drift.cameras.size() > 1) {
    ending.numbers.emplace_back(
        "a measured point since then",
        fmt::format("{:.4f} mm RMS, {:.4f} mm expected", drift.moved_mm, drift.expected_mm));
  }
  for (const std::string& camera : drift.not_in_old)
    ending.rejected.push_back(camera + " is not in the old calibration");
}

}  // namespace drape::calib
