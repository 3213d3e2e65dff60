// The batch linearised at its solution: normal equations of the constants and of candidate effects,
// all states eliminated, stored by cluster of time. Residuals of real flights are correlated in
// time, so evidence and intervals also use the scatter of scores between clusters.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "problems/chain/bordered_chain.h"
#include "problems/rotor/rotor_batch.h"
#include "problems/rotor/rotor_segment.h"

namespace trueline {

// Effects that a model may lack, one column each: forces along the flight, and errors of pose
// readings.
struct RotorColumns {
  // Error of the pose read at a node, for each unit of size: position [m], then rotation in body
  // axes [rad]: 6 x columns.
  using ReadFunction = std::function<void(double t, const RotorState& x, Eigen::MatrixXd* read)>;

  int count = 0;
  SegmentModel::AccelerationsByColumn accelerations;
  ReadFunction read = nullptr;  // null where no column changes pose readings directly
};

// One model for each segment, with derivatives by the free constants.
std::vector<SegmentModel> MakeSegments(const RotorAeroModel& model, const RotorData& data,
                                       const RotorBatchOptions& options);

// The flight's chain linearised at the given nodes and constants, with the weights that `segments`
// hold. Border: the free constants in units of their prior sigma, the columns' sizes, the residual.
// Clusters of `cluster` seconds.
BorderedChain<kNodeErrors> LinearChain(const RotorData& data, const RotorBatchOptions& options,
                                       const std::vector<SegmentModel>& segments,
                                       const std::vector<RotorNode>& nodes,
                                       const RotorConstants& constants, const RotorColumns& columns,
                                       double cluster);
// The same with weights evaluated at this point, which `segments` then hold.
BorderedChain<kNodeErrors> WeighedChain(const RotorData& data, const RotorBatchOptions& options,
                                        std::vector<SegmentModel>* segments,
                                        const std::vector<RotorNode>& nodes,
                                        const RotorConstants& constants,
                                        const RotorColumns& columns, double cluster);
// Segments of `model` that whiten by `weights`.
std::vector<SegmentModel> WeighedSegments(const RotorAeroModel& model, const RotorData& data,
                                          const RotorBatchOptions& options,
                                          const RotorWeights& weights);
// False if the model ran away from the flight where the weights were evaluated
// (SegmentWeight::IsRegular).
bool HaveWeights(const std::vector<SegmentModel>& segments);
// The same for weights evaluated at this solution.
bool HasWeightsAt(const RotorAeroModel& model, const RotorData& data,
                  const RotorBatchOptions& options, const RotorBatchResult& batch);
// Number of clusters of about `cluster` seconds.
int ClusterCount(const RotorData& data, double cluster);
// Priors of that border: of the free constants; the columns have none.
ReducedSystem::Prior BorderPrior(const RotorPrior& prior, const RotorConstants& constants,
                                 int columns);
// Converts a matrix of the free constants in prior sigmas to one of all constants in SI.
Eigen::MatrixXd InUnits(const RotorPrior& prior, const Eigen::MatrixXd& scaled);

// The normal equations of the free constants and of candidate effects.
class RotorNormal : public ReducedSystem {
 public:
  // `cluster`: length of a cluster, s. Weights are evaluated by `weights`, or by `model` at `batch`
  // if that is null.
  RotorNormal(const RotorAeroModel& model, const RotorData& data, const RotorBatchOptions& options,
              const RotorBatchResult& batch, const RotorColumns& columns, double cluster,
              const RotorWeights* weights = nullptr);

  int constants() const { return constants_; }
  RotorNormal Only(const std::vector<bool>& used) const;

  // Covariance of the constants (kConstants x kConstants, SI) from noise and prior, all columns
  // held at zero. For a flight linearised at the truth this is the Bayesian Cramer-Rao bound (Van
  // Trees).
  Eigen::MatrixXd NoiseCovariance() const;
  // The same from the observed scatter of scores between clusters (sandwich estimator).
  Eigen::MatrixXd ClusterCovariance() const;
  // What the columns, each a consider parameter of sigma 1, add to these covariances.
  Eigen::MatrixXd ColumnCovariance() const;

 private:
  RotorNormal(ReducedSystem system, const RotorPrior& prior);

  RotorPrior prior_;
  int constants_;
};

// For each constant the ratio of the sigma from scatter between clusters to the sigma from noise,
// at least 1; 1 for known constants. An unmodelled smooth disturbance such as drag is not white:
// its scores add up within a cluster where those of noise cancel.
RotorConstants WideningFactors(const RotorAeroModel& model, const RotorData& data,
                               const RotorBatchOptions& options, const RotorBatchResult& batch);

// An alternative to the fit's model. The difference of their forces along the fitted flight is one
// column.
struct RotorVariant {
  RotorAeroModel model;
  RotorConstants added;                   // to the constants of the fit
  std::shared_ptr<const RotorData> data;  // null: the fit's
};

// One column each; `model` and `data` are the fit's and must outlive the result.
RotorColumns VariantColumns(const RotorAeroModel& model, const RotorData& data,
                            std::vector<RotorVariant> variants);

// Covariance (kConstants x kConstants, SI) that unmodelled effects add to the constants of a fit:
// "consider" parameters (Schmidt 1966; Bierman 1977, ch. 8). Each variant is one effect at one
// sigma, independent of the others. It holds for any estimate that is the posterior mean given the
// same data, such as a filter's at its end.
Eigen::MatrixXd ConsideredCovariance(const RotorAeroModel& model, const RotorData& data,
                                     const RotorBatchOptions& options,
                                     const RotorBatchResult& batch,
                                     std::vector<RotorVariant> variants);

}  // namespace trueline
