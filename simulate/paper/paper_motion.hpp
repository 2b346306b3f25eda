// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/simulation_files.hpp"
#include "simulate/contact/layer_pair.hpp"
#include "simulate/fabric/laws.hpp"
#include "simulate/objects/surroundings.hpp"

namespace drape::simulate {

/// Positions (m), velocities (m/s), accelerations or forces, one column per particle.
using Particles = Eigen::Matrix3Xd;

/// Particle grid on a rectangular patch: rows along the warp, columns along the weft.
struct ParticleGrid {
  int rows = 0, cols = 0;
  Eigen::Vector2d patch_m = Eigen::Vector2d::Zero();  ///< (warp, weft)

  [[nodiscard]] int count() const { return rows * cols; }
  [[nodiscard]] Eigen::Vector2d spacing_m() const {
    return {patch_m.x() / (rows - 1), patch_m.y() / (cols - 1)};
  }
  /// Material coordinates (warp, weft) of a particle.
  [[nodiscard]] Eigen::Vector2d material_m(int particle) const {
    return spacing_m().cwiseProduct(Eigen::Vector2d(particle / cols, particle % cols));
  }
};

/// Cloth of paper section 4.1. Springs of stiffness K'st = f(strain) / strain - Kdiag, at least 0,
/// join neighbours along warp and weft; springs of stiffness Kdiag = f_sh(a) / sin(a), a the cell's
/// shear angle, join the corners of each cell. Each line of three neighbours bends with its moment
/// per width at the curvature |x- - 2 x + x+| / spacing^2. Border lines count like inner ones.
/// Every particle has the mass density * area / number. Forces act along springs, so momentum and
/// angular momentum are conserved; Kdiag depends on the angle, so the forces have no exact
/// potential, and energies are those of the springs at their current stiffness.
class PaperCloth {
 public:
  /// `stretch_damping_s`: damping force of a grid line spring = this * slope * strain rate, per
  /// width.
  PaperCloth(const ParticleGrid& grid, ClothLaws laws, double stretch_damping_s = 0);

  [[nodiscard]] const ParticleGrid& grid() const { return grid_; }
  [[nodiscard]] double particle_kg() const { return particle_kg_; }
  [[nodiscard]] double area_m2(int particle) const;  ///< area of cloth that belongs to a particle

  /// Adds internal forces (N), including damping if `velocity` (m/s) is given. Returns the strains.
  CertificateStrains add_forces(const Particles& position, const Particles* velocity,
                                Particles& force) const;
  [[nodiscard]] InternalEnergies energies(const Particles& position) const;
  [[nodiscard]] CertificateStrains strains(const Particles& position) const;
  /// Number of grid line springs whose K'st would be negative and is set to 0.
  [[nodiscard]] int clamped_springs(const Particles& position) const;

  /// Upper bound of the highest squared natural frequency (1/s^2) at these strains.
  [[nodiscard]] double stiffness_bound_per_s2(const CertificateStrains& strains) const;

 private:
  template <class Visitor>
  void visit(const Particles& x, Visitor& visitor) const;
  [[nodiscard]] bool has_next(int particle, int direction) const {
    return direction == 0 ? particle + grid_.cols < grid_.count()
                          : particle % grid_.cols + 1 < grid_.cols;
  }
  [[nodiscard]] bool has_before(int particle, int direction) const {
    return direction == 0 ? particle >= grid_.cols : particle % grid_.cols > 0;
  }

  ParticleGrid grid_;
  ClothLaws laws_;
  Eigen::Vector2d spacing_;
  double stretch_damping_s_, particle_kg_ = 0;
};

/// Self-contact of the cloth (paper section 4.3): particles and triangles of cells, and pairs of
/// edges, without common particles, repel when closer than a thickness, by a spring along the line
/// between their nearest points that carries a particle's weight at 2 um, with a fifth of critical
/// damping. No friction. At 1 m/s layers approach by less than the thickness.
class PaperLayers {
 public:
  /// `thickness_m` 0 disables self-contact.
  PaperLayers(const ParticleGrid& grid, double particle_kg, double gravity_m_per_s2,
              double thickness_m);

  /// Updates the list of pairs if particles have moved so far that others may touch.
  void follow(const Particles& position);
  /// Adds the forces (N) of the listed pairs, including damping if `velocity` (m/s) is given;
  /// returns their energy (J).
  double add_forces(const Particles& position, const Particles* velocity, Particles& force) const;
  [[nodiscard]] double energy_j(const Particles& position) const;
  /// Bound of their contribution to the highest squared frequency (1/s^2).
  [[nodiscard]] double stiffness_bound_per_s2() const;

 private:
  std::vector<LayerFacet> facets_;
  BoxTree tree_;
  Particles listed_;  ///< positions when pairs were listed; empty if not yet
  std::vector<LayerPair> pairs_;
  double thickness_, n_per_m_, damping_n_s_per_m_, per_kg_;
};

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
/// time of impact. Its normal velocity is then set to zero (inelastic), and so is the pressing
/// component of its force, until the force pulls. Coulomb friction sticks or slides. Cloth between
/// particles may enter objects; layers repel each other.
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
