// SPDX-License-Identifier: Apache-2.0
// Tests the Aravis backend with the emulated camera: real discovery, control and stream packets.
#include <gmock/gmock.h>
#include <cstring>
#include <tuple>

#include "capture/device/camera.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/gige_camera/gige_camera.hpp"
#include "tests/support/gige_camera/private_network.hpp"
#include "tests/support/trials.hpp"

namespace drape::capture {

extern const CameraDriver aravis_driver;

namespace {

using test::GigeCamera;
using test::GigeCameraOptions;
using testing::HasSubstr;

using AravisCamera = test::CameraTest;

std::vector<std::uint8_t> noise(int width_px, int height_px, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width_px) * height_px);
  for (std::uint8_t& p : pixels) p = static_cast<std::uint8_t>(random());
  return pixels;
}

CameraAddress at(const std::string& ip, const std::string& host = "127.0.0.1") {
  return {Backend::aravis, ip, host, ""};
}

struct Tally {
  int complete = 0, incomplete = 0, altered = 0;
  CameraCounters counters;
};

/// Triggers `frames` frames one after another and compares every pixel.
Tally stream(CameraDevice& camera, const std::vector<std::uint8_t>& pixels, int frames) {
  Tally tally;
  camera.start();
  for (int i = 0; i < frames; ++i) {
    camera.trigger();
    const auto frame = camera.next(1.0);
    if (!frame) continue;
    if (!frame->complete) {
      ++tally.incomplete;
    } else if (frame->bytes != pixels.size() ||
               std::memcmp(frame->pixels, pixels.data(), pixels.size()) != 0) {
      ++tally.altered;
    } else {
      ++tally.complete;
    }
  }
  tally.counters = camera.counters();
  camera.stop();
  return tally;
}

CameraSettings triggered(int packet_size_bytes) {
  CameraSettings settings;
  settings.trigger = TriggerSource::software;
  settings.packet_size_bytes = packet_size_bytes;
  return settings;
}

TEST_F(AravisCamera, IsFoundBySerialAndGivesThePictureBitForBit) {
  GigeCamera left({.address = "127.0.0.2", .serial = "LEFT"});
  GigeCamera right({.address = "127.0.0.3", .serial = "RIGHT"});
  const auto pixels = noise(640, 480, 1);
  right.show(pixels);
  const auto found = aravis_driver.find();
  ASSERT_EQ(found.size(), 2U);
  const auto camera = open_camera(at("RIGHT", ""));
  EXPECT_EQ(camera->identity().serial, "RIGHT");
  EXPECT_EQ(camera->identity().address, "127.0.0.3");
  EXPECT_EQ(camera->identity().host_address, "127.0.0.1");
  const auto settings = camera->configure({});
  EXPECT_EQ(setting_in(settings, "pixel_format"), "Mono8");
  camera->start();
  for (int i = 0; i < 3; ++i) {
    const auto frame = camera->next(1.0);
    ASSERT_TRUE(frame);
    ASSERT_TRUE(frame->complete) << frame->fault;
    EXPECT_EQ(frame->id, static_cast<std::uint64_t>(i + 1));
    EXPECT_EQ(std::memcmp(frame->pixels, pixels.data(), pixels.size()), 0);
  }
}

TEST_F(AravisCamera, SettingsAreWrittenAndReadBackAndAutomaticsAreOff) {
  GigeCamera device({});
  const auto camera = open_camera(at("127.0.0.2"));
  CameraSettings s = triggered(8192);
  s.width_px = 320;
  s.height_px = 200;
  s.offset_x_px = 64;
  s.offset_y_px = 32;
  s.exposure_us = 4000;
  s.gain_db = 3;
  const auto settings = camera->configure(s);
  EXPECT_EQ(setting_in(settings, "ExposureAuto"), "Off");
  EXPECT_EQ(setting_in(settings, "GainAuto"), "Off");
  EXPECT_EQ(setting_in(settings, "exposure_us"), "4000");
  EXPECT_EQ(setting_in(settings, "offset_x_px"), "64");
  EXPECT_EQ(setting_in(settings, "packet_size_bytes"), "8192");
  EXPECT_EQ(setting_in(settings, "trigger"), "Software");
  EXPECT_EQ(device.register_word(test::reg::exposure_auto), 0U);
  EXPECT_EQ(device.register_word(test::reg::width), 320U);
  EXPECT_EQ(device.register_real(test::reg::exposure_us), 4000);
  EXPECT_EQ(camera->frame_bytes(), 320U * 200U);
}

