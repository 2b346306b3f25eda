// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compare/records/provenance.hpp"
#include "compare/tables/tables.hpp"
#include "core/fields/records.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

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

/// Effect of one unit more of a scene's value: friction, or mm of an object's place or size.
struct SceneEffect {
  std::string value;             ///< "friction", "object_1_x_mm", "object_1_size_mm"
  double change_m_per_unit = 0;  ///< change of the mean distance
  std::optional<MarkMoves> moves = std::nullopt;
};

/// The same drape with one part of the model changed.
struct VariantEffect {
  std::string what;        ///< e.g. "mass rule paper"
  bool continued = false;  ///< from the base's equilibrium, so on its branch; else from the start
  bool at_rest = false;
  double distance_m = 0;  ///< mean over the marks
  double change_m = 0;    ///< against the base
  double moved_m = 0;     ///< mean displacement of the marks from the base
  int folds = 0;          ///< folds of the hem
};

/// Result of `drape simulate sensitivity`: where a drape's millimetres come from.
struct ErrorSplitFile {
  Document document;
  int rows = 0, cols = 0, segments = 0;  ///< size of the base; 0 in files of older programs
  std::string model;
  double distance_m = 0;  ///< distance of the base, mean over the marks
  int marks = 0;
  std::vector<MarkId> marks_at;     ///< rows of the moves
  std::vector<ValueEffect> values;  ///< empty when the base has no first-order answer
  std::vector<SceneEffect> scene;
  std::vector<VariantEffect> variants;
  std::optional<std::string> no_go = std::nullopt;  ///< cause of the reference's or start's NO-GO
};

}  // namespace drape::compare

template <>
inline constexpr drape::Format drape::format_of<drape::compare::ErrorSplitFile>{
    "sensitivity", Syntax::json, 1, "what values of fabric and scene and parts of the model move"};

namespace drape::compare {

/// Which of these a run with such inputs was not made from, in a sentence, if any: the drape's
/// measured sheet, scene and fabric of the simulation that speaks for it.
[[nodiscard]] std::optional<std::string> other_origin(const HashedFiles& inputs,
                                                      const DrapeInput& drape);

/// Why the base is none of the drape's simulations, in a sentence, if so.
[[nodiscard]] std::optional<std::string> other_base(const ErrorSplitFile& split,
                                                    const DrapeInput& drape);

void fields(Fields& f, ErrorSplitFile& split);

/// Fabric values, the greatest change first.
[[nodiscard]] Table value_effect_table(const ErrorSplitFile& split);
/// Changed models in the order of the file; the greatest change among those at rest is marked.
[[nodiscard]] Table variant_effect_table(const ErrorSplitFile& split);
/// Which change moves the mean distance most: one sentence without a full stop; empty when nothing
/// was changed.
[[nodiscard]] std::string error_split_sentence(const ErrorSplitFile& split);

}  // namespace drape::compare
