// SPDX-License-Identifier: Apache-2.0
// Preloaded into a program under test: counts the calls that change files, over all its processes,
// and at the n-th ends them all or lets the call fail.
//
//   DRAPE_FAIL_COUNTER  file of 8 bytes that holds the count; without it nothing is done
//   DRAPE_FAIL_AT       number of the call, from 1; absent: only count
//   DRAPE_FAIL_WITH     kill: half of a write is done, then SIGKILL to the process group;
//                       eio: this call alone fails; enospc: nothing can grow from this call on;
//                       cut: the ext4 file system DRAPE_FAIL_MOUNT loses power, then kill
//   DRAPE_FAIL_UNSYNCED  set: fsync, fdatasync and syncfs do nothing, for the control of power cuts
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace {

enum class Fault { none, kill, eio, enospc, cut };

struct Plan {
  std::atomic<long>* count = nullptr;
  long at = 0;
  Fault fault = Fault::none;
  bool unsynced = false;

  Plan() {
    const char* file = std::getenv("DRAPE_FAIL_COUNTER");
    if (file == nullptr) return;
    const int fd = ::open(file, O_RDWR | O_CLOEXEC);
    if (fd < 0) return;
    void* memory = ::mmap(nullptr, sizeof(long), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    ::close(fd);
    if (memory != MAP_FAILED) count = static_cast<std::atomic<long>*>(memory);
    if (const char* number = std::getenv("DRAPE_FAIL_AT")) at = std::atol(number);
    unsynced = std::getenv("DRAPE_FAIL_UNSYNCED") != nullptr;
    const char* with = std::getenv("DRAPE_FAIL_WITH");
    if (with == nullptr) return;
    fault = std::strcmp(with, "eio") == 0      ? Fault::eio
            : std::strcmp(with, "enospc") == 0 ? Fault::enospc
            : std::strcmp(with, "cut") == 0    ? Fault::cut
                                               : Fault::kill;
  }
};

const Plan& plan() {
  static const Plan the_plan;
  return the_plan;
}

/// Counts one call and returns what must happen to it.
Fault next(bool grows) {
  const Plan& p = plan();
  if (p.count == nullptr) return Fault::none;
  const long number = p.count->fetch_add(1) + 1;
  if (p.at == 0 || number < p.at) return Fault::none;
  if (p.fault == Fault::enospc) return grows ? Fault::enospc : Fault::none;
  return number == p.at ? p.fault : Fault::none;
}

/// Loses data that were not written through, including the journal's tail: EXT4_IOC_SHUTDOWN with
/// EXT4_GOING_FLAGS_NOLOGFLUSH of the kernel's ext4 documentation.
void cut_power() {
  const char* mount = std::getenv("DRAPE_FAIL_MOUNT");
  const int fd = mount == nullptr ? -1 : ::open(mount, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  unsigned int without_log = 2;
  if (fd < 0 || ::ioctl(fd, _IOR('X', 125, unsigned int), &without_log) != 0) ::_exit(99);
}

bool ends(Fault fault) {
  return fault == Fault::kill || fault == Fault::cut;
}

[[noreturn]] void end_all(Fault fault) {
  if (fault == Fault::cut) cut_power();
  ::kill(0, SIGKILL);
  ::_exit(137);
}

int failed(Fault fault) {
  errno = fault == Fault::eio ? EIO : ENOSPC;
  return -1;
}

/// True for files and folders; a crash cannot damage pipes and terminals.
bool is_file(int fd) {
  struct stat status {};
  return ::fstat(fd, &status) == 0 && (S_ISREG(status.st_mode) || S_ISDIR(status.st_mode));
}

template <class Function>
Function* original(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

/// A call that cannot be done by half.
template <class Function, class... Arguments>
auto passed_on(const char* name, bool counted, bool grows, Arguments... arguments) {
  const Fault fault = counted ? next(grows) : Fault::none;
  using Result = decltype(original<Function>(name)(arguments...));
  if (ends(fault)) end_all(fault);
  if (fault != Fault::none) return Result{failed(fault)};
  return original<Function>(name)(arguments...);
}

int synced(const char* name, int fd) {
  const bool file = is_file(fd);
  if (!plan().unsynced || !file) return passed_on<int(int)>(name, file, false, fd);
  static_cast<void>(next(false));
  return 0;
}

}  // namespace

extern "C" {

ssize_t write(int fd, const void* data, size_t size) {
  static auto* const call = original<ssize_t(int, const void*, size_t)>("write");
  const Fault fault = is_file(fd) ? next(true) : Fault::none;
  if (fault == Fault::none) return call(fd, data, size);
  if (!ends(fault)) return failed(fault);
  static_cast<void>(call(fd, data, size / 2));
  end_all(fault);
}

ssize_t pwrite64(int fd, const void* data, size_t size, off64_t at) {
  static auto* const call = original<ssize_t(int, const void*, size_t, off64_t)>("pwrite64");
  const Fault fault = is_file(fd) ? next(true) : Fault::none;
  if (fault == Fault::none) return call(fd, data, size, at);
  if (!ends(fault)) return failed(fault);
  static_cast<void>(call(fd, data, size / 2, at));
  end_all(fault);
}

ssize_t pwrite(int fd, const void* data, size_t size, off_t at) {
  return pwrite64(fd, data, size, at);
}

ssize_t writev(int fd, const iovec* parts, int count) {
  return passed_on<ssize_t(int, const iovec*, int)>("writev", is_file(fd), true, fd, parts, count);
}

int fsync(int fd) {
  return synced("fsync", fd);
}
int fdatasync(int fd) {
  return synced("fdatasync", fd);
}
int syncfs(int fd) noexcept {
  return synced("syncfs", fd);
}
int mkdir(const char* folder, mode_t mode) noexcept {
  return passed_on<int(const char*, mode_t)>("mkdir", true, true, folder, mode);
}
int ftruncate(int fd, off_t size) {
  return passed_on<int(int, off_t)>("ftruncate", true, false, fd, size);
}
int ftruncate64(int fd, off64_t size) {
  return passed_on<int(int, off64_t)>("ftruncate64", true, false, fd, size);
}
int rename(const char* from, const char* to) noexcept {
  return passed_on<int(const char*, const char*)>("rename", true, true, from, to);
}
int link(const char* from, const char* to) noexcept {
  return passed_on<int(const char*, const char*)>("link", true, true, from, to);
}
int unlink(const char* file) noexcept {
  return passed_on<int(const char*)>("unlink", true, false, file);
}
int unlinkat(int folder, const char* file, int flags) noexcept {
  return passed_on<int(int, const char*, int)>("unlinkat", true, false, folder, file, flags);
}
int remove(const char* file) noexcept {
  return passed_on<int(const char*)>("remove", true, false, file);
}

}  // extern "C"
