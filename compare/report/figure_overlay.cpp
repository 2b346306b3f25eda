// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "compare/meshes/obstacle_mesh.hpp"
#include "compare/report/figures.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

constexpr int kPointsPerCell = 4;

/// A point of the virtual sheet in one photograph.
struct Seen {
  Eigen::Vector2d px;
  bool faces_camera = false;
};

/// Part of the photograph that is shown.
struct Crop {
  Eigen::Vector2d low, high;

  explicit Crop(const FrameDetections& frame)
      : low(frame.width_px, frame.height_px), high(Eigen::Vector2d::Zero()) {}
  void extend(const Eigen::Vector2d& px) {
    low = low.cwiseMin(px);
    high = high.cwiseMax(px);
  }
  /// A margin around it, inside the image; the whole image when nothing was seen.
  void finish(const FrameDetections& frame) {
    const Eigen::Vector2d size(frame.width_px, frame.height_px);
    if (!(low.x() < high.x()) || !(low.y() < high.y())) {
      low.setZero();
      high = size;
    }
    const double margin = 0.12 * (high - low).maxCoeff();
    low = (low.array() - margin).max(0.0).floor();
    high = (high.array() + margin).min(size.array()).ceil();
  }
};

class Photograph {
 public:
  explicit Photograph(const Camera& camera)
      : camera_(camera), centre_in_world_(centre_in_world(camera)) {}

  [[nodiscard]] std::optional<Seen> see(const SurfacePoint& point) const {
    const auto projection = project(camera_.model, camera_.cam_from_world * point.point_in_world);
    if (!projection) return std::nullopt;
    return Seen{projection->px, point.normal.dot(centre_in_world_ - point.point_in_world) > 0};
  }

 private:
  const Camera& camera_;
  Eigen::Vector3d centre_in_world_;
};

/// Pieces of one grid line, split where the cloth turns its back to the camera.
class LineDrawer {
 public:
  explicit LineDrawer(Svg& svg) : svg_(svg) {}
  ~LineDrawer() { flush(); }
  LineDrawer(const LineDrawer&) = delete;
  LineDrawer& operator=(const LineDrawer&) = delete;

  void add(const std::optional<Seen>& seen) {
    if (!seen) return flush();
    if (!points_.empty() && seen->faces_camera != faces_) {
      const Eigen::Vector2d last = points_.back();
      flush();
      points_.push_back(last);
    }
    faces_ = seen->faces_camera;
    points_.push_back(seen->px);
  }

  void flush() {
    svg_.polyline(points_, faces_ ? "stroke=\"#ff5fa2\" stroke-opacity=\"0.95\""
                                  : "stroke=\"#ff5fa2\" stroke-opacity=\"0.28\"");
    points_.clear();
  }

 private:
  Svg& svg_;
  std::vector<Eigen::Vector2d> points_;
  bool faces_ = true;
};

/// Lines through the marks' material coordinates, along warp or weft.
void draw_grid(Svg& svg, const Photograph& photograph, const Surface& surface,
               const std::vector<double>& lines, const std::vector<double>& along,
               bool lines_are_warp) {
  const int samples = static_cast<int>(along.size() - 1) * kPointsPerCell;
  const double from = along.front(), to = along.back();
  for (const double line : lines) {
    LineDrawer drawer(svg);
    for (int i = 0; i <= samples; ++i) {
      const double at = from + (to - from) * i / samples;
      const auto point =
          surface.at(lines_are_warp ? Eigen::Vector2d(line, at) : Eigen::Vector2d(at, line));
      drawer.add(point ? photograph.see(*point) : std::nullopt);
    }
  }
}

/// Material coordinates of the lattice's rows and columns with the patch's edges around them.
std::vector<double> lattice_lines(const Sheet& sheet, const LatticeCoordinates& lattice, int axis) {
  std::vector<double> lines = {0.0};
  const int count = axis == 0 ? sheet.rows : sheet.cols;
  for (int i = 0; i < count; ++i) lines.push_back(lattice.at({i, i})[axis]);
  lines.push_back(sheet.patch_m[axis]);
  return lines;
}

void draw_virtual(Svg& svg, const Photograph& photograph, const DrapeInput& input,
                  const Surface& surface, double unit) {
  const Sheet& measured = input.measured.sheet;
  const auto lattice = LatticeCoordinates::of(measured, input.measured.file.string());
  if (!lattice) return;
  const auto warp = lattice_lines(measured, *lattice, 0),
             weft = lattice_lines(measured, *lattice, 1);
  svg.open_group(fmt::format("stroke-width=\"{:.2f}\" stroke-linejoin=\"round\"", 1.5 * unit));
  draw_grid(svg, photograph, surface, warp, weft, true);
  draw_grid(svg, photograph, surface, weft, warp, false);
  svg.close_group();
}

