// SPDX-License-Identifier: Apache-2.0
// Runs the programs as a person does, with three emulated cameras that show bench1's frames.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <cstdio>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "capture/capture.hpp"
#include "capture/doctor/checks.hpp"
#include "capture/recording/record.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/run_record.hpp"
#include "tests/support/bench1_calibration.hpp"
#include "tests/support/gige_camera/gige_camera.hpp"
#include "tests/support/gige_camera/private_network.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"
#include "tests/support/trials.hpp"

namespace drape::capture {
namespace {

using test::Outcome;
using testing::HasSubstr;
namespace fs = std::filesystem;

Outcome run(const std::string& name, const std::string& arguments) {
  return test::run_line(fmt::format("{} {} </dev/null", test::program(name).string(), arguments));
}

/// bench1's rig with a cameras.toml: emulated cameras, or the recording itself.
class Programs : public test::CameraTest {
 protected:
  void write_rig(const std::string& folder, bool live,
                 const std::string& method_of_live = "software_trigger") {
    const fs::path to = temporary_.path() / folder;
    fs::create_directories(to);
    std::string cameras =
        "schema = \"drapebench/cameras/1\"\n[sync]\nframe_rate_hz = 1.0\nlargest_spread_ms = "
        "200.0\n";  // allows for a busy machine, which writes slowly and triggers cameras late
    cameras += fmt::format("method = \"{}\"\n", live ? method_of_live : "free_run");
    for (int c = 0; c < 3; ++c) {
      cameras += fmt::format("[[camera]]\nname = \"cam{}\"\n", c);
      cameras +=
          live ? fmt::format(
                     "backend = \"aravis\"\ndevice = \"127.0.0.{}\"\n"
                     "host_address = \"127.0.0.1\"\npacket_size_bytes = 8192\n"
                     "exposure_us = 2000.0\n",
                     2 + c)
               : fmt::format("backend = \"replay\"\ndevice = \"cam{}\"\nrecording = \"one\"\n", c);
    }
    write_durable(to / "cameras.toml", cameras);
    write_durable(to / "rig.toml", read_text(test::source_root() / "rigs/bench1/rig.toml"));
  }

  /// Writes the frames of one set of bench1 alone.
  void write_one_set(const std::string& set, const fs::path& to) {
    for (int c = 0; c < 3; ++c) {
      const std::string file = fmt::format("{}/cam{}.png", set, c);
      fs::create_directories(to / set);
      fs::copy_file(test::source_root() / "rigs/bench1/recording" / file, to / file);
    }
    static_cast<void>(import_folder(to, to, {}));
  }

  [[nodiscard]] std::string path(const std::string& file) const {
    return "'" + (temporary_.path() / file).string() + "'";
  }

