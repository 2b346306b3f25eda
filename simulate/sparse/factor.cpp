// SPDX-License-Identifier: Apache-2.0
#include "simulate/sparse/factor.hpp"

#include <algorithm>
#include <cstdlib>
#include <thread>

#include "simulate/sparse/factor_parts.hpp"

namespace drape::simulate {

using factor_parts::Entry;
using factor_parts::FarEntry;
using factor_parts::Run;

namespace {

constexpr int kMostDepth = 6;  // depth of the tree of threads: 64 of them
// Values of a factor from which a solve is worth threads.
constexpr std::size_t kWorthThreads = 1000000;

// Couplings beyond those of a matrix, as parts of these, that its structure may keep a place for.
constexpr double kIdle = 1;

}  // namespace

template <class Real>
GridFactor<Real>::~GridFactor() = default;
template <class Real>
GridFactor<Real>::GridFactor(GridFactor&&) noexcept = default;
template <class Real>
GridFactor<Real>& GridFactor<Real>::operator=(GridFactor&&) noexcept = default;

template <class Real>
GridFactor<Real>::GridFactor(const GridSpec& grid, int threads, Keep keep)
    : grid_(grid), threads_(threads), keep_(keep) {
  build();
}

template <class Real>
void GridFactor<Real>::build() {
  nodes_.clear();
  workspaces_.clear();
  values_.reset();
  find_structure();
  work_.resize(nodes_.size());
  workspaces_.resize(std::size_t{1} << depth_of_threads());
  plan_memory(static_cast<int>(nodes_.size()) - 1, 0, static_cast<int>(workspaces_.size()), 0);
  for (Workspace& work : workspaces_) {
    for (Stack& stack : work.stacks) stack.make();
  }
  place_factor(keep_);
}

/// Where each region's part of the factor goes: one after the other, or all of a thread in turn to
/// one place, since a parent only needs the updates of its children. In one piece, which goes back
/// to the system as a whole.
template <class Real>
void GridFactor<Real>::place_factor(Keep keep) {
  std::size_t largest = 0;
  for (const Node& node : nodes_) largest = std::max(largest, node.lower_size());
  const std::size_t size = keep == Keep::factor ? stored_values() : largest * workspaces_.size();
  values_ = std::make_unique_for_overwrite<Real[]>(size);
  Real* next = values_.get();
  for (Node& node : nodes_) {
    if (keep == Keep::factor) {
      node.lower = next;
      next += node.lower_size();
    } else {
      node.lower = values_.get() + largest * node.workspace;
    }
  }
}

template <class Real>
void GridFactor<Real>::find_structure() {
  GridMatrix pattern(grid_);
  pattern.couple(couplings_);
  std::vector<Region> regions = dissect(pattern);
  rank_ = elimination_order(regions, grid_.count());
  nodes_.resize(regions.size());
  for (std::size_t k = 0; k < regions.size(); ++k) {
    static_cast<Region&>(nodes_[k]) = std::move(regions[k]);
  }
  std::vector<int> place(grid_.count(), -1);
  for (Node& node : nodes_) {
    node.cols = static_cast<Eigen::Index>(3 * node.own.size());
    node.rows = node.cols + static_cast<Eigen::Index>(3 * node.border.size());
    list_entries(pattern, node);
    int k = 0;
    for (const int particle : node.own) place[particle] = k++;
    for (const int particle : node.border) place[particle] = k++;
    for (const int child : node.children) {
      if (child >= 0) join_runs(nodes_[child], place);
    }
  }
  list_couplings();
}

/// Where in its region each coupling belongs: that of the particle eliminated first.
template <class Real>
void GridFactor<Real>::list_couplings() {
  if (couplings_.empty()) return;
  std::vector<int> node_of(rank_.size());
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    for (const int particle : nodes_[k].own) node_of[particle] = static_cast<int>(k);
  }
  for (std::size_t k = 0; k < couplings_.size(); ++k) {
    const auto& [high, low] = couplings_[k];
    const bool transposed = rank_[high] < rank_[low];
    const int first = transposed ? high : low, later = transposed ? low : high;
    Node& node = nodes_[node_of[first]];
    node.far.push_back(
        {static_cast<int>(k), place_in(node, later), place_in(node, first), transposed});
  }
}

/// Place of a particle among a region's own and border.
template <class Real>
int GridFactor<Real>::place_in(const Node& node, int particle) const {
  const int own = static_cast<int>(node.own.size());
  const int rank = rank_[particle], first = rank_[node.own.front()];
  if (rank < first + own) return rank - first;
  const auto at = std::lower_bound(node.border.begin(), node.border.end(), particle,
                                   [&](int a, int b) { return rank_[a] < rank_[b]; });
  return own + static_cast<int>(at - node.border.begin());
}

template <class Real>
void GridFactor<Real>::join_runs(Node& child, const std::vector<int>& place) {
  for (int k = 0; k < static_cast<int>(child.border.size()); ++k) {
    const int to = place[child.border[k]];
    if (!child.runs.empty() && child.runs.back().to + child.runs.back().count == to) {
      ++child.runs.back().count;
    } else {
      child.runs.push_back({k, to, 1});
    }
  }
}

