// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "compare/history/results.hpp"
#include "compare/meshes/other_mesh.hpp"
#include "compare/records/provenance.hpp"
#include "compare/schema/schema.hpp"
#include "core/error.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

}  // namespace

std::optional<fs::path> place_in(const StoreReader& store, RecordBook& book,
                                 const std::string& sha256) {
  std::optional<fs::path> had;
  for (const fs::path& place : store.places_of(sha256)) {
    if (book.sha256(place) == sha256) return place;
    if (!had) had = place;
  }
  // Another simulator's mesh has the hash of two files; shows the one that people wrote.
  if (const auto content = had ? std::nullopt : store.blob(sha256))
    if (const auto description = description_in(*content))
      return place_in(store, book, *description);
  return had;
}

namespace {

void add_chain(const StoreReader& store, RecordBook& book, std::set<fs::path>& followed,
               const std::string& what, const std::string& sha256, Explanation& result) {
  const auto file_of = place_in(store, book, sha256);
  if (!file_of) {
    result.chain.add(
        {"0", what, "imported before the store kept where files lie", sha256, "not followed"});
    result.complete = false;
    return;
  }
  const fs::path& file = *file_of;
  if (const auto other = other_mesh_id(file); other && other->sha256 == sha256) {
    result.chain.add(
        {"0", file.generic_string(), "written by people", *book.sha256(file), "unchanged"});
    result.chain.add({"1", "  " + other->mesh.generic_string(), "another simulator's mesh",
                      other->mesh_sha256, "unchanged"});
    return;
  }
  if (const auto now = book.sha256(file); now && *now != sha256 && store.blob(sha256)) {
    result.chain.add({"0", file.generic_string(), "in the store; the file was made again since",
                      sha256, "not traced"});
    result.complete = false;
    return;
  }
  for (const ChainLink& link : chain_of(book, file, sha256, followed)) {
    const std::string indent(2 * static_cast<std::size_t>(link.depth), ' ');
    result.chain.add({std::to_string(link.depth), indent + link.file.generic_string(), link.made_by,
                      link.sha256, link.state});
    result.complete = result.complete && link.state == "unchanged";
  }
}

double number_of(const std::string& text) {
  return text.empty() ? 0 : std::stod(text);
}

/// Row of a number, and the files from which it was computed.
struct Subject {
  Table row;
  std::vector<std::pair<std::string, std::string>> roots;  ///< files with their names and SHA-256

