// SPDX-License-Identifier: Apache-2.0
#include "compare/store.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <SQLiteCpp/VariadicBind.h>
#include <fmt/format.h>

#include "compare/sqlite_error.hpp"
#include "core/files.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using units::mm;

void bind_one(SQLite::Statement& statement, int index, const std::string& value) {
  statement.bind(index, value);
}
void bind_one(SQLite::Statement& statement, int index, int value) {
  statement.bind(index, value);
}
void bind_one(SQLite::Statement& statement, int index, double value) {
  statement.bind(index, value);
}
template <class T>
void bind_one(SQLite::Statement& statement, int index, const std::optional<T>& value) {
  if (value) bind_one(statement, index, *value);  // an unbound parameter is NULL
}

/// Inserts one row; a row that is there already is left as it is.
template <class... Values>
void insert(SQLite::Database& database, const std::string& into, const Values&... values) {
  std::string marks = "?";
  for (std::size_t i = 1; i < sizeof...(values); ++i) marks += ", ?";
  SQLite::Statement statement(
      database, fmt::format("INSERT INTO {} VALUES ({}) ON CONFLICT DO NOTHING", into, marks));
  int index = 0;
  (bind_one(statement, ++index, values), ...);
  statement.exec();
}

std::optional<double> in_mm(const std::optional<double>& length_m) {
  return length_m ? std::optional(*length_m / mm) : std::nullopt;
}

void insert_calibration(SQLite::Database& database, const std::string& sha256,
                        const std::string& rig, const std::optional<std::string>& method) {
  insert(database, "rig", rig);
  insert(database, "calibration", sha256, rig, method);
}

void insert_measured(SQLite::Database& database, const SheetFile& file,
                     const Measurement& measurement) {
  const Sheet& sheet = file.sheet;
  const auto& source = std::get<MeasuredSource>(sheet.source);
  insert_calibration(database, source.calibration_sha256, source.rig, std::nullopt);
  insert(database, "sheet", file.sha256, std::string("measured"), sheet.rows, sheet.cols,
         sheet.patch_m.x() / mm, sheet.patch_m.y() / mm, measurement.marks, measurement.gaps,
         source.rig, source.set, source.calibration_sha256, source.detections_sha256,
         in_mm(measurement.sigma_median_m), in_mm(measurement.sigma_max_m));
  for (const Gap& gap : sheet.gaps)
    insert(database, "gap", file.sha256, gap.mark.row, gap.mark.col, gap.reason);
}

std::optional<std::string> certificate_json(const Simulation& simulation) {
  if (!simulation.certificate) return std::nullopt;
  Json json = Json::object();
  for (const auto& [name, value] : simulation.certificate->entries) json[name] = value;
  return json.dump();
}

void insert_simulated(SQLite::Database& database, const Simulation& simulation) {
  const Sheet& sheet = simulation.sheet.sheet;
  const SimulatedSource& source = simulation.source();
  const std::optional<std::string> absent;
  insert(database, "fabric", source.fabric_sha256, source.fabric);
  insert(database, "sheet", simulation.sheet.sha256, std::string("simulated"), sheet.rows,
         sheet.cols, sheet.patch_m.x() / mm, sheet.patch_m.y() / mm,
         static_cast<int>(sheet.marks.size()), static_cast<int>(sheet.gaps.size()), absent, absent,
         absent, absent, std::optional<double>(), std::optional<double>());
  insert(database, "simulation", simulation.sheet.sha256, source.scene, source.scene_sha256,
         source.fabric_sha256, source.start_sha256, sheet.rows, sheet.cols, source.segments,
         source.model, source.solver, source.status, source.status == "at rest" ? 1 : 0,
         simulation.certificate ? std::optional(simulation.certificate->sha256) : absent,
         certificate_json(simulation));
}

