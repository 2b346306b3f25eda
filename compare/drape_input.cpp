// SPDX-License-Identifier: Apache-2.0
#include "compare/drape_input.hpp"

#include <fmt/format.h>

#include <iterator>
#include <set>
#include <tuple>

#include "core/drape_mesh.hpp"
#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using units::mm;

/// Path of a list in the folder above the sheet's; nullopt if it does not exist.
std::optional<fs::path> file_above(const fs::path& sheet, const char* name) {
  const fs::path folder = sheet.parent_path();
  const fs::path file = (folder.empty() ? fs::path(".") : folder) / ".." / name;
  return fs::is_regular_file(file) ? std::optional(file) : std::nullopt;
}

/// True if the sheet named by a list is this one.
bool is_named(const fs::path& sheet, const std::string& name, const fs::path& list) {
  std::error_code unreadable;
  const fs::path named =
      name_inside(list.parent_path(), name, {.file = list.string(), .field = "sheet"});
  return fs::equivalent(named, fs::path(sheet).replace_extension(".ply"), unreadable);
}

Branch branch_from(const ListedBranch& one, const BranchList& list) {
  Branch branch{one, list.document.sha256(), static_cast<int>(list.branches.size()), list.round};
  for (const ListedBranch& other : list.branches)
    if (other.number == 1) branch.least_j = other.energy_j;
  return branch;
}

/// Value of a key; absent ones, such as a yaw or an edge radius, are 0.
std::string value_of(const Surroundings& values, const std::string& key) {
  const auto found = values.find(key);
  return found == values.end() || found->second.empty() ? "0" : found->second;
}

/// True if it is an input by path or content: a record may name a copy; files may change.
bool is_among(const fs::path& file, const std::vector<std::pair<fs::path, std::string>>& inputs) {
  const std::string sha256 = fs::is_regular_file(file) ? sha256_of_file(file) : std::string();
  return std::ranges::any_of(inputs, [&](const auto& input) {
    return input.second == sha256 ||
           fs::weakly_canonical(input.first) == fs::weakly_canonical(file);
  });
}

constexpr std::size_t kShortHash = 8;  ///< characters that suffice for people to distinguish files

/// Options of a certificate that affect where a cloth rests; the others affect only the way to it.
constexpr std::array<const char*, 2> kRestOptions{"internal_friction", "cloth_thickness_mm"};
constexpr const char* kFit = "curves_fitted";

std::string hash_text(const std::string& sha256) {
  return sha256.empty() ? "none" : sha256.substr(0, kShortHash);
}

/// Formats the value of a setup for people.
std::string shown(const Simulation& simulation, const std::string& key, const std::string& value,
                  const std::vector<Simulation>& group) {
  if (key == "start") return hash_text(value);
  if (key == "scene")
    return simulation.scene
               ? fmt::format("{}_friction_{:g}", hash_text(value), simulation.scene->friction)
               : hash_text(value);
  if (key != "fabric") return value;
  const SimulatedSource& own = simulation.source();
  const bool ambiguous = std::ranges::any_of(group, [&](const Simulation& other) {
    return other.source().fabric == own.fabric && other.source().fabric_sha256 != value;
  });
  return ambiguous ? own.fabric + " " + hash_text(value) : own.fabric;
}

/// False for branches, which have neither a certificate nor the start of the runs.
bool is_compared(const Simulation& simulation, const std::string& key) {
  if (simulation.other_simulator) return false;
  return !simulation.branch || key == "model" || key == "fabric" || key == "scene";
}

std::string stated_value(const Setup& setup, const std::string& key) {
  const auto found = setup.find(key);
  return found == setup.end() ? "not stated" : found->second;
}

constexpr double kStep_m = 2 * mm;  ///< spacing at which a textured mesh is sampled
constexpr double kOutside = 1e-9;   ///< tolerance of a triangle, in barycentric coordinates
/// Cloth that hangs under its own weight does not strain by so much; units differ by 2.54 or more.
constexpr double kMostStrain = 0.3;

