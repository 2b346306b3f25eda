// SPDX-License-Identifier: Apache-2.0
#include "capture/doctor/checks.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>

#include "capture/live/frame_quality.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::capture {
namespace {

constexpr double kMega = 1e6;
constexpr int kPacketHeaders = 36;        ///< IP, UDP and GVSP, part of the packet size
constexpr int kEthernetAround = 18 + 20;  ///< frame, gap and preamble
constexpr int kUsualPacket = 1400;

int packet_size_of(const LiveCamera& camera) {
  return camera.settings.packet_size_bytes.value_or(kUsualPacket);
}

/// Name of the network card with this address.
std::optional<std::string> card_of(const std::string& address) {
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return std::nullopt;
  std::optional<std::string> found;
  for (const ifaddrs* a = all; a != nullptr && !found; a = a->ifa_next) {
    if (a->ifa_addr == nullptr || a->ifa_addr->sa_family != AF_INET) continue;
    char text[INET_ADDRSTRLEN] = {};
    const auto* inet = reinterpret_cast<const sockaddr_in*>(a->ifa_addr);
    ::inet_ntop(AF_INET, &inet->sin_addr, text, sizeof text);
    if (address == text) found = a->ifa_name;
  }
  ::freeifaddrs(all);
  return found;
}

std::optional<double> number_in(const std::filesystem::path& file) {
  std::ifstream stream(file);
  double value = 0;
  if (stream >> value) return value;
  return std::nullopt;
}

/// Cameras by the network card they are reached by.
std::map<std::string, std::vector<const LiveCamera*>> by_host_address(const CamerasFile& cameras) {
  std::map<std::string, std::vector<const LiveCamera*>> result;
  for (const LiveCamera& camera : cameras.cameras) {
    if (camera.address.backend == Backend::aravis && !camera.address.host_address.empty())
      result[camera.address.host_address].push_back(&camera);
  }
  return result;
}

}  // namespace

LinkNeeds link_needs(int width_px, int height_px, double frame_rate_hz, int packet_size_bytes,
                     int cameras, double link_bits_per_s) {
  LinkNeeds needs;
  const double data = packet_size_bytes - kPacketHeaders;
  const double packets = std::ceil(static_cast<double>(width_px) * height_px / data) + 2;
  const double on_wire = packet_size_bytes + kEthernetAround;
  needs.bytes_per_s = packets * on_wire * frame_rate_hz;
  needs.packet_delay_ns =
      static_cast<int>(std::ceil(1e9 * (cameras - 1) * on_wire * 8 / link_bits_per_s));
  return needs;
}

std::int64_t largest_socket_buffer() {
  return static_cast<std::int64_t>(number_in("/proc/sys/net/core/rmem_max").value_or(0));
}

Check check_socket_buffer(std::int64_t largest_bytes, std::int64_t frame_bytes) {
  if (largest_bytes == 0)
    return {"socket buffer", true, "the kernel's limit cannot be read here", ""};
  return {"socket buffer", largest_bytes >= frame_bytes,
          fmt::format("at most {:.1f} MB, a frame has {:.1f} MB",
                      static_cast<double>(largest_bytes) / kMega,
                      static_cast<double>(frame_bytes) / kMega),
          fmt::format("sudo sysctl -w net.core.rmem_max={}", 4 * frame_bytes)};
}

Check check_disk_space(std::uintmax_t free_bytes, std::uintmax_t needed_bytes,
                       const std::string& folder) {
  return {"disk space", free_bytes >= needed_bytes,
          fmt::format("{:.1f} GB free, {:.1f} GB wanted", static_cast<double>(free_bytes) / 1e9,
                      static_cast<double>(needed_bytes) / 1e9),
          fmt::format("free some space in {}", folder)};
}

Check check_disk_speed(const std::filesystem::path& folder, double needed_bytes_per_s) {
  const std::string block(16U << 20U, 'x');
  const std::filesystem::path file = folder / ".drape-doctor-speed";
  const auto start = std::chrono::steady_clock::now();
  write_durable(file, block);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  std::filesystem::remove(file);
  const double speed = static_cast<double>(block.size()) / took.count();
  return {"disk speed", speed >= needed_bytes_per_s,
          fmt::format("{:.0f} MB/s written durably, {:.0f} MB/s wanted", speed / kMega,
                      needed_bytes_per_s / kMega),
          "record to a faster disk, or lower frame_rate_hz"};
}

std::vector<Check> check_mtu(const CamerasFile& cameras) {
  std::vector<Check> checks;
  for (const auto& [address, list] : by_host_address(cameras)) {
    int largest = 0;
    for (const LiveCamera* camera : list) largest = std::max(largest, packet_size_of(*camera));
    const auto card = card_of(address);
    const auto mtu = card ? number_in("/sys/class/net/" + *card + "/mtu") : std::nullopt;
    if (!card) {
      checks.push_back({"network card " + address, false, "no network card has this address",
                        "correct host_address in cameras.toml; `ip address` lists them"});
    } else if (mtu) {
      checks.push_back({"packet size on " + *card, *mtu >= largest,
                        fmt::format("MTU {:.0f} bytes, packets of {} bytes", *mtu, largest),
                        fmt::format("sudo ip link set {} mtu 9000, or packet_size_bytes = {:.0f}",
                                    *card, *mtu)});
    }
  }
  return checks;
}

