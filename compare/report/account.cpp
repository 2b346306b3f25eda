// SPDX-License-Identifier: Apache-2.0
#include "compare/report/account.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <numbers>
#include <regex>
#include <set>

#include "compare/metrics/metrics.hpp"
#include "compare/records/provenance.hpp"
#include "compare/store/outcome.hpp"
#include "compare/tables/match.hpp"
#include "compare/tables/tables.hpp"
#include "core/drape_mesh.hpp"
#include "core/files/files.hpp"
#include "core/program/run_record.hpp"
#include "core/program/words.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;
using units::percent;

using Quad = std::array<Vector3d, 4>;

void add_quads(const Sphere& sphere, std::vector<Quad>& quads) {
  constexpr int kAround = 24, kUp = 12;
  const auto at = [&](int around, int up) -> Vector3d {
    const double east = 2 * std::numbers::pi * around / kAround;
    const double north = std::numbers::pi * up / kUp - std::numbers::pi / 2;
    return sphere.centre_in_world + sphere.radius_m * Vector3d(std::cos(north) * std::cos(east),
                                                               std::cos(north) * std::sin(east),
                                                               std::sin(north));
  };
  for (int up = 0; up < kUp; ++up)
    for (int around = 0; around < kAround; ++around)
      quads.push_back(
          {at(around, up), at(around + 1, up), at(around + 1, up + 1), at(around, up + 1)});
}

void add_quads(const Box& box, std::vector<Quad>& quads) {
  constexpr int kPieces = 4;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const double side : {-0.5, 0.5}) {
      const auto at = [&](int i, int j) -> Vector3d {
        Vector3d part;
        part[axis] = side;
        part[u] = (static_cast<double>(i) / kPieces - 0.5) * (side < 0 ? -1 : 1);
        part[v] = static_cast<double>(j) / kPieces - 0.5;
        return box.world_from_box * part.cwiseProduct(box.size_m).eval();
      };
      for (int i = 0; i < kPieces; ++i)
        for (int j = 0; j < kPieces; ++j)
          quads.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
}

void add_quads(const Cylinder& cylinder, std::vector<Quad>& quads) {
  constexpr int kAround = 32;
  const auto at = [&](int around, double part, double end) -> Vector3d {
    const double angle = 2 * std::numbers::pi * around / kAround;
    return cylinder.world_from_cylinder * Vector3d(part * cylinder.radius_m * std::cos(angle),
                                                   part * cylinder.radius_m * std::sin(angle),
                                                   end * cylinder.height_m);
  };
  for (int i = 0; i < kAround; ++i) {
    quads.push_back({at(i, 1, -0.5), at(i + 1, 1, -0.5), at(i + 1, 1, 0.5), at(i, 1, 0.5)});
    quads.push_back({at(i, 0, 0.5), at(i, 1, 0.5), at(i + 1, 1, 0.5), at(i + 1, 0, 0.5)});
    quads.push_back({at(i, 0, -0.5), at(i + 1, 1, -0.5), at(i, 1, -0.5), at(i, 0, -0.5)});
  }
}

/// A plane is unbounded; draws 300 mm around its point.
void add_quads(const Plane& plane, std::vector<Quad>& quads) {
  constexpr double kHalf_m = 0.15;
  const Vector3d u = plane.normal_in_world.unitOrthogonal();
  const Vector3d v = plane.normal_in_world.cross(u);
  const auto at = [&](double a, double b) -> Vector3d {
    return plane.point_in_world + kHalf_m * (a * u + b * v);
  };
  quads.push_back({at(-1, -1), at(1, -1), at(1, 1), at(-1, 1)});
}

/// Adds triangles as quads with two equal corners. If the mesh file no longer exists, the picture
/// is drawn without the object.
void add_quads(const MeshObject& object, std::vector<Quad>& quads) {
  try {
    const MeshFile mesh = read_mesh_file(object.file);
    for (const auto& [a, b, c] : mesh.triangles) {
      const auto at = [&](const MeshCorner& corner) -> Vector3d {
        return object.world_from_mesh * (mesh.points[corner.point] * units::mm).eval();
      };
      quads.push_back({at(a), at(b), at(c), at(c)});
    }
  } catch (const Error&) {
    return;
  }
}

