// SPDX-License-Identifier: Apache-2.0
#include "simulate/start/start_file.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/mesh_file.hpp"
#include "core/files/toml_file.hpp"
#include "core/units.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr double kOnTriangle = 1e-6;  // of it; what files round to
constexpr int kStrips = 256;          // along the warp, in which triangles are looked for

bool is_description(const fs::path& file) {
  return file.extension() == ".toml";
}

/// One of two words under `key`: true for the first.
bool is_first(const TomlTable& table, const std::string& key, const std::string& first,
              const std::string& second) {
  const std::string word = table.text(key);
  if (word == first || word == second) return word == first;
  table.reject(key, fmt::format("it is `{}` or `{}`, not `{}`", first, second, word), "correct it");
}

/// Material coordinates (warp, weft) for parts 0 .. 1 of a grid or texture.
class Extent {
 public:
  explicit Extent(const TomlTable& table)
      : from_m_(table.number("warp_from_mm") * mm, table.number("weft_from_mm") * mm),
        to_m_(table.number("warp_to_mm") * mm, table.number("weft_to_mm") * mm) {}
  [[nodiscard]] Vector2d at(double warp, double weft) const {
    return from_m_ + Vector2d(warp, weft).cwiseProduct(to_m_ - from_m_);
  }

 private:
  Vector2d from_m_, to_m_;
};

/// A mesh over its material coordinates.
class MaterialSurface {
 public:
  void add(const std::array<Vector2d, 3>& material_m, const std::array<Vector3d, 3>& in_world) {
    Eigen::Matrix2d sides;
    sides << material_m[1] - material_m[0], material_m[2] - material_m[0];
    if (!(std::abs(sides.determinant()) > 1e-18)) return;
    pieces_.push_back({sides.inverse(), material_m, in_world});
    low_m_ = std::min({low_m_, material_m[0].x(), material_m[1].x(), material_m[2].x()});
    high_m_ = std::max({high_m_, material_m[0].x(), material_m[1].x(), material_m[2].x()});
  }

  void sort() {
    strips_.assign(kStrips, {});
    for (std::size_t k = 0; k < pieces_.size(); ++k) {
      const auto [least, most] =
          std::minmax({pieces_[k].material_m[0].x(), pieces_[k].material_m[1].x(),
                       pieces_[k].material_m[2].x()});
      for (int s = strip_of(least - 1e-6); s <= strip_of(most + 1e-6); ++s) strips_[s].push_back(k);
    }
  }

  [[nodiscard]] std::optional<Vector3d> at(const Vector2d& material_m) const {
    for (const std::size_t k : strips_[strip_of(material_m.x())]) {
      const Piece& piece = pieces_[k];
      const Vector2d w = piece.to_weights * (material_m - piece.material_m[0]);
      if (w.minCoeff() < -kOnTriangle || w.sum() > 1 + kOnTriangle) continue;
      return (1 - w.sum()) * piece.in_world[0] + w.x() * piece.in_world[1] +
             w.y() * piece.in_world[2];
    }
    return std::nullopt;
  }

 private:
  struct Piece {
    Eigen::Matrix2d to_weights;
    std::array<Vector2d, 3> material_m;
    std::array<Vector3d, 3> in_world;
  };
  [[nodiscard]] int strip_of(double warp_m) const {
    const double part = (warp_m - low_m_) / std::max(high_m_ - low_m_, 1e-12);
    return static_cast<int>(std::clamp(part * kStrips, 0.0, kStrips - 1.0));
  }

  std::vector<Piece> pieces_;
  std::vector<std::vector<std::size_t>> strips_;
  double low_m_ = 1e9, high_m_ = -1e9;
};

void add_texture(const TomlTable& uv, const MeshFile& mesh, const std::vector<Vector3d>& points,
                 MaterialSurface& surface) {
  const bool warp_is_u = is_first(uv, "warp", "u", "v");
  const Extent extent(uv);
  if (mesh.uvs.empty() || mesh.triangles.empty())
    uv.reject("warp", "the mesh has no faces with texture coordinates",
              "export them, or describe its vertices by [grid]");
  for (const auto& triangle : mesh.triangles) {
    std::array<Vector2d, 3> material_m;
    std::array<Vector3d, 3> in_world;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector2d& at = mesh.uvs[triangle[k].uv];
      material_m[k] = warp_is_u ? extent.at(at.x(), at.y()) : extent.at(at.y(), at.x());
      in_world[k] = points[triangle[k].point];
    }
    surface.add(material_m, in_world);
  }
}

