// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/drape/drape.hpp"

/// Closed forms for the mesh cloth: strips and sheets built in memory, held by pins and clamps.
namespace drape::simulate {

inline constexpr double kGravity = 9.80665;             ///< m/s2
inline constexpr double kLength = 0.1;                  ///< m, of strips
inline constexpr double kDensity = 0.15;                ///< kg/m2
inline constexpr double kWeight = kDensity * kGravity;  ///< N/m2

/// A rectangle of cloth; in its flat pose the warp is along -y, the weft along x, and its centre is
/// the origin. SI.
struct FormSheet {
  Eigen::Vector2d size_m;  ///< (warp, weft)
  ClothLaws laws;
  Scene scene;  ///< flat start about the origin, no objects down to 2 m below
  DrapeOptions options;

  /// Linear laws with one bending stiffness, equal in twist; the weight of `kLength` stretches it
  /// by 1e-4. One mesh, without layers, and residuals of 1e-4 weights.
  FormSheet(const Eigen::Vector2d& size_m, double bending_n_m, double spacing_m);

  [[nodiscard]] Eigen::Vector3d flat_place(const Eigen::Vector2d& material_m) const;
  /// Holds the line of the weft at a warp coordinate, with its midpoint at `middle`, horizontal and
  /// along x; the cloth leaves along `direction`.
  void clamp(double warp_m, const Eigen::Vector3d& middle, const Eigen::Vector3d& direction);
  /// Holds it at its flat position.
  void clamp_flat(double warp_m) { clamp(warp_m, flat_place({warp_m, size_m.y() / 2}), -kY); }
  /// Holds both corners at a warp coordinate; for a strip one spacing wide they act as hinges.
  void pin_ends(double warp_m, const Eigen::Vector3d& middle);

  static inline const Eigen::Vector3d kY{0, 1, 0};
};

/// A sheet at rest on one mesh.
struct FormRest {
  std::shared_ptr<const DrapeCase> drape;
  std::unique_ptr<DrapeLevel> level;
  ClothMoment moment;

  [[nodiscard]] Eigen::Vector3d place(double warp_m, double weft_m) const;
  /// Force (N) of the supports on the points at a warp coordinate.
  [[nodiscard]] Eigen::Vector3d reaction_n(double warp_m) const;
};

/// Points of a planar curve by arc length: (along, up).
using FormCurve = std::function<Eigen::Vector2d(double arc_m)>;

/// A sheet on the mesh of its finest spacing, flat or along a curve in the plane of -y and z.
[[nodiscard]] FormRest start_of(const FormSheet& sheet, const FormCurve& curve = {});
/// Lets it fall from there to rest; fails if it does not rest.
[[nodiscard]] FormRest rest_of(const FormSheet& sheet, const FormCurve& curve = {});

/// Expects a value within a relative error `goal` of its closed form; prints both.
void expect_relative(const std::string& what, double exact, double found, double goal);
/// Expects an error below, or an order above, its goal; prints both.
void expect_at_most(const std::string& what, double found, double goal);
void expect_at_least(const std::string& what, double found, double goal);

}  // namespace drape::simulate
