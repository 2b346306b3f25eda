// SPDX-License-Identifier: Apache-2.0
#include "simulate/start/start.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/Sparse>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numbers>
#include <utility>

#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr double kTopDepth = 4e-3;   // m; depth below the highest mark at which the weight is 1/e
constexpr double kTopLimit = 12e-3;  // m; lower marks are not used for the placement
constexpr double kTopFar = 25e-3;    // m; largest depth of the highest mark below the object's top
constexpr double kHuber = 1e-3;      // m; larger residuals have reduced weight
constexpr int kReweights = 10;
// Largest extension, relative to length: suitings extend by about this under 100 gf/cm (FAST's
// E100; De Boos and Tester 1994), and cloth lying on an object carries far less.
constexpr double kExtended = 0.05;
constexpr double kFill_m = 5e-3;      // node spacing for filling unmeasured marks
constexpr double kMarkWeight = 100;   // weight of a mark relative to a second difference, both in m
constexpr double kPushed_m = 0.5e-3;  // larger moves out of an object exceed a mark's uncertainty
constexpr double kLeastSide_m = 1e-4, kLargestSide_m = 100;  // edges of a patch: yarn, hall

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

/// Throws unless the marks fit a sheet laid on the object. A thread that is down by d from the
/// highest mark loses at most d of its horizontal length (1 - cos <= sin), so a drape deviates from
/// the flat sheet by at most descent plus extension. Between pins or clamps it may come down as far
/// as the lowest mark. Else it is another cloth, or seen from behind.
void require_laid(const Scene& scene, const Sheet& measured, const TopMarks& top) {
  Vector2d middle = Vector2d::Zero();
  double total = 0;
  for (std::size_t i = 0; i < top.local.size(); ++i) {
    middle += top.weight[i] * top.local[i];
    total += top.weight[i];
  }
  middle /= total;
  double fallen_m = rms_m(top, [&](std::size_t i) { return top.depth_m[i]; });
  if (!scene.pins.empty() || !scene.clamps.empty()) {
    const auto [lowest, highest] = std::ranges::minmax(
        measured.marks, {}, [](const SheetMark& mark) { return mark.point_in_world.z(); });
    fallen_m = highest.point_in_world.z() - lowest.point_in_world.z();
  }
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

constexpr double kGrain = 0x1p-33;       // m; also for unit vectors
constexpr double kSlopeGrain = 0x1p-42;  // for the direction in which cloth leaves a clamp

double rounded(double value) {
  return std::round(value / kGrain) * kGrain;
}

template <class Values>
Values rounded_all(const Values& values) {
  return values.unaryExpr([](double value) { return rounded(value); });
}

/// Transforms from the world to the local frame, with rounding.
struct ToLocal {
  Matrix3d turn;
  Vector3d origin;

  [[nodiscard]] Vector3d point(const Vector3d& p) const {
    return rounded_all(Vector3d(turn * (p - origin)));
  }
  /// Rounds a slope more finely, since its force scales with bending over a particle's weight.
  [[nodiscard]] Vector3d slope(const Vector3d& unit) const {
    return (turn * unit).unaryExpr([](double value) {
      return std::round(value / kSlopeGrain) * kSlopeGrain;
    });
  }
  [[nodiscard]] WorldFromObject pose(const WorldFromObject& world_from_object) const {
    return {rounded_all(Matrix3d(turn * world_from_object.rotation)),
            point(world_from_object.translation_m)};
  }
  void operator()(Sphere& body) const { body.centre_in_world = point(body.centre_in_world); }
  void operator()(Box& body) const { body.world_from_box = pose(body.world_from_box); }
  void operator()(Cylinder& body) const {
    body.world_from_cylinder = pose(body.world_from_cylinder);
  }
  void operator()(Plane& body) const {
    body.point_in_world = point(body.point_in_world);
    body.normal_in_world = rounded_all(Vector3d(turn * body.normal_in_world)).normalized();
  }
  void operator()(MeshObject& body) const { body.world_from_mesh = pose(body.world_from_mesh); }
};

/// Centre of the marks and direction of their weft, seen from above.
FlatPose pose_of_marks(const Sheet& measured) {
  FlatPose pose;
  Vector2d middle = Vector2d::Zero();
  const auto count = static_cast<double>(measured.marks.size());
  for (const SheetMark& mark : measured.marks) {
    pose.centre_in_world += mark.point_in_world / count;
    middle += mark.material_m / count;
  }
  double dot = 0, cross = 0;
  for (const SheetMark& mark : measured.marks) {
    const Vector3d p = mark.point_in_world - pose.centre_in_world;
    const Vector2d q(mark.material_m.y() - middle.y(), middle.x() - mark.material_m.x());
    dot += q.x() * p.x() + q.y() * p.y();
    cross += q.x() * p.y() - q.y() * p.x();
  }
  pose.yaw_rad = std::atan2(cross, dot);
  return pose;
}

constexpr double kSame_m = 1e-6;         // rounding of files
constexpr double kSameDirection = 1e-3;  // sine; the cloth would leave along the clamp
constexpr double kKink = 0.02;           // rad; a visible kink
constexpr double kLook_m = 1e-3;         // step along a clamp in search of gaps in the cloth

[[noreturn]] void reject(const Scene& scene, std::size_t k, const std::string& what,
                         const std::string& to_do) {
  throw bad_input(fmt::format("clamp {} {}", k + 1, what),
                  {.file = scene.file.string(), .field = "clamp"}, to_do);
}

void require_on_cloth(const Scene& scene, std::size_t k, const ClothOutline& outline) {
  const Clamp& clamp = scene.clamps[k];
  const Vector2d along = clamp.to_material_m - clamp.from_material_m;
  const int steps = 1 + static_cast<int>(along.norm() / kLook_m);
  for (int i = 0; i <= steps; ++i) {
    const Vector2d at = clamp.from_material_m + along * i / steps;
    if (is_on(outline, at, kSame_m)) continue;
    reject(scene, k,
           fmt::format("leaves the cloth at warp {:g}, weft {:g} mm", at.x() / mm, at.y() / mm),
           "count along warp and weft from the corner beside mark (0, 0)");
  }
}

/// Direction of the threads that leave a line: 0 for warp, 1 for weft.
int across(const HeldLine& line) {
  return std::abs(line.to_m.x() - line.from_m.x()) > kSame_m ? 1 : 0;
}

HeldLine line_of(const Scene& scene, std::size_t k, const ClothOutline& outline) {
  const Clamp& clamp = scene.clamps[k];
  const Vector2d along = clamp.to_material_m - clamp.from_material_m;
  const Vector3d in_space = clamp.to_in_world - clamp.from_in_world;
  require_on_cloth(scene, k, outline);
  if (!(along.norm() > kSame_m && in_space.norm() > kSame_m))
    reject(scene, k, "has no length", "give two ends apart from each other, or a [[pin]]");
  if (along.cwiseAbs().minCoeff() > kSame_m)
    reject(scene, k, "crosses the threads",
           "a clamp runs along warp or weft: give both ends the same warp or the same weft");
  const Vector3d tangent = in_space.normalized();
  const Vector3d& direction = clamp.direction_in_world;
  const Vector3d forward = direction - direction.dot(tangent) * tangent;
  if (!(forward.norm() > kSameDirection))
    reject(scene, k, "is left along itself",
           "give the direction in which the cloth leaves, across the clamp");
  HeldLine line{
      clamp.from_material_m, clamp.to_material_m, clamp.from_in_world, clamp.to_in_world, {}, {}};
  const int d = across(line);
  Vector2d beside = (line.from_m + line.to_m) / 2;
  beside[d] += 2 * kSame_m;
  Vector3d& leaving = d == 0 ? line.x_u : line.x_v;
  leaving = forward.normalized();
  if (!is_on(outline, beside, kSame_m)) leaving = -leaving;
  (d == 0 ? line.x_v : line.x_u) = in_space / along[1 - d];
  return line;
}

/// Material point shared by two lines, nullopt if they do not meet; for overlapping lines, an end
/// of one.
std::optional<Vector2d> meeting_of(const HeldLine& a, const HeldLine& b) {
  const int d = across(a);
  if (d != across(b)) {
    Vector2d at;
    at[d] = a.from_m[d];
    at[1 - d] = b.from_m[1 - d];
    if (a.holds(at) && b.holds(at)) return at;
    return std::nullopt;
  }
  for (const Vector2d& end : {b.from_m, b.to_m})
    if (a.holds(end)) return end;
  for (const Vector2d& end : {a.from_m, a.to_m})
    if (b.holds(end)) return end;
  return std::nullopt;
}

void require_agreeing(const Scene& scene, const Print& print, const std::vector<HeldLine>& lines) {
  for (std::size_t k = 0; k < lines.size(); ++k) {
    for (std::size_t i = 0; i < k; ++i) {
      const std::optional<Vector2d> at = meeting_of(lines[i], lines[k]);
      if (!at) continue;
      const double apart_m = (lines[i].place(*at) - lines[k].place(*at)).norm();
      if (apart_m > kSame_m)
        reject(scene, k,
               fmt::format("and clamp {} hold the same point of the cloth {:.3g} mm apart", i + 1,
                           apart_m / mm),
               "let their lines meet in space where they meet on the cloth");
    }
    for (const Pin& pin : scene.pins) {
      const Vector2d at = pin.material_m(print);
      if (!pin.point_in_world || !lines[k].holds(at)) continue;
      const double apart_m = (lines[k].place(at) - *pin.point_in_world).norm();
      if (apart_m > kSame_m)
        reject(
            scene, k,
            fmt::format("and a pin hold the same point of the cloth {:.3g} mm apart", apart_m / mm),
            "leave the pin out, or give it its place on the clamp");
    }
  }
}

constexpr double kAtHem_m = 1e-6;    // a pin this close to the hem counts as on it
constexpr double kWritten_m = 1e-3;  // rounding of positions given in whole millimetres

/// Largest depth of a start laid on an object: woven cloth is thinner (KES-FB-3 at 0.5
/// gf/cm2).
constexpr double kThickest_m = 1e-3;

double deepest_m(const std::vector<Vector3d>& places_in_world, const Surroundings& surroundings,
                 double raised_m) {
  double deepest = 0;
  for (const Vector3d& place : places_in_world)
    for (int shape = 0; shape < surroundings.count(); ++shape)
      deepest = std::max(deepest, -surroundings.gap_m(shape, place + Vector3d(0, 0, raised_m)));
  return deepest;
}

/// True if a point is inside an object near a downward-facing surface, as if laid on it from below.
bool is_below_an_object(const std::vector<Vector3d>& places_in_world,
                        const Surroundings& surroundings) {
  constexpr double kRounded_m = 1e-6, kDown = -1e-3;
  for (const Vector3d& place : places_in_world)
    for (int shape = 0; shape < surroundings.count(); ++shape)
      if (surroundings.gap_m(shape, place) < -kRounded_m &&
          surroundings.normal(shape, place).z() < kDown)
        return true;
  return false;
}

}  // namespace

