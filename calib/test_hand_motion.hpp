// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace drape::test {

/// A board moved by hand: a random walk of rotation and position, smoothed as by an arm, with stops
/// and starts. Everything follows from the seed.
class HandMotion {
 public:
  struct Pose {
    Eigen::Vector3d turn;     ///< rad
    Eigen::Vector3d shift_m;  ///< from the centre of the volume
  };

  HandMotion(unsigned seed, double seconds) : samples_(static_cast<int>(seconds / kStep) + 1) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    // Alternates between moving and being held, for 0.4 to 2.4 s each.
    std::vector<double> gate(static_cast<std::size_t>(samples_));
    bool moves = true;
    for (std::size_t i = 0; i < gate.size(); moves = !moves) {
      const std::size_t until =
          i + static_cast<std::size_t>(
                  (moves ? 0.8 + 1.6 * uniform(random) : 0.4 + 0.8 * uniform(random)) / kStep);
      for (; i < std::min(until, gate.size()); ++i) gate[i] = moves ? 1 : 0;
    }
    gate = smoothed(gate, 0.1);
    // Speed of a hand that turns a board: RMS of 0.06 m/s and 0.5 rad/s per axis.
    for (std::size_t axis = 0; axis < 6; ++axis) {
      std::vector<double> speed(gate.size());
      for (double& v : speed) v = normal(random);
      speed = smoothed(speed, 0.25);
      double squares = 0;
      for (const double v : speed) squares += v * v / static_cast<double>(speed.size());
      const double wanted = axis < 3 ? 0.5 : 0.06, limit = axis < 3 ? 0.4 : 0.03;
      std::vector<double>& place = places_[axis];
      place.resize(gate.size());
      double at = 0;
      for (std::size_t i = 0; i < gate.size(); ++i) {
        // Pulls it back to the centre, so that the board stays in the volume.
        const double pull = -at / limit * wanted;
        at += kStep * gate[i] * (wanted * speed[i] / std::sqrt(squares) + pull);
        place[i] = at;
      }
    }
  }

  [[nodiscard]] Pose at(double seconds) const {
    std::array<double, 6> p{};
    const double place = std::clamp(seconds / kStep, 0.0, samples_ - 2.0);
    const auto i = static_cast<std::size_t>(place);
    const double part = place - static_cast<double>(i);
    for (std::size_t axis = 0; axis < 6; ++axis)
      p[axis] = (1 - part) * places_[axis][i] + part * places_[axis][i + 1];
    return {{p[0], p[1], p[2]}, {p[3], p[4], p[5]}};
  }

 private:
  static constexpr double kStep = 0.002;  // s

  /// Smooths with a Gaussian of this standard deviation (s).
  static std::vector<double> smoothed(const std::vector<double>& values, double sd) {
    const int reach = static_cast<int>(3 * sd / kStep);
    std::vector<double> kernel, out(values.size(), 0);
    double sum = 0;
    for (int k = -reach; k <= reach; ++k) {
      kernel.push_back(std::exp(-0.5 * std::pow(k * kStep / sd, 2)));
      sum += kernel.back();
    }
    const int count = static_cast<int>(values.size());
    for (int i = 0; i < count; ++i)
      for (int k = -reach; k <= reach; ++k)
        out[static_cast<std::size_t>(i)] +=
            kernel[static_cast<std::size_t>(k) + reach] / sum *
            values[static_cast<std::size_t>(std::clamp(i + k, 0, count - 1))];
    return out;
  }

  int samples_;
  std::array<std::vector<double>, 6> places_;
};

}  // namespace drape::test
