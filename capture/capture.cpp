// SPDX-License-Identifier: Apache-2.0
#include "capture/capture.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <algorithm>
#include <compare>
#include <iterator>
#include <set>
#include <system_error>

#include "capture/recording/record.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/pictures/picture.hpp"
#include "core/program/run_record.hpp"

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

/// Names in a folder without the hidden ones, in natural order, so that results do not depend on
/// the file system.
std::vector<std::string> names_in(const fs::path& folder) {
  std::error_code failed;
  std::vector<std::string> names;
  for (fs::directory_iterator it(folder, failed), end; !failed && it != end; it.increment(failed))
    if (const std::string name = it->path().filename().string(); !name.starts_with('.'))
      names.push_back(name);
  if (failed) {
    throw bad_input(fmt::format("the folder cannot be read: {}", failed.message()),
                    {.file = folder.string()}, "give an existing folder that may be read");
  }
  std::ranges::sort(names, natural_less);
  return names;
}

/// Requires one image per camera; expects images sorted by camera.
void require_one_image_per_camera(const fs::path& folder, const FrameSet& set) {
  const auto twice = std::ranges::adjacent_find(set.frames, {}, &RecordedFrame::camera);
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
    if (name == "capture.json") continue;  // written by a capture
    require_target(path);
    if (!fs::is_regular_file(path) || !is_picture_name(name)) {
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
  std::ranges::stable_sort(layout.frames, natural_less, &RecordedFrame::camera);
  require_one_image_per_camera(folder, layout);
  return layout;
}

/// Reads pictures with set and camera from their folders and names.
FolderLayout read_placed(const fs::path& folder, PictureLayout form) {
  FolderLayout layout;
  std::map<std::string, FrameSet, decltype(&natural_less)> sets(natural_less);
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
    std::ranges::stable_sort(set.frames, natural_less, &RecordedFrame::camera);
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
    if (name == "recording.json" || name.ends_with(".run.json"))
      continue;  // written beside the sets
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
    if (!fs::is_directory(folder / set)) continue;
    for (const std::string& name : names_in(folder / set))
      if (is_picture_name(name)) files.push_back(fmt::format("{}/{}", set, name));
  }
  return files;
}

