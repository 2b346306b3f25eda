// SPDX-License-Identifier: Apache-2.0
#include "simulate/sparse/graph_factor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Vertices = std::vector<int>;

using Index = std::ptrdiff_t;

constexpr Index kRows = DenseKernels::tile_rows;  // also the columns per block
constexpr Index kLanes = DenseKernels::lanes;
constexpr Index kCols = DenseKernels::tile_cols;
constexpr Index kDots = DenseKernels::dots;
constexpr Index kFew = 24;     // width below which columns are factorised one by one
constexpr Index kDepth = 192;  // columns per product, so that two strips fit into the cache

/// Columns `first` to `last` of a trapezoid, from row `top` on: the factor A of a product A A^T.
struct Part {
  const float* values;
  Index rows, top, first, last;

  [[nodiscard]] Index height() const { return rows - top; }
  [[nodiscard]] Index depth() const { return last - first; }
  [[nodiscard]] const float* column(Index k) const {
    return values + trapezoid_column(rows, first + k) + top;
  }
};

/// Packs rows into strips of kRows, each column by column; zeros pad the last strip.
void pack(const Part& a, std::vector<float>& packed) {
  constexpr Index high = kRows;
  const Index depth = a.depth();
  const Index strips = (a.height() + high - 1) / high;
  packed.resize(std::max<std::size_t>(packed.size(), strips * high * depth));
  for (Index s = 0; s < strips; ++s) {
    float* to = packed.data() + s * high * depth;
    const Index count = std::min(high, a.height() - s * high);
    for (Index k = 0; k < depth; ++k) {
      const float* from = a.column(k) + s * high;
      std::copy(from, from + count, to + k * high);
      std::fill(to + k * high + count, to + (k + 1) * high, 0.0F);
    }
  }
}

/// Subtracts A A^T from the first `cols` columns of a lower triangle, or sets it to -A A^T; `place`
/// gives the position of row 0 of column j.
template <class Place>
void subtract_square(const Part& a, Index cols, bool set, DenseScratch& scratch,
                     const Place& place) {
  constexpr Index high = kRows;
  pack(a, scratch.strips);
  const DenseKernels& run = dense_kernels(scratch.most);
  const Index depth = a.depth();
  for (Index j = 0; j < cols; j += kCols) {
    const Index width = std::min(kCols, cols - j);
    const float* narrow = scratch.strips.data() + (j - j % high) * depth + j % high;
    float* column = place(j);
    const Index lead = width > 1 ? place(j + 1) - column : 0;
    // Skips whole vectors above the diagonal, except those of a 3x3 block on it.
    Index skip = std::max<Index>(0, j % high - 2) / kLanes * kLanes;
    for (Index i = j - j % high; i < a.height(); i += high, skip = 0) {
      run.subtract_product(
          scratch.strips.data() + i * depth + skip, narrow, depth,
          {column + i + skip, lead, std::min(high, a.height() - i) - skip, width, set});
    }
  }
}

/// Subtracts the outer product of columns `first` to `middle` from columns `middle` to `last`.
void subtract_outer(float* trapezoid, Index rows, Index first, Index middle, Index last,
                    DenseScratch& scratch) {
  const Part a{trapezoid, rows, middle, first, middle};
  subtract_square(a, last - middle, false, scratch,
                  [&](Index j) { return trapezoid + trapezoid_column(rows, middle + j) + middle; });
}

/// Factorises the columns of one block one by one.
bool factor_few(float* trapezoid, Index rows, Index first, Index last, const DenseKernels& run) {
  float* block = trapezoid + trapezoid_column(rows, first);
  const Index lead = rows - first + first % kRows;
  for (Index c = first; c < last; ++c) {
    float* column = block + (c - first) * lead + c;
    run.subtract(column, block + c, lead, block + c, lead, c - first, rows - c);
    if (!(column[0] > 0)) return false;
    const float pivot = std::sqrt(column[0]);
    const float inverse = 1 / pivot;
    column[0] = inverse;
    for (Index r = 1; r < rows - c; ++r) column[r] *= inverse;
  }
  return true;
}

