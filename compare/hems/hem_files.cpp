// SPDX-License-Identifier: Apache-2.0
#include "compare/hems/hem_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cctype>

#include "compare/records/provenance.hpp"
#include "core/drape_mesh.hpp"
#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"
#include "core/matching.hpp"
#include "core/parallel.hpp"
#include "core/program/words.hpp"
#include "core/simulation_files.hpp"

namespace drape::compare {
namespace {

using units::mm;

/// Tolerance of lengths for strain and scale: the widest of 304 published hems is 2.3 % wider than
/// its specimen.
constexpr double kLengthTolerance = 0.03;
/// Tolerance of the diameter by a mesh's surface: strain, and chords of coarse meshes.
constexpr double kOfDiameter = 0.05;

/// Throws if an area is not that of the round specimen that was asked for, by a part of its
/// diameter.
void require_specimen(double area_m2, const DrapemeterGeometry& asked, double tolerance,
                      const char* what, const Where& where, const std::string& remedy) {
  const double own_m = std::sqrt(4 / std::numbers::pi * area_m2);
  if (std::abs(own_m - asked.specimen_m) <= tolerance * asked.specimen_m) return;
  throw bad_input(fmt::format("the {} that of a round specimen of {:.1f} mm, not {:g} mm", what,
                              own_m / mm, asked.specimen_m / mm),
                  where, remedy);
}

/// Throws unless the disc is inside the shadow and the shadow inside the flat specimen; otherwise a
/// length is in another unit or from another test.
void require_possible(const HemRecord& record, double scale_u, const DrapemeterGeometry& geometry) {
  const double more = 1 + kLengthTolerance + 2 * scale_u;
  const Hem& hem = record.hem;
  const std::size_t half = hem.radius_m.size() / 2;
  double width_m = 0;
  for (std::size_t i = 0; i < half; ++i)
    width_m = std::max(width_m, hem.radius_m[i] + hem.radius_m[i + half]);
  std::string wrong;
  if (record.specimen_area_m2 <= circle_m2(geometry.disc_m))
    wrong =
        fmt::format("of a flat specimen smaller than the disc of {:g} mm", geometry.disc_m / mm);
  else if (hem.area_m2 * more * more < circle_m2(geometry.disc_m))
    wrong = fmt::format("smaller than the disc of {:g} mm", geometry.disc_m / mm);
  else if (hem.area_m2 > more * more * record.specimen_area_m2)
    wrong = hem.flat_area_m2
                ? std::string("larger than the flat specimen")
                : fmt::format("larger than the specimen of {:g} mm", geometry.specimen_m / mm);
  else if (!hem.flat_area_m2 && width_m > more * geometry.specimen_m)
    wrong =
        fmt::format("{:.1f} mm wide, the specimen {:g} mm", width_m / mm, geometry.specimen_m / mm);
  if (wrong.empty()) return;
  throw bad_input(fmt::format("the drape is {} (area {:.4g} mm2)", wrong, hem.area_m2 / (mm * mm)),
                  {.file = record.file},
                  "give lengths in mm, and the test's own --disc-mm and --specimen-mm");
}

/// Warns if the shadow does not contain all of the disc, on which the cloth lies.
void warn_of_disc(HemRecord& record, double scale_u, const DrapemeterGeometry& geometry) {
  const double less = 1 - kLengthTolerance - 2 * scale_u;
  const auto least = std::ranges::min_element(record.hem.radius_m);
  if (least == record.hem.radius_m.end() || *least >= less * geometry.disc_m / 2) return;
  record.warnings.push_back(
      fmt::format("the hem comes to {:.1f} mm from its centre, inside the disc of {:g} mm: is the "
                  "disc another, or a length in another unit?",
                  *least / mm, geometry.disc_m / mm));
}

/// Computes the numbers and nodes of `record.hem`. Throws Error(bad_input) for a hem impossible for
/// the geometry, allowing for the scale's `errors` and what U of its area already contains.
void evaluate(HemRecord& record, HemErrors errors, const HemReadOptions& options,
              double area_u_m2 = 0) {
  record.specimen_area_m2 =
      record.hem.flat_area_m2.value_or(circle_m2(options.geometry.specimen_m));
  if (record.own_specimen && options.specimen_stated)
    require_specimen(record.specimen_area_m2, options.geometry, kLengthTolerance,
                     "sheet's flat area is", {.file = record.file},
                     "leave --specimen-mm out: a sheet's specimen is its own flat area");
  if (options.scale_u) errors.scale_u = std::hypot(errors.scale_u.value_or(0), *options.scale_u);
  // U is 2 standard uncertainties, and the relative error of an area is twice that of its scale.
  const double within_u = area_u_m2 / (4 * record.hem.area_m2);
  const double scale_u = std::hypot(errors.scale_u.value_or(0), within_u);
  require_possible(record, scale_u, options.geometry);
  warn_of_disc(record, scale_u, options.geometry);
  record.numbers = numbers_with_u(record.hem, errors, options.geometry);
  record.nodes = nodes_of(record.hem);
}

/// Throws Error(bad_input), naming the options that fit, if disc or specimen differ from those of
/// the drape: the resulting coefficient would look like any other. Absent values are unknown.
void require_geometry(const std::optional<double>& disc_m, const std::optional<double>& specimen_m,
                      const DrapemeterGeometry& asked, const Where& where) {
  const double disc = disc_m.value_or(asked.disc_m);
  const double specimen = specimen_m.value_or(asked.specimen_m);
  const auto same = [](double a_m, double b_m) { return std::abs(a_m - b_m) < 1e-3 * mm; };
  if (same(disc, asked.disc_m) && same(specimen, asked.specimen_m)) return;
  throw bad_input(
      fmt::format("this specimen of {:g} mm hangs over a disc of {:g} mm, not {:g} mm over {:g} mm",
                  specimen / mm, disc / mm, asked.specimen_m / mm, asked.disc_m / mm),
      where, fmt::format("give --disc-mm {:g} --specimen-mm {:g}", disc / mm, specimen / mm));
}

namespace fs = std::filesystem;

const std::regex kRadius("r[0-9]{3}");
/// Names of a hem, by which files and tables call them.
constexpr std::pair<const char*, std::string HemRecord::*> kNames[] = {
    {"fabric", &HemRecord::fabric},
    {"sample", &HemRecord::sample},
    {"face", &HemRecord::face},
    {"repeat", &HemRecord::repeat}};
/// Columns that identify a hem, its test and its verdict.
const std::vector<std::string> kAbout = {"fabric", "sample",  "face",        "repeat",
                                         "file",   "disc_mm", "specimen_mm", "specimen_area_mm2",
                                         "no_go"};

/// Throws for an unknown column, which may be the one that distinguishes two fabrics.
void require_known_columns(const CsvText& table, const HemReadOptions& options) {
  std::vector<std::string> known = kAbout;
  const Hem any = hem_of_radii(std::vector<double>(36, options.geometry.specimen_m / 2));
  for (const HemNumber& number : numbers_of(any, options.geometry))
    for (const char* before : {"", "u_"}) known.push_back(before + number.name);
  for (const std::string& name : table.names) {
    if (has_form(name, kRadius) || std::find(known.begin(), known.end(), name) != known.end())
      continue;
    throw bad_input(fmt::format("a table of hems has no column `{}`{}", name,
                                did_you_mean(in_small_letters(name), known)),
                    {.file = table.file.string(), .line = table.head_line, .field = name},
                    fmt::format("remove it, or name it as hems.csv does: {}, a number or r000 ..",
                                fmt::join(kAbout, ", ")));
  }
}

/// The columns r000 .. of a table, sorted by angle.
std::vector<std::string> columns_of_radii(const CsvText& table) {
  std::vector<std::string> angles;
  for (const std::string& name : table.names)
    if (has_form(name, kRadius)) angles.push_back(name);
  std::ranges::sort(angles);
  const std::string asked = "give r000, r005 .. r355 in mm, or other equal steps all round";
  if (angles.size() < 36)
    throw bad_input(fmt::format("{} columns of radii", angles.size()),
                    {.file = table.file.string()}, asked);
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double expected = 360.0 * static_cast<double>(i) / static_cast<double>(angles.size());
    if (std::abs(std::stoi(angles[i].substr(1)) - expected) > 0.5)  // columns: whole degrees
      throw bad_input(
          fmt::format("the {} columns of radii do not go round in equal steps: at {:.1f} "
                      "degrees stands {}",
                      angles.size(), expected, angles[i]),
          {.file = table.file.string(), .field = angles[i]}, asked);
  }
  return angles;
}

/// One row of the table.
struct Row {
  const CsvText& table;
  std::size_t row;