/// Quads of the outer surfaces of all objects of a scene, for pictures; world frame, metres. A
/// sphere has 24 x 12 quads, each face of a box 4 x 4; rounded edges are drawn sharp, a plane as a
/// square of 300 mm.
std::vector<Quad> obstacle_quads(const Scene& scene) {
  std::vector<Quad> quads;
  for (const Obstacle& obstacle : scene.obstacles)
    std::visit([&](const auto& object) { add_quads(object, quads); }, obstacle);
  return quads;
}

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
    const auto error = std::find_if(marks.begin(), marks.end(),
                                    [&](const MarkError& one) { return one.mark == seen.mark; });
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
  const auto quads =
      input.scene ? obstacle_quads(*input.scene) : std::vector<std::array<Vector3d, 4>>();
  if (quads.size() <= kMostFaces)
    for (const auto& quad : quads)
      for (const Vector3d& corner : quad) append(shape.object_mm, corner);
  return shape;
}

std::string from_folder(const fs::path& file, const fs::path& folder) {
  return fs::proximate(file, folder).generic_string();
}

/// Rewrites a path of the command line relative to the report's folder; other words are unchanged.
std::string argument_text(const std::string& argument, const fs::path& folder) {
  std::error_code ignored;
  // A word such as "drape_A" remains a name even if a folder has that name.
  const bool path = argument.find('/') != std::string::npos ||
                    (fs::path(argument).has_extension() && fs::exists(argument, ignored));
  return shell_word(path && !argument.empty() && argument.front() != '-'
                        ? from_folder(argument, folder)
                        : argument);
}

std::string command(const StepRecord& made_by, const fs::path& folder) {
  std::string text = made_by.program;
  for (std::size_t i = 0; i < made_by.arguments.size(); ++i) {
    const std::string& argument = made_by.arguments[i];
    if (argument == "--threads")
      ++i;  // with its number
    else if (argument != "--json" && argument != "--quiet")
      text += " " + argument_text(argument, folder);
  }
  return text;
}

/// All steps in the order in which they run.
std::vector<StepRecord> steps_of(const Session& session, const Outcome& outcome) {
  std::vector<std::optional<StepRecord>> steps;
  if (session.calibrated_by)
    for (const auto& [file, sha256] : session.calibrated_by->inputs)  // marks of the target
      if (fs::is_regular_file(file) && sha256_of_file(file) == sha256)
        steps.push_back(read_made_by(file));
  steps.push_back(session.calibrated_by);
  for (const DrapeFiles& drape : session.drapes) {
    steps.insert(steps.end(), {drape.detected_by, drape.measured_by});
    steps.insert(steps.end(), drape.simulated_by.begin(), drape.simulated_by.end());
    steps.push_back(drape.split_by);
  }
  steps.push_back(StepRecord{"drape-compare", version(), outcome.arguments});
  std::vector<StepRecord> known;
  for (const auto& step : steps)
    if (step) known.push_back(*step);
  return known;
}

std::string tree_of(RecordBook& book, std::set<fs::path>& followed, const SheetFile& sheet,
                    const fs::path& folder) {
  fs::path json = sheet.file;
  json.replace_extension(".json");
  std::string text;
  for (const ChainLink& link : chain_of(book, json, sheet.sha256, followed)) {
    const std::string made = link.made_by.starts_with("drape-")
                                 ? link.made_by.substr(0, link.made_by.find(' '))
                                 : link.made_by;
    text +=
        fmt::format("{}{}  {}{}  {}\n", std::string(2 * static_cast<std::size_t>(link.depth), ' '),
                    from_folder(link.file, folder), link.sha256.substr(0, 12),
                    link.state == "unchanged" ? "" : " (" + link.state + ")", made);
  }
  return text;
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
    std::set<fs::path> followed;
    const Simulation& headline = input.simulations[report.speaks().simulation];
    std::string text = tree_of(book, followed, input.measured, folder);
    if (!headline.other_simulator) text += tree_of(book, followed, headline.sheet, folder);
    all.emplace_back(report.called(), text);
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
  made.trees = trees(session, outcome, folder);
  return made;
}