void insert_mark(SQLite::Database& database, const std::string& key, const MarkError& mark) {
  const Eigen::Vector3d real = mark.real_in_world / mm, simulated = mark.virtual_in_world / mm;
  const Eigen::Vector3d parts = mark.warp_weft_normal_m / mm;
  insert(database, "mark_error", key, mark.mark.row, mark.mark.col, mark.material_m.x() / mm,
         mark.material_m.y() / mm, real.x(), real.y(), real.z(), simulated.x(), simulated.y(),
         simulated.z(), mark.distance_m / mm, parts.x(), parts.y(), parts.z(),
         in_mm(mark.sigma_mark_m), in_mm(mark.sigma_distance_m), mark.views);
}

void insert_comparison(SQLite::Database& database, const std::string& key, const DrapeInput& input,
                       const RealVirtual& row) {
  const Simulation& simulation = input.simulations[row.simulation];
  const DistanceStatistics& s = row.statistics;
  const Eigen::Vector2d percent = percent_of_patch(s.mean_m, input.measured.sheet.patch_m);
  insert(database, "comparison", key, input.measured.sha256, simulation.sheet.sha256,
         kMetricsVersion, s.marks, static_cast<int>(row.marks.excluded.size()), s.mean_m / mm,
         in_mm(s.sigma_mean_m), s.median_m / mm, s.rms_m / mm, s.p95_m / mm, s.max_m / mm,
         s.worst_mark.row, s.worst_mark.col, percent.x(), percent.y());
  for (const MarkError& mark : row.marks.marks) insert_mark(database, key, mark);
}

void insert_pair(SQLite::Database& database, const std::string& key, const DrapeInput& input,
                 const Report& report, const VirtualVirtual& row) {
  const DistanceStatistics& s = row.statistics;
  insert(database, "simulation_pair", key, input.measured.sha256,
         input.simulations[row.first].sheet.sha256, input.simulations[row.second].sheet.sha256,
         row.label, static_cast<int>(row.paper_order), kMetricsVersion, s.marks,
         report.lattice_has_gaps_filled ? 1 : 0, s.mean_m / mm, s.median_m / mm, s.rms_m / mm,
         s.p95_m / mm, s.max_m / mm);
}

int pragma_value(SQLite::Database& database, const char* name) {
  return database.execAndGet(fmt::format("PRAGMA {}", name)).getInt();
}

[[noreturn]] void refuse_foreign(const fs::path& file) {
  throw bad_input("this SQLite file is not a drapebench results store", {.file = file.string()},
                  "name another file with --store");
}

/// True when the file holds a store of this version, false when it is still empty.
bool check_identity(SQLite::Database& database, const fs::path& file) {
  const int id = pragma_value(database, "application_id");
  const int version = pragma_value(database, "user_version");
  const int objects = database.execAndGet("SELECT count(*) FROM sqlite_master").getInt();
  if (id == 0 && version == 0 && objects == 0) return false;
  if (id != kApplicationId) refuse_foreign(file);
  if (version > kStoreVersion) {
    throw bad_input(fmt::format("the results store has version {}, this program knows version {}",
                                version, kStoreVersion),
                    {.file = file.string(), .field = "user_version"},
                    "use the newer drapebench that wrote it");
  }
  return true;
}

/// All in one transaction, so that a store is either empty or complete.
void create_tables(SQLite::Database& database, const fs::path& file) {
  SQLite::Transaction transaction(database, SQLite::TransactionBehavior::IMMEDIATE);
  if (check_identity(database, file)) return;  // another program was faster
  database.exec(fmt::format("PRAGMA application_id = {}", kApplicationId));
  database.exec(fmt::format("PRAGMA user_version = {}", kStoreVersion));
  for (const std::string& statement : schema_statements()) database.exec(statement);
  transaction.commit();
}

fs::path prepare_folder(const fs::path& file) {
  std::error_code error;
  if (file.has_parent_path()) fs::create_directories(file.parent_path(), error);
  if (error) {
    throw bad_input("the folder of the results store cannot be made: " + error.message(),
                    {.file = file.string()}, "name a place that can be written with --store");
  }
  return file;
}

}  // namespace

struct Store::Connection {
  fs::path file;
  SQLite::Database database;

