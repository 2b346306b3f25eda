// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/suggest.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <vector>

#include "core/geometry/body.hpp"
#include "core/statistics/random.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using units::deg;
using units::mm;

/// Relative enlargement of a box or cylinder so that the cloth touches it on all sides, which
/// centres it in the space that the cloth leaves.
constexpr double kWider = 0.03;

struct Wider {
  Obstacle operator()(Box body) const {
    body.size_m.head<2>() *= 1 + 2 * kWider;
    return body;
  }
  Obstacle operator()(Cylinder body) const {
    body.radius_m *= 1 + 2 * kWider;
    return body;
  }
  template <class Body>
  Obstacle operator()(const Body& body) const {
    return body;
  }
};

/// Cost of an object: high for marks inside, attractive for marks nearly touching, zero for others.
/// Cloth too short to pass outside also counts, which centres the object in it.
double cost(const SeenCloth& seen, const Obstacle& object, double reach_m) {
  constexpr double kInside_m = 0.45 * mm;
  double sum = 0;
  for (const SheetMark& mark : seen.sheet.marks) {
    const double gap_m = distance_to(object, mark.point_in_world).value_or(1);
    sum += gap_m < 0 ? std::pow(gap_m / kInside_m, 2) : 1 - std::exp(-std::pow(gap_m / reach_m, 2));
  }
  const Obstacle wider = std::visit(Wider{}, object);
  for (const ClothSpan& span : seen.spans) sum += std::pow(shortfall_m(wider, span) / mm, 2);
  return sum;
}

/// Mean position of the marks on top: within twice the largest thickness below the highest.
Eigen::Vector2d middle_of_top(const Sheet& sheet) {
  double highest_m = sheet.marks.front().point_in_world.z();
  for (const SheetMark& mark : sheet.marks)
    highest_m = std::max(highest_m, mark.point_in_world.z());
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
  for (const SheetMark& mark : sheet.marks) {
    if (mark.point_in_world.z() < highest_m - 2 * kThickest_m) continue;
    sum += mark.point_in_world.head<2>();
    ++count;
  }
  return sum / count;
}

/// Values of an object as stated in its scene.
struct Stated {
  Vector3d foot_mm;                     ///< x_mm, y_mm, z_bottom_mm
  Vector3d size_mm = Vector3d::Zero();  ///< for a box; else the diameter comes first
  double yaw_deg = 0;
  bool is_box = false;
};

std::optional<Stated> stated_of(const Obstacle& object) {
  if (const auto* ball = std::get_if<Sphere>(&object))
    return Stated{(ball->centre_in_world - Vector3d(0, 0, ball->radius_m)) / mm,
                  Vector3d(2 * ball->radius_m / mm, 0, 0)};
  if (const auto* body = std::get_if<Cylinder>(&object)) {
    const Vector3d axis = body->world_from_cylinder.rotation.col(2);
    const double reach_m =
        0.5 * body->height_m * std::abs(axis.z()) + body->radius_m * std::hypot(axis.x(), axis.y());
    return Stated{(body->world_from_cylinder.translation_m - Vector3d(0, 0, reach_m)) / mm,
                  Vector3d(2 * body->radius_m / mm, body->height_m / mm, 0)};
  }
  if (const auto* box = std::get_if<Box>(&object)) {
    const Matrix3d& turn = box->world_from_box.rotation;
    return Stated{(box->world_from_box.translation_m - Vector3d(0, 0, 0.5 * box->size_m.z())) / mm,
                  box->size_m / mm, std::atan2(turn(1, 0), turn(0, 0)) / deg, true};
  }
  return std::nullopt;
}

/// The object with these values; a cylinder's axis and the edge radii are kept.
Obstacle typed(Obstacle object, const Stated& values) {
  const Vector3d foot_m = values.foot_mm * mm;
  if (auto* ball = std::get_if<Sphere>(&object)) {
    ball->radius_m = 0.5 * values.size_mm.x() * mm;
    ball->centre_in_world = foot_m + Vector3d(0, 0, ball->radius_m);
  } else if (auto* body = std::get_if<Cylinder>(&object)) {
    body->radius_m = 0.5 * values.size_mm.x() * mm;
    body->height_m = values.size_mm.y() * mm;
    const Vector3d axis = body->world_from_cylinder.rotation.col(2);
    body->world_from_cylinder.translation_m =
        foot_m + Vector3d(0, 0,
                          0.5 * body->height_m * std::abs(axis.z()) +
                              body->radius_m * std::hypot(axis.x(), axis.y()));
  } else if (auto* box = std::get_if<Box>(&object)) {
    box->size_m = values.size_mm * mm;
    box->world_from_box.translation_m = foot_m + Vector3d(0, 0, 0.5 * box->size_m.z());
    box->world_from_box.rotation =
        Eigen::AngleAxisd(values.yaw_deg * deg, Vector3d::UnitZ()).toRotationMatrix();
  }
  return object;
}

