#include "cost_functions/models/rotor_driven_model.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "cost_functions/models/rotor_aero_model.h"

namespace trueline {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Inverse of InertiaFromLogSecondMoments.
template <class T>
Vec3<T> LogSecondMomentsFromInertia(const Vec3<T>& inertia) {
  using std::log;
  const T half_trace = (inertia[0] + inertia[1] + inertia[2]) * T(0.5);
  return Vec3<T>(log(half_trace - inertia[0]), log(half_trace - inertia[1]),
                 log(half_trace - inertia[2]));
}

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The papers' equations as they write them: z-up earth, forward-left-up body, rotation matrices.
struct PaperState {
  Matrix3d R;
  Vector3d r, v, w;
};
struct PaperVehicle {
  double m = 0.2463;
  Vector3d inertia{0.623e-3, 0.678e-3, 1.076e-3}, r_BM{0.003, -0.0005, 0.025};
  Vector3d r_BP{0.04242, 0.01638, 0.0}, r_BI{0.01, -0.02, 0.004};
  Vector3d b_a{0.1, -0.2, 0.3}, b_w{0.01, 0.02, -0.03};
  double k_f = 3.811e-7, k_m = 3.62e-9;
  Vector3d t[4] = {{0.071, -0.080, 0}, {-0.071, -0.080, 0}, {-0.071, 0.080, 0}, {0.071, 0.080, 0}};
  double sign[4] = {1, -1, 1, -1};  // of the reaction moment about z up
};
struct PaperRates {
  Vector3d v_dot, w_dot, accel, position;
};

PaperRates PaperModel(const PaperVehicle& p, const PaperState& s, const double* u) {
  Vector3d F = Vector3d::Zero(), M = Vector3d::Zero();
  const Vector3d n = Vector3d::UnitZ();
  for (int i = 0; i < 4; ++i) {
    F += p.k_f * u[i] * n;
    M += (p.t[i] - p.r_BM).cross(p.k_f * u[i] * n) + p.sign[i] * p.k_m * u[i] * n;
  }
  const Matrix3d J = p.inertia.asDiagonal();
  PaperRates out;
  out.v_dot = s.R * F / p.m - 9.81 * n;
  out.w_dot = J.inverse() * (M - s.w.cross(J * s.w));
  const Vector3d arm = p.r_BI - p.r_BM;
  out.accel = F / p.m + out.w_dot.cross(arm) + s.w.cross(s.w.cross(arm)) + p.b_a;
  out.position = s.r + s.R * (p.r_BP - p.r_BM);
  return out;
}

const Matrix3d kFlip = Vector3d(1, -1, -1).asDiagonal();  // z-up <-> NED, FLU <-> FRD

RotorDrivenModel ConvertedModel(const PaperVehicle& p) {
  std::vector<Rotor> rotors;
  rotors.reserve(4);
  for (int i = 0; i < 4; ++i) {
    rotors.push_back({kFlip * p.t[i], {0, 0, -1}, p.sign[i] > 0 ? 1 : -1, p.k_f, p.k_m});
  }
  return RotorDrivenModel(rotors);
}

void Put(const Vector3d& v, int index, double* x) { Eigen::Map<Vector3d>(x + index) = v; }

std::vector<double> ConvertedState(const PaperVehicle& p, const PaperState& s) {
  using M = RotorDrivenModel;
  std::vector<double> x(M::kStates);
  const Eigen::Quaterniond q(Matrix3d(kFlip * s.R * kFlip));
  x[0] = q.w(), x[1] = q.x(), x[2] = q.y(), x[3] = q.z();
  Put(kFlip * s.r, M::kPosition, x.data());
  Put(kFlip * s.v, M::kVelocity, x.data());
  Put(kFlip * s.w, M::kRate, x.data());
  x[M::kMass] = p.m;
  Put(p.inertia, M::kInertia, x.data());
  Put(kFlip * p.r_BM, M::kCentre, x.data());
  Put(kFlip * p.r_BP, M::kPoseArm, x.data());
  Put(kFlip * p.r_BI, M::kImuArm, x.data());
  Put(kFlip * p.b_a, M::kAccelBias, x.data());
  Put(kFlip * p.b_w, M::kGyroBias, x.data());
  x[M::kThrustScale] = x[M::kTorqueScale] = 1.0;
  return x;
}

TEST(RotorDrivenModel, AgreesWithThePapersEquationsInZUpAxes) {
  const PaperVehicle p;
  PaperState s;
  s.R = Eigen::Quaterniond(0.8, 0.3, -0.4, 0.2).normalized().toRotationMatrix();
  s.r = Vector3d(1, 2, 3), s.v = Vector3d(-1, 0.5, 0.2), s.w = Vector3d(2, -3, 1.5);
  const double u[] = {1.5e6, 1.7e6, 1.3e6, 1.6e6};
  const PaperRates want = PaperModel(p, s, u);

  const RotorDrivenModel model = ConvertedModel(p);
  const std::vector<double> x = ConvertedState(p, s);
  double dx[RotorDrivenModel::kMoving], imu[6], position[3];
  model.Derivative(x.data(), u, dx);
  model.Imu(x.data(), u, imu);
  RotorDrivenModel::Position(x.data(), position);
  using Map = Eigen::Map<const Vector3d>;
  EXPECT_LT((kFlip * want.v_dot - Map(dx + RotorDrivenModel::kVelocity)).norm(), 1e-12);
  EXPECT_LT((kFlip * want.w_dot - Map(dx + RotorDrivenModel::kRate)).norm(), 1e-9);
  EXPECT_LT((kFlip * want.accel - Map(imu)).norm(), 1e-10);
  EXPECT_LT((kFlip * (s.w + p.b_w) - Map(imu + 3)).norm(), 1e-15);
  EXPECT_LT((kFlip * want.position - Map(position)).norm(), 1e-12);
}

TEST(RotorDrivenModel, QuaternionRateTurnsTheBodyAxesByTheRate) {
  const RotorDrivenModel model = ConvertedModel({});
  PaperState s{Eigen::Quaterniond(0.9, -0.1, 0.3, 0.2).normalized().toRotationMatrix(),
               Vector3d::Zero(), Vector3d::Zero(), Vector3d(0.4, -1.1, 0.7)};
  const std::vector<double> x = ConvertedState({}, s);
  const double u[] = {1e6, 1e6, 1e6, 1e6};
  double dx[RotorDrivenModel::kMoving];
  model.Derivative(x.data(), u, dx);
  const double h = 1e-6;
  const auto rotation = [&](double t) {
    return Eigen::Quaterniond(x[0] + t * dx[0], x[1] + t * dx[1], x[2] + t * dx[2],
                              x[3] + t * dx[3])
        .normalized()
        .toRotationMatrix();
  };
  const Matrix3d rate = rotation(0).transpose() * (rotation(h) - rotation(-h)) / (2 * h);
  const Vector3d w = RotorDrivenModel::Vector(x.data(), RotorDrivenModel::kRate);
  EXPECT_LT((Vector3d(rate(2, 1), rate(0, 2), rate(1, 0)) - w).norm(), 1e-8);
}

TEST(RotorDrivenModel, RotationOfAUnitQuaternionIsEigens) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(0.3, -0.5, 0.7, 0.2).normalized();
  const Vec3<double> v(1.0, -2.0, 0.5);
  EXPECT_LT((RotateByUnit(Vec4<double>(q.w(), q.x(), q.y(), q.z()), v) - q * v).norm(), 1e-15);
}

