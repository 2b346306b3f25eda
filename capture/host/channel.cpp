// SPDX-License-Identifier: Apache-2.0
#include "capture/host/channel.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <utility>
#include <vector>

#include "core/error.hpp"

namespace drape::capture {
namespace {

constexpr std::size_t kLargestMessage = 1 << 16;

}  // namespace

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  if (this != &other) {
    reset();
    std::swap(descriptor_, other.descriptor_);
  }
  return *this;
}

void Descriptor::reset() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
}

SharedFrames::SharedFrames(std::size_t slots, std::size_t slot_bytes)
    : memory_(::memfd_create("drape-frames", MFD_CLOEXEC | MFD_ALLOW_SEALING)),
      slots_(slots),
      slot_bytes_(slot_bytes) {
  if (memory_.get() < 0 || ::ftruncate(memory_.get(), static_cast<off_t>(slots * slot_bytes)) != 0)
    throw internal_error("no shared memory for the frames");
  // Seals the size: if a host shrank the memory, reading a frame would kill this process.
  if (::fcntl(memory_.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
    throw internal_error("the shared memory of the frames cannot be sealed");
  map();
}

SharedFrames::SharedFrames(Descriptor memory, std::size_t slots, std::size_t slot_bytes)
    : memory_(std::move(memory)), slots_(slots), slot_bytes_(slot_bytes) {
  map();
}

void SharedFrames::map() {
  void* at =
      ::mmap(nullptr, slots_ * slot_bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, memory_.get(), 0);
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

}  // namespace drape::capture
