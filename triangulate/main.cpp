// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "core/fields/records.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "triangulate/ending.hpp"
#include "triangulate/guards/guards.hpp"
#include "triangulate/plate/object_pose.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {

namespace fs = std::filesystem;

namespace {

struct TriangulateArguments {
  fs::path detections, calibration, out;
  std::optional<fs::path> scene;
  std::vector<fs::path> objects, others;
  std::string set;
  std::optional<std::string> repeat, face;
  TriangulateOptions options;
};

void fields(Fields& f, TriangulateArguments& a) {
  f(Field{"detections", "detections.json of the cloth"}.called("DETECTIONS"), a.detections);
  f({"calibration", "calibration.json of the rig"}, a.calibration);
  f({"set", "frame set to measure"}, a.set);
  f.if_any({"scene", "scene.toml: NO-GO if the marks contradict its objects, table or fabric"},
           a.scene);
  f.if_any(Field{"object",
                 "object.json of a tag plate (drape object): NO-GO if it contradicts the scene"}
               .per_flag(),
           a.objects);
  f.if_any(Field{"repeat", "name of this laying of the drape, kept in the sheet; needs --scene"}
               .plain_name(),
           a.repeat);
  f.if_any(Field{"other_scene", "another scene of the rig: named if the marks agree only with it"}
               .per_flag(),
           a.others);
  f.if_any({"face", "side of the cloth that faces up; with --repeat"}, a.face);
  f({"out", "sheet.ply to write, with sheet.json beside it"}, a.out);
  fields(f, a.options);
}

/// True if the marks of the set do not contradict another scene with the same print.
bool agrees_with_other(const Detections& detections, const Calibration& calibration,
                       const std::string& set, const TriangulateOptions& other) {
  try {
    require_detected_print(detections.lattice, *other.scene);
  } catch (const Error&) {
    return false;
  }
  return drape::triangulate::triangulate(detections, calibration, set, other).report.no_go.empty();
}

}  // namespace

int object_command(int argc, char** argv);
int points_command(int argc, char** argv);

int triangulate_command(int argc, char** argv) {
  const auto run = [](TriangulateArguments& given, const std::vector<std::string>& words,
                      const CommonOptions& common) {
    TriangulateOptions& options = given.options;
    options.threads = thread_count(common);
    StepFiles files{{fs::path(given.out).replace_extension(".ply"),
                     fs::path(given.out).replace_extension(".json")},
                    {given.detections, given.calibration}};
    if (given.scene) files.inputs.push_back(*given.scene);
    files.inputs.insert(files.inputs.end(), given.objects.begin(), given.objects.end());
    RunRecord record("drape-triangulate", words, run_record_path(given.out), files);
    if (given.scene) options.scene = read_scene(*given.scene);
    for (const Obstacle& object :
         options.scene ? options.scene->obstacles : std::vector<Obstacle>{})
      if (const auto* mesh = std::get_if<MeshObject>(&object)) record.input(mesh->file);
    if (given.repeat ? !given.scene : given.face.has_value())
      throw usage_error("a repeat is named without its drape", "give --repeat, --scene and --face");
    for (const fs::path& file : given.objects)
      for (const std::string& text : read_record<MeasuredObject>(file).contradictions)
        options.contradictions.push_back(text);
    const Detections detections = read_detections(given.detections);
    if (options.scene) require_detected_print(detections.lattice, *options.scene);
    const Calibration calibration = read_calibration(given.calibration);
    TriangulateResult result =
        drape::triangulate::triangulate(detections, calibration, given.set, options);
    // Other scenes are inputs only if the set's own scene is contradicted.
    if (options.scene && !result.report.no_go.empty()) {
      for (const fs::path& file : given.others) {
        TriangulateOptions other = options;
        other.scene = read_scene(file);
        record.input(file, other.scene->document.sha256());
        if (!agrees_with_other(detections, calibration, given.set, other)) continue;
        result.report.no_go.front() +=
            fmt::format("; the marks agree with {} (drape {}): which drape does set {} show?",
                        file.string(), other.scene->name, given.set);
        result.sheet.no_go = result.report.no_go.front();
      }
    }
    auto& source = std::get<MeasuredSource>(result.sheet.source);
    source.detections_sha256 = detections.document.sha256();
    source.calibration_sha256 = calibration.document.sha256();
    for (const Document* read : {&detections.document, &calibration.document})
      record.input(read->file(), read->sha256());
    if (options.scene) {
      record.input(*given.scene, options.scene->document.sha256());
      note_scene(source, *options.scene,
                 {options.scene->name, given.repeat.value_or(""), given.face.value_or("")});
    }
    write_sheet(given.out, result.sheet);
    record.option("set", given.set);
    for (const auto& [name, value] : flat(value_of(options))) record.option(name, value);
    return finish(ending_of(result, options, given.out), common, record);
  };
  return run_command<TriangulateArguments>(
      argc, argv, "drape-triangulate",
      "Triangulates the marks of a cloth from two or more calibrated views", run);
}

}  // namespace drape::triangulate

int main(int argc, char** argv) {
  using namespace drape::triangulate;
  return drape::run_stage(
      argc, argv, triangulate_command,
      {{"object", object_command, "measures the position of an object by its plate of tags"},
       {"points", points_command, "makes a sheet of points that another instrument measured"}});
}
