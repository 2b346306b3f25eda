// SPDX-License-Identifier: Apache-2.0
#include "compare/hems/silhouette.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"
#include "core/pictures/picture.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector2d;

constexpr double kLeastContrast = 0.05;  // fraction of the full range; less is paper, not cloth
constexpr double kLeastSize = 0.001;     // fraction of the picture's area; smaller is dust
constexpr double kSpeck = 0.01;       // fraction of the silhouette's area; larger objects are named
constexpr double kMostMisfit = 0.02;  // relative to a disc's ellipse
constexpr double kMostTilt = 0.0603;  // 1 - cos(20 degrees)
constexpr double kRulerPoint_px = 0.5;  // error of a point set by hand

[[noreturn]] void refuse(const std::string& file, const std::string& what,
                         const std::string& advice) {
  throw bad_input(what, {.file = file}, advice);
}

cv::Mat read_grey(const std::filesystem::path& file) {
  const cv::Mat picture =
      decode_picture(read_bytes(file), {.file = file.string()}, "give a PNG, JPEG or TIFF");
  cv::Mat grey = picture;
  if (picture.channels() != 1) cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  grey.convertTo(grey, CV_32F, picture.depth() == CV_8U ? 1.0 / 255 : 1.0 / 65535);
  return grey;
}

/// Counts of pixels by grey, in 1024 levels.
using Histogram = std::array<std::int64_t, 1024>;

/// Closed lines of constant grey, with the side above `level` on the left (y up), by marching
/// squares with linear interpolation; at a saddle the mean grey decides which corners are joined.
class Contours {
 public:
  Contours(const cv::Mat& grey, double level, const cv::Rect& frame)
      : grey_(grey), level_(level), frame_(frame) {
    next_.assign(2 * static_cast<std::size_t>(frame.area()), -1);
    for (int y = 0; y + 1 < frame.height; ++y)
      for (int x = 0; x + 1 < frame.width; ++x) add_cell(x, y);
  }

  [[nodiscard]] std::vector<Outline> loops() {
    std::vector<Outline> result;
    for (std::size_t start = 0; start < next_.size(); ++start) {
      if (next_[start] < 0) continue;
      Outline loop;
      std::int64_t at = static_cast<std::int64_t>(start);
      while (at >= 0 && next_[at] >= 0) {
        loop.push_back(point(at));
        at = std::exchange(next_[at], -1);
      }
      if (at == static_cast<std::int64_t>(start) && loop.size() > 2)
        result.push_back(std::move(loop));
    }
    return result;
  }

 private:
  [[nodiscard]] double at(int x, int y) const {
    return grey_.at<float>(frame_.y + y, frame_.x + x);
  }
  /// Index of the edge from (x, y) to its right (0) or lower (1) neighbour.
  [[nodiscard]] std::int64_t edge(int x, int y, int down) const {
    return 2 * (static_cast<std::int64_t>(y) * frame_.width + x) + down;
  }
  [[nodiscard]] Vector2d point(std::int64_t edge) const {
    const int x = static_cast<int>(edge / 2 % frame_.width);
    const int y = static_cast<int>(edge / 2 / frame_.width);
    const int down = static_cast<int>(edge % 2), right = 1 - down;
    const double a = at(x, y), b = at(x + right, y + down);
    const double t = (level_ - a) / (b - a);
    return {frame_.x + x + t * right, -(frame_.y + y + t * down)};
  }
  void add_cell(int x, int y) {
    // Corners and edges clockwise around the cell: top left, top right, bottom right, bottom left.
    const std::array<bool, 4> above = {at(x, y) >= level_, at(x + 1, y) >= level_,
                                       at(x + 1, y + 1) >= level_, at(x, y + 1) >= level_};
    if (above[0] == above[1] && above[0] == above[2] && above[0] == above[3]) return;
    const std::array<std::int64_t, 4> edges = {edge(x, y, 0), edge(x + 1, y, 1), edge(x, y + 1, 0),
                                               edge(x, y, 1)};
    // Clockwise on the screen, a line leaves through the edge after which the values fall below the
    // level, and enters where they rise above it. Joined higher corners: each line cuts off a lower
    // one; else it goes round a higher one.
    const bool joined = at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1) >= 4 * level_;
    const auto falls = [&](int k) { return above[k] && !above[(k + 1) % 4]; };
    for (int k = 0; k < 4; ++k) {
      if (above[k] || !above[(k + 1) % 4]) continue;
      int end = k;
      while (!falls(end)) end = (end + (joined ? 3 : 1)) % 4;
      next_[edges[k]] = edges[end];
    }
  }

  const cv::Mat& grey_;
  double level_;
  cv::Rect frame_;
  std::vector<std::int64_t> next_;
};

