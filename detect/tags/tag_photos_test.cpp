// SPDX-License-Identifier: Apache-2.0
// Real photographs with tags: test pictures of the AprilTag project with its own results. Tags are
// drawn at these corners, and also searched for in the photographs if available.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"
#include "detect/image/image.hpp"
#include "detect/tags/tags.hpp"
#include "detect/test_pictures.hpp"
#include "tests/support/drawing.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {

using namespace detect;

namespace {

namespace fs = std::filesystem;

struct KnownTag {
  int id = 0;
  std::array<Eigen::Vector2d, 4> corners_px;
};

/// The corners in photograph `k` as the library finds them without refining edges, from the lower
/// left counter-clockwise, as the tag is read.
std::vector<KnownTag> known_tags(std::size_t k) {
  const Csv file = read_csv(
      test_data("apriltag-photos") / "corners.csv",
      {"photograph", "id", "u0_px", "v0_px", "u1_px", "v1_px", "u2_px", "v2_px", "u3_px", "v3_px"});
  std::vector<KnownTag> tags;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    const auto of = [&](std::size_t column) { return file.columns[column][i]; };
    if (of(0) != static_cast<double>(k)) continue;
    tags.push_back({static_cast<int>(of(1)),
                    {Eigen::Vector2d(of(2), of(3)), Eigen::Vector2d(of(4), of(5)),
                     Eigen::Vector2d(of(6), of(7)), Eigen::Vector2d(of(8), of(9))}});
  }
  return tags;
}

/// Black squares with white modules, on grey with a white border.
cv::Mat drawn(const std::vector<KnownTag>& tags, const TagFamily& family) {
  constexpr int kBlack = 30, kWhite = 220;
  const int modules = family.edge_modules();
  Drawing drawing(799, 533, 120);
  for (const KnownTag& tag : tags) {
    const auto& c = tag.corners_px;
    const Eigen::Matrix3d map = *square_homography({c[1], c[0], c[3], c[2]});
    const auto square = [&](int x, int y, int size, int grey) {
      std::vector<Eigen::Vector2d> corners;
      for (const auto& [u, v] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}})
        corners.push_back(
            mapped(map, Eigen::Vector2d(x + u * size - 1, y + v * size - 1) / modules));
      drawing.polygon(corners, grey);
    };
    square(0, 0, modules + 2, kWhite);
    square(1, 1, modules, kBlack);
    for (int y = 1; y <= modules; ++y)
      for (int x = 1; x <= modules; ++x)
        if (!family.black(tag.id, x, y)) square(x, y, 1, kWhite);
  }
  return drawing.picture(0.5);
}

/// Largest distance between corners, for the best of four rotations and two orders of numbering.
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

void expect_all_found(TagFinder& finder, const cv::Mat& picture, const std::vector<KnownTag>& known,
                      double limit_px, const std::string& name) {
  const GreyImage image = image_of(picture);
  const std::vector<TagDetection> found = finder.find_all(image, estimate_noise(image).sigma(128));
  EXPECT_EQ(found.size(), known.size()) << name;
  for (const KnownTag& tag : known) {
    double nearest = 1e9;
    for (const TagDetection& candidate : found) {
      if (candidate.id == tag.id) nearest = std::min(nearest, corner_distance(tag, candidate));
    }
    EXPECT_LE(nearest, limit_px) << name << ": tag at " << tag.corners_px[0].transpose();
  }
}

/// The published corners are from the library without refined edges, as used here. In a drawing
/// such an edge can be half a pixel off, and a corner by that along both of its edges.
TEST(TagPhotos, AllTagsOfThreePhotographsAndNoOther) {
  TagFinder finder("tag36h11");
  const TagFamily family("tag36h11");
  const std::array<std::pair<std::string, std::size_t>, 3> photographs = {
      {{"33369213973_9d9bb4cc96_c", 12},
       {"34085369442_304b6bafd9_c", 25},
       {"34139872896_defdb2f8d9_c", 10}}};
  const auto at_hand = reference_data("apriltag-photos");
  for (std::size_t k = 0; k < photographs.size(); ++k) {
    const auto& [name, count] = photographs[k];
    const std::vector<KnownTag> known = known_tags(k);
    ASSERT_EQ(known.size(), count);
    expect_all_found(finder, drawn(known, family), known, std::sqrt(0.5), name + ", drawn");
    if (at_hand)
      expect_all_found(finder,
                       cv::imread((*at_hand / (name + ".jpg")).string(), cv::IMREAD_GRAYSCALE),
                       known, 0.2, name);
  }
}

}  // namespace
}  // namespace drape::test
