// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "compare/report/html.hpp"
#include "compare/tables/budget.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

/// Noise makes every distance longer: by at most sigma^2 / d each, to second order.
std::optional<double> noise_excess_m(const RealVirtual& row) {
  double sum = 0;
  for (const MarkError& mark : row.marks.marks) {
    if (!mark.sigma_mark_m || !(mark.distance_m > 0)) return std::nullopt;
    sum += std::min(*mark.sigma_mark_m * *mark.sigma_mark_m / mark.distance_m, *mark.sigma_mark_m);
  }
  return sum / static_cast<double>(row.marks.marks.size());
}

}  // namespace

std::string html_error_split(const DrapeFiles& drape) {
  if (!drape.error_split) return {};
  const ErrorSplitFile& split = *drape.error_split;
  std::string text = "<h3>Where the millimetres come from</h3>\n";
  if (const std::string sentence = error_split_sentence(split); !sentence.empty())
    text += "<p>Over " + std::to_string(split.marks) + " marks: " + xml(sentence) + ".</p>\n";
  if (!split.values.empty()) text += html_table(value_effect_table(split));
  if (!split.variants.empty()) text += html_table(variant_effect_table(split));
  return text +
         "<p class=\"soft\">drape simulate sensitivity drapes the scene once more (the grid and "
         "segments "
         "are in its run record) and repeats it with one thing changed: from the drape itself, "
         "which "
         "keeps the branch, and from the start, which may end on another. The changes do not add "
         "up.</p>\n";
}

std::string html_budget(const DrapeFiles& drape, const Report& report) {
  const RealVirtual& headline = report.real_virtual[*report.headline];
  std::string text = "<h3>Uncertainty</h3>\n";
  if (report.budget) {
    text += html_table(budget_table(*report.budget)) + "<p>" +
            xml(budget_sentence(*report.budget)) + ".</p>\n";
  }
  if (const auto error = grid_error_of(drape.input, report))
    text += "<p>The grid's error: " + xml(grid_sentence(*error)) + ".</p>\n";
  if (const auto& budget = drape.input.measured.sheet.error_budget) {
    text += fmt::format(
        "<p class=\"soft\">Of a mark, RMS over the sheet: noise of the dots' centres {:.4f} mm, "
        "bent "
        "and slanted dots {:.4f} mm{}.</p>\n",
        budget->detection_m / mm, budget->dot_shape_m / mm,
        budget->calibration_m ? fmt::format(", cameras {:.4f} mm", *budget->calibration_m / mm)
                              : std::string());
  }
  if (const auto excess = noise_excess_m(headline))
    text += fmt::format(
        "<p class=\"soft\">Noise only lengthens a distance: the mean is at most {:.4f} mm too "
        "long, "
        "which is not subtracted.</p>\n",
        *excess / mm);
  return text +
         "<p class=\"soft\">± of a distance is sqrt(u' C u), with u the unit vector from the real "
         "to the virtual point and C the covariance of the mark. U is half of what holds "
         "at least 95 of 100 means when all that the mean rests on is drawn together (JCGM 101); "
         "each line "
         "of the table is the spread where it alone is drawn. It holds no repeat of the real drape "
         "and no other equilibrium, and what friction leaves open only where an ensemble was "
         "made.</p>\n";
}

}  // namespace drape::compare
