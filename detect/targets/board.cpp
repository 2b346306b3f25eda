// SPDX-License-Identifier: Apache-2.0
#include "detect/targets/board.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/geometry/vectors.hpp"
#include "core/scene.hpp"
#include "detect/tags/tags.hpp"

namespace drape::detect {
namespace {

using Eigen::Vector2d;

/// Corners of a chessboard or of a rectangular part of it, by row and column; rows run up if
/// columns run right, as seen from the printed face (core/rig.hpp).
struct BoardGrid {
  int rows = 0, cols = 0;
  std::vector<Eigen::Vector2d> px;
  int first_row = 0, first_col = 0;  ///< position on the target

  [[nodiscard]] const Eigen::Vector2d& at(int row, int col) const {
    return px[static_cast<std::size_t>(row) * cols + col];
  }
  /// Position of (`row`, `col`) in or beside the grid, extrapolated from the two nearest corners
  /// along each axis.
  [[nodiscard]] Vector2d near(double row, double col) const {
    const int r = std::clamp(static_cast<int>(std::floor(row)), 0, rows - 2);
    const int c = std::clamp(static_cast<int>(std::floor(col)), 0, cols - 2);
    // Homography of the four corners: squares beyond the end of a tilted board change in size.
    const auto map = square_homography({at(r, c), at(r, c + 1), at(r + 1, c + 1), at(r + 1, c)});
    return map ? mapped(*map, {col - c, row - r}) : at(r, c);
  }
  [[nodiscard]] double nearest_neighbour_px(int row, int col) const {
    double nearest = std::numeric_limits<double>::infinity();
    const auto look = [&](int r, int c) {
      if (r < 0 || c < 0 || r >= rows || c >= cols) return;
      nearest = std::min(nearest, (at(r, c) - at(row, col)).norm());
    };
    look(row - 1, col);
    look(row + 1, col);
    look(row, col - 1);
    look(row, col + 1);
    return nearest;
  }
  /// True if every corner lies where the neighbours on both sides predict it, within a third of
  /// their distance: more than perspective and lens distortion, less than a wrong corner.
  [[nodiscard]] bool is_regular() const {
    const auto bends = [](const Vector2d& before, const Vector2d& here, const Vector2d& after) {
      return ((before + after) / 2 - here).norm() > (after - before).norm() / 6;
    };
    for (int row = 0; row < rows; ++row) {
      for (int col = 0; col < cols; ++col) {
        if (row > 0 && row + 1 < rows && bends(at(row - 1, col), at(row, col), at(row + 1, col)))
          return false;
        if (col > 0 && col + 1 < cols && bends(at(row, col - 1), at(row, col), at(row, col + 1)))
          return false;
      }
    }
    return true;
  }

