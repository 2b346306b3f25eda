// SPDX-License-Identifier: Apache-2.0
#include "detect/detect.hpp"

#include <fmt/core.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"
#include "core/scene.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"
#include "detect/targets/board.hpp"

namespace drape::detect {
namespace {

const cv::Scalar tag_colour(255, 140, 0);
const cv::Scalar mark_colour(60, 220, 60);
const cv::Scalar island_colour(40, 220, 255);
const cv::Scalar reject_colour(60, 60, 255);

cv::Point at(const Eigen::Vector2d& px) {
  return {static_cast<int>(std::lround(px.x())), static_cast<int>(std::lround(px.y()))};
}

/// Draws captions that do not overlap: each at the first free position around its point, with a
/// line to the point if that is far away; if no position is free, beside the point.
class Captions {
 public:
  explicit Captions(cv::Mat& picture) : picture_(picture) {}

  /// Keeps captions off measured marks.
  void keep_free(const Eigen::Vector2d& px, double radius_px) {
    const int r = static_cast<int>(std::ceil(radius_px));
    taken_.emplace_back(at(px) - cv::Point(r, r), cv::Size(2 * r + 1, 2 * r + 1));
  }

  void write(const Eigen::Vector2d& px, const std::string& text, const cv::Scalar& colour) {
    int below = 0;
    const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale, 1, &below);
    const cv::Point point = at(px);
    const cv::Rect place = place_for(point, cv::Size(size.width, size.height + below));
    taken_.push_back(place);
    const cv::Point start(place.x, place.y + size.height);
    const cv::Point middle(place.x + place.width / 2, place.y + place.height / 2);
    const int far = std::abs(middle.y - point.y);
    if (far > 2 * place.height) cv::line(picture_, point, middle, colour, 1, cv::LINE_AA);
    // A dark outline keeps the letters legible on cloth and table.
    cv::putText(picture_, text, start, cv::FONT_HERSHEY_SIMPLEX, scale, cv::Scalar(0, 0, 0), 3,
                cv::LINE_AA);
    cv::putText(picture_, text, start, cv::FONT_HERSHEY_SIMPLEX, scale, colour, 1, cv::LINE_AA);
  }

 private:
  static constexpr double scale = 0.4;

  [[nodiscard]] cv::Rect place_for(const cv::Point& point, const cv::Size& size) const {
    const cv::Rect whole(0, 0, picture_.cols, picture_.rows);
    const cv::Rect first(point.x + 9, point.y - size.height - 3, size.width, size.height);
    for (int away = 0; away < 8; ++away) {
      const int up = away * (size.height + 2);
      for (const cv::Point& corner :
           {cv::Point(first.x, first.y - up), cv::Point(first.x, point.y + 3 + up),
            cv::Point(point.x - 9 - size.width, first.y - up),
            cv::Point(point.x - 9 - size.width, point.y + 3 + up)}) {
        const cv::Rect place(corner, size);
        if ((place & whole) != place) continue;
        if (std::ranges::none_of(
                taken_, [&](const cv::Rect& other) { return (place & other).area() > 0; })) {
          return place;
        }
      }
    }
    return first;
  }