  [[nodiscard]] Where where(const std::string& field = {}) const {
    return {.file = table.file.string(), .line = table.lines[row], .field = field};
  }
  [[nodiscard]] std::string text(const std::string& name) const {
    return table.has(name) ? table.rows[row][table.column(name)] : std::string();
  }
  [[nodiscard]] std::optional<double> number(const std::string& name) const {
    return table.has(name) ? table.number(row, name) : std::nullopt;
  }
  /// Positive value in units of `unit`; nullopt if the cell or column is absent.
  [[nodiscard]] std::optional<double> positive(const std::string& name, double unit) const {
    const auto value = number(name);
    if (!value) return std::nullopt;
    if (*value <= 0)
      throw bad_input(fmt::format("{:g} is not above 0", *value), where(name), "correct it");
    return *value * unit;
  }
  /// Expanded uncertainty of a column; nullopt if not stated.
  [[nodiscard]] std::optional<double> u(const std::string& of) const {
    const auto value = number("u_" + of);
    if (value && *value < 0)
      throw bad_input("an uncertainty is below 0", where("u_" + of), "correct it");
    return value;
  }
};

/// Radii are outermost: if folds overhang, the covered area is smaller than they suggest.
void take_areas(const Row& row, Hem& hem) {
  hem.flat_area_m2 = row.positive("specimen_area_mm2", mm * mm);
  const auto area_m2 = row.positive("area_mm2", mm * mm);
  if (!area_m2) return;
  if (std::abs(std::sqrt(*area_m2 / hem.area_m2) - 1) > kLengthTolerance)
    throw bad_input(fmt::format("the area is {:.4g} mm2, that of the radii {:.4g} mm2",
                                *area_m2 / (mm * mm), hem.area_m2 / (mm * mm)),
                    row.where("area_mm2"), "correct one of them, or remove the column");
  hem.area_m2 = *area_m2;
}

std::string why_no_go(const HemRecord& hem) {
  if (hem.go) return {};
  return hem.warnings.empty() ? "NO-GO" : fmt::format("{}", fmt::join(hem.warnings, "; "));
}

/// A cell on one line.
std::string quoted(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return csv_cell(text);
}

/// Reads one hem per row from a table of radii or a hems.csv, which keeps verdicts, geometry, areas
/// and U. Throws Error(bad_input) naming file, line and column, also for an unknown column.
std::vector<HemRecord> read_hems_csv(const fs::path& file, const HemReadOptions& options) {
  const CsvText table = read_csv_text(file);
  require_known_columns(table, options);
  const std::vector<std::string> angles = columns_of_radii(table);
  if (table.rows.empty())
    throw bad_input("the table has no row", {.file = file.string()}, "give a row per hem");
  std::vector<HemRecord> records;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const Row row{table, i};
    HemRecord record;
    record.file = fmt::format("{}:{}", file.string(), table.lines[i]);
    for (const auto& [name, member] : kNames) record.*member = row.text(name);
    require_geometry(row.positive("disc_mm", mm), row.positive("specimen_mm", mm), options.geometry,
                     row.where());
    std::vector<double> radius_m;
    for (const std::string& name : angles) {
      const std::optional<double> r = row.positive(name, mm);
      if (!r)
        throw bad_input("a hem's radius is missing", row.where(name), "give every radius in mm");
      radius_m.push_back(*r);
    }
    record.hem = hem_of_radii(radius_m);
    take_areas(row, record.hem);
    record.own_specimen = record.hem.flat_area_m2 && !row.number("specimen_mm");
    evaluate(record, {}, options, row.u("area_mm2").value_or(0) * mm * mm);
    // U of the measurement adds to any uncertainty given on the command line.
    for (HemNumber& number : record.numbers)
      if (const auto u = row.u(number.name)) number.u = std::hypot(*u, number.u.value_or(0));
    if (const std::string reason = row.text("no_go"); !reason.empty()) {
      record.go = false;
      record.warnings.push_back(reason);
    }
    records.push_back(std::move(record));
  }
  return records;
}

