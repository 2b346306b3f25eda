// SPDX-License-Identifier: Apache-2.0
#include "front/new.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <unistd.h>

#include <iostream>
#include <regex>
#include <set>
#include <sstream>

#include "core/error.hpp"
#include "core/fields/records.hpp"
#include "core/files/files.hpp"
#include "core/program/shell_word.hpp"
#include "front/check.hpp"
#include "front/process.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

/// Quotes text for TOML, whose basic strings use the escapes of JSON.
std::string toml_quoted(const std::string& text) {
  return one_line(Value(text));
}

constexpr const char* kRig = R"(schema = "drapebench/rig/1"
name = {name}
target = "target.toml"
print = "print.toml"
recording = "recording"
scenes = [{scenes}]

# What `drape run` simulates: spacing of the cloth's finest mesh, and line segments per Kawabata curve.
spacing_mm = 2.5
segments = [1, 5]

[calibration]
# Frame sets that show the target anywhere: tilted by 20 to 40 degrees, all over the images.
free_poses = [{poses}]

# Stages: the target parallel to the table, raised by z_mm; z_mm = 0 defines the world.
)";

constexpr const char* kStage = R"(
[[calibration.stage]]
set = {set}
z_mm = {z}
)";

constexpr const char* kCamera = R"(
[[camera]]
name = {name}
width_px = {width}
height_px = {height}
# From the sensor's data sheet: it only scales the focal length in mm, no measured point depends on it.
# pixel_pitch_um = [3.45, 3.45]
)";

constexpr const char* kTarget = R"(schema = "drapebench/target/1"
# Uncomment pitch_mm, and `drape print target target.toml --out target.pdf` prints it to scale. Glue it to a flat
# plate, then measure the print: printers scale. Frame: origin at the centre of the grid, x along the columns, y
# along the rows, z out of the printed face.
kind = "dot-grid"
rows = 9
cols = 12
# Measured over as many dots as a ruler or caliper spans, divided by their number.
# pitch_mm = 20.0
dot_diameter_mm = 8.0

[tags]
family = "tag36h11"
edge_mm = 10.0
)";

constexpr double kTargetTags_mm[][2] = {{-80, -50}, {80, -50}, {0, 10},
                                        {-80, 50},  {80, 50},  {100, -10}};
constexpr int kFirstTargetTag = 400;

constexpr const char* kPrint = R"(schema = "drapebench/print/1"
# `drape print cloth print.toml --out cloth.pdf` prints it to scale on transfer paper. A patch of 20 x 20 cm.
# Seen from the printed side with row 0 at the top: col 0 is at the left, tags are upright.
# Rows follow each other along the warp, columns along the weft.
rows = 11
cols = 11
# Uncomment to print, then put here what you measure on the cloth, over as many dots as a ruler spans.
# pitch_mm = 19.0
dot_diameter_mm = 3.0
patch_mm = [200.0, 200.0]   # along (warp, weft)
margin_mm = [5.0, 5.0]      # from the patch corner to mark (0, 0), along (warp, weft)

[tags]
family = "tag36h11"
edge_mm = 9.0
# Tag k sits in the centre of the cell between marks (row, col) and (row + 1, col + 1); its id is first_id + k.
first_id = 0
cells = [
)";

constexpr const char* kScene = R"(schema = "drapebench/scene/1"
name = {name}
set = {set}
fabric = "../fabrics/cloth.toml"
print = "../print.toml"
# The table's height in the world frame of the target's reference pose: minus the thickness of its plate.
# table_z_mm = -6.0
# Coulomb's coefficient of cloth on the object, from a tilting plane; 0 is the paper's case.
# friction = 0.4
)";

constexpr const char* kFlatStart = R"(
[start]
mode = "flat-from-measured"   # flat and horizontal above the object, placed by the measured marks
clearance_mm = 3.0
# What the cloth went through, for --internal-friction: "flat", "bent 1.5 per cm along warp",
# "draped 3 times"; last of all "shaken 5 times by 40 %".
# history = ["draped 3 times"]
)";

constexpr const char* kSphere = R"(
[[object]]
kind = "sphere"
diameter_mm = {size}
# x_mm = 0.0         # centre, measured in the world frame
# y_mm = 0.0
# z_bottom_mm = -6.0 # where it stands
# place_uncertainty_mm = 0.5 # one standard deviation of x, y, z; half a division of a ruler if absent
# size_uncertainty_mm = 0.5
)";

