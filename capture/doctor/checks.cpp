// SPDX-License-Identifier: Apache-2.0
#include "capture/doctor/checks.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>

#include "capture/device/gige_network.hpp"
#include "capture/recording/frame_quality.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::capture {
namespace {

constexpr double kMega = 1e6;
constexpr int kPacketHeaders = 36;        ///< IP, UDP and GVSP, part of the packet size
constexpr int kEthernetAround = 18 + 20;  ///< frame, gap and preamble
constexpr int kUsualPacket = 1400;

/// Name of the network card with this address, or else of the one whose subnet holds it.
std::string card_of(const std::string& address) {
  in_addr wanted{};
  if (::inet_pton(AF_INET, address.c_str(), &wanted) != 1) return {};
  std::string near;
  for (const NetworkCard& card : network_cards()) {
    const in_addr_t own = card.address.s_addr, mask = card.mask.s_addr;
    if (own == wanted.s_addr) return card.name;
    if ((own & mask) == (wanted.s_addr & mask)) near = card.name;
  }
  return near;
}

std::optional<double> number_in(const std::filesystem::path& file) {
  std::ifstream stream(file);
  double value = 0;
  if (stream >> value) return value;
  return std::nullopt;
}

std::map<std::string, std::vector<const Reached*>> by_card(const std::vector<Reached>& cameras) {
  std::map<std::string, std::vector<const Reached*>> result;
  for (const Reached& camera : cameras) result[camera.card].push_back(&camera);
  return result;
}

}  // namespace

LinkNeeds link_needs(double frame_bytes, double frame_rate_hz, int packet_size_bytes, int cameras,
                     double link_bits_per_s) {
  LinkNeeds needs;
  const double data = packet_size_bytes - kPacketHeaders;
  const double packets = std::ceil(frame_bytes / data) + 2;
  const double on_wire = packet_size_bytes + kEthernetAround;
  needs.bytes_per_s = packets * on_wire * frame_rate_hz;
  needs.packet_delay_ns =
      static_cast<int>(std::ceil(1e9 * (cameras - 1) * on_wire * 8 / link_bits_per_s));
  return needs;
}

