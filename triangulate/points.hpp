// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"

// Measured sheet from the points of another instrument on a cloth.

namespace drape::triangulate {

/// Point with known position in the file and in the world, or on the cloth.
struct NamedPoint {
  std::string name;
  Eigen::Vector3d in_file;  ///< in the file's unit; for a point of the cloth: when flat
  std::optional<Eigen::Vector3d> in_world;
  std::optional<Eigen::Vector2d> at_material_m;  ///< (warp, weft)
  double uncertainty_m = 0.5e-3;                 ///< standard uncertainty along each axis
};

/// Names of the columns of a table, or of the arrays of a VTU; absent: those of DICe or pyALDIC-3D.
struct PointColumns {
  std::string x, y, z;                    ///< position, or position before the displacement
  std::optional<std::string> dx, dy, dz;  ///< displacement from there
  std::optional<std::string> warp, weft;  ///< material coordinates
  std::optional<std::string> sigma;       ///< standard deviation along each axis
  std::optional<std::string> valid;       ///< 0 or below: an invalid point
};

/// points.toml: how to read a file of points, and its relation to world and cloth.
struct PointsDescription {
  std::string instrument = "points";
  double unit_m = 1e-3;           ///< length of one unit of the file
  std::optional<double> sigma_m;  ///< standard deviation of a point along each axis
  double correlation_m = 0;       ///< length over which the correlation of errors falls to 1/e
  std::optional<PointColumns> columns;
  std::vector<NamedPoint> points;
  Document document = {};
};

void fields(Fields& f, NamedPoint& point);

void fields(Fields& f, PointColumns& columns);

void fields(Fields& f, PointsDescription& description);

/// Points of a file in metres, in the frame of the file.
struct Cloud {
  std::string instrument;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> before;      ///< before the displacement; empty: the file has none
  std::vector<Eigen::Vector2d> material_m;  ///< empty if the file has none
  std::vector<double> sigma_m;              ///< empty if the file has none
  int left_out = 0;                         ///< number of points marked as failed by the instrument
};

/// Reads a table (CSV; DICe's text) or a VTK XML file of an unstructured grid (VTU; ASCII, base64
/// or raw, whole or compressed by zlib). Throws Error(bad_input) naming file, line and column.
[[nodiscard]] Cloud read_cloud(const std::filesystem::path& file,
                               const PointsDescription& description);

struct PointsReport {
  std::optional<double> world_rms_m;  ///< residual of the named points; absent without them
  std::optional<double> cloth_rms_m;
  double spacing_m = 0;        ///< between neighbouring points on the cloth
  int direct = 0, fitted = 0;  ///< marks that are points of the file, and marks between them
  double common_part = 0;      ///< fraction of a mark's variance common to all marks
};

/// Makes the sheet of a scene's print. A mark is the point of the file at its material coordinates,
/// else on a quadratic surface through the points around it. Errors of points are correlated as
/// exp(-d / length); their mean over the marks is the common part. The named points align the file
/// with world and cloth by rigid motions (Kabsch 1976). Throws Error(bad_input) without a
/// deviation or the cloth's coordinates (material, or three named points), and for contradictions.
[[nodiscard]] Sheet sheet_of_points(const Cloud& cloud, const PointsDescription& description,
                                    const Scene& scene, PointsReport& report);

}  // namespace drape::triangulate

template <>
inline constexpr drape::Format drape::format_of<drape::triangulate::PointsDescription>{
    "points", drape::Syntax::toml, 1, "points.toml: how points of another instrument are read"};