  explicit Connection(const fs::path& path)
      : file(prepare_folder(path)),
        database(path.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE, kBusyTimeout_ms) {
    const bool complete = check_identity(database, file);
    // The mode is kept in the file; asking again would need the write lock for nothing.
    if (database.execAndGet("PRAGMA journal_mode").getString() != "wal")
      database.execAndGet("PRAGMA journal_mode = WAL").getString();
    database.exec("PRAGMA synchronous = FULL");
    database.exec("PRAGMA foreign_keys = ON");
    if (!complete) create_tables(database, file);
  }

  [[nodiscard]] bool has(const char* table, const std::string& key) {
    SQLite::Statement statement(database, fmt::format("SELECT 1 FROM {} WHERE sha256 = ?", table));
    statement.bind(1, key);
    return statement.executeStep();
  }

  /// One transaction for one row of `table` and all it needs; false when it is there already.
  template <class Insert>
  bool add_once(const char* table, const std::string& key, const Insert& insert_rows) {
    SQLite::Transaction transaction(database, SQLite::TransactionBehavior::IMMEDIATE);
    if (has(table, key)) return false;
    insert_rows();
    transaction.commit();
    return true;
  }
};

Store::Store(const fs::path& file) {
  try {
    connection_ = std::make_unique<Connection>(file);
  } catch (const SQLite::Exception& exception) {
    throw store_error(file, exception);
  }
}

Store::~Store() {
  try {
    if (connection_) close();
  } catch (const Error&) {
    // Everything acknowledged is safe in the write-ahead log; the next opening moves it.
  }
}

void Store::add(const Calibration& calibration, const std::string& sha256) {
  SQLite::Database& database = connection_->database;
  try {
    SQLite::Transaction transaction(database, SQLite::TransactionBehavior::IMMEDIATE);
    insert_calibration(database, sha256, calibration.rig, calibration.method);
    SQLite::Statement update(
        database, "UPDATE calibration SET method = ? WHERE sha256 = ? AND method IS NULL");
    update.bind(1, calibration.method);
    update.bind(2, sha256);
    update.exec();
    for (const CalibratedCamera& camera : calibration.cameras) {
      const CalibrationResiduals& residuals = camera.residuals;
      insert(database, "calibration_camera", sha256, camera.camera.name, residuals.points,
             residuals.rms_px, residuals.max_px, residuals.object_rms_mm);
    }
    transaction.commit();
  } catch (const SQLite::Exception& exception) {
    throw store_error(connection_->file, exception);
  }
}

ImportCounts Store::add(const DrapeInput& input, const Report& report) {
  SQLite::Database& database = connection_->database;
  ImportCounts counts;
  const auto count = [&](bool added) { ++(added ? counts.added : counts.present); };
  try {
    for (const RealVirtual& row : report.real_virtual) {
      const Simulation& simulation = input.simulations[row.simulation];
      const std::string key = comparison_key({input.measured.sha256, simulation.sheet.sha256});
      count(connection_->add_once("comparison", key, [&] {
        insert_measured(database, input.measured, report.measurement);
        insert_simulated(database, simulation);
        insert_comparison(database, key, input, row);
      }));
    }
    for (const VirtualVirtual& row : report.virtual_virtual) {
      const Simulation &first = input.simulations[row.first],
                       &second = input.simulations[row.second];
      const std::string key =
          comparison_key({input.measured.sha256, first.sheet.sha256, second.sheet.sha256});
      count(connection_->add_once("simulation_pair", key,
                                  [&] { insert_pair(database, key, input, report, row); }));
    }
  } catch (const SQLite::Exception& exception) {
    throw store_error(connection_->file, exception);
  }
  return counts;
}

void Store::close() {
  if (!connection_) return;
  const fs::path file = connection_->file;
  try {
    SQLite::Statement(connection_->database, "PRAGMA wal_checkpoint(TRUNCATE)").executeStep();
    connection_.reset();
  } catch (const SQLite::Exception& exception) {
    connection_.reset();
    throw store_error(file, exception);
  }
}

std::string comparison_key(const std::vector<std::string>& sheet_hashes) {
  std::string text = fmt::format("drapebench/comparison/{}\n", kMetricsVersion);
  for (const std::string& hash : sheet_hashes) text += hash + '\n';
  return sha256_of(std::string_view(text));
}

}  // namespace drape::compare