const MarkError* error_of(const RealVirtual& comparison, MarkId mark) {
  const auto& marks = comparison.marks.marks;
  const auto found = std::lower_bound(marks.begin(), marks.end(), mark,
                                      [](const MarkError& e, MarkId id) { return e.mark < id; });
  return found != marks.end() && found->mark == mark ? &*found : nullptr;
}

std::string hover_of(const Detection& detection, const MarkError* error) {
  std::string text = fmt::format("row {}, col {}", detection.mark.row, detection.mark.col);
  if (error == nullptr) return text + ": seen here, not measured in space";
  return text + fmt::format(": {:.2f} mm from the simulation", error->distance_m / mm);
}

void draw_marks(Svg& svg, const FrameDetections& frame, const Photograph* photograph,
                const Surface& surface, const RealVirtual& comparison, double unit) {
  const ErrorScale scale = scale_of(comparison);
  for (const Detection& detection : frame.detections) {
    const MarkError* error = error_of(comparison, detection.mark);
    const std::string colour = error ? scale.colour(error->distance_m / mm) : "none";
    const auto place = error ? surface.at(error->material_m) : std::nullopt;
    const auto seen = photograph && place ? photograph->see(*place) : std::nullopt;
    if (seen) {
      svg.line(detection.centre_px, seen->px,
               fmt::format("stroke=\"#ffffff\" stroke-width=\"{:.2f}\" stroke-linecap=\"round\"",
                           4 * unit));
      svg.line(detection.centre_px, seen->px,
               fmt::format("stroke=\"{}\" stroke-width=\"{:.2f}\" stroke-linecap=\"round\"", colour,
                           2.6 * unit));
    }
    svg.circle(
        detection.centre_px, 6.5 * unit,
        fmt::format("fill=\"{}\" stroke=\"#ffffff\" stroke-width=\"{:.2f}\"", colour, 1.7 * unit),
        hover_of(detection, error));
  }
}

Crop crop_of(const FrameDetections& frame, const Photograph* photograph, const Surface& surface,
             const RealVirtual& comparison) {
  Crop crop(frame);
  for (const Detection& detection : frame.detections) crop.extend(detection.centre_px);
  for (const MarkError& mark : comparison.marks.marks) {
    const auto place = surface.at(mark.material_m);
    const auto seen = photograph && place ? photograph->see(*place) : std::nullopt;
    if (seen) crop.extend(seen->px);
  }
  crop.finish(frame);
  return crop;
}

/// Something to paint in a photograph's frame, the far ones first.
struct Piece {
  double distance_m = 0;
  std::vector<Eigen::Vector2d> px;
  std::string style;
};

std::optional<Piece> piece_of(const Camera& camera, const std::vector<Eigen::Vector3d>& corners,
                              const Eigen::Vector3d& base, bool two_sided) {
  Piece piece;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& corner : corners) {
    const auto projection = project(camera.model, camera.cam_from_world * corner);
    if (!projection) return std::nullopt;
    piece.px.push_back(projection->px);
    middle += corner / static_cast<double>(corners.size());
  }
  const Eigen::Vector3d toward = centre_in_world(camera) - middle;
  piece.distance_m = toward.norm();
  Eigen::Vector3d normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]).normalized();
  const bool front = normal.dot(toward) > 0;
  if (!front && !two_sided) return std::nullopt;
  if (!front) normal = -normal;
  const Eigen::Vector3d light =
      (toward.normalized() + Eigen::Vector3d(0.3, -0.2, 0.6)).normalized();
  const Eigen::Vector3d colour = (0.45 + 0.55 * std::max(0.0, normal.dot(light))) *
                                 (front ? base : Eigen::Vector3d(0.82 * base));
  const std::string fill = fmt::format("#{:02x}{:02x}{:02x}", std::lround(colour.x()),
                                       std::lround(colour.y()), std::lround(colour.z()));
  piece.style = fmt::format("fill=\"{0}\" stroke=\"{0}\"", fill);
  return piece;
}

std::vector<Piece> pieces_of(const Camera& camera, const DrapeInput& input, const Sheet& sheet) {
  std::vector<Piece> pieces;
  const auto add = [&](const std::vector<Eigen::Vector3d>& corners, const Eigen::Vector3d& base,
                       bool two_sided, double behind_m) {
    if (auto piece = piece_of(camera, corners, base, two_sided)) {
      piece->distance_m += behind_m;
      pieces.push_back(std::move(*piece));
    }
  };
  if (input.scene) {
    for (const auto& quad : uncovered_quads(*input.scene, sheet))
      add({quad.begin(), quad.end()}, {190, 158, 112}, false, 3 * mm);
  }
  for (int row = 0; row + 1 < sheet.rows; ++row) {
    for (int col = 0; col + 1 < sheet.cols; ++col) {
      const SheetMark *a = sheet.find({row, col}), *b = sheet.find({row + 1, col}),
                      *c = sheet.find({row + 1, col + 1}), *d = sheet.find({row, col + 1});
      if (!a || !b || !c || !d) continue;
      add({a->point_in_world, b->point_in_world, c->point_in_world, d->point_in_world},
          {226, 228, 232}, true, 0);
    }
  }
  return pieces;
}

