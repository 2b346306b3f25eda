// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/hems/silhouette.hpp"
#include "compare/repeats/repeats.hpp"

namespace drape::compare {

enum class HemKind { unknown, measured, simulated };

/// One hem read from a file, with its metadata.
struct HemRecord {
  std::string file;  ///< file, and row if it holds several
  std::string fabric, sample, face, repeat;
  Hem hem;
  std::vector<HemNumber> numbers;
  std::vector<HemNode> nodes;
  std::string basis;  ///< source of the scale; empty if the input is in millimetres
  std::vector<std::string> warnings;
  bool go = true;                   ///< false for a sheet that is not at rest or depends on a NO-GO
  HemKind kind = HemKind::unknown;  ///< unknown for pictures, tables and meshes
  /// True for a sheet, which has its own flat area instead of the geometry's round specimen.
  bool own_specimen = false;
  double specimen_area_m2 = 0;

  [[nodiscard]] RepeatKey key() const { return {sample, face}; }
  [[nodiscard]] double drape_coefficient() const {
    return number_named(numbers, "drape_coefficient_percent");
  }
};

struct HemReadOptions {
  DrapemeterGeometry geometry = {"iso-300", 0.180, 0.300};
  bool disc_stated = false;      ///< set by the user: a sheet of a bench can hang over any object
  bool specimen_stated = false;  ///< given by the user, since a sheet of a bench can have any shape
  /// Returns the scale of a picture; if unset, pictures are refused.
  std::function<PictureScale(const Silhouette&, const std::filesystem::path&)> scale;
  std::optional<double> scale_u;  ///< relative standard uncertainty, for every input
  /// Pattern of fabric, sample, face and repeat in a file's path (relative to the given folder,
  /// without extension), such as "{fabric}/s{sample}_f{face}_{repeat}"; `*` matches any text. If
  /// empty, the fabric is the file name (the path where names repeat); for a start of an ensemble
  /// (cusick.json) the file name is the repeat.
  std::string names;
  int threads = 1;
};

struct HemSet {
  std::vector<HemRecord> hems;
  std::vector<std::string> refused;           ///< file and reason
  std::vector<std::filesystem::path> inputs;  ///< files that were read
};

/// Reads pictures, sheets and meshes (PLY, OBJ, sheet.json), tables of radii (CSV) and folders of
/// these, in the order given, folders sorted by name. A table has the columns r000 .. in mm, in any
/// order, at equal steps of angle all round, and may have those of hems.csv; it is refused with any
/// other column, without a row, or with another geometry. A file that cannot be read is listed as
/// refused with the reason, not thrown; so is a hem that is impossible for the geometry, a sheet
/// without a stated disc or of another specimen, and the second of two equal hems. Throws
/// Error(usage) if nothing is given.
[[nodiscard]] HemSet read_hems(const std::vector<std::filesystem::path>& inputs,
                               const HemReadOptions& options);

/// Moves virtual hems that are a rotated or mirrored copy of a real one to the refused ones.
void refuse_copies_of(const HemSet& real, HemSet& virtual_hems);

/// Moves measured sheets among the virtual hems, and simulations among the real ones, to the
/// refused ones.
void refuse_other_kinds(HemSet& real, HemSet& virtual_hems);

/// Mean of equivalent drapes with their range: Student's t with n - 1 degrees of freedom, n the
/// drapes of an ensemble or of one sample, otherwise the samples, since drapes of one sample share
/// its deviation.
struct EnsembleBand {
  int drapes = 0, samples = 0;
  double mean = 0;    ///< mean of the samples' means if there are several
  double mean_u = 0;  ///< expanded uncertainty, 95 %
  /// Interval that contains one more drape in 95 of 100 cases; absent if samples have several.
  std::optional<std::pair<double, double>> next;
};
/// Band of the coefficients of valid hems of one fabric and face; nullopt for fewer than two.
[[nodiscard]] std::optional<EnsembleBand> band_of(const std::vector<const HemRecord*>& hems);

/// Comparison of a virtual hem with the repeats of one fabric and face.
struct HemMatch {
  std::string fabric, face, virtual_file;
  int repeats = 0;
  Judgement drape_coefficient, hem;
  std::optional<double> p = {};
  Match verdict = Match::inside;
  std::string reason = {};  ///< why it is undecided, or empty
};

struct MatchOptions {
  double significance = 0.05;
  RepeatPriors priors = published_priors();
  /// The match is undecided if it could miss (10 of 100 cases) a fabric this many points away.
  double worth_finding_percent = 10;
};

/// Compares every virtual hem with every group of a fabric and face; undecided if their specimens
/// differ.
[[nodiscard]] std::vector<HemMatch> match_hems(const std::vector<HemRecord>& real,
                                               const std::vector<HemRecord>& virtual_hems,
                                               const MatchOptions& options);

/// Drapes of a fabric, with the scatter between its samples and between repeats.
struct FabricVariance {
  std::string fabric;
  VarianceComponents found;
};
/// Variances of the drape coefficients, by name of the fabric.
[[nodiscard]] std::vector<FabricVariance> variances_of(const std::vector<HemRecord>& hems);

/// Content of hems.csv, which read_hems() reads: one row per hem with disc_mm, specimen_mm (empty
/// for a sheet), the flat area if measured, the reason for a NO-GO (or empty), its numbers (prefix
/// `u_`: expanded uncertainty) and the radius every 5 degrees.
[[nodiscard]] std::string hems_csv(const DrapemeterGeometry& geometry,
                                   const std::vector<HemRecord>& hems);

/// Content of hems.json.
struct HemsFile {
  DrapemeterGeometry geometry;
  std::vector<HemRecord> hems;
  std::vector<std::string> refused;
  double significance = 0.05;
  std::vector<HemMatch> matches;
};
void fields(Fields& f, HemsFile& file);

}  // namespace drape::compare

template <>
inline constexpr drape::Format drape::format_of<drape::compare::HemsFile>{
    "hems", drape::Syntax::json, 1, "hems.json: hems seen from above, and their repeats."};
