// SPDX-License-Identifier: Apache-2.0
#include "tests/architecture/source_files.hpp"

#include <algorithm>
#include <fstream>
#include <stdexcept>

#include "tests/support/paths.hpp"

namespace drape::test {

namespace fs = std::filesystem;

bool SourceFile::is_test() const {
  return path.ends_with("_test.cpp") || path.starts_with("tests/");
}

bool SourceFile::is_header() const {
  return path.ends_with(".hpp");
}

std::string SourceFile::folder() const {
  return path.substr(0, path.find('/'));
}

SourceFile read_source(const std::string& path) {
  std::ifstream stream(source_root() / path);
  if (!stream) throw std::runtime_error("cannot read " + path);
  SourceFile file{path, {}};
  std::string text;
  while (std::getline(stream, text)) {
    file.lines.push_back({static_cast<int>(file.lines.size()) + 1, text});
  }
  return file;
}

std::vector<SourceFile> source_files(const std::string& folder,
                                     const std::vector<std::string>& endings) {
  std::vector<std::string> paths;
  for (const auto& entry : fs::recursive_directory_iterator(source_root() / folder)) {
    const std::string path = fs::relative(entry.path(), source_root()).generic_string();
    const auto is_ending = [&](const std::string& ending) { return path.ends_with(ending); };
    if (entry.is_regular_file() && std::any_of(endings.begin(), endings.end(), is_ending)) {
      paths.push_back(path);
    }
  }
  std::sort(paths.begin(), paths.end());
  std::vector<SourceFile> files;
  files.reserve(paths.size());
  for (const std::string& path : paths) files.push_back(read_source(path));
  return files;
}

const std::vector<SourceFile>& cpp_files() {
  static const std::vector<SourceFile> all = [] {
    std::vector<std::string> folders = {"core", "front", "tests"};
    folders.insert(folders.end(), stages.begin(), stages.end());
    std::vector<SourceFile> files;
    for (const std::string& folder : folders) {
      for (SourceFile& file : source_files(folder, {".cpp", ".hpp"})) {
        files.push_back(std::move(file));
      }
    }
    return files;
  }();
  return all;
}

std::vector<SourceFile> markdown_files() {
  std::vector<SourceFile> files;
  for (const auto& entry : fs::directory_iterator(source_root())) {
    if (entry.path().extension() == ".md") files.push_back(read_source(entry.path().filename()));
  }
  std::vector<std::string> folders = {"core", "front", "tests", "rigs", "docs"};
  folders.insert(folders.end(), stages.begin(), stages.end());
  for (const std::string& folder : folders) {
    for (SourceFile& file : source_files(folder, {".md"})) files.push_back(std::move(file));
  }
  return files;
}

std::string included(const std::string& line) {
  const std::size_t start = line.find_first_not_of(" \t");
  if (start == std::string::npos || line.compare(start, 8, "#include") != 0) return {};
  const std::size_t open = line.find_first_of("<\"", start);
  if (open == std::string::npos) return {};
  const std::size_t close = line.find_first_of(">\"", open + 1);
  return close == std::string::npos ? std::string() : line.substr(open + 1, close - open - 1);
}

std::string finding(const SourceFile& file, const Line& line) {
  return file.path + ":" + std::to_string(line.number) + ": " + line.text;
}

}  // namespace drape::test
