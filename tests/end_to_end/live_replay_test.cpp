// SPDX-License-Identifier: Apache-2.0
// Live = replay: one drape through emulated GigE cameras, through the kernel's V4L2 driver and from
// a recording gives the same pixels and the same measured sheet, byte for byte.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/recording.hpp"
#include "tests/support/bench1_calibration.hpp"
#include "tests/support/gige_camera/gige_camera.hpp"
#include "tests/support/gige_camera/private_network.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"
#include "tests/support/v4l2_guest/v4l2_guest.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;
using test::Outcome;
using testing::HasSubstr;

constexpr int kCameras = 3;

fs::path bench1() {
  return test::source_root() / "rigs/bench1";
}

cv::Mat frame_of_bench1(int camera) {
  return cv::imread((bench1() / fmt::format("recording/drape_A/cam{}.png", camera)).string(),
                    cv::IMREAD_UNCHANGED);
}

std::string pixel_hash(const cv::Mat& image) {
  return sha256_of(std::span<const unsigned char>(image.data, image.total() * image.elemSize()));
}

class LiveIsReplay : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"drape-detect", "drape-triangulate"})
      if (!fs::exists(test::program(name)))
        GTEST_SKIP() << name << " is missing: build with stages detect and triangulate too";
  }
  [[nodiscard]] fs::path at(const std::string& name) const { return temporary_.path() / name; }
  [[nodiscard]] std::string quoted(const std::string& name) const {
    return "'" + at(name).string() + "'";
  }

  Outcome run(const std::string& program, const std::string& arguments) const {
    return test::run_line("'" + test::program(program).string() + "' " + arguments);
  }

  /// Writes bench1's rig with these cameras; `camera` writes the lines of the n-th one.
  template <class Camera>
  void write_rig(const std::string& name, const std::string& method, double rate_hz,
                 Camera camera) const {
    fs::create_directories(at(name));
    std::string text = fmt::format(
        "schema = \"drapebench/cameras/1\"\n[sync]\nmethod = \"{}\"\nframe_rate_hz = {:.2f}\n"
        "largest_spread_ms = 200.0\n",
        method, rate_hz);
    for (int c = 0; c < kCameras; ++c)
      text += fmt::format("[[camera]]\nname = \"cam{}\"\n{}\n", c, camera(c));
    write_durable(at(name) / "cameras.toml", text);
    write_durable(at(name) / "rig.toml", read_text(bench1() / "rig.toml"));
  }

  /// Captures drape_A from bench1's own recording.
  void capture_replay(const std::string& recording) const {
    write_rig("replay-rig", "free_run", 10, [](int c) {
      return fmt::format("backend = \"replay\"\ndevice = \"cam{}\"\nrecording = \"one\"", c);
    });
    const fs::path one = at("replay-rig") / "one";
    Recording first = read_recording(bench1() / "recording");
    first.folder = one;
    std::erase_if(first.sets, [](const FrameSet& set) { return set.name != "drape_A"; });
    fs::create_directories(one / "drape_A");
    for (const RecordedFrame& frame : first.sets.at(0).frames)
      fs::copy_file(bench1() / "recording" / frame.file, one / frame.file);
    write_recording(first);
    const Outcome outcome =
        run("drape-capture",
            quoted("replay-rig") + " --set drape_A --patience-s 300 --out " + quoted(recording));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.text;
  }

  /// sheet.ply and sheet.json of a recording's drape_A, concatenated.
  std::string sheet_of(const std::string& recording) const {
    const std::string out = recording + "-measured";
    fs::create_directories(at(out));
    write_calibration(at("calibration.json"), test::bench1_true_calibration());
    const Outcome detect = run("drape-detect", quoted(recording) + " --rig '" + bench1().string() +
                                                   "' --surface cloth --sets drape_A --out " +
                                                   quoted(out + "/detections.json"));
    EXPECT_EQ(detect.exit_code, 0) << detect.text;
    const Outcome triangulate =
        run("drape-triangulate", quoted(out + "/detections.json") + " --calibration " +
                                     quoted("calibration.json") + " --set drape_A --out " +
                                     quoted(out + "/sheet.ply"));
    EXPECT_EQ(triangulate.exit_code, 0) << triangulate.text;
    return read_text(at(out) / "sheet.ply") + read_text(at(out) / "sheet.json");
  }

  void expect_bench1s_pixels(const std::string& recording) const {
    for (int c = 0; c < kCameras; ++c) {
      const cv::Mat got = cv::imread((at(recording) / fmt::format("drape_A/cam{}.png", c)).string(),
                                     cv::IMREAD_UNCHANGED);
      EXPECT_EQ(pixel_hash(got), pixel_hash(frame_of_bench1(c))) << recording << " cam" << c;
    }
  }

  test::TemporaryFolder temporary_;
};

