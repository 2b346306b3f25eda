// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/parallel.hpp"
#include "core/recording.hpp"
#include "core/rig.hpp"
#include "detect/image/image.hpp"
#include "detect/labels/labels.hpp"
#include "detect/tags/tags.hpp"

namespace drape::detect {

/// Limits beyond which a dot is rejected, with the reason. Radii are the dot's own semi-major
/// axis.
struct FrameLimits {
  double most_chi2_per_dof = 60;   ///< chi-square per degree of freedom, for the frame's noise
  double most_misfit = 0.08;       ///< rms residual over contrast; both limits must be exceeded
  double most_masked_edge = 0.25;  ///< fraction of a dot's outline that may be hidden
  double most_one_sided = 30;      ///< chi-square of the shift without one eighth, per chi2_per_dof
  double most_one_sided_radii = 0.03;  ///< the shift itself; both limits must be exceeded
  double least_semi_axis_px = 1.35;    ///< smaller ellipses cover too few pixels
  double most_sigma_radii = 0.03;      ///< largest allowed standard deviation of a centre
};

/// Finds, fits and labels the marks of one decoded frame; first equalises the raw mosaic of a
/// colour sensor. Fills in everything but the names, the image's hash and the preview. `blur_px`
/// receives the Gaussian width of the dot edges, median over the good fits; 0 if there are none.
[[nodiscard]] FrameDetections detect_frame(const GreyImage& picture, const PrintPlane& plane,
                                           TagFinder& finder, const FrameLimits& limits,
                                           double* blur_px = nullptr);

struct DetectOptions {
  Surface surface = Surface::cloth;
  std::vector<std::string> sets;  ///< frame sets, in the order of the output
  int threads = 1;                ///< frames processed in parallel; never changes a result
  bool previews = true;           ///< write a half-scale JPEG per frame of a cloth
  std::string preview_prefix;     ///< prefix of their names, so that two runs can share a folder
  bool overlays = false;          ///< write a PNG per frame that shows detections and rejections
  FrameLimits limits;

  /// Throws Error(usage) naming an invalid option.
  void check() const;
};

/// A file to write beside the detections.
struct Picture {
  std::string file_name;
  std::vector<unsigned char> bytes;
};

struct DetectReport {
  int frames = 0;
  int tags = 0;
  int marks = 0;                          ///< measured and labelled, over all frames
  int islands = 0;                        ///< measured, in lattice pieces without labels
  std::optional<double> median_sigma_px;  ///< median over the marks, root of half the trace
  std::optional<double> dot_size_ratio;   ///< median over the marks of sqrt(trace / 2)
  std::map<std::string, int> rejections_by_reason;  ///< counts by reason, without the figures in it
  std::map<std::string, int> not_in_rig;  ///< pictures of cameras missing from the rig, by camera
  /// Pictures in which marks are missing but required, such as "set drape_A, camera cam1". A free
  /// pose need not be visible to every camera.
  std::vector<std::string> frames_without_marks;
  std::string refused;      ///< why the recording declares a set invalid
  std::string other_print;  ///< why the pictures seem to show another print; empty otherwise
  std::vector<std::string> poor_views;  ///< dim or blurred views, with the marks lost by that
  std::vector<std::string> warnings;

