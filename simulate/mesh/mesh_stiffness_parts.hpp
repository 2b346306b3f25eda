// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <utility>
#include <vector>

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
    Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> factor(matrix);
    lower_ = factor.matrixL();
    place_.resize(static_cast<std::size_t>(matrix.rows()));
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) place_[i] = factor.permutationP().indices()[i];
    work_.resize(place_.size());
  }
  void solve(std::vector<Eigen::Vector3d>& b) const {
    for (std::size_t i = 0; i < b.size(); ++i) work_[place_[i]] << b[i], 0;
    const int* begin = lower_.outerIndexPtr();
    const int* row = lower_.innerIndexPtr();
    const double* value = lower_.valuePtr();
    const auto count = static_cast<int>(b.size());
    for (int j = 0; j < count; ++j) {
      const Eigen::Vector4d x = work_[j] /= value[begin[j]];
      for (int k = begin[j] + 1; k < begin[j + 1]; ++k) work_[row[k]] -= value[k] * x;
    }
    for (int j = count; j-- > 0;) {
      Eigen::Vector4d x = work_[j];
      for (int k = begin[j] + 1; k < begin[j + 1]; ++k) x -= value[k] * work_[row[k]];
      work_[j] = x / value[begin[j]];
    }
    for (std::size_t i = 0; i < b.size(); ++i) b[i] = work_[place_[i]].head<3>();
  }

 private:
  Eigen::SparseMatrix<double> lower_;
  std::vector<int> place_;
  mutable std::vector<Eigen::Vector4d> work_;  ///< three columns and nothing: whole vectors
};

}  // namespace drape::simulate
