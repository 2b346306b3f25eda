// SPDX-License-Identifier: Apache-2.0
#include "simulate/sparse/dissection.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <tuple>
#include <utility>

namespace drape::simulate {
namespace {

using Sets = std::vector<std::set<int>>;

GridMatrix pattern_of(int rows, int cols) {
  return GridMatrix(GridSpec{rows, cols, {0.2, 0.2}});
}

/// Where column after column of a Cholesky factor has values, as places in the order of
/// elimination, by eliminating one particle at a time.
Sets filled_columns(const GridMatrix& pattern, const std::vector<int>& order) {
  const int n = pattern.grid().count();
  Sets columns(n);
  for (int j = 0; j < n; ++j) {
    for (int s = 1; s < GridMatrix::slots; ++s) {
      if (!pattern.has(j, s)) continue;
      const auto [first, last] = std::minmax(order[j], order[j + pattern.step(s)]);
      columns[first].insert(last);
    }
  }
  for (std::set<int>& column : columns) {
    if (column.empty()) continue;
    std::set<int>& next = columns[*column.begin()];
    next.insert(std::next(column.begin()), column.end());
  }
  return columns;
}

/// Multiplications that eliminating `own` values before `border` values takes.
double products(double own, double border) {
  return own * own * own / 6 + own * own * border / 2 + own * border * border / 2;
}
double products(const Region& region) {
  return products(3.0 * static_cast<double>(region.own.size()),
                  3.0 * static_cast<double>(region.border.size()));
}

/// The same for a rectangle dissected along grid lines only, across its longer side, two lines at a
/// time; a border lies two particles deep wherever the grid goes on.
struct Rectangle {
  int row0, row1, col0, col1;
};
double products_along_grid_lines(const GridSpec& grid, const Rectangle& part) {
  const int rows = part.row1 - part.row0, cols = part.col1 - part.col0;
  const auto deep = [](int room) { return std::min(room, 2); };
  const int above = deep(part.row0), below = deep(grid.rows - part.row1);
  const int left = deep(part.col0), right = deep(grid.cols - part.col1);
  const int corners = (above > 0) * (left > 0) + (above > 0) * (right > 0) +
                      (below > 0) * (left > 0) + (below > 0) * (right > 0);
  const int border = (above + below) * cols + (left + right) * rows + corners;
  if (rows * cols <= 16) return products(3.0 * rows * cols, 3.0 * border);
  Rectangle halves[2] = {part, part};
  if (rows >= cols) {
    halves[0].row1 = part.row0 + (rows - 2) / 2;
    halves[1].row0 = halves[0].row1 + 2;
  } else {
    halves[0].col1 = part.col0 + (cols - 2) / 2;
    halves[1].col0 = halves[0].col1 + 2;
  }
  return products(6.0 * std::min(rows, cols), 3.0 * border) +
         products_along_grid_lines(grid, halves[0]) + products_along_grid_lines(grid, halves[1]);
}

TEST(Dissection, EliminatesEachParticleOnceAndChildrenFirst) {
  for (const auto& [rows, cols] : {std::pair{2, 2}, {3, 3}, {3, 40}, {4, 5}, {17, 23}, {60, 12}}) {
    const std::vector<Region> regions = dissect(pattern_of(rows, cols));
    std::vector<int> times(rows * cols, 0);
    for (std::size_t k = 0; k < regions.size(); ++k) {
      EXPECT_FALSE(regions[k].own.empty());
      for (const int particle : regions[k].own) ++times[particle];
      for (const int child : regions[k].children) EXPECT_LT(child, static_cast<int>(k));
    }
    EXPECT_EQ(times, std::vector<int>(rows * cols, 1)) << rows << "x" << cols;
    EXPECT_TRUE(regions.back().border.empty());
  }
}

TEST(Dissection, BordersAreWhatEliminationFills) {
  for (const auto& [rows, cols] :
       {std::pair{3, 3}, {3, 40}, {5, 5}, {17, 23}, {60, 12}, {41, 41}}) {
    const GridMatrix pattern = pattern_of(rows, cols);
    const std::vector<Region> regions = dissect(pattern);
    const std::vector<int> order = elimination_order(regions, rows * cols);
    const Sets columns = filled_columns(pattern, order);
    for (const Region& region : regions) {
      std::set<int> filled;
      for (const int particle : region.own) {
        filled.insert(columns[order[particle]].begin(), columns[order[particle]].end());
      }
      for (const int particle : region.own) filled.erase(order[particle]);
      std::vector<int> border;
      for (const int particle : region.border) border.push_back(order[particle]);
      EXPECT_EQ(border, std::vector<int>(filled.begin(), filled.end())) << rows << "x" << cols;
    }
  }
}

TEST(Dissection, TakesAThirdFewerProductsThanCutsAlongGridLines) {
  for (const auto& [rows, cols, fraction] :
       {std::tuple{61, 61, 2.0 / 3}, {101, 101, 2.0 / 3}, {201, 201, 2.0 / 3}, {101, 81, 1.0}}) {
    const GridMatrix pattern = pattern_of(rows, cols);
    double sum = 0;
    for (const Region& region : dissect(pattern)) sum += products(region);
    const double straight = products_along_grid_lines(pattern.grid(), {0, rows, 0, cols});
    EXPECT_LT(sum, fraction * straight) << rows << "x" << cols;
  }
}

TEST(Dissection, HalvesHaveAboutTheSameWork) {
  for (const auto& [rows, cols] : {std::pair{61, 61}, {101, 101}, {101, 81}, {120, 31}}) {
    const std::vector<Region> regions = dissect(pattern_of(rows, cols));
    std::vector<double> work(regions.size());
    for (std::size_t k = 0; k < regions.size(); ++k) {
      work[k] = products(regions[k]);
      for (const int child : regions[k].children) work[k] += child < 0 ? 0 : work[child];
    }
    const auto& halves = regions.back().children;
    EXPECT_NEAR(work[halves[0]] / work[halves[1]], 1, 0.1) << rows << "x" << cols;
  }
}

}  // namespace
}  // namespace drape::simulate
