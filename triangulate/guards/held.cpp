// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/held.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/geometry/body.hpp"
#include "core/statistics/sample.hpp"
#include "triangulate/guards/objects.hpp"

namespace drape::triangulate {

using Eigen::Index, Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Vector2d, Eigen::Vector3d,
    Eigen::VectorXd;
using units::mm;

namespace {

/// A point of the cloth that the scene holds in place: a pin with at_mm, or an end of a
/// clamp.
struct HeldPoint {
  std::string name;  ///< "pin 1, at_mm"
  Eigen::Vector2d material_m;
  Eigen::Vector3d point_in_world;
  double place_m = 0;  ///< standard uncertainty along each axis
};

constexpr std::size_t kNear = 60;    ///< number of marks for interpolation
constexpr std::size_t kLearnt = 16;  ///< number of marks for estimating the prediction error
constexpr std::size_t kLeastNear = 9;
constexpr Index kTrend = 3;  ///< a constant and two slopes

/// Probability of contradicting a correct scene, over all of its held points.
constexpr double kHeldRisk = 0.005;
constexpr double kPrinted_m = 0.1 * mm;  ///< rounding of suggested positions
constexpr std::size_t kMostExchanged = 4;

Vector2d material_of(const MarkLattice& lattice, MarkId mark) {
  return lattice.margin_m + lattice.pitch_m * Vector2d(mark.row, mark.col);
}

Vector2d material_of(const MarkLattice& lattice, const Pin& pin) {
  return pin.at_material_m.value_or(material_of(lattice, pin.mark));
}

std::vector<HeldPoint> held_points(const Scene& scene, const MarkLattice& lattice) {
  std::vector<HeldPoint> held;
  for (std::size_t i = 0; i < scene.pins.size(); ++i) {
    const Pin& pin = scene.pins[i];
    if (pin.point_in_world)
      held.push_back({fmt::format("pin {}, at_mm", i + 1), material_of(lattice, pin),
                      *pin.point_in_world, pin.place_m()});
  }
  for (std::size_t i = 0; i < scene.clamps.size(); ++i) {
    const Clamp& clamp = scene.clamps[i];
    held.push_back({fmt::format("clamp {}, from_mm", i + 1), clamp.from_material_m,
                    clamp.from_in_world, clamp.place_m()});
    held.push_back({fmt::format("clamp {}, to_mm", i + 1), clamp.to_material_m, clamp.to_in_world,
                    clamp.place_m()});
  }
  return held;
}

/// Names the material point as the pin did: by a mark if it has one.
void hold(Pin& pin, const Vector2d& material_m, const MarkLattice& lattice) {
  const Vector2d steps = (material_m - lattice.margin_m) / lattice.pitch_m;
  const MarkId mark{static_cast<int>(std::lround(steps.x())),
                    static_cast<int>(std::lround(steps.y()))};
  const bool is_mark = (material_of(lattice, mark) - material_m).norm() < 1e-9 && mark.row >= 0 &&
                       mark.row < lattice.rows && mark.col >= 0 && mark.col < lattice.cols;
  if (pin.at_material_m || !is_mark)
    pin.at_material_m = material_m;
  else
    pin.mark = mark;
}

/// Calls `change` for each position in space, and `material` for each point of the cloth.
void change_places(Scene& scene, const std::function<void(Vector3d&)>& change) {
  for (Pin& pin : scene.pins)
    if (pin.point_in_world) change(*pin.point_in_world);
  for (Clamp& clamp : scene.clamps) {
    change(clamp.from_in_world);
    change(clamp.to_in_world);
  }
}

void change_material(Scene& scene, const MarkLattice& lattice,
                     const std::function<Vector2d(const Vector2d&)>& change) {
  for (Pin& pin : scene.pins) hold(pin, change(material_of(lattice, pin)), lattice);
  for (Clamp& clamp : scene.clamps) {
    clamp.from_material_m = change(clamp.from_material_m);
    clamp.to_material_m = change(clamp.to_material_m);
  }
}

std::string list_of(const Vector3d& place_m) {
  return fmt::format("[{:.1f}, {:.1f}, {:.1f}]", place_m.x() / mm, place_m.y() / mm,
                     place_m.z() / mm);
}

/// Lists the keys whose values differ, as they would appear in the file.
std::string changes_text(const Scene& from, const Scene& to) {
  std::string text;
  const auto add = [&](const std::string& more) { text += (text.empty() ? "" : ", ") + more; };
  const auto material = [](const Vector2d& m) {
    return fmt::format("[{:g}, {:g}]", m.x() / mm, m.y() / mm);
  };
  for (std::size_t i = 0; i < from.pins.size(); ++i) {
    const Pin &old = from.pins[i], &pin = to.pins[i];
    const std::string name = fmt::format("pin {}", i + 1);
    if (pin.at_material_m != old.at_material_m)
      add(fmt::format("{}: at_material_mm = {}", name, material(*pin.at_material_m)));
    else if (pin.mark != old.mark)
      add(fmt::format("{}: row = {}, col = {}", name, pin.mark.row, pin.mark.col));
    if (pin.point_in_world != old.point_in_world)
      add(fmt::format("{}: at_mm = {}", name, list_of(*pin.point_in_world)));
  }
  for (std::size_t i = 0; i < from.clamps.size(); ++i) {
    const Clamp &old = from.clamps[i], &clamp = to.clamps[i];
    const std::string name = fmt::format("clamp {}", i + 1);
    if (clamp.from_material_m != old.from_material_m || clamp.to_material_m != old.to_material_m)
      add(fmt::format("{}: from_material_mm = {}, to_material_mm = {}", name,
                      material(clamp.from_material_m), material(clamp.to_material_m)));
    if (clamp.from_in_world != old.from_in_world || clamp.to_in_world != old.to_in_world)
      add(fmt::format("{}: from_mm = {}, to_mm = {}", name, list_of(clamp.from_in_world),
                      list_of(clamp.to_in_world)));
  }
  return text;
}

/// Comparison of a held point with the measured cloth at its material point.
struct Comparison {
  HeldPoint held;
  ShownPlace shown;

