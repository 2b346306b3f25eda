// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "calib/joint/start.hpp"
#include "calib/tsai/correspondence.hpp"
#include "core/error.hpp"
#include "core/geometry/next_pose.hpp"

namespace drape::calib {
namespace {

constexpr std::size_t kLeastDots = 4;  ///< least dots of a frame, for its pose

void set_extent(BoardBow& bow, const Target& target) {
  const Eigen::Vector3d corner =
      target.point_in_target({target.rows - 1, target.cols - 1}).cwiseAbs();
  bow.half_m = corner.head<2>();
  for (const Eigen::Vector3d& point : points_of(target))
    bow.mean += point.head<2>().cwiseQuotient(bow.half_m).cwiseAbs2();
  bow.mean /= target.rows * target.cols;
}

std::vector<Placement> placements_of(const Rig& rig) {
  std::vector<Placement> placements;
  for (const TargetStage& stage : rig.stages) {
    Placement placement{stage.set, {}, true};
    placement.world_from_target.translation_m.z() = stage.z_m;
    placements.push_back(placement);
  }
  for (const std::string& set : rig.free_poses) placements.push_back({set, {}, false});
  return placements;
}

}  // namespace

void drop_unseen_placements(JointModel& model) {
  std::vector<Placement> seen;
  std::vector<std::size_t> where(model.placements.size());
  for (std::size_t p = 0; p < model.placements.size(); ++p) {
    where[p] = seen.size();
    if (std::any_of(model.frames.begin(), model.frames.end(),
                    [&](const JointFrame& frame) { return frame.placement == p; }))
      seen.push_back(model.placements[p]);
  }
  for (JointFrame& frame : model.frames) frame.placement = where[frame.placement];
  model.placements = std::move(seen);
  const bool held = std::any_of(model.placements.begin(), model.placements.end(),
                                [](const Placement& placement) { return placement.known; });
  if (held || !model.world_by_first_view || model.placements.empty()) return;
  const WorldFromTarget first = model.placements.front().world_from_target;
  const Pose<frame::World, frame::World> to_old{first.rotation, first.translation_m};
  for (Placement& placement : model.placements)
    placement.world_from_target = to_old.inverse() * placement.world_from_target;
  for (JointCamera& camera : model.cameras)
    camera.camera.cam_from_world = camera.camera.cam_from_world * to_old;
  model.placements.front().known = true;
  model.placements.front().world_from_target = {};
}

JointModel joint_frames(const Detections& detections, const Rig& rig, const Target& target,
                        std::vector<std::string>& notes) {
  check_lattice(detections, rig, target);
  JointModel model;
  set_extent(model.bow, target);
  model.placements = placements_of(rig);
  for (const RigCamera& rig_camera : rig.cameras) {
    JointCamera camera;
    camera.camera.name = rig_camera.name;
    camera.camera.model = {BrownLens{}, rig_camera.width_px, rig_camera.height_px};
    model.cameras.push_back(camera);
  }
  for (std::size_t p = 0; p < model.placements.size(); ++p) {
    for (std::size_t c = 0; c < model.cameras.size(); ++c) {
      const std::string& set = model.placements[p].set;
      const std::string& name = rig.cameras[c].name;
      const FrameDetections* frame = find_frame(detections, set, name);
      const std::size_t dots = frame == nullptr ? 0 : frame->detections.size();
      if (dots < kLeastDots) {
        notes.push_back(fmt::format("set {}, {}: {} dots, not used (a view needs {})", set, name,
                                    dots, kLeastDots));
        continue;
      }
      check_frame(*frame, rig.cameras[c]);
      JointFrame used{c, p, {}};
      for (const Detection& d : frame->detections) {
        check_detection(d, *frame);
        used.points.push_back(
            {d.mark, target.point_in_target(d.mark), d.centre_px, d.covariance_px2});
      }
      model.frames.push_back(std::move(used));
    }
  }
  model.world_by_first_view = rig.stages.empty();
  drop_unseen_placements(model);
  return model;
}

}  // namespace drape::calib
