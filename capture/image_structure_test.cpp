// SPDX-License-Identifier: Apache-2.0
#include "capture/capture.hpp"

#include <gmock/gmock.h>

#include "capture/test_images.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/paths.hpp"

namespace drape::capture {
namespace {

using test::image_bytes;

struct Kind {
  std::string ending;
  ImageFormat format;
};

void PrintTo(const Kind& kind, std::ostream* out) {
  *out << kind.ending;
}

class ImageStructure : public testing::TestWithParam<Kind> {};

TEST_P(ImageStructure, AcceptsAWholeImageAndLearnsItsSize) {
  const auto bytes = image_bytes(GetParam().ending, 3, 321, 123);
  EXPECT_EQ(image_format(bytes), GetParam().format);
  EXPECT_EQ(structure_fault(GetParam().format, bytes), std::nullopt);
  EXPECT_EQ(check_image(bytes, {}), (ImageSize{321, 123}));
}

TEST(ImageCheck, RefusesNumbersThatDetectionDoesNotRead) {
  std::vector<unsigned char> bytes;
  ASSERT_TRUE(cv::imencode(".tiff", cv::Mat(20, 30, CV_32F, cv::Scalar(0.5)), bytes));
  EXPECT_THROW(static_cast<void>(check_image(bytes, {})), Error);
}

/// The decoder would return the first page without an error.
TEST(ImageCheck, RefusesATiffOfSeveralPages) {
  std::vector<unsigned char> bytes;
  const cv::Mat page(20, 30, CV_8U, cv::Scalar(90));
  ASSERT_TRUE(cv::imencode(".tiff", page, bytes));
  EXPECT_EQ(check_image(bytes, {}), (ImageSize{30, 20}));
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "two.tiff";
  ASSERT_TRUE(cv::imwritemulti(file.string(), std::vector<cv::Mat>{page, page}));
  const Error error =
      test::error_of([&] { return check_image(read_bytes(file), {.file = file.string()}); });
  EXPECT_EQ(error.what_failed(), "the TIFF has several pages");
  EXPECT_EQ(error.where().file, file.string());
}

TEST_P(ImageStructure, RefusesEveryTruncation) {
  const auto whole = image_bytes(GetParam().ending, 5);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const std::vector<unsigned char> cut(whole.begin(), whole.begin() + static_cast<long>(length));
    EXPECT_THROW(static_cast<void>(check_image(cut, {})), Error)
        << length << " of " << whole.size();
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, ImageStructure,
                         testing::Values(Kind{".png", ImageFormat::png},
                                         Kind{".jpg", ImageFormat::jpeg},
                                         Kind{".tif", ImageFormat::tiff}),
                         [](const auto& kind) { return kind.param.ending.substr(1); });

TEST(ImageStructureOfPng, RefusesEverySingleBitFlip) {
  const auto whole = image_bytes(".png", 7, 16, 12);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    auto flipped = whole;
    flipped[i] ^= static_cast<unsigned char>(1U << (i % 8));
    EXPECT_THROW(static_cast<void>(check_image(flipped, {})), Error) << "byte " << i;
  }
}

TEST(ImageStructureOfPng, SaysWhereItEnds) {
  auto bytes = image_bytes(".png", 1, 200, 200);
  bytes.resize(bytes.size() / 2);
  EXPECT_EQ(structure_fault(ImageFormat::png, bytes), "ends inside chunk IDAT");
}

TEST(ImageStructureOfJpeg, FindsTheCutThatTheDecoderHides) {
  auto bytes = image_bytes(".jpg", 1, 320, 240);
  bytes.resize(bytes.size() / 2);
  ASSERT_FALSE(cv::imdecode(bytes, cv::IMREAD_UNCHANGED).empty())
      << "the decoder reports truncation itself now";
  EXPECT_EQ(structure_fault(ImageFormat::jpeg, bytes), "ends before its end marker (EOI)");
}

TEST(ImageStructureOfJpeg, IsNotFooledByAnEndMarkerInAThumbnail) {
  // An application segment (a thumbnail) that contains FF D9, in a file cut off before its own end.
  auto bytes = image_bytes(".jpg", 1);
  const std::vector<unsigned char> thumbnail = {0xff, 0xe1, 0x00, 0x06, 0xff, 0xd8, 0xff, 0xd9};
  bytes.insert(bytes.begin() + 2, thumbnail.begin(), thumbnail.end());
  EXPECT_EQ(structure_fault(ImageFormat::jpeg, bytes), std::nullopt);
  bytes.resize(bytes.size() - 2);
  EXPECT_EQ(structure_fault(ImageFormat::jpeg, bytes), "ends before its end marker (EOI)");
}

TEST(ImageStructureOfTiff, SurvivesEverySingleByteChange) {
  // A damaged offset or count must be refused or lead to a decodable file, never to a crash.
  const auto whole = image_bytes(".tif", 2, 16, 12);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    auto changed = whole;
    changed[i] = 0xff;
    static_cast<void>(image_format(changed));
    static_cast<void>(structure_fault(ImageFormat::tiff, changed));
  }
}

TEST(ImageFormatByContent, KnowsNothingElse) {
  const std::vector<unsigned char> text = {'h', 'e', 'l', 'l', 'o'};
  EXPECT_EQ(image_format(text), std::nullopt);
  EXPECT_EQ(image_format({}), std::nullopt);
  const std::vector<unsigned char> bigtiff = {'I', 'I', 43, 0, 8, 0, 0, 0};
  EXPECT_EQ(structure_fault(ImageFormat::tiff, bigtiff),
            "is a BigTIFF; save it as plain TIFF or PNG");
}

}  // namespace
}  // namespace drape::capture
