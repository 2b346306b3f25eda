// SPDX-License-Identifier: Apache-2.0
#include "synth/synth.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/inside.hpp"
#include "core/rules.hpp"
#include "core/scene.hpp"
#include "core/units.hpp"
#include "synth/random.hpp"

namespace drape::synth {

namespace {

using Eigen::Vector3d;
using units::deg;
using units::mm;

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
  write_inside(folder, file, {reinterpret_cast<const char*>(png.data()), png.size()},
               {.camera = camera, .set = set});
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
  return options.sets.empty() ||
         std::find(options.sets.begin(), options.sets.end(), set) != options.sets.end();
}

/// Creates a set when it is its turn to be rendered.
using MakeJob = std::function<Job()>;
struct Named {
  std::string set;
  MakeJob make;
};

std::vector<Named> jobs_of(const Rig& rig, const SynthOptions& options) {
  std::vector<Named> jobs;
  const auto add_job = [&](const std::string& set, const MakeJob& make) {
    jobs.push_back({set, make});
  };
  const auto target = std::make_shared<Target>(read_target(rig.target_file));
  for (const TargetStage& stage : rig.stages) {
    WorldFromTarget pose;
    pose.translation_m.z() = stage.z_m;
    add_job(stage.set, [=] { return target_job(stage.set, *target, pose); });
  }
  std::uint64_t index = 0;
  for (const std::string& set : rig.free_poses) {
    const WorldFromTarget pose = free_pose(options.render.seed, index++);
    add_job(set, [=] { return target_job(set, *target, pose); });
  }
  for (const auto& file : rig.scenes) {
    const Scene scene = read_scene(file);
    const std::uint64_t own = index++;
    if (scene.set.empty()) continue;
    add_job(scene.set, [=, &options] { return cloth_job(scene, print_of(scene), options, own); });
    for (const ObjectTags& tags : scene.tags) {
      const WorldFromTarget on_object = pose_of(scene, tags);
      add_job(tags.set, [=] { return plate_job(tags, on_object, scene); });
    }
  }
  return jobs;
}

void require_known(const std::vector<Named>& jobs, const SynthOptions& options) {
  std::vector<std::string> asked = options.sets;
  for (const auto& [set, file] : options.sheets) asked.push_back(set);
  for (const std::string& set : asked) {
    if (std::any_of(jobs.begin(), jobs.end(), [&](const Named& job) { return job.set == set; }))
      continue;
    std::string names;
    for (const Named& job : jobs) names += (names.empty() ? "" : ", ") + job.set;
    throw usage_error(fmt::format("the rig has no frame set `{}` to render", set),
                      "it has " + names);
  }
}

}  // namespace

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
                                      const SynthOptions& options, const SynthProgress& progress) {
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
