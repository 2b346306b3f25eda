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

/// Ground truth of one mark in one camera's picture.
struct TrueMarkView {
  std::string camera;
  std::optional<Eigen::Vector2d> px;  ///< image of the centre; absent if not in front of the camera
  std::optional<Eigen::Vector2d> centroid_px;  ///< centroid of the dot's whole area in the image
  double facing_rad = 0;  ///< angle between the printed side's normal and the ray to the camera
  double visible_fraction = 0;  ///< fraction of the dot inside the picture and unoccluded
  [[nodiscard]] bool is_whole() const { return visible_fraction == 1; }
};

struct TrueMark {
  MarkId mark;
  Eigen::Vector3d point_in_world;
  Eigen::Vector3d normal_in_world;
  std::vector<TrueMarkView> views;  ///< one per camera
};

void fields(Fields& f, TrueMarkView& view);
void fields(Fields& f, TrueMark& mark);

/// Marks on the face: centres, and the dots' radius (0 for corners, which are tested as points).
struct MarkOnFace {
  MarkId mark;
  FacePoint centre;
  double radius_m = 0;
};
[[nodiscard]] std::vector<MarkOnFace> marks_of(const Print& print);
[[nodiscard]] std::vector<MarkOnFace> marks_of(const Target& target);

/// Ground truth of all marks. Throws Error(bad_input) if a mark lies outside the surface.
[[nodiscard]] std::vector<TrueMark> truth_of(const SyntheticScene& scene,
                                             const std::vector<MarkOnFace>& marks,
                                             const std::vector<const SceneView*>& views);

/// Centroid (px) of the image area of a disc on the face, from its outline; nullopt if part of it
/// does not project or lies outside the surface.
[[nodiscard]] std::optional<Eigen::Vector2d> disc_centroid_px(const GridSurface& surface,
                                                              const Camera& camera,
                                                              const FacePoint& centre,
                                                              double radius_m);

}  // namespace drape::synth
