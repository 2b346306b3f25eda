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
  Eigen::Vector2d material_m;                    ///< (warp, weft) from the patch corner
  Eigen::Vector3d point_in_world;                ///< metres
  std::optional<Eigen::Matrix3d> covariance_m2;  ///< measured sheets only
  std::optional<int> views;                      ///< cameras that saw it
  std::optional<double> reprojection_px;         ///< RMS over those views
};

/// A mark without a position, and why.
struct Gap {
  MarkId mark;
  std::string reason;
};

/// Root mean square over the marks of a measured sheet of the standard deviation of a mark's place
/// in space (square root of its covariance's trace), by what it comes from. Metres.
struct ErrorBudget {
  double detection_m = 0;               ///< noise of the marks' centres in the images
  std::optional<double> calibration_m;  ///< share of the cameras; absent when their file gives none
  double dot_shape_m = 0;               ///< rest of the correction of bent and slanted dots
  double total_m = 0;                   ///< root sum of squares
};

/// The scene that the marks were asked about: its table and objects decide some gaps.
struct AskedScene {
  std::string name;
  std::string sha256;                               ///< SHA-256 of its file
  std::map<std::string, std::string> surroundings;  ///< surroundings_of() of that scene
};

/// Laying of a drape that a sheet shows, where the rig says so.
struct RepeatId {
  std::string scene;
  std::string name;
  std::string face;  ///< side of the cloth that lies up; empty: not stated
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
  /// Spacing of the finest mesh, whose surface the sheet samples on a grid with the print's marks;
  /// absent: the sheet's points are the particles of a grid.
  std::optional<double> spacing_m = std::nullopt;
  bool from_measured = false;  ///< began in the measured shape, not as the scene says
};

/// A cloth in space, real or virtual: one type, indexed alike (paper section 5).
struct Sheet {
  int rows = 0, cols = 0;        ///< size of the grid of marks or particles
  Eigen::Vector2d patch_m;       ///< size along (warp, weft)
  std::vector<SheetMark> marks;  ///< ordered by mark
  std::vector<Gap> gaps;         ///< ordered by mark
  std::variant<MeasuredSource, SimulatedSource> source;
  std::optional<ErrorBudget> error_budget = std::nullopt;  ///< measured sheets only
  /// Why the measurement that made or placed it is NO-GO, in the words of the first cause. A
  /// simulation that does not rest says so in its source, not here.
  std::optional<std::string> no_go = std::nullopt;
  Document document = {};  ///< the .json as it was read

  [[nodiscard]] bool is_measured() const { return std::holds_alternative<MeasuredSource>(source); }
  /// "2.5 mm", the spacing of the finest mesh, or "21x21", the grid, of a simulated sheet.
  [[nodiscard]] std::string discretisation() const;
  /// The mark, or nothing when it is a gap.
  [[nodiscard]] const SheetMark* find(MarkId mark) const;
};

template <>
inline constexpr Format format_of<Sheet>{
    "sheet", Syntax::json, 1,
    "sheet.json: a cloth as points in space, measured or simulated. The PLY beside it has the same "
    "points."};
void fields(Fields& f, Sheet& sheet);

/// Writes `<stem>.ply` (points and quads for viewers, millimetres) and then `<stem>.json`, which
/// carries everything. `file` is either of the two.
void write_sheet(const std::filesystem::path& file, const Sheet& sheet);

/// Reads `<stem>.json` and checks that `<stem>.ply` holds the same points.
[[nodiscard]] Sheet read_sheet(const std::filesystem::path& file);

/// The `.json` alone, for whoever asks what the sheet is and not where its points lie.
[[nodiscard]] Sheet read_sheet_record(const std::filesystem::path& file);

}  // namespace drape
