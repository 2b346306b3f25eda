// SPDX-License-Identifier: Apache-2.0
#include "capture/device/aravis_features.hpp"

#include <arv.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "capture/device/camera.hpp"
#include "core/error.hpp"

namespace drape::capture {
namespace {

/// GError of one call.
class FeatureFailure {
 public:
  FeatureFailure() = default;
  ~FeatureFailure() { g_clear_error(&error_); }
  FeatureFailure(const FeatureFailure&) = delete;
  FeatureFailure& operator=(const FeatureFailure&) = delete;
  [[nodiscard]] GError** slot() { return &error_; }
  [[nodiscard]] bool failed() const { return error_ != nullptr; }
  void require_none(const std::string& doing, const std::string& device) const {
    if (error_ == nullptr) return;
    throw device_error(fmt::format("{} failed: {}", doing, clean_text(error_->message)), device,
                       "give a value that the camera has; where it went silent, check its cable "
                       "and power");
  }

 private:
  GError* error_ = nullptr;
};

}  // namespace

std::string clean_text(const std::string& text) {
  const bool utf8 = g_utf8_validate(text.data(), static_cast<gssize>(text.size()), nullptr) != 0;
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if (byte < 0x20 || byte == 0x7F) {
      result += '?';
      ++i;
    } else if (byte < 0x80) {
      result += text[i++];
    } else if (!utf8) {
      // Latin-1 above 0x9F; below stand control characters of a terminal.
      if (byte < 0xA0) {
        result += '?';
      } else {
        result += static_cast<char>(0xC0 | byte >> 6);
        result += static_cast<char>(0x80 | (byte & 0x3F));
      }
      ++i;
    } else {
      const auto bytes = static_cast<std::size_t>(byte >= 0xF0 ? 4 : byte >= 0xE0 ? 3 : 2);
      const bool control = byte == 0xC2 && static_cast<unsigned char>(text[i + 1]) < 0xA0;
      result += control ? "?" : text.substr(i, bytes);
      i += bytes;
    }
  }
  return result;
}

std::string text_of(const char* text) {
  return text == nullptr ? "" : clean_text(text);
}

bool AravisFeatures::has(const char* feature) const {
  FeatureFailure failure;
  return arv_device_is_feature_available(device_, feature, failure.slot()) != 0;
}

bool AravisFeatures::can_write(const char* feature) const {
  ArvGcNode* node = arv_device_get_feature(device_, feature);
  if (!ARV_IS_GC_FEATURE_NODE(node) || !has(feature)) return false;
  FeatureFailure failure;
  const bool locked = arv_gc_feature_node_is_locked(ARV_GC_FEATURE_NODE(node), failure.slot()) != 0;
  const ArvGcAccessMode mode =
      arv_gc_feature_node_get_actual_access_mode(ARV_GC_FEATURE_NODE(node));
  return !locked && mode != ARV_GC_ACCESS_MODE_RO;
}

const char* AravisFeatures::first_of(std::initializer_list<const char*> names) const {
  const auto found =
      std::find_if(names.begin(), names.end(), [&](const char* n) { return has(n); });
  return found == names.end() ? nullptr : *found;
}

std::vector<std::string> AravisFeatures::choices(const char* feature) const {
  FeatureFailure failure;
  guint count = 0;
  const char** names = arv_device_dup_available_enumeration_feature_values_as_strings(
      device_, feature, &count, failure.slot());
  std::vector<std::string> result;
  for (guint i = 0; names != nullptr && i < count; ++i) result.push_back(clean_text(names[i]));
  g_free(names);
  return result;
}

std::string AravisFeatures::text(const char* feature) const {
  FeatureFailure failure;
  const char* value = arv_device_get_string_feature_value(device_, feature, failure.slot());
  failure.require_none(fmt::format("reading {}", feature), name_);
  return value == nullptr ? "" : clean_text(value);
}

std::string AravisFeatures::text_or_empty(const char* feature) const {
  return has(feature) ? text(feature) : "";
}

std::int64_t AravisFeatures::integer(const char* feature) const {
  FeatureFailure failure;
  const std::int64_t value = arv_device_get_integer_feature_value(device_, feature, failure.slot());
  failure.require_none(fmt::format("reading {}", feature), name_);
  return value;
}

std::optional<std::int64_t> AravisFeatures::integer_if(const char* feature) const {
  FeatureFailure failure;
  if (!has(feature)) return std::nullopt;
  const std::int64_t value = arv_device_get_integer_feature_value(device_, feature, failure.slot());
  if (failure.failed()) return std::nullopt;
  return value;
}

double AravisFeatures::number(const char* feature) const {
  if (ARV_IS_GC_INTEGER(arv_device_get_feature(device_, feature)))
    return static_cast<double>(integer(feature));
  FeatureFailure failure;
  const double value = arv_device_get_float_feature_value(device_, feature, failure.slot());
  failure.require_none(fmt::format("reading {}", feature), name_);
  return value;
}

void AravisFeatures::set_integer(const char* feature, std::int64_t value) const {
  FeatureFailure failure;
  arv_device_set_integer_feature_value(device_, feature, value, failure.slot());
  failure.require_none(fmt::format("setting {} to {}", feature, value), name_);
}

void AravisFeatures::set_number(const char* feature, double value) const {
  if (ARV_IS_GC_INTEGER(arv_device_get_feature(device_, feature)))
    return set_integer(feature, std::llround(value));
  FeatureFailure failure;
  arv_device_set_float_feature_value(device_, feature, value, failure.slot());
  failure.require_none(fmt::format("setting {} to {:g}", feature, value), name_);
}

void AravisFeatures::set_switch(const char* feature, bool on) const {
  FeatureFailure failure;
  arv_device_set_boolean_feature_value(device_, feature, on ? 1 : 0, failure.slot());
  failure.require_none(fmt::format("switching {} {}", feature, on ? "on" : "off"), name_);
}

void AravisFeatures::set_choice(const char* feature, const std::string& value) const {
  FeatureFailure failure;
  arv_device_set_string_feature_value(device_, feature, value.c_str(), failure.slot());
  failure.require_none(fmt::format("setting {} to {}", feature, value), name_);
  if (const std::string got = text(feature); got != value)
    throw device_error(fmt::format("the camera took {} {} instead of {}", feature, got, value),
                       name_, "give a value the camera can take");
}

void AravisFeatures::execute(const char* feature) const {
  FeatureFailure failure;
  arv_device_execute_command(device_, feature, failure.slot());
  failure.require_none(fmt::format("executing {}", feature), name_);
}

}  // namespace drape::capture
