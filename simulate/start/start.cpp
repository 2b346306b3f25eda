// SPDX-License-Identifier: Apache-2.0
#include "simulate/start/start.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/units.hpp"
#include "simulate/start/clamps.hpp"
#include "simulate/start/local_frame.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr double kTopDepth = 4e-3;   // m; weight 1/e this far below the highest mark
constexpr double kTopLimit = 12e-3;  // m; marks further below do not place the sheet
constexpr double kTopFar = 25e-3;    // m; highest mark this far below the object: not on top
constexpr double kHuber = 1e-3;      // m; larger misfits lose weight
constexpr int kReweights = 10;
// Share of a cloth's length: suitings extend by about as much under 100 gf/cm (FAST's E100; De Boos
// and Tester 1994), and lying on an object they bear far less.
constexpr double kExtended = 0.05;
constexpr double kMarkWeight = 100;  // weight of a mark against a second difference, both in m
constexpr double kLeastSide_m = 1e-4, kLargestSide_m = 100;  // sides of a patch: a yarn, a hall

/// Weighted rigid 2D fit world = centre + R(yaw) local.
struct PlanarFit {
  Vector2d centre;
  double yaw = 0;
};

PlanarFit fit_plane(const std::vector<Vector2d>& local, const std::vector<Vector2d>& world,
                    const std::vector<double>& weight) {
  double total = 0;
  Vector2d mean_local = Vector2d::Zero();
  Vector2d mean_world = Vector2d::Zero();
  for (std::size_t i = 0; i < local.size(); ++i) {
    total += weight[i];
    mean_local += weight[i] * local[i];
    mean_world += weight[i] * world[i];
  }
  mean_local /= total;
  mean_world /= total;
  double dot = 0;
  double cross = 0;
  for (std::size_t i = 0; i < local.size(); ++i) {
    const Vector2d a = local[i] - mean_local;
    const Vector2d b = world[i] - mean_world;
    dot += weight[i] * a.dot(b);
    cross += weight[i] * (a.x() * b.y() - a.y() * b.x());
  }
  PlanarFit fit;
  fit.yaw = std::atan2(cross, dot);
  const Eigen::Rotation2Dd turn(fit.yaw);
  fit.centre = mean_world - turn * mean_local;
  return fit;
}

/// In the flat sheet's own axes: x along the weft, y against the warp, origin at its centre.
Vector2d local_of(const Vector2d& material_m, const Vector2d& patch_m) {
  return {material_m.y() - 0.5 * patch_m.y(), 0.5 * patch_m.x() - material_m.x()};
}

const Sheet& need(const std::optional<Sheet>& measured, const Scene& scene, const char* field,
                  const std::string& why) {
  if (measured) return *measured;
  throw bad_input(why, {.file = scene.file.string(), .field = field},
                  "give the measured sheet with --start-from");
}

/// Wavy, deterministic, without the symmetries of a square: lets a symmetric start choose a fold.
double imperfection(int row, int col) {
  return std::sin(1.3 * row + 0.7 * col + 0.4) + 0.5 * std::sin(0.9 * col - 2.1 * row + 1.1);
}

std::string name_of(const Pin& pin) {
  return pin.at_material_m ? fmt::format("material point ({:g}, {:g}) mm",
                                         pin.at_material_m->x() / mm, pin.at_material_m->y() / mm)
                           : fmt::format("mark ({}, {})", pin.mark.row, pin.mark.col);
}

/// Between the marks around a material point, bilinear; nothing when one that counts is a gap.
std::optional<Vector3d> measured_point(const Sheet& sheet, const Print& print, const Vector2d& at) {
  const Vector2d place = (at - print.margin_m) / print.pitch_m;
  const int row = std::clamp(static_cast<int>(std::floor(place.x() + 1e-9)), 0, print.rows - 2);
  const int col = std::clamp(static_cast<int>(std::floor(place.y() + 1e-9)), 0, print.cols - 2);
  Vector3d sum = Vector3d::Zero();
  for (const int i : {0, 1}) {
    for (const int k : {0, 1}) {
      const double weight = (i == 1 ? place.x() - row : 1 - (place.x() - row)) *
                            (k == 1 ? place.y() - col : 1 - (place.y() - col));
      if (std::abs(weight) < 1e-9) continue;
      const SheetMark* mark = sheet.find({row + i, col + k});
      if (mark == nullptr) return std::nullopt;
      sum += weight * mark->point_in_world;
    }
  }
  return sum;
}

