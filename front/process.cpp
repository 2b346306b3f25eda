// SPDX-License-Identifier: Apache-2.0
#include "front/process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "core/error.hpp"
#include "core/files/json_file.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

/// A started program with the reading ends of its three pipes; -1 once closed.
struct Child {
  std::size_t step = 0;
  pid_t pid = -1;
  int output = -1;
  int errors = -1;
  int progress = -1;
  std::string progress_rest;
};

volatile std::sig_atomic_t last_signal = 0;

void remember(int signal) {
  last_signal = signal;
}

/// Which content a file name stands for: it changes with every write and every replacement.
struct Version {
  ino_t inode = 0;
  timespec changed{};

  static Version of(const fs::path& file) {
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0) return {};
    return {status.st_ino, status.st_ctim};
  }
  bool operator==(const Version& other) const {
    return inode == other.inode && changed.tv_sec == other.changed.tv_sec &&
           changed.tv_nsec == other.changed.tv_nsec;
  }
};

std::vector<char*> c_arguments(const fs::path& program, const std::vector<std::string>& arguments) {
  std::vector<char*> result{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments)
    result.push_back(const_cast<char*>(argument.c_str()));
  result.push_back(nullptr);
  return result;
}

[[noreturn]] void fail_to_start(const fs::path& program, int code) {
  throw internal_error(fmt::format("cannot start the program: {}", std::strerror(code)),
                       {.file = program.string()});
}

std::array<int, 2> make_pipe(const fs::path& program) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) fail_to_start(program, errno);
  return ends;
}

Child start(const Step& step, std::size_t index) {
  if (!fs::exists(step.program)) {
    throw internal_error("a program of drapebench is missing beside `drape`",
                         {.file = step.program.string()});
  }
  const std::array<int, 2> output = make_pipe(step.program);
  const std::array<int, 2> errors = make_pipe(step.program);
  const std::array<int, 2> progress = make_pipe(step.program);
  const std::vector<char*> arguments = c_arguments(step.program, step.arguments);
  const std::string descriptor = std::to_string(progress[1]);
  const pid_t parent = ::getpid();
  std::fflush(nullptr);
  const pid_t pid = ::fork();
  if (pid < 0) fail_to_start(step.program, errno);
  if (pid == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    ::dup2(output[1], STDOUT_FILENO);
    ::dup2(errors[1], STDERR_FILENO);
    ::fcntl(progress[1], F_SETFD, 0);
    ::setenv("DRAPE_PROGRESS_FD", descriptor.c_str(), 1);
    ::execv(step.program.c_str(), arguments.data());
    ::_exit(127);
  }
  ::close(output[1]);
  ::close(errors[1]);
  ::close(progress[1]);
  return {index, pid, output[0], errors[0], progress[0], {}};
}

/// Reads what is there; closes the descriptor at its end.
std::string read_some(int& descriptor) {
  std::array<char, 65536> buffer;
  const ssize_t got = ::read(descriptor, buffer.data(), buffer.size());
  if (got < 0 && errno == EINTR) return {};
  if (got <= 0) {
    ::close(descriptor);
    descriptor = -1;
    return {};
  }
  return {buffer.data(), static_cast<std::size_t>(got)};
}

void pass_progress(Child& child, const StepProgress& progress) {
  child.progress_rest += read_some(child.progress);
  for (auto end = child.progress_rest.find('\n'); end != std::string::npos;
       end = child.progress_rest.find('\n')) {
    const std::string line = child.progress_rest.substr(0, end);
    child.progress_rest.erase(0, end + 1);
    const auto space = line.find(' ');
    if (space == std::string::npos) continue;
    progress(child.step, std::atof(line.substr(0, space).c_str()), line.substr(space + 1));
  }
}

void serve(std::vector<Child>& children, std::vector<StepResult>& results,
           const StepProgress& progress) {
  std::vector<pollfd> watched;
  for (const Child& child : children) {
    for (const int pipe : {child.output, child.errors, child.progress})
      watched.push_back({pipe, POLLIN, 0});
  }
  if (::poll(watched.data(), watched.size(), 500) < 0) return;
  for (std::size_t i = 0; i < children.size(); ++i) {
    StepResult& result = results[children[i].step];
    if (watched[3 * i].revents != 0) result.output += read_some(children[i].output);
    if (watched[3 * i + 1].revents != 0) result.errors += read_some(children[i].errors);
    if (watched[3 * i + 2].revents != 0) pass_progress(children[i], progress);
  }
}

bool is_open(const Child& child) {
  return child.output >= 0 || child.errors >= 0 || child.progress >= 0;
}

