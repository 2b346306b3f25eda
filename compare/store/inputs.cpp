// SPDX-License-Identifier: Apache-2.0
#include "compare/store/inputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "compare/meshes/other_mesh.hpp"
#include "compare/records/provenance.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/run_record.hpp"
#include "core/recording.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// The recording that the detections were found in; its date when its list is still there.
void find_recording(DrapeFiles& drape) {
  for (const auto& [file, sha256] : drape.detected_by->inputs) {
    if (file.filename() != "recording.json") continue;
    drape.recording =
        RecordingId{sha256, std::nullopt, file.parent_path().filename().generic_string()};
    if (fs::is_regular_file(file) && sha256_of_file(file) == sha256)
      drape.recording->recorded_on = read_recording(file.parent_path()).recorded_on;
  }
}

std::optional<RepeatId> read_repeat(const fs::path& json) {
  const JsonNode source = JsonNode::open(json, "sheet", 1).at("source");
  if (!source.has("repeat")) return std::nullopt;
  const JsonNode id = source.at("repeat");
  return RepeatId{id.name("scene"), id.name("repeat"), id.text("face")};
}

SheetFile read_sheet_file(const fs::path& file, Session& session) {
  require_as_recorded(file);
  fs::path json = file, ply = file;
  json.replace_extension(".json");
  ply.replace_extension(".ply");
  SheetFile sheet{file, {}, {}, read_sheet(file)};
  if (sheet.sheet.is_measured()) {
    sheet.repeat = read_repeat(json);
    sheet.asked = read_asked_scene(json);
  }
  sheet.sha256 = sha256_of_file(json);
  sheet.ply_sha256 = sha256_of_file(ply);
  session.read.emplace_back(json, sheet.sha256);
  session.read.emplace_back(ply, sheet.ply_sha256);
  return sheet;
}

void read_detections_beside(DrapeFiles& drape, Session& session) {
  const SheetFile& measured = drape.input.measured;
  const fs::path file = measured.file.parent_path() / "detections.json";
  const auto& source = std::get<MeasuredSource>(measured.sheet.source);
  if (!fs::is_regular_file(file)) {
    session.warnings.push_back(fmt::format(
        "no detections.json lies beside the measured sheet of set {}, so there are no photographs",
        source.set));
    return;
  }
  const std::string sha256 = sha256_of_file(file);
  if (sha256 != source.detections_sha256) {
    session.warnings.push_back(
        fmt::format("the detections.json beside the measured sheet of set {} is not the file that "
                    "it was made from, so its photographs are left out",
                    source.set));
    return;
  }
  drape.detections = read_detections(file);
  drape.detections_file = file;
  drape.detected_by = read_made_by(file);
  session.read.emplace_back(file, sha256);
  if (drape.detected_by) find_recording(drape);
}

/// `drape simulate sensitivity` writes what it found beside the sheet that it measured distances
/// from.
void read_error_split_beside(DrapeFiles& drape, Session& session) {
  const SheetFile& measured = drape.input.measured;
  const fs::path file = measured.file.parent_path() / "sensitivity" / "sensitivity.json";
  if (!fs::is_regular_file(file)) return;
  require_as_recorded(file);
  auto made_by = read_made_by(file);
  auto why = other_origin(made_by ? made_by->inputs : HashedFiles(), drape.input);
  if (!why) {
    ErrorSplitFile split = read_error_split(file);
    why = other_base(split, drape.input);
    if (!why && split.no_go && split.no_go != measured.sheet.no_go)
      why = "rests on a measurement that is NO-GO: " + *split.no_go;
    if (!why) {
      session.read.emplace_back(file, split.sha256);
      drape.error_split = std::move(split);
      drape.split_by = std::move(made_by);
      return;
    }
  }
  session.warnings.push_back(
      fmt::format("the sensitivity.json beside the measured sheet of set {} {}, so it is left out; "
                  "run drape simulate sensitivity again",
                  std::get<MeasuredSource>(measured.sheet.source).set, *why));
}

DrapeFiles read_measured(SheetFile sheet, Session& session) {
  DrapeFiles drape;
  drape.input.measured = std::move(sheet);
  read_detections_beside(drape, session);
  drape.measured_by = read_made_by(drape.input.measured.file);
  if (!drape.measured_by)
    session.warnings.push_back(
        fmt::format("no run record says what made the measured sheet of set {}, so nothing shows "
                    "that it is as it was measured",
                    std::get<MeasuredSource>(drape.input.measured.sheet.source).set));
  return drape;
}

