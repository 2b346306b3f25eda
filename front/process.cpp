// SPDX-License-Identifier: Apache-2.0
#include "front/process.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

#include "core/program/child.hpp"
#include "core/program/run_record.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

volatile std::sig_atomic_t last_signal = 0;

void remember(int signal) {
  last_signal = signal;
}

void handle_interrupts(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  for (const int signal : {SIGINT, SIGTERM}) ::sigaction(signal, &action, nullptr);
}

}  // namespace

Interrupts::Interrupts() {
  handle_interrupts(&remember);
}

Interrupts::~Interrupts() {
  handle_interrupts(SIG_DFL);
}

int Interrupts::signal() {
  return last_signal;
}

std::optional<Error> error_in(const StepResult& result) {
  if (!result.fault.empty()) {
    return Error(ErrorKind::internal, result.fault, {},
                 "see what it printed above; run again, steps that were finished are kept");
  }
  if (result.exit_code <= 1) return std::nullopt;
  if (auto error = error_printed(result.output, result.exit_code)) return error;
  return Error(static_cast<ErrorKind>(result.exit_code),
               fmt::format("a program ended with code {}", result.exit_code), {}, "");
}

StepResult result_of_stage(const std::string& stage, std::vector<std::string> arguments) {
  StageCall call = call_of(stage, std::move(arguments));
  StepResult result;
  run_steps(
      {{stage, stage, std::move(call.program), std::move(call.arguments)}}, 1,
      [](std::size_t, double, const std::string&) {},
      [&](std::size_t, const StepResult& ended) { result = ended; }, Interrupts::signal);
  return result;
}

void become(const fs::path& program, const std::vector<std::string>& arguments) {
  std::vector<char*> words = {const_cast<char*>(program.c_str())};
  for (const std::string& word : arguments) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  ::execv(program.c_str(), words.data());
  throw internal_error(fmt::format("cannot start the program: {}", std::strerror(errno)),
                       {.file = program.string()});
}

const std::vector<CommandWord>& command_words() {
  static const std::vector<CommandWord> words = {
      {"import", "capture", "import", true},
      {"doctor", "capture", "doctor", true},
      {"cameras", "capture", "cameras", false},
      {"print", "detect", "print", true},
      {"accept", "calib", "accept", false},
      {"calib-convert", "calib", "convert", false},
      {"calib-images", "calib", "images", false},
      {"object", "triangulate", "object", true},
      {"study", "simulate", "study", true},
      {"fabric", "simulate", "fabric", true},
      {"branches", "simulate", "branches", false},
      {"sensitivity", "simulate", "sensitivity", false},
      {"refine", "simulate", "SCENE --spacing-mm 2.5", false},
      {"certify", "simulate", "certify", false},
      {"cusick", "simulate", "cusick", false},
      {"piece", "simulate", "SCENE --outline FILE", false},
      {"drapemeter", "compare", "drapemeter", true},
      {"folds", "compare", "", false},
      {"folds", "compare", "MEASURED SIMULATED...", false},
      {"repeats", "compare", "repeats", false}};
  return words;
}

StageCall call_of(const std::string& command, std::vector<std::string> arguments) {
  std::string stage = command;
  // `drape import --points FILE` makes a sheet, `drape import FOLDER` a recording.
  const std::string_view points = "--points";
  const auto given = std::find_if(arguments.begin(), arguments.end(), [&](const std::string& word) {
    return word == points || word.starts_with("--points=");
  });
  if (command == "import" && given != arguments.end()) {
    if (*given == points)
      arguments.erase(given);
    else
      given->erase(0, points.size() + 1);
    arguments.insert(arguments.begin(), "points");
    return {program_beside("drape-triangulate"), std::move(arguments)};
  }
  for (const CommandWord& word : command_words()) {
    if (command != word.name) continue;
    stage = word.stage;
    arguments.insert(arguments.begin(), word.word);
  }
  return {program_beside("drape-" + stage), std::move(arguments)};
}

}  // namespace drape
