// Parameters identified from flights of simulators' own equations: 95 % intervals hold the truth.
#include <gtest/gtest.h>

#include "problems/simulators/export_vehicle.h"
#include "problems/simulators/flight_estimate.h"
#include "tests/common/test_files.h"
#include "tests/simulators/shaky_flight.h"

namespace trueline {
namespace {

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