const std::set<std::string> kPictures = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm"};
const std::set<std::string> kMeshes = {".ply", ".obj", ".json"};

/// Finds the names in a path by a pattern such as "{fabric}_{repeat}".
class NamePattern {
 public:
  explicit NamePattern(const std::string& pattern) {
    if (pattern.size() > longest_matched)
      throw usage_error("--names is too long", "give at most 4096 bytes");
    static const std::regex part("\\{([^}]*)\\}?|[^{]");
    std::string expression;
    for (std::sregex_iterator at(pattern.begin(), pattern.end(), part), end; at != end; ++at) {
      const std::string text = at->str();
      if (text == "*") {
        expression += ".*?";
      } else if (text.front() != '{') {
        expression += (std::isalnum(static_cast<unsigned char>(text[0])) == 0 ? "\\" : "") + text;
      } else {
        const auto* name =
            std::ranges::find(kNames, (*at)[1].str(), [](const auto& one) { return one.first; });
        if (name == std::end(kNames) || text.back() != '}')
          throw usage_error(fmt::format("`{}` is no name in a pattern", (*at)[1].str()),
                            "use {fabric}, {sample}, {face} and {repeat}");
        names_.push_back(name->second);
        expression += "(.+?)";
      }
    }
    expression_ = std::regex(expression);
  }

