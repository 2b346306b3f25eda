// SPDX-License-Identifier: Apache-2.0
#include "compare/crate/crate.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <map>
#include <set>

#include "compare/crate/crate_files.hpp"
#include "compare/crate/crate_tables.hpp"
#include "compare/history/results.hpp"
#include "compare/records/provenance.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/run_record.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// A path as a relative URI (RFC 3986): everything but unreserved characters and `/` is encoded.
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

/// Code of the Unified Code for Units of Measure for a unit of the metric dictionary.
std::string ucum(const std::string& unit) {
  return unit == "px" ? "{pixel}" : unit;
}

/// A time of ISO 8601 with its offset as a number, which validators of the profile look for.
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

  Crate write() {
    choose_files();
    for (const auto& [file, stated] : files_) copy(file, stated);
    for (const auto& [file, stated] : files_)
      if (file.string().ends_with(".run.json") && ids_.contains(file)) add_action(file);
    add_tables();
    add_root();
    Json json;
    json["@context"] = "https://w3id.org/ro/crate/1.3/context";
    json["@graph"] = Json::array();
    for (Json* list : {&roots_, &entities_})
      for (Json& entity : *list) json["@graph"].push_back(std::move(entity));
    write_json(out_ / "ro-crate-metadata.json", json);
    return crate_;
  }

 private:
  void choose_files() {
    files_ = crate_files(store_, run_, book_, crate_.findings);
    if (files_.empty()) return;
    base_ = files_.begin()->first.parent_path();
    for (const auto& [file, stated] : files_) {
      while (file.lexically_relative(base_).generic_string().starts_with(".."))
        base_ = base_.parent_path();
    }
  }

  void copy(const fs::path& file, const std::set<std::string>& stated) {
    const auto sha256 = book_.sha256(file);
    if (!sha256) {
      crate_.findings.push_back(kGone + file.string());
      return;
    }
    if (std::any_of(stated.begin(), stated.end(),
                    [&](const std::string& other) { return other != *sha256; })) {
      crate_.findings.push_back(kNotAsRecorded + file.string());
      return;
    }
    if (!book_.is_traced(file)) crate_.findings.push_back(kNotTraced + file.string());
    const fs::path name = fs::path("files") / file.lexically_relative(base_);
    write_durable(out_ / name, read_text(file));
    add_file(name, *sha256, "");
    ids_[file] = uri_of(name);
  }

  void add_file(const fs::path& name, const std::string& sha256, const std::string& description) {
    Json file;
    file["@id"] = uri_of(name);
    file["@type"] = "File";
    file["name"] = name.filename().string();
    if (!description.empty()) file["description"] = description;
    file["encodingFormat"] = media_type(name);
    file["contentSize"] = std::to_string(fs::file_size(out_ / name));
    file["sha256"] = sha256;
    places_[uri_of(name)] = entities_.size();
    entities_.push_back(file);
    parts_.push_back(reference(uri_of(name)));
    ++crate_.files;
  }

  /// Says who wrote each file of `list`, or who read it where nobody says more.
  void describe(const Json& list, const std::string& by, bool written) {
    for (const Json& item : list) {
      Json& entity = entities_[places_.at(item["@id"].get<std::string>())];
      if (written || !entity.contains("description"))
        entity["description"] = (written ? "written by " : "read by ") + by;
    }
  }

  std::string software(const std::string& program, const std::string& version,
                       const std::string& sha256) {
    // RFC 6920: a name made of the hash of the program's bytes, which needs no address.
    std::string id = "nih:sha-256;" + sha256;
    if (softwares_.insert(id).second)
      entities_.push_back({{"@id", id},
                           {"@type", "SoftwareApplication"},
                           {"name", program},
                           {"version", version},
                           {"url", lab_.program_url.empty() ? id : lab_.program_url},
                           {"identifier", "sha256:" + sha256}});
    return id;
  }

  Json references(const JsonNode& root, const std::string& key, const fs::path& folder) {
    Json list = Json::array();
    for (const JsonNode& item : root.items(key)) {
      const auto found = ids_.find((folder / item.text("file")).lexically_normal());
      if (found != ids_.end()) list.push_back(reference(found->second));
    }
    return list;
  }

  void add_action(const fs::path& file) {
    const JsonNode record = JsonNode::open(file, "run", 1);
    const std::string program = record.text("program");
    Json action;
    action["@id"] = "#" + ids_[file];
    action["@type"] = "CreateAction";
    action["name"] = "run of " + program;
    action["description"] =
        fmt::format("{} {}", program, fmt::join(record.texts("arguments"), " "));
    action["startTime"] = with_offset(record.text("started_utc"));
    action["endTime"] = with_offset(record.text("ended_utc"));
    action["instrument"] =
        reference(software(program, record.text("version"), record.text("program_sha256")));
    action["object"] = references(record, "inputs", file.parent_path());
    action["result"] = references(record, "outputs", file.parent_path());
    action["agent"] = agents();
    describe(action["result"], program, true);
    describe(action["object"], program, false);
    describe(Json::array({reference(ids_[file])}), program + ", record of the run", true);
    add_action(std::move(action));
  }

  void add_action(Json action) {
    mentions_.push_back(reference(action["@id"]));
    entities_.push_back(std::move(action));
    ++crate_.actions;
  }

  Json add_table(const CrateTable& table) {
    const std::string text = csv_of(table.table);
    write_durable(out_ / table.file, text);
    add_file(table.file, sha256_of(std::string_view(text)), table.description);
    for (const std::string& column : table.table.names) columns_.insert(column);
    return reference(table.file);
  }

  /// The numbers themselves, made from the sheets by this program.
  void add_tables() {
    Json results = Json::array();
    std::size_t numbers = 0;
    for (const CrateTable& table : crate_tables(store_, run_)) {
      results.push_back(add_table(table));
      numbers += table.table.rows.size();
    }
    if (numbers == 0) crate_.findings.emplace_back("the store holds no number");
    if (run_) add_headlines(results);
    Json sheets = Json::array();
    for (const auto& [file, id] : ids_)
      if (file.filename() == "sheet.json") sheets.push_back(reference(id));
    Json action;
    action["@id"] = "#export";
    action["@type"] = "CreateAction";
    action["name"] = "export of the results";
    action["description"] = "tables made from the sheets and their store";
    action["endTime"] = with_offset(published_);
    action["instrument"] =
        reference(software("drape-results", version(), sha256_of_file("/proc/self/exe")));
    action["object"] = sheets;
    action["result"] = results;
    action["agent"] = agents();
    add_action(std::move(action));
    add_metrics();
  }

  void add_headlines(Json& results) {
    published_ = std::get<0>(
        store_.rows<std::string>("SELECT date FROM run WHERE number = ?", {*run_}).at(0));
    for (const CrateHeadline& headline : crate_headlines(store_, *run_)) {
      const std::string id = "#mean-distance-" + uri_of(headline.scene);
      entities_.push_back({{"@id", id},
                           {"@type", "PropertyValue"},
                           {"name", "mean distance of drape " + headline.scene},
                           {"description", headline.statement},
                           {"value", headline.mean_mm},
                           {"unitCode", "mm"},
                           {"unitText", "mm (UCUM)"}});
      results.push_back(reference(id));
    }
  }

  /// What the columns of the tables mean, with their units.
  void add_metrics() {
    std::vector<Metric> metrics = metric_dictionary(store_);
    metrics.emplace_back(
        "expanded_uncertainty_mm", "mm",
        "half width of what 95 of 100 draws of all inputs leave of the mean distance (JCGM 101); a "
        "lower bound where uncertainty_is says `at least`");
    for (const auto& [name, unit, definition] : metrics) {
      if (!columns_.contains(name)) continue;
      const std::string id = "#metric-" + name;
      entities_.push_back({{"@id", id},
                           {"@type", "PropertyValue"},
                           {"name", name},
                           {"description", definition},
                           {"unitCode", ucum(unit)},
                           {"unitText", unit + " (UCUM)"}});
      measured_.push_back(reference(id));
    }
  }

  Json agents() const {
    Json list = Json::array();
    for (std::size_t i = 0; i < lab_.authors.size(); ++i) list.push_back(reference(author_id(i)));
    return list;
  }

  std::string author_id(std::size_t i) const {
    return lab_.authors[i].orcid.empty() ? fmt::format("#author-{}", i + 1) : lab_.authors[i].orcid;
  }

  void add_root() {
    roots_.push_back({{"@id", "ro-crate-metadata.json"},
                      {"@type", "CreativeWork"},
                      {"about", reference("./")},
                      {"conformsTo", reference("https://w3id.org/ro/crate/1.3")}});
    Json root;
    root["@id"] = "./";
    root["@type"] = "Dataset";
    root["conformsTo"] = reference("https://w3id.org/ro/wfrun/process/0.6");
    root["name"] = lab_.title;
    root["description"] = lab_.description;
    root["datePublished"] = published_;
    root["license"] = reference(lab_.license);
    root["author"] = agents();
    root["variableMeasured"] = measured_;
    root["hasPart"] = parts_;
    root["mentions"] = mentions_;
    roots_.push_back(root);
    roots_.push_back({{"@id", "https://w3id.org/ro/wfrun/process/0.6"},
                      {"@type", {"CreativeWork", "Profile"}},
                      {"name", "Process Run Crate"},
                      {"version", "0.6"}});
    roots_.push_back({{"@id", lab_.license},
                      {"@type", "CreativeWork"},
                      {"name", lab_.license_name},
                      {"description", "licence of this data: " + lab_.license_name}});
    for (std::size_t i = 0; i < lab_.authors.size(); ++i) {
      const Lab::Author& author = lab_.authors[i];
      Json person;
      person["@id"] = author_id(i);
      person["@type"] = "Person";
      person["name"] = author.name;
      if (!author.affiliation.empty()) {
        const std::string id = fmt::format("#affiliation-{}", i + 1);
        person["affiliation"] = reference(id);
        roots_.push_back({{"@id", id}, {"@type", "Organization"}, {"name", author.affiliation}});
      }
      roots_.push_back(person);
    }
  }

  const StoreReader& store_;
  std::optional<int> run_;
  const Lab& lab_;
  fs::path out_, base_;
  RecordBook book_;
  std::map<fs::path, std::set<std::string>> files_;  ///< with the hashes stated of each
  std::map<fs::path, std::string> ids_;              ///< of what was copied
  std::map<std::string, std::size_t> places_;        ///< of the files, in entities_
  std::set<std::string> softwares_, columns_;
  std::string published_ = today();
  Json roots_ = Json::array(), entities_ = Json::array(), parts_ = Json::array(),
       mentions_ = Json::array(), measured_ = Json::array();
  Crate crate_;

  static std::string today() {
    return fmt::format(
        "{:%Y-%m-%d}",
        fmt::gmtime(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now())));
  }
};

}  // namespace

Crate write_crate(const StoreReader& store, std::optional<int> run, const Lab& lab,
                  const fs::path& out) {
  if (fs::exists(out) && !(fs::is_directory(out) && fs::is_empty(out)))
    throw usage_error(fmt::format("{} is not an empty folder", out.string()),
                      "name a new one with --out");
  return CrateWriter(store, run, lab, out).write();
}

}  // namespace drape::compare
