// Gusts as parameter blocks of a least-squares problem: one at the start of each segment, linear in
// time between them.
#pragma once

#include <ceres/ceres.h>

#include <vector>

#include "cost_functions/models/gust.h"
#include "cost_functions/models/process_noise.h"

namespace trueline {

class GustBlocks {
 public:
  // No gusts: residuals are added unchanged.
  GustBlocks() = default;
  // `values` (m/s^2, by segment) and the problem must outlive this object, and `values` must keep
  // its size. linked[s]: segment s + 1 follows s without a break; else the gust is constant to the
  // end of s.
  GustBlocks(const ProcessNoise& noise, std::vector<bool> linked,
             std::vector<Eigen::Vector2d>* values, ceres::Problem* problem);

  bool Any() const { return values_ != nullptr; }

  // Adds a residual of segment s; d_gusts (rows x 4): its derivative by the gusts at both ends of
  // the segment.
  ceres::ResidualBlockId Add(ceres::Problem* problem, ceres::CostFunction* cost,
                             ceres::LossFunction* loss, std::vector<double*> blocks, std::size_t s,
                             const Eigen::MatrixXd& d_gusts) const;

  // The process: the prior of a gust without predecessor, and the step from s to s + 1. Each adds
  // the log determinant of its weights to *log_weights.
  ceres::ResidualBlockId AddPrior(ceres::Problem* problem, std::size_t s,
                                  double* log_weights) const;
  ceres::ResidualBlockId AddStep(ceres::Problem* problem, std::size_t s, double seconds,
                                 double* log_weights) const;

  GustPair At(std::size_t s) const;
  double* block(std::size_t s) const { return (*values_)[s].data(); }
  bool held(std::size_t s) const { return !linked_[s]; }

 private:
  ProcessNoise noise_;
  std::vector<bool> linked_;
  std::vector<Eigen::Vector2d>* values_ = nullptr;
};

}  // namespace trueline
