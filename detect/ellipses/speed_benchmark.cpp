// SPDX-License-Identifier: Apache-2.0
// Benchmark from pixels to labels on one core: bench1's drapes (1600x1200 px, 121 dots, 50 tags).
#include <benchmark/benchmark.h>

#include "detect/detect.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {

using namespace detect;

namespace {

struct Bench {
  Rig rig = read_rig(source_root() / "rigs/bench1/rig.toml");
  Recording recording = read_recording(rig.recording);
  PrintPlane plane = plane_of(read_print(rig.print_file));
  std::vector<GreyImage> frames;

  Bench() {
    for (const char* name : {"drape_A", "drape_C", "drape_E"}) {
      const FrameSet& set = recording.set(name);
      for (const RecordedFrame& frame : set.frames) {
        frames.push_back(decode_image(read_frame(recording, set, frame), 1600, 1200, {}));
      }
    }
  }
};

const Bench& bench() {
  static const Bench loaded;
  return loaded;
}

void pixels_to_labels(benchmark::State& state) {
  const GreyImage& image = bench().frames[state.range(0)];
  TagFinder finder(bench().plane.tag_family);
  std::size_t marks = 0;
  for (auto _ : state) marks = detect_frame(image, bench().plane, finder, {}).detections.size();
  state.counters["marks"] = static_cast<double>(marks);
}
BENCHMARK(pixels_to_labels)->DenseRange(0, 8)->Unit(benchmark::kMillisecond);

void estimate_noise_of_frame(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(estimate_noise(bench().frames[0]));
}
BENCHMARK(estimate_noise_of_frame)->Unit(benchmark::kMillisecond);

void find_blobs_of_frame(benchmark::State& state) {
  const NoiseModel noise = estimate_noise(bench().frames[0]);
  for (auto _ : state)
    benchmark::DoNotOptimize(find_blobs(bench().frames[0], noise, DotSizes::around(8.5)));
}
BENCHMARK(find_blobs_of_frame)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace drape::test
