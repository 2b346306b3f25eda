// SPDX-License-Identifier: Apache-2.0
#include "tests/support/gige_camera/gige_camera.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

namespace drape::test {
namespace {

constexpr std::uint16_t kControlPort = 3956;

sockaddr_in endpoint(const std::string& address, std::uint16_t port) {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_port = htons(port);
  ::inet_pton(AF_INET, address.c_str(), &result.sin_addr);
  return result;
}

int open_socket(const std::string& address, std::uint16_t port, bool shared) {
  const int descriptor = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  if (shared) ::setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const sockaddr_in at = endpoint(address, port);
  if (::bind(descriptor, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0) {
    const std::string reason = std::strerror(errno);
    ::close(descriptor);
    throw std::runtime_error(fmt::format("{}:{}: {}", address, port, reason));
  }
  return descriptor;
}

}  // namespace

GigeCamera::GigeCamera(const GigeCameraOptions& options)
    : options_(options),
      bank_(reg::xml + 0x10000),
      started_ns_(now_ns()),
      next_id_(options.first_frame_id),
      picture_(static_cast<std::size_t>(options.width_px) * options.height_px, 128),
      random_(options.seed) {
  control_socket_ = open_socket(options_.address, kControlPort, false);
  // Discovery is broadcast to the loopback network and to the global address.
  broadcast_socket_ = open_socket("127.255.255.255", kControlPort, true);
  global_socket_ = open_socket("255.255.255.255", kControlPort, true);
  stream_socket_ = open_socket(options_.address, 0, false);
  fill_registers();
  acquiring_ = options_.personality.locked_while_streaming;
  if (options_.held) {
    controller_ = endpoint("127.0.0.1", 9);
    last_heard_ns_ = std::numeric_limits<std::int64_t>::max();
  }
  control_thread_ = std::thread([this] { serve_control(); });
  stream_thread_ = std::thread([this] { stream(); });
}

GigeCamera::~GigeCamera() {
  stop_ = true;
  wake_.notify_all();
  control_thread_.join();
  stream_thread_.join();
  for (const int s : {control_socket_, broadcast_socket_, global_socket_, stream_socket_})
    ::close(s);
}

void GigeCamera::fill_registers() {
  constexpr std::uint32_t write_memory = 1U << 1, packet_resend = 1U << 2, action = 1U << 6;
  sockaddr_in source{};
  socklen_t size = sizeof source;
  ::getsockname(stream_socket_, reinterpret_cast<sockaddr*>(&source), &size);
  const std::uint32_t ip = ntohl(endpoint(options_.address, 0).sin_addr.s_addr);
  options_.personality.ieee1588_names |= options_.ieee1588_names;
  const Personality& p = options_.personality;
  const std::string xml = genicam_xml(p);

  bank_.set_word(reg::version, 0x00020000);
  bank_.set_word(reg::device_mode, 0x80000001);  // big-endian, UTF-8
  bank_.set_word(reg::mac_high, 0x0200);
  bank_.set_word(reg::mac_low, ip);
  bank_.set_word(reg::current_ip, ip);
  bank_.set_word(reg::subnet_mask, 0xFF000000);
  bank_.set_text(reg::manufacturer, p.vendor);
  bank_.set_text(reg::model, p.model);
  bank_.set_text(reg::device_version, "1");
  bank_.set_text(reg::serial, options_.serial);
  bank_.set_text(reg::xml_url, fmt::format("Local:camera.xml;{:x};{:x}", reg::xml, xml.size()));
  bank_.set_word(reg::network_interfaces, 1);
  bank_.set_word(reg::stream_channels, 1);
  bank_.set_word(reg::capability,
                 write_memory | action | (options_.resend && p.resend ? packet_resend : 0));
  bank_.set_word(reg::heartbeat_ms, 3000);
  bank_.set_word(reg::tick_low, p.tick_hz);
  bank_.set_word(reg::packet_size, p.packet_size);
  bank_.set_word(reg::chunks, p.chunks_on ? 1 : 0);
  bank_.set_word(reg::gamma_switch, p.gamma_on ? 1 : 0);
  bank_.set_word(reg::exposure_raw_us, 10'000);
  bank_.set_word(reg::stream_source_port, ntohs(source.sin_port));
  for (const auto& [address, value] :
       {std::pair{reg::width, options_.width_px}, std::pair{reg::height, options_.height_px},
        std::pair{reg::sensor_width, options_.width_px},
        std::pair{reg::sensor_height, options_.height_px}})
    bank_.set_word(address, static_cast<std::uint32_t>(value));
  bank_.set_word(reg::pixel_format, p.pixel_formats.front().second);
  set_payload_size();
  set_light_to_automatic();
  bank_.set_real(reg::frame_rate_hz, 25);
  bank_.set_text(reg::xml, xml);
}

/// Sets the state in which cameras are delivered.
void GigeCamera::set_light_to_automatic() {
  bank_.set_word(reg::exposure_auto, 2);
  bank_.set_word(reg::gain_auto, 2);
  bank_.set_real(reg::exposure_us, 10'000);
  bank_.set_real(reg::gain_db, 0);
}

void GigeCamera::show(std::vector<std::uint8_t> pixels) {
  if (pixels.size() != static_cast<std::size_t>(options_.width_px) * options_.height_px)
    throw std::runtime_error("the picture has another size than the sensor");
  const std::lock_guard lock(mutex_);
  picture_ = std::move(pixels);
  sends_bytes_ = false;
}

void GigeCamera::show_bytes(std::vector<std::uint8_t> bytes) {
  const std::lock_guard lock(mutex_);
  picture_ = std::move(bytes);
  sends_bytes_ = true;
}

/// The number of bits per pixel is part of the format's code (PFNC).
void GigeCamera::set_payload_size() {
  const std::uint64_t bits = bank_.word(reg::pixel_format) >> 16 & 0xFF;
  const std::uint64_t image =
      (std::uint64_t{bank_.word(reg::width)} * bank_.word(reg::height) * bits + 7) / 8;
  bank_.set_word(reg::payload_size, image + (bank_.word(reg::chunks) != 0 ? 16 : 0));
}

std::uint64_t GigeCamera::ticks(std::int64_t ns) const {
  const std::uint64_t hz = options_.personality.tick_hz;
  if (hz == 1'000'000'000 || hz == 0) return static_cast<std::uint64_t>(ns);
  return static_cast<std::uint64_t>(
      std::llroundl(static_cast<long double>(ns) * static_cast<long double>(hz) / 1e9L));
}

std::int64_t GigeCamera::ns_of_ticks(std::uint64_t ticks) const {
  const std::uint64_t hz = options_.personality.tick_hz;
  if (hz == 1'000'000'000 || hz == 0) return static_cast<std::int64_t>(ticks);
  return std::llroundl(static_cast<long double>(static_cast<std::int64_t>(ticks)) * 1e9L /
                       static_cast<long double>(hz));
}

void GigeCamera::set_faults(const GigeFaults& faults) {
  const std::lock_guard lock(mutex_);
  faults_ = faults;
}

void GigeCamera::plug_in() {
  const std::lock_guard lock(mutex_);
  release_control();
  set_light_to_automatic();
  kept_.clear();
  next_id_ = options_.first_frame_id;
  plugged_ = true;
}

void GigeCamera::jump_clock(double seconds) {
  const std::lock_guard lock(mutex_);
  jumped_s_ += seconds;
}

void GigeCamera::pulse_line() {
  {
    const std::lock_guard lock(mutex_);
    if (!acquiring_ || bank_.word(reg::trigger_mode) != 1 || bank_.word(reg::trigger_source) != 1)
      return;
    due_host_ns_.push_back(now_ns());
  }
  wake_.notify_all();
}

GigeCounts GigeCamera::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

std::vector<GigeExposure> GigeCamera::exposures() const {
  const std::lock_guard lock(mutex_);
  return exposures_;
}

std::uint16_t GigeCamera::stream_port() const {
  return static_cast<std::uint16_t>(bank_.word(reg::stream_port));
}

std::uint16_t GigeCamera::controller_port() const {
  const std::lock_guard lock(mutex_);
  return controller_ ? ntohs(controller_->sin_port) : 0;
}

std::int64_t GigeCamera::device_ns(std::int64_t host_ns) const {
  if (on_master_clock_) return host_ns + std::llround(1e9 * options_.ptp_error_s);
  const auto since = static_cast<double>(host_ns - started_ns_);
  return host_ns + std::llround(since * 1e-6 * options_.clock_drift_ppm +
                                1e9 * (options_.clock_offset_s + jumped_s_));
}

std::int64_t GigeCamera::host_ns_of(std::int64_t device) const {
  if (on_master_clock_) return device - std::llround(1e9 * options_.ptp_error_s);
  const double offset = 1e9 * (options_.clock_offset_s + jumped_s_);
  const double since =
      (static_cast<double>(device - started_ns_) - offset) / (1 + 1e-6 * options_.clock_drift_ppm);
  return started_ns_ + std::llround(since);
}

}  // namespace drape::test
