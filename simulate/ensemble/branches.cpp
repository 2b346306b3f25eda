// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/branches.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/geometry/outline.hpp"
#include "core/parallel.hpp"
#include "core/statistics/sample.hpp"
#include "simulate/checker/certify.hpp"
#include "simulate/ensemble/bands.hpp"
#include "simulate/start/start.hpp"

namespace drape::simulate {
namespace {

using Eigen::Index;
using Eigen::MatrixX3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Median plus three robust standard deviations.
double outlier_limit(std::vector<double> values) {
  const double middle = median(values);
  for (double& value : values) value = std::abs(value - middle);
  return middle + 3 * 1.4826 * median(values);
}

/// An edge of a spanning tree.
struct Edge {
  int from = 0, to = 0;
  double length = 0;
};

/// Minimum spanning tree (Prim 1957).
std::vector<Edge> spanning_tree(int count, const std::function<double(int, int)>& distance) {
  std::vector<Edge> tree, nearest;
  for (int i = 1; i < count; ++i) nearest.push_back({0, i, distance(0, i)});
  while (!nearest.empty()) {
    const auto next =
        std::min_element(nearest.begin(), nearest.end(),
                         [](const Edge& a, const Edge& b) { return a.length < b.length; });
    const Edge edge = *next;
    nearest.erase(next);
    tree.push_back(edge);
    for (Edge& other : nearest) {
      const double length = distance(edge.to, other.to);
      if (length < other.length) other = {edge.to, other.to, length};
    }
  }
  return tree;
}

constexpr double kFold = 3e-3;  // m; least prominence of a fold
constexpr int kHemSamples = 256;

/// Nodes of the surface along the hem in order: corners and the midpoints of the edges between
/// them.
std::vector<int> border_nodes(const MaterialMesh& mesh) {
  const std::vector<int> corners = border_of(mesh);
  std::vector<int> nodes;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const std::pair<int, int> ends = std::minmax({corners[k], corners[(k + 1) % corners.size()]});
    const auto side = std::lower_bound(mesh.edges.begin(), mesh.edges.end(), ends,
                                       [](const MaterialMesh::Edge& edge, const auto& key) {
                                         return std::pair(edge.from, edge.to) < key;
                                       });
    nodes.push_back(corners[k]);
    nodes.push_back(static_cast<int>(mesh.points_m.size()) +
                    static_cast<int>(side - mesh.edges.begin()));
  }
  return nodes;
}

constexpr double kSameAxis = 1e-6;  // m; largest offset of coaxial objects
constexpr int kBatch = 8, kMostStarts = 32;

std::optional<Vector2d> axis_of(const Obstacle& obstacle) {
  if (const auto* sphere = std::get_if<Sphere>(&obstacle)) return sphere->centre_in_world.head<2>();
  if (const auto* body = std::get_if<Cylinder>(&obstacle)) {
    const Vector3d axis = body->world_from_cylinder.rotation.col(2);
    if (axis.head<2>().norm() < kSameAxis) return body->world_from_cylinder.translation_m.head<2>();
  }
  return std::nullopt;
}

/// True if all objects are symmetric about one vertical axis.
bool is_round(const Scene& scene) {
  if (!scene.pins.empty() || !scene.clamps.empty()) return false;
  std::optional<Vector2d> common;
  for (const Obstacle& obstacle : scene.obstacles) {
    const std::optional<Vector2d> axis = axis_of(obstacle);
    if (!axis || (common && (*axis - *common).norm() > kSameAxis)) return false;
    common = axis;
  }
  return common.has_value() && scene.gravity_m_per_s2.head<2>().isZero(0);
}

/// Distance after the best rotation about the vertical and horizontal shift.
double distance_after_turn(const MatrixX3d& a, const MatrixX3d& b) {
  const Eigen::RowVector3d middle_a = a.colwise().mean(), middle_b = b.colwise().mean();
  const MatrixX3d p = a.rowwise() - middle_a;
  MatrixX3d q = b.rowwise() - middle_b;
  const double dot = q.leftCols<2>().cwiseProduct(p.leftCols<2>()).sum();
  const double cross = q.col(0).dot(p.col(1)) - q.col(1).dot(p.col(0));
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(std::atan2(cross, dot)).toRotationMatrix();
  q.leftCols<2>() = (q.leftCols<2>() * turn.transpose()).eval();
  q.col(2).array() += middle_b.z() - middle_a.z();
  return (p - q).rowwise().norm().mean();
}

/// Rows of the marks that are on the cloth.
MatrixX3d rows_on_cloth(const MatrixX3d& places) {
  std::vector<Index> rows;
  for (Index k = 0; k < places.rows(); ++k)
    if (places.row(k).allFinite()) rows.push_back(k);
  return places(rows, Eigen::all);
}

/// Mean distance of the measured marks from their positions on the cloth; nullopt without any.
std::optional<double> from_measured_m(const DrapeLevel& level, const ClothMoment& moment) {
  const std::optional<Sheet>& measured = level.drape().local.measured;
  if (!measured) return std::nullopt;
  std::vector<Vector2d> material_m;
  MatrixX3d there_m(measured->marks.size(), 3);
  for (const SheetMark& mark : measured->marks) {
    there_m.row(std::ssize(material_m)) = mark.point_in_world;
    material_m.push_back(mark.material_m);
  }
  return mean_apart_m(level.places(moment, material_m), there_m);
}

/// True if a small change of forces has a first-order solution: the equilibrium is stable.
bool is_stable(DrapeLevel& level, const ClothMoment& moment) {
  MeshCloth::State change(static_cast<std::size_t>(level.cloth().unknowns()), Vector3d::Zero());
  for (int i = 0; i < level.cloth().points(); ++i) {
    const double t = i;  // excites all directions and wavelengths
    change[i] =
        level.cloth().mass_kg()[i] * Vector3d(std::sin(t), std::sin(t * t), std::cos(2 * t));
  }
  return level.first_order(moment, {change}).has_value();
}

EnsembleCase with_friction(const EnsembleCase& own, double coefficient) {
  return own.with([&](Scene& scene) { scene.friction = coefficient; });
}

Member member_of(const EnsembleCase& coarse, int start, StartVariation variation,
                 const DrapeStart& begin = {}) {
  const EnsembleCase own =
      with_friction(coarse, coarse.scene.friction * std::exchange(variation.friction_factor, 1.0));
  Member member;
  member.start = start;
  member.friction = own.scene.friction;
  member.drape = drape_cloth(*own.drape, own.options.drape, variation, {}, begin);
  DrapeLevel& level = *member.drape.level;
  const ClothMoment& rest = member.drape.rest;
  member.ending = own.ending_of(level, rest, member.drape.levels.back().rest);
  if (member.rests()) {
    member.energy_j = level.energy_j(rest);
    member.mass_kg = level.mass_kg();
    member.hem = label_hem(level, rest);
    member.marks = rows_on_cloth(member.drape.marks_of_level.back());
    member.from_measured_m = from_measured_m(level, rest);
  }
  member.drape.level.reset();
  return member;
}

/// Groups the members at rest into branches.
void group(Ensemble& ensemble, double least_m) {
  const std::vector<Member>& members = ensemble.members;
  std::vector<int> rests;
  for (std::size_t k = 0; k < members.size(); ++k)
    if (members[k].rests()) rests.push_back(static_cast<int>(k));
  std::stable_sort(rests.begin(), rests.end(),
                   [&](int a, int b) { return members[a].energy_j < members[b].energy_j; });
  const auto apart_m = [&](int a, int b) {
    return mean_distance_m(members[rests[a]].marks, members[rests[b]].marks, ensemble.round);
  };
  const Linkage linkage = link(static_cast<int>(rests.size()), apart_m, least_m);
  ensemble.linked_m = linkage.limit;
  ensemble.branches.clear();
  for (std::size_t k = 0; k < rests.size(); ++k) {
    const auto branch = static_cast<std::size_t>(linkage.group[k]);
    if (branch == ensemble.branches.size()) ensemble.branches.emplace_back();
    ensemble.branches[branch].push_back(rests[k]);
  }
  for (std::vector<int>& branch : ensemble.branches)
    std::stable_partition(branch.begin(), branch.end(),
                          [&](int k) { return members[k].start == 0; });
  std::stable_sort(ensemble.branches.begin(), ensemble.branches.end(),
                   [&](const std::vector<int>& a, const std::vector<int>& b) {
                     return members[a.front()].energy_j < members[b.front()].energy_j;
                   });
}

/// True if the last batch of starts found a new branch; for the first batch, a second one.
bool brought_new(const Ensemble& ensemble) {
  const int before = ensemble.starts - kBatch;
  int fresh = 0;
  for (const std::vector<int>& branch : ensemble.branches)
    fresh += std::all_of(branch.begin(), branch.end(), [&](int k) { return k >= before; });
  return fresh > (before > 0 ? 0 : 1);
}

constexpr double kTurn = 1.2;    // rad; tilt of a hanging half; vertical halves would meet
constexpr double kRound = 0.05;  // radius of the fold, relative to the pins' distance in the cloth
constexpr double kHigh = 0.1;    // height of waves, relative to that distance
constexpr double kSteep = 1e-3;  // least horizontal component of the pins' direction

/// The line through the pins, on the cloth and in space.
struct Line {
  Vector2d from_m, along_m, across_m;
  Vector3d from, along, across, down;
  double length_m = 0;
};

/// True if there is enough cloth to hang on each side.
bool parts(const Line& line, const ClothOutline& outline) {
  double least = 0, most = 0;
  for (const Vector2d& corner : outline.outer) {
    const double d = (corner - line.from_m).dot(line.across_m);
    least = std::min(least, d);
    most = std::max(most, d);
  }
  return std::min(most, -least) > kRound * line.length_m;
}

/// Position of a material point. `halves`: number of half waves along the fold between the pins;
/// its sign selects the side.
Vector3d folded(const Line& line, bool left, bool right, int halves, const Vector2d& material_m) {
  const double round_m = kRound * line.length_m;
  const Vector2d from_pin = material_m - line.from_m;
  const double s = from_pin.dot(line.along_m), d = from_pin.dot(line.across_m);
  const double between = std::clamp(s / line.length_m, 0.0, 1.0);
  const double turn = (d < 0 ? left : right) ? kTurn : 0.0, far = std::abs(d);
  const double bent = std::min(far / round_m, turn), straight = far - round_m * bent;
  const double out = round_m * std::sin(bent) + straight * std::cos(turn);
  const double low = round_m * (1 - std::cos(bent)) + straight * std::sin(turn);
  const double wave = kHigh * line.length_m * std::sin(halves * std::numbers::pi * between);
  return line.from + s * line.along + (std::copysign(out, d) + wave) * line.across +
         low * line.down;
}

}  // namespace

