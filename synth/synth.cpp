// SPDX-License-Identifier: Apache-2.0
#include "synth/synth.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"

namespace drape::synth {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::deg;

/// One mark of the volume, with its covariance if two cameras see it.
struct PredictedMark {
  std::optional<Matrix3d> covariance_m2;
  std::vector<double> sigmas_px;
};

bool is_in_picture(const CameraModel& model, const Vector2d& px, double border_px) {
  return px.x() > border_px && px.y() > border_px && px.x() < model.width_px - 1 - border_px &&
         px.y() < model.height_px - 1 - border_px;
}

PredictedMark predicted(const std::vector<Camera>& cameras, const Vector3d& at,
                        const Vector3d& normal, double radius_m, const PredictOptions& options) {
  PredictedMark mark;
  Matrix3d information = Matrix3d::Zero();
  int views = 0;
  for (const Camera& camera : cameras) {
    const Vector3d to_camera = (centre_in_world(camera) - at).normalized();
    if (to_camera.dot(normal) < std::cos(options.most_facing_deg * deg)) continue;
    const auto image = project(camera.model, camera.cam_from_world * at);
    constexpr double border_px = 12;
    if (!image || !is_in_picture(camera.model, image->px, border_px)) continue;
    const auto bound = centre_bound_px2(camera, at, normal, radius_m, options.render);
    if (!bound) continue;
    mark.sigmas_px.push_back(std::sqrt(bound->trace() / 2));
    const Matrix2d covariance = *bound + options.floor_px * options.floor_px * Matrix2d::Identity();
    const Eigen::Matrix<double, 2, 3> jacobian =
        image->d_px_d_point * camera.cam_from_world.rotation;
    information += jacobian.transpose() * covariance.inverse() * jacobian;
    ++views;
  }
  if (views >= 2) mark.covariance_m2 = information.inverse();
  return mark;
}

/// Sample positions over the patch and the height of the volume.
std::vector<Vector3d> places(const Print& print, double height_m) {
  std::vector<Vector3d> all;
  for (const double z : {0.0, 0.5, 1.0}) {
    for (int j = 0; j < 5; ++j) {
      for (int i = 0; i < 5; ++i)
        all.emplace_back((i / 4.0 - 0.5) * 0.9 * print.patch_m.y(),
                         (j / 4.0 - 0.5) * 0.9 * print.patch_m.x(), z * height_m);
    }
  }
  return all;
}

struct Counts {
  int marks = 0, seen = 0, reached = 0;
};

PredictedSlope slope_of(const std::vector<Camera>& cameras, const Print& print, double slope_deg,
                        const PredictOptions& options, Counts& counts) {
  PredictedSlope result;
  result.slope_deg = slope_deg;
  std::vector<double> sigmas, heights, pixels;
  const int sides = slope_deg == 0 ? 1 : 8;
  for (const Vector3d& at : places(print, options.height_m)) {
    for (int side = 0; side < sides; ++side) {
      const double angle = 2 * std::numbers::pi * side / sides;
      const double slope = slope_deg * deg;
      const Vector3d normal(std::sin(slope) * std::cos(angle), std::sin(slope) * std::sin(angle),
                            std::cos(slope));
      const auto mark = predicted(cameras, at, normal, print.dot_diameter_m / 2, options);
      ++result.marks;
      pixels.insert(pixels.end(), mark.sigmas_px.begin(), mark.sigmas_px.end());
      if (!mark.covariance_m2) continue;
      ++result.seen_by_two;
      sigmas.push_back(std::sqrt(mark.covariance_m2->trace()));
      heights.push_back(std::sqrt((*mark.covariance_m2)(2, 2)));
      counts.reached += sigmas.back() <= options.asked_sigma_m;
    }
  }
  counts.marks += result.marks;
  counts.seen += result.seen_by_two;
  if (!pixels.empty()) result.median_px = quantile(pixels, 0.5);
  if (sigmas.empty()) return result;
  result.median_m = quantile(sigmas, 0.5);
  result.p95_m = quantile(sigmas, 0.95);
  result.median_height_m = quantile(heights, 0.5);
  return result;
}

std::optional<Vector2d> image_of(const GridSurface& surface, const Camera& camera,
                                 const FacePoint& face) {
  const auto point = surface.point_in_world(face);
  if (!point) return std::nullopt;
  const auto image = project(camera.model, camera.cam_from_world * *point);
  if (!image) return std::nullopt;
  return image->px;
}

/// True if the camera sees this point of the face unoccluded.
bool is_seen(const GridSurface& surface, const SceneView& view, const FacePoint& face) {
  const auto point = surface.point_in_world(face);
  if (!point) return false;
  const Vector3d in_camera = view.camera().cam_from_world * *point;
  const auto image = project(view.camera().model, in_camera);
  if (!image) return false;
  const Hit hit = view.cast(image->px);
  constexpr double slack_m = 2e-5;
  return hit.is_hit() && hit.front && std::abs(hit.depth_m - in_camera.z()) < slack_m;
}

/// Visible fraction of a dot, sampled at its centre and on rings out to its outline.
double seen_fraction(const GridSurface& surface, const SceneView& view, const MarkOnFace& mark) {
  constexpr int rings = 3, around = 16;
  int seen = is_seen(surface, view, mark.centre) ? 1 : 0, all = 1;
  for (int ring = 1; ring <= rings && mark.radius_m > 0; ++ring) {
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * k / around;
      const FacePoint offset(std::cos(angle), std::sin(angle));
      seen += is_seen(surface, view, mark.centre + mark.radius_m * ring / rings * offset) ? 1 : 0;
      ++all;
    }
  }
  return seen / static_cast<double>(all);
}

