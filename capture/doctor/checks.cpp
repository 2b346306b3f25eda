// SPDX-License-Identifier: Apache-2.0
#include "capture/doctor/checks.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "capture/device/gige_network.hpp"
#include "core/acceptance_file.hpp"
#include "core/program/child.hpp"
#include "core/program/run_record.hpp"

namespace drape::capture {

std::vector<FoundDevice> list_devices(const std::filesystem::path& host_program, bool sizes) {
  std::vector<std::string> words = {"--list"};
  if (sizes) words.emplace_back("--sizes");
  std::string output;
  const ChildEnd end = run_child(host_program, words, output);
  FoundDevices devices;
  try {
    throw_if_any(
        faults_of_reading(Document(Syntax::json, json_value(output)), walk_through(devices)));
    if (end.exit_code == 0) return devices.cameras;
  } catch (const Error&) {  // reported below
  }
  throw Error(ErrorKind::device, "the cameras cannot be listed", {.file = host_program.string()},
              "run it by hand with --list; build or install drape-camera-host if it is missing");
}

namespace {

namespace fs = std::filesystem;
constexpr double kMega = 1e6;
constexpr int kPacketHeaders = 36;        ///< IP, UDP and GVSP headers, included in the packet size
constexpr int kEthernetAround = 18 + 20;  ///< Ethernet framing, gap and preamble
constexpr int kUsualPacket = 1400;
constexpr double kHighSpeed_mbit = 480;

/// Name of the network card that has this address, else of the one whose subnet contains it.
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

std::optional<double> number_in(const fs::path& file) {
  std::ifstream stream(file);
  double value = 0;
  if (stream >> value) return value;
  return std::nullopt;
}

/// Days since the calibration was computed, from the run record beside it if that matches the file:
/// a copy has the file time of copying.
std::optional<double> days_since(const fs::path& calibration) {
  const fs::path record = run_record_path(calibration);
  if (!fs::is_regular_file(record)) return std::nullopt;
  const RunFile run = read_run_file(record);
  if (!run.wrote(sha256_of_file(calibration))) return std::nullopt;
  const auto ended = utc_time_in(run.ended_utc);
  if (!ended) return std::nullopt;
  return std::chrono::duration<double>(std::chrono::system_clock::now() - *ended).count() / 86400;
}

/// Lists cameras of the rig that the calibration lacks or has with another image size.
std::string strangers(const Calibration& calibration, const CamerasFile& rig) {
  std::string names;
  for (const LiveCamera& camera : rig.cameras) {
    const auto found = std::ranges::find_if(calibration.cameras, [&](const CalibratedCamera& one) {
      return one.camera.name == camera.name;
    });
    const bool known = found != calibration.cameras.end() &&
                       found->camera.model.width_px == camera.settings.width_px &&
                       found->camera.model.height_px == camera.settings.height_px;
    if (!known) names += (names.empty() ? "" : ", ") + camera.name;
  }
  return names;
}

/// Folder of the USB device behind a device file (/dev/video0); empty if there is none.
fs::path usb_device_of(const std::string& file, const fs::path& sys) {
  std::error_code why;
  fs::path folder =
      fs::canonical(sys / "class/video4linux" / fs::path(file).filename() / "device", why);
  for (; !why && folder.has_relative_path(); folder = folder.parent_path())
    if (fs::exists(folder / "busnum") && fs::exists(folder / "speed")) return folder;
  return {};
}

double usable(double mbit_per_s) {
  return mbit_per_s > kHighSpeed_mbit ? 0.9 * 0.8 * mbit_per_s : 0.8 * mbit_per_s;
}

const FoundDevice* device_of(const LiveCamera& camera, const std::vector<FoundDevice>& found) {
  const auto device = std::ranges::find_if(found, [&](const FoundDevice& one) {
    return one.backend == camera.address.backend &&
           (one.name == camera.address.device || one.identity.address == camera.address.device);
  });
  return device == found.end() ? nullptr : &*device;
}

/// A network camera with the card through which it is reached.
struct Reached {
  std::string camera, card;
  int packet_size_bytes = 0;
  double frame_bytes = 0;
};

std::map<std::string, std::vector<Reached>> cameras_by_card(const Evidence& evidence) {
  std::map<std::string, std::vector<Reached>> result;
  for (std::size_t c = 0; c < evidence.cameras.cameras.size(); ++c) {
    const LiveCamera& camera = evidence.cameras.cameras[c];
    if (camera.address.backend != Backend::aravis) continue;
    Reached reached{camera.name, "", camera.settings.packet_size_bytes.value_or(kUsualPacket),
                    static_cast<double>(*camera.settings.width_px) * *camera.settings.height_px};
    std::string address = camera.address.host_address;
    const FoundDevice* device = device_of(camera, evidence.found);
    if (address.empty() && device != nullptr) address = device->identity.address;
    if (c < evidence.live.report.cameras.size()) {
      const LiveCameraReport& seen = evidence.live.report.cameras[c];
      if (!seen.identity.host_address.empty()) address = seen.identity.host_address;
      if (const auto size = setting_in(seen.settings, "packet_size_bytes"))
        reached.packet_size_bytes = std::stoi(*size);
      if (const auto bytes = setting_in(seen.settings, "payload_bytes"))
        reached.frame_bytes = std::stod(*bytes);
    }
    // USB3 Vision has no network card.
    if (!address.empty()) result[card_of(address)].push_back(reached);
  }
  return result;
}

}  // namespace

void fields(Fields& f, Check& check) {
  std::string verdict = check.go ? "GO" : "NO-GO";
  auto to_do = check.go ? std::nullopt : std::optional(check.to_type);
  f({"check", "what was checked"}, check.name);
  f({"verdict", "GO or NO-GO"}, verdict);
  f({"found", "what was found, with units"}, check.found);
  f({"to_do", "command or action that resolves a NO-GO"}, to_do);
}

Evidence look_at_bench(const fs::path& rig, const fs::path& out,
                       const std::optional<fs::path>& calibration) {
  Evidence evidence{.cameras = read_cameras_file(rig), .out = out, .calibration = calibration};
  evidence.today = today();
  evidence.found = list_devices(camera_host_program());
  LiveOptions options;
  options.host_program = camera_host_program();
  options.frames = static_cast<int>(evidence.wanted);
  options.patience_s = 3;
  try {
    evidence.live = capture_live(evidence.cameras, options);
    StillOptions still;
    if (calibration && fs::exists(*calibration)) still.calibration = calibration;
    evidence.still = look_still(evidence.live, evidence.cameras, still);
  } catch (const Error& error) {
    evidence.fault = error;
  }
  return evidence;
}

std::vector<Check> check_all(const Evidence& evidence) {
  Checks all;
  for (const auto look :
       {check_disk, check_calibration, check_acceptance, check_devices, check_network, check_usb,
        check_receive_buffers, check_capture, check_still})
    for (Check& check : look(evidence)) all.push_back(std::move(check));
  return all;
}

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

Checks check_disk(const Evidence& evidence) {
  double set_bytes = 0;
  for (const LiveCamera& camera : evidence.cameras.cameras)
    set_bytes += static_cast<double>(*camera.settings.width_px) * *camera.settings.height_px;
  const auto free_bytes = static_cast<double>(fs::space(evidence.out).available);
  const std::string block(16U << 20U, 'x');
  const fs::path file = evidence.out / ".drape-doctor-speed";
  const auto start = std::chrono::steady_clock::now();
  write_durable(file, block);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  fs::remove(file);
  const double speed = static_cast<double>(block.size()) / took.count();
  return {{"disk space", free_bytes >= set_bytes,
           fmt::format("{:.1f} GB free, room for {:.0f} sets", free_bytes / 1e9,
                       std::floor(free_bytes / std::max(1.0, set_bytes))),
           fmt::format("free some space in {}", evidence.out.string())},
          {"disk speed", speed >= set_bytes,
           fmt::format("{:.0f} MB/s written durably, {:.0f} MB/s wanted", speed / kMega,
                       set_bytes / kMega),
           "record to a faster disk, or lower frame_rate_hz"}};
}

Checks check_calibration(const Evidence& evidence) {
  const auto& calibration = evidence.calibration;
  if (!calibration)
    return {{"calibration", true, "none is given: record the target, then drape calib", ""}};
  if (!fs::exists(*calibration))
    return {{"calibration", false, "there is none at " + calibration->string(),
             "correct --calibration, or leave it out"}};
  const std::string again = "record the target once more, then drape calib";
  const Calibration found = read_calibration(*calibration);
  if (found.no_go) return {{"calibration", false, "it is NO-GO: " + *found.no_go, again}};
  if (const std::string names = strangers(found, evidence.cameras); !names.empty())
    return {{"calibration", false,
             "it is of other cameras than the rig's: it lacks, or has in another size, " + names,
             "give the calibration of this rig, or " + again}};
  const auto days = days_since(*calibration);
  if (!days)
    return {{"calibration", true,
             fmt::format("warning, its age is unknown: {} is not there, or of another file",
                         run_record_path(*calibration).string()),
             ""}};
  return {{"calibration", *days <= evidence.largest_days,
           fmt::format("{:.1f} days old, at most {:.0f}", *days, evidence.largest_days), again}};
}

Checks check_acceptance(const Evidence& evidence) {
  const auto& calibration = evidence.calibration;
  const fs::path file = evidence.cameras.rig_file.parent_path() / "acceptance.json";
  Check check{"acceptance", true, "none is beside rig.toml: drape calib accept makes it", ""};
  if (!fs::exists(file)) return {check};
  const auto acceptance = read_record<AcceptanceFile>(file);
  const auto& until = acceptance.valid_until;
  check.found = (acceptance.lacks.empty() ? "of " : "an interim check alone, of ") +
                acceptance.date.value_or("no stated day");
  if (until) check.found += ", valid until " + *until;
  check.to_type = "record the target in new places, then drape calib accept";
  if (calibration && fs::exists(*calibration) &&
      sha256_of_file(*calibration) != acceptance.calibration_sha256) {
    check.found += ": warning, of another calibration than the one in use; " + check.to_type;
  } else if (!acceptance.go) {
    check.go = false;
    check.found +=
        ": NO-GO, " + acceptance.cause.value_or("a figure is beyond its limit or was not measured");
  } else if (until && *until < evidence.today) {
    check.found += ": warning, expired; " + check.to_type;
  }
  return {check};
}

Checks check_devices(const Evidence& evidence) {
  Checks checks;
  std::string all;
  for (const FoundDevice& d : evidence.found) all += (all.empty() ? "" : ", ") + d.name;
  for (const LiveCamera& camera : evidence.cameras.cameras) {
    if (camera.address.backend == Backend::replay) continue;
    const auto matches = std::ranges::count_if(
        evidence.found, [&](const FoundDevice& d) { return device_of(camera, {d}) != nullptr; });
    checks.push_back({"camera " + camera.name, matches == 1,
                      fmt::format("{}: {} device(s) answer", camera.address.device, matches),
                      fmt::format("check its power and cable, or name one of: {}",
                                  all.empty() ? "none answers" : all)});
  }
  return checks;
}

Checks check_network(const Evidence& evidence) {
  Checks checks;
  const auto by_card = cameras_by_card(evidence);
  const double rate_hz = evidence.cameras.frame_rate_hz;
  for (const auto& [card, list] : by_card) {
    if (card.empty()) {
      checks.push_back({"network card of " + list.front().camera, false,
                        "no network card of this machine is in its subnet",
                        "give the network card an address in the camera's subnet; `ip address` "
                        "lists them"});
      continue;
    }
    const double mbit = number_in("/sys/class/net/" + card + "/speed").value_or(1000);
    const double link = (mbit > 0 ? mbit : 1000) * kMega;
    int largest = 0, delay_ns = 0;
    double sum = 0;
    for (const Reached& camera : list) {
      const LinkNeeds needs = link_needs(camera.frame_bytes, rate_hz, camera.packet_size_bytes,
                                         static_cast<int>(list.size()), link);
      largest = std::max(largest, camera.packet_size_bytes);
      sum += 8 * needs.bytes_per_s;
      delay_ns = std::max(delay_ns, needs.packet_delay_ns);
    }
    if (const auto mtu = number_in("/sys/class/net/" + card + "/mtu"))
      checks.push_back(
          {"packet size on " + card, *mtu >= largest,
           fmt::format("MTU {:.0f} bytes, packets of {} bytes", *mtu, largest),
           fmt::format("sudo ip link set {} mtu 9000, or packet_size_bytes = {:.0f}", card, *mtu)});
    // Strict filtering by reverse path drops replies that the kernel would route by another card.
    if (number_in("/proc/sys/net/ipv4/conf/" + card + "/rp_filter") == 1 && by_card.size() > 1)
      checks.push_back({"reverse path filter of " + card, false, "it is strict, on several cards",
                        fmt::format("sudo sysctl -w net.ipv4.conf.{}.rp_filter=2", card)});
    checks.push_back({"link budget by " + card, sum <= 0.9 * link,
                      fmt::format("{:.0f} of {:.0f} Mbit/s for {} camera(s); packet_delay_ns {} "
                                  "lets each send in turn",
                                  sum / kMega, link / kMega, list.size(), delay_ns),
                      fmt::format("frame_rate_hz = {:.1f} or less, or a second network card",
                                  0.9 * link / sum * rate_hz)});
  }
  return checks;
}

Checks check_usb(const Evidence& evidence) {
  struct Bus {
    double mbit_per_s = 0, needed_mbit_per_s = 0;
    std::vector<std::string> cameras;
  };
  std::map<int, Bus> buses;
  const std::vector<LiveCameraReport>& reports = evidence.live.report.cameras;
  const double rate_hz = evidence.cameras.frame_rate_hz;
  for (std::size_t c = 0; c < std::min(evidence.cameras.cameras.size(), reports.size()); ++c) {
    const LiveCamera& camera = evidence.cameras.cameras[c];
    if (camera.address.backend != Backend::v4l2) continue;
    const FoundDevice* device = device_of(camera, evidence.found);
    const PixelFormat* format =
        find_pixel_format(setting_in(reports[c].settings, "pixel_format").value_or(""));
    if (device == nullptr || format == nullptr || format->lossy()) continue;
    const fs::path usb = usb_device_of(device->identity.address, evidence.sys);
    if (usb.empty()) continue;
    const auto bytes = static_cast<double>(format->frame_bytes(
        format->row_bytes(*camera.settings.width_px), *camera.settings.height_px));
    Bus& bus = buses[static_cast<int>(number_in(usb / "busnum").value_or(0))];
    bus.mbit_per_s = number_in(usb / "speed").value_or(kHighSpeed_mbit);
    bus.needed_mbit_per_s += 8 * bytes * rate_hz / kMega;
    bus.cameras.push_back(camera.name);
  }
  Checks checks;
  for (const auto& [number, bus] : buses) {
    const double most = usable(bus.mbit_per_s);
    checks.push_back(
        {fmt::format("USB bus {}", number), bus.needed_mbit_per_s <= most,
         fmt::format("{:.0f} Mbit/s for {}; {:.0f} of its {:.0f} Mbit/s are for pictures",
                     bus.needed_mbit_per_s, fmt::join(bus.cameras, ", "), most, bus.mbit_per_s),
         fmt::format("frame_rate_hz = {:.1f} or less, or a camera on another USB controller "
                     "(`lsusb -t` shows them)",
                     most / bus.needed_mbit_per_s * rate_hz)});
  }
  return checks;
}

Checks check_receive_buffers(const Evidence& evidence) {
  Checks checks;
  for (const LiveCameraReport& camera : evidence.live.report.cameras) {
    const auto has = setting_in(camera.settings, "receive_buffer_bytes");
    const auto needs = setting_in(camera.settings, "receive_buffer_of_a_frame_bytes");
    if (!has || !needs) continue;
    // The camera sends no faster than in the short capture, so too small a buffer loses nothing
    // until this machine is busy.
    std::string found = "packet socket, 32 MB";
    if (setting_in(camera.settings, "stream_socket") != "packet") {
      const double got = std::stod(*has), frame = std::stod(*needs);
      found = fmt::format("{:.1f} MB; a frame takes {:.1f} MB", got / kMega, frame / kMega);
      if (got < frame)
        found += fmt::format(
            ": a busy machine loses frames. sudo sysctl -w net.core.rmem_max={:.0f}", 2 * frame);
    }
    checks.push_back({"receive buffer of " + camera.name, true, found});
  }
  return checks;
}

Checks check_capture(const Evidence& evidence) {
  if (evidence.fault)
    return {{"a set of all cameras", false,
             fmt::format("camera `{}`: {}", evidence.fault->where().camera,
                         evidence.fault->what_failed()),
             evidence.fault->what_to_do()}};
  const LiveResult& live = evidence.live;
  const CamerasFile& cameras = evidence.cameras;
  Checks checks;
  const bool whole = !live.pairing.sets.empty();
  Check set{"a set of all cameras", whole,
            fmt::format("{} of {} whole, by {}", live.pairing.sets.size(), evidence.wanted,
                        name_of(live.report.method)),
            "see the cameras below"};
  std::optional<double> spread_s;
  for (const PairedFrames& one : live.pairing.sets)
    if (one.spread_s) spread_s = std::max(spread_s.value_or(0), *one.spread_s);
  if (spread_s) set.found += fmt::format(", spread {:.3f} ms", 1e3 * *spread_s);
  for (const LiveFault& f : live.report.faults)
    set.found += fmt::format("; {}: {}", f.camera, f.what);
  // A bench that loses one set of three now will lose others later.
  set.go = live.pairing.sets.size() >= evidence.wanted &&
           spread_s.value_or(0) <= cameras.largest_spread_s;
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

Checks check_still(const Evidence& evidence) {
  const StillReport& still = evidence.still;
  Checks checks;
  const auto moved = still.cloth_fault();
  if (moved)
    checks.push_back({"cloth", false, moved->what, moved->what_to_do});
  else if (still.motion_px)
    checks.push_back({"cloth", true, fmt::format("moves by {:.3f} px at most", *still.motion_px)});
  for (const std::string& camera : still.not_judged())
    checks.push_back({"cloth in " + camera, true,
                      "warning, stillness could not be judged: its pictures have structure in one "
                      "direction only, or none above their noise"});
  for (const CameraStill& camera : still.cameras) {
    const auto fault = std::ranges::find(still.moved_cameras, camera.name, &LiveFault::camera);
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

}  // namespace drape::capture
