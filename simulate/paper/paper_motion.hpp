// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "simulate/objects/surroundings.hpp"
#include "simulate/paper/paper_cloth.hpp"
#include "simulate/paper/paper_layers.hpp"

namespace drape::simulate {

/// External forces on the cloth (paper section 4.2).
struct PaperForces {
  Eigen::Vector3d gravity_m_per_s2{0, 0, -9.80665};
  double damping_per_s = 0;  ///< beta / m of F = -beta v
  double air_drag_kg_per_m3 =
      0;                   ///< c of F = -c area |v| v: half of the air's density times drag factor
  double friction = 0;     ///< Coulomb coefficient with objects and table
  double thickness_m = 0;  ///< distance that layers of cloth keep; 0 if they do not interact
};

/// Motion of the particles: classical fourth-order Runge-Kutta (paper Fig. 5) with pins and
/// collisions (paper section 4.3). A particle that would enter an object ends the step at the first
/// time of impact; its normal velocity is set to zero there (inelastic), and from then on the
/// pressing component of its force, until the force pulls. Coulomb friction sticks or slides. Cloth
/// between particles may enter objects; layers repel each other (paper_layers.hpp).
class PaperMotion {
 public:
  PaperMotion(const PaperCloth& cloth, const Surroundings& around, const PaperForces& forces);

  Particles position, velocity;

  /// Holds material points, each a weighted sum of particles, one row per point.
  void hold(const Eigen::MatrixXd& weights);
  /// Moves the held points with these velocities (m/s, one column each) until the next call.
  void move_holds(const Eigen::Matrix3Xd& rate_m_per_s);
  [[nodiscard]] Eigen::Matrix3Xd held_points() const { return position * holds_.transpose(); }
  /// Moves particles inside an object to its surface; returns their number.
  int push_out();

  /// Advances by at most `longest_s` and at most `fraction` of the stability limit, 2.828 over the
  /// highest frequency; less if a particle hits an object. Returns the elapsed time.
  double step(double fraction, double longest_s);
  void stop();  ///< sets all velocities to zero

  [[nodiscard]] double kinetic_j() const;
  [[nodiscard]] double gravity_j() const;  ///< relative to the origin
  /// Largest net static force on a particle, including reactions of objects, friction and pins but
  /// no damping, in particle weights.
  [[nodiscard]] double residual() const;
  [[nodiscard]] int contacts() const;
  [[nodiscard]] int backtracked_steps() const { return backtracked_; }
  [[nodiscard]] double layers_j() const { return layers_.energy_j(position); }
  [[nodiscard]] double viscous_j() const { return viscous_j_; }  ///< lost to damping and air drag

 private:
  /// Contact of a particle with a shape; -1 for none.
  struct Touch {
    int shape = -1;
    bool stuck = false;
    double press_m_per_s2 = 0;  ///< pressing force per mass
    double gap = 0;  ///< distance to keep from the surface; negative at first for a shallow hit
    Eigen::Vector3d normal, slide;  ///< unit vectors; `slide` is zero unless sliding
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
  std::vector<Touch> touch_;         ///< per particle
  std::vector<double> clear_until_;  ///< value of path_m_ up to which a particle cannot touch
  double path_m_ = 0;                ///< accumulated path of the fastest particle
  Eigen::MatrixXd holds_, hold_response_;
  Eigen::Matrix3Xd hold_rate_;
  Particles start_x_, start_v_;
  std::array<Particles, 4> a_;
  int backtracked_ = 0;
  double viscous_j_ = 0;
};

}  // namespace drape::simulate
