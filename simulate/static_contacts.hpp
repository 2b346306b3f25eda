// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "simulate/line_contacts.hpp"
#include "simulate/motion.hpp"
#include "simulate/static_factor.hpp"

namespace drape::sim {

/// Contact, friction and pins of a sheet without time: the same laws as Motion's. Particles touch
/// rigidly and stick or slide by Coulomb's law; points between particles press elastically and
/// their friction is an elastic-plastic spring to the place where they first touched.
class StaticContacts {
 public:
  enum class Touch : char { none, landing, stuck, sliding };

  StaticContacts(const Cloth& cloth, const Surroundings& surroundings, double friction,
                 double gravity_m_per_s2, bool between_particles);

  /// Pins: the held material points and their places.
  void hold(const std::vector<Hold>& holds, const std::vector<Eigen::Vector3d>& in_world);

  /// Takes every particle on a surface (to `reach_m`) as touching and stuck.
  void touch_what_lies_on(const Field& position, double reach_m);
  /// Finds the points between particles anew; those that keep on touching keep their spring.
  void refresh(const Field& position);
  /// Adds pressing, friction of points between particles, and pins (N).
  void add_forces(const Field& position, Field& force) const;
  void add_hessian(const Field& position, bool convex, GridMatrix& hessian) const;

  /// Judges each touching particle by the force on it: released, stuck or sliding. Returns the
  /// largest net force left (N).
  double settle(const Field& position, const Field& force);
  [[nodiscard]] double rms_n() const { return rms_n_; }  ///< of the net forces of settle()
  /// Curvature of the surfaces under sliding particles, by their pressing force.
  void add_surface_curvature(const Field& position, const Field& force, GridMatrix& hessian) const;
  /// Projectors onto the free directions, the given way back to the surfaces, and the friction
  /// on sliding particles (N), all interleaved by particle.
  [[nodiscard]] const std::vector<Eigen::Matrix3d>& projectors() const { return projector_; }
  [[nodiscard]] const std::vector<char>& restricted() const { return restricted_; }
  [[nodiscard]] const Eigen::VectorXd& lift() const { return lift_; }
  [[nodiscard]] const Eigen::VectorXd& friction() const { return sliding_friction_; }

  /// Particles that would be inside an object; those deeper than `deep_m` become touching.
  /// Returns how many.
  int catch_entering(const Field& from, const Field& to, double deep_m);
  /// Brings sliding particles that lay on a surface in `from` back to it: a straight way leaves a
  /// curved surface.
  void retract(const Field& from, Field& to) const;
  /// After a step has been taken: what is inside lands, what slid back sticks.
  void follow(const Field& from, const Field& position);
  /// Moves friction springs that are past their limit to it.
  void yield(const Field& position);
  /// Moves the pins' reactions to where the pins hold exactly.
  void update_pins(const Field& position);

  [[nodiscard]] double pin_error_m(const Field& position) const;
  [[nodiscard]] double gap_error_m(const Field& position) const;  ///< of touching particles
  [[nodiscard]] double energy_j(const Field& position) const;
  [[nodiscard]] int touching() const;
  [[nodiscard]] int sliding() const;
  [[nodiscard]] int between() const { return lines_.count(); }

 private:
  struct Contact {
    double gap = 0;
    double normal_n = 0;
    Eigen::Vector3d normal, spring, tangential_n;
    bool slips = false;
  };
  [[nodiscard]] Contact contact(const LineContacts::Point& point, const Field& position) const;
  void set_constraint(int particle, const Field& position, bool all_directions);

  const Cloth* cloth_;
  const Surroundings* surroundings_;
  double friction_;
  bool between_particles_;
  LineContacts lines_;
  std::vector<Touch> touch_;
  std::vector<int> shape_;
  std::vector<Eigen::Vector3d> way_;     ///< unit direction of a sliding particle
  std::vector<Eigen::Vector3d> anchor_;  ///< of each element between particles
  std::vector<char> anchored_;
  std::vector<Eigen::Matrix3d> projector_;
  std::vector<char> restricted_;
  Eigen::VectorXd lift_, sliding_friction_;
  std::vector<Hold> holds_;
  std::vector<Eigen::Vector3d> hold_in_world_, hold_force_;
  double hold_stiffness_ = 0, rms_n_ = 0;
};

}  // namespace drape::sim
