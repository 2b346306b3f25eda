// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "simulate/fabric/laws.hpp"

namespace drape::simulate {

/// A vector at each of n particles: three blocks x, y, z of n values each, so that loops over all
/// particles vectorise.
using Field = std::vector<double>;

/// The vector of particle i.
[[nodiscard]] inline Eigen::Vector3d at(const Field& x, int i) {
  const std::size_t n = x.size() / 3;
  return {x[i], x[n + i], x[2 * n + i]};
}
inline void put_at(Field& x, int i, const Eigen::Vector3d& value) {
  const std::size_t n = x.size() / 3;
  x[i] = value.x();
  x[n + i] = value.y();
  x[2 * n + i] = value.z();
}
inline void add_at(Field& x, int i, const Eigen::Vector3d& value) {
  const std::size_t n = x.size() / 3;
  x[i] += value.x();
  x[n + i] += value.y();
  x[2 * n + i] += value.z();
}

/// Mean distance of the particles of two sheets of one grid.
[[nodiscard]] inline double mean_distance_m(const Field& a, const Field& b) {
  const int n = static_cast<int>(a.size() / 3);
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += (at(a, i) - at(b, i)).norm();
  return sum / n;
}

/// Particle grid on a rectangular patch: rows along the warp, cols along the weft.
struct GridSpec {
  int rows = 0, cols = 0;
  Eigen::Vector2d patch_m = Eigen::Vector2d::Zero();  ///< (warp, weft)
  /// The specimen is the ellipse inscribed in the patch (a disc in a square): only the cells whose
  /// centre lies in it are cloth, and the other particles stand for nothing.
  bool round = false;

  [[nodiscard]] bool has_cell(int row, int col) const {
    if (row < 0 || col < 0 || row + 1 >= rows || col + 1 >= cols) return false;
    const double u = (2.0 * row + 1) / (rows - 1) - 1, v = (2.0 * col + 1) / (cols - 1) - 1;
    return !round || u * u + v * v < 1;
  }
  [[nodiscard]] int cells_at(int row, int col) const {
    return has_cell(row - 1, col - 1) + has_cell(row - 1, col) + has_cell(row, col - 1) +
           has_cell(row, col);
  }
  [[nodiscard]] int count() const { return rows * cols; }
  [[nodiscard]] int index(int row, int col) const { return row * cols + col; }
  [[nodiscard]] double warp_spacing_m() const { return patch_m.x() / (rows - 1); }
  [[nodiscard]] double weft_spacing_m() const { return patch_m.y() / (cols - 1); }
};

/// A place where a line of particles begins at a clamp: `held` stands on the clamp and `next` is
/// free. The sheet leaves along `forward`; `normal` is that of the sheet there. Both are unit.
struct ClampedPlace {
  int held = 0, next = 0;
  int direction = 0;  ///< direction of the line: 0 warp, 1 weft
  Eigen::Vector3d forward, normal;
};

/// Spread of the mass over the particles. `area`: by the cloth each stands for. `paper`: density
/// times area by the number of particles (paper section 4), too heavy on borders.
enum class MassRule { area, paper };

/// `consistent`: energy form, see Cloth. `paper`: springs as the paper prints them (section 4.1).
enum class ClothModel { consistent, paper };

/// The cloth of paper section 4.1 in energy form (model "consistent"): every force is the
/// gradient of an energy per area, so momentum and angular momentum are kept.
/// - Stretch: springs along the grid lines, force = width * f(strain); a border line stands for
///   half a spacing.
/// - Shear: per cell, energy = area * integral of f_sh over the angle between the mid-lines.
/// - Bending: per line triple, energy = width * spacing * integral of M over the curvature
///   |x- - 2 x + x+| / spacing^2 (Bergou et al. 2006); linear in the positions for a linear M.
/// - Twist: per cell, 1/2 J area kappa12^2, kappa12 = (x00 - x10 - x01 + x11) / area; J is
///   Cooper's 4 B45 - Bwarp - Bweft (Cooper 1960), grid lines alone having none.
///
/// Model "paper": grid line springs of secant stiffness K'st = f(strain) / strain - Kdiag, not
/// below 0; diagonals of stiffness Kdiag = f_sh(a) / sin(a), a the cell's shear angle; the same
/// triples; no twist; border lines like inner ones; mass always by MassRule::paper. Forces act
/// along springs, so momentum and angular momentum are kept; Kdiag changes with the angle, so the
/// forces have no exact potential and energies() are those of the springs at their present
/// stiffness.
class Cloth {
 public:
  /// Springs or bending triples along one direction, indexed by particle; width 0: there is none.
  struct Line {
    int stride = 0;                    ///< index step from a particle to the next along the line
    double spacing = 0;                ///< m, at rest
    std::vector<double> width;         ///< m of cloth that spring i -> i + stride stands for
    std::vector<double> triple_width;  ///< m, of the triple i - stride, i, i + stride
    /// Model "paper": what a spring takes of the sum of K_diag of the cells beside it.
    std::vector<double> k_diag_part;
  };

