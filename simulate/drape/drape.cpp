// SPDX-License-Identifier: Apache-2.0
#include "simulate/drape/drape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/geometry/vectors.hpp"
#include "core/units.hpp"
#include "simulate/contact/layer_pair.hpp"
#include "simulate/drape/pushes.hpp"
#include "simulate/drape/smooth_surface.hpp"
#include "simulate/mesh/mesh_cloth.hpp"
#include "simulate/start/history.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;
using State = MeshCloth::State;

constexpr double kMostPoints = 1e5;  // limit on the points of a mesh
constexpr double kLeastPoints = 16;  // a mesh with fewer cannot drape
constexpr double kSame_m = 1e-6;     // closer material points are the same
constexpr int kMostRounds = 100;     // each round of descents ends with an update of friction
// DescentOptions::passing of time steps of the fall; and of those while contact stiffens and of all
// rounds but the last, between which friction is updated.
constexpr double kFallingResidual = 0.1, kPassingResidual = 1;
constexpr int kCarriedFirmness = 3;  // stage of the pressure law transferred to another mesh
constexpr double kBeside = 1e-6;     // tolerance of barycentric weights at the border of a triangle
constexpr int kMostProducts = 5000;
double no_table(double) {
  return -std::numeric_limits<double>::infinity();
}
constexpr double kLeastRatio = 1.5;  // least ratio of the spacings of two levels

void require_size(const ClothOutline& outline, double spacing_m) {
  const Vector2d size = box_of(outline.outer).sizes();
  const double points = (size / spacing_m).prod();
  if (points < kLeastPoints)
    throw bad_input(fmt::format("the outline holds {:.3g} x {:.3g} mm, fewer than {:g} spacings of "
                                "{:g} mm squared",
                                size.x() / mm, size.y() / mm, kLeastPoints, spacing_m / mm),
                    {.file = outline.file.string()}, "give mm, not cm; or a smaller --spacing-mm");
  if (points <= kMostPoints) return;
  throw usage_error(
      fmt::format("a mesh of {:g} mm would have some {:.0f} points", spacing_m / mm, points),
      fmt::format("give a wider --spacing-mm; up to {:g} points are taken", kMostPoints));
}

MaterialMesh mesh_of_case(const DrapeCase& drape, const DrapeOptions& options, double spacing_m) {
  require_size(drape.outline, spacing_m);
  ClothOutline outline = drape.outline;
  for (const Pin& pin : drape.local.scene.pins)
    outline.points.push_back(pin.material_m(drape.print));
  for (const HeldLine& line : drape.lines) outline.lines.push_back({line.from_m, line.to_m});
  MeshOptions how;
  how.spacing_m = spacing_m;
  how.seed = options.seed;
  return triangulated(outline, how);
}

}  // namespace

/// An unknown fixed by the scene, with its value.
struct HeldUnknown {
  int unknown = 0;
  Vector3d value;
};

/// Finds the triangle that contains a material point, by cells about as large as a triangle.
class TriangleFinder {
 public:
  explicit TriangleFinder(const MaterialMesh& mesh) : mesh_(mesh) {
    const Eigen::AlignedBox2d box = box_of(mesh.points_m);
    cells_ = Cells(box.min(), box.sizes(),
                   std::sqrt(box.sizes().prod() / static_cast<double>(mesh.triangles.size())));
    of_.resize(static_cast<std::size_t>(cells_.count.prod()));
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const Eigen::AlignedBox2d around = box_of({corner(t, 0), corner(t, 1), corner(t, 2)});
      const Eigen::Array2i first = cells_.of(around.min().array() - kSame_m),
                           last = cells_.of(around.max().array() + kSame_m);
      for (int i = first.x(); i <= last.x(); ++i)
        for (int j = first.y(); j <= last.y(); ++j)
          of_[cells_.index(i, j)].push_back(static_cast<int>(t));
    }
  }

  /// Finds the first triangle that contains `p`, with the weights of its corners; nullopt if none.
  [[nodiscard]] std::optional<std::pair<int, Vector3d>> find(const Vector2d& p) const {
    const Eigen::Array2i cell = cells_.of(p);
    std::optional<std::pair<int, Vector3d>> found;
    double best = -kBeside;
    for (const int t : of_[cells_.index(cell.x(), cell.y())]) {
      Vector3d weight;
      for (int k = 0; k < 3; ++k)
        weight[k] =
            cross(corner(t, (k + 2) % 3) - corner(t, (k + 1) % 3), p - corner(t, (k + 1) % 3)) /
            (2 * mesh_.area_m2(t));
      if (weight.minCoeff() <= best) continue;
      best = weight.minCoeff();
      found = {t, weight};
    }
    return found;
  }

 private:
  [[nodiscard]] const Vector2d& corner(std::size_t t, int k) const {
    return mesh_.points_m[mesh_.triangles[t][k]];
  }

  const MaterialMesh& mesh_;
  Cells cells_;
  std::vector<std::vector<int>> of_;
};

