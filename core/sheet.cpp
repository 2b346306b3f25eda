// SPDX-License-Identifier: Apache-2.0
#include "core/sheet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "core/drape_mesh.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

using units::mm;

std::filesystem::path with_extension(std::filesystem::path file, const char* extension) {
  return file.replace_extension(extension);
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

/// Checks that the vertices of the PLY are the marks of the JSON, by row and column if the file has
/// them, else in order; otherwise one of the two files was swapped. Other programs may have rounded
/// to single precision, 0.06 um in a metre.
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

}  // namespace

const SheetMark* Sheet::find(MarkId wanted) const {
  const auto found =
      std::lower_bound(marks.begin(), marks.end(), wanted,
                       [](const SheetMark& mark, MarkId id) { return mark.mark < id; });
  return found != marks.end() && found->mark == wanted ? &*found : nullptr;
}

std::string Sheet::discretisation() const {
  const auto& own = std::get<SimulatedSource>(source);
  return own.spacing_m ? fmt::format("{:g} mm", *own.spacing_m / mm)
                       : fmt::format("{}x{}", rows, cols);
}

void fields(Fields& f, SheetMark& mark) {
  f({"row", "along the warp"}, mark.mark.row);
  f({"col", "along the weft"}, mark.mark.col);
  f({"material_mm", "(warp, weft) from the corner of the patch", mm}, mark.material_m);
  f({"xyz_mm", "position in the world", mm}, mark.point_in_world);
  f.if_any({"cov_mm2", "covariance of xyz_mm; absent if simulated", mm * mm}, mark.covariance_m2);
  f.if_any({"views", "cameras that saw the mark"}, mark.views);
  f.if_any({"reprojection_px", "RMS over those views"}, mark.reprojection_px);
}

void fields(Fields& f, Gap& gap) {
  f({"row", "along the warp"}, gap.mark.row);
  f({"col", "along the weft"}, gap.mark.col);
  f({"reason", "reason why it has no position"}, gap.reason);
}

void fields(Fields& f, ErrorBudget& budget) {
  f({"detection", "contribution of the noise of the marks' centres", mm}, budget.detection_m);
  f({"calibration", "contribution of the cameras; null if their file gives none", mm},
    budget.calibration_m);
  f.if_any({"target", "part of calibration due to the error of the calibration target", mm},
           budget.target_m);
  f({"dot_shape", "remainder after correcting bent and slanted dots", mm}, budget.dot_shape_m);
  f({"total", "root sum of squares", mm}, budget.total_m);
}

void fields(Fields& f, AskedScene& scene) {
  f(Field{"name", "name of the scene"}.plain_name(), scene.name);
  f({"sha256", "SHA-256 of its file"}, scene.sha256);
  f({"surroundings",
     "table_z_mm and each value of its objects as text (object.1.x_mm), a mesh as the SHA-256 of "
     "its file"},
    scene.surroundings);
}

void fields(Fields& f, RepeatId& repeat) {
  f(Field{"scene", "name of the scene"}.plain_name(), repeat.scene);
  f(Field{"repeat", "name of this laying"}.plain_name(), repeat.name);
  f({"face", "side of the cloth that faces up; empty if not stated"}, repeat.face);
}

void fields(Fields& f, MeasuredSource& source) {
  f({"rig", "name of the bench"}, source.rig);
  f(Field{"set", "frame set"}.plain_name(), source.set);
  f({"cameras", "names of its cameras, or the other instrument"}, source.cameras);
  f({"calibration_sha256",
     "SHA-256 of calibration.json; of points of another instrument that of their fit"},
    source.calibration_sha256);
  f({"detections_sha256", "SHA-256 of detections.json, or of the points of another instrument"},
    source.detections_sha256);
  f.if_any({"asked_scene", "scene with which the marks were measured; absent if none"},
           source.asked_scene);
  f.if_any({"repeat", "drape and laying that it shows, if the rig states them"}, source.repeat);
}

void fields(Fields& f, SimulatedSource& source) {
  f(Field{"scene", "name of the scene"}.plain_name(), source.scene);
  f({"fabric", "name of the fabric"}, source.fabric);
  f({"scene_sha256", "SHA-256 of scene.toml"}, source.scene_sha256);
  f({"fabric_sha256", "SHA-256 of the fabric file and its curves together"}, source.fabric_sha256);
  f({"start_sha256", "SHA-256 of the measured sheet used to position the cloth"},
    source.start_sha256);
  f({"segments", "line segments per curve"}, source.segments);
  f({"model",
     "triangles or paper (consistent in older files), followed by `, internal friction` and `, "
     "whole curves` if used"},
    source.model);
  f.if_any({"spacing_mm",
            "spacing of the finest mesh, whose surface the marks sample; absent if the marks are "
            "the particles of a grid",
            mm, above_zero},
           source.spacing_m);
  f.otherwise(
      {"from_measured", "true if started from the measured shape instead of the scene's start"},
      source.from_measured);
  f.if_any({"solver", "fall, static or rk4; only in older files"}, source.solver);
  f({"status", "\"at rest\", or the reason why not"}, source.status);
}

enum class SheetKind { measured, simulated };
template <>
inline constexpr std::string_view names_of<SheetKind>[] = {"measured", "simulated"};

void fields(Fields& f, Sheet& sheet) {
  auto kind = static_cast<SheetKind>(sheet.source.index());
  f({"kind", "source of the points"}, kind);
  f({"rows", "marks along the warp"}, sheet.rows);
  f({"cols", "marks along the weft"}, sheet.cols);
  f.rule(is_lattice_size(sheet.rows, sheet.cols), "rows",
         fmt::format("a sheet has 1 to {} marks", kMostMarks), make_again);
  f({"patch_mm", "size along (warp, weft)", mm}, sheet.patch_m);
  f.one_of({"source", "files from which it was made"}, sheet.source,
           static_cast<std::size_t>(kind));
  f({"no_go", "first reason why it cannot be used as a measurement; null if none"}, sheet.no_go);
  f.if_any({"error_budget_mm", "RMS over the marks of the standard deviation of a mark's position"},
           sheet.error_budget);
  f({"marks", "points, sorted by row, then column"}, sheet.marks);
  f({"gaps", "marks without a position"}, sheet.gaps);
  for (std::size_t i = 0; i < sheet.marks.size() && f.reads(); ++i) {
    const MarkId mark = sheet.marks[i].mark;
    const bool inside =
        mark.row >= 0 && mark.col >= 0 && mark.row < sheet.rows && mark.col < sheet.cols;
    if (inside && (i == 0 || sheet.marks[i - 1].mark < mark)) continue;
    f.rule(false, fmt::format("marks.{}", i),
           fmt::format("mark ({}, {}) is outside the sheet, twice there or out of order", mark.row,
                       mark.col),
           make_again);
  }
}

void write_sheet(const std::filesystem::path& file, const Sheet& sheet) {
  // The PLY must hold exactly the values that a reader of the JSON computes.
  Sheet rounded = sheet;
  for (SheetMark& mark : rounded.marks) mark.point_in_world = (mark.point_in_world / mm) * mm;
  write_durable(with_extension(file, ".ply"), ply_text(rounded));
  write_record(with_extension(file, ".json"), sheet);
}

Sheet read_sheet_record(const std::filesystem::path& file) {
  return read_record<Sheet>(with_extension(file, ".json"));
}

Sheet read_sheet(const std::filesystem::path& file) {
  Sheet sheet = read_sheet_record(file);
  check_ply(with_extension(file, ".ply"), sheet);
  return sheet;
}

}  // namespace drape
