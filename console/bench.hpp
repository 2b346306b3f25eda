// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "console/cameras.hpp"
#include "console/files.hpp"
#include "console/session.hpp"
#include "console/tasks/jobs.hpp"
#include "console/tasks/pictures.hpp"

namespace drape::console {

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

/// A view of the table in views.cpp: "state", "marks", ...; see README. Throws Error(bad_input) for
/// names that are not in the rig.
[[nodiscard]] Json view(Bench& bench, const std::string& name, const Query& query);
[[nodiscard]] bool is_view(const std::string& name);

/// A recorded picture.
[[nodiscard]] Picture picture(const Bench& bench, const std::string& set, const std::string& camera,
                              int width_px, bool mark_saturation);

/// Next pose proposed by the coach.
[[nodiscard]] Json coach_view(const Bench& bench);
/// Edges of a drape's objects in every camera's picture.
[[nodiscard]] Json outlines(const Files& files, const Drape& drape);

/// x, y, z in mm, rounded to a hundredth.
[[nodiscard]] Json point_mm(const Eigen::Vector3d& point);

}  // namespace drape::console
