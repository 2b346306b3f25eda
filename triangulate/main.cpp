// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "triangulate/ending.hpp"
#include "triangulate/guards/guards.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {

namespace fs = std::filesystem;

namespace {

void add_options(Command& app, TriangulateOptions& options) {
  app.add_option("--min-marks", options.min_marks, "NO-GO when fewer marks are measured");
  app.add_option("--max-sigmas", options.max_sigmas,
                 "views that miss each other by more standard deviations disagree");
  app.add_option("--max-stretch", options.max_stretch,
                 "largest distance of neighbours along warp and weft, as a factor of the print's");
  app.add_option("--min-angle-deg", options.min_angle_deg,
                 "smallest angle between the rays of a mark");
  app.add_option("--floor-px", options.floor_px,
                 "error of a dot's centre beyond its detection's own, px");
  app.add_option("--doubt-mm", options.doubt_mm,
                 "marks less certain than this in space are named as doubtful, mm");
  app.add_option("--doubt-sigmas", options.doubt_sigmas,
                 "so are marks whose views miss each other by more standard deviations");
  app.add_flag("!--no-dot-shape", options.correct_dot_shape,
               "take the centroid of a dot's image for the image of its centre");
  app.add_flag("!--no-islands", options.merge_islands,
               "leave pieces of lattice without labels as they are");
}

}  // namespace

int object_command(int argc, char** argv);

int triangulate_command(int argc, char** argv) {
  Command app("Places the marks of a cloth in space from two or more calibrated views",
              "drape-triangulate");
  CommonOptions common;
  TriangulateOptions options;
  fs::path detections_file, calibration_file, scene_file, out;
  std::vector<fs::path> object_files;
  std::string set;
  RepeatId repeat;
  add_common_options(app, common);
  app.add_option("DETECTIONS", detections_file, "detections.json of the cloth")->required();
  app.add_option("--calibration", calibration_file, "calibration.json of the rig")->required();
  app.add_option("--set", set, "frame set to measure")->required();
  app.add_option("--scene", scene_file,
                 "scene.toml: NO-GO where the marks contradict its objects, table or fabric");
  app.add_option("--object", object_files,
                 "object.json of a plate of tags (drape object): NO-GO where it contradicts")
      ->one_per_flag();
  app.add_option("--repeat", repeat.name,
                 "name of this laying of the drape, kept in the sheet; needs --scene");
  app.add_option("--face", repeat.face, "side of the cloth that lies up; with --repeat");
  app.add_option("--out", out, "sheet.ply to write, with sheet.json beside it")->required();
  add_options(app, options);
  return run_program(app, argc, argv, common, [&] {
    options.check();
    options.threads = thread_count(common);
    StepFiles files{
        {fs::path(out).replace_extension(".ply"), fs::path(out).replace_extension(".json")},
        {detections_file, calibration_file}};
    if (!scene_file.empty()) files.inputs.push_back(scene_file);
    files.inputs.insert(files.inputs.end(), object_files.begin(), object_files.end());
    RunRecord record("drape-triangulate", arguments_of(argc, argv), run_record_path(out), files);
    if (!scene_file.empty()) options.scene = read_scene(scene_file);
    for (const Obstacle& object :
         options.scene ? options.scene->obstacles : std::vector<Obstacle>{})
      if (const auto* mesh = std::get_if<MeshObject>(&object)) record.input(mesh->file);
    if (repeat.name.empty() ? !repeat.face.empty() : scene_file.empty())
      throw usage_error("a repeat is named without its drape", "give --repeat, --scene and --face");
    if (!repeat.name.empty()) require_plain_name(repeat.name, {.field = "--repeat"});
    for (const fs::path& file : object_files)
      for (const std::string& text : JsonNode::open(file, "object", 1).texts("contradictions"))
        options.contradictions.push_back(text);
    const Detections detections = read_detections(detections_file);
    if (options.scene) require_detected_print(detections.lattice, *options.scene);
    const Calibration calibration = read_calibration(calibration_file);
    TriangulateResult result =
        drape::triangulate::triangulate(detections, calibration, set, options);
    auto& source = std::get<MeasuredSource>(result.sheet.source);
    source.detections_sha256 = detections.document.sha256();
    source.calibration_sha256 = calibration.document.sha256();
    for (const Document* read : {&detections.document, &calibration.document})
      record.input(read->file(), read->sha256());
    if (options.scene) {
      record.input(scene_file, options.scene->document.sha256());
      note_scene(source, *options.scene, {options.scene->name, repeat.name, repeat.face});
    }
    write_sheet(out, result.sheet);
    note_options(record, options, set);
    return finish(ending_of(result, options, out), common, record);
  });
}

}  // namespace drape::triangulate

int main(int argc, char** argv) {
  using namespace drape::triangulate;
  return drape::run_stage(
      argc, argv, triangulate_command,
      {{"object", object_command, "where an object stands, by its plate of tags"}});
}
