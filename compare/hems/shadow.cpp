// SPDX-License-Identifier: Apache-2.0
#include "compare/hems/shadow.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "compare/records/provenance.hpp"
#include "core/cusick.hpp"
#include "core/error.hpp"
#include "core/files/mesh_file.hpp"
#include "core/sheet.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector2d;

constexpr int kSweeps = 500;  // sufficient for a lattice of 61 marks per side

/// Fills missing marks inside a complete hem with the mean of their neighbours, since a hole would
/// count neither as cloth nor as shadow.
int span_gaps(Sheet& sheet) {
  std::map<MarkId, SheetMark> marks;
  std::vector<MarkId> missing;
  SheetMark middle = sheet.marks.front();
  middle.point_in_world.setZero();
  middle.material_m.setZero();
  for (const SheetMark& mark : sheet.marks) {
    marks[mark.mark] = mark;
    middle.point_in_world += mark.point_in_world / static_cast<double>(sheet.marks.size());
    middle.material_m += mark.material_m / static_cast<double>(sheet.marks.size());
  }
  for (int row = 0; row < sheet.rows; ++row)
    for (int col = 0; col < sheet.cols; ++col) {
      middle.mark = {row, col};
      if (marks.emplace(middle.mark, middle).second) missing.push_back(middle.mark);
    }
  for (int sweep = 0; sweep < kSweeps && !missing.empty(); ++sweep)
    for (const MarkId id : missing) {
      const SheetMark &up = marks[{id.row - 1, id.col}], &down = marks[{id.row + 1, id.col}],
                      &left = marks[{id.row, id.col - 1}], &right = marks[{id.row, id.col + 1}];
      marks[id].point_in_world =
          (up.point_in_world + down.point_in_world + left.point_in_world + right.point_in_world) /
          4;
      marks[id].material_m =
          (up.material_m + down.material_m + left.material_m + right.material_m) / 4;
    }
  for (const MarkId id : missing) sheet.marks.push_back(marks[id]);
  return static_cast<int>(missing.size());
}

ShadowMesh shadow_mesh_of(Sheet sheet) {
  if (const std::string reason = why_no_hem(sheet); !reason.empty())
    throw bad_input(
        reason, {},
        "measure it again so that every outermost mark is seen, or give a picture of the hem");
  ShadowMesh mesh;
  mesh.no_go = sheet.no_go;
  mesh.own_specimen = true;
  mesh.measured = sheet.is_measured();
  if (const auto* source = std::get_if<SimulatedSource>(&sheet.source))
    mesh.status = source->status;
  mesh.spanned = span_gaps(sheet);
  std::map<MarkId, std::size_t> index;
  for (const SheetMark& mark : sheet.marks) {
    index[mark.mark] = mesh.points_m.size();
    mesh.points_m.push_back(mark.point_in_world);
    mesh.material_m.push_back(mark.material_m);
  }
  for (const auto& [mark, at] : index) {
    const auto right = index.find({mark.row, mark.col + 1});
    const auto below = index.find({mark.row + 1, mark.col});
    const auto across = index.find({mark.row + 1, mark.col + 1});
    if (right == index.end() || below == index.end() || across == index.end()) continue;
    mesh.triangles.push_back({at, right->second, below->second});
    mesh.triangles.push_back({right->second, across->second, below->second});
  }
  return mesh;
}

/// Area of the triangles for the given positions of the points.
template <class Points>
double area_of(const ShadowMesh& mesh, const Points& points) {
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    Eigen::Vector3d u = Eigen::Vector3d::Zero(), v = u;
    u.head(points[a].size()) = points[b] - points[a];
    v.head(points[a].size()) = points[c] - points[a];
    area += u.cross(v).norm() / 2;
  }
  return area;
}

struct Moments {
  double area = 0;
  Vector2d first = Vector2d::Zero();
};

/// Adds the length covered by a line at `y`, times `height`; pieces can be in any order.
void add_line(std::vector<std::pair<double, double>>& pieces, double y, double height,
              Moments& moments) {
  std::sort(pieces.begin(), pieces.end());
  for (std::size_t i = 0; i < pieces.size();) {
    const double from = pieces[i].first;
    double to = pieces[i].second;
    for (++i; i < pieces.size() && pieces[i].first <= to; ++i) to = std::max(to, pieces[i].second);
    const double area = (to - from) * height;
    moments.area += area;
    moments.first += area * Vector2d((from + to) / 2, y);
  }
}

