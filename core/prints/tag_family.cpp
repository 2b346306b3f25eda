// SPDX-License-Identifier: Apache-2.0
#include "core/prints/tag_family.hpp"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <opencv2/aruco/dictionary.hpp>
#include <tuple>
#include <utility>
#include <vector>

#include "core/error.hpp"
#include "core/rules.hpp"

namespace drape {
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

/// Converts OpenCV's markers to the AprilTag library's layout: bits of one quadrant, then those of
/// the other quadrants in the same order, then the central bit of an odd square.
struct Dictionary {
  apriltag_family family = {};
  std::vector<std::uint64_t> codes;
  std::vector<std::uint32_t> x, y;

  explicit Dictionary(int number) {
    const cv::Ptr<cv::aruco::Dictionary> known = cv::aruco::getPredefinedDictionary(number);
    const int side = known->markerSize;
    for (int quarter = 0; quarter < 4; ++quarter)
      for (int row = 1; row <= side / 2; ++row)
        for (int col = 1; col <= (side + 1) / 2; ++col) {
          int turned_x = col, turned_y = row;
          for (int k = 0; k < quarter; ++k)
            std::tie(turned_x, turned_y) = std::pair(side + 1 - turned_y, turned_x);
          x.push_back(turned_x);
          y.push_back(turned_y);
        }
    if (side % 2 == 1) {
      x.push_back(side / 2 + 1);
      y.push_back(side / 2 + 1);
    }
    for (int id = 0; id < known->bytesList.rows; ++id) {
      const cv::Mat bits =
          cv::aruco::Dictionary::getBitsFromByteList(known->bytesList.rowRange(id, id + 1), side);
      std::uint64_t code = 0;
      // The AprilTag library stores its tags upside down relative to OpenCV.
      for (std::size_t k = 0; k < x.size(); ++k)
        code = code << 1U | bits.at<std::uint8_t>(side - int(y[k]), side - int(x[k]));
      codes.push_back(code);
    }
    family.ncodes = static_cast<std::uint32_t>(codes.size());
    family.codes = codes.data();
    family.width_at_border = side + 2;
    family.total_width = side + 4;
    family.nbits = static_cast<std::uint32_t>(x.size());
    family.bit_x = x.data();
    family.bit_y = y.data();
    family.h = 2 * static_cast<std::uint32_t>(std::max(0, known->maxCorrectionBits)) + 1;
  }
};

std::shared_ptr<apriltag_family> family_named(const std::string& name) {
  for (const Maker& maker : kMakers)
    if (name == maker.name) return {maker.create(), maker.destroy};
  // OpenCV's dictionaries follow the AprilTag families, in the order of OpenCV's enumeration.
  std::vector<std::string> known;
  for (const auto& [family, count] : known_tag_families()) {
    known.push_back(family);
    if (name != family) continue;
    const auto dictionary =
        std::make_shared<Dictionary>(static_cast<int>(known.size() - 1 - kMakers.size()));
    return {dictionary, &dictionary->family};
  }
  throw bad_input(fmt::format("the tag family `{}` is not known", name), {.field = "tags.family"},
                  fmt::format("use one of {}; OpenCV's DICT_APRILTAG_36h11 is tag36h11",
                              fmt::join(known, ", ")));
}

}  // namespace

TagFamily::TagFamily(const std::string& name, int border_modules)
    : name_(name), family_(family_named(name)) {
  if (border_modules < 1 || border_modules > kMostBorder ||
      (border_modules > 1 && family_->reversed_border)) {
    throw bad_input(
        fmt::format("tags of the family {} cannot have a rim of {} modules", name, border_modules),
        {.field = "tags.border_modules"}, "give 1, or 2 for Kalibr's grids");
  }
  // A wider border moves the bits inwards.
  const int more = border_modules - 1;
  family_->width_at_border += 2 * more;
  family_->total_width += 2 * more;
  for (std::uint32_t k = 0; k < family_->nbits; ++k) {
    family_->bit_x[k] += more;
    family_->bit_y[k] += more;
  }
}

std::vector<std::string> TagFamily::names() {
  std::vector<std::string> names;
  for (const Maker& maker : kMakers) names.emplace_back(maker.name);
  return names;
}

int TagFamily::count() const {
  return static_cast<int>(family_->ncodes);
}

int TagFamily::edge_modules() const {
  return family_->width_at_border;
}

int TagFamily::total_modules() const {
  return family_->total_width;
}

bool TagFamily::black(int id, int x, int y) const {
  const apriltag_family& family = *family_;
  // Pictures rendered by the AprilTag library are upside down relative to OpenCV and to detectors.
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
  // Such a family has a white ring within its border and is black wherever there is no bit.
  const bool within = column > 0 && row > 0 && column < side - 1 && row < side - 1;
  return !inside || within;
}

std::vector<FaceBox> TagFamily::boxes(int id, double edge_m, const FacePoint& centre) const {
  if (id < 0 || id >= count()) {
    throw bad_input(fmt::format("the family {} has no tag {}", name_, id), {.field = "tags"},
                    fmt::format("give ids from 0 to {}", count() - 1));
  }
  const int side = total_modules();
  const double module_m = edge_m / edge_modules();
  const FacePoint corner = centre - FacePoint::Constant(module_m * side / 2);
  std::vector<FaceBox> modules;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      int run = 0;
      while (x + run < side && black(id, x + run, y)) ++run;
      if (run == 0) continue;
      modules.push_back(
          {corner + module_m * FacePoint(x, y), corner + module_m * FacePoint(x + run, y + 1)});
      x += run;
    }
  }
  return modules;
}

}  // namespace drape