namespace {

/// Moves held unknowns from their position on the cloth to their target as fast as cloth sinks.
class HeldCarried {
 public:
  HeldCarried(const std::vector<HeldUnknown>& held, int points, const State& state,
              double speed_m_per_s)
      : held_(held) {
    for (const HeldUnknown& h : held) {
      from_.push_back(state[h.unknown]);
      if (h.unknown < points)
        arrival_s_ = std::max(arrival_s_, (h.value - from_.back()).norm() / speed_m_per_s);
    }
  }
  [[nodiscard]] double arrival_s() const { return arrival_s_; }
  void operator()(double time_s, State& state) const {
    for (std::size_t k = 0; k < held_.size(); ++k)
      state[held_[k].unknown] =
          time_s < arrival_s_
              ? (from_[k] + time_s / arrival_s_ * (held_[k].value - from_[k])).eval()
              : held_[k].value;
  }

 private:
  const std::vector<HeldUnknown>& held_;
  double arrival_s_ = 0;
  std::vector<Vector3d> from_;
};

/// Contact with objects and, if layers repel, of cloth with itself.
class AllPushes : public Pushes {
 public:
  AllPushes(const MeshCloth& cloth, const std::vector<bool>& held, const Surroundings& around,
            double friction, double gravity_m_per_s2, const ClothMoment& moment)
      : objects(cloth, held, around, friction, gravity_m_per_s2) {
    if (moment.contact) objects.take_over(*moment.contact, moment.state);
    if (moment.layers_apart_m <= 0) return;
    layers.emplace(cloth, friction, gravity_m_per_s2, moment.layers_apart_m);
    if (moment.contact) layers->take_over(*moment.contact, moment.state);
  }

  [[nodiscard]] double energy_j(const State& state) override {
    return objects.energy_j(state) + (layers ? layers->energy_j(state) : 0);
  }
  void add_forces(const State& state, State& force) override {
    objects.add_forces(state, force);
    if (layers) layers->add_forces(state, force);
  }
  [[nodiscard]] std::vector<Support> supports(const State& state) override {
    std::vector<Support> found = objects.supports(state);
    if (!layers) return found;
    const std::vector<Support> more = layers->supports(state);
    found.insert(found.end(), more.begin(), more.end());
    return found;
  }
  void add_products(const State& state, const State& direction, State& product) override {
    objects.add_products(state, direction, product);
    if (layers) layers->add_products(state, direction, product);
  }
  void settle(const State& state) override {
    objects.settle(state);
    if (layers) layers->settle(state);
  }
  [[nodiscard]] double clear_part(const State& from, const State& to, bool led) override {
    const double part = objects.clear_part(from, to, led);
    return layers ? std::min(part, layers->clear_part(from, to, led)) : part;
  }
  [[nodiscard]] std::shared_ptr<const ContactMemory> memory() const {
    auto found = std::make_shared<ContactMemory>();
    objects.remember(*found);
    if (layers) layers->remember(*found);
    return found;
  }

  ObjectPushes objects;
  std::optional<LayerPushes> layers;
};

}  // namespace

std::vector<double> level_spacings_m(const DrapeOptions& options) {
  std::vector<double> spacings = {options.spacing_m};
  while (spacings.back() * kLeastRatio <= options.coarsest_m)
    spacings.push_back(std::min(2 * spacings.back(), options.coarsest_m));
  std::reverse(spacings.begin(), spacings.end());
  return spacings;
}

DrapeCase drape_case(const Scene& world, const Print& print, const std::optional<Sheet>& measured,
                     ClothLaws laws, std::optional<ClothOutline> outline) {
  const Vector2d& p = print.patch_m;
  require_sized(print, world);
  DrapeCase drape;
  drape.local = local_scene(world, measured, Surroundings(world).top_z_m());
  drape.print = print;
  drape.laws = std::move(laws);
  const Scene& scene = drape.local.scene;
  drape.outline =
      outline ? std::move(*outline) : ClothOutline{{{0, 0}, {p.x(), 0}, p, {0, p.y()}}, {}, {}};
  drape.around = std::make_shared<Surroundings>(scene, kClosed_m);
  refuse_pins_beside(scene, print, drape.outline);
  drape.pins_at = pin_places(scene, print, drape.local.measured);
  drape.lines = held_lines(scene, print, drape.outline);
  if (scene.start.mode == StartMode::measured)
    drape.shape = measured_shape(scene, drape.local.measured, print, *drape.around);
  else
    refuse_flat_start_inside(scene, print, drape.outline, *drape.around);
  return drape;
}

