// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "compare/hems/silhouette.hpp"
#include "compare/repeats/hem.hpp"
#include "compare/repeats/repeats.hpp"
#include "core/fields/records.hpp"

namespace drape::compare {

enum class HemKind { unknown, measured, simulated };

/// One hem that was read, and what it says.
struct HemRecord {
  std::string file;  ///< and the row, where a file holds many
  std::string fabric, sample, face, repeat;
  Hem hem;
  std::vector<HemNumber> numbers;
  std::vector<HemNode> nodes;
  std::string basis;  ///< origin of the scale; empty: the input is in millimetres
  std::vector<std::string> warnings;
  bool go = true;                   ///< false for a sheet that is not at rest or rests on a NO-GO
  HemKind kind = HemKind::unknown;  ///< pictures, tables and meshes do not say
  /// True of a sheet, which is no round specimen of the geometry: its own flat area.
  bool own_specimen = false;
  double specimen_area_m2 = 0;

  [[nodiscard]] RepeatKey key() const { return {sample, face}; }
  [[nodiscard]] double drape_coefficient() const {
    return number_named(numbers, "drape_coefficient_percent");
  }
};

struct HemReadOptions {
  DrapemeterGeometry geometry = {"iso-300", 0.180, 0.300};
  bool disc_stated = false;      ///< by the user: a sheet of a bench hangs over any object
  bool specimen_stated = false;  ///< by the user: a sheet of a bench is cut as it is
  /// Scale of a picture; unset: pictures are refused.
  std::function<PictureScale(const Silhouette&, const std::filesystem::path&)> scale;
  std::optional<double> scale_u;  ///< relative standard uncertainty; of every input
  /// Pattern of fabric, sample, face and repeat in a file's path (below the folder that was given,
  /// without ending), such as "{fabric}/s{sample}_f{face}_{repeat}"; `*` is any text. Empty: only
  /// the file's name is kept (where two have one name: the path), as the fabric; of a start of an
  /// ensemble (cusick.json) as its repeat.
  std::string names;
  int threads = 1;
};

struct HemSet {
  std::vector<HemRecord> hems;
  std::vector<std::string> refused;           ///< file and reason
  std::vector<std::filesystem::path> inputs;  ///< files that were read
};

/// Pictures, sheets and meshes (PLY, OBJ, sheet.json), tables of radii (CSV) and folders of all of
/// these, in the order given, folders by name. A table has the columns r000 .. in mm, in any order,
/// one per equal step of angle all round, and may have those of hems.csv; it is refused with any
/// other column, without a row, and when its geometry is another. A file that cannot be read is
/// refused with its reason, not thrown, and so are a hem that no drape of the geometry can have, a
/// sheet without a stated disc or of another specimen than is stated, and the second of two equal
/// hems. Throws Error(usage) when nothing is named.
[[nodiscard]] HemSet read_hems(const std::vector<std::filesystem::path>& inputs,
                               const HemReadOptions& options);

/// A copy of a real hem, turned or mirrored, is no virtual one: moves such to what is refused.
void refuse_copies_of(const HemSet& real, HemSet& virtual_hems);

/// Moves measured sheets among the virtual hems, and simulations among the real ones, to what
/// is refused.
void refuse_other_kinds(HemSet& real, HemSet& virtual_hems);

/// Mean of drapes that are alike, and where they lie: t of n - 1 degrees of freedom, n the drapes
/// of an ensemble or of one sample, else the samples, whose own difference the drapes of one have
/// in common.
struct EnsembleBand {
  int drapes = 0, samples = 0;
  double mean = 0;    ///< mean of the samples' means where there are several
  double mean_u = 0;  ///< expanded, 95 %
  /// One more drape lies between them in 95 of 100 cases; absent where samples have several drapes.
  std::optional<std::pair<double, double>> next;
};
/// Band of the coefficients of the hems of one fabric and face that rest; nothing below two.
[[nodiscard]] std::optional<EnsembleBand> band_of(const std::vector<const HemRecord*>& hems);

/// A virtual hem beside the repeats of one fabric and face.
struct HemMatch {
  std::string fabric, face, virtual_file;
  int repeats = 0;
  Judgement drape_coefficient, hem;
  std::optional<double> p;
  Match verdict = Match::inside;
  std::string reason;  ///< why it is undecided; else empty
};

struct MatchOptions {
  double significance = 0.05;
  RepeatPriors priors = published_priors();
  /// A match that could not tell a fabric this many points away (in 90 of 100 cases) is undecided.
  double worth_finding_percent = 10;
};

/// Every virtual hem against every group of a fabric and a face; undecided where their specimens
/// differ.
[[nodiscard]] std::vector<HemMatch> match_hems(const std::vector<HemRecord>& real,
                                               const std::vector<HemRecord>& virtual_hems,
                                               const MatchOptions& options);

/// hems.csv: a row per hem, which is an input again: its test (disc_mm, specimen_mm but of a sheet,
/// the specimen's flat area where that is known better), why it is NO-GO (else empty), its numbers;
/// `u_` before a name is its expanded uncertainty.
[[nodiscard]] std::string hems_csv(const DrapemeterGeometry& geometry,
                                   const std::vector<HemRecord>& hems);

/// hems.json.
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
