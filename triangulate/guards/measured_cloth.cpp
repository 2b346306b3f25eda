// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/measured_cloth.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace drape::triangulate {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::size_t kNear = 60;    ///< number of marks for interpolation
constexpr std::size_t kLearnt = 16;  ///< number of marks for estimating the prediction error
constexpr std::size_t kLeastNear = 9;
constexpr Index kTrend = 3;  ///< a constant and two slopes

}  // namespace

std::optional<ShownPlace> MeasuredCloth::at(const Vector2d& material_m) const {
  const std::pair key(material_m.x(), material_m.y());
  const auto known = known_.find(key);
  return known != known_.end() ? known->second : known_[key] = computed(material_m);
}

std::optional<ShownPlace> MeasuredCloth::computed(const Vector2d& material_m) const {
  std::vector<const SheetMark*> marks;
  for (const SheetMark& mark : sheet_.marks) marks.push_back(&mark);
  if (marks.size() < kLeastNear) return std::nullopt;
  const auto away_m = [&](const SheetMark* mark) { return (mark->material_m - material_m).norm(); };
  std::stable_sort(marks.begin(), marks.end(), [&](const SheetMark* one, const SheetMark* other) {
    return away_m(one) < away_m(other);
  });
  marks.resize(std::min(marks.size(), kNear));
  const auto count = static_cast<Index>(marks.size());
  const double unit_m = away_m(marks.back());  // for good scaling of the system
  const auto row_of = [&](const Vector2d& at_m) {
    VectorXd row(count + kTrend);
    for (Index i = 0; i < count; ++i)
      row[i] = std::pow((marks[static_cast<std::size_t>(i)]->material_m - at_m).norm() / unit_m, 3);
    row.tail(kTrend) << 1, (at_m - material_m) / unit_m;
    return row;
  };
  MatrixXd system = MatrixXd::Zero(count + kTrend, count + kTrend);
  MatrixXd places_m = MatrixXd::Zero(count + kTrend, 3);
  for (Index i = 0; i < count; ++i) {
    const SheetMark& mark = *marks[static_cast<std::size_t>(i)];
    system.row(i) = row_of(mark.material_m).transpose();
    system.block(count, i, kTrend, 1) = system.block(i, count, 1, kTrend).transpose();
    places_m.row(i) = mark.point_in_world.transpose();
  }
  const MatrixXd inverse = system.partialPivLu().inverse();
  constexpr double kRounding = 1e-6;
  if (!((system.row(0) * inverse.col(0) - MatrixXd::Ones(1, 1)).norm() < kRounding) ||
      !((inverse * system.col(count)).segment(count, 1) - MatrixXd::Ones(1, 1)).isZero(kRounding))
    return std::nullopt;  // collinear marks
  // With mark i left out, the surface misses it by (inverse * places)_i / inverse_ii, with variance
  // 1 / inverse_ii (Dubrule 1983).
  Matrix3d coefficient_m2 = Matrix3d::Zero();
  const MatrixXd misses = inverse * places_m;
  const Index learnt = std::min<Index>(count, kLearnt);
  for (Index i = 0; i < learnt; ++i)
    coefficient_m2 += misses.row(i).transpose() * misses.row(i) / inverse(i, i);
  coefficient_m2 /= static_cast<double>(learnt);

  const VectorXd row = row_of(material_m), weights = inverse * row;
  const double variance = std::max(0.0, -weights.dot(row));
  ShownPlace shown{places_m.transpose() * weights, variance * coefficient_m2};
  for (Index i = 0; i < count; ++i)
    if (const auto& own = marks[static_cast<std::size_t>(i)]->covariance_m2)
      shown.covariance_m2 += weights[i] * weights[i] * *own;
  return shown;
}

}  // namespace drape::triangulate
