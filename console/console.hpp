// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "console/files.hpp"
#include "console/jobs.hpp"
#include "console/pictures.hpp"
#include "console/session.hpp"

namespace drape::console {

struct Bench;

/// The newest picture of a live camera.
struct LivePicture {
  std::uint64_t number = 0;
  int width_px = 0;
  bool mark_saturation = false;
  std::string jpeg, facts;  ///< facts: ASCII JSON as written by `drape capture --preview`
};

/// The live cameras: the resident capture session and its messages, stillness, and marks in their
/// pictures. Thread-safe.
class Cameras {
 public:
  explicit Cameras(Bench& bench);
  ~Cameras();
  Cameras(const Cameras&) = delete;
  Cameras& operator=(const Cameras&) = delete;

  void open();  ///< throws Error(bad_input) while they are open
  void close();
  void shut();  ///< called before the objects to which they report are destroyed
  void take(const std::string& set);
  void undo(const std::string& set);  ///< restores the previous take of a set
  /// Sets exposure or gain until the cameras are closed; the value in use comes with the pictures.
  void light(const std::string& camera, const std::string& name, double value);
  [[nodiscard]] bool runs() const;
  [[nodiscard]] std::string taking() const;  ///< set that the capture is taking
  [[nodiscard]] bool automatic() const;
  void automatic(bool on);
  [[nodiscard]] Json json() const;
  /// nullopt before the camera's first picture.
  [[nodiscard]] std::optional<LivePicture> picture(const std::string& camera, int width_px,
                                                   bool mark_saturation);
  /// Last marks found in the live pictures, in their pixels; null before the first detection. Keeps
  /// detection running for some seconds.
  [[nodiscard]] std::shared_ptr<const Detections> marks(Surface surface);
  /// Time without motion in each camera's pictures; keeps watching for some
  /// seconds.
  [[nodiscard]] Json still_json();

 private:
  class Capture;
  class LiveMarks;
  void heard(const std::string& line);
  void ended(const std::string& sentence);
  void look(const std::string& camera);
  void type(const std::string& line);
  void take_by(const std::string& set, const std::string& line);
  void require_open() const;
  [[nodiscard]] std::string newest(const std::string& camera, std::uint64_t& number) const;

  Bench& bench_;
  mutable std::mutex mutex_;  ///< guards the next four members
  std::string taking_;
  std::vector<std::string> words_;  ///< last lines printed by the capture
  bool ready_ = false, automatic_ = false;
  std::mutex watch_mutex_;  ///< guards the next two members
  std::optional<StillWatch> watch_;
  double still_asked_s_ = -1e9;  ///< time of the last request for stillness
  std::mutex live_mutex_;        ///< lets many pages share one scaling
  std::map<std::string, LivePicture> live_;
  mutable std::mutex capture_mutex_;
  std::unique_ptr<Capture> capture_;
  std::unique_ptr<LiveMarks> live_marks_;
};

/// Text of the rig's file with paths relative to this folder.
[[nodiscard]] std::string text_in(const fs::path& folder, Rig rig);

/// Text of the part of a rig used by detect, for a file in this folder; contains only the cameras
/// with given sizes in px, if any are given.
[[nodiscard]] std::string detect_rig_text(
    const BenchFiles& bench, const fs::path& folder,
    const std::map<std::string, std::pair<int, int>>& px = {});

/// The console without HTTP, in three parts: state (known to the session: `session`, `files`),
/// actions (perform()), views (view()). Thread-safe.
struct Bench {
  Bench(const ConsoleOptions& options, Tell tell);
  ~Bench();

  Session session;
  Files files;
  mutable PictureShelf pictures;
  Cameras cameras;
  Jobs jobs;  ///< declared last, so that its thread ends first
};

/// Performs one action of the table in actions.cpp, such as {"do": "take", "set": "pose_00"}; see
/// README. Throws Error(bad_input) with a sentence if it is not possible now.
void perform(Bench& bench, const std::string& request);

/// Called when a job has ended: logs it and starts what follows from it.
void job_ended(Bench& bench, const Job& job);

/// Detects sets that were waiting when the previous server ended.
void detect_what_lacks(Bench& bench);

/// Takes the next free pose, when the target is held still in a new one.
void take_still_pose(Bench& bench);
/// Ends automatic taking of poses, and shows the reason on the page.
void end_automatic(Bench& bench, const std::string& words, bool good);
/// Starts detecting the marks of a set whose pictures have been taken.
void take_in(Bench& bench, const std::string& set);

/// Query parameters of a view.
using Query = std::map<std::string, std::string>;

/// A query parameter; empty if absent.
[[nodiscard]] std::string asked(const Query& query, const char* name);

/// A view of the table in views.cpp: "state", "marks", ...; see README. Throws Error(bad_input) for
/// names that are not in the rig.
[[nodiscard]] Json view(Bench& bench, const std::string& name, const Query& query);
[[nodiscard]] bool is_view(const std::string& name);

/// A recorded picture.
[[nodiscard]] Picture picture(const Bench& bench, const std::string& set, const std::string& camera,
                              int width_px, bool mark_saturation);

/// Next pose proposed by the coach.
[[nodiscard]] Json coach_view(const Bench& bench);
/// The target measured in space with a given calibration, without using its known shape, and then
/// fitted by its drawing. On a set that the calibration did not use, `rms_m` is the error of a
/// measured point.
struct MeasuredTarget {
  WorldFromTarget world_from_target;
  int points = 0;    ///< points seen by two or more cameras
  double rms_m = 0;  ///< root mean square distance of the measured points from the drawing
  std::vector<Eigen::Vector3d> points_in_world;
};

/// Measures the target in space; nullopt if two cameras see fewer than 8 points.
[[nodiscard]] std::optional<MeasuredTarget> measure_target(
    const Calibration& calibration, const Target& target,
    const std::vector<FrameDetections>& frames);

}  // namespace drape::console
