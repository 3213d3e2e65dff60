#include "problems/rotor/segment_weight.h"

#include <glog/logging.h>

#include <Eigen/Cholesky>

#include "problems/chain/small_product.h"

namespace trueline {

void SegmentWeight::Read(const ReadingByState& H, const ReadingSquare& D, const Reading& variance) {
  const ReadingByState HP = H.lazyProduct(P_);
  ReadingSquare cov = HP.lazyProduct(H.transpose());
  cov += D.lazyProduct(D.transpose());
  cov.diagonal() += variance;
  const Eigen::LLT<ReadingSquare> llt(cov);
  CHECK(llt.info() == Eigen::Success);
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
  CHECK(llt.info() == Eigen::Success);
  end_ = llt.matrixL().solve(StateByState::Identity());
  log_determinant_ += 2.0 * llt.matrixLLT().diagonal().array().log().sum();
}

void SegmentWeight::Whiten(Eigen::Ref<Eigen::MatrixXd> rows) const {
  for (Eigen::Index j = 0; j < rows.cols(); ++j) {
    State z = State::Zero(), next;
    Eigen::Index row = 0;
    for (const Innovation& at : innovations_) {
      auto y = rows.col(j).segment<kReading>(row);
      Reading w = Reading::Zero();
      AddProduct(1.0, at.W, y, w);
      AddProduct(-1.0, at.U, z, w);
      next.setZero();
      AddProduct(1.0, at.F, z, next);
      AddProduct(1.0, at.K, w, next);
      y = w;
      z = next;
      row += kReading;
    }
    rows.col(j).tail<kState>() -= z;
  }
  WhitenEnd(rows.bottomRows<kState>());
}

void SegmentWeight::WhitenEnd(Eigen::Ref<Eigen::MatrixXd> rows) const { MultiplyLeft(end_, rows); }

}  // namespace trueline
