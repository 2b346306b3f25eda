// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/import.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/error.hpp"
#include "core/files/csv.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"
#include "simulate/fabric/csv_text.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/fabric/kes.hpp"
#include "simulate/fabric/plausible.hpp"
#include "simulate/fabric/property_sheet.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;

const UnitTable kDensity = {{"g/m2", 1}, {"mg/cm2", 10}, {"kg/m2", 1000}};
const UnitTable kPercent = {{"%", 1}, {"percent", 1}};
const UnitTable kPlainNumber = {{"", 1}, {"-", 1}, {"1", 1}};
const UnitTable kLength = {{"mm", 1}, {"cm", 10}};
const UnitTable kBending = {{"gfcm2/cm", 1},
                            {"uNm", 1e-6 / units::gf_cm2_per_cm},
                            {"uNm2/m", 1e-6 / units::gf_cm2_per_cm},
                            {"Nm", 1 / units::gf_cm2_per_cm},
                            {"dyncm", 1e-7 / units::gf_cm2_per_cm},
                            {"dyncm2/cm", 1e-7 / units::gf_cm2_per_cm}};
const UnitTable kMoment = {{"gfcm/cm", 1}, {"mN", 1e-3 / units::gf_cm_per_cm}};
const UnitTable kShear = {
    {"gf/cmdeg", 1}, {"N/mrad", 1 / units::gf_per_cm_deg}, {"N/mdeg", 1 / units::gf_per_cm}};
const UnitTable kForce = {{"gf/cm", 1}, {"N/m", 1 / units::gf_per_cm}};
const UnitTable kWork = {{"gfcm/cm2", 1}, {"J/m2", 1 / units::gf_cm_per_cm2}};

const char* const kDirections[2] = {"warp", "weft"};

// Keys of fabric.toml, those of a direction without it.
const std::string kDensityKey = "areal_density_g_per_m2";
const std::string kBias = "bending.bias_stiffness_gf_cm2_per_cm";
const std::string kB = "bending.b_gf_cm2_per_cm", kHb = "bending.hb2_gf_cm_per_cm";
const std::string kG = "shear.g_gf_per_cm_deg";
const std::string kHg = "shear.hg2_gf_per_cm", kHg5 = "shear.hg5_gf_per_cm";

// Shear of a plain woven cloth, where none is known: G 0.6 gf/(cm deg), the middle of suitings and
// shirtings.
constexpr double kUsualShear = 0.6;

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
  }
  return result;
}

/// Numbers of one fabric in the units of fabric.toml; what is absent becomes a stand-in.
struct Numbers {
  std::string name, origin;
  double areal_density = 0;
  std::array<std::string, 2> tensile;  ///< inline table or, with `curves`, a file; empty: stand-in
  std::array<std::optional<double>, 2> g, hg, hg5;
  std::array<double, 2> b{};
  std::array<std::optional<double>, 2> hb;
  std::optional<double> b_bias;
  std::vector<std::string> also_stand_in = {};  ///< what no field of this struct shows
  std::map<std::string, Where> from = {};       ///< see ImportedFabric
};

ImportedFabric imported(const Numbers& numbers) {
  ImportedFabric fabric;
  fabric.from = numbers.from;
  if (numbers.tensile[0].empty()) fabric.stand_ins.emplace_back("tensile curves");
  if (!numbers.g[0])
    fabric.stand_ins.push_back(fmt::format("shear: G {} gf/(cm deg)", kUsualShear));
  if (!numbers.hg[0])
    fabric.stand_ins.emplace_back(numbers.hg5[0] ? "shear hysteresis: 2HG 0 gf/cm"
                                                 : "shear hysteresis: none");
  if (!numbers.hb[0]) fabric.stand_ins.emplace_back("bending hysteresis: none");
  if (!numbers.b_bias) fabric.stand_ins.emplace_back("bending at 45 degrees");
  fabric.stand_ins.insert(fabric.stand_ins.end(), numbers.also_stand_in.begin(),
                          numbers.also_stand_in.end());
  std::string& t = fabric.toml;
  t = fmt::format("schema = \"drapebench/fabric/1\"\n# {}\nname = \"{}\"\n",
                  escaped(numbers.origin), escaped(numbers.name));
  t += fmt::format("areal_density_g_per_m2 = {}\nstand_ins = [", numbers.areal_density);
  for (const std::string& what : fabric.stand_ins)
    if (what != "tensile curves" || !numbers.tensile[0].empty())
      t += fmt::format("\"{}\", ", escaped(what));
  t += "]\n";
  if (!numbers.tensile[0].empty())
    t += fmt::format("\n[tensile]\n{}\n{}\n", numbers.tensile[0], numbers.tensile[1]);
  t += "\n[shear]\n";
  for (int d = 0; d < 2; ++d) {
    t += fmt::format("{}_kes = {{ g_gf_per_cm_deg = {}", kDirections[d],
                     numbers.g[d].value_or(kUsualShear));
    if (numbers.hg[d]) t += fmt::format(", hg2_gf_per_cm = {}", *numbers.hg[d]);
    if (numbers.hg5[d]) t += fmt::format(", hg5_gf_per_cm = {}", *numbers.hg5[d]);
    t += " }\n";
  }
  t += "\n[bending]\n";
  for (int d = 0; d < 2; ++d) {
    t += fmt::format("{}_kes = {{ b_gf_cm2_per_cm = {}", kDirections[d], numbers.b[d]);
    if (numbers.hb[d]) t += fmt::format(", hb2_gf_cm_per_cm = {}", *numbers.hb[d]);
    t += " }\n";
  }
  if (numbers.b_bias) t += fmt::format("bias_stiffness_gf_cm2_per_cm = {}\n", *numbers.b_bias);
  return fabric;
}

