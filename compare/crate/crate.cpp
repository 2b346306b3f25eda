// SPDX-License-Identifier: Apache-2.0
#include "compare/crate/crate.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cctype>

#include "compare/history/results.hpp"
#include "compare/tables/tables.hpp"
#include "core/files/new_folder.hpp"
#include "core/program/run_record.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

const std::string kGone = "gone: ", kNotAsRecorded = "not what was recorded: ",
                  kNotTraced = "no record of how it was made: ";  ///< followed by a file's name

using Stated = std::map<fs::path, std::set<std::string>>;

/// Sheets and meshes of the run, or of the whole store.
std::set<std::string> sheets_of(const StoreReader& store, std::optional<int> run) {
  const auto all = store.column<std::string>(R"sql(
WITH of_run AS (SELECT c.measured_sha256, c.simulated_sha256 FROM run_comparison AS r
  JOIN comparison AS c ON c.id = r.comparison_id WHERE r.run = ?1),
drapes AS (SELECT measured_sha256 FROM run_drape WHERE run = ?1)
SELECT sha256 FROM sheet WHERE ?1 IS NULL OR sha256 IN (SELECT simulated_sha256 FROM of_run
  UNION SELECT measured_sha256 FROM of_run UNION SELECT measured_sha256 FROM drapes)
UNION SELECT q.sheet_sha256 FROM real_repeat AS q JOIN run_match AS m ON m.sha256 = q.match_sha256
  JOIN run AS n ON n.sha256 = m.run_sha256 WHERE n.number = ?1
UNION SELECT mesh_sha256 FROM surface_comparison
  WHERE ?1 IS NULL OR measured_sha256 IN (SELECT measured_sha256 FROM drapes))sql",
                                             {run});
  return {all.begin(), all.end()};
}

/// A file of numbers in a crate; parameter 1 of its query is the number of one run, or NULL for
/// all.
struct CrateTable {
  const char *file, *description, *query;
};
constexpr CrateTable kCrateTables[] = {
    {"drapes.csv", "mean distance, its expanded uncertainty (95 %) and match of each drape", R"sql(
SELECT r.number AS run, r.date, r.label, r.program_version, d.scene, d.set_name, d.measurement,
  d.cause, d.match, d.match_reason, c.mean_mm, d.expanded_uncertainty_mm,
  CASE d.budget_complete WHEN 1 THEN 'complete' WHEN 0 THEN 'at least' END AS uncertainty_is,
  d.measured_sha256, d.headline_sha256 AS comparison_sha256
FROM run AS r JOIN run_drape AS d ON d.run = r.number
  LEFT JOIN comparison AS c ON c.sha256 = d.headline_sha256
WHERE ?1 IS NULL OR r.number = ?1 ORDER BY r.number, d.scene, d.measured_sha256)sql"},
    {"surface_comparisons.csv", "distance between measured sheets and surfaces without marks",
     R"sql(
SELECT p.* FROM surface_comparison AS p WHERE ?1 IS NULL OR p.measured_sha256 IN (
  SELECT measured_sha256 FROM run_drape WHERE run = ?1) ORDER BY p.sha256)sql"},
    // Keeps the pairs of a run whose simulations are both compared with the same measured sheet.
    {"simulation_pairs.csv", "distance between simulated sheets", R"sql(
SELECT p.* FROM simulation_pair AS p WHERE ?1 IS NULL OR 2 = (
  SELECT count(DISTINCT c.simulated_sha256) FROM run_comparison AS k
    JOIN comparison AS c ON c.id = k.comparison_id
  WHERE k.run = ?1 AND c.measured_sha256 = p.measured_sha256
    AND c.simulated_sha256 IN (p.first_sha256, p.second_sha256)) ORDER BY p.sha256)sql"},
    // All columns except the certificate, which is a separate file.
    {"simulations.csv", "what each simulation is and how it ended", R"sql(
SELECT s.sheet_sha256, s.simulator, s.scene, s.scene_sha256,
  coalesce(f.name, s.fabric_stated) AS fabric, s.fabric_sha256, s.start_sha256, s.grid_rows,
  s.grid_cols, s.spacing_mm, s.from_measured, s.segments, s.model, s.solver, s.status, s.at_rest,
  s.certificate_sha256, json_extract(s.certificate_json, '$."energy.end_uJ"') AS energy_end_uJ,
  json_extract(s.certificate_json, '$.largest_residual_per_particle_weight')
    AS largest_residual_per_particle_weight
FROM simulation AS s LEFT JOIN fabric AS f ON f.sha256 = s.fabric_sha256
WHERE ?1 IS NULL OR s.sheet_sha256 IN (SELECT c.simulated_sha256 FROM run_comparison AS k
  JOIN comparison AS c ON c.id = k.comparison_id WHERE k.run = ?1) ORDER BY s.sheet_sha256)sql"}};

/// Every comparison of one run, or of the whole store, with its verdict.
Table comparisons(const StoreReader& store, std::optional<int> run) {
  const Selection of = selection_of(store, {.run = run, .outdated = true});
  return store.query(R"sql(
SELECT s.run, s.date, s.measurement, s.cause, coalesce(s.state, 'current') AS state, v.scene,
  v.discretisation, v.segments, v.begins, v.fabric, v.simulator, v.model, v.solver, v.status,
  v.branch, v.gaps, v.recorded_on, m.* FROM )sql" +
                         of.from + " JOIN comparison AS m ON m.id = v.id" + of.where +
                         " ORDER BY m.sha256",
                     of.parameters);
}

