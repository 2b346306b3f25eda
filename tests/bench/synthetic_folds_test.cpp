// SPDX-License-Identifier: Apache-2.0
// Cloths in folds in front of three cameras: rendered, detected, labelled, triangulated, with every
// label compared with the renderer's.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "core/units.hpp"
#include "detect/detect.hpp"
#include "detect/image/image.hpp"
#include "detect/labels/labels.hpp"
#include "detect/tags/tags.hpp"
#include "synth/render/render.hpp"
#include "synth/synth.hpp"
#include "synth/test_cameras.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::test {
namespace {

using namespace detect;
using namespace triangulate;
using units::deg;
using units::mm;

constexpr double wrong_px = 4;      // distance from the dot's true centroid: another dot, or no dot
constexpr double wrong_m = 3 * mm;  // distance at which a measured mark is wrong

/// Counts of marks found and of marks that could be found.
struct Tally {
  int scenes = 0;
  int visible = 0;       ///< dots in a view that are whole and face it within 60 degrees
  int labelled = 0;      ///< visible dots with a label
  int labels = 0;        ///< all labels of single views
  int wrong_labels = 0;  ///< labels that are wrong
  int measurable = 0;    ///< marks visible in two or more views
  int measured = 0;      ///< measurable marks in the sheet
  int marks = 0;         ///< all marks of the sheets
  int wrong_marks = 0;   ///< marks of the sheets that are wrong
  int islands = 0, merged = 0;

  void add(const Tally& o) {
    scenes += o.scenes, visible += o.visible, labelled += o.labelled, labels += o.labels;
    wrong_labels += o.wrong_labels, measurable += o.measurable, measured += o.measured;
    marks += o.marks, wrong_marks += o.wrong_marks, islands += o.islands, merged += o.merged;
  }
  [[nodiscard]] double view_recall() const { return labelled / double(visible); }
  [[nodiscard]] double recall() const { return measured / double(measurable); }
  [[nodiscard]] double wrong_fraction() const { return wrong_labels / double(labels); }
  void print(const std::string& name) const {
    fmt::print(
        "{}: {} scenes; single views: {} of {} visible dots labelled ({:.4f}), {} of {} labels "
        "wrong ({:.1e}); three views: {} of {} marks measured ({:.4f}), {} of {} wrong; {} of {} "
        "islands merged\n",
        name, scenes, labelled, visible, view_recall(), wrong_labels, labels, wrong_fraction(),
        measured, measurable, recall(), wrong_marks, marks, merged, islands);
  }
};

struct Rigged {
  Print print = read_print(source_root() / "rigs/bench1/print.toml");
  PrintPlane plane = plane_of(print);
  std::vector<Camera> cameras = three_synthetic_cameras(40);
  std::vector<synth::PixelRays> rays;
  Calibration calibration;
  TagFinder finder{print.tag_family};