template <class Real>
void GridFactor<Real>::list_entries(const GridMatrix& pattern, Node& node) {
  const int own = static_cast<int>(node.own.size());
  const auto place = [&](int particle) { return place_in(node, particle); };
  for (int k = 0; k < own; ++k) {
    const int p = node.own[k];
    node.entries.push_back({p, 0, k, k, false});
    for (int s = 1; s < GridMatrix::slots; ++s) {
      const int after = p + pattern.step(s);
      if (pattern.has(p, s) && rank_[after] > rank_[p]) {
        node.entries.push_back({p, s, place(after), k, false});
      }
      const int before = p - pattern.step(s);
      if (before < 0 || std::abs(before % grid_.cols - p % grid_.cols) > 2) continue;
      if (pattern.has(before, s) && rank_[before] > rank_[p]) {
        node.entries.push_back({before, s, place(before), k, true});
      }
    }
  }
}

/// Adds what a child's border loses, run after run of each column: the columns eliminated here.
template <class Real>
void GridFactor<Real>::add_to_own(const Node& child, Node& node) {
  for_each_column(child, [&](Eigen::Index to_col, const auto& add) {
    if (to_col < node.cols) add(node.lower + trapezoid_column<Real>(node.rows, to_col));
  });
}

/// The same for the columns of the border.
template <class Real>
void GridFactor<Real>::add_to_border(const Node& child, Node& node) {
  const Eigen::Index own = node.cols;
  const Eigen::Index border = node.rows - own;
  for_each_column(child, [&](Eigen::Index to_col, const auto& add) {
    if (to_col < own) return;
    add(node.update + trapezoid_column<Real>(border, to_col - own) - own);
  });
}

template <class Real>
void GridFactor<Real>::assemble(Node& node) {
  std::fill(node.lower, node.lower + node.lower_size(), Real{0});
  for (const Entry& entry : node.entries) {
    const Eigen::Matrix3d& block = matrix_->block(entry.particle, entry.slot);
    const double shift = entry.row == entry.col ? (*shift_)[entry.particle] : 0.0;
    for (int c = 0; c < 3; ++c) {
      Real* to = node.lower + trapezoid_column<Real>(node.rows, 3 * entry.col + c) + 3 * entry.row;
      for (int r = 0; r < 3; ++r)
        to[r] += static_cast<Real>(entry.transposed ? block(c, r) : block(r, c));
      to[c] += static_cast<Real>(shift);
    }
  }
  for (const FarEntry& entry : node.far) {
    const std::size_t at = coupling_at_[entry.coupling];
    if (at == matrix_->couplings().size()) continue;  // not in this matrix
    const Eigen::Matrix3d& block = matrix_->coupling_block(static_cast<int>(at));
    for (int c = 0; c < 3; ++c) {
      Real* to = node.lower + trapezoid_column<Real>(node.rows, 3 * entry.col + c) + 3 * entry.row;
      for (int r = 0; r < 3; ++r)
        to[r] += static_cast<Real>(entry.transposed ? block(c, r) : block(r, c));
    }
  }
  for (const int child : node.children) {
    if (child >= 0) add_to_own(nodes_[child], node);
  }
}

template <class Real>
void GridFactor<Real>::factor_node(int index, int workspace) {
  Node& node = nodes_[index];
  Workspace& work = workspaces_[workspace];
  for (const int child : node.children) {
    if (child >= 0 && !nodes_[child].definite) {
      node.definite = false;
      return;
    }
  }
  assemble(node);
  const Eigen::Index own = node.cols;
  const Eigen::Index rows = node.rows;
  node.definite = factor_columns(node.lower, rows, own, work.dense);
  if (!node.definite || rows == own) return;
  node.update = node.stack->push(node.update_size());
  if (own == 0) std::fill(node.update, node.update + node.update_size(), Real{0});
  set_minus_outer(node.lower, rows, own, node.update, work.dense);
  for (const int child : node.children) {
    if (child < 0) continue;
    add_to_border(nodes_[child], node);
    nodes_[child].stack->pop(nodes_[child].update_size());
  }
}

template <class Real>
void GridFactor<Real>::factor_subtree(int index, int depth, int workspace) {
  const std::array<int, 2>& children = nodes_[index].children;
  if (children[0] >= 0) {
    if (depth > 0) {
      const int others = workspace + (1 << (depth - 1));
      std::thread other([&] { factor_subtree(children[0], depth - 1, others); });
      factor_subtree(children[1], depth - 1, workspace);
      other.join();
    } else {
      factor_subtree(children[0], 0, workspace);
      if (!nodes_[children[0]].definite) {
        nodes_[index].definite = false;  // nothing more to be found out
        return;
      }
      factor_subtree(children[1], 0, workspace);
    }
  }
  factor_node(index, workspace);
}

