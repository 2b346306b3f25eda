// SPDX-License-Identifier: Apache-2.0
// Plain-text formats: Kalibr's camchain, COLMAP's model.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>

#include "calib/exchange/formats.hpp"

namespace drape::calib {
namespace {

std::string chain_row(const CamFromWorld& pose, int row) {
  const Eigen::RowVector3d r = pose.rotation.row(row);
  return fmt::format("  - [{}, {}, {}, {}]\n", r[0], r[1], r[2], pose.translation_m[row]);
}

}  // namespace

std::vector<ExportedFile> kalibr_files(const std::vector<BrownCamera>& cameras) {
  std::string text;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const BrownCamera& camera = cameras[i];
    const BrownLens& lens = camera.lens;
    text += fmt::format("cam{}:\n", i);
    if (i > 0) {
      // Pose of camera i relative to camera i - 1, through the world.
      const CamFromWorld& before = cameras[i - 1].cam_from_world;
      CamFromWorld step;
      step.rotation = camera.cam_from_world.rotation * before.rotation.transpose();
      step.translation_m =
          camera.cam_from_world.translation_m - step.rotation * before.translation_m;
      text += "  T_cn_cnm1:\n" + chain_row(step, 0) + chain_row(step, 1) + chain_row(step, 2) +
              "  - [0.0, 0.0, 0.0, 1.0]\n";
    }
    text += fmt::format(
        "  camera_model: pinhole\n  distortion_coeffs: [{}, {}, {}, {}]\n"
        "  distortion_model: radtan\n  intrinsics: [{}, {}, {}, {}]\n"
        "  resolution: [{}, {}]\n  rostopic: /{}/image_raw\n",
        lens.k1, lens.k2, lens.p1, lens.p2, lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px,
        camera.width_px, camera.height_px, camera.name);
  }
  return {{"camchain.yaml", text}};
}

std::vector<ExportedFile> colmap_files(const std::vector<BrownCamera>& cameras) {
  constexpr double kHalfPixel = 0.5;  // COLMAP's corner pixel has its centre at (0.5, 0.5)
  std::string lenses =
      "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS; written by drapebench, lengths in m\n";
  std::string images =
      "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then POINTS2D (none); lengths in m\n";
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const BrownCamera& camera = cameras[i];
    const BrownLens& lens = camera.lens;
    const bool full = lens.k3 != 0;
    lenses +=
        fmt::format("{} {} {} {} {} {} {} {} {} {} {} {}{}\n", i + 1,
                    full ? "FULL_OPENCV" : "OPENCV", camera.width_px, camera.height_px, lens.fx_px,
                    lens.fy_px, lens.cx_px + kHalfPixel, lens.cy_px + kHalfPixel, lens.k1, lens.k2,
                    lens.p1, lens.p2, full ? fmt::format(" {} 0 0 0", lens.k3) : "");
    const Eigen::Quaterniond q(camera.cam_from_world.rotation);
    const Eigen::Vector3d& t = camera.cam_from_world.translation_m;
    images += fmt::format("{} {} {} {} {} {} {} {} {} {}.png\n\n", i + 1, q.w(), q.x(), q.y(),
                          q.z(), t.x(), t.y(), t.z(), i + 1, camera.name);
  }
  return {{"cameras.txt", lenses}, {"images.txt", images}, {"points3D.txt", "# no points\n"}};
}

}  // namespace drape::calib
