// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "simulate/sparse/dense.hpp"
#include "simulate/sparse/dissection.hpp"
#include "simulate/sparse/factor.hpp"

/// Parts of a GridFactor; for factor.cpp alone.
namespace drape::simulate {

namespace factor_parts {

/// Border particles of a region that follow each other in its parent's own + border as well.
struct Run {
  int from = 0, to = 0, count = 0;
};

/// A block of the matrix and where in its region it belongs.
struct Entry {
  int particle = 0, slot = 0, row = 0, col = 0;
  bool transposed = false;
};

/// The same of a coupling, by its place among those of the structure.
struct FarEntry {
  int coupling = 0, row = 0, col = 0;
  bool transposed = false;
};

}  // namespace factor_parts

/// Memory for update matrices that come and go in turn, the last first. How much it takes is
/// counted before it is there.
template <class Real>
struct GridFactor<Real>::Stack {
  std::unique_ptr<Real[]> values;
  std::size_t used = 0, most = 0;

  void count(std::size_t size) {
    used += size;
    most = std::max(most, used);
  }
  void make() { values = std::make_unique_for_overwrite<Real[]>(most); }
  Real* push(std::size_t size) {
    Real* begin = values.get() + used;
    used += size;
    return begin;
  }
  void pop(std::size_t size) { used -= size; }
};

/// One region of the dissection: its own particles are eliminated here, its border later.
template <class Real>
struct GridFactor<Real>::Node : Region {
  std::vector<factor_parts::Run> runs;
  std::vector<factor_parts::Entry> entries;
  std::vector<factor_parts::FarEntry> far;
  Eigen::Index rows = 0;   ///< values of own and border
  Eigen::Index cols = 0;   ///< values of own
  Real* lower = nullptr;   ///< the factor, a trapezoid of rows x cols
  Real* update = nullptr;  ///< part that the border's matrix loses; lower triangle, on `stack`
  Stack* stack = nullptr;
  int workspace = 0;  ///< number of the thread that works here

  [[nodiscard]] std::size_t lower_size() const {
    return static_cast<std::size_t>(trapezoid_size<Real>(rows, cols));
  }
  [[nodiscard]] std::size_t update_size() const {
    return static_cast<std::size_t>(trapezoid_size<Real>(rows - cols, rows - cols));
  }
  bool definite = true;
};

/// Calls `use` with each column a child's update becomes in its parent, own and border counted
/// together, and with what adds it to that column.
template <class Real>
template <class Use>
void GridFactor<Real>::for_each_column(const Node& child, const Use& use) {
  const auto border = static_cast<Eigen::Index>(3 * child.border.size());
  const auto run = dense_kernels<Real>(Instructions::avx512).add;
  for (const factor_parts::Run& cols : child.runs) {
    for (Eigen::Index c = 0; c < 3 * cols.count; ++c) {
      const Eigen::Index from_col = 3 * cols.from + c;
      const Real* from = child.update + trapezoid_column<Real>(border, from_col);
      use(3 * cols.to + c, [&](Real* to) {
        for (const factor_parts::Run& rows : child.runs) {
          const Eigen::Index begin = std::max<Eigen::Index>(3 * rows.from, from_col - c % 3);
          const Eigen::Index end = 3 * (rows.from + rows.count);
          const Eigen::Index shift = 3 * (rows.to - rows.from);
          run(to + begin + shift, from + begin, end - begin);
        }
      });
    }
  }
}

/// Memory that one thread needs. The updates of a node's children are taken from one stack after
/// its own has been put on the other: so both work in turn, level by level.
template <class Real>
struct GridFactor<Real>::Workspace {
  DenseScratch<Real> dense;
  std::array<Stack, 2> stacks;
};

}  // namespace drape::simulate
