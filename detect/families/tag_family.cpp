// SPDX-License-Identifier: Apache-2.0
#include "detect/families/tag_family.hpp"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.hpp"

namespace drape::detect {
namespace {

constexpr int kMostBorder = 4;

struct Maker {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

constexpr std::array<Maker, 5> kMakers = {
    {{"tag36h11", tag36h11_create, tag36h11_destroy},
     {"tag36h10", tag36h10_create, tag36h10_destroy},
     {"tag25h9", tag25h9_create, tag25h9_destroy},
     {"tag16h5", tag16h5_create, tag16h5_destroy},
     {"tagStandard41h12", tagStandard41h12_create, tagStandard41h12_destroy}}};

const Maker& maker_of(const std::string& name) {
  std::string known;
  for (const Maker& maker : kMakers) {
    if (name == maker.name) return maker;
    known += (known.empty() ? "" : ", ") + std::string(maker.name);
  }
  throw bad_input(fmt::format("the tag family `{}` is not known", name), {.field = "tags.family"},
                  "use one of " + known +
                      "; OpenCV prints all but the last as DICT_APRILTAG_..., its own "
                      "dictionaries such as DICT_4X4_50 are not read");
}

using Family = std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)>;

/// The library's family with its bits moved inwards.
Family family_with_border(const std::string& name, int border_modules) {
  const Maker& maker = maker_of(name);
  Family family(maker.create(), maker.destroy);
  if (border_modules < 1 || border_modules > kMostBorder ||
      (border_modules > 1 && family->reversed_border)) {
    throw bad_input(
        fmt::format("tags of the family {} cannot have a rim of {} modules", name, border_modules),
        {.field = "tags.border_modules"}, "give 1, or 2 for Kalibr's grids");
  }
  const int more = border_modules - 1;
  family->width_at_border += 2 * more;
  family->total_width += 2 * more;
  for (std::uint32_t k = 0; k < family->nbits; ++k) {
    family->bit_x[k] += more;
    family->bit_y[k] += more;
  }
  return family;
}

/// The library numbers corners from the upper right, anticlockwise as one reads the tag, and puts
/// pixel centres at +0.5; drapebench has them at integers.
Eigen::Matrix<double, 2, 4> reading_order(const apriltag_detection_t& found) {
  constexpr std::array<int, 4> kSource = {1, 0, 3, 2};
  Eigen::Matrix<double, 2, 4> corners;
  for (int k = 0; k < 4; ++k)
    corners.col(k) << found.p[kSource[k]][0] - 0.5, found.p[kSource[k]][1] - 0.5;
  return corners;
}

}  // namespace

struct TagFamily::State {
  Family family;
};

TagFamily::TagFamily(const std::string& name, int border_modules)
    : state_(std::make_unique<State>(State{family_with_border(name, border_modules)})) {}

TagFamily::~TagFamily() = default;

int TagFamily::count() const {
  return static_cast<int>(state_->family->ncodes);
}

int TagFamily::edge_modules() const {
  return state_->family->width_at_border;
}

int TagFamily::total_modules() const {
  return state_->family->total_width;
}

bool TagFamily::black(int id, int x, int y) const {
  const apriltag_family_t& family = *state_->family;
  // The library's own pictures are upside down beside what OpenCV draws and detectors read.
  const int rim = (family.total_width - family.width_at_border) / 2;
  const int column = family.total_width - 1 - x - rim, row = family.total_width - 1 - y - rim;
  for (std::uint32_t k = 0; k < family.nbits; ++k) {
    if (static_cast<int>(family.bit_x[k]) != column || static_cast<int>(family.bit_y[k]) != row)
      continue;
    return (family.codes[id] >> (family.nbits - 1 - k) & 1U) == 0;
  }
  const int side = family.width_at_border;
  const bool inside = column >= 0 && row >= 0 && column < side && row < side;
  if (!family.reversed_border) return inside;
  // Such a family has a white ring in its square's rim and is black wherever no bit lies.
  const bool within = column > 0 && row > 0 && column < side - 1 && row < side - 1;
  return !inside || within;
}

std::vector<TagDetection> TagFamily::find(const GreyImage& image, double noise_sigma) const {
  const std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)> detector(
      apriltag_detector_create(), apriltag_detector_destroy);
  apriltag_detector_add_family_bits(detector.get(), state_->family.get(), 1);
  detector->nthreads = 1;
  detector->quad_decimate = 1.0F;
  detector->refine_edges = true;
  // Below this difference sensor noise passes the library's threshold.
  detector->qtp.min_white_black_diff =
      std::clamp(static_cast<int>(std::ceil(6.0 * noise_sigma)), 5, 60);
  // The library only reads the picture.
  image_u8_t view = {image.width_px, image.height_px, image.width_px,
                     const_cast<std::uint8_t*>(image.bytes.data())};
  zarray_t* found = apriltag_detector_detect(detector.get(), &view);
  std::vector<TagDetection> tags;
  for (int k = 0; k < zarray_size(found); ++k) {
    apriltag_detection_t* tag = nullptr;
    zarray_get(found, k, static_cast<void*>(&tag));
    tags.push_back({tag->id, reading_order(*tag)});
  }
  apriltag_detections_destroy(found);
  std::stable_sort(tags.begin(), tags.end(),
                   [](const TagDetection& a, const TagDetection& b) { return a.id < b.id; });
  return tags;
}

}  // namespace drape::detect