  void apply(const std::string& path, HemRecord& record) const {
    std::smatch found;
    if (!has_form(path, found, expression_))
      throw bad_input("the file's name does not fit --names", {.file = path}, "change one of them");
    for (std::size_t i = 0; i < names_.size(); ++i) record.*names_[i] = found[i + 1];
  }

 private:
  std::vector<std::string HemRecord::*> names_;
  std::regex expression_;
};

struct Input {
  fs::path file;
  std::string name;  ///< name used for the pattern
};

std::vector<Input> files_of(const fs::path& input) {
  if (!fs::is_directory(input)) return {{input, input.stem().string()}};
  std::vector<Input> found;
  for (const auto& entry : fs::recursive_directory_iterator(input)) {
    const std::string ending = in_small_letters(entry.path().extension());
    const bool twin = ending == ".ply" || ending == ".obj" || kPictures.contains(ending);
    if (!entry.is_regular_file() || !twin) continue;
    fs::path name = fs::relative(entry.path(), input);
    name.replace_extension();
    found.push_back({entry.path(), name.generic_string()});
  }
  std::ranges::sort(found, {}, &Input::file);
  if (found.empty())
    throw bad_input("the folder holds no picture and no mesh", {.file = input.string()},
                    "give a folder of PNG, JPEG, TIFF, PLY or OBJ files");
  return found;
}

/// Smallest possible distance of a camera for a picture of this width, if a lens covers at most 90
/// degrees along its longer side.
double least_distance_m(const Silhouette& silhouette, const PictureScale& scale) {
  const Eigen::Vector2d corner = scale.metres_of({0, 0});
  const double across_m = (scale.metres_of({silhouette.width_px, 0}) - corner).norm();
  const double down_m = (scale.metres_of({0, -silhouette.height_px}) - corner).norm();
  return std::max(across_m, down_m) / 2;
}

/// The hem if lengths grow by `per_m` (relative) for each metre along `per_m`.
Hem in_perspective(Outline outline_m, const Eigen::Vector2d& centre_m,
                   const Eigen::Vector2d& per_m) {
  for (Eigen::Vector2d& p : outline_m) {
    const Eigen::Vector2d from_centre = p - centre_m;
    p = centre_m + (1 + per_m.dot(from_centre)) * from_centre;
  }
  return hem_of_outline(outline_m);
}

constexpr double kThreadWidth_m = 2e-3;   ///< folds of cloth are wider
constexpr double kThreadLength_m = 5e-3;  ///< shorter threads do not matter
constexpr double kThreadReach_m = 0.3;    ///< length of outline, out and back

/// Refuses an outline that runs out and back along itself: a loose thread or a crease of the table
/// instead of the hem.
void refuse_threads(const Outline& outline_m, const std::string& file) {
  const std::size_t count = outline_m.size();
  const auto at = [&](std::size_t i) { return outline_m[i % count]; };
  double longest_m = 0, width_m = 0;
  Eigen::Vector2d tip = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    double along_m = 0, twice_area = 0;
    for (std::size_t j = i; j < i + count && along_m < kThreadReach_m; ++j) {
      const Eigen::Vector2d a = at(j) - at(i), b = at(j + 1) - at(i);
      along_m += (b - a).norm();
      twice_area += cross(a, b);
      const double length_m = along_m / 2;
      if (b.norm() > kThreadWidth_m || length_m < std::max(kThreadLength_m, longest_m)) continue;
      const double mean_width_m = twice_area / 2 / length_m;
      if (mean_width_m <= 0 || mean_width_m > kThreadWidth_m) continue;
      longest_m = length_m, width_m = mean_width_m, tip = at(i + (j - i) / 2);
    }
  }
  if (longest_m == 0) return;
  const Eigen::Vector2d from_centre = tip - hem_of_outline(outline_m).centre_m;
  throw bad_input(
      fmt::format("a thread of {:.0f} mm, {:.1f} mm wide, stands out of the hem at {:.0f} degrees",
                  longest_m / units::mm, width_m / units::mm,
                  std::atan2(from_centre.y(), from_centre.x()) / units::deg),
      {.file = file}, "cut it off, or paint it out of the picture");
}

