// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <system_error>

#include "capture/capture.hpp"
#include "capture/folder_layout.hpp"
#include "capture/image_check.hpp"
#include "capture/ticker.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/inside.hpp"
#include "core/files/json_file.hpp"
#include "core/parallel.hpp"

namespace drape::capture {
namespace {

namespace fs = std::filesystem;

struct CheckedImage {
  ImageFile image;
  RecordedFrame frame;
  std::uintmax_t bytes = 0;
};

/// The picture that its owner knows: what a link leads to, as `drape calib images` makes them.
fs::path original_of(const fs::path& file) {
  return fs::is_symlink(file) ? fs::canonical(file) : file;
}

Where where_is(const fs::path& folder, const ImageFile& image) {
  return {
      .file = original_of(folder / image.file).string(), .camera = image.camera, .set = image.set};
}

std::vector<CheckedImage> list_images(const FolderLayout& layout) {
  std::vector<CheckedImage> images;
  for (const SetLayout& set : layout.sets) {
    for (const ImageFile& image : set.images) images.push_back({image, {}, 0});
  }
  return images;
}

void check_one(const fs::path& folder, CheckedImage& checked) {
  const ImageFile& image = checked.image;
  const std::vector<unsigned char> bytes = read_bytes(folder / image.file);
  const ImageSize size = check_image(bytes, where_is(folder, image));
  checked.bytes = bytes.size();
  checked.frame = {image.camera,  image.file,     sha256_of(bytes),
                   size.width_px, size.height_px, std::nullopt};
}

/// A camera does not change its image size; another size means another camera or a resized image.
void require_same_sizes(const fs::path& folder, const std::vector<CheckedImage>& images) {
  std::map<std::string, const CheckedImage*> first_of;
  for (const CheckedImage& checked : images) {
    const CheckedImage& first = *first_of.try_emplace(checked.image.camera, &checked).first->second;
    const RecordedFrame& frame = checked.frame;
    if (frame.width_px == first.frame.width_px && frame.height_px == first.frame.height_px)
      continue;
    throw bad_input(
        fmt::format("the image is {} x {} px, but camera `{}` has {} x {} px in set `{}`",
                    frame.width_px, frame.height_px, frame.camera, first.frame.width_px,
                    first.frame.height_px, first.image.set),
        where_is(folder, checked.image),
        frame.width_px == first.frame.height_px && frame.height_px == first.frame.width_px
            ? "this image was saved turned by a quarter turn (its EXIF orientation applied): put "
              "back the camera's original image"
            : "put back the camera's original image");
  }
}

std::vector<std::string> same_bytes_warnings(const fs::path& folder,
                                             const std::vector<CheckedImage>& images) {
  std::vector<std::string> warnings;
  const auto name_of = [&](const std::string& file) {
    return fs::is_symlink(folder / file) ? original_of(folder / file).string() : file;
  };
  std::map<std::string, std::string> file_of;
  for (const CheckedImage& checked : images) {
    const auto [first, is_new] = file_of.try_emplace(checked.frame.sha256, checked.frame.file);
    if (is_new) continue;
    warnings.push_back(fmt::format("{} and {} are the same image; was one copied by mistake?",
                                   name_of(first->second), name_of(checked.frame.file)));
  }
  return warnings;
}

std::optional<Recording> recording_in(const fs::path& folder) {
  if (!fs::exists(folder / "recording.json")) return std::nullopt;
  return read_recording(folder);
}

/// A recording's images never change: importing again may add sets, but not replace an image.
void require_nothing_replaced(const Recording& existing, const std::vector<CheckedImage>& images) {
  std::map<std::string, std::string> sha256_of_file;
  for (const CheckedImage& checked : images) {
    sha256_of_file[checked.frame.file] = checked.frame.sha256;
  }
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

/// Images that are not there yet.
std::vector<const CheckedImage*> images_to_copy(const fs::path& recording_folder,
                                                const std::vector<CheckedImage>& images) {
  std::vector<const CheckedImage*> to_copy;
  for (const CheckedImage& checked : images) {
    const fs::path to = recording_folder / checked.frame.file;
    if (!fs::exists(to)) {
      to_copy.push_back(&checked);
    } else if (sha256_of_file(to) != checked.frame.sha256) {
      throw bad_input("another file of this name is already there", {.file = to.string()},
                      "import into a new or empty folder");
    }
  }
  return to_copy;
}

/// The notes of a set are as little replaced as its pictures.
void require_same_details(const fs::path& recording_folder, const std::string& set,
                          const std::string& sha256) {
  const fs::path file = recording_folder / set / "capture.json";
  if (fs::exists(file) && sha256_of_file(file) != sha256)
    throw bad_input("another file of this name is already there",
                    {.file = file.string(), .set = set}, "import into a new or empty folder");
}

void copy_one(const fs::path& folder, const fs::path& recording_folder,
              const CheckedImage& checked) {
  const std::vector<unsigned char> bytes = read_bytes(folder / checked.image.file);
  if (sha256_of(bytes) != checked.frame.sha256) {
    throw bad_input("the image changed while it was imported", where_is(folder, checked.image),
                    "stop whatever writes to it, then import again");
  }
  write_inside(recording_folder, checked.frame.file,
               {reinterpret_cast<const char*>(bytes.data()), bytes.size()},
               where_is(folder, checked.image));
}

/// What a capture noted in the folder of a set; nothing where the file is not of a capture.
struct Details {
  std::string set;  ///< under which it was taken
  std::string bytes, sha256;
  std::optional<double> motion_px, camera_shift_px;
  std::optional<std::string> no_go;
};

std::optional<Details> details_in(const fs::path& folder, const std::string& set) {
  const fs::path file = folder / set / "capture.json";
  if (!fs::is_regular_file(file)) return std::nullopt;
  Details details;
  details.bytes = read_text(file);
  const Json json = try_json(details.bytes);
  if (json.is_discarded())
    throw bad_input("the file is damaged, so that nobody knows whether the set is a measurement",
                    {.file = file.string(), .set = set},
                    "bring it back from where the set was copied, or record the set again");
  if (!json.is_object() || !json.contains("schema") || !json["schema"].is_string() ||
      !json["schema"].get<std::string>().starts_with("drapebench/capture/"))
    return std::nullopt;
  const JsonNode root = JsonNode::open(file, "capture", 1), still = root.at("stillness");
  details.sha256 = sha256_of(details.bytes);
  details.set = root.text("set");
  details.motion_px = still.optional_number("motion_px");
  details.camera_shift_px = still.optional_number("background_shift_px");
  if (root.has("no_go")) details.no_go = root.optional_text("no_go");
  if (!details.no_go && still.optional_text("cloth") == "moved")
    details.no_go = details.motion_px
                        ? fmt::format("the cloth moved by {:.2f} px or more during the burst",
                                      *details.motion_px)
                        : "the cloth moved farther than can be followed during the burst";
  return details;
}

/// `drape_A_000` to `drape_A_012` are one burst of `drape_A`; empty for a set of its own.
std::string burst_of(const std::string& set) {
  constexpr std::size_t kNumber = 4;  // _000
  if (set.size() <= kNumber || set[set.size() - kNumber] != '_') return {};
  const std::string number = set.substr(set.size() - kNumber + 1);
  const bool counts =
      std::all_of(number.begin(), number.end(), [](char c) { return c >= '0' && c <= '9'; });
  return counts ? set.substr(0, set.size() - kNumber) : "";
}

/// By name of the set. A capture writes them as the sets of a burst come: what ended one of them
/// is so of all.
std::map<std::string, Details> all_details(const fs::path& folder, const FolderLayout& layout) {
  std::map<std::string, Details> all;
  std::map<std::string, std::string> moved;  ///< by burst
  for (const SetLayout& set : layout.sets)
    if (auto details = details_in(folder, set.name)) {
      if (details->no_go) moved[burst_of(details->set)] = *details->no_go;
      all.emplace(set.name, std::move(*details));
    }
  for (auto& [set, details] : all)
    if (const std::string burst = burst_of(details.set); !details.no_go && moved.contains(burst))
      if (!burst.empty()) details.no_go = moved.at(burst);
  return all;
}

/// A manifest knows more: of the whole burst, and what was said of it later.
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

Recording make_recording(const fs::path& recording_folder, const FolderLayout& layout,
                         const std::vector<CheckedImage>& images) {
  Recording recording{recording_folder, "import", std::nullopt, {}};
  auto next = images.begin();
  for (const SetLayout& set : layout.sets) {
    FrameSet& frames = recording.sets.emplace_back(FrameSet{set.name, {}});
    for (std::size_t i = 0; i < set.images.size(); ++i) frames.frames.push_back((next++)->frame);
  }
  return recording;
}

/// Gives a set what was noted before of its pictures: why one of them is no measurement, the times
/// of its frames and, where all are those of one set, how still that stood. The details are a file
/// of their own. Returns whether all are.
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

/// A folder may have another name by now, or a picture more.
void keep_notes_of(const Recording& before, bool in_place, Recording& recording) {
  if (in_place) recording.source = before.source;
  if (!recording.recorded_on) recording.recorded_on = before.recorded_on;
  for (FrameSet& set : recording.sets) {
    const auto same = std::find_if(before.sets.begin(), before.sets.end(),
                                   [&](const FrameSet& old) { return old.name == set.name; });
    if (same != before.sets.end() && keep_notes(*same, in_place, set)) continue;
    for (const FrameSet& old : before.sets) keep_notes(old, false, set);
  }
}

}  // namespace

void require_importable(const fs::path& folder, const fs::path& recording_folder) {
  static_cast<void>(read_layout(folder));
  if (!is_same_folder(folder, recording_folder)) require_not_inside(folder, recording_folder);
}

ImportResult import_folder(const fs::path& folder, const fs::path& recording_folder,
                           const CaptureOptions& options) {
  options.check();
  ImportReport report;
  report.in_place = is_same_folder(folder, recording_folder);
  const FolderLayout layout = read_layout(folder);
  if (!report.in_place) require_not_inside(folder, recording_folder);
  report.cameras =
      require_same_cameras(folder, layout, options.allow_missing ? &report.warnings : nullptr);
  report.ignored = layout.ignored;
  const std::map<std::string, Details> noted = all_details(folder, layout);
  for (const SetLayout& set : layout.sets)
    if (const std::string file = set.name + "/capture.json";
        fs::exists(folder / file) && !noted.contains(set.name))
      report.ignored.push_back({file, "not of a capture"});

  std::vector<CheckedImage> images = list_images(layout);
  Ticker ticker(options, images.size());
  parallel_for(images.size(), options.threads, [&](std::size_t i) {
    check_one(folder, images[i]);
    ticker.done(images[i].image.file);
  });
  require_same_sizes(folder, images);
  // Both manifests are read, and may be refused, before anything is written.
  const auto existing = recording_in(recording_folder);
  const auto source = report.in_place ? std::nullopt : recording_in(folder);
  if (existing) require_nothing_replaced(*existing, images);
  report.images = images.size();
  for (const CheckedImage& checked : images) report.image_bytes += checked.bytes;
  const std::vector<std::string> same = same_bytes_warnings(folder, images);
  report.warnings.insert(report.warnings.end(), same.begin(), same.end());

  if (!report.in_place) {
    for (const auto& [set, details] : noted)
      require_same_details(recording_folder, set, details.sha256);
    for (const CheckedImage* image : images_to_copy(recording_folder, images))
      copy_one(folder, recording_folder, *image);
    for (const auto& [set, details] : noted)
      write_inside(recording_folder, set + "/capture.json", details.bytes, {.set = set});
  }
  Recording recording = make_recording(recording_folder, layout, images);
  recording.recorded_on = options.recorded_on;
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

}  // namespace drape::capture
