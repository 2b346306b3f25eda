// SPDX-License-Identifier: Apache-2.0
#include "core/pictures/picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/files/files.hpp"

namespace drape {
namespace {

using Bytes = std::span<const unsigned char>;

enum Tag : std::size_t { kPhotometric = 262, kOrientation = 274 };

/// First directory of a TIFF or BigTIFF, which can be embedded in EXIF.
class Tiff {
 public:
  explicit Tiff(Bytes bytes) : bytes_(bytes) {
    const bool is_tiff = bytes.size() > 8 && bytes[0] == bytes[1] &&
                         (bytes[0] == 'I' || bytes[0] == 'M') && (at(2, 2) == 42 || at(2, 2) == 43);
    if (!is_tiff) return;
    const bool big = at(2, 2) == 43;
    address_ = big ? 8 : 4, count_ = big ? 8 : 2, entry_ = big ? 20 : 12;
    page_ = at(address_, address_);
  }

  [[nodiscard]] bool has_more_pages() const {
    return page_ != 0 && at(page_ + count_ + entry_ * at(page_, count_), address_) != 0;
  }
  /// Offset of a tag's short value.
  [[nodiscard]] std::optional<std::size_t> place_of(Tag tag) const {
    const std::size_t entries = page_ == 0 ? 0 : std::min<std::size_t>(at(page_, count_), 1000);
    for (std::size_t i = 0; i < entries; ++i) {
      const std::size_t entry = page_ + count_ + entry_ * i;
      const std::size_t value = entry + entry_ - address_;
      if (at(entry, 2) == tag && value + 2 <= bytes_.size()) return value;
    }
    return std::nullopt;
  }
  /// Unsigned number of `width` bytes; 0 beyond the end.
  [[nodiscard]] std::size_t at(std::size_t offset, std::size_t width) const {
    return unsigned_at(as_text(bytes_), offset, width, bytes_[0] == 'I').value_or(0);
  }

 private:
  Bytes bytes_;
  std::size_t address_ = 4, count_ = 2, entry_ = 12, page_ = 0;
};

/// Directory with the orientation tag: in a JPEG's APP1, in a PNG's eXIf, or the TIFF's own.
Bytes exif_of(Bytes bytes) {
  const std::string_view text = as_text(bytes);
  if (text.starts_with("\x89PNG")) {
    for (std::size_t at = 8; at + 12 <= bytes.size();) {
      const std::size_t length = *unsigned_at(text, at, 4);
      if (length > bytes.size() - at - 12) break;
      if (text.substr(at + 4).starts_with("eXIf")) return bytes.subspan(at + 8, length);
      at += length + 12;
    }
    return {};
  }
  if (text.starts_with("\xff\xd8")) {
    for (std::size_t at = 2; at + 4 <= bytes.size() && bytes[at] == 0xff;) {
      const std::size_t length = *unsigned_at(text, at + 2, 2);
      if (bytes[at + 1] == 0xda || length < 2 || length > bytes.size() - at - 2) break;
      if (bytes[at + 1] == 0xe1 && length >= 8 && text.substr(at + 4).starts_with("Exif"))
        return bytes.subspan(at + 10, length - 8);
      at += length + 2;
    }
    return {};
  }
  return bytes;
}

/// Name of those TIFF photometric values that change the meaning of the numbers.
std::string_view photometric_name(std::size_t value) {
  if (value == 0) return "0 (WhiteIsZero): black and white are exchanged";
  if (value == 5) return "5 (Separated): it holds inks";
  if (value == 8 || value == 9 || value == 10) return "Lab colours";
  if (value == 32803) return "32803 (CFA): it holds a raw mosaic";
  return value <= 4 || value == 6 ? "" : "of an unknown kind";
}

bool is_transparent(const cv::Mat& picture) {
  if (picture.channels() != 4) return false;
  cv::Mat alpha;
  cv::extractChannel(picture, alpha, 3);
  double least = 0;
  cv::minMaxLoc(alpha, &least);
  return least < (alpha.depth() == CV_16U ? 65535 : 255);
}

}  // namespace

int orientation_of(Bytes bytes) {
  const Tiff tiff(exif_of(bytes));
  const auto place = tiff.place_of(kOrientation);
  const std::size_t value = place ? tiff.at(*place, 2) : 1;
  return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
}

cv::Mat decode_picture(Bytes bytes, const Where& where, std::string_view remedy) {
  const auto refuse = [&](const std::string& what, std::string_view advice) {
    return bad_input(what, where, std::string(advice));
  };
  constexpr std::string_view kSaveAgain = "save it as a grey PNG of 8 or 16 bit";
  const Tiff tiff(bytes);
  if (tiff.has_more_pages())
    throw refuse("the TIFF has several pages", "save the one that is meant as a PNG");
  if (const auto place = tiff.place_of(kPhotometric))
    if (const std::string_view name = photometric_name(tiff.at(*place, 2)); !name.empty())
      throw refuse(fmt::format("the TIFF's photometric tag is {}", name), kSaveAgain);
  // OpenCV applies a TIFF's orientation, but no other: the decoder gets an upright one.
  std::vector<unsigned char> upright;
  if (const auto place = tiff.place_of(kOrientation); place && tiff.at(*place, 2) != 1) {
    upright.assign(bytes.begin(), bytes.end());
    upright[*place] = bytes[0] == 'I' ? 1 : 0;
    upright[*place + 1] = bytes[0] == 'I' ? 0 : 1;
    bytes = upright;
  }
  cv::Mat picture;
  try {
    if (begins_as_picture(bytes)) {
      const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8U,
                           const_cast<unsigned char*>(bytes.data()));  // imdecode only reads it
      picture = cv::imdecode(buffer, cv::IMREAD_UNCHANGED);
    }
  } catch (const cv::Exception& problem) {
    throw refuse(fmt::format("the image cannot be decoded: {}", problem.err), remedy);
  }
  if (picture.empty()) throw refuse("the file is not a readable image", remedy);
  if (picture.depth() != CV_8U && picture.depth() != CV_16U)
    throw refuse("the image has neither 8 nor 16 bit per pixel", kSaveAgain);
  if (picture.channels() == 2 || picture.channels() > 4)
    throw refuse(fmt::format("the image has {} channels", picture.channels()), kSaveAgain);
  if (is_transparent(picture))
    throw refuse("the image is transparent in places: what lies under it is not known",
                 "lay it on the background that is meant, and save it without transparency");
  if (picture.channels() == 4) {
    cv::Mat opaque(picture.size(), CV_MAKETYPE(picture.depth(), 3));
    cv::mixChannels({picture}, {opaque}, {0, 0, 1, 1, 2, 2});
    return opaque;
  }
  return picture;
}

}  // namespace drape
