// SPDX-License-Identifier: Apache-2.0
#include "detect/tags/tags.hpp"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/error.hpp"

namespace drape::detect {
/// A family as the library makes and frees it.
struct LibraryFamily {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

namespace {

constexpr int most_wrong_bits = 2;
// A second one would triple the false ids that a fold can make up.
constexpr int most_wrong_bits_in_folds = 1;

constexpr std::array<LibraryFamily, 5> families = {{
    {"tag36h11", tag36h11_create, tag36h11_destroy},
    {"tag36h10", tag36h10_create, tag36h10_destroy},
    {"tag25h9", tag25h9_create, tag25h9_destroy},
    {"tag16h5", tag16h5_create, tag16h5_destroy},
    {"tagStandard41h12", tagStandard41h12_create, tagStandard41h12_destroy},
}};

const LibraryFamily& family_named(const std::string& name) {
  for (const LibraryFamily& family : families) {
    if (name == family.name) return family;
  }
  throw bad_input(fmt::format("the tag family \"{}\" is not known", name), {.field = "tags.family"},
                  "use tag36h11, tag36h10, tag25h9, tag16h5 or tagStandard41h12");
}

/// The library numbers corners from the upper right, anticlockwise as one reads the tag, and puts
/// pixel centres at +0.5; drapebench has them at integers.
Eigen::Matrix<double, 2, 4> reading_order(const apriltag_detection_t& found) {
  Eigen::Matrix<double, 2, 4> corners;
  constexpr std::array<int, 4> source = {1, 0, 3, 2};
  for (int k = 0; k < 4; ++k) {
    corners.col(k) << found.p[source[k]][0] - 0.5, found.p[source[k]][1] - 0.5;
  }
  return corners;
}

TagCode code_of(const apriltag_family_t& family) {
  TagCode code;
  code.modules = family.width_at_border;
  for (std::uint32_t k = 0; k < family.nbits; ++k) {
    code.bits.push_back({static_cast<int>(family.bit_x[k]), static_cast<int>(family.bit_y[k])});
  }
  code.words.assign(family.codes, family.codes + family.ncodes);
  return code;
}

}  // namespace

struct TagFinder::State {
  const LibraryFamily* family = nullptr;
  apriltag_family_t* codes = nullptr;
  apriltag_detector_t* detector = nullptr;
  TagCode code;
};

TagFinder::TagFinder(const std::string& family) : state_(std::make_unique<State>()) {
  if (family.empty()) return;
  state_->family = &family_named(family);
  state_->codes = state_->family->create();
  state_->detector = apriltag_detector_create();
  apriltag_detector_add_family_bits(state_->detector, state_->codes, most_wrong_bits);
  state_->detector->nthreads = 1;
  state_->detector->quad_decimate = 1.0F;
  // Refined edges lose tags of few pixels, and nothing is measured at a tag.
  state_->detector->refine_edges = false;
  state_->code = code_of(*state_->codes);
}

TagFinder::~TagFinder() {
  if (state_->family == nullptr) return;
  apriltag_detector_destroy(state_->detector);
  state_->family->destroy(state_->codes);
}

std::vector<TagFinder::Reading> TagFinder::read(const GreyImage& image, double noise_sigma) {
  std::vector<Reading> result;
  if (state_->family == nullptr) return result;
  // Below this difference sensor noise passes the library's threshold and costs 14 times the time.
  state_->detector->qtp.min_white_black_diff =
      std::clamp(static_cast<int>(std::ceil(6.0 * noise_sigma)), 5, 60);
  image_u8_t view = {image.width_px, image.height_px, image.width_px,
                     const_cast<std::uint8_t*>(image.bytes.data())};
  zarray_t* found = apriltag_detector_detect(state_->detector, &view);
  for (int k = 0; k < zarray_size(found); ++k) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(found, k, &detection);
    result.push_back({{detection->id, reading_order(*detection)}, detection->hamming});
  }
  apriltag_detections_destroy(found);
  return result;
}

std::vector<std::string> tag_families() {
  std::vector<std::string> names;
  names.reserve(families.size());
  for (const LibraryFamily& family : families) names.emplace_back(family.name);
  return names;
}

std::vector<TagDetection> TagFinder::find_all(const GreyImage& image, double noise_sigma) {
  std::vector<TagDetection> result;
  for (const Reading& reading : read(image, noise_sigma)) result.push_back(reading.tag);
  return result;
}

std::vector<TagDetection> TagFinder::find(const GreyImage& image, const PrintPlane& plane,
                                          double noise_sigma) {
  std::map<int, std::vector<TagDetection>> by_id;
  for (const auto& [tag, wrong_bits] : read(image, noise_sigma)) {
    if (wrong_bits > most_wrong_bits_in_folds || plane.tags.count(tag.id) == 0) continue;
    by_id[tag.id].push_back(tag);
  }
  std::vector<TagDetection> result;
  for (const auto& [id, seen] : by_id) {
    if (seen.size() == 1) result.push_back(seen.front());
  }
  return result;
}

const TagCode& TagFinder::code() const {
  return state_->code;
}

}  // namespace drape::detect
