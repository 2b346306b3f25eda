// SPDX-License-Identifier: Apache-2.0
#include "simulate/drape/piece.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "core/error.hpp"
#include "core/units.hpp"
#include "simulate/contact/self_distance.hpp"
#include "simulate/objects/surroundings.hpp"
#include "simulate/drape/layer_pushes.hpp"
#include "simulate/drape/object_pushes.hpp"
#include "simulate/start/start.hpp"
#include "simulate/start/start_check.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr double kMostPoints = 1e5;  // points of a mesh
constexpr double kLeastPoints = 16;  // a mesh of fewer does not drape
constexpr double kSame_m = 1e-6;     // a pin this near to the hem is on it
constexpr double kOn_m = 5e-8;   // in or off: a point lies on a surface; half the checker's limit
constexpr int kMostRounds = 60;  // rounds of descents and of points that carry on their pushes
constexpr double kPassingResidual = 0.1;  // weights of a point, while places still press softly

void check_pins(const Scene& scene, const Print& print, const ClothOutline& outline) {
  for (const Pin& pin : scene.pins) {
    const Vector2d at = pin.material_m(print);
    const bool on = contains(outline.outer, at) || distance_m(outline.outer, at) < kSame_m;
    const bool in_hole = std::any_of(
        outline.holes.begin(), outline.holes.end(),
        [&](const Polygon& hole) { return contains(hole, at) && distance_m(hole, at) >= kSame_m; });
    if (on && !in_hole) continue;
    throw bad_input(fmt::format("the pin at warp {:g}, weft {:g} mm is not on the piece",
                                at.x() / mm, at.y() / mm),
                    {.file = scene.file.string(), .field = "pin"},
                    "pin a point inside the outline");
  }
}

void check_size(const ClothOutline& outline, double spacing_m) {
  Vector2d low = outline.outer.front(), high = low;
  for (const Vector2d& p : outline.outer) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double points = ((high - low) / spacing_m).prod();
  if (points < kLeastPoints)
    throw bad_input(
        fmt::format("the outline holds {:.3g} x {:.3g} mm, fewer than {:g} spacings of "
                    "{:g} mm squared",
                    (high - low).x() / mm, (high - low).y() / mm, kLeastPoints, spacing_m / mm),
        {.file = outline.file.string()}, "give mm, not cm; or a smaller --spacing-mm");
  if (points <= kMostPoints) return;
  throw usage_error(
      fmt::format("a mesh of {:g} mm would have some {:.0f} points", spacing_m / mm, points),
      fmt::format("give a wider --spacing-mm; up to {:g} points are taken", kMostPoints));
}

/// Flat as the scene says, and where its pins must be.
StartState start_of(const Scene& scene, const Print& print, const std::optional<Sheet>& measured,
                    double top_z_m) {
  if (scene.start.mode == StartMode::measured)
    throw bad_input("a piece cannot start from a measured shape",
                    {.file = scene.file.string(), .field = "start.mode"},
                    "write mode = \"flat\" or \"flat_from_measured\"");
  const GridSpec grid{2, 2, print.patch_m};
  return make_start(scene, print, grid, measured, top_z_m, 0);
}

/// Carries pins from where flat cloth has them to their places, as fast as free cloth sinks, and
/// says when the last arrives (s).
class PinsCarried {
 public:
  PinsCarried(const PieceDrape& piece, double speed_m_per_s) : piece_(piece) {
    for (const int pinned : piece.pinned) from_.push_back(piece.state[pinned]);
    for (std::size_t k = 0; k < from_.size(); ++k)
      arrival_s_ =
          std::max(arrival_s_, (piece.pinned_in_world[k] - from_[k]).norm() / speed_m_per_s);
  }
  [[nodiscard]] double arrival_s() const { return arrival_s_; }
  void operator()(double time_s, MeshCloth::State& state) const {
    for (std::size_t k = 0; k < from_.size(); ++k)
      state[piece_.pinned[k]] =
          time_s < arrival_s_
              ? (from_[k] + time_s / arrival_s_ * (piece_.pinned_in_world[k] - from_[k])).eval()
              : piece_.pinned_in_world[k];
  }

