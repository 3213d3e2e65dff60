// The flight between two poses, integrated at the IMU's rate from the state at the first pose
// (multiple shooting), with derivatives. One disturbance moves the IMU readings and the state at
// the second pose, so their joint covariance is computed too.
#pragma once

#include <Eigen/Dense>
#include <functional>
#include <vector>

#include "problems/rotor/rotor_data.h"
#include "problems/rotor/rotor_slopes.h"
#include "problems/rotor/rotor_state.h"

namespace trueline {

// Whitens the rows of a segment: the readings in their order, then the state's errors at its end,
// all moved by one sequence of disturbances. With a known start, the innovations of a Kalman filter
// are the rows multiplied by the inverse of their covariance's Cholesky factor (Anderson & Moore
// 1979, Optimal Filtering, ch. 5), in time linear in the number of readings.

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

struct RotorSegment {
  struct Step {
    double t;   // s
    double dt;  // s
    int imu;    // index of the reading at its start, -1 for none
  };
  std::vector<Step> steps;
  int num_imu = 0;
  int NumRows() const { return 6 * num_imu + kNodeErrors; }
};

// Segments that one thread works on in a row.
inline constexpr int kSegmentsInARow = 32;

// One segment for each pair of consecutive poses.
std::vector<RotorSegment> CutSegments(const RotorData& data);

// Rows: (accelerometer, gyro) of each reading, then the errors of the node at the end.
struct SegmentResidual {
  Eigen::VectorXd error;        // measured less predicted (end: next node less prediction)
  Eigen::MatrixXd d_start;      // rows x kNodeErrors, by the error of the node at the start
  Eigen::MatrixXd d_next;       // rows x kNodeErrors
  Eigen::MatrixXd d_constants;  // rows x constants asked for (SI)
};

// The model's path from the start of a segment to its end, with slopes.
struct SegmentPath {
  struct Step {
    RotorState x;          // at its start
    double drift_left;     // share of the drift after it
    RotorReading reading;  // there, where an IMU sample was taken
    RotorStepSlope F;      // over the step
  };
  std::vector<Step> steps;
  RotorState end;
  Eigen::Vector3d drift;  // there, rad/s^2
  Eigen::Vector3d arm;    // of the IMU from the centre of mass, m
};

// e = 2 vec(q_end^* q_next) = 2 v: de = S d_end - S' d_next with S = [v]x - w, (w, v) the rotation.
Eigen::Matrix3d AttitudeErrorSlope(const RotorState& end, const RotorNode& next);

class SegmentModel {
 public:
  // Derivatives are by the given constants (indices), in that order.
  SegmentModel(const RotorAeroModel& model, const RotorData& data, const RotorNoise& noise,
               RotorSegment segment, std::vector<int> by = AllRotorConstants());

  SegmentPath Follow(const RotorNode& start, const RotorConstants& constants) const;

  // Not whitened. Computes derivatives if `derivatives`.
  SegmentResidual Evaluate(const RotorNode& start, const RotorNode& next,
                           const RotorConstants& constants, bool derivatives) const;
  SegmentResidual Evaluate(const SegmentPath& path, const RotorNode& next) const;
  // Small forces that a model lacks, at a time and state, for each unit of size: specific force
  // [m/s^2] and angular acceleration [rad/s^2] in the first 6 rows, direct errors of accelerometer
  // [m/s^2] and gyro [rad/s] in the next 6; 12 x columns.
  using AccelerationsByColumn =
      std::function<void(double t, const RotorState& x, Eigen::MatrixXd* accelerations)>;
  // d(error of Evaluate) / d(size of each column): rows x columns, not whitened.
  Eigen::MatrixXd Respond(const SegmentPath& path, const RotorNode& next, int columns,
                          const AccelerationsByColumn& accelerations) const;
  // Evaluates the covariance of the rows along this path, for Whiten.
  void SetWeight(const SegmentPath& path);
  // Whitens as `other` does, a model of the same segment.
  void CopyWeight(const SegmentModel& other);
  // False if there is none (SegmentWeight::IsRegular).
  bool HasWeight() const { return weight_.IsRegular(); }
  // Multiplies by L^-1 of the covariance L L'.
  void Whiten(SegmentResidual* residual) const;
  void Whiten(Eigen::MatrixXd* rows) const;
  // log of the determinant of the covariance, for the evidence.
  double LogDeterminant() const { return weight_.LogDeterminant(); }
  const RotorSegment& segment() const { return segment_; }

 private:
  // The vehicle's actual turn moves the accelerometer through its arm, not the model's: adds to the
  // predicted readings what the unmodelled angular acceleration, which is the rate's error at the
  // end over the segment's length, makes of an arm other than that of the weights, and derivatives
  // by the arm. The weights already contain the disturbances through their own arm. Rows move by a
  // multiple of other rows, so the determinant of the covariance stays. Without this, an arm whose
  // moment is modelled badly alternates between two values as weights are evaluated again.
  void AddUnmodelledTurn(const Eigen::Vector3d& arm, SegmentResidual* residual) const;
  // Its part of rows that are linear in the state: d(rows) of any kind.
  void CarryTurn(const Eigen::Vector3d& arm, Eigen::Ref<Eigen::MatrixXd> rows) const;
  double Length() const;  // s
  // Readings less their predictions, then the error of the end.
  Eigen::VectorXd Errors(const Eigen::VectorXd& readings, const RotorState& end,
                         const Eigen::Vector3d& drift, const RotorNode& next) const;

  const RotorAeroModel& model_;
  const RotorData& data_;
  RotorNoise noise_;
  RotorSegment segment_;
  std::vector<int> by_;  // constants that derivatives are by
  SlopeColumns columns_;
  SegmentWeight weight_;
  Eigen::Vector3d weight_arm_ = Eigen::Vector3d::Zero();  // m, where the weights were evaluated
};

}  // namespace trueline
