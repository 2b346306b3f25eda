// SPDX-License-Identifier: Apache-2.0
#include "compare/programs/drapemeter_options.hpp"

#include "core/calibration.hpp"
#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;
using Scale = std::function<PictureScale(const Silhouette&, const std::filesystem::path&)>;

/// The point of a horizontal plane that a camera sees at a pixel: takes out lens and tilt.
Scale scale_of_camera(const DrapemeterArguments& arguments) {
  const Calibration calibration = read_calibration(*arguments.calibration);
  if (calibration.no_go)
    throw bad_input("the calibration is NO-GO: " + *calibration.no_go,
                    {.file = arguments.calibration->string(), .field = "no_go"}, "calibrate again");
  const Camera camera = calibration.camera(arguments.camera).camera;
  const double z_m = arguments.plane_z_mm * mm;
  return [camera, z_m](const Silhouette& silhouette, const std::filesystem::path& file) {
    const Where where{.file = file.string(), .camera = camera.name};
    if (silhouette.width_px != camera.model.width_px ||
        silhouette.height_px != camera.model.height_px)
      throw bad_input("the picture has another size than the calibrated camera's", where,
                      "give the picture as the camera made it");
    const auto world = [camera, z_m, where](const Vector2d& p) {
      const auto ray = unproject(camera.model, {p.x(), -p.y()});
      const Vector3d from = centre_in_world(camera);
      const Vector3d along =
          ray ? Vector3d(camera.cam_from_world.rotation.transpose() * *ray) : Vector3d::Zero();
      if (std::abs(along.z()) < 1e-6)
        throw bad_input("a point of the hem does not meet the plane", where, "check --plane-z-mm");
      return Vector2d((from + (z_m - from.z()) / along.z() * along).head<2>());
    };
    return PictureScale{world, std::nullopt,
                        "the calibrated camera " + camera.name + " on a horizontal plane"};
  };
}

Scale scale_of(const DrapemeterArguments& arguments, double disc_m) {
  const int given = arguments.mm_per_px.has_value() + arguments.disc_picture.has_value() +
                    arguments.calibration.has_value() + arguments.disc_hole +
                    !arguments.ruler.empty();
  if (given > 1)
    throw usage_error("the scale is given in more than one form",
                      "keep one of --mm-per-px, --ruler, --disc-picture, --disc-hole, "
                      "--calibration");
  if (arguments.calibration) return scale_of_camera(arguments);
  if (arguments.disc_hole) {
    return [disc_m](const Silhouette& silhouette, const std::filesystem::path& file) {
      return scale_of_disc(silhouette.hole, silhouette.hole, silhouette.hole, disc_m,
                           file.string());
    };
  }
  if (given == 0) return {};
  PictureScale scale;
  if (arguments.mm_per_px) {
    scale = scale_of_pixel(*arguments.mm_per_px * mm, std::nullopt);
  } else if (arguments.disc_picture) {
    const Silhouette disc = read_silhouette(*arguments.disc_picture);
    scale = scale_of_disc(disc.quarter, disc.half, disc.three_quarters, disc_m,
                          arguments.disc_picture->string());
  } else {
    const std::vector<double>& r = arguments.ruler;
    scale = scale_of_ruler({r[0], r[1]}, {r[2], r[3]}, r[4] * mm);
  }
  return [scale](const Silhouette&, const std::filesystem::path&) { return scale; };
}

}  // namespace

void add_options(Command& app, DrapemeterArguments& arguments) {
  app.add_option("INPUT", arguments.inputs,
                 "pictures of hems, folders of them, sheets or meshes (PLY, OBJ in mm), or a CSV "
                 "of radii (r000, r005 .. in mm)")
      ->required();
  app.add_option("--compare", arguments.compared,
                 "virtual hem, or a folder or table of them, again for another: is it inside the "
                 "repeats of the inputs?")
      ->one_per_flag();
  app.add_option("--significance", arguments.significance,
                 "of that verdict: part of real repeats that would be called outside")
      ->range(0.001, 0.5)
      ->capture_default_str();
  app.add_option("--out", arguments.out, "folder for hems.csv and hems.json");
  app.add_option("--geometry", arguments.geometry,
                 "disc 180 mm with specimen 240, 300, 360 mm (ISO 9073-9, BS 5058), or 127 with "
                 "254 mm (JIS L 1096)")
      ->one_of({"iso-240", "iso-300", "iso-360", "jis-254"})
      ->capture_default_str();
  app.add_option("--disc-mm", arguments.disc_mm,
                 "another disc's diameter; to be stated for sheets of a bench, which may hang over "
                 "any object")
      ->positive();
  app.add_option("--specimen-mm", arguments.specimen_mm,
                 "another specimen's diameter; a sheet's specimen is its own flat area")
      ->positive();
  app.add_option("--names", arguments.names,
                 "where fabric, sample, face and repeat stand in the files' paths, such as "
                 "\"{fabric}/{sample}_{face}_{repeat}\"; * is any text");
  app.add_option("--mm-per-px", arguments.mm_per_px, "scale of the pictures")->positive();
  app.add_option("--ruler", arguments.ruler,
                 "scale by a ruler: X1 Y1 X2 Y2 of two points in px, and its length in mm")
      ->expected(5, 5);
  app.add_option("--disc-picture", arguments.disc_picture,
                 "scale by a picture of the bare disc from the same place (a small tilt is taken "
                 "out)");
  app.add_flag(
      "--disc-hole", arguments.disc_hole,
      "scale by the disc on top of the cloth, seen as a round hole in each silhouette: its "
      "grey must be nearer to the table's than to the cloth's");
  app.add_option("--calibration", arguments.calibration,
                 "scale by calibration.json (takes out lens and tilt), with --camera and "
                 "--plane-z-mm");
  app.add_option("--camera", arguments.camera, "name of the calibrated camera");
  app.add_option("--plane-z-mm", arguments.plane_z_mm, "height of the hem in the world")
      ->capture_default_str();
  app.add_option("--scale-u-percent", arguments.scale_u_percent,
                 "standard uncertainty of the scale, beside what the scale's own source gives")
      ->positive();
}

HemReadOptions read_options(const DrapemeterArguments& arguments, int threads) {
  HemReadOptions options;
  options.geometry = drapemeter_geometry(arguments.geometry);
  if (arguments.disc_mm || arguments.specimen_mm) {
    options.geometry.name = "own";
    options.geometry.disc_m = arguments.disc_mm.value_or(options.geometry.disc_m / mm) * mm;
    options.geometry.specimen_m =
        arguments.specimen_mm.value_or(options.geometry.specimen_m / mm) * mm;
  }
  options.geometry.check();
  options.disc_stated = arguments.disc_mm.has_value();
  options.specimen_stated = arguments.specimen_mm.has_value();
  options.scale = scale_of(arguments, options.geometry.disc_m);
  if (arguments.scale_u_percent) options.scale_u = *arguments.scale_u_percent * units::percent;
  options.names = arguments.names;
  options.threads = threads;
  return options;
}

}  // namespace drape::compare
