// SPDX-License-Identifier: Apache-2.0
#include "console/files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "console/jobs.hpp"
#include "core/statistics/sample.hpp"

namespace drape::console {
namespace {

/// Number of file contents kept in memory: a calibration has some twenty sets. Keeping everything
/// ever read, 600 sets would take 60 MB.
constexpr std::size_t kMostKept = 64;

/// Tolerance of heights, which are written in mm with nine decimals and read back.
constexpr double kSameHeight_m = 1e-11;

/// The file with links to its folders resolved, as in records; the file's own name stays.
fs::path one_name(const fs::path& file) {
  const fs::path whole = fs::absolute(file).lexically_normal();
  std::error_code unreachable;
  return fs::weakly_canonical(whole.parent_path(), unreachable) / whole.filename();
}

bool is_below(const fs::path& file, const fs::path& folder) {
  const fs::path from = file.lexically_relative(folder);
  return !from.empty() && *from.begin() != "..";
}

Json detection_json(const MarkLattice& lattice, const std::vector<const FrameDetections*>& frames) {
  const int printed = lattice.rows * lattice.cols;
  Json cameras = Json::array();
  for (const FrameDetections* frame : frames) {
    std::map<std::string, int> reasons;
    for (const Rejection& one : frame->rejections) ++reasons[one.reason];
    const auto measured = static_cast<int>(frame->detections.size());
    const auto sigma = sigma_px(*frame);
    cameras.push_back({{"camera", frame->camera},
                       {"measured", measured},
                       {"missing", printed - measured},
                       {"tags", frame->tags.size()},
                       {"sigma_px", sigma ? Json(*sigma) : Json()},
                       {"rejected", reasons}});
  }
  return {{"printed", printed}, {"cameras", cameras}};
}

}  // namespace

std::optional<double> sigma_px(const FrameDetections& frame) {
  std::vector<double> all;
  for (const Detection& dot : frame.detections)
    all.push_back(std::sqrt(0.5 * dot.covariance_px2.trace()));
  if (all.empty()) return std::nullopt;
  return median(std::move(all));
}

Json ending_of(const fs::path& output) {
  const std::optional<Ending> ending = kept_ending(run_record_path(output));
  return ending ? try_json(one_line(value_of(*ending))) : Json{{"verdict", ""}, {"sentence", ""}};
}

const Json* of_scene(const Json& rows, const std::string& scene) {
  const Json* found = nullptr;
  if (rows.is_array())
    for (const Json& row : rows)
      if (row.is_object() && row.value("scene", "") == scene) found = &row;
  return found;
}

// ---- paths -----------------------------------------------------------------------------------

/// Path of the marks as in the output of `drape run`.
fs::path Files::run_marks_file(const std::string& set) const {
  const auto bench = session_.bench();
  if (bench->is_target_set(set)) return session_.out / "target-detections.json";
  const fs::path folder = session_.out / session_.drape_of(set);
  if (const ObjectTags* plate = bench->plate_of(set))
    return folder / fmt::format("object_{}-detections.json", plate->object);
  for (const Laying& one : session_.layings(session_.drape_of(set)))
    if (one.set == set && bench->drape(one.drape).scene.set != set)
      return folder / "repeats" / one.repeat / "detections.json";
  return folder / "detections.json";
}

/// Marks of the set's current pictures, from the first detection or from `drape run`.
fs::path Files::marks_file(const std::string& set) const {
  for (const fs::path& file : {look_file(set), run_marks_file(set)})
    if (is_made(file) && !why_superseded(file, set)) return file;
  return {};
}

/// Path for people: relative to the rig's folder if inside it, otherwise with its own folder.
std::string Files::shown(const fs::path& file) const {
  const fs::path folder = one_name(session_.rig_file).parent_path();
  return (is_below(file, folder) ? file.lexically_relative(folder)
                                 : file.parent_path().filename() / file.filename())
      .generic_string();
}

// ---- contents --------------------------------------------------------------------------------

/// nullptr while the file, or the record written after it, does not exist.
template <class T>
std::shared_ptr<const T> Files::kept(KeptFiles& files, const fs::path& file,
                                     T (*read)(const fs::path&)) const {
  const std::string stamp = stamp_of(file);
  if (stamp.empty()) return nullptr;
  const KeptFiles::key_type key{file, typeid(T)};
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = files.find(key); found != files.end() && found->second.stamp == stamp)
      return std::static_pointer_cast<const T>(found->second.content);
  }
  const auto content = std::make_shared<const T>(read(file));
  const std::lock_guard lock(mutex_);
  if (&files == &contents_ && files.size() >= kMostKept) files.clear();
  files[key] = {stamp, content};
  return content;
}

