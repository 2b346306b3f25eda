// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/exchanged.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

#include "calib/joint/model.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

/// Points this far off, in stated standard deviations, are not noise; cameras that moved a little
/// are judged elsewhere.
constexpr double kGross = 10;
constexpr std::size_t kSetsTried = 3;

/// Median distance of the points from where the cameras together see them, in stated standard
/// deviations; infinite where most do not meet at all.
double disagreement(const Detections& detections, const Calibration& calibration) {
  std::vector<double> distances;
  for (const std::string& set : sets_of(detections)) {
    const auto points = measured_points(detections, calibration, set);
    std::map<MarkId, int> views;
    for (const FrameDetections& frame : detections.frames)
      if (frame.set == set)
        for (const Detection& d : frame.detections) ++views[d.mark];
    for (const FrameDetections& frame : detections.frames) {
      const CalibratedCamera* own = calibration.find(frame.camera);
      if (frame.set != set || own == nullptr) continue;
      for (const Detection& d : frame.detections) {
        if (views[d.mark] < 2) continue;
        const auto point = points.find(d.mark);
        double distance = std::numeric_limits<double>::infinity();
        if (point != points.end()) {
          const auto image = project(own->camera.model,
                                     own->camera.cam_from_world * (point->second.in_world_mm * mm));
          if (image) distance = (whitener(d.covariance_px2) * (d.centre_px - image->px)).norm();
        }
        distances.push_back(distance);
      }
    }
  }
  if (distances.empty()) return std::numeric_limits<double>::infinity();
  return median(std::move(distances));
}

/// A simple mistake, and how the detections would be without it.
struct Mistake {
  std::string sentence;
  std::function<void(Detections&)> undo;
};

using FrameChange = std::function<void(FrameDetections&)>;

/// On one camera, or on all of them where `camera` is empty.
std::function<void(Detections&)> on(const std::string& camera, const FrameChange& change) {
  return [camera, change](Detections& detections) {
    for (FrameDetections& frame : detections.frames)
      if (camera.empty() || frame.camera == camera) change(frame);
  };
}

void mirror_columns(FrameDetections& frame, int width_px) {
  for (Detection& d : frame.detections) {
    d.centre_px.x() = width_px - 1 - d.centre_px.x();
    d.covariance_px2(0, 1) = d.covariance_px2(1, 0) = -d.covariance_px2(0, 1);
  }
}

void mirror_rows(FrameDetections& frame, int height_px) {
  for (Detection& d : frame.detections) {
    d.centre_px.y() = height_px - 1 - d.centre_px.y();
    d.covariance_px2(0, 1) = d.covariance_px2(1, 0) = -d.covariance_px2(0, 1);
  }
}

std::vector<Mistake> mistakes(const Calibration& calibration, const MarkLattice& lattice) {
  std::vector<Mistake> list;
  const auto& cameras = calibration.cameras;
  for (std::size_t a = 0; a < cameras.size(); ++a) {
    for (std::size_t b = a + 1; b < cameras.size(); ++b) {
      const std::string first = cameras[a].camera.name, second = cameras[b].camera.name;
      list.push_back({fmt::format("{} and {} are exchanged: give each camera the name that it had "
                                  "when it was calibrated",
                                  first, second),
                      [first, second](Detections& detections) {
                        for (FrameDetections& frame : detections.frames) {
                          if (frame.camera == first) {
                            frame.camera = second;
                          } else if (frame.camera == second) {
                            frame.camera = first;
                          }
                        }
                      }});
    }
  }
  std::vector<std::string> names;
  names.reserve(cameras.size());
  for (const CalibratedCamera& camera : cameras) names.push_back(camera.camera.name);
  names.emplace_back();
  for (const std::string& name : names) {
    const std::string whose = name.empty() ? std::string("the images of all cameras are")
                                           : "the images of " + name + " are";
    const CameraModel& model =
        name.empty() ? cameras.front().camera.model : calibration.camera(name).camera.model;
    const int width = model.width_px, height = model.height_px;
    list.push_back({whose + " mirrored left to right: take the mirror out of the camera's settings "
                            "or of its optics",
                    on(name, [width](FrameDetections& frame) { mirror_columns(frame, width); })});
    list.push_back({whose + " mirrored top to bottom: take the mirror out of the camera's settings "
                            "or of its optics",
                    on(name, [height](FrameDetections& frame) { mirror_rows(frame, height); })});
    list.push_back({whose + " turned by 180 degrees: turn the camera back, or its setting",
                    on(name, [width, height](FrameDetections& frame) {
                      mirror_columns(frame, width);
                      mirror_rows(frame, height);
                    })});
    if (name.empty()) continue;
    const int rows = lattice.rows, cols = lattice.cols;
    const auto labels = [&](const std::string& what, bool row, bool col) {
      list.push_back(
          {fmt::format("the labels of the plate's points are {} in {}: use a plate whose points "
                       "have names, or show its whole print",
                       what, name),
           on(name, [rows, cols, row, col](FrameDetections& frame) {
             for (Detection& d : frame.detections) {
               if (row) d.mark.row = rows - 1 - d.mark.row;
               if (col) d.mark.col = cols - 1 - d.mark.col;
             }
           })});
    };
    labels("turned by 180 degrees", true, true);
    labels("mirrored", false, true);
    labels("mirrored", true, false);
  }
  return list;
}

/// Of most positions the cameras see the unprinted side.
bool seen_from_behind(const Calibration& calibration, const std::vector<Position>& positions) {
  std::size_t behind = 0;
  for (const Position& position : positions) {
    double towards = 0;
    for (const CalibratedCamera& camera : calibration.cameras)
      towards += (centre_in_world(camera.camera) - position.pose.translation_m)
                     .normalized()
                     .dot(position.pose.rotation.col(2));
    behind += towards < 0;
  }
  return 2 * behind > positions.size();
}

}  // namespace

std::string exchanged_or_mirrored(const Detections& detections, const Calibration& calibration,
                                  const Plate& plate, const std::vector<Position>& positions) {
  Detections some = detections;
  std::vector<std::string> sets = sets_of(detections);
  sets.resize(std::min(sets.size(), kSetsTried));
  std::erase_if(some.frames, [&](const FrameDetections& frame) {
    return std::find(sets.begin(), sets.end(), frame.set) == sets.end();
  });
  const double found = disagreement(some, calibration);
  if (found < kGross) {
    if (!seen_from_behind(calibration, positions)) return {};
    return "the plate is mirrored: its points lie as if they were seen from behind; the print or "
           "the images of all cameras are mirrored, or rows and columns are exchanged in its file";
  }
  std::string best;
  double least = kGross;
  MarkLattice lattice = detections.lattice;
  lattice.rows = plate.target.rows;
  lattice.cols = plate.target.cols;
  for (const Mistake& mistake : mistakes(calibration, lattice)) {
    Detections without = some;
    mistake.undo(without);
    const double left = disagreement(without, calibration);
    if (left >= least) continue;
    // Mirrored images of all cameras agree in a mirrored world.
    if (seen_from_behind(calibration, positions_of(without, calibration, plate))) continue;
    least = left;
    best = mistake.sentence;
  }
  return best;
}

}  // namespace drape::calib