/// "shear.g_gf_per_cm_deg" of one direction as the reader of fabric.toml names it.
std::string key_of(const std::string& key, int direction) {
  const std::size_t dot = key.find('.');
  return fmt::format("{}.{}_kes{}", key.substr(0, dot), kDirections[direction], key.substr(dot));
}

/// What a sheet says of the whole cloth.
Numbers numbers_of(const PropertySheet& sheet, const std::string& name, const std::string& origin) {
  Numbers numbers;
  numbers.name = name;
  numbers.origin = origin;
  const auto density = sheet.whole("W");
  if (!density) throw bad_input("W is missing", sheet.where("W"), "give the areal density");
  numbers.areal_density = *density;
  numbers.from[kDensityKey] = sheet.where("W");
  for (const char* thickness : {"T", "T2", "T100"})  // not used, but of this cloth
    if (const auto value = sheet.whole(thickness); value && !(*value > 0))
      throw bad_input(fmt::format("a thickness of {:g} mm", *value), sheet.where(thickness),
                      "correct or remove it");
  if (const auto thin = sheet.whole("T100"), thick = sheet.whole("T2");
      thin && thick && *thin > *thick)
    throw bad_input(fmt::format("T100 is {:g} mm, T2 {:g} mm: under 100 gf/cm2 a cloth is no "
                                "thicker than under 2",
                                *thin, *thick),
                    sheet.where("T100"), "are the two exchanged?");
  return numbers;
}

/// Where the source states what was refused in the files made from it.
Where in_source(const ImportedFabric& fabric, const Where& where) {
  const std::string name = fs::path(where.file).filename().string();
  for (const std::string& key :
       {where.field, fmt::format("{}:{}", name, where.line.value_or(0)), name})
    if (const auto found = fabric.from.find(key); found != fabric.from.end()) return found->second;
  return where;
}

double number_of(const Json& json, const fs::path& file, const std::string& key) {
  if (json.is_number()) return json.get<double>();
  if (json.is_string()) {  // some writers quote their numbers
    const std::string text = json.get<std::string>();
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (end == text.c_str() + text.size() && !text.empty() && std::isfinite(value)) return value;
  }
  throw bad_input("not a number", {.file = file.string(), .field = key}, "export it again");
}

const Json& member(const Json& json, const fs::path& file, const std::string& key) {
  if (json.is_object() && json.contains(key) && !json[key].is_null()) return json[key];
  throw bad_input("a field of U3M physics is missing", {.file = file.string(), .field = key},
                  "export the physics with its section `custom`");
}

}  // namespace

