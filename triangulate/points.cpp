// SPDX-License-Identifier: Apache-2.0
#include "triangulate/points.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <pugixml.hpp>
#include <ranges>
#include <set>
#include <sstream>

#include "core/files/files.hpp"
#include "core/files/number_range.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/scene.hpp"

namespace drape::triangulate {

namespace fs = std::filesystem;
using Eigen::Vector2d, Eigen::Vector3d;
using units::mm;

namespace {

constexpr std::size_t kMostPoints = 5'000'000;
constexpr std::size_t kMostBytes = std::size_t{1} << 30;  ///< limit of one uncompressed array

/// A table with named columns of numbers; a number that is not finite marks a failed point.
using Table = std::map<std::string, std::vector<double>>;

/// Decodes the first `wanted` bytes of base64; sets the number of characters `used`.
std::string from_base64(std::string_view text, std::size_t wanted, std::size_t& used) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  used = std::min(text.size() / 4, (wanted + 2) / 3) * 4;
  std::string bytes;
  std::uint32_t group = 0;
  for (std::size_t i = 0; i < used; ++i) {
    const std::size_t digit = kDigits.find(text[i]);
    group = group << 6 | static_cast<std::uint32_t>(digit == std::string_view::npos ? 0 : digit);
    if (i % 4 < 3) continue;
    for (const int shift : {16, 8, 0}) bytes += static_cast<char>(group >> shift & 0xff);
  }
  return bytes.substr(0, wanted);
}

class Vtu {
 public:
  explicit Vtu(const fs::path& file) : file_(file), text_(read_text(file)) {
    // Raw bytes are not valid XML: cuts off the data after the underscore before parsing.
    const std::size_t open = text_.find("<AppendedData");
    std::string head = text_.substr(0, open);
    if (open != std::string::npos) {
      const std::size_t begin = text_.find('>', open);
      const std::size_t mark = text_.find('_', begin);
      if (mark == std::string::npos) fail("its appended data do not begin");
      raw_ = text_.substr(open, begin - open).find("\"raw\"") != std::string::npos;
      appended_ = std::string_view(text_).substr(mark + 1);
      head += "</VTKFile>";
    }
    if (!document_.load_string(head.c_str())) fail("it is no XML of VTK");
    root_ = document_.child("VTKFile");
    if (root_.attribute("type").value() != std::string_view("UnstructuredGrid"))
      fail("it is no unstructured grid");
    big_endian_ = root_.attribute("byte_order").value() == std::string_view("BigEndian");
    wide_ = root_.attribute("header_type").value() == std::string_view("UInt64");
    const std::string_view compressor = root_.attribute("compressor").value();
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
      fail(fmt::format("its compressor is {}", compressor));
    compressed_ = !compressor.empty();
  }

  [[nodiscard]] Table columns() const {
    const pugi::xml_node grid = root_.child("UnstructuredGrid"), piece = grid.child("Piece");
    if (!piece || piece.next_sibling("Piece")) fail("it has not one piece");
    const std::size_t points = piece.attribute("NumberOfPoints").as_ullong();
    if (points == 0 || points > kMostPoints) fail(fmt::format("it states {} points", points));
    Table result;
    std::set<std::string> names;
    const auto add = [&](const pugi::xml_node& array, const std::string& name) {
      const std::size_t parts = std::max(1U, array.attribute("NumberOfComponents").as_uint(1));
      if (parts > 100) fail(fmt::format("{} has {} components", name, parts));
      const std::vector<double> values = values_of(array, parts * points);
      if (!names.insert(name).second) fail(fmt::format("it has two arrays `{}`", printable(name)));
      for (std::size_t part = 0; part < parts; ++part) {
        constexpr std::array axes = {"X_mm", "Y_mm", "Z_mm"};
        std::vector<double>& column = result[name.empty() ? axes.at(part)
                                             : parts == 1 ? name
                                                          : fmt::format("{}_{}", name, part)];
        column.resize(points);
        for (std::size_t i = 0; i < points; ++i) column[i] = values[i * parts + part];
      }
    };
    const pugi::xml_node place = piece.child("Points").child("DataArray");
    if (place.attribute("NumberOfComponents").as_uint() != 3) fail("its points have not 3 parts");
    add(place, "");
    for (const pugi::xml_node& array : piece.child("PointData").children("DataArray"))
      add(array, array.attribute("Name").value());
    return result;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw bad_input(what, {.file = file_.string()},
                    "write it as VTU, ASCII or binary, compressed by zlib or not at all");
  }

