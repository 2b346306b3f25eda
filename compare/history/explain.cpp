// SPDX-License-Identifier: Apache-2.0
#include "compare/history/results.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Eigenvalues>

#include "compare/drape_input.hpp"

namespace drape::compare {

namespace fs = std::filesystem;

std::optional<fs::path> place_in(const StoreReader& store, RecordBook& book,
                                 const std::string& sha256) {
  std::optional<fs::path> had;
  for (const std::string& path : store.column<std::string>(
           "SELECT path FROM file WHERE sha256 = ? ORDER BY path", {sha256})) {
    const fs::path place = (folder_of(store.file()) / path).lexically_normal();
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
               const std::string& what, const std::string& sha256, Answer& result) {
  const auto add = [&](int depth, const std::string& file, const std::string& made_by,
                       const std::string& hash, const std::string& state) {
    result.tables.back().add({std::to_string(depth),
                              std::string(2 * static_cast<std::size_t>(depth), ' ') + file, made_by,
                              hash, state});
    result.good = result.good && state == "unchanged";
  };
  const auto file_of = place_in(store, book, sha256);
  if (!file_of)
    return add(0, what, "imported before the store kept where files lie", sha256, "not followed");
  const fs::path& file = *file_of;
  if (const auto other = other_mesh_id(file); other && other->sha256 == sha256) {
    add(0, file.generic_string(), "written by people", *book.sha256(file), "unchanged");
    return add(1, other->mesh.generic_string(), "another simulator's mesh", other->mesh_sha256,
               "unchanged");
  }
  if (const auto now = book.sha256(file); now && *now != sha256 && store.blob(sha256))
    return add(0, file.generic_string(), "in the store; the file was made again since", sha256,
               "not traced");
  for (const ChainLink& link : chain_of(book, file, sha256, followed))
    add(link.depth, link.file.generic_string(), link.made_by, link.sha256, link.state);
}

/// Rows of numbers: the query of one by its key, and columns with the hashes of the files from
/// which it was computed.
struct Subject {
  const char *table, *row;
  std::vector<std::pair<const char*, const char*>> roots;
};
const Subject kSubjects[] = {
    {"comparison",
     R"sql(
SELECT c.*, m.sigma_median_mm, m.sigma_max_mm, b.energy_uJ, b.residual_per_particle_weight,
  b.hem_nodes, t.turned_mean_mm, t.turn_deg
FROM comparison AS c JOIN sheet AS m ON m.sha256 = c.measured_sha256
  LEFT JOIN branch AS b ON b.sheet_sha256 = c.simulated_sha256
  LEFT JOIN branch_turn AS t ON t.comparison_sha256 = c.sha256 WHERE c.sha256 = ?)sql",
     {{"measured sheet", "measured_sha256"}, {"virtual sheet", "simulated_sha256"}}},
    {"surface_comparison",
     "SELECT * FROM surface_comparison WHERE sha256 = ?",
     {{"measured sheet", "measured_sha256"}, {"virtual sheet", "mesh_sha256"}}},
    {"simulation_pair",
     "SELECT * FROM simulation_pair WHERE sha256 = ?",
     {{"measured sheet", "measured_sha256"},
      {"first virtual sheet", "first_sha256"},
      {"second virtual sheet", "second_sha256"}}},
    {"sheet",
     R"sql(
SELECT s.sha256, s.sigma_median_mm, s.sigma_max_mm, d.* FROM sheet AS s
  LEFT JOIN drapemeter AS d ON d.sheet_sha256 = s.sha256 WHERE s.sha256 = ?)sql",
     {{"sheet", "sha256"}}},
    {"calibration",
     R"sql(
SELECT calibration_sha256, camera, points, rms_px, max_px, object_rms_mm FROM calibration_camera
WHERE calibration_sha256 = ?1 AND (?2 = '' OR camera = ?2))sql",
     {{"calibration", "calibration_sha256"}}}};
constexpr const char* kMark = R"sql(
SELECT e.*, c.measured_sha256, c.simulated_sha256 FROM mark_error AS e
  JOIN comparison AS c ON c.id = e.comparison_id
WHERE c.sha256 = ? AND e."row" = ? AND e."col" = ?)sql";

