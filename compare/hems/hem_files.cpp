// SPDX-License-Identifier: Apache-2.0
#include "compare/hems/hem_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <numeric>
#include <regex>
#include <set>

#include "compare/hems/hem_checks.hpp"
#include "compare/hems/hem_csv.hpp"
#include "compare/hems/shadow.hpp"
#include "core/error.hpp"
#include "core/parallel.hpp"
#include "core/statistics/distributions.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

const std::set<std::string> kPictures = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm"};
const std::set<std::string> kMeshes = {".ply", ".obj", ".json"};

std::string ending_of(const fs::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

/// Finds the names in a path by a pattern such as "{fabric}_{repeat}".
class NamePattern {
 public:
  explicit NamePattern(const std::string& pattern) {
    static const std::regex part("\\{([^}]*)\\}?|[^{]");
    std::string expression;
    for (std::sregex_iterator at(pattern.begin(), pattern.end(), part), end; at != end; ++at) {
      const std::string text = at->str();
      if (text == "*") {
        expression += ".*?";
      } else if (text.front() != '{') {
        expression += (std::isalnum(static_cast<unsigned char>(text[0])) == 0 ? "\\" : "") + text;
      } else {
        if (!value_of(HemRecord(), (*at)[1]) || text.back() != '}')
          throw usage_error(fmt::format("`{}` is no name in a pattern", (*at)[1].str()),
                            "use {fabric}, {sample}, {face} and {repeat}");
        names_.push_back((*at)[1]);
        expression += "(.+?)";
      }
    }
    expression_ = std::regex(expression);
  }

  void apply(const std::string& path, HemRecord& record) const {
    std::smatch found;
    if (!std::regex_match(path, found, expression_))
      throw bad_input("the file's name does not fit --names", {.file = path}, "change one of them");
    for (std::size_t i = 0; i < names_.size(); ++i) *value_of(record, names_[i]) = found[i + 1];
  }

 private:
  template <class Record>
  static std::string* value_of(Record&& record, const std::string& name) {
    for (const auto& [known, value] : {std::pair{"fabric", &record.fabric},
                                       {"sample", &record.sample},
                                       {"face", &record.face},
                                       {"repeat", &record.repeat}})
      if (name == known) return value;
    return nullptr;
  }
  std::vector<std::string> names_;
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
    const std::string ending = ending_of(entry.path());
    const bool twin = ending == ".ply" || ending == ".obj" || kPictures.contains(ending);
    if (!entry.is_regular_file() || !twin) continue;
    fs::path name = fs::relative(entry.path(), input);
    name.replace_extension();
    found.push_back({entry.path(), name.generic_string()});
  }
  std::sort(found.begin(), found.end(),
            [](const Input& a, const Input& b) { return a.file < b.file; });
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
      twice_area += a.x() * b.y() - a.y() * b.x();
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

std::vector<HemRecord> read_input(const Input& input, const HemReadOptions& options,
                                  const NamePattern* names) {
  const std::string ending = ending_of(input.file);
  if (ending == ".csv") return read_hems_csv(input.file, options);
  HemRecord record;
  record.file = input.file.string();
  record.fabric = input.name;
  if (names != nullptr) names->apply(input.name, record);
  if (kMeshes.contains(ending)) {
    const ShadowMesh mesh = read_shadow_mesh(input.file);
    if (mesh.own_specimen && !options.disc_stated)
      throw bad_input(
          "a sheet does not say over which disc it hangs", {.file = record.file},
          "give the disc's --disc-mm; drapes over other objects have no drape coefficient");
    require_geometry(mesh.disc_m, mesh.specimen_m, options.geometry, {.file = record.file});
    if (mesh.material_m.empty() && !mesh.flat_area_m2 && !mesh.specimen_m)
      require_surface(surface_m2(mesh), options.geometry, {.file = record.file});
    record.hem = shadow_of(mesh);
    record.own_specimen = mesh.own_specimen;
    record.kind = mesh.measured         ? HemKind::measured
                  : mesh.status.empty() ? HemKind::unknown
                                        : HemKind::simulated;
    if (mesh.spanned > 0)
      record.warnings.push_back(fmt::format(
          "{} marks inside the hem are missing, their neighbours span them", mesh.spanned));
    record.go = mesh.status.empty() || mesh.status == "at rest";
    if (!record.go) record.warnings.push_back("the simulation is not at rest: " + mesh.status);
    if (mesh.no_go) {
      record.go = false;
      record.warnings.push_back("what made or placed it is NO-GO: " + *mesh.no_go);
    }
    if (names == nullptr && !mesh.fabric.empty()) {
      record.fabric = mesh.fabric;
      record.repeat = input.name;
    }
    evaluate(record, {}, options);
  } else {
    read_picture(input.file, options, record);
  }
  return {std::move(record)};
}

/// Makes names unique by their folders, if only names distinguish fabrics.
void tell_apart(std::vector<Input>& files) {
  std::map<std::string, std::set<fs::path>> named;
  for (const Input& file : files) named[file.name].insert(file.file);
  for (Input& file : files)
    if (named[file.name].size() > 1) file.name = fs::path(file.file).replace_extension().string();
}

constexpr double kLeast_m = 1e-6;  // closer hems are copies

/// Refuses copies: of hems that are equal to the last bit only the first is kept.
void refuse_copies(HemSet& set) {
  std::map<std::vector<double>, std::string> seen;
  std::vector<HemRecord> kept;
  for (HemRecord& record : set.hems) {
    const auto [first, is_new] = seen.emplace(record.hem.radius_m, record.file);
    if (is_new)
      kept.push_back(std::move(record));
    else
      set.refused.push_back(fmt::format("{}: its hem is that of {}, a copy; give each drape once",
                                        record.file, first->second));
  }
  set.hems = std::move(kept);
}

}  // namespace

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
    const std::vector<double>& all = record.hem.radius_m;
    std::vector<double> kept;
    for (std::size_t i = 0; i < all.size(); i += all.size() / 72) kept.push_back(all[i]);
    return hem_of_radii(kept);
  };
  std::vector<Hem> known;
  for (const HemRecord& record : real.hems) known.push_back(as_stored(record));
  std::vector<HemRecord> kept;
  for (HemRecord& record : virtual_hems.hems) {
    const Hem own = as_stored(record);
    const auto same = std::find_if(known.begin(), known.end(), [&](const Hem& other) {
      return hem_distance_m(other, own) < kLeast_m;
    });
    if (same == known.end())
      kept.push_back(std::move(record));
    else
      virtual_hems.refused.push_back(
          fmt::format("{}: its hem is that of {}, a copy; name virtual drapes", record.file,
                      real.hems[same - known.begin()].file));
  }
  virtual_hems.hems = std::move(kept);
}

