// SPDX-License-Identifier: Apache-2.0
// Files of the console's own folder, and those of other programs that it reads.
#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <tuple>

#include "console/bench.hpp"
#include "core/program/run_record.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;

/// The rig's file in this folder.
std::string text_in(const fs::path& folder, Rig rig) {
  const auto beside = [&](fs::path& file) {
    if (!file.empty()) file = fs::proximate(fs::absolute(file), fs::absolute(folder));
  };
  for (fs::path* file : {&rig.target_file, &rig.print_file, &rig.recording}) beside(*file);
  for (fs::path& scene : rig.scenes) beside(scene);
  return text_of(rig);
}

void write_where_new(const fs::path& file, const std::string& text) {
  if (!fs::is_regular_file(file) || read_text(file) != text) write_durable(file, text);
}

}  // namespace

Json ending_of(const fs::path& output) {
  const std::optional<Ending> ending = kept_ending(run_record_path(output));
  if (!ending) return {};
  Json json = {{"verdict", ending->go ? "GO" : "NO-GO"}, {"sentence", ending->verdict}};
  json["lines"] = Json::array();
  for (const auto& [name, value] : ending->numbers) json["lines"].push_back(name + "  " + value);
  for (const auto& [sign, list] :
       {std::pair("rejected: ", &ending->rejected), std::pair("warning: ", &ending->warnings),
        std::pair("advice: ", &ending->advice)})
    for (const std::string& line : *list) json["lines"].push_back(sign + line);
  return json;
}

fs::path Bench::detections_file(const std::string& set) const {
  return own_ / "detections" / (set + ".json");
}

fs::path Bench::sheet_file(const std::string& drape) const {
  return own_ / drape / "sheet.json";
}

fs::path Bench::object_file(const std::string& drape, int object) const {
  return own_ / drape / fmt::format("object_{}.json", object);
}

fs::path Bench::scene_file(const Drape& drape, std::size_t plates) const {
  return plates == 0 ? drape.scene.file
                     : own_ / drape.scene.name / fmt::format("scene_{}.toml", plates);
}

Call Bench::detect_call(const std::string& set) const {
  const ObjectTags* plate = plate_of(set);
  Call call{{"detect", recording_folder_.string(), "--rig", rig_.file.string(), "--surface",
             plate != nullptr || is_target_set(set) ? "target" : "cloth", "--sets", set, "--out",
             detections_file(set).string(), "--threads", "1"}};
  if (plate != nullptr) call.words.insert(call.words.end(), {"--target", plate->target.string()});
  return call;
}

Call Bench::missing_detect_call(const std::string& set) const {
  Call call = detect_call(set);
  call.needed = [this, set] { return facts(set) == nullptr; };
  return call;
}

std::vector<Call> Bench::object_calls(const Drape& drape) const {
  std::vector<Call> calls;
  for (const ObjectTags& plate : drape.scene.tags) {
    if (!is_taken(plate.set)) continue;
    Call call{{"object", detections_file(plate.set).string(), "--calibration",
               calibration_file().string(), "--set", plate.set, "--scene",
               scene_file(drape, calls.size()).string(), "--object", std::to_string(plate.object),
               "--scene-out", scene_file(drape, calls.size() + 1).string(), "--out",
               object_file(drape.scene.name, plate.object).string()}};
    for (const auto& [option, value] : plate.lies())
      call.words.insert(call.words.end(), {option, fmt::format("{}", value)});
    calls.push_back(std::move(call));
  }
  return calls;
}

Scene Bench::measured_scene(const Drape& drape) const {
  const Chain chain = own_chain(drape);
  std::size_t plates = 0;
  for (const Chain::Object& object : chain.objects) {
    if (!is_taken(object.set)) continue;
    if (against_object(chain, object) || !is_made_of(object.file, scene_file(drape, plates))) break;
    ++plates;
  }
  return plates == 0 ? drape.scene : read_scene(scene_file(drape, plates));
}

