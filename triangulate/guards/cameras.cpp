// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "core/statistics/sample.hpp"
#include "core/units.hpp"
#include "triangulate/agreement.hpp"
#include "triangulate/guards/guards.hpp"
#include "triangulate/lattice_views.hpp"

namespace drape::triangulate {
namespace {

/// Limit of the median misfit in standard deviations. Errors common to all marks (a camera's pose)
/// exceed it once in 400 cases if the covariances are right.
constexpr double kMissSigmas = 3;
constexpr std::size_t kLeastMarks = 8;
/// Largest number of cameras for which every permutation is tried; with more, only pairs.
constexpr std::size_t kEveryOrder = 4;

Misses misses_with(const Detections& detections, const Calibration& calibration,
                   const std::string& set, const TriangulateOptions& options) {
  const JointPlaces places = joint_places(calibration);
  std::vector<double> all;
  for (const MarkViews& mark :
       collect_views(detections, calibration, places, set, options.floor_px)) {
    if (mark.views.size() < 2) continue;
    const Point point = solve_point(mark.views, options.min_angle_deg * units::deg);
    if (point.status == PointStatus::not_observable) continue;
    all.push_back(point.status == PointStatus::good ? point.disagreement_sigmas() : 1e6);
  }
  if (all.empty()) return {};
  return {median(all), all.size()};
}

/// Frames of the set only, with cameras renamed by `names`; an empty name drops a
/// frame.
Detections renamed(const Detections& detections, const std::string& set,
                   const std::map<std::string, std::string>& names) {
  Detections result;
  result.rig = detections.rig;
  result.lattice = detections.lattice;
  for (FrameDetections frame : detections.frames) {
    if (frame.set != set || names.at(frame.camera).empty()) continue;
    frame.camera = names.at(frame.camera);
    result.frames.push_back(std::move(frame));
  }
  return result;
}

std::map<std::string, std::string> named(const std::vector<std::string>& from,
                                         const std::vector<std::string>& to) {
  std::map<std::string, std::string> names;
  for (std::size_t i = 0; i < from.size(); ++i) names[from[i]] = to[i];
  return names;
}

std::vector<std::vector<std::string>> orders_of(const std::vector<std::string>& cameras) {
  std::vector<std::vector<std::string>> orders;
  if (cameras.size() <= kEveryOrder) {
    std::vector<std::string> order = cameras;
    std::sort(order.begin(), order.end());
    do orders.push_back(order);
    while (std::next_permutation(order.begin(), order.end()));
    return orders;
  }
  for (std::size_t a = 0; a < cameras.size(); ++a) {
    for (std::size_t b = a + 1; b < cameras.size(); ++b) {
      orders.push_back(cameras);
      std::swap(orders.back()[a], orders.back()[b]);
    }
  }
  return orders;
}

std::string exchanged_text(const std::vector<std::string>& from,
                           const std::vector<std::string>& to) {
  std::string text;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (from[i] != to[i])
      text += fmt::format("{}{} shows what {} saw", text.empty() ? "" : ", ", from[i], to[i]);
  }
  return text;
}

bool same_size(const Calibration& calibration, const std::vector<std::string>& from,
               const std::vector<std::string>& to) {
  for (std::size_t i = 0; i < from.size(); ++i) {
    const CameraModel &a = calibration.camera(from[i]).camera.model,
                      &b = calibration.camera(to[i]).camera.model;
    if (a.width_px != b.width_px || a.height_px != b.height_px) return false;
  }
  return true;
}

}  // namespace

std::vector<std::string> contradictions_of_cameras(const Detections& detections,
                                                   const Calibration& calibration,
                                                   const std::string& set,
                                                   const TriangulateOptions& options,
                                                   const Misses& now) {
  if (now.marks < kLeastMarks || now.median_sigmas <= kMissSigmas) return {};
  // Without correction of their shape, as here, dots on curved cloth also miss by over three sigma.
  const double solved = std::max(kMissSigmas, now.median_sigmas / 10);
  std::vector<std::string> cameras;
  for (const FrameDetections& frame : detections.frames)
    if (frame.set == set) cameras.push_back(frame.camera);
  const std::string missed = fmt::format(
      "set {}: the views of {} marks miss each other by {} sigma (median)", set, now.marks,
      now.median_sigmas < 1e5 ? fmt::format("{:.1f}", now.median_sigmas) : "more than 100000");
  for (const std::vector<std::string>& order : orders_of(cameras)) {
    if (order == cameras || !same_size(calibration, cameras, order)) continue;
    const Misses then =
        misses_with(renamed(detections, set, named(cameras, order)), calibration, set, options);
    if (then.median_sigmas > solved || 2 * then.marks < now.marks) continue;
    return {fmt::format(
        "{}: cameras are exchanged, {} (named so the {} marks agree within {:.1f} sigma); rename "
        "its files in the recording, or import the set again",
        missed, exchanged_text(cameras, order), then.marks, then.median_sigmas)};
  }
  if (cameras.size() >= 3) {
    std::string odd;
    double least = solved;
    for (const std::string& camera : cameras) {
      auto names = named(cameras, cameras);
      names[camera].clear();
      const Misses then = misses_with(renamed(detections, set, names), calibration, set, options);
      if (then.marks < kLeastMarks || then.median_sigmas > least) continue;
      least = then.median_sigmas;
      odd = camera;
    }
    if (!odd.empty())
      return {fmt::format(
          "{}: {} moved after the calibration, or its picture is of another set (without it the "
          "others agree within {:.1f} sigma); calibrate again, then take the set again",
          missed, odd, least)};
  }
  return {missed +
          ": a camera moved after the calibration, or a picture is of another set; calibrate "
          "again, then take the set again"};
}

}  // namespace drape::triangulate
