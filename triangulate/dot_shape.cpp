// SPDX-License-Identifier: Apache-2.0
#include "triangulate/dot_shape.hpp"

#include <Eigen/Geometry>
#include <Eigen/QR>

#include "core/dot_image.hpp"

namespace drape {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector3d;

/// First and second derivatives of the surface by (row, col).
struct Derivatives {
  Vector3d by_row, by_col, by_row_row, by_row_col, by_col_col;
};

std::optional<Derivatives> derivatives(const PointsByMark& points, MarkId mark) {
  const auto centre = points.find(mark);
  if (centre == points.end()) return std::nullopt;
  std::vector<Eigen::Matrix<double, 1, 5>> rows;
  std::vector<Vector3d> offsets;
  for (int row = -1; row <= 1; ++row) {
    for (int col = -1; col <= 1; ++col) {
      const auto other = points.find({mark.row + row, mark.col + col});
      if ((row == 0 && col == 0) || other == points.end()) continue;
      rows.emplace_back();
      rows.back() << row, col, 0.5 * row * row, row * col, 0.5 * col * col;
      offsets.push_back(other->second - centre->second);
    }
  }
  if (rows.size() < 5) return std::nullopt;
  Eigen::Matrix<double, Eigen::Dynamic, 5> a(rows.size(), 5);
  Eigen::Matrix<double, Eigen::Dynamic, 3> b(rows.size(), 3);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    a.row(i) = rows[i];
    b.row(i) = offsets[i];
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(a);
  qr.setThreshold(1e-9);
  if (qr.rank() < 5) return std::nullopt;
  const Eigen::Matrix<double, 5, 3> x = qr.solve(b);
  return Derivatives{x.row(0), x.row(1), x.row(2), x.row(3), x.row(4)};
}

}  // namespace

std::optional<SurfacePatch> surface_patch(const PointsByMark& points, MarkId mark) {
  const auto d = derivatives(points, mark);
  if (!d) return std::nullopt;
  const Vector3d normal = d->by_row.cross(d->by_col).normalized();
  SurfacePatch patch;
  patch.axis_u = d->by_row.normalized();
  patch.axis_v = normal.cross(patch.axis_u);
  Matrix2d basis;  // (by_row, by_col) in (u, v)
  basis << d->by_row.dot(patch.axis_u), d->by_col.dot(patch.axis_u), d->by_row.dot(patch.axis_v),
      d->by_col.dot(patch.axis_v);
  Matrix2d second;
  second << d->by_row_row.dot(normal), d->by_row_col.dot(normal), d->by_row_col.dot(normal),
      d->by_col_col.dot(normal);
  const Matrix2d inverse = basis.inverse();
  patch.curvature_per_m = -(inverse.transpose() * second * inverse);
  if (!patch.curvature_per_m.allFinite()) return std::nullopt;
  return patch;
}

std::vector<View> without_dot_shape(const std::vector<View>& views, const Vector3d& in_world,
                                    const SurfacePatch& patch, double dot_diameter_m) {
  std::vector<View> corrected = views;
  for (View& view : corrected) {
    const Camera& camera = view.camera->camera;
    const Eigen::Matrix3d& rotation = camera.cam_from_world.rotation;
    const Vector3d centre = camera.cam_from_world * in_world;
    const auto centre_px = project(camera.model, centre);
    const auto seen_px =
        dot_centroid_px(camera.model, {centre, rotation * patch.axis_u, rotation * patch.axis_v,
                                       dot_diameter_m / 2, patch.curvature_per_m});
    if (centre_px && seen_px) view.px += centre_px->px - *seen_px;
  }
  return corrected;
}

}  // namespace drape
