// SPDX-License-Identifier: Apache-2.0
#include "simulate/equilibrium/prolong.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "simulate/equilibrium/mixture.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

}  // namespace

int lift_out(const Surroundings& surroundings, Field& position) {
  const int n = static_cast<int>(position.size() / 3);
  int lifted = 0;
  for (int i = 0; i < n; ++i) {
    bool inside = false;
    for (int shape = 0; shape < surroundings.count(); ++shape) {
      const Vector3d p = at(position, i);
      const double gap = surroundings.gap_m(shape, p);
      if (gap >= 0) continue;
      inside = true;
      const Vector3d out = p - gap * surroundings.normal(shape, p);
      for (int axis = 0; axis < 3; ++axis) {
        position[static_cast<std::size_t>(axis) * n + i] = out[axis];
      }
    }
    lifted += inside ? 1 : 0;
  }
  return lifted;
}

Field prolong(const Field& coarse, const GridSpec& from, const GridSpec& to) {
  const std::size_t m = from.count();
  const std::size_t n = to.count();
  struct Weights {
    int first = 0;
    double weight[4] = {};
  };
  const auto along = [](int count_from, int count_to, int k) {
    const double u = static_cast<double>(k) * (count_from - 1) / (count_to - 1);
    Weights w;
    const int points = std::min(4, count_from);
    w.first = std::clamp(static_cast<int>(std::floor(u)) - 1, 0, count_from - points);
    for (int a = 0; a < points; ++a) {
      w.weight[a] = 1;
      for (int b = 0; b < points; ++b) {
        if (b != a) w.weight[a] *= (u - w.first - b) / (a - b);
      }
    }
    return w;
  };
  Field fine(3 * n, 0.0);
  for (int r = 0; r < to.rows; ++r) {
    const Weights wr = along(from.rows, to.rows, r);
    for (int c = 0; c < to.cols; ++c) {
      const Weights wc = along(from.cols, to.cols, c);
      for (int axis = 0; axis < 3; ++axis) {
        double sum = 0;
        for (int a = 0; a < 4; ++a) {
          for (int b = 0; b < 4; ++b) {
            const double weight = wr.weight[a] * wc.weight[b];
            if (weight == 0) continue;
            sum += weight * coarse[axis * m + from.index(wr.first + a, wc.first + b)];
          }
        }
        fine[axis * n + to.index(r, c)] = sum;
      }
    }
  }
  return fine;
}

}  // namespace drape::simulate
