#include "problems/rotor/rotor_segment.h"

#include <glog/logging.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "cost_functions/models/rotation.h"
#include "problems/rotor/rotor_slopes.h"
#include "problems/rotor/rotor_step.h"

namespace trueline {
namespace {

// Columns that are whitened together: the inner loops run over them, since their number, unlike
// that of the state's errors, fills a processor's registers.
constexpr int kTogether = 8;
template <int kRows>
using Together = Eigen::Matrix<double, kRows, kTogether, Eigen::RowMajor>;

// *sum += factor a b; of a lower triangular `a` only the triangle is read.
template <bool kLower = false, class A, class B, class Sum>
void AddRows(double factor, const A& a, const B& b, Sum* sum) {
  for (int i = 0; i < A::RowsAtCompileTime; ++i) {
    Eigen::Matrix<double, 1, kTogether> row = sum->row(i);
    const int end = kLower ? i + 1 : static_cast<int>(A::ColsAtCompileTime);
    for (int k = 0; k < end; ++k) row += (factor * a(i, k)) * b.row(k);
    sum->row(i) = row;
  }
}

// The first `count` columns of `rows`, padded with zeros.
template <int kRows>
Together<kRows> Load(const Eigen::Ref<Eigen::MatrixXd>& rows, Eigen::Index row, Eigen::Index column,
                     Eigen::Index count) {
  Together<kRows> loaded = Together<kRows>::Zero();
  loaded.leftCols(count) = rows.block(row, column, kRows, count);
  return loaded;
}

}  // namespace

void SegmentWeight::Read(const ReadingByState& H, const ReadingSquare& D, const Reading& variance) {
  const ReadingByState HP = H.lazyProduct(P_);
  ReadingSquare cov = HP.lazyProduct(H.transpose());
  cov += D.lazyProduct(D.transpose());
  cov.diagonal() += variance;
  const Eigen::LLT<ReadingSquare> llt(cov);
  regular_ = regular_ && llt.info() == Eigen::Success;
  log_determinant_ += 2.0 * llt.matrixLLT().diagonal().array().log().sum();
  Innovation& innovation = innovations_.emplace_back();
  innovation.W = llt.matrixL().solve(ReadingSquare::Identity());
  innovation.U = innovation.W.lazyProduct(H);
  D_ = D;
  waiting_ = true;
}

void SegmentWeight::Step(const StateByState& F, const StateByReading& G, const State& variance) {
  const StateByState FP = F.lazyProduct(P_);
  P_ = FP.lazyProduct(F.transpose());
  P_ += G.lazyProduct(G.transpose());
  P_.diagonal() += variance;
  if (waiting_) {
    Innovation& innovation = innovations_.back();
    const StateByReading GD = G.lazyProduct(D_.transpose());
    innovation.F = F;
    innovation.K = FP.lazyProduct(innovation.U.transpose());
    innovation.K += GD.lazyProduct(innovation.W.transpose());
    P_ -= innovation.K.lazyProduct(innovation.K.transpose());
  } else if (!innovations_.empty()) {
    Innovation& innovation = innovations_.back();
    innovation.F = F.lazyProduct(innovation.F).eval();
    innovation.K = F.lazyProduct(innovation.K).eval();
  }
  waiting_ = false;
}

void SegmentWeight::End(const State& variance) {
  P_.diagonal() += variance;
  const Eigen::LLT<StateByState> llt(P_);
  regular_ = regular_ && llt.info() == Eigen::Success;
  end_ = llt.matrixL().solve(StateByState::Identity());
  log_determinant_ += 2.0 * llt.matrixLLT().diagonal().array().log().sum();
}

bool SegmentWeight::IsRegular() const { return regular_ && std::isfinite(log_determinant_); }

void SegmentWeight::Whiten(Eigen::Ref<Eigen::MatrixXd> rows) const {
  for (Eigen::Index j = 0; j < rows.cols(); j += kTogether) {
    const Eigen::Index count = std::min<Eigen::Index>(kTogether, rows.cols() - j);
    Together<kState> z = Together<kState>::Zero();
    Eigen::Index row = 0;
    for (const Innovation& at : innovations_) {
      Together<kReading> w = Together<kReading>::Zero();
      AddRows<true>(1.0, at.W, Load<kReading>(rows, row, j, count), &w);
      AddRows(-1.0, at.U, z, &w);
      Together<kState> next = Together<kState>::Zero();
      AddRows(1.0, at.F, z, &next);
      AddRows(1.0, at.K, w, &next);
      rows.block(row, j, kReading, count) = w.leftCols(count);
      z = next;
      row += kReading;
    }
    rows.block(row, j, kState, count) -= z.leftCols(count);
  }
  WhitenEnd(rows.bottomRows<kState>());
}

void SegmentWeight::WhitenEnd(Eigen::Ref<Eigen::MatrixXd> rows) const {
  for (Eigen::Index j = 0; j < rows.cols(); j += kTogether) {
    const Eigen::Index count = std::min<Eigen::Index>(kTogether, rows.cols() - j);
    Together<kState> whitened = Together<kState>::Zero();
    AddRows<true>(1.0, end_, Load<kState>(rows, 0, j, count), &whitened);
    rows.middleCols(j, count) = whitened.leftCols(count);
  }
}

namespace {

using Model = RotorAeroModel;
using Base = RotorDrivenModel;
constexpr int kMoving = Model::kMovingErrors;
constexpr int kRateError = 9;  // its place in the error state
using Weight = SegmentWeight;
using Disturbance = Eigen::Matrix<double, 6, 1>;
// Floor of the standard deviations at a segment's end: a covariance of a single step would be
// singular without it. rad, m, m/s, rad/s, rad/s^2.
constexpr double kFloor = 1e-6;

Disturbance DriftOnly(const Eigen::Vector3d& drift) {
  Disturbance held;
  held << Eigen::Vector3d::Zero(), drift;
  return held;
}

// d(node error after a step) / d(node error before): the drift acts as a disturbance held over it.
Weight::StateByState NodeStep(const SegmentPath::Step& at) {
  Weight::StateByState F = Weight::StateByState::Zero();
  F.topLeftCorner<kMoving, kMoving>() = at.F.by_error.leftCols<kMoving>();
  F.topRightCorner<kMoving, 3>() = at.F.by_turn();
  F.bottomRightCorner<3, 3>().diagonal().setConstant(at.drift_left);
  return F;
}

// d(reading) / d(node error).
Weight::ReadingByState NodeReading(const SegmentPath::Step& at) {
  Weight::ReadingByState H;
  H << at.reading.slope.leftCols<kMoving>(), DisturbanceFeedthrough(at.x).rightCols<3>();
  return H;
}

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
      HamiltonProduct(Conjugate(Vec4<double>(end.head<4>())), Vec4<double>(next.motion.head<4>()));
  if (turn[0] < 0.0) turn = -turn;
  return Skew<double>(turn.tail<3>()) - turn[0] * Eigen::Matrix3d::Identity();
}

SegmentModel::SegmentModel(const RotorAeroModel& model, const RotorData& data,
                           const RotorNoise& noise, RotorSegment segment, std::vector<int> by)
    : model_(model),
      data_(data),
      noise_(noise),
      segment_(std::move(segment)),
      by_(std::move(by)),
      columns_(by_) {}

SegmentPath SegmentModel::Follow(const RotorNode& start, const RotorConstants& constants) const {
  SegmentPath path;
  path.steps.resize(segment_.steps.size());
  RotorState x = Joined(start.motion, constants);
  path.drift = start.drift;
  path.arm = ImuArmOf(x);
  for (std::size_t k = 0; k < path.steps.size(); ++k) {
    const RotorSegment::Step& step = segment_.steps[k];
    SegmentPath::Step& at = path.steps[k];
    at.x = x;
    if (step.imu >= 0) {
      at.reading = ReadWithSlope(model_, x, data_.InputAt(step.t), path.drift, columns_);
    }
    at.F = StepWithSlope(model_, data_.InputAt(step.t + 0.5 * step.dt), DriftOnly(path.drift),
                         step.dt, &x, columns_);
    at.drift_left = noise_.DriftLeft(step.dt);
    path.drift *= at.drift_left;
  }
  x.head<4>().normalize();
  path.end = x;
  return path;
}

Eigen::VectorXd SegmentModel::Errors(const Eigen::VectorXd& readings, const RotorState& end,
                                     const Eigen::Vector3d& drift, const RotorNode& next) const {
  Eigen::VectorXd errors(segment_.NumRows());
  int row = 0;
  for (const RotorSegment::Step& step : segment_.steps) {
    if (step.imu < 0) continue;
    const RotorImu& imu = data_.imu[step.imu];
    errors.segment<6>(row) << imu.accel, imu.gyro;
    row += 6;
  }
  errors.head(row) -= readings;
  errors.segment<kMoving>(row) =
      Minus(end, Joined(next.motion, RotorConstants::Zero())).head<kMoving>();
  errors.tail<3>() = next.drift - drift;
  return errors;
}

SegmentResidual SegmentModel::Evaluate(const RotorNode& start, const RotorNode& next,
                                       const RotorConstants& constants, bool derivatives) const {
  if (derivatives) return Evaluate(Follow(start, constants), next);
  Eigen::VectorXd readings(6 * segment_.num_imu);
  RotorState x = Joined(start.motion, constants);
  Disturbance held = DriftOnly(start.drift);
  int row = 0;
  for (const RotorSegment::Step& step : segment_.steps) {
    if (step.imu >= 0) {
      auto reading = readings.segment<6>(row);
      model_.Imu(x.data(), data_.InputAt(step.t), reading.data());
      reading += DisturbanceFeedthrough(x) * held;
      row += 6;
    }
    RotorMidpointStep(model_, data_.InputAt(step.t + 0.5 * step.dt), held.data(), step.dt,
                      x.data());
    held *= noise_.DriftLeft(step.dt);
  }
  x.head<4>().normalize();
  SegmentResidual residual;
  residual.error = Errors(readings, x, held.tail<3>(), next);
  AddUnmodelledTurn(ImuArmOf(x), &residual);
  return residual;
}

SegmentResidual SegmentModel::Evaluate(const SegmentPath& path, const RotorNode& next) const {
  const auto count = static_cast<Eigen::Index>(by_.size());
  const int rows = segment_.NumRows(), num_readings = 6 * segment_.num_imu;
  SegmentResidual residual;
  residual.d_start.resize(rows, kNodeErrors);
  residual.d_constants.resize(rows, count);
  Eigen::VectorXd readings(num_readings);
  // Of the state, by the start and by the constants.
  Weight::StateByState moved = Weight::StateByState::Identity();
  Eigen::Matrix<double, kMoving, Eigen::Dynamic> pushed = Eigen::MatrixXd::Zero(kMoving, count);
  int row = 0;
  for (std::size_t k = 0; k < path.steps.size(); ++k) {
    const SegmentPath::Step& at = path.steps[k];
    if (segment_.steps[k].imu >= 0) {
      const auto H = at.reading.slope.leftCols<kMoving>();
      readings.segment<6>(row) = at.reading.y;
      residual.d_start.middleRows<6>(row).setZero();
      AddProduct(-1.0, NodeReading(at), moved, residual.d_start.middleRows<6>(row));
      auto d_constants = residual.d_constants.middleRows<6>(row);
      for (Eigen::Index j = 0; j < count; ++j) {
        d_constants.col(j) = -at.reading.slope.col(kMoving + by_[j]);
      }
      AddProduct(-1.0, H, pushed, d_constants);
      row += 6;
    }
    const auto F = at.F.by_error.leftCols<kMoving>();
    MultiplyLeft(NodeStep(at), moved);
    MultiplyLeft(F, pushed);
    for (Eigen::Index j = 0; j < count; ++j) pushed.col(j) += at.F.by_error.col(kMoving + by_[j]);
  }
  residual.error = Errors(readings, path.end, path.drift, next);

  const Eigen::Matrix3d S = AttitudeErrorSlope(path.end, next);
  residual.d_next = Eigen::MatrixXd::Zero(rows, kNodeErrors);
  residual.d_next.bottomRows<kNodeErrors>().setIdentity();
  residual.d_next.block<3, 3>(num_readings, 0) = -S.transpose();
  residual.d_start.bottomRows<kNodeErrors>() = -moved;
  residual.d_start.middleRows<3>(num_readings) = S * moved.topRows<3>();
  residual.d_constants.bottomRows<3>().setZero();
  residual.d_constants.middleRows<kMoving>(num_readings) = -pushed;
  residual.d_constants.middleRows<3>(num_readings) = S * pushed.topRows<3>();
  AddUnmodelledTurn(path.arm, &residual);
  return residual;
}

double SegmentModel::Length() const {
  const RotorSegment::Step& last = segment_.steps.back();
  return last.t + last.dt - segment_.steps.front().t;
}

void SegmentModel::CarryTurn(const Eigen::Vector3d& arm, Eigen::Ref<Eigen::MatrixXd> rows) const {
  const int end = 6 * segment_.num_imu;
  // d(accelerometer's error) / d(rate's error at the end).
  const Eigen::Matrix3d share = Skew<double>(Eigen::Vector3d(arm - weight_arm_)) / Length();
  const Eigen::MatrixXd carried = share * rows.middleRows<3>(end + kRateError);
  for (int row = 0; row < end; row += 6) rows.middleRows<3>(row) += carried;
}

void SegmentModel::AddUnmodelledTurn(const Eigen::Vector3d& arm, SegmentResidual* residual) const {
  const int num_readings = 6 * segment_.num_imu;
  const Eigen::Vector3d turn = residual->error.segment<3>(num_readings + kRateError) / Length();
  CarryTurn(arm, residual->error);
  if (residual->d_start.size() == 0) return;
  CarryTurn(arm, residual->d_start);
  CarryTurn(arm, residual->d_next);
  CarryTurn(arm, residual->d_constants);
  const Eigen::Matrix3d by_arm = Skew<double>(turn);
  for (std::size_t j = 0; j < by_.size(); ++j) {
    const int state = Model::kMoving + by_[j];
    const int of_imu = state - Base::kImuArm, of_centre = state - Base::kCentre;
    auto column = residual->d_constants.col(static_cast<Eigen::Index>(j));
    for (int row = 0; row < num_readings; row += 6) {
      if (of_imu >= 0 && of_imu < 3) column.segment<3>(row) -= by_arm.col(of_imu);
      if (of_centre >= 0 && of_centre < 3) column.segment<3>(row) += by_arm.col(of_centre);
    }
  }
}

void SegmentModel::SetWeight(const SegmentPath& path) {
  Disturbance variance;
  variance << Eigen::Vector3d::Constant(noise_.accel * noise_.accel),
      Eigen::Vector3d::Constant(noise_.gyro * noise_.gyro);
  weight_ = SegmentWeight(segment_.num_imu);
  weight_arm_ = path.arm;
  for (std::size_t k = 0; k < path.steps.size(); ++k) {
    const SegmentPath::Step& at = path.steps[k];
    const RotorSegment::Step& step = segment_.steps[k];
    const Eigen::Matrix<double, 6, 6> sigma =
        DisturbanceCovariance(model_, data_, noise_, at.x, step.t, step.dt).llt().matrixL();
    if (step.imu >= 0) {
      weight_.Read(NodeReading(at), DisturbanceFeedthrough(at.x) * sigma, variance);
    }
    Weight::StateByReading G = Weight::StateByReading::Zero();
    G.topRows<kMoving>() = DisturbanceInput(at.x, step.dt) * sigma;
    Weight::State drift = Weight::State::Zero();
    drift.tail<3>().setConstant(noise_.NewDrift(step.dt));
    weight_.Step(NodeStep(at), G, drift);
  }
  weight_.End(Weight::State::Constant(kFloor * kFloor));
}

void SegmentModel::CopyWeight(const SegmentModel& other) {
  CHECK_EQ(segment_.num_imu, other.segment_.num_imu) << "another segment";
  weight_ = other.weight_;
  weight_arm_ = other.weight_arm_;
}

void SegmentModel::Whiten(SegmentResidual* residual) const {
  weight_.Whiten(residual->error);
  if (residual->d_start.size() == 0) return;
  weight_.Whiten(residual->d_start);
  // Only the rate's columns reach the readings (AddUnmodelledTurn).
  constexpr int kAfterRate = kRateError + 3;
  auto end = residual->d_next.bottomRows<kNodeErrors>();
  weight_.WhitenEnd(end.leftCols<kRateError>());
  weight_.Whiten(residual->d_next.middleCols<3>(kRateError));
  weight_.WhitenEnd(end.rightCols<kNodeErrors - kAfterRate>());
  weight_.Whiten(residual->d_constants);
}

void SegmentModel::Whiten(Eigen::MatrixXd* rows) const { weight_.Whiten(*rows); }

Eigen::MatrixXd SegmentModel::Respond(const SegmentPath& path, const RotorNode& next, int columns,
                                      const AccelerationsByColumn& accelerations) const {
  constexpr int kErrorRows = RotorAeroModel::kMovingErrors;
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(segment_.NumRows(), columns);
  Eigen::Matrix<double, kErrorRows, Eigen::Dynamic> moved =
      Eigen::MatrixXd::Zero(kErrorRows, columns);
  Eigen::MatrixXd added = Eigen::MatrixXd::Zero(12, columns);
  int row = 0;
  for (std::size_t k = 0; k < path.steps.size(); ++k) {
    const SegmentPath::Step& at = path.steps[k];
    const RotorSegment::Step& step = segment_.steps[k];
    if (step.imu >= 0) {
      accelerations(step.t, at.x, &added);
      auto of_reading = rows.middleRows<6>(row);
      of_reading = -added.bottomRows<6>();
      AddProduct(-1.0, at.reading.slope.leftCols<kErrorRows>(), moved, of_reading);
      AddProduct(-1.0, DisturbanceFeedthrough(at.x), added.topRows<6>(), of_reading);
      row += 6;
    }
    MultiplyLeft(at.F.by_error.leftCols<kErrorRows>(), moved);
    const double middle = step.t + 0.5 * step.dt;
    accelerations(middle, at.x, &added);
    AddProduct(1.0, at.F.by_first, added.topRows<6>(), moved);
    accelerations(middle, at.F.middle, &added);
    AddProduct(1.0, at.F.by_second, added.topRows<6>(), moved);
  }
  rows.middleRows<kErrorRows>(row) = -moved;
  rows.middleRows<3>(row) = AttitudeErrorSlope(path.end, next) * moved.topRows<3>();
  CarryTurn(path.arm, rows);
  return rows;
}

}  // namespace trueline