std::shared_ptr<const Recording> Files::recording() const {
  const auto read = [](const fs::path& file) { return read_recording(file.parent_path()); };
  const fs::path& folder = session_.recording_folder;
  if (auto found = kept<Recording>(contents_, folder / "recording.json", read)) return found;
  return std::make_shared<const Recording>(Recording{folder, "capture", {}, {}});
}

std::shared_ptr<const FrameSet> Files::recorded(const std::string& set) const {
  const auto all = recording();
  for (const FrameSet& one : all->sets)
    if (one.name == set) return {all, &one};
  return nullptr;
}

std::vector<std::string> Files::earlier_takes(const std::string& set) const {
  std::vector<std::string> sets;
  const auto all = recording();  // keeps alive what is searched
  for (const FrameSet& one : all->sets)
    if (one.name.starts_with(set + ".take")) sets.push_back(one.name);
  return sets;
}

Files::Facts Files::read_facts(const fs::path& file) {
  const Detections detections = read_detections(file);
  const Json ending = ending_of(file);
  std::map<std::string, std::vector<const FrameDetections*>> frames;
  for (const FrameDetections& frame : detections.frames) frames[frame.set].push_back(&frame);
  Facts all;
  for (const auto& [set, some] : frames) {
    SetFacts& facts = all[set];
    facts.detected = detection_json(detections.lattice, some);
    for (const FrameDetections* frame : some) facts.images[frame->camera] = frame->image_sha256;
    const auto no_go = detections.no_go.find(set);
    facts.verdict = no_go != detections.no_go.end() ? "NO-GO"
                    : frames.size() == 1            ? ending["verdict"]
                                                    : Json("GO");
    if (no_go != detections.no_go.end())
      facts.sentence = no_go->second;
    else if (frames.size() == 1)
      facts.sentence = ending["sentence"];
  }
  return all;
}

std::shared_ptr<const SetFacts> Files::facts(const std::string& set) const {
  try {
    const fs::path file = marks_file(set);
    const auto all = file.empty() ? nullptr : kept<Facts>(facts_, file, read_facts);
    if (!all || !all->contains(set)) return nullptr;
    return {all, &all->at(set)};
  } catch (const Error&) {  // damaged, so it is measured again
    return nullptr;
  }
}

std::shared_ptr<const Detections> Files::marks(const std::string& set) const {
  const fs::path file = marks_file(set);
  const auto all = file.empty() ? nullptr : kept<Detections>(contents_, file, read_detections);
  if (!all || file == look_file(set)) return all;
  auto some = std::make_shared<Detections>(*all);
  std::erase_if(some->frames, [&](const FrameDetections& frame) { return frame.set != set; });
  return some;
}

std::shared_ptr<const Calibration> Files::calibration() const {
  if (why_superseded(calibration_file())) return nullptr;
  return kept<Calibration>(contents_, calibration_file(), read_calibration);
}

std::shared_ptr<const Sheet> Files::sheet(const std::string& drape) const {
  return why_superseded(sheet_file(drape)) ? nullptr : sheet_in(sheet_file(drape));
}

std::shared_ptr<const Sheet> Files::sheet_in(const fs::path& file) const {
  return file.empty() ? nullptr : kept<Sheet>(contents_, file, read_sheet);
}

std::shared_ptr<const RunFile> Files::record_of(const fs::path& output) const {
  return kept<RunFile>(facts_, run_record_path(output), read_run_file);
}

Scene Files::measured_scene(const Drape& drape) const {
  const std::vector<ObjectTags>& tags = drape.scene.tags;
  if (tags.empty()) return drape.scene;
  const fs::path folder = session_.out / drape.scene.name;
  const fs::path by_run = folder / fmt::format("object_{}.json", tags.back().object);
  if (is_made(by_run) && !why_superseded(by_run))
    return read_scene(folder / fmt::format("scene_{}.toml", tags.back().object));
  std::size_t plates = 0;
  for (const ObjectTags& plate : tags) {
    if (!is_taken(plate.set)) continue;
    if (why_superseded(object_look_file(drape.scene.name, plate.object))) break;
    ++plates;
  }
  return plates == 0 ? drape.scene : read_scene(scene_look_file(drape, plates));
}

