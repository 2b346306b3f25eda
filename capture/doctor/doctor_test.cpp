// SPDX-License-Identifier: Apache-2.0
// The doctor's checks without a camera, and refusals of cameras.toml.
#include <sys/resource.h>

#include <fmt/format.h>
#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "capture/capture.hpp"
#include "capture/doctor/checks.hpp"
#include "capture/live/test_live_bench.hpp"
#include "core/files/json_file.hpp"
#include "core/program/run_record.hpp"
#include "tests/support/bench1_calibration.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/small_bench.hpp"
#include "tests/support/trials.hpp"

namespace drape::capture {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

TEST(CamerasFile, RefusesTheSameDeviceTwiceAndAMissingCamera) {
  test::TemporaryFolder folder;
  write_durable(folder.path() / "rig.toml",
                read_text(test::source_root() / "rigs/bench1/rig.toml"));
  const auto expect_refused = [&](const std::string& cameras, const std::string& why) {
    write_durable(folder.path() / "cameras.toml",
                  "schema = \"drapebench/cameras/1\"\n[sync]\nmethod = \"free_run\"\n"
                  "frame_rate_hz = 5.0\n" +
                      cameras);
    const Error error = test::error_of([&] { return read_cameras_file(folder.path()); });
    EXPECT_THAT(error.what(), HasSubstr(why));
  };
  const auto camera = [](const std::string& name, const std::string& device) {
    return fmt::format("[[camera]]\nname = \"{}\"\nbackend = \"aravis\"\ndevice = \"{}\"\n", name,
                       device);
  };
  expect_refused(camera("cam0", "S1") + camera("cam1", "S1"), "are the same device");
  expect_refused(camera("cam0", "S1") + camera("cam1", "S2"), "has no device");
  expect_refused(camera("cam9", "S1"), "no such camera");
  expect_refused(camera("cam0", "S1") + "pixel_format = \"Mono99\"\n", "cannot be recorded");
  expect_refused(camera("cam0", "S1") + "exposure_ms = 3.0\n", "exposure_ms");
}

Check calibration_check(const Evidence& evidence) {
  return check_calibration(evidence).at(0);
}

TEST(DoctorChecks, TheLinkBudgetGivesLoadAndPacketDelay) {
  // 1.31 MB frames in packets of 1500 bytes: 896 + 2 packets of 1538 bytes on the wire.
  const LinkNeeds needs = link_needs(1280 * 1024, 10, 1500, 4, 1e9);
  EXPECT_NEAR(needs.bytes_per_s, 898 * 1538 * 10, 1538 * 10);
  EXPECT_EQ(needs.packet_delay_ns, 3 * 1538 * 8);
  Evidence evidence;
  LiveCameraReport& camera = evidence.live.report.cameras.emplace_back();
  camera.name = "cam0";
  camera.settings = {{"receive_buffer_bytes", "425984"},
                     {"receive_buffer_of_a_frame_bytes", "2200000"},
                     {"stream_socket", "udp"}};
  EXPECT_THAT(check_receive_buffers(evidence).at(0).found,
              HasSubstr("sysctl -w net.core.rmem_max=4400000"));
  EXPECT_TRUE(calibration_check({}).go);
  EXPECT_FALSE(calibration_check({.calibration = "nowhere.json"}).go);
  const test::TemporaryFolder folder;
  evidence.out = folder.path();
  LiveCamera& large = evidence.cameras.cameras.emplace_back();
  large.settings.width_px = large.settings.height_px = 1 << 30;
  EXPECT_FALSE(check_disk(evidence).at(0).go) << "an exabyte";
  large.settings.width_px = large.settings.height_px = 1;
  EXPECT_TRUE(check_disk(evidence).at(0).go && check_disk(evidence).at(1).go);
}

/// Applies however recent the calibration is.
TEST(DoctorChecks, ACalibrationThatIsNoGoIsNotFitToMeasureWith) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "calibration.json";
  Calibration calibration = test::bench1_true_calibration();
  write_calibration(file, calibration);
  EXPECT_TRUE(calibration_check({.calibration = file}).go);
  calibration.no_go = "cam1 misses by 3 px";
  write_calibration(file, calibration);
  const Check check = calibration_check({.calibration = file});
  EXPECT_FALSE(check.go);
  EXPECT_THAT(check.found, HasSubstr("NO-GO: cam1 misses by 3 px"));
  EXPECT_THAT(check.to_type, HasSubstr("drape calib"));
}

