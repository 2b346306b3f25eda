// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/store/inputs.hpp"
#include "compare/store/store.hpp"
#include "core/acceptance_file.hpp"
#include "core/program/run_record.hpp"

namespace drape::compare {

/// Label and operator of a run, as given by the user.
struct RunLabel {
  std::string label = {}, operator_name = {};
};

/// Result of an import.
struct ImportCounts {
  int added = 0;    ///< comparisons that are new in the store
  int present = 0;  ///< comparisons that were already there

  void count(bool is_new) { ++(is_new ? added : present); }
  ImportCounts& operator+=(const ImportCounts& other) {
    added += other.added;
    present += other.present;
    return *this;
  }
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
  /// Sentence for the verdict line: the reasons, or of simulations alone the pairs compared.
  [[nodiscard]] std::string sentence() const;
};

/// Compares every drape and every group of the session.
void compare_session(const Session& session, const Options& options, Outcome& outcome);

/// Adds the calibration, every comparison, the run and the content behind them to the store at
/// `file`, in one transaction. Warns if the clock is before the store's last run.
[[nodiscard]] ImportCounts import_session(const std::filesystem::path& file, const Session& session,
                                          Outcome& outcome, const RunLabel& label = {});

/// Adds the residuals of the calibration to which measured sheets refer.
void add(Writer& writer, const Calibration& calibration, const std::string& sha256);
/// Adds all comparisons of one drape. `recording` names the source of the photographs.
ImportCounts add(Writer& writer, const DrapeInput& input, const Report& report,
                 const std::optional<RecordingId>& recording = {});
/// Adds pairs of simulations without a real cloth.
ImportCounts add(Writer& writer, const VirtualGroup& group);

/// One value behind a run, as in its file.
struct RunValue {
  std::string owner;  ///< "scene A", "fabric A", "calibration", "simulations"
  std::string key;    ///< "friction", "object.1.x_mm"
  std::string value;
  bool stand_in = false;  ///< true if the file states that it was not measured
};

/// True if an entry of `stand_ins` refers to the value with this key in its file. The hysteresis of
/// a curve is not the curve, and the bending stiffness at 45 degrees is not the bending curves.
[[nodiscard]] bool stands_in_for(const std::string& what, const std::string& key);

/// Values of the scenes and fabrics of a session, of its calibration and simulations, sorted.
/// Hysteresis that is a stand-in has its own row, since it has no key in the file.
[[nodiscard]] std::vector<RunValue> values_of(const Session& session, const Outcome& outcome);

/// Key of the row that records when a run was stored again, after `before` others.
[[nodiscard]] std::string repetition_key(const std::string& run_sha256, const std::string& date,
                                         int before);

/// Counts of sheets of a study.
struct ApartCounts : ImportCounts {
  std::size_t unfinished = 0;  ///< without a run record: left out
};

/// Adds simulated sheets individually, without comparing them. Some hundreds at a time are held in
/// memory and written in one transaction. Throws Error(usage) for a measured sheet, and like
/// read_session().
[[nodiscard]] ApartCounts import_simulations(const std::filesystem::path& store,
                                             std::vector<std::filesystem::path> sheets);

/// Reasons why an acceptance does not apply to the measurements of this session: made for another
/// calibration, or expired on the day of the recording. Empty if it applies.
[[nodiscard]] std::vector<std::string> doubts_of(const AcceptanceFile& acceptance,
                                                 const Session& session);

/// Reasons why results from a calibration of the session are NO-GO, by the calibration's SHA-256:
/// its last acceptance is NO-GO, among those in the store (if any) and the given one, which counts
/// as the later of two on one day.
[[nodiscard]] std::map<std::string, std::string> reason_in_store(
    const std::filesystem::path& store, const Session& session,
    const std::optional<AcceptanceFile>& given = {});

/// Reads the acceptance, if given, as an input of `record`, before anything is compared; its doubts
/// become warnings. Reasons against it and against those in the outcome's store are added to the
/// outcome.
[[nodiscard]] std::optional<AcceptanceFile> look_at_acceptance(const std::filesystem::path& file,
                                                               const Session& session,
                                                               Outcome& outcome, RunRecord& record);

/// Stores an acceptance, once.
void store_acceptance(const std::filesystem::path& store, const AcceptanceFile& acceptance);

}  // namespace drape::compare