using units::mm;

/// Pose of an upright camera, whose x axis is horizontal.
CamFromWorld looking(const Vector3d& from, const Vector3d& at) {
  const Vector3d z = (at - from).normalized();
  const bool straight_down = std::abs(z.z()) > 1 - 1e-9;
  const Vector3d x =
      straight_down ? Vector3d::UnitX() : Vector3d(z.cross(Vector3d::UnitZ()).normalized());
  CamFromWorld pose;
  pose.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  pose.translation_m = -pose.rotation * from;
  return pose;
}

Camera camera_of(const PlannedCamera& plan, const Rig& rig) {
  const RigCamera& known = rig.camera(plan.name);
  BrownLens lens;
  lens.fx_px = plan.focal_m / known.pixel_pitch_x_m;
  lens.fy_px = plan.focal_m / known.pixel_pitch_y_m;
  lens.cx_px = (known.width_px - 1) / 2.0;
  lens.cy_px = (known.height_px - 1) / 2.0;
  lens.k1 = plan.k1;
  lens.k2 = plan.k2;
  return {known.name,
          {lens, known.width_px, known.height_px},
          looking(plan.position_m, plan.look_at_m)};
}

std::vector<Camera> in_order_of(const Rig& rig, const std::vector<Camera>& cameras,
                                const std::string& file) {
  std::vector<Camera> ordered;
  for (const RigCamera& wanted : rig.cameras) {
    for (const Camera& camera : cameras) {
      if (camera.name == wanted.name) ordered.push_back(camera);
    }
    if (ordered.empty() || ordered.back().name != wanted.name) {
      throw bad_input("a camera of the rig is missing", {.file = file, .camera = wanted.name},
                      "give its place and focal length");
    }
  }
  return ordered;
}

