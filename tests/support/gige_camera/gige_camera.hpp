// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <netinet/in.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/gige_camera/registers.hpp"

namespace drape::test {

/// The host's monotonic clock.
inline std::int64_t now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

struct GigeCameraOptions {
  std::string address = "127.0.0.2";
  std::string serial = "DB0001";
  int width_px = 640, height_px = 480;
  double clock_offset_s = 0;    ///< device clock minus host clock at the start
  double clock_drift_ppm = 0;   ///< relative rate of the device clock
  bool resend = true;           ///< grants packet resend
  bool ptp = false;             ///< enabling PTP sets the device clock to the host's
  bool ieee1588_names = false;  ///< PTP features have the names used by older cameras
  Personality personality = {};
  double ptp_error_s = 0;       ///< error of the clock that PTP sets
  double exposure_step_us = 0;  ///< if above 0, rounds the exposure down to a multiple silently
  /// In free run: time from the start of the acquisition to the first exposure, followed by steps
  /// of the period. Absent: all cameras expose together, on a grid of the host's clock.
  std::optional<double> first_exposure_s = {};
  std::uint16_t first_frame_id = 1;
  unsigned seed = 1;                      ///< seed of the losses
  std::vector<std::uint32_t> stuck = {};  ///< registers that refuse to be written
  bool held = false;                      ///< another program controls it permanently
  std::size_t path_bytes = 65535;  ///< largest packet, including IP header, that the path carries
};

/// Faults in transit. Probabilities per packet.
struct GigeFaults {
  double lose = 0;         ///< not sent at first, but sent on a resend request
  double lose_resent = 0;  ///< resend request that is ignored
  double duplicate = 0;    ///< sent twice
  double reorder = 0;      ///< sent after its successor
  double skip_frame = 0;   ///< whole frames exposed but never sent
  int late_ms = 0;         ///< delay of every frame after its exposure
};

struct GigeCounts {
  std::uint64_t frames_exposed = 0, frames_skipped = 0, frames_sent = 0;
  std::uint64_t packets_sent = 0;  ///< payload, leader and trailer, at first sending
  std::uint64_t packets_lost = 0, packets_resent = 0, packets_duplicated = 0, packets_reordered = 0;
  std::uint64_t triggers = 0, actions = 0, scheduled_actions = 0, commands_refused = 0;
  std::uint64_t malformed = 0;  ///< datagrams to the control port that are not commands
};

/// One exposure: frame id and time on the host's clock.
struct GigeExposure {
  std::uint16_t frame_id = 0;
  std::int64_t host_ns = 0;
};

/// A GigE Vision camera on a loopback address: discovery, registers, memory, GenICam file, control
/// privilege with heartbeat, image stream with packet resend, software trigger, action and
/// scheduled action, PTP registers. It sends any Mono8 picture. Like a real camera it refuses an
/// exposure or gain while it is automatic, and a region outside the sensor. Needs a private network
/// (see private_network.hpp), because every camera answers on port 3956.
class GigeCamera {
 public:
  /// Throws std::runtime_error if the address cannot be used.
  explicit GigeCamera(const GigeCameraOptions& options);
  ~GigeCamera();
  GigeCamera(const GigeCamera&) = delete;
  GigeCamera& operator=(const GigeCamera&) = delete;

  /// Sends these bytes, in the camera's pixel format, from the next exposure on, whatever the
  /// region.
  void show_bytes(std::vector<std::uint8_t> bytes);
  /// Shows this picture from the next exposure on; width x height bytes.
  void show(std::vector<std::uint8_t> pixels);
  void set_faults(const GigeFaults& faults);
  /// Stops receiving and answering, as if the cable were pulled out.
  void unplug() { plugged_ = false; }
  /// Reconnects as after a power cycle: without a controller or stream.
  void plug_in();
  /// From now on it accepts only control requests from anyone but its controller.
  void obey_controller_alone() { obeys_anyone_ = false; }
  void jump_clock(double seconds);
  /// Sends a pulse on the trigger line.
  void pulse_line();

