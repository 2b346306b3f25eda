// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <typeindex>
#include <utility>
#include <vector>

#include "console/coach/coach.hpp"
#include "console/console.hpp"
#include "console/tasks/capture_session.hpp"
#include "console/tasks/jobs.hpp"
#include "console/tasks/live_marks.hpp"
#include "console/tasks/pictures.hpp"
#include "console/tasks/session_log.hpp"
#include "console/tasks/still_watch.hpp"
#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/recording.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"

namespace drape::console {

/// Called with the name and the JSON of an event.
using Tell = std::function<void(const std::string& name, const Json& data)>;

/// State and acts of the pages, without HTTP: the rig, what was taken, what the programs made of
/// it. Safe from several threads. Throws Error(bad_input) for names that the rig does not have.
class Bench {
 public:
  Bench(const ConsoleOptions& options, Tell tell);
  ~Bench();
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  // ---- views (bench_views.cpp) ---------------------------------------------------------------
  [[nodiscard]] Json state() const;
  [[nodiscard]] Json marks(const std::string& set) const;  ///< centres in each camera's image
  [[nodiscard]] Json coverage() const;  ///< marks of all calibrating sets, and in space
  [[nodiscard]] Json coach() const;     ///< the next pose
  [[nodiscard]] Json frame_facts(const std::string& set) const;  ///< saturation, sigma of a dot
  [[nodiscard]] Json sheet(const std::string& drape) const;
  [[nodiscard]] Json history() const;
  [[nodiscard]] Json difference(const std::string& run_a, const std::string& run_b) const;
  [[nodiscard]] Picture picture(const std::string& set, const std::string& camera, int width_px,
                                bool mark_saturation) const;
  [[nodiscard]] std::filesystem::path report() const { return out_ / "report.html"; }

  struct LivePicture {
    std::uint64_t number = 0;
    int width_px = 0;
    bool mark_saturation = false;
    std::string jpeg, facts;  ///< facts: JSON in ASCII, as `drape capture --preview` writes them
  };
  /// Newest picture of a live camera; nothing before its first picture.
  [[nodiscard]] std::optional<LivePicture> live_picture(const std::string& camera, int width_px,
                                                        bool mark_saturation) const;

  /// Marks in the live pictures, as marks() gives those of a set, with their counts: of the target
  /// or of the cloth.
  [[nodiscard]] Json live_marks(bool of_cloth) const;

  // ---- acts ----------------------------------------------------------------------------------
  /// {"do": "take", "set": "pose_00"} and so on; see README.
  void act(const Json& request);

 private:
  struct Drape {
    Scene scene;
    Print print;
  };
  /// One laying of a drape's cloth; the first one's set is the scene's.
  struct Laying {
    std::string drape, set, repeat, face;
    bool named = false;  ///< in rig.toml, or by the operator
  };
  struct KeptFile {
    std::string stamp;
    std::shared_ptr<const void> content;
    std::uint64_t used = 0;  ///< the larger, the later
  };
  /// By file, and what was read from it.
  using KeptFiles = std::map<std::pair<std::filesystem::path, std::type_index>, KeptFile>;
  /// SHA-256 of each input as it was read, by its name.
  using Inputs = std::map<std::filesystem::path, std::string>;
  /// SHA-256 of the images of a set by camera.
  using Images = std::map<std::string, std::string>;
  /// Summary of a set's detections for the pages; it stays small, whatever was detected.
  struct SetFacts {
    Json detected;
    std::string verdict, sentence;
    std::map<std::string, Images> images;  ///< in which the marks of each set were measured
    std::map<std::string, std::string> no_go = {};
  };
  /// Files that one measured sheet rests on: the console's own, or those of `drape run`.
  struct Chain {
    struct Object {
      std::filesystem::path file, marks;
      std::string set;
    };
    std::string set;  ///< set of the cloth
    std::filesystem::path target_marks, calibration, marks, sheet;
    std::vector<Object> objects;  ///< by their plates
  };
  [[nodiscard]] bool is_target_set(const std::string& set) const;
  [[nodiscard]] bool is_stage(const std::string& set) const;
  [[nodiscard]] std::vector<std::string> target_sets() const;  ///< stages, then free poses
  [[nodiscard]] std::vector<std::string> taken_target_sets() const;
  [[nodiscard]] const Drape& drape(const std::string& name) const;
  [[nodiscard]] const ObjectTags* plate_of(const std::string& set) const;
  [[nodiscard]] std::vector<Laying> layings(const std::string& drape = {}) const;
  [[nodiscard]] std::string drape_of(const std::string& set) const;  ///< empty: of the target
  [[nodiscard]] std::vector<std::string> sets_of(const Drape& drape) const;
  [[nodiscard]] std::vector<std::string> earlier_takes(const std::string& set) const;
  [[nodiscard]] bool is_taken(const std::string& set) const;
  [[nodiscard]] bool is_left_out(const std::string& set) const;  ///< it was taken
  void read_layings();
  void require_set(const std::string& set) const;

