// Whitens the rows of a segment: the readings in their order, then the state's errors at its end,
// all moved by one sequence of disturbances. With a known start, the innovations of a Kalman filter
// are the rows multiplied by the inverse of their covariance's Cholesky factor (Anderson & Moore
// 1979, Optimal Filtering, ch. 5), in time linear in the number of readings.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "problems/rotor/rotor_state.h"

namespace trueline {

class SegmentWeight {
 public:
  static constexpr int kState = kNodeErrors;
  static constexpr int kReading = 6;
  using State = Eigen::Matrix<double, kState, 1>;
  using Reading = Eigen::Matrix<double, kReading, 1>;
  using StateByState = Eigen::Matrix<double, kState, kState>;
  using StateByReading = Eigen::Matrix<double, kState, kReading>;
  using ReadingByState = Eigen::Matrix<double, kReading, kState>;
  using ReadingSquare = Eigen::Matrix<double, kReading, kReading>;

  explicit SegmentWeight(int readings = 0) { innovations_.reserve(readings); }

  // Call Read (where the step starts with a reading) and Step for each step, then End.
  // A reading H e + D w + v of the state's errors e: w are the disturbances of the next Step, of
  // covariance one, v is noise of the given variances.
  void Read(const ReadingByState& H, const ReadingSquare& D, const Reading& variance);
  // The errors become F e + G w and noise of the given variances.
  void Step(const StateByState& F, const StateByReading& G, const State& variance);
  // The errors at the end are read with noise of the given variances.
  void End(const State& variance);

  // False if rounding left no valid covariance, as where the model diverges from the flight.
  // Whiten() must not be called then.
  bool IsRegular() const;
  // Multiplies each column of `rows` by L^-1, with L L' the covariance of the rows.
  void Whiten(Eigen::Ref<Eigen::MatrixXd> rows) const;
  // The same for columns that are zero but for the errors at the end, of which it takes the rows.
  void WhitenEnd(Eigen::Ref<Eigen::MatrixXd> rows) const;
  // Of the covariance.
  double LogDeterminant() const { return log_determinant_; }

 private:
  // A reading y and the steps up to the next one: the whitened innovation is w = W y - U z, and the
  // prediction z of the errors becomes F z + K w.
  struct Innovation {
    ReadingSquare W;
    ReadingByState U;
    StateByState F;
    StateByReading K;
  };

  std::vector<Innovation> innovations_;
  StateByState end_;  // inverse of L of the end's innovation
  double log_determinant_ = 0.0;
  bool regular_ = true;

  // While it is built: covariance of z's error, and D of the reading that waits for its step.
  StateByState P_ = StateByState::Zero();
  ReadingSquare D_;
  bool waiting_ = false;
};

}  // namespace trueline
