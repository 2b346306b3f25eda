// SPDX-License-Identifier: Apache-2.0
#include "compare/repeats/hem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>

#include "core/error.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector2d;
using units::mm;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr int kRays = 720;
constexpr int kRaysCompared = 72;
constexpr double kFoldRatio = 0.02;  ///< prominence of a node, relative to the mean radius
constexpr double kSmoothing_rad =
    0.052;  ///< Gaussian smoothing of the radius before counting nodes (3 degrees)

double disc_area(double diameter) {
  return std::numbers::pi / 4 * diameter * diameter;
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

std::vector<double> thinned(const std::vector<double>& radius) {
  const std::size_t every = radius.size() / kRaysCompared;
  std::vector<double> result;
  for (std::size_t i = 0; i < kRaysCompared; ++i) result.push_back(radius[i * every]);
  return result;
}

}  // namespace

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
  const double mean =
      std::accumulate(radius.begin(), radius.end(), 0.0) / static_cast<double>(radius.size());
  Extremes found = extremes_of(radius, kFoldRatio * mean);
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
  const double disc = disc_area(geometry.disc_m);
  const double specimen = hem.flat_area_m2.value_or(disc_area(geometry.specimen_m));
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

std::vector<double> order_amplitudes_m(const Hem& hem, int most) {
  std::vector<double> amplitudes;
  for (const auto& one : spectrum_of(hem.radius_m, most)) amplitudes.push_back(std::abs(one));
  return amplitudes;
}

double hem_distance_m(const Hem& first, const Hem& second) {
  const std::vector<double> a = thinned(first.radius_m), b = thinned(second.radius_m);
  double squares = 0, best = 0;
  for (int i = 0; i < kRaysCompared; ++i) squares += a[i] * a[i] + b[i] * b[i];
  // b repeated: each rotation of b is a part of it.
  std::array<double, 2 * kRaysCompared> twice;
  std::copy(b.begin(), b.end(), twice.begin());
  for (int mirrored = 0; mirrored < 2; ++mirrored) {
    std::copy_n(twice.begin(), kRaysCompared, twice.begin() + kRaysCompared);
    std::array<double, kRaysCompared> products{};
    for (int i = 0; i < kRaysCompared; ++i)
      for (int turn = 0; turn < kRaysCompared; ++turn) products[turn] += a[i] * twice[i + turn];
    best = std::max(best, *std::max_element(products.begin(), products.end()));
    std::reverse(twice.begin(), twice.begin() + kRaysCompared);
  }
  return std::sqrt(std::max(0.0, (squares - 2 * best) / kRaysCompared));
}

}  // namespace drape::compare
