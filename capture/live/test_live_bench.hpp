// SPDX-License-Identifier: Apache-2.0
#pragma once

// Bench of emulated cameras for tests of whole captures.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "capture/live/live_capture.hpp"
#include "tests/support/gige_camera/gige_camera.hpp"
#include "tests/support/gige_camera/private_network.hpp"
#include "tests/support/paths.hpp"

namespace drape::capture {

inline void PrintTo(SyncMethod method, std::ostream* out) {
  *out << name_of(method);
}

}  // namespace drape::capture

namespace drape::test {

using namespace capture;

/// Test picture with edges, dark and bright areas; depends on the seed.
inline std::vector<std::uint8_t> picture(int width_px, int height_px, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < height_px; ++y)
    for (int x = 0; x < width_px; ++x)
      pixels.push_back(
          static_cast<std::uint8_t>(((x / 16 + y / 16) % 2 != 0 ? 200 : 20) + random() % 8));
  return pixels;
}

/// Bytes of a picture in the camera's first format, with the expected grey values.
struct Sent {
  std::vector<std::uint8_t> bytes, grey;
};

inline Sent picture_for(const Personality& p, int width_px, int height_px, unsigned seed) {
  const std::string& name = p.pixel_formats.front().first;
  const PixelFormat& format = *find_pixel_format(name);
  Sent sent;
  const auto count = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  sent.bytes.resize((count * format.row_bytes(8) + 7) / 8);
  const auto plain = picture(width_px, height_px, seed);
  for (std::size_t i = 0; i < sent.bytes.size(); ++i) sent.bytes[i] = plain[i % count];
  if (format.bits > 8 && format.packing == Packing::words)
    for (std::size_t i = 1; i < sent.bytes.size(); i += 2)
      sent.bytes[i] = static_cast<std::uint8_t>(sent.bytes[i] & ((1 << (format.bits - 8)) - 1));
  // The packings themselves are tested in pixel_format_test.cpp.
  const Samples grey = grey_of(unpack(format, sent.bytes, width_px, height_px), format.mosaic);
  for (const std::uint16_t v : grey.values)
    sent.grey.push_back(static_cast<std::uint8_t>(v >> (format.bits - 8)));
  return sent;
}

/// Entry of cameras.toml for a camera on the loopback interface.
inline LiveCamera camera_at(const std::string& name, const std::string& address, int width_px,
                            int height_px, double rate_hz) {
  LiveCamera camera{name, {Backend::aravis, address, "127.0.0.1", ""}, {}};
  camera.settings.width_px = width_px;
  camera.settings.height_px = height_px;
  camera.settings.frame_rate_hz = rate_hz;
  return camera;
}

/// Captures `frames` sets on a possibly busy machine; `at_set` is called with the count so far.
inline LiveResult capture_with(const CamerasFile& file, int frames,
                               const std::function<void(int)>& at_set = {}, double patience_s = 300,
                               bool keep_pixels = true) {
  LiveOptions options;
  if (at_set)
    options.progress = [&](double fraction, const std::string&) {
      at_set(static_cast<int>(std::lround(fraction * frames)));
    };
  options.frames = frames;
  options.patience_s = patience_s;
  options.opening_s = 300;
  options.keep_pixels = keep_pixels;
  options.host_program = program("drape-camera-host");
  return capture_live(file, options);
}

/// `count` cameras with unrelated clocks.
struct LiveBench {
  explicit LiveBench(std::size_t count, SyncMethod method, int width_px = 320, int height_px = 240,
                     double rate_hz = 20, const std::vector<double>& first_exposures_s = {}) {
    file.method = method;
    file.frame_rate_hz = rate_hz;
    file.largest_spread_s = 0.4 / rate_hz;
    for (std::size_t i = 0; i < count; ++i) {
      const auto n = static_cast<unsigned>(i);
      GigeCameraOptions options;
      options.address = fmt::format("127.0.0.{}", 2 + i);
      options.serial = fmt::format("DB{:04}", i);
      options.width_px = width_px;
      options.height_px = height_px;
      options.clock_offset_s = 3.3 * static_cast<double>(i) - 5;
      options.clock_drift_ppm = 60 * static_cast<double>(i) - 60;
      options.first_frame_id = static_cast<std::uint16_t>(65530 + i);
      options.seed = n + 1;
      if (i < first_exposures_s.size()) options.first_exposure_s = first_exposures_s[i];
      devices.push_back(std::make_unique<GigeCamera>(options));
      pictures.push_back(picture(width_px, height_px, n));
      devices.back()->show(pictures.back());
      LiveCamera camera =
          camera_at(fmt::format("cam{}", i), options.address, width_px, height_px, rate_hz);
      camera.settings.exposure_us = 1000;
      camera.settings.packet_size_bytes = 8192;
      file.cameras.push_back(camera);
    }
  }

  [[nodiscard]] LiveResult capture(int frames, double patience_s = 20, bool keep = true,
                                   const std::function<void(int)>& at_set = {}) const {
    return capture_with(file, frames, at_set, patience_s, keep);
  }

  CamerasFile file;
  std::vector<std::unique_ptr<GigeCamera>> devices;
  std::vector<std::vector<std::uint8_t>> pictures;
};

class LiveCapture : public CameraTest {};

/// Expects that every frame is its camera's picture and that each set was exposed at one instant.
inline void expect_right_sets(const LiveBench& bench, const LiveResult& live) {
  for (const PairedFrames& set : live.pairing.sets) {
    ASSERT_EQ(set.frames.size(), bench.devices.size());
    for (std::size_t c = 0; c < set.frames.size(); ++c)
      EXPECT_EQ(live.frames[set.frames[c]].pixels, bench.pictures[c]);
  }
  for (const CameraLedger& ledger : live.pairing.cameras) EXPECT_TRUE(ledger.closes());
}

inline std::string all_faults(const LiveResult& live) {
  std::string text;
  for (const LiveFault& f : live.report.faults)
    text += fmt::format("{}: {} [{}]\n", f.camera, f.what, f.what_to_do);
  return text;
}

}  // namespace drape::test
