// SPDX-License-Identifier: Apache-2.0
#include "capture/live/develop.hpp"

#include <algorithm>

#include "capture/pixel/pixel_format.hpp"
#include "core/error.hpp"

namespace drape::capture {

LiveFrame develop(HostFrame frame, const std::string& name) {
  LiveFrame developed{{}, frame.width_px, frame.height_px, frame.fault, {}};
  developed.pixel_format = name;
  const PixelFormat* format = find_pixel_format(name);
  if (frame.pixels.empty() || format == nullptr) return developed;
  const auto count =
      static_cast<std::size_t>(frame.width_px) * static_cast<std::size_t>(frame.height_px);
  const bool plain = format->packing == Packing::bytes && format->mosaic == Mosaic::none;
  if (plain && frame.pixels.size() == count &&
      (frame.stride_bytes == 0 || frame.stride_bytes == format->row_bytes(frame.width_px))) {
    developed.pixels = std::move(frame.pixels);
    return developed;
  }
  try {
    const Samples grey =
        grey_of(unpack(*format, frame.pixels, frame.width_px, frame.height_px, frame.stride_bytes),
                format->mosaic);
    developed.bits = grey.bits;
    developed.pixels.resize(count);
    const int shift = grey.bits - 8;
    std::transform(grey.values.begin(), grey.values.end(), developed.pixels.begin(),
                   [&](std::uint16_t v) { return static_cast<std::uint8_t>(v >> shift); });
    if (shift > 0) {
      developed.deep.resize(count);
      std::transform(grey.values.begin(), grey.values.end(), developed.deep.begin(),
                     [&](std::uint16_t v) { return static_cast<std::uint16_t>(v << (8 - shift)); });
    }
    if (!format->is_grey()) developed.raw = std::move(frame.pixels);
  } catch (const Error& error) {
    developed.fault = error.what_failed();
    developed.pixels.clear();
  }
  return developed;
}

}  // namespace drape::capture
