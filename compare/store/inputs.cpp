// SPDX-License-Identifier: Apache-2.0
#include "compare/store/inputs.hpp"

#include <fmt/format.h>

#include "core/program/run_record.hpp"
#include "core/recording.hpp"

// Files beside a simulated sheet: certificate.json and levels.json.

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// Adds a warning about the measured sheet; the first {} is replaced by its set.
void warn(Session& session, const DrapeFiles& drape, const char* sentence,
          const std::string& more = {}) {
  session.warnings.push_back(
      fmt::format(fmt::runtime(sentence), drape.input.measured.measured().set, more));
}

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

SheetFile read_sheet_of(const fs::path& file, Session& session) {
  SheetFile sheet = read_sheet_file(file);
  session.read.emplace_back(fs::path(file).replace_extension(".json"), sheet.sha256);
  session.read.emplace_back(fs::path(file).replace_extension(".ply"), sheet.ply_sha256);
  session.outside.insert(session.read.back().first);
  return sheet;
}

void read_detections_beside(DrapeFiles& drape, Session& session) {
  const SheetFile& measured = drape.input.measured;
  const fs::path file = measured.file.parent_path() / "detections.json";
  if (!fs::is_regular_file(file))
    return warn(session, drape,
                "no detections.json lies beside the measured sheet of set {}, so there are no "
                "photographs");
  const std::string sha256 = sha256_of_file(file);
  if (sha256 != drape.input.measured.measured().detections_sha256)
    return warn(session, drape,
                "the detections.json beside the measured sheet of set {} is not the file that it "
                "was made from, so its photographs are left out");
  drape.detections = read_detections(file);
  drape.detections_file = file;
  drape.detected_by = read_made_by(file);
  session.read.emplace_back(file, sha256);
  session.outside.insert(file);
  if (drape.detected_by) find_recording(drape);
}

/// Reads the sensitivities that `drape simulate` wrote beside the sheet that represents the drape.
void read_error_split(DrapeFiles& drape, Session& session) {
  const Simulation* speaker = drape.input.speaker();
  if (speaker == nullptr || speaker->other_simulator) return;
  const fs::path file = speaker->sheet.file.parent_path() / kSensitivityName;
  if (!fs::is_regular_file(file)) return;
  require_as_recorded(file);
  auto made_by = read_made_by(file);
  auto why = other_origin(made_by ? made_by->inputs : HashedFiles(), drape.input);
  if (!why) {
    SensitivityFile split = read_record<SensitivityFile>(file);
    why = other_base(split, drape.input);
    if (!why && split.no_go && split.no_go != drape.input.measured.sheet.no_go)
      why = "rests on a measurement that is NO-GO: " + *split.no_go;
    if (!why) {
      session.read.emplace_back(file, split.document.sha256());
      drape.error_split = std::move(split);
      drape.split_by = std::move(made_by);
      return;
    }
  }
  warn(session, drape,
       "the sensitivity.json of the simulation that speaks for set {} {}, so it is left out; "
       "simulate the drape again with --sensitivity",
       *why);
}

DrapeFiles read_measured(SheetFile sheet, Session& session) {
  DrapeFiles drape;
  drape.input.measured = std::move(sheet);
  read_detections_beside(drape, session);
  drape.measured_by = read_made_by(drape.input.measured.file);
  if (!drape.measured_by)
    warn(
        session, drape,
        "no run record says what made the measured sheet of set {}, so nothing shows that it is as "
        "it was measured");
  return drape;
}

std::string entry_text(const Value& value) {
  if (const auto* text = value.get_if<std::string>()) return *text;
  if (const auto* truth = value.get_if<bool>()) return *truth ? "yes" : "no";
  if (const auto* number = value.get_if<double>()) return fmt::format("{:.6g}", *number);
  if (value.is_null()) return "not stated";
  const auto* list = value.get_if<Value::List>();
  if (list == nullptr) return one_line(value);
  std::string text;
  for (const Value& item : *list) text += (text.empty() ? "" : "; ") + entry_text(item);
  return text.empty() ? "none" : text;
}

