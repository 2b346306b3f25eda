// SPDX-License-Identifier: Apache-2.0
// Tests the V4L2 backend with the kernel's test driver. Runs only inside the QEMU guest, started by
// tests/end_to_end/v4l2_guest_test.cpp.
#include <gmock/gmock.h>

#include <chrono>
#include <random>

#include "capture/device/camera.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/v4l2_guest/v4l2_guest.hpp"
#include "tests/support/v4l2_guest/vivid.hpp"

namespace drape::capture {

extern const CameraDriver v4l2_driver;

namespace {

using test::VividNode;
using testing::AnyOf;
using testing::HasSubstr;

constexpr const char* kNode = "/dev/video6";
constexpr int kWidth_px = 640, kHeight_px = 360;

CameraAddress webcam() {
  return {Backend::v4l2, test::guest_camera(3), "", ""};
}

CameraSettings settings(double rate_hz = 25) {
  CameraSettings s;
  s.width_px = kWidth_px;
  s.height_px = kHeight_px;
  s.frame_rate_hz = rate_hz;
  return s;
}

std::int64_t now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

/// Waits for the next frame, however slow the guest is; fails the test after 20 s.
CameraFrame frame_of(CameraDevice& camera) {
  for (int i = 0; i < 200; ++i)
    if (const auto frame = camera.next(0.1)) return *frame;
  ADD_FAILURE() << "no frame comes";
  return {};
}

/// Message of a call that is refused; fails the test if it is not.
template <class Call>
std::string refusal(Call call) {
  const Error error = test::error_of(call);
  EXPECT_EQ(error.kind(), ErrorKind::device);
  EXPECT_FALSE(error.what_to_do().empty());
  return error.what();
}

/// A configured webcam. Its fault controls are opened only briefly, because a disconnected camera
/// returns once nobody holds it open.
class V4l2Camera : public testing::Test {
 protected:
  void SetUp() override {
    camera_ = open_camera(webcam());
    read_back_ = camera_->configure(settings());
  }
  std::unique_ptr<CameraDevice> camera_;
  std::vector<SettingReadBack> read_back_;
};

TEST(V4l2Devices, AreFoundByBusPath) {
  const auto found = v4l2_driver.find();
  ASSERT_EQ(found.size(), 5U);  // the fifth has several planes
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(found[static_cast<std::size_t>(i)].name, test::guest_camera(i));
    EXPECT_EQ(found[static_cast<std::size_t>(i)].identity.vendor, "vivid");
  }
  EXPECT_THAT(refusal([] {
                static_cast<void>(open_camera({Backend::v4l2, "usb-9", "", ""}));
              }),
              HasSubstr(test::guest_camera(2)));
}

TEST_F(V4l2Camera, StreamsAndCountsOnTheHostsClock) {
  EXPECT_EQ(setting_in(read_back_, "GainAuto"), "Off");
  EXPECT_EQ(setting_in(read_back_, "frame_rate_hz"), "25");
  EXPECT_EQ(VividNode(kNode).get("Gain, Automatic"), 0);
  const std::int64_t before = now_ns();
  camera_->start();
  std::optional<CameraFrame> last;
  for (int i = 0; i < 5; ++i) {
    const CameraFrame frame = frame_of(*camera_);
    ASSERT_TRUE(frame.complete) << frame.fault;
    EXPECT_EQ(frame.bytes, std::size_t{kWidth_px} * kHeight_px);
    ASSERT_TRUE(frame.device_ns);
    EXPECT_GT(*frame.device_ns, before);
    // This driver stamps the nominal end of the frame, which may be a period ahead.
    EXPECT_LT(*frame.device_ns, now_ns() + 500'000'000);
    if (last) {
      EXPECT_GT(frame.id, last->id);
      EXPECT_GT(*frame.device_ns, *last->device_ns);
    }
    last = frame;
  }
}

TEST_F(V4l2Camera, RefusesWhatTheDriverDoesNotTake) {
  CameraSettings s = settings();
  s.width_px = 650;
  EXPECT_THAT(refusal([&] { static_cast<void>(camera_->configure(s)); }),
              HasSubstr("took width_px"));
  EXPECT_THAT(refusal([&] { static_cast<void>(camera_->configure(settings(33))); }),
              HasSubstr("took frame_rate_hz"));
  s = settings();
  s.trigger = TriggerSource::software;
  EXPECT_THAT(refusal([&] { static_cast<void>(camera_->configure(s)); }), HasSubstr("no trigger"));
  s = settings();
  s.exposure_us = 100;  // this driver has no exposure control
  EXPECT_THAT(refusal([&] { static_cast<void>(camera_->configure(s)); }), HasSubstr("exposure_us"));
}

/// This driver has a gain control but no exposure control.
TEST_F(V4l2Camera, GainIsSetWhileItStreamsAndReadBack) {
  EXPECT_EQ(setting_in(read_back_, "gain_camera_units"),
            std::to_string(VividNode(kNode).get("Gain")))
      << "nobody asked for one";
  EXPECT_EQ(setting_in(read_back_, "exposure_us"), std::nullopt);
  camera_->start();
  CameraSettings light;
  light.gain_db = 40;
  EXPECT_EQ(setting_in(camera_->set_light(light), "gain_camera_units"), "40");
  EXPECT_EQ(VividNode(kNode).get("Gain"), 40);
  EXPECT_TRUE(frame_of(*camera_).complete);
  light.gain_db = 300;  // the largest gain is 255
  EXPECT_THAT(refusal([&] { static_cast<void>(camera_->set_light(light)); }),
              HasSubstr("gain_camera_units"));
  EXPECT_TRUE(frame_of(*camera_).complete);
}

TEST_F(V4l2Camera, ASecondProgramIsRefused) {
  camera_->start();
  static_cast<void>(frame_of(*camera_));
  const auto second = open_camera(webcam());
  EXPECT_THAT(refusal([&] {
                static_cast<void>(second->configure(settings()));
                second->start();
              }),
              HasSubstr("busy"));
}

TEST_F(V4l2Camera, DroppedBuffersAreGapsInTheFrameIds) {
  VividNode(kNode).set("Percentage of Dropped Buffers", 50);
  camera_->start();
  const std::uint64_t first = frame_of(*camera_).id;
  std::uint64_t last = first;
  std::uint64_t received = 1;
  for (; received < 25; ++received) last = frame_of(*camera_).id;
  VividNode(kNode).set("Percentage of Dropped Buffers", 0);
  EXPECT_GT(last - first + 1, received);  // probability 0.5^24 that no frame was dropped
}

TEST_F(V4l2Camera, AFaultyBufferIsNeverWhole) {
  camera_->start();
  static_cast<void>(frame_of(*camera_));
  VividNode(kNode).set("Inject V4L2_BUF_FLAG_ERROR");
  int faulty = 0;
  for (int i = 0; i < 20 && faulty == 0; ++i) {
    const CameraFrame frame = frame_of(*camera_);
    if (frame.complete) continue;
    ++faulty;
    EXPECT_THAT(frame.fault, HasSubstr("marked it as faulty"));
  }
  EXPECT_EQ(faulty, 1);
  EXPECT_TRUE(frame_of(*camera_).complete);
}

TEST_F(V4l2Camera, RefusedBuffersAndStreamsAreNamedAndTheNextTryWorks) {
  for (const auto& [control, words] :
       {std::pair{"Inject VIDIOC_REQBUFS Error", "asking for buffers"},
        {"Inject VIDIOC_QBUF Error", "queueing a buffer"},
        {"Inject VIDIOC_STREAMON Error", "starting the stream"}}) {
    VividNode(kNode).set(control);
    EXPECT_THAT(refusal([&] { camera_->start(); }), HasSubstr(words)) << control;
    camera_ = open_camera(webcam());
    static_cast<void>(camera_->configure(settings()));
    camera_->start();
    EXPECT_TRUE(frame_of(*camera_).complete) << control;
    camera_->stop();
  }
}

TEST_F(V4l2Camera, AFatalErrorAndADisconnectEndTheStreamAndOpeningAgainWorks) {
  for (const std::string control : {"Inject Fatal Streaming Error", "Disconnect"}) {
    camera_->start();
    static_cast<void>(frame_of(*camera_));
    VividNode(kNode).set(control);
    EXPECT_THAT(refusal([&] {
                  for (int i = 0; i < 200; ++i) static_cast<void>(camera_->next(0.1));
                }),
                AnyOf(HasSubstr("broke off"), HasSubstr("queued again"), HasSubstr("be fetched")))
        << control;
    camera_.reset();
    camera_ = open_camera(webcam());
    static_cast<void>(camera_->configure(settings()));
    camera_->start();
    EXPECT_TRUE(frame_of(*camera_).complete);
    camera_->stop();
  }
}

TEST_F(V4l2Camera, TheFrameIdWraps) {
  static_cast<void>(camera_->configure(settings(40)));
  VividNode(kNode).set("Wrap Sequence Number");
  camera_->start();
  FrameIdUnwrapper ids(camera_->frame_ids());
  std::int64_t last = -1;
  bool wrapped = false;
  for (int i = 0; i < 400 && !wrapped; ++i) {
    const CameraFrame frame = frame_of(*camera_);
    const auto index = ids.unwrap(frame.id);
    ASSERT_TRUE(index);
    ASSERT_GE(*index, last);  // a late driver repeats a frame
    wrapped = last >= 0 && frame.id < 1000;
    last = *index;
  }
  VividNode(kNode).set("Wrap Sequence Number", 0);
  EXPECT_TRUE(wrapped);
}

struct Loop {
  int camera;  ///< number in vivid
  const char *capture, *output;
};

void PrintTo(const Loop& loop, std::ostream* out) {
  *out << loop.capture;
}

class V4l2Formats : public testing::TestWithParam<Loop> {};

/// Sends random bytes to an output of the driver and captures them back, single-planar and
/// multi-planar, in every format that both drapebench and the driver support.
TEST_P(V4l2Formats, EachIsBitExactThroughTheDriver) {
  constexpr int width_px = 1600, height_px = 1200;
  std::mt19937 random(5);
  for (const char* name : {"GREY", "Y10", "Y12", "Y16", "YUYV", "UYVY", "NV12", "RGGB", "RGB3"}) {
    SCOPED_TRACE(name);
    const PixelFormat& format = *find_pixel_format(name);
    std::vector<std::uint8_t> sent(format.frame_bytes(format.row_bytes(width_px), height_px));
    for (std::uint8_t& byte : sent) byte = static_cast<std::uint8_t>(random());
    if (format.bits > 8 && format.bits < 16)
      for (std::size_t i = 1; i < sent.size(); i += 2)
        sent[i] = static_cast<std::uint8_t>(sent[i] & ((1 << (format.bits - 8)) - 1));
    VividNode capture(GetParam().capture), output(GetParam().output);
    capture.set("Loop Video");
    capture.set("OSD Text Mode", 2);
    output.set_signal(width_px, height_px, 36'250'000);
    output.set_output_format(width_px, height_px, format.code);
    capture.set_signal(width_px, height_px, 36'250'000);
    output.show(sent);
    const auto camera = open_camera({Backend::v4l2, test::guest_camera(GetParam().camera), "", ""});
    CameraSettings s;
    s.width_px = width_px;
    s.height_px = height_px;
    s.pixel_format = name;
    EXPECT_EQ(setting_in(camera->configure(s), "pixel_format"), name);
    const auto expected = unpack(format, sent, width_px, height_px).values;
    camera->start();
    bool same = false;
    for (int i = 0; i < 20 && !same; ++i) {  // the first frames can be older
      const CameraFrame frame = frame_of(*camera);
      if (!frame.complete) continue;
      same = unpack(format, {frame.pixels, frame.bytes}, width_px, height_px, frame.stride_bytes)
                 .values == expected;
    }
    EXPECT_TRUE(same);
    std::printf("%s through %s: %s\n", name, GetParam().capture, same ? "bit-exact" : "differs");
  }
}

INSTANTIATE_TEST_SUITE_P(Planes, V4l2Formats,
                         testing::Values(Loop{0, "/dev/video0", "/dev/video1"},
                                         Loop{4, "/dev/video7", "/dev/video8"}),
                         [](const auto& p) { return p.param.camera == 0 ? "Single" : "Multi"; });

}  // namespace
}  // namespace drape::capture
