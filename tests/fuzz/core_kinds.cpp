// SPDX-License-Identifier: Apache-2.0
#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/drape_mesh.hpp"
#include "core/files/files.hpp"
#include "core/program/run_record.hpp"
#include "core/recording.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "core/simulation_files.hpp"
#include "tests/fuzz/kinds.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {

namespace fs = std::filesystem;

Sheet small_sheet() {
  Sheet sheet{.rows = 2, .cols = 2, .patch_m = {0.04, 0.04}, .marks = {}, .gaps = {}, .source = {}};
  const Eigen::Matrix3d covariance = 1e-10 * Eigen::Matrix3d::Identity();
  sheet.marks = {{{0, 0}, {0.01, 0.01}, {0.1, 0.2, 0.3}, covariance, 3, 0.02},
                 {{0, 1}, {0.01, 0.03}, {0.2, 0, 0}, covariance, 2, 0.1}};
  sheet.gaps = {{{1, 0}, "seen by one camera"}, {{1, 1}, "seen by no camera"}};
  sheet.source = MeasuredSource{"bench", "drape_A", {"cam0", "cam1"}, "aa", "bb"};
  return sheet;
}

LevelsFile small_levels() {
  LevelsFile levels;
  levels.sheet_sha256 = std::string(64, 'a');
  levels.levels = {{0.01, 580, true, "at rest", 200, std::nullopt},
                   {5e-3, 2200, true, "at rest", 90, 6e-4}};
  levels.left_m = 2e-4;
  levels.marks = {{{0, 1}, {0.01, 0.02, 0.03}, 3e-4, std::nullopt}};
  return levels;
}

SensitivityFile small_sensitivity() {
  SensitivityFile file;
  file.spacing_m = 2.5e-3;
  file.segments = 5;
  file.model = "triangles";
  file.distance_m = 1.5e-3;
  file.marks = 2;
  file.marks_at = {{0, 0}, {0, 1}};
  const Eigen::MatrixX3d up_m = Eigen::MatrixX3d::Constant(2, 3, 1e-3);
  file.values = {{"bending_warp", 1e-5, 5e-5, MarkMoves{50, 50, -up_m, up_m}}};
  file.scene = {{"level_x_deg", 1e-3, MarkMoves{0.2, std::nullopt, -up_m, up_m}, ""},
                {"friction", std::nullopt, std::nullopt, "no rest for a change of 0.1"}};
  file.variants = {{"no twist stiffness", true, true, 1.75e-3, 2.5e-4, 5e-4}};
  file.no_go = "cam1 moved";
  return file;
}

CusickFile small_cusick() {
  CusickStart start{.file = "start-00.ply", .points = 1500, .specimen_area_m2 = 0.07, .steps = 90};
  start.residual = start.checked_residual = 1e-4;
  start.energy_j = 1e-4;
  start.dissipated_j = 1e-6;
  start.deepest_m = 1e-5;
  start.refusals = {"1.2 of a point's weight is left on a point"};
  return {"wool", 0.18, 0.3, {start}, {}};
}

Certificate small_certificate() {
  Certificate certificate;
  certificate.at_rest = true;
  certificate.status = "at rest";
  certificate.residual = 1e-4;
  certificate.residual_tolerance = 1e-3;
  certificate.check = CertificateCheck{true, 1e-4, 1e-5, 1e-7, 0, 12, {}};
  certificate.strains = CertificateStrains{{-0.002, 0.005}, {-0.005, 0.01}, 0.1, 50};
  certificate.distances = CertificateDistances{.to_object_m = 0,
                                               .to_table_m = 0.1,
                                               .to_itself_m = 4e-4,
                                               .layers_apart_m = 5e-4,
                                               .contact_forces = 12};
  certificate.energies = CertificateEnergies{0.01, 0.005, 0, 3e-4, 1e-5, 1e-4};
  certificate.curves = {{"tensile warp", 5, 500, 0.04, 1, 2, 3},
                        {"shear", 1, 30, 0.14, 0.1, 0.2, 0.3},
                        {"bending weft", 1, 8e-6, 250, 1e-6, 2e-6, 1e-4}};
  certificate.segments = 5;
  certificate.reach = CurveReach{{0.01, 0.02}, 0.2, 100};
  certificate.cloth = CertificateMesh{2.5e-3, 0.01, 1, 5e-4, {{0.01, 580, 200}, {5e-3, 2200, 90}}};
  certificate.warnings = {"an oddity"};
  return certificate;
}

Detections small_detections() {
  Detections detections;
  detections.rig = "bench";
  detections.lattice = {Surface::cloth, 2, 2, 0.02, 0.004, {0.04, 0.04}, {0.01, 0.01}, "cc"};
  FrameDetections frame;
  frame.set = "drape_A";
  frame.camera = "cam0";
  frame.width_px = 64;
  frame.height_px = 48;
  frame.image_sha256 = "dd";
  frame.detections.push_back(
      {{0, 1}, {10.5, 20.25}, Eigen::Matrix2d::Identity() * 1e-4, {5, 4}, 0.3, 100, 1.1});
  frame.islands.push_back(
      {0, {{0, 0}, {30, 22}, Eigen::Matrix2d::Identity() * 1e-4, {5, 4}, 0.3, 100, 1.1}});
  frame.rejections.push_back({MarkId{1, 1}, Eigen::Vector2d(1, 2), "partly hidden"});
  frame.tags.push_back({7, Eigen::Matrix<double, 2, 4>::Ones()});
  detections.frames.push_back(frame);
  return detections;
}

