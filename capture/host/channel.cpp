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

template <class T>
void put(Json& json, const char* key, const std::optional<T>& value) {
  json[key] = value ? Json(*value) : Json();
}

template <class T>
std::optional<T> get(const Json& json, const char* key) {
  if (!json.contains(key) || json[key].is_null()) return std::nullopt;
  return json[key].get<T>();
}

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
  // A host that shrank it would end this process with its next look at a frame.
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

bool send_message(int descriptor, const Json& message) {
  const std::string text = message.dump();
  ssize_t sent = -1;
  do {
    sent = ::send(descriptor, text.data(), text.size(), MSG_NOSIGNAL);
  } while (sent < 0 && errno == EINTR);
  return sent == static_cast<ssize_t>(text.size());
}

Received receive_message(int descriptor, int timeout_ms, Json& message) {
  pollfd wait{descriptor, POLLIN, 0};
  if (::poll(&wait, 1, timeout_ms) <= 0) return Received::nothing;
  std::vector<char> buffer(kLargestMessage);
  const ssize_t got = ::recv(descriptor, buffer.data(), buffer.size(), 0);
  if (got < 0 && (errno == EINTR || errno == EAGAIN)) return Received::nothing;
  if (got <= 0) return Received::closed;
  message = try_json({buffer.data(), static_cast<std::size_t>(got)});
  return message.is_discarded() ? Received::closed : Received::message;
}

Json json_of(const CameraAddress& address) {
  return {{"backend", static_cast<int>(address.backend)},
          {"device", address.device},
          {"host_address", address.host_address},
          {"recording", address.recording}};
}

CameraAddress address_of(const Json& json) {
  return {static_cast<Backend>(json.at("backend").get<int>()), json.at("device"),
          json.at("host_address"), json.at("recording")};
}

Json json_of(const CameraSettings& s) {
  Json json;
  put(json, "width_px", s.width_px);
  put(json, "height_px", s.height_px);
  put(json, "offset_x_px", s.offset_x_px);
  put(json, "offset_y_px", s.offset_y_px);
  json["pixel_format"] = s.pixel_format;
  put(json, "exposure_us", s.exposure_us);
  put(json, "gain_db", s.gain_db);
  put(json, "frame_rate_hz", s.frame_rate_hz);
  put(json, "packet_size_bytes", s.packet_size_bytes);
  put(json, "packet_delay_ns", s.packet_delay_ns);
  json["trigger"] = static_cast<int>(s.trigger);
  json["trigger_line"] = s.trigger_line;
  json["ptp"] = s.ptp;
  return json;
}

CameraSettings settings_of(const Json& json) {
  CameraSettings s;
  s.width_px = get<int>(json, "width_px");
  s.height_px = get<int>(json, "height_px");
  s.offset_x_px = get<int>(json, "offset_x_px");
  s.offset_y_px = get<int>(json, "offset_y_px");
  s.pixel_format = json.at("pixel_format");
  s.exposure_us = get<double>(json, "exposure_us");
  s.gain_db = get<double>(json, "gain_db");
  s.frame_rate_hz = get<double>(json, "frame_rate_hz");
  s.packet_size_bytes = get<int>(json, "packet_size_bytes");
  s.packet_delay_ns = get<int>(json, "packet_delay_ns");
  s.trigger = static_cast<TriggerSource>(json.at("trigger").get<int>());
  s.trigger_line = json.at("trigger_line");
  s.ptp = json.at("ptp");
  return s;
}

Json json_of(const CameraIdentity& identity) {
  return {{"vendor", identity.vendor},
          {"model", identity.model},
          {"serial", identity.serial},
          {"address", identity.address},
          {"host_address", identity.host_address}};
}

CameraIdentity identity_of(const Json& json) {
  return {json.at("vendor"), json.at("model"), json.at("serial"), json.at("address"),
          json.at("host_address")};
}

}  // namespace drape::capture