  [[nodiscard]] std::uint64_t whole_at(std::string_view bytes, std::size_t at,
                                       std::size_t width) const {
    const auto value = unsigned_at(bytes, at, width, !big_endian_);
    if (!value) fail("an array ends early");
    return *value;
  }

  /// Bytes of an array after its header; `text` is base64 unless `raw`.
  [[nodiscard]] std::string bytes_of(std::string_view text, bool raw) const {
    const std::size_t width = wide_ ? 8 : 4;
    const auto take = [&](std::size_t count, std::size_t& used) {
      if (count > kMostBytes) fail("an array is larger than 1 GiB");
      if (!raw) return from_base64(text, count, used);
      used = std::min(count, text.size());
      return std::string(text.substr(0, used));
    };
    std::size_t used = 0;
    if (!compressed_) {
      const std::uint64_t size = whole_at(take(width, used), 0, width);
      if (size > kMostBytes) fail("an array is larger than 1 GiB");
      std::string all = take(width + size, used);
      if (all.size() < width + size) fail("an array ends early");
      return all.substr(width, size);
    }
    const std::uint64_t blocks = whole_at(take(width, used), 0, width);
    if (blocks > text.size()) fail("an array states more blocks than the file has bytes");
    const std::string header = take(width * (3 + blocks), used);
    const std::uint64_t full = whole_at(header, width, width),
                        last = whole_at(header, 2 * width, width);
    std::uint64_t packed = 0;
    for (std::uint64_t i = 0; i < blocks; ++i) packed += whole_at(header, width * (3 + i), width);
    if (full > kMostBytes || packed > text.size() || blocks * full > kMostBytes)
      fail("an array is larger than 1 GiB");
    text.remove_prefix(used);
    const std::string data = take(packed, used);
    if (data.size() < packed) fail("an array ends early");
    std::string result;
    std::size_t at = 0;
    for (std::uint64_t i = 0; i < blocks; ++i) {
      const std::uint64_t size = whole_at(header, width * (3 + i), width);
      std::string block(i + 1 == blocks && last > 0 ? last : full, '\0');
      uLongf length = block.size();
      if (at > data.size() || data.size() - at < size ||
          ::uncompress(reinterpret_cast<Bytef*>(block.data()), &length,
                       reinterpret_cast<const Bytef*>(data.data() + at), size) != Z_OK ||
          length != block.size())
        fail("an array cannot be uncompressed");
      result += block;
      at += size;
    }
    return result;
  }

  [[nodiscard]] std::vector<double> values_of(const pugi::xml_node& array,
                                              std::size_t count) const {
    const std::string_view format = array.attribute("format").value();
    std::vector<double> values;
    if (format == "ascii") {
      std::istringstream in(array.child_value());
      for (std::string word; in >> word;) {
        const char* const last = word.data() + word.size();
        const auto [end, error] = std::from_chars(word.data(), last, values.emplace_back());
        if (error != std::errc() || end != last)
          fail(fmt::format("`{}` is no number", printable(word)));
      }
      if (values.size() != count) fail("an array has not as many numbers as it states");
      return values;
    }
    std::string bytes;
    if (format == "appended") {
      const std::size_t offset = array.attribute("offset").as_ullong();
      if (offset >= appended_.size()) fail("an array lies behind the file's end");
      bytes = bytes_of(appended_.substr(offset), raw_);
    } else {
      std::string text = array.child_value();
      std::erase_if(text, [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; });
      bytes = bytes_of(text, false);
    }
    const std::string_view type = array.attribute("type").value();
    const std::size_t width = type.ends_with("64")   ? 8
                              : type.ends_with("32") ? 4
                              : type.ends_with("16") ? 2
                                                     : 1;
    if (bytes.size() != width * count) fail("an array has not as many numbers as it states");
    values.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint64_t whole = whole_at(bytes, i * width, width);
      if (type == "Float64")
        values.push_back(std::bit_cast<double>(whole));
      else if (type == "Float32")
        values.push_back(std::bit_cast<float>(static_cast<std::uint32_t>(whole)));
      else if (type.starts_with("UInt"))
        values.push_back(static_cast<double>(whole));
      else if (type.starts_with("Int"))
        values.push_back(static_cast<double>(static_cast<std::int64_t>(whole << (64 - 8 * width)) >>
                                             (64 - 8 * width)));
      else
        fail(fmt::format("an array is of type `{}`", type));
    }
    return values;
  }