ReportedDistance distance_of(const RealVirtual& row) {
  const DistanceStatistics& s = row.statistics;
  ReportedDistance d{s.marks,        s.mean_m, s.median_m, s.rms_m, s.p95_m, s.max_m,
                     s.sigma_mean_m, {},       {},         {},      {},      {}};
  if (s.mean.bootstrap) {
    d.low_m = s.mean.bootstrap->low;
    d.high_m = s.mean.bootstrap->high;
  }
  if (row.aligned) {
    d.shape_m = row.aligned->after.mean_m;
    d.place_m = row.aligned->centroid_shift_m;
    d.turn_rad = row.aligned->turn_rad;
  }
  return d;
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
                          distance_of(row)};
  if (one.branch) made.branch = one.branch->number;
  if (one.levels) made.mesh_error_m = one.levels->left_m;
  return made;
}

ReportedBranches branches_of(const DrapeInput& input, const BranchSet& set) {
  ReportedBranches made{set.label, set.sha256, branch_sentence(input, set), {}};
  for (const BranchComparison& one : set.branches) {
    const Branch& branch = *input.simulations[one.as_placed.simulation].branch;
    std::optional<double> shape_m;
    if (one.as_placed.aligned) shape_m = one.as_placed.aligned->after.mean_m;
    made.branches.push_back({branch.number, branch.fraction, &one == &set.branches[set.nearest],
                             branch.stable, one.match_m(), shape_m});
  }
  return made;
}

std::vector<ReportedMark> marks_of(const DrapeInput& input, const Report& report) {
  std::map<MarkId, ReportedMark> marks;
  const auto at = [&](MarkId id) -> ReportedMark& {
    ReportedMark& mark = marks[id];
    mark.row = id.row;
    mark.col = id.col;
    return mark;
  };
  for (const SheetMark& measured : input.measured.sheet.marks) {
    ReportedMark& mark = at(measured.mark);
    mark.real_in_world = measured.point_in_world;
    mark.views = measured.views;
    if (measured.covariance_m2) mark.sigma_m = worst_sigma_m(*measured.covariance_m2);
  }
  for (const Gap& gap : input.measured.sheet.gaps) at(gap.mark).gap = gap.reason;
  if (const auto list = speaking_list(input)) {
    for (const BandMark& band : list->band) {
      ReportedMark& mark = at(band.mark);
      mark.band_in_world = band.mean_in_world;
      mark.band_radius_m = band.radius95_m;
    }
  }
  std::vector<ReportedMark> list;
  if (report.headline) {
    const MarkComparison& compared = report.speaks().marks;
    for (const Excluded& gap : compared.excluded) at(gap.mark).gap = gap.reason;
    for (const MarkError& error : compared.marks) {
      ReportedMark& mark = at(error.mark);
      mark.virtual_in_world = error.virtual_in_world;
      mark.distance_m = error.distance_m;
      mark.sigma_distance_m = error.sigma_distance_m;
    }
  }
  for (auto& [id, mark] : marks) list.push_back(std::move(mark));
  return list;
}

