// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/marks.hpp"
#include "core/rig.hpp"
#include "synth/render/render.hpp"

namespace drape::synth {

/// Truth of one mark in one camera's picture.
struct TrueMarkView {
  std::string camera;
  std::optional<Eigen::Vector2d> px;           ///< image of the centre; absent: not in front
  std::optional<Eigen::Vector2d> centroid_px;  ///< centroid of the dot's whole area in the image
  double facing_rad = 0;        ///< between the printed side's normal and the ray to the camera
  double visible_fraction = 0;  ///< part of the dot inside the picture and hidden by nothing
  [[nodiscard]] bool is_whole() const { return visible_fraction == 1; }
};

struct TrueMark {
  MarkId mark;
  Eigen::Vector3d point_in_world;
  Eigen::Vector3d normal_in_world;
  std::vector<TrueMarkView> views;  ///< by camera
};

void fields(Fields& f, TrueMarkView& view);
void fields(Fields& f, TrueMark& mark);

/// The marks' centres on the face with the dots' radius (0: corners, seen or not as points).
struct MarkOnFace {
  MarkId mark;
  FacePoint centre;
  double radius_m = 0;
};
[[nodiscard]] std::vector<MarkOnFace> marks_of(const Print& print);
[[nodiscard]] std::vector<MarkOnFace> marks_of(const Target& target);

/// Truth of all marks. Throws Error(bad_input) when a mark lies beyond the surface.
[[nodiscard]] std::vector<TrueMark> truth_of(const SyntheticScene& scene,
                                             const std::vector<MarkOnFace>& marks,
                                             const std::vector<const SceneView*>& views);

/// Centroid (px) of the area that a disc of the face covers in an image, by its outline; nothing
/// where a part does not project or lies beyond the surface.
[[nodiscard]] std::optional<Eigen::Vector2d> disc_centroid_px(const GridSurface& surface,
                                                              const Camera& camera,
                                                              const FacePoint& centre,
                                                              double radius_m);

}  // namespace drape::synth
