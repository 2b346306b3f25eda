// SPDX-License-Identifier: Apache-2.0
#include "capture/host/camera_host.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>

#include "core/error.hpp"

namespace drape::capture {
namespace {

constexpr int kControl = 3, kMemory = 4;  ///< descriptors as the child sees them

}  // namespace

CameraHost::CameraHost(CameraAddress address, CameraSettings settings, HostOptions options)
    : address_(std::move(address)), settings_(std::move(settings)), options_(std::move(options)) {}

CameraHost::~CameraHost() {
  control_.reset();  // the host ends by itself and lets go of the camera
  for (int i = 0; process_ > 0 && i < 100; ++i) {
    if (::waitpid(process_, nullptr, WNOHANG) != 0) return;
    ::usleep(10'000);
  }
  kill();
}

void CameraHost::launch() {
  kill();
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0)
    throw internal_error("no socket pair for the camera host");
  control_ = Descriptor(ends[0]);
  const Descriptor theirs(ends[1]);
  memory_.emplace(options_.slots, options_.slot_bytes);
  spawn(theirs.get(), memory_->descriptor());
  fault_.reset();
  ready_ = false;
  started_ = false;
  clock_.clear();
  frames_.clear();
  counters_before_ = counters();
  counters_ = {};
  last_sign_ = std::chrono::steady_clock::now();
  ++launches_;
  // Once known, the address spares the second of discovery.
  CameraAddress address = address_;
  if (address.backend == Backend::aravis && !identity_.host_address.empty()) {
    address.device = identity_.address;
    address.host_address = identity_.host_address;
  }
  send_message(control_.get(), {{"do", "open"},
                                {"address", json_of(address)},
                                {"settings", json_of(settings_)},
                                {"slots", options_.slots},
                                {"slot_bytes", options_.slot_bytes}});
}

void CameraHost::spawn(int control, int memory) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  // Copies above the wanted numbers first, so that neither overwrites the other.
  const Descriptor c(::fcntl(control, F_DUPFD_CLOEXEC, 10));
  const Descriptor m(::fcntl(memory, F_DUPFD_CLOEXEC, 10));
  posix_spawn_file_actions_adddup2(&actions, c.get(), kControl);
  posix_spawn_file_actions_adddup2(&actions, m.get(), kMemory);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  std::vector<std::string> words = {options_.program.string(),
                                    "--control",
                                    std::to_string(kControl),
                                    "--memory",
                                    std::to_string(kMemory),
                                    "--memory-limit-mb",
                                    std::to_string(options_.memory_limit_mb)};
  std::vector<char*> arguments;
  arguments.reserve(words.size());
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const int refused =
      ::posix_spawn(&process_, words[0].c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (refused == 0) return;
  process_ = -1;
  throw Error(ErrorKind::device, "the camera host cannot be started", {.file = words[0]},
              "build or install it beside this program");
}

void CameraHost::kill() {
  if (process_ > 0) {
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }
  process_ = -1;
  control_.reset();
  ready_ = false;
}

void CameraHost::command(const char* what) {
  if (control_.get() >= 0) send_message(control_.get(), {{"do", what}});
}

void CameraHost::set_light(const CameraSettings& wanted) {
  light_wanted_ = wanted;
  if (!ready_ || fault_) {
    light_answer_ = LightAnswer{"the camera is lost", "wait until it sends frames again"};
    return;
  }
  send_message(control_.get(), {{"do", "light"}, {"settings", json_of(wanted)}});
}

void CameraHost::take_light(const Json& message) {
  for (const Json& one : message.at("settings")) {
    const auto known = std::find_if(read_back_.begin(), read_back_.end(),
                                    [&](const SettingReadBack& s) { return s.name == one[0]; });
    if (known == read_back_.end())  // cameras.toml leaves it to the camera
      read_back_.push_back({one[0], one[1]});
    else
      known->value = one[1];
  }
  light_answer_ = LightAnswer{message.value("what", ""), message.value("do", "")};
  if (!light_answer_->refused.empty()) return;
  // A camera that is opened again gets them, too.
  if (light_wanted_.exposure_us) settings_.exposure_us = light_wanted_.exposure_us;
  if (light_wanted_.gain_db) settings_.gain_db = light_wanted_.gain_db;
}

void CameraHost::pump() {
  if (fault_ || control_.get() < 0) return;
  Json message;
  for (;;) {
    const Received got = receive_message(control_.get(), 0, message);
    if (got == Received::nothing) break;
    if (got == Received::closed) {
      int status = 0;
      ::waitpid(process_, &status, 0);
      process_ = -1;
      return fail(WIFSIGNALED(status)
                      ? fmt::format("its camera host was ended by signal {}", WTERMSIG(status))
                      : "its camera host ended",
                  "when that repeats, look for junk on the camera's network");
    }
    last_sign_ = std::chrono::steady_clock::now();
    take(message);
    if (fault_) return;
  }
  const std::chrono::duration<double> silence = std::chrono::steady_clock::now() - last_sign_;
  if (silence.count() > (started_ ? options_.silence_s : options_.opening_s))
    fail("its camera host gives no sign of life", "check cable and power of the camera");
}

void CameraHost::take(const Json& message) {
  const std::string is = message.at("is");
  if (is == "ready") take_ready(message);
  if (is == "started") started_ = true;
  if (is == "stopped") started_ = false;
  if (is == "frame") take_frame(message);
  if (is == "light") take_light(message);
  if (is == "error") fail(message.at("what"), message.at("do"));
  if (is == "alive" && message.contains("clock")) take_clock(message.at("clock"));
  if (!message.contains("counters")) return;
  const Json& c = message.at("counters");
  counters_ = {c[0], c[1], c[2], c[3]};
  no_slot_ = c[4];
}

void CameraHost::take_ready(const Json& message) {
  ready_ = true;
  identity_ = identity_of(message.at("identity"));
  read_back_.clear();
  for (const Json& s : message.at("settings")) read_back_.push_back({s[0], s[1]});
  ids_ = {message.at("first_id"), message.at("last_id")};
  on_host_clock_ = message.at("on_host_clock");
  take_clock(message.at("clock"));
}

void CameraHost::take_frame(const Json& message) {
  Waiting waiting;
  HostFrame& frame = waiting.frame;
  frame.id = message.at("id");
  frame.complete = message.at("complete");
  frame.fault = message.at("fault");
  if (!message.at("device_ns").is_null())
    frame.device_ns = message.at("device_ns").get<std::int64_t>();
  if (frame.complete) {
    frame.width_px = message.at("width_px");
    frame.height_px = message.at("height_px");
    frame.stride_bytes = message.at("stride");
    waiting.slot = message.at("slot");
    waiting.bytes = message.at("bytes");
    if (waiting.bytes > memory_->slot(waiting.slot).size())
      return fail("a frame is larger than its slot", "correct rig.toml");
  }
  frames_.push_back(std::move(waiting));
}

std::optional<HostFrame> CameraHost::next_frame() {
  if (frames_.empty()) return std::nullopt;
  Waiting waiting = std::move(frames_.front());
  frames_.pop_front();
  if (waiting.frame.complete) {
    const auto pixels = memory_->slot(waiting.slot).first(waiting.bytes);
    waiting.frame.pixels.assign(pixels.begin(), pixels.end());
    send_message(control_.get(), {{"do", "free"}, {"slot", waiting.slot}});
  }
  return std::move(waiting.frame);
}

void CameraHost::take_clock(const Json& samples) {
  for (const Json& s : samples) clock_.push_back({s[0], s[1], s[2]});
}

void CameraHost::fail(std::string what, std::string what_to_do) {
  fault_ = std::move(what);
  what_to_do_ = std::move(what_to_do);
}

std::string CameraHost::pixel_format() const {
  return value_of(read_back_, "pixel_format").value_or("");
}

CameraCounters CameraHost::counters() const {
  return {counters_before_.packets_requested_again + counters_.packets_requested_again,
          counters_before_.packets_resent + counters_.packets_resent,
          counters_before_.packets_repeated + counters_.packets_repeated,
          counters_before_.buffer_underruns + counters_.buffer_underruns};
}

std::filesystem::path camera_host_program() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path().parent_path() /
         "libexec/drapebench/drape-camera-host";
}

}  // namespace drape::capture
