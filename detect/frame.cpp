// SPDX-License-Identifier: Apache-2.0
#include "detect/detect.hpp"

#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "core/geometry/vectors.hpp"
#include "core/statistics/sample.hpp"
#include "detect/ellipses/ellipse_fit.hpp"
#include "detect/labels/labels.hpp"

namespace drape::detect {
namespace {

constexpr std::size_t blur_samples = 9;
constexpr std::size_t ring_samples = 16;
constexpr double least_light_centre = 0.35;
constexpr double most_full_centre = 0.15;
constexpr double nearest_counted = 0.55;  // smallest distance of a neighbour, in pitches
constexpr double farthest_counted = 1.45;
constexpr int least_neighbours = 2;
constexpr std::size_t least_dots = 9;  // smallest lattice piece that determines the dot size
/// Ranges of dot sizes in pictures: first the usual one, then smaller and larger.
constexpr std::array<DotSizes, 3> all_sizes = {{{4, 26}, {1.5, 8}, {16, 100}}};

struct Axes {
  Eigen::Vector2d semi_px;  // semi-axes: major, minor
  double angle_rad = 0;
};

Axes axes_of(const Eigen::Matrix2d& shape) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(shape);
  const Eigen::Vector2d major = eigen.eigenvectors().col(1);
  Axes axes;
  axes.semi_px = eigen.eigenvalues().cwiseMax(0).cwiseSqrt().reverse();
  axes.angle_rad = std::atan(major.x() == 0 ? 1e300 : major.y() / major.x());
  return axes;
}

double semi_major_px(const Blob& blob) {
  return axes_of(blob.shape_px2).semi_px.x();
}

/// Converts blobs to dots for labelling, before they are fitted.
std::vector<UnlabelledDot> dots_of(const std::vector<Blob>& blobs) {
  std::vector<UnlabelledDot> dots;
  for (const Blob& blob : blobs) dots.push_back({blob.centre_px, blob.shape_px2, true});
  return dots;
}

/// Number of similar-sized blobs one pitch away, as predicted by this blob's ellipse.
int neighbours_of(std::size_t blob, const std::vector<UnlabelledDot>& dots, const DotCells& cells,
                  const std::vector<double>& radii, const PrintPlane& plane) {
  const Eigen::Matrix2d undo = symmetric_root(dots[blob].shape_px2).inverse();
  const double radii_per_pitch = plane.pitch_m / plane.dot_radius_m, radius = radii[blob];
  int count = 0;
  for (const std::size_t k :
       cells.within(dots[blob].centre_px, farthest_counted * radii_per_pitch * radius)) {
    if (radii[k] < 0.6 * radius || radii[k] > 1.6 * radius) continue;
    const double pitches =
        (undo * (dots[k].centre_px - dots[blob].centre_px)).norm() / radii_per_pitch;
    count += pitches > nearest_counted && pitches < farthest_counted;
  }
  return count;
}

/// Unforeshortened radius of the majority of blobs that have neighbours about a pitch away; nullopt
/// if there are none.
std::optional<double> common_radius_px(const std::vector<Blob>& blobs, const PrintPlane& plane) {
  const std::vector<UnlabelledDot> dots = dots_of(blobs);
  const DotCells cells(dots);
  std::vector<double> radii, common;
  for (const Blob& blob : blobs) radii.push_back(semi_major_px(blob));
  double area = 0;
  for (std::size_t k = 0; k < blobs.size(); ++k) {
    if (neighbours_of(k, dots, cells, radii, plane) < least_neighbours) continue;
    common.push_back(radii[k]);
    area += radii[k] * radii[k];
  }
  // Median by area, so that the many small regions inside tags count less than the dots.
  std::ranges::sort(common);
  double below = 0;
  for (const double radius : common) {
    below += radius * radius;
    if (below >= area / 2) return radius;
  }
  return std::nullopt;
}

/// Dot radius from the largest lattice piece over all sizes, without tags. nullopt if no piece has
/// nine dots.
std::optional<double> lattice_radius_px(const GreyImage& image, const NoiseModel& noise,
                                        const PrintPlane& plane) {
  std::size_t most = least_dots - 1;
  std::optional<double> best;
  for (const DotSizes& sizes : all_sizes) {
    const std::vector<Blob> blobs =
        find_blobs(image, noise, sizes, plane.classes.has_value()).blobs;
    const auto pieces = grow_pieces(plane, dots_of(blobs), std::vector<char>(blobs.size(), 0));
    if (pieces.empty() || pieces.front().size() <= most) continue;
    most = pieces.front().size();
    std::vector<double> radii;
    for (const auto& [place, dot] : pieces.front()) radii.push_back(semi_major_px(blobs[dot]));
    best = median(std::move(radii));
  }
  return best;
}

/// Unforeshortened radius of a dot in this frame. A tag keeps its length perpendicular to its tilt,
/// so the larger singular value of its local map is the scale.
std::optional<double> dot_radius_px(const PrintPlane& plane,
                                    const std::vector<TagDetection>& tags) {
  std::vector<double> radii;
  for (const TagDetection& tag : tags) {
    const auto map =
        map_at_centre(plane.tag_corners_m(tag.id), tag.corners_px, plane.tags.at(tag.id));
    if (!map) continue;
    const double scale = Eigen::JacobiSVD<Eigen::Matrix2d>(map->px_per_m).singularValues()(0);
    radii.push_back(scale * plane.dot_radius_m);
  }
  if (radii.empty()) return std::nullopt;
  return median(radii);
}

/// Edge width of this frame, estimated from dots that are large enough to show it.
BlurGuess frame_blur(const GreyImage& image, const Blobs& found, const NoiseModel& noise,
                     double light_centre_fraction) {
  std::vector<const Blob*> largest;
  for (const Blob& blob : found.blobs) largest.push_back(&blob);
  std::ranges::stable_sort(largest, [](const Blob* a, const Blob* b) {
    return a->shape_px2.determinant() > b->shape_px2.determinant();
  });
  std::vector<double> widths;
  for (const Blob* blob : largest) {
    const auto width = blur_of_dot(image, found.map, noise, *blob, light_centre_fraction);
    if (width) widths.push_back(*width);
    if (widths.size() == blur_samples) break;
  }
  if (widths.size() < blur_samples / 3) return {};
  const double width = median(widths);
  return {width, 0.15 * width};
}

bool inside_tag(const Eigen::Vector2d& px, const TagDetection& tag) {
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector2d a = tag.corners_px.col(k);
    const Eigen::Vector2d b = tag.corners_px.col((k + 1) % 4);
    if (cross(b - a, px - a) < 0) return false;
  }
  return true;
}

