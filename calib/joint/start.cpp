// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/start.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "calib/joint/planar_view.hpp"
#include "core/error.hpp"

namespace drape::calib {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;

/// A rigid motion whose frames are kept by the reader, not by the compiler: this file chains many.
using Motion = CamFromWorld;

Motion after(const Motion& a, const Motion& b) {
  return {a.rotation * b.rotation, a.rotation * b.translation_m + a.translation_m};
}

Motion inverse(const Motion& a) {
  return {a.rotation.transpose(), -(a.rotation.transpose() * a.translation_m)};
}

Motion of(const WorldFromTarget& pose) {
  return {pose.rotation, pose.translation_m};
}

/// Turn angle (rad) plus shift in units of the distance: how far two motions are apart.
double apart(const Motion& a, const Motion& b) {
  const double turn = Eigen::AngleAxisd(a.rotation.transpose() * b.rotation).angle();
  const double size = std::max(a.translation_m.norm(), b.translation_m.norm()) + 1e-9;
  return turn + (a.translation_m - b.translation_m).norm() / size;
}

/// The candidate nearest to all others: a minority of wrong ones does not move it.
Motion majority(const std::vector<Motion>& candidates) {
  std::size_t best = 0;
  double least = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    double sum = 0;
    for (const Motion& other : candidates) sum += std::min(apart(candidates[i], other), 0.5);
    if (sum < least) {
      least = sum;
      best = i;
    }
  }
  return candidates[best];
}

/// Pose of the target in the camera frame, by frame of the model.
using Poses = std::vector<Motion>;

Poses poses_of_camera_views(JointModel& model) {
  Poses poses(model.frames.size());
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    Camera& camera = model.cameras[c].camera;
    const Vector2d middle((camera.model.width_px - 1) / 2.0, (camera.model.height_px - 1) / 2.0);
    std::vector<Matrix3d> homographies;
    std::vector<std::size_t> frames;
    for (std::size_t f = 0; f < model.frames.size(); ++f) {
      if (model.frames[f].camera != c) continue;
      const auto homography = homography_of(model.frames[f].points);
      if (!homography) {
        throw bad_input(
            "the target's points of this view lie on one line",
            {.camera = camera.name, .set = model.placements[model.frames[f].placement].set},
            "show the whole target");
      }
      homographies.push_back(*homography);
      frames.push_back(f);
    }
    if (frames.empty()) {
      throw bad_input("no view of the target by this camera", {.camera = camera.name},
                      "record the target where this camera sees it, then run `drape detect "
                      "--surface target`");
    }
    const auto focal = focal_px_of(homographies, middle);
    if (!focal) {
      throw bad_input(
          "the focal length cannot be told from the distance: the target lies parallel "
          "to the image in all views",
          {.camera = camera.name},
          "add views with the target tilted by 30 degrees or more, to both sides");
    }
    camera.model.lens = BrownLens{*focal, *focal, middle.x(), middle.y(), 0, 0, 0, 0, 0};
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const PlanarPose pose = planar_pose(homographies[i], *focal, middle);
      if (pose.mirrored) {
        throw bad_input(
            "the target's points are mirrored: their x, y, z are left-handed",
            {.camera = camera.name, .set = model.placements[model.frames[frames[i]].placement].set},
            "check that the image is not mirrored and that rows and columns of the "
            "target file run along +y and +x, z out of the printed face");
      }
      poses[frames[i]] = {pose.cam_from_target.rotation, pose.cam_from_target.translation_m};
    }
  }
  return poses;
}

std::optional<std::size_t> frame_at(const JointModel& model, std::size_t camera,
                                    std::size_t placement) {
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    if (model.frames[f].camera == camera && model.frames[f].placement == placement) return f;
  }
  return std::nullopt;
}