void read_picture(const fs::path& file, const HemReadOptions& options, HemRecord& record) {
  if (!options.scale)
    throw bad_input("a picture has no scale of its own", {.file = file.string()},
                    "give --mm-per-px, --ruler, --disc-picture or --disc-hole");
  const Silhouette silhouette = read_silhouette(file);
  const PictureScale scale = options.scale(silhouette, file);
  const auto metres_of = [&](const Outline& outline_px) {
    Outline outline_m;
    for (const auto& p : outline_px) outline_m.push_back(scale.metres_of(p));
    return outline_m;
  };
  const Outline half = metres_of(silhouette.half);
  refuse_threads(half, file.string());
  record.hem = hem_of_outline(half);
  record.basis = scale.basis;
  record.warnings = silhouette.warnings;
  HemErrors errors{{{hem_of_outline(metres_of(silhouette.quarter)),
                     hem_of_outline(metres_of(silhouette.three_quarters))}},
                   scale.relative_u};
  if (!scale.tilt.isZero()) {
    const Eigen::Vector2d per_m = scale.tilt / least_distance_m(silhouette, scale);
    errors.tilts = {in_perspective(half, record.hem.centre_m, per_m),
                    in_perspective(half, record.hem.centre_m, -per_m)};
  }
  evaluate(record, errors, options);
}

constexpr int kSweeps = 500;  // sufficient for a lattice of 61 marks per side

/// Fills missing marks inside a complete hem with the mean of their neighbours, since a hole would
/// count neither as cloth nor as shadow.
int span_gaps(Sheet& sheet) {
  using Place = Eigen::Matrix<double, 5, 1>;  // in space, then on the material
  std::map<MarkId, Place> places;
  Place middle = Place::Zero();
  for (const SheetMark& mark : sheet.marks) {
    Place& place = places[mark.mark];
    place << mark.point_in_world, mark.material_m;
    middle += place / static_cast<double>(sheet.marks.size());
  }
  std::vector<MarkId> missing;
  for (int row = 0; row < sheet.rows; ++row)
    for (int col = 0; col < sheet.cols; ++col)
      if (places.try_emplace({row, col}, middle).second) missing.push_back({row, col});
  for (int sweep = 0; sweep < kSweeps && !missing.empty(); ++sweep)
    for (const MarkId id : missing)
      places[id] = (places[id + MarkId{-1, 0}] + places[id + MarkId{1, 0}] +
                    places[id + MarkId{0, -1}] + places[id + MarkId{0, 1}]) /
                   4;
  for (const MarkId id : missing)
    sheet.marks.push_back({id, places[id].tail<2>(), places[id].head<3>(), {}, {}, {}});
  std::ranges::sort(sheet.marks, {}, &SheetMark::mark);
  return static_cast<int>(missing.size());
}

/// Finds the entry of a mesh in the list of virtual drapes beside it.
const CusickStart& start_in(const CusickFile& list, const fs::path& file, const std::string& name) {
  const auto start = std::ranges::find(list.starts, name, &CusickStart::file);
  if (start != list.starts.end()) return *start;
  throw bad_input("the list beside the mesh does not name it",
                  {.file = file.string(), .field = name},
                  "remove a drape of an earlier run; keep other meshes in a folder of their own");
}