/// Gives the nodes below their stacks and counts what those take, in the order of factor_subtree().
template <class Real>
void GridFactor<Real>::plan_memory(int index, int level, int workers, int workspace) {
  Node& node = nodes_[index];
  node.workspace = workspace;
  node.stack = &workspaces_[workspace].stacks[level % 2];
  if (node.children[0] >= 0) {
    plan_memory(node.children[0], level + 1, workers / 2, workspace + workers / 2);
    plan_memory(node.children[1], level + 1, workers / 2, workspace);
  }
  node.stack->count(node.update_size());
  for (const int child : node.children) {
    if (child >= 0) nodes_[child].stack->pop(nodes_[child].update_size());
  }
}

template <class Real>
bool GridFactor<Real>::factorise(const GridMatrix& matrix, const std::vector<double>& shift) {
  if (!fits(matrix)) {
    couplings_ = matrix.couplings();
    build();
  }
  matrix_ = &matrix;
  shift_ = &shift;
  const auto& given = matrix.couplings();
  coupling_at_.resize(couplings_.size());
  for (std::size_t k = 0; k < couplings_.size(); ++k) {
    const auto at = std::lower_bound(given.begin(), given.end(), couplings_[k]);
    const bool there = at != given.end() && *at == couplings_[k];
    coupling_at_[k] = there ? at - given.begin() : given.size();
  }
  for (Workspace& work : workspaces_) {
    for (Stack& stack : work.stacks) stack.used = 0;  // a matrix before may have broken off
  }
  factor_subtree(static_cast<int>(nodes_.size()) - 1, depth_of_threads(), 0);
  return nodes_.back().definite;
}

/// True if all its couplings have a place, and not too many others.
template <class Real>
bool GridFactor<Real>::fits(const GridMatrix& matrix) const {
  const auto& given = matrix.couplings();
  const auto most = (1 + kIdle) * static_cast<double>(given.size());
  return static_cast<double>(couplings_.size()) <= most &&
         std::includes(couplings_.begin(), couplings_.end(), given.begin(), given.end());
}

/// Forward: children first, each subtree by itself.
template <class Real>
void GridFactor<Real>::solve_down(int index, int depth, const Eigen::VectorXd& b) const {
  const Node& node = nodes_[index];
  if (node.children[0] >= 0) {
    if (depth > 0) {
      std::thread other([&] { solve_down(node.children[0], depth - 1, b); });
      solve_down(node.children[1], depth - 1, b);
      other.join();
    } else {
      solve_down(node.children[0], 0, b);
      solve_down(node.children[1], 0, b);
    }
  }
  const Eigen::Index own = node.cols;
  const Eigen::Index rows = node.rows;
  Vector& x = work_[index];
  x.resize(rows);
  for (std::size_t i = 0; i < node.own.size(); ++i) {
    x.template segment<3>(3 * static_cast<Eigen::Index>(i)) =
        b.template segment<3>(3 * node.own[i]).template cast<Real>();
  }
  x.tail(rows - own).setZero();
  for (const int child : node.children) {
    if (child < 0) continue;
    const Vector& from = work_[child];
    const Eigen::Index before = nodes_[child].cols;
    for (const Run& run : nodes_[child].runs) {
      x.segment(3 * run.to, 3 * run.count) += from.segment(before + 3 * run.from, 3 * run.count);
    }
  }
  solve_columns(node.lower, rows, own, x.data());
}

/// Backward: what the parent found is the border of its children.
template <class Real>
void GridFactor<Real>::solve_up(int index, int parent, int depth, Eigen::VectorXd& b) const {
  const Node& node = nodes_[index];
  const Eigen::Index own = node.cols;
  const Eigen::Index rows = node.rows;
  Vector& x = work_[index];
  for (const Run& run : node.runs) {
    x.segment(own + 3 * run.from, 3 * run.count) = work_[parent].segment(3 * run.to, 3 * run.count);
  }
  solve_columns_transposed(node.lower, rows, own, x.data());
  for (std::size_t i = 0; i < node.own.size(); ++i) {
    b.segment<3>(3 * node.own[i]) =
        x.template segment<3>(3 * static_cast<Eigen::Index>(i)).template cast<double>();
  }
  if (node.children[0] < 0) return;
  if (depth > 0) {
    std::thread other([&] { solve_up(node.children[0], index, depth - 1, b); });
    solve_up(node.children[1], index, depth - 1, b);
    other.join();
  } else {
    solve_up(node.children[0], index, 0, b);
    solve_up(node.children[1], index, 0, b);
  }
}

template <class Real>
int GridFactor<Real>::depth_of_threads() const {
  int depth = 0;
  while (depth < kMostDepth && (1 << depth) < threads_) ++depth;
  return depth;
}

template <class Real>
void GridFactor<Real>::solve(Eigen::VectorXd& b) const {
  const int root = static_cast<int>(nodes_.size()) - 1;
  const int depth = stored_values() < kWorthThreads ? 0 : depth_of_threads();
  solve_down(root, depth, b);
  solve_up(root, -1, depth, b);
}

template <class Real>
std::size_t GridFactor<Real>::stored_values() const {
  std::size_t sum = 0;
  for (const Node& node : nodes_) sum += node.lower_size();
  return sum;
}

template class GridFactor<double>;
template class GridFactor<float>;

}  // namespace drape::simulate