struct DrapeLevel::Parts {
  const DrapeCase& drape;
  DrapeOptions options;
  double spacing_m;
  MeshCloth cloth;
  ClothMemory fresh;  ///< friction state of cloth without any slip
  ClothSurface surface;
  TriangleFinder finder;
  std::vector<int> pinned;
  std::vector<HeldUnknown> values;  ///< values of held unknowns
  std::vector<bool> held;
  std::unique_ptr<MeshStiffness> stiffness;
  Vector3d gravity;
  double friction;

  Parts(const DrapeCase& of, const DrapeOptions& how, double spacing)
      : drape(of),
        options(how),
        spacing_m(spacing),
        cloth(mesh_of_case(of, how, spacing), of.laws),
        fresh(cloth.memory()),
        surface(cloth),
        finder(cloth.mesh()),
        held(static_cast<std::size_t>(cloth.unknowns()), false),
        gravity(of.local.scene.gravity_m_per_s2),
        friction(of.local.scene.friction) {
    hold_pins();
    for (const HeldLine& line : of.lines) hold_line(line);
    stiffness = std::make_unique<MeshStiffness>(cloth, held);
  }

  void hold_pins() {
    const Scene& scene = drape.local.scene;
    for (std::size_t k = 0; k < scene.pins.size(); ++k) {
      const Vector2d at = scene.pins[k].material_m(drape.print);
      const auto& points = cloth.mesh().points_m;
      const auto nearest =
          std::min_element(points.begin(), points.end(), [&](const Vector2d& a, const Vector2d& b) {
            return (a - at).squaredNorm() < (b - at).squaredNorm();
          });
      if ((*nearest - at).norm() > kSame_m)
        throw bad_input(
            fmt::format("the pin at warp {:g}, weft {:g} mm is nearer to another one than "
                        "a mesh of {:g} mm can tell apart",
                        at.x() / mm, at.y() / mm, spacing_m / mm),
            {.file = scene.file.string(), .field = "pin"}, "give a finer --spacing-mm");
      pinned.push_back(static_cast<int>(nearest - points.begin()));
      hold(pinned.back(), drape.pins_at[k]);
    }
  }

  /// Holds the points on the line, and the derivative across it at the edges there.
  void hold_line(const HeldLine& line) {
    const MaterialMesh& mesh = cloth.mesh();
    for (int i = 0; i < cloth.points(); ++i)
      if (line.holds(mesh.points_m[i])) hold(i, line.place(mesh.points_m[i]));
    for (int e = 0; e < static_cast<int>(mesh.edges.size()); ++e) {
      if (!line.holds(mesh.points_m[mesh.edges[e].from]) ||
          !line.holds(mesh.points_m[mesh.edges[e].to]))
        continue;
      const Vector2d n = cloth.normal_of(e);
      hold(cloth.points() + e, line.x_u * n.x() + line.x_v * n.y());
    }
  }

  void hold(int unknown, const Vector3d& value) {
    if (held[unknown]) return;
    held[unknown] = true;
    values.push_back({unknown, value});
  }

  /// Material coordinates of the surface's nodes.
  [[nodiscard]] std::vector<Vector2d> material_of_nodes() const {
    std::vector<Vector2d> found;
    for (int i = 0; i < cloth.unknowns(); ++i) found.push_back(cloth.material_m(i));
    return found;
  }

  [[nodiscard]] State state_of(const SmoothSurface& shape) const {
    return cloth.state_of([&](const Vector2d& p) { return shape.at(p); });
  }

  [[nodiscard]] AllPushes pushes_of(const ClothMoment& moment, double friction_factor = 1) const {
    return {cloth, held, *drape.around, friction_factor * friction, gravity.norm(), moment};
  }

  [[nodiscard]] DescentOptions descent() const {
    DescentOptions how = options.descent;
    how.gravity_m_per_s2 = gravity;
    return how;
  }

  /// Restores the friction state before changing a moment.
  void begin(const ClothMoment& moment) { cloth.remember(moment.memory); }
  void end(ClothMoment& moment, const AllPushes& pushes) const {
    moment.memory = cloth.memory();
    moment.contact = pushes.memory();
  }

