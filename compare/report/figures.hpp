// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/compare.hpp"
#include "compare/report/error_scale.hpp"
#include "core/calibration.hpp"
#include "core/detections.hpp"

namespace drape::compare {

/// A finished picture.
struct Figure {
  std::string name;     ///< file name without extension, e.g. "A-overlay-cam0"
  std::string caption;  ///< one or two sentences
  std::string svg;
};

/// Name under which a page holds a photograph, so that crops of it need no second copy.
[[nodiscard]] std::string photo_id(const std::string& drape, const std::string& camera);

/// The scale common to all pictures of one drape.
[[nodiscard]] ErrorScale scale_of(const RealVirtual& comparison);

/// One photograph with the measured marks (rings), and with a calibrated camera the grid lines and
/// marks of the simulation drawn into it: where its printed side faces the camera solid, else
/// faint. `preview` are the bytes of the preview JPEG, empty when there is none.
[[nodiscard]] Figure overlay_figure(const std::string& drape, const FrameDetections& frame,
                                    const std::vector<unsigned char>& preview,
                                    const CalibratedCamera* camera, const DrapeInput& input,
                                    const RealVirtual& comparison);

/// The simulated sheet, orthographic from two opposite sides, with the real marks in the colour of
/// their error and a line from each to its place on the sheet.
[[nodiscard]] Figure sheet_figure(const std::string& drape, const DrapeInput& input,
                                  const RealVirtual& comparison);

/// The virtual drape alone as this camera would see it: shaded, marks as on the print, hidden parts
/// behind what is nearer. Same crop as overlay_figure, so the two compare at a glance.
[[nodiscard]] Figure render_figure(const std::string& drape, const FrameDetections& frame,
                                   const CalibratedCamera& camera, const DrapeInput& input,
                                   const RealVirtual& comparison);

/// Strain between neighbouring marks on the flat patch, real and virtual side by side.
[[nodiscard]] Figure strain_figure(const std::string& drape, const DrapeInput& input,
                                   const RealVirtual& comparison);

/// Radius of the hem's shadow over the angle and its spectrum, of every sheet that has one.
[[nodiscard]] std::optional<Figure> hem_figure(const std::string& drape, const DrapeInput& input,
                                               const Report& report);

/// The patch laid flat, one tile per mark with its distance in mm; gaps are hatched.
[[nodiscard]] Figure map_figure(const std::string& drape, const DrapeInput& input,
                                const RealVirtual& comparison);

/// The list of a set of branches, while it is as it was read.
[[nodiscard]] std::optional<BranchList> list_of(const DrapeInput& input, const BranchSet& set);
/// From above and from the side: each mark's band as a disc at its true size, the real mark in it
/// or outside. Nothing without bands.
[[nodiscard]] std::optional<Figure> band_figure(const std::string& drape, const DrapeInput& input,
                                                const BranchSet& set);

/// Histogram of the distances with mean, median and 95th percentile.
[[nodiscard]] Figure histogram_figure(const std::string& drape, const RealVirtual& comparison);

}  // namespace drape::compare
