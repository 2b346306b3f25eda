// SPDX-License-Identifier: Apache-2.0
#include "front/picture_names.hpp"

#include <gmock/gmock.h>

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

TEST(PictureNames, NamesOfSeveralFormsEndWithTheirView) {
  EXPECT_THAT(read({"cam1-3", "side-4"}), ElementsAre("cam1|3", "side|4"));
  EXPECT_THAT(read({"first", "side-4"}), ElementsAre("|first", "side|4"));
}

}  // namespace
}  // namespace drape