  void take(const std::string& set);
  void lay(const std::string& drape);  ///< the same cloth once more
  void name_face(const std::string& set, const std::string& face);
  void set_light(const Json& request);
  void taken(const std::string& set);  ///< it is stored
  void take_live(const std::string& set);
  void open_cameras();
  void close_cameras();
  void ask_doctor();
  void heard(const std::string& line);               ///< a line of the capture session
  [[nodiscard]] std::string next_free_pose() const;  ///< empty: none is left
  [[nodiscard]] bool is_automatic() const;
  void automatic(bool on);
  void end_automatic(const std::string& words, bool good);
  [[nodiscard]] std::map<std::string, std::string> newest_pictures() const;
  void look(const std::string& camera);  ///< a picture of it is there
  [[nodiscard]] Json still_json() const;
  void looked_at(const std::string& set);  ///< its marks are measured
  void calibrated();
  void drop(const std::string& set);
  [[nodiscard]] bool can_calibrate() const;
  void calibrate();
  void measure(const std::string& drape);
  void show_object(const std::string& set);
  static void require_short_text(const std::string& text);
  void run();
  void note(const std::string& text);
  void name_operator(const std::string& name);
  void read_log();

  // ---- jobs (bench_jobs.cpp) -----------------------------------------------------------------
  void detect(const std::string& set);
  void detect_what_lacks();
  void require_not_being_taken(const std::vector<std::string>& sets) const;
  /// Logs what was pressed, so that a server that ends before it is done leaves it named.
  void ask(const std::string& pressed, const std::string& kind, const std::string& what,
           std::vector<Call> calls);
  void job_changed(const Job& job);
  void job_ended(const Job& job);
  void log_held_out(const std::string& set);

  // ---- files (bench_files.cpp) ---------------------------------------------------------------
  [[nodiscard]] std::filesystem::path detections_file(const std::string& set) const;
  [[nodiscard]] std::filesystem::path calibration_file() const { return own_ / "calibration.json"; }
  [[nodiscard]] std::filesystem::path rig_file() const { return own_ / "rig.toml"; }
  /// Rig with the sets of the last calibration alone, so that a run does not replace it.
  [[nodiscard]] std::filesystem::path calibration_rig_file() const {
    return own_ / "calibration-rig.toml";
  }
  [[nodiscard]] std::filesystem::path target_detections_file() const {
    return own_ / "target-detections.json";
  }
  [[nodiscard]] std::filesystem::path store_file() const { return out_ / "results.sqlite"; }
  [[nodiscard]] std::filesystem::path sheet_file(const std::string& drape) const;
  [[nodiscard]] std::filesystem::path object_file(const std::string& drape, int object) const;
  [[nodiscard]] std::filesystem::path scene_file(const Drape& drape, std::size_t plates) const;
  /// Calls for the plates that were taken, in their order.
  [[nodiscard]] std::vector<Call> object_calls(const Drape& drape) const;
  [[nodiscard]] Scene measured_scene(const Drape& drape) const;  ///< as far as plates show it
  [[nodiscard]] Call detect_call(const std::string& set) const;
  /// Where the set has no marks of its present pictures when the job begins.
  [[nodiscard]] Call missing_detect_call(const std::string& set) const;
  [[nodiscard]] std::string rig_text(bool for_calibration) const;
  [[nodiscard]] std::string live_rig_text(
      const std::filesystem::path& folder,
      const std::map<std::string, std::pair<int, int>>& px) const;
  void write_rig() const;
  void write_calibration_rig() const;
  void merge_detections(const std::vector<std::string>& sets) const;
  [[nodiscard]] Json results(const std::vector<std::string>& words) const;