  fs::path file_;
  std::string text_;
  std::string_view appended_;
  pugi::xml_document document_;
  pugi::xml_node root_;
  bool raw_ = false, big_endian_ = false, wide_ = false, compressed_ = false;
};

constexpr double kAtMark_m = 1e-6;       ///< largest distance of a point that counts as the mark
constexpr double kFarthest_m = 100;      ///< largest extent of the points
constexpr double kReach = 3;             ///< radius of the fit around a mark, in spacings
constexpr std::size_t kLeastPoints = 8;  ///< for the six coefficients of a quadratic surface
constexpr double kMostDeviations = 3;

Table table_of_csv(const fs::path& file) {
  const CsvText text = read_csv_text(file);
  Table table;
  for (std::size_t col = 0; col < text.names.size(); ++col) {
    std::vector<double>& column = table[text.names[col]];
    for (std::size_t row = 0; row < text.rows.size(); ++row) {
      const std::string& cell = text.rows[row][col];
      const bool failed = cell.empty() || cell == "nan" || cell == "NaN" || cell == "-nan";
      column.push_back(failed ? std::nan("") : text.number(row, text.names[col]).value());
    }
  }
  return table;
}

/// Names of the columns in files of DICe and pyALDIC-3D.
PointColumns known_columns(const Table& table, const fs::path& file, std::string& instrument) {
  const std::pair<const char*, PointColumns> known[] = {
      {"DICe",
       {"MODEL_COORDINATES_X", "MODEL_COORDINATES_Y", "MODEL_COORDINATES_Z", "MODEL_DISPLACEMENT_X",
        "MODEL_DISPLACEMENT_Y", "MODEL_DISPLACEMENT_Z", "warp_mm", "weft_mm", "sigma_mm",
        "STATUS_FLAG"}},
      // A failed subset has a deviation of -1 px.
      {"DICe",
       {"MODEL_COORDINATES_X", "MODEL_COORDINATES_Y", "MODEL_COORDINATES_Z", "MODEL_DISPLACEMENT_X",
        "MODEL_DISPLACEMENT_Y", "MODEL_DISPLACEMENT_Z", "warp_mm", "weft_mm", "sigma_mm", "SIGMA"}},
      {"pyALDIC-3D", {"X_mm", "Y_mm", "Z_mm", {}, {}, {}, "warp_mm", "weft_mm", "sigma_mm", {}}},
      {"", {"x_mm", "y_mm", "z_mm", {}, {}, {}, "warp_mm", "weft_mm", "sigma_mm", {}}}};
  for (auto [name, columns] : known) {
    const auto has = [&](const std::string& column) { return table.contains(column); };
    if (!has(columns.x) || !has(columns.y) || !has(columns.z)) continue;
    if (columns.valid && *columns.valid == "STATUS_FLAG" && !has(*columns.valid)) continue;
    for (auto* column : {&columns.dx, &columns.dy, &columns.dz, &columns.warp, &columns.weft,
                         &columns.sigma, &columns.valid})
      if (*column && !has(**column)) column->reset();
    if (*name != 0) instrument = name;
    return columns;
  }
  throw bad_input("its columns are neither DICe's nor pyALDIC-3D's", {.file = file.string()},
                  "name them in [columns] of a points.toml");
}