/// Adds the vertices themselves, sorted so that rows run along the warp.
void add_grid(const DrapeMesh& drape, Sheet& sheet) {
  const MaterialRange& range = drape.grid->range;
  const int inner = drape.grid->inner_count;
  const bool inner_is_warp = drape.grid->inner == ClothDirection::warp;
  sheet.rows = inner_is_warp ? inner : drape.outer_count();
  sheet.cols = inner_is_warp ? drape.outer_count() : inner;
  for (int outer = 0; outer < drape.outer_count(); ++outer)
    for (int step = 0; step < inner; ++step) {
      MarkId mark = inner_is_warp ? MarkId{step, outer} : MarkId{outer, step};
      if (range.from_m.x() > range.to_m.x()) mark.row = sheet.rows - 1 - mark.row;
      if (range.from_m.y() > range.to_m.y()) mark.col = sheet.cols - 1 - mark.col;
      const auto vertex = static_cast<std::size_t>(outer * inner + step);
      sheet.marks.push_back(
          {mark, drape.material_m(step, outer), drape.points_in_world[vertex], {}, {}, {}});
    }
  std::ranges::sort(sheet.marks, {}, &SheetMark::mark);
}

/// 0, the side length, the marks' own lines, and lines between them at most a step apart.
std::vector<double> lines_of(const Sheet& measured, int axis) {
  std::vector<double> fixed = {measured.patch_m[axis]};
  for (const SheetMark& mark : measured.marks) fixed.push_back(mark.material_m[axis]);
  std::ranges::sort(fixed);
  std::vector<double> lines = {0};
  for (const double to : fixed) {
    const double from = lines.back(), gap = to - from;
    if (gap < 1e-9) continue;
    const int pieces = std::max(1, static_cast<int>(std::ceil(gap / kStep_m - 1e-9)));
    for (int k = 1; k <= pieces; ++k) lines.push_back(k < pieces ? from + gap * k / pieces : to);
  }
  return lines;
}

void add_texture(const DrapeMesh& drape, const Sheet& measured, Sheet& sheet) {
  const MaterialSurface surface(drape, kOutside);
  const std::vector<double> warp = lines_of(measured, 0), weft = lines_of(measured, 1);
  sheet.rows = static_cast<int>(warp.size());
  sheet.cols = static_cast<int>(weft.size());
  for (int row = 0; row < sheet.rows; ++row) {
    for (int col = 0; col < sheet.cols; ++col) {
      const Eigen::Vector2d material(warp[static_cast<std::size_t>(row)],
                                     weft[static_cast<std::size_t>(col)]);
      if (const auto point = surface.at(material)) {
        sheet.marks.push_back({{row, col}, material, *point, {}, {}, {}});
      } else {
        sheet.gaps.push_back({{row, col}, "the mesh has no triangle there"});
      }
    }
  }
}

/// Ratios of lengths on the mesh to those on the cloth, of neighbours along the warp or the weft.
std::vector<double> stretches_of(const Sheet& sheet, const MarkId& step) {
  std::vector<double> stretches;
  for (const SheetMark& mark : sheet.marks) {
    const SheetMark* next = sheet.find({mark.mark.row + step.row, mark.mark.col + step.col});
    if (next == nullptr) continue;
    const double cloth_m = (next->material_m - mark.material_m).norm();
    if (cloth_m > 0)
      stretches.push_back((next->point_in_world - mark.point_in_world).norm() / cloth_m);
  }
  return stretches;
}

/// Throws for a wrong unit, which would otherwise give plausible distances.
void require_size_of_cloth(const DrapeMesh& drape, const Sheet& sheet) {
  for (const bool warp : {true, false}) {
    const std::vector<double> stretches = stretches_of(sheet, warp ? MarkId{1, 0} : MarkId{0, 1});
    if (stretches.empty()) continue;
    const double stretch = median(stretches);
    if (stretch < 1 + kMostStrain && stretch > 1 / (1 + kMostStrain)) continue;
    drape.reject("unit_mm",
                 fmt::format("neighbours along the {} lie {:.3g} times as far apart in space as on "
                             "the cloth",
                             warp ? "warp" : "weft", stretch),
                 "give 10 for a mesh in cm, 25.4 in inches, 1000 in metres, or correct the "
                 "material coordinates");
  }
}