Linkage link(int count, const std::function<double(int, int)>& distance, double least) {
  Linkage linkage{least, std::vector<int>(count)};
  const std::vector<Edge> tree = spanning_tree(count, distance);
  std::vector<double> lengths;
  lengths.reserve(tree.size());
  for (const Edge& edge : tree) lengths.push_back(edge.length);
  if (!lengths.empty()) linkage.limit = std::max(least, outlier_limit(lengths));
  std::iota(linkage.group.begin(), linkage.group.end(), 0);
  for (const Edge& edge : tree) {
    if (edge.length > linkage.limit) continue;
    const int from = linkage.group[edge.from], to = linkage.group[edge.to];
    std::replace(linkage.group.begin(), linkage.group.end(), std::max(from, to),
                 std::min(from, to));
  }
  std::vector<int> number(count, -1);
  int groups = 0;
  for (int& one : linkage.group) {
    if (number[one] < 0) number[one] = groups++;
    one = number[one];
  }
  return linkage;
}

HemLabel label_hem(const DrapeLevel& level, const ClothMoment& moment) {
  const MaterialMesh& mesh = level.cloth().mesh();
  const MeshCloth::State places = level.surface(moment);
  Vector2d middle = Vector2d::Zero();
  for (int i = 0; i < level.cloth().points(); ++i)
    middle += level.cloth().mass_kg()[i] / level.mass_kg() * places[i].head<2>();
  std::vector<int> nodes = border_nodes(mesh);
  nodes.push_back(nodes.front());
  std::vector<double> along_m = {0};  // material length up to each node
  for (std::size_t k = 1; k < nodes.size(); ++k)
    along_m.push_back(
        along_m.back() +
        (level.cloth().material_m(nodes[k]) - level.cloth().material_m(nodes[k - 1])).norm());
  HemLabel label;
  std::vector<double> radius(kHemSamples);
  std::size_t next = 1;
  for (int k = 0; k < kHemSamples; ++k) {
    const double here_m = along_m.back() * k / kHemSamples;
    while (along_m[next] <= here_m) ++next;
    const double part = (here_m - along_m[next - 1]) / (along_m[next] - along_m[next - 1]);
    const Vector2d place =
        (1 - part) * places[nodes[next - 1]].head<2>() + part * places[nodes[next]].head<2>();
    radius[k] = (place - middle).norm();
  }
  const auto spectrum = spectrum_of(radius, static_cast<int>(label.amplitude_m.size()) - 1);
  for (std::size_t m = 0; m < spectrum.size(); ++m) label.amplitude_m[m] = std::abs(spectrum[m]);
  label.nodes = static_cast<int>(extremes_of(radius, kFold).crests.size());
  return label;
}

