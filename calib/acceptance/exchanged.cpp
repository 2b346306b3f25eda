// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/exchanged.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <functional>
#include <limits>
#include <tuple>
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

/// A simple mistake, and how a frame would be without it.
struct Mistake {
  std::string sentence;
  std::function<void(FrameDetections&)> undo;
};

void mirror(FrameDetections& frame, const CameraModel& model, bool columns, bool rows) {
  for (Detection& d : frame.detections) {
    if (columns) d.centre_px.x() = model.width_px - 1 - d.centre_px.x();
    if (rows) d.centre_px.y() = model.height_px - 1 - d.centre_px.y();
    if (columns != rows) d.covariance_px2(0, 1) = d.covariance_px2(1, 0) = -d.covariance_px2(0, 1);
  }
}

std::vector<Mistake> mistakes(const Calibration& calibration, const MarkLattice& lattice) {
  std::vector<Mistake> list;
  std::vector<std::string> names;
  for (const CalibratedCamera& camera : calibration.cameras) {
    const std::string& second = camera.camera.name;
    for (const std::string& first : names)
      list.push_back({fmt::format("{} and {} are exchanged: give each camera the name that it had "
                                  "when it was calibrated",
                                  first, second),
                      [first, second](FrameDetections& frame) {
                        if (frame.camera == first || frame.camera == second)
                          frame.camera = frame.camera == first ? second : first;
                      }});
    names.push_back(second);
  }
  names.emplace_back();  // all cameras
  for (const std::string& name : names) {
    const CameraModel model =
        (name.empty() ? calibration.cameras.front() : calibration.camera(name)).camera.model;
    const auto add = [&](const std::string& sentence, auto change) {
      list.push_back({sentence, [name, change](FrameDetections& frame) {
                        if (name.empty() || frame.camera == name) change(frame);
                      }});
    };
    const std::string whose = "the images of " + (name.empty() ? "all cameras" : name) + " are ";
    for (const auto& [columns, rows, what] :
         {std::tuple(true, false,
                     "mirrored left to right: take the mirror out of the camera's settings or of "
                     "its optics"),
          {false, true,
           "mirrored top to bottom: take the mirror out of the camera's settings or of its optics"},
          {true, true, "turned by 180 degrees: turn the camera back, or its setting"}})
      add(whose + what, [model, columns = columns, rows = rows](FrameDetections& frame) {
        mirror(frame, model, columns, rows);
      });
    if (name.empty()) continue;
    for (const auto& [row, col, what] : {std::tuple(true, true, "turned by 180 degrees"),
                                         {false, true, "mirrored"},
                                         {true, false, "mirrored"}})
      add(fmt::format("the labels of the plate's points are {} in {}: use a plate whose points "
                      "have names, or show its whole print",
                      what, name),
          [lattice, row = row, col = col](FrameDetections& frame) {
            for (Detection& d : frame.detections) {
              if (row) d.mark.row = lattice.rows - 1 - d.mark.row;
              if (col) d.mark.col = lattice.cols - 1 - d.mark.col;
            }
          });
  }
  return list;
}

/// True where the cameras see the unprinted side in most positions.
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
    for (FrameDetections& frame : without.frames) mistake.undo(frame);
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