/// Another assignment of warp, weft or up axis with which a mesh is many times closer to the
/// measured marks than as described; empty if none. Warp and weft can be assigned in eight ways.
std::string better_description(const DrapeMesh& drape, const Sheet& sheet, const Sheet& measured) {
  constexpr double kTimes = 4;        ///< required ratio of distances
  constexpr double kOfPatch = 0.015;  ///< relative; below it any assignment fits a flat cloth
  constexpr const char* kLayings[] = {"",
                                      "warp_from and warp_to exchanged",
                                      "weft_from and weft_to exchanged",
                                      "both directions turned round",
                                      "warp and weft exchanged",
                                      "warp and weft exchanged, then warp_from and warp_to",
                                      "warp and weft exchanged, then weft_from and weft_to",
                                      "warp and weft exchanged and both turned round"};
  const Surface surface(sheet, drape.name);
  const bool z_up = drape.up == MeshUp::z;
  double stated_m = 0, best_m = HUGE_VAL;
  std::string best;
  for (const bool other_up : {false, true}) {
    for (std::size_t laying = 0; laying < std::size(kLayings); ++laying) {
      double sum = 0;
      std::size_t count = 0;
      for (const SheetMark& mark : measured.marks) {
        Eigen::Vector2d part = mark.material_m.cwiseQuotient(measured.patch_m);
        if ((laying & 4) != 0) std::swap(part.x(), part.y());
        if ((laying & 1) != 0) part.x() = 1 - part.x();
        if ((laying & 2) != 0) part.y() = 1 - part.y();
        const auto found = surface.at(part.cwiseProduct(measured.patch_m));
        if (!found) continue;
        const Eigen::Vector3d p = found->point_in_world;
        const Eigen::Vector3d point = !other_up ? p
                                      : z_up    ? Eigen::Vector3d(p.x(), -p.z(), p.y())
                                                : Eigen::Vector3d(p.x(), p.z(), -p.y());
        sum += (point - mark.point_in_world).squaredNorm();
        ++count;
      }
      if (2 * count < measured.marks.size()) continue;
      const double rms_m = std::sqrt(sum / static_cast<double>(count));
      if (!other_up && laying == 0) stated_m = rms_m;
      if (rms_m >= best_m) continue;
      best_m = rms_m;
      best = !other_up     ? kLayings[laying]
             : laying == 0 ? fmt::format("up = \"{}\"", z_up ? "y" : "z")
                           : fmt::format("up = \"{}\", {}", z_up ? "y" : "z", kLayings[laying]);
    }
  }
  if (best.empty() || stated_m < kOfPatch * measured.patch_m.norm() || kTimes * best_m > stated_m)
    return {};
  return fmt::format(
      "as {} describes it the mesh lies {:.3g} mm from the marks (RMS), with {} "
      "{:.3g} mm: correct the description",
      drape.document.file().filename().string(), stated_m / mm, best, best_m / mm);
}

std::string id_of(const fs::path& file, const std::string& mesh_sha256) {
  return sha256_of(std::string_view(other_mesh_content(sha256_of_file(file), mesh_sha256)));
}

}  // namespace

std::optional<Branch> branch_in(const Document& document, int number) {
  const auto list = read_record<BranchList>(document);
  for (const ListedBranch& one : list.branches)
    if (one.number == number) return branch_from(one, list);
  return std::nullopt;
}

std::optional<std::pair<fs::path, Branch>> branch_of(const fs::path& sheet) {
  const auto file = file_above(sheet, "branches.json");
  if (!file) return std::nullopt;
  const auto list = read_record<BranchList>(*file);
  for (const ListedBranch& one : list.branches)
    if (is_named(sheet, one.sheet, *file))
      return std::pair(file->lexically_normal(), branch_from(one, list));
  return std::nullopt;
}

