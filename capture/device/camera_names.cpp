// SPDX-License-Identifier: Apache-2.0
#include "capture/device/camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"

namespace drape::capture {

std::string to_string(Backend backend) {
  switch (backend) {
    case Backend::aravis:
      return "aravis";
    case Backend::v4l2:
      return "v4l2";
    case Backend::replay:
      return "replay";
  }
  return {};
}

std::string to_string(TriggerSource source) {
  switch (source) {
    case TriggerSource::free_run:
      return "free_run";
    case TriggerSource::software:
      return "software";
    case TriggerSource::line:
      return "line";
    case TriggerSource::action:
      return "action";
  }
  return {};
}

Error device_error(std::string what_failed, const std::string& device, std::string what_to_do) {
  return Error(ErrorKind::device, std::move(what_failed), {.field = "device " + device},
               std::move(what_to_do));
}

void require_taken(const std::string& name, double asked, double got, const std::string& device) {
  constexpr double tolerance = 0.02;
  if (std::abs(got - asked) <= tolerance * std::max(std::abs(asked), 1e-9)) return;
  throw device_error(fmt::format("the camera took {} {:g} instead of {:g}", name, got, asked),
                     device, "give a value the camera can take, within its range and steps");
}

}  // namespace drape::capture