TEST_F(LiveIsReplay, ThroughThreeGigeCameras) {
  DRAPE_REQUIRE_PRIVATE_NETWORK();
  std::vector<std::unique_ptr<test::GigeCamera>> devices;
  for (int c = 0; c < kCameras; ++c) {
    const cv::Mat image = frame_of_bench1(c);
    test::GigeCameraOptions options;
    options.address = fmt::format("127.0.0.{}", 2 + c);
    options.serial = fmt::format("B1C{}", c);
    options.width_px = image.cols;
    options.height_px = image.rows;
    options.clock_offset_s = c - 1;
    devices.push_back(std::make_unique<test::GigeCamera>(options));
    devices.back()->show({image.data, image.data + image.total()});
    devices.back()->set_faults({.lose = 0.01});
  }
  write_rig("gige-rig", "software_trigger", 2, [](int c) {
    return fmt::format(
        "backend = \"aravis\"\ndevice = \"127.0.0.{}\"\n"
        "host_address = \"127.0.0.1\"\npacket_size_bytes = 8192",
        2 + c);
  });
  const Outcome live =
      run("drape-capture",
          quoted("gige-rig") + " --set drape_A --patience-s 300 --out " + quoted("gige"));
  ASSERT_EQ(live.exit_code, 0) << live.text;
  capture_replay("replay");
  expect_bench1s_pixels("gige");
  expect_bench1s_pixels("replay");
  const std::string sheet = sheet_of("gige");
  EXPECT_GT(sheet.size(), 10'000U);
  EXPECT_TRUE(sheet == sheet_of("replay")) << "the measured sheets differ";
}

/// Checks the results of the tests in the guest, from GoogleTest's JSON.
void expect_guest_tests_passed(const fs::path& file, const std::string& output) {
  ASSERT_TRUE(fs::exists(file)) << output;
  const Json report = parse_json(read_text(file));
  EXPECT_EQ(report.at("failures"), 0) << output;
  EXPECT_GE(report.at("tests").get<int>(), 15);
  for (const Json& suite : report.at("testsuites"))
    for (const Json& one : suite.at("testsuite")) {
      EXPECT_EQ(one.at("result"), "COMPLETED") << one.at("name");
      std::printf("in the guest: %s.%s %s\n", suite.at("name").get<std::string>().c_str(),
                  one.at("name").get<std::string>().c_str(),
                  one.at("time").get<std::string>().c_str());
    }
}

TEST_F(LiveIsReplay, ThroughTheKernelsV4l2Driver) {
  fs::create_directories(at("share"));
  write_rig("share/rig", "free_run", 8.237, [](int c) {
    return fmt::format("backend = \"v4l2\"\ndevice = \"{}\"", test::guest_camera(c));
  });
  for (int c = 0; c < kCameras; ++c) {
    const cv::Mat image = frame_of_bench1(c);
    write_durable(at(fmt::format("share/cam{}.raw", c)),
                  std::string_view(reinterpret_cast<const char*>(image.data), image.total()));
  }
  const std::string tests =
      (test::program("").parent_path().parent_path() / "tests/capture_in_guest").string();
  const test::GuestRun guest = test::run_in_guest(
      at("share"),
      fmt::format("TMPDIR={0} DRAPE_GUEST_FOLDER={0} '{1}' --gtest_output=json:{0}/tests.json",
                  at("share").string(), tests),
      {test::program("drape-camera-host"), test::program("drape-capture")});
  if (guest.cannot) GTEST_SKIP() << "no V4L2 guest: " << *guest.cannot;
  std::printf("the guest ran %s\n", guest.without_kvm.empty()
                                        ? "in KVM"
                                        : ("in software emulation: " + guest.without_kvm).c_str());
  EXPECT_EQ(guest.exit_code, 0) << guest.output;
  expect_guest_tests_passed(at("share/tests.json"), guest.output);
  for (std::size_t from = 0, to = 0; from < guest.output.size(); from = to + 1) {
    to = std::min(guest.output.find('\n', from), guest.output.size());
    const std::string line = guest.output.substr(from, to - from);
    if (line.find("frames again") != std::string::npos) std::printf("%s\n", line.c_str());
  }
  ASSERT_TRUE(fs::exists(at("share/recording"))) << guest.output;
  fs::rename(at("share/recording"), at("vivid"));
  const Json details = parse_json(read_text(at("vivid/drape_A/capture.json")));
  EXPECT_EQ(details.at("sync_method"), "free_run");
  std::printf("three cameras together: spread %.2f ms\n", details.at("spread_ms").get<double>());
  const Outcome verify = run("drape-capture", "verify " + quoted("vivid"));
  EXPECT_EQ(verify.exit_code, 0) << verify.text;
  capture_replay("replay");
  expect_bench1s_pixels("vivid");
  EXPECT_TRUE(sheet_of("vivid") == sheet_of("replay")) << "the measured sheets differ";
}

}  // namespace
}  // namespace drape
