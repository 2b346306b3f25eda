// SPDX-License-Identifier: Apache-2.0
#include "detect/tags/tags.hpp"

#include <apriltag/apriltag.h>

#include <Eigen/LU>
#include <bit>
#include <cmath>
#include <set>

#include "core/geometry/vectors.hpp"

namespace drape::detect {
namespace {

// Two bits would triple the false ids that folds can produce.
constexpr int most_wrong_bits_in_folds = 1;

/// Converts corners: the library counts them from the upper right, anticlockwise on the upright
/// tag, with pixel centres at +0.5; drapebench has pixel centres at integers.
Eigen::Matrix<double, 2, 4> reading_order(const apriltag_detection_t& found) {
  constexpr std::array<int, 4> source = {1, 0, 3, 2};
  Eigen::Matrix<double, 2, 4> corners;
  for (int k = 0; k < 4; ++k)
    corners.col(k) << found.p[source[k]][0] - 0.5, found.p[source[k]][1] - 0.5;
  return corners;
}

// Through a dot's own ellipse a neighbour appears one pitch away, or nearer if the cloth turns away
// in between.
constexpr double nearest_in_pitches = 0.55;
constexpr double farthest_in_pitches = 1.45;
constexpr double most_cosine = 0.5;           // cosine of the angle between two edges of a cell
constexpr double most_fourth_corner = 0.45;   // deviation from a parallelogram, in edges
constexpr int most_wrong_pairs = 2;           // wrong pairs among eight positions on the frame
constexpr double least_frame_fraction = 0.8;  // fraction of frame modules of the right colour

/// Four corners, clockwise in the picture; the third may have no dot of its own.
struct Corners {
  std::size_t first = 0, right = 0, down = 0;
  std::optional<std::size_t> opposite;
};

struct Neighbour {
  std::size_t dot;
  Eigen::Vector2d in_pitches;
};

/// Finds dots that may be neighbours of each other.
class Cells {
 public:
  Cells(const std::vector<UnlabelledDot>& dots, const PrintPlane& plane)
      : dots_(dots), neighbours_(dots.size()) {
    const DotCells cells(dots);
    for (std::size_t i = 0; i < dots.size(); ++i) {
      const Eigen::Matrix2d root =
          symmetric_root(dots[i].shape_px2) * (plane.pitch_m / plane.dot_radius_m);
      const Eigen::Matrix2d undo = root.inverse();
      const double reach = farthest_in_pitches * root.norm();
      for (const std::size_t j : cells.within(dots[i].centre_px, reach)) {
        const Eigen::Vector2d p = undo * (dots[j].centre_px - dots[i].centre_px);
        const double distance = p.norm();
        if (distance < nearest_in_pitches || distance > farthest_in_pitches) continue;
        neighbours_[i].push_back({j, p});
      }
    }
  }

  /// Lists each set of four dots that may be a cell's corners, once; then each set of three.
  [[nodiscard]] std::vector<Corners> all() const {
    std::vector<Corners> whole, broken;
    for (std::size_t i = 0; i < dots_.size(); ++i) {
      for (const Neighbour& right : neighbours_[i]) {
        for (const Neighbour& down : neighbours_[i]) {
          const Eigen::Vector2d &a = right.in_pitches, &b = down.in_pitches;
          if (cross(a, b) <= 0) continue;
          if (std::abs(a.dot(b)) > most_cosine * a.norm() * b.norm()) continue;
          const auto fourth = opposite(i, right, down);
          broken.push_back({i, right.dot, down.dot, std::nullopt});
          if (fourth && i < std::min({right.dot, down.dot, *fourth})) {
            whole.push_back({i, right.dot, down.dot, fourth});
          }
        }
      }
    }
    whole.insert(whole.end(), broken.begin(), broken.end());
    return whole;
  }

 private:
  [[nodiscard]] std::optional<std::size_t> opposite(std::size_t from, const Neighbour& right,
                                                    const Neighbour& down) const {
    const Eigen::Vector2d origin = dots_[from].centre_px;
    const Eigen::Vector2d along = dots_[right.dot].centre_px - origin;
    const Eigen::Vector2d across = dots_[down.dot].centre_px - origin;
    std::optional<std::size_t> best;
    double least = most_fourth_corner * 0.5 * (along.norm() + across.norm());
    for (const Neighbour& candidate : neighbours_[right.dot]) {
      const std::size_t k = candidate.dot;
      if (k == from || k == down.dot || !are_neighbours(down.dot, k)) continue;
      const double miss = (dots_[k].centre_px - origin - along - across).norm();
      if (miss >= least) continue;
      least = miss;
      best = k;
    }
    return best;
  }