/// Throws Error(bad_input) unless the object is a box, or a sphere in the plate's hole.
WorldFromTarget pose_of(const Scene& scene, const ObjectTags& tags) {
  const auto index = static_cast<std::size_t>(tags.object - 1);
  const Obstacle& object = scene.obstacles[index];
  constexpr double kSheet_mm = 0.1;  // default of `drape object`
  WorldFromTarget pose;
  if (const auto* box = std::get_if<Box>(&object)) {
    pose.rotation = box->world_from_box.rotation;
    const double above_m = 0.5 * box->size_m.z() + tags.thickness_mm.value_or(kSheet_mm) * mm;
    pose.translation_m = box->world_from_box * Vector3d(0, 0, above_m);
    return pose;
  }
  const auto* ball = std::get_if<Sphere>(&object);
  const double hole_m = 0.5 * tags.hole_mm.value_or(0) * mm;
  if (ball == nullptr || hole_m <= 0 || hole_m >= ball->radius_m)
    throw bad_input("a plate lies on a box, or carries a sphere in its hole",
                    scene.document.where(fmt::format("object.{}.tags_set", index)),
                    "give a sphere's tags_hole_mm, smaller than its diameter");
  pose.translation_m = ball->centre_in_world;
  pose.translation_m.z() -= std::sqrt(ball->radius_m * ball->radius_m - hole_m * hole_m);
  return pose;
}

/// Writes the picture to <folder>/<set>/<camera>.png.
RecordedFrame write_picture(const std::filesystem::path& folder, const std::string& set,
                            const std::string& camera, const GreyPicture& picture) {
  const cv::Mat image(picture.height_px, picture.width_px, CV_8U,
                      const_cast<std::uint8_t*>(picture.bytes.data()));
  std::vector<unsigned char> png;
  if (!cv::imencode(".png", image, png))
    throw internal_error("the picture could not be encoded", {.camera = camera, .set = set});
  const std::string file = fmt::format("{}/{}.png", set, camera);
  write_inside(folder, file, as_text(png), {.camera = camera, .set = set});
  return {camera, file, sha256_of(png), picture.width_px, picture.height_px, std::nullopt};
}

/// Writes the cameras as an error-free calibration.
void write_true_calibration(const std::filesystem::path& file, const Rig& rig,
                            const std::vector<Camera>& cameras) {
  Calibration calibration;
  calibration.method = "joint";
  calibration.rig = rig.name;
  for (const Camera& camera : cameras) {
    CalibratedCamera exact;
    exact.camera = camera;
    exact.valid_region_px = {0, 0, camera.model.width_px - 1.0, camera.model.height_px - 1.0};
    const Eigen::Vector3d at(10 * mm, 20 * mm, 0);
    const auto image = project(camera.model, camera.cam_from_world * at);
    if (!image) {
      throw bad_input("the camera does not look at the world's origin", {.camera = camera.name},
                      "correct its position and look_at_mm");
    }
    exact.worked_point = {at, image->px};
    calibration.cameras.push_back(exact);
  }
  calibration.warnings.emplace_back("these are the cameras of a synthetic recording, not measured");
  write_calibration(file, calibration);
}

/// A frame set to render.
struct Job {
  std::string set;
  Surface shows;
  SyntheticScene scene;
  std::vector<MarkOnFace> marks;
};

/// Random pose of the target near the origin, tilted by up to 35 degrees in any direction.
WorldFromTarget free_pose(std::uint64_t seed, std::uint64_t index) {
  const auto any = [&](std::uint64_t k) { return uniform(seed + 17, 16 * index + k); };
  const double side = 2 * std::numbers::pi * any(0), tilt = 35 * deg * std::sqrt(any(1));
  const Vector3d axis(std::cos(side), std::sin(side), 0);
  WorldFromTarget pose;
  pose.rotation = (Eigen::AngleAxisd(tilt, axis) *
                   Eigen::AngleAxisd((any(2) - 0.5) * 40 * deg, Vector3d::UnitZ()))
                      .toRotationMatrix();
  pose.translation_m = Vector3d((any(3) - 0.5) * 30, (any(4) - 0.5) * 30, 20 + 50 * any(5)) * mm;
  return pose;
}

// Largest penetration of a sheet's triangles into its support between marks.
constexpr double under_sheet_m = 1.5 * mm;

Job target_job(const std::string& set, const Target& target, const WorldFromTarget& pose) {
  return {set,
          Surface::target,
          {surface_of(target, pose), FacePattern(face_of(target)), table_triangles(-80 * mm)},
          marks_of(target)};
}

