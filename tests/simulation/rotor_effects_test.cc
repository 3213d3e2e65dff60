// Every effect that a rotor-driven model sees against its definition, written out here, on the true
// flight.
#include <cmath>

#include "tests/common/matchers.h"
#include "tests/simulation/short_flight.h"

namespace trueline::testing_simulation {
namespace {

using Eigen::Vector3d;
using simulation::TruthSample;

class RotorEffects : public ::testing::Test {
 protected:
  void FlyEffect(const std::string& id, const std::map<std::string, double>& values) {
    config.duration = 6.0;
    config.warm_up = 2.0;
    config.effects = {{id, values}};
    flown = Fly(config);
    ASSERT_LT(flown.truth.path_error_max, 0.3);
  }
  // Specific thrust with each rotor's thrust times `factor(rotor)`, in m/s^2.
  template <class Factor>
  double Thrust(const TruthSample& s, const Factor& factor) const {
    double sum = 0.0;
    for (int i = 0; i < 4; ++i) {
      sum += factor(i) * config.vehicle.rotors[i].k_f * s.rotors[i] * s.rotors[i];
    }
    return sum / config.vehicle.mass;
  }
  double NominalThrust(const TruthSample& s) const {
    return Thrust(s, [](int) { return 1.0; });
  }
  // Specific force without the effect, in the velocity of the body (still air).
  Vector3d PlainForce(const TruthSample& s) const {
    return config.vehicle.drag.cwiseProduct(Velocity(s)) - Vector3d(0, 0, NominalThrust(s));
  }
  static Vector3d Velocity(const TruthSample& s) { return s.q_E_B.conjugate() * s.v_E; }
  template <class Expected>
  void ExpectForce(const Expected& expected) const {
    for (const TruthSample& s : flown.truth.trajectory) {
      ASSERT_LT((s.f_B - expected(s)).norm(), 1e-9) << "at " << s.t << " s";
    }
  }
  template <class Expected>
  void ExpectThrust(const Expected& expected) const {
    for (const TruthSample& s : flown.truth.trajectory) {
      ASSERT_NEAR(s.thrust, expected(s), 1e-9) << "at " << s.t << " s";
    }
  }
  // The angular acceleration is that of rotors about the centre of mass, gyroscopic terms and more.
  template <class Centre, class More>
  void ExpectMoment(const Centre& centre, const More& more) const {
    const Eigen::Matrix3d inertia = config.vehicle.inertia.asDiagonal();
    for (const TruthSample& s : flown.truth.trajectory) {
      Vector3d moment = more(s);
      for (int i = 0; i < 4; ++i) {
        const Rotor& rotor = config.vehicle.rotors[i];
        const double squared = s.rotors[i] * s.rotors[i];
        moment += (rotor.position - centre(s)).cross(Vector3d(0, 0, -rotor.k_f * squared));
        moment.z() -= rotor.spin * rotor.k_m * squared;  // drag turns the body against the rotor
      }
      ASSERT_LT((inertia * s.dw_B + s.w_B.cross(inertia * s.w_B) - moment).norm(), 1e-9);
    }
  }
  static Vector3d Nothing(const TruthSample&) { return Vector3d::Zero(); }

