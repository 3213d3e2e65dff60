#include "problems/diagnosis/chain_system.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace trueline {
namespace {

using Matrix = Eigen::MatrixXd;
using NodeMatrix = Eigen::Matrix<double, kNodeSize, kNodeSize>;
constexpr double kOpenPosition = 100.0, kOpenVelocity = 50.0;  // m, m/s: sigma at a stretch's start

// As in WindowProblem: a floor far below anything that matters keeps the covariance regular.
Matrix9d LinkWhitening(const ProcessNoise& noise, double seconds, double gravity) {
  Matrix9d cov = ProcessCovariance(noise, seconds, gravity);
  cov.diagonal().head<6>().array() += 1e-6;
  cov.diagonal().tail<3>().array() += 1e-10;
  const Matrix9d L = cov.llt().matrixL();
  return L.triangularView<Eigen::Lower>().solve(Matrix9d::Identity());
}

}  // namespace

Columns Columns::With(const Columns& more) const {
  Columns all{Matrix(d_rows.rows(), count() + more.count()), Eigen::VectorXd(count() + more.count()),
              Eigen::VectorXd(count() + more.count())};
  all.d_rows << d_rows, more.d_rows;
  all.precision << precision, more.precision;
  all.value << value, more.value;
  return all;
}

ChainSystem::ChainSystem(const BaseFlight& flight, const FlightRows& rows, const FlightUnknowns& x,
                         const Eigen::VectorXd& weight, const Columns& columns,
                         const NoiseStrengths& noise)
    : flight_(flight), rows_(rows), x_(x), weight_(weight), columns_(columns), noise_(noise) {
  const int segments = static_cast<int>(flight.plan().segments.size());
  stacks_.reserve(segments);
  for (int s = 0; s < segments; ++s) stacks_.push_back(StackOf(s));
  Eliminate();
}

ChainSystem::Stack ChainSystem::StackOf(int s) {
  const auto& segments = flight_.plan().segments;
  const bool first = s == 0 || !segments[s - 1].linked;
  const int measurements = static_cast<int>(flight_.RowsOfSegment(s).size());
  const int link = segments[s].linked ? 9 + kGustSize : 0;
  const int count = measurements + link + (first ? kNodeSize : 0);
  const int border = kThetaSize + columns_.count() + 1;
  Stack stack;
  stack.row.assign(count, -1);
  stack.cluster.assign(count, segments[s].cluster);
  stack.node.setZero(count, kNodeSize);
  stack.next.setZero(count, kNodeSize);
  stack.border.setZero(count, border);
  int at = 0;
  Measurements(s, &stack, &at);
  if (link > 0) Link(s, &stack, at);
  if (first) StartPrior(s, &stack, at + link);
  return stack;
}

void ChainSystem::Measurements(int s, Stack* stack, int* at) {
  const int columns = columns_.count();
  for (const int row : flight_.RowsOfSegment(s)) {
    const double sigma = flight_.IsFix(row) ? noise_.fix_scale * flight_.FixSigma(row)
                                            : noise_.force_sigma;
    const double w = weight_[row] / sigma;
    log_weights_ -= std::log(sigma);
    stack->row[*at] = row;
    stack->cluster[*at] = flight_.ClusterOfRow(row);
    stack->node.row(*at) = w * rows_.d_node.row(row);
    stack->next.row(*at) = w * rows_.d_next.row(row);
    auto border = stack->border.row(*at);
    border.head<kThetaSize>() = w * rows_.d_theta.row(row);
    if (columns > 0) border.segment(kThetaSize, columns) = w * columns_.d_rows.row(row);
    border[kThetaSize + columns] = w * rows_.r[row];
    ++*at;
  }
}

