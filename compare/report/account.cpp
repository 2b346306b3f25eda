// SPDX-License-Identifier: Apache-2.0
#include "compare/report/account.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cctype>

#include "compare/tables/match.hpp"
#include "core/drape_mesh.hpp"
#include "core/geometry/body.hpp"
#include "core/matching.hpp"
#include "core/program/words.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;
using units::percent;

constexpr int kPointsPerCell = 3;         ///< per cell along a line of the virtual cloth
constexpr std::size_t kMostFaces = 8000;  ///< of an object; a finer mesh is not drawn
constexpr int kMostPoints = 40;           ///< per side; of finer sheets every k-th row is drawn

/// Rounds to a tenth of a pixel or millimetre, finer than a screen shows; zero has no sign.
double tenth(double value) {
  return std::round(value * 10) / 10 + 0.0;
}

void append(std::vector<double>& list, const Vector3d& point_m) {
  for (int k = 0; k < 3; ++k) list.push_back(tenth(point_m[k] / mm));
}

/// Adds the quads of an object; a mesh has triangles with two equal corners, and none if its file
/// no longer exists.
void add_object(const Obstacle& obstacle, std::vector<double>& corners_mm) {
  for (const SurfaceQuad& quad : surface_of(obstacle, 24, 300 * mm))
    for (const SurfaceCorner& corner : quad) append(corners_mm, corner.point);
  const auto* object = std::get_if<MeshObject>(&obstacle);
  if (object == nullptr) return;
  try {
    const MeshFile mesh = read_mesh_file(object->file);
    for (const auto& [a, b, c] : mesh.triangles)
      for (const MeshCorner& corner : {a, b, c, c})
        append(corners_mm, object->world_from_mesh * (mesh.points[corner.point] * mm).eval());
  } catch (const Error&) {
    return;
  }
}

/// A point of the virtual sheet in one photograph.
struct Seen {
  Vector2d px;
  bool faces_camera = false;
};

/// The virtual sheet projected into one camera.
class Photographed {
 public:
  Photographed(const Camera* camera, const SheetFile& cloth)
      : camera_(camera), surface_(cloth.sheet, cloth.file.string()) {}

  /// Absent without a calibration, outside the sheet, or behind the camera.
  [[nodiscard]] std::optional<Seen> at(const Vector2d& material_m) const {
    const auto point = camera_ ? surface_.at(material_m) : std::nullopt;
    if (!point) return std::nullopt;
    const auto seen = project(camera_->model, camera_->cam_from_world * point->point_in_world);
    if (!seen) return std::nullopt;
    return Seen{seen->px, point->normal.dot(centre_in_world(*camera_) - point->point_in_world) > 0};
  }

  /// Adds a line through the material, split where the cloth turns its back to the camera.
  void add_line(const Vector2d& from, const Vector2d& to, int samples, ReportedView& view) const {
    std::vector<double> line;
    bool faces = true;
    const auto flush = [&] {
      if (line.size() > 2) (faces ? view.front : view.back).push_back(line);
      line.erase(line.begin(), line.size() > 2 ? line.end() - 2 : line.begin());
    };
    for (int i = 0; i <= samples; ++i) {
      const auto seen = at(from + (to - from) * i / samples);
      if (!seen || seen->faces_camera != faces) flush();
      if (!seen) line.clear();
      if (!seen) continue;
      faces = seen->faces_camera;
      line.insert(line.end(), {tenth(seen->px.x()), tenth(seen->px.y())});
    }
    flush();
  }

 private:
  const Camera* camera_;
  Surface surface_;
};

