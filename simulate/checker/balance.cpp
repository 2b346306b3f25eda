// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <vector>

#include "simulate/checker/sheet.hpp"

namespace drape::simulate::checker {

using Vector3 = Eigen::Matrix<Real, 3, 1>;
using Matrix3 = Eigen::Matrix<Real, 3, 3>;
using VectorX = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using Sparse = Eigen::SparseMatrix<Real>;

namespace {

inline Vector3 vector_of(const Point& p) {
  return {p[0], p[1], p[2]};
}

inline Real size_of(const Point& f) {
  return std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
}

inline Real largest_of(const std::vector<Point>& force) {
  Real most = 0;
  for (const Point& f : force) most = std::max(most, size_of(f));
  return most;
}

/// Force at one support: coordinates are friction times pressing and the two tangential ones, so
/// that the cone is |tangential| <= first.
struct Reaction {
  Matrix3 axes;  ///< force = axes * value
  Vector3 value, change;
  Matrix3 own_spread;  ///< inverse of the barrier's second derivative

  [[nodiscard]] static Real room(const Vector3& v) {
    return v[0] > 0 ? v[0] * v[0] - v[1] * v[1] - v[2] * v[2] : -1;
  }
};

constexpr Real kFrictionless = 1e-9;
constexpr Real kMostFriction = 1e4;     // steeper cones are as good as half spaces
constexpr Real kLeftFraction = 0.98;    // relative to the tolerance: what may be left on a particle
constexpr Real kPinWeight = 1e-4;       // weight of a pin's force squared: keeps it finite
constexpr Real kPressingWeight = 1e-2;  // the same of pressing forces, for those that oppose
constexpr Real kMostPressing = 1e6;     // sum of all pressing forces over the largest force
constexpr Real kFirst = 100;  // relative to the penalty's inverse, forces over their largest
constexpr Real kLast = 1e-13;
constexpr Real kShort = 1e-3;    // fraction of a step that leads nowhere
constexpr int kShortSteps = 10;  // steps of that kind
constexpr Real kShrink = 0.1;    // from one penalty to the next
constexpr Real kCentred = 0.1;   // gain of a step below which the penalty may grow
constexpr Real kToBoundary = 0.95, kShorter = 0.8, kShortest = 1e-9;

/// An interior point method (Nesterov and Nemirovski 1994) for: reactions in their cones and what
/// is left on each particle in a ball, so that they add up to nothing. Logarithmic barriers hold
/// both inside; the sum is driven to zero by a growing penalty, whose Newton steps solve one sparse
/// system over the touched particles each.
class Search {
 public:
  Search(const std::vector<Point>& force, const std::vector<Support>& supports, Real friction,
         Real tolerance)
      : force_(force),
        supports_(supports),
        tolerance_(tolerance),
        unit_(largest_of(force)),
        friction_(std::min(friction, kMostFriction)),
        ball_(kLeftFraction * tolerance / unit_) {
    number_rows();
    for (const Support& support : supports) reactions_.push_back(first_reaction(support));
    left_.assign(touched_.size(), Vector3::Zero());
    left_change_ = left_;
    find_sum();
  }

  /// True if a particle that nothing supports has too much left, so that no search can help.
  [[nodiscard]] bool hopeless() const {
    for (std::size_t i = 0; i < force_.size(); ++i) {
      if (row_[i] < 0 && size_of(force_[i]) > tolerance_) return true;
    }
    return false;
  }

  [[nodiscard]] bool found() const { return best_ <= tolerance_; }
  [[nodiscard]] Real best() const { return best_; }

  int run(int most_steps) {
    int steps = 0;
    for (penalty_inverse_ = kFirst; penalty_inverse_ > kLast; penalty_inverse_ *= kShrink) {
      // To the centre: from off the central path smaller penalties lead nowhere.
      while (!found()) {
        if (steps++ == most_steps) return steps;
        if (!newton_step()) break;
      }
      if (found() || is_proven_hopeless()) return steps;
    }
    // From near the centre on the balance itself is asked for in place of a penalty: a whole step
    // meets it exactly, one that the cones cut short meets a fraction of what is missing.
    penalty_inverse_ = 0;
    for (int short_ones = 0; short_ones < kShortSteps && !found() && steps < most_steps; ++steps) {
      if (!find_step()) break;
      const Real fraction = fraction_to_boundary();
      if (take(fraction < 1 ? kToBoundary * fraction : fraction) < kShort) ++short_ones;
    }
    return steps;
  }