// (p, v, drift) with the covariance that the processes build up over the segment; gusts apart.
void ChainSystem::Link(int s, Stack* stack, int at) {
  const auto& span = flight_.plan().segments[s];
  const double h = SecondsBetween(span.begin, span.end);
  const Matrix9d whiten = LinkWhitening(noise_.process, h, flight_.gravity());
  const int row = flight_.LinkRow(s), columns = columns_.count();
  const Eigen::Vector3d unit = flight_.scaling().DriftUnit();
  const double alpha = noise_.process.Decay(h);
  Eigen::Matrix<double, 9, Eigen::Dynamic> node(9, kNodeSize), next(9, kNodeSize),
      border(9, kThetaSize + columns + 1);
  node.setZero();
  next.setZero();
  border.setZero();
  node.topRows<6>() = rows_.d_node.middleRows<6>(row);
  next.topRows<6>() = rows_.d_next.middleRows<6>(row);
  border.topLeftCorner<6, kThetaSize>() = rows_.d_theta.middleRows<6>(row);
  if (columns > 0) border.block(0, kThetaSize, 6, columns) = columns_.d_rows.middleRows<6>(row);
  node.bottomLeftCorner<3, 3>() = (-alpha * unit).asDiagonal();
  next.bottomLeftCorner<3, 3>() = unit.asDiagonal();
  border.col(kThetaSize + columns).head<6>() = rows_.r.segment<6>(row);
  border.col(kThetaSize + columns).tail<3>() =
      unit.cwiseProduct(x_.nodes[s + 1].head<3>() - alpha * x_.nodes[s].head<3>());
  stack->node.middleRows<9>(at) = whiten * node;
  stack->next.middleRows<9>(at) = whiten * next;
  stack->border.middleRows<9>(at) = whiten * border;
  log_weights_ += whiten.diagonal().array().log().sum();  // it is triangular

  const double beta = std::exp(-h / noise_.gust_memory);
  const double w = 1.0 / (noise_.gust * std::sqrt(1.0 - beta * beta));
  stack->node.block<2, 2>(at + 9, kGustAt).diagonal().setConstant(-beta * w);
  stack->next.block<2, 2>(at + 9, kGustAt).diagonal().setConstant(w);
  stack->border.col(kThetaSize + columns).segment<2>(at + 9) =
      w * (x_.nodes[s + 1].tail<2>() - beta * x_.nodes[s].tail<2>());
  log_weights_ += 2.0 * std::log(w);
}

void ChainSystem::StartPrior(int s, Stack* stack, int at) {
  const Eigen::Vector3d drift = noise_.process.DriftSigma().cwiseMax(1e-5);
  NodeVector w;
  w.head<3>() = flight_.scaling().DriftUnit().cwiseQuotient(drift);
  w.segment<3>(kStateAt).setConstant(1.0 / kOpenPosition);
  w.segment<3>(kStateAt + 3).setConstant(1.0 / kOpenVelocity);
  w.tail<2>().setConstant(1.0 / noise_.gust);
  NodeVector at_prior = x_.nodes[s];
  at_prior.segment<6>(kStateAt).setZero();  // open: wherever it is
  stack->node.middleRows<kNodeSize>(at) = w.asDiagonal();
  stack->border.col(stack->border.cols() - 1).segment<kNodeSize>(at) = w.cwiseProduct(at_prior);
  log_weights_ += w.array().log().sum();
}

