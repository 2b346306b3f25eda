// SPDX-License-Identifier: Apache-2.0
#include "core/detections.hpp"

#include <fmt/format.h>

#include <set>

#include "core/units.hpp"

namespace drape {
using units::deg;
using units::mm;

void fields(Fields& f, Detection& d) {
  f({"row", "along the warp, or along y of a target"}, d.mark.row);
  f({"col", "along the weft, or along x of a target"}, d.mark.col);
  f({"px", "centre (u, v)"}, d.centre_px);
  f({"cov_px2", "covariance of px"}, d.covariance_px2);
  f({"semi_axes_px", "major and minor semi-axis; half the window for a corner"}, d.semi_axes_px);
  f({"axis_angle_deg", "angle from +u to the major axis", deg}, d.axis_angle_rad);
  f({"contrast", "difference of grey level between print and cloth"}, d.contrast);
  f({"chi2_per_dof", "misfit in units of the frame's noise"}, d.chi2_per_dof);
}

void fields(Fields& f, IslandDot& d) {
  fields(f, d.dot);
  f({"island", "number of the part within its frame"}, d.island);
}

void fields(Fields& f, Rejection& r) {
  std::optional<int> row, col;
  if (r.mark) row = r.mark->row, col = r.mark->col;
  f({"row", "row of the mark, if known"}, row);
  f({"col", "column of the mark, if known"}, col);
  f({"px", "centre (u, v)"}, r.centre_px);
  f({"reason", "reason why it was not used"}, r.reason);
  f.rule(!row || col, "col", "`col` is missing", make_again);
  if (row) r.mark = MarkId{*row, col.value_or(0)};
}

void fields(Fields& f, TagDetection& tag) {
  f({"id", "id of the tag within its family"}, tag.id);
  Eigen::Matrix<double, 4, 2> corners_px = tag.corners_px.transpose();
  f({"corners_px", "corners (u, v) in printed order"}, corners_px);
  tag.corners_px = corners_px.transpose();
}

void fields(Fields& f, MarkLattice& lattice) {
  f({"surface", "surface that carries the marks"}, lattice.surface);
  f({"rows", "marks along the warp, or along y"}, lattice.rows);
  f({"cols", "marks along the weft, or along x"}, lattice.cols);
  f.rule(is_lattice_size(lattice.rows, lattice.cols), "rows",
         fmt::format("a lattice has 1 to {} marks", kMostMarks), make_again);
  f({"pitch_mm", "distance between adjacent marks", mm}, lattice.pitch_m);
  f({"dot_diameter_mm", "diameter of a dot", mm}, lattice.dot_diameter_m);
  f({"patch_mm", "size of the cloth along (warp, weft); 0 of a target", mm}, lattice.patch_m);
  f({"margin_mm", "material coordinates of mark (0, 0)", mm}, lattice.margin_m);
  f({"sha256", "SHA-256 of print.toml or target.toml"}, lattice.sha256);
}

void fields(Fields& f, FrameDetections& frame) {
  f(Field{"set", "frame set"}.plain_name(), frame.set);
  f(Field{"camera", "name of the camera"}.plain_name(), frame.camera);
  f({"width_px", "columns of the picture"}, frame.width_px);
  f({"height_px", "rows of the picture"}, frame.height_px);
  f({"image_sha256", "SHA-256 of the picture"}, frame.image_sha256);
  f({"preview_file", "small JPEG beside this file"}, frame.preview_file);
  f({"preview_scale", "preview pixels per pixel of the picture"}, frame.preview_scale);
  f({"noise_sigma_grey", "standard deviation of the picture's noise in grey levels"},
    frame.noise_sigma);
  f({"detections", "labelled marks, ordered by mark"}, frame.detections);
  f.if_any({"islands", "measured dots in parts of the lattice that could not be labelled"},
           frame.islands);
  f({"rejections", "mark candidates that were not used"}, frame.rejections);
  f({"tags", "tags read, ordered by id"}, frame.tags);
}

namespace {

/// A set whose detection ended in NO-GO.
struct RefusedSet {
  std::string set, reason;
};

void fields(Fields& f, RefusedSet& refused) {
  f(Field{"set", "frame set"}.plain_name(), refused.set);
  f({"reason", "reason why measurements with it cannot be trusted"}, refused.reason);
}

}  // namespace

void fields(Fields& f, Detections& detections) {
  f({"rig", "name of the bench"}, detections.rig);
  f({"lattice", "lattice of the marks"}, detections.lattice);
  f({"frames", "pictures, ordered by set, then camera"}, detections.frames);
  std::vector<RefusedSet> refused;
  for (const auto& [set, reason] : detections.no_go) refused.push_back({set, reason});
  f.if_any({"no_go", "sets whose detection is NO-GO"}, refused);
  if (!f.reads()) return;
  std::set<std::string> sets;
  for (std::size_t i = 0; i < detections.frames.size(); ++i) {
    const FrameDetections& frame = detections.frames[i];
    sets.insert(frame.set);
    for (std::size_t k = 0; k < frame.detections.size(); ++k) {
      const auto [row, col] = frame.detections[k].mark;
      if (row >= 0 && col >= 0 && row < detections.lattice.rows && col < detections.lattice.cols)
        continue;
      f.rule(false, fmt::format("frames.{}.detections.{}.row", i, k),
             fmt::format("mark ({}, {}) is outside the lattice", row, col), make_again);
    }
  }
  for (std::size_t i = 0; i < refused.size(); ++i) {
    f.rule(sets.contains(refused[i].set), fmt::format("no_go.{}.set", i),
           fmt::format("no frame is of the set `{}`", refused[i].set), make_again);
    detections.no_go.emplace(refused[i].set, refused[i].reason);
  }
}

std::optional<std::string> Detections::reason_against(const std::vector<std::string>& sets) const {
  for (const std::string& set : sets) {
    if (const auto found = no_go.find(set); found != no_go.end())
      return fmt::format("the detection of set {} is NO-GO: {}", set, found->second);
  }
  return std::nullopt;
}

Detections read_detections(const std::filesystem::path& file) {
  return read_record<Detections>(file);
}

void write_detections(const std::filesystem::path& file, const Detections& detections) {
  write_record(file, detections);
}

}  // namespace drape
