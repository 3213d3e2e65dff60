// What streams say about each other: cover and clocks, on a simulated flight whose streams are
// shifted and cut.
#include "problems/inspection/first_look.h"

#include <algorithm>
#include <cmath>

#include "problems/common/units.h"
#include "problems/inspection/excerpt.h"
#include "problems/inspection/inspection.h"
#include "problems/inspection/settle_proposal.h"
#include "problems/log/native_log.h"
#include "tests/common/test_files.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

const FlightLog& Hippodrome() {
  static const FlightLog log = testing_simulation::LogOf("hippodrome", 30.0, 5);
  return log;
}

template <class Samples>
void Shift(double seconds, Samples* samples) {
  for (auto& sample : *samples) sample.t += FromSeconds(seconds);
}

TEST(FirstLook, AGoodLogGivesNoFinding) { EXPECT_THAT(FirstLook(Hippodrome()), IsEmpty()); }

// Fixes of a receiver are late and err together: neither is a fault of accelerometer or attitude.
TEST(FirstLook, LateFixesOfAReceiverAccuseNoOtherSensor) {
  SimulationConfig config = testing_simulation::ReadShipped("gnss", 60.0);
  for (const std::string& finding : FirstLook(testing_simulation::Fly(config, 1).log)) {
    EXPECT_THAT(finding, HasSubstr("fixes.csv"));
  }
}

TEST(FirstLook, FindsClocksThatDisagree) {
  for (const double seconds : {0.45, -2.35}) {
    FlightLog log = Hippodrome();
    Shift(seconds, &log.mocap);
    const auto findings = FirstLook(log);
    ASSERT_EQ(findings.size(), 1U) << seconds;
    EXPECT_THAT(findings[0], HasSubstr("the turns of mocap.csv come"));
    // Laps repeat: the other lag is named beside, to a hundredth.
    EXPECT_THAT(findings[0], HasSubstr(seconds > 0.0 ? "0.450 s later" : "or 2.34"));
  }
}

TEST(FirstLook, FindsPositionsInMillimetres) {
  FlightLog log = Hippodrome();
  for (PoseSample& pose : log.mocap) pose.p_E *= 1e3;
  for (Fix& fix : log.fixes) fix.p_E *= 1e3;
  const auto findings = FirstLook(log);
  EXPECT_THAT(findings, Each(testing::StartsWith("position_scale (fatal)")));
  EXPECT_THAT(findings, testing::SizeIs(2));
  const Inspection inspection = Inspect(log, {});
  EXPECT_NEAR(inspection.repairs.streams.at("mocap").position_scale, 1e-3, 5e-5);
}

// Laps of another speed agree somewhat at some lag, which is no clock's.
TEST(FirstLook, MocapOfAnotherFlightIsNoClock) {
  FlightLog log = Hippodrome();
  SimulationConfig config = testing_simulation::ReadShipped("hippodrome", 30.0);
  for (auto& point : config.course.points) point.speed *= 1.25, point.turn_speed *= 1.25;
  log.mocap = testing_simulation::Fly(config, 6).log.mocap;
  EXPECT_THAT(FirstLook(log), Contains(HasSubstr("rates_disagree (fatal)")));
  EXPECT_THAT(FirstLook(log), Not(Contains(HasSubstr("clock_offset"))));
}

// About the middle of the flight, where the clocks agree.
template <class Samples>
void Drift(double drift, Samples* samples) {
  const TimeNs middle = (*samples)[samples->size() / 2].t;
  for (auto& sample : *samples) sample.t += FromSeconds(drift * SecondsBetween(middle, sample.t));
}

TEST(FirstLook, FindsAClockThatDriftsFar) {
  for (const double drift : {3e-3, -6e-3}) {
    FlightLog log = Hippodrome();
    Drift(drift, &log.mocap);
    EXPECT_THAT(FirstLook(log),
                Contains(AllOf(HasSubstr("clock_drift"), HasSubstr("the clock of mocap.csv"),
                               HasSubstr(drift > 0.0 ? "a minute faster" : "a minute slower"))))
        << drift;
  }
}