/// Adds rows, columns and edges of the virtual cloth.
void add_lines(const Photographed& cloth, const SheetFile& measured, ReportedView& view) {
  const Sheet& sheet = measured.sheet;
  const auto lattice = LatticeCoordinates::of(sheet, measured.file.string());
  if (!lattice) return;
  for (const int axis : {0, 1}) {
    const int lines = axis == 0 ? sheet.rows : sheet.cols;
    const int samples = ((axis == 0 ? sheet.cols : sheet.rows) + 1) * kPointsPerCell;
    for (int i = -1; i <= lines; ++i) {
      Vector2d from = Vector2d::Zero(), to = sheet.patch_m;
      from[axis] = to[axis] = i < 0        ? 0
                              : i == lines ? sheet.patch_m[axis]
                                           : lattice->at({i, i})[axis];
      cloth.add_line(from, to, samples, view);
    }
  }
}

ReportedView view_of(const FrameDetections& frame, const Camera* camera, const DrapeInput& input,
                     const RealVirtual& headline) {
  ReportedView view{frame.camera, "", frame.width_px, frame.height_px, {}, {}, {}, {}};
  const Photographed cloth(camera, input.simulations[headline.simulation].sheet);
  Eigen::AlignedBox2d crop;
  for (const Detection& seen : frame.detections) {
    std::vector<double> mark{static_cast<double>(seen.mark.row), static_cast<double>(seen.mark.col),
                             tenth(seen.centre_px.x()), tenth(seen.centre_px.y())};
    crop.extend(seen.centre_px);
    const auto& marks = headline.marks.marks;
    const auto error = std::ranges::find(marks, seen.mark, &MarkError::mark);
    if (const auto place = error == marks.end() ? std::nullopt : cloth.at(error->material_m))
      mark.insert(mark.end(), {tenth(place->px.x()), tenth(place->px.y())});
    view.marks.push_back(std::move(mark));
  }
  for (const MarkError& mark : headline.marks.marks)
    if (const auto place = cloth.at(mark.material_m)) crop.extend(place->px);
  const Eigen::AlignedBox2d image(Vector2d::Zero(), Vector2d(frame.width_px, frame.height_px));
  if (crop.isEmpty() || !(crop.sizes().minCoeff() > 0)) crop = image;
  const Vector2d margin = Vector2d::Constant(0.1 * crop.sizes().maxCoeff());
  crop = Eigen::AlignedBox2d((crop.min() - margin).array().floor().matrix(),
                             (crop.max() + margin).array().ceil().matrix())
             .intersection(image);
  view.crop_px << crop.min(), crop.max();
  if (camera != nullptr) add_lines(cloth, input.measured, view);
  return view;
}

/// Photographs of one drape with its marks and, if calibrated, its virtual cloth.
std::vector<ReportedView> views_of(const DrapeFiles& drape, const Report& report,
                                   const Session& session, const fs::path& folder) {
  std::vector<ReportedView> views;
  if (!drape.detections) return views;
  const RealVirtual& headline = report.speaks();
  for (const FrameDetections& frame : drape.detections->frames) {
    if (frame.set != drape.input.measured.measured().set) continue;
    const CalibratedCamera* camera =
        session.calibration ? session.calibration->find(frame.camera) : nullptr;
    views.push_back(view_of(frame, camera ? &camera->camera : nullptr, drape.input, headline));
    if (!frame.preview_file) continue;
    const fs::path beside = drape.detections_file.parent_path();
    const Where where{.file = drape.detections_file.string(), .field = "preview_file"};
    if (fs::is_regular_file(name_inside(beside, *frame.preview_file, where)))
      views.back().picture = fs::proximate(beside / *frame.preview_file, folder).generic_string();
  }
  return views;
}

/// The virtual cloth with some 40 points per side at most, and the objects under it.
std::optional<ReportedShape> shape_of(const DrapeInput& input, const Report& report) {
  const Sheet& sheet = input.simulations[report.speaks().simulation].sheet.sheet;
  const int step = std::max(1, std::max(sheet.rows, sheet.cols) / kMostPoints);
  const auto places = [&](int count) {
    std::vector<int> list;
    for (int i = 0; i < count - 1; i += step) list.push_back(i);
    list.push_back(count - 1);
    return list;
  };
  const std::vector<int> rows = places(sheet.rows), cols = places(sheet.cols);
  ReportedShape shape{static_cast<int>(rows.size()), static_cast<int>(cols.size()), {}, {}};
  for (const int row : rows) {
    for (const int col : cols) {
      const SheetMark* point = sheet.find({row, col});
      if (point == nullptr) return std::nullopt;  // mesh of another simulator with holes
      append(shape.cloth_mm, point->point_in_world);
    }
  }
  if (input.scene)
    for (const Obstacle& obstacle : input.scene->obstacles) add_object(obstacle, shape.object_mm);
  if (shape.object_mm.size() > 12 * kMostFaces) shape.object_mm.clear();
  return shape;
}

