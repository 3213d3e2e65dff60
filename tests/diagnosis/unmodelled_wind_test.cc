// Calibrations of simulated flights are told of a wind that their model lacks.
#include "problems/diagnosis/unmodelled_wind.h"

#include "tests/common/matchers.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

FlightLog FlyInWind(const std::string& course, double w_x, double w_y) {
  SimulationConfig config = testing_simulation::ReadShipped(course);
  config.detector.sigma_factor = 0.05;
  if (w_x != 0.0 || w_y != 0.0) config.effects = {{"wind", {{"w_x", w_x}, {"w_y", w_y}}}};
  return testing_simulation::Fly(config, 22).log;
}

// At 4 m/s of wind the window's theta_I_B is off by 3 of its sigmas, and every arc ends inside of
// its ellipse.
const FlightLog& WindyHippodrome() {
  static const FlightLog log = FlyInWind("hippodrome", 4.0, -3.0);
  return log;
}

struct Judged {
  Calibration calibration;
  std::string before;  // the verdict without the question
};

Judged CalibrateAndAsk(const FlightLog& log, CalibrationOptions options = {}) {
  options.gamma_sweep.clear();
  Judged judged{Calibrate(log, options), ""};
  judged.before = judged.calibration.verdict.word;
  JudgeWind(log, options, &judged.calibration);
  return judged;
}

bool Tells(const Calibration& calibration) {
  const auto of_wind = Contains(HasSubstr("shows a wind of"));
  return testing::Value(calibration.verdict.reasons, of_wind) ||
         testing::Value(calibration.warnings, of_wind);
}

CalibrationOptions WithEffect(const Effect& effect) {
  CalibrationOptions options;
  options.effects = {effect};
  options.methods.vgd.drive.force_effects = ForceEffectsOf(options.effects);
  return options;
}

TEST(UnmodelledWind, SlowConstantsThatItMovesMakeTheVerdictPoor) {
  const Judged judged = CalibrateAndAsk(WindyHippodrome());
  EXPECT_EQ(judged.before, "usable");
  EXPECT_EQ(judged.calibration.verdict.word, "poor");
  EXPECT_THAT(judged.calibration.verdict.reasons,
              Contains(AllOf(HasSubstr("shows a wind of"), HasSubstr("theta_I_B would be"),
                             HasSubstr("--model=RESULT/model.yaml takes it"))));
}

TEST(UnmodelledWind, SlowItsSizeAndTheConstantsWithItAreThoseOfTheFlight) {
  CalibrationOptions options;
  options.gamma_sweep.clear();
  const Calibration calibration = Calibrate(WindyHippodrome(), options);
  const auto wind = FindUnmodelledWind(WindyHippodrome(), options, calibration);
  ASSERT_TRUE(wind);
  EXPECT_LT(wind->p, 1e-6);
  EXPECT_NEAR(wind->value.x(), 4.0, 3.3 * wind->sigma.x());
  EXPECT_NEAR(wind->value.y(), -3.0, 3.3 * wind->sigma.y());
  ASSERT_FALSE(wind->moved.empty());
  EXPECT_EQ(wind->moved.front().name, "theta_I_B");
  EXPECT_GT(wind->moved.front().sigmas, 2.5);
  const Calibration with =
      Calibrate(WindyHippodrome(),
                WithEffect({"wind", {{"w_x", wind->value.x()}, {"w_y", wind->value.y()}}}));
  for (const ParameterEstimate& p : with.Reported().windows.back().parameters) {
    const auto moved = std::ranges::find(wind->moved, p.name, &MovedConstant::name);
    ASSERT_NE(moved, wind->moved.end()) << p.name;
    EXPECT_NEAR(moved->with, p.value, 1e-6) << p.name;
  }
}

// On the course of the race drag's interval contains what the wind does.
TEST(UnmodelledWind, SlowOneThatMovesNoConstantIsAWarning) {
  const Judged judged = CalibrateAndAsk(FlyInWind("iros2016", 1.0, -0.6));
  EXPECT_EQ(judged.calibration.verdict.word, judged.before);
  EXPECT_THAT(judged.calibration.warnings,
              Contains(AllOf(HasSubstr("shows a wind of"),
                             HasSubstr("no constant would move by more than 2"))));
}

// The filter's model takes no wind.
TEST(UnmodelledWind, SlowAnEstimatorThatTakesNoWindIsToldWhichDo) {
  CalibrationOptions options;
  options.estimators = {"ekf"};
  const Judged judged = CalibrateAndAsk(WindyHippodrome(), options);
  ASSERT_TRUE(Tells(judged.calibration));
  std::vector<std::string> told = judged.calibration.warnings;
  const std::vector<std::string>& reasons = judged.calibration.verdict.reasons;
  told.insert(told.end(), reasons.begin(), reasons.end());
  EXPECT_THAT(told, Contains(HasSubstr("--estimator=vgd or smoother")));
}

TEST(UnmodelledWind, SlowACalmFlightIsNotTold) {
  EXPECT_FALSE(Tells(CalibrateAndAsk(FlyInWind("hippodrome", 0.0, 0.0)).calibration));
  EXPECT_FALSE(Tells(CalibrateAndAsk(FlyInWind("iros2016", 0.0, 0.0)).calibration));
}

TEST(UnmodelledWind, SlowAModelThatHasAWindIsNotAsked) {
  const CalibrationOptions options = WithEffect({"wind", {{"w_x", 0.5}, {"w_y", 0.0}}});
  EXPECT_FALSE(Tells(CalibrateAndAsk(WindyHippodrome(), options).calibration));
}

TEST(UnmodelledWind, SlowIndoorsIsNotAsked) {
  FlightLog log = WindyHippodrome();
  log.environment = "indoors";
  const Judged judged = CalibrateAndAsk(log);
  EXPECT_FALSE(Tells(judged.calibration));
  EXPECT_EQ(judged.calibration.verdict.word, judged.before);
}

// Too few passes for the base fit.
TEST(UnmodelledWind, AShortFlightIsNotTold) {
  SimulationConfig config =
      testing_simulation::ReadShipped("hippodrome", 8.0, {{"wind", {{"w_x", 4.0}, {"w_y", -3.0}}}});
  EXPECT_FALSE(Tells(CalibrateAndAsk(testing_simulation::Fly(config, 22).log).calibration));
}

}  // namespace
}  // namespace trueline