  /// Quarter turn: the last row becomes the first column.
  [[nodiscard]] BoardGrid turned() const {
    BoardGrid result{cols, rows, {}, 0, 0};
    for (int row = 0; row < cols; ++row)
      for (int col = 0; col < rows; ++col) result.px.push_back(at(rows - 1 - col, row));
    return result;
  }
  /// Mirrors the grid if needed, so that rows run up if columns run right.
  void unmirror() {
    const Vector2d along_cols = at(0, cols - 1) - at(0, 0);
    const Vector2d along_rows = at(rows - 1, 0) - at(0, 0);
    if (cross(along_cols, along_rows) < 0) return;
    const BoardGrid old = *this;
    for (int row = 0; row < rows; ++row)
      for (int col = 0; col < cols; ++col)
        px[static_cast<std::size_t>(row) * cols + col] = old.at(rows - 1 - row, col);
  }
};

/// Fractions of the board's contrast: least alternation of squares, largest alternation of the
/// rim.
constexpr double kSquares = 0.5, kRim = 0.25;

std::optional<double> level_near(const GreyImage& image, const Vector2d& px) {
  const long x = std::lround(px.x()), y = std::lround(px.y());
  if (x < 0 || y < 0 || x >= image.width_px || y >= image.height_px) return std::nullopt;
  return image.level(static_cast<int>(x), static_cast<int>(y));
}

/// Levels of the squares `beyond` pitches outside one side, from one end of it to the other.
std::optional<std::vector<double>> squares_beyond(const GreyImage& image, const BoardGrid& grid,
                                                  bool along_rows, bool high, double beyond) {
  std::vector<double> levels;
  const int squares = (along_rows ? grid.rows : grid.cols) - 1;
  const double across = high ? (along_rows ? grid.cols : grid.rows) - 1 + beyond : -beyond;
  for (int i = 0; i < squares; ++i) {
    const auto level =
        level_near(image, along_rows ? grid.near(i + 0.5, across) : grid.near(across, i + 0.5));
    if (!level) return std::nullopt;
    levels.push_back(*level);
  }
  return levels;
}

/// Mean difference of neighbours, with alternating sign.
double alternation(const std::vector<double>& levels) {
  double sum = 0;
  for (std::size_t i = 0; i + 1 < levels.size(); ++i)
    sum += (i % 2 == 0 ? 1 : -1) * (levels[i] - levels[i + 1]);
  return std::abs(sum) / static_cast<double>(levels.size() - 1);
}

/// True if the board ends beyond one side of the grid: one more row of squares, then a light rim.
bool ends(const GreyImage& image, const BoardGrid& grid, bool along_rows, bool high,
          double contrast) {
  const auto squares = squares_beyond(image, grid, along_rows, high, 0.5);
  const auto rim = squares_beyond(image, grid, along_rows, high, 1.4);
  if (!squares || !rim || alternation(*squares) < kSquares * contrast ||
      alternation(*rim) > kRim * contrast)
    return false;
  const auto [dark, light] = std::minmax_element(squares->begin(), squares->end());
  return *std::min_element(rim->begin(), rim->end()) > (*dark + *light) / 2;
}

/// First row or column on the board, for an axis with `seen` of its `whole` corners.
std::optional<int> first_of(int seen, int whole, bool low_end, bool high_end) {
  if (seen == whole) return 0;
  if (seen > whole || low_end == high_end) return std::nullopt;
  return low_end ? 0 : whole - seen;
}

/// Mean grey level of the squares with even row + col minus that of the others.
double even_over_odd(const GreyImage& image, const BoardGrid& grid) {
  double sums[2] = {0, 0};
  int counts[2] = {0, 0};
  for (int row = 0; row + 1 < grid.rows; ++row) {
    for (int col = 0; col + 1 < grid.cols; ++col) {
      const Vector2d middle = (grid.at(row, col) + grid.at(row + 1, col) + grid.at(row, col + 1) +
                               grid.at(row + 1, col + 1)) /
                              4;
      const int parity = (grid.first_row + row + grid.first_col + col) % 2;
      sums[parity] += image.level(static_cast<int>(std::lround(middle.x())),
                                  static_cast<int>(std::lround(middle.y())));
      ++counts[parity];
    }
  }
  return sums[0] / counts[0] - sums[1] / counts[1];
}

/// Locates a rectangle of corners on the board. An incomplete axis must show one of the board's
/// ends, where a light rim follows the last squares. nullopt unless exactly one position agrees
/// with the picture.
std::optional<BoardGrid> placed_on_board(const GreyImage& image, const Target& target,
                                         const BoardGrid& part) {
  const double contrast = std::abs(even_over_odd(image, part));
  std::optional<BoardGrid> placed;
  BoardGrid grid = part;
  for (int quarter = 0; quarter < 4; ++quarter, grid = grid.turned()) {
    grid.first_row = grid.first_col = 0;
    const auto end = [&](bool along_rows, bool high) {
      return ends(image, grid, along_rows, high, contrast);
    };
    const auto row = first_of(grid.rows, target.rows, end(false, false), end(false, true));
    const auto col = first_of(grid.cols, target.cols, end(true, false), end(true, true));
    if (!row || !col) continue;
    grid.first_row = *row;
    grid.first_col = *col;
    // The square inside corner (0, 0) must be dark.
    if (even_over_odd(image, grid) > 0) continue;
    if (placed) return std::nullopt;
    placed = grid;
  }
  return placed;
}

/// Least part of a board, in corners per axis, with which the finder starts: from three it
/// sometimes grows a skewed grid that is not part of a board.
constexpr int kLeastParts[] = {4, 3};
constexpr double kWindowFraction = 0.25;  ///< half window over distance to the nearest neighbour

/// True for a regular grid whose squares alternate between two grey levels: finders may report a
/// board of 3 x 4 corners in pure noise. Adjacent squares must differ by more than twice the
/// scatter within a square.
bool is_board(const GreyImage& image, const BoardGrid& grid) {
  constexpr double kLeastScatters = 2;
  if (!grid.is_regular()) return false;
  double difference = 0, within = 0;
  int squares = 0;
  for (int row = 0; row + 1 < grid.rows; ++row) {
    for (int col = 0; col + 1 < grid.cols; ++col) {
      double sum = 0, sum_of_squares = 0;
      int count = 0;
      for (const double down : {0.3, 0.5, 0.7})
        for (const double right : {0.3, 0.5, 0.7})
          if (const auto level = level_near(image, grid.near(row + down, col + right))) {
            sum += *level;
            sum_of_squares += *level * *level;
            ++count;
          }
      if (count == 0) continue;
      ++squares;
      difference += ((row + col) % 2 == 0 ? 1 : -1) * sum / count;
      within += sum_of_squares / count - sum * sum / count / count;
    }
  }
  // The mean over all squares with alternating sign is half the difference of the two levels.
  return squares > 0 && 2 * std::abs(difference) / squares >
                            kLeastScatters * std::sqrt(std::max(0.0, within) / squares);
}

std::optional<BoardGrid> board_of(const GreyImage& image, int rows, int cols,
                                  const std::vector<cv::Point2f>& corners) {
  BoardGrid grid{rows, cols, {}, 0, 0};
  for (const cv::Point2f& corner : corners) grid.px.emplace_back(corner.x, corner.y);
  grid.unmirror();
  if (!is_board(image, grid)) return std::nullopt;
  return grid;
}

/// Finds corners by sectors (Duda and Frese 2018), in bounded time; with CALIB_CB_LARGER, those of
/// a board with at least `size` corners.
std::optional<BoardGrid> by_sectors(const GreyImage& image, const cv::Size& size, int flags) {
  std::vector<cv::Point2f> corners;
  cv::Mat pattern;
  if (!cv::findChessboardCornersSB(view_of(image), size, corners,
                                   cv::CALIB_CB_NORMALIZE_IMAGE | flags, pattern) ||
      corners.size() != pattern.total())
    return std::nullopt;
  return board_of(image, pattern.rows, pattern.cols, corners);
}

/// Number of pixels on which the quadrilateral finder ends within a second for any picture.
constexpr double kQuadrangles_px = 0.3e6;

/// Finds corners by quadrilaterals, which needs no light rim, in a picture reduced if it is large.
std::optional<BoardGrid> by_quadrangles(const GreyImage& image, const cv::Size& size) {
  const cv::Mat view = view_of(image);
  const double scale = std::min(1.0, std::sqrt(kQuadrangles_px / double(view.total())));
  cv::Mat reduced = view;
  if (scale < 1) cv::resize(view, reduced, {}, scale, scale, cv::INTER_AREA);
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(
          reduced, size, corners,
          cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK))
    return std::nullopt;
  const float by_x = float(view.cols) / float(reduced.cols),
              by_y = float(view.rows) / float(reduced.rows);
  for (cv::Point2f& corner : corners)
    corner = {(corner.x + 0.5F) * by_x - 0.5F, (corner.y + 0.5F) * by_y - 0.5F};
  return board_of(image, size.height, size.width, corners);
}

/// Board found in a picture, complete or in part.
struct SeenBoard {
  std::optional<BoardGrid> whole, part;  ///< a part with a unique position on the board
  bool most = false;  ///< true if the picture has a regular grid of at least half the corners
};

SeenBoard seen_board(const GreyImage& image, const Target& target) {
  const cv::Size size(target.cols, target.rows);
  SeenBoard seen;
  seen.whole = by_sectors(image, size, 0);
  if (!seen.whole) seen.whole = by_quadrangles(image, size);
  if (seen.whole) return seen;
  for (const int least : kLeastParts) {
    auto grid = by_sectors(image, {least, least}, cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_LARGER);
    if (!grid) continue;
    seen.most |= 2 * grid->rows * grid->cols >= target.rows * target.cols;
    if (grid->rows == target.cols && grid->cols == target.rows) grid = grid->turned();
    if (grid->rows == target.rows && grid->cols == target.cols) {
      seen.whole = std::move(grid);
      return seen;
    }
    if (is_ambiguous(target)) continue;
    seen.part = placed_on_board(image, target, *grid);
    if (seen.part) return seen;
  }
  seen.whole = by_sectors(image, size, cv::CALIB_CB_EXHAUSTIVE);
  return seen;
}

/// True if the board in the picture suggests that the target's size counts squares, not corners.
bool squares_were_counted(const GreyImage& image, const Target& target) {
  return std::min(target.cols, target.rows) > 3 &&
         by_quadrangles(image, {target.cols - 1, target.rows - 1});
}

/// Turns the labels by half a turn unless the square inside corner (0, 0) is dark; for an ambiguous
/// board, makes columns run to the right.
void orient(const GreyImage& image, const Target& target, BoardGrid& grid) {
  const bool turned = is_ambiguous(target) ? grid.at(0, grid.cols - 1).x() < grid.at(0, 0).x()
                                           : even_over_odd(image, grid) > 0;
  if (turned) std::ranges::reverse(grid.px);
}

using Corners = Eigen::Matrix<double, 2, 4>;

constexpr std::size_t kTagsPerMap = 4;
constexpr double kReachPitches = 1.6;

Corners turned(const Corners& corners, int quarters) {
  Corners result;
  for (int k = 0; k < 4; ++k) result.col(k) = corners.col((k + quarters) % 4);
  return result;
}

/// A tag in the target's plane and in the picture.
struct SeenTag {
  Vector2d centre_m;
  Corners corners_m, corners_px;
};

/// Homography of the corners of tags, each rotated by the same number of quarter turns, from the
/// target's plane to pixels.
std::optional<Eigen::Matrix3d> map_of(const std::vector<SeenTag>& tags, int quarters) {
  std::vector<Vector2d> from, to;
  for (const SeenTag& tag : tags) {
    const Corners px = turned(tag.corners_px, quarters);
    for (int k = 0; k < 4; ++k) {
      from.emplace_back(tag.corners_m.col(k));
      to.emplace_back(px.col(k));
    }
  }
  return projective_map(from, to);
}

/// Number of quarter turns by which the tags were printed: that with which one homography fits the
/// corners of all tags best. A single tag fits all four and counts as upright.
int quarters_turned(const std::vector<SeenTag>& tags) {
  int best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (int quarters = 0; tags.size() > 1 && quarters < 4; ++quarters) {
    const auto map = map_of(tags, quarters);
    if (!map) continue;
    double sum = 0;
    for (const SeenTag& tag : tags) {
      const Corners px = turned(tag.corners_px, quarters);
      for (int k = 0; k < 4; ++k) sum += (mapped(*map, tag.corners_m.col(k)) - px.col(k)).norm();
    }
    if (sum >= least) continue;
    least = sum;
    best = quarters;
  }
  return best;
}

/// Upright corners of the tags found, which must belong to the target, each id once.
std::vector<SeenTag> seen_tags(const Target& target, const std::vector<TagDetection>& found) {
  const PrintPlane plane = plane_of(target);
  std::vector<SeenTag> tags;
  for (const TagDetection& tag : found) {
    const auto corners_m = plane.tag_corners_m(tag.id);
    SeenTag seen{plane.tags.at(tag.id), Corners::Zero(), tag.corners_px};
    for (int k = 0; k < 4; ++k) seen.corners_m.col(k) = corners_m[k];
    tags.push_back(seen);
  }
  const int quarters = quarters_turned(tags);
  for (SeenTag& tag : tags) tag.corners_px = turned(tag.corners_px, quarters);
  return tags;
}

/// Homography from the target's plane (metres) to pixels, fitted to the four tags nearest to a
/// point. nullopt if no tag lies within 1.6 pitches.
std::optional<Eigen::Matrix3d> map_around(std::vector<SeenTag> tags, const Vector2d& point_m,
                                          double pitch_m) {
  const auto distance = [&](const SeenTag& tag) { return (tag.centre_m - point_m).norm(); };
  std::erase_if(tags, [&](const SeenTag& tag) { return distance(tag) > kReachPitches * pitch_m; });
  if (tags.empty()) return std::nullopt;
  std::ranges::stable_sort(tags, {}, distance);
  tags.resize(std::min(tags.size(), kTagsPerMap));
  return map_of(tags, 0);
}

constexpr double kEdge_px = 1;               ///< part of the free width taken by a blurred edge
constexpr double kMostPitchFraction = 0.25;  ///< largest half window, as for a chessboard
constexpr double kLeastContrastSigmas = 6;
constexpr int kMostGrowth_px = 3;

std::vector<TagDetection> tags_of(const GreyImage& image, const Target& target,
                                  double noise_sigma) {
  TagFinder finder(target.tag_family, {target.tag_border, 1, true});
  const PrintPlane plane = plane_of(target);
  std::map<int, TagDetection> known;
  for (const TagDetection& tag : finder.find(image, plane, noise_sigma)) known[tag.id] = tag;
  // The small squares of an AprilGrid touch the corners of its tags, so the library sees one shape;
  // dilating the light separates them.
  for (int by_px = 1; target.kind == TargetKind::aprilgrid && by_px <= kMostGrowth_px; ++by_px) {
    if (known.size() == target.tags.size()) break;
    for (TagDetection& tag : finder.find(with_light_grown(image, by_px), plane, noise_sigma)) {
      tag.corners_px = without_growth(tag.corners_px, by_px);
      known.try_emplace(tag.id, tag);
    }
  }
  std::vector<TagDetection> tags;
  for (const auto& [id, tag] : known) tags.push_back(tag);
  return tags;
}

/// Width around a corner that contains only its own edges: up to the tags of a ChArUco board; in an
/// AprilGrid up to the far side of the small squares or the inner edge of the border.
double free_width_m(const Target& target) {
  const double gap = target.pitch_m - target.tag_edge_m;
  if (target.kind == TargetKind::charuco)
    return std::min(gap / 2, kMostPitchFraction * target.pitch_m);
  const TagFamily family(target.tag_family, target.tag_border);
  return std::min(gap, target.tag_edge_m * target.tag_border / family.edge_modules());
}

/// Neighbourhood of one corner in the picture.
struct Surroundings {
  Vector2d px;
  double free_px = 0;     ///< distance to the nearest edge of the free square's image
  Vector2d diagonals[4];  ///< centres of the four quadrants around it
};

Surroundings surroundings_of(const Eigen::Matrix3d& map, const Vector2d& point_m, double free_m) {
  Surroundings around{mapped(map, point_m), std::numeric_limits<double>::infinity(), {}};
  int k = 0;
  for (const Vector2d& diagonal :
       {Vector2d(1, 1), Vector2d(-1, 1), Vector2d(-1, -1), Vector2d(1, -1)}) {
    const Vector2d along(diagonal.x(), 0), across(0, diagonal.y());
    // Seen obliquely the free square is a parallelogram: its edges are closer than its arms' ends.
    const Vector2d a = mapped(map, point_m + free_m * along) - around.px;
    const Vector2d b = mapped(map, point_m + free_m * across) - around.px;
    const double area = std::abs(cross(a, b));
    around.free_px = std::min(around.free_px, area / std::max(a.norm(), b.norm()));
    around.diagonals[k++] = mapped(map, point_m + 0.6 * free_m * diagonal);
  }
  return around;
}

/// Grey-level difference of the two pairs of opposite quadrants; nullopt at the image's border.
std::optional<double> contrast_at(const GreyImage& image, const Surroundings& around) {
  double level[4];
  for (int k = 0; k < 4; ++k) {
    const auto here = level_near(image, around.diagonals[k]);
    if (!here) return std::nullopt;
    level[k] = *here;
  }
  return std::abs(level[0] + level[2] - level[1] - level[3]) / 2;
}

FrameDetections detect_face(const GreyImage& image, const Target& target) {
  FrameDetections frame;
  frame.width_px = image.width_px;
  frame.height_px = image.height_px;
  const double noise_sigma = estimate_noise(image).sigma(128);
  frame.noise_sigma = noise_sigma;
  frame.tags = tags_of(image, target, noise_sigma);
  if (frame.tags.empty()) return frame;
  const std::vector<SeenTag> tags = seen_tags(target, frame.tags);
  const double free_m = free_width_m(target);
  std::vector<CornerPoint> points;
  const auto read = [&](MarkId mark, const Vector2d& point_m, const Eigen::Matrix3d& map) {
    const Surroundings around = surroundings_of(map, point_m, free_m);
    const auto reject = [&](const std::string& reason) {
      frame.rejections.push_back({mark, around.px, reason});
    };
    const std::optional<double> contrast = contrast_at(image, around);
    if (!contrast) return;  // Outside the picture nothing can be found.
    const int half_window = static_cast<int>(std::floor(around.free_px - kEdge_px));
    if (half_window < kLeastHalfWindow_px)
      return reject(fmt::format("too small: {:.1f} px are free around the corner", around.free_px));
    if (*contrast < kLeastContrastSigmas * noise_sigma)
      return reject(fmt::format(
          "no corner where the tags have it: covered or glare, contrast {:.0f} grey levels",
          *contrast));
    const auto point = find_corner_point(image, around.px, half_window);
    if (!point || (point->centre_px - around.px).norm() > std::max(1.0, 0.5 * half_window))
      return reject("the edges around the corner do not meet in one point");
    points.push_back(*point);
    frame.detections.push_back({mark, point->centre_px, Eigen::Matrix2d::Identity(),
                                Vector2d::Constant(point->half_window_px), 0, *contrast, 0});
  };
  for (int row = 0; row < target.rows; ++row) {
    for (int col = 0; col < target.cols; ++col) {
      const Vector2d point_m = target.point_in_target({row, col}).head<2>();
      if (const auto map = map_around(tags, point_m, target.pitch_m))
        read({row, col}, point_m, *map);
    }
  }
  set_corner_covariances(target, points, frame);
  return frame;
}

/// Converts measurements in the mirrored picture to the original one.
void mirror(FrameDetections& frame) {
  const double right = frame.width_px - 1;
  for (Detection& corner : frame.detections) {
    corner.centre_px.x() = right - corner.centre_px.x();
    corner.covariance_px2(0, 1) *= -1;
    corner.covariance_px2(1, 0) *= -1;
  }
  for (TagDetection& tag : frame.tags)
    tag.corners_px.row(0) = right - tag.corners_px.row(0).array();
  for (Rejection& rejection : frame.rejections)
    if (rejection.centre_px) rejection.centre_px->x() = right - rejection.centre_px->x();
}

/// Handles two-sided boards: the back mirrors the front, with each corner behind its counterpart.
FrameDetections detect_tagged(const GreyImage& image, const Target& target) {
  FrameDetections frame = detect_face(image, target);
  if (!frame.tags.empty()) return frame;
  FrameDetections back = detect_face(mirrored(image), target);
  if (back.tags.size() < 2) return frame;
  mirror(back);
  return back;
}

}  // namespace

