// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "core/simulation_files.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/fabric/laws.hpp"
#include "simulate/objects/cloth_files.hpp"

namespace drape::simulate {

/// A point of the cloth held by a pin.
struct HeldPoint {
  Eigen::Vector2d material_m;            ///< material point (warp, weft)
  std::optional<Eigen::Vector3d> place;  ///< absent if held at its current position
};

/// A triangle mesh claimed to be at rest, as plain numbers. It lies in a scene with objects, pins
/// and clamps, or in a drapemeter. In a drapemeter the middle is held flat between two discs at z =
/// 0, with the warp along x, and no cloth enters the cylinder below the discs.
struct MeshRest {
  ClothShape shape;
  ClothLaws laws;
  ClothMemory memory;  ///< slip of laws.friction: per triangle for bending, per point for shear
  double disc_radius_m = 0;      ///< drapemeter; material coordinates are relative to its centre
  const Scene* scene = nullptr;  ///< objects, table, clamps and friction; null for a drapemeter
  std::vector<HeldPoint> pins;
  /// Contact forces of objects on points of facets (checker/surface.hpp), given by nodes: the
  /// points, then the edge midpoints. Forces between layers are given by the nodes of both.
  std::vector<ContactForce> contact_forces;
  double layers_apart_m = 0;  ///< distance below which layers repel; 0 if they do not
  Eigen::Vector3d gravity_m_per_s2 = {0, 0, -9.80665};
  double residual_tolerance = 0;  ///< claimed residual, in mean weights of a point
  /// Largest credible strains (warp, weft), see strain_limits().
  Eigen::Vector2d most_strain = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  std::vector<Eigen::Vector2d> asked_m = {};  ///< material points whose positions are requested
};

/// Extremes of a mesh's strains: stretch and shear at the points, from the mean metric of the
/// surrounding triangles, and curvature in the triangles.
struct MeshStrains {
  Eigen::Vector2d least = Eigen::Vector2d::Constant(1e9), most = -least;  ///< warp, weft
  double shear_most_rad = 0, curvature_most_per_m = 0;
};

struct MeshJudgement {
  double residual = 0;       ///< largest net force on a free point, in mean weights of a point
  double side_residual = 0;  ///< largest net moment of an edge over the mean edge length, same unit
  double deepest_m = 0;      ///< deepest cloth in objects, or in the cylinder and between the discs
  int crossings = 0;       ///< pairs of an edge and a facet that intersect, without a common corner
  int places_pressed = 0;  ///< number of stated contact forces
  double energy_j = 0;     ///< internal energy
  double hold_error_m = 0;            ///< largest distance of a held point from its target
  std::optional<double> to_object_m;  ///< smallest distance of the surface's nodes
  double to_table_m = 0;              ///< smallest distance of the surface's nodes
  std::optional<double> to_itself_m;  ///< smallest distance of layers that repel each other
  MeshStrains strains;
  std::vector<std::optional<Eigen::Vector3d>> places;  ///< MeshRest::asked_m; absent off cloth
  std::vector<std::string> refusals;                   ///< empty if accepted

  [[nodiscard]] bool accepted() const { return refusals.empty(); }
};

/// Judges a mesh at rest with independent code in long double. Curvature follows from Green's
/// theorem over each triangle's edges, forces from derivatives of the energy by dual numbers.
/// Checks pins and clamps against their targets, friction elements against their limits and contact
/// forces against their friction cones; then the net force on each free point, and penetration of
/// objects or of the cloth itself. Between points the cloth may enter the cylinder by the sagitta
/// of its longest edge, and objects by allowed_between_m().
[[nodiscard]] MeshJudgement judge_mesh(const MeshRest& rest);

/// Stored files of a triangle drape, with the inputs that they refer to.
struct RestFiles {
  Sheet sheet;
  Certificate certificate;
  ClothShape shape;
  ClothMemory memory;  ///< friction state of a cloth with internal friction
  std::vector<ContactForce> contact_forces;
  std::vector<std::filesystem::path> files;
};

/// Reads sheet, certificate, cloth.ply and, if they exist, memory.csv and contact_forces.csv from a
/// folder. Throws Error(bad_input) for a drape of the paper's model, and if the certificate states
/// another number of contact forces.
[[nodiscard]] RestFiles read_rest_files(const std::filesystem::path& folder);

/// Comparison of one value.
struct CertifyLine {
  std::string what;  ///< quantity with unit
  double claimed = 0, found = 0;
  double allowed = 0;  ///< largest difference, or limit of `found` if `is_limit`
  bool is_limit = false;
  [[nodiscard]] bool passes() const;
};

struct CertifyReport {
  std::vector<CertifyLine> lines;
  std::vector<std::string> refusals;  ///< reasons why the drape is not at rest, or not as claimed
  std::vector<std::string> warnings;
  [[nodiscard]] bool accepted() const;
};

/// Largest credible strains (warp, weft): twice the last measured ones. Beyond them most of the
/// thread's curve is extrapolated.
[[nodiscard]] Eigen::Vector2d strain_limits(const Fabric& fabric);

/// Judges stored files: the cloth by judge_mesh() if the certificate claims equilibrium, and
/// whether the certificate's values and the sheet's points match the cloth. `measured` holds pins
/// that state no position; without it, those are held where they are. Velocities are not stored and
/// not judged.
[[nodiscard]] CertifyReport certify(const RestFiles& files, const Scene& scene,
                                    const Fabric& fabric, const Print& print,
                                    const std::optional<Sheet>& measured = std::nullopt);

}  // namespace drape::simulate
