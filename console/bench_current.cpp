// SPDX-License-Identifier: Apache-2.0
// Files that belong to the pictures that recording.json lists now. The files say it themselves:
// marks name the images in which they were measured, a record the content of each input.
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>

#include "console/bench.hpp"
#include "core/program/run_record.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;

/// Contents of files in memory: a calibration has some twenty sets. Were all kept that were ever
/// read, 600 sets would take 60 MB.
constexpr std::size_t kMostKept = 64;

/// Why something is superseded; what cannot be read is.
template <class Ask>
std::optional<std::string> reason_of(Ask ask) {
  try {
    return ask();
  } catch (const Error& error) {
    return error.what();
  }
}

}  // namespace

/// Which content a file name stands for: it changes with every write and every replacement.
std::string Bench::stamp_of(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return {};
  return fmt::format("{} {} {}.{}", status.st_ino, status.st_size, status.st_mtim.tv_sec,
                     status.st_mtim.tv_nsec);
}

/// Read once for each content; nothing while the file, or the record that is written after it, is
/// not there.
template <class T>
std::shared_ptr<const T> Bench::kept(KeptFiles& files, const fs::path& file,
                                     T (*read)(const fs::path&)) const {
  const std::string stamp = stamp_of(file);
  if (stamp.empty()) return nullptr;
  const KeptFiles::key_type key{file, typeid(T)};
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = files.find(key); found != files.end() && found->second.stamp == stamp) {
      found->second.used = ++uses_;
      return std::static_pointer_cast<const T>(found->second.content);
    }
  }
  std::shared_ptr<const T> content;
  try {
    content = std::make_shared<const T>(read(file));
  } catch (const Error&) {
    // Without its record it is being written.
    if (!fs::is_regular_file(run_record_path(file))) return nullptr;
    throw;
  }
  const std::lock_guard lock(mutex_);
  files[key] = {stamp, content, ++uses_};
  if (&files == &kept_ && files.size() > kMostKept)
    files.erase(std::min_element(files.begin(), files.end(), [](const auto& a, const auto& b) {
      return a.second.used < b.second.used;
    }));
  return content;
}

std::shared_ptr<const Recording> Bench::recording() const {
  const auto read = [](const fs::path& file) { return read_recording(file.parent_path()); };
  if (auto found = kept<Recording>(kept_, recording_folder_ / "recording.json", read)) return found;
  return std::make_shared<const Recording>(Recording{recording_folder_, "capture", {}, {}});
}

/// Null where the recording does not list the set.
std::shared_ptr<const FrameSet> Bench::recorded_set(const std::string& set) const {
  const auto recorded = recording();
  for (const FrameSet& one : recorded->sets)
    if (one.name == set) return {recorded, &one};
  return nullptr;
}

Bench::Images Bench::images(const std::string& set) const {
  Images images;
  if (const auto recorded = recorded_set(set))
    for (const RecordedFrame& frame : recorded->frames) images[frame.camera] = frame.sha256;
  return images;
}

std::shared_ptr<const Bench::Inputs> Bench::inputs_of(const fs::path& output) const {
  return kept<Inputs>(facts_, run_record_path(output), read_inputs);
}

std::shared_ptr<const std::string> Bench::content_of(const fs::path& file) const {
  return kept<std::string>(facts_, file, sha256_as_read);
}

std::shared_ptr<const Rig> Bench::rig_in(const fs::path& file) const {
  const auto read = [](const fs::path& path) { return read_rig(path); };
  return kept<Rig>(facts_, file, read);
}

/// As the recording says.
bool Bench::is_no_go(const std::string& set) const {
  const auto recorded = recorded_set(set);
  return recorded && recorded->no_go;
}

bool Bench::shows(const SetFacts& seen, const std::string& set) const {
  const auto found = seen.images.find(set);
  return found != seen.images.end() && found->second == images(set) &&
         (!is_no_go(set) || seen.no_go.contains(set));
}

