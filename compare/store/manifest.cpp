// SPDX-License-Identifier: Apache-2.0
#include "compare/store/manifest.hpp"

#include <SQLiteCpp/Savepoint.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sqlite3.h>
#include <zlib.h>

#include <algorithm>
#include <regex>

#include "compare/store/store.hpp"
#include "core/units.hpp"

namespace drape::compare {

namespace fs = std::filesystem;

Cell in_mm(const std::optional<double>& length_m) {
  return length_m ? Cell(*length_m / units::mm) : Cell();
}

void Cell::to(std::string& text) const {
  if (const auto* own = std::get_if<std::string>(this)) text = *own;
  if (const auto* whole = std::get_if<std::int64_t>(this)) text = fmt::format("{}", *whole);
  if (const auto* real = std::get_if<double>(this)) text = fmt::format("{}", *real);
}
void bind_all(SQLite::Statement& statement, const Cells& parameters) {
  int index = 0;
  for (const Cell& value : parameters) {
    ++index;  // an unbound parameter is NULL
    if (const auto* whole = std::get_if<std::int64_t>(&value)) statement.bind(index, *whole);
    if (const auto* real = std::get_if<double>(&value)) statement.bind(index, *real);
    if (const auto* text = std::get_if<std::string>(&value)) statement.bind(index, *text);
  }
}

Cell cell_of(const SQLite::Column& value) {
  const int type = value.getType();
  if (type == SQLite::Null) return {};
  if (type == SQLite::INTEGER) return value.getInt64();
  if (type == SQLite::FLOAT) return value.getDouble();
  return value.getString();
}

Cells row_of(SQLite::Statement& statement) {
  Cells row;
  for (int i = 0; i < statement.getColumnCount(); ++i)
    row.push_back(cell_of(statement.getColumn(i)));
  return row;
}

std::vector<Cells> cells_of(SQLite::Database& database, const std::string& sql,
                            const Cells& parameters) {
  SQLite::Statement statement(database, sql);
  bind_all(statement, parameters);
  std::vector<Cells> rows;
  while (statement.executeStep()) rows.push_back(row_of(statement));
  return rows;
}

int execute(SQLite::Database& database, const std::string& sql, const Cells& parameters) {
  SQLite::Statement statement(database, sql);
  bind_all(statement, parameters);
  return statement.exec();
}

bool is_busy(const SQLite::Exception& exception) {
  const int code = exception.getErrorCode() & 0xFF;
  return code == SQLITE_BUSY || code == SQLITE_LOCKED;
}

Error not_as_written(const fs::path& file, const std::string& altered) {
  return bad_input("the results store is not as it was written: " + altered,
                   {.file = file.string()},
                   "see `drape results verify`; `drape results rescue` keeps what is whole");
}

Error store_error(const fs::path& file, const SQLite::Exception& exception) {
  const Where where{.file = file.string()};
  const std::string reason = exception.what();
  if (is_busy(exception))
    return bad_input(
        fmt::format("the results store was in use by another program for {} s",
                    std::chrono::duration_cast<std::chrono::seconds>(store_patience).count()),
        where, "wait for the other program and run this one again; nothing stored is lost");
  const struct {
    std::set<int> codes;
    const char *what, *remedy;
  } known[] = {
      {{SQLITE_IOERR_LOCK, SQLITE_IOERR_RDLOCK, SQLITE_IOERR_UNLOCK, SQLITE_IOERR_CHECKRESERVEDLOCK,
        SQLITE_IOERR_SHMLOCK, SQLITE_IOERR_SHMMAP, SQLITE_IOERR_SHMOPEN, SQLITE_IOERR_SHMSIZE,
        SQLITE_PROTOCOL},  // a refused lock, or refused memory shared between programs
       "the disk of the results store gives no locks on files: ",
       "put the store on a local disk, e.g. with --store"},
      {{SQLITE_FULL},
       "the results store cannot grow: ",
       "free disk space and run again; nothing already stored is lost"},
      {{SQLITE_READONLY, SQLITE_CANTOPEN, SQLITE_PERM, SQLITE_IOERR},
       "the results store cannot be opened or written: ",
       "check the path, the permissions and the disk, then run again; nothing already stored is "
       "lost"},
      {{SQLITE_NOTADB, SQLITE_CORRUPT},
       "this is not a readable results store: ",
       "name another file with --store, restore this one from a backup, or save what is whole: "
       "drape results rescue"},
      {{SQLITE_ERROR, SQLITE_CONSTRAINT, SQLITE_MISMATCH, SQLITE_SCHEMA, SQLITE_TOOBIG},
       "the results store is not as the programs make it: ",
       "run drape results verify; drape results rescue saves what is whole"}};
  for (const auto& [codes, what, remedy] : known)
    if (codes.contains(exception.getExtendedErrorCode()) ||
        codes.contains(exception.getErrorCode() & 0xFF))
      return bad_input(what + reason, where, remedy);
  return internal_error("the results store answered: " + reason, where);
}

namespace {

constexpr std::int64_t kLargestBlob = std::int64_t{1} << 30;

std::int64_t size_of(SQLite::Database& database) {
  return database.execAndGet("PRAGMA page_count").getInt64() *
         database.execAndGet("PRAGMA page_size").getInt64();
}

/// Statements of the schema, each under its kind and name, such as "view v_run".
auto schema_of(SQLite::Database& database) {
  return rows_of<std::string, std::string>(
      database, "SELECT type || ' ' || name, sql FROM sqlite_master WHERE sql IS NOT NULL");
}

/// Columns of the primary key.
std::vector<std::string> primary_key(const Relation& table) {
  constexpr std::string_view kList = "PRIMARY KEY (";
  static const std::regex name(R"(\w+)");
  const auto at = table.statement.find(kList);
  if (at == std::string::npos) return {table.columns.front().name};
  const auto from = table.statement.begin() + static_cast<std::ptrdiff_t>(at + kList.size());
  return {std::sregex_token_iterator(from, std::find(from, table.statement.end(), ')'), name), {}};
}

ListedTable listed_table_of(const Relation& relation) {
  ListedTable table;
  table.name = relation.name;
  const bool numbered = relation.statement.find(" INTEGER PRIMARY KEY") != std::string::npos;
  const bool of_manifest = relation.name == "file";
  const std::vector<std::string> primary = primary_key(relation);
  // Rows of a run depend on the run, whatever column is first.
  const bool of_run = std::count(primary.begin(), primary.end(), "run") > 0;
  const std::string key = numbered      ? relation.columns[1].name
                          : of_run      ? "run"
                          : of_manifest ? "manifest"
                                        : primary.front();
  table.number = numbered ? "t." + relation.columns[0].name : "NULL";
  table.key = of_manifest ? "CAST(t.manifest AS TEXT)" : fmt::format("t.\"{}\"", key);
  table.with_key =
      of_manifest ? "t.manifest = CAST(?1 AS INTEGER)" : fmt::format("t.\"{}\" = ?1", key);
  std::map<std::string, std::string> value_of;
  for (const RelationColumn& column : relation.columns) {
    const std::string quoted = '"' + column.name + '"';
    std::string value = "t." + quoted, place = "?";
    for (const auto& [name, parent, number] : {std::array<const char*, 3>{"run", "run", "number"},
                                               {"comparison_id", "comparison", "id"}})
      if (column.name == name) {
        value = fmt::format("(SELECT sha256 FROM {} WHERE {} = t.{})", parent, number, quoted);
        place = fmt::format("(SELECT {} FROM {} WHERE sha256 = ?)", number, parent);
        if (name != key) continue;
        table.key = value;
        table.with_key =
            fmt::format("t.{} = (SELECT {} FROM {} WHERE sha256 = ?1)", quoted, number, parent);
      }
    value_of[column.name] = value;
    if ((numbered && column.name == relation.columns[0].name) ||
        (of_manifest && column.name == "manifest") || column.name == "packed")
      continue;
    if (column.name == key) table.key_at = table.columns.size();
    table.columns.push_back(quoted);
    table.values.push_back(value);
    table.places.push_back(place);
    table.later.push_back(column.since > 0);
  }
  for (const std::string& name : primary)
    if (name != key && !numbered)
      table.order += (table.order.empty() ? " ORDER BY " : ", ") + value_of[name];
  return table;
}

}  // namespace

void append_value(std::string& bytes, const SQLite::Column& value) {
  const auto add = [&](char type, const auto& number) {
    bytes += type;
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
  };
  const int type = value.getType();
  if (type == SQLite::Null) {
    bytes += 'n';
  } else if (type == SQLite::INTEGER) {
    add('i', value.getInt64());
  } else if (type == SQLite::FLOAT) {
    add('r', value.getDouble());
  } else {
    const auto* text = static_cast<const char*>(value.getBlob());
    const auto size = static_cast<std::size_t>(value.getBytes());
    bytes += type == SQLite::TEXT ? 't' : 'b';
    bytes += std::to_string(size) + ':';
    if (size > 0) bytes.append(text, size);
  }
}

const std::vector<ListedTable>& listed_tables() {
  static const std::vector<ListedTable> tables = [] {
    std::vector<ListedTable> list;
    for (const Relation& relation : relations())
      if (relation.name != "listed" && relation.name != "manifest")
        list.push_back(listed_table_of(relation));
    return list;
  }();
  return tables;
}

const ListedTable& listed_table(const std::string& name) {
  for (const ListedTable& table : listed_tables())
    if (table.name == name) return table;
  throw internal_error("manifests list no table `" + name + "`");
}

RowReader::RowReader(SQLite::Database& database, bool indexed)
    : database_(database), indexed_(indexed) {}

SQLite::Statement& RowReader::statement(const ListedTable* table) {
  auto made = statements_.find(table);
  if (made == statements_.end()) {
    std::string sql = "SELECT sha256, number FROM listed WHERE kind = ?2 AND key = ?1";
    if (table != nullptr) {
      std::string with_key = table->with_key;
      if (const auto at = with_key.find(" WHERE "); !indexed_ && at != std::string::npos)
        with_key.insert(at, " NOT INDEXED");
      sql = fmt::format("SELECT {}, {} FROM {} AS t{} WHERE {}{}", table->number,
                        fmt::join(table->values, ", "), table->name, indexed_ ? "" : " NOT INDEXED",
                        with_key, table->order);
    }
    made = statements_.try_emplace(table, database_, sql).first;
  }
  made->second.tryReset();  // an earlier failure, in a damaged file, is not one of this use
  return made->second;
}

ListedRows RowReader::read(const ListedTable& table, const std::string& key, Take take) {
  SQLite::Statement& row = statement(&table);
  row.bind(1, key);
  ListedRows found;
  std::string bytes;
  bytes.reserve(2048);
  bytes += "drapebench/rows/1\n" + table.name + "\n";
  while (row.executeStep()) {
    ++found.count;
    found.number = cell_of(row.getColumn(0));
    bytes += '\n';
    Cells* cells = take == Take::rows ? &found.rows.emplace_back() : nullptr;
    for (std::size_t i = 0; i < table.values.size(); ++i) {
      const SQLite::Column value = row.getColumn(static_cast<int>(i) + 1);
      if (!table.later[i] || !value.isNull()) append_value(bytes, value);
      if (cells != nullptr) cells->push_back(cell_of(value));
    }
  }
  row.reset();
  found.sha256 = sha256_of(std::string_view(bytes));
  return found;
}

std::string RowReader::alteration(const ListedTable& table, const std::string& key,
                                  const Cells& listed, long long& count) {
  const ListedRows found = read(table, key);
  count += found.count;
  if (listed.empty() && found.count == 0) return {};
  if (!listed.empty() && listed[0] == Cell(found.sha256) && listed[1] == found.number) return {};
  return fmt::format("{} {}{}", table.name, key.substr(0, 12),
                     listed.empty()     ? " is in no manifest: drapebench did not write it"
                     : found.count == 0 ? " was deleted"
                                        : " was altered");
}

std::string RowReader::alteration(const ListedTable& table, const std::string& key) {
  SQLite::Statement& row = statement(nullptr);
  row.bind(1, key);
  row.bind(2, table.name);
  const Cells listed = row.executeStep() ? row_of(row) : Cells();
  row.reset();
  long long count = 0;
  return alteration(table, key, listed, count);
}

std::vector<std::string> RowReader::alterations(const ListedTable& table, long long& keys) {
  std::vector<std::string> found;
  long long count = 0;
  for (const Cells& row : cells_of(
           database_, "SELECT sha256, number, key FROM listed WHERE kind = ? ORDER BY sequence",
           {table.name})) {
    ++keys;
    std::string key;  // can have any type in a damaged file
    row[2].to(key);
    if (std::string altered = alteration(table, key, row, count); !altered.empty())
      found.push_back(std::move(altered));
  }
  const auto all = first_of<std::int64_t>(database_, "SELECT count(*) FROM " + table.name);
  if (*all > count)
    found.push_back(fmt::format("{} rows of {} are in no manifest: drapebench did not write them",
                                *all - count, table.name));
  return found;
}

std::vector<Manifest> manifests_of(SQLite::Database& database, const char* which) {
  std::vector<Manifest> all;
  for (const auto& [number, previous, last, size, sha256] :
       rows_of<std::int64_t, std::string, std::int64_t, std::int64_t, std::string>(
           database, fmt::format("SELECT number, previous_sha256, last, file_size, sha256 FROM "
                                 "manifest ORDER BY number {}",
                                 which)))
    all.push_back({number, previous, last, size, sha256});
  return all;
}

Manifest last_manifest(SQLite::Database& database) {
  const std::vector<Manifest> last = manifests_of(database, "DESC LIMIT 1");
  return last.empty() ? Manifest() : last.front();
}

std::string hash_of(SQLite::Database& database, const Manifest& manifest,
                    std::int64_t last_before) {
  std::string text = fmt::format("drapebench/manifest/1\n{}\n{}\n{}\n", manifest.number,
                                 manifest.previous_sha256, manifest.file_size);
  for (const auto& [line] : rows_of<std::string>(
           database,
           "SELECT sequence || ' ' || kind || ' ' || coalesce(number, '') || ' ' || sha256 || ' ' "
           "|| length(key) || ' ' || key || char(10) FROM listed WHERE sequence > ? AND sequence "
           "<= ? ORDER BY sequence",
           {last_before, manifest.last}))
    text += line;
  return sha256_of(std::string_view(text));
}

void write_manifest(SQLite::Database& database, const std::vector<ListedKey>& added) {
  RowReader reader(database);
  const Manifest before = last_manifest(database);
  Manifest manifest{before.number + 1, before.sha256, before.last, 0, {}};
  for (const auto& [table, key] : added) {
    const ListedRows rows = reader.read(*table, key);
    if (rows.count == 0) continue;
    if (first_of<int>(database, "SELECT 1 FROM listed WHERE kind = ? AND key = ?",
                      {table->name, key})) {
      const std::string altered = reader.alteration(*table, key);
      if (altered.empty()) continue;
      throw not_as_written(database.getFilename(), altered);
    }
    execute(database, "INSERT INTO listed VALUES (?, ?, ?, ?, ?)",
            {++manifest.last, table->name, key, rows.number, rows.sha256});
  }
  if (manifest.last == before.last) return;
  // The row of the manifest itself can need another page.
  manifest.file_size = size_of(database);
  for (;;) {
    SQLite::Savepoint trial(database, "manifest");
    manifest.sha256 = hash_of(database, manifest, before.last);
    execute(database, "INSERT INTO manifest VALUES (?, ?, ?, ?, ?)",
            {manifest.number, manifest.previous_sha256, manifest.last, manifest.file_size,
             manifest.sha256});
    const std::int64_t size = size_of(database);
    if (size == manifest.file_size) return trial.release();
    manifest.file_size = size;
  }
}

std::vector<std::string> schema_findings(SQLite::Database& database) {
  static const auto program = [] {
    SQLite::Database empty(":memory:", SQLite::OPEN_READWRITE);
    for (const Relation& table : relations()) empty.exec(table.statement);
    for (const std::string& statement : surrounding_statements()) empty.exec(statement);
    return schema_of(empty);
  }();
  std::vector<std::string> findings;
  std::map<std::string, std::string> missing;
  for (const auto& [what, sql] : program) missing[what] = sql;
  for (const auto& [what, sql] : schema_of(database)) {
    const auto own = missing.find(what);
    if (own == missing.end()) {
      findings.push_back(what + " is not of this program");
    } else {
      if (own->second != sql) findings.push_back(what + " was altered");
      missing.erase(own);
    }
  }
  for (const auto& [what, sql] : missing) findings.push_back(what + " is not there");
  return findings;
}

std::string size_finding(SQLite::Database& database, const fs::path& file) {
  const Manifest last = last_manifest(database);
  std::error_code absent;
  const auto log = fs::file_size(file.string() + "-wal", absent);
  const bool in_log = !absent && log > 0;
  const std::int64_t size =
      in_log ? size_of(database) : static_cast<std::int64_t>(fs::file_size(file));
  if (last.number == 0 || size == last.file_size) return {};
  return fmt::format("the file has {} bytes, its last manifest says {}", size, last.file_size);
}

bool add_blob(SQLite::Database& database, const std::string& sha256, std::string_view content) {
  if (first_of<int>(database, "SELECT 1 FROM blob WHERE sha256 = ?", {sha256})) return false;
  uLongf size = compressBound(content.size());
  std::string packed(size, '\0');
  if (compress(reinterpret_cast<Bytef*>(packed.data()), &size,
               reinterpret_cast<const Bytef*>(content.data()), content.size()) != Z_OK)
    throw internal_error("a blob cannot be packed");
  SQLite::Statement insert(database, "INSERT INTO blob VALUES (?, ?, ?)");
  insert.bind(1, sha256);
  insert.bind(2, static_cast<std::int64_t>(content.size()));
  insert.bind(3, packed.data(), static_cast<int>(size));
  return insert.exec() > 0;
}

std::optional<std::string> blob_in(SQLite::Database& database, const std::string& sha256,
                                   bool indexed) {
  SQLite::Statement row(database, fmt::format("SELECT size, packed FROM blob{} WHERE sha256 = ?",
                                              indexed ? "" : " NOT INDEXED"));
  row.bind(1, sha256);
  if (!row.executeStep()) return std::nullopt;
  const std::int64_t stated = row.getColumn(0).getInt64();
  const SQLite::Column packed = row.getColumn(1);
  // zlib compresses by a factor of at most 1,032.
  if (stated < 0 || stated > kLargestBlob || stated / 1100 > packed.getBytes()) return std::nullopt;
  std::string content(static_cast<std::size_t>(stated), '\0');
  auto size = static_cast<uLongf>(stated);
  if (uncompress(reinterpret_cast<Bytef*>(content.data()), &size,
                 static_cast<const Bytef*>(packed.getBlob()),
                 static_cast<uLong>(packed.getBytes())) != Z_OK ||
      size != content.size() || sha256_of(std::string_view(content)) != sha256)
    return std::nullopt;
  return content;
}

namespace {

/// Gives a store of version 1 what version 2 had: numbers of comparisons, a simulator, and a table
/// of calibration files. Its metrics had other definitions, and it had no ledger.
constexpr const char* kFrom1 = R"sql(DELETE FROM metric;
ALTER TABLE simulation ADD COLUMN simulator TEXT DEFAULT 'drapebench';
ALTER TABLE comparison ADD COLUMN id INTEGER;
UPDATE comparison SET id = (SELECT count(*) FROM comparison AS c WHERE c.sha256 <= comparison.sha256);
ALTER TABLE mark_error ADD COLUMN comparison_id INTEGER;
UPDATE mark_error SET comparison_id = (SELECT id FROM comparison WHERE sha256 = comparison_sha256);
CREATE TABLE calibration_file AS SELECT sha256 AS calibration_sha256, method FROM calibration
  WHERE method IS NOT NULL)sql";

/// Creates every table that is absent or differs from today's definition, keeping the values of the
/// columns that both have.
void make_tables(SQLite::Database& database) {
  for (const Relation& table : relations()) {
    const auto made = first_of<std::string>(
        database, "SELECT sql FROM sqlite_master WHERE type = 'table' AND name = ?", {table.name});
    if (made == table.statement) continue;
    if (made) database.exec(fmt::format("ALTER TABLE {0} RENAME TO old_{0}", table.name));
    database.exec(table.statement);
    if (made)
      database.exec(fmt::format(
          "INSERT INTO {0} ({1}) SELECT {1} FROM old_{0}; DROP TABLE old_{0}", table.name,
          *first_of<std::string>(database,
                                 "SELECT group_concat('\"' || n.name || '\"') FROM "
                                 "pragma_table_info(?1) AS n JOIN pragma_table_info('old_' || ?1) "
                                 "AS o ON o.name = n.name",
                                 {table.name})));
  }
}

/// Creates everything around the tables, and a manifest of all rows except `left_out`, in the order
/// of `former`, a table like the ledger.
void complete(SQLite::Database& database, const std::set<ListedKey>& left_out = {},
              const char* former = "listed") {
  // Existing definitions are unchanged.
  for (const Relation& table : relations())
    for (const RelationColumn& column : table.columns)
      if (!column.definition.empty())
        execute(database, "INSERT OR IGNORE INTO metric VALUES (?, ?, ?, ?)",
                {column.name, column.unit, column.definition, column.better});
  for (const std::string& statement : surrounding_statements()) database.exec(statement);
  std::vector<ListedKey> all;
  for (const ListedTable& table : listed_tables())
    for (const auto& [key] : rows_of<std::string>(
             database,
             fmt::format(
                 "SELECT {0} AS key FROM {1} AS t GROUP BY 1 ORDER BY (SELECT sequence FROM {2} "
                 "WHERE kind = '{1}' AND key = {0}), min({3}), 1",
                 table.key, table.name, former, table.number)))
      if (!left_out.contains({&table, key})) all.emplace_back(&table, key);
  write_manifest(database, all);
  database.exec(fmt::format("PRAGMA user_version = {}", store_version()));
}

/// Tables of a row of version 2 to 10 and of its dependent rows, as hashed by an entry of its
/// ledger under the name of the first.
using LedgerKind = std::vector<const char*>;
const LedgerKind kLedgerKinds[] = {{"metric"},
                                   {"rig"},
                                   {"calibration"},
                                   {"calibration_file", "calibration_camera"},
                                   {"recording"},
                                   {"fabric"},
                                   {"sheet", "gap"},
                                   {"simulation"},
                                   {"refinement"},
                                   {"drapemeter", "hem_harmonic"},
                                   {"comparison", "mark_error"},
                                   {"simulation_pair"},
                                   {"branch"},
                                   {"branch_turn"},
                                   {"acceptance", "acceptance_figure"},
                                   {"surface_comparison"},
                                   {"run", "run_drape", "run_comparison", "run_value"},
                                   {"run_repetition"},
                                   {"run_match", "match_basis", "real_repeat"}};

std::string ledger_content(SQLite::Database& database, const LedgerKind& kind,
                           const std::string& key) {
  std::string bytes = fmt::format("drapebench/content/1\n{}\n", kind.front());
  for (const char* name : kind) {
    const ListedTable& table = listed_table(name);
    // Ordered by numbers, where today's order is that of what they number.
    const char* order =
        table.name == "run_comparison" ? " ORDER BY comparison_id" : table.order.c_str();
    const std::vector<RelationColumn>& columns = relation(name).columns;
    SQLite::Statement row(
        database, fmt::format("SELECT * FROM {} AS t WHERE {}{}", name, table.with_key, order));
    row.bind(1, key);
    while (row.executeStep()) {
      bytes += '\n';
      for (int i = 0; i < row.getColumnCount(); ++i) {
        const SQLite::Column value = row.getColumn(i);
        if (columns.at(static_cast<std::size_t>(i)).since == 0 || !value.isNull())
          append_value(bytes, value);
      }
    }
    bytes += "\n;";
  }
  return sha256_of(std::string_view(bytes));
}

/// Rows that differ from the ledger, with a sentence about each.
std::map<ListedKey, std::string> altered_since(SQLite::Database& database) {
  std::map<ListedKey, std::string> altered;
  std::string head;
  std::int64_t expected = 0;
  bool chained = true;
  using Text = std::string;
  for (const LedgerKind& kind : kLedgerKinds)
    for (const auto& [key] : rows_of<Text>(
             database, fmt::format("SELECT {1} FROM {0} AS t WHERE {1} NOT IN (SELECT key FROM "
                                   "ledger WHERE kind = '{0}')",
                                   kind.front(), listed_table(kind.front()).key)))
      altered[{&listed_table(kind.front()), key}] =
          fmt::format("{} `{}` was not written by drapebench", kind.front(), key);
  for (const auto& [sequence, name, key, content, written] :
       rows_of<std::int64_t, Text, Text, Text, Text>(
           database,
           "SELECT sequence, kind, key, content_sha256, chain_sha256 FROM ledger ORDER BY "
           "sequence")) {
    const auto* kind =
        std::find_if(std::begin(kLedgerKinds), std::end(kLedgerKinds),
                     [&, &of = name](const LedgerKind& one) { return one.front() == of; });
    head = sha256_of(std::string_view(fmt::format("drapebench/ledger/1\n{}\n{}\n{}\n{}\n{}\n", head,
                                                  sequence, name, key, content)));
    chained = chained && sequence == ++expected && head == written;
    head = written;
    if (kind == std::end(kLedgerKinds)) continue;
    if (chained && ledger_content(database, *kind, key) == content) continue;
    for (const char* table : *kind)
      altered[{&listed_table(table), key}] =
          fmt::format("{} `{}` is not what was written", name, key);
  }
  return altered;
}

/// Stores the sheets and lists that older versions copied beside the store under their hashes.
void take_copies(SQLite::Database& database, const fs::path& file) {
  const fs::path folder = real_store(file).string() + ".files";
  std::error_code absent;
  for (const auto& entry : fs::recursive_directory_iterator(folder, absent)) {
    if (!entry.is_regular_file() || entry.path().extension() != ".json") continue;
    const std::string content = read_text(entry.path());
    if (const std::string sha256 = sha256_of(std::string_view(content));
        sha256 == entry.path().stem().string())
      add_blob(database, sha256, content);
  }
}

}  // namespace