std::string from_folder(const fs::path& file, const fs::path& folder) {
  return fs::proximate(file, folder).generic_string();
}

/// Command line with paths relative to the report's folder.
std::string command(const StepRecord& made_by, const fs::path& folder) {
  std::string text = made_by.program;
  for (std::size_t i = 0; i < made_by.arguments.size(); ++i) {
    const std::string& word = made_by.arguments[i];
    if (word == "--threads") ++i;  // with its number
    if (word == "--threads" || word == "--json" || word == "--quiet") continue;
    std::error_code ignored;
    // A word such as "drape_A" remains a name even if a folder has that name.
    const bool path =
        !word.starts_with('-') && (word.find('/') != std::string::npos ||
                                   (fs::path(word).has_extension() && fs::exists(word, ignored)));
    text += " " + shell_word(path ? from_folder(word, folder) : word);
  }
  return text;
}

/// All steps in the order in which they run.
std::vector<StepRecord> steps_of(const Session& session, const Outcome& outcome) {
  std::vector<StepRecord> steps;
  const auto add = [&](const std::optional<StepRecord>& step) {
    if (step) steps.push_back(*step);
  };
  if (session.calibrated_by)
    for (const auto& [file, sha256] : session.calibrated_by->inputs)  // marks of the target
      if (fs::is_regular_file(file) && sha256_of_file(file) == sha256) add(read_made_by(file));
  add(session.calibrated_by);
  for (const DrapeFiles& drape : session.drapes) {
    add(drape.detected_by);
    add(drape.measured_by);
    for (const auto& step : drape.simulated_by) add(step);
    add(drape.split_by);
  }
  add(StepRecord{"drape-compare", version(), outcome.arguments});
  return steps;
}

/// The measured sheet and the headline simulation of each drape, traced to photographs and curves.
std::vector<std::pair<std::string, std::string>> trees(const Session& session,
                                                       const Outcome& outcome,
                                                       const fs::path& folder) {
  RecordBook book;
  std::vector<std::pair<std::string, std::string>> all;
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    const Report& report = outcome.reports[i];
    if (!report.headline) continue;
    const DrapeInput& input = session.drapes[i].input;
    const Simulation& headline = input.simulations[report.speaks().simulation];
    std::vector<const SheetFile*> sheets = {&input.measured};
    if (!headline.other_simulator) sheets.push_back(&headline.sheet);
    std::string& text = all.emplace_back(report.called(), "").second;
    std::set<fs::path> followed;
    for (const SheetFile* sheet : sheets)
      for (const ChainLink& link : chain_of(book, fs::path(sheet->file).replace_extension(".json"),
                                            sheet->sha256, followed))
        text += fmt::format(
            "{:{}}{}  {}{}  {}\n", "", 2 * link.depth, from_folder(link.file, folder),
            link.sha256.substr(0, 12), link.state == "unchanged" ? "" : " (" + link.state + ")",
            link.made_by.starts_with("drape-") ? link.made_by.substr(0, link.made_by.find(' '))
                                               : link.made_by);
  }
  return all;
}