std::shared_ptr<const Bench::SetFacts> Bench::facts(const std::string& set) const {
  const fs::path file = detections_file(set);
  if (!fs::is_regular_file(run_record_path(file))) return nullptr;
  try {
    auto seen = kept<SetFacts>(facts_, file, read_set_facts);
    return seen && shows(*seen, set) && !against_pictures(set) && !against_inputs(file) ? seen
                                                                                        : nullptr;
  } catch (const Error&) {  // damaged: it is measured again
    return nullptr;
  }
}

std::shared_ptr<const Detections> Bench::detections(const std::string& set) const {
  return facts(set) ? kept<Detections>(kept_, detections_file(set), read_detections) : nullptr;
}

std::shared_ptr<const Calibration> Bench::calibration() const {
  if (against_calibration(calibration_file(), target_detections_file())) return nullptr;
  return kept<Calibration>(kept_, calibration_file(), read_calibration);
}

std::shared_ptr<const Sheet> Bench::measured_sheet(const Drape& drape) const {
  for (const Chain& chain : {own_chain(drape), run_chain(drape)})
    if (!against_sheet(chain)) return sheet_in(chain.sheet);
  return nullptr;
}

std::shared_ptr<const Sheet> Bench::sheet_in(const fs::path& file) const {
  if (file.empty() || !fs::is_regular_file(run_record_path(file))) return nullptr;
  return whole_sheet(file);
}

std::shared_ptr<const Sheet> Bench::whole_sheet(const fs::path& file) const {
  return file.empty() ? nullptr : kept<Sheet>(kept_, file, read_sheet);
}

Bench::Chain Bench::own_chain(const Drape& drape) const {
  Chain chain{drape.scene.set,
              target_detections_file(),
              calibration_file(),
              detections_file(drape.scene.set),
              sheet_file(drape.scene.name),
              {}};
  for (const ObjectTags& plate : drape.scene.tags)
    chain.objects.push_back(
        {object_file(drape.scene.name, plate.object), detections_file(plate.set), plate.set});
  return chain;
}

/// As `drape run` lays them out.
Bench::Chain Bench::run_chain(const Drape& drape) const {
  const fs::path folder = out_ / drape.scene.name;
  Chain chain{drape.scene.set,           out_ / "target-detections.json",
              out_ / "calibration.json", folder / "detections.json",
              folder / "sheet.json",     {}};
  for (const ObjectTags& plate : drape.scene.tags)
    chain.objects.push_back({folder / fmt::format("object_{}.json", plate.object),
                             folder / fmt::format("object_{}-detections.json", plate.object),
                             plate.set});
  return chain;
}

Bench::Chain Bench::run_chain(const Drape& drape, const Laying& laying) const {
  Chain chain = run_chain(drape);
  const fs::path folder = out_ / drape.scene.name / "repeats" / laying.repeat;
  chain.set = laying.set;
  chain.marks = folder / "detections.json";
  chain.sheet = folder / "sheet.json";
  return chain;
}

std::optional<std::string> Bench::against_marks(const fs::path& marks,
                                                const std::string& set) const {
  if (is_left_out(set)) return fmt::format("`{}` is left out", set);
  return reason_of([&]() -> std::optional<std::string> {
    const auto seen = kept<SetFacts>(facts_, marks, read_set_facts);
    if (!seen || !shows(*seen, set)) return fmt::format("`{}` has other pictures now", set);
    if (auto why = against_pictures(set)) return why;
    // Marks that the console merged have no record; those of each set have.
    return against_inputs(marks == target_detections_file() ? detections_file(set) : marks);
  });
}

std::optional<std::string> Bench::against_calibration(const fs::path& calibration,
                                                      const fs::path& target_marks) const {
  return reason_of([&]() -> std::optional<std::string> {
    const auto made = fs::is_regular_file(run_record_path(calibration))
                          ? kept<Calibration>(kept_, calibration, read_calibration)
                          : nullptr;
    if (!made) return "there is no calibration";
    for (const std::string& set : made->sets)
      if (auto why = against_marks(target_marks, set)) return why;
    if (!is_made_of(calibration, target_marks)) return "the target's marks were measured again";
    return against_inputs(calibration);
  });
}

