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

constexpr std::size_t kUncut = 12;  // largest region that is not divided further, in vertices
constexpr int kDirections = 4;      // candidate directions of dividing lines

}  // namespace

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
