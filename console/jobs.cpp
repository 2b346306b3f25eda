// SPDX-License-Identifier: Apache-2.0
#include "console/jobs.hpp"
#include "core/program/words.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <exception>

namespace drape::console {
namespace {

constexpr std::size_t kMostOutput = 64U << 20U;
constexpr std::size_t kMostLine = 4096;

/// Sentence from a program's --json ending.
std::string sentence_of(const std::string& output, const ChildEnd& end) {
  if (const auto error = error_printed(output, end.exit_code)) {
    std::string text = error->what_failed();
    if (const std::string where = error->where().describe(); !where.empty())
      text += " (" + where + ")";
    return error->what_to_do().empty() ? text : text + "; to do: " + error->what_to_do();
  }
  const std::size_t begin = output.find('{');
  const Json json = begin == std::string::npos ? Json() : try_json(output.substr(begin));
  if (json.is_object())
    for (const char* key : {"sentence", "cause"})
      if (const auto found = json.find(key); found != json.end() && found->is_string())
        if (std::string text = *found; !text.empty()) return text;
  if (end.signal != 0) return fmt::format("ended by signal {}", end.signal);
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

CallEnd run_call(const Call& call, const ChildProgress& progress, std::atomic<pid_t>& child) {
  if (call.before) call.before();
  std::vector<std::string> words = call.words;
  words.emplace_back("--json");
  Pipe output, steps;
  const pid_t pid =
      start_child(program_beside("drape"), words,
                  {.out = output.writing(), .progress = steps.writing(), .background = true});
  child = pid;
  output.close_writing();
  steps.close_writing();
  CallEnd end;
  std::string lines;
  while (output.reading() >= 0 || steps.reading() >= 0) {
    std::array<pollfd, 2> watched = {{{output.reading(), POLLIN, 0}, {steps.reading(), POLLIN, 0}}};
    if (::poll(watched.data(), watched.size(), -1) < 0) continue;
    if (watched[0].revents != 0) output.take(end.output, kMostOutput);
    if (watched[1].revents != 0) steps.take(lines, kMostLine);
    pass_progress(lines, progress);
  }
  child = 0;
  const ChildEnd ended = await_child(pid);
  end.exit_code = ended.exit_code;
  end.sentence = sentence_of(end.output, ended);
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
    while (jobs_.size() > kMostEnded && is_over(jobs_.front())) jobs_.pop_front();
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