/// Relative URI of a path (RFC 3986): everything except unreserved characters and `/` is encoded.
std::string uri_of(const fs::path& path) {
  std::string uri;
  for (const unsigned char c : path.generic_string()) {
    const bool plain = std::isalnum(c) != 0 || std::string_view("-._~/").find(
                                                   static_cast<char>(c)) != std::string_view::npos;
    uri += plain ? std::string(1, static_cast<char>(c)) : fmt::format("%{:02X}", c);
  }
  return uri;
}

std::string media_type(const fs::path& file) {
  static const std::map<std::string, std::string> types = {
      {".csv", "text/csv"},          {".json", "application/json"}, {".png", "image/png"},
      {".jpg", "image/jpeg"},        {".tif", "image/tiff"},        {".toml", "application/toml"},
      {".ply", "application/x-ply"}, {".txt", "text/plain"},        {".svg", "image/svg+xml"},
      {".html", "text/html"},        {".md", "text/markdown"}};
  const auto found = types.find(file.extension().string());
  return found == types.end() ? "application/octet-stream" : found->second;
}

/// A time by ISO 8601 with its offset as a number, as required by validators of the profile.
std::string with_offset(std::string time) {
  if (time.ends_with("Z")) time.replace(time.size() - 1, 1, "+00:00");
  return time;
}

Json reference(const std::string& id) {
  return {{"@id", id}};
}

class CrateWriter {
 public:
  CrateWriter(const StoreReader& store, std::optional<int> run, const Lab& lab, fs::path out)
      : store_(store), run_(run), lab_(lab), out_(std::move(out)) {}

  /// Authors come first among the entities, since actions refer to them.
  Crate write() {
    for (std::size_t i = 0; i < lab_.authors.size(); ++i) {
      const Lab::Author& author = lab_.authors[i];
      Json person = {{"name", author.name}};
      if (!author.affiliation.empty())
        person["affiliation"] = add_entity(fmt::format("#affiliation-{}", i + 1), "Organization",
                                           {{"name", author.affiliation}});
      const std::string id = author.orcid.empty() ? fmt::format("#author-{}", i + 1) : author.orcid;
      authors_.push_back(add_entity(id, "Person", person));
    }
    choose_files();
    for (const auto& [file, stated] : files_) copy(file, stated);
    for (const auto& [file, id] : ids_)
      if (file.string().ends_with(".run.json")) add_run(file, id);
    add_tables();
    Json graph = roots();
    for (Json& entity : entities_) graph.push_back(std::move(entity));
    write_json(out_ / "ro-crate-metadata.json",
               {{"@context", "https://w3id.org/ro/crate/1.3/context"}, {"@graph", graph}});
    return crate_;
  }

