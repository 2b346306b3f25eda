// SPDX-License-Identifier: Apache-2.0
// The control channel (GVCP): one datagram, one answer.
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "tests/support/gige_camera/gige_camera.hpp"
#include "tests/support/gige_camera/wire.hpp"

namespace drape::test {
namespace {

constexpr std::uint32_t kDiscovery = 0x0002, kResend = 0x0040, kReadRegister = 0x0080,
                        kWriteRegister = 0x0082, kReadMemory = 0x0084, kWriteMemory = 0x0086,
                        kAction = 0x0100;
constexpr std::uint32_t kOk = 0, kUnknownCommand = 0x8001, kBadParameter = 0x8002,
                        kBadAddress = 0x8003, kDenied = 0x8006;
constexpr std::uint8_t kAnswerWanted = 0x01, kScheduled = 0x80;
constexpr std::size_t kHeaderBytes = 8;

bool same(const sockaddr_in& a, const sockaddr_in& b) {
  return a.sin_addr.s_addr == b.sin_addr.s_addr && a.sin_port == b.sin_port;
}

}  // namespace

void GigeCamera::serve_control() {
  while (!stop_) {
    pollfd sockets[] = {
        {control_socket_, POLLIN, 0}, {broadcast_socket_, POLLIN, 0}, {global_socket_, POLLIN, 0}};
    ::poll(sockets, 3, 20);
    for (const pollfd& s : sockets) {
      if ((s.revents & POLLIN) != 0) receive(s.fd);
    }
    watch_heartbeat();
  }
}

void GigeCamera::receive(int socket) {
  std::uint8_t buffer[2048];
  Request request;
  socklen_t size = sizeof request.from;
  const auto got = ::recvfrom(socket, buffer, sizeof buffer, MSG_DONTWAIT,
                              reinterpret_cast<sockaddr*>(&request.from), &size);
  if (got < 0 || !plugged_) return;
  const auto bytes = static_cast<std::size_t>(got);
  if (bytes < kHeaderBytes || buffer[0] != 0x42 || wire::get16(buffer + 4) + kHeaderBytes > bytes) {
    const std::lock_guard lock(mutex_);
    ++counts_.malformed;
    return;
  }
  request.flags = buffer[1];
  request.command = wire::get16(buffer + 2);
  request.bytes = wire::get16(buffer + 4);
  request.id = wire::get16(buffer + 6);
  request.payload = buffer + kHeaderBytes;
  {
    const std::lock_guard lock(mutex_);
    if (controller_ && same(*controller_, request.from)) last_heard_ns_ = now_ns();
  }
  handle(request);
}

void GigeCamera::handle(const Request& request) {
  switch (request.command) {
    case kDiscovery:
      return answer(request, kOk, bank_.read(0, reg::discovery_bytes));
    case kReadRegister:
      return read_registers(request);
    case kWriteRegister:
      return write_registers(request);
    case kReadMemory:
      return read_memory(request);
    case kWriteMemory:
      return write_memory(request);
    case kResend:
      return resend(request);
    case kAction:
      return act(request);
    default:
      answer(request, kUnknownCommand, {});
  }
}

void GigeCamera::answer(const Request& request, std::uint32_t status,
                        const std::vector<std::uint8_t>& payload) {
  if ((request.flags & kAnswerWanted) == 0) return;
  std::vector<std::uint8_t> datagram;
  wire::put16(datagram, status);
  wire::put16(datagram, request.command + 1);
  wire::put16(datagram, payload.size());
  wire::put16(datagram, request.id);
  datagram.insert(datagram.end(), payload.begin(), payload.end());
  ::sendto(control_socket_, datagram.data(), datagram.size(), 0,
           reinterpret_cast<const sockaddr*>(&request.from), sizeof request.from);
}

bool GigeCamera::may_write(const Request& request, std::uint32_t address) const {
  const std::lock_guard lock(mutex_);
  if (!controller_) return obeys_anyone_ || address == reg::privilege;
  return same(*controller_, request.from);
}

void GigeCamera::read_registers(const Request& request) {
  std::vector<std::uint8_t> values;
  for (std::size_t i = 0; i + 4 <= request.bytes; i += 4) {
    const std::uint32_t address = wire::get32(request.payload + i);
    const bool hidden = address == reg::stream_source_port && !options_.personality.source_port;
    if (hidden || !bank_.holds(address, 4)) return answer(request, kBadAddress, {});
    const auto value = bank_.read(address, 4);
    values.insert(values.end(), value.begin(), value.end());
  }
  answer(request, kOk, values);
}

void GigeCamera::write_registers(const Request& request) {
  std::uint32_t written = 0;
  for (std::size_t i = 0; i + 8 <= request.bytes; i += 8, ++written) {
    if (!store(request, wire::get32(request.payload + i), request.payload + i + 4, 4)) return;
  }
  std::vector<std::uint8_t> payload;
  wire::put32(payload, written);
  answer(request, kOk, payload);
}

void GigeCamera::read_memory(const Request& request) {
  if (request.bytes < 8) return answer(request, kBadParameter, {});
  const std::uint32_t address = wire::get32(request.payload);
  const std::uint32_t bytes = wire::get16(request.payload + 6);
  if (!bank_.holds(address, bytes)) return answer(request, kBadAddress, {});
  std::vector<std::uint8_t> payload(request.payload, request.payload + 4);
  const auto memory = bank_.read(address, bytes);
  payload.insert(payload.end(), memory.begin(), memory.end());
  answer(request, kOk, payload);
}

void GigeCamera::write_memory(const Request& request) {
  if (request.bytes < 4) return answer(request, kBadParameter, {});
  const std::size_t bytes = request.bytes - 4;
  if (!store(request, wire::get32(request.payload), request.payload + 4, bytes)) return;
  std::vector<std::uint8_t> payload;
  wire::put32(payload, bytes);
  answer(request, kOk, payload);
}

bool GigeCamera::takes(std::uint32_t address, const std::uint8_t* value) const {
  const auto inside = [&](std::uint32_t other, std::uint32_t sensor) {
    return std::uint64_t{wire::get32(value)} + bank_.word(other) <= bank_.word(sensor);
  };
  if (std::find(options_.stuck.begin(), options_.stuck.end(), address) != options_.stuck.end())
    return false;
  const bool format = address >= reg::width && address <= reg::pixel_format;
  if (format && options_.personality.locked_while_streaming) {
    const std::lock_guard lock(mutex_);
    if (acquiring_) return false;
  }
  switch (address) {
    case reg::width:
      return inside(reg::offset_x, reg::sensor_width);
    case reg::offset_x:
      return inside(reg::width, reg::sensor_width);
    case reg::height:
      return inside(reg::offset_y, reg::sensor_height);
    case reg::offset_y:
      return inside(reg::height, reg::sensor_height);
    case reg::exposure_us:
      return bank_.word(reg::exposure_auto) == 0;
    case reg::gain_db:
      return bank_.word(reg::gain_auto) == 0;
    default:
      return true;
  }
}

/// Returns false if refused and already answered.
bool GigeCamera::store(const Request& request, std::uint32_t address, const std::uint8_t* from,
                       std::size_t bytes) {
  if (!bank_.holds(address, bytes)) {
    answer(request, kBadAddress, {});
    return false;
  }
  if (!may_write(request, address)) {
    answer(request, kDenied, {});
    const std::lock_guard lock(mutex_);
    ++counts_.commands_refused;
    return false;
  }
  if (!takes(address, from)) {
    answer(request, kBadParameter, {});
    return false;
  }
  bank_.write(address, from, bytes);
  after_write(request, address);
  return true;
}

void GigeCamera::after_write(const Request& request, std::uint32_t address) {
  const std::lock_guard lock(mutex_);
  switch (address) {
    case reg::privilege:
      if ((bank_.word(reg::privilege) & 3U) != 0) {
        controller_ = request.from;
        last_heard_ns_ = now_ns();
      } else {
        release_control();
      }
      break;
    case reg::width:
    case reg::height:
    case reg::pixel_format:
    case reg::chunks:
      set_payload_size();
      break;
    case reg::frame_rate_hz:
      // Without its switch the rate is ignored.
      if (!options_.personality.rate_switch.empty() && bank_.word(reg::rate_switch) == 0)
        bank_.set_real(reg::frame_rate_hz, 25);
      break;
    case reg::latch:
      bank_.set_long(reg::latched_ns, static_cast<std::uint64_t>(device_ns(now_ns())));
      break;
    case reg::acquisition:
      acquiring_ = bank_.word(reg::acquisition) != 0;
      next_grid_ns_ = 0;
      due_host_ns_.clear();
      next_id_ = options_.first_frame_id;
      break;
    case reg::exposure_us:
      if (const double step = options_.exposure_step_us; step > 0)
        bank_.set_real(address, step * std::floor(bank_.real(address) / step));
      break;
    case reg::trigger_software:
      if (acquiring_ && bank_.word(reg::trigger_mode) == 1 &&
          bank_.word(reg::trigger_source) == 0) {
        ++counts_.triggers;
        due_host_ns_.push_back(now_ns());
      }
      break;
    case reg::timestamp_control:
      bank_.set_long(reg::timestamp_high, ticks(device_ns(now_ns())));
      break;
    case reg::ptp_enable:
      on_master_clock_ = options_.ptp && bank_.word(reg::ptp_enable) != 0;
      bank_.set_word(reg::ptp_status, on_master_clock_ ? 2 : bank_.word(reg::ptp_enable));
      break;
    case reg::ptp_latch:
      bank_.set_long(reg::ptp_offset_ns, on_master_clock_ ? 300 : 0);
      break;
    default:
      break;
  }
  wake_.notify_all();
}

void GigeCamera::act(const Request& request) {
  if (request.bytes < 12) return answer(request, kBadParameter, {});
  const bool scheduled = (request.flags & kScheduled) != 0;
  const bool meant = wire::get32(request.payload) == bank_.word(reg::action_device_key) &&
                     wire::get32(request.payload + 4) == bank_.word(reg::action_group_key) &&
                     (wire::get32(request.payload + 8) & bank_.word(reg::action_group_mask)) != 0;
  if (!meant) return;  // a broadcast for other cameras
  {
    const std::lock_guard lock(mutex_);
    ++(scheduled ? counts_.scheduled_actions : counts_.actions);
    if (acquiring_ && bank_.word(reg::trigger_mode) == 1 && bank_.word(reg::trigger_source) == 2) {
      const bool has_time = scheduled && request.bytes >= 20;
      due_host_ns_.push_back(has_time ? host_ns_of(ns_of_ticks(wire::get(request.payload + 12, 8)))
                                      : now_ns());
    }
  }
  wake_.notify_all();
  answer(request, kOk, {});
}

void GigeCamera::resend(const Request& request) {
  if (request.bytes < 12 || !options_.resend || !options_.personality.resend) return;
  const std::uint32_t frame_id = wire::get16(request.payload + 2);
  const std::uint32_t first = wire::get32(request.payload + 4) & 0xFFFFFF;
  const std::uint32_t last = wire::get32(request.payload + 8) & 0xFFFFFF;
  std::shared_ptr<const Frame> frame;
  double lose = 0;
  {
    const std::lock_guard lock(mutex_);
    lose = faults_.lose_resent;
    for (const auto& kept : kept_)
      if (kept->id == frame_id) frame = kept;
  }
  if (!frame) return;
  for (std::size_t packet = first; packet <= last && packet < frame->packets(); ++packet) {
    {
      const std::lock_guard lock(mutex_);
      if (std::uniform_real_distribution<double>(0, 1)(random_) < lose) continue;
      ++counts_.packets_resent;
    }
    send_packet(*frame, packet);
  }
}

void GigeCamera::watch_heartbeat() {
  const std::lock_guard lock(mutex_);
  const std::int64_t allowed = std::int64_t{bank_.word(reg::heartbeat_ms)} * 1'000'000;
  if (controller_ && now_ns() - last_heard_ns_ > allowed) release_control();
}

/// The caller must hold the mutex.
void GigeCamera::release_control() {
  controller_.reset();
  acquiring_ = false;
  due_host_ns_.clear();
  bank_.set_word(reg::privilege, 0);
  bank_.set_word(reg::stream_port, 0);
}

}  // namespace drape::test