/// Traces the object's outline at a fraction of the contrast; with `hole` also its largest hole.
Outline outline_at(const cv::Mat& grey, const Silhouette& silhouette, double part,
                   const cv::Rect& frame, Outline* hole) {
  const double level = silhouette.background + part * (silhouette.object - silhouette.background);
  std::vector<Outline> loops = Contours(grey, level, frame).loops();
  // Orientation of the object's outline; holes have the opposite one.
  const double sense = silhouette.object > silhouette.background ? 1 : -1;
  Outline largest;
  double area = 0, hole_area = 0;
  for (Outline& loop : loops) {
    const double signed_by_sense = sense * signed_area(loop);
    if (signed_by_sense > area) {
      area = signed_by_sense;
      largest = std::move(loop);
    } else if (hole != nullptr && -signed_by_sense > hole_area) {
      hole_area = -signed_by_sense;
      *hole = std::move(loop);
    }
  }
  if (sense < 0) std::reverse(largest.begin(), largest.end());
  if (hole != nullptr && sense > 0) std::reverse(hole->begin(), hole->end());
  return largest;
}

/// Box of the largest connected region of pixels that differ from the border's class, which
/// `object` marks.
cv::Rect largest_component(const cv::Mat& mask, const std::string& file, cv::Mat& object,
                           Silhouette& silhouette) {
  cv::Mat labels, statistics, centroids;
  const int count = cv::connectedComponentsWithStats(mask, labels, statistics, centroids, 4);
  int best = 0, area = 0;
  const auto area_of = [&](int label) { return statistics.at<int>(label, cv::CC_STAT_AREA); };
  for (int label = 1; label < count; ++label) {
    if (area_of(label) <= area) continue;
    best = label;
    area = area_of(label);
  }
  if (area < kLeastSize * mask.rows * mask.cols)
    refuse(file, "the picture shows no silhouette",
           "photograph dark cloth on light, or light on dark");
  for (int label = 1; label < count; ++label) {
    if (label != best && area_of(label) > kSpeck * area)
      silhouette.warnings.push_back(fmt::format(
          "something else of {:.1f} % of the silhouette's size", 100.0 * area_of(label) / area));
  }
  const int* box = statistics.ptr<int>(best);
  const cv::Rect found(box[cv::CC_STAT_LEFT], box[cv::CC_STAT_TOP], box[cv::CC_STAT_WIDTH],
                       box[cv::CC_STAT_HEIGHT]);
  if (found.x == 0 || found.y == 0 || found.br().x == mask.cols || found.br().y == mask.rows)
    refuse(file, "the silhouette touches the picture's border", "show the whole hem");
  object = labels == best;
  return found;
}

double otsu_level(const cv::Mat& grey) {
  cv::Mat bytes, dark;
  grey.convertTo(bytes, CV_8U, 255);
  return cv::threshold(bytes, dark, 0, 255, cv::THRESH_BINARY | cv::THRESH_OTSU) / 255;
}

struct Moments {
  double area = 0;
  Vector2d first = Vector2d::Zero();
};

/// Adds the length covered by a line at `y`, times `height`; pieces can be in any order.
void add_line(std::vector<std::pair<double, double>>& pieces, double y, double height,
              Moments& moments) {
  std::ranges::sort(pieces);
  for (std::size_t i = 0; i < pieces.size();) {
    const double from = pieces[i].first;
    double to = pieces[i].second;
    for (++i; i < pieces.size() && pieces[i].first <= to; ++i) to = std::max(to, pieces[i].second);
    const double area = (to - from) * height;
    moments.area += area;
    moments.first += area * Vector2d((from + to) / 2, y);
  }
}