ReportedProvenance provenance_of(const Session& session, const Outcome& outcome,
                                 const fs::path& folder) {
  ReportedProvenance made;
  std::set<std::pair<std::string, std::string>> read;  // sorted, whatever the form of each path
  for (const auto& [file, sha256] : session.read) read.emplace(from_folder(file, folder), sha256);
  for (const auto& [file, sha256] : read) made.inputs.push_back({file, sha256});
  std::set<std::string> programs, recordings, stand_ins, seen;
  for (const StepRecord& step : steps_of(session, outcome)) {
    programs.insert(step.program + " " + step.version);
    const std::string line = command(step, folder);
    if (seen.insert(line).second) made.commands.push_back(line);  // one run can make several sheets
  }
  for (const DrapeFiles& drape : session.drapes)
    if (const auto& one = drape.recording)
      recordings.insert(fmt::format("{}{}, SHA-256 {}", one->name,
                                    one->recorded_on ? " of " + *one->recorded_on : std::string(),
                                    one->sha256.substr(0, 12)));
  for (const RunValue& value : values_of(session, outcome))
    if (value.key == "stand_ins" && !value.value.empty())
      stand_ins.insert(value.owner + ": " + value.value);
  made.programs.assign(programs.begin(), programs.end());
  made.recordings.assign(recordings.begin(), recordings.end());
  made.stand_ins.assign(stand_ins.begin(), stand_ins.end());
  // A guess need not be called one in a file, such as the twist of a fabric without a bias strip.
  for (const Report& report : outcome.reports)
    if (report.budget)
      for (const BudgetLine& line : report.budget->lines)
        if (line.remedy == "measure " + line.what &&
            !names(made.stand_ins, line.what.substr(0, line.what.find(' '))))
          made.stand_ins.push_back(line.what);
  made.trees = trees(session, outcome, folder);
  return made;
}

ReportedSimulation simulation_of(const Simulation& one, const RealVirtual& row) {
  const SimulatedSource& source = one.source();
  ReportedSimulation made{one.label(),
                          source.model,
                          source.fabric,
                          one.other_simulator ? "not stated" : source.status,
                          one.other_simulator.value_or(""),
                          one.segments(),
                          {},
                          source.spacing_m,
                          {},
                          source.from_measured,
                          row.statistics};
  if (one.branch) made.branch = one.branch->number;
  if (one.levels) made.mesh_error_m = one.levels->left_m;
  return made;
}

ReportedBranches branches_of(const DrapeInput& input, const BranchSet& set) {
  ReportedBranches made{set.label, set.sha256, branch_sentence(input, set), {}};
  for (const BranchComparison& one : set.branches) {
    const Branch& branch = *input.simulations[one.as_placed.simulation].branch;
    made.branches.push_back({branch.number, branch.fraction, &one == &set.branches[set.nearest],
                             branch.stable, one.match_m(), one.as_placed.statistics.shape_m});
  }
  return made;
}

std::vector<ReportedMark> marks_of(const DrapeInput& input, const Report& report) {
  std::map<MarkId, ReportedMark> marks;
  for (const SheetMark& measured : input.measured.sheet.marks) {
    ReportedMark& mark = marks[measured.mark];
    mark.real_in_world = measured.point_in_world;
    mark.views = measured.views;
    mark.sigma_m = worst_sigma_m(measured);
  }
  for (const Gap& gap : input.measured.sheet.gaps) marks[gap.mark].gap = gap.reason;
  if (const auto list = speaking_list(input)) {
    for (const BandMark& band : list->band) {
      ReportedMark& mark = marks[band.mark];
      mark.band_in_world = band.mean_in_world;
      mark.band_radius_m = band.radius95_m;
    }
  }
  if (report.headline) {
    const MarkComparison& compared = report.speaks().marks;
    for (const Excluded& gap : compared.excluded) marks[gap.mark].gap = gap.reason;
    for (const MarkError& error : compared.marks) {
      ReportedMark& mark = marks[error.mark];
      mark.virtual_in_world = error.virtual_in_world;
      mark.distance_m = error.distance_m;
      mark.sigma_distance_m = error.sigma_distance_m;
    }
  }
  std::vector<ReportedMark> list;
  for (auto& [id, mark] : marks) {
    mark.row = id.row;
    mark.col = id.col;
    list.push_back(std::move(mark));
  }
  return list;
}

