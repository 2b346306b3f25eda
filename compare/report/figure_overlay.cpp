// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "compare/report/figures.hpp"
#include "compare/report/view.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr int kPointsPerCell = 4;

/// A point of the virtual sheet in one photograph.
struct Seen {
  Vector2d px;
  bool faces_camera = false;
};

/// One photograph beside the virtual sheet that is drawn into it.
class Photograph {
 public:
  Photograph(const FrameDetections& frame, const CalibratedCamera* camera, const DrapeInput& input,
             const RealVirtual& comparison)
      : simulation(input.simulations[comparison.simulation]),
        surface(simulation.sheet.sheet, simulation.sheet.file.string()),
        camera_(camera == nullptr ? nullptr : &camera->camera) {
    for (const Detection& detection : frame.detections) crop.extend(detection.centre_px);
    for (const MarkError& mark : comparison.marks.marks)
      if (const auto seen = see(mark.material_m)) crop.extend(seen->px);
    const Eigen::AlignedBox2d image(Vector2d::Zero(), Vector2d(frame.width_px, frame.height_px));
    if (crop.isEmpty() || !(crop.sizes().minCoeff() > 0)) crop = image;
    const Vector2d margin = Vector2d::Constant(0.12 * crop.sizes().maxCoeff());
    crop = Eigen::AlignedBox2d((crop.min() - margin).array().floor().matrix(),
                               (crop.max() + margin).array().ceil().matrix())
               .intersection(image);
    // Lines, dots and legend keep their size on paper whatever part of the image is shown.
    unit = crop.sizes().x() / 1000;
  }

  /// Projects a place of the sheet; absent without a calibration, outside the sheet or behind the
  /// camera.
  [[nodiscard]] std::optional<Seen> see(const Vector2d& material_m) const {
    const auto point = camera_ ? surface.at(material_m) : std::nullopt;
    const auto px = point ? place(point->point_in_world) : std::nullopt;
    if (!px) return std::nullopt;
    return Seen{*px, point->normal.dot(centre_in_world(*camera_) - point->point_in_world) > 0};
  }
  [[nodiscard]] std::optional<Vector2d> place(const Vector3d& point) const {
    const auto projection = project(camera_->model, camera_->cam_from_world * point);
    return projection ? std::optional(projection->px) : std::nullopt;
  }
  [[nodiscard]] Viewer viewer() const {
    return {[this](const Vector3d& point) { return place(point); }, centre_in_world(*camera_)};
  }

  const Simulation& simulation;
  Surface surface;
  Eigen::AlignedBox2d crop;  ///< the part of the photograph that is shown
  double unit = 1;

 private:
  const Camera* camera_;
};

/// Draws a line through the material, split where the cloth turns its back to the camera.
void draw_line(Svg& svg, const Photograph& photograph, const Vector2d& from, const Vector2d& to,
               int samples) {
  std::vector<Vector2d> points;
  bool faces = true;
  const auto flush = [&] {
    svg.polyline(points, faces ? "stroke=\"#ff5fa2\" stroke-opacity=\"0.95\""
                               : "stroke=\"#ff5fa2\" stroke-opacity=\"0.28\"");
    if (!points.empty()) points = {points.back()};
  };
  for (int i = 0; i <= samples; ++i) {
    const auto seen = photograph.see(from + (to - from) * i / samples);
    if (!seen || seen->faces_camera != faces) flush();
    if (!seen) points.clear();
    if (!seen) continue;
    faces = seen->faces_camera;
    points.push_back(seen->px);
  }
  flush();
}

/// Draws rows, columns and edges of the virtual cloth.
void draw_virtual(Svg& svg, const Photograph& photograph, const SheetFile& measured) {
  const Sheet& sheet = measured.sheet;
  const auto lattice = LatticeCoordinates::of(sheet, measured.file.string());
  if (!lattice) return;
  svg.open_group(
      fmt::format("stroke-width=\"{:.2f}\" stroke-linejoin=\"round\"", 1.5 * photograph.unit));
  for (const int axis : {0, 1}) {
    const int lines = axis == 0 ? sheet.rows : sheet.cols;
    const int samples = ((axis == 0 ? sheet.cols : sheet.rows) + 1) * kPointsPerCell;
    for (int i = -1; i <= lines; ++i) {
      Vector2d from = Vector2d::Zero(), to = sheet.patch_m;
      from[axis] = to[axis] = i < 0        ? 0
                              : i == lines ? sheet.patch_m[axis]
                                           : lattice->at({i, i})[axis];
      draw_line(svg, photograph, from, to, samples);
    }
  }
  svg.close_group();
}

