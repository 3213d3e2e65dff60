// The filter of Wuest et al. 2019 ("Online estimation of geometric and inertia parameters for
// multirotor aerial vehicles"), on the rotor-driven model in NED. With the paper's 18 constants
// free the state has 31 numbers and the error state 30, beside the drift. Rotor speeds are the
// input, IMU and poses (or positions) the updates. Constants may do random walks (Wiener
// processes). Jacobians: rotor_slopes.h.
//
// It differs from the paper in three points. First, an unmodelled angular acceleration that lasts
// (the drift of RotorNoise) is a state; where its sigma is zero it changes nothing. Second, the
// accelerometer measures the disturbance that also moves the vehicle: the disturbance held over an
// IMU period is a state for that period, so reading and motion are correlated. Third, the first
// seconds are filtered several times. Accelerations are proportional to 1 / m and 1 / I, so that at
// a guess of I of 0.4 times the truth the readings' Jacobian by I is 6 times too large, and an
// extended filter becomes certain of a wrong value. Each pass starts from the same prior and is
// linearised at the constants where the last pass ended (Gauss-Newton over these seconds); after
// them the filter runs once, as usual.
#pragma once

#include <optional>
#include <vector>

#include "problems/rotor/rotor_data.h"
#include "problems/rotor/rotor_state.h"
#include "problems/rotor/rotor_vehicle.h"

namespace trueline {

// Predictions without measurements: what the filter states against the pose measured then.
struct RotorForecastOptions {
  std::vector<double> horizons;  // s
  double spacing = 0.1;          // s, between starts
  double first = 1.0;            // s after the first pose, in which the filter converges
};

struct RotorForecast {
  double t;        // s, of the start
  double horizon;  // s
  double error;    // m, between predicted and measured position of P
  // Probability of the stated ellipsoid through the measured position: uniform in [0, 1] where
  // errors are as large as stated.
  double rank;
};

struct RotorEkfOptions {
  RotorNoise noise;
  RotorPrior prior;
  // Densities of the constants' Wiener processes, as shares of their prior sigma, 1/sqrt(s).
  double wander = 0.0;
  // The start of the flight is filtered up to so many times; 0: an ordinary extended filter.
  int passes = 8;
  // Linearisation point of the first pass; the prior's mean if left out.
  std::optional<RotorConstants> point = {};
  // RotorEkfRun::likelihoods of another run on the same flight, or null. A run that falls far
  // behind the rival stops, with a log likelihood of minus infinity.
  const std::vector<double>* rival = nullptr;
  RotorForecastOptions forecast = {};
};

// Estimates at one time.
struct RotorEstimate {
  double t;  // s
  RotorNode node;
  RotorConstants mean;
  RotorConstants sigma;  // zero for what is known
};

struct RotorEkfRun {
  std::vector<RotorEstimate> history;  // after each pose; the last pass over the first seconds
                                       // counts
  RotorState state;                    // at the end
  RotorErrorMatrix cov;
  RotorConstants point;  // linearisation point in the first seconds
  // Log likelihood of all innovations after the first second; compares options on one flight.
  double log_likelihood = 0.0;
  std::vector<double> likelihoods;  // the same up to each pose
  std::vector<RotorForecast> forecasts;
};

// Filters the flight once, forward. Throws InputError if the filter diverges (not finite): the
// options do not fit the flight.
RotorEkfRun RunRotorEkf(const RotorAeroModel& model, const RotorData& data,
                        const RotorEkfOptions& options);
// The same; a filter that diverges gets the log likelihood minus infinity.
RotorEkfRun RunOrDiverge(const RotorAeroModel& model, const RotorData& data,
                         const RotorEkfOptions& options);

}  // namespace trueline