/// Factorises recursively: the left half, its update of the right half, the right half.
bool factor_range(float* trapezoid, Index rows, Index first, Index last, DenseScratch& scratch) {
  const Index count = last - first;
  if (count <= kFew) {
    return factor_few(trapezoid, rows, first, last, dense_kernels(scratch.most));
  }
  const Index unit = count > kRows ? kRows : kFew;
  const Index middle = first + (count + unit - 1) / unit / 2 * unit;
  if (!factor_range(trapezoid, rows, first, middle, scratch)) return false;
  subtract_outer(trapezoid, rows, first, middle, last, scratch);
  return factor_range(trapezoid, rows, middle, last, scratch);
}

constexpr std::size_t kUncut = 12;  // largest region that is not divided further, in vertices
constexpr int kDirections = 4;      // candidate directions of dividing lines

}  // namespace

bool factor_columns(float* trapezoid, Index rows, Index cols, DenseScratch& scratch) {
  return factor_range(trapezoid, rows, 0, cols, scratch);
}

void set_minus_outer(const float* trapezoid, Index rows, Index cols, float* triangle,
                     DenseScratch& scratch) {
  const Index size = rows - cols;
  for (Index first = 0; first < cols; first += kDepth) {
    const Part a{trapezoid, rows, cols, first, std::min(cols, first + kDepth)};
    subtract_square(a, size, first == 0, scratch,
                    [&](Index j) { return triangle + trapezoid_column(size, j); });
  }
}

void solve_columns(const float* trapezoid, Index rows, Index cols, float* x, Instructions most) {
  const DenseKernels& run = dense_kernels(most);
  for (Index first = 0; first < cols; first += kDots) {
    const float* columns = trapezoid + trapezoid_column(rows, first);
    const Index lead = rows - first + first % kRows;
    const Index last = std::min(cols, first + kDots);
    for (Index c = first; c < last; ++c) {
      const float* column = columns + (c - first) * lead;
      x[c] *= column[c];
      for (Index r = c + 1; r < last; ++r) x[r] -= column[r] * x[c];
    }
    run.subtract(x + last, columns + last, lead, x + first, 1, last - first, rows - last);
  }
}

void solve_columns_transposed(const float* trapezoid, Index rows, Index cols, float* x,
                              Instructions most) {
  const DenseKernels& run = dense_kernels(most);
  float dots[kDots];
  for (Index last = cols; last > 0;) {
    const Index first = (last - 1) / kDots * kDots;
    const float* columns = trapezoid + trapezoid_column(rows, first);
    const Index lead = rows - first + first % kRows;
    run.dot(columns + last, lead, x + last, rows - last, last - first, dots);
    for (Index c = last; c-- > first;) {
      x[c] = (x[c] - dots[c - first]) * columns[(c - first) * lead + c];
      for (Index k = first; k < c; ++k) dots[k - first] += columns[(k - first) * lead + c] * x[c];
    }
    last = first;
  }
}

GraphMatrix::GraphMatrix(std::vector<Vertices> neighbours)
    : neighbours_(std::move(neighbours)), rows_(neighbours_.size()), begin_(1, 0) {
  for (int j = 0; j < count(); ++j) {
    rows_[j].push_back(j);
    for (const int i : neighbours_[j])
      if (i > j) rows_[j].push_back(i);
    begin_.push_back(begin_.back() + static_cast<int>(rows_[j].size()));
  }
  blocks_.resize(begin_.back());
  set_zero();
}

void GraphMatrix::set_zero() {
  std::fill(blocks_.begin(), blocks_.end(), Eigen::Matrix3d::Zero());
}

int GraphMatrix::place(int i, int j) const {
  const auto at = std::lower_bound(rows_[j].begin(), rows_[j].end(), i);
  return begin_[j] + static_cast<int>(at - rows_[j].begin());
}

class GraphFactor::Dissection {
 public:
  Dissection(const GraphMatrix& pattern, const std::vector<Vector2d>& places)
      : pattern_(pattern), places_(places), half_(places.size(), 0) {}

