// SPDX-License-Identifier: Apache-2.0
#include "core/rig.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "core/error.hpp"
#include "core/files/lattice_size.hpp"
#include "core/files/toml_file.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

using units::mm;
using units::um;

Eigen::Vector2d vector2_m(const TomlTable& table, const std::string& key) {
  const std::vector<double> values = table.numbers(key, 2);
  return Eigen::Vector2d(values[0], values[1]) * mm;
}

RigCamera read_camera(const TomlTable& table) {
  RigCamera camera;
  camera.name = table.name("name");
  camera.width_px = table.positive_integer("width_px");
  camera.height_px = table.positive_integer("height_px");
  const std::vector<double> pitch = table.numbers("pixel_pitch_um", 2);
  if (pitch[0] <= 0 || pitch[1] <= 0)
    table.reject("pixel_pitch_um", "the pixel pitch is not positive",
                 "give the pitch of the sensor along x and y");
  camera.pixel_pitch_x_m = pitch[0] * um;
  camera.pixel_pitch_y_m = pitch[1] * um;
  return camera;
}

void read_cameras(const TomlTable& root, Rig& rig) {
  std::set<std::string> names;
  for (const TomlTable& table : root.tables("camera")) {
    rig.cameras.push_back(read_camera(table));
    if (!names.insert(rig.cameras.back().name).second)
      table.reject("name", fmt::format("two cameras are called `{}`", rig.cameras.back().name),
                   "give each camera its own name");
  }
  if (rig.cameras.empty())
    root.reject("camera", "the rig has no camera", "add a [[camera]] table per camera");
}

void read_calibration_plan(const TomlTable& root, Rig& rig) {
  const TomlTable plan = root.table("calibration");
  rig.estimate_scale_x = plan.boolean_or("estimate_scale_x", false);
  if (plan.has("free_poses")) rig.free_poses = plan.names("free_poses");
  for (const TomlTable& stage : plan.tables("stage"))
    rig.stages.push_back({stage.name("set"), stage.number("z_mm") * mm});
}

std::vector<int> positive_list(const TomlTable& root, const std::string& key, int least) {
  std::vector<int> values = root.integers(key);
  if (values.empty() || *std::min_element(values.begin(), values.end()) < least)
    root.reject(key, fmt::format("`{}` is empty or holds a number below {}", key, least),
                fmt::format("give whole numbers from {} on", least));
  if (std::set<int>(values.begin(), values.end()).size() != values.size())
    root.reject(key, fmt::format("`{}` holds a number twice", key), "give each number once");
  return values;
}

void check_size(const TomlTable& root, int rows, int cols) {
  if (is_lattice_size(rows, cols)) return;
  root.reject("rows", fmt::format("more than {} marks", kMostMarks),
              "count rows and columns again");
}

/// A rig that is only calibrated has no scenes, and then no grids.
void read_drapes(const TomlTable& root, Rig& rig) {
  for (const std::string& scene : root.texts("scenes")) rig.scenes.push_back(root.beside(scene));
  rig.grids = positive_list(root, "grids", 3);
  rig.segments = positive_list(root, "segments", 1);
  for (const int side : rig.grids)
    if (!is_lattice_size(side, side))
      root.reject("grids",
                  fmt::format("{} x {} are more than {} particles", side, side, kMostMarks),
                  "give the particles along a side, e.g. grids = [21, 31]");
}

std::vector<PrintedTag> read_print_tags(const TomlTable& tags, const Print& print) {
  std::vector<PrintedTag> result;
  int id = tags.integer("first_id");
  for (const std::vector<int>& cell : tags.integer_rows("cells", 2)) {
    if (cell[0] < 0 || cell[1] < 0 || cell[0] >= print.rows - 1 || cell[1] >= print.cols - 1)
      tags.reject("cells", fmt::format("cell [{}, {}] is outside the grid", cell[0], cell[1]),
                  "cells count from 0 to rows - 2 and cols - 2");
    const Eigen::Vector2d middle(cell[0] + 0.5, cell[1] + 0.5);
    result.push_back({id++, print.margin_m + print.pitch_m * middle});
  }
  return result;
}

