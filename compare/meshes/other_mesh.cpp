// SPDX-License-Identifier: Apache-2.0
#include "compare/meshes/other_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "compare/metrics/surface.hpp"
#include "core/drape_mesh.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using units::mm;

constexpr double kStep_m = 2 * mm;  ///< spacing at which a textured mesh is sampled
constexpr double kOutside = 1e-9;   ///< tolerance of a triangle, in barycentric coordinates
/// Cloth that hangs under its own weight does not strain by so much; units differ by 2.54 or more.
constexpr double kMostStrain = 0.3;

std::vector<double> sorted_unique(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  values.erase(
      std::unique(values.begin(), values.end(), [](double a, double b) { return b - a < 1e-9; }),
      values.end());
  return values;
}

/// Adds the vertices themselves, sorted so that rows run along the warp.
void add_grid(const DrapeMesh& drape, Sheet& sheet) {
  const MaterialRange& range = drape.grid->range;
  const int inner = drape.grid->inner_count;
  const bool inner_is_warp = drape.grid->inner == ClothDirection::warp;
  sheet.rows = inner_is_warp ? inner : drape.outer_count();
  sheet.cols = inner_is_warp ? drape.outer_count() : inner;
  const bool turn_rows = range.from_m.x() > range.to_m.x();
  const bool turn_cols = range.from_m.y() > range.to_m.y();
  for (int row = 0; row < sheet.rows; ++row) {
    for (int col = 0; col < sheet.cols; ++col) {
      const int a = turn_rows ? sheet.rows - 1 - row : row;
      const int b = turn_cols ? sheet.cols - 1 - col : col;
      const int step = inner_is_warp ? a : b, outer = inner_is_warp ? b : a;
      sheet.marks.push_back({{row, col},
                             drape.material_m(step, outer),
                             drape.points_in_world[static_cast<std::size_t>(outer * inner + step)],
                             {},
                             {},
                             {}});
    }
  }
}

/// 0, the side length, the marks' own lines, and lines between them at most a step apart.
std::vector<double> lines_of(const Sheet& measured, int axis) {
  std::vector<double> fixed = {0, measured.patch_m[axis]};
  for (const SheetMark& mark : measured.marks) fixed.push_back(mark.material_m[axis]);
  fixed = sorted_unique(fixed);
  std::vector<double> lines = {fixed.front()};
  for (std::size_t i = 1; i < fixed.size(); ++i) {
    const double gap = fixed[i] - fixed[i - 1];
    const int pieces = std::max(1, static_cast<int>(std::ceil(gap / kStep_m - 1e-9)));
    for (int k = 1; k < pieces; ++k) lines.push_back(fixed[i - 1] + gap * k / pieces);
    lines.push_back(fixed[i]);
  }
  return lines;
}

void add_texture(const DrapeMesh& drape, const Sheet& measured, Sheet& sheet) {
  const MaterialSurface surface(drape, kOutside);
  const std::vector<double> warp = lines_of(measured, 0), weft = lines_of(measured, 1);
  sheet.rows = static_cast<int>(warp.size());
  sheet.cols = static_cast<int>(weft.size());
  for (int row = 0; row < sheet.rows; ++row) {
    for (int col = 0; col < sheet.cols; ++col) {
      const Eigen::Vector2d material(warp[static_cast<std::size_t>(row)],
                                     weft[static_cast<std::size_t>(col)]);
      if (const auto point = surface.at(material)) {
        sheet.marks.push_back({{row, col}, material, *point, {}, {}, {}});
      } else {
        sheet.gaps.push_back({{row, col}, "the mesh has no triangle there"});
      }
    }
  }
}

/// Ratios of lengths on the mesh to those on the cloth, of neighbours along the warp or the weft.
std::vector<double> stretches_of(const Sheet& sheet, const MarkId& step) {
  std::vector<double> stretches;
  for (const SheetMark& mark : sheet.marks) {
    const SheetMark* next = sheet.find({mark.mark.row + step.row, mark.mark.col + step.col});
    if (next == nullptr) continue;
    const double cloth_m = (next->material_m - mark.material_m).norm();
    if (cloth_m > 0)
      stretches.push_back((next->point_in_world - mark.point_in_world).norm() / cloth_m);
  }
  return stretches;
}

