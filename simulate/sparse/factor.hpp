// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "simulate/sparse/matrix.hpp"

namespace drape::simulate {

/// Cholesky factor of a GridMatrix by the multifrontal method (Duff and Reid 1983) on the grid's
/// nested dissection (George 1973) with separators two lines wide, what the second neighbours ask
/// for. The order and the structure are found once; every sum has a fixed order, so the result
/// does not depend on the number of threads. Real = double or float; in single precision a factor
/// takes half the memory and time and serves as a preconditioner: it is off by about 1e-7 times
/// the condition number, and so is what it calls positive definite. Couplings of far particles come
/// and go with the matrices; where one is new, order and structure are found again.
template <class Real>
class GridFactor {
 public:
  /// True if the factor is kept for solve(), or only asked for definiteness, in a quarter of the
  /// memory.
  enum class Keep { factor, nothing };

  GridFactor(const GridSpec& grid, int threads, Keep keep = Keep::factor);
  ~GridFactor();
  GridFactor(GridFactor&&) noexcept;
  GridFactor& operator=(GridFactor&&) noexcept;

  /// False when the matrix plus diag(shift) (one value per particle) is not positive definite.
  [[nodiscard]] bool factorise(const GridMatrix& matrix, const std::vector<double>& shift);
  /// Solves in place with the last factor, which must have been kept.
  void solve(Eigen::VectorXd& b) const;
  [[nodiscard]] std::size_t stored_values() const;

 private:
  using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
  struct Stack;
  struct Node;
  struct Workspace;
  void build();
  [[nodiscard]] bool fits(const GridMatrix& matrix) const;
  void find_structure();
  void place_factor(Keep keep);
  void plan_memory(int node, int level, int workers, int workspace);
  void factor_subtree(int node, int depth, int workspace);
  void factor_node(int node, int workspace);
  void solve_down(int node, int depth, const Eigen::VectorXd& b) const;
  void solve_up(int node, int parent, int depth, Eigen::VectorXd& b) const;
  [[nodiscard]] int depth_of_threads() const;
  static void join_runs(Node& child, const std::vector<int>& place);
  void list_entries(const GridMatrix& pattern, Node& node);
  void list_couplings();
  [[nodiscard]] int place_in(const Node& node, int particle) const;
  template <class Use>
  static void for_each_column(const Node& child, const Use& use);
  static void add_to_own(const Node& child, Node& node);
  static void add_to_border(const Node& child, Node& node);
  void assemble(Node& node);

  GridSpec grid_;
  int threads_ = 1;
  Keep keep_;
  std::vector<GridMatrix::Coupling> couplings_;  ///< that the structure has a place for
  std::vector<Node> nodes_;                      ///< children before their parent
  std::unique_ptr<Real[]> values_;               ///< values of the factor, node after node
  std::vector<Workspace> workspaces_;            ///< one per thread
  std::vector<int> rank_;                 ///< place in the order of elimination, per particle
  std::vector<std::size_t> coupling_at_;  ///< places of the matrix, by place among couplings_
  const GridMatrix* matrix_ = nullptr;
  const std::vector<double>* shift_ = nullptr;
  mutable std::vector<Vector> work_;
};

}  // namespace drape::simulate
