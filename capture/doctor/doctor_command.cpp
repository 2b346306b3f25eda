// SPDX-License-Identifier: Apache-2.0
// drape-capture doctor: checks if the bench is fit to measure; prints GO or NO-GO with remedies.
#include <fmt/format.h>

#include "capture/commands.hpp"
#include "capture/doctor/checks.hpp"
#include "core/fields/records.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"

namespace drape::capture {

namespace fs = std::filesystem;

namespace {

struct DoctorOptions {
  fs::path rig, out = ".";
  std::optional<fs::path> calibration;
};

void fields(Fields& f, DoctorOptions& o) {
  f(Field{"rig", "folder with rig.toml and cameras.toml"}.called("RIG"), o.rig);
  f.otherwise({"out", "folder for recordings, to check disk space and speed"}, o.out);
  f({"calibration", "calibration.json in use"}, o.calibration);
}

int tell(const std::vector<Check>& checks, const CommonOptions& common) {
  Value json, list(Value::List{});
  Ending ending;
  for (const auto& c : checks) {
    ending.go = ending.go && c.go;
    ending.numbers.emplace_back(c.name, fmt::format("{:<5}  {}", c.go ? "GO" : "NO-GO", c.found));
    if (!c.go) ending.rejected.push_back(fmt::format("{}; to do: {}", c.name, c.to_type));
    list.append(value_of(c));
  }
  ending.verdict = ending.go ? "the bench is fit to measure" : "the bench is not fit to measure";
  ending.next_command =
      ending.go ? "drape capture RIG --set NAME --out RECORDING" : "drape doctor RIG";
  if (!common.json) return finish(ending, common);
  json["verdict"] = ending.go ? "GO" : "NO-GO";
  json["checks"] = std::move(list);
  print_text(pretty(json));
  return ending.go ? 0 : 1;
}

}  // namespace

int doctor_command(int argc, char** argv) {
  const auto run = [](const DoctorOptions& o, const CommonOptions& common) {
    return tell(check_all(look_at_bench(o.rig, o.out, o.calibration)), common);
  };
  return run_command<DoctorOptions>(
      argc, argv, "drape-capture doctor",
      "Checks whether the bench is fit to measure: GO or NO-GO for each check, and what to type.\n",
      run);
}

}  // namespace drape::capture
