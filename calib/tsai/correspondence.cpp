// SPDX-License-Identifier: Apache-2.0
#include "calib/tsai/correspondence.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <set>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using units::mm;

constexpr std::size_t kLeastPoints = 11;

const FrameDetections& frame_of(const Detections& detections, const std::string& set,
                                const std::string& camera) {
  const FrameDetections* found = find_frame(detections, set, camera);
  if (found == nullptr) {
    throw bad_input("the detections hold no frame of this target stage",
                    {.camera = camera, .set = set},
                    "run `drape detect --surface target` on all sets of [[calibration.stage]]");
  }
  return *found;
}

}  // namespace

Eigen::Matrix2d whitener(const Eigen::Matrix2d& covariance_px2) {
  return Eigen::Matrix2d(covariance_px2.llt().matrixL()).inverse();
}

const FrameDetections* find_frame(const Detections& detections, const std::string& set,
                                  const std::string& camera) {
  const auto found = std::find_if(
      detections.frames.begin(), detections.frames.end(),
      [&](const FrameDetections& frame) { return frame.set == set && frame.camera == camera; });
  return found == detections.frames.end() ? nullptr : &*found;
}

void check_lattice(const Detections& detections, const Rig& rig, const Target& target) {
  const MarkLattice& lattice = detections.lattice;
  if (lattice.surface != Surface::target) {
    throw bad_input("the detections are of a cloth, not of the calibration target", {},
                    "give the file that `drape detect --surface target` wrote");
  }
  if (lattice.rows != target.rows || lattice.cols != target.cols ||
      lattice.pitch_m != target.pitch_m || lattice.dot_diameter_m != target.dot_diameter_m) {
    throw bad_input(
        fmt::format("the dots were detected with another target: {} x {} dots, pitch {} mm, "
                    "diameter {} mm",
                    lattice.rows, lattice.cols, lattice.pitch_m / mm, lattice.dot_diameter_m / mm),
        {.file = rig.target_file.string()}, "detect again with this target file");
  }
}

void check_frame(const FrameDetections& frame, const RigCamera& camera) {
  if (frame.width_px != camera.width_px || frame.height_px != camera.height_px) {
    throw bad_input(fmt::format("the image is {} x {} px, the rig's camera has {} x {} px",
                                frame.width_px, frame.height_px, camera.width_px, camera.height_px),
                    {.camera = frame.camera, .set = frame.set},
                    "correct width_px and height_px in rig.toml or record again");
  }
}

void check_detection(const Detection& d, const FrameDetections& frame) {
  const Eigen::LLT<Eigen::Matrix2d> factor(d.covariance_px2);
  if (!d.centre_px.allFinite() || !d.covariance_px2.allFinite() ||
      factor.info() != Eigen::Success) {
    throw bad_input(
        fmt::format("dot ({}, {}) has a position or covariance that is not a finite number or "
                    "not positive",
                    d.mark.row, d.mark.col),
        {.camera = frame.camera, .set = frame.set}, "detect this frame again");
  }
}

std::vector<Correspondence> stage_correspondences(const Detections& detections, const Rig& rig,
                                                  const Target& target, const std::string& camera) {
  check_lattice(detections, rig, target);
  std::vector<Correspondence> points;
  for (const TargetStage& stage : rig.stages) {
    const FrameDetections& frame = frame_of(detections, stage.set, camera);
    check_frame(frame, rig.camera(camera));
    for (const Detection& d : frame.detections) {
      check_detection(d, frame);
      const Eigen::Vector3d raised =
          target.point_in_target(d.mark) + stage.z_m * Eigen::Vector3d::UnitZ();
      points.push_back({raised, d.centre_px, d.covariance_px2, stage.set, d.mark});
    }
  }
  return points;
}

int check_correspondences(const std::vector<Correspondence>& points, const std::string& camera) {
  const Where where{.camera = camera};
  if (points.size() < kLeastPoints) {
    throw bad_input(fmt::format("{} target points; all parameters together need {} or more",
                                points.size(), kLeastPoints),
                    where, "light the target better or move it into the camera's view");
  }
  std::set<double> heights;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Correspondence& p : points) {
    if (!p.point_in_world.allFinite() || !p.px.allFinite()) {
      throw bad_input("a target point is not a finite number", where, "check target.toml");
    }
    heights.insert(p.point_in_world.z());
    mean += p.point_in_world / static_cast<double>(points.size());
  }
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Correspondence& p : points)
    spread += (p.point_in_world - mean) * (p.point_in_world - mean).transpose();
  const Eigen::Vector3d variances =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues();
  // A width below a thousandth of the length is print tolerance, not a second dimension.
  if (variances[1] <= 1e-6 * variances[2]) {
    throw bad_input("the target points lie on one line", where,
                    "show the camera more of the target");
  }
  if (variances[0] <= 1e-6 * variances[2] && heights.size() > 1) {
    throw bad_input("the heights of the target are as good as equal: no depth", where,
                    "record the target at heights that are apart by about its own size, or at one");
  }
  return static_cast<int>(heights.size());
}

}  // namespace drape::calib
