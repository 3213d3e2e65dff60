// A residual of numbers that are read from a segment at one instant: position and velocity at a
// fix, specific force at an accelerometer sample.
//
//   unknowns: theta; the node's drift and state; the gusts at the segment's start and end, where
//             they act; then the residual's own
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
template <int kRows, int kCols>
using JacobianBlock = Eigen::Map<Eigen::Matrix<double, kRows, kCols, Eigen::RowMajor>>;

// kValues: numbers of the reading, of which the error depends on the first kRead; kRows: numbers of
// the residual; kOwn: sizes of its own blocks.
template <class Error, int kValues, int kRead, int kRows, int... kOwn>
class NodeResidual : public ceres::CostFunction {
 public:
  // `reading` must outlive the problem; its value includes the gusts' effect, `gusts` its slope.
  NodeResidual(const SegmentNode<kValues>* reading, Error error,
               const GustSlope<kValues>& gusts = {})
      : reading_(reading), error_(std::move(error)), gusts_(gusts) {
    set_num_residuals(kRows);
    auto* sizes = mutable_parameter_block_sizes();
    *sizes = {kThetaSize, kGustAt};
    if (gusts.gusts != Gusts::kNone) sizes->push_back(kGustSize);
    if (gusts.gusts == Gusts::kLinked) sizes->push_back(kGustSize);
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
  static constexpr int kInputs = (kRead + ... + kOwn);
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
    for (int i = 0; i < kRead; ++i) inputs[i] = Jet(reading_->value[i], i);
    for (std::size_t b = 0, at = kRead; b < kSizes.size(); at += kSizes[b++]) {
      own_jets[b] = inputs + at;
      for (int i = 0; i < kSizes[b]; ++i) inputs[at + i] = Jet(own[b][i], int(at) + i);
    }
    Call(inputs, own_jets, r, Indices());
    Eigen::Matrix<double, kRows, kInputs> d;
    for (int i = 0; i < kRows; ++i) {
      residuals[i] = r[i].a;
      d.row(i) = r[i].v.transpose();
    }
    WriteReading(d.template leftCols<kRead>(), jacobians);
    for (std::size_t b = 0, at = kRead; b < kSizes.size(); at += kSizes[b++]) {
      if (double* out = jacobians[first_own_ + b]) {
        Eigen::Map<Eigen::Matrix<double, kRows, Eigen::Dynamic, Eigen::RowMajor>>(
            out, kRows, kSizes[b]) = d.middleCols(at, kSizes[b]);
      }
    }
  }

  // d: of the residual by the reading.
  void WriteReading(const Eigen::Matrix<double, kRows, kRead>& d, double** jacobians) const {
    if (jacobians[0] != nullptr) {
      JacobianBlock<kRows, kThetaSize>(jacobians[0]).noalias() =
          d * reading_->d_theta.template topRows<kRead>();
    }
    if (jacobians[1] != nullptr) {
      JacobianBlock<kRows, kGustAt> J(jacobians[1]);
      J.template leftCols<kDriftSize>().noalias() =
          d * reading_->d_drift().template topRows<kRead>();
      J.template rightCols<kStateSize>().noalias() =
          d * reading_->d_state.template topRows<kRead>();
    }
    if (gusts_.gusts != Gusts::kNone && jacobians[2] != nullptr) {
      JacobianBlock<kRows, kGustSize>(jacobians[2]).noalias() =
          d * gusts_.Own().template topRows<kRead>();
    }
    if (gusts_.gusts == Gusts::kLinked && jacobians[3] != nullptr) {
      JacobianBlock<kRows, kGustSize>(jacobians[3]).noalias() =
          d * gusts_.Next().template topRows<kRead>();
    }
  }

  const SegmentNode<kValues>* reading_;
  Error error_;
  GustSlope<kValues> gusts_;
  std::size_t first_own_;
};

}  // namespace trueline
