// Force and moment on a vehicle from its velocity, rate and rotor speeds, by the protocol of
// NeuroBEM (Bauersfeld et al. 2021): root mean square errors flight by flight, trained on other
// flights.
//
//   kind: wrench                # name, about, vehicle and numbers: prediction_experiment.h
//   other_mass: 0.752           # kg, of which published predictions were made
//   force_sigma: [0.1, 0.1, 0.3]        # N, weights of the fit
//   moment_sigma: [0.2, 0.2, 0.02]      # N m; large: moments do not move the forces' numbers
//   stride: 5                           # every fifth row is fitted; all rows are scored
//   folds: [{test: FILE, train: [FILE, ...]}]  # in --data, without .csv.gz
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cost_functions/wrench_residual.h"
#include "problems/prediction/prediction_experiment.h"

namespace trueline {

// Which part of the rotors' moment turns a vehicle that an autopilot holds.
//
// Below about 3 Hz the rotors mostly cancel moments that no log shows (gusts, a rotor's wake, a
// centre of mass that is off): integrated, their moment would turn the vehicle several times too
// far. Above, it turns the vehicle, somewhat late. Both are two linear filters of the rows before.

// rad/s^2 or N m about roll and pitch, a column a row.
using LevelMoments = Eigen::Matrix<double, 2, Eigen::Dynamic>;

struct MomentWashout {
  double washout = 0.1;  // s, time constant of a high-pass of order two
  double lag = 0.01;     // s, time constant of a low-pass of order one

  // `moment` at the times t (s), by its past alone.
  LevelMoments Of(const LevelMoments& moment, const Eigen::VectorXd& t) const;
};

struct MomentRecord {
  Eigen::VectorXd t;  // s
  LevelMoments measured, modelled;
};

// The washout with which the modelled moments, times a share for each axis, are closest to the
// measured ones.
MomentWashout FitMomentWashout(const std::vector<MomentRecord>& flights);

// Regression of `measured` on `modelled` through the origin; 1 where nothing is modelled.
double ShareOf(const Eigen::MatrixXd& measured, const Eigen::MatrixXd& modelled);

// Flights of the NeuroBEM data set.
struct WrenchFlight {
  std::string name;
  std::vector<WrenchRow> rows;
  // Published predictions of the same rows where the file has them: force [N], moment [N m].
  std::optional<Eigen::Matrix<double, 6, Eigen::Dynamic>> published;
};

// Reads FOLDER/NAME.csv.gz (or .csv).
WrenchFlight ReadWrenchFlight(const std::filesystem::path& folder, const std::string& name);

struct WrenchExperiment : PredictionExperiment {
  struct Fold {
    std::string test;
    std::vector<std::string> train;
  };
  PredictedVehicle vehicle;
  double other_mass = 0.0;                       // kg; 0 for none
  std::vector<FittedNumber> numbers;             // of FittedRotors
  Eigen::Vector3d force_sigma{0.1, 0.1, 0.3};    // N, weights of the fit
  Eigen::Vector3d moment_sigma{0.2, 0.2, 0.02};  // N m
  int stride = 5;
  std::vector<Fold> folds;

  // As stated, of which truth is computed: kg; kg m^2, 3 numbers.
  double mass() const { return vehicle.stated.parameters[RotorDrivenModel::kMass]; }
  const double* inertia() const { return &vehicle.stated.parameters[RotorDrivenModel::kInertia]; }
};

WrenchExperiment ReadWrenchExperiment(const std::filesystem::path& file);

// Root mean square errors by axis, N and N m, and over axes: F, M as NeuroBEM's table II.
struct WrenchErrors {
  Eigen::Vector3d force, moment;

  double F() const { return force.norm() / std::sqrt(3.0); }
  double M() const { return moment.norm() / std::sqrt(3.0); }
};

struct WrenchScore {
  std::string flight, predictor, reading;  // reading: what the truth is, or is corrected for
  WrenchErrors errors;
  int fitted_to = 0;  // flights; 0: not fitted here
};

struct WrenchFit {
  std::vector<double> numbers, sigmas;  // of FittedRotors
  // What turns the vehicle of the model's net moment: about roll and pitch its fast part, and of
  // that, as of the moment about yaw, a share, by regression of the measured moment on it. The rest
  // cancels disturbances. The stated inertia over the share is the inertia that the flight shows.
  MomentWashout washout;
  Eigen::Vector3d share = Eigen::Vector3d::Ones();
  int rows = 0;
};

struct WrenchFold {
  std::string test;
  std::vector<std::string> train;
  WrenchFit fit;
};

struct WrenchResult {
  std::vector<WrenchFold> folds;
  std::vector<WrenchScore> scores;
};

// Sigmas by the spread between sections of 5 s (sandwich). Throws InputError naming file and
// column.
WrenchResult RunWrenchExperiment(const WrenchExperiment& experiment,
                                 const std::filesystem::path& data, int threads, bool quiet);

// summary.yaml.
void WriteWrench(const WrenchExperiment& experiment, const WrenchResult& result,
                 const std::filesystem::path& directory);
std::string WrenchBrief(const WrenchResult& result);  // without the fitted numbers
std::string WrenchTable(const WrenchExperiment& experiment, const WrenchResult& result);

}  // namespace trueline
