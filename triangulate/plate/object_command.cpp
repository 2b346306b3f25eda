// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "core/error.hpp"
#include "core/fields/records.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "triangulate/plate/ending.hpp"
#include "triangulate/plate/measured_scene.hpp"

namespace drape::triangulate {

namespace fs = std::filesystem;

namespace {

struct ObjectArguments {
  fs::path detections, calibration, scene, out;
  std::optional<fs::path> scene_out;
  std::string set;
  int object = 1;
  double floor_px = 0;
  PlateOnObject lies;
};

void fields(Fields& f, ObjectArguments& a) {
  f(Field{"detections", "detections.json of the plate"}.called("DETECTIONS"), a.detections);
  f({"calibration", "calibration.json of the rig"}, a.calibration);
  f({"set", "frame set that shows the plate"}, a.set);
  f({"scene", "scene.toml that states the object"}, a.scene);
  f.otherwise({"object", "number of the object in the scene, from 1", 1, 1}, a.object);
  fields(f, a.lies);
  f.otherwise({"floor_px", "error of a dot's centre beyond its detection's own, px", 1, 0},
              a.floor_px);
  f.if_any({"scene_out", "scene.toml to write: the scene with the object at its measured position"},
           a.scene_out);
  f({"out", "object.json to write"}, a.out);
}

}  // namespace

int object_command(int argc, char** argv) {
  const auto run = [](const ObjectArguments& given, const std::vector<std::string>& words,
                      const CommonOptions& common) {
    StepFiles files{{given.out}, {given.detections, given.calibration, given.scene}};
    if (given.scene_out) {
      require_own_scene(*given.scene_out);
      files.outputs.push_back(*given.scene_out);
    }
    RunRecord record("drape-triangulate", words, run_record_path(given.out), files);
    const Scene scene = read_scene(given.scene);
    const auto index = static_cast<std::size_t>(given.object) - 1;
    if (index >= scene.obstacles.size())
      throw usage_error(fmt::format("the scene has {} objects", scene.obstacles.size()),
                        "give --object from 1 on");
    const Detections detections = read_detections(given.detections);
    const Calibration calibration = read_calibration(given.calibration);
    const PlatePose plate = plate_pose(detections, calibration, given.set, given.floor_px);
    const auto values =
        object_values(plate, given.lies, scene.obstacles[index], scene.uncertainty_of(index));
    const std::string name = fmt::format("{}, object {}", given.scene.string(), given.object);
    std::vector<std::string> against;
    if (calibration.no_go) against.push_back("the calibration is NO-GO: " + *calibration.no_go);
    if (const auto reason = detections.reason_against({given.set})) against.push_back(*reason);
    // A scene file cannot state that a position comes from a NO-GO measurement.
    if (given.scene_out && !against.empty())
      throw bad_input("no scene is written from a place that is not measured: " + against.front(),
                      {.file = given.detections.string(), .set = given.set},
                      "mend that first, or leave --scene-out out to see the place");
    for (const std::string& text : contradictions_of(values, name)) against.push_back(text);
    if (const auto why = why_not_edge_on_edge(detections.lattice, given.lies,
                                              scene.obstacles[index], scene.uncertainty_of(index)))
      against.push_back(name + ": " + *why);
    write_record(given.out,
                 MeasuredObject{values, against, plate.dots, plate.rms_px, plate.chi2_per_dof});
    if (given.scene_out) {
      write_durable(*given.scene_out, measured_scene(given.scene, index + 1, values,
                                                     fs::absolute(*given.scene_out).parent_path()));
      // Reads the new scene, which was edited line by line, to detect an unexpected layout.
      static_cast<void>(read_scene(*given.scene_out));
    }
    record.option("set", given.set);
    return finish(ending_of(values, plate, name, against), common, record);
  };
  return run_command<ObjectArguments>(
      argc, argv, "drape-triangulate object",
      "Measures the position of an object from a set that shows it with its plate of tags and "
      "without cloth "
      "(`drape print object-tags`).\nNO-GO where the scene states another place.\n\n"
      "  drape object C/plate.json --calibration calibration.json --set object_C --scene C.toml",
      run);
}

}  // namespace drape::triangulate
