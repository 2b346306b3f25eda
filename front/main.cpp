// SPDX-License-Identifier: Apache-2.0
// Front door: `drape COMMAND ...` runs the program of a stage; `drape run` runs all in turn.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "core/fields/records.hpp"
#include "core/files/json_file.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/program/words.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"
#include "front/calib_images.hpp"
#include "front/check.hpp"
#include "front/new.hpp"
#include "front/process.hpp"
#include "front/run.hpp"

namespace fs = std::filesystem;
using namespace drape;

namespace {

constexpr const char* kHelp =
    R"(drape: measures how far a simulated drape is from the real one, mark by mark

  new RIG --cameras a,b --drape A=sphere:90    the files of a bench of your own, commented
  print cloth|target|object-tags               marks, targets and plates as pages of exact size
  fabric FABRIC                                is this a textile? published fabrics, result sheets
  doctor RIG                                   are cameras, network and disk fit to measure?
  check RIG                                    every missing or wrong value of a bench at once
  capture RIG --set NAME --out RECORDING       the cameras' pictures, all at once
  import FOLDER --out RECORDING                pictures from elsewhere
  import --points CLOUD.csv --scene SCENE ...  points of another instrument as a measured sheet
  run RIG                                      every stage in order, skipping what is up to date
  bench RIG                                    the same and the cameras as a page in the browser
  detect, calib, object, triangulate, simulate, compare
                                               one stage alone; each lists its own subcommands
  calib images FOLDER --board 9x6 ...          a plain folder of chessboard pictures to cameras
  results                                      the history in results.sqlite
  drapemeter PICTURE|SHEET ...                 drape coefficient and folds of round specimens
  study RIG                                    many drapes: meshes, fabrics, in parts if large
  synth RIG                                    pictures and accuracy of planned cameras

`drape help COMMAND` shows a command's options, `drape help key NAME` what a key of rig, target,
print or scene means. All have --json, --quiet, --threads N, --version.
exit codes: 0 good, 1 verdict NO-GO, 2 usage, 3 bad input, 4 device, 5 internal;
130 and 143 interrupted: what was finished is kept
)";

int bench_command(int argc, char** argv) {
  return run_command<RunOptions>(
      argc, argv, "drape run",
      "Runs every stage in order, from a recording to results.sqlite and report.html.\n\n"
      "  drape run rigs/bench1 --out out/bench1",
      run_bench,
      {{"--finest", "--spacing-mm says the finest mesh"},
       {"--no-refine", "--spacing-mm 10 drapes the coarsest mesh alone"}});
}

struct CheckOptions {
  fs::path rig, recording;
};
void fields(Fields& f, CheckOptions& options) {
  f(Field{"rig", "folder of the rig, or its rig.toml"}.called("RIG"), options.rig);
  f.otherwise({"recording", "another recording than the rig's"}, options.recording);
}

int report_bench(const CheckOptions& options, const CommonOptions& common) {
  return report_check(check_bench(options.rig, options.recording), "drape check", common);
}

int check_command(int argc, char** argv) {
  return run_command<CheckOptions>(
      argc, argv, "drape check",
      "Reads every file of a bench and names all that is missing or wrong, with file, line, why "
      "and\nwhat to write. `drape run` does the same before it starts. Exit code 3 when there is "
      "any.\n\n"
      "  drape check rigs/bench1",
      report_bench);
}

int new_command(int argc, char** argv) {
  return run_command<NewRigOptions>(
      argc, argv, "drape new",
      "Writes the files of a bench of your own into a new folder: rig, target, print, scenes and\n"
      "fabric, commented. Values that only you can measure are left out, for you to fill in.\n\n"
      "  drape new my-rig --cameras cam0,cam1,cam2 --drape A=sphere:90 --drape C=box:128",
      make_new_rig);
}

/// One location of a key: "scene.toml", "pin.at_material_mm", its meaning and range.
struct KeyPlace {
  std::string file, path, meaning;

  bool operator==(const KeyPlace&) const = default;
};

/// Meaning and allowed values of a key.
std::string meaning_of(const Json& schema) {
  std::string text = schema.value("description", "");
  const auto limit = [&](const char* key) {
    return schema.contains(key) ? fmt::format("{}", schema[key].get<double>()) : std::string();
  };
  const std::string least = limit("minimum"), most = limit("maximum");
  if (!least.empty() && !most.empty())
    text += fmt::format("; {} to {}", least, most);
  else if (!least.empty())
    text += fmt::format("; at least {}", least);
  else if (!most.empty())
    text += fmt::format("; at most {}", most);
  std::vector<std::string> words;
  for (const Json& word : schema.value("enum", Json::array()))
    if (word.is_string()) words.push_back(word.dump());
  return words.empty() ? text : fmt::format("{}; {}", text, fmt::join(words, ", "));
}

