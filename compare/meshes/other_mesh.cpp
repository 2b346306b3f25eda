// SPDX-License-Identifier: Apache-2.0
#include "compare/meshes/other_mesh.hpp"

#include <fmt/format.h>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <map>

#include "compare/metrics/surface.hpp"
#include "compare/records/provenance.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/mesh_file.hpp"
#include "core/files/toml_file.hpp"
#include "core/program/run_record.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using units::mm;

constexpr double kStep_m = 2 * mm;  ///< points of cloth taken from a textured mesh
constexpr double kOutside = 1e-9;   ///< of a triangle, in barycentric coordinates
/// No cloth strains by so much where it hangs by its own weight; units differ by 2.54 or more.
constexpr double kMostStrain = 0.3;

/// Material coordinates (warp, weft) where an index or texture coordinate is at its start and end.
struct Range {
  Eigen::Vector2d from_m, to_m;

  static Range of(const TomlTable& table) {
    return {{table.number("warp_from_mm") * mm, table.number("weft_from_mm") * mm},
            {table.number("warp_to_mm") * mm, table.number("weft_to_mm") * mm}};
  }
  [[nodiscard]] Eigen::Vector2d at(const Eigen::Vector2d& part) const {
    return from_m + part.cwiseProduct(to_m - from_m);
  }
};

std::vector<Eigen::Vector3d> points_in_world(const TomlTable& table, const MeshFile& mesh) {
  const std::string up = table.text_or("up", "z");
  if (up != "z" && up != "y")
    table.reject("up", fmt::format("up is `z` or `y`, not `{}`", up), "correct it");
  const double unit_m = table.positive("unit_mm") * mm;
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& point : mesh.points) {
    const Eigen::Vector3d p = unit_m * point;
    points.push_back(up == "z" ? p : Eigen::Vector3d(p.x(), -p.z(), p.y()));
  }
  return points;
}

bool is_warp(const TomlTable& table, const std::string& key, const std::string& yes,
             const std::string& no) {
  const std::string word = table.text(key);
  if (word != yes && word != no)
    table.reject(key, fmt::format("it is `{}` or `{}`, not `{}`", yes, no, word), "correct it");
  return word == yes;
}

std::vector<double> sorted_unique(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  values.erase(
      std::unique(values.begin(), values.end(), [](double a, double b) { return b - a < 1e-9; }),
      values.end());
  return values;
}

/// The vertices themselves, sorted so that rows run along the warp.
void add_grid(const TomlTable& table, const MeshFile& mesh,
              const std::vector<Eigen::Vector3d>& points, Sheet& sheet) {
  const bool inner_is_warp = is_warp(table, "inner", "warp", "weft");
  const int inner = table.positive_integer("inner_count");
  const Range range = Range::of(table);
  const int count = static_cast<int>(mesh.points.size());
  if (inner < 2 || count % inner != 0 || count / inner < 2) {
    table.reject("inner_count", fmt::format("{} vertices do not make rows of {}", count, inner),
                 "give the number of vertices of one row");
  }
  const int outer = count / inner;
  sheet.rows = inner_is_warp ? inner : outer;
  sheet.cols = inner_is_warp ? outer : inner;
  const bool turn_rows = range.from_m.x() > range.to_m.x();
  const bool turn_cols = range.from_m.y() > range.to_m.y();
  for (int row = 0; row < sheet.rows; ++row) {
    for (int col = 0; col < sheet.cols; ++col) {
      const int a = turn_rows ? sheet.rows - 1 - row : row;
      const int b = turn_cols ? sheet.cols - 1 - col : col;
      const int index = inner_is_warp ? b * inner + a : a * inner + b;
      const Eigen::Vector2d part(static_cast<double>(a) / (sheet.rows - 1),
                                 static_cast<double>(b) / (sheet.cols - 1));
      sheet.marks.push_back(
          {{row, col}, range.at(part), points[static_cast<std::size_t>(index)], {}, {}, {}});
    }
  }
}

/// The textured mesh over its material coordinates.
struct Chart {
  struct Triangle {
    Eigen::Matrix2d to_weights;  ///< material offset from the first corner to two weights
    Eigen::Vector2d corner, low, high;
    std::array<std::size_t, 3> points;
  };
  std::vector<Triangle> triangles;

  [[nodiscard]] std::optional<Eigen::Vector3d> at(
      const Eigen::Vector2d& material, const std::vector<Eigen::Vector3d>& points) const {
    for (const Triangle& t : triangles) {
      if ((material.array() < t.low.array() - 1e-9).any() ||
          (material.array() > t.high.array() + 1e-9).any())
        continue;
      const Eigen::Vector2d w = t.to_weights * (material - t.corner);
      if (w.minCoeff() < -kOutside || w.sum() > 1 + kOutside) continue;
      return (1 - w.sum()) * points[t.points[0]] + w.x() * points[t.points[1]] +
             w.y() * points[t.points[2]];
    }
    return std::nullopt;
  }
};

