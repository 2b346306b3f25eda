// SPDX-License-Identifier: Apache-2.0
#include "detect/image/image.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "core/files/files.hpp"
#include "core/pictures/picture.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {

using namespace detect;

namespace {

using ::testing::HasSubstr;

const Where kWhere{.file = "recording/drape_A/cam1.png", .camera = "cam1", .set = "drape_A"};

std::vector<unsigned char> encoded(const cv::Mat& picture, const char* format = ".png") {
  std::vector<unsigned char> bytes;
  cv::imencode(format, picture, bytes);
  return bytes;
}

std::string complaint(const std::vector<unsigned char>& bytes, int width, int height) {
  try {
    (void)decode_image(bytes, width, height, kWhere);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_EQ(error.where().camera, "cam1");
    EXPECT_EQ(error.where().set, "drape_A");
    EXPECT_FALSE(error.what_to_do().empty());
    return error.what();
  }
  return {};
}

TEST(DecodeImage, ReadsGreyColourAndSixteenBit) {
  const cv::Mat grey(6, 8, CV_8U, cv::Scalar(77));
  EXPECT_EQ(decode_image(encoded(grey), 8, 6, kWhere).level(3, 2), 77.0F);
  const cv::Mat colour(6, 8, CV_8UC3, cv::Scalar(90, 90, 90));
  EXPECT_EQ(decode_image(encoded(colour), 8, 6, kWhere).level(7, 5), 90.0F);
  const cv::Mat deep(6, 8, CV_16U, cv::Scalar(1000));
  const GreyImage image = decode_image(encoded(deep), 8, 6, kWhere);
  EXPECT_NEAR(image.level(0, 0), 1000 * 255.0 / 65535, 1e-4);
}

/// The same JPEG with an EXIF orientation, as phones write it.
std::vector<unsigned char> with_orientation(std::vector<unsigned char> jpeg, unsigned char turn) {
  const std::vector<unsigned char> exif = {
      0xFF, 0xE1, 0, 34, 'E', 'x', 'i', 'f', 0, 0,           // APP1
      'M',  'M',  0, 42, 0,   0,   0,   8,   0, 1,           // TIFF, one entry
      0x01, 0x12, 0, 3,  0,   0,   0,   1,   0, turn, 0, 0,  // Orientation
      0,    0,    0, 0};
  jpeg.insert(jpeg.begin() + 2, exif.begin(), exif.end());
  return jpeg;
}

// A lens is calibrated in the sensor's pixels, so the orientation that a camera writes into its
// pictures must not rotate them.
TEST(DecodeImage, KeepsTheSensorsPixelsWhateverTurnExifAsksFor) {
  cv::Mat grey(16, 24, CV_8U, cv::Scalar(40));
  grey(cv::Rect(0, 0, 8, 8)).setTo(220);
  const std::vector<unsigned char> plain = encoded(grey, ".jpg");
  const std::vector<std::uint8_t> expected = decode_image(plain, 24, 16, kWhere).bytes;
  for (unsigned char turn = 2; turn <= 8; ++turn) {
    const std::vector<unsigned char> turned = with_orientation(plain, turn);
    // The picture does request a rotation: a reader that obeys it sees another picture.
    const cv::Mat obeyed = cv::imdecode(turned, cv::IMREAD_GRAYSCALE);
    EXPECT_TRUE(obeyed.rows != 16 || obeyed.at<std::uint8_t>(2, 2) < 100) << int{turn};
    EXPECT_EQ(decode_image(turned, 24, 16, kWhere).bytes, expected) << int{turn};
  }
}

TEST(DecodeImage, RefusesWhatIsNoImageOfTheCamera) {
  const cv::Mat grey(6, 8, CV_8U, cv::Scalar(77));
  EXPECT_THAT(complaint(encoded(grey), 8, 7), HasSubstr("8x6 px, the rig's camera has 8x7 px"));
  EXPECT_THAT(complaint(encoded(grey, ".tiff"), 9, 6), HasSubstr("8x6 px"));
  EXPECT_THAT(complaint({}, 8, 6), HasSubstr("not a readable image"));
  EXPECT_THAT(complaint({'n', 'o', 't', ' ', 'a', 'n', ' ', 'i', 'm', 'a', 'g', 'e'}, 8, 6),
              HasSubstr("not a readable image"));
  const cv::Mat real(6, 8, CV_32F, cv::Scalar(0.5));
  EXPECT_THAT(complaint(encoded(real, ".tiff"), 8, 6), HasSubstr("neither 8 nor 16 bit"));
}

/// A grey TIFF without compression, black 40 with a square of 220 at its upper left, 16 x 8 px.
std::vector<unsigned char> tiff(bool big_endian, int bits, int photometric, int orientation) {
  std::vector<unsigned char> bytes;
  const auto put = [&](std::uint32_t value, int width) {
    for (int i = 0; i < width; ++i)
      bytes.push_back(static_cast<unsigned char>(value >> (8 * (big_endian ? width - 1 - i : i))));
  };
  const int pixels = 16 * 8;
  bytes = big_endian ? std::vector<unsigned char>{'M', 'M'} : std::vector<unsigned char>{'I', 'I'};
  put(42, 2), put(8, 4);
  const std::pair<int, std::uint32_t> tags[] = {{256, 16},          {257, 8},
                                                {258, bits},        {259, 1},
                                                {262, photometric}, {273, 8 + 2 + 12 * 10 + 4},
                                                {274, orientation}, {277, 1},
                                                {278, 8},           {279, pixels * bits / 8}};
  put(std::size(tags), 2);
  for (const auto& [tag, value] : tags) {
    const bool is_long = tag == 273 || tag == 279;
    put(tag, 2), put(is_long ? 4 : 3, 2), put(1, 4);
    put(value, is_long ? 4 : 2);
    if (!is_long) put(0, 2);
  }
  put(0, 4);
  for (int i = 0; i < pixels; ++i)
    put(i % 16 < 4 && i < 64 ? (bits == 8 ? 220 : 56540) : (bits == 8 ? 40 : 10280), bits / 8);
  return bytes;
}

TEST(DecodeImage, KeepsTheSensorsPixelsOfATiffWhateverItsOrientation) {
  for (const bool big_endian : {false, true})
    for (const int bits : {8, 16})
      for (int turn = 1; turn <= 8; ++turn) {
        const GreyImage image = decode_image(tiff(big_endian, bits, 1, turn), 16, 8, kWhere);
        EXPECT_EQ(image.level(1, 1), 220.0F) << bits << " " << turn;
        EXPECT_EQ(image.level(14, 1), 40.0F) << bits << " " << turn;
        EXPECT_EQ(image.level(1, 6), 40.0F) << bits << " " << turn;
        EXPECT_EQ(orientation_of(tiff(big_endian, bits, 1, turn)), turn);
      }
  EXPECT_EQ(orientation_of(encoded(cv::Mat(6, 8, CV_8U, cv::Scalar(77)))), 1);
  EXPECT_EQ(
      orientation_of(with_orientation(encoded(cv::Mat(6, 8, CV_8U, cv::Scalar(77)), ".jpg"), 6)),
      6);
}

TEST(DecodeImage, RefusesOtherMeaningsOfTheNumbers) {
  for (const int bits : {8, 16})
    for (const bool big_endian : {false, true})
      EXPECT_THAT(complaint(tiff(big_endian, bits, 0, 1), 16, 8), HasSubstr("WhiteIsZero"));
  EXPECT_THAT(complaint(tiff(false, 8, 5, 1), 16, 8), HasSubstr("inks"));
  EXPECT_THAT(complaint(tiff(false, 8, 32803, 1), 16, 8), HasSubstr("mosaic"));
  for (const char* format : {".png", ".tiff"}) {
    cv::Mat picture(6, 8, CV_8UC4, cv::Scalar(90, 90, 90, 255));
    EXPECT_EQ(decode_image(encoded(picture, format), 8, 6, kWhere).level(7, 5), 90.0F);
    picture.at<cv::Vec4b>(2, 3)[3] = 0;
    EXPECT_THAT(complaint(encoded(picture, format), 8, 6), HasSubstr("transparent"));
  }
}

/// The decoder would return the first page without an error.
TEST(DecodeImage, RefusesATiffOfSeveralPages) {
  const cv::Mat first(6, 8, CV_8U, cv::Scalar(77)), second(6, 8, CV_8U, cv::Scalar(200));
  const TemporaryFolder folder;
  const auto pages = [&](const std::vector<cv::Mat>& all) {
    cv::imwritemulti((folder.path() / "pages.tiff").string(), all);
    return read_bytes(folder.path() / "pages.tiff");
  };
  EXPECT_EQ(complaint(pages({first}), 8, 6), "");
  EXPECT_THAT(complaint(pages({first, second}), 8, 6), HasSubstr("the TIFF has several pages"));
  // A BigTIFF: its directory at 16 has no entries and refers to another at 99.
  std::vector<unsigned char> big(40);
  for (const auto& [at, byte] : {std::pair(0, 'I'), {1, 'I'}, {2, 43}, {4, 8}, {8, 16}, {24, 99}})
    big[at] = static_cast<unsigned char>(byte);
  EXPECT_THAT(complaint(big, 8, 6), HasSubstr("the TIFF has several pages"));
}

TEST(DecodeImage, NeverCrashesOnSpoiltBytes) {
  // Any bytes must give an image of the requested size or one Error.
  const auto good = read_bytes(source_root() / "rigs/bench1/recording/drape_A/cam0.png");
  std::mt19937 random(11);
  int refused = 0;
  for (int k = 0; k < 40; ++k) {
    std::vector<unsigned char> bytes = good;
    if (k % 2 == 0) {
      bytes.resize(random() % bytes.size());
    } else {
      bytes[random() % 2000] ^= static_cast<unsigned char>(1U << (random() % 8));
    }
    try {
      EXPECT_EQ(decode_image(bytes, 1600, 1200, kWhere).bytes.size(), 1600U * 1200U);
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GE(refused, 20);
}

TEST(Noise, IsReadFromTheFrameWithItsDependenceOnBrightness) {
  // Variance 1 + level / 50 on a ramp from 20 to 220.
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0, 1);
  GreyImage image{800, 400, std::vector<std::uint8_t>(800 * 400), {}};
  for (int y = 0; y < 400; ++y) {
    for (int x = 0; x < 800; ++x) {
      const double level = 20 + 0.25 * x;
      const double noisy = level + std::sqrt(1 + level / 50) * normal(random);
      image.bytes[y * 800 + x] = static_cast<std::uint8_t>(std::lround(noisy));
    }
  }
  const NoiseModel noise = estimate_noise(image);
  for (const double level : {40.0, 128.0, 200.0}) {
    // Rounding adds 1/12; medians of some thousand samples per band have 3 % error in sigma.
    EXPECT_NEAR(noise.sigma(level), std::sqrt(1 + level / 50 + 1.0 / 12),
                0.08 * noise.sigma(level));
  }
}

TEST(Noise, AFlatFrameHasAtLeastItsRounding) {
  const GreyImage image{100, 100, std::vector<std::uint8_t>(100 * 100, 90), {}};
  EXPECT_GE(estimate_noise(image).variance(90), 1.0 / 12 - 1e-12);
}

TEST(Preview, IsDeterministic) {
  const GreyImage image{64, 48, std::vector<std::uint8_t>(64 * 48, 120), {}};
  EXPECT_EQ(half_scale_jpeg(image), half_scale_jpeg(image));
  const cv::Mat half = cv::imdecode(half_scale_jpeg(image), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(half.cols, 32);
  EXPECT_EQ(half.rows, 24);
}

}  // namespace
}  // namespace drape::test
