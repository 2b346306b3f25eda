// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/drapemeter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/geometry/vectors.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector2d;
using units::mm;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr int kHarmonics = 24;
constexpr int kRays = 720;           ///< directions at which the hem's radius is sampled
constexpr double kFoldRatio = 0.02;  ///< least prominence of a crest, relative to the mean radius
constexpr double kSmoothing_rad =
    0.052;  ///< Gaussian smoothing of the radius before counting nodes (3 degrees)

double mean_at(const std::vector<double>& values, const std::vector<std::size_t>& places) {
  double sum = 0;
  for (const std::size_t place : places) sum += values[place];
  return sum / static_cast<double>(places.size());
}

std::vector<double> synthesised(const std::vector<std::complex<double>>& spectrum) {
  std::vector<double> radius(static_cast<std::size_t>(kRays), spectrum[0].real());
  for (std::size_t k = 1; k < spectrum.size(); ++k) {
    const std::complex<double> step = std::polar(1.0, kTurn * static_cast<double>(k) / kRays);
    std::complex<double> turned = spectrum[k];
    for (double& r : radius) {
      r += turned.real();
      turned *= step;
    }
  }
  return radius;
}

/// Circular Gaussian smoothing with standard deviation `sigma` (rad), truncated at four sigma.
std::vector<double> smoothed(const std::vector<double>& radius, double sigma) {
  const auto n = static_cast<std::ptrdiff_t>(radius.size());
  const double step = kTurn / static_cast<double>(n);
  const auto reach = std::min(static_cast<std::ptrdiff_t>(4 * sigma / step), (n - 1) / 2);
  std::vector<double> weight;
  double total = 0;
  for (std::ptrdiff_t j = -reach; j <= reach; ++j) {
    const double at = static_cast<double>(j) * step / sigma;
    weight.push_back(std::exp(-0.5 * at * at));
    total += weight.back();
  }
  std::vector<double> result(radius.size(), 0.0);
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    for (std::ptrdiff_t j = -reach; j <= reach; ++j)
      result[i] += weight[j + reach] / total * radius[(i + j + n) % n];
  }
  return result;
}

Hem scaled(const Hem& hem, double factor) {
  Hem result = hem;
  result.centre_m *= factor;
  result.area_m2 *= factor * factor;
  for (double& r : result.radius_m) r *= factor;
  return result;
}

/// Alternating crests and valleys around a closed outline that differ by at least `least_m`: an
/// extreme counts once the radius has changed from it by that much. Indices into the outline; equal
/// numbers of crests and valleys.
struct Extremes {
  std::vector<std::size_t> crests, valleys;
};
Extremes extremes_of(const std::vector<double>& radius, double least) {
  Extremes found;
  // Starting at the lowest point, the first significant extreme is a crest.
  const auto start =
      static_cast<std::size_t>(std::min_element(radius.begin(), radius.end()) - radius.begin());
  bool climbing = true;
  std::size_t extreme = start;
  for (std::size_t i = 1; i <= radius.size(); ++i) {
    const std::size_t here = (start + i) % radius.size();
    if (climbing ? radius[here] > radius[extreme] : radius[here] < radius[extreme]) extreme = here;
    if (std::abs(radius[extreme] - radius[here]) < least) continue;
    (climbing ? found.crests : found.valleys).push_back(extreme);
    climbing = !climbing;
    extreme = here;
  }
  // The walk ends in the valley where it started.
  if (!climbing) found.valleys.push_back(extreme);
  return found;
}

/// Area of an obstacle's flat top, if it is an upright box; nullopt for a sphere.
std::optional<double> support_area_m2(const Obstacle& obstacle) {
  if (const auto* cylinder = std::get_if<Cylinder>(&obstacle)) {
    if (std::abs(cylinder->world_from_cylinder.rotation(2, 2)) < 1 - 1e-9) return std::nullopt;
    return std::numbers::pi * cylinder->radius_m * cylinder->radius_m;
  }
  const auto* box = std::get_if<Box>(&obstacle);
  if (box == nullptr || std::abs(box->world_from_box.rotation(2, 2)) < 1 - 1e-9)
    return std::nullopt;
  return box->size_m.x() * box->size_m.y();
}

}  // namespace

