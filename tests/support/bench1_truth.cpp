// SPDX-License-Identifier: Apache-2.0
#include "tests/support/bench1_truth.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/files/files.hpp"
#include "core/units.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

using Value = nlohmann::json;
using units::mm;

Eigen::Vector2d vector2(const Value& v) {
  return {v[0].get<double>(), v[1].get<double>()};
}

Eigen::Vector3d vector3(const Value& v) {
  return {v[0].get<double>(), v[1].get<double>(), v[2].get<double>()};
}

template <class To, class From>
Pose<To, From> pose(const Value& v) {
  Pose<To, From> result;
  for (int row = 0; row < 3; ++row) result.rotation.row(row) = vector3(v.at("R")[row]);
  result.translation_m = vector3(v.at("t")) * mm;
  return result;
}

Camera camera(const Value& v) {
  BrownLens lens;
  lens.fx_px = v.at("fx");
  lens.fy_px = v.at("fy");
  lens.cx_px = v.at("cx");
  lens.cy_px = v.at("cy");
  lens.k1 = v.at("k1");
  lens.k2 = v.at("k2");
  return {v.at("name"), {lens, 1600, 1200}, pose<frame::Camera, frame::World>(v)};
}

std::vector<std::vector<Eigen::Vector2d>> pixels(const Value& v) {
  std::vector<std::vector<Eigen::Vector2d>> result;
  for (const Value& cam : v) {
    result.emplace_back();
    for (const Value& px : cam) result.back().push_back(vector2(px));
  }
  return result;
}

TrueDot dot(const Value& v) {
  TrueDot result{
      {v.at("row"), v.at("col")}, vector3(v.at("xyz")) * mm, vector3(v.at("normal")), {}};
  for (const Value& view : v.at("cam")) {
    result.views.push_back({vector2(view.at("px")), vector2(view.at("px_centroid")),
                            view.at("cos_view"), view.at("visible"), view.at("visible_fraction")});
  }
  return result;
}

Bench1Truth load() {
  const Value root = Value::parse(read_text(source_root() / "tests/data/bench1/truth.json"));
  Bench1Truth truth;
  for (const Value& v : root.at("cameras")) truth.cameras.push_back(camera(v));
  for (const Value& v : root.at("calib")) {
    truth.poses.push_back({v.at("frame"), pose<frame::World, frame::Target>(v), pixels(v.at("px")),
                           pixels(v.at("px_centroid"))});
  }
  for (const auto& [name, drape] : root.at("drapes").items()) {
    for (const Value& v : drape.at("dots")) truth.drapes[name].push_back(dot(v));
  }
  return truth;
}

}  // namespace

int TrueDot::facing_views(double degrees) const {
  int count = 0;
  for (const TrueView& view : views) {
    count += view.visible && view.visible_fraction > 0.99 &&
             view.cos_view >= std::cos(degrees * units::deg);
  }
  return count;
}

const Bench1Truth& bench1_truth() {
  static const Bench1Truth truth = load();
  return truth;
}

}  // namespace drape::test