void draw_marks(Svg& svg, const FrameDetections& frame, const Photograph& photograph,
                const RealVirtual& comparison) {
  const ErrorScale scale = scale_of(comparison);
  const auto& marks = comparison.marks.marks;
  for (const Detection& detection : frame.detections) {
    const auto error = std::find_if(marks.begin(), marks.end(), [&](const MarkError& one) {
      return one.mark == detection.mark;
    });
    const bool measured = error != marks.end();
    const std::string colour = measured ? scale.colour(error->distance_m / mm) : "none";
    if (const auto seen = measured ? photograph.see(error->material_m) : std::nullopt)
      for (const auto& [stroke, width] :
           {std::pair<std::string, double>{"#ffffff", 4}, {colour, 2.6}})
        svg.line(detection.centre_px, seen->px,
                 fmt::format("stroke=\"{}\" stroke-width=\"{:.2f}\" stroke-linecap=\"round\"",
                             stroke, width * photograph.unit));
    svg.circle(
        detection.centre_px, 6.5 * photograph.unit,
        fmt::format("fill=\"{}\" stroke=\"#ffffff\" stroke-width=\"{:.2f}\"", colour,
                    1.7 * photograph.unit),
        fmt::format("row {}, col {}: {}", detection.mark.row, detection.mark.col,
                    measured ? fmt::format("{:.2f} mm from the simulation", error->distance_m / mm)
                             : "seen here, not measured in space"));
  }
}

}  // namespace

Figure render_figure(const std::string& drape, const FrameDetections& frame,
                     const CalibratedCamera& camera, const DrapeInput& input,
                     const RealVirtual& comparison) {
  const Photograph photograph(frame, &camera, input, comparison);
  const Sheet& cloth = photograph.simulation.sheet.sheet;
  const Vector2d low = photograph.crop.min(), size = photograph.crop.sizes();
  const std::string what = fmt::format("imulation {} as camera {} would see it",
                                       photograph.simulation.label(), frame.camera);
  Svg svg(size.x(), size.y(), fmt::format("Drape {}: s{}", drape, what), low);
  svg.rectangle(low.x(), low.y(), size.x(), size.y(), "fill=\"#5b626b\"");
  Painter painter(photograph.viewer());
  if (input.scene) painter.add_objects(*input.scene, cloth);
  painter.add_cloth(cloth);
  // The marks of the print, where the virtual cloth shows its face.
  const Sheet& print = input.measured.sheet;
  const auto lattice = LatticeCoordinates::of(print, input.measured.file.string());
  for (int i = 0; lattice && i < print.rows * print.cols; ++i) {
    const Vector2d at = lattice->at({i / print.cols, i % print.cols});
    const auto seen = photograph.see(at);
    if (!seen || !seen->faces_camera) continue;
    painter.add(photograph.surface.at(at)->point_in_world, 4 * mm, [=, &photograph](Svg& picture) {
      picture.circle(seen->px, 4.5 * photograph.unit, "fill=\"#20242a\"");
    });
  }
  painter.paint(svg);
  return {fmt::format("{}-render-{}", drape, frame.camera), fmt::format("S{}.", what),
          svg.finish()};
}

std::string photo_id(const std::string& drape, const std::string& camera) {
  return "photo-" + drape + "-" + camera;
}

ErrorScale scale_of(const RealVirtual& comparison) {
  return ErrorScale(comparison.statistics.max_m / mm);
}

Figure overlay_figure(const std::string& drape, const FrameDetections& frame,
                      const std::vector<unsigned char>& preview, const CalibratedCamera* camera,
                      const DrapeInput& input, const RealVirtual& comparison) {
  const Photograph photograph(frame, camera, input, comparison);
  const Vector2d low = photograph.crop.min(), size = photograph.crop.sizes();
  const double unit = photograph.unit, bottom = photograph.crop.max().y();
  Svg svg(size.x(), size.y() + 72 * unit,
          fmt::format("Drape {}, camera {}: measured marks{}", drape, frame.camera,
                      camera ? " and the simulation " + photograph.simulation.label() : ""),
          low);
  // Pixel centres are at integers, so the image begins half a pixel before the first centre.
  if (preview.empty())
    svg.rectangle(-0.5, -0.5, frame.width_px, frame.height_px, "fill=\"#8a8f96\"");
  else
    svg.jpeg(-0.5, -0.5, frame.width_px, frame.height_px, preview, photo_id(drape, frame.camera));
  if (camera) draw_virtual(svg, photograph, input.measured);
  draw_marks(svg, frame, photograph, comparison);
  svg.rectangle(low.x(), bottom, size.x(), frame.height_px, "fill=\"#ffffff\"");
  svg.open_group(fmt::format("transform=\"translate({} {}) scale({:.4f})\"", coordinate(low.x()),
                             coordinate(bottom), 1.4 * unit));
  scale_of(comparison).draw(svg, 187, 8, 340);
  svg.close_group();
  return {fmt::format("{}-overlay-{}", drape, frame.camera),
          fmt::format("Camera {}: {} marks found.", frame.camera, frame.detections.size()),
          svg.finish()};
}

}  // namespace drape::compare