const std::vector<double>& column_of(const Table& table, const std::string& name,
                                     const fs::path& file) {
  if (const auto column = table.find(name); column != table.end()) {
    if (std::ranges::any_of(column->second, [](double v) { return std::abs(v) > largest_number; }))
      throw bad_input(
          fmt::format("the column `{}` holds a number above {:g}", name, largest_number),
          {.file = file.string()}, "write nan for a point that was lost");
    return column->second;
  }
  throw bad_input(fmt::format("the column `{}` is missing", name), {.file = file.string()},
                  fmt::format("there are: {}", fmt::join(std::views::keys(table), ", ")));
}

/// Rigid motion that maps the first points to the second ones, with its RMS and the covariance of a
/// mapped point.
struct Fit {
  Pose<void, void> motion;
  double rms_m = 0;
  double u_m = 0;             ///< standard uncertainty of one named point
  Vector3d centre;            ///< centroid of the target points
  Eigen::Matrix3d turn_rad2;  ///< covariance of the rotation vector
  std::size_t count = 0;

  [[nodiscard]] Vector3d operator()(const Vector3d& point) const { return motion * point; }
  [[nodiscard]] Eigen::Matrix3d covariance_at(const Vector3d& point) const {
    Eigen::Matrix3d cross;
    const Vector3d r = point - centre;
    cross << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
    return cross * turn_rad2 * cross.transpose() +
           u_m * u_m / static_cast<double>(count) * Eigen::Matrix3d::Identity();
  }
};

/// Fits the points with a position by `place_of`; nullopt if there are none.
std::optional<Fit> fit_of(
    const PointsDescription& description, const std::string& what,
    const std::function<std::optional<Vector3d>(const NamedPoint&)>& place_of) {
  const Document& document = description.document;
  std::vector<double> u_m;
  Eigen::Matrix3Xd a(3, 0), b(3, 0);
  for (const NamedPoint& point : description.points) {
    const auto place = place_of(point);
    if (!place) continue;
    u_m.push_back(point.uncertainty_m);
    a.conservativeResize(3, std::ssize(u_m));
    b.conservativeResize(3, std::ssize(u_m));
    a.rightCols<1>() = description.unit_m * point.in_file;
    b.rightCols<1>() = *place;
  }
  if (u_m.empty()) return std::nullopt;
  const auto motion = rigid_motion(a, b);
  if (!motion)
    throw bad_input(fmt::format("{} points that name {} fix no place", u_m.size(), what),
                    document.where("point"), "name three or more that do not lie in one line");
  Fit fit{*motion, 0, 0, b.rowwise().mean(), {}, u_m.size()};
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  double worst = 0;
  Eigen::Index worst_at = 0;
  for (Eigen::Index at = 0; at < a.cols(); ++at) {
    const double own_u_m = u_m[static_cast<std::size_t>(at)];
    const double miss_m = (fit(a.col(at)) - b.col(at)).norm();
    fit.rms_m += miss_m * miss_m / static_cast<double>(u_m.size());
    fit.u_m = std::max(fit.u_m, own_u_m);
    if (miss_m / own_u_m > worst) worst = miss_m / own_u_m, worst_at = at;
    const Vector3d r = b.col(at) - fit.centre;
    inertia += r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose();
  }
  fit.rms_m = std::sqrt(fit.rms_m);
  // In three axes, a length of sqrt(3) deviations is usual.
  if (worst > kMostDeviations * std::sqrt(3.0))
    throw bad_input(
        fmt::format("the points that name {} contradict each other: RMS {:.3g} mm, point {} is "
                    "{:.3g} mm off",
                    what, fit.rms_m / mm, worst_at + 1,
                    (fit(a.col(worst_at)) - b.col(worst_at)).norm() / mm),
        document.where("point"), "correct them, unit_mm, or their uncertainty_mm");
  fit.turn_rad2 = fit.u_m * fit.u_m * inertia.inverse();
  return fit;
}