 private:
  const PieceDrape& piece_;
  double arrival_s_ = 0;
  std::vector<Vector3d> from_;
};

/// Objects, and cloth on cloth.
class AllPushes : public Pushes {
 public:
  AllPushes(ObjectPushes& objects, LayerPushes& layers) : all_{&objects, &layers} {}

  [[nodiscard]] double energy_j(const MeshCloth::State& state) override {
    double sum = 0;
    for (Pushes* pushes : all_) sum += pushes->energy_j(state);
    return sum;
  }
  void add_forces(const MeshCloth::State& state, MeshCloth::State& force) override {
    for (Pushes* pushes : all_) pushes->add_forces(state, force);
  }
  [[nodiscard]] std::vector<Support> supports(const MeshCloth::State& state) override {
    std::vector<Support> found;
    for (Pushes* pushes : all_) {
      const std::vector<Support> more = pushes->supports(state);
      found.insert(found.end(), more.begin(), more.end());
    }
    return found;
  }
  void settle(const MeshCloth::State& state) override {
    for (Pushes* pushes : all_) pushes->settle(state);
  }
  [[nodiscard]] double clear_part(const MeshCloth::State& from, const MeshCloth::State& to,
                                  bool led) override {
    double part = 1;
    for (Pushes* pushes : all_) part = std::min(part, pushes->clear_part(from, to, led));
    return part;
  }

 private:
  std::array<Pushes*, 2> all_;
};

/// The same start to its rest, by cloth that remembers nothing yet.
PieceDrape dropped(PieceDrape piece, MeshCloth cloth, const std::vector<bool>& held,
                   const Scene& scene, const Surroundings& around, const PieceOptions& options,
                   double layers_apart_m) {
  DescentOptions descent = options.descent;
  descent.gravity_m_per_s2 = scene.gravity_m_per_s2;
  const double gravity = scene.gravity_m_per_s2.norm();
  ObjectPushes pushes(cloth, held, around, scene.friction, gravity);
  if (layers_apart_m > 0) {
    LayerPushes layers(cloth, gravity, layers_apart_m);
    AllPushes all(pushes, layers);
    fall_to_rest(cloth, piece, held, pushes, all, options.motion, descent);
    piece.contact_forces = layers.stated(piece.state, around.count());
  } else {
    fall_to_rest(cloth, piece, held, pushes, pushes, options.motion, descent);
  }
  piece.layers_apart_m = layers_apart_m;
  piece.surface = ClothSurface(cloth).nodes(piece.state);
  const std::vector<ContactForce> forces = pushes.stated(piece.state);
  piece.contact_forces.insert(piece.contact_forces.begin(), forces.begin(), forces.end());
  piece.mesh = cloth.mesh();
  piece.memory = cloth.memory();
  return piece;
}

bool meets_itself(const PieceDrape& piece) {
  Field nodes(3 * piece.surface.size());
  for (std::size_t i = 0; i < piece.surface.size(); ++i)
    put_at(nodes, static_cast<int>(i), piece.surface[i]);
  return passes_through_itself(facets_of(piece.mesh), nodes);
}

}  // namespace

void fall_to_rest(MeshCloth& cloth, PieceDrape& piece, const std::vector<bool>& held,
                  ObjectPushes& pushes, Pushes& all, TimeStepsOptions motion,
                  const DescentOptions& descent) {
  MeshStiffness stiffness(cloth, held);
  // Where nothing holds by friction a fall chooses folds, and no more is remembered of it.
  if (!pushes.holds() && !cloth.laws().friction) {
    motion.quiet_m = TimeStepsOptions{}.quiet_m;
    motion.residual = 1;
  }
  const auto no_table = [](double) { return -std::numeric_limits<double>::infinity(); };
  const PinsCarried carried(piece, descent.gravity_m_per_s2.norm() / motion.drag_per_s);
  piece.motion = move_in_time(cloth, piece.state, held, stiffness, {}, no_table,
                              carried.arrival_s(), descent, motion, &all, carried);
  int steps = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    DescentOptions now = descent;
    if (!pushes.is_firm()) now.residual = std::max(now.residual, kPassingResidual);
    now.most_steps -= steps;
    piece.report = descend(cloth, piece.state, held, stiffness, {}, now, &all);
    steps += piece.report.steps;
    if (!piece.report.at_rest) break;
    const bool on = pushes.is_firm() && pushes.off_surface_m(piece.state) <= kOn_m;
    piece.report.at_rest = on && piece.report.steps == 0;
    if (piece.report.at_rest) break;
    if (!on) pushes.press_on(piece.state);
  }
  piece.report.steps = steps;
}

