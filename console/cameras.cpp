// SPDX-License-Identifier: Apache-2.0
#include "console/cameras.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <span>
#include <tuple>
#include <utility>

#include "console/tasks/pictures.hpp"
#include "core/error.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kKeptWords = 12;
constexpr double kAskedFor_s = 3;  ///< a page that shows stillness asks every second

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::span<const unsigned char> bytes_of(const std::string& text) {
  return {reinterpret_cast<const unsigned char*>(text.data()), text.size()};
}

/// Returns X of "GO: X stored" or "GO: X restored".
std::string stored_in(const std::string& line) {
  const std::string begin = "GO: ";
  for (const std::string end : {" stored", " restored"})
    if (line.starts_with(begin) && line.ends_with(end))
      return line.substr(begin.size(), line.size() - begin.size() - end.size());
  return {};
}

/// Event for "camera `X`: ...": it was lost or has returned.
std::optional<Json> turn_of(const std::string& line) {
  const std::string begin = "camera `";
  const std::size_t end = line.find("`: ");
  if (!line.starts_with(begin) || end == std::string::npos) return std::nullopt;
  return Json{{"camera", line.substr(begin.size(), end - begin.size())},
              {"back", line.find("`: it sends frames again") == end},
              {"words", line}};
}

/// Comment in a PGM file: its second line, without the `#`.
std::string comment_of(const std::string& pgm) {
  const std::string begin = "P5\n# ";
  if (!pgm.starts_with(begin)) return "{}";
  return pgm.substr(begin.size(), pgm.find('\n', begin.size()) - begin.size());
}

}  // namespace

std::string text_in(const fs::path& folder, Rig rig) {
  const auto beside = [&](fs::path& file) {
    if (!file.empty()) file = fs::proximate(fs::absolute(file), fs::absolute(folder));
  };
  for (fs::path* file : {&rig.target_file, &rig.print_file, &rig.recording}) beside(*file);
  for (fs::path& scene : rig.scenes) beside(scene);
  return text_of(rig);
}

std::string detect_rig_text(const BenchFiles& bench, const fs::path& folder,
                            const std::map<std::string, std::pair<int, int>>& px) {
  Rig rig;
  rig.name = bench.rig.name;
  rig.target_file = bench.rig.target_file;
  rig.estimate_scale_x = bench.rig.estimate_scale_x;
  rig.recording = folder / "recording";
  if (!bench.drapes.empty()) rig.print_file = bench.drapes.front().scene.print_file;
  for (RigCamera camera : bench.rig.cameras) {
    const auto size = px.find(camera.name);
    if (size == px.end() && !px.empty()) continue;
    if (!px.empty()) std::tie(camera.width_px, camera.height_px) = size->second;
    rig.cameras.push_back(std::move(camera));
  }
  return text_in(folder, std::move(rig));
}

Cameras::Cameras(Session& session, const Files& files, Reports reports)
    : session_(session), files_(files), reports_(std::move(reports)) {
  if (session.options.replay) return;
  std::vector<std::string> names;
  const auto bench = session.bench();  // holds what is looked through
  for (const RigCamera& camera : bench->rig.cameras) names.push_back(camera.name);
  watch_.emplace(names);
  live_marks_ = std::make_unique<LiveMarks>(
      [this, names] {
        std::map<std::string, std::string> all;
        std::uint64_t number = 0;
        for (const std::string& name : names)
          if (std::string bytes = newest(name, number); !bytes.empty())
            all[name] = std::move(bytes);
        return all;
      },
      [this](const fs::path& folder, const auto& px) {
        return detect_rig_text(*session_.bench(), folder, px);
      });
}

void Cameras::open() {
  const std::lock_guard lock(capture_mutex_);
  if (capture_ && capture_->runs()) throw bad_input("the cameras are open", {}, "take a set");
  session_.add(session_.who(), "opens the cameras");
  CaptureSession::Reports reports;
  reports.said = [this](const std::string& line) { heard(line); };
  reports.picture = [this](const std::string& camera, std::uint64_t number) {
    session_.tell("frame", {{"camera", camera}, {"number", number}});
    look(camera);
  };
  reports.ended = [this](const std::string& sentence) { ended(sentence); };
  capture_ =
      std::make_unique<CaptureSession>(session_.rig_file, session_.recording_folder, reports);
}

/// Makes the stored sets part of the recording.
void Cameras::close() {
  std::unique_ptr<CaptureSession> closing;
  {
    const std::lock_guard lock(capture_mutex_);
    if (!capture_ || !capture_->runs()) throw bad_input("the cameras are closed", {}, "open them");
    closing = std::move(capture_);
  }
  session_.add(session_.who(), "closes the cameras");
}

void Cameras::shut() {
  live_marks_.reset();
  std::unique_ptr<CaptureSession> closing;
  const std::lock_guard lock(capture_mutex_);
  closing.swap(capture_);
}

bool Cameras::runs() const {
  const std::lock_guard lock(capture_mutex_);
  return capture_ && capture_->runs();
}

std::string Cameras::taking() const {
  const std::lock_guard lock(mutex_);
  return taking_;
}

bool Cameras::automatic() const {
  const std::lock_guard lock(mutex_);
  return automatic_;
}

void Cameras::automatic(bool on) {
  {
    const std::lock_guard lock(mutex_);
    automatic_ = on;
  }
  const std::lock_guard lock(watch_mutex_);
  if (on) watch_->forget_last_set();
}

void Cameras::require_open() const {
  const std::lock_guard lock(mutex_);
  if (!ready_) throw bad_input("the cameras are not ready", {}, "wait, or open them again");
  if (!taking_.empty()) throw bad_input("a set is being taken", {.set = taking_}, "wait for it");
}