constexpr const char* kBox = R"(
[[object]]
kind = "box"
size_mm = [{size}, {size}, {size}]
# edge_radius_mm = 1.0 # no edge is sharp: a radius gauge, or the width of the gap under a square
# x_mm = 0.0         # centre of the base, measured in the world frame
# y_mm = 0.0
# z_bottom_mm = -6.0 # where it stands
# yaw_deg = 0.0      # of its edges from the world's x axis towards y
# place_uncertainty_mm = 0.5 # one standard deviation of x, y, z; half a division of a ruler if absent
# size_uncertainty_mm = 0.5
)";

constexpr const char* kHung = R"(
[start]
mode = "measured"   # the measured sheet itself; its pinned marks stay where they were measured

# Held {size} mm apart. A point between marks is at_material_mm = [warp, weft], from the corner beside
# mark (0, 0), in place of row and col.
)";

constexpr const char* kMarkPins = R"(
[[pin]]
row = 0
col = 0

[[pin]]
row = 0
col = 10
)";

constexpr const char* kFabric = R"(schema = "drapebench/fabric/1"
name = "cloth"
# areal_density_g_per_m2 = 138
# Name what was not measured on this very fabric, e.g. stand_ins = ["shear curves"]; reports show it.

# Kawabata curves (KES-FB), loading and unloading branch; each file begins with the names of its columns.
[tensile]
warp = "cloth/tensile_warp.csv"
weft = "cloth/tensile_weft.csv"

[shear]
warp = "cloth/shear_warp.csv"
weft = "cloth/shear_weft.csv"

[bending]
warp = "cloth/bending_warp.csv"
weft = "cloth/bending_weft.csv"
)";

struct CurveFile {
  const char* name;
  const char* headings;
};
constexpr CurveFile kCurveFiles[] = {
    {"tensile", "strain_percent,loading_force_gf_per_cm,unloading_force_gf_per_cm\n"},
    {"shear", "shear_angle_deg,loading_force_gf_per_cm,unloading_force_gf_per_cm\n"},
    {"bending", "curvature_per_cm,loading_moment_gf_cm_per_cm,unloading_moment_gf_cm_per_cm\n"},
};

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

