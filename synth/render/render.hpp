// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/camera_model.hpp"
#include "core/fields/fields.hpp"
#include "synth/render/caster.hpp"
#include "synth/render/face_pattern.hpp"
#include "synth/render/grid_surface.hpp"

namespace drape::synth {

/// Light, lens and sensor of a picture.
struct RenderOptions {
  double white_grey = 190;      ///< unprinted surface in full light
  double ink_ratio = 0.2;       ///< light from the print, by that from the bare surface
  double background_grey = 25;  ///< grey where no surface is
  double ambient = 0.45;        ///< fraction of the light that has no direction
  Eigen::Vector3d towards_light_in_world = {0.25, -0.35, 1};
  double gradient_per_px = 0;   ///< relative slope of the light along u, in ramps up and down
  double weave_rms = 0;         ///< relative contrast of the weave's texture
  double weave_pitch_m = 3e-4;  ///< distance of its threads
  double blur_px = 0.55;    ///< standard deviation of the lens's blur, before the pixel's extent
  double noise_grey = 1.6;  ///< standard deviation at level 128; half its variance is shot noise
  std::uint64_t seed = 1;   ///< start of the noise and the weave
  int threads = 1;          ///< never changes a byte
};
void fields(Fields& f, RenderOptions& options);

/// Scene before the cameras: one printed face and unprinted things.
struct SyntheticScene {
  GridSurface surface;
  FacePattern pattern;
  std::vector<Triangle> scenery;
};

struct GreyPicture {
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> bytes;  ///< row-major, 0..255
};

/// One camera's view of a scene, ready to be asked and rendered.
class SceneView {
 public:
  SceneView(const SyntheticScene& scene, const Camera& camera, const PixelRays& rays);

  /// Light on each pixel before blur and noise, grey levels. The print is sampled exactly: the
  /// fraction of a pixel that is printed is an area in closed form, not a count of samples.
  [[nodiscard]] std::vector<double> light(const RenderOptions& options) const;
  /// First thing that the camera sees at a pixel position.
  [[nodiscard]] Hit cast(const Eigen::Vector2d& px) const;
  [[nodiscard]] const Camera& camera() const { return camera_; }

 private:
  friend class Painter;
  const SyntheticScene& scene_;
  Camera camera_;
  const PixelRays& rays_;
  std::vector<Triangle> triangles_;
  Caster caster_;
};

/// Lens blur, noise and 8-bit rounding. `frame` tells the pictures of one seed apart.
[[nodiscard]] GreyPicture expose(const std::vector<double>& light, int width_px, int height_px,
                                 std::uint64_t frame, const RenderOptions& options);

}  // namespace drape::synth