/// A copy is as old as its original.
TEST(DoctorChecks, TheAgeOfACalibrationIsThatOfItsRecord) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "calibration.json";
  write_calibration(file, test::bench1_true_calibration());
  const Check unknown = calibration_check({.calibration = file});
  EXPECT_TRUE(unknown.go);
  EXPECT_THAT(unknown.found, HasSubstr("warning, its age is unknown"));
  const auto record = [&](const std::string& ended, const std::string& sha256) {
    RunFile run;
    run.outputs = {{"calibration.json", sha256}};
    run.ended_utc = ended;
    write_record(folder.path() / "calibration.run.json", run);
  };
  record("2020-01-31T12:00:00Z", sha256_of_file(file));
  EXPECT_FALSE(calibration_check({.calibration = file}).go);
  EXPECT_THAT(calibration_check({.calibration = file}).found, HasSubstr("days old, at most 30"));
  EXPECT_TRUE(calibration_check({.calibration = file, .largest_days = 1e6}).go);
  record("2020-01-31T12:00:00Z", std::string(64, '0'));
  EXPECT_THAT(calibration_check({.calibration = file}).found, HasSubstr("of another file"));
}

TEST(DoctorChecks, ACalibrationOfOtherCamerasIsNotFitToMeasureWith) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "calibration.json";
  write_calibration(file, test::bench1_true_calibration());
  CamerasFile rig;
  LiveCamera& camera = rig.cameras.emplace_back();
  camera.name = "cam0";
  camera.settings.width_px = 1600;
  camera.settings.height_px = 1200;
  EXPECT_TRUE(calibration_check({.cameras = rig, .calibration = file}).go);
  camera.settings.width_px = 1200;
  EXPECT_FALSE(calibration_check({.cameras = rig, .calibration = file}).go);
  camera.settings.width_px = 1600;
  camera.name = "camX";
  EXPECT_FALSE(calibration_check({.cameras = rig, .calibration = file}).go);
  EXPECT_THAT(calibration_check({.cameras = rig, .calibration = file}).found, HasSubstr("camX"));
}

TEST(DoctorChecks, AClockIsKnownNoBetterThanItsDriftLets) {
  Evidence evidence;
  evidence.cameras.cameras.emplace_back().name = "cam0";
  evidence.cameras.largest_spread_s = 3e-4;
  LiveCameraReport& camera = evidence.live.report.cameras.emplace_back();
  camera.name = "cam0";
  camera.clock = ClockFit{.bound_s = 1e-4, .drift_bound_s = 0, .drift_estimated = true};
  const auto look = [&] { return check_capture(evidence).at(1); };
  EXPECT_EQ(look().name, "clock of cam0");
  EXPECT_TRUE(look().go);
  camera.clock = ClockFit{.bound_s = 1e-4, .drift_bound_s = 5e-4};
  EXPECT_FALSE(look().go);
  EXPECT_THAT(look().found, HasSubstr("0.600 ms"));
  EXPECT_THAT(look().to_type, HasSubstr("the drift of a clock"));
}

/// Two webcams of 1280 x 720 px on one bus of 480 Mbit/s, as the kernel lists them.
TEST(DoctorChecks, CamerasOfOneUsbBusMustFitIt) {
  const test::TemporaryFolder sys;
  Evidence evidence{.sys = sys.path()};
  CamerasFile& cameras = evidence.cameras;
  LiveReport& report = evidence.live.report;
  cameras.frame_rate_hz = 10;
  for (int k = 0; k < 2; ++k) {
    const fs::path usb = sys.path() / fmt::format("devices/pci/usb1/1-{}", k + 1);
    const fs::path video = sys.path() / fmt::format("class/video4linux/video{}", k);
    fs::create_directories(usb / "interface");
    fs::create_directories(video);
    write_durable(usb / "busnum", "1\n");
    write_durable(usb / "speed", "480\n");
    fs::create_directory_symlink(usb / "interface", video / "device");
    LiveCamera& camera = cameras.cameras.emplace_back();
    camera.name = fmt::format("cam{}", k);
    camera.address.backend = Backend::v4l2;
    camera.address.device = fmt::format("usb-{}", k);
    camera.settings.width_px = 1280;
    camera.settings.height_px = 720;
    report.cameras.emplace_back().settings = {{"pixel_format", "YUYV"}};
    FoundDevice& device = evidence.found.emplace_back();
    device.backend = Backend::v4l2;
    device.name = camera.address.device;
    device.identity.address = fmt::format("/dev/video{}", k);
  }
  // Two of 1280 x 720 x 2 bytes, 10 times a second: 295 Mbit/s of the 384 available for pictures.
  std::vector<Check> checks = check_usb(evidence);
  ASSERT_EQ(checks.size(), 1U);
  EXPECT_EQ(checks[0].name, "USB bus 1");
  EXPECT_TRUE(checks[0].go) << checks[0].found;
  EXPECT_THAT(checks[0].found, HasSubstr("295 Mbit/s for cam0, cam1; 384 of its 480 Mbit/s"));
  cameras.frame_rate_hz = 15;
  checks = check_usb(evidence);
  EXPECT_FALSE(checks.at(0).go);
  EXPECT_THAT(checks.at(0).to_type, HasSubstr("frame_rate_hz = 13.0 or less"));
  report.cameras[1].settings = {{"pixel_format", "MJPG"}};
  EXPECT_TRUE(check_usb(evidence).at(0).go);
  for (const int k : {0, 1})
    write_durable(sys.path() / fmt::format("devices/pci/usb1/1-{}/speed", k + 1), "5000\n");
  report.cameras[1].settings = {{"pixel_format", "YUYV"}};
  EXPECT_TRUE(check_usb(evidence).at(0).go);
  evidence.found.clear();
  EXPECT_TRUE(check_usb(evidence).empty()) << "no device, nothing to say";
}

