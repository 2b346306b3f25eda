// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/import.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "core/fields/records.hpp"
#include "core/files/files.hpp"
#include "core/files/new_folder.hpp"
#include "core/units.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/fabric/laws.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;

/// Units of a quantity, with the factor to the unit of fabric.toml.
using UnitTable = std::vector<std::pair<std::string, double>>;

/// Normalised spelling of a unit: without spaces, dots, brackets and carets.
std::string plain_unit(const std::string& unit) {
  std::string text;
  for (std::size_t i = 0; i < unit.size(); ++i) {
    static const std::vector<std::pair<std::string, std::string>> signs = {
        {"\u00b2", "2"},  // superscript
        {"\u00b7", ""},   // middle dot, dot operator, bullet operator, bullet
        {"\u22c5", ""},    {"\u2219", ""},
        {"\u2022", ""},    {"\u00b0", "deg"},  // degree sign, ordinal, ring
        {"\u00ba", "deg"}, {"\u02da", "deg"},
        {"\u00b5", "u"},   {"\u03bc", "u"}};
    const auto sign = std::find_if(signs.begin(), signs.end(), [&](const auto& known) {
      return unit.compare(i, known.first.size(), known.first) == 0;
    });
    if (sign != signs.end()) {
      text += sign->second;
      i += sign->first.size() - 1;
    } else if (std::string(" .*()^").find(unit[i]) == std::string::npos) {
      text += unit[i];
    }
  }
  return text;
}

/// Conversion factor of a unit. Throws for an unknown unit.
double factor_of(const UnitTable& table, const std::string& unit, const Where& where) {
  std::string known;
  for (const auto& [name, factor] : table) {
    if (name == plain_unit(unit)) return factor;
    known += (known.empty() ? "" : ", ") + (name.empty() ? std::string("none") : name);
  }
  throw bad_input(fmt::format("`{}` is no unit of this property", unit), where, "known: " + known);
}

/// A quantity: its units and the properties measured in them.
using Quantity = std::pair<UnitTable, std::vector<const char*>>;

/// A sheet of property,unit,warp,weft, with values converted to the units of fabric.toml.
class PropertySheet {
 public:
  PropertySheet(const fs::path& file, const std::vector<Quantity>& quantities) : file_(file) {
    std::map<std::string, UnitTable> known;
    for (const auto& [units, properties] : quantities)
      for (const char* property : properties) known[property] = units;
    const CsvText table = read_csv_text(file);
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
      const std::string property = table.rows[row][table.column("property")];
      const Where where{.file = file.string(), .line = table.lines[row], .field = property};
      const auto found = known.find(property);
      if (found == known.end()) {
        std::string names;
        for (const auto& [name, units] : known) names += (names.empty() ? "" : ", ") + name;
        throw bad_input("an unknown property", where, "known: " + names);
      }
      if (has(property)) throw bad_input("a property twice", where, "keep one row");
      const double factor = factor_of(found->second, table.rows[row][table.column("unit")], where);
      Row read{table.lines[row], {table.number(row, "warp"), table.number(row, "weft")}};
      for (auto& value : read.values)
        if (value) *value *= factor;
      rows_[property] = read;
    }
  }

  [[nodiscard]] bool has(const std::string& property) const { return rows_.contains(property); }
  /// Value along 0 warp or 1 weft. Throws if the property has no value there.
  [[nodiscard]] double along(const std::string& property, int direction) const {
    if (has(property))
      if (const auto value = rows_.at(property).values[direction]) return *value;
    throw bad_input(
        fmt::format("{} is missing along the {}", property, direction == 0 ? "warp" : "weft"),
        where(property), "warp and weft are never merged: give both");
  }
  /// Value of a property of the whole cloth: stated under warp or weft, or equal under both.
  /// nullopt if there is no row or no value in it.
  [[nodiscard]] std::optional<double> whole(const std::string& property) const {
    if (!has(property)) return std::nullopt;
    const auto& [warp, weft] = rows_.at(property).values;
    if (warp && weft && *warp != *weft)
      throw bad_input(fmt::format("{} has two values, but the whole cloth has one", property),
                      where(property), "keep the right one, or the mean of two specimens");
    return warp ? warp : weft;
  }
  /// File, line and property.
  [[nodiscard]] Where where(const std::string& property) const {
    Where where{.file = file_.string(), .field = property};
    if (has(property)) where.line = rows_.at(property).line;
    return where;
  }
  /// Names among `names` that have a row, as a list in words.
  [[nodiscard]] std::string among(std::initializer_list<const char*> names) const {
    std::string list;
    for (const char* name : names)
      if (has(name)) list += (list.empty() ? "" : ", ") + std::string(name);
    return list;
  }

 private:
  struct Row {
    int line = 0;
    std::array<std::optional<double>, 2> values;
  };
  fs::path file_;
  std::map<std::string, Row> rows_;
};

