// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "compare/meshes/obstacle_mesh.hpp"
#include "compare/report/account.hpp"
#include "core/files/files.hpp"
#include "core/files/inside.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr int kPointsPerCell = 3;         ///< per cell along a line of the virtual cloth
constexpr std::size_t kMostFaces = 8000;  ///< of an object; a finer mesh is not drawn
constexpr int kMostPoints = 40;           ///< per side; of finer sheets every k-th row is drawn

/// Rounds to a tenth of a pixel or millimetre, finer than a screen shows; zero has no sign.
double tenth(double value) {
  return std::round(value * 10) / 10 + 0.0;
}

void append(std::vector<double>& list, const Vector3d& point_m) {
  for (int k = 0; k < 3; ++k) list.push_back(tenth(point_m[k] / mm));
}

/// A point of the virtual sheet in one photograph.
struct Seen {
  Vector2d px;
  bool faces_camera = false;
};

/// The virtual sheet projected into one camera.
class Photographed {
 public:
  Photographed(const Camera* camera, const SheetFile& cloth)
      : camera_(camera), surface_(cloth.sheet, cloth.file.string()) {}

  /// Absent without a calibration, outside the sheet, or behind the camera.
  [[nodiscard]] std::optional<Seen> at(const Vector2d& material_m) const {
    const auto point = camera_ ? surface_.at(material_m) : std::nullopt;
    if (!point) return std::nullopt;
    const auto seen = project(camera_->model, camera_->cam_from_world * point->point_in_world);
    if (!seen) return std::nullopt;
    return Seen{seen->px, point->normal.dot(centre_in_world(*camera_) - point->point_in_world) > 0};
  }

  /// Adds a line through the material, split where the cloth turns its back to the camera.
  void add_line(const Vector2d& from, const Vector2d& to, int samples, ReportedView& view) const {
    std::vector<double> line;
    bool faces = true;
    const auto flush = [&] {
      if (line.size() > 2) (faces ? view.front : view.back).push_back(line);
      line.erase(line.begin(), line.size() > 2 ? line.end() - 2 : line.begin());
    };
    for (int i = 0; i <= samples; ++i) {
      const auto seen = at(from + (to - from) * i / samples);
      if (!seen || seen->faces_camera != faces) flush();
      if (!seen) line.clear();
      if (!seen) continue;
      faces = seen->faces_camera;
      line.insert(line.end(), {tenth(seen->px.x()), tenth(seen->px.y())});
    }
    flush();
  }

 private:
  const Camera* camera_;
  Surface surface_;
};

/// Adds rows, columns and edges of the virtual cloth.
void add_lines(const Photographed& cloth, const SheetFile& measured, ReportedView& view) {
  const Sheet& sheet = measured.sheet;
  const auto lattice = LatticeCoordinates::of(sheet, measured.file.string());
  if (!lattice) return;
  for (const int axis : {0, 1}) {
    const int lines = axis == 0 ? sheet.rows : sheet.cols;
    const int samples = ((axis == 0 ? sheet.cols : sheet.rows) + 1) * kPointsPerCell;
    for (int i = -1; i <= lines; ++i) {
      Vector2d from = Vector2d::Zero(), to = sheet.patch_m;
      from[axis] = to[axis] = i < 0        ? 0
                              : i == lines ? sheet.patch_m[axis]
                                           : lattice->at({i, i})[axis];
      cloth.add_line(from, to, samples, view);
    }
  }
}

ReportedView view_of(const FrameDetections& frame, const Camera* camera, const DrapeInput& input,
                     const RealVirtual& headline) {
  ReportedView view{frame.camera, "", frame.width_px, frame.height_px, {}, {}, {}, {}};
  const Photographed cloth(camera, input.simulations[headline.simulation].sheet);
  Eigen::AlignedBox2d crop;
  for (const Detection& seen : frame.detections) {
    std::vector<double> mark{static_cast<double>(seen.mark.row), static_cast<double>(seen.mark.col),
                             tenth(seen.centre_px.x()), tenth(seen.centre_px.y())};
    crop.extend(seen.centre_px);
    const auto& marks = headline.marks.marks;
    const auto error = std::find_if(marks.begin(), marks.end(),
                                    [&](const MarkError& one) { return one.mark == seen.mark; });
    if (const auto place = error == marks.end() ? std::nullopt : cloth.at(error->material_m))
      mark.insert(mark.end(), {tenth(place->px.x()), tenth(place->px.y())});
    view.marks.push_back(std::move(mark));
  }
  for (const MarkError& mark : headline.marks.marks)
    if (const auto place = cloth.at(mark.material_m)) crop.extend(place->px);
  const Eigen::AlignedBox2d image(Vector2d::Zero(), Vector2d(frame.width_px, frame.height_px));
  if (crop.isEmpty() || !(crop.sizes().minCoeff() > 0)) crop = image;
  const Vector2d margin = Vector2d::Constant(0.1 * crop.sizes().maxCoeff());
  crop = Eigen::AlignedBox2d((crop.min() - margin).array().floor().matrix(),
                             (crop.max() + margin).array().ceil().matrix())
             .intersection(image);
  view.crop_px << crop.min(), crop.max();
  if (camera != nullptr) add_lines(cloth, input.measured, view);
  return view;
}

}  // namespace

std::vector<ReportedView> views_of(const DrapeFiles& drape, const Report& report,
                                   const Session& session, const fs::path& folder) {
  std::vector<ReportedView> views;
  if (!drape.detections) return views;
  const RealVirtual& headline = report.real_virtual[*report.headline];
  for (const FrameDetections& frame : drape.detections->frames) {
    if (frame.set != drape.input.measured.measured().set) continue;
    const CalibratedCamera* camera =
        session.calibration ? session.calibration->find(frame.camera) : nullptr;
    views.push_back(view_of(frame, camera ? &camera->camera : nullptr, drape.input, headline));
    if (!frame.preview_file) continue;
    const fs::path beside = drape.detections_file.parent_path();
    const Where where{.file = drape.detections_file.string(), .field = "preview_file"};
    if (fs::is_regular_file(name_inside(beside, *frame.preview_file, where)))
      views.back().picture = fs::proximate(beside / *frame.preview_file, folder).generic_string();
  }
  return views;
}

std::optional<ReportedShape> shape_of(const DrapeInput& input, const Report& report) {
  const Sheet& sheet =
      input.simulations[report.real_virtual[*report.headline].simulation].sheet.sheet;
  const int step = std::max(1, std::max(sheet.rows, sheet.cols) / kMostPoints);
  const auto places = [&](int count) {
    std::vector<int> list;
    for (int i = 0; i < count - 1; i += step) list.push_back(i);
    list.push_back(count - 1);
    return list;
  };
  const std::vector<int> rows = places(sheet.rows), cols = places(sheet.cols);
  ReportedShape shape{static_cast<int>(rows.size()), static_cast<int>(cols.size()), {}, {}};
  for (const int row : rows) {
    for (const int col : cols) {
      const SheetMark* point = sheet.find({row, col});
      if (point == nullptr) return std::nullopt;  // mesh of another simulator with holes
      append(shape.cloth_mm, point->point_in_world);
    }
  }
  const auto quads =
      input.scene ? obstacle_quads(*input.scene) : std::vector<std::array<Vector3d, 4>>();
  if (quads.size() <= kMostFaces)
    for (const auto& quad : quads)
      for (const Vector3d& corner : quad) append(shape.object_mm, corner);
  return shape;
}

}  // namespace drape::compare