TEST(Inertia, LogSecondMomentsAlwaysGiveABodyThatCanExist) {
  for (const Vector3d& s : {Vector3d(0, 0, 0), Vector3d(-9, 3, 1), Vector3d(-20, -7, -7.5)}) {
    const Vector3d inertia = InertiaFromLogSecondMoments<double>(s);
    EXPECT_TRUE(IsPhysicalInertia(inertia)) << inertia.transpose();
    EXPECT_LT((LogSecondMomentsFromInertia<double>(inertia) - s).norm(), 1e-4);
  }
  EXPECT_FALSE(IsPhysicalInertia({1.0, 1.0, 2.1}));
  EXPECT_FALSE(IsPhysicalInertia({-1.0, 1.0, 1.0}));
}

// A solid box m, a, b, c: J_x = m (b^2 + c^2) / 12, second moment about the plane x = 0 m a^2 / 12.
TEST(Inertia, BoxHasItsTextbookMoments) {
  const double m = 0.25, a = 0.2, b = 0.16, c = 0.05;
  const Vector3d s = Vector3d(a * a, b * b, c * c) * m / 12.0;
  const Vector3d want = Vector3d(b * b + c * c, a * a + c * c, a * a + b * b) * m / 12.0;
  EXPECT_LT((InertiaFromLogSecondMoments<double>(s.array().log().matrix()) - want).norm(), 1e-15);
}

// A pose that is late was measured where the sensor was then: at the end of an arm that turns.
TEST(RotorAeroModel, ALatePoseIsWhereTheSensorWas) {
  using Model = RotorAeroModel;
  const Quaterniond q = Quaterniond(0.9, -0.1, 0.3, 0.2).normalized();
  const Vector3d p(1.0, 2.0, -3.0), v(4.0, -2.0, 0.5), w(3.0, -5.0, 1.5), arm(0.3, -0.1, 0.05);
  const double delay = 1e-4;
  std::vector<double> x(Model::kStates, 0.0);
  x[0] = q.w(), x[1] = q.x(), x[2] = q.y(), x[3] = q.z();
  Vector3d::Map(&x[Model::Base::kPosition]) = p;
  Vector3d::Map(&x[Model::Base::kVelocity]) = v;
  Vector3d::Map(&x[Model::Base::kRate]) = w;
  Vector3d::Map(&x[Model::Base::kPoseArm]) = arm;
  x[Model::kPoseDelay] = delay;
  const Quaterniond q_then = q * Quaterniond(Eigen::AngleAxisd(-delay * w.norm(), w.normalized()));
  Vector3d position;
  Model::Position(x.data(), position.data());
  EXPECT_LT((position - (p - delay * v + q_then * arm)).norm(), 1e-7);
  const Vec4<double> attitude = Model::Attitude(x.data());
  EXPECT_LT((attitude - Vec4<double>(q_then.w(), q_then.x(), q_then.y(), q_then.z())).norm(), 1e-6);
}

}  // namespace
}  // namespace trueline