/// Lists every plain value with its path. Tables in a list are named by their first text.
void flatten(const Value& value, const std::string& path, Certificate& certificate) {
  const auto* list = value.get_if<Value::List>();
  if (const auto* table = value.get_if<Value::Table>()) {
    for (const auto& [key, member] : *table)
      if (!path.empty() || key != "schema")
        flatten(member, path.empty() ? key : fmt::format("{}.{}", path, key), certificate);
    return;
  }
  if (list != nullptr && !list->empty() && list->front().get_if<Value::Table>() != nullptr) {
    for (std::size_t i = 0; i < list->size(); ++i) {
      Value item = (*list)[i];
      std::string name = std::to_string(i);
      if (auto* table = item.get_if<Value::Table>()) {
        const auto named = std::find_if(table->begin(), table->end(), [](const auto& member) {
          return member.second.template get_if<std::string>() != nullptr;
        });
        if (named != table->end()) {
          name = *named->second.get_if<std::string>();
          table->erase(named);
        }
      }
      flatten(item, fmt::format("{}.{}", path, name), certificate);
    }
    return;
  }
  certificate.entries.emplace_back(path, entry_text(value));
}

/// Throws Error(bad_input) that names the entry if a certificate contradicts the simulated sheet
/// beside it, since a killed run leaves that of the previous run.
void require_of_sheet(const Certificate& certificate, const Sheet& sheet, const fs::path& file) {
  const auto& source = std::get<SimulatedSource>(sheet.source);
  const std::pair<const char*, std::string> of_sheet[] = {
      {"options.rows", std::to_string(sheet.rows)},
      {"options.cols", std::to_string(sheet.cols)},
      {"options.segments", std::to_string(source.segments)},
      {"options.spacing_mm", source.spacing_m ? fmt::format("{:.6g}", *source.spacing_m / units::mm)
                                              : std::string("not stated")},
      {"at_rest", source.status == "at rest" ? "yes" : "no"}};
  for (const auto& [name, wanted] : of_sheet)
    for (const auto& [entry, value] : certificate.entries)
      if (entry == name && value != wanted)
        throw bad_input(fmt::format("the certificate says `{}`, the sheet beside it `{}`: one of "
                                    "them is of another run",
                                    value, wanted),
                        {.file = file.string(), .field = name}, "simulate the drape again");
}

/// The sheet with the files beside it.
Simulation read_simulated(SheetFile sheet, Session& session) {
  Simulation simulation;
  simulation.sheet = std::move(sheet);
  const fs::path folder = simulation.sheet.file.parent_path();
  if (const fs::path file = folder / "certificate.json"; fs::is_regular_file(file)) {
    const Document document = Document::read(file);  // of any version: each entry can be absent
    require_format(document, format_of<drape::Certificate>);
    simulation.certificate = {document.sha256(), {}};
    flatten(document.root(), "", *simulation.certificate);
    require_of_sheet(*simulation.certificate, simulation.sheet.sheet, file);
    session.read.emplace_back(file, simulation.certificate->sha256);
  }
  if (const fs::path file = folder / "levels.json"; fs::is_regular_file(file)) {
    simulation.levels = read_record<LevelsFile>(file);
    if (!simulation.sheet.has_content(simulation.levels->sheet_sha256))
      throw bad_input("the meshes are of another sheet than the one beside them",
                      {.file = file.string(), .field = "sheet_sha256"}, "simulate the drape again");
    session.read.emplace_back(file, simulation.levels->document.sha256());
  }
  if (const auto listed = branch_of(simulation.sheet.file)) {
    simulation.branch = listed->second;
    session.read.emplace_back(listed->first, listed->second.set_sha256);
  }
  // A sheet of an earlier run, which the list above it no longer names.
  if (!simulation.branch && fs::is_regular_file(folder / ".." / "branches.json") &&
      !read_made_by(simulation.sheet.file))
    throw bad_input(
        "no record says what made this sheet, and branches.json above it does not name it",
        {.file = simulation.sheet.file.string()}, "leave it out: it is of an earlier run");
  return simulation;
}

void take_scene(DrapeFiles& drape, const fs::path& file, Session& session) {
  session.read.emplace_back(file, sha256_of_file(file));
  drape.input.scene = read_record<Scene>(file);  // as it was used
}

