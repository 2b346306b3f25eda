// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "capture/capture.hpp"
#include "capture/test_images.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/support/paths.hpp"

namespace drape::capture {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Replay : public testing::Test {
 protected:
  void SetUp() override {
    test::write_sets(folder(), {"set9", "set10"}, {"left", "right"});
    static_cast<void>(import_folder(folder(), folder(), {}));
  }
  [[nodiscard]] std::filesystem::path folder() const { return temporary_.path(); }

 private:
  test::TemporaryFolder temporary_;
};

TEST_F(Replay, YieldsEverySetWithTheRecordedBytes) {
  const auto source = open_replay(folder());
  EXPECT_THAT(source->cameras(), ElementsAre("left", "right"));
  std::vector<std::string> sets;
  while (const auto set = source->next()) {
    sets.push_back(set->name);
    ASSERT_EQ(set->frames.size(), 2U);
    for (const SourceFrame& frame : set->frames) {
      EXPECT_EQ(frame.bytes, read_bytes(folder() / set->name / (frame.camera + ".png")));
      EXPECT_EQ(frame.sha256, sha256_of(frame.bytes));
      EXPECT_EQ(frame.width_px, 64);
      EXPECT_EQ(frame.height_px, 48);
    }
  }
  EXPECT_THAT(sets, ElementsAre("set9", "set10"));
  EXPECT_EQ(source->next(), std::nullopt);
}

TEST_F(Replay, StopsAtAnAlteredImageWithItsName) {
  test::write_bytes(folder() / "set10/right.png", test::image_bytes(".png", 99));
  const auto source = open_replay(folder());
  EXPECT_TRUE(source->next().has_value());
  try {
    static_cast<void>(source->next());
    FAIL() << "an altered image was replayed";
  } catch (const Error& error) {
    EXPECT_EQ(error.where().set, "set10");
    EXPECT_EQ(error.where().camera, "right");
    EXPECT_THAT(error.what(), HasSubstr("right.png"));
  }
}

TEST_F(Replay, RefusesAManifestWithAnIncompleteSet) {
  Recording recording = read_recording(folder());
  recording.sets[1].frames.pop_back();
  write_recording(recording);
  EXPECT_THROW(static_cast<void>(open_replay(folder())), Error);
}

}  // namespace
}  // namespace drape::capture
