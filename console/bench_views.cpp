// SPDX-License-Identifier: Apache-2.0
// The pages' content, as JSON. Lengths in mm, places in px, as the keys say.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "console/bench.hpp"
#include "core/error.hpp"
#include "core/program/run_record.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;
using units::mm;
constexpr std::size_t kShownEntries = 200;
constexpr const char* kAcceptances =
    "SELECT date, verdict, valid_until, positions, cause FROM acceptance ORDER BY date";
constexpr const char* kCalibrations =
    "SELECT r.number AS run, r.date, c.camera, c.points, c.rms_px, c.max_px, c.object_rms_mm FROM "
    "run AS r JOIN calibration_camera AS c USING (calibration_sha256) ORDER BY r.number DESC, "
    "c.camera LIMIT 60";

double rounded(double value, double steps) {
  return std::round(value * steps) / steps + 0.0;
}

Json point_px(const Eigen::Vector2d& point) {
  return Json::array({rounded(point.x(), 10), rounded(point.y(), 10)});
}

/// Along one axis, as detect states it (its bound): the median over the frame's marks.
std::optional<double> sigma_px(const FrameDetections& frame) {
  std::vector<double> all;
  for (const Detection& dot : frame.detections)
    all.push_back(std::sqrt(0.5 * dot.covariance_px2.trace()));
  if (all.empty()) return std::nullopt;
  return median(std::move(all));
}

/// Marks and what was refused, in px of the sensor, of which `step` stand side by side in a pixel
/// of the picture.
Json places(const FrameDetections& frame, int step = 1) {
  const auto sensor_px = [step](const Eigen::Vector2d& px) -> Eigen::Vector2d {
    return step * px + Eigen::Vector2d::Constant(0.5 * (step - 1));
  };
  Json marks = Json::array(), rejected = Json::array();
  for (const Detection& dot : frame.detections) {
    Json one = point_px(sensor_px(dot.centre_px));
    one.push_back(rounded(step * dot.semi_axes_px.x(), 10));
    one.push_back(rounded(step * dot.semi_axes_px.y(), 10));
    one.push_back(rounded(dot.axis_angle_rad / units::deg, 10));
    one.push_back(fmt::format("{},{}", dot.mark.row, dot.mark.col));
    marks.push_back(std::move(one));
  }
  for (const Rejection& one : frame.rejections)
    if (one.centre_px) {
      Json place = point_px(sensor_px(*one.centre_px));
      place.push_back(one.reason);
      rejected.push_back(std::move(place));
    }
  return {{"marks", marks}, {"rejected", rejected}};
}

Json optional_json(const std::optional<double>& value) {
  return value ? Json(*value) : Json();
}

/// "verdict" and "sentence" of an ending; empty where there is none.
Json said_in(const Json& ending) {
  return {{"verdict", ending.is_object() ? ending.value("verdict", "") : ""},
          {"sentence", ending.is_object() ? ending.value("sentence", "") : ""}};
}

Json detection_json(const Detections& detections) {
  const int printed = detections.lattice.rows * detections.lattice.cols;
  Json cameras = Json::array();
  for (const FrameDetections& frame : detections.frames) {
    std::map<std::string, int> reasons;
    for (const Rejection& one : frame.rejections) ++reasons[one.reason];
    const auto measured = static_cast<int>(frame.detections.size());
    cameras.push_back({{"camera", frame.camera},
                       {"measured", measured},
                       {"missing", printed - measured},
                       {"tags", frame.tags.size()},
                       {"sigma_px", optional_json(sigma_px(frame))},
                       {"rejected", reasons}});
  }
  return {{"printed", printed}, {"cameras", cameras}};
}

}  // namespace

Json point_mm(const Eigen::Vector3d& point) {
  Json list = Json::array();
  for (int k = 0; k < 3; ++k) list.push_back(rounded(point[k] / mm, 100));
  return list;
}

const Json* of_scene(const Json& rows, const std::string& scene) {
  const Json* found = nullptr;
  if (rows.is_array())
    for (const Json& row : rows)
      if (row.is_object() && row.value("scene", "") == scene) found = &row;
  return found;
}

