// From a recording to its end: read the tables, estimate, say how far the robot rolled.
//
//   02_recording RECORDING
//
// RECORDING is a directory as docs/files.md describes it; `tensegrity simulate forward --out
// rolling` writes one.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <tensegrity/estimator/prism_estimator.hpp>
#include <vector>

namespace {

struct Line {
  tensegrity::Nanoseconds t;
  std::vector<double> values;  // an empty cell is NaN: not measured
};

std::vector<Line> read(const std::string& path) {
  std::ifstream file(path);
  std::string text, cell;
  std::getline(file, text);  // names of the columns
  std::vector<Line> lines;
  while (std::getline(file, text)) {
    std::istringstream cells(text + ',');  // the last cell may be empty, too
    std::getline(cells, cell, ',');
    Line line{std::atoll(cell.c_str()), {}};
    while (std::getline(cells, cell, ',')) {
      line.values.push_back(cell.empty() ? std::nan("") : std::atof(cell.c_str()));
    }
    lines.push_back(line);
  }
  if (lines.empty()) {
    std::fprintf(stderr, "%s: cannot be read, or holds no samples\n", path.c_str());
    std::exit(2);
  }
  return lines;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: 02_recording RECORDING\n");
    return 2;
  }
  const std::string recording = argv[1];
  const std::vector<Line> imu = read(recording + "/imu.csv");
  const std::vector<Line> cables = read(recording + "/cables.csv");
  const std::vector<Line> contacts = read(recording + "/contacts.csv");

  tensegrity::PrismEstimator<double> estimator;
  double path = 0;  // m
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  std::size_t next_cables = 0, next_contacts = 0;
  // Samples in the order of `tensegrity.estimate`: of one stamp the IMU comes first.
  const auto feed_before = [&](tensegrity::Nanoseconds end) {
    for (; next_contacts < contacts.size() && contacts[next_contacts].t < end; ++next_contacts) {
      std::array<bool, 6> flags{};
      for (std::size_t i = 0; i < 6; ++i) flags[i] = contacts[next_contacts].values.at(i) > 0.5;
      estimator.contacts(contacts[next_contacts].t, flags);
    }
    for (; next_cables < cables.size() && cables[next_cables].t < end; ++next_cables) {
      estimator.cables(cables[next_cables].t,
                       tensegrity::CableLengths<double>(cables[next_cables].values.data()));
    }
  };
  for (const Line& sample : imu) {
    feed_before(sample.t);
    estimator.imu(sample.t, Eigen::Vector3d(sample.values.data()),
                  Eigen::Vector3d(sample.values.data() + 3));
    feed_before(sample.t + 1);
    const auto state = estimator.state();
    if (!state.initialized) continue;
    path += (state.position - last).norm();
    last = state.position;
  }

  const auto state = estimator.state();
  if (!state.initialized) {
    std::printf("the robot never stood still: nothing was estimated\n");
    return 1;
  }
  std::printf("%zu IMU samples, %u dropped; %u cable lengths rejected\n", imu.size(),
              state.health.imu_dropped, state.health.cables_rejected);
  std::printf("rolled %.2f m, to (%.2f, %.2f) m with %.2f m of standard deviation\n", path,
              last.x(), last.y(), std::sqrt(state.position_covariance.trace()));
}
