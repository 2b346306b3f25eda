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

/// Label and operator of a run, as given by the user.
struct RunLabel {
  std::string label = {}, operator_name = {};
};

/// Result of one call of drape-compare.
struct Outcome {
  std::vector<Report> reports;            ///< in the order of Session::drapes
  std::vector<VirtualGroup> groups = {};  ///< in the order of Session::virtual_only
  std::vector<std::string> warnings;      ///< warnings of the stages, the session and every drape
  std::vector<std::string> not_compared = {};  ///< drapes without a sheet, each with the reason
  /// Reason why the acceptance of a calibration is NO-GO, by the calibration's SHA-256.
  std::map<std::string, std::string> not_accepted = {};
  std::optional<ImportCounts> stored;
  int run = 0;                         ///< number in the store; 0 without a store
  std::string date;                    ///< date of the run in the store; empty without a store
  std::string label, operator_name;    ///< as given by the user
  std::string store;                   ///< as given by the user; can be empty
  std::string report;                  ///< as given by the user; can be empty
  std::vector<std::string> arguments;  ///< command line, for the report

  [[nodiscard]] bool go() const;
  /// Reasons such as "A: only 7 marks could be compared, 10 are asked for".
  [[nodiscard]] std::vector<std::string> reasons() const;
  /// Sentence for the verdict line.
  [[nodiscard]] std::string sentence() const;
};

/// Compares every drape and every group of the session.
void compare_session(const Session& session, const Options& options, Outcome& outcome);

/// Adds the calibration, every comparison, the run and the content behind them to the store at
/// `file`, in one transaction. Warns if the clock is before the store's last run.
[[nodiscard]] ImportCounts import_session(const std::filesystem::path& file, const Session& session,
                                          Outcome& outcome, const RunLabel& label = {});

/// Adds the content from which the numbers of the session are computed, under its hashes.
void add_content(class Writer& writer, const Session& session, const std::filesystem::path& store);

}  // namespace drape::compare