/// The scene file named by the run record, if it still has the values that the run read; the one
/// with this hash if given.
std::optional<fs::path> scene_file_of(const std::optional<StepRecord>& made_by,
                                      const std::optional<std::string>& scene_sha256 = {}) {
  if (made_by)
    for (const auto& [file, sha256] : made_by->inputs)
      if (sha256 == scene_sha256.value_or(sha256) && made_by->as_read.contains(file)) return file;
  return std::nullopt;
}

/// Finds the scene of each simulation and that of the drape, after all its simulations are known:
/// the speaker's, or the one with which the marks were measured, if its file is unchanged. Throws
/// Error for a scene that cannot be read.
void find_scenes(DrapeFiles& drape, Session& session) {
  std::vector<Simulation>& simulations = drape.input.simulations;
  if (simulations.empty()) {
    if (const auto file = scene_file_of(drape.measured_by)) take_scene(drape, *file, session);
    return;
  }
  std::map<std::string, fs::path> files;  // by SHA-256
  for (std::size_t i = 0; i < simulations.size(); ++i) {
    const auto& made_by = drape.simulated_by[i];
    const auto file = scene_file_of(made_by, simulations[i].source().scene_sha256);
    if (!file) {
      if (made_by)
        session.warnings.push_back(
            fmt::format("the scene of the simulation {} is not as that read it, so that the values "
                        "of its scene and fabric are not stored",
                        simulations[i].label()));
      continue;
    }
    simulations[i].scene = read_simulated_scene(*file, made_by->inputs);
    files.emplace(simulations[i].source().scene_sha256, *file);
  }
  const std::string& sha256 = drape.input.speaker()->source().scene_sha256;
  if (const auto own = files.find(sha256); own != files.end())
    take_scene(drape, own->second, session);
}

/// Finds the ensemble of the drape's speaking branch, if its program read the current measured
/// sheet and so located it among the branches. Throws Error for a list that cannot be read.
void find_ensemble(DrapeFiles& drape) {
  const Simulation* one = drape.input.speaking_branch();
  if (one == nullptr) return;
  const fs::path list = one->sheet.file.parent_path() / ".." / "branches.json";
  const SheetFile& measured = drape.input.measured;
  const auto& start = one->source().start_sha256;
  bool placed = start && measured.has_content(*start);
  if (const auto made_by = read_made_by(list))
    for (const auto& [file, sha256] : made_by->inputs)
      placed = placed || measured.has_content(sha256);
  const auto branches = list_above(one->sheet.file, one->branch->set_sha256);
  if (!placed || !branches || !branches->measured) return;
  drape.input.placed = branches->measured;
  if (branches->band.empty()) drape.input.placed->inside_fraction.reset();
}

void warn_of_unrecorded(const DrapeFiles& drape, Session& session) {
  std::size_t unrecorded = 0;
  for (std::size_t i = 0; i < drape.simulated_by.size(); ++i)
    unrecorded += !drape.simulated_by[i] && !drape.input.simulations[i].other_simulator;
  if (unrecorded > 0)
    warn(session, drape,
         "no run record says what made {1} of the simulated sheets beside the measured one of set "
         "{0}, so nothing shows that they are as they were simulated",
         std::to_string(unrecorded));
}

void add_other(const fs::path& file, Session& session) {
  if (session.drapes.empty()) {
    throw bad_input("another simulator's mesh stands before any measured sheet",
                    {.file = file.string()}, "give it after the measured sheet of its drape");
  }
  DrapeFiles& drape = session.drapes.back();
  const auto note = [&, description = sha256_of_file(file)](const std::string& sha256,
                                                            const fs::path& mesh,
                                                            const std::string& mesh_sha256) {
    session.read.emplace_back(file, description);
    session.read.emplace_back(mesh, mesh_sha256);
    session.meshes.emplace(mesh_sha256, mesh);
    session.mesh_contents.emplace(sha256, other_mesh_content(description, mesh_sha256));
  };
  if (auto surface = read_other_surface(file)) {
    note(surface->sha256, surface->mesh_file, surface->mesh_sha256);
    drape.input.surfaces.push_back(std::move(*surface));
    return;
  }
  Simulation simulation = read_other_mesh(file, drape.input.measured.sheet);
  note(simulation.sheet.sha256, simulation.other_file, simulation.sheet.ply_sha256);
  drape.simulated_by.emplace_back();
  drape.input.simulations.push_back(std::move(simulation));
}

