// SPDX-License-Identifier: Apache-2.0
// 441 marks x 1,000 runs: import, the grouping query, list, and the size of the file. The import is
// compared with the same rows in one transaction without manifest, keys and checks.
#include <SQLiteCpp/SQLiteCpp.h>
#include <benchmark/benchmark.h>

#include "compare/history/results.hpp"
#include "compare/history/verify.hpp"
#include "compare/store/outcome.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using units::mm;

constexpr int kDrapes = 250, kSimulations = 4, kSide = 21;

/// A sheet of 21 x 21 points, distinguished from others only by `salt`.
SheetFile sheet_file(const Sheet& sheet, const std::string& salt) {
  return {"sheet.ply", sha256_of("json" + salt), sha256_of("ply" + salt), sheet};
}

Sheet sheet_of(double height_m) {
  Sheet sheet;
  sheet.rows = sheet.cols = kSide;
  sheet.patch_m = {0.22, 0.22};
  for (int row = 0; row < kSide; ++row) {
    for (int col = 0; col < kSide; ++col) {
      const Eigen::Vector2d material(0.011 * row, 0.011 * col);
      const double wave = height_m * (1 + 0.1 * row + 0.01 * col);
      sheet.marks.push_back({{row, col},
                             material,
                             {material.y(), -material.x(), wave},
                             Eigen::Matrix3d(Eigen::Matrix3d::Identity() * 1e-9),
                             3,
                             0.1});
    }
  }
  return sheet;
}

struct Prepared {
  std::vector<DrapeInput> inputs;
  std::vector<Report> reports;
};

/// Everything before the import: sheets and their distances.
const Prepared& prepared() {
  static const Prepared result = [] {
    Prepared made;
    for (int drape = 0; drape < kDrapes; ++drape) {
      DrapeInput input;
      const std::string name = std::to_string(drape);
      Sheet measured = sheet_of(0.001 * (drape + 1));
      measured.source = MeasuredSource{
          "rig", "set" + name, {"cam0"}, sha256_of("calibration"), sha256_of("detections" + name)};
      input.measured = sheet_file(measured, "m" + name);
      Report report;
      report.name = "A";
      report.measurement = {kSide * kSide, 0, 1e-5, 1e-5};
      for (int k = 0; k < kSimulations; ++k) {
        Sheet simulated = sheet_of(0.0);
        SimulatedSource source;
        source.scene = std::string(1, static_cast<char>('A' + drape % 6));
        source.fabric = "fabric" + std::to_string(drape % 5);
        source.scene_sha256 = sha256_of(source.scene);
        source.fabric_sha256 = sha256_of(source.fabric);
        source.segments = k % 2 == 0 ? 1 : 5;
        source.model = k < 2 ? "consistent" : "paper";
        source.solver = "rk4";
        source.status = "at rest";
        simulated.source = source;
        input.simulations.push_back(
            {sheet_file(simulated, "s" + name + "-" + std::to_string(k)), {}, {}});
        RealVirtual row;
        row.simulation = static_cast<std::size_t>(k);
        row.marks = compare_marks(measured, Surface(simulated, "s"));
        row.statistics = statistics_of(row.marks.marks);
        report.real_virtual.push_back(std::move(row));
        report.drapemeters.emplace_back();
      }
      made.inputs.push_back(std::move(input));
      made.reports.push_back(std::move(report));
    }
    return made;
  }();
  return result;
}

fs::path folder() {
  return fs::temp_directory_path() / "drapebench-store-benchmark";
}

void fill(const fs::path& file) {
  fs::remove_all(folder());
  fs::create_directories(folder());
  Store store(file);
  for (int i = 0; i < kDrapes; ++i)
    store.write([at = static_cast<std::size_t>(i)](Writer& writer) {
      add(writer, prepared().inputs[at], prepared().reports[at]);
    });
  store.close();
}

