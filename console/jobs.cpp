// SPDX-License-Identifier: Apache-2.0
#include "console/jobs.hpp"

#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <exception>

#include "core/program/words.hpp"

namespace drape::console {
namespace {

/// Verdict of a program, or why it failed and what to do, from its --json ending.
std::string sentence_of(const StepResult& end) {
  if (const auto error = error_printed(end.output, end.exit_code)) {
    std::string text = error->what_failed();
    if (const std::string where = error->where().describe(); !where.empty())
      text += " (" + where + ")";
    return error->what_to_do().empty() ? text : text + "; to do: " + error->what_to_do();
  }
  const Json json = try_json(end.output.substr(std::min(end.output.find('{'), end.output.size())));
  if (json.is_object())
    for (const char* key : {"sentence", "cause"})
      if (const auto found = json.find(key); found != json.end() && found->is_string())
        if (std::string text = *found; !text.empty()) return text;
  if (!end.fault.empty()) return end.fault;
  return end.exit_code == 0 ? "done" : fmt::format("ended with code {}", end.exit_code);
}

constexpr std::size_t kMostWaiting = 40;
constexpr std::size_t kMostEnded = 20;
constexpr const char* kStates[] = {"waiting", "running", "done", "NO-GO", "failed", "cancelled"};

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

}  // namespace

std::string Call::shown() const {
  std::string text = "drape";
  for (const std::string& word : words) text += " " + shell_word(word);
  return text;
}

StepResult run_call(const Call& call, const ChildProgress& progress,
                    const std::function<int()>& asked_to_end, int niceness) {
  if (call.before) call.before();
  Step step{.stage = "drape",
            .what = call.words.front(),
            .program = program_beside("drape"),
            .arguments = call.words,
            .background = true,
            .niceness = niceness};
  step.arguments.emplace_back("--json");
  StepResult end;
  run_steps(
      {step}, 1,
      [&](std::size_t, double fraction, const std::string& now) {
        if (!now.empty()) progress(fraction, now);
      },
      [&](std::size_t, const StepResult& result) { end = result; }, asked_to_end);
  return end;
}

Json Job::json() const {
  Json json = {{"id", id},
               {"kind", kind},
               {"what", what},
               {"state", kStates[static_cast<int>(state)]},
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
    while (jobs_.size() > kMostEnded && is_over(jobs_.front())) jobs_.pop_front();
  }
  changed_(job);
  wake_.notify_all();
  return job.id;
}

bool Jobs::cancel(int id) {
  JobState before = JobState::done;
  const Job job = change(id, [&](Job& one) {
    before = one.state;
    if (before == JobState::running) cancelled_ = true;
    if (before != JobState::waiting) return;
    one.state = JobState::cancelled;
    one.sentence = "taken back before it began";
  });
  if (before == JobState::waiting) ended_(job);
  return before == JobState::waiting || before == JobState::running;
}

std::vector<Job> Jobs::list() const {
  const std::lock_guard lock(mutex_);
  return {jobs_.begin(), jobs_.end()};
}

bool Jobs::idle() const {
  const std::lock_guard lock(mutex_);
  return std::all_of(jobs_.begin(), jobs_.end(), is_over);
}

/// Returns the job as changed; one without id if there is none.
Job Jobs::change(int id, const std::function<void(Job&)>& how) {
  Job job;
  {
    const std::lock_guard lock(mutex_);
    const auto found =
        std::find_if(jobs_.begin(), jobs_.end(), [&](const Job& one) { return one.id == id; });
    if (found == jobs_.end()) return job;
    how(*found);
    job = *found;
  }
  changed_(job);
  return job;
}

void Jobs::work() {
  for (;;) {
    Job job;
    {
      std::unique_lock lock(mutex_);
      const auto next = [this] {
        return std::find_if(jobs_.begin(), jobs_.end(),
                            [](const Job& one) { return one.state == JobState::waiting; });
      };
      wake_.wait(lock, [&] { return ending_ || next() != jobs_.end(); });
      if (ending_) return;
      cancelled_ = false;
      job = *next();
      next()->state = JobState::running;
    }
    run(std::move(job));
  }
}

void Jobs::run(Job job) {
  std::erase_if(job.calls, [](const Call& call) { return !is_needed(call); });
  change(job.id, [&](Job& one) { one.calls = job.calls; });
  JobState state = JobState::done;
  std::string sentence, output;
  for (std::size_t k = 0; k < job.calls.size() && !cancelled_ && state != JobState::failed; ++k) {
    try {
      const StepResult end = run_call(
          job.calls[k],
          [&](double fraction, const std::string& now) {
            change(job.id, [&](Job& one) {
              one.fraction =
                  (static_cast<double>(k) + fraction) / static_cast<double>(job.calls.size());
              one.now = now;
            });
          },
          [this] { return cancelled_ ? SIGTERM : 0; });
      sentence = sentence_of(end);
      output = end.output;
      if (end.exit_code == 1) state = JobState::no_go;
      if (end.exit_code > 1) state = JobState::failed;
    } catch (const std::exception& error) {  // exceptions beyond this thread end the console
      sentence = error.what();
      state = JobState::failed;
    }
  }
  if (cancelled_) {
    state = JobState::cancelled;
    sentence = "cancelled; what was finished is kept";
  }
  ended_(change(job.id, [&](Job& one) {
    one.state = state;
    one.sentence = sentence;
    one.output = output;
    one.now.clear();
    if (state == JobState::done || state == JobState::no_go) one.fraction = 1;
  }));
}

}  // namespace drape::console
