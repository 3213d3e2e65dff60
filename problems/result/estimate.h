// The result of every estimator: one estimate for each window, with the arc that it predicts.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "problems/common/units.h"

namespace trueline {

struct ParameterEstimate {
  std::string name;
  double value;
  double sigma;
  std::string unit;
  std::string status;  // identified | weak | unobservable | at_bound
  // By the noise model alone, where `sigma` contains what that lacks; 0: `sigma`.
  double model_sigma = 0.0;
};

struct FixMisfit {
  TimeNs t;
  int gate;
  Eigen::Vector3d error;  // m, trajectory less fix, in E
  double sigma;           // m
  double weight;          // of the robust loss, 1 inside its threshold
};

struct TrajectoryPoint {
  TimeNs t;
  Eigen::Vector3d p_E;  // m
  Eigen::Vector3d v_E;  // m/s
};

// The prediction at the end of an arc (first fix of the next pass), and the truth there.
struct ArcPrediction {
  TimeNs begin;                                       // end of the window's last pass
  TimeNs end;                                         // first fix of the next pass
  Eigen::Vector2d p_E = Eigen::Vector2d::Zero();      // m, predicted, horizontal
  Eigen::Matrix2d cov = Eigen::Matrix2d::Identity();  // m^2
  std::optional<Eigen::Vector2d> truth;  // m; empty where the log has none at that time
  std::string truth_source;              // mocap | fixes | none
  // m, of each axis of the truth (on a flight without gates, against the last fix of the window);
  // zero for mocap.
  double truth_sigma = 0.0;

  // Final-point error Delta_f (Li et al. 2019, eq. 34-35), m; truth must be there.
  double FinalPointError() const { return (*truth - p_E).norm(); }
  // Whether the truth lies inside of the 95 % ellipse.
  bool Inside95() const {
    const Eigen::Vector2d error = *truth - p_E;
    constexpr double kChi2With2Dof = 5.991;
    return error.dot(EndCov().inverse() * error) <= kChi2With2Dof;
  }
  // Of the truth about the prediction, m^2.
  Eigen::Matrix2d EndCov() const {
    return cov + truth_sigma * truth_sigma * Eigen::Matrix2d::Identity();
  }
  // Root of the mean variance of the two axes, m.
  double PredictedSigma() const { return std::sqrt(0.5 * EndCov().trace()); }
};

struct WindowEstimate {
  int tau = 0;    // number of the window's last pass, from 1
  int gamma = 0;  // passes in the window (fewer at the flight's start and after gaps)
  TimeNs begin = 0;
  TimeNs end = 0;  // of the last pass
  std::vector<ParameterEstimate> parameters;
  std::vector<std::string> unobservable;  // unobservable combinations, in words
  std::vector<FixMisfit> misfits;
  std::vector<TrajectoryPoint> fitted;           // over the window's last pass
  std::vector<TrajectoryPoint> predicted;        // over the arc
  std::optional<ArcPrediction> arc;              // none after the last pass
  std::optional<ParameterEstimate> fix_latency;  // s, where it is a nuisance
  int iterations = 0;
  bool converged = false;
  double cost = 0.0;
  double solve_time = 0.0;  // s
};

// One estimator at one gamma over one flight.
struct EstimatorRun {
  std::string estimator;
  int gamma = 0;
  std::vector<WindowEstimate> windows;
  std::vector<std::string> warnings;
  std::vector<int> false_passes = {};  // indices of passes judged false
};

}  // namespace trueline