std::vector<std::complex<double>> spectrum_of(const std::vector<double>& radius, int most) {
  const auto n = static_cast<double>(radius.size());
  const auto orders = static_cast<std::size_t>(most) + 1;
  // Separate real and imaginary parts, so that the compiler can vectorise over orders.
  std::vector<double> step_re(orders), step_im(orders), re(orders, 1.0), im(orders, 0.0);
  std::vector<double> sum_re(orders, 0.0), sum_im(orders, 0.0);
  for (std::size_t k = 0; k < orders; ++k) {
    const std::complex<double> step = std::polar(1.0, -kTurn * static_cast<double>(k) / n);
    step_re[k] = step.real();
    step_im[k] = step.imag();
  }
  for (const double r : radius) {
    for (std::size_t k = 0; k < orders; ++k) {
      sum_re[k] += r * re[k];
      sum_im[k] += r * im[k];
      const double turned = re[k] * step_re[k] - im[k] * step_im[k];
      im[k] = re[k] * step_im[k] + im[k] * step_re[k];
      re[k] = turned;
    }
  }
  std::vector<std::complex<double>> result;
  for (std::size_t k = 0; k < orders; ++k) {
    const double part = k == 0 ? 1 / n : 2 / n;
    result.emplace_back(sum_re[k] * part, sum_im[k] * part);
  }
  return result;
}

std::optional<std::vector<double>> closed(const std::vector<std::optional<double>>& outline) {
  std::vector<double> radius;
  for (const auto& r : outline)
    if (r) radius.push_back(*r);
  return radius.size() == outline.size() ? std::optional(radius) : std::nullopt;
}

std::vector<MarkId> border_of(int rows, int cols) {
  std::vector<MarkId> border;
  border.reserve(cols);
  for (int col = 0; col < cols; ++col) border.push_back({0, col});
  for (int row = 1; row < rows; ++row) border.push_back({row, cols - 1});
  for (int col = cols - 2; col >= 0 && rows > 1; --col) border.push_back({rows - 1, col});
  for (int row = rows - 2; row > 0 && cols > 1; --row) border.push_back({row, 0});
  return border;
}

std::string why_no_hem(const Sheet& sheet) {
  const std::vector<MarkId> border = border_of(sheet.rows, sheet.cols);
  const auto missing = std::count_if(border.begin(), border.end(),
                                     [&](MarkId id) { return sheet.find(id) == nullptr; });
  if (missing == 0) return {};
  return fmt::format("the hem was not measured all around: {} of {} outermost marks are missing",
                     missing, border.size());
}

void raise_outline(std::vector<std::optional<double>>& outline, const Eigen::Vector2d& a,
                   const Eigen::Vector2d& b) {
  const auto rays = static_cast<double>(outline.size());
  const double step = kTurn / rays;
  const double from = std::atan2(a.y(), a.x());
  double span = std::atan2(b.y(), b.x()) - from;
  span -= kTurn * std::round(span / kTurn);
  const double low = std::min(from, from + span) / step, high = std::max(from, from + span) / step;
  // A ray within rounding of an end belongs to the segment, so that no vertex is missed.
  const auto last = std::lround(std::floor(high + 1e-9));
  for (auto k = std::lround(std::ceil(low - 1e-9)); k <= last; ++k) {
    const double angle = static_cast<double>(k) * step;
    const Eigen::Vector2d ray(std::cos(angle), std::sin(angle));
    const Eigen::Vector2d edge = b - a;
    const double across = cross(ray, edge), moment = cross(a, edge);
    // An edge along the ray extends to its farther end.
    const double radius = std::abs(across) > 1e-15 * (1e-9 + edge.norm())
                              ? std::clamp(moment / across, 0.0, std::max(a.norm(), b.norm()))
                              : std::max(a.norm(), b.norm());
    const auto count = static_cast<long>(outline.size());
    auto& slot = outline[static_cast<std::size_t>((k % count + count) % count)];
    slot = std::max(slot.value_or(0), radius);
  }
}

