// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

struct _ArvDevice;

namespace drape::capture {

/// A camera's text as UTF-8 without control characters: what is not UTF-8 is taken as Latin-1, and
/// what would steer a terminal becomes `?`.
[[nodiscard]] std::string clean_text(const std::string& text);
/// The same of what Aravis says; empty for null.
[[nodiscard]] std::string text_of(const char* text);

/// GenICam features of one camera by name. Cameras differ in names and in what they have, so that
/// first_of() finds the name that this one uses. Everything that a camera refuses is Error(device)
/// with the camera's own words.
class AravisFeatures {
 public:
  AravisFeatures(_ArvDevice* device, std::string name) : device_(device), name_(std::move(name)) {}

  /// There, and not switched off by another feature.
  [[nodiscard]] bool has(const char* feature) const;
  /// There, and writable now.
  [[nodiscard]] bool can_write(const char* feature) const;
  [[nodiscard]] const char* first_of(std::initializer_list<const char*> names) const;
  [[nodiscard]] std::vector<std::string> choices(const char* feature) const;

  [[nodiscard]] std::string text(const char* feature) const;
  [[nodiscard]] std::string text_or_empty(const char* feature) const;
  [[nodiscard]] std::int64_t integer(const char* feature) const;
  [[nodiscard]] std::optional<std::int64_t> integer_if(const char* feature) const;
  /// Of a feature that is a number, whether integer or real.
  [[nodiscard]] double number(const char* feature) const;

  void set_integer(const char* feature, std::int64_t value) const;
  void set_number(const char* feature, double value) const;
  void set_switch(const char* feature, bool on) const;
  /// Sets and reads back.
  void set_choice(const char* feature, const std::string& value) const;
  void execute(const char* feature) const;

  [[nodiscard]] const std::string& device_name() const { return name_; }

 private:
  _ArvDevice* device_;
  std::string name_;
};

}  // namespace drape::capture
