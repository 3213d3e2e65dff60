// How a flight went, in numbers for the truth file and the table.
#pragma once

#include <algorithm>

#include "problems/simulation/simulate.h"

namespace trueline::simulation {

// What the flight's loop notes of how well the course was flown.
struct PathErrors {
  double squares = 0.0, largest = 0.0;
  int count = 0;

  void Note(double error) {
    squares += error * error;
    largest = std::max(largest, error);
    ++count;
  }
};

// Fills the truth's figures on the AHRS: angles of eq. 14's R_Ep_E over the log, their mean and
// spread, and the tilt they make.
void DescribeAhrs(SimulationTruth* truth);
// Fills its figures on speed and path.
void DescribeFlight(const PathErrors& errors, SimulationTruth* truth);

}  // namespace trueline::simulation
