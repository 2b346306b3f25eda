// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/band.hpp"

#include <algorithm>
#include <cmath>

#include "core/statistics/sample.hpp"
#include "core/units.hpp"
#include "simulate/ensemble/checked.hpp"
#include "simulate/equilibrium/mixture.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using units::mm;

Json in_mm(const Vector3d& p) {
  return {p.x() / mm, p.y() / mm, p.z() / mm};
}

}  // namespace

GridSpec grid_of(const Sheet& sheet) {
  return {sheet.rows, sheet.cols, sheet.patch_m};
}

Field field_of(const Sheet& sheet) {
  const auto n = static_cast<std::size_t>(sheet.rows) * sheet.cols;
  Field field(3 * n, std::nan(""));
  for (const SheetMark& mark : sheet.marks)
    put_at(field, mark.mark.row * sheet.cols + mark.mark.col, mark.point_in_world);
  return field;
}

std::size_t members_at_rest(const Branches& branches) {
  return std::count_if(branches.members.begin(), branches.members.end(),
                       [](const Field& member) { return !member.empty(); });
}

std::vector<MarkBand> band_of(const Branches& branches, const GridSpec& grid, const Print& print) {
  std::vector<MarkBand> band;
  std::vector<const Field*> members;
  for (const Field& member : branches.members) {
    if (!member.empty()) members.push_back(&member);
  }
  if (members.size() < kLeastMembers) return band;
  for (int k = 0; k < print.rows * print.cols; ++k) {
    MarkBand one;
    one.mark = {k / print.cols, k % print.cols};
    const Hold place = hold_at(grid, print.material_m(one.mark));
    std::vector<Vector3d> points;
    points.reserve(members.size());
    for (const Field* member : members) points.push_back(mix(*member, place));
    for (const Vector3d& p : points) one.mean_in_world += p / static_cast<double>(points.size());
    std::vector<double> distance;
    distance.reserve(points.size());
    for (const Vector3d& p : points) distance.push_back((p - one.mean_in_world).norm());
    one.radius95_m = quantile(distance, 0.95);
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> along;
      along.reserve(points.size());
      for (const Vector3d& p : points) along.push_back(p[axis]);
      one.low_m[axis] = quantile(along, 0.025);
      one.high_m[axis] = quantile(along, 0.975);
    }
    band.push_back(one);
  }
  return band;
}

std::optional<Assignment> assign(const Sheet& measured, const Branches& branches,
                                 const GridSpec& grid, const std::vector<MarkBand>& band) {
  if (measured.marks.empty()) return std::nullopt;
  std::optional<Assignment> best;
  for (std::size_t k = 0; k < branches.found.size(); ++k) {
    std::vector<const Field*> rests;
    if (branches.found[k].own_start < 0) rests.push_back(&branches.found[k].position);
    for (const int start : branches.found[k].starts) rests.push_back(&branches.members[start]);
    for (const Field* rest : rests) {
      const Field& member = *rest;
      double sum = 0;
      for (const SheetMark& mark : measured.marks)
        sum += (mix(member, hold_at(grid, mark.material_m)) - mark.point_in_world).norm();
      const double distance_m = sum / static_cast<double>(measured.marks.size());
      if (best && best->distance_m <= distance_m) continue;
      best = Assignment{k, distance_m, branches.linked_m, measured.marks.size(), 0};
    }
  }
  if (!best) return best;
  std::size_t inside = 0;
  std::size_t judged = 0;
  for (const MarkBand& one : band) {
    const SheetMark* mark = measured.find(one.mark);
    if (mark == nullptr) continue;
    ++judged;
    inside += (mark->point_in_world - one.mean_in_world).norm() <= one.radius95_m;
  }
  if (judged > 0) best->inside_fraction = static_cast<double>(inside) / static_cast<double>(judged);
  return best;
}

std::optional<double> distance_at_marks_m(const Sheet& measured, const Sheet& sheet) {
  const GridSpec grid = grid_of(sheet);
  const Field field = field_of(sheet);
  double sum = 0;
  for (const SheetMark& mark : measured.marks)
    sum += (mix(field, hold_at(grid, mark.material_m)) - mark.point_in_world).norm();
  sum /= static_cast<double>(measured.marks.size());
  return std::isfinite(sum) ? std::optional(sum) : std::nullopt;
}

FromMeasured start_from_measured(const Scene& scene, const Fabric& fabric, const Print& print,
                                 const Sheet& measured, const SimulateOptions& options) {
  Scene there = scene;
  there.start.mode = StartMode::measured;
  SimulateOptions how = options;
  how.solver = Solver::newton;  // it starts near its rest
  const SimulateResult result = simulate_checked(there, fabric, print, measured, how);
  FromMeasured from{result.report.sentence, std::nullopt};
  if (result.report.status == RestStatus::at_rest)
    from.distance_m = distance_at_marks_m(measured, result.sheet);
  return from;
}

void add_band(const std::vector<MarkBand>& band, std::size_t members, Json& json) {
  json["members_at_rest"] = members;
  json["band"] = Json::array();
  for (const MarkBand& one : band) {
    json["band"].push_back({{"row", one.mark.row},
                            {"col", one.mark.col},
                            {"mean_mm", in_mm(one.mean_in_world)},
                            {"low_mm", in_mm(one.low_m)},
                            {"high_mm", in_mm(one.high_m)},
                            {"radius95_mm", one.radius95_m / mm}});
  }
}

void add_measured(const std::optional<Assignment>& assignment, const FromMeasured& from_measured,
                  Json& json) {
  Json one;
  one["branch"] = nullptr;
  one["nearest_branch"] = nullptr;
  if (assignment) {
    if (assignment->is_on()) one["branch"] = assignment->nearest + 1;
    one["nearest_branch"] = assignment->nearest + 1;
    one["distance_mm"] = assignment->distance_m / mm;
    one["reach_mm"] = assignment->reach_m / mm;
    one["marks"] = assignment->marks;
    one["fraction_of_marks_in_band"] = assignment->inside_fraction;
  }
  one["started_there"] = from_measured.sentence;
  one["started_there_distance_mm"] =
      from_measured.distance_m ? Json(*from_measured.distance_m / mm) : Json(nullptr);
  json["measured"] = one;
}

}  // namespace drape::simulate