  Cloth(const GridSpec& grid, ClothLaws laws, MassRule mass_rule,
        ClothModel model = ClothModel::consistent);

  [[nodiscard]] const GridSpec& grid() const { return grid_; }
  [[nodiscard]] const ClothLaws& laws() const { return laws_; }
  [[nodiscard]] int count() const { return grid_.count(); }
  [[nodiscard]] const std::vector<double>& mass_kg() const { return mass_; }
  [[nodiscard]] const std::vector<double>& area_m2() const { return area_; }
  [[nodiscard]] double total_mass_kg() const;
  /// The elements, so that a solver can form second derivatives of its own: 0 along the warp, 1
  /// along the weft. With l the spacing, w the width, laws() and ForceCurve::energy(), the energy
  /// is
  ///   spring i: w l tensile.energy(|x[i + stride] - x[i]| / l - 1),
  ///   triple i: w l bending.energy(|x[i - stride] - 2 x[i] + x[i + stride]| / l^2),
  ///   cell i:   A shear.energy(|asin(shear_sine(x, i))|) + twist |x00 - x01 - x10 + x11|^2 / (2
  ///   A),
  /// with A the product of both spacings and corners i, i + 1, i + cols, i + cols + 1.
  [[nodiscard]] const Line& line(int direction) const { return lines_[direction]; }
  [[nodiscard]] bool has_cell(int corner) const { return cell_[corner] != 0; }
  /// Sine of the angle by which a cell's mid-lines depart from a right angle, -1 .. 1.
  [[nodiscard]] double shear_sine(const Field& position, int cell) const;

  /// Puts clamps in: a held particle's triple is replaced by half of one towards each `next`, bent
  /// by the edge y = x[next] - x[held] and its mirror image behind the clamp. With w the width of
  /// the spring, a and b the parts of y along forward and normal, and r = sqrt(a^2 + b^2),
  ///   half triple: w l / 2 bending.energy(2 sqrt(2 r (r - a)) / l^2),
  /// which is 0 only where the sheet leaves forward. So the free length begins at the held
  /// particle.
  void clamp(std::vector<ClampedPlace> places);
  [[nodiscard]] const std::vector<ClampedPlace>& clamped_places() const { return clamped_; }

  /// Internal friction (laws().friction; without it the memory is empty). Forces and energies are
  /// those of a step that began at the last settle(): of elements that have followed a path without
  /// reversal since. A step's energies hold what it has dissipated; settle() takes that out.
  [[nodiscard]] const ClothMemory& memory() const { return memory_; }
  void remember(ClothMemory memory) { memory_ = std::move(memory); }
  /// Ends a step at `position`: elements remember; returns what they dissipated (J).
  double settle(const Field& position);
  [[nodiscard]] double dissipated_j() const { return dissipated_j_; }  ///< by all settle()

  /// Adds internal forces (N); with `velocity` also the damping of the springs.
  void add_forces(const Field& position, const Field* velocity, Field& force);
  [[nodiscard]] InternalEnergies energies(const Field& position) const;

  /// Grid line springs whose K'st would be negative and is 0; none in the model "consistent".
  [[nodiscard]] int clamped_springs(const Field& position) const;

  struct Strains {
    double warp_least = 0, warp_most = 0, weft_least = 0, weft_most = 0;
    double shear_most_rad = 0;
    double curvature_most_per_m = 0;
  };
  [[nodiscard]] Strains strains(const Field& position) const;

  /// Upper bound of the highest natural frequency squared (1/s^2) for strains as given.
  [[nodiscard]] double stiffness_bound_per_s2(const Strains& strains) const;

