// SPDX-License-Identifier: Apache-2.0
#include "core/drape_mesh.hpp"

#include <fmt/format.h>
#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <sstream>

#include "core/files/files.hpp"
#include "core/files/number_range.hpp"
#include "core/matching.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr int kStrips = 256;  ///< search strips along the warp
constexpr std::size_t kMostPoints = 5'000'000;
constexpr std::size_t kMostTriangles = 10'000'000;

[[noreturn]] void reject(const fs::path& file, const std::string& what,
                         std::optional<int> line = {}) {
  throw bad_input(what, {.file = file.string(), .line = line},
                  "export the mesh again as PLY or OBJ");
}

double number_of(const std::string& word, const fs::path& file, int line) {
  double value = 0;
  const char* begin = word.data() + (word.size() > 1 && word.front() == '+' ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() ||
      !(std::abs(value) <= largest_number))
    reject(file, fmt::format("`{}` is not a number", word.substr(0, 40)), line);
  return value;
}

/// Splits a face into a fan of triangles; every exporter writes planar faces.
void add_face(MeshFile& mesh, const std::vector<MeshCorner>& corners, const fs::path& file) {
  if (corners.size() > kMostTriangles - mesh.triangles.size())
    reject(file, fmt::format("more than {} triangles", kMostTriangles));
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    mesh.triangles.push_back({corners[0], corners[i], corners[i + 1]});
}

void check_indices(const MeshFile& mesh, const fs::path& file) {
  for (const auto& triangle : mesh.triangles)
    for (const auto& [point, uv] : triangle)
      if (point >= mesh.points.size() || (!mesh.uvs.empty() && uv >= mesh.uvs.size()))
        reject(file, fmt::format("a face names vertex {} of {}", point, mesh.points.size()));
  for (const MeshSide& side : mesh.sides)
    for (const std::uint32_t end : side.ends)
      if (end >= mesh.points.size())
        reject(file, fmt::format("a side names vertex {} of {}", end, mesh.points.size()));
}

/// Drops repeated faces and faces that name a corner twice: they have no effect but cost time.
void drop_repeated(MeshFile& mesh) {
  using Points = std::array<std::uint32_t, 3>;
  std::vector<std::pair<Points, std::size_t>> faces;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    Points points = {t[0].point, t[1].point, t[2].point};
    std::sort(points.begin(), points.end());
    if (points[0] != points[1] && points[1] != points[2]) faces.emplace_back(points, i);
  }
  std::sort(faces.begin(), faces.end());
  const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
  faces.erase(std::unique(faces.begin(), faces.end(), same), faces.end());
  if (faces.size() == mesh.triangles.size()) return;
  std::vector<std::size_t> kept;
  kept.reserve(faces.size());
  for (const auto& face : faces) kept.push_back(face.second);
  std::sort(kept.begin(), kept.end());
  for (std::size_t i = 0; i < kept.size(); ++i) mesh.triangles[i] = mesh.triangles[kept[i]];
  mesh.triangles.resize(kept.size());
}

// ---- PLY ----

struct PlyType {
  const char *name, *long_name;
  std::size_t bytes;
  double (*read)(const char* bytes);
};

template <class T>
double read_as(const char* bytes) {
  T value{};
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<double>(value);
}

template <class T>
constexpr PlyType ply_type(const char* name, const char* long_name) {
  return {name, long_name, sizeof(T), read_as<T>};
}

constexpr std::array kPlyTypes = {
    ply_type<std::int8_t>("char", "int8"),    ply_type<std::uint8_t>("uchar", "uint8"),
    ply_type<std::int16_t>("short", "int16"), ply_type<std::uint16_t>("ushort", "uint16"),
    ply_type<std::int32_t>("int", "int32"),   ply_type<std::uint32_t>("uint", "uint32"),
    ply_type<float>("float", "float32"),      ply_type<double>("double", "float64")};

const PlyType* type_of(const std::string& word, const fs::path& file) {
  for (const PlyType& type : kPlyTypes)
    if (word == type.name || word == type.long_name) return &type;
  reject(file, fmt::format("PLY has no type `{}`", word));
}

struct Property {
  std::string name;
  const PlyType* type = nullptr;
  const PlyType* count_type = nullptr;  ///< type of a list's count; null for a scalar property
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;

  [[nodiscard]] bool has(const char* property_name) const {
    return std::ranges::find(properties, property_name, &Property::name) != properties.end();
  }
};

struct PlyHead {
  std::string format;
  std::vector<Element> elements;
  std::size_t body = 0;  ///< offset of the first byte of data
  int lines = 0;
};