/// Text such as "box 128 x 128 x 40 mm, table", without planes that are level below everything.
std::string objects_of(const Scene& scene) {
  std::vector<std::string> words;
  const auto add = [&](const Obstacle& obstacle) {
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
  };
  std::for_each(scene.obstacles.begin(), scene.obstacles.end(), add);
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
    if (const std::string sentence = error_split_sentence(*drape.error_split); !sentence.empty())
      add(fmt::format("over {} marks, ", drape.error_split->marks), sentence);
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

std::string capital(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

/// Text: "from the measured shape it rests 13.2 mm away (8 to 13 mm by friction 0.2 to 0.8)".
std::string model_words(const ModelRest& model, const std::optional<double>& u_mm) {
  std::string text = fmt::format("Started from the measured shape it rests {} mm away",
                                 figure(model.distance_m / mm, u_mm));
  if (!model.range.empty())
    text += fmt::format(" ({} to {} mm by {}, not measured)", figure(model.least_m / mm, u_mm),
                        figure(model.largest_m / mm, u_mm), model.range);
  if (model.other_branch)
    text += *model.other_branch ? ", on another branch" : ", on the same branch";
  return text + ".";
}

/// Explains the match in one or two sentences.
std::string why_of(const Report& report) {
  if (!report.go()) return capital(report.no_go.front()) + ".";
  if (!report.headline || !report.budget) return capital(report.match.reason) + ".";
  const MatchVerdict& match = report.match;
  const Budget& budget = *report.budget;
  std::optional<double> u;  // a lower bound of U rounds nothing
  if (budget.missing.empty()) u = budget.expanded_m / mm;
  const double margin_m = budget.inputs_m + budget.own_m;
  const std::string margin = figure(margin_m / mm, u);
  std::string why;
  if (match.match == Match::none) {
    why = "No limit is stated, and fewer than three layings show how far real drapes differ.";
  } else {
    const std::string limit =
        fmt::format("the limit of {} mm ({})", figure(*match.limit_m / mm, u), match.rests_on);
    const char* side = *match.value_m > *match.limit_m ? "Beyond" : "Within";
    if (match.match == Match::inside)
      why = fmt::format("Within {} even with the margin of error ({} mm).", limit, margin);
    else if (match.match == Match::outside)
      why = fmt::format("Beyond {} even without the margin of error ({} mm).", limit, margin);
    else if (!budget.missing.empty())
      why = fmt::format(
          "{} {}, but undecided, since U lacks {}{}.", side, limit, budget.missing.front(),
          budget.missing.size() > 1 ? fmt::format(" and {} more", budget.missing.size() - 1)
                                    : std::string());
    else if (decide(*match.value_m, margin_m, *match.limit_m) == Match::outside)
      why = fmt::format("Beyond {}, but another start's branch is within it.", limit);
    else
      why =
          fmt::format("{} {}, but by less than the margin of error ({} mm).", side, limit, margin);
  }
  if (match.model && match.match != Match::inside) why += " " + model_words(*match.model, u);
  return why;
}

/// Names the next action; empty if none is needed.
std::string next_of(const Report& report) {
  if (!report.go()) return "mend the cause and run again.";
  const auto sentence = [](const std::string& text) { return text.empty() ? text : text + "."; };
  if (!report.headline) return "simulate the drape.";
  if (!report.match.remedies.empty()) return sentence(report.match.remedies.front());
  if (report.match.match == Match::inside || !report.budget) return {};
  for (const std::string& missing : report.budget->missing)
    if (missing.find('`') != std::string::npos) return "complete U: " + missing + ".";
  // Takes the remedy of the largest contribution that can be reduced.
  for (const BudgetLine& line : report.budget->lines)
    if (!line.remedy.empty() && !line.own_m && line.rectangular)
      return fmt::format("{} ({}).", line.remedy, line.origin);
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
  drape.why = why_of(report);
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
  ReportedCalibration made{own.method,
                           session.calibration_sha256,
                           own.no_go.value_or(""),
                           static_cast<int>(own.sets.size()),
                           {},
                           {},
                           own.warnings};
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
  std::stable_sort(notes.begin(), notes.end(), [](const ReportedNote& a, const ReportedNote& b) {
    return a.severity < b.severity;
  });
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
  std::string kind = std::regex_replace(text, step, "");
  if (kind == text) kind = std::regex_replace(kind, drape, "");
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
                                     "", virtual_group_table(group)});
  if (!report.drapes.empty()) report.rig = report.drapes.front().rig;
  if (session.calibration) report.calibration = calibration_of(session);
  report.notes = notes_of(outcome);
  report.provenance = provenance_of(session, outcome, folder);
  return report;
}
}  // namespace drape::compare
