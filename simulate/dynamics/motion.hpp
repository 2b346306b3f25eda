// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "simulate/cloth/cloth.hpp"
#include "simulate/cloth/field_loops.hpp"
#include "simulate/contact/line_contacts.hpp"
#include "simulate/contact/pair_contacts.hpp"
#include "simulate/objects/surroundings.hpp"

namespace drape::simulate {

/// Limits common to the explicit motion and the implicit fall.
inline constexpr double kPinTravelTime = 0.3;  ///< s; pins move from the start to their places
inline constexpr double kQuietHeight =
    10e-6;  ///< m; rest is judged below weight * this kinetic energy

/// A material point held in space: a particle, or a point inside a cell by bilinear weights.
struct Hold {
  std::array<int, 4> particle{};
  std::array<double, 4> weight{};
};

struct MotionOptions {
  Eigen::Vector3d gravity_m_per_s2{0, 0, -9.80665};
  double damping_per_s = 0;  ///< beta / m of F = -beta v (paper section 4.2)
  /// Coefficient c of F = -c area |v| v, half the air density times drag factor
  double air_drag_kg_per_m3 = 0;
  double friction = 0;  ///< Coulomb coefficient with the objects and the table
  bool contact_between_particles = true;
  double cloth_thickness_m = 0;  ///< layers keep this apart; 0: the sheet does not meet itself
};

/// The particle system in motion: classical Runge-Kutta of order four (paper Fig. 5) with holds
/// and contacts. A particle that would enter an object stops the step at the first time of
/// impact; there its normal velocity is zeroed (inelastic) and from then on the pressing part of
/// its force, until the force pulls (paper section 4.3). Coulomb friction sticks or slides.
class Motion {
 public:
  Motion(Cloth& cloth, const Surroundings& surroundings, const MotionOptions& options);

  Field position;  ///< blocks x, y, z (m)
  Field velocity;  ///< m/s

  /// Holds material points where they are; their velocity is that of `velocity`.
  void hold(const std::vector<Hold>& holds);
  /// Moves the held points with the given velocities (m/s, one column each) until the next call.
  void move_holds(const Eigen::Matrix3Xd& rate_m_per_s);
  [[nodiscard]] bool holds_move() const { return !hold_rate_.isZero(0); }
  [[nodiscard]] Eigen::Vector3d held_point(std::size_t hold) const;
  /// Moves particles that start inside an object to its surface; returns how many.
  int push_out();

  /// One step of at most `step_s`; shorter when a particle hits an object. Returns its length.
  double step(double step_s);
  /// Largest stable step for the current shape, at a given fraction of RK4's limit 2.828/omega.
  [[nodiscard]] double stable_step_s(double fraction);
  /// Replaces the damping from here on; damping never changes an equilibrium.
  void set_damping_per_s(double damping_per_s) { options_.damping_per_s = damping_per_s; }
  /// Replaces gravity from here on.
  void load(const Eigen::Vector3d& gravity_m_per_s2) {
    options_.gravity_m_per_s2 = gravity_m_per_s2;
  }
  /// Zeroes all velocities.
  void stop();

  [[nodiscard]] double kinetic_energy_j() const;
  /// The same at the end of the last step.
  [[nodiscard]] double step_kinetic_j() const { return step_kinetic_j_; }
  [[nodiscard]] double gravity_energy_j() const;  ///< against the world origin
  /// Largest net static force on a particle, with contact and friction reactions and holds,
  /// damping off, relative to the mean weight of a particle.
  [[nodiscard]] double residual();
  /// Looks for places of contact between particles everywhere and lets those on lines that press
  /// slide on to where they hardly move, so that residual() is that of the present positions; what
  /// energy that brings in is booked.
  void seek_contacts();
  [[nodiscard]] double residual_rms() const { return residual_rms_; }  ///< of the last residual()

  [[nodiscard]] int contacts() const { return static_cast<int>(touching_.size()); }
  [[nodiscard]] int backtracked_steps() const { return backtracked_; }
  [[nodiscard]] double viscous_loss_j() const { return viscous_loss_j_; }
  /// Elastic energy that the search for contacts between particles has brought in by moving them.
  [[nodiscard]] double found_contacts_j() const { return found_contacts_j_; }
  [[nodiscard]] double stopped_j() const { return stopped_j_; }  ///< taken out by stop()
  [[nodiscard]] const LineContacts& line_contacts() const { return line_contacts_; }
  [[nodiscard]] const PairContacts& pair_contacts() const { return pair_contacts_; }

 private:
  /// m; beyond twice the displacement of the last step, where contacts are chosen
  static constexpr double kChooseMargin = 2e-6;

  struct Touch {
    int particle = 0;
    int shape = 0;
    bool stuck = false;
    double gap = 0;  ///< distance kept from the surface; a shallow hit starts below 0
    Eigen::Vector3d normal;
    Eigen::Vector3d slide;  ///< unit direction of sliding; zero when it has none
  };

  [[nodiscard]] OuterForces outer_forces() const;
  void accelerate(const Field& x, const Field& v, Field& a);
  void settle_touches(const Field& a);
  void constrain(Field& a) const;
  void project_holds(Field& field, bool to_rate = false);
  void runge_kutta(double step_s);
  [[nodiscard]] double first_impact(double& fraction);
  void refresh_line_contacts();
  void watch_contacts();
  void land();
  void land_pairs();
  void follow_surfaces(double step_s);
  void book_losses(double step_s);

  Cloth& cloth_;
  const Surroundings& surroundings_;
  MotionOptions options_;
  LineContacts line_contacts_;
  PairContacts pair_contacts_;
  std::vector<double> inverse_mass_;
  std::vector<int> no_cloth_;  ///< particles outside a round specimen; they stay where they are
  std::vector<Touch> touching_;
  std::vector<int> touch_of_;        ///< index into touching_, -1 for a free particle
  std::vector<double> clear_until_;  ///< value of path_m_ up to which a particle cannot touch
  std::vector<int> inside_;          ///< free particles found inside an object
  double path_m_ = 0;                ///< sum of the fastest particle's path lengths
  double last_path_m_ = 0;           ///< its displacement in the last step
  double last_step_s_ = 0;
  double bound_per_s2_ = 0, bound_of_pairs_per_s2_ = 0;  ///< that the step's limit counts with
  std::vector<double> mobility_;                         ///< inverse masses, 0 on an object
  std::vector<double> paths_m_;                          ///< each particle's path length (m)
  std::vector<Hold> holds_;
  Eigen::MatrixXd hold_response_;
  Eigen::Matrix3Xd hold_rate_;
  Eigen::VectorXd hold_value_, hold_answer_;
  Field start_x_, start_v_, stage_x_, stage_v_, net_;
  std::array<Field, 4> stage_a_;
  int backtracked_ = 0;
  long steps_ = 0;
  double travel_m_ = 0;  ///< longest path of any particle since the last contact search
  double step_kinetic_j_ = 0, viscous_loss_j_ = 0, stopped_j_ = 0, found_contacts_j_ = 0,
         residual_rms_ = 0;
};

}  // namespace drape::simulate
