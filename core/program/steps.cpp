// SPDX-License-Identifier: Apache-2.0
#include "core/program/steps.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <array>
#include <cstdint>
#include <cstring>

#include "core/error.hpp"
#include "core/program/child.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostOutput = 64U << 20U;
constexpr std::size_t kMostLine = 4096;
constexpr int kGlance_ms = 250;  ///< interval at which a wish to end is seen

/// A running program with its three pipes.
struct Child {
  std::size_t step = 0;
  pid_t pid = -1;
  Pipe output, errors, progress;
  std::string progress_rest;
  double fraction = 0;  ///< last progress reported
  std::string what = {};
};

/// Inode and time of change of a file: they change with every write and replacement.
std::array<std::int64_t, 3> version_of(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return {};
  return {static_cast<std::int64_t>(status.st_ino), status.st_ctim.tv_sec, status.st_ctim.tv_nsec};
}

Child start(const Step& step, std::size_t index) {
  Child child{index, -1, {}, {}, {}, {}};
  child.pid = start_child(step.program, step.arguments,
                          {.out = child.output.writing(),
                           .err = step.background ? -1 : child.errors.writing(),
                           .progress = child.progress.writing(),
                           .background = step.background});
  if (step.niceness != 0) ::setpriority(PRIO_PROCESS, child.pid, step.niceness);
  for (Pipe* pipe : {&child.output, &child.errors, &child.progress}) pipe->close_writing();
  return child;
}

void serve(std::vector<Child>& children, std::vector<StepResult>& results,
           const StepProgress& progress) {
  std::vector<pollfd> watched;
  for (const Child& child : children) {
    for (const Pipe* pipe : {&child.output, &child.errors, &child.progress})
      watched.push_back({pipe->reading(), POLLIN, 0});
  }
  if (::poll(watched.data(), watched.size(), kGlance_ms) < 0) return;
  for (std::size_t i = 0; i < children.size(); ++i) {
    Child& child = children[i];
    StepResult& result = results[child.step];
    if (watched[3 * i].revents != 0) child.output.take(result.output, kMostOutput);
    if (watched[3 * i + 1].revents != 0) child.errors.take(result.errors);
    if (watched[3 * i + 2].revents != 0) child.progress.take(child.progress_rest, kMostLine);
    pass_progress(child.progress_rest, [&](double fraction, const std::string& what) {
      child.fraction = fraction;
      child.what = what;
      progress(child.step, fraction, what);
    });
  }
  // Updates the elapsed time if a step reports nothing for a while.
  progress(children.front().step, children.front().fraction, children.front().what);
}

bool is_open(const Child& child) {
  return child.output.reading() >= 0 || child.errors.reading() >= 0 ||
         child.progress.reading() >= 0;
}

/// Waits for the process and stores how it ended in the result.
void end(pid_t pid, const Step& step, const std::vector<std::array<std::int64_t, 3>>& before,
         StepResult& result) {
  const ChildEnd end = await_child(pid);
  const std::string name = fmt::format("{} ({})", step.stage, step.what);
  result.exit_code = end.exit_code;
  if (end.signal != 0) {
    result.fault =
        fmt::format("{} was ended by signal {} ({})", name, end.signal, ::strsignal(end.signal));
    return;
  }
  constexpr int most = static_cast<int>(ErrorKind::internal);
  if (result.exit_code > most)
    result.fault =
        fmt::format("{} ended with exit code {}, which no stage has", name, result.exit_code);
  if (result.exit_code > 1) return;
  for (std::size_t i = 0; i < step.outputs.size(); ++i) {
    if (fs::is_regular_file(step.outputs[i]) && version_of(step.outputs[i]) != before[i]) continue;
    result.fault = fmt::format("{} ended with exit code {} but did not write {}", name,
                               result.exit_code, step.outputs[i].string());
    return;
  }
}

}  // namespace

void run_steps(const std::vector<Step>& steps, int at_once, const StepProgress& progress,
               const StepEnded& ended, const std::function<int()>& asked_to_end) {
  std::vector<StepResult> results(steps.size());
  std::vector<std::vector<std::array<std::int64_t, 3>>> before;
  for (const Step& step : steps) {
    before.emplace_back();
    for (const fs::path& output : step.outputs) before.back().push_back(version_of(output));
  }
  std::vector<Child> children;
  std::size_t next = 0;
  bool interrupted = false;
  while (!children.empty() || (next < steps.size() && !interrupted)) {
    while (!interrupted && next < steps.size() && static_cast<int>(children.size()) < at_once) {
      children.push_back(start(steps[next], next));
      ++next;
    }
    serve(children, results, progress);
    if (const int signal = asked_to_end(); signal != 0 && !interrupted) {
      for (const Child& child : children) ::kill(child.pid, signal);
      interrupted = true;
    }
    for (std::size_t i = 0; i < children.size();) {
      if (is_open(children[i])) {
        ++i;
        continue;
      }
      const std::size_t step = children[i].step;
      end(children[i].pid, steps[step], before[step], results[step]);
      children.erase(children.begin() + static_cast<std::ptrdiff_t>(i));
      ended(step, results[step]);
    }
  }
}

}  // namespace drape
