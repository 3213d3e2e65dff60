// Gramians against a closed form, against each other, and against finite differences.
#include <Eigen/Eigenvalues>
#include <cmath>
#include <filesystem>

#include "problems/common/error.h"
#include "problems/log/native_log.h"
#include "problems/observability/e2log.h"
#include "problems/observability/gramian_ranking.h"
#include "problems/observability/lie_derivatives.h"
#include "problems/observability/variational_gramian.h"
#include "tests/common/test_files.h"
#include "tests/observability/empirical_gramian.h"
#include "tests/observability/test_vehicle.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

// Undamped oscillator x'' = -x with x measured: K = (cos t, sin t).
struct Oscillator {
  static constexpr int kStates = 2, kMoving = 2, kErrors = 2;
  int num_outputs() const { return 1; }
  std::vector<StateInfo> errors() const { return std::vector<StateInfo>(2); }
  template <class T>
  void Derivative(const T* x, const T*, T* dx) const {
    dx[0] = x[1];
    dx[1] = -x[0];
  }
  template <class T>
  void Output(const T* x, const T*, T* y) const {
    y[0] = x[0];
  }
  template <class C>
  void Seed(const C* x, ceres::Jet<C, 2>* out) const {
    for (int i = 0; i < 2; ++i) out[i] = ceres::Jet<C, 2>(x[i], i);
  }
  template <class C>
  void Error(const C*, const C* dx, C* error) const {
    error[0] = dx[0];
    error[1] = dx[1];
  }
};

std::vector<double> Perturbed(const Oscillator&, std::vector<double> x, int error, double by) {
  x[error] += by;
  return x;
}

Eigen::Matrix2d OscillatorGramian(double T) {
  const double c = T / 2 + std::sin(2 * T) / 4, s = T / 2 - std::sin(2 * T) / 4;
  const double cross = std::sin(T) * std::sin(T) / 2;
  return (Eigen::Matrix2d() << c, cross, cross, s).finished();
}

NominalFlight OscillatorFlight(double T) {
  return {0.0, T, [](double t) { return NominalPoint{{std::cos(t), -std::sin(t)}, {}}; }};
}

TEST(Gramian, AllThreeGiveTheOscillatorsClosedForm) {
  const double T = 3.0;
  const Eigen::Matrix2d want = OscillatorGramian(T);
  EXPECT_LT((VariationalGramian(Oscillator{}, OscillatorFlight(T), {1.0}, 0.01) - want).norm(),
            1e-8);
  EXPECT_LT((EmpiricalGramian(Oscillator{}, OscillatorFlight(T), {1.0}, 0.01) - want).norm(), 1e-8);
  const auto local =
      ExpandSensitivity<12, double>(Oscillator{}, std::vector<double>{1.0, 0.0}, {}, 1.0);
  EXPECT_LT((LocalGramian<2, 12>(local, {1.0}, 1.0) - OscillatorGramian(1.0)).norm(), 1e-8);
  const Eigen::Matrix2d turn =
      (Eigen::Matrix2d() << std::cos(1.0), std::sin(1.0), -std::sin(1.0), std::cos(1.0)).finished();
  EXPECT_LT((local.transition - turn).norm(), 1e-8);
}

TEST(Gramian, GaussRuleIntegratesPolynomialsExactly) {
  for (const Quadrature* rule :
       {&GaussLegendre<1>(), &GaussLegendre<2>(), &GaussLegendre<5>(), &GaussLegendre<7>()}) {
    const std::size_t n = rule->nodes.size();
    for (std::size_t degree = 0; degree < 2 * n; ++degree) {
      double sum = 0.0;
      for (std::size_t i = 0; i < n; ++i)
        sum += rule->weights[i] * std::pow(rule->nodes[i], degree);
      EXPECT_NEAR(sum, 1.0 / (degree + 1), 1e-14);
    }
  }
}

class RotorGramian : public ::testing::Test {
 protected:
  RotorGramian() {
    std::srand(1);
    FlatMatrix control = 0.2 * FlatMatrix::Random(kFlatOutputs, 11);
    flight_ = std::make_unique<RotorFlight>(RotorVehicle{TestQuadrotor(), TestNominal()},
                                            PiecewisePolynomial::FromSpline(control, 7, 2.0));
  }
  // Largest difference, each state scaled to unit information.
  static double Difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    const Eigen::VectorXd scale = b.diagonal().unaryExpr(
        [](double value) { return value > 0.0 ? 1.0 / std::sqrt(value) : 1.0; });
    return (scale.asDiagonal() * (a - b) * scale.asDiagonal()).cwiseAbs().maxCoeff();
  }
  double E2logError(int order, double segment) const {
    E2logOptions options;
    options.order = order;
    options.segment = segment;
    return Difference(E2log(system_, *flight_, weights_, options), reference_);
  }

  RotorDrivenSystem system_{TestQuadrotor(), OnlySensors(true, false, true)};
  std::vector<double> weights_ = system_.OutputWeights();
  std::unique_ptr<RotorFlight> flight_;
  Eigen::MatrixXd reference_ = Eigen::MatrixXd();

  void SetUp() override {
    reference_ = VariationalGramian(system_, flight_->Nominal(), weights_, 0.002);
  }
};

