// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/tables/tables.hpp"
#include "core/calibration.hpp"
#include "core/detections.hpp"

namespace drape::compare {

/// Identity of a recording in the store.
struct RecordingId {
  std::string sha256;                      ///< SHA-256 of recording.json
  std::optional<std::string> recorded_on;  ///< ISO date
  std::string name = {};                   ///< folder of the recording
};

/// A drape with the files beside its measured sheet.
struct DrapeFiles {
  DrapeInput input;
  std::optional<Detections> detections;  ///< detections.json beside the measured sheet
  std::filesystem::path detections_file;
  std::optional<StepRecord> detected_by;
  std::optional<StepRecord> measured_by;
  std::optional<RecordingId> recording;                 ///< from the record of the detections
  std::vector<std::optional<StepRecord>> simulated_by;  ///< in the order of DrapeInput::simulations
  std::optional<SensitivityFile> error_split;           ///< sensitivity.json beside its speaker
  std::optional<StepRecord> split_by;
};

/// Everything read by one call of drape-compare.
struct Session {
  std::vector<DrapeFiles> drapes;
  /// Simulations given before any measured sheet, one group per scene in the order given.
  std::vector<std::vector<Simulation>> virtual_only;
  std::optional<Calibration> calibration;
  std::filesystem::path calibration_file;
  std::string calibration_sha256;
  std::optional<StepRecord> calibrated_by;
  std::vector<std::pair<std::filesystem::path, std::string>> read;  ///< files with their SHA-256
  /// Those that the store does not keep: a sheet's PLY, which contains nothing that its .json does
  /// not, and detections.
  std::set<std::filesystem::path> outside;
  /// Another simulator's meshes, which it keeps, by the file's SHA-256; and by its own the content
  /// that identifies each.
  std::map<std::string, std::filesystem::path> meshes;
  std::map<std::string, std::string> mesh_contents;
  std::vector<std::string> warnings;
};

/// Reads the sheets (each measured one starts a group; simulated ones before any of these are only
/// compared with each other), and beside them detections.json, sensitivity/sensitivity.json,
/// certificate.json, levels.json, the run records and from these the scene, if they exist. A .toml
/// is another simulator's mesh (drape_input.hpp). `calibration_file` can be empty. Throws
/// Error(bad_input) if a sheet was measured with another calibration than the given one, if a
/// measured sheet is given twice, or if a simulation differs from its run record. Each of
/// `repeats`, a measured sheet that states which repeat it is, is added to every drape of its
/// scene.
[[nodiscard]] Session read_session(const std::vector<std::filesystem::path>& sheets,
                                   const std::filesystem::path& calibration_file,
                                   const std::vector<std::filesystem::path>& repeats = {});

/// A sentence for each sheet of one drape whose objects are elsewhere: layings whose marks were
/// measured with another scene than the first one's, and simulations with other objects than that
/// scene's, or with objects for which no record shows that they are the same.
[[nodiscard]] std::vector<std::string> moved_objects(const std::vector<SheetFile>& layings,
                                                     const std::vector<SheetFile>& simulations);

/// The sheets in files and folders. Files are returned as given; a folder is replaced by the sheets
/// in it, in the order required by read_session(): first simulations without a measured sheet (a
/// virtual bench), then each measured sheet with those in the folders `simulations` and `branches`
/// beside it, by name, then those in the list of `ensemble`, as `drape run` compares them. Links
/// are not followed. Throws Error(usage) if there is no sheet at all, and Error(bad_input) for a
/// run record or list whose sheet is missing.
struct GivenFiles {
  std::vector<std::filesystem::path> sheets;
  /// Repeats of those measured sheets that have simulations: from the `repeats` folder beside each.
  std::vector<std::filesystem::path> repeats;
  /// The only calibration.json directly in a given folder; empty if there is none, or more than one
  /// (then only sheets that name the same one could be read).
  std::filesystem::path calibration;
};
[[nodiscard]] GivenFiles files_in(const std::vector<std::filesystem::path>& given);

}  // namespace drape::compare