const UnitTable kDensity = {{"g/m2", 1}, {"mg/cm2", 10}, {"kg/m2", 1000}};
const UnitTable kPercent = {{"%", 1}, {"percent", 1}};
const UnitTable kPlainNumber = {{"", 1}, {"-", 1}, {"1", 1}};
const UnitTable kLength = {{"mm", 1}, {"cm", 10}, {"um", 1e-3}};
const UnitTable kArea = {{"mm2", 1}};
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

// Keys of fabric.toml, those for a direction without its name.
const std::string kDensityKey = "areal_density_g_per_m2";
const std::string kBias = "bending.bias_stiffness_gf_cm2_per_cm";
const std::string kB = "bending.b_gf_cm2_per_cm", kHb = "bending.hb2_gf_cm_per_cm";
const std::string kG = "shear.g_gf_per_cm_deg";
const std::string kHg = "shear.hg2_gf_per_cm", kHg5 = "shear.hg5_gf_per_cm";

// Default shear stiffness of plain woven cloth, G 0.6 gf/(cm deg): typical for suitings and
// shirtings.
constexpr double kUsualShear = 0.6;

/// Removes characters that names and comments cannot contain.
std::string plain(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  return text;
}

/// Values of a fabric from an external source; absent ones become stand-ins.
struct Numbers {
  FabricFile file;
  std::string origin;
  std::vector<std::string> also_stand_in = {};  ///< remarks without a field in the file
  std::map<std::string, Where> from = {};       ///< see ImportedFabric

  Numbers(const std::string& name, std::string source, double density_g_per_m2)
      : origin(std::move(source)) {
    file.name = plain(name);
    file.areal_density_g_per_m2 = density_g_per_m2;
    for (int d = 0; d < 2; ++d) file.shear.numbers[d].emplace(), file.bending.numbers[d].emplace();
  }
  void set_bias(const std::optional<double>& gf_cm2_per_cm) {
    if (gf_cm2_per_cm) file.bending.bias_bending_n_m = *gf_cm2_per_cm * units::gf_cm2_per_cm;
  }
  [[nodiscard]] TensileNumbers& tensile(int d) {
    if (!file.tensile) file.tensile.emplace();
    auto& numbers = file.tensile->numbers[d];
    return numbers ? *numbers : numbers.emplace();
  }
  [[nodiscard]] ShearNumbers& shear(int d) { return *file.shear.numbers[d]; }
  [[nodiscard]] BendingNumbers& bending(int d) { return *file.bending.numbers[d]; }
};

ImportedFabric imported(Numbers numbers) {
  ImportedFabric fabric;
  fabric.from = numbers.from;
  std::vector<std::string>& stand_ins = numbers.file.stand_ins;
  if (numbers.shear(0).g_gf_per_cm_deg == 0) {
    stand_ins.push_back(fmt::format("shear: G {} gf/(cm deg)", kUsualShear));
    for (int d = 0; d < 2; ++d) numbers.shear(d).g_gf_per_cm_deg = kUsualShear;
  }
  if (!numbers.shear(0).hg2_gf_per_cm)
    stand_ins.emplace_back(numbers.shear(0).hg5_gf_per_cm ? "shear hysteresis: 2HG 0 gf/cm"
                                                          : "shear hysteresis: none");
  if (!numbers.bending(0).hb2_gf_cm_per_cm) stand_ins.emplace_back("bending hysteresis: none");
  if (!numbers.file.bending.bias_bending_n_m) stand_ins.emplace_back("bending at 45 degrees");
  stand_ins.insert(stand_ins.end(), numbers.also_stand_in.begin(), numbers.also_stand_in.end());
  fabric.toml = fmt::format("# {}\n{}", plain(numbers.origin), text_of(numbers.file));
  fabric.stand_ins = stand_ins;
  if (!numbers.file.tensile) fabric.stand_ins.insert(fabric.stand_ins.begin(), "tensile curves");
  return fabric;
}