void fields(Fields& f, EnsembleOptions& options) {
  f({"starts",
     "number of seeded starts, of which the first is the scene's own; default: 8, and 8 more while "
     "new branches appear, at most 32",
     1, 1, 10000},
    options.starts);
}

EnsembleCase EnsembleCase::with(const std::function<void(Scene&)>& change) const {
  EnsembleCase other = *this;
  auto changed = std::make_shared<DrapeCase>(*drape);
  change(other.scene);
  change(changed->local.scene);
  other.drape = std::move(changed);
  return other;
}

EnsembleCase EnsembleCase::with_laws(FittedLaws laws) const {
  EnsembleCase other = *this;
  auto changed = std::make_shared<DrapeCase>(*drape);
  changed->laws = laws.laws;
  other.fitted = std::move(laws);
  other.options.internal_friction = changed->laws.friction.has_value();
  other.drape = std::move(changed);
  return other;
}

EnsembleCase EnsembleCase::with_levels(std::size_t count) const {
  const std::vector<double> spacings_m = level_spacings_m(options.drape);
  EnsembleCase other = *this;
  other.options.drape.coarsest_m = spacings_m.front();
  other.options.drape.spacing_m = spacings_m[std::min(count, spacings_m.size()) - 1];
  return other;
}

std::string EnsembleCase::ending_of(const DrapeLevel& level, const ClothMoment& moment,
                                    const RestReport& report) const {
  if (!report.at_rest) return "it does not come to rest: " + report.why;
  const MeshJudgement judged =
      judge_drape(level, moment, scene, options.drape.descent.residual, strain_limits(fabric));
  if (judged.accepted()) return "at rest";
  return fmt::format("the checker refuses it: {}", fmt::join(judged.refusals, "; "));
}