 private:
  void number_rows() {
    row_.assign(force_.size(), -1);
    for (const Support& support : supports_) {
      for (int k = 0; k < 4; ++k) {
        if (support.weight[k] != 0) row_[support.particle[k]] = 0;
      }
    }
    for (std::size_t i = 0; i < row_.size(); ++i) {
      if (row_[i] < 0) continue;
      row_[i] = static_cast<int>(touched_.size());
      touched_.push_back(i);
    }
  }

  [[nodiscard]] Reaction first_reaction(const Support& support) const {
    Reaction r;
    r.change.setZero();
    if (support.pin) {
      r.axes.setIdentity();
      r.value.setZero();
      return r;
    }
    const Vector3 normal = vector_of(support.normal);
    const Vector3 along = normal.unitOrthogonal();
    const bool slippery = friction_ < kFrictionless;
    r.axes.col(0) = normal / (slippery ? Real(1) : friction_);
    r.axes.col(1) = along;
    r.axes.col(2) = normal.cross(along);
    r.value = Vector3::UnitX() * (slippery ? Real(1) : friction_);
    return r;
  }

  /// True if what is left, as a direction y, proves that no reactions help whose pressing forces
  /// add up to less than kMostPressing: y draws on no cone beyond the cost of pressing, and the
  /// forces draw more on y than that cost could pay.
  [[nodiscard]] bool is_proven_hopeless() const {
    Real surplus = 0;
    for (std::size_t i = 0; i < touched_.size(); ++i) {
      const Vector3 y = sum_[i] / penalty_inverse_;
      surplus += y.dot(vector_of(force_[touched_[i]])) / unit_ - ball_ * y.norm();
    }
    if (!(surplus > kPressingWeight * kMostPressing)) return false;
    for (std::size_t s = 0; s < supports_.size(); ++s) {
      Vector3 pull = Vector3::Zero();
      for (int k = 0; k < 4; ++k) {
        if (supports_[s].weight[k] != 0)
          pull += supports_[s].weight[k] * sum_[row_[supports_[s].particle[k]]] / penalty_inverse_;
      }
      Vector3 along = reactions_[s].axes.transpose() * pull;
      if (supports_[s].pin) {
        if (along.norm() > kPinWeight * kMostPressing) return false;
        continue;
      }
      const bool slippery = friction_ < kFrictionless;
      along[0] += kPressingWeight / (slippery ? Real(1) : friction_);
      if (!((slippery ? along[0] : Reaction::room(along)) >= 0)) return false;
    }
    return true;
  }

  /// Sum of force, reactions and the part that may stay, over the largest force.
  void find_sum() {
    std::vector<Point> sum = force_;
    for (std::size_t s = 0; s < supports_.size(); ++s) {
      const Reaction& r = reactions_[s];
      Point f{};
      for (int axis = 0; axis < 3; ++axis) {
        for (int c = 0; c < 3; ++c) f[axis] += unit_ * r.axes(axis, c) * r.value[c];
      }
      for (int k = 0; k < 4; ++k) {
        for (int axis = 0; axis < 3; ++axis)
          sum[supports_[s].particle[k]][axis] += supports_[s].weight[k] * f[axis];
      }
    }
    best_ = std::min(best_, largest_of(sum));
    sum_.resize(touched_.size());
    for (std::size_t i = 0; i < touched_.size(); ++i) {
      Point over = sum[touched_[i]];
      for (Real& f : over) f /= unit_;
      sum_[i] = vector_of(over) + left_[i];
    }
  }

  /// Inverse second derivative of the barrier times its gradient and the pressing cost.
  [[nodiscard]] Vector3 own_step(const Support& support, const Reaction& r, Matrix3& spread) const {
    if (support.pin) {
      spread = Matrix3::Identity() / kPinWeight;
      return -r.value;
    }
    Vector3 cost = Vector3::Zero();
    cost[0] = kPressingWeight / (friction_ < kFrictionless ? Real(1) : friction_);
    if (friction_ < kFrictionless) {
      spread.setZero();
      spread(0, 0) = r.value[0] * r.value[0];
      return Vector3::UnitX() * r.value[0] - spread * cost;
    }
    spread = r.value * r.value.transpose();
    const Real half = Real(0.5) * Reaction::room(r.value);
    spread(0, 0) -= half;
    spread(1, 1) += half;
    spread(2, 2) += half;
    return r.value - spread * cost;
  }

