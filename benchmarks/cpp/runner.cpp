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
  if (counts_) {
    mark();
    mark();
    marked("mark", 1);  // what a mark itself costs
  }
}

void Program::marked(const std::string& name, int calls) const {
  std::printf("%s %d\n", name.c_str(), calls);
}

int Program::run() {
  if (!counts_) benchmark::RunSpecifiedBenchmarks();
  for (const auto& count : counted_) count();
  return 0;
}

}  // namespace tensegrity::benchmarks
