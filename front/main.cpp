// SPDX-License-Identifier: Apache-2.0
// The front door: `drape COMMAND ...` runs the program of that stage; `drape run` chains them.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <map>
#include <set>

#include "core/error.hpp"
#include "core/program/command.hpp"
#include "core/program/manual.hpp"
#include "core/program/run_record.hpp"
#include "front/calib_images.hpp"
#include "front/new.hpp"
#include "front/process.hpp"
#include "front/run.hpp"

using namespace drape;

namespace {

constexpr const char* kHelp = R"(drape: measures how far a simulated drape is from the real one

  drape run rigs/bench1                  every stage in order, skipping what is up to date

commands
  run RIG                                recorded images to stored and reported millimetres
  new RIG --cameras a,b --drape A=sphere:90
                                         the files of a bench of your own, commented
  import FOLDER --out RECORDING          images from elsewhere: FOLDER/<set>/<camera>.png|jpg|tif
  calib-images FOLDER --board 9x6 ...    a plain folder of chessboard pictures to a calibration
  capture, detect, calib, triangulate, simulate, compare
                                         one stage
  results                                the history in results.sqlite
{more}
`drape COMMAND --help` tells a command's options. All have --json, --quiet, --threads N, --version.
exit codes: 0 good, 1 verdict NO-GO, 2 usage, 3 bad input, 4 device, 5 internal
)";

int run_command(int argc, char** argv) {
  Command app(
      "Runs every stage in order, from a recording to results.sqlite and report.html.\n\n"
      "  drape run rigs/bench1 --out out/bench1",
      "drape run");
  RunOptions options;
  CommonOptions common;
  app.add_option("RIG", options.rig, "folder of the rig, or its rig.toml")->required();
  app.add_option("--recording", options.recording, "another recording than the rig's");
  app.add_option("--out", options.out, "output folder (default: out/<rig name>)");
  app.add_option("--store", options.store, "results store (default: <out>/results.sqlite)");
  add_common_options(app, common);
  return run_program(app, argc, argv, common, [&] {
    options.threads = thread_count(common);
    return run_bench(options, common);
  });
}

int calib_images_command(int argc, char** argv) {
  Command app(
      "Calibrates cameras from a plain folder of chessboard pictures: left01.jpg, right01.jpg, "
      "...\n"
      "or <view>/<camera>.png. All cameras together; one camera alone is fine too.\n\n"
      "  drape calib-images pictures --board 9x6 --square-mm 30 --out out/pictures",
      "drape calib-images");
  CalibImagesOptions options;
  CommonOptions common;
  app.add_option("FOLDER", options.folder, "folder of the pictures")->required();
  app.add_option("--board", options.board, "inner corners as COLSxROWS, e.g. 9x6")->required();
  app.add_option("--square-mm", options.square_mm, "side of a square, measured")
      ->required()
      ->positive();
  app.add_option("--out", options.out, "output folder")->required();
  add_common_options(app, common);
  return run_program(app, argc, argv, common, [&] { return calibrate_images(options, common); });
}

int new_command(int argc, char** argv) {
  Command app(
      "Writes the files of a bench of your own into a new folder: rig, target, print, scenes and\n"
      "fabric, commented. Values that only you can measure are left out, for you to fill in.\n\n"
      "  drape new my-rig --cameras cam0,cam1,cam2 --drape A=sphere:90 --drape C=box:128",
      "drape new");
  NewRigOptions options;
  CommonOptions common;
  app.add_option("RIG", options.folder, "folder to make; its last part names the rig")->required();
  app.add_option("--cameras", options.cameras, "names, two or more; or auto: those that answer")->required()->delimiter(',');
  app.add_option("--size-px", options.size_px, "image size of the cameras")->capture_default_str();
  app.add_option("--drape", options.drapes,
                 "NAME=sphere:DIAMETER_MM, NAME=box:EDGE_MM or NAME=hung:DISTANCE_MM")
      ->required();
  app.add_option("--stages-mm", options.stage_z_mm, "heights of the target")
      ->delimiter(',')
      ->default_str("0,30,60,90");
  app.add_option("--free-poses", options.free_poses, "sets with the target anywhere")
      ->range(0, 99)
      ->capture_default_str();
  add_common_options(app, common);
  return run_program(app, argc, argv, common, [&] { return make_new_rig(options, common); });
}

/// Further programs that are built beside this one, for the help text.
std::string more_commands() {
  static const std::set<std::string> listed = {"capture",  "detect",  "calib",  "triangulate",
                                               "simulate", "compare", "results"};
  std::set<std::string> more;
  for (const auto& entry : std::filesystem::directory_iterator(stage_program("x").parent_path())) {
    const std::string name = entry.path().filename().string();
    const std::string prefix = "drape-";
    if (name.starts_with(prefix) && listed.count(name.substr(prefix.size())) == 0)
      more.insert(name.substr(prefix.size()));
  }
  return more.empty() ? "" : fmt::format("  {}\n", fmt::join(more, ", "));
}

[[noreturn]] void run_stage(const std::string& command, std::vector<std::string> arguments) {
  if (command == "import") {
    arguments.insert(arguments.begin(), "import");
    become(stage_program("capture"), arguments);
  }
  become(stage_program(command), arguments);
}

/// The commands that are not a program of their own.
const std::map<std::string, int (*)(int, char**)> kOwnCommands = {
    {"run", run_command}, {"calib-images", calib_images_command}, {"new", new_command}};

int dispatch(int argc, char** argv) {
  const std::string command = argc < 2 ? "--help" : argv[1];
  if (command == "--help-man") {
    const Command app(fmt::format(kHelp, fmt::arg("more", more_commands())), "drape");
    fmt::print("{}", manual_page(app));
    return 0;
  }
  if (command == "--help-words") {
    for (const auto& [name, run] : kOwnCommands) fmt::print("{}\n", name);
    return 0;
  }
  if (command == "--help" || command == "-h" || command == "help") {
    fmt::print(kHelp, fmt::arg("more", more_commands()));
    return argc < 2 ? static_cast<int>(ErrorKind::usage) : 0;
  }
  if (command == "--version") {
    fmt::print("drapebench {}\n", version());
    return 0;
  }
  const auto own = kOwnCommands.find(command);
  if (own != kOwnCommands.end()) return own->second(argc - 1, argv + 1);
  // Like git: every program `drape-X` beside this one is the command `drape X`.
  const bool known = std::filesystem::is_regular_file(stage_program(command));
  if (known || command == "import") run_stage(command, {argv + 2, argv + argc});
  throw usage_error(fmt::format("`{}` is not a command", command), "see `drape --help`");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return dispatch(argc, argv);
  } catch (const Error& error) {
    fmt::print(stderr, "drape: error: {}\n", error.what());
    return static_cast<int>(error.kind());
  }
}
