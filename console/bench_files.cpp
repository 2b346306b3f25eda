// SPDX-License-Identifier: Apache-2.0
// Files of the console's own folder, and those of other programs that it reads.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>

#include "console/bench.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;

std::string quoted(const std::string& text) {
  return Json(text).dump();  // TOML's basic strings have JSON's escapes
}

std::string quoted_from(const fs::path& folder, const fs::path& file) {
  return quoted(fs::proximate(fs::absolute(file), fs::absolute(folder)).generic_string());
}

std::string camera_table(const RigCamera& camera, int width_px, int height_px) {
  return fmt::format(
      "\n[[camera]]\nname = {}\nwidth_px = {}\nheight_px = {}\npixel_pitch_um = [{:.9f}, "
      "{:.9f}]\n",
      quoted(camera.name), width_px, height_px, camera.pixel_pitch_x_m / units::um,
      camera.pixel_pitch_y_m / units::um);
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
  const Plate* plate = plate_of(set);
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
  for (const Plate& plate : drape.plates) {
    if (!is_taken(plate.set)) continue;
    Call call{{"object", detections_file(plate.set).string(), "--calibration",
               calibration_file().string(), "--set", plate.set, "--scene",
               scene_file(drape, calls.size()).string(), "--object", std::to_string(plate.object),
               "--scene-out", scene_file(drape, calls.size() + 1).string(), "--out",
               object_file(drape.scene.name, plate.object).string()}};
    call.words.insert(call.words.end(), plate.lies.begin(), plate.lies.end());
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
  const auto relative = [&](const fs::path& file) { return quoted_from(own_, file); };
  const auto taken = [&](const std::string& set) { return is_taken(set); };
  std::vector<std::string> poses, scenes;
  std::copy_if(rig_.free_poses.begin(), rig_.free_poses.end(), std::back_inserter(poses), taken);
  for (const Drape& drape : drapes_)
    if (!for_calibration && taken(drape.scene.set)) scenes.push_back(relative(drape.scene.file));
  std::string text = fmt::format(
      "# Made by `drape bench`: {} with the sets that were taken.\n"
      "schema = \"drapebench/rig/1\"\nname = {}\ntarget = {}\n",
      rig_.file.filename().string(), quoted(rig_.name), relative(rig_.target_file));
  if (!for_calibration && !rig_.print_file.empty())
    text += fmt::format("print = {}\n", relative(rig_.print_file));
  text += fmt::format("recording = {}\n", relative(recording_folder_));
  if (!scenes.empty())
    text += fmt::format("scenes = [{}]\ngrids = [{}]\nsegments = [{}]\n", fmt::join(scenes, ", "),
                        fmt::join(rig_.grids, ", "), fmt::join(rig_.segments, ", "));
  text += fmt::format("\n[calibration]\nestimate_scale_x = {}\nfree_poses = {}\n",
                      rig_.estimate_scale_x, Json(poses).dump());
  for (const TargetStage& stage : rig_.stages)
    if (taken(stage.set))
      text += fmt::format("\n[[calibration.stage]]\nset = {}\nz_mm = {:.9f}\n", quoted(stage.set),
                          stage.z_m / units::mm);
  for (const Laying& one : layings())
    if (!for_calibration && one.named && taken(one.set) && taken(drape(one.drape).scene.set)) {
      text += fmt::format("\n[[repeat]]\nscene = {}\nset = {}\nrepeat = {}\n", quoted(one.drape),
                          quoted(one.set), quoted(one.repeat));
      if (!one.face.empty()) text += fmt::format("face = {}\n", quoted(one.face));
    }
  for (const RigCamera& camera : rig_.cameras)
    text += camera_table(camera, camera.width_px, camera.height_px);
  return text;
}

/// Rig of scaled pictures, for detect alone.
std::string Bench::live_rig_text(const fs::path& folder,
                                 const std::map<std::string, std::pair<int, int>>& px) const {
  const auto relative = [&](const fs::path& file) { return quoted_from(folder, file); };
  std::string text = fmt::format(
      "schema = \"drapebench/rig/1\"\nname = {}\ntarget = {}\nrecording = \"recording\"\n",
      quoted(rig_.name), relative(rig_.target_file));
  if (!drapes_.empty())
    text += fmt::format("print = {}\n", relative(drapes_.front().scene.print_file));
  text += "\n[calibration]\nfree_poses = []\n";
  for (const RigCamera& camera : rig_.cameras) {
    const auto size = px.find(camera.name);
    if (size == px.end()) continue;
    text += camera_table(camera, size->second.first, size->second.second);
  }
  return text;
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
