// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "tests/support/gige_camera/personality.hpp"

/// Addresses of the emulated camera: bootstrap registers of the GigE Vision standard, then ours.
namespace drape::test::reg {

inline constexpr std::uint32_t version = 0x0000;
inline constexpr std::uint32_t device_mode = 0x0004;
inline constexpr std::uint32_t mac_high = 0x0008;
inline constexpr std::uint32_t mac_low = 0x000C;
inline constexpr std::uint32_t current_ip = 0x0024;
inline constexpr std::uint32_t subnet_mask = 0x0034;
inline constexpr std::uint32_t manufacturer = 0x0048;
inline constexpr std::uint32_t model = 0x0068;
inline constexpr std::uint32_t device_version = 0x0088;
inline constexpr std::uint32_t serial = 0x00D8;
inline constexpr std::uint32_t discovery_bytes = 0x00F8;
inline constexpr std::uint32_t xml_url = 0x0200;
inline constexpr std::uint32_t network_interfaces = 0x0600;
inline constexpr std::uint32_t stream_channels = 0x0904;
inline constexpr std::uint32_t capability = 0x0934;
inline constexpr std::uint32_t heartbeat_ms = 0x0938;
inline constexpr std::uint32_t tick_high = 0x093C;
inline constexpr std::uint32_t tick_low = 0x0940;
inline constexpr std::uint32_t timestamp_control = 0x0944;
inline constexpr std::uint32_t timestamp_high = 0x0948;
inline constexpr std::uint32_t timestamp_low = 0x094C;
inline constexpr std::uint32_t privilege = 0x0A00;
inline constexpr std::uint32_t stream_port = 0x0D00;
inline constexpr std::uint32_t packet_size = 0x0D04;
inline constexpr std::uint32_t packet_delay = 0x0D08;
inline constexpr std::uint32_t stream_address = 0x0D18;
inline constexpr std::uint32_t stream_source_port = 0x0D1C;

inline constexpr std::uint32_t width = 0xA000;
inline constexpr std::uint32_t height = 0xA004;
inline constexpr std::uint32_t offset_x = 0xA008;
inline constexpr std::uint32_t offset_y = 0xA00C;
inline constexpr std::uint32_t pixel_format = 0xA010;
inline constexpr std::uint32_t payload_size = 0xA014;
inline constexpr std::uint32_t acquisition_mode = 0xA018;
inline constexpr std::uint32_t acquisition = 0xA01C;  ///< start writes 1, stop writes 0
inline constexpr std::uint32_t sensor_width = 0xA020;
inline constexpr std::uint32_t sensor_height = 0xA024;
inline constexpr std::uint32_t exposure_us = 0xA030;    ///< double
inline constexpr std::uint32_t gain_db = 0xA038;        ///< double
inline constexpr std::uint32_t frame_rate_hz = 0xA040;  ///< double
inline constexpr std::uint32_t exposure_auto = 0xA048;
inline constexpr std::uint32_t gain_auto = 0xA04C;
inline constexpr std::uint32_t trigger_selector = 0xA050;
inline constexpr std::uint32_t trigger_mode = 0xA054;
inline constexpr std::uint32_t trigger_source = 0xA058;  ///< 0 Software, 1 Line1, 2 Action1
inline constexpr std::uint32_t trigger_software = 0xA05C;
inline constexpr std::uint32_t action_device_key = 0xA060;
inline constexpr std::uint32_t action_group_key = 0xA064;
inline constexpr std::uint32_t action_group_mask = 0xA068;
inline constexpr std::uint32_t ptp_enable = 0xA070;
inline constexpr std::uint32_t ptp_latch = 0xA074;
inline constexpr std::uint32_t ptp_status = 0xA078;     ///< 0 Disabled, 1 Listening, 2 Slave
inline constexpr std::uint32_t ptp_offset_ns = 0xA080;  ///< 64 bit, signed
inline constexpr std::uint32_t rate_switch = 0xA088;
inline constexpr std::uint32_t chunks = 0xA08C;
inline constexpr std::uint32_t gamma_switch = 0xA090;
inline constexpr std::uint32_t exposure_raw_us = 0xA094;  ///< 32 bit
inline constexpr std::uint32_t gain_raw = 0xA098;         ///< 32 bit
inline constexpr std::uint32_t latched_ns = 0xA0A0;       ///< 64 bit, SFNC's latch
inline constexpr std::uint32_t latch = 0xA0A8;
inline constexpr std::uint32_t xml = 0x10000;

}  // namespace drape::test::reg

namespace drape::test {

/// The camera's memory, big-endian, thread-safe.
class RegisterBank {
 public:
  explicit RegisterBank(std::size_t bytes) : memory_(bytes, 0) {}

  [[nodiscard]] bool holds(std::uint64_t address, std::uint64_t bytes) const {
    return address + bytes <= memory_.size();
  }

  [[nodiscard]] std::vector<std::uint8_t> read(std::uint32_t address, std::size_t bytes) const {
    const std::lock_guard lock(mutex_);
    const auto from = memory_.begin() + address;
    return {from, from + static_cast<std::ptrdiff_t>(bytes)};
  }

  void write(std::uint32_t address, const std::uint8_t* from, std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    std::copy(from, from + bytes, memory_.begin() + address);
  }

  [[nodiscard]] std::uint32_t word(std::uint32_t address) const {
    return static_cast<std::uint32_t>(number(address, 4));
  }

  void set_word(std::uint32_t address, std::uint64_t value) { set_number(address, value, 4); }

  [[nodiscard]] double real(std::uint32_t address) const {
    return std::bit_cast<double>(number(address, 8));
  }

  void set_real(std::uint32_t address, double value) {
    set_number(address, std::bit_cast<std::uint64_t>(value), 8);
  }

  void set_long(std::uint32_t address, std::uint64_t value) { set_number(address, value, 8); }

  void set_text(std::uint32_t address, const std::string& text) {
    write(address, reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  }

 private:
  [[nodiscard]] std::uint64_t number(std::uint32_t address, std::uint32_t bytes) const {
    const std::lock_guard lock(mutex_);
    std::uint64_t value = 0;
    for (std::uint32_t i = 0; i < bytes; ++i) value = value << 8 | memory_[address + i];
    return value;
  }

  void set_number(std::uint32_t address, std::uint64_t value, std::uint32_t bytes) {
    const std::lock_guard lock(mutex_);
    for (std::uint32_t i = 0; i < bytes; ++i)
      memory_[address + i] = static_cast<std::uint8_t>(value >> (8 * (bytes - 1 - i)));
  }

  mutable std::mutex mutex_;
  std::vector<std::uint8_t> memory_;
};

/// GenICam description of the registers above with this camera's names and features.
[[nodiscard]] std::string genicam_xml(const Personality& personality);

}  // namespace drape::test