/// Reads a sheet with its sheet.json (gaps inside the hem are filled from their neighbours), or any
/// PLY or OBJ in mm with z up, with status and specimen from a cusick.json beside it. Throws
/// Error(bad_input), also for a mesh that the cusick.json does not list, and for a sheet whose
/// outermost marks were not all measured.
void read_mesh(const Input& input, const HemReadOptions& options, bool is_named,
               HemRecord& record) {
  const fs::path json = fs::path(input.file).replace_extension(".json");
  const fs::path list_file = input.file.parent_path() / "cusick.json";
  const Where where{.file = record.file};
  ShadowMesh mesh;
  std::string status;  // of a simulation: "at rest" or why not
  std::optional<std::string> no_go;
  std::optional<double> disc_m, specimen_m;
  if (fs::exists(json)) {
    require_as_recorded(json);
    Sheet sheet = read_sheet(json);
    if (const std::string reason = why_no_hem(sheet); !reason.empty())
      throw bad_input(
          reason, {},
          "measure it again so that every outermost mark is seen, or give a picture of the hem");
    if (const int spanned = span_gaps(sheet); spanned > 0)
      record.warnings.push_back(
          fmt::format("{} marks inside the hem are missing, their neighbours span them", spanned));
    static_cast<TriangleMesh&>(mesh) = mesh_of(sheet);
    for (const SheetMark& mark : sheet.marks) mesh.material_m.push_back(mark.material_m);
    if (!options.disc_stated)
      throw bad_input(
          "a sheet does not say over which disc it hangs", where,
          "give the disc's --disc-mm; drapes over other objects have no drape coefficient");
    no_go = sheet.no_go;
    record.own_specimen = true;
    if (sheet.is_measured())
      record.kind = HemKind::measured;
    else
      status = std::get<SimulatedSource>(sheet.source).status;
  } else {
    const MeshFile read = read_mesh_file(input.file);
    for (const auto& point : read.points) mesh.points.emplace_back(point * mm);
    for (const auto& t : read.triangles)
      mesh.triangles.push_back({t[0].point, t[1].point, t[2].point});
    if (fs::exists(list_file)) {
      require_as_recorded(list_file);
      const auto list = read_record<CusickFile>(list_file);
      const CusickStart& start = start_in(list, list_file, input.file.filename().string());
      status = !start.refusals.empty() ? "refused by the checker: " + start.refusals.back()
               : start.at_rest         ? "at rest"
                                       : "relaxation ended before";
      mesh.flat_area_m2 = start.specimen_area_m2;
      disc_m = list.disc_m;
      specimen_m = list.specimen_m;
      if (!is_named && !list.fabric.empty()) {
        record.fabric = list.fabric;
        record.repeat = input.name;
      }
    }
  }
  require_geometry(disc_m, specimen_m, options.geometry, where);
  if (mesh.material_m.empty() && !mesh.flat_area_m2 && !specimen_m)
    require_specimen(area_m2(mesh), options.geometry, kOfDiameter, "mesh's surface is", where,
                     "give the specimen's --specimen-mm; meshes are in mm");
  record.hem = shadow_of(mesh);
  if (!status.empty()) record.kind = HemKind::simulated;
  const bool moves = !status.empty() && status != "at rest";
  record.go = !no_go && !moves;
  if (moves) record.warnings.push_back("the simulation is not at rest: " + status);
  if (no_go) record.warnings.push_back("what made or placed it is NO-GO: " + *no_go);
  evaluate(record, {}, options);
}

std::vector<HemRecord> read_input(const Input& input, const HemReadOptions& options,
                                  const NamePattern* names) {
  const std::string ending = in_small_letters(input.file.extension());
  if (ending == ".csv") return read_hems_csv(input.file, options);
  HemRecord record;
  record.file = input.file.string();
  record.fabric = input.name;
  if (names != nullptr) names->apply(input.name, record);
  kMeshes.contains(ending) ? read_mesh(input, options, names != nullptr, record)
                           : read_picture(input.file, options, record);
  return {std::move(record)};
}

/// Makes names unique by their folders, if only names distinguish fabrics.
void tell_apart(std::vector<Input>& files) {
  std::map<std::string, std::set<fs::path>> named;
  for (const Input& file : files) named[file.name].insert(file.file);
  for (Input& file : files)
    if (named[file.name].size() > 1) file.name = fs::path(file.file).replace_extension().string();
}

/// Moves the hems that have a reason to the refused ones, with their file.
template <class Why>
void refuse_if(HemSet& set, const Why& why) {
  std::erase_if(set.hems, [&](const HemRecord& record) {
    const std::string reason = why(record);
    if (!reason.empty()) set.refused.push_back(record.file + ": " + reason);
    return !reason.empty();
  });
}

/// Refuses copies: of hems that are equal to the last bit only the first is kept.
void refuse_copies(HemSet& set) {
  std::map<std::vector<double>, std::string> seen;
  refuse_if(set, [&](const HemRecord& record) {
    const auto [first, is_new] = seen.emplace(record.hem.radius_m, record.file);
    return is_new
               ? std::string()
               : fmt::format("its hem is that of {}, a copy; give each drape once", first->second);
  });
}

}  // namespace