/// Key of one direction, such as "shear.g_gf_per_cm_deg", as named by the reader of fabric.toml.
std::string key_of(const std::string& key, int direction) {
  const std::size_t dot = key.find('.');
  return fmt::format("{}.{}_kes{}", key.substr(0, dot), kDirections[direction], key.substr(dot));
}

/// Values of a sheet that apply to the whole cloth.
Numbers numbers_of(const PropertySheet& sheet, const std::string& name, const std::string& origin) {
  const auto density = sheet.whole("W");
  if (!density) throw bad_input("W is missing", sheet.where("W"), "give the areal density");
  Numbers numbers(name, origin, *density);
  numbers.from[kDensityKey] = sheet.where("W");
  for (const char* thickness : {"T", "T2", "T100"})  // not used, but valid for this cloth
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

/// Location in the source of an error in the files made from it.
Where in_source(const ImportedFabric& fabric, const Where& where) {
  const std::string name = fs::path(where.file).filename().string();
  for (const std::string& key :
       {where.field, fmt::format("{}:{}", name, where.line.value_or(0)), name})
    if (const auto found = fabric.from.find(key); found != fabric.from.end()) return found->second;
  return where;
}

double number_of(const Value& json, const fs::path& file, const std::string& key) {
  if (json.is_number()) return json.number();
  if (const auto* text = json.get_if<std::string>()) {  // some writers put numbers in quotes
    char* end = nullptr;
    const double value = std::strtod(text->c_str(), &end);
    if (end == text->c_str() + text->size() && !text->empty() && std::isfinite(value)) return value;
  }
  throw bad_input("not a number", {.file = file.string(), .field = key}, "export it again");
}

const Value& member(const Value& json, const fs::path& file, const std::string& key) {
  if (const Value* found = json.find(key); found != nullptr && !found->is_null()) return *found;
  throw bad_input("a field of U3M physics is missing", {.file = file.string(), .field = key},
                  "export the physics with its section `custom`");
}

constexpr std::size_t kCurvePoints = 25;  ///< points of a tensile curve from a machine's samples
constexpr double kLeastStretch = 0.005;   ///< strain; below it the machine has play

/// Mean force of the samples around each strain, both in the order of the samples. A strain without
/// samples within half a step is interpolated linearly.
std::vector<double> resampled(const std::vector<double>& strain, const std::vector<double>& force,
                              const std::vector<double>& at) {
  std::vector<std::pair<double, double>> sorted;
  for (std::size_t i = 0; i < strain.size(); ++i) sorted.emplace_back(strain[i], force[i]);
  std::sort(sorted.begin(), sorted.end());
  const double half = (at[1] - at[0]) / 2;
  std::vector<double> result;
  for (const double x : at) {
    double sum = 0;
    int count = 0;
    for (const auto& [s, f] : sorted)
      if (std::abs(s - x) <= half) sum += f, ++count;
    const auto above = std::lower_bound(sorted.begin(), sorted.end(), std::pair(x, -HUGE_VAL));
    const auto& b = above == sorted.end() ? sorted.back() : *above;
    const auto& a = above == sorted.begin() ? sorted.front() : *std::prev(above);
    const double line = b.first > a.first
                            ? a.second + (b.second - a.second) * (x - a.first) / (b.first - a.first)
                            : a.second;
    result.push_back(count > 0 ? sum / count : line);
  }
  return result;
}

/// Tensile curve of one strip from Browzwear's FAB: samplesTree alternates stretching and relaxing,
/// each a list of distance (cm) and force (g); the last cycle has the largest stretch. `length` and
/// `width` of the strip between the clamps are in cm.
std::string fab_curve(const Value& strip, const fs::path& file, const std::string& key) {
  const auto refuse = [&](const std::string& what) {
    return bad_input(what, {.file = file.string(), .field = key}, "export the raw data again");
  };
  const double length_cm = number_of(member(strip, file, "length"), file, key + ".length");
  const double width_cm = number_of(member(strip, file, "width"), file, key + ".width");
  const auto* runs = member(strip, file, "samplesTree").get_if<Value::List>();
  if (!(length_cm > 0 && width_cm > 0)) throw refuse("the strip has no size");
  if (runs == nullptr || runs->size() < 2 || runs->size() % 2 != 0)
    throw refuse("samplesTree does not hold stretching and relaxing in turn");
  std::array<std::vector<double>, 2> strain, force;
  std::optional<double> rest_cm, zero_g;
  for (const Value& run : *runs) {
    const auto* samples = run.get_if<Value::List>();
    if (samples == nullptr || samples->size() < 4 || samples->size() % 2 != 0)
      throw refuse("a run is not a list of distance and force in turn");
    const std::size_t back = static_cast<std::size_t>(&run - runs->data()) % 2;
    strain[back].clear(), force[back].clear();
    for (std::size_t i = 0; i < samples->size(); i += 2) {
      const double distance_cm = number_of((*samples)[i], file, key);
      const double force_g = number_of((*samples)[i + 1], file, key);
      if (!rest_cm) rest_cm = distance_cm, zero_g = force_g;
      strain[back].push_back(100 * (distance_cm - *rest_cm) / length_cm);
      force[back].push_back((force_g - *zero_g) / width_cm);
    }
  }
  const double most = *std::max_element(strain[0].begin(), strain[0].end());
  if (most < 100 * kLeastStretch) throw refuse("the strip was not stretched");
  std::vector<double> at(kCurvePoints);
  for (std::size_t i = 0; i < kCurvePoints; ++i)
    at[i] = most * static_cast<double>(i) / (kCurvePoints - 1);
  std::vector<double> there = resampled(strain[0], force[0], at);
  std::vector<double> back = resampled(strain[1], force[1], at);
  there.front() = back.front() = 0;
  return csv_text({"strain_percent", "loading_force_gf_per_cm", "unloading_force_gf_per_cm"},
                  {at, there, back});
}

}  // namespace