TEST(DoctorChecks, AnAcceptanceThatIsOutOfDateIsWarnedOf) {
  const test::TemporaryFolder folder;
  const fs::path calibration = folder.path() / "calibration.json";
  write_durable(calibration, "{}");
  Evidence evidence{.calibration = calibration};
  evidence.cameras.rig_file = folder.path() / "lab.toml";
  const auto look = [&](const char* today) {
    evidence.today = today;
    return check_acceptance(evidence).at(0);
  };
  EXPECT_TRUE(look("2026-03-01").go) << "none is no fault";
  const auto write = [&](bool go, const std::string& sha256) {
    Json json;
    json = {{"schema", "drapebench/acceptance/1"}, {"rig", "lab"}, {"positions", 9}};
    json["figures"] = Json::array();
    json["calibration_sha256"] = sha256;
    json["date"] = "2026-01-31";
    json["valid_until"] = "2027-01-31";
    json["go"] = go;
    json["cause"] = go ? Json() : Json("cam1 moved since the calibration");
    write_json(folder.path() / "acceptance.json", json);
  };
  const std::string own = sha256_of_file(calibration), another(64, '0');
  write(true, own);
  EXPECT_THAT(look("2027-01-31").found, testing::Not(HasSubstr("warning")));
  EXPECT_THAT(look("2027-02-01").found, HasSubstr("warning, expired"));
  write(true, another);
  EXPECT_THAT(look("2026-03-01").found, HasSubstr("warning, of another calibration"));
  write(false, own);
  EXPECT_FALSE(look("2026-03-01").go);
  EXPECT_THAT(look("2026-03-01").found, HasSubstr("NO-GO, cam1 moved"));
}

// ----
// Runs the programs as a person does, with three emulated cameras that show bench1's frames.

using test::Outcome;

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
    GTEST_SKIP() << "missing: a mount namespace, to play a full disk";
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
  if (code == 77) GTEST_SKIP() << "missing: the right to mount a small disk: " << output;
  EXPECT_EQ(code, 3) << output;
  EXPECT_THAT(output, HasSubstr("No space left on device"));
  EXPECT_THAT(output, HasSubstr("to do:"));
}

// ----
// Tests whether the doctor predicts a capture: runs both programs as a person does, for each
// personality of the emulated camera with each fault of a bench.

using test::Personality;

constexpr int kSpoiltCameras = 2;

/// A bench: the content of its cameras.toml and the fault of its second camera.
struct SpoiltBench {
  Personality personality;
  std::string method = "software_trigger", of_second;  ///< further keys of the second camera
  double exposure_us = 2000;
  int width_px = 160, height_px = 120;
  std::string device = "127.0.0.3";
  test::GigeCameraOptions second = {};
  test::GigeFaults transit = {};
  bool plugged = true, small_buffers = false;
};

struct BenchFault {
  std::string name;
  std::function<void(SpoiltBench&)> cause;
  /// Words that both programs must print, alternatives separated by `|`; empty if both must say GO.
  std::function<std::string(const SpoiltBench&)> said;
};