Vector3d FlatPose::point_in_world(const Vector2d& material_m, const Vector2d& patch_m) const {
  const Vector2d p = Eigen::Rotation2Dd(yaw_rad) * local_of(material_m, patch_m);
  return centre_in_world + Vector3d(p.x(), p.y(), 0);
}

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
  require_laid(scene, placing, top_marks_of(placing, top_z_m));
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
  constexpr double kLeastSlope = 0.1;
  double farthest_m = 0;
  for (Vector3d& place : places) {
    const Vector3d from = place;
    bool inside = true;
    for (int round = 0; inside && round < kRounds; ++round) {
      inside = false;
      for (int shape = 0; shape < surroundings.count(); ++shape) {
        const Surroundings::Nearest nearest = surroundings.nearest(shape, place);
        if (nearest.gap_m >= 0) continue;
        place -= nearest.gap_m / std::max(nearest.slope, kLeastSlope) * nearest.normal;
        inside = true;
      }
    }
    farthest_m = std::max(farthest_m, (place - from).norm());
  }
  return farthest_m;
}

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

Vector3d LocalScene::to_world(const Vector3d& local) const {
  return Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()) * local + origin_in_world;
}

Eigen::MatrixX3d LocalScene::rows_to_world(Eigen::MatrixX3d local) const {
  for (auto row : local.rowwise()) row = to_world(row.transpose()).transpose();
  return local;
}