ImportedFabric import_kes(const fs::path& file, const std::string& name) {
  const PropertySheet sheet(file, {{"W", kDensity},
                                   {"T", kLength},
                                   {"LT", kPlainNumber},
                                   {"WT", kWork},
                                   {"RT", kPercent},
                                   {"EMT", kPercent},
                                   {"G", kShear},
                                   {"2HG", kForce},
                                   {"2HG5", kForce},
                                   {"B", kBending},
                                   {"2HB", kMoment},
                                   {"B45", kBending}});
  Numbers numbers = numbers_of(sheet, name, "KES-FB result sheet " + file.filename().string());
  numbers.b_bias = sheet.whole("B45");
  numbers.from[kBias] = sheet.where("B45");
  const bool has_tensile = sheet.has("EMT") || sheet.has("LT") || sheet.has("WT");
  if (has_tensile && !sheet.has("RT"))
    numbers.also_stand_in.emplace_back("tensile hysteresis: RT 60 %");
  const std::vector<std::pair<std::string, std::string>> tensile = {
      {"EMT", "emt_percent"}, {"LT", "lt"}, {"WT", "wt_gf_cm_per_cm2"}, {"RT", "rt_percent"}};
  for (int d = 0; d < 2; ++d) {
    const auto take = [&](const std::string& property, const std::string& key) {
      numbers.from[key_of(key, d)] = sheet.where(property);
      return sheet.along(property, d);
    };
    numbers.b[d] = take("B", kB);
    if (sheet.has("2HB")) numbers.hb[d] = take("2HB", kHb);
    if (sheet.has("G")) numbers.g[d] = take("G", kG);
    if (sheet.has("2HG")) numbers.hg[d] = take("2HG", kHg);
    if (sheet.has("2HG5")) numbers.hg5[d] = take("2HG5", kHg5);
    std::string inside;
    for (const auto& [property, key] : tensile)
      if (sheet.has(property))
        inside += fmt::format("{}{} = {}", inside.empty() ? "" : ", ", key,
                              take(property, "tensile." + key));
    // What a tensile test lacks is named at the row that stands there.
    for (const auto& [property, key] : tensile)
      for (const auto& [given, unused] : tensile)
        if (!sheet.has(property) && sheet.has(given))
          numbers.from.try_emplace(key_of("tensile." + key, d), sheet.where(given));
    if (!inside.empty())
      numbers.tensile[d] = fmt::format("{}_kes = {{ {} }}", kDirections[d], inside);
  }
  return imported(numbers);
}

ImportedFabric import_fast(const fs::path& file, const std::string& name) {
  const PropertySheet sheet(file, {{"W", kDensity},
                                   {"T2", kLength},
                                   {"T100", kLength},
                                   {"C", kLength},
                                   {"C45", kLength},
                                   {"E5", kPercent},
                                   {"E20", kPercent},
                                   {"E100", kPercent},
                                   {"EB5", kPercent}});
  Numbers numbers = numbers_of(sheet, name, "FAST result sheet " + file.filename().string());
  // B = w g C^3 (Peirce 1930); W in g/m2, C in mm.
  const auto rigidity = [&](double c_mm) {
    return numbers.areal_density * units::g_per_m2 * 9.80665 * std::pow(c_mm * units::mm, 3) /
           units::gf_cm2_per_cm;
  };
  if (const auto c = sheet.whole("C45")) numbers.b_bias = rigidity(*c);
  numbers.from[kBias] = sheet.where("C45");
  const auto eb5 = sheet.whole("EB5");
  if (eb5 && !(*eb5 > 0)) throw bad_input("EB5 is not above 0", sheet.where("EB5"), "check it");
  ImportedFabric curves;
  const UsualBending usual = usual_bending(numbers.areal_density);
  for (int d = 0; d < 2; ++d) {
    const double c_mm = sheet.along("C", d);
    numbers.b[d] = rigidity(c_mm);
    if (numbers.b[d] < usual.least_possible || numbers.b[d] > usual.most_possible)
      throw bad_input(
          fmt::format("a bending length of {:g} mm; fabrics of {:g} to {:g} g/m2 have "
                      "{:.2g} to {:.2g}",
                      c_mm, usual.from, usual.to, c_mm * std::cbrt(usual.least / numbers.b[d]),
                      c_mm * std::cbrt(usual.most / numbers.b[d])),
          sheet.where("C"), "is it in cm, or the overhang, which is twice the bending length?");
    numbers.from[key_of(kB, d)] = sheet.where("C");
    if (eb5) {
      numbers.g[d] = shear_from_bias_extension(*eb5, sheet.where("EB5"));
      numbers.from[key_of(kG, d)] = sheet.where("EB5");
    }
    const std::string curve = fmt::format("tensile_{}.csv", kDirections[d]);
    std::vector<double> strain = {0}, force = {0};
    for (const auto& [property, load] : {std::pair{"E5", 5.0}, {"E20", 20.0}, {"E100", 100.0}}) {
      if (!sheet.has(property)) continue;
      strain.push_back(sheet.along(property, d));
      force.push_back(load);
      numbers.from[fmt::format("{}:{}", curve, strain.size() + 1)] = sheet.where(property);
      numbers.from[curve] = sheet.where(property);
    }
    if (strain.size() == 1) continue;
    if (strain.size() == 2)
      throw bad_input("a tensile curve needs two of E5, E20 and E100: the others are missing",
                      numbers.from.at(curve), "give one more, or remove this one");
    curves.curves.emplace_back(
        curve, csv_text({"strain_percent", "loading_force_gf_per_cm", "unloading_force_gf_per_cm"},
                        {strain, force, force}));
    numbers.tensile[d] = fmt::format("{} = \"{}\"", kDirections[d], curve);
    if (d == 0)
      numbers.also_stand_in.push_back(fmt::format(
          "tensile hysteresis: unloading as loading, nothing above {:g} gf/cm", force.back()));
  }
  ImportedFabric fabric = imported(numbers);
  fabric.curves = std::move(curves.curves);
  return fabric;
}

