// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "simulate/objects/surroundings.hpp"
#include "simulate/paper/paper_cloth.hpp"
#include "simulate/paper/paper_layers.hpp"

namespace drape::simulate {

/// Forces from outside the cloth (paper section 4.2).
struct PaperForces {
  Eigen::Vector3d gravity_m_per_s2{0, 0, -9.80665};
  double damping_per_s = 0;  ///< beta / m of F = -beta v
  double air_drag_kg_per_m3 =
      0;                   ///< c of F = -c area |v| v: half the air's density times drag factor
  double friction = 0;     ///< Coulomb coefficient with the objects and the table
  double thickness_m = 0;  ///< layers of cloth keep this apart; 0: they do not meet
};

/// The particles in motion: classical Runge-Kutta of order four (paper Fig. 5) with pins and
/// collisions (paper section 4.3). A particle that would enter an object stops the step at the
/// first time of impact; there its normal velocity is zeroed (inelastic) and from then on the
/// pressing part of its force, until the force pulls. Coulomb friction sticks or slides. Cloth
/// between particles may enter objects; layers press on each other (paper_layers.hpp).
class PaperMotion {
 public:
  PaperMotion(const PaperCloth& cloth, const Surroundings& around, const PaperForces& forces);

  Particles position, velocity;

  /// Holds material points, each a mixture of particles by a row of weights.
  void hold(const Eigen::MatrixXd& weights);
  /// Moves the held points with these velocities (m/s, one column each) until the next call.
  void move_holds(const Eigen::Matrix3Xd& rate_m_per_s);
  [[nodiscard]] Eigen::Matrix3Xd held_points() const { return position * holds_.transpose(); }
  /// Moves particles inside an object to its surface; returns how many.
  int push_out();

  /// Moves for at most `longest_s` and at most `fraction` of the limit of stability, 2.828 over the
  /// highest frequency; shorter when a particle hits an object. Returns the time that has passed.
  double step(double fraction, double longest_s);
  void stop();  ///< zeroes all velocities

  [[nodiscard]] double kinetic_j() const;
  [[nodiscard]] double gravity_j() const;  ///< against the origin
  /// Largest net static force on a particle, with reactions of objects, friction and pins, without
  /// damping, in weights of a particle.
  [[nodiscard]] double residual() const;
  [[nodiscard]] int contacts() const;
  [[nodiscard]] int backtracked_steps() const { return backtracked_; }
  [[nodiscard]] double layers_j() const { return layers_.energy_j(position); }
  [[nodiscard]] double viscous_j() const { return viscous_j_; }  ///< lost to damping and air

 private:
  /// Contact of a particle with a shape; -1: none.
  struct Touch {
    int shape = -1;
    bool stuck = false;
    double press_m_per_s2 = 0;  ///< pressing force over mass
    double gap = 0;             ///< distance kept from the surface; a shallow hit starts below 0
    Eigen::Vector3d normal, slide;  ///< unit; `slide` is zero where nothing slides
  };

  CertificateStrains accelerate(const Particles& x, const Particles& v, Particles& a) const;
  void settle_touches(const Particles& a);
  void constrain(Particles& a) const;
  void project_holds(Particles& values, const Eigen::Matrix3Xd* rate = nullptr) const;
  void runge_kutta(double step_s);
  [[nodiscard]] double first_impact();
  void land();
  void follow_surfaces(double step_s);

  const PaperCloth& cloth_;
  const Surroundings& around_;
  PaperForces forces_;
  PaperLayers layers_;
  Eigen::RowVectorXd area_per_mass_;
  std::vector<Touch> touch_;         ///< by particle
  std::vector<double> clear_until_;  ///< value of path_m_ up to which a particle cannot touch
  double path_m_ = 0;                ///< sum of the fastest particle's path lengths
  Eigen::MatrixXd holds_, hold_response_;
  Eigen::Matrix3Xd hold_rate_;
  Particles start_x_, start_v_;
  std::array<Particles, 4> a_;
  int backtracked_ = 0;
  double viscous_j_ = 0;
};

}  // namespace drape::simulate