Vector3d LocalScene::to_local(const Vector3d& world) const {
  const Eigen::AngleAxisd back(-yaw_rad, Vector3d::UnitZ());
  return ToLocal{back.toRotationMatrix(), origin_in_world}.point(world);
}

double LocalScene::gravity_offset_j(double mass_kg) const {
  const Vector3d gravity = Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()) * scene.gravity_m_per_s2;
  return -mass_kg * gravity.dot(origin_in_world);
}

LocalScene local_scene(const Scene& world, const std::optional<Sheet>& measured, double top_z_m) {
  LocalScene local;
  if (world.start.mode == StartMode::measured) {
    local.placed.flat = pose_of_marks(need_measured(measured, world));
  } else {
    local.placed.flat = flat_start(world, measured, top_z_m, local.placed);
  }
  local.yaw_rad = local.placed.flat.yaw_rad;
  local.origin_in_world = local.placed.flat.centre_in_world;
  const ToLocal to_local{Eigen::AngleAxisd(-local.yaw_rad, Vector3d::UnitZ()).toRotationMatrix(),
                         local.origin_in_world};
  local.scene = world;
  for (Obstacle& obstacle : local.scene.obstacles) std::visit(to_local, obstacle);
  for (Pin& pin : local.scene.pins) {
    if (pin.point_in_world) pin.point_in_world = to_local.point(*pin.point_in_world);
  }
  for (Clamp& clamp : local.scene.clamps) {
    clamp.from_in_world = to_local.point(clamp.from_in_world);
    clamp.to_in_world = to_local.point(clamp.to_in_world);
    clamp.direction_in_world = to_local.slope(clamp.direction_in_world);
  }
  local.scene.table_z_m = rounded(world.table_z_m - local.origin_in_world.z());
  local.scene.gravity_m_per_s2 =
      world.gravity_m_per_s2.head<2>().isZero(0)
          ? world.gravity_m_per_s2
          : rounded_all(Vector3d(to_local.turn * world.gravity_m_per_s2));
  if (world.start.mode != StartMode::measured) {
    local.scene.start.mode = StartMode::flat;
    local.scene.start.centre_in_world = Vector3d::Zero();
    local.scene.start.yaw_rad = 0;
  }
  local.measured = measured;
  if (local.measured) {
    for (SheetMark& mark : local.measured->marks)
      mark.point_in_world = to_local.point(mark.point_in_world);
  }
  return local;
}

