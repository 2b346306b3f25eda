// SPDX-License-Identifier: Apache-2.0
#include "simulate/start/start.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/Sparse>
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr double kTopDepth = 4e-3;   // m; depth below the highest mark at which the weight is 1/e
constexpr double kTopLimit = 12e-3;  // m; lower marks are not used for the placement
constexpr double kTopFar = 25e-3;    // m; largest depth of the highest mark below the object's top
constexpr double kHuber = 1e-3;      // m; larger residuals have reduced weight
constexpr int kReweights = 10;
// Largest extension, relative to length: suitings extend by about this under 100 gf/cm (FAST's
// E100; De Boos and Tester 1994), and lying on an object they carry far less.
constexpr double kExtended = 0.05;
constexpr double kFill_m = 5e-3;      // node spacing for filling unmeasured marks
constexpr double kMarkWeight = 100;   // weight of a mark relative to a second difference, both in m
constexpr double kPushed_m = 0.5e-3;  // larger moves out of an object exceed a mark's uncertainty
constexpr double kLeastSide_m = 1e-4, kLargestSide_m = 100;  // sides of a patch: yarn, hall

/// Weighted rigid 2D fit, world = centre + R(yaw) local.
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

/// Coordinates in the flat sheet: x along the weft, y against the warp, origin at its centre.
Vector2d local_of(const Vector2d& material_m, const Vector2d& patch_m) {
  return {material_m.y() - 0.5 * patch_m.y(), 0.5 * patch_m.x() - material_m.x()};
}

const Sheet& need(const std::optional<Sheet>& measured, const Scene& scene, const char* field,
                  const std::string& why) {
  if (measured) return *measured;
  throw bad_input(why, {.file = scene.file.string(), .field = field},
                  "give the measured sheet with --start-from");
}

std::string name_of(const Pin& pin) {
  return pin.at_material_m ? fmt::format("material point ({:g}, {:g}) mm",
                                         pin.at_material_m->x() / mm, pin.at_material_m->y() / mm)
                           : fmt::format("mark ({}, {})", pin.mark.row, pin.mark.col);
}

/// Interpolates bilinearly between marks around a material point; nullopt if one is missing.
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

}  // namespace

Vector3d FlatPose::point_in_world(const Vector2d& material_m, const Vector2d& patch_m) const {
  const Vector2d p = Eigen::Rotation2Dd(yaw_rad) * local_of(material_m, patch_m);
  return centre_in_world + Vector3d(p.x(), p.y(), 0);
}

