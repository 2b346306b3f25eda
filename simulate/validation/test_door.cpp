// SPDX-License-Identifier: Apache-2.0
#include "simulate/validation/test_door.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <stdlib.h>  // mkdtemp

#include <cmath>
#include <filesystem>
#include <limits>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/checker/certify.hpp"
#include "simulate/fabric/csv_text.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using units::mm;

constexpr int kCurvePoints = 101;  // as many as the fit of segments looks at

/// A folder of its own, gone at the end.
class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "drapebench-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
      throw bad_input("no temporary folder can be made", {.file = name}, "see TMPDIR");
    path = name;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  fs::path path;
};

std::string list_mm(const Vector3d& p) {
  return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", p.x() / mm, p.y() / mm, p.z() / mm);
}

/// A curve file: `value` at equidistant abscissae, both branches alike.
void write_curve(const fs::path& file, const std::vector<std::string>& names, double least,
                 double most, double x_unit, double f_unit,
                 const std::function<double(double)>& value) {
  std::vector<std::vector<double>> columns(3);
  for (int k = 0; k < kCurvePoints; ++k) {
    const double x = least + (most - least) * k / (kCurvePoints - 1);
    columns[0].push_back(x / x_unit);
    columns[1].push_back(value(x) / f_unit);
    columns[2].push_back(columns[1].back());
  }
  write_durable(file, csv_text(names, columns));
}

void write_fabric(const DoorCase& c, const fs::path& folder) {
  write_curve(folder / "tensile.csv",
              {"strain_percent", "loading_force_gf_per_cm", "unloading_force_gf_per_cm"}, 0, 0.03,
              units::percent, units::gf_per_cm, [&](double x) { return c.tensile.value(x); });
  write_curve(folder / "shear.csv",
              {"shear_angle_deg", "loading_force_gf_per_cm", "unloading_force_gf_per_cm"}, -0.5,
              0.5, units::deg, units::gf_per_cm, [&](double x) { return c.shear_n_per_m * x; });
  write_curve(folder / "bending.csv",
              {"curvature_per_cm", "loading_moment_gf_cm_per_cm", "unloading_moment_gf_cm_per_cm"},
              -250, 250, units::per_cm, units::gf_cm_per_cm,
              [&](double x) { return c.bending_n_m * x; });
  const double bias_n_m = (2 * c.bending_n_m + c.twist_n_m) / 4;
  write_durable(
      folder / "fabric.toml",
      fmt::format("schema = \"drapebench/fabric/1\"\nname = \"form\"\n"
                  "areal_density_g_per_m2 = {:.17g}\n"
                  "[tensile]\nwarp = \"tensile.csv\"\nweft = \"tensile.csv\"\n"
                  "[shear]\nwarp = \"shear.csv\"\nweft = \"shear.csv\"\n"
                  "[bending]\nwarp = \"bending.csv\"\nweft = \"bending.csv\"\n"
                  "bias_stiffness_gf_cm2_per_cm = {:.17g}\n",
                  c.density_kg_per_m2 / units::g_per_m2, bias_n_m / units::gf_cm2_per_cm));
}

void write_print(const DoorCase& c, const fs::path& folder) {
  const GridSpec grid = c.grid();
  write_durable(folder / "print.toml",
                fmt::format("schema = \"drapebench/print/1\"\nrows = {}\ncols = {}\n"
                            "pitch_mm = {:.17g}\ndot_diameter_mm = {:.17g}\n"
                            "patch_mm = [{:.17g}, {:.17g}]\nmargin_mm = [0, 0]\n",
                            c.rows, c.cols, c.spacing_m / mm, 0.1 * c.spacing_m / mm,
                            grid.patch_m.x() / mm, grid.patch_m.y() / mm));
}

