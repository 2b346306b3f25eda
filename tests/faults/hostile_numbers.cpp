// SPDX-License-Identifier: Apache-2.0
// Counts, sizes, types and depths claimed by a file.
#include <limits>

#include "tests/faults/hostile_bench.hpp"

namespace drape::test {
namespace {

constexpr const char* kMeasuredSheet = "out/C/sheet.json";
constexpr const char* kCompareNumbers =
    "compare out/C/sheet.json out/C/simulations/10mm-1/sheet.json --report out/r/report.html";
constexpr const char* kTriangulate =
    "triangulate out/C/detections.json --calibration out/calibration.json --set drape_C --out "
    "out/t/sheet.ply";
constexpr const char* kSimulate =
    "simulate rig/scenes/C.toml --fabric rig/fabrics/A.toml --spacing-mm 10 --segments 1 --out "
    "out/s";
constexpr const char* kCompareOther =
    "compare out/C/sheet.json other.toml --report out/r/report.html";

HostileFile with_value(const std::string& name, const std::string& file, const std::string& pointer,
                       const Json& value, const std::string& line) {
  return {name,
          [file, pointer, value](const HostileBench& b) {
            b.edit(file, [&](Json& json) { json[Json::json_pointer(pointer)] = value; });
          },
          line};
}

HostileFile with_text(const std::string& name, const std::string& file, const std::string& from,
                      const std::string& to, const std::string& line) {
  return {name, [=](const HostileBench& b) { b.replace(file, from, to); }, line};
}

/// The surface of another simulator in this mesh file.
HostileFile with_mesh(const std::string& name, const std::string& file, const std::string& text) {
  return {name,
          [file, text](const HostileBench& b) {
            b.write(file, text);
            b.write("other.toml",
                    "schema = \"drapebench/mesh/1\"\nname = \"x\"\nscene = \"C\"\nmesh = \"" +
                        file + "\"\nunit_mm = 1.0\ncorrespondence = \"none\"\n");
          },
          kCompareOther};
}

std::string ply(const std::string& vertices, const std::string& faces, const std::string& body,
                const std::string& format = "ascii") {
  return "ply\nformat " + format + " 1.0\nelement vertex " + vertices +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " + faces +
         "\nproperty list uint uint vertex_indices\nend_header\n" + body;
}

std::string nested(int depth) {
  return std::string(static_cast<std::size_t>(depth), '[') +
         std::string(static_cast<std::size_t>(depth), ']');
}

}  // namespace

std::vector<HostileFile> hostile_numbers() {
  const Json huge = std::numeric_limits<int>::max();
  const std::string points = "0 0 0\n100 0 0\n0 100 0\n";
  std::string bad_obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  for (int i = 0; i < 200000; ++i) bad_obj += "f 1 2 3 -1 -2 -3\n";
  return {
      with_mesh("ply_of_2_64_vertices", "m.ply", ply("18446744073709551615", "1", points)),
      with_mesh("ply_of_4_billion_faces", "m.ply", ply("3", "4294967295", points + "3 0 1 2\n")),
      with_mesh("ply_list_of_4_billion", "m.ply", ply("3", "1", points + "4294967295 0 1 2\n")),
      with_mesh("ply_list_of_4_billion_binary", "m.ply",
                ply("0", "1", std::string(4, '\xff') + "xxxx", "binary_little_endian")),
      with_mesh("ply_index_of_1e300", "m.ply", ply("3", "1", points + "3 0 1 1e300\n")),
      with_mesh("ply_negative_index", "m.ply", ply("3", "1", points + "3 0 1 -1\n")),
      with_mesh("ply_without_properties", "m.ply",
                "ply\nformat ascii 1.0\nelement vertex 100000000000\nend_header\n"),
      with_mesh("ply_nan", "m.ply", ply("3", "1", "nan 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")),
      with_mesh("ply_huge_coordinates", "m.ply",
                ply("3", "1", "1e38 0 0\n-1e38 1e38 0\n0 1e38 1e38\n3 0 1 2\n")),
      with_mesh("obj_index_beyond", "m.obj", "v 0 0 0\nf 1 2 99999999999\n"),
      with_mesh("obj_of_doubled_faces", "m.obj", bad_obj),
      with_value("sheet_of_2_31_rows", kMeasuredSheet, "/rows", huge, kCompareNumbers),
      with_value("sheet_of_2_31_rows_and_columns", kMeasuredSheet, "/cols", huge, kCompareNumbers),
      with_value("sheet_with_text_for_number", kMeasuredSheet, "/rows", "11", kCompareNumbers),
      with_value("sheet_with_huge_patch", kMeasuredSheet, "/patch_mm", Json::array({1e300, 1e300}),
                 kCompareNumbers),
      with_value("sheet_with_object_for_text", kMeasuredSheet, "/source/rig", Json::object(),
                 kCompareNumbers),
      with_value("sheet_with_integer_below_all", kMeasuredSheet, "/rows",
                 std::numeric_limits<std::int64_t>::min(), kCompareNumbers),
      with_value("sheet_with_integer_above_all", kMeasuredSheet, "/rows",
                 std::numeric_limits<std::uint64_t>::max(), kCompareNumbers),
      {"sheet_nested_100000_deep",
       [](const HostileBench& b) {
         b.write(kMeasuredSheet, "{\"schema\": " + nested(100000) + "}");
       },
       kCompareNumbers},
      {"scene_nested_100000_deep",
       [](const HostileBench& b) { b.write("rig/scenes/C.toml", "schema = " + nested(100000)); },
       kSimulate},
      with_value("lattice_of_2_31_rows", "out/C/detections.json", "/lattice/rows", huge,
                 kTriangulate),
      with_value("frame_of_2_31_px", "out/C/detections.json", "/frames/0/width_px", huge,
                 kTriangulate),
      with_value("calibration_of_2_31_px", "out/calibration.json", "/cameras/0/width_px", huge,
                 kTriangulate),
      with_value("calibration_with_list_for_lens", "out/calibration.json", "/cameras/0/lens",
                 Json::array(), kTriangulate),
      with_value("calibration_with_huge_covariance", "out/calibration.json",
                 "/cameras/0/covariance", Json::array({Json::array({1e308})}), kTriangulate),
      with_text("print_of_a_billion_marks", "rig/print.toml", "rows = 11", "rows = 1000000000",
                "run rig --single --out out"),
      with_text("target_of_a_billion_dots", "rig/target.toml", "rows = 9", "rows = 1000000000",
                "run rig --single --out out"),
      with_text("box_of_1e300_mm", "rig/scenes/C.toml", "size_mm = [128.0, 128.0, 128.0]",
                "size_mm = [1e300, 1e300, 1e300]", kSimulate),
      with_text("box_of_1e-300_mm", "rig/scenes/C.toml", "size_mm = [128.0, 128.0, 128.0]",
                "size_mm = [1e-300, 1e-300, 1e-300]", kSimulate),
      with_text("density_of_1e300", "rig/fabrics/A.toml", "areal_density_g_per_m2 = 138",
                "areal_density_g_per_m2 = 1e300", kSimulate),
      with_text("grid_of_a_billion", "rig/rig.toml", "grids = [11, 21, 31]", "grids = [1000000000]",
                "check rig"),
      with_text("spacing_of_a_nanometre", "rig/rig.toml", "spacing_mm = 10", "spacing_mm = 1e-6",
                "check rig"),
      with_text("segments_of_a_billion", "rig/rig.toml", "segments = [1]",
                "segments = [1000000000]", "check rig"),
      {"curve_of_one_endless_line",
       [](const HostileBench& b) {
         b.write("rig/fabrics/A/bending_warp.csv", std::string{}.append(20'000'000, ','));
       },
       kSimulate},
  };
}

}  // namespace drape::test
