// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/LU>
#include <Eigen/SparseCore>
#include <algorithm>
#include <utility>
#include <vector>

#include "simulate/cloth/wide.hpp"
#include "simulate/mesh/four.hpp"
#include "simulate/mesh/membrane.hpp"
#include "simulate/mesh/mesh_stiffness.hpp"

/// What a MeshStiffness is made of; for mesh_stiffness.cpp alone.
namespace drape::simulate {

/// Points with weights, each point once.
class MeshStiffness::Weights {
 public:
  void add(int point, double weight) {
    const auto at =
        std::find_if(of_.begin(), of_.end(), [&](const auto& w) { return w.first == point; });
    if (at == of_.end())
      of_.emplace_back(point, weight);
    else
      at->second += weight;
  }
  void add(const Weights& other, double factor) {
    for (const auto& [point, weight] : other.of_) add(point, factor * weight);
  }
  [[nodiscard]] double of(int point) const {
    for (const auto& [p, weight] : of_)
      if (p == point) return weight;
    return 0;
  }
  [[nodiscard]] std::vector<std::pair<int, double>>::const_iterator begin() const {
    return of_.begin();
  }
  [[nodiscard]] std::vector<std::pair<int, double>>::const_iterator end() const {
    return of_.end();
  }

 private:
  std::vector<std::pair<int, double>> of_;
};

/// Gradients of a strain in the points around, as c c^T.
struct MeshStiffness::Gradient {
  std::vector<Eigen::Vector3d> stretch[2], shear;

  void reset(std::size_t count) {
    for (auto* of : {&stretch[0], &stretch[1], &shear}) of->assign(count, Eigen::Vector3d::Zero());
  }
  /// Adds `part` of a triangle's metric, whose derivatives are u and v, at the point with d_u,
  /// d_v.
  void add(std::size_t at, const MetricStrain& strain, double part, double d_u, double d_v,
           const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    const double a = strain.a, b = strain.b, s = strain.sine;
    const Eigen::Vector3d of_a = part * d_u / a * u, of_b = part * d_v / b * v;
    stretch[0][at] += of_a;
    stretch[1][at] += of_b;
    shear[at] += (part / (a * b) * (d_u * v + d_v * u) - s * (of_a / a + of_b / b)) /
                 std::max(strain.cosine(), 1e-3);
  }
};

/// Tangents along warp and weft and of shear, times an area.
[[nodiscard]] inline Eigen::Vector3d tangents(const MetricStrain& strain, const ClothLaws& laws,
                                              double area) {
  return area * Eigen::Vector3d(laws.tensile[0].tangent(strain.a - 1),
                                laws.tensile[1].tangent(strain.b - 1),
                                std::max(0.0, laws.shear.tangent(std::abs(strain.angle()))));
}

/// The sides' scalar matrix D + L + L^T and what presses on sides, which goes to D: solved with as
/// (D + L) D^-1 (D + L^T), for right-hand sides of three columns.
class MeshStiffness::SidesMatrix {
 public:
  explicit SidesMatrix(const Eigen::SparseMatrix<double>& matrix)
      : below_(matrix.triangularView<Eigen::StrictlyLower>()),
        diagonal_(matrix.diagonal()),
        inverse_(3 * static_cast<std::size_t>(matrix.rows())),
        work_(static_cast<std::size_t>(matrix.rows())) {}
  /// Begins from the matrix alone, then with what presses (N m).
  void press(const std::vector<std::pair<int, Eigen::Matrix3d>>& on_sides) {
    for (Eigen::Index i = 0; i < diagonal_.size(); ++i)
      set_inverse(static_cast<std::size_t>(i), Eigen::Matrix3d::Identity() / diagonal_[i]);
    std::vector<Eigen::Matrix3d> sum(static_cast<std::size_t>(diagonal_.size()),
                                     Eigen::Matrix3d::Zero());
    for (const auto& [side, stiffness] : on_sides) sum[side] += stiffness;
    for (const auto& [side, stiffness] : on_sides)
      set_inverse(static_cast<std::size_t>(side),
                  (diagonal_[side] * Eigen::Matrix3d::Identity() + sum[side]).inverse());
  }
  void solve(std::vector<Eigen::Vector3d>& b) const {
    for (std::size_t i = 0; i < b.size(); ++i) work_.set(i, b[i]);
    sweep(below_.outerIndexPtr(), below_.innerIndexPtr(), below_.valuePtr(), inverse_.data(),
          static_cast<int>(b.size()), work_.data());
    for (std::size_t i = 0; i < b.size(); ++i) b[i] = work_.at(i);
  }

 private:
  /// Down the columns and up again; `inverse` has three columns of each side.
  DRAPE_WIDE static void sweep(const int* begin, const int* row, const double* value,
                               const Four* inverse, int count, Four* work);
  void set_inverse(std::size_t side, const Eigen::Matrix3d& of) {
    for (int c = 0; c < 3; ++c) inverse_.set(3 * side + c, of.col(c));
  }

  Eigen::SparseMatrix<double> below_;
  Eigen::VectorXd diagonal_;
  mutable Fours inverse_, work_;
};

}  // namespace drape::simulate
