// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.hpp"

namespace drape::simulate {

/// A fabric built from external data, not yet written.
struct ImportedFabric {
  std::string toml;                                         ///< text of fabric.toml
  std::vector<std::pair<std::string, std::string>> curves;  ///< name beside it, text of the CSV
  std::vector<std::string> stand_ins;                       ///< quantities missing in the source
  std::string unused;  ///< unused rows of the source, as a list
  /// Source location of each key of fabric.toml, line of a curve ("tensile_warp.csv:4") or whole
  /// curve.
  std::map<std::string, Where> from;
};

/// Imports a result sheet of the KES-FB machines or the FAST instruments: a CSV with the columns
/// property,unit,warp,weft and one row per property. Values of the whole cloth stand under warp or
/// weft. Units are read and converted. Throws for a missing or unknown unit, two values of the
/// whole cloth, and values outside the range of textiles. KES: W, T, LT, WT, RT, EMT, G, 2HG, 2HG5,
/// B, 2HB and B45 (bias). FAST: W, C and C45 (bending length), E5, E20, E100, EB5; B = W C^3, G =
/// 4.9 N/m / (4 EB5) (De Boos and Tester 1994). Other rows of the sixteen KES values and of the
/// FAST chart are accepted and listed in `unused`.
[[nodiscard]] ImportedFabric import_kes(const std::filesystem::path& file, const std::string& name);
[[nodiscard]] ImportedFabric import_fast(const std::filesystem::path& file,
                                         const std::string& name);

/// Imports the physics of a U3M 1.1 material (its JSON): mass and bend of the section `custom`. The
/// schema states no units: mass is taken as g/m2, the unit of bend must be given. The tensile
/// curves come from the raw stretch at 8 cm of Browzwear's FAB (`raw_data`, L: warp, W: weft).
[[nodiscard]] ImportedFabric import_u3m(const std::filesystem::path& file, const std::string& name,
                                        const std::string& bend_unit);

/// Writes fabric.toml and its curves into a new folder and reads them back. If a value is
/// impossible for textiles, throws with the likely mistake and its location in the source, and
/// removes the folder. Returns warnings about unusual values. `record` gets the folder under its
/// temporary name and the warnings, and may add a record to the files.
std::vector<std::string> write_imported(
    const std::filesystem::path& folder, const ImportedFabric& fabric,
    const std::function<void(const std::filesystem::path&, const std::vector<std::string>&)>&
        record = {});

/// A fabric of the library (rigs/fabrics/published.csv). Values are absent if not published.
struct PublishedFabric {
  std::string id, name, weave, source, note;
  std::optional<double> areal_density_g_per_m2, thickness_mm;
  /// Without a weft value, the warp value is the only one published.
  std::optional<double> b_warp_gf_cm2_per_cm, b_weft_gf_cm2_per_cm, b_bias_gf_cm2_per_cm;
  std::optional<double> hb2_gf_cm_per_cm;
  std::optional<double> drape_coefficient_percent, nodes, disc_mm, specimen_mm;
};
[[nodiscard]] std::vector<PublishedFabric> read_published(const std::filesystem::path& file);
[[nodiscard]] const PublishedFabric& published_fabric(const std::vector<PublishedFabric>& library,
                                                      const std::string& id);
/// Throws Error(bad_input) for a fabric without areal density or bending rigidity.
[[nodiscard]] ImportedFabric import_published(const PublishedFabric& fabric);

}  // namespace drape::simulate
