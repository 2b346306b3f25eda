// SPDX-License-Identifier: Apache-2.0
#include "core/rig.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "core/geometry/vectors.hpp"
#include "core/scene.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

using units::mm;
using units::um;

/// Reads a list of distinct whole numbers, each at least `least`.
void whole_numbers(Fields& f, const Field& field, std::vector<int>& values) {
  f.if_any(field, values);
  if (!f.reads()) return;
  f.limit(std::set<int>(values.begin(), values.end()).size() == values.size(), field.name,
          fmt::format("`{}` holds a number twice", field.name), "give each number once");
}

void lattice(Fields& f, int& rows, int& cols, std::string_view along_rows,
             std::string_view along_cols) {
  f({"rows", along_rows, 1, 1}, rows);
  f({"cols", along_cols, 1, 1}, cols);
  if (f.reads())
    f.rule(is_lattice_size(rows, cols), "rows", fmt::format("more than {} marks", kMostMarks),
           "count rows and columns again");
}

constexpr std::string_view kDotsTouch = "the dots touch each other";
constexpr std::string_view kSmaller = "the diameter must be smaller than pitch_mm; both are in mm";

/// Surface on which the tags are printed; decides which keys the table `tags` has.
enum class Carrier { dots, board, grid, print };

struct TagTable {
  Carrier carrier = Carrier::dots;
  std::string family;
  double edge_m = 0;
  std::vector<PrintedTag> tags;
  int first_id = 0;
  int border_modules = 2;
  std::vector<std::array<int, 2>> cells = {};
};

void fields(Fields& f, TagTable& table) {
  const Carrier carrier = table.carrier;
  f({"family", "AprilTag family, e.g. tag36h11"}, table.family);
  f({"edge_mm", "outer edge of the black square", mm, above_zero}, table.edge_m);
  if (carrier == Carrier::dots) f.if_any({"tag", "tags"}, table.tags);
  if (carrier == Carrier::print) {
    f({"first_id", "id of the first tag"}, table.first_id);
    f({"cells", "[row, col] of each tag, from 0"}, table.cells);
  }
  if (carrier == Carrier::board || carrier == Carrier::grid ||
      (f.documents() && carrier != Carrier::print))
    f.otherwise({"first_id", "id of the first tag of a board"}, table.first_id);
  if (carrier == Carrier::grid || (f.documents() && carrier != Carrier::print))
    f.otherwise(
        {"border_modules", "width of the black border around a tag's bits, in modules", 1, 1},
        table.border_modules);
}

/// Describes the table `tags`, which is required (`must`), optional (`may`) or forbidden.
void tag_table(Fields& f, TagTable& table, bool must, bool may) {
  const Field field{"tags", "tags of the target"};
  if (must)
    f(field, table);
  else if (f.documents() || (may && (f.reads() || !table.family.empty())))
    f.otherwise(field, table);
}

/// Places the tags of a board. The tags of an AprilGrid are numbered from its lower left (Kalibr),
/// those of a ChArUco board from its upper left (OpenCV; before 4.6 a board with an even number of
/// rows of squares had a light square there).
void place_board_tags(Target& target, int id, bool is_light) {
  const bool grid = target.kind == TargetKind::aprilgrid;
  const int rows = target.rows + (grid ? 0 : 1), cols = target.cols + (grid ? 0 : 1);
  const int light = !grid && is_light ? 0 : 1;
  target.tags.clear();
  for (int k = 0; k < rows; ++k) {
    for (int col = 0; col < cols; ++col) {
      if (!grid && (k + col) % 2 != light) continue;
      const int row = grid ? k : rows - 1 - k;
      const Eigen::Vector2d steps(col - 0.5 * (cols - 1), row - 0.5 * (rows - 1));
      target.tags.push_back({id++, target.pitch_m * steps});
    }
  }
  if (!grid) return;
  target.rows *= 2;
  target.cols *= 2;
}

}  // namespace

void fields(Fields& f, PrintedTag& tag) {
  f({"id", "id of the tag within its family"}, tag.id);
  f({"centre_mm", "centre, x and y on the target", mm}, tag.centre_m);
}

