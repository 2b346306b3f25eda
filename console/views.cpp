// SPDX-License-Identifier: Apache-2.0
// Views: JSON made from the files and endings. Lengths in mm and positions in px, as in the
// keys.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdlib>

#include "console/console.hpp"
#include "core/geometry/next_pose.hpp"
#include "core/geometry/point.hpp"
#include "core/statistics/sample.hpp"

namespace drape::console {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;
constexpr std::size_t kShownEntries = 200;

double rounded(double value, double steps) {
  return std::round(value * steps) / steps + 0.0;
}

Json point_px(const Vector2d& point) {
  return Json::array({rounded(point.x(), 10), rounded(point.y(), 10)});
}

/// x, y, z in mm, rounded to a hundredth.
Json point_mm(const Vector3d& point) {
  const Vector3d mms = point / mm;
  return {rounded(mms.x(), 100), rounded(mms.y(), 100), rounded(mms.z(), 100)};
}

template <class T>
Json optional_json(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

/// List of what `json_of` makes of each item.
template <class Items, class JsonOf>
Json list_of(const Items& items, JsonOf json_of) {
  Json list = Json::array();
  for (const auto& one : items) list.push_back(json_of(one));
  return list;
}

/// Marks and rejected candidates in px of the picture, which has one pixel for `step` of the
/// sensor.
Json places(const FrameDetections& frame, int step = 1) {
  const auto sensor_px = [step](const Vector2d& px) -> Vector2d {
    return step * px + Vector2d::Constant(0.5 * (step - 1));
  };
  Json marks = Json::array(), rejected = Json::array();
  for (const Detection& dot : frame.detections) {
    const Vector2d at = sensor_px(dot.centre_px), axes = step * dot.semi_axes_px;
    marks.push_back({rounded(at.x(), 10), rounded(at.y(), 10), rounded(axes.x(), 10),
                     rounded(axes.y(), 10), rounded(dot.axis_angle_rad / units::deg, 10),
                     fmt::format("{},{}", dot.mark.row, dot.mark.col)});
  }
  for (const Rejection& one : frame.rejections)
    if (one.centre_px) {
      const Vector2d at = sensor_px(*one.centre_px);
      rejected.push_back({rounded(at.x(), 10), rounded(at.y(), 10), one.reason});
    }
  return {{"marks", marks}, {"rejected", rejected}};
}

// ---- the target in space -----------------------------------------------------------------------

constexpr int kLeastPoints = 8;

/// Image of a dot's centre. The centroid of its disc deviates from it (eccentricity; Heikkila 2000)
/// by an amount that the pose determines.
Vector2d centre_px(const Camera& camera, const Target& target,
                   const std::optional<WorldFromTarget>& pose, const Detection& dot) {
  if (!pose || target.dot_diameter_m == 0) return dot.centre_px;
  const CamFromTarget seen = camera.cam_from_world * *pose;
  const auto off =
      eccentricity_px(camera.model, {seen * target.point_in_target(dot.mark), seen.rotation.col(0),
                                     seen.rotation.col(1), 0.5 * target.dot_diameter_m});
  return off ? Vector2d(dot.centre_px - *off) : dot.centre_px;
}

std::optional<MeasuredTarget> measure_with(const Calibration& calibration, const Target& target,
                                           const std::vector<FrameDetections>& frames,
                                           const std::optional<WorldFromTarget>& pose) {
  std::map<MarkId, std::vector<Ray>> rays;
  for (const FrameDetections& frame : frames) {
    const CalibratedCamera* found = calibration.find(frame.camera);
    if (found == nullptr) continue;
    for (const Detection& dot : frame.detections)
      if (const auto ray = ray_of(found->camera, centre_px(found->camera, target, pose, dot)))
        rays[dot.mark].push_back(*ray);
  }
  MeasuredTarget result;
  Eigen::Matrix3Xd drawn(3, rays.size()), measured(3, rays.size());
  for (const auto& [mark, seen_along] : rays) {
    const auto point = nearest_to_rays(seen_along);
    if (!point) continue;
    drawn.col(result.points) = target.point_in_target(mark);
    measured.col(result.points++) = *point;
  }
  if (result.points < kLeastPoints) return std::nullopt;
  drawn.conservativeResize(3, result.points);
  measured.conservativeResize(3, result.points);
  const auto pose_of_points = pose_from_points<frame::World, frame::Target>(drawn, measured);
  if (!pose_of_points) return std::nullopt;
  result.world_from_target = *pose_of_points;
  double sum = 0;
  for (Index k = 0; k < measured.cols(); ++k) {
    sum += (result.world_from_target * Vector3d(drawn.col(k)) - measured.col(k)).squaredNorm();
    result.points_in_world.emplace_back(measured.col(k));
  }
  result.rms_m = std::sqrt(sum / result.points);
  return result;
}

}  // namespace

std::optional<MeasuredTarget> measure_target(const Calibration& calibration, const Target& target,
                                             const std::vector<FrameDetections>& frames) {
  const auto first = measure_with(calibration, target, frames, {});
  return first ? measure_with(calibration, target, frames, first->world_from_target) : first;
}

namespace {

// ---- outlines ----------------------------------------------------------------------------------

using Line = std::vector<Vector3d>;  ///< points in the world
constexpr int kAlong = 48;  ///< points on a circle; a lens bends edges, which get a quarter of it

Line circle(const Vector3d& centre, const Vector3d& a, const Vector3d& b) {
  Line line;
  for (int k = 0; k <= kAlong; ++k) {
    const double angle = 2 * std::numbers::pi * k / kAlong;
    line.push_back(centre + std::cos(angle) * a + std::sin(angle) * b);
  }
  return line;
}

Line edge(const Vector3d& from, const Vector3d& to) {
  Line line;
  for (int k = 0; k <= kAlong / 4; ++k) line.push_back(from + (to - from) * (4.0 * k / kAlong));
  return line;
}

struct LinesFrom {
  Vector3d eye;

