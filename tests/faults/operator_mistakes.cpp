// SPDX-License-Identifier: Apache-2.0
#include "tests/faults/operator_mistakes.hpp"

#include <filesystem>
#include <regex>
#include <stdexcept>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

std::function<void(const SmallBench&)> typed(const std::string& file, const std::string& right,
                                             const std::string& wrong) {
  return [=](const SmallBench& bench) { bench.replace(file, right, wrong); };
}

Json recording_of(const SmallBench& bench) {
  return Json::parse(read_text(bench.rig() / "recording/recording.json"));
}

Json& frame_of(Json& recording, const std::string& set, std::size_t camera) {
  for (Json& one : recording["sets"])
    if (one["name"] == set) return one["frames"][camera];
  throw std::runtime_error("no set " + set);
}

/// Everything of a frame but the camera's name.
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

}  // namespace

std::vector<Mistake> operator_mistakes() {
  const std::string c = "scenes/C.toml", a = "scenes/A.toml";
  return {
      {"camera_misspelt",
       "C",
       typed("rig.toml", "name = \"cam2\"", "name = \"camm2\""),
       3,
       {"recording.json", "camm2", "did you mean `cam2`"}},
      {"width_and_height_exchanged",
       "C",
       typed("rig.toml", "width_px = 1600\nheight_px = 1200", "width_px = 1200\nheight_px = 1600"),
       3,
       {"rig.toml:", "camera.width_px", "width_px = 1600, height_px = 1200"}},
      {"two_stages_at_one_height",
       "C",
       typed("rig.toml", "z_mm = 30.0", "z_mm = 60.0"),
       3,
       {"rig.toml:", "z_mm", "stage_z030", "stage_z060"}},
      {"no_reference_stage",
       "C",
       typed("rig.toml", "z_mm = 0.0", "z_mm = 10.0"),
       3,
       {"rig.toml:", "z_mm", "no stage has z_mm = 0"}},
      {"pose_listed_twice",
       "C",
       typed("rig.toml", "\"pose_01\"", "\"pose_00\""),
       3,
       {"rig.toml", "pose_00"}},
      {"stage_set_misspelt",
       "C",
       typed("rig.toml", "\"stage_z030\"", "\"stage_z003\""),
       3,
       {"rig.toml:", "calibration.stage.set", "did you mean `stage_z0"}},
      {"drape_set_misspelt",
       "C",
       typed(c, "drape_C", "drape_c"),
       3,
       {"C.toml:", "set", "did you mean `drape_"}},
      {"scene_shows_the_target",
       "C",
       typed(c, "drape_C", "stage_z000"),
       3,
       {"C.toml:", "set", "shows the target"}},
      {"two_scenes_of_one_set",
       "A.toml\", \"scenes/C",
       typed(a, "drape_A", "drape_C"),
       3,
       {"C.toml:", "set", "drape_C", "A.toml"}},
      {"table_height_ten_times",
       "C",
       typed(c, "table_z_mm = -6.0", "table_z_mm = -60.0"),
       3,
       {"C.toml:", "table_z_mm", "table_z_mm = -6"}},
      {"table_height_without_sign",
       "C",
       typed(c, "table_z_mm = -6.0", "table_z_mm = 6.0"),
       3,
       {"C.toml:", "z_bottom_mm", "below the table"}},
      {"friction_ten_times",
       "C",
       typed(c, "friction = 0.4", "friction = 4.0"),
       3,
       {"C.toml:", "friction", "0.4"}},
      {"gravity_in_mm",
       "C",
       typed(c, "friction = 0.4", "friction = 0.4\ngravity_m_per_s2 = [0.0, 0.0, -9806.65]"),
       3,
       {"C.toml:", "gravity_m_per_s2", "-9.80665"}},
      {"gravity_upwards",
       "C",
       typed(c, "friction = 0.4", "friction = 0.4\ngravity_m_per_s2 = [0.0, 0.0, 9.80665]"),
       3,
       {"C.toml:", "gravity_m_per_s2", "-9.80665"}},
      {"yaw_forgotten", "C", typed(c, "yaw_deg = 14.0", ""), 3, {"C.toml:", "yaw_deg"}},
      {"density_ten_times",
       "C",
       typed("fabrics/A.toml", "areal_density_g_per_m2 = 138", "areal_density_g_per_m2 = 1380"),
       3,
       {"A.toml:", "areal_density_g_per_m2", "1380"}},
      {"density_in_kg",
       "C",
       typed("fabrics/A.toml", "areal_density_g_per_m2 = 138", "areal_density_g_per_m2 = 0.138"),
       3,
       {"A.toml:", "areal_density_g_per_m2", "kg/m2"}},
      {"bending_in_micronewton_metres",
       "C",
       typed("fabrics/A.toml", "[bending]\nwarp = \"A/bending_warp.csv\"",
             "[bending]\nwarp_kes = { b_gf_cm2_per_cm = 7.7 }"),
       3,
       {"A.toml", "bending.warp", "uN m"}},
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
      {"target_has_tags_of_the_cloth",
       "C",
       typed("target.toml", "id = 400", "id = 0"),
       3,
       {"target.toml:", "tag 0", "print.toml"}},
      {"curve_file_misspelt",
       "C",
       typed("fabrics/A.toml", "A/shear_warp.csv", "A/shear_wrap.csv"),
       3,
       {"shear_wrap.csv"}},
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
       {"C.toml:", "object.kind", "object 2 is object 1 once more"}},
      {"pixels_in_mm",
       "C",
       typed("rig.toml", "[3.45, 3.45]", "[0.00345, 0.00345]"),
       3,
       {"rig.toml:", "camera.pixel_pitch_um", "sensors have"}},
      {"patch_ten_times",
       "C",
       typed("print.toml", "[220.0, 220.0]", "[2200.0, 2200.0]"),
       3,
       {"print.toml:", "patch_mm", "is it 220?"}},
      {"uncertainty_in_um",
       "C",
       typed(c, "yaw_deg = 14.0", "yaw_deg = 14.0\nplace_uncertainty_mm = 500"),
       3,
       {"C.toml:", "object.place_uncertainty_mm", "128 mm wide"}},
      {"file_name_empty",
       "C",
       typed(c, "\"../fabrics/A.toml\"", "\"\""),
       3,
       {"C.toml:", "`fabric` is empty"}},
      {"start_in_um",
       "C",
       typed(c, "clearance_mm = 3.0", "clearance_mm = 3000"),
       3,
       {"C.toml:", "start.clearance_mm", "its own 220 mm"}},
      {"box_in_m",
       "C",
       typed(c, "[128.0, 128.0, 128.0]", "[0.128, 0.128, 0.128]"),
       3,
       {"C.toml:", "object.edge_radius_mm", "smallest edge in size_mm"}},
      {"pitch_in_m",
       "C",
       typed("print.toml", "pitch_mm = 20.0", "pitch_mm = 0.02"),
       3,
       {"print.toml:", "dot_diameter_mm", "smaller than pitch_mm; both are in mm"}},
      {"warp_curve_for_weft",
       "C",
       typed("fabrics/A.toml", "weft = \"A/bending_weft.csv\"", "weft = \"A/bending_warp.csv\""),
       3,
       {"A.toml:", "bending.weft", "bending_warp.csv", "exchanged"}},
      {"curve_of_another_fabric",
       "C",
       [](const SmallBench& bench) {
         bench.replace("fabrics/A.toml", "\"tensile curves\", \"shear curves\", ", "");
         bench.replace("fabrics/A.toml", "A/shear_warp.csv", "B/shear_warp.csv");
       },
       3,
       {"A.toml:", "shear.warp", "curve of another fabric"}},
      {"two_scenes_of_one_name",
       "A.toml\", \"scenes/C",
       typed(c, "name = \"C\"", "name = \"A\""),
       3,
       {"C.toml:", "two scenes are called `A`"}},
      {"friction_as_an_angle",
       "C",
       typed(c, "friction = 0.4", "friction = 21.8"),
       3,
       {"C.toml:", "friction", "tangent of the angle"}},
      {"density_in_ounces",
       "C",
       typed("fabrics/A.toml", "areal_density_g_per_m2 = 138", "areal_density_g_per_m2 = 4.07"),
       3,
       {"A.toml:", "areal_density_g_per_m2", "oz/yd2"}},
      {"loading_and_unloading_exchanged",
       "C",
       [](const SmallBench& bench) {
         const fs::path file = bench.rig() / "fabrics/A/tensile_warp.csv";
         const std::regex numbers("\n([0-9][^,\n]*),([^,\n]*),([^,\n]*)");
         write_durable(file, std::regex_replace(read_text(file), numbers, "\n$1,$3,$2"));
       },
       3,
       {"tensile_warp.csv", "gives back", "exchanged"}},
      {"stand_in_misspelt",
       "C",
       typed(c, "[\"friction\"]", "[\"fricton\"]"),
       3,
       {"C.toml:", "stand_ins", "did you mean `friction`"}},
      {"stand_in_of_a_fabric_misspelt",
       "C",
       typed("fabrics/A.toml", "\"shear curves\"", "\"sheer curves\""),
       3,
       {"A.toml:", "stand_ins", "did you mean `shear curves`"}},
      {"friction_less_certain_than_itself",
       "C",
       typed(c, "friction = 0.4", "friction = 0.4\nfriction_uncertainty = 4"),
       3,
       {"C.toml:", "friction_uncertainty", "one standard deviation"}},
      {"pin_beside_the_cloth",
       "C",
       typed(c, "yaw_deg = 14.0", "yaw_deg = 14.0\n[[pin]]\nat_material_mm = [2200.0, 0.0]"),
       3,
       {"C.toml:", "pin.at_material_mm", "220 x 220 mm"}},
      {"tag_family_in_capitals",
       "C",
       typed("print.toml", "tag36h11", "TAG36H11"),
       3,
       {"print.toml:", "family", "did you mean `tag36h11`"}},
      {"tag_of_the_target_in_cm",
       "C",
       typed("target.toml", "[-80.0, -50.0]", "[-8.0, -5.0]"),
       3,
       {"target.toml:", "centre_mm", "tag 400", "over dot"}},
      {"edge_of_the_tags_with_their_margin",
       "C",
       typed("print.toml", "edge_mm = 12.0", "edge_mm = 19.0"),
       3,
       {"print.toml:", "edge_mm", "over dot"}},
      {"picture_renamed",
       "C",
       pictures(
           [](Json& recording) { frame_of(recording, "drape_C", 1)["file"] = "drape_C/left.png"; }),
       3,
       {"drape_C/left.png", "missing", "cam1.png"}},
      {"curve_saved_as_utf16",
       "C",
       typed("fabrics/A/shear_warp.csv", "sh", std::string("s\0h\0", 4)),
       3,
       {"shear_warp.csv", "UTF-16"}},
      {"margin_forgotten",
       "C",
       typed("print.toml", "margin_mm = [10.0, 10.0]", "margin_mm = [0.0, 0.0]"),
       3,
       {"print.toml:", "margin_mm is 10"}},
      // Only the pictures contradict these.
      {"stages_exchanged",
       "C",
       [](const SmallBench& bench) {
         bench.replace("rig.toml", "z_mm = 30.0", "z_mm = 6e1");
         bench.replace("rig.toml", "z_mm = 60.0", "z_mm = 30.0");
       },
       1,
       {"rig.toml", "z_mm", "stage_z030", "stage_z060", "each other's heights"}},
      {"tags_counted_from_one",
       "C",
       typed("print.toml", "first_id = 0", "first_id = 1"),
       1,
       {"print.toml", "tags lie elsewhere on the print", "tags.first_id"}},
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
       {"rig.toml", "z_mm", "the other way"}},
      {"a_digit_too_many_in_a_curve",
       "C",
       typed("fabrics/A/tensile_warp.csv", "\n0.1,4.", "\n0.1,42."),
       3,
       {"tensile_warp.csv:", "loading_force_gf_per_cm", "the curve falls"}},
      {"force_in_newton_per_cm",
       "C",
       [](const SmallBench& bench) {
         write_durable(bench.rig() / "fabrics/A/tensile_weft.csv",
                       "strain_percent,loading_force_gf_per_cm,unloading_force_gf_per_cm\n"
                       "0,0,0\n4,1.4,0.9\n8,4.9,4.9\n");
       },
       3,
       {"tensile_weft.csv", "loading_force_gf_per_cm", "N/cm"}},
      {"bias_in_micronewton_metres",
       "C",
       typed("fabrics/A.toml", "gf_cm2_per_cm = 0.0785181", "gf_cm2_per_cm = 7.7"),
       3,
       {"A.toml:", "bending.bias_stiffness_gf_cm2_per_cm", "98 times"}},
      {"place_in_um",
       "C",
       typed(c, "x_mm = -3.0", "x_mm = -30000.0"),
       3,
       {"C.toml:", "object.x_mm"}},
      {"object_moved_after_its_tags_were_seen",
       "C",
       typed(c, "yaw_deg = 14.0",
             "yaw_deg = 14.0\ntags_set = \"stage_z090\"\ntags_target = \"../target.toml\""),
       1,
       {"scenes/C.toml, object 1: x_mm = -3 is not where the plate lies; write x_mm = 0.00"}},
      {"print_fitted_to_the_page",
       "C",
       [](const SmallBench& bench) {
         bench.replace("print.toml", "pitch_mm = 20.0", "pitch_mm = 20.62");
         bench.replace("print.toml", "patch_mm = [220.0, 220.0]", "patch_mm = [226.2, 226.2]");
       },
       1,
       {"print.toml", "pitch_mm = 20.62", "speak for 20.0"}},
      {"another_tag_family",
       "C",
       typed("print.toml", "tag36h11", "tag25h9"),
       1,
       {"print.toml", "tags.family", "it shows tags", "of tag36h11"}},
      {"another_print_is_photographed",
       "C",
       typed("print.toml", "first_id = 0", "first_id = 100"),
       1,
       {"print.toml", "tags.first_id", "has tags 100 to 149"}},
      {"radius_for_the_dots_diameter",
       "C",
       typed("print.toml", "dot_diameter_mm = 4.0", "dot_diameter_mm = 2.0"),
       1,
       {"print.toml", "dot_diameter_mm", "is it the radius?"}},
      {"box_by_its_corner",
       "C",
       typed(c, "x_mm = -3.0", "x_mm = -67.0"),
       1,
       {"C.toml", "inside it", "x_mm ="}},
      {"ball_by_its_radius",
       "A",
       typed(a, "diameter_mm = 90.0", "diameter_mm = 45.0"),
       1,
       {"A.toml", "no mark touches it", "diameter_mm"}},
      {"target_pitch_by_one_percent",
       "C",
       typed("target.toml", "pitch_mm = 20.0", "pitch_mm = 20.2"),
       1,
       {"target.toml", "pitch_mm", "divided by 1.01"}},
      {"one_stage_misread",
       "C",
       typed("rig.toml", "z_mm = 60.0", "z_mm = 61.0"),
       1,
       {"rig.toml", "z_mm", "stage_z060"}},
      {"print_pitch_by_five_percent",
       "C",
       typed("print.toml", "pitch_mm = 20.0", "pitch_mm = 19.0"),
       1,
       {"print.toml", "pitch_mm = 19", "speak for 20.0"}},
      {"print_pitch_by_two_percent_more",
       "C",
       [](const SmallBench& bench) {
         bench.replace("print.toml", "pitch_mm = 20.0", "pitch_mm = 20.4");
         bench.replace("print.toml", "patch_mm = [220.0, 220.0]", "patch_mm = [224.0, 224.0]");
       },
       1,
       {"print.toml", "pitch_mm = 20.4", "speak for 2"}},
      {"cube_ten_times_beside",
       "C",
       typed(c, "x_mm = -3.0", "x_mm = -30.0"),
       1,
       {"C.toml", "inside it", "x_mm ="}},
      {"cube_six_mm_beside",
       "C",
       typed(c, "x_mm = -3.0", "x_mm = 3.0"),
       1,
       {"C.toml", "too short to pass outside it", "x_mm ="}},
      {"cube_turned_the_other_way",
       "C",
       typed(c, "yaw_deg = 14.0", "yaw_deg = -14.0"),
       1,
       {"C.toml", "inside it", "yaw_deg ="}},
      {"cube_too_large",
       "C",
       typed(c, "[128.0, 128.0, 128.0]", "[138.0, 138.0, 138.0]"),
       1,
       {"C.toml", "inside it", "size_mm about 12"}},
      {"ball_too_small",
       "A",
       typed(a, "diameter_mm = 90.0", "diameter_mm = 80.0"),
       1,
       {"A.toml", "no mark touches it", "diameter_mm"}},
      {"everything_ten_mm_too_high",
       "C",
       [](const SmallBench& bench) {
         bench.replace("scenes/C.toml", "table_z_mm = -6.0", "table_z_mm = 4.0");
         bench.replace("scenes/C.toml", "z_bottom_mm = -6.0", "z_bottom_mm = 4.0");
       },
       1,
       {"C.toml", "inside it", "the marks speak for"}},
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
