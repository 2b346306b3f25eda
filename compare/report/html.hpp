// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compare/report/figures.hpp"
#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"
#include "compare/tables/tables.hpp"

namespace drape::compare {

/// All pictures of one drape; `headline` of Report is set.
struct DrapeFigures {
  std::vector<Figure> overlays;
  std::vector<Figure> renders;  ///< as overlays; empty without a calibration
  Figure sheet, map, histogram, strain;
  std::optional<Figure> convergence, hem, fabric;
};

[[nodiscard]] std::string html_style();
/// A last column of pictures: markup, one cell per row of its table.
struct PictureColumn {
  std::string head;
  std::vector<std::string> cells;
};
/// `<table>` with the headings for people; numeric columns right-aligned.
[[nodiscard]] std::string html_table(const Table& table, const std::string& css_class = {},
                                     const PictureColumn& pictures = {});
[[nodiscard]] std::string html_figure(const Figure& figure, const std::string& css_class = {});

/// Table and remark of the meshes without marks; empty when there are none.
[[nodiscard]] std::string html_surfaces(const DrapeInput& input, const Report& report);

/// Tables of equilibria, and the one that the real shape took; empty when there are none.
[[nodiscard]] std::string html_branches(const DrapeInput& input, const Report& report);

/// Where the millimetres come from, as drape simulate sensitivity found; empty when it was not run.
[[nodiscard]] std::string html_error_split(const DrapeFiles& drape);

/// The first page: both verdicts of each drape with distance and U, and what the run rests on.
[[nodiscard]] std::string html_certificate(const Session& session, const Outcome& outcome);
/// Residuals and coverage of each camera, and all warnings; empty without a calibration.
[[nodiscard]] std::string html_calibration(const Session& session);
/// Every value of a drape's scene and fabric files, stand-ins marked.
[[nodiscard]] std::string html_values(const Session& session, const Outcome& outcome,
                                      const std::string& drape);

/// The whole section of one drape; `values` is what html_values() made.
[[nodiscard]] std::string html_drape(const DrapeFiles& drape, const Report& report,
                                     const Session& session, const DrapeFigures& figures,
                                     const std::string& values);
/// One mark as each camera saw it, cut out of the photographs of this page; empty without these.
[[nodiscard]] std::string crops_of_mark(const std::string& drape, const DrapeFiles& files,
                                        MarkId mark);
/// What is in the stated uncertainty and what is not.
[[nodiscard]] std::string html_budget(const DrapeFiles& drape, const Report& report);
/// Files with hashes, programs, and the commands that make everything again.
[[nodiscard]] std::string html_provenance(const Session& session, const Outcome& outcome,
                                          const std::filesystem::path& report_folder);

}  // namespace drape::compare