namespace {

/// The marks that determine the placement of a sheet, in its flat axes and in the world.
struct TopMarks {
  std::vector<Vector2d> local, world;
  std::vector<double> depth_m, weight;  ///< depth below the highest mark; weight 1 there
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

/// Weighted RMS of `length_m(i)` over the marks.
template <class Length>
double rms_m(const TopMarks& top, const Length& length_m) {
  double sum = 0, total = 0;
  for (std::size_t i = 0; i < top.weight.size(); ++i) {
    sum += top.weight[i] * length_m(i) * length_m(i);
    total += top.weight[i];
  }
  return std::sqrt(sum / total);
}

/// RMS distance of the marks from the flat sheet after the least-squares placement; `local` is in
/// its own axes.
double misfit_m(const TopMarks& top, const std::vector<Vector2d>& local) {
  const PlanarFit fit = fit_plane(local, top.world, top.weight);
  const Eigen::Rotation2Dd turn(fit.yaw);
  return rms_m(top,
               [&](std::size_t i) { return (fit.centre + turn * local[i] - top.world[i]).norm(); });
}

/// Tests if the marks fit a sheet laid on the object: a thread that is down by d from the highest
/// mark lost at most d of its horizontal length (1 - cos <= sin), so no drape deviates from the
/// flat sheet by more than descent plus extension. Else it is another cloth, or seen from behind.
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

/// No cloth is larger; at much larger sizes (1e12 m) the checker would see rounded positions.
void require_sized(const Print& print, const Scene& scene) {
  const auto side = print.patch_m.array();
  if ((side >= kLeastSide_m).all() && (side <= kLargestSide_m).all()) return;
  throw bad_input(fmt::format("a side of the patch of {:g} x {:g} mm is not in 0.1 mm .. 100 m",
                              print.patch_m.x() / mm, print.patch_m.y() / mm),
                  {.file = scene.print_file.string(), .field = "patch_mm"},
                  "state in the print what the cloth measures");
}

std::vector<Vector3d> pin_places(const Scene& scene, const Print& print,
                                 const std::optional<Sheet>& measured) {
  std::vector<Vector3d> places;
  for (const Pin& pin : scene.pins) {
    const Where where{.file = scene.file.string(), .field = "pin"};
    if (!pin.at_material_m && (pin.mark.row < 0 || pin.mark.col < 0 || pin.mark.row >= print.rows ||
                               pin.mark.col >= print.cols))
      throw bad_input(fmt::format("the pin holds {}, which the print does not have", name_of(pin)),
                      where,
                      fmt::format("rows 0 to {}, cols 0 to {}", print.rows - 1, print.cols - 1));
    const auto place =
        pin.point_in_world
            ? pin.point_in_world
            : measured_point(need(measured, scene, "pin.at_mm", "a pin has no point in space"),
                             print, pin.material_m(print));
    if (!place)
      throw bad_input(
          fmt::format("the pin holds {}, which was not measured", name_of(pin)), where,
          "give its position as at_mm, or pin a point whose marks around it were measured");
    places.push_back(*place);
  }
  return places;
}

double push_out(std::vector<Vector3d>& places, const Surroundings& surroundings) {
  constexpr int kRounds = 20;  // between two objects, each pushes into the other
  double farthest_m = 0;
  for (Vector3d& place : places) {
    const Vector3d from = place;
    bool inside = true;
    for (int round = 0; inside && round < kRounds; ++round) {
      inside = false;
      for (int shape = 0; shape < surroundings.count(); ++shape) {
        const double gap_m = surroundings.gap_m(shape, place);
        if (gap_m >= 0) continue;
        place -= gap_m * surroundings.normal(shape, place);
        inside = true;
      }
    }
    farthest_m = std::max(farthest_m, (place - from).norm());
  }
  return farthest_m;
}

namespace {

/// Nodes in rows along the warp, `spacing_m` apart, one of them on mark (0, 0), covering a patch.
struct FillGrid {
  explicit FillGrid(const Print& print)
      : spacing_m(print.pitch_m / std::max(1.0, std::round(print.pitch_m / kFill_m))) {
    const auto steps = [&](double length_m) {
      return static_cast<int>(std::ceil(length_m / spacing_m - 1e-6));
    };
    for (int d = 0; d < 2; ++d) {
      const int before = steps(print.margin_m[d]);
      first_m[d] = print.margin_m[d] - before * spacing_m;
      count[d] = before + steps(print.patch_m[d] - print.margin_m[d]) + 1;
    }
  }
  [[nodiscard]] int index(int row, int col) const { return row * count[1] + col; }
  [[nodiscard]] Vector2d material_m(int row, int col) const {
    return first_m + spacing_m * Vector2d(row, col);
  }