/// Left by an earlier run of what wrote the list above it, whose files it is not among any more.
void require_listed(const fs::path& sheet) {
  const fs::path above = sheet.parent_path() / "..";
  for (const char* list : {"branches.json", "refinement.json"})
    if (fs::is_regular_file(above / list) && !read_made_by(sheet))
      throw bad_input(fmt::format("no record says what made this sheet, and {} above it does not "
                                  "name it",
                                  list),
                      {.file = sheet.string()}, "leave it out: it is of an earlier run");
}

/// The sheet with the files beside it, and the run record of what made it.
Simulation read_simulated(SheetFile sheet, Session& session) {
  Simulation simulation;
  simulation.sheet = std::move(sheet);
  const fs::path folder = simulation.sheet.file.parent_path();
  if (const fs::path file = folder / "certificate.json"; fs::is_regular_file(file)) {
    simulation.certificate = read_certificate(file);
    require_of_sheet(*simulation.certificate, simulation.sheet.sheet, file);
    session.read.emplace_back(file, simulation.certificate->sha256);
  }
  if (const fs::path file = folder / "history.csv"; fs::is_regular_file(file)) {
    simulation.history = read_history(file);
    session.read.emplace_back(file, sha256_of_file(file));
  }
  if (auto listed = refined_of(simulation.sheet.file)) {
    session.read.emplace_back(listed->list, listed->refined.list_sha256);
    simulation.refined = std::move(listed->refined);
  }
  if (const auto listed = branch_of(simulation.sheet.file)) {
    simulation.branch = listed->branch;
    session.read.emplace_back(listed->list, listed->branch.set_sha256);
  }
  if (!simulation.branch && !simulation.refined) require_listed(simulation.sheet.file);
  return simulation;
}

void add_simulated(Simulation simulation, DrapeFiles& drape) {
  drape.simulated_by.push_back(read_made_by(simulation.sheet.file));
  drape.input.simulations.push_back(std::move(simulation));
}

void warn_of_unrecorded(const DrapeFiles& drape, Session& session) {
  std::size_t unrecorded = 0;
  for (std::size_t i = 0; i < drape.simulated_by.size(); ++i) {
    const Simulation& simulation = drape.input.simulations[i];
    if (drape.simulated_by[i] || simulation.other_simulator) continue;
    ++unrecorded;
  }
  if (unrecorded > 0)
    session.warnings.push_back(fmt::format(
        "no run record says what made {} of the simulated sheets beside the measured one "
        "of set {}, so nothing shows that they are as they were simulated",
        unrecorded, std::get<MeasuredSource>(drape.input.measured.sheet.source).set));
}

void add_other(const fs::path& file, Session& session) {
  if (session.drapes.empty()) {
    throw bad_input("another simulator's mesh stands before any measured sheet",
                    {.file = file.string()}, "give it after the measured sheet of its drape");
  }
  DrapeFiles& drape = session.drapes.back();
  session.read.emplace_back(file, sha256_of_file(file));
  if (auto surface = read_other_surface(file)) {
    session.read.emplace_back(surface->mesh_file, surface->mesh_sha256);
    drape.input.surfaces.push_back(std::move(*surface));
    return;
  }
  Simulation simulation = read_other_mesh(file, drape.input.measured.sheet);
  session.read.emplace_back(simulation.other_file, simulation.sheet.ply_sha256);
  drape.simulated_by.emplace_back();
  drape.input.simulations.push_back(std::move(simulation));
}

void add_virtual_only(Simulation simulation, Session& session) {
  auto& groups = session.virtual_only;
  const auto same = std::find_if(groups.begin(), groups.end(), [&](const auto& group) {
    return group.front().source().scene == simulation.source().scene;
  });
  if (same != groups.end()) {
    same->push_back(std::move(simulation));
  } else {
    groups.push_back({std::move(simulation)});
  }
}

void read_calibration_of(const fs::path& file, Session& session) {
  session.calibration_file = file;
  session.calibration = read_calibration(file);
  session.calibration_sha256 = sha256_of_file(file);
  session.calibrated_by = read_made_by(file);
  session.read.emplace_back(file, session.calibration_sha256);
  for (const DrapeFiles& drape : session.drapes) {
    const auto& source = std::get<MeasuredSource>(drape.input.measured.sheet.source);
    if (source.calibration_sha256 == session.calibration_sha256) continue;
    throw bad_input(
        "the sheet was measured with another calibration (SHA-256 " +
            source.calibration_sha256.substr(0, 12) + "...) than " + file.string(),
        {.file = drape.input.measured.file.string(), .field = "source.calibration_sha256"},
        "give that calibration, or triangulate again with this one");
  }
}