void import_1000_runs(benchmark::State& state) {
  (void)prepared();
  const fs::path file = folder() / "results.sqlite";
  for ([[maybe_unused]] auto _ : state) fill(file);
  state.counters["file_MB"] = static_cast<double>(fs::file_size(file)) / 1e6;
  state.counters["marks"] = kDrapes * kSimulations * kSide * kSide;
  fs::remove_all(folder());
}
BENCHMARK(import_1000_runs)->Unit(benchmark::kMillisecond)->Iterations(1);

void baseline_plain_rows(benchmark::State& state) {
  (void)prepared();
  for ([[maybe_unused]] auto _ : state) {
    fs::remove_all(folder());
    fs::create_directories(folder());
    SQLite::Database database((folder() / "plain.sqlite").string(),
                              SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    database.exec("CREATE TABLE mark_error (run, r, c, rx, ry, rz, vx, vy, vz, d)");
    SQLite::Transaction transaction(database);
    SQLite::Statement insert(database, "INSERT INTO mark_error VALUES (?,?,?,?,?,?,?,?,?,?)");
    int run = 0;
    for (const Report& report : prepared().reports) {
      for (const RealVirtual& row : report.real_virtual) {
        ++run;
        for (const MarkError& mark : row.marks.marks) {
          insert.bind(1, run);
          insert.bind(2, mark.mark.row);
          insert.bind(3, mark.mark.col);
          for (int k = 0; k < 3; ++k) {
            insert.bind(4 + k, mark.real_in_world[k] / mm);
            insert.bind(7 + k, mark.virtual_in_world[k] / mm);
          }
          insert.bind(10, mark.distance_m / mm);
          insert.exec();
          insert.reset();
        }
      }
    }
    transaction.commit();
  }
  fs::remove_all(folder());
}
BENCHMARK(baseline_plain_rows)->Unit(benchmark::kMillisecond)->Iterations(1);

void query(benchmark::State& state, const std::string& sql) {
  const fs::path file = folder() / "results.sqlite";
  fill(file);
  const StoreReader reader(file);
  std::size_t rows = 0;
  for ([[maybe_unused]] auto _ : state) rows = reader.query(sql).rows.size();
  state.counters["rows"] = static_cast<double>(rows);
  fs::remove_all(folder());
}
BENCHMARK_CAPTURE(query, mean_by_fabric_grid_segments,
                  "SELECT fabric, discretisation, segments, avg(mean_dist_mm), count(*) FROM "
                  "v_real_vs_virtual GROUP BY fabric, discretisation, segments")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(query, mean_by_fabric_grid_segments_from_unsorted_view,
                  "SELECT fabric, discretisation, segments, avg(mean_dist_mm), count(*) FROM "
                  "v_comparison GROUP BY fabric, discretisation, segments")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(
    query, mean_by_fabric_grid_segments_from_tables,
    "SELECT f.name, s.grid_rows, s.segments, avg(c.mean_mm), count(*) FROM comparison "
    "AS c JOIN simulation AS s ON s.sheet_sha256 = c.simulated_sha256 JOIN fabric AS f "
    "ON f.sha256 = s.fabric_sha256 GROUP BY 1, 2, 3")
    ->Unit(benchmark::kMillisecond);

void list_1000_runs(benchmark::State& state) {
  const fs::path file = folder() / "results.sqlite";
  fill(file);
  const StoreReader reader(file);
  for ([[maybe_unused]] auto _ : state)
    benchmark::DoNotOptimize(list_results(reader, {}).rows.size());
  fs::remove_all(folder());
}
BENCHMARK(list_1000_runs)->Unit(benchmark::kMillisecond);

void check_rows_of_1000_runs(benchmark::State& state) {
  const fs::path file = folder() / "results.sqlite";
  fill(file);
  const StoreReader reader(file);
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(altered_rows(reader).size());
  fs::remove_all(folder());
}
BENCHMARK(check_rows_of_1000_runs)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
}  // namespace drape::compare
