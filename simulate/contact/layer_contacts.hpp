// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "simulate/cloth/cloth.hpp"
#include "simulate/contact/box_tree.hpp"
#include "simulate/contact/layer_pair.hpp"

namespace drape::simulate {

/// Contact of the sheet with itself without time, as a potential: particles and triangles, edges
/// and edges that are two layers, those of neighbouring cells too, press elastically when they come
/// nearer than a thickness, with the stiffness of LineContacts; from half a thickness on ever
/// stiffer (Li et al. 2020), so that no force closes the last of it. No friction. Between begin()
/// and the next one everything is the gradient of energy_j().
///
/// Edges that are nearly parallel have no smooth distance: they count with a part that is kept
/// during a step, and their ends meet the other layer's triangles anyhow.
class LayerContacts {
 public:
  /// `thickness_m` 0: the sheet does not meet itself.
  LayerContacts(const Cloth& cloth, double gravity_m_per_s2, double thickness_m);

  [[nodiscard]] bool on() const { return thickness_ > 0; }
  [[nodiscard]] double thickness_m() const { return thickness_; }

  /// Starts a step from `position`.
  void begin(const Field& position);
  /// Lists also what may press while particles go straight on to `to`; asked before energies and
  /// forces there, or in between.
  void watch(const Field& to);
  /// The part of that straight path which brings no pair nearer than a fifth of its distance.
  [[nodiscard]] double safe_fraction(const Field& to) const;
  /// The part of it for what nothing pushes back, as pins that are carried: none enters the last
  /// half of a thickness, which no force would open again.
  [[nodiscard]] double free_fraction(const Field& to) const;
  /// Takes pairs that would come to press by going on to `to` into the quadratic model; how many.
  int review(const Field& to);
  [[nodiscard]] bool lands() const { return lands_; }  ///< review() changed something

  [[nodiscard]] double energy_j(const Field& position) const;
  void add_forces(const Field& position, Field& force) const;

  /// Presses at a place of each layer (N), the second one's weights negative.
  struct Push {
    std::array<int, 4> particle{};
    std::array<double, 4> weight{};
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
  };
  [[nodiscard]] std::vector<Push> pushes(const Field& position) const;
  [[nodiscard]] int pressing(const Field& position) const;

  /// A pair's part of the quadratic model, particle by particle.
  struct Block {
    std::array<int, 4> particle{};
    Eigen::Matrix<double, 12, 12> matrix;
  };
  [[nodiscard]] std::vector<Block> blocks(const Field& position, bool convex) const;
  /// Forces that review() adds to the model's gradient, and the curve along a step that the energy
  /// has not.
  void add_changes(Eigen::VectorXd& gradient) const;
  [[nodiscard]] double excess_curve(const Eigen::VectorXd& step) const;

 private:
  struct Pair {
    LayerPair of;
    double thickness_m = 0;  ///< nearer than this it presses
    double distance_m = 0;   ///< where the step starts
    double part = 1;         ///< share of edges that are nearly parallel
    bool lands = false;      ///< review() found that it will press
  };
  struct Cell {
    int corner = 0, row = 0, col = 0;
    std::array<int, 4> vertex{};
    std::array<std::array<int, 2>, 5> edge{};
    std::array<std::array<int, 3>, 2> triangle{};
    int vertices = 0, edges = 0;
    /// least_apart_m() where the step starts, of the neighbours that come later.
    std::array<double, 4> apart{};
    // On the straight path:
    Eigen::Vector3d centre, displacement;
    double radius = 0, spread = 0;
    bool changed = false;  ///< that path since list() was asked last
  };

  void list(const Field& to);
  [[nodiscard]] bool goes_elsewhere(const Cell& cell, const Field& to) const;
  void measure(Cell& cell, const Field& to) const;
  [[nodiscard]] bool may_meet(Cell& a, const Cell& b);
  void list_cells(const Cell& a, const Cell& b, const Field& to);
  void offer(const LayerPair& pair, bool neighbours, const Field& to);

  GridSpec grid_;
  double thickness_ = 0, stiffness_ = 0;
  std::vector<Cell> cells_;
  BoxTree tree_;
  std::vector<Eigen::AlignedBox3d> boxes_;
  bool lands_ = false;
  Field start_;
  Field listed_;             ///< where list() was asked last in this step; empty: not yet
  std::vector<Pair> pairs_;  ///< in order
  std::vector<Pair> found_;  ///< scratch of list()
};

}  // namespace drape::simulate
