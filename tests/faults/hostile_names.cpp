// SPDX-License-Identifier: Apache-2.0
// Script, formulas and paths in every field that holds a name.
#include "core/files/files.hpp"
#include "tests/faults/hostile_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMeasured = "out/C/sheet.json";
constexpr const char* kSimulated = "out/C/simulations/10mm-1/sheet.json";
constexpr const char* kCertificate = "out/C/simulations/10mm-1/certificate.json";
constexpr const char* kCompare =
    "compare out/C/sheet.json out/C/simulations/10mm-1/sheet.json --calibration "
    "out/calibration.json "
    "--report out/r/report.html --store out/r/results.sqlite";
constexpr const char* kOther =
    "compare out/C/sheet.json other.toml --report out/r/report.html --store out/r/results.sqlite";

std::string toml_text(const std::string& text) {
  return "'" + text + "'";
}

/// Replaces this name everywhere in bench1's files, written by people or by programs.
void rename_everywhere(const HostileBench& bench, const std::string& name, const std::string& to) {
  for (const auto& entry : fs::recursive_directory_iterator(bench.lab())) {
    const fs::path& file = entry.path();
    if (!entry.is_regular_file() || (file.extension() != ".json" && file.extension() != ".toml"))
      continue;
    const std::string quoted = file.extension() == ".json" ? Json(to).dump() : toml_text(to);
    std::string text = read_text(file);
    const std::string from = "\"" + name + "\"";
    for (std::size_t at = text.find(from); at != std::string::npos;
         at = text.find(from, at + quoted.size()))
      text.replace(at, from.size(), quoted);
    write_durable(file, text);
  }
}

/// Replaces every text of a JSON file by the name, except schemas, hashes and the scene of a
/// measured sheet, by which its simulations are found.
void rename_texts(Json& json, const std::string& to) {
  for (auto& [key, value] : json.items()) {
    if (value.is_structured() && key != "asked_scene") rename_texts(value, to);
    const bool fixed = key == "schema" || key == "kind" || key.find("sha256") != std::string::npos;
    if (value.is_string() && !fixed) value = to;
  }
}

HostileFile texts_of(const std::string& name, const std::string& file, const std::string& line,
                     const std::string& to = kScriptName) {
  return {name,
          [file, to](const HostileBench& b) {
            b.edit(file, [&](Json& json) { rename_texts(json, to); });
          },
          line};
}

/// A simulated sheet with statements that no simulator makes, and a certificate that agrees.
HostileFile simulated(const std::string& name, const std::string& to) {
  return {
      name,
      [to](const HostileBench& b) {
        b.edit(kSimulated, [&](Json& json) { rename_texts(json, to); });
        b.edit(kCertificate, [](Json& json) { json["at_rest"] = false; });
        fs::remove((b.lab() / kSimulated).replace_filename("levels.json"));  // of the sheet before
      },
      kCompare};
}

HostileFile named(const std::string& name, const std::string& old, const std::string& line) {
  return {name, [old](const HostileBench& b) { rename_everywhere(b, old, kScriptName); }, line};
}

std::string other_mesh(const std::string& name, const std::string& mesh) {
  return "schema = \"drapebench/mesh/1\"\nname = " + toml_text(name) + "\nmesh = \"" + mesh +
         "\"\nscene = 'C'\nfabric = " + toml_text(name) +
         "\nunit_mm = 1.0\n[grid]\ninner = \"weft\"\ninner_count = 23\nwarp_from_mm = 0.0\n"
         "warp_to_mm = 220.0\nweft_from_mm = 0.0\nweft_to_mm = 220.0\n";
}

void add_other(const HostileBench& bench, const std::string& name) {
  bench.write("other.toml", other_mesh(name, "out/C/simulations/10mm-1/sheet.ply"));
}

void set_text(const HostileBench& bench, const std::string& file, const std::string& pointer,
              const Json& value) {
  bench.edit(file, [&](Json& json) { json[Json::json_pointer(pointer)] = value; });
}

}  // namespace

