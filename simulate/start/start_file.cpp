// SPDX-License-Identifier: Apache-2.0
#include "simulate/start/start_file.hpp"

#include <fmt/format.h>

#include <optional>

#include "core/drape_mesh.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

bool is_description(const fs::path& file) {
  return file.extension() == ".toml";
}

MaterialSurface read_surface(const fs::path& file) {
  const DrapeMesh drape = read_drape_mesh(file);
  if (drape.grid.has_value() == drape.uv.has_value())
    drape.reject("mesh", "a start needs either [grid] or [uv]",
                 "say where the material points of the mesh are");
  constexpr double kOnTriangle = 1e-6;  // relative to the triangle; rounding in files
  return {drape, kOnTriangle};
}

}  // namespace

void require_of_print(const Sheet& sheet, const fs::path& file, const Print& print) {
  constexpr double kSame_m = 1e-6;  // rounding in files
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
  if (is_description(file)) return {file, read_record<DrapeMesh>(file).mesh_file};
  return {fs::path(file).replace_extension(".json")};
}

std::string start_sha256(const fs::path& file) {
  const std::vector<fs::path> files = start_files(file);
  if (files.size() == 1) return sha256_of_file(files.front());
  return sha256_of(sha256_of_file(files[0]) + "\n" + sha256_of_file(files[1]));
}

}  // namespace drape::simulate
