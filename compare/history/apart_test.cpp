// SPDX-License-Identifier: Apache-2.0

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

class Apart : public testing::Test {
 protected:
  /// Writes a case of a study, with its record or interrupted before it.
  void write_case(const std::string& name, double height_m, bool ended) {
    const fs::path sheet = study_ / name / "sheet.ply";
    write_sheet(sheet, test::simulated_sheet(5, 1, [height_m](const Eigen::Vector2d& m) {
                  return Eigen::Vector3d(test::flat(m) + Eigen::Vector3d(0, 0, height_m));
                }));
    if (ended)
      RunRecord("drape-simulate", {"study", "--key", name}, run_record_path(sheet)).write(0);
  }
  ApartCounts import() { return import_simulations(store_, files_in({study_}).sheets); }
  [[nodiscard]] std::string count(const std::string& table) const {
    return StoreReader(store_).query("SELECT count(*) FROM " + table).rows[0][0];
  }

  drape::test::TemporaryFolder folder_;
  fs::path study_ = folder_.path() / "study", store_ = folder_.path() / "store.sqlite";
};

TEST_F(Apart, TakesSheetsThatNoTableCouldTellApartAndLeavesOutWhatHasNotEnded) {
  write_case("a", 0, true);
  write_case("b", 1e-3, true);
  write_case("c", 2e-3, false);
  const ApartCounts first = import();
  EXPECT_EQ(first.added, 2);
  EXPECT_EQ(first.unfinished, 1U);
  EXPECT_EQ(count("simulation"), "2");
  EXPECT_EQ(count("simulation_pair"), "0");
  write_case("c", 2e-3, true);
  const ApartCounts again = import();
  EXPECT_EQ(again.added, 1);
  EXPECT_EQ(again.present, 2);
  EXPECT_THAT(verify_store(store_).findings, testing::IsEmpty());
}

TEST_F(Apart, RefusesWhatIsNotWhatItsRunWrote) {
  for (const char* name : {"a", "b"}) {
    write_case(name, name[0] * 1e-5, false);
    const fs::path certificate = study_ / name / "certificate.json";
    write_durable(
        certificate,
        std::string("{\"schema\": \"drapebench/certificate/1\", \"of\": \"") + name + "\"}\n");
    RunRecord record("drape-simulate", {"study", "--key", name},
                     run_record_path(study_ / name / "sheet.ply"));
    for (const char* file : {"sheet.ply", "sheet.json", "certificate.json"})
      record.output(study_ / name / file);
    record.write(0);
  }
  const std::string own = read_text(study_ / "a" / "certificate.json");
  const auto refusal = [&] {
    try {
      (void)import();
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  fs::copy(study_ / "b" / "certificate.json", study_ / "a", fs::copy_options::overwrite_existing);
  EXPECT_THAT(refusal(), testing::HasSubstr("a/certificate.json"));
  write_durable(study_ / "a" / "certificate.json", own);
  const std::string sheet = read_text(study_ / "a" / "sheet.json");
  fs::remove(study_ / "a" / "sheet.json");
  EXPECT_THAT(refusal(), testing::HasSubstr("the sheet of a run is gone"));
  write_durable(study_ / "a" / "sheet.json", sheet);
  EXPECT_EQ(refusal(), "");
  EXPECT_EQ(count("simulation"), "2");
}

TEST_F(Apart, RefusesASheetWhoseNoGoItCouldNotKeep) {
  write_case("a", 0, true);
  Sheet sheet = read_sheet(study_ / "a" / "sheet.ply");
  sheet.no_go = "cam1 moved";
  write_sheet(study_ / "a" / "sheet.ply", sheet);
  EXPECT_THROW((void)import(), Error);
}

TEST_F(Apart, RefusesAMeasuredSheet) {
  write_sheet(study_ / "sheet.ply", test::measured_sheet());
  RunRecord("drape-triangulate", {}, run_record_path(study_ / "sheet.ply")).write(0);
  EXPECT_THROW((void)import(), Error);
}

// The sheets and the calibration of tests/data/files-0.1 are those of store_v4.sqlite: what 0.1.0
// wrote and stored must read the same today as the content of its migrated store.
TEST(FilesOf01, AreWhatTheMigratedStoreOf01Holds) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "old.sqlite";
  fs::copy_file(drape::test::source_root() / "compare/test_data/store_v4.sqlite", file);
  const fs::path files = drape::test::source_root() / "tests/data/files-0.1";
  const Session session = read_session({files / "11-1/sheet.ply", files / "11-5/sheet.ply"}, {});
  ASSERT_EQ(session.virtual_only.size(), 1U);
  std::vector<fs::path> sheets;
  for (const char* name : {"11-1", "11-5"}) {
    fs::copy(files / name, folder.path() / name);
    sheets.push_back(folder.path() / name / "sheet.ply");
    RunRecord("drape-simulate", {}, run_record_path(sheets.back())).write(0);
  }
  const ApartCounts counts = import_simulations(file, sheets);
  EXPECT_EQ(counts.added, 0);
  EXPECT_EQ(counts.present, 2);
  for (const Simulation& simulation : session.virtual_only[0]) {
    EXPECT_EQ(simulation.source().status, "at rest");
    ASSERT_TRUE(simulation.certificate);
    EXPECT_EQ(StoreReader(file)
                  .query("SELECT certificate_sha256 FROM simulation WHERE sheet_sha256 = ?",
                         {simulation.sheet.sha256})
                  .rows,
              (std::vector<std::vector<std::string>>{{simulation.certificate->sha256}}));
  }
  const Calibration calibration = read_calibration(files / "calibration.json");
  const auto cameras =
      StoreReader(file)
          .query(
              "SELECT camera, rms_px FROM calibration_camera WHERE calibration_sha256 = ? ORDER BY "
              "camera",
              {sha256_of_file(files / "calibration.json")})
          .rows;
  ASSERT_EQ(cameras.size(), calibration.cameras.size());
  ASSERT_GE(cameras.size(), 3U);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    EXPECT_EQ(cameras[i][0], calibration.cameras[i].camera.name);
    EXPECT_EQ(std::stod(cameras[i][1]), calibration.cameras[i].residuals.rms_px);
  }
}

}  // namespace
}  // namespace drape::compare