std::optional<Eigen::Vector2d> centre_of(const Obstacle& obstacle) {
  if (const auto* sphere = std::get_if<Sphere>(&obstacle)) return sphere->centre_in_world.head<2>();
  if (const auto* box = std::get_if<Box>(&obstacle))
    return box->world_from_box.translation_m.head<2>();
  if (const auto* cylinder = std::get_if<Cylinder>(&obstacle))
    return cylinder->world_from_cylinder.translation_m.head<2>();
  return std::nullopt;
}

std::vector<std::optional<double>> shadow_outline(const Sheet& sheet,
                                                  const Eigen::Vector2d& centre_m, int rays) {
  std::vector<std::optional<double>> outline(static_cast<std::size_t>(rays));
  for (const SheetMark& mark : sheet.marks)
    for (const MarkId next :
         {MarkId{mark.mark.row + 1, mark.mark.col}, MarkId{mark.mark.row, mark.mark.col + 1}})
      if (const SheetMark* other = sheet.find(next))
        raise_outline(outline, mark.point_in_world.head<2>() - centre_m,
                      other->point_in_world.head<2>() - centre_m);
  return outline;
}

Drapemeter drapemeter_of(const std::vector<double>& radius_m, double flat_area_m2,
                         std::optional<double> support_area_m2) {
  Drapemeter result;
  const std::size_t n = radius_m.size();
  const double wedge = 0.5 * std::sin(kTurn / static_cast<double>(n));
  for (std::size_t i = 0; i < n; ++i)
    result.covered_area_m2 += wedge * radius_m[i] * radius_m[(i + 1) % n];
  result.flat_area_m2 = flat_area_m2;
  if (support_area_m2 && *support_area_m2 < flat_area_m2)
    result.drape_coefficient =
        (result.covered_area_m2 - *support_area_m2) / (flat_area_m2 - *support_area_m2);
  result.mean_radius_m = mean_of(radius_m);
  const Extremes extremes = extremes_of(radius_m, kFoldRatio * result.mean_radius_m);
  result.folds = static_cast<int>(extremes.crests.size());
  if (!extremes.crests.empty() && !extremes.valleys.empty())
    result.fold_depth_m = mean_at(radius_m, extremes.crests) - mean_at(radius_m, extremes.valleys);
  const auto spectrum = spectrum_of(radius_m, kHarmonics);
  for (int order = 1; order <= kHarmonics; ++order) {
    const std::complex<double> one = std::conj(spectrum[static_cast<std::size_t>(order)]);
    result.spectrum.push_back({order, std::abs(one), one == 0.0 ? 0 : std::arg(one)});
  }
  return result;
}

DrapemeterResult drapemeter(const Sheet& sheet, const Scene& scene) {
  if (scene.obstacles.size() != 1) return {{}, "it needs exactly one object under the cloth"};
  if (std::string reason = why_no_hem(sheet); !reason.empty()) return {{}, std::move(reason)};
  const Obstacle& obstacle = scene.obstacles.front();
  const std::optional<Eigen::Vector2d> centre_m = centre_of(obstacle);
  if (!centre_m) return {{}, "a plane or a mesh has no centre for it"};
  const auto radius = closed(shadow_outline(sheet, *centre_m, kRays));
  if (!radius) return {{}, "the cloth does not lie all around the object's centre"};
  Drapemeter value = drapemeter_of(*radius, sheet.patch_m.prod(), support_area_m2(obstacle));
  value.centre_in_world = *centre_m;
  return {value, {}};
}

void DrapemeterGeometry::check() const {
  if (disc_m > 0 && specimen_m > disc_m) return;
  throw usage_error(
      fmt::format("a disc of {:g} mm under a specimen of {:g} mm", disc_m / mm, specimen_m / mm),
      "give both diameters, the disc's smaller than the specimen's");
}

DrapemeterGeometry geometry_of(StandardTest test) {
  constexpr std::array<std::pair<double, double>, 4> kDiscAndSpecimen{
      {{0.180, 0.240}, {0.180, 0.300}, {0.180, 0.360}, {0.127, 0.254}}};
  const auto [disc_m, specimen_m] = kDiscAndSpecimen.at(static_cast<std::size_t>(test));
  return {std::string(name_of(test)), disc_m, specimen_m};
}

