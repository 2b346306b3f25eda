// SPDX-License-Identifier: Apache-2.0
#include "core/program/program.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <new>
#include <system_error>
#include <thread>

#include "core/files/json_file.hpp"

namespace drape {
namespace {

int report_error(const Error& error, const std::string& program, const CommonOptions& options) {
  const int code = static_cast<int>(error.kind());
  print_error(error, program);
  if (!options.json) return code;
  Json json;
  json["error"]["what_failed"] = error.what_failed();
  json["error"]["where"] = error.where().describe();
  json["error"]["what_to_do"] = error.what_to_do();
  json["exit_code"] = code;
  std::fputs(pretty(json).c_str(), stdout);
  std::fflush(stdout);
  return code;
}

/// Set in a stage started by the front door, which reports an interrupt once for all stages.
volatile sig_atomic_t below_front_door = 0;

/// Ends the program. Files are replaced atomically, so it may stop at any point.
void on_interrupt(int signal) {
  constexpr std::string_view kSentence =
      "\ninterrupted: what was finished is kept, run again to go on\n";
  if (below_front_door == 0) {
    [[maybe_unused]] const ssize_t ignored =
        ::write(STDERR_FILENO, kSentence.data(), kSentence.size());
  }
  ::_exit(128 + signal);
}

/// True if descriptors 0 to 2 were closed when the program started. They are reopened, so that no
/// output file takes their number and receives messages.
bool output_is_closed = false;

void occupy_standard_descriptors() {
  for (int descriptor = 0; descriptor <= STDERR_FILENO; ++descriptor) {
    if (::fcntl(descriptor, F_GETFD) >= 0) continue;
    if (descriptor == STDOUT_FILENO) output_is_closed = true;
    // open() returns the lowest free descriptor, this one. O_CLOEXEC closes it again in an executed
    // program.
    [[maybe_unused]] const int ignored = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  }
}

/// Handles signals that would end the program without a message.
void prepare_process() {
  occupy_standard_descriptors();
  below_front_door = std::getenv("DRAPE_PROGRESS_FD") == nullptr ? 0 : 1;
  struct sigaction action {};
  action.sa_handler = &on_interrupt;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  action.sa_handler = SIG_IGN;
  ::sigaction(SIGXFSZ, &action, nullptr);  // Exceeding the file size limit then makes write() fail.
}

/// Ends without running exit handlers: OpenBLAS's handler (below OpenCV and Ceres) waits forever
/// for threads that the system refused to create.
[[noreturn]] void leave(int code) {
  std::fflush(nullptr);
#ifdef __SANITIZE_ADDRESS__
  std::exit(code);
#else
  ::_exit(code);
#endif
}

/// Handles failures outside run_guarded(): a library that runs out of memory at start-up, or an
/// exception in a thread.
[[noreturn]] void on_terminate() {
  const char* why = "an unexpected error";
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    why = "the memory is not enough";
  } catch (...) {  // carries no message
  }
  const char* program = ::program_invocation_short_name;
  for (const char* part : {program, ": error: ", why, "\n"}) {
    [[maybe_unused]] const ssize_t ignored = ::write(STDERR_FILENO, part, std::strlen(part));
  }
  ::_exit(static_cast<int>(ErrorKind::internal));
}

/// Sets limits before any library starts. OpenBLAS creates threads at start that speed up nothing
/// here. OpenCV must refuse larger images before decoding: 2^26 pixels of 8 bytes are half a GB.
/// Both read the original environment, so a program that links one executes itself again.
void limit_libraries(int, char** arguments, char** environment) {
  std::set_terminate(&on_terminate);
  const bool limited = ::dlsym(RTLD_DEFAULT, "dgemm_") != nullptr ||
                       ::dlsym(RTLD_DEFAULT, "_ZN2cv8imdecodeERKNS_11_InputArrayEi") != nullptr;
  if (!limited) return;
  static char threads[] = "OPENBLAS_NUM_THREADS=1";
  static char pixels[] = "OPENCV_IO_MAX_IMAGE_PIXELS=67108864";
  std::vector<char*> all;
  bool given[2] = {};
  for (; *environment != nullptr; ++environment) {
    const std::string_view one = *environment;
    given[0] = given[0] || one.starts_with("OPENBLAS_NUM_THREADS=");
    given[1] = given[1] || one.starts_with("OPENCV_IO_MAX_IMAGE_PIXELS=");
    all.push_back(*environment);
  }
  if (given[0] && given[1]) return;
  if (!given[0]) all.push_back(threads);
  if (!given[1]) all.push_back(pixels);
  all.push_back(nullptr);
  char file[4096];
  const ssize_t size = ::readlink("/proc/self/exe", file, sizeof file - 1);
  if (size <= 0) return;
  file[size] = '\0';
  ::execve(file, arguments, all.data());  // If this fails, only the limits are missing.
}
[[gnu::section(".preinit_array"), gnu::used]] void (*at_start)(int, char**,
                                                               char**) = &limit_libraries;

}  // namespace

