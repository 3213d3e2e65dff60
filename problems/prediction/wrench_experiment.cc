#include "problems/prediction/wrench_experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "problems/common/error.h"
#include "problems/common/parallel.h"
#include "problems/common/yaml_archive.h"
#include "problems/prediction/fit_prediction.h"
#include "problems/prediction/prediction_run.h"

namespace trueline {
namespace {

constexpr double kShortest = 0.02, kLongest = 10.0;  // s, of the washout
constexpr double kLeastLag = 1e-4, kLongestLag = 0.1;

// First-order low-pass of each row of `values`, from its first value on.
LevelMoments LowPassed(const LevelMoments& values, const Eigen::VectorXd& t, double time) {
  LevelMoments low = values;
  for (Eigen::Index i = 1; i < values.cols(); ++i) {
    const double decay = std::exp(-std::max(0.0, t[i] - t[i - 1]) / time);
    low.col(i) = decay * low.col(i - 1) + (1.0 - decay) * values.col(i);
  }
  return low;
}

// Sum of squares that shares of the washed moments leave.
double Misfit(const MomentWashout& washout, const std::vector<MomentRecord>& flights) {
  Eigen::Array2d with = Eigen::Array2d::Zero(), square = with, whole = with;
  for (const MomentRecord& flight : flights) {
    const LevelMoments washed = washout.Of(flight.modelled, flight.t);
    with += flight.measured.cwiseProduct(washed).rowwise().sum().array();
    square += washed.rowwise().squaredNorm().array();
    whole += flight.measured.rowwise().squaredNorm().array();
  }
  return (whole - with.square() / square.max(1e-300)).sum();
}

}  // namespace

LevelMoments MomentWashout::Of(const LevelMoments& moment, const Eigen::VectorXd& t) const {
  LevelMoments washed = lag > kLeastLag ? LowPassed(moment, t, lag) : moment;
  for (int order = 0; order < 2; ++order) washed -= LowPassed(washed, t, washout);
  return washed;
}

MomentWashout FitMomentWashout(const std::vector<MomentRecord>& flights) {
  constexpr double kFirstStep = 0.7, kLeastStep = 0.02;  // of the logarithms
  MomentWashout best;
  double least = Misfit(best, flights);
  for (double step = kFirstStep; step > kLeastStep;) {
    bool moved = false;
    for (const auto& [washout, lag] : {std::array{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      const MomentWashout trial{
          std::clamp(best.washout * std::exp(washout * step), kShortest, kLongest),
          std::clamp(best.lag * std::exp(lag * step), kLeastLag, kLongestLag)};
      const double misfit = Misfit(trial, flights);
      if (misfit >= least) continue;
      least = misfit;
      best = trial;
      moved = true;
    }
    if (!moved) step *= 0.5;
  }
  return best;
}

double ShareOf(const Eigen::MatrixXd& measured, const Eigen::MatrixXd& modelled) {
  const double square = modelled.squaredNorm();
  return square > 0.0 ? measured.cwiseProduct(modelled).sum() / square : 1.0;
}

namespace {

const std::vector<std::string> kMeasured = {
    "t",     "vel x", "vel y", "vel z",     "ang vel x", "ang vel y", "ang vel z",
    "acc x", "acc y", "acc z", "ang acc x", "ang acc y", "ang acc z", "mot 1",
    "mot 2", "mot 3", "mot 4", "dmot 1",    "dmot 2",    "dmot 3",    "dmot 4"};
const std::vector<std::string> kPublished = {"bemnn_fx", "bemnn_fy", "bemnn_fz",
                                             "bemnn_tx", "bemnn_ty", "bemnn_tz"};

WrenchRow RowOf(const Eigen::VectorXd& values) {
  WrenchRow row;
  row.rotors.t = values[0];
  row.v = values.segment<3>(1);
  row.w = values.segment<3>(4);
  row.specific_force = values.segment<3>(7);
  row.dw = values.segment<3>(10);
  row.rotors.speeds = {values[13], values[14], values[15], values[16]};
  row.rotors.accelerations = {values[17], values[18], values[19], values[20]};
  return row;
}

}  // namespace

WrenchFlight ReadWrenchFlight(const std::filesystem::path& folder, const std::string& name) {
  std::filesystem::path file = folder / (name + ".csv.gz");
  if (!std::filesystem::exists(file)) file = folder / (name + ".csv");
  if (!std::filesystem::exists(file)) {
    throw InputError((folder / name).string() +
                     ".csv.gz: is missing; --data must hold the flights");
  }
  WrenchFlight flight;
  flight.name = name;
  const Eigen::MatrixXd values = ReadColumns(file, kMeasured);
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    flight.rows.push_back(RowOf(values.row(i).transpose()));
  }
  if (HasColumn(file, kPublished.front())) {
    flight.published = ReadColumns(file, kPublished).transpose();
  }
  return flight;
}

namespace {

using Wrenches = Eigen::Matrix<double, 6, Eigen::Dynamic>;
constexpr double kSection = 5.0;  // s, of the clusters behind the sigmas

constexpr int kMassNumber = FittedRotors::NumberOf(RotorDrivenModel::kMass);

// Measured force and moment of all rows.
Wrenches Measured(const WrenchFlight& flight, double mass, const double* inertia) {
  Wrenches truth(6, flight.rows.size());
  for (std::size_t i = 0; i < flight.rows.size(); ++i) {
    const WrenchRow& row = flight.rows[i];
    truth.col(i) << mass * row.specific_force,
        WrenchResidual::Moment<double>(inertia, row.dw, row.w);
  }
  return truth;
}

// Force and net moment by the model, the moment as it stands, before its share.
Wrenches Modelled(const FittedRotors& rotors, const WrenchFlight& flight,
                  const std::vector<double>& numbers) {
  Wrenches predicted(6, flight.rows.size());
  for (std::size_t i = 0; i < flight.rows.size(); ++i) {
    const auto wrench = WrenchResidual::Predict(rotors, flight.rows[i], numbers.data());
    predicted.col(i) << wrench.force, wrench.moment;
  }
  return predicted;
}

// Of the numbers that a fit leaves as they are.
std::vector<double> WrenchSigmas(const ceres::Problem& problem,
                                 const std::vector<ceres::ResidualBlockId>& blocks,
                                 const std::vector<int>& sections, const FreeNumbers& numbers,
                                 const std::vector<double>& x) {
  ClusterVariance variance(numbers.count());
  Eigen::Matrix<double, 6, 1> r;
  Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor> J(6, numbers.count());
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const double* parameters = x.data();
    double* jacobian = J.data();
    problem.GetCostFunctionForResidualBlock(blocks[i])->Evaluate(&parameters, r.data(), &jacobian);
    variance.Add(sections[i], J.transpose() * r, J.transpose() * J);
  }
  return numbers.Spread(variance.Sigmas());
}

MomentRecord RecordOf(const WrenchFlight& flight, const Wrenches& measured,
                      const Wrenches& modelled) {
  MomentRecord record{Eigen::VectorXd(measured.cols()), measured.middleRows<2>(3),
                      modelled.middleRows<2>(3)};
  for (std::size_t i = 0; i < flight.rows.size(); ++i) record.t[i] = flight.rows[i].rotors.t;
  return record;
}

// The part of the model's net moment that turns the vehicle.
void FitMoments(const WrenchExperiment& experiment, const FittedRotors& rotors, double mass,
                const std::vector<WrenchFlight>& flights, WrenchFit* fit) {
  std::vector<MomentRecord> records;
  std::array<Eigen::VectorXd, 3> measured, modelled;
  const auto append = [](const Eigen::VectorXd& more, Eigen::VectorXd* all) {
    Eigen::VectorXd both(all->size() + more.size());
    both << *all, more;
    *all = std::move(both);
  };
  std::vector<Wrenches> nets;
  for (const WrenchFlight& flight : flights) {
    const Wrenches truth = Measured(flight, mass, experiment.inertia());
    nets.push_back(Modelled(rotors, flight, fit->numbers));
    records.push_back(RecordOf(flight, truth, nets.back()));
    for (int axis = 0; axis < 3; ++axis) append(truth.row(3 + axis).transpose(), &measured[axis]);
  }
  fit->washout = FitMomentWashout(records);
  for (std::size_t i = 0; i < flights.size(); ++i) {
    nets[i].middleRows<2>(3) = fit->washout.Of(records[i].modelled, records[i].t);
    for (int axis = 0; axis < 3; ++axis) append(nets[i].row(3 + axis).transpose(), &modelled[axis]);
  }
  for (int axis = 0; axis < 3; ++axis) fit->share[axis] = ShareOf(measured[axis], modelled[axis]);
}

WrenchFit FitWrench(const WrenchExperiment& experiment, const std::vector<WrenchFlight>& flights,
                    double mass, int threads) {
  const FittedRotors rotors = experiment.vehicle.Model();
  std::vector<const WrenchRow*> rows;
  std::vector<int> sections;
  int base = 0;
  for (const WrenchFlight& flight : flights) {
    for (std::size_t i = 0; i < flight.rows.size(); i += experiment.stride) {
      rows.push_back(&flight.rows[i]);
      sections.push_back(
          base +
          static_cast<int>((flight.rows[i].rotors.t - flight.rows.front().rotors.t) / kSection));
    }
    base = sections.back() + 1;
  }
  std::vector<double> start;
  for (const FittedNumber& number : experiment.numbers) start.push_back(number.start);
  start[kMassNumber] = mass;
  const FreeNumbers numbers(experiment.numbers, start);
  const WrenchResidual::Options weights{experiment.force_sigma, experiment.moment_sigma};
  std::vector<double> x = numbers.Start();
  ceres::Problem problem;
  std::vector<ceres::ResidualBlockId> blocks;
  for (const WrenchRow* row : rows) {
    blocks.push_back(problem.AddResidualBlock(
        CostOf(WrenchResidual(rotors, numbers, *row, weights), numbers.count(), 6).release(),
        nullptr, x.data()));
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.num_threads = CoresFor(threads);
  SolveSilently(options, &problem);

  WrenchFit fit;
  fit.rows = static_cast<int>(rows.size());
  fit.numbers = numbers.At(x.data());
  fit.sigmas = WrenchSigmas(problem, blocks, sections, numbers, x);
  FitMoments(experiment, rotors, mass, flights, &fit);
  return fit;
}

WrenchErrors ErrorsOf(const Wrenches& truth, const Wrenches& predicted) {
  const Eigen::Matrix<double, 6, 1> rms =
      (truth - predicted).array().square().rowwise().mean().sqrt();
  return {rms.head<3>(), rms.tail<3>()};
}

// The best gain on fz, then the means of all errors removed, as the third figure of the protocol.
Wrenches Corrected(const Wrenches& truth, Wrenches predicted) {
  const Eigen::RowVectorXd t = truth.row(2).array() - truth.row(2).mean();
  const Eigen::RowVectorXd p = predicted.row(2).array() - predicted.row(2).mean();
  predicted.row(2) *= t.dot(p) / p.squaredNorm();
  predicted.colwise() += (truth - predicted).rowwise().mean().eval();
  return predicted;
}

void RunFold(const WrenchExperiment& experiment, const WrenchExperiment::Fold& fold,
             const std::filesystem::path& data, int threads, WrenchResult* result) {
  std::vector<WrenchFlight> training;
  for (const std::string& name : fold.train) training.push_back(ReadWrenchFlight(data, name));
  const WrenchFlight test = ReadWrenchFlight(data, fold.test);
  const auto is_of_test = [&](const WrenchFold& f) { return f.test == fold.test; };
  const bool first = std::ranges::none_of(result->folds, is_of_test);
  std::vector<double> masses = {experiment.mass()};
  if (experiment.other_mass > 0.0) masses.push_back(experiment.other_mass);
  for (const double mass : masses) {
    const WrenchFit fit = FitWrench(experiment, training, mass, threads);
    if (mass == experiment.mass()) result->folds.push_back({fold.test, fold.train, fit});
    const Wrenches truth = Measured(test, mass, experiment.inertia());
    Wrenches ours = Modelled(experiment.vehicle.Model(), test, fit.numbers);
    const MomentRecord record = RecordOf(test, truth, ours);
    ours.middleRows<2>(3) = fit.washout.Of(record.modelled, record.t);
    ours.bottomRows<3>() = fit.share.asDiagonal() * ours.bottomRows<3>().eval();
    const auto score = [&](const std::string& reading, auto&& reads) {
      const auto add = [&](const std::string& predictor, const Wrenches& predicted, int fitted_to) {
        result->scores.push_back(
            {test.name, predictor, reading, ErrorsOf(truth, reads(predicted)), fitted_to});
      };
      add("rotor by rotor", ours, static_cast<int>(fold.train.size()));
      if (first && test.published) add("BEM+NN, published", *test.published, 0);
    };
    score(fmt::format("{} kg", mass), [](const Wrenches& predicted) { return predicted; });
    if (first) {
      const WrenchErrors none = ErrorsOf(truth, Wrenches::Zero(6, truth.cols()));
      result->scores.push_back({test.name, "none", fmt::format("{} kg", mass), none});
    }
    if (mass != masses.front()) continue;  // the gain absorbs the mass
    score("fz gain, means removed",
          [&](const Wrenches& predicted) { return Corrected(truth, predicted); });
  }
}

}  // namespace

WrenchExperiment ReadWrenchExperiment(const std::filesystem::path& file) {
  const YamlMap map = YamlMap::FromFile(file);
  WrenchExperiment experiment;
  ReadHead(file, "wrench", map, &experiment);
  experiment.vehicle = ReadPredictedVehicle(map, &experiment.numbers);
  YamlArchive a(map);
  a.NotNegative("other_mass", &experiment.other_mass);
  experiment.force_sigma = map.GetVector3("force_sigma", experiment.force_sigma);
  experiment.moment_sigma = map.GetVector3("moment_sigma", experiment.moment_sigma);
  if (experiment.force_sigma.minCoeff() <= 0.0) map.Fail("force_sigma", "must be positive, in N");
  if (experiment.moment_sigma.minCoeff() <= 0.0) {
    map.Fail("moment_sigma", "must be positive, in N m");
  }
  a.Count("stride", &experiment.stride);
  for (const YamlMap& fold : map.Children("folds")) {
    experiment.folds.push_back(
        {fold.Get<std::string>("test"), fold.Get<std::vector<std::string>>("train")});
    const WrenchExperiment::Fold& added = experiment.folds.back();
    if (added.train.empty()) fold.Fail("train", "names no flight");
    if (std::count(added.train.begin(), added.train.end(), added.test) > 0) {
      fold.Fail("train", "holds the flight to test on");
    }
    fold.Finish();
  }
  if (experiment.folds.empty()) map.Fail("folds", "names no flight to test on");
  map.Finish();
  return experiment;
}

WrenchResult RunWrenchExperiment(const WrenchExperiment& experiment,
                                 const std::filesystem::path& data, int threads, bool quiet) {
  WrenchResult result;
  for (const WrenchExperiment::Fold& fold : experiment.folds) {
    if (!quiet) fmt::print(stderr, "testing on {}\n", fold.test);
    RunFold(experiment, fold, data, threads, &result);
  }
  return result;
}

}  // namespace trueline
