// A residual of numbers that are read from a segment at one instant: position and velocity at a
// fix, specific force at an accelerometer sample.
//
//   unknowns: theta; the segment's node; the next node where the gust at its start acts too; then
//             the residual's own
//
// `Error` states the residual as a function of the reading and of its own unknowns, for doubles and
// Jets. The reading's derivatives come from the segment's integration, which all its residuals
// share; the chain rule joins them here.
#pragma once

#include <ceres/cost_function.h>
#include <ceres/jet.h>

#include <array>
#include <utility>

#include "cost_functions/chain_node.h"

namespace trueline {

// A block of a Jacobian as Ceres stores it.
template <int kRows>
using JacobianBlock = Eigen::Map<Eigen::Matrix<double, kRows, Eigen::Dynamic, Eigen::RowMajor>>;

// kValues: numbers of the reading; kRows: of the residual; kOwn: sizes of its own blocks.
template <class Error, int kValues, int kRows, int... kOwn>
class NodeResidual : public ceres::CostFunction {
 public:
  // `reading` must outlive the problem; its value includes the gusts' effect, `gusts` its slope.
  NodeResidual(const SegmentNode<kValues>* reading, Error error,
               const GustSlope<kValues>& gusts = {})
      : reading_(reading), error_(std::move(error)), gusts_(gusts) {
    set_num_residuals(kRows);
    auto* sizes = mutable_parameter_block_sizes();
    *sizes = {kThetaSize, NodeBlockSize(gusts.gusts)};
    if (gusts.gusts == Gusts::kLinked) sizes->push_back(kNodeSize);
    first_own_ = sizes->size();
    (sizes->push_back(kOwn), ...);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    if (jacobians == nullptr) {
      Call(reading_->value.data(), parameters + first_own_, residuals, Indices());
    } else {
      Linearise(parameters + first_own_, residuals, jacobians);
    }
    return Eigen::Map<const Eigen::Matrix<double, kRows, 1>>(residuals).allFinite();
  }

 private:
  static constexpr int kInputs = (kValues + ... + kOwn);
  using Indices = std::make_index_sequence<sizeof...(kOwn)>;
  using Jet = ceres::Jet<double, kInputs>;

  template <class T, std::size_t... kIndex>
  void Call(const T* reading, T const* const* own, T* r, std::index_sequence<kIndex...>) const {
    error_(reading, own[kIndex]..., r);
  }

  void Linearise(double const* const* own, double* residuals, double** jacobians) const {
    constexpr std::array<int, sizeof...(kOwn)> kSizes = {kOwn...};
    Jet inputs[kInputs], r[kRows];
    const Jet* own_jets[sizeof...(kOwn) + 1];
    for (int i = 0; i < kValues; ++i) inputs[i] = Jet(reading_->value[i], i);
    for (std::size_t b = 0, at = kValues; b < kSizes.size(); at += kSizes[b++]) {
      own_jets[b] = inputs + at;
      for (int i = 0; i < kSizes[b]; ++i) inputs[at + i] = Jet(own[b][i], int(at) + i);
    }
    Call(inputs, own_jets, r, Indices());
    Eigen::Matrix<double, kRows, kInputs> d;
    for (int i = 0; i < kRows; ++i) {
      residuals[i] = r[i].a;
      d.row(i) = r[i].v.transpose();
    }
    WriteReading(d.template leftCols<kValues>(), jacobians);
    for (std::size_t b = 0, at = kValues; b < kSizes.size(); at += kSizes[b++]) {
      if (double* out = jacobians[first_own_ + b]) {
        JacobianBlock<kRows>(out, kRows, kSizes[b]) = d.middleCols(at, kSizes[b]);
      }
    }
  }

  // d: of the residual by the reading.
  void WriteReading(const Eigen::Matrix<double, kRows, kValues>& d, double** jacobians) const {
    if (jacobians[0] != nullptr) {
      JacobianBlock<kRows>(jacobians[0], kRows, kThetaSize).noalias() = d * reading_->d_theta;
    }
    if (jacobians[1] != nullptr) {
      JacobianBlock<kRows> J(jacobians[1], kRows, NodeBlockSize(gusts_.gusts));
      J.template leftCols<kDriftSize>().noalias() = d * reading_->d_drift();
      J.template middleCols<kStateSize>(kStateAt).noalias() = d * reading_->d_state;
      if (gusts_.gusts != Gusts::kNone) {
        J.template rightCols<kGustSize>().noalias() = d * gusts_.Own();
      }
    }
    if (gusts_.gusts == Gusts::kLinked && jacobians[2] != nullptr) {
      JacobianBlock<kRows> J(jacobians[2], kRows, kNodeSize);
      J.template leftCols<kGustAt>().setZero();
      J.template rightCols<kGustSize>().noalias() = d * gusts_.Next();
    }
  }

  const SegmentNode<kValues>* reading_;
  Error error_;
  GustSlope<kValues> gusts_;
  std::size_t first_own_;
};

}  // namespace trueline
