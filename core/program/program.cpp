// SPDX-License-Identifier: Apache-2.0
#include "core/program/program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <thread>

#include "core/error.hpp"
#include "core/files/json_file.hpp"
#include "core/program/command.hpp"
#include "core/program/manual.hpp"
#include "core/program/run_record.hpp"

namespace drape {
namespace {

void report_error(const Error& error, const std::string& program, const CommonOptions& options) {
  fmt::print(stderr, "{}: error: {}\n", program, error.what());
  if (!options.json) return;
  Json json;
  json["error"]["what_failed"] = error.what_failed();
  json["error"]["where"] = error.where().describe();
  json["error"]["what_to_do"] = error.what_to_do();
  json["exit_code"] = static_cast<int>(error.kind());
  fmt::print("{}", pretty(json));
}

Json json_of(const Ending& ending) {
  Json json;
  json["verdict"] = ending.go ? "GO" : "NO-GO";
  json["sentence"] = ending.verdict;
  json["numbers"] = Json::object();
  for (const auto& [name, value] : ending.numbers) json["numbers"][name] = value;
  json["rejected"] = ending.rejected;
  json["next_command"] = ending.next_command;
  return json;
}

}  // namespace

void add_common_options(Command& app, CommonOptions& options) {
  app.add_flag("--json", options.json, "print the ending as JSON on standard output");
  app.add_flag("--quiet", options.quiet, "no progress and no ending, only errors");
  app.add_option("--threads", options.threads,
                 "worker threads, 0 = all cores; never changes a result")
      ->range(0, 1024);
  app.set_version("drapebench " + version());
}

int finish(const Ending& ending, const CommonOptions& options) {
  const int code = ending.go ? 0 : 1;
  if (options.json) {
    fmt::print("{}", pretty(json_of(ending)));
  } else if (!options.quiet) {
    fmt::print("{}: {}\n", ending.go ? "GO" : "NO-GO", ending.verdict);
    std::size_t width = 0;
    for (const auto& number : ending.numbers) width = std::max(width, number.first.size());
    for (const auto& [name, value] : ending.numbers)
      fmt::print("  {:<{}}  {}\n", name, width, value);
    for (const std::string& rejected : ending.rejected) fmt::print("  rejected: {}\n", rejected);
    if (!ending.next_command.empty()) fmt::print("  next: {}\n", ending.next_command);
  }
  std::fflush(stdout);
  return code;
}

int run_program(Command& app, int argc, char** argv, const CommonOptions& options,
                const std::function<int()>& body) {
  const std::string only = argc == 2 ? argv[1] : "";
  if (only == "--help-man" || only == "--help-words") {
    fmt::print("{}", only == "--help-man" ? manual_page(app) : completion_words(app));
    return 0;
  }
  if (const int code = app.parse(argc, argv); code >= 0) return code;
  try {
    return body();
  } catch (const Error& error) {
    report_error(error, app.name(), options);
    return static_cast<int>(error.kind());
  } catch (const std::exception& error) {
    report_error(internal_error(error.what()), app.name(), options);
    return static_cast<int>(ErrorKind::internal);
  }
}

std::vector<std::string> arguments_of(int argc, char** argv) {
  return {argv + 1, argv + argc};
}

int thread_count(const CommonOptions& options) {
  if (options.threads > 0) return options.threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace drape