  [[nodiscard]] Matrix3d covariance_m2() const {
    return shown.covariance_m2 + held.place_m * held.place_m * Matrix3d::Identity();
  }
  [[nodiscard]] Vector3d apart_m() const { return held.point_in_world - shown.point_in_world; }
  [[nodiscard]] double chi2() const {
    return apart_m().dot(covariance_m2().ldlt().solve(apart_m()));
  }
  /// In the least certain direction.
  [[nodiscard]] double largest_sd_m() const {
    return std::sqrt(covariance_m2().selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff());
  }
};

double held_limit(std::size_t points) {
  return chi_square_beyond(kHeldRisk / static_cast<double>(points), 3);
}

std::vector<Comparison> compared(const MeasuredCloth& cloth, const Scene& scene,
                                 const MarkLattice& lattice) {
  std::vector<Comparison> all;
  for (HeldPoint& held : held_points(scene, lattice))
    if (const auto shown = cloth.at(held.material_m)) all.push_back({std::move(held), *shown});
  return all;
}

bool passes(const std::vector<Comparison>& all) {
  return std::all_of(all.begin(), all.end(),
                     [&](const Comparison& one) { return one.chi2() <= held_limit(all.size()); });
}

struct Other {
  std::string what;
  Scene scene;
};

/// Scenes with one plausible typing error each, without any fit.
std::vector<Other> slips_of(const Scene& scene, const MarkLattice& lattice) {
  std::vector<Other> others;
  const auto add = [&](const std::string& what, auto&& change) {
    Other other{what, scene};
    change(other.scene);
    others.push_back(std::move(other));
  };
  const Vector2d patch = lattice.patch_m;
  using Map = std::function<Vector2d(const Vector2d&)>;
  std::vector<std::pair<const char*, Map>> maps = {
      {"the other end along the warp",
       [=](const Vector2d& m) { return Vector2d(patch.x() - m.x(), m.y()); }},
      {"the other end along the weft",
       [=](const Vector2d& m) { return Vector2d(m.x(), patch.y() - m.y()); }},
      {"the cloth turned by 180 degrees", [=](const Vector2d& m) { return Vector2d(patch - m); }}};
  if (std::abs(patch.x() - patch.y()) < 1e-9)
    for (const auto& [what, turn] : std::vector<std::pair<const char*, Map>>{
             {"warp and weft exchanged", [](const Vector2d& m) { return Vector2d(m.y(), m.x()); }},
             {"the cloth turned by 90 degrees",
              [=](const Vector2d& m) { return Vector2d(m.y(), patch.y() - m.x()); }},
             {"the cloth turned by 270 degrees",
              [=](const Vector2d& m) { return Vector2d(patch.x() - m.y(), m.x()); }},
             {"the other diagonal of corners exchanged",
              [=](const Vector2d& m) { return Vector2d(patch.y() - m.y(), patch.x() - m.x()); }}})
      maps.emplace_back(what, turn);
  for (const auto& [what, map] : maps) {
    add(what, [&](Scene& other) { change_material(other, lattice, map); });
    for (std::size_t i = 0; i < scene.pins.size() && scene.pins.size() > 1; ++i)
      add(what, [&](Scene& other) {
        hold(other.pins[i], map(material_of(lattice, scene.pins[i])), lattice);
      });
  }
  // Exchanges positions between pins; the maps above cover those of a clamp's ends.
  if (scene.pins.size() <= kMostExchanged) {
    std::vector<std::size_t> order(scene.pins.size());
    std::iota(order.begin(), order.end(), 0);
    while (std::next_permutation(order.begin(), order.end()))
      add("places exchanged", [&](Scene& other) {
        for (std::size_t i = 0; i < order.size(); ++i)
          other.pins[i].point_in_world = scene.pins[order[i]].point_in_world;
      });
  }
  for (const double factor : {10.0, 0.1, 25.4, 1 / 25.4, 1000.0}) {
    const char* unit = factor == 10     ? "typed in centimetres"
                       : factor == 0.1  ? "typed in tenths of a millimetre"
                       : factor == 25.4 ? "typed in inches"
                       : factor == 1000 ? "typed in metres"
                                        : "mm multiplied as inches";
    add(unit, [&](Scene& other) { change_places(other, [&](Vector3d& at) { at *= factor; }); });
    add(unit, [&](Scene& other) {
      change_material(other, lattice, [&](const Vector2d& m) { return Vector2d(factor * m); });
    });
  }
  for (const int axis : {0, 1, 2})
    add(fmt::format("{} with the other sign", "xyz"[axis]),
        [&](Scene& other) { change_places(other, [&](Vector3d& at) { at[axis] = -at[axis]; }); });
  add("x and y exchanged", [&](Scene& other) {
    change_places(other, [&](Vector3d& at) { std::swap(at.x(), at.y()); });
  });
  std::erase_if(others, [&](const Other& other) {
    const auto held = held_points(other.scene, lattice);
    return std::any_of(held.begin(), held.end(), [&](const HeldPoint& point) {
      return point.material_m.minCoeff() < 0 || (patch - point.material_m).minCoeff() < 0;
    });
  });
  return others;
}

double rounded(double value_m) {
  return std::round(value_m / kPrinted_m) * kPrinted_m;
}

Vector3d rounded(const Vector3d& place_m) {
  return place_m.unaryExpr([](double value_m) { return rounded(value_m); });
}

/// Shifts every position along one axis by the length that fits the marks.
std::vector<Other> shifts_of(const Scene& scene, const std::vector<Comparison>& stated) {
  std::vector<Other> others;
  for (const int axis : {0, 1, 2}) {
    double sum = 0, weights = 0;
    for (const Comparison& one : stated) {
      const double weight = 1 / one.covariance_m2()(axis, axis);
      sum += weight * one.apart_m()[axis];
      weights += weight;
    }
    const double by_m = -rounded(sum / weights);
    Other other{fmt::format("all places moved by {:+.1f} mm along {}", by_m / mm, "xyz"[axis]),
                scene};
    change_places(other.scene, [&](Vector3d& at) { at[axis] += by_m; });
    others.push_back(std::move(other));
  }
  return others;
}

/// Moves one position, or every one, to its measured value.
Other placed(const Scene& scene, const std::vector<Comparison>& stated, const HeldPoint* alone) {
  Other other{alone == nullptr ? "every place as the marks show it" : "that place alone", scene};
  auto next = stated.begin();
  change_places(other.scene, [&](Vector3d& at) {
    if (alone == nullptr || alone == &next->held) at = rounded(next->shown.point_in_world);
    ++next;
  });
  return other;
}

/// Material points and positions, irrespective of how pins and clamps name them.
std::string holding_of(const std::vector<HeldPoint>& held) {
  std::vector<std::string> lines;
  for (const HeldPoint& point : held)
    lines.push_back(fmt::format("{:.4f} {:.4f} {}", point.material_m.x() / mm,
                                point.material_m.y() / mm, list_of(point.point_in_world)));
  std::sort(lines.begin(), lines.end());
  return fmt::format("{}", fmt::join(lines, "\n"));
}

/// Corrected scenes that pass, by the simplest kind of correction with any passing scene.
struct Found {
  std::optional<SuggestedScene> suggested;
  std::vector<std::string> alike;  ///< descriptions if more than one passed
};

Found found_holding(const MeasuredCloth& cloth, const Scene& scene, const MarkLattice& lattice,
                    const std::vector<Comparison>& stated) {
  if (stated.size() != held_points(scene, lattice).size()) return {};
  std::vector<std::vector<Other>> tiers = {slips_of(scene, lattice), {}, {}, {}};
  if (stated.size() > 1) tiers[1] = shifts_of(scene, stated);
  for (const Comparison& one : stated)
    if (one.chi2() > held_limit(stated.size()))
      tiers[2].push_back(placed(scene, stated, &one.held));
  tiers[3].push_back(placed(scene, stated, nullptr));
  double expanded_m = 0;
  for (const Comparison& one : stated) expanded_m = std::max(expanded_m, 2 * one.largest_sd_m());
  for (std::size_t tier = 0; tier < tiers.size(); ++tier) {
    Found found;
    std::vector<std::string> holdings;
    for (Other& other : tiers[tier]) {
      if (!passes(compared(cloth, other.scene, lattice)) ||
          !contradictions_of_gravity(cloth, other.scene, lattice).empty())
        continue;
      const std::string text = changes_text(scene, other.scene);
      std::string holding = holding_of(held_points(other.scene, lattice));
      if (std::find(holdings.begin(), holdings.end(), holding) != holdings.end()) continue;
      holdings.push_back(std::move(holding));
      found.alike.push_back(fmt::format("{} ({})", text, other.what));
      found.suggested = {std::move(other.scene), other.what, tier == 0 ? 0 : expanded_m};
    }
    if (holdings.empty()) continue;
    if (holdings.size() > 1) found.suggested.reset();
    return found;
  }
  return {};
}

/// Measured positions of the points from which the cloth hangs.
std::vector<ShownPlace> hung_by(const MeasuredCloth& cloth, const Scene& scene,
                                const MarkLattice& lattice) {
  std::vector<ShownPlace> points;
  for (const Pin& pin : scene.pins)
    if (const auto shown = cloth.at(material_of(lattice, pin))) points.push_back(*shown);
  return points;
}

/// Centre of mass of a patch of uniform weight: mean over the centres of equal squares, whose
/// errors are assumed to be fully correlated.
std::optional<ShownPlace> centre_of_mass(const MeasuredCloth& cloth, const MarkLattice& lattice) {
  const Eigen::Vector2i counts =
      (lattice.patch_m / lattice.pitch_m).array().round().max(1).cast<int>();
  Vector3d sum = Vector3d::Zero();
  double sd_m = 0;
  for (int i = 0; i < counts.x(); ++i) {
    for (int k = 0; k < counts.y(); ++k) {
      const Vector2d part((i + 0.5) / counts.x(), (k + 0.5) / counts.y());
      const auto shown = cloth.at(part.cwiseProduct(lattice.patch_m));
      if (!shown) return std::nullopt;
      sum += shown->point_in_world;
      sd_m += std::sqrt(shown->covariance_m2.trace() / 3);
    }
  }
  sum /= counts.prod();
  sd_m /= counts.prod();
  return ShownPlace{sum, sd_m * sd_m * Matrix3d::Identity()};
}

bool touches_nothing(const Sheet& sheet, const Scene& scene) {
  if (!scene.clamps.empty()) return false;
  for (const SheetMark& mark : sheet.marks) {
    const double near_m = kThickest_m + kObjectSigmas * scene.table_uncertainty_m();
    if (mark.point_in_world.z() - scene.table_z_m < 5 * near_m) return false;
    for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
      const auto gap_m = distance_to(scene.obstacles[i], mark.point_in_world);
      if (!gap_m || *gap_m < 5 * near_m) return false;
    }
  }
  return true;
}

}  // namespace