/// The object with its plate and without cloth; a sphere is only put into its stand later.
Job plate_job(const ObjectTags& tags, const WorldFromTarget& pose, Scene scene) {
  std::erase_if(scene.obstacles,
                [](const Obstacle& o) { return std::holds_alternative<Sphere>(o); });
  const Target target = read_target(tags.target);
  return {tags.set,
          Surface::target,
          {surface_of(target, pose), FacePattern(face_of(target)),
           triangles_of(drawn_in(scene, under_sheet_m))},
          marks_of(target)};
}

Job cloth_job(const Scene& scene, const Print& print, const SynthOptions& options,
              std::uint64_t index) {
  Job job{scene.set, Surface::cloth, {{}, FacePattern(face_of(print)), {}}, marks_of(print)};
  const auto sheet = options.sheets.find(scene.set);
  if (sheet != options.sheets.end()) {
    job.scene.surface = surface_of(read_sheet(sheet->second));
    job.scene.scenery = triangles_of(drawn_in(scene, under_sheet_m));
    return job;
  }
  Folds folds = options.folds;
  const auto any = [&](std::uint64_t k) {
    return uniform(options.render.seed + 29, 8 * index + k);
  };
  folds.phase_rad = 2 * std::numbers::pi * any(0);
  folds.direction_rad = std::numbers::pi * any(1);
  const double amplitude = std::tan(folds.slope_rad) * folds.wavelength_m / (2 * std::numbers::pi);
  folds.centre_in_world = {0, 0, std::max(20 * mm, amplitude)};
  job.scene.surface = folded(print, folds);
  job.scene.scenery = table_triangles(scene.table_z_m);
  return job;
}

bool is_asked(const SynthOptions& options, const std::string& set) {
  return options.sets.empty() || std::ranges::find(options.sets, set) != options.sets.end();
}

/// Creates a set when it is its turn to be rendered.
struct Named {
  std::string set;
  std::function<Job()> make;
};

std::vector<Named> jobs_of(const Rig& rig, const SynthOptions& options) {
  std::vector<Named> jobs;
  const auto target = std::make_shared<Target>(read_target(rig.target_file));
  for (const TargetStage& stage : rig.stages) {
    WorldFromTarget pose;
    pose.translation_m.z() = stage.z_m;
    jobs.push_back({stage.set, [=] { return target_job(stage.set, *target, pose); }});
  }
  std::uint64_t index = 0;
  for (const std::string& set : rig.free_poses) {
    const WorldFromTarget pose = free_pose(options.render.seed, index++);
    jobs.push_back({set, [=] { return target_job(set, *target, pose); }});
  }
  for (const auto& file : rig.scenes) {
    const Scene scene = read_scene(file);
    const std::uint64_t own = index++;
    if (scene.set.empty()) continue;
    jobs.push_back(
        {scene.set, [=, &options] { return cloth_job(scene, print_of(scene), options, own); }});
    for (const ObjectTags& tags : scene.tags) {
      const WorldFromTarget on_object = pose_of(scene, tags);
      jobs.push_back({tags.set, [=] { return plate_job(tags, on_object, scene); }});
    }
  }
  return jobs;
}

void require_known(const std::vector<Named>& jobs, const SynthOptions& options) {
  std::vector<std::string> asked = options.sets;
  for (const auto& [set, file] : options.sheets) asked.push_back(set);
  for (const std::string& set : asked) {
    if (std::ranges::any_of(jobs, [&](const Named& job) { return job.set == set; })) continue;
    std::string names;
    for (const Named& job : jobs) names += (names.empty() ? "" : ", ") + job.set;
    throw usage_error(fmt::format("the rig has no frame set `{}` to render", set),
                      "it has " + names);
  }
}

}  // namespace

