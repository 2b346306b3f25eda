// SPDX-License-Identifier: Apache-2.0
#include "core/program/child.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "core/fields/records.hpp"

namespace drape {
namespace {

constexpr const char kProgressVariable[] = "DRAPE_PROGRESS_FD=";

}  // namespace

Pipe::Pipe() {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0)
    throw internal_error(fmt::format("no pipe: {}", std::strerror(errno)));
  reading_ = Descriptor(ends[0]);
  writing_ = Descriptor(ends[1]);
}

void Pipe::take(std::string& text, std::size_t most) {
  std::array<char, 65536> buffer;
  const ssize_t got = ::read(reading(), buffer.data(), buffer.size());
  if (got < 0 && errno == EINTR) return;
  if (got <= 0) return close_reading();
  text.append(buffer.data(), static_cast<std::size_t>(got));
  if (text.size() > most) text.erase(0, text.size() - most);
}

/// Prepares everything before fork: between fork and exec another thread may hold a lock.
pid_t start_child(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                  const ChildStreams& streams) {
  if (!std::filesystem::exists(program))
    throw internal_error("a program of drapebench is missing beside `drape`",
                         {.file = program.string()});
  std::vector<char*> words = {const_cast<char*>(program.c_str())};
  for (const std::string& word : arguments) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  std::string descriptor = kProgressVariable + std::to_string(streams.progress);
  std::vector<char*> environment;
  for (char** one = environ; *one != nullptr; ++one)
    if (std::strncmp(*one, kProgressVariable, std::strlen(kProgressVariable)) != 0)
      environment.push_back(*one);
  if (streams.progress >= 0) environment.push_back(descriptor.data());
  environment.push_back(nullptr);
  const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  const int nowhere = streams.quiet ? nothing : -1;
  const pid_t parent = ::getpid();
  std::fflush(nullptr);
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    if (streams.background) ::setpgid(0, 0);
    if (streams.background || streams.in >= 0)
      ::dup2(streams.in >= 0 ? streams.in : nothing, STDIN_FILENO);
    for (const auto& [given, as] :
         {std::pair{streams.out, STDOUT_FILENO}, {streams.err, STDERR_FILENO}})
      if (const int to = given >= 0 ? given : nowhere; to >= 0) ::dup2(to, as);
    // Some libraries open descriptors that a program would inherit.
    ::close_range(STDERR_FILENO + 1, ~0U, CLOSE_RANGE_CLOEXEC);
    for (const int one : streams.kept) ::fcntl(one, F_SETFD, 0);
    if (streams.progress >= 0) ::fcntl(streams.progress, F_SETFD, 0);
    ::execve(program.c_str(), words.data(), environment.data());
    ::_exit(127);
  }
  const int why = errno;
  ::close(nothing);
  if (pid < 0)
    throw internal_error(fmt::format("cannot start the program: {}", std::strerror(why)),
                         {.file = program.string()});
  return pid;
}

ChildEnd await_child(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status)) return {WEXITSTATUS(status), 0};
  return {128 + WTERMSIG(status), WTERMSIG(status)};
}

ChildEnd run_child(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                   std::string& output) {
  Pipe out;
  const pid_t child =
      start_child(program, arguments, {.out = out.writing(), .background = true, .quiet = true});
  out.close_writing();
  while (out.reading() >= 0) out.take(output);
  return await_child(child);
}

void pass_progress(std::string& text, const ChildProgress& progress) {
  for (auto end = text.find('\n'); end != std::string::npos; end = text.find('\n')) {
    const std::string line = text.substr(0, end);
    text.erase(0, end + 1);
    const auto space = line.find(' ');
    if (space == std::string::npos) continue;
    progress(std::clamp(std::atof(line.c_str()), 0.0, 1.0), line.substr(space + 1));
  }
}

std::optional<Error> error_printed(const std::string& output, int exit_code) {
  const std::size_t begin = output.find("{\n");
  if (begin == std::string::npos) return std::nullopt;
  Value json;
  try {
    json = json_value(std::string_view(output).substr(begin));
  } catch (const Error&) {
    return std::nullopt;
  }
  const Value* error = json.find("error");
  if (const Value* problems = json.find("problems"))
    if (const auto* list = problems->get_if<Value::List>(); list != nullptr && !list->empty())
      error = &list->front();
  if (error == nullptr) return std::nullopt;
  const auto text = [&](const char* key) {
    const auto* words = error->find_as<std::string>(key);
    return words == nullptr ? std::string() : *words;
  };
  return Error(static_cast<ErrorKind>(exit_code), text("what_failed"), {.file = text("where")},
               text("what_to_do"));
}

std::filesystem::path program_beside(const std::string& name) {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / name;
}

}  // namespace drape
