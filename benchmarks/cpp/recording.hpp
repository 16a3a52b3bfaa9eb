// Recordings as the programs here read them: folders of CSV (docs/files.md).
#pragma once

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tensegrity/estimator/pending.hpp"
#include "tensegrity/robot/prism.hpp"

namespace tensegrity::benchmarks {

struct Sample {
  Nanoseconds t;
  std::vector<double> values;
};

// A table with stamps [ns] in its first column; an empty cell is NaN. Ends the program when there
// is none.
inline std::vector<Sample> read_table(const std::string& path) {
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

// "right" of "../shared/data/prism3/right/"
inline std::string recording_name(std::string folder) {
  while (!folder.empty() && folder.back() == '/') folder.pop_back();
  return folder.substr(folder.find_last_of('/') + 1);
}

// Nine cable lengths [m] a row.
inline std::vector<CableLengths<double>> read_lengths(const std::string& folder) {
  std::vector<CableLengths<double>> all;
  for (const Sample& sample : read_table(folder + "/cables.csv")) {
    all.push_back(Eigen::Map<const CableLengths<double>>(sample.values.data()));
  }
  return all;
}

}  // namespace tensegrity::benchmarks