  /// Solves H x = change for the free unknowns. nullopt if H is not positive definite.
  [[nodiscard]] std::optional<State> solved(const State& state, AllPushes& pushes, State change,
                                            double residual) {
    const auto let_go = [&](State& of) {
      for (const HeldUnknown& h : values) of[h.unknown].setZero();
    };
    let_go(change);
    const ClothTangent tangent(cloth, state);
    State found;
    const ConjugateGradients end = conjugate_gradients(
        *stiffness,
        [&](const State& direction, State& product) {
          std::fill(product.begin(), product.end(), Vector3d::Zero());
          tangent.add_products(direction, product);
          pushes.add_products(state, direction, product);
          let_go(product);
        },
        [&](double norm, const State&) { return norm <= residual; }, kMostProducts, change, found);
    return end.solved ? std::optional(std::move(found)) : std::nullopt;
  }

  /// Stiffens contact in stages, with a time step for each, so that friction follows the motion in
  /// between.
  void firm_in_time(ClothMoment& moment, AllPushes& pushes, const DescentOptions& how,
                    TimeStepsOptions motion, TimeStepsReport& report) {
    motion.longest_s = motion.step_s = std::max(motion.step_s, motion.longest_step_s);
    DescentOptions now = how;
    now.passing = kPassingResidual;
    while (!pushes.objects.is_firm()) {
      pushes.objects.make_firmer(moment.state);
      const TimeStepsReport found = move_in_time(cloth, moment.state, held, *stiffness, {},
                                                 no_table, 0, now, motion, &pushes);
      report.increments += found.increments;
      report.steps += found.steps;
    }
  }

  /// Relaxes in rounds of descents, each a load increment that ends with an update of friction,
  /// until an update changes nothing.
  void descend_to_rest(ClothMoment& moment, AllPushes& pushes, const DescentOptions& how,
                       RestReport& report) {
    // Without friction there is nothing to update.
    const bool settles = pushes.objects.holds() || drape.laws.friction;
    stiffness->outdate();
    for (int round = 0; round < kMostRounds; ++round) {
      DescentOptions now = how;
      now.passing = settles ? kPassingResidual : 0;
      now.most_steps -= report.steps;
      report.descent = descend(cloth, moment.state, held, *stiffness, {}, now, &pushes);
      report.steps += report.descent.steps;
      if (!report.descent.at_rest) {
        report.why = report.steps >= how.most_steps
                         ? fmt::format(
                               "no rest after {} steps: forces of {:.3g} mean weights of a "
                               "point are left",
                               report.steps, report.descent.residual)
                         : fmt::format(
                               "descent stagnates at forces of {:.3g} mean weights of a "
                               "point",
                               report.descent.residual);
        return;
      }
      report.at_rest = report.descent.steps == 0;
      if (report.at_rest) return;
    }
    report.why = fmt::format("friction does not settle in {} rounds", kMostRounds);
  }
};

DrapeLevel::DrapeLevel(const DrapeCase& drape, const DrapeOptions& options, double spacing_m)
    : parts_(std::make_unique<Parts>(drape, options, spacing_m)) {}
DrapeLevel::~DrapeLevel() = default;

const DrapeCase& DrapeLevel::drape() const {
  return parts_->drape;
}
const MeshCloth& DrapeLevel::cloth() const {
  return parts_->cloth;
}
double DrapeLevel::spacing_m() const {
  return parts_->spacing_m;
}
const std::vector<bool>& DrapeLevel::held() const {
  return parts_->held;
}
const std::vector<int>& DrapeLevel::pinned() const {
  return parts_->pinned;
}
const std::vector<Vector3d>& DrapeLevel::pinned_at() const {
  return parts_->drape.pins_at;
}
double DrapeLevel::mass_kg() const {
  const std::vector<double>& mass = parts_->cloth.mass_kg();
  return std::accumulate(mass.begin(), mass.end(), 0.0);
}

void DrapeLevel::set_gravity(const Vector3d& gravity_m_per_s2) {
  parts_->gravity = gravity_m_per_s2;
}
void DrapeLevel::set_friction(double coefficient) {
  parts_->friction = coefficient;
}

ClothMoment DrapeLevel::start(const StartVariation& variation) const {
  const DrapeCase& drape = parts_->drape;
  const Scene& scene = drape.local.scene;
  if (drape.shape) {
    std::vector<Vector3d> places = drape.shape->places;
    vary(variation, places);
    return start_at(drape.shape->material_m, places);
  }
  const FlatPose flat{scene.start.centre_in_world.value_or(Vector3d::Zero()), scene.start.yaw_rad};
  const Eigen::Rotation2Dd turn(flat.yaw_rad);
  const Vector2d warp = turn * -Vector2d::UnitY(), weft = turn * Vector2d::UnitX();
  ClothMoment moment;
  moment.state = parts_->cloth.state_of([&](const Vector2d& p) {
    return MeshCloth::Jet{flat.point_in_world(p, drape.print.patch_m),
                          {warp.x(), warp.y(), 0},
                          {weft.x(), weft.y(), 0}};
  });
  State places = surface(moment);
  const State before = places;
  vary(variation, places);
  if (places != before)
    moment.state = parts_->state_of(SmoothSurface(parts_->material_of_nodes(), places));
  moment.memory = parts_->fresh;
  return moment;
}

