// SPDX-License-Identifier: Apache-2.0
// Tells whether a step's inputs still have the content that its record lists.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "console/bench.hpp"
#include "core/program/run_record.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;

/// Links to folders followed, as `drape run` spells its files; the file's own name stays.
fs::path one_name(const fs::path& file) {
  const fs::path whole = fs::absolute(file).lexically_normal();
  std::error_code unreachable;
  return fs::weakly_canonical(whole.parent_path(), unreachable) / whole.filename();
}

bool is_below(const fs::path& file, const fs::path& folder) {
  const fs::path from = file.lexically_relative(folder);
  return !from.empty() && *from.begin() != "..";
}

/// Heights are written in mm and read back.
constexpr double kSameHeight_m = 1e-11;

bool is_same_file(const fs::path& a, const fs::path& b) {
  return a.empty() || b.empty() ? a.empty() == b.empty() : one_name(a) == one_name(b);
}

/// In what a rig that was made from a part of another differs from that one as it is now.
std::optional<std::string> rig_difference(const Rig& made, const Rig& now) {
  for (const TargetStage& stage : made.stages) {
    const auto found = std::find_if(now.stages.begin(), now.stages.end(),
                                    [&](const TargetStage& one) { return one.set == stage.set; });
    if (found == now.stages.end() || std::abs(found->z_m - stage.z_m) > kSameHeight_m)
      return fmt::format("z_mm of `{}`", stage.set);
  }
  for (const std::string& pose : made.free_poses)
    if (std::find(now.free_poses.begin(), now.free_poses.end(), pose) == now.free_poses.end())
      return fmt::format("`{}` is no free pose", pose);
  if (made.estimate_scale_x != now.estimate_scale_x) return "estimate_scale_x";
  if (!is_same_file(made.target_file, now.target_file)) return "target";
  if (!made.print_file.empty() && !is_same_file(made.print_file, now.print_file)) return "print";
  const auto is_same = [](const RigCamera& a, const RigCamera& b) {
    return a.name == b.name && a.width_px == b.width_px && a.height_px == b.height_px &&
           std::abs(a.pixel_pitch_x_m - b.pixel_pitch_x_m) < 1e-9 * a.pixel_pitch_x_m &&
           std::abs(a.pixel_pitch_y_m - b.pixel_pitch_y_m) < 1e-9 * a.pixel_pitch_y_m;
  };
  if (!std::equal(made.cameras.begin(), made.cameras.end(), now.cameras.begin(), now.cameras.end(),
                  is_same))
    return "camera";
  return std::nullopt;
}

}  // namespace

Bench::Inputs Bench::read_inputs(const fs::path& record) {
  const fs::path folder = fs::weakly_canonical(fs::absolute(record).parent_path());
  Inputs inputs;
  for (const RecordedFile& input : read_run_file(record).inputs)
    inputs[one_name(folder / input.file)] =
        input.sets.empty() ? input.values_sha256.value_or(input.sha256) : input.sha256;
  return inputs;
}

/// As people know it: from the rig's folder where it lies there, else with its own folder.
std::string Bench::shown(const fs::path& file) const {
  const fs::path folder = one_name(rig_.file).parent_path();
  return (is_below(file, folder) ? file.lexically_relative(folder)
                                 : file.parent_path().filename() / file.filename())
      .generic_string();
}

bool Bench::is_made_of(const fs::path& output, const fs::path& input) const {
  const auto inputs = inputs_of(output);
  const auto content = content_of(input);
  if (!inputs || !content) return false;
  const auto found = inputs->find(one_name(input));
  return found != inputs->end() && found->second == *content;
}

bool Bench::is_listed(const fs::path& output, const fs::path& input) const {
  const auto inputs = inputs_of(output);
  return inputs && inputs->contains(one_name(input));
}

