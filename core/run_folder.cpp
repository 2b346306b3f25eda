// SPDX-License-Identifier: Apache-2.0
#include "core/run_folder.hpp"

#include <fmt/format.h>

#include "core/files/files.hpp"
#include "core/program/child.hpp"

namespace drape {

namespace fs = std::filesystem;

std::vector<Laying> layings_of(const Scene& scene, const Rig& rig) {
  std::vector<Laying> all = {{scene.name, scene.set, scene.set, {}}};
  for (const DrapeRepeat& one : rig.repeats) {
    if (one.scene != scene.name) continue;
    Laying laying{one.scene, one.set, one.repeat, one.face, one.set == scene.set, true};
    if (laying.is_own)
      all.front() = std::move(laying);
    else
      all.push_back(std::move(laying));
  }
  return all;
}

std::vector<std::string> object_arguments(const RunFolder& files, const Scene& scene,
                                          const ObjectTags& plate, std::size_t located,
                                          const fs::path& detections, const fs::path& calibration) {
  std::vector<std::string> words =
      words_of(detections, "--calibration", calibration, "--set", plate.set, "--scene",
               files.scene(scene, located), "--object", plate.object, "--scene-out",
               files.scene(scene, located + 1), "--out", files.object(scene, plate.object));
  for (const auto& [option, value] : plate.lies())
    words.insert(words.end(), {option, fmt::format("{}", value)});
  return words;
}

std::string text_in(const fs::path& folder, Rig rig) {
  std::vector<fs::path*> files = {&rig.target_file, &rig.print_file, &rig.recording};
  for (fs::path& scene : rig.scenes) files.push_back(&scene);
  for (fs::path* file : files)
    if (!file->empty()) *file = fs::proximate(fs::absolute(*file), fs::absolute(folder));
  return text_of(rig);
}

void write_where_new(const fs::path& file, const std::string& text) {
  if (!fs::is_regular_file(file) || read_text(file) != text) write_durable(file, text);
}

}  // namespace drape
