// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "console/cameras.hpp"
#include "console/jobs.hpp"
#include "console/session.hpp"

namespace drape::console {

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

/// A view of the table in views.cpp: "state", "marks", ...; see README. nullopt if there is none of
/// this name. Throws Error(bad_input) for names that are not in the rig.
[[nodiscard]] std::optional<Json> view(Bench& bench, const std::string& name, const Query& query);

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