std::vector<std::string> require_same_cameras(const fs::path& folder, const FolderLayout& layout,
                                              std::vector<std::string>* missing) {
  std::set<std::string, decltype(&natural_less)> cameras(natural_less);
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

namespace {

/// Original picture behind a link.
fs::path original_of(const fs::path& file) {
  return fs::is_symlink(file) ? file.parent_path() / fs::read_symlink(file) : file;
}

/// One picture of the folder.
struct Picture {
  const FrameSet* set;
  RecordedFrame* frame;
  fs::path file;
  std::uintmax_t bytes = 0;
  int orientation = 1;

  [[nodiscard]] Where where() const {
    return {.file = original_of(file).string(), .camera = frame->camera, .set = set->name};
  }
};

void check_one(Picture& picture) {
  const std::vector<unsigned char> bytes = read_bytes(picture.file);
  const ImageSize size = check_image(bytes, picture.where());
  picture.bytes = bytes.size();
  picture.orientation = orientation_of(bytes);
  picture.frame->sha256 = sha256_of(bytes);
  picture.frame->width_px = size.width_px;
  picture.frame->height_px = size.height_px;
}

/// Requires one image size per camera: another size means another camera or a resized image.
void require_same_sizes(const std::vector<Picture>& pictures) {
  std::map<std::string, const Picture*> first_of;
  for (const Picture& picture : pictures) {
    const RecordedFrame& frame = *picture.frame;
    const Picture& other = *first_of.try_emplace(frame.camera, &picture).first->second;
    const int width = other.frame->width_px, height = other.frame->height_px;
    if (frame.width_px == width && frame.height_px == height) continue;
    throw bad_input(
        fmt::format("the image is {} x {} px, but camera `{}` has {} x {} px in set `{}`",
                    frame.width_px, frame.height_px, frame.camera, width, height, other.set->name),
        picture.where(),
        frame.width_px == height && frame.height_px == width
            ? "this image was saved turned by a quarter turn (its EXIF orientation applied): put "
              "back the camera's original image"
            : "put back the camera's original image");
  }
}

void warn_of_same_bytes(const fs::path& folder, const std::vector<Picture>& pictures,
                        std::vector<std::string>& warnings) {
  const auto name_of = [&](const Picture& picture) {
    return picture.file == folder / picture.frame->file && !fs::is_symlink(picture.file)
               ? picture.frame->file
               : original_of(picture.file).string();
  };
  std::map<std::string, const Picture*> first_of;
  for (const Picture& picture : pictures) {
    const auto [first, is_new] = first_of.try_emplace(picture.frame->sha256, &picture);
    if (!is_new)
      warnings.push_back(fmt::format("{} and {} are the same image; was one copied by mistake?",
                                     name_of(*first->second), name_of(picture)));
  }
}

void warn_of_turns(const std::vector<Picture>& pictures, std::vector<std::string>& warnings) {
  const auto turned = [](const Picture& picture) { return picture.orientation != 1; };
  const auto first = std::ranges::find_if(pictures, turned);
  if (first == pictures.end()) return;
  warnings.push_back(
      fmt::format("{} pictures, {} first, have an orientation tag that asks for a turn or a mirror "
                  "image; their "
                  "pixels are taken as the sensor wrote them",
                  std::ranges::count_if(pictures, turned), first->frame->file));
}

std::optional<Recording> recording_in(const fs::path& folder) {
  if (!fs::exists(folder / "recording.json")) return std::nullopt;
  return read_recording(folder);
}

/// Refuses changed images: importing again may add sets but not replace an image.
void require_nothing_replaced(const Recording& existing, const std::vector<Picture>& pictures) {
  std::map<std::string, std::string> sha256_of_file;
  for (const Picture& picture : pictures)
    sha256_of_file[picture.frame->file] = picture.frame->sha256;
  for (const FrameSet& set : existing.sets) {
    for (const RecordedFrame& frame : set.frames) {
      const auto found = sha256_of_file.find(frame.file);
      if (found != sha256_of_file.end() && found->second == frame.sha256) continue;
      throw bad_input(
          found == sha256_of_file.end()
              ? "the image is in the existing recording, but not in the imported folder"
              : "the image differs from the one in the existing recording",
          {.file = (existing.folder / frame.file).string(),
           .camera = frame.camera,
           .set = set.name},
          "import into a new folder; to give up the old recording, delete its recording.json");
    }
  }
}

/// Refuses to replace a picture or a set's notes by other content; true if the file is there.
bool is_there(const fs::path& file, const std::string& sha256, const std::string& set) {
  if (!fs::exists(file)) return false;
  if (sha256_of_file(file) != sha256)
    throw bad_input("another file of this name is already there",
                    {.file = file.string(), .set = set}, "import into a new or empty folder");
  return true;
}

void copy_one(const fs::path& recording_folder, const Picture& picture) {
  const std::vector<unsigned char> bytes = read_bytes(picture.file);
  if (sha256_of(bytes) != picture.frame->sha256)
    throw bad_input("the image changed while it was imported", picture.where(),
                    "stop whatever writes to it, then import again");
  write_inside(recording_folder, picture.frame->file, as_text(bytes), picture.where());
}

/// Notes that a capture left in the folder of a set.
struct Details : SetNotes {
  std::string bytes, sha256;
};

/// Reads the capture's notes of a set; empty if the file comes from another program.
std::optional<Details> details_in(const fs::path& folder, const std::string& set) {
  const fs::path file = folder / set / "capture.json";
  if (!fs::is_regular_file(file)) return std::nullopt;
  const std::string bytes = read_text(file);
  std::optional<Document> document;
  try {
    document.emplace(file, Syntax::json, bytes);
  } catch (const Error&) {
    throw bad_input("the file is damaged, so that nobody knows whether the set is a measurement",
                    {.file = file.string(), .set = set},
                    "bring it back from where the set was copied, or record the set again");
  }
  const auto* format = document->root().find_as<std::string>("schema");
  if (format == nullptr || !format->starts_with("drapebench/capture/")) return std::nullopt;
  Details details{read_record<SetNotes>(*document), bytes, document->sha256()};
  if (!details.no_go && details.cloth == "moved")
    details.no_go = details.motion_px
                        ? fmt::format("the cloth moved by {:.2f} px or more during the burst",
                                      *details.motion_px)
                        : "the cloth moved farther than can be followed during the burst";
  return details;
}

/// Name of a set's burst: `drape_A` for `drape_A_000` to `drape_A_012`; empty for a single set.
std::string burst_of(const std::string& set) {
  constexpr std::size_t kNumber = 4;  // length of "_000"
  if (set.size() <= kNumber || set[set.size() - kNumber] != '_') return {};
  const std::string number = set.substr(set.size() - kNumber + 1);
  const bool counts = std::ranges::all_of(number, [](char c) { return c >= '0' && c <= '9'; });
  return counts ? set.substr(0, set.size() - kNumber) : "";
}

/// Notes by set name. They are written as the sets of a burst arrive, so a verdict that ended the
/// burst applies to all of them.
std::map<std::string, Details> all_details(const fs::path& folder, const FolderLayout& layout) {
  std::map<std::string, Details> all;
  std::map<std::string, std::string> moved;  ///< reason of a NO-GO for motion, by burst
  for (const FrameSet& set : layout.sets)
    if (auto details = details_in(folder, set.name)) {
      if (details->no_go) moved[burst_of(details->set)] = *details->no_go;
      all.emplace(set.name, std::move(*details));
    }
  for (auto& [set, details] : all)
    if (const std::string burst = burst_of(details.set); !details.no_go && moved.contains(burst))
      if (!burst.empty()) details.no_go = moved.at(burst);
  return all;
}

/// Copies notes into a set. A manifest knows more: the whole burst, and later verdicts.
void note(const Details& details, FrameSet& set) {
  set.details_sha256 = details.sha256;
  set.motion_px = details.motion_px;
  set.camera_shift_px = details.camera_shift_px;
  set.no_go = details.no_go;
}

bool is_same_folder(const fs::path& a, const fs::path& b) {
  std::error_code not_there;
  return fs::equivalent(a, b, not_there) && !not_there;
}

void require_not_inside(const fs::path& folder, const fs::path& recording_folder) {
  const fs::path outer = fs::weakly_canonical(folder);
  const fs::path inner = fs::weakly_canonical(recording_folder);
  const auto [end_of_outer, unused] =
      std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end());
  if (end_of_outer != outer.end()) return;
  throw usage_error(
      fmt::format("the recording {} would lie inside the imported folder", inner.string()),
      "give a folder outside, or the imported folder itself to add only the manifest");
}

/// Restores the notes of a set's pictures: why one of them is no valid measurement, the times of
/// its frames and, if all come from one set, that set's motion. The details are a separate file.
/// Returns true if all pictures come from one set.
bool keep_notes(const FrameSet& before, bool in_place, FrameSet& set) {
  bool all = true;
  for (RecordedFrame& frame : set.frames) {
    bool known = false;
    for (const RecordedFrame& old : before.frames) {
      if (old.sha256 != frame.sha256) continue;
      if (!set.no_go) set.no_go = before.no_go;
      if (old.camera != frame.camera) continue;
      frame.device_time_s = old.device_time_s;
      known = true;
    }
    all = all && known;
  }
  if (!all) return false;
  if (before.motion_px) set.motion_px = before.motion_px;
  if (before.camera_shift_px) set.camera_shift_px = before.camera_shift_px;
  if (in_place && before.details_sha256) set.details_sha256 = before.details_sha256;
  return true;
}

/// Restores notes for each set; a folder may have been renamed or gained a picture since.
void keep_notes_of(const Recording& before, bool in_place, Recording& recording) {
  if (in_place) recording.source = before.source;
  if (!recording.recorded_on) recording.recorded_on = before.recorded_on;
  for (FrameSet& set : recording.sets) {
    const auto same = std::ranges::find(before.sets, set.name, &FrameSet::name);
    if (same != before.sets.end() && keep_notes(*same, in_place, set)) continue;
    for (const FrameSet& old : before.sets) keep_notes(old, false, set);
  }
}

struct Item {
  const FrameSet* set;
  const RecordedFrame* frame;
  std::optional<RecordingFault> fault;
};

/// Checks the details stored with a live set: times, settings, ledger, stillness.
std::optional<RecordingFault> details_fault(const Recording& recording, const FrameSet& set) {
  if (!set.details_sha256) return std::nullopt;
  const std::string file = set.name + "/capture.json";
  if (!std::filesystem::exists(recording.folder / file))
    return RecordingFault{set.name, "", file, "the details of the set are missing"};
  if (sha256_of_file(recording.folder / file) == *set.details_sha256) return std::nullopt;
  return RecordingFault{set.name, "", file, "the details of the set were altered"};
}

}  // namespace

