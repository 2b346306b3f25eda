// SPDX-License-Identifier: Apache-2.0
// The detections used by a calibration are identified by the record beside calibration.json, and by
// the content of its files.
#include <gmock/gmock.h>

#include <filesystem>

#include "calib/acceptance/figures.hpp"
#include "core/files/files.hpp"
#include "core/program/run_record.hpp"
#include "tests/support/paths.hpp"

namespace drape::calib {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class Evidence : public testing::Test {
 protected:
  Evidence() {
    Detections tested;
    tested.lattice.surface = Surface::target;
    tested.lattice.rows = tested.lattice.cols = 9;
    tested.lattice.pitch_m = 0.02;
    tested.rig = "later";
    write_detections(at("tested.json"), tested);
    tested.rig = "first";
    write_detections(at("td.json"), tested);
    write_durable(at("calibration.json"), "{}");
    RunRecord record("drape-calib", {}, run_record_path(at("calibration.json")),
                     {{at("calibration.json")}, {at("td.json")}});
    record.write(0);
  }
  [[nodiscard]] fs::path at(const std::string& name) const { return folder_.path() / name; }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(Evidence, IsWhatTheRecordNames) {
  const CalibrationEvidence found = detections_behind(at("calibration.json"), at("tested.json"));
  EXPECT_EQ(found.missing, "");
  ASSERT_TRUE(found.detections);
  EXPECT_EQ(found.detections->rig, "first");
  EXPECT_EQ(found.file, at("td.json"));
}

TEST_F(Evidence, IsMissingWhereItsFileIsGoneOrAnother) {
  write_durable(at("td.json"), read_text(at("td.json")) + "\n");
  EXPECT_THAT(detections_behind(at("calibration.json"), at("tested.json")).missing,
              AllOf(HasSubstr("td.json"), HasSubstr("has another content now")));
  fs::remove(at("td.json"));
  EXPECT_THAT(detections_behind(at("calibration.json"), at("tested.json")).missing,
              AllOf(HasSubstr("td.json"), HasSubstr("is not there")));
  write_durable(at("calibration.json"), "{ }");
  EXPECT_THAT(detections_behind(at("calibration.json"), at("tested.json")).missing,
              HasSubstr("is the record of another file than calibration.json"));
  fs::remove(run_record_path(at("calibration.json")));
  EXPECT_THAT(detections_behind(at("calibration.json"), at("tested.json")).missing,
              HasSubstr("there is no calibration.run.json"));
}

TEST_F(Evidence, IsKnownByItsContentWhereverItLies) {
  fs::rename(at("td.json"), at("moved.json"));
  fs::rename(at("calibration.json"), at("renamed.json"));
  fs::rename(run_record_path(at("calibration.json")), run_record_path(at("renamed.json")));
  const CalibrationEvidence found = detections_behind(at("renamed.json"), at("moved.json"));
  ASSERT_TRUE(found.detections);
  EXPECT_EQ(found.detections->rig, "first");
}

}  // namespace
}  // namespace drape::calib