void PrintTo(const BenchFault& fault, std::ostream* out) {
  *out << fault.name;
}

std::function<std::string(const SpoiltBench&)> always(const std::string& said) {
  return [said](const SpoiltBench&) { return said; };
}

const std::vector<BenchFault>& bench_faults() {
  static const std::vector<BenchFault> all = {
      {"none", [](SpoiltBench&) {}, always("")},
      {"packets_larger_than_the_path",
       [](SpoiltBench& b) {
         b.of_second = "packet_size_bytes = 8192\n";
         b.second.path_bytes = 1500;
       },
       always("a frame is incomplete")},
      {"receive_buffer_too_small",
       [](SpoiltBench& b) {
         b.width_px = 1280;
         b.height_px = 1024;
         b.of_second = "packet_size_bytes = 1400\n";
         b.second.resend = false;
         b.small_buffers = true;
       },
       always("sudo sysctl -w net.core.rmem_max=")},
      {"held_by_another_program", [](SpoiltBench& b) { b.second.held = true; },
       always("another program controls the camera")},
      {"pixel_format_locked",
       [](SpoiltBench& b) {
         const auto& offered = b.personality.pixel_formats;
         b.second.stuck = {test::reg::pixel_format};
         b.of_second = fmt::format("pixel_format = \"{}\"\n",
                                   offered.size() > 1 ? offered[1].first : "Mono10p");
       },
       [](const SpoiltBench& b) -> std::string {
         const auto& offered = b.personality.pixel_formats;
         if (offered.size() > 1) return "setting PixelFormat to " + offered[1].first;
         return offered[0].first == "Mono10p" ? "" : "the camera has no pixel format Mono10p";
       }},
      {"exposure_longer_than_the_period",
       [](SpoiltBench& b) {
         b.method = "free_run";
         b.exposure_us = 300'000;
       },
       always("it is longer than the period")},
      {"no_pulse_on_the_line", [](SpoiltBench& b) { b.method = "line_trigger"; },
       [](const SpoiltBench& b) -> std::string {
         if (!b.personality.has_trigger("Line1")) return "has no trigger source Line1";
         if (b.personality.latch == test::Latch::none) return "its clock cannot be read";
         return "no pulse came by the line";
       }},
      {"lost_packets",
       [](SpoiltBench& b) {
         b.width_px = 640;
         b.height_px = 480;
         b.transit = {.lose = 0.5, .lose_resent = 1};
       },
       always("a frame is incomplete|answers no software_trigger")},
      {"firewall", [](SpoiltBench& b) { b.transit = {.lose = 1, .lose_resent = 1}; },
       always("let the firewall pass UDP from 127.0.0.3")},
      {"silent", [](SpoiltBench& b) { b.plugged = false; }, always("cam1")},
      {"automatic_that_cannot_be_switched_off",
       [](SpoiltBench& b) { b.second.stuck = {test::reg::exposure_auto}; },
       always("setting ExposureAuto to Off")},
      {"unknown_device", [](SpoiltBench& b) { b.device = "127.0.0.77"; }, always("cam1")}};
  return all;
}

class Benches : public test::CameraTest, public testing::WithParamInterface<BenchFault> {
 protected:
  static inline int benches = 0, agreements = 0;  ///< over all faults tried by this process

  static void TearDownTestSuite() {
    std::printf("the doctor agrees in %d of %d benches\n", agreements, benches);
    EXPECT_GE(100 * agreements, 95 * benches);
  }

  void write_rig(const SpoiltBench& bench) const {
    std::string rig = read_text(test::source_root() / "rigs/bench1/rig.toml");
    rig.resize(rig.rfind("[[camera]]"));
    for (const auto& [from, to] :
         {std::pair<std::string, std::string>{"= 1600", fmt::format("= {}", bench.width_px)},
          {"= 1200", fmt::format("= {}", bench.height_px)}})
      for (auto at = rig.find(from); at != std::string::npos; at = rig.find(from))
        rig.replace(at, from.size(), to);
    write_durable(folder() / "rig/rig.toml", rig);
    std::string text = fmt::format(
        "schema = \"drapebench/cameras/1\"\n[sync]\nmethod = \"{}\"\nframe_rate_hz = 10.0\n"
        "largest_spread_ms = 500.0\n",  // a busy machine triggers cameras one long after the other
        bench.method);
    for (int c = 0; c < kSpoiltCameras; ++c)
      text += fmt::format(
          "[[camera]]\nname = \"cam{}\"\nbackend = \"aravis\"\ndevice = \"{}\"\n"
          "host_address = \"127.0.0.1\"\nexposure_us = {:.1f}\n{}",
          c, c == 0 ? "127.0.0.2" : bench.device, bench.exposure_us, c == 0 ? "" : bench.of_second);
    write_durable(folder() / "rig/cameras.toml", text);
  }

