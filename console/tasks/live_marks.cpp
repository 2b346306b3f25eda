// SPDX-License-Identifier: Apache-2.0
#include "console/tasks/live_marks.hpp"

#include <signal.h>
#include <sys/resource.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/inside.hpp"
#include "core/recording.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;
constexpr std::chrono::seconds kAskedFor(3);             ///< an open page asks every second
constexpr std::chrono::milliseconds kPause(200);         ///< between two detections
constexpr std::chrono::milliseconds kPauseInVain(1000);  ///< after a detection without a picture
constexpr int kLowest = 19;

}  // namespace

LiveMarks::LiveMarks(Newest newest, RigOf rig_of)
    : newest_(std::move(newest)), rig_of_(std::move(rig_of)), thread_([this] { work(); }) {}

LiveMarks::~LiveMarks() {
  ending_ = true;
  wake_.notify_all();
  while (child_ > 0 && ::kill(child_, SIGKILL) != 0) std::this_thread::yield();
  thread_.join();
}

std::shared_ptr<const Detections> LiveMarks::look(Surface surface) {
  const std::lock_guard lock(mutex_);
  asked_ = steady_clock::now();
  surface_ = surface;
  wake_.notify_all();
  const auto found = found_.find(surface);
  return found == found_.end() ? nullptr : found->second;
}

void LiveMarks::work() {
  ::setpriority(PRIO_PROCESS, 0, kLowest);  // for this thread, and the programs it starts
  while (!ending_) {
    Surface surface = Surface::target;
    {
      std::unique_lock lock(mutex_);
      const auto is_asked = [this] { return ending_ || steady_clock::now() - asked_ < kAskedFor; };
      wake_.wait(lock, is_asked);
      surface = surface_;
    }
    std::shared_ptr<const Detections> seen;
    try {
      if (!ending_) seen = look_now(surface);
    } catch (const Error&) {
      // If a picture cannot be read now, the next one is used.
    }
    std::unique_lock lock(mutex_);
    found_[surface] = seen;
    wake_.wait_for(lock, seen ? kPause : kPauseInVain, [this] { return ending_.load(); });
  }
}

std::shared_ptr<const Detections> LiveMarks::look_now(Surface surface) {
  Recording recording{folder_.path() / "recording", "live pictures", {}, {}};
  FrameSet set{"live", {}};
  std::map<std::string, std::pair<int, int>> sizes;
  for (const auto& [camera, pgm] : newest_()) {
    const cv::Mat raw(1, static_cast<int>(pgm.size()), CV_8UC1, const_cast<char*>(pgm.data()));
    const cv::Mat image = cv::imdecode(raw, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
    if (image.empty()) return nullptr;
    std::vector<unsigned char> png;
    cv::imencode(".png", image, png, {cv::IMWRITE_PNG_COMPRESSION, 1});
    const std::string file = "live/" + camera + ".png";
    write_inside(recording.folder, file,
                 std::string_view(reinterpret_cast<const char*>(png.data()), png.size()),
                 {.camera = camera});
    set.frames.push_back({camera, file, sha256_of(png), image.cols, image.rows, {}});
    sizes[camera] = {image.cols, image.rows};
  }
  if (set.frames.empty()) return nullptr;
  recording.sets.push_back(set);
  write_recording(recording);
  write_durable(folder_.path() / "rig.toml", rig_of_(folder_.path(), sizes));
  const Call call{{"detect", recording.folder.string(), "--rig",
                   (folder_.path() / "rig.toml").string(), "--surface",
                   surface == Surface::target ? "target" : "cloth", "--sets", "live", "--out",
                   (folder_.path() / "marks.json").string(), "--threads", "1"}};
  const CallEnd end = run_call(
      call, [](double, const std::string&) {}, child_);
  if (end.exit_code > 1) return nullptr;
  return std::make_shared<const Detections>(read_detections(folder_.path() / "marks.json"));
}

}  // namespace drape::console