/// The emulator refuses what a camera refuses: a region that with the old offset leaves the sensor,
/// and an exposure time while exposure is automatic.
TEST_F(AravisCamera, SettingsGoInTheOrderTheyDependOnEachOther) {
  GigeCamera device({});
  const auto camera = open_camera(at("127.0.0.2"));
  for (const auto& [width_px, height_px, offset_px] : {std::tuple{128, 96, 300}, {640, 480, 0}}) {
    CameraSettings s = triggered(8192);
    s.width_px = width_px;
    s.height_px = height_px;
    s.offset_x_px = s.offset_y_px = offset_px;
    s.exposure_us = 3000;
    s.gain_db = 2;
    EXPECT_EQ(setting_in(camera->configure(s), "offset_y_px"), std::to_string(offset_px));
    EXPECT_EQ(device.register_word(test::reg::width), static_cast<std::uint32_t>(width_px));
    EXPECT_EQ(device.register_real(test::reg::gain_db), 2);
  }
}

TEST_F(AravisCamera, AValueThatTheCameraChangesByItselfIsNamed) {
  GigeCamera device({.exposure_step_us = 500});
  const auto camera = open_camera(at("127.0.0.2"));
  CameraSettings s;
  s.exposure_us = 1300;
  const Error error = test::error_of([&] { return camera->configure(s); });
  EXPECT_THAT(error.what(), HasSubstr("took exposure_us 1000 instead of 1300"));
  EXPECT_FALSE(error.what_to_do().empty());
}

TEST_F(AravisCamera, RefusesWhatIsNotThereOrNotTakenOrNotOurs) {
  GigeCamera device({});
  const Error error = test::error_of([&] { return open_camera(at("NOBODY", "")); });
  EXPECT_EQ(error.kind(), ErrorKind::device);
  EXPECT_THAT(error.what(), HasSubstr("DB0001"));
  const auto first = open_camera(at("127.0.0.2"));
  const auto refused = [&](const CameraSettings& s) -> std::string {
    return test::error_of([&] { return first->configure(s); }).what();
  };
  CameraSettings s;
  s.width_px = 10'000;
  EXPECT_THAT(refused(s), HasSubstr("setting Width to 10000 failed"));
  s = {};
  s.pixel_format = "Mono12";
  EXPECT_THAT(refused(s), HasSubstr("the camera has no pixel format Mono12"));
}

/// Message of the refusal to open the camera.
std::string refusal(const CameraAddress& address) {
  const Error error = test::error_of([&] { return open_camera(address); });
  EXPECT_FALSE(error.what_to_do().empty());
  return error.what();
}

TEST_F(AravisCamera, ASecondControllerAndAWrongNetworkCardAreNamed) {
  GigeCamera device({});
  EXPECT_THAT(refusal(at("DB0001", "192.0.2.7")),
              HasSubstr("the camera is reached by 127.0.0.1, not by 192.0.2.7"));
  EXPECT_THAT(refusal(at("127.0.0.2", "192.0.2.7")),
              HasSubstr("no network card of this machine has the address 192.0.2.7"));
  const auto first = open_camera(at("127.0.0.2"));
  EXPECT_THAT(refusal(at("127.0.0.2")), HasSubstr("another program controls the camera"));
}

TEST_F(AravisCamera, LostPacketsAreSentAgainAndCountedExactly) {
  const int frames = test::trial_count(30, 3400);
  for (const double loss : {0.001, 0.01, 0.05}) {
    GigeCamera device({.width_px = 320, .height_px = 240, .seed = 7});
    const auto pixels = noise(320, 240, 2);
    device.show(pixels);
    const auto camera = open_camera(at("127.0.0.2"));
    static_cast<void>(camera->configure(triggered(1400)));
    device.set_faults({.lose = loss});
    const Tally tally = stream(*camera, pixels, frames);
    const auto sent = device.counts();
    EXPECT_EQ(tally.altered, 0);
    EXPECT_EQ(tally.complete, frames) << "of " << frames << " at loss " << loss;
    EXPECT_EQ(sent.frames_sent, static_cast<std::uint64_t>(frames));
    // On a busy machine packets that are merely late are requested again too; lost ones always.
    const auto counted = static_cast<std::uint64_t>(tally.counters.packets_resent);
    EXPECT_GE(sent.packets_resent, sent.packets_lost);
    if (sent.packets_resent == sent.packets_lost) {
      EXPECT_EQ(counted, sent.packets_resent);
    }
    std::printf("loss %.1f %%: %d of %d frames whole, packets sent %lu, lost %lu, resent %lu\n",
                100 * loss, tally.complete, frames, sent.packets_sent, sent.packets_lost,
                sent.packets_resent);
  }
}

TEST_F(AravisCamera, ReorderedRepeatedAndLatePacketsChangeNothing) {
  GigeCamera device({.width_px = 320, .height_px = 240});
  const auto pixels = noise(320, 240, 3);
  device.show(pixels);
  const auto camera = open_camera(at("127.0.0.2"));
  static_cast<void>(camera->configure(triggered(1400)));
  device.set_faults({.duplicate = 0.05, .reorder = 0.1, .late_ms = 5});
  const Tally tally = stream(*camera, pixels, 30);
  EXPECT_EQ(tally.complete, 30);
  EXPECT_GT(device.counts().packets_reordered, 0U);
  EXPECT_GT(device.counts().packets_duplicated, 0U);
}

