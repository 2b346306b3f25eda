// SPDX-License-Identifier: Apache-2.0
// Mistakes with pictures, curves and several files at once.
#include <filesystem>
#include <regex>
#include <stdexcept>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "tests/faults/operator_mistakes.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

Json recording_of(const SmallBench& bench) {
  return parse_json(read_text(bench.rig() / "recording/recording.json"));
}

Json& frame_of(Json& recording, const std::string& set, std::size_t camera) {
  for (Json& one : recording["sets"])
    if (one["name"] == set) return one["frames"][camera];
  throw std::runtime_error("no set " + set);
}

/// Copies everything of a frame except the camera's name.
void copy_picture(Json from, Json& to) {
  from["camera"] = to["camera"];
  to = from;
}

std::function<void(const SmallBench&)> pictures(const std::function<void(Json&)>& change) {
  return [=](const SmallBench& bench) {
    Json recording = recording_of(bench);
    change(recording);
    write_json(bench.rig() / "recording/recording.json", recording);
  };
}

/// The box of C as a mesh with that side length, in the numbers of the file.
std::function<void(const SmallBench&)> cube_as_mesh(const std::string& side) {
  return [=](const SmallBench& bench) {
    std::string text;
    for (const char* corner :
         {"0 0 0", "1 0 0", "0 1 0", "1 1 0", "0 0 1", "1 0 1", "0 1 1", "1 1 1"})
      text += "v " + std::regex_replace(corner, std::regex("1"), side) + "\n";
    write_durable(bench.rig() / "scenes/cube.obj",
                  text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n");
    const std::string scene = read_text(bench.rig() / "scenes/C.toml");
    write_durable(bench.rig() / "scenes/C.toml",
                  scene.substr(0, scene.find("[[object]]")) +
                      "[[object]]\nkind = \"mesh\"\nfile = \"cube.obj\"\n"
                      "origin_mm = [-67.0, -59.0, -6.0]\nyaw_deg = 14.0\n");
  };
}

}  // namespace

