// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/alone.hpp"

#include <fmt/format.h>

#include "calib/joint/planar_view.hpp"
#include "core/error.hpp"
#include "core/statistics/sample.hpp"

namespace drape::calib {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;

/// Fewer views do not determine a lens with distortion.
constexpr std::size_t kLeastViewsOfALens = 3;

std::string name_of_view(const JointModel& model, std::size_t frame) {
  const JointFrame& f = model.frames[frame];
  return fmt::format("set {}, {}", model.placements[f.placement].set,
                     model.cameras[f.camera].camera.name);
}

struct Homography {
  std::size_t frame = 0;
  Matrix3d matrix;
};

std::vector<Homography> homographies_of(const JointModel& model, std::size_t camera,
                                        bool lens_known, std::vector<std::string>& dropped) {
  std::vector<Homography> found;
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    if (model.frames[f].camera != camera) continue;
    const std::vector<TargetPoint>& points = model.frames[f].points;
    const auto homography = homography_of(
        lens_known ? without_lens(model.cameras[camera].camera.model, points) : points);
    if (homography) {
      found.push_back({f, *homography});
    } else {
      dropped.push_back(name_of_view(model, f) +
                        ": not used, the target's points of this view lie on one line");
    }
  }
  return found;
}

/// Common focal length of all views; if a bad view spoils it, the median of single-view results.
std::optional<double> focal_px(const std::vector<Homography>& views, const Vector2d& middle) {
  std::vector<Matrix3d> all;
  std::vector<double> own;
  for (const Homography& view : views) {
    all.push_back(view.matrix);
    if (const auto focal = focal_px_of({view.matrix}, middle)) own.push_back(*focal);
  }
  if (const auto focal = focal_px_of(all, middle)) return focal;
  if (2 * own.size() <= views.size()) return std::nullopt;
  return median(own);
}

/// The camera's own views; the first one defines the world.
JointModel own_views(const JointModel& model, std::size_t camera, const SeenTargets& views,
                     std::vector<std::size_t>& frames) {
  JointModel own;
  own.board = model.board;
  own.cameras = {model.cameras[camera]};
  own.cameras[0].camera.cam_from_world = {};
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    if (!views[f]) continue;
    const CamFromTarget& pose = views[f]->cam_from_target;
    own.frames.push_back({0, own.placements.size(), model.frames[f].points});
    own.placements.push_back({model.placements[model.frames[f].placement].set,
                              {pose.rotation, pose.translation_m},
                              own.placements.empty()});
    frames.push_back(f);
  }
  return own;
}

bool plausible(const JointCamera& camera, double start_focal_px) {
  const auto& lens = std::get<BrownLens>(camera.camera.model.lens);
  const double ratio = lens.fx_px / start_focal_px;
  return ratio > 0.2 && ratio < 5 && lens.fy_px > 0 && lens.cx_px > 0 && lens.cy_px > 0 &&
         lens.cx_px < camera.camera.model.width_px && lens.cy_px < camera.camera.model.height_px;
}

/// Refines lens and poses, keeping the start if that fails. Drops views that remain outliers.
void refine(JointModel& model, std::size_t index, bool lens_known, SeenTargets& alone,
            std::vector<std::string>& dropped, LensTerms lens) {
  JointFit fit;
  fit.lens = lens;
  fit.board = BoardKind::drawn;
  fit.lens_known = lens_known;
  const double start_focal_px = std::get<BrownLens>(model.cameras[index].camera.model.lens).fx_px;
  for (;;) {
    std::vector<std::size_t> frames;
    JointModel own = own_views(model, index, alone, frames);
    if (!lens_known && frames.size() < kLeastViewsOfALens) return;
    JointSolution solution = fit_joint(own, fit, {});
    if (!solution.converged || !plausible(solution.model.cameras[0], start_focal_px)) return;
    const std::vector<std::size_t> off = frames_off(solution.model, {});
    if (!off.empty() && frames.size() - off.size() >= kLeastViewsOfALens) {
      for (const std::size_t i : off) {
        alone[frames[i]].reset();
        dropped.push_back(name_of_view(model, frames[i]) +
                          ": not used, most of its points lie off the camera's other views");
      }
      continue;
    }
    model.cameras[index].camera.model.lens = solution.model.cameras[0].camera.model.lens;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      alone[frames[i]]->cam_from_target = solution.model.cameras[0].camera.cam_from_world *
                                          solution.model.placements[i].world_from_target;
    }
    return;
  }
}

}  // namespace

std::vector<TargetPoint> without_lens(const CameraModel& camera, std::vector<TargetPoint> points) {
  std::vector<TargetPoint> straight;
  for (TargetPoint& point : points) {
    const auto ray = unproject(camera, point.measured_px);
    if (!ray || !(ray->z() > 0)) continue;
    point.measured_px = ray->head<2>() / ray->z();
    straight.push_back(point);
  }
  return straight;
}

SeenTargets solve_alone(JointModel& model, std::size_t index, bool lens_known,
                        std::vector<std::string>& dropped, LensTerms lens) {
  Camera& camera = model.cameras[index].camera;
  const std::vector<Homography> homographies = homographies_of(model, index, lens_known, dropped);
  if (homographies.empty()) {
    throw bad_input("no view of the target by this camera", {.camera = camera.name},
                    "record the target where this camera sees it, then run `drape detect "
                    "--surface target`; a chessboard's rows and cols count inner corners, one less "
                    "than squares");
  }
  double focal = 1;
  Vector2d middle = Vector2d::Zero();
  if (!lens_known) {
    middle = {(camera.model.width_px - 1) / 2.0, (camera.model.height_px - 1) / 2.0};
    const auto found = focal_px(homographies, middle);
    if (!found) {
      throw bad_input(
          "the focal length cannot be separated from the distance: the target lies parallel "
          "to the image in all views",
          {.camera = camera.name},
          "add views with the target tilted by 30 degrees or more, to both sides");
    }
    focal = *found;
    camera.model.lens = BrownLens{focal, focal, middle.x(), middle.y(), 0, 0, 0, 0, 0};
  }
  SeenTargets alone(model.frames.size());
  for (const Homography& view : homographies) {
    const PlanarPose pose = planar_pose(view.matrix, focal, middle);
    alone[view.frame] = SeenTarget{pose.cam_from_target, pose.mirrored};
  }
  refine(model, index, lens_known, alone, dropped, lens);
  return alone;
}

}  // namespace drape::calib
