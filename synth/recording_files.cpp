// SPDX-License-Identifier: Apache-2.0
#include "synth/recording_files.hpp"

#include <fmt/format.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/inside.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"

namespace drape::synth {
namespace {

using units::deg;
using units::mm;

Json json_of(const std::optional<Eigen::Vector2d>& px) {
  return px ? to_json_vector(*px) : Json();
}

Json json_of(const TrueMark& mark, const std::vector<Camera>& cameras) {
  Json json;
  json["row"] = mark.mark.row;
  json["col"] = mark.mark.col;
  json["xyz_mm"] = to_json_vector(mark.point_in_world / mm);
  json["normal_in_world"] = to_json_vector(mark.normal_in_world);
  json["views"] = Json::array();
  for (std::size_t k = 0; k < mark.views.size(); ++k) {
    const TrueMarkView& view = mark.views[k];
    Json seen;
    seen["camera"] = cameras[k].name;
    seen["px"] = json_of(view.px);
    seen["centroid_px"] = json_of(view.centroid_px);
    seen["facing_deg"] = view.facing_rad / deg;
    seen["visible_share"] = view.visible_fraction;
    json["views"].push_back(seen);
  }
  return json;
}

}  // namespace

RecordedFrame write_picture(const std::filesystem::path& folder, const std::string& set,
                            const std::string& camera, const GreyPicture& picture) {
  const cv::Mat image(picture.height_px, picture.width_px, CV_8U,
                      const_cast<std::uint8_t*>(picture.bytes.data()));
  std::vector<unsigned char> png;
  if (!cv::imencode(".png", image, png))
    throw internal_error("the picture could not be encoded", {.camera = camera, .set = set});
  const std::string file = fmt::format("{}/{}.png", set, camera);
  write_inside(folder, file, {reinterpret_cast<const char*>(png.data()), png.size()},
               {.camera = camera, .set = set});
  return {camera, file, sha256_of(png), picture.width_px, picture.height_px, std::nullopt};
}

void write_truth(const std::filesystem::path& file, const Rig& rig,
                 const std::vector<Camera>& cameras, const std::vector<SetTruth>& sets) {
  Json json;
  json["schema"] = "drapebench/truth/1";
  json["rig"] = rig.name;
  json["sets"] = Json::array();
  for (const SetTruth& set : sets) {
    Json item;
    item["set"] = set.set;
    item["shows"] = set.shows;
    item["marks"] = Json::array();
    for (const TrueMark& mark : set.marks) item["marks"].push_back(json_of(mark, cameras));
    json["sets"].push_back(item);
  }
  write_json(file, json);
}

void write_true_calibration(const std::filesystem::path& file, const Rig& rig,
                            const std::vector<Camera>& cameras) {
  Calibration calibration;
  calibration.method = "joint";
  calibration.rig = rig.name;
  for (const Camera& camera : cameras) {
    CalibratedCamera exact;
    exact.camera = camera;
    exact.valid_region_px = {0, 0, camera.model.width_px - 1.0, camera.model.height_px - 1.0};
    const Eigen::Vector3d at(10 * mm, 20 * mm, 0);
    const auto image = project(camera.model, camera.cam_from_world * at);
    if (!image) {
      throw bad_input("the camera does not look at the world's origin", {.camera = camera.name},
                      "correct its position and look_at_mm");
    }
    exact.worked_point = {at, image->px};
    calibration.cameras.push_back(exact);
  }
  calibration.warnings.emplace_back("these are the cameras of a synthetic recording, not measured");
  write_calibration(file, calibration);
}

}  // namespace drape::synth
