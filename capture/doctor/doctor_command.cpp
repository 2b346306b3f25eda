// SPDX-License-Identifier: Apache-2.0
// drape-capture doctor: is the bench fit to measure? Each check GO or NO-GO, and what to type.
#include <fmt/format.h>

#include "capture/doctor/checks.hpp"
#include "capture/doctor/commands.hpp"
#include "capture/doctor/device_list.hpp"
#include "core/error.hpp"
#include "core/files/json_file.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"

namespace drape::capture {

namespace fs = std::filesystem;

namespace {

void append(std::vector<Check>& checks, const std::vector<Check>& more) {
  checks.insert(checks.end(), more.begin(), more.end());
}

std::vector<Check> check_machine(const CamerasFile& cameras, const fs::path& out) {
  std::uintmax_t bytes = 0;
  for (const auto& c : cameras.cameras) {
    bytes += static_cast<std::uintmax_t>(*c.settings.width_px) *
             static_cast<std::uintmax_t>(*c.settings.height_px);
  }
  return {check_disk_space(fs::space(out).available, bytes, out.string()),
          check_disk_speed(out, static_cast<double>(bytes))};
}

void add_cameras(const CamerasFile& cameras, const std::optional<fs::path>& calibration,
                 std::vector<Check>& checks) {
  const auto found = list_devices(camera_host_program());
  append(checks, check_devices(cameras, found));
  LiveOptions options;
  options.host_program = camera_host_program();
  options.patience_s = options.frames = 3;
  LiveResult live;
  std::vector<Check> seen;
  try {
    live = capture_live(cameras, options);
    StillOptions still;
    if (calibration && fs::exists(*calibration)) still.calibration = calibration;
    append(seen, check_receive_buffers(live.report));
    append(seen, check_capture(live, cameras, static_cast<std::size_t>(options.frames)));
    append(seen, check_still(look_still(live, cameras, still)));
  } catch (const Error& error) {
    seen.push_back({"a set of all cameras", false,
                    fmt::format("camera `{}`: {}", error.where().camera, error.what_failed()),
                    error.what_to_do()});
  }
  const auto reached = reached_cameras(cameras, found, live.report);
  for (const auto& more : {check_mtu(reached), check_link(reached, cameras.frame_rate_hz),
                           check_usb(cameras, found, live.report), seen})
    append(checks, more);
}

int tell(const std::vector<Check>& checks, const CommonOptions& common) {
  Json list = Json::array();
  Ending ending;
  for (const auto& c : checks) {
    ending.go = ending.go && c.go;
    ending.numbers.emplace_back(c.name, fmt::format("{:<5}  {}", c.go ? "GO" : "NO-GO", c.found));
    if (!c.go) ending.rejected.push_back(fmt::format("{}; to do: {}", c.name, c.to_type));
    list.push_back({{"check", c.name},
                    {"verdict", c.go ? "GO" : "NO-GO"},
                    {"found", c.found},
                    {"to_do", c.go ? Json() : Json(c.to_type)}});
  }
  ending.verdict = ending.go ? "the bench is fit to measure" : "the bench is not fit to measure";
  ending.next_command =
      ending.go ? "drape capture RIG --set NAME --out RECORDING" : "drape doctor RIG";
  if (!common.json) return finish(ending, common);
  fmt::print("{}", pretty({{"verdict", ending.go ? "GO" : "NO-GO"}, {"checks", list}}));
  return ending.go ? 0 : 1;
}

}  // namespace

int doctor_command(int argc, char** argv) {
  Command app(
      "Looks whether the bench is fit to measure: each check GO or NO-GO, and what to type.\n",
      "drape-capture doctor");
  CommonOptions common;
  add_common_options(app, common);
  fs::path rig, out = ".";
  std::optional<fs::path> calibration;
  app.add_option("RIG", rig, "folder with rig.toml and cameras.toml")->required();
  app.add_option("--out", out, "where recordings go, for disk space and speed");
  app.add_option("--calibration", calibration, "calibration.json in use");
  return run_program(app, argc, argv, common, [&] {
    const auto cameras = read_cameras_file(rig);
    auto checks = check_machine(cameras, out);
    append(checks, check_calibrated(rig, cameras, calibration, 30));
    add_cameras(cameras, calibration, checks);
    return tell(checks, common);
  });
}

}  // namespace drape::capture
