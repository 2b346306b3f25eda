// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/kicks.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/statistics/random.hpp"
#include "simulate/equilibrium/mixture.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Of the patch: reach of a moved part, and how far it moves.
constexpr double kLeastPart = 0.15, kMostPart = 0.6, kLeastMove = 0.02, kMostMove = 0.15;
// Of the patch: how far from its border a line crosses it, and how wide the border of two rests is.
constexpr double kInside = 0.2, kLeastBorder = 0.1, kMostBorder = 0.5;
// Every eighth: it costs three times a move, for more of the sheet has to settle.
constexpr std::uint64_t kMirrored = 8;

class Draw {
 public:
  /// Neighbouring seeds would be one sequence with a shift, so a seed is mixed first.
  explicit Draw(std::uint64_t seed) : random_(SplitMix64(seed).next()) {}
  double uniform(double low, double high) { return low + (high - low) * random_.uniform(); }
  std::size_t below(std::size_t count) {
    return std::min(count - 1, static_cast<std::size_t>(uniform(0, static_cast<double>(count))));
  }

 private:
  SplitMix64 random_;
};

/// Material place of a particle, of the patch.
Vector2d place_of(const GridSpec& grid, int i) {
  return {int{i / grid.cols} / (grid.rows - 1.0), (i % grid.cols) / (grid.cols - 1.0)};
}

/// With a round part of the sheet moved across its own plane of least spread, or mirrored in it,
/// which turns a fold inside out.
Field moved_part(const GridSpec& grid, Draw& draw, bool mirrors, Field x) {
  const Vector2d centre(draw.uniform(0, 1), draw.uniform(0, 1));
  const double reach = draw.uniform(kLeastPart, kMostPart);
  const double side = std::max(grid.patch_m.x(), grid.patch_m.y());
  const double move =
      side * draw.uniform(kLeastMove, kMostMove) * (draw.uniform(-1, 1) < 0 ? -1 : 1);
  std::vector<double> weight(grid.count());
  double total = 0;
  Vector3d middle = Vector3d::Zero();
  for (int i = 0; i < grid.count(); ++i) {
    const double square = (place_of(grid, i) - centre).squaredNorm();
    const double inside = std::max(0.0, 1 - square / (reach * reach));
    weight[i] = std::min(1.0, 2 * inside * inside);
    total += weight[i];
    middle += weight[i] * at(x, i);
  }
  if (!(total > 0)) return x;
  middle /= total;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (int i = 0; i < grid.count(); ++i) {
    const Vector3d p = at(x, i) - middle;
    spread += weight[i] * p * p.transpose();
  }
  const Vector3d across =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
  for (int i = 0; i < grid.count(); ++i) {
    const Vector3d p = at(x, i);
    const double by = mirrors ? -2 * (p - middle).dot(across) : move;
    put_at(x, i, p + weight[i] * by * across);
  }
  return x;
}

/// With what lies beyond a line taken from another rest.
Field spliced(const GridSpec& grid, Draw& draw, Field x, const Field& other) {
  const Vector2d on_line(draw.uniform(kInside, 1 - kInside), draw.uniform(kInside, 1 - kInside));
  const double angle = draw.uniform(0, 2 * std::numbers::pi);
  const double border = draw.uniform(kLeastBorder, kMostBorder);
  const Vector2d beyond(std::cos(angle), std::sin(angle));
  for (int i = 0; i < grid.count(); ++i) {
    const double far = (place_of(grid, i) - on_line).dot(beyond);
    const double t = std::clamp(far / border + 0.5, 0.0, 1.0);
    const double part = t * t * (3 - 2 * t);
    put_at(x, i, (1 - part) * at(x, i) + part * at(other, i));
  }
  return x;
}

}  // namespace

Field kicked(const GridSpec& grid, std::uint64_t index, const std::vector<const Field*>& rests) {
  Draw draw(index);
  const Field& rest = *rests[draw.below(rests.size())];
  if (index % 2 == 0) return spliced(grid, draw, rest, *rests[draw.below(rests.size())]);
  return moved_part(grid, draw, index % kMirrored == 1, rest);
}

}  // namespace drape::simulate
