// SPDX-License-Identifier: Apache-2.0
#include "detect/dots/dot_steps.hpp"

namespace drape::detect {
namespace {

constexpr double clear_lead = 0.55;  // best miss over second best
constexpr double rival_error = most_step_error / clear_lead;

}  // namespace

bool BestStep::is_clear() const {
  return error <= most_step_error && error <= clear_lead * second;
}

DotSteps::DotSteps(const std::vector<UnlabelledDot>& dots, double dot_radius_m) : dots_(dots) {
  for (const UnlabelledDot& dot : dots) {
    roots_.emplace_back(symmetric_root(dot.shape_px2) / dot_radius_m);
    sizes_.push_back(roots_.back().norm());
  }
}

BestStep DotSteps::best(const LocalMap& from, const Eigen::Vector2d& step_m,
                        const std::vector<char>& taken) const {
  BestStep best;
  const double step = step_m.norm(), size = from.px_per_m.norm();
  for (std::size_t k = 0; k < dots_.size(); ++k) {
    if (taken[k] != 0) continue;
    // A dot so far away that it can be neither the best nor a rival needs no closer look: the miss
    // is at least the distance less both halves of the step.
    const double far = (dots_[k].centre_px - from.centre_px).norm();
    const double least_miss = far - 0.5 * step * (size + sizes_[k]);
    const double unit2 = 0.5 * step * step * (size * size + sizes_[k] * sizes_[k]) + 4;
    if (least_miss > 0 && least_miss * least_miss > rival_error * rival_error * unit2) continue;
    const LocalMap to = map_at(k, from);
    const double error = step_error(from, to, step_m);
    if (error < best.error) {
      best.second = best.error;
      best.error = error;
      best.dot = k;
      best.to = to;
    } else if (error < best.second) {
      best.second = error;
    }
  }
  return best;
}

}  // namespace drape::detect