void add_virtual_only(Simulation simulation, Session& session) {
  for (std::vector<Simulation>& group : session.virtual_only)
    if (group.front().source().scene == simulation.source().scene)
      return group.push_back(std::move(simulation));
  session.virtual_only.push_back({std::move(simulation)});
}

void read_calibration_of(const fs::path& file, Session& session) {
  session.calibration_file = file;
  session.calibration = read_calibration(file);
  session.calibration_sha256 = sha256_of_file(file);
  session.calibrated_by = read_made_by(file);
  session.read.emplace_back(file, session.calibration_sha256);
  for (const DrapeFiles& drape : session.drapes) {
    const MeasuredSource& source = drape.input.measured.measured();
    if (source.calibration_sha256 == session.calibration_sha256) continue;
    throw bad_input(
        "the sheet was measured with another calibration (SHA-256 " +
            source.calibration_sha256.substr(0, 12) + "...) than " + file.string(),
        {.file = drape.input.measured.file.string(), .field = "source.calibration_sha256"},
        "give that calibration, or triangulate again with this one");
  }
}

/// The scene of a drape, which is that of its simulations.
std::string scene_of(const DrapeFiles& drape) {
  for (const Simulation& simulation : drape.input.simulations)
    if (!simulation.other_simulator) return simulation.source().scene;
  const auto& own = drape.input.measured.repeat;
  return own ? own->scene : std::string();
}

/// Throws if the same marks are given under another name, which is not another laying.
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

/// Adds a repeat to every drape of its scene except that of the sheet itself, since for each of
/// them it is another laying.
void add_repeat(const fs::path& file, Session& session) {
  SheetFile sheet = read_sheet_of(file, session);
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

constexpr int kDeepest = 8;  ///< levels of folders under the given one

struct Found {
  std::vector<fs::path> alone, measured, repeats, gone;
};

std::vector<fs::path> folders_of(const fs::path& folder) {
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_directory() && !entry.is_symlink()) folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  return folders;
}

/// Adds the sheet of the folder, or the folder itself if it has a run record but no sheet.
void add_sheet(const fs::path& folder, std::vector<fs::path>& sheets, Found& found) {
  if (fs::is_regular_file(folder / "sheet.json")) {
    sheets.push_back(folder / "sheet.ply");
  } else if (fs::is_regular_file(run_record_path(folder / "sheet.ply"))) {
    found.gone.push_back(folder);
  }
}

/// Adds the branches named by the ensemble's list, whatever an earlier run left. A list without its
/// record is of a run that did not end.
void add_extras(const fs::path& drape, Found& found) {
  const fs::path list = drape / "ensemble" / "branches.json";
  if (!fs::is_regular_file(list) || !fs::is_regular_file(run_record_path(list))) return;
  for (const ListedBranch& branch : read_record<BranchList>(list).branches) {
    const fs::path sheet =
        name_inside(list.parent_path(), branch.sheet, {.file = list.string(), .field = "sheet"});
    const bool there = fs::is_regular_file(fs::path(sheet).replace_extension(".json"));
    there ? found.measured.push_back(sheet) : found.gone.push_back(sheet.parent_path());
  }
}

void walk(const fs::path& folder, int depth, Found& found) {  // NOLINT(misc-no-recursion)
  if (fs::is_regular_file(folder / "sheet.json") &&
      read_sheet_record(folder / "sheet.json").is_measured()) {
    found.measured.push_back(folder / "sheet.ply");
    for (const char* below : {"simulations", "branches"})
      if (fs::is_directory(folder / below))
        for (const fs::path& one : folders_of(folder / below))
          add_sheet(one, found.measured, found);
    add_extras(folder, found);
    if (found.measured.back() != folder / "sheet.ply" && fs::is_directory(folder / "repeats"))
      for (const fs::path& one : folders_of(folder / "repeats"))
        add_sheet(one, found.repeats, found);
    return;
  }
  add_sheet(folder, found.alone, found);
  if (depth == kDeepest) return;
  for (const fs::path& below : folders_of(folder)) walk(below, depth + 1, found);
}

}  // namespace