std::optional<ShownPlace> MeasuredCloth::at(const Vector2d& material_m) const {
  const std::pair key(material_m.x(), material_m.y());
  const auto known = known_.find(key);
  return known != known_.end() ? known->second : known_[key] = computed(material_m);
}

std::optional<ShownPlace> MeasuredCloth::computed(const Vector2d& material_m) const {
  std::vector<const SheetMark*> marks;
  for (const SheetMark& mark : sheet_.marks) marks.push_back(&mark);
  if (marks.size() < kLeastNear) return std::nullopt;
  const auto away_m = [&](const SheetMark* mark) { return (mark->material_m - material_m).norm(); };
  std::stable_sort(marks.begin(), marks.end(), [&](const SheetMark* one, const SheetMark* other) {
    return away_m(one) < away_m(other);
  });
  marks.resize(std::min(marks.size(), kNear));
  const auto count = static_cast<Index>(marks.size());
  const double unit_m = away_m(marks.back());  // for good scaling of the system
  const auto row_of = [&](const Vector2d& at_m) {
    VectorXd row(count + kTrend);
    for (Index i = 0; i < count; ++i)
      row[i] = std::pow((marks[static_cast<std::size_t>(i)]->material_m - at_m).norm() / unit_m, 3);
    row.tail(kTrend) << 1, (at_m - material_m) / unit_m;
    return row;
  };
  MatrixXd system = MatrixXd::Zero(count + kTrend, count + kTrend);
  MatrixXd places_m = MatrixXd::Zero(count + kTrend, 3);
  for (Index i = 0; i < count; ++i) {
    const SheetMark& mark = *marks[static_cast<std::size_t>(i)];
    system.row(i) = row_of(mark.material_m).transpose();
    system.block(count, i, kTrend, 1) = system.block(i, count, 1, kTrend).transpose();
    places_m.row(i) = mark.point_in_world.transpose();
  }
  const MatrixXd inverse = system.partialPivLu().inverse();
  constexpr double kRounding = 1e-6;
  if (!((system.row(0) * inverse.col(0) - MatrixXd::Ones(1, 1)).norm() < kRounding) ||
      !((inverse * system.col(count)).segment(count, 1) - MatrixXd::Ones(1, 1)).isZero(kRounding))
    return std::nullopt;  // collinear marks
  // With mark i left out, the surface misses it by (inverse * positions)_i / inverse_ii, with
  // variance 1 / inverse_ii (Dubrule 1983).
  Matrix3d coefficient_m2 = Matrix3d::Zero();
  const MatrixXd misses = inverse * places_m;
  const Index learnt = std::min<Index>(count, kLearnt);
  for (Index i = 0; i < learnt; ++i)
    coefficient_m2 += misses.row(i).transpose() * misses.row(i) / inverse(i, i);
  coefficient_m2 /= static_cast<double>(learnt);

  const VectorXd row = row_of(material_m), weights = inverse * row;
  const double variance = std::max(0.0, -weights.dot(row));
  ShownPlace shown{places_m.transpose() * weights, variance * coefficient_m2};
  for (Index i = 0; i < count; ++i)
    if (const auto& own = marks[static_cast<std::size_t>(i)]->covariance_m2)
      shown.covariance_m2 += weights[i] * weights[i] * *own;
  return shown;
}