DotClasses read_dot_classes(const TomlTable& table, const Print& print) {
  DotClasses classes;
  classes.light_centre_diameter_m = table.positive("light_centre_diameter_mm") * mm;
  if (classes.light_centre_diameter_m >= print.dot_diameter_m)
    table.reject("light_centre_diameter_mm", "the light centre is as large as the dot",
                 "give less than dot_diameter_mm");
  classes.rows = table.texts("rows");
  const auto fits = [&](const std::string& row) {
    return row.size() == static_cast<std::size_t>(print.cols) &&
           row.find_first_not_of("#o") == std::string::npos;
  };
  if (classes.rows.size() != static_cast<std::size_t>(print.rows) ||
      !std::all_of(classes.rows.begin(), classes.rows.end(), fits)) {
    table.reject("rows", "the signs do not fit the grid",
                 "give one text a row with one sign a dot: # full, o light centre");
  }
  return classes;
}

}  // namespace

Eigen::Vector3d Target::point_in_target(MarkId dot) const {
  if (kind == TargetKind::aprilgrid) {
    const auto along = [&](int index, int count) {
      return (int{index / 2} - 0.25 * (count - 2)) * pitch_m + (index % 2 - 0.5) * tag_edge_m;
    };
    return {along(dot.col, cols), along(dot.row, rows), 0};
  }
  return {(dot.col - 0.5 * (cols - 1)) * pitch_m, (dot.row - 0.5 * (rows - 1)) * pitch_m, 0};
}

Eigen::Vector2d Print::material_m(MarkId mark) const {
  return margin_m + pitch_m * Eigen::Vector2d(mark.row, mark.col);
}

const RigCamera& Rig::camera(const std::string& camera_name) const {
  for (const RigCamera& candidate : cameras)
    if (candidate.name == camera_name) return candidate;
  throw bad_input(
      "the rig has no such camera", {.file = file.string(), .camera = camera_name},
      "add a [[camera]] table of that name, or name the image after a camera of the rig");
}

Rig read_rig(const std::filesystem::path& path) {
  Rig rig;
  rig.file = std::filesystem::is_directory(path) ? path / "rig.toml" : path;
  const TomlTable root = TomlTable::open(rig.file, "rig");
  rig.name = root.name("name");
  rig.target_file = root.file_path("target");
  rig.recording = root.file_path("recording");
  if (root.has("scenes")) read_drapes(root, rig);
  if (root.has("scenes") || root.has("print")) rig.print_file = root.file_path("print");
  read_cameras(root, rig);
  read_calibration_plan(root, rig);
  // The front door's own (front/repeats.hpp).
  for (const TomlTable& table : root.tables("repeat"))
    for (const char* key : {"scene", "set", "repeat", "face"})
      static_cast<void>(table.text_or(key, ""));
  root.finish();
  return rig;
}

