// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "detect/labels/lattice.hpp"

namespace drape::detect {
namespace {

constexpr int least_known = 12;      // dots of the piece that show their class
constexpr double most_wrong = 0.05;  // fraction of them that may disagree at the right place
constexpr double least_lead = 0.15;  // fraction by which any other place must be worse
constexpr int least_lead_dots = 3;

struct Place {
  int wrong = 0;
  LatticePiece marks;
};

int known_classes(const std::vector<UnlabelledDot>& dots, const LatticePiece& piece) {
  return static_cast<int>(std::count_if(piece.begin(), piece.end(), [&](const auto& entry) {
    return dots[entry.second].light_centre.has_value();
  }));
}

bool disagrees(const DotClasses& classes, const UnlabelledDot& dot, MarkId mark) {
  return dot.light_centre && *dot.light_centre != classes.is_light(mark);
}

/// All places that the piece has room for, in one of the four turns.
void add_places(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots,
                const LatticePiece& piece, std::vector<Place>& places) {
  int last_row = 0, last_col = 0;
  for (const auto& [place, dot] : piece) {
    last_row = std::max(last_row, place.row);
    last_col = std::max(last_col, place.col);
  }
  for (int row = 0; row + last_row < plane.rows; ++row) {
    for (int col = 0; col + last_col < plane.cols; ++col) {
      Place candidate;
      for (const auto& [place, dot] : piece) {
        const MarkId mark{place.row + row, place.col + col};
        candidate.marks[mark] = dot;
        candidate.wrong += disagrees(*plane.classes, dots[dot], mark);
      }
      places.push_back(std::move(candidate));
    }
  }
}

}  // namespace

std::optional<LatticePiece> place_by_classes(const PrintPlane& plane,
                                             const std::vector<UnlabelledDot>& dots,
                                             const LatticePiece& piece) {
  const int known = known_classes(dots, piece);
  if (!plane.classes || known < least_known) return std::nullopt;
  std::vector<Place> places;
  LatticePiece turned = piece;
  for (int quarter = 0; quarter < 4; ++quarter, turned = quarter_turn(turned)) {
    add_places(plane, dots, turned, places);
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.wrong < b.wrong; });
  if (places.empty() || places[0].wrong > most_wrong * known) return std::nullopt;
  const double lead = std::max<double>(least_lead_dots, least_lead * known);
  if (places.size() > 1 && places[1].wrong < places[0].wrong + lead) return std::nullopt;
  LatticePiece result = std::move(places[0].marks);
  std::erase_if(result, [&](const auto& entry) {
    return disagrees(*plane.classes, dots[entry.second], entry.first);
  });
  return result;
}

}  // namespace drape::detect
