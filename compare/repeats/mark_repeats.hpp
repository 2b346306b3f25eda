// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "compare/repeats/repeats.hpp"
#include "core/fields/records.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

/// Table and objects of a scene: each value of its file by path ("object.1.x_mm"); a mesh by the
/// SHA-256 of its content.
using Surroundings = std::map<std::string, std::string>;

/// A sheet as read, with the SHA-256 of its .json (which contains everything).
struct SheetFile {
  std::filesystem::path file;
  std::string sha256;      ///< hash of <stem>.json, which identifies the sheet in the store
  std::string ply_sha256;  ///< hash of <stem>.ply
  Sheet sheet;
  std::optional<RepeatId> repeat = {};   ///< absent if it names no laying
  std::optional<AskedScene> asked = {};  ///< absent if its marks were measured without a scene

  /// The scene named in the file; a measured sheet may name none.
  [[nodiscard]] std::string scene() const;
  [[nodiscard]] std::string face() const { return repeat ? repeat->face : std::string(); }
  [[nodiscard]] const MeasuredSource& measured() const {  ///< source; must be a measured sheet
    return std::get<MeasuredSource>(sheet.source);
  }
  [[nodiscard]] bool has_content(const std::string& hash) const {  ///< if either has this hash
    return hash == sha256 || hash == ply_sha256;
  }
};

/// Reads both files of a sheet, given either. Throws Error(bad_input) also if they differ from
/// their run record.
[[nodiscard]] SheetFile read_sheet_file(const std::filesystem::path& file);

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

/// Throws Error(bad_input) naming a file that is not a laying or simulation of the others' drape: a
/// simulation among the repeats, a measured sheet among the virtual ones, another scene, print,
/// calibration or upper face, or a copy of another file. A laying that does not state its drape
/// must be the one that positioned a simulation.
void require_one_drape(const std::vector<SheetFile>& repeats,
                       const std::vector<SheetFile>& virtual_sheets);

/// Reasons, one per sheet, why results based on them are NO-GO: a NO-GO measurement, or a
/// simulation that is not at rest.
[[nodiscard]] std::vector<std::string> no_go_of(const std::vector<SheetFile>& sheets);

/// Pairs of frame sets in which identical layings are searched for.
enum class Among { one_drape, different_drapes };

/// Finds measured sheets that show the same laying in different frame sets, with the reason, by the
/// SHA-256 of both: half of at least ten common marks agree within the 99.5 % quantile of chi
/// square (three degrees of freedom, both covariances). A new laying would differ by millimetres.
[[nodiscard]] std::map<std::string, std::string> layings_twice(
    const std::vector<const SheetFile*>& sheets, Among pairs);

}  // namespace drape::compare

template <>
inline constexpr drape::Format drape::format_of<drape::compare::RepeatsFile>{
    "repeats", drape::Syntax::json, 1,
    "repeats.json: distances of repeated drapes, and which virtual sheets lie inside them."};
