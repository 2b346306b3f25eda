// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/drapemeter.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numeric>
#include <unsupported/Eigen/FFT>

#include "core/geometry/vectors.hpp"
#include "core/statistics/sample.hpp"

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

/// Circular Gaussian smoothing with standard deviation kSmoothing_rad.
std::vector<double> smoothed(const std::vector<double>& radius) {
  const double most = std::min(6 / kSmoothing_rad, (static_cast<double>(radius.size()) - 1) / 2);
  auto spectrum = spectrum_of(radius, static_cast<int>(most));
  for (std::size_t k = 0; k < spectrum.size(); ++k)
    spectrum[k] *= std::exp(-0.5 * std::pow(static_cast<double>(k) * kSmoothing_rad, 2));
  return radii_of(std::move(spectrum), kRays);
}

Hem scaled(const Hem& hem, double factor) {
  Hem result = hem;
  result.centre_m *= factor;
  result.area_m2 *= factor * factor;
  for (double& r : result.radius_m) r *= factor;
  return result;
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

std::optional<std::vector<double>> closed(const std::vector<std::optional<double>>& outline) {
  std::vector<double> radius;
  for (const auto& r : outline)
    if (r) radius.push_back(*r);
  return radius.size() == outline.size() ? std::optional(radius) : std::nullopt;
}

std::vector<MarkId> border_of(int rows, int cols) {
  std::vector<MarkId> border;
  for (int col = 0; col < cols; ++col) border.push_back({0, col});
  for (int row = 1; row < rows; ++row) border.push_back({row, cols - 1});
  for (int col = cols - 2; col >= 0 && rows > 1; --col) border.push_back({rows - 1, col});
  for (int row = rows - 2; row > 0 && cols > 1; --row) border.push_back({row, 0});
  return border;
}

std::string why_no_hem(const Sheet& sheet) {
  const std::vector<MarkId> border = border_of(sheet.rows, sheet.cols);
  const auto missing =
      std::ranges::count_if(border, [&](MarkId id) { return sheet.find(id) == nullptr; });
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
  std::vector<std::optional<double>> outline(rays);
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
  const auto mean_at = [&](const std::vector<std::size_t>& places) {
    double sum = 0;
    for (const std::size_t place : places) sum += radius_m[place];
    return sum / static_cast<double>(places.size());
  };
  if (!extremes.crests.empty() && !extremes.valleys.empty())
    result.fold_depth_m = mean_at(extremes.crests) - mean_at(extremes.valleys);
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

AreaMoments moments_of(const std::vector<Vector2d>& outline) {
  AreaMoments moments;
  if (outline.empty()) return moments;
  const Vector2d& origin = outline.front();
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vector2d a = outline[i] - origin, b = outline[(i + 1) % outline.size()] - origin;
    const double twice = cross(a, b);
    moments.area += twice / 2;
    moments.centre += twice / 6 * (a + b);
    moments.spread +=
        twice / 24 * (a * a.transpose() + b * b.transpose() + (a + b) * (a + b).transpose());
  }
  moments.centre /= moments.area;
  moments.spread = moments.spread / moments.area - moments.centre * moments.centre.transpose();
  moments.centre += origin;
  return moments;
}

Hem hem_of_outline(const std::vector<Vector2d>& outline_m) {
  const std::size_t n = outline_m.size();
  if (n < 3) throw bad_input("the outline has fewer than three points", {}, "check the picture");
  const AreaMoments moments = moments_of(outline_m);
  Hem hem{moments.centre, std::abs(moments.area), {}, {}};
  std::vector<std::optional<double>> radius(kRays);
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
  return {Vector2d::Zero(), area, radii_of(spectrum, kRays), {}};
}

std::vector<HemNode> nodes_of(const Hem& hem) {
  const std::vector<double> radius = smoothed(hem.radius_m);
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
  std::ranges::sort(nodes, {}, &HemNode::angle_rad);
  return nodes;
}

std::vector<HemNumber> numbers_of(const Hem& hem, const DrapemeterGeometry& geometry) {
  const double disc = circle_m2(geometry.disc_m);
  const double specimen = hem.flat_area_m2.value_or(circle_m2(geometry.specimen_m));
  const double specimen_radius = std::sqrt(specimen / std::numbers::pi);
  const double ring = specimen_radius - geometry.disc_m / 2;
  const auto spectrum = spectrum_of(hem.radius_m, kHemOrders);
  const double mean = spectrum[0].real();
  const auto [least, most] = std::ranges::minmax_element(hem.radius_m);
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
  const auto add = [&](const Hem& low, const Hem& high, const auto& deviation) {
    const auto a = numbers_of(low, geometry), b = numbers_of(high, geometry);
    for (std::size_t i = 0; i < squares.size(); ++i)
      squares[i] +=
          std::pow(deviation(a[i].value - numbers[i].value, b[i].value - numbers[i].value), 2);
  };
  if (errors.edges)
    add(errors.edges->first, errors.edges->second,
        [](double a, double b) { return (b - a) / std::sqrt(12.0); });
  if (errors.scale_u)
    add(scaled(hem, 1 - *errors.scale_u), scaled(hem, 1 + *errors.scale_u),
        [](double a, double b) { return (b - a) / 2; });
  if (errors.tilts)  // an amplitude may exceed its value on both sides
    add(errors.tilts->first, errors.tilts->second,
        [](double a, double b) { return std::max(std::abs(a), std::abs(b)) / std::sqrt(3.0); });
  for (std::size_t i = 0; i < squares.size(); ++i) numbers[i].u = 2 * std::sqrt(squares[i]);
  return numbers;
}

double number_named(const std::vector<HemNumber>& numbers, const std::string& name) {
  const auto found = std::ranges::find(numbers, name, &HemNumber::name);
  if (found == numbers.end()) throw internal_error("no number of a hem is called " + name);
  return found->value;
}

Eigen::VectorXd order_amplitudes_m(const Hem& hem) {
  const auto spectrum = spectrum_of(hem.radius_m, kHemOrders);
  return Eigen::Map<const Eigen::VectorXcd>(spectrum.data(), kHemOrders + 1).cwiseAbs();
}

std::vector<double> thinned(const std::vector<double>& radius) {
  std::vector<double> result;
  for (std::size_t i = 0; i < radius.size(); i += radius.size() / kHemRays)
    result.push_back(radius[i]);
  return result;
}

double hem_distance_m(const Hem& first, const Hem& second) {
  const std::vector<double> a = thinned(first.radius_m), b = thinned(second.radius_m);
  Eigen::FFT<double> transform;
  std::vector<std::complex<double>> of_a, of_b;
  std::vector<double> products;
  transform.fwd(of_a, a);
  transform.fwd(of_b, b);
  double best = 0;
  for (const bool mirrored : {false, true}) {
    std::vector<std::complex<double>> turned;
    for (std::size_t k = 0; k < of_a.size(); ++k)
      turned.push_back((mirrored ? of_a[k] : std::conj(of_a[k])) * of_b[k]);
    transform.inv(products, turned);
    best = std::max(best, *std::ranges::max_element(products));
  }
  const double squares = std::inner_product(a.begin(), a.end(), a.begin(), 0.0) +
                         std::inner_product(b.begin(), b.end(), b.begin(), 0.0);
  return std::sqrt(std::max(0.0, (squares - 2 * best) / kHemRays));
}

}  // namespace drape::compare