// Fixes of a beacon, all the way round and as exact as mocap.
TEST(FirstLook, FindsFixesThatDriftFar) {
  FlightLog log = Hippodrome();
  log.fixes.clear();
  for (std::size_t i = 0; i < log.mocap.size(); i += 10) {
    log.fixes.push_back({log.mocap[i].t, log.mocap[i].p_E, 0.05, 0});
  }
  EXPECT_THAT(FirstLook(log), IsEmpty());
  Drift(6e-3, &log.fixes);
  EXPECT_THAT(FirstLook(log), Contains(AllOf(HasSubstr("the clock of fixes.csv"),
                                             HasSubstr("faster than that of mocap"))));
}

TEST(FirstLook, AlignedMocapThatDriftsIsSaid) {
  FlightLog log = Hippodrome();
  EXPECT_THAT(AlignMocap(false, &log), Not(HasSubstr("drifts")));
  log = Hippodrome();
  Drift(4e-3, &log.mocap);
  EXPECT_THAT(AlignMocap(false, &log),
              AllOf(HasSubstr("mocap: its clock drifts by +"), HasSubstr("multiply")));
}

// The second one stands still.
void AddRotors(FlightLog* log) {
  for (const ImuSample& sample : log->imu) {
    const double wave = std::sin(3.0 * ToSeconds(sample.t));
    log->rotors.push_back({sample.t, {500.0 + wave, 0.0, 510.0 - wave, 505.0 + wave}});
  }
}

void TakeGravityOut(FlightLog* log) {
  std::size_t k = 0;
  for (ImuSample& sample : log->imu) {
    while (k + 1 < log->attitude.size() && log->attitude[k + 1].t <= sample.t) ++k;
    sample.accel += log->attitude[k].q_Ep_I.conjugate() * Eigen::Vector3d(0.0, 0.0, log->gravity);
  }
}

TEST(FirstLook, NamesWhatIsWrong) {
  const auto look = [](const auto& change) {
    FlightLog log = Hippodrome();
    change(&log);
    return FirstLook(log);
  };
  EXPECT_THAT(look([](FlightLog* log) { Shift(0.45, &log->attitude); }),
              ElementsAre(HasSubstr("attitude.csv come 0.4")));
  const auto cut = [](const ImuSample& s) { return s.t > FromSeconds(0.4); };
  EXPECT_THAT(look([&](FlightLog* log) { std::erase_if(log->imu, cut); }),
              ElementsAre(HasSubstr("attitude.csv lies within"), HasSubstr("fixes.csv lies within"),
                          HasSubstr("mocap.csv lies within")));
  EXPECT_THAT(look([](FlightLog* log) { log->attitude.clear(); }),
              ElementsAre(HasSubstr("attitude.csv is missing")));
  EXPECT_THAT(look(TakeGravityOut), Contains(HasSubstr("gravity is taken out")));
  EXPECT_THAT(look(AddRotors), Contains(HasSubstr("rotor 2 stays at 0")));
  const auto in_degrees = [](FlightLog* log) {
    for (ImuSample& sample : log->imu) sample.gyro /= kDegree;
  };
  EXPECT_THAT(look(in_degrees), Contains(HasSubstr("gyro_scale")));
}

// One sample along the thrust changes the integrated speed; it shifted b_az by 4 sigma in silence.
TEST(FirstLook, FindsASpikeOfThrustThatChangesTheSpeed) {
  FlightLog log = Hippodrome();
  ImuSample& sample = log.imu[log.imu.size() / 2];
  sample.accel.z() += 250.0;  // 0.5 m/s at 512 Hz
  EXPECT_THAT(FirstLook(log), ElementsAre(HasSubstr("1 samples of az stand apart")));
  sample.accel.z() -= 150.0;  // 0.2 m/s: a knock
  EXPECT_THAT(FirstLook(log), IsEmpty());
}

