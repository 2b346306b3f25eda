// SPDX-License-Identifier: Apache-2.0
#include "core/files/picture_layout.hpp"

#include <gmock/gmock.h>

#include <filesystem>

#include "core/files/files.hpp"
#include "tests/support/paths.hpp"

namespace drape {
namespace {

using testing::ElementsAre;

/// "camera|view" of each name.
std::vector<std::string> read(const std::vector<std::string>& names) {
  std::vector<std::string> texts;
  for (const PictureName& name : read_picture_names(names))
    texts.push_back(name.camera + "|" + name.view);
  return texts;
}

TEST(PictureNames, TheViewIsTheNumberThatChangesMost) {
  EXPECT_THAT(read({"left01", "right01", "left02"}), ElementsAre("left|01", "right|01", "left|02"));
  EXPECT_THAT(read({"cam1_01_int", "cam1_02_int", "cam2_03_int"}),
              ElementsAre("cam1_int|01", "cam1_int|02", "cam2_int|03"));
  EXPECT_THAT(read({"007-left", "008-left"}), ElementsAre("left|007", "left|008"));
  EXPECT_THAT(read({"IMG_20240501_101", "IMG_20240501_102"}),
              ElementsAre("IMG_20240501|101", "IMG_20240501|102"));
  EXPECT_THAT(read({"1", "2"}), ElementsAre("|1", "|2"));
}

TEST(PictureNames, NumbersAreComparedAsNumbers) {
  EXPECT_THAT(read({"left1", "left2", "right01", "right02"}),
              ElementsAre("left|1", "left|2", "right|1", "right|2"));
  EXPECT_THAT(read({"img2", "img10"}), ElementsAre("img|02", "img|10"));
  EXPECT_THAT(read({"img002", "img010"}), ElementsAre("img|002", "img|010"));
  EXPECT_THAT(read({"0", "000"}), ElementsAre("|0", "|0"));
}

TEST(PictureNames, ATimeIsOneNumberAndAViewWhereNothingElseIs) {
  EXPECT_THAT(read({"Image__2018-09-17__16-38-56", "Image__2018-09-17__16-38-57",
                    "Image__2018-09-17__16-39-00"}),
              ElementsAre("Image|20180917163856", "Image|20180917163857", "Image|20180917163900"));
  EXPECT_THAT(read({"IMG_20181231_235959", "IMG_20190101_000001"}),
              ElementsAre("IMG|20181231235959", "IMG|20190101000001"));
  EXPECT_THAT(read({"cam0_20180917_163856123_0001", "cam1_20180917_163856130_0001",
                    "cam0_20180917_163901123_0002", "cam1_20180917_163901129_0002"}),
              ElementsAre("cam0|0001", "cam1|0001", "cam0|0002", "cam1|0002"));
}

TEST(PictureNames, NamesOfSeveralFormsEndWithTheirView) {
  EXPECT_THAT(read({"cam1-3", "side-4"}), ElementsAre("cam1|3", "side|4"));
  EXPECT_THAT(read({"first", "side-4"}), ElementsAre("|first", "side|4"));
}

TEST(PictureLayout, FoldersOfCamerasMayCountWithOtherWidths) {
  const test::TemporaryFolder folder;
  for (const char* file :
       {"cam0/frame1.png", "cam0/frame2.png", "cam1/frame00001.png", "cam1/frame00002.png"}) {
    std::filesystem::create_directories((folder.path() / file).parent_path());
    write_durable(folder.path() / file, "");
  }
  std::vector<std::string> sets;
  for (const PlacedPicture& one : placed_pictures(folder.path(), PictureLayout::cameras))
    sets.push_back(one.camera + "|" + one.set);
  EXPECT_THAT(sets, ElementsAre("cam0|view_1", "cam0|view_2", "cam1|view_1", "cam1|view_2"));
}

}  // namespace
}  // namespace drape
