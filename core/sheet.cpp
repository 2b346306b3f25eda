// SPDX-License-Identifier: Apache-2.0
#include "core/sheet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <sstream>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/files/lattice_size.hpp"
#include "core/files/mesh_file.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

using units::mm;

constexpr int kSheetVersion = 1;

std::filesystem::path with_extension(std::filesystem::path file, const char* extension) {
  return file.replace_extension(extension);
}

Json json_of(const SheetMark& mark) {
  return {{"row", mark.mark.row},
          {"col", mark.mark.col},
          {"material_mm", to_json_vector(mark.material_m / mm)},
          {"xyz_mm", to_json_vector(mark.point_in_world / mm)},
          {"cov_mm2", mark.covariance_m2 ? to_json(*mark.covariance_m2 / (mm * mm)) : Json()},
          {"views", mark.views ? Json(*mark.views) : Json()},
          {"reprojection_px", mark.reprojection_px ? Json(*mark.reprojection_px) : Json()}};
}

SheetMark read_mark(const JsonNode& node) {
  SheetMark mark{{node.integer("row"), node.integer("col")},
                 node.vector2("material_mm") * mm,
                 node.vector3("xyz_mm") * mm,
                 std::nullopt,
                 node.optional_integer("views"),
                 node.optional_number("reprojection_px")};
  if (node.has("cov_mm2")) mark.covariance_m2 = node.matrix3("cov_mm2") * (mm * mm);
  return mark;
}

Json json_of(const MeasuredSource& source) {
  return {{"rig", source.rig},
          {"set", source.set},
          {"cameras", source.cameras},
          {"calibration_sha256", source.calibration_sha256},
          {"detections_sha256", source.detections_sha256}};
}

Json json_of(const SimulatedSource& source) {
  Json json = {{"scene", source.scene},
               {"fabric", source.fabric},
               {"scene_sha256", source.scene_sha256},
               {"fabric_sha256", source.fabric_sha256},
               {"start_sha256", source.start_sha256 ? Json(*source.start_sha256) : Json()},
               {"segments", source.segments},
               {"model", source.model},
               {"solver", source.solver},
               {"status", source.status}};
  if (source.refined_from_sha256) json["refined_from_sha256"] = *source.refined_from_sha256;
  return json;
}

std::variant<MeasuredSource, SimulatedSource> read_source(const JsonNode& root) {
  const std::string kind = root.text("kind");
  const JsonNode node = root.at("source");
  if (kind == "measured") {
    return MeasuredSource{node.text("rig"), node.name("set"), node.texts("cameras"),
                          node.text("calibration_sha256"), node.text("detections_sha256")};
  }
  if (kind != "simulated")
    root.reject("kind", fmt::format("a sheet is measured or simulated, not `{}`", kind));
  return SimulatedSource{node.name("scene"),
                         node.text("fabric"),
                         node.text("scene_sha256"),
                         node.text("fabric_sha256"),
                         node.optional_text("start_sha256"),
                         node.integer("segments"),
                         node.text("model"),
                         node.text("solver"),
                         node.text("status"),
                         node.optional_text("refined_from_sha256")};
}

Json json_of(const ErrorBudget& budget) {
  return {{"detection", budget.detection_m / mm},
          {"calibration", budget.calibration_m ? Json(*budget.calibration_m / mm) : Json()},
          {"dot_shape", budget.dot_shape_m / mm},
          {"total", budget.total_m / mm}};
}

ErrorBudget read_budget(const JsonNode& node) {
  ErrorBudget budget;
  budget.detection_m = node.number("detection") * mm;
  if (node.has("calibration")) budget.calibration_m = node.number("calibration") * mm;
  budget.dot_shape_m = node.number("dot_shape") * mm;
  budget.total_m = node.number("total") * mm;
  return budget;
}

/// Quads of the lattice whose four corners exist, as indices into the marks.
std::vector<std::array<int, 4>> quads_of(const Sheet& sheet) {
  std::map<MarkId, int> index;
  for (std::size_t i = 0; i < sheet.marks.size(); ++i)
    index[sheet.marks[i].mark] = static_cast<int>(i);
  std::vector<std::array<int, 4>> quads;
  for (int row = 0; row + 1 < sheet.rows; ++row) {
    for (int col = 0; col + 1 < sheet.cols; ++col) {
      const auto a = index.find({row, col}), b = index.find({row + 1, col});
      const auto c = index.find({row + 1, col + 1}), d = index.find({row, col + 1});
      const auto end = index.end();
      if (a == end || b == end || c == end || d == end) continue;
      quads.push_back({a->second, b->second, c->second, d->second});
    }
  }
  return quads;
}