SimulateResult EnsembleCase::result(Drape made) const {
  return result_of(scene, fabric, fitted, options, drape, std::move(made));
}

EnsembleCase ensemble_case(const Scene& scene, const Fabric& fabric, const Print& print,
                           const std::optional<Sheet>& measured, const SimulateOptions& options) {
  options.check();
  EnsembleCase own{scene, fabric,
                   fit_laws(fabric, options.segments, options.reach, options.internal_friction),
                   options, nullptr};
  own.drape = std::make_shared<const DrapeCase>(
      drape_case(scene, print, measured, own.fitted.laws, options.outline));
  return own;
}

std::vector<int> Ensemble::starts_of(std::size_t branch) const {
  std::vector<int> own;
  for (const int k : branches[branch])
    if (members[k].start >= 0) own.push_back(members[k].start);
  std::sort(own.begin(), own.end());
  return own;
}

double mean_distance_m(const MatrixX3d& a, const MatrixX3d& b, bool round) {
  if (!round) return (a - b).rowwise().norm().mean();
  return std::min(distance_after_turn(a, b), distance_after_turn(a, b.colwise().reverse()));
}

Ensemble find_branches(const EnsembleCase& own, const EnsembleOptions& how) {
  Ensemble ensemble;
  ensemble.round = is_round(own.drape->local.scene);
  const EnsembleCase coarse = own.with_levels(1);
  const bool friction_known = !names(own.scene.stand_ins, "friction");
  const auto add = [&](std::size_t count, const auto& drape_one) {
    const std::size_t first = ensemble.members.size();
    ensemble.members.resize(first + count);
    parallel_for(count, how.threads,
                 [&](std::size_t k) { ensemble.members[first + k] = drape_one(k); });
    group(ensemble, how.same_m);
  };
  do {
    const int first = ensemble.starts;
    const int count = how.starts.value_or(kBatch);
    add(static_cast<std::size_t>(count), [&](std::size_t k) {
      const int start = first + static_cast<int>(k);
      return member_of(coarse, start, variation_of(start, friction_known));
    });
    ensemble.starts += count;
  } while (!how.starts && ensemble.starts < kMostStarts && brought_new(ensemble));
  const std::vector<DrapeStart> folded = folded_starts(*own.drape);
  if (!folded.empty())
    add(folded.size(), [&](std::size_t k) { return member_of(coarse, -1, {}, folded[k]); });
  for (const Member& member : ensemble.members) {
    if (!member.rests()) continue;
    const MatrixX3d& places = member.drape.marks_of_level.back();
    for (std::size_t k = 0; k < member.drape.marks.size(); ++k)
      if (places.row(static_cast<Index>(k)).allFinite())
        ensemble.marks.push_back(member.drape.marks[k]);
    break;
  }
  return ensemble;
}

