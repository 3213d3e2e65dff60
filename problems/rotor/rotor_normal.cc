#include "problems/rotor/rotor_normal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "problems/rotor/pose_prediction.h"
#include "problems/rotor/rotor_slopes.h"

namespace trueline {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

struct PoseResidual {
  Vector error;        // in sigmas
  Matrix d_node;       // rows x 12
  Matrix d_constants;  // rows x kConstants, SI
};

PoseResidual EvaluatePose(const RotorPose& pose, bool attitude, const RotorNoise& noise,
                          const RotorNode& node, const RotorConstants& constants) {
  std::array<RotorJet, RotorAeroModel::kStates> x;
  std::array<RotorJet, 6> error;
  SeedErrors(Joined(node, constants), x.data());
  PoseError(pose, attitude, noise, x.data(), error.data());
  const int rows = attitude ? 6 : 3;
  PoseResidual r{Eigen::VectorXd(rows), Eigen::MatrixXd(rows, 12),
                 Eigen::MatrixXd(rows, RotorAeroModel::kConstants)};
  for (int i = 0; i < rows; ++i) {
    r.error[i] = error[i].a;
    r.d_node.row(i) = error[i].v.head<12>().transpose();
    r.d_constants.row(i) = error[i].v.tail<RotorAeroModel::kConstants>().transpose();
  }
  return r;
}

int ClusterCount(const RotorData& data, double cluster) {
  return std::max(1, static_cast<int>((data.poses.back().t - data.poses.front().t) / cluster));
}

// Columns of the free constants (in prior sigmas), of the effects, and the residual, side by side.
Matrix BorderOf(const Matrix& d_constants, const std::vector<int>& free,
                const RotorConstants& scale, const Matrix& columns, const Vector& error) {
  const auto constants = static_cast<Eigen::Index>(free.size());
  Matrix border(error.size(), constants + columns.cols() + 1);
  for (Eigen::Index i = 0; i < constants; ++i) {
    border.col(i) = d_constants.col(free[i]) * scale[free[i]];
  }
  border.middleCols(constants, columns.cols()) = columns;
  border.rightCols<1>() = error;
  return border;
}

// d(error of a pose) / d(size of each column), in sigmas.
Matrix PoseColumns(const RotorColumns& columns, const RotorBatchOptions& options, double t,
                   const RotorState& x, Eigen::Index rows) {
  if (columns.read == nullptr) return Matrix::Zero(rows, columns.count);
  Matrix read = Matrix::Zero(6, columns.count);
  columns.read(t, x, &read);
  read.topRows<3>() /= options.noise.position;
  read.bottomRows<3>() /= options.noise.attitude;
  return read.topRows(rows);
}

}  // namespace

BorderedChain<kNodeErrors> LinearChain(const RotorData& data, const RotorBatchOptions& options,
                                       const std::vector<SegmentModel>& segments,
                                       const std::vector<RotorNode>& nodes,
                                       const RotorConstants& constants, const RotorColumns& columns,
                                       double cluster) {
  const std::vector<int> free = options.prior.Free();
  const RotorConstants& scale = options.prior.sigma;
  const double start = data.poses.front().t;
  const double length = std::max(1e-9, data.poses.back().t - start);
  const int clusters = ClusterCount(data, cluster);
  std::vector<NodeRows<kNodeErrors>> rows;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const double t = data.poses[i].t;
    const PoseResidual pose =
        EvaluatePose(data.poses[i], data.attitude, options.noise, nodes[i], constants);
    const double root = std::sqrt(options.PoseWeight(pose.error.norm()));
    const Matrix read =
        PoseColumns(columns, options, t, Joined(nodes[i], constants), pose.error.size());
    const Matrix border = BorderOf(pose.d_constants, free, scale, read, pose.error);
    const bool last = i + 1 == nodes.size();
    const auto poses = pose.error.size();
    NodeRows<kNodeErrors>& at =
        rows.emplace_back(static_cast<int>(poses) + (last ? 0 : segments[i].segment().NumRows()),
                          static_cast<int>(border.cols()));
    at.node().topRows(poses) = root * pose.d_node;
    at.border().topRows(poses) = root * border;
    const auto own = static_cast<int>((t - start) / length * clusters);
    at.cluster.assign(at.cluster.size(), std::min(clusters - 1, own));
    at.log_weights = -(data.attitude ? 3.0 : 0.0) * std::log(options.noise.attitude) -
                     3.0 * std::log(options.noise.position);
    if (last) break;
    const SegmentModel& segment = segments[i];
    SegmentResidual step = segment.Evaluate(nodes[i], nodes[i + 1], constants, true);
    segment.Whiten(&step);
    Matrix response(step.error.size(), 0);
    if (columns.count > 0) {
      response = segment.Respond(nodes[i], nodes[i + 1], constants, columns.count, columns.push);
      segment.Whiten(&response);
    }
    const auto steps = step.error.size();
    at.node().bottomRows(steps) = step.d_start;
    at.next().bottomRows(steps) = step.d_next;
    at.border().bottomRows(steps) = BorderOf(step.d_constants, free, scale, response, step.error);
    at.log_weights -= 0.5 * segment.LogDeterminant();
  }
  return BorderedChain<kNodeErrors>(std::move(rows));
}

