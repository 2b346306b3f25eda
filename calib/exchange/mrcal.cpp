// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstdlib>
#include <map>

#include "calib/exchange/formats.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"

namespace drape::calib {
namespace {

namespace fs = std::filesystem;

[[nodiscard]] Error refused(const fs::path& file, const std::string& field,
                            const std::string& what) {
  return bad_input(what, {.file = file.string(), .field = field},
                   "write the model again with mrcal, as LENSMODEL_PINHOLE, _OPENCV4 or _OPENCV5");
}

/// Parses a model: a Python dictionary of names, strings and flat lists of numbers; nested values
/// are kept as text and ignored.
std::map<std::string, std::string> dictionary(const fs::path& file) {
  std::string text;
  bool comment = false;
  for (const char c : read_text(file)) {
    comment = c == '#' || (comment && c != '\n');
    if (!comment) text += c;
  }
  std::map<std::string, std::string> entries;
  std::size_t at = text.find('{');
  if (at == std::string::npos) throw refused(file, "", "this is no camera model of mrcal");
  while ((at = text.find('\'', at + 1)) != std::string::npos) {
    const std::size_t end = text.find('\'', at + 1);
    const std::size_t colon = end == std::string::npos ? end : text.find(':', end);
    if (colon == std::string::npos) break;
    const std::size_t value = text.find_first_not_of(" \t\r\n", colon + 1);
    if (value == std::string::npos) break;
    const char closing = text[value] == '[' ? ']' : text[value] == '\'' ? '\'' : ',';
    std::size_t stop = text.find(closing, value + 1);
    if (stop == std::string::npos) stop = text.size() - 1;
    entries[text.substr(at + 1, end - at - 1)] = closing == ','
                                                     ? text.substr(value, stop - value)
                                                     : text.substr(value + 1, stop - value - 1);
    at = stop;
  }
  return entries;
}

std::vector<double> numbers(const std::string& list) {
  std::vector<double> values;
  const char* at = list.c_str();
  for (;;) {
    char* end = nullptr;
    const double value = std::strtod(at, &end);
    if (end == at) return values;
    values.push_back(value);
    at = *end == ',' ? end + 1 : end;
  }
}

class Model {
 public:
  explicit Model(const fs::path& file) : file_(file), entries_(dictionary(file)) {}

  [[nodiscard]] bool has(const std::string& key) const { return entries_.contains(key); }
  [[nodiscard]] std::string text(const std::string& key) const {
    if (!has(key)) throw refused(file_, key, "the model lacks this entry");
    return entries_.at(key);
  }
  [[nodiscard]] std::vector<double> list(const std::string& key, std::size_t count) const {
    auto values = numbers(text(key));
    if (values.size() != count) {
      throw refused(file_, key, fmt::format("{} numbers where {} belong", values.size(), count));
    }
    return values;
  }

 private:
  fs::path file_;
  std::map<std::string, std::string> entries_;
};

std::size_t distortions_of(const std::string& lens, const fs::path& file) {
  if (lens == "LENSMODEL_PINHOLE") return 0;
  if (lens == "LENSMODEL_OPENCV4") return 4;
  if (lens == "LENSMODEL_OPENCV5") return 5;
  throw refused(file, "lensmodel",
                fmt::format("the lens model `{}` does not fit Brown's five terms", lens));
}

}  // namespace

std::vector<ExportedFile> mrcal_files(const std::vector<BrownCamera>& cameras) {
  std::vector<ExportedFile> files;
  for (const BrownCamera& camera : cameras) {
    const BrownLens& lens = camera.lens;
    const Eigen::Vector3d r = rotation_vector(camera.cam_from_world.rotation);
    const Eigen::Vector3d& t = camera.cam_from_world.translation_m;
    files.push_back({camera.name + ".cameramodel",
                     fmt::format("# written by drapebench; pose: camera from world, rad and m\n{{\n"
                                 "    'lensmodel':  'LENSMODEL_OPENCV5',\n"
                                 "    'intrinsics': [ {}, {}, {}, {}, {}, {}, {}, {}, {} ],\n"
                                 "    'extrinsics': [ {}, {}, {}, {}, {}, {} ],\n"
                                 "    'imagersize': [ {}, {} ]\n}}\n",
                                 lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, lens.k1, lens.k2,
                                 lens.p1, lens.p2, lens.k3, r.x(), r.y(), r.z(), t.x(), t.y(),
                                 t.z(), camera.width_px, camera.height_px)});
  }
  return files;
}

Camera camera_of_mrcal(const fs::path& file) {
  const Model model(file);
  const std::size_t distortions = distortions_of(model.text("lensmodel"), file);
  std::vector<double> v = model.list("intrinsics", 4 + distortions);
  v.resize(9, 0);
  Camera camera;
  camera.model.lens = BrownLens{v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8]};
  const auto size = model.list("imagersize", 2);
  camera.model.width_px = static_cast<int>(size[0]);
  camera.model.height_px = static_cast<int>(size[1]);
  // Newer versions name the pose rt_cam_ref.
  const auto pose = model.list(model.has("rt_cam_ref") ? "rt_cam_ref" : "extrinsics", 6);
  camera.cam_from_world.rotation = rotation_about({pose[0], pose[1], pose[2]});
  camera.cam_from_world.translation_m = {pose[3], pose[4], pose[5]};
  return camera;
}

}  // namespace drape::calib
