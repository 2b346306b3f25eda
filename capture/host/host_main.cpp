// SPDX-License-Identifier: Apache-2.0
// drape-camera-host: one camera in its own process, so that a fault of the camera, its library or
// its network cannot end the capture.

#include <linux/audit.h>
#include <linux/capability.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <vector>

#include "capture/host/camera_host.hpp"
#include "core/fields/records.hpp"
#include "core/program/program.hpp"

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

/// Offset of the first argument's low half, the only part used of flags and socket domains.
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

/// Irrevocably drops the privileges that a camera host does not need: all capabilities except those
/// for the stream's socket (CAP_NET_RAW, CAP_NET_ADMIN), new privileges, programs and processes,
/// other types of sockets, and system calls used to attack the kernel or read other processes. An
/// exploit of the camera library by malicious packets stays in this process. Returns false if the
/// kernel refuses.
bool isolate_camera_host() {
  const bool dropped = drop_capabilities();
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return false;
  if (kArchitecture == 0) return dropped;
  std::vector<sock_filter> program = filter();
  const sock_fprog code{static_cast<unsigned short>(program.size()), program.data()};
  return ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &code) == 0 && dropped;
}

// Sanitizers reserve terabytes of address space.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

using Clock = std::chrono::steady_clock;
constexpr auto kAliveEvery = std::chrono::milliseconds(100);
constexpr int kClockEvery = 5;  ///< alive messages per clock reading
constexpr int kFirstClockReadings = 10;
constexpr double kPatience_s = 0.05;

Error no_memory() {
  return {ErrorKind::device,
          "its camera host needs more memory than it may have",
          {},
          "look for junk on the camera's network; record smaller pictures"};
}

/// Camera end of the channel: opens the camera, executes commands on `control` and passes frames
/// through the shared memory until the peer closes. Sends a heartbeat every 100 ms. A fault of the
/// camera is sent as a message and ends run(); nothing is thrown.
class Server {
 public:
  Server(Descriptor control, Descriptor memory)
      : control_(std::move(control)), memory_(std::move(memory)) {}

  void run() {
    std::thread grabber;
    try {
      Clock::time_point alive = Clock::now();
      Order order;
      while (!failed_) {
        const Received got = receive(control_.get(), 20, order);
        if (got == Received::closed) break;
        if (got == Received::message) obey(order);
        if (camera_ && !grabber.joinable()) grabber = std::thread([this] { grab(); });
        if (clock_due_.exchange(false)) tell_alive(true);
        if (Clock::now() - alive >= kAliveEvery) {
          alive = Clock::now();
          tell_alive();
        }
      }
    } catch (const Error& error) {
      tell(error);
    } catch (const std::bad_alloc&) {
      tell(no_memory());
    } catch (const std::system_error&) {  // not enough memory for a thread's stack
      tell(no_memory());
    } catch (const std::exception& error) {
      tell(internal_error(error.what()));
    }
    ended_ = true;
    changed_.notify_all();
    if (grabber.joinable()) grabber.join();
  }

 private:
  void tell(const Error& error) {
    send(control_.get(), News{.kind = News::Kind::error,
                              .what = error.what_failed(),
                              .what_to_do = error.what_to_do()});
  }

  void obey(const Order& order) {
    switch (order.kind) {
      case Order::Kind::open:
        return open(order);
      case Order::Kind::start:
        set_running(true);
        send(control_.get(), News{.kind = News::Kind::started});
        return;
      case Order::Kind::stop:
        set_running(false);
        tell_alive(true);  // final counters, and a clock reading after the last frame
        send(control_.get(), News{.kind = News::Kind::stopped});
        return;
      case Order::Kind::trigger:
        if (camera_) camera_->trigger();
        return;
      case Order::Kind::light:
        if (camera_ && order.settings) set_light(*order.settings);
        return;
      case Order::Kind::free:
        const std::lock_guard lock(mutex_);
        free_.push_back(order.slot);
    }
  }

  void open(const Order& order) {
    camera_ = open_camera(order.address.value_or(CameraAddress{}));
    const CameraSettings wanted = order.settings.value_or(CameraSettings{});
    News ready{.kind = News::Kind::ready, .settings = camera_->configure(wanted)};
    add_light(ready.settings);
    // Frames are then paired by time, and a set waits for a reading after its frames.
    by_time_ =
        (wanted.trigger == TriggerSource::free_run || wanted.trigger == TriggerSource::line) &&
        !camera_->on_host_clock();
    if (camera_->frame_bytes() > order.slot_bytes)
      throw Error(ErrorKind::device, "the camera's frames are larger than the rig says", {},
                  "correct width_px and height_px in rig.toml");
    frames_.emplace(std::move(memory_), order.slots, order.slot_bytes);
    for (std::size_t i = 0; i < order.slots; ++i) free_.push_back(i);
    ready.identity = camera_->identity();
    ready.first_id = camera_->frame_ids().first;
    ready.last_id = camera_->frame_ids().last;
    ready.on_host_clock = camera_->on_host_clock();
    for (int i = 0; i < kFirstClockReadings; ++i) add_clock(ready);
    send(control_.get(), ready);
  }

  /// Changes exposure and gain; a camera that refuses keeps its values.
  void set_light(const CameraSettings& wanted) {
    News answer{.kind = News::Kind::light};
    try {
      answer.settings = camera_->set_light(wanted);
      add_light(answer.settings);
    } catch (const Error& error) {
      answer.what = error.what_failed();
      answer.what_to_do = error.what_to_do();
      answer.settings = light_before(wanted);
    }
    send(control_.get(), answer);
  }

