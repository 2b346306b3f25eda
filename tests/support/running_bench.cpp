// SPDX-License-Identifier: Apache-2.0
#include "tests/support/running_bench.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "core/files/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {

namespace fs = std::filesystem;

namespace {

/// A program that the server started, -1 where there is none. One that is still the server's copy
/// has not yet what ends it with the server.
pid_t child_of(pid_t server) {
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ostringstream stat;
    stat << std::ifstream(entry.path() / "stat").rdbuf();
    const std::size_t end = stat.str().rfind(')');
    char state = 0;
    pid_t parent = 0;
    if (end == std::string::npos ||
        !(std::istringstream(stat.str().substr(end + 1)) >> state >> parent))
      continue;
    const bool is_copy = stat.str().find("(drape-bench)") != std::string::npos;
    if (parent == server && state != 'Z' && !is_copy) return std::stoi(name);
  }
  return -1;
}

}  // namespace

RunningBench::RunningBench(const fs::path& rig, const fs::path& out, int limit_kb, bool replay) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  const std::string name = program("drape-bench");
  pid_ = ::fork();
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::dup2(ends[1], STDOUT_FILENO);
    if (limit_kb > 0) {
      const rlimit limit{static_cast<rlim_t>(limit_kb) * 1024,
                         static_cast<rlim_t>(limit_kb) * 1024};
      ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    ::execl(name.c_str(), name.c_str(), rig.c_str(), "--out", out.c_str(), "--port", "0", "--json",
            replay ? "--replay" : nullptr, nullptr);
    ::_exit(127);
  }
  ::close(ends[1]);
  std::string text;
  char byte = 0;
  while (text.find('}') == std::string::npos && ::read(ends[0], &byte, 1) == 1) text += byte;
  ::close(ends[0]);
  const Json json = try_json(text);
  if (!json.is_object() || !json.contains("address"))
    throw std::runtime_error("drape-bench does not listen: " + text);
  address_ = json["address"].get<std::string>();
}

RunningBench::~RunningBench() {
  kill();
}

void RunningBench::kill() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

int RunningBench::end(int signal) {
  int status = 0;
  ::kill(pid_, signal);
  ::waitpid(pid_, &status, 0);
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void RunningBench::hold_job() {
  for (int look = 0; look < 1000 && held_ < 0; ++look) {
    held_ = child_of(pid_);
    if (held_ < 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  if (held_ < 0 || ::kill(held_, SIGSTOP) != 0) throw std::runtime_error("no job runs");
}

void RunningBench::let_job_go() {
  ::kill(held_, SIGCONT);
  held_ = -1;
}

bool RunningBench::runs() const {
  return pid_ > 0 && ::waitpid(pid_, nullptr, WNOHANG) == 0;
}

double RunningBench::memory_mb() const {
  const std::string status = about("status");
  return 1.024e-3 * std::stod(status.substr(status.find("VmHWM:") + 6));
}

double RunningBench::cpu_s() const {
  const std::string stat = about("stat");
  std::istringstream fields(stat.substr(stat.rfind(')') + 2));
  std::string skipped;
  for (int k = 0; k < 11; ++k) fields >> skipped;
  double user = 0, system = 0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

/// The kernel's text about the process; its files have no size.
std::string RunningBench::about(const std::string& what) const {
  std::ostringstream text;
  text << std::ifstream(fmt::format("/proc/{}/{}", pid_, what)).rdbuf();
  return text.str();
}

std::string RunningBench::origin() const {
  return address_.substr(0, address_.find('/', 7));
}

int RunningBench::port() const {
  return std::stoi(origin().substr(origin().rfind(':') + 1));
}

std::string RunningBench::token() const {
  const std::string path = address_.substr(origin().size() + 1);
  return path.substr(0, path.size() - 1);
}

CurlAnswer curl(const std::string& arguments) {
  const Outcome outcome = run_line("curl -s --max-time 100 -w '\\n%{http_code}' " + arguments);
  CurlAnswer answer;
  const std::size_t end = outcome.text.rfind('\n');
  if (end == std::string::npos) return answer;
  answer.body = outcome.text.substr(0, end);
  answer.status = std::atoi(outcome.text.c_str() + end + 1);
  return answer;
}

Json RunningBench::get(const std::string& route) const {
  return try_json(curl("'" + address_ + route + "'").body);
}

int RunningBench::act(const Json& what) const {
  return curl(fmt::format("-H 'Content-Type: application/json' --data-binary '{}' '{}api/do'",
                          what.dump(), address_))
      .status;
}

Json RunningBench::idle_state() const {
  for (int k = 0; k < 1200; ++k) {
    Json state = get("api/state");
    bool idle = state.is_object();
    if (idle)
      for (const Json& job : state["jobs"])
        idle = idle && job["state"] != "running" && job["state"] != "waiting";
    if (idle) return state;
    std::this_thread::sleep_for(std::chrono::milliseconds(250));
  }
  throw std::runtime_error("the bench does not come to its end");
}

}  // namespace drape::test