/// The marks of the print, where the virtual cloth shows its face.
void add_dots(const Photograph& photograph, const Camera& camera, const DrapeInput& input,
              const Surface& surface, double unit, std::vector<Piece>& pieces) {
  const auto lattice = LatticeCoordinates::of(input.measured.sheet, input.measured.file.string());
  if (!lattice) return;
  for (int row = 0; row < input.measured.sheet.rows; ++row) {
    for (int col = 0; col < input.measured.sheet.cols; ++col) {
      const auto place = surface.at(lattice->at({row, col}));
      const auto seen = place ? photograph.see(*place) : std::nullopt;
      if (!seen || !seen->faces_camera) continue;
      const double distance_m = (centre_in_world(camera) - place->point_in_world).norm();
      pieces.push_back({distance_m - 4 * mm, {seen->px}, coordinate(4.5 * unit)});
    }
  }
}

}  // namespace

Figure render_figure(const std::string& drape, const FrameDetections& frame,
                     const CalibratedCamera& camera, const DrapeInput& input,
                     const RealVirtual& comparison) {
  const Simulation& simulation = input.simulations[comparison.simulation];
  const Surface surface(simulation.sheet.sheet, simulation.sheet.file.string());
  const Photograph photograph(camera.camera);
  const Crop crop = crop_of(frame, &photograph, surface, comparison);
  const Eigen::Vector2d size = crop.high - crop.low;
  const double unit = size.x() / 1000;
  Svg svg(size.x(), size.y(),
          fmt::format("Drape {}: simulation {} as camera {} would see it", drape,
                      simulation.label(), frame.camera),
          crop.low);
  svg.rectangle(crop.low.x(), crop.low.y(), size.x(), size.y(), "fill=\"#5b626b\"");
  std::vector<Piece> pieces = pieces_of(camera.camera, input, simulation.sheet.sheet);
  add_dots(photograph, camera.camera, input, surface, unit, pieces);
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const Piece& a, const Piece& b) { return a.distance_m > b.distance_m; });
  svg.open_group(fmt::format("stroke-width=\"{:.2f}\" stroke-linejoin=\"round\"", 0.8 * unit));
  for (const Piece& piece : pieces) {
    if (piece.px.size() == 1) {
      svg.circle(piece.px.front(), std::stod(piece.style), "fill=\"#20242a\"");
    } else {
      svg.polygon(piece.px, piece.style);
    }
  }
  svg.close_group();
  return {fmt::format("{}-render-{}", drape, frame.camera),
          fmt::format("Simulation {} as camera {} would see it.", simulation.label(), frame.camera),
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
  const Simulation& simulation = input.simulations[comparison.simulation];
  const Surface surface(simulation.sheet.sheet, simulation.sheet.file.string());
  std::optional<Photograph> photograph;
  if (camera) photograph.emplace(camera->camera);
  const Crop crop = crop_of(frame, photograph ? &*photograph : nullptr, surface, comparison);
  const Eigen::Vector2d size = crop.high - crop.low;
  // Lines, dots and legend keep their size on paper whatever part of the image is shown.
  const double unit = size.x() / 1000;
  Svg svg(size.x(), size.y() + 72 * unit,
          fmt::format("Drape {}, camera {}: measured marks{}", drape, frame.camera,
                      camera ? " and the simulation " + simulation.label() : ""),
          crop.low);
  // Pixel centres are at integers, so the image begins half a pixel before the first centre.
  if (preview.empty()) {
    svg.rectangle(-0.5, -0.5, frame.width_px, frame.height_px, "fill=\"#8a8f96\"");
  } else {
    svg.image(-0.5, -0.5, frame.width_px, frame.height_px, jpeg_data_uri(preview),
              photo_id(drape, frame.camera));
  }
  if (photograph) draw_virtual(svg, *photograph, input, surface, unit);
  draw_marks(svg, frame, photograph ? &*photograph : nullptr, surface, comparison, unit);
  svg.rectangle(crop.low.x(), crop.high.y(), size.x(), frame.height_px, "fill=\"#ffffff\"");
  svg.open_group(fmt::format("transform=\"translate({} {}) scale({:.4f})\"",
                             coordinate(crop.low.x()), coordinate(crop.high.y()), 1.4 * unit));
  scale_of(comparison).draw(svg, 187, 8, 340);
  svg.close_group();
  return {fmt::format("{}-overlay-{}", drape, frame.camera),
          fmt::format("Camera {}: {} marks found.", frame.camera, frame.detections.size()),
          svg.finish()};
}

}  // namespace drape::compare