/// Throws for a wrong unit, which would otherwise give plausible distances.
void require_size_of_cloth(const DrapeMesh& drape, const Sheet& sheet) {
  for (const bool warp : {true, false}) {
    const std::vector<double> stretches = stretches_of(sheet, warp ? MarkId{1, 0} : MarkId{0, 1});
    if (stretches.empty()) continue;
    const double stretch = median(stretches);
    if (stretch < 1 + kMostStrain && stretch > 1 / (1 + kMostStrain)) continue;
    drape.reject("unit_mm",
                 fmt::format("neighbours along the {} lie {:.3g} times as far apart in space as on "
                             "the cloth",
                             warp ? "warp" : "weft", stretch),
                 "give 10 for a mesh in cm, 25.4 in inches, 1000 in metres, or correct the "
                 "material coordinates");
  }
}

/// Another assignment of warp, weft or up axis with which a mesh is many times closer to the
/// measured marks than as described; empty if none. Warp and weft can be assigned in eight ways.
std::string better_description(const DrapeMesh& drape, const Sheet& sheet, const Sheet& measured) {
  constexpr double kTimes = 4;        ///< required ratio of distances
  constexpr double kOfPatch = 0.015;  ///< relative; below it any assignment fits a flat cloth
  constexpr const char* kLayings[] = {"",
                                      "warp_from and warp_to exchanged",
                                      "weft_from and weft_to exchanged",
                                      "both directions turned round",
                                      "warp and weft exchanged",
                                      "warp and weft exchanged, then warp_from and warp_to",
                                      "warp and weft exchanged, then weft_from and weft_to",
                                      "warp and weft exchanged and both turned round"};
  const Surface surface(sheet, drape.name);
  const bool z_up = drape.up == MeshUp::z;
  double stated_m = 0, best_m = HUGE_VAL;
  std::string best;
  for (const bool other_up : {false, true}) {
    for (std::size_t laying = 0; laying < std::size(kLayings); ++laying) {
      double sum = 0;
      std::size_t count = 0;
      for (const SheetMark& mark : measured.marks) {
        Eigen::Vector2d part = mark.material_m.cwiseQuotient(measured.patch_m);
        if ((laying & 4) != 0) std::swap(part.x(), part.y());
        if ((laying & 1) != 0) part.x() = 1 - part.x();
        if ((laying & 2) != 0) part.y() = 1 - part.y();
        const auto found = surface.at(part.cwiseProduct(measured.patch_m));
        if (!found) continue;
        const Eigen::Vector3d p = found->point_in_world;
        const Eigen::Vector3d point = !other_up ? p
                                      : z_up    ? Eigen::Vector3d(p.x(), -p.z(), p.y())
                                                : Eigen::Vector3d(p.x(), p.z(), -p.y());
        sum += (point - mark.point_in_world).squaredNorm();
        ++count;
      }
      if (2 * count < measured.marks.size()) continue;
      const double rms_m = std::sqrt(sum / static_cast<double>(count));
      if (!other_up && laying == 0) stated_m = rms_m;
      if (rms_m >= best_m) continue;
      best_m = rms_m;
      best = !other_up     ? kLayings[laying]
             : laying == 0 ? fmt::format("up = \"{}\"", z_up ? "y" : "z")
                           : fmt::format("up = \"{}\", {}", z_up ? "y" : "z", kLayings[laying]);
    }
  }
  if (best.empty() || stated_m < kOfPatch * measured.patch_m.norm() || kTimes * best_m > stated_m)
    return {};
  return fmt::format(
      "as {} describes it the mesh lies {:.3g} mm from the marks (RMS), with {} "
      "{:.3g} mm: correct the description",
      drape.document.file().filename().string(), stated_m / mm, best, best_m / mm);
}

