// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "simulate/certify_sheet.hpp"

namespace drape::certify_detail {
namespace {

constexpr Real kRelaxation = 1.6L;  // projected sweeps converge for any value in 0 .. 2
constexpr int kSweeps = 60;
constexpr double kSlack = 0.05;     // weight of what may be left on a particle beside the reactions
constexpr double kSlackUsed = 0.7;  // of the tolerance: the search ends inside it
constexpr int kLook = 10;           // rounds between two looks at the largest residual

/// The nearest force in the cone |along| <= friction * out.
Point project(const Support& support, const Point& value, Real friction) {
  if (support.pin) return value;
  Real out = 0;
  for (int axis = 0; axis < 3; ++axis) out += value[axis] * support.normal[axis];
  Point along{};
  Real size = 0;
  for (int axis = 0; axis < 3; ++axis) {
    along[axis] = value[axis] - out * support.normal[axis];
    size += along[axis] * along[axis];
  }
  size = std::sqrt(size);
  if (size <= friction * out) return value;
  // The nearest point of the cone's surface, or its tip.
  const Real pressed = std::max<Real>(0, (out + friction * size) / (1 + friction * friction));
  Point result{};
  for (int axis = 0; axis < 3; ++axis) {
    result[axis] =
        pressed * support.normal[axis] + (size > 0 ? friction * pressed * along[axis] / size : 0);
  }
  return result;
}

Real largest_of(const std::vector<Point>& force) {
  Real most = 0;
  for (const Point& f : force) most = std::max(most, f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
  return std::sqrt(most);
}

class Search {
 public:
  Search(const std::vector<Point>& force, const std::vector<Support>& supports, Real friction,
         Real tolerance)
      : force_(force), supports_(supports), friction_(friction), tolerance_(tolerance) {
    reaction_.assign(supports.size(), Point{});
    left_ = force;
    best_ = largest_of(left_);
  }

  [[nodiscard]] bool found() const { return best_ <= tolerance_; }
  [[nodiscard]] Real best() const { return best_; }

  void sweep() {
    for (std::size_t s = 0; s < supports_.size(); ++s) {
      const Support& support = supports_[s];
      Real own = 0;
      Point net{};
      for (int k = 0; k < 4; ++k) {
        own += support.weight[k] * support.weight[k];
        for (int axis = 0; axis < 3; ++axis)
          net[axis] += support.weight[k] * left_[support.particle[k]][axis];
      }
      Point wanted = reaction_[s];
      for (int axis = 0; axis < 3; ++axis) wanted[axis] -= kRelaxation * net[axis] / own;
      wanted = project(support, wanted, friction_);
      for (int k = 0; k < 4; ++k) {
        for (int axis = 0; axis < 3; ++axis)
          left_[support.particle[k]][axis] +=
              support.weight[k] * (wanted[axis] - reaction_[s][axis]);
      }
      reaction_[s] = wanted;
    }
    best_ = std::min(best_, largest_of(left_));
  }

  /// Whether a particle that nothing supports has too much left, so that no search can help.
  [[nodiscard]] bool hopeless() const {
    std::vector<bool> held(force_.size(), false);
    for (const Support& support : supports_) {
      for (int k = 0; k < 4; ++k) {
        if (support.weight[k] != 0) held[support.particle[k]] = true;
      }
    }
    for (std::size_t i = 0; i < force_.size(); ++i) {
      if (!held[i] && largest_of({force_[i]}) > tolerance_) return true;
    }
    return false;
  }

  void factorise() {
    row_.assign(force_.size(), -1);
    int rows = 0;
    for (const Support& support : supports_) {
      for (int k = 0; k < 4; ++k) {
        int& row = row_[support.particle[k]];
        if (support.weight[k] != 0 && row < 0) row = rows++;
      }
    }
    Eigen::MatrixXd gram = kSlack * kSlack * Eigen::MatrixXd::Identity(rows, rows);
    for (const Support& support : supports_) {
      for (int k = 0; k < 4; ++k) {
        for (int l = 0; l < 4; ++l) {
          if (support.weight[k] == 0 || support.weight[l] == 0) continue;
          gram(row_[support.particle[k]], row_[support.particle[l]]) +=
              static_cast<double>(support.weight[k] * support.weight[l]);
        }
      }
    }
    factor_.compute(gram);
    slack_.assign(force_.size(), Point{});
    forward_ = reaction_;
    forward_slack_ = slack_;
    missing_.resize(rows, 3);
  }

  /// One round of x = nearest in the cones to z, y = nearest balance to 2 x - z, z += y - x, with z
  /// in forward_.
  void split() {
    for (std::size_t s = 0; s < supports_.size(); ++s)
      reaction_[s] = project(supports_[s], forward_[s], friction_);
    const Real most = kSlackUsed * tolerance_ / Real(kSlack);
    for (std::size_t i = 0; i < force_.size(); ++i) {
      const Real size = largest_of({forward_slack_[i]});
      for (int axis = 0; axis < 3; ++axis)
        slack_[i][axis] = forward_slack_[i][axis] * (size > most ? most / size : Real(1));
    }
    for (std::size_t i = 0; i < force_.size(); ++i) {
      if (row_[i] < 0) continue;
      for (int axis = 0; axis < 3; ++axis)
        missing_(row_[i], axis) = static_cast<double>(
            force_[i][axis] - Real(kSlack) * (2 * slack_[i][axis] - forward_slack_[i][axis]));
    }
    for (std::size_t s = 0; s < supports_.size(); ++s) {
      for (int k = 0; k < 4; ++k) {
        if (supports_[s].weight[k] == 0) continue;
        for (int axis = 0; axis < 3; ++axis)
          missing_(row_[supports_[s].particle[k]], axis) += static_cast<double>(
              supports_[s].weight[k] * (2 * reaction_[s][axis] - forward_[s][axis]));
      }
    }
    missing_ = factor_.solve(missing_);
    for (std::size_t s = 0; s < supports_.size(); ++s) {
      for (int axis = 0; axis < 3; ++axis) {
        Real change = reaction_[s][axis] - forward_[s][axis];
        for (int k = 0; k < 4; ++k) {
          if (supports_[s].weight[k] != 0)
            change -= supports_[s].weight[k] * Real(missing_(row_[supports_[s].particle[k]], axis));
        }
        forward_[s][axis] += change;
      }
    }
    for (std::size_t i = 0; i < force_.size(); ++i) {
      if (row_[i] < 0) continue;
      for (int axis = 0; axis < 3; ++axis)
        forward_slack_[i][axis] += slack_[i][axis] - forward_slack_[i][axis] +
                                   Real(kSlack) * Real(missing_(row_[i], axis));
    }
  }

  /// What the reactions found so far leave, in long double.
  void look() {
    left_ = force_;
    for (std::size_t s = 0; s < supports_.size(); ++s) {
      for (int k = 0; k < 4; ++k) {
        for (int axis = 0; axis < 3; ++axis)
          left_[supports_[s].particle[k]][axis] += supports_[s].weight[k] * reaction_[s][axis];
      }
    }
    best_ = std::min(best_, largest_of(left_));
  }

 private:
  const std::vector<Point>& force_;
  const std::vector<Support>& supports_;
  Real friction_, tolerance_, best_ = 0;
  std::vector<Point> reaction_, left_, slack_, forward_, forward_slack_;
  std::vector<int> row_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::MatrixX3d missing_;
};

}  // namespace

Balance balance(const std::vector<Point>& force, const std::vector<Support>& supports,
                Real friction, Real tolerance, int most_rounds) {
  Search search(force, supports, friction, tolerance);
  Balance result;
  while (!search.found() && result.rounds < std::min(kSweeps, most_rounds) && !supports.empty()) {
    search.sweep();
    ++result.rounds;
  }
  if (!search.found() && !supports.empty() && !search.hopeless()) {
    search.factorise();
    while (!search.found() && result.rounds < most_rounds) {
      for (int k = 0; k < kLook; ++k) search.split();
      result.rounds += kLook;
      search.look();
    }
  }
  result.largest = search.best();
  return result;
}

}  // namespace drape::certify_detail
