// SPDX-License-Identifier: Apache-2.0
#include "console/tasks/process.hpp"

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
#include "core/files/json_file.hpp"
#include "core/program/shell_word.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kMostOutput = 64U << 20U;
constexpr std::size_t kMostLine = 4096;
constexpr int kSignalled = 128;

/// The reading end of a pipe whose writing end a child holds.
class Pipe {
 public:
  Pipe() {
    if (::pipe2(ends_.data(), O_CLOEXEC) != 0)
      throw internal_error(fmt::format("no pipe: {}", std::strerror(errno)));
  }
  ~Pipe() {
    close_writing();
    close_reading();
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  void close_writing() { close_one(ends_[1]); }
  void close_reading() { close_one(ends_[0]); }
  [[nodiscard]] int reading() const { return ends_[0]; }
  [[nodiscard]] int writing() const { return ends_[1]; }

  /// Appends what is there; closes at the end of the stream.
  void take(std::string& text, std::size_t most) {
    std::array<char, 65536> buffer;
    const ssize_t got = ::read(ends_[0], buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) return;
    if (got <= 0) return close_reading();
    text.append(buffer.data(), static_cast<std::size_t>(got));
    if (text.size() > most) text.erase(0, text.size() - most);
  }

 private:
  static void close_one(int& descriptor) {
    if (descriptor >= 0) ::close(descriptor);
    descriptor = -1;
  }
  std::array<int, 2> ends_{};
};

void pass(std::string& text, const CallProgress& progress) {
  for (auto end = text.find('\n'); end != std::string::npos; end = text.find('\n')) {
    const std::string line = text.substr(0, end);
    text.erase(0, end + 1);
    const auto space = line.find(' ');
    if (space == std::string::npos) continue;
    progress(std::clamp(std::atof(line.c_str()), 0.0, 1.0), line.substr(space + 1));
  }
}

std::string text_of(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// What a program says of its own end in its --json ending.
std::string sentence_of(const std::string& output, int exit_code) {
  const std::size_t begin = output.find('{');
  const Json json = begin == std::string::npos ? Json() : try_json(output.substr(begin));
  if (json.is_object()) {
    if (const auto error = json.find("error"); error != json.end() && error->is_object()) {
      std::string text = text_of(*error, "what_failed");
      if (const std::string where = text_of(*error, "where"); !where.empty())
        text += " (" + where + ")";
      if (const std::string act = text_of(*error, "what_to_do"); !act.empty())
        text += "; to do: " + act;
      return text;
    }
    for (const char* key : {"sentence", "cause"})
      if (std::string text = text_of(json, key); !text.empty()) return text;
  }
  if (exit_code > kSignalled) return fmt::format("ended by signal {}", exit_code - kSignalled);
  return exit_code == 0 ? "done" : fmt::format("ended with code {}", exit_code);
}

int wait_for(pid_t pid) {
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : kSignalled + WTERMSIG(status);
}

}  // namespace

std::string Call::shown() const {
  std::string text = "drape";
  for (const std::string& word : words) text += " " + shell_word(word);
  return text;
}

/// Everything between fork and exec is done beforehand: another thread may hold a lock then.
pid_t start_program(const std::vector<std::string>& words, const Streams& streams) {
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / "drape";
  std::vector<char*> arguments = {const_cast<char*>(program.c_str())};
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  std::string descriptor = "DRAPE_PROGRESS_FD=" + std::to_string(streams.progress);
  std::vector<char*> environment;
  for (char** one = environ; *one != nullptr; ++one)
    if (std::strncmp(*one, "DRAPE_PROGRESS_FD=", 18) != 0) environment.push_back(*one);
  if (streams.progress >= 0) environment.push_back(descriptor.data());
  environment.push_back(nullptr);
  const int nothing = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    ::setpgid(0, 0);  // Ctrl-C is for this program, which lets its children end in order
    ::dup2(streams.in >= 0 ? streams.in : nothing, STDIN_FILENO);
    if (streams.out >= 0) ::dup2(streams.out, STDOUT_FILENO);
    if (streams.err >= 0) ::dup2(streams.err, STDERR_FILENO);
    if (streams.progress >= 0) ::fcntl(streams.progress, F_SETFD, 0);
    ::execve(program.c_str(), arguments.data(), environment.data());
    ::_exit(127);
  }
  ::close(nothing);
  if (pid < 0)
    throw internal_error(fmt::format("cannot start a program: {}", std::strerror(errno)),
                         {.file = program.string()});
  return pid;
}

CallEnd run_call(const Call& call, const CallProgress& progress, std::atomic<pid_t>& child) {
  if (call.before) call.before();
  std::vector<std::string> words = call.words;
  words.emplace_back("--json");
  Pipe output, steps;
  const pid_t pid = start_program(words, {-1, output.writing(), -1, steps.writing()});
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
    pass(lines, progress);
  }
  child = 0;
  end.exit_code = wait_for(pid);
  end.sentence = sentence_of(end.output, end.exit_code);
  return end;
}

}  // namespace drape::console
