// SPDX-License-Identifier: Apache-2.0
// Real photographs with tags: the AprilTag project's test pictures and its own answers.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "detect/dots/noise.hpp"
#include "detect/image/image.hpp"
#include "detect/tags/tags.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {

using namespace detect;

namespace {

namespace fs = std::filesystem;

struct KnownTag {
  int id = 0;
  std::array<Eigen::Vector2d, 4> corners_px;
};

/// Lines "id, (x y), (x y), (x y), (x y)"; pixel centres there lie at +0.5.
std::vector<KnownTag> read_answers(const fs::path& file) {
  std::vector<KnownTag> tags;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    KnownTag tag;
    std::array<double, 8> v = {};
    if (std::sscanf(line.c_str(), "%d, (%lf %lf), (%lf %lf), (%lf %lf), (%lf %lf)", &tag.id, &v[0],
                    &v[1], &v[2], &v[3], &v[4], &v[5], &v[6], &v[7]) != 9) {
      continue;
    }
    for (int k = 0; k < 4; ++k) tag.corners_px[k] = {v[2 * k] - 0.5, v[2 * k + 1] - 0.5};
    tags.push_back(tag);
  }
  return tags;
}

/// Largest distance between corners, in the best of four turns and two senses of numbering.
double corner_distance(const KnownTag& known, const TagDetection& found) {
  double best = 1e9;
  for (const int sense : {1, 3}) {
    for (int turn = 0; turn < 4; ++turn) {
      double largest = 0;
      for (int k = 0; k < 4; ++k) {
        const Eigen::Vector2d other = found.corners_px.col((turn + sense * k) % 4);
        largest = std::max(largest, (known.corners_px[k] - other).norm());
      }
      best = std::min(best, largest);
    }
  }
  return best;
}

TEST(TagPhotos, AllTagsOfThreePhotographsAndNoOther) {
  DRAPE_REQUIRE_REFERENCE(folder, "apriltag-photos");
  TagFinder finder("tag36h11");
  for (const auto& [name, count] :
       {std::pair("33369213973_9d9bb4cc96_c", 12U), std::pair("34085369442_304b6bafd9_c", 25U),
        std::pair("34139872896_defdb2f8d9_c", 10U)}) {
    const cv::Mat picture =
        cv::imread((folder / (std::string(name) + ".jpg")).string(), cv::IMREAD_GRAYSCALE);
    GreyImage image{picture.cols, picture.rows, {}, {}};
    image.bytes.assign(picture.datastart, picture.dataend);
    const std::vector<KnownTag> known = read_answers(folder / (std::string(name) + ".txt"));
    ASSERT_EQ(known.size(), count);
    const std::vector<TagDetection> found =
        finder.find_all(image, estimate_noise(image).sigma(128));
    EXPECT_EQ(found.size(), count) << name;
    for (const KnownTag& tag : known) {
      double nearest = 1e9;
      for (const TagDetection& candidate : found) {
        if (candidate.id == tag.id) nearest = std::min(nearest, corner_distance(tag, candidate));
      }
      // The published corners are those of the library without refined edges, as used here.
      EXPECT_LE(nearest, 0.2) << name << ": tag at " << tag.corners_px[0].transpose();
    }
  }
}

}  // namespace
}  // namespace drape::test
