// SPDX-License-Identifier: Apache-2.0
#include "core/drape_mesh.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr int kStrips = 256;  ///< search strips along the warp

}  // namespace

static void fields(Fields& f, MaterialRange& range) {
  f({"warp_from_mm", "warp at the start", mm}, range.from_m.x());
  f({"warp_to_mm", "warp at the end", mm}, range.to_m.x());
  f({"weft_from_mm", "weft at the start", mm}, range.from_m.y());
  f({"weft_to_mm", "weft at the end", mm}, range.to_m.y());
}

static void fields(Fields& f, VertexGrid& grid) {
  f({"inner", "direction along which the index grows by one"}, grid.inner);
  f({"inner_count", "vertices of one row", 1, 2}, grid.inner_count);
  fields(f, grid.range);
}

static void fields(Fields& f, TextureMap& uv) {
  f({"warp", "texture coordinate along the warp"}, uv.warp);
  fields(f, uv.range);
}

void fields(Fields& f, DrapeMesh& drape) {
  f({"name", "name of the simulator for the tables"}, drape.name);
  f({"mesh", "mesh, .ply or .obj"}, drape.mesh_file);
  f({"unit_mm", "length of one unit of the mesh", mm, above_zero}, drape.unit_m);
  f.otherwise({"up", "axis of the mesh that points up"}, drape.up);
  f({"scene", "scene of the simulations compared with it"}, drape.scene);
  f.if_any({"fabric", "name of the fabric"}, drape.fabric);
  f.if_any({"correspondence", "only `none`: the material points of the vertices are unknown"},
           drape.correspondence);
  f.if_any({"grid", "vertices in rows"}, drape.grid);
  f.if_any({"uv", "texture coordinates"}, drape.uv);
  f.rule(!drape.correspondence || (!drape.grid && !drape.uv), "correspondence",
         "it can only be `none`, and then there is no [grid] and no [uv]", "remove one of them");
}

void DrapeMesh::reject(const char* field, const std::string& what,
                       const std::string& remedy) const {
  throw bad_input(what, document.where(field), remedy);
}

int DrapeMesh::outer_count() const {
  return static_cast<int>(points_in_world.size()) / grid->inner_count;
}

Vector2d DrapeMesh::material_m(int inner, int outer) const {
  const double along = static_cast<double>(inner) / (grid->inner_count - 1);
  const double across = static_cast<double>(outer) / (outer_count() - 1);
  return grid->range.at(grid->inner == ClothDirection::warp ? Vector2d(along, across)
                                                            : Vector2d(across, along));
}

DrapeMesh read_drape_mesh(const std::filesystem::path& file, const std::filesystem::path& mesh) {
  DrapeMesh drape = read_record<DrapeMesh>(file);
  if (!mesh.empty()) drape.mesh_file = mesh;
  drape.mesh = read_mesh_file(drape.mesh_file);
  for (const Vector3d& point : drape.mesh.points) {
    const Vector3d p = drape.unit_m * point;
    drape.points_in_world.push_back(drape.up == MeshUp::z ? p : Vector3d(p.x(), -p.z(), p.y()));
  }
  const auto count = static_cast<int>(drape.points_in_world.size());
  if (drape.grid && (count % drape.grid->inner_count != 0 || drape.outer_count() < 2))
    drape.reject("grid.inner_count",
                 fmt::format("{} vertices do not make rows of {}", count, drape.grid->inner_count),
                 "give the number of vertices of one row");
  if (drape.uv && (drape.mesh.uvs.empty() || drape.mesh.triangles.empty()))
    drape.reject("uv.warp", "the mesh has no faces with texture coordinates",
                 "export them, or describe its vertices by [grid]");
  return drape;
}

MaterialSurface::MaterialSurface(const DrapeMesh& drape, double tolerance) : tolerance_(tolerance) {
  drape.grid ? add_grid(drape) : add_texture(drape);
  strips_.assign(kStrips, {});
  for (std::size_t k = 0; k < pieces_.size(); ++k) {
    const auto [least, most] = std::minmax(
        {pieces_[k].material_m[0].x(), pieces_[k].material_m[1].x(), pieces_[k].material_m[2].x()});
    for (int s = strip_of(least - 1e-6); s <= strip_of(most + 1e-6); ++s) strips_[s].push_back(k);
  }
}

std::optional<Vector3d> MaterialSurface::at(const Vector2d& material_m) const {
  for (const std::size_t k : strips_[strip_of(material_m.x())]) {
    const Piece& piece = pieces_[k];
    const Vector2d w = piece.to_weights * (material_m - piece.material_m[0]);
    if (w.minCoeff() < -tolerance_ || w.sum() > 1 + tolerance_) continue;
    return (1 - w.sum()) * piece.in_world[0] + w.x() * piece.in_world[1] +
           w.y() * piece.in_world[2];
  }
  return std::nullopt;
}

void MaterialSurface::add(const std::array<Vector2d, 3>& material_m,
                          const std::array<Vector3d, 3>& in_world) {
  Eigen::Matrix2d sides;
  sides << material_m[1] - material_m[0], material_m[2] - material_m[0];
  if (!(std::abs(sides.determinant()) > 1e-18)) return;
  pieces_.push_back({sides.inverse(), material_m, in_world});
  low_m_ = std::min({low_m_, material_m[0].x(), material_m[1].x(), material_m[2].x()});
  high_m_ = std::max({high_m_, material_m[0].x(), material_m[1].x(), material_m[2].x()});
}

void MaterialSurface::add_texture(const DrapeMesh& drape) {
  for (const auto& triangle : drape.mesh.triangles) {
    std::array<Vector2d, 3> material_m;
    std::array<Vector3d, 3> in_world;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector2d& at = drape.mesh.uvs[triangle[k].uv];
      material_m[k] =
          drape.uv->range.at(drape.uv->warp == TextureDirection::u ? at : Vector2d(at.y(), at.x()));
      in_world[k] = drape.points_in_world[triangle[k].point];
    }
    add(material_m, in_world);
  }
}

void MaterialSurface::add_grid(const DrapeMesh& drape) {
  const int inner = drape.grid->inner_count;
  const auto& points = drape.points_in_world;
  for (int row = 0; row + 1 < drape.outer_count(); ++row)
    for (int at = 0; at + 1 < inner; ++at) {
      const auto i = static_cast<std::size_t>(row * inner + at);
      const std::size_t j = i + 1, k = i + static_cast<std::size_t>(inner), l = k + 1;
      const Vector2d first = drape.material_m(at, row), last = drape.material_m(at + 1, row + 1);
      add({first, drape.material_m(at + 1, row), last}, {points[i], points[j], points[l]});
      add({first, last, drape.material_m(at, row + 1)}, {points[i], points[l], points[k]});
    }
}

int MaterialSurface::strip_of(double warp_m) const {
  const double part = (warp_m - low_m_) / std::max(high_m_ - low_m_, 1e-12);
  return static_cast<int>(std::clamp(part * kStrips, 0.0, kStrips - 1.0));
}

}  // namespace drape