std::vector<HostileFile> hostile_names() {
  return {
      named("script_as_rig", "bench1", "run rig --single --out out"),
      named("script_as_camera", "cam0", "run rig --single --out out"),
      named("script_as_set", "drape_C", "run rig --single --out out"),
      named("script_as_drape", "C", "run rig --single --out out"),
      named("script_as_fabric", "A", "run rig --single --out out"),
      texts_of("script_in_measured_sheet", kMeasured, kCompare),
      simulated("script_in_simulated_sheet", kScriptName),
      texts_of("script_in_calibration", "out/calibration.json", kCompare),
      texts_of("script_in_detections", "out/C/detections.json", kCompare),
      texts_of("script_in_certificate", kCertificate, kCompare),
      simulated("formula_in_simulated_sheet", kFormulaName),
      {"script_as_simulator", [](const HostileBench& b) { add_other(b, kScriptName); }, kOther},
      {"formula_as_simulator", [](const HostileBench& b) { add_other(b, kFormulaName); }, kOther},
      {"script_as_label", [](const HostileBench&) {},
       "run rig --single --out out --label '" + kScriptName + "' --operator '" + kScriptName + "'"},
      {"terminal_commands_as_simulator",
       [](const HostileBench& b) { add_other(b, "\x1b]0;owned\x07\x1b[2J"); }, kOther},
      {"preview_outside",
       [](const HostileBench& b) {
         set_text(b, "out/C/detections.json", "/frames/0/preview_file",
                  "../../../outside/secret.txt");
       },
       kCompare},
      {"preview_with_absolute_path",
       [](const HostileBench& b) {
         set_text(b, "out/C/detections.json", "/frames/0/preview_file",
                  (b.outside() / "secret.txt").string());
       },
       kCompare},
      {"preview_as_link",
       [](const HostileBench& b) {
         fs::create_symlink(b.outside() / "secret.txt", b.lab() / "out/C/picture.jpg");
         set_text(b, "out/C/detections.json", "/frames/0/preview_file", "picture.jpg");
       },
       kCompare},
      {"frame_outside",
       [](const HostileBench& b) {
         set_text(b, "rig/recording/recording.json", "/sets/0/frames/0/file",
                  "../../../outside/secret.txt");
       },
       "run rig --single --out out"},
      {"set_outside",
       [](const HostileBench& b) { rename_everywhere(b, "drape_C", "../../outside"); },
       "run rig --single --out out"},
      {"camera_outside",
       [](const HostileBench& b) { rename_everywhere(b, "cam0", "../../outside/x"); },
       "run rig --single --out out"},
      {"drape_outside", [](const HostileBench& b) { rename_everywhere(b, "C", "../../outside/x"); },
       "run rig --single --out out"},
      {"name_of_300_bytes",
       [](const HostileBench& b) { rename_everywhere(b, "C", std::string(300, 'x')); },
       "run rig --single --out out"},
      {"name_of_200_bytes",
       [](const HostileBench& b) { rename_everywhere(b, "C", std::string(200, 'x')); },
       "run rig --single --out out"},
      {"name_with_newline",
       [](const HostileBench& b) { set_text(b, kMeasured, "/source/set", "a\nb"); }, kCompare},
      {"scene_is_the_secret",
       [](const HostileBench& b) {
         b.replace("rig/rig.toml", "scenes/C.toml", "../../outside/secret.txt");
       },
       "run rig --single --out out"},
      {"mesh_is_the_secret",
       [](const HostileBench& b) {
         b.write("other.toml", other_mesh("x", "../outside/secret.txt"));
       },
       kOther},
      {"record_names_the_secret",
       [](const HostileBench& b) {
         set_text(b, "out/report.run.json", "/inputs/0/file", "../../outside/secret.txt");
       },
       "run rig --single --out out"},
      {"crate_of_a_record_that_names_the_secret",
       [](const HostileBench& b) {
         set_text(b, "out/C/simulations/10mm-1/sheet.run.json", "/inputs/0/file",
                  "../../../../../outside/secret.txt");
         static_cast<void>(b.run("results import out --store s/results.sqlite"));
         b.write("lab.toml",
                 "schema = \"drapebench/lab/1\"\ntitle = \"x\"\ndescription = \"x\"\nlicense = "
                 "\"https://x\"\nlicense_name = \"x\"\n[[author]]\nname = \"x\"\n");
       },
       "results export ro-crate --store s/results.sqlite --about lab.toml --out crate"},
      {"output_is_a_link",
       [](const HostileBench& b) {
         fs::remove(b.lab() / "out/report.html");
         fs::create_symlink(b.outside() / "secret.txt", b.lab() / "out/report.html");
         fs::remove(b.lab() / "out/report.run.json");
       },
       "run rig --single --out out"},
      {"output_folder_is_a_link",
       [](const HostileBench& b) {
         fs::create_directory_symlink(b.outside(), b.lab() / "linked");
         b.write("other.toml", other_mesh("x", "out/C/simulations/10mm-1/sheet.ply"));
       },
       kOther},
  };
}

}  // namespace drape::test