void fields(Fields& f, RigCamera& camera) {
  f(Field{"name", "name of the camera"}.plain_name(), camera.name);
  f({"width_px", "columns of its pictures", 1, 1}, camera.width_px);
  f({"height_px", "rows of its pictures", 1, 1}, camera.height_px);
  Eigen::Vector2d pitch_m(camera.pixel_pitch_x_m, camera.pixel_pitch_y_m);
  // Sensor pixels range from 0.5 um (phones) to 24 um (astronomy), twice that if binned.
  f({"pixel_pitch_um", "pixel pitch of the sensor along x and y", um, 0.5, 48,
     "give the pixel pitch of the data sheet in um, 0.5 to 48, e.g. [3.45, 3.45]"},
    pitch_m);
  camera.pixel_pitch_x_m = pitch_m.x();
  camera.pixel_pitch_y_m = pitch_m.y();
  f.if_any({"square_pixels_percent",
            "standard uncertainty of the pixels' aspect ratio; absent if not known", 0.01,
            above_zero, 10, "give the data sheet's tolerance, e.g. 0.01"},
           camera.square_pixels);
}

void fields(Fields& f, TargetStage& stage) {
  f(Field{"set", "frame set that shows the target"}.plain_name(), stage.set);
  f({"z_mm", "height of the target above its reference pose", mm, -10'000, 10'000,
     "no bench is so large; heights are in mm above the first stage"},
    stage.z_m);
}

void fields(Fields& f, DrapeRepeat& repeat) {
  f(Field{"scene", "name of the repeated scene"}.plain_name(), repeat.scene);
  f(Field{"set", "frame set that shows it"}.plain_name(), repeat.set);
  if (f.reads()) repeat.repeat = repeat.set;
  f.otherwise(Field{"repeat", "name of this laying; default: the name of the set"}.plain_name(),
              repeat.repeat);
  f.otherwise({"face", "side of the cloth that faces up"}, repeat.face);
}

namespace {

/// The table `calibration` of a rig.
struct CalibrationPlan {
  Rig* rig;
};

void fields(Fields& f, CalibrationPlan& plan) {
  f.otherwise({"estimate_scale_x", "true if Tsai's s_x is estimated"}, plan.rig->estimate_scale_x);
  f.if_any(Field{"free_poses", "frame sets with the target in any pose"}.plain_name(),
           plan.rig->free_poses);
  f.if_any({"stage", "frame sets with the target raised by z"}, plan.rig->stages);
}

}  // namespace

void fields(Fields& f, Rig& rig) {
  rig.file = rig.document.file();
  f(Field{"name", "name of the bench"}.plain_name(), rig.name);
  f({"target", "target file"}, rig.target_file);
  f({"recording", "folder of the recording"}, rig.recording);
  f.if_any({"scenes", "scene files, in the order of the report"}, rig.scenes);
  const bool has_scenes = !rig.scenes.empty();
  if (has_scenes || f.documents()) {
    f.otherwise({"spacing_mm", "spacing of the virtual cloth's finest mesh", mm, 0.5, 50,
                 "give e.g. spacing_mm = 2.5"},
                rig.spacing_m);
    whole_numbers(f, {"grids", "particles per side of the paper's model (--paper)", 1, 3},
                  rig.grids);
    if (f.reads() && rig.grids.empty()) rig.grids = Rig{}.grids;
    whole_numbers(f, {"segments", "line segments per Kawabata curve", 1, 1}, rig.segments);
    f.limit(!rig.segments.empty(), "segments", "`segments` is missing",
            "add e.g. `segments = [5]`");
    for (std::size_t i = 0; i < rig.grids.size() && f.reads(); ++i)
      f.limit(is_lattice_size(rig.grids[i], rig.grids[i]), "grids",
              fmt::format("{0} x {0} are more than {1} particles", rig.grids[i], kMostMarks),
              "give the particles along a side, e.g. grids = [21, 31]");
  }
  if (has_scenes)
    f({"print", "print file"}, rig.print_file);
  else if (f.reads() || f.documents() || !rig.print_file.empty())
    f.otherwise({"print", "print file"}, rig.print_file);
  f.if_any({"camera", "each camera"}, rig.cameras);
  f.limit(!rig.cameras.empty(), "camera", "the rig has no camera",
          "add a [[camera]] table per camera");
  std::set<std::string> names;
  for (std::size_t i = 0; i < rig.cameras.size() && f.reads(); ++i)
    f.rule(names.insert(rig.cameras[i].name).second, fmt::format("camera.{}.name", i),
           fmt::format("two cameras are called `{}`", rig.cameras[i].name),
           "give each camera its own name");
  CalibrationPlan plan{&rig};
  f({"calibration", "frame sets for the calibration"}, plan);
  f.if_any({"repeat", "repeated drapes"}, rig.repeats);
  f.if_any(
      {"tolerance_mm",
       "largest mean distance of a simulated drape that matches; used if no drape was repeated", mm,
       above_zero},
      rig.tolerance_m);
}