std::vector<DotFit> fit_all(const GreyImage& image, const Blobs& found, const NoiseModel& noise,
                            double light_centre_fraction) {
  const BlurGuess blur = frame_blur(image, found, noise, light_centre_fraction);
  std::vector<DotFit> fits;
  fits.reserve(found.blobs.size());
  const std::size_t every = std::max<std::size_t>(1, found.blobs.size() / ring_samples);
  for (const Blob& blob : found.blobs) {
    const bool with_ring = fits.size() % every == every / 2;
    fits.push_back(fit_dot(image, found.map, noise, blob, blur, light_centre_fraction, with_ring));
  }
  return fits;
}

double largest_sigma(const Eigen::Matrix2d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()(1)));
}

/// True if a fit exceeds both the noise limit and an absolute one: a camera that sharpens or
/// smooths its pictures leaves little noise, against which any edge seems to misfit.
bool misfits(const DotFit& fit, const FrameLimits& limits) {
  return fit.chi2_per_dof > limits.most_chi2_per_dof && fit.misfit > limits.most_misfit;
}

/// Reason for rejecting a fit; empty if it is usable.
std::string fault(const DotFit& fit, const Eigen::Matrix2d& covariance, const FrameLimits& limits) {
  if (!fit.converged) return "bad fit: no blurred ellipse fits it";
  const Axes axes = axes_of(fit.shape_px2);
  const double radius_px = axes.semi_px.x();  // unforeshortened radius of the dot
  if (fit.masked_edge > limits.most_masked_edge) {
    return fmt::format(
        "partly covered: {:.0f} % of its outline lies beside a tag, another dark "
        "region or the image border",
        100 * fit.masked_edge);
  }
  if (fit.saturated) return "saturated: grey level 255 around the dot";
  if (axes.semi_px.y() < limits.least_semi_axis_px) {
    return fmt::format("too small: minor semi-axis {:.2f} px", axes.semi_px.y());
  }
  if (misfits(fit, limits)) {
    return fmt::format(
        "bad fit: residuals of {:.0f} % of the contrast, chi-square per degree of freedom {:.1f}",
        100 * fit.misfit, fit.chi2_per_dof);
  }
  if (fit.one_sided > limits.most_one_sided * std::max(1.0, fit.chi2_per_dof) &&
      fit.one_sided_px > limits.most_one_sided_radii * radius_px) {
    return fmt::format(
        "partly hidden or shadowed: the centre moves by {:.1f} % of the dot's radius without one "
        "eighth of the outline",
        100 * fit.one_sided_px / radius_px);
  }
  const double sigma = largest_sigma(covariance);
  if (sigma > limits.most_sigma_radii * radius_px) {
    return fmt::format("too uncertain: standard deviation {:.2f} px, {:.1f} % of the dot's radius",
                       sigma, 100 * sigma / radius_px);
  }
  return {};
}

