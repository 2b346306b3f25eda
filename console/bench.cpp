// SPDX-License-Identifier: Apache-2.0
#include "console/bench.hpp"

#include "core/error.hpp"

namespace drape::console {

Bench::Bench(const ConsoleOptions& options, Tell tell)
    : session(options, std::move(tell)),
      files(session),
      cameras(session, files,
              {[this](const std::string& set) { take_in(*this, set); },
               [this] { take_still_pose(*this); }, [this] { return jobs.idle(); },
               [this](const std::string& words) { end_automatic(*this, words, false); }}),
      jobs(
          [this](const Job& job) {
            if (job.state == JobState::running && job.now.empty() && job.fraction == 0) try {
                session.add("bench", "begins", {{"begins", job.kind + " " + job.what}});
              } catch (const Error& error) {
                session.trouble(error.what());
              }
            session.tell("job", job.json());
          },
          [this](const Job& job) { job_ended(*this, job); }) {
  if (options.replay) static_cast<void>(read_recording(session.recording_folder));
  detect_what_lacks(*this);
  if (!options.replay) cameras.open();
}

/// Ends the cameras first, while everything to which they report still exists.
Bench::~Bench() {
  cameras.shut();
}

}  // namespace drape::console