static void fields(Fields& f, CommonOptions& options) {
  f.otherwise({"json", "print the ending as JSON on standard output"}, options.json);
  f.otherwise({"quiet", "no progress and no ending, only errors"}, options.quiet);
  f.otherwise({"threads", "worker threads, 0 = all cores; never changes a result", 1, 0, 1024},
              options.threads);
}

void add_common_options(Command& app, CommonOptions& options) {
  app.add_record(options);
  app.set_version("drapebench " + version());
}

void print_text(const std::string& text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  const bool lost = output_is_closed && !text.empty();
  if (!lost && written && std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  const int code = lost ? EBADF : errno;
  std::clearerr(stdout);
  throw Error(ErrorKind::internal,
              fmt::format("standard output cannot be written: {}", std::strerror(code)), {},
              "free the disk, or print elsewhere; files that were written are whole");
}

void print_message(const std::string& text) {
  std::fputs(printable(text).c_str(), stderr);  // fmt::print throws if standard error is full
}

void print_error(const Error& error, const std::string& program) {
  std::fputs(fmt::format("{}: {}: ", program, coloured("error", "31", stderr)).c_str(), stderr);
  print_message(std::string(error.what()) + "\n");
}

int finish(const Ending& ending, const CommonOptions& options) {
  if (options.json) {
    print_text(pretty(value_of(ending)));
  } else if (!options.quiet) {
    const std::string text = printable(printed(ending));
    const std::size_t verdict = printable(ending.tables).size(), end = text.find(':', verdict);
    print_text(text.substr(0, verdict) +
               coloured(text.substr(verdict, end - verdict), ending.go ? "32" : "1;31", stdout) +
               text.substr(end));
  }
  return ending.go ? 0 : 1;
}

int finish(const Ending& ending, const CommonOptions& options, const RunRecord& record) {
  record.write(ending.go ? 0 : 1, ending);
  return finish(ending, options);
}

int run_guarded(const std::string& name, const CommonOptions& options,
                const std::function<int()>& body) {
  prepare_process();
  try {
    const int code = body();
    print_text({});  // Text printed earlier may still be in the buffer.
    return code;
  } catch (const Error& error) {
    return report_error(error, name, options);
  } catch (const std::filesystem::filesystem_error& error) {
    return report_error(
        bad_input("a file cannot be used: " + error.code().message(),
                  {.file = error.path1().string()}, "check the path and its permissions"),
        name, options);
  } catch (const std::bad_alloc&) {
    return report_error(Error(ErrorKind::internal, "the memory is not enough", {},
                              "close other programs, or ask for less (smaller images or grids)"),
                        name, options);
  } catch (const std::system_error& error) {
    return report_error(Error(ErrorKind::internal, error.what(), {},
                              "the system refused it: check its limits and the disk"),
                        name, options);
  } catch (const std::exception& error) {
    return report_error(internal_error(error.what()), name, options);
  }
}

std::string coloured(const std::string& text, const char* code, std::FILE* stream) {
  if (::isatty(::fileno(stream)) == 0 || std::getenv("NO_COLOR") != nullptr) return text;
  return fmt::format("\x1b[{}m{}\x1b[0m", code, text);
}

namespace {

/// Commands of the running program, listed by its --help.
std::string list_of_commands;

}  // namespace

int run_stage(int argc, char** argv, int (*own)(int, char**),
              const std::vector<StageCommand>& commands) {
  const std::string_view word = argc > 1 ? argv[1] : "";
  for (const StageCommand& command : commands)
    if (word == command.word) return command.run(argc, argv);
  list_of_commands = "Subcommands:\n";
  for (const StageCommand& command : commands)
    list_of_commands += fmt::format("  {:<26}  {}\n", command.word, command.text);
  return own(argc, argv);
}

int run_program(Command& app, int argc, char** argv, const CommonOptions& options,
                const std::function<int()>& body) {
  int parsed = -1;
  const int code = run_guarded(app.name(), options, [&] {
    if (!list_of_commands.empty()) app.footer(list_of_commands);
    parsed = app.parse(argc, argv);
    return parsed >= 0 ? parsed : body();
  });
  leave(code);
}

std::vector<std::string> arguments_of(int argc, char** argv) {
  return {argv + 1, argv + argc};
}

int thread_count(const CommonOptions& options) {
  if (options.threads > 0) return options.threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace drape