  cv::Mat& picture_;
  std::vector<cv::Rect> taken_;
};

std::string name_of(MarkId mark) {
  return fmt::format("{},{}", mark.row, mark.col);
}

void outline(cv::Mat& picture, const Detection& dot, const cv::Scalar& colour) {
  cv::ellipse(picture,
              cv::RotatedRect(cv::Point2f(static_cast<float>(dot.centre_px.x()),
                                          static_cast<float>(dot.centre_px.y())),
                              cv::Size2f(static_cast<float>(2 * dot.semi_axes_px.x()),
                                         static_cast<float>(2 * dot.semi_axes_px.y())),
                              static_cast<float>(dot.axis_angle_rad / units::deg)),
              colour, 1, cv::LINE_AA);
}

/// PNG of the frame that shows tags (blue), labelled dots (green ellipse, "row,col"), island dots
/// (yellow, "#island row,col") and rejections (red cross).
std::vector<unsigned char> overlay_png(const GreyImage& image, const FrameDetections& frame) {
  cv::Mat picture;
  cv::cvtColor(view_of(image), picture, cv::COLOR_GRAY2BGR);
  for (const TagDetection& tag : frame.tags) {
    for (int k = 0; k < 4; ++k) {
      cv::line(picture, at(tag.corners_px.col(k)), at(tag.corners_px.col((k + 1) % 4)), tag_colour,
               2, cv::LINE_AA);
    }
  }
  struct Drawn {
    const Detection& dot;
    std::string name;
    const cv::Scalar& colour;
  };
  std::vector<Drawn> marks;
  for (const Detection& dot : frame.detections)
    marks.push_back({dot, name_of(dot.mark), mark_colour});
  for (const IslandDot& dot : frame.islands)
    marks.push_back(
        {dot.dot, fmt::format("#{} {}", dot.island, name_of(dot.dot.mark)), island_colour});
  Captions captions(picture);
  for (const Drawn& mark : marks) {
    outline(picture, mark.dot, mark.colour);
    captions.keep_free(mark.dot.centre_px, 0.7 * mark.dot.semi_axes_px.x());
  }
  std::vector<Rejection> seen = frame.rejections;
  std::erase_if(seen, [](const Rejection& rejection) { return !rejection.centre_px; });
  for (const Rejection& rejection : seen) {
    cv::drawMarker(picture, at(*rejection.centre_px), reject_colour, cv::MARKER_TILTED_CROSS, 12,
                   1);
    captions.keep_free(*rejection.centre_px, 5);
  }
  for (const Drawn& mark : marks) captions.write(mark.dot.centre_px, mark.name, mark.colour);
  for (const Rejection& rejection : seen) {
    const std::string kind = rejection.reason.substr(0, rejection.reason.find(':'));
    captions.write(*rejection.centre_px,
                   rejection.mark ? name_of(*rejection.mark) + " " + kind : kind, reject_colour);
  }
  std::vector<unsigned char> bytes;
  cv::imencode(".png", picture, bytes);
  return bytes;
}

constexpr int kStride = 3;           ///< distance of sampled lines; a picture has about a thousand
constexpr double kPart = 0.5;        ///< fraction of the others' marks, brightness or sharpness
constexpr std::size_t kFewTags = 3;  ///< number of tags that cannot be chance detections
constexpr double kLeastLight = 16;   ///< grey level below which 4 of 8 bits are unused
constexpr double kSaturated = 0.02;  ///< larger than highlights: part of the cloth is saturated

constexpr double kSteps = 257;  ///< per grey level: exact for 8 and 16 bits

double saturated_part(const GreyImage& image) {
  const auto full = std::ranges::count(image.bytes, 255);
  return static_cast<double>(full) / static_cast<double>(image.bytes.size());
}

std::string range_of(const std::vector<TagDetection>& tags) {
  const auto [least, most] = std::ranges::minmax_element(tags, {}, &TagDetection::id);
  return fmt::format("{} to {}", least->id, most->id);
}

/// Same as why_no_mark(), for a print that is labelled by its dots alone.
std::string why_no_plate(const GreyImage& image, const PrintPlane& plane, const FrameLimits& limits,
                         const std::string& file) {
  constexpr std::size_t kFewDots = 9;
  if (!plane.stiff) return {};
  TagFinder no_tags("");
  const auto dots_of = [&](const PrintPlane& described) {
    const FrameDetections frame = detect_frame(image, described, no_tags, limits);
    return std::max(frame.detections.size(), frame.islands.size());
  };
  const std::size_t dots = dots_of(plane);
  PrintPlane other = plane;
  other.white_dots = !plane.white_dots;
  if (dots < kFewDots && dots_of(other) >= kFewDots)
    return fmt::format("it shows {} dots, {} has {} ones (dot_colour)",
                       other.white_dots ? "white" : "black", file,
                       plane.white_dots ? "white" : "black");
  if (dots < kFewDots || !plane.classes) return {};
  return fmt::format(
      "{} dots stand in a grid, but no place of it shows all hollow dots of {} (hollow, "
      "hollow_diameter_mm, rows, cols); all of them must be in the picture",
      dots, file);
}

constexpr double kNearer = 1.2;         ///< largest ratio of scales between two tags
constexpr double kTurned_cos = 0.5;     ///< 60 degrees
constexpr std::size_t kLeastTags = 2;   ///< least number of contradicting tags: one may be misread
constexpr std::size_t kLeastPart = 10;  ///< smallest share of contradicting tags: one in ten

struct TagMap {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d px_per_m;     ///< derivative of the pixel by the position on the print
  double largest_px_per_m = 0;  ///< along edges and diagonals
};

TagMap map_of(const PrintPlane& plane, const TagDetection& tag) {
  const auto& c = tag.corners_px;
  TagMap map;
  map.centre_px = c.rowwise().mean();
  const double edge_m = plane.tag_edge_m;
  map.px_per_m.col(0) = (c.col(1) - c.col(0) + c.col(2) - c.col(3)) / (2 * edge_m);
  map.px_per_m.col(1) = plane.row_sign * (c.col(3) - c.col(0) + c.col(2) - c.col(1)) / (2 * edge_m);
  for (int k = 0; k < 4; ++k)
    map.largest_px_per_m =
        std::max(map.largest_px_per_m, (c.col((k + 1) % 4) - c.col(k)).norm() / edge_m);
  for (int k = 0; k < 2; ++k)
    map.largest_px_per_m = std::max(map.largest_px_per_m,
                                    (c.col(k + 2) - c.col(k)).norm() / (std::sqrt(2.0) * edge_m));
  return map;
}

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
  return std::ranges::find(rig.free_poses, set) != rig.free_poses.end();
}

