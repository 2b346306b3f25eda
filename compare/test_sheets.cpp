// SPDX-License-Identifier: Apache-2.0
#include "compare/test_sheets.hpp"

#include <fmt/format.h>

namespace drape::compare::test {
namespace {

namespace fs = std::filesystem;
using units::mm;

constexpr double kPatch_m = 220 * mm;

/// A tent over a ridge, with `sag_m` at its two ends.
Shape tent(double sag_m) {
  return [sag_m](const Eigen::Vector2d& material_m) -> Eigen::Vector3d {
    const Eigen::Vector3d p = flat(material_m);
    const double off = p.x() / (kPatch_m / 2);
    return {p.x(), p.y(), -sag_m * off * off};
  };
}

}  // namespace

Eigen::Vector3d flat(const Eigen::Vector2d& material_m) {
  return {material_m.y() - kPatch_m / 2, kPatch_m / 2 - material_m.x(), 0};
}

Shape raised(double height_m) {
  return [height_m](const Eigen::Vector2d& material_m) -> Eigen::Vector3d {
    return flat(material_m) + Eigen::Vector3d(0, 0, height_m);
  };
}

ImportCounts add_drape(const fs::path& store, const Sheet& measured,
                       const std::vector<Sheet>& simulated) {
  const DrapeInput input = drape_of(measured, simulated);
  Store results(store);
  const ImportCounts counts = add(results, input, compare_drape(input, {}));
  results.close();
  return counts;
}

Outcome import_run(const fs::path& store, const Session& session, const RunLabel& label) {
  Outcome outcome;
  compare_session(session, {}, outcome);
  outcome.stored = import_session(store, session, outcome, label);
  return outcome;
}

std::string one(const StoreReader& store, const std::string& sql) {
  return store.query(sql).rows.at(0).at(0);
}

Sheet measured_sheet(const Shape& shape) {
  Sheet sheet;
  sheet.rows = sheet.cols = 11;
  sheet.patch_m = {kPatch_m, kPatch_m};
  for (int row = 0; row < 11; ++row) {
    for (int col = 0; col < 11; ++col) {
      const Eigen::Vector2d material_m(10 * mm + row * 20 * mm, 10 * mm + col * 20 * mm);
      SheetMark mark{{row, col}, material_m, shape(material_m), std::nullopt, 3, 0.05};
      mark.covariance_m2 = Eigen::Matrix3d::Identity() * (0.03 * mm) * (0.03 * mm);
      sheet.marks.push_back(mark);
    }
  }
  sheet.source = MeasuredSource{"bench",
                                "drape_A",
                                {"cam0", "cam1", "cam2"},
                                sha256_of(std::string_view("calibration")),
                                sha256_of(std::string_view("detections"))};
  return sheet;
}

Sheet simulated_sheet(int n, int segments, const Shape& shape) {
  Sheet sheet;
  sheet.rows = sheet.cols = n;
  sheet.patch_m = {kPatch_m, kPatch_m};
  for (int row = 0; row < n; ++row) {
    for (int col = 0; col < n; ++col) {
      const Eigen::Vector2d material_m(kPatch_m * row / (n - 1), kPatch_m * col / (n - 1));
      sheet.marks.push_back({{row, col}, material_m, shape(material_m), {}, {}, {}});
    }
  }
  SimulatedSource source;
  source.scene = "A";
  source.fabric = "cotton-like";
  source.scene_sha256 = sha256_of(std::string_view("scene"));
  source.fabric_sha256 = sha256_of(sha256_of(std::string_view("fabric")) + "\n");
  source.segments = segments;
  source.model = "consistent";
  source.solver = "rk4";
  source.status = "at rest";
  sheet.source = source;
  return sheet;
}

Sheet mesh_sheet(double spacing_m, int segments, const Shape& shape) {
  Sheet sheet = simulated_sheet(23, segments, shape);
  auto& source = std::get<SimulatedSource>(sheet.source);
  source.model = "triangles";
  source.solver.clear();
  source.spacing_m = spacing_m;
  return sheet;
}

LevelsFile levels_of(const Sheet& measured, double left_m) {
  LevelsFile levels;
  levels.levels = {{10 * mm, 600, true, "at rest", 90, std::nullopt},
                   {2.5 * mm, 9000, true, "at rest", 200, 3 * left_m}};
  levels.left_m = left_m;
  for (const SheetMark& mark : measured.marks)
    levels.marks.push_back({mark.mark, mark.point_in_world, left_m, {}});
  return levels;
}

Branch branch(const std::string& list_sha256, int number, int of, double energy_j, int starts,
              bool round) {
  Branch made;
  made.set_sha256 = list_sha256;
  made.number = number;
  made.of = of;
  made.energy_j = energy_j;
  made.residual = 1e-7;
  made.starts.assign(static_cast<std::size_t>(starts), 0);
  made.hem_nodes = 4;
  made.round = round;
  return made;
}

SheetFile file_of(const Sheet& sheet) {
  std::string content;
  for (const SheetMark& mark : sheet.marks) {
    content += fmt::format("{} {} {} {} {};", mark.mark.row, mark.mark.col, mark.point_in_world.x(),
                           mark.point_in_world.y(), mark.point_in_world.z());
  }
  if (const auto* source = std::get_if<SimulatedSource>(&sheet.source))
    content += fmt::format("{} {} {} {} {}", source->segments, source->model, source->status,
                           source->spacing_m.value_or(0), source->from_measured);
  return {"sheet.ply", sha256_of("json" + content), sha256_of("ply" + content), sheet};
}

DrapeInput drape_of(const Sheet& measured, const std::vector<Sheet>& simulated) {
  DrapeInput input{file_of(measured), {}};
  input.measured.asked = AskedScene{"A", sha256_of(std::string_view("scene")), {}};
  for (const Sheet& sheet : simulated) input.simulations.push_back({file_of(sheet), {}, {}});
  return input;
}

std::vector<fs::path> write_example(const fs::path& folder) {
  Sheet measured = measured_sheet(tent(60 * mm));
  for (const std::size_t index : {120U, 5U}) {
    const MarkId mark = measured.marks[index].mark;
    measured.gaps.insert(measured.gaps.begin(), {mark, "seen by one camera only <2>"});
    measured.marks.erase(measured.marks.begin() + static_cast<std::ptrdiff_t>(index));
  }
  std::vector<fs::path> files = {folder / "sheet.ply"};
  write_sheet(files.back(), measured);
  Json json = parse_json(read_text(folder / "sheet.json"));
  json["source"]["asked_scene"] = {{"name", "A"},
                                   {"sha256", sha256_of(std::string_view("scene"))},
                                   {"surroundings", Json::object()}};
  write_json(folder / "sheet.json", json);
  double sag_m = 50 * mm;
  for (const int n : {11, 21}) {
    for (const int segments : {1, 5}) {
      const fs::path place = folder / "simulations" / fmt::format("{}-{}", n, segments);
      files.push_back(place / "sheet.ply");
      write_sheet(files.back(), simulated_sheet(n, segments, tent(sag_m += 2 * mm)));
      write_durable(place / "certificate.json",
                    "{\"schema\": \"drapebench/certificate/1\", \"status\": \"at rest\", "
                    "\"residual_force_mN\": 0.001}\n");
      write_durable(place / "history.csv",
                    "time_s,residual_force_mN\n0,10\n0.5,0.1\n1,0.002\n1.5,0.001\n");
    }
  }
  return files;
}

namespace {

/// Writes a run record with these inputs and outputs, as the program would.
void write_step(const std::string& program, const std::vector<std::string>& arguments,
                const std::vector<fs::path>& inputs, const std::vector<fs::path>& outputs) {
  RunRecord record(program, arguments, run_record_path(outputs.back()));
  for (const fs::path& file : inputs) record.input(file);
  for (const fs::path& file : outputs) record.output(file);
  record.option("method", "the usual one");
  record.option("limit_px", "0.3");
  record.write(0);
}

}  // namespace

std::vector<fs::path> write_recorded_example(const fs::path& folder) {
  const fs::path bench = folder / "bench", out = folder / "A";
  std::vector<fs::path> photographs;
  for (const char* camera : {"cam0", "cam1", "cam2"}) {
    photographs.push_back(bench / "recording" / "drape_A" / (std::string(camera) + ".png"));
    write_durable(photographs.back(), std::string("photograph of ") + camera);
  }
  std::vector<fs::path> seen = photographs;
  seen.push_back(bench / "recording" / "list.json");
  write_durable(seen.back(), "{}\n");
  write_durable(bench / "scene.toml", "# the sphere\n");
  write_durable(bench / "fabric.toml", "# the cloth\n");
  write_durable(bench / "fabric" / "bending_warp.csv", "curvature_per_cm,moment_gf\n0,0\n1,0.05\n");
  std::vector<fs::path> sheets = write_example(out);
  write_durable(out / "points.json", "{\"centres\": 121}\n");
  write_step("drape-detect", {"recording", "--sets", "drape_A"}, seen, {out / "points.json"});
  write_step("drape-triangulate", {"points.json", "--set", "drape_A"}, {out / "points.json"},
             {out / "sheet.json", out / "sheet.ply"});
  for (std::size_t i = 1; i < sheets.size(); ++i) {
    const fs::path place = sheets[i].parent_path();
    write_step("drape-simulate", {"scene.toml", "--grid", std::to_string(i)},
               {bench / "scene.toml", bench / "fabric.toml", bench / "fabric" / "bending_warp.csv",
                out / "sheet.json"},
               {place / "certificate.json", place / "history.csv", place / "sheet.json",
                place / "sheet.ply"});
  }
  return sheets;
}

}  // namespace drape::compare::test