void add_holds(const Scene& scene, const Print& print, const GridSpec& grid,
               const std::optional<Sheet>& measured, StartState& start) {
  for (const Pin& pin : scene.pins) {
    const Vector2d at = pin.material_m(print);
    if ((at.array() < 0).any() || (at.array() > print.patch_m.array() + 1e-9).any() ||
        (!pin.at_material_m && (pin.mark.row < 0 || pin.mark.col < 0 ||
                                pin.mark.row >= print.rows || pin.mark.col >= print.cols))) {
      throw bad_input(fmt::format("the pin holds {}, which the print does not have", name_of(pin)),
                      {.file = scene.file.string(), .field = "pin"},
                      fmt::format("rows 0 to {}, cols 0 to {}", print.rows - 1, print.cols - 1));
    }
    const auto place =
        pin.point_in_world
            ? pin.point_in_world
            : measured_point(need(measured, scene, "pin.at_mm", "a pin has no point in space"),
                             print, at);
    if (!place) {
      throw bad_input(
          fmt::format("the pin holds {}, which was not measured", name_of(pin)),
          {.file = scene.file.string(), .field = "pin"},
          "give its position as at_mm, or pin a point whose marks around it were measured");
    }
    start.hold_in_world.push_back(*place);
    start.holds.push_back(hold_at(grid, at));
  }
  for (const ClampedParticle& held : clamps_on(scene, grid).held) {
    start.hold_in_world.push_back(held.place_in_world);
    start.holds.push_back(
        {{held.particle, held.particle, held.particle, held.particle}, {1, 0, 0, 0}});
  }
}

}  // namespace

Vector3d FlatPose::point_in_world(const Vector2d& material_m, const Vector2d& patch_m) const {
  const Vector2d p = Eigen::Rotation2Dd(yaw_rad) * local_of(material_m, patch_m);
  return centre_in_world + Vector3d(p.x(), p.y(), 0);
}

Vector2d material_of(const GridSpec& grid, int row, int col) {
  return {row * grid.warp_spacing_m(), col * grid.weft_spacing_m()};
}

Hold hold_at(const GridSpec& grid, const Vector2d& material_m) {
  const double u = material_m.x() / grid.warp_spacing_m();
  const double v = material_m.y() / grid.weft_spacing_m();
  const int row = std::clamp(static_cast<int>(std::floor(u)), 0, grid.rows - 2);
  const int col = std::clamp(static_cast<int>(std::floor(v)), 0, grid.cols - 2);
  const double a = u - row;
  const double b = v - col;
  const int i = grid.index(row, col);
  return {{i, i + 1, i + grid.cols, i + grid.cols + 1},
          {(1 - a) * (1 - b), (1 - a) * b, a * (1 - b), a * b}};
}