Hem hem_of_outline(const std::vector<Vector2d>& outline_m) {
  const std::size_t n = outline_m.size();
  Hem hem{Vector2d::Zero(), 0, {}, {}};
  if (n < 3) throw bad_input("the outline has fewer than three points", {}, "check the picture");
  const Vector2d& origin = outline_m.front();
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2d a = outline_m[i] - origin, b = outline_m[(i + 1) % n] - origin;
    hem.area_m2 += cross(a, b) / 2;
    hem.centre_m += cross(a, b) * (a + b) / 6;
  }
  hem.centre_m = origin + hem.centre_m / hem.area_m2;
  hem.area_m2 = std::abs(hem.area_m2);
  std::vector<std::optional<double>> radius(static_cast<std::size_t>(kRays));
  for (std::size_t i = 0; i < n; ++i)
    raise_outline(radius, outline_m[i] - hem.centre_m, outline_m[(i + 1) % n] - hem.centre_m);
  const auto whole = closed(radius);
  if (!whole) throw bad_input("the hem does not go around its centre", {}, "check the picture");
  hem.radius_m = *whole;
  return hem;
}

Hem hem_of_radii(const std::vector<double>& radius_m) {
  if (radius_m.size() < 3) throw bad_input("a hem of fewer than three radii", {}, "give 72");
  double square = 0;
  for (const double r : radius_m) square += r * r;
  const double area = std::numbers::pi * square / static_cast<double>(radius_m.size());
  const auto spectrum = spectrum_of(radius_m, (static_cast<int>(radius_m.size()) - 1) / 2);
  return {Vector2d::Zero(), area, synthesised(spectrum), {}};
}

std::vector<HemNode> nodes_of(const Hem& hem) {
  const std::vector<double> radius = smoothed(hem.radius_m, kSmoothing_rad);
  const double mean = mean_of(radius);
  const Extremes found = extremes_of(radius, kFoldRatio * mean);
  const std::size_t n = radius.size(), count = found.crests.size();
  const double step = kTurn / static_cast<double>(n);
  std::vector<HemNode> nodes;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t crest = found.crests[k], next = found.crests[(k + 1) % count];
    // The walk starts in the last valley, so valley k follows crest k.
    const double valleys =
        (radius[found.valleys[k]] + radius[found.valleys[(k + count - 1) % count]]) / 2;
    const std::size_t gap = count == 1 ? n : (next + n - crest) % n;
    nodes.push_back({step * static_cast<double>(crest), radius[crest],
                     (radius[crest] - valleys) / 2, mean * step * static_cast<double>(gap)});
  }
  std::sort(nodes.begin(), nodes.end(),
            [](const HemNode& a, const HemNode& b) { return a.angle_rad < b.angle_rad; });
  return nodes;
}

std::vector<HemNumber> numbers_of(const Hem& hem, const DrapemeterGeometry& geometry) {
  const double disc = circle_m2(geometry.disc_m);
  const double specimen = hem.flat_area_m2.value_or(circle_m2(geometry.specimen_m));
  const double specimen_radius = std::sqrt(specimen / std::numbers::pi);
  const double ring = specimen_radius - geometry.disc_m / 2;
  const auto spectrum = spectrum_of(hem.radius_m, kHemOrders);
  const double mean = spectrum[0].real();
  const auto [least, most] = std::minmax_element(hem.radius_m.begin(), hem.radius_m.end());
  const std::vector<HemNode> nodes = nodes_of(hem);
  double amplitude = 0, wavelength = 0;
  for (const HemNode& node : nodes) {
    amplitude += node.amplitude_m / static_cast<double>(nodes.size());
    wavelength += node.wavelength_m / static_cast<double>(nodes.size());
  }
  std::vector<HemNumber> numbers = {
      {"drape_coefficient_percent", 100 * (hem.area_m2 - disc) / (specimen - disc), {}},
      {"drape_distance_ratio_percent", 100 * (specimen_radius - mean) / ring, {}},
      {"fold_depth_index_percent", 100 * (*most - *least) / ring, {}},
      {"nodes", static_cast<double>(nodes.size()), {}},
      {"node_amplitude_mm", amplitude / mm, {}},
      {"node_wavelength_mm", wavelength / mm, {}},
      {"area_mm2", hem.area_m2 / (mm * mm), {}},
      {"mean_radius_mm", mean / mm, {}},
      {"least_radius_mm", *least / mm, {}},
      {"largest_radius_mm", *most / mm, {}}};
  for (int k = 0; k <= kHemOrders; ++k)
    numbers.push_back({fmt::format("order_{:02d}_mm", k), std::abs(spectrum[k]) / mm, {}});
  return numbers;
}