 private:
  /// Finds every file behind the sheets, with the SHA-256 stated for it by records and store: a
  /// file with another content does not belong to the numbers. A sheet that only the store still
  /// has is written as it has it.
  void choose_files() {
    if (run_) require_run(store_, *run_);
    const std::set<std::string> sheets = sheets_of(store_, run_);
    std::vector<fs::path> starts;
    Stated others;
    std::set<std::string> made_again;
    for (const std::string& sha256 : sheets) {
      const auto place = place_in(store_, book_, sha256);
      if (!place) {
        crate_.findings.push_back(kGone + ("sheet " + sha256.substr(0, 12)));
        continue;
      }
      const fs::path file = fs::absolute(*place).lexically_normal();
      const auto mesh = other_mesh_id(file);
      const auto now = book_.sha256(file);
      if (mesh && mesh->sha256 == sha256) {
        others[fs::absolute(mesh->mesh).lexically_normal()].insert(mesh->mesh_sha256);
        starts.push_back(file);
      } else if (now == sha256) {
        starts.push_back(file);
      } else if (store_.blob(sha256)) {
        made_again.insert(sha256);
      } else {
        crate_.findings.push_back((now ? kNotAsRecorded : kGone) + file.string());
      }
    }
    add_sensitivities(starts, others);
    files_ = files_behind(book_, starts);
    for (const auto& [file, contents] : others)
      files_[file].insert(contents.begin(), contents.end());
    expect_scenes(sheets);
    for (const std::string& sha256 : made_again) {
      const fs::path name = fs::path("files") / "store" / (sha256 + ".json");
      add_file(name, *store_.blob(sha256), "sheet that was made again since");
      crate_.findings.push_back(kNotTraced + name.string());
    }
    if (files_.empty()) return;
    // Paths are sorted, so what the first and the last have in common, all have.
    base_ = files_.begin()->first.parent_path();
    while (files_.rbegin()->first.lexically_relative(base_).generic_string().starts_with(".."))
      base_ = base_.parent_path();
  }

  /// Adds the sensitivities beside the sheets, on which U is based too, with their stored
  /// contents.
  void add_sensitivities(std::vector<fs::path>& starts, Stated& stated) {
    Stated stored;
    for (const auto& [path, sha256] : store_.rows<std::string, std::string>(
             "SELECT path, sha256 FROM file WHERE path LIKE '%' || ?", {kSensitivityName}))
      stored[(fs::absolute(folder_of(store_.file())) / path).lexically_normal()].insert(sha256);
    const std::vector<fs::path> sheets = starts;
    for (const fs::path& sheet : sheets) {
      const auto found = stored.find(sheet.parent_path() / kSensitivityName);
      if (found == stored.end()) continue;
      const auto now = book_.sha256(found->first);
      stated[found->first] = {now && found->second.contains(*now) ? *now : *found->second.begin()};
      starts.push_back(found->first);
    }
  }

  /// Expects the scenes as they were simulated: the current record of a measured sheet can name one
  /// that was edited after the simulation.
  void expect_scenes(const std::set<std::string>& sheets) {
    std::set<std::string> known;
    for (const auto& [file, stated] : files_)
      if (const auto sha256 = book_.sha256(file)) known.insert(*sha256);
    for (const auto& [sheet, scene, sha256] : store_.rows<std::string, std::string, std::string>(
             "SELECT sheet_sha256, scene, scene_sha256 FROM simulation WHERE scene_sha256 IS NOT "
             "NULL ORDER BY scene, scene_sha256"))
      if (sheets.contains(sheet) && known.insert(sha256).second)
        crate_.findings.push_back(
            fmt::format("{}scene {} as it was simulated ({})", kGone, scene, sha256.substr(0, 12)));
  }

  void copy(const fs::path& file, const std::set<std::string>& stated) {
    const auto sha256 = book_.sha256(file);
    if (!sha256) {
      crate_.findings.push_back(kGone + file.string());
      return;
    }
    if (std::ranges::any_of(stated, [&](const auto& other) { return other != *sha256; })) {
      crate_.findings.push_back(kNotAsRecorded + file.string());
      return;
    }
    if (!book_.is_traced(file)) crate_.findings.push_back(kNotTraced + file.string());
    const fs::path name = fs::path("files") / file.lexically_relative(base_);
    add_file(name, read_text(file), "");
    ids_[file] = uri_of(name);
  }

  /// Adds an entity with these properties, if its id is new; returns the reference to it.
  Json add_entity(const std::string& id, const char* type, const Json& properties) {
    if (places_.try_emplace(id, entities_.size()).second) {
      entities_.push_back({{"@id", id}, {"@type", type}});
      entities_.back().update(properties);
    }
    return reference(id);
  }

  void add_file(const fs::path& name, const std::string& text, const std::string& description) {
    write_durable(out_ / name, text);
    Json file = {{"name", name.filename().string()}};
    if (!description.empty()) file["description"] = description;
    file["encodingFormat"] = media_type(name);
    file["contentSize"] = std::to_string(text.size());
    file["sha256"] = sha256_of(std::string_view(text));
    parts_.push_back(add_entity(uri_of(name), "File", file));
    ++crate_.files;
  }