std::optional<BranchList> list_above(const fs::path& sheet, const std::string& sha256) {
  const auto file = file_above(sheet, "branches.json");
  if (!file) return std::nullopt;
  const Document document = Document::read(*file);
  if (document.sha256() != sha256) return std::nullopt;
  return read_record<BranchList>(document);
}

std::optional<Eigen::Vector2d> axis_of(const Scene& scene) {
  for (const Obstacle& obstacle : scene.obstacles)
    if (auto centre = centre_of(obstacle)) return centre;
  return std::nullopt;
}

std::optional<TurnedDistance> best_turn(const Sheet& measured, const Surface& virtual_sheet,
                                        const Eigen::Vector2d& axis_in_world) {
  constexpr int kTurns = 360;
  const double step = 2 * std::numbers::pi / kTurns, golden = (std::sqrt(5.0) - 1) / 2;
  const Eigen::Vector3d axis(axis_in_world.x(), axis_in_world.y(), 0);
  std::optional<TurnedDistance> best;
  for (const bool half_turn : {false, true}) {
    std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> pairs;  // about the axis
    for (const SheetMark& mark : measured.marks)
      if (const auto place =
              virtual_sheet.at(half_turn ? measured.patch_m - mark.material_m : mark.material_m))
        pairs.emplace_back(mark.point_in_world - axis, place->point_in_world - axis);
    if (pairs.empty()) continue;
    const auto mean_m = [&](double turn_rad) {
      const Eigen::Matrix3d turn = rotation_about({0, 0, turn_rad});
      double sum = 0;
      for (const auto& [real, simulated] : pairs) sum += (turn * simulated - real).norm();
      return sum / static_cast<double>(pairs.size());
    };
    std::vector<double> means;
    for (int k = 0; k < kTurns; ++k) means.push_back(mean_m(k * step));
    const auto nearest = std::ranges::min_element(means) - means.begin();
    // Golden section: there is one minimum within a step around the nearest.
    double low = static_cast<double>(nearest - 1) * step, high = low + 2 * step;
    while (high - low > 1e-13) {
      const double left = high - golden * (high - low), right = low + golden * (high - low);
      mean_m(left) < mean_m(right) ? high = right : low = left;
    }
    const double turn = std::remainder((low + high) / 2, 2 * std::numbers::pi);
    if (const double least = mean_m(turn); !best || least < best->mean_m)
      best = TurnedDistance{least, turn, half_turn, axis_in_world};
  }
  return best;
}

std::string ensemble_sentence(const BranchList& list) {
  std::string text = fmt::format("{} starts come to rest", list.members_at_rest.value_or(0));
  std::vector<double> radii;
  for (const BandMark& one : list.band) radii.push_back(one.radius95_m);
  if (!radii.empty())
    text += fmt::format(
        "; 95 % of them lie within {:.2f} mm of their mean (median over the marks; {:.2f} mm at "
        "the loosest mark)",
        median(radii) / mm, *std::ranges::max_element(radii) / mm);
  if (list.unseen)
    text += fmt::format(
        "; {:.0f} % of starts may end on branches that none showed, at most {:.0f} % (95 %)",
        100 * list.unseen->fraction, 100 * list.unseen->upper95);
  if (!list.measured) return text;
  const PlacedDrape& real = *list.measured;
  if (real.nearest && real.distance_m) {
    const bool known = real.reach_m.has_value();  // otherwise being on a branch means nothing
    text += known && real.branch
                ? fmt::format("; the real drape is on branch {}", *real.branch)
                : fmt::format("; {}branch {} is the nearest",
                              known ? "the real drape is on no branch, " : "", *real.nearest);
    text += fmt::format(" ({:.2f} mm from its nearest member", *real.distance_m / mm);
    if (real.apart_m)
      text += fmt::format(", the next branch {:.2f} mm from it", *real.apart_m / mm);
    if (known) text += fmt::format(", branches reach {:.2f} mm", *real.reach_m / mm);
    text += ")";
  }
  if (!radii.empty() && real.inside_fraction)
    text += fmt::format("; {:.0f} % of its marks are in their bands", 1e2 * *real.inside_fraction);
  if (real.started_there_m)
    text += fmt::format(
        "; started from the real shape, the simulation rests {:.2f} mm away: the error of model "
        "and fabric without the luck of folds",
        *real.started_there_m / mm);
  else if (!real.started_there.empty())
    text += "; started from the real shape, it ends " + real.started_there;
  return text;
}

