// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "core/scene.hpp"
#include "simulate/checker/sheet.hpp"
#include "simulate/objects/contact_forces.hpp"
#include "simulate/objects/surroundings.hpp"

/// The checker's own distances to the objects of a scene, in long double.
namespace drape::simulate::checker {

struct Objects {
  explicit Objects(const Scene& objects_of);

  const Scene* scene;
  std::vector<std::shared_ptr<Surroundings>> meshes;  ///< one per mesh, else absent
  std::vector<Point> mesh_extents;  ///< per mesh along its principal axes, the least first
  std::vector<Point> mesh_middle;   ///< mean of each mesh's corners
};

/// Signed distance from object `k`, or from the table for k = number of obstacles.
[[nodiscard]] Real gap_of(const Objects& objects, std::size_t k, const Point& p);
/// Its gradient by central differences.
[[nodiscard]] Point normal_of(const Objects& objects, std::size_t k, const Point& p);
/// The normals about a place of an object with edges, at which every direction between its faces'
/// normals may press; none of an object without.
[[nodiscard]] std::vector<Point> sharp_normals_of(const Objects& objects, std::size_t k,
                                                  const Point& p);

struct Distances {
  std::optional<Real> least_to_object;  ///< distance of a particle
  Real deepest_particle = 0;            ///< in an object or the table
  Real deepest_between = 0;             ///< depth of 9 x 9 places in each cell
};
[[nodiscard]] Distances distances_of(const Objects& objects, const std::vector<Point>& points,
                                     int rows, int cols);

/// Share of an object's thickness: cloth that is deeper in it passes through its middle.
constexpr Real kThrough = 0.25L;
/// Depth of a flat piece of cloth in an object, over the object's thickness there (the
/// shortest line through the deepest place along normals about it; of a mesh its least extent);
/// the largest over the objects narrower than the piece, 0 for none; 1 between an object's middle
/// and the table that it stands on.
[[nodiscard]] Real through_of(const Objects& objects, const std::array<Point, 3>& piece);
/// The same of a sheet, each cell cut into two triangles.
[[nodiscard]] Real through_of(const Objects& objects, const std::vector<Point>& points, int rows,
                              int cols);

/// Places of the sheet nearer than `touch_m` to an object: particles, the nearest places of grid
/// line pieces, those between which a piece lies along a face, and nine places in each cell.
[[nodiscard]] std::vector<Support> supports_of(const Objects& objects,
                                               const std::vector<Point>& points, int rows, int cols,
                                               Real touch_m);

/// Part of a stated contact force (N) that object `k` can do at a place: no pull, within the cone
/// of friction about the normal, which the rounding of the object's place may turn; at an edge
/// within the cone, of those about its faces' normals, that takes the least away. Nothing where the
/// place is farther than `touch_m` outside.
[[nodiscard]] std::optional<Point> pushed_by(const Objects& objects, std::size_t k, const Point& p,
                                             Real friction, Real touch_m,
                                             const Eigen::Vector3d& stated_n);

/// Adds a stated contact force (N) to `sum`, as far as pushed_by() allows. False where the
/// place is not within one cell of the sheet, or farther than `touch_m` outside the object.
bool add_stated(const Objects& objects, const std::vector<Point>& points, int cols, Real friction,
                Real touch_m, const ContactForce& stated, std::vector<Point>& sum);

/// Places where the edges and corners of meshes, and of boxes without edge radius, may press on the
/// sheet, cut into two triangles per cell: edge against edge of the sheet, corner against triangle,
/// nearer than `touch_m`.
[[nodiscard]] std::vector<Support> edge_supports_of(const Objects& objects,
                                                    const std::vector<Point>& points, int rows,
                                                    int cols, Real touch_m);

}  // namespace drape::simulate::checker
