// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/history/results.hpp"

namespace drape::compare {

/// A page as one file: bundled core/page, `data` under the id `kind` ("report", "history"), and
/// pictures by the names used in the data. It fetches nothing and runs no other script.
[[nodiscard]] std::string page_of(
    const std::string& title, const std::string& kind, const Value& data,
    const std::map<std::string, std::vector<unsigned char>>& jpegs = {});

/// Hash of a script for a Content-Security-Policy.
[[nodiscard]] std::string script_hash(const std::string& script);

/// Bundle and style of core/page, as built.
[[nodiscard]] const char* page_script();
[[nodiscard]] const char* page_style();

/// Geometry of a VTK file: measured marks, their positions on the simulation that represents the
/// drape, or a line from each mark to its position.
enum class VtkPart { measured, simulated, distance };
/// VTK XML (.vtp) of the marks with a distance, in millimetres; cells with four such marks are
/// faces. Point data: distance_mm (active), sigma_distance_mm, sigma_mm, row, col.
[[nodiscard]] std::string vtp_of(const ReportedDrape& drape, VtkPart part);

/// Writes the page `file` (self-contained), report.json with the same stem, and, in a folder named
/// like the stem, the tables as .csv and the marks as .vtp. Removes files of an earlier report that
/// this one does not write, recognised by name. Returns the files written, the page last. Equal
/// records give equal bytes.
std::vector<std::filesystem::path> write_report(const std::filesystem::path& file,
                                                const RunReport& report);

/// The whole store on one self-contained page: calibration residuals and distances of each drape
/// over the imports, with alarms, and every comparison. Equal stores give equal bytes. NO-GO for an
/// alarm or if a current comparison is NO-GO.
struct HistoryPage {
  std::string html;
  bool go = true;
};
[[nodiscard]] HistoryPage history_page(const StoreReader& store, const TrendOptions& options);

}  // namespace drape::compare

template <>
inline constexpr std::string_view drape::names_of<drape::compare::VtkPart>[] = {"real", "virtual",
                                                                                "distance"};
