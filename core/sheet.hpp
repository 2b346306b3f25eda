// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/fields/records.hpp"
#include "core/marks.hpp"

namespace drape {

/// One point of a sheet: a measured mark or a particle.
struct SheetMark {
  MarkId mark;
  Eigen::Vector2d material_m;                    ///< (warp, weft) from the corner of the patch
  Eigen::Vector3d point_in_world;                ///< metres
  std::optional<Eigen::Matrix3d> covariance_m2;  ///< in measured sheets only
  std::optional<int> views;                      ///< number of cameras that saw it
  std::optional<double> reprojection_px;         ///< RMS over those views
};

/// A mark without a position, with the reason.
struct Gap {
  MarkId mark;
  std::string reason;
};

/// Error budget of a measured sheet: root mean square over its marks of the standard deviation of a
/// mark's position (square root of the covariance's trace), by source. Metres.
struct ErrorBudget {
  double detection_m = 0;               ///< image noise of the marks' centres
  std::optional<double> calibration_m;  ///< error of the calibration; absent if it states none
  double dot_shape_m = 0;               ///< remainder after correcting bent and slanted dots
  double total_m = 0;                   ///< root sum of squares
  /// Part of calibration_m due to the calibration target's own error.
  std::optional<double> target_m = {};
};

/// The scene used when the marks were triangulated; its table and objects explain some gaps.
struct AskedScene {
  std::string name;
  std::string sha256;                               ///< SHA-256 of the scene file
  std::map<std::string, std::string> surroundings;  ///< surroundings_of() of that scene
};

/// Identifies the laying of the drape that a sheet shows, if the rig states it.
struct RepeatId {
  std::string scene;
  std::string name;
  std::string face;  ///< side of the cloth that faces up; empty if not stated
};

/// Origin of a measured sheet.
struct MeasuredSource {
  std::string rig;
  std::string set;
  std::vector<std::string> cameras;
  std::string calibration_sha256;
  std::string detections_sha256;
  std::optional<AskedScene> asked_scene = std::nullopt;
  std::optional<RepeatId> repeat = std::nullopt;
};

/// Origin of a simulated sheet.
struct SimulatedSource {
  std::string scene;
  std::string fabric;
  std::string scene_sha256;
  std::string fabric_sha256;                ///< SHA-256 of the fabric file and its curves together
  std::optional<std::string> start_sha256;  ///< SHA-256 of the measured sheet that placed it
  int segments = 0;                         ///< line segments per Kawabata curve
  std::string model;                        ///< "triangles" or "paper"; "consistent" of older files
  std::string solver = {};                  ///< "fall", "static" or "rk4" of older files
  std::string status = {};                  ///< "at rest", or why not
  /// Spacing of the finest mesh, whose surface the sheet samples on a grid that contains the
  /// print's marks; absent if the sheet's points are the particles of a grid.
  std::optional<double> spacing_m = std::nullopt;
  bool from_measured = false;  ///< started from the measured shape instead of as in the scene
};

/// A cloth in space, measured or simulated: one type with the same indices (paper section 5).
struct Sheet {
  int rows = 0, cols = 0;        ///< size of the grid of marks or particles
  Eigen::Vector2d patch_m;       ///< size along (warp, weft)
  std::vector<SheetMark> marks;  ///< ordered by mark
  std::vector<Gap> gaps;         ///< ordered by mark
  std::variant<MeasuredSource, SimulatedSource> source;
  std::optional<ErrorBudget> error_budget = std::nullopt;  ///< in measured sheets only
  /// Why the measurement that made or positioned the sheet is NO-GO: the first cause. A simulation
  /// that is not at rest states this in its source, not here.
  std::optional<std::string> no_go = std::nullopt;
  Document document = {};  ///< the .json as it was read

  [[nodiscard]] bool is_measured() const { return std::holds_alternative<MeasuredSource>(source); }
  /// Discretisation of a simulated sheet: "2.5 mm" (finest mesh spacing) or "21x21" (its grid).
  [[nodiscard]] std::string discretisation() const;
  /// The mark; null for a gap.
  [[nodiscard]] const SheetMark* find(MarkId mark) const;
};

template <>
inline constexpr Format format_of<Sheet>{
    "sheet", Syntax::json, 1,
    "sheet.json: a cloth as points in space, measured or simulated. The PLY beside it has the same "
    "points."};
void fields(Fields& f, Sheet& sheet);

/// Writes `<stem>.ply` (points and quads for viewers, millimetres) and then `<stem>.json`, the
/// complete sheet. `file` is either of the two.
void write_sheet(const std::filesystem::path& file, const Sheet& sheet);

/// Reads `<stem>.json` and checks that `<stem>.ply` holds the same points.
[[nodiscard]] Sheet read_sheet(const std::filesystem::path& file);

/// Reads the `.json` alone, for callers that need the description but not the verified points.
[[nodiscard]] Sheet read_sheet_record(const std::filesystem::path& file);

}  // namespace drape