void write_scene(const DoorCase& c, const Vector3d& origin, const fs::path& folder) {
  std::string text = fmt::format(
      "schema = \"drapebench/scene/1\"\nname = \"form\"\nfabric = \"fabric.toml\"\n"
      "print = \"print.toml\"\ntable_z_mm = {:.17g}\nfriction = {:.17g}\n"
      "gravity_m_per_s2 = [{:.17g}, {:.17g}, {:.17g}]\n[start]\n",
      (c.table_z_m + origin.z()) / mm, c.friction, c.gravity_m_per_s2.x(), c.gravity_m_per_s2.y(),
      c.gravity_m_per_s2.z());
  text += c.starts_flat ? fmt::format("mode = \"flat\"\ncentre_mm = {}\n", list_mm(origin))
                        : "mode = \"measured\"\n";
  for (const int i : c.pinned) {
    const int row = i / c.cols, col = i % c.cols;
    const double u = row * c.spacing_m, v = col * c.spacing_m;
    text += fmt::format("[[pin]]\nrow = {}\ncol = {}\nat_mm = {}\n", row, col,
                        list_mm((c.held_at ? c.held_at : c.start)(u, v) + origin));
  }
  for (const Clamp& clamp : c.clamps) {
    text += fmt::format(
        "[[clamp]]\nfrom_material_mm = [{:.17g}, {:.17g}]\nto_material_mm = [{:.17g}, {:.17g}]\n"
        "from_mm = {}\nto_mm = {}\ndirection = {}\n",
        clamp.from_material_m.x() / mm, clamp.from_material_m.y() / mm,
        clamp.to_material_m.x() / mm, clamp.to_material_m.y() / mm,
        list_mm(clamp.from_in_world + origin), list_mm(clamp.to_in_world + origin),
        list_mm(mm * clamp.direction_in_world));
  }
  write_durable(folder / "scene.toml", text);
}

void write_start(const DoorCase& c, const Vector3d& origin, const fs::path& folder) {
  Sheet sheet{c.rows, c.cols, c.grid().patch_m, {}, {}, MeasuredSource{"form", "form", {}, "", ""}};
  for (int i = 0; i < c.rows * c.cols; ++i) {
    const int row = i / c.cols, col = i % c.cols;
    const double u = row * c.spacing_m, v = col * c.spacing_m;
    sheet.marks.push_back({{row, col}, {u, v}, c.start(u, v) + origin, {}, {}, {}});
  }
  write_sheet(folder / "start.ply", sheet);
}

}  // namespace

DoorRun run_door_case(const DoorCase& c, Solver solver, const Vector3d& origin) {
  const Folder folder;
  write_fabric(c, folder.path);
  write_print(c, folder.path);
  write_scene(c, origin, folder.path);
  std::optional<Sheet> start;
  if (!c.starts_flat) {
    write_start(c, origin, folder.path);
    start = read_sheet(folder.path / "start.ply");
  }
  const Scene scene = read_scene(folder.path / "scene.toml");
  const Fabric fabric = read_fabric(scene.fabric_file);
  const Print print = read_print(scene.print_file);
  SimulateOptions options;
  options.rows = c.rows;
  options.cols = c.cols;
  options.solver = solver;
  options.segments = 1 + static_cast<int>(c.tensile.hinges.size());
  options.residual_tolerance = c.motion_tolerance;
  options.static_tolerance = c.static_tolerance;
  options.damping_per_s = c.damping_per_s;
  options.cloth_thickness_m = 0;
  options.max_steps = c.motion_steps;
  SimulateResult result = simulate(scene, fabric, print, start, options);
  judge_rest(result, scene, fabric, print, options);
  DoorRun run{result.report.status == RestStatus::at_rest, result.report.sentence,
              Field(3 * static_cast<std::size_t>(c.rows) * c.cols, std::nan("")),
              result.history.back().stretch_j, result.history.back().shear_j};
  for (const SheetMark& mark : result.sheet.marks)
    put_at(run.position, mark.mark.row * c.cols + mark.mark.col, mark.point_in_world - origin);
  return run;
}

double worst_error(const DoorForm& form, Solver solver) {
  double worst = 0;
  for (const Vector3d& origin : {Vector3d(0, 0, 0), Vector3d(0.3, -0.2, 1)}) {
    std::vector<DoorRun> runs;
    for (const DoorCase& one : form.cases) {
      runs.push_back(run_door_case(one, solver, origin));
      if (!form.all_must_rest || runs.back().rests) continue;
      ADD_FAILURE() << form.what << ", " << drape::name_of(solver) << ": " << runs.back().sentence;
      return std::numeric_limits<double>::infinity();
    }
    const double error = std::abs(form.measure(runs) / form.exact - 1);
    if (!(error <= worst)) worst = error;
  }
  return worst;
}

void expect_form(const DoorForm& form) {
  for (const Solver solver : {Solver::fall, Solver::rk4})
    expect_at_most(fmt::format("{}, by files, {}: error", form.what, drape::name_of(solver)),
                   worst_error(form, solver), form.goal);
}

}  // namespace drape::simulate
