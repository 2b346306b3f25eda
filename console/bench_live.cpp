// SPDX-License-Identifier: Apache-2.0
// Live cameras: the resident capture session and what it says.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "console/bench.hpp"
#include "core/error.hpp"

namespace drape::console {
namespace {

constexpr std::size_t kKeptWords = 12;
constexpr double kLargestLight = 1e9;  ///< us

/// X of "GO: X stored".
std::string stored_in(const std::string& line) {
  const std::string begin = "GO: ", end = " stored";
  if (!line.starts_with(begin) || !line.ends_with(end)) return {};
  return line.substr(begin.size(), line.size() - begin.size() - end.size());
}

/// Camera that was lost or is back.
struct Turn {
  std::string camera;
  bool back = false;
};
std::optional<Turn> turn_of(const std::string& line) {
  const std::string begin = "camera `";
  const std::size_t end = line.find("`: ");
  if (!line.starts_with(begin) || end == std::string::npos) return std::nullopt;
  return Turn{line.substr(begin.size(), end - begin.size()),
              line.find("`: it sends frames again") == end};
}

/// Comment of a PGM file: its second line, without the mark.
std::string comment_of(const std::string& pgm) {
  const std::string begin = "P5\n# ";
  if (!pgm.starts_with(begin)) return "{}";
  return pgm.substr(begin.size(), pgm.find('\n', begin.size()) - begin.size());
}

}  // namespace

/// Ends the session; stored sets are part of the recording.
void Bench::close_cameras() {
  std::unique_ptr<CaptureSession> closing;
  {
    const std::lock_guard lock(capture_mutex_);
    if (!capture_ || !capture_->runs()) throw bad_input("the cameras are closed", {}, "open them");
    closing = std::move(capture_);
  }
  log_.add(operator_name(), "closes the cameras");
}

/// It opens the cameras itself.
void Bench::ask_doctor() {
  if (options_.replay) throw bad_input("a recording has no cameras", {}, "reload the page");
  {
    const std::lock_guard lock(capture_mutex_);
    if (capture_ && capture_->runs())
      throw bad_input("the cameras are open", {}, "close them, then ask the doctor");
  }
  Call call{{"doctor", rig_.file.string(), "--out", out_.string()}};
  if (calibration())
    call.words.insert(call.words.end(), {"--calibration", calibration_file().string()});
  ask("asks the doctor", "doctor", "the cameras", {std::move(call)});
}

void Bench::open_cameras() {
  if (options_.replay) throw bad_input("a recording has no cameras", {}, "reload the page");
  const std::lock_guard lock(capture_mutex_);
  if (capture_ && capture_->runs()) throw bad_input("the cameras are open", {}, "take a set");
  for (const Job& job : jobs_.list())
    if (job.kind == "doctor" && job.state == JobState::running)
      throw bad_input("the doctor looks at the cameras", {}, "wait for it");
  log_.add(operator_name(), "opens the cameras");
  CaptureSession::Reports reports;
  reports.said = [this](const std::string& line) { heard(line); };
  reports.picture = [this](const std::string& camera, std::uint64_t number) {
    tell_("frame", {{"camera", camera}, {"number", number}});
    look(camera);
  };
  reports.ended = [this](const std::string& sentence) {
    std::string refused;
    {
      const std::lock_guard words(mutex_);
      cameras_ready_ = false;
      refused = std::exchange(taking_, "");
    }
    if (!refused.empty()) tell_("refused", {{"set", refused}, {"why", sentence}});
    heard("the cameras are closed: " + sentence);
    end_automatic("the cameras are closed", false);
  };
  capture_ = std::make_unique<CaptureSession>(rig_.file, recording_folder_, reports);
}

void Bench::take_live(const std::string& set) {
  const bool again = recorded_set(set) != nullptr;
  {
    const std::lock_guard lock(mutex_);
    if (!cameras_ready_)
      throw bad_input("the cameras are not ready", {}, "wait, or open them again");
    if (!taking_.empty()) throw bad_input("a set is being taken", {.set = taking_}, "wait for it");
    taking_ = set;
  }
  log_.add(operator_name(), fmt::format("pressed take {}", set));
  const std::lock_guard lock(capture_mutex_);
  try {
    if (!capture_) throw Error(ErrorKind::device, "the cameras are not open", {}, "open them");
    capture_->type(again ? "r " + set : set);
  } catch (const Error&) {
    const std::lock_guard words(mutex_);
    taking_.clear();
    throw;
  }
}

/// Exposure or gain of a camera, until the cameras are closed. What it has then comes with its
/// pictures.
void Bench::set_light(const Json& request) {
  if (options_.replay)
    throw bad_input("a recording is exposed already: exposure and gain can only be read", {},
                    "open the rig without --replay");
  const auto camera = request.find("camera");
  if (camera == request.end() || !camera->is_string())
    throw bad_input("the request lacks `camera`", {}, "reload the page");
  static_cast<void>(rig_.camera(camera->get<std::string>()));
  const std::string name = request.contains("gain_db") ? "gain_db" : "exposure_us";
  const auto value = request.find(name);
  if (value == request.end() || !value->is_number() || !(value->get<double>() >= 0) ||
      value->get<double>() > kLargestLight)
    throw bad_input("the request lacks a value", {.field = name}, "write a number");
  const std::string line =
      fmt::format("{} {} {}", name, value->get<double>(), camera->get<std::string>());
  {
    const std::lock_guard lock(mutex_);
    if (!cameras_ready_ || !taking_.empty())
      throw bad_input("the cameras are not ready", {}, "wait, or open them again");
  }
  log_.add(operator_name(), "pressed " + line);
  const std::lock_guard lock(capture_mutex_);
  if (!capture_) throw Error(ErrorKind::device, "the cameras are not open", {}, "open them");
  capture_->type(line);
}

void Bench::heard(const std::string& line) {
  std::string set = stored_in(line), refused, why;
  {
    const std::lock_guard lock(mutex_);
    if (line.starts_with("next: ") && !taking_.empty()) {
      refused = std::exchange(taking_, "");
      if (!camera_words_.empty()) why = camera_words_.back();
    }
    camera_words_.push_back(line);
    if (camera_words_.size() > kKeptWords) camera_words_.erase(camera_words_.begin());
    if (line.starts_with("next: ")) {
      cameras_ready_ = true;
    }
    // Only what was asked for, by a name that the rig has.
    if (set != taking_) set.clear();
  }
  if (!refused.empty()) {
    tell_("refused", {{"set", refused}, {"why", why}});
    const std::lock_guard lock(watch_mutex_);
    watch_->forget_last_set();
  }
  if (const auto turn = turn_of(line))
    tell_("camera", {{"camera", turn->camera}, {"back", turn->back}, {"words", line}});
  try {
    if (!set.empty()) {
      log_.add("bench", "stored " + set, {{"taken", set}});
      taken(set);
    } else if (!line.starts_with("next: ")) {
      log_.add("capture", line);
    }
  } catch (const Error& error) {
    const std::lock_guard lock(mutex_);
    trouble_ = error.what();
  }
  tell_("state", Json::object());
}

Json Bench::capture_json() const {
  if (options_.replay) return {};
  Json json;
  {
    const std::lock_guard lock(capture_mutex_);
    json["runs"] = capture_ && capture_->runs();
    json["command"] = capture_ ? capture_->shown() : "";
  }
  const std::lock_guard lock(mutex_);
  json["ready"] = cameras_ready_;
  json["taking"] = taking_;
  json["automatic"] = is_automatic();
  json["words"] = camera_words_;
  json["doctor"] = doctor_;
  return json;
}

std::map<std::string, std::string> Bench::newest_pictures() const {
  std::map<std::string, std::string> all;
  const std::lock_guard lock(capture_mutex_);
  for (const RigCamera& camera : rig_.cameras) {
    std::uint64_t number = 0;
    std::string bytes = capture_ ? capture_->picture(camera.name, number) : std::string();
    if (!bytes.empty()) all[camera.name] = std::move(bytes);
  }
  return all;
}

std::optional<Bench::LivePicture> Bench::live_picture(const std::string& camera, int width_px,
                                                      bool mark_saturation) const {
  static_cast<void>(rig_.camera(camera));
  const std::lock_guard lock(live_mutex_);
  std::string bytes;
  std::uint64_t number = 0;
  {
    const std::lock_guard open(capture_mutex_);
    if (capture_) bytes = capture_->picture(camera, number);
  }
  if (bytes.empty()) return std::nullopt;
  LivePicture& kept = live_[camera];
  if (kept.number != number || kept.width_px != width_px ||
      kept.mark_saturation != mark_saturation) {
    const std::span<const unsigned char> pixels(
        reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
    kept = {number, width_px, mark_saturation, make_picture(pixels, width_px, mark_saturation).jpeg,
            comment_of(bytes)};
  }
  return kept;
}

}  // namespace drape::console
