// SPDX-License-Identifier: Apache-2.0
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "capture/capture.hpp"
#include "capture/live/live_capture.hpp"
#include "capture/recording/record.hpp"
#include "console/cameras.hpp"
#include "console/session.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/fuzz/kinds.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

/// A picture of 24 x 16 px with a dark disc.
std::function<fs::path(const fs::path&)> picture_as(const std::string& ending) {
  return [=](const fs::path& folder) {
    cv::Mat picture(16, 24, CV_8U, cv::Scalar(230));
    for (int y = 3; y < 13; ++y)
      for (int x = 6; x < 18; ++x) picture.at<unsigned char>(y, x) = 20;
    std::vector<unsigned char> bytes;
    cv::imencode(ending, picture, bytes);
    write_durable(folder / ("picture" + ending),
                  {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    return folder / ("picture" + ending);
  };
}

void import_picture(const fs::path& file) {
  static_cast<void>(capture::check_image(read_bytes(file), {.file = file.string()}));
}

/// Calls the decoder without any earlier check; the caller names the file.
void show_picture(const fs::path& file) {
  try {
    static_cast<void>(console::make_picture(read_bytes(file), 12, true));
  } catch (const Error& error) {
    throw Error(error.kind(), error.what_failed(), {.file = file.string()}, error.what_to_do());
  }
}

fs::path make_cameras(const fs::path& folder) {
  write_durable(folder / "rig.toml", read_text(source_root() / "rigs/bench1/rig.toml"));
  std::string text =
      "schema = \"drapebench/cameras/1\"\n[sync]\nmethod = \"free_run\"\n"
      "frame_rate_hz = 5.0\nlargest_spread_ms = 50.0\n";
  for (const char n : {'0', '1', '2'})
    text += std::string("[[camera]]\nname = \"cam") + n + "\"\nbackend = \"aravis\"\ndevice = \"S" +
            n + "\"\nexposure_us = 5000.0\n";
  write_durable(folder / "cameras.toml", text);
  return folder / "cameras.toml";
}

constexpr const char* kJournal =
    R"({"set":{"name":"drape_A","frames":[{"camera":"cam0","file":"drape_A/cam0.png","sha256":"aa",)"
    R"("width_px":4,"height_px":3,"device_time_s":0.5}]},"burst":"drape"})"
    "\n"
    R"({"renamed":["drape_A","drape_A.take1"]})"
    "\n";

fs::path make_journal(const fs::path& folder) {
  fs::create_directories(folder / "drape_A");
  write_durable(folder / "recording.journal", kJournal);
  return folder / "recording.journal";
}

/// Takes over a file as a capture does after an earlier one was interrupted.
void take_over(const fs::path& file) {
  fs::remove(file.parent_path() / "recording.json");
  fs::remove_all(file.parent_path() / "drape_A.take1");
  fs::create_directories(file.parent_path() / "drape_A");
  write_durable(file.parent_path() / "drape_A/cam0.png", "an image");
  capture::Journal journal(file.parent_path(), "2026-01-31");
}

fs::path make_log(const fs::path& folder) {
  write_durable(folder / "session.jsonl",
                "{\"schema\":\"drapebench/session-log/1\"}\n"
                "{\"at\":\"2026-01-31T12:00:00Z\",\"who\":\"Ada\",\"what\":\"note\"}\n");
  return folder / "session.jsonl";
}

}  // namespace

std::vector<Kind> image_kinds() {
  return {
      {"image_png", picture_as(".png"), import_picture},
      // JPEG has no checksum.
      {"image_jpeg", picture_as(".jpg"), import_picture, true, "."},
      {"image_tiff", picture_as(".tiff"), import_picture},
      {"picture_png", picture_as(".png"), show_picture},
      {"picture_jpeg", picture_as(".jpg"), show_picture, false, "."},
      {"picture_tiff", picture_as(".tiff"), show_picture},
      {"cameras", make_cameras,
       [](const fs::path& f) { static_cast<void>(capture::read_cameras_file(f.parent_path())); }},
      // A torn line is that of a program that was killed.
      {"journal", make_journal, take_over, true, "."},
      {"session_log", make_log, [](const fs::path& f) { console::SessionLog{f}; }, false, "."},
  };
}

}  // namespace drape::test
