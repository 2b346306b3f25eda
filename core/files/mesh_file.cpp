// SPDX-License-Identifier: Apache-2.0
#include "core/files/mesh_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

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
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
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

struct Property {
  std::string name;
  std::string type;
  std::string count_type;  ///< type of a list's count; empty for a scalar property
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;

  [[nodiscard]] bool has(const char* property_name) const {
    return std::any_of(properties.begin(), properties.end(),
                       [&](const Property& property) { return property.name == property_name; });
  }
};

struct PlyHead {
  std::string format;
  std::vector<Element> elements;
  std::size_t body = 0;  ///< offset of the first byte of data
  int lines = 0;
};

void require_type(const std::string& type, const fs::path& file) {
  for (const char* name :
       {"char", "uchar", "int8", "uint8", "short", "ushort", "int16", "uint16", "int", "uint",
        "int32", "uint32", "float", "float32", "double", "float64"})
    if (type == name) return;
  reject(file, fmt::format("PLY has no type `{}`", type));
}

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
    if (word == "format") words >> head.format;
    if (word == "element") {
      Element element;
      words >> element.name >> element.count;
      if (!words) reject(file, "an element without a count", head.lines);
      head.elements.push_back(element);
    }
    if (word != "property") continue;
    if (head.elements.empty()) reject(file, "a property before any element", head.lines);
    Property property;
    words >> property.type;
    if (property.type == "list") words >> property.count_type >> property.type;
    words >> property.name;
    require_type(property.type, file);
    if (!property.count_type.empty()) require_type(property.count_type, file);
    head.elements.back().properties.push_back(property);
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

  double next(const std::string& type) {
    const double value = ascii_ ? next_word() : next_bytes(type);
    if (!std::isfinite(value)) reject(file_, "the mesh holds a value that is not finite");
    return value;
  }

  /// Reads a count of items that take at least one byte each.
  std::size_t next_count(const std::string& type) {
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
    const auto line = [&] {
      return static_cast<int>(std::count(text_.data(), text_.data() + begin, '\n')) + 1;
    };
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc() && end == word.data() + word.size()) return value;
    return number_of(word, file_, line());  // signed, or not a number
  }

  template <class T>
  double as() {
    if (at_ + sizeof(T) > text_.size()) reject(file_, "the PLY file ends before its data");
    std::array<char, sizeof(T)> bytes{};
    std::memcpy(bytes.data(), text_.data() + at_, sizeof(T));
    if (swap_) std::reverse(bytes.begin(), bytes.end());
    at_ += sizeof(T);
    T value{};
    std::memcpy(&value, bytes.data(), sizeof(T));
    return static_cast<double>(value);
  }

  double next_bytes(const std::string& type) {
    if (type == "float" || type == "float32") return as<float>();
    if (type == "double" || type == "float64") return as<double>();
    if (type == "char" || type == "int8") return as<std::int8_t>();
    if (type == "uchar" || type == "uint8") return as<std::uint8_t>();
    if (type == "short" || type == "int16") return as<std::int16_t>();
    if (type == "ushort" || type == "uint16") return as<std::uint16_t>();
    if (type == "int" || type == "int32") return as<std::int32_t>();
    return as<std::uint32_t>();
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

void read_vertex(PlyBody& body, const Element& element, MeshFile& mesh, const fs::path& file) {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();
  bool has_uv = false;
  std::array<int, 2> lattice{};
  for (const Property& property : element.properties) {
    if (!property.count_type.empty()) {
      for (std::size_t left = body.next_count(property.count_type); left > 0; --left)
        body.next(property.type);
      continue;
    }
    const double value = body.next(property.type);
    if (property.name == "x") point.x() = value;
    if (property.name == "y") point.y() = value;
    if (property.name == "z") point.z() = value;
    if (property.name == "row") lattice[0] = static_cast<int>(index_of(value, file));
    if (property.name == "col") lattice[1] = static_cast<int>(index_of(value, file));
    for (const auto& [u, v] : {std::pair{"s", "t"}, {"u", "v"}, {"texture_u", "texture_v"}}) {
      if (property.name == u) uv.x() = value;
      if (property.name == v) uv.y() = value;
      has_uv = has_uv || property.name == u || property.name == v;
    }
  }
  mesh.points.push_back(point);
  if (has_uv) mesh.uvs.push_back(uv);
  if (element.has("row") && element.has("col")) mesh.lattice.push_back(lattice);
}

void read_side(PlyBody& body, const Element& element, MeshFile& mesh, const fs::path& file) {
  MeshSide side;
  for (const Property& property : element.properties) {
    if (!property.count_type.empty()) reject(file, "a side holds a list");
    const double value = body.next(property.type);
    if (property.name == "from") side.ends[0] = index_of(value, file);
    if (property.name == "to") side.ends[1] = index_of(value, file);
    for (int axis = 0; axis < 3; ++axis)
      if (property.name == std::string(1, "xyz"[axis])) side.slope[axis] = value;
  }
  mesh.sides.push_back(side);
}

void read_other(PlyBody& body, const Element& element, MeshFile& mesh, const fs::path& file) {
  for (const Property& property : element.properties) {
    if (property.count_type.empty()) {
      body.next(property.type);
      continue;
    }
    const bool is_face = element.name == "face" && property.name.starts_with("vertex_ind");
    std::vector<MeshCorner> corners;
    for (std::size_t left = body.next_count(property.count_type); left > 0; --left) {
      const double value = body.next(property.type);
      if (!is_face) continue;
      const std::uint32_t index = index_of(value, file);
      corners.push_back({index, index});
    }
    if (is_face) add_face(mesh, corners, file);
  }
}

MeshFile read_ply(const fs::path& file) {
  const std::string text = read_text(file);
  const PlyHead head = read_head(text, file);
  PlyBody body(text, head, file);
  MeshFile mesh;
  for (const Element& element : head.elements) {
    body.check_count(element);
    for (std::size_t i = 0; i < element.count; ++i) {
      if (element.name == "vertex") {
        read_vertex(body, element, mesh, file);
      } else if (element.name == "side") {
        read_side(body, element, mesh, file);
      } else {
        read_other(body, element, mesh, file);
      }
    }
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
  std::string end = file.extension().string();
  std::transform(end.begin(), end.end(), end.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (end != ".ply" && end != ".obj") reject(file, "a mesh is read from .ply or .obj only");
  MeshFile mesh = end == ".ply" ? read_ply(file) : read_obj(file);
  if (mesh.points.empty() && !may_be_empty) reject(file, "the mesh has no vertex");
  check_indices(mesh, file);
  drop_repeated(mesh);
  return mesh;
}

}  // namespace drape