  test::TemporaryFolder temporary_;
};

cv::Mat pixels_of(const fs::path& file) {
  return cv::imread(file.string(), cv::IMREAD_UNCHANGED);
}

std::string pixel_hash(const cv::Mat& image) {
  return sha256_of(std::span<const unsigned char>(image.data, image.total() * image.elemSize()));
}

/// Three cameras that show bench1's drape_A and lose one packet in a hundred.
std::vector<std::unique_ptr<test::GigeCamera>> cameras_of_bench1() {
  std::vector<std::unique_ptr<test::GigeCamera>> devices;
  for (int c = 0; c < 3; ++c) {
    test::GigeCameraOptions options;
    options.address = fmt::format("127.0.0.{}", 2 + c);
    options.serial = fmt::format("B1C{}", c);
    options.width_px = 1600;
    options.height_px = 1200;
    options.clock_offset_s = c - 1;
    devices.push_back(std::make_unique<test::GigeCamera>(options));
    const cv::Mat image =
        pixels_of(test::source_root() / fmt::format("rigs/bench1/recording/drape_A/cam{}.png", c));
    devices.back()->show({image.data, image.data + image.total()});
    devices.back()->set_faults({.lose = 0.01});
  }
  return devices;
}

TEST_F(Programs, LiveIsReplayBitForBit) {
  write_rig("live", true);
  write_rig("replay", false);
  write_one_set("drape_A", temporary_.path() / "replay/one");
  const auto devices = cameras_of_bench1();
  const Outcome live = run("drape-capture", path("live") + " --set drape_A --out " + path("a"));
  EXPECT_EQ(live.exit_code, 0) << live.text;
  const Outcome replay = run("drape-capture", path("replay") + " --set drape_A --out " + path("b"));
  EXPECT_EQ(replay.exit_code, 0) << replay.text;
  for (int c = 0; c < 3; ++c) {
    const std::string file = fmt::format("drape_A/cam{}.png", c);
    const cv::Mat original = pixels_of(test::source_root() / "rigs/bench1/recording" / file);
    EXPECT_EQ(pixel_hash(pixels_of(temporary_.path() / "a" / file)), pixel_hash(original)) << file;
    // Equal pixels written by the same writer give equal files.
    EXPECT_EQ(read_bytes(temporary_.path() / "a" / file),
              read_bytes(temporary_.path() / "b" / file));
  }
  EXPECT_EQ(run("drape-capture", "verify " + path("a")).exit_code, 0);
  const Json details = parse_json(read_text(temporary_.path() / "a/drape_A/capture.json"));
  EXPECT_EQ(details["sync_method"], "software_trigger");
  ASSERT_EQ(details["cameras"].size(), 3U);
  for (std::size_t c = 0; c < 3; ++c) {
    // On a busy machine packets that are merely late are requested again too; lost ones always.
    const auto counts = devices[c]->counts();
    const auto resent = details["cameras"][c]["packets"]["resent"].get<std::uint64_t>();
    EXPECT_GE(resent, counts.packets_lost);
    EXPECT_LE(resent, counts.packets_resent);
  }

  const Outcome again = run("drape-capture", path("live") + " --set drape_A --out " + path("a"));
  EXPECT_EQ(again.exit_code, 3) << again.text;
  const Outcome cameras = run("drape-capture cameras", "");
  EXPECT_EQ(cameras.exit_code, 0) << cameras.text;
  EXPECT_THAT(cameras.text, HasSubstr("B1C2"));
  const Outcome doctor = run("drape-capture doctor", path("live") + " --out " + path("a"));
  EXPECT_EQ(doctor.exit_code, 0) << "before the first calibration: " << doctor.text;
  EXPECT_THAT(doctor.text, HasSubstr("picture of cam2"));
  EXPECT_THAT(doctor.text, HasSubstr("none is given: record the target"));
  std::printf("%s\n%s\n%s\n", live.text.c_str(), cameras.text.c_str(), doctor.text.c_str());
}

/// Covers every check by name; those of the machine (disk, receive buffer) can have any result.
TEST_F(Programs, TheDoctorSaysGoOnAGoodBenchAndWhatToTypeOtherwise) {
  write_rig("live", true);
  const auto devices = cameras_of_bench1();
  write_calibration(temporary_.path() / "calibration.json", test::bench1_true_calibration());
  const std::string line = path("live") + " --json --out " + path("") + " --calibration ";
  const Json good = parse_json(run("drape-capture doctor", line + path("calibration.json")).text);
  std::map<std::string, Json> checks;
  for (const Json& check : good.at("checks")) checks[check.at("check")] = check;
  for (const std::string name :
       {"calibration", "packet size on lo", "link budget by lo", "camera cam0", "camera cam1",
        "camera cam2", "a set of all cameras", "picture of cam0", "picture of cam1",
        "picture of cam2", "cloth"}) {
    ASSERT_TRUE(checks.count(name)) << name << " is not in " << good.dump(1);
    EXPECT_EQ(checks[name].at("verdict"), "GO") << checks[name].dump();
    EXPECT_TRUE(checks[name].at("to_do").is_null());
  }
  for (const std::string name :
       {"receive buffer of cam1", "disk space", "disk speed", "clock of cam0", "clock of cam2"})
    EXPECT_TRUE(checks.count(name)) << name;
  EXPECT_THAT(checks["picture of cam1"].at("found"), HasSubstr("saturated"));
  EXPECT_THAT(checks["picture of cam1"].at("found"), HasSubstr("sharpness"));
  EXPECT_THAT(checks["link budget by lo"].at("found"), HasSubstr("packet_delay_ns"));

  devices[1]->unplug();
  devices[2]->show(std::vector<std::uint8_t>(1600 * 1200, 255));
  const Outcome bad = run("drape-capture doctor", line + path("nowhere.json"));
  EXPECT_EQ(bad.exit_code, 1);
  int named = 0;
  const Json report = parse_json(bad.text);
  for (const Json& check : report.at("checks")) {
    const bool go = check.at("verdict") == "GO";
    EXPECT_EQ(check.at("to_do").is_null(), go) << check.dump();
    for (const char* name : {"calibration", "camera cam1", "a set of all cameras"})
      named += !go && check.at("check") == name;
  }
  EXPECT_EQ(named, 3) << bad.text;
  EXPECT_THAT(run("drape-capture cameras", "--json").text, HasSubstr("\"B1C2\""));
}

/// Runs a program with the given keyboard input.
Outcome run_with(const std::string& typed, const std::string& name, const std::string& arguments) {
  return test::run_line(
      fmt::format("printf '{}' | '{}' {}", typed, test::program(name).string(), arguments));
}

TEST_F(Programs, ASessionTakesSetsOnEnterAndARetakeErasesNothing) {
  write_rig("live", true);
  const auto devices = cameras_of_bench1();
  const Outcome session = run_with("\\n../out\\ndrape_X\\nr\\nq\\n", "drape-capture",
                                   path("live") + " --out " + path("a"));
  EXPECT_EQ(session.exit_code, 0) << session.text;
  EXPECT_THAT(session.text, HasSubstr("`../out` cannot be the name of a set"));
  EXPECT_THAT(session.text, HasSubstr("GO: drape_X stored"));
  const Recording recording = read_recording(temporary_.path() / "a");
  std::vector<std::string> names;
  for (const FrameSet& set : recording.sets) names.push_back(set.name);
  EXPECT_THAT(names, testing::ElementsAre("stage_z000", "drape_X.take1", "drape_X"))
      << session.text;
  const Outcome verify = run("drape-capture", "verify " + path("a"));
  EXPECT_EQ(verify.exit_code, 0) << verify.text;
  EXPECT_FALSE(fs::exists(temporary_.path() / "a/recording.journal"));
  EXPECT_THAT(session.text,
              HasSubstr(printed(*kept_ending(temporary_.path() / "a/recording.run.json"))));
}

TEST_F(Programs, TheRunRecordHasTheEndingAndEveryInput) {
  write_rig("replay", false);
  const fs::path cameras = temporary_.path() / "replay/cameras.toml";
  write_durable(cameras,
                read_text(cameras) + "[reference]\nrecording = \"one\"\nset = \"drape_A\"\n");
  write_one_set("drape_A", temporary_.path() / "replay/one");
  const Outcome outcome =
      run("drape-capture", path("replay") + " --set drape_B --out " + path("a"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.text;
  EXPECT_EQ(printed(*kept_ending(temporary_.path() / "a/recording.run.json")), outcome.text);
  const auto inputs = [&](const std::string& recording) {
    std::vector<std::string> files;
    for (const RecordedFile& input :
         read_run_file(temporary_.path() / recording / "recording.run.json").inputs)
      files.push_back(input.file);
    return files;
  };
  EXPECT_THAT(inputs("a"), testing::ElementsAre("../replay/rig.toml", "../replay/cameras.toml",
                                                "../replay/one/drape_A/cam0.png",
                                                "../replay/one/drape_A/cam1.png",
                                                "../replay/one/drape_A/cam2.png"));
  // The file of a rig can have any name.
  fs::rename(temporary_.path() / "replay/rig.toml", temporary_.path() / "replay/lab.toml");
  const Outcome named =
      run("drape-capture", path("replay/lab.toml") + " --set drape_B --out " + path("b"));
  ASSERT_EQ(named.exit_code, 0) << named.text;
  EXPECT_EQ(inputs("b").at(0), "../replay/lab.toml");
}

TEST_F(Programs, ASecondCaptureIntoOneRecordingIsRefused) {
  write_rig("replay", false);
  write_one_set("drape_A", temporary_.path() / "replay/one");
  const Journal first(temporary_.path() / "a", "2026-01-31");
  const Outcome second = run("drape-capture", path("replay") + " --set drape_A --out " + path("a"));
  EXPECT_EQ(second.exit_code, 3);
  EXPECT_THAT(second.text, HasSubstr("another capture records into this folder"));
}

/// Peak memory of the program and its hosts must not grow with the number of sets.
TEST_F(Programs, ALongCaptureTakesLittleMemory) {
  write_rig("live", true);
  const auto devices = cameras_of_bench1();
  const int sets = test::trial_count(12, 1000);
  const Outcome capture = run("drape-capture", fmt::format("{} --set drape --frames {} --out {}",
                                                           path("live"), sets, path("a")));
  EXPECT_EQ(capture.exit_code, 0) << capture.text;
  EXPECT_THAT(capture.text, HasSubstr(fmt::format("{0} of {0} sets stored", sets)));
  rusage children{};
  ASSERT_EQ(::getrusage(RUSAGE_CHILDREN, &children), 0);
  std::printf("%d sets of 3 x 1.9 MP: largest process %ld MB\n", sets, children.ru_maxrss / 1024);
  EXPECT_LE(children.ru_maxrss, 200 * 1024);
}

/// Frames that wait for a silent camera are bounded in number, however long they wait.
TEST_F(Programs, ASilentCameraLetsNoMemoryGrow) {
  write_rig("live", true, "free_run");
  const fs::path file = temporary_.path() / "live/cameras.toml";
  std::string text = read_text(file);
  write_durable(file, text.replace(text.find("= 1.0"), 5, "= 5.0"));
  const auto devices = cameras_of_bench1();
  devices[1]->set_faults({.skip_frame = 1});
  const Outcome capture = run("drape-capture", path("live") + " --set drape --out " + path("a"));
  EXPECT_EQ(capture.exit_code, 1) << capture.text;
  EXPECT_THAT(capture.text, HasSubstr("it was opened 10 times and gave no frame"));
  EXPECT_THAT(capture.text, HasSubstr("no frame of every other camera within the window"));
  const Outcome doctor =
      run("drape-capture doctor", path("live") + " --out " + temporary_.path().string());
  EXPECT_EQ(doctor.exit_code, 1) << doctor.text;
  rusage children{};
  ASSERT_EQ(::getrusage(RUSAGE_CHILDREN, &children), 0);
  std::printf("%lu frames sent: largest process %ld MB\n", devices[0]->counts().frames_sent,
              children.ru_maxrss / 1024);
  EXPECT_LE(children.ru_maxrss, 200 * 1024);
}

/// Sets stored before the interrupt remain, complete.
TEST_F(Programs, CtrlCEndsACaptureWithWhatItHas) {
  write_rig("live", true);
  const auto devices = cameras_of_bench1();
  const Outcome capture =
      run_with("", "drape-capture",
               path("live") + " --set drape --frames 500 --out " + path("a") +
                   " & while kill -0 $! && ! ls -d " + path("a") +
                   "/drape*; do sleep 0.1; done >/dev/null 2>&1; kill -INT $!; wait $!");
  EXPECT_EQ(capture.exit_code, 130) << capture.text;
  const std::size_t stored = read_recording(temporary_.path() / "a").sets.size();
  EXPECT_GT(stored, 0U) << capture.text;
  EXPECT_THAT(capture.text, HasSubstr(fmt::format("{} of 500 sets stored", stored)));
  EXPECT_EQ(read_run_file(temporary_.path() / "a/recording.run.json").exit_code, 130);
  EXPECT_EQ(run("drape-capture", "verify " + path("a")).exit_code, 0);
}

TEST_F(Programs, AFullDiskStoresNothingHalf) {
  if (std::system("unshare -rm true 2>/dev/null") != 0)
    GTEST_SKIP() << "no mount namespace: a full disk cannot be played here";
  write_rig("replay", false);
  write_one_set("drape_A", temporary_.path() / "replay/one");
  fs::create_directories(temporary_.path() / "small");
  // A disk of 1 MB is too small for three images of 0.7 MB each.
  write_durable(
      temporary_.path() / "full.sh",
      fmt::format("mount -t tmpfs -o size=1m none {0} || exit 77\n"
                  "'{1}' {2} --set drape_A --out {0}/recording; code=$?\n"
                  "test ! -e {0}/recording/recording.json || exit 99\nexit $code\n",
                  path("small"), test::program("drape-capture").string(), path("replay")));
  const auto [code, output] = test::run_line("unshare -rm sh " + path("full.sh"));
  if (code == 77) GTEST_SKIP() << "a small disk cannot be mounted here: " << output;
  EXPECT_EQ(code, 3) << output;
  EXPECT_THAT(output, HasSubstr("No space left on device"));
  EXPECT_THAT(output, HasSubstr("to do:"));
}

}  // namespace
}  // namespace drape::capture
