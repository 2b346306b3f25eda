// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "compare/repeats/hem.hpp"

namespace drape::compare {

/// A sheet as triangles in space, with its metadata.
struct ShadowMesh {
  std::vector<Eigen::Vector3d> points_m;
  std::vector<Eigen::Vector2d> material_m;  ///< empty if unknown
  bool own_specimen = false;  ///< a sheet, whose file states the specimen but never the disc
  std::vector<std::array<std::size_t, 3>> triangles;
  std::string status;                ///< simulation: "at rest" or why not; empty if unknown
  std::optional<std::string> no_go;  ///< why the measurement that made or positioned it is NO-GO
  bool measured = false;             ///< a sheet of measured marks
  int spanned = 0;                   ///< number of missing marks inside the hem that were filled in
  std::optional<double> flat_area_m2;  ///< flat area of the specimen, if a file beside it states it
  std::string fabric;                  ///< name in a cusick.json beside it, or empty
  std::optional<double> disc_m, specimen_m;  ///< diameters of its test, from cusick.json
};

/// Reads a sheet with its sheet.json (gaps inside the hem are filled from their neighbours), or any
/// PLY or OBJ in mm with z up, with status and specimen from a cusick.json beside it. Throws
/// Error(bad_input) naming the file, also for a mesh that the cusick.json does not list, and for a
/// sheet whose outermost marks were not all measured.
[[nodiscard]] ShadowMesh read_shadow_mesh(const std::filesystem::path& file);

/// Area of the triangles in their draped shape.
[[nodiscard]] double surface_m2(const ShadowMesh& mesh);

/// Shadow on the table under light from straight above: area of the union of all triangles
/// (midpoint rule, 4096 lines), radii about its centroid. Includes the specimen's flat area if
/// material coordinates are known. Throws Error(bad_input) if it does not surround its centre.
[[nodiscard]] Hem shadow_of(const ShadowMesh& mesh);

}  // namespace drape::compare