PlyHead read_head(const std::string& text, const fs::path& file) {
  PlyHead head;
  std::size_t at = 0;
  while (true) {
    const std::size_t end = text.find('\n', at);
    if (end == std::string::npos) reject(file, "the PLY header does not end", head.lines);
    std::istringstream words(text.substr(at, end - at));
    at = end + 1;
    ++head.lines;
    std::string word;
    words >> word;
    if (head.lines == 1 && word != "ply") reject(file, "this is not a PLY file", 1);
    if (word == "end_header") break;
    if (word == "format") {
      std::string version;
      words >> head.format >> version;
      if (version != "1.0")
        reject(file, fmt::format("PLY version `{}`, not 1.0", printable(version)), head.lines);
    }
    if (word == "element") {
      Element element;
      std::string count;
      words >> element.name >> count;
      const double whole = number_of(count, file, head.lines);
      if (whole < 0 || whole != std::floor(whole) || whole > 1e15)
        reject(file, "an element without a count", head.lines);
      element.count = static_cast<std::size_t>(whole);
      head.elements.push_back(element);
    }
    if (word != "property") continue;
    if (head.elements.empty()) reject(file, "a property before any element", head.lines);
    std::string type, count_type, name;
    words >> type;
    if (type == "list") words >> count_type >> type;
    words >> name;
    head.elements.back().properties.push_back(
        {name, type_of(type, file), count_type.empty() ? nullptr : type_of(count_type, file)});
  }
  head.body = at;
  return head;
}

/// Reads the values of a PLY body in order, in any of its formats.
class PlyBody {
 public:
  PlyBody(const std::string& text, const PlyHead& head, const fs::path& file)
      : text_(text), at_(head.body), file_(file), ascii_(head.format == "ascii") {
    if (!ascii_ && head.format != "binary_little_endian" && head.format != "binary_big_endian")
      reject(file, fmt::format("PLY format `{}` is not known", head.format));
    swap_ = !ascii_ &&
            (head.format == "binary_big_endian") != (std::endian::native == std::endian::big);
  }

  double next(const PlyType& type) {
    const double value = ascii_ ? next_word() : next_bytes(type);
    if (!(std::abs(value) <= largest_number))
      reject(file_, "the mesh holds a value that is not finite");
    return value;
  }

  /// Throws unless the values of an item end with its line.
  void end_item() {
    if (!ascii_) return;
    at_ = std::min(text_.find_first_not_of(" \t\r", at_), text_.size());
    if (at_ < text_.size() && text_[at_] != '\n')
      reject(file_, "a line holds another number of values than its element has", line_at(at_));
  }

  /// Reads a count of items that take at least one byte each.
  std::size_t next_count(const PlyType& type) {
    const double value = next(type);
    if (value < 0 || value != std::floor(value)) reject(file_, "a list without a sensible count");
    if (value > static_cast<double>(text_.size() - at_))
      reject(file_, "a list is longer than the rest of the file");
    return static_cast<std::size_t>(value);
  }

  /// Throws if the file is too short for the element's count.
  void check_count(const Element& element) const {
    if (element.count == 0) return;
    if (element.properties.empty() || element.count > text_.size() - at_)
      reject(file_, fmt::format("the file is too short for {} of `{}`", element.count,
                                element.name.substr(0, 40)));
    if (element.name != "vertex") return;
    if (element.count > kMostPoints)
      reject(file_, fmt::format("more than {} vertices", kMostPoints));
    for (const char* axis : {"x", "y", "z"})
      if (!element.has(axis)) reject(file_, fmt::format("the vertices have no `{}`", axis));
  }

 private:
  double next_word() {
    const std::size_t begin = text_.find_first_not_of(" \t\r\n", at_);
    if (begin == std::string::npos) reject(file_, "the PLY file ends before its data");
    at_ = std::min(text_.find_first_of(" \t\r\n", begin), text_.size());
    const std::string word = text_.substr(begin, at_ - begin);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc() && end == word.data() + word.size()) return value;
    return number_of(word, file_, line_at(begin));  // signed, or not a number
  }

  [[nodiscard]] int line_at(std::size_t place) const {
    const auto end = text_.begin() + static_cast<std::ptrdiff_t>(place);
    return static_cast<int>(std::count(text_.begin(), end, '\n')) + 1;
  }

  double next_bytes(const PlyType& type) {
    if (at_ + type.bytes > text_.size()) reject(file_, "the PLY file ends before its data");
    std::array<char, sizeof(double)> bytes{};
    std::copy_n(text_.data() + at_, type.bytes, bytes.data());
    if (swap_) std::reverse(bytes.data(), bytes.data() + type.bytes);
    at_ += type.bytes;
    return type.read(bytes.data());
  }

  const std::string& text_;
  std::size_t at_;
  const fs::path& file_;
  bool ascii_;
  bool swap_ = false;
};

std::uint32_t index_of(double value, const fs::path& file) {
  if (value < 0 || value != std::floor(value) || value >= static_cast<double>(kMostPoints))
    reject(file, fmt::format("{} is no index of a vertex, row or column", value));
  return static_cast<std::uint32_t>(value);
}

