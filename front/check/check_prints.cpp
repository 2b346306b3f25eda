// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/program/similar.hpp"
#include "core/units.hpp"
#include "front/check/check.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using units::mm;

/// Room between a dot and the black square of a tag; below zero one covers the other, and NaN where
/// a value of the file is missing.
double room_m(const Vector2d& dot, double radius_m, const PrintedTag& tag, double edge_m) {
  if (!std::isfinite((dot - tag.centre_m).sum() + edge_m)) return std::nan("");
  const Vector2d beyond =
      ((dot - tag.centre_m).cwiseAbs() - Vector2d::Constant(0.5 * edge_m)).cwiseMax(0.0);
  return beyond.norm() - radius_m;
}

/// A tag that would be printed over a dot: its place or a size cannot be as typed.
template <class At>
void check_tag_places(const fs::path& file, const std::vector<PrintedTag>& tags, double edge_m,
                      double diameter_m, int rows, int cols, const At& at, const std::string& key,
                      BenchCheck& check) {
  for (std::size_t k = 0; k < tags.size(); ++k) {
    for (int row = 0; row < rows; ++row) {
      for (int col = 0; col < cols; ++col) {
        const double room = room_m(at({row, col}), 0.5 * diameter_m, tags[k], edge_m);
        if (!(room < 0)) continue;
        add(check, file, key,
            fmt::format("tag {}, {:g} mm wide, would be printed over dot ({}, {})", tags[k].id,
                        edge_m / mm, row, col),
            "correct the tag's place, tags.edge_mm, dot_diameter_mm or pitch_mm; all are in mm",
            key.starts_with("tags.tag.") ? k : 0);
        return;
      }
    }
  }
}

/// A family that detect does not know, or a tag that it does not have: nobody could find it.
void check_family(const fs::path& file, const std::string& family,
                  const std::vector<PrintedTag>& tags, const std::string& key, BenchCheck& check) {
  if (family.empty()) return;
  std::vector<std::string> known;
  for (const auto& [name, count] : known_tag_families()) {
    known.push_back(name);
    if (name != family) continue;
    for (std::size_t k = 0; k < tags.size(); ++k) {
      if (tags[k].id >= 0 && tags[k].id < count) continue;
      add(check, file, key, fmt::format("the family {} has no tag {}", family, tags[k].id),
          fmt::format("its ids are 0 to {}: give those that are printed there", count - 1),
          key.starts_with("tags.tag.") ? k : 0);
      return;
    }
    return;
  }
  std::string lower = family;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  add(check, file, "tags.family",
      fmt::format("the tag family `{}` is not known{}", family, did_you_mean(lower, known)),
      fmt::format("use one of {}; OpenCV's own dictionaries are not read", fmt::join(known, ", ")));
}

/// Nobody can say which of two tags of one id was seen. Their ids are typed in dot grids alone.
void check_tag_ids(const fs::path& file, const std::vector<PrintedTag>& tags, BenchCheck& check) {
  std::set<int> ids;
  for (std::size_t k = 0; k < tags.size(); ++k)
    if (!ids.insert(tags[k].id).second)
      add(check, file, "tags.tag.id", fmt::format("two tags have the id {}", tags[k].id),
          "give each tag the id that is printed there", k);
}

}  // namespace

std::vector<std::pair<std::string, int>> known_tag_families() {
  return {{"tag36h11", 587},
          {"tag36h10", 2320},
          {"tag25h9", 35},
          {"tag16h5", 30},
          {"tagStandard41h12", 2115}};
}

void check_target(const fs::path& file, const Target& target, BenchCheck& check) {
  const bool dots = target.kind == TargetKind::dot_grid;
  check_family(file, target.tag_family, target.tags, dots ? "tags.tag.id" : "tags.first_id", check);
  if (!dots) return;
  check_tag_ids(file, target.tags, check);
  check_tag_places(
      file, target.tags, target.tag_edge_m, target.dot_diameter_m, target.rows, target.cols,
      [&](MarkId dot) { return Vector2d(target.point_in_target(dot).head<2>()); },
      "tags.tag.centre_mm", check);
}

void check_print(const Print& print, BenchCheck& check) {
  check_family(print.file, print.tag_family, print.tags, "tags.first_id", check);
  check_tag_places(
      print.file, print.tags, print.tag_edge_m, print.dot_diameter_m, print.rows, print.cols,
      [&](MarkId dot) { return print.material_m(dot); }, "tags.edge_mm", check);
}

}  // namespace drape
