// Cases of a benchmark program. One binary does both: time, by Google Benchmark, and instructions,
// when it runs under callgrind with `--count`.
#pragma once

#include <benchmark/benchmark.h>
#include <valgrind/valgrind.h>

#include <algorithm>
#include <functional>
#include <regex>
#include <string>
#include <vector>

namespace tensegrity::benchmarks {

// How a case repeats itself.
struct Repeats {
  int calls = 1;      // what one call of the case stands for: samples of a replay, for instance
  int counted = 256;  // calls of the case that are counted under callgrind; 0: too slow there
  double bytes = 0;   // memory the case allocates before its first call, where that is of interest
};

// Hides from the optimiser what a case holds: the next call finds values it cannot foresee, and
// everything the last one left has to be there.
template <typename Case>
void hide(Case& it) {
  auto* address = &it;
  benchmark::DoNotOptimize(address);
  benchmark::ClobberMemory();
}

// How long a fixed piece of work takes at this moment [ns]: longer while another thread computes on
// the same core. Threads share a core's units, so that even work that is timed by its own CPU time
// takes up to twice as long then.
double gauge();

// Has callgrind write its counter of instructions to its log.
inline void mark() { VALGRIND_MONITOR_COMMAND("status internal"); }

class Program {
 public:
  // Flags of Google Benchmark, `--count`, and whatever else is left: recordings.
  Program(int argc, char** argv);

  const std::vector<std::string>& recordings() const { return recordings_; }
  bool counts() const { return counts_; }
  // Whether `--benchmark_filter` asks for this case. Google Benchmark sees to it for times.
  bool wants(const std::string& name) const { return std::regex_search(name, filter_); }

  // `prepare()` returns the call that is measured, with all that it needs inside.
  template <typename Prepare>
  void add(const std::string& name, const Prepare& prepare, const Repeats& repeats = {}) {
    if (counts_) {
      if (repeats.counted == 0 || !wants(name)) return;
      counted_.push_back([this, prepare, repeats, name] {
        auto call = prepare();
        call();  // what only the first call does
        mark();
        for (int k = 0; k < repeats.counted; ++k) {
          hide(call);
          call();
        }
        hide(call);
        mark();
        marked(name, repeats.calls * repeats.counted);
      });
      return;
    }
    benchmark::RegisterBenchmark(name.c_str(), [prepare, repeats](benchmark::State& state) {
      auto call = prepare();
      const double before = gauge();
      for (auto _ : state) {
        hide(call);
        call();
      }
      hide(call);
      state.counters["gauge"] = std::max(before, gauge());
      state.counters["calls"] = repeats.calls;
      state.counters["bytes"] = repeats.bytes;
    });
  }

  // What was between the last two marks: a line of the output.
  void marked(const std::string& name, int calls) const;

  // Measures all of it.
  int run();

 private:
  std::vector<std::string> recordings_;
  std::vector<std::function<void()>> counted_;
  bool counts_ = false;
  std::regex filter_;
};

}  // namespace tensegrity::benchmarks