void refuse_other_kinds(HemSet& real, HemSet& virtual_hems) {
  const auto refuse = [](HemSet& set, HemKind kind, const char* why) {
    for (const HemRecord& record : set.hems)
      if (record.kind == kind) set.refused.push_back(record.file + why);
    std::erase_if(set.hems, [&](const HemRecord& record) { return record.kind == kind; });
  };
  refuse(real, HemKind::simulated,
         ": a simulation is no repeat of a real drape; give it after a --compare of its own");
  refuse(virtual_hems, HemKind::measured,
         ": a measured sheet is no virtual drape; give it without --compare");
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
    for (const HemRecord* a : repeats) {
      coefficients.push_back(a->drape_coefficient());
      distances.real_to_real.emplace_back();
      for (const HemRecord* b : repeats)
        distances.real_to_real.back().push_back(a == b ? 0 : hem_distance_m(a->hem, b->hem));
    }
    for (const HemRecord& candidate : virtual_hems) {
      HemMatch match;
      match.fabric = name.first;
      match.face = name.second;
      match.virtual_file = candidate.file;
      match.repeats = static_cast<int>(repeats.size());
      distances.virtual_to_real.clear();
      for (const HemRecord* a : repeats)
        distances.virtual_to_real.push_back(hem_distance_m(a->hem, candidate.hem));
      match.drape_coefficient = judge_value(coefficients, candidate.drape_coefficient(),
                                            options.priors.drape_coefficient, options.significance);
      match.hem =
          judge_distance(distances, options.priors.hem_score, kLeast_m, options.significance);
      match.p = joint_p({match.drape_coefficient, match.hem});
      const auto detectable = match.drape_coefficient.detectable;
      const double width = std::sqrt(repeats.front()->specimen_area_m2);
      if (!candidate.go)
        match.reason = candidate.warnings.back();
      else if (std::abs(std::sqrt(candidate.specimen_area_m2) - width) > kLengthTolerance * width)
        match.reason = fmt::format("its specimen has another flat area, {:.0f} and not {:.0f} mm2",
                                   candidate.specimen_area_m2 / (units::mm * units::mm),
                                   width * width / (units::mm * units::mm));
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

}  // namespace drape::compare