ImportedFabric import_kes(const fs::path& file, const std::string& name) {
  const PropertySheet sheet(file, {{kDensity, {"W"}},
                                   {kLength, {"T", "SMD"}},
                                   {kPlainNumber, {"LT", "LC", "MIU", "MMD"}},
                                   {kWork, {"WT", "WC"}},
                                   {kPercent, {"RT", "EMT", "RC"}},
                                   {kShear, {"G"}},
                                   {kForce, {"2HG", "2HG5"}},
                                   {kBending, {"B", "B45"}},
                                   {kMoment, {"2HB"}}});
  Numbers numbers = numbers_of(sheet, name, "KES-FB result sheet " + file.filename().string());
  numbers.set_bias(sheet.whole("B45"));
  numbers.from[kBias] = sheet.where("B45");
  const bool has_tensile = sheet.has("EMT") || sheet.has("LT") || sheet.has("WT");
  if (has_tensile && !sheet.has("RT"))
    numbers.also_stand_in.emplace_back("tensile hysteresis: RT 60 %");
  using Tensile = std::optional<double> TensileNumbers::*;
  const std::vector<std::tuple<std::string, std::string, Tensile>> tensile = {
      {"EMT", "emt_percent", &TensileNumbers::emt_percent},
      {"LT", "lt", &TensileNumbers::lt},
      {"WT", "wt_gf_cm_per_cm2", &TensileNumbers::wt_gf_cm_per_cm2},
      {"RT", "rt_percent", &TensileNumbers::rt_percent}};
  for (int d = 0; d < 2; ++d) {
    const auto take = [&](const std::string& property, const std::string& key) {
      numbers.from[key_of(key, d)] = sheet.where(property);
      return sheet.along(property, d);
    };
    numbers.bending(d).b_gf_cm2_per_cm = take("B", kB);
    if (sheet.has("2HB")) numbers.bending(d).hb2_gf_cm_per_cm = take("2HB", kHb);
    if (sheet.has("G")) numbers.shear(d).g_gf_per_cm_deg = take("G", kG);
    if (sheet.has("2HG")) numbers.shear(d).hg2_gf_per_cm = take("2HG", kHg);
    if (sheet.has("2HG5")) numbers.shear(d).hg5_gf_per_cm = take("2HG5", kHg5);
    for (const auto& [property, key, member] : tensile)
      if (sheet.has(property)) (numbers.tensile(d).*member) = take(property, "tensile." + key);
    // Reports values missing from a tensile test at the existing row.
    for (const auto& [property, key, member] : tensile)
      for (const auto& other : tensile)
        if (!sheet.has(property) && sheet.has(std::get<0>(other)))
          numbers.from.try_emplace(key_of("tensile." + key, d), sheet.where(std::get<0>(other)));
  }
  ImportedFabric fabric = imported(numbers);
  fabric.unused = sheet.among({"T", "LC", "WC", "RC", "MIU", "MMD", "SMD"});
  return fabric;
}

