// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/rig.hpp"
#include "core/units.hpp"
#include "tests/support/bench1_truth.hpp"

namespace drape::test {

using namespace calib;

/// bench1's target as its target.toml describes it.
inline Target bench1_target() {
  Target target;
  target.rows = 9;
  target.cols = 12;
  target.pitch_m = 20 * units::mm;
  target.dot_diameter_m = 8 * units::mm;
  return target;
}

/// A rig with bench1's cameras and stages.
inline Rig bench1_rig(bool estimate_scale_x = true) {
  Rig rig;
  rig.name = "bench1";
  rig.file = "rig.toml";
  rig.target_file = "target.toml";
  for (const char* name : {"cam0", "cam1", "cam2"})
    rig.cameras.push_back({name, 1600, 1200, 3.45e-6, 3.45e-6});
  rig.stages = {
      {"stage_z000", 0}, {"stage_z030", 0.03}, {"stage_z060", 0.06}, {"stage_z090", 0.09}};
  rig.estimate_scale_x = estimate_scale_x;
  return rig;
}

/// Detections with every dot at the renderer's centroid of its disc, plus noise.
inline Detections bench1_target_detections(double noise_px, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_px);
  const Target target = bench1_target();
  Detections detections;
  detections.rig = "bench1";
  detections.lattice.surface = Surface::target;
  detections.lattice.rows = target.rows;
  detections.lattice.cols = target.cols;
  detections.lattice.pitch_m = target.pitch_m;
  detections.lattice.dot_diameter_m = target.dot_diameter_m;
  for (const TruePose& pose : bench1_truth().poses) {
    for (int camera = 0; camera < 3; ++camera) {
      FrameDetections frame;
      frame.set = pose.set;
      frame.camera = "cam" + std::to_string(camera);
      frame.width_px = 1600;
      frame.height_px = 1200;
      for (int dot = 0; dot < 108; ++dot) {
        Detection d;
        d.semi_axes_px.setConstant(16);
        d.mark = {dot / 12, dot % 12};
        d.centre_px = pose.centroid_px[camera][dot];
        if (noise_px > 0) d.centre_px += Eigen::Vector2d(noise(random), noise(random));
        const double sigma = noise_px > 0 ? noise_px : 0.01;
        d.covariance_px2 = sigma * sigma * Eigen::Matrix2d::Identity();
        frame.detections.push_back(d);
      }
      detections.frames.push_back(frame);
    }
  }
  return detections;
}

}  // namespace drape::test
