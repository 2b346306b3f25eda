// SPDX-License-Identifier: Apache-2.0
#include "core/files/picture_layout.hpp"

#include <algorithm>
#include <cctype>
#include <set>

#include "core/files/files.hpp"
#include "core/matching.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

bool is_digit(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

/// Date and time in a name as written by cameras: "2018-09-17__16-38-56", "20180917_163856789".
const std::regex& time_in_name() {
  static const std::regex kTime(
      "((?:19|20)[0-9]{2})([-_.]?)(0[1-9]|1[0-2])\\2(0[1-9]|[12][0-9]|3[01])[-_. T]*"
      "([01][0-9]|2[0-3])([-_.hH:]?)([0-5][0-9])[-_.mM:]?([0-5][0-9][0-9]{0,6})");
  return kTime;
}

/// Joins each date and time in a name to one number.
std::string with_joined_time(const std::string& name) {
  return std::regex_replace(name, time_in_name(), "$1$3$4$5$7$8");
}

std::string without_time(const std::string& name) {
  return std::regex_replace(name, time_in_name(), "");
}

/// Digits of a number without leading zeros.
std::string digits_of(const std::string& number) {
  return number.substr(std::min(number.find_first_not_of('0'), number.size() - 1));
}

/// Splits a name into text (maybe empty) and numbers in turn; numbers are at odd indices.
std::vector<std::string> parts_of(const std::string& name) {
  std::vector<std::string> parts(1);
  for (const char c : name) {
    if (is_digit(c) != (parts.size() % 2 == 0)) parts.emplace_back();
    parts.back() += c;
  }
  return parts;
}

bool is_separator(char c) {
  return c == '-' || c == '_' || c == '.' || c == ' ';
}

/// Joins the text around the number, with one separator if two would meet.
std::string joined(std::string before, std::string after) {
  while (!before.empty() && is_separator(before.back())) before.pop_back();
  const std::size_t skip =
      std::find_if_not(after.begin(), after.end(), is_separator) - after.begin();
  const std::string separator = skip > 0 && !before.empty() && skip < after.size() ? "_" : "";
  return before + separator + after.substr(skip);
}

PictureName split_at(const std::vector<std::string>& parts, std::size_t number) {
  std::string before, after;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (i < number) before += parts[i];
    if (i > number) after += parts[i];
  }
  return {joined(before, after), parts[number]};
}

bool is_number(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), is_digit);
}

std::vector<fs::path> folders_in(const fs::path& folder) {
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_directory() && !entry.path().filename().string().starts_with('.'))
      folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  return folders;
}

/// Pictures in a folder, sorted by name; a link keeps its own name, not that of its target.
std::vector<fs::path> pictures_in(const fs::path& folder) {
  std::vector<fs::path> pictures;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!is_picture_name(entry.path().filename().string())) continue;
    require_target(entry.path());
    if (entry.is_regular_file()) pictures.push_back(entry.path());
  }
  std::sort(pictures.begin(), pictures.end());
  return pictures;
}

std::vector<std::string> stems_of(const std::vector<fs::path>& pictures) {
  std::vector<std::string> stems;
  for (const fs::path& picture : pictures) stems.push_back(picture.stem().string());
  return stems;
}

/// Name of a set: a number alone numbers a view.
std::string set_named(const std::string& name) {
  return is_number(name) ? "view_" + name : name;
}

/// Makes equal numbers equal texts, sorted like the numbers.
void pad_views(std::vector<PictureName>& names) {
  std::size_t widest = 0, narrowest = 0;
  for (const PictureName& name : names) {
    if (!is_number(name.view)) continue;
    widest = std::max(widest, digits_of(name.view).size());
    narrowest = narrowest == 0 ? name.view.size() : std::min(narrowest, name.view.size());
  }
  const std::size_t width = std::max(widest, narrowest);
  for (PictureName& name : names) {
    if (!is_number(name.view)) continue;
    const std::string digits = digits_of(name.view);
    name.view = std::string(width - digits.size(), '0') + digits;
  }
}

std::vector<PlacedPicture> by_folder(const fs::path& folder) {
  std::vector<PlacedPicture> sets;
  std::vector<PictureName> views;
  bool one_series = true;  // in each folder
  for (const fs::path& camera : folders_in(folder)) {
    const std::vector<fs::path> pictures = pictures_in(camera);
    const std::vector<std::string> stems = stems_of(pictures);
    const std::vector<PictureName> names = read_picture_names(stems);
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      one_series = one_series && names[i].camera == names[0].camera;
      views.push_back(names[i]);
      sets.push_back({set_named(stems[i]), camera.filename(), pictures[i]});
    }
  }
  pad_views(views);  // other cameras may count with other widths
  for (std::size_t i = 0; one_series && i < sets.size(); ++i) sets[i].set = "view_" + views[i].view;
  return sets;
}