/// Sets material coordinates by named points, through the plane of the flat cloth.
void lay_out(Cloud& cloud, const PointsDescription& description, PointsReport& report) {
  const auto fit =
      fit_of(description, "the cloth", [](const NamedPoint& point) -> std::optional<Vector3d> {
        if (!point.at_material_m) return std::nullopt;
        return Vector3d(point.at_material_m->x(), point.at_material_m->y(), 0);
      });
  if (!fit)
    throw bad_input("the file has no warp and weft, and no point of the cloth is named",
                    description.document.where("point"),
                    "name columns warp and weft, or [[point]]s with at_material_mm");
  if (cloud.before.empty())
    throw bad_input("named points of the cloth need the cloth where it lay flat",
                    description.document.where("columns"),
                    "name dx, dy, dz: the displacement since then");
  report.cloth_rms_m = fit->rms_m;
  for (const Vector3d& point : cloud.before) {
    const Vector3d flat = (*fit)(point);
    if (std::abs(flat.z()) > kMostDeviations * std::max(fit->u_m, 1 * mm))
      throw bad_input(
          fmt::format(
              "before the displacement the cloth did not lie flat: a point is {:.3g} mm off "
              "the plane of the named ones",
              std::abs(flat.z()) / mm),
          description.document.where("point"), "give warp and weft as columns");
    cloud.material_m.emplace_back(flat.x(), flat.y());
  }
}

double spacing_of(const Cloud& cloud) {
  Vector2d low = cloud.material_m.front(), high = low;
  for (const Vector2d& at : cloud.material_m) low = low.cwiseMin(at), high = high.cwiseMax(at);
  const double area = (high - low).prod();
  return std::sqrt(area / static_cast<double>(cloud.material_m.size()));
}

/// Position of a material point on the quadratic surface through the points around it; nullopt
/// where they do not surround it.
std::optional<Vector3d> fitted_at(const Cloud& cloud, const Vector2d& at, double reach_m) {
  std::vector<std::size_t> near;
  std::array<bool, 4> quadrants{};
  for (std::size_t i = 0; i < cloud.material_m.size(); ++i) {
    const Vector2d d = cloud.material_m[i] - at;
    if (d.norm() > reach_m) continue;
    near.push_back(i);
    quadrants[static_cast<std::size_t>(2 * (d.x() >= 0) + (d.y() >= 0))] = true;
  }
  const bool is_surrounded =
      std::all_of(quadrants.begin(), quadrants.end(), [](bool seen) { return seen; });
  if (near.size() < kLeastPoints || !is_surrounded) return std::nullopt;
  Eigen::MatrixXd powers(std::ssize(near), 6), places(std::ssize(near), 3);
  for (Eigen::Index row = 0; row < powers.rows(); ++row) {
    const std::size_t i = near[static_cast<std::size_t>(row)];
    const Vector2d d = (cloud.material_m[i] - at) / reach_m;
    const double weight = std::sqrt(1 - std::min(1.0, d.squaredNorm()));
    powers.row(row) << 1, d.x(), d.y(), d.x() * d.x(), d.x() * d.y(), d.y() * d.y();
    powers.row(row) *= weight;
    places.row(row) = weight * cloud.points[i].transpose();
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(powers);
  if (solver.rank() < 6) return std::nullopt;
  return Vector3d(solver.solve(places).row(0).transpose());
}

/// Mean correlation of two marks' errors.
double common_part(const std::vector<SheetMark>& marks, double length_m) {
  if (length_m <= 0 || marks.size() < 2) return 0;
  double sum = 0;
  for (std::size_t i = 0; i < marks.size(); ++i)
    for (std::size_t k = i + 1; k < marks.size(); ++k)
      sum += std::exp(-(marks[i].point_in_world - marks[k].point_in_world).norm() / length_m);
  return sum / (0.5 * static_cast<double>(marks.size()) * static_cast<double>(marks.size() - 1));
}

}  // namespace

void fields(Fields& f, NamedPoint& point) {
  f.otherwise({"name", "what it is"}, point.name);
  f({"in_file", "place in the file, in its unit"}, point.in_file);
  f.if_any({"in_world_mm", "place in the world", mm}, point.in_world);
  f.if_any({"at_material_mm", "(warp, weft) on the cloth; in_file is where it lay flat", mm},
           point.at_material_m);
  f.otherwise({"uncertainty_mm", "standard uncertainty along each axis", mm, above_zero},
              point.uncertainty_m);
  f.rule(point.in_world.has_value() != point.at_material_m.has_value(), "in_world_mm",
         "a point is named in the world or on the cloth, not both and not neither",
         "give in_world_mm or at_material_mm");
}