ClothMoment DrapeLevel::start_at(const std::vector<Vector2d>& material_m,
                                 const std::vector<Vector3d>& places) const {
  ClothMoment moment;
  moment.state = parts_->state_of(SmoothSurface(material_m, places));
  for (const HeldUnknown& h : parts_->values) moment.state[h.unknown] = h.value;
  moment.memory = parts_->fresh;
  return moment;
}

ClothMoment DrapeLevel::carried(const DrapeLevel& from, const ClothMoment& rest) const {
  ClothMoment moment = start_at(from.parts_->material_of_nodes(), from.surface(rest));
  if (parts_->drape.laws.friction) {
    from.parts_->cloth.remember(rest.memory);
    parts_->cloth.take_over(from.parts_->cloth, rest.state, moment.state);
  }
  moment.memory = parts_->cloth.memory();
  if (rest.contact) {
    auto memory = std::make_shared<ContactMemory>(*rest.contact);
    memory->firmness = std::min(memory->firmness, kCarriedFirmness);
    moment.contact = std::move(memory);
  }
  moment.layers_apart_m = rest.layers_apart_m;
  return moment;
}

RestReport DrapeLevel::fall(ClothMoment& moment, const StartVariation& variation) {
  Parts& my = *parts_;
  my.begin(moment);
  AllPushes pushes = my.pushes_of(moment, variation.friction_factor);
  const DescentOptions descent = my.descent();
  TimeStepsOptions motion = my.options.motion;
  motion.drag_per_s *= variation.drag_factor;
  // Without friction a fall only selects folds; its other effects are discarded.
  if (!pushes.objects.holds() && !my.drape.laws.friction) {
    motion.quiet_m = TimeStepsOptions{}.quiet_m;
    motion.residual = 1;
  }
  const HeldCarried carried(my.values, my.cloth.points(), moment.state,
                            my.gravity.norm() / motion.drag_per_s);
  RestReport report;
  DescentOptions falling = descent;
  falling.passing = kFallingResidual;
  report.motion = move_in_time(my.cloth, moment.state, my.held, *my.stiffness, {}, no_table,
                               carried.arrival_s(), falling, motion, &pushes, carried);
  my.firm_in_time(moment, pushes, descent, motion, report.motion);
  my.descend_to_rest(moment, pushes, descent, report);
  my.end(moment, pushes);
  return report;
}

RestReport DrapeLevel::rest(ClothMoment& moment, std::optional<double> residual) {
  Parts& my = *parts_;
  my.begin(moment);
  AllPushes pushes = my.pushes_of(moment);
  DescentOptions descent = my.descent();
  if (residual) descent.residual = *residual;
  RestReport report;
  my.firm_in_time(moment, pushes, descent, my.options.motion, report.motion);
  my.descend_to_rest(moment, pushes, descent, report);
  my.end(moment, pushes);
  return report;
}

double DrapeLevel::energy_j(const ClothMoment& moment) const {
  Parts& my = *parts_;
  my.begin(moment);
  double sum =
      my.cloth.energies(moment.state).sum_j() + my.pushes_of(moment).energy_j(moment.state);
  for (int i = 0; i < my.cloth.points(); ++i)
    sum -= my.cloth.mass_kg()[i] * my.gravity.dot(moment.state[i]);
  return sum;
}

State DrapeLevel::surface(const ClothMoment& moment) const {
  return parts_->surface.nodes(moment.state);
}

Eigen::MatrixX3d DrapeLevel::places(const ClothMoment& moment,
                                    const std::vector<Vector2d>& material_m) const {
  const State nodes = surface(moment);
  const MaterialMesh& mesh = parts_->cloth.mesh();
  Eigen::MatrixX3d found(static_cast<Eigen::Index>(material_m.size()), 3);
  for (std::size_t i = 0; i < material_m.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    found.row(row).setConstant(std::numeric_limits<double>::quiet_NaN());
    const auto at = parts_->finder.find(material_m[i]);
    if (!at) continue;
    const auto& [triangle, w] = *at;
    Vector3d sum = Vector3d::Zero();
    for (int k = 0; k < 3; ++k)
      sum += w[k] * (2 * w[k] - 1) * nodes[mesh.triangles[triangle][k]] +
             4 * w[(k + 1) % 3] * w[(k + 2) % 3] *
                 nodes[parts_->cloth.points() + mesh.edges_of[triangle][k]];
    found.row(row) = sum.transpose();
  }
  return found;
}