  /// States the writer of each file of `list`, or its reader if no other statement exists.
  void describe(const Json& list, const std::string& by, bool written) {
    for (const Json& item : list) {
      Json& entity = entities_[places_.at(item["@id"].get<std::string>())];
      if (written || !entity.contains("description"))
        entity["description"] = (written ? "written by " : "read by ") + by;
    }
  }

  Json references(const fs::path& record, const std::vector<RecordedFile>& files) {
    Json list = Json::array();
    for (const RecordedFile& file : files) {
      const auto found = ids_.find(place_of(record, file).lexically_normal());
      if (found != ids_.end()) list.push_back(reference(found->second));
    }
    return list;
  }

  void add_run(const fs::path& file, const std::string& id) {
    const RunFile run = read_run_file(file);
    const Json object = references(file, run.inputs), result = references(file, run.outputs);
    add_action(id, run,
               {{"name", "run of " + run.program},
                {"description", fmt::format("{} {}", run.program, fmt::join(run.arguments, " "))},
                {"startTime", with_offset(run.started_utc)}},
               object, result);
    describe(result, run.program, true);
    describe(object, run.program, false);
    describe(Json::array({reference(id)}), run.program + ", record of the run", true);
  }

  /// Adds what a program made of `object`, after the first properties of its action.
  void add_action(const std::string& id, const RunFile& run, Json action, const Json& object,
                  const Json& result) {
    // RFC 6920: a name made from the hash of the program's bytes, which needs no address.
    const std::string program = "nih:sha-256;" + run.program_sha256;
    action["endTime"] = with_offset(run.ended_utc);
    action["instrument"] =
        add_entity(program, "SoftwareApplication",
                   {{"name", run.program},
                    {"version", run.version},
                    {"url", lab_.program_url.empty() ? program : lab_.program_url},
                    {"identifier", "sha256:" + run.program_sha256}});
    action["object"] = object;
    action["result"] = result;
    action["agent"] = authors_;
    mentions_.push_back(add_entity("#" + id, "CreateAction", action));
    ++crate_.actions;
  }

  Json property(const std::string& id, const std::string& name, const std::string& description,
                const std::string& unit, const std::string& value = {}) {
    Json entity = {{"name", name}, {"description", description}};
    if (!value.empty()) entity["value"] = value;
    // Codes of the Unified Code for Units of Measure.
    entity["unitCode"] = unit == "px" ? "{pixel}" : unit;
    entity["unitText"] = unit + " (UCUM)";
    return add_entity(id, "PropertyValue", entity);
  }

  /// Adds the numbers themselves, made from the sheets by this program: unrounded, in columns with
  /// the names of the store's dictionary of metrics.
  void add_tables() {
    Json results = Json::array();
    std::size_t numbers = 0;
    std::set<std::string> columns;
    const auto add = [&](const char* file, const char* description, const Table& table) {
      add_file(file, csv_of(table), description);
      columns.insert(table.names.begin(), table.names.end());
      results.push_back(reference(file));
      numbers += table.rows.size();
    };
    add("comparisons.csv", "distance between measured and simulated sheets, one row each",
        comparisons(store_, run_));
    for (const CrateTable& table : kCrateTables)
      add(table.file, table.description, store_.query(table.query, {run_}));
    if (run_)
      add("values.csv", "every value behind the run; stand_in: nobody measured it",
          store_.query("SELECT owner, key, value, stand_in FROM run_value WHERE run = ? ORDER BY "
                       "owner, key",
                       {*run_}));
    if (numbers == 0) crate_.findings.emplace_back("the store holds no number");
    if (run_) add_headlines(results);
    Json sheets = Json::array();
    for (const auto& [file, id] : ids_)
      if (file.filename() == "sheet.json") sheets.push_back(reference(id));
    RunFile own;
    own.program = "drape-results";
    own.version = version();
    own.program_sha256 = sha256_of_file("/proc/self/exe");
    own.ended_utc = published_;
    add_action("export", own,
               {{"name", "export of the results"},
                {"description", "tables made from the sheets and their store"}},
               sheets, results);
    std::vector<Metric> metrics = metric_dictionary(store_);
    metrics.emplace_back(
        "expanded_uncertainty_mm", "mm",
        "half width of what 95 of 100 draws of all inputs leave of the mean distance (JCGM 101); a "
        "lower bound where uncertainty_is says `at least`");
    for (const auto& [name, unit, definition] : metrics)
      if (columns.contains(name))
        measured_.push_back(property("#metric-" + name, name, definition, unit));
  }

