// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "compare/repeats/repeats.hpp"
#include "compare/repeats/sheet_file.hpp"
#include "core/fields/records.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

/// One kind of distance between drapes, and what the repeats say of a virtual sheet by it.
struct RepeatBasis {
  std::string what;  ///< "marks", "hem", "spectrum" or "area"
  std::vector<std::vector<double>> real_to_real_m;
  std::vector<double> virtual_to_real_m;
  Judgement judgement;
  std::string reason;        ///< why it cannot be judged; else empty
  VariancePrior prior = {};  ///< of published repeats; of marks and spectrum none
};

struct MarkRepeats {
  int marks = 0;  ///< marks that every repeat has
  /// Root mean square distance of the marks of two repeats, in the world of the bench: nothing is
  /// turned or moved.
  std::vector<std::vector<double>> real_to_real_m;
  struct SheetMatch {
    std::string name;
    int marks = 0;                   ///< marks that the virtual sheet has or interpolates
    std::vector<RepeatBasis> bases;  ///< marks, hem, spectrum and area
    std::optional<double> p;         ///< combined over all that could be judged, see combined_p()
    Match verdict = Match::undecided;
    std::string reason;  ///< why it is undecided; else empty
  };
  std::vector<SheetMatch> matches;
};

/// Repeats below which nothing says how far they lie apart.
inline constexpr int kLeastRepeats = 3;

/// Is each virtual sheet inside the repeats of the real one? By four distances: of the marks, root
/// mean square, each virtual one at the mark's material point, bilinear between particles; of the
/// hems (the polygon of the outermost marks, seen from above) after the best turn; of their
/// Fourier orders 0 to 16, which know nothing of where a fold lies; and of the radii of the circles
/// of their area. Repeats with too few outermost marks in common, or whose hem does not go around
/// its centre, are judged by their marks alone. With fewer than kLeastRepeats the verdict is
/// undecided. Throws Error(bad_input) when the repeats have no mark in common.
[[nodiscard]] MarkRepeats mark_repeats(const std::vector<SheetFile>& repeats,
                                       const std::vector<SheetFile>& virtual_sheets,
                                       double significance);

/// Mean distance of a virtual sheet's marks from the repeats, all of its distances being longer or
/// shorter in proportion, up to which it could be one more repeat; absent where it cannot be
/// judged.
[[nodiscard]] std::optional<double> limit_m(const MarkRepeats::SheetMatch& match,
                                            double significance);

/// repeats.json.
struct RepeatsFile {
  double significance = 0.05;
  std::vector<SheetFile> repeats;
  MarkRepeats found;
};
void fields(Fields& f, RepeatsFile& file);

}  // namespace drape::compare

template <>
inline constexpr drape::Format drape::format_of<drape::compare::RepeatsFile>{
    "repeats", drape::Syntax::json, 1,
    "repeats.json: distances of repeated drapes, and which virtual sheets lie inside them."};