NewDrape drape_of(const std::string& text) {
  std::smatch parts;
  static const std::regex kForm("([^=]+)=(sphere|box|hung):([0-9]+(?:\\.[0-9]+)?)");
  if (!std::regex_match(text, parts, kForm) || std::stod(parts[3]) <= 0)
    throw usage_error(fmt::format("`{}` is no drape", text),
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
  static const std::regex kForm("([^=]+)=(-?[0-9]+(?:\\.[0-9]+)?)");
  for (const std::string& text : options.stages) {
    std::smatch parts;
    if (!std::regex_match(text, parts, kForm))
      throw usage_error(fmt::format("`{}` is no stage", text),
                        "write NAME=Z_MM, e.g. stage_z000=0");
    check_name(parts[1], "stage");
    stages.emplace_back(parts[1], std::stod(parts[2]));
  }
  return stages;
}

/// The [[pin]] tables of a hung drape: the given points, or two marks of its upper edge.
std::string pins_of(const NewRigOptions& options, const NewDrape& drape) {
  std::string text;
  static const std::regex kForm("([^=]+)=([0-9]+(?:\\.[0-9]+)?),([0-9]+(?:\\.[0-9]+)?)");
  for (const std::string& pin : options.pins) {
    std::smatch parts;
    if (!std::regex_match(pin, parts, kForm))
      throw usage_error(fmt::format("`{}` is no held point", pin),
                        "write DRAPE=WARP_MM,WEFT_MM, e.g. B=0,100");
    if (parts[1] == drape.name)
      text += fmt::format("\n[[pin]]\nat_material_mm = [{}, {}]\n", parts[2].str(), parts[3].str());
  }
  return text.empty() ? kMarkPins : text;
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

constexpr const char* kCameras = R"(schema = "drapebench/cameras/1"
# What capture/README.md says of each line.
[sync]
method = "software_trigger"
fall_back = ["free_run"]
frame_rate_hz = 5.0
)";

std::string cameras_text(const std::vector<FoundCamera>& cameras) {
  std::string text = kCameras;
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
                     const std::vector<NewDrape>& drapes, const std::vector<FoundCamera>& found) {
  std::smatch size;
  static const std::regex kSize("([1-9][0-9]{0,5})x([1-9][0-9]{0,5})");
  if (!std::regex_match(options.size_px, size, kSize))
    throw usage_error(fmt::format("`{}` is no image size", options.size_px),
                      "write WIDTHxHEIGHT in pixels, e.g. 1600x1200");
  std::vector<std::string> scenes;
  for (const NewDrape& drape : drapes)
    scenes.push_back(toml_quoted("scenes/" + drape.name + ".toml"));
  std::string text = fmt::format(
      kRig, fmt::arg("name", toml_quoted(name)), fmt::arg("scenes", fmt::join(scenes, ", ")),
      fmt::arg("poses", fmt::join(numbered("pose", options.free_poses), ", ")));
  for (const auto& [set, z_mm] : stages_of(options))
    text += fmt::format(kStage, fmt::arg("set", toml_quoted(set)), fmt::arg("z", z_mm));
  for (const FoundCamera& camera : found)
    text += fmt::format(kCamera, fmt::arg("name", toml_quoted(camera.name)),
                        fmt::arg("width", *camera.width_px), fmt::arg("height", *camera.height_px));
  if (!found.empty()) return text;
  std::set<std::string> names;
  for (const std::string& camera : options.cameras) {
    check_name(camera, "camera");
    if (!names.insert(camera).second)
      throw usage_error(fmt::format("two cameras are called `{}`", camera),
                        "give each its own name");
    text += fmt::format(kCamera, fmt::arg("name", toml_quoted(camera)),
                        fmt::arg("width", size[1].str()), fmt::arg("height", size[2].str()));
  }
  return text;
}

std::string target_text() {
  std::string text = kTarget;
  int id = kFirstTargetTag;
  for (const auto& centre : kTargetTags_mm) {
    text += fmt::format("\n[[tags.tag]]\nid = {}\ncentre_mm = [{:.1f}, {:.1f}]\n", id++, centre[0],
                        centre[1]);
  }
  return text;
}

std::string print_toml() {
  std::string text = kPrint;
  for (int row = 0; row < 10; ++row) {
    std::vector<std::string> cells;
    for (int col = row % 2; col < 10; col += 2) cells.push_back(fmt::format("[{}, {}]", row, col));
    text += fmt::format("  {},\n", fmt::join(cells, ", "));
  }
  return text + "]\n";
}

std::string scene_text(const NewRigOptions& options, const NewDrape& drape) {
  const std::string head = fmt::format(kScene, fmt::arg("name", toml_quoted(drape.name)),
                                       fmt::arg("set", toml_quoted("drape_" + drape.name)));
  if (drape.kind == "hung")
    return head + fmt::format(kHung, fmt::arg("size", drape.size_mm)) + pins_of(options, drape);
  const std::string size = fmt::format("{:.1f}", drape.size_mm);
  return head + kFlatStart +
         fmt::format(fmt::runtime(drape.kind == "sphere" ? kSphere : kBox), fmt::arg("size", size));
}

void write_fabric(const fs::path& folder) {
  write_durable(folder / "cloth.toml", kFabric);
  for (const CurveFile& curve : kCurveFiles)
    for (const char* direction : {"warp", "weft"})
      write_durable(folder / "cloth" / fmt::format("{}_{}.csv", curve.name, direction),
                    curve.headings);
}

}  // namespace

/// Asks a person at a terminal for arguments missing on the command line.
static NewRigOptions with_answers(NewRigOptions options) {
  const bool is_asked = ::isatty(STDIN_FILENO) == 1 && ::isatty(STDERR_FILENO) == 1;
  const auto ask = [&](const char* question, const char* option) {
    if (!is_asked) throw usage_error(fmt::format("{} is required", option), "see `drape help new`");
    fmt::print(stderr, "{}: ", question);
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
      Field{"pin", "DRAPE=WARP_MM,WEFT_MM: held point of a hung cloth, from its corner"}.per_flag(),
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
  std::vector<FoundCamera> found;
  if (options.cameras == std::vector<std::string>{"auto"} && !fs::exists(folder))
    found = found_cameras();
  const std::string rig = rig_text(options, name, drapes, found);
  if (fs::exists(folder))
    throw bad_input("the folder exists", {.file = folder.string()},
                    "name a new folder; nothing in this one was changed");
  write_durable(folder / "target.toml", target_text());
  write_durable(folder / "print.toml", print_toml());
  for (const NewDrape& drape : drapes)
    write_durable(folder / "scenes" / (drape.name + ".toml"), scene_text(options, drape));
  write_fabric(folder / "fabrics");
  if (!found.empty()) write_durable(folder / "cameras.toml", cameras_text(found));
  write_durable(folder / "rig.toml", rig);
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