Calibration small_calibration() {
  Calibration calibration;
  calibration.method = "tsai";
  calibration.rig = "bench";
  calibration.sets = {"stage_z000"};
  CalibratedCamera camera;
  camera.camera = {"cam0", {BrownLens{1000, 1000, 32, 24, -0.1, 0.01, 0, 0, 0}, 64, 48}, {}};
  camera.camera.cam_from_world.translation_m = {0, 0, 1};
  camera.worked_point = {{0, 0, 0}, {32, 24}};
  calibration.cameras.push_back(camera);
  return calibration;
}

namespace {

/// Copies a file of rigs/bench1 into the folder that its relative paths expect.
std::function<fs::path(const fs::path&)> copied(const std::string& name) {
  return [name](const fs::path& folder) {
    fs::path file = folder / name;
    write_durable(file, read_text(source_root() / "rigs/bench1" / name));
    return file;
  };
}

constexpr const char* kAsciiMesh =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
    "z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n10 0 0\n0 10 "
    "5\n3 0 1 2\n";

std::string binary_mesh() {
  std::string text = kAsciiMesh;
  text = text.substr(0, text.find("end_header\n") + 11);
  text.replace(text.find("ascii"), 5, "binary_little_endian");
  // 3 vertices of three floats 0 or 2, then one face.
  for (int k = 0; k < 9; ++k) text += std::string(3, '\0') + (k == 3 || k == 7 ? '\x40' : '\0');
  text += '\x03';
  for (const char index : {'\0', '\1', '\2'}) text += std::string(1, index) + std::string(3, '\0');
  return text;
}

/// Writes a file with this text.
std::function<fs::path(const fs::path&)> written(const std::string& name, const std::string& text) {
  return [=](const fs::path& folder) {
    write_durable(folder / name, text);
    return folder / name;
  };
}

void read_any_mesh(const fs::path& file) {
  static_cast<void>(read_mesh_file(file));
}

}  // namespace

std::vector<Kind> core_kinds() {
  return {
      {"rig", copied("rig.toml"), [](const fs::path& f) { static_cast<void>(read_rig(f)); }},
      {"target", copied("target.toml"),
       [](const fs::path& f) { static_cast<void>(read_target(f)); }},
      {"print", copied("print.toml"), [](const fs::path& f) { static_cast<void>(read_print(f)); }},
      {"scene", copied("scenes/A.toml"),
       [](const fs::path& f) { static_cast<void>(read_scene(f)); }},
      {"clamped_scene",
       [](const fs::path& folder) {
         fs::path file = copied("scenes/A.toml")(folder);
         write_durable(file,
                       read_text(file) +
                           "\n[[clamp]]\nfrom_material_mm = [0, 0]\nto_material_mm = [0, 200]\n"
                           "from_mm = [0, 0, 200]\nto_mm = [200, 0, 200]\n"
                           "direction = [0, -1, 0]\n");
         return file;
       },
       [](const fs::path& f) { static_cast<void>(read_scene(f)); }, true, "range: direction"},
      {"curve", copied("fabrics/A/bending_warp.csv"),
       [](const fs::path& f) {
         static_cast<void>(read_csv(f, {"curvature_per_cm", "loading_moment_gf_cm_per_cm",
                                        "unloading_moment_gf_cm_per_cm"}));
       },
       true, "out of range"},  // the fabric's reader judges the curve
      {"recording", copied("recording/recording.json"),
       [](const fs::path& f) { static_cast<void>(read_recording(f.parent_path())); }},
      {"detections",
       [](const fs::path& folder) {
         write_detections(folder / "detections.json", small_detections());
         return folder / "detections.json";
       },
       [](const fs::path& f) { static_cast<void>(read_detections(f)); }},
      {"calibration",
       [](const fs::path& folder) {
         write_calibration(folder / "calibration.json", small_calibration());
         return folder / "calibration.json";
       },
       [](const fs::path& f) { static_cast<void>(read_calibration(f)); }},
      {"sheet_json",
       [](const fs::path& folder) {
         write_sheet(folder / "sheet.ply", small_sheet());
         return folder / "sheet.json";
       },
       [](const fs::path& f) { static_cast<void>(read_sheet(f)); }},
      {"sheet_ply",
       [](const fs::path& folder) {
         write_sheet(folder / "sheet.ply", small_sheet());
         return folder / "sheet.ply";
       },
       [](const fs::path& f) { static_cast<void>(read_sheet(f)); }},
      {"certificate",
       [](const fs::path& folder) {
         write_record(folder / "certificate.json", small_certificate());
         return folder / "certificate.json";
       },
       [](const fs::path& f) { static_cast<void>(read_certificate(f)); }},
      {"levels",
       [](const fs::path& folder) {
         write_record(folder / "levels.json", small_levels());
         return folder / "levels.json";
       },
       [](const fs::path& f) {
         static_cast<void>(mesh_error_sentence(read_record<LevelsFile>(f)));
       }},
      {"run_record",
       [](const fs::path& folder) {
         write_durable(folder / "in.txt", "x");
         RunRecord record("drape-thing", {"in.txt"}, folder / "out.run.json");
         record.input(folder / "in.txt");
         record.write(0);
         return folder / "out.run.json";
       },
       [](const fs::path& f) {
         if (!is_up_to_date(f, fs::canonical("/proc/self/exe"), {"in.txt"}))
           throw bad_input("it proves nothing", {.file = f.string()}, "");
       },
       true, "_utc|program|version| \"arguments"},
      // The unit of a mesh stands elsewhere.
      {"mesh_ply", written("mesh.ply", kAsciiMesh), read_any_mesh, true, "out of range"},
      {"mesh_ply_binary", written("mesh.ply", binary_mesh()), read_any_mesh},
      {"mesh_obj",
       written("mesh.obj", "v 0 0 0\nv 10 0 0\nv 0 10 5\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"),
       read_any_mesh, true, "out of range"},
  };
}

}  // namespace drape::test