/// The row of a number. Throws Error(usage) for a mark that a comparison lacks, and if a residual
/// is not that of one camera.
Table row_of(const StoreReader& store, const Subject& subject, const std::string& key,
             const WhyOptions& options) {
  const std::string table = subject.table;
  if (table == "comparison" && options.mark) {
    Table row = store.query(kMark, {key, options.mark->row, options.mark->col});
    if (!row.rows.empty()) return row;
    throw usage_error(
        fmt::format("mark {}, {} is not in this comparison", options.mark->row, options.mark->col),
        "see its marks with drape-results show " + key.substr(0, 12));
  }
  if (table != "calibration") return store.query(subject.row, {key});
  Table row = store.query(subject.row, {key, options.camera});
  if (row.rows.size() == 1) return row;
  const auto names = store.column<std::string>(
      "SELECT camera FROM calibration_camera WHERE calibration_sha256 = ?", {key});
  if (names.empty())
    throw usage_error("the store has the name of this calibration, not its residuals",
                      "import its sheets again with --calibration calibration.json");
  throw usage_error("a residual is that of one camera",
                    fmt::format("give --camera, one of: {}", fmt::join(names, ", ")));
}

/// Verdict on the measurement in the last run that contains the number.
void add_verdict(const StoreReader& store, bool of_marks, const std::string& key, Table& number) {
  const std::string last = of_marks ? "comparison AS k JOIN (" + state_query() +
                                          ") AS s ON s.comparison_id = k.id WHERE k.sha256 = ?"
                                    : "(" + sheet_state_query() + ") AS s WHERE s.sheet_sha256 = ?";
  for (const auto& [verdict, cause, state] : store.rows<std::string, std::string, std::string>(
           "SELECT s.measurement, s.cause, s.state FROM " + last + " AND s.state IS NOT NULL",
           {key})) {
    number.add({"measurement", verdict + (cause.empty() ? "" : ": " + cause)});
    number.add({"state", state});
  }
}

using Eigen::Matrix3d;
using Eigen::Vector3d;
using units::mm;

constexpr double kMovedRisk = 0.05;  ///< probability of a false alarm, over all marks of a sheet
constexpr double kWritten_m = 1e-6 * mm;  ///< resolution of positions in sheet.json

/// Fraction of the marks' covariance due to the calibration; 1 if unknown.
double calibration_share(const Sheet& sheet) {
  if (!sheet.error_budget || !sheet.error_budget->calibration_m) return 1;
  return std::pow(*sheet.error_budget->calibration_m / sheet.error_budget->total_m, 2);
}

/// The matrix with positive eigenvalues: for a difference of covariances, neither of which
/// dominates.
Matrix3d positive(const Matrix3d& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(symmetric);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseAbs().asDiagonal() *
         eigen.eigenvectors().transpose();
}

}  // namespace

Answer explain(const StoreReader& store, const std::string& key, const std::string& metric,
               const WhyOptions& options) {
  const auto& [table, sha256] = stored_key(
      store, key, {"comparison", "surface_comparison", "simulation_pair", "sheet", "calibration"});
  const bool of_marks = table == "comparison";
  of_marks ? require_comparisons(store, {sha256}) : store.require_as_written(table, {sha256});
  if (table == "sheet") store.require_as_written("drapemeter", {sha256});
  if (table == "calibration") store.require_as_written("calibration_camera", {sha256});
  const Subject& subject =
      *std::find_if(std::begin(kSubjects), std::end(kSubjects),
                    [&of = table](const auto& one) { return one.table == of; });
  const Table row = row_of(store, subject, sha256, options);
  const auto value = [&](const std::string& name) {
    const auto at = row.column(name);
    return at && !row.rows.empty() ? std::optional(row.rows[0][*at]) : std::nullopt;
  };
  std::vector<std::string> names;
  Metric meaning;
  for (const Metric& known : metric_dictionary(store)) {
    if (!value(std::get<0>(known))) continue;
    names.push_back(std::get<0>(known));
    if (names.back() == metric) meaning = known;
  }
  const auto& [name, unit, definition] = meaning;
  if (name.empty())
    throw usage_error(fmt::format("there is no metric `{}` here", metric),
                      fmt::format("there are: {}", fmt::join(names, ", ")));
  Answer result;
  result.tables = {Table({"what", "value"}),
                   Table({"depth", "file", "made_by", "sha256", "state"}, {0})};
  const auto add = [&](const std::string& what, const std::string& text) {
    result.tables.front().add({what, text});
  };
  const std::string number = *value(metric);
  add(metric, number.empty() ? "not known" : number + " " + unit);
  add("definition", definition);
  add(table, sha256);
  if (const auto judged = of_marks || table == "sheet" ? sha256 : value("measured_sha256"))
    add_verdict(store, of_marks, *judged, result.tables.front());
  if (of_marks && options.mark) {
    add("mark", fmt::format("row {}, col {}", options.mark->row, options.mark->col));
  } else if (of_marks) {
    add("rows", fmt::format("{} rows of mark_error (drape-results show {})", *value("marks"),
                            sha256.substr(0, 12)));
    add("worst mark", fmt::format("row {}, col {}", *value("worst_row"), *value("worst_col")));
  }
  if (const auto camera = value("camera")) add("camera", *camera);
  RecordBook book;
  std::set<fs::path> followed;
  for (const auto& [what, column] : subject.roots)
    if (const auto root = value(column); root && !root->empty())
      add_chain(store, book, followed, what, *root, result);
  return result;
}