struct Slip {
  const char* what;
  Stated values;
};

std::vector<Slip> slips_of(const Stated& stated, double table_z_mm) {
  std::vector<Slip> slips;
  const auto add = [&](const char* what, auto&& change) {
    Slip slip{what, stated};
    change(slip.values);
    slips.push_back(slip);
  };
  if (stated.is_box) {
    add("with the other sign", [](Stated& v) { v.yaw_deg = -v.yaw_deg; });
    add("from the other axis", [](Stated& v) { v.yaw_deg = 90 - v.yaw_deg; });
    add("sides exchanged", [](Stated& v) { std::swap(v.size_mm.x(), v.size_mm.y()); });
    add("sides exchanged", [](Stated& v) { std::swap(v.size_mm.x(), v.size_mm.z()); });
    add("sides exchanged", [](Stated& v) { std::swap(v.size_mm.y(), v.size_mm.z()); });
    const Eigen::Rotation2Dd turn(stated.yaw_deg * deg);
    for (const double i : {-0.5, 0.5})
      for (const double k : {-0.5, 0.5})
        add("a corner was typed", [&](Stated& v) {
          v.foot_mm.head<2>() += turn * Eigen::Vector2d(i * v.size_mm.x(), k * v.size_mm.y());
        });
  } else {
    add("the radius was typed", [](Stated& v) { v.size_mm.x() *= 2; });
    add("the circumference was typed", [](Stated& v) { v.size_mm.x() /= 3.14159265; });
  }
  add("with the other sign", [](Stated& v) { v.foot_mm.x() = -v.foot_mm.x(); });
  add("with the other sign", [](Stated& v) { v.foot_mm.y() = -v.foot_mm.y(); });
  add("with the other signs", [](Stated& v) { v.foot_mm.head<2>() *= -1; });
  add("exchanged", [](Stated& v) { std::swap(v.foot_mm.x(), v.foot_mm.y()); });
  add("on the table", [&](Stated& v) { v.foot_mm.z() = table_z_mm; });
  for (const auto& [what, factor] :
       {std::pair{"typed in centimetres", 10.0}, std::pair{"ten times too large", 0.1},
        std::pair{"typed in inches", 25.4}}) {
    add(what, [f = factor](Stated& v) { v.foot_mm.head<2>() *= f; });
    add(what, [f = factor](Stated& v) { v.size_mm *= f; });
    add(what, [f = factor](Stated& v) {
      v.foot_mm.head<2>() *= f;
      v.size_mm *= f;
    });
  }
  return slips;
}

/// A value rounded to one decimal, as printed.
double printed(double value) {
  return std::round(10 * value) / 10;
}

std::string text_of(const Stated& from, const Stated& to, const Change& within) {
  std::string text;
  const auto add = [&](const char* key, double old, double now, double range) {
    if (std::abs(old - now) < 1e-6 && range == 0) return;
    text += fmt::format("{}{} = {:.1f}", text.empty() ? "" : ", ", key, now);
    if (range > 0) text += fmt::format(" +- {:.1f}", range);
  };
  add("x_mm", from.foot_mm.x(), to.foot_mm.x(), within[0]);
  add("y_mm", from.foot_mm.y(), to.foot_mm.y(), within[1]);
  add("z_bottom_mm", from.foot_mm.z(), to.foot_mm.z(), within[2]);
  if (!from.is_box) {
    add("diameter_mm", from.size_mm.x(), to.size_mm.x(), within[4]);
  } else {
    add("yaw_deg", from.yaw_deg, to.yaw_deg, within[3]);
    if (!from.size_mm.isApprox(to.size_mm, 1e-9))
      text += fmt::format("{}size_mm = [{:.1f}, {:.1f}, {:.1f}]", text.empty() ? "" : ", ",
                          to.size_mm.x(), to.size_mm.y(), to.size_mm.z());
  }
  return text;
}