std::vector<ContactForce> DrapeLevel::contact_forces(const ClothMoment& moment) const {
  AllPushes pushes = parts_->pushes_of(moment);
  std::vector<ContactForce> forces = pushes.objects.stated(moment.state);
  if (!pushes.layers) return forces;
  const auto of_layers = pushes.layers->stated(moment.state, parts_->drape.around->count());
  forces.insert(forces.end(), of_layers.begin(), of_layers.end());
  return forces;
}

CertificateStrains DrapeLevel::strains(const ClothMoment& moment) const {
  CertificateStrains found;
  constexpr double kNone = std::numeric_limits<double>::infinity();
  found.warp = found.weft = {kNone, -kNone};
  for (const Vector3d& metric : parts_->cloth.metrics(moment.state)) {
    const MetricStrain strain(metric);
    found.warp = {std::min(found.warp.x(), strain.a - 1), std::max(found.warp.y(), strain.a - 1)};
    found.weft = {std::min(found.weft.x(), strain.b - 1), std::max(found.weft.y(), strain.b - 1)};
    found.shear_most_rad = std::max(found.shear_most_rad, std::abs(strain.angle()));
  }
  for (const MeshCloth::Triangle& t : parts_->cloth.triangles())
    for (const auto* second : {&t.d_uu, &t.d_vv})
      found.curvature_most_per_m =
          std::max(found.curvature_most_per_m, combined(*second, t.unknown, moment.state).norm());
  return found;
}

bool DrapeLevel::meets_itself(const ClothMoment& moment) const {
  return passes_through_itself(parts_->surface.facets(), surface(moment));
}

State DrapeLevel::forces(const ClothMoment& moment) const {
  Parts& my = *parts_;
  my.begin(moment);
  State force(moment.state.size(), Vector3d::Zero());
  my.cloth.add_forces(moment.state, force);
  for (int i = 0; i < my.cloth.points(); ++i) force[i] += my.cloth.mass_kg()[i] * my.gravity;
  my.pushes_of(moment).add_forces(moment.state, force);
  return force;
}

std::optional<std::vector<State>> DrapeLevel::first_order(const ClothMoment& rest,
                                                          const std::vector<State>& force_changes,
                                                          double residual) {
  Parts& my = *parts_;
  my.begin(rest);
  AllPushes pushes = my.pushes_of(rest);
  if (!my.stiffness->factorise(rest.state, pushes.supports(rest.state))) return std::nullopt;
  std::vector<State> all;
  for (const State& change : force_changes) {
    auto found = my.solved(rest.state, pushes, change, residual);
    if (!found) return std::nullopt;
    all.push_back(std::move(*found));
  }
  return all;
}

std::optional<double> mean_apart_m(const Eigen::MatrixX3d& a, const Eigen::MatrixX3d& b) {
  double sum = 0;
  int count = 0;
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    const double apart = (a.row(i) - b.row(i)).norm();
    if (std::isnan(apart)) continue;
    sum += apart;
    ++count;
  }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

namespace {

// See mesh_error_m().
constexpr double kSafety = 1.25, kSafetyUnseen = 3, kOrder = 2, kOrderSpread = 0.2;
constexpr double kLeastShrunk = 2, kMostShrunk = 4;
constexpr double kCoarseResidual = 1e-2;  // in mean weights of a point

/// Builds up a drape level by level.
class Levels {
 public:
  Levels(const DrapeCase& drape, const DrapeOptions& options, const StartVariation& variation,
         const DrapeProgress& progress, const DrapeStart& start)
      : case_(drape),
        options_(options),
        variation_(variation),
        progress_(progress),
        start_(start),
        spacings_(level_spacings_m(options)) {
    for (int row = 0; row < drape.print.rows; ++row)
      for (int col = 0; col < drape.print.cols; ++col) {
        marks_.push_back({row, col});
        material_m_.push_back(drape.print.material_m(marks_.back()));
      }
  }

  [[nodiscard]] Drape from_start() {
    Drape drape = fallen(0);
    if (options_.thickness_m > 0 && drape.level->meets_itself(drape.rest))
      drape = fallen(options_.thickness_m);
    while (drape.at_rest() && drape.levels.size() < spacings_.size()) {
      refine(drape);
      // A finer cloth may fold where a coarser one did not.
      if (drape.rest.layers_apart_m == 0 && options_.thickness_m > 0 &&
          drape.level->meets_itself(drape.rest))
        drape = fallen(options_.thickness_m);
    }
    finish(drape);
    return drape;
  }