// The rest of the flight has the program's own filter, or no truth.
TEST(FirstLook, FindsStreamsOfTooLittleOfTheFlight) {
  FlightLog log = Hippodrome();
  const TimeNs start = log.imu.front().t;
  const auto cut = [&](double seconds, auto* samples) {
    std::erase_if(*samples, [&](const auto& s) { return s.t > start + FromSeconds(seconds); });
  };
  cut(20.0, &log.mocap);
  cut(25.0, &log.attitude);
  EXPECT_THAT(FirstLook(log), Not(Contains(HasSubstr("cover ("))));
  cut(12.0, &log.mocap);
  cut(20.0, &log.attitude);
  EXPECT_THAT(FirstLook(log), testing::IsSupersetOf({HasSubstr("cover (widens): attitude.csv"),
                                                     HasSubstr("cover (widens): mocap.csv")}));
  log.attitude.resize(1);
  log.mocap.resize(1);
  EXPECT_THAT(FirstLook(log),
              testing::IsSupersetOf({HasSubstr("cover (biases): attitude.csv (1 samples"),
                                     HasSubstr("cover (widens): mocap.csv (1 samples")}));
}

// Rotor speeds need no attitude, and do not replace it where the IMU drives the model.
TEST(ReadAndLook, AsksForAnAttitudeWhereTheImuDrivesTheModel) {
  FlightLog log = Hippodrome();
  log.attitude.clear();
  for (const ImuSample& sample : log.imu) log.rotors.push_back({sample.t, {500, 500, 500, 500}});
  const TestFolder folder;
  WriteNativeLog(log, folder / "log");
  const auto faults = [&](ForDrive drive) {
    std::vector<LogFault> found;
    ReadAndLook(folder / "log", &found, drive);
    return std::ranges::count(found, &fault::kAttitudeMissing, &LogFault::kind);
  };
  EXPECT_EQ(faults(ForDrive::kImu), 1);
  EXPECT_EQ(faults(ForDrive::kRotors), 0);
  EXPECT_EQ(faults(ForDrive::kAny), 0);
}

// A stream that the drive does not read makes none of its results wrong.
TEST(ReadAndLook, LeavesOutFaultsOfStreamsThatTheDriveDoesNotRead) {
  FlightLog log = Hippodrome();
  AddRotors(&log);
  Shift(0.45, &log.attitude);
  const TestFolder folder;
  WriteNativeLog(log, folder / "log");
  const auto ids = [&](ForDrive drive) {
    std::vector<LogFault> found;
    ReadAndLook(folder / "log", &found, drive);
    std::vector<std::string> names;
    for (const LogFault& fault : found) names.push_back(fault.kind->id + (" of " + fault.stream));
    return names;
  };
  EXPECT_THAT(ids(ForDrive::kImu), ElementsAre("clock_offset of attitude"));
  EXPECT_THAT(ids(ForDrive::kRotors), ElementsAre("dead_rotor of rotors"));
  EXPECT_THAT(ids(ForDrive::kAny), testing::SizeIs(2));
}

// Whatever was cut off, and whatever the stamps: noise does not repeat.
TEST(SharedRecording, IsThatOfPartsAndOfShiftedStamps) {
  const FlightLog log = Hippodrome();
  FlightLog later = log, half = log, other = log;
  Shift(5.0, &later.imu);
  later.imu.erase(later.imu.begin(), later.imu.begin() + 5);
  const auto shared = [](const FlightLog& a, const FlightLog& b) {
    return SharedRecording(FingerprintOf(a), FingerprintOf(b));
  };
  EXPECT_GT(shared(log, later), 0.95);
  half.imu.erase(half.imu.begin(), half.imu.begin() + static_cast<long>(half.imu.size() / 2));
  EXPECT_GT(shared(half, log), 0.95);
  for (ImuSample& sample : other.imu) sample.accel.x() += 1e-6;
  EXPECT_EQ(shared(log, other), 0.0);
}

// The middle of a long flight shows a clock; the whole of it shows cover.
TEST(FirstLook, OfALongFlightItInspectsAPart) {
  FlightLog log = testing_simulation::LogOf("long_flight", 400.0, 5);
  EXPECT_THAT(FirstLook(log), IsEmpty());
  Shift(0.45, &log.attitude);
  EXPECT_THAT(FirstLook(log), ElementsAre(HasSubstr("attitude.csv come 0.4")));
  log.attitude.clear();
  EXPECT_THAT(FirstLook(log), Contains(HasSubstr("attitude.csv is missing")));
}

}  // namespace
}  // namespace trueline