/// Searches for objects that pass the tests failed by the stated one.
class Search {
 public:
  Search(const SeenCloth& seen, const Scene& scene, std::size_t object)
      : seen_(seen),
        scene_(scene),
        index_(object),
        limit_(chi2_limit(scene.obstacles[object])),
        is_held_up_(!floating(seen, scene)) {}

  /// True if the object is not contradicted when it may be smaller by twice its size's uncertainty.
  [[nodiscard]] bool fits(const Obstacle& object) const {
    return chi2(object) < limit_ && touches(object);
  }
  [[nodiscard]] bool passes(const Obstacle& object) const {
    return touches(object) && !is_contradicted(seen_, object, scene_.uncertainty_of(index_));
  }
  /// True if the cloth rests on the object and no level cloth is left unsupported.
  [[nodiscard]] bool touches(const Obstacle& object) const {
    Scene other = scene_;
    other.obstacles[index_] = object;
    const auto above = untouched(seen_, other);
    return (!above || above->object != index_) && (!is_held_up_ || !floating(seen_, other));
  }

  /// Best position from a start: draws marks to the surface from ever nearer, then keeps them out.
  [[nodiscard]] Obstacle fitted(Obstacle object, const std::vector<int>& free) const {
    for (const double reach_m : {8 * mm, 4 * mm, 2 * mm, 1 * mm}) {
      const auto at = [&](const Change& change) {
        return cost(seen_, changed(object, change), reach_m);
      };
      object = changed(object, least(at, free, 0));
    }
    const auto at = [&](const Change& change) { return chi2(changed(object, change)); };
    return changed(object, least(at, free, 0.5 * limit_));
  }

  /// Samples changes of `object` that fit, by hit-and-run: a random direction, then a random point
  /// on the chord, which is shortened to each point found outside.
  [[nodiscard]] std::vector<Change> range_around(const Obstacle& object,
                                                 const std::vector<int>& free) const {
    constexpr int kWalk = 150;
    constexpr double kChord = 20;  // half a chord's length, mm or deg
    std::vector<Change> range = {Change::Zero()};
    SplitMix64 random(1);
    Change at = Change::Zero();
    for (int step = 0; step < kWalk; ++step) {
      Change along = Change::Zero();
      for (const int k : free) along[k] = 2 * random.uniform() - 1;
      along.normalize();
      double low = -kChord, high = kChord;
      for (int k = 0; k < 30; ++k) {
        const double to = low + (high - low) * random.uniform();
        if (fits(changed(object, at + to * along))) {
          at += to * along;
          break;
        }
        (to < 0 ? low : high) = to;
      }
      range.push_back(at);
    }
    return range;
  }

 private:
  [[nodiscard]] double chi2(const Obstacle& object) const {
    Change smaller = Change::Zero();
    smaller[4] = -2 * scene_.uncertainty_of(index_).size_m() / mm;
    return against(seen_, changed(object, smaller)).chi2;
  }

  const SeenCloth& seen_;
  const Scene& scene_;
  std::size_t index_;
  double limit_;
  bool is_held_up_;  ///< true if supported in the stated scene, so any other must support it too
};

/// Set of objects that fit: mean with twice the standard deviation, and total range.
struct Range {
  Stated middle;
  Change within;  ///< k = 2
  Stated centre;
  Change reach;  ///< half the range around its centre

  /// Distance of an object's values from the centre; its rotation modulo the box's symmetry.
  [[nodiscard]] Change apart(const Stated& one) const {
    const bool is_square = std::abs(centre.size_mm.x() - centre.size_mm.y()) < 0.5;
    const Vector3d by_mm = (one.foot_mm - centre.foot_mm).cwiseAbs();
    const double turn =
        centre.is_box ? std::abs(std::remainder(one.yaw_deg - centre.yaw_deg, is_square ? 90 : 180))
                      : 0;
    return (Change() << by_mm, turn, std::abs(one.size_mm.x() - centre.size_mm.x())).finished();
  }
  [[nodiscard]] bool holds(const Stated& one) const {
    constexpr double kSame = 1;  // same object within this, mm or deg
    return (apart(one) - reach).maxCoeff() <= kSame;
  }
  /// True if both are parts of one range that the walks have not fully covered.
  [[nodiscard]] bool meets(const Range& other) const {
    return (apart(other.centre) - reach - other.reach).maxCoeff() <= 0;
  }
  void join(const Range& other) {
    const Change by = apart(other.centre);
    within = within.cwiseMax(other.within + by);
    reach = reach.cwiseMax(other.reach + by);
  }
};

