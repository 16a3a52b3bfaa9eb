#include "runner.hpp"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "tensegrity/types.hpp"

namespace tensegrity::benchmarks {

double gauge() {
  constexpr std::size_t kBlocks = 31;
  constexpr int kProducts = 40;
  Matrix<double, 12> a, product;
  a.setConstant(0.5);
  hide(a);
  std::array<double, kBlocks> blocks;
  const auto cpu_time = [] {
    std::timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e9 * double(now.tv_sec) + double(now.tv_nsec);
  };
  for (double& block : blocks) {
    const double begin = cpu_time();
    for (int k = 0; k < kProducts; ++k) {
      product = a.lazyProduct(a);
      hide(product);
    }
    block = cpu_time() - begin;
  }
  // Of the middle one: an interruption lengthens a few.
  std::nth_element(blocks.begin(), blocks.begin() + kBlocks / 2, blocks.end());
  return blocks[kBlocks / 2] / kProducts;
}

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