/// The only comparison of marks whose key starts with `key`.
static std::string full_key(const StoreReader& store, const std::string& key) {
  const auto& [table, sha256] = stored_key(store, key);
  if (table == "comparison") return sha256;
  throw usage_error(fmt::format("`{}` compares a surface without marks", key),
                    "see it with drape-results show or why");
}

Answer difference_of(const StoreReader& store, const std::string& first,
                     const std::string& second) {
  const std::string a = full_key(store, first), b = full_key(store, second);
  require_comparisons(store, {a, b});
  const Table rows = store.query(fmt::format(R"sql(
SELECT s.scene, {} AS discretisation, s.segments, s.simulator, s.model, c.*,
  coalesce(z.measurement, 'not stated') AS measurement
FROM comparison AS c JOIN simulation AS s ON s.sheet_sha256 = c.simulated_sha256
  JOIN ({}) AS z ON z.comparison_id = c.id
WHERE c.sha256 IN (?1, ?2) ORDER BY c.sha256 <> ?1)sql",
                                             kDiscretisation, state_query()),
                                 {a, b});
  Table metrics({"what", "A", "B", "B - A", "unit"}, {1, 2, 3});
  std::map<std::string, std::string> units;
  for (const auto& [name, unit, definition] : metric_dictionary(store)) units[name] = unit;
  const auto &one = rows.rows.front(), &two = rows.rows.back();
  metrics.add({"measurement", one.back(), two.back(), "", ""});
  for (std::size_t i = 0; i + 1 < rows.names.size(); ++i) {
    const auto unit = units.find(rows.names[i]);
    if (unit != units.end() && !one[i].empty() && !two[i].empty()) {
      const double own = std::stod(one[i]), other = std::stod(two[i]);
      metrics.add({rows.names[i], fmt::format("{:.4f}", own), fmt::format("{:.4f}", other),
                   fmt::format("{:+.4f}", other - own), unit->second});
    } else if (unit == units.end() && one[i] != two[i] && rows.names[i] != "id") {
      // Every command accepts the beginning of a hash.
      const auto shown = [](const std::string& cell) {
        return cell.size() == 64 ? cell.substr(0, 12) : cell;
      };
      metrics.add({rows.names[i], shown(one[i]), shown(two[i]), "", ""});
    }
  }
  Table marks = store.query(R"sql(
SELECT a."row", a."col", round(a.distance_mm, 3) AS a_mm, round(b.distance_mm, 3) AS b_mm,
  round(b.distance_mm - a.distance_mm, 3) AS b_minus_a_mm
FROM mark_error AS a JOIN mark_error AS b ON b."row" = a."row" AND b."col" = a."col"
WHERE a.comparison_id = (SELECT id FROM comparison WHERE sha256 = ?1)
  AND b.comparison_id = (SELECT id FROM comparison WHERE sha256 = ?2)
ORDER BY a."row", a."col")sql",
                            {a, b});
  return {{}, {std::move(metrics), std::move(marks)}};
}

bool MarkMove::moved(std::size_t marks) const {
  return chi2 > chi_square_beyond(kMovedRisk / static_cast<double>(marks), 3);
}

SheetMoves moves_between(const Sheet& first, const Sheet& second, const SharedNoise& shared) {
  std::vector<std::pair<const SheetMark*, const SheetMark*>> both;
  for (const SheetMark& mark : first.marks)
    if (const SheetMark* other = second.find(mark.mark)) both.emplace_back(&mark, other);
  const auto count = static_cast<Eigen::Index>(both.size());
  Eigen::Matrix3Xd from(3, count), to(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    from.col(i) = both[static_cast<std::size_t>(i)].first->point_in_world;
    to.col(i) = both[static_cast<std::size_t>(i)].second->point_in_world;
  }
  const auto rigid = rigid_motion(from, to);
  if (!rigid)
    throw bad_input("fewer than three marks are in both sheets, or they lie in one line", {},
                    "compare runs that measured the same set");
  const double own_share = shared.detections ? calibration_share(first) : 1,
               other_share = shared.detections ? calibration_share(second) : 1;
  SheetMoves moves{*rigid, {}};
  for (const auto& [own, other] : both) {
    const Matrix3d own_m2 = own_share * own->covariance_m2.value_or(Matrix3d::Zero()),
                   other_m2 = other_share * other->covariance_m2.value_or(Matrix3d::Zero());
    MarkMove move{own->mark, other->point_in_world - *rigid * own->point_in_world,
                  shared.detections && shared.calibrating ? positive(other_m2 - own_m2)
                                                          : Matrix3d(own_m2 + other_m2),
                  0};
    move.covariance_m2 += kWritten_m * kWritten_m * Matrix3d::Identity();
    move.chi2 = move.by_m.dot(move.covariance_m2.ldlt().solve(move.by_m));
    moves.marks.push_back(move);
  }
  return moves;
}