void add_grid(const TomlTable& grid, const std::vector<Vector3d>& points,
              MaterialSurface& surface) {
  const bool inner_is_warp = is_first(grid, "inner", "warp", "weft");
  const Extent extent(grid);
  const auto inner = static_cast<std::size_t>(grid.positive_integer("inner_count"));
  if (inner < 2 || points.size() % inner != 0 || points.size() / inner < 2)
    grid.reject("inner_count",
                fmt::format("{} vertices do not make rows of {}", points.size(), inner),
                "give the number of vertices of one row");
  const std::size_t outer = points.size() / inner;
  const auto material = [&](std::size_t i) {
    const std::size_t in_row = i % inner, row = i / inner;
    const double along = static_cast<double>(in_row) / static_cast<double>(inner - 1);
    const double across = static_cast<double>(row) / static_cast<double>(outer - 1);
    return inner_is_warp ? extent.at(along, across) : extent.at(across, along);
  };
  for (std::size_t i = 0; i + inner + 1 < points.size(); ++i) {
    if (i % inner + 1 == inner) continue;
    const std::size_t j = i + 1, k = i + inner, l = k + 1;
    surface.add({material(i), material(j), material(l)}, {points[i], points[j], points[l]});
    surface.add({material(i), material(l), material(k)}, {points[i], points[l], points[k]});
  }
}

MaterialSurface read_surface(const fs::path& file) {
  const TomlTable table = TomlTable::open(file, "mesh");
  for (const char* key : {"name", "scene"}) static_cast<void>(table.text(key));
  static_cast<void>(table.text_or("fabric", ""));
  const bool z_is_up = !table.has("up") || is_first(table, "up", "z", "y");
  const double unit_m = table.positive("unit_mm") * mm;
  const auto grid = table.optional_table("grid"), uv = table.optional_table("uv");
  if (table.has("correspondence") || grid.has_value() == uv.has_value())
    table.reject("mesh", "a start needs either [grid] or [uv]",
                 "say where the material points of the mesh are");
  const MeshFile mesh = read_mesh_file(table.file_path("mesh"));
  std::vector<Vector3d> points;
  for (const Vector3d& p : mesh.points)
    points.push_back(unit_m * (z_is_up ? p : Vector3d(p.x(), -p.z(), p.y())));
  MaterialSurface surface;
  if (grid)
    add_grid(*grid, points, surface);
  else
    add_texture(*uv, mesh, points, surface);
  table.finish();
  surface.sort();
  return surface;
}

}  // namespace

void require_of_print(const Sheet& sheet, const fs::path& file, const Print& print) {
  constexpr double kSame_m = 1e-6;  // as files round
  const auto refuse = [&](const std::string& what, const char* field) {
    throw bad_input(fmt::format("the sheet is of another print than {}: {}",
                                print.file.filename().string(), what),
                    {.file = fs::path(file).replace_extension(".json").string(), .field = field},
                    "give the print that was measured, or a sheet of this one");
  };
  if (!((sheet.patch_m - print.patch_m).cwiseAbs().maxCoeff() <= kSame_m))
    refuse(fmt::format("its patch has {:g} x {:g} mm, not {:g} x {:g}", sheet.patch_m.x() / mm,
                       sheet.patch_m.y() / mm, print.patch_m.x() / mm, print.patch_m.y() / mm),
           "patch_mm");
  if (!sheet.is_measured()) return;
  if (sheet.rows != print.rows || sheet.cols != print.cols)
    refuse(fmt::format("it has {} x {} marks, not {} x {}", sheet.rows, sheet.cols, print.rows,
                       print.cols),
           "rows");
  for (const SheetMark& mark : sheet.marks) {
    const Vector2d here_m = print.material_m(mark.mark);
    if ((mark.material_m - here_m).norm() <= kSame_m) continue;
    refuse(
        fmt::format("its mark ({}, {}) lies at ({:g}, {:g}) mm of the cloth, not at ({:g}, {:g})",
                    mark.mark.row, mark.mark.col, mark.material_m.x() / mm,
                    mark.material_m.y() / mm, here_m.x() / mm, here_m.y() / mm),
        "marks.material_mm");
  }
}

Sheet read_start(const fs::path& file, const Print& print) {
  if (!is_description(file)) {
    Sheet sheet = read_sheet(file);
    require_of_print(sheet, file, print);
    return sheet;
  }
  const MaterialSurface surface = read_surface(file);
  Sheet sheet{print.rows, print.cols, print.patch_m, {}, {}, {}};
  sheet.source = MeasuredSource{"", file.stem().string(), {}, "", ""};
  for (int row = 0; row < print.rows; ++row) {
    for (int col = 0; col < print.cols; ++col) {
      const Vector2d material_m = print.material_m({row, col});
      const std::optional<Vector3d> point = surface.at(material_m);
      if (!point)
        throw bad_input(
            fmt::format("the mesh does not cover mark ({}, {}) at ({:g}, {:g}) mm of the cloth",
                        row, col, material_m.x() / mm, material_m.y() / mm),
            {.file = file.string()},
            "export the whole cloth, and state warp and weft of its first and last points");
      sheet.marks.push_back({{row, col}, material_m, *point, {}, {}, {}});
    }
  }
  return sheet;
}

std::vector<fs::path> start_files(const fs::path& file) {
  if (is_description(file)) return {file, TomlTable::open(file, "mesh").file_path("mesh")};
  return {fs::path(file).replace_extension(".json")};
}

std::string start_sha256(const fs::path& file) {
  const std::vector<fs::path> files = start_files(file);
  if (files.size() == 1) return sha256_of_file(files.front());
  return sha256_of(sha256_of_file(files[0]) + "\n" + sha256_of_file(files[1]));
}

}  // namespace drape::simulate