  // ---- results of the pictures that recording.json lists now (bench_current.cpp) ---------------
  static std::string stamp_of(const std::filesystem::path& file);
  template <class T>
  [[nodiscard]] std::shared_ptr<const T> kept(KeptFiles& files, const std::filesystem::path& file,
                                              T (*read)(const std::filesystem::path&)) const;
  [[nodiscard]] std::shared_ptr<const Recording> recording() const;
  [[nodiscard]] std::shared_ptr<const FrameSet> recorded_set(const std::string& set) const;
  [[nodiscard]] Images images(const std::string& set) const;  ///< as the recording lists them
  [[nodiscard]] bool is_no_go(const std::string& set) const;
  [[nodiscard]] bool shows(const SetFacts& seen, const std::string& set) const;
  /// These four give nothing where the file is of other pictures.
  [[nodiscard]] std::shared_ptr<const SetFacts> facts(const std::string& set) const;
  [[nodiscard]] std::shared_ptr<const Detections> detections(const std::string& set) const;
  [[nodiscard]] std::shared_ptr<const Calibration> calibration() const;
  [[nodiscard]] std::shared_ptr<const Sheet> measured_sheet(const Drape& drape) const;
  [[nodiscard]] std::shared_ptr<const Sheet> sheet_in(const std::filesystem::path& file) const;
  [[nodiscard]] std::shared_ptr<const Sheet> whole_sheet(const std::filesystem::path& file) const;
  [[nodiscard]] Chain own_chain(const Drape& drape) const;
  [[nodiscard]] Chain run_chain(const Drape& drape) const;
  [[nodiscard]] Chain run_chain(const Drape& drape, const Laying& laying) const;  ///< a further one
  /// Why the file is superseded, for people; nothing where it belongs to the pictures.
  [[nodiscard]] std::optional<std::string> against_marks(const std::filesystem::path& marks,
                                                         const std::string& set) const;
  [[nodiscard]] std::optional<std::string> against_calibration(
      const std::filesystem::path& calibration, const std::filesystem::path& target_marks) const;
  [[nodiscard]] std::optional<std::string> against_object(const Chain& chain,
                                                          const Chain::Object& object) const;
  [[nodiscard]] std::optional<std::string> against_sheet(const Chain& chain) const;
  [[nodiscard]] Json comparisons(const Drape& drape, const Json& run) const;
  [[nodiscard]] std::optional<std::string> against_layings(const Drape& drape,
                                                           const Json& run) const;
  [[nodiscard]] std::optional<std::string> against_result(const Drape& drape,
                                                          const Json& row) const;