UnseenBranches unseen_of(const std::vector<int>& starts) {
  UnseenBranches unseen;
  for (const int count : starts) {
    unseen.rests += count;
    unseen.seen_once += count == 1;
  }
  if (unseen.rests == 0) {
    unseen.fraction = 1;
    return unseen;
  }
  unseen.fraction = static_cast<double>(unseen.seen_once) / unseen.rests;
  unseen.upper95 = probability_bound(unseen.seen_once, unseen.rests, 0.95);
  return unseen;
}

BranchList list_of(const Ensemble& ensemble, const EnsembleCase& own) {
  BranchList list;
  list.round = ensemble.round;
  list.linked_m = ensemble.linked_m;
  list.starts = ensemble.starts;
  int at_rest = 0;
  for (const Member& member : ensemble.members) {
    const std::vector<int> start(member.start >= 0 ? 1 : 0, member.start);
    at_rest += member.rests() && member.start >= 0;
    if (member.rests()) continue;
    if (member.drape.at_rest() || start.empty())
      list.refused.push_back({start, member.ending});
    else
      list.not_at_rest.insert(list.not_at_rest.end(), start.begin(), start.end());
  }
  list.members_at_rest = at_rest;
  std::vector<int> seen;
  for (std::size_t k = 0; k < ensemble.branches.size(); ++k) {
    const Member& first = ensemble.members[ensemble.branches[k].front()];
    ListedBranch one;
    one.number = static_cast<int>(k) + 1;
    one.sheet = fmt::format("branch-{:02}/sheet.ply", one.number);
    one.energy_j = first.energy_j + own.drape->local.gravity_offset_j(first.mass_kg);
    one.residual = first.drape.levels.back().rest.descent.residual;
    one.starts = ensemble.starts_of(k);
    one.fraction = static_cast<double>(one.starts.size()) / ensemble.starts;
    if (one.starts.empty()) one.sought = true;
    one.friction = first.friction;
    for (const int member : ensemble.branches[k])
      one.farthest_member_m =
          std::max(one.farthest_member_m,
                   mean_distance_m(first.marks, ensemble.members[member].marks, ensemble.round));
    one.hem_nodes = first.hem.nodes;
    one.hem_amplitudes_m.assign(first.hem.amplitude_m.begin(), first.hem.amplitude_m.end());
    one.spacing_m = first.drape.levels.back().spacing_m;
    if (!one.starts.empty()) seen.push_back(static_cast<int>(one.starts.size()));
    list.branches.push_back(std::move(one));
  }
  list.unseen = unseen_of(seen);
  list.band = band_of(ensemble, own.drape->local);
  return list;
}