void fields(Fields& f, PredictOptions& o) {
  f.otherwise(
      {"accuracy_mm", "required standard deviation of a mark in space", units::mm, above_zero},
      o.asked_sigma_m);
  f.otherwise({"height_mm", "height of the drape's volume above the origin", units::mm, 0},
              o.height_m);
}

std::optional<Matrix2d> centre_bound_px2(const Camera& camera, const Vector3d& in_world,
                                         const Vector3d& normal, double radius_m,
                                         const RenderOptions& render) {
  constexpr int nodes = 48;
  const Vector3d u = normal.unitOrthogonal();
  const Vector3d v = normal.cross(u);
  const double white = render.white_grey, black = render.white_grey * render.ink_ratio;
  const double variance =
      render.noise_grey * render.noise_grey * (0.5 + 0.5 * (white + black) / 2 / 128);
  const double blur = std::sqrt(render.blur_px * render.blur_px + 1.0 / 12);
  Matrix2d around = Matrix2d::Zero();  // sum along the outline of n n', with n its normal, px
  std::optional<Vector2d> last;
  for (int k = 0; k <= nodes; ++k) {
    const double angle = 2 * std::numbers::pi * k / nodes;
    const Vector3d point = in_world + radius_m * (std::cos(angle) * u + std::sin(angle) * v);
    const auto image = project(camera.model, camera.cam_from_world * point);
    if (!image) return std::nullopt;
    if (last) {
      const Vector2d along = image->px - *last;
      const Vector2d across(-along.y(), along.x());
      around += across * across.transpose() / std::max(along.norm(), 1e-12);
    }
    last = image->px;
  }
  const double contrast = white - black;
  const double edge =
      contrast * contrast / (variance + 1.0 / 12) / (2 * blur * std::sqrt(std::numbers::pi));
  return Matrix2d((edge * around).inverse());
}

Prediction predict(const std::vector<Camera>& cameras, const Print& print,
                   const PredictOptions& options) {
  Prediction result;
  Counts counts, gentle;
  for (const double slope_deg : {0.0, 30.0, 45.0, 60.0}) {
    result.slopes.push_back(slope_of(cameras, print, slope_deg, options, counts));
    if (slope_deg <= 45) gentle = counts;
  }
  const auto fraction = [](int part, int whole) { return whole == 0 ? 0.0 : part / double(whole); };
  result.reached_fraction = fraction(gentle.reached, gentle.seen);
  result.seen_fraction = fraction(gentle.seen, gentle.marks);
  result.go = result.reached_fraction >= options.asked_fraction && gentle.seen > 0;
  return result;
}

void fields(Fields& f, TrueMarkView& view) {
  f(Field{"camera", "name of the camera"}.plain_name(), view.camera);
  f({"px", "image of the mark's centre; null if not in front of the camera"}, view.px);
  f({"centroid_px", "centroid of the mark's area in the image"}, view.centroid_px);
  f({"facing_deg", "angle between the printed side's normal and the ray to the camera", units::deg,
     0, 180},
    view.facing_rad);
  f({"visible_share", "fraction of the mark that is inside the picture and not hidden", 1, 0, 1},
    view.visible_fraction);
}

void fields(Fields& f, TrueMark& mark) {
  f({"row", "row of the mark", 1, 0}, mark.mark.row);
  f({"col", "column of the mark", 1, 0}, mark.mark.col);
  f({"xyz_mm", "position in the world", units::mm}, mark.point_in_world);
  f({"normal_in_world", "unit normal on the printed side"}, mark.normal_in_world);
  f({"views", "the mark in each camera's picture"}, mark.views);
}

