// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace drape::test {

inline constexpr std::array stages = {"capture",  "calib",   "detect", "triangulate",
                                      "simulate", "compare", "synth",  "console"};

/// One line of a source file.
struct Line {
  int number = 0;  ///< 1-based
  std::string text;
};

/// A text file of the project.
struct SourceFile {
  std::string path;  ///< relative to the project's root
  std::vector<Line> lines;

  [[nodiscard]] bool is_test() const;  ///< *_test.cpp, or anything under tests/
  [[nodiscard]] bool is_header() const;
  [[nodiscard]] std::string folder() const;  ///< first part of the path
};

/// Files under `folder` whose name ends with one of `endings`, sorted by path.
[[nodiscard]] std::vector<SourceFile> source_files(const std::string& folder,
                                                   const std::vector<std::string>& endings);

/// All C++ files of core, the front door, the stages and the tests.
[[nodiscard]] const std::vector<SourceFile>& cpp_files();

/// All Markdown files of the project, except in build folders and results.
[[nodiscard]] std::vector<SourceFile> markdown_files();

[[nodiscard]] SourceFile read_source(const std::string& path);

/// Name in an include line, without brackets or quotes; empty for any other line.
[[nodiscard]] std::string included(const std::string& line);

/// One finding of a test, as "path:line: text".
[[nodiscard]] std::string finding(const SourceFile& file, const Line& line);

}  // namespace drape::test