void ChainSystem::Eliminate() {
  const int n = static_cast<int>(stacks_.size());
  const int width = static_cast<int>(stacks_[0].border.cols());
  Matrix C = Matrix::Zero(width, width);
  Eigen::Matrix<double, kNodeSize, Eigen::Dynamic> B(kNodeSize, width);
  NodeMatrix D = NodeMatrix::Zero();
  B.setZero();
  eliminated_.resize(n);
  reduced_.log_det = 0.0;
  for (int s = 0; s < n; ++s) {
    const Stack& stack = stacks_[s];
    D.noalias() += stack.node.transpose() * stack.node;
    B.noalias() += stack.node.transpose() * stack.border;
    C.noalias() += stack.border.transpose() * stack.border;
    Eliminated& out = eliminated_[s];
    out.L = D.llt().matrixL();
    const auto L = out.L.triangularView<Eigen::Lower>();
    out.next = L.solve(NodeMatrix(stack.node.transpose() * stack.next));
    out.border = L.solve(B);
    reduced_.log_det += 2.0 * out.L.diagonal().array().log().sum();
    C.noalias() -= out.border.transpose() * out.border;
    D.noalias() = stack.next.transpose() * stack.next - out.next.transpose() * out.next;
    B.noalias() = stack.next.transpose() * stack.border - out.next.transpose() * out.border;
  }
  const int z = width - 1;
  reduced_.M = C.topLeftCorner(z, z);
  reduced_.b = C.col(z).head(z);
  reduced_.rss = C(z, z) + x_.theta.squaredNorm();
  reduced_.M.diagonal().head<kThetaSize>().array() += 1.0;  // theta's prior, in its own sigmas
  reduced_.b.head<kThetaSize>() += x_.theta;
  const int columns = columns_.count();
  reduced_.M.diagonal().tail(columns) += columns_.precision;
  reduced_.b.tail(columns) += columns_.precision.cwiseProduct(columns_.value);
  reduced_.rss += columns_.precision.dot(columns_.value.cwiseAbs2());
  reduced_.log_weights = log_weights_;
}

std::vector<Matrix> ChainSystem::NodesFor(const Matrix& border_values) const {
  std::vector<Matrix> nodes(eliminated_.size());
  Matrix next = Matrix::Zero(kNodeSize, border_values.cols());
  for (int s = static_cast<int>(nodes.size()) - 1; s >= 0; --s) {
    const Eliminated& e = eliminated_[s];
    const Matrix right = -(e.border * border_values + e.next * next);
    nodes[s] = e.L.transpose().triangularView<Eigen::Upper>().solve(right);
    next = nodes[s];
  }
  return nodes;
}

Matrix ChainSystem::RowsFor(int s, const Matrix& border_values,
                            const std::vector<Matrix>& nodes) const {
  Matrix rows = stacks_[s].border * border_values + stacks_[s].node * nodes[s];
  if (flight_.plan().segments[s].linked) rows += stacks_[s].next * nodes[s + 1];
  return rows;
}

Matrix ChainSystem::ClusterProducts(const Eigen::VectorXd& e, const Matrix& v) const {
  Matrix all(border() + 1, v.cols() + 1);
  all << v, e;
  const std::vector<Matrix> nodes = NodesFor(all);
  Matrix products = Matrix::Zero(flight_.plan().clusters, v.cols());
  for (int s = 0; s < static_cast<int>(stacks_.size()); ++s) {
    const Matrix rows = RowsFor(s, all, nodes);
    for (int i = 0; i < rows.rows(); ++i) {
      products.row(stacks_[s].cluster[i]) += rows(i, v.cols()) * rows.row(i).head(v.cols());
    }
  }
  return products;
}

Eigen::VectorXd ChainSystem::Whitened(const Eigen::VectorXd& e) const {
  const std::vector<Matrix> nodes = NodesFor(e);
  Eigen::VectorXd whitened = Eigen::VectorXd::Zero(flight_.measurement_rows());
  for (int s = 0; s < static_cast<int>(stacks_.size()); ++s) {
    const Matrix rows = RowsFor(s, e, nodes);
    for (int i = 0; i < rows.rows(); ++i) {
      if (stacks_[s].row[i] >= 0) whitened[stacks_[s].row[i]] = rows(i, 0);
    }
  }
  return whitened;
}

double LogEvidence(const Reduced& reduced, int nuisances) {
  const Eigen::LLT<Matrix> all(reduced.M);
  const Eigen::LLT<Matrix> nuisance(reduced.M.topLeftCorner(nuisances, nuisances));
  if (all.info() != Eigen::Success || nuisance.info() != Eigen::Success) return -1e300;
  const double rss = reduced.rss - reduced.b.dot(all.solve(reduced.b));
  const Matrix L = nuisance.matrixL();
  return reduced.log_weights - 0.5 * rss - 0.5 * reduced.log_det -
         L.diagonal().array().log().sum();
}

}  // namespace trueline