 private:
  /// Scratch of add_forces(): blocks of one number per particle or per element that begins there,
  /// with zeros before and after, which stand for what is beyond the sheet; and blocks that hold a
  /// band of particles, with the last row of the band before in front.
  struct Work {
    enum Block {
      x = 0,             ///< per axis
      v = 3,             ///< per axis
      width = 6,         ///< per line, of the springs
      triple_width = 8,  ///< per line
      secant = 10,       ///< per line: N/m, of the triples
      cell = 12,         ///< 1 where there is a cell
      twist = 13,        ///< N/m, of the cells
      part = 14,         ///< per line: k_diag_part
      // Friction elements of a cloth, per triple of one direction:
      blocks_without_friction = 16,
      normal = 16,  ///< per axis; then N m, the energy's gradient to the curvature vector
      of_a = 19,
      of_b = 22,              ///< per axis: N, to the differences along the sheet
      per_size = 25,          ///< 1/m^2
      normal_curvature = 26,  ///< 1/m; then N m
      blocks = 27
    };
    enum BandBlock {
      strain = 0,      ///< per line
      inverse = 2,     ///< per line: 1/m, of the springs' lengths
      damping = 4,     ///< per line: N/m, force per width of the springs' damping
      tension = 6,     ///< per line: N/m, force of a spring over its length
      stiff_a = 8,     ///< N/m per cell, between its mid-lines: warp with warp,
      stiff_ab = 9,    ///< warp with weft,
      stiff_b = 10,    ///< weft with weft
      angle = 11,      ///< rad, of the cells' shear
      before = 12,     ///< N along a cell's first edge along the warp
      after = 13,      ///< per axis: N along its second one
      cross = 16,      ///< per axis: N along its edges along the weft
      warp_edge = 19,  ///< per axis: N along the edges of the grid
      weft_edge = 22,  ///< per axis
      k_diag = 25,     ///< per cell, model "paper": N/m
      band_blocks = 26
    };
    static constexpr std::array<int, 13> of_row_before{
        after,         after + 1,     after + 2, cross,         cross + 1,     cross + 2, warp_edge,
        warp_edge + 1, warp_edge + 2, weft_edge, weft_edge + 1, weft_edge + 2, k_diag};
    /// A known distance between the blocks of a band leaves the loops one address to count with.
    /// It is no multiple of 4 KiB, or they would all compete for the same places of the cache.
    static constexpr std::ptrdiff_t band_pad = 408, band_size = 1160;
    struct alignas(64) CacheLine {
      double value[8];
    };
    std::ptrdiff_t pad = 0, size = 0, band = 0;
    std::vector<CacheLine> lines, band_lines;
    [[nodiscard]] double* of(int block) { return lines.front().value + block * size + pad; }
    [[nodiscard]] double* in_band(int block) {
      return band_lines.front().value + block * band_size + band_pad;
    }
  };
  /// Particles, and the springs, triples and cells that begin at them.
  struct Band {
    std::ptrdiff_t begin = 0, end = 0;
  };

  struct Places;
  [[nodiscard]] Places places_of(int direction);
  void find_normal_curvatures(int direction);
  void find_friction_gradients(int direction);
  void sum_friction(int direction, int axis, double* result);
  void add_bending_friction(Field& force);
  void add_shear_friction(Band band, const double* angle, double* f_sh) const;
  void add_friction_energies(const Field& position, InternalEnergies& sum) const;

  void cut_round();
  void add_clamp_forces(const Field& position, Field& force) const;
  void prepare_work();
  void take_positions(const Field& position);
  void keep_last_row(Band band);
  void find_secants(int direction);
  void find_lengths(Band band, bool damped);
  template <bool damped>
  void find_lengths_as(Band band);
  void find_tensions(int direction, Band band);
  void find_shear(Band band);
  void find_diagonals(Band band);
  void take_off_lines(int direction, Band band);
  void pull_cells(int axis, Band band);
  void pull_edges(int axis, Band band);
  void sum_at_particles(int axis, Band band, double* result);

  /// A spring between particles a and b: a diagonal, or the part -Kdiag of a grid line spring.
  struct PaperSpring {
    int a = 0, b = 0;
    double stiffness = 0;  ///< N/m
    double rest = 0;       ///< m
    bool diagonal = false;
    bool clamped = false;
  };
  template <class Visit>
  void visit_paper_springs(const Field& x, Visit visit) const;
  void add_paper_energies(const Field& x, InternalEnergies& sum) const;

  GridSpec grid_;
  ClothLaws laws_;
  ClothModel model_;
  Line lines_[2];
  std::vector<ClampedPlace> clamped_;
  std::vector<double> cell_;  ///< 1 for a cell with lower corner i, 0 where there is none
  std::vector<double> mass_, area_;
  double heaviest_ratio_ = 1;  ///< largest area mass over given mass
  Work work_;
  ClothMemory memory_;
  double dissipated_j_ = 0;
};

}  // namespace drape::simulate