  [[nodiscard]] bool are_neighbours(std::size_t from, std::size_t to) const {
    return std::ranges::any_of(neighbours_[from], [&](const Neighbour& n) { return n.dot == to; });
  }

  const std::vector<UnlabelledDot>& dots_;
  std::vector<std::vector<Neighbour>> neighbours_;
};

constexpr double least_depth = 0.1;  // least ratio of the depths of two corners of a cell

/// Cubic Hermite curve from a to b with the given end tangents.
Eigen::Vector2d hermite(const Eigen::Vector2d& a, const Eigen::Vector2d& tangent_a,
                        const Eigen::Vector2d& b, const Eigen::Vector2d& tangent_b, double t) {
  const double s = 1 - t;
  return s * s * (1 + 2 * t) * a + t * t * (1 + 2 * s) * b + t * s * s * tangent_a -
         t * t * s * tangent_b;
}

using Quad = std::array<Eigen::Vector2d, 4>;

/// Map from a cell between four dots to the picture: the unit square, corners (0, 0), (1, 0), (1,
/// 1), (0, 1), to pixels.
using CellMap = std::function<Eigen::Vector2d(const Eigen::Vector2d&)>;

/// Homography of a flat cell; nullopt for corners that cannot be a view of a square.
std::optional<CellMap> flat_cell(const Quad& corners_px) {
  const auto map = square_homography(corners_px);
  if (!map) return std::nullopt;
  const Eigen::RowVector2d gh = map->row(2).head<2>();
  if (1 + gh.x() <= least_depth || 1 + gh.y() <= least_depth || 1 + gh.sum() <= least_depth)
    return std::nullopt;
  return [map = *map](const Eigen::Vector2d& at) { return mapped(map, at); };
}

/// Coons patch (1967) between four cubic edges, whose end tangents follow from the dots' ellipses.
/// `roots_px` are the symmetric roots of the ellipses in px per pitch.
std::optional<CellMap> bent_cell(const Quad& c, const std::array<Eigen::Matrix2d, 4>& roots_px) {
  const std::array<Eigen::Vector2d, 2> along = {c[1] - c[0], c[2] - c[3]};   // upper and lower edge
  const std::array<Eigen::Vector2d, 2> across = {c[3] - c[0], c[2] - c[1]};  // left and right edge
  std::array<Eigen::Matrix2d, 4> m;  // px per edge at the corners
  for (int k = 0; k < 4; ++k) {
    Eigen::Matrix2d rough;
    rough << along[k < 2 ? 0 : 1], across[k == 0 || k == 3 ? 0 : 1];
    if (!(std::abs(rough.determinant()) > 1e-9)) return std::nullopt;
    m[k] = turned_root(roots_px[k], rough);
  }
  return [c, m](const Eigen::Vector2d& at) -> Eigen::Vector2d {
    const double x = at.x(), y = at.y();
    const Eigen::Vector2d upper = hermite(c[0], m[0].col(0), c[1], m[1].col(0), x);
    const Eigen::Vector2d lower = hermite(c[3], m[3].col(0), c[2], m[2].col(0), x);
    const Eigen::Vector2d left = hermite(c[0], m[0].col(1), c[3], m[3].col(1), y);
    const Eigen::Vector2d right = hermite(c[1], m[1].col(1), c[2], m[2].col(1), y);
    return (1 - y) * upper + y * lower + (1 - x) * left + x * right - (1 - x) * (1 - y) * c[0] -
           x * (1 - y) * c[1] - x * y * c[2] - (1 - x) * y * c[3];
  };
}

/// Bilinearly interpolated level; nullopt outside the image.
std::optional<double> level_at(const GreyImage& image, const Eigen::Vector2d& p) {
  const int u = static_cast<int>(std::floor(p.x())), v = static_cast<int>(std::floor(p.y()));
  if (!(p.x() >= 0 && p.y() >= 0) || u + 1 >= image.width_px || v + 1 >= image.height_px) {
    return std::nullopt;
  }
  const double a = p.x() - u, b = p.y() - v;
  const double upper = (1 - a) * image.level(u, v) + a * image.level(u + 1, v);
  const double lower = (1 - a) * image.level(u, v + 1) + a * image.level(u + 1, v + 1);
  return (1 - b) * upper + b * lower;
}

/// Grey levels at the centres of a tag's modules and of the surrounding white ones.
struct Modules {
  int side = 0;  ///< including the white ones
  std::vector<double> levels;
  [[nodiscard]] double at(int x, int y) const { return levels[y * side + x]; }
};

/// Quick test at corners and edge midpoints for black inside white. `place` maps modules from the
/// corner of the tag to pixels.
template <class Place>
bool may_be_tag(const GreyImage& image, const Place& place, int modules, double least_contrast) {
  const double last = modules, middle = 0.5 * modules;
  int wrong = 0;
  for (const Eigen::Vector2d& at :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(middle, 0), Eigen::Vector2d(last, 0),
        Eigen::Vector2d(last, middle), Eigen::Vector2d(last, last), Eigen::Vector2d(middle, last),
        Eigen::Vector2d(0, last), Eigen::Vector2d(0, middle)}) {
    const Eigen::Vector2d out = (at.array() - middle).sign() * 0.5;
    const auto white = level_at(image, place(at + out)), black = level_at(image, place(at - out));
    wrong += !(white && black && *white - *black > least_contrast);
    if (wrong > most_wrong_pairs) return false;
  }
  return true;
}

template <class Place>
std::optional<Modules> sample(const GreyImage& image, const Place& place, int modules) {
  Modules result{modules + 2, {}};
  for (int y = -1; y <= modules; ++y) {
    for (int x = -1; x <= modules; ++x) {
      const auto level = level_at(image, place({x + 0.5, y + 0.5}));
      if (!level) return std::nullopt;
      result.levels.push_back(*level);
    }
  }
  return result;
}

/// Fits a plane to the level along a square ring of modules; symmetry makes its sums independent.
class Ring {
 public:
  Ring(const Modules& modules, int first) : first_(first), last_(modules.side - 1 - first) {
    const double middle = 0.5 * (modules.side - 1);
    double square = 0, count = 0;
    each([&](int x, int y) {
      mean_ += modules.at(x, y);
      slope_x_ += (x - middle) * modules.at(x, y);
      slope_y_ += (y - middle) * modules.at(x, y);
      square += (x - middle) * (x - middle);
      ++count;
    });
    mean_ /= count;
    slope_x_ /= square;
    slope_y_ /= square;
    middle_ = middle;
  }

