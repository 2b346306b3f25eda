// SPDX-License-Identifier: Apache-2.0
// A drape in space, as JSON: the measured sheet, the virtual one, the object, the distances.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "console/bench.hpp"
#include "core/units.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;
using units::mm;

Json rotation_json(const Eigen::Matrix3d& rotation) {
  Json list = Json::array();
  for (int row = 0; row < 3; ++row)
    for (int col = 0; col < 3; ++col) list.push_back(rotation(row, col));
  return list;
}

struct ObjectJson {
  Json operator()(const Sphere& s) const {
    return {{"is", "sphere"},
            {"centre_mm", point_mm(s.centre_in_world)},
            {"radius_mm", s.radius_m / mm}};
  }
  Json operator()(const Box& b) const {
    return {{"is", "box"},
            {"centre_mm", point_mm(b.world_from_box.translation_m)},
            {"rotation", rotation_json(b.world_from_box.rotation)},
            {"size_mm", point_mm(b.size_m)}};
  }
  Json operator()(const Cylinder& c) const {
    return {{"is", "cylinder"},
            {"centre_mm", point_mm(c.world_from_cylinder.translation_m)},
            {"rotation", rotation_json(c.world_from_cylinder.rotation)},
            {"radius_mm", c.radius_m / mm},
            {"height_mm", c.height_m / mm}};
  }
  Json operator()(const Plane&) const { return {{"is", "plane"}}; }
  Json operator()(const MeshObject&) const { return {{"is", "mesh"}}; }
};

/// Corners of the cells whose four marks are there, 12 numbers each.
Json quads_json(const Sheet& sheet) {
  Json quads = Json::array();
  const int step = std::max(1, std::max(sheet.rows, sheet.cols) / 40);
  for (int row = 0; row + step < sheet.rows; row += step) {
    for (int col = 0; col + step < sheet.cols; col += step) {
      const SheetMark *a = sheet.find({row, col}), *b = sheet.find({row + step, col}),
                      *c = sheet.find({row + step, col + step}), *d = sheet.find({row, col + step});
      if (!a || !b || !c || !d) continue;
      for (const SheetMark* corner : {a, b, c, d})
        for (const Json& number : point_mm(corner->point_in_world)) quads.push_back(number);
    }
  }
  return quads;
}

}  // namespace

/// Before there is a comparison: five segments or else the most.
fs::path Bench::best_simulation(const Drape& drape) const {
  if (against_sheet(run_chain(drape))) return {};
  std::vector<int> segments = rig_.segments;
  std::sort(segments.rbegin(), segments.rend());
  std::stable_partition(segments.begin(), segments.end(), [](int s) { return s == 5; });
  for (const int segment : segments) {
    fs::path file =
        out_ / drape.scene.name / simulation_folder(rig_.spacing_m, segment) / "sheet.json";
    if (!against_inputs(file)) return file;
  }
  return {};
}

/// The comparison that a row of the distances sums up; the same mesh may have several branches.
Json Bench::comparison_of(const Drape& drape, const Json& row) const {
  for (const Json& item : comparisons(drape, row.value("run", Json())))
    if (item.value("discretisation", "") == row.value("discretisation", "") &&
        item.value("segments", 0.0) == row.value("segments", 0.0) &&
        item.value("mean_dist_mm", 0.0) == row.value("mean_dist_mm", 0.0))
      return item;
  return {};
}

/// The sheet that a comparison is of, where the report still has it; branches lie elsewhere than
/// the rig's own simulations.
fs::path Bench::simulation_of(const Json& comparison) const {
  const Json of = results({"sql", fmt::format("SELECT simulated_sha256 AS sheet FROM comparison "
                                              "WHERE substr(sha256, 1, 12) = '{}'",
                                              comparison.value("comparison", ""))});
  const auto inputs = inputs_of(report());
  if (!inputs || !of.is_array() || of.size() != 1) return {};
  for (const auto& [file, sha256] : *inputs)
    if (file.filename() == "sheet.json" && sha256 == of[0].value("sheet", "") &&
        !against_input(file, sha256))
      return file;
  return {};
}

Json Bench::sheet(const std::string& name) const {
  const Drape& one = drape(name);
  Json json = {{"drape", name},         {"marks", Json::array()},   {"gaps", Json::array()},
               {"real", Json::array()}, {"virtual", Json::array()}, {"objects", Json::array()}};
  json["outlines"] = outlines(one);
  for (const Obstacle& object : measured_scene(one).obstacles)
    json["objects"].push_back(std::visit(ObjectJson{}, object));
  const auto measured = measured_sheet(one);
  if (!measured) return json;
  std::map<std::pair<int, int>, double> distances;
  const Json headline = results({"trend", "--by", "fabric"});
  const Json* row = of_scene(headline, name);
  const Json shown =
      row != nullptr && !against_result(one, *row) ? comparison_of(one, *row) : Json();
  const auto simulated =
      shown.is_null() ? sheet_in(best_simulation(one)) : whole_sheet(simulation_of(shown));
  if (simulated) json["virtual"] = quads_json(*simulated);
  if (!shown.is_null()) {
    json["comparison"] = shown;
    const Json tables = results({"show", shown.value("comparison", "")});
    if (tables.is_array() && tables.size() == 3)
      for (const Json& mark : tables[2]["rows"])
        distances[{mark.value("row", 0), mark.value("col", 0)}] = mark.value("distance_mm", 0.0);
  }
  for (const SheetMark& mark : measured->marks) {
    Json item = {{"row", mark.mark.row},
                 {"col", mark.mark.col},
                 {"at_mm", point_mm(mark.point_in_world)},
                 {"distance_mm", Json()},
                 {"sd_mm", Json()}};
    if (mark.covariance_m2) item["sd_mm"] = std::sqrt(mark.covariance_m2->trace()) / mm;
    const auto found = distances.find({mark.mark.row, mark.mark.col});
    if (found != distances.end()) item["distance_mm"] = found->second;
    json["marks"].push_back(std::move(item));
  }
  for (const Gap& gap : measured->gaps)
    json["gaps"].push_back({{"row", gap.mark.row}, {"col", gap.mark.col}, {"reason", gap.reason}});
  json["real"] = quads_json(*measured);
  return json;
}

}  // namespace drape::console
