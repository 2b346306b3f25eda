// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "core/marks.hpp"

namespace drape {

/// File name, beside the sheet of the drape that it describes.
inline constexpr const char* kSensitivityName = "sensitivity.json";

/// Displacement of the marks when a value is lowered and raised by `step`, one row per mark.
struct MarkMoves {
  double step = 0;  ///< in per cent for a fabric value, else in the unit of the value's name
  std::optional<double>
      half_width;  ///< half width of a stand-in's interval, which holds the true value; same unit
  Eigen::MatrixX3d down_m, up_m;
};

/// First-order effect on the drape of raising a fabric value by one per cent.
struct ValueEffect {
  std::string value;    ///< e.g. "bending_warp"
  double change_m = 0;  ///< change of the mean distance
  double moved_m = 0;   ///< mean displacement of the marks
  std::optional<MarkMoves> moves = std::nullopt;
};

/// First-order effect on the drape of raising a scene value by one unit.
struct SceneEffect {
  /// Name: "friction", "object_1_x_mm", "object_1_size_mm", "pin_1_x_mm", "clamp_1_x_mm";
  /// "level_x_deg": tilt of the bench about x; "curve_segments": from the fit to twenty per curve
  /// (1); "internal_friction": from off (0) to on (1), or the opposite (-1).
  std::string value;
  std::optional<double> change_m_per_unit = std::nullopt;  ///< change of the mean distance
  std::optional<MarkMoves> moves = std::nullopt;
  std::string absent = {};  ///< why `moves` is absent
};

/// The same drape with one part of the model changed.
struct VariantEffect {
  std::string what;        ///< e.g. "no twist stiffness"
  bool continued = false;  ///< started from the base's equilibrium and so on its branch
  bool at_rest = false;
  double distance_m = 0;  ///< mean over the marks
  double change_m = 0;    ///< change against the base
  double moved_m = 0;     ///< mean displacement of the marks relative to the base
};

/// sensitivity.json: response of a drape (the base) to each value of its fabric and scene.
struct SensitivityFile {
  Document document = {};
  std::optional<double> spacing_m;  ///< spacing of the base's finest mesh
  std::optional<int> rows, cols;    ///< particles of a base simulated on a grid by an older program
  int segments = 0;
  std::string model;
  std::string status = "at rest";  ///< the base: "at rest", or why not
  double distance_m = 0;           ///< mean distance of the base over the marks
  int marks = 0;
  std::vector<MarkId> marks_at;     ///< marks of the rows of each MarkMoves
  std::vector<ValueEffect> values;  ///< empty if the base has no first-order response
  std::vector<SceneEffect> scene;
  std::vector<VariantEffect> variants;
  std::optional<std::string> no_go = std::nullopt;  ///< why the reference or the start is NO-GO
};
template <>
inline constexpr Format format_of<SensitivityFile>{
    "sensitivity", Syntax::json, 1,
    "sensitivity.json: effects of fabric values, scene values and parts of the model on a drape."};

void fields(Fields& f, SensitivityFile& file);
/// Describes the marks of the rows of moves.
void marks_at(Fields& f, std::vector<MarkId>& marks);

}  // namespace drape