  /// Adds the mean distance that represents each drape, with its uncertainty and verdicts.
  void add_headlines(Json& results) {
    using Text = std::string;
    for (const auto& [date, scene, set, mean_mm, verdict, cause, match, reason, expanded_mm, is] :
         store_.rows<Text, Text, Text, Text, Text, Text, Text, Text, Text, Text>(
             fmt::format(
                 "SELECT date, scene, set_name, mean_mm, measurement, cause, match, match_reason, "
                 "expanded_uncertainty_mm, uncertainty_is FROM ({})",
                 kCrateTables[0].query),
             {*run_})) {
      published_ = date;
      if (mean_mm.empty()) continue;
      std::string id = "#mean-distance-" + uri_of(scene);
      if (places_.contains(id)) id += "-" + uri_of(set);  // the scene was laid more than once
      results.push_back(
          property(id, "mean distance of drape " + scene,
                   fmt::format("measurement {}{}; expanded uncertainty (95 %) {}; match {}: {}",
                               verdict, cause.empty() ? "" : ", " + cause,
                               expanded_mm.empty()
                                   ? "not known"
                                   : (is == "at least" ? "at least " : "") + expanded_mm + " mm",
                               match, reason),
                   "mm", mean_mm));
    }
  }

  Json roots() const {
    const char* profile = "https://w3id.org/ro/wfrun/process/0.6";
    return {{{"@id", "ro-crate-metadata.json"},
             {"@type", "CreativeWork"},
             {"about", reference("./")},
             {"conformsTo", reference("https://w3id.org/ro/crate/1.3")}},
            {{"@id", "./"},
             {"@type", "Dataset"},
             {"conformsTo", reference(profile)},
             {"name", lab_.title},
             {"description", lab_.description},
             {"datePublished", published_},
             {"license", reference(lab_.license)},
             {"author", authors_},
             {"variableMeasured", measured_},
             {"hasPart", parts_},
             {"mentions", mentions_}},
            {{"@id", profile},
             {"@type", {"CreativeWork", "Profile"}},
             {"name", "Process Run Crate"},
             {"version", "0.6"}},
            {{"@id", lab_.license},
             {"@type", "CreativeWork"},
             {"name", lab_.license_name},
             {"description", "licence of this data: " + lab_.license_name}}};
  }

  const StoreReader& store_;
  std::optional<int> run_;
  const Lab& lab_;
  fs::path out_, base_;
  RecordBook book_;
  Stated files_;                         ///< with the hashes stated for each
  std::map<fs::path, std::string> ids_;  ///< ids of the copies
  std::vector<Json> entities_;
  std::map<std::string, std::size_t> places_;  ///< index of each id in entities_
  std::string published_ = today();
  Json authors_ = Json::array(), parts_ = Json::array(), mentions_ = Json::array(),
       measured_ = Json::array();
  Crate crate_;
};

}  // namespace

Crate write_crate(const StoreReader& store, std::optional<int> run, const Lab& lab,
                  const fs::path& out) {
  Crate crate;
  write_new_folder(out, {}, [&](const fs::path& folder) {
    crate = CrateWriter(store, run, lab, folder).write();
  });
  return crate;
}

static void fields(Fields& f, Lab::Author& author) {
  f({"name", "name of the author"}, author.name);
  f.otherwise({"orcid", "https://orcid.org/0000-..."}, author.orcid);
  f.otherwise({"affiliation", "organisation of the author"}, author.affiliation);
  f.limit(author.orcid.empty() || author.orcid.starts_with("https://orcid.org/"), "orcid",
          "this is no ORCID", "write https://orcid.org/0000-...");
}

void fields(Fields& f, Lab& lab) {
  const auto is_url = [](const std::string& text) {
    return text.starts_with("https://") || text.starts_with("http://");
  };
  f({"title", "title of the data set"}, lab.title);
  f({"description", "abstract of the data set"}, lab.description);
  f({"license", "URL of the licence"}, lab.license);
  f({"license_name", "name of the licence"}, lab.license_name);
  f.otherwise({"program_url", "URL of the programs; empty: they are named by their hash"},
              lab.program_url);
  f({"author", "authors"}, lab.authors);
  f.rule(is_url(lab.license), "license", "the licence is not a URL",
         "write e.g. https://creativecommons.org/licenses/by/4.0/");
  f.rule(lab.program_url.empty() || is_url(lab.program_url), "program_url", "this is not a URL",
         "write e.g. https://doi.org/...");
  f.rule(!lab.authors.empty(), "author", "there is no author", "add an [[author]]");
}

}  // namespace drape::compare