  template <class Visit>
  void each(const Visit& visit) const {
    for (int k = first_; k < last_; ++k) {
      visit(k, first_);
      visit(last_, k);
      visit(last_ - (k - first_), last_);
      visit(first_, last_ - (k - first_));
    }
  }

  [[nodiscard]] double mean() const { return mean_; }
  [[nodiscard]] double at(double x, double y) const {
    return mean_ + slope_x_ * (x - middle_) + slope_y_ * (y - middle_);
  }

 private:
  int first_, last_;
  double middle_ = 0, mean_ = 0, slope_x_ = 0, slope_y_ = 0;
};

/// Bits of the tag's modules, 1 for white; nullopt without a black frame inside a white one.
std::optional<std::vector<char>> bits_of(const Modules& modules, double least_contrast) {
  const Ring white(modules, 0), black(modules, 1);
  if (white.mean() - black.mean() < least_contrast) return std::nullopt;
  const auto is_white = [&](int x, int y) {
    return modules.at(x, y) > 0.5 * (black.at(x, y) + white.at(x, y));
  };
  int right = 0, count = 0;
  white.each([&](int x, int y) { right += is_white(x, y), ++count; });
  black.each([&](int x, int y) { right += !is_white(x, y), ++count; });
  if (right < least_frame_fraction * count) return std::nullopt;
  std::vector<char> bits;
  for (int y = 1; y + 1 < modules.side; ++y) {
    for (int x = 1; x + 1 < modules.side; ++x) bits.push_back(is_white(x, y) ? 1 : 0);
  }
  return bits;
}

struct Reading {
  int id = 0;
  int turns = 0;  ///< quarter turns from the cell's first corner to the tag's upper left one
};

/// Code word of the modules, read with corner `turns` of the cell as the upper left one.
std::uint64_t word_of(const std::vector<char>& bits, const apriltag_family& code, int turns) {
  std::uint64_t word = 0;
  for (std::uint32_t bit = 0; bit < code.nbits; ++bit) {
    int x = static_cast<int>(code.bit_x[bit]), y = static_cast<int>(code.bit_y[bit]);
    for (int k = 0; k < turns; ++k) {
      const int before = x;
      x = code.width_at_border - 1 - y;
      y = before;
    }
    word = (word << 1U) | static_cast<std::uint64_t>(bits[y * code.width_at_border + x]);
  }
  return word;
}

/// Number of wrong bits up to which a code word is closest to its own tag.
int bearable_bits(const apriltag_family& code) {
  return (static_cast<int>(code.h) - 1) / 2;
}

/// Number of wrong bits accepted: one fewer than the usual families can correct (36h11 corrects
/// five, 25h9 four), since only the print's ids are searched for.
int wrong_bits_of(const apriltag_family& code) {
  return std::min(bearable_bits(code), code.nbits >= 36 ? 4 : code.nbits >= 25 ? 3 : 2);
}

/// Id of the print whose code word is close enough in one of four orientations.
std::optional<Reading> decode(const std::vector<char>& bits, const apriltag_family& code,
                              const PrintPlane& plane) {
  std::optional<Reading> best;
  int least = wrong_bits_of(code) + 1;
  for (int turns = 0; turns < 4; ++turns) {
    const std::uint64_t word = word_of(bits, code, turns);
    for (const auto& [id, centre] : plane.tags) {
      if (id < 0 || id >= static_cast<int>(code.ncodes)) continue;
      const int wrong = std::popcount(word ^ code.codes[id]);
      if (wrong >= least) continue;
      least = wrong;
      best = Reading{id, turns};
    }
  }
  return best;
}

std::optional<TagDetection> read_through(const GreyImage& image, const CellMap& cell,
                                         const PrintPlane& plane, const apriltag_family& code,
                                         double noise_sigma) {
  const double fraction = plane.tag_edge_m / plane.pitch_m;
  const double least_contrast = std::max(12.0, 6 * noise_sigma);
  const double n = code.width_at_border;
  const auto place = [&](const Eigen::Vector2d& in_modules) {
    return cell((in_modules / n - Eigen::Vector2d::Constant(0.5)) * fraction +
                Eigen::Vector2d::Constant(0.5));
  };
  if (!may_be_tag(image, place, code.width_at_border, 0.5 * least_contrast)) return std::nullopt;
  const auto modules = sample(image, place, code.width_at_border);
  if (!modules) return std::nullopt;
  const auto bits = bits_of(*modules, least_contrast);
  if (!bits) return std::nullopt;
  const auto reading = decode(*bits, code, plane);
  if (!reading) return std::nullopt;
  TagDetection tag;
  tag.id = reading->id;
  const Quad outline = {place({0, 0}), place({n, 0}), place({n, n}), place({0, n})};
  // The library's code words are upside down for an upright tag (see TagFinder::find).
  for (int k = 0; k < 4; ++k) tag.corners_px.col(k) = outline[(k + reading->turns + 2) % 4];
  return tag;
}

std::optional<TagDetection> read_cell(const GreyImage& image, const Corners& at,
                                      const std::vector<UnlabelledDot>& dots,
                                      const PrintPlane& plane, const apriltag_family& code,
                                      double noise_sigma) {
  const auto centre = [&](std::size_t dot) { return dots[dot].centre_px; };
  const auto root = [&](std::size_t dot) -> Eigen::Matrix2d {
    return symmetric_root(dots[dot].shape_px2) * (plane.pitch_m / plane.dot_radius_m);
  };
  Quad corners = {centre(at.first), centre(at.right), Eigen::Vector2d::Zero(), centre(at.down)};
  std::array<Eigen::Matrix2d, 4> maps = {root(at.first), root(at.right), Eigen::Matrix2d::Zero(),
                                         root(at.down)};
  if (at.opposite) {
    corners[2] = centre(*at.opposite);
    maps[2] = root(*at.opposite);
  } else {
    // Position of the corner without a dot, predicted by the maps of its two neighbours.
    Eigen::Matrix2d rough;
    rough << corners[1] - corners[0], corners[3] - corners[0];
    for (const int k : {1, 3}) maps[k] = turned_root(maps[k], rough);
    corners[2] = 0.5 * (corners[1] + maps[1].col(1) + corners[3] + maps[3].col(0));
    maps[2] = 0.5 * (maps[1] + maps[3]);
  }
  for (const auto& cell : {flat_cell(corners), bent_cell(corners, maps)}) {
    if (!cell) continue;
    if (auto tag = read_through(image, *cell, plane, code, noise_sigma)) return tag;
  }
  return std::nullopt;
}

/// First reading of an id; nullopt if it was read elsewhere too.
std::optional<TagDetection> one_place(const std::vector<TagDetection>& readings) {
  const auto middle = [](const TagDetection& tag) -> Eigen::Vector2d {
    return tag.corners_px.rowwise().mean();
  };
  const double reach = 0.5 * (readings.front().corners_px.col(2) - middle(readings.front())).norm();
  for (const TagDetection& other : readings) {
    if ((middle(other) - middle(readings.front())).norm() > reach) return std::nullopt;
  }
  return readings.front();
}

}  // namespace

