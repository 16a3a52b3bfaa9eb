// One cycle of each method on recordings: an IMU sample, and the contacts and cables of its stamp.
//
//   cycle RECORDING...           mean time of a cycle over everything after the start
//   cycle RECORDING... --each    median and worst cycle, as JSON: of each cycle the least of five
//                                replays counts, since interruptions only add
//   valgrind ... cycle RECORDING... --count
//                                instructions of every single call, by kind
#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>

#include "recording.hpp"
#include "runner.hpp"
#include "tensegrity/estimator/prism_estimator.hpp"

namespace {

using namespace tensegrity;
using benchmarks::Program;
using Clock = std::chrono::steady_clock;

// What is due at one IMU sample.
struct Cycle {
  Nanoseconds t;
  Vector3<double> gyro, accel;
  bool has_contacts = false, has_cables = false;
  std::array<bool, 6> flags{};
  CableLengths<double> lengths;
  Nanoseconds contacts_t = 0, cables_t = 0;
};

std::vector<Cycle> read_cycles(const std::string& folder) {
  const auto imu = benchmarks::read_table(folder + "/imu.csv");
  const auto cables = benchmarks::read_table(folder + "/cables.csv");
  const auto contacts = benchmarks::read_table(folder + "/contacts.csv");
  std::vector<Cycle> cycles;
  std::size_t cable = 0, contact = 0;
  for (const auto& sample : imu) {
    Cycle cycle;
    cycle.t = sample.t;
    cycle.gyro = Eigen::Map<const Vector3<double>>(sample.values.data());
    cycle.accel = Eigen::Map<const Vector3<double>>(sample.values.data() + 3);
    for (; contact < contacts.size() && contacts[contact].t <= sample.t; ++contact) {
      cycle.has_contacts = true;
      cycle.contacts_t = contacts[contact].t;
      for (std::size_t i = 0; i < 6; ++i) cycle.flags[i] = contacts[contact].values[i] > 0.5;
    }
    for (; cable < cables.size() && cables[cable].t <= sample.t; ++cable) {
      cycle.has_cables = true;
      cycle.cables_t = cables[cable].t;
      cycle.lengths = Eigen::Map<const CableLengths<double>>(cables[cable].values.data());
    }
    cycles.push_back(cycle);
  }
  return cycles;
}

// A recording up to the end of the still start, and what follows.
template <typename Filter>
struct Replay {
  PrismEstimator<double, Filter> at_start{{}, {}};
  std::vector<Cycle> cycles;

  explicit Replay(const std::string& folder) {
    const std::vector<Cycle> all = read_cycles(folder);
    std::size_t k = 0;
    for (; k < all.size() && !at_start.initialized(); ++k) feed(at_start, all[k]);
    cycles.assign(all.begin() + std::ptrdiff_t(k), all.end());
    if (cycles.empty()) {
      std::fprintf(stderr, "%s: the robot never stood still\n", folder.c_str());
      std::exit(2);
    }
  }

  static void feed(PrismEstimator<double, Filter>& estimator, const Cycle& cycle) {
    estimator.imu(cycle.t, cycle.gyro, cycle.accel);
    if (cycle.has_contacts) estimator.contacts(cycle.contacts_t, cycle.flags);
    if (cycle.has_cables) estimator.cables(cycle.cables_t, cycle.lengths);
  }
};

template <typename Filter>
void add_case(Program& program, const std::string& name, const std::string& folder) {
  const Replay<Filter> replay(folder);
  program.add(name,
              [replay] {
                return [replay, estimator = replay.at_start]() mutable {
                  estimator = replay.at_start;
                  for (const Cycle& cycle : replay.cycles) replay.feed(estimator, cycle);
                };
              },
              {int(replay.cycles.size()), 1});
}

template <typename Filter>
void print_each(const std::string& name, const std::string& folder, const char* end) {
  const Replay<Filter> replay(folder);
  std::vector<double> least(replay.cycles.size(), std::numeric_limits<double>::max());
  for (int k = 0; k < 5; ++k) {
    auto estimator = replay.at_start;
    for (std::size_t i = 0; i < least.size(); ++i) {
      const auto begin = Clock::now();
      replay.feed(estimator, replay.cycles[i]);
      const std::chrono::duration<double, std::nano> time = Clock::now() - begin;
      least[i] = std::min(least[i], time.count());
    }
  }
  std::sort(least.begin(), least.end());
  std::printf("  \"%s\": {\"median_ns\": %.0f, \"worst_ns\": %.0f}%s\n", name.c_str(),
              least[least.size() / 2], least.back(), end);
}

// Every call by itself.
template <typename Filter>
void count_each(const Program& program, const std::string& name, const std::string& folder) {
  const Replay<Filter> replay(folder);
  auto estimator = replay.at_start;
  const auto count = [&](const char* kind, const auto& call) {
    benchmarks::mark();
    call();
    benchmarks::mark();
    program.marked(name + "/" + kind, 1);
  };
  for (const Cycle& cycle : replay.cycles) {
    count("imu", [&] { estimator.imu(cycle.t, cycle.gyro, cycle.accel); });
    if (cycle.has_contacts) {
      count("contacts", [&] { estimator.contacts(cycle.contacts_t, cycle.flags); });
    }
    if (cycle.has_cables) {
      count("cables", [&] { estimator.cables(cycle.cables_t, cycle.lengths); });
    }
  }
}

template <typename Call>
void for_each_case(const std::vector<std::string>& recordings, const Call& call) {
  for (const std::string& folder : recordings) {
    const std::string suffix = "/" + benchmarks::recording_name(folder);
    call(LooseFilter<double>(Prism<double>(), PrismConfig<double>()), "cycle/paper" + suffix,
         folder, false);
    call(TightFilter<double>(Prism<double>(), PrismConfig<double>()), "cycle/full" + suffix, folder,
         folder == recordings.back());
  }
}

}  // namespace

int main(int argc, char** argv) {
  char** const end = std::remove_if(argv + 1, argv + argc,
                                    [](const char* a) { return std::strcmp(a, "--each") == 0; });
  const bool each = end != argv + argc;
  Program program(int(end - argv), argv);
  if (each) std::printf("{\n");
  for_each_case(program.recordings(), [&](const auto& filter, const std::string& name,
                                          const std::string& folder, bool last) {
    using Filter = std::decay_t<decltype(filter)>;
    if (each) {
      print_each<Filter>(name, folder, last ? "" : ",");
    } else if (program.counts()) {
      if (program.wants(name)) count_each<Filter>(program, name, folder);
    } else {
      add_case<Filter>(program, name, folder);
    }
  });
  if (each) std::printf("}\n");
  return each || program.counts() ? 0 : program.run();
}