/// Text such as "box 128 x 128 x 40 mm, table", without planes that are level below everything.
std::string objects_of(const Scene& scene) {
  std::vector<std::string> words;
  for (const Obstacle& obstacle : scene.obstacles) {
    if (const auto* sphere = std::get_if<Sphere>(&obstacle)) {
      words.push_back(fmt::format("sphere {:g} mm", 2 * sphere->radius_m / mm));
    } else if (const auto* box = std::get_if<Box>(&obstacle)) {
      const Vector3d size = box->size_m / mm;
      words.push_back(fmt::format("box {:g} x {:g} x {:g} mm", size.x(), size.y(), size.z()));
    } else if (const auto* cylinder = std::get_if<Cylinder>(&obstacle)) {
      words.push_back(fmt::format("cylinder {:g} mm, {:g} mm high", 2 * cylinder->radius_m / mm,
                                  cylinder->height_m / mm));
    } else if (const auto* mesh = std::get_if<MeshObject>(&obstacle)) {
      words.push_back("mesh " + mesh->file.stem().string());
    }
  }
  if (!scene.pins.empty()) words.push_back(fmt::format("{} pins", scene.pins.size()));
  if (!scene.clamps.empty()) words.push_back(fmt::format("{} clamps", scene.clamps.size()));
  return fmt::format("{}", fmt::join(words, ", "));
}

/// Noise lengthens every distance, by at most sigma^2 / d each to second order.
std::optional<double> noise_excess_m(const RealVirtual& row) {
  double sum = 0;
  for (const MarkError& mark : row.marks.marks) {
    if (!mark.sigma_mark_m || !(mark.distance_m > 0)) return std::nullopt;
    sum += std::min(*mark.sigma_mark_m * *mark.sigma_mark_m / mark.distance_m, *mark.sigma_mark_m);
  }
  return sum / static_cast<double>(row.marks.marks.size());
}

/// Sentences on the background of the headline's number.
std::vector<std::string> facts_of(const DrapeFiles& drape, const Report& report) {
  std::vector<std::string> facts;
  const auto add = [&](const std::string& what, const std::string& sentence) {
    if (!sentence.empty()) facts.push_back(what + sentence);
  };
  const RealVirtual& headline = report.speaks();
  if (report.budget) add("", budget_sentence(*report.budget));
  add("mesh: ", mesh_sentence(drape.input, report));
  for (const BranchSet& set : report.branch_sets) {
    add(fmt::format("branches of {}: ", set.label), branch_sentence(drape.input, set));
    const Simulation& first = drape.input.simulations[set.branches.front().as_placed.simulation];
    if (!first.is_of_cloth_of(*drape.input.speaker())) continue;
    const auto list = list_above(first.sheet.file, set.sha256);
    if (list && list->members_at_rest) add("ensemble: ", ensemble_sentence(*list));
    if (!list || drape.input.speaking_branch()->branch->set_sha256 != set.sha256) continue;
    if (list->friction_band) add("friction: ", friction_sentence(*list->friction_band));
    if (list->memory_band) add("internal friction: ", memory_sentence(*list->memory_band));
  }
  if (drape.error_split)
    add(fmt::format("over {} marks, ", drape.error_split->marks),
        error_split_sentence(*drape.error_split));
  if (const auto& budget = drape.input.measured.sheet.error_budget)
    add("of a mark, RMS over the sheet: ",
        fmt::format("noise of the dots' centres {:.4f} mm, bent and slanted dots {:.4f} mm{}",
                    budget->detection_m / mm, budget->dot_shape_m / mm,
                    budget->calibration_m
                        ? fmt::format(", cameras {:.4f} mm", *budget->calibration_m / mm)
                        : std::string()));
  if (const auto excess = noise_excess_m(headline))
    add("noise only lengthens a distance: ",
        fmt::format("the mean is at most {:.4f} mm too long, which is not subtracted",
                    *excess / mm));
  const StrainSummary& s = headline.strain.difference;
  if (s.warp && s.weft && s.area)
    add("real minus virtual strain between marks, RMS: ",
        fmt::format("{:.2f} % along the warp, {:.2f} % along the weft, {:.2f} % of area",
                    *s.warp / percent, *s.weft / percent, *s.area / percent));
  return facts;
}