TEST_F(RotorGramian, VariationalConvergesWithTheFourthPowerOfTheStep) {
  const auto error = [&](double h) {
    return Difference(VariationalGramian(system_, flight_->Nominal(), weights_, h), reference_);
  };
  EXPECT_LT(error(0.01), 1e-5);
  EXPECT_GT(std::log2(error(0.04) / error(0.01)), 2 * 3.5);
}

TEST_F(RotorGramian, E2logConvergesWithOrderAndSegment) {
  EXPECT_LT(E2logError(6, 0.025), 1e-6);
  EXPECT_LT(E2logError(4, 0.05), 1e-3);
  for (const int order : {2, 4}) {  // one power of the segment for each order, at least
    EXPECT_GT(std::log2(E2logError(order, 0.05) / E2logError(order, 0.025)), order - 0.5);
  }
  EXPECT_GT(E2logError(2, 0.05), E2logError(3, 0.05));
  EXPECT_GT(E2logError(3, 0.05), E2logError(4, 0.05));
}

TEST_F(RotorGramian, FiniteDifferencesAgreeWithTheExactOne) {
  const Eigen::MatrixXd empirical =
      EmpiricalGramian(system_, flight_->Nominal(), weights_, 0.005, 1e-4);
  EXPECT_LT(Difference(empirical, reference_), 1e-4);
}

TEST_F(RotorGramian, ThreadsDoNotChangeTheResult) {
  E2logOptions one, two;
  two.threads = 2;
  EXPECT_EQ(E2log(system_, *flight_, weights_, one), E2log(system_, *flight_, weights_, two));
}

TEST_F(RotorGramian, OrderOutOfRangeIsRefused) {
  E2logOptions options;
  options.order = 9;
  EXPECT_THROW(E2log(system_, *flight_, weights_, options), InputError);
}

// --- Flights ranked by the E2LOG Gramian.

const fs::path kObserve = TRUELINE_TEST_SOURCE_DIR "/config/observe";

RotorFlight Figure(double duration) {
  const Lissajous figure{{0.4, 0.4, 0.15, 1.0}, {0.5, 0.6, 0.7, 0.4}, {0, 1.571, 1.047, 0}};
  return {{TestQuadrotor(), TestNominal()}, LissajousPath(figure, duration)};
}

double Distance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  const Eigen::VectorXd unit = b.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
  return (unit.asDiagonal() * (a - b) * unit.asDiagonal()).cwiseAbs().maxCoeff();
}

TEST(E2logOfARecordedFlight, IsThatOfItsTrajectory) {
  const RotorDrivenSystem system(TestQuadrotor(), OnlySensors(true, false, true));
  const RotorFlight flight = Figure(3.0);
  E2logOptions options;
  options.order = 4;
  const auto exact = E2log(system, flight, system.OutputWeights(), options);
  const auto recorded = E2log(system, flight.Nominal(), system.OutputWeights(), options);
  EXPECT_LT(Distance(recorded, exact), 0.01);
}

TEST(E2log, SummedIsTheSumOfItsPartsAndChainedIsNot) {
  const RotorDrivenSystem system(TestQuadrotor(), OnlySensors(true, false, true));
  const RotorFlight flight = Figure(0.2);
  NominalFlight first = flight.Nominal(), second = first;
  first.end = second.start = 0.1;
  E2logOptions options;
  options.chained = false;
  const auto of = [&](const NominalFlight& f) {
    return E2log(system, f, system.OutputWeights(), options);
  };
  const Eigen::MatrixXd sum = of(first) + of(second);
  EXPECT_LT(Distance(of(flight.Nominal()), sum), 1e-9);
  options.chained = true;
  EXPECT_GT(Distance(of(flight.Nominal()), sum), 1e-3);
}

Ranking RankText(const std::string& e2log, const std::string& cases) {
  const YAML::Node file = YAML::LoadFile((kObserve / "e2log.yaml").string());
  YAML::Node config;
  config["vehicle"] = file["vehicle"];
  config["e2log"] = YAML::Load(e2log);
  config["cases"] = YAML::Load(cases);
  return RankByE2log({YamlMap(config, "test.yaml", ""), {}, {}}, nullptr);
}

// A simulated flight whose streams have their own rates, as a native log.
fs::path MadeLog(const TestFolder& folder) {
  RotorSimulation simulation(WuestVehicle());
  simulation.imu_rate = 100.0;
  simulation.pose_rate = 10.0;
  WriteNativeLog(SimulateRotorFlight(simulation, RandomPath(4.0, 1), 1), folder / "log");
  return folder / "log";
}

RankedFlight RankLog(const fs::path& log, const std::string& sensors) {
  YAML::Node config;
  config["vehicle"] = YAML::LoadFile((kObserve / "e2log.yaml").string())["vehicle"];
  config["e2log"] = YAML::Load("{scale: typical}");
  config["sensors"] = YAML::Load(sensors);
  return RankByE2log({YamlMap(config, "test.yaml", ""), {}, {log}}, nullptr).flights.at(0);
}