StartVariation variation_of(int index, bool friction_known) {
  constexpr double kPlace_m = 2e-3;
  StartVariation v;
  if (index == 0) return v;
  const auto pick = [&](int what, double low, double high) {
    return low +
           (high - low) * SplitMix64(0, static_cast<std::uint64_t>(index) * 16 + what).uniform();
  };
  v.noise_m = std::pow(10.0, pick(0, -6, -3.5));
  v.tilt_rad = pick(1, 0, 0.08);
  v.tilt_axis_rad = pick(2, 0, 2 * std::numbers::pi);
  v.yaw_rad = pick(3, -0.03, 0.03);
  v.lift_m = pick(4, 0, 0.01);
  v.folds = 2 + static_cast<int>(pick(5, 0, 6.999));
  v.fold_m = pick(6, 0, 6e-3);
  v.fold_phase_rad = pick(7, 0, 2 * std::numbers::pi);
  v.place_m = {pick(8, -kPlace_m, kPlace_m), pick(9, -kPlace_m, kPlace_m)};
  v.friction_factor = friction_known ? pick(10, 0.9, 1.1) : std::exp2(pick(10, -1, 1));
  v.drag_factor = std::exp2(pick(11, -2, 2));
  return v;
}

void vary(const StartVariation& v, std::vector<Vector3d>& places) {
  if (places.empty()) return;
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& place : places) middle += place / static_cast<double>(places.size());
  double reach_m = 0;
  for (const Vector3d& place : places)
    reach_m = std::max(reach_m, (place - middle).head<2>().norm());
  const Vector3d axis(std::cos(v.tilt_axis_rad), std::sin(v.tilt_axis_rad), 0);
  const Matrix3d turn =
      (Eigen::AngleAxisd(v.tilt_rad, axis) * Eigen::AngleAxisd(v.yaw_rad, Vector3d::UnitZ()))
          .toRotationMatrix();
  double lowered_m = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vector3d from = places[i] - middle;
    const double out = reach_m > 0 ? from.head<2>().norm() / reach_m : 0;
    const double noise = v.noise_m * (2 * SplitMix64(0, 7919 * (i + 1)).uniform() - 1);
    const double wave = v.fold_m * out * out *
                        std::cos(v.folds * std::atan2(from.y(), from.x()) - v.fold_phase_rad);
    const Vector3d moved = turn * (from + Vector3d(0, 0, noise + wave));
    lowered_m = std::max(lowered_m, from.z() - moved.z());
    places[i] = middle + moved;
  }
  for (Vector3d& place : places)
    place += Vector3d(v.place_m.x(), v.place_m.y(), v.lift_m + lowered_m);
}

