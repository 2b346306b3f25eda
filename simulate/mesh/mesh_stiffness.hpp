// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "simulate/mesh/mesh_cloth.hpp"

namespace drape::simulate {

/// A stiffness (N/m) between two points of a triangle, or of one; `point` and `other` once each. Or
/// that of a side (N m), whose unknown both then are.
struct Support {
  int point = 0, other = 0;
  Eigen::Matrix3d stiffness;
};

/// A symmetric positive definite matrix near the second derivatives of a MeshCloth's energy, and
/// its factor: the preconditioner of a descent's steps.
///
/// Holds of the membrane the products of first derivatives and the tension of each triangle, not
/// its compression. Bending is that of the points alone, with the sides' derivatives taken from the
/// linear triangles on both sides (weighted so that a bend across the side is exact; at the hem,
/// where nothing holds a side, from the triangle's own least energy). What the sides' derivatives
/// differ from that is a second matrix, of the sides alone, with the seams and what presses on
/// sides, for the stiffness of the elements before anything slips.
class MeshStiffness {
 public:
  /// `held` unknowns do not move. Neither argument may go before this object.
  MeshStiffness(const MeshCloth& cloth, const std::vector<bool>& held);
  ~MeshStiffness();
  MeshStiffness(const MeshStiffness&) = delete;
  MeshStiffness& operator=(const MeshStiffness&) = delete;

  /// Forms and factors the matrix of a state with `supports`. False when rounding leaves it not
  /// positive definite.
  [[nodiscard]] bool factorise(const MeshCloth::State& state, const std::vector<Support>& supports);
  /// Whether the last factor still serves: no point went farther than `near_m` since then.
  [[nodiscard]] bool serves(const MeshCloth::State& state, double near_m) const;
  void outdate() { formed_at_.clear(); }
  /// Solves in place; nothing for what is held.
  void solve(MeshCloth::State& b) const;

 private:
  class Weights;
  struct Gradient;
  class SidesMatrix;
  struct Parts;
  std::unique_ptr<Parts> parts_;
  MeshCloth::State formed_at_;  ///< empty: none
};

}  // namespace drape::simulate
