// Whole flights solved at once: agreement with a window over the flight, several flights,
// additional unknowns, and learned strengths.
#include "problems/smoother/whole_flight.h"

#include "problems/smoother/evidence_maximum.h"
#include "tests/common/matchers.h"
#include "tests/vgd/flights.h"

namespace trueline {
namespace {

SimulationConfig Drifting(double duration) {
  SimulationConfig config = testing_simulation::ReadShipped("long_flight", duration);
  config.warm_up = 5.0;
  return config;
}

const ParameterEstimate& Find(const WholeFlight& whole, const std::string& name) {
  for (const ParameterEstimate& p : whole.parameters) {
    if (p.name == name) return p;
  }
  throw std::out_of_range(name);
}

WholeFlightOptions Given() {
  WholeFlightOptions options;
  options.learn_strengths = false;
  return options;
}

SmootherOptions NoWalks() {
  SmootherOptions options;
  options.accel_bias_walk = options.ahrs_error_walk = 0.0;
  return options;
}

// Without random walks the chain of sections is equivalent to one window over the flight.
TEST(WholeFlight, IsAWindowOverTheFlight) {
  VgdOptions options;
  options.adapt_drift = false;
  options.gamma = 100;
  options.tolerance = 1e-10;
  const testing_vgd::Flight flight(Drifting(30.0), 1, options);
  const int tau = static_cast<int>(flight.data.passes.size());
  const WindowEstimate window = SolveWindow(flight.data, options, tau, PriorMeans(options));
  WholeFlightOptions given = Given();
  given.withhold_drag = false;  // windows widen intervals instead
  const WholeFlight whole = RunWholeFlight({{&flight.data, {}}}, options, NoWalks(), given);
  EXPECT_TRUE(whole.converged);
  for (const char* name : {"K_x", "K_y", "b_az", "phi_I_B", "theta_I_B", "psi_I_B", "b_ax"}) {
    const ParameterEstimate& expected = testing_vgd::Find(window, name);
    const ParameterEstimate& found = Find(whole, name);
    EXPECT_NEAR(found.value, expected.value, 0.01 * expected.sigma) << name;
    EXPECT_NEAR(found.sigma, expected.sigma, 0.03 * expected.sigma) << name;
  }
  ASSERT_FALSE(window.fitted.empty());
  const TrajectoryPoint &last = window.fitted.back(), &smoothed = whole.trajectory.back();
  EXPECT_EQ(last.t, smoothed.t);
  EXPECT_LT((last.p_E - smoothed.p_E).norm(), 1e-4);  // m
}

// In closed loop the vehicle hardly moves sideways: drag along y is not fitted, whatever its size.
TEST(WholeFlight, WithholdsDragThatNothingShows) {
  VgdOptions options;
  options.process.tilt = 0.015;  // rad, as simulated
  const testing_vgd::Flight flight(Drifting(40.0), 3, options);
  WholeFlightOptions reads = Given();
  reads.withhold_drag = false;
  const WholeFlight whole = RunWholeFlight({{&flight.data, {}}}, options, NoWalks(), Given());
  const WholeFlight read = RunWholeFlight({{&flight.data, {}}}, options, NoWalks(), reads);
  EXPECT_TRUE(read.notes.empty());
  ASSERT_FALSE(whole.notes.empty());
  EXPECT_NE(whole.notes.back().find("K_y"), std::string::npos) << whole.notes.back();
  const ParameterEstimate& K_y = Find(whole, "K_y");
  EXPECT_EQ(K_y.status, "unobservable");
  const ParameterPrior& prior = options.priors[1];  // held there, however long the flight is
  EXPECT_NEAR(K_y.value, prior.mean, 1e-3 * prior.sigma);
  EXPECT_LE(K_y.sigma, 1.001 * prior.sigma);
  EXPECT_GE(K_y.sigma, 0.99 * prior.sigma);
}

// Gusts move the vehicle sideways as much as the course does: however well its velocity is known,
// it tells no drag along y. At 8 m/s it does.
TEST(WholeFlight, BelievesDragThatGustsDoNotMake) {
  VgdOptions options;
  options.process.gust = 0.1;  // m/s^2 and s, as simulated
  options.process.gust_memory = 0.3;
  options.process.tilt = 0.0005;  // rad
  SimulationConfig laps = Drifting(60.0);
  laps.ahrs.drift_sigma.setConstant(1e-4);
  const testing_vgd::Flight slow(laps, 2, options);
  const WholeFlight held = RunWholeFlight({{&slow.data, {}}}, options, NoWalks(), Given());
  EXPECT_EQ(Find(held, "K_y").status, "unobservable");
  EXPECT_NEAR(Find(held, "K_y").value, options.priors[1].mean, 1e-3 * options.priors[1].sigma);
  ASSERT_FALSE(held.notes.empty());
  EXPECT_NE(held.notes.back().find("K_y"), std::string::npos) << held.notes.back();

  SimulationConfig course = testing_simulation::ReadShipped("fast", 60.0);
  const testing_vgd::Flight fast(course, 2, options);
  const WholeFlight read = RunWholeFlight({{&fast.data, {}}}, options, NoWalks(), Given());
  EXPECT_EQ(Find(read, "K_y").status, "identified");
  EXPECT_TRUE(read.notes.empty()) << read.notes.front();
}

// Two flights of a vehicle share its airframe's parameters and estimate them better than one.
TEST(WholeFlight, FlightsOfOneVehicleShareTheAirframe) {
  VgdOptions options;
  options.drag_measurement.enabled = false;
  const testing_vgd::Flight first(Drifting(25.0), 1, options), second(Drifting(25.0), 2, options);
  const WholeFlight one = RunWholeFlight({{&first.data, {}}}, options, NoWalks(), Given());
  const WholeFlight both =
      RunWholeFlight({{&first.data, {}}, {&second.data, {}}}, options, NoWalks(), Given());
  EXPECT_EQ(both.flights, 2);
  EXPECT_LT(Find(both, "K_x").sigma, Find(one, "K_x").sigma);
  EXPECT_LT(Find(both, "phi_I_B").sigma, 0.8 * Find(one, "phi_I_B").sigma);
}

// A drift twice as large gives a strength about twice as large; the intervals do not overlap.
// The strength comes out a third too small: 0.0052 to 0.0085 for 0.01 on five flights.
TEST(WholeFlight, SlowLearnsHowStronglyTheAhrsDrifts) {
  const VgdOptions options;
  std::vector<LearnedStrength> learned;
  for (const double sigma : {0.01, 0.04}) {
    SimulationConfig config = Drifting(60.0);
    config.imu.rate = 128.0;
    config.ahrs.drift_sigma = {sigma, sigma, 0.0};
    const testing_vgd::Flight flight(config, 7, options);
    const WholeFlight whole =
        RunWholeFlight({{&flight.data, {}}}, options, SmootherOptions(), WholeFlightOptions());
    learned.push_back(whole.strengths.at(0));
    EXPECT_EQ(whole.strengths[0].name, "tilt_drift");
    EXPECT_GT(sigma, 0.7 * whole.strengths[0].lower) << sigma;
    EXPECT_LT(sigma, 1.4 * whole.strengths[0].upper) << sigma;
  }
  EXPECT_LT(learned[0].upper, learned[1].lower);
}

// Eight steps of at most a factor of four do not lead from such a start to the strength flown.
TEST(WholeFlight, NotesThatTheSearchForStrengthsDidNotConverge) {
  VgdOptions options;
  options.drag_measurement.enabled = false;
  options.process.acceleration = 1e6;  // m/s^2/sqrt(Hz)
  const testing_vgd::Flight flight(Drifting(20.0), 1, options);
  const WholeFlight whole =
      RunWholeFlight({{&flight.data, {}}}, options, SmootherOptions(), WholeFlightOptions());
  ASSERT_FALSE(whole.notes.empty());
  EXPECT_NE(whole.notes.front().find("did not converge"), std::string::npos) << whole.notes.front();
}

TEST(EvidenceMaximum, FindsTheTopOfANormalDensity) {
  Eigen::Matrix2d information;
  information << 4.0, 1.5, 1.5, 2.0;
  const Eigen::Vector2d top(1.0, -2.0);
  const auto log_p = [&](const Eigen::VectorXd& z) {
    return -0.5 * (z - top).dot(information * (z - top));
  };
  const EvidenceMaximum maximum =
      MaximiseEvidence(log_p, Eigen::Vector2d::Zero(), Eigen::Vector2d(0.5, 0.7), 1.0, 10);
  EXPECT_TRUE(maximum.converged);
  EXPECT_LT((maximum.at - top).norm(), 1e-9);
  EXPECT_LT((maximum.cov - information.inverse()).norm(), 1e-9);
}

// It also ascends from a start where the curvature has the wrong sign.
TEST(EvidenceMaximum, ClimbsFromATail) {
  const auto log_p = [](const Eigen::VectorXd& z) {
    return -std::log(1.0 + z.squaredNorm());  // curved upwards beyond 1
  };
  const EvidenceMaximum maximum = MaximiseEvidence(log_p, Eigen::VectorXd::Constant(1, 3.0),
                                                   Eigen::VectorXd::Constant(1, 0.3), 1.0, 20);
  EXPECT_TRUE(maximum.converged);
  EXPECT_NEAR(maximum.at[0], 0.0, 0.05);
}

TEST(EvidenceMaximum, SaysThatItDidNotArrive) {
  const auto log_p = [](const Eigen::VectorXd& z) { return -0.5 * z.squaredNorm(); };
  const EvidenceMaximum maximum = MaximiseEvidence(log_p, Eigen::VectorXd::Constant(1, 9.0),
                                                   Eigen::VectorXd::Constant(1, 0.5), 1.0, 3);
  EXPECT_FALSE(maximum.converged);
  EXPECT_NEAR(maximum.at[0], 6.0, 1e-9);
}

}  // namespace
}  // namespace trueline
