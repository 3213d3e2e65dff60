// Statistics of a flight for the truth file and the table.
#pragma once

#include <algorithm>
#include <cmath>

#include "problems/simulation/simulate.h"

namespace trueline::simulation {

// Path errors, accumulated during the flight.
struct PathErrors {
  double squares = 0.0, largest = 0.0;
  int count = 0;

  void Note(double error) {
    squares += error * error;
    largest = std::max(largest, error);
    ++count;
  }
  double Rms() const { return std::sqrt(squares / std::max(1, count)); }
};

// Fills in the truth's AHRS statistics: angles of eq. 14's R_Ep_E over the log, their mean and
// spread, and the resulting tilt.
void DescribeAhrs(SimulationTruth* truth);
// Fills in the statistics of speed, path and accelerometer bias.
void DescribeFlight(const PathErrors& errors, SimulationTruth* truth);

}  // namespace trueline::simulation
