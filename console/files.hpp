// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <typeindex>
#include <utility>
#include <vector>

#include "console/session.hpp"
#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/program/run_record.hpp"
#include "core/recording.hpp"
#include "core/sheet.hpp"

namespace drape::console {

/// Reason, for people, why a result is superseded; nullopt if it is what its inputs give now.
using Reason = std::optional<std::string>;

/// Detection results for the pictures of one set.
struct SetFacts {
  Json detected;                              ///< counts per camera
  std::map<std::string, std::string> images;  ///< SHA-256 by camera
  std::string verdict, sentence;
};

/// State derived from the files of the programs: what has been taken, measured, simulated and
/// reported, and which of it belongs to the current pictures and inputs. Each file is read once per
/// content. Thread-safe.
class Files {
 public:
  explicit Files(const Session& session) : session_(session) {}

  // ---- paths ---------------------------------------------------------------------------------
  [[nodiscard]] std::filesystem::path calibration_file() const;
  [[nodiscard]] std::filesystem::path report_file() const;
  [[nodiscard]] std::filesystem::path store_file() const;
  [[nodiscard]] std::filesystem::path sheet_file(const std::string& drape) const;
  /// Rig with the sets that were taken, for `drape run`.
  [[nodiscard]] std::filesystem::path rig_file() const;
  /// Part of the rig that a first detection needs.
  [[nodiscard]] std::filesystem::path look_rig_file() const;
  /// The console's own first detection of marks in a set, or of an object's plate.
  [[nodiscard]] std::filesystem::path look_file(const std::string& set) const;
  [[nodiscard]] std::filesystem::path object_look_file(const std::string& drape, int object) const;
  /// The scene with its objects at the positions measured by the first `plates` detections.
  [[nodiscard]] std::filesystem::path scene_look_file(const Drape& drape, std::size_t plates) const;

  // ---- the one table: what is taken, measured, reported, and what of it is superseded -----------
  // True if taken according to the log; otherwise if a run contains the set.
  [[nodiscard]] bool is_taken(const std::string& set) const;
  [[nodiscard]] bool is_left_out(const std::string& set) const;  ///< true if taken but excluded
  [[nodiscard]] std::vector<std::string> taken_target_sets() const;
  [[nodiscard]] bool is_made(const std::filesystem::path& output) const;  ///< whatever its inputs
  /// Checks the record of the output and those of its inputs. For a file of marks with several sets
  /// the check can be restricted to one.
  [[nodiscard]] Reason why_superseded(const std::filesystem::path& output,
                                      const std::string& set = {}) const;
  /// The same for the statements of the last report about a drape.
  [[nodiscard]] Reason why_report_superseded(const Drape& drape) const;

  // ---- contents; null if superseded -------------------------------------------------------------
  [[nodiscard]] std::shared_ptr<const Recording> recording() const;
  [[nodiscard]] std::shared_ptr<const FrameSet> recorded(const std::string& set) const;
  /// Sets replaced by a retake: capture keeps them as <set>.take1, .take2, ...
  [[nodiscard]] std::vector<std::string> earlier_takes(const std::string& set) const;
  [[nodiscard]] std::shared_ptr<const SetFacts> facts(const std::string& set) const;
  [[nodiscard]] std::shared_ptr<const Detections> marks(const std::string& set) const;
  [[nodiscard]] std::shared_ptr<const Calibration> calibration() const;
  [[nodiscard]] std::shared_ptr<const Sheet> sheet(const std::string& drape) const;
  [[nodiscard]] std::shared_ptr<const Sheet> sheet_in(const std::filesystem::path& file) const;
  [[nodiscard]] std::shared_ptr<const RunFile> record_of(const std::filesystem::path& output) const;
  /// The scene with those objects whose plates were measured at their measured positions.
  [[nodiscard]] Scene measured_scene(const Drape& drape) const;
  /// Answer of `drape results`, requested once per content of the store; null without a store.
  [[nodiscard]] Json results(const std::vector<std::string>& words) const;

 private:
  struct Kept {
    std::string stamp;
    std::shared_ptr<const void> content;
    std::uint64_t used = 0;  ///< increases with each use
  };
  /// Contents by file and type of what was read from it.
  using KeptFiles = std::map<std::pair<std::filesystem::path, std::type_index>, Kept>;
  using Facts = std::map<std::string, SetFacts>;  ///< by set

  template <class T>
  [[nodiscard]] std::shared_ptr<const T> kept(KeptFiles& files, const std::filesystem::path& file,
                                              T (*read)(const std::filesystem::path&)) const;
  static Facts read_facts(const std::filesystem::path& file);
  [[nodiscard]] bool holds(const std::filesystem::path& record, const RecordedFile& file) const;
  [[nodiscard]] std::filesystem::path run_marks_file(const std::string& set) const;
  [[nodiscard]] std::filesystem::path marks_file(const std::string& set) const;
  [[nodiscard]] std::string shown(const std::filesystem::path& file) const;
  Reason superseded(const std::filesystem::path& output, const std::string& set,
                    std::set<std::filesystem::path>& seen) const;
  [[nodiscard]] Reason superseded_input(const std::filesystem::path& output,
                                        const RecordedFile& input,
                                        std::set<std::filesystem::path>& seen) const;
  [[nodiscard]] Reason superseded_pictures(const std::filesystem::path& marks,
                                           const std::string& set) const;
  [[nodiscard]] Reason rig_difference(const std::filesystem::path& made) const;

  const Session& session_;
  mutable std::mutex mutex_;    ///< guards all members below
  mutable KeptFiles contents_;  ///< most recently used
  mutable KeptFiles facts_;     ///< small
  mutable std::map<std::string, std::pair<std::string, bool>> holds_;
  mutable std::uint64_t uses_ = 0;
  mutable std::map<std::string, Json> results_;
  mutable std::string results_stamp_;
};

/// Standard deviation of a dot's centre along one axis, as stated by detect (its bound): median
/// over the frame's marks.
[[nodiscard]] std::optional<double> sigma_px(const FrameDetections& frame);

/// Ending of a step, kept beside its output: {"verdict", "sentence", "lines"}; verdict and sentence
/// are empty if absent.
[[nodiscard]] Json ending_of(const std::filesystem::path& output);

/// The last row of a table whose "scene" is this one, or null.
[[nodiscard]] const Json* of_scene(const Json& rows, const std::string& scene);

}  // namespace drape::console
