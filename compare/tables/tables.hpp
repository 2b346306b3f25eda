// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compare/compare.hpp"
#include "core/files/json_file.hpp"

namespace drape::compare {

/// Builds a table of `Row`s column by column.
template <class Row>
class TableOf {
 public:
  using Cell = std::function<std::string(const Row&)>;
  explicit TableOf(std::string title = {}) { table_.title = std::move(title); }

  /// Adds a numeric column; `heading` is for people.
  void number(const std::string& name, const std::string& heading, Cell cell) {
    add(name, heading, true, std::move(cell));
  }
  void word(const std::string& name, const std::string& heading, Cell cell) {
    add(name, heading, false, std::move(cell));
  }
  template <class Range>
  [[nodiscard]] Table of(const Range& rows) {
    for (const Row& row : rows) {
      table_.rows.emplace_back();
      for (const Cell& cell : cells_) table_.rows.back().push_back(cell(row));
    }
    return std::move(table_);
  }

 private:
  void add(const std::string& name, const std::string& heading, bool numeric, Cell cell) {
    table_.names.push_back(name);
    table_.headings.push_back(heading);
    table_.numeric.push_back(numeric);
    cells_.push_back(std::move(cell));
  }
  Table table_;
  std::vector<Cell> cells_;
};

/// Text by RFC 4180: cells with a comma, quote or line break are quoted.
[[nodiscard]] std::string csv_of(const Table& table);
/// Array of objects; cells of numeric columns become numbers (integers if without a point), and
/// empty cells null.
[[nodiscard]] Json json_of(const Table& table);

/// The paper's odd tables: discretisation, segments, mean distance, followed by measures that the
/// paper does not have.
[[nodiscard]] Table real_virtual_table(const DrapeInput& input, const Report& report);
/// The equilibria of one list by energy, with the lowest and the one nearest to the real shape
/// marked.
[[nodiscard]] Table branch_table(const DrapeInput& input, const Report& report,
                                 const BranchSet& set);
/// Sentence without a full stop, such as "the real shape is nearest to branch 5 of 12 ...".
[[nodiscard]] std::string branch_sentence(const DrapeInput& input, const BranchSet& set);
/// Meshes without material coordinates: distances to surfaces, which are not distances of marks.
[[nodiscard]] Table surface_table(const DrapeInput& input, const Report& report);
/// The paper's even tables.
[[nodiscard]] Table virtual_virtual_table(const Report& report);
[[nodiscard]] Table virtual_group_table(const VirtualGroup& group);
/// Further statistics of one comparison: each with its standard deviation from the marks and
/// its bootstrap interval, the mean along the normal, and the remainder after a rigid
/// alignment.
[[nodiscard]] Table trust_table(const DrapeInput& input, const RealVirtual& row);
/// Covered area, drape coefficient, folds and their depth of every sheet that has them.
[[nodiscard]] Table drapemeter_table(const DrapeInput& input, const Report& report);
/// Folds and waves of every sheet that is a complete grid, in one number each (descriptors_of()).
[[nodiscard]] Table shape_table(const DrapeInput& input);
/// Power of height and curvature of the same sheets by wavelength.
[[nodiscard]] Table wave_table(const DrapeInput& input);
/// Edges and cells of the measured lattice with the strain of both sheets, per cent.
[[nodiscard]] Table strain_table(const RealVirtual& row);
/// One row per measured mark: its sigma and views, and its distance from every simulation.
[[nodiscard]] Table mark_table(const DrapeInput& input, const Report& report);

/// One row per mark without a distance, with its reason.
[[nodiscard]] Table gap_table(const DrapeInput& input, const Report& report);
/// Millimetres with three decimals; empty if absent.
[[nodiscard]] std::string mm_text(double length_m);
[[nodiscard]] std::string mm_text(const std::optional<double>& length_m);

}  // namespace drape::compare
