// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/detection_limit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace drape::triangulate {
namespace {

using units::deg;
using units::mm;

constexpr double kResolution = 0.5;  ///< mm or degrees of a limit: an operator's reading

/// A direction in which an operator may be wrong.
struct Direction {
  const char* text;
  int parameter;  ///< of Change
  double sign;
};

/// The smallest error along a direction from which on the guard names the object; nothing where it
/// names none up to `most`.
std::optional<double> limit_along(const SeenCloth& seen, const Obstacle& object,
                                  const ObjectUncertainty& stated, const Direction& direction,
                                  double most) {
  const auto is_named = [&](double error) {
    Change change = Change::Zero();
    change[direction.parameter] = direction.sign * error;
    return is_contradicted(seen, changed(object, change), stated);
  };
  if (!is_named(most)) return std::nullopt;
  double below = 0, named = most;
  while (named - below > kResolution) {
    const double middle = 0.5 * (below + named);
    (is_named(middle) ? named : below) = middle;
  }
  return named;
}

std::string limit_text(const SeenCloth& seen, const Obstacle& object,
                       const ObjectUncertainty& stated, const std::vector<Direction>& directions,
                       double most, const char* what, const char* unit) {
  double worst = 0;
  const char* where = directions.front().text;
  for (const Direction& direction : directions) {
    // Up to the worst so far it is enough to know that the error is named.
    const auto limit = limit_along(seen, object, stated, direction, most);
    if (!limit)
      return fmt::format("no {} towards {} up to {:.0f} {} would be seen", what, direction.text,
                         most, unit);
    if (*limit <= worst) continue;
    worst = *limit;
    where = direction.text;
  }
  return fmt::format("an {} below {:.1f} {} (towards {}) would not be seen", what, worst, unit,
                     where);
}

}  // namespace

std::vector<std::string> detection_limits(const SeenCloth& seen, const Scene& scene) {
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    const Obstacle& object = scene.obstacles[i];
    const auto* box = std::get_if<Box>(&object);
    const auto* ball = std::get_if<Sphere>(&object);
    if (box == nullptr && ball == nullptr) continue;
    const double half_mm =
        (box != nullptr ? 0.5 * box->size_m.head<2>().minCoeff() : ball->radius_m) / mm;
    const auto text_of = [&](const std::vector<Direction>& directions, double most,
                             const char* what, const char* unit) {
      return limit_text(seen, object, scene.uncertainty_of(i), directions, most, what, unit);
    };
    std::string text = fmt::format("object {}: ", i + 1) +
                       text_of({{"+x", 0, 1}, {"-x", 0, -1}, {"+y", 1, 1}, {"-y", 1, -1}}, half_mm,
                               "error of its place", "mm");
    if (box != nullptr)
      text += "; " +
              text_of({{"+yaw", 3, 1}, {"-yaw", 3, -1}}, 45, "error of its turn", "degrees") +
              "; a width stated too small would not be seen, for cloth need not touch the sides";
    texts.push_back(text + "; a plate of tags measures it (drape object)");
  }
  return texts;
}

}  // namespace drape::triangulate