Vector3d HeldLine::place(const Vector2d& material_m) const {
  const Vector2d along = to_m - from_m;
  return from + (material_m - from_m).dot(along) / along.squaredNorm() * (to - from);
}

bool HeldLine::holds(const Vector2d& material_m) const {
  return distance_m({from_m, to_m}, material_m) <= kSame_m;
}

std::vector<HeldLine> held_lines(const Scene& scene, const Print& print,
                                 const ClothOutline& outline) {
  std::vector<HeldLine> lines;
  for (std::size_t k = 0; k < scene.clamps.size(); ++k) lines.push_back(line_of(scene, k, outline));
  require_agreeing(scene, print, lines);
  return lines;
}

std::vector<std::string> warnings_of_clamps(const std::vector<HeldLine>& lines) {
  std::vector<std::string> warnings;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    for (std::size_t i = 0; i < k; ++i) {
      if (!meeting_of(lines[i], lines[k])) continue;
      const auto angle = [&](const Vector3d& a, const Vector3d& b) {
        return std::atan2(a.cross(b).norm(), a.dot(b));
      };
      const double kink =
          std::max(angle(lines[i].x_u, lines[k].x_u), angle(lines[i].x_v, lines[k].x_v));
      if (kink > kKink)
        warnings.push_back(fmt::format(
            "clamps {} and {} meet on the cloth and turn it {:.2g} deg apart: it kinks there",
            i + 1, k + 1, kink / units::deg));
    }
  }
  return warnings;
}

