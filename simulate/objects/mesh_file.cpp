// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <sstream>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/objects/triangle_mesh.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr int kMostCorners = 5000000;

struct Polygons {
  std::vector<Vector3d> corners;  ///< metres
  std::vector<std::vector<int>> faces;
};

[[noreturn]] void refuse(const std::filesystem::path& file, int line, const std::string& what) {
  Where where{.file = file.string()};
  if (line > 0) where.line = line;
  throw bad_input(what, where, "export the object as a closed mesh in PLY or OBJ, in mm");
}

Polygons read_obj(const std::filesystem::path& file) {
  Polygons mesh;
  std::istringstream lines(read_text(file));
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      Vector3d p;
      if (!(words >> p.x() >> p.y() >> p.z())) refuse(file, number, "a corner needs three numbers");
      mesh.corners.push_back(p * units::mm);
    } else if (kind == "f") {
      std::vector<int> face;
      std::string word;
      while (words >> word) {
        // corner, corner/texture or corner/texture/normal; negative counts from the end.
        const int index = std::atoi(word.c_str());
        face.push_back(index > 0 ? index - 1 : static_cast<int>(mesh.corners.size()) + index);
      }
      mesh.faces.push_back(face);
    }
  }
  return mesh;
}

/// Reads numbers of a PLY body, one property at a time, from text or little-endian bytes.
class PlyBody {
 public:
  PlyBody(const std::filesystem::path& file, std::string text, bool binary)
      : file_(file), text_(std::move(text)), binary_(binary), words_(binary ? "" : text_) {}

  double number(const std::string& type) {
    if (!binary_) {
      double value = 0;
      if (!(words_ >> value)) refuse(file_, 0, "the file ends within its data");
      return value;
    }
    if (type == "float" || type == "float32") return take<float>();
    if (type == "double" || type == "float64") return take<double>();
    if (type == "uchar" || type == "uint8") return take<unsigned char>();
    if (type == "char" || type == "int8") return take<signed char>();
    if (type == "ushort" || type == "uint16") return take<unsigned short>();
    if (type == "short" || type == "int16") return take<short>();
    if (type == "uint" || type == "uint32") return take<unsigned>();
    if (type == "int" || type == "int32") return take<int>();
    refuse(file_, 0, fmt::format("the type `{}` is not a PLY type", type));
  }

 private:
  template <class Value>
  double take() {
    Value value{};
    if (next_ + sizeof value > text_.size()) refuse(file_, 0, "the file ends within its data");
    std::memcpy(&value, text_.data() + next_, sizeof value);
    next_ += sizeof value;
    return static_cast<double>(value);
  }

  std::filesystem::path file_;
  std::string text_;
  bool binary_;
  std::istringstream words_;
  std::size_t next_ = 0;
};

struct PlyElement {
  std::string name;
  int count = 0;
  struct Property {
    std::string name, type, count_type;  ///< count_type empty: a single number
  };
  std::vector<Property> properties;
};

Polygons read_ply(const std::filesystem::path& file) {
  const std::string text = read_text(file);
  const std::size_t end = text.find("end_header");
  if (!text.starts_with("ply") || end == std::string::npos) refuse(file, 1, "this is no PLY file");
  std::istringstream header(text.substr(0, end));
  std::vector<PlyElement> elements;
  bool binary = false;
  std::string line;
  for (int number = 1; std::getline(header, line); ++number) {
    std::istringstream words(line);
    std::string first;
    std::string second;
    words >> first >> second;
    if (first == "format") {
      if (second == "binary_big_endian") refuse(file, number, "big-endian PLY is not read");
      binary = second == "binary_little_endian";
    } else if (first == "element") {
      elements.push_back({second, 0, {}});
      if (!(words >> elements.back().count) || elements.back().count < 0 ||
          elements.back().count > kMostCorners)
        refuse(file, number, "an element needs a count");
    } else if (first == "property") {
      if (elements.empty()) refuse(file, number, "a property stands before any element");
      PlyElement::Property property;
      property.type = second;
      if (second == "list") words >> property.count_type >> property.type;
      words >> property.name;
      elements.back().properties.push_back(property);
    }
  }
  const std::size_t body_start = text.find('\n', end);
  if (body_start == std::string::npos) refuse(file, 0, "the file ends after its header");
  PlyBody body(file, text.substr(body_start + 1), binary);
  Polygons mesh;
  for (const PlyElement& element : elements) {
    for (int i = 0; i < element.count; ++i) {
      Vector3d p = Vector3d::Zero();
      for (const PlyElement::Property& property : element.properties) {
        if (property.count_type.empty()) {
          const double value = body.number(property.type);
          if (property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z')
            p[property.name[0] - 'x'] = value;
          continue;
        }
        const double count = body.number(property.count_type);
        if (!(count >= 0 && count < 1000)) refuse(file, 0, "a face has no sensible corner count");
        std::vector<int> list;
        for (int k = 0; k < count; ++k)
          list.push_back(static_cast<int>(body.number(property.type)));
        if (element.name == "face") mesh.faces.push_back(list);
      }
      if (element.name == "vertex") mesh.corners.emplace_back(p * units::mm);
    }
  }
  return mesh;
}

}  // namespace

TriangleMesh TriangleMesh::read(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (ending != ".ply" && ending != ".obj") refuse(file, 0, "only PLY and OBJ meshes are read");
  const Polygons polygons = ending == ".ply" ? read_ply(file) : read_obj(file);
  const auto earlier = [](const Vector3d& a, const Vector3d& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  };
  std::map<Vector3d, int, decltype(earlier)> known(earlier);
  std::vector<Vector3d> corners;
  std::vector<int> joined;
  for (const Vector3d& corner : polygons.corners) {
    if (!corner.allFinite()) refuse(file, 0, "a corner is not finite");
    const auto [at, fresh] = known.emplace(corner, static_cast<int>(corners.size()));
    if (fresh) corners.push_back(corner);
    joined.push_back(at->second);
  }
  std::vector<Triangle> triangles;
  for (const std::vector<int>& face : polygons.faces) {
    for (const int corner : face) {
      if (corner < 0 || corner >= static_cast<int>(joined.size()))
        refuse(file, 0, fmt::format("a face names corner {}, which the file lacks", corner));
    }
    for (std::size_t k = 2; k < face.size(); ++k)
      triangles.push_back({joined[face[0]], joined[face[k - 1]], joined[face[k]]});
  }
  return {std::move(corners), std::move(triangles), file};
}

}  // namespace drape::simulate