std::string hems_csv(const DrapemeterGeometry& geometry, const std::vector<HemRecord>& hems) {
  std::string text = fmt::format("{}", fmt::join(kAbout, ","));
  if (!hems.empty())
    for (const HemNumber& number : hems.front().numbers)
      text += fmt::format(",{0},u_{0}", number.name);
  for (int i = 0; i < kHemRays; ++i) text += fmt::format(",r{:03d}", 360 / kHemRays * i);
  text += '\n';
  for (const HemRecord& hem : hems) {
    for (const auto& [name, member] : kNames) text += quoted(hem.*member) + ',';
    text += quoted(hem.file) + ',';
    const auto& flat_m2 = hem.hem.flat_area_m2;
    text += fmt::format("{:.10g},{},{},{}", geometry.disc_m / mm,
                        hem.own_specimen ? "" : fmt::format("{:.10g}", geometry.specimen_m / mm),
                        flat_m2 ? fmt::format("{:.6g}", *flat_m2 / (mm * mm)) : "",
                        quoted(why_no_go(hem)));
    for (const HemNumber& number : hem.numbers)
      text +=
          fmt::format(",{:.6g},{}", number.value, number.u ? fmt::format("{:.3g}", *number.u) : "");
    for (const double radius : thinned(hem.hem.radius_m))
      text += fmt::format(",{:.4f}", radius / mm);
    text += '\n';
  }
  return text;
}

HemSet read_hems(const std::vector<fs::path>& inputs, const HemReadOptions& options) {
  options.geometry.check();
  std::vector<Input> files;
  for (const fs::path& input : inputs)
    for (const Input& file : files_of(input)) files.push_back(file);
  if (files.empty()) throw usage_error("no input is named", "give pictures, a folder or sheets");
  std::optional<NamePattern> names;
  if (!options.names.empty()) names.emplace(options.names);
  if (!names) tell_apart(files);
  std::vector<std::vector<HemRecord>> read(files.size());
  std::vector<std::string> refused(files.size());
  parallel_for(files.size(), options.threads, [&](std::size_t i) {
    try {
      read[i] = read_input(files[i], options, names ? &*names : nullptr);
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::bad_input) throw;
      const std::string text = error.what();
      const std::string file = files[i].file.string();
      refused[i] = text.find(file) == std::string::npos ? file + ": " + text : text;
    }
  });
  HemSet set;
  for (std::size_t i = 0; i < files.size(); ++i) {
    set.inputs.push_back(files[i].file);
    if (!refused[i].empty()) set.refused.push_back(refused[i]);
    for (HemRecord& record : read[i]) set.hems.push_back(std::move(record));
  }
  refuse_copies(set);
  return set;
}

void refuse_copies_of(const HemSet& real, HemSet& virtual_hems) {
  // Compares the radii and orders kept in hems.csv, so that copies read from it are found too.
  const auto as_stored = [](const HemRecord& record) {
    return hem_of_radii(thinned(record.hem.radius_m));
  };
  std::vector<Hem> known;
  for (const HemRecord& record : real.hems) known.push_back(as_stored(record));
  refuse_if(virtual_hems, [&](const HemRecord& record) {
    const Hem own = as_stored(record);
    const auto same = std::ranges::find_if(
        known, [&](const Hem& other) { return hem_distance_m(other, own) < kCopies_m; });
    return same == known.end() ? std::string()
                               : fmt::format("its hem is that of {}, a copy; name virtual drapes",
                                             real.hems[same - known.begin()].file);
  });
}

void refuse_other_kinds(HemSet& real, HemSet& virtual_hems) {
  const auto refuse = [](HemSet& set, HemKind kind, const char* why) {
    refuse_if(set, [&](const HemRecord& record) { return record.kind == kind ? why : ""; });
  };
  refuse(real, HemKind::simulated,
         "a simulation is no repeat of a real drape; give it after a --compare of its own");
  refuse(virtual_hems, HemKind::measured,
         "a measured sheet is no virtual drape; give it without --compare");
}

std::vector<FabricVariance> variances_of(const std::vector<HemRecord>& hems) {
  std::map<std::string, std::pair<std::vector<RepeatKey>, std::vector<double>>> fabrics;
  for (const HemRecord& hem : hems) {
    if (hem.numbers.empty()) continue;  // for walks that only document the format
    fabrics[hem.fabric].first.push_back(hem.key());
    fabrics[hem.fabric].second.push_back(hem.drape_coefficient());
  }
  std::vector<FabricVariance> variances;
  for (const auto& [fabric, values] : fabrics)
    variances.push_back({fabric, variance_components(values.first, values.second)});
  return variances;
}

std::optional<EnsembleBand> band_of(const std::vector<const HemRecord*>& hems) {
  std::map<std::string, std::vector<double>> samples;
  EnsembleBand band;
  for (const HemRecord* hem : hems) {
    if (!hem->go) continue;
    samples[hem->sample].push_back(hem->drape_coefficient());
    ++band.drapes;
  }
  band.samples = static_cast<int>(samples.size());
  std::vector<double> values;
  if (band.samples == 1) values = samples.begin()->second;
  for (const auto& [name, own] : samples)
    if (band.samples > 1) values.push_back(mean_of(own));
  if (values.size() < 2) return std::nullopt;
  const auto n = static_cast<double>(values.size());
  band.mean = mean_of(values);
  const double reach =
      student_quantile(0.975, n - 1) * std::sqrt(squares_about_mean(values) / (n - 1));
  band.mean_u = reach / std::sqrt(n);
  if (static_cast<int>(values.size()) == band.drapes)
    band.next = {band.mean - reach * std::sqrt(1 + 1 / n),
                 band.mean + reach * std::sqrt(1 + 1 / n)};
  return band;
}

