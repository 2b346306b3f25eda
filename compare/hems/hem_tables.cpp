// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <map>

#include "compare/hems/hem_files.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

Json json_of(const HemRecord& record) {
  Json json;
  json["file"] = record.file;
  json["go"] = record.go;
  for (const auto& [name, value] : {std::pair{"fabric", record.fabric},
                                    {"sample", record.sample},
                                    {"face", record.face},
                                    {"repeat", record.repeat},
                                    {"scale", record.basis}})
    json[name] = value.empty() ? Json() : Json(value);
  json["specimen_area_mm2"] = record.specimen_area_m2 / (mm * mm);
  json["numbers"] = Json::object();
  for (const HemNumber& number : record.numbers)
    json["numbers"][number.name] = {{"value", number.value},
                                    {"u", number.u ? Json(*number.u) : Json()}};
  json["nodes"] = Json::array();
  for (const HemNode& node : record.nodes)
    json["nodes"].push_back({{"angle_deg", node.angle_rad / units::deg},
                             {"radius_mm", node.radius_m / mm},
                             {"amplitude_mm", node.amplitude_m / mm},
                             {"wavelength_mm", node.wavelength_m / mm}});
  json["radius_mm"] = Json::array();
  for (std::size_t i = 0; i < record.hem.radius_m.size(); i += record.hem.radius_m.size() / 72)
    json["radius_mm"].push_back(record.hem.radius_m[i] / mm);
  json["warnings"] = record.warnings;
  return json;
}

Json json_of(const Judgement& judgement) {
  Json json;
  json["p"] = judgement.p ? Json(*judgement.p) : Json();
  json["t"] = judgement.t;
  json["degrees_of_freedom"] = judgement.dof;
  json["mean"] = judgement.mean;
  json["sd"] = judgement.sd;
  json["detectable"] = judgement.detectable ? Json(*judgement.detectable) : Json();
  return json;
}

std::map<std::string, std::vector<const HemRecord*>> by_fabric(const std::vector<HemRecord>& hems) {
  std::map<std::string, std::vector<const HemRecord*>> fabrics;
  for (const HemRecord& hem : hems) fabrics[hem.fabric].push_back(&hem);
  return fabrics;
}

Json variance_json(const std::string& fabric, const std::vector<const HemRecord*>& hems) {
  std::vector<RepeatKey> keys;
  std::vector<double> values;
  for (const HemRecord* hem : hems) {
    keys.push_back(hem->key());
    values.push_back(hem->drape_coefficient());
  }
  const VarianceComponents found = variance_components(keys, values);
  Json json;
  json["fabric"] = fabric;
  json["drapes"] = found.drapes;
  json["faces"] = Json::array();
  for (const auto& [face, mean] : found.face_means)
    json["faces"].push_back({{"face", face}, {"mean_percent", mean}});
  json["samples"] = found.samples;
  json["repeat_sd_percent"] = found.repeat_sd ? Json(*found.repeat_sd) : Json();
  json["sample_sd_percent"] = found.sample_sd ? Json(*found.sample_sd) : Json();
  return json;
}

}  // namespace

Json hems_json(const DrapemeterGeometry& geometry, const HemSet& real,
               const std::vector<HemMatch>& matches, const MatchOptions& options) {
  Json json;
  json["schema"] = "drapebench/hems/1";
  json["geometry"] = {{"name", geometry.name},
                      {"disc_mm", geometry.disc_m / mm},
                      {"specimen_mm", geometry.specimen_m / mm}};
  json["hems"] = Json::array();
  for (const HemRecord& record : real.hems) json["hems"].push_back(json_of(record));
  json["refused"] = real.refused;
  json["variance"] = Json::array();
  for (const auto& [fabric, hems] : by_fabric(real.hems))
    json["variance"].push_back(variance_json(fabric, hems));
  json["significance"] = options.significance;
  json["matches"] = Json::array();
  for (const HemMatch& match : matches) {
    json["matches"].push_back({{"fabric", match.fabric},
                               {"face", match.face},
                               {"virtual", match.virtual_file},
                               {"repeats", match.repeats},
                               {"verdict", match.verdict},
                               {"reason", match.reason.empty() ? Json() : Json(match.reason)},
                               {"p", match.p ? Json(*match.p) : Json()},
                               {"drape_coefficient_percent", json_of(match.drape_coefficient)},
                               {"log_hem_distance", json_of(match.hem)}});
  }
  return json;
}

}  // namespace drape::compare
