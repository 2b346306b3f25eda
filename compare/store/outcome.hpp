// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compare/compare.hpp"
#include "compare/store/inputs.hpp"
#include "compare/store/store.hpp"

namespace drape::compare {

/// Words of people about a run.
struct RunLabel {
  std::string label = {}, operator_name = {};
};

/// Result of one call of drape-compare.
struct Outcome {
  std::vector<Report> reports;            ///< in the order of Session::drapes
  std::vector<VirtualGroup> groups = {};  ///< in the order of Session::virtual_only
  std::vector<std::string> warnings;      ///< warnings of the stages, the session and every drape
  std::vector<std::string> not_compared = {};  ///< drapes that came to no sheet, each with why
  /// Why the acceptance of a calibration is NO-GO, by the calibration's SHA-256.
  std::map<std::string, std::string> not_accepted = {};
  std::optional<ImportCounts> stored;
  int run = 0;                         ///< its number in the store; 0 without one
  std::string date;                    ///< date of the run, as stored; empty without one
  std::string label, operator_name;    ///< as given
  std::string store;                   ///< as given; may be empty
  std::string report;                  ///< as given; may be empty
  std::vector<std::string> arguments;  ///< command line, for the report

  [[nodiscard]] bool go() const;
  /// "A: only 7 marks could be compared, 10 are asked for"
  [[nodiscard]] std::vector<std::string> reasons() const;
  /// One sentence for the verdict line.
  [[nodiscard]] std::string sentence() const;
};

/// Compares every drape and every group of the session.
void compare_session(const Session& session, const Options& options, Outcome& outcome);

/// Adds the calibration, every comparison, the run and the content behind them to the store at
/// `file`, in one transaction. Warns of a clock that is before the store's last run.
[[nodiscard]] ImportCounts import_session(const std::filesystem::path& file, const Session& session,
                                          Outcome& outcome, const RunLabel& label = {});

/// Adds what the numbers of the session are computed from, under its hashes.
void add_content(class Writer& writer, const Session& session, const std::filesystem::path& store);

}  // namespace drape::compare
