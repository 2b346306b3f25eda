// SPDX-License-Identifier: Apache-2.0
// Drivers of all kinds of cameras, and the one that plays a recording: one frame a set, in order.
#include "capture/device/camera.hpp"

#include <algorithm>
#include <chrono>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "core/recording.hpp"

namespace drape::capture {

namespace {

class ReplayCamera final : public CameraDevice {
 public:
  ReplayCamera(Recording recording, std::string camera)
      : recording_(std::move(recording)), camera_(std::move(camera)) {
    for (const FrameSet& set : recording_.sets) static_cast<void>(frame_in(set));
  }

  [[nodiscard]] CameraIdentity identity() const override {
    return {"drapebench", "recording", camera_, recording_.folder.string(), ""};
  }

  [[nodiscard]] std::vector<SettingReadBack> configure(const CameraSettings& settings) override {
    if (settings.trigger != TriggerSource::free_run)
      throw device_error("a recording cannot be triggered", camera_,
                         "choose the sync method free_run");
    const RecordedFrame& first = frame_in(recording_.sets.front());
    SettingsWriter writer(camera_, settings);
    const auto as_recorded = [](double) {};
    writer.apply("width_px", SettingPort{as_recorded, [&] { return first.width_px; }});
    writer.apply("height_px", SettingPort{as_recorded, [&] { return first.height_px; }});
    const auto bytes = read_frame(recording_, recording_.sets.front(), first);
    deep_ = cv::imdecode(bytes, cv::IMREAD_UNCHANGED).depth() == CV_16U;
    bytes_ = static_cast<std::size_t>(first.width_px) * static_cast<std::size_t>(first.height_px) *
             (deep_ ? 2 : 1);
    writer.note("pixel_format", deep_ ? "Mono16" : "Mono8");
    return std::move(writer.read_back);
  }

  [[nodiscard]] std::vector<SettingReadBack> set_light(const CameraSettings&) override {
    throw device_error("a recording is exposed already", camera_, "record it again");
  }

  [[nodiscard]] FrameIdRange frame_ids() const override { return {0, 1'000'000'000}; }
  [[nodiscard]] std::size_t frame_bytes() const override { return bytes_; }
  void start() override { running_ = true; }
  void stop() override { running_ = false; }

  [[nodiscard]] std::optional<CameraFrame> next(double timeout_s) override {
    if (!running_ || next_ == recording_.sets.size()) {
      std::this_thread::sleep_for(std::chrono::duration<double>(timeout_s));
      return std::nullopt;
    }
    const FrameSet& set = recording_.sets[next_];
    const std::vector<unsigned char> bytes = read_frame(recording_, set, frame_in(set));
    image_ = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
    CameraFrame frame;
    frame.id = next_;  // the index of the set serves as its time
    frame.device_ns = static_cast<std::int64_t>(++next_) * 100'000'000;
    frame.complete = image_.type() == (deep_ ? CV_16UC1 : CV_8UC1) && image_.isContinuous();
    if (!frame.complete) frame.fault = "it is not grey, or of another depth than the first";
    frame.width_px = image_.cols;
    frame.height_px = image_.rows;
    frame.pixels = image_.data;
    frame.bytes = image_.total() * image_.elemSize();
    return frame;
  }

 private:
  [[nodiscard]] const RecordedFrame& frame_in(const FrameSet& set) const {
    for (const RecordedFrame& frame : set.frames)
      if (frame.camera == camera_) return frame;
    throw bad_input("the set has no image of this camera",
                    {.file = (recording_.folder / "recording.json").string(),
                     .camera = camera_,
                     .set = set.name},
                    "name a camera of the recording");
  }

  Recording recording_;
  std::string camera_;
  std::size_t next_ = 0, bytes_ = 0;
  bool running_ = false, deep_ = false;
  cv::Mat image_;
};

std::unique_ptr<CameraDevice> open_replay_camera(const CameraAddress& address) {
  return std::make_unique<ReplayCamera>(read_recording(address.recording), address.device);
}

void ask_size(FoundDevice& device) {
  const bool network = device.backend == Backend::aravis && !device.identity.address.empty();
  try {
    const auto camera =
        open_camera({device.backend, network ? device.identity.address : device.name, "", ""});
    const auto settings = camera->configure({});
    if (const auto px = setting_in(settings, "width_px")) device.width_px = std::stoi(*px);
    if (const auto px = setting_in(settings, "height_px")) device.height_px = std::stoi(*px);
    device.identity.host_address = camera->identity().host_address;
  } catch (const Error& error) {
    device.why_not_asked = error.what_failed();
  }
}

}  // namespace

extern const CameraDriver replay_driver{open_replay_camera, nullptr};

extern const CameraDriver aravis_driver, v4l2_driver, replay_driver;

/// Indexed by Backend.
static constexpr const CameraDriver* kDrivers[] = {&aravis_driver, &v4l2_driver, &replay_driver};

std::unique_ptr<CameraDevice> open_camera(const CameraAddress& address) {
  return kDrivers[static_cast<std::size_t>(address.backend)]->open(address);
}

std::vector<FoundDevice> find_devices(bool sizes) {
  std::vector<FoundDevice> found;
  for (std::size_t backend = 0; backend < std::size(kDrivers); ++backend) {
    if (kDrivers[backend]->find == nullptr) continue;
    for (FoundDevice& device : kDrivers[backend]->find()) {
      device.backend = static_cast<Backend>(backend);
      found.push_back(std::move(device));
    }
  }
  std::ranges::stable_sort(found, {}, &FoundDevice::name);
  if (sizes) std::ranges::for_each(found, ask_size);
  return found;
}

}  // namespace drape::capture