Json Files::results(const std::vector<std::string>& words) const {
  const std::string stamp = stamp_of(store_file());
  if (stamp.empty()) return {};
  Call call{{"results"}};
  call.words.insert(call.words.end(), words.begin(), words.end());
  call.words.insert(call.words.end(), {"--store", store_file().string()});
  const std::string key = call.shown();
  {
    const std::lock_guard lock(mutex_);
    if (results_stamp_ != stamp) results_.clear();
    results_stamp_ = stamp;
    if (const auto found = results_.find(key); found != results_.end()) return found->second;
  }
  std::atomic<pid_t> child = 0;
  const CallEnd end = run_call(
      call, [](double, const std::string&) {}, child);
  if (end.exit_code > 1) return {};  // a run is writing it
  Json json = try_json(end.output);
  if (json.is_discarded()) return {};
  const std::lock_guard lock(mutex_);
  results_[key] = json;
  return json;
}

// ---- the one table ---------------------------------------------------------------------------

bool Files::is_taken(const std::string& set) const {
  if (const auto word = session_.word_on(set)) return *word;
  const auto record = record_of(run_marks_file(set));
  if (!record) return false;
  return std::any_of(record->inputs.begin(), record->inputs.end(), [&](const RecordedFile& one) {
    return std::find(one.sets.begin(), one.sets.end(), set) != one.sets.end();
  });
}

bool Files::is_left_out(const std::string& set) const {
  return session_.word_on(set) == std::optional(false);
}

std::vector<std::string> Files::taken_target_sets() const {
  std::vector<std::string> sets = session_.bench()->target_sets();
  std::erase_if(sets, [&](const std::string& set) { return !is_taken(set); });
  return sets;
}

bool Files::is_made(const fs::path& output) const {
  return fs::is_regular_file(run_record_path(output));
}

/// Tests whether a file agrees with a record, once per content.
bool Files::holds(const fs::path& record, const RecordedFile& file) const {
  const fs::path place = place_of(record, file);
  const std::string stamp = stamp_of(place);
  const std::string key = place.string() + file.sha256 + file.values_sha256.value_or("");
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = holds_.find(key); found != holds_.end() && found->second.first == stamp)
      return found->second.second;
  }
  const bool so = is_as_recorded(record, file);
  const std::lock_guard lock(mutex_);
  holds_[key] = {stamp, so};
  return so;
}

Reason Files::why_superseded(const fs::path& output, const std::string& set) const {
  std::set<fs::path> seen;
  try {
    return superseded(one_name(output), set, seen);
  } catch (const Error& error) {
    return error.what();
  }
}

Reason Files::superseded(const fs::path& output, const std::string& set,
                         std::set<fs::path>& seen) const {
  const auto run = record_of(output);
  if (!run) return fmt::format("`{}` is not made", shown(output));
  const fs::path record = run_record_path(output);
  for (const RecordedFile& made : run->outputs)
    if (!holds(record, made))
      return fmt::format("`{}` is not as it was written", shown(one_name(place_of(record, made))));
  for (const RecordedFile& input : run->inputs) {
    for (const std::string& one : input.sets)
      if (set.empty() || one == set) {
        if (set.empty() && is_left_out(one)) return fmt::format("`{}` is left out", one);
        if (auto why = superseded_pictures(output, one)) return why;
      }
    if (!input.sets.empty()) continue;
    if (auto why = superseded_input(output, input, seen)) return why;
  }
  return std::nullopt;
}