std::vector<Mistake> other_mistakes() {
  const std::string c = "scenes/C.toml", a = "scenes/A.toml";
  return {
      {"yaw_forgotten", "C", typed(c, "yaw_deg = 14.0", ""), 3, {"C.toml:", "yaw_deg"}},
      {"mesh_in_metres", "C", cube_as_mesh("0.128"), 3, {"cube.obj", "are these m,"}},
      {"mesh_with_a_hole",
       "C",
       [](const SmallBench& bench) {
         cube_as_mesh("128")(bench);
         bench.replace("scenes/cube.obj", "f 2 4 8 6\n", "");
       },
       3,
       {"cube.obj", "open edge"}},
      {"mesh_not_there",
       "C",
       [](const SmallBench& bench) {
         cube_as_mesh("128")(bench);
         fs::remove(bench.rig() / "scenes/cube.obj");
       },
       3,
       {"cube.obj"}},
      {"another_print_in_the_scene",
       "C",
       [](const SmallBench& bench) {
         fs::copy(bench.rig() / "print.toml", bench.rig() / "print2.toml");
         bench.replace("scenes/C.toml", "../print.toml", "../print2.toml");
       },
       3,
       {"C.toml:", "print", "print2.toml"}},
      {"one_camera_copied_to_another",
       "C",
       pictures([](Json& recording) {
         copy_picture(frame_of(recording, "drape_C", 0), frame_of(recording, "drape_C", 1));
       }),
       3,
       {"drape_C", "cam1", "cam0", "byte for byte"}},
      {"one_set_copied_to_another",
       "C",
       pictures([](Json& recording) {
         for (std::size_t k = 0; k < 3; ++k)
           copy_picture(frame_of(recording, "pose_03", k), frame_of(recording, "pose_04", k));
       }),
       3,
       {"pose_03", "pose_04", "byte for byte"}},
      {"several_at_once",
       "C",
       [](const SmallBench& bench) {
         bench.replace("scenes/C.toml", "table_z_mm = -6.0", "");
         bench.replace("scenes/C.toml", "friction = 0.4", "");
         bench.replace("target.toml", "pitch_mm = 20.0", "");
         bench.replace("fabrics/A.toml", "areal_density_g_per_m2 = 138", "");
       },
       3,
       {"`table_z_mm` is missing", "`friction` is missing", "`pitch_mm` is missing",
        "`areal_density_g_per_m2` is missing"}},
      {"object_forgotten",
       "C",
       [](const SmallBench& bench) {
         const std::string text = read_text(bench.rig() / "scenes/C.toml");
         bench.replace("scenes/C.toml", text.substr(text.find("[[object]]")), "");
       },
       3,
       {"C.toml", "`object`", "neither an [[object]] nor a [[pin]]"}},
      {"object_twice",
       "C",
       [](const SmallBench& bench) {
         const std::string text = read_text(bench.rig() / "scenes/C.toml");
         const std::string object = text.substr(text.find("[[object]]"));
         bench.replace("scenes/C.toml", object, object + object);
       },
       3,
       {"C.toml:", ".kind`", "object 2 is object 1 once more"}},
      {"curve_of_another_fabric",
       "C",
       [](const SmallBench& bench) {
         bench.replace("fabrics/A.toml", "\"tensile curves\", \"shear curves\", ", "");
         bench.replace("fabrics/A.toml", "A/shear_warp.csv", "B/shear_warp.csv");
       },
       3,
       {"A.toml:", "shear.warp", "curve of another fabric"}},
      {"loading_and_unloading_exchanged",
       "C",
       [](const SmallBench& bench) {
         const fs::path file = bench.rig() / "fabrics/A/tensile_warp.csv";
         const std::regex numbers("\n([0-9][^,\n]*),([^,\n]*),([^,\n]*)");
         write_durable(file, std::regex_replace(read_text(file), numbers, "\n$1,$3,$2"));
       },
       3,
       {"tensile_warp.csv", "gives back", "exchanged"}},
      {"picture_renamed",
       "C",
       pictures(
           [](Json& recording) { frame_of(recording, "drape_C", 1)["file"] = "drape_C/left.png"; }),
       3,
       {"drape_C/left.png", "missing", "cam1.png"}},
      {"stages_exchanged",
       "C",
       [](const SmallBench& bench) {
         bench.replace("rig.toml", "z_mm = 30.0", "z_mm = 6e1");
         bench.replace("rig.toml", "z_mm = 60.0", "z_mm = 30.0");
       },
       1,
       {"rig.toml", "z_mm", "stage_z030", "stage_z060", "each other's heights"}},
      {"rows_and_columns_of_the_tags_exchanged",
       "C",
       [](const SmallBench& bench) {
         const std::string text = read_text(bench.rig() / "print.toml");
         write_durable(bench.rig() / "print.toml",
                       std::regex_replace(text, std::regex(R"(\[(\d), (\d)\])"), "[$2, $1]"));
       },
       1,
       {"print.toml", "tags.cells", "are rows and columns"}},
      {"two_tags_of_the_target_exchanged",
       "C",
       [](const SmallBench& bench) {
         bench.replace("target.toml", "id = 400", "id = 4");
         bench.replace("target.toml", "id = 401", "id = 400");
         bench.replace("target.toml", "id = 4\n", "id = 401\n");
       },
       3,
       {"target.toml", "tags.tag.centre_mm", "2 of 6 tags lie elsewhere"}},
      {"stages_counted_downwards",
       "C",
       [](const SmallBench& bench) {
         for (const char* z : {"30.0", "60.0", "90.0"})
           bench.replace("rig.toml", std::string("z_mm = ") + z, std::string("z_mm = -") + z);
       },
       1,
       {"rig.toml", "z_mm", "moves against z_mm"}},
      {"force_in_newton_per_cm",
       "C",
       [](const SmallBench& bench) {
         write_durable(bench.rig() / "fabrics/A/tensile_weft.csv",
                       "strain_percent,loading_force_gf_per_cm,unloading_force_gf_per_cm\n"
                       "0,0,0\n4,1.4,0.9\n8,4.9,4.9\n");
       },
       3,
       {"tensile_weft.csv", "loading_force_gf_per_cm", "N/cm"}},
      {"print_fitted_to_the_page",
       "C",
       [](const SmallBench& bench) {
         bench.replace("print.toml", "pitch_mm = 20.0", "pitch_mm = 20.62");
         bench.replace("print.toml", "patch_mm = [220.0, 220.0]", "patch_mm = [226.2, 226.2]");
       },
       1,
       {"print.toml", "pitch_mm = 20.62", "speak for 20.0"}},
      {"print_pitch_by_two_percent_more",
       "C",
       [](const SmallBench& bench) {
         bench.replace("print.toml", "pitch_mm = 20.0", "pitch_mm = 20.4");
         bench.replace("print.toml", "patch_mm = [220.0, 220.0]", "patch_mm = [224.0, 224.0]");
       },
       1,
       {"print.toml", "pitch_mm = 20.4", "speak for 2"}},
      {"everything_ten_mm_too_high",
       "C",
       [](const SmallBench& bench) {
         bench.replace("scenes/C.toml", "table_z_mm = -6.0", "table_z_mm = 4.0");
         bench.replace("scenes/C.toml", "z_bottom_mm = -6.0", "z_bottom_mm = 4.0");
       },
       1,
       {"C.toml", "inside it", "measure"}},
      {"cameras_exchanged_in_the_drape",
       "C",
       pictures([](Json& recording) {
         Json &one = frame_of(recording, "drape_C", 0), &two = frame_of(recording, "drape_C", 1);
         const Json kept = one;
         copy_picture(two, one);
         copy_picture(kept, two);
       }),
       1,
       {"drape_C", "exchanged", "cam0 shows what cam1 saw"}},
      {"one_picture_without_the_cloth",
       "C",
       pictures([](Json& recording) {
         copy_picture(frame_of(recording, "empty", 1), frame_of(recording, "drape_C", 1));
       }),
       1,
       {"detection of set drape_C is NO-GO", "no mark in the picture of cam1"}},
      {"one_stage_without_the_target",
       "C",
       pictures([](Json& recording) {
         copy_picture(frame_of(recording, "empty", 1), frame_of(recording, "stage_z090", 1));
       }),
       1,
       {"detection of set stage_z090 is NO-GO", "no mark in the picture of cam1"}},
      {"a_set_that_capture_refused",
       "C",
       pictures([](Json& recording) {
         for (Json& set : recording["sets"])
           if (set["name"] == "drape_C") set["no_go"] = "the cloth moved by 3.10 px";
       }),
       3,
       {"drape_C", "the cloth moved by 3.10 px", "record the set again"}},
      {"one_picture_of_another_drape",
       "C",
       pictures([](Json& recording) {
         copy_picture(frame_of(recording, "drape_A", 2), frame_of(recording, "drape_C", 2));
       }),
       1,
       {"drape_C", "cam2"}},
  };
}

}  // namespace drape::test
