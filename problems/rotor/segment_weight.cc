#include "problems/rotor/segment_weight.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

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

}  // namespace trueline
