// SPDX-License-Identifier: Apache-2.0
// The first frame after opening a stream arrives complete, although no packet is resent.
#include <gmock/gmock.h>

#include <cstring>
#include <thread>

#include "capture/device/camera.hpp"
#include "tests/support/gige_camera/gige_camera.hpp"
#include "tests/support/gige_camera/private_network.hpp"
#include "tests/support/trials.hpp"

namespace drape::capture {
namespace {

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
