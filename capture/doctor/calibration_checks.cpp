// SPDX-License-Identifier: Apache-2.0
// Is the calibration in use fit for these cameras, and was it accepted?
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "capture/doctor/checks.hpp"
#include "core/calibration.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/dates.hpp"
#include "core/program/run_record.hpp"

namespace drape::capture {
namespace {

/// Days since the calibration was computed, by the record beside it, if that is of this file: a
/// copy has the time of the copying.
std::optional<double> days_since(const std::filesystem::path& calibration) {
  const std::filesystem::path record = run_record_path(calibration);
  if (!std::filesystem::is_regular_file(record)) return std::nullopt;
  const JsonNode root = JsonNode::open(record, "run", 1);
  const std::vector<JsonNode> outputs = root.items("outputs");
  const std::string sha256 = sha256_of_file(calibration);
  if (std::none_of(outputs.begin(), outputs.end(),
                   [&](const JsonNode& one) { return one.text("sha256") == sha256; }))
    return std::nullopt;
  const auto ended = utc_time_in(root.text("ended_utc"));
  if (!ended) return std::nullopt;
  return std::chrono::duration<double>(std::chrono::system_clock::now() - *ended).count() / 86400;
}

/// Cameras that the rig has and the calibration lacks, or knows with another size.
std::string strangers(const Calibration& calibration, const CamerasFile& rig) {
  std::string names;
  for (const LiveCamera& camera : rig.cameras) {
    const auto found =
        std::find_if(calibration.cameras.begin(), calibration.cameras.end(),
                     [&](const CalibratedCamera& one) { return one.camera.name == camera.name; });
    const bool known = found != calibration.cameras.end() &&
                       found->camera.model.width_px == camera.settings.width_px &&
                       found->camera.model.height_px == camera.settings.height_px;
    if (!known) names += (names.empty() ? "" : ", ") + camera.name;
  }
  return names;
}

}  // namespace

Check check_calibration(const std::optional<std::filesystem::path>& calibration,
                        const CamerasFile& rig, double largest_days) {
  if (!calibration)
    return {"calibration", true, "none is given: record the target, then drape calib", ""};
  if (!std::filesystem::exists(*calibration))
    return {"calibration", false, "there is none at " + calibration->string(),
            "correct --calibration, or leave it out"};
  const std::string again = "record the target once more, then drape calib";
  const Calibration found = read_calibration(*calibration);
  if (found.no_go) return {"calibration", false, "it is NO-GO: " + *found.no_go, again};
  if (const std::string names = strangers(found, rig); !names.empty())
    return {"calibration", false,
            "it is of other cameras than the rig's: it lacks, or has in another size, " + names,
            "give the calibration of this rig, or " + again};
  const auto days = days_since(*calibration);
  if (!days)
    return {"calibration", true,
            fmt::format("warning, its age is unknown: {} is not there, or of another file",
                        run_record_path(*calibration).string()),
            ""};
  return {"calibration", *days <= largest_days,
          fmt::format("{:.1f} days old, at most {:.0f}", *days, largest_days), again};
}

Check check_acceptance(const std::filesystem::path& rig,
                       const std::optional<std::filesystem::path>& calibration,
                       const std::string& today) {
  const std::filesystem::path folder = std::filesystem::is_directory(rig) ? rig : rig.parent_path();
  const std::filesystem::path file = folder / "acceptance.json";
  Check check{"acceptance", true, "none is beside rig.toml: drape calib accept makes it", ""};
  if (!std::filesystem::exists(file)) return check;
  const JsonNode root = JsonNode::open(file, "acceptance", 1);
  const auto until = root.optional_text("valid_until");
  check.found = "of " + root.optional_text("date").value_or("no stated day");
  if (until) check.found += ", valid until " + *until;
  check.to_type = "record the target in new places, then drape calib accept";
  if (calibration && std::filesystem::exists(*calibration) &&
      sha256_of_file(*calibration) != root.text("calibration_sha256")) {
    check.found += ": warning, of another calibration than the one in use; " + check.to_type;
  } else if (!root.boolean("go")) {
    check.go = false;
    check.found += ": NO-GO, " + root.optional_text("cause").value_or(
                                     "a figure is beyond its limit or was not measured");
  } else if (until && *until < today) {
    check.found += ": warning, expired; " + check.to_type;
  }
  return check;
}

std::vector<Check> check_calibrated(const std::filesystem::path& rig, const CamerasFile& cameras,
                                    const std::optional<std::filesystem::path>& calibration,
                                    double largest_days) {
  return {check_calibration(calibration, cameras, largest_days),
          check_acceptance(rig, calibration, today())};
}

}  // namespace drape::capture
