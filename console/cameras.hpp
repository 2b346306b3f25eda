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
  std::string jpeg, facts;  ///< facts: JSON in ASCII, as `drape capture --preview` writes them
};

/// The live cameras: the resident capture session and what it says, stillness, marks of what they
/// see. Safe from several threads.
class Cameras {
 public:
  struct Reports {
    std::function<void(const std::string& set)> stored;
    std::function<void()> still;  ///< the target is held still in a new pose, and nothing runs
    std::function<bool()> idle;   ///< no job runs
    std::function<void(const std::string& words)> closed;
  };
  Cameras(Session& session, const Files& files, Reports reports);

  void open();  ///< throws Error(bad_input) while they are open
  void close();
  void shut();  ///< before what they report to goes
  void take(const std::string& set);
  void undo(const std::string& set);  ///< the take before is the set again
  /// Exposure or gain, until the cameras are closed. What it has then comes with its pictures.
  void light(const std::string& camera, const std::string& name, double value);
  [[nodiscard]] bool runs() const;
  [[nodiscard]] std::string taking() const;  ///< set that the capture was asked for
  [[nodiscard]] bool automatic() const;
  void automatic(bool on);
  [[nodiscard]] Json json() const;
  /// Nothing before the camera's first picture.
  [[nodiscard]] std::optional<LivePicture> picture(const std::string& camera, int width_px,
                                                   bool mark_saturation);
  [[nodiscard]] std::shared_ptr<const Detections> marks(Surface surface);
  /// For how long nothing has moved in each camera's pictures; asks for more looks, for some
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
  mutable std::mutex mutex_;  ///< guards the next four
  std::string taking_;
  std::vector<std::string> words_;  ///< last lines of the capture
  bool ready_ = false, automatic_ = false;
  std::mutex watch_mutex_;  ///< guards the next two
  std::optional<StillWatch> watch_;
  double still_asked_s_ = -1e9;  ///< when a page asked last how still it is
  std::mutex live_mutex_;        ///< so that many pages cost one scaling
  std::map<std::string, LivePicture> live_;
  mutable std::mutex capture_mutex_;
  std::unique_ptr<CaptureSession> capture_;
  std::unique_ptr<LiveMarks> live_marks_;
};

/// The rig's file as it stands in this folder.
[[nodiscard]] std::string text_in(const std::filesystem::path& folder, Rig rig);

/// Text of the part of a rig that detect alone reads, for a file in this folder; of the cameras
/// with these sizes in px, where there are some.
[[nodiscard]] std::string detect_rig_text(
    const BenchFiles& bench, const std::filesystem::path& folder,
    const std::map<std::string, std::pair<int, int>>& px = {});

}  // namespace drape::console