namespace {

void read_dots(const TomlTable& root, Target& target) {
  target.dot_diameter_m = root.positive("dot_diameter_mm") * mm;
  if (target.dot_diameter_m >= target.pitch_m)
    root.reject("dot_diameter_mm", "the dots touch each other",
                "the diameter must be smaller than pitch_mm; both are in mm");
  const auto tags = root.optional_table("tags");
  if (!tags) return;
  target.tag_family = tags->text("family");
  target.tag_edge_m = tags->positive("edge_mm") * mm;
  for (const TomlTable& tag : tags->tables("tag"))
    target.tags.push_back({tag.integer("id"), vector2_m(tag, "centre_mm")});
}

/// An AprilGrid's tags count from its lower left (Kalibr), those of a ChArUco board from its upper
/// left (OpenCV, whose boards before 4.6 have a light square there when they have an even number of
/// rows of squares).
void read_board_tags(const TomlTable& root, Target& target) {
  const TomlTable tags = root.table("tags");
  target.tag_family = tags.text("family");
  target.tag_edge_m = tags.positive("edge_mm") * mm;
  if (target.tag_edge_m >= target.pitch_m)
    tags.reject("edge_mm", "the tags touch each other", "it must be smaller than the pitch");
  int id = tags.has("first_id") ? tags.integer("first_id") : 0;
  const bool grid = target.kind == TargetKind::aprilgrid;
  const int rows = target.rows + (grid ? 0 : 1), cols = target.cols + (grid ? 0 : 1);
  const int light = !grid && root.text_or("upper_left_square", "dark") == "light" ? 0 : 1;
  for (int k = 0; k < rows; ++k) {
    for (int col = 0; col < cols; ++col) {
      if (!grid && (k + col) % 2 != light) continue;
      const int row = grid ? k : rows - 1 - k;
      const Eigen::Vector2d steps(col - 0.5 * (cols - 1), row - 0.5 * (rows - 1));
      target.tags.push_back({id++, target.pitch_m * steps});
    }
  }
  if (!grid) return;
  target.tag_border = tags.has("border_modules") ? tags.positive_integer("border_modules") : 2;
  target.rows *= 2;
  target.cols *= 2;
}

TargetKind kind_of(const TomlTable& root) {
  static const std::map<std::string, TargetKind> kinds = {{"dot-grid", TargetKind::dot_grid},
                                                          {"chessboard", TargetKind::chessboard},
                                                          {"charuco", TargetKind::charuco},
                                                          {"aprilgrid", TargetKind::aprilgrid}};
  const auto kind = kinds.find(root.text("kind"));
  if (kind != kinds.end()) return kind->second;
  root.reject("kind", fmt::format("targets of kind `{}` are not known", root.text("kind")),
              "use `dot-grid`, `chessboard`, `charuco` or `aprilgrid`");
}

MarkId mark_of(const TomlTable& table, const std::string& key, const Target& target) {
  const std::vector<int> mark = table.integers(key);
  if (mark.size() != 2 || mark[0] < 0 || mark[1] < 0 || mark[0] >= target.rows ||
      mark[1] >= target.cols) {
    table.reject(key, "this is no point of the target", "give [row, col], counted from 0");
  }
  return {mark[0], mark[1]};
}

KnownLength read_known_length(const TomlTable& table, const Target& target) {
  const KnownLength known{mark_of(table, "from", target), mark_of(table, "to", target),
                          table.positive("length_mm") * mm, table.positive("uncertainty_mm") * mm};
  if (known.from == known.to)
    table.reject("to", "a point has no distance from itself", "name the far corner");
  return known;
}

}  // namespace

Target read_target(const std::filesystem::path& file) {
  const TomlTable root = TomlTable::open(file, "target");
  Target target;
  target.kind = kind_of(root);
  target.rows = root.positive_integer("rows");
  target.cols = root.positive_integer("cols");
  check_size(root, target.rows, target.cols);
  target.pitch_m = root.positive("pitch_mm") * mm;
  if (target.kind == TargetKind::dot_grid) read_dots(root, target);
  if (target.kind >= TargetKind::charuco) read_board_tags(root, target);
  if (target.kind == TargetKind::chessboard && std::min(target.rows, target.cols) < 4) {
    root.reject("rows", "the chessboard has fewer than 4 x 4 inner corners",
                "count the corners where four squares meet, not the squares");
  }
  if (const auto table = root.optional_table("known_length"))
    target.known_length = read_known_length(*table, target);
  root.finish();
  return target;
}

Print read_print(const std::filesystem::path& file) {
  const TomlTable root = TomlTable::open(file, "print");
  Print print;
  print.file = file;
  print.rows = root.positive_integer("rows");
  print.cols = root.positive_integer("cols");
  check_size(root, print.rows, print.cols);
  print.pitch_m = root.positive("pitch_mm") * mm;
  print.dot_diameter_m = root.positive("dot_diameter_mm") * mm;
  print.patch_m = vector2_m(root, "patch_mm");
  print.margin_m = vector2_m(root, "margin_mm");
  if (print.dot_diameter_m >= print.pitch_m)
    root.reject("dot_diameter_mm", "the dots touch each other",
                "the diameter must be smaller than pitch_mm; both are in mm");
  const Eigen::Vector2d last = print.material_m({print.rows - 1, print.cols - 1});
  if ((print.margin_m.array() < 0).any() || (last.array() > print.patch_m.array() + 1e-9).any()) {
    root.reject("patch_mm", "the marks reach beyond the patch",
                "margin + (rows - 1) * pitch must not exceed the patch, along warp and weft");
  }
  if (const auto tags = root.optional_table("tags")) {
    print.tag_family = tags->text("family");
    print.tag_edge_m = tags->positive("edge_mm") * mm;
    print.tags = read_print_tags(*tags, print);
  }
  if (const auto classes = root.optional_table("dot_classes"))
    print.dot_classes = read_dot_classes(*classes, print);
  root.finish();
  return print;
}

}  // namespace drape