Session read_session(const std::vector<fs::path>& sheets, const fs::path& calibration_file,
                     const std::vector<fs::path>& repeats) {
  Session session;
  for (const fs::path& file : sheets) {
    if (file.extension() == ".toml") {
      add_other(file, session);
      continue;
    }
    SheetFile sheet = read_sheet_of(file, session);
    if (sheet.sheet.is_measured()) {
      // A drape has one verdict in a run, and a copied folder is not another drape.
      for (const DrapeFiles& drape : session.drapes)
        if (const SheetFile& known = drape.input.measured; known.sha256 == sheet.sha256)
          throw bad_input("this measured sheet is the same as that of " + known.file.string(),
                          {.file = sheet.file.string()},
                          "give the sheet once, or move the copied folder away");
      session.drapes.push_back(read_measured(std::move(sheet), session));
    } else if (session.drapes.empty()) {
      add_virtual_only(read_simulated(std::move(sheet), session), session);
    } else {
      DrapeFiles& drape = session.drapes.back();
      drape.simulated_by.push_back(read_made_by(file));
      drape.input.simulations.push_back(read_simulated(std::move(sheet), session));
    }
  }
  if (session.drapes.empty() && session.virtual_only.empty())
    throw usage_error("no sheet was given", "name a measured sheet and its simulations");
  for (DrapeFiles& drape : session.drapes) {
    warn_of_unrecorded(drape, session);
    find_scenes(drape, session);
    find_ensemble(drape);
    tell_apart(drape.input.simulations);
    read_error_split(drape, session);
  }
  for (auto& group : session.virtual_only) tell_apart(group);
  for (const fs::path& file : repeats) add_repeat(file, session);
  if (!calibration_file.empty()) read_calibration_of(calibration_file, session);
  return session;
}

std::vector<std::string> moved_objects(const std::vector<SheetFile>& layings,
                                       const std::vector<SheetFile>& simulations) {
  std::optional<AskedScene> first;
  std::vector<std::string> reasons;
  const auto add = [&](const SheetFile& sheet, const std::optional<std::string>& why) {
    if (why)
      reasons.push_back(fmt::format("{}: its object is not where that of {} was: {}",
                                    sheet.file.string(), layings.front().file.string(), *why));
  };
  for (const SheetFile& sheet : layings) {
    if (!first) first = sheet.asked;
    if (sheet.asked)
      add(sheet, difference_of(first->surroundings, sheet.asked->surroundings, "in its scene"));
  }
  if (!first) return reasons;
  for (const SheetFile& sheet : simulations) {
    const auto* source = std::get_if<SimulatedSource>(&sheet.sheet.source);
    if (source == nullptr || source->scene_sha256 == first->sha256) continue;
    const auto made_by = read_made_by(sheet.file);
    const auto file = scene_file_of(made_by, source->scene_sha256);
    const auto scene = file ? read_simulated_scene(*file, made_by->inputs) : std::nullopt;
    add(sheet, scene ? difference_of(first->surroundings, scene->surroundings)
                     : std::optional<std::string>("its scene file is not there as simulated"));
  }
  return reasons;
}

GivenFiles files_in(const std::vector<fs::path>& given) {
  Found found;
  std::vector<fs::path> files, calibrations;
  for (const fs::path& path : given) {
    if (!fs::is_directory(path)) {
      files.push_back(path);
      continue;
    }
    const fs::path calibration = path / "calibration.json";
    if (fs::is_regular_file(calibration)) calibrations.push_back(calibration);
    const auto before = static_cast<std::ptrdiff_t>(found.alone.size());
    walk(path, 0, found);
    if (files.empty()) continue;
    // Simulations without a measured sheet may belong to the group that a file before started.
    files.insert(files.end(), found.alone.begin() + before, found.alone.end());
    found.alone.erase(found.alone.begin() + before, found.alone.end());
  }
  if (!found.gone.empty())
    throw bad_input(fmt::format("the sheet of a run is gone, of {} in all", found.gone.size()),
                    {.file = found.gone.front().string()},
                    "run it again, or remove the folder to leave it out");
  std::vector<fs::path> sheets = std::move(found.alone);
  sheets.insert(sheets.end(), files.begin(), files.end());
  sheets.insert(sheets.end(), found.measured.begin(), found.measured.end());
  if (sheets.empty())
    throw usage_error("there is no sheet to import", "name sheets, or a folder with sheets below");
  return {std::move(sheets), std::move(found.repeats),
          calibrations.size() == 1 ? calibrations.front() : fs::path()};
}

}  // namespace drape::compare