Detection measured(const DotFit& fit, MarkId mark, const Eigen::Matrix2d& covariance) {
  const Axes axes = axes_of(fit.shape_px2);
  return {mark,           fit.centre_px, covariance,      axes.semi_px,
          axes.angle_rad, fit.contrast,  fit.chi2_per_dof};
}

/// Tags, and blobs that may be dots.
struct Found {
  std::vector<TagDetection> tags;
  Blobs blobs;
};

void drop_other_sizes(std::vector<Blob>& blobs, const DotSizes& sizes) {
  std::erase_if(blobs, [&](const Blob& blob) {
    const double major = semi_major_px(blob);
    return major < sizes.smallest_px || major > sizes.largest_px;
  });
}

/// Fast path: finds dots first, then reads the tags between them. nullopt if no tag can be read.
std::optional<Found> find_by_dots(const GreyImage& image, const NoiseModel& noise,
                                  const PrintPlane& plane, const TagFinder& finder) {
  if (!tags_sit_between_dots(plane)) return std::nullopt;
  Found found;
  found.blobs = find_blobs(image, noise, all_sizes.front(), plane.classes.has_value());
  const std::optional<double> radius_px = common_radius_px(found.blobs.blobs, plane);
  if (!radius_px) return std::nullopt;
  drop_other_sizes(found.blobs.blobs, DotSizes::around(*radius_px));
  found.tags = finder.read_between_dots(image, plane, dots_of(found.blobs.blobs), noise.sigma(128));
  if (found.tags.empty()) return std::nullopt;
  return found;
}

/// Thorough path: finds tags anywhere; these, or else the lattice, give the size of the dots.
Found find_by_tags(const GreyImage& image, const NoiseModel& noise, const PrintPlane& plane,
                   TagFinder& finder) {
  Found found;
  found.tags = finder.find(image, plane, noise.sigma(128));
  std::optional<double> radius_px = dot_radius_px(plane, found.tags);
  DotSizes sizes = DotSizes::around(radius_px.value_or(0));
  if (!radius_px) {
    radius_px = lattice_radius_px(image, noise, plane);
    // On a plate tilted towards the camera, some dots may appear twice as large as others.
    sizes = {0.4 * radius_px.value_or(0), 2.6 * radius_px.value_or(0)};
  }
  if (radius_px) found.blobs = find_blobs(image, noise, sizes, plane.classes.has_value());
  return found;
}