Chart chart_of(const TomlTable& table, const MeshFile& mesh) {
  if (mesh.uvs.empty())
    table.reject("warp", "the mesh has no texture coordinates", "export them, or use [grid]");
  const bool v_is_warp = is_warp(table, "warp", "v", "u");
  const Range range = Range::of(table);
  const auto material = [&](const MeshCorner& corner) {
    const Eigen::Vector2d uv = mesh.uvs[corner.uv];
    return range.at(v_is_warp ? Eigen::Vector2d(uv.y(), uv.x()) : uv);
  };
  Chart chart;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector2d p = material(a), q = material(b), r = material(c);
    Eigen::Matrix2d sides;
    sides << q - p, r - p;
    if (std::abs(sides.determinant()) < 1e-18) continue;
    chart.triangles.push_back({sides.inverse(),
                               p,
                               p.cwiseMin(q).cwiseMin(r),
                               p.cwiseMax(q).cwiseMax(r),
                               {a.point, b.point, c.point}});
  }
  return chart;
}

/// 0, the side, the marks' own lines, and lines between them that are at most a step apart.
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

void add_chart(const TomlTable& table, const MeshFile& mesh,
               const std::vector<Eigen::Vector3d>& points, const Sheet& measured, Sheet& sheet) {
  const Chart chart = chart_of(table, mesh);
  const std::vector<double> warp = lines_of(measured, 0), weft = lines_of(measured, 1);
  sheet.rows = static_cast<int>(warp.size());
  sheet.cols = static_cast<int>(weft.size());
  for (int row = 0; row < sheet.rows; ++row) {
    for (int col = 0; col < sheet.cols; ++col) {
      const Eigen::Vector2d material(warp[static_cast<std::size_t>(row)],
                                     weft[static_cast<std::size_t>(col)]);
      if (const auto point = chart.at(material, points)) {
        sheet.marks.push_back({{row, col}, material, *point, {}, {}, {}});
      } else {
        sheet.gaps.push_back({{row, col}, "the mesh has no triangle there"});
      }
    }
  }
}

/// Lengths of the mesh over those of its cloth, of neighbours in a column (along the warp) or row.
std::vector<double> stretches_of(const Sheet& sheet, const MarkId& step) {
  std::map<MarkId, const SheetMark*> marks;
  for (const SheetMark& mark : sheet.marks) marks[mark.mark] = &mark;
  std::vector<double> stretches;
  for (const auto& [id, mark] : marks) {
    const auto next = marks.find({id.row + step.row, id.col + step.col});
    if (next == marks.end()) continue;
    const double cloth_m = (next->second->material_m - mark->material_m).norm();
    if (cloth_m > 0)
      stretches.push_back((next->second->point_in_world - mark->point_in_world).norm() / cloth_m);
  }
  return stretches;
}

/// A mesh in another unit than stated has distances like any other.
void require_size_of_cloth(const TomlTable& table, const Sheet& sheet) {
  for (const bool warp : {true, false}) {
    const std::vector<double> stretches = stretches_of(sheet, warp ? MarkId{1, 0} : MarkId{0, 1});
    if (stretches.empty()) continue;
    const double stretch = median(stretches);
    if (stretch < 1 + kMostStrain && stretch > 1 / (1 + kMostStrain)) continue;
    table.reject("unit_mm",
                 fmt::format("neighbours along the {} lie {:.3g} times as far apart in space as on "
                             "the cloth",
                             warp ? "warp" : "weft", stretch),
                 "give 10 for a mesh in cm, 25.4 in inches, 1000 in metres, or correct the "
                 "material coordinates");
  }
}

std::string id_of(const fs::path& file, const std::string& mesh_sha256) {
  return sha256_of("drapebench/mesh\n" + sha256_of_file(file) + "\n" + mesh_sha256);
}

}  // namespace

std::optional<OtherMeshId> other_mesh_id(const fs::path& file) {
  if (file.extension() != ".toml" || !fs::is_regular_file(file) ||
      read_text(file).find("\"drapebench/mesh/") == std::string::npos)
    return std::nullopt;
  try {
    const fs::path mesh = TomlTable::open(file, "mesh").file_path("mesh");
    const std::string mesh_sha256 = sha256_of_file(mesh);
    return OtherMeshId{id_of(file, mesh_sha256), mesh, mesh_sha256};
  } catch (const Error&) {
    return std::nullopt;  // not one that anything could have been compared with
  }
}