/// Types a line that stores a set.
void Cameras::type(const std::string& set, const std::string& line) {
  require_open();
  {
    const std::lock_guard lock(mutex_);
    taking_ = set;
  }
  const std::lock_guard lock(capture_mutex_);
  try {
    session_.add(session_.who(), "pressed " + line);
    if (!capture_) throw Error(ErrorKind::device, "the cameras are not open", {}, "open them");
    capture_->type(line);
  } catch (const Error&) {
    const std::lock_guard words(mutex_);
    taking_.clear();
    throw;
  }
}

void Cameras::take(const std::string& set) {
  type(set, files_.recorded(set) ? "r " + set : set);
}

void Cameras::undo(const std::string& set) {
  type(set, "u " + set);
}

void Cameras::light(const std::string& camera, const std::string& name, double value) {
  static_cast<void>(session_.bench()->rig.camera(camera));
  require_open();
  const std::string line = fmt::format("{} {} {}", name, value, camera);
  session_.add(session_.who(), "pressed " + line);
  const std::lock_guard lock(capture_mutex_);
  if (!capture_) throw Error(ErrorKind::device, "the cameras are not open", {}, "open them");
  capture_->type(line);
}

void Cameras::ended(const std::string& sentence) {
  std::string refused;
  {
    const std::lock_guard lock(mutex_);
    ready_ = false;
    refused = std::exchange(taking_, "");
  }
  if (!refused.empty()) session_.tell("refused", {{"set", refused}, {"why", sentence}});
  heard("the cameras are closed: " + sentence);
  reports_.closed("the cameras are closed");
}

void Cameras::heard(const std::string& line) {
  std::string set = stored_in(line), refused, why;
  {
    const std::lock_guard lock(mutex_);
    const bool waits = line.starts_with("next: ");
    // Only a requested set, by a name from the rig.
    if (set != taking_) set.clear();
    if (waits && !taking_.empty()) {
      refused = std::exchange(taking_, "");
      if (!words_.empty()) why = words_.back();
    }
    words_.push_back(line);
    if (words_.size() > kKeptWords) words_.erase(words_.begin());
    ready_ = ready_ || waits;
  }
  if (!refused.empty()) {
    session_.tell("refused", {{"set", refused}, {"why", why}});
    const std::lock_guard lock(watch_mutex_);
    watch_->forget_last_set();
  }
  if (const auto turn = turn_of(line)) session_.tell("camera", *turn);
  try {
    if (!set.empty()) {
      session_.add("bench", line.substr(4), {{"taken", set}});
      {
        const std::lock_guard lock(mutex_);
        taking_.clear();
      }
      reports_.stored(set);
    } else if (!line.starts_with("next: ")) {
      session_.add("capture", line);
    }
  } catch (const Error& error) {
    session_.trouble(error.what());
  }
  session_.tell("state", Json::object());
}

Json Cameras::json() const {
  if (session_.options.replay) return {};
  Json json;
  {
    const std::lock_guard lock(capture_mutex_);
    json["runs"] = capture_ && capture_->runs();
    json["command"] = capture_ ? capture_->shown() : "";
  }
  const std::lock_guard lock(mutex_);
  json["ready"] = ready_;
  json["taking"] = taking_;
  json["automatic"] = automatic_;
  json["words"] = words_;
  json["doctor"] = session_.doctor();
  return json;
}

std::string Cameras::newest(const std::string& camera, std::uint64_t& number) const {
  const std::lock_guard lock(capture_mutex_);
  return capture_ ? capture_->picture(camera, number) : std::string();
}

std::optional<LivePicture> Cameras::picture(const std::string& camera, int width_px,
                                            bool mark_saturation) {
  static_cast<void>(session_.bench()->rig.camera(camera));
  const std::lock_guard lock(live_mutex_);
  std::uint64_t number = 0;
  const std::string bytes = newest(camera, number);
  if (bytes.empty()) return std::nullopt;
  LivePicture& kept = live_[camera];
  if (kept.number != number || kept.width_px != width_px || kept.mark_saturation != mark_saturation)
    kept = {number, width_px, mark_saturation,
            make_picture(bytes_of(bytes), width_px, mark_saturation).jpeg, comment_of(bytes)};
  return kept;
}

std::shared_ptr<const Detections> Cameras::marks(Surface surface) {
  return live_marks_ ? live_marks_->look(surface) : nullptr;
}

/// Processes a new picture of a live camera.
void Cameras::look(const std::string& camera) {
  bool takes = reports_.idle();
  {
    const std::lock_guard lock(mutex_);
    takes = takes && automatic_ && ready_ && taking_.empty();
  }
  {
    const std::lock_guard lock(watch_mutex_);
    if (!takes && now_s() - still_asked_s_ > kAskedFor_s) return;
  }
  std::uint64_t number = 0;
  const std::string bytes = newest(camera, number);
  {
    const std::lock_guard lock(watch_mutex_);
    if (bytes.empty()) return;
    watch_->see(camera, bytes_of(bytes), now_s());
    if (!takes || !watch_->is_due(now_s())) return;
  }
  try {
    reports_.still();
  } catch (const Error& error) {
    session_.trouble(error.what());
  }
}

Json Cameras::still_json() {
  Json json = Json::object();
  const std::lock_guard lock(watch_mutex_);
  still_asked_s_ = now_s();
  if (watch_)
    for (const auto& [camera, still_s] : watch_->still_s(now_s()))
      json[camera] = std::round(10 * still_s) / 10;
  return json;
}

}  // namespace drape::console
