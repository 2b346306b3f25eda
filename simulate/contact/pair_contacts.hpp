// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "simulate/cloth/cloth.hpp"
#include "simulate/contact/box_tree.hpp"
#include "simulate/contact/proximity.hpp"
#include "simulate/contact/solid_features.hpp"
#include "simulate/objects/surroundings.hpp"

namespace drape::simulate {

/// Contact of the sheet, cut into two triangles per cell, with itself and with sharp solids:
/// - particle against triangle and edge against edge of the sheet, kept `thickness` apart (one
///   thickness of cloth between the middles of two layers);
/// - corner of a solid against triangle, edge of a solid against edge of the sheet. (Particles
///   against the faces of solids are Motion's own contacts.)
///
/// Two layers may lie in neighbouring cells. A pair that comes together is stopped inelastically
/// (paper section 4.3); what presses from then on is elastic with the stiffness and damping of
/// LineContacts, and friction is an elastic-plastic tangential spring. Which side of a layer
/// another one lies on is remembered, so that layers which were pressed through are pressed back.
class PairContacts {
 public:
  /// `thickness_m` 0: the sheet does not meet itself.
  PairContacts(const Cloth& cloth, const Surroundings& surroundings, double friction,
               double gravity_m_per_s2, double thickness_m);

  /// Before a step: finds the pairs that may touch while no particle moves by more than `margin_m`.
  /// `path_m` is the sum of the fastest particle's path lengths so far.
  void watch(const Field& position, double path_m, double margin_m);
  /// Adds forces (N). `velocity` absent: the static force, without contact damping.
  void add_forces(const Field& position, const Field* velocity, Field& force) const;
  /// Fraction of the step from `start` to `end` at which the first pair meets, 1 when none sinks in
  /// by more than `depth_m`.
  [[nodiscard]] double first_impact(const Field& start, const Field& end, double depth_m) const;
  /// Takes the approaching velocity out of the pairs that have met; particles whose `inverse_mass`
  /// is 0 because something holds them keep theirs. `whole_inverse_mass` is that of free ones.
  void land(const Field& position, const std::vector<double>& whole_inverse_mass,
            const std::vector<double>& inverse_mass, Field& velocity);
  /// Moves the friction springs by a step of the motion and notes on which side layers lie.
  void advance(const Field& position, const Field& velocity, double step_s);

  /// Longest displacement of a particle in one step that cannot carry it through another layer; no
  /// limit (infinity) while nothing is near.
  [[nodiscard]] double longest_path_m() const;
  [[nodiscard]] int near() const { return static_cast<int>(pairs_.size()); }
  [[nodiscard]] int pressing(const Field& position) const;
  /// Depth by which a corner or edge of a solid presses into the sheet (m), 0 for none.
  [[nodiscard]] double deepest_solid_m(const Field& position) const;
  [[nodiscard]] double thickness_m() const { return thickness_; }
  [[nodiscard]] double energy_j(const Field& position) const;
  /// Bound of what the present contacts add to the highest frequency squared.
  [[nodiscard]] double frequency_squared_per_s2() const { return frequency2_; }

 private:
  enum class Kind : char { layers_point, layers_edge, solid_corner, solid_edge };

  struct Pair {
    Kind kind = Kind::layers_point;
    std::array<int, 4> node{};  ///< particles; from count() on a point of solids_
    int feature = 0;            ///< corner or edge of a solid
    double thickness = 0;       ///< that two layers keep apart
    bool known = false;         ///< side is set
    bool chosen = false;        ///< in the last step
    bool pressed = false;
    double clear_until = 0;                            ///< path length up to which it stays apart
    Eigen::Vector3d side = Eigen::Vector3d::Zero();    ///< unit, from second to first layer
    Eigen::Vector3d spring = Eigen::Vector3d::Zero();  ///< stretch of friction, tangential (m)
  };
  /// A pair as it stands: forces of size p are weight * p * direction at the four nodes.
  struct Meeting {
    std::array<double, 4> weight{};
    Eigen::Vector3d direction;
    double gap = 0;
  };
  struct Push {
    Meeting meeting;
    Eigen::Vector3d force;
  };

  void refresh(const Field& position);
  void emit_layers(const Field& position, int one, int two);
  void emit_solids(const Field& position, int cell);
  void offer(const Field& position, Kind kind, const std::array<int, 4>& node, int feature);
  void offer_layers(const Field& position, Kind kind, const std::array<int, 4>& node,
                    bool neighbours);
  void keep_known(std::vector<Pair>& before);
  void choose(const Field& position, double path_m, double margin_m);
  [[nodiscard]] Eigen::Vector3d point(const Field& position, int node) const;
  [[nodiscard]] std::optional<Meeting> meet(const Pair& pair, const Field& position) const;
  [[nodiscard]] double apart(const Pair& pair, const Field& position) const;
  [[nodiscard]] std::optional<Meeting> meet_solid(const Pair& pair, const Nearest& nearest,
                                                  const std::array<Eigen::Vector3d, 4>& p) const;
  [[nodiscard]] std::optional<Push> push(const Pair& pair, const Field& position,
                                         const Field* velocity) const;
  [[nodiscard]] Eigen::Vector3d mix(const Pair& pair, const Meeting& meeting,
                                    const Field& field) const;

  GridSpec grid_;
  int count_ = 0;
  double friction_ = 0, thickness_ = 0, stiffness_ = 0, damping_ = 0, reach_ = 0;
  const std::vector<double>* mass_ = nullptr;
  SolidFeatures features_;
  std::vector<Eigen::Vector3d> solids_;  ///< corners, then both ends of each edge
  BoxTree solid_tree_, sheet_tree_;
  std::vector<int> cells_;  ///< lower corners of the cells, the items of sheet_tree_
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<Pair> pairs_;
  std::vector<int> chosen_;
  std::vector<double> rows_;
  double fresh_until_ = -1;  ///< path length up to which pairs_ is complete
  double frequency2_ = 0;
};

}  // namespace drape::simulate