ImportedFabric import_fast(const fs::path& file, const std::string& name) {
  const PropertySheet sheet(file,
                            {{kDensity, {"W"}},
                             {kLength, {"T2", "T100", "C", "C45", "ST", "T2R", "T100R", "STR"}},
                             {kPercent, {"E5", "E20", "E100", "EB5", "RS", "HE"}},
                             {kBending, {"B"}},
                             {kForce, {"G"}},
                             {kArea, {"F"}}});
  Numbers numbers = numbers_of(sheet, name, "FAST result sheet " + file.filename().string());
  // B = w g C^3 (Peirce 1930); W in g/m2, C in mm.
  const auto rigidity = [&](double c_mm) {
    return numbers.file.areal_density_g_per_m2 * units::g_per_m2 * 9.80665 *
           std::pow(c_mm * units::mm, 3) / units::gf_cm2_per_cm;
  };
  if (const auto c = sheet.whole("C45")) numbers.set_bias(rigidity(*c));
  numbers.from[kBias] = sheet.where("C45");
  const auto eb5 = sheet.whole("EB5");
  if (eb5 && !(*eb5 > 0)) throw bad_input("EB5 is not above 0", sheet.where("EB5"), "check it");
  ImportedFabric curves;
  const UsualBending usual = usual_bending(numbers.file.areal_density_g_per_m2);
  for (int d = 0; d < 2; ++d) {
    const double c_mm = sheet.along("C", d);
    const double b = numbers.bending(d).b_gf_cm2_per_cm = rigidity(c_mm);
    if (b < usual.least_possible || b > usual.most_possible)
      throw bad_input(fmt::format("a bending length of {:g} mm; fabrics of {:g} to {:g} g/m2 have "
                                  "{:.2g} to {:.2g}",
                                  c_mm, usual.from, usual.to, c_mm * std::cbrt(usual.least / b),
                                  c_mm * std::cbrt(usual.most / b)),
                      sheet.where("C"),
                      "is it in cm, or the overhang, which is twice the bending length?");
    numbers.from[key_of(kB, d)] = sheet.where("C");
    if (eb5) {
      numbers.shear(d).g_gf_per_cm_deg = shear_from_bias_extension(*eb5, sheet.where("EB5"));
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
    if (!numbers.file.tensile) numbers.file.tensile.emplace();
    numbers.file.tensile->curve[d] = curve;
    if (d == 0)
      numbers.also_stand_in.push_back(fmt::format(
          "tensile hysteresis: unloading as loading, nothing above {:g} gf/cm", force.back()));
  }
  ImportedFabric fabric = imported(numbers);
  fabric.curves = std::move(curves.curves);
  fabric.unused =
      sheet.among({"T2", "T100", "ST", "T2R", "T100R", "STR", "F", "RS", "HE", "B", "G"});
  return fabric;
}

ImportedFabric import_u3m(const fs::path& file, const std::string& name,
                          const std::string& bend_unit) {
  const Value json = json_value(read_text(file), file.string());
  const Value& custom = member(json, file, "custom");
  const auto* sections = custom.get_if<Value::Table>();
  const Value& fields = sections != nullptr && sections->size() == 1
                            ? sections->front().second
                            : member(custom, file, "browzwear");
  const double factor = factor_of(kBending, bend_unit, {.file = file.string(), .field = "bend"});
  Numbers numbers(name, "U3M physics " + file.filename().string(),
                  number_of(member(fields, file, "mass"), file, "mass"));
  const Value& bend = member(fields, file, "bend");
  numbers.bending(0).b_gf_cm2_per_cm =
      factor * number_of(member(bend, file, "length"), file, "bend.length");
  numbers.bending(1).b_gf_cm2_per_cm =
      factor * number_of(member(bend, file, "width"), file, "bend.width");
  numbers.from = {{kDensityKey, {.file = file.string(), .field = "mass"}},
                  {key_of(kB, 0), {.file = file.string(), .field = "bend.length"}},
                  {key_of(kB, 1), {.file = file.string(), .field = "bend.width"}}};
  std::vector<std::pair<std::string, std::string>> curves;
  const Value* raw = json.find("raw_data");
  for (int d = 0; raw != nullptr && d < 2; ++d) {
    const Value* strips = raw->find(d == 0 ? "L" : "W");
    const Value* stretch = strips == nullptr ? nullptr : strips->find("S2");
    if (stretch == nullptr || stretch->is_null()) continue;
    const std::string key = d == 0 ? "raw_data.L.S2" : "raw_data.W.S2";
    const std::string curve = fmt::format("tensile_{}.csv", kDirections[d]);
    curves.emplace_back(curve, fab_curve(*stretch, file, key));
    numbers.from[curve] = {.file = file.string(), .field = key};
    if (!numbers.file.tensile) numbers.file.tensile.emplace();
    numbers.file.tensile->curve[d] = curve;
  }
  if (curves.size() == 1)
    throw bad_input("the raw data have a stretch along one direction only",
                    numbers.from.at(curves.front().first), "give both, L and W, or neither");
  ImportedFabric fabric = imported(numbers);
  fabric.curves = std::move(curves);
  return fabric;
}

std::vector<std::string> write_imported(
    const fs::path& folder, const ImportedFabric& fabric,
    const std::function<void(const fs::path&, const std::vector<std::string>&)>& record) {
  auto files = fabric.curves;
  files.emplace_back("fabric.toml", fabric.toml);
  std::vector<std::string> warnings;
  try {
    write_new_folder(folder, files, [&](const fs::path& written) {
      const Fabric read = read_fabric(written / "fabric.toml");
      require_textile(read);
      warnings = read.warnings;
      if (record) record(written, warnings);
    });
  } catch (const Error& error) {
    throw Error(error.kind(), error.what_failed(), in_source(fabric, error.where()),
                error.what_to_do());
  }
  return warnings;
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
  Numbers numbers(fabric.id + " " + fabric.name, fabric.source, *fabric.areal_density_g_per_m2);
  const double warp = *fabric.b_warp_gf_cm2_per_cm;
  numbers.bending(0) = {warp, fabric.hb2_gf_cm_per_cm, {}};
  numbers.bending(1) = {fabric.b_weft_gf_cm2_per_cm.value_or(warp), fabric.hb2_gf_cm_per_cm, {}};
  numbers.set_bias(fabric.b_bias_gf_cm2_per_cm);
  if (!fabric.b_weft_gf_cm2_per_cm)
    numbers.also_stand_in.emplace_back("bending: one B for warp and weft");
  return imported(numbers);
}

}  // namespace drape::simulate
