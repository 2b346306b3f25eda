// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/certificate.hpp"
#include "simulate/fabric/laws.hpp"

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

}  // namespace drape::simulate