  Rigged() {
    for (const Camera& camera : cameras) {
      rays.emplace_back(camera.model);
      CalibratedCamera calibrated;
      calibrated.camera = camera;
      calibration.cameras.push_back(calibrated);
    }
  }
};

synth::Folds folds_of(int scene, double slope_deg) {
  const auto any = [&](std::uint64_t k) { return synth::uniform(77 + scene, k); };
  synth::Folds folds;
  folds.slope_rad = slope_deg * deg;
  folds.wavelength_m = 100 * mm;
  folds.phase_rad = 2 * std::numbers::pi * any(1);
  folds.direction_rad = std::numbers::pi * any(2);
  folds.yaw_rad = 2 * std::numbers::pi * any(3);
  return folds;
}

Detections detected(Rigged& rig, const std::vector<const synth::SceneView*>& views, int scene) {
  Detections detections;
  detections.rig = "synthetic";
  const Print& print = rig.print;
  detections.lattice = {Surface::cloth,       print.rows,    print.cols,     print.pitch_m,
                        print.dot_diameter_m, print.patch_m, print.margin_m, {}};
  synth::RenderOptions options;
  options.seed = static_cast<std::uint64_t>(scene) + 1;
  for (std::size_t k = 0; k < views.size(); ++k) {
    const auto picture = synth::expose(views[k]->light(options), 1600, 1200, k, options);
    const GreyImage image{1600, 1200, picture.bytes, {}};
    detections.frames.push_back(detect_frame(image, rig.plane, rig.finder, {}));
    detections.frames.back().set = "folds";
    detections.frames.back().camera = rig.cameras[k].name;
  }
  return detections;
}

const synth::TrueMark& of(const std::vector<synth::TrueMark>& truth, MarkId mark, int cols) {
  return truth[static_cast<std::size_t>(mark.row) * cols + mark.col];
}

void count_labels(const Detections& detections, const std::vector<synth::TrueMark>& truth,
                  Tally& tally) {
  for (std::size_t k = 0; k < detections.frames.size(); ++k) {
    std::vector<char> found(truth.size(), 0);
    for (const Detection& d : detections.frames[k].detections) {
      const auto& view = of(truth, d.mark, detections.lattice.cols).views[k];
      const bool right = view.centroid_px && (d.centre_px - *view.centroid_px).norm() < wrong_px;
      ++tally.labels;
      tally.wrong_labels += !right;
      if (right) found[d.mark.row * detections.lattice.cols + d.mark.col] = 1;
    }
    for (std::size_t i = 0; i < truth.size(); ++i) {
      if (!truth[i].views[k].is_whole() || truth[i].views[k].facing_rad > 60 * deg) continue;
      ++tally.visible;
      tally.labelled += found[i];
    }
  }
}

void count_marks(const Sheet& sheet, const std::vector<synth::TrueMark>& truth, Tally& tally) {
  for (const synth::TrueMark& mark : truth) {
    int views = 0;
    for (const auto& view : mark.views) views += view.is_whole() && view.facing_rad <= 60 * deg;
    const SheetMark* found = sheet.find(mark.mark);
    if (found != nullptr) {
      ++tally.marks;
      tally.wrong_marks += (found->point_in_world - mark.point_in_world).norm() > wrong_m;
    }
    if (views < 2) continue;
    ++tally.measurable;
    tally.measured += found != nullptr;
  }
}

Tally run_scene(Rigged& rig, int scene, double slope_deg) {
  const synth::SyntheticScene drape{synth::folded(rig.print, folds_of(scene, slope_deg)),
                                    synth::FacePattern(face_of(rig.print)),
                                    synth::table_triangles(-60 * mm)};
  std::vector<std::unique_ptr<synth::SceneView>> owned;
  std::vector<const synth::SceneView*> views;
  for (std::size_t k = 0; k < rig.cameras.size(); ++k) {
    owned.push_back(std::make_unique<synth::SceneView>(drape, rig.cameras[k], rig.rays[k]));
    views.push_back(owned.back().get());
  }
  const auto truth = synth::truth_of(drape, synth::marks_of(rig.print), views);
  const Detections detections = detected(rig, views, scene);
  const TriangulateResult result =
      triangulate::triangulate(detections, rig.calibration, "folds", TriangulateOptions{});
  Tally tally;
  tally.scenes = 1;
  tally.islands = result.report.islands;
  tally.merged = result.report.merged_islands;
  count_labels(detections, truth, tally);
  count_marks(result.sheet, truth, tally);
  return tally;
}

TEST(SyntheticFolds, EveryMarkThatTwoViewsSeeIsMeasuredAndNoneWrongly) {
  Rigged rig;
  const int each = trial_count(2, 100);
  Tally all;
  for (const double slope_deg : {45.0, 60.0}) {
    Tally tally;
    for (int scene = 0; scene < each; ++scene) tally.add(run_scene(rig, scene, slope_deg));
    tally.print(fmt::format("{:g} degrees", slope_deg));
    all.add(tally);
  }
  all.print("all");
  EXPECT_EQ(all.wrong_marks, 0);
  EXPECT_GE(all.recall(), 0.95);
  EXPECT_LE(all.wrong_fraction(), 1e-3);
}

}  // namespace
}  // namespace drape::test
