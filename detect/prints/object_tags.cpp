// SPDX-License-Identifier: Apache-2.0
#include "detect/prints/object_tags.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"

namespace drape::detect {

using units::mm;

Target object_plate(double size_m, int first_id) {
  // As the cloth's print: dots wide enough for a hundredth of a pixel, tags that a camera reads
  // from where it reads those of the cloth, a module of white between them.
  constexpr double kLeastPitch_m = 15 * mm;
  constexpr double kDotPart = 0.3, kTagPart = 0.55;
  const int dots = static_cast<int>(std::floor(size_m / kLeastPitch_m));
  if (dots < 3)
    throw usage_error(fmt::format("a plate of {:g} mm holds too few dots", size_m / mm),
                      "give --size-mm 45 or more");
  Target plate;
  plate.rows = plate.cols = dots;
  plate.pitch_m = size_m / dots;
  plate.dot_diameter_m = kDotPart * plate.pitch_m;
  plate.tag_family = "tag36h11";
  plate.tag_edge_m = kTagPart * plate.pitch_m;
  const double corner_m = 0.5 * (dots - 2) * plate.pitch_m;
  for (const double y : {-corner_m, corner_m})
    for (const double x : {-corner_m, corner_m}) plate.tags.push_back({first_id++, {x, y}});
  return plate;
}

std::string object_plate_toml(const Target& plate) {
  std::string text = fmt::format(
      "schema = \"drapebench/target/1\"\n"
      "# Sheet of {:g} mm on an object: cut along the corner marks and lay it edge on edge on a "
      "box,\n# or cut a hole in the middle that carries a sphere.\n"
      "kind = \"dot-grid\"\nrows = {}\ncols = {}\npitch_mm = {:.6f}\ndot_diameter_mm = {:.6f}\n\n"
      "[tags]\nfamily = \"{}\"\nedge_mm = {:.6f}\n",
      plate.pitch_m * plate.cols / mm, plate.rows, plate.cols, plate.pitch_m / mm,
      plate.dot_diameter_m / mm, plate.tag_family, plate.tag_edge_m / mm);
  for (const PrintedTag& tag : plate.tags)
    text += fmt::format("\n[[tags.tag]]\nid = {}\ncentre_mm = [{:.6f}, {:.6f}]\n", tag.id,
                        tag.centre_m.x() / mm, tag.centre_m.y() / mm);
  return text;
}

namespace {

bool is_output_of(const std::filesystem::path& record, const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(record)) return false;
  try {
    const Json run = parse_json(read_text(record));
    for (const Json& output : run.at("outputs"))
      if (output.at("file") == file.filename().string() &&
          output.at("sha256") == sha256_of_file(file))
        return true;
  } catch (const std::exception&) {
    return false;
  }
  return false;
}

}  // namespace

void require_replaceable_plate(const std::filesystem::path& file,
                               const std::filesystem::path& record) {
  if (!std::filesystem::exists(file) || is_output_of(record, file)) return;
  throw bad_input("it is there already, and no plate that this program wrote beside its page",
                  {.file = file.string()}, "give --out another name");
}

}  // namespace drape::detect
