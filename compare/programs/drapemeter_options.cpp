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

/// Scale by intersecting a pixel's ray with a horizontal plane: corrects lens and tilt.
Scale scale_of_camera(const DrapemeterArguments& arguments) {
  const Calibration calibration = read_calibration(*arguments.calibration);
  if (calibration.no_go)
    throw bad_input("the calibration is NO-GO: " + *calibration.no_go,
                    {.file = arguments.calibration->string(), .field = "no_go"}, "calibrate again");
  const Camera camera = calibration.camera(arguments.camera).camera;
  const double z_m = arguments.plane_z_m;
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
  const int given = arguments.m_per_px.has_value() + arguments.disc_picture.has_value() +
                    arguments.calibration.has_value() + arguments.disc_hole +
                    arguments.ruler.has_value();
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
  if (arguments.m_per_px) {
    scale = scale_of_pixel(*arguments.m_per_px, std::nullopt);
  } else if (arguments.disc_picture) {
    const Silhouette disc = read_silhouette(*arguments.disc_picture);
    scale = scale_of_disc(disc.quarter, disc.half, disc.three_quarters, disc_m,
                          arguments.disc_picture->string());
  } else {
    const std::array<double, 5>& r = *arguments.ruler;
    scale = scale_of_ruler({r[0], r[1]}, {r[2], r[3]}, r[4] * mm);
  }
  return [scale](const Silhouette&, const std::filesystem::path&) { return scale; };
}

}  // namespace

void fields(Fields& f, DrapemeterArguments& a) {
  f(Field{"input",
          "pictures of hems, folders of them, sheets or meshes (PLY, OBJ in mm), or a CSV of radii "
          "(r000, r005 .. in mm)"}
        .called("INPUT"),
    a.inputs);
  f.otherwise(Field{"compare",
                    "virtual hem, or folder or table of hems, to test against the repeats of the "
                    "inputs; can be given several times"}
                  .per_flag(),
              a.compared);
  f.otherwise(
      {"significance", "fraction of real repeats that this test would call outside", 1, 0.001, 0.5},
      a.significance);
  f({"out", "folder for hems.csv and hems.json"}, a.out);
  f.otherwise({"geometry",
               "disc 180 mm with specimen 240, 300, 360 mm (ISO 9073-9, BS 5058), or 127 with 254 "
               "mm (JIS L 1096)"},
              a.geometry);
  f({"disc_mm",
     "diameter of another disc; required for sheets of a bench, which may hang over any object", mm,
     above_zero},
    a.disc_m);
  f({"specimen_mm", "diameter of another specimen; a sheet has its own flat area instead", mm,
     above_zero},
    a.specimen_m);
  f.otherwise({"names",
               "positions of fabric, sample, face and repeat in the files' paths, such as "
               "\"{fabric}/{sample}_{face}_{repeat}\"; * matches any text"},
              a.names);
  f({"mm_per_px", "scale of the pictures", mm, above_zero}, a.m_per_px);
  f({"ruler", "scale from a ruler: X1 Y1 X2 Y2 of two points in px, and their distance in mm"},
    a.ruler);
  f({"disc_picture",
     "scale from a picture of the bare disc by the same camera (corrects a small tilt)"},
    a.disc_picture);
  f.otherwise({"disc_hole",
               "scale from the disc on top of the cloth, seen as a round hole in each silhouette: "
               "its grey must be nearer to the table's than to the cloth's"},
              a.disc_hole);
  f({"calibration",
     "scale from calibration.json (corrects lens and tilt), with --camera and --plane-z-mm"},
    a.calibration);
  f.otherwise({"camera", "name of the calibrated camera"}, a.camera);
  f.otherwise({"plane_z_mm", "height of the hem in the world", mm}, a.plane_z_m);
  f({"scale_u_percent", "standard uncertainty of the scale, in addition to that of its source",
     units::percent, above_zero},
    a.scale_u);
}

HemReadOptions read_options(const DrapemeterArguments& arguments, int threads) {
  HemReadOptions options;
  options.geometry = geometry_of(arguments.geometry);
  if (arguments.disc_m || arguments.specimen_m)
    options.geometry = {"own", arguments.disc_m.value_or(options.geometry.disc_m),
                        arguments.specimen_m.value_or(options.geometry.specimen_m)};
  options.geometry.check();
  options.disc_stated = arguments.disc_m.has_value();
  options.specimen_stated = arguments.specimen_m.has_value();
  options.scale = scale_of(arguments, options.geometry.disc_m);
  options.scale_u = arguments.scale_u;
  options.names = arguments.names;
  options.threads = threads;
  return options;
}

}  // namespace drape::compare
