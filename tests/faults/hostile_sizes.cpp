// SPDX-License-Identifier: Apache-2.0
// Files larger than they look: sparse ones, millions of small values, plans with millions of cases.
#include <sys/types.h>
#include <unistd.h>

#include <fstream>
#include <stdexcept>

#include "core/files/files.hpp"
#include "tests/faults/hostile_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRun = "run rig --single --out out";
constexpr const char* kCompareSizes =
    "compare out/C/sheet.json out/C/simulations/10mm-1/sheet.json --calibration "
    "out/calibration.json "
    "--report out/r/report.html --store out/r/results.sqlite";
constexpr off_t kSparse = off_t{1900} << 20;  ///< bytes; takes none on the disk

/// The file's own bytes followed by holes.
HostileFile sparse(const std::string& name, const std::string& file, const std::string& line) {
  return {name,
          [file](const HostileBench& b) {
            if (!fs::exists(b.lab() / file)) b.write(file, "x");
            if (::truncate((b.lab() / file).c_str(), kSparse) != 0)
              throw std::runtime_error("truncate");
          },
          line};
}

/// `before`, the unit many times, `after`; never held in the memory of the test.
HostileFile long_file(const std::string& name, const std::string& file, const std::string& before,
                      const std::string& unit, long times, const std::string& after,
                      const std::string& line) {
  return {name,
          [=](const HostileBench& b) {
            std::ofstream stream(b.lab() / file, std::ios::binary);
            stream << before;
            for (long i = 0; i < times; ++i) stream << unit;
            stream << after;
          },
          line};
}

/// Writes `steps` records, each of which makes its file from that of the next.
void write_chain(const HostileBench& bench, int steps) {
  const std::string folder = "out/C/simulations/10mm-1/";
  const std::string sha256 = sha256_of(std::string_view("x"));
  const auto file = [&](int i) {
    return Json::array({{{"file", "f" + std::to_string(i)}, {"sha256", sha256}}});
  };
  Json record = parse_json(read_text(bench.lab() / (folder + "sheet.run.json")));
  Json first = record;
  for (int i = 0; i < steps; ++i) {
    record["outputs"] = file(i);
    record["inputs"] = file(i + 1);
    std::ofstream(bench.lab() / (folder + "f" + std::to_string(i))) << "x";
    std::ofstream(bench.lab() / (folder + std::to_string(i) + ".run.json")) << record.dump();
  }
  first["inputs"].push_back(file(0)[0]);
  bench.write(folder + "sheet.run.json", first.dump());
}

constexpr const char* kPlan =
    "schema = \"drapebench/plan/1\"\nscenes = [\"rig/scenes/C.toml\"]\nspacings_mm = [20]\n"
    "segments = [1]\nseeds = [";

}  // namespace

std::vector<HostileFile> hostile_sizes() {
  return {
      sparse("sparse_rig", "rig/rig.toml", "check rig"),
      sparse("sparse_sheet", "out/C/sheet.json", kCompareSizes),
      sparse("sparse_curve", "rig/fabrics/A/bending_warp.csv", kRun),
      sparse("sparse_recording", "rig/recording/recording.json", kRun),
      sparse("sparse_image", "images/set/cam0.png", "import images --out recording"),
      sparse("sparse_mesh", "m.ply", "drapemeter m.ply --out out/dm"),
      long_file("json_of_20_million_lists", "out/C/sheet.json",
                "{\"schema\": \"drapebench/sheet/1\", \"x\": [", "[],", 20'000'000, "[]]}",
                kCompareSizes),
      long_file("toml_of_10_million_lists", "rig/scenes/C.toml",
                "schema = \"drapebench/scene/1\"\nx = [", "[],", 10'000'000, "]\n", "check rig"),
      long_file("csv_of_20_million_lines", "rig/fabrics/A/bending_warp.csv", "a,b,c\n", "0,0,0\n",
                20'000'000, "", kRun),
      long_file("plan_of_2_million_cases", "plan.toml", kPlan, "1,", 2'000'000, "]\n",
                "study plan.toml --part 1/2 --out st"),
      {"records_of_3000_steps", [](const HostileBench& b) { write_chain(b, 3000); }, kCompareSizes},
      {"formula_as_name_of_a_hem",
       [](const HostileBench& b) {
         fs::create_directory(b.lab() / "hems");
         fs::copy(b.lab() / "out/C/simulations/10mm-1/sheet.ply",
                  b.lab() / "hems" / (kFormulaName + ".ply"));
       },
       "drapemeter hems --out out/dm"},
  };
}

}  // namespace drape::test
