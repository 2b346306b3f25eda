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

/// A sheet as triangles in space.
struct ShadowMesh {
  std::vector<Eigen::Vector3d> points_m;
  std::vector<Eigen::Vector2d> material_m;  ///< empty: not known
  bool own_specimen = false;  ///< a sheet: its file states the specimen, never the disc
  std::vector<std::array<std::size_t, 3>> triangles;
  std::string status;                  ///< simulated: "at rest" or why not; empty: not known
  std::optional<std::string> no_go;    ///< why the measurement that made or placed it is NO-GO
  bool measured = false;               ///< a sheet of marks that cameras saw
  int spanned = 0;                     ///< marks inside the hem that were missing
  std::optional<double> flat_area_m2;  ///< flat specimen, where a file beside it says so
  std::string fabric;                  ///< name in a cusick.json beside it; else empty
  std::optional<double> disc_m, specimen_m;  ///< diameters of its test, where cusick.json has them
};

/// A sheet with its sheet.json (gaps inside the hem are spanned by their neighbours), or any PLY or
/// OBJ in mm with z up; where a cusick.json stands beside it, with the status and specimen that
/// this has for the file. Throws Error(bad_input) naming the file, also of a mesh that the list
/// does not name, and of a sheet whose outermost marks were not all measured.
[[nodiscard]] ShadowMesh read_shadow_mesh(const std::filesystem::path& file);

/// Area of its triangles as they hang.
[[nodiscard]] double surface_m2(const ShadowMesh& mesh);

/// Shadow of light from straight above on the table: the area of the union of all triangles
/// (midpoint rule over 4096 lines, each exact), radii about its centroid. The specimen's flat
/// area where the material is known. Throws Error(bad_input) when it does not go around its centre.
[[nodiscard]] Hem shadow_of(const ShadowMesh& mesh);

}  // namespace drape::compare