/// Number of cameras that each have every set; nullopt if one lacks a set or has it twice.
std::optional<std::size_t> complete_cameras(const std::vector<PlacedPicture>& pictures) {
  std::set<std::string> sets, cameras;
  std::set<std::pair<std::string, std::string>> both;
  for (const PlacedPicture& one : pictures) {
    sets.insert(one.set);
    cameras.insert(one.camera);
    both.emplace(one.set, one.camera);
  }
  if (both.size() != pictures.size() || both.size() != sets.size() * cameras.size())
    return std::nullopt;
  return cameras.size();
}

std::vector<PlacedPicture> by_name(const fs::path& folder) {
  const std::vector<fs::path> pictures = pictures_in(folder);
  const std::vector<std::string> stems = stems_of(pictures);
  const std::vector<PictureName> names = read_picture_names(stems);
  std::vector<PlacedPicture> best;
  for (std::size_t i = 0; i < pictures.size(); ++i)
    // A picture without a number is not part of a series.
    if (stems[i].find_first_of("0123456789") != std::string::npos)
      best.push_back({"view_" + names[i].view, names[i].camera.empty() ? "camera" : names[i].camera,
                      pictures[i]});
  for (const bool is_last : {true, false}) {
    std::vector<PlacedPicture> words;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      const std::size_t at =
          is_last ? stems[i].find_last_of("-_. ") : stems[i].find_first_of("-_. ");
      if (at == std::string::npos || at == 0 || at + 1 == stems[i].size()) break;
      const std::string before = stems[i].substr(0, at), after = stems[i].substr(at + 1);
      words.push_back({set_named(is_last ? before : after), is_last ? after : before, pictures[i]});
    }
    if (words.empty() || words.size() < pictures.size()) continue;
    const auto cameras = complete_cameras(words), before = complete_cameras(best);
    const bool is_bench = cameras && *cameras > 1 && *cameras * *cameras < words.size();
    if (is_bench && (best.size() < words.size() || !before || *before == 1 || *before > *cameras))
      best = words;
  }
  return best;
}

}  // namespace

bool is_picture_name(const std::string& name) {
  static const std::regex kEnding("\\.(png|jpg|jpeg|tif|tiff)", std::regex::icase);
  return !name.starts_with('.') && has_form(fs::path(name).extension().string(), kEnding);
}

std::vector<PictureName> read_picture_names(const std::vector<std::string>& given) {
  // Times are ignored if the names differ without them.
  std::vector<std::string> names;
  std::transform(given.begin(), given.end(), std::back_inserter(names), without_time);
  if (std::set<std::string>(names.begin(), names.end()).size() < names.size())
    std::transform(given.begin(), given.end(), names.begin(), with_joined_time);
  std::vector<std::vector<std::string>> all;
  std::set<std::size_t> numbers;
  for (const std::string& name : names) {
    all.push_back(parts_of(name));
    numbers.insert(all.back().size() / 2);
  }
  std::size_t view = 0, most = 0;
  for (std::size_t place = 1; numbers.size() == 1 && place < 2 * *numbers.begin(); place += 2) {
    std::set<std::string> values;
    for (const std::vector<std::string>& parts : all) values.insert(digits_of(parts[place]));
    if (values.size() < most) continue;
    most = values.size();
    view = place;
  }
  std::vector<PictureName> result;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::size_t last = all[i].size() / 2 * 2;  // index after the last number
    if (last == 0) {
      result.push_back({"", names[i]});
    } else {
      result.push_back(split_at(all[i], view > 0 ? view : last - 1));
    }
  }
  pad_views(result);
  return result;
}

PictureLayout layout_found(const fs::path& folder) {
  const std::vector<fs::path> folders = folders_in(folder);
  if (folders.empty() || !pictures_in(folder).empty()) return PictureLayout::names;
  const bool are_cameras = std::any_of(folders.begin(), folders.end(), [&](const fs::path& one) {
    return pictures_in(one).size() > folders.size();
  });
  return are_cameras ? PictureLayout::cameras : PictureLayout::sets;
}

std::vector<PlacedPicture> placed_pictures(const fs::path& folder, PictureLayout layout) {
  std::vector<PlacedPicture> pictures =
      layout == PictureLayout::cameras ? by_folder(folder) : by_name(folder);
  std::set<std::pair<std::string, std::string>> seen;
  for (const PlacedPicture& one : pictures)
    if (!seen.emplace(one.set, one.camera).second)
      throw bad_input("two images of one camera and view",
                      {.file = one.file.string(), .camera = one.camera, .set = one.set},
                      "keep one of them");
  return pictures;
}

}  // namespace drape
