// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <vector>

#include "simulate/mesh/mesh_cloth.hpp"

namespace drape::simulate {

/// A stiffness (N/m) between two points of a triangle, or of one point; each pair `point`, `other`
/// occurs once. For a side (N m), both are its unknown.
struct Support {
  int point = 0, other = 0;
  Eigen::Matrix3d stiffness;
};

/// A symmetric positive definite matrix near the second derivatives of a MeshCloth's energy, with
/// its Cholesky factor: the preconditioner of a descent.
///
/// The membrane part contains the products of first derivatives and the tension of each triangle,
/// not its compression. Bending depends on the points only, with the sides' derivatives taken from
/// the linear triangles on both sides (weighted so that a bend across the side is exact; at the
/// hem, where nothing holds a side, from the triangle's own least energy). The deviation of the
/// sides' derivatives from these has a second matrix, of the sides alone, with the seams and the
/// supports of sides, using the stiffness of elements before slip.
class MeshStiffness {
 public:
  /// `held` unknowns are fixed. Both arguments must outlive this object.
  MeshStiffness(const MeshCloth& cloth, const std::vector<bool>& held);
  ~MeshStiffness();
  MeshStiffness(const MeshStiffness&) = delete;
  MeshStiffness& operator=(const MeshStiffness&) = delete;

  /// Forms and factorises the matrix of a state with `supports`. Returns false if rounding makes it
  /// indefinite.
  [[nodiscard]] bool factorise(const MeshCloth::State& state, const std::vector<Support>& supports);
  /// True if the last factor is still usable: no point has moved farther than `near_m` since.
  [[nodiscard]] bool serves(const MeshCloth::State& state, double near_m) const;
  void outdate() { formed_at_.clear(); }
  /// Solves in place; gives zero for held unknowns.
  void solve(MeshCloth::State& b) const;

 private:
  class Weights;
  struct Gradient;
  class SidesMatrix;
  struct Parts;
  std::unique_ptr<Parts> parts_;
  MeshCloth::State formed_at_;  ///< empty if none was formed
};

/// Result of conjugate_gradients().
struct ConjugateGradients {
  int products = 0;
  bool solved = false;
  bool positive = true;  ///< no direction of negative curvature was met
};

/// Sets x near H^-1 b by conjugate gradients (Hestenes and Stiefel 1952) with the factor as
/// preconditioner, until `solved` accepts the residual b - H x and its norm in the factor's metric,
/// relative to that of b; at most `most` products. It ends at the first direction of negative
/// curvature (Steihaug 1983) with x as it is, or with that direction if it is the first one.
/// `multiply` sets the product of H and a direction; `b` ends as the residual.
[[nodiscard]] ConjugateGradients conjugate_gradients(
    const MeshStiffness& factor,
    const std::function<void(const MeshCloth::State& direction, MeshCloth::State& product)>&
        multiply,
    const std::function<bool(double norm, const MeshCloth::State& residual)>& solved, int most,
    MeshCloth::State& b, MeshCloth::State& x);

}  // namespace drape::simulate