std::vector<std::size_t> could_be_real(const Ensemble& ensemble) {
  std::vector<double> distance_m(ensemble.branches.size(), 0.0);
  for (std::size_t k = 0; k < distance_m.size(); ++k) {
    distance_m[k] = std::numeric_limits<double>::infinity();
    for (const int member : ensemble.branches[k])
      distance_m[k] = std::min(distance_m[k], ensemble.members[member].from_measured_m.value_or(0));
  }
  std::vector<std::size_t> branches;
  for (std::size_t k = 0; k < distance_m.size(); ++k)
    if (distance_m[k] <=
        *std::min_element(distance_m.begin(), distance_m.end()) + ensemble.linked_m)
      branches.push_back(k);
  return branches;
}

FinishedBranch finish_branch(const Ensemble& ensemble, std::size_t branch, const EnsembleCase& own,
                             bool polish, ListedBranch& entry) {
  const Member& first = ensemble.members[ensemble.branches[branch].front()];
  const EnsembleCase fine = with_friction(own, first.friction).with_levels(2);
  const EnsembleCase coarse = fine.with_levels(1);
  Drape drape = first.drape;
  drape.level = std::make_shared<DrapeLevel>(*coarse.drape, coarse.options.drape,
                                             coarse.options.drape.spacing_m);
  if (polish && level_spacings_m(own.options.drape).size() > 1) {
    FinishedBranch finer{
        fine.result(polished(*fine.drape, fine.options.drape, drape.level, first.drape.rest)),
        {},
        {}};
    if (finer.result.at_rest()) {
      const Drape& found = *finer.result.drape;
      finer.marks = rows_on_cloth(found.marks_of_level.back());
      finer.from_measured_m = from_measured_m(*found.level, found.rest);
      entry.polish_m = mean_distance_m(finer.marks, first.marks, false);
      entry.spacing_m = fine.options.drape.spacing_m;
      entry.residual = finer.result.certificate.residual.value_or(0);
      entry.stable = is_stable(*found.level, found.rest);
      return finer;
    }
    entry.not_polished = finer.result.certificate.status;
  }
  entry.stable = is_stable(*drape.level, drape.rest);
  return {coarse.result(std::move(drape)), first.marks, first.from_measured_m};
}