std::vector<Check> check_link(const CamerasFile& cameras) {
  std::vector<Check> checks;
  for (const auto& [address, list] : by_host_address(cameras)) {
    const auto card = card_of(address);
    const double mbit =
        card ? number_in("/sys/class/net/" + *card + "/speed").value_or(1000) : 1000;
    const double link = (mbit > 0 ? mbit : 1000) * kMega;
    double sum = 0;
    int delay_ns = 0;
    for (const LiveCamera* c : list) {
      const LinkNeeds needs =
          link_needs(*c->settings.width_px, *c->settings.height_px, cameras.frame_rate_hz,
                     packet_size_of(*c), static_cast<int>(list.size()), link);
      sum += 8 * needs.bytes_per_s;
      delay_ns = std::max(delay_ns, needs.packet_delay_ns);
    }
    checks.push_back(
        {"link budget by " + address, sum <= 0.9 * link,
         fmt::format("{:.0f} of {:.0f} Mbit/s for {} camera(s); packet_delay_ns {} lets "
                     "them share it evenly",
                     sum / kMega, link / kMega, list.size(), delay_ns),
         fmt::format("frame_rate_hz = {:.1f} or less, or a second network card",
                     0.9 * link / sum * cameras.frame_rate_hz)});
  }
  return checks;
}

std::vector<Check> check_devices(const CamerasFile& cameras,
                                 const std::vector<FoundDevice>& found) {
  std::vector<Check> checks;
  std::string all;
  for (const FoundDevice& d : found) all += (all.empty() ? "" : ", ") + d.name;
  for (const LiveCamera& camera : cameras.cameras) {
    if (camera.address.backend == Backend::replay) continue;
    const auto matches = std::count_if(found.begin(), found.end(), [&](const FoundDevice& d) {
      return d.backend == camera.address.backend &&
             (d.name == camera.address.device || d.identity.address == camera.address.device);
    });
    checks.push_back({"camera " + camera.name, matches == 1,
                      fmt::format("{}: {} device(s) answer", camera.address.device, matches),
                      fmt::format("check its power and cable, or name one of: {}",
                                  all.empty() ? "none answers" : all)});
  }
  return checks;
}

Check check_calibration(const std::optional<std::filesystem::path>& calibration,
                        double largest_days) {
  if (!calibration || !std::filesystem::exists(*calibration))
    return {"calibration", false, "there is none",
            "record the target, then drape calib, and give it with --calibration"};
  const auto age = std::filesystem::file_time_type::clock::now() -
                   std::filesystem::last_write_time(*calibration);
  const double days = std::chrono::duration<double>(age).count() / 86400;
  return {"calibration", days <= largest_days,
          fmt::format("{:.1f} days old, at most {:.0f}", days, largest_days),
          "record the target anew, then drape calib"};
}

std::vector<Check> check_still(const StillReport& still) {
  std::vector<Check> checks;
  const auto moved = still.cloth_fault();
  if (still.motion_px)
    checks.push_back({"cloth", !moved, fmt::format("moves by {:.3f} px at most", *still.motion_px),
                      moved ? moved->what_to_do : ""});
  for (const CameraStill& camera : still.cameras) {
    const auto fault = std::find_if(still.moved_cameras.begin(), still.moved_cameras.end(),
                                    [&](const LiveFault& f) { return f.camera == camera.name; });
    if (camera.background_shift_px)
      checks.push_back({"place of " + camera.name, fault == still.moved_cameras.end(),
                        fmt::format("its background is {:.2f} px from the reference set",
                                    *camera.background_shift_px),
                        "lock the camera and calibrate anew"});
  }
  return checks;
}

std::vector<Check> check_capture(const LiveResult& live, const CamerasFile& cameras) {
  std::vector<Check> checks;
  const bool whole = !live.pairing.sets.empty();
  Check set{"a set of all cameras", whole,
            whole ? "captured by " + to_string(live.report.method) : "", "see the cameras below"};
  if (whole && live.pairing.sets[0].spread_s)
    set.found += fmt::format(", spread {:.3f} ms", 1e3 * *live.pairing.sets[0].spread_s);
  for (const LiveFault& f : live.report.faults)
    set.found += fmt::format("; {}: {}", f.camera, f.what);
  set.go = whole && live.report.why_fallen_back.empty() &&
           live.pairing.sets[0].spread_s.value_or(0) <= cameras.largest_spread_s;
  if (!live.report.why_fallen_back.empty()) {
    set.found += "; fallen back: " + live.report.why_fallen_back;
    set.to_type = "choose a sync method that all cameras have";
  }
  checks.push_back(set);
  const QualityLimits limits;
  for (std::size_t c = 0; c < cameras.cameras.size(); ++c) {
    const LiveCameraReport& report = live.report.cameras[c];
    if (report.clock)
      checks.push_back({"clock of " + report.name, report.clock->bound_s < 0.5e-3,
                        fmt::format("offset known to {:.3f} ms", 1e3 * report.clock->bound_s),
                        "take load off this machine and its network"});
    if (!whole) continue;
    const LiveFrame& frame = live.frames[live.pairing.sets[0].frames[c]];
    const FrameQuality q = quality_of(frame.pixels, frame.width_px);
    checks.push_back(
        {"picture of " + report.name, !quality_fault(q, limits),
         fmt::format("mean level {:.0f}, contrast {:.0f}, saturated {:.1f} %, sharpness "
                     "{:.2f} of the contrast per px",
                     q.mean, q.contrast, 100 * q.saturated_share, q.sharpness),
         quality_remedy(q, limits)});
  }
  return checks;
}

}  // namespace drape::capture