namespace {

/// The marks that place a sheet, in its flat axes and in the world.
struct TopMarks {
  std::vector<Vector2d> local, world;
  std::vector<double> depth_m, weight;  ///< below the highest mark; 1 there
};

TopMarks top_marks_of(const Sheet& measured, double top_z_m) {
  if (measured.marks.empty()) {
    throw bad_input("no mark was measured, so nothing places the cloth", {.field = "start.mode"},
                    "see why in the sheet's gaps, or use start mode `flat` with a centre and yaw");
  }
  double highest = -1e9;
  for (const SheetMark& mark : measured.marks) {
    highest = std::max(highest, mark.point_in_world.z());
  }
  TopMarks top;
  for (const SheetMark& mark : measured.marks) {
    const double depth = highest - mark.point_in_world.z();
    if (depth > kTopLimit) continue;
    top.local.push_back(local_of(mark.material_m, measured.patch_m));
    top.world.emplace_back(mark.point_in_world.head<2>());
    top.depth_m.push_back(depth);
    top.weight.push_back(std::exp(-(depth / kTopDepth) * (depth / kTopDepth)));
  }
  if (top.local.size() < 2 || highest < top_z_m - kTopFar) {
    throw bad_input(
        fmt::format("only {} measured marks lie on top of the objects (highest mark {:.1f} mm, "
                    "highest object {:.1f} mm)",
                    top.local.size(), highest / mm, top_z_m / mm),
        {.field = "start.mode"}, "use start mode `flat` with a centre and yaw, or `measured`");
  }
  return top;
}

/// Root of the weighted mean square of what `length_m(i)` gives for each of the marks.
template <class Length>
double rms_m(const TopMarks& top, const Length& length_m) {
  double sum = 0, total = 0;
  for (std::size_t i = 0; i < top.weight.size(); ++i) {
    sum += top.weight[i] * length_m(i) * length_m(i);
    total += top.weight[i];
  }
  return std::sqrt(sum / total);
}

/// Distances of the marks from the flat sheet where the least squares place it; `local` in its own
/// axes.
double misfit_m(const TopMarks& top, const std::vector<Vector2d>& local) {
  const PlanarFit fit = fit_plane(local, top.world, top.weight);
  const Eigen::Rotation2Dd turn(fit.yaw);
  return rms_m(top,
               [&](std::size_t i) { return (fit.centre + turn * local[i] - top.world[i]).norm(); });
}

/// A thread that has come down by d from the highest mark has lost no more than d of its horizontal
/// length (1 - cos <= sin, down to the vertical), so no drape misses the flat sheet by more than it
/// has come down and is extended. What misses it by more is another cloth, or one seen from behind.
void require_laid(const Scene& scene, const TopMarks& top) {
  Vector2d middle = Vector2d::Zero();
  double total = 0;
  for (std::size_t i = 0; i < top.local.size(); ++i) {
    middle += top.weight[i] * top.local[i];
    total += top.weight[i];
  }
  middle /= total;
  const double fallen_m = rms_m(top, [&](std::size_t i) { return top.depth_m[i]; });
  const double most_m = fallen_m + kExtended * rms_m(top, [&](std::size_t i) {
                                     return (top.local[i] - middle).norm();
                                   });
  const double found_m = misfit_m(top, top.local);
  if (found_m <= most_m) return;
  std::vector<Vector2d> mirrored = top.local;
  for (Vector2d& place : mirrored) place.x() = -place.x();
  const double mirrored_m = misfit_m(top, mirrored);
  throw bad_input(
      fmt::format("the {} measured marks on top of the objects miss the flat cloth by {:.3g} mm "
                  "(rms); one that has come down by {:.3g} mm there misses it by {:.3g} mm at most",
                  top.local.size(), found_m / mm, fallen_m / mm, most_m / mm),
      {.file = scene.file.string(), .field = "start.mode"},
      mirrored_m <= most_m
          ? fmt::format("its mirror image misses it by {:.3g} mm: are warp and weft exchanged, or "
                        "one of them counted from the other end?",
                        mirrored_m / mm)
          : "are the marks of this cloth and print, and its unit right?");
}

}  // namespace

FlatPose fit_flat(const Sheet& measured, double top_z_m, StartReport& report) {
  const auto [local, world, depth_m, top_weight] = top_marks_of(measured, top_z_m);
  std::vector<double> weight = top_weight;
  PlanarFit fit;
  for (int round = 0; round < kReweights; ++round) {
    fit = fit_plane(local, world, weight);
    const Eigen::Rotation2Dd turn(fit.yaw);
    double sum = 0;
    double total = 0;
    for (std::size_t i = 0; i < local.size(); ++i) {
      const double misfit = (fit.centre + turn * local[i] - world[i]).norm();
      weight[i] = top_weight[i] * std::min(1.0, kHuber / std::max(misfit, 1e-12));
      sum += top_weight[i] * misfit * misfit;
      total += top_weight[i];
    }
    report.placement_rms_mm = std::sqrt(sum / total) / mm;
  }
  report.marks_used = static_cast<int>(local.size());
  return {{fit.centre.x(), fit.centre.y(), top_z_m}, fit.yaw};
}

