// SPDX-License-Identifier: Apache-2.0
#include "front/process.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>

#include "core/program/child.hpp"
#include "core/program/run_record.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

/// A running program with its three pipes.
struct Child {
  std::size_t step = 0;
  pid_t pid = -1;
  Pipe output, errors, progress;
  std::string progress_rest;
  double fraction = 0;  ///< last progress reported
  std::string what = {};
};

volatile std::sig_atomic_t last_signal = 0;

void remember(int signal) {
  last_signal = signal;
}

void handle_interrupts(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  for (const int signal : {SIGINT, SIGTERM}) ::sigaction(signal, &action, nullptr);
}

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
                           .err = child.errors.writing(),
                           .progress = child.progress.writing()});
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
  if (::poll(watched.data(), watched.size(), 500) < 0) return;
  for (std::size_t i = 0; i < children.size(); ++i) {
    Child& child = children[i];
    StepResult& result = results[child.step];
    if (watched[3 * i].revents != 0) child.output.take(result.output);
    if (watched[3 * i + 1].revents != 0) child.errors.take(result.errors);
    if (watched[3 * i + 2].revents != 0) child.progress.take(child.progress_rest);
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

Interrupts::Interrupts() {
  handle_interrupts(&remember);
}

Interrupts::~Interrupts() {
  handle_interrupts(SIG_DFL);
}

int Interrupts::signal() {
  return last_signal;
}

void run_steps(const std::vector<Step>& steps, int at_once, const StepProgress& progress,
               const StepEnded& ended) {
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
    if (const int signal = Interrupts::signal(); signal != 0 && !interrupted) {
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

std::optional<Error> error_in(const StepResult& result) {
  if (!result.fault.empty()) {
    return Error(ErrorKind::internal, result.fault, {},
                 "see what it printed above; run again, steps that were finished are kept");
  }
  if (result.exit_code <= 1) return std::nullopt;
  if (auto error = error_printed(result.output, result.exit_code)) return error;
  return Error(static_cast<ErrorKind>(result.exit_code),
               fmt::format("a program ended with code {}", result.exit_code), {}, "");
}

std::vector<std::string> warnings_in(const StepResult& result) {
  const auto ending = ending_in(result.output);
  return ending ? ending->warnings : std::vector<std::string>();
}

StepResult result_of_stage(const std::string& stage, std::vector<std::string> arguments) {
  StageCall call = call_of(stage, std::move(arguments));
  StepResult result;
  run_steps(
      {{stage, stage, std::move(call.program), std::move(call.arguments), {}}}, 1,
      [](std::size_t, double, const std::string&) {},
      [&](std::size_t, const StepResult& ended) { result = ended; });
  return result;
}

std::optional<Error> error_of_stage(const std::string& stage, std::vector<std::string> arguments) {
  return error_in(result_of_stage(stage, std::move(arguments)));
}

void become(const fs::path& program, const std::vector<std::string>& arguments) {
  std::vector<char*> words = {const_cast<char*>(program.c_str())};
  for (const std::string& word : arguments) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  ::execv(program.c_str(), words.data());
  throw internal_error(fmt::format("cannot start the program: {}", std::strerror(errno)),
                       {.file = program.string()});
}

const std::vector<CommandWord>& command_words() {
  static const std::vector<CommandWord> words = {
      {"import", "capture", "import", true},
      {"doctor", "capture", "doctor", true},
      {"cameras", "capture", "cameras", false},
      {"print", "detect", "print", true},
      {"accept", "calib", "accept", false},
      {"calib-convert", "calib", "convert", false},
      {"calib-images", "calib", "images", false},
      {"object", "triangulate", "object", true},
      {"study", "simulate", "study", true},
      {"fabric", "simulate", "fabric", true},
      {"branches", "simulate", "branches", false},
      {"sensitivity", "simulate", "sensitivity", false},
      {"refine", "simulate", "SCENE --spacing-mm 2.5", false},
      {"certify", "simulate", "certify", false},
      {"cusick", "simulate", "cusick", false},
      {"piece", "simulate", "SCENE --outline FILE", false},
      {"drapemeter", "compare", "drapemeter", true},
      {"folds", "compare", "", false},
      {"folds", "compare", "MEASURED SIMULATED...", false},
      {"repeats", "compare", "repeats", false}};
  return words;
}

StageCall call_of(const std::string& command, std::vector<std::string> arguments) {
  std::string stage = command;
  // `drape import --points FILE` makes a sheet, `drape import FOLDER` a recording.
  const std::string_view points = "--points";
  const auto given = std::find_if(arguments.begin(), arguments.end(), [&](const std::string& word) {
    return word == points || word.starts_with("--points=");
  });
  if (command == "import" && given != arguments.end()) {
    if (*given == points)
      arguments.erase(given);
    else
      given->erase(0, points.size() + 1);
    arguments.insert(arguments.begin(), "points");
    return {program_beside("drape-triangulate"), std::move(arguments)};
  }
  for (const CommandWord& word : command_words()) {
    if (command != word.name) continue;
    stage = word.stage;
    arguments.insert(arguments.begin(), word.word);
  }
  return {program_beside("drape-" + stage), std::move(arguments)};
}

}  // namespace drape