  // ---- inputs that are not the same any more (bench_inputs.cpp) --------------------------------
  static Inputs read_inputs(const std::filesystem::path& record);
  [[nodiscard]] std::shared_ptr<const Inputs> inputs_of(const std::filesystem::path& output) const;
  [[nodiscard]] std::shared_ptr<const std::string> content_of(
      const std::filesystem::path& file) const;  ///< its SHA-256 as read; nothing where it is gone
  [[nodiscard]] std::shared_ptr<const Rig> rig_in(const std::filesystem::path& file) const;
  [[nodiscard]] std::string shown(const std::filesystem::path& file) const;
  /// The record of the output lists the input with the content that it has now.
  [[nodiscard]] bool is_made_of(const std::filesystem::path& output,
                                const std::filesystem::path& input) const;
  /// The record of the output lists the input, with whatever content.
  [[nodiscard]] bool is_listed(const std::filesystem::path& output,
                               const std::filesystem::path& input) const;
  /// Which input was edited since or is gone, for people.
  [[nodiscard]] std::optional<std::string> against_input(const std::filesystem::path& input,
                                                         const std::string& sha256) const;
  [[nodiscard]] std::optional<std::string> against_inputs(
      const std::filesystem::path& output) const;
  [[nodiscard]] std::optional<std::string> against_pictures(const std::string& set) const;
  [[nodiscard]] std::optional<std::string> against_report(const Drape& drape) const;
  [[nodiscard]] std::optional<std::string> edited_since_start() const;
  const std::filesystem::path& as_read(const std::filesystem::path& file);
  void require_as_read() const;

  static SetFacts read_set_facts(const std::filesystem::path& file);
  [[nodiscard]] Json set_json(const std::string& set) const;
  [[nodiscard]] Json outlines(
      const Drape& drape) const;  ///< edges of its objects, in every picture
  [[nodiscard]] Json drape_json(const Drape& drape) const;
  [[nodiscard]] std::filesystem::path best_simulation(const Drape& drape) const;
  [[nodiscard]] Json comparison_of(const Drape& drape, const Json& row) const;
  [[nodiscard]] std::filesystem::path simulation_of(const Json& comparison) const;
  [[nodiscard]] Json calibration_json() const;
  [[nodiscard]] Json capture_json() const;
  [[nodiscard]] std::string operator_name() const;

  ConsoleOptions options_;
  Inputs read_at_start_;  ///< rig, target, scenes, prints and targets of plates
  Rig rig_;
  Target target_;
  std::vector<Drape> drapes_;
  std::filesystem::path out_, own_;  ///< the output folder, and the console's part of it
  std::filesystem::path recording_folder_;
  Tell tell_;
  WriterLock lock_;
  SessionLog log_;
  mutable std::mutex mutex_;  ///< guards everything below
  std::map<std::string, bool> taken_;
  std::map<std::string, Json> held_out_;  ///< per set, by the calibration before them
  std::string operator_name_;
  std::string trouble_;      ///< fault of the log or the disk, for the page
  mutable KeptFiles kept_;   ///< files that were used last
  mutable KeptFiles facts_;  ///< small facts of every set
  mutable std::uint64_t uses_ = 0;
  std::vector<Laying> layings_;
  mutable std::map<std::string, Json> kept_results_;
  mutable std::string kept_results_stamp_;
  mutable PictureShelf pictures_;
  mutable std::mutex live_mutex_;  ///< so that many pages cost one scaling
  mutable std::map<std::string, LivePicture> live_;
  mutable std::mutex watch_mutex_;
  std::optional<StillWatch> watch_;        ///< watches live cameras
  bool automatic_ = false;                 ///< free poses are taken without a key
  mutable double still_asked_s_ = -1e9;    ///< when a page asked last how still it is
  std::string taking_;                     ///< set that the capture was asked for
  std::vector<std::string> camera_words_;  ///< last lines of the capture
  bool cameras_ready_ = false;
  Json doctor_;  ///< checks of the last `drape doctor`
  // Last, so that their threads end first.
  Jobs jobs_;
  mutable std::mutex capture_mutex_;
  std::unique_ptr<CaptureSession> capture_;  ///< watches live cameras
  std::unique_ptr<LiveMarks> live_marks_;
};

/// x, y, z in mm, to a hundredth.
[[nodiscard]] Json point_mm(const Eigen::Vector3d& point);

/// The last row of a table whose "scene" is this one, or nothing.
[[nodiscard]] const Json* of_scene(const Json& rows, const std::string& scene);

/// The ending that a step kept beside its output: {"verdict", "sentence", "lines"}; null when
/// absent.
[[nodiscard]] Json ending_of(const std::filesystem::path& output);

}  // namespace drape::console