std::vector<HemMatch> match_hems(const std::vector<HemRecord>& real,
                                 const std::vector<HemRecord>& virtual_hems,
                                 const MatchOptions& options) {
  std::map<std::pair<std::string, std::string>, std::vector<const HemRecord*>> groups;
  for (const HemRecord& hem : real) groups[{hem.fabric, hem.face}].push_back(&hem);
  std::vector<HemMatch> matches;
  for (const auto& [name, repeats] : groups) {
    std::vector<double> coefficients;
    Distances distances;
    const auto distances_from = [&repeats = repeats](const HemRecord& hem) {
      std::vector<double> row;
      for (const HemRecord* one : repeats)
        row.push_back(one == &hem ? 0 : hem_distance_m(one->hem, hem.hem));
      return row;
    };
    for (const HemRecord* one : repeats) {
      coefficients.push_back(one->drape_coefficient());
      distances.real_to_real.push_back(distances_from(*one));
    }
    for (const HemRecord& candidate : virtual_hems) {
      distances.virtual_to_real = distances_from(candidate);
      HemMatch match{
          name.first,
          name.second,
          candidate.file,
          static_cast<int>(repeats.size()),
          judge_value(coefficients, candidate.drape_coefficient(), options.priors.drape_coefficient,
                      options.significance),
          judge_distance(distances, options.priors.hem_score, kCopies_m, options.significance)};
      match.p = joint_p({match.drape_coefficient, match.hem});
      const auto detectable = match.drape_coefficient.detectable;
      const double width = std::sqrt(repeats.front()->specimen_area_m2);
      if (!candidate.go)
        match.reason = candidate.warnings.back();
      else if (std::abs(std::sqrt(candidate.specimen_area_m2) - width) > kLengthTolerance * width)
        match.reason =
            fmt::format("its specimen has another flat area, {:.0f} and not {:.0f} mm2",
                        candidate.specimen_area_m2 / (mm * mm), width * width / (mm * mm));
      else if (!match.p)
        match.reason = "one drape and no prior: nothing is known of its repeats";
      else if (*match.p < options.significance)
        match.verdict = Match::outside;
      else if (!detectable || *detectable > options.worth_finding_percent)
        match.reason = fmt::format(
            "the repeats scatter so much that only {:.1f} points are found in 90 of 100 cases",
            detectable.value_or(100));
      if (!match.reason.empty()) match.verdict = Match::undecided;
      matches.push_back(std::move(match));
    }
  }
  return matches;
}

void fields(Fields& f, VarianceComponents::FaceMean& one) {
  f({"face", "side of the cloth that faces up"}, one.face);
  f({"mean_percent", "mean drape coefficient"}, one.mean);
}

void fields(Fields& f, HemNumber& one) {
  f({"value", "value in the unit at the end of its name"}, one.value);
  f({"u", "expanded uncertainty, k = 2; null if not known"}, one.u);
}

void fields(Fields& f, FabricVariance& one) {
  f({"fabric", "name"}, one.fabric);
  f({"drapes", "number of hems"}, one.found.drapes);
  f({"faces", "means of the faces"}, one.found.face_means);
  f({"samples", "samples"}, one.found.samples);
  f({"repeat_sd_percent", "standard deviation of repeats"}, one.found.repeat_sd);
  f({"sample_sd_percent", "standard deviation of samples"}, one.found.sample_sd);
}

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
  std::vector<std::pair<std::string, HemNumber>> numbers;
  for (const HemNumber& number : record.numbers) numbers.emplace_back(number.name, number);
  f({"numbers", "drapemeter values"}, numbers);
  f({"nodes", "folds of the hem"}, record.nodes);
  std::vector<double> radius_m = thinned(record.hem.radius_m);
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
  std::vector<FabricVariance> variance = variances_of(file.hems);
  f({"variance", "scatter of each fabric"}, variance);
  f({"significance", "probability that a real repeat counts as outside"}, file.significance);
  f({"matches", "comparison of virtual hems with repeats"}, file.matches);
}

}  // namespace drape::compare