std::optional<Vector2d> disc_centroid_px(const GridSurface& surface, const Camera& camera,
                                         const FacePoint& centre, double radius_m) {
  constexpr int nodes = 720;
  const auto middle = image_of(surface, camera, centre);
  if (!middle) return std::nullopt;
  const auto corner = [&](int k) {
    const double angle = 2 * std::numbers::pi * k / nodes;
    return image_of(surface, camera,
                    centre + radius_m * FacePoint(std::cos(angle), std::sin(angle)));
  };
  auto last = corner(nodes - 1);
  double twice = 0;
  Vector2d moment = Vector2d::Zero();
  for (int k = 0; k < nodes; ++k) {
    const auto next = corner(k);
    if (!last || !next) return std::nullopt;
    const Vector2d a = *last - *middle, b = *next - *middle;
    const double wedge = cross(a, b);
    twice += wedge;
    moment += wedge * (a + b) / 3;
    last = next;
  }
  const Vector2d offset = moment / twice;
  if (!offset.allFinite()) return std::nullopt;
  return Vector2d(*middle + offset);
}

std::vector<TrueMark> truth_of(const SyntheticScene& scene, const std::vector<MarkOnFace>& marks,
                               const std::vector<const SceneView*>& views) {
  std::vector<TrueMark> truth;
  for (const MarkOnFace& mark : marks) {
    const auto point = scene.surface.point_in_world(mark.centre);
    if (!point) {
      throw bad_input(
          fmt::format("mark ({}, {}) lies beyond the surface", mark.mark.row, mark.mark.col), {},
          "give a surface that reaches as far as the print");
    }
    TrueMark known{mark.mark, *point, scene.surface.normal_in_world(mark.centre), {}};
    for (const SceneView* view : views) {
      TrueMarkView seen;
      const Camera& camera = view->camera();
      seen.camera = camera.name;
      seen.px = image_of(scene.surface, camera, mark.centre);
      seen.centroid_px = mark.radius_m > 0
                             ? disc_centroid_px(scene.surface, camera, mark.centre, mark.radius_m)
                             : seen.px;
      const Vector3d to_camera = (centre_in_world(camera) - *point).normalized();
      seen.facing_rad = std::acos(std::clamp(to_camera.dot(known.normal_in_world), -1.0, 1.0));
      seen.visible_fraction = seen_fraction(scene.surface, *view, mark);
      known.views.push_back(seen);
    }
    truth.push_back(known);
  }
  return truth;
}

void fields(Fields& f, PlannedCamera& camera) {
  f(Field{"name", "name of the rig's camera"}.plain_name(), camera.name);
  f({"focal_mm", "focal length", mm, above_zero}, camera.focal_m);
  f({"position_mm", "position in the world", mm}, camera.position_m);
  f.otherwise({"look_at_mm", "point of the world at the centre of the picture", mm},
              camera.look_at_m);
  f.otherwise({"k1", "radial distortion"}, camera.k1);
  f.otherwise({"k2", "radial distortion"}, camera.k2);
  f.rule((camera.position_m - camera.look_at_m).norm() >= 1 * mm, "position_mm",
         "the camera stands where it looks at", "give two places");
}

void fields(Fields& f, CamerasPlan& plan) {
  f({"camera", "one table per camera of the rig"}, plan.cameras);
}

std::vector<Camera> read_planned_cameras(const std::filesystem::path& file, const Rig& rig) {
  std::vector<Camera> cameras;
  for (const PlannedCamera& plan : read_record<CamerasPlan>(file).cameras)
    cameras.push_back(camera_of(plan, rig));
  return in_order_of(rig, cameras, file.string());
}

std::vector<Camera> cameras_of(const Calibration& calibration, const Rig& rig) {
  std::vector<Camera> cameras;
  for (const CalibratedCamera& camera : calibration.cameras) cameras.push_back(camera.camera);
  return in_order_of(rig, cameras, "calibration.json");
}

void fields(Fields& f, SynthOptions& o) {
  f.if_any(Field{"sets", "frame sets a,b,c (default: all the rig names)"}.plain_name(), o.sets);
  std::vector<std::string> sheets;
  f.if_any(
      Field{"sheet", "SET=sheet.json: shape of the cloth in a set (default: folds)"}.per_flag(),
      sheets);
  for (const std::string& sheet : sheets) {
    const std::size_t equals = sheet.find('=');
    const bool names_set = equals != std::string::npos && equals > 0;
    f.limit(names_set, "sheet", fmt::format("`{}` names no frame set", sheet),
            "give --sheet SET=sheet.json");
    if (names_set) o.sheets[sheet.substr(0, equals)] = sheet.substr(equals + 1);
  }
  fields(f, o.folds);
  fields(f, o.render);
}