/// Lists the pictures to process: sets as requested, cameras in the order of the rig. A missing
/// camera is an error, except in a free pose of the target, where calib reports it.
std::vector<Job> plan(const Recording& recording, const Rig& rig,
                      const std::vector<std::string>& sets) {
  std::vector<Job> jobs;
  for (const std::string& name : sets) {
    const FrameSet& set = recording.set(name);
    for (const RigCamera& camera : rig.cameras) {
      const auto frame = std::ranges::find(set.frames, camera.name, &RecordedFrame::camera);
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
  const std::string stem = picture_stem(job.set->name, job.camera->name);
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

/// Makes a picture without marks NO-GO. In a free pose not every camera needs to see the target: a
/// picture then only means one view less, unless none shows a mark.
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

/// Kind of a target with half-turn symmetry; empty for any other.
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
/// which print it shows; the answer holds for all such pictures.
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

PictureQuality quality_of(const GreyImage& image) {
  PictureQuality quality;
  quality.deep = !image.levels.empty();
  std::vector<std::int64_t> levels(65536), doubled_slopes(65536);
  std::vector<int> row(static_cast<std::size_t>(image.width_px));
  for (int y = 0; y < image.height_px; y += kStride) {
    for (int x = 0; x < image.width_px; ++x)
      row[x] = static_cast<int>(image.level(x, y) * kSteps + 0.5);
    for (int x = 1; x + 1 < image.width_px; ++x) {
      ++levels[row[x]];
      ++doubled_slopes[std::abs(row[x + 1] - row[x - 1])];
    }
  }
  quality.dark = counted_quantile(levels, 0.01) / kSteps;
  quality.light = counted_quantile(levels, 0.99) / kSteps;
  const double steepest = 0.5 * counted_quantile(doubled_slopes, 0.999) / kSteps;
  // A step blurred by a Gaussian has a slope of its height over sqrt(2 pi) widths.
  if (steepest > 0)
    quality.edge_px = (quality.light - quality.dark) / (std::sqrt(2 * std::numbers::pi) * steepest);
  return quality;
}

std::vector<std::string> poor_views(const std::vector<FrameDetections>& frames,
                                    const std::vector<PictureQuality>& qualities) {
  std::vector<std::string> lines;
  if (frames.empty()) return lines;
  std::vector<double> spans, edges;
  std::map<std::string, std::size_t> best;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    spans.push_back(qualities[i].light - qualities[i].dark);
    edges.push_back(qualities[i].edge_px);
    std::size_t& most = best[frames[i].set];
    most = std::max(most, frames[i].detections.size());
  }
  const double usual_span = median(spans), usual_edge_px = median(edges);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::size_t here = frames[i].detections.size(), most = best[frames[i].set];
    if (static_cast<double>(here) >= kPart * static_cast<double>(most) && here > 0) continue;
    const PictureQuality& q = qualities[i];
    std::string why;
    if (spans[i] < kPart * usual_span)
      why = fmt::format(
          "is {}: its grey levels are {:.0f} to {:.0f}, {:.0f} apart, in the others {:.0f}; change "
          "light or exposure",
          q.dark > 128 ? "washed out" : "dim", q.dark, q.light, spans[i], usual_span);
    else if (kPart * edges[i] > usual_edge_px)
      why = fmt::format(
          "is blurred: its sharpest edges are {:.1f} px wide, in the others {:.1f}; focus, or hold "
          "still",
          edges[i], usual_edge_px);
    if (why.empty()) continue;
    lines.push_back(
        fmt::format("set {}: camera {} {}; it shows {} marks, the best view of the set {}",
                    frames[i].set, frames[i].camera, why, here, most));
  }
  return lines;
}

std::string unused_levels(const std::vector<FrameDetections>& frames,
                          const std::vector<PictureQuality>& qualities) {
  std::size_t first = frames.size(), count = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (qualities[i].light >= kLeastLight) continue;
    first = std::min(first, i);
    ++count;
  }
  if (count == 0) return {};
  const std::string what = "hardly a pixel is above 1/16 of the largest grey level";
  const std::string more = count > 1 ? fmt::format(" and {} more pictures", count - 1) : "";
  if (qualities[first].deep)
    throw bad_input(what + (count > 1 ? ", as in" + more.substr(4) : ""),
                    {.camera = frames[first].camera, .set = frames[first].set},
                    "are these 12 bits in the low bits of 16? Multiply them by 16, or change light "
                    "or exposure");
  return fmt::format("set {}, camera {}{}: {}; change light or exposure", frames[first].set,
                     frames[first].camera, more, what);
}

