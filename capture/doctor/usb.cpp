// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <optional>

#include "capture/doctor/checks.hpp"
#include "capture/pixel/pixel_format.hpp"

namespace drape::capture {
namespace {

namespace fs = std::filesystem;
constexpr double kMbit = 1e6;
constexpr double kHighSpeed_mbit = 480;

struct Bus {
  double mbit_per_s = 0;
  double needed_mbit_per_s = 0;
  std::vector<std::string> cameras;
};

std::optional<double> number_of_file(const fs::path& file) {
  std::ifstream stream(file);
  double value = 0;
  if (stream >> value) return value;
  return std::nullopt;
}

/// The folder of the USB device that a device file (/dev/video0) belongs to; empty: of none.
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

}  // namespace

std::vector<Check> check_usb(const CamerasFile& cameras, const std::vector<FoundDevice>& found,
                             const LiveReport& report, const fs::path& sys) {
  std::map<int, Bus> buses;
  for (std::size_t c = 0; c < std::min(cameras.cameras.size(), report.cameras.size()); ++c) {
    const LiveCamera& camera = cameras.cameras[c];
    if (camera.address.backend != Backend::v4l2) continue;
    const auto device = std::find_if(found.begin(), found.end(), [&](const FoundDevice& one) {
      return one.backend == Backend::v4l2 &&
             (one.name == camera.address.device || one.identity.address == camera.address.device);
    });
    const PixelFormat* format = find_pixel_format(value_of(report.cameras[c].settings, "pixel_format").value_or(""));
    if (device == found.end() || format == nullptr || format->lossy()) continue;
    const fs::path usb = usb_device_of(device->identity.address, sys);
    if (usb.empty()) continue;
    const int width_px = *camera.settings.width_px, height_px = *camera.settings.height_px;
    const auto bytes =
        static_cast<double>(format->frame_bytes(format->row_bytes(width_px), height_px));
    Bus& bus = buses[static_cast<int>(number_of_file(usb / "busnum").value_or(0))];
    bus.mbit_per_s = number_of_file(usb / "speed").value_or(kHighSpeed_mbit);
    bus.needed_mbit_per_s += 8 * bytes * cameras.frame_rate_hz / kMbit;
    bus.cameras.push_back(camera.name);
  }
  std::vector<Check> checks;
  for (const auto& [number, bus] : buses) {
    const double most = usable(bus.mbit_per_s);
    checks.push_back(
        {fmt::format("USB bus {}", number), bus.needed_mbit_per_s <= most,
         fmt::format("{:.0f} Mbit/s for {}; {:.0f} of its {:.0f} Mbit/s are for pictures",
                     bus.needed_mbit_per_s, fmt::join(bus.cameras, ", "), most, bus.mbit_per_s),
         fmt::format("frame_rate_hz = {:.1f} or less, or a camera on another USB controller "
                     "(`lsusb -t` shows them)",
                     most / bus.needed_mbit_per_s * cameras.frame_rate_hz)});
  }
  return checks;
}

}  // namespace drape::capture
