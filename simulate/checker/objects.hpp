// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "core/scene.hpp"
#include "simulate/checker/vectors.hpp"
#include "simulate/objects/surroundings.hpp"

/// The checker's own distances to the objects of a scene, in long double.
namespace drape::simulate::checker {

constexpr Real kTouch_m = 0.02e-3L;  ///< distance below which an object can press
constexpr Real kSunk_m = 0.05e-3L;   ///< largest depth of a pressed place
constexpr Real kLook_m = 0.5e-3L;    ///< step size for sampling a surface
/// Largest distance of cloth from a place where objects can press: places lie on triangles of 0.75
/// mm.
constexpr Real kFarthest_m = 0.45e-3L;
constexpr Real kRounding_m = 1e-9L;  ///< rounding of positions in files and local frames

struct Objects {
  explicit Objects(const Scene& objects_of);

  [[nodiscard]] std::size_t count() const { return scene->obstacles.size(); }

  const Scene* scene;
  std::vector<std::shared_ptr<Surroundings>> meshes;  ///< one per mesh object, else null
  std::vector<Point> mesh_extents;  ///< extents of each mesh along principal axes, smallest first
  std::vector<Point> mesh_middle;   ///< mean of each mesh's corners
};

/// Signed distance from object `k`, or from the table if k is the number of obstacles.
[[nodiscard]] Real gap_of(const Objects& objects, std::size_t k, const Point& p);
/// Gradient of the distance, by central differences.
[[nodiscard]] Point normal_of(const Objects& objects, std::size_t k, const Point& p);

/// Depth that flat pieces of cloth may have in an object between places that are kSunk_m deep: the
/// sagitta over its tightest rounding; over a sharp edge at most the distance between the places.
[[nodiscard]] Real allowed_between_m(const Objects& objects, std::size_t k);

/// Fraction of an object's thickness: deeper cloth passes through its middle.
constexpr Real kThrough = 0.25L;
/// Depth of a flat piece of cloth in an object over the object's thickness there (the shortest line
/// through the deepest place along nearby normals; for a mesh its smallest extent). Maximum over
/// the objects narrower than the piece, 0 for none; 1 between an object's middle and the table that
/// it stands on.
[[nodiscard]] Real through_of(const Objects& objects, const std::array<Point, 3>& piece);

/// Part of a force that does not pull and lies within the friction cone about a normal.
[[nodiscard]] Point within_cone(const Point& force, const Point& normal, Real friction);
/// Part of a stated contact force (N) that object `k` can exert at a place: within the friction
/// cone about the normal, which the rounding of the object's position may rotate; at an edge, the
/// cone about one of the adjacent faces' normals that removes least. nullopt if the place is
/// farther than kTouch_m outside.
[[nodiscard]] std::optional<Point> pushed_by(const Objects& objects, std::size_t k, const Point& p,
                                             Real friction, const Eigen::Vector3d& stated_n);

}  // namespace drape::simulate::checker
