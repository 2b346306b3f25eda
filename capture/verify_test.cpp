// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <random>

#include "capture/capture.hpp"
#include "capture/test_images.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/support/paths.hpp"

namespace drape::capture {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;

class Verify : public testing::Test {
 protected:
  void SetUp() override {
    test::write_sets(folder(), {"a", "b"}, {"cam0", "cam1"});
    static_cast<void>(import_folder(folder(), folder(), {}));
  }
  [[nodiscard]] fs::path folder() const { return temporary_.path(); }

 private:
  test::TemporaryFolder temporary_;
};

TEST_F(Verify, FindsNothingInAnIntactRecording) {
  const VerifyReport report = verify_recording(folder(), {.threads = 2});
  EXPECT_TRUE(report.good());
  EXPECT_EQ(report.sets, 2U);
  EXPECT_EQ(report.images, 4U);
}

TEST_F(Verify, ListsAllFaultsInOrder) {
  fs::remove(folder() / "a/cam1.png");
  fs::resize_file(folder() / "b/cam0.png", 100);
  const VerifyReport report = verify_recording(folder(), {.threads = 2});
  ASSERT_EQ(report.faults.size(), 2U);
  EXPECT_EQ(report.faults[0].file, "a/cam1.png");
  EXPECT_EQ(report.faults[0].set, "a");
  EXPECT_EQ(report.faults[0].camera, "cam1");
  EXPECT_EQ(report.faults[1].file, "b/cam0.png");
  EXPECT_FALSE(report.faults[1].what.empty());
}

TEST_F(Verify, ListsImagesThatTheManifestLacks) {
  test::write_bytes(folder() / "c/cam0.png", test::image_bytes(".png"));
  const VerifyReport report = verify_recording(folder(), {});
  EXPECT_TRUE(report.good());
  EXPECT_THAT(report.not_listed, ElementsAre("c/cam0.png"));
}

TEST_F(Verify, FindsEveryTruncationAndBitFlip) {
  std::mt19937 random(2026);
  const fs::path file = folder() / "b/cam1.png";
  const auto whole = read_bytes(file);
  std::uniform_int_distribution<std::size_t> place(0, whole.size() - 1);
  for (int trial = 0; trial < 100; ++trial) {
    auto spoiled = whole;
    const std::size_t at = place(random);
    if (trial % 2 == 0) {
      spoiled.resize(at);
    } else {
      spoiled[at] ^= static_cast<unsigned char>(1U << (trial % 8));
    }
    test::write_bytes(file, spoiled);
    EXPECT_EQ(verify_recording(folder(), {}).faults.size(), 1U) << "byte " << at;
  }
}

TEST_F(Verify, NeedsAManifest) {
  fs::remove(folder() / "recording.json");
  EXPECT_THROW(static_cast<void>(verify_recording(folder(), {})), Error);
}

TEST(CaptureProgram, AFolderTooManyIsRefusedAndNotLeftOut) {
  const fs::path program = test::program("drape-capture");
  if (!fs::exists(program)) GTEST_SKIP() << "missing: the program drape-capture";
  for (const char* words : {"verify a b", "import a b --out c", "import a --out c --set drape_A",
                            "--average verify a"}) {
    const int ended = std::system((program.string() + " " + words + " 2> /dev/null").c_str());
    EXPECT_EQ(WEXITSTATUS(ended), 2) << words;
  }
}

TEST(Bench1Recording, IsAsRecorded) {
  const VerifyReport report =
      verify_recording(test::source_root() / "rigs/bench1/recording", {.threads = 2});
  EXPECT_TRUE(report.good());
  EXPECT_EQ(report.sets, 23U);
  EXPECT_EQ(report.images, 69U);
  EXPECT_TRUE(report.not_listed.empty());
}

}  // namespace
}  // namespace drape::capture