void refuse_flat_start_inside(const Scene& scene, const Print& print, const ClothOutline& outline,
                              const Surroundings& surroundings) {
  if (scene.start.mode != StartMode::flat) return;
  require_sized(print, scene);
  constexpr int kPlaces = 110;  // along each edge; closer than half of a small object
  const FlatPose flat{scene.start.centre_in_world.value_or(Vector3d::Zero()), scene.start.yaw_rad};
  std::vector<Vector3d> places;
  for (int i = 0; i <= kPlaces; ++i) {
    for (int k = 0; k <= kPlaces; ++k) {
      const Vector2d at = print.patch_m.cwiseProduct(Vector2d(i, k) / double{kPlaces});
      if (is_on(outline, at, kAtHem_m)) places.push_back(flat.point_in_world(at, print.patch_m));
    }
  }
  const double deep_m = deepest_m(places, surroundings, 0);
  if (deep_m <= kThickest_m && !is_below_an_object(places, surroundings)) return;
  constexpr double kHighest_m = 10, kFirst_m = 1e-3;
  double raised_m = kFirst_m;
  while (raised_m < kHighest_m && deepest_m(places, surroundings, raised_m) > 0)
    raised_m += std::max(kFirst_m, deepest_m(places, surroundings, raised_m));
  throw bad_input(
      fmt::format("the flat start lies inside an object or below the table, by up to {:.3g} mm",
                  deep_m / mm),
      {.file = scene.file.string(), .field = "start.centre_mm"},
      fmt::format("its height must be some {:.3g} mm more; are its numbers millimetres?",
                  raised_m / mm));
}

void refuse_pins_beside(const Scene& scene, const Print& print, const ClothOutline& outline) {
  for (const Pin& pin : scene.pins) {
    const Vector2d at = pin.material_m(print);
    if (is_on(outline, at, kAtHem_m)) continue;
    throw bad_input(fmt::format("the pin at warp {:g}, weft {:g} mm is not on the cloth",
                                at.x() / mm, at.y() / mm),
                    {.file = scene.file.string(), .field = "pin"},
                    "pin a point inside the outline");
  }
}

void require_gravity_of_earth(const Scene& scene) {
  if (is_gravity_of_earth(scene)) return;
  throw bad_input(fmt::format("a real drape was measured under gravity of 9.76 to 9.84 m/s2, the "
                              "scene has {:g}",
                              scene.gravity_m_per_s2.norm()),
                  {.file = scene.file.string(), .field = "gravity_m_per_s2"},
                  "leave it out, or give [0, 0, -9.80665]");
}

std::vector<std::string> warnings_of_scene(const Scene& scene, std::optional<double> least_gap_m,
                                           double spacing_m) {
  std::vector<std::string> warnings;
  if (!is_gravity_of_earth(scene))
    warnings.push_back(fmt::format("gravity of {:g} m/s2 is not Earth's, of 9.76 to 9.84",
                                   scene.gravity_m_per_s2.norm()));
  if (least_gap_m && *least_gap_m > spacing_m)
    warnings.push_back(
        fmt::format("the cloth touches none of the scene's objects: the nearest is {:.1f} mm away",
                    *least_gap_m / units::mm));
  return warnings;
}

void check_pins(const Scene& scene, const Print& print, const Fabric& fabric) {
  for (std::size_t i = 0; i < scene.pins.size(); ++i) {
    for (std::size_t k = i + 1; k < scene.pins.size(); ++k) {
      const Pin &one = scene.pins[i], &other = scene.pins[k];
      if (!one.point_in_world || !other.point_in_world) continue;
      const Vector2d between = (other.material_m(print) - one.material_m(print)).cwiseAbs();
      const double apart_m = (*other.point_in_world - *one.point_in_world).norm();
      const double reach_m = between.x() * (1 + fabric.tensile[0].x.back()) +
                             between.y() * (1 + fabric.tensile[1].x.back());
      if (apart_m <= reach_m + kWritten_m) continue;
      throw bad_input(
          fmt::format("pins {} and {} are {:.4g} mm apart in space; the cloth between them, {:.4g} "
                      "mm along its threads, was measured to stretch to {:.4g} mm",
                      i + 1, k + 1, apart_m / mm, between.sum() / mm, reach_m / mm),
          {.file = scene.file.string(), .field = "pin"},
          "is a place wrong, or a mark's row or column exchanged?");
    }
  }
}

}  // namespace drape::simulate