  std::vector<SettingReadBack> light_before(const CameraSettings& refused) {
    CameraSettings before;
    if (refused.exposure_us) before.exposure_us = light_.exposure_us;
    if (refused.gain_db) before.gain_db = light_.gain_db;
    try {
      return camera_->set_light(before);
    } catch (const Error&) {  // the answer already names the refused value
      return {};
    }
  }

  /// Updates the settings with what the camera reports.
  void add_light(const std::vector<SettingReadBack>& settings) {
    if (const auto us = setting_in(settings, "exposure_us")) light_.exposure_us = std::stod(*us);
    for (const char* name : {"gain_db", "gain_camera_units"})
      if (const auto gain = setting_in(settings, name)) light_.gain_db = std::stod(*gain);
  }

  void add_clock(News& to) {
    if (const auto sample = camera_->read_clock()) to.clock.push_back(*sample);
  }

  void set_running(bool running) {
    if (!camera_) return;
    std::unique_lock lock(mutex_);
    wanted_ = running;
    changed_.notify_all();
    changed_.wait(lock, [&] { return failed_ || running_ == running; });
  }

  void add_counters(News& to) const {
    to.counters = camera_->counters();
    to.without_room = no_slot_;
  }

  void tell_alive(bool read_clock = false) {
    News alive{.kind = News::Kind::alive};
    if (camera_) {
      if (++alive_count_ % kClockEvery == 0 || read_clock) add_clock(alive);
      add_counters(alive);
    }
    send(control_.get(), alive);
  }

  /// Thread that alone starts, stops and reads the stream.
  void grab() {
    try {
      while (!ended_) {
        if (follow_orders()) grab_one();
      }
      camera_->stop();
    } catch (const Error& error) {
      tell(error);
      const std::lock_guard lock(mutex_);
      failed_ = true;
      changed_.notify_all();
    }
  }

  /// Handles commands; returns true while streaming.
  bool follow_orders() {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::milliseconds(running_ ? 0 : 20),
                      [&] { return ended_ || wanted_ != running_; });
    if (wanted_ != running_) {
      wanted_ ? camera_->start() : camera_->stop();
      running_ = wanted_;
      changed_.notify_all();
    }
    return running_;
  }

  void grab_one() {
    const auto frame = camera_->next(kPatience_s);
    if (!frame) return;
    News news{.kind = News::Kind::frame};
    FrameNews& now = news.frame.emplace();
    static_cast<FrameHead&>(now) = *frame;
    now.id = std::min<std::uint64_t>(frame->id, std::numeric_limits<std::int64_t>::max());
    if (now.device_ns == 0) now.device_ns.reset();
    add_counters(news);
    if (frame->complete) {
      const auto slot = take_slot();
      if (!slot) return;
      const auto to = frames_->slot(*slot);
      if (frame->bytes > to.size()) return;
      std::copy_n(frame->pixels, frame->bytes, to.begin());
      now.slot = *slot;
      now.bytes = frame->bytes;
    }
    send(control_.get(), news);
    clock_due_ = by_time_.load();
  }

  std::optional<std::size_t> take_slot() {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) {
      ++no_slot_;
      return std::nullopt;
    }
    // Reuses the most recently freed slot, so that only a few slots are written if few frames wait.
    const std::size_t slot = free_.back();
    free_.pop_back();
    return slot;
  }

  Descriptor control_, memory_;
  std::unique_ptr<CameraDevice> camera_;
  std::optional<SharedFrames> frames_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::size_t> free_;
  bool wanted_ = false, running_ = false;
  std::atomic<bool> ended_{false}, failed_{false}, by_time_{false}, clock_due_{false};
  std::atomic<std::int64_t> no_slot_{0};
  int alive_count_ = 0;
  CameraSettings light_;  ///< exposure and gain last accepted
};

/// Makes this process die with its parent, ignore SIGINT, cap its memory and isolate itself.
void become_camera_host(int memory_limit_mb) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::signal(SIGINT, SIG_IGN);  // Ctrl-C reaches the capture, which ends its hosts
  const rlim_t bytes = static_cast<rlim_t>(memory_limit_mb) << 20;
  const rlimit limit{bytes, bytes};
  if (!kSanitized) ::setrlimit(RLIMIT_AS, &limit);
  if (!isolate_camera_host())
    throw Error(ErrorKind::device, "the kernel does not let a camera host be confined", {},
                "use a kernel with seccomp filters (CONFIG_SECCOMP_FILTER)");
}

struct HostArguments {
  bool listing = false, sizes = false;
  int control = -1, memory = -1, limit_mb = 2048;
};
void fields(Fields& f, HostArguments& a) {
  f.otherwise({"list", "print the cameras that answer as JSON and exit"}, a.listing);
  f.otherwise({"sizes", "with --list: open each to read its image size"}, a.sizes);
  f.otherwise({"control", "inherited descriptor of the commands"}, a.control);
  f.otherwise({"memory", "inherited descriptor of the shared frames"}, a.memory);
  f.otherwise({"memory_limit_mb", "address space of this process, in MB"}, a.limit_mb);
}

int run(const HostArguments& given, const CommonOptions&) {
  become_camera_host(given.limit_mb);
  if (given.listing || given.control < 0 || given.memory < 0) {
    print_text(one_line(value_of(FoundDevices{find_devices(given.sizes)})) + "\n");
    return 0;
  }
  Server(Descriptor(given.control), Descriptor(given.memory)).run();
  return 0;
}

}  // namespace
}  // namespace drape::capture

int main(int argc, char** argv) {
  using namespace drape::capture;
  return drape::run_command<HostArguments>(
      argc, argv, "drape-camera-host",
      "Runs one camera in a separate process. Started by drape capture, drape capture cameras "
      "and\n"
      "drape doctor; by itself it lists the cameras that answer:\n\n"
      "  drape-camera-host --list\n",
      run);
}
