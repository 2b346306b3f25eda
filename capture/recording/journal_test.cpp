// SPDX-License-Identifier: Apache-2.0
#include "capture/recording/record.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <random>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"

namespace drape::capture {
namespace {

namespace fs = std::filesystem;

/// Stores sets endlessly and writes a byte to `acknowledged` after each.
[[noreturn]] void store_for_ever(const fs::path& folder, int acknowledged) {
  Journal journal(folder, "2026-01-31");
  for (std::size_t k = journal.recording().sets.size();; ++k) {
    const std::string name = "set_" + std::to_string(k), content(20'000 + 7 * k, 'x');
    Journal::write(journal.begin(name) / "cam0.png", content);
    FrameSet set{name, {}};
    set.frames.push_back({"cam0", name + "/cam0.png", sha256_of(content), 4, 3, std::nullopt});
    journal.add(std::move(set));
    if (::write(acknowledged, "s", 1) != 1) ::_exit(1);
  }
}

std::size_t bytes_in(int descriptor) {
  char buffer[256];
  std::size_t sum = 0;
  for (ssize_t got = 1; got > 0; sum += static_cast<std::size_t>(std::max<ssize_t>(got, 0)))
    got = ::read(descriptor, buffer, sizeof buffer);
  return sum;
}

TEST(Journal, AKilledCaptureLosesTheSetInHandAtMost) {
  test::TemporaryFolder temporary;
  const fs::path folder = temporary.path() / "recording";
  std::mt19937 random(1);
  std::size_t acknowledged = 0, kept = 0;
  const int kills = test::trial_count(30, 200);
  for (int k = 0; k < kills; ++k) {
    int pipe[2];
    ASSERT_EQ(::pipe2(pipe, O_CLOEXEC), 0);
    const pid_t child = ::fork();
    if (child == 0) store_for_ever(folder, pipe[1]);
    ::close(pipe[1]);
    // Two times in three after a set or two, whatever they take; else perhaps before the first.
    for (auto sets = random() % 3; sets > 0; --sets) {
      char byte = 0;
      ASSERT_EQ(::read(pipe[0], &byte, 1), 1);
      ++acknowledged;
    }
    ::usleep(static_cast<unsigned>(random() % 20'000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    acknowledged += bytes_in(pipe[0]);
    ::close(pipe[0]);
    Journal journal(folder, "2026-01-31");
    const std::size_t now = journal.recording().sets.size();
    ASSERT_GE(now, acknowledged);
    ASSERT_LE(now, kept + journal.adopted());
    for (std::size_t s = kept; s < now; ++s) {
      const FrameSet& set = journal.recording().sets[s];
      EXPECT_NO_THROW(static_cast<void>(read_frame(journal.recording(), set, set.frames[0])));
    }
    // Sets written completely but not acknowledged count from now on.
    kept = acknowledged = now;
  }
  EXPECT_GT(kept, 0U);
  std::printf("%d kills: %zu sets, none that was acknowledged lost\n", kills, kept);
  for (const auto& entry : fs::directory_iterator(folder))
    EXPECT_FALSE(entry.path().filename().string().starts_with(".")) << entry.path();
}

TEST(Journal, ASecondWriterIsRefusedInOneSentence) {
  test::TemporaryFolder temporary;
  const fs::path folder = temporary.path() / "recording";
  Journal first(folder, "2026-01-31");
  const Error error = test::error_of([&] { return Journal(folder, "2026-01-31"); });
  EXPECT_EQ(error.kind(), ErrorKind::bad_input);
  EXPECT_THAT(error.what(), testing::HasSubstr("another capture records into this folder"));
}

TEST(Journal, ACaptureThatStoredNothingLeavesNoFolder) {
  test::TemporaryFolder temporary;
  const fs::path folder = temporary.path() / "recording";
  { const Journal journal(folder, "2026-01-31"); }
  EXPECT_FALSE(fs::exists(folder));
}

TEST(Journal, ADamagedJournalIsNamed) {
  test::TemporaryFolder temporary;
  const fs::path folder = temporary.path() / "recording";
  write_durable(folder / "recording.journal",
                "{\"set\": {\"name\": \"../../etc\", \"frames\": []}}\n");
  EXPECT_THROW(Journal(folder, "2026-01-31"), Error);
  write_durable(folder / "recording.journal",
                "{\"set\": {\"name\": \"a\", \"frames\": [[1, 2]]}}\n");
  EXPECT_THROW(Journal(folder, "2026-01-31"), Error);
  for (const char* width : {"4294967300", "-1", "4.5"}) {
    write_durable(folder / "recording.journal",
                  std::string(R"({"set": {"name": "a", "frames": [{"camera": "cam0", )"
                              R"("file": "a/cam0.png", "sha256": "aa", "height_px": 3, )"
                              R"("width_px": )") +
                      width + "}]}}\n");
    EXPECT_THROW(Journal(folder, "2026-01-31"), Error) << width;
  }
  write_durable(folder / "recording.journal", "{\"set\": {\"name\": \"a\", \"fra");
  EXPECT_EQ(Journal(folder, "2026-01-31").adopted(), 0U);
}

}  // namespace
}  // namespace drape::capture