std::string why_no_mark(const GreyImage& image, const PrintPlane& plane, const FrameLimits& limits,
                        bool has_labels, const std::string& file) {
  constexpr double kNoise = 1;
  if (plane.tag_family.empty()) return why_no_plate(image, plane, limits, file);
  TagFinder finder(plane.tag_family);
  const std::vector<TagDetection> own = finder.find_all(image, kNoise);
  std::string best_family = plane.tag_family;
  std::vector<TagDetection> best = own;
  for (const std::string& family : TagFamily::names()) {
    // tag16h5 has only 16 bits and is found in tags of any family, so it is no evidence.
    if (family == plane.tag_family || family == "tag16h5") continue;
    std::vector<TagDetection> found = TagFinder(family).find_all(image, kNoise);
    if (found.size() < kFewTags || found.size() <= best.size()) continue;
    best = std::move(found);
    best_family = family;
  }
  const std::size_t turned = finder.find_all(mirrored(image), kNoise).size();
  if (turned >= kFewTags && turned > best.size())
    return fmt::format("picture or print is mirrored: mirrored, it shows the tags of {}", file);
  if (best_family != plane.tag_family)
    return fmt::format("it shows tags {} of {}, tags.family in {} is {}", range_of(best),
                       best_family, file, plane.tag_family);
  if (own.size() >= kFewTags) {
    const bool known = std::ranges::any_of(
        own, [&](const TagDetection& tag) { return plane.tags.count(tag.id) != 0; });
    if (!known)
      return fmt::format(
          "it shows tags {} of {}, {} has tags {} to {} (tags.first_id, tags.tag.id)",
          range_of(own), plane.tag_family, file, plane.tags.begin()->first,
          plane.tags.rbegin()->first);
    if (has_labels) return {};
    for (const double factor : {2.0, 0.5}) {
      PrintPlane other = plane;
      other.dot_radius_m *= factor;
      const std::size_t found = detect_frame(image, other, finder, limits).detections.size();
      if (found < kFewTags) continue;
      return fmt::format(
          "with dots of {:g} mm {} are found, dot_diameter_mm in {} is {:g}: is it "
          "the radius?",
          2000 * other.dot_radius_m, found, file, 2000 * plane.dot_radius_m);
    }
    const double part = saturated_part(image);
    const std::string light = part <= kSaturated
                                  ? std::string()
                                  : fmt::format(
                                        "; {:.0f} % of its pixels are at the largest grey level: "
                                        "less exposure, gain or light shows dots again",
                                        100 * part);
    return fmt::format(
        "it shows {} tags of {}, but no dots of its size and pitch beside them "
        "(dot_diameter_mm, pitch_mm, rows, cols){}",
        own.size(), file, light);
  }
  return {};
}