std::string id_of(const fs::path& file, const std::string& mesh_sha256) {
  return sha256_of(std::string_view(other_mesh_content(sha256_of_file(file), mesh_sha256)));
}

}  // namespace

std::string other_mesh_content(const std::string& description_sha256,
                               const std::string& mesh_sha256) {
  return "drapebench/mesh\n" + description_sha256 + "\n" + mesh_sha256;
}

std::optional<std::string> description_in(const std::string& content) {
  constexpr std::size_t kHash = 64, kHead = std::string_view("drapebench/mesh\n").size();
  if (content.size() != kHead + kHash + 1 + kHash) return std::nullopt;
  std::string description = content.substr(kHead, kHash);
  if (other_mesh_content(description, content.substr(kHead + kHash + 1)) != content)
    return std::nullopt;
  return description;
}

std::optional<OtherMeshId> other_mesh_id(const fs::path& file) {
  if (file.extension() != ".toml" || !fs::is_regular_file(file) ||
      read_text(file).find("\"drapebench/mesh/") == std::string::npos)
    return std::nullopt;
  try {
    const fs::path mesh = read_record<DrapeMesh>(file).mesh_file;
    const std::string mesh_sha256 = sha256_of_file(mesh);
    return OtherMeshId{id_of(file, mesh_sha256), mesh, mesh_sha256};
  } catch (const Error&) {
    return std::nullopt;  // nothing could have been compared with it
  }
}

std::optional<OtherSurface> read_other_surface(const fs::path& file, const fs::path& mesh) {
  if (!read_record<DrapeMesh>(file).correspondence) return std::nullopt;
  DrapeMesh drape = read_drape_mesh(file, mesh);
  OtherSurface surface;
  surface.file = file;
  surface.mesh_file = drape.mesh_file;
  surface.simulator = drape.name;
  surface.scene = drape.scene;
  surface.fabric = drape.fabric;
  surface.mesh.points = std::move(drape.points_in_world);
  for (const auto& [a, b, c] : drape.mesh.triangles)
    surface.mesh.triangles.push_back({a.point, b.point, c.point});
  if (surface.mesh.triangles.empty())
    drape.reject("mesh", "the mesh has no face, so it is no surface", "export the faces too");
  surface.mesh_sha256 = sha256_of_file(surface.mesh_file);
  surface.sha256 = id_of(file, surface.mesh_sha256);
  return surface;
}

Simulation read_other_mesh(const fs::path& file, const Sheet& measured, const fs::path& mesh) {
  const DrapeMesh drape = read_drape_mesh(file, mesh);
  const fs::path& mesh_file = drape.mesh_file;
  Simulation simulation;
  simulation.other_simulator = drape.name;
  simulation.sheet.file = file;
  Sheet& sheet = simulation.sheet.sheet;
  sheet.patch_m = measured.patch_m;
  SimulatedSource source;
  source.scene = drape.scene;
  source.fabric = drape.fabric.value_or("not stated");
  source.model = *simulation.other_simulator;
  source.status = "as exported";
  if (drape.grid.has_value() == drape.uv.has_value())
    drape.reject("mesh", "it needs [grid] or [uv], and not both",
                 "say where the material points are; where nothing of it is known, write "
                 "correspondence = \"none\": then only surfaces are compared");
  drape.grid ? add_grid(drape, sheet) : add_texture(drape, measured, sheet);
  require_size_of_cloth(drape, sheet);
  if (std::string better = better_description(drape, sheet, measured); !better.empty())
    sheet.no_go = std::move(better);
  simulation.sheet.ply_sha256 = sha256_of_file(mesh_file);
  simulation.sheet.sha256 = id_of(file, simulation.sheet.ply_sha256);
  simulation.other_file = mesh_file;
  source.scene_sha256 = source.fabric_sha256 = sha256_of("not stated: " + source.fabric);
  sheet.source = source;
  return simulation;
}

}  // namespace drape::compare
