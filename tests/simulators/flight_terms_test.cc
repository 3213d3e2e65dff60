// Mistakes in a simulator's equations: logs that are flown with them show the term, its size and
// its sign, whatever the file says.
#include "problems/simulators/audit.h"
#include "problems/simulators/export_vehicle.h"
#include "problems/simulators/flight_estimate.h"
#include "tests/common/test_files.h"
#include "tests/simulators/shaky_flight.h"

namespace trueline {
namespace {

using Eigen::Vector3d;

constexpr double kAirDrag = 0.075;                   // N s/m
constexpr double kTurns[] = {-1.0, -1.0, 1.0, 1.0};  // about z (up), that each rotor gives the body

// What acts on the vehicle beside its rotors; `commands` in rad/s.
struct Acting {
  const std::vector<double>&w, &commands;
  const replay::State& body;
  const NeutralVehicle& vehicle;
  Vector3d v;  // m/s, in the body
  replay::Wrench* sum;
};
using Equations = std::function<void(const Acting&)>;

void Drag(const Acting& a) { a.sum->force -= kAirDrag * a.v; }

// A simulator of few lines, with equations of its own for the air.
FlightLog FlyBy(const Equations& air, std::uint64_t seed) {
  NeutralVehicle v = MadeQuadrotor();
  const auto commands = std::make_shared<std::vector<double>>(4, v.Get("w_h"));
  replay::Simulator s;
  s.mass = v.Get("m");
  s.inertia.diagonal() << v.Get("I_x"), v.Get("I_y"), v.Get("I_z");
  s.drive = [commands](const std::vector<double>& wanted, double dt, std::vector<double>* w) {
    *commands = wanted;
    for (std::size_t i = 0; i < w->size(); ++i) {
      (*w)[i] = wanted[i] + std::exp(-dt / 0.03) * ((*w)[i] - wanted[i]);
    }
  };
  s.wrench = [=](const std::vector<double>& w, const replay::State& body) {
    replay::Wrench sum;
    for (int i = 0; i < 4; ++i) {
      const double square = w[static_cast<std::size_t>(i)] * w[static_cast<std::size_t>(i)];
      const Vector3d thrust(0.0, 0.0, v.Get("k_f", i) * square);
      sum.force += thrust;
      sum.moment += Vector3d(v.Get("x", i), -v.Get("y", i), 0.0).cross(thrust);
      sum.moment.z() += kTurns[i] * v.Get("k_m", i) * square;
    }
    air({w, *commands, body, v, body.q.conjugate() * body.v, &sum});
    return sum;
  };
  FlightLog log = LogOf(replay::FlyWith(s, {}, ShakyPilot(v, seed), kShakySeconds), v, seed);
  for (int i = 0; i < 4; ++i) {
    const auto of = [&](const char* name) { return v.Get(name, i); };
    log.vehicle->rotors.push_back({{of("x"), of("y"), 0.0},
                                   {0.0, 0.0, -1.0},
                                   of("spin") < 0.0 ? -1 : 1,
                                   of("k_f"),
                                   of("k_m")});
  }
  return log;
}

const double kDragByMass = -kAirDrag / MadeQuadrotor().Get("m");

auto MadeTermsOf(const FlightLog& log) {
  FlightEstimate estimate;
  estimate.vehicle = MadeQuadrotor();
  return TermsOf(log, estimate);
}

// A flight of these equations shows the drag, and the terms at these values; all others at none, or
// as little.
void ExpectTerms(const Equations& air, std::map<std::string, double> truth) {
  for (const char* name : {"K_x", "K_y", "K_z"}) truth[name] = kDragByMass;
  for (const auto& [name, value] : MadeTermsOf(FlyBy(air, 3))) {
    const auto found = truth.find(name);
    const double none = name == "k_f" ? MadeQuadrotor().Get(name) : 0.0;
    const double wanted = found != truth.end() ? found->second : none;
    EXPECT_NEAR(value.value, wanted, std::max(4.0 * value.sigma, 0.05 * std::abs(wanted))) << name;
    if (found != truth.end()) EXPECT_GT(std::abs(value.value), 4.0 * value.sigma) << name;
  }
}

TEST(FlightTerms, RightEquationsShowDragOnly) { ExpectTerms(Drag, {}); }

TEST(FlightTerms, ThrustThatAirSpeedAddsTo) {
  constexpr double kLift = 0.02;  // N s^2/m^2
  const NeutralVehicle v = MadeQuadrotor();
  ExpectTerms(
      [=](const Acting& a) { Drag(a), a.sum->force.z() += kLift * a.v.head<2>().squaredNorm(); },
      {{"translational_lift", kLift / v.Get("m")}});
}

// A converter turned the accelerometer into the body by the attitude of another moment.
TEST(FlightTerms, DragBesideAxesOfAnotherMoment) {
  constexpr double kLate = 0.04;  // s
  FlightLog log = FlyBy(Drag, 3);
  for (ImuSample& sample : log.imu) sample.accel += kLate * sample.gyro.cross(sample.accel);
  const auto terms = MadeTermsOf(log);
  for (const char* name : {"K_x", "K_y"}) {
    EXPECT_NEAR(terms.at(name).value, kDragByMass, 4.0 * terms.at(name).sigma) << name;
  }
}

// The drag is turned into the body twice: the vehicle heads to the east, by a quarter turn.
TEST(FlightTerms, DragThatIsTurnedTwice) {
  const Eigen::Quaterniond quarter(Eigen::AngleAxisd(0.5 * M_PI, Vector3d::UnitZ()));
  const FlightLog log = FlyBy(
      [&](const Acting& a) { a.sum->force -= kAirDrag * ((quarter * a.body.q).conjugate() * a.v); },
      3);
  const auto terms = MadeTermsOf(log);
  EXPECT_NEAR(terms.at("K_x").value, 0.0, 0.1);
  EXPECT_NEAR(std::abs(terms.at("K_xy").value), -kDragByMass, 0.05);
  EXPECT_NEAR(terms.at("K_yx").value, -terms.at("K_xy").value, 0.05);
}

void TurnedTwice(const Acting& a) { a.sum->force -= kAirDrag * (a.body.q.conjugate() * a.v); }

// The same where the vehicle heads along the world's axes: only tilts tell.
TEST(FlightTerms, DragThatIsTurnedTwiceAtAHeadingOfZero) {
  const FlightValue twice = MadeTermsOf(FlyBy(TurnedTwice, 3)).at("K_twice");
  EXPECT_NEAR(twice.value, kDragByMass, std::max(3.0 * twice.sigma, 0.05));
  EXPECT_GT(std::abs(twice.value), 4.0 * twice.sigma);
}

TEST(FlightTerms, DampingOfTheOtherSign) {
  constexpr double kDamping = 1.5e-3;  // N m s
  const NeutralVehicle v = MadeQuadrotor();
  ExpectTerms([=](const Acting& a) { Drag(a), a.sum->moment += kDamping * a.body.w; },
              {{"L_p", kDamping / v.Get("I_x")},
               {"M_q", kDamping / v.Get("I_y")},
               {"N_r", kDamping / v.Get("I_z")}});
}

// A rolling moment along the air speed that has one sign for both spins.
TEST(FlightTerms, RollingMomentsThatAddUp) {
  constexpr double kRolling = 5e-4;  // N s
  const NeutralVehicle v = MadeQuadrotor();
  ExpectTerms(
      [=](const Acting& a) {
        Drag(a), a.sum->moment -= kRolling * Vector3d(a.v.x(), a.v.y(), 0.0);
      },
      {{"L_u", -kRolling / v.Get("I_x")}, {"M_v", -kRolling / v.Get("I_y")}});
}

// Drag that acts 4 cm above the centre of mass.
TEST(FlightTerms, DragFarFromTheCentre) {
  constexpr double kHeight = 0.04;  // m
  const NeutralVehicle v = MadeQuadrotor();
  ExpectTerms(
      [=](const Acting& a) {
        Drag(a), a.sum->moment += Vector3d(0.0, 0.0, kHeight).cross(-kAirDrag * a.v);
      },
      {{"L_v", -kHeight * kAirDrag / v.Get("I_x")}, {"M_u", kHeight * kAirDrag / v.Get("I_y")}});
}

// The rotors' angular momentum turns roll the wrong way when the vehicle pitches.
TEST(FlightTerms, GyroscopicMomentOfTheOtherSign) {
  constexpr double kRotor = 1.3e-6;  // kg m^2
  ExpectTerms(
      [=](const Acting& a) {
        double momentum = 0.0;
        for (std::size_t i = 0; i < 4; ++i) momentum -= kTurns[i] * kRotor * a.w[i];
        const Vector3d moment = -a.body.w.cross(Vector3d(0.0, 0.0, momentum));
        Drag(a), a.sum->moment += Vector3d(-moment.x(), moment.y(), 0.0);
      },
      {{"J_r_roll", -kRotor}, {"J_r_pitch", kRotor}});
}

// The rotors' moments follow commands at once: they lead the thrust by the lag.
TEST(FlightTerms, MomentsByCommands) {
  const NeutralVehicle v = MadeQuadrotor();
  const FlightLog log = FlyBy(
      [=](const Acting& a) {
        Drag(a);
        for (int i = 0; i < 4; ++i) {
          const auto k = static_cast<std::size_t>(i);
          a.sum->moment.z() += kTurns[i] * a.vehicle.Get("k_m", i) *
                               (a.commands[k] * a.commands[k] - a.w[k] * a.w[k]);
        }
      },
      3);
  const double wanted = 2.0 * v.Get("k_m") * v.Get("w_h") * 0.03;
  EXPECT_NEAR(MadeTermsOf(log).at("J_r_yaw").value, wanted, 0.3 * wanted);
}

TEST(FlightTerms, SlowLogsAloneNameMistakesInCode) {
  const auto damped = [](double size) {
    return [size](const Acting& a) { Drag(a), a.sum->moment -= size * a.body.w; };
  };
  const Audit audit = AuditLogs(FlyBy(damped(-1.5e-3), 1), {FlyBy(damped(1.5e-3), 2)});
  ASSERT_FALSE(audit.contradicted.empty());
  EXPECT_EQ(audit.contradicted[0].parameter, "L_p") << AuditTable(audit);
  for (const Contradicted& entry : audit.contradicted) {
    EXPECT_TRUE(entry.parameter == "L_p" || entry.parameter == "M_q" || entry.parameter == "N_r")
        << AuditTable(audit);
  }
  const Audit turned = AuditLogs(FlyBy(TurnedTwice, 1), {FlyBy(Drag, 2)});
  ASSERT_FALSE(turned.contradicted.empty());
  EXPECT_EQ(turned.contradicted[0].parameter, "K_twice") << AuditTable(turned);
  EXPECT_TRUE(AuditLogs(FlyBy(Drag, 1), {FlyBy(Drag, 2)}).contradicted.empty());
}

// --- Parameters identified from flights of simulators' own equations: 95 % intervals hold the
// truth.

constexpr double kTopSpeed = 2200.0, kLinearDrag = -0.3;  // rad/s, 1/s

TEST(SimulatorCoverage, SlowIntervalsHoldWhatIndependentReplaysFly) {
  int inside = 0, all = 0;
  std::string outside;
  for (const char* to : {"rotorpy", "gz", "flightmare", "crazyflow"}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      NeutralVehicle truth = MadeQuadrotor();
      truth.body["tau"] = 0.03, truth.body["full_speed"] = kTopSpeed;
      const bool by_rotors = std::string(to) == "rotorpy" || std::string(to) == "gz";
      if (by_rotors) {
        truth.body["rotor_speed_drag"] = -kLinearDrag / truth.Get("S_h");
      } else {
        for (const char* name : {"K_x", "K_y"}) truth.body[name] = kLinearDrag;
      }
      TestFolder folder;
      const Target& target = FindTarget(to);
      truth.gravity = target.gravity;
      const Export exported = ExportVehicle(truth, target);
      const std::filesystem::path file = folder / ("vehicle" + exported.files[0].extension);
      WriteExport(exported, target, file);
      const replay::Simulator simulator =
          std::string(to) == "rotorpy"      ? replay::LoadRotorPy(file)
          : std::string(to) == "gz"         ? replay::LoadGazebo(file, false)
          : std::string(to) == "flightmare" ? replay::LoadFlightmare(file)
                                            : replay::LoadCrazyflow(file);
      const replay::Flight flight =
          replay::FlyWith(simulator, {}, ShakyPilot(exported.vehicle, seed), kShakySeconds);
      const FlightLog log = LogOf(flight, exported.vehicle, seed);
      const FlightEstimate estimate = EstimateFromFlight(log, exported.vehicle);
      for (const char* name : {"k_f", "k_m/k_f", "I_x", "I_y", "r_BM_x", "r_BM_y", "K_x", "K_y"}) {
        const FlightValue& value = estimate.values.at(name);
        const double true_value = std::string(name) == "k_m/k_f"
                                      ? truth.Get("k_m") / truth.Get("k_f")
                                  : name[0] == 'K' ? kLinearDrag
                                                   : truth.Get(name);
        // Drag by the rotors' speeds is linear drag at one thrust only.
        if (!value.shown || (by_rotors && name[0] == 'K')) continue;
        const double off = (value.value - true_value) / value.sigma;
        ++all;
        if (std::abs(off) < 1.96) {
          ++inside;
        } else {
          outside += fmt::format("{} seed {} {}: {:.4g} +- {:.2g}, truth {:.4g} ({:.1f} sigma)\n",
                                 to, seed, name, value.value, value.sigma, true_value, off);
        }
      }
    }
  }
  std::printf("%d of %d inside\n%s", inside, all, outside.c_str());
  EXPECT_GT(all, 70);
  EXPECT_GE(inside, static_cast<int>(0.9 * all)) << outside;
}

}  // namespace
}  // namespace trueline
