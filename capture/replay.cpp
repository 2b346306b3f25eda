// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "capture/capture.hpp"
#include "core/error.hpp"

namespace drape::capture {
namespace {

class ReplaySource final : public FrameSource {
 public:
  explicit ReplaySource(Recording recording) : recording_(std::move(recording)) {
    for (const RecordedFrame& frame : recording_.sets.front().frames) {
      cameras_.push_back(frame.camera);
    }
    for (const FrameSet& set : recording_.sets) require_all_cameras(set);
  }

  [[nodiscard]] const std::vector<std::string>& cameras() const override { return cameras_; }

  [[nodiscard]] std::optional<SourceSet> next() override {
    if (next_ == recording_.sets.size()) return std::nullopt;
    const FrameSet& set = recording_.sets[next_++];
    SourceSet result{set.name, {}};
    for (const RecordedFrame& frame : set.frames) {
      result.frames.push_back({frame.camera, read_frame(recording_, set, frame), frame.sha256,
                               frame.width_px, frame.height_px, frame.device_time_s});
    }
    return result;
  }

 private:
  void require_all_cameras(const FrameSet& set) const {
    const auto same = [](const RecordedFrame& frame, const std::string& camera) {
      return frame.camera == camera;
    };
    if (std::equal(set.frames.begin(), set.frames.end(), cameras_.begin(), cameras_.end(), same)) {
      return;
    }
    throw bad_input("the set does not list the same cameras as the first set",
                    {.file = (recording_.folder / "recording.json").string(),
                     .field = "/sets",
                     .set = set.name},
                    "record or import the images anew");
  }

  Recording recording_;
  std::vector<std::string> cameras_;
  std::size_t next_ = 0;
};

}  // namespace

std::unique_ptr<FrameSource> open_replay(const std::filesystem::path& recording_folder) {
  return std::make_unique<ReplaySource>(read_recording(recording_folder));
}

}  // namespace drape::capture
