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

/// The console without HTTP, in three parts: state (what the session knows: `session`, `files`),
/// actions (what can be done: perform()), views (what is shown: view()). Safe from several threads.
struct Bench {
  Bench(const ConsoleOptions& options, Tell tell);
  ~Bench();

  Session session;
  Files files;
  mutable PictureShelf pictures;
  Cameras cameras;
  Jobs jobs;  ///< last, so that its thread ends first
};

/// Performs one action of the table in actions.cpp: {"do": "take", "set": "pose_00"}; see README.
/// Throws Error(bad_input) with a sentence where it cannot be done now.
void perform(Bench& bench, const std::string& request);

/// Called when a job has ended: logs it, and does what follows from it.
void job_ended(Bench& bench, const Job& job);

/// Detects sets that waited when the server before this one ended.
void detect_what_lacks(Bench& bench);

/// Takes the next free pose: the target is held still in a new one.
void take_still_pose(Bench& bench);
/// The page says why no more poses are taken by themselves.
void end_automatic(Bench& bench, const std::string& words, bool good);
/// A set's pictures are there: their marks are looked for.
void take_in(Bench& bench, const std::string& set);

/// Query of a view.
using Query = std::map<std::string, std::string>;

/// One view of the table in views.cpp: "state", "marks", ...; see README. Throws Error(bad_input)
/// for names that the rig does not have.
[[nodiscard]] Json view(Bench& bench, const std::string& name, const Query& query);
[[nodiscard]] bool is_view(const std::string& name);

/// A recorded picture.
[[nodiscard]] Picture picture(const Bench& bench, const std::string& set, const std::string& camera,
                              int width_px, bool mark_saturation);

/// The coach's next pose.
[[nodiscard]] Json coach_view(const Bench& bench);
/// Edges of a drape's objects in every camera's picture.
[[nodiscard]] Json outlines(const Files& files, const Drape& drape);

/// x, y, z in mm, to a hundredth.
[[nodiscard]] Json point_mm(const Eigen::Vector3d& point);

}  // namespace drape::console
