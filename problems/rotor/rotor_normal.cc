#include "problems/rotor/rotor_normal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "problems/common/parallel.h"

namespace trueline {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

struct PoseResidual {
  Vector error;        // in sigmas
  Matrix d_node;       // rows x kNodeErrors
  Matrix d_constants;  // rows x free constants, SI
};

PoseResidual EvaluatePose(const RotorPose& pose, bool attitude, const RotorNoise& noise,
                          const RotorNode& node, const RotorConstants& constants,
                          const std::vector<int>& free) {
  std::array<RotorJet, RotorAeroModel::kStates> x;
  std::array<RotorJet, 6> error;
  SeedErrors(Joined(node.motion, constants), x.data());
  const int rows = attitude ? 6 : 3;
  ErrorOf(pose, noise)(x.data(), rows, error.data());
  PoseResidual r{Eigen::VectorXd(rows), Eigen::MatrixXd::Zero(rows, kNodeErrors),
                 Eigen::MatrixXd(rows, free.size())};
  for (int i = 0; i < rows; ++i) {
    r.error[i] = error[i].a;
    r.d_node.row(i).head<kDriftError>() = error[i].v.head<kDriftError>().transpose();
    r.d_constants.row(i) = error[i].v.tail<RotorAeroModel::kConstants>()(free).transpose();
  }
  return r;
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

using Rows = NodeRows<kNodeErrors>;

// Whitened rows of nodes at one point.
class RowsAtPoint {
 public:
  RowsAtPoint(const RotorData& data, const RotorBatchOptions& options,
              const std::vector<RotorNode>& nodes, const RotorConstants& constants,
              RotorColumns columns, double cluster)
      : data_(data),
        options_(options),
        nodes_(nodes),
        constants_(constants),
        columns_(std::move(columns)),
        free_(options.prior.Free()),
        clusters_(ClusterCount(data, cluster)) {}

  // Of node i's pose, and of the segment from it along `path`; both are null at the last node.
  Rows Of(std::size_t i, const SegmentModel* segment, const SegmentPath* path) const {
    const PoseResidual pose =
        EvaluatePose(data_.poses[i], data_.attitude, options_.noise, nodes_[i], constants_, free_);
    const double root = std::sqrt(options_.PoseWeight(pose.error.norm()));
    const auto poses = pose.error.size();
    const Matrix read = PoseColumns(columns_, options_, data_.poses[i].t,
                                    Joined(nodes_[i].motion, constants_), poses);
    const Matrix border = BorderOf(pose.d_constants, read, pose.error);
    const int drift = i == 0 ? 3 : 0;
    Rows rows(
        static_cast<int>(poses) + drift + (segment == nullptr ? 0 : segment->segment().NumRows()),
        static_cast<int>(border.cols()));
    rows.node().topRows(poses) = root * pose.d_node;
    rows.border().topRows(poses) = root * border;
    rows.cluster.assign(rows.cluster.size(), ClusterOf(i));
    rows.log_weights = -(data_.attitude ? 3.0 : 0.0) * std::log(options_.noise.attitude) -
                       3.0 * std::log(options_.noise.position);
    if (drift > 0) AddFirstDrift(poses, &rows);
    if (segment != nullptr) AddSegment(*segment, *path, nodes_[i + 1], &rows);
    return rows;
  }

 private:
  // The drift's prior, at the first node.
  void AddFirstDrift(Eigen::Index row, Rows* rows) const {
    const double sigma = options_.noise.DriftSigma();
    rows->node().block<3, 3>(row, kDriftError).diagonal().setConstant(1.0 / sigma);
    rows->border().col(rows->border().cols() - 1).segment<3>(row) = nodes_.front().drift / sigma;
    rows->log_weights -= 3.0 * std::log(sigma);
  }

  void AddSegment(const SegmentModel& segment, const SegmentPath& path, const RotorNode& next,
                  Rows* rows) const {
    SegmentResidual step = segment.Evaluate(path, next);
    segment.Whiten(&step);
    Matrix response(step.error.size(), 0);
    if (columns_.count > 0) {
      response = segment.Respond(path, next, columns_.count, columns_.accelerations);
      segment.Whiten(&response);
    }
    const auto steps = step.error.size();
    rows->node().bottomRows(steps) = step.d_start;
    rows->next().bottomRows(steps) = step.d_next;
    rows->border().bottomRows(steps) = BorderOf(step.d_constants, response, step.error);
    rows->log_weights -= 0.5 * segment.LogDeterminant();
  }

  // Columns of the free constants (in prior sigmas), of the effects, and the residual, side by
  // side.
  Matrix BorderOf(const Matrix& d_constants, const Matrix& columns, const Vector& error) const {
    Matrix border(error.size(), d_constants.cols() + columns.cols() + 1);
    border << d_constants * Vector(options_.prior.sigma(free_)).asDiagonal(), columns, error;
    return border;
  }

  int ClusterOf(std::size_t i) const {
    const double start = data_.poses.front().t;
    const double length = std::max(1e-9, data_.poses.back().t - start);
    return std::min(clusters_ - 1,
                    static_cast<int>((data_.poses[i].t - start) / length * clusters_));
  }

  const RotorData& data_;
  const RotorBatchOptions& options_;
  const std::vector<RotorNode>& nodes_;
  const RotorConstants& constants_;
  RotorColumns columns_;
  std::vector<int> free_;
  int clusters_;
};

// The chain of the rows of all nodes; of(i, rows) gives those of a node that starts a segment.
template <class Of>
BorderedChain<kNodeErrors> Chain(const RowsAtPoint& at, const std::vector<RotorNode>& nodes,
                                 const Of& of) {
  std::vector<Rows> rows(nodes.size(), Rows(0, 0));
  const int segments = static_cast<int>(nodes.size()) - 1;
  ParallelRuns(segments, kSegmentsInARow, [&](int i) { rows[i] = of(i, at); });
  rows.back() = at.Of(segments, nullptr, nullptr);
  return BorderedChain<kNodeErrors>(std::move(rows));
}

}  // namespace

BorderedChain<kNodeErrors> LinearChain(const RotorData& data, const RotorBatchOptions& options,
                                       const std::vector<SegmentModel>& segments,
                                       const std::vector<RotorNode>& nodes,
                                       const RotorConstants& constants, const RotorColumns& columns,
                                       double cluster) {
  return Chain(RowsAtPoint(data, options, nodes, constants, columns, cluster), nodes,
               [&](int i, const RowsAtPoint& rows) {
                 const SegmentPath path = segments[i].Follow(nodes[i], constants);
                 return rows.Of(i, &segments[i], &path);
               });
}

BorderedChain<kNodeErrors> WeighedChain(const RotorData& data, const RotorBatchOptions& options,
                                        std::vector<SegmentModel>* segments,
                                        const std::vector<RotorNode>& nodes,
                                        const RotorConstants& constants,
                                        const RotorColumns& columns, double cluster) {
  return Chain(RowsAtPoint(data, options, nodes, constants, columns, cluster), nodes,
               [&](int i, const RowsAtPoint& rows) {
                 SegmentModel& segment = (*segments)[i];
                 const SegmentPath path = segment.Follow(nodes[i], constants);
                 segment.SetWeight(path);
                 return rows.Of(i, &segment, &path);
               });
}

std::vector<SegmentModel> MakeSegments(const RotorAeroModel& model, const RotorData& data,
                                       const RotorBatchOptions& options) {
  const std::vector<int> free = options.prior.Free();
  std::vector<SegmentModel> segments;
  for (RotorSegment& cut : CutSegments(data)) {
    segments.emplace_back(model, data, options.noise, std::move(cut), free);
  }
  return segments;
}

namespace {

// Segments whose weights are evaluated at that solution.
std::vector<SegmentModel> SegmentsWeighedAt(const RotorAeroModel& model, const RotorData& data,
                                            const RotorBatchOptions& options,
                                            const RotorBatchResult& at) {
  std::vector<SegmentModel> segments = MakeSegments(model, data, options);
  const RotorConstants constants = options.prior.WithKnown(at.mean);
  ParallelRuns(static_cast<int>(segments.size()), kSegmentsInARow,
               [&](int i) { segments[i].SetWeight(segments[i].Follow(at.nodes[i], constants)); });
  return segments;
}

}  // namespace

std::vector<SegmentModel> WeighedSegments(const RotorAeroModel& model, const RotorData& data,
                                          const RotorBatchOptions& options,
                                          const RotorWeights& weights) {
  std::vector<SegmentModel> segments = MakeSegments(model, data, options);
  const std::vector<SegmentModel> weighed =
      SegmentsWeighedAt(weights.model, weights.data, options, weights.at);
  ParallelRuns(static_cast<int>(segments.size()), kSegmentsInARow,
               [&](int i) { segments[i].CopyWeight(weighed[i]); });
  return segments;
}

bool HaveWeights(const std::vector<SegmentModel>& segments) {
  return std::all_of(segments.begin(), segments.end(),
                     [](const SegmentModel& segment) { return segment.HasWeight(); });
}

bool HasWeightsAt(const RotorAeroModel& model, const RotorData& data,
                  const RotorBatchOptions& options, const RotorBatchResult& batch) {
  return HaveWeights(SegmentsWeighedAt(model, data, options, batch));
}

int ClusterCount(const RotorData& data, double cluster) {
  return std::max(1, static_cast<int>((data.poses.back().t - data.poses.front().t) / cluster));
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
                        const RotorColumns& columns, double cluster, const RotorWeights* weights) {
  std::vector<SegmentModel> segments = weights != nullptr
                                           ? WeighedSegments(model, data, options, *weights)
                                           : MakeSegments(model, data, options);
  const BorderedChain<kNodeErrors> chain =
      weights != nullptr
          ? LinearChain(data, options, segments, batch.nodes, batch.mean, columns, cluster)
          : WeighedChain(data, options, &segments, batch.nodes, batch.mean, columns, cluster);
  return chain.Reduced(BorderPrior(options.prior, batch.mean, columns.count),
                       ClusterCount(data, cluster));
}

}  // namespace