/// Names the next action; empty if none is needed.
std::string next_of(const Report& report) {
  if (!report.go()) return "mend the cause and run again.";
  if (!report.headline) return "simulate the drape.";
  if (!report.match.remedies.empty()) return report.match.remedies.front() + ".";
  if (report.match.match == Match::inside || !report.budget) return {};
  for (const std::string& missing : report.budget->missing)
    if (missing.find('`') != std::string::npos) return "complete U: " + missing + ".";
  if (report.repeats.size() < 3) return "lay it twice more, to see how far real drapes differ.";
  return {};
}

ReportedDrape drape_of(const DrapeFiles& files, const Report& report, const Session& session,
                       const fs::path& folder) {
  const DrapeInput& input = files.input;
  ReportedDrape drape = report;
  drape.label = report.called();
  drape.set = input.measured.measured().set;
  drape.rig = input.measured.measured().rig;
  if (input.scene) drape.object = objects_of(*input.scene);
  drape.why = (report.go() ? report.match.reason : report.no_go.front()) + ".";
  drape.why[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(drape.why[0])));
  drape.next = next_of(report);
  for (const RealVirtual& row : report.real_virtual)
    drape.simulations.push_back(simulation_of(input.simulations[row.simulation], row));
  for (const BranchSet& set : report.branch_sets)
    drape.branch_sets.push_back(branches_of(input, set));
  drape.marks = marks_of(input, report);
  drape.tables = tables_of(files.input, report, files.error_split);
  if (!report.headline) return drape;
  const ReportedSimulation& speaks = drape.simulations[*report.headline];
  drape.simulation = speaks.label;
  drape.fabric = speaks.fabric;
  drape.distance = speaks.distance;
  drape.facts = facts_of(files, report);
  drape.views = views_of(files, report, session, folder);
  drape.shape = shape_of(input, report);
  return drape;
}

ReportedCalibration calibration_of(const Session& session) {
  const Calibration& own = *session.calibration;
  ReportedCalibration made;
  made.method = own.method;
  made.sha256 = session.calibration_sha256;
  made.no_go = own.no_go.value_or("");
  made.sets = static_cast<int>(own.sets.size());
  made.warnings = own.warnings;
  for (const CalibratedCamera& one : own.cameras)
    made.cameras.push_back({one.camera.name, one.residuals.points, one.residuals.rms_px,
                            one.residuals.max_px, one.residuals.object_rms_mm * mm,
                            one.valid_region_px, one.camera.model.width_px,
                            one.camera.model.height_px});
  // Findings that are not in the file: error on views not used by the fit, and the stages.
  if (const auto ending = kept_ending(run_record_path(session.calibration_file)))
    made.findings = ending->numbers;
  return made;
}

/// True for a command in backticks or a sentence that asks for an action.
bool asks(const std::string& text) {
  static const std::regex action(
      "`drape|(: |; )(measure|state|lay|simulate|correct|check|give|keep|import|level|write) ");
  return std::regex_search(text, action);
}

std::vector<ReportedNote> notes_of(const Outcome& outcome) {
  std::vector<ReportedNote> notes;
  const auto add = [&](const std::string& text, bool stops) {
    ReportedNote note{stops        ? Severity::stops
                      : asks(text) ? Severity::asks
                                   : Severity::informs,
                      kind_of_note(text), "", text};
    for (const Report& report : outcome.reports)
      if (text.starts_with(report.called() + ": ") ||
          text.find("(drape " + report.name + ")") != std::string::npos)
        note.drape = report.called();
    notes.push_back(std::move(note));
  };
  for (const std::string& reason : outcome.reasons()) add(reason, true);
  for (const std::string& warning : outcome.warnings) add(warning, false);
  std::ranges::stable_sort(notes, {}, &ReportedNote::severity);
  return notes;
}