Bench::SetFacts Bench::read_set_facts(const fs::path& file) {
  const Detections detections = read_detections(file);
  SetFacts facts{detection_json(detections), {}, {}, {}, detections.no_go};
  for (const FrameDetections& frame : detections.frames)
    facts.images[frame.set][frame.camera] = frame.image_sha256;
  const Json said = said_in(ending_of(file));
  facts.verdict = said["verdict"];
  facts.sentence = said["sentence"];
  return facts;
}

Json Bench::set_json(const std::string& set) const {
  Json json = {{"name", set}, {"taken", is_taken(set)}};
  for (const TargetStage& stage : rig_.stages)
    if (stage.set == set) json["z_mm"] = rounded(stage.z_m / mm, 1000);
  if (const std::string drape = drape_of(set); !drape.empty()) json["drape"] = drape;
  if (const ObjectTags* plate = plate_of(set)) json["plate"] = plate->object;
  const bool there = recorded_set(set) != nullptr;
  json["recorded"] = there;
  json["takeable"] = there || !options_.replay;
  json["pictures"] = "";  // another text for other pictures
  for (const auto& [camera, sha256] : images(set))
    json["pictures"] = json["pictures"].get<std::string>() + sha256.substr(0, 8);
  json["earlier"] = earlier_takes(set);
  const auto seen = facts(set);
  json["detected"] = seen ? seen->detected : Json();
  json["verdict"] = seen ? seen->verdict : "";
  json["sentence"] = seen ? seen->sentence : "";
  const std::lock_guard lock(mutex_);
  const auto held = held_out_.find(set);
  json["held_out"] = held == held_out_.end() ? Json() : held->second;
  return json;
}

Json Bench::calibration_json() const {
  const auto now = calibration();
  if (!now) return {};
  Json json = ending_of(calibration_file());
  if (!json.is_object()) json = Json::object();
  json["sets"] = now->sets;
  json["no_go"] = now->no_go ? Json(*now->no_go) : Json();
  json["cameras"] = Json::array();
  for (const CalibratedCamera& one : now->cameras)
    json["cameras"].push_back({{"name", one.camera.name},
                               {"points", one.residuals.points},
                               {"rms_px", one.residuals.rms_px},
                               {"max_px", one.residuals.max_px},
                               {"rms_mm", one.residuals.object_rms_mm}});
  return json;
}

Json Bench::drape_json(const Drape& one) const {
  const std::string& name = one.scene.name;
  Json json = {{"name", name}, {"set", one.scene.set}, {"stand_ins", one.scene.stand_ins}};
  json["fabric"] = one.scene.fabric_file.stem().string();
  const Chain chain = own_chain(one);
  const auto why = against_sheet(chain);
  json["sheet"] = json["sheet_superseded"] = Json();
  if (why) {
    if (fs::is_regular_file(run_record_path(chain.sheet))) json["sheet_superseded"] = *why;
  } else if (const auto measured = sheet_in(chain.sheet)) {
    json["sheet"] = said_in(ending_of(sheet_file(name)));
    json["sheet"]["marks"] = measured->marks.size();
    json["sheet"]["gaps"] = measured->gaps.size();
    if (measured->error_budget) json["sheet"]["sd_mm"] = measured->error_budget->total_m / mm;
  }
  json["layings"] = Json::array();
  for (const Laying& laying : layings(name))
    json["layings"].push_back(
        {{"set", laying.set}, {"repeat", laying.repeat}, {"face", laying.face}});
  json["plates"] = Json::array();
  for (std::size_t k = 0; k < one.scene.tags.size(); ++k) {
    const ObjectTags& plate = one.scene.tags[k];
    const Chain::Object& object = chain.objects[k];
    Json item = said_in(against_object(chain, object) ? Json() : ending_of(object.file));
    item["object"] = plate.object;
    item["set"] = plate.set;
    json["plates"].push_back(std::move(item));
  }
  json["simulations"] = Json::array();
  const bool simulated = !against_sheet(run_chain(one));
  for (const int segment : rig_.segments) {
    const fs::path file = out_ / name / simulation_folder(rig_.spacing_m, segment) / "sheet.json";
    const bool there = simulated && fs::is_regular_file(file) && !against_inputs(file);
    json["simulations"].push_back(
        {{"spacing_mm", rig_.spacing_m / units::mm},
         {"segments", segment},
         {"there", there},
         {"sentence", said_in(there ? ending_of(file) : Json())["sentence"]}});
  }
  return json;
}

