// SPDX-License-Identifier: Apache-2.0
// The image stream (GVSP): exposures on a grid or by trigger, divided into packets.
#include <algorithm>
#include <chrono>
#include <cmath>

#include "tests/support/gige_camera/gige_camera.hpp"
#include "tests/support/gige_camera/wire.hpp"

namespace drape::test {
namespace {

constexpr std::uint32_t kLeader = 1, kTrailer = 2, kPayload = 3;
constexpr std::size_t kHeaders = 20 + 8 + 8;  ///< IP, UDP, GVSP, all counted in the packet size
constexpr std::size_t kExtendedHeaders = kHeaders + 12;
constexpr std::size_t kIpUdp = 20 + 8;
constexpr std::size_t kKeptFrames = 16;
constexpr std::uint32_t kExtendedChunks = 0x4001, kExtendedFlag = 0x80;

}  // namespace

void GigeCamera::stream() {
  while (!stop_) {
    std::optional<std::int64_t> due;
    {
      std::unique_lock lock(mutex_);
      due = acquiring_ && plugged_ ? next_exposure_host_ns() : std::nullopt;
      const std::int64_t wait = due ? *due - now_ns() : 10'000'000;
      if (wait > 0) {
        wake_.wait_for(lock, std::chrono::nanoseconds(std::min<std::int64_t>(wait, 10'000'000)));
        continue;
      }
      if (bank_.word(reg::trigger_mode) == 1) {
        due_host_ns_.erase(std::find(due_host_ns_.begin(), due_host_ns_.end(), *due));
      } else {
        const auto period = static_cast<std::int64_t>(1e9 / bank_.real(reg::frame_rate_hz));
        // If late, it skips steps and keeps its phase.
        next_grid_ns_ = *due + (std::max<std::int64_t>(0, now_ns() - *due) / period + 1) * period;
      }
    }
    expose(*due);
  }
}

/// The caller must hold the mutex.
std::optional<std::int64_t> GigeCamera::next_exposure_host_ns() {
  if (bank_.word(reg::trigger_mode) == 1) {
    if (due_host_ns_.empty()) return std::nullopt;
    return *std::min_element(due_host_ns_.begin(), due_host_ns_.end());
  }
  if (next_grid_ns_ == 0) {
    const auto period = static_cast<std::int64_t>(1e9 / bank_.real(reg::frame_rate_hz));
    next_grid_ns_ = options_.first_exposure_s
                        ? now_ns() + std::llround(1e9 * *options_.first_exposure_s)
                        : (now_ns() / period + 1) * period;
  }
  return next_grid_ns_;
}

std::vector<std::uint8_t> GigeCamera::region() const {
  const std::uint32_t width = bank_.word(reg::width), height = bank_.word(reg::height);
  const std::uint32_t left = bank_.word(reg::offset_x), top = bank_.word(reg::offset_y);
  const auto sensor_width = static_cast<std::uint32_t>(options_.width_px);
  if (sends_bytes_) return picture_;
  std::vector<std::uint8_t> pixels(std::size_t{width} * height, 0);
  for (std::uint32_t y = 0; y < height; ++y) {
    const auto row =
        picture_.begin() + (static_cast<std::ptrdiff_t>(top) + y) * sensor_width + left;
    std::copy_n(row, width, pixels.begin() + static_cast<std::ptrdiff_t>(y) * width);
  }
  if (bank_.word(reg::gamma_switch) != 0)
    for (std::uint8_t& p : pixels) p = static_cast<std::uint8_t>(255 * std::pow(p / 255.0, 0.45));
  return pixels;
}

void GigeCamera::expose(std::int64_t host_ns) {
  auto frame = std::make_shared<Frame>();
  GigeFaults faults;
  bool skip = false;
  {
    const std::lock_guard lock(mutex_);
    faults = faults_;
    frame->id = next_id_;
    frame->extended = options_.personality.extended_ids;
    frame->chunks = bank_.word(reg::chunks) != 0;
    next_id_ = next_id_ == 65535 && !frame->extended ? 1 : next_id_ + 1;
    // A real shutter opens on time, so the time stamp is that of the grid, not of the thread.
    frame->ticks = ticks(device_ns(host_ns));
    frame->width = bank_.word(reg::width);
    frame->height = bank_.word(reg::height);
    frame->data_bytes =
        (bank_.word(reg::packet_size) & 0xFFFF) - (frame->extended ? kExtendedHeaders : kHeaders);
    frame->pixels = region();
    if (frame->chunks) frame->pixels.resize(frame->pixels.size() + 16, 0xC5);
    exposures_.push_back({static_cast<std::uint16_t>(frame->id), host_ns});
    ++counts_.frames_exposed;
    skip = std::uniform_real_distribution<double>(0, 1)(random_) < faults.skip_frame;
    if (skip) {
      ++counts_.frames_skipped;
      return;
    }
    kept_.push_back(frame);
    if (kept_.size() > kKeptFrames) kept_.pop_front();
  }
  if (faults.late_ms > 0) std::this_thread::sleep_for(std::chrono::milliseconds(faults.late_ms));
  send_frame(frame, faults);
}

void GigeCamera::send_frame(const std::shared_ptr<const Frame>& frame, const GigeFaults& faults) {
  const std::size_t count = frame->packets();
  std::vector<std::size_t> order;
  GigeCounts more;
  {
    const std::lock_guard lock(mutex_);
    std::uniform_real_distribution<double> chance(0, 1);
    for (std::size_t packet = 0; packet < count; ++packet) {
      ++more.packets_sent;
      if (faults.lose > 0 && chance(random_) < faults.lose) {
        ++more.packets_lost;
        continue;
      }
      order.push_back(packet);
      if (faults.duplicate > 0 && chance(random_) < faults.duplicate) {
        order.push_back(packet);
        ++more.packets_duplicated;
      }
    }
    for (std::size_t i = 1; faults.reorder > 0 && i < order.size(); ++i) {
      if (chance(random_) >= faults.reorder) continue;
      std::swap(order[i - 1], order[i]);
      ++more.packets_reordered;
    }
    counts_.packets_sent += more.packets_sent;
    counts_.packets_lost += more.packets_lost;
    counts_.packets_duplicated += more.packets_duplicated;
    counts_.packets_reordered += more.packets_reordered;
    ++counts_.frames_sent;
  }
  const std::int64_t gap_ns = bank_.word(reg::packet_delay);
  std::int64_t next_ns = now_ns();
  for (const std::size_t packet : order) {
    if (stop_ || !plugged_) return;
    send_packet(*frame, packet);
    next_ns += gap_ns;
    const std::int64_t ahead = next_ns - now_ns();
    if (gap_ns > 0 && ahead > 50'000) std::this_thread::sleep_for(std::chrono::nanoseconds(ahead));
  }
}

void GigeCamera::send_packet(const Frame& frame, std::size_t packet) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(stream_port());
  to.sin_addr.s_addr = htonl(bank_.word(reg::stream_address));
  if (to.sin_port == 0) return;
  const auto bytes = packet_bytes(frame, packet);
  if (bytes.size() + kIpUdp > options_.path_bytes) return;
  ::sendto(stream_socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to),
           sizeof to);
}