std::vector<HemNumber> numbers_with_u(const Hem& hem, const HemErrors& errors,
                                      const DrapemeterGeometry& geometry) {
  std::vector<HemNumber> numbers = numbers_of(hem, geometry);
  if (!errors.edges && !errors.scale_u && !errors.tilts) return numbers;
  std::vector<double> squares(numbers.size(), 0.0);
  const auto add = [&](const Hem& low, const Hem& high, double divisor) {
    const auto a = numbers_of(low, geometry), b = numbers_of(high, geometry);
    for (std::size_t i = 0; i < squares.size(); ++i)
      squares[i] += std::pow((b[i].value - a[i].value) / divisor, 2);
  };
  if (errors.edges) add(errors.edges->first, errors.edges->second, 2 * std::sqrt(3.0));
  if (errors.scale_u) add(scaled(hem, 1 - *errors.scale_u), scaled(hem, 1 + *errors.scale_u), 2);
  if (errors.tilts) {
    const auto a = numbers_of(errors.tilts->first, geometry);
    const auto b = numbers_of(errors.tilts->second, geometry);
    for (std::size_t i = 0; i < squares.size(); ++i) {
      const double value = numbers[i].value;  // an amplitude may exceed it on both sides
      squares[i] +=
          std::pow(std::max(std::abs(a[i].value - value), std::abs(b[i].value - value)), 2) / 3;
    }
  }
  for (std::size_t i = 0; i < squares.size(); ++i) numbers[i].u = 2 * std::sqrt(squares[i]);
  return numbers;
}

double number_named(const std::vector<HemNumber>& numbers, const std::string& name) {
  const auto found = std::find_if(numbers.begin(), numbers.end(),
                                  [&](const HemNumber& number) { return number.name == name; });
  if (found == numbers.end()) throw internal_error("no number of a hem is called " + name);
  return found->value;
}

std::vector<double> order_amplitudes_m(const Hem& hem) {
  std::vector<double> amplitudes;
  for (const auto& one : spectrum_of(hem.radius_m, kHemOrders)) amplitudes.push_back(std::abs(one));
  return amplitudes;
}

std::vector<double> thinned(const std::vector<double>& radius) {
  std::vector<double> result;
  for (std::size_t i = 0; i < radius.size(); i += radius.size() / kHemRays)
    result.push_back(radius[i]);
  return result;
}

double hem_distance_m(const Hem& first, const Hem& second) {
  const std::vector<double> a = thinned(first.radius_m), b = thinned(second.radius_m);
  double squares = 0, best = 0;
  for (int i = 0; i < kHemRays; ++i) squares += a[i] * a[i] + b[i] * b[i];
  // b repeated: each rotation of b is a part of it.
  std::array<double, 2 * kHemRays> twice;
  std::copy(b.begin(), b.end(), twice.begin());
  for (int mirrored = 0; mirrored < 2; ++mirrored) {
    std::copy_n(twice.begin(), kHemRays, twice.begin() + kHemRays);
    std::array<double, kHemRays> products{};
    for (int i = 0; i < kHemRays; ++i)
      for (int turn = 0; turn < kHemRays; ++turn) products[turn] += a[i] * twice[i + turn];
    best = std::max(best, *std::max_element(products.begin(), products.end()));
    std::reverse(twice.begin(), twice.begin() + kHemRays);
  }
  return std::sqrt(std::max(0.0, (squares - 2 * best) / kHemRays));
}

}  // namespace drape::compare