  SimulationConfig config = ShortExactFlight();
  Flown flown;
};

TEST_F(RotorEffects, LinearDrag) {
  FlyEffect("linear_drag", {{"K_x", -0.2}, {"K_y", -0.1}, {"K_z", -0.3}});
  ExpectForce([&](const TruthSample& s) -> Vector3d {
    return PlainForce(s) + Vector3d(-0.2, -0.1, -0.3).cwiseProduct(Velocity(s));
  });
}

TEST_F(RotorEffects, ThrustSag) {
  FlyEffect("thrust_sag", {{"d", 0.01}});
  ExpectThrust([&](const TruthSample& s) { return NominalThrust(s) * (1.0 - 0.01 * s.t); });
}

TEST_F(RotorEffects, RotorLoss) {
  FlyEffect("rotor_loss", {{"rotor", 2}, {"factor", 0.9}});
  for (const TruthSample& s : flown.truth.trajectory) {
    ASSERT_NEAR(s.thrust, Thrust(s, [](int i) { return i == 2 ? 0.9 : 1.0; }), 1e-9);
  }
}

TEST_F(RotorEffects, RotorInflow) {
  FlyEffect("rotor_inflow", {{"k", 1e-4}});
  ExpectForce([&](const TruthSample& s) -> Vector3d {
    return PlainForce(s) - Vector3d(0, 0, 1e-4 * s.rotors.sum() * Velocity(s).z());
  });
}

TEST_F(RotorEffects, RotorSpeedDrag) {
  FlyEffect("rotor_speed_drag", {{"k", 1e-4}});
  ExpectForce([&](const TruthSample& s) -> Vector3d {
    return PlainForce(s) - 1e-4 * s.rotors.sum() * Vector3d(Velocity(s).x(), Velocity(s).y(), 0);
  });
}

TEST_F(RotorEffects, TranslationalLift) {
  FlyEffect("translational_lift", {{"k", 0.05}});
  ExpectForce([&](const TruthSample& s) -> Vector3d {
    return PlainForce(s) - Vector3d(0, 0, 0.05 * Velocity(s).head<2>().squaredNorm());
  });
}

TEST_F(RotorEffects, BodyDrag) {
  FlyEffect("body_drag", {{"c_x", 0.04}, {"c_y", 0.03}, {"c_z", 0.02}});
  ExpectForce([&](const TruthSample& s) -> Vector3d {
    return PlainForce(s) -
           Velocity(s).norm() * Vector3d(0.04, 0.03, 0.02).cwiseProduct(Velocity(s));
  });
}

TEST_F(RotorEffects, AirMoment) {
  FlyEffect("air_moment", {{"roll", 3e-4}, {"pitch", 5e-4}});
  ExpectMoment(Nothing, [](const TruthSample& s) {
    return Vector3d(-3e-4 * Velocity(s).y(), 5e-4 * Velocity(s).x(), 0.0);
  });
}

TEST_F(RotorEffects, GroundEffect) {
  FlyEffect("ground_effect", {{"k", 0.4}});
  ExpectThrust([&](const TruthSample& s) {
    return NominalThrust(s) / (1.0 - std::pow(0.4 / -s.p_E.z(), 2));
  });
}

TEST_F(RotorEffects, PayloadStep) {
  FlyEffect("payload_step", {{"t_step", 3.0}, {"mass", 0.05}});
  ExpectThrust(
      [&](const TruthSample& s) { return NominalThrust(s) * (s.t >= 3.0 ? 0.40 / 0.45 : 1.0); });
}

TEST_F(RotorEffects, ComStep) {
  FlyEffect("com_step", {{"t_step", 3.0}, {"dx", 0.004}, {"dy", -0.003}});
  const auto centre = [](const TruthSample& s) -> Vector3d {
    return s.t >= 3.0 ? Vector3d(0.004, -0.003, 0.0) : Vector3d::Zero();
  };
  ExpectMoment(centre, Nothing);
}

TEST_F(RotorEffects, RotorTilt) {
  FlyEffect("rotor_tilt", {{"roll", 0.0}, {"pitch", 0.03}});
  ExpectForce([&](const TruthSample& s) -> Vector3d {  // nose up: thrust tilts back
    const double thrust = NominalThrust(s);
    return config.vehicle.drag.cwiseProduct(Velocity(s)) +
           thrust * Vector3d(-std::sin(0.03), 0.0, -std::cos(0.03));
  });
}

TEST_F(RotorEffects, MotorLag) {
  FlyEffect("motor_lag", {{"tau", 0.05}});
  const auto& truth = flown.truth.trajectory;
  const double decay = std::exp(-1.0 / 512.0 / 0.05);
  for (std::size_t k = 0; k + 1 < truth.size(); ++k) {
    const double expected =
        truth[k].command[0] + decay * (truth[k].rotors[0] - truth[k].command[0]);
    ASSERT_NEAR(truth[k + 1].rotors[0], expected, 1e-4);
  }
}

}  // namespace
}  // namespace trueline::testing_simulation