/// Waits for the process and puts its end into the result.
void end(pid_t pid, const Step& step, const std::vector<Version>& before, StepResult& result) {
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  const std::string name = fmt::format("{} ({})", step.stage, step.what);
  if (!WIFEXITED(status)) {
    const int signal = WTERMSIG(status);
    result.exit_code = 128 + signal;
    result.fault = fmt::format("{} was ended by signal {} ({})", name, signal, ::strsignal(signal));
    return;
  }
  result.exit_code = WEXITSTATUS(status);
  constexpr int most = static_cast<int>(ErrorKind::internal);
  if (result.exit_code > most)
    result.fault =
        fmt::format("{} ended with exit code {}, which no stage has", name, result.exit_code);
  if (result.exit_code > 1) return;
  for (std::size_t i = 0; i < step.outputs.size(); ++i) {
    if (fs::is_regular_file(step.outputs[i]) && !(Version::of(step.outputs[i]) == before[i]))
      continue;
    result.fault = fmt::format("{} ended with exit code {} but did not write {}", name,
                               result.exit_code, step.outputs[i].string());
    return;
  }
}

}  // namespace

Interrupts::Interrupts() {
  struct sigaction action {};
  action.sa_handler = &remember;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

Interrupts::~Interrupts() {
  struct sigaction action {};
  action.sa_handler = SIG_DFL;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

int Interrupts::signal() {
  return last_signal;
}

void run_steps(const std::vector<Step>& steps, int at_once, const StepProgress& progress,
               const StepEnded& ended) {
  std::vector<StepResult> results(steps.size());
  std::vector<std::vector<Version>> before;
  for (const Step& step : steps) {
    before.emplace_back();
    for (const fs::path& output : step.outputs) before.back().push_back(Version::of(output));
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

StepResult run_step(const Step& step) {
  StepResult result;
  run_steps(
      {step}, 1, [](std::size_t, double, const std::string&) {},
      [&](std::size_t, const StepResult& ended) { result = ended; });
  std::fputs(result.errors.c_str(), stderr);
  return result;
}

namespace {

/// What a program that was started with --json printed; null without it.
Json json_in(const StepResult& result) {
  const std::size_t begin = result.output.find("{\n");
  return begin == std::string::npos ? Json() : try_json(result.output.substr(begin));
}

}  // namespace

std::optional<Error> error_in(const StepResult& result) {
  if (!result.fault.empty()) {
    return Error(ErrorKind::internal, result.fault, {},
                 "see what it printed above; run again, steps that were finished are kept");
  }
  if (result.exit_code <= 1) return std::nullopt;
  const Json json = json_in(result);
  const auto kind = static_cast<ErrorKind>(result.exit_code);
  if (!json.is_object() || !json.contains("error"))
    return Error(kind, fmt::format("a program ended with code {}", result.exit_code), {}, "");
  const Json& error = json["error"];
  // The place is one phrase already.
  return Error(kind, error.value("what_failed", ""), {.file = error.value("where", "")},
               error.value("what_to_do", ""));
}

std::vector<std::string> warnings_in(const StepResult& result) {
  const Json json = json_in(result);
  if (!json.is_object()) return {};
  return json.value("warnings", std::vector<std::string>());
}

StepResult result_of_stage(const std::string& stage, std::vector<std::string> arguments) {
  StageCall call = call_of(stage, std::move(arguments));
  const Step step{stage, stage, std::move(call.program), std::move(call.arguments), {}};
  std::vector<StepResult> results(1);
  std::vector<Child> children = {start(step, 0)};
  while (is_open(children[0]))
    serve(children, results, [](std::size_t, double, const std::string&) {});
  end(children[0].pid, step, {}, results[0]);
  return results[0];
}

std::optional<Error> error_of_stage(const std::string& stage, std::vector<std::string> arguments) {
  return error_in(result_of_stage(stage, std::move(arguments)));
}

void become(const fs::path& program, const std::vector<std::string>& arguments) {
  const std::vector<char*> c_args = c_arguments(program, arguments);
  ::execv(program.c_str(), c_args.data());
  fail_to_start(program, errno);
}

const std::vector<CommandWord>& command_words() {
  static const std::vector<CommandWord> words = {{"import", "capture", "import", true},
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
                                                 {"refine", "simulate", "refine", false},
                                                 {"certify", "simulate", "certify", false},
                                                 {"cusick", "simulate", "cusick", false},
                                                 {"piece", "simulate", "piece", false},
                                                 {"drapemeter", "compare", "drapemeter", true},
                                                 {"folds", "compare", "folds", false},
                                                 {"repeats", "compare", "repeats", false}};
  return words;
}

StageCall call_of(const std::string& command, std::vector<std::string> arguments) {
  std::string stage = command;
  for (const CommandWord& word : command_words()) {
    if (command != word.name) continue;
    stage = word.stage;
    arguments.insert(arguments.begin(), word.word);
  }
  return {fs::read_symlink("/proc/self/exe").parent_path() / ("drape-" + stage),
          std::move(arguments)};
}

}  // namespace drape