std::optional<SuggestedScene> suggested_holding(const Sheet& sheet, const Scene& scene,
                                                const MarkLattice& lattice) {
  const MeasuredCloth cloth(sheet);
  const auto stated = compared(cloth, scene, lattice);
  return passes(stated) ? std::nullopt : found_holding(cloth, scene, lattice, stated).suggested;
}

std::vector<std::string> contradictions_of_held(const Sheet& sheet, const Scene& scene,
                                                const MarkLattice& lattice) {
  std::vector<std::string> found;
  const MeasuredCloth cloth(sheet);
  for (std::size_t i = 0; i < scene.pins.size(); ++i) {
    const Pin& pin = scene.pins[i];
    if (pin.point_in_world || pin.at_material_m || sheet.find(pin.mark) != nullptr) continue;
    std::string why = "the print has no such mark";
    for (const Gap& gap : sheet.gaps)
      if (gap.mark == pin.mark) why = gap.reason;
    found.push_back(fmt::format(
        "{}, pin {}: it holds mark ({}, {}), which was not measured ({}); give its place as at_mm, "
        "or pin a material point between measured marks with at_material_mm",
        scene.file.string(), i + 1, pin.mark.row, pin.mark.col, why));
  }
  const std::vector<Comparison> stated = compared(cloth, scene, lattice);
  if (passes(stated)) return found;
  const auto worst = std::max_element(
      stated.begin(), stated.end(),
      [](const Comparison& one, const Comparison& other) { return one.chi2() < other.chi2(); });
  const Found other = found_holding(cloth, scene, lattice, stated);
  std::string remedy = "measure it again (in mm), or look whether the set shows another drape";
  if (other.suggested)
    remedy =
        fmt::format("the marks speak for {}{}", other.alike.front(),
                    other.suggested->expanded_m > 0
                        ? fmt::format(", to {:.1f} mm (k = 2)", other.suggested->expanded_m / mm)
                        : "");
  else if (!other.alike.empty())
    remedy = fmt::format("{} changes would agree alike, e.g. {}: look which is true",
                         other.alike.size(), other.alike.front());
  const HeldPoint& held = worst->held;
  found.push_back(fmt::format(
      "{}, {} = {}: the marks show the cloth's point ({:.1f}, {:.1f}) mm at {}, {:.1f} mm away "
      "(chi square {:.0f}, limit {:.1f}: place {:g} mm, the cloth there {:.2f} mm); {}",
      scene.file.string(), held.name, list_of(held.point_in_world), held.material_m.x() / mm,
      held.material_m.y() / mm, list_of(worst->shown.point_in_world), worst->apart_m().norm() / mm,
      worst->chi2(), held_limit(stated.size()), held.place_m / mm,
      std::sqrt(worst->shown.covariance_m2.trace() / 3) / mm, remedy));
  return found;
}

