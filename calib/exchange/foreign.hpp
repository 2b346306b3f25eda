// SPDX-License-Identifier: Apache-2.0
#pragma once

// Reads files of other tools as trees of values for core/fields.

#include <filesystem>
#include <vector>

#include "core/error.hpp"
#include "core/fields/records.hpp"

namespace drape::calib {

/// Reads YAML, XML or JSON of cv::FileStorage, and YAML of ROS and Kalibr without its first line.
[[nodiscard]] Value storage_value(const std::filesystem::path& file);

/// Reads a Python literal: dictionary, list or tuple of numbers, texts, True, False and None.
[[nodiscard]] Value python_value(const std::filesystem::path& file);

/// Reads XML of Trilinos' ParameterList: a list becomes a table, a parameter has its stated type.
[[nodiscard]] Value parameter_list_value(const std::filesystem::path& file);

/// Reads MATLAB's JSON (jsonencode of toStruct), or statements `name.field = [1 2; 3 4];`. Matrices
/// become lists of rows.
[[nodiscard]] Value matlab_value(const std::filesystem::path& file);

/// Reads the record in a file's values; a key that its description does not name is refused.
template <class Record>
[[nodiscard]] Record foreign_record(const std::filesystem::path& file, Value values) {
  Record record{};
  std::vector<Error> faults =
      faults_of_reading(Document(Syntax::toml, std::move(values)), walk_through(record));
  for (Error& fault : faults) {
    Where where = fault.where();
    where.file = file.string();
    fault = Error(fault.kind(), fault.what_failed(), where, fault.what_to_do());
  }
  throw_if_any(std::move(faults));
  return record;
}

}  // namespace drape::calib