/// camera-from-camera0 of all cameras, found over placements that two cameras share.
std::vector<Motion> relative_cameras(const JointModel& model, const Poses& poses) {
  std::vector<std::optional<Motion>> found(model.cameras.size());
  found[0] = Motion{};
  for (bool grew = true; grew;) {
    grew = false;
    for (std::size_t c = 0; c < found.size(); ++c) {
      if (found[c]) continue;
      std::vector<Motion> candidates;
      for (std::size_t other = 0; other < found.size(); ++other) {
        if (!found[other]) continue;
        for (std::size_t p = 0; p < model.placements.size(); ++p) {
          const auto mine = frame_at(model, c, p), its = frame_at(model, other, p);
          if (!mine || !its) continue;
          candidates.push_back(after(after(poses[*mine], inverse(poses[*its])), *found[other]));
        }
      }
      if (candidates.empty()) continue;
      found[c] = majority(candidates);
      grew = true;
    }
  }
  std::vector<Motion> result;
  for (std::size_t c = 0; c < found.size(); ++c) {
    if (!found[c]) {
      throw bad_input("this camera shares no view of the target with the others",
                      {.camera = model.cameras[c].camera.name},
                      "record the target where this camera and another one see it together");
    }
    result.push_back(*found[c]);
  }
  return result;
}

/// camera0-from-target of all placements.
std::vector<Motion> placements_before_camera0(const JointModel& model, const Poses& poses,
                                              const std::vector<Motion>& cameras) {
  std::vector<std::vector<Motion>> candidates(model.placements.size());
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    const JointFrame& frame = model.frames[f];
    candidates[frame.placement].push_back(after(inverse(cameras[frame.camera]), poses[f]));
  }
  std::vector<Motion> result(candidates.size());
  for (std::size_t p = 0; p < candidates.size(); ++p) {
    if (!candidates[p].empty()) result[p] = majority(candidates[p]);
  }
  return result;
}

double rms_px(const JointModel& model, const JointFrame& frame) {
  double sum = 0;
  for (const TargetPoint& point : frame.points) {
    const auto px = pixel_of(model.cameras[frame.camera], model.placements[frame.placement],
                             model.bow, point.point_in_target);
    if (!px) return std::numeric_limits<double>::infinity();
    sum += (*px - point.measured_px).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(frame.points.size()));
}

/// A view whose labels contradict the others is off by much of the target's own image.
void refuse_swapped_labels(const JointModel& model) {
  for (const JointFrame& frame : model.frames) {
    Vector2d low = frame.points.front().measured_px, high = low;
    for (const TargetPoint& p : frame.points) {
      low = low.cwiseMin(p.measured_px);
      high = high.cwiseMax(p.measured_px);
    }
    const double off = rms_px(model, frame), size = (high - low).norm();
    if (off < 0.15 * size) continue;
    throw bad_input(
        fmt::format("the labels of this view contradict the other views: {:.0f} px off on a target "
                    "of {:.0f} px (swapped or turned corner order, a wrong height, or a camera "
                    "that moved)",
                    off, size),
        {.camera = model.cameras[frame.camera].camera.name,
         .set = model.placements[frame.placement].set},
        "look at the view; detect it again or take the set out of the rig file");
  }
}

}  // namespace

void start_joint(JointModel& model) {
  const Poses poses = poses_of_camera_views(model);
  const std::vector<Motion> cameras = relative_cameras(model, poses);
  const std::vector<Motion> targets = placements_before_camera0(model, poses, cameras);
  std::vector<Motion> worlds;  // camera0 from world
  for (std::size_t p = 0; p < targets.size(); ++p) {
    const bool seen = std::any_of(model.frames.begin(), model.frames.end(),
                                  [&](const JointFrame& f) { return f.placement == p; });
    if (model.placements[p].known && seen)
      worlds.push_back(after(targets[p], inverse(of(model.placements[p].world_from_target))));
  }
  if (worlds.empty()) {
    throw bad_input("no view of the target in its reference pose", {},
                    "record and detect the sets of [[calibration.stage]]");
  }
  const Motion world = majority(worlds);
  for (std::size_t c = 0; c < cameras.size(); ++c)
    model.cameras[c].camera.cam_from_world = after(cameras[c], world);
  for (std::size_t p = 0; p < targets.size(); ++p) {
    if (model.placements[p].known) continue;
    const Motion placed = after(inverse(world), targets[p]);
    model.placements[p].world_from_target = {placed.rotation, placed.translation_m};
  }
  refuse_swapped_labels(model);
}

}  // namespace drape::calib
