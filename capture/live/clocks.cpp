// SPDX-License-Identifier: Apache-2.0
#include "capture/live/clocks.hpp"

#include <fmt/format.h>

#include <cmath>

namespace drape::capture {
namespace {

constexpr double kLargest_s = 5e-3;  ///< beyond the uncertainty of both readings

/// Absent when PTP was not asked for.
std::optional<std::string> ptp_status(const LiveCameraReport& camera) {
  for (const SettingReadBack& s : camera.settings)
    if (s.name == "ptp_status") return s.value;
  return std::nullopt;
}

/// The camera's clock minus the host's at the host time `at_ns`.
double offset_s(const ClockFit& clock, std::int64_t at_ns) {
  const auto since = static_cast<double>(at_ns - clock.reference_host_ns);
  const auto offset = static_cast<double>(clock.reference_device_ns - clock.reference_host_ns);
  return 1e-9 * (offset - since * 1e-6 * clock.drift_ppm);
}

}  // namespace

std::vector<std::optional<ClockFit>> fit_clocks(const ClockReadings& clocks) {
  std::vector<std::optional<ClockFit>> fits;
  for (const auto& clock : clocks) fits.push_back(fit_clock(clock, {}));
  return fits;
}

std::optional<ClockFit> newest_clock(const ClockReadings& clocks) {
  return clocks.empty() ? std::nullopt : fit_clock(clocks.back(), {});
}

std::vector<LiveFault> ptp_faults(const std::vector<LiveCameraReport>& cameras) {
  std::vector<LiveFault> faults;
  const LiveCameraReport* first = nullptr;
  for (const LiveCameraReport& camera : cameras) {
    const auto status = ptp_status(camera);
    if (status && status != "Slave" && status != "Master") {
      faults.push_back({camera.name,
                        fmt::format("PTP does not hold its clock ({}); offset and drift are "
                                    "estimated instead",
                                    *status),
                        "start a PTP master on this network, or set ptp = false"});
      continue;
    }
    if (!status || !camera.clock) continue;
    if (first == nullptr) {
      first = &camera;
      continue;
    }
    const std::int64_t at_ns = first->clock->reference_host_ns;
    const double apart = offset_s(*camera.clock, at_ns) - offset_s(*first->clock, at_ns);
    if (std::abs(apart) <=
        kLargest_s + camera.clock->offset_bound_s() + first->clock->offset_bound_s())
      continue;
    faults.push_back(
        {camera.name,
         fmt::format("it says that PTP holds its clock, which is {:.3f} s from that of `{}`", apart,
                     first->name),
         "give all cameras the same PTP master and time scale, or switch ptp off"});
  }
  return faults;
}

}  // namespace drape::capture
