// SPDX-License-Identifier: Apache-2.0
// Free poses of the target without a key: a set when the board is held still in a new pose, a
// calibration after each set, the end when the coach's goal is reached.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "console/bench.hpp"
#include "core/error.hpp"

namespace drape::console {
namespace {

constexpr int kLeastViews = 2;
constexpr double kAskedFor_s = 3;  ///< a page that shows how still it is asks every second

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

/// A stage stands on its height, which nobody but the operator knows; so stages have a key.
std::string Bench::next_free_pose() const {
  for (const std::string& set : rig_.free_poses)
    if (!is_taken(set)) return set;
  return {};
}

void Bench::automatic(bool on) {
  if (options_.replay) throw bad_input("a recording has no cameras", {}, "reload the page");
  if (on && next_free_pose().empty())
    throw bad_input("the rig has no free pose that was not taken", {},
                    "add names to free_poses in rig.toml");
  log_.add(operator_name(), on ? "lets poses be taken by themselves" : "takes poses by key");
  const std::lock_guard lock(watch_mutex_);
  automatic_ = on;
  watch_->forget_last_set();
}

bool Bench::is_automatic() const {
  const std::lock_guard lock(watch_mutex_);
  return automatic_;
}

void Bench::end_automatic(const std::string& words, bool good) {
  {
    const std::lock_guard lock(watch_mutex_);
    if (!automatic_) return;
    automatic_ = false;
  }
  log_.add("bench", words);
  tell_("ended", {{"words", words}, {"good", good}});
}

/// A picture of a live camera is there.
void Bench::look(const std::string& camera) {
  bool takes = is_automatic() && jobs_.idle();
  {
    const std::lock_guard lock(mutex_);
    takes = takes && cameras_ready_ && taking_.empty();
  }
  {
    const std::lock_guard lock(watch_mutex_);
    if (!takes && now_s() - still_asked_s_ > kAskedFor_s) return;
  }
  std::string bytes;
  {
    const std::lock_guard open(capture_mutex_);
    std::uint64_t number = 0;
    if (capture_) bytes = capture_->picture(camera, number);
  }
  {
    const std::span<const unsigned char> pixels(
        reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
    const std::lock_guard lock(watch_mutex_);
    if (bytes.empty() || !watch_) return;
    watch_->see(camera, pixels, now_s());
    if (!takes || !watch_->is_due(now_s())) return;
  }
  try {
    const std::string set = next_free_pose();
    set.empty() ? end_automatic("every pose of the rig is taken", false) : take_live(set);
  } catch (const Error& error) {
    const std::lock_guard lock(mutex_);
    trouble_ = error.what();
  }
}

/// For how long nothing has moved in each camera's pictures; asks for more looks, for some seconds.
Json Bench::still_json() const {
  Json json = Json::object();
  const std::lock_guard lock(watch_mutex_);
  still_asked_s_ = now_s();
  if (!watch_) return json;
  for (const auto& [camera, still_s] : watch_->still_s(now_s()))
    json[camera] = std::round(10 * still_s) / 10;
  return json;
}

/// The marks of a set are measured.
void Bench::looked_at(const std::string& set) {
  if (!is_automatic()) return;
  const auto seen = detections(set);
  const auto views =
      !seen ? 0
            : std::count_if(seen->frames.begin(), seen->frames.end(),
                            [](const FrameDetections& one) { return !one.detections.empty(); });
  if (views < kLeastViews) {
    const std::string why = "fewer than two cameras see the target";
    log_.add("bench", fmt::format("left out {}: {}", set, why), {{"dropped", set}});
    {
      const std::lock_guard lock(mutex_);
      taken_[set] = false;
    }
    tell_("refused", {{"set", set}, {"why", why}});
    return;
  }
  if (can_calibrate())
    calibrate();
  else if (next_free_pose().empty())
    end_automatic("every pose of the rig is taken", false);
}

/// A calibration with the sets that were taken ended.
void Bench::calibrated() {
  if (!is_automatic()) return;
  if (coach().value("reached", false))
    end_automatic("The goal is reached: more poses change a measured point by less than 5 %", true);
  else if (next_free_pose().empty())
    end_automatic("every pose of the rig is taken", false);
}

}  // namespace drape::console