std::vector<std::pair<std::string, std::string>> unseen_of_held(const Sheet& sheet,
                                                                const Scene& scene,
                                                                const MarkLattice& lattice) {
  std::vector<std::pair<std::string, std::string>> unseen;
  const auto all = compared(MeasuredCloth(sheet), scene, lattice);
  for (const Comparison& one : all)
    unseen.emplace_back(one.held.name,
                        fmt::format("an error of its place below {:.1f} mm would not be seen",
                                    std::sqrt(held_limit(all.size())) * one.largest_sd_m() / mm));
  return unseen;
}

std::vector<std::string> contradictions_of_gravity(const MeasuredCloth& cloth, const Scene& scene,
                                                   const MarkLattice& lattice) {
  if (scene.pins.empty() || scene.pins.size() > 2 || !touches_nothing(cloth.sheet(), scene))
    return {};
  const std::vector<ShownPlace> points = hung_by(cloth, scene, lattice);
  const auto centre = centre_of_mass(cloth, lattice);
  if (points.size() != scene.pins.size() || !centre) return {};
  const bool on_line = points.size() == 2;
  Vector3d below_m = centre->point_in_world - points.front().point_in_world;
  Vector3d across = scene.gravity_m_per_s2.normalized();
  if (on_line) {  // the slope along the line takes this up
    const Vector3d line =
        (points.back().point_in_world - points.front().point_in_world).normalized();
    below_m -= below_m.dot(line) * line;
    across = (across - across.dot(line) * line).normalized();
  }
  const double sd2 =
      (centre->covariance_m2.trace() +
       std::max(points.front().covariance_m2.trace(), points.back().covariance_m2.trace())) /
      3;
  const double depth_m = below_m.norm();
  const Vector3d turn = across.cross(below_m / depth_m);
  const double angle = std::atan2(turn.norm(), across.dot(below_m / depth_m));
  const double sd = std::hypot(scene.level_rad(), std::sqrt(sd2) / depth_m);
  const double limit = std::sqrt(chi_square_beyond(kHeldRisk, on_line ? 1 : 2)) * sd;
  if (angle <= limit) return {};
  const Vector3d g = Eigen::AngleAxisd(angle, turn.normalized()) * scene.gravity_m_per_s2;
  return {fmt::format(
      "{}, gravity_m_per_s2: the centre of mass of cloth that hangs from {} lies straight below "
      "{}, "
      "and the marks show it {:.2f} degrees beside (limit {:.2f}: level {:g} degrees, the cloth's "
      "centre {:.2f} mm at {:.0f} mm depth); level the target that set the world, or give "
      "gravity_m_per_s2 = [{:.3f}, {:.3f}, {:.3f}]",
      scene.file.string(), on_line ? "two pins" : "a pin", on_line ? "their line" : "it",
      angle / units::deg, limit / units::deg, scene.level_rad() / units::deg, std::sqrt(sd2) / mm,
      depth_m / mm, g.x(), g.y(), g.z())};
}

}  // namespace drape::triangulate