Moments covered(const ShadowMesh& mesh) {
  constexpr int lines = 4096;
  double low = 1e300, high = -1e300;
  for (const auto& point : mesh.points_m) {
    low = std::min(low, point.y());
    high = std::max(high, point.y());
  }
  const double height = (high - low) / lines;
  std::vector<std::vector<std::pair<double, double>>> pieces(static_cast<std::size_t>(lines));
  const auto line_at = [&](double y) { return (y - low) / height - 0.5; };
  for (const auto& triangle : mesh.triangles) {
    std::array<Vector2d, 3> p;
    for (int k = 0; k < 3; ++k) p[k] = mesh.points_m[triangle[k]].head<2>();
    const auto [least, most] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
    const int last = std::min(lines - 1, static_cast<int>(std::floor(line_at(most))));
    for (int i = std::max(0, static_cast<int>(std::ceil(line_at(least)))); i <= last; ++i) {
      const double y = low + (i + 0.5) * height;
      double from = 1e300, to = -1e300;
      for (int k = 0; k < 3; ++k) {
        const Vector2d &a = p[k], &b = p[(k + 1) % 3];
        if ((a.y() - y) * (b.y() - y) > 0 || a.y() == b.y()) continue;
        const double x = a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
        from = std::min(from, x);
        to = std::max(to, x);
      }
      if (to > from) pieces[i].emplace_back(from, to);
    }
  }
  Moments moments;
  for (int i = 0; i < lines; ++i) add_line(pieces[i], low + (i + 0.5) * height, height, moments);
  return moments;
}

/// Reads the entry of a mesh from the list of virtual drapes beside it.
void read_list(const std::filesystem::path& list, const std::string& name, ShadowMesh& mesh) {
  const auto read = read_record<CusickFile>(list);
  for (const CusickStart& start : read.starts) {
    if (start.file != name) continue;
    mesh.fabric = read.fabric;
    mesh.status = start.at_rest ? "at rest" : "relaxation ended before";
    for (const std::string& refusal : start.refusals)
      mesh.status = "refused by the checker: " + refusal;
    mesh.flat_area_m2 = start.specimen_area_m2;
    mesh.disc_m = read.disc_m;
    mesh.specimen_m = read.specimen_m;
    return;
  }
  throw bad_input("the list beside the mesh does not name it",
                  {.file = list.string(), .field = name},
                  "remove a drape of an earlier run; keep other meshes in a folder of their own");
}

}  // namespace

ShadowMesh read_shadow_mesh(const std::filesystem::path& file) {
  std::filesystem::path json = file;
  json.replace_extension(".json");
  if (std::filesystem::exists(json)) {
    require_as_recorded(json);
    return shadow_mesh_of(read_sheet(json));
  }
  const MeshFile read = read_mesh_file(file);
  ShadowMesh mesh;
  for (const auto& point : read.points) mesh.points_m.emplace_back(point * units::mm);
  for (const auto& t : read.triangles)
    mesh.triangles.push_back({t[0].point, t[1].point, t[2].point});
  const std::filesystem::path list = file.parent_path() / "cusick.json";
  if (std::filesystem::exists(list)) {
    require_as_recorded(list);
    read_list(list, file.filename().string(), mesh);
  }
  return mesh;
}

double surface_m2(const ShadowMesh& mesh) {
  return area_of(mesh, mesh.points_m);
}

Hem shadow_of(const ShadowMesh& mesh) {
  const Moments moments = covered(mesh);
  if (!(moments.area > 0))
    throw bad_input("the mesh covers nothing seen from above", {}, "z is up");
  Hem hem{moments.first / moments.area, moments.area, {}, {}};
  std::vector<std::optional<double>> radius(720);
  for (const auto& triangle : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::size_t a = triangle[k], b = triangle[(k + 1) % 3];
      raise_outline(radius, mesh.points_m[a].head<2>() - hem.centre_m,
                    mesh.points_m[b].head<2>() - hem.centre_m);
    }
  }
  const auto whole = closed(radius);
  if (!whole)
    throw bad_input("the cloth does not go around its centre", {}, "give a whole specimen");
  hem.radius_m = *whole;
  hem.flat_area_m2 = mesh.flat_area_m2;
  if (!mesh.material_m.empty()) hem.flat_area_m2 = area_of(mesh, mesh.material_m);
  return hem;
}

}  // namespace drape::compare