  [[nodiscard]] Matrix3 left_spread(std::size_t i) const {
    const Real square = left_[i].squaredNorm();
    const Real room = ball_ * ball_ - square;
    return Real(0.5) * room *
           (Matrix3::Identity() - 2 / (room + 2 * square) * left_[i] * left_[i].transpose());
  }

  /// The matrix has the same pattern every time: the first one notes the place of each entry.
  void assemble() {
    next_ = 0;
    if (analysed_) matrix_.coeffs().setZero();
    right_.resize(3 * static_cast<Eigen::Index>(touched_.size()));
    for (std::size_t i = 0; i < touched_.size(); ++i) {
      const auto row = 3 * static_cast<Eigen::Index>(i);
      const Real square = left_[i].squaredNorm();
      const Real room = ball_ * ball_ - square;
      add_block(row, row, penalty_inverse_ * Matrix3::Identity() + left_spread(i));
      right_.segment<3>(row) = sum_[i] - room / (room + 2 * square) * left_[i];
    }
    for (std::size_t s = 0; s < supports_.size(); ++s) {
      const Support& support = supports_[s];
      Reaction& r = reactions_[s];
      Matrix3 spread;
      r.change = own_step(support, r, spread);
      const Vector3 force = r.axes * r.change;
      const Matrix3 in_world = r.axes * spread * r.axes.transpose();
      for (int k = 0; k < 4; ++k) {
        if (support.weight[k] == 0) continue;
        const Real wk = support.weight[k];
        const Eigen::Index row = 3 * row_[support.particle[k]];
        right_.segment<3>(row) += wk * force;
        for (int l = 0; l < 4; ++l) {
          if (support.weight[l] == 0) continue;
          add_block(row, 3 * row_[support.particle[l]], wk * support.weight[l] * in_world);
        }
      }
      r.own_spread = spread;
    }
  }

  void add_block(Eigen::Index row, Eigen::Index col, const Matrix3& block) {
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) {
        if (row + a < col + b) continue;
        if (analysed_) {
          matrix_.valuePtr()[place_[next_++]] += block(a, b);
        } else {
          entries_.emplace_back(row + a, col + b, block(a, b));
        }
      }
    }
  }

  void make_matrix() {
    const auto size = static_cast<Eigen::Index>(right_.size());
    matrix_.resize(size, size);
    matrix_.setFromTriplets(entries_.begin(), entries_.end());
    for (const Eigen::Triplet<Real>& entry : entries_) {
      const auto* const first = matrix_.innerIndexPtr() + matrix_.outerIndexPtr()[entry.col()];
      const auto* const last = matrix_.innerIndexPtr() + matrix_.outerIndexPtr()[entry.col() + 1];
      place_.push_back(std::lower_bound(first, last, entry.row()) - matrix_.innerIndexPtr());
    }
    factor_.analyzePattern(matrix_);
    analysed_ = true;
  }

  /// The changes of one Newton step; false where they are not determined.
  bool find_step() {
    assemble();
    if (!analysed_) make_matrix();
    factor_.factorize(matrix_);
    if (factor_.info() != Eigen::Success) return false;
    const VectorX multiplier = factor_.solve(right_);
    if (!multiplier.allFinite()) return false;
    find_changes(multiplier);
    return true;
  }

  void find_changes(const VectorX& multiplier) {
    for (std::size_t s = 0; s < supports_.size(); ++s) {
      Vector3 pull = Vector3::Zero();
      for (int k = 0; k < 4; ++k) {
        if (supports_[s].weight[k] != 0)
          pull +=
              supports_[s].weight[k] * multiplier.segment<3>(3 * row_[supports_[s].particle[k]]);
      }
      reactions_[s].change -= reactions_[s].own_spread * (reactions_[s].axes.transpose() * pull);
    }
    for (std::size_t i = 0; i < touched_.size(); ++i) {
      const Real square = left_[i].squaredNorm();
      const Real room = ball_ * ball_ - square;
      left_change_[i] = -room / (room + 2 * square) * left_[i] -
                        left_spread(i) * multiplier.segment<3>(3 * static_cast<Eigen::Index>(i));
    }
  }

