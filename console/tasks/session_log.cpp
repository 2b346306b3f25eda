// SPDX-License-Identifier: Apache-2.0
#include "console/tasks/session_log.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sstream>

#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::console {

namespace fs = std::filesystem;

SessionLog::SessionLog(fs::path file, std::function<std::string()> clock)
    : file_(std::move(file)), clock_(std::move(clock)) {
  if (fs::exists(file_)) {
    const std::string text = read_text(file_);
    line_open_ = !text.empty() && text.back() != '\n';
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      Json entry = try_json(line);
      if (entry.is_object() && entry.contains("at")) {
        entries_.push_back(std::move(entry));
      } else if (!line.empty() && !(entry.is_object() && entry.contains("schema"))) {
        ++torn_;
      }
    }
  } else {
    write_durable(file_, "{\"schema\":\"drapebench/session-log/1\"}\n");
  }
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC | O_NOFOLLOW);
  if (descriptor_ < 0)
    throw bad_input(fmt::format("the session log cannot be written: {}", std::strerror(errno)),
                    {.file = file_.string()}, "check its permissions and the disk");
}

SessionLog::~SessionLog() {
  ::close(descriptor_);
}

void SessionLog::add(const std::string& who, const std::string& what, Json more) {
  const std::lock_guard lock(mutex_);
  Json entry = {{"at", clock_()}, {"who", who}, {"what", what}};
  for (auto& [key, value] : more.items()) entry[key] = value;
  // Bytes that are not UTF-8 would otherwise throw.
  std::string line = entry.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  if (line_open_) line.insert(0, "\n");
  for (std::size_t done = 0; done < line.size();) {
    const ssize_t wrote = ::write(descriptor_, line.data() + done, line.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) {
      line_open_ = line_open_ || done > 0;
      throw bad_input(fmt::format("the session log cannot be written: {}", std::strerror(errno)),
                      {.file = file_.string()}, "free the disk; what was stored is whole");
    }
    done += static_cast<std::size_t>(wrote);
  }
  line_open_ = false;
  if (::fdatasync(descriptor_) != 0)
    throw bad_input(fmt::format("the session log is not on the disk: {}", std::strerror(errno)),
                    {.file = file_.string()}, "check the disk");
  entries_.push_back(try_json(line));
}

std::vector<Json> SessionLog::entries() const {
  const std::lock_guard lock(mutex_);
  return entries_;
}

std::vector<Json> SessionLog::last(std::size_t most) const {
  const std::lock_guard lock(mutex_);
  const std::size_t count = std::min(most, entries_.size());
  return {entries_.end() - static_cast<std::ptrdiff_t>(count), entries_.end()};
}

std::size_t SessionLog::size() const {
  const std::lock_guard lock(mutex_);
  return entries_.size();
}

}  // namespace drape::console
