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
  [[nodiscard]] fs::path calibration_file() const { return session_.out / "calibration.json"; }
  [[nodiscard]] fs::path report_file() const { return session_.out / "report.html"; }
  [[nodiscard]] fs::path store_file() const { return session_.out / "results.sqlite"; }
  [[nodiscard]] fs::path sheet_file(const std::string& drape) const {
    return session_.out / drape / "sheet.json";
  }
  /// Rig with the sets that were taken, for `drape run`.
  [[nodiscard]] fs::path rig_file() const { return session_.own / "rig.toml"; }
  /// Part of the rig that a first detection needs.
  [[nodiscard]] fs::path look_rig_file() const { return session_.own / "look.toml"; }
  /// The console's own first detection of marks in a set, or of an object's plate.
  [[nodiscard]] fs::path look_file(const std::string& set) const {
    return session_.own / "detections" / (set + ".json");
  }
  [[nodiscard]] fs::path object_look_file(const std::string& drape, int object) const {
    return session_.own / drape / ("object_" + std::to_string(object) + ".json");
  }
  /// The scene with its objects at the positions measured by the first `plates` detections.
  [[nodiscard]] fs::path scene_look_file(const Drape& drape, std::size_t plates) const {
    return plates == 0
               ? drape.scene.file
               : session_.own / drape.scene.name / ("scene_" + std::to_string(plates) + ".toml");
  }

  // ---- the one table: what is taken, measured, reported, and what of it is superseded -----------
  // True if taken according to the log; otherwise if a run contains the set.
  [[nodiscard]] bool is_taken(const std::string& set) const;
  [[nodiscard]] bool is_left_out(const std::string& set) const;  ///< true if taken but excluded
  [[nodiscard]] std::vector<std::string> taken_target_sets() const;
  [[nodiscard]] bool is_made(const fs::path& output) const;  ///< whatever its inputs
  /// Checks the record of the output and those of its inputs. For a file of marks with several sets
  /// the check can be restricted to one.
  [[nodiscard]] Reason why_superseded(const fs::path& output, const std::string& set = {}) const;
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
  [[nodiscard]] std::shared_ptr<const Sheet> sheet_in(const fs::path& file) const;
  [[nodiscard]] std::shared_ptr<const RunFile> record_of(const fs::path& output) const;
  /// The scene with those objects whose plates were measured at their measured positions.
  [[nodiscard]] Scene measured_scene(const Drape& drape) const;
  /// Answer of `drape results`, requested once per content of the store; null without a store.
  [[nodiscard]] Json results(const std::vector<std::string>& words) const;

 private:
  struct Kept {
    std::string stamp;
    std::shared_ptr<const void> content;
  };
  /// Contents by file and type of what was read from it.
  using KeptFiles = std::map<std::pair<fs::path, std::type_index>, Kept>;
  using Facts = std::map<std::string, SetFacts>;  ///< by set

  template <class T>
  [[nodiscard]] std::shared_ptr<const T> kept(KeptFiles& files, const fs::path& file,
                                              T (*read)(const fs::path&)) const;
  static Facts read_facts(const fs::path& file);
  [[nodiscard]] bool holds(const fs::path& record, const RecordedFile& file) const;
  [[nodiscard]] fs::path run_marks_file(const std::string& set) const;
  [[nodiscard]] fs::path marks_file(const std::string& set) const;
  [[nodiscard]] std::string shown(const fs::path& file) const;
  Reason superseded(const fs::path& output, const std::string& set, std::set<fs::path>& seen) const;
  [[nodiscard]] Reason superseded_input(const fs::path& output, const RecordedFile& input,
                                        std::set<fs::path>& seen) const;
  [[nodiscard]] Reason superseded_pictures(const fs::path& marks, const std::string& set) const;
  [[nodiscard]] Reason rig_difference(const fs::path& made) const;

  const Session& session_;
  mutable std::mutex mutex_;    ///< guards all members below
  mutable KeptFiles contents_;  ///< at most kMostKept
  mutable KeptFiles facts_;     ///< small
  mutable std::map<std::string, std::pair<std::string, bool>> holds_;
  mutable std::map<std::string, Json> results_;
  mutable std::string results_stamp_;
};

/// Standard deviation of a dot's centre along one axis, as stated by detect (its bound): median
/// over the frame's marks.
[[nodiscard]] std::optional<double> sigma_px(const FrameDetections& frame);

/// Ending of a step, kept beside its output; verdict and sentence are empty if absent.
[[nodiscard]] Json ending_of(const fs::path& output);

/// The last row of a table whose "scene" is this one, or null.
[[nodiscard]] const Json* of_scene(const Json& rows, const std::string& scene);

}  // namespace drape::console
