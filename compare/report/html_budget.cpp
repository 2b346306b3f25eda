// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "compare/report/html.hpp"
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

std::string calibration_text(const Session& session) {
  double largest = 0, rms_px = 0;
  for (const CalibratedCamera& camera : session.calibration->cameras) {
    largest = std::max(largest, camera.residuals.object_rms_mm);
    rms_px = std::max(rms_px, camera.residuals.rms_px);
  }
  return fmt::format("target points: up to {:.3f} mm RMS from their ray ({:.3f} px) in one camera",
                     largest, rms_px);
}

std::string grid_text(const Report& report) {
  for (auto row = report.virtual_virtual.rbegin(); row != report.virtual_virtual.rend(); ++row) {
    if (row->label.find("seg:") != std::string::npos) {
      return fmt::format("{}: {:.2f} mm mean distance", row->label, row->statistics.mean_m / mm);
    }
  }
  return "no two grids were given";
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
         "<p class=\"soft\">drape sensitivity drapes the scene once more (the grid and segments "
         "are in its run record) and repeats it with one thing changed: from the drape itself, "
         "which "
         "keeps the branch, and from the start, which may end on another. The changes do not add "
         "up.</p>\n";
}

std::string html_budget(const DrapeFiles& drape, const Report& report, const Session& session) {
  const RealVirtual& best = report.real_virtual[*report.best];
  const std::string unknown = "not stated by the measured sheet";
  Table table;
  table.names = {"contribution", "size", "in the ± of the mean"};
  table.numeric = {false, false, false};
  table.add({"centres of the dots and geometry of the views (covariance of each mark)",
             report.measurement.sigma_median_m
                 ? fmt::format("median {:.4f} mm, largest {:.4f} mm per mark",
                               *report.measurement.sigma_median_m / mm,
                               *report.measurement.sigma_max_m / mm)
                 : unknown,
             "yes, marks taken as independent"});
  if (const auto& budget = drape.input.measured.sheet.error_budget) {
    const auto rms = [](double length_m) {
      return fmt::format("{:.4f} mm RMS over the marks", length_m / mm);
    };
    table.add({"of it: noise of the dots' centres in the images", rms(budget->detection_m), "yes"});
    table.add({"of it: bent and slanted dots", rms(budget->dot_shape_m), "yes"});
    if (budget->calibration_m)
      table.add({"of it: uncertainty of the cameras", rms(*budget->calibration_m),
                 "as if independent: what moves all marks together is not averaged out in truth"});
  }
  const auto excess = noise_excess_m(best);
  table.add({"noise only ever lengthens a distance",
             excess ? fmt::format("mean at most {:.4f} mm too long", *excess / mm) : unknown,
             "no, and not subtracted"});
  table.add({"calibration, shared by all marks",
             session.calibration ? calibration_text(session) : "no calibration was given", "no"});
  table.add({"grid of the simulation", grid_text(report), "no: it is part of what is measured"});
  table.add({"size and place of the object, friction, fabric properties",
             "as the scene and fabric files state them", "no: they are what is judged"});
  table.add({"repeatability of the real drape",
             fmt::format("one drape of set {}",
                         std::get<MeasuredSource>(drape.input.measured.sheet.source).set),
             "no: it takes several drapes"});
  return "<h3>Uncertainty</h3>\n" + html_table(table) +
         "<p class=\"soft\">± of a distance is sqrt(u' C u), with u the unit vector from the real "
         "to the virtual point and C the covariance of the mark; ± of the mean over n marks is "
         "sqrt(sum of these squared) / n. All are one standard deviation.</p>\n";
}

}  // namespace drape::compare
