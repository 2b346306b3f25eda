// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <utility>
#include <vector>

#include "simulate/cloth/wide.hpp"
#include "simulate/mesh/four.hpp"
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

/// Factor of the sides' scalar matrix, for right-hand sides of three columns.
class MeshStiffness::SidesFactor {
 public:
  explicit SidesFactor(const Eigen::SparseMatrix<double>& matrix) {
    const Eigen::IncompleteCholesky<double, Eigen::Lower, Eigen::NaturalOrdering<int>> factor(
        matrix);
    lower_ = factor.scalingS().cwiseInverse().asDiagonal() * factor.matrixL();
    work_ = Fours(static_cast<std::size_t>(matrix.rows()));
  }
  void solve(std::vector<Eigen::Vector3d>& b) const {
    for (std::size_t i = 0; i < b.size(); ++i) work_.set(i, b[i]);
    sweep(lower_.outerIndexPtr(), lower_.innerIndexPtr(), lower_.valuePtr(),
          static_cast<int>(b.size()), work_.data());
    for (std::size_t i = 0; i < b.size(); ++i) b[i] = work_.at(i);
  }

 private:
  /// Down the columns and up again.
  DRAPE_WIDE static void sweep(const int* begin, const int* row, const double* value, int count,
                               Four* work);

  Eigen::SparseMatrix<double> lower_;
  mutable Fours work_;
};

}  // namespace drape::simulate
