// SPDX-License-Identifier: Apache-2.0
#include "capture/host/isolation.hpp"

#include <linux/audit.h>
#include <linux/capability.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

namespace drape::capture {
namespace {

#if defined(__x86_64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
#else
constexpr std::uint32_t kArchitecture = 0;  // unsupported: no filter is defined
#endif

constexpr std::uint32_t kRefused = SECCOMP_RET_ERRNO | EPERM;
constexpr std::uint32_t kUnknown = SECCOMP_RET_ERRNO | ENOSYS;

constexpr std::initializer_list<int> kNever[] = {
    {SYS_execve, SYS_execveat},
    {SYS_ptrace, SYS_process_vm_readv, SYS_process_vm_writev},
    {SYS_bpf, SYS_perf_event_open, SYS_userfaultfd, SYS_io_uring_setup},
    {SYS_keyctl, SYS_add_key, SYS_request_key},
    {SYS_init_module, SYS_finit_module, SYS_delete_module, SYS_kexec_load, SYS_reboot},
    {SYS_mount, SYS_umount2, SYS_pivot_root, SYS_chroot, SYS_swapon, SYS_open_by_handle_at},
    {SYS_unshare, SYS_setns, SYS_sethostname},
    {SYS_settimeofday, SYS_clock_settime}};

constexpr int kSockets[] = {AF_UNIX, AF_INET, AF_INET6, AF_NETLINK, AF_PACKET};

sock_filter load(std::size_t offset) {
  return BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset));
}

sock_filter unless_equal_skip(std::uint32_t value, std::uint8_t steps) {
  return BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, steps);
}

sock_filter give(std::uint32_t action) {
  return BPF_STMT(BPF_RET | BPF_K, action);
}

/// Low half of the first argument; the kernel reads only this of a flag word or a domain.
constexpr std::size_t kFirstArgument = offsetof(seccomp_data, args);

std::vector<sock_filter> filter() {
  std::vector<sock_filter> program = {load(offsetof(seccomp_data, arch)),
                                      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kArchitecture, 1, 0),
                                      give(kRefused), load(offsetof(seccomp_data, nr))};
  const auto on = [&](int call, const std::vector<sock_filter>& then) {
    program.push_back(unless_equal_skip(static_cast<std::uint32_t>(call),
                                        static_cast<std::uint8_t>(then.size())));
    program.insert(program.end(), then.begin(), then.end());
  };
  for (const auto& calls : kNever)
    for (const int call : calls) on(call, {give(kRefused)});
  // Allows threads but not processes. clone3 hides its flags; when refused, libc uses clone.
  on(SYS_clone3, {give(kUnknown)});
  on(SYS_clone, {load(kFirstArgument), BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, CLONE_THREAD, 0, 1),
                 give(SECCOMP_RET_ALLOW), give(kRefused)});
#ifdef SYS_fork
  for (const int call : {SYS_fork, SYS_vfork}) on(call, {give(kRefused)});
#endif
  std::vector<sock_filter> sockets = {load(kFirstArgument)};
  for (const int kind : kSockets) {
    sockets.push_back(unless_equal_skip(static_cast<std::uint32_t>(kind), 1));
    sockets.push_back(give(SECCOMP_RET_ALLOW));
  }
  sockets.push_back(give(kRefused));
  on(SYS_socket, sockets);
  program.push_back(give(SECCOMP_RET_ALLOW));
  return program;
}

bool drop_capabilities() {
  const std::uint32_t kept = 1U << CAP_NET_RAW | 1U << CAP_NET_ADMIN;
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct data[2]{};
  if (::syscall(SYS_capget, &header, data) != 0) return false;
  for (int cap = 0; cap <= CAP_LAST_CAP; ++cap)
    if (cap > 31 || (kept >> cap & 1U) == 0) ::prctl(PR_CAPBSET_DROP, cap, 0, 0, 0);
  data[0].effective &= kept;
  data[0].permitted &= kept;
  data[0].inheritable = 0;
  data[1] = {};
  return ::syscall(SYS_capset, &header, data) == 0;
}

}  // namespace

bool isolate_camera_host() {
  const bool dropped = drop_capabilities();
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return false;
  if (kArchitecture == 0) return dropped;
  std::vector<sock_filter> program = filter();
  const sock_fprog code{static_cast<unsigned short>(program.size()), program.data()};
  return ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &code) == 0 && dropped;
}

}  // namespace drape::capture