using Eigen::Vector2d;
using units::mm;

std::optional<double> dot_size_ratio(const std::vector<FrameDetections>& frames,
                                     const std::vector<double>& blurs_px,
                                     const MarkLattice& lattice) {
  constexpr std::size_t kFewest = 20;
  if (!(lattice.dot_diameter_m > 0)) return std::nullopt;
  std::vector<double> inner, all;  // dots with four neighbours; dots with one along each axis
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FrameDetections& frame = frames[i];
    std::map<std::pair<int, int>, const Detection*> at;
    for (const Detection& dot : frame.detections) at[{dot.mark.row, dot.mark.col}] = &dot;
    for (const Detection& dot : frame.detections) {
      int around = 0;
      /// Offset to the next dot in a direction; nullopt if there is none.
      const auto step = [&](int down, int right) -> std::optional<Vector2d> {
        const auto before = at.find({dot.mark.row - down, dot.mark.col - right}),
                   after = at.find({dot.mark.row + down, dot.mark.col + right});
        const int found = int(before != at.end()) + int(after != at.end());
        around += found;
        if (found == 0) return std::nullopt;
        const Detection& from = before == at.end() ? dot : *before->second;
        const Detection& to = after == at.end() ? dot : *after->second;
        return Vector2d((to.centre_px - from.centre_px) / found);
      };
      auto row = step(1, 0), col = step(0, 1);
      double cells = 1;
      if (around == 0) {  // neighbours lie along the diagonals of a staggered grid
        row = step(1, 1);
        col = step(1, -1);
        cells = 2;
      }
      if (!row || !col) continue;
      const double cell_px2 = std::abs(cross(*row, *col)) / cells;
      const double area_px2 =
          std::numbers::pi * (dot.semi_axes_px.prod() + blurs_px[i] * blurs_px[i]);
      const double stated = 0.25 * std::numbers::pi * std::pow(lattice.dot_diameter_m, 2);
      all.push_back(std::sqrt(area_px2 / cell_px2 * std::pow(lattice.pitch_m, 2) / stated));
      if (around == 4) inner.push_back(all.back());
    }
  }
  std::vector<double>& ratios = inner.size() < kFewest ? all : inner;
  if (ratios.size() < kFewest) return std::nullopt;
  return median(std::move(ratios));
}

std::string other_dot_size(const std::optional<double>& ratio, const MarkLattice& lattice,
                           const std::string& file) {
  constexpr double kMost = 0.1;
  if (!ratio || std::abs(*ratio - 1) <= kMost) return {};
  return fmt::format(
      "the dots are {:.2f} mm wide where pitch_mm is {:g}, dot_diameter_mm in {} is {:g}",
      *ratio * lattice.dot_diameter_m / mm, lattice.pitch_m / mm, file,
      lattice.dot_diameter_m / mm);
}