RotorNormal::RotorNormal(const RotorAeroModel& model, const RotorData& data,
                         const RotorBatchOptions& options, const RotorBatchResult& batch,
                         const RotorColumns& columns, double cluster, const RotorWeights* weights)
    : RotorNormal(Linearise(model, data, options, batch, columns, cluster, weights),
                  options.prior) {}

RotorNormal::RotorNormal(ReducedSystem system, const RotorPrior& prior)
    : ReducedSystem(std::move(system)),
      prior_(prior),
      constants_(static_cast<int>(prior.Free().size())) {}

RotorNormal RotorNormal::Only(const std::vector<bool>& used) const {
  return {ReducedSystem::Only(used), prior_};
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

RotorColumns VariantColumns(const RotorAeroModel& model, const RotorData& data,
                            std::vector<RotorVariant> variants) {
  const int count = static_cast<int>(variants.size());
  const auto accelerations = [&model, &data, variants = std::move(variants)](
                                 double t, const RotorState& x, Eigen::MatrixXd* out) {
    const RotorInput input = data.InputAt(t);
    const auto base = model.BodyAccelerationOf(x.data(), input);
    for (std::size_t i = 0; i < variants.size(); ++i) {
      const RotorVariant& variant = variants[i];
      RotorState moved = x;
      moved.tail<RotorAeroModel::kConstants>() += variant.added;
      const auto there =
          variant.data != nullptr
              ? variant.model.BodyAccelerationOf(moved.data(), variant.data->InputAt(t))
              : variant.model.BodyAccelerationOf(moved.data(), input);
      out->col(static_cast<Eigen::Index>(i)).head<6>() << there.force - base.force,
          there.turn - base.turn;
    }
  };
  return {count, accelerations};
}

Eigen::MatrixXd ConsideredCovariance(const RotorAeroModel& model, const RotorData& data,
                                     const RotorBatchOptions& options,
                                     const RotorBatchResult& batch,
                                     std::vector<RotorVariant> variants) {
  constexpr int kConstants = RotorAeroModel::kConstants;
  if (variants.empty()) return Eigen::MatrixXd::Zero(kConstants, kConstants);
  const double whole = data.poses.back().t - data.poses.front().t;
  return RotorNormal(model, data, options, batch, VariantColumns(model, data, std::move(variants)),
                     whole)
      .ColumnCovariance();
}

}  // namespace trueline
