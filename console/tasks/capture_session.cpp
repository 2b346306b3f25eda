// SPDX-License-Identifier: Apache-2.0
#include "console/tasks/capture_session.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "console/tasks/process.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kLongestLine = 4096;
constexpr int kEnding_ms = 5000;  ///< time given to a session to end before it is killed

}  // namespace

CaptureSession::CaptureSession(const fs::path& rig, const fs::path& recording, Reports reports)
    : reports_(std::move(reports)) {
  words_ = {"capture",          rig.string(), "--out",
            recording.string(), "--preview",  previews_.path().string()};
  const int watch = ::inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
  if (watch < 0 || ::inotify_add_watch(watch, previews_.path().c_str(), IN_MOVED_TO) < 0)
    throw internal_error(fmt::format("cannot watch a folder: {}", std::strerror(errno)));
  Pipe lines;
  pid_ = start_child(program_beside("drape"), words_,
                     {.in = keyboard_.reading(),
                      .out = lines.writing(),
                      .err = lines.writing(),
                      .background = true});
  keyboard_.close_reading();
  lines.close_writing();
  thread_ = std::thread([this, said = std::move(lines), watch]() mutable { listen(said, watch); });
}

CaptureSession::~CaptureSession() {
  {
    const std::lock_guard lock(mutex_);
    keyboard_.close_writing();  // the end of its input acts like `q`
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
  if (keyboard_.writing() < 0 || pid_ <= 0 ||
      ::write(keyboard_.writing(), text.data(), text.size()) != static_cast<ssize_t>(text.size()))
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

void CaptureSession::listen(Pipe& lines, int watch) {
  std::string text, last;
  while (lines.reading() >= 0) {
    std::array<pollfd, 2> watched = {{{lines.reading(), POLLIN, 0}, {watch, POLLIN, 0}}};
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
      lines.take(text);
      for (auto end = text.find('\n'); end != std::string::npos; end = text.find('\n')) {
        last = text.substr(0, end);
        text.erase(0, end + 1);
        reports_.said(last);
      }
      if (text.size() > kLongestLine) text.clear();
    }
  }
  ::close(watch);
  static_cast<void>(await_child(pid_));
  pid_ = 0;
  reports_.ended(last);
}

}  // namespace drape::console