TEST(GramianRanking, ALogHasItsOwnRatesUnlessTheyAreStated) {
  const TestFolder folder;
  const fs::path log = MadeLog(folder);
  const RankedFlight own = RankLog(log, "{}"),
                     wuest = RankLog(log, "{imu_rate: 250, pose_rate: 30}"),
                     stated = RankLog(log, "{imu_rate: 100, pose_rate: 10}");
  for (std::size_t i = 0; i < own.sigma.size(); ++i) {
    EXPECT_NEAR(own.sigma[i] / stated.sigma[i], 1.0, 0.02);
    EXPECT_GT(own.sigma[i], 1.3 * wuest.sigma[i]);
  }
}

const char kCases[] =
    "[{name: hover, trajectory: {kind: hover, duration: 4}},"
    " {name: shuttle, trajectory: {kind: lissajous, duration: 4, amplitude: [0.4, 0, 0, 0],"
    "  frequency: [0.7, 0, 0, 0]}},"
    " {name: all axes, trajectory: {kind: lissajous, duration: 4, amplitude: [0.4, 0.4, 0.15, 1],"
    "  frequency: [0.5, 0.6, 0.7, 0.4]}}]";

TEST(GramianRanking, AConstantNamedTwiceIsOne) {
  const Ranking once = RankText("{scale: typical, show: [r_BP_x]}", kCases);
  const Ranking twice = RankText("{scale: typical, show: [r_BP_x, r_BP_x], free: [m, m]}", kCases);
  ASSERT_EQ(twice.shown.size(), 1U);
  EXPECT_EQ(twice.flights[0].scores.sigma_min, once.flights[0].scores.sigma_min);
}

TEST(GramianRanking, PutsWhatTurnsAboutAllAxesFirst) {
  for (const char* weighting : {"noise", "none"}) {
    const Ranking ranking =
        RankText(std::string("{scale: typical, weighting: ") + weighting + "}", kCases);
    ASSERT_EQ(ranking.flights.size(), 3U);
    EXPECT_EQ(ranking.flights[0].name, "all axes");
    EXPECT_GT(ranking.flights[0].scores.sigma_min, ranking.flights[1].scores.sigma_min);
    EXPECT_GE(ranking.flights[1].scores.sigma_min, ranking.flights[2].scores.sigma_min);
    const YAML::Node yaml = YAML::Load(RankingYaml(ranking, "test"));
    EXPECT_EQ(yaml["flights"][0]["name"].as<std::string>(), "all axes");
    EXPECT_NEAR(yaml["flights"][0]["crlb"]["r_BP_x"]["value"].as<double>(),
                ranking.flights[0].sigma[0], 1e-3 * ranking.flights[0].sigma[0]);
  }
}

const RankedFlight& Named(const Ranking& ranking, const std::string& name) {
  for (const RankedFlight& flight : ranking.flights) {
    if (flight.name == name) return flight;
  }
  throw std::out_of_range(name);
}

// Other states as known can only add to the score; bounds do not depend on how a flight is scored.
TEST(GramianRanking, KnownStatesRaiseTheScoreAndLeaveTheBound) {
  const Ranking unknown = RankText("{scale: typical}", kCases);
  const Ranking known = RankText("{scale: typical, others: known}", kCases);
  for (const RankedFlight& flight : known.flights) {
    const RankedFlight& same = Named(unknown, flight.name);
    EXPECT_GE(flight.scores.sigma_min, same.scores.sigma_min) << flight.name;
    EXPECT_EQ(flight.sigma, same.sigma) << flight.name;
  }
  EXPECT_GT(Named(known, "all axes").scores.sigma_min,
            2.0 * Named(unknown, "all axes").scores.sigma_min);
}

TEST(GramianRanking, TheDeviationOfEstimatesScalesTheColumns) {
  const Ranking ranking = RankText("{scale: deviation, scale_flights: 3, show: [r_BP_x]}", kCases);
  ASSERT_EQ(ranking.scale.size(), 1U);
  EXPECT_GT(ranking.scale[0], 1e-4);  // m
  EXPECT_LT(ranking.scale[0], 0.1);
  const Ranking typical = RankText("{scale: typical, show: [r_BP_x]}", kCases);
  const double ratio = ranking.scale[0] / typical.scale[0];
  EXPECT_NEAR(ranking.flights[0].scores.sigma_min,
              ratio * ratio * typical.flights[0].scores.sigma_min,
              1e-6 * ranking.flights[0].scores.sigma_min);
}

TEST(GramianRanking, RefusesWhatItCannotScore) {
  EXPECT_THROW(RankText("{scale: typical, show: [p_x]}", kCases), InputError);
  EXPECT_THROW(RankText("{order: 7}", kCases), InputError);
  EXPECT_THROW(RankText("{scale: typical}", "[]"), InputError);
  EXPECT_THROW(RankByE2log({std::nullopt, {"no.yaml"}, {}}, nullptr), InputError);
}

}  // namespace
}  // namespace trueline
