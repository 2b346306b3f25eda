// SPDX-License-Identifier: Apache-2.0
#include "detect/detect.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <opencv2/core.hpp>
#include <set>
#include <utility>

#include "core/files/files.hpp"
#include "core/parallel.hpp"
#include "core/rules.hpp"
#include "core/scene.hpp"
#include "core/statistics/sample.hpp"
#include "detect/image/image.hpp"
#include "detect/image/overlay.hpp"
#include "detect/labels/print_plane.hpp"
#include "detect/plausibility.hpp"
#include "detect/targets/board.hpp"
#include "detect/targets/chessboard.hpp"

namespace drape::detect {
namespace {

constexpr double preview_scale = 0.5;

struct Surroundings {
  std::filesystem::path file;  ///< target.toml or print.toml
  PrintPlane plane;
  MarkLattice lattice;
  std::optional<Target> board;  ///< set for a target with corners instead of dots
};

Surroundings read_surface(const Rig& rig, Surface surface) {
  Surroundings result;
  MarkLattice& lattice = result.lattice;
  lattice.surface = surface;
  result.file = surface == Surface::target ? rig.target_file : rig.print_file;
  if (surface == Surface::target) {
    const Target target = read_target(rig.target_file);
    result.plane = plane_of(target);
    if (target.kind != TargetKind::dot_grid) result.board = target;
  } else {
    const Print print = read_print(rig.print_file);
    result.plane = plane_of(print);
    lattice.patch_m = print.patch_m;
    lattice.margin_m = print.margin_m;
  }
  lattice.sha256 = sha256_of_file(result.file);
  lattice.rows = result.plane.rows;
  lattice.cols = result.plane.cols;
  lattice.pitch_m = result.plane.pitch_m;
  lattice.dot_diameter_m = 2 * result.plane.dot_radius_m;
  return result;
}

struct Job {
  const FrameSet* set = nullptr;
  const RecordedFrame* frame = nullptr;
  const RigCamera* camera = nullptr;
};

bool is_free_pose(const Rig& rig, const std::string& set) {
  return std::find(rig.free_poses.begin(), rig.free_poses.end(), set) != rig.free_poses.end();
}

/// Lists the pictures to process: sets as requested, cameras in the order of the rig. A missing
/// camera is an error, except in a free pose of the target, where calib reports it.
std::vector<Job> plan(const Recording& recording, const Rig& rig,
                      const std::vector<std::string>& sets) {
  std::vector<Job> jobs;
  for (const std::string& name : sets) {
    const FrameSet& set = recording.set(name);
    for (const RigCamera& camera : rig.cameras) {
      const auto frame =
          std::find_if(set.frames.begin(), set.frames.end(),
                       [&](const RecordedFrame& f) { return f.camera == camera.name; });
      if (frame == set.frames.end()) {
        if (is_free_pose(rig, name)) continue;
        throw bad_input("the recording has no image of this camera",
                        {.file = recording.folder.string(), .camera = camera.name, .set = name},
                        "add the image and import the recording again, or take the camera out of "
                        "the rig");
      }
      jobs.push_back({&set, &*frame, &camera});
    }
  }
  return jobs;
}

/// Counts pictures of cameras that the rig does not name; they are not used.
std::map<std::string, int> not_in_rig(const Recording& recording, const Rig& rig,
                                      const std::vector<std::string>& sets) {
  std::map<std::string, int> pictures;
  for (const std::string& name : sets)
    for (const RecordedFrame& frame : recording.set(name).frames) ++pictures[frame.camera];
  for (const RigCamera& camera : rig.cameras) pictures.erase(camera.name);
  return pictures;
}

struct Output {
  FrameDetections frame;
  PictureQuality quality;
  double blur_px = 0;  ///< Gaussian width of the dot edges
  std::optional<Picture> preview, overlay;
};

GreyImage image_of(const Recording& recording, const Job& job) {
  const std::vector<unsigned char> bytes = read_frame(recording, *job.set, *job.frame);
  return decode_image(bytes, job.camera->width_px, job.camera->height_px,
                      {.file = (recording.folder / job.frame->file).string(),
                       .camera = job.camera->name,
                       .set = job.set->name});
}

Output run_job(const Recording& recording, const Job& job, const Surroundings& surface,
               const DetectOptions& options) {
  const GreyImage image = image_of(recording, job);
  Output output;
  if (surface.board) {
    output.frame = detect_board(image, *surface.board);
  } else {
    TagFinder finder(surface.plane.tag_family);
    output.frame = detect_frame(image, surface.plane, finder, options.limits, &output.blur_px);
  }
  output.quality = quality_of(image);
  output.frame.set = job.set->name;
  output.frame.camera = job.camera->name;
  output.frame.image_sha256 = job.frame->sha256;
  const std::string stem = job.set->name + "_" + job.camera->name;
  if (options.previews && options.surface == Surface::cloth) {
    output.preview =
        Picture{options.preview_prefix + "preview_" + stem + ".jpg", half_scale_jpeg(image)};
    output.frame.preview_file = output.preview->file_name;
    output.frame.preview_scale = preview_scale;
  }
  if (options.overlays) {
    output.overlay = Picture{"overlay_" + stem + ".png", overlay_png(image, output.frame)};
  }
  return output;
}

std::optional<double> median_sigma_px(const std::vector<FrameDetections>& frames) {
  std::vector<double> sigmas;
  for (const FrameDetections& frame : frames) {
    for (const Detection& dot : frame.detections) {
      sigmas.push_back(std::sqrt(dot.covariance_px2.trace() / 2));
    }
  }
  if (sigmas.empty()) return std::nullopt;
  return median(std::move(sigmas));
}

void add_to_report(const FrameDetections& frame, bool has_tags, DetectReport& report) {
  const std::string name = fmt::format("set {}, camera {}", frame.set, frame.camera);
  ++report.frames;
  report.tags += static_cast<int>(frame.tags.size());
  report.marks += static_cast<int>(frame.detections.size());
  report.islands += static_cast<int>(frame.islands.size());
  for (const Rejection& rejection : frame.rejections) {
    ++report.rejections_by_reason[rejection.reason.substr(0, rejection.reason.find(':'))];
  }
  if (has_tags && frame.tags.empty())
    report.warnings.push_back(name + ": no tag of the print was recognised");
}

/// Makes a picture without marks NO-GO. In a free pose of the target, which not every camera needs
/// to see, it only means one view less, unless no picture at all shows a mark.
void judge_empty_frames(const Rig& rig, Surface surface, DetectResult& result) {
  for (const FrameDetections& frame : result.detections.frames) {
    if (!frame.detections.empty()) continue;
    const bool may_lack = surface == Surface::target && is_free_pose(rig, frame.set);
    const std::string name = fmt::format("set {}, camera {}", frame.set, frame.camera);
    if (may_lack && result.report.marks > 0) {
      result.report.warnings.push_back(name + ": no mark in this picture, one view less");
      continue;
    }
    result.report.frames_without_marks.push_back(name);
    result.detections.no_go.emplace(frame.set,
                                    fmt::format("no mark in the picture of {}", frame.camera));
  }
}

/// Copies the NO-GO of sets that capture stored as invalid.
void take_over_refusals(const Recording& recording, const std::vector<std::string>& sets,
                        DetectResult& result) {
  for (const std::string& name : sets) {
    const FrameSet& set = recording.set(name);
    if (!set.no_go) continue;
    const std::string why = "its recording is NO-GO: " + *set.no_go;
    result.detections.no_go.emplace(name, why);
    if (result.report.refused.empty()) result.report.refused = fmt::format("set {}: {}", name, why);
  }
}

/// Withdraws labels that contradict the positions of the tags on the print.
void withdraw_labels(FrameDetections& frame) {
  for (const Detection& dot : frame.detections)
    frame.rejections.push_back(
        {std::nullopt, dot.centre_px, "no label: the tags lie elsewhere on the print"});
  frame.detections.clear();
}

/// Kind of a target that looks the same after half a turn; empty for any other.
std::string twin_of(const Surroundings& surface) {
  if (surface.board) return is_ambiguous(*surface.board) ? "chessboard" : "";
  return surface.plane.tags.empty() && !surface.plane.classes ? "dot grid" : "";
}

/// Keys in the file of the print or target that give the positions of tags.
const char* tag_keys_of(const Surroundings& surface) {
  if (!surface.plane.stiff) return "tags.first_id, tags.cells";
  if (!surface.board) return "tags.tag.centre_mm";
  return surface.board->kind == TargetKind::charuco
             ? "upper_left_square, rows, cols or tags.first_id"
             : "rows, cols or tags.first_id";
}

void blame_print(const FrameDetections& frame, const std::string& why, DetectResult& result) {
  if (why.empty()) return;
  result.detections.no_go.emplace(frame.set, fmt::format("camera {}: {}", frame.camera, why));
  if (result.report.other_print.empty())
    result.report.other_print = fmt::format("set {}, camera {}: {}", frame.set, frame.camera, why);
}

/// Examines the first pictures of an AprilGrid in which tags are missing; a border of another width
/// than stated holds for all pictures.
void look_for_other_border(const Recording& recording, const std::vector<Job>& jobs,
                           const Surroundings& surface, DetectResult& result) {
  constexpr int kMostLooks = 4;
  int looks = 0;
  for (std::size_t i = 0; surface.board && i < jobs.size() && looks < kMostLooks; ++i) {
    const std::size_t found = result.detections.frames[i].tags.size();
    if (found >= surface.board->tags.size()) continue;
    ++looks;
    const std::string why =
        other_border(image_of(recording, jobs[i]), *surface.board, found, surface.file.string());
    for (const FrameDetections& frame : result.detections.frames) blame_print(frame, why, result);
    if (!why.empty()) return;
  }
}

/// Examines the first picture whose dots have no labels, apart from a few chance ones, to find
/// which print it shows; the answer is taken to hold for all such pictures.
void look_for_other_print(const Recording& recording, const std::vector<Job>& jobs,
                          const Surroundings& surface, const DetectOptions& options,
                          DetectResult& result) {
  if (surface.board || !result.report.other_print.empty()) return;
  std::optional<std::string> why;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const FrameDetections& frame = result.detections.frames[i];
    if (!frame.detections.empty() && frame.detections.size() >= frame.islands.size()) continue;
    if (!why)
      why = why_no_mark(image_of(recording, jobs[i]), surface.plane, options.limits,
                        !frame.detections.empty(), surface.file.string());
    blame_print(frame, *why, result);
  }
}

}  // namespace