ImportedFabric import_u3m(const fs::path& file, const std::string& name,
                          const std::string& bend_unit) {
  Json json;
  try {
    json = parse_json(read_text(file), file.string());
  } catch (const Json::exception& error) {
    throw bad_input(fmt::format("no JSON: {}", error.what()), {.file = file.string()},
                    "give the physics JSON of a U3M 1.1 material");
  }
  const Json& custom = member(json, file, "custom");
  const Json& fields = custom.size() == 1 ? custom.front() : member(custom, file, "browzwear");
  const double factor = factor_of(kBending, bend_unit, {.file = file.string(), .field = "bend"});
  Numbers numbers{name,
                  "U3M physics " + file.filename().string(),
                  number_of(member(fields, file, "mass"), file, "mass"),
                  {},
                  {},
                  {},
                  {},
                  {},
                  {},
                  {}};
  const Json& bend = member(fields, file, "bend");
  numbers.b = {factor * number_of(member(bend, file, "length"), file, "bend.length"),
               factor * number_of(member(bend, file, "width"), file, "bend.width")};
  numbers.from = {{kDensityKey, {.file = file.string(), .field = "mass"}},
                  {key_of(kB, 0), {.file = file.string(), .field = "bend.length"}},
                  {key_of(kB, 1), {.file = file.string(), .field = "bend.width"}}};
  return imported(numbers);
}

std::vector<std::string> write_imported(const fs::path& folder, const ImportedFabric& fabric) {
  if (fs::exists(folder))
    throw bad_input("the folder exists", {.file = folder.string()}, "name a new one");
  const auto take_back = [&] {
    for (const auto& [name, text] : fabric.curves) fs::remove(folder / name);
    fs::remove(folder / "fabric.toml");
    fs::remove(folder);
  };
  try {
    for (const auto& [name, text] : fabric.curves) write_durable(folder / name, text);
    write_durable(folder / "fabric.toml", fabric.toml);
    const Fabric read = read_fabric(folder / "fabric.toml");
    require_textile(read);
    return read.warnings;
  } catch (const Error& error) {
    take_back();
    throw Error(error.kind(), error.what_failed(), in_source(fabric, error.where()),
                error.what_to_do());
  } catch (...) {
    take_back();
    throw;
  }
}

std::vector<PublishedFabric> read_published(const fs::path& file) {
  const CsvText table = read_csv_text(file);
  std::vector<PublishedFabric> library;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const auto text = [&](const char* name) { return table.rows[row][table.column(name)]; };
    const auto number = [&](const char* name) { return table.number(row, name); };
    library.push_back({text("id"), text("name"), text("weave"), text("source"), text("note"),
                       number("areal_density_g_per_m2"), number("thickness_mm"),
                       number("b_warp_gf_cm2_per_cm"), number("b_weft_gf_cm2_per_cm"),
                       number("b_bias_gf_cm2_per_cm"), number("two_hb_gf_cm_per_cm"),
                       number("drape_coefficient_percent"), number("nodes"), number("disc_mm"),
                       number("specimen_mm")});
    if (library.back().source.empty())
      throw bad_input("a fabric without source",
                      {.file = file.string(), .line = table.lines[row], .field = "source"},
                      "say where its numbers come from");
  }
  return library;
}

const PublishedFabric& published_fabric(const std::vector<PublishedFabric>& library,
                                        const std::string& id) {
  std::string known;
  for (const PublishedFabric& fabric : library) {
    if (fabric.id == id) return fabric;
    known += (known.empty() ? "" : ", ") + fabric.id;
  }
  throw usage_error(fmt::format("`{}` is not in the library", id), "there are: " + known);
}

ImportedFabric import_published(const PublishedFabric& fabric) {
  if (!fabric.areal_density_g_per_m2 || !fabric.b_warp_gf_cm2_per_cm)
    throw bad_input(fmt::format("{} has no density or no bending rigidity", fabric.id), {},
                    "choose a fabric that `drape fabric list` shows with both");
  Numbers numbers{fabric.id + " " + fabric.name,
                  fabric.source,
                  *fabric.areal_density_g_per_m2,
                  {},
                  {},
                  {},
                  {},
                  {*fabric.b_warp_gf_cm2_per_cm,
                   fabric.b_weft_gf_cm2_per_cm.value_or(*fabric.b_warp_gf_cm2_per_cm)},
                  {fabric.hb2_gf_cm_per_cm, fabric.hb2_gf_cm_per_cm},
                  fabric.b_bias_gf_cm2_per_cm};
  if (!fabric.b_weft_gf_cm2_per_cm)
    numbers.also_stand_in.emplace_back("bending: one B for warp and weft");
  return imported(numbers);
}

}  // namespace drape::simulate