Check check_disk_space(std::uintmax_t free_bytes, std::uintmax_t needed_bytes,
                       const std::string& folder) {
  return {"disk space", free_bytes >= needed_bytes,
          fmt::format("{:.1f} GB free, room for {} sets", static_cast<double>(free_bytes) / 1e9,
                      needed_bytes == 0 ? 0 : free_bytes / needed_bytes),
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

std::vector<Reached> reached_cameras(const CamerasFile& cameras,
                                     const std::vector<FoundDevice>& found,
                                     const LiveReport& report) {
  std::vector<Reached> result;
  for (std::size_t c = 0; c < cameras.cameras.size(); ++c) {
    const LiveCamera& camera = cameras.cameras[c];
    if (camera.address.backend != Backend::aravis) continue;
    Reached reached{camera.name, "", camera.settings.packet_size_bytes.value_or(kUsualPacket),
                    static_cast<double>(*camera.settings.width_px) * *camera.settings.height_px};
    std::string address = camera.address.host_address;
    for (const FoundDevice& d : found)
      if (address.empty() &&
          (d.name == camera.address.device || d.identity.address == camera.address.device))
        address = d.identity.address;
    if (c < report.cameras.size()) {
      const LiveCameraReport& seen = report.cameras[c];
      if (!seen.identity.host_address.empty()) address = seen.identity.host_address;
      if (const auto size = value_of(seen.settings, "packet_size_bytes"))
        reached.packet_size_bytes = std::stoi(*size);
      if (const auto bytes = value_of(seen.settings, "payload_bytes"))
        reached.frame_bytes = std::stod(*bytes);
    }
    reached.card = card_of(address);
    if (!address.empty()) result.push_back(reached);  // USB3 Vision has no network card
  }
  return result;
}

std::vector<Check> check_mtu(const std::vector<Reached>& cameras) {
  std::vector<Check> checks;
  for (const auto& [card, list] : by_card(cameras)) {
    int largest = 0;
    for (const Reached* camera : list) largest = std::max(largest, camera->packet_size_bytes);
    if (card.empty()) {
      checks.push_back({"network card of " + list.front()->camera, false,
                        "no network card of this machine is in its subnet",
                        "give the network card an address in the camera's subnet; `ip address` "
                        "lists them"});
      continue;
    }
    const auto mtu = number_in("/sys/class/net/" + card + "/mtu");
    if (mtu)
      checks.push_back(
          {"packet size on " + card, *mtu >= largest,
           fmt::format("MTU {:.0f} bytes, packets of {} bytes", *mtu, largest),
           fmt::format("sudo ip link set {} mtu 9000, or packet_size_bytes = {:.0f}", card, *mtu)});
    // A strict filter drops a camera whose answer the kernel would send by another card.
    const auto strict = number_in("/proc/sys/net/ipv4/conf/" + card + "/rp_filter");
    if (strict && *strict == 1 && by_card(cameras).size() > 1)
      checks.push_back({"reverse path filter of " + card, false, "it is strict, on several cards",
                        fmt::format("sudo sysctl -w net.ipv4.conf.{}.rp_filter=2", card)});
  }
  return checks;
}

std::vector<Check> check_link(const std::vector<Reached>& cameras, double frame_rate_hz) {
  std::vector<Check> checks;
  for (const auto& [card, list] : by_card(cameras)) {
    if (card.empty()) continue;
    const double mbit = number_in("/sys/class/net/" + card + "/speed").value_or(1000);
    const double link = (mbit > 0 ? mbit : 1000) * kMega;
    double sum = 0;
    int delay_ns = 0;
    for (const Reached* c : list) {
      const LinkNeeds needs = link_needs(c->frame_bytes, frame_rate_hz, c->packet_size_bytes,
                                         static_cast<int>(list.size()), link);
      sum += 8 * needs.bytes_per_s;
      delay_ns = std::max(delay_ns, needs.packet_delay_ns);
    }
    checks.push_back({"link budget by " + card, sum <= 0.9 * link,
                      fmt::format("{:.0f} of {:.0f} Mbit/s for {} camera(s); packet_delay_ns {} "
                                  "lets each send in turn",
                                  sum / kMega, link / kMega, list.size(), delay_ns),
                      fmt::format("frame_rate_hz = {:.1f} or less, or a second network card",
                                  0.9 * link / sum * frame_rate_hz)});
  }
  return checks;
}

std::vector<Check> check_receive_buffers(const LiveReport& report) {
  std::vector<Check> checks;
  for (const LiveCameraReport& camera : report.cameras) {
    const auto has = value_of(camera.settings, "receive_buffer_bytes");
    const auto needs = value_of(camera.settings, "receive_buffer_of_a_frame_bytes");
    if (!has || !needs) continue;
    const bool ring = value_of(camera.settings, "stream_socket") == "packet";
    const double got = std::stod(*has), frame = std::stod(*needs);
    // The camera sends no faster than it did in the short capture: too small a buffer alone loses
    // nothing until this machine is busy.
    checks.push_back(
        {"receive buffer of " + camera.name, true,
         ring ? "packet socket, 32 MB"
              : fmt::format("{:.1f} MB; a frame takes {:.1f} MB{}", got / kMega, frame / kMega,
                            got >= frame ? ""
                                         : fmt::format(": a busy machine loses "
                                                       "frames. sudo sysctl -w "
                                                       "net.core.rmem_max={:.0f}",
                                                       2 * frame)),
         ""});
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

std::vector<Check> check_still(const StillReport& still) {
  std::vector<Check> checks;
  const auto moved = still.cloth_fault();
  if (moved)
    checks.push_back({"cloth", false, moved->what, moved->what_to_do});
  else if (still.motion_px)
    checks.push_back(
        {"cloth", true, fmt::format("moves by {:.3f} px at most", *still.motion_px), ""});
  for (const std::string& camera : still.not_judged())
    checks.push_back({"cloth in " + camera, true,
                      "warning, stillness could not be judged: its pictures have structure in one "
                      "direction only, or none above their noise",
                      ""});
  for (const CameraStill& camera : still.cameras) {
    const auto fault = std::find_if(still.moved_cameras.begin(), still.moved_cameras.end(),
                                    [&](const LiveFault& f) { return f.camera == camera.name; });
    const bool in_place = fault == still.moved_cameras.end();
    if (camera.background_shift_px)
      checks.push_back({"place of " + camera.name, in_place,
                        fmt::format("its background is {:.2f} px from the reference set",
                                    *camera.background_shift_px),
                        in_place ? "" : fault->what_to_do});
    else if (!in_place)
      checks.push_back({"place of " + camera.name, false, fault->what, fault->what_to_do});
  }
  return checks;
}

std::vector<Check> check_capture(const LiveResult& live, const CamerasFile& cameras,
                                 std::size_t wanted) {
  std::vector<Check> checks;
  const bool whole = !live.pairing.sets.empty();
  Check set{"a set of all cameras", whole,
            fmt::format("{} of {} whole, by {}", live.pairing.sets.size(), wanted,
                        to_string(live.report.method)),
            "see the cameras below"};
  std::optional<double> spread_s;
  for (const PairedFrames& one : live.pairing.sets)
    if (one.spread_s) spread_s = std::max(spread_s.value_or(0), *one.spread_s);
  if (spread_s) set.found += fmt::format(", spread {:.3f} ms", 1e3 * *spread_s);
  for (const LiveFault& f : live.report.faults)
    set.found += fmt::format("; {}: {}", f.camera, f.what);
  // A bench that loses one of three loses others later.
  set.go = live.pairing.sets.size() >= wanted && spread_s.value_or(0) <= cameras.largest_spread_s;
  if (!live.report.why_fallen_back.empty())
    set.found += "; fallen back: " + live.report.why_fallen_back;
  if (!set.go && !live.report.faults.empty()) set.to_type = live.report.faults[0].what_to_do;
  checks.push_back(set);
  const QualityLimits limits;
  for (std::size_t c = 0; c < cameras.cameras.size(); ++c) {
    const LiveCameraReport& report = live.report.cameras[c];
    if (report.clock) {
      const double bound_s = report.clock->offset_bound_s();
      const bool only_drift = report.clock->bound_s < cameras.largest_spread_s;
      checks.push_back(
          {"clock of " + report.name, bound_s < cameras.largest_spread_s,
           fmt::format("offset known to {:.3f} ms", 1e3 * bound_s),
           only_drift
               ? "lower frame_rate_hz, or raise largest_spread_ms: the drift of a clock is not "
                 "known within a second"
               : "take load off this machine and its network"});
    }
    if (!whole) continue;
    const LiveFrame& frame = live.frames[live.pairing.sets[0].frames[c]];
    const FrameQuality q = quality_of(frame.pixels, frame.width_px);
    checks.push_back(
        {"picture of " + report.name, !quality_fault(q, limits),
         fmt::format("mean level {:.0f}, contrast {:.0f}, saturated {:.1f} %, sharpness "
                     "{:.2f} of the contrast per px",
                     q.mean, q.contrast, 100 * q.saturated_fraction, q.sharpness),
         quality_remedy(q, limits)});
  }
  return checks;
}

}  // namespace drape::capture