Found find_marks(const GreyImage& image, const NoiseModel& noise, const PrintPlane& plane,
                 TagFinder& finder) {
  std::optional<Found> found = find_by_dots(image, noise, plane, finder);
  if (!found) found = find_by_tags(image, noise, plane, finder);
  std::erase_if(found->blobs.blobs, [&](const Blob& blob) {
    return std::ranges::any_of(
        found->tags, [&](const TagDetection& tag) { return inside_tag(blob.centre_px, tag); });
  });
  return std::move(*found);
}

/// Labels a print without tags by its outline, which requires that the whole lattice is visible.
std::vector<DotLabel> label_by_outline(const PrintPlane& plane,
                                       const std::vector<UnlabelledDot>& dots,
                                       std::vector<LatticePiece>& pieces) {
  std::vector<DotLabel> labels(dots.size());
  for (DotLabel& label : labels) label.reason = "no label: the print's outline is not in view";
  // On cloth, cameras from different sides would each take a different corner as the first.
  if (pieces.empty() || !plane.stiff) return labels;
  const auto whole = place_whole_piece(plane, dots, pieces.front());
  if (!whole) return labels;
  for (const auto& [mark, dot] : *whole) labels[dot] = {mark, ""};
  pieces.clear();
  return labels;
}

/// Class of a dot: with light centre or full; undecided if it is too small or between the limits.
std::optional<bool> class_of(const DotFit& fit) {
  if (!fit.converged || !fit.centre_fraction) return std::nullopt;
  if (*fit.centre_fraction > least_light_centre) return true;
  if (*fit.centre_fraction < most_full_centre) return false;
  return std::nullopt;
}

struct Labels {
  std::vector<DotLabel> labels;
  std::vector<LatticePiece> islands;
};

/// Labels islands whose dot classes determine their position, unless a mark would occur twice.
void label_by_classes(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots,
                      Labels& found) {
  found.labels.resize(dots.size(), {std::nullopt, "no label: nothing leads to it"});
  std::set<MarkId> taken;
  for (const DotLabel& label : found.labels) {
    if (label.mark) taken.insert(*label.mark);
  }
  std::erase_if(found.islands, [&](const LatticePiece& piece) {
    const auto placed = place_by_classes(plane, dots, piece);
    if (!placed || std::any_of(placed->begin(), placed->end(),
                               [&](const auto& entry) { return taken.count(entry.first) != 0; })) {
      return false;
    }
    for (const auto& [mark, dot] : *placed) {
      found.labels[dot] = {mark, ""};
      taken.insert(mark);
    }
    return true;
  });
}

/// Extends the largest piece over the plane of a stiff print; moves dots of other pieces that it
/// reaches to it.
void join_flat_pieces(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots,
                      std::vector<LatticePiece>& pieces) {
  fill_flat_piece(plane, dots, pieces.front());
  std::set<std::size_t> joined;
  for (const auto& [place, dot] : pieces.front()) joined.insert(dot);
  for (std::size_t k = 1; k < pieces.size(); ++k) {
    std::erase_if(pieces[k], [&](const auto& entry) { return joined.count(entry.second) != 0; });
  }
  std::erase_if(pieces, [](const LatticePiece& piece) { return piece.empty(); });
}

void withdraw_off_plate(const std::vector<UnlabelledDot>& dots, std::vector<DotLabel>& labels) {
  LatticePiece labelled;
  for (std::size_t k = 0; k < labels.size(); ++k)
    if (labels[k].mark && labels[k].reason.empty()) labelled[*labels[k].mark] = k;
  for (const std::size_t dot : off_the_plate(dots, labelled))
    labels[dot].reason = "no label: it lies off the plate's grid";
}