Eigen::Vector3d Target::point_in_target(MarkId dot) const {
  const auto place = static_cast<std::size_t>(dot.row) * static_cast<std::size_t>(cols) +
                     static_cast<std::size_t>(dot.col);
  if (measured && dot.row >= 0 && dot.col >= 0 && place < measured->points_m.size())
    return measured->points_m[place];
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

std::filesystem::path simulation_folder(double spacing_m, int segments) {
  return std::filesystem::path("simulations") / fmt::format("{:g}mm-{}", spacing_m / mm, segments);
}

Rig read_rig(const std::filesystem::path& path) {
  return read_record<Rig>(std::filesystem::is_directory(path) ? path / "rig.toml" : path);
}

void fields(Fields& f, KnownLength& known) {
  std::array<int, 2> from = {known.from.row, known.from.col}, to = {known.to.row, known.to.col};
  f({"from", "one end, [row, col] from 0", 1, 0}, from);
  f({"to", "other end, [row, col] from 0", 1, 0}, to);
  known.from = {from[0], from[1]};
  known.to = {to[0], to[1]};
  f({"length_mm", "distance measured on the plate", mm, above_zero}, known.length_m);
  f({"uncertainty_mm", "standard uncertainty of length_mm", mm, above_zero},
    known.standard_uncertainty_m);
  f.rule(known.from != known.to, "to", "a point has no distance from itself",
         "name the far corner");
}

void fields(Fields& f, MeasuredPlate& plate) {
  f({"points_mm", "x, y, z of each point, by row, then column", mm}, plate.points_m);
  f({"sd_mm", "standard uncertainty of each point", mm, above_zero}, plate.sd_m);
  f({"common_covariance",
     "covariance of errors common to all points: bow along x and y (mm), stretch of x relative to "
     "y, shear, scale"},
    plate.common_covariance);
  if (!f.reads()) return;
  f.rule(is_covariance(plate.common_covariance), "common_covariance",
         "it is no covariance: not symmetric, or negative", make_again);
}

namespace {

constexpr std::string_view kNoPoint = "this is no point of the target";
constexpr std::string_view kFromZero = "give [row, col], counted from 0";
constexpr double kUsualHole = 1.0 / 3;  ///< fraction of the dot's diameter

/// Describes the keys of a plate that has dots only.
void plate_of_dots(Fields& f, Target& target) {
  f.otherwise({"arrangement", "square, or staggered: dots only where row + col is even"},
              target.arrangement);
  f.otherwise({"dot_colour", "black, or white on a black plate"}, target.dot_colour);
  std::vector<std::array<int, 2>> hollow;
  for (const MarkId mark : target.hollow) hollow.push_back({mark.row, mark.col});
  f.if_any({"hollow", "[row, col] of each dot with a hole, from 0", 1, 0}, hollow);
  if (!hollow.empty() || f.documents())
    f.otherwise({"hollow_diameter_mm", "diameter of the holes; default: a third of a dot's", mm,
                 above_zero},
                target.hollow_diameter_m);
  if (!f.reads()) return;
  target.hollow.clear();
  for (const auto& [row, col] : hollow) {
    target.hollow.push_back({row, col});
    f.rule(target.has(target.hollow.back()), "hollow", kNoPoint, kFromZero);
  }
  if (hollow.empty()) return;
  f.rule(hollow.size() >= 3, "hollow", "fewer than three hollow dots do not place a plate",
         "give at least three, e.g. that at the origin, one along x, one along y");
  if (target.hollow_diameter_m == 0) target.hollow_diameter_m = kUsualHole * target.dot_diameter_m;
  f.rule(target.hollow_diameter_m < target.dot_diameter_m, "hollow_diameter_mm",
         "the hole is as large as the dot", "it must be smaller than dot_diameter_mm");
}

}  // namespace

void fields(Fields& f, Target& target) {
  f({"kind", "kind of its points"}, target.kind);
  lattice(f, target.rows, target.cols, "rows of points, along y", "points of a row, along x");
  f({"pitch_mm", "distance between adjacent points, or the side of a square", mm, above_zero},
    target.pitch_m);
  const bool dots = target.kind == TargetKind::dot_grid;
  const bool board = target.kind >= TargetKind::charuco;
  f.when(dots, {"dot_diameter_mm", "diameter of a dot", mm, above_zero}, target.dot_diameter_m);
  f.rule(!dots || target.dot_diameter_m < target.pitch_m, "dot_diameter_mm", kDotsTouch, kSmaller);
  f.rule(target.kind != TargetKind::chessboard || std::min(target.rows, target.cols) >= 3, "rows",
         "the chessboard has fewer than 3 x 3 inner corners",
         "count the corners where four squares meet, not the squares");
  if (dots || f.documents()) plate_of_dots(f, target);
  std::string square = "dark";
  if (target.kind == TargetKind::charuco || f.documents())
    f.otherwise({"upper_left_square", "dark, or light as on OpenCV's boards before 4.6"}, square);
  TagTable table{dots                                   ? Carrier::dots
                 : target.kind == TargetKind::aprilgrid ? Carrier::grid
                                                        : Carrier::board,
                 target.tag_family, target.tag_edge_m, target.tags};
  tag_table(f, table, board, dots);
  f.rule(!board || table.edge_m < target.pitch_m, "tags.edge_mm", "the tags touch each other",
         "it must be smaller than the pitch");
  target.tag_family = table.family;
  target.tag_edge_m = table.edge_m;
  target.tags = table.tags;
  f.rule(target.tags.empty() || (target.dot_colour == DotColour::black &&
                                 target.arrangement == DotArrangement::square),
         "tags", "tags stand between black dots in a square grid only",
         "leave out `tags`, or mark the plate by `hollow` dots");
  const Field lengths{"known_length", "distances measured on the plate"};
  const Value* given = f.reads() ? target.document.root().find(lengths.name) : nullptr;
  if (given && given->get_if<Value::Table>())
    f(lengths, target.known_lengths.emplace_back());
  else
    f.if_any(lengths, target.known_lengths);
  f.if_any({"print_error_mm",
            "standard uncertainty of a point's position on the print; default: 1 % of the pitch",
            mm, above_zero},
           target.print_error_m);
  f.if_any({"measured", "positions of the points, measured from views of the plate"},
           target.measured);
  if (!f.reads()) return;
  if (board && is_lattice_size(target.rows, target.cols)) {
    if (target.kind == TargetKind::aprilgrid) target.tag_border = table.border_modules;
    place_board_tags(target, table.first_id, square == "light");
  }
  const auto points = static_cast<std::size_t>(target.rows) * static_cast<std::size_t>(target.cols);
  f.rule(!target.measured ||
             (target.measured->points_m.size() == points && target.measured->sd_m.size() == points),
         "measured.points_mm", "not one measured place for each point", make_again);
  for (std::size_t i = 0; i < target.known_lengths.size(); ++i) {
    const std::string at = given->get_if<Value::Table>() ? "" : fmt::format(".{}", i);
    for (const auto& [end, mark] : {std::pair{"from", target.known_lengths[i].from},
                                    std::pair{"to", target.known_lengths[i].to}})
      f.rule(target.has(mark), fmt::format("known_length{}.{}", at, end), kNoPoint, kFromZero);
  }
}

Target read_target(const std::filesystem::path& file) {
  auto target = read_record<Target>(file);
  throw_if_any(faults_of(target));
  return target;
}

void fields(Fields& f, DotClasses& classes) {
  f({"light_centre_diameter_mm", "diameter of the light centre", mm, above_zero},
    classes.light_centre_diameter_m);
  f({"rows", "one string per row, one character per dot: # full, o light centre"}, classes.rows);
}

void fields(Fields& f, Print& print) {
  print.file = print.document.file();
  lattice(f, print.rows, print.cols, "marks along the warp", "marks along the weft");
  f({"pitch_mm", "distance between adjacent marks", mm, above_zero}, print.pitch_m);
  f({"dot_diameter_mm", "diameter of a dot", mm, above_zero}, print.dot_diameter_m);
  f({"patch_mm", "size of the cloth along (warp, weft)", mm}, print.patch_m);
  f({"margin_mm", "material coordinates of mark (0, 0)", mm}, print.margin_m);
  f.rule(print.dot_diameter_m < print.pitch_m, "dot_diameter_mm", kDotsTouch, kSmaller);
  const Eigen::Vector2d last = print.material_m({print.rows - 1, print.cols - 1});
  f.rule(
      (print.margin_m.array() >= 0).all() && (last.array() <= print.patch_m.array() + 1e-9).all(),
      "patch_mm", "the marks reach beyond the patch",
      "margin + (rows - 1) * pitch must not exceed the patch, along warp and weft");
  TagTable table{Carrier::print, print.tag_family, print.tag_edge_m, {}};
  if (!print.tags.empty()) table.first_id = print.tags.front().id;
  for (const PrintedTag& tag : print.tags) {
    const Eigen::Vector2d cell = (tag.centre_m - print.margin_m) / print.pitch_m;
    table.cells.push_back({static_cast<int>(cell.x()), static_cast<int>(cell.y())});
  }
  tag_table(f, table, false, true);
  f.if_any({"dot_classes", "two kinds of dots, by which they are labelled"}, print.dot_classes);
  if (!f.reads()) return;
  print.tag_family = table.family;
  print.tag_edge_m = table.edge_m;
  for (std::size_t i = 0; i < table.cells.size(); ++i) {
    const auto [row, col] = table.cells[i];
    f.rule(row >= 0 && col >= 0 && row < print.rows - 1 && col < print.cols - 1,
           fmt::format("tags.cells.{}", i),
           fmt::format("cell [{}, {}] is outside the grid", row, col),
           "cells count from 0 to rows - 2 and cols - 2");
    print.tags.push_back({table.first_id + static_cast<int>(i),
                          print.margin_m + print.pitch_m * Eigen::Vector2d(row + 0.5, col + 0.5)});
  }
  if (!print.dot_classes) return;
  f.rule(print.dot_classes->light_centre_diameter_m < print.dot_diameter_m,
         "dot_classes.light_centre_diameter_mm", "the light centre is as large as the dot",
         "give less than dot_diameter_mm");
  const auto& rows = print.dot_classes->rows;
  f.rule(rows.size() == static_cast<std::size_t>(print.rows) &&
             std::all_of(rows.begin(), rows.end(),
                         [&](const std::string& row) {
                           return row.size() == static_cast<std::size_t>(print.cols) &&
                                  row.find_first_not_of("#o") == std::string::npos;
                         }),
         "dot_classes.rows", "the signs do not fit the grid",
         "give one text a row with one sign a dot: # full, o light centre");
}

Print read_print(const std::filesystem::path& file) {
  auto print = read_record<Print>(file);
  throw_if_any(faults_of(print));
  return print;
}

}  // namespace drape
