#include "runner.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace tensegrity::benchmarks {

Program::Program(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  filter_ = benchmark::GetBenchmarkFilter();
  for (int k = 1; k < argc; ++k) {
    if (std::strcmp(argv[k], "--count") == 0) {
      counts_ = true;
    } else if (argv[k][0] == '-') {
      std::fprintf(stderr, "%s: unknown flag\n", argv[k]);
      std::exit(2);
    } else {
      recordings_.push_back(argv[k]);
    }
  }
  if (counts_ && !RUNNING_ON_VALGRIND) {
    std::fprintf(stderr, "--count needs valgrind --tool=callgrind\n");
    std::exit(2);
  }
}

int Program::run() {
  if (!counts_) {
    benchmark::RunSpecifiedBenchmarks();
    return 0;
  }
  for (const Counted& counted : counted_) {
    counted.run();
    std::printf("%s %d\n", counted.name.c_str(), counted.repeats.calls * counted.repeats.counted);
  }
  return 0;
}

}  // namespace tensegrity::benchmarks
