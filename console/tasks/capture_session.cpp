// SPDX-License-Identifier: Apache-2.0
#include "console/tasks/capture_session.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/inotify.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "console/tasks/process.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kLongestLine = 4096;
constexpr int kEnding_ms = 5000;  ///< until a session that was asked to end is ended

}  // namespace

CaptureSession::CaptureSession(const fs::path& rig, const fs::path& recording, Reports reports)
    : reports_(std::move(reports)) {
  words_ = {"capture",          rig.string(), "--out",
            recording.string(), "--preview",  previews_.path().string()};
  const int watch = ::inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
  if (watch < 0 || ::inotify_add_watch(watch, previews_.path().c_str(), IN_MOVED_TO) < 0)
    throw internal_error(fmt::format("cannot watch a folder: {}", std::strerror(errno)));
  std::array<int, 2> in{}, out{};
  if (::pipe2(in.data(), O_CLOEXEC) != 0 || ::pipe2(out.data(), O_CLOEXEC) != 0)
    throw internal_error(fmt::format("no pipe: {}", std::strerror(errno)));
  pid_ = start_program(words_, {in[0], out[1], out[1], -1});
  ::close(in[0]);
  ::close(out[1]);
  keyboard_ = in[1];
  thread_ = std::thread([this, lines = out[0], watch] { listen(lines, watch); });
}

CaptureSession::~CaptureSession() {
  {
    const std::lock_guard lock(mutex_);
    if (keyboard_ >= 0) ::close(keyboard_);  // the end of its input is `q`
    keyboard_ = -1;
  }
  for (int waited = 0; pid_ > 0 && waited < kEnding_ms; waited += 50) ::usleep(50000);
  if (const pid_t pid = pid_; pid > 0) ::kill(pid, SIGTERM);
  thread_.join();
}

std::string CaptureSession::shown() const {
  return Call{{words_.begin(), words_.end() - 2}}.shown();
}

void CaptureSession::type(const std::string& line) {
  const std::lock_guard lock(mutex_);
  const std::string text = line + "\n";
  if (keyboard_ < 0 || pid_ <= 0 ||
      ::write(keyboard_, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    throw Error(ErrorKind::device, "the cameras are not open", {}, "open them again");
}

std::string CaptureSession::picture(const std::string& camera, std::uint64_t& number) const {
  {
    const std::lock_guard lock(mutex_);
    const auto found = numbers_.find(camera);
    if (found == numbers_.end()) return {};
    number = found->second;
  }
  return read_text(previews_.path() / (camera + ".pgm"));
}

void CaptureSession::listen(int lines, int watch) {
  std::string text, last;
  for (bool open = true; open;) {
    std::array<pollfd, 2> watched = {{{lines, POLLIN, 0}, {watch, POLLIN, 0}}};
    if (::poll(watched.data(), watched.size(), -1) < 0) continue;
    alignas(inotify_event) std::array<char, 8192> buffer;
    if (watched[1].revents != 0) {
      const ssize_t got = ::read(watch, buffer.data(), buffer.size());
      for (ssize_t at = 0; at < got;) {
        const auto* event = reinterpret_cast<const inotify_event*>(buffer.data() + at);
        at += static_cast<ssize_t>(sizeof *event + event->len);
        const fs::path name = event->len > 0 ? event->name : "";
        if (name.extension() != ".pgm") continue;
        std::uint64_t number = 0;
        {
          const std::lock_guard lock(mutex_);
          number = ++numbers_[name.stem()];
        }
        reports_.picture(name.stem(), number);
      }
    }
    if (watched[0].revents != 0) {
      const ssize_t got = ::read(lines, buffer.data(), buffer.size());
      if (got <= 0) open = got < 0 && errno == EINTR;
      if (got > 0) text.append(buffer.data(), static_cast<std::size_t>(got));
      for (auto end = text.find('\n'); end != std::string::npos; end = text.find('\n')) {
        last = text.substr(0, end);
        text.erase(0, end + 1);
        reports_.said(last);
      }
      if (text.size() > kLongestLine) text.clear();
    }
  }
  ::close(lines);
  ::close(watch);
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = 0;
  reports_.ended(last);
}

}  // namespace drape::console
