#include "problems/rotor/rotor_segment.h"

#include <glog/logging.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "cost_functions/models/rotation.h"
#include "problems/rotor/rotor_slopes.h"
#include "problems/rotor/rotor_step.h"

namespace trueline {
namespace {

using Model = RotorAeroModel;
constexpr int kMoving = Model::kMovingErrors;
constexpr int kErrors = Model::kErrors;
// Floor of the standard deviations at a segment's end: a covariance of a single step would be
// singular without it. rad, m, m/s, rad/s.
constexpr std::array<double, 4> kFloor = {1e-6, 1e-6, 1e-6, 1e-6};

}  // namespace

std::vector<RotorSegment> CutSegments(const RotorData& data) {
  std::vector<RotorSegment> segments;
  segments.reserve(data.poses.size());
  std::size_t imu = 0;
  while (imu < data.imu.size() && data.imu[imu].t < data.poses.front().t - 1e-9) ++imu;
  for (std::size_t i = 0; i + 1 < data.poses.size(); ++i) {
    RotorSegment segment;
    double t = data.poses[i].t;
    const double end = data.poses[i + 1].t;
    while (t < end - 1e-9) {
      const bool sample = imu < data.imu.size() && data.imu[imu].t <= t + 1e-9;
      if (sample) ++imu, ++segment.num_imu;
      double next = std::min(end, t + kLongestStep);
      if (imu < data.imu.size()) next = std::min(next, data.imu[imu].t);
      segment.steps.push_back({t, next - t, sample ? static_cast<int>(imu) - 1 : -1});
      t = next;
    }
    segments.push_back(std::move(segment));
  }
  return segments;
}

Eigen::Matrix3d AttitudeErrorSlope(const RotorState& end, const RotorNode& next) {
  Vec4<double> turn =
      HamiltonProduct(Conjugate(Vec4<double>(end.head<4>())), Vec4<double>(next.head<4>()));
  if (turn[0] < 0.0) turn = -turn;
  return Skew<double>(turn.tail<3>()) - turn[0] * Eigen::Matrix3d::Identity();
}

struct SegmentModel::Shot {
  Eigen::VectorXd readings;  // 6 for each IMU sample
  RotorState end;
  Eigen::MatrixXd d_readings;  // rows x kErrors, where asked for
  RotorStepMatrix d_end;
};

SegmentModel::SegmentModel(const RotorAeroModel& model, const RotorData& data,
                           const RotorNoise& noise, RotorSegment segment)
    : model_(model), data_(data), noise_(noise), segment_(std::move(segment)) {}

SegmentModel::Shot SegmentModel::Shoot(const RotorState& x0, bool derivatives) const {
  Shot shot;
  shot.readings.resize(6 * segment_.num_imu);
  if (derivatives) shot.d_readings.resize(6 * segment_.num_imu, kErrors);
  shot.d_end.leftCols<kMoving>().setIdentity();
  shot.d_end.rightCols<Model::kConstants>().setZero();
  const Eigen::Matrix<double, 6, 1> none = Eigen::Matrix<double, 6, 1>::Zero();
  RotorState x = x0;
  int row = 0;
  for (const RotorSegment::Step& step : segment_.steps) {
    if (step.imu >= 0 && derivatives) {
      const RotorReading reading = ReadWithSlope(model_, x, data_.InputAt(step.t));
      shot.readings.segment<6>(row) = reading.y;
      auto d_reading = shot.d_readings.middleRows<6>(row);
      d_reading.noalias() = reading.slope.leftCols<kMoving>() * shot.d_end;
      d_reading.rightCols<Model::kConstants>() += reading.slope.rightCols<Model::kConstants>();
    } else if (step.imu >= 0) {
      model_.Imu(x.data(), data_.InputAt(step.t), shot.readings.data() + row);
    }
    if (step.imu >= 0) row += 6;
    const RotorInput input = data_.InputAt(step.t + 0.5 * step.dt);
    if (!derivatives) {
      RotorMidpointStep(model_, input, none.data(), step.dt, x.data());
      continue;
    }
    const RotorStepMatrix F = StepWithSlope(model_, input, none, step.dt, &x);
    shot.d_end = (F.leftCols<kMoving>() * shot.d_end).eval();
    shot.d_end.rightCols<Model::kConstants>() += F.rightCols<Model::kConstants>();
  }
  x.head<4>().normalize();
  shot.end = x;
  return shot;
}

SegmentResidual SegmentModel::Evaluate(const RotorNode& start, const RotorNode& next,
                                       const RotorConstants& constants, bool derivatives) const {
  const Shot shot = Shoot(Joined(start, constants), derivatives);
  const int readings = 6 * segment_.num_imu;
  SegmentResidual residual;
  residual.error.resize(segment_.NumRows());
  int row = 0;
  for (const RotorSegment::Step& step : segment_.steps) {
    if (step.imu < 0) continue;
    const RotorImu& imu = data_.imu[step.imu];
    residual.error.segment<3>(row) = imu.accel - shot.readings.segment<3>(row);
    residual.error.segment<3>(row + 3) = imu.gyro - shot.readings.segment<3>(row + 3);
    row += 6;
  }
  residual.error.tail<kMoving>() = Minus(shot.end, Joined(next, constants)).head<kMoving>();
  if (!derivatives) return residual;

  Eigen::Matrix<double, kMoving, kErrors> d_end = -shot.d_end;
  d_end.topRows<3>() = AttitudeErrorSlope(shot.end, next) * shot.d_end.topRows<3>();
  residual.d_next = Eigen::MatrixXd::Zero(residual.error.size(), kMoving);
  residual.d_next.bottomRows<kMoving>().setIdentity();
  residual.d_next.block<3, 3>(readings, 0) = -AttitudeErrorSlope(shot.end, next).transpose();
  residual.d_start.resize(residual.error.size(), kMoving);
  residual.d_start << -shot.d_readings.leftCols(kMoving), d_end.leftCols<kMoving>();
  residual.d_constants.resize(residual.error.size(), Model::kConstants);
  residual.d_constants << -shot.d_readings.rightCols(Model::kConstants),
      d_end.rightCols<Model::kConstants>();
  return residual;
}

// d(rows) / d(all disturbances, each scaled to its sigma).
Eigen::MatrixXd SegmentModel::Disturbed(const RotorState& x0) const {
  const Eigen::Matrix<double, 6, 1> none = Eigen::Matrix<double, 6, 1>::Zero();
  const auto count = static_cast<Eigen::Index>(6 * segment_.steps.size());
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(segment_.NumRows(), count);
  Eigen::Matrix<double, kMoving, Eigen::Dynamic> moved(kMoving, count);
  RotorState x = x0;
  int row = 0, column = 0;
  for (const RotorSegment::Step& step : segment_.steps) {
    Eigen::Matrix<double, 6, 1> sigma;
    sigma << Eigen::Vector3d::Constant(noise_.force_density / std::sqrt(step.dt)),
        Eigen::Vector3d::Constant(noise_.angular_density / std::sqrt(step.dt));
    if (step.imu >= 0) {
      const RotorReading reading = ReadWithSlope(model_, x, data_.InputAt(step.t));
      rows.block(row, 0, 6, column).noalias() =
          reading.slope.leftCols<kMoving>() * moved.leftCols(column);
      rows.block<6, 6>(row, column) = DisturbanceFeedthrough(x) * sigma.asDiagonal();
      row += 6;
    }
    moved.middleCols<6>(column) = DisturbanceInput(x, step.dt) * sigma.asDiagonal();
    const RotorStepMatrix F =
        StepWithSlope(model_, data_.InputAt(step.t + 0.5 * step.dt), none, step.dt, &x);
    moved.leftCols(column) = (F.leftCols<kMoving>() * moved.leftCols(column)).eval();
    column += 6;
  }
  rows.bottomRows<kMoving>() = moved;
  return rows;
}

void SegmentModel::SetWeight(const RotorNode& start, const RotorConstants& constants) {
  const Eigen::MatrixXd disturbed = Disturbed(Joined(start, constants));
  Eigen::MatrixXd cov = Eigen::MatrixXd::Zero(disturbed.rows(), disturbed.rows());
  cov.selfadjointView<Eigen::Lower>().rankUpdate(disturbed);
  for (int i = 0; i < segment_.num_imu; ++i) {
    cov.diagonal().segment<3>(6 * i).array() += noise_.accel * noise_.accel;
    cov.diagonal().segment<3>(6 * i + 3).array() += noise_.gyro * noise_.gyro;
  }
  for (int i = 0; i < 4; ++i) {
    cov.diagonal().segment<3>(6 * segment_.num_imu + 3 * i).array() += kFloor[i] * kFloor[i];
  }
  const Eigen::LLT<Eigen::MatrixXd> llt(cov);
  CHECK(llt.info() == Eigen::Success);
  lower_ = llt.matrixL();
}

void SegmentModel::Whiten(SegmentResidual* residual) const {
  const auto L = lower_.triangularView<Eigen::Lower>();
  L.solveInPlace(residual->error);
  if (residual->d_start.size() == 0) return;
  L.solveInPlace(residual->d_start);
  L.solveInPlace(residual->d_next);
  L.solveInPlace(residual->d_constants);
}

void SegmentModel::Whiten(Eigen::MatrixXd* rows) const {
  lower_.triangularView<Eigen::Lower>().solveInPlace(*rows);
}

double SegmentModel::LogDeterminant() const { return 2.0 * lower_.diagonal().array().log().sum(); }

}  // namespace trueline