/// Follows an input that another step made to its own inputs.
Reason Files::superseded_input(const fs::path& output, const RecordedFile& input,
                               std::set<fs::path>& seen) const {
  const fs::path record = run_record_path(output), file = one_name(place_of(record, input));
  if (!fs::is_regular_file(file)) return fmt::format("`{}` is gone", shown(file));
  const fs::path out = one_name(session_.out / "x").parent_path();
  const bool is_ours = is_below(file, out) && is_made(file);
  if (!holds(record, input))
    return fmt::format("`{}` was {} since", shown(file), is_ours ? "made again" : "edited");
  for (const fs::path& made : {out / "rig.toml", one_name(rig_file()), one_name(look_rig_file())})
    if (file == made) return rig_difference(file);
  if (file == one_name(session_.own / "acceptance.json")) {  // a copy of the rig's
    const fs::path source = session_.rig_file.parent_path() / "acceptance.json";
    if (!fs::is_regular_file(source) || sha256_of_file(source) != input.sha256)
      return "`acceptance.json` was edited since";
  }
  if (!is_ours || !seen.insert(file).second) return std::nullopt;
  auto why = superseded(file, {}, seen);
  if (why && file.filename() == "calibration.json") return "its calibration: " + *why;
  if (why && file.parent_path().parent_path().filename() == "repeats")
    return fmt::format("its laying `{}`: {}", file.parent_path().filename().string(), *why);
  return why;
}

/// A set can be retaken, or a picture replaced after its marks were measured.
Reason Files::superseded_pictures(const fs::path& marks, const std::string& set) const {
  const auto now = recorded(set);
  const auto all = kept<Facts>(facts_, marks, read_facts);
  std::map<std::string, std::string> images;
  if (now)
    for (const RecordedFrame& frame : now->frames) images[frame.camera] = frame.sha256;
  const bool is_seen = all && all->contains(set) && all->at(set).images == images;
  if (!is_seen || (now->no_go && all->at(set).verdict != "NO-GO"))
    return fmt::format("`{}` has other pictures now", set);
  for (const RecordedFrame& frame : now->frames)
    if (!holds(session_.recording_folder / "recording.json", {frame.file, frame.sha256}))
      return fmt::format("the picture `{}` is not as recorded", frame.file);
  return std::nullopt;
}

/// How the part of the rig read by a step differs from the current rig.
Reason Files::rig_difference(const fs::path& file) const {
  const auto read = [](const fs::path& path) { return read_rig(path); };
  const auto then = kept<Rig>(facts_, file, read);
  const auto bench = session_.bench();
  const Rig& now = bench->rig;
  const auto edited = [&](const std::string& what) {
    return fmt::format("`{}` was edited since: {}", shown(one_name(session_.rig_file)), what);
  };
  for (const TargetStage& stage : then->stages) {
    const auto found = std::find_if(now.stages.begin(), now.stages.end(),
                                    [&](const TargetStage& one) { return one.set == stage.set; });
    if (found == now.stages.end() || std::abs(found->z_m - stage.z_m) > kSameHeight_m)
      return edited(fmt::format("z_mm of `{}`", stage.set));
  }
  for (const std::string& pose : then->free_poses)
    if (!bench->is_target_set(pose)) return edited(fmt::format("`{}` is no free pose", pose));
  if (then->estimate_scale_x != now.estimate_scale_x) return edited("estimate_scale_x");
  for (const auto& [name, a, b] : {std::tuple("target", then->target_file, now.target_file),
                                   std::tuple("print", then->print_file, now.print_file)})
    if (!a.empty() && one_name(a) != one_name(b)) return edited(name);
  if (one_line(*value_of(*then).find("camera")) != one_line(*value_of(now).find("camera")))
    return edited("camera");
  return std::nullopt;
}

Reason Files::why_report_superseded(const Drape& drape) const {
  const fs::path report = one_name(report_file()), folder = report.parent_path();
  const auto run = record_of(report);
  if (!run) return "the report is not finished";
  std::set<fs::path> seen;
  bool is_in_it = false;
  const auto bench = session_.bench();
  try {
    for (const RecordedFile& input : run->inputs) {
      const fs::path file = one_name(place_of(run_record_path(report), input));
      const bool of_another =
          std::any_of(bench->drapes.begin(), bench->drapes.end(), [&](const Drape& other) {
            return other.scene.name != drape.scene.name &&
                   (is_below(file, folder / other.scene.name) ||
                    file == one_name(other.scene.file));
          });
      if (of_another) continue;
      is_in_it = is_in_it || is_below(file, folder / drape.scene.name);
      if (auto why = superseded_input(report, input, seen)) return why;
    }
  } catch (const Error& error) {
    return error.what();
  }
  if (!is_in_it) return "the last report is not of this drape";
  return std::nullopt;
}

}  // namespace drape::console
