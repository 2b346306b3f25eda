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

/// Illumination, lens and sensor of a picture.
struct RenderOptions {
  double white_grey = 190;      ///< grey level of the unprinted surface in full light
  double ink_ratio = 0.2;       ///< brightness of the print relative to the bare surface
  double background_grey = 25;  ///< grey level where there is no surface
  double ambient = 0.45;        ///< fraction of ambient light
  Eigen::Vector3d towards_light_in_world = {0.25, -0.35, 1};
  double gradient_per_px = 0;   ///< relative gradient of the light along u, as a triangular wave
  double weave_rms = 0;         ///< relative contrast of the weave's texture
  double weave_pitch_m = 3e-4;  ///< distance between threads
  double blur_px = 0.55;        ///< standard deviation of lens blur, without the pixel's own extent
  double noise_grey = 1.6;  ///< standard deviation at level 128; half its variance is shot noise
  std::uint64_t seed = 1;   ///< seed of the noise and the weave
  int threads = 1;          ///< number of threads; never changes a byte
};
void fields(Fields& f, RenderOptions& options);

/// Scene to render: one printed face and unprinted objects.
struct SyntheticScene {
  GridSurface surface;
  FacePattern pattern;
  std::vector<Triangle> scenery;
};

struct GreyPicture {
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> bytes;  ///< row-major, 0..255
};

/// One camera's view of a scene, for queries and rendering.
class SceneView {
 public:
  SceneView(const SyntheticScene& scene, const Camera& camera, const PixelRays& rays);

  /// Brightness of each pixel before blur and noise, in grey levels. Print is sampled exactly: the
  /// printed fraction of a pixel is a closed-form area, not a count of samples.
  [[nodiscard]] std::vector<double> light(const RenderOptions& options) const;
  /// First surface seen at a pixel position.
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

/// Adds lens blur and noise and rounds to 8 bits. `frame` distinguishes pictures of one seed.
[[nodiscard]] GreyPicture expose(const std::vector<double>& light, int width_px, int height_px,
                                 std::uint64_t frame, const RenderOptions& options);

}  // namespace drape::synth