void fields(Fields& f, PointColumns& columns) {
  f({"x", "place along x"}, columns.x);
  f({"y", "place along y"}, columns.y);
  f({"z", "place along z"}, columns.z);
  f.if_any({"dx", "displacement along x, added to the place"}, columns.dx);
  f.if_any({"dy", "displacement along y"}, columns.dy);
  f.if_any({"dz", "displacement along z"}, columns.dz);
  f.if_any({"warp", "material coordinate along the warp"}, columns.warp);
  f.if_any({"weft", "material coordinate along the weft"}, columns.weft);
  f.if_any({"sigma", "standard deviation along each axis"}, columns.sigma);
  f.if_any({"valid", "0 or below: the point is none"}, columns.valid);
  f.rule(columns.dx.has_value() == columns.dy.has_value() &&
             columns.dx.has_value() == columns.dz.has_value(),
         "dx", "a displacement has three components", "name dx, dy and dz, or none");
  f.rule(columns.warp.has_value() == columns.weft.has_value(), "warp",
         "warp and weft are never one without the other", "name both, or none");
}

void fields(Fields& f, PointsDescription& description) {
  f.otherwise({"instrument", "what measured the points"}, description.instrument);
  f.otherwise({"unit_mm", "length of one unit of the file", mm, above_zero}, description.unit_m);
  f.if_any({"sigma_mm", "standard deviation of a point along each axis", mm, above_zero},
           description.sigma_m);
  f.otherwise({"correlation_mm", "length over which the errors of two points fall to 1/e", mm, 0},
              description.correlation_m);
  f.if_any({"columns", "names of the columns"}, description.columns);
  f.if_any({"point", "points known in the world or on the cloth"}, description.points);
}

Cloud read_cloud(const fs::path& file, const PointsDescription& description) {
  Cloud cloud;
  cloud.instrument = description.instrument;
  const Table table = file.extension() == ".vtu" ? Vtu(file).columns() : table_of_csv(file);
  const PointColumns names =
      description.columns ? *description.columns : known_columns(table, file, cloud.instrument);
  const auto three = [&](const std::string& x, const std::string& y, const std::string& z) {
    return std::array{&column_of(table, x, file), &column_of(table, y, file),
                      &column_of(table, z, file)};
  };
  if (names.dx.has_value() != names.dy.has_value() || names.dx.has_value() != names.dz.has_value())
    throw bad_input("a displacement has three components", {.file = file.string()},
                    "give all three columns, or none");
  if (names.warp.has_value() != names.weft.has_value())
    throw bad_input("warp and weft are never one without the other", {.file = file.string()},
                    "give both columns, or none");
  const auto at = three(names.x, names.y, names.z);
  std::optional<std::array<const std::vector<double>*, 3>> moved;
  if (names.dx) moved = three(*names.dx, *names.dy, *names.dz);
  const auto optional = [&](const std::optional<std::string>& name) {
    return name ? &column_of(table, *name, file) : nullptr;
  };
  const auto *warp = optional(names.warp), *weft = optional(names.weft),
             *sigma = optional(names.sigma), *valid = optional(names.valid);
  for (std::size_t i = 0; i < at[0]->size(); ++i) {
    Vector3d before((*at[0])[i], (*at[1])[i], (*at[2])[i]), point = before;
    if (moved) point += Vector3d((*(*moved)[0])[i], (*(*moved)[1])[i], (*(*moved)[2])[i]);
    const double least = std::min({valid ? (*valid)[i] : 1, sigma ? (*sigma)[i] : 1});
    const bool is_good = point.allFinite() && least > 0 && (!warp || std::isfinite((*warp)[i])) &&
                         (!weft || std::isfinite((*weft)[i]));
    if (!is_good) {
      ++cloud.left_out;
      continue;
    }
    cloud.points.push_back(description.unit_m * point);
    if (moved) cloud.before.push_back(description.unit_m * before);
    if (warp) cloud.material_m.push_back(description.unit_m * Vector2d((*warp)[i], (*weft)[i]));
    if (sigma) cloud.sigma_m.push_back(description.unit_m * (*sigma)[i]);
  }
  const auto check_extent = [&](auto box, const auto& places, const char* what) {
    for (const auto& place : places) box.extend(place);
    if (!box.isEmpty() && box.diagonal().norm() > kFarthest_m)
      throw bad_input(fmt::format("its {} lie {:.3g} m apart, more than {:g} m", what,
                                  box.diagonal().norm(), kFarthest_m),
                      {.file = file.string()}, "correct them, or unit_mm in points.toml");
  };
  check_extent(Eigen::AlignedBox3d(), cloud.points, "points");
  check_extent(Eigen::AlignedBox2d(), cloud.material_m, "material coordinates");
  if (cloud.points.size() < 4)
    throw bad_input(fmt::format("the file holds {} points, {} failed ones", cloud.points.size(),
                                cloud.left_out),
                    {.file = file.string()}, "give the result of a measurement that succeeded");
  return cloud;
}