  double spacing_m;
  Vector2d first_m;
  std::array<int, 2> count{};
};

/// Rows of a least-squares problem: weights of nodes, and the values of their sums.
struct Equations {
  void add(std::initializer_list<std::pair<int, double>> weights, const Vector3d& sum) {
    for (const auto& [node, weight] : weights)
      entries.emplace_back(static_cast<int>(sums.size()), node, weight);
    sums.push_back(sum);
  }
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<Vector3d> sums;
};

void add_marks(const Sheet& measured, const FillGrid& grid, Equations& equations) {
  for (const SheetMark& mark : measured.marks) {
    const Vector2d at = (mark.material_m - grid.first_m) / grid.spacing_m;
    const int row = std::clamp(static_cast<int>(std::floor(at.x())), 0, grid.count[0] - 2);
    const int col = std::clamp(static_cast<int>(std::floor(at.y())), 0, grid.count[1] - 2);
    const double a = at.x() - row, b = at.y() - col, w = kMarkWeight;
    equations.add({{grid.index(row, col), w * (1 - a) * (1 - b)},
                   {grid.index(row, col + 1), w * (1 - a) * b},
                   {grid.index(row + 1, col), w * a * (1 - b)},
                   {grid.index(row + 1, col + 1), w * a * b}},
                  w * mark.point_in_world);
  }
}

void add_second_differences(const FillGrid& grid, Equations& equations) {
  for (int row = 0; row < grid.count[0]; ++row) {
    for (int col = 0; col < grid.count[1]; ++col) {
      const int i = grid.index(row, col), below = i + grid.count[1];
      if (row > 0 && row + 1 < grid.count[0])
        equations.add({{i - grid.count[1], 1}, {i, -2}, {below, 1}}, Vector3d::Zero());
      if (col > 0 && col + 1 < grid.count[1])
        equations.add({{i - 1, 1}, {i, -2}, {i + 1, 1}}, Vector3d::Zero());
      if (row + 1 < grid.count[0] && col + 1 < grid.count[1])
        equations.add({{i, 1}, {i + 1, -1}, {below, -1}, {below + 1, 1}}, Vector3d::Zero());
    }
  }
}

/// True if the marks are collinear on the cloth, so that a surface could rotate about their line.
bool on_a_line(const std::vector<SheetMark>& marks, double pitch_m) {
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const SheetMark& mark : marks) {
    const Vector2d from = mark.material_m - marks.front().material_m;
    scatter += from * from.transpose();
  }
  return marks.size() < 3 || scatter.determinant() < std::pow(0.1 * pitch_m, 4);
}

}  // namespace

MaterialShape measured_shape(const Scene& scene, const std::optional<Sheet>& measured,
                             const Print& print, const Surroundings& surroundings) {
  const Sheet& sheet = need_measured(measured, scene);
  if (on_a_line(sheet.marks, print.pitch_m))
    throw bad_input("the measured marks do not span a surface",
                    {.file = scene.file.string(), .field = "start.mode"},
                    "measure at least three marks off one line, or start flat");
  const FillGrid grid(print);
  Equations equations;
  add_marks(sheet, grid, equations);
  add_second_differences(grid, equations);
  const auto rows = static_cast<Eigen::Index>(equations.sums.size());
  Eigen::MatrixX3d sums(rows, 3);
  for (Eigen::Index k = 0; k < rows; ++k) sums.row(k) = equations.sums[k].transpose();
  Eigen::SparseMatrix<double> matrix(rows, grid.count[0] * grid.count[1]);
  matrix.setFromTriplets(equations.entries.begin(), equations.entries.end());
  const Eigen::SparseMatrix<double> normal = matrix.transpose() * matrix;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);
  const Eigen::MatrixX3d solution = solver.solve(matrix.transpose() * sums);
  MaterialShape shape;
  for (int row = 0; row < grid.count[0]; ++row) {
    for (int col = 0; col < grid.count[1]; ++col) {
      shape.material_m.push_back(grid.material_m(row, col));
      shape.places.emplace_back(solution.row(grid.index(row, col)).transpose());
    }
  }
  shape.pushed_out_m = push_out(shape.places, surroundings);
  const int marks = sheet.rows * sheet.cols;
  shape.filled = 1 - static_cast<double>(sheet.marks.size()) / marks;
  if (shape.filled > 0)
    shape.warnings.push_back(fmt::format(
        "start from the measured shape: {} of {} marks ({:.0f} %) were not measured; the surface "
        "of least second differences through the others stands for them",
        marks - static_cast<int>(sheet.marks.size()), marks, 100 * shape.filled));
  if (shape.pushed_out_m > kPushed_m)
    shape.warnings.push_back(
        fmt::format("start from the measured shape: moved out of the objects by up to {:.2g} mm",
                    shape.pushed_out_m / mm));
  return shape;
}

}  // namespace drape::simulate
