// The filter of Wuest et al. 2019 ("Online estimation of geometric and inertia parameters for
// multirotor aerial vehicles"), on the rotor-driven model in NED: 31 states, 30 of them in the
// error state; rotor speeds are its input, IMU and poses (or positions) its updates, and constants
// may wander as Wiener processes. Jacobians by automatic differentiation of the one model.
//
// It differs from the paper in one point: the accelerometer feels the disturbance that also moves
// the vehicle. The disturbance held over an IMU period is a state of its own for that period, so
// that reading and motion are correlated as they really are.
#pragma once

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
};

// Estimates at one time.
struct RotorEstimate {
  double t;  // s
  RotorNode moving;
  RotorConstants mean;
  RotorConstants sigma;  // zero for what is known
};

struct RotorEkfRun {
  std::vector<RotorEstimate> history;  // after each pose
  RotorState state;                    // at the end
  RotorErrorMatrix cov;
  // Log likelihood of all innovations after the first second, for comparing options on one flight.
  double log_likelihood = 0.0;
};

// Filters the flight once, forward. A filter that diverges (not finite) throws InputError: the
// options do not fit the flight.
RotorEkfRun RunRotorEkf(const RotorAeroModel& model, const RotorData& data,
                        const RotorEkfOptions& options);

}  // namespace trueline