Field fill_measured(const Sheet& measured, const GridSpec& grid) {
  using Entry = Eigen::Triplet<double>;
  const int n = grid.count();
  std::vector<Entry> entries;
  int row_count = 0;
  Eigen::MatrixXd target(static_cast<Eigen::Index>(measured.marks.size()) + 3 * n, 3);
  target.setZero();
  for (const SheetMark& mark : measured.marks) {
    const Hold hold = hold_at(grid, mark.material_m);
    for (int k = 0; k < 4; ++k) {
      entries.emplace_back(row_count, hold.particle[k], kMarkWeight * hold.weight[k]);
    }
    target.row(row_count++) = kMarkWeight * mark.point_in_world.transpose();
  }
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) {
      const int i = grid.index(r, c);
      const auto second = [&](int before, int after) {
        entries.emplace_back(row_count, before, 1.0);
        entries.emplace_back(row_count, i, -2.0);
        entries.emplace_back(row_count++, after, 1.0);
      };
      if (r > 0 && r + 1 < grid.rows) second(i - grid.cols, i + grid.cols);
      if (c > 0 && c + 1 < grid.cols) second(i - 1, i + 1);
      if (r + 1 < grid.rows && c + 1 < grid.cols) {
        entries.emplace_back(row_count, i, 1.0);
        entries.emplace_back(row_count, i + 1, -1.0);
        entries.emplace_back(row_count, i + grid.cols, -1.0);
        entries.emplace_back(row_count++, i + grid.cols + 1, 1.0);
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(row_count, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseMatrix<double> normal = matrix.transpose() * matrix;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);
  const Eigen::MatrixXd solution = solver.solve(matrix.transpose() * target.topRows(row_count));
  if (solver.info() != Eigen::Success || !solution.allFinite()) {
    throw bad_input("the measured marks do not span a surface", {},
                    "at least three marks off one line are needed to start from them");
  }
  return {solution.data(), solution.data() + solution.size()};
}

const Sheet& need_measured(const std::optional<Sheet>& measured, const Scene& scene) {
  return need(measured, scene, "start.mode", "the scene starts from the measured sheet");
}

FlatPose flat_start(const Scene& scene, const std::optional<Sheet>& measured, double top_z_m,
                    StartReport& report) {
  if (scene.start.mode == StartMode::flat)
    return {scene.start.centre_in_world.value_or(Vector3d::Zero()), scene.start.yaw_rad};
  const Sheet& placing =
      need(measured, scene, "start.mode", "the measured sheet places the virtual one");
  FlatPose flat = fit_flat(placing, top_z_m, report);
  require_laid(scene, top_marks_of(placing, top_z_m));
  flat.centre_in_world.z() = top_z_m + scene.start.clearance_m;
  return flat;
}

/// No cloth is larger, and far beyond (1e12 m) places are rounded to what the checker sees.
void require_sized(const GridSpec& grid, const Scene& scene) {
  const auto side = grid.patch_m.array();
  if ((side >= kLeastSide_m).all() && (side <= kLargestSide_m).all()) return;
  throw bad_input(fmt::format("a side of the patch of {:g} x {:g} mm is not in 0.1 mm .. 100 m",
                              grid.patch_m.x() / mm, grid.patch_m.y() / mm),
                  {.file = scene.print_file.string(), .field = "patch_mm"},
                  "state in the print what the cloth measures");
}

StartState make_start(const Scene& scene, const Print& print, const GridSpec& grid,
                      const std::optional<Sheet>& measured, double top_z_m, double imperfection_m) {
  require_sized(grid, scene);
  StartState start;
  const int n = grid.count();
  if (scene.start.mode == StartMode::measured) {
    start.position = fill_measured(need_measured(measured, scene), grid);
    start.report.marks_used = static_cast<int>(measured->marks.size());
  } else {
    start.report.flat = flat_start(scene, measured, top_z_m, start.report);
    start.position.assign(3 * static_cast<std::size_t>(n), 0.0);
    for (int r = 0; r < grid.rows; ++r) {
      for (int c = 0; c < grid.cols; ++c) {
        const Vector3d p = start.report.flat.point_in_world(material_of(grid, r, c), grid.patch_m);
        for (int axis = 0; axis < 3; ++axis) {
          start.position[static_cast<std::size_t>(axis) * n + grid.index(r, c)] = p[axis];
        }
      }
    }
  }
  for (int i = 0; i < n; ++i) {
    start.position[2 * static_cast<std::size_t>(n) + i] +=
        imperfection_m * imperfection(i / grid.cols, i % grid.cols);
  }
  add_holds(scene, print, grid, measured, start);
  return start;
}

}  // namespace drape::simulate