void require_importable(const fs::path& folder, const fs::path& recording_folder,
                        PictureLayout layout) {
  static_cast<void>(read_layout(folder, layout));
  if (!is_same_folder(folder, recording_folder))
    return require_not_inside(folder, recording_folder);
  if (layout != PictureLayout::sets)
    throw usage_error("a recording has its pictures in the layout `sets`",
                      "give another folder with --out, into which they are copied");
}

ImportResult import_folder(const fs::path& folder, const fs::path& recording_folder,
                           const CaptureOptions& options) {
  options.check();
  ImportReport report;
  report.in_place = is_same_folder(folder, recording_folder);
  require_importable(folder, recording_folder, options.layout);
  FolderLayout layout = read_layout(folder, options.layout);
  report.cameras =
      require_same_cameras(folder, layout, options.allow_missing ? &report.warnings : nullptr);
  report.ignored = layout.ignored;
  if (options.layout == PictureLayout::sets && layout.sets.size() > 1 &&
      report.cameras.size() > layout.sets.size())
    report.advice.push_back(fmt::format(
        "{} sets of {} cameras: if the folders are cameras and the pictures in them sets, import "
        "into a new folder with --layout cameras",
        layout.sets.size(), report.cameras.size()));
  const std::map<std::string, Details> noted = all_details(folder, layout);
  std::vector<Picture> pictures;
  for (FrameSet& set : layout.sets) {
    const std::string file = set.name + "/capture.json";
    if (fs::exists(folder / file) && !noted.contains(set.name))
      report.ignored.push_back({file, "not of a capture"});
    for (RecordedFrame& frame : set.frames)
      pictures.push_back({&set, &frame, layout.place(folder, frame.file)});
  }
  const auto check = [&](std::size_t i) {
    check_one(pictures[i]);
    return pictures[i].frame->file;
  };
  parallel_for(pictures.size(), options.threads, check, options.progress);
  require_same_sizes(pictures);
  // Reads both manifests, either of which may be invalid, before writing anything.
  const auto existing = recording_in(recording_folder);
  const auto source = report.in_place ? std::nullopt : recording_in(folder);
  if (existing) require_nothing_replaced(*existing, pictures);
  report.images = pictures.size();
  for (const Picture& picture : pictures) {
    report.image_bytes += picture.bytes;
    report.read.emplace_back(picture.file, picture.frame->sha256);
  }
  warn_of_turns(pictures, report.warnings);
  warn_of_same_bytes(folder, pictures, report.warnings);

  if (!report.in_place) {
    for (const auto& [set, details] : noted)
      is_there(recording_folder / set / "capture.json", details.sha256, set);
    std::vector<const Picture*> to_copy;
    for (const Picture& picture : pictures)
      if (!is_there(recording_folder / picture.frame->file, picture.frame->sha256,
                    picture.set->name))
        to_copy.push_back(&picture);
    for (const Picture* picture : to_copy) copy_one(recording_folder, *picture);
    for (const auto& [set, details] : noted)
      write_inside(recording_folder, set + "/capture.json", details.bytes, {.set = set});
  }
  Recording recording{recording_folder, "import", options.recorded_on, std::move(layout.sets)};
  for (FrameSet& set : recording.sets)
    if (const auto found = noted.find(set.name); found != noted.end()) note(found->second, set);
  if (source) keep_notes_of(*source, false, recording);
  if (existing) keep_notes_of(*existing, true, recording);
  for (const FrameSet& set : recording.sets)
    if (set.no_go)
      report.warnings.push_back(
          fmt::format("{}: NO-GO as when it was taken: {}", set.name, *set.no_go));
  write_recording(recording);
  return {std::move(recording), std::move(report)};
}