std::string other_border(const GreyImage& image, const Target& target, std::size_t found,
                         const std::string& file) {
  if (target.kind != TargetKind::aprilgrid || found >= target.tags.size()) return "";
  const double noise_sigma = estimate_noise(image).sigma(128);
  Target other = target;
  for (const int border : {1, 2}) {
    other.tag_border = border;
    if (border == target.tag_border) continue;
    const std::size_t count = tags_of(image, other, noise_sigma).size();
    if (count > found)
      return fmt::format(
          "{} of {} tags are read with a black border of {} modules, {} with one of {} as stated: "
          "give tags.border_modules = {} in {}",
          count, target.tags.size(), border, found, target.tag_border, border, file);
  }
  return "";
}

FrameDetections detect_chessboard(const GreyImage& image, const Target& target) {
  FrameDetections frame;
  frame.width_px = image.width_px;
  frame.height_px = image.height_px;
  SeenBoard seen = seen_board(image, target);
  if (seen.whole) orient(image, target, *seen.whole);
  const std::optional<BoardGrid> grid = seen.whole ? std::move(seen.whole) : std::move(seen.part);
  if (!grid) {
    frame.rejections.push_back(
        {std::nullopt, std::nullopt,
         seen.most && squares_were_counted(image, target)
             ? fmt::format("squares counted for corners: the board has {} x {} inner corners, not "
                           "{} x {}",
                           target.cols - 1, target.rows - 1, target.cols, target.rows)
             : fmt::format("no whole chessboard, and no part of it whose place is certain: {} x {} "
                           "inner corners are not all in the picture",
                           target.cols, target.rows)});
    return frame;
  }
  const double contrast = std::abs(even_over_odd(image, *grid));
  std::vector<CornerPoint> points;
  for (int row = 0; row < grid->rows; ++row) {
    for (int col = 0; col < grid->cols; ++col) {
      const MarkId mark{grid->first_row + row, grid->first_col + col};
      const double spacing = grid->nearest_neighbour_px(row, col);
      const int half_window =
          std::max(kLeastHalfWindow_px, static_cast<int>(std::lround(kWindowFraction * spacing)));
      const auto point = find_corner_point(image, grid->at(row, col), half_window);
      if (!point) {
        frame.rejections.push_back(
            {mark, grid->at(row, col), "the edges around the corner do not meet in one point"});
        continue;
      }
      points.push_back(*point);
      frame.detections.push_back({mark, point->centre_px, Eigen::Matrix2d::Identity(),
                                  Eigen::Vector2d::Constant(point->half_window_px), 0, contrast,
                                  0});
    }
  }
  set_corner_covariances(target, points, frame);
  return frame;
}

