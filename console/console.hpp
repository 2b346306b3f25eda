// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <deque>
#include <thread>

#include "console/cameras.hpp"
#include "core/program/child.hpp"
#include "core/program/steps.hpp"

namespace drape::console {

/// A command of the front door: `drape detect ...`.
struct Call {
  std::vector<std::string> words;  ///< after `drape`, without --json
  /// Prepares required files; throws Error.
  std::function<void()> before = {};
  /// Called when its job begins; if empty, the call is always needed.
  std::function<bool()> needed = {};
  int niceness = 0;  ///< 19 for the lowest priority

  /// Command line as typed by a person, quoted for a shell.
  [[nodiscard]] std::string shown() const;
};

/// Prepares the call and runs it by the `drape` beside the running program, with --json. Throws
/// Error(internal) if it cannot be started.
[[nodiscard]] StepResult run_call(
    const Call& call, const ChildProgress& progress = [](double, const std::string&) {},
    const std::function<int()>& asked_to_end = [] { return 0; });

enum class JobState { waiting, running, done, no_go, failed, cancelled };

/// A sequence of commands that carries out one request.
struct Job {
  int id = 0;
  std::string kind;         ///< "detect", "calibrate", "measure", "run"
  std::string what;         ///< "calibrate with 7 sets"
  std::vector<Call> calls;  ///< a NO-GO of one does not stop the next, but a failure does
  JobState state = JobState::waiting;
  double fraction = 0;   ///< 0..1
  std::string now = {};  ///< current activity of its running program
  std::string sentence = {};
  std::string output = {};  ///< text printed by its last program

  [[nodiscard]] Json json() const;
};

/// Runs jobs one at a time in the order requested. Thread-safe.
class Jobs {
 public:
  /// Calls `changed` after every change of a job, and `ended` once when it is over.
  Jobs(std::function<void(const Job&)> changed, std::function<void(const Job&)> ended);
  ~Jobs();

  /// Throws Error(bad_input) if too many are waiting.
  int add(std::string kind, std::string what, std::vector<Call> calls);
  /// Interrupts a running job like Ctrl-C, or removes a waiting one; false if it is over.
  bool cancel(int id);
  [[nodiscard]] std::vector<Job> list() const;  ///< oldest first; only the last 20 that are over
  [[nodiscard]] bool idle() const;

 private:
  void work();
  void run(Job job);
  Job change(int id, const std::function<void(Job&)>& how);

  std::function<void(const Job&)> changed_, ended_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Job> jobs_;
  std::atomic<bool> cancelled_ = false;
  bool ending_ = false;
  int next_id_ = 1;
  std::thread thread_;
};

/// Text of the part of a rig used by detect, for a file in this folder; contains only the cameras
/// with given sizes in px, if any are given.
[[nodiscard]] std::string detect_rig_text(
    const BenchFiles& bench, const fs::path& folder,
    const std::map<std::string, std::pair<int, int>>& px = {});

/// The console without HTTP, in three parts: state (known to the session: `session`, `files`),
/// actions (perform()), views (view()). Thread-safe.
struct Bench {
  Bench(const ConsoleOptions& options, Tell tell);
  ~Bench() { cameras.shut(); }

  Session session;
  Files files;
  mutable PictureShelf pictures;
  Cameras cameras;
  Jobs jobs;  ///< declared last, so that its thread ends first
};

/// Performs one action of the table in actions.cpp, such as {"do": "take", "set": "pose_00"}; see
/// README. Throws Error(bad_input) with a sentence if it is not possible now.
void perform(Bench& bench, const std::string& request);

/// Takes the next free pose, when the target is held still in a new one.
void take_still_pose(Bench& bench);
/// Ends automatic taking of poses, and shows the reason on the page.
void end_automatic(Bench& bench, const std::string& words, bool good);
/// Starts detecting the marks of a set whose pictures have been taken.
void take_in(Bench& bench, const std::string& set);

/// Query parameters of a view.
using Query = std::map<std::string, std::string>;

/// A view of the table in views.cpp: "state", "marks", ...; see README. nullopt if there is none of
/// this name. Throws Error(bad_input) for names that are not in the rig.
[[nodiscard]] std::optional<Json> view(Bench& bench, const std::string& name, Query query);

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