/// All values of a drape's scene and fabric files, with stand-ins marked.
Table values_table(const std::vector<RunValue>& values, const Report& report,
                   const std::optional<Scene>& scene) {
  Table table({"file", "value", "is", "measured"});
  table.title = "Scene and fabric";
  const std::string fabric = scene ? "fabric " + scene->fabric_file.stem().string() : "";
  for (const RunValue& value : values)
    if ((value.owner == "scene " + report.name || value.owner == fabric) &&
        value.key != "stand_ins")
      table.add({value.owner, value.key, value.value, value.stand_in ? "no: stand-in" : ""});
  return table;
}

/// Makes names of drapes usable for files and anchors of the page: anything except letters, digits,
/// `-` and `_` is replaced, and duplicates get a number. Headings keep the original name.
std::vector<std::string> safe_names(const std::vector<Report>& reports) {
  std::set<std::string> taken;
  std::vector<std::string> names;
  for (const Report& report : reports) {
    std::string name = report.name;
    for (char& c : name)
      if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_') c = '_';
    const std::string base = name;
    for (int n = 2; !taken.insert(name).second; ++n) name = fmt::format("{}_{}", base, n);
    names.push_back(name);
  }
  return names;
}

}  // namespace

std::string kind_of_note(const std::string& text) {
  static const std::regex step("^[a-z]+ \\([^)]*\\): "), drape("^[^:]{1,40}: "),
      number("[-+]?[0-9]+(\\.[0-9]+)?");
  const std::string begin = text.substr(0, longest_matched);
  std::string kind = std::regex_replace(begin, step, "");
  if (kind == begin) kind = std::regex_replace(kind, drape, "");
  kind = std::regex_replace(kind, number, "N");
  std::size_t end = kind.find_first_of(";(");
  if (const std::size_t colon = kind.rfind(':', end); colon != std::string::npos && colon > 30)
    end = colon;
  kind = kind.substr(0, end);
  return kind.substr(0, kind.find_last_not_of(' ') + 1);
}

RunReport account_of(const Session& session, const Outcome& outcome, const fs::path& folder) {
  RunReport report;
  report.program = "drapebench " + version();
  report.label = outcome.label;
  report.operator_name = outcome.operator_name;
  report.date = outcome.date;
  report.store = fs::path(outcome.store).filename().string();
  if (outcome.run != 0) report.run = outcome.run;
  report.go = outcome.go();
  report.sentence = outcome.sentence();
  report.reasons = outcome.reasons();
  const std::vector<std::string> names = safe_names(outcome.reports);
  const std::vector<RunValue> values = values_of(session, outcome);
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    report.drapes.push_back(drape_of(session.drapes[i], outcome.reports[i], session, folder));
    report.drapes.back().name = names[i];
    Table used = values_table(values, outcome.reports[i], session.drapes[i].input.scene);
    if (!used.rows.empty()) report.drapes.back().tables.push_back({"values", "", std::move(used)});
  }
  if (report.go && !report.drapes.empty()) {
    report.sentence = "measured; mean distance and match:";
    for (const ReportedDrape& drape : report.drapes)
      report.sentence +=
          fmt::format("{} {} {} mm, {}", &drape == &report.drapes.front() ? "" : ";", drape.label,
                      figures_of(drape).mean, drape::name_of(drape.match.match));
  }
  for (const VirtualGroup& group : outcome.groups)
    report.virtual_groups.push_back({"virtual-" + std::to_string(report.virtual_groups.size() + 1),
                                     "", pair_table(group.name, group.pairs)});
  if (!report.drapes.empty()) report.rig = report.drapes.front().rig;
  if (session.calibration) report.calibration = calibration_of(session);
  report.notes = notes_of(outcome);
  report.provenance = provenance_of(session, outcome, folder);
  return report;
}
}  // namespace drape::compare