std::string ply_text(const Sheet& sheet) {
  const auto quads = quads_of(sheet);
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\ncomment drapebench sheet, {}; millimetres, world frame, z up\n"
      "element vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
      "property int row\nproperty int col\nelement face {}\nproperty list uchar int "
      "vertex_indices\n"
      "end_header\n",
      sheet.is_measured() ? "measured" : "simulated", sheet.marks.size(), quads.size());
  for (const SheetMark& mark : sheet.marks) {
    const Eigen::Vector3d p = mark.point_in_world / mm;
    text += fmt::format("{} {} {} {} {}\n", p.x(), p.y(), p.z(), mark.mark.row, mark.mark.col);
  }
  for (const auto& quad : quads)
    text += fmt::format("4 {} {} {} {}\n", quad[0], quad[1], quad[2], quad[3]);
  return text;
}

/// The vertices of the PLY must be the marks of the JSON, by their row and column where the file
/// has them, else in the same order; otherwise one of the two was swapped. Whoever wrote it may
/// have rounded: single precision keeps 0.06 um of a metre.
void check_ply(const std::filesystem::path& ply, const Sheet& sheet) {
  constexpr double kSame_m = 1e-6;
  const MeshFile mesh = read_mesh_file(ply, true);
  bool same = mesh.points.size() == sheet.marks.size();
  std::set<const SheetMark*> met;
  for (std::size_t i = 0; same && i < sheet.marks.size(); ++i) {
    const SheetMark* mark = &sheet.marks[i];
    if (!mesh.lattice.empty()) mark = sheet.find({mesh.lattice[i][0], mesh.lattice[i][1]});
    same = mark != nullptr && met.insert(mark).second &&
           (mesh.points[i] * mm - mark->point_in_world).norm() < kSame_m;
  }
  if (same) return;
  throw bad_input("the points of the sheet's .ply and .json differ", {.file = ply.string()},
                  "make the sheet again: both files belong together");
}

void check_marks(const JsonNode& root, const Sheet& sheet) {
  for (std::size_t i = 0; i < sheet.marks.size(); ++i) {
    const MarkId mark = sheet.marks[i].mark;
    const bool inside =
        mark.row >= 0 && mark.col >= 0 && mark.row < sheet.rows && mark.col < sheet.cols;
    if (inside && (i == 0 || sheet.marks[i - 1].mark < mark)) continue;
    root.reject(fmt::format("marks/{}", i),
                fmt::format("mark ({}, {}) is outside the sheet, twice there or out of order",
                            mark.row, mark.col));
  }
}

}  // namespace

const SheetMark* Sheet::find(MarkId wanted) const {
  const auto found =
      std::lower_bound(marks.begin(), marks.end(), wanted,
                       [](const SheetMark& mark, MarkId id) { return mark.mark < id; });
  return found != marks.end() && found->mark == wanted ? &*found : nullptr;
}

void write_sheet(const std::filesystem::path& file, const Sheet& sheet) {
  Json json;
  json["schema"] = fmt::format("drapebench/sheet/{}", kSheetVersion);
  json["kind"] = sheet.is_measured() ? "measured" : "simulated";
  json["rows"] = sheet.rows;
  json["cols"] = sheet.cols;
  json["patch_mm"] = to_json_vector(sheet.patch_m / mm);
  json["source"] = std::visit([](const auto& source) { return json_of(source); }, sheet.source);
  json["no_go"] = sheet.no_go ? Json(*sheet.no_go) : Json();
  if (sheet.error_budget) json["error_budget_mm"] = json_of(*sheet.error_budget);
  json["marks"] = Json::array();
  for (const SheetMark& mark : sheet.marks) json["marks"].push_back(json_of(mark));
  json["gaps"] = Json::array();
  for (const Gap& gap : sheet.gaps)
    json["gaps"].push_back({{"row", gap.mark.row}, {"col", gap.mark.col}, {"reason", gap.reason}});
  // The PLY holds what a reader of the JSON will compute, digit for digit.
  Sheet rounded = sheet;
  for (SheetMark& mark : rounded.marks) mark.point_in_world = (mark.point_in_world / mm) * mm;
  write_durable(with_extension(file, ".ply"), ply_text(rounded));
  write_json(with_extension(file, ".json"), json);
}

Sheet read_sheet(const std::filesystem::path& file) {
  const JsonNode root = JsonNode::open(with_extension(file, ".json"), "sheet", kSheetVersion);
  Sheet sheet;
  sheet.rows = root.integer("rows");
  sheet.cols = root.integer("cols");
  if (!is_lattice_size(sheet.rows, sheet.cols))
    root.reject("rows", fmt::format("a sheet has 1 to {} marks", kMostMarks));
  sheet.patch_m = root.vector2("patch_mm") * mm;
  sheet.source = read_source(root);
  sheet.no_go = root.optional_text("no_go");
  if (root.has("error_budget_mm")) sheet.error_budget = read_budget(root.at("error_budget_mm"));
  for (const JsonNode& node : root.items("marks")) sheet.marks.push_back(read_mark(node));
  for (const JsonNode& node : root.items("gaps"))
    sheet.gaps.push_back({{node.integer("row"), node.integer("col")}, node.text("reason")});
  check_marks(root, sheet);
  check_ply(with_extension(file, ".ply"), sheet);
  return sheet;
}

}  // namespace drape