/// Reads one item of an element into the mesh; lists but those of faces are skipped.
void read_item(PlyBody& body, const Element& element, MeshFile& mesh, const fs::path& file) {
  const bool is_side = element.name == "side";
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();
  bool has_uv = false;
  std::array<int, 2> lattice{};
  std::array<std::uint32_t, 2> ends{};
  for (const Property& property : element.properties) {
    const std::string& name = property.name;
    if (property.count_type != nullptr) {
      if (is_side) reject(file, "a side holds a list");
      const bool is_face = element.name == "face" && name.starts_with("vertex_ind");
      std::vector<MeshCorner> corners;
      for (std::size_t left = body.next_count(*property.count_type); left > 0; --left) {
        const double value = body.next(*property.type);
        if (!is_face) continue;
        const std::uint32_t index = index_of(value, file);
        corners.push_back({index, index});
      }
      if (is_face) add_face(mesh, corners, file);
      continue;
    }
    const double value = body.next(*property.type);
    if (name.size() == 1 && name >= "x" && name <= "z") point[name[0] - 'x'] = value;
    if (is_side && name == "from") ends[0] = index_of(value, file);
    if (is_side && name == "to") ends[1] = index_of(value, file);
    if (element.name != "vertex") continue;
    if (name == "row") lattice[0] = static_cast<int>(index_of(value, file));
    if (name == "col") lattice[1] = static_cast<int>(index_of(value, file));
    for (const auto& [u, v] : {std::pair{"s", "t"}, {"u", "v"}, {"texture_u", "texture_v"}}) {
      if (name == u) uv.x() = value;
      if (name == v) uv.y() = value;
      has_uv = has_uv || name == u || name == v;
    }
  }
  body.end_item();
  if (is_side) mesh.sides.push_back({ends, point});
  if (element.name != "vertex") return;
  mesh.points.push_back(point);
  if (has_uv) mesh.uvs.push_back(uv);
  if (element.has("row") && element.has("col")) mesh.lattice.push_back(lattice);
}

MeshFile read_ply(const fs::path& file) {
  const std::string text = read_text(file);
  const PlyHead head = read_head(text, file);
  PlyBody body(text, head, file);
  MeshFile mesh;
  for (const Element& element : head.elements) {
    body.check_count(element);
    for (std::size_t i = 0; i < element.count; ++i) read_item(body, element, mesh, file);
  }
  return mesh;
}

// ---- OBJ ----

/// Parses "7", "7/3", "7/3/1" or "7//1"; negative numbers count from the end.
MeshCorner corner_of(const std::string& word, const MeshFile& mesh, const fs::path& file,
                     int line) {
  const auto resolve = [&](const std::string& text, std::size_t count) {
    const double index = number_of(text, file, line);
    const double resolved = index < 0 ? static_cast<double>(count) + index : index - 1;
    if (resolved < 0 || resolved >= static_cast<double>(count) || index != std::floor(index))
      reject(file, fmt::format("a face names vertex {}, there are {}", text.substr(0, 40), count),
             line);
    return static_cast<std::uint32_t>(resolved);
  };
  const std::size_t cut = word.find('/');
  MeshCorner corner{resolve(word.substr(0, cut), mesh.points.size()), 0};
  if (mesh.uvs.empty()) return corner;
  const std::size_t second = cut == std::string::npos ? cut : word.find('/', cut + 1);
  const std::string uv = cut == std::string::npos ? "" : word.substr(cut + 1, second - cut - 1);
  if (uv.empty())
    reject(file, "a face without texture coordinates among faces that have them", line);
  corner.uv = resolve(uv, mesh.uvs.size());
  return corner;
}

MeshFile read_obj(const fs::path& file) {
  std::istringstream text(read_text(file));
  MeshFile mesh;
  std::string line;
  for (int number = 1; std::getline(text, line); ++number) {
    std::istringstream words(line);
    std::vector<std::string> parts;
    for (std::string word; words >> word;) parts.push_back(word);
    if (parts.empty()) continue;
    const auto value = [&](std::size_t i) {
      if (i >= parts.size()) reject(file, "a vertex with too few numbers", number);
      return number_of(parts[i], file, number);
    };
    if (mesh.points.size() == kMostPoints || mesh.uvs.size() == kMostPoints)
      reject(file, fmt::format("more than {} vertices", kMostPoints), number);
    if (parts[0] == "v") mesh.points.emplace_back(value(1), value(2), value(3));
    if (parts[0] == "vt") mesh.uvs.emplace_back(value(1), value(2));
    if (parts[0] != "f") continue;
    std::vector<MeshCorner> corners;
    for (std::size_t i = 1; i < parts.size(); ++i)
      corners.push_back(corner_of(parts[i], mesh, file, number));
    add_face(mesh, corners, file);
  }
  return mesh;
}

}  // namespace

MeshFile read_mesh_file(const fs::path& file, bool may_be_empty) {
  const std::string end = in_small_letters(file.extension().string());
  if (end != ".ply" && end != ".obj") reject(file, "a mesh is read from .ply or .obj only");
  MeshFile mesh = end == ".ply" ? read_ply(file) : read_obj(file);
  if (mesh.points.empty() && !may_be_empty) reject(file, "the mesh has no vertex");
  check_indices(mesh, file);
  drop_repeated(mesh);
  return mesh;
}

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