Sheet sheet_of_points(const Cloud& given, const PointsDescription& description, const Scene& scene,
                      PointsReport& report) {
  Cloud cloud = given;
  const Document& document = description.document;
  if (cloud.sigma_m.empty() && !description.sigma_m)
    throw bad_input("nothing says how far a point may be off", document.where("sigma_mm"),
                    "give sigma_mm, or name a column sigma");
  if (cloud.material_m.empty()) lay_out(cloud, description, report);
  const auto world =
      fit_of(description, "the world", [](const NamedPoint& point) { return point.in_world; });
  if (world) {
    report.world_rms_m = world->rms_m;
    for (Vector3d& point : cloud.points) point = (*world)(point);
  }
  const Print print = print_of(scene);
  Sheet sheet;
  sheet.rows = print.rows;
  sheet.cols = print.cols;
  sheet.patch_m = print.patch_m;
  report.spacing_m = spacing_of(cloud);
  for (int row = 0; row < print.rows; ++row) {
    for (int col = 0; col < print.cols; ++col) {
      const MarkId id{row, col};
      const Vector2d at = print.material_m(id);
      std::size_t nearest = 0;
      for (std::size_t i = 1; i < cloud.material_m.size(); ++i)
        if ((cloud.material_m[i] - at).squaredNorm() <
            (cloud.material_m[nearest] - at).squaredNorm())
          nearest = i;
      const bool is_direct = (cloud.material_m[nearest] - at).norm() < kAtMark_m;
      const auto place = is_direct ? std::optional(cloud.points[nearest])
                                   : fitted_at(cloud, at, kReach * report.spacing_m);
      if (!place) {
        sheet.gaps.push_back({id, "no measured points around it"});
        continue;
      }
      ++(is_direct ? report.direct : report.fitted);
      const double sigma_m = cloud.sigma_m.empty() ? *description.sigma_m : cloud.sigma_m[nearest];
      Eigen::Matrix3d covariance = sigma_m * sigma_m * Eigen::Matrix3d::Identity();
      if (world) covariance += world->covariance_at(*place);
      sheet.marks.push_back({id, at, *place, covariance, {}, {}});
    }
  }
  report.common_part = common_part(sheet.marks, description.correlation_m);
  double own = 0, placing = 0;
  for (const SheetMark& mark : sheet.marks) {
    const double by_fit = world ? world->covariance_at(mark.point_in_world).trace() : 0;
    own += mark.covariance_m2->trace() - by_fit;
    placing += by_fit;
  }
  const double count = std::max<double>(1, static_cast<double>(sheet.marks.size()));
  ErrorBudget budget;
  budget.detection_m = std::sqrt((1 - report.common_part) * own / count);
  budget.calibration_m = std::sqrt((report.common_part * own + placing) / count);
  budget.total_m = std::sqrt((own + placing) / count);
  sheet.error_budget = budget;
  sheet.source = MeasuredSource{scene.name,
                                scene.set.empty() ? scene.name : scene.set,
                                {cloud.instrument},
                                document.sha256(),
                                {}};
  return sheet;
}

}  // namespace drape::triangulate
