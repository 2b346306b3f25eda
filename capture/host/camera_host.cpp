// SPDX-License-Identifier: Apache-2.0
#include "capture/host/camera_host.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>

#include "core/program/child.hpp"

namespace drape::capture {
namespace {

constexpr std::size_t kLargestMessage = 1 << 16;

}  // namespace

Descriptor memory_for_frames(std::size_t bytes) {
  Descriptor memory(::memfd_create("drape-frames", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (memory.get() < 0 || ::ftruncate(memory.get(), static_cast<off_t>(bytes)) != 0)
    throw internal_error("no shared memory for the frames");
  // Seals the size: if a host shrank the memory, reading a frame would kill this process.
  if (::fcntl(memory.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
    throw internal_error("the shared memory of the frames cannot be sealed");
  return memory;
}

SharedFrames::SharedFrames(Descriptor memory, std::size_t slots, std::size_t slot_bytes)
    : memory_(std::move(memory)), slots_(slots), slot_bytes_(slot_bytes) {
  void* at =
      ::mmap(nullptr, slots * slot_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, memory_.get(), 0);
  if (at == MAP_FAILED) throw internal_error("the shared memory of the frames cannot be mapped");
  at_ = static_cast<std::uint8_t*>(at);
}

SharedFrames::~SharedFrames() {
  if (at_ != nullptr) ::munmap(at_, slots_ * slot_bytes_);
}

std::span<std::uint8_t> SharedFrames::slot(std::size_t index) const {
  if (index >= slots_) throw internal_error("a frame names a slot that does not exist");
  return {at_ + index * slot_bytes_, slot_bytes_};
}

bool send_text(int descriptor, std::string_view text) {
  ssize_t sent = -1;
  do {
    sent = ::send(descriptor, text.data(), text.size(), MSG_NOSIGNAL);
  } while (sent < 0 && errno == EINTR);
  return sent == static_cast<ssize_t>(text.size());
}

Received receive_text(int descriptor, int timeout_ms, std::string& text) {
  pollfd wait{descriptor, POLLIN, 0};
  if (::poll(&wait, 1, timeout_ms) <= 0) return Received::nothing;
  text.resize(kLargestMessage);
  const ssize_t got = ::recv(descriptor, text.data(), text.size(), 0);
  if (got < 0 && (errno == EINTR || errno == EAGAIN)) return Received::nothing;
  if (got <= 0) return Received::closed;
  text.resize(static_cast<std::size_t>(got));
  return Received::message;
}

void fields(Fields& f, Order& order) {
  f({"do", "command"}, order.kind);
  f.if_any({"address", "address of the device to open"}, order.address);
  f.if_any({"settings", "requested settings"}, order.settings);
  f.otherwise({"slots", "number of frames in the shared memory"}, order.slots);
  f.otherwise({"slot_bytes", "size of one slot"}, order.slot_bytes);
  f.otherwise({"slot", "slot that is free again"}, order.slot);
}

void fields(Fields& f, FrameNews& frame) {
  f({"id", "frame id of the camera"}, frame.id);
  f({"device_ns", "device time, ns"}, frame.device_ns);
  f({"complete", "true if every byte arrived"}, frame.complete);
  f({"fault", "reason why it is incomplete"}, frame.fault);
  f({"slot", "slot in the shared memory"}, frame.slot);
  f({"bytes", "size in bytes"}, frame.bytes);
  f({"stride", "bytes per row; 0 if without padding"}, frame.stride_bytes);
  f({"width_px", "columns of the image"}, frame.width_px);
  f({"height_px", "rows of the image"}, frame.height_px);
}

void fields(Fields& f, News& news) {
  f({"is", "kind of news"}, news.kind);
  f.if_any({"what", "fault"}, news.what);
  f.if_any({"to_do", "remedy"}, news.what_to_do);
  f.if_any({"identity", "identity of the camera"}, news.identity);
  f.if_any({"settings", "settings read back"}, news.settings);
  f.otherwise({"first_id", "first frame id"}, news.first_id);
  f.otherwise({"last_id", "last frame id"}, news.last_id);
  f.otherwise({"on_host_clock", "true if its times are on the host clock"}, news.on_host_clock);
  f.if_any({"clock", "readings of the camera's clock"}, news.clock);
  f.if_any({"counters", "counters of the backend"}, news.counters);
  std::int64_t underruns = news.counters ? news.counters->buffer_underruns : 0;
  f.otherwise({"underruns", "frames lost for want of a buffer"}, underruns);
  if (news.counters) news.counters->buffer_underruns = underruns;
  f.otherwise({"without_room", "frames dropped because no slot was free"}, news.without_room);
  f.if_any({"frame", "frame"}, news.frame);
}

CameraHost::CameraHost(CameraAddress address, CameraSettings settings, HostOptions options)
    : address_(std::move(address)), settings_(std::move(settings)), options_(std::move(options)) {}

CameraHost::~CameraHost() {
  control_.reset();  // the host then ends by itself and releases the camera
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
  memory_.emplace(memory_for_frames(options_.slots * options_.slot_bytes), options_.slots,
                  options_.slot_bytes);
  process_ = start_child(
      options_.program,
      {"--control", std::to_string(theirs.get()), "--memory", std::to_string(memory_->descriptor()),
       "--memory-limit-mb", std::to_string(options_.memory_limit_mb)},
      {.kept = {theirs.get(), memory_->descriptor()}, .background = true, .quiet = true});
  fault_.reset();
  ready_ = false;
  started_ = false;
  clock_.clear();
  frames_.clear();
  counters_before_ = counters();
  counters_ = {};
  last_sign_ = std::chrono::steady_clock::now();
  ++launches_;
  // A known address saves the second that discovery takes.
  CameraAddress address = address_;
  if (address.backend == Backend::aravis && !identity_.host_address.empty()) {
    address.device = identity_.address;
    address.host_address = identity_.host_address;
  }
  send(control_.get(),
       Order{Order::Kind::open, address, settings_, options_.slots, options_.slot_bytes});
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

void CameraHost::command(Order::Kind what) {
  if (control_.get() >= 0) send(control_.get(), Order{what});
}

void CameraHost::set_light(const CameraSettings& wanted) {
  light_wanted_ = wanted;
  if (!ready_ || fault_)
    light_answer_ = LightAnswer{"the camera is lost", "wait until it sends frames again"};
  else
    send(control_.get(), Order{.kind = Order::Kind::light, .settings = wanted});
}

void CameraHost::take_light(const News& news) {
  for (const SettingReadBack& one : news.settings) {
    const auto known = std::ranges::find(read_back_, one.name, &SettingReadBack::name);
    if (known == read_back_.end())  // cameras.toml does not set it
      read_back_.push_back(one);
    else
      known->value = one.value;
  }
  light_answer_ = LightAnswer{news.what, news.what_to_do};
  if (!news.what.empty()) return;
  // Applies again if the camera is reopened.
  if (light_wanted_.exposure_us) settings_.exposure_us = light_wanted_.exposure_us;
  if (light_wanted_.gain_db) settings_.gain_db = light_wanted_.gain_db;
}

void CameraHost::pump() {
  if (fault_ || control_.get() < 0) return;
  News news;
  for (;;) {
    const Received got = receive(control_.get(), 0, news);
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
    take(news);
    if (fault_) return;
  }
  const std::chrono::duration<double> silence = std::chrono::steady_clock::now() - last_sign_;
  if (silence.count() > (started_ ? options_.silence_s : options_.opening_s))
    fail("its camera host gives no sign of life", "check cable and power of the camera");
}

void CameraHost::take(const News& news) {
  switch (news.kind) {
    case News::Kind::ready:
      ready_ = true;
      identity_ = news.identity.value_or(CameraIdentity{});
      read_back_ = news.settings;
      ids_ = {news.first_id, news.last_id};
      on_host_clock_ = news.on_host_clock;
      break;
    case News::Kind::started:
    case News::Kind::stopped:
      started_ = news.kind == News::Kind::started;
      break;
    case News::Kind::frame:
      if (news.frame && news.frame->complete &&
          news.frame->bytes > memory_->slot(news.frame->slot).size())
        return fail("a frame is larger than its slot", "correct rig.toml");
      if (news.frame) frames_.push_back(*news.frame);
      break;
    case News::Kind::light:
      take_light(news);
      break;
    case News::Kind::error:
      fail(news.what, news.what_to_do);
      break;
    case News::Kind::alive:
      break;
  }
  clock_.insert(clock_.end(), news.clock.begin(), news.clock.end());
  if (!news.counters) return;
  counters_ = *news.counters;
  no_slot_ = news.without_room;
}

std::optional<HostFrame> CameraHost::next_frame() {
  if (frames_.empty()) return std::nullopt;
  const FrameNews news = std::move(frames_.front());
  frames_.pop_front();
  HostFrame frame{news, {}};
  if (news.complete) {
    const auto pixels = memory_->slot(news.slot).first(news.bytes);
    frame.pixels.assign(pixels.begin(), pixels.end());
    send(control_.get(), Order{.kind = Order::Kind::free, .slot = news.slot});
  }
  return frame;
}

void CameraHost::fail(std::string what, std::string what_to_do) {
  fault_ = std::move(what);
  what_to_do_ = std::move(what_to_do);
}

std::string CameraHost::pixel_format() const {
  return setting_in(read_back_, "pixel_format").value_or("");
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
