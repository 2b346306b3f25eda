// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/positions.hpp"

#include <fmt/format.h>

#include <map>
#include <utility>
#include <vector>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/run_record.hpp"

namespace drape::calib {
namespace {

namespace fs = std::filesystem;

/// A camera and the places of its dots: equal to the last digit in one picture only, however it was
/// copied or encoded.
using Picture = std::pair<std::string, std::vector<double>>;

std::map<Picture, std::string> sets_by_picture(const Detections& detections,
                                               std::map<Picture, std::string> known = {}) {
  for (const FrameDetections& frame : detections.frames) {
    if (frame.detections.empty()) continue;
    Picture picture{frame.camera, {}};
    for (const Detection& d : frame.detections)
      picture.second.insert(picture.second.end(), {d.centre_px.x(), d.centre_px.y()});
    const auto [other, fresh] = known.emplace(std::move(picture), frame.set);
    if (fresh) continue;
    throw bad_input(fmt::format("this picture is also the one of set {}", other->second),
                    {.camera = frame.camera, .set = frame.set},
                    "record each set by itself, and other sets than those that calibrated");
  }
  return known;
}

bool has_schema(const fs::path& file, const std::string& schema) {
  const Json json = try_json(read_text(file));
  return json.is_object() && json.contains("schema") && json["schema"] == schema;
}

}  // namespace

void refuse_pictures_twice(const Detections& detections) {
  static_cast<void>(sets_by_picture(detections));
}

void refuse_pictures_of(const Detections& calibrated, const Detections& detections) {
  static_cast<void>(sets_by_picture(detections, sets_by_picture(calibrated)));
}

std::optional<Detections> detections_behind(const fs::path& calibration) {
  const fs::path file = run_record_path(calibration);
  if (!fs::is_regular_file(file)) return std::nullopt;
  const JsonNode record = JsonNode::open(file, "run", 1);
  const auto unchanged = [&](const JsonNode& item) {
    const fs::path named = file.parent_path() / item.text("file");
    return fs::is_regular_file(named) && sha256_of_file(named) == item.text("sha256");
  };
  for (const JsonNode& output : record.items("outputs"))
    if (!unchanged(output)) return std::nullopt;
  for (const JsonNode& input : record.items("inputs")) {
    const fs::path named = file.parent_path() / input.text("file");
    if (unchanged(input) && has_schema(named, "drapebench/detections/1"))
      return read_detections(named);
  }
  return std::nullopt;
}

}  // namespace drape::calib