/// Separate ranges in which fits from many starts end.
std::vector<Range> ranges_of(const Search& search, const SeenCloth& seen, const Obstacle& object,
                             const Stated& stated, const std::vector<int>& free,
                             const std::vector<Slip>& slips) {
  std::vector<Range> ranges;
  std::vector<Stated> starts = {stated};
  for (const Slip& slip : slips) starts.push_back(slip.values);
  Stated below = stated;
  below.foot_mm.head<2>() = middle_of_top(seen.sheet) / mm;
  starts.push_back(below);
  if (stated.is_box) {
    for (const double turn : {22.5, 45.0, 67.5, 90.0, 112.5, 135.0, 157.5}) {
      if (turn > 80 && std::abs(stated.size_mm.x() - stated.size_mm.y()) < 0.5) break;
      starts.push_back(below);
      starts.back().yaw_deg = std::remainder(stated.yaw_deg + turn, 180);
    }
  }
  for (const Stated& start : starts) {
    const Obstacle found = search.fitted(typed(object, start), free);
    if (!search.fits(found)) continue;
    const Stated at = *stated_of(found);
    if (std::any_of(ranges.begin(), ranges.end(), [&](const Range& one) { return one.holds(at); }))
      continue;
    const std::vector<Change> changes = search.range_around(found, free);
    Change least_change = changes.front(), most_change = changes.front(), mean = Change::Zero(),
           squares = Change::Zero();
    const auto count = static_cast<double>(changes.size());
    for (const Change& change : changes) {
      least_change = least_change.cwiseMin(change);
      most_change = most_change.cwiseMax(change);
      mean += change / count;
    }
    for (const Change& change : changes) squares += (change - mean).cwiseAbs2() / count;
    Range range{*stated_of(changed(found, mean)), 2 * squares.cwiseSqrt(),
                *stated_of(changed(found, 0.5 * (least_change + most_change))),
                0.5 * (most_change - least_change)};
    const auto same = std::find_if(ranges.begin(), ranges.end(),
                                   [&](const Range& one) { return one.meets(range); });
    if (same == ranges.end())
      ranges.push_back(range);
    else
      same->join(range);
  }
  // If the stated size fits, another size would be a second mistake.
  const auto as_stated = [&](const Range& one) {
    return one.centre.size_mm.isApprox(stated.size_mm, 1e-6);
  };
  if (std::any_of(ranges.begin(), ranges.end(), as_stated))
    std::erase_if(ranges, [&](const Range& one) { return !as_stated(one); });
  return ranges;
}

/// Expected number of typing errors within the range by chance: two are possible for the rotation,
/// eleven for place and size.
double chance_of(const Slip& slip, const Stated& stated, const Range& range) {
  constexpr double kTurns = 2, kPlaces = 11;
  double chance = 1;
  const auto moved = [&](double by, double within) {
    if (std::abs(by) > 1e-9) chance *= std::min(1.0, within / std::abs(by));
  };
  const Vector3d by_mm = slip.values.foot_mm - stated.foot_mm;
  moved(by_mm.x(), range.within[0]);
  moved(by_mm.y(), range.within[1]);
  moved(by_mm.z(), std::max(1.0, range.within[2]));
  moved(slip.values.size_mm.x() - stated.size_mm.x(), std::max(1.0, range.within[4]));
  const bool is_turn = chance == 1;
  moved(std::remainder(slip.values.yaw_deg - stated.yaw_deg, 180), range.within[3]);
  return chance * (is_turn ? kTurns : kPlaces);
}

/// Distance between adjacent marks along the cloth.
double pitch_mm(const Sheet& sheet) {
  for (const SheetMark& mark : sheet.marks)
    if (const SheetMark* next = sheet.find(mark.mark + MarkId{0, 1}))
      return (next->material_m - mark.material_m).norm() / mm;
  return sheet.patch_m.maxCoeff() / mm;
}

}  // namespace

