// Force and moment experiments on made flights: numbers come back, scores are those by hand.
#include "problems/prediction/wrench_experiment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "tests/common/test_files.h"

namespace trueline {
namespace {

WrenchExperiment Shipped() {
  return ReadWrenchExperiment(std::filesystem::path(TRUELINE_TEST_SOURCE_DIR) /
                              "config/experiments/neurobem.yaml");
}

std::size_t IndexOf(const std::string& name, const WrenchExperiment& experiment) {
  return std::ranges::find(experiment.numbers, name, &FittedNumber::name) -
         experiment.numbers.begin();
}

std::vector<double> Numbers(const WrenchExperiment& experiment) {
  std::vector<double> numbers;
  for (const FittedNumber& number : experiment.numbers) numbers.push_back(number.start);
  for (const auto& [name, value] : {std::pair{"inflow", 1e-5}, {"k_f", 1.1}, {"r_BI_z", -0.02}}) {
    numbers[IndexOf(name, experiment)] = value;
  }
  return numbers;
}

// A flight in which the controller cancels most of a disturbing moment, as measured ones do: the
// rotors' differences are large where the vehicle hardly turns.
void WriteFlight(const WrenchExperiment& experiment, const std::filesystem::path& file, int seed) {
  std::mt19937 random(static_cast<unsigned>(seed));
  std::normal_distribution<double> normal;
  const FittedRotors rotors = experiment.vehicle.Model();
  const std::vector<double> numbers = Numbers(experiment);
  std::ofstream out(file);
  out << "t,vel x,vel y,vel z,ang vel x,ang vel y,ang vel z,acc x,acc y,acc z,ang acc x,ang acc y,"
         "ang acc z,mot 1,mot 2,mot 3,mot 4,dmot 1,dmot 2,dmot 3,dmot 4\n";
  for (int i = 0; i < 6000; ++i) {
    WrenchRow row;
    row.rotors.t = 0.01 * i;
    row.v = Eigen::Vector3d(4.0 * normal(random), 4.0 * normal(random), normal(random));
    row.w = Eigen::Vector3d(normal(random), normal(random), normal(random));
    for (int r = 0; r < 4; ++r) {
      row.rotors.speeds.push_back(1130.0 + 40.0 * normal(random));
      row.rotors.accelerations.push_back(500.0 * normal(random));
    }
    const auto pushed = rotors.At<double>(numbers.data(), row.v, row.w, row.rotors);
    row.dw = 0.3 * pushed.turn;  // the rest cancels the disturbance
    const Eigen::Vector3d arm(0.0, 0.0, 0.02);
    row.specific_force = pushed.force + row.dw.cross(arm) + row.w.cross(row.w.cross(arm));
    out << row.rotors.t;
    for (const Eigen::Vector3d& v : {row.v, row.w, row.specific_force, row.dw}) {
      out << ',' << v.x() << ',' << v.y() << ',' << v.z();
    }
    for (const double speed : row.rotors.speeds) out << ',' << speed;
    for (const double acceleration : row.rotors.accelerations) out << ',' << acceleration;
    out << '\n';
  }
}

TEST(WrenchErrors, AreMeansOverComponents) {
  const WrenchErrors errors{{0.065, 0.056, 0.235}, {0.004, 0.003, 0.002}};
  EXPECT_NEAR(errors.F(), 0.144, 5e-4);  // NeuroBEM on Figure-8_1 against 0.772 kg
}

TEST(WrenchExperiment, ForcesComeBackAndTheMomentsShare) {
  const TestFolder folder;
  WrenchExperiment experiment = Shipped();
  experiment.folds = {{"b", {"a"}}};
  experiment.numbers[IndexOf("inflow", experiment)].free = true;
  // Moments that cancel a disturbance are no inertia: with them held, forces must come back.
  for (const char* name : {"I_x", "I_y"}) {
    experiment.numbers[IndexOf(name, experiment)].free = false;
  }
  WriteFlight(experiment, folder / "a.csv", 1);
  WriteFlight(experiment, folder / "b.csv", 2);
  const WrenchResult result = RunWrenchExperiment(experiment, folder.directory(), 2, true);
  ASSERT_EQ(result.folds.size(), 1u);
  const WrenchFit& fit = result.folds[0].fit;
  const std::vector<double> truth = Numbers(experiment);
  for (const char* name : {"k_f", "rotor_speed_drag.k"}) {
    const std::size_t i = IndexOf(name, experiment);
    EXPECT_NEAR(fit.numbers[i], truth[i], 0.02 * truth[i]) << name;
  }
  EXPECT_NEAR(fit.numbers[IndexOf("r_BI_z", experiment)], -0.02, 0.002);
  EXPECT_GT(fit.share[0], 0.0);
  EXPECT_GT(fit.washout.washout, 1.0);  // slow moments turn this vehicle, too
  ASSERT_GE(result.scores.size(), 2u);
  EXPECT_EQ(result.scores[1].predictor, "none");
  EXPECT_LT(result.scores[0].errors.M(), result.scores[1].errors.M());
  EXPECT_THAT(WrenchTable(experiment, result), HasSubstr("rotor by rotor"));
}

TEST(WrenchExperiment, SlowPublishedPredictionsScoreAsStatedAndAreNear) {
  const auto folder = DataFolder() / "neurobem_benchmark";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is missing; set TRUELINE_DATA";
  WrenchExperiment experiment = Shipped();
  experiment.stride = 40;
  const WrenchResult result = RunWrenchExperiment(experiment, folder, 2, true);
  const auto error = [&](const std::string& flight, const std::string& reading) {
    for (const WrenchScore& s : result.scores) {
      if (s.flight.starts_with(flight) && s.predictor.starts_with("BEM") && s.reading == reading) {
        return s.errors;
      }
    }
    ADD_FAILURE() << flight << " has no score against " << reading;
    return WrenchErrors{};
  };
  const WrenchErrors figure8 = error("figure8", "0.772 kg"), race = error("race", "0.772 kg");
  EXPECT_LT((figure8.force - Eigen::Vector3d(0.065, 0.056, 0.235)).cwiseAbs().maxCoeff(), 6e-4);
  EXPECT_LT((race.force - Eigen::Vector3d(0.169, 0.158, 0.463)).cwiseAbs().maxCoeff(), 6e-4);
  EXPECT_NEAR(error("figure8", "0.752 kg").F(), 0.102, 6e-4);
  EXPECT_NEAR(error("race", "fz gain, means removed").F(), 0.266, 3e-3);
  EXPECT_LT((figure8.moment - Eigen::Vector3d(0.004, 0.003, 0.002)).cwiseAbs().maxCoeff(), 6e-4);
  // By a fit to all other flights: as good where flight is slow, at most 1.2 times as far off where
  // it is fast.
  const auto by_others = [&](const std::string& flight) {
    const auto score = std::ranges::find_if(result.scores, [&](const WrenchScore& s) {
      return s.flight.starts_with(flight) && s.fitted_to > 1;
    });
    return score->errors.F();
  };
  EXPECT_LT(by_others("figure8_1"), 1.05 * figure8.F());
  EXPECT_LT(by_others("race"), 1.2 * race.F());
}

TEST(WrenchExperiment, NamesTheFlightThatIsMissing) {
  const TestFolder folder;
  EXPECT_THAT(ErrorOf([&] { RunWrenchExperiment(Shipped(), folder.directory(), 1, true); }),
              HasSubstr("racetrack_1_20210218171908seg2.csv.gz: is missing"));
}

// --- What part of a modelled moment turns a vehicle whose controller cancels slow disturbances.

constexpr double kStep = 0.0025;  // s

Eigen::VectorXd Times(int count) {
  return Eigen::VectorXd::LinSpaced(count, 0.0, kStep * (count - 1));
}

LevelMoments Sine(const Eigen::VectorXd& t, double frequency) {
  LevelMoments moment(2, t.size());
  moment << (2.0 * M_PI * frequency * t.array()).sin().matrix().transpose(),
      (2.0 * M_PI * frequency * t.array()).cos().matrix().transpose();
  return moment;
}

double Rms(const LevelMoments& moment) {
  return std::sqrt(moment.rightCols(moment.cols() / 2).squaredNorm() /
                   static_cast<double>(moment.cols()));
}

TEST(MomentWashout, PassesTheGainOfItsFilters) {
  const Eigen::VectorXd t = Times(8000);
  const MomentWashout washout{0.1, 0.01};
  for (const double frequency : {0.3, 1.6, 6.0}) {
    const double w = 2.0 * M_PI * frequency;
    const double high = std::pow(w * 0.1, 2) / (1.0 + std::pow(w * 0.1, 2));
    const double gain = high / std::sqrt(1.0 + std::pow(w * 0.01, 2));
    const LevelMoments sine = Sine(t, frequency);
    EXPECT_NEAR(Rms(washout.Of(sine, t)) / Rms(sine), gain, 0.03 * gain + 1e-3) << frequency;
  }
}

TEST(MomentWashout, AConstantTurnsNothing) {
  const Eigen::VectorXd t = Times(400);
  EXPECT_EQ(MomentWashout().Of(LevelMoments::Constant(2, 400, 0.3), t).norm(), 0.0);
}

// The slow part is cancelled by disturbances, the fast one turns the vehicle late; noise beside.
TEST(MomentWashout, ComesBackFromAFlight) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const MomentWashout truth{0.15, 0.02};
  MomentRecord flight{Times(20000), {}, LevelMoments(2, 20000)};
  for (Eigen::Index i = 0; i < flight.modelled.cols(); ++i) {
    for (int axis = 0; axis < 2; ++axis) {
      const double before = i > 0 ? flight.modelled(axis, i - 1) : 0.0;
      flight.modelled(axis, i) = 0.99 * before + normal(random);
    }
  }
  flight.measured = 0.7 * truth.Of(flight.modelled, flight.t);
  for (double& value : flight.measured.reshaped()) value += 0.3 * normal(random);
  const MomentWashout found = FitMomentWashout({flight});
  EXPECT_NEAR(found.washout, truth.washout, 0.1 * truth.washout);
  EXPECT_NEAR(found.lag, truth.lag, 0.1 * truth.lag);
  EXPECT_NEAR(ShareOf(flight.measured, found.Of(flight.modelled, flight.t)), 0.7, 0.03);
}

}  // namespace
}  // namespace trueline