  /// Divides a part with a given border into regions, its own last; returns that one's index.
  int cut(const Vertices& part, Vertices border) {
    Front front;
    front.border = std::move(border);
    if (part.size() <= kUncut) {
      front.own = part;
    } else {
      Halves halves = shortest_cut(part);
      front.own = std::move(halves.between);
      for (const Vertices* half : {&halves.first, &halves.second}) {
        if (half->empty()) continue;
        for (const int v : *half) half_[v] = 1;
        Vertices beside;
        for (const Vertices* from : {&front.own, &front.border})
          std::copy_if(from->begin(), from->end(), std::back_inserter(beside),
                       [&](int v) { return meets(v); });
        for (const int v : *half) half_[v] = 0;
        front.children.push_back(cut(*half, std::move(beside)));
      }
    }
    fronts.push_back(std::move(front));
    return static_cast<int>(fronts.size()) - 1;
  }

  std::vector<Front> fronts;

 private:
  struct Halves {
    Vertices first, between, second;
  };
  [[nodiscard]] bool meets(int vertex) const {
    const Vertices& around = pattern_.neighbours(vertex);
    return std::any_of(around.begin(), around.end(), [&](int v) { return half_[v] == 1; });
  }
  [[nodiscard]] Halves shortest_cut(const Vertices& part) {
    Halves best;
    for (int k = 0; k < kDirections; ++k) {
      const double angle = std::numbers::pi * k / kDirections;
      const Vector2d across(std::cos(angle), std::sin(angle));
      Vertices sorted = part;
      std::stable_sort(sorted.begin(), sorted.end(), [&](int a, int b) {
        return places_[a].dot(across) < places_[b].dot(across);
      });
      const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
      Halves halves;
      halves.first.assign(sorted.begin(), middle);
      for (const int v : halves.first) half_[v] = 1;
      for (auto v = middle; v != sorted.end(); ++v)
        (meets(*v) ? halves.between : halves.second).push_back(*v);
      for (const int v : halves.first) half_[v] = 0;
      if (k == 0 || halves.between.size() < best.between.size()) best = std::move(halves);
    }
    return best;
  }

  const GraphMatrix& pattern_;
  const std::vector<Vector2d>& places_;
  std::vector<char> half_;  ///< 1 if in the half under consideration
};

GraphFactor::GraphFactor(const GraphMatrix& pattern, const std::vector<Vector2d>& places) {
  Dissection dissection(pattern, places);
  Vertices all(places.size());
  std::iota(all.begin(), all.end(), 0);
  dissection.cut(all, {});
  fronts_ = std::move(dissection.fronts);
  std::vector<int> rank(places.size()), local(places.size(), -1);
  int next = 0;
  for (const Front& front : fronts_)
    for (const int v : front.own) rank[v] = next++;
  for (Front& front : fronts_) {
    std::sort(front.border.begin(), front.border.end(),
              [&](int a, int b) { return rank[a] < rank[b]; });
    int count = 0;
    for (const Vertices* part : {&front.own, &front.border})
      for (const int v : *part) local[v] = count++;
    front.rows = 3 * static_cast<std::ptrdiff_t>(count);
    front.cols = 3 * static_cast<std::ptrdiff_t>(front.own.size());
    for (const int v : front.own) {
      front.entries.push_back({pattern.place(v, v), local[v], local[v], false});
      for (const int w : pattern.neighbours(v))
        if (rank[w] > rank[v])
          front.entries.push_back(
              {pattern.place(std::max(v, w), std::min(v, w)), local[w], local[v], w < v});
    }
    for (const int child : front.children) {
      front.in_parent.emplace_back();
      for (const int v : fronts_[child].border) front.in_parent.back().push_back(local[v]);
    }
    front.lower.resize(static_cast<std::size_t>(trapezoid_size(front.rows, front.cols)));
    const std::ptrdiff_t rest = front.rows - front.cols;
    front.update.resize(static_cast<std::size_t>(trapezoid_size(rest, rest)));
    work_.emplace_back(front.rows);
  }
}

