// SPDX-License-Identifier: Apache-2.0
#include "calib/programs/joint_ending.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/program/shell_word.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

std::string camera_figures(const JointCameraReport& camera) {
  return fmt::format(
      "RMS {:.4f} px of {} points in {} views, f {:.2f} +- {:.2f} px, image centre +- {:.2f} px, "
      "camera centre +- {:.4f} mm, projection +- {:.4f} px in the middle of the drape volume and "
      "{:.4f} px at its worst corner, views cover {:.0f} % of the image, tilt up to {:.0f} deg",
      camera.rms_px, camera.points, camera.views, camera.focal_px, camera.focal_sd_px,
      camera.centre_sd_px, camera.position_sd_mm, camera.image_sd_px, camera.image_sd_worst_px,
      camera.covered_percent, camera.largest_tilt_deg);
}

std::string held_out_figures(const JointReport& report) {
  std::string text;
  for (const HeldOut& row : report.held_out) {
    if (!std::isfinite(row.rms_px)) {
      text += fmt::format("{}{} does not reach all their points", text.empty() ? "" : ", ",
                          name_of(row.lens));
      continue;
    }
    text += fmt::format("{}{} {:.5f} px ({:.5f} mm){}", text.empty() ? "" : ", ", name_of(row.lens),
                        row.rms_px, row.object_mm, row.lens == report.lens ? " <- used" : "");
  }
  return text;
}

void add_camera_lines(Ending& ending, const JointResult& result) {
  for (const JointCameraReport& camera : result.report.cameras)
    ending.numbers.emplace_back(camera.camera, camera_figures(camera));
  for (const CalibratedCamera& camera : result.calibration.cameras) {
    const Eigen::Vector3d centre = centre_in_world(camera.camera) / units::mm;
    ending.numbers.emplace_back(
        camera.camera.name + " centre in world",
        fmt::format("({:.3f}, {:.3f}, {:.3f}) mm, target points miss their rays by {:.4f} mm RMS",
                    centre.x(), centre.y(), centre.z(), camera.residuals.object_rms_mm));
  }
}

}  // namespace

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
    ending.numbers.emplace_back("error on views not used, by lens", held_out_figures(report));
  add_camera_lines(ending, result);
  ending.numbers.emplace_back(
      "target's bow", fmt::format("edges ({:+.4f}, {:+.4f}) +- ({:.4f}, {:.4f}) mm above the "
                                  "middle along x and y",
                                  report.bow_mm.x(), report.bow_mm.y(), report.bow_sd_mm.x(),
                                  report.bow_sd_mm.y()));
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
  if (ending.go) {
    ending.next_command = fmt::format(
        "drape triangulate DETECTIONS --calibration {} --set NAME --scene SCENE.toml --out "
        "sheet.ply",
        shell_word(out.string()));
  }
  return ending;
}

}  // namespace drape::calib