Json Bench::state() const {
  Json json = {{"rig", rig_.name},
               {"replay", options_.replay},
               {"operator", operator_name()},
               {"out", out_.string()},
               {"target", {{"rows", target_.rows}, {"cols", target_.cols}}}};
  json["cameras"] = Json::array();
  for (const RigCamera& camera : rig_.cameras)
    json["cameras"].push_back(
        {{"name", camera.name}, {"width_px", camera.width_px}, {"height_px", camera.height_px}});
  // Before the sets, so that one that is no longer being taken is among them.
  json["capture"] = capture_json();
  json["sets"] = Json::array();
  for (const std::string& set : target_sets()) json["sets"].push_back(set_json(set));
  for (const Drape& one : drapes_)
    for (const std::string& set : sets_of(one)) json["sets"].push_back(set_json(set));
  json["calibration"] = calibration_json();
  json["calibration_superseded"] = Json();
  if (const auto why = against_calibration(calibration_file(), target_detections_file());
      why && fs::is_regular_file(run_record_path(calibration_file())))
    json["calibration_superseded"] = *why;
  json["drapes"] = Json::array();
  const Json distances = results({"trend", "--by", "fabric"});
  bool reported = true;  // the report is of these pictures
  for (const Drape& one : drapes_) {
    Json item = drape_json(one);
    const Json* row = of_scene(distances, one.scene.name);
    const auto why = row != nullptr ? against_result(one, *row) : std::nullopt;
    item["result"] = row != nullptr && !why ? *row : Json();
    item["result_superseded"] = why ? Json(*why) : Json();
    reported = reported && !why;
    json["drapes"].push_back(std::move(item));
  }
  json["report"] = fs::is_regular_file(report());
  json["report_superseded"] = !reported;
  json["jobs"] = Json::array();
  for (const Job& job : jobs_.list()) json["jobs"].push_back(job.json());
  json["log"] = log_.last(kShownEntries);
  json["log_entries"] = log_.size();
  json["log_torn"] = log_.torn();
  const auto edited = edited_since_start();
  const std::lock_guard lock(mutex_);
  json["trouble"] = trouble_;
  if (edited && trouble_.empty())
    json["trouble"] = *edited + " was edited: end the console and start it again";
  return json;
}

Json Bench::marks(const std::string& set) const {
  require_set(set);
  Json json = {{"set", set}, {"cameras", Json::object()}};
  if (const auto seen = detections(set))
    for (const FrameDetections& frame : seen->frames) json["cameras"][frame.camera] = places(frame);
  return json;
}

Json Bench::live_marks(bool of_cloth) const {
  Json json = {{"cameras", Json::object()}, {"still_s", still_json()}};
  const auto seen =
      live_marks_ ? live_marks_->look(of_cloth ? Surface::cloth : Surface::target) : nullptr;
  if (!seen) return json;
  for (const FrameDetections& frame : seen->frames) {
    // A pixel of the picture is the mean of a square of the sensor's.
    Json& one = json["cameras"][frame.camera] =
        places(frame, rig_.camera(frame.camera).width_px / frame.width_px);
    one["measured"] = frame.detections.size();
    one["tags"] = frame.tags.size();
  }
  json["printed"] = seen->lattice.rows * seen->lattice.cols;
  return json;
}

Json Bench::frame_facts(const std::string& set) const {
  require_set(set);
  Json json = Json::array();
  const auto recorded = recording();
  const FrameSet& frames = recorded->set(set);
  const auto seen = detections(set);
  for (const RecordedFrame& frame : frames.frames) {
    const Picture shown = pictures_.picture(*recorded, frames, frame, 640, true);
    Json one = {{"camera", frame.camera},
                {"saturated_percent", 100 * shown.saturated_fraction},
                {"sigma_px", Json()},
                {"noise_grey", Json()}};
    if (seen)
      for (const FrameDetections& of : seen->frames)
        if (of.camera == frame.camera) {
          one["sigma_px"] = optional_json(sigma_px(of));
          one["noise_grey"] = optional_json(of.noise_sigma);
        }
    json.push_back(std::move(one));
  }
  return {{"set", set}, {"cameras", json}};
}

