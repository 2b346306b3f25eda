// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compare/compare.hpp"
#include "compare/records/provenance.hpp"
#include "compare/store/store.hpp"
#include "compare/tables/error_split.hpp"
#include "core/calibration.hpp"
#include "core/detections.hpp"

namespace drape::compare {

/// A drape with the files that lie beside its measured sheet.
struct DrapeFiles {
  DrapeInput input;
  std::optional<Detections> detections;  ///< detections.json beside the measured sheet
  std::filesystem::path detections_file;
  std::optional<StepRecord> detected_by;
  std::optional<StepRecord> measured_by;
  std::optional<RecordingId> recording;                 ///< through the record of the detections
  std::vector<std::optional<StepRecord>> simulated_by;  ///< index in DrapeInput::simulations
  std::optional<SensitivityFile> error_split;           ///< sensitivity.json beside its speaker
  std::optional<StepRecord> split_by;
};

/// All that one call of drape-compare reads.
struct Session {
  std::vector<DrapeFiles> drapes;
  /// Simulations given before any measured sheet, one group per scene in the order given.
  std::vector<std::vector<Simulation>> virtual_only;
  std::optional<Calibration> calibration;
  std::filesystem::path calibration_file;
  std::string calibration_sha256;
  std::optional<StepRecord> calibrated_by;
  std::vector<std::pair<std::filesystem::path, std::string>> read;  ///< file and SHA-256
  std::vector<std::string> warnings;
};

/// Reads the sheets (each measured one opens a group; simulated ones before any of these are only
/// compared with each other), and beside them detections.json, sensitivity/sensitivity.json,
/// certificate.json, levels.json, the run records and through these the scene, where
/// they exist. A .toml is another simulator's mesh (other_mesh.hpp). `calibration_file` may be
/// empty. Throws Error(bad_input) when a sheet was measured with another calibration than the one
/// given, or when a measured sheet is given twice, or a simulation is not what its run record says.
/// Each of `repeats`, a measured sheet that says which repeat it is, joins every drape of its
/// scene.
[[nodiscard]] Session read_session(const std::vector<std::filesystem::path>& sheets,
                                   const std::filesystem::path& calibration_file,
                                   const std::vector<std::filesystem::path>& repeats = {});

/// Fills the scene of each simulation and that of the drape, whose simulations are all known: the
/// speaker's, else the one that the marks were held against; files that are as they were. Throws
/// Error for a scene that cannot be read.
void find_scenes(DrapeFiles& drape, Session& session);

/// Why sheets of one drape lie over objects at other places, a sentence for each that does: layings
/// whose marks were asked about another scene than the first one's, and simulations over other
/// objects than that scene's, or over objects of which no record says whether they are the same.
[[nodiscard]] std::vector<std::string> moved_objects(const std::vector<SheetFile>& layings,
                                                     const std::vector<SheetFile>& simulations);

/// Fills the ensemble of the drape's speaking branch, where its maker read the measured sheet as it
/// is now: it placed that sheet among the branches. Throws Error for a list that cannot be read.
void find_ensemble(DrapeFiles& drape);

/// Reads certificate.json of any version. Any entry may be absent.
[[nodiscard]] Certificate read_certificate(const std::filesystem::path& file);

/// Throws Error(bad_input) naming the entry where a certificate contradicts the simulated sheet
/// that it lies beside: a run that was killed leaves that of the run before.
void require_of_sheet(const Certificate& certificate, const Sheet& sheet,
                      const std::filesystem::path& file);

/// Files stay as they are given; a folder becomes the sheets below it, in the order that
/// read_session() wants: first the simulations that stand alone (a virtual bench), then each
/// measured sheet with what lies in the folders `simulations` and `branches` beside it, by name,
/// then what the list of `ensemble` names, as `drape run` compares them. Links are
/// not followed. Throws Error(usage) when there is no sheet at all, and Error(bad_input) for a run
/// record or list whose sheet is gone.
[[nodiscard]] std::vector<std::filesystem::path> sheets_in(
    const std::vector<std::filesystem::path>& given);

/// The repeats of those measured sheets that have simulations: the `repeats` folder beside each.
[[nodiscard]] std::vector<std::filesystem::path> repeats_in(
    const std::vector<std::filesystem::path>& given);

/// The one calibration.json that lies in a given folder itself; empty when there is none, or more
/// than one (then only sheets that name the same one could be read).
[[nodiscard]] std::filesystem::path calibration_in(const std::vector<std::filesystem::path>& given);

}  // namespace drape::compare