std::string friction_sentence(const FrictionBand& band) {
  if (band.pushes.empty()) return "without friction the drape of the scene's start has one place";
  std::string text = fmt::format(
      "friction {:g} holds the drape of the scene's start anywhere in an interval: pushed by "
      "{:.2f} of its weight from {} sides and let go",
      band.friction, band.pushes.front().push_per_weight->norm(), band.pushes.size());
  const std::vector<double> reach = band.reach_m();
  if (band.counted() > 0 && !reach.empty())
    text += fmt::format(
        ", it rests up to {:.3f} mm away (median over the marks; {:.3f} mm at the loosest mark)",
        median(reach) / mm, *std::ranges::max_element(reach) / mm);
  const auto lost = band.pushes.size() - static_cast<std::size_t>(band.counted());
  if (lost > 0)
    text +=
        fmt::format("{} {} of these pushes end on another branch or nowhere, and count for nothing",
                    band.counted() > 0 ? ";" : ",", lost);
  return text;
}

std::string memory_sentence(const MemoryBand& band) {
  std::string text =
      "internal friction holds the drape of the scene's start in an interval, as other pasts show";
  int lost = 0;
  for (const OtherRest& end : band.ends) {
    if (!end.moves_m) {
      ++lost;
      continue;
    }
    const Eigen::VectorXd far = end.moves().rowwise().norm();
    text += fmt::format("; {}: {:.3f} mm away on average, {:.3f} mm at the loosest mark", end.what,
                        far.mean() / mm, far.maxCoeff() / mm);
  }
  if (band.place_of_rest)
    text += fmt::format("; from its lowest to its highest end the drape lies at {:.0f} %",
                        100 * *band.place_of_rest);
  if (lost > 0)
    text += fmt::format("; {} of {} ends lie on another branch or nowhere, and count for nothing",
                        lost, band.ends.size());
  return text;
}

std::optional<SimulatedScene> read_simulated_scene(
    const fs::path& file, const std::vector<std::pair<fs::path, std::string>>& inputs) {
  // Read as it was used; today's rules apply where a scene is measured or simulated.
  const auto scene = read_record<Scene>(file);
  SimulatedScene simulated{scene.set, {}, scene.friction, is_among(scene.fabric_file, inputs)};
  bool are_meshes_known = true;
  simulated.surroundings = surroundings_of(scene, [&](const fs::path& mesh) {
    for (const auto& [input, sha256] : inputs)
      if (fs::weakly_canonical(input) == fs::weakly_canonical(mesh)) return sha256;
    are_meshes_known = false;
    return std::string();
  });
  return are_meshes_known ? std::optional(simulated) : std::nullopt;
}

std::optional<std::string> difference_of(const Surroundings& asked, const Surroundings& other,
                                         const std::string& in_other) {
  Surroundings all = asked;
  all.insert(other.begin(), other.end());
  for (const auto& [key, any] : all) {
    const std::string one = value_of(asked, key), its = value_of(other, key);
    if (key.ends_with("_uncertainty_mm") || key.ends_with(".on_stand") ||
        key.find(".tags_") != std::string::npos || one == its)
      continue;  // touches no mark
    return fmt::format("{} is {} {}, {} for the marks", key, its, in_other, one);
  }
  return std::nullopt;
}

std::pair<bool, double> Simulation::fineness() const {
  return is_grid() ? std::pair(false, static_cast<double>(sheet.sheet.rows))
                   : std::pair(true, -*source().spacing_m);
}

std::string Simulation::run_label() const {
  if (other_simulator) return fmt::format("{}, {}", *other_simulator, discretisation());
  const int count = source().segments;
  return fmt::format("{}, {} segment{}{}", discretisation(), count, count == 1 ? "" : "s",
                     apart_text());
}

