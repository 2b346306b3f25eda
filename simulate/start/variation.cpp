// SPDX-License-Identifier: Apache-2.0
#include "simulate/start/variation.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/statistics/random.hpp"

namespace drape::simulate {

using Eigen::Vector3d;

StartVariation variation_of(int index, bool friction_known) {
  constexpr double kPlace_m = 2e-3;
  StartVariation v;
  if (index == 0) return v;
  const auto pick = [&](int what, double low, double high) {
    return low +
           (high - low) * SplitMix64(0, static_cast<std::uint64_t>(index) * 16 + what).uniform();
  };
  v.noise_m = std::pow(10.0, pick(0, -6, -3.5));
  v.tilt_rad = pick(1, 0, 0.08);
  v.tilt_axis_rad = pick(2, 0, 2 * std::numbers::pi);
  v.yaw_rad = pick(3, -0.03, 0.03);
  v.lift_m = pick(4, 0, 0.01);
  v.folds = 2 + static_cast<int>(pick(5, 0, 6.999));
  v.fold_m = pick(6, 0, 6e-3);
  v.fold_phase_rad = pick(7, 0, 2 * std::numbers::pi);
  v.place_m = {pick(8, -kPlace_m, kPlace_m), pick(9, -kPlace_m, kPlace_m)};
  v.friction_factor = friction_known ? pick(10, 0.9, 1.1) : std::exp2(pick(10, -1, 1));
  v.drag_factor = std::exp2(pick(11, -2, 2));
  return v;
}

void vary(const StartVariation& v, std::vector<Vector3d>& places) {
  if (places.empty()) return;
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& place : places) middle += place / static_cast<double>(places.size());
  double reach_m = 0;
  for (const Vector3d& place : places)
    reach_m = std::max(reach_m, (place - middle).head<2>().norm());
  const Vector3d axis(std::cos(v.tilt_axis_rad), std::sin(v.tilt_axis_rad), 0);
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(v.tilt_rad, axis) * Eigen::AngleAxisd(v.yaw_rad, Vector3d::UnitZ()))
          .toRotationMatrix();
  double lowered_m = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vector3d from = places[i] - middle;
    const double out = reach_m > 0 ? from.head<2>().norm() / reach_m : 0;
    const double noise = v.noise_m * (2 * SplitMix64(0, 7919 * (i + 1)).uniform() - 1);
    const double wave = v.fold_m * out * out *
                        std::cos(v.folds * std::atan2(from.y(), from.x()) - v.fold_phase_rad);
    const Vector3d moved = turn * (from + Vector3d(0, 0, noise + wave));
    lowered_m = std::max(lowered_m, from.z() - moved.z());
    places[i] = middle + moved;
  }
  for (Vector3d& place : places)
    place += Vector3d(v.place_m.x(), v.place_m.y(), v.lift_m + lowered_m);
}

}  // namespace drape::simulate