ClothOutline outline_of(const Print& print) {
  const Vector2d& p = print.patch_m;
  return {{{0, 0}, {p.x(), 0}, p, {0, p.y()}}, {}, {}, {}};
}

PieceDrape drape_piece(const Scene& scene, const Print& print, const std::optional<Sheet>& measured,
                       const ClothLaws& laws, ClothOutline outline, const PieceOptions& options) {
  if (!scene.clamps.empty())
    throw bad_input("a piece on triangles takes no clamp",
                    {.file = scene.file.string(), .field = "clamp"}, "hold it with [[pin]]");
  if (laws.friction && !scene.start.history.empty())
    throw bad_input("a piece on triangles takes no history",
                    {.file = scene.file.string(), .field = "start.history"},
                    "leave it out, or drape the whole patch with drape simulate");
  check_pins(scene, print, outline);
  check_size(outline, options.spacing_m);
  const Surroundings around(scene);
  const StartState start = start_of(scene, print, measured, around.top_z_m());
  for (const Pin& pin : scene.pins) outline.points.push_back(pin.material_m(print));
  MeshOptions mesh_options;
  mesh_options.spacing_m = options.spacing_m;
  mesh_options.seed = options.seed;
  MeshCloth cloth(triangulated(outline, mesh_options), laws);
  const FlatPose& flat = start.report.flat;
  const Eigen::AngleAxisd turn(flat.yaw_rad, Vector3d::UnitZ());
  const Vector3d along_warp = turn * -Vector3d::UnitY(), along_weft = turn * Vector3d::UnitX();
  PieceDrape piece;
  piece.state = cloth.state_of([&](const Vector2d& p) {
    return MeshCloth::Jet{flat.point_in_world(p, print.patch_m), along_warp, along_weft};
  });
  refuse_inside(scene, ClothSurface(cloth).nodes(piece.state), around);
  std::vector<bool> held(static_cast<std::size_t>(cloth.unknowns()), false);
  piece.pinned_in_world = start.hold_in_world;
  for (std::size_t k = 0; k < scene.pins.size(); ++k) {
    const Vector2d at = outline.points[k];
    const auto& points = cloth.mesh().points_m;
    const auto nearest =
        std::min_element(points.begin(), points.end(), [&](const Vector2d& a, const Vector2d& b) {
          return (a - at).squaredNorm() < (b - at).squaredNorm();
        });
    if ((*nearest - at).norm() > kSame_m)
      throw bad_input(
          fmt::format("the pin at warp {:g}, weft {:g} mm is nearer to another one than "
                      "a mesh of {:g} mm can tell apart",
                      at.x() / mm, at.y() / mm, options.spacing_m / mm),
          {.file = scene.file.string(), .field = "pin"}, "give a finer --spacing-mm");
    piece.pinned.push_back(static_cast<int>(nearest - points.begin()));
    held[piece.pinned.back()] = true;
  }
  PieceDrape drape = dropped(piece, cloth, held, scene, around, options, 0);
  if (options.cloth_thickness_m > 0 && meets_itself(drape))
    drape = dropped(piece, cloth, held, scene, around, options, options.cloth_thickness_m);
  return drape;
}

std::string ply_text(const PieceDrape& piece, const Vector2d& patch_m) {
  const MaterialMesh& mesh = piece.mesh;
  std::vector<Vector2d> uv;
  for (const Vector2d& point : mesh.points_m) uv.push_back(point.cwiseQuotient(patch_m));
  for (const MaterialMesh::Edge& edge : mesh.edges)
    uv.emplace_back(
        ((mesh.points_m[edge.from] + mesh.points_m[edge.to]) / 2).cwiseQuotient(patch_m));
  return ply_text("millimetres, z up; u along the warp, v along the weft", piece.surface, uv,
                  facets_of(mesh));
}

}  // namespace drape::simulate