  [[nodiscard]] bool good() const {
    return frames_without_marks.empty() && refused.empty() && other_print.empty();
  }
};

struct DetectResult {
  Detections detections;
  std::vector<Picture> previews;
  std::vector<Picture> overlays;
  DetectReport report;
};

/// Finds, labels and measures the printed marks of the requested frame sets, decoding each image
/// once (paper section 5: "the location of the grid points on the images"). Throws Error(bad_input)
/// naming set, camera and file for an image that is missing, altered, invalid or of the wrong size.
/// Frames without detections and pictures of cameras that the rig does not name are reported, not
/// thrown. `progress` hears of each frame.
[[nodiscard]] DetectResult detect(const Recording& recording, const Rig& rig,
                                  const DetectOptions& options, const PartDone& progress = {});

/// Sets used by default: stages and free poses of the target, or the drapes of the rig's
/// scenes.
[[nodiscard]] std::vector<std::string> default_sets(const Rig& rig, Surface surface);

/// Brightness and sharpness of a picture, from its grey levels.
struct PictureQuality {
  double dark = 0, light = 0;  ///< 1st and 99th percentile of the grey level
  double edge_px = 0;          ///< Gaussian width of the sharpest edges
  bool deep = false;           ///< more than 8 bits per pixel
};
[[nodiscard]] PictureQuality quality_of(const GreyImage& image);

/// Finds views that show less than half of the marks of their set's best view and have less than
/// half of the brightness or sharpness of the other pictures. One sentence each states the defect
/// and its cost. `qualities` belong to `frames`.
[[nodiscard]] std::vector<std::string> poor_views(const std::vector<FrameDetections>& frames,
                                                  const std::vector<PictureQuality>& qualities);

/// Describes pictures that use less than a sixteenth of the grey levels: the first, and their
/// number. Empty if there are none. Throws Error(bad_input) if the first has more than 8 bits, such
/// as 12 bits in the low bits of 16: only a few marks would be visible.
[[nodiscard]] std::string unused_levels(const std::vector<FrameDetections>& frames,
                                        const std::vector<PictureQuality>& qualities);

/// Explains dots without labels from the picture: tags of another family, other ids, a mirrored
/// picture or, if no picture `has_labels`, dots of another size. `file`, the print's or target's,
/// is for the sentence. Empty if no cause is found.
[[nodiscard]] std::string why_no_mark(const GreyImage& image, const PrintPlane& plane,
                                      const FrameLimits& limits, bool has_labels,
                                      const std::string& file);

/// Ratio of measured to stated dot diameter: median over dots with four neighbours, or, if fewer
/// than 20, over those with one along each axis; nullopt below 20, or for a lattice of corners.
/// Compares the area of each fitted ellipse with that predicted from the positions of the
/// neighbouring dots. A blur of width s reduces the area of any convex outline by pi s^2 (s^2 / 2
/// times its curvature, integrated); this is added. Cloth bends between neighbours, so single dots
/// scatter by 10 %; on bench1 the median is within 0.3 % on cloth and 0.1 % on the target.
/// `blurs_px` belong to `frames`.
[[nodiscard]] std::optional<double> dot_size_ratio(const std::vector<FrameDetections>& frames,
                                                   const std::vector<double>& blurs_px,
                                                   const MarkLattice& lattice);

/// Explains why the dots cannot have the stated size: a deviation above 10 %. At 10 % the
/// correction for dot shape, quadratic in size, is off by a fifth. Empty if plausible. `file` for
/// the sentence.
[[nodiscard]] std::string other_dot_size(const std::optional<double>& ratio,
                                         const MarkLattice& lattice, const std::string& file);

/// Explains why the tags in a picture contradict their positions on the print; empty if they do
/// not. Two tags never appear farther apart than on the print, at the scale of the nearer tag; and
/// the corners of each tag predict the directions of the others. `file` is the print's or the
/// target's; `keys` are its keys for the positions.
[[nodiscard]] std::string tags_elsewhere(const PrintPlane& plane,
                                         const std::vector<TagDetection>& tags,
                                         const std::string& file, const std::string& keys);
/// Explains that the tags in a picture have another size beside their distances than on the print,
/// by more than a tenth in the median over each tag and the one nearest to it; empty if not, or
/// with fewer than six tags. `file` is the print's or the target's.
[[nodiscard]] std::string other_tag_size(const PrintPlane& plane,
                                         const std::vector<TagDetection>& tags,
                                         const std::string& file);

/// Stem of the files that belong to one picture: set and camera with an underscore between them; a
/// camera whose name has one is parted by a comma, which no name holds, so that two pictures never
/// share a file.
[[nodiscard]] std::string picture_stem(const std::string& set, const std::string& camera);

}  // namespace drape::detect
