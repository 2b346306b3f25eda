// SPDX-License-Identifier: Apache-2.0
// Formats owned by one stage.
#include "capture/live/live_capture.hpp"
#include "capture/recording/record.hpp"
#include "compare/crate/crate.hpp"
#include "compare/hems/hem_files.hpp"
#include "compare/repeats/repeats.hpp"
#include "core/acceptance_file.hpp"
#include "core/drape_mesh.hpp"
#include "core/files/files.hpp"
#include "core/program/run_record.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/study/study.hpp"
#include "tests/formats/formats.hpp"
#include "tests/support/paths.hpp"
#include "triangulate/plate/plate.hpp"
#include "triangulate/points.hpp"

namespace drape::test {
namespace {

constexpr const char* kCameras =
    "schema = \"drapebench/cameras/1\"\n[sync]\nmethod = \"free_run\"\nframe_rate_hz = 5\n"
    "[reference]\nrecording = \"recording\"\nset = \"empty\"\n"
    "[[camera]]\nname = \"cam0\"\nbackend = \"aravis\"\ndevice = \"12345\"\nexposure_us = 5000\n"
    "gain_db = 3\n";
constexpr const char* kLab =
    "schema = \"drapebench/lab/1\"\ntitle = \"A cloth\"\ndescription = \"one drape\"\nlicense = "
    "\"https://example.org\"\nlicense_name = \"free\"\n[[author]]\nname = \"Ada\"\norcid = "
    "\"https://orcid.org/0000\"\n";
constexpr const char* kPoints =
    "schema = \"drapebench/points/1\"\ninstrument = \"DICe\"\nunit_mm = 25.4\nsigma_mm = 0.02\n"
    "correlation_mm = 5.0\n[columns]\nx = \"X\"\ny = \"Y\"\nz = \"Z\"\ndx = \"U\"\ndy = \"V\"\ndz "
    "= "
    "\"W\"\nwarp = \"s\"\nweft = \"t\"\nsigma = \"e\"\nvalid = \"ok\"\n[[point]]\nname = "
    "\"corner\"\n"
    "in_file = [1.0, 2.0, 3.0]\nin_world_mm = [4.0, 5.0, 6.0]\nuncertainty_mm = 0.1\n[[point]]\n"
    "in_file = [1.0, 2.0, 3.0]\nat_material_mm = [0.0, 10.0]\n";
constexpr const char* kMesh =
    "schema = \"drapebench/mesh/1\"\nname = \"Other 1.0\"\nmesh = \"other.ply\"\nunit_mm = "
    "1.0\nup = \"z\"\nscene = \"A\"\nfabric = \"cotton\"\n[grid]\ninner = \"weft\"\ninner_count = "
    "2\nwarp_from_mm = 40.0\nwarp_to_mm = 0.0\nweft_from_mm = 0.0\nweft_to_mm = 40.0\n";

AcceptanceFile small_acceptance() {
  AcceptanceFile file;
  file.rig = "bench1";
  file.calibration_sha256 = std::string(64, 'a');
  file.date = "2026-01-31";
  file.positions = 8;
  file.cause = "cam1 moved since the calibration";
  AcceptanceRow& length = file.figures.emplace_back();
  length.name = "length error";
  length.unit = *(length.smallest_fault_unit = "mm");
  length.where = "set pose_03";
  length.value = 0.012;
  length.expanded = 0.02;
  length.limit = 0.05;
  length.smallest_fault = 0.1;
  file.figures.emplace_back().not_measured = "one position alone";
  return file;
}

RunFile small_run() {
  RunFile run;
  run.program = "drape-thing";
  run.version = "0.1.0";
  run.program_sha256 = std::string(64, 'a');
  run.arguments = run.decisive_arguments = {"in.toml"};
  run.options = {{"segments", "5"}};
  run.inputs = {{"in.toml", "bb", "cc", {"drape_A"}}};
  run.outputs = {{"out.json", "dd"}};
  run.started_utc = run.ended_utc = "2026-01-31T00:00:00Z";
  return run;
}

capture::SetDetails small_details() {
  capture::SetDetails details;
  details.set = "drape_A";
  details.recorded_on = "2026-01-31";
  details.moment.trigger = 3;
  details.moment.spread_s = 1e-4;
  details.still.cameras.emplace_back().name = "cam0";
  capture::CameraDetails& camera = details.cameras.emplace_back();
  camera.report.name = "cam0";
  camera.report.identity = {"maker", "model", "12345", "10.0.0.2", "10.0.0.1"};
  camera.report.settings = {{"exposure_us", "5000"}};
  camera.report.clock.emplace();
  camera.pixel_format = "Mono8";
  details.report.faults = {{"cam0", "a frame came late", "check the network", 2}};
  return details;
}

compare::RepeatsFile small_repeats() {
  compare::RepeatsFile file;
  file.repeats.resize(2);
  file.repeats[0].file = "a/sheet.json";
  file.repeats[1].file = "b/sheet.json";
  file.found.marks = 2;
  file.found.real_to_real_m = {{0, 1e-3}, {1e-3, 0}};
  compare::MarkRepeats::SheetMatch& match = file.found.matches.emplace_back();
  match.name = "virtual/sheet.json";
  match.marks = 2;
  match.bases = {{"marks", file.found.real_to_real_m, {2e-3, 2e-3}, {}, "2 repeats"}};
  match.reason = "2 repeats";
  return file;
}

compare::HemsFile small_hems() {
  compare::HemsFile file;
  file.geometry = {"iso-300", 0.180, 0.300};
  compare::HemRecord& record = file.hems.emplace_back();
  record.file = "hem.png";
  record.fabric = record.sample = "1";
  record.hem = compare::hem_of_radii(std::vector<double>(72, 0.1));
  record.numbers = compare::numbers_of(record.hem, file.geometry);
  record.nodes = {{0.1, 0.11, 0.01, 0.05}};
  record.warnings = {"an oddity"};
  file.refused = {"other.png: no hem"};
  file.matches.emplace_back().virtual_file = "start-00.ply";
  return file;
}

triangulate::MeasuredObject small_object() {
  return {{{"x_mm", 1.5, 0.1, 1, 0.5}}, {"y_mm: 3 stated, 5 measured"}, 12, 0.1, 1.1};
}

}  // namespace

std::vector<DescribedFormat> stage_formats() {
  const auto rig_file = [](const char* name) { return read_text(source_root() / "rigs" / name); };
  return {described<capture::CamerasFile>(kCameras),
          described(small_details()),
          described<simulate::FabricFile>(rig_file("bench1/fabrics/A.toml")),
          described<simulate::PlanFile>(rig_file("paper/plan.toml")),
          described(small_object()),
          described<DrapeMesh>(kMesh),
          described<triangulate::PointsDescription>(kPoints),
          described<compare::Lab>(kLab),
          described(small_hems()),
          described(small_repeats()),
          described(small_acceptance()),
          described(Ending{.verdict = "72 marks",
                           .numbers = {{"marks", "72"}},
                           .rejected = {"2 dots: hidden"},
                           .warnings = {"an oddity"},
                           .advice = {"more light"},
                           .next_command = "drape report",
                           .tables = "a table\n"}),
          described(small_run())};
}

}  // namespace drape::test
