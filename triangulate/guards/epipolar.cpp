// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/epipolar.hpp"

#include <map>

#include "core/statistics/sample.hpp"

namespace drape::triangulate {
namespace {

/// Creases and wrong labels, two of fourteen marks on a drawn bench, are no matter of the cameras;
/// a camera that moved misses most marks.
struct PairMisses {
  std::vector<double> sigmas, px;
};

}  // namespace

std::vector<PairAgreement> pair_agreements(const std::vector<MarkViews>& marks,
                                           const std::vector<Placed>& placed, double min_angle_rad,
                                           int least_marks) {
  std::map<std::pair<std::string, std::string>, PairMisses> pairs;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const std::vector<View>& views =
        placed[i].shaped_views.empty() ? marks[i].views : placed[i].shaped_views;
    for (std::size_t a = 0; a < views.size(); ++a) {
      for (std::size_t b = a + 1; b < views.size(); ++b) {
        const Point point = solve_point({views[a], views[b]}, min_angle_rad);
        if (point.status != PointStatus::good) continue;
        PairMisses& pair = pairs[{views[a].camera->camera.name, views[b].camera->camera.name}];
        pair.sigmas.push_back(point.disagreement_sigmas());
        pair.px.push_back(point.rms_px());
      }
    }
  }
  std::vector<PairAgreement> result;
  for (auto& [cameras, misses] : pairs) {
    if (static_cast<int>(misses.sigmas.size()) < least_marks) continue;
    result.push_back({cameras.first, cameras.second, static_cast<int>(misses.sigmas.size()),
                      median(misses.sigmas), median(misses.px)});
  }
  return result;
}

}  // namespace drape::triangulate
