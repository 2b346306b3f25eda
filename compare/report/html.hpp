// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compare/report/figures.hpp"
#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"
#include "compare/tables/tables.hpp"
#include "core/drawing/svg.hpp"

namespace drape::compare {

/// The pictures of one drape; `headline` of Report is set.
struct DrapeFigures {
  std::vector<Figure> overlays;
  std::vector<Figure> renders;  ///< overlays; empty without a calibration
  Figure sheet, map, histogram, strain;
  std::optional<Figure> hem;

  [[nodiscard]] std::vector<const Figure*> all() const;
};

/// A whole page; nothing is fetched, and of scripts only those run that are given.
[[nodiscard]] std::string html_page(const std::string& title, const std::string& body,
                                    const std::vector<std::string>& scripts = {});
[[nodiscard]] std::string html_paragraph(const std::string& text);
[[nodiscard]] std::string html_note(const std::string& text);  ///< a paragraph in grey
/// A last column of pictures: markup, one cell per row of its table.
struct PictureColumn {
  std::string head;
  std::vector<std::string> cells;
};
/// `<table>` with the headings for people; numeric columns right-aligned. Empty without a row.
[[nodiscard]] std::string html_table(const Table& table, const std::string& css_class = {},
                                     const PictureColumn& pictures = {});
[[nodiscard]] std::string html_figure(const Figure& figure, const std::string& css_class = {});

/// The first page: both verdicts of each drape with distance and U, and what the run rests on.
[[nodiscard]] std::string html_certificate(const Session& session, const Outcome& outcome);
/// Residuals and coverage of each camera, and all warnings; empty without a calibration.
[[nodiscard]] std::string html_calibration(const Session& session);
/// Every value of a drape's scene and fabric files, stand-ins marked.
[[nodiscard]] std::string html_values(const Session& session, const Outcome& outcome,
                                      const std::string& drape);
/// Table and remark of the meshes without marks; empty when there are none.
[[nodiscard]] std::string html_surfaces(const DrapeInput& input, const Report& report);
/// The whole section of one drape; `values` is what html_values() made.
[[nodiscard]] std::string html_drape(const DrapeFiles& drape, const Report& report,
                                     const Session& session, const DrapeFigures& figures,
                                     const std::string& values);
/// Files with hashes, programs, and the commands that make everything again.
[[nodiscard]] std::string html_provenance(const Session& session, const Outcome& outcome,
                                          const std::filesystem::path& report_folder);

}  // namespace drape::compare