TagFinder::TagFinder(const std::string& family, const TagSearch& search) : search_(search) {
  if (!family.empty()) family_.emplace(family, search.border_modules);
}

std::vector<TagFinder::Reading> TagFinder::read(const GreyImage& image, double noise_sigma) {
  std::vector<Reading> result;
  if (!family_) return result;
  if (!detector_) {
    detector_ = {apriltag_detector_create(), apriltag_detector_destroy};
    apriltag_detector_add_family_bits(
        detector_.get(), family_->library(),
        std::min(search_.wrong_bits, bearable_bits(*family_->library())));
    detector_->nthreads = 1;
    detector_->quad_decimate = 1.0F;
    detector_->refine_edges = search_.refine_edges;
  }
  // With a lower difference, sensor noise passes the library's threshold at 14 times the run time.
  detector_->qtp.min_white_black_diff =
      std::clamp(static_cast<int>(std::ceil(6.0 * noise_sigma)), 5, 60);
  // The library does not write to the picture.
  image_u8_t view = {image.width_px, image.height_px, image.width_px,
                     const_cast<std::uint8_t*>(image.bytes.data())};
  zarray_t* found = apriltag_detector_detect(detector_.get(), &view);
  for (int k = 0; k < zarray_size(found); ++k) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(found, k, static_cast<void*>(&detection));
    result.push_back({{detection->id, reading_order(*detection)}, detection->hamming});
  }
  apriltag_detections_destroy(found);
  return result;
}