PlacedDrape place_measured(const Ensemble& ensemble, const EnsembleCase& own,
                           const std::vector<FinishedBranch>& finished,
                           const std::vector<BandMark>& band) {
  PlacedDrape placed;
  std::size_t nearest = 0;
  for (std::size_t k = 0; k < finished.size(); ++k) {
    const auto look = [&](const std::optional<double>& distance_m) {
      if (!distance_m || (placed.distance_m && *placed.distance_m <= *distance_m)) return;
      placed.distance_m = distance_m;
      nearest = k;
    };
    look(finished[k].from_measured_m);
    for (const int member : ensemble.branches[k]) look(ensemble.members[member].from_measured_m);
  }
  if (placed.distance_m) {
    placed.nearest = static_cast<int>(nearest) + 1;
    for (std::size_t k = 0; k < finished.size(); ++k) {
      if (k == nearest) continue;
      const double apart_m =
          mean_distance_m(finished[nearest].marks, finished[k].marks, ensemble.round);
      placed.apart_m = std::min(placed.apart_m.value_or(apart_m), apart_m);
    }
    if (placed.apart_m && ensemble.linked_m < *placed.apart_m) {
      placed.reach_m = ensemble.linked_m;
      if (*placed.distance_m <= *placed.reach_m) placed.branch = placed.nearest;
    }
    int marks = 0, inside = 0, judged = 0;
    const LocalScene& local = own.drape->local;
    for (const SheetMark& mark : local.measured->marks) {
      ++marks;
      for (const BandMark& one : band) {
        if (one.mark != mark.mark) continue;
        ++judged;
        inside +=
            (local.to_world(mark.point_in_world) - one.mean_in_world).norm() <= one.radius95_m;
      }
    }
    placed.marks = marks;
    if (judged > 0) placed.inside_fraction = static_cast<double>(inside) / judged;
  }
  return placed;
}

void start_from_measured(const EnsembleCase& own, PlacedDrape& placed) {
  const auto started = [&](double friction) {
    const EnsembleCase there = with_friction(own, friction).with_levels(2);
    DrapeCase drape = *there.drape;
    drape.local.scene.start.mode = StartMode::measured;
    drape.shape =
        measured_shape(drape.local.scene, drape.local.measured, drape.print, *drape.around);
    const Drape found = drape_cloth(drape, there.options.drape);
    OtherFriction end{
        friction, there.ending_of(*found.level, found.rest, found.levels.back().rest), {}};
    if (end.ending == "at rest") end.distance_m = from_measured_m(*found.level, found.rest);
    return end;
  };
  const OtherFriction own_end = started(own.scene.friction);
  placed.started_there = own_end.ending;
  placed.started_there_m = own_end.distance_m;
  if (const auto range = own.scene.friction_range())
    for (const double friction : *range) placed.other_frictions.push_back(started(friction));
}

std::vector<DrapeStart> folded_starts(const DrapeCase& drape) {
  const Scene& scene = drape.local.scene;
  if (scene.pins.size() != 2 || !scene.clamps.empty()) return {};
  const std::vector<Vector3d>& pinned = drape.pins_at;
  Line line;
  line.from_m = scene.pins[0].material_m(drape.print);
  line.from = pinned[0];
  const Vector2d in_cloth = scene.pins[1].material_m(drape.print) - line.from_m;
  const Vector3d in_space = pinned[1] - line.from;
  line.length_m = in_cloth.norm();
  const Vector3d up = -scene.gravity_m_per_s2.normalized();
  if (!(up.cross(in_space).norm() > kSteep * in_space.norm()) || !(line.length_m > 0)) return {};
  line.along_m = in_cloth / line.length_m;
  line.across_m = {-line.along_m.y(), line.along_m.x()};
  line.along = in_space.normalized();
  line.across = up.cross(line.along).normalized();
  line.down = line.across.cross(line.along);
  if (line.down.dot(up) > 0) line.down = -line.down;
  if (!parts(line, drape.outline)) return {};
  line.from += 0.5 * (in_space.norm() - line.length_m) * line.along;
  std::vector<DrapeStart> starts;
  for (const auto& [left, right] : {std::pair(true, false), {false, true}, {true, true}})
    for (const int halves : {0, 1, -1}) {
      if (left && right && halves == 0) continue;  // balances on its pins and has higher energy
      starts.emplace_back([line, left = left, right = right, halves](const DrapeLevel& level) {
        const std::vector<Vector2d>& material_m = level.cloth().mesh().points_m;
        std::vector<Vector3d> places;
        places.reserve(material_m.size());
        for (const Vector2d& point : material_m)
          places.push_back(folded(line, left, right, halves, point));
        ClothMoment moment = level.start_at(material_m, places);
        for (const int pin : level.pinned())
          moment.state[pin] = places[pin];  // until the fall moves it
        return moment;
      });
    }
  return starts;
}

}  // namespace drape::simulate