TEST_F(AravisCamera, AFrameThatStaysIncompleteIsNeverPassedOffAsWhole) {
  GigeCamera device({.width_px = 320, .height_px = 240, .resend = false});
  const auto pixels = noise(320, 240, 4);
  device.show(pixels);
  const auto camera = open_camera(at("127.0.0.2"));
  static_cast<void>(camera->configure(triggered(1400)));
  device.set_faults({.lose = 0.02});
  const Tally tally = stream(*camera, pixels, 10);
  EXPECT_EQ(tally.altered, 0);
  EXPECT_LT(tally.complete, 10);
  EXPECT_GT(tally.incomplete, 0);
}

TEST_F(AravisCamera, TheFrameIdWraps) {
  GigeCamera device({.width_px = 64, .height_px = 48, .first_frame_id = 65533});
  const auto camera = open_camera(at("127.0.0.2"));
  static_cast<void>(camera->configure(triggered(1400)));
  camera->start();
  FrameIdUnwrapper ids(camera->frame_ids());
  for (std::int64_t i = 0; i < 8; ++i) {
    camera->trigger();
    const auto frame = camera->next(1.0);
    ASSERT_TRUE(frame);
    EXPECT_EQ(ids.unwrap(frame->id), i);
  }
}

TEST_F(AravisCamera, TheClockIsFoundToHalfAMillisecond) {
  GigeCamera device(
      {.width_px = 64, .height_px = 48, .clock_offset_s = -7.5, .clock_drift_ppm = 80});
  const auto camera = open_camera(at("127.0.0.2"));
  static_cast<void>(camera->configure(triggered(1400)));
  std::vector<ClockSample> samples;
  samples.reserve(10);
  for (int i = 0; i < 10; ++i) samples.push_back(camera->read_clock().value());
  const auto clock = fit_clock(samples);
  ASSERT_TRUE(clock);
  camera->start();
  camera->trigger();
  const auto frame = camera->next(1.0);
  ASSERT_TRUE(frame && frame->device_ns);
  const auto exposed = device.exposures().at(0).host_ns;
  EXPECT_NEAR(clock->host_time_s(*frame->device_ns, exposed), 0, 5e-4 + clock->bound_s);
}

// ----
// The first frame after opening a stream arrives complete, although no packet is resent.

constexpr int kCameras = 4, kWidth_px = 1280, kHeight_px = 1024;

std::vector<std::uint8_t> picture_of(int camera) {
  std::vector<std::uint8_t> pixels;
  pixels.reserve(kWidth_px * kHeight_px);
  for (int i = 0; i < kWidth_px * kHeight_px; ++i)
    pixels.push_back(static_cast<std::uint8_t>(i * (camera + 3) + i / 977));
  return pixels;
}

TEST(FirstFrame, IsWholeWithoutResend) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
  const int sets = test::trial_count(10, 1000);
  std::vector<std::unique_ptr<test::GigeCamera>> devices;
  std::vector<std::unique_ptr<CameraDevice>> cameras;
  std::vector<std::vector<std::uint8_t>> pictures;
  for (int c = 0; c < kCameras; ++c) {
    test::GigeCameraOptions options;
    options.address = "127.0.0." + std::to_string(2 + c);
    options.serial = "F" + std::to_string(c);
    options.width_px = kWidth_px;
    options.height_px = kHeight_px;
    options.resend = false;
    devices.push_back(std::make_unique<test::GigeCamera>(options));
    pictures.push_back(picture_of(c));
    devices.back()->show(pictures.back());
    cameras.push_back(open_camera({Backend::aravis, options.address, "127.0.0.1", ""}));
    CameraSettings settings;
    settings.trigger = TriggerSource::software;
    settings.packet_size_bytes = 1400;
    static_cast<void>(cameras.back()->configure(settings));
  }
  int whole_sets = 0;
  std::string faults;
  for (int set = 0; set < sets; ++set) {
    int whole = 0;
    for (const auto& camera : cameras) camera->start();
    for (const auto& camera : cameras) camera->trigger();
    for (std::size_t c = 0; c < kCameras; ++c) {
      const auto frame = cameras[c]->next(2.0);
      if (frame && !frame->complete) faults += frame->fault + "; ";
      whole += frame && frame->complete &&
               std::memcmp(frame->pixels, pictures[c].data(), pictures[c].size()) == 0;
    }
    for (const auto& camera : cameras) camera->stop();
    whole_sets += whole == kCameras;
  }
  std::printf("one-frame sets of %d cameras, resend off: %d of %d whole\n", kCameras, whole_sets,
              sets);
  EXPECT_EQ(whole_sets, sets) << faults;
}

}  // namespace
}  // namespace drape::capture