  [[nodiscard]] std::optional<std::string> value(const std::string& name) const {
    const auto at = row.column(name);
    return at && !row.rows.empty() ? std::optional(row.rows[0][*at]) : std::nullopt;
  }
  void add_root(const std::string& what, const std::string& column) {
    if (const auto sha256 = value(column); sha256 && !sha256->empty())
      roots.emplace_back(what, *sha256);
  }
};

constexpr const char* kComparison =
    "SELECT c.*, m.sigma_median_mm, m.sigma_max_mm, b.energy_uJ, b.residual_per_particle_weight, "
    "b.hem_nodes, t.turned_mean_mm, t.turn_deg FROM comparison AS c JOIN sheet AS m ON m.sha256 = "
    "c.measured_sha256 LEFT JOIN branch AS b ON b.sheet_sha256 = c.simulated_sha256 LEFT JOIN "
    "branch_turn AS t ON t.comparison_sha256 = c.sha256 WHERE c.sha256 = ?";
constexpr const char* kMark =
    "SELECT e.*, c.measured_sha256, c.simulated_sha256 FROM mark_error AS e JOIN comparison AS c "
    "ON c.id = e.comparison_id WHERE c.sha256 = ? AND e.\"row\" = ? AND "
    "e.\"col\" = ?";
constexpr const char* kSheet =
    "SELECT s.sha256, s.sigma_median_mm, s.sigma_max_mm, d.* FROM sheet AS s LEFT JOIN drapemeter "
    "AS d ON d.sheet_sha256 = s.sha256 WHERE s.sha256 = ?";
constexpr const char* kCamera =
    "SELECT calibration_sha256, camera, points, rms_px, max_px, object_rms_mm FROM "
    "calibration_camera WHERE calibration_sha256 = ?1 AND (?2 = '' OR camera = ?2)";

Subject comparison_subject(const StoreReader& store, const std::string& key,
                           const std::optional<MarkId>& mark) {
  Subject subject;
  subject.row =
      mark ? store.query(kMark, {key, mark->row, mark->col}) : store.query(kComparison, {key});
  if (subject.row.rows.empty())
    throw usage_error(fmt::format("mark {}, {} is not in this comparison", mark->row, mark->col),
                      "see its marks with drape-results show " + key.substr(0, 12));
  subject.add_root("measured sheet", "measured_sha256");
  subject.add_root("virtual sheet", "simulated_sha256");
  return subject;
}

Subject camera_subject(const StoreReader& store, const std::string& key,
                       const std::string& camera) {
  Subject subject{store.query(kCamera, {key, camera}), {}};
  if (subject.row.rows.size() != 1) {
    std::string names;
    for (const auto& [sha256, name] : store.rows<std::string, std::string>(kCamera, {key, ""}))
      names += (names.empty() ? "" : ", ") + name;
    if (names.empty())
      throw usage_error("the store has the name of this calibration, not its residuals",
                        "import its sheets again with --calibration calibration.json");
    throw usage_error("a residual is that of one camera", "give --camera, one of: " + names);
  }
  subject.add_root("calibration", "calibration_sha256");
  return subject;
}

Subject subject_of(const StoreReader& store, const StoredKey& stored, const WhyOptions& options) {
  if (stored.table == "comparison") return comparison_subject(store, stored.sha256, options.mark);
  if (stored.table == "calibration") return camera_subject(store, stored.sha256, options.camera);
  Subject subject;
  if (stored.table == "sheet") {
    subject.row = store.query(kSheet, {stored.sha256});
    subject.add_root("sheet", "sha256");
    return subject;
  }
  subject.row = store.query("SELECT * FROM " + stored.table + " WHERE sha256 = ?", {stored.sha256});
  subject.add_root("measured sheet", "measured_sha256");
  subject.add_root("virtual sheet", "mesh_sha256");
  subject.add_root("first virtual sheet", "first_sha256");
  subject.add_root("second virtual sheet", "second_sha256");
  return subject;
}

/// Throws Error(usage) that names the metrics of the subject.
Metric meaning_of(const StoreReader& store, const Subject& subject, const std::string& metric) {
  std::string names;
  for (Metric& known : metric_dictionary(store)) {
    const std::string& name = std::get<0>(known);
    if (!subject.value(name)) continue;
    if (name == metric) return std::move(known);
    names += (names.empty() ? "" : ", ") + name;
  }
  throw usage_error(fmt::format("there is no metric `{}` here", metric), "there are: " + names);
}

/// Verdict on the measurement in the last run that contains the number.
void add_verdict(const StoreReader& store, const StoredKey& stored, const Subject& subject,
                 Table& number) {
  const bool of_marks = stored.table == "comparison";
  const auto subject_key = of_marks || stored.table == "sheet" ? std::optional(stored.sha256)
                                                               : subject.value("measured_sha256");
  if (!subject_key) return;
  const std::string last = of_marks ? "comparison AS k JOIN (" + state_query() +
                                          ") AS s ON s.comparison_id = k.id WHERE k.sha256 = ?"
                                    : "(" + sheet_state_query() + ") AS s WHERE s.sheet_sha256 = ?";
  for (const auto& [verdict, cause, state] : store.rows<std::string, std::string, std::string>(
           "SELECT s.measurement, s.cause, s.state FROM " + last + " AND s.state IS NOT NULL",
           {*subject_key})) {
    number.add({"measurement", verdict + (cause.empty() ? "" : ": " + cause)});
    number.add({"state", state});
  }
}

}  // namespace