void fields(Fields& f, SetTruth& set) {
  f(Field{"set", "name of the frame set"}.plain_name(), set.set);
  f({"shows", "printed surface in the pictures"}, set.shows);
  f({"marks", "marks by row and column"}, set.marks);
}

void fields(Fields& f, Truth& truth) {
  f({"rig", "name of the rig"}, truth.rig);
  f({"sets", "frame sets in the order of the recording"}, truth.sets);
}

std::vector<DescribedFormat> synth_formats() {
  const TrueMarkView view{"cam0", Eigen::Vector2d(800, 600), Eigen::Vector2d(800.1, 600), 0.5, 1};
  const TrueMark mark{{0, 1}, Vector3d(0.01, 0.02, 0), Vector3d::UnitZ(), {view}};
  return {described(CamerasPlan{
              {{"cam0", Vector3d(0.4, 0, 0.6), Vector3d(0, 0, 0.04), 0.01, -0.1, 0.01}}}),
          described(Truth{"bench1", {{"drape_A", Surface::cloth, {mark}}}})};
}

SynthReport write_synthetic_recording(const Rig& rig, const std::vector<Camera>& cameras,
                                      const std::filesystem::path& folder,
                                      const SynthOptions& options, const PartDone& progress) {
  if (std::filesystem::exists(folder / "recording.json")) {
    throw bad_input("the folder already holds a recording", {.file = folder.string()},
                    "give a new folder");
  }
  std::vector<Named> jobs = jobs_of(rig, options);
  require_known(jobs, options);
  std::erase_if(jobs, [&](const Named& job) { return !is_asked(options, job.set); });
  std::vector<PixelRays> rays;
  for (const Camera& camera : cameras) rays.emplace_back(camera.model);
  SynthReport report;
  Recording recording{folder, "synth", std::nullopt, {}};
  Truth truth{rig.name, {}};
  std::uint64_t frame = 0;
  for (const Named& named : jobs) {
    const Job job = named.make();
    recording.sets.push_back({job.set, {}});
    std::vector<std::unique_ptr<SceneView>> owned;
    std::vector<const SceneView*> views;
    for (std::size_t k = 0; k < cameras.size(); ++k) {
      owned.push_back(std::make_unique<SceneView>(job.scene, cameras[k], rays[k]));
      views.push_back(owned.back().get());
      const CameraModel& model = cameras[k].model;
      const GreyPicture picture = expose(views.back()->light(options.render), model.width_px,
                                         model.height_px, frame++, options.render);
      recording.sets.back().frames.push_back(
          write_picture(folder, job.set, cameras[k].name, picture));
      ++report.pictures;
    }
    truth.sets.push_back({job.set, job.shows, truth_of(job.scene, job.marks, views)});
    report.marks += static_cast<int>(job.marks.size());
    for (const TrueMark& mark : truth.sets.back().marks) {
      for (const TrueMarkView& view : mark.views) report.whole_views += view.is_whole() ? 1 : 0;
    }
    if (progress)
      progress(static_cast<double>(truth.sets.size()) / static_cast<double>(jobs.size()), job.set);
  }
  write_record(folder / "truth.json", truth);
  write_true_calibration(folder / "true_calibration.json", rig, cameras);
  write_recording(recording);
  for (const auto& file : rig.scenes) {
    const Scene scene = read_scene(file);
    const bool is_bare = scene.obstacles.empty() && scene.pins.empty() && scene.clamps.empty();
    if (!is_bare && !scene.set.empty() && is_asked(options, scene.set) &&
        !options.sheets.contains(scene.set))
      report.not_over_objects.push_back(scene.set);
  }
  return report;
}

}  // namespace drape::synth
