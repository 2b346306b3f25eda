// SPDX-License-Identifier: Apache-2.0
#include "front/new.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <unistd.h>

#include <iostream>
#include <set>
#include <sstream>

#include "core/files/new_folder.hpp"
#include "core/matching.hpp"
#include "core/program/words.hpp"
#include "front/check.hpp"
#include "front/process.hpp"

namespace drape {

/// Files of a new bench in new_bench/, by name; the build writes their text into the program.
const std::map<std::string, std::string_view>& new_bench_files();

namespace {

namespace fs = std::filesystem;

/// Quotes text for TOML, whose basic strings use the escapes of JSON.
std::string toml_quoted(const std::string& text) {
  return one_line(Value(text));
}

/// Part of a file of a new bench, with its values filled in.
template <class... Values>
std::string part(const std::string& name, const Values&... values) {
  return fmt::format(fmt::runtime(new_bench_files().at("part/" + name + ".toml")), values...);
}

struct NewDrape {
  std::string name, kind;
  double size_mm = 0;
};

void check_name(const std::string& name, const char* what) {
  try {
    require_plain_name(name, {});
  } catch (const Error& error) {
    throw usage_error(fmt::format("`{}` cannot name a {}", name, what), error.what_to_do());
  }
}

/// Splits an argument of this form; throws Error(usage) for any other.
std::smatch matched(const std::string& text, const char* form, const char* what,
                    const char* remedy) {
  std::smatch parts;
  if (!has_form(text, parts, std::regex(form)))
    throw usage_error(fmt::format("`{}` is no {}", text, what), remedy);
  return parts;
}

NewDrape drape_of(const std::string& text) {
  const std::smatch parts =
      matched(text, "([^=]+)=(sphere|box|hung):((?!0+(?:\\.0+)?$)[0-9]+(?:\\.[0-9]+)?)", "drape",
              "write NAME=sphere:DIAMETER_MM, NAME=box:EDGE_MM or NAME=hung:DISTANCE_MM, "
              "e.g. A=sphere:90");
  check_name(parts[1], "drape");
  if (is_name_of_a_run(parts[1]))
    throw usage_error(
        fmt::format("`{}` cannot name a drape: a run writes its own files there", parts[1].str()),
        "give the drape another name");
  return {parts[1], parts[2], std::stod(parts[3])};
}

std::vector<NewDrape> drapes_of(const NewRigOptions& options) {
  std::vector<NewDrape> drapes;
  std::set<std::string> names;
  for (const std::string& text : options.drapes) {
    drapes.push_back(drape_of(text));
    if (!names.insert(drapes.back().name).second)
      throw usage_error(fmt::format("two drapes are called `{}`", drapes.back().name),
                        "give each its own name");
  }
  return drapes;
}

/// Sets of the stages with their heights in mm.
std::vector<std::pair<std::string, double>> stages_of(const NewRigOptions& options) {
  std::vector<std::pair<std::string, double>> stages;
  if (options.stages.empty())
    for (const double z_mm : options.stage_z_mm)
      stages.emplace_back(fmt::format("stage_{:02}", stages.size()), z_mm);
  for (const std::string& text : options.stages) {
    const std::smatch parts = matched(text, "([^=]+)=(-?[0-9]+(?:\\.[0-9]+)?)", "stage",
                                      "write NAME=Z_MM, e.g. stage_z000=0");
    check_name(parts[1], "stage");
    stages.emplace_back(parts[1], std::stod(parts[2]));
  }
  return stages;
}

/// The [[pin]] tables of each drape by its name; throws for a pin of no drape.
std::map<std::string, std::string> pins_of(const NewRigOptions& options,
                                           const std::vector<NewDrape>& drapes) {
  std::map<std::string, std::string> pins;
  for (const std::string& pin : options.pins) {
    const std::smatch parts = matched(pin, "([^=]+)=([0-9]+(?:\\.[0-9]+)?),([0-9]+(?:\\.[0-9]+)?)",
                                      "held point", "write DRAPE=WARP_MM,WEFT_MM, e.g. B=0,100");
    if (std::ranges::find(drapes, parts[1].str(), &NewDrape::name) == drapes.end())
      throw usage_error(fmt::format("`--pin {}` names no drape", pin), "name one of --drape");
    pins[parts[1]] +=
        fmt::format("\n[[pin]]\nat_material_mm = [{}, {}]\n", parts[2].str(), parts[3].str());
  }
  return pins;
}

/// "stem_00", "stem_01", ... as TOML strings.
std::vector<std::string> numbered(const std::string& stem, int count) {
  std::vector<std::string> texts;
  for (int i = 0; i < count; ++i) texts.push_back(fmt::format("\"{}_{:02}\"", stem, i));
  return texts;
}

/// A camera in the output of `drape-capture cameras --json`.
struct FoundCamera {
  std::string name, backend, device, host_address, vendor, model;
  std::optional<int> width_px, height_px;
  std::string why_not_asked;
};
void fields(Fields& f, FoundCamera& camera) {
  f({"backend", "kind of camera"}, camera.backend);
  f({"device", "device in cameras.toml"}, camera.device);
  f.otherwise({"host_address", "IP address of the network card"}, camera.host_address);
  f.otherwise({"vendor", "maker"}, camera.vendor);
  f.otherwise({"model", "model"}, camera.model);
  f({"width_px", "width of its pictures"}, camera.width_px);
  f({"height_px", "height of its pictures"}, camera.height_px);
  f.otherwise({"why_not_asked", "fault where the size is not known"}, camera.why_not_asked);
}
struct FoundCameras {
  std::vector<FoundCamera> cameras;
};
void fields(Fields& f, FoundCameras& list) {
  f.if_any({"cameras", "cameras that answer"}, list.cameras);
}

std::vector<FoundCamera> found_cameras() {
  const StepResult result = result_of_stage("cameras", {"--json", "--sizes"});
  std::fputs(result.errors.c_str(), stderr);
  FoundCameras found;
  if (!result.output.empty())
    throw_if_any(
        faults_of_reading(Document(Syntax::json, json_value(result.output)), walk_through(found)));
  if (found.cameras.empty())
    throw Error(ErrorKind::device, "no camera answers", {},
                "check power, cable and network card; or give --cameras with names");
  for (std::size_t i = 0; i < found.cameras.size(); ++i) {
    FoundCamera& camera = found.cameras[i];
    camera.name = fmt::format("cam{}", i);
    if (!camera.width_px || !camera.height_px)
      throw Error(ErrorKind::device, "a camera does not say how large its pictures are",
                  {.field = "device " + camera.device}, camera.why_not_asked);
  }
  return found.cameras;
}

std::string cameras_text(const std::vector<FoundCamera>& cameras) {
  std::string text = part("cameras");
  for (const FoundCamera& c : cameras) {
    text += fmt::format("\n# {} {}\n[[camera]]\nname = \"{}\"\nbackend = \"{}\"\ndevice = {}\n",
                        c.vendor, c.model, c.name, c.backend, toml_quoted(c.device));
    if (!c.host_address.empty())
      text += fmt::format("host_address = {}\n", toml_quoted(c.host_address));
    text += "# exposure_us = 8000.0\n";
  }
  return text;
}

/// Requires what `drape check` requires of a bench: positions in space, and the world's own height.
void check_plan(const NewRigOptions& options) {
  std::set<double> heights;
  std::set<std::string> sets;
  const auto stages = stages_of(options);
  for (const auto& [set, z_mm] : stages) {
    heights.insert(z_mm);
    sets.insert(set);
  }
  if (sets.size() != stages.size())
    throw usage_error("--stage names a set twice", "give each height a set of its own");
  if (options.cameras.size() < 2 && options.cameras != std::vector<std::string>{"auto"})
    throw usage_error("--cameras names one", "name two or more: a point in space needs two views");
  const bool few = options.free_poses == 0 && heights.size() < 2;
  if (few || heights.size() != stages.size() || !heights.contains(0.0))
    throw usage_error("--stages-mm names a height twice, lacks 0, or is one without free poses",
                      "give each height once, and 0, which defines the world");
}

std::string rig_text(const NewRigOptions& options, const std::string& name,
                     const std::vector<NewDrape>& drapes, std::vector<FoundCamera> found) {
  const std::smatch size = matched(options.size_px, "([1-9][0-9]{0,5})x([1-9][0-9]{0,5})",
                                   "image size", "write WIDTHxHEIGHT in pixels, e.g. 1600x1200");
  std::vector<std::string> scenes;
  for (const NewDrape& drape : drapes)
    scenes.push_back(toml_quoted("scenes/" + drape.name + ".toml"));
  std::string text =
      part("rig", fmt::arg("name", toml_quoted(name)), fmt::arg("scenes", fmt::join(scenes, ", ")),
           fmt::arg("poses", fmt::join(numbered("pose", options.free_poses), ", ")));
  for (const auto& [set, z_mm] : stages_of(options))
    text += part("stage", fmt::arg("set", toml_quoted(set)), fmt::arg("z", z_mm));
  std::set<std::string> names;
  for (const std::string& camera : found.empty() ? options.cameras : std::vector<std::string>()) {
    check_name(camera, "camera");
    if (!names.insert(camera).second)
      throw usage_error(fmt::format("two cameras are called `{}`", camera),
                        "give each its own name");
    FoundCamera& one = found.emplace_back();
    one.name = camera;
    one.width_px = std::stoi(size[1]);
    one.height_px = std::stoi(size[2]);
  }
  for (const FoundCamera& camera : found)
    text += part("camera", fmt::arg("name", toml_quoted(camera.name)),
                 fmt::arg("width", *camera.width_px), fmt::arg("height", *camera.height_px));
  return text;
}

/// Text of a scene; a hung drape without pins is held by two marks of its upper edge.
std::string scene_text(const NewDrape& drape, const std::string& pins) {
  const std::string head = part("scene", fmt::arg("name", toml_quoted(drape.name)),
                                fmt::arg("set", toml_quoted("drape_" + drape.name)));
  if (drape.kind == "hung")
    return head + part("hung", fmt::arg("size", drape.size_mm)) +
           (pins.empty() ? part("mark_pins") : pins);
  const std::string size = fmt::format("{:.1f}", drape.size_mm);
  return head + part("flat_start") + part(drape.kind, fmt::arg("size", size)) + pins;
}

}  // namespace

/// Asks a person at a terminal for arguments missing on the command line.
static NewRigOptions with_answers(NewRigOptions options) {
  const bool is_asked = ::isatty(STDIN_FILENO) == 1 && ::isatty(STDERR_FILENO) == 1;
  const auto ask = [&](const char* question, const char* option) {
    if (!is_asked) throw usage_error(fmt::format("{} is required", option), "see `drape help new`");
    print_message(std::string(question) + ": ");
    std::string line;
    std::getline(std::cin, line);
    std::vector<std::string> words;
    std::istringstream text(line);
    for (std::string word; text >> word;) words.push_back(word);
    return words;
  };
  const bool is_whole = !options.cameras.empty() && !options.drapes.empty();
  if (options.cameras.empty())
    options.cameras =
        ask("names of the cameras, e.g. cam0 cam1 (auto: those that answer)", "--cameras");
  if (options.drapes.empty())
    options.drapes = ask("drapes, e.g. A=sphere:90 B=hung:180 C=box:128 (mm)", "--drape");
  if (is_whole || !options.stages.empty()) return options;
  options.stages =
      ask("sets of the target and its heights in mm, e.g. stage_z000=0 stage_z030=30 "
          "(Enter: 0, 30, 60, 90)",
          "--stage");
  return options;
}

void fields(Fields& f, NewRigOptions& options) {
  f(Field{"rig", "folder to make; its last part names the rig"}.called("RIG"), options.folder);
  f.otherwise(Field{"cameras", "names, two or more; or auto: those that answer"}.plain_name(),
              options.cameras);
  f.otherwise({"size_px", "image size of the cameras"}, options.size_px);
  f.otherwise(Field{"drape", "NAME=sphere:DIAMETER_MM, NAME=box:EDGE_MM or NAME=hung:DISTANCE_MM"}
                  .per_flag(),
              options.drapes);
  f.otherwise({"stages_mm", "heights of the target"}, options.stage_z_mm);
  f.otherwise(
      Field{"stage", "NAME=Z_MM: name and height of a stage, instead of --stages-mm"}.per_flag(),
      options.stages);
  f.otherwise(
      Field{"pin", "DRAPE=WARP_MM,WEFT_MM: held point of the cloth, from its corner"}.per_flag(),
      options.pins);
  f.otherwise({"free_poses", "sets with the target anywhere", 1, 0, 99}, options.free_poses);
}

int make_new_rig(const NewRigOptions& given, const CommonOptions& common) {
  const NewRigOptions options = with_answers(given);
  const fs::path folder =
      options.folder.has_filename() ? options.folder : options.folder.parent_path();
  const std::string name = folder.filename().string();
  check_name(name, "rig");
  const std::vector<NewDrape> drapes = drapes_of(options);
  check_plan(options);
  std::map<std::string, std::string> pins = pins_of(options, drapes);
  std::vector<FoundCamera> found;
  if (options.cameras == std::vector<std::string>{"auto"} && !fs::exists(folder))
    found = found_cameras();
  const std::string rig = rig_text(options, name, drapes, found);
  std::vector<std::pair<std::string, std::string>> files;
  for (const auto& [file, text] : new_bench_files())
    if (file.starts_with("whole/")) files.emplace_back(file.substr(6), text);
  for (const NewDrape& drape : drapes)
    files.emplace_back("scenes/" + drape.name + ".toml", scene_text(drape, pins[drape.name]));
  if (!found.empty()) files.emplace_back("cameras.toml", cameras_text(found));
  files.emplace_back("rig.toml", rig);
  write_new_folder(folder, files);
  Ending ending;
  ending.verdict = "the files of a new bench are written";
  ending.numbers = {{"rig", folder.string()},
                    {"to fill in",
                     "the lines that begin with `# name = value`: what only you can "
                     "measure; `drape check` names all that are missing"},
                    {"curves", (folder / "fabrics" / "cloth").string()}};
  ending.next_command = fmt::format("drape check {}", shell_word(folder.string()));
  return finish(ending, common);
}

}  // namespace drape