  /// Penalty, barriers and costs after a fraction of the step; infinite outside the cones and
  /// balls.
  [[nodiscard]] Real value_at(Real fraction) const {
    Real total = 0;
    for (std::size_t i = 0; i < touched_.size(); ++i) {
      const Real room = 1 - (left_[i] + fraction * left_change_[i]).squaredNorm() / (ball_ * ball_);
      if (!(room > 0)) return HUGE_VALL;
      total += (sum_[i] + fraction * sum_change_[i]).squaredNorm() / (2 * penalty_inverse_) -
               std::log(room);
    }
    for (std::size_t s = 0; s < supports_.size(); ++s) {
      const Reaction& r = reactions_[s];
      const Vector3 v = r.value + fraction * r.change;
      if (supports_[s].pin) {
        total += Real(0.5) * kPinWeight * v.squaredNorm();
        continue;
      }
      const bool slippery = friction_ < kFrictionless;
      const Real room = slippery ? v[0] : Reaction::room(v);
      if (!(room > 0)) return HUGE_VALL;
      total += kPressingWeight / (slippery ? Real(1) : friction_) * v[0] - std::log(room);
    }
    return total;
  }

  /// Moves everything by a Newton step as far as that lowers the value; false at the centre of this
  /// penalty.
  bool newton_step() {
    if (!find_step()) return false;
    find_sum_change();
    const Real here = value_at(0);
    Real fraction = fraction_to_boundary();
    if (fraction < 1) fraction *= kToBoundary;
    Real there = value_at(fraction);
    while (!(there < here) && fraction > kShortest) {
      fraction /= 2;
      there = value_at(fraction);
    }
    if (!(there < here)) return false;
    take(fraction);
    return here - there > kCentred;
  }

  void find_sum_change() {
    sum_change_ = left_change_;
    for (std::size_t s = 0; s < supports_.size(); ++s) {
      const Vector3 force = reactions_[s].axes * reactions_[s].change;
      for (int k = 0; k < 4; ++k) {
        if (supports_[s].weight[k] != 0)
          sum_change_[row_[supports_[s].particle[k]]] += supports_[s].weight[k] * force;
      }
    }
  }

  /// The fraction of the step, up to 1, at which all are in their cones and balls.
  [[nodiscard]] Real fraction_to_boundary() const {
    Real fraction = 1;
    while (!is_inside(fraction) && fraction > kShortest) fraction *= kShorter;
    return fraction;
  }

  [[nodiscard]] bool is_inside(Real fraction) const {
    for (std::size_t i = 0; i < touched_.size(); ++i) {
      if (!((left_[i] + fraction * left_change_[i]).squaredNorm() < ball_ * ball_)) return false;
    }
    for (std::size_t s = 0; s < supports_.size(); ++s) {
      if (supports_[s].pin) continue;
      const Vector3 v = reactions_[s].value + fraction * reactions_[s].change;
      if (!((friction_ < kFrictionless ? v[0] : Reaction::room(v)) > 0)) return false;
    }
    return true;
  }

  Real take(Real fraction) {
    for (Reaction& r : reactions_) r.value += fraction * r.change;
    for (std::size_t i = 0; i < touched_.size(); ++i) left_[i] += fraction * left_change_[i];
    find_sum();
    return fraction;
  }

  const std::vector<Point>& force_;
  const std::vector<Support>& supports_;
  Real tolerance_, unit_, best_ = HUGE_VALL, friction_, ball_, penalty_inverse_ = kFirst;
  std::vector<int> row_;              ///< row of a particle, -1 where nothing touches it
  std::vector<std::size_t> touched_;  ///< the particle of a row
  std::vector<Reaction> reactions_;
  std::vector<Vector3> left_, left_change_, sum_, sum_change_;
  std::vector<Eigen::Triplet<Real>> entries_;
  std::vector<Eigen::Index> place_;  ///< place of each entry among the values of matrix_
  std::size_t next_ = 0;
  Sparse matrix_;
  VectorX right_;
  Eigen::SimplicialLLT<Sparse> factor_;
  bool analysed_ = false;
};

}  // namespace

Balance balance(const std::vector<Point>& force, const std::vector<Support>& supports,
                Real friction, Real tolerance, int most_rounds) {
  Balance result;
  result.largest = largest_of(force);
  if (result.largest <= tolerance || supports.empty()) return result;
  Search search(force, supports, friction, tolerance);
  if (!search.hopeless()) result.rounds = search.run(most_rounds);
  result.largest = std::min(result.largest, search.best());
  return result;
}

}  // namespace drape::simulate::checker
