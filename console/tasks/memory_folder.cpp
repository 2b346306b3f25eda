// SPDX-License-Identifier: Apache-2.0
#include "console/tasks/memory_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;
constexpr std::string_view kName = "drape-bench-";
constexpr int kAttempts = 10;

/// Opens and locks the folder; negative if another program holds it, or if it is not a folder.
int locked(const fs::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (fd >= 0 && ::flock(fd, LOCK_EX | LOCK_NB) == 0) return fd;
  if (fd >= 0) ::close(fd);
  return -1;
}

bool is_ours(int folder) {
  struct stat seen {};
  return ::fstat(folder, &seen) == 0 && seen.st_uid == ::geteuid();
}

/// Removes folders that nobody holds, because their programs were killed.
void remove_left_behind(const fs::path& place) {
  std::error_code ignored;
  std::vector<fs::path> found;
  for (fs::directory_iterator at(place, ignored), end; at != end; at.increment(ignored))
    if (at->path().filename().string().starts_with(kName)) found.push_back(at->path());
  for (const fs::path& folder : found) {
    const int fd = locked(folder);
    if (fd < 0) continue;
    if (is_ours(fd)) fs::remove_all(folder, ignored);
    ::close(fd);
  }
}

}  // namespace

MemoryFolder::MemoryFolder(const fs::path& place) {
  remove_left_behind(place);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    std::string name = (place / fmt::format("{}XXXXXX", kName)).string();
    if (::mkdtemp(name.data()) == nullptr)
      throw bad_input(fmt::format("cannot be made: {}", std::strerror(errno)), {.file = name},
                      "free memory, or the disk");
    path_ = name;
    lock_ = locked(path_);
    if (lock_ >= 0 && fs::exists(path_)) return;
    if (lock_ >= 0) ::close(lock_);  // another program removed it before it was locked
  }
  throw internal_error(fmt::format("{} cannot be locked", path_.string()));
}

MemoryFolder::~MemoryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  ::close(lock_);
}

fs::path MemoryFolder::in_memory() {
  return fs::is_directory("/dev/shm") ? "/dev/shm" : "/tmp";
}

}  // namespace drape::console
