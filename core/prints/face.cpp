// SPDX-License-Identifier: Apache-2.0
#include "core/prints/face.hpp"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/aruco/dictionary.hpp>
#include <tuple>

#include "core/scene.hpp"

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

namespace {

template <class Sheet>
void add_tags(const Sheet& sheet, int border_modules, Face& face) {
  if (sheet.tags.empty()) return;
  const TagFamily family(sheet.tag_family, border_modules);
  for (const PrintedTag& tag : sheet.tags)
    face.areas.push_back(family.boxes(tag.id, sheet.tag_edge_m, face_point(sheet, tag)));
}

void add_dots(const Print& print, Face& face) {
  for (int row = 0; row < print.rows; ++row)
    for (int col = 0; col < print.cols; ++col)
      face.discs.push_back({face_point(print, {row, col}), print.dot_diameter_m / 2, 1});
}

/// Adds dots; white ones are left blank in a black plate that ends half a pitch beyond them.
void add_dots(const Target& target, Face& face) {
  const double ink = target.dot_colour == DotColour::white ? -1 : 1;
  for (int row = 0; row < target.rows; ++row)
    for (int col = 0; col < target.cols; ++col)
      if (target.has({row, col}))
        face.discs.push_back({face_point(target, {row, col}), target.dot_diameter_m / 2, ink});
  for (const MarkId mark : target.hollow)
    face.discs.push_back({face_point(target, mark), target.hollow_diameter_m / 2, -ink});
  if (ink > 0) return;
  const FacePoint most =
      face_point(target, {0, target.cols - 1}) + FacePoint::Constant(target.pitch_m / 2);
  face.areas.push_back({{-most, most}});
}

/// Squares of a board: dark where the sum of row and column is even, with square (0, 0) between the
/// corners (0, 0) and (1, 1); on a board with tags, dark where there is no tag.
std::vector<FaceBox> squares_of(const Target& target) {
  std::vector<FaceBox> dark;
  // The square of the first tag, numbered as in the loops below.
  const FacePoint light = target.tags.empty() ? FacePoint(0, 1)
                                              : (target.tags.front().centre_m / target.pitch_m +
                                                 FacePoint(target.cols - 2, target.rows - 2) / 2);
  const int odd = std::abs(static_cast<int>(std::lround(light.x() + light.y())) + 1) % 2;
  for (int row = -1; row < target.rows; ++row) {
    for (int col = -1; col < target.cols; ++col) {
      if ((row + col + 2) % 2 != odd) continue;
      // Rows of a target count upwards on the face, so a square extends down from its corner.
      const FacePoint least = face_point(target, {row + 1, col});
      dark.push_back({least, least + FacePoint::Constant(target.pitch_m)});
    }
  }
  return dark;
}

/// Small black squares where the gaps between tags cross, so that two dark and two light quadrants
/// meet at every corner of a tag (Kalibr's AprilGrid).
std::vector<FaceBox> small_squares_of(const Target& target) {
  const double gap = target.pitch_m - target.tag_edge_m;
  const FacePoint first = face_point(target, {0, 0});
  std::vector<FaceBox> squares;
  for (int row = -1; row < target.rows; row += 2) {
    for (int col = -1; col < target.cols; col += 2) {
      const FacePoint middle = first + target.pitch_m / 2 * FacePoint(col + 1, -(row + 1)) -
                               FacePoint(1, -1) * (gap / 2);
      squares.push_back(
          {middle - FacePoint::Constant(gap / 2), middle + FacePoint::Constant(gap / 2)});
    }
  }
  return squares;
}

}  // namespace

FacePoint face_point(const Print& print, MarkId mark) {
  return print.material_m(mark).reverse();
}

FacePoint face_point(const Print&, const PrintedTag& tag) {
  return tag.centre_m.reverse();
}

FacePoint face_point(const Target&, const PrintedTag& tag) {
  return {tag.centre_m.x(), -tag.centre_m.y()};
}

FacePoint face_point(const Target& target, MarkId mark) {
  const Eigen::Vector3d point = target.point_in_target(mark);
  return {point.x(), -point.y()};
}

Face face_of(const Print& print) {
  Face face;
  add_dots(print, face);
  for (int row = 0; print.dot_classes && row < print.rows; ++row)
    for (int col = 0; col < print.cols; ++col)
      if (print.dot_classes->is_light({row, col}))
        face.discs.push_back(
            {face_point(print, {row, col}), print.dot_classes->light_centre_diameter_m / 2, -1});
  add_tags(print, 1, face);
  return face;
}

Face face_of(const Target& target) {
  Face face;
  if (target.kind == TargetKind::dot_grid) {
    add_dots(target, face);
  } else {
    face.areas.push_back(target.kind == TargetKind::aprilgrid ? small_squares_of(target)
                                                              : squares_of(target));
  }
  add_tags(target, target.tag_border, face);
  return face;
}

}  // namespace drape
