// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/detection_limit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "triangulate/guards/mesh_gaps.hpp"

namespace drape::triangulate {
namespace {

using units::mm;

constexpr double kResolution = 0.5;  ///< mm or degrees; as fine as an operator reads a value

/// A possible error of the operator: returns the object as it would be stated.
struct Mistake {
  const char* text;
  std::function<Obstacle(double)> stated;
};

/// Determines the detection limits of one object of a scene.
struct Guard {
  const SeenCloth& seen;
  const Scene& scene;
  std::size_t object;

  [[nodiscard]] bool names(const Obstacle& stated) const {
    if (is_contradicted(seen, stated, scene.uncertainty_of(object))) return true;
    Scene other = scene;
    other.obstacles[object] = stated;
    return untouched(seen, other).has_value() ||
           (floating(seen, other).has_value() && !floating(seen, scene).has_value());
  }

  /// Smallest error from which on the object is contradicted; nullopt if none is up to
  /// `most`.
  [[nodiscard]] std::optional<double> limit(const Mistake& mistake, double most) const {
    if (!names(mistake.stated(most))) return std::nullopt;
    double below = 0, named = most;
    while (named - below > kResolution) {
      const double middle = 0.5 * (below + named);
      (names(mistake.stated(middle)) ? named : below) = middle;
    }
    return named;
  }

  [[nodiscard]] std::string text(const std::vector<Mistake>& mistakes, double most,
                                 const char* what, const char* unit) const {
    double worst = 0;
    const char* where = mistakes.front().text;
    for (const Mistake& mistake : mistakes) {
      const auto found = limit(mistake, most);
      if (!found)
        return fmt::format("no {} {} up to {:.0f} {} would be seen", what, mistake.text, most,
                           unit);
      if (*found <= worst) continue;
      worst = *found;
      where = mistake.text;
    }
    return fmt::format("an {} below {:.1f} {} ({}) would not be seen", what, worst, unit, where);
  }
};

Mistake along(const Obstacle& object, const char* text, int parameter, double sign) {
  return {text, [=](double error) {
            Change change = Change::Zero();
            change[parameter] = sign * error;
            return changed(object, change);
          }};
}

Mistake wider(const Box& box, const char* text, int axis) {
  return {text, [=](double error_mm) {
            Box other = box;
            other.size_m[axis] += error_mm * mm;
            return Obstacle(other);
          }};
}

}  // namespace

std::vector<Unseen> detection_limits(const SeenCloth& seen, const Scene& scene) {
  std::vector<Unseen> unseen;
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    const Obstacle& object = scene.obstacles[i];
    if (std::holds_alternative<MeshObject>(object)) {
      double most_m = 0;
      for (const SheetMark& mark : seen.sheet.marks)
        most_m = std::max(most_m, most_inside_m(scene.uncertainty_of(i), mark));
      unseen.push_back({fmt::format("object {}", i + 1),
                        fmt::format("a mesh: what leaves some mark on it and none deeper inside "
                                    "than {:.1f} mm would not be seen; a plate of tags measures "
                                    "its place and turn (drape object)",
                                    most_m / mm)});
      continue;
    }
    const auto* box = std::get_if<Box>(&object);
    const auto* ball = std::get_if<Sphere>(&object);
    if (box == nullptr && ball == nullptr) continue;
    const double half_mm =
        (box != nullptr ? 0.5 * box->size_m.head<2>().minCoeff() : ball->radius_m) / mm;
    const Guard guard{seen, scene, i};
    const auto one = [&](const char* text, int parameter, double sign) {
      return along(object, text, parameter, sign);
    };
    std::string text = guard.text({one("towards +x", 0, 1), one("towards -x", 0, -1),
                                   one("towards +y", 1, 1), one("towards -y", 1, -1)},
                                  half_mm, "error of its place", "mm") +
                       "; " +
                       guard.text({one("too high", 2, 1), one("too low", 2, -1)}, half_mm,
                                  "error of its top's height", "mm");
    if (ball != nullptr)
      text += "; " + guard.text({one("too large", 4, 1), one("too small", 4, -1)}, half_mm,
                                "error of its diameter", "mm");
    if (box != nullptr)
      text += "; " +
              guard.text({one("towards +yaw", 3, 1), one("towards -yaw", 3, -1)}, 45,
                         "error of its turn", "degrees") +
              "; " +
              guard.text({wider(*box, "too large along x", 0), wider(*box, "too large along y", 1)},
                         half_mm, "error of its width", "mm") +
              "; a width stated too small would not be seen, for cloth need not touch the sides";
    unseen.push_back(
        {fmt::format("object {}", i + 1), text + "; a plate of tags measures it (drape object)"});
  }
  return unseen;
}

}  // namespace drape::triangulate
