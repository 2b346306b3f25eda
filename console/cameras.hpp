// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "console/files.hpp"
#include "console/session.hpp"
#include "console/tasks/capture_session.hpp"
#include "console/tasks/live_marks.hpp"
#include "console/tasks/still_watch.hpp"

namespace drape::console {

/// The newest picture of a live camera.
struct LivePicture {
  std::uint64_t number = 0;
  int width_px = 0;
  bool mark_saturation = false;
  std::string jpeg, facts;  ///< facts: ASCII JSON as written by `drape capture --preview`
};

/// The live cameras: the resident capture session and its messages, stillness, and marks in their
/// pictures. Thread-safe.
class Cameras {
 public:
  struct Reports {
    std::function<void(const std::string& set)> stored;
    std::function<void()> still;  ///< the target is held still in a new pose, and no job runs
    std::function<bool()> idle;   ///< true if no job runs
    std::function<void(const std::string& words)> closed;
  };
  Cameras(Session& session, const Files& files, Reports reports);

  void open();  ///< throws Error(bad_input) while they are open
  void close();
  void shut();  ///< called before the objects to which they report are destroyed
  void take(const std::string& set);
  void undo(const std::string& set);  ///< restores the previous take of a set
  /// Sets exposure or gain until the cameras are closed; the value in use comes with the pictures.
  void light(const std::string& camera, const std::string& name, double value);
  [[nodiscard]] bool runs() const;
  [[nodiscard]] std::string taking() const;  ///< set that the capture is taking
  [[nodiscard]] bool automatic() const;
  void automatic(bool on);
  [[nodiscard]] Json json() const;
  /// nullopt before the camera's first picture.
  [[nodiscard]] std::optional<LivePicture> picture(const std::string& camera, int width_px,
                                                   bool mark_saturation);
  [[nodiscard]] std::shared_ptr<const Detections> marks(Surface surface);
  /// Time without motion in each camera's pictures; keeps watching for some
  /// seconds.
  [[nodiscard]] Json still_json();

 private:
  void heard(const std::string& line);
  void ended(const std::string& sentence);
  void look(const std::string& camera);
  void type(const std::string& set, const std::string& line);
  void require_open() const;
  [[nodiscard]] std::string newest(const std::string& camera, std::uint64_t& number) const;

  Session& session_;
  const Files& files_;
  const Reports reports_;
  mutable std::mutex mutex_;  ///< guards the next four members
  std::string taking_;
  std::vector<std::string> words_;  ///< last lines printed by the capture
  bool ready_ = false, automatic_ = false;
  std::mutex watch_mutex_;  ///< guards the next two members
  std::optional<StillWatch> watch_;
  double still_asked_s_ = -1e9;  ///< time of the last request for stillness
  std::mutex live_mutex_;        ///< lets many pages share one scaling
  std::map<std::string, LivePicture> live_;
  mutable std::mutex capture_mutex_;
  std::unique_ptr<CaptureSession> capture_;
  std::unique_ptr<LiveMarks> live_marks_;
};

/// Text of the rig's file with paths relative to this folder.
[[nodiscard]] std::string text_in(const std::filesystem::path& folder, Rig rig);

/// Text of the part of a rig used by detect, for a file in this folder; contains only the cameras
/// with given sizes in px, if any are given.
[[nodiscard]] std::string detect_rig_text(
    const BenchFiles& bench, const std::filesystem::path& folder,
    const std::map<std::string, std::pair<int, int>>& px = {});

}  // namespace drape::console
