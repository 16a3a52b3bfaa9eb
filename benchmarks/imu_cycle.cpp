// Time of one IMU cycle of each method on a recording: the IMU sample, and the cables and contacts
// that are due with it.
//
//   cmake -S . -B build/bench -DTENSEGRITY_BUILD_BENCHMARKS=ON -DTENSEGRITY_NATIVE=ON
//   cmake --build build/bench && build/bench/benchmarks/imu_cycle ../shared/data/prism3/right
//
// Prints the median over all cycles after the start of each of several replays, and the least and
// greatest of these medians. Reading the clock costs some 20 ns of it.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tensegrity/estimator/prism_estimator.hpp"

namespace {

using tensegrity::Nanoseconds;
using tensegrity::PrismConfig;
using tensegrity::PrismEstimator;
using Clock = std::chrono::steady_clock;

struct Sample {
  Nanoseconds t;
  std::vector<double> values;
};

// A table with stamps in its first column; an empty cell is NaN.
std::vector<Sample> read(const std::string& path) {
  std::ifstream file(path);
  if (!file) {
    std::fprintf(stderr, "%s: cannot be read\n", path.c_str());
    std::exit(2);
  }
  std::vector<Sample> samples;
  std::string line, cell;
  std::getline(file, line);  // names
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    std::getline(cells, cell, ',');
    Sample sample{std::stoll(cell), {}};
    while (std::getline(cells, cell, ',')) {
      sample.values.push_back(cell.empty() ? std::nan("") : std::stod(cell));
    }
    samples.push_back(sample);
  }
  return samples;
}

struct Recording {
  std::vector<Sample> imu, cables, contacts;
};

template <typename Filter>
double median_cycle(const Recording& recording) {
  PrismEstimator<double, Filter> estimator({}, PrismConfig<double>{});
  std::vector<double> cycles;
  std::size_t next_cables = 0, next_contacts = 0;
  for (const Sample& imu : recording.imu) {
    const auto begin = Clock::now();
    for (;
         next_contacts < recording.contacts.size() && recording.contacts[next_contacts].t <= imu.t;
         ++next_contacts) {
      std::array<bool, 6> flags;
      for (std::size_t i = 0; i < 6; ++i) {
        flags[i] = recording.contacts[next_contacts].values[i] > 0.5;
      }
      estimator.contacts(recording.contacts[next_contacts].t, flags);
    }
    for (; next_cables < recording.cables.size() && recording.cables[next_cables].t <= imu.t;
         ++next_cables) {
      const auto& lengths = recording.cables[next_cables].values;
      estimator.cables(recording.cables[next_cables].t,
                       Eigen::Map<const tensegrity::CableLengths<double>>(lengths.data()));
    }
    estimator.imu(imu.t, Eigen::Map<const Eigen::Vector3d>(imu.values.data()),
                  Eigen::Map<const Eigen::Vector3d>(imu.values.data() + 3));
    const std::chrono::duration<double, std::micro> cycle = Clock::now() - begin;
    if (estimator.initialized()) cycles.push_back(cycle.count());
  }
  if (cycles.empty()) {
    std::fprintf(stderr, "the robot never stood still: nothing to measure\n");
    std::exit(2);
  }
  const auto middle = cycles.begin() + std::ptrdiff_t(cycles.size() / 2);
  std::nth_element(cycles.begin(), middle, cycles.end());
  return *middle;
}

template <typename Filter>
void report(const char* name, const Recording& recording) {
  constexpr int kReplays = 7;
  std::vector<double> medians;
  for (int k = 0; k < kReplays; ++k) medians.push_back(median_cycle<Filter>(recording));
  std::sort(medians.begin(), medians.end());
  std::printf("%s: %.2f us (%.2f to %.2f)\n", name, medians[kReplays / 2], medians.front(),
              medians.back());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: imu_cycle RECORDING\n");
    return 2;
  }
  const std::string folder = std::string(argv[1]) + "/";
  const Recording recording{read(folder + "imu.csv"), read(folder + "cables.csv"),
                            read(folder + "contacts.csv")};
  report<tensegrity::LooseFilter<double>>("paper", recording);
  report<tensegrity::TightFilter<double>>("full", recording);
}