std::string Simulation::label() const {
  return branch ? fmt::format("{}, branch {}", run_label(), branch->number) : run_label();
}

std::string Simulation::apart_text() const {
  std::string text;
  for (const auto& [key, value] : apart) text += fmt::format(", {} {}", key, value);
  return text;
}

Setup Simulation::setup() const {
  const SimulatedSource& own = source();
  Setup setup{{"model", own.model},
              {"solver", own.solver},
              {"fabric", own.fabric_sha256},
              {"scene", own.scene_sha256},
              {"start", own.start_sha256.value_or(std::string())},
              {"from", own.from_measured ? "measured shape" : "scene"}};
  if (!certificate) return setup;
  // Certificates omit options that were not used.
  setup[kRestOptions.front()] = "no";
  setup[kFit] = "whole";
  for (const auto& [name, value] : certificate->entries) {
    for (const char* option : kRestOptions)
      if (name == std::string("options.") + option) setup[option] = value;
    if (name.starts_with("options.curves_fitted_up_to.")) setup[kFit] = "to_a_range";
  }
  return setup;
}

bool Simulation::is_of_cloth_of(const Simulation& other) const {
  const SimulatedSource &own = source(), &its = other.source();
  return own.model == its.model && own.fabric_sha256 == its.fabric_sha256 &&
         own.scene_sha256 == its.scene_sha256;
}

void tell_apart(std::vector<Simulation>& simulations) {
  // An option that a model lacks does not distinguish its simulations.
  std::map<std::string, std::set<std::string>> models, values;
  for (const Simulation& one : simulations)
    for (const auto& [key, value] : one.setup()) models[key].insert(one.source().model);
  const auto is_told = [&](const Simulation& one, const std::string& key) {
    return is_compared(one, key) && models[key].contains(one.source().model);
  };
  for (const auto& [key, known] : models)
    for (const Simulation& one : simulations)
      if (is_told(one, key)) values[key].insert(stated_value(one.setup(), key));
  for (Simulation& one : simulations) {
    const Setup setup = one.setup();
    for (const auto& [key, seen] : values)
      if (seen.size() > 1 && is_told(one, key))
        one.apart.emplace(key, shown(one, key, stated_value(setup, key), simulations));
  }
}

std::string DrapeInput::name() const {
  if (!simulations.empty()) return simulations.front().source().scene;
  if (!surfaces.empty()) return surfaces.front().scene;
  if (scene) return scene->name;
  return measured.asked ? measured.asked->name : measured.measured().set;
}

bool DrapeInput::speaks_before(const Simulation& one, const Simulation& other) const {
  constexpr int kSegments = 5;  // largest number in the paper
  const auto is_of_own_fabric = [&](const Simulation& simulation) {
    return std::ranges::any_of(simulations, [&](const Simulation& known) {
      return known.scene && known.scene->own_fabric &&
             known.source().fabric_sha256 == simulation.source().fabric_sha256;
    });
  };
  const auto rank = [&](const Simulation& s) {
    const int count = s.segments().value_or(0);
    return std::tuple(!s.other_simulator, !s.branch,
                      measured.asked && measured.asked->sha256 == s.source().scene_sha256,
                      is_of_own_fabric(s), !s.source().from_measured, s.fineness(),
                      count == kSegments, count);
  };
  const auto names = [](const Simulation& s) {
    return std::tuple(s.source().model, s.source().fabric, s.setup(),
                      s.branch ? s.branch->set_sha256 : std::string(), s.sheet.sha256);
  };
  const auto first = rank(one), second = rank(other);
  return first != second ? first > second : names(one) < names(other);
}

const Simulation* DrapeInput::speaker() const {
  const auto first = std::ranges::min_element(
      simulations,
      [this](const Simulation& a, const Simulation& b) { return speaks_before(a, b); });
  return first == simulations.end() ? nullptr : &*first;
}

