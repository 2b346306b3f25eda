// SPDX-License-Identifier: Apache-2.0
#include "compare/hems/mark_repeats.hpp"

#include <fmt/format.h>

#include <cmath>

#include "compare/metrics/surface.hpp"
#include "core/error.hpp"

namespace drape::compare {
namespace {

constexpr int kLeastRepeats = 3;

/// Marks of the first repeat that all have.
std::vector<const SheetMark*> common_marks(const std::vector<NamedSheet>& repeats) {
  std::vector<const SheetMark*> common;
  for (const SheetMark& mark : repeats.front().sheet.marks) {
    bool everywhere = true;
    for (const NamedSheet& other : repeats)
      everywhere = everywhere && other.sheet.find(mark.mark) != nullptr;
    if (everywhere) common.push_back(&mark);
  }
  return common;
}

}  // namespace

MarkRepeats mark_repeats(const std::vector<NamedSheet>& repeats,
                         const std::vector<NamedSheet>& virtual_sheets, double significance) {
  if (repeats.empty()) throw usage_error("no repeat is named", "give measured sheets");
  const auto marks = common_marks(repeats);
  if (marks.empty())
    throw bad_input("the repeats have no mark in common", {.file = repeats.front().name},
                    "give sheets of one print");
  MarkRepeats result;
  result.marks = static_cast<int>(marks.size());
  for (const NamedSheet& a : repeats) {
    result.real_to_real_m.emplace_back();
    for (const NamedSheet& b : repeats) {
      double squares = 0;
      for (const SheetMark* mark : marks)
        squares +=
            (a.sheet.find(mark->mark)->point_in_world - b.sheet.find(mark->mark)->point_in_world)
                .squaredNorm();
      result.real_to_real_m.back().push_back(std::sqrt(squares / result.marks));
    }
  }
  for (const NamedSheet& candidate : virtual_sheets) {
    const Surface surface(candidate.sheet, candidate.name);
    MarkRepeats::Match match{candidate.name, 0, {}, {}, "undecided", {}};
    std::vector<double> squares(repeats.size(), 0.0);
    for (const SheetMark* mark : marks) {
      const auto point = surface.at(mark->material_m);
      if (!point) continue;
      ++match.marks;
      for (std::size_t i = 0; i < repeats.size(); ++i)
        squares[i] += (repeats[i].sheet.find(mark->mark)->point_in_world - point->point_in_world)
                          .squaredNorm();
    }
    if (match.marks == 0)
      throw bad_input("the virtual sheet has none of the repeats' marks", {.file = candidate.name},
                      "give a sheet of the same patch");
    for (const double s : squares) match.distances_m.push_back(std::sqrt(s / match.marks));
    if (static_cast<int>(repeats.size()) < kLeastRepeats) {
      match.reason = fmt::format("{} real drape{}: nothing says how far repeats lie apart",
                                 repeats.size(), repeats.size() == 1 ? "" : "s");
    } else {
      match.judgement = judge_points({result.real_to_real_m, match.distances_m});
      if (match.judgement.p)
        match.verdict = *match.judgement.p < significance ? "outside" : "inside";
      else
        match.reason = "the repeats are copies of each other";
    }
    result.matches.push_back(std::move(match));
  }
  return result;
}

}  // namespace drape::compare