  [[nodiscard]] Drape from_rest(std::shared_ptr<DrapeLevel> coarse, const ClothMoment& rest) {
    Drape drape;
    RestReport known;
    known.at_rest = true;
    add(drape, std::move(coarse), rest, known);
    std::erase_if(spacings_, [&](double s) { return !(s < drape.level->spacing_m()); });
    spacings_.insert(spacings_.begin(), drape.level->spacing_m());
    while (drape.at_rest() && drape.levels.size() < spacings_.size()) refine(drape);
    finish(drape);
    return drape;
  }

 private:
  /// Makes a mesh; before a finer one, its residual need only be small against its mesh error.
  [[nodiscard]] std::shared_ptr<DrapeLevel> level_of(std::size_t index) const {
    DrapeOptions options = options_;
    if (index + 1 < spacings_.size())
      options.descent.residual = std::max(options.descent.residual, kCoarseResidual);
    return std::make_shared<DrapeLevel>(case_, options, spacings_[index]);
  }

  /// Drapes from the start to equilibrium on the coarsest mesh, after the cloth's earlier history.
  Drape fallen(double layers_apart_m) {
    auto level = level_of(0);
    const ClothMoment start = start_ ? start_(*level) : level->start(variation_);
    const auto drape_with = [&](const ClothMemory& memory) {
      ClothMoment moment = start;
      moment.memory = memory;
      moment.layers_apart_m = layers_apart_m;
      RestReport report = level->fall(moment, variation_);
      return std::pair(std::move(moment), std::move(report));
    };
    Drape drape;
    drape.warnings = warnings_of_clamps(case_.lines);
    if (case_.shape)
      drape.warnings.insert(drape.warnings.end(), case_.shape->warnings.begin(),
                            case_.shape->warnings.end());
    ClothMemory memory = start.memory;
    std::vector<PastEvent> history;
    if (case_.laws.friction) history = history_of(case_.local.scene);
    if (!history.empty()) {
      int number = 0;
      std::optional<std::pair<ClothMoment, RestReport>> failed;
      const auto after = memory_after(history, *case_.laws.friction, memory,
                                      [&](const ClothMemory& so_far) -> std::optional<ClothMemory> {
                                        ++number;
                                        auto once = drape_with(so_far);
                                        if (once.second.at_rest) return once.first.memory;
                                        failed = std::move(once);
                                        return std::nullopt;
                                      });
      if (!after) {
        drape.warnings.push_back(not_at_rest_before(number));
        add(drape, level, failed->first, failed->second);
        return drape;
      }
      memory = *after;
    }
    auto [moment, report] = drape_with(memory);
    shake(*level, shakes_of(history), moment, report);
    add(drape, level, moment, report);
    return drape;
  }

  /// Varies gravity up and down in equilibrium, ending at its normal value.
  void shake(DrapeLevel& level, const PastEvent& shakes, ClothMoment& moment,
             RestReport& report) const {
    std::vector<double> loads;
    for (int k = 0; k < shakes.times; ++k)
      loads.insert(loads.end(), {1 + shakes.part, 1 - shakes.part});
    if (shakes.times > 0) loads.push_back(1);
    const Vector3d gravity = case_.local.scene.gravity_m_per_s2;
    for (const double load : loads) {
      if (!report.at_rest) break;
      level.set_gravity(load * gravity);
      const TimeStepsReport motion = report.motion;
      const int steps = report.steps;
      report = level.rest(moment);
      report.motion = motion;
      report.steps += steps;
    }
    level.set_gravity(gravity);
  }

  void refine(Drape& drape) const {
    auto level = level_of(drape.levels.size());
    ClothMoment moment = level->carried(*drape.level, drape.rest);
    RestReport report = level->rest(moment);
    add(drape, std::move(level), std::move(moment), std::move(report));
  }

  void add(Drape& drape, std::shared_ptr<DrapeLevel> level, ClothMoment moment,
           RestReport report) const {
    LevelReport own{level->spacing_m(), level->cloth().points(), std::move(report), {}};
    Eigen::MatrixX3d marks = level->places(moment, material_m_);
    if (!drape.marks_of_level.empty())
      own.moved_m = mean_apart_m(marks, drape.marks_of_level.back());
    drape.levels.push_back(std::move(own));
    drape.marks_of_level.push_back(std::move(marks));
    drape.level = std::move(level);
    drape.rest = std::move(moment);
    if (progress_)
      progress_(std::min(
          1.0, static_cast<double>(drape.levels.size()) / static_cast<double>(spacings_.size())));
  }

