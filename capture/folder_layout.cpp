// SPDX-License-Identifier: Apache-2.0
#include "capture/folder_layout.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <compare>
#include <iterator>
#include <map>
#include <set>
#include <system_error>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/inside.hpp"
#include "core/files/json_file.hpp"

namespace drape::capture {

namespace {

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// Takes the leading digits of `text`, without leading zeros.
std::string_view take_number(std::string_view& text) {
  const auto end = std::ranges::find_if_not(text, is_digit);
  std::string_view digits(text.begin(), end);
  text.remove_prefix(digits.size());
  digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
  return digits;
}

std::strong_ordering compare_naturally(std::string_view a, std::string_view b) {
  while (!a.empty() && !b.empty()) {
    if (is_digit(a.front()) && is_digit(b.front())) {
      const std::string_view number_a = take_number(a);
      const std::string_view number_b = take_number(b);
      if (const auto order = number_a.size() <=> number_b.size(); std::is_neq(order)) return order;
      if (const auto order = number_a <=> number_b; std::is_neq(order)) return order;
    } else {
      if (const auto order = a.front() <=> b.front(); std::is_neq(order)) return order;
      a.remove_prefix(1);
      b.remove_prefix(1);
    }
  }
  return a.size() <=> b.size();
}

namespace fs = std::filesystem;

bool is_image_name(const fs::path& file) {
  constexpr std::array endings = {".png", ".jpg", ".jpeg", ".tif", ".tiff"};
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::ranges::find(endings, ending) != endings.end();
}

bool is_hidden(const std::string& name) {
  return name.starts_with('.');
}

/// True for files that drapebench itself writes beside the sets.
bool is_own_file(const std::string& name) {
  return name == "recording.json" || name.ends_with(".run.json");
}

/// Names in a folder in natural order, so that results do not depend on the file system.
std::vector<std::string> names_in(const fs::path& folder) {
  std::error_code failed;
  std::vector<std::string> names;
  for (fs::directory_iterator it(folder, failed), end; !failed && it != end; it.increment(failed)) {
    names.push_back(it->path().filename().string());
  }
  if (failed) {
    throw bad_input(fmt::format("the folder cannot be read: {}", failed.message()),
                    {.file = folder.string()}, "give an existing folder that may be read");
  }
  std::ranges::sort(names, natural_less);
  return names;
}

/// Requires one image per camera; expects images sorted by camera.
void require_one_image_per_camera(const fs::path& folder, const FrameSet& set) {
  const auto twice = std::ranges::adjacent_find(
      set.frames, [](const auto& a, const auto& b) { return a.camera == b.camera; });
  if (twice == set.frames.end()) return;
  const RecordedFrame& other = *std::next(twice);
  throw bad_input(fmt::format("two images of one camera: {} and {}", twice->file, other.file),
                  {.file = (folder / other.file).string(), .camera = other.camera, .set = set.name},
                  "keep the one that belongs to the set");
}

FrameSet read_set(const fs::path& folder, const std::string& set,
                  std::vector<IgnoredFile>& ignored) {
  require_utf8_name(set, {.file = (folder / set).string()});
  FrameSet layout{set, {}};
  for (const std::string& name : names_in(folder / set)) {
    const fs::path path = folder / set / name;
    const std::string file = fmt::format("{}/{}", set, name);
    if (is_hidden(name) || name == "capture.json") continue;  // written by a capture
    require_target(path);
    if (!fs::is_regular_file(path) || !is_image_name(path)) {
      ignored.push_back({file, "not an image file (png, jpg, jpeg, tif, tiff)"});
      continue;
    }
    require_utf8_name(name, {.file = path.string()});  // recording.json will contain the name
    RecordedFrame& frame = layout.frames.emplace_back();
    frame.camera = path.stem().string();
    frame.file = file;
  }
  if (layout.frames.empty()) {
    throw bad_input("the set holds no image", {.file = (folder / set).string(), .set = set},
                    "put <camera>.png files into it, or remove the folder");
  }
  std::ranges::stable_sort(
      layout.frames, [](const auto& a, const auto& b) { return natural_less(a.camera, b.camera); });
  require_one_image_per_camera(folder, layout);
  return layout;
}

/// Reads pictures with set and camera from their folders and names.
FolderLayout read_placed(const fs::path& folder, PictureLayout form) {
  FolderLayout layout;
  const auto order = [](const std::string& a, const std::string& b) { return natural_less(a, b); };
  std::map<std::string, FrameSet, decltype(order)> sets(order);
  for (const PlacedPicture& one : placed_pictures(folder, form)) {
    for (const std::string& name : {one.set, one.camera})
      require_utf8_name(name, {.file = one.file.string()});
    FrameSet& set = sets.try_emplace(one.set, FrameSet{one.set, {}}).first->second;
    RecordedFrame& frame = set.frames.emplace_back();
    frame.camera = one.camera;
    frame.file = fmt::format("{}/{}{}", one.set, one.camera, one.file.extension().string());
    layout.places[frame.file] = one.file;
  }
  for (auto& [name, set] : sets) {
    std::ranges::stable_sort(
        set.frames, [](const auto& a, const auto& b) { return natural_less(a.camera, b.camera); });
    layout.sets.push_back(std::move(set));
  }
  if (layout.sets.empty())
    throw bad_input("the folder holds no image of this layout", {.file = folder.string()},
                    "give another --layout");
  return layout;
}

/// Proposes the layout that fits folders and names; empty for that of sets.
std::string proposal(const fs::path& folder) {
  const PictureLayout found = layout_found(folder);
  if (found == PictureLayout::sets) return {};
  try {
    const FolderLayout layout = read_placed(folder, found);
    const std::vector<std::string> cameras = require_same_cameras(folder, layout);
    const std::string first = layout.sets.front().name, last = layout.sets.back().name;
    return fmt::format("the names show {} set{} ({}) of the cameras {}: add `--layout {}`; or ",
                       layout.sets.size(), first == last ? "" : "s",
                       first == last ? first : first + " to " + last, fmt::join(cameras, ", "),
                       name_of(found));
  } catch (const Error&) {  // no layout fits these names
    return {};
  }
}

}  // namespace

bool natural_less(std::string_view a, std::string_view b) {
  const std::strong_ordering order = compare_naturally(a, b);
  return std::is_eq(order) ? a < b : std::is_lt(order);
}

void require_utf8_name(const std::string& name, const Where& where) {
  require_plain_name(name, where);
  try {
    static_cast<void>(Json(name).dump());
  } catch (const Json::exception&) {
    throw bad_input(fmt::format("`{}` is not UTF-8", printable(name)), where, "rename it");
  }
}

FolderLayout read_layout(const fs::path& folder, PictureLayout form) {
  if (form != PictureLayout::sets) return read_placed(folder, form);
  FolderLayout layout;
  for (const std::string& name : names_in(folder)) {
    if (is_hidden(name) || is_own_file(name)) continue;
    if (fs::is_directory(folder / name)) {
      layout.sets.push_back(read_set(folder, name, layout.ignored));
    } else {
      layout.ignored.push_back({name, "not inside a set folder"});
    }
  }
  if (layout.sets.empty()) {
    throw bad_input(
        "the folder holds no set of images", {.file = folder.string()},
        proposal(folder) + "arrange the images as FOLDER/<set>/<camera>.png, one folder per set");
  }
  return layout;
}

std::vector<std::string> image_files_below(const fs::path& folder) {
  std::vector<std::string> files;
  for (const std::string& set : names_in(folder)) {
    if (is_hidden(set) || !fs::is_directory(folder / set)) continue;
    for (const std::string& name : names_in(folder / set)) {
      if (!is_hidden(name) && is_image_name(name)) files.push_back(fmt::format("{}/{}", set, name));
    }
  }
  return files;
}

std::vector<std::string> require_same_cameras(const fs::path& folder, const FolderLayout& layout,
                                              std::vector<std::string>* missing) {
  const auto order = [](const std::string& a, const std::string& b) { return natural_less(a, b); };
  std::set<std::string, decltype(order)> cameras(order);
  for (const FrameSet& set : layout.sets)
    for (const RecordedFrame& frame : set.frames) cameras.insert(frame.camera);
  for (const FrameSet& set : layout.sets) {
    for (const std::string& camera : cameras) {
      if (std::ranges::any_of(set.frames,
                              [&](const RecordedFrame& frame) { return frame.camera == camera; }))
        continue;
      if (missing != nullptr) {
        missing->push_back(fmt::format("set {} has no image of camera {}", set.name, camera));
        continue;
      }
      throw bad_input(
          fmt::format("set `{}` has no image of camera `{}`, which other sets have", set.name,
                      camera),
          {.file = (folder / set.name).string(), .camera = camera, .set = set.name},
          fmt::format("{}every set must hold the cameras {}",
                      layout.places.empty() ? proposal(folder) : "", fmt::join(cameras, ", ")));
    }
  }
  return {cameras.begin(), cameras.end()};
}

}  // namespace drape::capture
