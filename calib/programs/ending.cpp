// SPDX-License-Identifier: Apache-2.0
#include "calib/programs/ending.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/program/shell_word.hpp"
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

/// The four classical measures in one line.
std::string errors_of(const ClassicalErrors& errors) {
  return fmt::format(
      "mean (largest) error {:.4f} ({:.4f}) px distorted, {:.4f} ({:.4f}) px undistorted, {:.4f} "
      "({:.4f}) mm on the target, {:.4f} of a pixel's rounding (Weng)",
      errors.distorted_px.mean, errors.distorted_px.max, errors.undistorted_px.mean,
      errors.undistorted_px.max, errors.object_mm.mean, errors.object_mm.max, errors.normalised);
}

/// All that the calibration's warnings say of a camera but its status, which is the verdict.
void add_reasons(Ending& ending, const CameraReport& camera) {
  const auto add = [&](const std::vector<std::string>& reasons, std::vector<std::string>& lines) {
    for (const std::string& reason : reasons)
      lines.push_back(fmt::format("{}: {}", camera.camera, reason));
  };
  add(camera.notes, ending.warnings);
  if (camera.stages) add(camera.stages->findings, ending.warnings);
  add(camera.rejected, ending.rejected);
}

}  // namespace

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
  for (const CalibratedCamera& camera : result.calibration.cameras) {
    const Eigen::Vector3d centre = centre_in_world(camera.camera) / units::mm;
    ending.numbers.emplace_back(
        camera.camera.name + " centre in world",
        fmt::format("({:.3f}, {:.3f}, {:.3f}) mm, target points miss their rays by {:.4f} mm RMS",
                    centre.x(), centre.y(), centre.z(), camera.residuals.object_rms_mm));
  }
  if (ending.go) {
    ending.next_command = fmt::format(
        "drape triangulate DETECTIONS --calibration {} --set NAME --scene SCENE.toml --out "
        "sheet.ply",
        shell_word(out.string()));
  }
  return ending;
}

}  // namespace drape::calib