/// The scene of a drape: that of its simulations.
std::string scene_of(const DrapeFiles& drape) {
  for (const Simulation& simulation : drape.input.simulations)
    if (!simulation.other_simulator) return simulation.source().scene;
  const auto& own = drape.input.measured.repeat;
  return own ? own->scene : std::string();
}

/// A drape has one verdict in a run, so a copied folder is not another drape.
void require_new(const SheetFile& sheet, const Session& session) {
  for (const DrapeFiles& drape : session.drapes) {
    if (drape.input.measured.sha256 != sheet.sha256) continue;
    throw bad_input(
        "this measured sheet is the same as that of " + drape.input.measured.file.string(),
        {.file = sheet.file.string()}, "give the sheet once, or move the copied folder away");
  }
}

/// The same marks under another name are no other laying.
void require_no_copy(const SheetFile& sheet, const DrapeInput& drape) {
  std::vector<const SheetFile*> layings = {&drape.measured};
  for (const SheetFile& repeat : drape.repeats) layings.push_back(&repeat);
  for (const SheetFile* other : layings) {
    if (other->sha256 == sheet.sha256)
      throw bad_input("this sheet is given twice for one drape", {.file = sheet.file.string()},
                      "give each repeat once");
    if (other->ply_sha256 == sheet.ply_sha256)
      throw bad_input("it is a copy of " + other->file.string() + ", which is no repeat",
                      {.file = sheet.file.string(), .field = "marks"}, "give each laying once");
  }
}

/// Joins every drape of its scene but the one that it is the sheet of: of each of them it is
/// another laying.
void add_repeat(const fs::path& file, Session& session) {
  SheetFile sheet = read_sheet_file(file, session);
  if (!sheet.repeat)
    throw bad_input("the sheet does not say which repeat of which drape it is",
                    {.file = file.string(), .field = "source.repeat"},
                    "measure it with drape-triangulate --repeat NAME --scene FILE");
  bool known = false, joined = false;
  for (DrapeFiles& drape : session.drapes) {
    if (scene_of(drape) != sheet.repeat->scene) continue;
    known = true;
    if (drape.input.measured.sha256 == sheet.sha256) continue;
    require_no_copy(sheet, drape.input);
    drape.input.repeats.push_back(sheet);
    joined = true;
  }
  if (!known)
    throw bad_input(fmt::format("no drape of scene `{}` is given", sheet.repeat->scene),
                    {.file = file.string(), .field = "source.repeat"},
                    "give that drape's sheet and simulations, or leave the repeat out");
  if (!joined)
    throw bad_input("this sheet is given twice for one drape", {.file = file.string()},
                    "give each repeat once");
}

}  // namespace

std::optional<MadeBy> read_made_by(const fs::path& output) {
  const fs::path record = run_record_path(output);
  if (!fs::is_regular_file(record)) {
    RecordBook book;
    const StepRecord* step = book.maker_of(output);
    if (step == nullptr) return std::nullopt;
    return MadeBy{step->program, step->version, step->arguments, step->inputs};
  }
  const JsonNode root = JsonNode::open(record, "run", kRunVersion);
  MadeBy made_by{root.text("program"), root.text("version"), root.texts("arguments"), {}};
  for (const JsonNode& input : root.items("inputs")) {
    made_by.inputs.emplace_back((record.parent_path() / input.text("file")).lexically_normal(),
                                input.text("sha256"));
  }
  return made_by;
}

Session read_session(const std::vector<fs::path>& sheets, const fs::path& calibration_file,
                     const std::vector<fs::path>& repeats) {
  Session session;
  for (const fs::path& file : sheets) {
    if (file.extension() == ".toml") {
      add_other(file, session);
      continue;
    }
    SheetFile sheet = read_sheet_file(file, session);
    if (sheet.sheet.is_measured()) {
      require_new(sheet, session);
      session.drapes.push_back(read_measured(std::move(sheet), session));
    } else if (session.drapes.empty()) {
      add_virtual_only(read_simulated(std::move(sheet), session), session);
    } else {
      add_simulated(read_simulated(std::move(sheet), session), session.drapes.back());
    }
  }
  if (session.drapes.empty() && session.virtual_only.empty())
    throw usage_error("no sheet was given", "name a measured sheet and its simulations");
  for (DrapeFiles& drape : session.drapes) {
    warn_of_unrecorded(drape, session);
    find_scenes(drape, session);
    find_ensemble(drape);
    tell_apart(drape.input.simulations);
    read_error_split_beside(drape, session);
  }
  for (auto& group : session.virtual_only) tell_apart(group);
  for (const fs::path& file : repeats) add_repeat(file, session);
  if (!calibration_file.empty()) read_calibration_of(calibration_file, session);
  return session;
}

}  // namespace drape::compare
