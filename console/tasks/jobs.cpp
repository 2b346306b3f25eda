// SPDX-License-Identifier: Apache-2.0
#include "console/tasks/jobs.hpp"

#include <signal.h>

#include <algorithm>
#include <exception>

#include "core/error.hpp"

namespace drape::console {
namespace {

constexpr std::size_t kMostWaiting = 40;
constexpr std::size_t kMostKept = 20;

bool is_over(const Job& job) {
  return job.state != JobState::waiting && job.state != JobState::running;
}

/// Also true if that cannot be determined.
bool is_needed(const Call& call) {
  try {
    return !call.needed || call.needed();
  } catch (const std::exception&) {
    return true;
  }
}

const char* word(JobState state) {
  constexpr const char* kWords[] = {"waiting", "running", "done", "NO-GO", "failed", "cancelled"};
  return kWords[static_cast<int>(state)];
}

}  // namespace

Json Job::json() const {
  Json json = {{"id", id},
               {"kind", kind},
               {"what", what},
               {"state", word(state)},
               {"fraction", fraction},
               {"now", now},
               {"sentence", sentence}};
  json["commands"] = Json::array();
  for (const Call& call : calls) json["commands"].push_back(call.shown());
  return json;
}

Jobs::Jobs(std::function<void(const Job&)> changed, std::function<void(const Job&)> ended)
    : changed_(std::move(changed)), ended_(std::move(ended)), thread_([this] { work(); }) {}

Jobs::~Jobs() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  cancelled_ = true;
  if (const pid_t pid = child_; pid > 0) ::kill(pid, SIGTERM);
  wake_.notify_all();
  thread_.join();
}

int Jobs::add(std::string kind, std::string what, std::vector<Call> calls) {
  Job job;
  {
    const std::lock_guard lock(mutex_);
    const auto waiting =
        std::count_if(jobs_.begin(), jobs_.end(), [](const Job& one) { return !is_over(one); });
    if (static_cast<std::size_t>(waiting) >= kMostWaiting)
      throw bad_input("too much waits already", {}, "let it end, or cancel it");
    job.id = next_id_++;
    job.kind = std::move(kind);
    job.what = std::move(what);
    job.calls = std::move(calls);
    jobs_.push_back(job);
    while (jobs_.size() > kMostKept && is_over(jobs_.front())) jobs_.pop_front();
  }
  changed_(job);
  wake_.notify_all();
  return job.id;
}

bool Jobs::cancel(int id) {
  const Job job = find(id);
  if (job.id == 0 || is_over(job)) return false;
  if (running_ == id) {
    cancelled_ = true;
    if (const pid_t pid = child_; pid > 0) ::kill(pid, SIGTERM);
    return true;
  }
  change(id, [](Job& one) {
    one.state = JobState::cancelled;
    one.sentence = "taken back before it began";
  });
  ended_(find(id));
  return true;
}

std::vector<Job> Jobs::list() const {
  const std::lock_guard lock(mutex_);
  return {jobs_.begin(), jobs_.end()};
}

bool Jobs::idle() const {
  const std::lock_guard lock(mutex_);
  return std::all_of(jobs_.begin(), jobs_.end(), is_over);
}

Job Jobs::find(int id) const {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(jobs_.begin(), jobs_.end(), [&](const Job& one) { return one.id == id; });
  return found == jobs_.end() ? Job{} : *found;
}

void Jobs::change(int id, const std::function<void(Job&)>& how) {
  {
    const std::lock_guard lock(mutex_);
    const auto found =
        std::find_if(jobs_.begin(), jobs_.end(), [&](const Job& one) { return one.id == id; });
    if (found == jobs_.end()) return;
    how(*found);
  }
  changed_(find(id));
}

void Jobs::work() {
  for (;;) {
    int id = 0;
    {
      std::unique_lock lock(mutex_);
      const auto next = [this] {
        return std::find_if(jobs_.begin(), jobs_.end(),
                            [](const Job& one) { return one.state == JobState::waiting; });
      };
      wake_.wait(lock, [&] { return ending_ || next() != jobs_.end(); });
      if (ending_) return;
      id = next()->id;
      next()->state = JobState::running;
      cancelled_ = false;
      running_ = id;
    }
    run(id);
    running_ = 0;
    ended_(find(id));
  }
}

void Jobs::run(int id) {
  Job job = find(id);
  std::erase_if(job.calls, [](const Call& call) { return !is_needed(call); });
  change(id, [&](Job& one) { one.calls = job.calls; });
  JobState state = JobState::done;
  std::string sentence, output;
  for (std::size_t k = 0; k < job.calls.size() && !cancelled_; ++k) {
    const auto progress = [&](double fraction, const std::string& now) {
      change(id, [&](Job& one) {
        one.fraction = (static_cast<double>(k) + fraction) / static_cast<double>(job.calls.size());
        one.now = now;
      });
      // Handles a cancel between the start of a program and the first read of its id.
      if (const pid_t pid = child_; cancelled_ && pid > 0) ::kill(pid, SIGTERM);
    };
    try {
      const CallEnd end = run_call(job.calls[k], progress, child_);
      sentence = end.sentence;
      output = end.output;
      if (end.exit_code == 1) state = JobState::no_go;
      if (end.exit_code > 1) state = JobState::failed;
    } catch (const std::exception& error) {  // exceptions beyond this thread end the console
      sentence = error.what();
      state = JobState::failed;
    }
    if (state == JobState::failed) break;
  }
  if (cancelled_) {
    state = JobState::cancelled;
    sentence = "cancelled; what was finished is kept";
  }
  change(id, [&](Job& one) {
    one.state = state;
    one.sentence = sentence;
    one.output = output;
    one.now.clear();
    if (state == JobState::done || state == JobState::no_go) one.fraction = 1;
  });
}

}  // namespace drape::console