VerifyReport verify_recording(const std::filesystem::path& recording_folder,
                              const CaptureOptions& options) {
  options.check();
  const std::vector<FrameSet> in_journal = sets_in_journal(recording_folder);
  if (!in_journal.empty() && !std::filesystem::exists(recording_folder / "recording.json"))
    throw bad_input(
        fmt::format("not a recording yet: {} sets of a capture that goes on, or was ended, are in "
                    "its journal",
                    in_journal.size()),
        {.file = (recording_folder / "recording.journal").string()},
        "wait for its end; the next `drape capture` into this folder takes them over");
  const Recording recording = read_recording(recording_folder);
  std::vector<Item> items;
  std::set<std::string> listed;
  for (const FrameSet& set : recording.sets) {
    for (const RecordedFrame& frame : set.frames) {
      items.push_back({&set, &frame, std::nullopt});
      listed.insert(frame.file);
    }
  }

  const auto compare = [&](std::size_t i) {
    auto& [set, frame, fault] = items[i];
    try {
      static_cast<void>(read_frame(recording, *set, *frame));
    } catch (const Error& error) {
      fault = {set->name, frame->camera, frame->file, error.what_failed()};
    }
    return frame->file;
  };
  parallel_for(items.size(), options.threads, compare, options.progress);

  VerifyReport report{recording.sets.size(), items.size(), {}, {}, {}, {}};
  for (const FrameSet& set : in_journal)
    if (!is_renamed(recording_folder, recording.sets, set) &&
        std::ranges::none_of(recording.sets,
                             [&](const FrameSet& one) { return one.name == set.name; }))
      report.in_journal.push_back(set.name);
  for (Item& item : items) {
    if (item.fault) report.faults.push_back(std::move(*item.fault));
  }
  for (const FrameSet& set : recording.sets) {
    if (set.no_go) report.no_go.push_back(set.name + ": " + *set.no_go);
    if (auto fault = details_fault(recording, set)) report.faults.push_back(std::move(*fault));
  }
  for (const std::string& file : image_files_below(recording_folder)) {
    if (!listed.contains(file)) report.not_listed.push_back(file);
  }
  return report;
}

void CaptureOptions::check() const {
  if (threads < 1) throw usage_error("the number of threads must be 1 or more", "give --threads 1");
  if (recorded_on && !date_in(*recorded_on))
    throw usage_error("`" + *recorded_on + "` is no date", "write it as 2026-01-31");
}

}  // namespace drape::capture
