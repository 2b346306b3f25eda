// SPDX-License-Identifier: Apache-2.0
#include "compare/repeats/repeat_sheets.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <optional>

#include "compare/records/provenance.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/statistics/distributions.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

[[noreturn]] void refuse(const SheetFile& sheet, const std::string& what, const std::string& field,
                         const std::string& remedy = "give layings and simulations of one drape") {
  throw bad_input(what, {.file = sheet.file.string(), .field = field}, remedy);
}

/// Throws for a simulation among the layings, which would change the range of real drapes.
void require_kinds(const std::vector<SheetFile>& repeats,
                   const std::vector<SheetFile>& virtual_sheets) {
  for (const SheetFile& sheet : repeats)
    if (!sheet.sheet.is_measured())
      refuse(sheet, "a simulation is no laying of the real cloth", "source",
             "give measured sheets, and each simulation after a --compare of its own");
  for (const SheetFile& sheet : virtual_sheets)
    if (sheet.sheet.is_measured())
      refuse(sheet, "a measured sheet is no simulation to be judged", "source",
             "give it among the layings, without --compare");
}

void require_same_bench(const SheetFile& sheet, const SheetFile& first) {
  const std::string other = first.file.string();
  if ((sheet.sheet.patch_m - first.sheet.patch_m).norm() > 0.01 * mm)
    refuse(sheet, "it is another patch than " + other, "patch_mm");
  if (!sheet.sheet.is_measured()) return;
  if (sheet.measured().calibration_sha256 != first.measured().calibration_sha256)
    refuse(sheet, "it was measured with another calibration than " + other,
           "source.calibration_sha256");
  if (sheet.face() != first.face())
    refuse(sheet, "another face of the cloth lies up than in " + other, "source.repeat.face");
}

}  // namespace

void require_one_drape(const std::vector<SheetFile>& repeats,
                       const std::vector<SheetFile>& virtual_sheets) {
  require_kinds(repeats, virtual_sheets);
  std::map<std::string, std::string> seen;
  for (const SheetFile& sheet : repeats)
    if (const auto [other, is_new] = seen.emplace(sheet.ply_sha256, sheet.file.string()); !is_new)
      refuse(sheet, "it is a copy of " + other->second + ", which is no repeat", "marks");
  const SheetFile* first = nullptr;
  for (const auto* sheets : {&repeats, &virtual_sheets}) {
    for (const SheetFile& sheet : *sheets) {
      const std::string scene = sheet.scene();
      if (first == nullptr && !scene.empty()) first = &sheet;
      if (!scene.empty() && scene != first->scene())
        refuse(sheet,
               fmt::format("it is of scene `{}`, {} is of scene `{}`", scene, first->file.string(),
                           first->scene()),
               "source");
      require_same_bench(sheet, repeats.front());
    }
  }
  for (const SheetFile& sheet : repeats) {
    const bool placed =
        std::any_of(virtual_sheets.begin(), virtual_sheets.end(), [&](const SheetFile& simulation) {
          const auto& start = std::get<SimulatedSource>(simulation.sheet.source).start_sha256;
          return start && sheet.has_content(*start);
        });
    if (sheet.scene().empty() && !placed)
      refuse(sheet, "the sheet does not say which drape it is a laying of", "source.repeat",
             "name it by a [[repeat]] of the rig, or measure it with drape triangulate --repeat "
             "NAME --scene FILE");
  }
}

std::vector<std::string> no_go_of(const std::vector<SheetFile>& sheets) {
  std::vector<std::string> reasons;
  for (const SheetFile& sheet : sheets) {
    const auto* source = std::get_if<SimulatedSource>(&sheet.sheet.source);
    if (sheet.sheet.no_go)
      reasons.push_back(fmt::format("{}: {}", sheet.file.string(), *sheet.sheet.no_go));
    else if (source != nullptr && source->status != "at rest")
      reasons.push_back(fmt::format("{}: the simulation is not at rest: {}", sheet.file.string(),
                                    source->status));
  }
  return reasons;
}

namespace {

/// Median of chi square over the common marks; nullopt if fewer than ten have
/// covariances.
std::optional<double> median_chi2(const Sheet& first, const Sheet& second) {
  constexpr std::size_t kLeastMarks = 10;
  std::vector<double> chi2;
  for (const SheetMark& mark : first.marks) {
    const SheetMark* other = second.find(mark.mark);
    if (other == nullptr || !mark.covariance_m2 || !other->covariance_m2) continue;
    const Eigen::Vector3d apart_m = other->point_in_world - mark.point_in_world;
    chi2.push_back(
        apart_m.dot((*mark.covariance_m2 + *other->covariance_m2).ldlt().solve(apart_m)));
  }
  return chi2.size() < kLeastMarks ? std::nullopt : std::optional(median(std::move(chi2)));
}

}  // namespace

std::map<std::string, std::string> layings_twice(const std::vector<const SheetFile*>& sheets,
                                                 Among pairs) {
  constexpr double kRisk = 0.005;
  std::map<std::string, std::string> reasons;
  for (auto own = sheets.begin(); own != sheets.end(); ++own) {
    for (auto other = sheets.begin(); other != own; ++other) {
      const std::string &set = (*own)->measured().set, &earlier = (*other)->measured().set;
      const bool same_drape = !(*own)->scene().empty() && (*own)->scene() == (*other)->scene();
      if (set == earlier || same_drape != (pairs == Among::one_drape)) continue;
      const auto chi2 = median_chi2((*own)->sheet, (*other)->sheet);
      if (!chi2 || *chi2 > chi_square_beyond(kRisk, 3)) continue;
      const std::string text = fmt::format(
          "sets {} and {} show one laying: half of their marks lie at the same places within chi "
          "square {:.1f}; look which drape the pictures of each set show, and record the other "
          "again",
          earlier, set, *chi2);
      reasons[(*own)->sha256] = text;
      reasons[(*other)->sha256] = text;
    }
  }
  return reasons;
}

}  // namespace drape::compare
