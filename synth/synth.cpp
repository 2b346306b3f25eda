// SPDX-License-Identifier: Apache-2.0
#include "synth/synth.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/scene.hpp"
#include "core/units.hpp"
#include "synth/plates.hpp"
#include "synth/random.hpp"
#include "synth/recording_files.hpp"

namespace drape::synth {
namespace {

using Eigen::Vector3d;
using units::deg;
using units::mm;

/// One frame set to be rendered.
struct Job {
  std::string set, shows;
  SyntheticScene scene;
  std::vector<MarkOnFace> marks;
};

/// A free pose of the target: tilted up to 35 degrees to any side, near the origin.
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

// A sheet's triangles cut through what it rests on by less than this between its marks.
constexpr double under_sheet_m = 1.5 * mm;

Job target_job(const std::string& set, const Target& target, const WorldFromTarget& pose) {
  return {set,
          "target",
          {surface_of(target, pose), pattern_of(target), table_triangles(-80 * mm)},
          marks_of(target)};
}

/// The object with its plate and without cloth; a sphere is put into its stand afterwards.
Job plate_job(const Plate& plate, Scene scene) {
  std::erase_if(scene.obstacles,
                [](const Obstacle& o) { return std::holds_alternative<Sphere>(o); });
  const Target target = read_target(plate.target);
  return {plate.set,
          "target",
          {surface_of(target, plate.pose), pattern_of(target),
           triangles_of(drawn_in(scene, under_sheet_m))},
          marks_of(target)};
}

Job cloth_job(const Scene& scene, const Print& print, const SynthOptions& options,
              std::uint64_t index) {
  Job job{scene.set, "cloth", {{}, pattern_of(print), {}}, marks_of(print)};
  const auto sheet = options.sheets.find(scene.set);
  if (sheet != options.sheets.end()) {
    job.scene.surface = surface_of(read_sheet(sheet->second));
    job.scene.scenery = triangles_of(drawn_in(scene, under_sheet_m));
    return job;
  }
  Folds folds;
  folds.slope_rad = options.folds_slope_deg * deg;
  folds.wavelength_m = options.folds_wavelength_mm * mm;
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

/// What to render, built only when its turn comes.
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
    add_job(scene.set,
            [=, &options] { return cloth_job(scene, read_print(scene.print_file), options, own); });
    for (const Plate& plate : plates_of(scene))
      add_job(plate.set, [=] { return plate_job(plate, scene); });
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

void SynthOptions::check() const {
  render.check();
  Folds folds;
  folds.slope_rad = folds_slope_deg * deg;
  folds.wavelength_m = folds_wavelength_mm * mm;
  folds.check();
}

SynthReport write_synthetic_recording(const Rig& rig, const std::vector<Camera>& cameras,
                                      const std::filesystem::path& folder,
                                      const SynthOptions& options, const SynthProgress& progress) {
  options.check();
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
  std::vector<SetTruth> truths;
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
    truths.push_back({job.set, job.shows, truth_of(job.scene, job.marks, views)});
    report.marks += static_cast<int>(job.marks.size());
    for (const TrueMark& mark : truths.back().marks) {
      for (const TrueMarkView& view : mark.views) report.whole_views += view.is_whole() ? 1 : 0;
    }
    if (progress)
      progress(static_cast<double>(truths.size()) / static_cast<double>(jobs.size()), job.set);
  }
  write_truth(folder / "truth.json", rig, cameras, truths);
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