  [[nodiscard]] GigeCounts counts() const;
  [[nodiscard]] std::vector<GigeExposure> exposures() const;
  [[nodiscard]] std::uint64_t register_word(std::uint32_t address) const {
    return bank_.word(address);
  }
  [[nodiscard]] double register_real(std::uint32_t address) const { return bank_.real(address); }
  /// Destination port of the stream, for tests that send junk there.
  [[nodiscard]] std::uint16_t stream_port() const;
  [[nodiscard]] std::uint16_t controller_port() const;

 private:
  struct Frame {
    std::uint64_t id = 0;
    bool extended = false, chunks = false;
    std::uint64_t ticks = 0;
    std::uint32_t width = 0, height = 0;
    std::size_t data_bytes = 0;  ///< image bytes per packet
    std::vector<std::uint8_t> pixels;
    [[nodiscard]] std::size_t packets() const {
      return 2 + (pixels.size() + data_bytes - 1) / data_bytes;
    }
  };
  struct Request {
    std::uint8_t flags = 0;
    std::uint32_t command = 0, id = 0;
    const std::uint8_t* payload = nullptr;
    std::size_t bytes = 0;
    sockaddr_in from{};
  };

  void fill_registers();
  void set_light_to_automatic();
  void serve_control();
  void receive(int socket);
  void handle(const Request& request);
  void answer(const Request& request, std::uint32_t status,
              const std::vector<std::uint8_t>& payload);
  void read_registers(const Request& request);
  void write_registers(const Request& request);
  void read_memory(const Request& request);
  void write_memory(const Request& request);
  void resend(const Request& request);
  void act(const Request& request);
  [[nodiscard]] bool may_write(const Request& request, std::uint32_t address) const;
  [[nodiscard]] bool takes(std::uint32_t address, const std::uint8_t* value) const;
  bool store(const Request& request, std::uint32_t address, const std::uint8_t* from,
             std::size_t bytes);
  void after_write(const Request& request, std::uint32_t address);
  void watch_heartbeat();
  void release_control();

  void stream();
  [[nodiscard]] std::optional<std::int64_t> next_exposure_host_ns();
  void expose(std::int64_t host_ns);
  void send_frame(const std::shared_ptr<const Frame>& frame, const GigeFaults& faults);
  void send_packet(const Frame& frame, std::size_t packet);
  [[nodiscard]] std::vector<std::uint8_t> packet_bytes(const Frame& frame,
                                                       std::size_t packet) const;
  [[nodiscard]] std::vector<std::uint8_t> region() const;
  [[nodiscard]] std::int64_t device_ns(std::int64_t host_ns) const;
  [[nodiscard]] std::int64_t host_ns_of(std::int64_t device_ns) const;
  [[nodiscard]] std::uint64_t ticks(std::int64_t device_ns) const;
  [[nodiscard]] std::int64_t ns_of_ticks(std::uint64_t ticks) const;
  void set_payload_size();

  GigeCameraOptions options_;
  RegisterBank bank_;
  int control_socket_ = -1, broadcast_socket_ = -1, global_socket_ = -1, stream_socket_ = -1;
  std::int64_t started_ns_ = 0;
  std::atomic<bool> stop_{false}, plugged_{true}, obeys_anyone_{true};

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::optional<sockaddr_in> controller_;
  std::int64_t last_heard_ns_ = 0;
  bool acquiring_ = false;
  std::int64_t next_grid_ns_ = 0;
  std::deque<std::int64_t> due_host_ns_;  ///< triggers and actions waiting for their time
  std::uint64_t next_id_ = 1;
  bool sends_bytes_ = false;  ///< true if show_bytes() was called last
  std::vector<std::uint8_t> picture_;
  GigeFaults faults_;
  double jumped_s_ = 0;
  bool on_master_clock_ = false;
  std::deque<std::shared_ptr<const Frame>> kept_;
  GigeCounts counts_;
  std::vector<GigeExposure> exposures_;
  std::mt19937 random_;
  std::thread control_thread_, stream_thread_;
};

}  // namespace drape::test