Explanation explain(const StoreReader& store, const std::string& key, const std::string& metric,
                    const WhyOptions& options) {
  const StoredKey stored = stored_key(
      store, key, {"comparison", "surface_comparison", "simulation_pair", "sheet", "calibration"});
  stored.table == "comparison" ? require_comparisons(store, {stored.sha256})
                               : store.require_as_written(stored.table, {stored.sha256});
  if (stored.table == "sheet") store.require_as_written("drapemeter", {stored.sha256});
  if (stored.table == "calibration")
    store.require_as_written("calibration_camera", {stored.sha256});
  const Subject subject = subject_of(store, stored, options);
  const auto [name, unit, definition] = meaning_of(store, subject, metric);
  Explanation result;
  result.number = Table({"what", "value"});
  const std::string number = *subject.value(metric);
  result.number.add({metric, number.empty() ? "not known" : number + " " + unit});
  result.number.add({"definition", definition});
  result.number.add({stored.table, stored.sha256});
  add_verdict(store, stored, subject, result.number);
  if (options.mark && stored.table == "comparison") {
    result.number.add(
        {"mark", fmt::format("row {}, col {}", options.mark->row, options.mark->col)});
  } else if (stored.table == "comparison") {
    result.number.add({"rows", *subject.value("marks") +
                                   " rows of mark_error (drape-results show " +
                                   stored.sha256.substr(0, 12) + ")"});
    result.number.add({"worst mark", fmt::format("row {}, col {}", *subject.value("worst_row"),
                                                 *subject.value("worst_col"))});
  }
  if (const auto camera = subject.value("camera")) result.number.add({"camera", *camera});
  result.chain = Table({"depth", "file", "made_by", "sha256", "state"}, {0});
  RecordBook book;
  std::set<fs::path> followed;
  for (const auto& [what, sha256] : subject.roots)
    add_chain(store, book, followed, what, sha256, result);
  return result;
}

Difference difference_of(const StoreReader& store, const std::string& first,
                         const std::string& second) {
  const std::string a = full_key(store, first), b = full_key(store, second);
  require_comparisons(store, {a, b});
  const Table rows = store.query(
      "SELECT s.scene, " + std::string(kDiscretisation) +
          " AS discretisation, s.segments, "
          "s.simulator, s.model, c.*, coalesce(z.measurement, 'not stated') AS measurement FROM "
          "comparison AS c JOIN simulation AS s ON s.sheet_sha256 = c.simulated_sha256 JOIN (" +
          state_query() +
          ") AS z ON z.comparison_id = c.id WHERE c.sha256 IN (?1, ?2) ORDER BY c.sha256 <> ?1",
      {a, b});
  Difference result;
  result.metrics = Table({"what", "A", "B", "B - A", "unit"}, {1, 2, 3});
  const auto units = metric_dictionary(store);
  const auto& one = rows.rows.front();
  const auto& two = rows.rows.back();
  result.metrics.add({"measurement", one.back(), two.back(), "", ""});
  for (std::size_t i = 0; i + 1 < rows.names.size(); ++i) {
    const auto unit = std::find_if(units.begin(), units.end(), [&](const Metric& known) {
      return std::get<0>(known) == rows.names[i];
    });
    if (unit != units.end() && !one[i].empty() && !two[i].empty()) {
      result.metrics.add({rows.names[i], fmt::format("{:.4f}", number_of(one[i])),
                          fmt::format("{:.4f}", number_of(two[i])),
                          fmt::format("{:+.4f}", number_of(two[i]) - number_of(one[i])),
                          std::get<1>(*unit)});
    } else if (unit == units.end() && one[i] != two[i] && rows.names[i] != "id") {
      // Every command accepts the beginning of a hash.
      const auto shown = [](const std::string& cell) {
        return cell.size() == 64 ? cell.substr(0, 12) : cell;
      };
      result.metrics.add({rows.names[i], shown(one[i]), shown(two[i]), "", ""});
    }
  }
  result.marks = store.query(
      "SELECT a.\"row\", a.\"col\", round(a.distance_mm, 3) AS a_mm, round(b.distance_mm, 3) AS "
      "b_mm, round(b.distance_mm - a.distance_mm, 3) AS b_minus_a_mm FROM mark_error AS a JOIN "
      "mark_error AS b ON b.\"row\" = a.\"row\" AND b.\"col\" = a.\"col\" WHERE a.comparison_id = "
      "(SELECT id FROM comparison WHERE sha256 = ?1) AND b.comparison_id = (SELECT id FROM "
      "comparison WHERE sha256 = ?2) ORDER BY a.\"row\", a.\"col\"",
      {a, b});
  return result;
}

}  // namespace drape::compare
