// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "core/marks.hpp"

namespace drape {

/// Beside the sheet of the drape that it speaks of.
inline constexpr const char* kSensitivityName = "sensitivity.json";

/// Displacement of the marks for a value lower and higher by `step`, one row each.
struct MarkMoves {
  double step = 0;  ///< per cent of a fabric value, else as the value is named
  std::optional<double>
      half_width;  ///< half width of a stand-in: the true value lies within, same unit
  Eigen::MatrixX3d down_m, up_m;
};

/// Effect of one per cent more of a fabric value on the drape, to first order.
struct ValueEffect {
  std::string value;    ///< e.g. "bending_warp"
  double change_m = 0;  ///< change of the mean distance
  double moved_m = 0;   ///< mean displacement of the marks
  std::optional<MarkMoves> moves = std::nullopt;
};

/// Effect of one unit more of a scene's value.
struct SceneEffect {
  /// "friction", "object_1_x_mm", "object_1_size_mm", "pin_1_x_mm", "clamp_1_x_mm"; "level_x_deg":
  /// a turn of the bench about x; "curve_segments" (of the fabric): 1 with twenty per curve;
  /// "internal_friction" (of the fabric): 0 without, 1 with, -1 as far in the other direction
  std::string value;
  std::optional<double> change_m_per_unit = std::nullopt;  ///< change of the mean distance
  std::optional<MarkMoves> moves = std::nullopt;
  std::string absent = {};  ///< why there are no moves
};

/// The same drape with one part of the model changed.
struct VariantEffect {
  std::string what;        ///< e.g. "no twist stiffness"
  bool continued = false;  ///< from the base's rest, so on its branch; else from the start
  bool at_rest = false;
  double distance_m = 0;  ///< mean over the marks
  double change_m = 0;    ///< against the base
  double moved_m = 0;     ///< mean displacement of the marks from the base
};

/// sensitivity.json: the answer of a drape, the base, to each value of its fabric and its scene.
struct SensitivityFile {
  Document document = {};
  std::optional<double> spacing_m;  ///< finest mesh of the base
  std::optional<int> rows, cols;    ///< particles of a base on a grid, of older programs
  int segments = 0;
  std::string model;
  std::string status = "at rest";  ///< the base: "at rest", or why not
  double distance_m = 0;           ///< distance of the base, mean over the marks
  int marks = 0;
  std::vector<MarkId> marks_at;     ///< rows of the moves
  std::vector<ValueEffect> values;  ///< empty when the base has no first-order answer
  std::vector<SceneEffect> scene;
  std::vector<VariantEffect> variants;
  std::optional<std::string> no_go = std::nullopt;  ///< cause of the reference's or start's NO-GO
};
template <>
inline constexpr Format format_of<SensitivityFile>{
    "sensitivity", Syntax::json, 1,
    "sensitivity.json: what values of fabric and scene and parts of the model move."};

void fields(Fields& f, SensitivityFile& file);

}  // namespace drape
