// The filter of Wuest et al. 2019 ("Online estimation of geometric and inertia parameters for
// multirotor aerial vehicles"), on the rotor-driven model in NED: 31 states, 30 of them in the
// error state; rotor speeds are its input, IMU and poses (or positions) its updates, and constants
// may wander as Wiener processes. Jacobians are automatic (rotor_data/rotor_slopes.h: Jets of four
// columns at a time, 1.1 times the time of the filter with derivatives written out by hand).
//
// It differs from the paper in two points. The accelerometer feels the disturbance that also moves
// the vehicle: the disturbance held over an IMU period is a state of its own for that period, so
// that reading and motion are correlated as they really are. And the first seconds are flown
// several times: accelerations go with 1 / m and 1 / I, so that a guess of I at 0.4 of the truth
// makes readings look 6 times as telling of I as they are, and an extended filter is certain of the
// wrong value before it has seen the right one. Each pass starts from the same prior and is
// linearised at the constants where the pass before ended (Gauss-Newton over these seconds); from
// there on the filter goes on as usual.
#pragma once

#include <optional>
#include <vector>

#include "problems/rotor_data/rotor_data.h"
#include "problems/rotor_data/rotor_noise.h"
#include "problems/rotor_data/rotor_prior.h"

namespace trueline {

struct RotorEkfOptions {
  RotorNoise noise;
  RotorPrior prior;
  // Densities of the constants' Wiener processes, as shares of their prior sigma, 1/sqrt(s).
  double wander = 0.0;
  // Sigmas of the moving state before the first pose.
  double sigma_attitude = 0.2;  // rad
  double sigma_position = 1.0;  // m
  double sigma_velocity = 1.0;  // m/s
  double sigma_rate = 1.0;      // rad/s
  double start_seconds = 2.0;   // s, that are flown several times
  int passes = 8;               // of them, at most; 0: an ordinary extended filter from the start
  // That the first pass is linearised at; left out: the prior's mean.
  std::optional<RotorConstants> point = {};
  // RotorEkfRun::likelihoods of another run on the same flight, or null: a run that falls far
  // behind ends, with a log likelihood of minus infinity.
  const std::vector<double>* rival = nullptr;
};

// Estimates at one time.
struct RotorEstimate {
  double t;  // s
  RotorNode moving;
  RotorConstants mean;
  RotorConstants sigma;  // zero for what is known
};

struct RotorEkfRun {
  std::vector<RotorEstimate> history;  // after each pose; the last pass over the first seconds
  RotorState state;                    // at the end
  RotorErrorMatrix cov;
  RotorConstants point;  // that the first seconds are linearised at
  // Log likelihood of all innovations after the first second, for comparing options on one flight.
  double log_likelihood = 0.0;
  std::vector<double> likelihoods;  // the same up to each pose
};

// Filters the flight once, forward. A filter that diverges (not finite) throws InputError: the
// options do not fit the flight.
RotorEkfRun RunRotorEkf(const RotorAeroModel& model, const RotorData& data,
                        const RotorEkfOptions& options);

}  // namespace trueline
