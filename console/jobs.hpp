// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/files/json_file.hpp"
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

  /// Command line as typed by a person, quoted for a shell.
  [[nodiscard]] std::string shown() const;
};

/// Prepares the call and runs it by the `drape` beside the running program, with --json. Throws
/// Error(internal) if it cannot be started.
[[nodiscard]] StepResult run_call(
    const Call& call, const ChildProgress& progress = [](double, const std::string&) {},
    const std::function<int()>& asked_to_end = [] { return 0; }, int niceness = 0);

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
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;

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

}  // namespace drape::console