const Simulation* DrapeInput::speaking_branch() const {
  const Simulation* chosen = nullptr;
  for (const Simulation& one : simulations)
    if (one.branch && one.is_of_cloth_of(*speaker()) &&
        (chosen == nullptr || speaks_before(one, *chosen)))
      chosen = &one;
  return chosen;
}

std::string other_mesh_content(const std::string& description_sha256,
                               const std::string& mesh_sha256) {
  return "drapebench/mesh\n" + description_sha256 + "\n" + mesh_sha256;
}

std::optional<std::string> description_in(const std::string& content) {
  constexpr std::size_t kHash = 64, kHead = std::string_view("drapebench/mesh\n").size();
  if (content.size() != kHead + kHash + 1 + kHash) return std::nullopt;
  std::string description = content.substr(kHead, kHash);
  if (other_mesh_content(description, content.substr(kHead + kHash + 1)) != content)
    return std::nullopt;
  return description;
}

std::optional<OtherMeshId> other_mesh_id(const fs::path& file) {
  if (file.extension() != ".toml" || !fs::is_regular_file(file) ||
      read_text(file).find("\"drapebench/mesh/") == std::string::npos)
    return std::nullopt;
  try {
    const fs::path mesh = read_record<DrapeMesh>(file).mesh_file;
    const std::string mesh_sha256 = sha256_of_file(mesh);
    return OtherMeshId{id_of(file, mesh_sha256), mesh, mesh_sha256};
  } catch (const Error&) {
    return std::nullopt;  // nothing could have been compared with it
  }
}

std::optional<OtherSurface> read_other_surface(const fs::path& file, const fs::path& mesh) {
  if (!read_record<DrapeMesh>(file).correspondence) return std::nullopt;
  DrapeMesh drape = read_drape_mesh(file, mesh);
  const std::string mesh_sha256 = sha256_of_file(drape.mesh_file);
  OtherSurface surface{file,
                       drape.mesh_file,
                       id_of(file, mesh_sha256),
                       mesh_sha256,
                       drape.name,
                       drape.scene,
                       drape.fabric,
                       {}};
  surface.mesh.points = std::move(drape.points_in_world);
  for (const auto& [a, b, c] : drape.mesh.triangles)
    surface.mesh.triangles.push_back({a.point, b.point, c.point});
  if (surface.mesh.triangles.empty())
    drape.reject("mesh", "the mesh has no face, so it is no surface", "export the faces too");
  return surface;
}

Simulation read_other_mesh(const fs::path& file, const Sheet& measured, const fs::path& mesh) {
  const DrapeMesh drape = read_drape_mesh(file, mesh);
  const fs::path& mesh_file = drape.mesh_file;
  Simulation simulation;
  simulation.other_simulator = drape.name;
  simulation.sheet.file = file;
  Sheet& sheet = simulation.sheet.sheet;
  sheet.patch_m = measured.patch_m;
  if (drape.grid.has_value() == drape.uv.has_value())
    drape.reject("mesh", "it needs [grid] or [uv], and not both",
                 "say where the material points are; where nothing of it is known, write "
                 "correspondence = \"none\": then only surfaces are compared");
  drape.grid ? add_grid(drape, sheet) : add_texture(drape, measured, sheet);
  require_size_of_cloth(drape, sheet);
  if (std::string better = better_description(drape, sheet, measured); !better.empty())
    sheet.no_go = std::move(better);
  simulation.sheet.ply_sha256 = sha256_of_file(mesh_file);
  simulation.sheet.sha256 = id_of(file, simulation.sheet.ply_sha256);
  simulation.other_file = mesh_file;
  const std::string fabric = drape.fabric.value_or("not stated");
  const std::string nothing = sha256_of("not stated: " + fabric);
  sheet.source = SimulatedSource{.scene = drape.scene,
                                 .fabric = fabric,
                                 .scene_sha256 = nothing,
                                 .fabric_sha256 = nothing,
                                 .start_sha256 = {},
                                 .model = drape.name,
                                 .status = "as exported"};
  return simulation;
}

}  // namespace drape::compare