std::string tags_elsewhere(const PrintPlane& plane, const std::vector<TagDetection>& tags,
                           const std::string& file, const std::string& keys) {
  constexpr double kMm = 1000;
  std::vector<TagMap> maps;
  double px_per_m = 0;
  for (const TagDetection& tag : tags) {
    maps.push_back(map_of(plane, tag));
    px_per_m = std::max(px_per_m, maps.back().largest_px_per_m);
  }
  const std::size_t count = tags.size();
  std::vector<std::vector<char>> apart(count, std::vector<char>(count, 0));
  double largest = 0;
  std::size_t pairs = 0, turned = 0;
  std::string example;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < count; ++k) {
      if (i == k) continue;
      const Eigen::Vector2d step_m = plane.tags.at(tags[k].id) - plane.tags.at(tags[i].id);
      const Eigen::Vector2d step_px = maps[k].centre_px - maps[i].centre_px;
      const Eigen::Vector2d expected_px = maps[i].px_per_m * step_m;
      ++pairs;
      if (expected_px.dot(step_px) < kTurned_cos * expected_px.norm() * step_px.norm()) ++turned;
      const double seen_m = step_px.norm() / px_per_m;
      if (seen_m <= kNearer * step_m.norm()) continue;
      apart[i][k] = 1;
      if (seen_m <= largest * step_m.norm()) continue;
      largest = seen_m / step_m.norm();
      example =
          fmt::format("tags {} and {} lie {:.0f} mm apart at least, {} has them {:.0f} mm apart",
                      tags[i].id, tags[k].id, kMm * seen_m, file, kMm * step_m.norm());
    }
  // Removes the tag that contradicts most others until no contradiction is left; counts them.
  std::size_t out = 0;
  for (;; ++out) {
    std::size_t worst = 0;
    std::ptrdiff_t most = 0;
    for (std::size_t i = 0; i < count; ++i)
      if (const auto found = std::ranges::count(apart[i], 1); found > most) {
        most = found;
        worst = i;
      }
    if (most == 0) break;
    for (std::size_t i = 0; i < count; ++i) apart[i][worst] = apart[worst][i] = 0;
  }
  if (out >= kLeastTags && kLeastPart * out >= count)
    return fmt::format("{} of {} tags lie elsewhere on the print: {} ({})", out, count, example,
                       keys);
  // A plate shows all tags in one orientation, a folded cloth only most.
  const std::size_t part = plane.stiff ? kLeastPart : 2;
  if (count > kLeastTags && part * turned > pairs)
    return fmt::format(
        "its tags lie in other directions from each other than {} has them: are rows and columns, "
        "or the sign of an axis, exchanged ({})?",
        file, keys);
  return {};
}

std::string other_tag_size(const PrintPlane& plane, const std::vector<TagDetection>& tags,
                           const std::string& file) {
  constexpr double kMost = 0.1;
  constexpr std::size_t kFewest = 6;
  if (tags.size() < kFewest) return {};
  std::vector<double> ratios;
  for (const TagDetection& tag : tags) {
    const auto step_m = [&](const TagDetection& other) -> Vector2d {
      return plane.tags.at(other.id) - plane.tags.at(tag.id);
    };
    const TagDetection* next = nullptr;
    for (const TagDetection& other : tags)
      if (other.id != tag.id && (next == nullptr || step_m(other).norm() < step_m(*next).norm()))
        next = &other;
    if (next == nullptr) return {};
    const TagMap here = map_of(plane, tag), there = map_of(plane, *next);
    const Vector2d expected_px = 0.5 * (here.px_per_m + there.px_per_m) * step_m(*next);
    ratios.push_back((there.centre_px - here.centre_px).norm() / expected_px.norm());
  }
  const double ratio = median(std::move(ratios));
  if (std::abs(ratio - 1) <= kMost) return {};
  return fmt::format(
      "the tags are {:.2f} mm wide where pitch_mm is {:g}, tags.edge_mm in {} is {:g}",
      plane.tag_edge_m / ratio / mm, plane.pitch_m / mm, file, plane.tag_edge_m / mm);
}

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
                    const PartDone& progress) {
  options.check();
  // Frames run in parallel; OpenCV's own threads would also make sums depend on the machine.
  cv::setNumThreads(1);
  const Surroundings surface = read_surface(rig, options.surface);
  const std::vector<Job> jobs = plan(recording, rig, options.sets);
  std::vector<Output> outputs(jobs.size());
  const auto run = [&](std::size_t k) {
    outputs[k] = run_job(recording, jobs[k], surface, options);
    return fmt::format("camera {}, set {}", jobs[k].camera->name, jobs[k].set->name);
  };
  parallel_for(jobs.size(), options.threads, run, progress);
  DetectResult result;
  result.report.not_in_rig = not_in_rig(recording, rig, options.sets);
  result.detections.rig = rig.name;
  result.detections.lattice = surface.lattice;
  std::vector<PictureQuality> qualities;
  std::vector<double> blurs_px;
  for (Output& output : outputs) {
    std::string why = tags_elsewhere(surface.plane, output.frame.tags, surface.file.string(),
                                     tag_keys_of(surface));
    if (why.empty() && !surface.board)
      why = other_tag_size(surface.plane, output.frame.tags, surface.file.string());
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
    if (!set.empty() && std::ranges::find(sets, set) == sets.end()) sets.push_back(set);
  }
  return sets;
}

std::string picture_stem(const std::string& set, const std::string& camera) {
  return set + (camera.find('_') == std::string::npos ? "_" : ",") + camera;
}

}  // namespace drape::detect
