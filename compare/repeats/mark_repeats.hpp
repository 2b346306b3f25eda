// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "compare/repeats/repeats.hpp"
#include "compare/repeats/sheet_file.hpp"
#include "core/fields/records.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

/// One kind of distance between drapes, with the verdict of the repeats on a virtual sheet by it.
struct RepeatBasis {
  std::string what;  ///< "marks", "hem", "spectrum" or "area"
  std::vector<std::vector<double>> real_to_real_m;
  std::vector<double> virtual_to_real_m;
  Judgement judgement;
  std::string reason;        ///< why it cannot be judged, or empty
  VariancePrior prior = {};  ///< from published repeats; none for marks and spectrum
};

struct MarkRepeats {
  int marks = 0;  ///< marks present in every repeat
  /// RMS distance of the marks of two repeats in the world of the bench, without any
  /// alignment.
  std::vector<std::vector<double>> real_to_real_m;
  struct SheetMatch {
    std::string name;
    int marks = 0;                   ///< marks that the virtual sheet has or can interpolate
    std::vector<RepeatBasis> bases;  ///< marks, hem, spectrum and area
    std::optional<double> p;         ///< combined over all that can be judged, see combined_p()
    Match verdict = Match::undecided;
    std::string reason;  ///< why it is undecided, or empty
  };
  std::vector<SheetMatch> matches;
};

/// Number of repeats needed to estimate their scatter.
inline constexpr int kLeastRepeats = 3;

/// Tests whether each virtual sheet could be a repeat of the real drape, by four distances: RMS of
/// the marks, with each virtual mark interpolated at the material point; of the hems (the polygon
/// of the outermost marks, seen from above) after the best rotation; of their Fourier orders 0 to
/// 16, which do not depend on the positions of folds; and of the radii of circles with the hems'
/// areas. Repeats with too few common outermost marks, or whose hem does not surround its centre,
/// are judged by their marks only. With fewer than kLeastRepeats the verdict is undecided. Throws
/// Error(bad_input) if the repeats have no common mark.
[[nodiscard]] MarkRepeats mark_repeats(const std::vector<SheetFile>& repeats,
                                       const std::vector<SheetFile>& virtual_sheets,
                                       double significance);

/// Mean distance of a virtual sheet's marks from the repeats, with all its distances
/// scaled in proportion, up to which it could be one more repeat; nullopt if it cannot be
/// judged.
[[nodiscard]] std::optional<double> limit_m(const MarkRepeats::SheetMatch& match,
                                            double significance);

/// Content of repeats.json.
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