Moments covered(const ShadowMesh& mesh) {
  constexpr int lines = 4096;
  double low = 1e300, high = -1e300;
  for (const auto& point : mesh.points) {
    low = std::min(low, point.y());
    high = std::max(high, point.y());
  }
  const double height = (high - low) / lines;
  std::vector<std::vector<std::pair<double, double>>> pieces(static_cast<std::size_t>(lines));
  const auto line_at = [&](double y) { return (y - low) / height - 0.5; };
  for (const auto& triangle : mesh.triangles) {
    std::array<Vector2d, 3> p;
    for (int k = 0; k < 3; ++k) p[k] = mesh.points[triangle[k]].head<2>();
    const auto [least, most] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
    const int last = std::min(lines - 1, static_cast<int>(std::floor(line_at(most))));
    for (int i = std::max(0, static_cast<int>(std::ceil(line_at(least)))); i <= last; ++i) {
      const double y = low + (i + 0.5) * height;
      double from = 1e300, to = -1e300;
      for (int k = 0; k < 3; ++k) {
        const Vector2d &a = p[k], &b = p[(k + 1) % 3];
        if ((a.y() - y) * (b.y() - y) > 0 || a.y() == b.y()) continue;
        const double x = a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
        from = std::min(from, x);
        to = std::max(to, x);
      }
      if (to > from) pieces[i].emplace_back(from, to);
    }
  }
  Moments moments;
  for (int i = 0; i < lines; ++i) add_line(pieces[i], low + (i + 0.5) * height, height, moments);
  return moments;
}

/// Ellipse with the outline's second moments of area; exact for an ellipse.
struct EllipseFit {
  Vector2d semi_axes;    ///< larger semi-axis first
  Eigen::Matrix2d axes;  ///< unit directions in columns
  double misfit = 0;     ///< RMS distance of the outline relative to the mean semi-axis
};

EllipseFit ellipse_of(const Outline& outline) {
  const AreaMoments moments = moments_of(outline);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solved(moments.spread);
  EllipseFit fit;
  fit.semi_axes = 2 * solved.eigenvalues().reverse().cwiseMax(0.0).cwiseSqrt();
  fit.axes = solved.eigenvectors().rowwise().reverse();
  double squares = 0;
  for (const Vector2d& p : outline) {
    const Vector2d local = fit.axes.transpose() * (p - moments.centre);
    squares += std::pow(local.cwiseQuotient(fit.semi_axes).norm() - 1, 2);
  }
  fit.misfit = std::sqrt(squares / static_cast<double>(outline.size()));
  return fit;
}

}  // namespace

Silhouette read_silhouette(const std::filesystem::path& file) {
  const cv::Mat grey = read_grey(file);
  Silhouette silhouette;
  silhouette.width_px = grey.cols;
  silhouette.height_px = grey.rows;
  const double level = otsu_level(grey) + 0.5 / 255;
  int light = 0, border = 0;
  for (int y = 0; y < grey.rows; ++y) {
    const int step = y == 0 || y == grey.rows - 1 ? 1 : std::max(1, grey.cols - 1);
    for (int x = 0; x < grey.cols; x += step, ++border) light += grey.at<float>(y, x) > level;
  }
  const bool light_around = 2 * light > border;
  const cv::Mat mask = light_around ? cv::Mat(grey <= level) : cv::Mat(grey > level);
  cv::Mat object, levels;
  const cv::Rect box = largest_component(mask, file.string(), object, silhouette);
  Histogram inside{}, outside{};
  grey.convertTo(levels, CV_16U, 1023);
  for (int y = 0; y < grey.rows; ++y)
    for (int x = 0; x < grey.cols; ++x)
      if (object.at<unsigned char>(y, x) != 0)
        ++inside[levels.at<std::uint16_t>(y, x)];
      else if (mask.at<unsigned char>(y, x) == 0)
        ++outside[levels.at<std::uint16_t>(y, x)];
  silhouette.background = counted_quantile(outside, 0.5) / 1023;
  silhouette.object = counted_quantile(inside, 0.5) / 1023;
  const double contrast = std::abs(silhouette.object - silhouette.background);
  if (contrast < kLeastContrast)
    refuse(file.string(), fmt::format("the contrast is {:.1f} % of the grey range", 100 * contrast),
           "photograph dark cloth on light, or light on dark");
  // Blur extends beyond the region: its box, enlarged by half on each side, contains all of it.
  const int margin = std::max(box.width, box.height) / 2;
  const cv::Rect frame = (box - cv::Point(margin, margin) + cv::Size(2 * margin, 2 * margin)) &
                         cv::Rect({0, 0}, grey.size());
  silhouette.half = outline_at(grey, silhouette, 0.5, frame, &silhouette.hole);
  silhouette.quarter = outline_at(grey, silhouette, 0.25, frame, nullptr);
  silhouette.three_quarters = outline_at(grey, silhouette, 0.75, frame, nullptr);
  for (const Outline* outline : {&silhouette.quarter, &silhouette.half, &silhouette.three_quarters})
    if (outline->size() < 16)
      refuse(file.string(), "the silhouette has no closed outline", "give a sharper picture");
  return silhouette;
}