  /// Drops marks that are not on the cloth, and estimates the error of the last mesh.
  void finish(Drape& drape) const {
    const bool jumped = drape.at_rest() && jumped_last(drape);
    std::vector<Eigen::Index> on;
    for (Eigen::Index i = 0; i < std::ssize(marks_); ++i) {
      if (drape.marks_of_level.back().row(i).hasNaN()) continue;
      on.push_back(i);
      drape.marks.push_back(marks_[i]);
    }
    for (Eigen::MatrixX3d& marks : drape.marks_of_level) marks = marks(on, Eigen::all).eval();
    if (drape.levels.size() < 2) return;
    drape.mesh_error_m = simulate::mesh_error_m(case_, drape.levels, drape.marks_of_level, jumped);
  }

  /// Tells whether the last refinement jumped to another branch, and then replaces the marks of the
  /// mesh before by those of the finest branch there. A refinement that moves the marks by at most
  /// half of the move before (first order), and not farther than its spacing, is taken for none.
  /// Else the finest cloth is carried back to rest on the mesh before: it jumped if it comes nearer
  /// than it went, and if both rests on that mesh are farther apart than both meshes.
  [[nodiscard]] bool jumped_last(Drape& drape) const {
    const LevelReport* const last = &drape.levels.back();
    if (drape.levels.size() < 2 || !last->moved_m) return false;
    const bool shrinks =
        drape.levels.size() == 2 || kLeastShrunk * *last->moved_m <= last[-1].moved_m.value_or(0);
    if (shrinks && *last->moved_m <= last->spacing_m) return false;
    const auto coarser = level_of(drape.levels.size() - 2);
    ClothMoment moment = coarser->carried(*drape.level, drape.rest);
    if (!coarser->rest(moment).at_rest) return false;
    const Eigen::MatrixX3d own = coarser->places(moment, material_m_);
    Eigen::MatrixX3d& through = *(drape.marks_of_level.end() - 2);
    const auto meshes_m = mean_apart_m(own, drape.marks_of_level.back()),
               rests_m = mean_apart_m(own, through);
    if (!meshes_m || *meshes_m >= std::min(*last->moved_m, rests_m.value_or(0))) return false;
    through = own;
    return true;
  }

  const DrapeCase& case_;
  const DrapeOptions& options_;
  const StartVariation& variation_;
  const DrapeProgress& progress_;
  const DrapeStart& start_;
  std::vector<double> spacings_;
  std::vector<MarkId> marks_;
  std::vector<Vector2d> material_m_;  ///< of each mark
};

/// Ratio of a mark's moves between successive pairs of three meshes, for an error proportional to
/// spacing^order.
double ratio_of_moves(const LevelReport* three, double order) {
  const auto error = [&](int k) { return std::pow(three[k].spacing_m, order); };
  return (error(0) - error(1)) / (error(1) - error(2));
}

}  // namespace

Eigen::VectorXd mesh_error_m(const DrapeCase& drape, const std::vector<LevelReport>& levels,
                             const std::vector<Eigen::MatrixX3d>& marks_of_level, bool jumped) {
  const Eigen::MatrixX3d &finest = marks_of_level.back(), &coarser = *(marks_of_level.end() - 2);
  const double last = mean_apart_m(finest, coarser).value_or(0);
  const bool pinned = !drape.pins_at.empty(), held = pinned || !drape.lines.empty();
  double shrunk = pinned || jumped ? kLeastShrunk : kMostShrunk, safety = kSafetyUnseen;
  if (levels.size() > 2 && last > 0 && !jumped) {
    const LevelReport* const three = &*(levels.end() - 3);
    const double seen = three[1].moved_m.value_or(0) / last;
    if (!pinned) shrunk = std::clamp(seen, kLeastShrunk, kMostShrunk);
    if (!held && seen >= ratio_of_moves(three, kOrder - kOrderSpread) &&
        seen <= ratio_of_moves(three, kOrder + kOrderSpread))
      safety = kSafety;
  }
  return safety / (shrunk - 1) * (finest - coarser).rowwise().norm().cwiseMax(last / 2);
}

Drape drape_cloth(const DrapeCase& drape, const DrapeOptions& options,
                  const StartVariation& variation, const DrapeProgress& progress,
                  const DrapeStart& start) {
  return Levels(drape, options, variation, progress, start).from_start();
}

Drape polished(const DrapeCase& drape, const DrapeOptions& options,
               std::shared_ptr<DrapeLevel> coarse, const ClothMoment& rest) {
  return Levels(drape, options, {}, {}, {}).from_rest(std::move(coarse), rest);
}

}  // namespace drape::simulate