Answer moved_marks(const StoreReader& store, int first, int second) {
  require_run(store, first);
  require_run(store, second);
  store.require_as_written({.runs = {first, second}});
  const auto pairs = store.rows<std::string, std::string, std::string, std::string, int, int, int>(
      "SELECT a.scene, a.set_name, a.measured_sha256, b.measured_sha256, m.detections_sha256 = "
      "n.detections_sha256 OR coalesce(a.pictures_sha256 = b.pictures_sha256, 0), "
      "m.calibration_sha256 = n.calibration_sha256, coalesce(p.recording_sha256 = "
      "q.recording_sha256, 0) FROM run_drape AS a JOIN run_drape AS b ON b.run = ?2 AND "
      "b.scene = a.scene AND b.set_name = a.set_name JOIN sheet AS m ON m.sha256 = "
      "a.measured_sha256 JOIN sheet AS n ON n.sha256 = b.measured_sha256 JOIN run AS p ON "
      "p.number = a.run JOIN run AS q ON q.number = b.run WHERE a.run = ?1 ORDER BY a.scene, "
      "a.set_name",
      {first, second});
  if (pairs.empty())
    throw usage_error(fmt::format("runs {} and {} measured no set in common", first, second),
                      "see the runs with: drape results runs");
  Table sets({"scene", "set", "marks", "moved", "rigid_shift_mm", "rigid_turn_deg", "rms_mm",
              "largest_mm", "shared"},
             {2, 3, 4, 5, 6, 7});
  Table listed({"scene", "set", "row", "col", "x_mm", "y_mm", "z_mm", "moved_mm", "u_mm",
                "chi_square", "moved"},
               {2, 3, 4, 5, 6, 7, 8, 9});
  const auto sheet_of = [&](const std::string& sha256, const std::string& set) {
    if (const auto content = store.blob(sha256))
      return read_record<Sheet>(
          Document(store.file().string() + ", blob " + sha256, Syntax::json, *content));
    throw bad_input(fmt::format("the store lacks the measured sheet of set {}", set),
                    {.file = store.file().string(), .field = sha256},
                    "compare runs whose sheets it has: drape results verify names those that it "
                    "lacks");
  };
  const auto in_mm_4 = [](double length_m) { return fmt::format("{:.4f}", length_m / mm); };
  std::size_t moved_all = 0, marks_all = 0;
  for (const auto& [scene, set, own, other, same_pictures, same_calibration, same_recording] :
       pairs) {
    const SharedNoise shared{same_pictures != 0, same_calibration != 0 || same_recording != 0};
    const SheetMoves moves = moves_between(sheet_of(own, set), sheet_of(other, set), shared);
    double squares = 0, largest_m = 0;
    std::size_t moved = 0;
    for (const MarkMove& mark : moves.marks) {
      const bool is_moved = mark.moved(moves.marks.size());
      moved += is_moved;
      squares += mark.by_m.squaredNorm();
      largest_m = std::max(largest_m, mark.by_m.norm());
      listed.add({scene, set, std::to_string(mark.mark.row), std::to_string(mark.mark.col),
                  in_mm_4(mark.by_m.x()), in_mm_4(mark.by_m.y()), in_mm_4(mark.by_m.z()),
                  in_mm_4(mark.by_m.norm()), in_mm_4(2 * worst_sigma_m(mark.covariance_m2)),
                  fmt::format("{:.1f}", mark.chi2), is_moved ? "moved" : ""});
    }
    const double turn = Eigen::AngleAxisd(moves.rigid.rotation).angle();
    sets.add({scene, set, std::to_string(moves.marks.size()), std::to_string(moved),
              in_mm_4(moves.rigid.translation_m.norm()), fmt::format("{:.5f}", turn / units::deg),
              in_mm_4(std::sqrt(squares / static_cast<double>(moves.marks.size()))),
              in_mm_4(largest_m),
              !shared.detections      ? "nothing: other pictures"
              : same_calibration != 0 ? "pictures and calibration"
              : shared.calibrating    ? "pictures, calibrating pictures too"
                                      : "pictures"});
    moved_all += moved;
    marks_all += moves.marks.size();
  }
  return {fmt::format("{} of {} marks moved between runs {} and {} beyond what their calibrations' "
                      "uncertainty explains (rigid part taken out; 5 % risk a set)",
                      moved_all, marks_all, first, second),
          {std::move(sets), std::move(listed)},
          moved_all == 0};
}

}  // namespace drape::compare