GreyImage with_light_grown(const GreyImage& image, int by_px) {
  GreyImage grown{image.width_px, image.height_px, image.bytes, {}};
  cv::Mat to = view_of(grown);
  const int side = 2 * by_px + 1;
  cv::dilate(view_of(image), to, cv::getStructuringElement(cv::MORPH_RECT, {side, side}));
  return grown;
}

Eigen::Matrix<double, 2, 4> without_growth(const Eigen::Matrix<double, 2, 4>& corners_px,
                                           int by_px) {
  const Eigen::Vector2d middle = corners_px.rowwise().mean();
  Eigen::Matrix<double, 3, 4> lines;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector2d a = corners_px.col(k), along = corners_px.col((k + 1) % 4) - a;
    Eigen::Vector2d outwards = Eigen::Vector2d(along.y(), -along.x()).normalized();
    if (outwards.dot(a - middle) < 0) outwards = -outwards;
    lines.col(k) << outwards, -outwards.dot(a) - by_px * outwards.lpNorm<1>();
  }
  Eigen::Matrix<double, 2, 4> corners;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector3d before = lines.col((k + 3) % 4), after = lines.col(k);
    corners.col(k) = before.cross(after).hnormalized();
  }
  return corners;
}

FrameDetections detect_board(const GreyImage& image, const Target& target) {
  if (target.kind == TargetKind::chessboard) return detect_chessboard(image, target);
  return detect_tagged(image, target);
}

}  // namespace drape::detect
