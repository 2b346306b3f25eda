// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "console/tasks/process.hpp"
#include "core/files/json_file.hpp"

namespace drape::console {

enum class JobState { waiting, running, done, no_go, failed, cancelled };

/// Commands that run one after another because somebody asked for one thing.
struct Job {
  int id = 0;
  std::string kind;         ///< "detect", "calibrate", "measure", "run"
  std::string what;         ///< "calibrate with 7 sets"
  std::vector<Call> calls;  ///< a verdict NO-GO of one does not stop the next, a failure does
  JobState state = JobState::waiting;
  double fraction = 0;   ///< 0..1
  std::string now = {};  ///< activity of its running program
  std::string sentence = {};
  std::string output = {};  ///< text that its last program printed

  [[nodiscard]] Json json() const;
};

/// Runs jobs one at a time in the order in which they were asked for. Safe from several threads.
class Jobs {
 public:
  /// `changed` is called after every change of a job, `ended` once when it is over.
  Jobs(std::function<void(const Job&)> changed, std::function<void(const Job&)> ended);
  ~Jobs();
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;

  /// Throws Error(bad_input) when too many wait already.
  int add(std::string kind, std::string what, std::vector<Call> calls);
  /// Ends a running job as Ctrl-C would, or takes a waiting one back; false when it is over.
  bool cancel(int id);
  [[nodiscard]] std::vector<Job> list() const;  ///< oldest first; the last 20 that are over
  [[nodiscard]] bool idle() const;

 private:
  void work();
  void run(int id);
  void change(int id, const std::function<void(Job&)>& how);
  [[nodiscard]] Job find(int id) const;

  std::function<void(const Job&)> changed_, ended_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Job> jobs_;
  std::atomic<pid_t> child_ = 0;
  std::atomic<int> running_ = 0;  ///< id; 0: none
  std::atomic<bool> cancelled_ = false;
  bool ending_ = false;
  int next_id_ = 1;
  std::thread thread_;
};

}  // namespace drape::console