ObjectSuggestion suggested_object(const SeenCloth& seen, const Scene& scene, std::size_t object) {
  const Obstacle& own = scene.obstacles[object];
  const auto stated = stated_of(own);
  if (!stated || seen.sheet.marks.empty()) return {{}, "measure it again"};
  const Search search(seen, scene, object);
  const bool on_table = std::abs(stated->foot_mm.z() * mm - scene.table_z_m) <
                        kObjectSigmas * scene.table_uncertainty_m();
  constexpr int kHeight = 2, kTurn = 3, kSize = 4;
  const auto place = [&](std::initializer_list<int> more) {
    std::vector<int> free = {0, 1};
    free.insert(free.end(), more);
    if (!on_table) free.push_back(kHeight);
    if (stated->is_box) free.push_back(kTurn);
    return free;
  };
  std::vector<Slip> slips;
  for (const Slip& slip : slips_of(*stated, scene.table_z_m / mm)) {
    if (slip.values.size_mm.head(stated->is_box ? 3 : 1).minCoeff() < 5) continue;
    if (!search.passes(typed(own, slip.values))) continue;
    const bool known = std::any_of(slips.begin(), slips.end(), [&](const Slip& other) {
      return Range{{}, {}, other.values, Change::Zero()}.holds(slip.values);
    });
    if (!known) slips.push_back(slip);
  }
  std::vector<Range> ranges = ranges_of(search, seen, own, *stated, place({}), slips);
  if (ranges.empty()) {
    ranges = ranges_of(search, seen, own, *stated, place({kSize}), slips);
    // The stated size of objects on the table may be right if both are at another height.
    if (on_table && !ranges.empty())
      for (const Range& other : ranges_of(search, seen, own, *stated, place({kHeight}), {})) {
        const double by_mm = other.middle.foot_mm.z() - stated->foot_mm.z();
        if (below_table(seen.sheet, scene, scene.table_z_m + by_mm * mm) != nullptr) continue;
        return {{},
                fmt::format("{}, or table_z_mm and z_bottom_mm both by {:+.1f}, would agree alike, "
                            "so none is suggested; measure both again (in mm)",
                            text_of(*stated, ranges.front().middle, ranges.front().within), by_mm)};
      }
  }
  const auto given = [&](const Stated& values, const Change& within, const char* what) {
    std::string text = text_of(*stated, values, within);
    if (*what != 0) text += fmt::format(" ({})", what);
    return ObjectSuggestion{SuggestedObject{typed(own, values), text, within}, ""};
  };
  // Half the distance between marks, as a length and as an angle at the object's rim.
  const double told_mm = 0.5 * pitch_mm(seen.sheet);
  const double told_deg = told_mm / std::max(1.0, 0.5 * stated->size_mm.head<2>().maxCoeff()) / deg;
  const auto is_told = [&](const Range& range) {
    return range.within.head<3>().maxCoeff() <= told_mm && range.within[3] <= told_deg &&
           range.within[4] <= told_mm;
  };
  if (slips.size() == 1) {
    const Slip& slip = slips.front();
    for (const Range& range : ranges)
      if (range.holds(slip.values) && is_told(range) && chance_of(slip, *stated, range) < 0.5) {
        Change within = range.within;
        within.head<3>() += (slip.values.foot_mm - range.middle.foot_mm).cwiseAbs();
        if (stated->is_box)
          within[3] += std::abs(std::remainder(slip.values.yaw_deg - range.middle.yaw_deg, 90));
        return given(slip.values, within, slip.what);
      }
  }
  if (ranges.size() == 1 && !is_told(ranges.front()))
    return {{},
            fmt::format("the cloth leaves a range of {}, too wide to suggest a value; measure it "
                        "again (in mm), or with a plate of tags (drape object)",
                        text_of(*stated, ranges.front().middle, ranges.front().within))};
  if (ranges.size() == 1) {
    Stated values = ranges.front().middle;
    values.foot_mm = values.foot_mm.unaryExpr(&printed);
    values.yaw_deg = printed(values.yaw_deg);
    values.size_mm = values.size_mm.unaryExpr(&printed);
    if (ranges.front().within[4] == 0) values.size_mm = stated->size_mm;
    if (on_table) values.foot_mm.z() = stated->foot_mm.z();
    if (search.passes(typed(own, values)))
      return given(values, ranges.front().within, "a fit to the cloth: measure the object again");
  }
  if (ranges.size() > 1) {
    std::string all;
    for (const Range& range : ranges)
      all += (all.empty() ? "" : "; or ") + text_of(*stated, range.middle, range.within);
    return {{},
            all +
                " would agree alike, so none is suggested; measure it again (in mm), or with a "
                "plate of tags (drape object)"};
  }
  return {{}, "measure it again (in mm), or look whether the scene is that of another drape"};
}

}  // namespace drape::triangulate
