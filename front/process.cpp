// SPDX-License-Identifier: Apache-2.0
#include "front/process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "core/error.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

/// A started program with the reading ends of its two pipes; -1 once closed.
struct Child {
  std::size_t step = 0;
  pid_t pid = -1;
  int output = -1;
  int progress = -1;
  std::string progress_rest;
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
  const std::array<int, 2> progress = make_pipe(step.program);
  const std::vector<char*> arguments = c_arguments(step.program, step.arguments);
  const std::string descriptor = std::to_string(progress[1]);
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid < 0) fail_to_start(step.program, errno);
  if (pid == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    ::dup2(output[1], STDOUT_FILENO);
    ::fcntl(progress[1], F_SETFD, 0);
    ::setenv("DRAPE_PROGRESS_FD", descriptor.c_str(), 1);
    ::execv(step.program.c_str(), arguments.data());
    ::_exit(127);
  }
  ::close(output[1]);
  ::close(progress[1]);
  return {index, pid, output[0], progress[0], {}};
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
    watched.push_back({child.output, POLLIN, 0});
    watched.push_back({child.progress, POLLIN, 0});
  }
  if (::poll(watched.data(), watched.size(), 500) < 0) return;
  for (std::size_t i = 0; i < children.size(); ++i) {
    if (watched[2 * i].revents != 0)
      results[children[i].step].output += read_some(children[i].output);
    if (watched[2 * i + 1].revents != 0) pass_progress(children[i], progress);
  }
}

int wait_for(pid_t pid) {
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status)) return WEXITSTATUS(status);
  fmt::print(stderr, "drape: error: a stage was ended by signal {}\n", WTERMSIG(status));
  return static_cast<int>(ErrorKind::internal);
}

}  // namespace

std::vector<StepResult> run_steps(const std::vector<Step>& steps, int at_once,
                                  const StepProgress& progress) {
  std::vector<StepResult> results(steps.size());
  std::vector<Child> children;
  std::size_t next = 0;
  bool failed = false;
  while (!children.empty() || (next < steps.size() && !failed)) {
    while (!failed && next < steps.size() && static_cast<int>(children.size()) < at_once) {
      children.push_back(start(steps[next], next));
      ++next;
    }
    serve(children, results, progress);
    for (std::size_t i = 0; i < children.size();) {
      if (children[i].output >= 0 || children[i].progress >= 0) {
        ++i;
        continue;
      }
      const std::size_t step = children[i].step;
      results[step].exit_code = wait_for(children[i].pid);
      failed = failed || results[step].exit_code > 1;
      progress(step, 1.0, steps[step].what);
      children.erase(children.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  results.resize(next);
  return results;
}

void become(const fs::path& program, const std::vector<std::string>& arguments) {
  const std::vector<char*> c_args = c_arguments(program, arguments);
  ::execv(program.c_str(), c_args.data());
  fail_to_start(program, errno);
}

fs::path stage_program(const std::string& stage) {
  return fs::read_symlink("/proc/self/exe").parent_path() / ("drape-" + stage);
}

}  // namespace drape
