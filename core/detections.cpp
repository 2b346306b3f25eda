// SPDX-License-Identifier: Apache-2.0
#include "core/detections.hpp"

#include <fmt/format.h>

#include <set>

#include "core/error.hpp"
#include "core/files/json_file.hpp"
#include "core/files/lattice_size.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

using units::deg;
using units::mm;

constexpr int kDetectionsVersion = 1;

template <class T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

Json json_of(const Detection& d) {
  return {{"row", d.mark.row},
          {"col", d.mark.col},
          {"px", to_json_vector(d.centre_px)},
          {"cov_px2", to_json(d.covariance_px2)},
          {"semi_axes_px", to_json_vector(d.semi_axes_px)},
          {"axis_angle_deg", d.axis_angle_rad / deg},
          {"contrast", d.contrast},
          {"chi2_per_dof", d.chi2_per_dof}};
}

Detection read_detection(const JsonNode& node) {
  return {{node.integer("row"), node.integer("col")},
          node.vector2("px"),
          node.matrix2("cov_px2"),
          node.vector2("semi_axes_px"),
          node.number("axis_angle_deg") * deg,
          node.number("contrast"),
          node.number("chi2_per_dof")};
}

Json json_of(const IslandDot& d) {
  Json json = json_of(d.dot);
  json["island"] = d.island;
  return json;
}

Json json_of(const Rejection& r) {
  return {{"row", r.mark ? Json(r.mark->row) : Json()},
          {"col", r.mark ? Json(r.mark->col) : Json()},
          {"px", r.centre_px ? to_json_vector(*r.centre_px) : Json()},
          {"reason", r.reason}};
}

Rejection read_rejection(const JsonNode& node) {
  Rejection rejection;
  if (node.has("row")) rejection.mark = MarkId{node.integer("row"), node.integer("col")};
  if (node.has("px")) rejection.centre_px = node.vector2("px");
  rejection.reason = node.text("reason");
  return rejection;
}

Json json_of(const TagDetection& tag) {
  return {{"id", tag.id}, {"corners_px", to_json(tag.corners_px.transpose())}};
}

TagDetection read_tag(const JsonNode& node) {
  const Eigen::MatrixXd corners = node.matrix("corners_px");
  if (corners.rows() != 4 || corners.cols() != 2)
    node.reject("corners_px", "a tag has four corners (u, v)");
  return {node.integer("id"), corners.transpose()};
}

Json json_of(const MarkLattice& lattice) {
  return {{"surface", lattice.surface == Surface::cloth ? "cloth" : "target"},
          {"rows", lattice.rows},
          {"cols", lattice.cols},
          {"pitch_mm", lattice.pitch_m / mm},
          {"dot_diameter_mm", lattice.dot_diameter_m / mm},
          {"patch_mm", to_json_vector(lattice.patch_m / mm)},
          {"margin_mm", to_json_vector(lattice.margin_m / mm)},
          {"sha256", lattice.sha256}};
}

MarkLattice read_lattice(const JsonNode& node) {
  const std::string surface = node.text("surface");
  if (surface != "cloth" && surface != "target")
    node.reject("surface", "the surface is neither cloth nor target");
  const int rows = node.integer("rows"), cols = node.integer("cols");
  if (!is_lattice_size(rows, cols))
    node.reject("rows", fmt::format("a lattice has 1 to {} marks", kMostMarks));
  return {surface == "cloth" ? Surface::cloth : Surface::target,
          rows,
          cols,
          node.number("pitch_mm") * mm,
          node.number("dot_diameter_mm") * mm,
          node.vector2("patch_mm") * mm,
          node.vector2("margin_mm") * mm,
          node.text("sha256")};
}

Json json_of(const FrameDetections& frame) {
  Json json;
  json["set"] = frame.set;
  json["camera"] = frame.camera;
  json["width_px"] = frame.width_px;
  json["height_px"] = frame.height_px;
  json["image_sha256"] = frame.image_sha256;
  json["preview_file"] = or_null(frame.preview_file);
  json["preview_scale"] = or_null(frame.preview_scale);
  json["noise_sigma_grey"] = or_null(frame.noise_sigma);
  json["detections"] = Json::array();
  for (const Detection& d : frame.detections) json["detections"].push_back(json_of(d));
  for (const IslandDot& d : frame.islands) json["islands"].push_back(json_of(d));
  json["rejections"] = Json::array();
  for (const Rejection& r : frame.rejections) json["rejections"].push_back(json_of(r));
  json["tags"] = Json::array();
  for (const TagDetection& t : frame.tags) json["tags"].push_back(json_of(t));
  return json;
}

FrameDetections read_frame_detections(const JsonNode& node, const MarkLattice& lattice) {
  FrameDetections frame;
  frame.set = node.name("set");
  frame.camera = node.name("camera");
  frame.width_px = node.integer("width_px");
  frame.height_px = node.integer("height_px");
  frame.image_sha256 = node.text("image_sha256");
  frame.preview_file = node.optional_text("preview_file");
  frame.preview_scale = node.optional_number("preview_scale");
  frame.noise_sigma = node.optional_number("noise_sigma_grey");
  for (const JsonNode& item : node.items("detections")) {
    frame.detections.push_back(read_detection(item));
    const MarkId mark = frame.detections.back().mark;
    if (mark.row < 0 || mark.col < 0 || mark.row >= lattice.rows || mark.col >= lattice.cols)
      item.reject("row", fmt::format("mark ({}, {}) is outside the lattice", mark.row, mark.col));
  }
  if (node.has("islands")) {
    for (const JsonNode& item : node.items("islands"))
      frame.islands.push_back({item.integer("island"), read_detection(item)});
  }
  for (const JsonNode& item : node.items("rejections"))
    frame.rejections.push_back(read_rejection(item));
  for (const JsonNode& item : node.items("tags")) frame.tags.push_back(read_tag(item));
  return frame;
}

}  // namespace

std::optional<std::string> Detections::reason_against(const std::vector<std::string>& sets) const {
  for (const std::string& set : sets) {
    if (const auto found = no_go.find(set); found != no_go.end())
      return fmt::format("the detection of set {} is NO-GO: {}", set, found->second);
  }
  return std::nullopt;
}

Detections read_detections(const std::filesystem::path& file) {
  const JsonNode root = JsonNode::open(file, "detections", kDetectionsVersion);
  Detections detections{root.text("rig"), read_lattice(root.at("lattice")), {}};
  std::set<std::string> sets;
  for (const JsonNode& node : root.items("frames")) {
    detections.frames.push_back(read_frame_detections(node, detections.lattice));
    sets.insert(detections.frames.back().set);
  }
  if (!root.has("no_go")) return detections;
  for (const JsonNode& node : root.items("no_go")) {
    const std::string set = node.name("set");
    if (!sets.contains(set)) node.reject("set", fmt::format("no frame is of the set `{}`", set));
    detections.no_go.emplace(set, node.text("reason"));
  }
  return detections;
}

void write_detections(const std::filesystem::path& file, const Detections& detections) {
  Json json;
  json["schema"] = fmt::format("drapebench/detections/{}", kDetectionsVersion);
  json["rig"] = detections.rig;
  json["lattice"] = json_of(detections.lattice);
  json["frames"] = Json::array();
  for (const FrameDetections& frame : detections.frames) json["frames"].push_back(json_of(frame));
  for (const auto& [set, reason] : detections.no_go)
    json["no_go"].push_back({{"set", set}, {"reason", reason}});
  write_json(file, json);
}

}  // namespace drape
