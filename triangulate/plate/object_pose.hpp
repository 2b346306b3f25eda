// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "core/scene.hpp"
#include "triangulate/plate/plate_pose.hpp"

namespace drape::triangulate {

/// Place of the plate on the object.
struct PlateOnObject {
  double thickness_mm =
      0.1;             ///< thickness of a box's sheet; its printed face lies so far above the top
  double hole_mm = 0;  ///< hole in the middle of a sphere's stand, whose upper edge carries it
  double placing_mm = 0.2;  ///< standard uncertainty of laying it on, along x and y, and of height
};
void fields(Fields& f, PlateOnObject& lies);

/// One value of an object as measured and as the scene states it.
struct ObjectValue {
  std::string key;  ///< "x_mm", "y_mm", "z_bottom_mm", "yaw_deg"
  double measured = 0;
  double uncertainty = 0;  ///< standard, of the measured value, with placing
  double stated = 0;
  double stated_uncertainty = 0;  ///< standard

  /// Beyond three standard uncertainties of the difference.
  [[nodiscard]] bool contradicts() const;
};
void fields(Fields& f, ObjectValue& value);

/// object.json: where an object stands by its plate of tags, beside what the scene states.
struct MeasuredObject {
  std::vector<ObjectValue> values;
  std::vector<std::string> contradictions;  ///< NO-GO that it rests on, and values that contradict
  int dots = 0;
  double rms_px = 0, chi2_per_dof = 0;
};
void fields(Fields& f, MeasuredObject& object);

}  // namespace drape::triangulate

template <>
inline constexpr drape::Format drape::format_of<drape::triangulate::MeasuredObject>{
    "object", drape::Syntax::json, 1,
    "object.json: where an object stands by its plate of tags, beside what the scene states"};

namespace drape::triangulate {

/// Place and turn of a box (the plate lies on its top, edge on edge) or a sphere (it rests in the
/// plate's hole). Size and, for the yaw, which of a box's alike sides is which, are the scene's.
/// Throws Error(bad_input) for another kind of object, a hole wider than the sphere, or a plate
/// that is laid on less certainly than a quarter of the object's width, so that it shows no place.
[[nodiscard]] std::vector<ObjectValue> object_values(const PlatePose& plate,
                                                     const PlateOnObject& lies,
                                                     const Obstacle& object,
                                                     const ObjectUncertainty& stated);

/// Standard uncertainty of the place for a scene file (mm): the larger of x and y. The height of
/// the bottom has that of the size besides, which the scene states by itself.
[[nodiscard]] double place_uncertainty_mm(const std::vector<ObjectValue>& values);

/// Why the plate of this lattice cannot lie on the top of a box edge on edge: its sheet, a pitch
/// for each dot (`drape print object-tags`), is larger or smaller than a side of the top by more
/// than three standard deviations of two edges laid on each other and of the stated size.
[[nodiscard]] std::optional<std::string> why_not_edge_on_edge(const MarkLattice& lattice,
                                                              const PlateOnObject& lies,
                                                              const Obstacle& object,
                                                              const ObjectUncertainty& stated);

/// Angle between the plate's normal and the vertical (rad), and its standard uncertainty.
struct Tilt {
  double rad = 0, uncertainty_rad = 0;
};
[[nodiscard]] Tilt tilt_of(const PlatePose& plate);

}  // namespace drape::triangulate