PictureScale scale_of_pixel(double m_per_px, std::optional<double> relative_u) {
  return {[m_per_px](const Vector2d& p) { return Vector2d(m_per_px * p); }, relative_u,
          fmt::format("{:.6g} mm/px as given", m_per_px / units::mm)};
}

PictureScale scale_of_ruler(const Vector2d& from_px, const Vector2d& to_px, double length_m) {
  const double length_px = (to_px - from_px).norm(), m_per_px = length_m / length_px;
  if (!(length_px > 10))
    throw usage_error("the ruler is shorter than ten pixels", "give two points far apart");
  PictureScale scale = scale_of_pixel(m_per_px, std::sqrt(2.0) * kRulerPoint_px / length_px);
  scale.basis = fmt::format("{:.6g} mm/px from a ruler of {:g} mm", m_per_px / units::mm,
                            length_m / units::mm);
  return scale;
}

PictureScale scale_of_disc(const Outline& quarter, const Outline& half,
                           const Outline& three_quarters, double diameter_m,
                           const std::string& file) {
  if (half.size() < 16)
    refuse(file, "there is no disc whose grey is nearer to the table's than to the cloth's",
           "lay such a disc on the cloth, or give --mm-per-px instead");
  const EllipseFit fit = ellipse_of(half);
  if (!(fit.misfit <= kMostMisfit))
    refuse(file,
           fmt::format("what should be the disc departs from an ellipse by {:.1f} %",
                       100 * fit.misfit),
           "check which picture shows the disc");
  const double tilt = 1 - fit.semi_axes.y() / fit.semi_axes.x();
  if (tilt > kMostTilt)
    refuse(file, fmt::format("the disc is {:.1f} % narrower than wide", 100 * tilt),
           "place the camera straight above the disc");
  const Eigen::Matrix2d m_per_px = fit.axes *
                                   (diameter_m / 2 * fit.semi_axes.cwiseInverse()).asDiagonal() *
                                   fit.axes.transpose();
  // The edge is between the outer levels; the misfit of its ellipse adds to its error.
  const double edge =
      std::abs(ellipse_of(quarter).semi_axes.mean() - ellipse_of(three_quarters).semi_axes.mean()) /
      (2 * std::sqrt(3.0) * fit.semi_axes.mean());
  const double fit_u = fit.misfit / std::sqrt(static_cast<double>(half.size()));
  return {[m_per_px](const Vector2d& p) { return Vector2d(m_per_px * p); }, std::hypot(edge, fit_u),
          fmt::format("{:.6g} mm/px from a disc of {:g} mm, ellipse {:.2f} % from round",
                      diameter_m / 2 / fit.semi_axes.mean() / units::mm, diameter_m / units::mm,
                      100 * tilt),
          std::sqrt(tilt * (2 - tilt)) * fit.axes.col(1)};
}

Hem shadow_of(const ShadowMesh& mesh) {
  const Moments moments = covered(mesh);
  if (!(moments.area > 0))
    throw bad_input("the mesh covers nothing seen from above", {}, "z is up");
  Hem hem{moments.first / moments.area, moments.area, {}, {}};
  std::vector<std::optional<double>> radius(720);
  for (const auto& triangle : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::size_t a = triangle[k], b = triangle[(k + 1) % 3];
      raise_outline(radius, mesh.points[a].head<2>() - hem.centre_m,
                    mesh.points[b].head<2>() - hem.centre_m);
    }
  }
  const auto whole = closed(radius);
  if (!whole)
    throw bad_input("the cloth does not go around its centre", {}, "give a whole specimen");
  hem.radius_m = *whole;
  hem.flat_area_m2 = mesh.flat_area_m2;
  if (!mesh.material_m.empty()) {
    TriangleMesh flat{{}, mesh.triangles};
    for (const Vector2d& point : mesh.material_m) flat.points.emplace_back(point.x(), point.y(), 0);
    hem.flat_area_m2 = area_m2(flat);
  }
  return hem;
}

}  // namespace drape::compare