std::optional<std::string> Bench::against_input(const fs::path& input,
                                                const std::string& sha256) const {
  const auto content = content_of(input);
  if (!content) return fmt::format("`{}` is gone", shown(input));
  if (*content != sha256) return fmt::format("`{}` was edited since", shown(input));
  if (input == one_name(own_ / "acceptance.json")) {  // a copy of the rig's
    const fs::path source = rig_.file.parent_path() / "acceptance.json";
    const auto now = content_of(source);
    if (!now || *now != sha256) return "`acceptance.json` was edited since";
  }
  for (const fs::path& made : {rig_file(), calibration_rig_file(), out_ / "rig.toml"}) {
    if (input != one_name(made) || input == one_name(rig_.file)) continue;
    const auto then = rig_in(made), now = rig_in(rig_.file);
    const auto what = then && now ? rig_difference(*then, *now) : "it cannot be read";
    if (what) return fmt::format("`{}` was edited since: {}", shown(one_name(rig_.file)), *what);
  }
  return std::nullopt;
}

std::optional<std::string> Bench::against_inputs(const fs::path& output) const {
  const auto inputs = inputs_of(output);
  if (!inputs) return fmt::format("`{}` is not finished", shown(one_name(output)));
  // It grows with every set; the pictures of this one stand in the list themselves.
  const fs::path manifest = one_name(recording_folder_ / "recording.json");
  for (const auto& [file, sha256] : *inputs)
    if (file != manifest)
      if (auto why = against_input(file, sha256)) return why;
  return std::nullopt;
}

/// A picture may be replaced after its marks were measured, or a link lead elsewhere since.
std::optional<std::string> Bench::against_pictures(const std::string& set) const {
  if (const auto recorded = recorded_set(set))
    for (const RecordedFrame& frame : recorded->frames) {
      const auto content = content_of(recording_folder_ / frame.file);
      if (!content || *content != frame.sha256)
        return fmt::format("the picture `{}` is not as recorded", frame.file);
    }
  return std::nullopt;
}

/// Looks through all inputs of the report and theirs: simulations, their fabric, scene and print.
std::optional<std::string> Bench::against_report(const Drape& drape) const {
  const fs::path folder = one_name(out_ / "report.html").parent_path();
  const fs::path own = folder / drape.scene.name;
  const auto inputs = inputs_of(report());
  if (!inputs) return "the report is not finished";
  std::map<fs::path, bool> looked_at;
  const auto against = [&](const fs::path& file, const std::string& sha256,
                           const auto& again) -> std::optional<std::string> {
    if (auto why = against_input(file, sha256)) return why;
    if (!is_below(file, own) || !looked_at.emplace(file, true).second) return std::nullopt;
    if (const auto of_it = inputs_of(file))
      for (const auto& [input, content] : *of_it)
        if (input != one_name(recording_folder_ / "recording.json"))
          if (auto why = again(input, content, again)) return why;
    return std::nullopt;
  };
  bool any = false;
  for (const auto& input : *inputs) {
    const fs::path& file = input.first;
    any = any || is_below(file, own);
    const bool of_another = std::any_of(drapes_.begin(), drapes_.end(), [&](const Drape& other) {
      return &other != &drape &&
             (is_below(file, folder / other.scene.name) || file == one_name(other.scene.file));
    });
    if (of_another) continue;
    if (auto why = against(file, input.second, against)) return why;
  }
  if (!any) return "the last report is not of this drape";
  return std::nullopt;
}

/// First of the files that were edited since the console started.
std::optional<std::string> Bench::edited_since_start() const {
  for (const auto& [file, sha256] : read_at_start_) {
    const auto now = content_of(file);
    if (!now || *now != sha256) return file.string();
  }
  return std::nullopt;
}

void Bench::require_as_read() const {
  if (const auto file = edited_since_start())
    throw bad_input("the file was edited since the console started, which still has the old one",
                    {.file = *file}, "end the console and start it again");
}

}  // namespace drape::console