  /// The circle in which rays from the eye touch the sphere.
  std::vector<Line> operator()(const Sphere& s) const {
    const Vector3d away = eye - s.centre_in_world;
    const double part = s.radius_m / away.norm();
    if (!(part < 1)) return {};
    const Vector3d a = away.unitOrthogonal(), b = away.normalized().cross(a);
    const double radius = s.radius_m * std::sqrt(1 - part * part);
    return {circle(s.centre_in_world + part * part * away, radius * a, radius * b)};
  }
  std::vector<Line> operator()(const Box& box) const {
    std::vector<Line> lines;
    const auto corner = [&](int k) {
      const Vector3d side(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5);
      return box.world_from_box * Vector3d(side.cwiseProduct(box.size_m));
    };
    for (int k = 0; k < 8; ++k)
      for (const int axis : {1, 2, 4})
        if ((k & axis) == 0) lines.push_back(edge(corner(k), corner(k | axis)));
    return lines;
  }
  std::vector<Line> operator()(const Cylinder& c) const {
    std::vector<Line> lines;
    const Eigen::Matrix3d turn = c.radius_m * c.world_from_cylinder.rotation;
    for (const double end : {-0.5, 0.5})
      lines.push_back(circle(c.world_from_cylinder * Vector3d(0, 0, end * c.height_m), turn.col(0),
                             turn.col(1)));
    return lines;
  }
  std::vector<Line> operator()(const Plane&) const { return {}; }
  std::vector<Line> operator()(const MeshObject&) const { return {}; }
};

/// Edges of a drape's objects in every camera's picture, at the positions measured with tag plates
/// or stated in the scene.
Json outlines(const Files& files, const Drape& drape) {
  Json json = {{"measured", false}, {"cameras", Json::object()}};
  const auto now = files.calibration();
  if (!now) return json;
  const Scene scene = files.measured_scene(drape);
  json["measured"] = scene.file != drape.scene.file;
  for (const CalibratedCamera& one : now->cameras) {
    const Camera& camera = one.camera;
    Json& lines = json["cameras"][camera.name] = Json::array();
    for (const Obstacle& object : scene.obstacles)
      for (const Line& line : std::visit(LinesFrom{centre_in_world(camera)}, object)) {
        Json points = Json::array();
        for (const Vector3d& point : line)
          if (const auto image = project(camera.model, camera.cam_from_world * point))
            points.push_back(point_px(image->px));
        if (points.size() > 1) lines.push_back(std::move(points));
      }
  }
  return json;
}

// ---- state -----------------------------------------------------------------------------------

Json set_json(const Bench& bench, const BenchFiles& rig, const std::string& set) {
  const Files& files = bench.files;
  Json json = {{"name", set}, {"taken", files.is_taken(set)}};
  for (const TargetStage& stage : rig.rig.stages)
    if (stage.set == set) json["z_mm"] = rounded(stage.z_m / mm, 1000);
  if (const std::string drape = bench.session.drape_of(set); !drape.empty()) json["drape"] = drape;
  if (const ObjectTags* plate = rig.plate_of(set)) json["plate"] = plate->object;
  const auto recorded = files.recorded(set);
  json["recorded"] = recorded != nullptr;
  json["takeable"] = recorded != nullptr || !bench.session.options.replay;
  std::string pictures;  // a picture that changed has another text
  if (recorded)
    for (const RecordedFrame& frame : recorded->frames) pictures += frame.sha256.substr(0, 8);
  json["pictures"] = pictures;
  json["earlier"] = files.earlier_takes(set);
  const auto seen = files.facts(set);
  json["detected"] = seen ? seen->detected : Json();
  json["verdict"] = seen ? seen->verdict : "";
  json["sentence"] = seen ? seen->sentence : "";
  json["held_out"] = bench.session.held_out(set);
  return json;
}

Json calibration_json(const Bench& bench) {
  const auto now = bench.files.calibration();
  if (!now) return {};
  Json json = ending_of(bench.session.run.calibration());
  json["sets"] = now->sets;
  json["no_go"] = optional_json(now->no_go);
  json["cameras"] = list_of(now->cameras, [](const CalibratedCamera& one) -> Json {
    return {{"name", one.camera.name},
            {"points", one.residuals.points},
            {"rms_px", one.residuals.rms_px},
            {"max_px", one.residuals.max_px},
            {"rms_mm", one.residuals.object_rms_mm}};
  });
  return json;
}

/// A step's ending with its numbers if current; otherwise the reason why it is superseded, if made.
struct Stage {
  Json made, superseded;
};

Stage stage_of(const Files& files, const fs::path& output) {
  const Reason why = files.why_superseded(output);
  if (why) return {{}, files.is_made(output) ? Json(*why) : Json()};
  return {ending_of(output), {}};
}

/// The next thing to do: text, reason, and the action if the page can perform it.
Json next_of(const std::string& words, Json action = {}, const std::string& why = {}) {
  return {{"words", words}, {"action", std::move(action)}, {"why", why}};
}

Json next_of_calibration(const Bench& bench, const Stage& calibration) {
  const std::size_t taken = bench.files.taken_target_sets().size();
  if (!calibration.made.is_null()) return {};
  if (!calibration.superseded.is_null())
    return next_of("Calibrate again", {{"do", "calibrate"}},
                   calibration.superseded.get<std::string>() + ".");
  if (taken >= 3)
    return next_of(fmt::format("Calibrate with {} sets", taken), {{"do", "calibrate"}});
  return next_of("Take sets of the target", {}, fmt::format("{} of at least 3.", taken));
}

Json next_of_drape(const Bench& bench, const Drape& drape, const Json& item, bool calibrated) {
  const std::string& name = drape.scene.name;
  for (const ObjectTags& plate : drape.scene.tags)
    if (!bench.files.is_taken(plate.set))
      return next_of("Take " + plate.set, {{"do", "take"}, {"set", plate.set}},
                     "Put its plate of tags on the object.");
  if (const std::string& set = drape.scene.set; !bench.files.is_taken(set))
    return next_of("Take " + set, {{"do", "take"}, {"set", set}});
  if (!calibrated) return next_of("Calibrate first.");
  if (item["sheet"].is_null()) return next_of("Measure", {{"do", "measure"}, {"drape", name}});
  if (item["result"].is_null())
    return next_of("Simulate and compare", {{"do", "run"}, {"drape", name}});
  return {};
}

/// The last row of a table whose "scene" is this one, or null.
const Json* of_scene(const Json& rows, const std::string& scene) {
  const Json* found = nullptr;
  if (rows.is_array())
    for (const Json& row : rows)
      if (row.is_object() && row.value("scene", "") == scene) found = &row;
  return found;
}

Json drape_json(const Bench& bench, const Drape& one, const Json& distances, bool calibrated) {
  const Files& files = bench.files;
  const std::string& name = one.scene.name;
  Json json = {{"name", name},
               {"set", one.scene.set},
               {"taken", files.is_taken(one.scene.set)},
               {"stand_ins", one.scene.stand_ins},
               {"fabric", one.scene.fabric_file.stem().string()}};
  const Stage sheet = stage_of(files, files.sheet_file(name));
  json["sheet"] = sheet.made;
  json["sheet_superseded"] = sheet.superseded;
  if (const auto measured = sheet.made.is_null() ? nullptr : files.sheet(name)) {
    json["sheet"]["marks"] = measured->marks.size();
    json["sheet"]["gaps"] = measured->gaps.size();
    if (measured->error_budget) json["sheet"]["sd_mm"] = measured->error_budget->total_m / mm;
  }
  json["layings"] = list_of(bench.session.layings(name), [](const Laying& laying) -> Json {
    return {{"set", laying.set}, {"repeat", laying.repeat}, {"face", laying.face}};
  });
  json["plates"] = list_of(one.scene.tags, [&](const ObjectTags& plate) {
    Json item = stage_of(files, files.look().object(one.scene, plate.object)).made;
    if (item.is_null()) item = {{"verdict", ""}, {"sentence", ""}};
    item["object"] = plate.object;
    item["set"] = plate.set;
    return item;
  });
  const auto bench_files = bench.session.bench();
  const double spacing_m = bench_files->rig.spacing_m;
  json["simulations"] = list_of(bench_files->rig.segments, [&](int segments) -> Json {
    const Stage stage = stage_of(
        files, bench.session.out / name / simulation_folder(spacing_m, segments) / "sheet.json");
    return {{"spacing_mm", spacing_m / mm},
            {"segments", segments},
            {"there", !stage.made.is_null()},
            {"superseded", !stage.superseded.is_null()},
            {"sentence", stage.made.is_null() ? "" : stage.made["sentence"]}};
  });
  const Json* row = of_scene(distances, name);
  const Reason why = row != nullptr ? files.why_report_superseded(one) : std::nullopt;
  json["result"] = row != nullptr && !why ? *row : Json();
  json["result_superseded"] = optional_json(why);
  json["next"] = next_of_drape(bench, one, json, calibrated);
  return json;
}

Json state_view(Bench& bench, Query&) {
  const Session& session = bench.session;
  const Files& files = bench.files;
  const auto rig = session.bench();
  Json json = {{"rig", rig->rig.name},
               {"replay", session.options.replay},
               {"operator", session.who()},
               {"out", session.out.string()},
               {"target", {{"rows", rig->target.rows}, {"cols", rig->target.cols}}}};
  json["cameras"] = list_of(rig->rig.cameras, [](const RigCamera& camera) -> Json {
    return {{"name", camera.name}, {"width_px", camera.width_px}, {"height_px", camera.height_px}};
  });
  // Before the sets, so that one whose taking just ended is among them.
  json["capture"] = bench.cameras.json();
  json["sets"] = Json::array();
  for (const std::string& set : rig->target_sets())
    json["sets"].push_back(set_json(bench, *rig, set));
  for (const Drape& one : rig->drapes)
    for (const std::string& set : session.sets_of(one))
      json["sets"].push_back(set_json(bench, *rig, set));
  json["calibration"] = calibration_json(bench);
  const Stage calibration = stage_of(files, bench.session.run.calibration());
  json["calibration_superseded"] = calibration.superseded;
  json["next"] = next_of_calibration(bench, calibration);
  json["drapes"] = Json::array();
  const Json distances = files.results({"trend", "--by", "fabric"});
  bool reported = true;  // true if the report uses these pictures
  for (const Drape& one : rig->drapes) {
    json["drapes"].push_back(drape_json(bench, one, distances, !calibration.made.is_null()));
    reported = reported && json["drapes"].back()["result_superseded"].is_null();
  }
  json["report"] = fs::is_regular_file(bench.session.run.report());
  json["report_superseded"] = !reported;
  json["report_stamp"] = stamp_of(bench.session.run.report().replace_extension(".json"));
  json["jobs"] = list_of(bench.jobs.list(), [](const Job& job) { return job.json(); });
  json["log"] = session.log.last(kShownEntries);
  json["log_entries"] = session.log.size();
  json["log_torn"] = session.log.torn();
  json["trouble"] = session.trouble();
  return json;
}

// ---- pictures --------------------------------------------------------------------------------

Json marks_view(Bench& bench, Query& query) {
  const std::string set = query["set"];
  bench.session.require_set(set);
  Json json = {{"set", set}, {"cameras", Json::object()}};
  if (const auto seen = bench.files.marks(set))
    for (const FrameDetections& frame : seen->frames) json["cameras"][frame.camera] = places(frame);
  return json;
}

Json live_marks_view(Bench& bench, Query& query) {
  Json json = {{"cameras", Json::object()}, {"still_s", bench.cameras.still_json()}};
  const auto seen =
      bench.cameras.marks(query["surface"] == "cloth" ? Surface::cloth : Surface::target);
  if (!seen) return json;
  for (const FrameDetections& frame : seen->frames) {
    // A pixel of the picture is the mean of a square of sensor pixels.
    Json& one = json["cameras"][frame.camera] =
        places(frame, bench.session.bench()->rig.camera(frame.camera).width_px / frame.width_px);
    one["measured"] = frame.detections.size();
    one["tags"] = frame.tags.size();
  }
  json["printed"] = seen->lattice.rows * seen->lattice.cols;
  return json;
}

Json frame_view(Bench& bench, Query& query) {
  const std::string set = query["set"];
  bench.session.require_set(set);
  Json json = {{"set", set}, {"cameras", Json::object()}};
  const auto recorded = bench.files.recording();
  const FrameSet& frames = recorded->set(set);
  for (const RecordedFrame& frame : frames.frames)
    json["cameras"][frame.camera]["saturated_percent"] =
        100 * bench.pictures.picture(*recorded, frames, frame, 640, true).saturated_fraction;
  if (const auto seen = bench.files.marks(set))
    for (const FrameDetections& frame : seen->frames)
      json["cameras"][frame.camera]["sigma_px"] = optional_json(sigma_px(frame));
  return json;
}

// ---- calibration -----------------------------------------------------------------------------

/// Marks of all calibration sets, in the pictures and in space.
Json coverage_view(Bench& bench, Query&) {
  Json json = {{"cameras", Json::object()}, {"points_mm", Json::array()}};
  const auto now = bench.files.calibration();
  for (const std::string& set : bench.files.taken_target_sets()) {
    const auto seen = bench.files.marks(set);
    if (!seen) continue;
    for (const FrameDetections& frame : seen->frames)
      for (const Detection& dot : frame.detections)
        json["cameras"][frame.camera].push_back(point_px(dot.centre_px));
    if (!now) continue;
    if (const auto measured = measure_target(*now, bench.session.bench()->target, seen->frames))
      for (const Vector3d& point : measured->points_in_world)
        json["points_mm"].push_back(point_mm(point));
  }
  return json;
}

// ---- history ---------------------------------------------------------------------------------

constexpr const char* kAcceptances =
    "SELECT date, verdict, valid_until, positions, cause FROM acceptance ORDER BY date";
constexpr std::size_t kRunsOnAPage = 20, kShownPoints = 60;

/// Curves of one chart. A curve's label is its value of the first key, plus the values of the keys
/// that vary among curves with the same first value.
Json lines_of(const Json& rows, const std::vector<const char*>& keys, const char* value,
              const char* uncertainty) {
  const auto text_of = [](const Json& row, const char* key) {
    const Json found = row.value(key, Json());
    return found.is_string() ? found.get<std::string>() : found.dump();
  };
  std::vector<const char*> differing;
  for (const char* key : keys) {
    std::map<std::string, std::string> first;
    if (key == keys.front() || std::any_of(rows.begin(), rows.end(), [&](const Json& row) {
          const std::string text = text_of(row, key);
          return first.emplace(text_of(row, keys.front()), text).first->second != text;
        }))
      differing.push_back(key);
  }
  Json lines = Json::array();
  std::map<std::string, std::size_t> places;
  for (const Json& row : rows) {
    std::vector<std::string> words;
    for (const char* key : differing) words.push_back(text_of(row, key));
    const std::string label = fmt::format("{}", fmt::join(words, ", "));
    const auto [place, is_new] = places.emplace(label, lines.size());
    if (is_new) lines.push_back({{"label", label}, {"points", Json::array()}});
    Json& points = lines[place->second]["points"];
    points.push_back({{"run", row.value("run", Json())},
                      {"value", row.value(value, Json())},
                      {"u", row.value(uncertainty, Json())},
                      {"says", row.contains("match") ? row["match"] : row.value("alarm", Json())}});
    if (points.size() > kShownPoints) points.erase(points.begin());
  }
  return lines;
}

/// Pages of runs, newest first; one chart per question.
Json history_view(Bench& bench, Query& query) {
  Json runs = bench.files.results({"runs"});
  if (!runs.is_array()) runs = Json::array();
  std::reverse(runs.begin(), runs.end());
  const std::size_t pages =
      std::max<std::size_t>(1, (runs.size() + kRunsOnAPage - 1) / kRunsOnAPage);
  const auto wanted = static_cast<std::size_t>(std::max(1, std::atoi(query["page"].c_str())));
  const std::size_t page = std::min(wanted, pages), first = (page - 1) * kRunsOnAPage;
  Json json = {{"store", bench.session.run.store().string()},
               {"page", page},
               {"pages", pages},
               {"total", runs.size()},
               {"runs", Json::array()},
               {"charts", Json::array()}};
  for (std::size_t k = first; k < std::min(runs.size(), first + kRunsOnAPage); ++k)
    json["runs"].push_back(runs[k]);
  if (const Json rows = bench.files.results({"trend", "--by", "fabric"}); rows.is_array())
    json["charts"].push_back(
        {{"question", "How far is each drape from its simulation?"},
         {"unit", "mm"},
         {"lines", lines_of(rows, {"scene", "fabric", "discretisation", "segments"}, "mean_dist_mm",
                            "expanded_uncertainty_mm")}});
  const std::string residual = "calibration residual ";
  Json health = Json::array();
  if (const Json rows = bench.files.results({"trend"}); rows.is_array())
    for (Json row : rows)
      if (const std::string series = row.value("series", ""); series.starts_with(residual)) {
        row["camera"] = series.substr(series.rfind(' ') + 1);
        row["rig"] = series.substr(residual.size(), series.rfind(' ') - residual.size());
        health.push_back(std::move(row));
      }
  if (!health.empty())
    json["charts"].push_back({{"question", "Does the calibration stay as good?"},
                              {"unit", "px"},
                              {"lines", lines_of(health, {"camera", "rig"}, "value", "")}});
  json["acceptances"] = bench.files.results({"sql", kAcceptances});
  return json;
}

Json difference_view(Bench& bench, Query& query) {
  const std::string run_a = query["a"], run_b = query["b"];
  for (const std::string& run : {run_a, run_b})
    if (run.empty() || run.size() > 9 || run.find_first_not_of("0123456789") != std::string::npos)
      throw bad_input("a run is a number", {.field = run}, "take one of the list");
  return bench.files.results({"diff", run_a, run_b});
}

// ---- a drape in space ------------------------------------------------------------------------

/// The measured marks as report.json has them, before they are compared.
Json sheet_view(Bench& bench, Query& query) {
  const auto rig = bench.session.bench();
  const Drape& one = rig->drape(query["drape"]);
  const auto measured = bench.files.sheet(one.scene.name);
  const auto mark_json = [](const SheetMark& mark) -> Json {
    return {
        {"row", mark.mark.row}, {"col", mark.mark.col},  {"real_mm", point_mm(mark.point_in_world)},
        {"virtual_mm", Json()}, {"distance_mm", Json()}, {"sigma_distance_mm", Json()}};
  };
  return {{"label", one.scene.name},
          {"outlines", outlines(bench.files, one)},
          {"marks", measured ? list_of(measured->marks, mark_json) : Json::array()}};
}

// ---- table of views --------------------------------------------------------------------------

}  // namespace

std::optional<Json> view(Bench& bench, const std::string& name, Query query) {
  static const std::map<std::string, Json (*)(Bench&, Query&)> views = {
      {"state", state_view},
      {"marks", marks_view},
      {"live-marks", live_marks_view},
      {"frame", frame_view},
      {"coverage", coverage_view},
      {"sheet", sheet_view},
      {"history", history_view},
      {"diff", difference_view},
      {"coach", [](Bench& of, Query&) { return coach_view(of); }}};
  const auto found = views.find(name);
  return found == views.end() ? std::nullopt : std::optional(found->second(bench, query));
}

Json coach_view(const Bench& bench) {
  const auto now = bench.files.calibration();
  const auto rig = bench.session.bench();
  if (!now) return {{"advice", "Calibrate first: the coach predicts from a first calibration."}};
  if (rig->drapes.empty() || now->joint_covariance.size() == 0)
    return {{"advice", "The coach needs a drape in the rig and a calibration with free poses."}};
  Vector2d half(0, 0);
  for (const Drape& one : rig->drapes) half = half.cwiseMax(0.5 * one.print.patch_m);
  const WorldBox volume{{-half.x(), -half.y(), 0}, {half.x(), half.y(), half.maxCoeff()}};
  std::vector<double> sigma;
  for (const CalibratedCamera& camera : now->cameras) {
    std::vector<double> all;
    for (const std::string& set : now->sets)
      if (const auto seen = bench.files.marks(set))
        for (const FrameDetections& frame : seen->frames)
          if (const auto one = sigma_px(frame); one && frame.camera == camera.camera.name)
            all.push_back(*one);
    if (all.empty()) return {{"advice", "The sets of the calibration are gone; calibrate again."}};
    sigma.push_back(median(std::move(all)));
  }
  const PosePlanner coach(*now, points_of(rig->target), volume, sigma);
  if (!coach.sees_volume())
    return {{"advice",
             "No two cameras see the volume in which cloths are measured: turn the "
             "cameras towards the object."}};
  const PredictedError error = coach.now();
  // Squares add: a third of the marks' own noise increases the error of a measured point by 5 %.
  const double goal_m = error.marks_m / 3;
  Json json = {{"calibration_mm", error.calibration_m / mm},
               {"marks_mm", error.marks_m / mm},
               {"goal_mm", goal_m / mm},
               {"reached", error.calibration_m <= goal_m}};
  if (const auto next = coach.next()) {
    Json views = Json::array();
    for (std::size_t k = 0; k < next->cameras.size(); ++k) {
      const auto camera = static_cast<std::size_t>(next->cameras[k]);
      views.push_back({{"camera", now->cameras[camera].camera.name},
                       {"outline_px", list_of(next->outline_px[k], point_px)}});
    }
    json["next"] = {
        {"words", next->words}, {"calibration_mm", next->calibration_m / mm}, {"views", views}};
  }
  return json;
}

Picture picture(const Bench& bench, const std::string& set, const std::string& camera, int width_px,
                bool mark_saturation) {
  bench.session.require_set(set);
  const auto recorded = bench.files.recording();
  const FrameSet& frames = recorded->set(set);
  for (const RecordedFrame& frame : frames.frames)
    if (frame.camera == camera)
      return bench.pictures.picture(*recorded, frames, frame, width_px, mark_saturation);
  throw bad_input("the set has no image of this camera", {.camera = camera, .set = set},
                  "reload the page");
}

}  // namespace drape::console