std::vector<std::uint8_t> GigeCamera::packet_bytes(const Frame& frame, std::size_t packet) const {
  const bool leader = packet == 0, trailer = packet + 1 == frame.packets();
  std::vector<std::uint8_t> bytes;
  bytes.reserve(frame.data_bytes + 64);
  wire::put16(bytes, 0);
  const std::uint32_t kind = leader ? kLeader : trailer ? kTrailer : kPayload;
  if (frame.extended) {
    wire::put16(bytes, 0);
    wire::put32(bytes, (kExtendedFlag | kind) << 24);
    wire::put64(bytes, frame.id);
    wire::put32(bytes, static_cast<std::uint32_t>(packet));
  } else {
    wire::put16(bytes, frame.id);
    wire::put32(bytes, kind << 24 | static_cast<std::uint32_t>(packet));
  }
  if (leader) {
    wire::put16(bytes, 0);
    wire::put16(bytes, frame.chunks ? kExtendedChunks : 1);  // an image
    wire::put64(bytes, frame.ticks);
    wire::put32(bytes, bank_.word(reg::pixel_format));
    wire::put32(bytes, frame.width);
    wire::put32(bytes, frame.height);
    wire::put32(bytes, bank_.word(reg::offset_x));
    wire::put32(bytes, bank_.word(reg::offset_y));
    wire::put32(bytes, 0);
  } else if (trailer) {
    wire::put32(bytes, 1);
    wire::put32(bytes, frame.height);
  } else {
    const std::size_t from = (packet - 1) * frame.data_bytes;
    const std::size_t count = std::min(frame.data_bytes, frame.pixels.size() - from);
    const auto start = frame.pixels.begin() + static_cast<std::ptrdiff_t>(from);
    bytes.insert(bytes.end(), start, start + static_cast<std::ptrdiff_t>(count));
  }
  return bytes;
}

}  // namespace drape::test
