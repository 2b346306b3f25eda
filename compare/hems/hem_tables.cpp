// SPDX-License-Identifier: Apache-2.0
#include <map>

#include "compare/hems/hem_files.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

/// Drapes of a fabric, with the scatter between its samples and between repeats.
struct FabricVariance {
  std::string fabric;
  VarianceComponents found;
};

struct FaceMean {
  std::string face;
  double percent = 0;
};

void fields(Fields& f, FaceMean& one) {
  f({"face", "side of the cloth that faces up"}, one.face);
  f({"mean_percent", "mean drape coefficient"}, one.percent);
}

void fields(Fields& f, FabricVariance& one) {
  f({"fabric", "name"}, one.fabric);
  f({"drapes", "number of hems"}, one.found.drapes);
  std::vector<FaceMean> faces;
  for (const auto& [face, mean] : one.found.face_means) faces.push_back({face, mean});
  f({"faces", "means of the faces"}, faces);
  f({"samples", "samples"}, one.found.samples);
  f({"repeat_sd_percent", "standard deviation of repeats"}, one.found.repeat_sd);
  f({"sample_sd_percent", "standard deviation of samples"}, one.found.sample_sd);
}

struct ValueWithU {
  double value = 0;
  std::optional<double> u;
};

void fields(Fields& f, ValueWithU& one) {
  f({"value", "value in the unit at the end of its name"}, one.value);
  f({"u", "expanded uncertainty, k = 2; null if not known"}, one.u);
}

}  // namespace

void fields(Fields& f, DrapemeterGeometry& geometry) {
  f({"name", "standard test, or own"}, geometry.name);
  f({"disc_mm", "diameter of the disc", mm}, geometry.disc_m);
  f({"specimen_mm", "diameter of the specimen", mm}, geometry.specimen_m);
}

void fields(Fields& f, HemNode& node) {
  f({"angle_deg", "direction of the crest", units::deg}, node.angle_rad);
  f({"radius_mm", "radius of the crest", mm}, node.radius_m);
  f({"amplitude_mm", "half of crest minus mean of the adjacent valleys", mm}, node.amplitude_m);
  f({"wavelength_mm", "length of arc to the next crest", mm}, node.wavelength_m);
}

void fields(Fields& f, HemRecord& record) {
  f({"file", "file, with the row if it holds several"}, record.file);
  f({"go", "false if not at rest or based on a NO-GO"}, record.go);
  text_or_null(f, {"fabric", "name"}, record.fabric);
  text_or_null(f, {"sample", "name"}, record.sample);
  text_or_null(f, {"face", "side of the cloth that faces up"}, record.face);
  text_or_null(f, {"repeat", "name"}, record.repeat);
  text_or_null(f, {"scale", "source of the scale; null for millimetres"}, record.basis);
  f({"specimen_area_mm2", "flat area of the specimen", mm * mm}, record.specimen_area_m2);
  std::vector<std::pair<std::string, ValueWithU>> numbers;
  for (const HemNumber& number : record.numbers)
    numbers.emplace_back(number.name, ValueWithU{number.value, number.u});
  f({"numbers", "drapemeter values"}, numbers);
  f({"nodes", "folds of the hem"}, record.nodes);
  std::vector<double> radius_m;
  for (std::size_t i = 0; i < record.hem.radius_m.size(); i += record.hem.radius_m.size() / 72)
    radius_m.push_back(record.hem.radius_m[i]);
  f({"radius_mm", "radii every 5 degrees", mm}, radius_m);
  f({"warnings", "warnings"}, record.warnings);
}

void fields(Fields& f, Judgement& judgement) {
  f({"p", "probability that a repeat deviates as far"}, judgement.p);
  f({"t", "deviation in standard deviations"}, judgement.t);
  f({"degrees_of_freedom", "degrees of freedom of t"}, judgement.dof);
  f({"mean", "mean of the repeats"}, judgement.mean);
  f({"sd", "standard deviation of the repeats, combined with the prior"}, judgement.sd);
  f({"detectable", "difference that would be detected in 90 of 100 cases"}, judgement.detectable);
}

void fields(Fields& f, HemMatch& match) {
  f({"fabric", "name"}, match.fabric);
  f({"face", "side of the cloth that faces up"}, match.face);
  f({"virtual", "file of the virtual hem"}, match.virtual_file);
  f({"repeats", "number of hems of that fabric and face"}, match.repeats);
  f({"verdict", "verdict of the comparison with the repeats"}, match.verdict);
  text_or_null(f, {"reason", "reason if undecided"}, match.reason);
  f({"p", "probability combined from both tests"}, match.p);
  f({"drape_coefficient_percent", "test of the drape coefficient"}, match.drape_coefficient);
  f({"log_hem_distance", "test of the hem's shape"}, match.hem);
}

void fields(Fields& f, HemsFile& file) {
  f({"geometry", "disc and specimen"}, file.geometry);
  f({"hems", "hems read"}, file.hems);
  f({"refused", "files that were refused, with the reason"}, file.refused);
  std::map<std::string, std::pair<std::vector<RepeatKey>, std::vector<double>>> fabrics;
  for (const HemRecord& hem : file.hems) {
    if (hem.numbers.empty()) continue;  // for walks that only document the format
    fabrics[hem.fabric].first.push_back(hem.key());
    fabrics[hem.fabric].second.push_back(hem.drape_coefficient());
  }
  std::vector<FabricVariance> variance;
  for (const auto& [fabric, values] : fabrics)
    variance.push_back({fabric, variance_components(values.first, values.second)});
  f({"variance", "scatter of each fabric"}, variance);
  f({"significance", "probability that a real repeat counts as outside"}, file.significance);
  f({"matches", "comparison of virtual hems with repeats"}, file.matches);
}

}  // namespace drape::compare
