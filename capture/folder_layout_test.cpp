// SPDX-License-Identifier: Apache-2.0
#include "capture/capture.hpp"

#include <gmock/gmock.h>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/paths.hpp"

namespace drape::capture {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Layout : public testing::Test {
 protected:
  void add(const std::string& file) { write_durable(folder() / file, "x"); }
  [[nodiscard]] std::filesystem::path folder() const { return temporary_.path(); }

  std::string refusal() {
    const Error error =
        test::error_of([&] { return require_same_cameras(folder(), read_layout(folder())); });
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }

 private:
  test::TemporaryFolder temporary_;
};

TEST_F(Layout, ListsSetsAndCamerasInNaturalOrder) {
  for (const char* file : {"s10/cam2.PNG", "s10/cam10.jpeg", "s2/cam10.tif", "s2/cam2.tiff"})
    add(file);
  const FolderLayout layout = read_layout(folder());
  ASSERT_EQ(layout.sets.size(), 2U);
  EXPECT_EQ(layout.sets[0].name, "s2");
  EXPECT_EQ(layout.sets[1].frames[0].file, "s10/cam2.PNG");
  EXPECT_THAT(require_same_cameras(folder(), layout), ElementsAre("cam2", "cam10"));
  EXPECT_THAT(image_files_below(folder()),
              ElementsAre("s2/cam2.tiff", "s2/cam10.tif", "s10/cam2.PNG", "s10/cam10.jpeg"));
}

/// A recording that contained one of these names could not be read.
TEST_F(Layout, RefusesNamesThatNoReaderTakes) {
  for (const std::string& file :
       {std::string("-5/cam0.png"), std::string("s1/-a.png"),
        "s1/" + std::string(198, 'c') + ".png", std::string(201, 's') + "/cam0.png"}) {
    add(file);
    EXPECT_THROW(static_cast<void>(read_layout(folder())), Error) << file;
    std::filesystem::remove_all(folder() / file.substr(0, file.find('/')));
  }
}

TEST_F(Layout, ListsWhatItIgnoresWithAReason) {
  for (const char* file : {"s1/cam0.png", "s1/notes.txt", "readme.md", "s1/.hidden.png",
                           "recording.json", "recording.run.json"}) {
    add(file);
  }
  const FolderLayout layout = read_layout(folder());
  ASSERT_EQ(layout.ignored.size(), 2U);
  EXPECT_EQ(layout.ignored[0].file, "readme.md");
  EXPECT_EQ(layout.ignored[1].file, "s1/notes.txt");
  EXPECT_EQ(layout.sets[0].frames.size(), 1U);
}

TEST_F(Layout, NamesTheMissingCamera) {
  for (const char* file : {"s1/cam0.png", "s1/cam1.png", "s2/cam0.png"}) add(file);
  EXPECT_THAT(refusal(), HasSubstr("set `s2` has no image of camera `cam1`"));
}

TEST_F(Layout, NamesTwoImagesOfOneCamera) {
  for (const char* file : {"s1/cam0.jpg", "s1/cam0.l.png", "s1/cam0.png"}) add(file);
  EXPECT_THAT(refusal(), HasSubstr("s1/cam0.jpg and s1/cam0.png"));
}

TEST_F(Layout, RefusesAFolderWithoutSets) {
  EXPECT_THAT(refusal(), HasSubstr("holds no set of images"));
  add("cam0.png");
  EXPECT_THAT(refusal(), HasSubstr("holds no set of images"));
}

TEST_F(Layout, RefusesASetWithoutImages) {
  add("s1/cam0.png");
  add("s2/cam0.bmp");
  EXPECT_THAT(refusal(), HasSubstr("the set holds no image"));
}

TEST_F(Layout, RefusesNamesThatBreakLists) {
  add("a,b/cam0.png");
  EXPECT_THAT(refusal(), HasSubstr("`a,b` cannot be a name"));
}

TEST_F(Layout, TakesEveryNameThatAFileCanHold) {
  for (const char* file : {"Stoff 1 wei\u00df/Kamera \u00e4.png", "(2) #1/Kamera \u00e4.png"})
    add(file);
  EXPECT_THAT(require_same_cameras(folder(), read_layout(folder())), ElementsAre("Kamera \u00e4"));
  add("wei\xdf/cam.png");
  EXPECT_THAT(refusal(), HasSubstr("is not UTF-8"));
}

TEST_F(Layout, RefusesAnAbsentFolder) {
  EXPECT_THROW(static_cast<void>(read_layout(folder() / "nothing")), Error);
}

}  // namespace
}  // namespace drape::capture