std::optional<std::string> Bench::against_object(const Chain& chain,
                                                 const Chain::Object& object) const {
  if (auto why = against_marks(object.marks, object.set)) return why;
  if (!is_made_of(object.file, object.marks) || !is_made_of(object.file, chain.calibration))
    return fmt::format("the plate of `{}` is not measured with its pictures", object.set);
  return against_inputs(object.file);
}

std::optional<std::string> Bench::against_sheet(const Chain& chain) const {
  const auto unmeasured = [&]() -> std::optional<std::string> {
    if (!sheet_in(chain.sheet)) return "it is not measured";
    return std::nullopt;
  };
  if (auto why = reason_of(unmeasured)) return why;
  if (auto why = against_marks(chain.marks, chain.set)) return why;
  if (auto why = against_calibration(chain.calibration, chain.target_marks))
    return "its calibration: " + *why;
  if (!is_made_of(chain.sheet, chain.calibration)) return "the cameras were calibrated again";
  if (!is_made_of(chain.sheet, chain.marks)) return "the marks were measured again";
  for (const Chain::Object& object : chain.objects) {
    if (!is_taken(object.set) && !is_listed(chain.sheet, object.file)) continue;
    if (auto why = against_object(chain, object)) return why;
    if (!is_made_of(chain.sheet, object.file))
      return fmt::format("the plate of `{}` was measured since", object.set);
  }
  return against_inputs(chain.sheet);
}

/// Rows of the store that are of the sheet that `drape run` measured last, in one run.
Json Bench::comparisons(const Drape& drape, const Json& run) const {
  Json some = Json::array();
  const auto content = content_of(run_chain(drape).sheet);
  const Json all = results({"list", "--scene", drape.scene.name});
  if (content && all.is_array())
    for (const Json& one : all)
      if (one.value("run", Json()) == run && content->starts_with(one.value("measured", "-")))
        some.push_back(one);
  return some;
}

/// The match of a run is judged by the further layings too that it was given.
std::optional<std::string> Bench::against_layings(const Drape& drape, const Json& run) const {
  const auto own = content_of(run_chain(drape).sheet);
  const Json given = results(
      {"sql", fmt::format("SELECT l.set_name, l.repeat, l.sheet_sha256 FROM real_repeat AS l JOIN "
                          "run_match AS m ON m.sha256 = l.match_sha256 JOIN run AS r ON r.sha256 = "
                          "m.run_sha256 WHERE r.number = {} AND m.measured_sha256 = '{}' AND "
                          "l.sheet_sha256 != m.measured_sha256",
                          run.dump(), own ? *own : "")});
  if (!given.is_array()) return "the results cannot be read now";
  const std::vector<Laying> known = layings(drape.scene.name);
  for (const Json& one : given) {
    const auto laying = std::find_if(known.begin(), known.end(), [&](const Laying& of) {
      return of.set == one["set_name"] && of.repeat == one["repeat"];
    });
    const std::string set = one["set_name"];
    if (laying == known.end()) return fmt::format("`{}` is no laying of the rig now", set);
    const Chain chain = run_chain(drape, *laying);
    if (const auto why = against_sheet(chain)) return fmt::format("its laying `{}`: {}", set, *why);
    const auto content = content_of(chain.sheet);
    if (!content || *content != one["sheet_sha256"])
      return fmt::format("its laying `{}` was measured again", set);
  }
  return std::nullopt;
}

std::optional<std::string> Bench::against_result(const Drape& drape, const Json& row) const {
  if (auto why = against_sheet(run_chain(drape))) return why;
  if (comparisons(drape, row["run"]).empty()) return "the drape was measured again";
  if (auto why = against_layings(drape, row["run"])) return why;
  return against_report(drape);
}

}  // namespace drape::console