Labels label_all(const PrintPlane& plane, const Found& found,
                 const std::vector<UnlabelledDot>& dots) {
  Labels result;
  if (!plane.tags.empty()) result.labels = label_dots(plane, found.tags, dots, found.blobs.map);
  std::vector<char> taken(dots.size(), 0);
  for (std::size_t k = 0; k < result.labels.size(); ++k) taken[k] = result.labels[k].mark ? 1 : 0;
  result.islands = grow_pieces(plane, dots, taken);
  if (plane.stiff && plane.tags.empty() && !result.islands.empty())
    join_flat_pieces(plane, dots, result.islands);
  if (plane.classes)
    label_by_classes(plane, dots, result);
  else if (plane.tags.empty())
    result.labels = label_by_outline(plane, dots, result.islands);
  if (plane.stiff) withdraw_off_plate(dots, result.labels);
  return result;
}

/// Island and position within it, for each dot.
std::vector<std::optional<std::pair<int, MarkId>>> places_of(
    const std::vector<LatticePiece>& islands, std::size_t dots) {
  std::vector<std::optional<std::pair<int, MarkId>>> places(dots);
  for (std::size_t k = 0; k < islands.size(); ++k) {
    for (const auto& [place, dot] : islands[k]) places[dot] = {static_cast<int>(k), place};
  }
  return places;
}

void sort_out(const std::vector<DotFit>& fits, const Labels& found, const FrameLimits& limits,
              FrameDetections& frame) {
  const Correlation correlation = frame_correlation(fits);
  const auto places = places_of(found.islands, fits.size());
  for (std::size_t k = 0; k < fits.size(); ++k) {
    const Eigen::Matrix2d covariance = honest_covariance(fits[k], correlation);
    const std::string wrong = fault(fits[k], covariance, limits);
    const DotLabel& label = found.labels[k];
    if (label.mark && label.reason.empty() && wrong.empty()) {
      frame.detections.push_back(measured(fits[k], *label.mark, covariance));
    } else if (places[k] && wrong.empty()) {
      frame.islands.push_back({places[k]->first, measured(fits[k], places[k]->second, covariance)});
    } else {
      frame.rejections.push_back(
          {label.mark, fits[k].centre_px, wrong.empty() ? label.reason : wrong});
    }
  }
  std::ranges::sort(frame.detections, {}, &Detection::mark);
  std::ranges::sort(frame.islands, [](const IslandDot& a, const IslandDot& b) {
    return std::tie(a.island, a.dot.mark) < std::tie(b.island, b.dot.mark);
  });
}

}  // namespace

FrameDetections detect_frame(const GreyImage& picture, const PrintPlane& plane, TagFinder& finder,
                             const FrameLimits& limits, double* blur_px) {
  const std::optional<GreyImage> even = without_mosaic(picture);
  std::optional<GreyImage> negative;
  if (plane.white_dots) negative = negative_of(even ? *even : picture);
  const GreyImage& image = negative ? *negative : even ? *even : picture;
  FrameDetections frame;
  frame.width_px = image.width_px;
  frame.height_px = image.height_px;
  const NoiseModel noise = estimate_noise(image);
  frame.noise_sigma = noise.sigma(128);
  const Found found = find_marks(image, noise, plane, finder);
  frame.tags = found.tags;
  const std::vector<DotFit> fits =
      fit_all(image, found.blobs, noise, plane.light_centre_fraction());
  std::vector<UnlabelledDot> dots;
  std::vector<double> blurs_px;
  for (const DotFit& fit : fits) {
    const bool sound =
        fit.converged && !misfits(fit, limits) && fit.masked_edge <= limits.most_masked_edge;
    if (sound) blurs_px.push_back(fit.blur_px);
    dots.push_back({fit.centre_px, fit.shape_px2, sound, class_of(fit)});
  }
  sort_out(fits, label_all(plane, found, dots), limits, frame);
  if (blur_px != nullptr) *blur_px = blurs_px.empty() ? 0 : median(std::move(blurs_px));
  return frame;
}

}  // namespace drape::detect