/// Collects the keys under a part of a schema, in lists and alternatives too.
void collect(const Json& schema, const std::string& file, const std::string& path,
             std::vector<KeyPlace>& places) {
  const Json properties = schema.value("properties", Json::object());
  for (const auto& [key, value] : properties.items()) {
    KeyPlace place{file, path.empty() ? key : path + "." + key, meaning_of(value)};
    if (place.meaning.empty() && value.contains("anyOf"))
      place.meaning = meaning_of(value["anyOf"][0]);
    if (std::find(places.begin(), places.end(), place) == places.end()) places.push_back(place);
    collect(value, file, place.path, places);
  }
  if (schema.contains("items")) collect(schema["items"], file, path, places);
  for (const char* several : {"anyOf", "oneOf", "allOf"})
    for (const Json& one : schema.value(several, Json::array())) collect(one, file, path, places);
}

template <class Record>
void collect_format(std::vector<KeyPlace>& places) {
  Record record{};
  const Value schema = schema_of(format_of<Record>, walk_through(record));
  collect(try_json(one_line(schema)), std::string(format_of<Record>.name) + ".toml", "", places);
}

/// `drape help key NAME`: prints the meaning of a key in files that people edit, from the
/// descriptions used for reading them. Returns the exit code.
int help_key(const std::string& name) {
  std::vector<KeyPlace> places;
  collect_format<Rig>(places);
  collect_format<Target>(places);
  collect_format<Print>(places);
  collect_format<Scene>(places);
  std::vector<std::string> names;
  bool found = false;
  for (const KeyPlace& place : places) {
    const std::string key = place.path.substr(place.path.rfind('.') + 1);
    names.push_back(key);
    if (key != name && place.path != name) continue;
    print_text(fmt::format("{}  {}: {}\n", place.file, place.path, place.meaning));
    found = true;
  }
  if (!found)
    throw usage_error(
        fmt::format("`{}` is no key of rig.toml, target.toml, print.toml or a scene{}", name,
                    did_you_mean(name, names)),
        "keys of cameras.toml stand in capture/README.md, of a fabric in "
        "simulate/fabric/README.md");
  return 0;
}

using OwnCommand = int (*)(int, char**);
const std::map<std::string, OwnCommand> kOwn = {
    {"run", bench_command}, {"check", check_command}, {"new", new_command}};

/// Words that can follow `drape`: its own commands, the programs beside it and their commands.
std::vector<std::string> typed_commands() {
  std::vector<std::string> names;
  for (const auto& [name, function] : kOwn) names.push_back(name);
  for (const CommandWord& word : command_words())
    if (word.typed) names.emplace_back(word.name);
  for (const auto& entry : fs::directory_iterator(call_of("x", {}).program.parent_path())) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("drape-")) names.push_back(name.substr(6));
  }
  return names;
}

int dispatch(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() == 3 && words[0] == "help" && words[1] == "key") return help_key(words[2]);
  // `drape help run` means `drape run --help`.
  if (words.size() > 1 && words[0] == "help") {
    words.erase(words.begin());
    words.emplace_back("--help");
  }
  const std::string command = words.empty() ? "--help" : words[0];
  if (command == "--help" || command == "-h" || command == "help") {
    print_text(kHelp);
    return words.empty() ? static_cast<int>(ErrorKind::usage) : 0;
  }
  if (command == "--version") {
    print_text(fmt::format("drapebench {}\n", version()));
    return 0;
  }
  OwnCommand own = nullptr;
  if (const auto found = kOwn.find(command); found != kOwn.end()) own = found->second;
  if (command == "calib" && words.size() > 1 && words[1] == "images") own = calib_images_command;
  if (own != nullptr) {
    words.insert(words.begin(), "drape");
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    return own(static_cast<int>(arguments.size()), arguments.data());
  }
  for (const CommandWord& word : command_words())
    if (command == word.name && !word.typed)
      throw usage_error(
          fmt::format("`{}` has moved", command),
          fmt::format("type `drape {}{}{}`", word.stage, *word.word == '\0' ? "" : " ", word.word));
  const StageCall call = call_of(command, {words.begin() + 1, words.end()});
  if (fs::is_regular_file(call.program)) become(call.program, call.arguments);
  throw usage_error(
      fmt::format("`{}` is not a command{}", command, did_you_mean(command, typed_commands())),
      "see `drape --help`");
}

}  // namespace

int main(int argc, char** argv) {
  return run_guarded("drape", {}, [&] { return dispatch(argc, argv); });
}