  static std::vector<std::unique_ptr<test::GigeCamera>> cameras_of(const SpoiltBench& bench) {
    std::vector<std::unique_ptr<test::GigeCamera>> devices;
    for (unsigned c = 0; c < kSpoiltCameras; ++c) {
      test::GigeCameraOptions options = c == 0 ? test::GigeCameraOptions{} : bench.second;
      options.address = fmt::format("127.0.0.{}", 2 + c);
      options.serial = fmt::format("ZOO{}", c);
      options.width_px = bench.width_px;
      options.height_px = bench.height_px;
      options.clock_offset_s = 5.0 * c + 3;
      options.personality = bench.personality;
      devices.push_back(std::make_unique<test::GigeCamera>(options));
      const auto sent =
          test::picture_for(bench.personality, bench.width_px, bench.height_px, c + 1);
      bench.personality.gamma_on ? devices.back()->show(sent.bytes)
                                 : devices.back()->show_bytes(sent.bytes);
    }
    devices.back()->set_faults(bench.transit);
    if (!bench.plugged) devices.back()->unplug();
    return devices;
  }

  /// Describes a disagreement of the two programs; empty if they agree.
  [[nodiscard]] std::string disagreement(const SpoiltBench& bench, const std::string& said) const {
    std::filesystem::remove_all(folder() / "recording");
    write_rig(bench);
    const auto devices = cameras_of(bench);
    const auto run = [&](const std::string& name, const std::string& more) {
      const std::string confined = fmt::format(
          "LD_PRELOAD='{}' setpriv --bounding-set=-net_admin,-net_raw", DRAPE_SMALL_BUFFERS);
      return test::run_line(
          fmt::format("{} {} '{}' {} </dev/null", bench.small_buffers ? confined : "",
                      test::program(name).string(), (folder() / "rig").string(), more));
    };
    const test::Outcome doctor =
        run("drape-capture doctor", fmt::format("--out '{}'", folder().string()));
    const std::string recording = (folder() / "recording").string();
    const test::Outcome capture =
        run("drape-capture", fmt::format("--set one --out '{}' --patience-s 5", recording));
    const bool stored = std::filesystem::exists(folder() / "recording/one");
    const bool go = doctor.exit_code == 0, good = capture.exit_code == 0 && stored;
    const auto names = [&](const test::Outcome& outcome) {
      for (std::size_t at = 0; at <= said.size();) {
        const std::size_t end = std::min(said.find('|', at), said.size());
        if (outcome.text.find(said.substr(at, end - at)) != std::string::npos) return true;
        at = end + 1;
      }
      return false;
    };
    const bool agree =
        said.empty() ? go && good : !go && !good && !stored && names(doctor) && names(capture);
    if (agree) return {};
    return fmt::format("{}: the doctor ended with {}, the capture with {}\n{}\n{}\n",
                       bench.personality.name, doctor.exit_code, capture.exit_code, doctor.text,
                       capture.text);
  }

  [[nodiscard]] const std::filesystem::path& folder() const { return temporary_.path(); }
  test::TemporaryFolder temporary_;
};

TEST_P(Benches, TheDoctorSaysWhatACaptureThenDoes) {
  const BenchFault& fault = GetParam();
  const auto& zoo = test::personalities();
  const int count = test::trial_count(1, static_cast<int>(zoo.size()));
  int agreed = 0;
  std::string others;
  for (int k = 0; k < count; ++k) {
    SpoiltBench bench;
    bench.personality = zoo[static_cast<std::size_t>(k)];
    fault.cause(bench);
    const std::string apart = disagreement(bench, fault.said(bench));
    agreed += apart.empty() ? 1 : 0;
    others += apart;
  }
  std::printf("%s: the doctor agrees in %d of %d\n%s", fault.name.c_str(), agreed, count,
              others.c_str());
  benches += count;
  agreements += agreed;
  EXPECT_GT(2 * agreed, count) << others;
}

INSTANTIATE_TEST_SUITE_P(Faults, Benches, testing::ValuesIn(bench_faults()),
                         [](const auto& p) { return p.param.name; });

}  // namespace
}  // namespace drape::capture