std::optional<OtherSurface> read_other_surface(const fs::path& file) {
  const TomlTable table = TomlTable::open(file, "mesh");
  if (!table.has("correspondence")) return std::nullopt;
  if (table.text("correspondence") != "none" || table.has("grid") || table.has("uv")) {
    table.reject("correspondence", "it can only be `none`, and then there is no [grid] and no [uv]",
                 "remove one of them");
  }
  OtherSurface surface;
  surface.file = file;
  surface.mesh_file = table.file_path("mesh");
  surface.simulator = table.text("name");
  surface.scene = table.text("scene");
  if (table.has("fabric")) surface.fabric = table.text("fabric");
  const MeshFile mesh = read_mesh_file(surface.mesh_file);
  surface.mesh.points = points_in_world(table, mesh);
  table.finish();
  for (const auto& [a, b, c] : mesh.triangles)
    surface.mesh.triangles.push_back({a.point, b.point, c.point});
  if (surface.mesh.triangles.empty())
    table.reject("mesh", "the mesh has no face, so it is no surface", "export the faces too");
  surface.mesh_sha256 = sha256_of_file(surface.mesh_file);
  surface.sha256 = id_of(file, surface.mesh_sha256);
  return surface;
}

Simulation read_other_mesh(const fs::path& file, const Sheet& measured) {
  const TomlTable table = TomlTable::open(file, "mesh");
  const fs::path mesh_file = table.file_path("mesh");
  Simulation simulation;
  simulation.other_simulator = table.text("name");
  simulation.sheet.file = file;
  Sheet& sheet = simulation.sheet.sheet;
  sheet.patch_m = measured.patch_m;
  SimulatedSource source;
  source.scene = table.text("scene");
  source.fabric = table.text_or("fabric", "not stated");
  source.model = *simulation.other_simulator;
  source.solver = "not stated";
  source.status = "as exported";
  const auto grid = table.optional_table("grid"), uv = table.optional_table("uv");
  if (grid.has_value() == uv.has_value())
    table.reject("mesh", "it needs [grid] or [uv], and not both",
                 "say where the material points are; where nothing of it is known, write "
                 "correspondence = \"none\": then only surfaces are compared");
  const MeshFile mesh = read_mesh_file(mesh_file);
  const std::vector<Eigen::Vector3d> points = points_in_world(table, mesh);
  if (grid) {
    add_grid(*grid, mesh, points, sheet);
  } else {
    add_chart(*uv, mesh, points, measured, sheet);
  }
  table.finish();
  require_size_of_cloth(table, sheet);
  simulation.sheet.ply_sha256 = sha256_of_file(mesh_file);
  simulation.sheet.sha256 = id_of(file, simulation.sheet.ply_sha256);
  simulation.other_file = mesh_file;
  source.scene_sha256 = source.fabric_sha256 = sha256_of("not stated: " + source.fabric);
  sheet.source = source;
  read_piece_beside(file, simulation);
  return simulation;
}

namespace {

void read_record_of_piece(const StepRecord& record, Simulation& simulation) {
  for (const auto& [file, sha256] : record.outputs)
    if (fs::is_regular_file(file) && sha256_of_file(file) != sha256)
      throw bad_input(
          "this file is not the one that its run wrote", {.file = file.string()},
          "run drape simulate piece again, or restore what " + record.file.string() + " lists");
  if (record.inputs.empty()) return;
  const auto& [scene, sha256] = record.inputs.front();  // the first file that the program reads
  std::get<SimulatedSource>(simulation.sheet.sheet.source).scene_sha256 = sha256;
  if (fs::is_regular_file(scene) && sha256_of_file(scene) == sha256)
    simulation.scene = read_simulated_scene(scene, record.inputs);
}

}  // namespace

bool is_piece(const fs::path& json) {
  return fs::is_regular_file(json) &&
         read_text(json).find("\"drapebench/piece/") != std::string::npos;
}

std::string status_of_piece(const JsonNode& piece) {
  if (piece.boolean("at_rest")) return "at rest";
  if (!piece.has("refusals") || piece.texts("refusals").empty()) return "not at rest";
  return "refused by the checker: " + piece.texts("refusals").front();
}

void read_piece_beside(const fs::path& description, Simulation& simulation) {
  fs::path file = description;
  file.replace_extension(".json");
  if (!is_piece(file)) return;
  const JsonNode piece = JsonNode::open(file, "piece", 1);
  simulation.piece = true;
  simulation.sheet.sheet.no_go = piece.optional_text("no_go");
  std::get<SimulatedSource>(simulation.sheet.sheet.source).status = status_of_piece(piece);
  if (fs::is_regular_file(run_record_path(description)))
    read_record_of_piece(*read_made_by(description), simulation);
}

}  // namespace drape::compare