/// Adds the updates of the children to the columns eliminated here, or to the others.
void GraphFactor::add_children(std::vector<Front>& fronts, Front& front, bool to_own) {
  const std::ptrdiff_t rest = front.rows - front.cols;
  for (std::size_t k = 0; k < front.children.size(); ++k) {
    const Front& child = fronts[front.children[k]];
    const Vertices& places = front.in_parent[k];
    const std::ptrdiff_t size = child.rows - child.cols;
    for (std::size_t j = 0; j < places.size(); ++j) {
      const std::ptrdiff_t first = 3 * static_cast<std::ptrdiff_t>(places[j]);
      if ((first < front.cols) != to_own) continue;
      for (std::ptrdiff_t c = 0; c < 3; ++c) {
        const float* from =
            child.update.data() + trapezoid_column(size, 3 * static_cast<std::ptrdiff_t>(j) + c);
        float* to = to_own ? front.lower.data() + trapezoid_column(front.rows, first + c)
                           : front.update.data() + trapezoid_column(rest, first + c - front.cols) -
                                 front.cols;
        for (std::size_t i = j; i < places.size(); ++i)
          for (int r = 0; r < 3; ++r) to[3 * places[i] + r] += from[3 * i + r];
      }
    }
  }
}

bool GraphFactor::factorise(const GraphMatrix& matrix) {
  for (Front& front : fronts_) {
    std::fill(front.lower.begin(), front.lower.end(), 0.0F);
    for (const Entry& entry : front.entries) {
      const Eigen::Matrix3d& block = matrix.block(entry.place);
      for (int c = 0; c < 3; ++c) {
        float* to =
            front.lower.data() + trapezoid_column(front.rows, 3 * entry.col + c) + 3 * entry.row;
        for (int r = 0; r < 3; ++r)
          to[r] += static_cast<float>(entry.transposed ? block(c, r) : block(r, c));
      }
    }
    add_children(fronts_, front, true);
    if (!factor_columns(front.lower.data(), front.rows, front.cols, scratch_)) return false;
    if (front.rows == front.cols) continue;
    if (front.cols == 0) std::fill(front.update.begin(), front.update.end(), 0.0F);
    set_minus_outer(front.lower.data(), front.rows, front.cols, front.update.data(), scratch_);
    add_children(fronts_, front, false);
  }
  return true;
}

void GraphFactor::solve(std::vector<Vector3d>& b) const {
  const auto at = [](std::size_t vertex) { return 3 * static_cast<Eigen::Index>(vertex); };
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    const Front& front = fronts_[f];
    Eigen::VectorXf& x = work_[f];
    for (std::size_t i = 0; i < front.own.size(); ++i)
      x.segment<3>(at(i)) = b[front.own[i]].cast<float>();
    x.tail(front.rows - front.cols).setZero();
    for (std::size_t k = 0; k < front.children.size(); ++k) {
      const Eigen::VectorXf& from = work_[front.children[k]];
      const Eigen::Index before = fronts_[front.children[k]].cols;
      for (std::size_t j = 0; j < front.in_parent[k].size(); ++j)
        x.segment<3>(at(front.in_parent[k][j])) += from.segment<3>(before + at(j));
    }
    solve_columns(front.lower.data(), front.rows, front.cols, x.data());
  }
  for (std::size_t f = fronts_.size(); f-- > 0;) {
    const Front& front = fronts_[f];
    Eigen::VectorXf& x = work_[f];
    solve_columns_transposed(front.lower.data(), front.rows, front.cols, x.data());
    for (std::size_t i = 0; i < front.own.size(); ++i)
      b[front.own[i]] = x.segment<3>(at(i)).cast<double>();
    for (std::size_t k = 0; k < front.children.size(); ++k) {
      Eigen::VectorXf& to = work_[front.children[k]];
      const Eigen::Index before = fronts_[front.children[k]].cols;
      for (std::size_t j = 0; j < front.in_parent[k].size(); ++j)
        to.segment<3>(before + at(j)) = x.segment<3>(at(front.in_parent[k][j]));
    }
  }
}

}  // namespace drape::simulate