ReducedSystem::Prior BorderPrior(const RotorPrior& prior, const RotorConstants& constants,
                                 int columns) {
  const std::vector<int> free = prior.Free();
  const auto count = static_cast<Eigen::Index>(free.size());
  ReducedSystem::Prior border{Vector::Zero(count + columns), Vector::Zero(count + columns)};
  border.precision.head(count).setOnes();
  border.error.head(count) = (constants - prior.mean)(free).cwiseQuotient(prior.sigma(free));
  return border;
}

Matrix InUnits(const RotorPrior& prior, const Matrix& scaled) {
  const std::vector<int> free = prior.Free();
  Matrix cov = Matrix::Zero(RotorAeroModel::kConstants, RotorAeroModel::kConstants);
  const Vector sigma = prior.sigma(free);
  cov(free, free) = sigma.asDiagonal() * scaled * sigma.asDiagonal();
  return cov;
}

namespace {

ReducedSystem Linearise(const RotorAeroModel& model, const RotorData& data,
                        const RotorBatchOptions& options, const RotorBatchResult& batch,
                        const RotorColumns& columns, double cluster) {
  std::vector<SegmentModel> segments;
  for (RotorSegment& cut : CutSegments(data)) {
    segments.emplace_back(model, data, options.noise, std::move(cut));
    segments.back().SetWeight(batch.nodes[segments.size() - 1], batch.mean);
  }
  return LinearChain(data, options, segments, batch.nodes, batch.mean, columns, cluster)
      .Reduced(BorderPrior(options.prior, batch.mean, columns.count), ClusterCount(data, cluster));
}

}  // namespace

RotorNormal::RotorNormal(const RotorAeroModel& model, const RotorData& data,
                         const RotorBatchOptions& options, const RotorBatchResult& batch,
                         const RotorColumns& columns, double cluster)
    : RotorNormal(Linearise(model, data, options, batch, columns, cluster), options.prior) {}

RotorNormal::RotorNormal(ReducedSystem system, const RotorPrior& prior)
    : ReducedSystem(std::move(system)),
      prior_(prior),
      constants_(static_cast<int>(prior.Free().size())) {}

RotorNormal RotorNormal::Only(const std::vector<bool>& used) const {
  return {ReducedSystem::Only(used), prior_};
}

RotorNormal RotorNormal::Select(const std::vector<int>& columns) const {
  std::vector<int> kept(constants());
  std::iota(kept.begin(), kept.end(), 0);
  for (const int column : columns) kept.push_back(constants() + column);
  return {ReducedSystem::Select(kept), prior_};
}

Matrix RotorNormal::NoiseCovariance() const {
  const Eigen::Index n = constants();
  return InUnits(prior_, M().topLeftCorner(n, n).llt().solve(Matrix::Identity(n, n)));
}

Matrix RotorNormal::ClusterCovariance() const {
  const Eigen::Index n = constants();
  const Matrix I = Matrix::Identity(n, n);
  const Matrix bread = M().topLeftCorner(n, n).llt().solve(I);
  const Vector residual = Vector::Unit(border() + 1, border());
  Matrix v = Matrix::Zero(border() + 1, n);
  v.topRows(n) = I;
  const Matrix scores = ClusterProducts(residual, v);
  const double count = clusters();
  const Matrix scatter = scores.transpose() * scores * (count / std::max(1.0, count - 1.0)) + I;
  return InUnits(prior_, bread * scatter * bread);
}

Matrix RotorNormal::ColumnCovariance() const {
  const Eigen::Index n = constants();
  const Matrix moved = M().topLeftCorner(n, n).llt().solve(M().topRightCorner(n, border() - n));
  return InUnits(prior_, moved * moved.transpose());
}

RotorConstants WideningFactors(const RotorAeroModel& model, const RotorData& data,
                               const RotorBatchOptions& options, const RotorBatchResult& batch) {
  constexpr double kShortestCluster = 0.5;  // s, least length of a cluster
  constexpr double kClusters = 20.0;
  const double length = data.poses.back().t - data.poses.front().t;
  const double cluster = std::max(kShortestCluster, length / kClusters);
  const Matrix cov = RotorNormal(model, data, options, batch, {}, cluster).ClusterCovariance();
  RotorConstants factors = RotorConstants::Ones();
  for (const int i : options.prior.Free()) {
    factors[i] = std::max(1.0, std::sqrt(cov(i, i) / batch.cov(i, i)));
  }
  return factors;
}

}  // namespace trueline