/// The rig with what was taken only, so that a bench is measured from the sets it has.
std::string Bench::rig_text(bool for_calibration) const {
  Rig rig = rig_;
  rig.recording = recording_folder_;
  std::erase_if(rig.free_poses, [&](const std::string& set) { return !is_taken(set); });
  std::erase_if(rig.stages, [&](const TargetStage& stage) { return !is_taken(stage.set); });
  rig.scenes.clear();
  rig.repeats.clear();
  if (for_calibration) {
    rig.print_file.clear();
  } else {
    for (const Drape& drape : drapes_)
      if (is_taken(drape.scene.set)) rig.scenes.push_back(drape.scene.file);
    for (const Laying& one : layings())
      if (one.named && is_taken(one.set) && is_taken(drape(one.drape).scene.set))
        rig.repeats.push_back({one.drape, one.set, one.repeat, one.face});
  }
  return fmt::format("# Made by `drape bench`: {} with the sets that were taken.\n",
                     rig_.file.filename().string()) +
         text_in(own_, std::move(rig));
}

/// Rig of scaled pictures, for detect alone.
std::string Bench::live_rig_text(const fs::path& folder,
                                 const std::map<std::string, std::pair<int, int>>& px) const {
  Rig rig;
  rig.name = rig_.name;
  rig.target_file = rig_.target_file;
  rig.recording = folder / "recording";
  if (!drapes_.empty()) rig.print_file = drapes_.front().scene.print_file;
  for (RigCamera camera : rig_.cameras) {
    const auto size = px.find(camera.name);
    if (size == px.end()) continue;
    std::tie(camera.width_px, camera.height_px) = size->second;
    rig.cameras.push_back(std::move(camera));
  }
  return text_in(folder, std::move(rig));
}

void Bench::write_rig() const {
  write_where_new(rig_file(), rig_text(false));
  // `drape run` looks for it beside the rig.
  const fs::path accepted = rig_.file.parent_path() / "acceptance.json";
  const fs::path copy = own_ / "acceptance.json";
  if (fs::is_regular_file(accepted))
    write_durable(copy, read_text(accepted));
  else
    fs::remove(copy);
}

void Bench::write_calibration_rig() const {
  write_where_new(calibration_rig_file(), rig_text(true));
}

void Bench::merge_detections(const std::vector<std::string>& sets) const {
  Detections all;
  for (const std::string& set : sets) {
    const auto one = detections(set);
    if (!one)
      throw bad_input("the marks of a set are not those of its pictures", {.set = set},
                      "calibrate again");
    if (!all.frames.empty() && all.lattice.sha256 != one->lattice.sha256)
      throw bad_input("the marks of the sets are of two targets", {.set = set}, "calibrate again");
    all.rig = one->rig;
    all.lattice = one->lattice;
    all.frames.insert(all.frames.end(), one->frames.begin(), one->frames.end());
    all.no_go.insert(one->no_go.begin(), one->no_go.end());
  }
  write_detections(target_detections_file(), all);
}

/// Answer of `drape results`, asked once for each content of the store.
Json Bench::results(const std::vector<std::string>& words) const {
  const std::string stamp = stamp_of(store_file());
  if (stamp.empty()) return {};
  Call call{{"results"}};
  call.words.insert(call.words.end(), words.begin(), words.end());
  call.words.insert(call.words.end(), {"--store", store_file().string()});
  const std::string key = call.shown();
  {
    const std::lock_guard lock(mutex_);
    if (kept_results_stamp_ != stamp) kept_results_.clear();
    kept_results_stamp_ = stamp;
    if (const auto found = kept_results_.find(key); found != kept_results_.end())
      return found->second;
  }
  std::atomic<pid_t> child = 0;
  const CallEnd end = run_call(
      call, [](double, const std::string&) {}, child);
  if (end.exit_code > 1) return {};  // a run is writing it
  Json json = try_json(end.output);
  if (json.is_discarded()) return {};
  const std::lock_guard lock(mutex_);
  kept_results_[key] = json;
  return json;
}

}  // namespace drape::console