int version_of(SQLite::Database& database, const fs::path& file) {
  const auto value = [&](const char* sql) { return database.execAndGet(sql).getInt(); };
  const int id = value("PRAGMA application_id"), version = value("PRAGMA user_version");
  if (id == 0 && version == 0 && value("SELECT count(*) FROM sqlite_master") == 0) return 0;
  if (id != kApplicationId)
    throw bad_input("this SQLite file is not a drapebench results store", {.file = file.string()},
                    "name another file with --store");
  const Where where{.file = file.string(), .field = "user_version"};
  if (version < 1)
    throw bad_input(fmt::format("there is no results store of version {}", version), where,
                    "restore the store from a backup");
  if (version > store_version())
    throw bad_input(fmt::format("the results store has version {}, this program knows version {}",
                                version, store_version()),
                    where, "use the newer drapebench that wrote it");
  return version;
}

void create_store(SQLite::Database& database) {
  database.exec(fmt::format("PRAGMA application_id = {}", kApplicationId));
  make_tables(database);
  complete(database);
}

void migrate(SQLite::Database& database, int from_version, const fs::path& file,
             std::vector<std::string>* lost) {
  SQLite::Transaction transaction(database, SQLite::TransactionBehavior::EXCLUSIVE);
  // Another program may have been faster.
  if (database.execAndGet("PRAGMA user_version").getInt() != from_version) return;
  if (from_version < 1 || from_version >= store_version())
    throw internal_error(fmt::format("there is no migration from store version {}", from_version));
  for (const auto& [statement] : rows_of<std::string>(
           database,
           "SELECT 'DROP ' || type || ' \"' || name || '\"' FROM sqlite_master WHERE type IN "
           "('view', 'index', 'trigger') AND sql IS NOT NULL"))
    database.exec(statement);
  if (from_version == 1) database.exec(kFrom1);
  // References to a table that is recreated refer to the new one.
  database.exec("PRAGMA legacy_alter_table = ON");
  make_tables(database);
  database.exec("PRAGMA legacy_alter_table = OFF");
  std::set<ListedKey> left_out;
  if (from_version > 1) {
    for (const auto& [key, why] : altered_since(database)) {
      if (lost == nullptr) throw not_as_written(file, why);
      lost->push_back(why);
      left_out.insert(key);
    }
    database.exec(
        "CREATE TEMP TABLE former (kind, key, sequence, PRIMARY KEY (kind, key)); INSERT "
        "INTO former SELECT kind, key, sequence FROM ledger; DROP TABLE ledger");
  }
  take_copies(database, file);
  complete(database, left_out, from_version > 1 ? "former" : "listed");
  database.exec("DROP TABLE IF EXISTS temp.former");
  const std::vector<std::string> strange = schema_findings(database);
  if (lost == nullptr && !strange.empty()) throw not_as_written(file, strange.front());
  transaction.commit();
}

}  // namespace drape::compare