void DetectOptions::check() const {
  if (sets.empty())
    throw usage_error("no frame set is given", "name at least one, e.g. --sets drape_A");
  if (std::set<std::string>(sets.begin(), sets.end()).size() != sets.size()) {
    throw usage_error("a frame set is named twice in --sets", "name each set once");
  }
  const auto require = [](bool good, const char* what) {
    if (!good) throw usage_error(what, "give a positive number");
  };
  require(threads >= 1, "the number of threads is below 1");
  require(limits.most_chi2_per_dof > 0,
          "the largest chi-square per degree of freedom is not positive");
  require(limits.most_misfit > 0, "the largest misfit is not positive");
  require(limits.most_masked_edge >= 0 && limits.most_masked_edge < 1,
          "the covered fraction is outside 0..1");
  require(limits.most_one_sided > 0 && limits.most_one_sided_radii >= 0,
          "the one-sided limit is not positive");
  require(limits.least_semi_axis_px > 0, "the smallest semi-axis in px is not positive");
  require(limits.most_sigma_radii > 0, "the largest standard deviation in radii is not positive");
}

DetectResult detect(const Recording& recording, const Rig& rig, const DetectOptions& options,
                    const DetectProgress& progress) {
  options.check();
  // Frames run in parallel; OpenCV's own threads would also make sums depend on the machine.
  cv::setNumThreads(1);
  const Surroundings surface = read_surface(rig, options.surface);
  const std::vector<Job> jobs = plan(recording, rig, options.sets);
  std::vector<Output> outputs(jobs.size());
  std::mutex mutex;
  std::size_t done = 0;
  parallel_for(jobs.size(), options.threads, [&](std::size_t k) {
    outputs[k] = run_job(recording, jobs[k], surface, options);
    const std::lock_guard lock(mutex);
    ++done;
    if (progress) {
      progress(static_cast<double>(done) / static_cast<double>(jobs.size()),
               fmt::format("camera {}, set {}", jobs[k].camera->name, jobs[k].set->name));
    }
  });
  DetectResult result;
  result.report.not_in_rig = not_in_rig(recording, rig, options.sets);
  result.detections.rig = rig.name;
  result.detections.lattice = surface.lattice;
  std::vector<PictureQuality> qualities;
  std::vector<double> blurs_px;
  for (Output& output : outputs) {
    const std::string why = tags_elsewhere(surface.plane, output.frame.tags, surface.file.string(),
                                           tag_keys_of(surface));
    if (!why.empty()) withdraw_labels(output.frame);
    blame_print(output.frame, why, result);
    qualities.push_back(output.quality);
    blurs_px.push_back(output.blur_px);
    add_to_report(output.frame, !surface.plane.tags.empty(), result.report);
    if (output.preview) result.previews.push_back(std::move(*output.preview));
    if (output.overlay) result.overlays.push_back(std::move(*output.overlay));
    result.detections.frames.push_back(std::move(output.frame));
  }
  result.report.poor_views = poor_views(result.detections.frames, qualities);
  if (std::string dark = unused_levels(result.detections.frames, qualities); !dark.empty())
    result.report.poor_views.push_back(std::move(dark));
  if (!surface.board)
    result.report.dot_size_ratio =
        dot_size_ratio(result.detections.frames, blurs_px, result.detections.lattice);
  const std::string other_size =
      other_dot_size(result.report.dot_size_ratio, surface.lattice, surface.file.string());
  for (const FrameDetections& frame : result.detections.frames)
    blame_print(frame, other_size, result);
  if (!surface.board && result.report.marks > 0 && !result.report.dot_size_ratio)
    result.report.warnings.push_back(
        fmt::format("the diameter of the dots is not measured, too few of them have neighbours: "
                    "dot_diameter_mm in {} is not confirmed",
                    surface.file.string()));
  look_for_other_print(recording, jobs, surface, options, result);
  look_for_other_border(recording, jobs, surface, result);
  judge_empty_frames(rig, options.surface, result);
  take_over_refusals(recording, options.sets, result);
  if (const std::string twin = twin_of(surface); !twin.empty()) {
    result.report.warnings.push_back(
        fmt::format("the {} looks the same upside down: its columns were taken to run to the right "
                    "in every picture",
                    twin));
  }
  result.report.median_sigma_px = median_sigma_px(result.detections.frames);
  return result;
}

std::vector<std::string> default_sets(const Rig& rig, Surface surface) {
  std::vector<std::string> sets;
  if (surface == Surface::target) {
    for (const TargetStage& stage : rig.stages) sets.push_back(stage.set);
    sets.insert(sets.end(), rig.free_poses.begin(), rig.free_poses.end());
    return sets;
  }
  for (const auto& file : rig.scenes) {
    const std::string set = read_scene(file).set;
    if (!set.empty() && std::find(sets.begin(), sets.end(), set) == sets.end()) sets.push_back(set);
  }
  return sets;
}

}  // namespace drape::detect