std::vector<TagDetection> TagFinder::find_all(const GreyImage& image, double noise_sigma) {
  std::vector<TagDetection> result;
  for (const Reading& reading : read(image, noise_sigma)) result.push_back(reading.tag);
  return result;
}

std::vector<TagDetection> TagFinder::find(const GreyImage& image, const PrintPlane& plane,
                                          double noise_sigma) {
  std::map<int, std::vector<TagDetection>> by_id;
  for (const auto& [tag, wrong_bits] : read(image, noise_sigma))
    if (wrong_bits <= most_wrong_bits_in_folds && plane.tags.count(tag.id) != 0)
      by_id[tag.id].push_back(tag);
  std::vector<TagDetection> result;
  for (const auto& [id, seen] : by_id)
    if (seen.size() == 1) result.push_back(seen.front());
  return result;
}

std::vector<TagDetection> TagFinder::read_between_dots(const GreyImage& image,
                                                       const PrintPlane& plane,
                                                       const std::vector<UnlabelledDot>& dots,
                                                       double noise_sigma) const {
  std::map<int, std::vector<TagDetection>> by_id;
  std::set<std::array<std::size_t, 3>> read;  // cells that have been read, by corners
  for (const Corners& at : Cells(dots, plane).all()) {
    if (!at.opposite && read.count({at.first, at.right, at.down}) != 0) continue;
    const auto tag = read_cell(image, at, dots, plane, *family_->library(), noise_sigma);
    if (!tag) continue;
    by_id[tag->id].push_back(*tag);
    if (!at.opposite) continue;
    const std::size_t a = at.first, b = at.right, c = *at.opposite, d = at.down;
    for (const auto& three :
         std::array<std::array<std::size_t, 3>, 4>{{{a, b, d}, {b, c, a}, {c, d, b}, {d, a, c}}}) {
      read.insert(three);
    }
  }
  std::vector<TagDetection> result;
  for (const auto& [id, readings] : by_id) {
    if (const auto tag = one_place(readings)) result.push_back(*tag);
  }
  return result;
}

bool tags_sit_between_dots(const PrintPlane& plane) {
  return !plane.tags.empty() && std::ranges::all_of(plane.tags, [&](const auto& tag) {
    const Eigen::Vector2d at = (tag.second - plane.first_m) / plane.pitch_m;
    const Eigen::Vector2d rest = at.array() - at.array().floor();
    return (rest.array() - 0.5).abs().maxCoeff() < 1e-3;
  });
}

}  // namespace drape::detect