Json Bench::coverage() const {
  Json json = {{"cameras", Json::object()}, {"points_mm", Json::array()}};
  const auto now = calibration();
  for (const std::string& set : taken_target_sets()) {
    const auto seen = detections(set);
    if (!seen) continue;
    for (const FrameDetections& frame : seen->frames) {
      Json& list = json["cameras"][frame.camera];
      if (list.is_null()) list = Json::array();
      for (const Detection& dot : frame.detections) list.push_back(point_px(dot.centre_px));
    }
    if (!now) continue;
    if (const auto measured = measure_target(*now, target_, seen->frames))
      for (const Eigen::Vector3d& point : measured->points_in_world)
        json["points_mm"].push_back(point_mm(point));
  }
  return json;
}

Json Bench::coach() const {
  const auto now = calibration();
  if (!now) return {{"advice", "Calibrate first: the coach predicts from a first calibration."}};
  if (drapes_.empty() || now->joint_covariance.size() == 0)
    return {{"advice", "The coach needs a drape in the rig and a calibration with free poses."}};
  Eigen::Vector2d half(0, 0);
  for (const Drape& one : drapes_) half = half.cwiseMax(0.5 * one.print.patch_m);
  const WorldBox volume{{-half.x(), -half.y(), 0}, {half.x(), half.y(), half.maxCoeff()}};
  std::vector<double> sigma;
  for (const CalibratedCamera& camera : now->cameras) {
    std::vector<double> all;
    for (const std::string& set : now->sets)
      if (const auto seen = detections(set))
        for (const FrameDetections& frame : seen->frames)
          if (const auto one = sigma_px(frame); one && frame.camera == camera.camera.name)
            all.push_back(*one);
    if (all.empty()) return {{"advice", "The sets of the calibration are gone; calibrate again."}};
    sigma.push_back(median(std::move(all)));
  }
  const PosePlanner coach(*now, points_of(target_), volume, sigma);
  if (!coach.sees_volume())
    return {{"advice",
             "No two cameras see the volume in which cloths are measured: turn the "
             "cameras towards the object."}};
  const PredictedError error = coach.now();
  // Squares add: a third of the marks' own noise makes a measured point worse by 5 %.
  const double goal_m = error.marks_m / 3;
  Json json = {{"calibration_mm", error.calibration_m / mm},
               {"marks_mm", error.marks_m / mm},
               {"goal_mm", goal_m / mm},
               {"reached", error.calibration_m <= goal_m}};
  if (const auto next = coach.next()) {
    Json views = Json::array();
    for (std::size_t k = 0; k < next->cameras.size(); ++k) {
      Json outline = Json::array();
      for (const Eigen::Vector2d& px : next->outline_px[k]) outline.push_back(point_px(px));
      const auto camera = static_cast<std::size_t>(next->cameras[k]);
      views.push_back({{"camera", now->cameras[camera].camera.name}, {"outline_px", outline}});
    }
    json["next"] = {
        {"words", next->words}, {"calibration_mm", next->calibration_m / mm}, {"views", views}};
  }
  return json;
}

Json Bench::history() const {
  const std::string store = store_file().string();
  Json json = {{"store", store}};
  json["runs"] = results({"runs"});
  json["comparisons"] = results({"list"});
  json["trend"] = results({"trend"});
  json["acceptances"] = results({"sql", kAcceptances});
  json["calibrations"] = results({"sql", kCalibrations});
  json["distances"] = results({"trend", "--by", "fabric"});
  json["commands"] = Json::array();
  for (const char* query : {kAcceptances, kCalibrations})
    json["commands"].push_back(Call{{"results", "sql", query, "--store", store}}.shown());
  return json;
}

Json Bench::difference(const std::string& run_a, const std::string& run_b) const {
  for (const std::string& run : {run_a, run_b})
    if (run.empty() || run.size() > 9 ||
        !std::all_of(run.begin(), run.end(), [](char c) { return c >= '0' && c <= '9'; }))
      throw bad_input("a run is a number", {.field = run}, "take one of the list");
  return results({"diff", run_a, run_b});
}

Picture Bench::picture(const std::string& set, const std::string& camera, int width_px,
                       bool mark_saturation) const {
  require_set(set);
  const auto recorded = recording();
  const FrameSet& frames = recorded->set(set);
  for (const RecordedFrame& frame : frames.frames)
    if (frame.camera == camera)
      return pictures_.picture(*recorded, frames, frame, width_px, mark_saturation);
  throw bad_input("the set has no image of this camera", {.camera = camera, .set = set},
                  "reload the page");
}

}  // namespace drape::console
